//! The noise that is estimated from simulated records of the gyro equals the specified noise.

use analysis::allan::{Noise, Term};
use experiments::gyro::Recording;
use host::fmu::Fmu;
use pack::packed_for_tests;

fn recording(hours: f64, records: usize, settings: &[(&str, &str)]) -> Recording {
    let settings = settings.iter().map(|(name, value)| (name.to_string(), value.to_string()));
    Recording { settings: settings.collect(), hours, records }
}

#[test]
fn simulated_random_walk_and_bias_instability_are_estimated() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let none = Noise::default();
    let bench = Noise { arw: 5.75e-5, bias_instability: 5.21e-5, bias_time: 100.0, ..none };
    let other = Noise { arw: 2e-4, bias_instability: 3e-4, bias_time: 30.0, ..none };
    let set = [("imu.arw", "2e-4"), ("imu.bias_instability", "3e-4"), ("imu.bias_time", "30")];
    for (specified, settings, hours) in [(bench, &[][..], 2.0), (other, &set[..], 1.0)] {
        let found = recording(hours, 4, settings).characterise(&fmu, &|_| {}).unwrap();
        assert_eq!(found.specified, specified);
        // Standard errors: 0.1 % of N, and sqrt(bias_time/(2 x 4 records x hours)) = 4 and 3 % of B. The
        // limits for the gyro are 5 and 20 %.
        let deviation = |found: f64, specified: f64| (found / specified - 1.0).abs();
        assert!(deviation(found.fit.noise.arw, specified.arw) < 0.05, "{}", found.text());
        let bias = deviation(found.fit.noise.bias_instability, specified.bias_instability);
        assert!(bias < 0.2, "{}", found.text());
    }
}

#[test]
fn white_noise_has_no_bias_instability_and_rounding_adds_noise() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let quiet = ("imu.bias_instability", "0");
    let found = recording(0.5, 2, &[quiet]).characterise(&fmu, &|_| {}).unwrap();
    assert!((found.fit.noise.arw / 5.75e-5 - 1.0).abs() < 0.05, "{}", found.text());
    assert_eq!(found.fit.terms.len(), 1, "{}", found.text());
    // rounding to a step of about the noise adds white noise of step/sqrt(12)
    let found =
        recording(0.5, 2, &[quiet, ("imu.lsb", "5e-4")]).characterise(&fmu, &|_| {}).unwrap();
    let rounding = 5e-4 / (12.0f64 * 50.0).sqrt();
    assert_eq!(found.specified.arw, 5.75e-5f64.hypot(rounding));
    assert!((found.fit.noise.arw / found.specified.arw - 1.0).abs() < 0.05, "{}", found.text());
}

#[test]
fn simulated_flicker_noise_and_rate_random_walk_are_estimated() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let set = [
        ("imu.rate", "10"),
        ("imu.bias_instability", "0"),
        ("imu.flicker", "4e-5"),
        ("imu.rrw", "3e-6"),
    ];
    let found = recording(6.0, 4, &set).characterise(&fmu, &|_| {}).unwrap();
    assert!(found.fit.fits, "{:?}", found.fit);
    for (term, truth) in [(Term::White, 5.75e-5), (Term::Flicker, 4e-5), (Term::Walk, 3e-6)] {
        let (_, of) = found.fit.terms.iter().find(|(t, _)| *t == term).unwrap();
        assert!((of.low..of.high).contains(&truth), "{term:?} {of:?}");
        assert!(of.high < 2.0 * of.low, "{term:?} {of:?}");
    }
}

#[test]
fn a_gyro_record_that_cannot_be_analysed_is_refused_with_a_reason() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    for (hours, settings, words) in [
        (0.1, &[][..], "0.83 h or more"),
        (-1.0, &[], "positive number of hours"),
        (1e6, &[], "samples"),
        (1.0, &[("imu.seed", "7")], "imu.seed"),
        (1.0, &[("init.omega", "0.1")], "not at rest"),
        (1.0, &[("imu.lsb", "1")], "imu.lsb"),
        (1.0, &[("imu.arw", "0"), ("imu.bias_instability", "0")], "no noise"),
        (1.0, &[("imu.noise", "1")], "imu.noise"),
    ] {
        let error = recording(hours, 1, settings).characterise(&fmu, &|_| {}).unwrap_err();
        assert!(format!("{error:#}").contains(words), "{words}: {error:#}");
    }
}
