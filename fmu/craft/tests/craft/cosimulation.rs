//! A tank hung on somebody else's rigid body, exchanging signals once per communication step H.
//!
//! lambda: largest eigenvalue of M_body^-1 M_a. w_0, w_p: slosh frequency with the body held, with
//! the body free. Of the total wrench, which contains -M_a [a; w'], a delayed copy makes
//!
//! ```text
//! Gauss-Seidel (body first), forces held                 z + lambda = 0             lambda < 1
//! Gauss-Seidel, forces extrapolated linearly             z^2 + 2 lambda z - lambda = 0     1/3
//! Jacobi, both extrapolate                               z^4 + lambda (2 z - 1)^2 = 0   0.1547
//! ```
//!
//! whatever H. With added mass and bias split there is no such loop; held values then give the
//! slosh mode a growth of (w_p^2 - w_0^2) H/4, thrice that in Jacobi's order.
//!
//! Source: the recurrences follow from one eigendirection of the exchange; delays of the
//! restoring force by H/2 and 3 H/2 give the growth.

use craft::{
    Coupling, Craft, Inertia, Inputs, Parameters, Ramp, SloshTank, SloshTankOutputs, Spacecraft,
    Tank, TankInputs, TankParameters, index,
};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

const THRUST: f64 = 2400.0;

/// What the body is given about the tank.
#[derive(Clone, Copy, PartialEq)]
enum Exchange {
    Total,
    Split,
    Lumped,
}

/// How it goes on from there within a step, and who moves first.
#[derive(Clone, Copy, PartialEq)]
enum Order {
    GaussSeidelHeld,
    GaussSeidelLinear,
    JacobiHeld,
    JacobiLinear,
}
use Order::*;

/// A rigid body under thrust along z with a tank; its rate is all that matters to the tank.
struct Pair {
    mass_matrix: Matrix6<f64>,
    moment: Vector3<f64>,
    inertia: Matrix3<f64>,
    tank: SloshTank,
    exchange: Exchange,
    order: Order,
    w: Vector3<f64>,
    /// [a; w'] at the last two communication points.
    x: [Vector6<f64>; 2],
    /// The tank's matrix and right-hand side there.
    given: [(Matrix6<f64>, Vector6<f64>); 2],
}

fn symmetric(triangle: &[f64]) -> Matrix6<f64> {
    let mut m = Matrix6::zeros();
    let places = (0..6).flat_map(|i| (i..6).map(move |j| (i, j)));
    for ((i, j), x) in places.zip(triangle) {
        (m[(i, j)], m[(j, i)]) = (*x, *x);
    }
    m
}

/// The 1180 kg body of the tests, its mass properties times `share`, and its tank.
fn parameters(share: f64, tank: Tank) -> Parameters {
    let j = Inertia { xx: 860.0, yy: 860.0, zz: 640.0, xy: 0.0, xz: 0.0, yz: 0.0 };
    let scaled = Inertia { xx: share * j.xx, yy: share * j.yy, zz: share * j.zz, ..j };
    let mut p = Parameters::default();
    p.craft = Craft { mass: 1180.0 * share, j: scaled, ..p.craft };
    p.tank[0] = tank;
    p
}

/// lambda of [`parameters`] at share 1.
fn ratio(tank: Tank) -> f64 {
    let host = Some(parameters(1.0, tank).craft);
    let p = TankParameters { tank, host, ..TankParameters::default() };
    SloshTank::new(&p, &TankInputs::default(), 0.0, 1e-9).unwrap().coupling_ratio().unwrap()
}

impl Pair {
    fn new(p: &Parameters, exchange: Exchange, order: Order) -> Pair {
        let coupling =
            if exchange == Exchange::Lumped { Coupling::Lumped } else { Coupling::Split };
        let own = TankParameters { tank: p.tank[0], coupling, host: None };
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
        // It starts with the acceleration that the craft as a whole has.
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
        };
        let given = pair.look(&pair.input([x, x], 1.0));
        pair.given = [given, given];
        pair
    }

    /// The tank's input over a step at whose ends [a; w'] has the given values.
    fn input(&self, [from, to]: [Vector6<f64>; 2], h: f64) -> TankInputs {
        let ramp = |at: usize| Ramp {
            value: [from[at], from[at + 1], from[at + 2]],
            slope: [0, 1, 2].map(|i| (to[at + i] - from[at + i]) / h),
        };
        TankInputs { a: ramp(0), omega: self.w.into(), omega_dot: ramp(3) }
    }

    /// What the body solves with: (M_body + matrix) x = rest + right-hand side.
    fn look(&mut self, u: &TankInputs) -> (Matrix6<f64>, Vector6<f64>) {
        let SloshTankOutputs { tank, bias, added_mass, .. } = self.tank.outputs(u);
        match self.exchange {
            Exchange::Total => {
                let wrench = [tank.force, tank.torque].concat();
                (Matrix6::zeros(), Vector6::from_column_slice(&wrench))
            }
            _ => (symmetric(&added_mass), Vector6::from_column_slice(&bias)),
        }
    }

    fn acceleration(
        &self,
        w: Vector3<f64>,
        matrix: &Matrix6<f64>,
        rhs: &Vector6<f64>,
    ) -> Vector6<f64> {
        let force = Vector3::new(0.0, 0.0, THRUST) - w.cross(&w.cross(&self.moment));
        let torque = -w.cross(&(self.inertia * w));
        let mut rest = *rhs;
        for i in 0..3 {
            rest[i] += force[i];
            rest[3 + i] += torque[i];
        }
        (self.mass_matrix + matrix).lu().solve(&rest).unwrap()
    }

    fn step(&mut self, h: f64) {
        let linear = matches!(self.order, GaussSeidelLinear | JacobiLinear);
        let [last, now] = self.given;
        let at = |share: f64| {
            let share = if linear { share } else { 0.0 };
            (now.0 + (now.0 - last.0) * share, now.1 + (now.1 - last.1) * share)
        };
        // The body's step: Runge-Kutta on its rate.
        let rate = |share: f64, w: Vector3<f64>| {
            let (matrix, rhs) = at(share);
            let x = self.acceleration(w, &matrix, &rhs);
            (x, Vector3::new(x[3], x[4], x[5]))
        };
        let (from, k1) = rate(0.0, self.w);
        let (_, k2) = rate(0.5, self.w + k1 * (h / 2.0));
        let (_, k3) = rate(0.5, self.w + k2 * (h / 2.0));
        let (_, k4) = rate(1.0, self.w + k3 * h);
        let w = self.w + (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
        let (to, _) = rate(1.0, w);
        // The tank's step, from the same rate.
        let ends = match self.order {
            GaussSeidelHeld => [from, from],
            GaussSeidelLinear => [from, to],
            JacobiHeld => [self.x[1], self.x[1]],
            JacobiLinear => [self.x[1], self.x[1] * 2.0 - self.x[0]],
        };
        let u = self.input(ends, h);
        self.tank.step(&u, h).unwrap();
        self.w = w;
        // Its output at the end, by what it was given.
        let end = self.input([ends[1], ends[1]], h);
        self.given = [now, self.look(&end)];
        self.x =
            [self.x[1], if matches!(self.order, GaussSeidelHeld | JacobiHeld) { from } else { to }];
    }

    /// p_x, p_x' of the bob.
    fn slosh(&self) -> [f64; 2] {
        let x = self.tank.continuous_states();
        [x[0], x[3]]
    }
}

/// Whether a disturbance of 1e-6 of the wrench grows some ten thousand times within 1500 steps.
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

/// Within 3 % of the limits on either side, at both steps.
#[test]
fn total_wrench_diverges_above_the_limits_of_lambda_whatever_the_step() {
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

/// The rate at which the slosh amplitude grows between 10 s and 60 s.
fn growth(share: f64, order: Order, h: f64) -> (f64, f64) {
    let mut tank = Tank { zeta: [0.0; 3], ..Tank::default() };
    tank.p_0[0] = [0.01, 0.0, -1.0];
    let p = parameters(share, tank);
    // w_p^2, w_0^2 by the closed forms for one tank on the axis.
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
    let size = |pair: &Pair| {
        let [p, p_d] = pair.slosh();
        f64::hypot(p, p_d / f64::sqrt(w_p_2))
    };
    // Peaks of the amplitude over a period average out what the delay makes of the phase.
    let mut means = [0.0; 2];
    let steps = |t: f64| (t / h).round() as usize;
    let period = std::f64::consts::TAU / f64::sqrt(w_p_2);
    for k in 0..steps(60.0 + period) {
        pair.step(h);
        for (mean, begin) in means.iter_mut().zip([10.0, 60.0]) {
            if k >= steps(begin) && k < steps(begin + period) {
                *mean += size(&pair) * h / period;
            }
        }
    }
    (f64::ln(means[1] / means[0]) / 50.0, (w_p_2 - w_0_2) * h / 4.0)
}

#[test]
fn held_values_of_the_split_make_the_slosh_mode_grow_as_their_delay_says() {
    for (share, h) in [(1.0, 0.02), (1.0, 0.05), (300.0 / 1180.0, 0.02)] {
        let (got, formula) = growth(share, GaussSeidelHeld, h);
        assert!((got / formula - 1.0).abs() < 0.05, "{share} {h}: {got} {formula}");
        let (got, formula) = growth(share, JacobiHeld, h);
        assert!((got / (3.0 * formula) - 1.0).abs() < 0.05, "{share} {h}: {got} 3 x {formula}");
    }
}

/// Largest difference of the rate to that of the craft as a whole over 20 s, relative.
fn error(share: f64, exchange: Exchange, order: Order, h: f64) -> f64 {
    let mut tank = Tank { zeta: [0.05; 3], ..Tank::default() };
    tank.p_0[0] = [0.1, 0.05, -1.0];
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

/// Held: first order; extrapolated linearly: second.
#[test]
fn split_coupling_converges_with_its_order_at_any_mass_ratio() {
    for share in [1.0, 300.0 / 1180.0] {
        for (order, expected) in
            [(GaussSeidelHeld, 1.0), (JacobiHeld, 1.0), (GaussSeidelLinear, 2.0)]
        {
            let [coarse, fine] = [0.02, 0.005].map(|h| error(share, Exchange::Split, order, h));
            let got = f64::log2(coarse / fine) / 2.0;
            println!("{share:.2}: {coarse:.1e} {fine:.1e} order {got:.2}");
            assert!((got - expected).abs() < 0.2, "{share}: {coarse:e} {fine:e} order {got}");
        }
    }
}

/// For a body that is plain and rigid: the lumped matrix on its side, bias^ from outside. Stable
/// at any mass ratio, and of first order at least.
#[test]
fn lumped_coupling_is_stable_and_converges_up_to_lambda_6() {
    let lambda = ratio(Tank::default());
    for target in [0.3, 1.3, 6.0] {
        for (order, allowed) in [(GaussSeidelHeld, 0.06), (GaussSeidelLinear, 0.004)] {
            let [coarse, fine] =
                [0.02, 0.005].map(|h| error(lambda / target, Exchange::Lumped, order, h));
            let got = f64::log2(coarse / fine) / 2.0;
            println!("lambda {target}: {coarse:.1e} {fine:.1e} order {got:.2}");
            assert!(got > 0.8 && fine < allowed, "{target}: {coarse:e} {fine:e}");
        }
    }
}
