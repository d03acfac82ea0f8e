//! `hubslosh gyro`.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

use anyhow::Result;
use experiments::gyro::Recording;
use host::fmi2::Fmu;
use host::output;

use super::{DEFAULT_FMU, setting};
use crate::progress;

/// Where its files go.
const DEFAULT_GYRO: &str = "dist/gyro";

/// Records the gyro for hours at rest, estimates its noise from the Allan deviation and compares it
/// with the specified noise. Leaves allan.csv and allan.svg.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  hubslosh gyro\n  \
    hubslosh gyro --set imu.arw=1e-4 --set imu.bias_time=300 --hours 12 --out dist/other_gyro")]
pub struct GyroArgs {
    /// Length of each record, h.
    #[arg(long, value_name = "HOURS", default_value_t = 6.0)]
    hours: f64,
    /// Number of records; their imu.seed counts from 1.
    #[arg(long, value_name = "NUMBER", default_value_t = 8)]
    records: usize,
    /// Sets a parameter by its FMU name.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// The FMU.
    #[arg(long, value_name = "FILE", default_value = DEFAULT_FMU)]
    fmu: PathBuf,
    /// Directory for allan.csv and allan.svg.
    #[arg(long, value_name = "DIRECTORY", default_value = DEFAULT_GYRO)]
    out: PathBuf,
}

impl GyroArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        let recording =
            Recording { settings: self.settings, hours: self.hours, records: self.records };
        let bar = progress::of_steps()?;
        let found =
            recording.characterise(&Fmu::open(&self.fmu)?, &|news| progress::show(&bar, news))?;
        bar.finish_and_clear();
        output::directory(&self.out)?;
        let [table, picture] = ["allan.csv", "allan.svg"].map(|name| self.out.join(name));
        found.table().write(&table, &BTreeMap::new())?;
        output::atomically(&picture, |file| {
            Ok(file.write_all(report::gyro::allan_deviations(&found).as_bytes())?)
        })?;
        print!("{}", found.text());
        println!("{}\n{}", table.display(), picture.display());
        Ok(())
    }
}
