//! Contribution of known values with tolerances to the uncertainty of the estimates of any FMU.

use anyhow::Result;

use crate::estimate::prose;
use crate::fit::decomposition::Curvature;
use crate::fit::problem::Problem;
use crate::fit::search::Minimum;
use crate::input::tolerance::{self, Share};
use crate::model::unknown::{Unknown, What};

/// Contribution of known values to the uncertainty.
pub struct Tolerated {
    /// Standard deviation of each unknown if all known values were exact.
    pub noise_only: Vec<f64>,
    /// Known values, by number, with the change of each unknown by their standard deviations.
    pub effects: Vec<(usize, Vec<f64>)>,
}

impl Tolerated {
    /// Returns the contribution; `None`: there are no tolerances.
    ///
    /// # Errors
    /// If a derivative is not finite.
    pub fn of(problem: &Problem, minimum: &Minimum, inner: &[usize]) -> Result<Option<Self>> {
        let unknowns = &problem.unknowns;
        let (known, asked): (Vec<usize>, Vec<usize>) =
            inner.iter().partition(|j| unknowns[**j].is_known);
        if known.is_empty() {
            return Ok(None);
        }
        let jacobian = &minimum.jacobian;
        let curvature = Curvature::of(jacobian, &problem.names(), &asked)?;
        let at_places = |values: &[f64]| -> Vec<f64> {
            let mut all = vec![0.0; unknowns.len()];
            asked.iter().zip(values).for_each(|(&j, value)| all[j] = *value);
            all
        };
        let picked = jacobian.select_columns(&asked);
        let effect = |&q: &usize| {
            let std = unknowns[q].prior.map_or(0.0, |(_, std)| std);
            let moved = curvature.solve(&picked.tr_mul(&(jacobian.column(q) * std)), 0.0);
            (q, at_places(moved.as_slice()))
        };
        let noise = curvature.inverse().diagonal().map(f64::sqrt);
        Ok(Some(Tolerated {
            noise_only: at_places(noise.as_slice()),
            effects: known.iter().map(effect).collect(),
        }))
    }

    /// Returns the sentence on estimates that they dominate.
    pub fn words(&self, problem: &Problem, std: &[f64]) -> Option<String> {
        let unknowns = &problem.unknowns;
        let size = |&(q, _): &(usize, Vec<f64>)| {
            let Unknown { name, what, unit, prior, .. } = &unknowns[q];
            let (mean, std) = prior.unwrap_or_default();
            let whole = if matches!(what, What::Parameter { .. }) { mean.abs() } else { 1.0 };
            match whole > 0.0 {
                true => format!("{name} {:.2} %", 100.0 * std / whole),
                false => format!("{name} ± {std:.1e} {}", prose(unit)),
            }
        };
        let of = |j: usize| {
            let most = self.effects.iter().max_by(|a, b| a.1[j].abs().total_cmp(&b.1[j].abs()))?;
            Some(Share {
                name: unknowns[j].name.clone(),
                share: 1.0 - (self.noise_only[j] / std[j]).powi(2),
                most: unknowns[most.0].name.clone(),
            })
        };
        let asked = (0..unknowns.len()).filter(|j| !unknowns[*j].is_known && std[*j].is_finite());
        let known: Vec<String> = self.effects.iter().map(size).collect();
        tolerance::shares(&known, &asked.filter_map(of).collect::<Vec<_>>())
    }
}
