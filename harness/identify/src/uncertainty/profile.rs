//! Intervals from the profile of the likelihood (Raue et al., Bioinformatics 25, 2009).
//!
//! The profile of an unknown is the sum of squares minimised over all others, as a function of the unknown. Its 95 % interval
//! ends where the profile has grown by 3.84, χ² with one degree of freedom. Where the sum of squares is a parabola this is ±1.96
//! standard deviations. It is looked at there, on both sides; where it is another one the ends are searched for. An interval that
//! reaches its bound, or [`FARTHEST`] standard deviations, without an end has none.

use anyhow::Result;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::fit::decomposition::Curvature;
use crate::fit::problem::{Answer, Problem};
use crate::fit::search::Minimum;
use crate::tuning::{END_POINTS, FARTHEST, INNER_STEPS, PARABOLIC};

/// Two-sided 95 % of the normal distribution.
pub const Z: f64 = 1.96;

/// An interval and how it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Ends.
    pub ends: [f64; 2],
    /// True for an end, false for a bound.
    pub ended: [bool; 2],
    /// True if the profile is a parabola.
    pub quadratic: bool,
}

/// Intervals of the unknowns; `std` are their standard deviations.
///
/// # Errors
/// If a derivative is not finite.
pub fn intervals(problem: &Problem, minimum: &Minimum, std: &[f64]) -> Result<Vec<Interval>> {
    (0..std.len()).into_par_iter().map(|j| interval(problem, minimum, j, std[j])).collect()
}

fn interval(problem: &Problem, minimum: &Minimum, j: usize, std: f64) -> Result<Interval> {
    let (low, high) = problem.unknowns[j].bounds;
    let x = minimum.x[j];
    if !std.is_finite() || std == 0.0 {
        let ends = [low, high].map(|end| if end.is_finite() { end } else { f64::NAN });
        return Ok(Interval { ends, ended: [false; 2], quadratic: false });
    }
    if problem.unknowns[j].is_known {
        // its prior is a normal distribution, and its interval was not requested
        let ends = [-1.0, 1.0].map(|sign| (x + sign * Z * std).clamp(low, high));
        return Ok(Interval { ends, ended: [true; 2], quadratic: true });
    }
    let others: Vec<usize> = minimum.inner(problem).into_iter().filter(|k| *k != j).collect();
    let profile = Profile::new(problem, minimum, j, others)?;
    let mut sides = [-1.0, 1.0].map(|sign| {
        let room = if sign < 0.0 { x - low } else { high - x };
        profile.end(sign, std, room)
    });
    let quadratic = sides.iter().all(|side| side.quadratic);
    if quadratic {
        for (side, sign) in sides.iter_mut().zip([-1.0, 1.0]) {
            side.at = x + sign * Z * std;
        }
    }
    Ok(Interval {
        ends: [sides[0].at, sides[1].at],
        ended: [sides[0].ended, sides[1].ended],
        quadratic,
    })
}

struct Side {
    at: f64,
    ended: bool,
    quadratic: bool,
}

/// The profile along one unknown.
struct Profile<'a> {
    problem: &'a Problem<'a>,
    minimum: &'a Minimum,
    j: usize,
    others: Vec<usize>,
    curvature: Curvature,
    /// Derivative of the other unknowns by this one near the minimum.
    slope: DVector<f64>,
}

impl<'a> Profile<'a> {
    fn new(
        problem: &'a Problem,
        minimum: &'a Minimum,
        j: usize,
        others: Vec<usize>,
    ) -> Result<Self> {
        let curvature = Curvature::of(&minimum.jacobian, &problem.names(), &others)?;
        let picked: DMatrix<f64> = minimum.jacobian.select_columns(&others);
        let crossed = picked.tr_mul(&minimum.jacobian.column(j)).column(0).into_owned();
        let slope = -curvature.solve(&crossed, 0.0);
        Ok(Profile { problem, minimum, j, others, curvature, slope })
    }

    /// √Δ at a distance from the minimum; infinite where the FMU refuses.
    fn root(&self, by: f64) -> f64 {
        let mut x = self.minimum.x.clone();
        x[self.j] += by;
        self.moved(&mut x, &(&self.slope * by));
        let Ok(mut answer) = self.problem.answer(&x) else { return f64::INFINITY };
        for _ in 0..INNER_STEPS {
            let gradient = self.gradient(&answer);
            let step = self.curvature.solve(&gradient, 0.0);
            if gradient.dot(&step).abs() < 0.02 {
                break;
            }
            let mut trial = x.clone();
            self.moved(&mut trial, &-step);
            match self.problem.answer(&trial) {
                Ok(there) if there.e.norm_squared() < answer.e.norm_squared() => {
                    (x, answer) = (trial, there);
                }
                _ => break,
            }
        }
        (answer.e.norm_squared() - self.minimum.cost()).max(0.0).sqrt()
    }

    fn moved(&self, x: &mut [f64], by: &DVector<f64>) {
        for (k, &i) in self.others.iter().enumerate() {
            let (low, high) = self.problem.unknowns[i].bounds;
            x[i] = (x[i] + by[k]).clamp(low, high);
        }
    }

    fn gradient(&self, answer: &Answer) -> DVector<f64> {
        let of = |&i: &usize| self.minimum.jacobian.column(i).dot(&answer.e);
        DVector::from_iterator(self.others.len(), self.others.iter().map(of))
    }

    /// The end on one side, which has this much room to the bound.
    fn end(&self, sign: f64, std: f64, room: f64) -> Side {
        let x = self.minimum.x[self.j];
        let at = |by: f64| x + sign * by;
        if room <= 0.0 {
            return Side { at: x, ended: false, quadratic: false };
        }
        let first = (Z * std).min(room);
        let root = self.root(sign * first);
        let parabola = first / std;
        if first == Z * std && (root / parabola - 1.0).abs() < PARABOLIC {
            return Side { at: at(first), ended: true, quadratic: true };
        }
        // bracketed, then by regula falsi on √Δ, which is straight for a parabola
        let (mut inside, mut outside) = ((0.0, 0.0), None);
        let mut by = first;
        let mut value = root;
        for _ in 0..END_POINTS {
            if value < Z {
                inside = (by, value);
                if by >= room || by >= FARTHEST * std {
                    return Side { at: at(by), ended: false, quadratic: false };
                }
            } else {
                outside = Some((by, value));
            }
            by = match outside {
                None => {
                    let grown = if value > 0.0 { by * (1.2 * Z / value) } else { 4.0 * by };
                    grown.clamp(1.2 * by, 4.0 * by).min(room).min(FARTHEST * std)
                }
                Some((far, there)) if there.is_finite() => {
                    let part = (Z - inside.1) / (there - inside.1);
                    inside.0 + (far - inside.0) * part.clamp(0.1, 0.9)
                }
                Some((far, _)) => 0.5 * (inside.0 + far),
            };
            value = self.root(sign * by);
            if (value / Z - 1.0).abs() < 0.02 {
                return Side { at: at(by), ended: true, quadratic: false };
            }
            if let Some((far, _)) = outside
                && far - inside.0 < 1e-3 * std
            {
                break;
            }
        }
        let end = outside.map_or(by, |(far, _)| 0.5 * (far + inside.0));
        Side { at: at(end), ended: outside.is_some(), quadratic: false }
    }
}
