use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Context, Result};
use experiments::profile::{self, SAMPLE, Written};
use experiments::run::Run;

use super::{check_table_name, write_out};
use crate::terminal;

/// Writes the torque of a profile as a table, for a bench or for another host than `hubslosh run`.
///
/// The columns are time (s), tau_cmd (N·m) and tau_slope (N·m/s), the derivative of tau_cmd until the next row. The
/// table has a row at every jump and every torque value of the profile, whatever --step is. Therefore a host that sets
/// torque and slope at every row drives the FMU exactly as `hubslosh run` does, including jumps. For
/// `hubslosh run --input`, a bench or Simulink the columns time and tau_cmd are enough.
#[derive(clap::Args)]
#[command(after_help = help())]
pub struct TorqueArgs {
    /// Torque profile with its settings, such as sine:amplitude=0.05,frequency=2.4. The profiles are listed at the end
    /// of this help.
    #[arg(long, value_name = "PROFILE", required_unless_present = "profiles")]
    profile: Option<String>,
    /// Largest time between rows, s.
    #[arg(long, value_name = "SECONDS", default_value_t = SAMPLE)]
    step: f64,
    /// Time between the torque values of an oscillating profile, such as a sine or a sweep, s. The values are joined
    /// by straight lines, or held with --hold. `hubslosh run` has the same option.
    #[arg(long, value_name = "SECONDS", default_value_t = SAMPLE)]
    sample: f64,
    /// Holds each torque value of the profile until the next value (zero-order hold) instead of interpolating linearly.
    /// The column tau_slope is then 0.
    #[arg(long)]
    hold: bool,
    /// Time of the last row, s [default: the end of the profile].
    #[arg(long, value_name = "SECONDS")]
    stop: Option<f64>,
    /// File for the torque, .csv or .parquet. The value `-` prints the torque as CSV.
    #[arg(long, value_name = "FILE", required_unless_present = "profiles")]
    out: Option<PathBuf>,
    /// Lists the profiles as a Markdown table and writes nothing.
    #[arg(long)]
    profiles: bool,
    /// Lists the profiles as JSON.
    #[arg(long, requires = "profiles")]
    json: bool,
}

impl TorqueArgs {
    pub fn run(self) -> Result<()> {
        if self.profiles {
            match self.json {
                true => terminal::print_json(&profile::list())?,
                false => print!("{}", profile::table()),
            }
            return Ok(());
        }
        let (profile, out) = self.profile.zip(self.out).context("nothing to write")?;
        check_table_name(&out)?;
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
