//! The minimum of a sum of squares within bounds: the search of both engines.
//!
//! The method is Levenberg and Marquardt's by projection (Kelley, Iterative Methods for Optimization, 5.5). A step is cut at the
//! bounds. An unknown at a bound beyond which the cost falls is left out of the next step. So an estimate at a bound is one at
//! which the recordings want to go further, and no transformation flattens the cost on the way there.
//!
//! The search measures its distance to the minimum by the Newton decrement, in standard deviations.

use anyhow::{Context, Result};
use nalgebra::{DMatrix, DVector};

use crate::fit::decomposition::Curvature;

/// A sum of squares of residuals, each over its standard deviation.
pub trait SumOfSquares {
    /// The model's answer at a point, with the residuals.
    type Answer;
    /// State that the derivatives by an unknown keep from one call to the next.
    type Step: Clone;

    /// Names of the unknowns.
    fn names(&self) -> Vec<String>;

    /// Least and largest value of each unknown.
    fn bounds(&self) -> Vec<(f64, f64)>;

    /// Returns the answer at x.
    ///
    /// # Errors
    /// If the model refuses x.
    fn at(&self, x: &[f64]) -> Result<Self::Answer>;

    /// The residuals of an answer.
    fn residuals(answer: &Self::Answer) -> &DVector<f64>;

    /// Returns the derivatives of the residuals at x, where the answer is known, and renews the steps.
    ///
    /// # Errors
    /// If the model refuses x.
    fn derivatives(
        &self,
        x: &[f64],
        answer: &Self::Answer,
        steps: &mut [Self::Step],
    ) -> Result<DMatrix<f64>>;
}

/// Conditions that end a search.
#[derive(Clone, Copy, Debug)]
pub struct End {
    /// Distance to the minimum, standard deviations.
    pub decrement: f64,
    /// Part of the sum of squares that is left to gain.
    pub part: f64,
    /// Number of sets of derivatives.
    pub most: usize,
}

/// End of a search.
#[derive(Clone)]
pub struct Minimum<A, S> {
    /// The unknowns.
    pub x: Vec<f64>,
    /// The answer there.
    pub answer: A,
    /// Derivatives there.
    pub jacobian: DMatrix<f64>,
    /// Steps of the differences.
    pub steps: Vec<S>,
    /// Distance to the minimum in standard deviations.
    pub decrement: f64,
}

/// Returns the unknowns that are not at a bound beyond which the cost falls.
pub fn inner(bounds: &[(f64, f64)], x: &[f64], gradient: &DVector<f64>) -> Vec<usize> {
    let is_inner = |j: &usize| {
        let (low, high) = bounds[*j];
        !(x[*j] <= low && gradient[*j] > 0.0 || x[*j] >= high && gradient[*j] < 0.0)
    };
    (0..x.len()).filter(is_inner).collect()
}

/// Searches from x. `hear` receives the number of each set of derivatives, the sum of squares and the distance to the minimum.
///
/// # Errors
/// If the model refuses the start, or every step of an unknown.
pub fn search<P: SumOfSquares>(
    problem: &P,
    x: &[f64],
    mut steps: Vec<P::Step>,
    end: End,
    hear: &mut dyn FnMut(usize, f64, f64),
) -> Result<Minimum<P::Answer, P::Step>> {
    let mut answer = problem.at(x).context("the FMU refuses the start of the search")?;
    let bounds = problem.bounds();
    let (mut x, mut damping) = (x.to_vec(), 1e-3);
    let cost_of = |answer: &P::Answer| P::residuals(answer).norm_squared();
    for number in 1.. {
        let jacobian = problem.derivatives(&x, &answer, &mut steps)?;
        let gradient = jacobian.tr_mul(P::residuals(&answer));
        let which = inner(&bounds, &x, &gradient);
        let curvature = Curvature::of(&jacobian, &problem.names(), &which)?;
        let picked =
            |g: &DVector<f64>| DVector::from_iterator(which.len(), which.iter().map(|&j| g[j]));
        let g = picked(&gradient);
        let decrement = g.dot(&curvature.solve(&g, 0.0)).max(0.0).sqrt();
        let cost = cost_of(&answer);
        hear(number, cost, decrement);
        let tolerance = end.decrement.max((end.part * cost).sqrt());
        if decrement < tolerance || number >= end.most {
            return Ok(Minimum { x, answer, jacobian, steps, decrement });
        }
        let to = |x: &[f64], g: &DVector<f64>, damping: f64| {
            let step = curvature.solve(g, damping);
            let mut moved = x.to_vec();
            for (k, &j) in which.iter().enumerate() {
                moved[j] = (x[j] - step[k]).clamp(bounds[j].0, bounds[j].1);
            }
            moved
        };
        let mut moved = false;
        for _ in 0..12 {
            let trial = to(&x, &g, damping);
            if let Ok(there) = problem.at(&trial)
                && cost_of(&there) < cost
            {
                (x, answer, moved) = (trial, there, true);
                damping = (damping * 0.1).max(1e-9);
                break;
            }
            damping = (damping * 5.0).max(1e-6);
        }
        if !moved {
            // no shorter step helps: differences end here
            return Ok(Minimum { x, answer, jacobian, steps, decrement });
        }
        // with the same derivatives as long as they serve
        for _ in 0..3 {
            let gradient = picked(&jacobian.tr_mul(P::residuals(&answer)));
            let left = gradient.dot(&curvature.solve(&gradient, 0.0)).max(0.0).sqrt();
            if left > 0.5 * decrement || left < 0.3 * tolerance {
                break;
            }
            let trial = to(&x, &gradient, damping);
            match problem.at(&trial) {
                Ok(there) if cost_of(&there) < cost_of(&answer) => (x, answer) = (trial, there),
                _ => break,
            }
        }
    }
    unreachable!("the loop ends by itself")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley, whose minimum without bounds is at (1, 1).
    struct Valley {
        most: f64,
    }

    impl SumOfSquares for Valley {
        type Answer = DVector<f64>;
        type Step = ();

        fn names(&self) -> Vec<String> {
            ["a", "b"].map(String::from).to_vec()
        }

        fn bounds(&self) -> Vec<(f64, f64)> {
            vec![(f64::NEG_INFINITY, self.most), (f64::NEG_INFINITY, f64::INFINITY)]
        }

        fn at(&self, x: &[f64]) -> Result<DVector<f64>> {
            Ok(DVector::from_row_slice(&[10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]))
        }

        fn residuals(answer: &DVector<f64>) -> &DVector<f64> {
            answer
        }

        fn derivatives(&self, x: &[f64], _: &DVector<f64>, _: &mut [()]) -> Result<DMatrix<f64>> {
            Ok(DMatrix::from_row_slice(2, 2, &[-20.0 * x[0], 10.0, -1.0, 0.0]))
        }
    }

    #[test]
    fn a_bent_valley_ends_at_its_minimum_or_at_the_bound_before_it() {
        let end = End { decrement: 1e-6, part: 0.0, most: 100 };
        let of = |most: f64| {
            search(&Valley { most }, &[-1.2, 0.4], vec![(); 2], end, &mut |_, _, _| {}).unwrap()
        };
        let free = of(f64::INFINITY);
        // the decrement is the distance to the minimum where the second singular value is 1/2
        assert!((free.x[0] - 1.0).abs() + (free.x[1] - 1.0).abs() < 1e-5, "{:?}", free.x);
        let held = of(0.5);
        assert!(held.x[0] == 0.5 && (held.x[1] - 0.25).abs() < 1e-6, "{:?}", held.x);
        let gradient = held.jacobian.tr_mul(&held.answer);
        assert_eq!(inner(&Valley { most: 0.5 }.bounds(), &held.x, &gradient), [1]);
    }

    #[test]
    fn a_search_for_a_part_of_the_sum_of_squares_ends_sooner() {
        let sets = |part: f64| {
            let (mut sets, end) = (0, End { decrement: 0.0, part, most: 100 });
            let mut hear = |number, _, _| sets = number;
            search(&Valley { most: 0.0 }, &[-1.2, 0.4], vec![(); 2], end, &mut hear).unwrap();
            sets
        };
        // the decrement is at most the root of the sum of squares: the first set is enough for twice that sum
        assert_eq!(sets(2.0), 1);
        assert!(sets(1e-9) > 1, "{}", sets(1e-9));
    }
}
