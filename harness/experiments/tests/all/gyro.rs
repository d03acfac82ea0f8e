//! The noise that is estimated from a simulated record of the gyro equals the specified noise.

use analysis::allan::{Fit, Octaves, Term};
use experiments::profile::{Torque, Written};
use experiments::run::{Run, TORQUE};
use host::fmu::Fmu;
use names::hubslosh::{OMEGA_IMU, imu};
use pack::packed_for_tests;

/// Fits the noise of a record of the gyro on a hub at rest. `rate` is the gyro's sampling rate, Hz.
fn fit(hours: f64, rate: f64, settings: &[(&str, &str)]) -> Fit {
    let ours = [(imu::ENABLED, "true"), (imu::SEED, "1")];
    let settings = ours.iter().chain(settings);
    let stop = 3600.0 * hours;
    let torque: Torque =
        format!("zero:duration={stop}").parse::<Written>().unwrap().torque().unwrap();
    let run = Run {
        settings: settings.map(|(name, value)| (name.to_string(), value.to_string())).collect(),
        input: Some(TORQUE.into()),
        torque,
        others: Vec::new(),
        step: 1.0 / rate,
        sample: 1.0 / rate,
        stop,
        tolerance: None,
        hold: true,
    };
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let mut instance = run.initialise(&fmu).unwrap();
    let table = run.drive(&mut instance, &[OMEGA_IMU], |_| {}).unwrap();
    Octaves::from_samples(run.step, table.column(OMEGA_IMU).unwrap()).describe().unwrap()
}

/// Compares the terms of the fit with the `expected` terms: the specified value must lie inside the 95 % interval, and the
/// interval of a term that is not expected must begin at 0.
fn check(hours: f64, rate: f64, settings: &[(&str, &str)], expected: &[(Term, f64)]) {
    let found = fit(hours, rate, settings);
    assert!(found.fits, "{settings:?}: {found:?}");
    for (term, of) in &found.terms {
        match expected.iter().find(|(expected, _)| expected == term) {
            Some((_, truth)) => {
                assert!((of.low..of.high).contains(truth), "{settings:?}: {term:?} {of:?}");
                assert!(of.high < 2.0 * of.low, "{settings:?}: {term:?} {of:?}");
            }
            None => assert_eq!(of.low, 0.0, "{settings:?}: {term:?} {of:?}"),
        }
    }
}

const NO_BIAS: (&str, &str) = ("imu.bias_instability", "0");

#[test]
fn white_noise_and_rounding_noise_of_the_simulated_gyro_are_estimated_as_specified() {
    check(1.0, 50.0, &[NO_BIAS], &[(Term::White, 5.75e-5)]);
    // Rounding to a step that is about as large as the noise adds white noise of step/√12.
    let rounding = 5e-4 / (12.0f64 * 50.0).sqrt();
    let both = 5.75e-5f64.hypot(rounding);
    check(1.0, 50.0, &[NO_BIAS, ("imu.lsb", "5e-4")], &[(Term::White, both)]);
}

#[test]
#[ignore = "half a minute: .ci/long-tests"]
fn slow_noise_of_the_simulated_gyro_is_estimated_as_specified() {
    check(6.0, 50.0, &[], &[(Term::White, 5.75e-5), (Term::Markov, 5.21e-5)]);
    let other = [("imu.arw", "2e-4"), ("imu.bias_instability", "3e-4"), ("imu.bias_time", "30")];
    check(4.0, 50.0, &other, &[(Term::White, 2e-4), (Term::Markov, 3e-4)]);
    let slow = [("imu.rate", "10"), NO_BIAS, ("imu.flicker", "4e-5"), ("imu.rrw", "3e-6")];
    let expected = [(Term::White, 5.75e-5), (Term::Flicker, 4e-5), (Term::Walk, 3e-6)];
    check(24.0, 10.0, &slow, &expected);
}
