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
pub(crate) mod liquid;
mod paraboloid;
mod planar;
mod spherical;

use crate::series::{Series, ZERO, mul_ramp};
use crate::tank::Pendulum;
use crate::{Calculated, Init, Parameters};
use linear::Linear;
use paraboloid::Paraboloid;
use planar::Planar;
use spherical::Spherical;

/// The mechanical models of the liquid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum SloshModel {
    /// The liquid is a rigid body.
    Frozen = 1,
    /// Linear planar pendulums.
    Linear = 2,
    /// Nonlinear planar pendulums.
    Planar = 3,
    /// Spherical pendulums: the liquid can rotate.
    Spherical = 4,
    /// Masses on a paraboloid with a quartic spring.
    Paraboloid = 5,
    /// The first mode of an upright cylinder to third order in the amplitude.
    Liquid = 6,
}

impl SloshModel {
    /// All of them, in the order of their numbers.
    pub const ALL: [SloshModel; 6] = [
        SloshModel::Frozen,
        SloshModel::Linear,
        SloshModel::Planar,
        SloshModel::Spherical,
        SloshModel::Paraboloid,
        SloshModel::Liquid,
    ];
}

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

    /// Why the motion can't start as the parameters say, if it can't.
    pub fn start_problem(&self, init: &Init) -> Option<String> {
        fn of<M: SloshMode>(_: &[M], init: &Init) -> Option<String> {
            M::start_problem(init)
        }
        with_modes!(self, modes => of(modes, init))
    }
}

/// The hub's motion as liquid and bearing see it.
#[derive(Clone, Debug)]
pub struct HubMotion {
    /// theta, rad
    pub theta: Series,
    /// w, rad/s
    pub omega: Series,
    /// w^2
    pub omega2: Series,
    /// w', rad/s2
    pub omega_dot: Series,
    /// Specific force along the tank's axis, m/s2, and its rate.
    pub g: [f64; 2],
    /// How far ahead the course of the damping holds, s.
    pub damping_reach: f64,
    pub tilt: Tilt,
}

/// Gravity across the axis of a bench that leans. In the hub's frame, with the tangent t of the
/// tilt and the azimuth phi that the lateral part points to,
///
/// ```text
/// e = g d,   d = t (cos(phi - theta), sin(phi - theta))
/// ```
///
/// g the specific force along the axis: a mass M at the place X has the energy -M e.X, and
/// d' = w (d_y, -d_x).
#[derive(Clone, Debug)]
pub struct Tilt {
    /// t
    pub tangent: f64,
    /// phi, rad
    pub azimuth: f64,
    /// d and e
    pub direction: [Series; 2],
    pub e: [Series; 2],
}

impl Tilt {
    /// An upright bench.
    const NONE: Tilt = Tilt { tangent: 0.0, azimuth: 0.0, direction: [ZERO; 2], e: [ZERO; 2] };

    /// Coefficient n of d and e, from coefficients up to n of theta.
    pub fn expand(&mut self, n: usize, theta: &Series, g: &[f64; 2]) {
        if self.tangent == 0.0 {
            return;
        }
        if n == 0 {
            let (sin, cos) = libm::sincos(self.azimuth - theta[0]);
            (self.direction[0][0], self.direction[1][0]) = (self.tangent * cos, self.tangent * sin);
        } else {
            // d' = theta' (d_y, -d_x)
            let [x, y] = &self.direction;
            let turned = |d: &Series| {
                (1..=n).map(|j| j as f64 * theta[j] * d[n - j]).sum::<f64>() / n as f64
            };
            let (x_n, y_n) = (turned(y), -turned(x));
            (self.direction[0][n], self.direction[1][n]) = (x_n, y_n);
        }
        for i in 0..2 {
            self.e[i][n] = mul_ramp(n, g, &self.direction[i]);
        }
    }

    /// Coefficient n of -d.X, the height of a place X in the hub's frame, m.
    pub fn height(&self, n: usize, x: impl Fn(usize) -> [f64; 2]) -> f64 {
        if self.tangent == 0.0 {
            return 0.0;
        }
        let [d_x, d_y] = &self.direction;
        let term = |j: usize| {
            let [x, y] = x(j);
            x * d_x[n - j] + y * d_y[n - j]
        };
        -(0..=n).map(term).sum::<f64>()
    }

    /// e at order 0, m/s2.
    pub fn now(&self) -> [f64; 2] {
        [self.e[0][0], self.e[1][0]]
    }
}

impl HubMotion {
    /// At rest, weightless.
    pub const REST: HubMotion = HubMotion {
        theta: ZERO,
        omega: ZERO,
        omega2: ZERO,
        omega_dot: ZERO,
        g: [0.0; 2],
        damping_reach: f64::INFINITY,
        tilt: Tilt::NONE,
    };
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
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Angles {
    /// Radial and tangential angle, rad.
    pub angle: [f64; 2],
    /// Their rates, rad/s.
    pub rate: [f64; 2],
}

/// One slosh mode as a set of power series in time.
pub trait SloshMode {
    /// Whether steps with a single mode and g held are compiled with the sums of every order
    /// written out: twice as fast, 40 to 100 KB of code.
    const UNROLLED: bool = false;
    /// Whether J has coefficients beyond order 0.
    const MOVES_INERTIA: bool = true;
    /// The mode at rest; `start` puts it somewhere.
    fn new(pendulum: &Pendulum) -> Self;
    /// Why the motion can't start as the parameters say, if it can't.
    fn start_problem(_init: &Init) -> Option<String> {
        None
    }
    /// The pendulum that it is made of.
    fn pendulum(&mut self) -> &mut Pendulum;
    /// Squares of displacement over length and of its rate, at order 0 after `start`, rad2, rad2/s2.
    fn amplitude2(&self) -> [f64; 2];
    /// A displacement of the coordinates at which forces and energies curve, in their unit.
    fn coordinate_scale(&self) -> f64 {
        1.0
    }
    /// Coordinates from angles with sin(angle) = displacement/l and their rates.
    fn coordinates(&self, at: &Angles) -> [f64; 4];
    /// The reverse, at order 0.
    fn angles(&self) -> Angles;
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
    /// Coordinates at t, where the hub turns with `omega`, from the series cut after order n.
    fn at(&self, n: usize, t: f64, omega: f64) -> [f64; 4];
    /// Force of the bob on the tank, N, radial and tangential, at order 0.
    fn force(&self, hub: &HubMotion) -> [f64; 2];
    /// Torque of the bob on the hub, N m, at order 0.
    fn torque(&self, hub: &HubMotion) -> f64;
    /// Kinetic and potential energy, J, at order 0.
    fn energy(&self, hub: &HubMotion) -> f64;
    /// Angular momentum about the bearing's axis, kg m2/s, at order 0.
    fn momentum(&self, hub: &HubMotion) -> f64;
    /// What makes the coordinates meaningless, if anything does.
    fn out_of_range(&self, _q: &[f64; 4]) -> Option<&'static str> {
        None
    }
}
