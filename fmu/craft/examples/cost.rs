//! Steps of 20 ms for counting instructions: `cost KIND STEPS TOLERANCE`.
//!
//! | KIND | what |
//! | --- | --- |
//! | `hubslosh` | HubSlosh's bench, spherical model, no friction |
//! | `bench` | a craft with the same liquid, one tank and one mode, under 1 g, held to one axis by its mass |
//! | `one` | 1180 kg under 2400 N, one tank, one mode |
//! | `two` | the same, two tanks of one mode, as in the comparison with Basilisk |
//! | `four` | the same, four tanks of three modes each |
//!
//! `valgrind --tool=callgrind --toggle-collect='*Spacecraft*step*' cost bench 1000 1e-6` counts the
//! steps alone (`'*Plant*step*'` for `hubslosh`).

use craft::{Inertia, Inputs, Parameters, Ramp, Spacecraft};
use plant::{FrictionModel, Plant, SloshModel};

const STEP: f64 = 0.02;

/// A torque that swings at w rad/s, from knot k to the next, and its slope.
fn torque(size: f64, w: f64, k: usize) -> (f64, f64) {
    let at = |k: usize| size * f64::sin(w * STEP * k as f64);
    (at(k), (at(k + 1) - at(k)) / STEP)
}

fn hubslosh(steps: usize, tolerance: f64) {
    let mut p = plant::Parameters::default();
    p.slosh.model = SloshModel::Spherical;
    p.friction.model = FrictionModel::None;
    p.init.slosh_angle = 0.1;
    p.init.slosh_angle_radial = 0.05;
    let mut plant = Plant::new(&p, &plant::Inputs::default(), 0.0, tolerance).unwrap();
    for k in 0..steps {
        let (value, slope) = torque(0.05, 13.0, k);
        let tau_cmd = plant::Ramp { value, slope };
        plant.step(&plant::Inputs { tau_cmd, ..plant::Inputs::default() }, STEP).unwrap();
    }
}

fn spacecraft(kind: &str, steps: usize, tolerance: f64) {
    let mut p = Parameters::default();
    p.tank[0].p_0[0] = [0.05, 0.1, -0.99];
    let (mut thrust, mut size, mut w) = (2400.0, 20.0, 2.5);
    match kind {
        "bench" => {
            let mass = 1e9;
            p.craft.mass = mass;
            p.craft.r = [0.0; 3];
            p.craft.j = Inertia { xx: mass, yy: mass, zz: 0.322414, xy: 0.0, xz: 0.0, yz: 0.0 };
            let tank = &mut p.tank[0];
            (tank.position, tank.g_ref) = ([0.225, 0.0, 0.0], 9.81);
            (tank.diameter, tank.depth) = (0.163, 0.10);
            (thrust, size, w) = (mass * 9.81, 0.05, 13.0);
        }
        "two" => {
            p.tanks = 2;
            p.tank[1].p_0[0] = [-0.02, 0.05, -0.99];
            (p.tank[0].position, p.tank[1].position) = ([0.6, 0.0, 0.0], [-0.6, 0.0, 0.0]);
            p.init.omega = [0.01, -0.02, 0.03];
        }
        "four" => {
            p.tanks = 4;
            for (i, tank) in p.tank.iter_mut().enumerate() {
                let (x, y) = [(0.6, 0.6), (0.6, -0.6), (-0.6, 0.6), (-0.6, -0.6)][i];
                tank.position = [x, y, -0.2];
                tank.q = [0.97, 0.1 * x, -0.1 * y, 0.05];
                tank.modes = 3;
                tank.p_0 = [[0.1, 0.05, -0.99]; 3];
            }
            p.init.omega = [0.01, -0.02, 0.03];
        }
        _ => p.init.omega = [0.01, -0.02, 0.03],
    }
    let force = Ramp::held([0.0, 0.0, thrust]);
    let mut craft =
        Spacecraft::new(&p, &Inputs { force, ..Inputs::default() }, 0.0, tolerance).unwrap();
    for k in 0..steps {
        let (value, slope) = torque(size, w, k);
        let across = if kind == "bench" { 0.0 } else { 1.0 };
        let torque = Ramp {
            value: [across * value, 0.5 * across * value, value],
            slope: [across * slope, 0.5 * across * slope, slope],
        };
        craft.step(&Inputs { force, torque, ..Inputs::default() }, STEP).unwrap();
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let kind = arguments.next().unwrap_or("one".into());
    let steps: usize = arguments.next().map_or(1000, |n| n.parse().unwrap());
    let tolerance: f64 = arguments.next().map_or(1e-6, |x| x.parse().unwrap());
    match &*kind {
        "hubslosh" => hubslosh(steps, tolerance),
        _ => spacecraft(&kind, steps, tolerance),
    }
}
