use analysis::random::Random;
use identify::input::sensor_faults::{Faults, Rest, find};
use identify::tuning::CLIPPED;

const LEAST: f64 = 1.5e-4;

/// Returns 200 s at 50 Hz of a motion of 2 Hz with growing amplitude, measured by a gyro with a finite resolution.
fn gyro() -> (Vec<f64>, Vec<f64>) {
    let mut random = Random::new(5, 0);
    let time: Vec<f64> = (0..10_000).map(|k| 0.02 * f64::from(k)).collect();
    let rate = time.iter().map(|t| {
        let motion = 5e-4 * t * (std::f64::consts::TAU * 2.0 * t).sin();
        ((motion + 4e-4 * random.normal()) / LEAST).round() * LEAST
    });
    let rate = rate.collect();
    (time, rate)
}

fn words(time: &[f64], values: &[f64]) -> (usize, String) {
    let found = find("omega", time, values, Rest::Rate(None));
    (found.rows.len(), found.words.join("\n"))
}

#[test]
fn no_fault_is_found_in_a_sound_gyro() {
    let (time, mut rate) = gyro();
    assert_eq!(find("omega", &time, &rate, Rest::Rate(None)), Faults::default());
    // a hub at rest for 20 s, with a gyro whose resolution is coarser than its noise
    rate[..1000].fill(3e-4);
    assert_eq!(find("omega", &time, &rate, Rest::Rate(None)), Faults::default());
    // a gyro with a resolution so coarse that it repeats values by chance
    rate.iter_mut().for_each(|w| *w = (*w / 5e-3).round() * 5e-3);
    assert_eq!(find("omega", &time, &rate, Rest::Rate(None)), Faults::default());
}

#[test]
fn a_hub_at_rest_is_no_fault() {
    // at rest, half a turn in 10 s, at rest, back with constant acceleration, at rest, and on
    let course = |t: f64| match t {
        _ if t < 20.0 => 0.0,
        _ if t < 30.0 => 0.016 * (t - 20.0).powi(2),
        _ if t < 40.0 => 3.2 - 0.016 * (40.0 - t).powi(2),
        _ if t < 60.0 => 3.2,
        _ if t < 80.0 => 3.2 - 0.005 * (t - 60.0).powi(2),
        _ => 1.2 - 0.005 * (100.0 - t).powi(2),
    };
    // the torque begins between two rows
    let time: Vec<f64> = (0..5000).map(|k| 0.02 * f64::from(k) + 0.007).collect();
    for step in [1e-12, 1.7e-6] {
        let angle: Vec<f64> = time.iter().map(|t| (course(*t) / step).round() * step).collect();
        assert_eq!(find("theta", &time, &angle, Rest::Angle), Faults::default(), "{step}");
        let clipped: Vec<f64> = angle.iter().map(|a| a.min(2.0)).collect();
        let said = find("theta", &time, &clipped, Rest::Angle).words;
        assert!(said.len() == 1 && said[0].contains("theta is clipped"), "{step}: {said:?}");
    }
    // a noiseless rate that is smallest while the hub is at rest
    let pushed = |t: f64| 0.05 * (t - 20.0).clamp(0.0, 5.0) - 0.02 * (t - 25.0).clamp(0.0, 12.5);
    let rate: Vec<f64> = time.iter().map(|t| 0.002 + pushed(*t % 50.0)).collect();
    let is_clipped = |rest: Option<f64>| {
        let found = find("omega", &time, &rate, Rest::Rate(rest));
        found.words.iter().any(|line| line.contains("clipped"))
    };
    assert!(!is_clipped(Some(rate[0])));
}

/// The biased gyro reaches one end of its range in each cycle, and the other end in few cycles. Its first value after each
/// end differs from the end by less than five standard deviations of its noise.
#[test]
fn clipping_at_one_end_of_the_range_is_also_assumed_at_the_other_end() {
    let mut random = Random::new(5, 0);
    let time: Vec<f64> = (0..10_000).map(|k| 0.02 * f64::from(k)).collect();
    let mut gyro = |bias: f64| -> Vec<f64> {
        let motion = |t: &f64| bias + 0.02 * (std::f64::consts::TAU * 2.03 * t).sin();
        let mut read = |t| ((motion(t) + 4e-4 * random.normal()) / LEAST).round() * LEAST;
        time.iter().map(|t| read(t).clamp(-0.0195, 0.0195)).collect()
    };
    let values = gyro(1.3e-3);
    let lower = values.iter().filter(|w| **w == -0.0195).count();
    assert!((1..CLIPPED.0).contains(&lower), "{lower}");
    let (_, said) = words(&time, &values);
    assert!(said.contains("the upper end") && said.contains("the lower end"), "{said}");
}

#[test]
fn each_fault_of_a_sensor_is_reported() {
    let (time, rate) = gyro();
    let clipped: Vec<f64> = rate.iter().map(|w| w.clamp(-0.06, 0.06)).collect();
    let (rows, said) = words(&time, &clipped);
    assert!(said.contains("omega is clipped") && said.contains("the upper end"), "{said}");
    // 42 % of the rows from 120 s on are clipped, and one neighbour on each side of 320 runs is left out, too
    assert!((2250..2450).contains(&rows), "{rows}");
    // at 100 Hz the gyro leaves both ends of its range by less than five standard deviations of its noise
    let half: Vec<f64> = clipped.iter().map(|w| 0.2 * w.clamp(-0.04, 0.04)).collect();
    let mut random = Random::new(6, 0);
    let slow = |k: usize| (half[k / 2] + half[k.div_ceil(2)]) / 2.0 + 4e-4 * random.normal();
    let slow: Vec<f64> = (0..19_998)
        .map(slow)
        .map(|w| (w / LEAST).round() * LEAST)
        .map(|w| w.clamp(-0.006, 0.006))
        .collect();
    let time_100: Vec<f64> = (0..19_998).map(|k| 0.01 * f64::from(k)).collect();
    let (_, said) = words(&time_100, &slow);
    assert!(said.contains("the upper end") && said.contains("the lower end"), "{said}");
    let mut frozen = rate.clone();
    for from in [5003, 7003] {
        let value = frozen[from];
        frozen[from..from + 30].fill(value);
    }
    let (rows, said) = words(&time, &frozen);
    assert!(said.contains("omega is frozen 2 times for up to 0.58 s, first at 100.06 s"), "{said}");
    assert_eq!(rows, 58);
    // the gyro freezes a third time near the mean, and a last time for a whole cycle, after which the rate is near
    // the frozen value again
    let is_near_mean = |k: &usize| rate[*k].abs() < 1e-3 && rate[*k + 30].abs() > 0.01;
    let is_met = |k: &usize| (rate[*k] - rate[*k + 25]).abs() < 1e-3 && rate[*k].abs() > 0.01;
    let near_mean = (4000..4900).find(is_near_mean).unwrap();
    let met = (8000..9000).find(is_met).unwrap();
    for (from, rows) in [(near_mean, 30), (met, 25)] {
        let value = frozen[from];
        frozen[from..from + rows].fill(value);
    }
    let (rows, said) = words(&time, &frozen);
    assert!(said.contains("omega is frozen 4 times"), "{said}");
    assert_eq!(rows, 58 + 29 + 24);
    let mut repeats = rate.clone();
    (1..500).for_each(|k| repeats[20 * k] = repeats[20 * k - 1]);
    let (rows, said) = words(&time, &repeats);
    assert!(said.contains("repeat the value before although") && rows > 499, "{rows} {said}");
}
