//! Integration by embedded Runge-Kutta methods, for equations that are too long to be written as rules for power series:
//! craft with tanks that drain. Short steps use a method of order 5 with 6 evaluations of the rates, and longer steps a
//! method of order 8 with 12 evaluations. A step whose estimated error exceeds the tolerance is rejected.
//!
//! ```text
//! k_s = rates(t + c_s h, x + h sum of a_sj k_j),   k_0 = rates(t, x)
//! x(t + h) = x + h sum of b_s k_s,   estimated error: h sum of e_s k_s
//! ```
//!
//! Sources: Cash and Karp, A variable order Runge-Kutta method (ACM TOMS 16, 1990); Hairer, Norsett, Wanner, Solving Ordinary
//! Differential Equations I, II.4 and II.10 (DOP853).

use core::ops::Range;

use crate::error::StepError;
use crate::integrator::{MAX_MAGNITUDE, STEP_SHARE, Steps};

/// A first-order system x' = rates(t, x) that [`advance`] integrates. Times t are in s and have the same origin as
/// the times of [`advance`].
pub trait System<const D: usize> {
    /// Returns the index ranges of the states that are in use; all other states stay as they are.
    fn moving(&self) -> &[Range<usize>] {
        &[Range { start: 0, end: D }]
    }

    /// Writes the rates x' of all states in use to `rate`. The elements of `rate` that belong to other states are ignored.
    fn write_rates(&self, t: f64, x: &[f64; D], rate: &mut [f64; D]);

    /// Returns for each state the magnitude to which the error of a step is relative, from the
    /// states `x` and their rates `rate` at the start `t` of the step. `h` is the time that is left
    /// until the end of the integration, s.
    fn error_scale(&self, t: f64, x: &[f64; D], rate: &[f64; D], h: f64) -> [f64; D];
}

/// Smallest error to which a step is controlled, relative to its scale and to 1 rad, rad/s, m or m/s. Smaller errors may be
/// dominated by cancellation of large terms in the rates.
const ROUNDING: f64 = 2e-14;

const LONGER: f64 = 4.0;
const SHORTER: f64 = 0.1;

/// Smaller errors of a step are replaced by this value. Because of [`LONGER`] this has no effect on the length of the next step.
/// It avoids a division by 0 and overflows of powers, which some importing tools trap and thereby end the process.
const LEAST_ERROR: f64 = 1e-30;

/// Larger errors of a step are replaced by this value, whose square does not overflow.
const LARGEST_ERROR: f64 = 1e100;

/// Weights of the rates k_s in a weighted sum, each preceded by the number s of its rate.
type Weights = &'static [(usize, f64)];

/// An embedded Runge-Kutta method with `S` evaluations of the rates.
struct Method<const S: usize> {
    stages: &'static [(f64, Weights)], // c and a of every evaluation but the first
    result: Weights,                   // b
    errors: [Weights; 2],              // e of two error estimates, E_1 and E_2
    margin: f64,                       // the error is margin E_1^2/sqrt(E_1^2 + E_2^2/100)
    order: f64,                        // power of h to which the error is proportional
}

/// Cash and Karp's method of order 5, with an error estimate of order 4.
const SHORT: Method<6> = Method {
    stages: &[
        (0.2, &[(0, 0.2)]),
        (0.3, &[(0, 3.0 / 40.0), (1, 9.0 / 40.0)]),
        (0.6, &[(0, 0.3), (1, -0.9), (2, 1.2)]),
        (1.0, &[(0, -11.0 / 54.0), (1, 2.5), (2, -70.0 / 27.0), (3, 35.0 / 27.0)]),
        (
            0.875,
            &[
                (0, 1631.0 / 55296.0),
                (1, 175.0 / 512.0),
                (2, 575.0 / 13824.0),
                (3, 44275.0 / 110592.0),
                (4, 253.0 / 4096.0),
            ],
        ),
    ],
    result: &[(0, 37.0 / 378.0), (2, 250.0 / 621.0), (3, 125.0 / 594.0), (5, 512.0 / 1771.0)],
    errors: [
        &[
            (0, 37.0 / 378.0 - 2825.0 / 27648.0),
            (2, 250.0 / 621.0 - 18575.0 / 48384.0),
            (3, 125.0 / 594.0 - 13525.0 / 55296.0),
            (4, -277.0 / 14336.0),
            (5, 512.0 / 1771.0 - 0.25),
        ],
        &[],
    ],
    margin: 1.0,
    order: 5.0,
};

/// Dormand and Prince's method of order 8, with error estimates of orders 5 and 3. The combined
/// estimate is about as large as the error itself, while the estimate of [`SHORT`] is 5 to 50 times
/// its error. Therefore this method multiplies its estimate by a larger `margin`.
const LONG: Method<12> = Method {
    stages: &[
        (0.05260015195876773, &[(0, 0.05260015195876773)]),
        (0.0789002279381516, &[(0, 0.0197250569845379), (1, 0.0591751709536137)]),
        (0.1183503419072274, &[(0, 0.02958758547680685), (2, 0.08876275643042054)]),
        (
            0.2816496580927726,
            &[(0, 0.2413651341592667), (2, -0.8845494793282861), (3, 0.924834003261792)],
        ),
        (
            0.3333333333333333,
            &[(0, 0.037037037037037035), (3, 0.17082860872947386), (4, 0.12546768756682242)],
        ),
        (
            0.25,
            &[
                (0, 0.037109375),
                (3, 0.17025221101954405),
                (4, 0.06021653898045596),
                (5, -0.017578125),
            ],
        ),
        (
            0.3076923076923077,
            &[
                (0, 0.03709200011850479),
                (3, 0.17038392571223998),
                (4, 0.10726203044637328),
                (5, -0.015319437748624402),
                (6, 0.008273789163814023),
            ],
        ),
        (
            0.6512820512820513,
            &[
                (0, 0.6241109587160757),
                (3, -3.3608926294469414),
                (4, -0.868219346841726),
                (5, 27.59209969944671),
                (6, 20.154067550477894),
                (7, -43.48988418106996),
            ],
        ),
        (
            0.6,
            &[
                (0, 0.47766253643826434),
                (3, -2.4881146199716677),
                (4, -0.590290826836843),
                (5, 21.230051448181193),
                (6, 15.279233632882423),
                (7, -33.28821096898486),
                (8, -0.020331201708508627),
            ],
        ),
        (
            0.8571428571428571,
            &[
                (0, -0.9371424300859873),
                (3, 5.186372428844064),
                (4, 1.0914373489967295),
                (5, -8.149787010746927),
                (6, -18.52006565999696),
                (7, 22.739487099350505),
                (8, 2.4936055526796523),
                (9, -3.0467644718982196),
            ],
        ),
        (
            1.0,
            &[
                (0, 2.273310147516538),
                (3, -10.53449546673725),
                (4, -2.0008720582248625),
                (5, -17.9589318631188),
                (6, 27.94888452941996),
                (7, -2.8589982771350235),
                (8, -8.87285693353063),
                (9, 12.360567175794303),
                (10, 0.6433927460157636),
            ],
        ),
    ],
    result: &[
        (0, 0.054293734116568765),
        (5, 4.450312892752409),
        (6, 1.8915178993145003),
        (7, -5.801203960010585),
        (8, 0.3111643669578199),
        (9, -0.1521609496625161),
        (10, 0.20136540080403034),
        (11, 0.04471061572777259),
    ],
    errors: [
        &[
            (0, 0.01312004499419488),
            (5, -1.2251564463762044),
            (6, -0.4957589496572502),
            (7, 1.6643771824549864),
            (8, -0.35032884874997366),
            (9, 0.3341791187130175),
            (10, 0.08192320648511571),
            (11, -0.022355307863886294),
        ],
        &[
            (0, -0.18980075407240762),
            (5, 4.450312892752409),
            (6, 1.8915178993145003),
            (7, -5.801203960010585),
            (8, -0.4226823213237919),
            (9, -0.1521609496625161),
            (10, 0.20136540080403034),
            (11, 0.02265179219836082),
        ],
    ],
    margin: 10.0,
    order: 8.0,
};

/// Returns true if a step of `h` seconds with the method [`SHORT`] (order 5) probably has a
/// relative error below `error`. The estimated error is (h/1 s)^5, which holds for slosh at 2 m/s2.
fn is_short(h: f64, error: f64) -> bool {
    h < 1.0 && h * h * h * h * h < error
}

/// Sets the elements of `sum` in the range `part` to the sum of the rates `k` with the `weights`. Several rates are added at
/// once, which saves loads and stores of the sum.
fn combine<const D: usize>(
    weights: Weights,
    k: &[[f64; D]],
    part: &Range<usize>,
    sum: &mut [f64; D],
) {
    let sum = &mut sum[part.clone()];
    let k = |stage: usize| &k[stage][part.clone()];
    sum.fill(0.0);
    let (fours, rest) = weights.as_chunks::<4>();
    for [(r, u), (s, v), (t, w), (q, y)] in fours {
        let rates = k(*r).iter().zip(k(*s)).zip(k(*t).iter().zip(k(*q)));
        for (sum, ((a, b), (c, d))) in sum.iter_mut().zip(rates) {
            *sum = *sum + u * a + v * b + w * c + y * d;
        }
    }
    let (pairs, last) = rest.as_chunks::<2>();
    for [(s, v), (t, w)] in pairs {
        for (sum, (a, b)) in sum.iter_mut().zip(k(*s).iter().zip(k(*t))) {
            *sum = *sum + v * a + w * b;
        }
    }
    for (s, v) in last {
        for (sum, a) in sum.iter_mut().zip(k(*s)) {
            *sum += v * a;
        }
    }
}

/// States and rates at the start of a step, and the allowed errors of the states in use.
struct Start<'a, const D: usize> {
    x: &'a [f64; D],
    first: &'a [f64; D],
    allowed: &'a [f64; D],
}

/// Tries a step of the length `h` from `start`, which is at the time `t`. Writes the new states to `moved`, and returns
/// their estimated error divided by the allowed error. Returns `None` if a state diverges. States that are not in use must
/// have the same values in `moved` as in `start.x`.
fn try_step<const D: usize, const S: usize>(
    system: &impl System<D>,
    method: &Method<S>,
    start: &Start<D>,
    (t, h): (f64, f64),
    moved: &mut [f64; D],
) -> Option<f64> {
    let moving = system.moving();
    let mut k = [*start.first; S];
    let move_to = |weights: Weights, k: &[[f64; D]; S], now: &mut [f64; D]| {
        let mut is_bounded = true;
        for part in moving {
            combine(weights, k, part, now);
            for (now, x) in now[part.clone()].iter_mut().zip(&start.x[part.clone()]) {
                *now = x + h * *now;
                is_bounded &= now.abs() < MAX_MAGNITUDE;
            }
        }
        is_bounded.then_some(())
    };
    for (s, (node, weights)) in method.stages.iter().enumerate() {
        move_to(weights, &k, moved)?;
        system.write_rates(t + node * h, moved, &mut k[s + 1]);
    }
    move_to(method.result, &k, moved)?;
    let mut sum = [0.0; D];
    let [error, second] = method.errors.map(|weights| {
        let parts = if weights.is_empty() { &[] } else { moving };
        parts.iter().fold(0.0, |most, part| {
            combine(weights, &k, part, &mut sum);
            let errors = sum[part.clone()].iter().zip(&start.allowed[part.clone()]);
            // An error that is NaN counts as the largest error.
            errors.map(|(sum, allowed)| (h * sum).abs() / allowed).fold(most, |most, off| {
                if off <= most { most } else { f64::min(off, LARGEST_ERROR) }
            })
        })
    });
    let error = f64::max(error, LEAST_ERROR);
    Some(method.margin * error * (error / libm::hypot(error, 0.1 * second)))
}

/// Step control of a call, which is kept if the call consists of several integrations by
/// [`advance`]: length `h`, s, of the next step, counter of the `steps` that were tried, and true
/// if a step of [`SHORT`] was rejected.
pub struct Pace {
    steps: Steps,
    h: f64,
    is_fast: bool,
}

impl Pace {
    /// Creates the step control of a call that advances by `h` (s). The first step tries the whole length.
    pub fn new(h: f64, steps: Steps) -> Pace {
        Pace { steps, h, is_fast: false }
    }
}

/// Advances x from `begin` to `end`, s, in as many steps as the tolerance requires. The estimated error determines the
/// length of the next step, and the states at its start determine the error scale.
///
/// # Errors
/// [`StepError::NotFinite`] and [`StepError::TooManySteps`], whose times have the same origin as `begin`; x is then invalid.
pub fn advance<const D: usize>(
    system: &impl System<D>,
    x: &mut [f64; D],
    (begin, end): (f64, f64),
    tolerance: f64,
    pace: &mut Pace,
) -> Result<(), StepError> {
    let (mut t, moving) = (begin, system.moving());
    let (mut first, mut moved) = ([0.0; D], *x);
    while t < end {
        system.write_rates(t, x, &mut first);
        let mut allowed = system.error_scale(t, x, &first, end - t);
        for i in moving.iter().cloned().flatten() {
            let scale = &mut allowed[i];
            let rounding = ROUNDING * f64::max(*scale, 1.0);
            *scale = f64::max(STEP_SHARE * tolerance * *scale, rounding);
        }
        loop {
            pace.steps.add_steps(1, t)?;
            let is_last = t + pace.h >= end;
            let h = if is_last { end - t } else { pace.h };
            let is_short = !pace.is_fast && is_short(h, STEP_SHARE * tolerance);
            let start = Start { x, first: &first, allowed: &allowed };
            let (error, order) = if is_short {
                (try_step(system, &SHORT, &start, (t, h), &mut moved), SHORT.order)
            } else {
                (try_step(system, &LONG, &start, (t, h), &mut moved), LONG.order)
            };
            let error = error.unwrap_or(LARGEST_ERROR);
            let change = 0.9 * libm::pow(error, -1.0 / order);
            let best = h * change.clamp(SHORTER, LONGER);
            if error <= 1.0 {
                // The last step of a stretch is shortened, so that it says less about the length of the next step than
                // the step before it.
                pace.h = if is_last { f64::max(best, pace.h) } else { best };
                t = if is_last { end } else { t + h };
                break;
            }
            if is_short {
                pace.is_fast = true;
            } else {
                pace.h = best;
            }
            if t + pace.h <= t {
                return Err(StepError::NotFinite { time: t });
            }
        }
        for part in moving {
            x[part.clone()].copy_from_slice(&moved[part.clone()]);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    /// Kepler's problem, x'' = -x/|x|^3, on an ellipse. A term `growth` times the square of each
    /// state is added to the rate of this state.
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
        fn write_rates(&self, _: f64, x: &[f64; 4], rate: &mut [f64; 4]) {
            self.evaluations.set(self.evaluations.get() + 1);
            let r3 = libm::pow(x[0] * x[0] + x[1] * x[1], 1.5);
            let orbit = [x[2], x[3], -x[0] / r3, -x[1] / r3];
            *rate = core::array::from_fn(|i| orbit[i] + self.growth * x[i] * x[i]);
        }

        fn error_scale(&self, _: f64, _: &[f64; 4], _: &[f64; 4], _: f64) -> [f64; 4] {
            [1.0; 4]
        }
    }

    const STEPS: Steps = Steps::new(100_000, "");

    /// State at the apoapsis of an ellipse with eccentricity 0.6 and semi-axis 1, on which a revolution takes 2 pi.
    const START: [f64; 4] = [1.6, 0.0, 0.0, 0.5];

    #[test]
    fn a_kepler_orbit_integrated_over_one_revolution_ends_at_its_start_within_the_tolerance() {
        let mut works = [0; 4];
        for (k, tolerance) in [1e-4, 1e-6, 1e-8, 1e-10].into_iter().enumerate() {
            let (orbit, mut x) = (Orbit::new(), START);
            let end = core::f64::consts::TAU;
            advance(&orbit, &mut x, (0.0, end), tolerance, &mut Pace::new(end, STEPS)).unwrap();
            // A step may have an error of a hundredth of the tolerance. The motion amplifies errors tenfold and more.
            let off = (0..4).map(|i| (x[i] - START[i]).abs()).fold(0.0, f64::max);
            assert!(off < 3.0 * tolerance, "{tolerance}: {off}");
            works[k] = orbit.evaluations.get();
        }
        // These are the numbers of evaluations. If they change, the cost of every simulation changes.
        assert_eq!(works, [374, 585, 895, 1256]);
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

    /// Returns the error of one step of the length `h` in Kepler's problem, and the method's
    /// estimate of this error. Both are relative to 1.
    fn error_and_estimate<const S: usize>(method: &Method<S>, h: f64) -> [f64; 2] {
        let (orbit, mut exact) = (Orbit::new(), START);
        advance(&orbit, &mut exact, (0.0, h), 1e-14, &mut Pace::new(h / 4.0, STEPS)).unwrap();
        let mut first = START;
        orbit.write_rates(0.0, &START, &mut first);
        let start = Start { x: &START, first: &first, allowed: &[1.0; 4] };
        let mut x = START;
        let estimate = try_step(&orbit, method, &start, (0.0, h), &mut x).unwrap();
        [(0..4).map(|i| (x[i] - exact[i]).abs()).fold(0.0, f64::max), estimate]
    }

    /// Halving the step reduces the error by a factor of at least 2^(p + 1), where p is the order of the method. A wrong
    /// digit of a coefficient would lower the order.
    #[test]
    fn errors_of_steps_have_the_orders_of_their_methods_and_are_below_their_estimates() {
        let short = [0.4, 0.2].map(|h| error_and_estimate(&SHORT, h));
        let long = [1.2, 0.6].map(|h| error_and_estimate(&LONG, h));
        for ([whole, half], orders) in [(short, [6.0, 5.0]), (long, [9.0, 8.0])] {
            for (i, order) in orders.into_iter().enumerate() {
                let ratio = f64::log2(whole[i] / half[i]);
                assert!(ratio > order - 0.7, "{i} {whole:?} {half:?} {ratio}");
            }
            assert!(whole[0] < whole[1] && half[0] < half[1], "{whole:?} {half:?}");
        }
    }

    /// The solver changes only the states in the ranges that `moving` returns. `error_scale`
    /// receives the time that is left until the end of the integration.
    #[test]
    fn states_that_are_not_in_use_stay_as_they_are() {
        struct Quartic;
        impl System<5> for Quartic {
            fn moving(&self) -> &[Range<usize>] {
                &[1..2, 3..4]
            }

            fn write_rates(&self, t: f64, _: &[f64; 5], rate: &mut [f64; 5]) {
                (rate[1], rate[3]) = (5.0 * t.powi(4), 1.0);
            }

            fn error_scale(&self, t: f64, _: &[f64; 5], _: &[f64; 5], h: f64) -> [f64; 5] {
                assert_eq!(t + h, 2.0);
                [1.0; 5]
            }
        }
        let mut x = [7.0, 1.0, 8.0, 0.0, 9.0];
        advance(&Quartic, &mut x, (1.0, 2.0), 1e-10, &mut Pace::new(1.0, STEPS)).unwrap();
        assert!((x[1] - 32.0).abs() < 1e-12 && (x[3] - 1.0).abs() < 1e-14, "{x:?}");
        assert_eq!([x[0], x[2], x[4]], [7.0, 8.0, 9.0]);
    }

    /// The system x' = x with errors relative to `scale`. It counts the steps that have begun.
    struct Growth {
        scale: f64,
        starts: Cell<usize>,
    }

    impl System<1> for Growth {
        fn write_rates(&self, _: f64, x: &[f64; 1], rate: &mut [f64; 1]) {
            *rate = *x;
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
            assert!(system.starts.get() < 20, "{scale} {}", system.starts.get());
        }
    }

    /// If errors are negligible, the steps are 1, 4, 16, ... milliseconds long, and the sixth step reaches the end.
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
