//! The exact frequency response of the linear model with viscous friction:
//!
//! ```text
//! Ω/τ = 1 / ( I0 s + b + k/s + s Σ m_i r² (2 ζ_i ω_i s + ω_i²) / (s² + 2 ζ_i ω_i s + ω_i²) )
//! ```
//!
//! from the hub's equation I0 ω' = τ − b ω − k θ + r Σ (m_i g α_i + c_i l_i α_i') and the
//! pendulums' α_i'' + 2 ζ_i ω_i α_i' + ω_i² α_i = −(r/l_i) ω'. These are thesis 4.27 and 4.29 with
//! the sign of the slosh torque corrected. The zeros are the pendulums' own poles: the
//! antiresonance is at the slosh frequency, the resonance above it.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::DMatrix;

use crate::exponential::exponential;
use crate::response::FrequencyResponse;
use fourier::Complex64;

/// Linear model of a hub with slosh modes.
///
/// - `inertia`: inertia of hub and rigid liquid about the axis, kg·m².
/// - `friction`: viscous friction of the bearing, N·m·s.
/// - `stiffness`: torsional stiffness of the suspension line, N·m/rad.
/// - `arm`: distance of the tank from the axis, m.
/// - `modes`: mass, kg, natural frequency, Hz, and damping ratio of each slosh mode.
#[derive(Clone, Debug, Default)]
pub struct Linear {
    pub inertia: f64,
    pub friction: f64,
    pub stiffness: f64,
    pub arm: f64,
    pub modes: Vec<Mode>,
}

#[derive(Clone, Copy, Debug)]
pub struct Mode {
    pub mass: f64,
    pub frequency: f64,
    pub damping: f64,
}

const SAME: f64 = 1e-9;
const FLOWS: usize = 1000;

impl Linear {
    /// Returns the frequency response of the hub's rate to the torque, (rad/s)/(N·m), at
    /// `frequency`, Hz.
    pub fn response(&self, frequency: f64) -> Complex64 {
        let s = Complex64::new(0.0, TAU * frequency);
        let slosh: Complex64 = self
            .modes
            .iter()
            .map(|mode| {
                let w = TAU * mode.frequency;
                let spring = 2.0 * mode.damping * w * s + w * w;
                mode.mass * self.arm * self.arm * spring / (s * s + spring)
            })
            .sum();
        (s * (slosh + self.inertia) + self.friction + self.stiffness / s).inv()
    }

    /// Simulates the hub's rate, rad/s, for a torque whose samples, N·m, are `step` seconds apart
    /// and joined by straight lines. `start` is the rate at the beginning, when the liquid is at
    /// rest.
    pub fn simulate(&self, step: f64, torque: &[f64], start: f64) -> Vec<f64> {
        let slope = |pair: &[f64]| (pair[1] - pair[0]) / step;
        let slopes: Vec<f64> = torque.windows(2).map(slope).chain([0.0]).collect();
        self.propagate(&|_| step, torque, &slopes, start)
    }

    /// Simulates the hub's rate, rad/s, at the times `time`, s. The torque has the value
    /// `torque[k]`, N·m, at `time[k]` and the slope `slopes[k]`, N·m/s, until the next time, at
    /// which it may jump. `start` is the rate at the first time.
    pub fn simulate_ramps(
        &self,
        time: &[f64],
        torque: &[f64],
        slopes: &[f64],
        start: f64,
    ) -> Vec<f64> {
        let step = |k: usize| time.get(k + 1).map_or(0.0, |next| next - time[k]);
        self.propagate(&step, torque, slopes, start)
    }

    /// Simulates the hub's rate, rad/s, for a torque given by its value at the beginning of each
    /// step, N·m, and its slope over the step, N·m/s. `step` returns the length of each step, s,
    /// and `start` is the rate at the beginning. The result is exact, because it uses the matrix
    /// exponential of the states together with the torque's value and slope. The states are the
    /// hub's rate, the displacement and the velocity of each mode, and the hub's angle.
    fn propagate(
        &self,
        step: &dyn Fn(usize) -> f64,
        torque: &[f64],
        slopes: &[f64],
        start: f64,
    ) -> Vec<f64> {
        let theta = 1 + 2 * self.modes.len();
        let n = theta + 1;
        let mut flow = DMatrix::<f64>::zeros(n + 2, n + 2);
        (flow[(0, 0)], flow[(0, n)]) = (-self.friction / self.inertia, 1.0 / self.inertia);
        (flow[(0, theta)], flow[(theta, 0)]) = (-self.stiffness / self.inertia, 1.0);
        for (i, mode) in self.modes.iter().enumerate() {
            let (y, w) = (1 + 2 * i, TAU * mode.frequency);
            let pull = self.arm * mode.mass / self.inertia;
            flow[(0, y)] = pull * w * w;
            flow[(0, y + 1)] = pull * 2.0 * mode.damping * w;
        }
        let acceleration = flow.row(0).into_owned();
        for (i, mode) in self.modes.iter().enumerate() {
            let (y, w) = (1 + 2 * i, TAU * mode.frequency);
            flow[(y, y + 1)] = 1.0;
            for j in 0..n + 2 {
                flow[(y + 1, j)] = -self.arm * acceleration[j];
            }
            flow[(y + 1, y)] -= w * w;
            flow[(y + 1, y + 1)] -= 2.0 * mode.damping * w;
        }
        flow[(n, n + 1)] = 1.0;
        // Steps whose lengths differ only by rounding share one exponential.
        let mut flows: BTreeMap<i64, DMatrix<f64>> = BTreeMap::new();
        let mut x = vec![0.0; n];
        x[0] = start;
        let mut next = x.clone();
        let mut rates = Vec::with_capacity(torque.len());
        for (k, (tau, slope)) in torque.iter().zip(slopes).enumerate() {
            rates.push(x[0]);
            let length = step(k);
            if length == 0.0 {
                continue;
            }
            if flows.len() > FLOWS {
                flows.clear();
            }
            let place = (length.ln() / SAME).round() as i64;
            let flow = flows.entry(place).or_insert_with(|| {
                let flow = &flow * length;
                let size = flow.abs().sum();
                exponential(flow, size, DMatrix::exp)
            });
            for (i, value) in next.iter_mut().enumerate() {
                let state: f64 = x.iter().enumerate().map(|(j, x)| flow[(i, j)] * x).sum();
                *value = state + flow[(i, n)] * tau + flow[(i, n + 1)] * slope;
            }
            x.copy_from_slice(&next);
        }
        rates
    }

    pub fn frequency_response(&self, frequencies: &[f64]) -> FrequencyResponse {
        FrequencyResponse {
            frequency: frequencies.to_vec(),
            response: frequencies.iter().map(|&f| self.response(f)).collect(),
        }
    }
}

impl Linear {
    /// Returns the model of the bench of Rubaga's thesis with 10 cm of water. The slosh mode has
    /// the values of the thesis's Table 4.1, recomputed with the exact first root of J1', the
    /// density 1000 kg/m³ and g = 9.81 m/s². `damping` is the damping ratio of the slosh mode.
    pub fn bench_10_cm(damping: f64) -> Self {
        Self::bench(1.3304311085, 0.7562932719, 2.3436181431, damping)
    }

    pub fn bench_5_cm(damping: f64) -> Self {
        Self::bench(0.4165810206, 0.6267811696, 2.1335346636, damping)
    }

    fn bench(fixed_mass: f64, mass: f64, frequency: f64, damping: f64) -> Self {
        Linear {
            inertia: 0.322414 + fixed_mass * 0.225 * 0.225,
            friction: 0.03793,
            arm: 0.225,
            modes: vec![Mode { mass, frequency, damping }],
            ..Linear::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Linear;
    use crate::features::Features;
    use crate::response::{BAND, logarithmic_grid};
    use crate::sweep::{Law, Sweep};
    use crate::{demodulation, spa};
    use std::f64::consts::TAU;

    #[test]
    fn a_jump_of_the_torque_between_samples_is_not_simulated_as_a_slope() {
        // a free hub: 0.2 N·m for 1 s, 0 for 1 s, -0.2 N·m for 1 s; the jumps are between samples 0.1 s apart
        let hub = Linear { inertia: 0.4, arm: 0.2, ..Linear::default() };
        let torque: Vec<f64> = (0..40)
            .map(|k| match k {
                0..10 => 0.2,
                20..30 => -0.2,
                _ => 0.0,
            })
            .collect();
        let time: Vec<f64> = (0..40).map(|k| 0.1 * f64::from(k)).collect();
        let rates = hub.simulate_ramps(&time, &torque, &[0.0; 40], 0.0);
        for (k, expected) in [(5, 0.25), (10, 0.5), (20, 0.5), (25, 0.25), (30, 0.0), (39, 0.0)] {
            assert!((rates[k] - expected).abs() < 1e-14, "{k}: {}", rates[k]);
        }
        // steps of other lengths, also across the jumps: 0.2 N·m for 0.25 s
        let rates =
            hub.simulate_ramps(&[0.0, 0.05, 0.25, 1.0], &[0.2, 0.2, 0.0, 0.0], &[0.0; 4], 0.0);
        for (rate, expected) in rates.iter().zip([0.0, 0.025, 0.125, 0.125]) {
            assert!((rate - expected).abs() < 1e-15, "{rates:?}");
        }
    }

    #[test]
    fn the_simulated_response_to_a_sine_has_the_gain_of_the_frequency_response() {
        for stiffness in [0.0, 60.0] {
            let plant = Linear { friction: 2.0, stiffness, ..Linear::bench_10_cm(0.05) };
            let (step, f) = (0.002, 2.2);
            let torque: Vec<f64> =
                (0..40_000).map(|k| (TAU * f * f64::from(k) * step).sin()).collect();
            let rate = plant.simulate(step, &torque, 0.0);
            let largest = rate[35_000..].iter().fold(0.0f64, |m, y| m.max(y.abs()));
            // after 70 s the transient has decayed; the errors of linear interpolation and of the sampled
            // maximum are (w h)²/8
            assert!((largest / plant.response(f).norm() - 1.0).abs() < 2e-4, "{largest}");
        }
    }

    /// Integrates the linear bench `plant` by the Runge–Kutta method of fourth order with steps of
    /// 2.5 ms, whose phase error over a whole sweep is 2e-5 rad. The torque is sampled at 50 Hz and
    /// interpolated linearly. Returns time, torque and rate.
    fn swept(plant: &Linear, sweep: &Sweep) -> [Vec<f64>; 3] {
        let mode = plant.modes[0];
        let (w, r) = (TAU * mode.frequency, plant.arm);
        let l = 9.81 / (w * w);
        let slope = |[omega, angle, rate]: [f64; 3], tau: f64| {
            let fluid = r * mode.mass * l * (w * w * angle + 2.0 * mode.damping * w * rate);
            let acceleration = (tau - plant.friction * omega + fluid) / plant.inertia;
            [
                acceleration,
                rate,
                -2.0 * mode.damping * w * rate - w * w * angle - r / l * acceleration,
            ]
        };
        let add = |x: [f64; 3], k: [f64; 3], h: f64| [0, 1, 2].map(|i| x[i] + h * k[i]);
        let (step, parts) = (0.02, 8);
        let h = step / parts as f64;
        let mut x = [0.0; 3];
        let mut signals = [vec![], vec![], vec![]];
        for k in 0..=(sweep.duration / step).round() as usize {
            let t = k as f64 * step;
            let tau = sweep.torque(t);
            let chord = (sweep.torque(t + step) - tau) / step;
            for (signal, value) in signals.iter_mut().zip([t, tau, x[0]]) {
                signal.push(value);
            }
            for part in 0..parts {
                let at = |c: f64| tau + chord * h * (part as f64 + c);
                let k1 = slope(x, at(0.0));
                let k2 = slope(add(x, k1, h / 2.0), at(0.5));
                let k3 = slope(add(x, k2, h / 2.0), at(0.5));
                let k4 = slope(add(x, k3, h), at(1.0));
                x = [0, 1, 2].map(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
            }
        }
        signals
    }

    #[test]
    fn a_downward_sweep_finds_the_same_antiresonance_and_a_resonance_shifted_downwards() {
        let grid = logarithmic_grid(BAND, 2000);
        let (f_dip, f_res) = (2.3431981, 2.4566022);
        for law in [Law::Exponential, Law::Linear] {
            let sweep = Sweep { f0: 3.5, f1: 1.25, law, ..Sweep::THESIS };
            let [time, tau, omega] = swept(&Linear::bench_10_cm(0.0029757), &sweep);
            let [lock_in] =
                demodulation::frequency_responses(&sweep, &time, &tau, [&omega], &grid).responses;
            assert_eq!(lock_in.frequency.len(), grid.len());
            let spa = spa::frequency_response(0.02, &tau, &omega, &grid, spa::LAG);
            let (lock_in, spa) = (Features::find(&lock_in), Features::find(&spa));
            // the estimate from the whole record does not depend on the direction of the sweep, so that the limits of
            // the upward sweep hold
            assert!((spa.f_dip.unwrap() - f_dip).abs() < 3e-4, "{law:?}: {spa:?}");
            assert!((spa.f_res.unwrap() - f_res).abs() < 3e-4, "{law:?}: {spa:?}");
            // the sweep passed the resonance 125 s before the antiresonance, where its oscillation still has
            // exp(-0.0525 * 125) of its 2.2 (rad/s)/(N.m); near the antiresonance |H| grows by 1.5 per hertz, so that
            // the shift is 2 mHz
            assert!((lock_in.f_dip.unwrap() - f_dip).abs() < 3e-3, "{law:?}: {lock_in:?}");
            // the shift of the resonance is as large as in the upward sweep, in the opposite direction
            let shift = f_res - lock_in.f_res.unwrap();
            assert!((0.014..0.020).contains(&shift), "{law:?}: {lock_in:?}");
        }
    }

    #[test]
    fn both_estimators_find_the_antiresonance_and_an_upward_sweep_shifts_the_resonance_upwards() {
        let grid = logarithmic_grid(BAND, 2000);
        for (plant, f_dip, f_res) in [
            (Linear::bench_10_cm(0.0029757), 2.3431981, 2.4566022),
            (Linear::bench_5_cm(0.0035842), 2.1329468, 2.2306922),
        ] {
            for law in [Law::Exponential, Law::Linear] {
                let sweep = Sweep { law, ..Sweep::THESIS };
                let [time, tau, omega] = swept(&plant, &sweep);
                let [lock_in] =
                    demodulation::frequency_responses(&sweep, &time, &tau, [&omega], &grid)
                        .responses;
                let spa = spa::frequency_response(0.02, &tau, &omega, &grid, spa::LAG);
                let (lock_in, spa) = (Features::find(&lock_in), Features::find(&spa));
                // the required accuracy of the antiresonance is 2 mHz; both estimators are several times better
                assert!((lock_in.f_dip.unwrap() - f_dip).abs() < 3e-4, "{law:?}: {lock_in:?}");
                assert!((spa.f_dip.unwrap() - f_dip).abs() < 3e-4, "{law:?}: {spa:?}");
                // the estimate from the whole record does not depend on the sweep rate: the resonance is correct to a
                // fraction of the 5 mHz resolution
                assert!((spa.f_res.unwrap() - f_res).abs() < 3e-4, "{law:?}: {spa:?}");
                // in the lock-in estimate the resonance appears late by about its half-power width, 14 and 15 mHz
                let shift = lock_in.f_res.unwrap() - f_res;
                assert!((0.014..0.020).contains(&shift), "{law:?}: {lock_in:?}");
            }
        }
    }
}
