//! Tests of Model Exchange, in which the importer integrates the states: a craft, and a tank on a rigid body of
//! the importer's own model.

use craft::{
    Inputs, Mount, Parameters, Ramp, STATES, TANK_STATES, TankInputs, TankParameters, index,
};
use nalgebra::{SMatrix, SVector};

use super::component::{SloshTank, Spacecraft};
use super::random::Random;
use super::seeds::every_or;

/// Returns the inputs at the time t as in Model Exchange: without slopes, and with the wheels' reaction in the torque.
fn after(u: &Inputs, t: f64) -> Inputs {
    let torque = u.torque.value_at(t);
    Inputs {
        force: Ramp::held(u.force.value_at(t)),
        torque: Ramp::held([0, 1, 2].map(|i| torque[i] - u.h_wheels.slope[i])),
        h_wheels: Ramp::held(u.h_wheels.value_at(t)),
        ..Inputs::default()
    }
}

pub fn runge_kutta(
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

/// Co-Simulation integrates by power series. Its result is compared with Runge-Kutta steps of 0.2 ms, or 0.1 ms for craft whose
/// planar modes are faster. The rates of planar modes and of bobs that are not pendulums are computed by contents.rs, not by the
/// series. The fastest bobs move at 30 and 60 1/s, for which the error of the Runge-Kutta method, (30 h)^4/120, is 1e-11. They
/// turn one to two times in a quarter of a second.
#[test]
fn a_model_exchange_host_reproduces_co_simulation_of_a_craft() {
    for seed in every_or(&[0, 1, 3, 12, 16, 18, 21, 24, 28], 0..30) {
        let mut random = Random::new(seed);
        let mut p = random.parameters();
        if seed >= 18 {
            random.flex(&mut p);
        }
        if seed.is_multiple_of(4) {
            (p.mount, p.init.velocity) = (Mount::Pivot, [0.0; 3]);
        }
        if (12..18).contains(&seed) {
            random.make_all_planar(&mut p);
        }
        if seed >= 24 {
            random.spin_all(&mut p);
        }
        if (16..22).contains(&seed) || seed >= 28 {
            random.bend_all(&mut p);
        }
        if seed.is_multiple_of(3) {
            p.tank.iter_mut().for_each(|tank| random.follow(tank));
        }
        let inputs = random.inputs();
        let mut craft = Spacecraft::new(&p, &inputs, 0.0, 1e-13).unwrap();
        let mut own = Spacecraft::new(&p, &inputs, 0.0, 1e-13).unwrap();
        let mut x = craft.continuous_states();
        let rates = |t: f64, x: &[f64; STATES]| {
            craft.set_continuous_states(x);
            craft.derivatives(&after(&inputs, t))
        };
        runge_kutta(rates, &mut x, 0.25, if seed < 12 { 1250 } else { 2500 });
        own.step(&inputs, 0.25).unwrap();
        let want = own.continuous_states();
        for i in 0..STATES {
            let size = 1.0 + want[i].abs();
            assert!((x[i] - want[i]).abs() < 1e-10 * size, "{seed} x[{i}] {} {}", x[i], want[i]);
        }
    }
}

/// A rigid body with attached tanks, which is simulated as an importer of SloshTank would simulate
/// it. Its states are the body's attitude q, angular velocity w, position r and velocity V, and the
/// states of the tanks. Every stage of the integrator solves (M_body + sum of M_a) [a; w'] = rest +
/// sum of bias. M_a and bias are outputs of the tanks, and rest contains all other forces and
/// torques on the body.
pub struct HostWithTanks {
    p: Parameters,
    tanks: Vec<SloshTank>,
    inputs: Inputs,
}

impl HostWithTanks {
    pub fn new(p: &Parameters, inputs: Inputs) -> HostWithTanks {
        let tanks = p.tank[..p.tanks].iter().map(|&tank| {
            let p = TankParameters { tank, ..TankParameters::default() };
            SloshTank::new(&p, &TankInputs::default(), 0.0, 1e-9).unwrap()
        });
        HostWithTanks { p: *p, tanks: tanks.collect(), inputs }
    }

    pub fn rates(&mut self, t: f64, x: &[f64; STATES]) -> [f64; STATES] {
        // The body is a craft without tanks, whose mass matrix is written out here.
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
        let u = after(&self.inputs, t);
        let [f, tau, h] =
            [u.force, u.torque, u.h_wheels].map(|ramp| V3::from_column_slice(&ramp.value));
        let force = f - w.cross(&w.cross(&r)) * m;
        let torque = tau - w.cross(&(i_o * w + h));
        let mut rhs = SVector::<f64, 6>::zeros();
        rhs.fixed_rows_mut::<3>(0).copy_from(&force);
        rhs.fixed_rows_mut::<3>(3).copy_from(&torque);
        let omega = [w.x, w.y, w.z];
        for (i, tank) in self.tanks.iter_mut().enumerate() {
            let mut states = tank.continuous_states();
            let at = index::bob(i, 0);
            states[..18].copy_from_slice(&x[at..at + 18]);
            states[TANK_STATES - 3..].copy_from_slice(&x[index::spin(i)..][..3]);
            tank.set_continuous_states(&states);
            // Neither bias nor added mass depends on a and w' here, so that these inputs may be 0.
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
            let d = tank.derivatives(&TankInputs { a, omega, omega_dot, ..TankInputs::default() });
            let at = index::bob(i, 0);
            rate[at..at + 18].copy_from_slice(&d[..18]);
            rate[index::spin(i)..][..3].copy_from_slice(&d[TANK_STATES - 3..]);
            rate[index::DISSIPATED] += d[18];
        }
        rate
    }
}

type V3 = nalgebra::Vector3<f64>;

/// The rigid body solves for its accelerations with the tanks' added mass and bias
/// ([`Coupling::Split`]) in every stage of its integrator. A Spacecraft is integrated by the same
/// method with the same steps, so that the results differ only by rounding.
#[test]
fn tanks_on_a_host_that_splits_inertia_in_every_stage_move_as_spacecraft() {
    for seed in 0..30 {
        let mut random = Random::new(seed);
        let mut p = random.parameters();
        if (12..23).contains(&seed) {
            random.make_all_planar(&mut p);
        }
        if (20..28).contains(&seed) {
            random.bend_all(&mut p);
        }
        if seed >= 25 {
            random.spin_all(&mut p);
        }
        let inputs = random.inputs();
        let mut craft = Spacecraft::new(&p, &inputs, 0.0, 1e-9).unwrap();
        let start = craft.continuous_states();
        let (mut whole, mut hung) = (start, start);
        let mut host = HostWithTanks::new(&p, inputs);
        let craft_rates = |t: f64, x: &[f64; STATES]| {
            craft.set_continuous_states(x);
            craft.derivatives(&after(&inputs, t))
        };
        runge_kutta(craft_rates, &mut whole, 2.0, 100);
        runge_kutta(|t, x| host.rates(t, x), &mut hung, 2.0, 100);
        for i in (0..STATES).filter(|i| *i != index::WORK) {
            let size = 1.0 + whole[i].abs();
            let off = (whole[i] - hung[i]).abs();
            assert!(off < 1e-11 * size, "{seed} x[{i}] {} {}", whole[i], hung[i]);
        }
    }
}
