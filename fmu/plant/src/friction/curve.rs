//! Stribeck's curve, the size of dry friction at a rate (thesis eq. 5.1):
//!
//! ```text
//! T_C(w) = c + d exp(-(w/w_s)^2)
//! ```

use taylor::series::{self, Series, ZERO};

use crate::parameters::Friction;

#[derive(Clone, Debug)]
pub struct StribeckCurve {
    c: f64,
    d: f64,
    /// 1/w_s^2
    inv_omega_s2: f64,
    /// u' with u = -(w/w_s)^2, and e = exp u
    u_d: Series,
    e: Series,
    /// T_C(w)
    pub torque: Series,
}

impl StribeckCurve {
    pub fn new(p: &Friction) -> StribeckCurve {
        let inv_omega_s2 = 1.0 / (p.omega_s * p.omega_s);
        StribeckCurve { c: p.c, d: p.d, inv_omega_s2, u_d: ZERO, e: ZERO, torque: ZERO }
    }

    /// T_C(0), N m.
    pub fn at_rest(&self) -> f64 {
        self.c + self.d
    }

    /// Coefficient n of T_C from that of w^2.
    #[inline(always)]
    pub fn expand(&mut self, n: usize, omega2: &Series) {
        let u = -omega2[n] * self.inv_omega_s2;
        self.e[n] = if n == 0 { libm::exp(u) } else { series::chain(n, u, &mut self.u_d, &self.e) };
        self.torque[n] = series::constant(n, self.c) + self.d * self.e[n];
    }
}
