use analysis::welch::{RESPONSE, SEGMENT, Segments, Spectra};

fn noise(seed: u64, count: usize) -> Vec<f64> {
    let mut state = seed;
    let mut next = || {
        state = state * 48271 % 2_147_483_647;
        2.0 * state as f64 / 2_147_483_647.0 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

#[test]
fn coherence_is_one_for_a_gain_and_one_eighth_for_independent_noise() {
    let (u, v) = (noise(1, 90_000), noise(77, 90_000));
    let gained: Vec<f64> = u.iter().map(|x| -3.0 * x).collect();
    let through = Spectra::estimate(0.02, &u, &gained, RESPONSE);
    assert!((through.mean_coherence(1.0, 20.0) - 1.0).abs() < 1e-12);
    assert!((through.h1((5.0, 5.1)).response[0].re + 3.0).abs() < 1e-9);
    // The mean coherence of two unrelated signals is 1/K for K averages of independent spectra; half-overlapping
    // Hamming segments are equivalent to about 7 of 8 averages.
    let strangers = Spectra::estimate(0.02, &u, &v, RESPONSE).mean_coherence(1.0, 20.0);
    assert!((0.11..0.17).contains(&strangers), "{strangers}");
}

#[test]
fn the_signal_to_noise_ratio_is_the_ratio_of_signal_power_to_noise_power() {
    let (u, v) = (noise(5, 900_000), noise(9, 900_000));
    let mixed: Vec<f64> = u.iter().zip(&v).map(|(u, v)| u + v / 10.0).collect();
    let spectra = Spectra::estimate(0.02, &u, &mixed, RESPONSE);
    let snr = spectra.snr_db();
    let bins = (1..200).map(|k| spectra.value_at(&snr, k as f64 * 0.1));
    let mean = bins.sum::<f64>() / 199.0;
    // the exact ratio is 20 dB; the logarithm of few averages has a mean error of about 0.7 dB
    assert!((mean - 20.0).abs() < 1.5, "{mean}");
}

#[test]
fn two_unrelated_sweeps_seem_coherent_only_with_too_few_segments() {
    // 1 to 2 Hz at the thesis's rate: six segments of 20 s contain each frequency, but only one segment of 267 s
    let sine = |turns: fn(f64) -> f64| -> Vec<f64> {
        let time = (0..60_000).map(|k| k as f64 * 0.02);
        time.map(|t| (std::f64::consts::TAU * turns(t)).sin()).collect()
    };
    let sweep = sine(|t| t + t * t / 2400.0);
    // the phase of this sweep advances by half a turn every 10 s against the other sweep, so that
    // the two are unrelated
    let other = sine(|t| 1.05 * t + t * t / 2400.0);
    let mean =
        |segments| Spectra::estimate(0.02, &sweep, &other, segments).mean_coherence(1.2, 1.8);
    let (short, long) = (mean(Segments::Seconds(SEGMENT)), mean(RESPONSE));
    assert!(short < 0.01 && long > 0.5, "{short}, {long}");
}
