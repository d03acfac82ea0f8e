//! Identification of recordings that the FMU simulates, with noise of its gyro, without priors and start values.

use std::f64::consts::TAU;

use analysis::random::Random;
use analysis::statistics::deviation;
use experiments::profile::{Profile, Torque};
use host::fmu::Fmu;
use identify::bench::identification::Identification;
use identify::bench::nominal;
use identify::bench::options::Options;
use identify::bench::simulate::Setup;
use identify::bench::system::Target;
use identify::engine::Hold;
use identify::estimate::Estimated;
use identify::input::reading::prepare;
use identify::input::recording::Recording;
use identify::input::tolerance::Tolerances;
use identify::methods::output_error::identify;
use identify::tuning::COARSEST;
use identify::words::verdict::DOES_NOT_FIT;
use pack::packed_for_tests;

use crate::bench::{Bench, Drive};
use crate::fmu_twin::{self, SensorErrors, Twin, Unmodelled};
use crate::friction::{is_one_way, push};

const LONG: &str = "lin-sweep:amplitude=0.1";
/// A sweep that is faster than the sweep of the thesis, for tests that only look for large errors.
const SHORT: &str = "lin-sweep:amplitude=0.1,duration=300,f0=1.8,f1=3";

fn sweep(fmu: &Fmu, torque: &str, settings: &[(&str, &str)]) -> Recording {
    let torque: Profile = torque.parse().unwrap();
    let zeta = [("slosh.zeta_from_correlation", "false"), ("slosh.zeta", "0.003")];
    let settings = [&zeta, settings].concat();
    fmu_twin::record(fmu, &settings, &Torque::Profile(torque), Some(4), SensorErrors::default())
        .unwrap()
}

/// Returns options of a fit that assumes a torque linear between rows, as in the simulation.
fn options() -> Options {
    Options {
        models: vec!["linear".into()],
        intersample: Some(Hold::FirstOrderHold),
        sensor_errors: false,
        gyro_scale: 0.0,
        tolerances: Tolerances::NONE,
        ..Options::default()
    }
}

/// Returns options of a fit that has to choose the intersample behaviour of the torque.
fn of_any_torque() -> Options {
    Options { intersample: None, ..options() }
}

#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn identify_finds_all_parameters_and_the_sum_of_coulomb_and_stribeck_friction() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let found = identify(&fmu, &[sweep(&fmu, LONG, &[])], &of_any_torque(), &mut |_| {}).unwrap();
    assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
    for (name, truth) in [
        ("tank.d", 0.163),
        ("tank.h", 0.1),
        ("slosh.zeta", 0.003),
        ("hub.I", 0.322414),
        ("friction.c", 0.003498),
    ] {
        let p = &found.parameters[name];
        // limit of four standard deviations: a correct estimate exceeds it in one of 3000 draws of the noise, and
        // the seed is fixed
        assert!((p.value - truth).abs() < 4.0 * p.std, "{name}: {p:?}");
    }
    // a diameter that is not known to a thousandth would mean that the fit has not determined it
    assert!(found.parameters["tank.d"].std < 1e-3 * 0.163);
    let sum =
        found.details.combinations.iter().find(|c| c.name == "friction.c + friction.d").unwrap();
    assert!((sum.value - 0.005921).abs() < 4.0 * sum.std, "{sum:?}");
    assert!(found.verdict.iter().any(|line| line.contains("cannot be distinguished")));
}

/// The damping's increase with the amplitude is not estimated by default; a start value makes it an unknown.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn identify_finds_damping_that_grows_with_the_amplitude() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let recordings = [sweep(&fmu, SHORT, &[("slosh.zeta_amplitude", "0.02")])];
    let starts = vec![("slosh.zeta_amplitude".to_string(), 0.005)];
    let found = identify(&fmu, &recordings, &Options { starts, ..options() }, &mut |_| {}).unwrap();
    assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
    for (name, truth) in [("slosh.zeta", 0.003), ("slosh.zeta_amplitude", 0.02)] {
        let p = &found.parameters[name];
        // The estimate is within four standard deviations of the true value, and the standard deviation is below a
        // tenth of the value.
        assert!((p.value - truth).abs() < 4.0 * p.std && p.std < 0.1 * truth, "{name}: {p:?}");
    }
}

/// Settings of a bench whose waves break at a steepness of 0.63, which the first mode reaches at a slosh angle of 23°.
const BREAKS: [(&str, &str); 2] =
    [("slosh.zeta_breaking", "0.04"), ("slosh.breaking_steepness", "0.63")];

/// The damping by breaking and the steepness at which waves break are estimated from a simulated recording with breaking waves.
#[test]
#[ignore = "half a minute: .ci/run --nightly"]
fn damping_of_breaking_waves_is_recovered() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque = SHORT.replace("0.1", "0.25");
    let of = |settings: &[(&str, &str)], breaking: bool| {
        let recordings = [sweep(&fmu, &torque, settings)];
        identify(&fmu, &recordings, &Options { breaking, ..options() }, &mut |_| {}).unwrap()
    };
    let found = of(&BREAKS, true);
    assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
    for (name, truth) in
        [("slosh.zeta", 0.003), ("slosh.zeta_breaking", 0.04), ("slosh.breaking_steepness", 0.63)]
    {
        let p = &found.parameters[name];
        println!("{name}: {p:?}");
        // The estimate is within four standard deviations of the true value, and the standard deviation is below a
        // quarter of the value.
        assert!((p.value - truth).abs() < 4.0 * p.std && p.std < 0.25 * truth, "{name}: {p:?}");
    }
    // equally large waves of a liquid in which no waves break
    let without = of(&[], false);
    assert!(
        without.verdict.iter().any(|line| line.contains("--also breaking")),
        "{:?}",
        without.verdict
    );
}

#[test]
fn waves_that_do_not_break_show_no_damping_by_breaking() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque = "lin-sweep:amplitude=0.05,duration=60,f0=2,f1=2.8";
    let recordings = [sweep(&fmu, torque, &BREAKS)];
    let options = Options { breaking: true, ..options() };
    let found = identify(&fmu, &recordings, &options, &mut |_| {}).unwrap();
    assert!(!found.parameters.contains_key("slosh.zeta_breaking"));
    assert!(
        found.verdict.iter().any(|line| line.contains("no wave breaks")),
        "{:?}",
        found.verdict
    );
}

/// The recorded torque is 2 % too small. Therefore the estimated mass of the liquid is too small, without any
/// sign in the residual.
#[test]
fn intervals_contain_the_true_values_if_the_torque_is_wrong_within_its_tolerance() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let mut recording = sweep(&fmu, SHORT, &[]);
    recording.torque.iter_mut().for_each(|tau| *tau *= 0.98);
    let of = |tolerances: Tolerances| {
        let options = Options { tolerances, ..options() };
        identify(&fmu, std::slice::from_ref(&recording), &options, &mut |_| {}).unwrap()
    };
    let sure = of(Tolerances::NONE);
    let found = of(Tolerances { torque: 0.02, ..Tolerances::NONE });
    assert_eq!(found.fits, Some(true), "{:?}", found.verdict);
    for (name, truth) in [("tank.d", 0.163), ("tank.h", 0.1)] {
        let inside = |p: &Estimated| (p.interval[0]..=p.interval[1]).contains(&truth);
        assert!(!inside(&sure.parameters[name]), "{name}: {:?}", sure.parameters[name]);
        assert!(inside(&found.parameters[name]), "{name}: {:?}", found.parameters[name]);
    }
    let said = found.verdict.iter().find(|line| line.contains("share of the variance")).unwrap();
    assert!(said.contains("torque 2 %") && said.contains("tank.h"), "{said}");
    // a torque of 0.1 N·m drives linear slosh to a quarter of a radian
    let is_reported = found.verdict.iter().any(|line| line.starts_with("The slosh is"));
    assert!(is_reported, "{:?}", found.verdict);
}

/// The wheel has a lag of 30 ms. To first order the lag is a delay, which is estimated. The remaining misfit was once attributed
/// to a torque proportional to the square of the rate.
#[test]
fn the_cause_of_a_misfit_is_named_with_the_option_that_estimates_it() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque: Profile = "lin-sweep:amplitude=0.1,duration=120,f0=1.5,f1=3.6".parse().unwrap();
    let settings = vec![("slosh.zeta_from_correlation".to_string(), "false".to_string())];
    let twin =
        Twin { settings, unmodelled: vec![Unmodelled::ActuatorLag], rate: 25.0, ..Twin::default() };
    let recordings = [twin.record(&fmu, &Torque::Profile(torque), Some(4)).unwrap()];
    let options = Options { sensor_errors: true, gyro_scale: 0.01, ..options() };
    let found = identify(&fmu, &recordings, &options, &mut |_| {}).unwrap();
    assert_eq!(found.fits, Some(false), "{:?}", found.verdict);
    let cause = found.details.cause.as_ref().unwrap();
    assert_eq!(cause.flags, "--also actuator_lag", "{cause:?}");
    let says = |words: &str| found.verdict.iter().any(|line| line.contains(words));
    assert!(
        says("an actuator that lags its command") && !says("rate's square"),
        "{:?}",
        found.verdict
    );
    let effects = vec![Target::ActuatorLag];
    let found = identify(&fmu, &recordings, &Options { effects, ..options }, &mut |_| {}).unwrap();
    assert!(found.fits == Some(true) && found.converged, "{:?}", found.verdict);
    let lag = &found.measurement["actuator_lag"];
    assert!((lag.value - 0.03).abs() < 4.0 * lag.std && lag.std < 3e-3, "{lag:?}");
    // if the lag is estimated, the estimates of inertia and friction are correct
    let inertia = &found.parameters["hub.I"];
    assert!((inertia.value - 0.322414).abs() < 4.0 * inertia.std, "{inertia:?}");
}

/// The stated fill is 50 % too high, once as an exact value and once with a standard deviation of 1 %. The verdict once named "an
/// actuator that lags" as the cause of the misfit of the exact value. With the standard deviation it said that the model fits,
/// although the estimate was 40 standard deviations from the stated value.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn a_fill_that_is_stated_wrong_is_a_misfit_and_no_other_effect_is_named() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque: Profile = "lin-sweep:amplitude=0.1,duration=200,f0=1.5,f1=3.6".parse().unwrap();
    let settings = vec![("slosh.zeta_from_correlation".to_string(), "false".to_string())];
    let twin = Twin { settings, rate: 25.0, ..Twin::default() };
    let recordings = [twin.record(&fmu, &Torque::Profile(torque), Some(4)).unwrap()];
    let asked = Options { sensor_errors: true, gyro_scale: 0.01, ..options() };
    let set = vec![("tank.h".to_string(), "0.15".to_string())];
    let known = vec![("tank.h".to_string(), 0.15, 1.5e-3)];
    for asked in [Options { settings: set, ..asked.clone() }, Options { known, ..asked }] {
        let found = identify(&fmu, &recordings, &asked, &mut |_| {}).unwrap();
        let said = found.verdict.join("\n");
        println!("{said}\n{}", found.done.join("\n"));
        assert_eq!(found.fits, Some(false), "{said}");
        let cause = found.details.cause.as_ref();
        assert!(cause.is_none_or(|cause| cause.effect == "a wrong value of tank.h"), "{said}");
        assert!(found.details.missing.is_empty(), "{said}");
    }
}

/// The hub nutates at 4.1 Hz, and the gyro measures a part of this motion, which no candidate effect describes.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn a_misfit_that_no_candidate_explains_has_no_cause() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque: Profile = "lin-sweep:amplitude=0.4,duration=120,f0=1.5,f1=3.6".parse().unwrap();
    let settings = vec![("slosh.zeta_from_correlation".to_string(), "false".to_string())];
    let twin =
        Twin { settings, unmodelled: vec![Unmodelled::Nutation], rate: 25.0, ..Twin::default() };
    let recordings = [twin.record(&fmu, &Torque::Profile(torque), Some(4)).unwrap()];
    let options = Options { sensor_errors: true, gyro_scale: 0.01, ..options() };
    let found = identify(&fmu, &recordings, &options, &mut |_| {}).unwrap();
    assert_eq!(found.fits, Some(false), "{:?}", found.verdict);
    // the candidate effect with a score far beyond chance leaves a residual that is more than noise
    let explains = found.done.iter().any(|line| line.contains("more than noise is left"));
    assert!(
        explains && found.details.cause.is_none(),
        "{:?} {:?}",
        found.details.cause,
        found.done
    );
    let says = |words: &str| found.verdict.iter().any(|line| line.contains(words));
    assert!(!says("The cause is an") && says("The cause is unknown"), "{:?}", found.verdict);
}

/// The arm is 2 % longer than its nominal value. With a slosh angle of a third of a radian the recording shows this, because no
/// other parameter then has the same effect.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn an_arm_that_is_wrong_within_its_tolerance_is_estimated_from_nonlinear_slosh() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque: Profile = "lin-sweep:amplitude=0.15,duration=120,f0=1.5,f1=3.6".parse().unwrap();
    let settings = [
        ("slosh.model", "spherical"),
        ("slosh.zeta_from_correlation", "false"),
        ("slosh.zeta", "0.003"),
        ("tank.r", "0.2295"),
    ];
    let settings = settings.map(|(name, value)| (name.to_string(), value.to_string())).to_vec();
    let twin = Twin { settings, encoder: Some(2e-5), rate: 25.0, ..Twin::default() };
    let recordings = [twin.record(&fmu, &Torque::Profile(torque), Some(4)).unwrap()];
    let options = Options {
        models: vec!["spherical".into()],
        gyro_scale: 0.01,
        tolerances: Tolerances { arm: 1e-2, ..Tolerances::NONE },
        ..options()
    };
    let found = identify(&fmu, &recordings, &options, &mut |_| {}).unwrap();
    assert!(found.fits == Some(true) && found.converged, "{:?}", found.verdict);
    // tank.r becomes an unknown only if the residual is more than noise with its nominal value
    for (name, truth) in [("tank.r", 0.2295), ("tank.d", 0.163), ("slosh.zeta", 0.003)] {
        let p = &found.parameters[name];
        assert!((p.value - truth).abs() < 4.0 * p.std, "{name}: {p:?}");
    }
    // the standard deviation is ten times smaller than the tolerance
    assert!(found.parameters["tank.r"].std < 1e-3 * 0.2295, "{:?}", found.parameters["tank.r"]);
    let is_reported = found.verdict.iter().any(|line| line.starts_with("tank.r is estimated"));
    assert!(is_reported, "{:?}", found.verdict);
}

/// The residual of a recording without noise is the error of a solver, which no test accepts as noise. The residuals of wrong
/// models are thousands of times as large.
#[test]
fn a_recording_without_noise_fits_and_searches_with_wrong_models_end_early() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque: Profile = "lin-sweep:amplitude=0.1,duration=100,f0=1.8,f1=3".parse().unwrap();
    let recording = Twin::default().record(&fmu, &Torque::Profile(torque), None).unwrap();
    let models = ["linear", "planar"].map(String::from).to_vec();
    // the intersample behaviour and the errors of the sensors are unknown
    let options = Options { models, ..Options::default() };
    let found = identify(&fmu, &[recording], &options, &mut |_| {}).unwrap();
    assert!(found.fits == Some(true) && found.converged, "{:?}", found.verdict);
    let [fit, rival] = &found.details.models[..] else { panic!("{:?}", found.details.models) };
    assert!(fit.model == "linear" && rival.bic > fit.bic + 1e4, "{:?}", found.details.models);
    assert!(rival.simulations < 0.5 * fit.simulations, "{:?}", found.details.models);
    // a search for further digits below the noise would take a thousand simulations
    assert!(fit.simulations < 300.0, "{:?}", found.details.models);
}

/// The motion is so slow that the friction curve is nearly straight. The estimate of the Stribeck speed is 0.02 rad/s; an
/// interval from the curvature there would exclude the true value by fourteen standard deviations.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn intervals_in_a_flat_valley_of_the_likelihood_contain_the_true_friction() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let slow = "lin-sweep:amplitude=0.025,duration=600,f0=1.8,f1=3";
    let recordings = [sweep(&fmu, slow, &[])];
    let found = identify(&fmu, &recordings, &options(), &mut |_| {}).unwrap();
    assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
    let speed = &found.parameters["friction.omega_s"];
    assert!(!speed.determined, "{speed:?}");
    for (name, truth) in [
        ("friction.omega_s", 0.08581),
        ("friction.b", 0.03793),
        ("friction.c", 0.003498),
        ("friction.d", 0.002423),
        ("slosh.zeta", 0.003),
    ] {
        let p = &found.parameters[name];
        assert!((p.interval[0]..=p.interval[1]).contains(&truth), "{name}: {p:?}");
    }
    let said = found.verdict.iter().any(|l| l.starts_with("friction.omega_s is not determined"));
    assert!(said, "{:?}", found.verdict);
}

/// The motion is so slow that the hub never comes near the Stribeck speed ω_s. Therefore the interval of ω_s has no upper end. It
/// has no lower end either: for ω_s → ∞ the friction b ω + c + d exp(−(ω/ω_s)²) tends to b ω + (c + d), and
/// at any ω_s the same curve results from c + d in place of c and d = 0.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn an_interval_is_open_at_an_end_that_the_likelihood_does_not_bound() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let gentle = "lin-sweep:amplitude=0.0125,duration=600,f0=1.8,f1=3";
    let recordings = [sweep(&fmu, gentle, &[])];
    let found = identify(&fmu, &recordings, &options(), &mut |_| {}).unwrap();
    assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
    let speed = &found.parameters["friction.omega_s"];
    assert!(speed.interval == [0.0, f64::INFINITY] && !speed.determined, "{speed:?}");
    let said = found.verdict.iter().any(|l| l.starts_with("friction.omega_s is not determined"));
    assert!(said, "{:?}", found.verdict);
    // the intervals of the other parameters, of tank and hub, are closed at both ends
    for (name, truth) in [("tank.d", 0.163), ("tank.h", 0.1), ("hub.I", 0.322414)] {
        let [low, high] = found.parameters[name].interval;
        assert!(low < truth && truth < high && high < 1.1 * low, "{name}: {low} {high}");
    }
}

/// A held torque acts half a row late. If no delay is estimated, nothing can compensate for this, and the sum of squares is
/// soon so large that the search with a held torque is given up.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn impossible_intersample_behaviours_cost_few_simulations() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let recordings = [sweep(&fmu, "lin-sweep:amplitude=0.1,duration=200,f0=2,f1=2.8", &[])];
    let perfect = |options: Options| Options { sensor_errors: false, gyro_scale: 0.0, ..options };
    let [told, found] = [options(), of_any_torque()]
        .map(|options| identify(&fmu, &recordings, &perfect(options), &mut |_| {}).unwrap());
    let more = found.details.fit.simulations - told.details.fit.simulations;
    // the two other intersample behaviours have minima of their own, which need Jacobians of their own
    assert!(more < 250.0, "{more}");
    let said = found.verdict.iter().find(|line| line.starts_with("The torque is taken")).unwrap();
    assert!(
        said.contains("smooth between rows (band-limited) changes the sum of squares by +"),
        "{said}"
    );
    assert!(
        said.contains("held from row to row (zero-order hold) was given up, because"),
        "{said}"
    );
    for (name, estimated) in &told.parameters {
        // both searches end a fiftieth of a standard deviation from the minimum, but at a larger distance along the
        // valley of the friction
        let off = (estimated.value - found.parameters[name].value).abs() / estimated.std;
        assert!(off < 0.1, "{name}: {off} standard deviations");
    }
}

/// The effects of tank, hub, friction and the gyro's scale cancel along a bent valley of the likelihood. Spherical slosh
/// determines the scale, whose estimate is 0.02 away from the start of the search.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn the_minimum_is_found_along_the_bent_valley_of_the_gyros_scale() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque = fmu_twin::torque("multisine:0.25,200").unwrap();
    let settings = [
        ("slosh.model", "spherical"),
        ("slosh.zeta_from_correlation", "false"),
        ("slosh.zeta", "0.003"),
    ];
    let errors = SensorErrors { gyro_scale: 1.02, ..SensorErrors::default() };
    let recording = fmu_twin::record(&fmu, &settings, &torque, Some(4), errors).unwrap();
    let options = Options { models: vec!["spherical".into()], gyro_scale: 0.02, ..options() };
    let found = identify(&fmu, &[recording], &options, &mut |_| {}).unwrap();
    let fit = &found.details.fit;
    assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
    assert!(fit.newton_decrement < 0.1, "{} standard deviations away", fit.newton_decrement);
    let scale = &found.measurement["gyro_scale"];
    // the estimate must be more accurate than the prior; otherwise the search did not have to follow the valley
    assert!((scale.value - 1.02).abs() < 4.0 * scale.std && scale.std < 0.01, "{scale:?}");
}

/// The friction is wrong by tens of its standard deviations, but the general tests of the residual stay below 4 and do
/// not show the drag.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn a_drag_that_the_model_lacks_is_named_with_its_size() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let settings = [("slosh.zeta_from_correlation", "false"), ("slosh.zeta", "0.003")];
    let settings = settings.map(|(name, value)| (name.to_string(), value.to_string())).to_vec();
    let twin = Twin { settings, unmodelled: vec![Unmodelled::Drag], ..Twin::default() };
    let torque =
        Torque::Profile("lin-sweep:amplitude=0.4,duration=500,f0=1.8,f1=3".parse().unwrap());
    let recording = twin.record(&fmu, &torque, Some(1)).unwrap();
    let found = identify(&fmu, &[recording], &options(), &mut |_| {}).unwrap();
    let [drag] = &found.details.missing[..] else { panic!("{:?}", found.details.missing) };
    assert_eq!(drag.follows, "the rate's square against the motion");
    // the estimate is within four standard deviations of the true value, and the standard deviation is below an
    // eighth of the value
    assert!((drag.factor + 0.02).abs() < 4.0 * drag.std && drag.std < 0.003, "{drag:?}");
    assert_eq!(found.fits, Some(false));
    let said = found.verdict.iter().find(|line| line.starts_with(DOES_NOT_FIT)).unwrap();
    assert!(said.contains("a torque that follows the rate's square"), "{said}");
}

#[test]
fn twenty_spikes_are_reported_and_left_out() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let mut recording = sweep(&fmu, SHORT, &[]);
    let rows: Vec<usize> = (0..20).map(|k| 700 + 701 * k).collect();
    rows.iter().for_each(|&k| recording.rate[k] += if k % 2 == 0 { 0.3 } else { -0.05 });
    let mut said = Vec::new();
    let parts = prepare(recording, COARSEST, &mut |line| said.push(line)).unwrap();
    let line = said.iter().find(|line| line.contains("20 single values of omega")).unwrap();
    assert!(line.contains("not fitted (at 14.00, 28.02, "), "{line}");
    let found = identify(&fmu, &parts, &options(), &mut |_| {}).unwrap();
    assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
    for (name, truth) in [("tank.d", 0.163), ("tank.h", 0.1), ("hub.I", 0.322414)] {
        let p = &found.parameters[name];
        assert!((p.value - truth).abs() < 4.0 * p.std, "{name}: {p:?}");
    }
}

/// With a gyro, a held torque that acts 5 ms late cannot be distinguished from a linear torque that acts 15 ms late. Therefore
/// neither delay may be reported as certain.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn the_delay_is_uncertain_if_another_intersample_behaviour_fits_as_well() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let known = [
        ("slosh.zeta_from_correlation", "false"),
        ("slosh.zeta", "0.003"),
        ("friction.model", "viscous"),
        ("friction.asymmetry", "0"),
    ];
    let settings: Vec<_> = known.map(|(name, value)| (name.to_string(), value.to_string())).into();
    let sensor_errors = SensorErrors { delay: 0.005, ..SensorErrors::default() };
    let intersample = Hold::ZeroOrderHold;
    let twin = Twin { settings, intersample, sensor_errors, ..Twin::default() };
    let torque =
        Torque::Profile("lin-sweep:amplitude=0.05,duration=130,f0=2,f1=3".parse().unwrap());
    let recording = twin.record(&fmu, &torque, Some(1)).unwrap();
    // the bench has only viscous friction, which makes the fit fast
    let asked =
        Options { sensor_errors: true, friction: vec!["viscous".into()], ..of_any_torque() };
    let found = identify(&fmu, std::slice::from_ref(&recording), &asked, &mut |_| {}).unwrap();
    let said = found.verdict.iter().find(|line| line.contains("torque does between rows")).unwrap();
    assert!(said.contains("held from row to row (zero-order hold) with a delay of"), "{said}");
    let delay = &found.measurement["delay"];
    assert!((delay.interval[0]..=delay.interval[1]).contains(&0.005), "{delay:?}");
    assert!(delay.std > 1e-3, "{delay:?}");
    // with a given intersample behaviour the delay is known to tens of microseconds
    let told = Options { intersample: Some(intersample), ..asked };
    let found = identify(&fmu, &[recording], &told, &mut |_| {}).unwrap();
    let delay = &found.measurement["delay"];
    assert!((delay.value - 0.005).abs() < 4.0 * delay.std && delay.std < 2e-4, "{delay:?}");
}

/// The dry friction of this bench is smoothed near rest, and its torque is linear between rows. A held torque would fit slightly
/// better if it acted 10 ms before its command, which is impossible.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn a_model_error_is_not_explained_by_a_rate_that_precedes_the_torque() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let settings = [("friction.model", "stribeck_smooth"), ("friction.eps", "1e-3")];
    let torque = Torque::Profile("lin-sweep:amplitude=0.1,duration=450".parse().unwrap());
    let zeta = [("slosh.zeta_from_correlation", "false"), ("slosh.zeta", "0.0029757")];
    let settings = [&zeta[..], &settings].concat();
    let recording =
        fmu_twin::record(&fmu, &settings, &torque, Some(1), SensorErrors::default()).unwrap();
    let options = Options { sensor_errors: true, gyro_scale: 0.01, ..of_any_torque() };
    let found = identify(&fmu, &[recording], &options, &mut |_| {}).unwrap();
    let delay = &found.measurement["delay"];
    assert!(delay.value.abs() < 4.0 * delay.std && delay.std < 1e-4, "{delay:?}");
    let said = found.verdict.iter().find(|line| line.starts_with("The torque is taken")).unwrap();
    assert!(
        said.contains("held from row to row (zero-order hold) would need a delay of -10.0"),
        "{said}"
    );
}

#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn starts_forty_percent_off_lead_to_the_same_minimum_as_starts_from_the_data() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let recordings = [sweep(&fmu, SHORT, &[])];
    let own = identify(&fmu, &recordings, &options(), &mut |_| {}).unwrap();
    // all errors of the start values shift the slosh frequency in the same direction
    let far = [("tank.d", 1.4), ("tank.h", 0.6), ("slosh.zeta", 0.6), ("hub.I", 1.4)];
    let truth = |name: &str| own.parameters[name].value;
    let starts = far.map(|(name, off)| (name.to_string(), off * truth(name))).to_vec();
    let there = identify(&fmu, &recordings, &Options { starts, ..options() }, &mut |_| {}).unwrap();
    assert!(there.converged && there.fits == Some(true), "{:?}", there.verdict);
    for (name, p) in &own.parameters {
        // both searches end within a hundredth of a standard deviation of the minimum, and along the valleys of the
        // friction within a tenth
        let off = (there.parameters[name].value - p.value).abs() / p.std;
        assert!(off < 0.2, "{name}: {off} standard deviations");
    }
}

/// The hub has 5 kg·m². Without `--start hub.I=` the fit fails with an error that names this option.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn a_bench_of_another_size_is_estimated_only_if_its_inertia_is_stated() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let settings = [("hub.I", "5"), ("tank.d", "0.4"), ("tank.h", "0.3"), ("tank.r", "0.5")];
    let large = sweep(&fmu, "lin-sweep:amplitude=2,f0=0.8,f1=3,duration=300", &settings);
    let arm = ("tank.r".to_string(), "0.5".to_string());
    let told = Options { settings: vec![arm], ..options() };
    let recordings = [large];
    let error = identify(&fmu, &recordings, &told, &mut |_| {}).unwrap_err().to_string();
    assert!(error.contains("--start hub.I="), "{error}");
    let told = Options { known: vec![("hub.I".into(), 9.0, 4.0)], ..told };
    let found = identify(&fmu, &recordings, &told, &mut |_| {}).unwrap();
    for (name, truth) in [("tank.d", 0.4), ("tank.h", 0.3), ("hub.I", 5.0)] {
        let p = &found.parameters[name];
        // limit of four standard deviations: a correct estimate exceeds it in one of 3000 draws of the noise, and
        // the seed is fixed
        assert!((p.value - truth).abs() < 4.0 * p.std, "{name}: {p:?}");
    }
}

/// A downward sweep approaches the resonance of softening slosh from higher frequencies, where rotary slosh begins.
#[test]
#[ignore = "a minute: .ci/run --nightly"]
fn a_downward_sweep_shows_that_slosh_rotates() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque = "lin-sweep:amplitude=0.1,duration=400,f0=2.7,f1=2";
    let recording = sweep(&fmu, torque, &[("slosh.model", "spherical")]);
    let models = ["linear", "spherical"].map(String::from).to_vec();
    let found =
        identify(&fmu, &[recording], &Options { models, ..options() }, &mut |_| {}).unwrap();
    assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
    assert_eq!(found.details.fit.model, "spherical");
    for (name, truth) in [("tank.d", 0.163), ("tank.h", 0.1), ("slosh.zeta", 0.003)] {
        let p = &found.parameters[name];
        // a correct estimate exceeds four standard deviations in one of 3000 draws of the noise, and the seed is fixed
        assert!((p.value - truth).abs() < 4.0 * p.std, "{name}: {p:?}");
    }
}

/// The scale error of the gyro cannot be estimated from torque and rate, but the angle of an encoder determines it.
#[test]
fn an_encoder_determines_the_scale_error_of_the_gyro() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let sensor_errors = SensorErrors { gyro_scale: 1.01, ..SensorErrors::default() };
    let torque = Torque::Profile(SHORT.parse().unwrap());
    let mut recording = fmu_twin::record(&fmu, &[], &torque, Some(2), sensor_errors).unwrap();
    // an encoder with 17 bits, whose angle comes from a simulation without noise of the gyro
    let setup = Setup { settings: Vec::new(), intersample: Hold::FirstOrderHold };
    let motion = setup.run(&fmu, &[], &recording, 0.0).unwrap();
    let count = std::f64::consts::TAU / f64::from(1 << 17);
    recording.angle = Some(motion.angle.iter().map(|a| (a / count).round() * count).collect());
    let options = Options { gyro_scale: 0.05, ..options() };
    let found = identify(&fmu, &[recording], &options, &mut |_| {}).unwrap();
    let scale = &found.measurement["gyro_scale"];
    // without the encoder the standard deviation of the scale would be 5 %
    assert!(scale.std < 0.002, "{scale:?}");
    assert!((scale.value - 1.01).abs() < 4.0 * scale.std, "{scale:?}");
}

/// With the encoder's angle, the residual is noise only if the scale of the gyro is estimated. Therefore the scale must be free
/// from the beginning of the search.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn a_recording_with_an_encoder_fits_with_a_free_gyro_scale() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let settings = [
        ("slosh.zeta_from_correlation", "false"),
        ("slosh.zeta", "0.003"),
        ("friction.asymmetry", "0.1"),
    ];
    let settings = settings.map(|(name, value)| (name.to_string(), value.to_string())).to_vec();
    let sensor_errors = SensorErrors { delay: 0.005, gyro_scale: 1.01, gyro_bias: 2e-3 };
    let torque = Torque::Profile(SHORT.parse().unwrap());
    for encoder in [2e-5, 3e-4] {
        let twin = Twin {
            settings: settings.clone(),
            sensor_errors,
            encoder: Some(encoder),
            ..Twin::default()
        };
        let recording = twin.record(&fmu, &torque, Some(1)).unwrap();
        let options = Options { sensor_errors: true, gyro_scale: 0.01, ..of_any_torque() };
        let found = identify(&fmu, &[recording], &options, &mut |_| {}).unwrap();
        assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
        let scale = &found.measurement["gyro_scale"];
        assert!((scale.value - 1.01).abs() < 4.0 * scale.std && scale.std < 2e-3, "{scale:?}");
        let d = &found.parameters["tank.d"];
        assert!((d.value - 0.163).abs() < 4.0 * d.std, "{d:?}");
    }
}

/// Friction stops the hub before the first row that is fitted. No row determines the initial rate, and the search
/// once tried ±1,000 rad/s.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn the_first_gyro_values_bound_an_initial_rate_that_friction_stops_at_once() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque = "lin-sweep:amplitude=0.1,duration=120,f0=2,f1=2.8";
    let all = sweep(&fmu, torque, &[]);
    // the torque begins after two seconds at rest
    let (step, noise) = (all.step(), all.rate_noise());
    let rest = (2.0 / step).round() as usize;
    let mut random = Random::new(1, 0);
    let torque = [vec![0.0; rest], all.torque].concat();
    let at_rest: Vec<f64> = (0..rest).map(|_| noise * random.normal()).collect();
    let rate = [at_rest, all.rate].concat();
    let time: Vec<f64> = (0..rate.len()).map(|k| step * k as f64).collect();
    let fresh = Some(time.iter().map(|t| *t >= 0.1).collect());
    let spread = deviation(&rate);
    let recording = Recording::of("a.csv", time, torque, rate);
    let recording = Recording { from_rest: false, fresh, ..recording };
    let options = Options { sensor_errors: true, ..options() };
    let found = identify(&fmu, &[recording], &options, &mut |_| {}).unwrap();
    assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
    let first = &found.measurement["init.omega[1]"];
    assert!(first.interval[0] < 0.0 && first.interval[1] > 0.0, "{first:?}");
    assert!(first.value.abs() < spread && first.std < 2.0 * spread, "{first:?}");
    // the asymmetry of the friction is still determined
    assert!(found.parameters["friction.asymmetry"].std < 0.1);
}

/// A search once tried a delay of −5,889 s, and the FMU ran for minutes after the end of the recording. Another search tried
/// friction so stiff that one row took millions of internal steps.
#[test]
fn a_simulation_that_would_take_too_long_is_refused() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let recording = sweep(&fmu, "lin-sweep:amplitude=0.1,duration=20,f0=2,f1=3", &[]);
    let run = |settings: &[(&str, &str)], delay: f64| {
        let settings = settings.iter().map(|(name, value)| ((*name).into(), (*value).into()));
        let setup = Setup { settings: settings.collect(), intersample: Hold::FirstOrderHold };
        setup.run(&fmu, &[], &recording, delay)
    };
    let says = |settings: &[(&str, &str)], delay: f64| {
        format!("{:#}", run(settings, delay).expect_err("it is refused"))
    };
    let lugre = ("friction.model", "lugre");
    for delay in [-5889.0, 5889.0] {
        let said = says(&[], delay);
        assert!(said.contains("longer than the recording (allowed: up to 20"), "{said}");
    }
    assert!(run(&[], -0.1).is_ok());
    let stiff = [lugre, ("friction.sigma0", "1e9"), ("init.omega", "100")];
    let said = says(&stiff, 0.0);
    assert!(said.contains("solver.max_steps = 600 internal steps"), "{said}");
    // a limit of internal steps that the user sets is not replaced
    let own = [&stiff[..], &[("solver.max_steps", "50")]].concat();
    let said = says(&own, 0.0);
    assert!(said.contains("solver.max_steps = 50 internal steps"), "{said}");
    // the largest stiffness of the bristles that a fit may try
    assert!(run(&[lugre, ("friction.sigma0", "1000")], 0.0).is_ok());
}

#[test]
fn no_model_fits_a_torque_that_is_clipped() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque = "lin-sweep:amplitude=0.1,duration=60,f0=1.8,f1=3";
    let clipped = sweep(&fmu, torque, &[("wheel.enabled", "true"), ("wheel.tau_max", "0.09")]);
    let found = identify(&fmu, &[clipped], &options(), &mut |_| {}).unwrap();
    assert!(found.fits != Some(true));
    assert!(found.verdict.iter().any(|line| line.starts_with(DOES_NOT_FIT)), "{:?}", found.verdict);
}

#[test]
fn a_rate_in_degrees_per_second_is_refused() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let mut degrees = sweep(&fmu, SHORT, &[]);
    degrees.rate.iter_mut().for_each(|w| *w = w.to_degrees());
    let error = identify(&fmu, &[degrees], &options(), &mut |_| {}).unwrap_err().to_string();
    assert!(error.contains("omega looks like degrees per second"), "{error}");
}

/// The simulation of the fit reproduces a simulated recording whose torque is held, linear or band-limited between samples, with
/// a delay of 0 or 5 ms.
#[test]
fn the_simulation_of_the_fit_reproduces_a_twin_with_a_delay_or_a_smooth_torque() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque = Torque::Profile("lin-sweep:amplitude=0.1,duration=130,f0=2,f1=3".parse().unwrap());
    for (intersample, delay) in [
        (Hold::FirstOrderHold, 0.0),
        (Hold::ZeroOrderHold, 0.0),
        (Hold::BandLimited, 0.0),
        (Hold::FirstOrderHold, 0.005),
        (Hold::BandLimited, 0.005),
    ] {
        let sensor_errors = SensorErrors { delay, ..SensorErrors::default() };
        // the gyro samples at its own rate, but without noise
        let settings = ["imu.arw", "imu.bias_instability"].map(|name| (name.into(), "0".into()));
        let twin =
            Twin { intersample, sensor_errors, settings: settings.to_vec(), ..Twin::default() };
        let recording = twin.record(&fmu, &torque, Some(1)).unwrap();
        let setup = Setup { settings: Vec::new(), intersample };
        let motion = setup.run(&fmu, &[], &recording, delay).unwrap();
        let off = recording.rate.iter().zip(&motion.rate).map(|(a, b)| (a - b).abs());
        let off = off.fold(0.0, f64::max);
        let largest = recording.rate.iter().fold(0.0, |m: f64, w| m.max(w.abs()));
        // the difference of the two motions is largest where friction changes its sign: a thousandth of the largest rate
        // is about 1e-5 rad/s
        assert!(off < 1e-3 * largest, "{intersample:?}, {delay} s late: off by {off} of {largest}");
    }
}

/// If torque, inertias, masses and friction are all multiplied by the same factor, the motion does not change. Therefore an error
/// of the torque's scale should change the estimated inertias and friction by the same factor. The hub sticks in each half cycle,
/// at instants that depend on the torque. The sweep is too gentle to determine friction.b and friction.c: any values along a flat
/// valley of the likelihood may be the best fit, so that the test compares their intervals.
#[test]
#[ignore = "ten seconds of CPU time: .ci/long-tests"]
fn a_torque_error_of_1_percent_changes_the_friction_by_1_percent_but_neither_delay_nor_asymmetry() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let settings = [("slosh.model", "linear"), ("friction.asymmetry", "0.1")];
    let mut recording = sweep(&fmu, "lin-sweep:amplitude=0.02,f0=1.8,f1=3,duration=60", &settings);
    let options = Options { sensor_errors: true, ..options() };
    let mut of = |factor: f64| {
        recording.torque.iter_mut().for_each(|torque| *torque *= factor);
        identify(&fmu, std::slice::from_ref(&recording), &options, &mut |_| {}).unwrap()
    };
    let (before, after) = (of(1.0), of(1.01));
    let estimate = |name: &str| {
        [&before, &after]
            .map(|found| found.parameters.get(name).unwrap_or_else(|| &found.measurement[name]))
    };
    for (name, factor) in
        [("friction.b", 1.01), ("friction.c", 1.01), ("friction.asymmetry", 1.0), ("delay", 1.0)]
    {
        let [a, b] = estimate(name);
        for end in [0, 1] {
            let off = (b.interval[end] - a.interval[end] * factor) / a.std;
            assert!(off.abs() < 0.1, "{name}: {a:?} {b:?}");
        }
    }
    let sum = |found: &Identification| {
        let all = &found.details.combinations;
        all.iter().find(|c| c.name == "friction.c + friction.d").unwrap().clone()
    };
    let [a, b] = [&before, &after].map(sum);
    assert!((b.value - 1.01 * a.value).abs() < 0.1 * a.std, "{a:?} {b:?}");
}

#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn a_push_and_a_free_decay_do_not_determine_the_asymmetry_of_the_friction() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    for way in [1.0, -1.0] {
        let options = Options { models: vec!["frozen".into()], sensor_errors: true, ..options() };
        let found = identify(&fmu, &[push(1, way)], &options, &mut |_| {}).unwrap();
        assert!(found.converged && found.fits == Some(true), "{way}: {:?}", found.verdict);
        is_one_way(&found.parameters, &found.details.combinations, &found.verdict, way);
    }
}

#[test]
fn a_damping_ratio_that_the_correlation_replaces_is_not_estimated() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let recording = sweep(&fmu, "lin-sweep:amplitude=0.1,f0=1.8,f1=3,duration=60", &[]);
    let settings = vec![("slosh.zeta_from_correlation".to_string(), "true".to_string())];
    let options = Options { models: vec!["linear".into()], settings, ..options() };
    let error = identify(&fmu, &[recording], &options, &mut |_| {}).unwrap_err();
    let said = "slosh.zeta is free, but slosh.zeta has no effect while slosh.zeta_from_correlation is true";
    assert!(format!("{error:#}").contains(said), "{error:#}");
    let with_zeta = [&options.settings[..], &[("slosh.zeta".into(), "0.01".into())]].concat();
    let warnings = nominal::warnings(&fmu, &with_zeta).unwrap();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].starts_with("slosh.zeta has no effect"), "{warnings:?}");
    assert!(nominal::warnings(&fmu, &[]).unwrap().is_empty());
}

/// The true damping is the largest that the FMU allows, so that a finite difference may leave the range.
#[test]
fn a_search_that_would_leave_a_parameters_range_ends_at_the_bound_with_a_result() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque = "lin-sweep:amplitude=0.1,f0=1.8,f1=3,duration=60";
    let recording = sweep(&fmu, torque, &[("slosh.model", "linear"), ("slosh.zeta", "0.999")]);
    let set = ["tank.d=0.163", "tank.h=0.1", "friction.b=0.03793", "friction.c=0.003498"];
    let set = set.iter().chain(&["friction.d=0.002423", "friction.omega_s=0.08581"]);
    let pair = |text: &&str| {
        let (name, value) = text.split_once('=').unwrap();
        (name.to_string(), value.to_string())
    };
    let starts = vec![("slosh.zeta".to_string(), 0.9)];
    let options = Options { settings: set.map(pair).collect(), starts, ..options() };
    let found = identify(&fmu, &[recording], &options, &mut |_| {}).unwrap();
    let zeta = &found.parameters["slosh.zeta"];
    assert!(zeta.value > 0.9 && zeta.value <= 0.999, "{zeta:?}");
    // draws that the FMU would refuse are left out
    assert!(zeta.interval[1] > 0.98 && zeta.interval[1] <= 0.999, "{zeta:?}");
}

/// Dry friction changes its sign when the hub turns back, which shows when the torque acts. Therefore the intersample behaviour
/// and the delay can both be estimated.
#[test]
fn no_delay_of_half_a_row_is_reported_if_the_intersample_behaviour_is_determined() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let settings = vec![("slosh.model".to_string(), "frozen".to_string())];
    let sensor_errors = SensorErrors { delay: 0.01, ..SensorErrors::default() };
    let twin = Twin { settings, sensor_errors, ..Twin::default() };
    let torque =
        Torque::Profile("lin-sweep:amplitude=0.05,duration=60,f0=2,f1=3.5".parse().unwrap());
    let recording = twin.record(&fmu, &torque, Some(1)).unwrap();
    let asked = Options { sensor_errors: true, models: vec!["frozen".into()], ..of_any_torque() };
    let found = identify(&fmu, &[recording], &asked, &mut |_| {}).unwrap();
    let delay = &found.measurement["delay"];
    assert!((delay.value - 0.01).abs() < 4.0 * delay.std && delay.std < 1e-3, "{delay:?}");
    let says = |words: &str| found.verdict.iter().any(|line| line.contains(words));
    // a held torque is excluded; a smooth and a linear torque give the same delay of 10 ms
    assert!(says("linear between rows") && !says("half a row"), "{:?}", found.verdict);
}

#[test]
fn a_hub_that_turns_both_ways_is_not_taken_for_one_that_turns_one_way() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let settings = [("slosh.model", "frozen"), ("friction.c", "1e-6"), ("friction.d", "1e-6")];
    let mut recording =
        sweep(&fmu, "lin-sweep:amplitude=0.02,f0=0.1,f1=0.5,duration=60", &settings);
    let mut random = Random::new(1, 9);
    recording.rate.iter_mut().for_each(|rate| *rate += 4e-3 * random.normal());
    let options = Options { models: vec!["frozen".into()], sensor_errors: true, ..options() };
    let found = identify(&fmu, &[recording], &options, &mut |_| {}).unwrap();
    assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
    let asymmetry = &found.parameters["friction.asymmetry"];
    assert!(asymmetry.std > 0.3, "{asymmetry:?}");
    for name in ["friction.c", "friction.d"] {
        // the friction in each direction has an upper bound, and so has the sum c + d
        assert!(found.parameters[name].interval[1] < 0.1, "{:?}", found.parameters[name]);
        let combination = format!("{name} (1");
        let of = found.details.combinations.iter().find(|c| c.name.starts_with(&combination));
        assert!(of.is_none(), "{of:?}");
    }
}

fn on_bench(bench: &Bench, seed: u64, seconds: u32) -> Recording {
    let time: Vec<f64> = (0..=50 * seconds).map(|k| 0.02 * f64::from(k)).collect();
    let rate = (3.5 - 1.25) / f64::from(seconds);
    let torque = |t: f64| 0.1 * (TAU * (1.25 * t + 0.5 * rate * t * t)).sin();
    let tau: Vec<f64> = time.iter().map(|t| torque(*t)).collect();
    let motion = bench.motion(&Drive::Lines(&time, &tau), &time);
    let mut random = Random::new(seed, 31);
    let read = motion.rate.iter().map(|w| w + 4.066e-4 * random.normal()).collect();
    Recording::of("bench", time, tau, read)
}

/// For a hub with an appendage on a spring, the verdict once named a lag of the actuator as the cause: 12 ms with an appendage at
/// 8 Hz, and 17 ms at 4 Hz.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn no_tried_effect_is_named_as_the_cause_for_a_flexible_hub() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    for frequency in [8.0, 4.0] {
        let bench = Bench { appendage: Some((0.05, frequency)), ..Bench::default() };
        let recording = on_bench(&bench, 1, 200);
        let found = identify(&fmu, &[recording], &options(), &mut |_| {}).unwrap();
        let said = found.verdict.join("\n");
        println!("{frequency} Hz: {said}\n{}", found.done.join("\n"));
        assert!(found.details.cause.is_none() && found.details.missing.is_empty(), "{said}");
        match found.fits {
            Some(true) => assert!(found.parameters.values().all(|p| p.std > 0.0), "{said}"),
            _ => assert!(said.contains("The cause is unknown") && said.contains(" Hz ("), "{said}"),
        }
    }
}

/// The friction falls by a third with a time constant of a minute. The verdict once named a torque that follows the square of the
/// rate as the cause, at 12 standard deviations.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn drifting_friction_is_never_reported_as_another_cause() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let settings = [("slosh.zeta_from_correlation", "false"), ("slosh.zeta", "0.003")];
    let settings = settings.map(|(name, value)| (name.to_string(), value.to_string())).to_vec();
    let twin = Twin { settings, unmodelled: vec![Unmodelled::Warming], ..Twin::default() };
    for (seed, torque) in [
        (1, "lin-sweep:amplitude=0.1,duration=300,f0=1.8,f1=3"),
        (2, "lin-sweep:amplitude=0.3,duration=300,f0=3,f1=1.8"),
    ] {
        let torque = Torque::Profile(torque.parse().unwrap());
        let recording = twin.record(&fmu, &torque, Some(seed)).unwrap();
        let found = identify(&fmu, &[recording], &options(), &mut |_| {}).unwrap();
        let said = found.verdict.join("\n");
        println!("{said}\n{}", found.done.join("\n"));
        assert!(found.details.missing.is_empty(), "{said}");
        let cause = found.details.cause.as_ref();
        assert!(cause.is_none_or(|cause| cause.effect == "friction that drifts"), "{said}");
    }
}

/// The actuator's torque differs from its command, or a torque acts that no model contains. No estimate that is reported as
/// determined may be wrong, and no wrong cause may be named.
#[test]
#[ignore = "half a minute: .ci/long-tests"]
fn benches_that_differ_from_the_model_get_neither_wrong_values_nor_wrong_causes() {
    type Acts = fn(f64) -> f64;
    type ExtraTorque = fn(f64, f64, f64) -> f64;
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let none: ExtraTorque = |_, _, _| 0.0;
    let plants: [(&str, Acts, ExtraTorque, &[&str]); 7] = [
        ("a dead zone", |tau| if tau.abs() < 0.01 { 0.0 } else { tau }, none, &[]),
        ("steps of the torque", |tau| (tau / 0.02).round() * 0.02, none, &[]),
        ("a limit of the torque", |tau| tau.clamp(-0.08, 0.08), none, &["largest torque"]),
        ("a cable", |tau| tau, |_, angle, _| -0.03 * angle, &["turns the hub back", "the angle"]),
        ("drag", |tau| tau, |_, _, rate| -0.05 * rate * rate.abs(), &["the rate's square"]),
        ("a bearing that ripples", |tau| tau, |_, angle, _| 2e-3 * (40.0 * angle).sin(), &[]),
        ("a pump nearby", |tau| tau, |t, _, _| 3e-3 * (TAU * 0.7 * t).sin(), &[]),
    ];
    for (name, acts, extra_torque, causes) in plants {
        let bench = Bench { extra_torque, ..Bench::default() };
        let time: Vec<f64> = (0..=7500).map(|k| 0.02 * f64::from(k)).collect();
        let command = |t: f64| 0.1 * (TAU * (1.25 * t + 0.0075 * t * t)).sin();
        let recorded: Vec<f64> = time.iter().map(|t| command(*t)).collect();
        let acting: Vec<f64> = recorded.iter().map(|tau| acts(*tau)).collect();
        let motion = bench.motion(&Drive::Lines(&time, &acting), &time);
        let mut random = Random::new(1, 31);
        let read = motion.rate.iter().map(|w| w + 4.066e-4 * random.normal()).collect();
        let recording = Recording::of("bench", time, recorded, read);
        let asked = Options { sensor_errors: true, gyro_scale: 0.01, ..options() };
        let found = identify(&fmu, &[recording], &asked, &mut |_| {}).unwrap();
        let said = found.verdict.join("\n");
        println!("{name}: {:?}\n{said}", found.fits);
        let missing = found.details.missing.iter().map(|m| m.follows.clone());
        for cause in found.details.cause.iter().map(|c| c.effect.clone()).chain(missing) {
            assert!(causes.iter().any(|right| cause.contains(right)), "{name}: {cause}");
        }
        if found.fits != Some(true) {
            continue;
        }
        for (parameter, truth) in [
            ("tank.d", bench.diameter),
            ("tank.h", bench.height),
            ("slosh.zeta", bench.zeta),
            ("hub.I", bench.hub_inertia),
        ] {
            let p = &found.parameters[parameter];
            assert!((p.value - truth).abs() < 5.0 * p.std, "{name}: {parameter} {p:?}");
        }
    }
}
