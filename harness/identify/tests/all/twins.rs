//! Recordings of the independent bench (`harness/studies/twins`) that were once refused, or for which a wrong value was
//! once reported as certain.

use host::fmu::Fmu;
use pack::packed_for_tests;

use crate::draw::Twin;
use crate::habits::{self, HABITS};

/// Identifies a twin as a user would. Asserts that the model fits, that no estimate is wrong by more than five standard
/// deviations, and that the intervals of the parameters `held` contain the true value.
fn check_twin(seed: u64, held: &[&str]) {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let twin = Twin::draw(seed, 200.0);
    let found = twin.identify(&fmu, twin.models(), &|_| {}).unwrap();
    assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
    let mut known = 0;
    for (name, truth) in twin.truths() {
        let Some(p) = found.parameters.get(name).or(found.measurement.get(name)) else { continue };
        known += 1;
        // a correct estimate exceeds this limit for one of 12 parameters in one of 150,000 recordings
        assert!((p.value - truth).abs() < 5.0 * p.std, "{name} is {truth}, found {p:?}");
        let is_in = (p.interval[0]..=p.interval[1]).contains(&truth);
        assert!(is_in || !held.contains(&name), "{name} is {truth}, found {p:?}");
    }
    assert!(known > 10, "{known}");
}

/// The fit once ended in a wrong minimum, with friction that was wrong by 69 standard deviations, because it compared sums of
/// squares that were scaled by different noise levels.
#[test]
#[ignore = "ten seconds of CPU time: .ci/long-tests"]
fn the_intervals_of_a_gentle_sweep_with_an_encoder_contain_the_true_friction() {
    check_twin(22, &[]);
}

/// The recording was once refused, because one combination of the unknowns has no influence at one point of
/// the friction's likelihood profile.
#[test]
#[ignore = "ten seconds of CPU time: .ci/long-tests"]
fn a_recording_is_accepted_although_its_profile_cannot_be_followed_to_the_end() {
    check_twin(25, &[]);
}

/// The recording has a delay of 4 ms and a held torque. The fit once found a delay of 14 ms ± 0.1 ms with a linear torque,
/// because the search with the held torque had ended before its minimum.
#[test]
#[ignore = "a quarter of a minute: .ci/run --nightly"]
fn the_delay_is_uncertain_if_a_linear_torque_fits_as_well_as_a_held_torque() {
    check_twin(89, &[]);
}

/// The recording has a delay of 5 ms and a held torque. The search with the held torque was once given up after one Jacobian,
/// because it predicted only half of the decrease that its steps achieved. Therefore the delay was reported as 15.1 ms ± 0.05 ms
/// with a linear torque.
#[test]
#[ignore = "a quarter of a minute: .ci/run --nightly"]
fn the_search_with_a_held_torque_is_not_stopped_after_its_first_step() {
    check_twin(483, &["delay"]);
}

/// The search once ended one standard deviation away from the minimum, where the likelihood has a kink because dry friction stops
/// the hub within the first row.
#[test]
#[ignore = "ten seconds of CPU time: .ci/long-tests"]
fn the_search_reaches_the_minimum_although_friction_stops_the_hub_at_once() {
    check_twin(40, &[]);
}

/// The rates stay below a sixtieth of the Stribeck speed. The search once looked for the Stribeck speed near these rates, so that
/// friction.c was wrong by 6.5 standard deviations.
#[test]
#[ignore = "five seconds of CPU time: .ci/long-tests"]
fn friction_coefficients_are_uncertain_if_a_gentle_torque_does_not_separate_them() {
    check_twin(425, &["friction.c", "friction.d", "friction.omega_s"]);
}

/// The rates stay below a quarter of the Stribeck speed, and the encoder is so precise that the derivatives by friction.c,
/// friction.d and friction.omega_s differ only by a millionth. One combination of the three coefficients has no effect on the
/// motion. It once counted as exactly known, so that friction.c was wrong by 68 of its reported standard deviations.
#[test]
#[ignore = "minutes of CPU time: .ci/run --nightly"]
fn a_combination_of_friction_coefficients_without_effect_is_uncertain() {
    check_twin(431, &["friction.c", "friction.d", "friction.omega_s"]);
}

/// The intervals of fill and inertia were once too narrow, because they were computed from a linearised T = tanh(2ξh/d), which is
/// too inaccurate in a deep tank.
#[test]
#[ignore = "ten seconds of CPU time: .ci/long-tests"]
fn the_intervals_contain_fill_and_inertia_of_a_deep_tank() {
    check_twin(164, &["tank.h", "hub.I"]);
}

/// The search at one point of the friction's likelihood profile ended in another minimum. The interval of the Stribeck speed then
/// ended too early, and its estimate was wrong by 4.2 standard deviations.
#[test]
#[ignore = "a quarter of a minute: .ci/run --nightly"]
fn a_profile_point_in_another_minimum_does_not_shorten_the_interval() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let twin = Twin::draw(168, 200.0);
    let found = twin.identify(&fmu, twin.models(), &|_| {}).unwrap();
    let speed = &found.parameters["friction.omega_s"];
    let truth = twin.truths().into_iter().find(|(name, _)| *name == "friction.omega_s").unwrap().1;
    // a correct estimate exceeds this limit in 3 of 1000 recordings
    assert!((speed.value - truth).abs() < 3.0 * speed.std, "{truth}, found {speed:?}");
}

/// The recordings have the formats of five loggers, each of which can be misread: the torque of rows without a gyro value is
/// dropped, printed times are taken as exact, gaps are interpolated linearly, one delay is used for two sensors, or the torque is
/// held at the rows of another clock. With any of these errors the recording is refused, or no model fits.
#[test]
#[ignore = "minutes: .ci/run --nightly"]
fn recordings_as_loggers_write_them_are_identified() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let directory = tempfile::tempdir().unwrap();
    let (mut inside, mut all) = (0, 0);
    for (seed, habit) in (1..).zip(HABITS) {
        let twin = habits::of(Twin::draw(seed, 200.0), habit);
        let written = habits::write(&twin, habit, directory.path()).unwrap();
        let found = twin.identify_file(&fmu, twin.models(), &written, &|_| {}).unwrap();
        assert!(found.converged && found.fits == Some(true), "{habit}: {:?}", found.verdict);
        for (name, truth) in twin.truths() {
            let p = found.parameters.get(name).or(found.measurement.get(name));
            // the bias of a part of the recording differs from the bias of the whole
            let Some(p) = p.filter(|_| !name.starts_with("gyro_bias")) else { continue };
            all += 1;
            inside += usize::from((p.interval[0]..=p.interval[1]).contains(&truth));
        }
    }
    // fewer than 180 of 200 intervals would contain the true value with a probability of 0.1 %
    assert!(10 * inside > 9 * all, "{inside} of {all}");
}
