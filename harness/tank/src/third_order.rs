//! Amplitude dependence of the frequency of an upright cylinder's first mode: potential
//! flow to third order, for the planar and for the circular (rotary) wave.
//!
//! Surface elevation eta and surface potential Phi are canonical variables (Zakharov 1968) with
//!
//! ```text
//! L = int Phi eta_t dS - H,   H = (1/2) int (Phi G Phi + g eta^2) dS
//! G_0 = D tanh(h D),  G_1 = D.(eta D) - G_0 eta G_0                       (Craig and Sulem 1993)
//! G_2 = -(1/2) (D^2 eta^2 G_0 + G_0 eta^2 D^2 - 2 G_0 eta G_0 eta G_0)
//! ```
//!
//! This holds unchanged for a vertical wall, because products of functions with zero slope at the
//! wall also have zero slope. With R = g = 1, psi = J1(k r) cos theta is the first mode, with k =
//! xi_1 and T = k tanh k h = omega^2. Its square excites the modes chi of the azimuthal numbers 0
//! and 2 (wave number kappa, t = kappa tanh kappa h) at frequencies 0 and 2 omega:
//!
//! ```text
//! planar     eta = a cos(wt) psi + sum (p_0 + p_2 cos 2wt) chi,  Phi = b sin(wt) psi + sum f sin(2wt) chi
//! circular   the same with theta - wt in place of theta: p at azimuthal number 0, f and q at 2
//! ```
//!
//! L averaged over a period is stationary in p_0, p_2, q and f. The remaining L = L_2 a^2 + L_4 a^4
//! is stationary in a, which is the nonlinear dispersion relation (Whitham 1974). The integrals are
//! C = int chi psi^2, N = int chi^2 and by grad psi.grad psi = k^2 psi^2 + (1/2) Lap psi^2
//!
//! ```text
//! int chi |grad psi|^2 = (k^2 - kappa^2/2) C,   int psi grad psi.grad chi = (kappa^2/2) C
//! int psi^2 G_0 psi^2 = sum t C^2/N
//! ```
//!
//! The equivalent mass on a surface, with q/l the slosh angle (wave 2 R/(xi^2 - 1) per angle),
//!
//! ```text
//! L = (1/2) m (q'^2 + s (q.q')^2/l^2) - (1/2) m omega^2 (q^2 + kappa q^4/(4 l^2))
//! ```
//!
//! has the shifts (3/8) kappa - s/2 (planar) and kappa/2 (circular) of omega^2 per squared angle;
//! they determine s and kappa. A pendulum is s = kappa = 1: -1/8 and +1/2.

use nalgebra::{Matrix2, Vector2};

use crate::closed_form::zeros_of_j1_slope;
use crate::gauss::Gauss;

/// A mode that the square of the first mode excites.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excited {
    /// Azimuthal number, 0 or 2.
    pub azimuth: i32,
    /// Zero of J'_azimuth, the wave number times R.
    pub xi: f64,
    /// c^2/(n n_1) with c = int J1(k r)^2 J r dr, n = int J^2 r dr, n_1 = int J1^2 r dr.
    pub overlap: f64,
}

/// The first mode and the modes that its square excites: pure numbers, equal at every depth.
#[derive(Clone, Debug, PartialEq)]
pub struct Overlaps {
    /// xi_1
    pub xi: f64,
    /// int J1^4 r dr/int J1^2 r dr
    pub fourth: f64,
    /// (2/((xi^2 - 1) J1(xi)))^2: squared amplitude a per squared slosh angle.
    pub amplitude2: f64,
    /// The excited modes.
    pub excited: Vec<Excited>,
}

impl Overlaps {
    /// Computes the overlaps with `count` modes of each azimuthal number.
    pub fn new(count: usize) -> Overlaps {
        let xi = zeros_of_j1_slope(1)[0];
        // The integrands have 2 count half waves: 4 points for each, plus a margin.
        let rule = Gauss::new(8 * count + 40);
        let integral = |f: &dyn Fn(f64) -> f64| -> f64 {
            rule.nodes.iter().zip(&rule.weights).map(|(r, w)| w * r * f(*r)).sum()
        };
        let square = |r: f64| libm::j1(xi * r).powi(2);
        let first = integral(&square);
        let mut excited = Vec::new();
        for azimuth in [0, 2] {
            for zero in zeros_of_slope(azimuth, count) {
                let other = |r: f64| libm::jn(azimuth, zero * r);
                let c = integral(&|r| square(r) * other(r));
                let n = integral(&|r| other(r).powi(2));
                excited.push(Excited { azimuth, xi: zero, overlap: c * c / (n * first) });
            }
        }
        let fourth = integral(&|r| square(r).powi(2)) / first;
        let amplitude2 = (2.0 / ((xi * xi - 1.0) * libm::j1(xi))).powi(2);
        Overlaps { xi, fourth, amplitude2, excited }
    }

    /// Returns the relative shifts of omega^2 per squared slosh angle, planar and circular, at
    /// h/R = `fill`.
    pub fn shifts(&self, fill: f64) -> [f64; 2] {
        let t_1 = self.xi * (self.xi * fill).tanh();
        let (omega, k2) = (t_1.sqrt(), self.xi * self.xi);
        // The potential's amplitude to first order, a = 1: eta_t = G_0 Phi.
        let [planar_b, circular_b] = [-omega / t_1, omega / t_1];
        // L_4 of both motions, over N of the first mode; first the terms of fourth order.
        let mut planar = planar_b * planar_b / 16.0 * k2 * t_1 * 0.75 * self.fourth;
        let mut circular = circular_b * circular_b / 8.0 * k2 * t_1 * self.fourth;
        for Excited { azimuth, xi, overlap } in &self.excited {
            let t = xi * (xi * fill).tanh();
            // int chi (|grad psi|^2 - (G_0 psi)^2) and int psi (grad psi.grad chi - G_0 psi G_0 chi)
            // over C
            let elevated = k2 - xi * xi / 2.0 - t_1 * t_1;
            let carried = xi * xi / 2.0 - t_1 * t;
            // C^2/N over N of the first mode: half of cos^2 theta at azimuth 0, a quarter at 2.
            let weight = overlap * if *azimuth == 0 { 0.5 } else { 0.25 };
            let b = planar_b;
            planar += weight
                * (stationary(
                    Matrix2::new(-0.5, -omega, -omega, -0.5 * t),
                    Vector2::new(b * b * elevated / 8.0, -b * carried / 4.0),
                ) + (b * b * elevated / 4.0).powi(2) / 2.0
                    - b * b / 16.0 * t_1 * t_1 * t);
            let b = circular_b;
            circular += *overlap
                * if *azimuth == 0 {
                    (b * b * elevated / 4.0).powi(2)
                } else {
                    stationary(
                        Matrix2::new(-1.0, 2.0 * omega, 2.0 * omega, -t),
                        Vector2::new(b * b * elevated / 4.0, -b * carried / 2.0),
                    ) - b * b / 8.0 * t_1 * t_1 * t
                };
        }
        // a (omega^2/T - 1)/2 + 4 L_4 a^3 = 0, and twice that of the circular motion.
        [-8.0 * planar * self.amplitude2, -4.0 * circular * self.amplitude2]
    }

    /// Returns s and kappa of the equivalent mass at h/R = `fill`.
    pub fn equivalent(&self, fill: f64) -> [f64; 2] {
        let [planar, circular] = self.shifts(fill);
        let kappa = 2.0 * circular;
        [0.75 * kappa - 2.0 * planar, kappa]
    }

    /// Returns the depths h/R at which an excited mode has twice the frequency of the first, in
    /// ascending order.
    pub fn resonant_depths(&self) -> Vec<f64> {
        self.resonances().iter().map(|(depth, ..)| *depth).collect()
    }

    /// Returns the depths h/R at which an excited mode has twice the frequency of the first, with
    /// the mode's azimuthal number and its own number, from 1. Near these depths the third order is
    /// not valid.
    pub fn resonances(&self) -> Vec<(f64, i32, usize)> {
        let mut found = Vec::new();
        for (place, mode) in self.excited.iter().enumerate() {
            let before = self.excited[..place].iter().filter(|e| e.azimuth == mode.azimuth).count();
            let detuning = |fill: f64| {
                4.0 * self.xi * (self.xi * fill).tanh() - mode.xi * (mode.xi * fill).tanh()
            };
            let grid: Vec<f64> = (1..400).map(|i| f64::from(i) * 0.01).collect();
            for pair in grid.windows(2) {
                let [mut low, mut high] = [pair[0], pair[1]];
                if detuning(low) * detuning(high) < 0.0 {
                    for _ in 0..60 {
                        let middle = 0.5 * (low + high);
                        let left = detuning(low) * detuning(middle) <= 0.0;
                        (low, high) = if left { (low, middle) } else { (middle, high) };
                    }
                    found.push((low, mode.azimuth, before + 1));
                }
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }
}

/// Returns the stationary value of x.M x/2 + v.x.
fn stationary(m: Matrix2<f64>, v: Vector2<f64>) -> f64 {
    let [a, b, c, d] = [m[(0, 0)], m[(0, 1)], m[(1, 0)], m[(1, 1)]];
    let inverse = Matrix2::new(d, -b, -c, a) / (a * d - b * c);
    -0.5 * v.dot(&(inverse * v))
}

/// Returns the first positive zeros of J'_m for m = 0 and 2, by bisection between those of an asymptotic grid.
fn zeros_of_slope(m: i32, count: usize) -> Vec<f64> {
    let slope = |x: f64| match m {
        0 => -libm::j1(x),
        _ => (libm::jn(m - 1, x) - libm::jn(m + 1, x)) / 2.0,
    };
    // Zeros are more than 3 apart and above 2.
    let mut zeros = Vec::new();
    let mut low: f64 = 2.0;
    while zeros.len() < count {
        let high = low + 0.5;
        if slope(low) * slope(high) < 0.0 {
            let (mut a, mut b) = (low, high);
            while b - a > 4.0 * f64::EPSILON * b {
                let middle = 0.5 * (a + b);
                (a, b) = if slope(a) * slope(middle) <= 0.0 { (a, middle) } else { (middle, b) };
            }
            zeros.push(0.5 * (a + b));
        }
        low = high;
    }
    zeros
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Abramowitz and Stegun, table 9.5, to more digits. The zero of J0' at 0 does not belong to a mode. Bisection ends
    /// within four times the last digit. The slope's own rounding, 1e-16 over its slope of 0.2 to 0.4, adds about
    /// 5e-16.
    #[test]
    fn zeros_of_the_excited_modes_are_those_of_the_tables() {
        for (m, known) in [
            (0, [3.831_705_970_207_512, 7.015_586_669_815_619, 10.173_468_135_062_722]),
            (2, [3.054_236_928_227_14, 6.706_133_194_158_459, 9.969_467_823_087_596]),
        ] {
            for (x, known) in zeros_of_slope(m, 3).iter().zip(known) {
                assert!((x - known).abs() < 1e-14, "{m}: {x} {known}");
            }
        }
    }
}
