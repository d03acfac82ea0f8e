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

#[cfg(test)]
mod tests {
    use super::*;
    use analysis::random::Random;

    const LEAST: f64 = 1.5e-4;

    /// Returns 200 s at 50 Hz of a motion of 2 Hz with growing amplitude, measured by a gyro with a finite resolution.
    fn gyro() -> (Vec<f64>, Vec<f64>) {
        let mut random = Random::new(5, 0);
        let time: Vec<f64> = (0..10_000).map(|k| 0.02 * f64::from(k)).collect();
        let rate = time.iter().map(|t| {
            let motion = 5e-4 * t * (std::f64::consts::TAU * 2.0 * t).sin();
            ((motion + 4e-4 * random.normal()) / LEAST).round() * LEAST
        });
        let rate = rate.collect();
        (time, rate)
    }

    fn words(time: &[f64], values: &[f64]) -> (usize, String) {
        let found = find("omega", time, values, Rest::Rate(None));
        (found.rows.len(), found.words.join("\n"))
    }

    #[test]
    fn no_fault_is_found_in_a_sound_gyro() {
        let (time, mut rate) = gyro();
        assert_eq!(find("omega", &time, &rate, Rest::Rate(None)), Faults::default());
        // a hub at rest for 20 s, with a gyro whose resolution is coarser than its noise
        rate[..1000].fill(3e-4);
        assert_eq!(find("omega", &time, &rate, Rest::Rate(None)), Faults::default());
        // a gyro with a resolution so coarse that it repeats values by chance
        rate.iter_mut().for_each(|w| *w = (*w / 5e-3).round() * 5e-3);
        assert_eq!(find("omega", &time, &rate, Rest::Rate(None)), Faults::default());
    }

    #[test]
    fn a_hub_at_rest_is_no_fault() {
        // at rest, half a turn in 10 s, at rest, back with constant acceleration, at rest, and on
        let course = |t: f64| match t {
            _ if t < 20.0 => 0.0,
            _ if t < 30.0 => 0.016 * (t - 20.0).powi(2),
            _ if t < 40.0 => 3.2 - 0.016 * (40.0 - t).powi(2),
            _ if t < 60.0 => 3.2,
            _ if t < 80.0 => 3.2 - 0.005 * (t - 60.0).powi(2),
            _ => 1.2 - 0.005 * (100.0 - t).powi(2),
        };
        // the torque begins between two rows
        let time: Vec<f64> = (0..5000).map(|k| 0.02 * f64::from(k) + 0.007).collect();
        for step in [1e-12, 1.7e-6] {
            let angle: Vec<f64> = time.iter().map(|t| (course(*t) / step).round() * step).collect();
            assert_eq!(find("theta", &time, &angle, Rest::Angle), Faults::default(), "{step}");
            let clipped: Vec<f64> = angle.iter().map(|a| a.min(2.0)).collect();
            let said = find("theta", &time, &clipped, Rest::Angle).words;
            assert!(said.len() == 1 && said[0].contains("theta is clipped"), "{step}: {said:?}");
        }
        // a noiseless rate that is smallest while the hub is at rest
        let pushed =
            |t: f64| 0.05 * (t - 20.0).clamp(0.0, 5.0) - 0.02 * (t - 25.0).clamp(0.0, 12.5);
        let rate: Vec<f64> = time.iter().map(|t| 0.002 + pushed(*t % 50.0)).collect();
        let is_clipped = |rest: Option<f64>| {
            let found = find("omega", &time, &rate, Rest::Rate(rest));
            found.words.iter().any(|line| line.contains("clipped"))
        };
        assert!(!is_clipped(Some(rate[0])));
    }

    /// The biased gyro reaches one end of its range in each cycle, and the other end in few cycles. Its first value after each
    /// end differs from the end by less than five standard deviations of its noise.
    #[test]
    fn clipping_at_one_end_of_the_range_is_also_assumed_at_the_other_end() {
        let mut random = Random::new(5, 0);
        let time: Vec<f64> = (0..10_000).map(|k| 0.02 * f64::from(k)).collect();
        let mut gyro = |bias: f64| -> Vec<f64> {
            let motion = |t: &f64| bias + 0.02 * (std::f64::consts::TAU * 2.03 * t).sin();
            let mut read = |t| ((motion(t) + 4e-4 * random.normal()) / LEAST).round() * LEAST;
            time.iter().map(|t| read(t).clamp(-0.0195, 0.0195)).collect()
        };
        let values = gyro(1.3e-3);
        let lower = values.iter().filter(|w| **w == -0.0195).count();
        assert!((1..CLIPPED.0).contains(&lower), "{lower}");
        let (_, said) = words(&time, &values);
        assert!(said.contains("the upper end") && said.contains("the lower end"), "{said}");
    }

    #[test]
    fn each_fault_of_a_sensor_is_reported() {
        let (time, rate) = gyro();
        let clipped: Vec<f64> = rate.iter().map(|w| w.clamp(-0.06, 0.06)).collect();
        let (rows, said) = words(&time, &clipped);
        assert!(said.contains("omega is clipped") && said.contains("the upper end"), "{said}");
        // 42 % of the rows from 120 s on are clipped, and one neighbour on each side of 320 runs is left out, too
        assert!((2250..2450).contains(&rows), "{rows}");
        // at 100 Hz the gyro leaves both ends of its range by less than five standard deviations of its noise
        let half: Vec<f64> = clipped.iter().map(|w| 0.2 * w.clamp(-0.04, 0.04)).collect();
        let mut random = Random::new(6, 0);
        let slow = |k: usize| (half[k / 2] + half[k.div_ceil(2)]) / 2.0 + 4e-4 * random.normal();
        let slow: Vec<f64> = (0..19_998)
            .map(slow)
            .map(|w| (w / LEAST).round() * LEAST)
            .map(|w| w.clamp(-0.006, 0.006))
            .collect();
        let time_100: Vec<f64> = (0..19_998).map(|k| 0.01 * f64::from(k)).collect();
        let (_, said) = words(&time_100, &slow);
        assert!(said.contains("the upper end") && said.contains("the lower end"), "{said}");
        let mut frozen = rate.clone();
        for from in [5003, 7003] {
            let value = frozen[from];
            frozen[from..from + 30].fill(value);
        }
        let (rows, said) = words(&time, &frozen);
        assert!(
            said.contains("omega is frozen 2 times for up to 0.58 s, first at 100.06 s"),
            "{said}"
        );
        assert_eq!(rows, 58);
        // the gyro freezes a third time near the mean, and a last time for a whole cycle, after which the rate is near
        // the frozen value again
        let is_near_mean = |k: &usize| rate[*k].abs() < 1e-3 && rate[*k + 30].abs() > 0.01;
        let is_met = |k: &usize| (rate[*k] - rate[*k + 25]).abs() < 1e-3 && rate[*k].abs() > 0.01;
        let near_mean = (4000..4900).find(is_near_mean).unwrap();
        let met = (8000..9000).find(is_met).unwrap();
        for (from, rows) in [(near_mean, 30), (met, 25)] {
            let value = frozen[from];
            frozen[from..from + rows].fill(value);
        }
        let (rows, said) = words(&time, &frozen);
        assert!(said.contains("omega is frozen 4 times"), "{said}");
        assert_eq!(rows, 58 + 29 + 24);
        let mut repeats = rate.clone();
        (1..500).for_each(|k| repeats[20 * k] = repeats[20 * k - 1]);
        let (rows, said) = words(&time, &repeats);
        assert!(said.contains("repeat the value before although") && rows > 499, "{rows} {said}");
    }
}
