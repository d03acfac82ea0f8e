//! Viscous friction, tau_f = -b w, and a bearing without friction (b = 0).
//!
//! Choose these laws for an air bearing or a magnetic bearing, or for a comparison with linear theory. With the slosh model
//! `linear` everything in the plant is then linear, except the wheel.

use super::FrictionLaw;
use crate::contact::Contact;
use crate::hub::HubMotion;
use crate::parameters::Friction;

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
