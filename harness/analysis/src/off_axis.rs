//! Computes the fraction of the liquid's force that does not act about the hub's axis (thesis 6.3.6).
//!
//! The thesis uses the rates of a gyro about x and y, because the liquid's force tilts a platform. On a hub
//! that cannot tilt, the tangential force F_t turns the hub, and the radial force F_r only loads the bearing.
//! Therefore F_r represents the off-axis part and F_t the on-axis part:
//!
//! ```text
//! fraction(t) = F_r² / (F_r² + F_t²)      leakage(f) = r |F_r(f)| / |τ(f)|
//! ```
//!
//! The leakage uses the Fourier coefficients at the sweep's phase (from demodulation); r is the tank's
//! distance from the axis. The radial force of a planar wave, which is its centripetal force, oscillates at
//! twice the sweep's frequency and causes no leakage. A circular wave has the fraction 1/2 on average.

use crate::response::FrequencyResponse;
use crate::statistics::about_mean;

/// Off-axis part of the liquid's force in a run, in three measures. F_r is the radial force, which
/// does not turn the hub, and F_t the tangential force, which does.
///
/// - `median`: median over the samples of F_r²/(F_r² + F_t²), 0 to 1, as in Rubaga's thesis.
/// - `energy`: ratio for the whole record, Σ F_r² / Σ (F_r² + F_t²).
/// - `leakage`: root mean square over the frequencies of the moment of the radial force per torque
///   ([`leakage`]).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OffAxis {
    pub median: f64,
    pub energy: f64,
    pub leakage: f64,
}

impl OffAxis {
    /// Computes the three measures from the `radial` and the `tangential` force of the liquid, N,
    /// at every sample, and from the `leakage` at every frequency, which [`leakage`] returns.
    pub fn from_forces(radial: &[f64], tangential: &[f64], leakage: &[f64]) -> Self {
        let (mut off, mut all) = (0.0, 0.0);
        let mut fractions: Vec<f64> = Vec::with_capacity(radial.len());
        for (r, t) in radial.iter().zip(tangential) {
            let (r, sum) = (r * r, r * r + t * t);
            (off, all) = (off + r, all + sum);
            if sum > 0.0 {
                fractions.push(r / sum);
            }
        }
        let middle = fractions.len() / 2;
        let median = if fractions.is_empty() {
            0.0
        } else {
            *fractions.select_nth_unstable_by(middle, f64::total_cmp).1
        };
        let squares: f64 = leakage.iter().map(|l| l * l).sum();
        OffAxis {
            median,
            energy: if all > 0.0 { off / all } else { 0.0 },
            leakage: (squares / leakage.len().max(1) as f64).sqrt(),
        }
    }
}

/// Computes the off-axis part of the motion of a platform that may tilt. `rate` is the rate ω about
/// the hub's axis, rad/s, and `response` its frequency response H to the torque. `others` has, for
/// each other axis i, the response H_i and the rate ω_i. As in Rubaga's thesis, the cross-axis
/// energy fraction is Σω_i²/(Σω_i² + ω²), and the leakage is √(Σ|H_i|²)/|H|. Returns the leakage at
/// each frequency of the response, and the measures of [`OffAxis`] with rates in place of forces.
/// The measures are `None` if `others` is empty.
///
/// The mean of each rate is subtracted. Otherwise the bias of a gyro would count as energy: a bias
/// of 1 deg/s about x is larger than the rate of a bench about that axis. [`OffAxis::from_forces`]
/// does not subtract the means of the forces, because they are not measured by a biased sensor, and
/// the centripetal force of a wave has a mean.
pub fn off_axis_from_rates(
    response: &FrequencyResponse,
    rate: &[f64],
    others: &[(&FrequencyResponse, &[f64])],
) -> (Vec<f64>, Option<OffAxis>) {
    if others.is_empty() {
        return (Vec::new(), None);
    }
    let leakage: Vec<f64> = (response.response.iter().enumerate())
        .map(|(k, h)| {
            let squares: f64 = others.iter().map(|(other, _)| other.response[k].norm_sqr()).sum();
            squares.sqrt() / h.norm()
        })
        .collect();
    let centred: Vec<Vec<f64>> = others.iter().map(|(_, other)| about_mean(other)).collect();
    let off: Vec<f64> = (0..rate.len())
        .map(|k| centred.iter().map(|other| other[k] * other[k]).sum::<f64>().sqrt())
        .collect();
    let off_axis = OffAxis::from_forces(&off, &about_mean(rate), &leakage);
    (leakage, Some(off_axis))
}

/// Returns the leakage at each frequency: the moment of the radial force per torque. `radial` is
/// the response of the radial force to the torque, N per N·m, and `arm` is the tank's distance from
/// the axis, m.
pub fn leakage(radial: &FrequencyResponse, arm: f64) -> Vec<f64> {
    radial.response.iter().map(|h| arm * h.norm()).collect()
}
