//! Recordings that the FMU simulates in place of a real bench, with noise of the gyro. They test the identification, and predict
//! what a planned experiment would record.

use analysis::random::Random;
use anyhow::{Result, ensure};
use experiments::profile::{Profile, Torque};
use experiments::run::{Run, TORQUE};
use host::drive::Inputs;
use host::fmu::Fmu;

use identify::bench::design::Multisine;
use identify::engine::Hold;
use identify::input::recording::Recording;

/// Errors of the gyro and of the data link in addition to the noise that the FMU simulates: the delay from torque to rate (s;
/// exact if it is a multiple of the sampling time), the gyro's scale (its reading divided by the rate) and its bias (rad/s).
#[derive(Clone, Copy, Debug)]
pub struct SensorErrors {
    pub delay: f64,
    pub gyro_scale: f64,
    pub gyro_bias: f64,
}

impl Default for SensorErrors {
    fn default() -> Self {
        SensorErrors { delay: 0.0, gyro_scale: 1.0, gyro_bias: 0.0 }
    }
}

/// Effects of a simulated bench that no fitted model contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unmodelled {
    /// The hub nutates at [`ROCKING`] under the wheel's torque, and the gyro measures a part of this motion.
    Nutation,
    /// The bearing warms up: its friction falls by [`WARM`] with a time constant of 600 s.
    Warming,
    /// Air brakes the hub with the torque [`AIR`] ω|ω|, N·m, at the rate ω, rad/s.
    Drag,
    /// The wheel's torque follows its command with the time constant [`LAG`].
    ActuatorLag,
}

const ROCKING: f64 = 4.1;
const ROCKING_DAMPING: f64 = 0.01;
/// Rate of the nutation as read by the gyro, relative to the hub's rate, at frequencies far below the nutation frequency.
const ROCKING_SEEN: f64 = 0.01;
/// Relative decrease of the bearing's friction from cold to warm.
const WARM: f64 = 0.3;
/// Coefficient of the aerodynamic drag torque, which is quadratic in the rate, N·m·s².
const AIR: f64 = 0.02;
/// Time constant of the actuator's lag, s.
const LAG: f64 = 0.03;
/// Number of substeps in each row of the recording in which the torque of an actuator with a lag is computed.
const LAG_PARTS: usize = 8;
const WARMING: f64 = 600.0;

/// Returns a torque by name: `multisine:PEAK,SECONDS` (1.25 to 3.5 Hz, periods of 100 s) or a profile of `hubslosh run`.
pub fn torque(text: &str) -> Result<Torque> {
    let Some(numbers) = text.strip_prefix("multisine:") else {
        return Ok(Torque::Profile(text.parse::<Profile>()?));
    };
    let numbers: Vec<f64> = numbers.split(',').map(str::parse).collect::<Result<_, _>>()?;
    ensure!(numbers.len() == 2, "a multisine is multisine:PEAK,SECONDS, not {text}");
    let sine = Multisine::new(100.0, (1.25, 3.5), numbers[0], 1)?;
    // dense enough for linear interpolation: (2π 3.5 Hz 5 ms)²/8 = 0.15 %
    let time: Vec<f64> = (0..=(numbers[1] / 0.005) as u32).map(|k| 0.005 * f64::from(k)).collect();
    let tau: Vec<f64> = time.iter().map(|t| sine.at(*t)).collect();
    Torque::rows(&time, &tau, None, false)
}

/// A bench that the FMU simulates (twin): its settings, the rows per second (`rate`), the intersample behaviour of the torque,
/// errors of sensors, the standard deviation of an encoder's angle (rad, `None` without encoder), and effects that no fitted
/// model contains.
#[derive(Clone, Debug)]
pub struct Twin {
    pub settings: Vec<(String, String)>,
    pub rate: f64,
    pub intersample: Hold,
    pub sensor_errors: SensorErrors,
    pub encoder: Option<f64>,
    pub unmodelled: Vec<Unmodelled>,
}

impl Default for Twin {
    fn default() -> Self {
        Twin {
            settings: Vec::new(),
            rate: 50.0,
            intersample: Hold::FirstOrderHold,
            sensor_errors: SensorErrors::default(),
            encoder: None,
            unmodelled: Vec::new(),
        }
    }
}

impl Twin {
    fn settings(&self, seed: Option<u32>) -> Vec<(String, String)> {
        let imu = seed.map(|seed| {
            let (rate, seed) = (self.rate.to_string(), seed.to_string());
            [("imu.enabled", "true".into()), ("imu.rate", rate), ("imu.seed", seed)]
        });
        let imu = imu.into_iter().flatten().map(|(name, value)| (name.to_string(), value));
        self.settings.iter().cloned().chain(imu).collect()
    }

    /// Records the simulated bench under a torque. `seed` is the seed of the gyro's noise; `None` switches the noise off.
    pub fn record(&self, fmu: &Fmu, torque: &Torque, seed: Option<u32>) -> Result<Recording> {
        let (start, stop) = torque.span();
        let (step, late) = (1.0 / self.rate, self.sensor_errors.delay);
        let rows = ((stop - start) * self.rate).round() as usize;
        let time: Vec<f64> = (0..=rows).map(|k| start + k as f64 * step).collect();
        let tau: Vec<f64> = time.iter().map(|&t| torque.torque_at(t)).collect();
        // the delayed torque: its knots are shifted, and it is 0 before the first knot
        let held = self.intersample == Hold::ZeroOrderHold;
        let heard = if self.intersample == Hold::BandLimited {
            torque.clone()
        } else if late == 0.0 {
            Torque::rows(&time, &tau, None, held)?
        } else {
            let knots: Vec<f64> =
                std::iter::once(start).chain(time.iter().map(|t| t + late)).collect();
            let values: Vec<f64> = std::iter::once(tau[0]).chain(tau.iter().copied()).collect();
            Torque::rows(&knots, &values, None, held)?
        };
        let is = |effect: Unmodelled| self.unmodelled.contains(&effect);
        let lags = is(Unmodelled::ActuatorLag);
        let heard = if lags { behind(&heard, &time)? } else { heard };
        // substeps from one row to the next, which end at the knots of the torque, or are short against the period
        // of a smooth torque
        let parts = match (self.intersample, late == 0.0) {
            (Hold::BandLimited, _) => (step / 1e-3).ceil() as usize,
            (_, true) => 1,
            (_, false) => 4,
        };
        let drags = is(Unmodelled::Drag);
        // the drag torque is held for 1 ms, which delays it by 0.4° at 2.4 Hz
        let parts = if lags { LAG_PARTS } else { parts };
        let parts = if drags { parts.max((step / 1e-3).ceil() as usize) } else { parts };
        let run = Run {
            settings: self.settings(seed),
            input: Some(TORQUE.into()),
            torque: heard.clone(),
            others: Vec::new(),
            step: step / parts as f64,
            sample: step / parts as f64,
            stop,
            tolerance: None,
            hold: false,
        };
        let mut instance = run.initialise(fmu)?;
        let reference =
            |name: &str| Ok::<_, anyhow::Error>(fmu.description().variable(name)?.reference);
        let friction = ["friction.b", "friction.c", "friction.d"];
        let friction = friction.map(reference).into_iter().collect::<Result<Vec<u32>>>()?;
        let mut cold = vec![0.0; friction.len()];
        instance.get_real(&friction, &mut cold)?;
        let read = [reference("omega_imu")?, reference("omega_dot")?, reference("theta")?];
        let omega = reference("omega")?;
        let (mut angle, mut random) = (Vec::new(), Random::new(seed.unwrap_or(0).into(), 1));
        let (mut rate, mut rocking) = (Vec::with_capacity(time.len()), Rocking::default());
        let names = [TORQUE, names::hubslosh::TAU_EXT];
        let names = if drags { &names[..] } else { &names[..1] };
        let inputs = Inputs::new(fmu.description(), names, held)?;
        let mut steps = 0;
        inputs.drive(&mut instance, start, |instance, t, course| {
            let (row, part) = (steps / parts, steps % parts);
            let mut true_rate = [0.0];
            instance.get_real(&[omega], &mut true_rate)?;
            if part == 0 {
                let mut now = [0.0; 3];
                instance.get_real(&read, &mut now)?;
                let seen = match self.unmodelled.contains(&Unmodelled::Nutation) {
                    true => ROCKING_SEEN * rocking.step(now[1], step),
                    false => 0.0,
                };
                let SensorErrors { gyro_scale, gyro_bias, .. } = self.sensor_errors;
                rate.push(gyro_scale * (now[0] + seen) + gyro_bias);
                angle.extend(self.encoder.map(|std| now[2] + std * random.normal()));
                if row == rows {
                    return Ok(None);
                }
                if self.unmodelled.contains(&Unmodelled::Warming) && row % 50 == 0 {
                    let part = 1.0 - WARM * (1.0 - (-(time[row] - start) / WARMING).exp());
                    let warm: Vec<f64> = cold.iter().map(|value| value * part).collect();
                    instance.set_real(&friction, &warm)?;
                }
            }
            // the last step ends exactly at the next row, because the FMU adds up the step sizes
            let next = match part + 1 {
                end if end == parts => time[row + 1],
                end => time[row] + end as f64 * run.step,
            };
            let shift = if self.intersample == Hold::BandLimited { late } else { 0.0 };
            (course.values[0], course.slopes[0]) = match held {
                true => (heard.torque_at(t), 0.0),
                false => {
                    let from = (t - shift).max(start);
                    let now = heard.torque_at(from);
                    (now, (heard.torque_at(from + (next - t)) - now) / (next - t))
                }
            };
            if drags {
                let rate = true_rate[0];
                (course.values[1], course.slopes[1]) = (-AIR * rate * rate.abs(), 0.0);
            }
            steps += 1;
            Ok(Some(next))
        })?;
        let angle = self.encoder.map(|_| angle);
        Ok(Recording { angle, ..Recording::of("twin", time, tau, rate) })
    }
}

/// A first-order lag, y' = (u − y)/[`LAG`], which starts at 0.
#[derive(Default)]
struct Lag {
    y: f64,
    u: f64,
}

impl Lag {
    /// Advances by `step`, s, while the input changes linearly from its last value to `u`, by the trapezoidal rule.
    /// Returns the output y.
    fn step(&mut self, u: f64, step: f64) -> f64 {
        let half = 0.5 * step / LAG;
        self.y = ((1.0 - half) * self.y + half * (self.u + u)) / (1.0 + half);
        self.u = u;
        self.y
    }
}

/// Returns the torque of an actuator that lags behind its command `torque`, at [`LAG_PARTS`] instants in each
/// row of the recording.
fn behind(torque: &Torque, rows: &[f64]) -> Result<Torque> {
    let mut lag = Lag::default();
    let (mut time, mut tau) = (vec![rows[0]], vec![0.0]);
    for ends in rows.windows(2) {
        let h = (ends[1] - ends[0]) / LAG_PARTS as f64;
        for part in 1..=LAG_PARTS {
            let t = if part == LAG_PARTS { ends[1] } else { ends[0] + part as f64 * h };
            // the value of a held torque just before its change
            tau.push(lag.step(torque.torque_at(t - 1e-9), h));
            time.push(t);
        }
    }
    Torque::rows(&time, &tau, None, false)
}

/// Nutation of the hub by the angle φ: φ'' + 2ζΩφ' + Ω²φ = Ω² ∫a dt with the hub's acceleration a. Far below the frequency Ω the
/// angle φ is therefore proportional to the hub's rate.
#[derive(Default)]
struct Rocking {
    phi: f64,
    phi_dot: f64,
    rate: f64,
}

impl Rocking {
    /// Returns φ after a step with the acceleration a (rad/s²), by the semi-implicit Euler method in steps of 1 ms or less.
    fn step(&mut self, a: f64, step: f64) -> f64 {
        let w = std::f64::consts::TAU * ROCKING;
        let parts = (step / 1e-3).ceil();
        let h = step / parts;
        for _ in 0..parts as usize {
            self.rate += h * a;
            let force = w * w * (self.rate - self.phi) - 2.0 * ROCKING_DAMPING * w * self.phi_dot;
            self.phi_dot += h * force;
            self.phi += h * self.phi_dot;
        }
        self.phi
    }
}

/// Records the FMU under a torque at 50 Hz. `seed` is the seed of the gyro's noise; `None` switches the noise off.
pub fn record(
    fmu: &Fmu,
    settings: &[(&str, &str)],
    torque: &Torque,
    seed: Option<u32>,
    sensor_errors: SensorErrors,
) -> Result<Recording> {
    let pair = |(name, value): &(&str, &str)| (name.to_string(), value.to_string());
    let settings = settings.iter().map(pair).collect();
    Twin { settings, sensor_errors, ..Twin::default() }.record(fmu, torque, seed)
}
