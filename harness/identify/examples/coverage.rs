//! Do the estimates keep what they state? Many recordings of the FMU with different gyro noise, each
//! identified with nothing told; prints the root-mean-square error over the Cramér–Rao bound and how
//! often the 95 % interval holds the truth.
//!
//! ```text
//! cargo run --release -p identify --example coverage -- [seeds] [amplitude N.m] [models] [starts] [flaws]
//! ```
//!
//! `models` as for `hubslosh identify --model`; `starts`: `data`, or `far` for all starts 40 % off, up
//! or down by the seed's bits; `flaws`: 5 ms delay, gyro scale 1.01, bias 2 mrad/s and friction asymmetry 0.1
//! in the twin, estimated as well.

use std::collections::BTreeMap;

use bench::profile::{Profile, Torque};
use host::fmi2::Fmu;
use identify::identification::{Identification, Options, identify};
use identify::twin::{self, Flaws};

const TRUTH: [(&str, f64); 8] = [
    ("tank.d", 0.163),
    ("tank.h", 0.1),
    ("slosh.zeta", 0.0029757),
    ("hub.I", 0.322414),
    ("friction.b", 0.03793),
    ("friction.c", 0.003498),
    ("friction.d", 0.002423),
    ("friction.omega_s", 0.08581),
];

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let text = |k: usize, otherwise: &str| arguments.get(k).cloned().unwrap_or(otherwise.into());
    let seeds: u32 = text(0, "50").parse()?;
    let (amplitude, model) = (text(1, "0.1"), text(2, "linear"));
    let (far, flawed) = (text(3, "data") == "far", text(4, "perfect") == "flaws");
    let twin_model = text(5, "linear");

    let fmu = Fmu::open(pack::packed_for_tests())?;
    let sweep: Profile = format!("lin-sweep:amplitude={amplitude}").parse()?;
    let torque = Torque::Profile(sweep);
    let mut settings = vec![
        ("slosh.model", twin_model.as_str()),
        ("slosh.zeta_from_correlation", "false"),
        ("slosh.zeta", "0.0029757"),
    ];
    let mut flaws = Flaws::default();
    if flawed {
        settings.push(("friction.asymmetry", "0.1"));
        flaws = Flaws { delay: 0.005, gyro_scale: 1.01, gyro_bias: 2e-3 };
    }
    let mut rows: BTreeMap<String, Vec<(f64, f64, f64)>> = BTreeMap::new();
    let (mut chosen, mut undescribed, mut slow): (BTreeMap<String, u32>, u32, f64) =
        Default::default();
    for seed in 1..=seeds {
        let recording = twin::record(&fmu, &settings, &torque, Some(seed), flaws)?;
        let off = |(i, (name, value)): (usize, &(&str, f64))| {
            let up = (seed.wrapping_mul(2_654_435_761) >> (8 + i)) & 1 == 1;
            (name.to_string(), if up { 1.4 * value } else { 0.6 * value })
        };
        let options = Options {
            models: model.split(',').map(String::from).collect(),
            starts: if far { TRUTH.iter().enumerate().map(off).collect() } else { vec![] },
            flaws: flawed,
            gyro_scale: if flawed { 0.01 } else { 0.0 },
            ..Options::default()
        };
        let found: Identification = match identify(&fmu, &[recording], &options, &mut |_| {}) {
            Ok(found) => found,
            Err(error) => {
                println!("seed {seed}: {error:#}");
                continue;
            }
        };
        slow = slow.max(found.seconds);
        let verdict = match found.verdict.first() {
            Some(line) if line.starts_with("Cannot tell") => "cannot tell".to_string(),
            _ => found.fit.model.clone(),
        };
        *chosen.entry(verdict).or_default() += 1;
        undescribed += u32::from(!found.described);
        let truth = TRUTH.iter().copied().chain([
            ("friction.asymmetry", 0.1),
            ("delay", flaws.delay),
            ("gyro_scale", flaws.gyro_scale),
        ]);
        let mut worst: (f64, &str) = (0.0, "");
        for (name, value) in truth {
            let Some(p) = found.parameters.get(name).or(found.measurement.get(name)) else {
                continue;
            };
            let inside = f64::from(p.interval[0] <= value && value <= p.interval[1]);
            rows.entry(name.into()).or_default().push((p.value - value, p.std, inside));
            let off = (p.value - value).abs() / p.std;
            worst = if off > worst.0 { (off, name) } else { worst };
        }
        println!(
            "seed {seed}: {} {:.1} s, {} answers, worst {} {:.1} std, tests {:.1}, converged {}",
            found.fit.model,
            found.seconds,
            found.fit.simulations,
            worst.1,
            worst.0,
            found.fit.tests[0].worst(),
            found.converged
        );
    }
    println!("\nlongest {slow:.1} s; chosen {chosen:?}; not described {undescribed}");
    println!("{:20} {:>12} {:>12} {:>8} {:>10}", "", "rms error", "bound", "ratio", "in 95 %");
    for (name, values) in rows {
        let n = values.len() as f64;
        let rms = (values.iter().map(|v| v.0 * v.0).sum::<f64>() / n).sqrt();
        let bound = (values.iter().map(|v| v.1 * v.1).sum::<f64>() / n).sqrt();
        let inside: f64 = values.iter().map(|v| v.2).sum();
        println!("{name:20} {rms:>12.3e} {bound:>12.3e} {:>8.2} {inside:>6} of {n}", rms / bound);
    }
    Ok(())
}
