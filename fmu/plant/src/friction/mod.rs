//! The bearing's friction: one law a file, each with the power series of its parts.
//!
//! The directional factor B of dry friction is in `directional.rs`, Stribeck's curve in
//! `curve.rs`.

mod curve;
mod directional;
mod lugre;
mod stribeck;
mod stribeck_smooth;
mod viscous;

use crate::Friction;
use crate::series::{self, Series};
use crate::slosh::HubMotion;
use crate::state::STATES;
use directional::DirectionalFactor;

/// How the hub stands to the bearing under a law that switches at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i8)]
pub enum Contact {
    /// Turning backwards, w < 0.
    Backward = -1,
    /// At rest, held by dry friction.
    Stuck = 0,
    /// Turning forwards, w > 0.
    Forward = 1,
}

/// A law of friction as a set of power series in time. It may have states of its own among the
/// plant's; w = 0 may be a place where it switches.
pub trait FrictionLaw {
    /// Whether the law switches where w = 0, so that this instant has to be located; if not,
    /// the contact is always [`Contact::Forward`].
    const SWITCHES_AT_REST: bool = false;

    /// Whether it can hold the hub exactly at rest.
    const STICKS: bool = false;

    /// How many negligible terms in succession show that the series has converged. One term
    /// may vanish by symmetry.
    const NEGLIGIBLE_TERMS: usize = 2;

    /// The law that the parameters describe.
    fn new(p: &Friction) -> Self;

    /// What is wrong with the law's parameters together.
    fn problems(_p: &Friction) -> Vec<String> {
        Vec::new()
    }

    /// Sets coefficient n of the law's states: 0 the states, 1 their direction for a partial
    /// derivative.
    fn set_states(&mut self, _n: usize, _x: &[f64; STATES]) {}

    /// Coefficient n of tau_f while the hub is not stuck, from coefficients up to n of theta,
    /// w, w^2 and the law's states; and coefficient n + 1 of the latter.
    fn torque(&mut self, n: usize, contact: Contact, hub: &HubMotion) -> f64;

    /// Coefficient n of the power that the bearing dissipates, W, after `torque`.
    #[inline(always)]
    fn dissipation(&self, n: usize, tau_f: &Series, omega: &Series) -> f64 {
        -series::mul(n, tau_f, omega)
    }

    /// Coefficient n, 0 or 1, of the energy stored in the bearing, J.
    fn energy(&self, _n: usize) -> f64 {
        0.0
    }

    /// Coefficient n, 0 or 1, of the derivatives of the law's states.
    fn derivatives(&self, _n: usize, _contact: Contact, _derivatives: &mut [f64; STATES]) {}

    /// Moves the law's states on by `t`, from the series cut after order n.
    fn advance(&self, _contact: Contact, _n: usize, _t: f64, _x: &mut [f64; STATES]) {}

    /// Size of coefficient n of the law's states; the scale of its errors is 1.
    #[inline(always)]
    fn coefficient_norm(&self, _n: usize) -> f64 {
        0.0
    }

    /// How far ahead the series of tau_f can converge, s, from w, w' and w'', where its
    /// coefficients do not tell.
    fn convergence_radius(&self, _omega: &Series) -> f64 {
        f64::INFINITY
    }

    /// The largest torques that the bearing holds at rest against a push backwards and
    /// forwards, N m (both >= 0).
    fn holds(&self, _theta: f64) -> (f64, f64) {
        (0.0, 0.0)
    }

    /// The contact of a hub with w = 0 that had the contact `before`; `net` is the torque
    /// besides friction and, unless the law sticks, its rate, with the hub held.
    fn contact_at_rest(&self, _net: [f64; 2], _theta: f64, _before: Contact) -> Contact {
        Contact::Forward
    }
}

/// The one list of all laws: number, type, what it is.
macro_rules! laws {
    ($($(#[$doc:meta])* $name:ident = $number:literal, $law:ty;)*) => {
        /// The laws of the bearing's friction; when to choose which is said in their files.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum FrictionModel {
            $($(#[$doc])* $name = $number,)*
        }

        impl FrictionModel {
            /// All of them, in the order of their numbers.
            pub const ALL: [FrictionModel; [$($number),*].len()] = [$(FrictionModel::$name,)*];
        }

        /// The law in use; the plant has one, in a box with all other series.
        #[derive(Clone, Debug)]
        #[allow(clippy::large_enum_variant)]
        pub enum Law {
            $($name($law),)*
        }

        impl Law {
            /// The law that the parameters describe.
            pub fn new(p: &Friction) -> Law {
                match p.model {
                    $(FrictionModel::$name => Law::$name(<$law>::new(p)),)*
                }
            }

            /// What is wrong with the parameters together.
            pub fn problems(p: &Friction) -> Vec<String> {
                let mut problems = DirectionalFactor::problems(p);
                problems.extend(match p.model {
                    $(FrictionModel::$name => <$law>::problems(p),)*
                });
                problems
            }

            /// See [`FrictionLaw::SWITCHES_AT_REST`].
            #[inline(always)]
            pub fn switches_at_rest(&self) -> bool {
                match self {
                    $(Law::$name(_) => <$law>::SWITCHES_AT_REST,)*
                }
            }

            /// See [`FrictionLaw::STICKS`].
            pub fn sticks(&self) -> bool {
                match self {
                    $(Law::$name(_) => <$law>::STICKS,)*
                }
            }

            /// See [`FrictionLaw::NEGLIGIBLE_TERMS`].
            #[inline(always)]
            pub fn negligible_terms(&self) -> usize {
                match self {
                    $(Law::$name(_) => <$law>::NEGLIGIBLE_TERMS,)*
                }
            }

            /// See [`FrictionLaw::set_states`].
            #[inline(always)]
            pub fn set_states(&mut self, n: usize, x: &[f64; STATES]) {
                match self {
                    $(Law::$name(law) => law.set_states(n, x),)*
                }
            }

            /// See [`FrictionLaw::torque`].
            #[inline(always)]
            pub fn torque(&mut self, n: usize, contact: Contact, hub: &HubMotion) -> f64 {
                match self {
                    $(Law::$name(law) => law.torque(n, contact, hub),)*
                }
            }

            /// See [`FrictionLaw::dissipation`].
            #[inline(always)]
            pub fn dissipation(&self, n: usize, tau_f: &Series, omega: &Series) -> f64 {
                match self {
                    $(Law::$name(law) => law.dissipation(n, tau_f, omega),)*
                }
            }

            /// See [`FrictionLaw::energy`].
            pub fn energy(&self, n: usize) -> f64 {
                match self {
                    $(Law::$name(law) => law.energy(n),)*
                }
            }

            /// See [`FrictionLaw::derivatives`].
            pub fn derivatives(
                &self,
                n: usize,
                contact: Contact,
                derivatives: &mut [f64; STATES],
            ) {
                match self {
                    $(Law::$name(law) => law.derivatives(n, contact, derivatives),)*
                }
            }

            /// See [`FrictionLaw::advance`].
            #[inline(always)]
            pub fn advance(&self, contact: Contact, n: usize, t: f64, x: &mut [f64; STATES]) {
                match self {
                    $(Law::$name(law) => law.advance(contact, n, t, x),)*
                }
            }

            /// See [`FrictionLaw::coefficient_norm`].
            #[inline(always)]
            pub fn coefficient_norm(&self, n: usize) -> f64 {
                match self {
                    $(Law::$name(law) => law.coefficient_norm(n),)*
                }
            }

            /// See [`FrictionLaw::convergence_radius`].
            #[inline(always)]
            pub fn convergence_radius(&self, omega: &Series) -> f64 {
                match self {
                    $(Law::$name(law) => law.convergence_radius(omega),)*
                }
            }

            /// See [`FrictionLaw::holds`].
            pub fn holds(&self, theta: f64) -> (f64, f64) {
                match self {
                    $(Law::$name(law) => law.holds(theta),)*
                }
            }

            /// See [`FrictionLaw::contact_at_rest`].
            pub fn contact_at_rest(&self, net: [f64; 2], theta: f64, before: Contact) -> Contact {
                match self {
                    $(Law::$name(law) => law.contact_at_rest(net, theta, before),)*
                }
            }
        }
    };
}

laws! {
    /// A free bearing.
    None = 1, viscous::Free;
    /// b omega.
    Viscous = 2, viscous::Viscous;
    /// Stribeck curve with sgn(omega) smoothed to tanh(omega / eps).
    StribeckSmooth = 3, stribeck_smooth::StribeckSmooth;
    /// Stribeck curve as a set-valued law: the hub can stick.
    Stribeck = 4, stribeck::Stribeck;
    /// Bristles that deflect before they slide (LuGre).
    Lugre = 5, lugre::Lugre;
}

impl Law {
    /// No friction.
    pub const NONE: Law = Law::None(viscous::Free);
}
