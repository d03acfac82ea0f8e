//! Viscous friction, tau_f = -b w, and none at all.
//!
//! When to choose them: an air or magnetic bearing, or a comparison with linear theory; the
//! plant with the linear slosh model is then linear in everything but the wheel.

use super::FrictionLaw;
use crate::contact::Contact;
use crate::hub::HubMotion;
use crate::parameters::Friction;

/// A free bearing.
#[derive(Clone, Debug)]
pub struct Free;

impl FrictionLaw for Free {
    fn new(_: &Friction) -> Free {
        Free
    }

    #[inline(always)]
    fn torque(&mut self, _: usize, _: Contact, _: &HubMotion) -> f64 {
        0.0
    }
}

#[derive(Clone, Debug)]
pub struct Viscous {
    b: f64,
}

impl FrictionLaw for Viscous {
    fn new(p: &Friction) -> Viscous {
        Viscous { b: p.b }
    }

    #[inline(always)]
    fn torque(&mut self, n: usize, _: Contact, hub: &HubMotion) -> f64 {
        -self.b * hub.omega[n]
    }
}
