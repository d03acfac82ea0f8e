//! Viscous friction, tau_f = -b w; without b a free bearing.
//!
//! When to choose it: an air or magnetic bearing, or a comparison with linear theory; the
//! plant with the linear slosh model is then linear in everything but the wheel.

use super::{Contact, FrictionLaw};
use crate::slosh::HubMotion;

#[derive(Clone, Debug)]
pub struct Viscous {
    pub b: f64,
}

impl FrictionLaw for Viscous {
    #[inline(always)]
    fn torque<const N: usize>(&mut self, _: Contact, hub: &HubMotion) -> f64 {
        -self.b * hub.omega[N]
    }
}
