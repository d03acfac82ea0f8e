//! The example that travels with the FMU: a torque history, and what the FMU answers to it. The
//! files' names are those of the FMI project's rules for exchanged reference results.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;

use anyhow::{Context, Result};

use crate::profile::Torque;
use crate::rounding::significant;
use crate::run::{Run, driven};
use host::description::ModelDescription;
use host::fmi2::Fmu;
use host::output;
use signals::table::Table;

/// The torque: `time` (s), `tau_cmd` (N.m).
pub const INPUT: &str = "HubSlosh_in.csv";
/// The answer: `time` and every output.
pub const REFERENCE: &str = "HubSlosh_ref.csv";
/// Start, stop, step and tolerance.
pub const OPTIONS: &str = "HubSlosh_ref.opt";

/// Length of the example and its communication step, s.
const STOP: f64 = 20.0;
const STEP: f64 = 0.02;
/// Every so many steps the reference has a row.
const EVERY: usize = 5;
/// Tolerance of the reference; results of the FMU's default tolerance lie within 1e-6 of it.
const TOLERANCE: f64 = 1e-12;

/// Writes input, options and reference to `folder`, the reference from the given FMU.
pub fn write(fmu: &Fmu, folder: &Path) -> Result<()> {
    output::directory(folder)?;
    let none = BTreeMap::new();
    let input = folder.join(INPUT);
    torque().write(&input, &none)?;
    // what is compared with is the answer to the file, with the digits that are in it
    let answer = replay(fmu, &input, Some(TOLERANCE), false)?;
    thinned(&answer).write(&folder.join(REFERENCE), &none)?;
    let options =
        format!("StartTime, 0\nStopTime, {STOP}\nStepSize, {STEP}\nRelTol, {TOLERANCE:e}\n");
    let path = folder.join(OPTIONS);
    std::fs::write(&path, options).with_context(|| format!("{} was not written", path.display()))
}

/// Drives the FMU with the torque of a file; `hold`: held over each step, as a host does that
/// does not know slopes.
pub fn replay(fmu: &Fmu, input: &Path, tolerance: Option<f64>, hold: bool) -> Result<Table> {
    let torque = Torque::read(input, hold)?;
    let (_, stop) = torque.span();
    let run = Run {
        settings: vec![],
        input: driven(fmu.description(), None)?,
        torque,
        others: Vec::new(),
        step: STEP,
        stop,
        tolerance,
        hold,
    };
    let columns = outputs(fmu.description());
    let mut instance = run.initialise(fmu)?;
    run.drive(&mut instance, &columns, |_| {})
}

/// A sine below the sloshing frequency that swells and fades, then nothing: the hub slips, reverses
/// and comes to rest, while the liquid still pulls at it.
fn torque() -> Table {
    let rows = (STOP / STEP).round() as usize;
    let time: Vec<f64> = (0..=rows).map(|row| round(row as f64 * STEP, 6)).collect();
    let swell = |t: f64| (t / 2.0).min((10.0 - t) / 2.0).clamp(0.0, 1.0);
    let tau = time.iter().map(|&t| round(0.1 * swell(t) * (TAU * 2.0 * t).sin(), 6)).collect();
    Table::new(vec!["time".into(), "tau_cmd".into()], vec![time, tau])
}

fn outputs(description: &ModelDescription) -> Vec<&str> {
    let outputs = description.variables.iter().filter(|v| v.causality == "output");
    outputs.map(|v| v.name.as_str()).collect()
}

/// Every so many rows, nine digits, without the torque.
fn thinned(answer: &Table) -> Table {
    let names: Vec<String> = answer.names().iter().filter(|n| *n != "tau_cmd").cloned().collect();
    let column = |name: &String| {
        let values = answer.column(name).unwrap_or_default();
        values.iter().step_by(EVERY).map(|&x| significant(x, 9)).collect()
    };
    let columns = names.iter().map(column).collect();
    Table::new(names, columns)
}

/// `x` with so many decimals.
fn round(x: f64, decimals: i32) -> f64 {
    let unit = 10f64.powi(decimals);
    (x * unit).round() / unit
}
