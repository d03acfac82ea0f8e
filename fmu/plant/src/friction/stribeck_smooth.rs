//! Stribeck's curve, in which T = tanh(w/eps) replaces sgn(w), so that it has no jump at rest:
//!
//! ```text
//! tau_f = -b w - T_C(w) T [(B+ + B-)/2 + T (B+ - B-)/2]
//! ```
//!
//! This combination of the factors B+ and B- of both directions never drives the hub.
//!
//! Choose this law only to reproduce results of models with a smoothed sign function. The hub creeps where it should be at
//! rest, and each reversal within eps takes steps of about eps/|w'| seconds. This law needs far more steps than the
//! set-valued law `stribeck`, which it approximates.

use taylor::series::{self, Series, ZERO};

use super::FrictionLaw;
use super::curve::StribeckCurve;
use super::directional::DirectionalFactor;
use crate::contact::Contact;
use crate::hub::HubMotion;
use crate::parameters::Friction;

#[derive(Clone, Debug)]
pub struct StribeckSmooth {
    b: f64,
    eps: f64,
    curve: StribeckCurve,
    factor: DirectionalFactor,
    v_d: Series,
    t: Series,
    sech2: Series,
    even: Series,
    odd: Series,
    blend: Series,
    sign: Series,
}

impl FrictionLaw for StribeckSmooth {
    /// Four terms instead of two, because three successive terms of tanh(w/eps) vanish by symmetry if the hub starts with a
    /// rate and an acceleration of 0.
    const NEGLIGIBLE_TERMS: usize = 4;

    fn new(p: &Friction) -> StribeckSmooth {
        StribeckSmooth {
            b: p.b,
            eps: p.eps,
            curve: StribeckCurve::new(p),
            factor: DirectionalFactor::new(p),
            v_d: ZERO,
            t: ZERO,
            sech2: ZERO,
            even: ZERO,
            odd: ZERO,
            blend: ZERO,
            sign: ZERO,
        }
    }

    // This function does not depend on the slosh model, so that the compiled code contains one copy of it.
    #[inline(never)]
    fn torque(&mut self, n: usize, _: Contact, hub: &HubMotion) -> f64 {
        self.curve.expand(n, &hub.omega2);
        self.t[n] = if n == 0 {
            libm::tanh(hub.omega[0] / self.eps)
        } else {
            series::chain(n, hub.omega[n] / self.eps, &mut self.v_d, &self.sech2)
        };
        let t2 = series::square(n, &self.t);
        self.sech2[n] = if n == 0 { 1.0 - t2 } else { -t2 };
        self.factor.expand(n, &hub.theta);
        (self.even[n], self.odd[n]) = self.factor.even_odd(n);
        self.blend[n] = self.even[n] + series::mul(n, &self.t, &self.odd);
        self.sign[n] = series::mul(n, &self.t, &self.blend);
        -self.b * hub.omega[n] - series::mul(n, &self.curve.torque, &self.sign)
    }

    /// Estimates the time, s, over which the series of the friction torque converges reliably. `omega` is the series of the
    /// hub's rate.
    ///
    /// The function tanh(v), where v is the rate divided by eps, has its nearest poles at the distance sqrt(v^2 + (pi/2)^2).
    /// Half of this distance is used, because away from 0 tanh is so flat that its coefficients do not show the poles.
    /// Stribeck's curve has a limit of its own.
    fn convergence_radius(&self, omega: &Series) -> f64 {
        let [v, v1, v2] = [omega[0], omega[1], omega[2]].map(|x| (x / self.eps).abs());
        let half = libm::sqrt(v * v + 2.4674) / 2.0;
        series::time_within(half, v1, v2).min(self.curve.convergence_radius(omega))
    }
}
