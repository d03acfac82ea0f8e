//! Tests of free waves of the first mode in the bench's tank, which is at rest or driven sideways.
//!
//! `tests/six` includes this file as well, and runs it with the packed FMUs instead of this crate.

use std::f64::consts::FRAC_PI_2;

use craft::{DampingLaw, MODES, Ramp, Tank, TankInputs, TankParameters};
use formulas::{cylinder, third_order};

use super::component::SloshTank;

pub const G: f64 = 9.80665;

pub const TOLERANCE: f64 = 1e-12;

/// Returns a cylindrical tank of 81.5 mm radius that is filled to a depth of `fill` radii, with
/// only its first mode and with the coefficients of potential flow.
pub fn bench(fill: f64) -> Tank {
    let (d, h) = (0.163, 0.0815 * fill);
    let pendulum = cylinder::pendulum(0, d, h, 2.083);
    let (s, kappa) = third_order::coefficients(fill);
    let mut tank = Tank {
        position: [0.0; 3],
        modes: 1,
        m_0: 2.083 - pendulum.mass,
        i_0: 0.0,
        g_ref: G,
        zeta: [0.0; MODES],
        damping_law: DampingLaw::Constant,
        ..Tank::default()
    };
    (tank.mass[0], tank.length[0], tank.hinge[0]) = (pendulum.mass, pendulum.length, 0.0);
    (tank.nonlinear_inertia[0], tank.nonlinear_stiffness[0]) = (s, kappa);
    tank
}

pub fn linear_frequency(tank: &Tank) -> f64 {
    f64::sqrt(G / tank.length[0])
}

pub fn sideways([value, slope]: [f64; 2]) -> Ramp {
    Ramp { value: [value, 0.0, G], slope: [slope, 0.0, 0.0] }
}

pub trait Moved: Sized {
    fn start(tank: &Tank) -> Self;

    fn step(&mut self, a: [f64; 2], h: f64);

    fn bob(&mut self) -> [f64; 6];

    fn rates(&mut self) -> [f64; 6];
}

impl Moved for SloshTank {
    fn start(tank: &Tank) -> Self {
        let p = TankParameters { tank: *tank, ..TankParameters::default() };
        let u = TankInputs { a: sideways([0.0; 2]), ..TankInputs::default() };
        SloshTank::new(&p, &u, 0.0, TOLERANCE).unwrap()
    }

    fn step(&mut self, a: [f64; 2], h: f64) {
        let u = TankInputs { a: sideways(a), ..TankInputs::default() };
        SloshTank::step(self, &u, h).unwrap();
    }

    fn bob(&mut self) -> [f64; 6] {
        self.continuous_states()[..6].try_into().unwrap()
    }

    fn rates(&mut self) -> [f64; 6] {
        let u = TankInputs { a: sideways([0.0; 2]), ..TankInputs::default() };
        self.derivatives(&u)[..6].try_into().unwrap()
    }
}

/// Returns the frequency of the mode, divided by the linear frequency, if the bob is released from rest at A = |q|/l in
/// the x z plane.
pub fn planar<T: Moved>(mut tank: Tank, a: f64) -> f64 {
    tank.p_0[0] = [a, 0.0, -f64::sqrt(1.0 - a * a)];
    let w = linear_frequency(&tank);
    // Newton's method finds the first zero of p_x, after a quarter of a period.
    let mut quarter = 1.5 / w;
    for _ in 0..6 {
        let mut moved = T::start(&tank);
        moved.step([0.0; 2], quarter);
        let x = moved.bob();
        quarter -= x[0] / x[3];
    }
    FRAC_PI_2 / quarter / w
}

/// Returns the frequency of the mode, divided by the linear frequency, if the bob moves on a circle with A = |q|/l.
pub fn circular<T: Moved>(mut tank: Tank, a: f64) -> f64 {
    let w = linear_frequency(&tank);
    tank.p_0[0] = [a, 0.0, -f64::sqrt(1.0 - a * a)];
    // The acceleration along the meridian is a linear function of the squared rate.
    let mut slide = |rate: f64| {
        tank.p_dot_0[0] = [0.0, a * rate, 0.0];
        // For motion on a circle p_x'' = -a rate^2.
        T::start(&tank).rates()[3] + a * rate * rate
    };
    let [at_rest, moving] = [slide(0.0), slide(w)];
    f64::sqrt(at_rest / (at_rest - moving))
}
