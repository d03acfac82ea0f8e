use analysis::random::Random;
use anyhow::Result;
use identify::engine::profile::OPEN;
use identify::engine::search::solve_near;
use identify::engine::{DECIDES, Hold, Motion, Problem, Recorded, Role, Signal, System, Unknown};
use nalgebra::{Matrix2, Vector2};

/// Simulated friction torque c + d exp(−(ω/ω_s)²) at given rates ω, which are far below the Stribeck speed ω_s. The
/// torque determines c + d and d/ω_s² much better than c, d and ω_s.
struct Bearing(Vec<f64>);

fn shape(rate: f64, speed: f64) -> f64 {
    (-(rate / speed).powi(2)).exp()
}

impl System for Bearing {
    fn run(&self, v: &[f64], _: usize, rows: usize, _: Hold, _: bool) -> Result<Motion> {
        let torque = self.0[..rows].iter().map(|w| v[0] + v[1] * shape(*w, v[2]));
        Ok(Motion { outputs: vec![torque.collect()], ..Motion::default() })
    }
}

/// For a given Stribeck speed ω_s the friction is linear in the coefficients c and d, so that the smallest sum of
/// squares at each ω_s has a closed form.
#[test]
fn the_profile_has_the_smallest_sum_of_squares_at_each_stribeck_speed() {
    let (truth, mut random) = ([0.02, 2.4e-3, 0.09], Random::new(431, 0));
    let rates: Vec<f64> = (0..4000).map(|k| 0.024 * (0.01 * f64::from(k)).sin()).collect();
    let noise = 1e-5;
    let measured: Vec<f64> = rates
        .iter()
        .map(|w| truth[0] + truth[1] * shape(*w, truth[2]) + noise * random.normal())
        .collect();
    let unknown = |name: &str, start: f64, by: f64| {
        Unknown::positive(name, "1", Role::Run(None), start, (start / by, start * by))
    };
    let speed = Unknown { bent: true, ..unknown("omega_s", truth[2], 30.0) };
    let system = Bearing(rates.clone());
    let time = (0..rates.len()).map(|k| 0.02 * k as f64).collect();
    let problem = Problem {
        system: &system,
        recordings: vec![Recorded { name: "a".into(), time, inputs: Vec::new(), step: 0.02 }],
        signals: vec![Signal {
            recording: 0,
            output: 0,
            measured: measured.clone(),
            sampled: vec![true; rates.len()],
            white: noise,
            drift: None,
        }],
        unknowns: vec![unknown("c", truth[0], 1e4), unknown("d", truth[1], 1e4), speed],
        starts: vec![truth.to_vec()],
        holds: vec![Hold::FirstOrderHold],
        acausal: true,
        drawn: 0,
        rough: false,
    };
    let found = solve_near(&problem, &truth, &mut |_| {}).unwrap();
    let white = found.fit.noise[0].white;
    let floor = |speed: f64| {
        let rows = || rates.iter().map(|w| Vector2::new(1.0, shape(*w, speed))).zip(&measured);
        let normal: Matrix2<f64> = rows().map(|(a, _)| a * a.transpose()).sum();
        let right: Vector2<f64> = rows().map(|(a, y)| a * *y).sum();
        let x = normal.try_inverse().unwrap() * right;
        rows().map(|(a, y)| ((y - a.dot(&x)) / white).powi(2)).sum::<f64>()
    };
    let (_, points) = found.profile.as_ref().unwrap();
    let costs: Vec<(f64, f64)> =
        points.iter().map(|p| (p.minimum.point.cost, floor(p.at.exp()))).collect();
    let least = costs.iter().map(|c| c.1).fold(f64::INFINITY, f64::min);
    for (cost, floor) in costs.iter().filter(|c| c.1 < least + DECIDES) {
        assert!(cost - floor < 0.3, "{costs:?}");
    }
    assert!(costs[0].0 > least + OPEN && costs[costs.len() - 1].0 > least + OPEN, "{costs:?}");
}
