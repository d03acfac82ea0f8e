//! Steps over rounded corners in the force laws, near which power series converge only over short times. The errors of these
//! steps must be within the tolerance.

use super::common::bench;
use plant::{FrictionModel, Inputs, Parameters, Plant, Ramp, SloshModel};

struct Row {
    h: f64,
    torque: [f64; 2],
    g: [f64; 2],
}

impl Row {
    fn inputs(&self, t: f64) -> Inputs {
        let along = |[from, to]: [f64; 2]| {
            let slope = (to - from) / self.h;
            Ramp { value: from + slope * t, slope }
        };
        let g = along(self.g);
        let g_axial = Ramp { value: g.value.max(0.0), ..g };
        // The command is at most 0.09 N·m; it crosses zero and the torque limits of most wheels.
        let command = self.torque.map(|torque| 0.3 * torque);
        Inputs { tau_cmd: along(command), tau_ext: along(self.torque), g_axial }
    }
}

fn table(rng: &mut fastrand::Rng, varies: bool) -> Vec<Row> {
    let value = |rng: &mut fastrand::Rng| match rng.usize(..4) {
        0 => 0.0,
        1 => rng.f64() - 0.5,
        _ => 2.0 * rng.f64() - 1.0,
    };
    let next = |rng: &mut fastrand::Rng, last: f64| {
        let from = if rng.usize(..3) == 0 { value(rng) } else { last };
        [from, if rng.usize(..4) == 0 { from } else { value(rng) }]
    };
    let (mut torque, mut g) = (value(rng), 1.0);
    let row = |_| {
        let torques = next(rng, torque);
        let gs = if varies { next(rng, g).map(f64::abs) } else { [1.0; 2] };
        (torque, g) = (torques[1], gs[1]);
        let h = 0.05 * 40f64.powf(rng.f64());
        Row { h, torque: torques.map(|x| 0.3 * x), g: gs.map(|x| 9.81 * x) }
    };
    (0..8).map(row).collect()
}

/// Returns the default bench with a random slosh model and friction law. Each of the following is added with a probability of
/// one half: drag that grows with the amplitude, breaking waves, a ring baffle, a tilt, friction that depends on direction
/// and angle, a spring, and a wheel at its limits.
fn parameters(rng: &mut fastrand::Rng) -> Parameters {
    let slosh = SloshModel::ALL[rng.usize(..SloshModel::ALL.len())];
    let friction = FrictionModel::ALL[rng.usize(..FrictionModel::ALL.len())];
    let mut p = bench(slosh, friction);
    let mut between = |low: f64, high: f64| low + (high - low) * rng.f64();
    p.friction.eps = 10f64.powf(between(-4.0, -1.0));
    p.friction.sigma0 = 100.0 * (p.friction.c + p.friction.d);
    p.friction.sigma1 = 0.0;
    p.slosh.zeta_amplitude = between(-0.1, 0.1).max(0.0);
    p.slosh.zeta_breaking = between(-0.1, 0.1).max(0.0);
    p.slosh.breaking_steepness = between(-0.1, 0.3).max(0.0);
    p.baffle.width = between(-0.02, 0.02).max(0.0);
    p.baffle.depth = 0.01;
    p.bench.tilt = between(-0.05, 0.05).max(0.0);
    p.init.omega = between(-0.2, 0.2);
    p.init.slosh_angle = between(-0.2, 0.2).max(0.0);
    p.init.slosh_angle_radial = between(-0.2, 0.2).max(0.0);
    p.slosh.modes = rng.usize(1..=3);
    p.solver.max_steps = 10_000_000;
    let mut other = fastrand::Rng::with_seed(rng.get_seed());
    let mut half = |size: f64| size * (2.0 * other.f64() - 1.0).max(0.0);
    p.friction.asymmetry = half(0.5);
    p.friction.harmonics_forward = [(); 4].map(|()| half(0.1));
    p.friction.harmonics_backward = [(); 4].map(|()| half(0.1));
    p.friction.sigma1 = half(0.01);
    (p.hub.k, p.hub.imbalance) = (half(0.5), half(0.05));
    p.wheel.enabled = half(1.0) > 0.0;
    p.wheel.tau_max = 0.05 + half(0.2);
    p
}

/// Simulates the inputs in `rows`, each of which lasts for a time `h`, with steps of at most `longest` seconds. Returns the
/// states after each row, or the message of the plant if large waves leave the range of the slosh model.
fn run(p: &Parameters, rows: &[Row], tolerance: f64, longest: f64) -> Result<Vec<f64>, String> {
    let first = rows[0].inputs(0.0);
    let mut plant = Plant::new(p, &first, 0.0, tolerance).map_err(|why| why.join("; "))?;
    let mut all = Vec::new();
    for row in rows {
        let pieces = (row.h / longest).ceil().max(1.0);
        let h = row.h / pieces;
        for k in 0..pieces as usize {
            plant.step(&row.inputs(k as f64 * h), h).map_err(|why| why.to_string())?;
        }
        all.extend_from_slice(plant.continuous_states());
    }
    Ok(all)
}

fn off(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(1.0, |size: f64, x| size.max(x.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size
}

/// Simulates random tables of torque in steps that are as long as the rows of the table, and compares the states with a
/// reference in steps of 1 ms at a tolerance of 1e-13. The allowed error is 30 times the tolerance. Where the motion itself
/// amplifies errors, the allowed error is multiplied by the growth of a small change of the initial state.
fn keep_the_tolerance(seeds: impl Iterator<Item = u64>) {
    let (mut worst, mut compared, mut ended) = ((0.0, 0, 0.0), 0, 0);
    for seed in seeds {
        let mut rng = fastrand::Rng::with_seed(seed);
        let p = parameters(&mut rng);
        let varies = rng.bool();
        let rows = table(&mut rng, varies);
        let Ok(exact) = run(&p, &rows, 1e-13, 1e-3) else {
            ended += 1;
            continue;
        };
        compared += 1;
        let mut near = p;
        near.init.omega += 1e-6;
        let growth = off(&run(&near, &rows, 1e-11, 2e-2).unwrap(), &exact) / 1e-6;
        for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
            let error = off(&run(&p, &rows, tolerance, f64::INFINITY).unwrap(), &exact)
                / tolerance
                / growth.max(1.0);
            let about = (p.slosh.model, p.friction.model);
            assert!(
                error < 30.0,
                "{seed} {about:?}: error is {error} times the tolerance {tolerance:e}"
            );
            if error > worst.0 {
                worst = (error, seed, tolerance);
            }
        }
    }
    assert!(ended * 10 <= compared, "{ended} of {compared} motions end");
    println!("worst error: {:.2} tolerances, seed {} at {:e}", worst.0, worst.1, worst.2);
}

/// The four seeds after the first 60 are random cases that once failed. Seed 1651 had an error of 6e-4 at every tolerance:
/// without specific force the drag of liquid that starts from rest grows with the fourth power of time, which the first
/// terms of its Taylor series do not contain. In seeds 234, 1040 and 1224 the drag has singularities near zero specific
/// force that did not limit the step. In seed 52 a step never ended, because rounding left the torque command just before a
/// limit of the wheel.
#[test]
fn amplitude_damping_keeps_the_solver_tolerance_where_g_vanishes() {
    keep_the_tolerance((0..60).chain([234, 1040, 1224, 1651]));
}

#[test]
#[ignore = "minutes: .ci/run --nightly"]
fn two_thousand_random_tables_of_torque_keep_the_solver_tolerance() {
    keep_the_tolerance(0..2000);
}
