//! Stribeck's curve as a set-valued friction law (Rubaga's thesis, eq. 5.1 and 5.4):
//!
//! ```text
//! tau_f = -b w - sgn(w) T_C(w) B(theta)        w != 0
//! -(c + d) B+ <= tau_f <= (c + d) B-            w = 0
//! ```
//!
//! At rest the bearing holds any torque within these limits, and the hub sticks exactly.
//!
//! Choose this law for a bearing with dry friction if the hub may come to rest or reverse. Transitions between stick and
//! slip are located as events, which is exact and fast. A stuck hub does not move at all. For presliding motion use a
//! law with bristles (`lugre.rs`).

use taylor::series::{self, Series, ZERO};

use super::FrictionLaw;
use super::curve::StribeckCurve;
use super::directional::DirectionalFactor;
use crate::contact::Contact;
use crate::hub::HubMotion;
use crate::parameters::Friction;

#[derive(Clone, Debug)]
pub struct Stribeck {
    b: f64,
    curve: StribeckCurve,
    factor: DirectionalFactor,
    present: Series,
}

impl Stribeck {
    // This function does not depend on the slosh model, so that the compiled code contains one copy of it.
    #[inline(never)]
    fn dry_by_angle(&mut self, n: usize, contact: Contact, theta: &Series) -> f64 {
        self.factor.expand(n, theta);
        self.present[n] = contact as i8 as f64 * self.factor.coefficient(n, contact);
        series::mul(n, &self.curve.torque, &self.present)
    }
}

impl FrictionLaw for Stribeck {
    const SWITCHES_AT_REST: bool = true;
    const STICKS: bool = true;

    fn new(p: &Friction) -> Stribeck {
        let (curve, factor) = (StribeckCurve::new(p), DirectionalFactor::new(p));
        Stribeck { b: p.b, curve, factor, present: ZERO }
    }

    #[inline(always)]
    fn torque(&mut self, n: usize, contact: Contact, hub: &HubMotion) -> f64 {
        self.curve.expand(n, &hub.omega2);
        let dry = if self.factor.depends_on_angle() {
            self.dry_by_angle(n, contact, &hub.theta)
        } else {
            if n == 0 {
                self.present[0] = contact as i8 as f64 * self.factor.mean(contact);
            }
            self.present[0] * self.curve.torque[n]
        };
        -self.b * hub.omega[n] - dry
    }

    fn convergence_radius(&self, omega: &Series) -> f64 {
        self.curve.convergence_radius(omega)
    }

    fn holding_torques(&self, theta: f64) -> (f64, f64) {
        let ((backward, forward), dry) = (self.factor.coefficient_at(theta), self.curve.at_rest());
        (dry * backward, dry * forward)
    }

    fn contact_at_rest(&self, [net, _]: [f64; 2], theta: f64, before: Contact) -> Contact {
        let (against_backward, against_forward) = self.holding_torques(theta);
        // The torque on a hub at the instant of break-away equals the largest holding torque, except for rounding errors.
        let limit = |hold: f64, from: Contact| {
            if before == from { hold * (1.0 - 1e-12) } else { hold }
        };
        match net {
            net if net > limit(against_forward, Contact::Forward) => Contact::Forward,
            net if net < -limit(against_backward, Contact::Backward) => Contact::Backward,
            _ => Contact::Stuck,
        }
    }
}
