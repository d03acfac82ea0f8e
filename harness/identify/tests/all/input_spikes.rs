use analysis::random::Random;
use identify::input::spikes::find;

/// Returns time, torque and rate: 300 s of a sine of 2.4 Hz with noise of 0.4 mrad/s and these spikes.
fn with(spikes: &[(usize, f64)]) -> [Vec<f64>; 3] {
    let mut random = Random::new(7, 0);
    let time: Vec<f64> = (0..15_000).map(|k| 0.02 * f64::from(k)).collect();
    let phase = |t: f64| std::f64::consts::TAU * 2.4 * t;
    let torque = time.iter().map(|t| 0.1 * phase(*t).sin()).collect();
    let mut rate: Vec<f64> =
        time.iter().map(|t| 0.02 * phase(*t).cos() + 4e-4 * random.normal()).collect();
    spikes.iter().for_each(|(k, size)| rate[*k] += size);
    [time, torque, rate]
}

fn found(spikes: &[(usize, f64)]) -> Vec<(usize, f64)> {
    let [time, torque, rate] = with(spikes);
    find(&time, &rate, &torque, None)
}

/// Single wrong values and pairs of them, of 0.01 to 3 rad/s, are found and replaced. A recording with noise
/// only has no spikes.
#[test]
fn single_and_adjacent_spikes_are_found_and_noise_is_not_a_spike() {
    assert_eq!(found(&[]), []);
    let spikes = [(300, 0.02), (4000, -0.5), (4001, -0.4), (9000, 3.0), (9002, 0.01)];
    let found = found(&spikes);
    assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), spikes.map(|s| s.0));
    // noise differs from the cubic by less than 4 standard deviations; the fourth-order error of the cubic is 5
    // % of 20 mrad/s
    let [_, _, clean] = with(&[]);
    found.iter().for_each(|(k, y)| assert!((y - clean[*k]).abs() < 3.3e-3, "{k} {y}"));
}

#[test]
fn deviating_values_are_no_spikes_if_they_are_more_than_one_in_a_hundred() {
    let many: Vec<(usize, f64)> = (10..14_000).step_by(60).map(|k| (k, 0.1)).collect();
    assert!(many.len() > 150);
    assert_eq!(found(&many), []);
}

#[test]
fn a_long_burst_of_noise_is_not_treated_as_spikes_and_is_searched_in_linear_time() {
    // 15,000 rows with a thousand times the usual noise: a search that looked at all suspect rows for each row took minutes
    let mut random = Random::new(9, 0);
    let burst = |k: usize| (100_000..115_000).contains(&k);
    let mut rate = || -> Vec<f64> {
        let size = |k: usize| if burst(k) { 0.4 } else { 4e-4 };
        (0..400_000).map(|k| size(k) * random.normal()).collect()
    };
    let time: Vec<f64> = (0..400_000).map(|k| 0.02 * f64::from(k)).collect();
    assert_eq!(find(&time, &rate(), &vec![0.0; 400_000], None), []);
}

/// The torque alternates between 2 and −2 N·m. The kinks of the rate are not removed as spikes.
#[test]
fn a_step_of_the_torque_makes_no_spike() {
    let [time, mut torque, mut rate] = with(&[]);
    for (k, t) in time.iter().enumerate() {
        torque[k] = if (k / 1000) % 2 == 0 { 2.0 } else { -2.0 };
        // a triangle wave of 4 N·m/0.3 kg·m², with kinks of 0.09 rad/s
        let part = (t / 20.0).fract() - 0.5;
        rate[k] += 13.0 * 20.0 * (0.5 - part.abs()) / 2.0;
    }
    assert_eq!(find(&time, &rate, &torque, None), []);
}

/// One recording has three samples per period of a resonance, the other one irregular times.
#[test]
fn a_motion_that_is_sampled_coarsely_or_unevenly_has_no_spikes() {
    let mut random = Random::new(9, 0);
    let motion = |t: f64| {
        let resonance = 1.0 / (1.0 + ((t - 100.0) / 3.0).powi(2));
        (2e-3 + 0.1 * resonance) * (std::f64::consts::TAU * 3.0 * t).sin()
    };
    for jitter in [0.0, 0.04] {
        let time: Vec<f64> =
            (0..2000).map(|k| 0.1 * f64::from(k) + jitter * random.uniform()).collect();
        let rate: Vec<f64> = time.iter().map(|t| motion(*t) + 4e-4 * random.normal()).collect();
        assert_eq!(find(&time, &rate, &vec![0.0; 2000], None), []);
    }
    let time: Vec<f64> =
        (0..10_000).map(|k| 0.02 * (f64::from(k) + 0.6 * random.uniform())).collect();
    let mut rate: Vec<f64> = time.iter().map(|t| motion(*t) + 4e-4 * random.normal()).collect();
    rate[4000] += 0.05;
    let found = find(&time, &rate, &vec![0.0; 10_000], None);
    assert_eq!(found.iter().map(|(row, _)| *row).collect::<Vec<_>>(), [4000]);
}
