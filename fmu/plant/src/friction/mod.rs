//! The bearing's friction: one law a file, each with the power series of its parts.
//!
//! The directional factor B of dry friction is in `directional.rs`, Stribeck's curve in
//! `curve.rs`.

mod curve;
mod directional;
mod stribeck;
mod stribeck_smooth;
mod viscous;

use crate::Friction;
use crate::series::Series;
use crate::slosh::HubMotion;
use directional::DirectionalFactor;
use stribeck::Stribeck;
use stribeck_smooth::StribeckSmooth;
use viscous::Viscous;

/// The laws of the bearing's friction; when to choose which is said in their files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum FrictionModel {
    /// A free bearing.
    None = 1,
    /// b omega.
    Viscous = 2,
    /// Stribeck curve with sgn(omega) smoothed to tanh(omega / eps).
    StribeckSmooth = 3,
    /// Stribeck curve as a set-valued law: the hub can stick.
    Stribeck = 4,
}

impl FrictionModel {
    /// All of them, in the order of their numbers.
    pub const ALL: [FrictionModel; 4] = [
        FrictionModel::None,
        FrictionModel::Viscous,
        FrictionModel::StribeckSmooth,
        FrictionModel::Stribeck,
    ];
}

/// The law in use; the plant has one, in a box with all other series.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)]
pub enum Law {
    Viscous(Viscous),
    StribeckSmooth(StribeckSmooth),
    Stribeck(Stribeck),
}

/// Does the same with whatever law is in use.
macro_rules! with_law {
    ($of:expr, $law:ident => $do:expr) => {
        match $of {
            Law::Viscous($law) => $do,
            Law::StribeckSmooth($law) => $do,
            Law::Stribeck($law) => $do,
        }
    };
}

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

/// A law of friction as a set of power series in time.
pub trait FrictionLaw {
    /// Whether the law switches where w = 0, so that this instant has to be located; if not,
    /// the contact is always [`Contact::Forward`].
    const SWITCHES_AT_REST: bool = false;

    /// How many negligible terms in succession show that the series has converged. One term
    /// may vanish by symmetry.
    const NEGLIGIBLE_TERMS: usize = 2;

    /// Coefficient N of tau_f while the hub is not stuck, from coefficients up to N of theta,
    /// w and w^2.
    fn torque<const N: usize>(&mut self, contact: Contact, hub: &HubMotion) -> f64;

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

    /// The contact of a hub with w = 0 on which the torque `net` acts besides friction; it
    /// had the contact `before`.
    fn contact_at_rest(&self, _net: f64, _theta: f64, _before: Contact) -> Contact {
        Contact::Forward
    }
}

impl Law {
    /// No friction.
    pub const NONE: Law = Law::Viscous(Viscous { b: 0.0 });

    /// The law that the parameters describe.
    pub fn new(p: &Friction) -> Law {
        match p.model {
            FrictionModel::None => Law::NONE,
            FrictionModel::Viscous => Law::Viscous(Viscous { b: p.b }),
            FrictionModel::StribeckSmooth => Law::StribeckSmooth(StribeckSmooth::new(p)),
            FrictionModel::Stribeck => Law::Stribeck(Stribeck::new(p)),
        }
    }

    /// What is wrong with the parameters together.
    pub fn problems(p: &Friction) -> Vec<String> {
        DirectionalFactor::problems(p)
    }

    /// See [`FrictionLaw::SWITCHES_AT_REST`].
    #[inline(always)]
    pub fn switches_at_rest(&self) -> bool {
        fn of<L: FrictionLaw>(_: &L) -> bool {
            L::SWITCHES_AT_REST
        }
        with_law!(self, law => of(law))
    }

    /// See [`FrictionLaw::NEGLIGIBLE_TERMS`].
    #[inline(always)]
    pub fn negligible_terms(&self) -> usize {
        fn of<L: FrictionLaw>(_: &L) -> usize {
            L::NEGLIGIBLE_TERMS
        }
        with_law!(self, law => of(law))
    }

    /// See [`FrictionLaw::torque`].
    #[inline(always)]
    pub fn torque<const N: usize>(&mut self, contact: Contact, hub: &HubMotion) -> f64 {
        with_law!(self, law => law.torque::<N>(contact, hub))
    }

    /// See [`FrictionLaw::convergence_radius`].
    #[inline(always)]
    pub fn convergence_radius(&self, omega: &Series) -> f64 {
        with_law!(self, law => law.convergence_radius(omega))
    }

    /// See [`FrictionLaw::holds`].
    pub fn holds(&self, theta: f64) -> (f64, f64) {
        with_law!(self, law => law.holds(theta))
    }

    /// See [`FrictionLaw::contact_at_rest`].
    pub fn contact_at_rest(&self, net: f64, theta: f64, before: Contact) -> Contact {
        with_law!(self, law => law.contact_at_rest(net, theta, before))
    }
}
