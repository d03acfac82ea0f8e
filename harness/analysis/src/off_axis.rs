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

#[cfg(test)]
mod tests {
    use super::{OffAxis, off_axis_from_rates};
    use crate::response::FrequencyResponse;
    use fourier::Complex64;

    #[test]
    fn rates_of_a_tenth_about_two_other_axes_give_a_cross_axis_energy_fraction_of_a_fiftieth() {
        let response = |size: f64| FrequencyResponse {
            frequency: vec![1.0; 4],
            response: vec![Complex64::new(0.0, size); 4],
        };
        let (all, x) = (response(2.0), response(0.2));
        let (rate, tenth) = ([1.0, -2.0, -1.0, 2.0], [0.1, 0.2, -0.1, -0.2]);
        let (leakage, found) = off_axis_from_rates(&all, &rate, &[(&x, &tenth), (&x, &tenth)]);
        let found = found.unwrap();
        assert!(
            (found.median - 0.02 / 1.02).abs() < 1e-15
                && (found.energy - 0.02 / 1.02).abs() < 1e-15
        );
        assert!(leakage.iter().all(|l| (l - 0.02f64.sqrt()).abs() < 1e-15));
        assert_eq!(off_axis_from_rates(&all, &rate, &[]), (Vec::new(), None));
    }

    #[test]
    fn a_bias_of_up_to_5_deg_s_on_any_axis_does_not_change_the_cross_axis_energy_fraction() {
        let wave = |size: f64, phase: f64| -> Vec<f64> {
            (0..3000).map(|k| size * (0.3 * f64::from(k) + phase).sin()).collect()
        };
        let (rate, x, y) = (wave(0.1, 0.0), wave(0.005, 1.0), wave(0.005, 2.0));
        let none = FrequencyResponse::default();
        let found = |biases: [f64; 3]| {
            let biased = |signal: &[f64], bias: f64| -> Vec<f64> {
                signal.iter().map(|w| w + bias.to_radians()).collect()
            };
            let [rate, x, y] = [(&rate, 0), (&x, 1), (&y, 2)].map(|(w, k)| biased(w, biases[k]));
            off_axis_from_rates(&none, &rate, &[(&none, &x), (&none, &y)]).1.unwrap()
        };
        let without = found([0.0; 3]);
        // 2 · 0.05² divided by the sum of the squares over all three axes
        assert!((without.energy - 0.005 / 1.005).abs() < 1e-4, "{}", without.energy);
        for axis in 0..3 {
            for bias in [-5.0, 0.1, 1.0, 5.0] {
                let mut biases = [0.0; 3];
                biases[axis] = bias;
                let with = found(biases);
                // the bias is 17 times the rate, so that rounding errors are 1e-14
                assert!((with.energy / without.energy - 1.0).abs() < 1e-9, "{biases:?}: {with:?}");
                assert!((with.median / without.median - 1.0).abs() < 1e-9, "{biases:?}: {with:?}");
            }
        }
    }

    #[test]
    fn half_of_a_circling_force_is_off_axis_and_none_of_a_tangential_force() {
        let turn = |k: usize| (k as f64 * std::f64::consts::TAU / 1000.0).sin_cos();
        let (sine, cosine): (Vec<f64>, Vec<f64>) = (0..1000).map(turn).unzip();
        let circle = OffAxis::from_forces(&sine, &cosine, &[3.0, 4.0]);
        // the median is between the fractions of two samples, which differ by 6e-3
        assert!((circle.energy - 0.5).abs() < 1e-12 && (circle.median - 0.5).abs() < 1e-2);
        assert!((circle.leakage - 12.5_f64.sqrt()).abs() < 1e-12);
        let line = OffAxis::from_forces(&[0.0; 1000], &cosine, &[]);
        assert_eq!(line, OffAxis::default());
    }
}
