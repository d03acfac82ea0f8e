//! Damping that grows in proportion to the amplitude.
//!
//! ```text
//! zeta(A) = zeta + zeta_A A,   A^2 = |q|^2 + |q'|^2/W,   W = omega_n^2
//! ```
//!
//! q is the slosh angle in both directions, rad. Waves of finite height dissipate more energy per period
//! than the laminar layer at the wall: the surface film stretches, the contact line moves, crests break up.
//! There is no formula for zeta_A; it must be measured or fitted (`hubslosh identify`). The drag on the bob is 2
//! zeta(A) m omega_n times its velocity, so that it always dissipates. In a free oscillation A' = -omega_n (zeta +
//! zeta_A A) A:
//!
//! ```text
//! c_A = 2 m zeta_A u^(1/2),   u = W (|q|^2 + A_0^2) + |q'|^2
//! ```
//!
//! A_0, far below any motion of interest, keeps u away from 0, where the root has no power series.

use taylor::series::{Series, ZERO, mul_ramp};

/// A_0, rad.
const FLOOR: f64 = 1e-4;

/// Lower bound of W, as a part of 1/l times 1 m/s2: without restoring force there is no drag.
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
    /// Viscous drag relative to its value at the start of the expansion.
    pub viscous: Series,
    /// Share of the other drag, viscous or a baffle's, in the whole at the start; 2 m zeta_A over the whole.
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
    /// Creates the growth for a mode of length `l`, m.
    pub fn new(zeta: f64, l: f64) -> Growth {
        Growth { zeta, w_floor: WEIGHTLESS / l, ..Growth::default() }
    }

    /// Starts an expansion with W along `w`, at [|q|^2, |q'|^2], with the other drag coefficient `c`, whose viscous
    /// part runs along `viscous`. Returns the coefficient of both.
    pub fn start(&mut self, w: [f64; 2], at: [f64; 2], m: f64, c: f64, viscous: Series) -> f64 {
        self.w = [w[0] + self.w_floor, w[1]];
        self.viscous = viscous;
        (self.share, self.gain) = (1.0, 0.0);
        self.expand(0, at, 1.0);
        let both = c + 2.0 * m * self.zeta * self.root[0];
        (self.share, self.gain) = (c / both, 2.0 * m * self.zeta / both);
        both
    }

    /// Returns coefficient n of the drag relative to its value at the start, from those of [|q|^2, |q'|^2] and of the
    /// relative other drag.
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
