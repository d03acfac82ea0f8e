//! Recordings of the FMU in place of a bench, with its gyro's noise: what identification is tried on,
//! and what a planned experiment would record.

use anyhow::{Context, Result};
use bench::profile::Torque;
use bench::run::Run;
use host::fmi2::Fmu;

use crate::recording::Recording;

/// What the gyro and the data link add to the FMU's own noise.
#[derive(Clone, Copy, Debug)]
pub struct Flaws {
    /// Delay from torque to rate, s; a multiple of the sampling time is exact.
    pub delay: f64,
    /// Reading over rate.
    pub gyro_scale: f64,
    /// Reading at rest, rad/s.
    pub gyro_bias: f64,
}

impl Default for Flaws {
    fn default() -> Self {
        Flaws { delay: 0.0, gyro_scale: 1.0, gyro_bias: 0.0 }
    }
}

/// Records the FMU under a torque at 50 Hz; `seed` is that of the gyro's noise, none without noise.
pub fn record(
    fmu: &Fmu,
    settings: &[(&str, &str)],
    torque: &Torque,
    seed: Option<u32>,
    flaws: Flaws,
) -> Result<Recording> {
    let pair = |(name, value): &(&str, &str)| (name.to_string(), value.to_string());
    let mut all: Vec<(String, String)> = settings.iter().map(pair).collect();
    if let Some(seed) = seed {
        all.extend([("imu.enabled", "true"), ("imu.seed", &seed.to_string())].iter().map(pair));
    }
    let (start, stop) = torque.span();
    // the FMU hears the torque late: a profile is shifted by the delay, its beginning is no torque
    let (step, late) = (0.02, flaws.delay);
    let rows = ((stop - start) / step).round() as usize;
    let time: Vec<f64> = (0..=rows).map(|k| start + k as f64 * step).collect();
    let tau: Vec<f64> = time.iter().map(|&t| torque.at(t)).collect();
    let heard = if late == 0.0 {
        Torque::Rows { time: time.clone(), tau: tau.clone(), held: false }
    } else {
        // knots of the recorded torque, late
        let knots = std::iter::once(start).chain(time.iter().map(|t| t + late)).collect();
        let values = std::iter::once(tau[0]).chain(tau.iter().copied()).collect();
        Torque::Rows { time: knots, tau: values, held: false }
    };
    // steps that meet the knots
    let parts = if late == 0.0 { 1 } else { 4 };
    let run = Run {
        settings: all,
        input: Some(bench::run::TORQUE.into()),
        torque: heard,
        others: Vec::new(),
        step: step / parts as f64,
        stop,
        tolerance: None,
        hold: false,
    };
    let mut instance = run.initialise(fmu)?;
    let table = run.drive(&mut instance, &["omega_imu"], |_| {})?;
    let rate = table.column("omega_imu").context("a column that was recorded")?;
    let measured = |w: &f64| flaws.gyro_scale * w + flaws.gyro_bias;
    let rate = rate.iter().step_by(parts).map(measured).collect();
    Ok(Recording::of("twin", time, tau, rate))
}
