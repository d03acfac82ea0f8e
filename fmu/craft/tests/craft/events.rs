//! Events of detached liquid: impacts, release and settling come at the same instants whoever integrates and however long the
//! steps are.
//!
//! The reference is a simulator in maximal coordinates: the craft is a rigid body, the detached liquid is a point mass, and the
//! wall is a constraint with a Lagrange multiplier. The integrator is an extrapolation method of order 10, and events are located by
//! bisection.

use craft::{Inputs, Parameters, Ramp, Spacecraft, index};
use nalgebra::{DMatrix, DVector, Matrix3, Quaternion, UnitQuaternion};

use super::ball::{V, askew, rotation, shape, v, wall};
use super::random::Random;

/// A craft, the force and torque that act on it, and how long the motion lasts, s.
struct Case {
    p: Parameters,
    u: Inputs,
    end: f64,
}

/// One tank of any size; a thrust between 0.02 and 0.5 m/s2 that takes the liquid from its bottom.
fn case(seed: u64) -> Case {
    let mut random = Random::new(seed);
    let mut p = Parameters { tanks: 1, ..askew(&mut random) };
    p.init.omega = random.vector(0.05);
    // At the bottom the liquid's centre is on the wall.
    if random.below(2) == 0 {
        p.tank[0].p_0 = [[0.0, 0.0, -1.0]; craft::MODES];
    }
    let tank = &mut p.tank[0];
    tank.q = random.vector(1.0);
    tank.k = [0.0; craft::MODES];
    let bobs = || 0..tank.modes;
    let mass = tank.m_0 + bobs().map(|n| tank.mass[n]).sum::<f64>();
    let swing = bobs().map(|n| tank.mass[n] * tank.length[n]).sum::<f64>() / mass;
    let half = swing * random.magnitude(1.5, 6.0);
    tank.ball.travel = 2.0 * half;
    tank.ball.radius = [0.0, half * random.between(1.0, 1.5)][random.below(2)];
    tank.ball.restitution = random.between(0.1, 0.9);
    tank.ball.contact_speed = random.magnitude(1e-3, 0.05);
    tank.ball.drag = [0.0, random.magnitude(0.01, 1.0)][random.below(2)];
    let acceleration = random.magnitude(0.02, 0.5);
    let down = rotation(&tank.q) * V::new(0.0, 0.0, -1.0);
    let force = (down + v(&random.vector::<3>(0.7))) * (acceleration * p.craft.mass);
    let torque: [f64; 3] = random.vector(0.02 * acceleration * p.craft.mass);
    let u = Inputs {
        force: Ramp::held([force.x, force.y, force.z]),
        torque: Ramp::held(torque),
        ..Inputs::default()
    };
    // Some two to five crossings.
    let end = random.between(2.0, 5.0) * f64::sqrt(4.0 * half / acceleration);
    Case { p, u, end }
}

/// Centre of mass of the dry craft and its velocity, attitude, rate (body axes), the liquid's centre and its velocity, energy dissipated.
/// Inertial axes.
type Coordinates = [f64; 20];

const PLACE: usize = 0;
const VELOCITY: usize = 3;
const Q: usize = 6;
const W: usize = 10;
const PARTICLE: usize = 13;
const SPEED: usize = 16;
const DISSIPATED: usize = 19;

fn put(y: &mut Coordinates, at: usize, x: V) {
    y[at..at + 3].copy_from_slice(x.as_slice());
}

fn attitude(y: &Coordinates) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(y[Q], y[Q + 1], y[Q + 2], y[Q + 3]))
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Mode {
    Flying,
    /// On the wall with its drag, and without.
    Sliding,
    Light,
}

/// What the liquid's centre does in the tank, body axes: from the wall's centre, its rate, the gradient D x, and f.
struct InTank {
    x: V,
    rate: V,
    gradient: V,
    f: f64,
}

struct Simulator<'a> {
    case: &'a Case,
    inertia: Matrix3<f64>,
    d: Matrix3<f64>,
    /// The wall's centre from the craft's centre of mass, body axes.
    center: V,
    mass: f64,
    y: Coordinates,
    mode: Mode,
    t: f64,
    impacts: usize,
}

impl Simulator<'_> {
    /// The liquid has just left the bottom of its tank, at rest against it.
    fn new(case: &Case) -> Simulator<'_> {
        let Case { p, u, .. } = case;
        let x = Spacecraft::new(p, u, 0.0, 1e-12).unwrap().continuous_states();
        let (height, semi, mass) = wall(p, 0);
        let axes = rotation(&p.tank[0].q);
        let m = *axes.matrix();
        let d = m * Matrix3::from_diagonal(&semi.map(|r| 1.0 / (r * r))) * m.transpose();
        let j = p.craft.j.matrix();
        let inertia = Matrix3::from_fn(|i, k| j[i][k]) + shape(p, 0, &x);
        let origin = v(&p.tank[0].position) - v(&p.craft.r);
        let center = origin + axes * (V::z() * height);
        // The common centre of rigid liquid and bobs.
        let tank = &p.tank[0];
        let bobs = (0..tank.modes).map(|n| {
            let at = V::z() * tank.hinge[n] + v(&x[index::bob(0, n)..]) * tank.length[n];
            at * tank.mass[n]
        });
        let liquid = bobs.fold(V::z() * (tank.m_0 * tank.h_0), |sum, at| sum + at) / mass;
        let liquid = origin + axes * liquid;
        let mut y = [0.0; 20];
        y[Q..Q + 4].copy_from_slice(&x[index::Q..index::Q + 4]);
        let (q, w) = (attitude(&y), v(&x[index::OMEGA..]));
        let velocity = v(&x[index::VELOCITY..]) + q * w.cross(&v(&p.craft.r));
        let place = v(&x[index::POSITION..]) + q * v(&p.craft.r);
        put(&mut y, PLACE, place);
        put(&mut y, VELOCITY, velocity);
        put(&mut y, W, w);
        put(&mut y, PARTICLE, place + q * liquid);
        put(&mut y, SPEED, velocity + q * w.cross(&liquid));
        let mode = Mode::Flying;
        Simulator { case, inertia, d, center, mass, y, mode, t: 0.0, impacts: 0 }
    }

    fn in_tank(&self, y: &Coordinates) -> InTank {
        let (q, w) = (attitude(y).inverse(), v(&y[W..]));
        let arm = q * (v(&y[PARTICLE..]) - v(&y[PLACE..]));
        let rate = q * (v(&y[SPEED..]) - v(&y[VELOCITY..])) - w.cross(&arm);
        let x = arm - self.center;
        let gradient = self.d * x;
        InTank { x, rate, gradient, f: 1.0 - x.dot(&gradient) }
    }

    /// y' and the force with which the liquid presses on the wall, N, by a system of 10 equations on the wall.
    fn rates(&self, y: &Coordinates, mode: Mode) -> (Coordinates, f64) {
        let (q, w) = (attitude(y), v(&y[W..]));
        let Parameters { craft, tank, .. } = &self.case.p;
        let (force, torque) = (v(&self.case.u.force.value), v(&self.case.u.torque.value));
        let torque = torque - v(&craft.r).cross(&force) - w.cross(&(self.inertia * w));
        let InTank { x, rate, gradient, .. } = self.in_tank(y);
        let arm = x + self.center;
        // Accelerations of craft and liquid in body axes.
        let (mut a, mut w_d, mut a_l, mut press) =
            (force / craft.mass, V::zeros(), V::zeros(), 0.0);
        let drag = if mode == Mode::Sliding { tank[0].ball.drag * self.mass } else { 0.0 };
        if mode == Mode::Flying {
            w_d = self.inertia.try_inverse().unwrap() * torque;
        } else {
            let n = gradient.normalize();
            let mut matrix = DMatrix::<f64>::zeros(10, 10);
            let mut right = DVector::<f64>::zeros(10);
            for i in 0..3 {
                matrix[(i, i)] = craft.mass;
                matrix[(6 + i, 6 + i)] = self.mass;
                (matrix[(i, 9)], matrix[(6 + i, 9)]) = (-n[i], n[i]);
                matrix[(3 + i, 9)] = -arm.cross(&n)[i];
                (matrix[(9, i)], matrix[(9, 6 + i)]) = (-n[i], n[i]);
                matrix[(9, 3 + i)] = -arm.cross(&n)[i];
                for k in 0..3 {
                    matrix[(3 + i, 3 + k)] = self.inertia[(i, k)];
                }
                right[i] = force[i] + drag * rate[i];
                right[3 + i] = torque[i] + drag * arm.cross(&rate)[i];
                right[6 + i] = -drag * rate[i];
            }
            // x'' = a_l - a - w' x arm - 2 w x x' - w x (w x arm), and x'.D x' + x.D x'' = 0.
            let turning = w.cross(&rate) * 2.0 + w.cross(&w.cross(&arm));
            right[9] = n.dot(&turning) - rate.dot(&(self.d * rate)) / gradient.norm();
            let solved = matrix.lu().solve(&right).unwrap();
            a = V::new(solved[0], solved[1], solved[2]);
            w_d = V::new(solved[3], solved[4], solved[5]);
            a_l = V::new(solved[6], solved[7], solved[8]);
            press = solved[9];
        }
        let q_d = q.into_inner() * Quaternion::from_parts(0.0, w) * 0.5;
        let mut rates = [0.0; 20];
        put(&mut rates, PLACE, v(&y[VELOCITY..]));
        put(&mut rates, VELOCITY, q * a);
        rates[Q..Q + 4].copy_from_slice(&[q_d.w, q_d.i, q_d.j, q_d.k]);
        put(&mut rates, W, w_d);
        put(&mut rates, PARTICLE, v(&y[SPEED..]));
        put(&mut rates, SPEED, q * a_l);
        rates[DISSIPATED] = drag * rate.norm_squared();
        (rates, press)
    }

    /// The motion `h` later, by the modified midpoint rule with 2, 4, ... 10 steps and extrapolation to none.
    fn moved(&self, h: f64) -> Coordinates {
        let plus = |y: &Coordinates, r: &Coordinates, h: f64| -> Coordinates {
            std::array::from_fn(|i| y[i] + h * r[i])
        };
        let first = self.rates(&self.y, self.mode).0;
        let mut table: Vec<Coordinates> = Vec::new();
        for k in 0..5 {
            let steps = 2 * (k + 1);
            let small = h / steps as f64;
            let (mut before, mut now) = (self.y, plus(&self.y, &first, small));
            for _ in 1..steps {
                let next = plus(&before, &self.rates(&now, self.mode).0, 2.0 * small);
                (before, now) = (now, next);
            }
            table.push(std::array::from_fn(|i| {
                let end = self.rates(&now, self.mode).0[i];
                (now[i] + before[i] + small * end) / 2.0
            }));
            for j in (0..k).rev() {
                let ratio = (steps as f64 / (2 * (j + 1)) as f64).powi(2);
                let finer = table[j + 1];
                let coarser = table[j];
                table[j] =
                    std::array::from_fn(|i| finer[i] + (finer[i] - coarser[i]) / (ratio - 1.0));
            }
        }
        let mut y = table[0];
        let q = attitude(&y).into_inner();
        y[Q..Q + 4].copy_from_slice(&[q.w, q.i, q.j, q.k]);
        y
    }

    /// Positive until the liquid meets the wall from inside, is released, or is pressed enough for its drag.
    fn distance_to_event(&self, y: &Coordinates) -> f64 {
        let InTank { rate, gradient, f, .. } = self.in_tank(y);
        match self.mode {
            // Next to the wall and on its way inwards it has met it already.
            Mode::Flying if f < 1e-9 && gradient.dot(&rate) < 0.0 => 1.0,
            Mode::Flying => f,
            Mode::Sliding => self.rates(y, self.mode).1,
            Mode::Light => {
                let press = self.rates(y, self.mode).1;
                press.min(self.twice_the_drag(y) - press)
            }
        }
    }

    fn twice_the_drag(&self, y: &Coordinates) -> f64 {
        2.0 * self.mass * self.case.p.tank[0].ball.drag * self.in_tank(y).rate.norm()
    }

    /// Goes on to the time `end`, with steps of at most 20 ms.
    fn go(&mut self, end: f64) {
        while self.t < end {
            let h = (end - self.t).min(0.02);
            let mut past = self.moved(h);
            let (mut low, mut high) = (0.0, h);
            if self.mode == Mode::Flying {
                // Within the step the liquid may have met the wall and come back: f has a minimum where its slope is 0.
                let outwards = |y: &Coordinates| {
                    let InTank { rate, gradient, .. } = self.in_tank(y);
                    rate.dot(&gradient) > 0.0
                };
                if outwards(&self.y) && !outwards(&past) {
                    let (mut before, mut after) = (0.0, h);
                    for _ in 0..50 {
                        let middle = (before + after) / 2.0;
                        if outwards(&self.moved(middle)) { before = middle } else { after = middle }
                    }
                    let nearest = self.moved(before);
                    if self.in_tank(&nearest).f < 0.0 {
                        (high, past) = (before, nearest);
                    }
                }
            }
            if self.distance_to_event(&past) > 0.0 {
                (self.y, self.t) = (past, if h < 0.02 { end } else { self.t + h });
                self.to_wall();
                continue;
            }
            for _ in 0..60 {
                let middle = (low + high) / 2.0;
                let is_past = self.distance_to_event(&self.moved(middle)) <= 0.0;
                if is_past { high = middle } else { low = middle }
            }
            self.y = self.moved(high);
            self.t += high;
            self.to_wall();
            match self.mode {
                Mode::Flying => self.meet_wall(),
                Mode::Sliding => {
                    self.mode = if self.presses(Mode::Light) { Mode::Light } else { Mode::Flying }
                }
                Mode::Light if self.rates(&self.y, Mode::Light).1 <= 1e-9 * self.mass => {
                    self.mode = Mode::Flying;
                }
                Mode::Light => self.mode = Mode::Sliding,
            }
        }
    }

    fn presses(&self, mode: Mode) -> bool {
        self.rates(&self.y, mode).1 > 0.0
    }

    /// Takes what the integration has left of f and n.x' on the wall.
    fn to_wall(&mut self) {
        if self.mode == Mode::Flying {
            return;
        }
        let q = attitude(&self.y);
        let InTank { x, gradient, .. } = self.in_tank(&self.y);
        let on = x / x.dot(&gradient).sqrt();
        let place = v(&self.y[PARTICLE..]) + q * (on - x);
        put(&mut self.y, PARTICLE, place);
        let InTank { rate, gradient, .. } = self.in_tank(&self.y);
        let n = gradient.normalize();
        let speed = v(&self.y[SPEED..]) - q * (n * n.dot(&rate));
        put(&mut self.y, SPEED, speed);
    }

    fn meet_wall(&mut self) {
        self.impacts += 1;
        assert!(self.impacts < 1_000, "the reference does not end");
        let ball = self.case.p.tank[0].ball;
        let InTank { rate, gradient, .. } = self.in_tank(&self.y);
        let before = self.y;
        if ball.restitution * gradient.normalize().dot(&rate) <= ball.contact_speed {
            self.strike(0.0);
            for mode in [Mode::Sliding, Mode::Light] {
                if self.presses(mode) {
                    self.mode = mode;
                    self.to_wall();
                    return;
                }
            }
            self.y = before;
        }
        self.strike(ball.restitution);
    }

    /// The impulse of two bodies in a point.
    fn strike(&mut self, e: f64) {
        let InTank { x, rate, gradient, .. } = self.in_tank(&self.y);
        let (n, arm, q) = (gradient.normalize(), x + self.center, attitude(&self.y));
        let mass = self.case.p.craft.mass;
        let turned = self.inertia.try_inverse().unwrap() * arm.cross(&n);
        let mu = 1.0 / (1.0 / self.mass + 1.0 / mass + arm.cross(&n).dot(&turned));
        let (approach, y) = (n.dot(&rate), self.y);
        // 1e-12 m/s inwards tell a body that has left the wall from one that is about to meet it.
        let j = mu * ((1.0 + e) * approach + 1e-12);
        put(&mut self.y, SPEED, v(&y[SPEED..]) - q * n * (j / self.mass));
        put(&mut self.y, VELOCITY, v(&y[VELOCITY..]) + q * n * (j / mass));
        put(&mut self.y, W, v(&y[W..]) + turned * j);
        self.y[DISSIPATED] += (1.0 - e * e) * mu * approach * approach / 2.0;
    }

    /// What hosts are compared with: rate, the liquid's place and rate in the tank (tank axes), velocity of O, energy dissipated.
    fn shown(&self) -> Shown {
        let tank = &self.case.p.tank[0];
        let axes = rotation(&tank.q).inverse();
        let (w, r) = (v(&self.y[W..]), v(&self.case.p.craft.r));
        let InTank { x, rate, .. } = self.in_tank(&self.y);
        let place = axes * (x + self.center + r - v(&tank.position));
        let velocity = v(&self.y[VELOCITY..]) - attitude(&self.y) * w.cross(&r);
        [place, axes * rate, w, velocity, V::x() * self.y[DISSIPATED]].map(Into::into)
    }
}

type Shown = [[f64; 3]; 5];

fn shown(craft: &mut Spacecraft, u: &Inputs) -> Shown {
    let out = craft.outputs(u);
    let tank = &out.tank[0];
    let lost = [out.dissipated, 0.0, 0.0];
    [tank.ball_position, tank.ball_velocity, out.omega, out.velocity, lost]
}

/// Largest difference, each quantity over 1 or its size.
fn distance(a: &Shown, b: &Shown) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| (v(a) - v(b)).norm() / (1.0 + v(b).norm())).fold(0.0, f64::max)
}

/// The craft's own motion to the end, with communication steps of length `h`.
fn by_co_simulation(case: &Case, h: f64) -> Shown {
    let Case { p, u, end } = case;
    let mut craft = Spacecraft::new(p, u, 0.0, 1e-12).unwrap();
    let mut left = *end;
    while left > 0.0 {
        craft.step(u, h.min(left)).unwrap();
        left -= h.min(left);
    }
    shown(&mut craft, u)
}

/// The tank of the default craft under a thrust of 1.2 kN that is reversed and slightly askew.
fn default_case() -> Case {
    let mut p = Parameters::default();
    p.tank[0].ball.travel = 0.6;
    let u = Inputs { force: Ramp::held([118.0, 0.0, -1180.0]), ..Inputs::default() };
    Case { p, u, end: 10.0 }
}

/// Before 0.6.0 an impact of case 12 in mid-air made an error of 0.01 with steps of 0.5 s.
#[test]
fn impacts_are_those_of_an_independent_simulator_at_any_communication_step() {
    for (seed, case) in (0..13).map(|seed| (seed, case(seed))).chain([(13, default_case())]) {
        let mut simulator = Simulator::new(&case);
        simulator.go(case.end);
        let want = simulator.shown();
        for h in [0.01, 0.07, 0.5, 1.0, 10.0] {
            let error = distance(&by_co_simulation(&case, h), &want);
            // The tolerance is 1e-12. Each of up to 16 impacts multiplies errors some two to ten times.
            assert!(error < 1e-8, "{seed}, steps of {h} s: {error:e}");
        }
    }
}
