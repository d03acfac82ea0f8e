//! `hubslosh torque`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Context, Result};
use experiments::profile::{self, SAMPLE, Written};
use experiments::run::Run;

use super::{check_out, write_out};
use crate::terminal;

/// Writes a profile's torque alone: time (s), tau_cmd (N·m), and tau_slope (N·m/s), which is the
/// torque's derivative until the next row.
///
/// A host that sets value and slope at every row drives the FMU exactly as `hubslosh run` does, jumps included: every
/// edge and command of the profile has its row, whatever --step is. The columns time and tau_cmd alone are a torque history for
/// --input, a bench or Simulink.
#[derive(clap::Args)]
#[command(after_help = help())]
pub struct TorqueArgs {
    /// Torque profile, name:key=value,…
    #[arg(long, value_name = "PROFILE", required_unless_present = "profiles")]
    profile: Option<String>,
    /// Largest time between rows, s.
    #[arg(long, value_name = "SECONDS", default_value_t = SAMPLE)]
    step: f64,
    /// Time between the commands of a profile that oscillates, s, as of `hubslosh run`.
    #[arg(long, value_name = "SECONDS", default_value_t = SAMPLE)]
    sample: f64,
    /// Hold the profile from command to command, as of `hubslosh run`: all slopes are 0.
    #[arg(long)]
    hold: bool,
    /// Time of the last row, s [default: the end of the profile].
    #[arg(long, value_name = "SECONDS")]
    stop: Option<f64>,
    /// File for the torque, .csv or .parquet; - prints it as CSV.
    #[arg(long, value_name = "FILE", required_unless_present = "profiles")]
    out: Option<PathBuf>,
    /// Lists the profiles as a Markdown table and writes nothing.
    #[arg(long)]
    profiles: bool,
    /// Lists them as JSON.
    #[arg(long, requires = "profiles")]
    json: bool,
}

impl TorqueArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        if self.profiles {
            match self.json {
                true => terminal::say_json(&profile::list())?,
                false => print!("{}", profile::table()),
            }
            return Ok(());
        }
        let (profile, out) = self.profile.zip(self.out).context("nothing to write")?;
        check_out(&out)?;
        let torque = profile.parse::<Written>()?.torque()?;
        let run = Run {
            settings: Vec::new(),
            input: None,
            stop: self.stop.unwrap_or(torque.span().1),
            torque,
            others: Vec::new(),
            step: self.step,
            sample: self.sample,
            tolerance: None,
            hold: self.hold,
        };
        run.check()?;
        let (table, _) = run.torque_table()?;
        write_out(&table, &out, &BTreeMap::from([("profile".into(), profile)]))
    }
}

fn help() -> String {
    format!(
        "Profiles, with their defaults (torque in N·m, frequencies in Hz, times in s):\n{}\n\
         Example:\n  hubslosh torque --profile bang-stop-bang:amplitude=0.2,bang=2 --step 0.02 --out torque.csv",
        profile::help()
    )
}
