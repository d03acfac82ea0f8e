//! The search of [`crate::fit::minimum`] for any FMU: from afar, and from several starts.
//!
//! Far from the minimum, the search fits growing windows of the recordings. Over a whole recording of an oscillation the cost has
//! one minimum per cycle, over its beginning only one.

use anyhow::{Context, Result};
use nalgebra::{DMatrix, DVector};

use crate::fit::decomposition::Curvature;
use crate::fit::minimum::{self, End, SumOfSquares};
use crate::fit::problem::{Answer, Problem, Step};
use crate::input::record::Record;
use crate::model::unknown::Unknown;
use crate::news::News;
use crate::tuning::{BAD_START, CONVERGED, DECREMENT, WINDOW_NOISE, WINDOWS};
use analysis::random::Random;

/// Standard deviations by which the minimum may lie beyond a bound by chance.
const PRESSED: f64 = 3.0;

/// End of a search.
pub type Minimum = minimum::Minimum<Answer, Step>;

impl Minimum {
    /// Sum of squares.
    pub fn cost(&self) -> f64 {
        self.answer.e.norm_squared()
    }

    /// Returns true if the search converged.
    pub fn converged(&self) -> bool {
        self.decrement < CONVERGED
    }

    /// The unknowns at a bound beyond which the minimum lies by more than chance, [`PRESSED`] standard deviations.
    pub fn pressed(&self, problem: &Problem) -> Vec<usize> {
        let (inner, gradient) = (self.inner(problem), self.jacobian.tr_mul(&self.answer.e));
        let picked = self.jacobian.select_columns(&inner);
        let curvature = Curvature::of(&self.jacobian, &problem.names(), &inner).ok();
        let beyond = |j: &usize| {
            let column = self.jacobian.column(*j);
            // the part of the column that the others cannot take
            let crossed: DVector<f64> = picked.tr_mul(&column);
            let taken = curvature.as_ref().map_or(0.0, |c| crossed.dot(&c.solve(&crossed, 0.0)));
            gradient[*j].abs() / (column.norm_squared() - taken).max(0.0).sqrt()
        };
        (0..self.x.len()).filter(|j| !inner.contains(j) && beyond(j) > PRESSED).collect()
    }

    /// The unknowns that are not held at a bound.
    pub fn inner(&self, problem: &Problem) -> Vec<usize> {
        minimum::inner(&problem.bounds(), &self.x, &self.jacobian.tr_mul(&self.answer.e))
    }
}

impl SumOfSquares for Problem<'_> {
    type Answer = Answer;
    type Step = Step;

    fn names(&self) -> Vec<String> {
        self.names()
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.unknowns.iter().map(|unknown| unknown.bounds).collect()
    }

    fn at(&self, x: &[f64]) -> Result<Answer> {
        self.answer(x)
    }

    fn residuals(answer: &Answer) -> &DVector<f64> {
        &answer.e
    }

    fn derivatives(&self, x: &[f64], at: &Answer, steps: &mut [Step]) -> Result<DMatrix<f64>> {
        self.jacobian(x, &at.motion, steps)
    }
}

/// Searches from x until the decrement is below `decrement`, with at most so many sets of derivatives.
///
/// # Errors
/// If the FMU refuses the start, or every step of an unknown.
pub fn search(
    problem: &Problem,
    x: &[f64],
    steps: Vec<Step>,
    (decrement, most): (f64, usize),
    news: &mut dyn FnMut(&News),
) -> Result<Minimum> {
    minimum::search(
        problem,
        x,
        steps,
        End { decrement, part: 0.0, most },
        &mut |number, cost, left| {
            news(&News::Detail(format!(
                "iteration {number}: sum of squares {cost:.6e}, {left:.3} standard deviations from the minimum"
            )));
        },
    )
}

/// Searches from a distant start over growing windows, with a wide prior on each unknown.
fn from_afar(problem: &Problem, x: &[f64], news: &mut dyn FnMut(&News)) -> Result<Vec<f64>> {
    let mut x = x.to_vec();
    for part in WINDOWS {
        let cut: Vec<Record> = problem.records.iter().map(|r| r.beginning(part)).collect();
        let fewest = cut.iter().map(|record| record.time.len()).min().unwrap_or(0);
        if part < 1.0 && fewest < 2 * problem.unknowns.len() {
            continue;
        }
        let mut unknowns = problem.unknowns.clone();
        for (unknown, x) in unknowns.iter_mut().zip(&x) {
            let (mean, std) = unknown.prior.unwrap_or((*x, f64::INFINITY));
            unknown.prior = Some((mean, std.min(2.0 * unknown.reach)));
        }
        let mut window = Problem::new(problem.model, problem.setup, &cut, unknowns, WINDOW_NOISE);
        // sizes of the noise are those of the whole
        for (channel, whole) in window.channels.iter_mut().zip(&problem.channels) {
            let spread = problem.records[whole.recording].spread(whole.output);
            channel.noise.white = whole.noise.white.max(WINDOW_NOISE * spread);
        }
        let steps = window.first_steps();
        let found = search(&window, &x, steps, (0.1, 25), &mut |_| {})?;
        news(&News::Detail(format!(
            "window of {:.0} %: sum of squares {:.4e}",
            100.0 * part,
            found.cost()
        )));
        x = found.x;
    }
    Ok(x)
}

/// Mean square of the worst channel's residual over its noise from row to row.
fn misfit(problem: &Problem, answer: &Answer, x: &[f64]) -> f64 {
    let residuals = problem.residuals(&answer.motion, x);
    let one = |(channel, r): (&crate::fit::problem::Channel, &Vec<f64>)| {
        let squares: f64 = r.iter().map(|r| r * r).sum();
        (squares / channel.count() as f64).sqrt() / channel.noise.white
    };
    problem.channels.iter().zip(&residuals).map(one).fold(0.0, f64::max)
}

/// The best minimum from the start, and, where that is bad, from others drawn within the bounds. Says how many starts were tried.
///
/// # Errors
/// If no start led anywhere.
pub fn best(
    problem: &Problem,
    starts: usize,
    news: &mut dyn FnMut(&News),
) -> Result<(Minimum, usize)> {
    let mut random = Random::new(26, 0);
    let mut best: Option<Minimum> = None;
    let mut tried = 0;
    let mut first_error = None;
    while tried < starts.max(1) {
        let x = if tried == 0 { problem.start() } else { drawn(&problem.unknowns, &mut random) };
        tried += 1;
        let found = from_afar(problem, &x, news)
            .and_then(|x| search(problem, &x, problem.first_steps(), (0.3, 40), news));
        match found {
            Err(error) => first_error = first_error.or(Some(error)),
            Ok(found) => {
                let bad = misfit(problem, &found.answer, &found.x);
                news(&News::Step(format!(
                    "start {tried}: the residual is {bad:.2} times the noise from row to row"
                )));
                if best.as_ref().is_none_or(|best| found.cost() < best.cost()) {
                    best = Some(found);
                }
                if bad < BAD_START && best.as_ref().is_none_or(|b| b.pressed(problem).is_empty()) {
                    break;
                }
            }
        }
    }
    match (best, first_error) {
        (Some(best), _) => Ok((best, tried)),
        (None, error) => Err(error.context("no search was made")?),
    }
}

/// Returns a minimum that is not worse than the start, and that no bound holds if a search from inside leaves the bound: where the start is
/// better than the minimum it is searched from anew, and so is the minimum with an unknown that is pressed against a bound placed
/// at its start, or in the middle of its bounds.
pub fn not_worse(
    problem: &Problem,
    minimum: Minimum,
    news: &mut dyn FnMut(&News),
) -> (Minimum, bool) {
    let start = problem.start();
    let mut places = Vec::new();
    let cost = |x: &[f64]| problem.answer(x).map_or(f64::INFINITY, |a| a.e.norm_squared());
    if cost(&start) < minimum.cost() {
        news(&News::Detail("the start is better than the minimum that was found".into()));
        places.push(start.clone());
    }
    let inner = minimum.inner(problem);
    for j in (0..start.len()).filter(|j| !inner.contains(j)) {
        let (low, high) = problem.unknowns[j].bounds;
        let mut x = minimum.x.clone();
        let is_inside = start[j] > low && start[j] < high;
        x[j] = if is_inside { start[j] } else { (0.5 * (low + high)).clamp(low, high) };
        if x[j].is_finite() && !places.contains(&start) {
            places.push(start.clone());
        }
        places.push(x);
    }
    let (mut best, mut is_better) = (minimum, false);
    for x in places.iter().filter(|x| x.iter().all(|x| x.is_finite())) {
        let Ok(found) = search(problem, x, problem.first_steps(), (DECREMENT, 40), news) else {
            continue;
        };
        // rounding of the runs is no gain
        if found.cost() < best.cost() - LEAST_GAIN {
            news(&News::Step(format!(
                "a search from another start is better: sum of squares {:.4e} for {:.4e}",
                found.cost(),
                best.cost()
            )));
            (best, is_better) = (found, true);
        }
    }
    (best, is_better)
}

/// Decrease of the sum of squares below which two minima are one.
const LEAST_GAIN: f64 = 0.01;

/// A start within the bounds, or within the reach where there are none.
fn drawn(unknowns: &[Unknown], random: &mut Random) -> Vec<f64> {
    let one = |unknown: &Unknown| {
        if unknown.is_known {
            return unknown.start;
        }
        // all of bounds that were given (their reach is a quarter of them)
        let (low, high) = unknown.bounds;
        let wide = if high - low < 5.0 * unknown.reach { 4.0 } else { 1.0 };
        let low = low.max(unknown.start - wide * unknown.reach);
        let high = high.min(unknown.start + wide * unknown.reach);
        low + (high - low) * random.uniform()
    };
    unknowns.iter().map(one).collect()
}
