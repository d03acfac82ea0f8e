//! Mechanical models of the liquid: the interface of a slosh mode to hub and integrator, and the models that implement it.
//! Each model has its own file; this file lists all models.
//!
//! A mode's coordinates are `q = [q_x, q_y, q_x', q_y']` in the hub's frame, with x radial (outwards) and y tangential
//! (towards +theta). The file of each model defines q. All modes act on the hub through
//!
//! ```text
//! J w' = tau + tau_f + T,      q'' = B + A w'
//! ```
//!
//! where w is the hub's rate, and J, T, B and A do not contain w'.

mod linear;
mod planar;
mod spherical;
mod third_order;

use alloc::string::String;
use alloc::vec::Vec;

use taylor::number::Number;

use crate::hub::HubMotion;
use crate::parameters::{Init, Parameters};
use crate::pendulum::Pendulum;
use crate::slosh_model::SloshModel;
use crate::tank::Calculated;
use linear::Linear;
use planar::Planar;
use spherical::Spherical;
use third_order::ThirdOrder;

/// Defines the functions of [`SloshMode`] that are the same in all models that store their pendulum in the field `p`.
macro_rules! own_pendulum {
    () => {
        fn pendulum(&self) -> &Pendulum {
            &self.p
        }

        fn pendulum_mut(&mut self) -> &mut Pendulum {
            &mut self.p
        }
    };
}
use own_pendulum;

/// Defines the functions of [`SloshMode`] for a model with one angle `al` along the direction of its pendulum `p`. `al_d`
/// and `al_dd` are its derivatives, and `drag` is `al_d` times the drag coefficient, which is divided by its value at the
/// start of the series.
macro_rules! one_angle {
    () => {
        own_pendulum!();

        fn start_problem(&self, init: &Init) -> Option<String> {
            self.p.start_problem(init)
        }

        fn amplitude2<T: Number>(&self) -> [T; 2] {
            [&self.al, &self.al_d].map(|x| number::<T>(x) * number::<T>(x))
        }

        fn coordinates(&self, at: &Angles) -> [f64; 4] {
            let ([q_x, q_y], [x_d, y_d]) = (at.angle, at.rate);
            self.p.coordinates(self.p.angle_and_rate([q_x, q_y, x_d, y_d]))
        }

        fn angles<T: Number>(&self) -> Angles<T> {
            let [angle, rate] = [&self.al, &self.al_d].map(|x| self.p.spread(number::<T>(x)));
            Angles { angle, rate }
        }

        fn start(&mut self, q: &[f64; 4], _: &HubMotion) {
            [self.al[0], self.al_d[0]] = self.p.angle_and_rate(*q);
        }

        fn seed_direction(&mut self, dq: &[f64; 4], _: &HubMotion) {
            [self.al[1], self.al_d[1]] = self.p.angle_and_rate(*dq);
        }

        fn derivatives(&self, n: usize, _: &HubMotion) -> [f64; 4] {
            self.p.coordinates([self.al_d[n], self.al_dd[n]])
        }

        #[inline(always)]
        fn coefficient_norm(&self, n: usize) -> f64 {
            self.al_d[n].abs()
        }

        #[inline(always)]
        fn dissipation(&mut self, n: usize, ramp: bool) -> f64 {
            self.p.c
                * self.p.l
                * self.p.l
                * if ramp { mul(n, &self.drag, &self.al_d) } else { square(n, &self.al_d) }
        }

        #[inline(always)]
        fn coordinates_at(&self, n: usize, t: f64, _: f64, varies: bool) -> [f64; 4] {
            let [al, al_d] = values([&self.al, &self.al_d], n, t);
            if varies { self.p.coordinates([al, al_d]) } else { [0.0, al, 0.0, al_d] }
        }
    };
}
use one_angle;

#[derive(Clone, Debug)]
pub(crate) enum Liquid {
    Linear(Vec<Linear>),
    Planar(Vec<Planar>),
    Spherical(Vec<Spherical>),
    ThirdOrder(Vec<ThirdOrder>),
}

macro_rules! with_modes {
    ($liquid:expr, $modes:ident => $do:expr) => {{
        use $crate::slosh::Liquid;
        match $liquid {
            Liquid::Linear($modes) => $do,
            Liquid::Planar($modes) => $do,
            Liquid::Spherical($modes) => $do,
            Liquid::ThirdOrder($modes) => $do,
        }
    }};
}
pub(crate) use with_modes;

impl Liquid {
    pub fn new(p: &Parameters, calculated: &Calculated) -> Liquid {
        fn modes<M: SloshMode>(p: &Parameters, calculated: &Calculated) -> Vec<M> {
            calculated.pendulums(p).map(|pendulum| M::new(&pendulum)).collect()
        }
        match p.slosh.model {
            // Rigid liquid is a linear model without modes.
            SloshModel::Frozen | SloshModel::Linear => Liquid::Linear(modes(p, calculated)),
            SloshModel::Planar => Liquid::Planar(modes(p, calculated)),
            SloshModel::Spherical => Liquid::Spherical(modes(p, calculated)),
            SloshModel::Liquid => Liquid::ThirdOrder(modes(p, calculated)),
        }
    }

    pub fn start_problem(&self, init: &Init) -> Option<String> {
        with_modes!(self, modes => modes.first().and_then(|mode| mode.start_problem(init)))
    }
}

/// Contribution of one mode to the hub's equation of motion: an inertia, kg m2, and a torque, N m.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct HubReaction {
    pub j: f64,
    pub t: f64,
}

/// Displacement of a mode as a radial and a tangential angle, rad, and the rates of these angles, rad/s. The sine of an angle
/// is the displacement divided by the pendulum length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles<T = f64> {
    pub angle: [T; 2],
    pub rate: [T; 2],
}

impl<T: Number> Angles<T> {
    pub fn zero() -> Angles<T> {
        let zero = [T::constant(0.0); 2];
        Angles { angle: zero, rate: zero }
    }
}

/// One mode of a slosh model, whose quantities are power series in time.
///
/// Functions that are generic over [`Number`] apply to the start of the series: they return a value, or its directional
/// derivative. In the other functions `ramp` is true if the specific force changes along the series, and `varies` is true if
/// specific force, drag or weight changes.
pub trait SloshMode {
    /// True if the code for a single mode and constant specific force is compiled with the sums of every order written out,
    /// which is twice as fast and takes 40 to 100 KB of code.
    const UNROLLED: bool = false;
    const MOVES_INERTIA: bool = true;
    fn new(pendulum: &Pendulum) -> Self;
    fn start_problem(&self, _init: &Init) -> Option<String> {
        None
    }
    fn pendulum(&self) -> &Pendulum;
    fn pendulum_mut(&mut self) -> &mut Pendulum;
    /// Returns the squares of the slosh angle, rad2, and of its rate, rad2/s2, at the start of the series. In the model
    /// `ThirdOrder`, displacement divided by length replaces the angle.
    fn amplitude2<T: Number>(&self) -> [T; 2];
    fn coordinates(&self, at: &Angles) -> [f64; 4];
    fn angles<T: Number>(&self) -> Angles<T>;
    /// Sets the coordinates of the mode to `q` at the start of the series. Coefficient 0 of the hub's rate must be known.
    fn start(&mut self, q: &[f64; 4], hub: &HubMotion);
    /// Sets Taylor coefficient 1 of the coordinates to `dq`, their change in a directional derivative. Coefficients 0 and 1
    /// of the hub's rate must be known.
    fn seed_direction(&mut self, dq: &[f64; 4], hub: &HubMotion);
    fn derivatives(&self, n: usize, hub: &HubMotion) -> [f64; 4];
    /// Returns Taylor coefficient n of the inertia and of the torque with which the mode acts on the hub, from the
    /// coefficients of the coordinates, their rates and the hub's rate up to order n. The equations are at the head of the
    /// file.
    fn hub_reaction(&mut self, n: usize, ramp: bool, hub: &HubMotion) -> HubReaction;
    /// Computes Taylor coefficient n of the acceleration of the coordinates, and coefficient n + 1 of the coordinates and
    /// their rates. It is called after `hub_reaction`, when the hub's angular acceleration is known up to order n.
    fn accelerate(&mut self, n: usize, varies: bool, hub: &HubMotion);
    fn error_scale(&self) -> f64;
    fn coefficient_norm(&self, n: usize) -> f64;
    /// Returns Taylor coefficient n of the power that the mode dissipates, W. `hub_reaction` must have computed order n.
    fn dissipation(&mut self, n: usize, ramp: bool) -> f64;
    /// Returns Taylor coefficient n of the slosh mass times its height above rest, kg m, which is the potential energy
    /// divided by the specific force.
    fn mass_height(&mut self, n: usize, hub: &HubMotion) -> f64;
    /// Returns the coordinates `t` seconds after the start of the series, when the hub has the rate `omega`, rad/s. They are
    /// computed from their series up to order n. If `varies` is false, the mode moves along the tangent, because `varies` is
    /// always true for modes with another direction.
    fn coordinates_at(&self, n: usize, t: f64, omega: f64, varies: bool) -> [f64; 4];
    /// Returns the slosh mass times its height above rest, kg m, and the rate of this product. The potential energy is the
    /// specific force times the product.
    fn height<T: Number>(&self, hub: &HubMotion) -> [T; 2];
    /// Returns the radial and the tangential force of the slosh mass on the tank, N.
    fn force<T: Number>(&self, hub: &HubMotion) -> [T; 2];
    /// Returns the torque about the bearing axis with which the slosh mass acts on the hub, N m.
    fn torque<T: Number>(&self, hub: &HubMotion) -> T;
    fn energy<T: Number>(&self, hub: &HubMotion) -> T;
    fn momentum<T: Number>(&self, hub: &HubMotion) -> T;
    fn out_of_range(&self, _q: &[f64; 4]) -> Option<&'static str> {
        None
    }
}
