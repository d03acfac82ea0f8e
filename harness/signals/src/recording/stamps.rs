//! Finds the even grid of times that a logger printed with few digits.
//!
//! A logger at 33 Hz that prints milliseconds writes 0.030, 0.061, 0.091. Each time is wrong by up to half
//! a millisecond, and such a shift of the torque causes larger errors than the noise of a gyro. If one
//! even grid, possibly with missing rows, explains every printed time within its rounding, the grid
//! replaces the printed times.

/// An even grid that explains printed times: the unit of their last digit, the step, and the times, all in s.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    pub quantum: f64,
    pub step: f64,
    pub time: Vec<f64>,
}

const DECIMALS: i32 = 6;
/// Largest difference between a time and a multiple of its last digit's unit, relative to this unit, that
/// floating-point rounding explains: times since 1970 in seconds have only 52 binary digits.
const OFF: f64 = 1e-2;
/// A grid is accepted if the differences between the printed times and the times of the grid span at most the unit of the
/// last digit plus this fraction of the unit.
const BEYOND: f64 = 0.02;
const FEWEST: usize = 20;

/// Result of the search for an even grid of which the times of a recording are rounded values.
#[derive(Clone, Debug, PartialEq)]
pub enum Stamps {
    /// The times are already even, or no even grid explains them.
    AsTheyAre,
    /// The times are the rounded times of this grid.
    On(Grid),
    /// Several rows have equal times, so that the times of the measurements are unknown. The text is the reason.
    Unknown(String),
}

/// Largest accepted relative error of the step of an even grid. The clock of every logger has an
/// error of this size.
const LARGEST_ERROR: f64 = 1e-4;
/// If more than this fraction of the rows has the same time as the row before, the times cannot be the times of the
/// measurements.
const SHARED: f64 = 0.05;

pub fn regular(time: &[f64]) -> Stamps {
    if time.len() < FEWEST || !time.iter().all(|t| t.is_finite()) {
        return Stamps::AsTheyAre;
    }
    let shared = time.windows(2).filter(|pair| pair[0] == pair[1]).count();
    let steps = (time.len() - 1) as f64;
    let is_shared = shared as f64 > SHARED * steps;
    let grid = grid(time);
    match grid {
        Some((grid, error)) if error < LARGEST_ERROR => Stamps::On(grid),
        found if is_shared => Stamps::Unknown(format!(
            "{:.1} rows share each time, {}",
            steps / (steps - shared as f64).max(1.0),
            match found {
                Some((_, error)) => format!(
                    "and the time between rows is known to {:.2} % only, where {} % is needed",
                    100.0 * error,
                    100.0 * LARGEST_ERROR
                ),
                None => "and no even spacing of the rows explains that".into(),
            }
        )),
        _ => Stamps::AsTheyAre,
    }
}

/// Returns the even grid that explains the printed times, and the largest possible relative error of its step;
/// `None` if there is no such grid.
fn grid(time: &[f64]) -> Option<(Grid, f64)> {
    let quantum = quantum(time)?;
    let units: Vec<f64> = time.iter().map(|t| ((t - time[0]) / quantum).round()).collect();
    let steps: Vec<f64> = units.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.iter().any(|step| *step < 0.0) {
        return None;
    }
    let mut sorted = steps.clone();
    let middle = (steps.len() - 1) / 2;
    let usual = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
    // The times are already even, so that there was no rounding to be undone.
    if steps.iter().all(|step| *step > 0.0 && (step / usual).fract() == 0.0) {
        return None;
    }
    let indices = (0..time.len()).map(|k| k as f64).collect();
    let counted = || {
        let near: Vec<f64> = steps.iter().copied().filter(|step| *step < 1.5 * usual).collect();
        let mean = near.iter().sum::<f64>() / near.len() as f64;
        let each = steps.iter().map(|step| (step / mean).round());
        let counts = std::iter::once(0.0).chain(each.scan(0.0, |sum, step| {
            *sum += step;
            Some(*sum)
        }));
        counts.collect()
    };
    let (counts, from, step) = fitted(&units, indices).or_else(|| fitted(&units, counted()))?;
    let at = |k: &f64| time[0] + quantum * (from + step * k);
    let grid = Grid { quantum, step: quantum * step, time: counts.iter().map(at).collect() };
    Some((grid, uncertainty(&units, &counts, step) / step))
}

/// Returns the largest difference from `step` with which an even grid still explains all times. Times and steps
/// are in units of the last printed digit. The deviation of the times from the grid is a convex function of the
/// step, so that the result is unique.
fn uncertainty(units: &[f64], counts: &[f64], step: f64) -> f64 {
    let spread = |step: f64| {
        let off = units.iter().zip(counts).map(|(unit, count)| unit - step * count);
        let (low, high) =
            off.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        high - low
    };
    let reach = |sign: f64| {
        let (mut inside, mut outside) = (0.0, 2.0 / (counts[counts.len() - 1] - counts[0]));
        for _ in 0..20 {
            let middle = 0.5 * (inside + outside);
            if spread(step + sign * middle) <= 1.0 + BEYOND {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        outside
    };
    reach(1.0).max(reach(-1.0))
}

pub fn format_quantum(quantum: f64) -> String {
    match quantum {
        q if q >= 1.0 => format!("{q} s"),
        q if q >= 0.999e-3 => format!("{:.0} ms", 1e3 * q),
        q => format!("{:.0} us", 1e6 * q),
    }
}

fn quantum(time: &[f64]) -> Option<f64> {
    (0..=DECIMALS).map(|k| 10_f64.powi(-k)).find(|quantum| {
        let off = |t: &f64| {
            let units = (t - time[0]) / quantum;
            (units - units.round()).abs() < OFF
        };
        time.iter().all(off)
    })
}

/// Finds the row numbers of the printed times (in units of the last digit) by iteration. Returns them with the
/// offset and the step of the grid that explains all times; `None` if no grid does.
fn fitted(units: &[f64], mut counts: Vec<f64>) -> Option<(Vec<f64>, f64, f64)> {
    let n = units.len() as f64;
    let mean = |x: &[f64]| x.iter().sum::<f64>() / n;
    for _ in 0..4 {
        let (k, u) = (mean(&counts), mean(units));
        let pairs = || counts.iter().zip(units).map(|(count, unit)| (count - k, unit - u));
        let step =
            pairs().map(|(a, b)| a * b).sum::<f64>() / pairs().map(|(a, _)| a * a).sum::<f64>();
        if !(step > 0.0 && step.is_finite()) {
            return None;
        }
        let from = u - step * k;
        let off = counts.iter().zip(units).map(|(count, unit)| unit - from - step * count);
        let (low, high) =
            off.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        let grows = counts.windows(2).all(|pair| pair[1] > pair[0]);
        if grows && high - low <= 1.0 + BEYOND {
            return Some((counts, from, step));
        }
        // The row numbers of steps below one unit of the last digit cannot be counted.
        if step < 1.0 {
            return None;
        }
        counts = units.iter().map(|unit| ((unit - from) / step).round()).collect();
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn printed(step: f64, rows: std::ops::Range<usize>, quantum: f64) -> Vec<f64> {
        rows.map(|k| (k as f64 * step / quantum).round() * quantum).collect()
    }

    fn on(time: &[f64]) -> Grid {
        match regular(time) {
            Stamps::On(grid) => grid,
            other => panic!("{other:?}"),
        }
    }

    /// If times are printed in whole seconds, the step of the grid is known to 0.03 % after a minute of rows;
    /// after twenty minutes it is known as accurately as by any clock.
    #[test]
    fn a_grid_is_accepted_only_if_its_step_is_known_accurately() {
        let whole =
            |rows| (0..rows).map(|k| (f64::from(k) * 0.02 + 0.3).floor()).collect::<Vec<f64>>();
        let Stamps::Unknown(why) = regular(&whole(3000)) else { panic!("a minute is accepted") };
        assert!(
            why.contains("rows share each time, and the time between rows is known to 0.0"),
            "{why}"
        );
        assert!((on(&whole(60_000)).step / 0.02 - 1.0).abs() < LARGEST_ERROR);
        let mut lost = whole(60_000);
        lost.retain({
            let mut state = 1_u32;
            move |_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                state >> 24 > 8
            }
        });
        let Stamps::Unknown(why) = regular(&lost) else { panic!("lost rows are accepted") };
        assert!(why.contains("no even spacing"), "{why}");
    }

    #[test]
    fn times_printed_with_few_digits_are_restored_to_the_even_grid_of_the_samples() {
        // in the last case the rows are closer together than the unit of the last digit
        for (step, quantum) in [(1.0 / 33.0, 1e-3), (1.0 / 60.0, 1e-2), (1.0 / 120.0, 1e-2)] {
            let grid = on(&printed(step, 0..5000, quantum));
            assert_eq!(grid.quantum, quantum);
            let off = |(k, t): (usize, &f64)| (t - grid.time[0] - k as f64 * step).abs();
            let worst = grid.time.iter().enumerate().map(off).fold(0.0, f64::max);
            // in the last case all halves are rounded up, which changes the step of the grid slightly
            assert!(worst < 2e-2 * quantum, "{step} {worst:e}");
        }
        // two groups of rows are missing, 84 rows in total
        let mut gaps = printed(1.0 / 33.0, 0..5000, 1e-3);
        gaps.drain(4000..4077);
        gaps.drain(1000..1007);
        let grid = on(&gaps);
        assert!((grid.time[4900] - grid.time[0] - 4984.0 / 33.0).abs() < 2e-5);
    }

    #[test]
    fn times_that_do_not_fit_an_even_grid_are_not_changed() {
        let even = printed(0.02, 0..5000, 1e-3);
        assert_eq!(regular(&even), Stamps::AsTheyAre);
        let mut lost = even.clone();
        lost.drain(100..110);
        assert_eq!(regular(&lost), Stamps::AsTheyAre);
        // times with a real jitter of 3 ms, printed in ms
        let mut state = 1_u64;
        let jitter = even.iter().map(|t| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            t + 1e-3 * ((state >> 33) % 4) as f64
        });
        assert_eq!(regular(&jitter.collect::<Vec<_>>()), Stamps::AsTheyAre);
        assert_eq!(
            regular(&printed(std::f64::consts::PI / 100.0, 0..5000, 1e-12)),
            Stamps::AsTheyAre
        );
    }
}
