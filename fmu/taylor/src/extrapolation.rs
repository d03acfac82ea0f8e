//! Integration by extrapolation, for rates that are too many to expand in power series by hand: craft with tanks that
//! drain. A step that misses the tolerance is rejected.
//!
//! Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.9.

use core::ops::Range;

use crate::error::StepError;
use crate::integrator::{MAX_MAGNITUDE, STEP_SHARE, Steps};

/// A first-order system x' = rates(t, x) that [`advance`] integrates. Times t are in s; their origin is the origin of
/// [`advance`]'s times.
pub trait System<const D: usize> {
    /// Iterates over the index ranges of the states that are in use. The rates of all other states must be 0.
    fn moving(&self) -> impl Iterator<Item = Range<usize>> + Clone {
        core::iter::once(0..D)
    }

    fn rates(&self, t: f64, x: &[f64; D]) -> [f64; D];

    /// Returns for each state the magnitude to which a step's error is relative, from states and rates at its
    /// start `t`; `h` is the rest of the stretch, s.
    fn error_scale(&self, t: f64, x: &[f64; D], rate: &[f64; D], h: f64) -> [f64; D];
}

const COLUMNS: usize = 8;

/// Smallest error to which a step is controlled, relative to its scale and to 1 rad, rad/s, m or m/s. Below
/// it, cancellation of large terms in the rates may dominate.
const ROUNDING: f64 = 2e-14;

const LONGER: f64 = 4.0;
const SHORTER: f64 = 0.1;

/// Errors of a step that are smaller count as this value. Because of [`LONGER`] this has no effect on the step's length, but it
/// avoids 1/0 and powers of numbers near the largest, which end the process of a host that traps them.
const LEAST_ERROR: f64 = 1e-30;

fn work(k: usize) -> f64 {
    (1 + (k + 1) * (k + 2)) as f64
}

/// Result of one step of an extrapolation: the states at its `end`, if two columns agree, and the length
/// `best`, s, that needs the least work per second of motion.
struct Trial<const D: usize> {
    end: Option<[f64; D]>,
    best: f64,
}

/// Advances the state x by the time `h` with Gragg's midpoint rule; `first` has the rates of x at the time t. The
/// rule's results with 2, 4, ... 16 substeps are extrapolated to substeps of zero length until two columns agree to
/// `allowed`. Gives up if the columns hardly converge.
fn extrapolate<const D: usize>(
    system: &impl System<D>,
    x: &[f64; D],
    first: &[f64; D],
    (t, h): (f64, f64),
    allowed: &[f64; D],
) -> Trial<D> {
    // Columns 0 to k - 1 of the last row.
    let mut row = [[0.0; D]; COLUMNS];
    let (mut least, mut best) = (f64::INFINITY, SHORTER * h);
    let mut error_before = f64::INFINITY;
    let (mut last, mut now, mut end) = (*x, *x, *x);
    let moving = system.moving();
    for k in 0..COLUMNS {
        let n = 2 * (k + 1);
        let step = h / n as f64;
        for part in moving.clone() {
            for (i, now) in part.clone().zip(&mut now[part]) {
                last[i] = x[i];
                *now = x[i] + step * first[i];
            }
        }
        for j in 1..n {
            let rate = system.rates(t + j as f64 * step, &now);
            for part in moving.clone() {
                let states = last[part.clone()].iter_mut().zip(&mut now[part.clone()]);
                for ((last, now), rate) in states.zip(&rate[part]) {
                    (*last, *now) = (*now, *last + 2.0 * step * rate);
                }
            }
        }
        let rate = system.rates(t + h, &now);
        let divisors: [f64; COLUMNS] = core::array::from_fn(|j| {
            let ratio = n as f64 / (2 * (k + 1 - j.min(k))) as f64;
            ratio * ratio - 1.0
        });
        let mut error: f64 = 0.0;
        for i in moving.clone().flatten() {
            let mut column = 0.5 * (now[i] + last[i] + step * rate[i]);
            let mut lower = column;
            for j in 1..=k {
                let next = column + (column - row[j - 1][i]) / divisors[j];
                row[j - 1][i] = column;
                (lower, column) = (column, next);
            }
            row[k][i] = column;
            end[i] = column;
            if k >= 2 {
                let off = (column - lower).abs() / allowed[i];
                // NaN counts as an unbounded error.
                error = if off <= error { error } else { f64::min(off, f64::MAX) };
            }
        }
        if k >= 2 {
            // Error of column k - 1: h^(2k + 1).
            let change =
                0.94 * libm::pow(0.65 / f64::max(error, LEAST_ERROR), 1.0 / (2 * k + 1) as f64);
            let length = h * change.clamp(SHORTER, LONGER);
            let is_best = work(k) / length < least;
            if is_best {
                (least, best) = (work(k) / length, length);
            }
            if error <= 1.0 {
                // One more column would be better still.
                if is_best && k + 1 < COLUMNS {
                    best = f64::min(best * work(k + 1) / work(k), LONGER * h);
                }
                return Trial { end: Some(end), best };
            }
            if error > 0.1 * error_before {
                break;
            }
            error_before = error;
        }
    }
    Trial { end: None, best }
}

/// Length `h`, s, of the next step and counter of the `steps` that were tried. An extrapolation carries both from one stretch of
/// a call to the next.
pub struct Pace {
    steps: Steps,
    h: f64,
}

impl Pace {
    /// Starts the pace of a call that advances by `h` (s). The first step tries the whole length.
    pub fn new(h: f64, steps: Steps) -> Pace {
        Pace { steps, h }
    }
}

/// Advances x from `begin` to `end`, s, by extrapolation, in as many steps as the tolerance needs. The errors
/// of the previous columns determine the length of a step, and the states at its start determine the error
/// scale. After a rejected step the following steps grow again.
///
/// # Errors
/// [`StepError::NotFinite`] and [`StepError::TooManySteps`], whose time has the same origin as `begin`; x is then unusable.
pub fn advance<const D: usize>(
    system: &impl System<D>,
    x: &mut [f64; D],
    (begin, end): (f64, f64),
    tolerance: f64,
    pace: &mut Pace,
) -> Result<(), StepError> {
    let mut t = begin;
    while t < end {
        let first = system.rates(t, x);
        let allowed = system
            .error_scale(t, x, &first, end - t)
            .map(|scale| f64::max(STEP_SHARE * tolerance * scale, ROUNDING * f64::max(scale, 1.0)));
        loop {
            pace.steps.add_steps(1, t)?;
            let is_last = t + pace.h >= end;
            let h = if is_last { end - t } else { pace.h };
            let Trial { end: moved, best } = extrapolate(system, x, &first, (t, h), &allowed);
            let Some(moved) = moved else {
                pace.h = f64::min(best, h / 2.0);
                if t + pace.h <= t {
                    return Err(StepError::NotFinite { time: t });
                }
                continue;
            };
            if !moved.iter().all(|x| x.abs() < MAX_MAGNITUDE) {
                return Err(StepError::NotFinite { time: t });
            }
            *x = moved;
            t = if is_last { end } else { t + h };
            // A step cut short by the end of a stretch tells less about the next step than the step
            // before.
            pace.h = if is_last { f64::max(best, pace.h) } else { best };
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    /// Kepler's problem, x'' = -x/|x|^3, on an ellipse; `growth` adds growth x to the rates.
    struct Orbit {
        growth: f64,
        evaluations: Cell<usize>,
    }

    impl Orbit {
        fn new() -> Orbit {
            Orbit { growth: 0.0, evaluations: Cell::new(0) }
        }
    }

    impl System<4> for Orbit {
        fn rates(&self, _: f64, x: &[f64; 4]) -> [f64; 4] {
            self.evaluations.set(self.evaluations.get() + 1);
            let r3 = libm::pow(x[0] * x[0] + x[1] * x[1], 1.5);
            let rate = [x[2], x[3], -x[0] / r3, -x[1] / r3];
            core::array::from_fn(|i| rate[i] + self.growth * x[i] * x[i])
        }

        fn error_scale(&self, _: f64, _: &[f64; 4], _: &[f64; 4], _: f64) -> [f64; 4] {
            [1.0; 4]
        }
    }

    const STEPS: Steps = Steps::new(100_000, "");

    /// State at the far end of an ellipse with eccentricity 0.6 and semi-axis 1, whose revolution takes 2 pi.
    const START: [f64; 4] = [1.6, 0.0, 0.0, 0.5];

    #[test]
    fn a_kepler_orbit_integrated_over_one_revolution_ends_at_its_start_within_the_tolerance() {
        let mut works = [0; 4];
        for (k, tolerance) in [1e-4, 1e-6, 1e-8, 1e-10].into_iter().enumerate() {
            let (orbit, mut x) = (Orbit::new(), START);
            let end = core::f64::consts::TAU;
            advance(&orbit, &mut x, (0.0, end), tolerance, &mut Pace::new(end, STEPS)).unwrap();
            // A step may have an error of a hundredth of the tolerance. Errors grow tenfold and more along the orbit.
            let off = (0..4).map(|i| (x[i] - START[i]).abs()).fold(0.0, f64::max);
            assert!(off < 3.0 * tolerance, "{tolerance}: {off}");
            works[k] = orbit.evaluations.get();
        }
        // Number of evaluations by the step control. A change here changes the cost of every run.
        assert_eq!(works, [500, 541, 920, 1226]);
    }

    #[test]
    fn an_integration_in_three_parts_equals_an_integration_in_one() {
        let (mut x, mut y) = (START, START);
        let mut pace = Pace::new(3.0, STEPS);
        for (from, to) in [(0.0, 0.5), (0.5, 0.6), (0.6, 3.0)] {
            advance(&Orbit::new(), &mut x, (from, to), 1e-10, &mut pace).unwrap();
        }
        advance(&Orbit::new(), &mut y, (0.0, 3.0), 1e-10, &mut Pace::new(3.0, STEPS)).unwrap();
        for i in 0..4 {
            assert!((x[i] - y[i]).abs() < 1e-10, "{i}");
        }
    }

    /// After three columns the rule is exact to rounding for a rate of degree four. The columns need 1 + 2 + 4 + 6 evaluations.
    #[test]
    fn three_columns_are_enough_for_a_quartic() {
        struct Quartic(Cell<usize>);
        impl System<1> for Quartic {
            fn rates(&self, t: f64, _: &[f64; 1]) -> [f64; 1] {
                self.0.set(self.0.get() + 1);
                [5.0 * t.powi(4)]
            }

            fn error_scale(&self, t: f64, _: &[f64; 1], _: &[f64; 1], h: f64) -> [f64; 1] {
                // The remaining length.
                assert_eq!(t + h, 2.0);
                [1.0]
            }
        }
        let (system, mut x) = (Quartic(Cell::new(0)), [0.0]);
        advance(&system, &mut x, (0.0, 2.0), 1e-10, &mut Pace::new(2.0, STEPS)).unwrap();
        assert!((x[0] - 32.0).abs() < 1e-12, "{}", x[0]);
        assert!(system.0.get() <= work(3) as usize, "{}", system.0.get());
        assert_eq!([work(0), work(1), work(2)], [3.0, 7.0, 13.0]);
        let (system, mut x) = (Quartic(Cell::new(0)), [1.0]);
        advance(&system, &mut x, (1.0, 2.0), 1e-10, &mut Pace::new(1.0, STEPS)).unwrap();
        assert!((x[0] - 32.0).abs() < 1e-12, "{}", x[0]);
    }

    struct Growth {
        scale: f64,
        starts: Cell<usize>,
    }

    impl System<1> for Growth {
        fn rates(&self, _: f64, x: &[f64; 1]) -> [f64; 1] {
            *x
        }

        fn error_scale(&self, _: f64, _: &[f64; 1], _: &[f64; 1], _: f64) -> [f64; 1] {
            self.starts.set(self.starts.get() + 1);
            [self.scale]
        }
    }

    #[test]
    fn with_zero_tolerance_the_allowed_error_is_rounding() {
        for scale in [1e6, 1.0, 1e-6] {
            let system = Growth { scale, starts: Cell::new(0) };
            let mut x = [f64::max(scale, 1.0)];
            let begin = x[0];
            advance(&system, &mut x, (0.0, 1.0), 0.0, &mut Pace::new(1.0, STEPS)).unwrap();
            assert!((x[0] / begin / 1f64.exp() - 1.0).abs() < 1e-13, "{scale} {}", x[0]);
            assert!(system.starts.get() < 10, "{scale} {}", system.starts.get());
        }
    }

    /// With negligible errors the steps are 1, 4, 16, ... milliseconds long, and the sixth reaches the end.
    #[test]
    fn a_step_is_at_most_four_times_as_long_as_the_one_before() {
        let system = Growth { scale: 1e6, starts: Cell::new(0) };
        advance(&system, &mut [1.0], (0.0, 1.0), 1e-2, &mut Pace::new(1e-3, STEPS)).unwrap();
        assert_eq!(system.starts.get(), 6);
    }

    #[test]
    fn overflow_and_too_many_steps_are_errors() {
        let orbit = Orbit { growth: 10.0, ..Orbit::new() };
        let run = |steps: Steps| {
            advance(&orbit, &mut START.clone(), (0.0, 9.0), 1e-8, &mut Pace::new(9.0, steps))
        };
        let error = run(STEPS).unwrap_err();
        assert!(matches!(error, StepError::NotFinite { .. } | StepError::TooManySteps { .. }));
        assert!(matches!(
            run(Steps::new(2, "")),
            Err(StepError::TooManySteps { max_steps: 2, .. })
        ));
    }
}
