//! The example of each FMU: histories of inputs, and the FMU's outputs. The file names follow the rules of the FMI project
//! for exchanged reference results.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;

use anyhow::{Context, Result};

use crate::rounding::significant;
use crate::run::{Run, histories};
use files::output;
use host::causality::Causality;
use host::description::ModelDescription;
use host::fmu::Fmu;
use names::hubslosh::TAU_CMD;
use signals::table::Table;

#[derive(Clone, Copy, Debug)]
pub struct Example {
    pub model: &'static str,
    inputs: &'static [(&'static str, f64, Course)],
}

/// Shape of an input over time t, s, with the largest value 1.
type Course = fn(t: f64) -> f64;

/// A sine of 2 Hz, below the slosh frequency of the bench, that grows and fades within ten seconds; the torque is 0
/// afterwards. The hub slips, reverses and comes to rest while the liquid still oscillates.
const BENCH: Course = |t| swell(t) * (TAU * 2.0 * t).sin();
const THRUST: Course = |_| 1.0;
/// A sine of 0.4 Hz, near the slosh frequency of the default tank under 1.5 m/s² (0.42 Hz with the tank held), that grows
/// and fades within ten seconds; afterwards the liquid oscillates freely. The inputs have different phases, so that no
/// output stays 0.
const NEAR_SLOSH: Course = |t| swell(t) * (TAU * 0.4 * t).sin();
const BELOW_SLOSH: Course = |t| swell(t) * (TAU * 0.25 * t).sin();
const SLOW: Course = |t| swell(t) * (TAU * 0.1 * t).cos();

fn swell(t: f64) -> f64 {
    (t / 2.0).min((10.0 - t) / 2.0).clamp(0.0, 1.0)
}

/// The examples, one for each FMU. Each input has a name, a largest value and a shape over time. The 2340 N for
/// Spacecraft accelerate the default craft with its liquid, 1562 kg, by 1.5 m/s², because the damping of its tank is
/// valid at this acceleration.
pub const EXAMPLES: [Example; 3] = [
    Example { model: "HubSlosh", inputs: &[(TAU_CMD, 0.1, BENCH)] },
    Example {
        model: "Spacecraft",
        inputs: &[
            ("force[3]", 2340.0, THRUST),
            ("torque[1]", 10.0, BELOW_SLOSH),
            ("torque[2]", 20.0, NEAR_SLOSH),
            ("torque[3]", 5.0, SLOW),
        ],
    },
    Example {
        model: "SloshTank",
        inputs: &[
            ("a[1]", 0.02, NEAR_SLOSH),
            ("a[2]", 0.02, BELOW_SLOSH),
            ("a[3]", 1.5, THRUST),
            ("omega_dot[1]", 0.01, NEAR_SLOSH),
            ("omega_dot[2]", 0.01, BELOW_SLOSH),
            ("omega_dot[3]", 0.005, SLOW),
        ],
    },
];

const STOP: f64 = 20.0;
const STEP: f64 = 0.02;
const EVERY: usize = 5;
/// Tolerance of the reference result. Results with the FMU's default tolerance differ from it by less than 1e-6.
const TOLERANCE: f64 = 1e-12;

impl Example {
    pub fn for_fmu(fmu: &Fmu) -> Result<&'static Example> {
        let model = &fmu.description().model_name;
        let found = EXAMPLES.iter().find(|example| example.model == model);
        found.with_context(|| {
            let all = EXAMPLES.map(|example| example.model).join(", ");
            format!("{model} has no example (there are: {all})")
        })
    }

    pub fn input(&self) -> String {
        format!("{}_in.csv", self.model)
    }

    pub fn reference(&self) -> String {
        format!("{}_ref.csv", self.model)
    }

    pub fn options(&self) -> String {
        format!("{}_ref.opt", self.model)
    }

    pub fn write(&self, fmu: &Fmu, folder: &Path) -> Result<()> {
        output::directory(folder)?;
        let none = BTreeMap::new();
        let input = folder.join(self.input());
        self.histories().write(&input, &none)?;
        // the reference result is computed with the inputs in the written file, whose numbers are rounded
        let answer = replay(fmu, &input, Some(TOLERANCE), false)?;
        thinned(fmu.description(), &answer).write(&folder.join(self.reference()), &none)?;
        let options =
            format!("StartTime, 0\nStopTime, {STOP}\nStepSize, {STEP}\nRelTol, {TOLERANCE:e}\n");
        output::write(&folder.join(self.options()), options)
    }

    fn histories(&self) -> Table {
        let rows = (STOP / STEP).round() as usize;
        let time: Vec<f64> = (0..=rows).map(|row| round(row as f64 * STEP, 6)).collect();
        let inputs = self.inputs.iter().map(|(name, amplitude, course)| {
            (*name, time.iter().map(|&t| round(amplitude * course(t), 6)).collect())
        });
        Table::of([("time", time.clone())].into_iter().chain(inputs))
    }
}

/// Simulates the FMU with the histories of inputs in a file. With `hold` the inputs are constant
/// over each step, as by a host that does not set slopes.
pub fn replay(fmu: &Fmu, input: &Path, tolerance: Option<f64>, hold: bool) -> Result<Table> {
    let description = fmu.description();
    let mut others = histories(description, input, None, hold, false, &mut |_| {})?;
    let (first, torque) = others.remove(0);
    let (_, stop) = torque.span();
    let run = Run {
        settings: vec![],
        input: Some(first),
        torque,
        others,
        step: STEP,
        sample: STEP,
        stop,
        tolerance,
        hold,
    };
    let columns = outputs(description);
    let mut instance = run.initialise(fmu)?;
    run.drive(&mut instance, &columns, |_| {})
}

fn outputs(description: &ModelDescription) -> Vec<&str> {
    let outputs = description.variables.iter().filter(|v| v.causality == Causality::Output);
    outputs.map(|v| v.name.as_str()).collect()
}

fn thinned(description: &ModelDescription, answer: &Table) -> Table {
    Table::of(["time"].into_iter().chain(outputs(description)).map(|name| {
        let values = answer.column(name).unwrap_or_default().iter().step_by(EVERY);
        (name, values.map(|&x| significant(x, 9)).collect())
    }))
}

fn round(x: f64, decimals: i32) -> f64 {
    let unit = 10f64.powi(decimals);
    (x * unit).round() / unit
}
