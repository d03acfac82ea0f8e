//! Damping of slosh modes that grows with the amplitude A of the wave:
//!
//! ```text
//! zeta(A) = zeta + zeta_A A + zeta_b b(sigma A),   A^2 = |q|^2 + |q'|^2/W,   W = omega_n^2
//! ```
//!
//! q is the slosh angle in both directions, rad (in the slosh model `liquid`, displacement divided by length). Waves of
//! finite height dissipate more energy per period than the laminar layer at the wall, because the surface film stretches
//! and the contact line moves. There is no formula for zeta_A; it must be measured or fitted (`hubslosh identify`). The
//! drag on the slosh mass is 2 zeta(A) m omega_n times its velocity, so that it always dissipates. In a free oscillation
//! A' = -omega_n zeta(A) A.
//!
//! Waves break above a steepness s_b. Steepness is k a, with the wave's amplitude a at the wall and the mode's wave
//! number k. Linear theory gives a = `wave` A, so k a = sigma A with sigma = k `wave`. In an upright cylinder k = xi_n/R
//! and `wave` = 2 R/(xi_n^2 - 1), hence sigma = 2 xi_n/(xi_n^2 - 1), 1.541 for mode 1. The function b is
//! max(0, k a - s_b) with its corner rounded over delta, and b(0) = 0:
//!
//! ```text
//! b(s) = [s - s_b + ((s - s_b)^2 + delta^2)^(1/2) - B]/2,   B = (s_b^2 + delta^2)^(1/2) - s_b
//! ```
//!
//! b grows with s, so it is never below 0. It differs from max(0, s - s_b) by at most delta/2.
//!
//! The drag is expanded in
//!
//! ```text
//! c_A = 2 m zeta_A u^(1/2),   u = W (|q|^2 + A_0^2) + |q'|^2
//! c_b = m zeta_b [y + (y^2 + delta^2 W)^(1/2) - B omega_n],   y = sigma u^(1/2) - s_b omega_n
//! ```
//!
//! A_0 is far below any motion of interest. It keeps u away from 0, where the root has no power series.

use taylor::series::{Series, ZERO, mul_ramp, sqrt, square, time_within, values};

const FLOOR: f64 = 1e-4;

/// Specific force, m/s2, that is added to g in the squared natural frequency W = g/l of a pendulum, because the power series
/// of the drag do not converge at W = 0, that is, in weightlessness.
const WEIGHTLESS: f64 = 1e-6;

const ROUNDED: f64 = 0.02;

/// Damping of one mode by breaking waves: the damping ratio `zeta` per steepness above the onset (0 if waves do not break),
/// the steepness `onset` at which waves begin to break, and the `steepness` of the wave per slosh angle, 1/rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breaking {
    pub zeta: f64,
    pub onset: f64,
    pub steepness: f64,
}

impl Breaking {
    const NONE: Breaking = Breaking { zeta: 0.0, onset: 0.0, steepness: 0.0 };
}

/// The drag on one mode as power series in time. Two of its three parts grow with the amplitude of the wave. The equations
/// are at the head of the file.
/// - `zeta`: increase of the damping ratio per slosh angle, zeta_A, 1/rad.
/// - `w`: squared natural frequency W, 1/s2, and its rate; `w_floor`, 1/s2, is added to it.
/// - `share`, `gain`, `gain_breaking`: the coefficients of the three parts of the drag: independent of the amplitude, in
///   proportion to it, and by breaking waves. Each is divided by the whole drag at the start of the series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    pub acts: bool,
    zeta: f64,
    breaking: Breaking,
    w_floor: f64,
    w: [f64; 2],
    q2: Series,
    u: Series,
    root: Series,
    omega: Series,
    excess: Series,
    rounded: Series,
    /// Viscous drag coefficient divided by its value at the start of the series.
    pub viscous: Series,
    share: f64,
    gain: f64,
    gain_breaking: f64,
}

impl Default for Growth {
    fn default() -> Self {
        Growth {
            acts: false,
            zeta: 0.0,
            breaking: Breaking::NONE,
            w_floor: 0.0,
            w: [0.0; 2],
            q2: ZERO,
            u: ZERO,
            root: ZERO,
            omega: ZERO,
            excess: ZERO,
            rounded: ZERO,
            viscous: ZERO,
            share: 0.0,
            gain: 0.0,
            gain_breaking: 0.0,
        }
    }
}

impl Growth {
    pub fn new(zeta: f64, breaking: Breaking, l: f64) -> Growth {
        let acts = zeta > 0.0 || breaking.zeta > 0.0;
        Growth { acts, zeta, breaking, w_floor: WEIGHTLESS / l, ..Growth::default() }
    }

    /// Starts the power series of the drag, and returns the whole drag coefficient at their start. `w` is the squared natural
    /// frequency W and its rate. `at` contains the squares of the slosh angle and of its rate. `m` is the slosh mass, kg. `c`
    /// is the drag coefficient that does not depend on the amplitude; its viscous part changes in time as the series
    /// `viscous`.
    pub fn start(&mut self, w: [f64; 2], at: [f64; 2], m: f64, c: f64, viscous: Series) -> f64 {
        self.w = [w[0] + self.w_floor, w[1]];
        self.viscous = viscous;
        (self.share, self.gain, self.gain_breaking) = (1.0, 0.0, 0.0);
        self.expand(0, at, 1.0);
        let mut both = c + 2.0 * m * self.zeta * self.root[0];
        if self.breaking.zeta > 0.0 {
            both += m * self.breaking.zeta * self.expand_breaking(0);
        }
        (self.share, self.gain) = (c / both, 2.0 * m * self.zeta / both);
        self.gain_breaking = m * self.breaking.zeta / both;
        both
    }

    /// Computes Taylor coefficient n of the drag, which is divided by its value at the start, from coefficient
    /// n of three other series: the squared slosh angle `q2`, its squared rate `v2`, and the drag `other` that does not
    /// depend on the amplitude.
    pub fn expand(&mut self, n: usize, [q2, v2]: [f64; 2], other: f64) -> f64 {
        self.q2[n] = q2 + if n == 0 { FLOOR * FLOOR } else { 0.0 };
        self.u[n] = mul_ramp(n, &self.w, &self.q2) + v2;
        self.root[n] = sqrt(n, self.u[n], &self.root);
        let drag = self.share * other + self.gain * self.root[n];
        if self.breaking.zeta > 0.0 {
            return drag + self.gain_breaking * self.expand_breaking(n);
        }
        drag
    }

    /// Estimates the time, s, over which the series of the drag converge, from their first three coefficients. The drag is
    /// singular where u = W (|q|^2 + A_0^2) + |q'|^2 is 0, with the squared natural frequency W, the slosh angle q and the
    /// small constant A_0. If waves break, it is also singular where W is 0, and close to the onset of breaking.
    pub fn convergence_radius(&self) -> f64 {
        let time_near = |distance: f64, x: &Series| time_within(distance, x[1].abs(), x[2].abs());
        let time = time_near(self.u[0], &self.u);
        if self.breaking.zeta == 0.0 {
            return time;
        }
        let [slope, bend] = [1, 2].map(|n| self.excess[n].abs() + ROUNDED * self.omega[n].abs());
        let corner = time_within(self.rounded[0], slope, bend);
        time.min(time_within(self.w[0], self.w[1].abs(), 0.0)).min(corner)
    }

    /// Returns the drag `h` seconds after the start of the series, divided by its value at the start, and the quantity u = W
    /// (|q|^2 + A_0^2) + |q'|^2, where W is the squared natural frequency, q the slosh angle, and A_0 a small constant. u is
    /// computed from its own series up to order n, and the drag from u and from `other`, the drag that does not depend on
    /// the amplitude. The difference between this drag and the series of the drag is therefore the error of the series.
    pub fn drag_at(&self, n: usize, h: f64, other: f64) -> [f64; 2] {
        let u = values([&self.u], n, h)[0].max(0.0);
        let root = libm::sqrt(u);
        let mut drag = self.share * other + self.gain * root;
        let Breaking { onset, steepness, zeta } = self.breaking;
        if zeta > 0.0 {
            let w = f64::max(self.w[0] + self.w[1] * h, 0.0);
            let omega = libm::sqrt(w);
            let excess = steepness * root - onset * omega;
            let rounded = libm::sqrt(excess * excess + ROUNDED * ROUNDED * w);
            let at_rest = libm::hypot(onset, ROUNDED) - onset;
            drag += self.gain_breaking * (excess + rounded - at_rest * omega);
        }
        [drag, u]
    }

    fn expand_breaking(&mut self, n: usize) -> f64 {
        let Breaking { onset, steepness, .. } = self.breaking;
        let w = if n < 2 { self.w[n] } else { 0.0 };
        self.omega[n] = sqrt(n, w, &self.omega);
        self.excess[n] = steepness * self.root[n] - onset * self.omega[n];
        let rounded2 = square(n, &self.excess) + ROUNDED * ROUNDED * w;
        self.rounded[n] = sqrt(n, rounded2, &self.rounded);
        let at_rest = libm::hypot(onset, ROUNDED) - onset;
        self.excess[n] + self.rounded[n] - at_rest * self.omega[n]
    }
}
