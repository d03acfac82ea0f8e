//! Twins of the independent bench (`examples/twins`) that were once refused, or for which something wrong was once stated as
//! sure.

use host::fmu::Fmu;
use pack::packed_for_tests;

use crate::draw::Twin;
use crate::habits::{self, HABITS};

/// Asserts that a twin, identified as a user would do it, is described by the model, that no estimate is further off than five
/// standard deviations, and that the intervals of the parameters `held` contain the true value.
fn is_described(seed: u64, held: &[&str]) {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let twin = Twin::draw(seed, 200.0);
    let found = twin.identify(&fmu, twin.models(), &|_| {}).unwrap();
    assert!(found.converged && found.fits == Some(true), "{:?}", found.verdict);
    let mut known = 0;
    for (name, truth) in twin.truths() {
        let Some(p) = found.parameters.get(name).or(found.measurement.get(name)) else { continue };
        known += 1;
        // of 12 parameters one in 150,000 recordings, and the seed is fixed
        assert!((p.value - truth).abs() < 5.0 * p.std, "{name} is {truth}, found {p:?}");
        let is_in = (p.interval[0]..=p.interval[1]).contains(&truth);
        assert!(is_in || !held.contains(&name), "{name} is {truth}, found {p:?}");
    }
    assert!(known > 10, "{known}");
}

/// The fit of this simulated recording once ended in a wrong minimum, with friction that was wrong by 69 standard
/// deviations, because it compared sums of squares that were scaled by different noise levels.
#[test]
#[ignore = "ten seconds of CPU time: .ci/long-tests"]
fn a_gentle_sweep_with_an_encoder_has_its_friction_in_the_intervals() {
    is_described(22, &[]);
}

/// The simulated recording of this test was once refused, because at one point of the likelihood profile of the friction a
/// combination of the unknowns has no influence.
#[test]
#[ignore = "ten seconds of CPU time: .ci/long-tests"]
fn a_profile_that_cannot_be_followed_to_its_end_refuses_no_recording() {
    is_described(25, &[]);
}

/// The recording has a delay of 4 ms and a held torque. The fit once found a delay of 14 ms ± 0.1 ms with a linear
/// torque, because the search with the held torque had ended before its minimum.
#[test]
#[ignore = "a quarter of a minute: .ci/run --nightly"]
fn a_delay_is_not_sure_while_another_torque_between_rows_fits_as_well() {
    is_described(89, &[]);
}

/// The torque is held, and the delay is 5 ms. The search with the held torque was given up after one set of derivatives, which
/// foretold half of what the steps win, so that the delay was stated as 15.1 ms ± 0.05 ms with a linear torque.
#[test]
#[ignore = "a quarter of a minute: .ci/run --nightly"]
fn the_search_with_a_held_torque_is_not_stopped_after_its_first_step() {
    is_described(483, &["delay"]);
}

/// The search once ended one standard deviation away from the minimum, because the likelihood has a kink at the
/// minimum: dry friction stops the hub within the first row.
#[test]
#[ignore = "ten seconds of CPU time: .ci/long-tests"]
fn an_initial_rate_that_friction_stops_at_once_leaves_the_minimum_a_minimum() {
    is_described(40, &[]);
}

/// The rates in this simulated recording stay below a sixtieth of the Stribeck speed. The search looked for the
/// Stribeck speed near these rates, so that friction.c was wrong by 6.5 standard deviations.
#[test]
#[ignore = "five seconds of CPU time: .ci/long-tests"]
fn friction_that_a_gentle_torque_does_not_separate_is_not_sure() {
    is_described(425, &["friction.c", "friction.d", "friction.omega_s"]);
}

/// The rates stay below a quarter of the Stribeck speed, and the encoder is so precise that the derivatives by friction.c, friction.d
/// and friction.omega_s are the same but for a millionth. The combination that they do not show once counted as known exactly, so
/// that friction.c was stated 68 standard deviations off.
#[test]
#[ignore = "minutes of CPU time: .ci/run --nightly"]
fn a_combination_of_friction_that_no_derivative_shows_is_not_sure() {
    is_described(431, &["friction.c", "friction.d", "friction.omega_s"]);
}

/// The intervals of fill and inertia were once too narrow, because they were computed from T = tanh(2ξh/d) linearised,
/// which is too inaccurate in a deep tank.
#[test]
#[ignore = "ten seconds of CPU time: .ci/long-tests"]
fn fill_and_inertia_of_a_deep_tank_are_in_their_intervals() {
    is_described(164, &["tank.h", "hub.I"]);
}

/// The search at one point of the likelihood profile of the friction ended in another minimum. The interval of the Stribeck
/// speed then ended too early, and its estimate was wrong by 4.2 standard deviations.
#[test]
#[ignore = "a quarter of a minute: .ci/run --nightly"]
fn a_point_of_the_profile_that_went_astray_ends_no_interval() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let twin = Twin::draw(168, 200.0);
    let found = twin.identify(&fmu, twin.models(), &|_| {}).unwrap();
    let speed = &found.parameters["friction.omega_s"];
    let truth = twin.truths().into_iter().find(|(name, _)| *name == "friction.omega_s").unwrap().1;
    // 3 of 1000 recordings are further off than that, and the seed is fixed
    assert!((speed.value - truth).abs() < 3.0 * speed.std, "{truth}, found {speed:?}");
}

/// The simulated recordings have the habits of five loggers, each of which a reader can get wrong: the torque of rows
/// without a gyro value is lost, printed times are taken as exact, gaps are interpolated linearly, one delay is used
/// for two sensors, or the torque is held in rows of another clock. With any of these errors a recording is refused, or
/// the verdict is that no model fits.
#[test]
#[ignore = "minutes: .ci/run --nightly"]
fn recordings_with_the_habits_of_loggers_are_described() {
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
            // the bias of a part is not that of the whole
            let Some(p) = p.filter(|_| !name.starts_with("gyro_bias")) else { continue };
            all += 1;
            inside += usize::from((p.interval[0]..=p.interval[1]).contains(&truth));
        }
    }
    // of 200 intervals with 95 % one in 1000 sets has fewer than 180
    assert!(10 * inside > 9 * all, "{inside} of {all}");
}
