//! Identification of friction and inertia, on recordings of a bench whose equations are independent of the FMU.

use std::collections::BTreeMap;

use analysis::random::Random;
use experiments::profile::Torque;
use host::fmu::Fmu;
use identify::bench::identification::Identification;
use identify::bench::options::Options;
use identify::bench::simulate::Setup;
use identify::engine::Hold;
use identify::estimate::Combination;
use identify::estimate::Estimated;
use identify::input::recording::Recording;
use identify::input::tolerance::Tolerances;
use identify::methods::friction;
use identify::words::verdict::DOES_NOT_FIT;
use pack::packed_for_tests;

use crate::bench::{Bench, Drive};
use crate::fmu_twin::{self, SensorErrors, Twin};
use crate::runs::{self, SETS, Set, recordings};

const ASYMMETRY: f64 = 0.15;
/// Standard deviation of the noise of the thesis's gyro in one row at 50 Hz, rad/s.
const NOISE: f64 = 4.066e-4;

/// Returns a recording of a push of 0.1 N·m for 5 s forwards (`way` 1) or backwards (−1), followed by a free decay to rest.
pub fn push(seed: u64, way: f64) -> Recording {
    let time: Vec<f64> = (0..=3000).map(|k| 0.02 * f64::from(k)).collect();
    let tau: Vec<f64> =
        time.iter().map(|t| if (1.0..6.0).contains(t) { 0.1 * way } else { 0.0 }).collect();
    let motion = runs::bench(ASYMMETRY).motion(&Drive::Lines(&time, &tau), &time);
    let mut random = Random::new(seed, 9);
    let rate = motion.rate.iter().map(|w| w + NOISE * random.normal()).collect();
    Recording::of("push", time, tau, rate)
}

/// Asserts that the verdict reports the asymmetry as not determined, and that the friction in the direction `way` is within four
/// standard deviations of the true value.
pub fn is_one_way(
    parameters: &BTreeMap<String, Estimated>,
    combinations: &[Combination],
    verdict: &[String],
    way: f64,
) {
    for name in ["friction.asymmetry", "friction.c", "friction.d"] {
        let p = &parameters[name];
        assert!(!p.determined, "{name}: {p:?}");
    }
    let bearing = Bench::default().bearing;
    let [low, high] = parameters["friction.asymmetry"].interval;
    assert!((low..=high).contains(&ASYMMETRY));
    for (name, truth) in [("friction.c", bearing.c), ("friction.d", bearing.d)] {
        let sign = if way > 0.0 { '+' } else { '-' };
        let known = format!("{name} (1 {sign} friction.asymmetry)");
        let combination = combinations.iter().find(|c| c.name == known).unwrap();
        let off = (combination.value - truth * (1.0 + way * ASYMMETRY)) / combination.std;
        assert!(off.abs() < 4.0, "{combination:?}");
        assert!(verdict.iter().any(|line| line.contains(&known)), "{verdict:?}");
        let [low, high] = parameters[name].interval;
        assert!((low..=high).contains(&truth), "{name}: {low} to {high}");
    }
}

pub fn options() -> Options {
    Options {
        settings: vec![("tank.h".into(), "0.1".into())],
        gyro_scale: 0.0,
        tolerances: Tolerances::NONE,
        ..Options::default()
    }
}

fn fit(recordings: &[Recording], options: &Options) -> anyhow::Result<Identification> {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let rates: Vec<Recording> =
        recordings.iter().map(|r| Recording { angle: None, ..r.clone() }).collect();
    friction::identify(&fmu, &rates, options, &mut |_| {})
}

/// Returns the parameters that differ from the true value by three standard deviations or more. Also asserts that the fit ends at
/// a minimum with no parameter at a bound.
fn wrong(set: &Set, seed: u64, bias: f64, asymmetry: f64) -> Vec<String> {
    let found = fit(&recordings(set, seed, bias, asymmetry), &options()).unwrap();
    assert!(found.converged && found.fits == Some(true), "{seed}: {:?}", found.verdict);
    let bearing = Bench::default().bearing;
    let mut wrong = Vec::new();
    for (name, truth) in [
        ("hub.I", Bench::default().hub_inertia),
        ("friction.b", bearing.b),
        ("friction.c", bearing.c),
        ("friction.d", bearing.d),
        ("friction.omega_s", bearing.omega_s),
        ("friction.asymmetry", asymmetry),
        ("gyro_bias[1]", bias),
        ("gyro_bias[2]", bias),
        ("gyro_bias[3]", bias),
    ] {
        let p = found.parameters.get(name).unwrap_or_else(|| &found.measurement[name]);
        let off = (p.value - truth) / p.std;
        println!("{}, {seed}: {name} {:.4e} ± {:.1e}, {off:+.2} σ", set.name, p.value, p.std);
        // a correct estimate exceeds this limit by chance in one of 370 cases
        wrong.extend(
            (off.abs() >= 3.0).then(|| format!("{}, {seed}: {name} {off:+.1} σ", set.name)),
        );
        let limit = match name {
            // the hub rests for 4 s before the ramp breaks it away, which determines the bias to 5e-5 rad/s
            "gyro_bias[1]" => 1e-4,
            // the other recordings may contain no rest, so that they need not determine the bias
            "gyro_bias[2]" | "gyro_bias[3]" => f64::INFINITY,
            _ => 0.3 * truth.abs(),
        };
        assert!(p.std < limit, "{seed}: {name} {p:?}");
    }
    wrong
}

fn all_sets(seeds: std::ops::RangeInclusive<u64>) -> Vec<String> {
    let of = |set| seeds.clone().flat_map(move |seed| wrong(set, seed, 0.002, ASYMMETRY));
    SETS.iter().flat_map(of).collect()
}

/// With seed 2 of the first set, an earlier search left out rows at rest, and alternated between two choices of these rows,
/// because each choice gave a gyro bias that led to the other choice. It accepted a fit in which `friction.d` was wrong by
/// 3.4 standard deviations, and the gyro's bias by 4.9.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn friction_fits_of_three_sets_of_runs_end_in_no_false_minimum() {
    assert_eq!(all_sets(1..=2), [""; 0]);
}

#[test]
#[ignore = "13 s of CPU time: .ci/run --nightly"]
fn friction_fits_of_eighteen_more_runs_end_in_no_false_minimum() {
    assert_eq!(all_sets(3..=8), [""; 0]);
}

#[test]
fn identify_finds_a_friction_asymmetry_of_the_opposite_sign() {
    assert_eq!(wrong(&SETS[0], 2, 0.002, -ASYMMETRY), [""; 0]);
}

#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn a_gyro_bias_of_5_degrees_per_second_does_not_mislead_the_friction_fit() {
    assert_eq!(wrong(&SETS[0], 4, 0.087, ASYMMETRY), [""; 0]);
}

#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn the_tank_counts_as_empty_unless_the_settings_state_its_liquid() {
    let recordings = recordings(&SETS[2], 1, 0.0, ASYMMETRY);
    let with = |settings| fit(&recordings, &Options { settings, ..options() }).unwrap();
    let (empty, full) = (with(Vec::new()), with(options().settings));
    let bench = Bench::default();
    let liquid = bench.density * std::f64::consts::PI / 4.0 * bench.diameter.powi(2) * bench.height;
    let inertia = |found: &Identification| found.parameters["hub.I"].value;
    let difference = inertia(&empty) - inertia(&full);
    assert!((difference / (liquid * bench.arm.powi(2)) - 1.0).abs() < 1e-3, "{difference}");
    let is_said = |found: &Identification| {
        found.verdict.iter().any(|line| line.starts_with("The tank is taken as empty"))
    };
    assert!(is_said(&empty) && !is_said(&full));
    // the points of measured friction lie on the friction law
    let number = |name: &str| empty.parameters[name].value;
    let law = |w: f64| number("friction.b") * w + w.signum() * number("friction.c");
    let points = &empty.details.friction_points;
    let fast: Vec<_> = points.iter().filter(|p| p.rate.abs() > 0.3 && p.rows > 20).collect();
    assert!(fast.len() > 3, "{points:?}");
    for p in fast {
        // the asymmetry changes the friction by 15 % of the dry friction c
        assert!((p.torque / law(p.rate) - 1.0).abs() < 0.15, "{p:?} {}", law(p.rate));
    }
}

/// The recordings are too short (0.8 s), without torque, or of a hub that does not move. The error says what to record.
#[test]
fn recordings_that_show_no_friction_are_refused_with_advice() {
    let [_, step, _] = &recordings(&SETS[0], 1, 0.0, ASYMMETRY)[..] else { panic!("three runs") };
    let said = |recording: Recording| fit(&[recording], &options()).unwrap_err().to_string();
    let short = said(step.between(5.0, 5.8));
    assert!(short.contains("it lasts") && short.contains("Record a ramp"), "{short}");
    let free = said(Recording { torque: vec![0.0; step.time.len()], ..step.clone() });
    assert!(free.contains("the torque is 0 in every row"), "{free}");
    let still = said(Recording { torque: vec![0.003; 200], ..step.between(0.0, 3.99) });
    assert!(still.contains("does not move") && still.contains("3.0e-3 N·m"), "{still}");
}

/// A push and a free decay in one direction determine only the products c (1 + asymmetry) and d (1 + asymmetry).
#[test]
fn a_hub_that_turns_one_way_determines_the_friction_in_that_direction_only() {
    for way in [1.0, -1.0] {
        let found = fit(&[push(1, way)], &options()).unwrap();
        assert!(found.fits == Some(true), "{:?}", found.verdict);
        is_one_way(&found.parameters, &found.details.combinations, &found.verdict, way);
    }
}

fn rigid(fmu: &Fmu, settings: &[(&str, &str)], torque: &str) -> Recording {
    let torque = Torque::Profile(torque.parse().unwrap());
    let settings = [&[("slosh.model", "frozen")], settings].concat();
    let mut one =
        fmu_twin::record(fmu, &settings, &torque, Some(3), SensorErrors::default()).unwrap();
    let text = |(name, value): &(&str, &str)| (name.to_string(), value.to_string());
    let setup =
        Setup { settings: settings.iter().map(text).collect(), intersample: Hold::FirstOrderHold };
    one.angle = Some(setup.run(fmu, &[], &one, 0.0).unwrap().angle);
    one
}

/// A held torque acts half a row late, which is a phase of 8.6° at 2.4 Hz. A fit with a linear torque would attribute
/// this phase to friction.
#[test]
fn a_zero_order_hold_of_the_torque_is_recognised() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque =
        Torque::Profile("lin-sweep:amplitude=0.1,f0=1.25,f1=3.5,duration=100".parse().unwrap());
    let settings = vec![("slosh.model".to_string(), "frozen".to_string())];
    let twin = Twin { settings, intersample: Hold::ZeroOrderHold, ..Twin::default() };
    let recordings = [twin.record(&fmu, &torque, Some(3)).unwrap()];
    let found = fit(&recordings, &options()).unwrap();
    for (name, truth) in [("hub.I", 0.322414), ("friction.b", 0.03793)] {
        let p = &found.parameters[name];
        // a correct estimate exceeds this limit in one of 16,000 draws of the noise
        assert!((p.value - truth).abs() < 4.0 * p.std, "{name}: {p:?}");
    }
    assert_eq!(found.fits, Some(true), "{:?}", found.verdict);
}

#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn a_recording_with_sloshing_liquid_does_not_fit_the_rigid_model_of_the_friction_fit() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque = "lin-sweep:amplitude=0.1,f0=1.8,f1=3,duration=150";
    let found = fit(&[rigid(&fmu, &[("slosh.model", "linear")], torque)], &options()).unwrap();
    assert!(found.fits == Some(false) && found.verdict.iter().any(|l| l.starts_with(DOES_NOT_FIT)));
}

/// The recording has pulses in both directions, each followed by a decay of 5 s. The friction has an asymmetry of 0.15 and varies
/// over the angle by 0.2.
#[test]
#[ignore = "ten seconds of CPU time: .ci/long-tests"]
fn the_dependence_of_friction_on_direction_and_angle_is_estimated_from_free_decays() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let bench = [("friction.asymmetry", "0.15"), ("friction.forward_cos1", "0.2")];
    // alternating pulses, each followed by 5 s of decay
    let (mut time, mut tau) = (Vec::new(), Vec::new());
    for k in 0..7_500 {
        let t = 0.02 * f64::from(k);
        let (number, within) = ((t / 10.0) as usize, t % 10.0);
        // at 0.8 rad/s the hub turns by several radians, so that all angles occur
        let sign =
            if (number / 2).is_multiple_of(2) == number.is_multiple_of(2) { 1.0 } else { -1.0 };
        time.push(t);
        tau.push(if within < 1.5 { 0.2 * sign } else { 0.0 });
    }
    let torque = Torque::rows(&time, &tau, None, false).unwrap();
    let settings = [&[("slosh.model", "frozen")], &bench[..]].concat();
    let mut one =
        fmu_twin::record(&fmu, &settings, &torque, Some(3), SensorErrors::default()).unwrap();
    let text = |(name, value): &(&str, &str)| (name.to_string(), value.to_string());
    let setup =
        Setup { settings: settings.iter().map(text).collect(), intersample: Hold::FirstOrderHold };
    one.angle = Some(setup.run(&fmu, &[], &one, 0.0).unwrap().angle);
    let found = friction::identify(&fmu, &[one], &options(), &mut |_| {}).unwrap();
    let [ahead, back] = &found.details.braking[..] else { panic!("{:?}", found.details.braking) };
    // dry friction is larger forwards, so that the preferential direction of rotation is backwards
    assert!(-ahead.coefficients[0] > back.coefficients[0], "{ahead:?} {back:?}");
}
