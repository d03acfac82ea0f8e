//! Estimates the part of an output that no linear response to the input explains: noise of the
//! gyro, and the effects of dry friction and a nonlinear liquid. This part determines the
//! uncertainty of a frequency response.
//!
//! The method is the local rational method (McKelvey and Guérin, *Non-parametric frequency response
//! estimation using a local rational model*, SYSID 2012; Pintelon and Schoukens, *System Identification: A
//! Frequency Domain Approach*, 2nd ed., 2012, chapter 7). At line k of the whole record's spectra and n
//! lines on either side,
//!
//! ```text
//! (1 + a r) Y(k + r) = (b0 + b1 r + b2 r²) U(k + r) + t0 + t1 r + t2 r² + (1 + a r) V(k + r),   |r| ≤ n
//! ```
//!
//! is solved by least squares. The rational function follows a resonance as narrow as a few lines, and the
//! polynomial in t represents the leakage of the record's ends. The residual is V.

use fourier::Forward;
use nalgebra::{SMatrix, SVector};

use fourier::Complex64;

const SIDE: usize = 6;
const LINES: usize = 2 * SIDE + 1;
/// Number of unknowns of the local rational model: three coefficients of the numerator, three of
/// the transient, and one of the denominator.
const UNKNOWNS: usize = 7;

/// Returns the two-sided power spectral density of the part of `output` that a linear model does
/// not explain, at `frequencies`, Hz. Its unit is the square of the output's unit, times s. The
/// signals are sampled every `step` seconds. The result is NaN at frequencies at which no estimate
/// is possible. Each value is the mean of five neighbouring residuals, because a single residual
/// has only six degrees of freedom; five determine a standard deviation to 20 %.
pub fn power(step: f64, input: &[f64], output: &[f64], frequencies: &[f64]) -> Vec<f64> {
    // A record of N steps has N + 1 samples. N is used because it is usually a round number, whose transform
    // is twice as fast.
    let count = input.len() / 2 * 2;
    let transform = Forward::new(count);
    let (u, y) = (
        transform.transform(input[..count].to_vec()),
        transform.transform(output[..count].to_vec()),
    );
    let mut last: Option<(usize, f64)> = None;
    let at = |frequency: &f64| {
        let k = (frequency * step * count as f64).round() as usize;
        match last {
            Some((same, power)) if same == k => power,
            _ => {
                let each = (0..5).filter_map(|place| {
                    let k = (k + place * LINES).checked_sub(2 * LINES)?;
                    let lines = k.checked_sub(SIDE)?..k + SIDE + 1;
                    unexplained(u.get(lines.clone())?, y.get(lines)?)
                });
                let each: Vec<f64> = each.collect();
                let power = each.iter().sum::<f64>() / each.len() as f64 * step / count as f64;
                last = Some((k, power));
                power
            }
        }
    };
    frequencies.iter().map(at).collect()
}

/// Returns the mean power that a local rational model does not explain in the spectral lines around
/// one frequency. `u` and `y` are the spectra of input and output there. The result is `None` if a
/// spectrum is 0 at these lines.
fn unexplained(u: &[Complex64], y: &[Complex64]) -> Option<f64> {
    let mean = |x: &[Complex64]| x.iter().map(|x| x.norm()).sum::<f64>() / LINES as f64;
    let (scale_u, scale_y) = (mean(u), mean(y));
    if scale_u == 0.0 || scale_y == 0.0 {
        return None;
    }
    let place = |i: usize| (i as f64 - SIDE as f64) / SIDE as f64;
    let a = SMatrix::<Complex64, LINES, UNKNOWNS>::from_fn(|i, j| match j {
        0..=2 => u[i] / scale_u * place(i).powi(j as i32),
        3..=5 => place(i).powi(j as i32 - 3).into(),
        _ => -y[i] / scale_y * place(i),
    });
    let b = SVector::<Complex64, LINES>::from_fn(|i, _| y[i] / scale_y);
    let qr = a.qr();
    let x = qr.r().solve_upper_triangular(&(qr.q().adjoint() * b))?;
    let residual = (b - a * x).norm_squared() / (LINES - UNKNOWNS) as f64;
    // The residual of the equations is (1 + a r) V.
    let weight = (0..LINES).map(|i| (1.0 + x[6] * place(i)).norm_sqr()).sum::<f64>() / LINES as f64;
    let power = residual / weight * scale_y * scale_y;
    power.is_finite().then_some(power)
}

#[cfg(test)]
mod tests {
    use super::power;
    use crate::features::Features;
    use crate::linear::Linear;
    use crate::response::{BAND, logarithmic_grid};
    use crate::sweep::Sweep;
    use crate::{demodulation, lengths, spa};

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
        let mut random = crate::random::Random::new(3, 0);
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
            let mut random = crate::random::Random::new(seed, 0);
            let noisy: Vec<f64> = rate.iter().map(|r| r + 4.066e-4 * random.normal()).collect();
            let residual = power(STEP, &torque, &noisy, &near);
            let swept =
                demodulation::frequency_responses(&sweep, &time, &torque, [&noisy[..]], &near);
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
}
