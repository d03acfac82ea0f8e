//! Tests of tanks that drain.
//!
//! The outflow f leaves at r_out = d + z_out e with the velocity of the tank at this point, so that
//!
//! ```text
//! P' = C (force - f (V + w x r_out))
//! H' = C (r x force + torque - f (r + r_out) x (V + w x r_out))        about the inertial origin
//! P  = C (m V + w x S + S' + f r_out),   m' = -f
//! ```
//!
//! r is the position of O from the inertial origin, and S the first moment of craft and liquid about O.

use craft::{
    Coupling, DampingLaw, INPUTS, Inputs, Line, MODES, Mount, Outputs, POINTS, Parameters, Ramp,
    STATES, TankInputs, TankParameters, index,
};
use nalgebra::{Matrix3, Matrix6, Quaternion, UnitQuaternion, Vector3, Vector6};

use super::component::{SloshTank, Spacecraft};
use super::random::{Random, draining_craft, draining_tank};
use super::records::STEP;
use super::seeds::every_or;

type V = Vector3<f64>;

fn v(x: &[f64]) -> V {
    V::new(x[0], x[1], x[2])
}

fn attitude(q: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]))
}

pub fn after(u: &Inputs, t: f64) -> Inputs {
    let at = |ramp: &Ramp| Ramp { value: ramp.value_at(t), slope: ramp.slope };
    Inputs {
        force: at(&u.force),
        torque: at(&u.torque),
        h_wheels: at(&u.h_wheels),
        mass_flow: u.mass_flow.map(|flow| Line { value: flow.value_at(t), slope: flow.slope }),
    }
}

fn rates(p: &Parameters, u: &Inputs, out: &Outputs) -> [V; 2] {
    let turn = attitude(&out.q);
    let (force, r) = (turn * v(&u.force.value), v(&out.position));
    let (mut momentum, mut angular) = (force, turn * v(&u.torque.value) + r.cross(&force));
    for (tank, flow) in p.tank.iter().zip(&u.mass_flow) {
        let outlet = v(&tank.position) + attitude(&tank.q) * V::new(0.0, 0.0, tank.outlet);
        let speed = v(&out.velocity) + turn * v(&out.omega).cross(&outlet);
        momentum -= speed * flow.value;
        angular -= (r + turn * outlet).cross(&speed) * flow.value;
    }
    [momentum, angular]
}

pub fn momenta(out: &Outputs) -> [V; 2] {
    let center = v(&out.position) + attitude(&out.q) * v(&out.center_of_mass);
    let momentum = v(&out.momentum);
    [momentum, v(&out.angular_momentum) + center.cross(&momentum)]
}

/// For draining tanks with and without modes, the integrals of force and torque over two seconds, by Lobatto's rule with five
/// points, equal the changes of momentum and angular momentum.
#[test]
fn outflowing_liquid_takes_its_momentum_and_angular_momentum_along() {
    let modes =
        [(0, 0), (1, 0), (2, 1), (3, 2), (4, 3), (5, 1), (20, 3), (21, 1), (40, 3), (41, 1)];
    let seeds = every_or(&[0, 3, 21, 41], modes.map(|(seed, _)| seed));
    for (seed, modes) in modes.into_iter().filter(|(seed, _)| seeds.contains(seed)) {
        let (p, u) = draining_craft(seed, modes);
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-13).unwrap();
        let start = momenta(&craft.outputs(&u));
        let mut came_in = [V::zeros(); 2];
        let far = f64::sqrt(3.0 / 7.0) / 2.0;
        let (end, inner, middle) = (1.0 / 20.0, 49.0 / 180.0, 16.0 / 45.0);
        let nodes = [(0.0, end), (0.5 - far, inner), (0.5, middle), (0.5 + far, inner), (1.0, end)];
        let (mut size, mut worst) = ([0.0_f64; 2], [0.0_f64; 2]);
        for k in 0..100 {
            let begin = k as f64 * STEP;
            let mut before = 0.0;
            for (node, weight) in nodes {
                if node > 0.0 {
                    craft.step(&after(&u, begin + before), node * STEP - before).unwrap();
                    before = node * STEP;
                }
                let now = after(&u, begin + before);
                let out = craft.outputs(&now);
                let rates = rates(&p, &now, &out);
                let balance = momenta(&out);
                for i in 0..2 {
                    came_in[i] += rates[i] * (weight * STEP);
                    if node == 1.0 {
                        size[i] = size[i].max(balance[i].norm());
                        worst[i] = worst[i].max((balance[i] - start[i] - came_in[i]).norm());
                    }
                }
            }
        }
        let relative = [worst[0] / size[0], worst[1] / size[1]];
        println!("{seed}: P {:.1e} H {:.1e}", relative[0], relative[1]);
        assert!(relative.iter().all(|x| *x < 1e-12), "{seed} {relative:?}");
    }
}

/// The momentum of the craft is m V + w x S + S' + f r_out (Newton, Euler), with the first moment S
/// about O, the outflow f and the position r_out of the outlet. S' is computed from
/// differences of the centre of mass in the outputs.
#[test]
fn momentum_of_a_draining_craft_includes_the_flow_within_its_tanks() {
    for seed in (0..6).chain(20..23).chain(40..43) {
        let (p, u) = draining_craft(seed, 1 + seed as usize % 3);
        let e = 1e-3;
        let moment = |out: &Outputs| v(&out.center_of_mass) * out.mass;
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-13).unwrap();
        let moments: Vec<(V, Outputs)> = (0..5)
            .map(|k| {
                if k > 0 {
                    craft.step(&after(&u, (k - 1) as f64 * e), e).unwrap();
                }
                let out = craft.outputs(&after(&u, k as f64 * e));
                (moment(&out), out)
            })
            .collect();
        let s = |k: usize| moments[k].0;
        let rate = ((s(3) - s(1)) * 8.0 - (s(4) - s(0))) / (12.0 * e);
        let out = &moments[2].1;
        let now = after(&u, 2.0 * e);
        let turn = attitude(&out.q);
        let mut inner = v(&out.omega).cross(&moment(out)) + rate;
        for (tank, flow) in p.tank.iter().zip(&now.mass_flow) {
            let outlet = v(&tank.position) + attitude(&tank.q) * V::new(0.0, 0.0, tank.outlet);
            inner += outlet * flow.value;
        }
        let want = v(&out.velocity) * out.mass + turn * inner;
        let off = (v(&out.momentum) - want).norm() / want.norm();
        // The difference has the errors e^4/30 times the fifth derivative, and 1e-16/e.
        assert!(off < 1e-10, "{seed} {off:e}");
    }
}

#[test]
fn outflow_is_the_integral_of_the_flow_for_any_communication_step() {
    let (p, mut u) = draining_craft(7, 2);
    for flow in &mut u.mass_flow[..p.tanks - 1] {
        *flow = Line { value: 6.0, slope: 1.0 };
    }
    let ends: Vec<Outputs> = [0.5, 0.1, 0.02]
        .map(|h| {
            let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-12).unwrap();
            let steps = (5.0_f64 / h).round() as usize;
            for k in 0..steps {
                craft.step(&after(&u, k as f64 * h), h).unwrap();
            }
            craft.outputs(&after(&u, 5.0))
        })
        .into();
    let start = Spacecraft::new(&p, &u, 0.0, 1e-12).unwrap().outputs(&u).mass;
    let gone: f64 = u.mass_flow.iter().map(|flow| flow.integral(5.0)).sum();
    assert!(gone > 40.0, "{gone}");
    for out in &ends {
        assert!((out.mass - (start - gone)).abs() < 1e-12 * start, "{} {}", out.mass, start - gone);
        assert!((v(&out.omega) - v(&ends[0].omega)).norm() < 1e-10);
        assert!((v(&out.tank[0].p[0]) - v(&ends[0].tank[0].p[0])).norm() < 1e-9);
    }
}

/// Position and velocity are 0 at the start and about 100 m and 30 m/s at the end. The allowed error of a step grows with the
/// size of the states, so that the steps become longer than at the start.
#[test]
fn a_draining_craft_that_starts_at_the_origin_takes_long_steps() {
    for seed in every_or(&[1, 3], 0..6) {
        let (mut p, u) = draining_craft(seed, seed as usize % 4);
        (p.init.position, p.init.velocity) = ([0.0; 3], [0.0; 3]);
        for tolerance in [1e-6, 1e-12] {
            let [short, ends @ ..] = [0.02, 1.0, 5.0].map(|h| {
                let mut craft = Spacecraft::new(&p, &u, 0.0, tolerance).unwrap();
                for k in 0..(5.0_f64 / h).round() as usize {
                    craft.step(&after(&u, k as f64 * h), h).unwrap();
                }
                craft.continuous_states()
            });
            for x in ends {
                for i in 0..index::WORK {
                    // The tolerance allows for the growth of errors in five seconds of tumbling motion, and for the rounding
                    // errors of 250 steps.
                    let off = (x[i] - short[i]).abs() / (1.0 + short[i].abs());
                    assert!(off < tolerance.max(1e-11), "{seed} {tolerance}: x[{i}] {off:e}");
                }
            }
        }
    }
}

/// A tank with thrust along its axis drains while its liquid is at rest. In the derivatives large terms cancel and leave rounding
/// errors, which must not make the solver choose short steps.
#[test]
fn a_tank_that_drains_at_rest_takes_long_steps() {
    for modes in [0, 3] {
        let mut p = Parameters::default();
        let q = UnitQuaternion::from_quaternion(Quaternion::new(0.9, 0.2, -0.3, 0.4));
        p.craft.r = [0.0; 3];
        let tank = &mut p.tank[0];
        (tank.position, tank.q) = ([0.0; 3], [q.w, q.i, q.j, q.k]);
        (tank.fill.points, tank.modes) = (POINTS, modes);
        let mass_flow = Line { value: 5.0, slope: 0.0 };
        let mut u = Inputs { force: Ramp::held((q * V::z() * 1e4).into()), ..Inputs::default() };
        u.mass_flow[0] = mass_flow;
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-14).unwrap();
        craft.step(&u, 60.0).unwrap();
        let liquid = craft.continuous_states()[index::LIQUID];
        assert!((liquid - (p.tank[0].liquid_0 - 300.0)).abs() < 1e-10);

        let tank = TankParameters { tank: p.tank[0], ..TankParameters::default() };
        let a = Ramp::held((q * V::z() * 8.0).into());
        let u = TankInputs { a, mass_flow, ..TankInputs::default() };
        let mut tank = SloshTank::new(&tank, &u, 0.0, 1e-14).unwrap();
        tank.step(&u, 60.0).unwrap();
        let out = tank.outputs(&u);
        assert!((out.liquid - liquid).abs() < 1e-10);
        for p in &out.tank.p[..modes] {
            assert!((v(p) + V::z()).norm() < 1e-12, "{p:?}");
        }
    }
}

#[test]
fn a_fill_table_without_outflow_does_not_change_the_motion() {
    for seed in 0..4 {
        let (mut p, mut u) = draining_craft(seed, 2);
        for (n, tank) in p.tank.iter_mut().enumerate() {
            tank.damping_law = DampingLaw::ALL[(seed as usize + n) % 3];
            (tank.zeta, tank.zeta_amplitude) = ([0.05; MODES], [0.1 * (seed % 2) as f64; MODES]);
        }
        u.mass_flow = Default::default();
        let mut without = p;
        for tank in &mut without.tank[..p.tanks] {
            let table = tank.fill;
            if table.points == 0 {
                continue;
            }
            // The points of the table lie on both sides of 400 kg, but the test needs the mass at a point.
            let i = 3;
            tank.fill.points = 0;
            (tank.h_0, tank.i_0, tank.i_z) = (table.h_0[i], table.i_0[i], table.i_z[i]);
            tank.m_0 = table.liquid[i];
            for n in 0..tank.modes {
                (tank.mass[n], tank.length[n]) = (table.mass[n][i], table.length[n][i]);
                (tank.hinge[n], tank.m_0) = (table.hinge[n][i], tank.m_0 - table.mass[n][i]);
            }
        }
        let mut with = p;
        for tank in &mut with.tank {
            tank.liquid_0 = tank.fill.liquid[3];
        }
        let mut a = Spacecraft::new(&with, &u, 0.0, 1e-12).unwrap();
        let mut b = Spacecraft::new(&without, &u, 0.0, 1e-12).unwrap();
        for k in 0..250 {
            let u = after(&u, k as f64 * STEP);
            // The motion is also the same after a jump of the wheels' momentum.
            a.step(&u, STEP).unwrap();
            b.step(&u, STEP).unwrap();
        }
        let (a, b) = (a.continuous_states(), b.continuous_states());
        for i in (0..STATES).filter(|i| *i != index::WORK && *i != index::DISSIPATED) {
            let off = (a[i] - b[i]).abs();
            assert!(off < 1e-9 * (1.0 + b[i].abs()), "{seed} x[{i}] {} {}", a[i], b[i]);
        }
    }
}

/// Directional derivatives are compared with finite differences of the rates, in a direction in which all states and inputs
/// change at once, including flows and masses of liquid.
#[test]
fn directional_derivatives_of_draining_craft_equal_finite_differences() {
    for seed in (0..8).chain(20..24).chain(40..44) {
        let (mut p, u) = draining_craft(seed, 1 + seed as usize % 3);
        // The inputs have no slopes, because an importer of Model Exchange sets only their values.
        let mut u = after(&u, 0.0);
        for ramp in [&mut u.force, &mut u.torque, &mut u.h_wheels] {
            ramp.slope = [0.0; 3];
        }
        u.mass_flow.iter_mut().for_each(|flow| flow.slope = 0.0);
        let mut random = Random::new(seed + 100);
        if seed == 3 {
            (p.mount, p.init.velocity, p.pivot) = (Mount::Pivot, [0.0; 3], random.pivot());
        }
        if seed % 4 > 1 {
            random.flex(&mut p);
        }
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
        let x = craft.continuous_states();
        let (mut dx, du): ([f64; STATES], [f64; INPUTS]) = (random.vector(1.0), random.vector(3.0));
        if p.mount == Mount::Pivot {
            dx[index::POSITION..index::POSITION + 6].fill(0.0);
        }
        let exact = craft.directional_derivative(&u, &dx, &du);
        let mut at = |s: f64| {
            craft.set_continuous_states(&std::array::from_fn(|i| x[i] + s * dx[i]));
            let mut u = u;
            for i in 0..3 {
                u.force.value[i] += s * du[i];
                u.torque.value[i] += s * du[3 + i];
                u.h_wheels.value[i] += s * du[6 + i];
            }
            for (i, flow) in u.mass_flow.iter_mut().enumerate().take(p.tanks - 1) {
                flow.value += s * du[9 + i];
            }
            craft.derivatives(&u)
        };
        let e = 1e-3;
        let [p2, p1, m1, m2] = [2.0, 1.0, -1.0, -2.0].map(|s| at(s * e));
        for i in 0..STATES {
            let other = (8.0 * (p1[i] - m1[i]) - (p2[i] - m2[i])) / (12.0 * e);
            let size = 1.0 + exact[i].abs() + p1[i].abs();
            assert!((exact[i] - other).abs() < 1e-7 * size, "{seed} [{i}]: {} {other}", exact[i]);
        }
    }
}

/// A draining tank with a damping ratio at each point of its fill table is compared, at each of
/// these points, with a tank that has this point's damping ratio at every fill. The derivatives of
/// the states are equal under every damping law.
#[test]
fn a_draining_tank_has_the_damping_ratio_of_its_fill() {
    for (i, law) in DampingLaw::ALL.into_iter().enumerate() {
        let (mut p, u) = draining_craft(i as u64, 1);
        p.tank[0].damping_law = law;
        for point in [0, 5, POINTS - 1] {
            p.tank[0].liquid_0 = p.tank[0].fill.liquid[point];
            let rates = |p: &Parameters| Spacecraft::new(p, &u, 0.0, 1e-9).unwrap().derivatives(&u);
            let mut constant = p;
            constant.tank[0].zeta[0] = p.tank[0].fill.zeta[0][point];
            constant.tank[0].fill.zeta = [[0.0; POINTS]; MODES];
            assert_eq!(rates(&p), rates(&constant), "{law:?} {point}");
            let other = if point == 5 { 6 } else { 5 };
            constant.tank[0].zeta[0] = p.tank[0].fill.zeta[0][other];
            assert_ne!(rates(&p), rates(&constant), "{law:?} {point}");
        }
    }
}

/// Returns energy + dissipated + drained - work of the craft, which must be constant.
pub fn energy(out: &Outputs) -> f64 {
    out.energy + out.dissipated + out.drained - out.work
}

#[test]
fn the_energy_balance_holds_while_tanks_drain() {
    for seed in every_or(&[0, 3, 7, 21, 43], (0..8).chain(21..25).chain(41..45)) {
        let (mut p, u) = draining_craft(seed, seed as usize % 4);
        if [6, 7, 24, 43].contains(&seed) {
            (p.mount, p.init.velocity) = (Mount::Pivot, [0.0; 3]);
        }
        if seed == 7 {
            p.pivot = Random::new(7).pivot();
        }
        if seed % 4 > 1 {
            Random::new(seed).flex(&mut p);
        }
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-13).unwrap();
        let start = craft.outputs(&u);
        let (mut worst, mut size) = (0.0_f64, 0.0_f64);
        for k in 0..250 {
            let mut now = after(&u, k as f64 * STEP);
            if k / 50 % 2 == 1 {
                now.mass_flow = now.mass_flow.map(|flow| Line { value: -0.3 * flow.value, ..flow });
            }
            craft.step(&now, STEP).unwrap();
            let out = craft.outputs(&after(&now, STEP));
            worst = worst.max((energy(&out) - energy(&start)).abs());
            size = size.max(out.energy.abs()).max(out.work.abs());
        }
        let gone = craft.outputs(&u).drained.abs();
        println!("{seed}: {:.1e} of {size:.1e}, gone {gone:.1e}", worst / size);
        assert!(worst < 1e-11 * size, "{seed} {worst:e} {size:e}");
        assert!(gone > 1e4 * worst, "{seed} {gone:e}");
    }
}

#[test]
fn a_valve_that_opens_or_shuts_keeps_momentum_and_energy() {
    for seed in (0..6).chain(21..24).chain(41..44) {
        let (mut p, u) = draining_craft(seed, seed as usize % 4);
        if seed % 2 == 1 {
            Random::new(seed).flex(&mut p);
        }
        let at = |share: f64| {
            u.mass_flow.map(|flow| Line { value: share * flow.value, slope: flow.slope / 2.0 })
        };
        let mut now = Inputs { mass_flow: Default::default(), ..u };
        let mut craft = Spacecraft::new(&p, &now, 0.0, 1e-12).unwrap();
        for flow in [at(1.0), Default::default(), at(2.0), at(-1.0)] {
            craft.step(&now, 0.5).unwrap();
            now = after(&now, 0.5);
            let before = craft.outputs(&now);
            now.mass_flow = flow;
            let jumped = craft.outputs(&now);
            let [p_0, h_0] = momenta(&before);
            let [p_1, h_1] = momenta(&jumped);
            // The tolerance is some rounding errors of numbers of the size of p_0.
            assert!((p_1 - p_0).norm() < 1e-14 * p_0.norm(), "{seed} {p_0} {p_1}");
            assert!((h_1 - h_0).norm() < 1e-13 * h_0.norm(), "{seed} {h_0} {h_1}");
            assert!(jumped.energy != before.energy, "{seed}");
            craft.step(&now, 1e-3).unwrap();
            now = after(&now, 1e-3);
            let off = (energy(&craft.outputs(&now)) - energy(&before)).abs();
            assert!(off < 1e-13 * before.energy, "{seed} {off:e}");
        }
    }
}

/// Returns a draining tank, and the motion of the body that carries it. From seed 12 on the bobs move on surfaces that
/// depend on the fill.
fn tank_alone(seed: u64, coupling: Coupling) -> (TankParameters, TankInputs) {
    let mut random = Random::new(seed);
    let mut tank = draining_tank(&mut random, seed as usize % 4);
    if seed >= 12 {
        random.bend_by_fill(&mut tank);
    }
    let mut ramp = || Ramp { value: random.vector(2.0), slope: random.vector(1.0) };
    let (a, omega, omega_dot) = (ramp(), ramp().value, ramp());
    let mass_flow = Line { value: random.between(1.0, 5.0), slope: random.between(-2.0, 4.0) };
    let p = TankParameters { tank, coupling, ..TankParameters::default() };
    (p, TankInputs { a, omega, omega_dot, mass_flow })
}

fn inputs_after(u: &TankInputs, t: f64) -> TankInputs {
    let at = |ramp: &Ramp| Ramp { value: ramp.value_at(t), slope: ramp.slope };
    let turned =
        [0, 1, 2].map(|i| u.omega[i] + (u.omega_dot.value[i] + u.omega_dot.slope[i] * t / 2.0) * t);
    let mass_flow = Line { value: u.mass_flow.value_at(t), slope: u.mass_flow.slope };
    TankInputs { a: at(&u.a), omega: turned, omega_dot: at(&u.omega_dot), mass_flow }
}

/// Newton's law for the liquid in a tank that is rotated and has a distance from the origin O of the body that carries it. S is
/// the liquid's first moment about O:
///
/// ```text
/// -F = m a + w' x S + w x (w x S) + 2 w x S' + S'' + 2 f w x r_out + f' r_out
/// ```
///
/// S' and S'' are computed from differences of the mass and centre of mass in the tank's outputs. The outflowing liquid takes the
/// momentum f (V + w x r_out) with it.
#[test]
fn the_force_of_a_draining_tank_follows_newtons_law() {
    for seed in 0..16 {
        let (p, u) = tank_alone(seed, Coupling::Split);
        // The errors are e^6 S^(8) and 1e-16 S/e^2, for oscillations of up to 20 rad/s.
        let e = 2e-3;
        let mut tank = SloshTank::new(&p, &u, 0.0, 1e-13).unwrap();
        let mut shown = Vec::new();
        for k in 0..7 {
            if k > 0 {
                tank.step(&inputs_after(&u, (k - 1) as f64 * e), e).unwrap();
            }
            shown.push(tank.outputs(&inputs_after(&u, k as f64 * e)));
        }
        let s = |k: usize| v(&shown[k].center_of_mass) * shown[k].mass;
        let pair = |k: usize| (s(3 + k) + s(3 - k), s(3 + k) - s(3 - k));
        let [(a1, d1), (a2, d2), (a3, d3)] = [pair(1), pair(2), pair(3)];
        let s_d = (d1 * 45.0 - d2 * 9.0 + d3) / (60.0 * e);
        let s_dd = (a1 * 270.0 - a2 * 27.0 + a3 * 2.0 - s(3) * 490.0) / (180.0 * e * e);
        let now = inputs_after(&u, 3.0 * e);
        let outlet = v(&p.tank.position) + attitude(&p.tank.q) * V::new(0.0, 0.0, p.tank.outlet);
        let (a, w, w_d) = (v(&now.a.value), v(&now.omega), v(&now.omega_dot.value));
        let (flow, out) = (now.mass_flow, &shown[3]);
        let want = a * out.mass
            + w_d.cross(&s(3))
            + w.cross(&w.cross(&s(3)))
            + w.cross(&s_d) * 2.0
            + s_dd
            + w.cross(&outlet) * (2.0 * flow.value)
            + outlet * flow.slope;
        let off = (v(&out.tank.force) + want).norm() / want.norm();
        println!("{seed}: {off:.1e}");
        assert!(off < 1e-9, "{seed}: {off:e}");
    }
}

/// While all tanks drain, a rigid body that is solved with the tanks' added mass and bias has the accelerations of the whole
/// craft, and the bobs have the same accelerations as in a Spacecraft. Forces and torques fulfil Newton's and Euler's laws.
#[test]
fn draining_tanks_on_a_rigid_body_move_as_spacecraft() {
    for seed in (0..12).chain(20..26).chain(40..44) {
        let (p, u) = draining_craft(seed, seed as usize % 4);
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-10).unwrap();
        craft.step(&u, 0.5).unwrap();
        // The inputs have no slopes, because an importer of Model Exchange sets only their values.
        let mut u = after(&u, 0.5);
        for ramp in [&mut u.force, &mut u.torque, &mut u.h_wheels] {
            ramp.slope = [0.0; 3];
        }
        u.mass_flow.iter_mut().for_each(|flow| flow.slope = 0.0);
        let (out, rate) = (craft.outputs(&u), craft.derivatives(&u));
        let x = craft.continuous_states();
        let w = v(&out.omega);
        // The dry craft solves (M + sum of M_a) [a; w'] = rest + sum of bias.
        let dry = Rigid::new(p.craft.mass, &p.craft.r, &p.craft.j.matrix());
        let [centrifugal, gyroscopic] = dry.gyroscopic_terms(w);
        let h = v(&u.h_wheels.value);
        let force = v(&u.force.value) - centrifugal;
        let torque = v(&u.torque.value) - gyroscopic - w.cross(&h);
        let mut rest = Vector6::from_fn(|i, _| if i < 3 { force[i] } else { torque[i - 3] });
        let mut matrix = dry.matrix();
        let mut tanks = Vec::new();
        for i in 0..p.tanks {
            let own = TankParameters { tank: p.tank[i], ..TankParameters::default() };
            let motion = TankInputs {
                a: Ramp::held(out.specific_force),
                omega: out.omega,
                omega_dot: Ramp::held(out.omega_dot),
                mass_flow: u.mass_flow[i],
            };
            let mut tank = SloshTank::new(&own, &motion, 0.0, 1e-9).unwrap();
            let mut states = tank.continuous_states();
            states[..6 * MODES].copy_from_slice(&x[index::bob(i, 0)..][..6 * MODES]);
            states[6 * MODES + 1] = x[index::LIQUID + i];
            tank.set_continuous_states(&states);
            let shown = tank.outputs(&motion);
            let places = (0..6).flat_map(|i| (i..6).map(move |j| (i, j)));
            for ((i, j), x) in places.zip(shown.added_mass) {
                matrix[(i, j)] += x;
                if i != j {
                    matrix[(j, i)] += x;
                }
            }
            rest += Vector6::from_column_slice(&shown.bias);
            tanks.push((tank, motion, shown));
        }
        let solved = matrix.lu().solve(&rest).unwrap();
        let want = [out.specific_force, out.omega_dot].concat();
        let size = want.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        for i in 0..6 {
            let off = (solved[i] - want[i]).abs();
            assert!(off < 1e-12 * size, "{seed} [a; w'][{i}] {} {}", solved[i], want[i]);
        }
        for (i, (tank, motion, shown)) in tanks.iter_mut().enumerate() {
            let whole = &out.tank[i];
            let size = v(&whole.force).norm().max(v(&whole.torque).norm());
            assert!((v(&shown.tank.force) - v(&whole.force)).norm() < 1e-12 * size, "{seed} {i}");
            assert!((v(&shown.tank.torque) - v(&whole.torque)).norm() < 1e-12 * size, "{seed} {i}");
            let alone = tank.derivatives(motion);
            for n in 0..6 * MODES {
                let want = rate[index::bob(i, n / 6) + n % 6];
                assert!((alone[n] - want).abs() < 1e-11 * (1.0 + want.abs()), "{seed} {i} x[{n}]");
            }
        }
    }
}

struct Rigid {
    mass: f64,
    arm: Matrix3<f64>,
    inertia: Matrix3<f64>,
    moment: V,
}

impl Rigid {
    fn new(mass: f64, r: &[f64; 3], j: &[[f64; 3]; 3]) -> Rigid {
        let arm = v(r).cross_matrix();
        let inertia = Matrix3::from_fn(|i, k| j[i][k]) - arm * arm * mass;
        Rigid { mass, arm, inertia, moment: v(r) * mass }
    }

    fn matrix(&self) -> Matrix6<f64> {
        let mut matrix = Matrix6::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(self.mass);
        matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-self.arm * self.mass));
        matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&(self.arm * self.mass));
        matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.inertia);
        matrix
    }

    fn gyroscopic_terms(&self, w: V) -> [V; 2] {
        [w.cross(&w.cross(&self.moment)), w.cross(&(self.inertia * w))]
    }
}

/// The law force = bias - added mass * acceleration is tested in every coupling while the tank drains. In the couplings `Lumped`
/// and `RigidBody` the added mass keeps its initial value.
#[test]
fn force_and_torque_of_a_draining_tank_equal_bias_minus_added_mass_times_acceleration() {
    for seed in 0..16 {
        for coupling in Coupling::ALL {
            let (p, u) = tank_alone(seed, coupling);
            let mut tank = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap();
            let start = tank.outputs(&u);
            tank.step(&u, 1.5).unwrap();
            let u = inputs_after(&u, 1.5);
            let out = tank.outputs(&u);
            let mut m = Matrix6::zeros();
            let places = (0..6).flat_map(|i| (i..6).map(move |j| (i, j)));
            for ((i, j), x) in places.zip(out.added_mass) {
                (m[(i, j)], m[(j, i)]) = (x, x);
            }
            assert_eq!(out.added_mass == start.added_mass, coupling != Coupling::Split);
            let x = Vector6::from_column_slice(&[u.a.value, u.omega_dot.value].concat());
            let mut left = Vector6::from_column_slice(&out.bias) - m * x;
            if coupling == Coupling::RigidBody {
                let (w, s) = (v(&u.omega), V::new(m[(5, 1)], m[(3, 2)], m[(4, 0)]));
                let torque = w.cross(&(m.fixed_view::<3, 3>(3, 3) * w));
                let force = w.cross(&w.cross(&s));
                left -= Vector6::from_fn(|i, _| if i < 3 { force[i] } else { torque[i - 3] });
            }
            let wrench = Vector6::from_column_slice(&[out.tank.force, out.tank.torque].concat());
            let size = (m * x).amax() + out.bias.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
            assert!((left - wrench).amax() < 1e-14 * size, "{seed} {coupling:?}");
        }
    }
}

#[test]
fn a_tank_s_outflow_is_the_integral_of_the_flow_for_any_communication_step() {
    let (p, mut u) = tank_alone(2, Coupling::Split);
    u.mass_flow = Line { value: 3.0, slope: 2.0 };
    let ends = [5.0, 0.5, 0.1, 0.02].map(|h| {
        let mut tank = SloshTank::new(&p, &u, 0.0, 1e-12).unwrap();
        for k in 0..(5.0_f64 / h).round() as usize {
            tank.step(&inputs_after(&u, k as f64 * h), h).unwrap();
        }
        tank.outputs(&inputs_after(&u, 5.0))
    });
    let left = p.tank.liquid_0 - u.mass_flow.integral(5.0);
    for out in &ends {
        assert!((out.liquid - left).abs() < 1e-12 * left, "{} {left}", out.liquid);
        assert!((out.mass - left).abs() < 1e-12 * left, "{} {left}", out.mass);
        assert!((v(&out.tank.p[0]) - v(&ends[0].tank.p[0])).norm() < 1e-9);
    }
}
