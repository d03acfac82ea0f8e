//! Tanks that drain.
//!
//! With the outflow f at r_out = d + z_out e, which leaves with the tank's velocity there,
//!
//! ```text
//! P' = C (force - f (V + w x r_out))
//! H' = C (r x force + torque - f (r + r_out) x (V + w x r_out))        about the inertial origin
//! P  = C (m V + w x S + S' + f r_out),   m' = -f
//! ```
//!
//! r: O from the inertial origin, S: first moment of everything about O.

use craft::{
    FillTable, INPUTS, Inputs, Line, Mount, Outputs, POINTS, Parameters, Ramp, STATES, Tank, index,
};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::component::Spacecraft;
use super::random::Random;
use super::records::STEP;

type V = Vector3<f64>;

/// A tank with a table: an upright cylinder of 0.45 m radius at eight depths, `modes` modes,
/// rotated and off the centre.
fn tank(random: &mut Random, modes: usize) -> Tank {
    let mut tank = Tank { modes, diameter: 0.0, ..random.tank() };
    let mut table = FillTable { points: POINTS, ..tank.fill };
    for i in 0..POINTS {
        let depth = 0.15 + 0.1 * i as f64;
        let liquid = 1000.0 * std::f64::consts::PI * 0.45 * 0.45 * depth;
        table.liquid[i] = liquid;
        // Potential flow: some 40 % in the first mode of a half-full tank, less above.
        let mut left = liquid;
        for n in 0..modes {
            let xi = [1.8412, 5.3314, 8.5363][n];
            let tanh = f64::tanh(xi * depth / 0.45);
            table.mass[n][i] = liquid * 0.9 * tanh / (xi * (xi * xi - 1.0) * depth);
            table.length[n][i] = 0.45 / (xi * tanh);
            table.hinge[n][i] = depth - 0.2 * tanh;
            left -= table.mass[n][i];
        }
        table.h_0[i] = 0.45 * depth;
        table.i_0[i] = left * (0.05 + 0.08 * depth * depth);
        table.i_z[i] = 0.01 * left;
    }
    tank.fill = table;
    tank.liquid_0 = 400.0;
    tank.outlet = -0.05;
    tank
}

/// A craft with one to three draining tanks and one that stays.
fn craft(seed: u64, modes: usize) -> (Parameters, Inputs) {
    let mut random = Random::new(seed);
    let mut p = random.parameters();
    p.tanks = 2 + seed as usize % 3;
    p.tank = [(); 4].map(|()| tank(&mut random, modes));
    p.tank[p.tanks - 1] = random.tank();
    let mut u = random.inputs();
    u.force.value[2] += 2.0 * p.craft.mass;
    for flow in &mut u.mass_flow[..p.tanks - 1] {
        *flow = Line { value: random.between(1.0, 5.0), slope: random.between(-2.0, 4.0) };
    }
    (p, u)
}

fn v(x: &[f64]) -> V {
    V::new(x[0], x[1], x[2])
}

fn attitude(q: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]))
}

fn after(u: &Inputs, t: f64) -> Inputs {
    let at = |ramp: &Ramp| Ramp { value: ramp.at(t), slope: ramp.slope };
    Inputs {
        force: at(&u.force),
        torque: at(&u.torque),
        h_wheels: at(&u.h_wheels),
        mass_flow: u.mass_flow.map(|flow| Line { value: flow.at(t), slope: flow.slope }),
    }
}

/// What comes in by force, torque and the flows: P' and H' about the inertial origin.
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

/// P, and H about the inertial origin.
fn momenta(out: &Outputs) -> [V; 2] {
    let center = v(&out.position) + attitude(&out.q) * v(&out.center_of_mass);
    let momentum = v(&out.momentum);
    [momentum, v(&out.angular_momentum) + center.cross(&momentum)]
}

/// Over two seconds, integrals by Lobatto's rule of five points: with and without modes.
#[test]
fn momentum_and_angular_momentum_leave_with_the_outflow() {
    for (seed, modes) in [(0, 0), (1, 0), (2, 1), (3, 2), (4, 3), (5, 1)] {
        let (p, u) = craft(seed, modes);
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
        assert!(relative.iter().all(|x| *x < 1e-11), "{seed} {relative:?}");
    }
}

/// The momentum shown is that of Newton and Euler: m V + w x S + S' + f r_out, S' by differences of
/// the centre of mass shown.
#[test]
fn momentum_is_that_of_the_mass_that_moves() {
    for seed in 0..6 {
        let (p, u) = craft(seed, 1 + seed as usize % 3);
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
        // e^4/30 of the fifth derivative, 1e-16/e.
        assert!(off < 1e-10, "{seed} {off:e}");
    }
}

/// Whatever the steps, what is left is the start less the integral of the flow, and the motion is the
/// same.
#[test]
fn outflow_is_the_integral_of_the_flow_for_any_communication_step() {
    let (p, mut u) = craft(7, 2);
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

/// Without flow the second formulation is the first.
#[test]
fn a_tank_with_a_table_that_does_not_drain_is_a_tank_without() {
    for seed in 0..4 {
        let (p, mut u) = craft(seed, 2);
        u.mass_flow = Default::default();
        let mut without = p;
        for tank in &mut without.tank[..p.tanks] {
            let table = tank.fill;
            if table.points == 0 {
                continue;
            }
            // 400 kg lie between two points; take one of them.
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
            // A jump of the wheels, too.
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

/// Rates by differences, along a direction of states and inputs at once, flows and fills included.
#[test]
fn directional_derivatives_of_draining_craft_are_those_by_differences() {
    for seed in 0..8 {
        let (mut p, u) = craft(seed, 1 + seed as usize % 3);
        // As a host gives them that integrates itself: without slopes.
        let mut u = after(&u, 0.0);
        for ramp in [&mut u.force, &mut u.torque, &mut u.h_wheels] {
            ramp.slope = [0.0; 3];
        }
        u.mass_flow.iter_mut().for_each(|flow| flow.slope = 0.0);
        if seed == 3 {
            (p.mount, p.init.velocity) = (Mount::Pivot, [0.0; 3]);
        }
        let mut random = Random::new(seed + 100);
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
