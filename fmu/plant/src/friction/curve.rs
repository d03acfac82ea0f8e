//! Stribeck's curve, the magnitude of dry friction at a rate (thesis eq. 5.1):
//!
//! ```text
//! T_C(w) = c + d exp(-(w/w_s)^2)
//! ```

use taylor::series::{self, Series, ZERO};

use crate::parameters::Friction;

/// Ratio of the hub's rate to the Stribeck speed up to which the excess over Coulomb friction is above 1e-4 of its value at
/// rest. Up to this rate the terms of its power series are visible at every usual tolerance.
const VISIBLE: f64 = 3.0;

/// Ratio of the hub's rate to the Stribeck speed above which the excess over Coulomb friction is below 1e-12 of its value at
/// rest, so that it counts as 0.
const FLAT: f64 = 5.3;

#[derive(Clone, Debug)]
pub struct StribeckCurve {
    c: f64,
    d: f64,
    inv_omega_s2: f64,
    u_d: Series,
    e: Series,
    pub torque: Series,
}

impl StribeckCurve {
    pub fn new(p: &Friction) -> StribeckCurve {
        let inv_omega_s2 = 1.0 / (p.omega_s * p.omega_s);
        StribeckCurve { c: p.c, d: p.d, inv_omega_s2, u_d: ZERO, e: ZERO, torque: ZERO }
    }

    /// Estimates the time, s, over which the power series of the dry friction torque converges reliably. `omega` is the
    /// series of the hub's rate.
    ///
    /// Let v be the hub's rate divided by the Stribeck speed. At a high rate the excess over Coulomb friction, exp(-v^2), is
    /// below any tolerance, but the terms of its series grow before they decay: if v changes by dv, the term of order n is
    /// (2 v dv)^n/n!, which is largest at n = 2 v dv. The limit is chosen so that either the curve is still flat at the end,
    /// or the terms decay from order 5 on.
    pub fn convergence_radius(&self, omega: &Series) -> f64 {
        let [v, v1, v2] =
            [omega[0], omega[1], omega[2]].map(|w| w.abs() * libm::sqrt(self.inv_omega_s2));
        if v < VISIBLE || self.d == 0.0 {
            return f64::INFINITY;
        }
        let dv = f64::max(v - FLAT, 2.5 / v);
        series::time_within(dv, v1, v2)
    }

    pub fn at_rest(&self) -> f64 {
        self.c + self.d
    }

    #[inline(always)]
    pub fn expand(&mut self, n: usize, omega2: &Series) {
        let u = -omega2[n] * self.inv_omega_s2;
        self.e[n] = if n == 0 { libm::exp(u) } else { series::chain(n, u, &mut self.u_d, &self.e) };
        self.torque[n] = series::constant(n, self.c) + self.d * self.e[n];
    }
}
