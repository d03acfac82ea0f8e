use analysis::features::Features;
use analysis::linear::Linear;
use analysis::noise::power;
use analysis::sweep::Sweep;
use analysis::{BAND, logarithmic_grid};
use analysis::{demodulation, lengths, spa};

const STEP: f64 = 0.02;

/// Returns the sweep of Rubaga's thesis with the torque amplitude `amplitude`, N·m, its torque
/// at every sample, and the rate of the linear bench under this torque.
fn sweep(amplitude: f64) -> (Sweep, Vec<f64>, Vec<f64>) {
    let sweep = Sweep { amplitude, ..Sweep::THESIS };
    let torque: Vec<f64> = (0..135_000).map(|k| sweep.torque(f64::from(k) * STEP)).collect();
    let rate = Linear::bench_10_cm(0.0029757).simulate(STEP, &torque, 0.0);
    (sweep, torque, rate)
}

#[test]
fn with_a_linear_plant_the_estimated_noise_is_the_added_noise() {
    let (_, torque, mut rate) = sweep(0.1);
    let grid = logarithmic_grid((2.0, 3.0), 200);
    let clean = power(STEP, &torque, &rate, &grid);
    // the thesis's gyro: 5.75e-5 rad/s/√Hz
    let density = 5.75e-5_f64.powi(2);
    // also at antiresonance and resonance, the estimate is four decades below the gyro's noise
    assert!(clean.iter().all(|s| *s < 1e-4 * density), "{clean:?}");
    let mut random = analysis::random::Random::new(3, 0);
    rate.iter_mut().for_each(|rate| *rate += (density / STEP).sqrt() * random.normal());
    let noisy = power(STEP, &torque, &rate, &grid);
    let mean = noisy.iter().sum::<f64>() / noisy.len() as f64;
    // 200 of 2,700 spectral lines with six degrees of freedom each determine the mean to 4 %, or less
    // accurately, because the residuals of neighbouring frequencies share lines
    assert!((mean / density - 1.0).abs() < 0.15, "{mean:e}");
}

#[test]
fn the_predicted_standard_deviation_of_the_features_equals_their_scatter_over_24_noise_seeds() {
    // a torque amplitude of the thesis that is small enough for the gyro's noise to matter; 24
    // seeds of the noise
    let (sweep, torque, rate) = sweep(0.05);
    let near = logarithmic_grid((2.25, 2.6), 300);
    let lag = lengths::Lengths::for_record(BAND, Some(&sweep), 2700.0, STEP).lag;
    let time: Vec<f64> = (0..torque.len()).map(|k| k as f64 * STEP).collect();
    let mut found = vec![Vec::new(); 4];
    let mut stated = vec![Vec::new(); 4];
    for seed in 0..24 {
        let mut random = analysis::random::Random::new(seed, 0);
        let noisy: Vec<f64> = rate.iter().map(|r| r + 4.066e-4 * random.normal()).collect();
        let residual = power(STEP, &torque, &noisy, &near);
        let swept = demodulation::frequency_responses(&sweep, &time, &torque, [&noisy[..]], &near);
        let [response] = &swept.responses;
        let deviation = demodulation::deviation(response, &residual, &swept.noise_gain);
        let whole = spa::Estimate::new(STEP, &torque, &noisy, &near, lag);
        for (i, (response, deviation, slope)) in [
            (response, deviation, demodulation::slope(&sweep, 2.4)),
            (&whole.response, whole.deviation(&residual), whole.slope()),
        ]
        .into_iter()
        .enumerate()
        {
            let features = Features::find(response);
            let std = features.deviations(response, &deviation, |_| slope);
            found[2 * i].push(features.f_dip.unwrap());
            found[2 * i + 1].push(features.f_res.unwrap());
            stated[2 * i].push(std.f_dip.unwrap());
            stated[2 * i + 1].push(std.f_res.unwrap());
        }
    }
    let mut ratios = Vec::new();
    for (found, stated) in found.iter().zip(&stated) {
        let mean = found.iter().sum::<f64>() / 24.0;
        let scatter = (found.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / 23.0).sqrt();
        let stated = stated.iter().sum::<f64>() / 24.0;
        ratios.push(stated / scatter);
    }
    // 24 seeds determine a standard deviation to 15 %; the limits allow more than three times this error
    assert!(ratios.iter().all(|ratio| (0.6..1.7).contains(ratio)), "{ratios:?}");
}
