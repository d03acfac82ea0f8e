//! `hubslosh step-cost`.

use std::path::PathBuf;
#[cfg(target_os = "linux")]
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use experiments::run::Run;
use experiments::step_cost::instructions::Chosen;
use experiments::step_cost::{self, Choice, MAX_STEPS, Spread};
use host::fmu::Fmu;
use serde_json::{Value, json};

use super::{DEFAULT_FMU, open_with, setting};
use crate::{progress, terminal};

/// Measures what one communication step costs, in time and instructions, and chooses solver.max_steps for a deadline.
///
/// HubSlosh and SloshTank make a sweep, Spacecraft a slew, in steps with held inputs. The time of a step is the least of
/// five from the same saved state. Instructions are counted on Linux, of the slowest steps and of some in the middle. --deadline
/// finds the largest number of internal steps that take at most this time, with a margin. At states along the manoeuvre the
/// command requests a far too long step, and measures the time until the FMU refuses it.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  hubslosh step-cost --deadline 1ms\n  \
    hubslosh step-cost --fmu Spacecraft-fmi3 --deadline 500us --step 10ms --set tanks=2\n  \
    hubslosh step-cost --set slosh.model=spherical --step 20ms --json")]
pub struct StepCostArgs {
    /// Time that a step may take: 1ms, 250us, 0.01s, or a number of s; chooses solver.max_steps.
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    deadline: Option<f64>,
    /// Safety factor between the measured cost and the deadline, for other machines and motions.
    #[arg(long, value_name = "NUMBER", default_value_t = 2.0)]
    margin: f64,
    /// Communication step, as --deadline [default: the deadline, or 1ms].
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    step: Option<f64>,
    /// Number of steps of the manoeuvre.
    #[arg(long, value_name = "NUMBER", default_value_t = 20_000)]
    steps: usize,
    /// Profile that drives the FMU, as in `hubslosh run`, in place of the sweep or the slew.
    #[arg(long, value_name = "PROFILE")]
    profile: Option<String>,
    /// Input that is driven [default: tau_cmd, of SloshTank a[1], of Spacecraft torque[1]].
    #[arg(long, value_name = "NAME")]
    drive: Option<String>,
    /// Sets a parameter or an input by its FMU name, as for `hubslosh run`.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// The FMU: a file, or the name of one of this project.
    #[arg(long, value_name = "FILE|NAME", default_value = DEFAULT_FMU)]
    pub fmu: PathBuf,
    /// Print the numbers as JSON, SI.
    #[arg(long)]
    json: bool,
    /// Steps that a process makes under the eyes of its parent.
    #[arg(long, hide = true, value_name = "NUMBER,…", value_delimiter = ',')]
    pub counted: Vec<usize>,
}

/// A time, s: `1ms`, `250us`, `1e-3s`, `0.001`.
fn seconds(text: &str) -> Result<f64> {
    let text = text.trim();
    let (number, unit) = [
        ("ns", 1e-9),
        ("us", 1e-6),
        ("\u{b5}s", 1e-6),
        ("\u{3bc}s", 1e-6),
        ("ms", 1e-3),
        ("s", 1.0),
    ]
    .into_iter()
    .find_map(|(unit, size)| Some((text.strip_suffix(unit)?, size)))
    .unwrap_or((text, 1.0));
    let time = number.trim().parse::<f64>().ok().map(|number| number * unit);
    time.filter(|time| *time > 0.0 && time.is_finite()).with_context(|| {
        format!(
            "\"{text}\" is not a time above 0 (allowed: such as 1ms, 250us, 0.01s, or a number of s)"
        )
    })
}

impl StepCostArgs {
    fn manoeuvre(&self, fmu: &Fmu) -> Result<(Run, String)> {
        let step = self.step.or(self.deadline).unwrap_or(1e-3);
        let (profile, drive) = (self.profile.as_deref(), self.drive.as_deref());
        step_cost::manoeuvre(fmu, (self.steps, step), profile, drive, &self.settings)
    }

    /// Runs the command.
    pub fn run(self) -> Result<()> {
        let fmu = open_with(&self.fmu, &self.settings)?;
        let (run, profile) = self.manoeuvre(&fmu)?;
        #[cfg(target_os = "linux")]
        if !self.counted.is_empty() {
            return step_cost::instructions::be_counted(&fmu, &run, &self.counted);
        }
        ensure!(self.steps <= 1_000_000, "--steps {} (allowed: 1 to 1000000)", self.steps);
        let bar = progress::of_steps()?;
        bar.set_length(self.steps as u64);
        let times = step_cost::times(&fmu, &run, |steps| bar.inc(steps))?;
        bar.finish_and_clear();
        let time = step_cost::spread(&times);
        let bar = progress::of_search()?;
        bar.set_message("counting instructions");
        let instructions = self.instructions(&fmu, &run, &times);
        bar.set_message("looking for the number of internal steps");
        let choice = self
            .deadline
            .map(|deadline| step_cost::choose(&fmu, &run, deadline, self.margin, |_| bar.tick()));
        bar.finish_and_clear();
        let found = Found { args: &self, fmu: &fmu, run: &run, profile, time, instructions };
        if choice.as_ref().is_none_or(|choice| choice.is_ok()) && self.json {
            return terminal::say_json(&found.json(choice.transpose()?.as_ref()));
        }
        if !self.json {
            found.say();
        }
        if let Some(choice) = choice.transpose()? {
            found.say_choice(&choice);
        }
        Ok(())
    }

    /// Instructions of the steps, or why there are none: a process of its own makes those that matter.
    #[cfg(target_os = "linux")]
    fn instructions(&self, fmu: &Fmu, run: &Run, times: &[f64]) -> Result<Spread<u64>> {
        let chosen = Chosen::new(times);
        let all = chosen.all();
        let counted: Vec<String> = all.iter().map(usize::to_string).collect();
        let mut child = Command::new(std::env::current_exe()?);
        child.args(["--quiet", "step-cost", "--counted", &counted.join(",")]).arg("--fmu");
        child.arg(fmu.path()).args(["--steps", &self.steps.to_string()]);
        child.args(["--step", &format!("{:?}", run.step)]);
        for (flag, value) in [("--profile", &self.profile), ("--drive", &self.drive)] {
            if let Some(value) = value {
                child.args([flag, value.as_str()]);
            }
        }
        for (name, value) in &self.settings {
            child.arg("--set").arg(format!("{name}={value}"));
        }
        child.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let counts = step_cost::instructions::count(child.spawn()?, all.len())?;
        chosen.spread(&counts, times.len()).context("not all steps were counted")
    }

    #[cfg(not(target_os = "linux"))]
    fn instructions(&self, _: &Fmu, _: &Run, times: &[f64]) -> Result<Spread<u64>> {
        let _ = Chosen::new(times);
        anyhow::bail!("they are counted on Linux alone")
    }
}

/// Measurements.
struct Found<'a> {
    args: &'a StepCostArgs,
    fmu: &'a Fmu,
    run: &'a Run,
    profile: String,
    time: Spread<f64>,
    instructions: Result<Spread<u64>>,
}

/// A time with its unit, three digits.
fn time(seconds: f64) -> String {
    let (number, unit) = match seconds {
        s if s >= 1.0 => (s, "s"),
        s if s >= 1e-3 => (s * 1e3, "ms"),
        s if s >= 1e-6 => (s * 1e6, "us"),
        s => (s * 1e9, "ns"),
    };
    let digits = match number {
        n if n >= 100.0 => 0,
        n if n >= 10.0 => 1,
        _ => 2,
    };
    format!("{number:.digits$} {unit}")
}

impl Found<'_> {
    fn is_fmi3(&self) -> bool {
        self.fmu.description().is_fmi3()
    }

    fn say(&self) {
        let Found { args, run, time: t, .. } = self;
        let version = if self.is_fmi3() { "3.0" } else { "2.0" };
        let model = &self.fmu.description().model_name;
        let input = run.input.as_deref().map_or(String::new(), |input| format!(" on {input}"));
        println!(
            "{model}, FMI {version}: {} steps of {}, {}{input}",
            args.steps,
            time(run.step),
            self.profile
        );
        println!();
        println!("{:<24}{:>12}{:>12}{:>12}", "one step", "p50", "p99.99", "max");
        println!(
            "{:<24}{:>12}{:>12}{:>12}",
            "time, least of 5",
            time(t.median),
            time(t.p99_99),
            time(t.max)
        );
        match &self.instructions {
            Ok(n) => {
                println!("{:<24}{:>12}{:>12}{:>12}", "instructions", n.median, n.p99_99, n.max)
            }
            Err(error) => terminal::note(format_args!("no instructions were counted: {error:#}")),
        }
    }

    fn say_choice(&self, choice: &Choice) {
        let Choice { max_steps, worst, needed } = choice;
        let (deadline, margin) = (self.args.deadline.unwrap_or_default(), self.args.margin);
        println!();
        println!("{MAX_STEPS} = {max_steps} for a deadline of {}", time(deadline));
        println!();
        println!(
            "{max_steps} internal steps took up to {}, {} with the margin {margin}. The manoeuvre's own steps need \
             up to {needed}.",
            time(*worst),
            time(worst * margin)
        );
        println!("{}", self.beyond());
    }

    /// Consequence for a step that would need more.
    fn beyond(&self) -> &'static str {
        match self.is_fmi3() {
            true => {
                "A step that would need more is refused after that time: fmi3DoStep returns fmi3Discard, says when it \
                 gave up, and nothing has changed; shorter steps go on from there."
            }
            false => {
                "The FMU refuses a step that would need more: fmi2DoStep returns fmi2Error with the time that it reached, and \
                 the state does not change. To continue, a host restores a saved state."
            }
        }
    }

    fn json(&self, choice: Option<&Choice>) -> Value {
        let Found { args, run, time, .. } = self;
        let description = self.fmu.description();
        let instructions = self.instructions.as_ref().ok();
        json!({
            "model": description.model_name,
            "fmi_version": description.fmi_version,
            "fmu": self.fmu.hash(),
            "profile": self.profile,
            "input": run.input,
            "step_s": run.step,
            "steps": args.steps,
            "time_s": { "p50": time.median, "p99_99": time.p99_99, "max": time.max },
            "instructions": instructions.map(|n| json!({ "p50": n.median, "p99_99": n.p99_99, "max": n.max })),
            "choice": choice.map(|choice| json!({
                "deadline_s": args.deadline,
                "margin": args.margin,
                "max_steps": choice.max_steps,
                "worst_s": choice.worst,
                "needed": choice.needed,
                "beyond": self.beyond(),
            })),
        })
    }
}
