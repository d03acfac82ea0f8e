//! Sources of uncertainty, and combinations of unknowns that are known better than each alone.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use serde::Serialize;

use crate::estimate::{Estimated, prose};
use crate::model::bench::unknown::Unknown;
use crate::tuning::{BOTH_WAYS, COMBINED_CORRELATION, VAGUE_ALONE};
use names::hubslosh::friction;

/// Sources of uncertainty, as covariances of the variables x.
#[derive(Clone, Copy, Debug)]
pub struct Sources<'a> {
    /// The recording's noise, (JᵀJ)⁻¹, with the gyro's scale known to its tolerance alone.
    pub noise: &'a DMatrix<f64>,
    /// Covariance of all variables over the profile of the friction's curves: the better account of the noise.
    pub friction_curves: Option<&'a DMatrix<f64>>,
    /// Covariance from the choice of slosh model.
    pub models: Option<&'a DMatrix<f64>>,
    /// Covariance from the intersample behaviour of the torque.
    pub between_rows: Option<&'a DMatrix<f64>>,
    /// Covariance from tolerances of values that are not estimated.
    pub tolerances: Option<&'a DMatrix<f64>>,
    /// The sandwich, where the residual is more than noise: no variance is less than there.
    pub residual: Option<&'a DMatrix<f64>>,
}

impl Sources<'_> {
    /// The covariance that noise makes, with no variance less than in the sandwich.
    pub fn least(noise: &DMatrix<f64>, sandwich: &DMatrix<f64>) -> DMatrix<f64> {
        Sources {
            noise,
            friction_curves: None,
            models: None,
            between_rows: None,
            tolerances: None,
            residual: Some(sandwich),
        }
        .total()
    }

    /// All of them together.
    pub fn total(&self) -> DMatrix<f64> {
        let mut all = self.noise.clone();
        if let Some(curves) = self.friction_curves {
            all.copy_from(curves);
        }
        if let Some(models) = self.models {
            let n = models.nrows();
            let with = all.view((0, 0), (n, n)) + models;
            all.view_mut((0, 0), (n, n)).copy_from(&with);
        }
        for more in [self.between_rows, self.tolerances].into_iter().flatten() {
            all += more;
        }
        if let Some(sandwich) = self.residual {
            for i in 0..all.nrows() {
                if sandwich[(i, i)] > all[(i, i)] {
                    let factor = (sandwich[(i, i)] / all[(i, i)]).sqrt();
                    all.row_mut(i).scale_mut(factor);
                    all.column_mut(i).scale_mut(factor);
                }
            }
        }
        all
    }
}

/// Two unknowns of which only a sum or a product is known.
#[derive(Clone, Debug, Serialize)]
pub struct Combination {
    /// `a + b`, or `a (1 + b)`.
    pub name: String,
    /// The two.
    pub of: [String; 2],
    /// Value of the combination.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
    /// Unit.
    pub unit: String,
    /// Their correlation.
    pub correlation: f64,
}

impl Combination {
    /// Returns the combination in words.
    pub fn words(&self) -> String {
        format!(
            "{} and {} cannot be distinguished (correlation {:.4}); only {} = {:.6} ± {:.6} {} is determined.",
            self.of[0],
            self.of[1],
            self.correlation,
            self.name,
            self.value,
            self.std,
            prose(&self.unit)
        )
    }
}

/// Returns the direction of a hub that turns one way alone (1: counter-clockwise, −1: clockwise), from its rates. `None` if it rests,
/// or if more than [`BOTH_WAYS`] of its path leads the other way.
pub fn way(rates: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut forwards, mut backwards) = (0.0, 0.0);
    rates.for_each(|rate| *if rate < 0.0 { &mut backwards } else { &mut forwards } += rate.abs());
    let (way, along, against) =
        if backwards > forwards { (-1.0, backwards, forwards) } else { (1.0, forwards, backwards) };
    (along > 0.0 && against <= BOTH_WAYS * along).then_some(way)
}

/// Replaces the estimates of dry friction if the hub turned one `way` alone (1: counter-clockwise, −1: clockwise). A fit with
/// asymmetry 0 gives only the friction of that direction, c (1 ± asymmetry) and d (1 ± asymmetry). The asymmetry is then anywhere
/// within its `bounds`, and c and d are at least half of that friction.
pub fn one_way(
    parameters: &mut BTreeMap<String, Estimated>,
    way: f64,
    bounds: [f64; 2],
) -> Vec<Combination> {
    const ASYMMETRY: &str = friction::ASYMMETRY;
    let mut combinations = Vec::new();
    for name in [friction::C, friction::D] {
        let Some(p) = parameters.get_mut(name) else { continue };
        combinations.push(Combination {
            name: format!("{name} (1 {} {ASYMMETRY})", if way > 0.0 { "+" } else { "-" }),
            of: [name, ASYMMETRY].map(String::from),
            value: p.value,
            std: p.std,
            unit: p.unit.clone(),
            correlation: -way,
        });
        p.interval = [0.5 * p.interval[0], f64::INFINITY];
        p.determined = false;
    }
    let unknown = Estimated::normal(0.0, (bounds[1] - bounds[0]) / 12f64.sqrt(), "1");
    let asymmetry = Estimated { interval: bounds, determined: false, ..unknown };
    parameters.insert(ASYMMETRY.into(), asymmetry);
    combinations
}

/// Sums of unknowns that stand in for unknowns which are not known by themselves. `covariance` is
/// that of the values.
pub fn combinations(
    unknowns: &[Unknown],
    values: &[f64],
    covariance: &DMatrix<f64>,
) -> Vec<Combination> {
    let mut found = Vec::new();
    for i in 0..values.len() {
        for j in 0..i {
            let (vi, vj, vij) = (covariance[(i, i)], covariance[(j, j)], covariance[(i, j)]);
            let correlation = vij / (vi * vj).sqrt();
            let vague = |k: usize| covariance[(k, k)].sqrt() > VAGUE_ALONE * values[k].abs();
            let alike = unknowns[i].unit == unknowns[j].unit;
            if alike && correlation < -COMBINED_CORRELATION && (vague(i) || vague(j)) {
                let of = [unknowns[j].quantity.name(), unknowns[i].quantity.name()];
                found.push(Combination {
                    name: of.join(" + "),
                    of,
                    value: values[i] + values[j],
                    std: (vi + vj + 2.0 * vij).max(0.0).sqrt(),
                    unit: unknowns[i].unit.clone(),
                    correlation,
                });
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;

    #[test]
    fn a_hub_turns_one_way_if_nearly_all_of_its_path_does() {
        let of = |rates: &[f64]| way(rates.iter().copied());
        assert_eq!((of(&[0.0, 2.0, 0.1]), of(&[0.0, -2.0, -0.1])), (Some(1.0), Some(-1.0)));
        // liquid that swings back turns the hub back a little
        assert_eq!((of(&[2.0, -0.1]), of(&[-2.0, 0.1])), (Some(1.0), Some(-1.0)));
        assert_eq!((of(&[2.0, -0.3]), of(&[-2.0, 0.3])), (None, None));
        assert_eq!((of(&[0.0, 0.0]), of(&[])), (None, None));
    }

    /// Two variables and the gyro's scale.
    #[test]
    fn sources_of_uncertainty_add_up_and_a_residual_sets_the_least() {
        let diagonal = |d: [f64; 3]| DMatrix::from_diagonal(&DVector::from_row_slice(&d));
        let noise = diagonal([4.0, 2.0, 1.0]);
        let sources = Sources {
            noise: &noise,
            friction_curves: None,
            models: None,
            between_rows: None,
            tolerances: None,
            residual: None,
        };
        assert_eq!(sources.total(), noise);
        let two = DMatrix::from_row_slice(2, 2, &[10.0, 1.0, 1.0, 5.0]);
        let curves = diagonal([11.0, 5.0, 1.0]);
        let with_curves = Sources { friction_curves: Some(&curves), ..sources }.total();
        assert_eq!(with_curves, curves);
        let with_models = Sources { models: Some(&two), ..sources }.total();
        assert_eq!(with_models.diagonal().as_slice(), [14.0, 7.0, 1.0]);
        let with_tolerances = Sources { tolerances: Some(&noise), ..sources }.total();
        assert_eq!(with_tolerances.diagonal().as_slice(), [8.0, 4.0, 2.0]);
        let sandwich = diagonal([1.0, 8.0, 1.0]);
        let wide = Sources { models: Some(&two), residual: Some(&sandwich), ..sources }.total();
        // an off-diagonal element grows with the deviation, by sqrt(8/7)
        assert!((wide[(1, 1)] - 8.0).abs() < 1e-14 && wide[(0, 0)] == 14.0);
        assert!((wide[(0, 1)] - (8.0_f64 / 7.0).sqrt()).abs() < 1e-15);
    }
}
