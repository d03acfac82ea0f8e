//! The thesis's identification in the time domain (6.1.1 and 6.1.2), for comparison with ours. It computes a known friction
//! from the *measured* rate, adds it to the torque, and fits a linear model without friction.
//!
//! ```text
//! τ_act = τ_cmd + τ_f(ω_measured),   ω ≈ linear bench(d, h, ζ) driven by τ_act
//! ```
//!
//! It fails because in this model only the slosh dissipates energy. Noise near ω = 0, a gyro's bias and slightly wrong friction
//! all cause errors of τ_act. A hub without friction integrates these errors, and the simulated rate drifts away. In the FMU,
//! which has friction, the effect of the same errors decays within seconds.

use std::f64::consts::PI;

use analysis::linear::{Linear, Mode};
use analysis::transfer_function::fit_time;
use anyhow::{Result, ensure};
use formulas::cylinder::{Pendulum, pendulum};

use analysis::least_squares::{differences, minimise};
use identify::bench::nominal::Bench;
use identify::input::recording::Recording;

/// Friction of the bearing, which the method assumes to be known; SI units.
#[derive(Clone, Copy, Debug)]
pub struct Friction {
    pub b: f64,
    pub c: f64,
    pub d: f64,
    pub omega_s: f64,
    /// Speed below which the dry friction is left out, rad/s (the thesis's dead band); 0 for no dead band.
    pub dead_band: f64,
}

impl Friction {
    /// Returns the friction torque τ_f at a rate, N·m.
    pub fn torque(&self, w: f64) -> f64 {
        let dry = self.c + self.d * (-(w / self.omega_s).powi(2)).exp();
        let sign = if w.abs() <= self.dead_band { 0.0 } else { w.signum() };
        -(self.b * w + sign * dry)
    }
}

fn bench_of(hub_inertia: f64, (d, h, zeta): (f64, f64, f64), bench: Bench) -> Linear {
    let liquid = bench.liquid(d, h);
    let Pendulum { mass, length, .. } = pendulum(0, d, h, liquid);
    let frequency = (bench.gravity / length).sqrt() / (2.0 * PI);
    let inertia = hub_inertia + bench.inertia(liquid - mass);
    let modes = vec![Mode { mass, frequency, damping: zeta }];
    Linear { inertia, arm: bench.arm, modes, ..Linear::default() }
}

/// Fits tank diameter d, filling height h and damping ratio ζ from start values, with known inertia of the hub and friction.
/// Also returns the fit of the simulated rate ŷ to the measured rate y, %: 100 (1 − ‖y − ŷ‖/‖y − mean y‖).
pub fn identify(
    recording: &Recording,
    friction: Friction,
    hub_inertia: f64,
    start: (f64, f64, f64),
    bench: Bench,
) -> Result<f64> {
    let (step, torque, rate) = recording.even()?;
    let actual: Vec<f64> =
        torque.iter().zip(&rate).map(|(tau, w)| tau + friction.torque(*w)).collect();
    let simulated = |x: &[f64]| {
        let tank = (x[0].exp(), x[1].exp(), x[2].exp());
        bench_of(hub_inertia, tank, bench).simulate(step, &actual, 0.0)
    };
    let residuals = |x: &[f64]| -> Vec<f64> {
        simulated(x).iter().zip(&rate).map(|(model, w)| model - w).collect()
    };
    let x = [start.0.ln(), start.1.ln(), start.2.ln()];
    let derivatives = |x: &[f64]| Some(differences(&residuals, x, &[1e-5; 3]));
    let found = minimise(&residuals, &derivatives, &x).x;
    ensure!(found.iter().all(|x| x.is_finite()), "{}: the search failed", recording.name);
    Ok(fit_time(&rate, &simulated(&found)))
}
