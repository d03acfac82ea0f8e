//! Damping that grows in proportion to the amplitude.
//!
//! ```text
//! zeta(A) = zeta + zeta_A A,   A^2 = |q|^2 + |q'|^2/W,   W = omega_n^2
//! ```
//!
//! q: slosh angle in both directions, rad. Waves of finite height lose more of themselves in a period than
//! the layer at the wall takes: the surface film stretches, the contact line runs, crests break up. No
//! formula gives zeta_A; it is measured, or fitted (`hubslosh identify`). The drag on the bob is
//! 2 zeta(A) m omega_n times its velocity, so that it never drives, and in a free oscillation
//! A' = -omega_n (zeta + zeta_A A) A:
//!
//! ```text
//! c_A = 2 m zeta_A u^(1/2),   u = W (|q|^2 + A_0^2) + |q'|^2
//! ```
//!
//! A_0, far below any motion of interest, keeps u away from 0, where the root has no power series.

use taylor::series::{Series, ZERO, mul_ramp};

/// A_0, rad.
const FLOOR: f64 = 1e-4;

/// W is kept from 0 by this part of 1/l times 1 m/s2: drag without restoring force is none.
const WEIGHTLESS: f64 = 1e-6;

/// Growth of one mode's drag with amplitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// zeta_A, 1/rad; 0: the drag does not depend on the amplitude.
    pub zeta: f64,
    /// Constant added to W, 1/s2.
    w_floor: f64,
    /// W and its rate.
    w: [f64; 2],
    /// |q|^2 + A_0^2, u, u^(1/2)
    q2: Series,
    u: Series,
    root: Series,
    /// Viscous drag over its value at the start of the expansion.
    pub viscous: Series,
    /// The share of the other drag, viscous or a baffle's, in the whole at the start; 2 m zeta_A over the whole.
    share: f64,
    gain: f64,
}

impl Default for Growth {
    fn default() -> Self {
        Growth {
            zeta: 0.0,
            w_floor: 0.0,
            w: [0.0; 2],
            q2: ZERO,
            u: ZERO,
            root: ZERO,
            viscous: ZERO,
            share: 0.0,
            gain: 0.0,
        }
    }
}

impl Growth {
    /// Growth for a mode of length `l`, m.
    pub fn new(zeta: f64, l: f64) -> Growth {
        Growth { zeta, w_floor: WEIGHTLESS / l, ..Growth::default() }
    }

    /// Starts an expansion with W along `w`, at [|q|^2, |q'|^2] and the other drag coefficient `c`, of which the
    /// viscous part runs along `viscous`; returns the coefficient of both.
    pub fn start(&mut self, w: [f64; 2], at: [f64; 2], m: f64, c: f64, viscous: Series) -> f64 {
        self.w = [w[0] + self.w_floor, w[1]];
        self.viscous = viscous;
        (self.share, self.gain) = (1.0, 0.0);
        self.expand(0, at, 1.0);
        let both = c + 2.0 * m * self.zeta * self.root[0];
        (self.share, self.gain) = (c / both, 2.0 * m * self.zeta / both);
        both
    }

    /// Coefficient n of the drag over its value at the start, from those of [|q|^2, |q'|^2] and of the other drag over
    /// its own.
    pub fn expand(&mut self, n: usize, [q2, v2]: [f64; 2], other: f64) -> f64 {
        self.q2[n] = q2 + if n == 0 { FLOOR * FLOOR } else { 0.0 };
        self.u[n] = mul_ramp(n, &self.w, &self.q2) + v2;
        // y^2 = u
        self.root[n] = if n == 0 {
            libm::sqrt(self.u[0])
        } else {
            let both: f64 = (1..n).map(|j| self.root[j] * self.root[n - j]).sum();
            (self.u[n] - both) / (2.0 * self.root[0])
        };
        self.share * other + self.gain * self.root[n]
    }
}
