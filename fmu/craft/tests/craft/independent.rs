//! An independent formulation of the same physics: Newton's law of every body, with the tensions of the rods as
//! unknowns. The unknown of a bob is p'' instead of v, there are neither added mass nor power series, and one dense
//! linear system is solved.

use craft::{
    Coupling, DampingLaw, Inputs, MODES, Mount, Parameters, STATES, SloshTank, Spacecraft, Tank,
    TankInputs, TankParameters, index,
};
use nalgebra::{DMatrix, DVector, Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use super::random::Random;
use super::records;

type V = Vector3<f64>;

fn v(x: &[f64]) -> V {
    V::new(x[0], x[1], x[2])
}

fn rotation(q: &[f64]) -> Rotation3<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3])).into()
}

struct Solution {
    a: V,
    w_d: V,
    /// p'' of each bob in tank axes, eta'' of each appendage mode, and the force and torque of each tank about O.
    p_dd: Vec<V>,
    eta_dd: Vec<f64>,
    wrench: Vec<[V; 2]>,
}

/// Returns mass, centre of mass and inertia about the centre of mass of the dry craft and of each rigid liquid.
fn bodies(p: &Parameters) -> Vec<(f64, V, Matrix3<f64>)> {
    let own = |j: [[f64; 3]; 3]| Matrix3::from_fn(|i, k| j[i][k]);
    let mut bodies = vec![(p.craft.mass, v(&p.craft.r), own(p.craft.j.matrix()))];
    for tank in &p.tank[..p.tanks] {
        let axes = rotation(&tank.q);
        let [xy, xz, yz] = tank.products;
        let (xx, yy) = (tank.i_0, tank.i_0 + tank.di_y);
        let local = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, tank.i_z);
        let s = v(&tank.position) + axes * V::new(tank.r_0[0], tank.r_0[1], tank.h_0);
        bodies.push((tank.m_0, s, axes.matrix() * local * axes.matrix().transpose()));
    }
    bodies
}

/// Returns the unit vector perpendicular to the plane of a planar mode, in tank axes (`None` for other modes), and the
/// position of the mode's hinge relative to the tank's origin.
fn plane(tank: &Tank, n: usize) -> (Option<V>, V) {
    let direction = V::new(tank.direction[n][0], tank.direction[n][1], 0.0);
    let on_axis = V::z() * tank.hinge[n];
    if direction == V::zeros() {
        return (None, on_axis);
    }
    // A momentum along `direction` must have the moment `arm` about the tank's axis. Therefore the line of motion is displaced
    // from the axis by -arm (z x direction).
    let across = V::z().cross(&direction).normalize();
    (Some(across), on_axis - across * tank.arm[n])
}

/// Returns the torque of the craft's pivot, body axes. It is the sum of the torques of damping, of
/// dry friction, and of the springs, which rotate the body's z axis to the inertial z axis.
fn of_pivot(p: &Parameters, x: &[f64; STATES]) -> V {
    let upright = rotation(&x[..4]).inverse() * V::z();
    let pull = V::new(p.pivot.k[1] * upright.x, p.pivot.k[0] * upright.y, 0.0);
    let w = v(&x[index::OMEGA..]);
    let friction = &p.pivot.friction;
    let rubs = V::from_fn(|i, _| {
        let curve = friction.c[i] + friction.d[i] * f64::exp(-(w[i] / friction.omega_s).powi(2));
        curve * (w[i] / friction.eps).tanh()
    });
    upright.cross(&pull) - v(&p.pivot.c).component_mul(&w) - rubs
}

/// Returns [a; w'] of craft and liquids at rest as one rigid body, computed about its centre of mass; body axes.
fn rigid_motion(p: &Parameters, x: &[f64; STATES], u: &Inputs) -> [V; 2] {
    let w = v(&x[index::OMEGA..]);
    let mut all = bodies(p);
    for tank in &p.tank[..p.tanks] {
        let axes = rotation(&tank.q);
        for n in 0..tank.modes {
            let s = v(&tank.position) + axes * (plane(tank, n).1 - V::z() * tank.length[n]);
            all.push((tank.mass[n], s, Matrix3::zeros()));
        }
    }
    let mass: f64 = all.iter().map(|body| body.0).sum();
    let center = all.iter().fold(V::zeros(), |sum, (m, s, _)| sum + s * *m) / mass;
    let about = |point: V| {
        all.iter().fold(Matrix3::zeros(), |sum, (m, s, j)| {
            let arm = (s - point).cross_matrix();
            sum + j - arm * arm * *m
        })
    };
    let (h, force) = (v(&u.h_wheels.value), v(&u.force.value));
    let torque = v(&u.torque.value) - v(&u.h_wheels.slope) - w.cross(&h);
    if p.mount == Mount::Pivot {
        let a = -(rotation(&x[..4]).inverse() * v(&p.gravity));
        let inertia = about(V::zeros());
        let torque = torque - center.cross(&a) * mass - w.cross(&(inertia * w)) + of_pivot(p, x);
        return [a, inertia.try_inverse().unwrap() * torque];
    }
    let inertia = about(center);
    let torque = torque - center.cross(&force) - w.cross(&(inertia * w));
    let w_d = inertia.try_inverse().unwrap() * torque;
    [force / mass - w_d.cross(&center) - w.cross(&w.cross(&center)), w_d]
}

fn drag(tank: &Tank, n: usize, x: f64, p_z: f64, rate2: f64) -> f64 {
    let (m, l) = (tank.mass[n], tank.length[n]);
    let floor = if tank.g_floor > 0.0 { tank.g_floor } else { 1e-4 * tank.g_ref };
    let root = x.hypot(floor);
    let above = if x > 0.0 { (root + x) / 2.0 } else { floor * floor / 2.0 / (root - x) };
    let w = |g: f64| (g / l + tank.k[n] / m).sqrt();
    let zeta = match tank.damping_law {
        DampingLaw::Laminar => tank.zeta[n] * (w(tank.g_ref) / w(above)).sqrt(),
        DampingLaw::ConstantRatio => tank.zeta[n],
        DampingLaw::Constant => tank.zeta[n] * w(tank.g_ref) / w(above),
    };
    // The square of the angle between p and -z, as a power series in the square of the chord with six terms (`taylor::angle`).
    let chord2: f64 = 2.0 + 2.0 * p_z;
    let squared: f64 = [2.0, 6.0, 20.0, 70.0, 252.0, 924.0]
        .iter()
        .zip(1..)
        .map(|(binomial, n)| 2.0 * chord2.powi(n) / (f64::from(n * n) * binomial))
        .sum();
    let amplitude = (squared + rate2 / w(above).powi(2) + 1e-8).sqrt();
    // Steepness of the wave of each mode in a cylinder, with the zeros xi of J1', k = xi/R and the elevation 2 R/(xi^2 - 1).
    let xi = [1.841183781340659, 5.331442773525033, 8.536316366346286][n];
    let (begins, corner) = (tank.breaking_steepness[n], 0.02);
    let rounded = |x: f64| (x + x.hypot(corner)) / 2.0;
    let steepness = 2.0 * xi / (xi * xi - 1.0) * amplitude;
    let breaking = tank.zeta_breaking[n] * (rounded(steepness - begins) - rounded(-begins));
    2.0 * m * w(above) * (zeta + tank.zeta_amplitude[n] * amplitude + breaking)
}

/// Position x of a bob from its hinge on the surface
///
/// ```text
/// |q|^2 + (x.e - z)^2 = l^2,   z = (kappa - 1) |q|^4/(8 l^3),   q = x - e (e.x)
/// ```
struct Shape {
    at: V,
    rate: V,
    q: V,
    q_d: V,
    /// Derivative of the bob's height z with respect to its squared displacement |q|^2 across the
    /// tank's axis. `bend` is the second derivative.
    slope: f64,
    bend: f64,
    /// Half the gradient of the equation that describes the surface, divided by l. `curving` are
    /// the terms of this equation's second derivative by time that do not contain x''.
    normal: V,
    curving: f64,
}

impl Shape {
    /// Computes position and rate of the bob of mode `n`. `rod` and `rod_d` are the position and
    /// the rate of a pendulum's bob, from the hinge, that has the same displacement q across the
    /// tank's axis `e`.
    fn from_rod(tank: &Tank, n: usize, e: V, rod: V, rod_d: V) -> Shape {
        let l = tank.length[n];
        let across = |x: V| x - e * e.dot(&x);
        let (q, q_d) = (across(rod), across(rod_d));
        let bend = (tank.nonlinear_stiffness[n] - 1.0) / (4.0 * l.powi(3));
        let slope = bend * q.norm_squared();
        let z = slope * q.norm_squared() / 2.0;
        let z_d = slope * 2.0 * q.dot(&q_d);
        let (h, h_d) = (e.dot(&rod), e.dot(&rod_d));
        let mut shape = Shape {
            at: rod + e * z,
            rate: rod_d + e * z_d,
            q,
            q_d,
            slope,
            bend,
            normal: (q + (e - q * (2.0 * slope)) * h) / l,
            curving: 0.0,
        };
        let left = q_d.norm_squared() + h_d * h_d - h * shape.height_dd(V::zeros());
        shape.curving = -left / l;
        shape
    }

    fn height_dd(&self, x_dd: V) -> f64 {
        let rate = 2.0 * self.q.dot(&self.q_d);
        let rate_d = 2.0 * (self.q_d.norm_squared() + self.q.dot(&x_dd));
        self.bend * rate * rate + self.slope * rate_d
    }
}

/// Deliberate errors in the equations. Each of them must be visible in at least one reference record.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mistake {
    Nothing,
    EulerSign,
    EulerLeftOut,
    CoriolisOnce,
    DragWithoutReaction,
    DragAtHinge,
    CentringWithoutReaction,
    CentringAtHinge,
    CentringNotInPull,
    HingeCentrifugalNotInPull,
    RateForVelocityInPull,
    PullAboutTank,
    NoAddedMass,
    RigidLiquidTwice,
    BobsRigidAndSwinging,
    OwnInertiaLeftOut,
    HeightLeftOut,
    DryInertiaAboutO,
    StaticMomentSign,
    GyroscopicWheelsLeftOut,
    WheelTorqueLeftOut,
    WheelsSign,
}
use Mistake::*;

fn solve(p: &Parameters, x: &[f64; STATES], u: &Inputs) -> Solution {
    solve_with(Nothing, p, x, u)
}

fn solve_with(mistake: Mistake, p: &Parameters, x: &[f64; STATES], u: &Inputs) -> Solution {
    let mut p = *p;
    for tank in &mut p.tank[..p.tanks] {
        match mistake {
            RigidLiquidTwice => tank.m_0 *= 2.0,
            BobsRigidAndSwinging => tank.m_0 += tank.mass[..tank.modes].iter().sum::<f64>(),
            OwnInertiaLeftOut => (tank.i_0, tank.i_z) = (0.0, 0.0),
            HeightLeftOut => tank.h_0 = 0.0,
            _ => {}
        }
    }
    let p = &p;
    let wrong = |other: Mistake| mistake == other;
    let unless = |other: Mistake| if mistake == other { 0.0 } else { 1.0 };
    let w = v(&x[index::OMEGA..]);
    let bobs: Vec<(usize, usize)> =
        (0..p.tanks).flat_map(|i| (0..p.tank[i].modes).map(move |n| (i, n))).collect();
    let first = 6 + 5 * bobs.len();
    let size = first + p.appendages;
    let mut m = DMatrix::<f64>::zeros(size, size);
    let mut rhs = DVector::<f64>::zeros(size);
    let put = |m: &mut DMatrix<f64>, i: usize, j: usize, block: Matrix3<f64>| {
        let mut view = m.view_mut((i, j), (3, 3));
        view += block;
    };
    let one = Matrix3::identity();
    let sign = 1.0 - 2.0 * (1.0 - unless(WheelsSign));
    let h = v(&u.h_wheels.value) * sign;
    let mut force = v(&u.force.value);
    let mut torque = v(&u.torque.value)
        - v(&u.h_wheels.slope) * (sign * unless(WheelTorqueLeftOut))
        - w.cross(&h) * unless(GyroscopicWheelsLeftOut);
    let bodies = bodies(p);
    for (i, (mass, s, j)) in bodies.iter().enumerate() {
        let arm = s.cross_matrix();
        let cross = if wrong(StaticMomentSign) { -arm } else { arm };
        let steiner = if i == 0 { unless(DryInertiaAboutO) } else { 1.0 };
        put(&mut m, 0, 0, one * *mass);
        put(&mut m, 0, 3, -cross * *mass);
        put(&mut m, 3, 0, cross * *mass);
        put(&mut m, 3, 3, j - arm * arm * (*mass * steiner));
        let centripetal = w.cross(&w.cross(s)) * *mass;
        force -= centripetal;
        torque -= s.cross(&centripetal) + w.cross(&(j * w));
    }
    let [rigid_a, rigid_w_d] = rigid_motion(p, x, u);
    let mut seen = Vec::new();
    let mut shapes = Vec::new();
    for (b, &(i, n)) in bobs.iter().enumerate() {
        let tank = &p.tank[i];
        let axes = rotation(&tank.q);
        let at = index::bob(i, n);
        let (across, hinge) = plane(tank, n);
        // An importer may set states out of the plane of the mode; only their components in the plane count.
        let flat = |x: V| across.map_or(x, |b| x - b * b.dot(&x));
        let dir = (axes * flat(v(&x[at..]))).normalize();
        let rate = axes * flat(v(&x[at + 3..]));
        let rate = rate - dir * dir.dot(&rate);
        let (e, l, mass) = (axes * V::z(), tank.length[n], tank.mass[n]);
        let hinge = v(&tank.position) + axes * hinge;
        let shape = Shape::from_rod(tank, n, e, dir * l, rate * l);
        let (rho, moved) = (hinge + shape.at, shape.rate / l);
        let perp = dir - e * e.dot(&dir);
        let along = e.dot(&(rigid_a + rigid_w_d.cross(&hinge) + w.cross(&w.cross(&hinge))));
        let c = drag(tank, n, along, e.dot(&dir), rate.norm_squared());
        let (drag, centring) = (moved * (c * l), perp * (tank.k[n] * l));
        let phi = drag + centring;
        let at = 6 + 5 * b;
        // Equations from Newton's law of the bob:
        put(&mut m, at, 0, one * mass);
        let euler = if wrong(EulerSign) { -1.0 } else { unless(EulerLeftOut) };
        put(&mut m, at, 3, -rho.cross_matrix() * (mass * euler));
        put(&mut m, at, at, one * (mass * l));
        for k in 0..3 {
            m[(at + k, at + 3)] = shape.normal[k];
            // Second derivative of the surface's equation, which for a pendulum is |p| = 1:
            m[(at + 3, at + k)] = shape.normal[k];
            // Force of the rod on the craft, and its moment about O:
            let arm = if wrong(PullAboutTank) { rho - v(&tank.position) } else { rho };
            m[(k, at + 3)] = -shape.normal[k] * unless(NoAddedMass);
            m[(3 + k, at + 3)] = -arm.cross(&shape.normal)[k] * unless(NoAddedMass);
        }
        // The internal kinetic energy exerts the force m_i (|q'|^2 + q.q'') q on the bob and the opposite
        // force on the craft.
        let q = perp * l;
        let m_i = mass * (tank.nonlinear_inertia[n] - 1.0) / (l * l);
        let q_d = rate * l - e * (e.dot(&rate) * l);
        let own = q * q.transpose() * (m_i * l);
        put(&mut m, at, at, own);
        put(&mut m, 0, at, -own);
        put(&mut m, 3, at, -rho.cross_matrix() * own);
        let inner = q * (m_i * q_d.norm_squared());
        match across.map(|b| axes * b) {
            // Second derivative of b.p = 0, and the force that keeps the bob in its plane:
            Some(b) => {
                for k in 0..3 {
                    m[(at + k, at + 4)] = b[k];
                    m[(at + 4, at + k)] = b[k];
                    m[(k, at + 4)] = -b[k];
                    m[(3 + k, at + 4)] = -rho.cross(&b)[k];
                }
            }
            None => m[(at + 4, at + 4)] = 1.0,
        }
        let coriolis = if wrong(CoriolisOnce) { l } else { 2.0 * l };
        let inertial = w.cross(&w.cross(&rho)) + w.cross(&moved) * coriolis;
        rhs.rows_mut(at, 3).copy_from(&(-inertial * mass - phi - inner));
        rhs[at + 3] = shape.curving / l;
        force += inner;
        torque += rho.cross(&inner);
        // The following terms add up to the rod's tension at a = w' = 0. With the mistake `NoAddedMass` their sum replaces the
        // unknown tension; each of the mistakes that end with `NotInPull` leaves out one of them.
        let velocity = rate + w.cross(&dir);
        let centrifugal = mass * dir.dot(&w.cross(&w.cross(&hinge)));
        let by_rate = mass * l * velocity.norm_squared();
        let by_centring = tank.k[n] * l * perp.norm_squared();
        let astray = match mistake {
            CentringNotInPull => by_centring,
            HingeCentrifugalNotInPull => centrifugal,
            RateForVelocityInPull => mass * l * rate.norm_squared() - by_rate,
            NoAddedMass => by_rate - centrifugal - by_centring,
            _ => 0.0,
        };
        force += dir * astray;
        torque += rho.cross(&dir) * astray;
        force += drag * unless(DragWithoutReaction) + centring * unless(CentringWithoutReaction);
        let arm = |at_hinge: Mistake| if wrong(at_hinge) { hinge } else { rho };
        torque += arm(DragAtHinge).cross(&drag) * unless(DragWithoutReaction);
        torque += arm(CentringAtHinge).cross(&centring) * unless(CentringWithoutReaction);
        let across = across.map_or(V::zeros(), |b| axes * b);
        seen.push((i, axes, shape.normal, across, rho, phi + inner, own));
        shapes.push((shape, l, e));
    }
    // Newton's law of each appendage mode: its mass moves by y = p eta relative to the craft, measured
    // from the interface point.
    for (j, mode) in p.appendage[..p.appendages].iter().enumerate() {
        let (at, row) = (v(&mode.position), first + j);
        let (along, about) = (v(&mode.participation), v(&mode.participation[3..]));
        let (eta, rate) = (x[index::ETA + j], x[index::ETA_DOT + j]);
        let y = along * eta;
        // y'' relative to inertial axes, and the specific force at the interface point, both without a, w' and eta''.
        let moved = w.cross(&along) * (2.0 * rate) + w.cross(&w.cross(&y));
        let held = w.cross(&w.cross(&at));
        put(&mut m, 0, 3, -y.cross_matrix());
        put(&mut m, 3, 0, y.cross_matrix());
        let both = at.cross_matrix() * y.cross_matrix() + y.cross_matrix() * at.cross_matrix();
        put(&mut m, 3, 3, -both);
        let turned = at.cross(&along) + about;
        for k in 0..3 {
            (m[(k, row)], m[(row, k)]) = (along[k], along[k]);
            (m[(3 + k, row)], m[(row, 3 + k)]) = (turned[k], turned[k]);
        }
        m[(row, row)] = 1.0;
        let omega = std::f64::consts::TAU * mode.frequency;
        rhs[row] = -along.dot(&held) - 2.0 * mode.zeta * omega * rate - omega * omega * eta;
        force -= moved;
        torque -= at.cross(&moved) + y.cross(&held) + w.cross(&about) * rate;
    }
    rhs.rows_mut(0, 3).copy_from(&force);
    rhs.rows_mut(3, 3).copy_from(&torque);
    if p.mount == Mount::Pivot {
        for k in 0..3 {
            m.row_mut(k).fill(0.0);
            m[(k, k)] = 1.0;
        }
        let a = -(rotation(&x[..4]).inverse() * v(&p.gravity));
        rhs.rows_mut(0, 3).copy_from(&a);
        rhs.rows_mut(3, 3).copy_from(&(torque + of_pivot(p, x)));
    }
    let y = m.full_piv_lu().solve(&rhs).unwrap();
    let (a, w_d) = (v(&y.as_slice()[0..]), v(&y.as_slice()[3..]));
    let mut wrench: Vec<[V; 2]> = bodies[1..]
        .iter()
        .map(|(mass, s, j)| {
            let f = -(a + w_d.cross(s) + w.cross(&w.cross(s))) * *mass;
            [f, s.cross(&f) - j * w_d - w.cross(&(j * w))]
        })
        .collect();
    let mut p_dd = Vec::new();
    for (b, (i, axes, dir, across, rho, phi, own)) in seen.iter().enumerate() {
        let at = 6 + 5 * b;
        let (moved, (shape, l, e)) = (v(&y.as_slice()[at..]), &shapes[b]);
        p_dd.push(axes.inverse() * (moved - e * (shape.height_dd(moved * *l) / l)));
        let f = dir * y[at + 3] + across * y[at + 4] + phi + own * moved;
        wrench[*i][0] += f;
        wrench[*i][1] += rho.cross(&f);
    }
    let eta_dd = y.as_slice()[first..].to_vec();
    Solution { a, w_d, p_dd, eta_dd, wrench }
}

/// Returns the derivatives of attitude, angular velocity, directions and rates of directions; all other derivatives are 0.
pub(super) fn newton_rates(p: &Parameters, x: &[f64; STATES], u: &Inputs) -> [f64; STATES] {
    let (now, mut rate) = (solve(p, x, u), [0.0; STATES]);
    let w = &x[index::OMEGA..];
    let turned = Quaternion::new(x[0], x[1], x[2], x[3]) * Quaternion::new(0.0, w[0], w[1], w[2]);
    rate[..4].copy_from_slice(&[turned.w, turned.i, turned.j, turned.k].map(|x| x / 2.0));
    rate[index::OMEGA..][..3].copy_from_slice(now.w_d.as_slice());
    rate[index::ETA..index::ETA_DOT].copy_from_slice(&x[index::ETA_DOT..]);
    rate[index::ETA_DOT..][..p.appendages].copy_from_slice(&now.eta_dd);
    let mut bobs = now.p_dd.iter();
    for i in 0..p.tanks {
        for n in 0..p.tank[i].modes {
            let at = index::bob(i, n);
            rate[at..at + 3].copy_from_slice(&x[at + 3..at + 6]);
            rate[at + 3..at + 6].copy_from_slice(bobs.next().unwrap().as_slice());
        }
    }
    rate
}

fn anywhere(seed: u64) -> (Random, Parameters, [f64; STATES], Inputs) {
    anywhere_with(seed, |_, _| {})
}

fn anywhere_with(
    seed: u64,
    change: impl Fn(&mut Random, &mut Tank),
) -> (Random, Parameters, [f64; STATES], Inputs) {
    let mut random = Random::new(seed);
    let mut p = random.parameters();
    p.tank.iter_mut().for_each(|tank| change(&mut random, tank));
    if seed.is_multiple_of(4) {
        (p.mount, p.init.velocity) = (Mount::Pivot, [0.0; 3]);
        p.pivot = random.pivot();
    }
    let inputs = random.inputs();
    let mut craft = Spacecraft::new(&p, &inputs, 0.0, 1e-9).unwrap();
    let mut x = craft.continuous_states();
    for i in 0..p.tanks {
        for n in 0..p.tank[i].modes {
            let at = index::bob(i, n);
            x[at..at + 3].copy_from_slice(&random.vector::<3>(1.0));
            x[at + 3..at + 6].copy_from_slice(&random.vector::<3>(3.0));
        }
    }
    x[..4].copy_from_slice(&random.vector::<4>(1.0));
    craft.set_continuous_states(&x);
    (random, p, x, inputs)
}

/// Asserts that all elements agree within a tolerance relative to the largest element or to `size`, whichever is larger.
fn assert_close(got: &[f64], want: &[f64], size: f64, tolerance: f64, what: &str) {
    let size = want.iter().fold(size, |size, x| size.max(x.abs()));
    for (i, (got, want)) in got.iter().zip(want).enumerate() {
        assert!((got - want).abs() <= tolerance * size, "{what} [{i}]: {got} {want} of {size}");
    }
}

// Both formulations solve linear systems with a condition number of about 1e3, so that rounding errors are 1e-13 to 1e-12.
const ROUNDING: f64 = 1e-11;

#[test]
fn accelerations_forces_and_torques_follow_newtons_law_with_the_rod_forces_as_unknowns() {
    for seed in 0..300 {
        compare_with_newton(seed, anywhere(seed));
    }
}

/// The tanks have planar modes and modes that swing in every direction; they are not on the spin axis, and their rigid
/// liquid is not axisymmetric. Unknown guiding forces keep each bob on its line of motion. The accelerations equal those
/// of the craft's equations.
#[test]
fn planar_modes_follow_newtons_law_with_the_guiding_forces_as_unknowns() {
    for seed in 0..300 {
        let craft = anywhere_with(seed, Random::make_planar);
        if craft.1.tanks > 0 {
            compare_with_newton(seed, craft);
        }
    }
}

/// Bobs on surfaces other than spheres, some of them confined to a plane, follow Newton's law in which the force of the
/// surface is an unknown.
#[test]
fn bobs_on_surfaces_follow_newtons_law_with_the_surface_as_a_constraint() {
    let mut compared = 0;
    for seed in 0..300 {
        let change = |random: &mut Random, tank: &mut Tank| {
            if seed % 3 == 0 {
                random.make_planar(tank);
            }
            random.bend(tank);
        };
        let craft = anywhere_with(seed, change);
        compared += craft.1.tanks;
        compare_with_newton(seed, craft);
    }
    assert!(compared > 300);
}

#[test]
fn appendages_follow_newtons_law_of_each_mode_with_its_acceleration_as_unknown() {
    for seed in 0..200 {
        let (mut random, mut p, mut x, u) = anywhere_with(seed, |random, tank| {
            if seed % 3 == 1 {
                random.make_planar(tank);
            }
            if seed % 5 == 1 {
                random.bend(tank);
            }
        });
        random.flex(&mut p);
        for (j, mode) in p.appendage[..p.appendages].iter().enumerate() {
            (x[index::ETA + j], x[index::ETA_DOT + j]) = (mode.eta, mode.eta_dot);
        }
        compare_with_newton(seed, (random, p, x, u));
    }
}

fn compare_with_newton(
    seed: u64,
    (mut random, mut p, x, u): (Random, Parameters, [f64; STATES], Inputs),
) {
    if seed.is_multiple_of(2) {
        p.tank.iter_mut().for_each(|tank| random.follow(tank));
    }
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
    craft.set_continuous_states(&x);
    let want = solve(&p, &x, &u);
    let rate = craft.derivatives(&u);
    let out = craft.outputs_held(&u);
    let what = format!("seed {seed}");
    let size = want.a.amax().max(want.w_d.amax());
    assert_close(&out.specific_force, want.a.as_slice(), size, ROUNDING, &what);
    assert_close(&out.omega_dot, want.w_d.as_slice(), size, ROUNDING, &what);
    assert_close(&rate[index::OMEGA..][..3], want.w_d.as_slice(), size, ROUNDING, &what);
    if p.mount == Mount::Free {
        let v_d = rotation(&x[..4]) * want.a;
        assert_close(&rate[index::VELOCITY..][..3], v_d.as_slice(), size, ROUNDING, &what);
    }
    let eta_dd = &rate[index::ETA_DOT..][..p.appendages];
    assert_close(eta_dd, &want.eta_dd, size, ROUNDING, &what);
    assert_eq!(rate[index::ETA..index::ETA_DOT], x[index::ETA_DOT..], "{what}");
    let mut bobs = want.p_dd.iter();
    for i in 0..p.tanks {
        for n in 0..p.tank[i].modes {
            let at = index::bob(i, n) + 3;
            let p_dd = bobs.next().unwrap().as_slice();
            assert_close(&rate[at..at + 3], p_dd, size / p.tank[i].length[n], ROUNDING, &what);
        }
        let [f, tau] = want.wrench[i];
        let size = f.amax();
        assert_close(&out.tank[i].force, f.as_slice(), size, ROUNDING, &what);
        assert_close(&out.tank[i].torque, tau.as_slice(), size, ROUNDING, &what);
    }
}

/// The Newton-Euler equations of the dry craft hold: its mass matrix times [a; w'] equals the inputs plus the forces and
/// torques of all tanks.
#[test]
fn forces_on_the_dry_craft_balance() {
    for seed in 0..300 {
        let (_, mut p, x, u) = anywhere(seed);
        p.mount = Mount::Free;
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
        craft.set_continuous_states(&x);
        let out = craft.outputs_held(&u);
        let (w, w_d, a) = (v(&out.omega), v(&out.omega_dot), v(&out.specific_force));
        let (mass, s, j) = bodies(&p)[0];
        let f = (a + w_d.cross(&s) + w.cross(&w.cross(&s))) * mass;
        let h = v(&u.h_wheels.value);
        let tau = s.cross(&f) + j * w_d + w.cross(&(j * w + h)) + v(&u.h_wheels.slope);
        let f_in = v(&u.force.value) + v(&out.slosh_force);
        let tau_in = v(&u.torque.value) + v(&out.slosh_torque);
        let largest = out.tank.iter().flat_map(|tank| tank.force.iter().chain(&tank.torque));
        let size = largest.fold(f.amax().max(tau.amax()), |size, x| size.max(x.abs()));
        assert_close(f_in.as_slice(), f.as_slice(), size, 1e-12, "force");
        assert_close(tau_in.as_slice(), tau.as_slice(), size, 1e-12, "torque");
        for k in 0..3 {
            let sum: f64 = out.tank.iter().map(|tank| tank.force[k]).sum();
            assert!((sum - out.slosh_force[k]).abs() <= 1e-14 * size);
        }
    }
}

/// Returns a random tank with bobs anywhere on their spheres, and the motion of the body that carries it. Every third tank has no
/// axial symmetry, and in every third tank the bobs move on surfaces other than spheres.
fn tank_anywhere(seed: u64, coupling: Coupling) -> (TankParameters, SloshTank, TankInputs) {
    let mut random = Random::new(seed);
    let mut p = TankParameters { tank: random.tank(), coupling, ..TankParameters::default() };
    if seed % 3 == 2 {
        random.make_planar(&mut p.tank);
    }
    if seed % 3 == 1 {
        random.bend(&mut p.tank);
        // For s < 1 the added mass would not be positive.
        p.tank.nonlinear_inertia = p.tank.nonlinear_inertia.map(|s| s.max(1.0));
    }
    let mut tank = SloshTank::new(&p, &TankInputs::default(), 0.0, 1e-9).unwrap();
    let mut x = tank.continuous_states();
    for n in 0..p.tank.modes {
        x[6 * n..6 * n + 3].copy_from_slice(&random.vector::<3>(1.0));
        x[6 * n + 3..6 * n + 6].copy_from_slice(&random.vector::<3>(3.0));
    }
    tank.set_continuous_states(&x);
    let ramp =
        |random: &mut Random| craft::Ramp { value: random.vector(2.0), slope: random.vector(1.0) };
    let a = ramp(&mut random);
    let u = TankInputs {
        a,
        omega: random.vector(1.0),
        omega_dot: ramp(&mut random),
        ..TankInputs::default()
    };
    (p, tank, u)
}

fn symmetric(triangle: &[f64]) -> DMatrix<f64> {
    let mut m = DMatrix::zeros(6, 6);
    let places = (0..6).flat_map(|i| (i..6).map(move |j| (i, j)));
    for ((i, j), x) in places.zip(triangle) {
        (m[(i, j)], m[(j, i)]) = (*x, *x);
    }
    m
}

fn acceleration(u: &TankInputs) -> DVector<f64> {
    DVector::from_iterator(6, u.a.value.iter().chain(&u.omega_dot.value).copied())
}

/// In each coupling, a SloshTank with random liquid returns the force and torque of the liquid on the body that carries it, and
/// the bias and added mass with which the accelerations of this body can be solved for.
#[test]
fn force_and_torque_equal_bias_minus_added_mass_times_acceleration() {
    for coupling in Coupling::ALL {
        for seed in 0..200 {
            let (p, mut tank, u) = tank_anywhere(seed, coupling);
            let out = tank.outputs(&u);
            let m = symmetric(&out.added_mass);
            let mut left = DVector::from_column_slice(&out.bias) - &m * acceleration(&u);
            if coupling == Coupling::RigidBody {
                // In `RigidBody` the equations of the carrying body include the mass of the liquid, and thereby the terms w x (w
                // x S) and w x (I w).
                let (w, s) = (v(&u.omega), v(&[m[(5, 1)], m[(3, 2)], m[(4, 0)]]));
                let inertia = m.fixed_view::<3, 3>(3, 3);
                let [force, torque] = [w.cross(&w.cross(&s)), w.cross(&(inertia * w))];
                for i in 0..3 {
                    left[i] -= force[i];
                    left[3 + i] -= torque[i];
                }
            }
            let wrench = [out.tank.force, out.tank.torque].concat();
            let size = m.amax() + out.bias.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
            assert_close(left.as_slice(), &wrench, size, 1e-14, "wrench");
            // Both matrices are inertias if the rigid liquid has positive mass.
            let is_body = p.tank.direction[0] == [0.0; 2];
            assert!(!is_body || m.symmetric_eigenvalues().min() > -1e-14 * m.amax());
        }
    }
}

/// Each column of M_a is minus the change of force and torque by one component of [a; w'], with drag that does not depend on
/// [a; w']. Therefore M_a is symmetric.
#[test]
fn added_mass_is_the_derivative_of_force_and_torque_by_acceleration() {
    for seed in 0..50 {
        let (_, mut tank, u) = tank_anywhere(seed, Coupling::Split);
        let m = symmetric(&tank.outputs(&u).added_mass);
        for k in 0..6 {
            let mut du = [0.0; craft::TANK_INPUTS];
            du[if k < 3 { k } else { 3 + k }] = 1.0;
            let d = tank.output_derivatives(&u, &[0.0; craft::TANK_STATES], &du);
            let column: Vec<f64> = d.tank.force.iter().chain(&d.tank.torque).map(|x| -x).collect();
            assert_close(&column, m.column(k).as_slice(), m.amax(), 1e-14, "column");
        }
    }
}

/// The constant added mass of [`Coupling::Lumped`] contains each bob as a point mass at its hinge,
/// and the bobs of planar modes with twice their mass. This matrix minus the true added mass M_a is
/// positive semidefinite for all directions of the bobs, so that an importer's iteration over the
/// remaining algebraic loop converges. With less than twice the mass of planar modes the difference
/// would not be positive semidefinite.
#[test]
fn the_lumped_inertia_matrix_is_constant_and_at_least_the_added_mass() {
    let mut tight = 0;
    for seed in 0..100 {
        let (p, mut split, u) = tank_anywhere(seed, Coupling::Split);
        let lumped = TankParameters { coupling: Coupling::Lumped, ..p };
        let mut lumped = SloshTank::new(&lumped, &u, 0.0, 1e-9).unwrap();
        let constant = lumped.outputs(&u).added_mass;
        lumped.set_continuous_states(&split.continuous_states());
        assert_eq!(lumped.outputs(&u).added_mass, constant);
        let excess = symmetric(&constant) - symmetric(&split.outputs(&u).added_mass);
        assert!(excess.clone().symmetric_eigenvalues().min() > -1e-13 * excess.amax());
        let Some((across, hinge)) = p.tank.modes.checked_sub(1).map(|_| plane(&p.tank, 0)) else {
            continue;
        };
        let Some(b) = across.filter(|_| p.tank.modes == 1) else { continue };
        // The inequality is sharp: for an acceleration along b at the hinge and an angular acceleration about the axis p x
        // b, both sides are equal.
        let axes = rotation(&p.tank.q);
        let x = split.continuous_states();
        let rod = v(&x) - b * b.dot(&v(&x));
        let turn = axes * rod.normalize().cross(&b);
        let l = p.tank.length[0];
        let at = v(&p.tank.position) + axes * hinge;
        // For this acceleration a_P = l b and w' = p x b.
        let a = axes * b * l - turn.cross(&at);
        let equal = DVector::from_iterator(6, a.iter().chain(turn.iter()).copied());
        let left = equal.dot(&(&excess * &equal));
        assert!(left.abs() < 1e-12 * excess.amax() * equal.norm_squared(), "{left}");
        tight += 1;
    }
    assert!(tight > 5);
}

/// A SloshTank that is moved like the tank of a craft, whose motion is computed by Newton's law,
/// has the same force and torque and the same p'' of its bobs as the tank in the craft. The drag
/// does not depend on the acceleration here. Otherwise it would differ, because the craft computes
/// the acceleration from the motion of craft and liquids as one rigid body, and the SloshTank takes
/// it from its inputs.
#[test]
fn a_single_tank_follows_newtons_law() {
    for seed in 0..300 {
        let planar = |random: &mut Random, tank: &mut Tank| {
            if seed % 3 > 0 {
                random.make_planar(tank);
            }
            if seed % 4 > 1 {
                random.bend(tank);
            }
        };
        let (_, p, x, u) = anywhere_with(seed, planar);
        let want = solve(&p, &x, &u);
        let size = want.a.amax().max(want.w_d.amax());
        let mut bobs = want.p_dd.iter();
        for i in 0..p.tanks {
            let own = TankParameters { tank: p.tank[i], ..TankParameters::default() };
            let motion = TankInputs {
                a: craft::Ramp::held(want.a.into()),
                omega: [x[index::OMEGA], x[index::OMEGA + 1], x[index::OMEGA + 2]],
                omega_dot: craft::Ramp::held(want.w_d.into()),
                ..TankInputs::default()
            };
            let mut tank = SloshTank::new(&own, &motion, 0.0, 1e-9).unwrap();
            let mut states = tank.continuous_states();
            states[..6 * MODES].copy_from_slice(&x[index::bob(i, 0)..][..6 * MODES]);
            tank.set_continuous_states(&states);
            let what = format!("seed {seed}, tank {i}");
            let rate = tank.derivatives(&motion);
            for n in 0..p.tank[i].modes {
                let p_dd = bobs.next().unwrap().as_slice();
                let size = size / p.tank[i].length[n];
                assert_close(&rate[6 * n + 3..6 * n + 6], p_dd, size, ROUNDING, &what);
            }
            let (out, [f, tau]) = (tank.outputs(&motion).tank, want.wrench[i]);
            assert_close(&out.force, f.as_slice(), f.amax(), ROUNDING, &what);
            assert_close(&out.torque, tau.as_slice(), f.amax(), ROUNDING, &what);
        }
    }
}

/// The force and torque of a tank in a craft equal the force and torque of a SloshTank that is moved
/// like the craft. The drag does not depend on the acceleration here. Otherwise it would differ, because the
/// craft computes the acceleration from the motion of craft and liquids as one rigid body, and the
/// SloshTank takes it from its inputs.
#[test]
fn a_single_tank_under_the_crafts_motion_moves_as_the_tank_in_the_craft() {
    for seed in 0..100 {
        let (_, p, x, u) = anywhere(seed);
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
        craft.set_continuous_states(&x);
        let (out, rate) = (craft.outputs_held(&u), craft.derivatives(&u));
        for i in 0..p.tanks {
            let own = TankParameters { tank: p.tank[i], ..TankParameters::default() };
            let motion = TankInputs {
                a: craft::Ramp::held(out.specific_force),
                omega: out.omega,
                omega_dot: craft::Ramp::held(out.omega_dot),
                ..TankInputs::default()
            };
            let mut tank = SloshTank::new(&own, &motion, 0.0, 1e-9).unwrap();
            let mut states = tank.continuous_states();
            let at = index::bob(i, 0);
            states[..6 * MODES].copy_from_slice(&x[at..at + 6 * MODES]);
            tank.set_continuous_states(&states);
            let alone = tank.outputs(&motion).tank;
            let size = out.tank[i].force.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
            assert_close(&alone.force, &out.tank[i].force, size, 1e-13, "force");
            assert_close(&alone.torque, &out.tank[i].torque, size, 1e-13, "torque");
            for n in 0..p.tank[i].modes {
                let (got, want) = (tank.derivatives(&motion), &rate[at + 6 * n..][..6]);
                assert_close(&got[6 * n..6 * n + 6], want, 1.0, 1e-13, "bob");
            }
        }
    }
}

/// The hinges of the bobs and the rigid liquid are at the centre of a spherical tank. Without drag, and without
/// inertia of the rigid liquid about its own centre, a rotating sphere cannot rotate its liquid, so that the torque
/// about the centre is 0.
#[test]
fn a_sphere_s_wrench_about_its_centre_vanishes_under_rotation() {
    for seed in 0..50 {
        let mut random = Random::new(seed);
        // Hinges and centre of mass are at the centre of the sphere, which is the tank's origin and O.
        let tank = Tank {
            position: [0.0; 3],
            h_0: 0.0,
            i_0: 0.0,
            i_z: 0.0,
            hinge: [0.0; MODES],
            zeta: [0.0; MODES],
            k: [0.0; MODES],
            ..random.tank()
        };
        let p = TankParameters { tank, ..TankParameters::default() };
        // The tank rotates about its centre, which does not accelerate (a = 0), while the liquid is at rest relative to
        // inertial axes: p' = -w x p in tank axes.
        let w: [f64; 3] = random.vector(1.0);
        let u = TankInputs {
            omega: w,
            omega_dot: craft::Ramp::held(random.vector(3.0)),
            ..TankInputs::default()
        };
        let mut alone = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap();
        let mut x = alone.continuous_states();
        let in_tank = rotation(&tank.q).inverse() * v(&w);
        for n in 0..tank.modes {
            let rate = -in_tank.cross(&v(&x[6 * n..]));
            x[6 * n + 3..6 * n + 6].copy_from_slice(rate.as_slice());
        }
        alone.set_continuous_states(&x);
        let out = alone.outputs(&u).tank;
        let size: f64 = tank.mass.iter().sum::<f64>() + tank.m_0;
        assert_close(&out.force, &[0.0; 3], size, 1e-14, "force");
        assert_close(&out.torque, &[0.0; 3], size, 1e-14, "torque");
        // An acceleration of the tank causes a force, but no torque about the centre.
        let pushed = TankInputs { a: craft::Ramp::held(random.vector(5.0)), ..u };
        let out = alone.outputs(&pushed).tank;
        assert!(v(&out.force).norm() > 1e-3);
        assert_close(&out.torque, &[0.0; 3], size, 1e-14, "torque");
    }
}

#[test]
fn coupling_ratio_is_the_largest_eigenvalue_of_the_added_mass_relative_to_the_host() {
    for seed in 0..50 {
        let mut random = Random::new(seed);
        let host = random.parameters().craft;
        let mut p = TankParameters { tank: random.tank(), host: Some(host), ..Default::default() };
        if seed % 3 == 2 {
            random.make_planar(&mut p.tank);
        }
        if seed % 2 == 1 {
            random.bend(&mut p.tank);
        }
        let u = TankInputs::default();
        let mut tank = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap();
        let m_a = symmetric(&tank.outputs(&u).added_mass);
        let s = v(&host.r).cross_matrix() * host.mass;
        let mut m_host = DMatrix::zeros(6, 6);
        m_host.view_mut((0, 0), (3, 3)).copy_from(&(Matrix3::identity() * host.mass));
        m_host.view_mut((0, 3), (3, 3)).copy_from(&-s);
        m_host.view_mut((3, 0), (3, 3)).copy_from(&s);
        let j = Matrix3::from_fn(|i, k| host.j.matrix()[i][k]);
        m_host.view_mut((3, 3), (3, 3)).copy_from(&(j - s * s / host.mass));
        let product = m_host.try_inverse().unwrap() * m_a;
        let want = product.complex_eigenvalues().iter().map(|x| x.re).fold(0.0, f64::max);
        let got = tank.coupling_ratio().unwrap();
        assert!((got / want - 1.0).abs() < 1e-10, "{got} {want}");
    }
    let mut alone =
        SloshTank::new(&TankParameters::default(), &TankInputs::default(), 0.0, 1e-9).unwrap();
    assert_eq!(alone.coupling_ratio(), None);
}

/// Computes the accelerations a and w' for the states of a record. Returns their largest deviation from the accelerations in
/// the record, relative to the largest acceleration.
fn deviation(mistake: Mistake, record: &serde_json::Value) -> f64 {
    let p = records::parameters(record);
    let samples = &record["samples"];
    let (_, every) = records::steps(record);
    let at = |signal: &str, sample: usize| records::numbers(&samples[signal][sample]);
    let mut worst = 0.0_f64;
    for sample in 0..samples["w"].as_array().unwrap().len() {
        let mut x = [0.0; STATES];
        x[..4].copy_from_slice(&at("q", sample));
        x[index::OMEGA..][..3].copy_from_slice(&at("w", sample));
        let bobs = (0..p.tanks).flat_map(|i| (0..p.tank[i].modes).map(move |n| (i, n)));
        for (b, (i, n)) in bobs.enumerate() {
            let place = index::bob(i, n);
            x[place..place + 3].copy_from_slice(&at("p", sample)[3 * b..3 * b + 3]);
            x[place + 3..place + 6].copy_from_slice(&at("p_dot", sample)[3 * b..3 * b + 3]);
        }
        let u = match sample {
            0 => records::inputs(record, 0),
            _ => records::at_end(&records::inputs(record, sample * every - 1)),
        };
        let got = solve_with(mistake, &p, &x, &u);
        for (got, signal) in [(got.a, "a"), (got.w_d, "w_dot")] {
            let off = (got - v(&at(signal, sample))).amax() / records::largest(record, signal);
            worst = worst.max(if off.is_nan() { f64::INFINITY } else { off });
        }
    }
    worst
}

/// Each typical error in the equations is visible in at least one reference record, even though the accelerations are computed
/// from the states in the record, so that errors do not add up.
#[test]
fn reference_records_catch_typical_mistakes() {
    let all = records::records("craft");
    for record in &all {
        // The states in the records have 14 digits; forces are computed from differences of the states.
        let right = deviation(Nothing, record);
        assert!(right < 1e-11, "{} {right:e}", record["name"]);
    }
    for (mistake, name) in [
        (EulerSign, "free_fall"),
        (EulerLeftOut, "free_fall"),
        (CoriolisOnce, "released"),
        (DragWithoutReaction, "off_axis"),
        (DragAtHinge, "off_axis"),
        (CentringWithoutReaction, "free_fall"),
        (CentringAtHinge, "free_fall"),
        (CentringNotInPull, "free_fall"),
        (HingeCentrifugalNotInPull, "wheels"),
        (RateForVelocityInPull, "released"),
        (PullAboutTank, "off_axis"),
        (NoAddedMass, "axial_pulse"),
        (RigidLiquidTwice, "axial_pulse"),
        (BobsRigidAndSwinging, "axial_pulse"),
        (OwnInertiaLeftOut, "wheels"),
        (HeightLeftOut, "off_axis"),
        (DryInertiaAboutO, "two_tanks"),
        (StaticMomentSign, "no_tank"),
        (GyroscopicWheelsLeftOut, "wheels"),
        (WheelTorqueLeftOut, "wheels"),
        (WheelsSign, "wheels"),
    ] {
        let record = all.iter().find(|record| record["name"] == name).unwrap();
        let off = deviation(mistake, record);
        println!("{mistake:?} in {name}: {off:.1e}");
        assert!(off > 1e-4, "{mistake:?} in {name}: {off:e}");
    }
}
