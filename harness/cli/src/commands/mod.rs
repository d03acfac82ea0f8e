use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use host::fmu::Fmu;
use signals::table::{self, Table};

use crate::terminal;

pub mod analyse;
pub mod any_fmu;
pub mod bench_day;
pub mod book;
pub mod campaign;
pub mod check;
pub mod completions;
pub mod design;
pub mod estimates;
pub mod example;
pub mod examples;
pub mod fmus;
pub mod gyro;
pub mod identify;
pub mod pack;
pub mod release;
pub mod review;
pub mod run;
pub mod scale;
pub mod tank;
pub mod torque;
pub mod variables;
pub mod view;

pub const DEFAULT_FMU: &str = "HubSlosh";
pub const DEFAULT_CAMPAIGN: &str = "dist/campaign";

#[derive(clap::Args)]
pub struct RunsArgs {
    /// Number of runs that are simulated at the same time [default: the number of cores].
    #[arg(long, value_name = "NUMBER", default_value_t = 0, hide_default_value = true)]
    pub jobs: usize,
    /// FMU: a file, or the name of an FMU of this project (`hubslosh fmus` lists them).
    #[arg(long, value_name = "FILE|NAME", default_value = DEFAULT_FMU)]
    pub fmu: PathBuf,
}

/// Opens the FMU that the option `--fmu` names. If its library changes a setting of this process
/// while it is loaded, such as the rounding mode, a warning is printed.
pub fn open(name: &Path) -> Result<Fmu> {
    open_with(name, &[])
}

/// Opens the FMU `name` as [`open`] does. Arrays of FMI 3.0 get the sizes that structural
/// parameters among the settings determine.
pub fn open_with(name: &Path, settings: &[(String, String)]) -> Result<Fmu> {
    opened(Fmu::open_with(crate::fmu::find(name)?, settings)?)
}

/// Opens the FMU `name` as [`open_with`] does, and also accepts an FMU that only offers Model
/// Exchange.
pub fn open_to_run(name: &Path, settings: &[(String, String)]) -> Result<Fmu> {
    opened(Fmu::open_to_run(crate::fmu::find(name)?, settings)?)
}

fn opened(fmu: Fmu) -> Result<Fmu> {
    for what in fmu.changed() {
        terminal::warn(format_args!(
            "loading {} has changed the {what} of this process, which an FMU must not do",
            fmu.path().display()
        ));
    }
    Ok(fmu)
}

fn setting(text: &str) -> Result<(String, String)> {
    let (name, value) = text
        .split_once('=')
        .with_context(|| format!("\"{text}\" is not of the form name=value"))?;
    Ok((name.trim().into(), value.trim().into()))
}

/// Checks that a table can be written to `out`.
///
/// # Errors
///
/// If the name neither ends in .csv or .parquet nor is `-`, which means stdout.
fn check_table_name(out: &Path) -> Result<()> {
    if out == Path::new("-") { Ok(()) } else { table::check_ending(out) }
}

fn write_out(table: &Table, out: &Path, metadata: &BTreeMap<String, String>) -> Result<()> {
    if out == Path::new("-") {
        return terminal::quiet_if_closed(table.write_csv(terminal::stdout()));
    }
    table.write(out, metadata)?;
    done!("{} rows in {}", table.rows(), out.display());
    Ok(())
}
