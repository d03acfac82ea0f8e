//! The friction's shape: which Stribeck speeds explain a recording.
//!
//! ```text
//! τ_f = −[ b ω + sgn ω (c + d exp(−(ω/ω_s)²)) ]
//! ```
//!
//! b, c and d enter linearly, ω_s does not. Far below ω_s only c + d shows, far above only c; so the sum of squares has
//! valleys and more than one minimum along ω_s. Here ω_s is taken from a grid over the speeds of the recording;
//! at each value the other unknowns are fitted. The lowest is where the search goes on, which no
//! start can lead astray. Where several are nearly as low, the recording does not say which, and the spread over
//! them belongs to the estimates' uncertainty.

use anyhow::Result;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use crate::fit::{self, Polished, Problem};
use crate::stribeck::Indices;
use crate::uncertainty::spread_out;

/// ω_s over the fastest speed of the recording.
const GRID: [f64; 6] = [0.1, 0.3, 0.7, 1.5, 4.0, 15.0];

/// Relative standard deviation of d or ω_s beyond which a minimum may be one of several.
const VAGUE: f64 = 0.2;

/// Whether a minimum may be one of several: none at all, or one whose Stribeck excess the recording hardly shows.
pub fn is_vague(problem: &Problem, found: &Polished, indices: Indices) -> bool {
    let relative = |index: usize| {
        let scale = problem.unknowns[index].scale;
        let deviation = found.covariance.x[(index, index)].sqrt() * scale.slope(found.x[index]);
        deviation / scale.value(found.x[index])
    };
    !found.converged() || relative(indices.d) > VAGUE || relative(indices.speed) > VAGUE
}

/// The best fit at one Stribeck speed.
#[derive(Clone, Debug)]
pub struct Point {
    /// ω_s, rad/s.
    pub speed: f64,
    /// All unknowns' variables.
    pub x: Vec<f64>,
    /// Sum of squares.
    pub cost: f64,
    /// Covariance of x at this ω_s; its own row and column are 0.
    pub covariance: DMatrix<f64>,
    /// Simulations that were needed.
    pub simulations: usize,
}

/// Fits at the Stribeck speeds of a grid over the recording's speeds, near the fit `from`.
pub fn profile(problem: &Problem, from: &Polished, indices: Indices) -> Result<Vec<Point>> {
    let speeds = fit::speeds(&from.answer.motion);
    let fastest = fit::fastest(&from.answer.motion);
    let some: Vec<f64> = speeds.iter().copied().step_by((speeds.len() / 500).max(1)).collect();
    let points: Vec<Result<Point>> =
        GRID.par_iter().map(|part| point(problem, from, indices, part * fastest, &some)).collect();
    points.into_iter().collect()
}

/// The fit at ω_s = `speed`: b, c and d whose curve is nearest to that of `from` over the recording's `speeds`, then
/// Gauss and Newton's steps in all unknowns but ω_s.
fn point(
    problem: &Problem,
    from: &Polished,
    indices: Indices,
    speed: f64,
    speeds: &[f64],
) -> Result<Point> {
    let mut x = from.x.clone();
    let value = |index: usize| problem.unknowns[index].scale.value(from.x[index]);
    let curve = |w: f64| {
        let stribeck = (-(w / value(indices.speed)).powi(2)).exp();
        value(indices.b) * w + value(indices.c) + value(indices.d) * stribeck
    };
    let [b, c, d] = nearest(&curve, speed, speeds);
    for (index, value) in [(indices.b, b), (indices.c, c), (indices.d, d), (indices.speed, speed)] {
        x[index] = problem.unknowns[index].scale.variable(value);
    }
    let others: Vec<usize> = (0..x.len()).filter(|j| *j != indices.speed).collect();
    let found = problem.polish_some(&x, &others, Some(&from.jacobian), (3, 0.3))?;
    let covariance = spread_out(&found.covariance.x, &others, x.len());
    let (cost, simulations) = (found.cost, found.simulations);
    Ok(Point { speed, cost, x: found.x, covariance, simulations })
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

/// Covariance of the unknowns' values if points of the grid are nearly as good as the best: variance within and
/// between them, each weighted by its likelihood exp(−cost/2). `None` if the best stands alone, and the formula for
/// one minimum holds.
pub fn spread(problem: &Problem, points: &[Point], best: &Polished) -> Option<DMatrix<f64>> {
    let near = |p: &&Point| p.cost - best.cost < NEAR;
    if points.iter().filter(near).count() < 2 {
        return None;
    }
    let n = best.x.len();
    let middle = problem.values(&best.x);
    let mut total = 0.0;
    let mut covariance = DMatrix::zeros(n, n);
    for point in points.iter().filter(near) {
        let weight = (-(point.cost - best.cost).max(0.0) / 2.0).exp();
        let slopes: Vec<f64> =
            problem.unknowns.iter().zip(&point.x).map(|(u, &x)| u.scale.slope(x)).collect();
        let values = problem.values(&point.x);
        let off = DVector::from_iterator(n, values.iter().zip(&middle).map(|(a, b)| a - b));
        let within =
            DMatrix::from_fn(n, n, |i, j| point.covariance[(i, j)] * slopes[i] * slopes[j]);
        covariance += (within + &off * off.transpose()) * weight;
        total += weight;
    }
    Some(covariance / total)
}

/// Sum of squares above the least that still counts: three standard deviations.
const NEAR: f64 = 9.0;

#[cfg(test)]
mod tests {
    use super::*;

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
