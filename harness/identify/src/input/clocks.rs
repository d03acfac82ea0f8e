//! Signals with different sampling clocks in one table: marks the rows in which a signal was measured, and interpolates its
//! values in the other rows.
//!
//! The rows of a recording are all the instants at which any signal was measured. In rows without a value of a sensor, the fit
//! does not compare the model with this sensor; a missing torque is interpolated between its own samples. Interpolated values of
//! sensors are used only for spectra and plots.

use std::f64::consts::PI;

use crate::tuning::{FINE_TORQUE, KERNEL_HALF, LOST_SPACING, UNEVEN};

/// Values of a signal at all rows, and for each row whether the value was measured there; `None` if every value was measured.
pub type Clocked = (Vec<f64>, Option<Vec<bool>>);

/// Replaces the NaN values of rows in which the signal was not measured. A missing value is taken from the cubic through the four
/// nearest values or, if samples among these were lost, from a straight line.
pub fn completed(time: &[f64], values: Vec<f64>) -> Clocked {
    let there: Vec<bool> = values.iter().map(|v| !v.is_nan()).collect();
    if there.iter().all(|there| *there) {
        return (values, None);
    }
    let rows: Vec<usize> = (0..values.len()).filter(|k| there[*k]).collect();
    let usual = usual(&rows.iter().map(|k| time[*k]).collect::<Vec<_>>());
    let mut next = 0;
    let filled = (0..values.len()).map(|k| {
        while next < rows.len() && rows[next] < k {
            next += 1;
        }
        match (next.checked_sub(1).map(|n| rows[n]), rows.get(next).copied()) {
            (_, Some(b)) if b == k => values[k],
            (Some(a), Some(b)) => {
                let far = [next.checked_sub(2).map(|n| rows[n]), rows.get(next + 1).copied()];
                let is_near = |pair: &[usize]| time[pair[1]] - time[pair[0]] < LOST_SPACING * usual;
                let nodes: Vec<usize> =
                    [far[0], Some(a), Some(b), far[1]].into_iter().flatten().collect();
                match nodes.windows(2).all(is_near) {
                    true => through(&nodes, time, &values, time[k]),
                    false => through(&[a, b], time, &values, time[k]),
                }
            }
            (Some(only), None) | (None, Some(only)) => values[only],
            (None, None) => f64::NAN,
        }
    });
    (filled.collect(), Some(there))
}

/// Returns the median time between rows, s.
pub fn usual(time: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len().saturating_sub(1) / 2;
    if steps.is_empty() {
        f64::INFINITY
    } else {
        *steps.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}

/// Returns true if the times are evenly spaced within a small tolerance.
pub fn is_even(time: &[f64]) -> bool {
    let step = (time[time.len() - 1] - time[0]) / (time.len() - 1) as f64;
    time.windows(2).all(|pair| (pair[1] - pair[0] - step).abs() < UNEVEN * step)
}

/// Returns a signal at time `t` by linear interpolation. `row` is the row before `t`, which the function only increases, so that
/// successive calls need increasing times.
pub fn interpolated_at(time: &[f64], signal: &[f64], t: f64, row: &mut usize) -> f64 {
    while *row + 2 < time.len() && time[*row + 1] <= t {
        *row += 1;
    }
    let k = *row;
    let part = ((t - time[k]) / (time[k + 1] - time[k])).clamp(0.0, 1.0);
    signal[k] + part * (signal[k + 1] - signal[k])
}

pub fn weights(nodes: &[f64], at: f64) -> Vec<f64> {
    let weight = |(j, node): (usize, &f64)| -> f64 {
        let others = nodes.iter().enumerate().filter(|(i, _)| *i != j);
        others.map(|(_, other)| (at - other) / (node - other)).product()
    };
    nodes.iter().enumerate().map(weight).collect()
}

fn through(nodes: &[usize], time: &[f64], values: &[f64], at: f64) -> f64 {
    let times: Vec<f64> = nodes.iter().map(|k| time[*k]).collect();
    weights(&times, at).iter().zip(nodes).map(|(weight, k)| weight * values[*k]).sum()
}

/// Returns instants and values of a band-limited torque at a spacing at which linear interpolation is accurate; samples that are
/// dense enough are returned unchanged. Coarse, evenly spaced samples are interpolated by a windowed sinc, with samples beyond
/// the ends mirrored at the end points; unevenly spaced samples are interpolated by cubics.
pub fn refined(time: &[f64], values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let n = time.len();
    let step = (time[n - 1] - time[0]) / (n - 1) as f64;
    let parts = (step / FINE_TORQUE).round() as usize;
    if parts < 2 {
        return (time.to_vec(), values.to_vec());
    }
    let even = is_even(time);
    let sample = |k: isize| match k {
        k if k < 0 => 2.0 * values[0] - values[(-k as usize).min(n - 1)],
        k if k as usize >= n => {
            2.0 * values[n - 1] - values[(2 * (n - 1)).saturating_sub(k as usize)]
        }
        k => values[k as usize],
    };
    let between = |k: usize, part: f64| -> f64 {
        if even {
            let k = k as isize;
            return (1 - KERNEL_HALF..=KERNEL_HALF)
                .map(|j| sample(k + j) * kernel(part - j as f64))
                .sum();
        }
        let from = k.saturating_sub(1).min(n.saturating_sub(4));
        let nodes: Vec<usize> = (from..(from + 4).min(n)).collect();
        through(&nodes, time, values, time[k] + part * (time[k + 1] - time[k]))
    };
    let (mut fine_time, mut fine) = (vec![time[0]], vec![values[0]]);
    for k in 0..n - 1 {
        for j in 1..parts {
            let part = j as f64 / parts as f64;
            fine_time.push(time[k] + part * (time[k + 1] - time[k]));
            fine.push(between(k, part));
        }
        fine_time.push(time[k + 1]);
        fine.push(values[k + 1]);
    }
    (fine_time, fine)
}

/// Returns the interpolation kernel at a distance of `x` samples: the sinc function times a Kaiser window whose side lobes
/// are at −80 dB.
fn kernel(x: f64) -> f64 {
    let shape = 0.1102 * (80.0 - 8.7);
    let bessel = |z: f64| {
        let mut term = 1.0;
        (1..60).fold(1.0, |sum, k| {
            term *= (0.5 * z / f64::from(k)).powi(2);
            sum + term
        })
    };
    let inside = 1.0 - (x / KERNEL_HALF as f64).powi(2);
    if inside <= 0.0 {
        return 0.0;
    }
    let sinc = if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) };
    sinc * bessel(shape * inside.sqrt()) / bessel(shape)
}
