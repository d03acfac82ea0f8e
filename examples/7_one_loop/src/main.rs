//! Packs the controller's FMU, then simulates the closed loop of controller and plant with the
//! harness's host. It does so twice: with inputs held during each step, and with inputs that follow
//! the derivatives given by the other FMU.
//!
//!     cargo run --release -p one-loop -- dist/HubSlosh.fmu dist
//!
//! writes Controller.fmu, loop_held.csv and loop_slopes.csv into that directory.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use host::fmi2::{Fmu, Instance};

/// Communication step of the two FMUs, s.
const STEP: f64 = 0.02;
const STEPS: usize = 3000;

const PLANT: [(&str, &str); 3] =
    [("init.slosh_angle", "0.1"), ("tank.h", "0.05"), ("friction.kind", "2")];

const RECORDED: [&str; 3] = ["theta", "omega", "slosh_angle"];

fn main() -> Result<()> {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [fmu, folder] = &arguments[..] else {
        bail!("usage: one-loop HUBSLOSH.fmu DIRECTORY");
    };
    let controller = folder.join("Controller.fmu");
    let xml = model_description::xml::<Controller::controller::Controller>()?;
    pack::archive::plain(
        &xml,
        &pack::build("controller-fmu", true)?,
        "Controller",
        None,
        &controller,
    )?;
    let (plant, controller) = (Fmu::open(fmu)?, Fmu::open(&controller)?);
    for (slopes, name) in [(false, "loop_held.csv"), (true, "loop_slopes.csv")] {
        let rows = closed_loop(&plant, &controller, slopes)?;
        write(&folder.join(name), &rows)?;
        println!("{}", folder.join(name).display());
    }
    Ok(())
}

/// Simulates the closed loop of plant and controller. In each step both FMUs use the values that
/// were exchanged at its beginning (a Jacobi master). If `slopes` is true, the inputs change
/// linearly during a step; otherwise they are held. Returns the rows of time, tau and the recorded
/// variables.
fn closed_loop(plant: &Fmu, controller: &Fmu, slopes: bool) -> Result<Vec<Vec<f64>>> {
    let mut plant = started(plant, &PLANT)?;
    let mut controller = started(controller, &[])?;
    let references = |instance: &Instance, names: &[&str]| -> Result<Vec<u32>> {
        let description = instance.fmu().description();
        let find = |name: &&str| description.variable(name).map(|v| v.reference);
        names.iter().map(|n| find(n).with_context(|| format!("no variable {n}"))).collect()
    };
    let angles = references(&plant, &["theta", "omega", "omega_dot"])?;
    let torque = references(&controller, &["tau", "der(tau)"])?;
    let recorded = references(&plant, &RECORDED)?;
    let tau_cmd = references(&plant, &["tau_cmd"])?;
    let inputs = references(&controller, &["theta", "omega"])?;

    let mut rows = Vec::new();
    for k in 0..=STEPS {
        let time = k as f64 * STEP;
        let (mut measured, mut tau, mut row) = ([0.0; 3], [0.0; 2], [0.0; RECORDED.len()]);
        plant.get_real(&angles, &mut measured)?;
        plant.get_real(&recorded, &mut row)?;
        // der(tau) depends on the inputs, which are therefore set before it is read
        controller.set_real(&inputs, &measured[..2])?;
        controller.get_real(&torque, &mut tau)?;
        plant.set_real(&tau_cmd, &tau[..1])?;
        if slopes {
            controller.set_real_input_derivatives(&inputs, &[1, 1], &measured[1..])?;
            plant.set_real_input_derivatives(&tau_cmd, &[1], &tau[1..])?;
        }
        rows.push([&[time, tau[0]], &row[..]].concat());
        if k < STEPS {
            let step = (k + 1) as f64 * STEP - time;
            plant.do_step(time, step)?;
            controller.do_step(time, step)?;
        }
    }
    Ok(rows)
}

fn started<'a>(fmu: &'a Fmu, settings: &[(&str, &str)]) -> Result<Instance<'a>> {
    let mut instance = fmu.instantiate("loop")?;
    for (name, value) in settings {
        instance.set(name, value)?;
    }
    instance.setup_experiment(None, 0.0, None)?;
    instance.enter_initialization_mode()?;
    instance.exit_initialization_mode()?;
    Ok(instance)
}

fn write(path: &Path, rows: &[Vec<f64>]) -> Result<()> {
    files::output::atomically(path, |file| {
        let mut csv = csv::Writer::from_writer(file);
        csv.write_record([&["time", "tau"], &RECORDED[..]].concat())?;
        for row in rows {
            // the shortest text that is parsed to the same number
            csv.write_record(row.iter().map(f64::to_string))?;
        }
        Ok(csv.flush()?)
    })
}
