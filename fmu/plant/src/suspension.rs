//! The suspension line of the hub is a torsion spring with damping about the bearing axis:
//!
//! ```text
//! tau_s = -k (theta - theta_0) - c w,      energy k (theta - theta_0)^2/2,   dissipation c w^2
//! ```
//!
//! A stuck hub does not move, because the bearing also holds the torque of the spring.
//!
//! Source: Rubaga's thesis, section 8.4.4, mentions the line; modelling its torque as a linear torsion spring is our choice.

use taylor::number::Number;
use taylor::series::{constant, number};

use crate::hub::HubMotion;
use crate::parameters::Hub;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Suspension {
    k: f64,
    theta_0: f64,
    c: f64,
    pub exists: bool,
}

impl Suspension {
    pub fn new(hub: &Hub) -> Suspension {
        let Hub { k, theta_0, c, .. } = *hub;
        Suspension { k, theta_0, c, exists: k > 0.0 || c > 0.0 }
    }

    #[inline(always)]
    pub fn torque(&self, n: usize, hub: &HubMotion) -> f64 {
        -self.k * (hub.theta[n] - constant(n, self.theta_0)) - self.c * hub.omega[n]
    }

    #[inline(always)]
    pub fn dissipation(&self, n: usize, hub: &HubMotion) -> f64 {
        self.c * hub.omega2[n]
    }

    /// Returns the torque of the suspension line on the hub, N m, and the energy of its spring, J, at the start of a power
    /// series, or the directional derivatives of both.
    pub fn present<T: Number>(&self, hub: &HubMotion) -> [T; 2] {
        let [turned, w]: [T; 2] = [number(&hub.theta), number(&hub.omega)];
        let turned = turned - T::constant(self.theta_0);
        [-(turned * self.k + w * self.c), turned * self.k * turned * 0.5]
    }
}
