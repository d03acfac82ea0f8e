//! Gaps in which no torque was recorded. A gap is filled if the torque around it predicts the missing samples; otherwise the
//! recording is cut there.
//!
//! A band-limited torque that is sampled densely is predictable over a gap: an autoregressive model is fitted to the samples on
//! both sides, and its forward and backward equations give the missing samples by least squares (Janssen, Veldhuis & Vries, IEEE
//! Trans. ASSP 34, 1986). The accuracy is estimated by trials: as many known samples are removed at other places, and predicted.
//! An error Δτ of the torque changes the rate of the hub by ∫Δτ dt/I, and the liquid then oscillates for a thousand rows;
//! therefore this change must be small against the gyro's noise.

use std::collections::BTreeMap;

use analysis::statistics::{deviation, mean};
use nalgebra::{DMatrix, DVector};

use crate::input::clocks;
use crate::input::recording::{Recording, Row};
use crate::tuning::{
    FEW_GAPS, GAP_KICK, GAP_ORDER, GAP_TRIALS, LONGEST_FILLED, LONGEST_LINE, LOST_SPACING,
    SHORTEST_RECORDING, UNEVEN,
};

/// Number of torque samples on each side of a gap to which the autoregressive model that predicts
/// the missing samples is fitted.
const GAP_SIDE: usize = 8 * GAP_ORDER;

/// Fills the gaps whose torque can be predicted. Returns the last row before each other gap, where the recording has to be cut.
/// `done` receives a sentence about each change.
pub fn bridged(all: Recording, done: &mut dyn FnMut(String)) -> (Recording, Vec<usize>) {
    let knots = all.commands();
    let time: Vec<f64> = knots.iter().map(|k| all.time[*k]).collect();
    let usual = clocks::usual(&time);
    let span = |n: usize| time[n + 1] - time[n];
    let (gaps, near): (Vec<usize>, Vec<usize>) =
        (0..time.len() - 1).partition(|n| span(*n) > LOST_SPACING * usual);
    if gaps.is_empty() {
        return (all, Vec::new());
    }
    let near: Vec<f64> = near.into_iter().map(span).collect();
    let step = mean(&near);
    let is_even = near.iter().all(|s| (s - step).abs() < UNEVEN * step);
    let values: Vec<f64> = knots.iter().map(|k| all.torque[*k]).collect();
    let kick = GAP_KICK * momentum(&all) / (gaps.len() as f64).sqrt();
    let (mut filled, mut left) = (Vec::new(), Vec::new());
    let mut tried: BTreeMap<usize, f64> = BTreeMap::new();
    for &n in &gaps {
        let lost = (span(n) / step).round() as usize - 1;
        let is_on_grid = (span(n) - (lost + 1) as f64 * step).abs() < 0.1 * step;
        if !is_even || !is_on_grid || span(n) > LONGEST_FILLED {
            left.push(n);
            continue;
        }
        let error = *tried.entry(lost).or_insert_with(|| trial_error(&values, &gaps, lost) * step);
        match fill(sides(&values, &gaps, n + 1, n + 1), lost) {
            Some(values) if error < kick => filled.push((n, values)),
            _ => left.push(n),
        }
    }
    if !filled.is_empty() {
        let count: usize = filled.iter().map(|(_, values)| values.len()).sum();
        let longest = filled.iter().map(|(n, _)| span(*n)).fold(0.0, f64::max);
        done(format!(
            "{}: {count} samples of tau_cmd are missing in {} gaps of up to {longest:.2} s; the other samples predict them well enough \
             (tested at other places), and omega is not fitted there",
            all.name,
            filled.len()
        ));
    }
    // the recording is cut at a gap if the parts on both sides are long enough, or if the gap is too long for a straight line
    let mut cuts = Vec::new();
    let few = left.len() <= FEW_GAPS;
    let end = time[time.len() - 1];
    let mut from = time[0];
    let is_long = |n: &usize| span(*n) > LONGEST_LINE.max(10.0 * usual);
    for (i, &n) in left.iter().enumerate() {
        let to = left[i + 1..].iter().copied().find(is_long).map_or(end, |m| time[m]);
        let least = (time[n] - from).min(to - time[n + 1]);
        if is_long(&n) || is_even && few && least >= SHORTEST_RECORDING {
            cuts.push(n);
            from = time[n + 1];
        }
    }
    let joined = left.iter().filter(|n| !cuts.contains(n)).count();
    if joined > 0 && is_even {
        done(format!(
            "{}: tau_cmd is missing for up to {LONGEST_LINE} s in {joined} places and cannot be predicted; it is interpolated linearly, which may \
             be wrong",
            all.name
        ));
    }
    let cuts: Vec<usize> = cuts.into_iter().map(|n| knots[n]).collect();
    with_rows(all, &knots, filled, cuts)
}

/// Returns up to [`GAP_SIDE`] samples of the torque before and behind the samples `from..to`, as far as the next gap on each side.
/// Gap g lies between the samples g and g + 1.
fn sides<'v>(values: &'v [f64], gaps: &[usize], from: usize, to: usize) -> [&'v [f64]; 2] {
    let first = gaps.iter().rev().find(|g| **g + 1 < from).map_or(0, |g| g + 1);
    let last = gaps.iter().find(|g| **g + 1 > to).map_or(values.len(), |g| g + 1);
    [&values[first.max(from.saturating_sub(GAP_SIDE))..from], &values[to..last.min(to + GAP_SIDE)]]
}

/// Estimates the error of filling a gap of `lost` samples by trials: known samples in other places are removed and predicted.
/// Returns the root mean square of the summed errors, infinite if no trial is possible.
pub fn trial_error(values: &[f64], gaps: &[usize], lost: usize) -> f64 {
    let side = 4 * GAP_ORDER;
    let room = values.len().saturating_sub(2 * side + lost);
    let mut squares = Vec::new();
    for trial in 0..4 * GAP_TRIALS {
        let from = side + (trial * 2 + 1) * room / (8 * GAP_TRIALS);
        let to = from + lost;
        let is_broken = to > values.len() || gaps.iter().any(|g| (from - 1..to).contains(g));
        if is_broken || squares.len() >= GAP_TRIALS && trial % 4 != 0 {
            continue;
        }
        let Some(found) = fill(sides(values, gaps, from, to), lost) else { return f64::INFINITY };
        let off: Vec<f64> = found.iter().zip(&values[from..to]).map(|(a, b)| a - b).collect();
        let sum: f64 = off.iter().sum();
        squares.push(off.iter().map(|e| e * e).sum::<f64>().max(sum * sum));
    }
    if squares.len() < GAP_TRIALS / 2 { f64::INFINITY } else { mean(&squares).sqrt() }
}

/// Predicts the `lost` samples of the torque between the samples on the `left` and on the `right`; `None` if these
/// samples are too few.
pub fn fill([left, right]: [&[f64]; 2], lost: usize) -> Option<Vec<f64>> {
    let order = GAP_ORDER.min((left.len() + right.len()) / 6).min(left.len().min(right.len()) / 2);
    if order < 4 {
        return None;
    }
    // forward equations x_k = Σ a_i x_{k−i}, and the corresponding backward equations
    let mut windows: Vec<Vec<f64>> = Vec::new();
    for window in [left, right].into_iter().flat_map(|side| side.windows(order + 1)) {
        windows.extend([window.iter().rev().copied().collect(), window.to_vec()]);
    }
    let size = deviation(left).max(deviation(right)).max(f64::MIN_POSITIVE);
    let count = windows.len();
    let regressors = DMatrix::from_fn(count, order, |k, i| windows[k][i + 1] / size);
    let target = DVector::from_fn(count, |k, _| windows[k][0] / size);
    // regularised slightly, because the samples of a smooth torque are nearly linearly dependent
    let weight = 1e-9 * count as f64;
    let mut normal = regressors.tr_mul(&regressors);
    (0..order).for_each(|i| normal[(i, i)] += weight);
    let a = normal.cholesky()?.solve(&regressors.tr_mul(&target));
    // forward and backward equations that contain lost samples; they are linear in the lost samples
    let (n, p) = (lost, order);
    let known = [&left[left.len() - p..], &vec![0.0; n], &right[..p]].concat();
    let mut matrix = DMatrix::<f64>::zeros(2 * (n + p), n);
    let mut rest = DVector::<f64>::zeros(2 * (n + p));
    for e in 0..n + p {
        for i in 0..=p {
            let factor = if i == 0 { 1.0 } else { -a[i - 1] };
            for (row, k) in [(2 * e, e + p - i), (2 * e + 1, e + i)] {
                match (p..p + n).contains(&k) {
                    true => matrix[(row, k - p)] += factor,
                    false => rest[row] += factor * known[k] / size,
                }
            }
        }
    }
    let found = matrix.svd(true, true).solve(&-rest, 1e-12).ok()?;
    Some(found.iter().map(|x| x * size).collect())
}

fn momentum(all: &Recording) -> f64 {
    let rate = all.of_fresh(&all.rate);
    let time = all.of_fresh(&all.time);
    let width = ((0.08 / clocks::usual(&time)) as usize).max(1);
    let slopes: Vec<f64> = (width..rate.len())
        .map(|k| (rate[k] - rate[k - width]) / (time[k] - time[k - width]))
        .collect();
    all.rate_noise() * deviation(&all.torque) / deviation(&slopes).max(f64::MIN_POSITIVE)
}

fn with_rows(
    all: Recording,
    knots: &[usize],
    filled: Vec<(usize, Vec<f64>)>,
    cuts: Vec<usize>,
) -> (Recording, Vec<usize>) {
    if filled.is_empty() {
        return (all, cuts);
    }
    let own = |(k, time): (usize, &f64)| Row { time: *time, own: Some(k), filled: None };
    let mut rows: Vec<Row> = all.time.iter().enumerate().map(own).collect();
    for (n, values) in filled {
        let (from, to) = (all.time[knots[n]], all.time[knots[n + 1]]);
        let part = (to - from) / (values.len() + 1) as f64;
        for (j, value) in values.into_iter().enumerate() {
            let time = from + (j + 1) as f64 * part;
            // rows that another sensor recorded within the gap
            let near = all.time.partition_point(|row| *row < time - 0.01 * part);
            match all.time.get(near).filter(|row| (**row - time).abs() < 0.01 * part) {
                Some(_) => rows[near].filled = Some(value),
                None => rows.push(Row { time, own: None, filled: Some(value) }),
            }
        }
    }
    rows.sort_by(|a, b| a.time.total_cmp(&b.time));
    let place = |row: usize| rows.iter().position(|of| of.own == Some(row)).unwrap_or(row);
    let cuts = cuts.into_iter().map(place).collect();
    (all.with_rows(&rows), cuts)
}
