use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use check::{
    Options, RULES, Report, Severity, check, json, junit, process, rules::fmi3, sarif, table,
};
use files::output;

use crate::{fmu, progress, terminal};

/// Checks an FMU 2.0 or 3.0 against the FMI standard and the needs of simulation tools.
///
/// The check reads archive, description and binaries, and calls the binary for this platform as hosts do. The exit
/// code is 0 if there are no errors, 1 if there are errors, and 2 if no selected rule could be checked. Warnings do
/// not change it, unless --strict is given.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  hubslosh check dist/HubSlosh.fmu\n  \
    hubslosh check other.fmu --only zip,xml --junit check.xml\n  hubslosh check --rules")]
pub struct CheckArgs {
    /// FMU: a file, or the name of an FMU of this project (`hubslosh fmus` lists them).
    #[arg(value_name = "FMU", required_unless_present = "rules")]
    fmu: Option<PathBuf>,
    /// File for the report as JUnit XML, with a test case for each rule.
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// File for the report as JSON, with an object for each rule. If no file follows the flag, the JSON is printed; the
    /// flag must then be the last one.
    #[arg(long, value_name = "FILE", num_args = 0..=1)]
    json: Option<Option<PathBuf>>,
    /// File for the findings as SARIF 2.1.0, a format that code hosting services such as GitHub display.
    #[arg(long, value_name = "FILE")]
    sarif: Option<PathBuf>,
    /// Rules, such as zip.names, or groups of rules, such as zip, to check [default: all].
    #[arg(long, value_name = "RULE,…", value_delimiter = ',')]
    only: Vec<String>,
    /// Longest time that the calls of one rule may take, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    limit: f64,
    /// Lists the rules for FMI 2.0 and FMI 3.0 as Markdown tables, and checks nothing.
    #[arg(long)]
    rules: bool,
}

#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Unchecked(String);

/// Arguments of the separate process in which `check` makes the calls of one rule, so that a crash
/// or a hang of the FMU does not end the check.
#[derive(clap::Args)]
pub struct CheckCallsArgs {
    rule: String,
    directory: PathBuf,
    fmu: PathBuf,
    description: PathBuf,
    limit: f64,
}

pub fn checked(fmu: &Path, only: Vec<String>, limit: Duration) -> Result<Report> {
    let program = std::env::current_exe().context("the path of this program cannot be found")?;
    let bar = progress::rules_bar()?;
    let report = check(fmu, &Options { program, only, limit }, |rules| {
        bar.set_length(rules as u64);
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    Ok(report)
}

impl CheckArgs {
    pub fn run(self) -> Result<()> {
        if self.rules {
            match self.json {
                Some(_) => terminal::print_json(&check::rules())?,
                None => {
                    print!("## FMI 2.0\n\n{}\n## FMI 3.0\n\n{}", table(RULES), table(fmi3::RULES));
                }
            }
            return Ok(());
        }
        let fmu = &fmu::find(self.fmu.as_ref().context("no FMU is given")?)?;
        let limit = Duration::try_from_secs_f64(self.limit).ok().filter(|limit| !limit.is_zero());
        let limit =
            limit.with_context(|| format!("--limit {} (allowed: above 0 s)", self.limit))?;
        let report = checked(fmu, self.only.clone(), limit)?;
        match &self.json {
            Some(None) => json::write(&report, &mut terminal::stdout())?,
            _ if terminal::has_reader() => {}
            _ => print!("{}", report.text()),
        }
        if let Some(path) = &self.junit {
            output::atomically(path, |file| junit::write(&report, file))?;
        }
        if let Some(Some(path)) = &self.json {
            output::atomically(path, |file| json::write(&report, file))?;
        }
        if let Some(path) = &self.sarif {
            output::atomically(path, |file| sarif::write(&report, file))?;
        }
        if let warnings @ 1.. = report.count_findings(Severity::Warning) {
            terminal::warn(format_args!("{} has {warnings} warnings", fmu.display()));
        }
        if let Some(bug) = &report.bug {
            bail!("{bug}");
        }
        if let Some(why) = &report.unchecked {
            return Err(Unchecked(format!("{}: {why}", fmu.display())).into());
        }
        if terminal::has_reader() {
            let mut text = Vec::new();
            json::write(&report, &mut text)?;
            terminal::message("result", &String::from_utf8(text)?);
        }
        match report.count_findings(Severity::Error) {
            0 => Ok(()),
            errors => bail!("{} breaks the rules in {errors} places", fmu.display()),
        }
    }
}

impl CheckCallsArgs {
    pub fn run(self) -> Result<()> {
        let limit = Duration::try_from_secs_f64(self.limit).context("no time limit")?;
        let fmu = process::Unpacked {
            path: &self.fmu,
            directory: &self.directory,
            description: &self.description,
        };
        process::check_in_child(&self.rule, fmu, limit)
    }
}
