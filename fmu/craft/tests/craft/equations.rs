//! Tests of the directional derivatives of rates and outputs, by comparison with finite differences.

use craft::{
    Coupling, INPUTS, Inputs, Line, MODES, Mount, Outputs, Parameters, Ramp, STATES, SloshTank,
    SloshTankOutputs, Spacecraft, TANK_INPUTS, TANK_STATES, TankInputs, TankParameters, index,
};

use super::random::{Random, draining_tank};

fn ramps(u: &Inputs) -> [Ramp; 3] {
    [u.force, u.torque, u.h_wheels]
}

fn inputs_along(u: &Inputs, du: &[f64; INPUTS], s: f64) -> Inputs {
    let [force, torque, h_wheels] = ramps(u);
    let by = |ramp: Ramp, at: usize| Ramp {
        value: [0, 1, 2].map(|i| ramp.value[i] + s * du[at + i]),
        slope: ramp.slope,
    };
    Inputs {
        force: by(force, 0),
        torque: by(torque, 3),
        h_wheels: by(h_wheels, 6),
        ..Inputs::default()
    }
}

fn to_list(out: &Outputs) -> Vec<f64> {
    let mut all = vec![out.energy, out.work, out.dissipated, out.mass];
    all.extend(out.q);
    let vectors = [
        out.omega,
        out.omega_dot,
        out.specific_force,
        out.position,
        out.velocity,
        out.slosh_force,
        out.slosh_torque,
        out.momentum,
        out.angular_momentum,
        out.center_of_mass,
    ];
    all.extend(vectors.as_flattened());
    all.extend(out.inertia.as_flattened());
    for tank in &out.tank {
        all.extend(tank.force);
        all.extend(tank.torque);
        all.extend(tank.p.as_flattened());
        all.extend(tank.p_dot.as_flattened());
        all.extend(tank.angle_x);
        all.extend(tank.angle_y);
    }
    all
}

fn flat_tank(out: &SloshTankOutputs) -> Vec<f64> {
    let mut all = vec![out.dissipated];
    all.extend(out.bias);
    all.extend(out.added_mass);
    all.extend(out.tank.force);
    all.extend(out.tank.torque);
    all.extend(out.tank.p.as_flattened());
    all.extend(out.tank.p_dot.as_flattened());
    all.extend(out.tank.angle_x);
    all.extend(out.tank.angle_y);
    all.push(out.mass);
    all.extend(out.center_of_mass);
    all.extend(out.inertia.as_flattened());
    all
}

/// Returns the derivative of `f` at 0 from central differences of the fourth order. The errors, of
/// the orders step^4 and 1e-16/step, are about 1e-10 of `f` and of its curvature.
fn difference(f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let step = 5e-4;
    let [p2, p1, m1, m2] = [2.0, 1.0, -1.0, -2.0].map(|s| f(s * step));
    (0..p1.len()).map(|i| (8.0 * (p1[i] - m1[i]) - (p2[i] - m2[i])) / (12.0 * step)).collect()
}

fn assert_same(exact: &[f64], by_differences: &[f64], now: &[f64], what: &str) {
    for (i, (exact, other)) in exact.iter().zip(by_differences).enumerate() {
        let size = 1.0 + exact.abs() + now[i].abs();
        assert!((exact - other).abs() < 1e-8 * size, "{what} [{i}]: {exact} {other}");
    }
}

/// Returns a random craft in motion. The quaternion and the directions of bobs in its states do not have unit length.
fn somewhere(seed: u64) -> (Random, Parameters, Spacecraft, Inputs) {
    let mut random = Random::new(seed);
    let mut p = random.parameters();
    if seed.is_multiple_of(3) {
        (p.mount, p.init.velocity) = (Mount::Pivot, [0.0; 3]);
        p.pivot = random.pivot();
    }
    if (60..85).contains(&seed) {
        random.make_all_planar(&mut p);
    }
    if (80..90).contains(&seed) || seed >= 95 {
        random.bend_all(&mut p);
    }
    if seed >= 90 {
        random.spin_all(&mut p);
    }
    if seed.is_multiple_of(2) {
        p.tank.iter_mut().for_each(|tank| random.follow(tank));
    }
    if seed % 5 == 4 {
        random.flex(&mut p);
    }
    let u = random.inputs();
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
    craft.step(&u, 0.1).unwrap();
    let mut x = craft.continuous_states();
    let stretch = random.between(0.9, 1.1);
    x[..4].iter_mut().for_each(|x| *x *= stretch);
    for i in 0..p.tanks {
        let at = index::bob(i, 0);
        x[at..at + 18].iter_mut().for_each(|x| *x *= stretch);
    }
    craft.set_continuous_states(&x);
    (random, p, craft, u)
}

#[test]
fn directional_derivatives_equal_finite_differences() {
    for seed in 0..100 {
        let (mut random, p, mut craft, u) = somewhere(seed);
        let (mut dx, du): ([f64; STATES], _) = (random.vector(1.0), random.vector(100.0));
        if p.mount == Mount::Pivot {
            // On a pivot position and velocity of O do not change, so that they are not varied.
            dx[index::POSITION..index::POSITION + 6].fill(0.0);
        }
        let x = craft.continuous_states();
        let at = |s: f64, f: &dyn Fn(&mut Spacecraft, &Inputs) -> Vec<f64>| {
            let mut craft = craft.clone();
            craft.set_continuous_states(&std::array::from_fn(|i| x[i] + s * dx[i]));
            f(&mut craft, &inputs_along(&u, &du, s))
        };
        let rates = |craft: &mut Spacecraft, u: &Inputs| craft.derivatives(u).to_vec();
        let outputs = |craft: &mut Spacecraft, u: &Inputs| to_list(&craft.outputs_held(u));
        let rates_by_differences = difference(|s| at(s, &rates));
        let outputs_by_differences = difference(|s| at(s, &outputs));
        let now = [craft.derivatives(&u).to_vec(), to_list(&craft.outputs_held(&u))];
        let exact = craft.directional_derivative(&u, &dx, &du);
        assert_same(&exact, &rates_by_differences, &now[0], &format!("{seed} rate"));
        let exact = to_list(&craft.output_derivatives(&u, &dx, &du));
        assert_same(&exact, &outputs_by_differences, &now[1], &format!("{seed} output"));
        assert_eq!(craft.continuous_states(), x, "the states must not have changed");
        assert_eq!(to_list(&craft.outputs_held(&u)), now[1]);
    }
}

#[test]
fn directional_derivatives_of_a_tank_equal_finite_differences() {
    for seed in 0..100 {
        let mut random = Random::new(seed);
        let mut p = TankParameters { tank: random.tank(), ..TankParameters::default() };
        if seed >= 60 {
            random.make_planar(&mut p.tank);
        }
        if seed >= 72 {
            random.bend(&mut p.tank);
            random.bend_further(&mut p.tank);
        }
        if seed >= 90 {
            random.spin(&mut p.tank);
        }
        p.coupling = Coupling::ALL[seed as usize % 3];
        let mut ramp = || Ramp { value: random.vector(1.0), slope: random.vector(1.0) };
        let (a, omega_dot) = (ramp(), ramp());
        let mut u = TankInputs { a, omega: random.vector(1.0), omega_dot, ..TankInputs::default() };
        if seed.is_multiple_of(5) && seed < 60 || (84..90).contains(&seed) {
            p.tank = draining_tank(&mut random, 1 + seed as usize % 3);
            if seed >= 84 {
                random.bend_by_fill(&mut p.tank);
            }
            u.mass_flow =
                Line { value: random.between(1.0, 9.0), slope: random.between(-2.0, 2.0) };
        }
        if seed.is_multiple_of(2) {
            random.follow(&mut p.tank);
        }
        let tank = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap();
        let (dx, du): ([f64; TANK_STATES], [f64; TANK_INPUTS]) =
            (random.vector(1.0), random.vector(1.0));
        let x = tank.continuous_states();
        let at = |s: f64| {
            let mut tank = tank.clone();
            tank.set_continuous_states(&std::array::from_fn(|i| x[i] + s * dx[i]));
            let by = |ramp: Ramp, at: usize| Ramp {
                value: [0, 1, 2].map(|i| ramp.value[i] + s * du[at + i]),
                slope: ramp.slope,
            };
            let omega = [0, 1, 2].map(|i| u.omega[i] + s * du[3 + i]);
            let flow = Line { value: u.mass_flow.value + s * du[9], slope: u.mass_flow.slope };
            let u =
                TankInputs { a: by(u.a, 0), omega, omega_dot: by(u.omega_dot, 6), mass_flow: flow };
            (tank, u)
        };
        let rates = difference(|s| {
            let (mut tank, u) = at(s);
            tank.derivatives(&u).to_vec()
        });
        let outputs = difference(|s| {
            let (mut tank, u) = at(s);
            flat_tank(&tank.outputs(&u))
        });
        let mut tank = tank;
        let now = [tank.derivatives(&u).to_vec(), flat_tank(&tank.outputs(&u))];
        let exact = tank.directional_derivative(&u, &dx, &du);
        assert_same(&exact, &rates, &now[0], &format!("{seed} rate"));
        let exact = flat_tank(&tank.output_derivatives(&u, &dx, &du));
        assert_same(&exact, &outputs, &now[1], &format!("{seed} output"));
        // The sum of the waves of all modes is left out where the waves nearly cancel, because its curvature is too large
        // there for finite differences.
        let (out, slope) = (tank.outputs(&u).tank, tank.output_derivatives(&u, &dx, &du).tank);
        let wave = |angle: &[f64; MODES]| -> f64 {
            (0..p.tank.modes).map(|n| p.tank.wave[n] * angle[n]).sum()
        };
        let [across, along] = [wave(&out.angle_x), wave(&out.angle_y)];
        let rate = across * wave(&slope.angle_x) + along * wave(&slope.angle_y);
        assert!((out.wave_height - f64::hypot(across, along)).abs() < 1e-15);
        assert!((out.wave_height * slope.wave_height - rate).abs() < 1e-14);
        // The following derivatives are taken along the motion itself.
        let along = |t: f64| {
            let mut moved = tank.clone();
            let dx = tank.clone().derivatives(&u);
            moved.set_continuous_states(&std::array::from_fn(|i| x[i] + t * dx[i]));
            let omega = [0, 1, 2].map(|i| u.omega[i] + t * u.omega_dot.value[i]);
            let ramp = |ramp: &Ramp| Ramp { value: ramp.value_at(t), slope: ramp.slope };
            let flow = Line { value: u.mass_flow.value_at(t), slope: u.mass_flow.slope };
            let u =
                TankInputs { a: ramp(&u.a), omega, omega_dot: ramp(&u.omega_dot), mass_flow: flow };
            flat_tank(&moved.outputs(&u))
        };
        // In 1 ms the rates of the fastest bobs change by a tenth, and drag that depends on their amplitude changes as much.
        let slopes: Vec<f64> =
            difference(|s| along(s / 8.0)).into_iter().map(|slope| 8.0 * slope).collect();
        let exact = flat_tank(&output_slopes(&mut tank, &u));
        assert_same(&exact, &slopes, &now[1], &format!("{seed} slope"));
    }
}

pub fn output_slopes(tank: &mut SloshTank, inputs: &TankInputs) -> SloshTankOutputs {
    let dx = tank.derivatives(inputs);
    let mut du = [0.0; TANK_INPUTS];
    du[..3].copy_from_slice(&inputs.a.slope);
    du[3..6].copy_from_slice(&inputs.omega_dot.value);
    du[6..9].copy_from_slice(&inputs.omega_dot.slope);
    du[9] = inputs.mass_flow.slope;
    tank.output_derivatives(inputs, &dx, &du)
}
