//! A tank on a rigid body that another program simulates. Tank and body exchange signals once per communication step H.
//!
//! lambda is the largest eigenvalue of M_body^-1 M_a; w_0 and w_p are the slosh frequencies with a fixed and with a
//! free body. The total wrench contains -M_a [a; w']. If the body receives a delayed copy of it, errors grow from step
//! to step by a factor z with
//!
//! ```text
//! Gauss-Seidel (body first), forces held                 z + lambda = 0             lambda < 1
//! Gauss-Seidel, forces extrapolated linearly             z^2 + 2 lambda z - lambda = 0     1/3
//! Jacobi, both extrapolate                               z^4 + lambda (2 z - 1)^2 = 0   0.1547
//! ```
//!
//! for every H; the last column is the limit of stability. If added mass and bias are exchanged separately, there is no such
//! loop. Values that are held over a step then make the slosh mode grow at the rate (w_p^2 - w_0^2) H/4, and three times as fast
//! if tank and body step in parallel (Jacobi).
//!
//! Source: the recurrences follow from one eigendirection of the exchange; the growth rates follow from delays of the
//! restoring force by H/2 and 3 H/2.

use craft::{
    Coupling, Craft, DampingLaw, Inertia, Inputs, Parameters, Ramp, SloshTankOutputs, Tank,
    TankInputs, TankParameters, index,
};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::component::{SloshTank, Spacecraft};

const THRUST: f64 = 2400.0;

/// The form in which the craft (here a rigid body) receives the force of the tank: as the total force and torque, as bias and
/// added mass (`Split`), or in one of the forms below.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Exchange {
    Total,
    Split,
    /// The constant lumped matrix of the tank (rigid liquid, and each slosh mass at its hinge) is added to the matrix of the
    /// equations that the body solves.
    Lumped,
    /// The mass that the lumped matrix represents is a part of the mass, centre of mass and inertia of the body.
    RigidBody,
    /// The added mass at rest is used as a constant matrix, and the force that belongs to it is taken out of the total force
    /// and torque.
    Constant,
}

/// How the exchanged values change within a step (constant, or linearly extrapolated), and in which order the two FMUs are
/// stepped: one after the other (Gauss–Seidel) or both with the values of the last step (Jacobi).
#[derive(Clone, Copy, Debug, PartialEq)]
enum Order {
    GaussSeidelHeld,
    GaussSeidelLinear,
    JacobiHeld,
    JacobiLinear,
    /// The step of `GaussSeidelLinear` is made and then repeated with the values of the tank at its end.
    Repeated,
}
use Order::*;

/// Matrix and right-hand side of the tank's terms in the equations of the body.
type Given = (Matrix6<f64>, Vector6<f64>);

/// A rigid body under thrust along z with a tank. Only the rates and accelerations of the body matter to the tank.
struct Pair {
    mass_matrix: Matrix6<f64>,
    moment: Vector3<f64>,
    inertia: Matrix3<f64>,
    tank: SloshTank,
    exchange: Exchange,
    order: Order,
    w: Vector3<f64>,
    x: [Vector6<f64>; 2],
    given: [Given; 2],
    at_rest: Matrix6<f64>,
}

fn symmetric(triangle: &[f64]) -> Matrix6<f64> {
    let mut m = Matrix6::zeros();
    let places = (0..6).flat_map(|i| (i..6).map(move |j| (i, j)));
    for ((i, j), x) in places.zip(triangle) {
        (m[(i, j)], m[(j, i)]) = (*x, *x);
    }
    m
}

fn parameters(share: f64, tank: Tank) -> Parameters {
    let j = Inertia { xx: 860.0, yy: 860.0, zz: 640.0, xy: 0.0, xz: 0.0, yz: 0.0 };
    let scaled = Inertia { xx: share * j.xx, yy: share * j.yy, zz: share * j.zz, ..j };
    let mut p = Parameters::default();
    p.craft = Craft { mass: 1180.0 * share, j: scaled, ..p.craft };
    p.tank[0] = tank;
    p
}

fn ratio(tank: Tank) -> f64 {
    let host = Some(parameters(1.0, tank).craft);
    let p = TankParameters { tank, host, ..TankParameters::default() };
    SloshTank::new(&p, &TankInputs::default(), 0.0, 1e-9).unwrap().coupling_ratio().unwrap()
}

impl Pair {
    fn new(p: &Parameters, exchange: Exchange, order: Order) -> Pair {
        let coupling = match exchange {
            Exchange::Lumped => Coupling::Lumped,
            Exchange::RigidBody => Coupling::RigidBody,
            _ => Coupling::Split,
        };
        let own = TankParameters { tank: p.tank[0], coupling, ..TankParameters::default() };
        let tank = SloshTank::new(&own, &TankInputs::default(), 0.0, 1e-10).unwrap();
        let (mass, r) = (p.craft.mass, Vector3::from(p.craft.r));
        let arm = r.cross_matrix();
        let j = Matrix3::from_fn(|i, k| p.craft.j.matrix()[i][k]);
        let inertia = j - arm * arm * mass;
        let mut mass_matrix = Matrix6::zeros();
        mass_matrix.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(mass);
        mass_matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-arm * mass));
        mass_matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&(arm * mass));
        mass_matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&inertia);
        // At the start the body has the acceleration of the whole craft.
        let force = Ramp::held([0.0, 0.0, THRUST]);
        let u = Inputs { force, ..Inputs::default() };
        let start = Spacecraft::new(p, &u, 0.0, 1e-9).unwrap().outputs(&u);
        let (a, w_d) = (start.specific_force, start.omega_dot);
        let x = Vector6::new(a[0], a[1], a[2], w_d[0], w_d[1], w_d[2]);
        let mut pair = Pair {
            mass_matrix,
            moment: r * mass,
            inertia,
            tank,
            exchange,
            order,
            w: Vector3::from(p.init.omega),
            x: [x, x],
            given: [(Matrix6::zeros(), Vector6::zeros()); 2],
            at_rest: Matrix6::zeros(),
        };
        pair.at_rest = symmetric(&pair.tank.outputs(&TankInputs::default()).added_mass);
        let given = pair.equation_terms(&pair.input([x, x], 1.0));
        pair.given = [given, given];
        pair
    }

    fn input(&self, [from, to]: [Vector6<f64>; 2], h: f64) -> TankInputs {
        let ramp = |at: usize| Ramp {
            value: [from[at], from[at + 1], from[at + 2]],
            slope: [0, 1, 2].map(|i| (to[at + i] - from[at + i]) / h),
        };
        TankInputs { a: ramp(0), omega: self.w.into(), omega_dot: ramp(3), ..TankInputs::default() }
    }

    /// Returns the tank's matrix and right-hand side in the equation that the body solves, (M_body + matrix) x = rest +
    /// right-hand side, where x are its accelerations. `u` are the inputs of the tank.
    fn equation_terms(&mut self, u: &TankInputs) -> Given {
        let SloshTankOutputs { tank, bias, added_mass, .. } = self.tank.outputs(u);
        let wrench = Vector6::from_column_slice(&[tank.force, tank.torque].concat());
        match self.exchange {
            Exchange::Total => (Matrix6::zeros(), wrench),
            Exchange::Constant => {
                let x = Vector6::from_column_slice(&[u.a.value, u.omega_dot.value].concat());
                (self.at_rest, wrench + self.at_rest * x)
            }
            Exchange::Split | Exchange::Lumped | Exchange::RigidBody => {
                (symmetric(&added_mass), Vector6::from_column_slice(&bias))
            }
        }
    }

    fn acceleration(
        &self,
        w: Vector3<f64>,
        matrix: &Matrix6<f64>,
        rhs: &Vector6<f64>,
    ) -> Vector6<f64> {
        // A plain rigid body has the lumped mass in all of its equations, including the gyroscopic terms.
        let (mut moment, mut inertia) = (self.moment, self.inertia);
        if self.exchange == Exchange::RigidBody {
            moment += Vector3::new(matrix[(5, 1)], matrix[(3, 2)], matrix[(4, 0)]);
            inertia += matrix.fixed_view::<3, 3>(3, 3);
        }
        let force = Vector3::new(0.0, 0.0, THRUST) - w.cross(&w.cross(&moment));
        let torque = -w.cross(&(inertia * w));
        let mut rest = *rhs;
        for i in 0..3 {
            rest[i] += force[i];
            rest[3 + i] += torque[i];
        }
        (self.mass_matrix + matrix).lu().solve(&rest).unwrap()
    }

    /// Makes a step of `h` seconds of the body by Runge–Kutta for its angular rate, while matrix and right-hand side of the
    /// tank change linearly to `end`. Returns the accelerations at both ends of the step, and the rate at its end.
    fn move_body(&self, end: &Given, h: f64) -> ([Vector6<f64>; 2], Vector3<f64>) {
        let now = &self.given[1];
        let rate = |share: f64, w: Vector3<f64>| {
            let matrix = now.0 + (end.0 - now.0) * share;
            let rhs = now.1 + (end.1 - now.1) * share;
            let x = self.acceleration(w, &matrix, &rhs);
            (x, Vector3::new(x[3], x[4], x[5]))
        };
        let (from, k1) = rate(0.0, self.w);
        let (_, k2) = rate(0.5, self.w + k1 * (h / 2.0));
        let (_, k3) = rate(0.5, self.w + k2 * (h / 2.0));
        let (_, k4) = rate(1.0, self.w + k3 * h);
        let w = self.w + (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
        let (to, _) = rate(1.0, w);
        ([from, to], w)
    }

    /// Makes a step of `h` seconds of the tank, with the accelerations of the body at both `ends` of the step, and returns
    /// the tank's terms at its end.
    fn move_tank(&mut self, ends: [Vector6<f64>; 2], h: f64) -> Given {
        self.tank.step(&self.input(ends, h), h).unwrap();
        self.equation_terms(&self.input([ends[1], ends[1]], h))
    }

    fn step(&mut self, h: f64) {
        let [last, now] = self.given;
        let end = match self.order {
            GaussSeidelHeld | JacobiHeld => now,
            _ => (now.0 * 2.0 - last.0, now.1 * 2.0 - last.1),
        };
        let ([from, to], mut w) = self.move_body(&end, h);
        let ends = match self.order {
            GaussSeidelHeld => [from, from],
            GaussSeidelLinear | Repeated => [from, to],
            JacobiHeld => [self.x[1], self.x[1]],
            JacobiLinear => [self.x[1], self.x[1] * 2.0 - self.x[0]],
        };
        let before = (self.order == Repeated).then(|| self.tank.save());
        let mut given = self.move_tank(ends, h);
        if let Some(before) = before {
            self.tank.restore(before);
            let ends;
            (ends, w) = self.move_body(&given, h);
            given = self.move_tank(ends, h);
        }
        self.w = w;
        self.given = [now, given];
        let is_held = matches!(self.order, GaussSeidelHeld | JacobiHeld);
        self.x = [self.x[1], if is_held { from } else { to }];
    }

    fn slosh(&mut self) -> [f64; 2] {
        let x = self.tank.continuous_states();
        [x[0], x[3]]
    }
}

/// Returns true if a disturbance of 1e-6 of the force grows to about ten thousand times its size within 1500 steps. `lambda`
/// is the added mass of the tank divided by the mass of the body.
fn total_wrench_diverges(lambda: f64, order: Order, h: f64) -> bool {
    let tank = Tank::default();
    let p = parameters(ratio(tank) / lambda, tank);
    let mut pair = Pair::new(&p, Exchange::Total, order);
    let start = pair.x[1];
    let size = 1e-6 * THRUST;
    pair.given[1].1 += Vector6::new(0.6, -0.4, 1.0, 0.3, 0.2, 0.1) * size;
    for _ in 0..1500 {
        pair.step(h);
        let off = (pair.x[1] - start).norm();
        if off > 1e-2 * start.norm() || off.is_nan() {
            return true;
        }
    }
    false
}

#[test]
fn coupling_by_total_force_and_torque_diverges_above_the_limit_of_the_inertia_ratio() {
    let limits = [
        (GaussSeidelHeld, 1.0),
        (JacobiHeld, 1.0),
        (GaussSeidelLinear, 1.0 / 3.0),
        (JacobiLinear, 2.0 / f64::sqrt(3.0) - 1.0),
    ];
    for h in [0.005, 0.02] {
        for (order, limit) in limits {
            assert!(!total_wrench_diverges(0.97 * limit, order, h), "{limit} at {h}");
            assert!(total_wrench_diverges(1.03 * limit, order, h), "{limit} at {h}");
        }
    }
}

#[test]
fn a_warning_names_a_coupling_that_would_diverge() {
    let tank = Tank::default();
    let warning = |lambda: f64, coupling: Coupling| {
        let host = Some(parameters(ratio(tank) / lambda, tank).craft);
        let p = TankParameters { tank, coupling, host, ..TankParameters::default() };
        SloshTank::new(&p, &TankInputs::default(), 0.0, 1e-9).unwrap().warning()
    };
    let text = warning(0.151, Coupling::Split).unwrap();
    assert!(text.starts_with("coupling_ratio = 0.151"), "{text}");
    assert_eq!(warning(0.149, Coupling::Split), None);
    assert_eq!(warning(6.0, Coupling::Lumped), None);
    assert_eq!(warning(6.0, Coupling::RigidBody), None);
}

fn growth(share: f64, order: Order, h: f64) -> (f64, f64) {
    let mut tank = Tank { zeta: [0.0; 3], ..Tank::default() };
    tank.p_0[0] = [0.01, 0.0, -1.0];
    let p = parameters(share, tank);
    // w_p^2 and w_0^2 follow from the closed forms for one tank on the axis.
    let mass = p.craft.mass + tank.m_0;
    let z_0 = tank.position[2] + tank.h_0;
    let center = (p.craft.mass * p.craft.r[2] + tank.m_0 * z_0) / mass;
    let inertia = p.craft.j.yy
        + p.craft.mass * (p.craft.r[2] - center).powi(2)
        + tank.i_0
        + tank.m_0 * (z_0 - center).powi(2);
    let (m, l) = (tank.mass[0], tank.length[0]);
    let b = tank.position[2] + tank.hinge[0] - l - center;
    let g = THRUST / (mass + m);
    let w_0_2 = g / l;
    let w_p_2 = w_0_2 * (1.0 + m / mass + m * b * b / inertia) + m * b * g / inertia;

    let mut pair = Pair::new(&p, Exchange::Split, order);
    let size = |pair: &mut Pair| {
        let [p, p_d] = pair.slosh();
        f64::hypot(p, p_d / f64::sqrt(w_p_2))
    };
    // The mean of the peaks over a period does not depend on the phase, which the delay changes.
    let mut means = [0.0; 2];
    let steps = |t: f64| (t / h).round() as usize;
    let period = std::f64::consts::TAU / f64::sqrt(w_p_2);
    for k in 0..steps(60.0 + period) {
        pair.step(h);
        for (mean, begin) in means.iter_mut().zip([10.0, 60.0]) {
            if k >= steps(begin) && k < steps(begin + period) {
                *mean += size(&mut pair) * h / period;
            }
        }
    }
    let formula = match order {
        GaussSeidelHeld => (w_p_2 - w_0_2) * h / 4.0,
        JacobiHeld => 3.0 * (w_p_2 - w_0_2) * h / 4.0,
        GaussSeidelLinear => (w_p_2 - w_0_2) * w_p_2 * h * h * h / 6.0,
        JacobiLinear => 4.0 * (w_p_2 - w_0_2) * w_p_2 * h * h * h / 6.0,
        Repeated => 0.0,
    };
    (f64::ln(means[1] / means[0]) / 50.0, formula)
}

/// Mass of a body of 300 kg divided by the mass of the default craft. With the default tank, the added mass is 1.3 times the
/// mass of this body.
const LIGHT: f64 = 300.0 / 1180.0;

/// Tank and craft are two FMUs that exchange force and acceleration once in a communication step, in Jacobi or Gauss–Seidel
/// order. The growth rate of the slosh mode must equal the rate that follows from the delay.
#[test]
fn coupling_two_fmus_with_a_delay_makes_the_slosh_mode_grow_as_predicted() {
    for (share, order, h) in [
        (1.0, GaussSeidelHeld, 0.02),
        (1.0, GaussSeidelHeld, 0.05),
        (LIGHT, GaussSeidelHeld, 0.02),
        (1.0, JacobiHeld, 0.02),
        (1.0, JacobiHeld, 0.05),
        (LIGHT, JacobiHeld, 0.02),
        (1.0, GaussSeidelLinear, 0.1),
    ] {
        let (got, formula) = growth(share, order, h);
        println!("{share:.2} {order:?} {h}: {got:.5} {formula:.5}");
        assert!((got / formula - 1.0).abs() < 0.05, "{share} {order:?} {h}: {got} {formula}");
    }
}

fn box_tank() -> Tank {
    let mut tank = Tank {
        zeta: [0.05; 3],
        damping_law: DampingLaw::Constant,
        modes: 2,
        position: [0.0, 0.0, -0.1],
        m_0: -129.078,
        h_0: -0.264922,
        i_0: 22.1010,
        di_y: 20.8832,
        i_z: 15.2917,
        ..Tank::default()
    };
    tank.direction[..2].copy_from_slice(&[[1.0, 0.0], [0.0, 1.0]]);
    tank.mass[..2].copy_from_slice(&[287.342, 241.697]);
    tank.length[..2].copy_from_slice(&[0.571581, 0.24463]);
    tank.hinge[..2].copy_from_slice(&[0.577911, 0.261103]);
    tank.p_0[0] = [0.1, 0.0, -1.0];
    tank.p_0[1] = [0.0, 0.05, -1.0];
    tank
}

fn error(share: f64, exchange: Exchange, order: Order, h: f64) -> f64 {
    let mut tank = Tank { zeta: [0.05; 3], damping_law: DampingLaw::Constant, ..Tank::default() };
    tank.p_0[0] = [0.1, 0.05, -1.0];
    error_of(share, tank, exchange, order, h)
}

/// Returns the error of a coupling over 20 s: the largest difference between the rates of the coupled craft and of the craft
/// as one FMU, relative to the latter. `share` is the mass of the body divided by the mass of the default craft, and `h` the
/// communication step, s.
fn error_of(share: f64, tank: Tank, exchange: Exchange, order: Order, h: f64) -> f64 {
    let p = parameters(share, tank);
    let mut pair = Pair::new(&p, exchange, order);
    let u = Inputs { force: Ramp::held([0.0, 0.0, THRUST]), ..Inputs::default() };
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-12).unwrap();
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    for _ in 0..(20.0 / h) as usize {
        pair.step(h);
        craft.step(&u, h).unwrap();
        let x = craft.continuous_states();
        let w = Vector3::from_column_slice(&x[index::OMEGA..index::OMEGA + 3]);
        worst = worst.max((w - pair.w).norm());
        largest = largest.max(w.norm());
    }
    worst / largest
}

/// Exchanged values that are constant within a step converge with first order, and linearly extrapolated values with second
/// order. The exchange of the total force converges only for the heavier body, and with first order. With the constant
/// matrix a part of the force is still delayed, so that an error of first order becomes visible when the error of second
/// order is small.
#[test]
fn each_coupling_of_tank_and_craft_converges_with_its_order() {
    use Exchange::*;
    for (share, exchange, order, expected) in [
        (1.0, Split, GaussSeidelHeld, 1.0),
        (1.0, Split, JacobiHeld, 1.0),
        (1.0, Split, GaussSeidelLinear, 2.0),
        (1.0, Split, Repeated, 2.0),
        (LIGHT, Split, GaussSeidelHeld, 1.0),
        (LIGHT, Split, JacobiHeld, 1.0),
        (LIGHT, Split, GaussSeidelLinear, 2.0),
        (LIGHT, Split, Repeated, 2.0),
        (1.0, Constant, GaussSeidelHeld, 1.0),
        (1.0, Constant, JacobiHeld, 1.0),
        (1.0, Constant, GaussSeidelLinear, 2.0),
        (1.0, Total, GaussSeidelHeld, 1.0),
        (1.0, Total, JacobiHeld, 1.0),
    ] {
        let [coarse, fine] = [0.02, 0.005].map(|h| error(share, exchange, order, h));
        let got = f64::log2(coarse / fine) / 2.0;
        println!("{share:.2} {exchange:?} {order:?}: {coarse:.1e} {fine:.1e} order {got:.2}");
        assert!(
            (got - expected).abs() < 0.2,
            "{share} {exchange:?} {order:?}: {coarse:e} {fine:e} order {got}"
        );
    }
}

/// The liquid in the box moves along both horizontal axes, and its fixed mass is below 0. In lumped coupling the modes of a
/// box count twice, so that a larger share of the force is one step late. Exchanged values that are constant within a step
/// then remove more damping: with an added mass of 8 times the body's mass and steps of 20 ms the simulation diverges.
/// Linearly extrapolated values do not diverge.
#[test]
fn lumped_coupling_of_planar_modes_converges_to_the_craft() {
    let lambda = ratio(box_tank());
    for target in [0.3, 1.3, 6.0] {
        for exchange in [Exchange::Split, Exchange::Lumped, Exchange::RigidBody] {
            for (order, allowed) in [(GaussSeidelHeld, 0.15), (GaussSeidelLinear, 0.01)] {
                if order == GaussSeidelHeld && target == 6.0 {
                    continue;
                }
                let [coarse, fine] = [0.02, 0.005]
                    .map(|h| error_of(lambda / target, box_tank(), exchange, order, h));
                let got = f64::log2(coarse / fine) / 2.0;
                println!(
                    "lambda {target} {exchange:?} {order:?}: {coarse:.1e} {fine:.1e} order {got:.2}"
                );
                assert!(got > 0.8 && fine < allowed, "{target}: {coarse:e} {fine:e}");
            }
        }
    }
}

/// The FMU's constant lumped matrix is added to the equations of the body, or it is a part of the body itself. The body also
/// receives the rest of the tank's force, the bias. The tests cover added masses up to 6 times the mass of the body.
#[test]
fn lumped_coupling_is_stable_and_converges_up_to_six_times_the_mass_of_the_body() {
    let lambda = ratio(Tank::default());
    for target in [0.3, 1.3, 6.0] {
        for exchange in [Exchange::Lumped, Exchange::RigidBody] {
            for (order, allowed) in [(GaussSeidelHeld, 0.06), (GaussSeidelLinear, 0.004)] {
                let [coarse, fine] =
                    [0.02, 0.005].map(|h| error(lambda / target, exchange, order, h));
                let got = f64::log2(coarse / fine) / 2.0;
                println!("lambda {target} {exchange:?}: {coarse:.1e} {fine:.1e} order {got:.2}");
                assert!(got > 0.8 && fine < allowed, "{target}: {coarse:e} {fine:e}");
            }
        }
    }
}
