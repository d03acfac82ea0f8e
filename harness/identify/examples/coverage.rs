//! Coverage of the intervals: identifies many recordings of the FMU with different noise of the gyro, without priors and start
//! values. Prints the root-mean-square error divided by the reported standard deviation, how often the 95 % interval contains the
//! true value, which models were chosen, and how often no model fitted.
//!
//! ```text
//! cargo run --release -p identify --features studies --example coverage -- [KEY=VALUE ...]
//!   seeds=1-50          seeds of the gyro's noise
//!   torque=PROFILE      as for hubslosh run, or multisine:PEAK,SECONDS
//!   twin=linear         slosh model of the simulated bench (twin)
//!   set=NAME:VALUE      a setting of the twin (repeatedly), with which its estimate is compared
//!   fit_set=NAME:VALUE  a setting of the fit (repeatedly)
//!   models=linear,…     as for hubslosh identify --model
//!   friction=stribeck,… as for hubslosh identify --friction
//!   starts=data         or far: start values 40 % above or below the true values, by the bits of the seed
//!   perfect=true        false: delay, bias, asymmetry and gyro scale are estimated
//!   sensor_errors=false true: the twin has a delay of 5 ms, a gyro scale of 1.01, a bias of 2 mrad/s and an asymmetry of 0.1
//!   unmodelled=         tilt, nutation, warming, clipping, drag, with + between several
//!   rate=50             rows a second
//!   gyro=50             values of the gyro a second, if it is slower than the rows
//!   encoder=NUMBER      standard deviation of an encoder's angle, rad; without it the twin has no encoder
//!   intersample=linear  intersample behaviour of the twin's torque: linear, held, smooth
//!   say=false           true: prints the verdict of every seed
//! ```

#[path = "fmu_twin/mod.rs"]
#[allow(dead_code, reason = "others use the rest of it")]
mod fmu_twin;

use std::collections::BTreeMap;

use analysis::innovations::Tests;
use anyhow::{Context, Result, bail};
use experiments::rest;
use fmu_twin::{SensorErrors, Twin, Unmodelled};
use host::fmu::Fmu;
use identify::bench::identification::Identification;
use identify::bench::nominal::PARAMETERS;
use identify::bench::options::Options;
use identify::input::reading;
use identify::input::tolerance::Tolerances;
use identify::methods::output_error::identify;

use identify::engine::Hold;
use identify::tuning::COARSEST;

struct Arguments {
    seeds: std::ops::RangeInclusive<u32>,
    torque: String,
    twin: Twin,
    options: Options,
    far: bool,
    say: bool,
}

fn arguments() -> Result<Arguments> {
    let mut twin = Twin::default();
    let mut set = |name: &str, value: &str| twin.settings.push((name.into(), value.into()));
    set("slosh.zeta_from_correlation", "false");
    set("slosh.zeta", "0.0029757");
    let mut asked = Arguments {
        seeds: 1..=50,
        torque: "lin-sweep:amplitude=0.1".into(),
        twin,
        options: Options {
            models: vec!["linear".into()],
            sensor_errors: false,
            gyro_scale: 0.0,
            tolerances: Tolerances::NONE,
            ..Options::default()
        },
        far: false,
        say: false,
    };
    let list = |value: &str| value.split(',').map(String::from).collect::<Vec<String>>();
    for argument in std::env::args().skip(1) {
        let (key, value) =
            argument.split_once('=').with_context(|| format!("{argument}: KEY=VALUE"))?;
        let pair = || {
            let (name, value) = value.split_once(':').context("NAME:VALUE")?;
            Ok::<_, anyhow::Error>((name.to_string(), value.to_string()))
        };
        match key {
            "seeds" => {
                let (from, to) = value.split_once('-').unwrap_or(("1", value));
                asked.seeds = from.parse()?..=to.parse()?;
            }
            "torque" => asked.torque = value.into(),
            "twin" => asked.twin.settings.push(("slosh.model".into(), value.into())),
            "set" => asked.twin.settings.push(pair()?),
            "fit_set" => asked.options.settings.push(pair()?),
            "models" => asked.options.models = list(value),
            "friction" => asked.options.friction = list(value),
            "starts" => asked.far = value == "far",
            "perfect" => {
                let sensor_errors = value != "true";
                (asked.options.sensor_errors, asked.options.gyro_scale) =
                    (sensor_errors, if sensor_errors { 0.01 } else { 0.0 });
            }
            "sensor_errors" if value == "true" => {
                asked.twin.settings.push(("friction.asymmetry".into(), "0.1".into()));
                asked.twin.sensor_errors =
                    SensorErrors { delay: 0.005, gyro_scale: 1.01, gyro_bias: 2e-3 };
                (asked.options.sensor_errors, asked.options.gyro_scale) = (true, 0.01);
            }
            "sensor_errors" => {}
            "unmodelled" => {
                asked.twin.unmodelled =
                    value.split('+').map(Unmodelled::named).collect::<Result<_>>()?
            }
            "rate" => asked.twin.rate = value.parse()?,
            "encoder" => asked.twin.encoder = Some(value.parse()?),
            "gyro" => asked.twin.gyro = Some(value.parse()?),
            "intersample" => {
                asked.twin.intersample = match value {
                    "held" => Hold::ZeroOrderHold,
                    "smooth" => Hold::BandLimited,
                    _ => Hold::FirstOrderHold,
                }
            }
            "say" => asked.say = value == "true",
            _ => bail!("{key} is not asked for; see the head of examples/coverage.rs"),
        }
    }
    Ok(asked)
}

fn truths(fmu: &Fmu, twin: &Twin) -> Result<BTreeMap<String, f64>> {
    let mut instance = rest::instantiate(fmu, "truth")?;
    for (name, value) in &twin.settings {
        instance.set(name, value)?;
    }
    let mut truths = BTreeMap::new();
    for name in PARAMETERS.into_iter().chain(["friction.asymmetry"]) {
        truths.insert(name.to_string(), instance.real(name)?);
    }
    truths.insert("delay".into(), twin.sensor_errors.delay);
    truths.insert("gyro_scale".into(), twin.sensor_errors.gyro_scale);
    truths.insert("friction.c + friction.d".into(), truths["friction.c"] + truths["friction.d"]);
    Ok(truths)
}

#[derive(Default)]
struct Tally {
    rows: BTreeMap<String, Vec<(f64, f64, bool)>>,
    chosen: BTreeMap<String, u32>,
    invalidated: u32,
    not_converged: u32,
    refused: u32,
    seconds: Vec<f64>,
}

impl Tally {
    fn add(&mut self, seed: u32, found: &Identification, truths: &BTreeMap<String, f64>) {
        self.seconds.push(found.details.seconds);
        let verdict = match found.verdict.first() {
            Some(line) if line.starts_with("Cannot tell") => {
                format!("cannot tell, {} first", found.details.fit.model)
            }
            _ => format!("{} with {}", found.details.fit.model, found.details.fit.friction),
        };
        *self.chosen.entry(verdict).or_default() += 1;
        self.invalidated += u32::from(found.fits != Some(true));
        self.not_converged += u32::from(!found.converged);
        let mut worst = (0.0, String::new());
        for (name, truth) in truths {
            let single = found.parameters.get(name).or(found.measurement.get(name));
            let sum = found.details.combinations.iter().find(|c| c.name == *name);
            let (value, std, inside) = match (single, sum) {
                (Some(p), _) => (p.value, p.std, (p.interval[0]..=p.interval[1]).contains(truth)),
                (_, Some(c)) => (c.value, c.std, (c.value - truth).abs() < 1.96 * c.std),
                _ => continue,
            };
            self.rows.entry(name.clone()).or_default().push((value - truth, std, inside));
            let off = (value - truth).abs() / std;
            if off > worst.0 {
                worst = (off, name.clone());
            }
        }
        let tests = found.details.fit.tests.iter().map(Tests::worst).fold(0.0, f64::max);
        println!(
            "seed {seed}: {} {:.1} s, {:.0} simulations, worst {} {:.1} std, tests {tests:.1}, decrement {:.3}{}",
            found.details.fit.model,
            found.details.seconds,
            found.details.fit.simulations,
            worst.1,
            worst.0,
            found.details.fit.newton_decrement,
            if found.fits == Some(true) { "" } else { ", DOES NOT FIT" },
        );
    }

    fn print(&self, truths: &BTreeMap<String, f64>) {
        let mean = self.seconds.iter().sum::<f64>() / self.seconds.len().max(1) as f64;
        let longest = self.seconds.iter().copied().fold(0.0, f64::max);
        println!(
            "\n{} identified in {mean:.1} s on average, {longest:.1} s at most; refused {}; chosen {:?}; none fitted {}; \
             not at a minimum {}",
            self.seconds.len(),
            self.refused,
            self.chosen,
            self.invalidated,
            self.not_converged
        );
        println!(
            "{:24} {:>12} {:>12} {:>10} {:>9} {:>8} {:>10}",
            "", "truth", "rms error", "std", "std %", "ratio", "in 95 %"
        );
        for (name, values) in &self.rows {
            let n = values.len() as f64;
            let rms = (values.iter().map(|v| v.0 * v.0).sum::<f64>() / n).sqrt();
            let std = (values.iter().map(|v| v.1 * v.1).sum::<f64>() / n).sqrt();
            let inside = values.iter().filter(|v| v.2).count();
            println!(
                "{name:24} {:>12.6} {rms:>12.3e} {std:>10.2e} {:>9.4} {:>8.2} {inside:>6} of {n}",
                truths[name],
                100.0 * std / truths[name].abs(),
                rms / std
            );
        }
    }
}

fn main() -> Result<()> {
    let asked = arguments()?;
    let fmu = Fmu::open(pack::packed_for_tests())?;
    let torque = fmu_twin::torque(&asked.torque)?;
    let truths = truths(&fmu, &asked.twin)?;
    let mut tally = Tally::default();
    for seed in asked.seeds.clone() {
        let recording = asked.twin.record(&fmu, &torque, Some(seed))?;
        let mut hear = |line: String| {
            if asked.say {
                println!("  {line}");
            }
        };
        let recordings = reading::prepare(recording, COARSEST, &mut hear)?;
        let mut options = asked.options.clone();
        if asked.far {
            for (i, name) in PARAMETERS.iter().enumerate() {
                let up = (seed.wrapping_mul(2_654_435_761) >> (8 + i)) & 1 == 1;
                options.starts.push((name.to_string(), if up { 1.4 } else { 0.6 } * truths[*name]));
            }
        }
        match identify(&fmu, &recordings, &options, &mut |news| {
            if asked.say {
                println!("  {}", news.line());
            }
        }) {
            Ok(found) => {
                tally.add(seed, &found, &truths);
                if asked.say {
                    found.verdict.iter().for_each(|line| println!("  > {line}"));
                }
            }
            Err(error) => {
                tally.refused += 1;
                println!("seed {seed}: {error:#}");
            }
        }
    }
    tally.print(&truths);
    Ok(())
}
