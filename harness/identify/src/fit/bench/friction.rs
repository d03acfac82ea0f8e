//! The friction's shape: which Stribeck speeds explain a recording.
//!
//! ```text
//! τ_f = −[ b ω + sgn ω (c + d exp(−(ω/ω_s)²)) ]
//! ```
//!
//! b, c and d enter linearly, ω_s does not. Far below ω_s only c + d shows, far above only c; so the sum of squares has
//! valleys and more than one minimum along ω_s. Here ω_s is held at one value after the other, and the other unknowns
//! are fitted. On a grid over the speeds of the recording that shows where the lowest minimum is, which no start can lead astray
//! ([`grid`]). Around the minimum it is the profile likelihood ([`Profile`]). C(ω_s) is the sum of squares at a fixed ω_s, v(ω_s)
//! the other unknown's value and V(ω_s) its variance:
//!
//! ```text
//! 95 % interval of ω_s:      C(ω_s) − C_min ≤ 1.96²
//! 95 % interval of another:  the union of v ± sqrt((1.96² + C_min − C) V)
//! ```
//!
//! (Pawitan, In All Likelihood, 3.4). Another valley counts too unless its sum of squares is clearly larger ([`BIC_DECIDES`], as
//! between models). Noise decides which of several valleys is the lowest, and the difference of two minima does not follow the χ²
//! distribution of a single one (Davies, Biometrika 74, 1987). Its interval is that about its own least, and all are joined. What
//! holds an unknown only vaguely beforehand does not count in C. An end that the speeds of the recording do not reach is open:
//! the unknown is not determined there.

use analysis::innovations::Tests;
use anyhow::Result;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use crate::fit::bench::goodness::tests;
use crate::fit::bench::problem::{self, Differences, Known, Polished, Problem, Until};
use crate::fit::covariance::spread_out;
use crate::input::recording::Recording;
use crate::model::bench::stribeck::Indices;
use crate::tuning::{
    BENT_SHAPE, BIC_DECIDES, EXTRAPOLATED, LONGEST_SHAPE_STEP, NO_WALL, PROFILE_AIM,
    PROFILE_BETWEEN, PROFILE_COUNTED, PROFILE_DECREMENT, PROFILE_END, PROFILE_EXCLUDED,
    PROFILE_NEAR, PROFILE_POINTS, PROFILE_ROUNDS, RARE_CHI_SQUARE, STRIBECK_GRID, VAGUE_SHAPE,
};

/// Standard deviation of the unknown at an index over its value.
fn relative(problem: &Problem, found: &Polished, index: usize) -> f64 {
    let scale = problem.unknowns[index].scale;
    let deviation = found.covariance.x[(index, index)].sqrt() * scale.slope(found.x[index]);
    deviation / scale.value(found.x[index])
}

/// Returns true if there may be other minima: the search did not converge, or the recording hardly shows the Stribeck excess.
pub fn is_vague(problem: &Problem, found: &Polished, indices: Indices) -> bool {
    let relative = |index| relative(problem, found, index);
    !found.converged() || relative(indices.d) > VAGUE_SHAPE || relative(indices.speed) > VAGUE_SHAPE
}

/// The best fit at one Stribeck speed.
#[derive(Clone, Debug)]
struct Point {
    /// ω_s, rad/s.
    speed: f64,
    /// All unknowns' variables.
    x: Vec<f64>,
    /// Sum of squares.
    cost: f64,
    /// Lower bound of the sum of squares after further steps, predicted to second order.
    least: f64,
    /// Sum of squares without vague priors.
    data: f64,
    /// Covariance of x at this ω_s; its own row and column are 0.
    covariance: DMatrix<f64>,
    /// Sensitivities there; the column of ω_s is 0.
    jacobian: DMatrix<f64>,
}

impl Point {
    /// Square root of the increase above the `least` sum of squares: a straight line if the sum is quadratic.
    fn root(&self, least: f64) -> f64 {
        (self.data - least).max(0.0).sqrt()
    }

    /// Returns the distance to the end of the interval, relative to that of another point, by a straight line through both roots.
    fn to_end(&self, other: &Point, least: f64) -> f64 {
        (PROFILE_END.sqrt() - self.root(least)) / (other.root(least) - self.root(least))
    }
}

/// A Stribeck speed that was tried.
#[derive(Clone, Debug)]
pub struct Tried {
    /// ω_s, rad/s.
    pub speed: f64,
    /// Increase of the sum of squares; a lower bound if only the loudest part was fitted.
    pub more: f64,
    /// Variables x of all unknowns at this speed; `None` if the loudest part alone rejects it.
    pub x: Option<Vec<f64>>,
}

/// Fits at the Stribeck speeds of a grid over the recording's speeds, near the fit `from`. Where that explains a long recording, the
/// loudest part is asked first, which costs little: what it has against a speed no other part makes up for.
pub fn grid(problem: &Problem, from: &Polished, indices: Indices) -> Vec<Tried> {
    let fastest = problem::fastest(&from.answer.motion);
    let is_explained = from.converged() && tests(problem, &from.answer).iter().all(Tests::passed);
    let part = problem.loudest().filter(|_| is_explained);
    let loudest = part.as_ref().and_then(|part| Loudest::of(problem, part, from));
    let one = |part: &f64| {
        let x = on_its_curve(problem, &from.x, from, indices, part * fastest);
        if let Some(found) = loudest.as_ref().and_then(|loudest| loudest.refutes(&x, indices)) {
            return Some(found);
        }
        let found = point(problem, &x, &from.jacobian, indices, from.cost)?;
        Some(Tried { speed: found.speed, more: found.cost - from.cost, x: Some(found.x) })
    };
    STRIBECK_GRID.par_iter().filter_map(one).collect()
}

/// The loudest part of long recordings. With C_p the sum of squares over it, C_r over the rest, and x the minimum over all,
///
/// ```text
/// C(ω_s) − C(x) ≥ [min C_p(ω_s) − C_p(x)] − [C_r(x) − min C_r]
/// ```
///
/// where the last, if the model holds, is no more than χ² with as many degrees of freedom as there are unknowns.
struct Loudest<'a> {
    /// Fit problem with the loudest part alone.
    problem: Problem<'a>,
    /// C_p(x).
    cost: f64,
    /// Sensitivities at x.
    jacobian: DMatrix<f64>,
}

impl<'a> Loudest<'a> {
    /// Prepares the loudest part at the minimum `from`; `None` if the FMU refuses to run.
    fn of(problem: &Problem<'a>, part: &'a [Recording], from: &Polished) -> Option<Self> {
        let problem = Problem { recordings: part, ..problem.clone() };
        let answer = problem.answer(&from.x).ok()?;
        let cost = problem.stacked(&answer, &from.x).norm_squared();
        let all: Vec<usize> = (0..from.x.len()).collect();
        // the whole's steps, which are shorter than those the part would take
        let known = Some(&from.jacobian);
        let jacobian = problem.sensitivities(&from.x, &all, &answer.motion, known).ok()?;
        Some(Loudest { problem, cost, jacobian })
    }

    /// Returns the ω_s of x if the part alone rejects it by more than [`PROFILE_EXCLUDED`].
    fn refutes(&self, x: &[f64], indices: Indices) -> Option<Tried> {
        let rest = RARE_CHI_SQUARE * x.len() as f64;
        let found =
            point(&self.problem, x, &self.jacobian, indices, self.cost + rest + PROFILE_EXCLUDED)?;
        let more = found.least - self.cost - rest;
        (more > PROFILE_EXCLUDED).then_some(Tried { speed: found.speed, more, x: None })
    }
}

/// x near `near` at ω_s = `speed`: b, c and d whose curve is nearest to that of `near` over the recording's speeds.
fn on_its_curve(
    problem: &Problem,
    near: &[f64],
    minimum: &Polished,
    indices: Indices,
    speed: f64,
) -> Vec<f64> {
    let mut x = near.to_vec();
    let value = |index: usize| problem.unknowns[index].scale.value(near[index]);
    let curve = |w: f64| {
        let stribeck = (-(w / value(indices.speed)).powi(2)).exp();
        value(indices.b) * w + value(indices.c) + value(indices.d) * stribeck
    };
    let speeds = problem::speeds(&minimum.answer.motion);
    let some: Vec<f64> = speeds.iter().copied().step_by((speeds.len() / 500).max(1)).collect();
    let [b, c, d] = nearest(&curve, speed, &some);
    for (index, value) in [(indices.b, b), (indices.c, c), (indices.d, d), (indices.speed, speed)] {
        x[index] = problem.unknowns[index].scale.variable(value);
    }
    x
}

/// x near `near` at ω_s = `speed` as the minimum's covariance foresees it: where the others are likeliest, Σ_js/Σ_ss (x_s − …) on.
fn foreseen(
    problem: &Problem,
    near: &[f64],
    minimum: &Polished,
    indices: Indices,
    speed: f64,
) -> Vec<f64> {
    let (s, covariance) = (indices.speed, &minimum.covariance.x);
    let by = problem.unknowns[s].scale.variable(speed) - near[s];
    let step = covariance.column(s) * (by / covariance[(s, s)]);
    problem.moved(near, step.as_slice(), problem::fastest(&minimum.answer.motion))
}

/// The fit at the ω_s of x: Gauss and Newton's steps from there in all unknowns but ω_s, unless the sum of squares stays above `most` all the
/// same. The sensitivities to b, c and d are taken there, the others are `known` ones. `None`: nothing is known of that speed, for the FMU
/// refuses it, or some combination of the other unknowns has no influence there.
fn point(
    problem: &Problem,
    x: &[f64],
    known: &DMatrix<f64>,
    indices: Indices,
    most: f64,
) -> Option<Point> {
    let bearing = [indices.b, indices.c, indices.d];
    let others: Vec<usize> = (0..x.len()).filter(|j| *j != indices.speed).collect();
    // a sum of squares to a hundredth is enough
    let problem = &Problem { differences: Differences::Forward, ..problem.clone() };
    let answer = problem.answer(x).ok()?;
    let jacobian = problem.refreshed(x, &bearing, &answer.motion, known).ok()?;
    let until =
        Until { decrement: PROFILE_DECREMENT, rounds: PROFILE_ROUNDS, ..Until::at_most(most) };
    let known = Known::Sensitivities(&jacobian);
    let found = problem.polish_some((x, answer), &others, known, until).ok()?;
    let least = Until::foreseen(found.cost, found.decrement);
    // expected gain of further steps, to second order, if known
    let far = found.decrement > 1.0 && least <= most;
    let left = if far { 0.0 } else { found.decrement.powi(2) };
    Some(Point {
        speed: problem.unknowns[indices.speed].scale.value(x[indices.speed]),
        cost: found.cost,
        least,
        data: found.cost - left - problem.vague_cost(&found.x),
        covariance: spread_out(&found.covariance.x, &others, found.x.len()),
        jacobian: found.jacobian.insert_column(indices.speed, 0.0),
        x: found.x,
    })
}

/// b, c, d ≥ 0 for which b w + c + d exp(−(w/speed)²) is nearest to a curve at `speeds`, least squares.
fn nearest(curve: &dyn Fn(f64) -> f64, speed: f64, speeds: &[f64]) -> [f64; 3] {
    let (mut normal, mut right, mut size) = (Matrix3::zeros(), Vector3::zeros(), 0.0_f64);
    for &w in speeds {
        let row = Vector3::new(w, 1.0, (-(w / speed).powi(2)).exp());
        normal += row * row.transpose();
        right += row * curve(w);
        size = size.max(curve(w));
    }
    let fastest = speeds[speeds.len() - 1].max(1e-9);
    // what is nothing to speak of, and a little of it so that the solution is unique
    let least = Vector3::new(0.02 * size / fastest, 0.02 * size, 0.02 * size);
    for i in 0..3 {
        normal[(i, i)] *= 1.0 + 1e-6;
    }
    let mut value = normal.try_inverse().map_or(least, |inverse| inverse * right);
    // the others once more where one is held at its bound
    for i in 0..3 {
        if value[i] < least[i] {
            let mut held = normal;
            let mut rest = right - normal.column(i) * least[i];
            for j in 0..3 {
                (held[(i, j)], held[(j, i)]) = (0.0, 0.0);
            }
            (held[(i, i)], rest[i]) = (1.0, least[i]);
            value = held.try_inverse().map_or(least, |inverse| inverse * rest);
        }
    }
    std::array::from_fn(|i| value[i].max(least[i]))
}

/// The profile likelihood along ω_s.
pub struct Profile {
    /// Covariance of the unknowns' values over it: within each speed and between speeds, weighted by the likelihood exp(−C/2).
    pub covariance: DMatrix<f64>,
    /// 95 % interval of each unknown's value; infinite where it is open above.
    pub intervals: Vec<[f64; 2]>,
    /// The speeds at which it was fitted, rad/s, with the sum of squares above the least.
    pub points: Vec<(f64, f64)>,
}

/// The profile likelihood from a minimum outwards; `None` where ω_s is not unknown or so well known that the sum of squares
/// is quadratic. Speeds `known` to have so much more of it are not tried again where that is far too much.
pub fn profile(
    problem: &Problem,
    minimum: &Polished,
    known: &[(f64, f64)],
) -> Result<Option<Profile>> {
    let Some(indices) = Indices::of(&problem.unknowns) else { return Ok(None) };
    let deviation = relative(problem, minimum, indices.speed);
    if deviation < BENT_SHAPE && relative(problem, minimum, indices.d) < BENT_SHAPE {
        return Ok(None);
    }
    let others: Vec<usize> = (0..minimum.x.len()).filter(|j| *j != indices.speed).collect();
    let held = problem.covariance(&minimum.jacobian.select_columns(&others))?;
    let middle = Point {
        speed: problem.unknowns[indices.speed].scale.value(minimum.x[indices.speed]),
        x: minimum.x.clone(),
        cost: minimum.cost,
        least: minimum.cost,
        data: minimum.cost - problem.vague_cost(&minimum.x),
        covariance: spread_out(&held.x, &others, minimum.x.len()),
        jacobian: minimum.jacobian.clone(),
    };
    let fastest = problem::fastest(&minimum.answer.motion);
    let most = minimum.cost + BIC_DECIDES;
    let ends = [STRIBECK_GRID[0] * fastest, STRIBECK_GRID[STRIBECK_GRID.len() - 1] * fastest];
    let sides: Vec<(Vec<Point>, bool)> = [(-1.0, ends[0]), (1.0, ends[1])]
        .into_par_iter()
        .map(|(side, end)| {
            let (mut found, mut open) =
                outwards(problem, minimum, indices, (&middle, middle.data), (side, end, deviation));
            // there may be another minimum beyond
            let mut beyond: Vec<f64> = STRIBECK_GRID.iter().map(|part| part * fastest).collect();
            beyond.sort_by(|a, b| (side * a).total_cmp(&(side * b)));
            for speed in beyond {
                let furthest = found.iter().map(|p| side * p.speed.ln()).fold(f64::MIN, f64::max);
                let is_known = |(s, more): &(f64, f64)| {
                    (s / speed).ln().abs() < 0.2 && *more > PROFILE_EXCLUDED
                };
                if open || side * speed.ln() <= furthest || known.iter().any(is_known) {
                    continue;
                }
                let from = found.last().unwrap_or(&middle);
                let x = on_its_curve(problem, &from.x, minimum, indices, speed);
                let Some(mut other) = point(problem, &x, &from.jacobian, indices, most) else {
                    continue;
                };
                let above = (other.data - middle.data).max(0.0);
                // what goes on rising is the wall of the same valley
                let is_rival = above <= BIC_DECIDES && other.data < from.data + NO_WALL;
                if above <= PROFILE_END || is_rival {
                    let reference = (&other, other.data);
                    let (mut more, is_open) =
                        outwards(problem, minimum, indices, reference, (side, end, deviation));
                    more.iter_mut().for_each(|p| p.data = (p.data - above).max(middle.data));
                    found.extend(more);
                    other.data -= above;
                    open = is_open;
                }
                found.push(other);
                found.sort_by(|a, b| (side * a.speed).total_cmp(&(side * b.speed)));
            }
            (found, open)
        })
        .collect();
    let (mut points, mut open) = (vec![middle], [false; 2]);
    for (side, (found, is_open)) in sides.into_iter().enumerate() {
        points.extend(found);
        open[side] = is_open;
    }
    points.sort_by(|a, b| a.speed.total_cmp(&b.speed));
    let least = points.iter().map(|p| p.data).fold(f64::INFINITY, f64::min);
    let places = places(&points, least);
    let mut intervals = intervals(problem, &places, fastest);
    intervals[indices.speed] = speeds(&points, least, open);
    Ok(Some(Profile {
        covariance: covariance(problem, minimum, &places),
        intervals,
        points: points.iter().map(|p| (p.speed, p.data - least)).collect(),
    }))
}

/// Fits from the middle outwards until the sum of squares is about [`PROFILE_END`] above `least`, then between the points on both sides
/// of that value. Returns true if no such speed was found up to the last one, `end`.
fn outwards(
    problem: &Problem,
    minimum: &Polished,
    indices: Indices,
    (middle, least): (&Point, f64),
    (side, end, deviation): (f64, f64, f64),
) -> (Vec<Point>, bool) {
    let mut points: Vec<Point> = Vec::new();
    let mut step = (PROFILE_AIM * PROFILE_END.sqrt() * deviation).clamp(0.02, LONGEST_SHAPE_STEP);
    // the last within and the first beyond
    let (mut inside, mut outside) = (middle.clone(), None::<Point>);
    while points.len() < PROFILE_POINTS {
        let (from, to) = (inside.speed.ln(), outside.as_ref().map(|p| p.speed.ln()));
        let at = match (&outside, to) {
            (Some(beyond), Some(to)) => {
                from + (to - from) * inside.to_end(beyond, least).clamp(0.1, 0.9)
            }
            _ => from + side * step,
        };
        let last = side * (at - end.ln()) >= 0.0 && outside.is_none();
        let speed = if last { end } else { at.exp() };
        if side * (speed / inside.speed).ln() <= 0.0 {
            return (points, true);
        }
        let way = |p: &Point| (p.speed / speed).ln().abs();
        let mut from = vec![&inside];
        from.extend(&outside);
        from.sort_by(|a, b| way(a).total_cmp(&way(b)));
        let fit = |near: &&Point| {
            let x = foreseen(problem, &near.x, minimum, indices, speed);
            point(problem, &x, &near.jacobian, indices, minimum.cost + PROFILE_COUNTED)
        };
        // a sum of squares larger than beyond is that of a search gone astray, and the other neighbour may lead
        let is_astray = |p: &Point| outside.as_ref().is_some_and(|beyond| p.data > beyond.data);
        let mut found = fit(&from[0]);
        if let Some(other) = from.get(1)
            && found.as_ref().is_none_or(is_astray)
        {
            let both = [found, fit(other)].into_iter().flatten();
            found = both.min_by(|a, b| a.data.total_cmp(&b.data));
        }
        let Some(found) = found else {
            // nor is the end then, unless it is known from beyond
            return (points, outside.is_none());
        };
        let above = found.data - least;
        points.push(found.clone());
        if above > PROFILE_END {
            let near_enough = above < PROFILE_END * (1.0 + PROFILE_NEAR);
            outside = Some(found);
            if near_enough {
                break;
            }
        } else {
            let before = std::mem::replace(&mut inside, found);
            if last {
                return (points, true);
            }
            if above > PROFILE_END * (1.0 - PROFILE_NEAR) {
                if outside.is_some() {
                    break;
                }
                if let Some(at_end) = end_beyond(&before, &inside, least)
                    && side * (at_end.speed / end).ln() < 0.0
                {
                    points.push(at_end);
                    return (points, false);
                }
            }
            // as if the root went on growing as it has from the point before
            let way = (inside.speed / before.speed).ln().abs();
            let growth = inside.root(least) - before.root(least);
            let to_aim = way * (PROFILE_AIM * PROFILE_END.sqrt() - inside.root(least)) / growth;
            step = if growth > 0.0 { to_aim.min(2.0 * step) } else { 2.0 * step }
                .min(LONGEST_SHAPE_STEP);
        }
    }
    (points, outside.is_none())
}

/// The end of the interval where it is little beyond the last point, on the line through that and the one before.
fn end_beyond(before: &Point, last: &Point, least: f64) -> Option<Point> {
    let part = before.to_end(last, least) - 1.0;
    let further = |before: f64, last: f64| last + part * (last - before);
    (0.0..EXTRAPOLATED).contains(&part).then(|| Point {
        speed: further(before.speed.ln(), last.speed.ln()).exp(),
        x: before.x.iter().zip(&last.x).map(|(a, b)| further(*a, *b)).collect(),
        // within, whatever the last digit
        data: least + PROFILE_END * (1.0 - 1e-9),
        ..last.clone()
    })
}

/// The 95 % interval of ω_s.
fn speeds(points: &[Point], least: f64, open: [bool; 2]) -> [f64; 2] {
    let is_in = |p: &Point| p.data - least <= PROFILE_END;
    // between one within and its neighbour beyond
    let between = |inside: &Point, beyond: &Point| {
        let part = inside.to_end(beyond, least).clamp(0.0, 1.0);
        (inside.speed.ln() + (beyond.speed / inside.speed).ln() * part).exp()
    };
    let (Some(first), Some(last)) = (points.iter().position(is_in), points.iter().rposition(is_in))
    else {
        return [0.0, f64::INFINITY];
    };
    let low = match first {
        _ if open[0] => 0.0,
        0 => points[0].speed,
        k => between(&points[k], &points[k - 1]),
    };
    let high = match last {
        _ if open[1] => f64::INFINITY,
        k if k + 1 == points.len() => points[k].speed,
        k => between(&points[k], &points[k + 1]),
    };
    [low, high]
}

/// A place on the profile, at or between its points.
struct Place {
    /// ln ω_s.
    at: f64,
    /// All unknowns' variables.
    x: DVector<f64>,
    /// Sum of squares above the least.
    above: f64,
    /// Covariance of x at this ω_s.
    covariance: DMatrix<f64>,
}

/// Interpolates the profile linearly: x, its covariance, and the signed root of the sum of squares above the least, which is a
/// straight line for a quadratic. Without them, an unknown that goes with ω_s would have an interval too narrow by up to 1/√2,
/// for the widest is between the middle and the end.
fn places(points: &[Point], least: f64) -> Vec<Place> {
    let lowest = points.iter().position(|p| p.data == least).unwrap_or(0);
    let root = |k: usize| {
        let root = points[k].root(least);
        if k < lowest { -root } else { root }
    };
    let place = |k: usize, part: f64| {
        let (a, b) = (&points[k], &points[(k + 1).min(points.len() - 1)]);
        let mix = |a: f64, b: f64| a + part * (b - a);
        let x = a.x.iter().zip(&b.x).map(|(a, b)| mix(*a, *b));
        Place {
            at: mix(a.speed.ln(), b.speed.ln()),
            x: DVector::from_iterator(a.x.len(), x),
            above: mix(root(k), root((k + 1).min(points.len() - 1))).powi(2),
            covariance: a.covariance.zip_map(&b.covariance, mix),
        }
    };
    let gaps = (0..points.len() - 1).flat_map(|k| {
        (0..PROFILE_BETWEEN).map(move |part| (k, part as f64 / PROFILE_BETWEEN as f64))
    });
    gaps.chain([(points.len() - 1, 0.0)]).map(|(k, part)| place(k, part)).collect()
}

/// The union of the intervals at fixed speeds, of every unknown.
fn intervals(problem: &Problem, places: &[Place], fastest: f64) -> Vec<[f64; 2]> {
    let mut all = vec![[f64::INFINITY, f64::NEG_INFINITY]; problem.unknowns.len()];
    for place in places.iter().filter(|p| p.above <= PROFILE_END) {
        let reach = (PROFILE_END - place.above).sqrt();
        for j in 0..problem.unknowns.len() {
            let end = |side: f64| {
                problem.end(place.x.as_slice(), &place.covariance, (j, side * reach), fastest)
            };
            let (low, high) = (end(-1.0), end(1.0));
            all[j] = [all[j][0].min(low), all[j][1].max(high)];
        }
    }
    all
}

/// Covariance of the unknowns' values about the minimum.
fn covariance(problem: &Problem, minimum: &Polished, places: &[Place]) -> DMatrix<f64> {
    let n = minimum.x.len();
    let middle = problem.values(&minimum.x);
    let (mut total, mut sum) = (0.0, DMatrix::zeros(n, n));
    for (k, place) in places.iter().enumerate().filter(|(_, p)| p.above < PROFILE_COUNTED) {
        // the part of ln ω_s that it stands for
        let (before, after) =
            (&places[k.saturating_sub(1)], &places[(k + 1).min(places.len() - 1)]);
        let weight = 0.5 * (after.at - before.at) * (-place.above / 2.0).exp();
        let x = place.x.as_slice();
        let slopes: Vec<f64> =
            problem.unknowns.iter().zip(x).map(|(u, &x)| u.scale.slope(x)).collect();
        let values = problem.values(x);
        let off = DVector::from_iterator(n, values.iter().zip(&middle).map(|(a, b)| a - b));
        let within =
            DMatrix::from_fn(n, n, |i, j| place.covariance[(i, j)] * slopes[i] * slopes[j]);
        sum += (within + &off * off.transpose()) * weight;
        total += weight;
    }
    sum / total
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point of a parabola about ω_s = 1 rad/s with a standard deviation of 2 %, and with it x = 3 ln ω_s.
    fn on_a_parabola(deviations: f64) -> Point {
        let ln = 0.02 * deviations;
        let (x, cost) = (vec![3.0 * ln], 100.0 + deviations.powi(2));
        let nothing = DMatrix::zeros(1, 1);
        let (covariance, jacobian) = (nothing.clone(), nothing);
        Point { speed: ln.exp(), x, cost, least: cost, data: cost, covariance, jacobian }
    }

    #[test]
    fn the_end_of_an_interval_beyond_the_last_profile_point_follows_a_parabola() {
        let middle = on_a_parabola(0.0);
        for side in [-1.0, 1.0] {
            let end = end_beyond(&middle, &on_a_parabola(1.75 * side), 100.0).unwrap();
            // 1.96 standard deviations, of which PROFILE_END has five digits
            assert!((end.speed.ln() / (0.02 * 1.96 * side) - 1.0).abs() < 1e-4, "{end:?}");
            assert!((end.x[0] / (0.06 * 1.96 * side) - 1.0).abs() < 1e-4, "{end:?}");
            let ends = speeds(&[middle.clone(), end.clone()], 100.0, [false; 2]);
            assert!(ends.contains(&end.speed), "{ends:?}");
        }
        // too far, the wrong way, and where nothing has grown since the point before
        let nearer = on_a_parabola(1.0);
        assert!(end_beyond(&middle, &nearer, 100.0).is_none());
        assert!(end_beyond(&on_a_parabola(1.75), &nearer, 100.0).is_none());
        assert!(end_beyond(&middle, &middle, 100.0).is_none());
    }

    #[test]
    fn the_nearest_curve_is_the_curve_itself_at_its_own_speed() {
        let curve = |w: f64| 0.038 * w + 0.0035 + 0.0024 * (-(w / 0.086).powi(2)).exp();
        let speeds: Vec<f64> = (0..300).map(|k| 0.001 * f64::from(k)).collect();
        let [b, c, d] = nearest(&curve, 0.086, &speeds);
        // the ridge of 1e-6 moves it by that much
        assert!((b / 0.038 - 1.0).abs() < 1e-3, "{b}");
        assert!((c / 0.0035 - 1.0).abs() < 1e-3 && (d / 0.0024 - 1.0).abs() < 1e-3, "{c} {d}");
        // at another speed nothing is negative, and the curve is still of its size
        let [b, c, d] = nearest(&curve, 0.004, &speeds);
        assert!(b > 0.0 && c > 0.0 && d > 0.0);
        let off =
            speeds.iter().map(|&w| (b * w + c + d * (-(w / 0.004).powi(2)).exp() - curve(w)).abs());
        assert!(off.fold(0.0, f64::max) < 0.002);
    }
}
