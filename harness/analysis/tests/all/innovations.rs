use analysis::innovations::{LIMIT, Tests};

#[test]
fn white_noise_passes_the_tests_of_the_residual_in_records_from_40_rows_on() {
    let mut random = analysis::random::Random::new(7, 0);
    for rows in [40, 150, 400, 3000] {
        let time: Vec<f64> = (0..rows).map(|k| 0.05 * f64::from(k)).collect();
        for _ in 0..100 {
            let white: Vec<f64> = time.iter().map(|_| random.normal()).collect();
            let tests = Tests::run(&time, &[], &white, 1.0);
            assert!(tests.passed(), "{rows}: {tests:?}");
        }
    }
}

#[test]
fn white_noise_passes_the_tests_of_the_residual_and_noise_with_a_part_of_the_torque_fails() {
    let mut random = analysis::random::Random::new(5, 0);
    let time: Vec<f64> = (0..50_000).map(|k| 0.02 * f64::from(k)).collect();
    let torque: Vec<f64> = time.iter().map(|t| 0.1 * (t * (8.0 + 0.005 * t)).sin()).collect();
    let white: Vec<f64> = time.iter().map(|_| random.normal()).collect();
    let tests = Tests::run(&time, &[&torque], &white, 1.0);
    assert!(tests.passed(), "{tests:?}");
    // the torque contributes a tenth of the noise, in its frequency band only
    let leaking: Vec<f64> = white.iter().zip(&torque).map(|(e, t)| e + t).collect();
    let tests = Tests::run(&time, &[&torque], &leaking, 1.0);
    assert!(tests.torque > 10.0 && !tests.passed(), "{tests:?}");
    // the innovations contain a burst of 20 s
    let mut burst = white.clone();
    burst[20_000..21_000].iter_mut().for_each(|e| *e *= 1.5);
    let tests = Tests::run(&time, &[&torque], &burst, 1.0);
    assert!(tests.in_time.0 > LIMIT && (tests.in_time.1 - 400.0).abs() < 1.0, "{tests:?}");
}
