//! Identification of an arbitrary FMU, here HubSlosh. The recordings come from closed-form solutions of a hub, I ω' = τ − b ω,
//! with the inertia I, the rate ω, the torque τ and the viscous coefficient b.

use analysis::random::Random;
use experiments::profile::Torque;
use files::output::atomically;
use host::fmu::Fmu;
use identify::any_fmu::foresee::foresee;
use identify::any_fmu::likelihood::deviances;
use identify::any_fmu::system::FmuSystem;
use identify::any_fmu::{Identification, identify};
use identify::bench::options::Options;
use identify::engine::minimum::End;
use identify::engine::{Fit, Hold};
use identify::input::question::{Question, Solver};
use identify::input::record::Record;
use identify::input::tolerance::Tolerances;
use identify::methods::output_error;
use identify::model::simulate::Model;
use pack::{Fmi, HUBSLOSH, packed_for_tests, packed_version_for_tests};
use std::io::Write;

use crate::fmu_twin::{self, SensorErrors};

const STEP: f64 = 0.05;
/// True moment of inertia of the hub, kg·m², and true viscous coefficient of its bearing, N·m·s.
pub const TRUTH: (f64, f64) = (0.35, 0.05);
const NOISE: f64 = 1e-3;
const BIAS: f64 = 4e-3;

/// Records a hub with the initial rate `start` under a torque that changes in steps every 2 s.
pub fn record(seed: u64, start: f64, bias: f64) -> Record {
    let mut random = Random::new(seed, 0);
    let (inertia, b) = TRUTH;
    let keep = (-b * STEP / inertia).exp();
    let (mut record, mut rate, mut torque) = (Record::default(), start, 0.0);
    (record.inputs, record.outputs) = (vec![Vec::new()], vec![Vec::new()]);
    for row in 0..1200 {
        if row % 40 == 0 {
            torque = 0.1 * (2.0 * random.uniform() - 1.0);
        }
        record.time.push(STEP * f64::from(row));
        record.inputs[0].push(torque);
        record.outputs[0].push(rate + bias + NOISE * random.normal());
        rate = keep * rate + torque / b * (1.0 - keep);
    }
    // a row in which the sensor has lost its value
    record.outputs[0][100] = f64::NAN;
    record
}

pub fn question(free: &[&str]) -> Question {
    let set = ["slosh.model=frozen", "fluid.rho=1e-6", "friction.model=viscous"];
    Question {
        free: free.iter().map(|text| text.parse().unwrap()).collect(),
        priors: Vec::new(),
        tolerances: Vec::new(),
        settings: set.iter().map(|text| text.parse().unwrap()).collect(),
        inputs: vec!["tau_cmd".into()],
        held: vec!["tau_cmd".into()],
        outputs: vec!["omega".into()],
        sensors: Vec::new(),
        biases: vec!["omega=0.01".parse().unwrap()],
        triads: Vec::new(),
        drift: false,
        tolerance: None,
        solver: Solver::Own,
        starts: 2,
    }
}

pub const FREE: [&str; 3] = ["hub.I=0.2:0.1:1", "friction.b=0.02:0:1", "init.omega@each=0"];

fn found(question: &Question) -> Identification {
    let model = Model::open(packed_for_tests(), question.solver).unwrap();
    let records = [record(1, 0.2, BIAS), record(2, -0.1, 0.0)];
    identify(&model, question, &records, &mut |_| {}).unwrap()
}

/// Two recordings are computed from the closed-form solution of a hub with viscous friction, and identified together.
#[test]
fn intervals_contain_the_true_values_of_a_hub_in_closed_form() {
    let found = found(&question(&FREE));
    assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
    let truth = [
        ("hub.I", TRUTH.0),
        ("friction.b", TRUTH.1),
        ("init.omega@1", 0.2),
        ("init.omega@2", -0.1),
        ("bias(omega)@1", BIAS),
        ("bias(omega)@2", 0.0),
    ];
    for (name, truth) in truth {
        let e = found.parameters.get(name).or_else(|| found.measurement.get(name)).unwrap();
        // a correct estimate exceeds this limit with a probability of 6e-5 for each of six values
        assert!((e.value - truth).abs() < 4.0 * e.std, "{name}: {e:?}");
        assert!(e.interval[0] < e.value && e.value < e.interval[1], "{name}: {e:?}");
    }
    // 2400 rows with a signal of a hundred times the noise determine I to a thousandth of its value
    assert!(found.parameters["hub.I"].std < 1e-3 * TRUTH.0);
    let noise = found.details.outputs[0].noise_white;
    // expected error of the noise: 1/√(2 N) = 2 %
    assert!((noise / NOISE - 1.0).abs() < 0.08, "{noise}");
}

/// The recorded torque is 2 % too small. Inertia and friction are determined only relative to the torque, so that no residual
/// shows this error. Intervals that include only noise miss the true value by more than ten standard deviations.
#[test]
fn tolerances_of_known_values_widen_the_intervals() {
    let mut records = [record(1, 0.2, BIAS), record(2, -0.1, 0.0)];
    records.iter_mut().flat_map(|r| &mut r.inputs[0]).for_each(|torque| *torque *= 0.98);
    let model = Model::open(packed_for_tests(), Solver::Own).unwrap();
    let of = |tolerances: &[&str], free: &[&str]| {
        let tolerances = tolerances.iter().map(|text| text.parse().unwrap()).collect();
        let question = Question { tolerances, ..question(free) };
        identify(&model, &question, &records, &mut |_| {})
    };
    let holds = |found: &Identification, name: &str, truth: f64| {
        let [low, high] = found.parameters[name].interval;
        low <= truth && truth <= high
    };
    let says = |found: &Identification, words: &str| {
        assert!(found.verdict.iter().any(|line| line.contains(words)), "{:?}", found.verdict);
    };
    let sure = of(&[], &FREE).unwrap();
    assert!(sure.fits == Some(true) && !holds(&sure, "hub.I", TRUTH.0));
    says(&sure, "noise alone");
    let found = of(&["scale(tau_cmd)=2%", "scale(time)=0.01%"], &FREE).unwrap();
    assert_eq!(found.fits, Some(true), "{:?}", found.verdict);
    let e = &found.parameters["hub.I"];
    assert!(holds(&found, "hub.I", TRUTH.0) && holds(&found, "friction.b", TRUTH.1), "{e:?}");
    // 2 % of I, with a small contribution of the noise
    assert!((e.std / (0.02 * TRUTH.0) - 1.0).abs() < 0.05 && e.std_noise < 0.1 * e.std, "{e:?}");
    says(&found, "scale(tau_cmd) 2.00 %");
    assert!(found.measurement["scale(tau_cmd)"].value.abs() < 0.01);
    // if the inertia is known, the scale error of the torque can be estimated
    let fixed = ["hub.I=0.35:0.3499:0.3501", "friction.b=0.02:0:1", "scale(tau_cmd)=0:-0.2:0.2"];
    let found = of(&[], &fixed).unwrap();
    let e = &found.measurement["scale(tau_cmd)"];
    assert!((e.value - (1.0 / 0.98 - 1.0)).abs() < 4.0 * e.std && e.std < 2e-3, "{e:?}");
    for (tolerance, free, says) in [
        ("hub.I=1%", &FREE[..], "--free names this value as an unknown"),
        ("tau_cmd=1%", &FREE, "allowed: scale(tau_cmd)"),
        ("scale(theta)=1%", &FREE, "allowed: tau_cmd, omega, time"),
        (
            "friction.asymmetry=1%",
            &FREE,
            "is 0, so that a range in percent of friction.asymmetry is empty",
        ),
        ("tank.h=5ft", &FREE, "has no unit \"ft\""),
        ("tank.h@3=1%", &FREE, "from 1 to 2"),
    ] {
        let error = format!("{:#}", of(&[tolerance], free).unwrap_err());
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn the_hosts_solver_and_the_fmus_give_the_same_estimates() {
    let own = found(&question(&FREE));
    let host = found(&Question { solver: Solver::Host(1e-9), ..question(&FREE) });
    for (name, e) in &own.parameters {
        // each solver has an error of 1e-8 of the rate, which is 1e-5 of its noise
        let off = (e.value - host.parameters[name].value) / e.std;
        assert!(off.abs() < 0.1, "{name}: {off}");
    }
}

/// Records a hub with dry friction c, N·m, that begins at rest, and returns the recording and the number of stops. The rate ω
/// tends exponentially to (τ − c sgn ω)/b until it is zero, and stays zero while |τ| ≤ c.
pub fn record_with_stops(seed: u64, c: f64) -> (Record, u32) {
    let mut random = Random::new(seed, 0);
    let (inertia, b) = TRUTH;
    let (mut record, mut rate, mut torque, mut stops) = (Record::default(), 0.0_f64, 0.0, 0);
    (record.inputs, record.outputs) = (vec![Vec::new()], vec![Vec::new()]);
    for row in 0..1200 {
        if row % 40 == 0 {
            torque = 0.1 * (2.0 * random.uniform() - 1.0);
        }
        record.time.push(STEP * f64::from(row));
        record.inputs[0].push(torque);
        record.outputs[0].push(rate + NOISE * random.normal());
        let mut left = STEP;
        while left > 0.0 && (rate != 0.0 || torque.abs() > c) {
            let direction = if rate == 0.0 { torque } else { rate }.signum();
            let end = (torque - c * direction) / b;
            let stop = if end * direction < 0.0 {
                inertia / b * (1.0 - rate / end).ln()
            } else {
                f64::INFINITY
            };
            let goes = stop.min(left);
            rate = if stop <= left {
                stops += 1;
                0.0
            } else {
                end + (rate - end) * (-b * goes / inertia).exp()
            };
            left -= goes;
        }
    }
    (record, stops)
}

/// The hub stops and breaks away, which are state events that the FMU handles within its own steps.
#[test]
fn parameters_of_an_fmi_3_fmu_with_state_events_are_estimated() {
    let c = 0.03;
    let (record, stops) = record_with_stops(1, c);
    assert!(stops > 10, "{stops}");
    let path = packed_version_for_tests(HUBSLOSH, Fmi::V3);
    let model = Model::open(path, Solver::Own).unwrap();
    assert!(model.description().is_fmi3());
    let mut question = question(&["hub.I=0.2:0.1:1", "friction.b=0.02:0:1", "friction.c=0.02:0:1"]);
    question.settings = ["slosh.model=frozen", "fluid.rho=1e-6", "friction.d=0"]
        .map(|text| text.parse().unwrap())
        .to_vec();
    let found = identify(&model, &question, &[record], &mut |_| {}).unwrap();
    assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
    for (name, truth) in [("hub.I", TRUTH.0), ("friction.b", TRUTH.1), ("friction.c", c)] {
        let e = &found.parameters[name];
        // a correct estimate exceeds the limit with a probability of 6e-5 for each of three values; a standard deviation above 2
        // % would mean that the recording did not determine the parameter
        assert!((e.value - truth).abs() < 4.0 * e.std && e.std < 0.02 * truth, "{name}: {e:?}");
    }
}

/// A parameter of a friction law that is not in use has no effect, and the true value of the inertia is beyond its bound.
#[test]
fn parameters_without_effect_are_not_determined_and_a_reached_bound_is_reported() {
    // the bristle stiffness has no effect in the chosen friction law; the true inertia is beyond its upper bound
    let asked =
        ["hub.I=0.2:0.1:0.3", "friction.b=0.02:0:1", "init.omega@each=0", "friction.sigma0=1e3"];
    let found = found(&question(&asked));
    assert_eq!(found.details.not_determined, ["friction.sigma0"]);
    assert_eq!(found.details.at_bound, ["hub.I"]);
    assert_eq!((found.parameters["hub.I"].value, found.fits), (0.3, Some(false)));
    let said = found.verdict.iter().any(|line| line.starts_with("hub.I is at its upper bound"));
    assert!(said, "{:?}", found.verdict);
}

/// The prior of the friction is 0.06 ± 1e-6, but the true value is 0.05. The estimate is 0.06, and the verdict reports a misfit.
#[test]
fn an_unknown_keeps_its_prior_if_the_recordings_determine_it_less() {
    let mut question = question(&FREE);
    question.priors = vec!["friction.b=0.06:1e-6".parse().unwrap()];
    let found = found(&question);
    assert!((found.parameters["friction.b"].value - 0.06).abs() < 1e-5);
    assert_eq!(found.details.not_determined, ["friction.b"]);
    assert_eq!(found.fits, Some(false), "the truth is 0.05");
}

#[test]
fn predicted_standard_deviations_equal_the_standard_deviations_of_the_fit() {
    let at_truth = ["hub.I=0.35:0.1:1", "friction.b=0.05:0:1", "init.omega@each=0"];
    let question = question(&at_truth);
    let model = Model::open(packed_for_tests(), question.solver).unwrap();
    let records = [record(1, 0.0, 0.0), record(2, 0.0, 0.0)];
    let bounds = foresee(&model, &question, &records, &[NOISE], &mut |_| {}).unwrap();
    let found = identify(&model, &question, &records, &mut |_| {}).unwrap();
    for bound in bounds.iter().filter(|bound| bound.is_parameter) {
        let stated = found.parameters[&bound.name].std;
        // the noise is estimated with an error of 2 %, and one value of the recordings is lost
        assert!((stated / bound.std - 1.0).abs() < 0.1, "{}: {stated} {}", bound.name, bound.std);
    }
}

#[test]
fn the_likelihood_near_the_estimate_falls_as_the_covariance_predicts() {
    let question = question(&FREE);
    let found = found(&question);
    let (names, _) = &found.correlations;
    let middle: Vec<f64> = names
        .iter()
        .map(|name| {
            found.parameters.get(name).or_else(|| found.measurement.get(name)).unwrap().value
        })
        .collect();
    // k σ along a column of the covariance, with the other unknowns changed accordingly, increases the deviance by k²
    let covariance = &found.details.covariance;
    let moved = |j: usize, k: f64| -> Vec<f64> {
        let std = covariance[j][j].sqrt();
        middle.iter().zip(&covariance[j]).map(|(x, c)| x + k * c / std).collect()
    };
    let mut points = vec![middle.clone()];
    (0..names.len()).for_each(|j| points.extend([moved(j, 2.0), moved(j, -2.0)]));
    let mut outside = middle.clone();
    outside[1] = -0.1; // the friction's lower bound is 0
    points.push(outside);
    let model = Model::open(packed_for_tests(), question.solver).unwrap();
    let records = [record(1, 0.2, BIAS), record(2, -0.1, 0.0)];
    let result = found.json().unwrap();
    let deviances = deviances(&model, &question, &records, &result, &points).unwrap();
    for (j, pair) in deviances[1..deviances.len() - 1].chunks(2).enumerate() {
        // the search ends within 0.02 standard deviations, which changes the deviance by 2 · 2 · 0.02; the model is linear
        // except in the inertia
        for deviance in pair {
            assert!((deviance - deviances[0] - 4.0).abs() < 0.2, "{}: {deviance}", names[j]);
        }
    }
    assert_eq!(deviances[deviances.len() - 1], f64::INFINITY);
}

/// If the environment variable HUBSLOSH_PAGE is set, for example to page.html, the test writes the page to this file.
#[test]
fn the_report_of_a_fit_is_a_complete_page() {
    let page = found(&question(&FREE)).page();
    for words in ["hub.I", "bias(omega)@2", "The model fits", "<svg", "</html>"] {
        assert!(page.contains(words), "{words}");
    }
    assert!(!page.contains("NaN"));
    if let Some(path) = std::env::var_os("HUBSLOSH_PAGE") {
        atomically(path.as_ref(), |file| Ok(file.write_all(page.as_bytes())?)).unwrap();
    }
}

/// slosh.zeta has an effect only if slosh.zeta_from_correlation is false.
#[test]
fn a_parameter_that_another_one_replaces_is_warned_of_once_and_cannot_be_free() {
    let records = [record(1, 0.0, 0.0), record(2, 0.0, 0.0)];
    let noise = [NOISE];
    let model = |solver| Model::open(packed_for_tests(), solver).unwrap();
    let with = |free: &[&str], set: &[&str], solver| {
        let mut question = Question { solver, starts: 1, ..question(free) };
        question.settings = set.iter().map(|text| text.parse().unwrap()).collect();
        question
    };
    let said = "slosh.zeta is free, but slosh.zeta has no effect while slosh.zeta_from_correlation is true";
    let free = ["hub.I=0.35:0.1:1", "slosh.zeta=0.003"];
    for (free, set) in [
        (free, &["slosh.model=linear"][..]),
        (["hub.I=0.35:0.1:1", "slosh.zeta@each=0.01:0:0.01"], &["slosh.model=linear"]),
    ] {
        for solver in [Solver::Own, Solver::Host(1e-8)] {
            let (model, question) = (model(solver), with(&free, set, solver));
            let error = identify(&model, &question, &records, &mut |_| {}).unwrap_err();
            assert!(format!("{error:#}").starts_with(said), "{error:#}");
            let error = foresee(&model, &question, &records, &noise, &mut |_| {}).unwrap_err();
            assert!(format!("{error:#}").starts_with(said), "{error:#}");
        }
    }
    let model = model(Solver::Own);
    // slosh.zeta has an effect in the second recording
    let some = with(&free, &["slosh.zeta_from_correlation@2=false"], Solver::Own);
    foresee(&model, &some, &records, &noise, &mut |_| {}).unwrap();
    let set = ["slosh.model=linear", "slosh.zeta=0.01"];
    let question = with(&["hub.I=0.35:0.1:1"], &set, Solver::Own);
    let warns = |line: &String| line.contains("slosh.zeta has no effect: slosh.zeta_from_corr");
    let mut heard = Vec::new();
    foresee(&model, &question, &records, &noise, &mut |line| heard.push(line)).unwrap();
    assert_eq!(heard.iter().filter(|line| warns(line)).count(), 1, "{heard:?}");
    let found = identify(&model, &question, &records, &mut |_| {}).unwrap();
    assert_eq!(found.done.iter().filter(|line| warns(line)).count(), 1, "{:?}", found.done);
}

/// A fit that started at the true values once ended 28 standard deviations away, where the sum of squares was larger by 68. The
/// verdict was nevertheless that the model fits.
#[test]
fn a_fit_never_ends_at_a_minimum_that_is_worse_than_its_start() {
    let model = Model::open(packed_for_tests(), Solver::Own).unwrap();
    let records = [record(1, 0.2, 0.0)];
    let truth = ["hub.I=0.35:0.1:1", "friction.b=0.05:0:1", "init.omega=0.2"];
    let question = Question { biases: Vec::new(), ..question(&truth) };
    let (system, unknowns) = FmuSystem::new(&model, &question, &records).unwrap();
    let problem = system.problem(unknowns, &question);
    let mut fit = Fit::new(&problem);
    let start = fit.at(&problem.starts[0]).unwrap().cost;
    for bad in [[0.5, 0.1, 0.2], [1.0, 0.05, 0.2], [0.35, 0.0, 0.2]] {
        // a search that may compute no Jacobian and make no step
        let there = fit.minimise(&bad, &[true; 3], None, End::new(0, 0.0)).unwrap();
        assert!(there.point.cost > start + 68.0);
        let found = fit.not_above_starts(there).unwrap().point;
        assert!(found.cost <= start, "{bad:?}: {} {start}", found.cost);
        assert!((found.z[0] - TRUTH.0).abs() < 2e-3, "{:?}", found.z);
    }
}

/// The minimum lies six standard deviations beyond a bound, too near for the tests of the residual to show a misfit.
#[test]
fn a_minimum_at_a_bound_is_reported_in_the_verdict() {
    let free = found(&question(&FREE));
    let e = &free.parameters["friction.b"];
    let (low, start) = (e.value + 6.0 * e.std, e.value + 9.0 * e.std);
    let held = found(&question(&[FREE[0], &format!("friction.b={start}:{low}:0.1"), FREE[2]]));
    let words = held.verdict.join("\n");
    assert_eq!(held.details.at_bound, ["friction.b"], "{words}");
    assert!(
        held.fits.is_none() && words.contains("friction.b would fit better beyond a bound"),
        "{words}"
    );
    // the result also contains the settings that were not estimated
    let set = |name: &str| held.settings.get(name).map(String::as_str);
    assert_eq!(set("slosh.model"), Some("frozen"));
    assert_eq!(set("fluid.rho"), Some("1e-6"));
}

/// Both methods fit the recording of the book's first identification: `identify bench` searches in other coordinates and with
/// weak priors, `identify fmu` searches the named parameters.
#[test]
#[ignore = "half a minute: .ci/long-tests"]
fn identify_bench_and_identify_fmu_give_equal_estimates_and_intervals() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque = "lin-sweep:amplitude=0.1,f0=3,f1=1.7,duration=600".parse().unwrap();
    let none = SensorErrors::default();
    let recording = fmu_twin::record(&fmu, &[], &Torque::Profile(torque), Some(1), none).unwrap();
    let options = Options {
        models: vec!["linear".into()],
        sensor_errors: false,
        gyro_scale: 0.0,
        tolerances: Tolerances::NONE,
        intersample: Some(Hold::FirstOrderHold),
        ..Options::default()
    };
    let recordings = std::slice::from_ref(&recording);
    let bench = output_error::identify(&fmu, recordings, &options, &mut |_| {}).unwrap();
    let free = [
        "tank.d=0.15:0.05:0.3",
        "tank.h=0.09:0.02:0.3",
        "slosh.zeta=0.004:0:0.1",
        "hub.I=0.3:0.1:1",
        "friction.b=0.03:0:1",
        "friction.c=0.004:0:0.1",
        "friction.d=0.003:0:0.1",
        "friction.omega_s=0.08:0.002:2",
    ];
    let known = ["slosh.model=linear", "slosh.zeta_from_correlation=false"];
    let asked = Question {
        settings: known.map(|text| text.parse().unwrap()).to_vec(),
        held: Vec::new(),
        biases: Vec::new(),
        drift: true,
        ..question(&free)
    };
    let record = Record {
        name: "bench".into(),
        time: recording.time.clone(),
        inputs: vec![recording.torque.clone()],
        outputs: vec![recording.rate.clone()],
    };
    let model = Model::open(packed_for_tests(), Solver::Own).unwrap();
    let found = identify(&model, &asked, &[record], &mut |_| {}).unwrap();
    assert_eq!((bench.fits, found.fits), (Some(true), Some(true)), "{:?}", found.verdict);
    for name in ["tank.d", "tank.h", "slosh.zeta", "hub.I"] {
        let (a, b) = (&bench.parameters[name], &found.parameters[name]);
        // the models of the noise and the priors of the friction differ slightly
        assert!((a.value - b.value).abs() < 0.1 * a.std, "{name}: {a:?} {b:?}");
        for (a_end, b_end) in a.interval.iter().zip(b.interval) {
            assert!((a_end - b_end).abs() < 0.2 * a.std, "{name}: {a:?} {b:?}");
        }
    }
}
