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
