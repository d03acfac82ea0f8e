//! Friction and inertia from the acceleration, on recordings of a bench that is not the FMU.

use std::collections::BTreeMap;

use analysis::random::Random;
use host::fmu::Fmu;
use identify::estimate::Estimated;
use identify::input::recording::Recording;
use identify::methods::acceleration::{self, Acceleration};
use identify::methods::{Method, Task};
use identify::uncertainty::bench::sources::Combination;
use pack::packed_for_tests;

use crate::bench::{Bench, Drive};
use crate::runs::{self, SETS, Set, recordings};

/// Asymmetry of the bearing in these recordings.
const ASYMMETRY: f64 = 0.15;
/// Noise of a row of the thesis's gyro at 50 Hz, rad/s.
const NOISE: f64 = 4.066e-4;

/// A push of 0.1 N·m for 5 s forwards (1) or backwards (−1), and the free decay to rest.
pub fn push(seed: u64, way: f64) -> Recording {
    let time: Vec<f64> = (0..=3000).map(|k| 0.02 * f64::from(k)).collect();
    let tau: Vec<f64> =
        time.iter().map(|t| if (1.0..6.0).contains(t) { 0.1 * way } else { 0.0 }).collect();
    let motion = runs::bench(ASYMMETRY).motion(&Drive::Lines(&time, &tau), &time);
    let mut random = Random::new(seed, 9);
    let rate = motion.rate.iter().map(|w| w + NOISE * random.normal()).collect();
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
    let settings = vec![("tank.h".into(), "0.1".into())];
    acceleration::Options { harmonics, settings, ..acceleration::Options::default() }
}

/// The parameters that are three standard deviations or more from the truth; the fit is a minimum, and none is at a bound.
fn wrong(set: &Set, seed: u64, harmonics: usize, bias: f64, asymmetry: f64) -> Vec<String> {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let recordings = recordings(set, seed, bias, asymmetry);
    // as the command does
    let task = Task { fmu: Some(&fmu), recordings: &recordings, validation: &[] };
    let method = Acceleration { options: options(harmonics) };
    let found = method.identify(&task, &mut |_| {}).unwrap();
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
        ("friction.asymmetry", asymmetry),
        ("gyro_bias[1]", bias),
        ("gyro_bias[2]", bias),
        ("gyro_bias[3]", bias),
    ] {
        let p = found.parameters.get(name).unwrap_or_else(|| &found.measurement[name]);
        let off = (p.value - truth) / p.std;
        println!(
            "{}, {seed}, {harmonics} harmonics: {name} {:.4e} ± {:.1e}, {off:+.2} σ",
            set.name, p.value, p.std
        );
        // one of 370 is further off by chance, and the seeds are fixed
        wrong.extend(
            (off.abs() >= 3.0)
                .then(|| format!("{}, {seed}, {harmonics}: {name} {off:+.1} σ", set.name)),
        );
        let limit = match name {
            // the hub rests for 4 s before the ramp breaks it away: 5e-5 rad/s
            "gyro_bias[1]" => 1e-4,
            // the other recordings need not show a rest
            "gyro_bias[2]" | "gyro_bias[3]" => f64::INFINITY,
            _ => 0.3 * truth.abs(),
        };
        assert!(p.std < limit, "{seed}: {name} {p:?}");
    }
    wrong
}

/// Fits each seed of each set of runs.
fn all_sets(seeds: std::ops::RangeInclusive<u64>) -> Vec<String> {
    let of = |set| seeds.clone().flat_map(move |seed| wrong(set, seed, 0, 0.002, ASYMMETRY));
    SETS.iter().flat_map(of).collect()
}

/// Seed 2 of the first set failed while the rows at rest did not count: two choices of rows that stick alternated, each by the bias that
/// the other one gives. `friction.d` was 3.4 standard deviations off and the bias of the ramp 4.9, and the fit was accepted.
#[test]
fn friction_of_three_sets_of_runs_ends_in_no_false_minimum() {
    assert_eq!(all_sets(1..=2), [""; 0]);
}

/// The other six seeds of each set.
#[test]
#[ignore = "13 s of CPU time: .ci/run --nightly"]
fn friction_of_eighteen_more_runs_ends_in_no_false_minimum() {
    assert_eq!(all_sets(3..=8), [""; 0]);
}

/// The preferential direction came back with the opposite sign and at its bound.
#[test]
fn the_preferential_direction_comes_back_with_harmonics_of_the_angle() {
    let either = |seed: u64| {
        let asymmetry = if seed.is_multiple_of(2) { -ASYMMETRY } else { ASYMMETRY };
        wrong(&SETS[0], seed, 1 + seed as usize % 2, 0.002, asymmetry)
    };
    assert_eq!((1..=4).flat_map(either).collect::<Vec<_>>(), [""; 0]);
}

/// Eight seeds with harmonics of either direction: 1 min.
#[test]
#[ignore = "takes minutes: cargo test --release -p identify --test all -- --ignored direction_of_every"]
fn the_preferential_direction_of_every_seed_comes_back_with_two_harmonics() {
    let mut all = Vec::new();
    for seed in 1..=8 {
        for asymmetry in [ASYMMETRY, -ASYMMETRY] {
            all.extend(wrong(&SETS[0], seed, 2, 0.002, asymmetry));
        }
    }
    assert_eq!(all, [""; 0]);
}

#[test]
fn a_bias_of_five_degrees_a_second_leads_to_no_false_minimum() {
    assert_eq!(wrong(&SETS[0], 4, 0, 0.087, ASYMMETRY), [""; 0]);
}

/// A torque that is 2 % larger than recorded makes inertia and friction 2 % smaller.
#[test]
fn a_tolerance_of_the_torque_widens_the_intervals_of_what_goes_with_it() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let mut recordings = recordings(&SETS[0], 1, 0.002, ASYMMETRY);
    recordings.iter_mut().flat_map(|r| &mut r.torque).for_each(|torque| *torque /= 1.02);
    let fit = |torque_scale: f64| {
        let options = acceleration::Options { torque_scale, ..options(0) };
        acceleration::identify(&fmu, &recordings, &options).unwrap()
    };
    let (exact, vague) = (fit(0.0), fit(0.02));
    let bench = Bench::default();
    for (name, truth) in [
        ("hub.I", bench.hub_inertia),
        ("friction.b", bench.bearing.b),
        ("friction.omega_s", bench.bearing.omega_s),
    ] {
        let (a, b) = (&exact.parameters[name], &vague.parameters[name]);
        let inside = (b.interval[0]..b.interval[1]).contains(&truth);
        assert!(inside && (a.value - b.value).abs() < 1e-9 * a.value, "{name}: {b:?}");
        assert!((b.std_noise - a.std).abs() < 1e-9 * a.std, "{name}: {a:?} {b:?}");
    }
    let [a, b] = [&exact, &vague].map(|found| &found.parameters["hub.I"]);
    assert!(a.interval[1] < bench.hub_inertia, "{a:?}");
    // the scale acts on all the inertia that turns
    let total = vague.measurement["inertia"].value;
    assert!((b.std.powi(2) - a.std.powi(2) - (0.02 * total).powi(2)).abs() < 1e-9, "{a:?} {b:?}");
    let said = |found: &acceleration::Found| {
        found.verdict.iter().any(|l| l.contains("scale of the torque 2 %"))
    };
    assert!(said(&vague) && !said(&exact), "{:?}", vague.verdict);
}

#[test]
fn searches_from_afar_end_at_the_same_minimum_or_higher() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let options = acceleration::Options { start_study: 2, ..options(0) };
    let recordings = recordings(&SETS[2], 1, 0.0, ASYMMETRY);
    let found = acceleration::identify(&fmu, &recordings, &options).unwrap();
    let trials = &found.details.starts;
    assert_eq!(trials.len(), 10);
    assert!(trials.iter().all(|trial| trial.more.is_some_and(|more| more > -0.5)), "{trials:?}");
    assert!(trials.iter().filter(|trial| trial.is_same()).count() >= 5, "{trials:?}");
    assert!(found.verdict.iter().any(|line| line.contains("of 10 starts")), "{:?}", found.verdict);
}

#[test]
fn recordings_that_show_no_friction_are_refused_with_what_to_do() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let [_, step, _] = &recordings(&SETS[0], 1, 0.0, ASYMMETRY)[..] else { panic!("three runs") };
    let said = |recording: Recording| {
        acceleration::identify(&fmu, &[recording], &options(0)).unwrap_err().to_string()
    };
    let short = said(step.between(5.0, 5.8));
    assert!(short.contains("it lasts") && short.contains("Record a ramp"), "{short}");
    let free = said(Recording { torque: vec![0.0; step.time.len()], ..step.clone() });
    assert!(free.contains("the torque is 0 in every row"), "{free}");
    let still = said(Recording { torque: vec![0.003; 200], ..step.between(0.0, 3.99) });
    assert!(still.contains("does not move") && still.contains("3.0e-3 N·m"), "{still}");
    // moving all the time
    let found = acceleration::identify(&fmu, &[step.between(10.0, 60.0)], &options(0));
    if let Ok(found) = found {
        let said = |line: &String| line.starts_with("No recording shows the hub at rest");
        assert!(found.verdict.iter().any(said), "{:?}", found.verdict);
    }
}

/// A start far off does not lead astray, and a start of what is not a unknown is refused.
#[test]
fn a_start_is_taken_besides_those_of_the_data() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let recordings = recordings(&SETS[0], 1, 0.0, ASYMMETRY);
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
