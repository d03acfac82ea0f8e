//! Finds values of a sensor that do not show the motion: repeated by the logger, clipped at the end of the sensor's range, or
//! frozen. They are reported and not fitted.

use analysis::innovations::LIMIT;
use analysis::statistics::{mean, median, noise_level, peak};

use crate::input::spikes;
use crate::tuning::{
    CLIPPED, CLIPPED_INSIDE, FAULT_STEPS, FROZEN_CHANCE, FROZEN_RUN, REPEATS, SENSOR_ROUNDING,
};

#[derive(Debug, Default, PartialEq)]
pub struct Faults {
    pub rows: Vec<usize>,
    pub words: Vec<String>,
}

/// The value of a sensor while the hub is at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rest {
    /// The value of a gyro at rest: its bias, because the true rate is 0. `None` if the bias is unknown.
    Rate(Option<f64>),
    /// The value of an encoder at rest, which may be any angle. The angle leaves this value smoothly, because the hub
    /// starts with zero rate.
    Angle,
}

impl Rest {
    /// Returns the size of the jump from row k to the next row, which ends a run of clipped or frozen values. Returns `None` if
    /// the hub was at rest during the run. For an angle, the part of the jump that is a smooth start of motion is subtracted.
    fn jump(self, values: &[f64], k: usize) -> Option<f64> {
        let step = (values.get(k + 1)? - values[k]).abs();
        match self {
            Rest::Rate(rest) if rest == Some(values[k]) => None,
            Rest::Rate(_) => Some(step),
            Rest::Angle => {
                // a motion from rest with constant acceleration has increments of 1 : 3
                let second = values.get(k + 2).map_or(0.0, |next| (next - values[k + 1]).abs());
                Some(step - second / 3.0)
            }
        }
    }
}

/// Finds the faults in the values of the sensor `name` at increasing times, s. Equal values while the hub is at
/// rest are no fault.
pub fn find(name: &str, time: &[f64], values: &[f64], rest: Rest) -> Faults {
    let mut found = Faults::default();
    if values.len() < 100 {
        return found;
    }
    let noise = noise_level(values);
    let mut out = vec![false; values.len()];
    let at = |k: usize| format!("{:.2} s", time[k]);
    let ends = [("upper", 1.0), ("lower", -1.0)];
    let resolution = resolution(values);
    // the two ends of a gyro's range are opposite numbers; the extreme values of a motion from rest are not
    let sizes: Vec<f64> = values.iter().map(|v| v.abs()).collect();
    let opposite = match rest {
        Rest::Rate(_) if is_opposite(values) => held(&sizes, 1.0, (noise, resolution)),
        _ => Vec::new(),
    };
    let held = ends.map(|(_, sign)| match opposite.is_empty() {
        true => held(values, sign, (noise, resolution)),
        false => opposite.iter().copied().filter(|k| sign * values[*k] > 0.0).collect(),
    });
    let jumps = [0, 1].map(|i| leaves(values, &held[i], rest));
    let steps = |jump: &Option<f64>| jump.is_some_and(|jump| jump > FAULT_STEPS * resolution);
    // a hub can be at rest at one of the two extreme rates, but not at both
    let both = rest != Rest::Angle && jumps.iter().all(steps);
    for (((end, _), rows), jump) in ends.into_iter().zip(held).zip(jumps) {
        if !both && jump.is_none_or(|jump| jump <= LIMIT * noise) {
            continue;
        }
        if let [first, .., last] = rows[..] {
            found.words.push(format!(
                "{name} is clipped: {} values are {:.4e}, the {end} end of its range, between {} and {}; they are not fitted",
                rows.len(),
                values[first],
                at(first),
                at(last)
            ));
        }
        for k in rows {
            // noise is cut on one side near the end of the range
            (k.saturating_sub(1)..=(k + 1).min(values.len() - 1)).for_each(|k| out[k] = true);
        }
    }
    let runs = frozen(values, &out, noise, rest);
    if let Some((first, _)) = runs.first() {
        let longest = runs.iter().map(|(a, b)| time[*b] - time[*a]).fold(0.0, f64::max);
        found.words.push(format!(
            "{name} is frozen {} times for up to {longest:.2} s, first at {}; these values are not fitted",
            runs.len(),
            at(*first)
        ));
    }
    runs.iter().for_each(|(first, last)| out[first + 1..=*last].fill(true));
    let repeats = repeated(time, values, &out, noise, rest);
    if !repeats.is_empty() {
        found.words.push(format!(
            "{} of {} values of {name} repeat the value before although the hub moves; they are not fitted",
            repeats.len(),
            values.len()
        ));
    }
    repeats.into_iter().for_each(|k| out[k] = true);
    found.rows = (0..values.len()).filter(|k| out[*k]).collect();
    found
}

fn is_opposite(values: &[f64]) -> bool {
    let ends = values
        .iter()
        .fold((f64::NEG_INFINITY, f64::INFINITY), |(high, low), v| (high.max(*v), low.min(*v)));
    (ends.0 + ends.1).abs() <= SENSOR_ROUNDING * peak(values)
}

/// Returns the rows with the largest value (with the smallest, if `sign` is −1), if they are numerous and adjacent. The sensor is
/// then clipped, or the hub is at rest.
fn held(values: &[f64], sign: f64, (noise, resolution): (f64, f64)) -> Vec<usize> {
    let end = values.iter().fold(f64::NEG_INFINITY, |end, v| end.max(sign * v));
    let rows: Vec<usize> = (0..values.len()).filter(|k| sign * values[*k] == end).collect();
    let beside = |v: &&f64| (end - CLIPPED_INSIDE * noise..end).contains(&(sign * **v));
    // expected number of equal values at the end of the range, estimated from the values just inside the range
    let share = (resolution / (CLIPPED_INSIDE * noise)).min(1.0);
    let usual = share * values.iter().filter(beside).count() as f64;
    let is_run = |k: &&usize| {
        let equal = |j: usize| values.get(j) == Some(&values[**k]);
        **k > 0 && equal(**k - 1) || equal(**k + 1)
    };
    let in_runs = rows.iter().filter(is_run).count();
    let many = rows.len() >= CLIPPED.0 && rows.len() as f64 > CLIPPED.1 * usual;
    if many && 2 * in_runs > rows.len() { rows } else { Vec::new() }
}

/// Returns the median difference between the value at an end of the sensor's range and the next value that differs from it.
/// `rows` are the rows with the value at this end.
fn leaves(values: &[f64], rows: &[usize], rest: Rest) -> Option<f64> {
    let last = rows.iter().filter(|k| values.get(**k + 1) != Some(&values[**k]));
    let jumps: Vec<f64> = last.filter_map(|k| rest.jump(values, *k)).collect();
    median(&jumps)
}

fn resolution(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rounding = SENSOR_ROUNDING * peak(values);
    let steps = sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > rounding);
    steps.fold(f64::INFINITY, f64::min)
}

/// Returns the first and the last row of each run of equal values in which the sensor is frozen. The evidence for a frozen
/// sensor is a run that is too long to be chance, whose value is away from the mean (the gyro's bias, which is the value of
/// a hub at rest, is near the mean), and which ends in a jump. If there is such a run, other long runs count even if they
/// lack one of the last two properties, because a rate may freeze near its mean, or come back near the frozen value.
fn frozen(values: &[f64], out: &[bool], noise: f64, rest: Rest) -> Vec<(usize, usize)> {
    let runs = runs(values);
    let is_long = |(a, b): &&(usize, usize)| b - a + 1 >= FROZEN_RUN;
    let mean = mean(values);
    let repeats: usize = runs.iter().filter(|run| !is_long(run)).map(|(a, b)| b - a).sum();
    let chance = (repeats + 1) as f64 / values.len() as f64;
    let least = 1.0 + (FROZEN_CHANCE / values.len() as f64).ln() / chance.ln();
    let sign = |&(_, b): &(usize, usize)| {
        let jump = rest.jump(values, b).is_some_and(|jump| jump > LIMIT * noise);
        (jump, (values[b] - mean).abs() > LIMIT * noise)
    };
    let is_no_chance = |run: &&(usize, usize)| {
        let (a, b) = **run;
        is_long(run) && (b - a + 1) as f64 >= least && !out[a] && !out[b]
    };
    let runs: Vec<(usize, usize)> = runs.iter().filter(is_no_chance).copied().collect();
    if !runs.iter().any(|run| sign(run) == (true, true)) {
        return Vec::new();
    }
    // an angle away from its mean may be at rest
    let is_frozen = |run: &(usize, usize)| {
        let (jump, moves) = sign(run);
        jump || moves && rest != Rest::Angle
    };
    runs.into_iter().filter(is_frozen).collect()
}

fn runs(values: &[f64]) -> Vec<(usize, usize)> {
    let mut runs = Vec::new();
    let mut first = 0;
    for k in 1..=values.len() {
        if values.get(k) != Some(&values[first]) {
            runs.push((first, k - 1));
            first = k;
        }
    }
    runs
}

/// Returns the rows that repeat the value before them although the signal is changing, except rows that are marked as
/// faulty in `out`. A long run of equal angles that ends without a jump is no fault, because the hub is at rest.
fn repeated(time: &[f64], values: &[f64], out: &[bool], noise: f64, rest: Rest) -> Vec<usize> {
    let moves = |(a, b): &(usize, usize)| {
        let jumps = || rest.jump(values, *b).is_some_and(|jump| jump > LIMIT * noise);
        rest != Rest::Angle || b - a + 1 < FROZEN_RUN || jumps()
    };
    let moving = runs(values).into_iter().filter(moves);
    let repeats: Vec<usize> = moving.flat_map(|(a, b)| a + 1..=b).filter(|k| !out[*k]).collect();
    if repeats.len() < REPEATS.0 {
        return Vec::new();
    }
    let off = spikes::differences_from_neighbours(time, values);
    let squares: Vec<f64> = off.iter().map(|e| e * e).collect();
    // 0.4549 is the median of χ² with one degree of freedom
    let usual = median(&squares).unwrap_or(0.0) / 0.4549;
    let usual = usual.max((SENSOR_ROUNDING * peak(values)).powi(2));
    let of_repeats = repeats.iter().map(|k| squares[*k]).sum::<f64>() / repeats.len() as f64;
    if of_repeats > REPEATS.1 * usual { repeats } else { Vec::new() }
}
