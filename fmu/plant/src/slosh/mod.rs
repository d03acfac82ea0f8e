//! The liquid's mechanical models: what a slosh mode must tell the hub and the
//! integrator, and the models that do.
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

pub mod linear;
pub mod paraboloid;
pub mod planar;
pub mod spherical;

use crate::series::Series;
use crate::tank::Pendulum;

/// The hub's motion as a mode sees it.
#[derive(Clone, Debug)]
pub struct Hub {
    /// w, rad/s
    pub omega: Series,
    /// w^2
    pub omega2: Series,
    /// w', rad/s2
    pub omega_dot: Series,
    /// Specific force along the tank's axis, m/s2, and its rate.
    pub g: [f64; 2],
}

/// A mode's share of the hub's equation.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Load {
    /// Inertia J, kg m2.
    pub j: f64,
    /// Torque T, N m.
    pub t: f64,
}

/// Mode displacement as angles with sin(angle) = displacement / l.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Angles {
    /// Radial and tangential angle, rad.
    pub angle: [f64; 2],
    /// Their rates, rad/s.
    pub rate: [f64; 2],
}

/// One slosh mode as a set of power series in time.
pub trait Mode {
    /// Whether J changes as the mode moves.
    const MOVES_INERTIA: bool = true;
    /// The mode at rest; `start` puts it somewhere.
    fn new(pendulum: &Pendulum) -> Self;
    /// Coordinates from angles with sin(angle) = displacement/l and their rates.
    fn coordinates(&self, at: &Angles) -> [f64; 4];
    /// The reverse, at order 0.
    fn angles(&self) -> Angles;
    /// Sets the coordinates at the start of the expansion; w is known to order 0.
    fn start(&mut self, q: &[f64; 4], hub: &Hub);
    /// Sets the direction, coefficient 1 of the coordinates, for a partial derivative; w is
    /// known to order 1.
    fn aim(&mut self, dq: &[f64; 4], hub: &Hub);
    /// Coefficient N, 0 or 1, of q_x', q_y', q_x'', q_y''.
    fn rate<const N: usize>(&self, hub: &Hub) -> [f64; 4];
    /// Coefficient N of J and T, from coefficients up to N of q, q' and w.
    fn load<const N: usize>(&mut self, hub: &Hub) -> Load;
    /// Coefficient N of q'' and with it N + 1 of q and q', after `load`, when w' is known up
    /// to N.
    fn respond<const N: usize>(&mut self, hub: &Hub);
    /// Size of the motion, rad/s: the scale of its errors.
    fn size(&self) -> f64;
    /// Size of coefficient `n` of the rates.
    fn term(&self, n: usize) -> f64;
    /// Coefficient N of the heat made by the mode, W.
    fn heat<const N: usize>(&mut self) -> f64;
    /// Coordinates at t, where the hub turns with `omega`, from the series cut after order n.
    fn at(&self, n: usize, t: f64, omega: f64) -> [f64; 4];
    /// Force of the bob on the tank, N, radial and tangential, at order 0.
    fn force(&self, hub: &Hub) -> [f64; 2];
    /// Torque of the bob on the hub, N m, at order 0.
    fn torque(&self, hub: &Hub) -> f64;
    /// Kinetic and potential energy, J, at order 0.
    fn energy(&self, hub: &Hub) -> f64;
    /// Angular momentum about the bearing's axis, kg m2/s, at order 0.
    fn momentum(&self, hub: &Hub) -> f64;
    /// What makes the coordinates meaningless, if anything does.
    fn out_of_range(&self, q: &[f64; 4]) -> Option<&'static str>;
}
