//! The equations for hosts that integrate themselves: derivatives, their derivatives, and a tank
//! on a host.

use craft::{
    INPUTS, Inputs, Mount, Outputs, Parameters, Ramp, STATES, SloshTank, SloshTankOutputs,
    Spacecraft, TANK_INPUTS, TANK_STATES, TankInputs, TankParameters, index,
};
use nalgebra::{SMatrix, SVector};

use crate::random::Random;

fn ramps(u: &Inputs) -> [Ramp; 3] {
    [u.force, u.torque, u.h_wheels]
}

/// Inputs moved by s along du; slopes stay.
fn moved(u: &Inputs, du: &[f64; INPUTS], s: f64) -> Inputs {
    let [force, torque, h_wheels] = ramps(u);
    let by = |ramp: Ramp, at: usize| Ramp {
        value: [0, 1, 2].map(|i| ramp.value[i] + s * du[at + i]),
        slope: ramp.slope,
    };
    Inputs { force: by(force, 0), torque: by(torque, 3), h_wheels: by(h_wheels, 6) }
}

/// Every output in a row.
fn flat(out: &Outputs) -> Vec<f64> {
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
    all
}

/// Central differences with Richardson's extrapolation: (step^4, 1e-16/step) leave 1e-10 of the
/// size of the quantity and of what it curves by.
fn difference(f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let step = 1e-3;
    let [p2, p1, m1, m2] = [2.0, 1.0, -1.0, -2.0].map(|s| f(s * step));
    (0..p1.len()).map(|i| (8.0 * (p1[i] - m1[i]) - (p2[i] - m2[i])) / (12.0 * step)).collect()
}

fn assert_same(exact: &[f64], by_differences: &[f64], now: &[f64], what: &str) {
    for (i, (exact, other)) in exact.iter().zip(by_differences).enumerate() {
        let size = 1.0 + exact.abs() + now[i].abs();
        assert!((exact - other).abs() < 1e-8 * size, "{what} [{i}]: {exact} {other}");
    }
}

/// A random craft in motion; quaternion and directions of the states are not of unit length.
fn somewhere(seed: u64) -> (Random, Parameters, Spacecraft, Inputs) {
    let mut random = Random::new(seed);
    let mut p = random.parameters();
    if seed.is_multiple_of(3) {
        (p.mount, p.init.velocity) = (Mount::Pivot, [0.0; 3]);
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

/// Along a direction of every kind of state and input at once, of the size of 1 for each.
#[test]
fn directional_derivatives_are_those_by_differences() {
    for seed in 0..60 {
        let (mut random, p, mut craft, u) = somewhere(seed);
        let (mut dx, du) = random.direction();
        if p.mount == Mount::Pivot {
            // O does not move.
            dx[index::POSITION..index::POSITION + 6].fill(0.0);
        }
        let x = craft.continuous_states();
        let at = |s: f64, f: &dyn Fn(&mut Spacecraft, &Inputs) -> Vec<f64>| {
            let mut craft = craft.clone();
            craft.set_continuous_states(&std::array::from_fn(|i| x[i] + s * dx[i]));
            f(&mut craft, &moved(&u, &du, s))
        };
        let rates = |craft: &mut Spacecraft, u: &Inputs| craft.derivatives(u).to_vec();
        let outputs = |craft: &mut Spacecraft, u: &Inputs| flat(&craft.outputs_held(u));
        let rates_by_differences = difference(|s| at(s, &rates));
        let outputs_by_differences = difference(|s| at(s, &outputs));
        let now = [craft.derivatives(&u).to_vec(), flat(&craft.outputs_held(&u))];
        let exact = craft.directional_derivative(&u, &dx, &du);
        assert_same(&exact, &rates_by_differences, &now[0], &format!("{seed} rate"));
        let exact = flat(&craft.output_derivatives(&u, &dx, &du));
        assert_same(&exact, &outputs_by_differences, &now[1], &format!("{seed} output"));
        assert_eq!(craft.continuous_states(), x, "nothing has moved");
        assert_eq!(flat(&craft.outputs_held(&u)), now[1]);
    }
}

#[test]
fn a_tank_s_directional_derivatives_are_those_by_differences() {
    for seed in 0..60 {
        let mut random = Random::new(seed);
        let mut p = TankParameters { tank: random.tank(), ..TankParameters::default() };
        if seed.is_multiple_of(2) {
            p.coupling = craft::Coupling::Lumped;
        }
        let mut ramp = || Ramp { value: random.vector(1.0), slope: random.vector(1.0) };
        let (a, omega_dot) = (ramp(), ramp());
        let u = TankInputs { a, omega: random.vector(1.0), omega_dot };
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
            let u = TankInputs { a: by(u.a, 0), omega, omega_dot: by(u.omega_dot, 6) };
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
        // Along the motion itself.
        let along = |t: f64| {
            let mut moved = tank.clone();
            let dx = tank.clone().derivatives(&u);
            moved.set_continuous_states(&std::array::from_fn(|i| x[i] + t * dx[i]));
            let omega = [0, 1, 2].map(|i| u.omega[i] + t * u.omega_dot.value[i]);
            let ramp = |ramp: &Ramp| Ramp { value: ramp.at(t), slope: ramp.slope };
            let u = TankInputs { a: ramp(&u.a), omega, omega_dot: ramp(&u.omega_dot) };
            flat_tank(&moved.outputs(&u))
        };
        let slopes = difference(along);
        let exact = flat_tank(&tank.output_slopes(&u));
        assert_same(&exact, &slopes, &now[1], &format!("{seed} slope"));
    }
}

/// The inputs after t.
fn after(u: &Inputs, t: f64) -> Inputs {
    let at = |ramp: &Ramp| Ramp { value: ramp.at(t), slope: ramp.slope };
    Inputs { force: at(&u.force), torque: at(&u.torque), h_wheels: at(&u.h_wheels) }
}

/// Classical Runge-Kutta from 0 to `end` in so many steps.
fn runge_kutta(
    mut f: impl FnMut(f64, &[f64; STATES]) -> [f64; STATES],
    x: &mut [f64; STATES],
    end: f64,
    steps: usize,
) {
    let h = end / steps as f64;
    let at = |x: &[f64; STATES], d: &[f64; STATES], h: f64| -> [f64; STATES] {
        std::array::from_fn(|i| x[i] + h * d[i])
    };
    for k in 0..steps {
        let t = k as f64 * h;
        let k1 = f(t, x);
        let k2 = f(t + h / 2.0, &at(x, &k1, h / 2.0));
        let k3 = f(t + h / 2.0, &at(x, &k2, h / 2.0));
        let k4 = f(t + h, &at(x, &k3, h));
        for i in 0..STATES {
            x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }
}

/// Nothing is shared but the rates at an instant: Runge-Kutta at 0.2 ms against the power
/// series. The fastest bobs move at 30 1/s: (30 h)^4/120 of what they do leaves 1e-11.
#[test]
fn a_host_that_integrates_itself_meets_the_crafts_own_steps() {
    for seed in 0..12 {
        let mut random = Random::new(seed);
        let mut p = random.parameters();
        if seed.is_multiple_of(4) {
            (p.mount, p.init.velocity) = (Mount::Pivot, [0.0; 3]);
        }
        let inputs = random.inputs();
        let mut craft = Spacecraft::new(&p, &inputs, 0.0, 1e-13).unwrap();
        let mut own = craft.clone();
        let mut x = craft.continuous_states();
        let rates = |t: f64, x: &[f64; STATES]| {
            craft.set_continuous_states(x);
            craft.derivatives(&after(&inputs, t))
        };
        runge_kutta(rates, &mut x, 1.0, 5000);
        own.step(&inputs, 1.0).unwrap();
        let want = own.continuous_states();
        for i in 0..STATES {
            let size = 1.0 + want[i].abs();
            assert!((x[i] - want[i]).abs() < 1e-10 * size, "{seed} x[{i}] {} {}", x[i], want[i]);
        }
    }
}

/// A rigid body with tanks hung on it, q, w, r, V and the tanks' states, whose host solves
/// (M_body + sum of M_a) [a; w'] = rest + sum of bias in every stage of its integrator.
struct HostWithTanks {
    p: Parameters,
    tanks: Vec<SloshTank>,
    inputs: Inputs,
}

impl HostWithTanks {
    fn rates(&mut self, t: f64, x: &[f64; STATES]) -> [f64; STATES] {
        // The body alone is a craft without tanks; its mass matrix is written out here.
        let (w, m) = (V3::from_column_slice(&x[4..7]), self.p.craft.mass);
        let r = V3::from_column_slice(&self.p.craft.r);
        let j = self.p.craft.j.matrix();
        let arm = r.cross_matrix();
        let i_o = nalgebra::Matrix3::from_fn(|i, k| j[i][k]) - arm * arm * m;
        let mut matrix = SMatrix::<f64, 6, 6>::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(m);
        matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-arm * m));
        matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&(arm * m));
        matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&i_o);
        let [f, tau, h] = ramps(&self.inputs).map(|ramp| V3::from_column_slice(&ramp.at(t)));
        let h_d = V3::from_column_slice(&self.inputs.h_wheels.slope);
        let force = f - w.cross(&w.cross(&r)) * m;
        let torque = tau - h_d - w.cross(&(i_o * w + h));
        let mut rhs = SVector::<f64, 6>::zeros();
        rhs.fixed_rows_mut::<3>(0).copy_from(&force);
        rhs.fixed_rows_mut::<3>(3).copy_from(&torque);
        let omega = [w.x, w.y, w.z];
        for (i, tank) in self.tanks.iter_mut().enumerate() {
            let mut states = tank.continuous_states();
            let at = index::bob(i, 0);
            states[..18].copy_from_slice(&x[at..at + 18]);
            tank.set_continuous_states(&states);
            // Of a and w' neither bias nor added mass knows.
            let out = tank.outputs(&TankInputs { omega, ..TankInputs::default() });
            let mut element = out.added_mass.iter();
            for i in 0..6 {
                for k in i..6 {
                    let x = element.next().unwrap();
                    matrix[(i, k)] += x;
                    if i != k {
                        matrix[(k, i)] += x;
                    }
                }
                rhs[i] += out.bias[i];
            }
        }
        let y = matrix.cholesky().unwrap().solve(&rhs);
        let (a, w_d) = ([y[0], y[1], y[2]], [y[3], y[4], y[5]]);
        let q = nalgebra::Quaternion::new(x[0], x[1], x[2], x[3]).normalize();
        let q_d = q * nalgebra::Quaternion::from_parts(0.0, w) * 0.5;
        let v_d = nalgebra::UnitQuaternion::from_quaternion(q) * V3::from_column_slice(&a);
        let mut rate = [0.0; STATES];
        rate[..4].copy_from_slice(&[q_d.w, q_d.i, q_d.j, q_d.k]);
        rate[4..7].copy_from_slice(&w_d);
        rate[7..10].copy_from_slice(&x[10..13]);
        rate[10..13].copy_from_slice(v_d.as_slice());
        for (i, tank) in self.tanks.iter_mut().enumerate() {
            let (a, omega_dot) = (Ramp::held(a), Ramp::held(w_d));
            let d = tank.derivatives(&TankInputs { a, omega, omega_dot });
            let at = index::bob(i, 0);
            rate[at..at + 18].copy_from_slice(&d[..18]);
        }
        rate
    }
}

type V3 = nalgebra::Vector3<f64>;

/// The same integrator with the same steps around both: what remains is rounding.
#[test]
fn tanks_on_a_host_that_takes_the_split_in_every_stage_are_the_spacecraft() {
    for seed in 0..12 {
        let mut random = Random::new(seed);
        let p = random.parameters();
        let inputs = random.inputs();
        let mut craft = Spacecraft::new(&p, &inputs, 0.0, 1e-9).unwrap();
        let start = craft.continuous_states();
        let (mut whole, mut hung) = (start, start);
        let tanks = p.tank[..p.tanks].iter().map(|&tank| {
            let p = TankParameters { tank, ..TankParameters::default() };
            SloshTank::new(&p, &TankInputs::default(), 0.0, 1e-9).unwrap()
        });
        let mut host = HostWithTanks { p, tanks: tanks.collect(), inputs };
        let craft_rates = |t: f64, x: &[f64; STATES]| {
            craft.set_continuous_states(x);
            craft.derivatives(&after(&inputs, t))
        };
        runge_kutta(craft_rates, &mut whole, 2.0, 100);
        runge_kutta(|t, x| host.rates(t, x), &mut hung, 2.0, 100);
        for i in (0..STATES).filter(|i| *i != index::WORK && *i != index::DISSIPATED) {
            let size = 1.0 + whole[i].abs();
            let off = (whole[i] - hung[i]).abs();
            assert!(off < 1e-11 * size, "{seed} x[{i}] {} {}", whole[i], hung[i]);
        }
    }
}
