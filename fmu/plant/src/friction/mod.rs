//! Friction of the bearing: one law per file, each with the power series of its terms.
//!
//! The directional factor B of dry friction is in `directional.rs`, Stribeck's curve in `curve.rs`.

mod curve;
mod directional;
mod lugre;
mod stribeck;
mod stribeck_smooth;
mod viscous;

use alloc::string::String;
use alloc::vec::Vec;
use taylor::series::{self, Series};

use crate::contact::Contact;
use crate::hub::HubMotion;
use crate::parameters::{Friction, FrictionModel};
use directional::DirectionalFactor;

/// A friction law of the bearing, whose quantities are power series in time. A law may have one continuous state of its own,
/// for example the deflection of bristles, and may use another formula for each direction of rotation.
pub trait FrictionLaw {
    /// True if the law changes its formula when the hub comes to rest, so that this instant must be located. If false, the
    /// contact is always [`Contact::Forward`].
    const SWITCHES_AT_REST: bool = false;

    const STICKS: bool = false;

    /// Number of successive negligible terms after which the integrator truncates a power series. A law needs more than the
    /// usual two if some of its terms vanish by symmetry.
    const NEGLIGIBLE_TERMS: usize = 2;

    fn new(p: &Friction) -> Self;

    fn problems(_p: &Friction) -> Vec<String> {
        Vec::new()
    }

    /// Sets Taylor coefficient n of the law's own state, for example the deflection of the bristles. Coefficient 0 is the
    /// value of the state; coefficient 1 is its change if a directional derivative is computed.
    fn set_state(&mut self, _n: usize, _z: f64) {}

    /// Returns Taylor coefficient n of the friction torque on a hub that is not stuck, N m. The coefficients of the hub's
    /// motion and of the law's own state must be known up to order n; coefficient n + 1 of the law's own state is set.
    fn torque(&mut self, n: usize, contact: Contact, hub: &HubMotion) -> f64;

    /// Returns Taylor coefficient n of the power that the bearing dissipates, W. `tau_f` is the series of the friction
    /// torque, whose coefficient n must be known, and `omega` the series of the hub's rate.
    #[inline(always)]
    fn dissipation(&self, n: usize, tau_f: &Series, omega: &Series) -> f64 {
        -series::mul(n, tau_f, omega)
    }

    /// Returns Taylor coefficient n (0 or 1) of the energy that is stored in the bearing, J.
    fn energy(&self, _n: usize) -> f64 {
        0.0
    }

    fn derivative(&self, _n: usize) -> f64 {
        0.0
    }

    /// Advances the law's own state `z`, for example the deflection of the bristles, by `t` seconds, from its series up to
    /// order n.
    fn advance(&self, _n: usize, _t: f64, _z: &mut f64) {}

    #[inline(always)]
    fn coefficient_norm(&self, _n: usize) -> f64 {
        0.0
    }

    /// Estimates the time, s, over which the series of the friction torque converges, from the hub's rate `omega` and its
    /// first two derivatives. The default is infinity. A law overrides it only if the coefficients of its series do not show
    /// this time to the integrator.
    fn convergence_radius(&self, _omega: &Series) -> f64 {
        f64::INFINITY
    }

    /// Returns the largest torques, N m, that the bearing holds at rest, at the hub angle `theta`: against a backward and
    /// against a forward torque. Both are positive or 0.
    fn holding_torques(&self, _theta: f64) -> (f64, f64) {
        (0.0, 0.0)
    }

    /// Returns the contact (stick or slip) of a hub at rest whose previous contact is `before`. `net` contains the torque on
    /// the hub without friction, N m, and, for laws that do not stick, the rate at which this torque changes while the hub
    /// is held; `theta` is the angle of the hub, rad.
    fn contact_at_rest(&self, _net: [f64; 2], _theta: f64, _before: Contact) -> Contact {
        Contact::Forward
    }
}

/// Defines an enumeration of all friction laws, which passes each call of a function of [`FrictionLaw`] to the law that the
/// plant uses. The compiler reports a missing law, because there must be one for every [`FrictionModel`].
macro_rules! laws {
    ($($name:ident => $law:ty;)*) => {
        #[derive(Clone, Debug)]
        #[allow(clippy::large_enum_variant)]
        pub enum Law {
            $($name($law),)*
        }

        impl Law {
            pub fn new(p: &Friction) -> Law {
                match p.model {
                    $(FrictionModel::$name => Law::$name(<$law>::new(p)),)*
                }
            }

            pub fn problems(p: &Friction) -> Vec<String> {
                let mut problems = DirectionalFactor::problems(p);
                problems.extend(match p.model {
                    $(FrictionModel::$name => <$law>::problems(p),)*
                });
                problems
            }

            #[inline(always)]
            pub fn switches_at_rest(&self) -> bool {
                match self {
                    $(Law::$name(_) => <$law>::SWITCHES_AT_REST,)*
                }
            }

            pub fn sticks(&self) -> bool {
                match self {
                    $(Law::$name(_) => <$law>::STICKS,)*
                }
            }

            #[inline(always)]
            pub fn negligible_terms(&self) -> usize {
                match self {
                    $(Law::$name(_) => <$law>::NEGLIGIBLE_TERMS,)*
                }
            }

            #[inline(always)]
            pub fn set_state(&mut self, n: usize, z: f64) {
                match self {
                    $(Law::$name(law) => law.set_state(n, z),)*
                }
            }

            #[inline(always)]
            pub fn torque(&mut self, n: usize, contact: Contact, hub: &HubMotion) -> f64 {
                match self {
                    $(Law::$name(law) => law.torque(n, contact, hub),)*
                }
            }

            #[inline(always)]
            pub fn dissipation(&self, n: usize, tau_f: &Series, omega: &Series) -> f64 {
                match self {
                    $(Law::$name(law) => law.dissipation(n, tau_f, omega),)*
                }
            }

            pub fn energy(&self, n: usize) -> f64 {
                match self {
                    $(Law::$name(law) => law.energy(n),)*
                }
            }

            pub fn derivative(&self, n: usize) -> f64 {
                match self {
                    $(Law::$name(law) => law.derivative(n),)*
                }
            }

            #[inline(always)]
            pub fn advance(&self, n: usize, t: f64, z: &mut f64) {
                match self {
                    $(Law::$name(law) => law.advance(n, t, z),)*
                }
            }

            #[inline(always)]
            pub fn coefficient_norm(&self, n: usize) -> f64 {
                match self {
                    $(Law::$name(law) => law.coefficient_norm(n),)*
                }
            }

            #[inline(always)]
            pub fn convergence_radius(&self, omega: &Series) -> f64 {
                match self {
                    $(Law::$name(law) => law.convergence_radius(omega),)*
                }
            }

            pub fn holding_torques(&self, theta: f64) -> (f64, f64) {
                match self {
                    $(Law::$name(law) => law.holding_torques(theta),)*
                }
            }

            pub fn contact_at_rest(&self, net: [f64; 2], theta: f64, before: Contact) -> Contact {
                match self {
                    $(Law::$name(law) => law.contact_at_rest(net, theta, before),)*
                }
            }
        }
    };
}

laws! {
    None => viscous::Free;
    Viscous => viscous::Viscous;
    StribeckSmooth => stribeck_smooth::StribeckSmooth;
    Stribeck => stribeck::Stribeck;
    Lugre => lugre::Lugre;
}
