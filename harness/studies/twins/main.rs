//! Coverage of the intervals on recordings of a bench that is independent of the FMU. The twins of [`bench`] have true
//! parameters within ±30 % of the nominal ones, all kinds of torque, noise and errors of the measurement. Each is identified as
//! a user would; then it is counted how often the 95 % intervals contain the true value.
//!
//! ```text
//! cargo run --release -p identify --features studies --example twins -- [KEY=VALUE ...]
//!   seeds=1-200         seeds of the twins
//!   duration=200        duration of each recording, s; twice that for a slow sweep
//!   models=linear,…     as for hubslosh identify --model; by default the true model, for every third twin linear and spherical
//!   say=false           true: prints the verdict of every twin
//!   habits=all          recordings in files as loggers write them: all, or some of [`habits::HABITS`]; twin k has format k
//! ```

#[allow(dead_code, reason = "its test looks at more of it")]
mod bench;
mod draw;
mod habits;

use std::collections::BTreeMap;

use analysis::innovations::Tests;
use anyhow::{Context, Result, bail};
use draw::Twin;
use habits::HABITS;
use host::fmu::Fmu;
use identify::bench::identification::Identification;

/// Number of standard deviations. An estimate counts as wrong if its error exceeds this number of its standard deviations
/// although the model fits the recording, and if its interval does not contain the true value. An infinite end of an
/// interval makes no claim.
const WRONG: f64 = 5.0;

#[derive(Default)]
struct Row {
    /// Errors of the estimates divided by their standard deviations.
    off: Vec<f64>,
    inside: usize,
}

#[derive(Default)]
struct Tally {
    rows: BTreeMap<String, Row>,
    described: usize,
    not_described: Vec<u64>,
    refused: Vec<u64>,
    wrong: Vec<String>,
    seconds: f64,
}

impl Tally {
    fn add(&mut self, twin: &Twin, found: &Identification) {
        let described = found.fits == Some(true) && found.converged;
        if described {
            self.described += 1;
        } else {
            self.not_described.push(twin.seed);
        }
        self.seconds += found.details.seconds;
        let mut each = Vec::new();
        for (name, truth) in twin.truths() {
            let Some(p) = found.parameters.get(name).or(found.measurement.get(name)) else {
                continue;
            };
            let inside = (p.interval[0]..=p.interval[1]).contains(&truth);
            let off = (p.value - truth) / p.std;
            let outside = format!(
                "! ({truth:.4e} is not from {:.4e} to {:.4e}; {:.4e} ± {:.1e})",
                p.interval[0], p.interval[1], p.value, p.std
            );
            each.push(format!("{name} {off:+.1}{}", if inside { "" } else { &outside }));
            if !described {
                continue;
            }
            let row = self.rows.entry(name.into()).or_default();
            row.off.push(off);
            row.inside += usize::from(inside);
            if off.abs() > WRONG && !inside {
                self.wrong.push(format!("{} {name} {off:+.1}", twin.seed));
            }
        }
        let tests = found.details.fit.tests.iter().map(Tests::worst).fold(0.0, f64::max);
        println!(
            "{}: {} as {}, {:.0} s, {:.0} simulations, tests {tests:.1}, decrement {:.3}{}: {}",
            twin.seed,
            twin.words(),
            found.details.fit.model,
            found.details.seconds,
            found.details.fit.simulations,
            found.details.fit.newton_decrement,
            if described { "" } else { ", NOT DESCRIBED" },
            each.join(", ")
        );
    }

    fn print(&self, twins: usize) {
        println!(
            "\n{twins} twins in {:.0} s: {} described, {} not {:?}, {} refused {:?}; described and more than {WRONG} standard \
             deviations off: {:?}",
            self.seconds,
            self.described,
            self.not_described.len(),
            self.not_described,
            self.refused.len(),
            self.refused,
            self.wrong
        );
        println!("| parameter | in 95 % | of | % | rms error / std | worst |");
        println!("| --- | --- | --- | --- | --- | --- |");
        let (mut inside, mut all) = (0, 0);
        for (name, row) in &self.rows {
            let n = row.off.len();
            (inside, all) = (inside + row.inside, all + n);
            let rms = (row.off.iter().map(|z| z * z).sum::<f64>() / n as f64).sqrt();
            let worst = row.off.iter().fold(0.0_f64, |w, z| w.max(z.abs()));
            let percent = 100.0 * row.inside as f64 / n as f64;
            println!("| {name} | {} | {n} | {percent:.1} | {rms:.2} | {worst:.1} |", row.inside);
        }
        println!(
            "| all | {inside} | {all} | {:.1} | | |",
            100.0 * inside as f64 / all.max(1) as f64
        );
    }
}

fn known(name: &str) -> Result<&'static str> {
    let found = HABITS.into_iter().find(|habit| *habit == name);
    found.with_context(|| format!("{name} is not a habit (allowed: {})", HABITS.join(", ")))
}

fn main() -> Result<()> {
    let (mut seeds, mut duration, mut say) = (1..=200, 200.0, false);
    let mut models: Option<Vec<String>> = None;
    let mut some: Vec<&'static str> = Vec::new();
    for argument in std::env::args().skip(1) {
        let (key, value) =
            argument.split_once('=').with_context(|| format!("{argument}: KEY=VALUE"))?;
        match key {
            "seeds" => {
                let (from, to) = value.split_once('-').unwrap_or((value, value));
                seeds = from.parse()?..=to.parse()?;
            }
            "duration" => duration = value.parse()?,
            "models" => models = Some(value.split(',').map(String::from).collect()),
            "say" => say = value == "true",
            "habits" if value == "all" => some = HABITS.to_vec(),
            "habits" => some = value.split(',').map(|habit| known(habit)).collect::<Result<_>>()?,
            _ => bail!("{key} is not asked for; see the head of harness/studies/twins/main.rs"),
        }
    }
    let fmu = Fmu::open(pack::packed_for_tests())?;
    let (mut tally, mut twins) = (Tally::default(), 0);
    for seed in seeds {
        twins += 1;
        let habit = (!some.is_empty()).then(|| some[(seed as usize - 1) % some.len()]);
        let plain = Twin::draw(seed, duration);
        let twin = match habit {
            Some(habit) => habits::of(plain, habit),
            None => plain,
        };
        let models = models.clone().unwrap_or_else(|| twin.models());
        let hear = |line: &str| {
            if say {
                println!("  {line}");
            }
        };
        let found = match habit {
            Some(habit) => {
                println!("{seed}: {habit}");
                let directory = tempfile::tempdir()?;
                let written = habits::write(&twin, habit, directory.path())?;
                twin.identify_file(&fmu, models, &written, &hear)
            }
            None => twin.identify(&fmu, models, &hear),
        };
        match found {
            Ok(found) => {
                tally.add(&twin, &found);
                if say || found.fits != Some(true) || !found.converged {
                    found.verdict.iter().for_each(|line| println!("  > {line}"));
                }
            }
            Err(error) => {
                tally.refused.push(seed);
                println!("{seed}: {}, REFUSED: {error:#}", twin.words());
            }
        }
    }
    tally.print(twins);
    Ok(())
}
