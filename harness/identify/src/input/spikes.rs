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
