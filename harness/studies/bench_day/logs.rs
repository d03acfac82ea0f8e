//! Writes the logs of a simulated day of tests, on a bench whose equations are independent of the FMU: friction runs, free
//! decays, a gyro at rest and sine sweeps, in the format of a logger. The gyro has three axes with bias, noise and quantisation;
//! the platform tilts with the hub's motion.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::io;
use std::path::Path;

use analysis::random::Random;

use crate::bench::{Bearing, Bench, Drive, Liquid};

const STEP: f64 = 0.02;
const LEAD_IN: f64 = 5.0;
/// Standard deviation of the gyro's noise, and its quantisation step, rad/s (thesis 5.5: N = 5.75e-5 rad/s/√Hz at 50 Hz).
pub const GYRO: (f64, f64) = (4.066e-4, 1.527e-4);
/// Asymmetry of the bearing's dry friction: the friction forwards is (1 + asymmetry) times, and the friction backwards (1 −
/// asymmetry) times the mean.
pub const ASYMMETRY: f64 = 0.15;
/// Rates about x and y with which the platform tilts, relative to the hub's rate about z.
const TILT: [f64; 2] = [0.03, 0.02];
const EMPTY: f64 = 1e-9;

const COLUMNS: [&str; 2] = [
    "time=t:ms,tau_cmd=T_cmd:mNm,omega=gyro_z:deg/s,theta=encoder:deg",
    "time=t:ms,tau_cmd=T_cmd:mNm,omega=gyro_z:deg/s,omega_x=gyro_x:deg/s,omega_y=gyro_y:deg/s",
];

/// Settings of a simulated day at the bench: the gyro's bias about x, y and z (deg/s), the liquid of the sweeps, filling heights (m),
/// torque amplitudes (N·m), durations of a sweep and of the recording at rest (s, 0 for none), `friction` (true for friction runs and free
/// decays), the slosh models of the report, and the fraction of rows that the logger loses.
pub struct Day<'a> {
    pub bias: [f64; 3],
    pub liquid: Liquid,
    pub fills: &'a [f64],
    pub amplitudes: &'a [f64],
    pub sweep: f64,
    pub rest: f64,
    pub friction: bool,
    pub models: &'a str,
    /// Relative error of the logger's clock: true time = logged time · (1 − clock).
    pub clock: f64,
    pub lost: f64,
}

pub const SHORT: Day = Day {
    bias: [5.0, -2.0, 1.0],
    liquid: Liquid::Linear,
    fills: &[0.05, 0.1],
    amplitudes: &[0.025, 0.075, 0.15],
    sweep: 450.0,
    rest: 600.0,
    friction: true,
    models: "\"linear\"",
    clock: 0.0,
    lost: 0.0,
};

pub fn bench(liquid: Liquid, height: f64) -> Bench {
    let bearing = Bearing { asymmetry: ASYMMETRY, ..Bench::default().bearing };
    Bench { liquid, height, bearing, ..Bench::default() }
}

impl Day<'_> {
    pub fn write(&self, directory: &Path) -> io::Result<()> {
        let mut manifest = format!(
            "title = \"A day at the independent bench\"\nprofile = \"exp-sweep:f0=1.25,f1=3.5,duration={:?}\"\n\
             columns = \"{}\"\nmodels = [{}]\n\n[set]\nslosh.zeta_from_correlation = false\nslosh.zeta = {}\n",
            self.sweep,
            COLUMNS[1],
            self.models,
            Bench::default().zeta
        );
        let mut number = 0;
        let mut add = |name: &str, keys: &str, log: String| -> io::Result<()> {
            let _ = write!(manifest, "\n[[recording]]\n{keys}\nfile = \"{name}.csv\"\n");
            std::fs::write(directory.join(format!("{name}.csv")), log)
        };
        let mut log = |bench: &Bench, torque: &dyn Fn(f64) -> f64, seconds: f64| {
            number += 1;
            self.log(number, bench, torque, seconds)
        };
        if self.friction {
            let empty = bench(Liquid::Frozen, EMPTY);
            let ramp = |t: f64| if t < 60.0 { 0.002 * t } else { 0.12 - 0.004 * (t - 60.0) };
            let step = |t: f64| if t < 60.0 { 0.05 } else { 0.0 };
            let sweep = |t: f64| 0.1 * (TAU * (1.25 * t + 2.25 / 240.0 * t * t)).sin();
            let push = |way: f64| move |t: f64| if t < 5.0 { 0.1 * way } else { 0.0 };
            let keys = |kind: &str| format!("kind = \"{kind}\"\ncolumns = \"{}\"", COLUMNS[0]);
            add("ramp", &keys("friction"), log(&empty, &ramp, 120.0))?;
            add("step", &keys("friction"), log(&empty, &step, 120.0))?;
            add("friction_sweep", &keys("friction"), log(&empty, &sweep, 120.0))?;
            add("push_forwards", &keys("decay"), log(&empty, &push(1.0), 60.0))?;
            add("push_backwards", &keys("decay"), log(&empty, &push(-1.0), 60.0))?;
        }
        if self.rest > 0.0 {
            let still = bench(Liquid::Frozen, EMPTY);
            let keys = "kind = \"rest\"\ncolumns = \"time=t:ms,omega=gyro_z:deg/s\"";
            add("rest", keys, log(&still, &|_| 0.0, self.rest))?;
        }
        for &fill in self.fills {
            for &amplitude in self.amplitudes {
                let sweep = |t: f64| amplitude * chirp(t, self.sweep);
                let name = format!("sweep_{:.0}mm_{:.1}mNm", 1e3 * fill, 1e3 * amplitude);
                let keys = format!("kind = \"sweep\"\nfill = {fill:?}\namplitude = {amplitude:?}");
                add(&name, &keys, log(&bench(self.liquid, fill), &sweep, self.sweep))?;
            }
        }
        std::fs::write(directory.join("day.toml"), manifest)
    }

    /// Returns the text of one log. `torque`, N·m, is a function of the time since the end of the initial rest.
    fn log(&self, number: u64, bench: &Bench, torque: &dyn Fn(f64) -> f64, seconds: f64) -> String {
        let rows = ((LEAD_IN + seconds) / STEP).round() as usize;
        let time: Vec<f64> = (0..=rows).map(|k| STEP * k as f64).collect();
        let tau: Vec<f64> = time
            .iter()
            .map(|t| if *t < LEAD_IN - 1e-9 { 0.0 } else { torque(t - LEAD_IN) })
            .collect();
        let motion = bench.motion(&Drive::Lines(&time, &tau), &time);
        let mut random = Random::new(1, number);
        let mut text = String::from("t;T_cmd;gyro_x;gyro_y;gyro_z;encoder\n");
        for (k, rate) in motion.rate.iter().enumerate() {
            let [x, y, z] =
                [(TILT[0] * rate, 0), (TILT[1] * rate, 1), (*rate, 2)].map(|(rate, axis)| {
                    let read = rate + self.bias[axis].to_radians() + GYRO.0 * random.normal();
                    ((read / GYRO.1).round() * GYRO.1).to_degrees()
                });
            let angle = motion.angle[k].to_degrees();
            let is_lost = self.lost > 0.0 && random.uniform() < self.lost;
            if !is_lost {
                let time = 20.0 * k as f64 * (1.0 + self.clock);
                let _ = writeln!(text, "{time};{};{x};{y};{z};{angle:.4}", 1e3 * tau[k]);
            }
        }
        text
    }
}

/// Returns the sine of the thesis's exponential sweep from 1.25 to 3.5 Hz, at time `t` of `duration`, s.
fn chirp(t: f64, duration: f64) -> f64 {
    let (from, ratio): (f64, f64) = (1.25, 3.5 / 1.25);
    (TAU * from * duration / ratio.ln() * (ratio.powf(t / duration) - 1.0)).sin()
}
