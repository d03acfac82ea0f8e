//! Warnings about runs of the packed six-axis FMUs in which weight does not dominate the liquid.

use experiments::profile::Torque;
use experiments::run::Run;
use experiments::weight::Tanks;
use host::fmu::Fmu;
use pack::packed_model_for_tests;

fn warnings(
    model: &str,
    settings: &[(&str, &str)],
    (input, times, values): (&str, &[f64], &[f64]),
    tension: f64,
) -> Vec<String> {
    let fmu = Fmu::open(packed_model_for_tests(pack::model(model).unwrap())).unwrap();
    let run = Run {
        settings: settings
            .iter()
            .map(|(name, value)| (name.to_string(), value.to_string()))
            .collect(),
        input: Some(input.into()),
        torque: Torque::rows(times, values, None, true).unwrap(),
        others: Vec::new(),
        step: 0.25,
        sample: 0.25,
        stop: times[times.len() - 1],
        tolerance: None,
        hold: true,
    };
    let mut instance = run.initialise(&fmu).unwrap();
    let tanks = Tanks::read(fmu.description(), &mut instance, tension).unwrap().unwrap();
    let needs = tanks.required_variables();
    let columns = run.columns_with(&["dissipated"], needs.iter().map(String::as_str));
    tanks.without_weight(&run.drive(&mut instance, &columns, |_| {}).unwrap())
}

#[test]
fn a_thrust_cut_off_is_reported_with_the_numbers_of_a_hand_calculation() {
    // The craft, 1180 kg + 381.704 kg of water, is accelerated by 0.03842 m/s² at 60 N. With the radius of its tank, R = 0.376618
    // (1.841184² − 1)/2 = 0.45005 m, the Bond number is 1000 · 0.03842 R²/0.07213 = 107.9. At 6 N it is a tenth, and 0 at 0 N.
    let rest = [("init.omega[1]", "0"), ("init.omega[3]", "0")];
    let (times, water) = ([0.0, 10.0, 20.0], 0.07213);
    let of = |values: &[f64]| warnings("Spacecraft", &rest, ("force[3]", &times, values), water);
    assert_eq!(of(&[60.0; 3]), [""; 0], "under thrust");
    let [low] = <[String; 1]>::try_from(of(&[60.0, 6.0, 6.0])).unwrap();
    assert!(low.starts_with("tank[1]: Bond number 10.788, Weber number 0.000,"), "{low}");
    let [cut] = <[String; 1]>::try_from(of(&[60.0, 0.0, 0.0])).unwrap();
    for words in ["Bond number 0.000", "Froude number infinite", "surface tension"] {
        assert!(cut.contains(words), "{words}: {cut}");
    }
    // A liquid with a fifth of the surface tension: Bo = 53.9 at 6 N.
    let thin = warnings("Spacecraft", &rest, ("force[3]", &times, &[60.0, 6.0, 6.0]), water / 5.0);
    assert_eq!(thin, [""; 0]);
    // A diaphragm holds the liquid, so that there is no warning.
    let held: Vec<_> = rest.into_iter().chain([("tank[1].k[1]", "20")]).collect();
    assert_eq!(
        warnings("Spacecraft", &held, ("force[3]", &times, &[60.0, 0.0, 0.0]), water),
        [""; 0]
    );
}

#[test]
fn a_thrust_cut_off_of_slosh_tank_is_recognised_from_its_acceleration_input() {
    // With the radius 0.45 m the Bond number is 280.7 at 0.1 m/s², and 5.61 at 0.002 m/s². The slosh angle starts with 0.2 rad/s,
    // so that the speed of the surface at the wall is V = 0.37657 m · 0.2 1/s, and the Weber number 1000 V² 0.45/0.07213 = 35.39.
    let settings = [("tank.diameter", "0.9"), ("a[1]", "0"), ("tank.p_dot_0[1,1]", "0.2")];
    let (times, water) = ([0.0, 5.0, 10.0], 0.07213);
    let of = |values: &[f64]| warnings("SloshTank", &settings, ("a[3]", &times, values), water);
    assert_eq!(of(&[0.1; 3]), [""; 0]);
    let [cut] = <[String; 1]>::try_from(of(&[0.1, 0.002, 0.002])).unwrap();
    let words = "tank: Bond number 5.615, Weber number 35.3";
    assert!(cut.starts_with(words) && cut.contains("inertia"), "{cut}");
    assert!(cut.contains("; with tank.ball.travel above 0 it crosses"), "{cut}");
}
