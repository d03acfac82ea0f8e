//! Friction and inertia from the acceleration, on recordings of a bench that is not the FMU.

use std::collections::BTreeMap;

use analysis::random::Random;
use host::fmu::Fmu;
use identify::estimate::Estimated;
use identify::methods::acceleration::{self, Weights};
use identify::recording::Recording;
use identify::uncertainty::Combination;
use pack::packed_for_tests;

use crate::bench::{Bearing, Bench, Drive, Liquid};

/// Asymmetry of the bearing in these recordings.
const ASYMMETRY: f64 = 0.15;
/// Noise of a row of the thesis's gyro at 50 Hz and its least step, rad/s.
const GYRO: (f64, f64) = (4.066e-4, 1.53e-4);

/// A ramp, a step and a sweep of 120 s each on the thesis's bench with a rigid liquid, and the encoder's angle.
fn recordings(seed: u64, bias: f64) -> Vec<Recording> {
    let time: Vec<f64> = (0..=6000).map(|k| 0.02 * f64::from(k)).collect();
    let sweep = |t: f64| 0.1 * (std::f64::consts::TAU * (1.25 * t + 2.25 / 240.0 * t * t)).sin();
    let courses: [&dyn Fn(f64) -> f64; 3] = [
        // up to 0.12 N·m and back through zero to the same torque backwards
        &|t| if t < 60.0 { 0.002 * t } else { 0.12 - 0.004 * (t - 60.0) },
        &|t| if !(5.0..65.0).contains(&t) { 0.0 } else { 0.05 },
        &sweep,
    ];
    let bearing = Bearing { asymmetry: ASYMMETRY, ..Bench::default().bearing };
    let bench = Bench { liquid: Liquid::Frozen, bearing, ..Bench::default() };
    let record = |(number, torque): (usize, &&dyn Fn(f64) -> f64)| {
        let tau: Vec<f64> = time.iter().map(|t| torque(*t)).collect();
        let motion = bench.motion(&Drive::Lines(&time, &tau), &time);
        let mut random = Random::new(seed, number as u64);
        let mut read = |w: &f64| ((w + bias + GYRO.0 * random.normal()) / GYRO.1).round() * GYRO.1;
        let rate = motion.rate.iter().map(&mut read).collect();
        let recording = Recording::of("bench", time.clone(), tau, rate);
        Recording { angle: Some(motion.angle), ..recording }
    };
    courses.iter().enumerate().map(record).collect()
}

/// A push of 0.1 N·m for 5 s forwards (1) or backwards (−1), and the free decay to rest.
pub fn push(seed: u64, way: f64) -> Recording {
    let time: Vec<f64> = (0..=3000).map(|k| 0.02 * f64::from(k)).collect();
    let tau: Vec<f64> =
        time.iter().map(|t| if (1.0..6.0).contains(t) { 0.1 * way } else { 0.0 }).collect();
    let bearing = Bearing { asymmetry: ASYMMETRY, ..Bench::default().bearing };
    let bench = Bench { liquid: Liquid::Frozen, bearing, ..Bench::default() };
    let motion = bench.motion(&Drive::Lines(&time, &tau), &time);
    let mut random = Random::new(seed, 9);
    let rate = motion.rate.iter().map(|w| w + GYRO.0 * random.normal()).collect();
    Recording::of("push", time, tau, rate)
}

/// The verdict calls the asymmetry not determined, and the friction of the one `way` is within four standard deviations of the truth.
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

pub fn options(harmonics: usize) -> acceleration::Options {
    acceleration::Options {
        weights: Weights::Uniform,
        bounds: Vec::new(),
        starts: Vec::new(),
        harmonics,
        settings: Vec::new(),
        held: false,
    }
}

/// The parameters that are three standard deviations or more from the truth; the fit is a minimum, and none is at a bound.
fn wrong(seed: u64, harmonics: usize, bias: f64) -> Vec<String> {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let found = acceleration::identify(&fmu, &recordings(seed, bias), &options(harmonics)).unwrap();
    assert!(found.converged && found.fits == Some(true), "{seed}: {:?}", found.verdict);
    assert!(found.details.at_bound.is_empty(), "{seed}: {:?}", found.details.at_bound);
    let bearing = Bench::default().bearing;
    let mut wrong = Vec::new();
    for (name, truth) in [
        ("hub.I", Bench::default().hub_inertia),
        ("friction.b", bearing.b),
        ("friction.c", bearing.c),
        ("friction.d", bearing.d),
        ("friction.omega_s", bearing.omega_s),
        ("friction.asymmetry", ASYMMETRY),
        ("gyro_bias[1]", bias),
    ] {
        let p = found.parameters.get(name).unwrap_or_else(|| &found.measurement[name]);
        let off = (p.value - truth) / p.std;
        println!(
            "{seed}, {harmonics} harmonics: {name} {:.4e} ± {:.1e}, {off:+.2} σ",
            p.value, p.std
        );
        // one of 370 is further off by chance, and the seeds are fixed
        wrong
            .extend((off.abs() >= 3.0).then(|| format!("{seed}, {harmonics}: {name} {off:+.1} σ")));
        // the hub rests for 4 s before the ramp breaks it away: 5e-5 rad/s
        let sure = p.std < if name.starts_with("gyro") { 1e-4 } else { 0.3 * truth };
        assert!(sure, "{seed}: {name} {p:?}");
    }
    wrong
}

/// Seed 2 failed while the rows at rest did not count: two choices of rows that stick alternated, each by the bias that the other
/// one gives. `friction.d` was 3.4 standard deviations off and the bias of the ramp 4.9, and the fit was accepted.
#[test]
fn friction_of_eight_recordings_ends_in_no_false_minimum() {
    let all = (1..=8).flat_map(|seed| [wrong(seed, 0, 0.002), wrong(seed, 1, 0.002)].concat());
    assert_eq!(all.collect::<Vec<_>>(), [""; 0]);
}

#[test]
fn a_bias_of_five_degrees_a_second_leads_to_no_false_minimum() {
    assert_eq!(wrong(4, 0, 0.087), [""; 0]);
}

/// A start far off does not lead astray, and a start of what is not a unknown is refused.
#[test]
fn a_start_is_taken_besides_those_of_the_data() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let recordings = recordings(1, 0.0);
    let fit = |starts: &[(&str, f64)]| {
        let starts = starts.iter().map(|(name, value)| (name.to_string(), *value)).collect();
        let options = acceleration::Options { starts, ..options(0) };
        acceleration::identify(&fmu, &recordings, &options)
    };
    let (own, far) = (fit(&[]).unwrap(), fit(&[("friction.omega_s", 5.0)]).unwrap());
    for (name, p) in &own.parameters {
        let off = (far.parameters[name].value - p.value) / p.std;
        // searches end within 1e-9 of the sum of squares
        assert!(off.abs() < 0.01, "{name}: {off}");
    }
    let error = fit(&[("tank.d", 0.2)]).unwrap_err().to_string();
    assert!(error.contains("there is no start to give for tank.d (there are hub.I"), "{error}");
}

/// A push and the free decay after it: c and d go with 1 + asymmetry alone.
#[test]
fn a_hub_that_turns_one_way_determines_the_friction_of_that_way_alone() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    for way in [1.0, -1.0] {
        let recording = push(1, way);
        let found = acceleration::identify(&fmu, &[recording], &options(0)).unwrap();
        assert!(found.fits == Some(true), "{:?}", found.verdict);
        is_one_way(&found.parameters, &found.details.combinations, &found.verdict, way);
    }
}
