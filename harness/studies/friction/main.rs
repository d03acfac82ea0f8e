//! Tests whether the friction fit ends at its minimum: ramps, steps and sweeps of [`bench`] in three sets, with the
//! parameters of Rubaga's thesis.
//!
//! ```text
//! cargo run --release -p identify --features studies --example friction -- [KEY=VALUE ...]
//!   seeds=1-8               seeds of the noise
//!   asymmetry=0.15          asymmetry of the bearing's dry friction
//!   write=DIR               also writes the recordings of the first seed as CSV
//! ```

#[allow(dead_code, reason = "the twins look at more of it")]
#[path = "../twins/bench.rs"]
mod bench;
mod runs;

use std::collections::BTreeMap;
use std::path::Path;

use analysis::statistics::mean;
use anyhow::{Context, Result, bail};
use host::fmu::Fmu;
use identify::bench::options::Options;
use identify::estimate::Estimated;
use identify::input::recording::Recording;
use identify::input::tolerance::Tolerances;
use identify::methods::output_error;

const BIAS: f64 = 0.002;

struct Answer {
    parameters: BTreeMap<String, Estimated>,
    measurement: BTreeMap<String, Estimated>,
    fits: bool,
    seconds: f64,
}

fn fit(fmu: &Fmu, recordings: &[Recording]) -> Result<Answer> {
    let options = Options {
        models: vec!["frozen".into()],
        gyro_scale: 0.0,
        tolerances: Tolerances::NONE,
        ..Options::default()
    };
    let found = output_error::identify(fmu, recordings, &options, &mut |_| {})?;
    let fits = found.fits == Some(true) && found.converged;
    let (parameters, measurement) = (found.parameters, found.measurement);
    Ok(Answer { parameters, measurement, fits, seconds: found.details.seconds })
}

fn write(recordings: &[Recording], folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder)?;
    for recording in recordings {
        let mut text = String::from("time,tau_cmd,omega,theta\n");
        let angle = recording.angle.as_ref().context("an encoder")?;
        for (k, t) in recording.time.iter().enumerate() {
            let (tau, rate) = (recording.torque[k], recording.rate[k]);
            text.push_str(&format!("{t:.2},{tau:.9},{rate:.9},{:.9}\n", angle[k]));
        }
        std::fs::write(folder.join(format!("{}.csv", recording.name)), text)?;
    }
    Ok(())
}

fn main() -> Result<()> {
    let (mut seeds, mut asymmetry, mut folder) = (1..=8, 0.15, None);
    for argument in std::env::args().skip(1) {
        let (key, value) = argument.split_once('=').with_context(|| argument.clone())?;
        match key {
            "seeds" => {
                let (first, last) = value.split_once('-').unwrap_or((value, value));
                seeds = first.parse()?..=last.parse()?;
            }
            "asymmetry" => asymmetry = value.parse()?,
            "write" => folder = Some(value.to_string()),
            other => bail!("{other} is not a key"),
        }
    }
    let fmu = Fmu::open(pack::packed_for_tests())?;
    let bench = runs::bench(asymmetry);
    let truths = [
        ("hub.I", bench.hub_inertia),
        ("friction.b", bench.bearing.b),
        ("friction.c", bench.bearing.c),
        ("friction.d", bench.bearing.d),
        ("friction.omega_s", bench.bearing.omega_s),
        ("friction.asymmetry", asymmetry),
        ("gyro_bias[1]", BIAS),
        ("gyro_bias[2]", BIAS),
        ("gyro_bias[3]", BIAS),
    ];
    let head = truths.map(|t| t.0.trim_start_matches("friction.")).join(" | ");
    println!("| runs | seed | {head} | largest | accepted | seconds |");
    println!("|{}", " --- |".repeat(truths.len() + 5));
    let (mut signs, mut all) = (0, Vec::new());
    for set in &runs::SETS {
        let mut of_set = Vec::new();
        for seed in seeds.clone() {
            let recordings = runs::recordings(set, seed, BIAS, asymmetry);
            if let (Some(folder), true) = (&folder, seed == *seeds.start()) {
                write(&recordings, &Path::new(folder).join(set.name.replace([' ', ','], "_")))?;
            }
            // only the rate, because the encoder of these recordings has no noise
            let rates: Vec<Recording> =
                recordings.into_iter().map(|r| Recording { angle: None, ..r }).collect();
            let answer = fit(&fmu, &rates)?;
            let off = truths.map(|(name, truth)| {
                let p = answer.parameters.get(name).or(answer.measurement.get(name));
                p.map_or(f64::NAN, |p| (p.value - truth) / p.std)
            });
            let largest = off.iter().fold(0.0_f64, |most, off| most.max(off.abs()));
            println!(
                "| {} | {seed} | {} | {largest:.2} | {} | {:.1} |",
                set.name,
                off.map(|off| format!("{off:+.2}")).join(" | "),
                answer.fits,
                answer.seconds
            );
            signs += i32::from(answer.parameters["friction.asymmetry"].value * asymmetry > 0.0);
            of_set.push(off);
        }
        for (word, of) in [("mean", mean as fn(&[f64]) -> f64), ("rms", root_mean_square)] {
            let column = |j: usize| of_set.iter().map(|off| off[j]).collect::<Vec<f64>>();
            let cells: Vec<String> =
                (0..truths.len()).map(|j| format!("{:+.2}", of(&column(j)))).collect();
            println!("| {} | {word} | {} | | | |", set.name, cells.join(" | "));
        }
        all.extend(of_set);
    }
    let values: Vec<f64> = all.iter().flatten().copied().filter(|off| off.is_finite()).collect();
    let beyond = |limit: f64| values.iter().filter(|off| off.abs() > limit).count();
    println!(
        "\nErrors in standard deviations of {} fits, {} values: largest {:.2}, rms {:.2}, {} beyond 1.96 (chance: {:.1}), {} \
         beyond 3 (chance: {:.1}). The asymmetry has the right sign in {signs}.",
        all.len(),
        values.len(),
        values.iter().fold(0.0_f64, |most, off| most.max(off.abs())),
        root_mean_square(&values),
        beyond(1.96),
        0.05 * values.len() as f64,
        beyond(3.0),
        0.0027 * values.len() as f64
    );
    Ok(())
}

fn root_mean_square(values: &[f64]) -> f64 {
    mean(&values.iter().map(|v| v * v).collect::<Vec<f64>>()).sqrt()
}
