use std::path::{Path, PathBuf};

use anyhow::{Result, bail, ensure};
use experiments::campaign::{CURVES, Campaign, seek_onset};
use experiments::plan::{self, AMPLITUDE, Draft, Plan};
use experiments::progress::Progress;
use files::budget;
use files::store::Store;
use host::causality::Causality;
use host::fmu::Fmu;
use host::guard;
use names::hubslosh::{TAU_CMD, slosh, tank};
use report::campaign::Chapter;

use super::{DEFAULT_CAMPAIGN, RunsArgs, open, setting, view};
use crate::{progress, terminal};

/// Simulates all runs of a plan, analyses them and writes a report; by default the sine sweeps of Rubaga's thesis.
///
/// Runs are stored, and reused if model, binary, parameters and profile are the same.
#[derive(clap::Args)]
#[command(after_help = help())]
pub struct CampaignArgs {
    /// Plan: a TOML file, or the name of a built-in plan. The built-in plans are listed at the end of this help.
    #[arg(
        long,
        value_name = "FILE",
        conflicts_with_all = ["model", "fills", "amplitudes", "sweep", "settings", "tolerance"]
    )]
    plan: Option<String>,
    /// Prints the runs as JSON and simulates none, so that another program can simulate them.
    #[arg(long)]
    list: bool,
    /// Slosh models with which each sweep is simulated.
    ///
    /// - frozen: the whole liquid is rigid
    ///
    /// - linear: linear planar pendulums
    ///
    /// - planar: nonlinear planar pendulums
    ///
    /// - spherical: spherical pendulums, which can rotate (rotary slosh)
    ///
    /// - liquid: slosh modes to third order in their amplitude
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', default_values = plan::MODELS)]
    model: Vec<String>,
    /// Heights of the liquid in the tank for which the sweeps are simulated, m.
    #[arg(long, value_name = "M,…", value_delimiter = ',', default_values_t = plan::FILLS)]
    fills: Vec<f64>,
    /// Torque amplitudes of the sweeps, N·m.
    #[arg(long, value_name = "NM,…", value_delimiter = ',', default_values_t = plan::AMPLITUDES)]
    amplitudes: Vec<f64>,
    /// Growth of the frequency of the sweeps from 1.25 to 3.5 Hz in 2700 s.
    #[arg(long, value_enum, default_value = "exponential")]
    sweep: Sweep,
    /// Sets a parameter or an input by its name in the FMU. A number is in SI units or has a unit of the variable (50mm);
    /// an item of an enumeration is given by name or number.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// Relative tolerance of the FMU's solver [default: the FMU's own].
    #[arg(long, value_name = "NUMBER")]
    tolerance: Option<f64>,
    /// Simulates all runs again, including those that are stored.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    pub runs: RunsArgs,
    /// Directory for runs, tables and report.html [default: dist/campaign, to whose name the options that change the
    /// campaign are appended; with --plan, dist/NAME with the name of the plan].
    #[arg(long, value_name = "DIRECTORY")]
    out: Option<PathBuf>,
    /// Replaces the tables and the report of another plan in the default directory. Without this option the command
    /// refuses to replace them.
    #[arg(long)]
    replace: bool,
}

/// Longest name of a default results directory, bytes. In a longer name the flags are replaced by
/// their hash.
const LONGEST: usize = 100;

#[derive(Clone, Copy, clap::ValueEnum)]
enum Sweep {
    /// The frequency grows exponentially with time.
    Exponential,
    /// The frequency grows linearly with time.
    Linear,
}

impl CampaignArgs {
    pub fn run(self) -> Result<()> {
        let (plan, out) = match &self.plan {
            Some(file) => {
                let stem = Path::new(file).file_stem().unwrap_or_default();
                (Plan::read(file)?, Path::new("dist").join(stem))
            }
            None => (self.flags_as_plan()?, self.directory()),
        };
        let named = self.out.is_some();
        let out = self.out.clone().unwrap_or(out);
        let mut campaign = Campaign { plan, force: self.force, jobs: self.runs.jobs, out };
        let fmu = open(&self.runs.fmu)?;
        campaign.plan.convert_units(fmu.description());
        seek_onset(&mut campaign.plan, &fmu, self.runs.jobs, &|news| {
            if let Progress::Note(line) = news {
                terminal::note(format_args!("{line}"));
            }
        })?;
        if self.list {
            println!("{:#}", campaign.list(&fmu)?);
            return Ok(());
        }
        campaign.plan.cases(fmu.description())?; // fails for a wrong plan before anything is replaced
        let store = campaign.take()?;
        // The default directory belongs to the campaign without flags, which may replace its contents.
        let own = campaign.out == Path::new(DEFAULT_CAMPAIGN);
        if campaign.holds_another() && !own && !self.replace {
            let (out, file) = (campaign.out.display(), campaign.plan_file());
            ensure!(
                named,
                "{out} holds the campaign of another plan ({}): --out DIRECTORY writes this campaign to another directory, --replace replaces tables and report (equal runs are reused)",
                file.display()
            );
            terminal::note(format_args!(
                "{out} held the campaign of another plan; its tables and report are replaced"
            ));
        }
        drive(&fmu, &campaign, store, Vec::new())
    }

    /// Returns the results directory for these flags. The default campaign has `dist/campaign`; for
    /// other flags the name of the directory states the flags that differ from the default.
    fn directory(&self) -> PathBuf {
        let numbers =
            |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join("-");
        let mut parts = Vec::new();
        if self.model != plan::MODELS {
            parts.push(self.model.join("-"));
        }
        if self.fills != plan::FILLS {
            parts.push(format!("fills_{}", numbers(&self.fills)));
        }
        if self.amplitudes != plan::AMPLITUDES {
            parts.push(format!("amplitudes_{}", numbers(&self.amplitudes)));
        }
        if let Sweep::Linear = self.sweep {
            parts.push("lin-sweep".into());
        }
        parts.extend(self.settings.iter().map(|(name, value)| format!("{name}_{value}")));
        parts.extend(self.tolerance.map(|tolerance| format!("tolerance_{tolerance:e}")));
        let name: String =
            [DEFAULT_CAMPAIGN.into()].into_iter().chain(parts).collect::<Vec<_>>().join("_");
        let plain = |c: char| if c.is_alphanumeric() || "/._-".contains(c) { c } else { '_' };
        let name: String = name.chars().map(plain).collect();
        if name.len() <= LONGEST {
            return name.into();
        }
        format!("{DEFAULT_CAMPAIGN}_{}", &files::output::sha256(name.as_bytes())[..12]).into()
    }

    fn flags_as_plan(&self) -> Result<Plan> {
        for (name, _) in &self.settings {
            ensure!(
                ![slosh::MODEL, tank::H, TAU_CMD].contains(&name.as_str()),
                "--set {name}: the campaign varies this quantity itself; use --model, --fills or --amplitudes"
            );
        }
        let kind = match self.sweep {
            Sweep::Exponential => "exp-sweep",
            Sweep::Linear => "lin-sweep",
        };
        let texts = |values: &[f64]| values.iter().map(f64::to_string).collect();
        let draft = Draft {
            title: "Sweeps at several fills and amplitudes".into(),
            profile: format!("{kind}:f0=1.25,f1=3.5,duration=2700"),
            tolerance: self.tolerance,
            set: self.settings.clone(),
            vary: vec![
                (slosh::MODEL, self.model.clone()),
                (tank::H, texts(&self.fills)),
                (AMPLITUDE, texts(&self.amplitudes)),
            ],
            ..Draft::default()
        };
        draft.plan()
    }
}

/// Simulates and analyses the runs of a campaign, and writes its tables and its report, which
/// begins with `chapters`.
pub fn drive(fmu: &Fmu, campaign: &Campaign, store: Store, chapters: Vec<Chapter>) -> Result<()> {
    let cases = campaign.plan.cases(fmu.description())?;
    let rows: Vec<usize> = cases.iter().map(|case| case.run().steps()).collect();
    let courses = cases.iter().map(|case| case.run().course_bytes()).max().unwrap_or(0);
    drop(cases);
    let columns =
        fmu.description().variables.iter().filter(|v| v.causality == Causality::Output).count();
    let jobs = budget::jobs(campaign.jobs, 0)?;
    let largest = rows.iter().max().copied().unwrap_or(0) * (columns + 20) * 8;
    // memory for tables and their spectra, and for the data of each run that the report keeps
    let kept = rows.len().min(CURVES) * (4 << 20) + rows.len() * (64 << 10);
    let jobs = jobs.min(rows.len());
    guard::allow((jobs * largest * 4 + kept) as u64 + jobs as u64 * courses);
    let bar = progress::runs_bar()?;
    let results = campaign.execute(fmu, &store, &|news| progress::show(&bar, news))?;
    bar.finish_and_clear();
    let mut files = campaign.tables(fmu, &results)?;
    files.push(("plan.toml", campaign.plan.text.clone().into_bytes()));
    let telling = report::campaign::most_swirling_run(&results);
    let shown = match telling {
        Some(run) => Some(view::page_of_stored_run(
            fmu.description(),
            &store.run(&run.case.name),
            &run.case.name,
        )?),
        None => None,
    };
    let view = telling.map(|run| ("view.html", run));
    files.push((
        "report.html",
        report::campaign::page(campaign, fmu, &results, view, chapters).into_bytes(),
    ));
    files.extend(shown.map(|page| ("view.html", page.into_bytes())));
    store.publish(files)?;
    let (all, reused) = results.counts();
    let recorded = results.recordings();
    done!("{} runs simulated, {reused} reused", all - reused - recorded);
    if recorded > 0 {
        done!("{recorded} recordings read");
    }
    let file = |name: &str| campaign.out.join(name);
    if results.unanalysed.is_empty() {
        done!("features: {}", file("features.csv").display());
    }
    done!("runs:     {}\nreport:   {}", file("runs.csv").display(), file("report.html").display());
    let beyond: Vec<&str> = results.beyond_model().map(|(case, _)| case.name.as_str()).collect();
    if let Some(first) = beyond.first() {
        terminal::warn(format_args!(
            "{} of {all} runs left the range of their model, such as {first}; the report says how",
            beyond.len()
        ));
    }
    for failure in &results.failures {
        terminal::error(format_args!("{} failed: {}", failure.case.name, failure.reason));
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
         hubslosh campaign --amplitudes 0.1 --set friction.model=viscous --jobs 1"
    )
}
