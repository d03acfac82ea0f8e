//! The liquid's mechanical models: what a slosh mode must tell the hub and the
//! integrator, and the models that do. All models are listed here, each is in a file of
//! its own.
//!
//! A mode's coordinates are `q = [q_x, q_y, q_x', q_y']`, x radial (outwards), y
//! tangential (towards +theta), measured in the hub's frame; each model says in
//! its own file what q is. All modes act on the hub through
//!
//! ```text
//! J w' = tau + tau_f + T,      q'' = B + A w'
//! ```
//!
//! where J, T, B and A do not contain w' (w the hub's rate).

mod linear;
mod paraboloid;
mod planar;
mod spherical;

use alloc::string::String;
use alloc::vec::Vec;

use taylor::number::Number;

use crate::hub::HubMotion;
use crate::parameters::{Init, Parameters, SloshModel};
use crate::pendulum::Pendulum;
use crate::tank::Calculated;
use linear::Linear;
use paraboloid::Paraboloid;
use planar::Planar;
use spherical::Spherical;

/// The slosh modes in use, as the chosen model has them.
#[derive(Clone, Debug)]
pub(crate) enum Liquid {
    Linear(Vec<Linear>),
    Planar(Vec<Planar>),
    Spherical(Vec<Spherical>),
    Paraboloid(Vec<Paraboloid>),
}

/// Does the same with the modes of whatever model is in use.
macro_rules! with_modes {
    ($liquid:expr, $modes:ident => $do:expr) => {{
        use $crate::slosh::Liquid;
        match $liquid {
            Liquid::Linear($modes) => $do,
            Liquid::Planar($modes) => $do,
            Liquid::Spherical($modes) => $do,
            Liquid::Paraboloid($modes) => $do,
        }
    }};
}
pub(crate) use with_modes;

impl Liquid {
    /// The modes at rest.
    pub fn new(p: &Parameters, calculated: &Calculated) -> Liquid {
        fn modes<M: SloshMode>(p: &Parameters, calculated: &Calculated) -> Vec<M> {
            calculated.pendulums(p).map(|pendulum| M::new(&pendulum)).collect()
        }
        match p.slosh.model {
            // Rigid liquid is a linear model without modes.
            SloshModel::Frozen | SloshModel::Linear => Liquid::Linear(modes(p, calculated)),
            SloshModel::Planar => Liquid::Planar(modes(p, calculated)),
            SloshModel::Spherical => Liquid::Spherical(modes(p, calculated)),
            SloshModel::Paraboloid | SloshModel::Liquid => Liquid::Paraboloid(modes(p, calculated)),
        }
    }

    /// Reason why the motion cannot start with these parameters, if there is one.
    pub fn start_problem(&self, init: &Init) -> Option<String> {
        with_modes!(self, modes => modes.first().and_then(|mode| mode.start_problem(init)))
    }
}

/// A mode's share of the hub's equation.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct HubReaction {
    /// Inertia J, kg m2.
    pub j: f64,
    /// Torque T, N m.
    pub t: f64,
}

/// Mode displacement as angles with sin(angle) = displacement / l.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles<T = f64> {
    /// Radial and tangential angle, rad.
    pub angle: [T; 2],
    /// Their rates, rad/s.
    pub rate: [T; 2],
}

impl<T: Number> Angles<T> {
    /// Angles of a mode at rest.
    pub fn zero() -> Angles<T> {
        let zero = [T::constant(0.0); 2];
        Angles { angle: zero, rate: zero }
    }
}

/// One slosh mode as a set of power series in time.
///
/// What is given over [`Number`] holds at the start of an expansion: the value, or the derivative along the
/// direction that was seeded.
pub trait SloshMode {
    /// Compiles steps with a single mode and constant g with the sums of every order
    /// written out: twice as fast, 40 to 100 KB of code.
    const UNROLLED: bool = false;
    /// True if J has coefficients beyond order 0.
    const MOVES_INERTIA: bool = true;
    /// The mode at rest; `start` puts it somewhere.
    fn new(pendulum: &Pendulum) -> Self;
    /// Reason why the motion cannot start with these parameters, if there is one.
    fn start_problem(&self, _init: &Init) -> Option<String> {
        None
    }
    /// The pendulum that it is made of.
    fn pendulum(&self) -> &Pendulum;
    /// Mutable [`SloshMode::pendulum`].
    fn pendulum_mut(&mut self) -> &mut Pendulum;
    /// Squares of the angle and of its rate, after `start`, rad2, rad2/s2; of a paraboloid those of displacement over length.
    fn amplitude2<T: Number>(&self) -> [T; 2];
    /// Coordinates from angles with sin(angle) = displacement/l and their rates.
    fn coordinates(&self, at: &Angles) -> [f64; 4];
    /// The reverse.
    fn angles<T: Number>(&self) -> Angles<T>;
    /// Sets the coordinates at the start of the expansion; w is known to order 0.
    fn start(&mut self, q: &[f64; 4], hub: &HubMotion);
    /// Sets the direction, coefficient 1 of the coordinates, for a partial derivative; w is
    /// known to order 1.
    fn seed_direction(&mut self, dq: &[f64; 4], hub: &HubMotion);
    /// Coefficient n, 0 or 1, of q_x', q_y', q_x'', q_y''.
    fn derivatives(&self, n: usize, hub: &HubMotion) -> [f64; 4];
    /// Coefficient n of J and T, from coefficients up to n of q, q' and w; `ramp` says whether
    /// g changes along the expansion.
    fn hub_reaction(&mut self, n: usize, ramp: bool, hub: &HubMotion) -> HubReaction;
    /// Coefficient n of q'' and with it n + 1 of q and q', after `hub_reaction`, when w' is
    /// known up to n.
    fn accelerate(&mut self, n: usize, varies: bool, hub: &HubMotion);
    /// Size of the motion, rad/s: what the tolerance is relative to.
    fn error_scale(&self) -> f64;
    /// Size of coefficient `n` of the rates, rad/s.
    fn coefficient_norm(&self, n: usize) -> f64;
    /// Coefficient n of the power that the mode dissipates, W, after `hub_reaction`.
    fn dissipation(&mut self, n: usize, ramp: bool) -> f64;
    /// Coefficient n of mass times height above rest, kg m: the potential energy over g.
    fn mass_height(&mut self, n: usize, hub: &HubMotion) -> f64;
    /// Coordinates at t, where the hub turns with `omega`, from the series cut after order n; `varies` as `ramp` above: where nothing does,
    /// modes move along the tangent.
    fn at(&self, n: usize, t: f64, omega: f64, varies: bool) -> [f64; 4];
    /// Mass times height above rest, kg m, and its rate.
    fn height<T: Number>(&self, hub: &HubMotion) -> [T; 2];
    /// Force of the bob on the tank, N, radial and tangential.
    fn force<T: Number>(&self, hub: &HubMotion) -> [T; 2];
    /// Torque of the bob on the hub, N m.
    fn torque<T: Number>(&self, hub: &HubMotion) -> T;
    /// Kinetic and potential energy, J.
    fn energy<T: Number>(&self, hub: &HubMotion) -> T;
    /// Angular momentum about the bearing's axis, kg m2/s.
    fn momentum<T: Number>(&self, hub: &HubMotion) -> T;
    /// Reason why the coordinates are outside the model's range, if they are.
    fn out_of_range(&self, _q: &[f64; 4]) -> Option<&'static str> {
        None
    }
}
