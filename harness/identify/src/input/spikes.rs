//! Finds spikes: single values of the gyro that no motion explains, such as transmission errors and flipped bits.
//!
//! A value is compared with the cubic through its two neighbours on either side. In evenly spaced rows the difference is
//!
//! ```text
//! r_k = y_k − (−y_{k−2} + 4 y_{k−1} + 4 y_{k+1} − y_{k+2})/6
//! ```
//!
//! White noise with standard deviation σ gives r a standard deviation of √(1 + 34/36) σ = 1.39 σ; a motion of a few hertz changes
//! r hardly at all, and a step of the torque changes it by a kink. In unevenly spaced rows r is scaled to the same noise. The
//! limit of r grows with the values of r in the neighbourhood, because the coarse samples of a resonance make all of them large.
//! The largest spike is removed first, because a spike also changes r of its neighbours. The rows of spikes are left out of the
//! fit, because such a value should have no weight (a robust loss such as Hampel's has the same effect).

use std::collections::{BTreeMap, BTreeSet};

use analysis::innovations::LIMIT;
use analysis::statistics::{median, noise_level, peak};

use crate::input::clocks::weights;
use crate::tuning::{SPIKE_AROUND, SPIKE_NEAR_STEP, SPIKE_SHARE, TORQUE_STEP};

/// Returns the standard deviation of the difference between a value and the cubic through its four neighbours, if the
/// values are white noise with the standard deviation 1.
fn gain() -> f64 {
    (1.0_f64 + 34.0 / 36.0).sqrt()
}

/// Returns the difference of each value from the cubic through its neighbours, scaled to the noise of evenly spaced rows, and 0
/// at the ends. `time` must increase.
pub fn differences_from_neighbours(time: &[f64], y: &[f64]) -> Vec<f64> {
    let inner = 2..y.len().saturating_sub(2);
    let one = |k: usize| match inner.contains(&k) {
        true => off((time, y), &[k - 1, k - 2, k + 1, k + 2], k).0,
        false => 0.0,
    };
    (0..y.len()).map(one).collect()
}

/// Returns the rows in which a rate has a spike, in ascending order, each with the value there of the cubic through the
/// neighbouring rows. If `fresh` is given, only rows in which it is true are used. Returns nothing if so many values
/// deviate that they are noise of another kind.
pub fn find(
    time: &[f64],
    rate: &[f64],
    torque: &[f64],
    fresh: Option<&[bool]>,
) -> Vec<(usize, f64)> {
    let rows: Vec<usize> = (0..rate.len()).filter(|&k| fresh.is_none_or(|f| f[k])).collect();
    let (t, y): (Vec<f64>, Vec<f64>) = rows.iter().map(|&k| (time[k], rate[k])).unzip();
    if y.len() < 100 {
        return Vec::new();
    }
    let residuals: Vec<f64> =
        differences_from_neighbours(&t, &y)[2..y.len() - 2].iter().map(|r| r.abs()).collect();
    // for noise, the median of |r| is 0.6745 σ; it is larger if friction causes kinks in many rows
    let typical = |residuals: &[f64]| median(residuals).map_or(0.0, |m| m / 0.6745);
    let around: Vec<f64> = residuals.chunks(SPIKE_AROUND).map(typical).collect();
    let usual = typical(&residuals).max(gain() * noise_level(&y));
    // of 10¹⁴ recordings with 135,000 rows of noise, one contains a value beyond ten standard deviations
    let limit = |k: usize| {
        let chunk = (k.max(2) - 2) / SPIKE_AROUND;
        let near = chunk.saturating_sub(1)..(chunk + 2).min(around.len());
        2.0 * LIMIT * around[near].iter().copied().fold(usual, f64::max)
    };
    let step = TORQUE_STEP * peak(torque);
    let suspects: Vec<usize> = (2..y.len() - 2)
        .filter(|&k| residuals[k - 2] > limit(k) && !near_step(torque, rows[k], step))
        .collect();
    let most = (SPIKE_SHARE * y.len() as f64) as usize;
    // a spike affects the cubics of four neighbours
    if suspects.is_empty() || suspects.len() > 5 * most {
        return Vec::new();
    }
    let mut sound: BTreeSet<usize> = (0..y.len()).collect();
    let off_sound = |sound: &BTreeSet<usize>, k: usize| off((&t, &y), &near(sound, k), k);
    let mut sizes: BTreeMap<usize, f64> = suspects.iter().map(|&k| (k, residuals[k - 2])).collect();
    let mut taken: Vec<usize> = Vec::new();
    loop {
        let large = sizes.iter().filter(|(k, r)| **r > limit(**k));
        let Some((&k, _)) = large.max_by(|a, b| a.1.total_cmp(b.1)) else { break };
        sizes.remove(&k);
        sound.remove(&k);
        taken.push(k);
        for j in near(&sound, k) {
            sizes.entry(j).and_modify(|r| *r = off_sound(&sound, j).0.abs());
        }
    }
    // neighbours of spikes that were removed by mistake are restored
    for k in taken.iter().copied() {
        if off_sound(&sound, k).0.abs() < limit(k) {
            sound.insert(k);
        }
    }
    taken.retain(|k| !sound.contains(k));
    if taken.len() > most {
        return Vec::new();
    }
    taken.sort_unstable();
    taken.iter().map(|&k| (rows[k], off_sound(&sound, k).1)).collect()
}

fn near(sound: &BTreeSet<usize>, k: usize) -> Vec<usize> {
    sound.range(..k).rev().take(2).chain(sound.range(k + 1..).take(2)).copied().collect()
}

/// Returns the difference of the value in row `k` from the cubic through the rows `nodes`, scaled to the noise of evenly spaced
/// rows, and the cubic's value in row `k`.
fn off((time, y): (&[f64], &[f64]), nodes: &[usize], k: usize) -> (f64, f64) {
    let times: Vec<f64> = nodes.iter().map(|j| time[*j]).collect();
    let weights = weights(&times, time[k]);
    let cubic = nodes.iter().zip(&weights).map(|(j, weight)| y[*j] * weight).sum();
    let own = (1.0 + weights.iter().map(|w| w * w).sum::<f64>()).sqrt();
    ((y[k] - cubic) * gain() / own.max(gain()), cubic)
}

/// Returns true if the torque changes by more than `step`, N·m, between neighbouring rows close to `row`.
fn near_step(torque: &[f64], row: usize, step: f64) -> bool {
    let near = row.saturating_sub(SPIKE_NEAR_STEP)..(row + SPIKE_NEAR_STEP).min(torque.len() - 1);
    near.into_iter().any(|k| (torque[k + 1] - torque[k]).abs() > step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use analysis::random::Random;

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
}
