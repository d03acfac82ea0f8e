//! Computes Cramér–Rao bounds of the thesis's experiments with the FMU, in % (1σ). Noise: white alone, and with the gyro's drift.
//! Unknowns: eight, and those that `hubslosh identify` adds.
//!
//! ```text
//! cargo run --release -p identify --features studies --example bounds -- [NAME:VALUE ...]
//! ```

#[path = "fmu_twin/mod.rs"]
#[allow(dead_code, reason = "others use the rest of it")]
mod fmu_twin;

use analysis::gauss_markov::Noise;
use anyhow::Result;
use host::fmu::Fmu;
use identify::bench::problem::{Differences, Problem};
use identify::bench::simulate::{Intersample, Setup};
use identify::bench::unknown::Unknown;
use identify::input::recording::Recording;

const TRUTH: [(&str, &str, f64); 8] = [
    ("tank.d", "m", 0.163),
    ("tank.h", "m", 0.1),
    ("slosh.zeta", "1", 0.0029757),
    ("hub.I", "kg.m2", 0.322414),
    ("friction.c", "N.m", 0.003498),
    ("friction.d", "N.m", 0.002423),
    ("friction.b", "N.m.s", 0.03793),
    ("friction.omega_s", "rad/s", 0.08581),
];

/// White noise of a row at 50 Hz and the drift: 5.75e-5 rad/s/√Hz and 5.21e-5/0.664 rad/s (the thesis's gyro).
const WHITE: f64 = 4.066e-4;
const DRIFT: f64 = 7.85e-5;

fn main() -> Result<()> {
    let fmu = Fmu::open(pack::packed_for_tests())?;
    let noises = [
        ("white", Noise::white(WHITE)),
        ("white and drift", Noise { white: WHITE, drift: DRIFT / WHITE, time: 100.0 }),
    ];
    let positive = |list: &[(&str, &str, f64)]| -> Vec<Unknown> {
        list.iter().map(|(name, unit, value)| Unknown::positive(name, unit, *value)).collect()
    };
    let sensor_errors = vec![Unknown::asymmetry(), Unknown::delay(), Unknown::gyro_bias(0)];
    let all = [positive(&TRUTH), sensor_errors].concat();
    // how many of the first eight, and which of the others
    let sets: [(&str, Vec<usize>); 5] = [
        ("6: b and omega_s known", (0..6).collect()),
        ("7: omega_s known", (0..7).collect()),
        ("8", (0..8).collect()),
        ("8, delay and bias", [0, 1, 2, 3, 4, 5, 6, 7, 9, 10].to_vec()),
        ("8, asymmetry, delay and bias", (0..11).collect()),
    ];
    let setup = Setup {
        settings: std::iter::once("slosh.zeta_from_correlation:false".to_string())
            .chain(std::env::args().skip(1))
            .filter_map(|pair| pair.split_once(':').map(|(n, v)| (n.to_string(), v.to_string())))
            .collect(),
        intersample: Intersample::FirstOrderHold,
    };
    for torque in ["lin-sweep:amplitude=0.1", "lin-sweep:amplitude=0.25", "multisine:0.25,600"] {
        let torque_text = torque;
        let torque = fmu_twin::torque(torque)?;
        let (start, stop) = torque.span();
        let rows = ((stop - start) * 50.0).round() as usize;
        let time: Vec<f64> = (0..=rows).map(|k| start + k as f64 * 0.02).collect();
        let tau: Vec<f64> = time.iter().map(|&t| torque.torque_at(t)).collect();
        let rms = (tau.iter().map(|t| t * t).sum::<f64>() / tau.len() as f64).sqrt();
        println!("{torque_text}: {rms:.4} N.m rms");
        let recording = [Recording::of("plan", time, tau, vec![0.0; rows + 1])];
        print!("{:44}", "  std, %");
        TRUTH.iter().for_each(|(name, ..)| print!("{name:>17}"));
        println!("{:>8}", "c-d");
        for (name, noise) in noises {
            let mut problem = Problem::new(&fmu, setup.clone(), &recording, all.clone());
            problem.channels[0].noise = noise;
            problem.differences = Differences::Central;
            let (_, jacobian) = problem.information(&problem.start())?;
            for (unknowns, set) in &sets {
                let covariance = problem.covariance(&jacobian.select_columns(set))?.x;
                print!("{:44}", format!("  {unknowns}; {name}"));
                for i in 0..TRUTH.len() {
                    let std = if i < set.len() { 100.0 * covariance[(i, i)].sqrt() } else { 0.0 };
                    print!("{std:>17.4}");
                }
                let product = covariance[(4, 4)] * covariance[(5, 5)];
                println!("{:>8.4}", covariance[(4, 5)] / product.sqrt());
            }
        }
    }
    Ok(())
}
