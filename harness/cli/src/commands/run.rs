//! `hubslosh run`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Result, bail};
use bench::profile::{self, Torque, Written};
use bench::run::{Run, driven};
use bench::table;
use host::description::{ModelDescription, Type};
use host::fmi2::Fmu;

use super::{DEFAULT_FMU, setting};
use crate::progress;

/// Simulates one run: a torque history in, signals out.
#[derive(clap::Args)]
#[command(after_help = help())]
pub struct RunArgs {
    /// Torque profile, name:key=value,…
    #[arg(
        long,
        value_name = "PROFILE",
        conflicts_with = "input",
        required_unless_present = "input"
    )]
    profile: Option<String>,
    /// Torque history with the columns time (s) and tau_cmd (N.m), .csv or .parquet.
    #[arg(long, value_name = "FILE")]
    input: Option<PathBuf>,
    /// Sets a parameter or an input by its FMU name; enumerations by name or number.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// Communication step, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.02)]
    step: f64,
    /// Stop time, s [default: the end of the torque history].
    #[arg(long, value_name = "SECONDS")]
    stop: Option<f64>,
    /// Relative tolerance of the FMU's solver [default: the FMU's own].
    #[arg(long, value_name = "NUMBER")]
    tolerance: Option<f64>,
    /// Hold the torque between rows and over each step, instead of joining by lines.
    #[arg(long)]
    hold: bool,
    /// Input that the torque drives [default: tau_cmd, or the FMU's only Real input].
    #[arg(long, value_name = "NAME")]
    drive: Option<String>,
    /// Variables to record beside time and the driven input [default:
    /// omega,omega_imu,slosh_angle,slosh_angle_radial; all outputs of an FMU without these].
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    columns: Vec<String>,
    /// The FMU.
    #[arg(long, value_name = "FILE", default_value = DEFAULT_FMU)]
    fmu: PathBuf,
    /// Where to put the signals, .csv or .parquet.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl RunArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        table::check_ending(&self.out)?;
        let fmu = Fmu::open(&self.fmu)?;
        let torque = match (&self.profile, &self.input) {
            (Some(profile), _) => profile.parse::<Written>()?.torque()?,
            (None, Some(path)) => Torque::read(path, self.hold)?,
            (None, None) => bail!("a run needs --profile or --input"),
        };
        let run = Run {
            settings: self.settings,
            input: driven(fmu.description(), self.drive.as_deref())?,
            stop: self.stop.unwrap_or(torque.span().1),
            torque,
            step: self.step,
            tolerance: self.tolerance,
            hold: self.hold,
        };
        let mut instance = run.initialise(&fmu)?;
        let columns = match self.columns.is_empty() {
            true => default_columns(fmu.description()),
            false => self.columns,
        };
        let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
        let bar = progress::of_steps()?;
        bar.set_length(run.steps() as u64);
        let table = run.drive(&mut instance, &columns, |steps| bar.inc(steps))?;
        bar.finish_and_clear();
        let notes = BTreeMap::from([
            ("fmu".into(), fmu.hash().into()),
            ("guid".into(), fmu.description().guid.clone()),
            ("version".into(), fmu.description().version.clone()),
        ]);
        table.write(&self.out, &notes)?;
        println!("{} rows in {}", table.rows(), self.out.display());
        Ok(())
    }
}

/// What people look at first: of the bench four signals, of another FMU all outputs that are
/// numbers.
fn default_columns(description: &ModelDescription) -> Vec<String> {
    const BENCH: [&str; 4] = ["omega", "omega_imu", "slosh_angle", "slosh_angle_radial"];
    if BENCH.iter().all(|name| description.variable(name).is_ok()) {
        return BENCH.map(String::from).into();
    }
    let outputs = description.variables.iter().filter(|v| v.causality == "output");
    outputs.filter(|v| v.kind() != Type::String).map(|v| v.name.clone()).collect()
}

fn help() -> String {
    format!(
        "Profiles, with their defaults (torque in N.m, frequencies in Hz, times in s):\n{}\n\
         Examples:\n  hubslosh run --profile exp-sweep:amplitude=0.1 --out sweep.parquet\n  \
         hubslosh run --profile sine:amplitude=0.05,frequency=2.344 --set friction.model=none \\\n      \
         --set tank.h=0.05 --step 0.005 --columns theta,omega,slosh_angle --out dwell.csv\n  \
         hubslosh run --input torque.csv --out answer.csv",
        profile::help()
    )
}
