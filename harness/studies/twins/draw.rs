//! A simulated bench (twin) with random parameters, a random torque, and sensors.

use std::f64::consts::TAU;

use analysis::random::Random;
use analysis::statistics::mean;
use anyhow::Result;
use experiments::profile::Profile;
use host::fmu::Fmu;
use identify::bench::design::Multisine;
use identify::bench::identification::Identification;
use identify::bench::options::Options;
use identify::engine::Hold;
use identify::input::reading::{Source, prepare, read};
use identify::input::recording::Recording;
use identify::input::tolerance::Tolerances;
use identify::methods::output_error;
use signals::recording::Columns;

use crate::bench::{Bearing, Bench, Drive, Liquid};
use crate::habits::Written;

/// Relative range about the values of the nominal bench within which a twin's true parameters are drawn.
const SPREAD: f64 = 0.3;
/// A MEMS gyro: white noise, rad/s/√Hz; standard deviation of its drift, rad/s; correlation time of the
/// drift, s; resolution, rad/s.
const GYRO: (f64, f64, f64, f64) = (5.75e-5, 7.85e-5, 100.0, 1.53e-4);

#[derive(Clone, Copy, Debug)]
enum Excitation {
    Up,
    Down,
    Slow,
    Multisine,
    Noise,
    Gentle,
}

/// A bench with its sensors and their clock. Times are in s, angles in rad, rates in rad/s, torques in N·m, and the sampling rate is in
/// rows per second.
pub struct Twin {
    pub seed: u64,
    bench: Bench,
    excitation: Excitation,
    between: Hold,
    duration: f64,
    pub delay: f64,
    gyro_scale: f64,
    gyro_bias: f64,
    pub encoder: Option<f64>,
    rate: f64,
    /// Ratio of recorded to true torque.
    torque_scale: f64,
    /// Ratio of recorded to true time.
    clock: f64,
    drift: Vec<f64>,
}

/// Signals of a twin as its sensors measure them: torque (N·m) at the instants of the commands, rate (rad/s) and, with
/// an encoder, angle (rad).
pub struct Measured {
    pub torque: Vec<f64>,
    pub rate: Vec<f64>,
    pub angle: Option<Vec<f64>>,
}

impl Twin {
    pub fn draw(seed: u64, duration: f64) -> Twin {
        let mut random = Random::new(seed, 7);
        let nominal = Bench::default();
        let mut near = |value: f64| value * (1.0 + SPREAD * (2.0 * random.uniform() - 1.0));
        let bearing = Bearing {
            b: near(nominal.bearing.b),
            c: near(nominal.bearing.c),
            d: near(nominal.bearing.d),
            omega_s: near(nominal.bearing.omega_s),
            ..nominal.bearing
        };
        let mut bench = Bench {
            hub_inertia: near(nominal.hub_inertia),
            diameter: near(nominal.diameter),
            height: near(nominal.height),
            zeta: near(nominal.zeta),
            bearing,
            ..nominal
        };
        // true values of quantities that the fit assumes to be known differ from the assumed values within their tolerances
        let Tolerances { torque, clock, gravity, arm, density } = Tolerances::default();
        let mut about = |part: f64| 1.0 + part * random.normal();
        let (torque_scale, clock) = (about(torque), about(clock));
        bench.gravity *= about(gravity);
        bench.arm *= about(arm);
        bench.density *= about(density);
        bench.bearing.asymmetry = 0.1 * (2.0 * random.uniform() - 1.0);
        let excitations = [
            Excitation::Up,
            Excitation::Down,
            Excitation::Multisine,
            Excitation::Noise,
            Excitation::Gentle,
            Excitation::Slow,
        ];
        let excitation = excitations[(seed % 6) as usize];
        let between = Hold::ALL[(random.uniform() * 3.0) as usize];
        bench.liquid = if random.uniform() < 0.4 { Liquid::Spherical } else { Liquid::Linear };
        let mut twin = Twin {
            seed,
            excitation,
            between,
            duration: if matches!(excitation, Excitation::Slow) {
                2.0 * duration
            } else {
                duration
            },
            delay: 0.01 * random.uniform(),
            gyro_scale: 1.0 + 0.01 * random.normal(),
            gyro_bias: 3e-3 * random.normal(),
            encoder: match (random.uniform() * 8.0) as usize {
                0 => Some(2e-5),
                1 => Some(3e-4),
                _ => None,
            },
            rate: if random.uniform() < 0.1 { 100.0 } else { 50.0 },
            torque_scale,
            clock,
            drift: Vec::new(),
            bench,
        };
        // the drift of the gyro's bias is a Gauss–Markov process
        let (_, drift, correlation, _) = GYRO;
        let keep = (-1.0 / (twin.rate * correlation)).exp();
        let mut now = drift * random.normal();
        for _ in 0..=(twin.duration * twin.rate).round() as usize {
            twin.drift.push(now);
            now = keep * now + drift * (1.0 - keep * keep).sqrt() * random.normal();
        }
        twin
    }

    pub fn with_rate(mut self, rate: f64) -> Twin {
        let rows = (self.duration * rate).round() as usize;
        let last = self.drift.len() - 1;
        let drift =
            |k: usize| self.drift[((k as f64 * self.rate / rate).round() as usize).min(last)];
        let drift = (0..=rows).map(drift).collect();
        (self.drift, self.rate) = (drift, rate);
        self
    }

    /// Returns the intersample behaviour that the fit is given, or `None` for half of the twins, whose fit has to choose it.
    pub fn known_intersample(&self) -> Option<Hold> {
        (self.seed.is_multiple_of(2)).then_some(self.between)
    }

    /// Returns the slosh models to fit: the true model and, for every third twin, a second one.
    pub fn models(&self) -> Vec<String> {
        let own = if self.bench.liquid == Liquid::Linear { "linear" } else { "spherical" };
        let all = ["linear", "spherical"].into_iter();
        all.filter(|name| self.seed.is_multiple_of(3) || *name == own).map(String::from).collect()
    }

    pub fn words(&self) -> String {
        format!(
            "{:?} {:?}, {}{}, {} Hz",
            self.excitation,
            self.bench.liquid,
            self.between.words().split(' ').next().unwrap_or_default(),
            self.encoder.map_or(String::new(), |std| format!(", encoder {std:.0e}")),
            self.rate
        )
    }

    pub fn truths(&self) -> Vec<(&'static str, f64)> {
        let Bench { hub_inertia, diameter, height, zeta, bearing, .. } = &self.bench;
        vec![
            ("tank.d", *diameter),
            ("tank.h", *height),
            ("slosh.zeta", *zeta),
            ("hub.I", *hub_inertia),
            ("friction.b", bearing.b),
            ("friction.c", bearing.c),
            ("friction.d", bearing.d),
            ("friction.omega_s", bearing.omega_s),
            ("friction.asymmetry", bearing.asymmetry),
            ("delay", self.delay),
            ("gyro_scale", self.gyro_scale),
            // mean of the gyro's bias in the recording, with the mean of its drift
            ("gyro_bias[1]", self.gyro_bias + self.gyro_scale * mean(&self.drift)),
        ]
    }

    fn torque(&self) -> Box<dyn Fn(f64) -> f64> {
        let duration = self.duration;
        let profile = |text: String| -> Box<dyn Fn(f64) -> f64> {
            let profile: Profile = text.parse().expect("a profile");
            let torque = experiments::profile::Torque::Profile(profile);
            Box::new(move |t| torque.torque_at(t))
        };
        match self.excitation {
            Excitation::Up => {
                profile(format!("lin-sweep:amplitude=0.1,f0=1.5,f1=3.6,duration={duration}"))
            }
            Excitation::Down => {
                profile(format!("lin-sweep:amplitude=0.1,f0=3.6,f1=1.5,duration={duration}"))
            }
            Excitation::Slow => profile(format!(
                "exp-sweep:amplitude=0.08,f0=1.5,f1=3.6,duration={}",
                2.0 * duration
            )),
            Excitation::Gentle => {
                profile(format!("lin-sweep:amplitude=0.04,f0=1.5,f1=3.6,duration={duration}"))
            }
            Excitation::Noise => profile(format!(
                "noise:rms=0.05,f0=1.25,f1=3.6,limit=0.26,duration={duration},seed={}",
                self.seed
            )),
            Excitation::Multisine => {
                let sine =
                    Multisine::new(100.0, (1.25, 3.6), 0.25, self.seed).expect("a multisine");
                Box::new(move |t| sine.at(t))
            }
        }
    }

    pub fn record(&self) -> Recording {
        let rows = self.rows();
        let Measured { torque, rate, angle } = self.measure(&rows, &rows, self.delay);
        Recording { angle, ..Recording::of("twin", self.stamps(&rows), torque, rate) }
    }

    pub fn rows(&self) -> Vec<f64> {
        (0..self.drift.len()).map(|k| k as f64 / self.rate).collect()
    }

    /// Converts true instants to the times of the recording's clock, which runs fast or slow, s.
    pub fn stamps(&self, instants: &[f64]) -> Vec<f64> {
        instants.iter().map(|t| self.clock * t).collect()
    }

    /// Measures the sensors at `instants` (s) while the torque is commanded at the instants `commands` (s). The encoder is
    /// delayed by `encoder_delay` (s).
    pub fn measure(&self, commands: &[f64], instants: &[f64], encoder_delay: f64) -> Measured {
        let torque = self.torque();
        let tau: Vec<f64> = commands.iter().map(|t| torque(*t)).collect();
        let drive = match self.between {
            Hold::FirstOrderHold => Drive::Lines(commands, &tau),
            Hold::ZeroOrderHold => Drive::Held(commands, &tau),
            Hold::BandLimited => Drive::Smooth(commands, &*torque),
        };
        let late =
            |delay: f64| -> Vec<f64> { instants.iter().map(|t| (t - delay).max(0.0)).collect() };
        let motion = self.bench.motion(&drive, &late(self.delay));
        let mut random = Random::new(self.seed, 8);
        let (white, _, _, least) = GYRO;
        let drift =
            |t: f64| self.drift[((t * self.rate).round() as usize).min(self.drift.len() - 1)];
        let rate = motion.rate.iter().zip(instants).map(|(rate, t)| {
            let noise = drift(*t) + white * self.rate.sqrt() * random.normal();
            ((self.gyro_scale * (rate + noise) + self.gyro_bias) / least).round() * least
        });
        let rate: Vec<f64> = rate.collect();
        let angle = self.encoder.map(|std| {
            let angles = match encoder_delay == self.delay {
                true => motion.angle.clone(),
                false => self.bench.motion(&drive, &late(encoder_delay)).angle,
            };
            angles.iter().map(|angle| angle + TAU * 0.1 + std * random.normal()).collect()
        });
        // the torque that the recording contains
        let torque = tau.iter().map(|tau| self.torque_scale * tau).collect();
        Measured { torque, rate, angle }
    }

    /// Identifies the recording of the twin with these slosh models, as a user would. `report` receives each message.
    pub fn identify(
        &self,
        fmu: &Fmu,
        models: Vec<String>,
        report: &dyn Fn(&str),
    ) -> Result<Identification> {
        let options =
            Options { intersample: self.known_intersample(), models, ..Options::default() };
        let coarsest = options.nominal(fmu)?.coarsest();
        let parts = prepare(self.record(), coarsest, &mut |line| report(&line))?;
        output_error::identify(fmu, &parts, &options, &mut |news| report(news.line()))
    }

    pub fn identify_file(
        &self,
        fmu: &Fmu,
        models: Vec<String>,
        written: &Written,
        report: &dyn Fn(&str),
    ) -> Result<Identification> {
        let options =
            Options { intersample: self.known_intersample(), models, ..Options::default() };
        let coarsest = options.nominal(fmu)?.coarsest();
        let columns: Columns = written.columns.parse()?;
        let source = Source { columns: columns.with_rate(written.rate)?, trim: written.trim };
        let parts = read(&written.path, &source, coarsest, &mut |line| report(&line))?;
        output_error::identify(fmu, &parts, &options, &mut |news| report(news.line()))
    }
}
