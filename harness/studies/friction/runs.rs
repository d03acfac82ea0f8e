//! Recordings for the identification of friction and inertia, on a bench whose equations are independent of the FMU: a ramp, a
//! step and a sweep with a rigid liquid, with the gyro of Rubaga's thesis and an encoder.

use std::f64::consts::TAU;

use analysis::random::Random;
use identify::input::recording::Recording;

use crate::bench::{Bearing, Bench, Drive, Liquid};

/// Standard deviation of the noise in one row of the thesis's gyro at 50 Hz, and the resolution of this gyro, rad/s.
const GYRO: (f64, f64) = (4.066e-4, 1.53e-4);

/// Torque of a test run, N·m, as a function of time, s.
pub type Course = fn(f64) -> f64;

/// A set of test runs: a ramp, a step and a sweep of the torque, each `seconds` long.
pub struct Set {
    pub name: &'static str,
    pub seconds: u32,
    pub courses: [Course; 3],
}

/// Returns the value, at the time `t`, s, of a sweep whose frequency rises linearly from `from` to `to`, Hz, in `seconds`.
fn sweep(t: f64, (from, to): (f64, f64), seconds: f64) -> f64 {
    (TAU * (from * t + (to - from) / (2.0 * seconds) * t * t)).sin()
}

pub const SETS: [Set; 3] = [
    Set {
        name: "two minutes",
        seconds: 120,
        courses: [
            // up to 0.12 N·m, then down through zero to −0.12 N·m
            |t| if t < 60.0 { 0.002 * t } else { 0.12 - 0.004 * (t - 60.0) },
            |t| if (5.0..65.0).contains(&t) { 0.05 } else { 0.0 },
            |t| 0.1 * sweep(t, (1.25, 3.5), 120.0),
        ],
    },
    Set {
        name: "four minutes, both directions",
        seconds: 240,
        courses: [
            |t| 0.06 * (1.0 - (2.0 * t / 240.0 - 0.5).abs() * 2.0),
            // a step of the torque forwards, then a step backwards
            |t| match t {
                _ if (5.0..65.0).contains(&t) => 0.03,
                _ if (125.0..185.0).contains(&t) => -0.03,
                _ => 0.0,
            },
            |t| 0.2 * sweep(t, (1.25, 3.5), 240.0),
        ],
    },
    Set {
        name: "one minute, slow sweep",
        seconds: 60,
        courses: [
            |t| if t < 30.0 { 0.002 * t } else { 0.06 - 0.004 * (t - 30.0) },
            |t| if (5.0..35.0).contains(&t) { -0.04 } else { 0.0 },
            |t| 0.1 * sweep(t, (0.1, 1.25), 60.0),
        ],
    },
];

pub fn bench(asymmetry: f64) -> Bench {
    let bearing = Bearing { asymmetry, ..Bench::default().bearing };
    Bench { liquid: Liquid::Frozen, bearing, ..Bench::default() }
}

pub fn recordings(set: &Set, seed: u64, bias: f64, asymmetry: f64) -> Vec<Recording> {
    let time: Vec<f64> = (0..=50 * set.seconds).map(|k| 0.02 * f64::from(k)).collect();
    let bench = bench(asymmetry);
    let record = |(number, torque): (usize, &Course)| {
        let tau: Vec<f64> = time.iter().map(|t| torque(*t)).collect();
        let motion = bench.motion(&Drive::Lines(&time, &tau), &time);
        let mut random = Random::new(seed, number as u64);
        let mut read = |w: &f64| ((w + bias + GYRO.0 * random.normal()) / GYRO.1).round() * GYRO.1;
        let rate = motion.rate.iter().map(&mut read).collect();
        let name = ["ramp", "step", "sweep"][number];
        let recording = Recording::of(name, time.clone(), tau, rate);
        Recording { angle: Some(motion.angle), ..recording }
    };
    set.courses.iter().enumerate().map(record).collect()
}
