//! Steps of 20 ms for counting instructions: `cost KIND STEPS TOLERANCE`, KIND `one` (one tank,
//! one mode) or `four` (four tanks, three modes each).
//!
//! `valgrind --tool=none` runs it; with `--tool=callgrind --toggle-collect='*Spacecraft*step*'`
//! the instructions of the steps alone are counted.

use craft::{Inputs, Parameters, Ramp, Spacecraft};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let kind = arguments.next().unwrap_or("one".into());
    let steps: usize = arguments.next().map_or(1000, |n| n.parse().unwrap());
    let tolerance: f64 = arguments.next().map_or(1e-9, |x| x.parse().unwrap());
    let mut p = Parameters::default();
    p.tank[0].p_0[0] = [0.1, 0.05, -0.99];
    if kind == "four" {
        p.tanks = 4;
        for (i, tank) in p.tank.iter_mut().enumerate() {
            let (x, y) = [(0.6, 0.6), (0.6, -0.6), (-0.6, 0.6), (-0.6, -0.6)][i];
            tank.position = [x, y, -0.2];
            tank.q = [0.97, 0.1 * x, -0.1 * y, 0.05];
            tank.modes = 3;
            tank.p_0 = [[0.1, 0.05, -0.99]; 3];
        }
    }
    p.init.omega = [0.01, -0.02, 0.03];
    let thrust: f64 = arguments.next().map_or(2400.0, |x| x.parse().unwrap());
    let force = Ramp::held([0.0, 0.0, thrust]);
    let mut craft =
        Spacecraft::new(&p, &Inputs { force, ..Inputs::default() }, 0.0, tolerance).unwrap();
    for k in 0..steps {
        // A torque that swings at the slosh frequency keeps the liquid moving.
        let tau = |k: usize| 20.0 * f64::sin(0.05 * k as f64);
        let torque = Ramp {
            value: [tau(k), 0.5 * tau(k), 0.0],
            slope: [(tau(k + 1) - tau(k)) / 0.02, 0.5 * (tau(k + 1) - tau(k)) / 0.02, 0.0],
        };
        craft.step(&Inputs { force, torque, ..Inputs::default() }, 0.02).unwrap();
    }
    println!("{:?}", craft.continuous_states());
}
