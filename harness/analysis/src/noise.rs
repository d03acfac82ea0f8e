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
