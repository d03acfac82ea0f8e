//! `hubslosh campaign`.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail, ensure};
use bench::campaign::Campaign;
use bench::plan::{self, Plan, Sweeps};
use bench::report;
use host::fmi2::Fmu;

use super::{DEFAULT_CAMPAIGN, DEFAULT_FMU, setting};
use crate::progress;

/// Simulates a plan's runs, or the sine sweeps of Rubaga's thesis at several fills and amplitudes,
/// analyses them and reports.
///
/// Stored runs of the same model, binary, parameters and profile are reused.
#[derive(clap::Args)]
#[command(after_help = help())]
pub struct CampaignArgs {
    /// Plan: a TOML file, or the name of a built-in plan (below).
    #[arg(
        long,
        value_name = "FILE",
        conflicts_with_all = ["model", "fills", "amplitudes", "sweep", "settings", "tolerance"]
    )]
    plan: Option<String>,
    /// Print the runs as JSON for another program to simulate, and simulate none.
    #[arg(long)]
    list: bool,
    /// Slosh models, by name.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', default_value = "linear")]
    model: Vec<String>,
    /// Fills, m.
    #[arg(long, value_name = "M,…", value_delimiter = ',', default_values_t = plan::FILLS)]
    fills: Vec<f64>,
    /// Torque amplitudes, N.m.
    #[arg(long, value_name = "NM,…", value_delimiter = ',', default_values_t = plan::AMPLITUDES)]
    amplitudes: Vec<f64>,
    /// How the frequency grows from 1.25 to 3.5 Hz in 2700 s.
    #[arg(long, value_enum, default_value = "exponential")]
    sweep: Sweep,
    /// Sets a parameter or an input by its FMU name; enumerations by name or number.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// Relative tolerance of the FMU's solver [default: the FMU's own].
    #[arg(long, value_name = "NUMBER")]
    tolerance: Option<f64>,
    /// Simulate again what is stored already.
    #[arg(long)]
    force: bool,
    /// The FMU.
    #[arg(long, value_name = "FILE", default_value = DEFAULT_FMU)]
    fmu: PathBuf,
    /// Directory for runs, tables and report.html [default: dist/campaign, or dist/ and the plan's
    /// name].
    #[arg(long, value_name = "DIRECTORY")]
    out: Option<PathBuf>,
}

/// How the frequency of `campaign`'s sweep grows.
#[derive(Clone, Copy, clap::ValueEnum)]
enum Sweep {
    /// Exponentially.
    Exponential,
    /// Linearly in time.
    Linear,
}

impl CampaignArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        let (plan, out) = match &self.plan {
            Some(file) => {
                let stem = Path::new(file).file_stem().unwrap_or_default();
                (Plan::read(file)?, Path::new("dist").join(stem))
            }
            None => (self.flags_as_plan()?, DEFAULT_CAMPAIGN.into()),
        };
        let out = self.out.clone().unwrap_or(out);
        let campaign = Campaign { plan, force: self.force, out };
        let fmu = Fmu::open(&self.fmu)?;
        if self.list {
            println!("{:#}", campaign.list(&fmu)?);
            return Ok(());
        }
        drive(&fmu, &campaign)
    }

    /// The plan that the flags without `--plan` stand for.
    fn flags_as_plan(&self) -> Result<Plan> {
        for (name, _) in &self.settings {
            ensure!(
                !["slosh.model", "tank.h", "tau_cmd"].contains(&name.as_str()),
                "{name} is what the campaign varies; use --model, --fills, --amplitudes"
            );
        }
        Plan::sweeps(Sweeps {
            models: self.model.clone(),
            fills: self.fills.clone(),
            amplitudes: self.amplitudes.clone(),
            profile: match self.sweep {
                Sweep::Exponential => "exp-sweep",
                Sweep::Linear => "lin-sweep",
            },
            set: self.settings.clone(),
            tolerance: self.tolerance,
        })
    }
}

/// Carries a campaign out and leaves tables and report.
pub fn drive(fmu: &Fmu, campaign: &Campaign) -> Result<()> {
    let bar = progress::of_runs()?;
    let results = campaign.execute(fmu, &|news| progress::show(&bar, news))?;
    bar.finish_and_clear();
    campaign.write_tables(fmu, &results)?;
    let (all, reused) = results.counts();
    println!("{} runs simulated, {reused} reused", all - reused);
    let file = |name: &str| campaign.out.join(name);
    if results.unanalysed.is_empty() {
        let page = file("report.html");
        report::write(&page, campaign, fmu, &results)?;
        println!("features: {}", file("features.csv").display());
        println!("runs:     {}\nreport:   {}", file("runs.csv").display(), page.display());
    } else {
        println!(
            "runs:     {} (the FMU is not the bench: no analysis)",
            file("runs.csv").display()
        );
    }
    for failure in &results.failures {
        eprintln!("{} failed: {}", failure.case.name, failure.reason);
    }
    if !results.failures.is_empty() {
        bail!("{} of the campaign's runs failed", results.failures.len());
    }
    Ok(())
}

fn help() -> String {
    let mut plans = String::new();
    for (name, text) in plan::BUILT_IN {
        let title = Plan::parse(text).map(|plan| plan.title).unwrap_or_default();
        plans.push_str(&format!("  {name:18} {title}\n"));
    }
    format!(
        "Built-in plans:\n{plans}\n\
         Examples:\n  hubslosh campaign\n  \
         hubslosh campaign --plan thesis_models\n  \
         hubslosh campaign --plan mine.toml --out dist/mine\n  \
         hubslosh campaign --fills 0.05,0.1 --amplitudes 0.1 --set friction.model=viscous --out dist/viscous"
    )
}
