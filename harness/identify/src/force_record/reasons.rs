//! Reasons why a record does not tell a quantity, with the remedy.

use std::collections::BTreeMap;

use names::sloshtank::tank;

use super::Task;
use super::start::Start;
use crate::estimate::{Estimated, prose};
use crate::input::question::Question;
use crate::model::bench::breaking;

/// Facts behind the reasons.
pub struct Context<'a> {
    pub task: &'a Task,
    pub question: &'a Question,
    pub start: &'a Start,
    /// Slosh angles of each record, rad.
    pub angles: &'a [Vec<f64>],
    pub told: &'a BTreeMap<String, bool>,
    /// True if the records tell the size of the slosh angle.
    pub has_scale: bool,
    /// Estimates at a bound.
    pub at_bound: &'a [String],
    /// True if the model fits.
    pub trusted: bool,
}

impl Context<'_> {
    /// Returns the reason for a quantity.
    pub fn reason(&self, name: &str, e: &Estimated) -> String {
        let n = self.start.mode;
        let bare = name.rsplit_once('@').map_or(name, |(bare, _)| bare);
        let largest = self.angles.iter().flatten().copied().fold(0.0, f64::max);
        let degrees = largest.to_degrees();
        let starts = [1, 2].map(|axis| [tank::P_0.at([n, axis]), tank::P_DOT_0.at([n, axis])]);
        let is_start = starts.as_flattened().iter().any(|start| start == bare);
        let mass = tank::MASS.at([n]);
        let has_untold_mass = self.told.get(&mass) == Some(&false);
        let is_third = [tank::NONLINEAR_INERTIA.at([n]), tank::NONLINEAR_STIFFNESS.at([n])]
            .iter()
            .any(|t| t == bare);
        let breaks = [tank::ZETA_BREAKING.at([n]), tank::BREAKING_STEEPNESS.at([n])];
        let breaks = breaks.iter().any(|name| name == bare);
        let has_growth = is_third || breaks || bare == tank::ZETA_AMPLITUDE.at([n]);
        if !self.has_scale && has_growth {
            return format!(
                "its effect grows with the slosh angle, which this free decay does not show. Give the angle with --release, or the \
                 mass with --set {mass}=KG"
            );
        }
        if !self.has_scale && (bare == mass || is_start && has_untold_mass) {
            return format!(
                "a free decay shows the product of modal mass and slosh angle alone. Give the angle with --release, or the \
                 mass with --set {mass}=KG, or record a forced motion"
            );
        }
        if !self.trusted && self.at_bound.iter().any(|other| other == name) {
            return format!(
                "the search ends at its bound, {:.4e}, and the model does not fit",
                e.value
            );
        }
        let unit = Some(prose(&e.unit)).filter(|unit| unit != "1");
        let unit = unit.map_or(String::new(), |unit| format!(" {unit}"));
        let width = if e.std.is_finite() {
            format!("the record would give it ± {:.1e}{unit}", 1.96 * e.std)
        } else {
            "no load of this record depends on it".into()
        };
        let width = match self.trusted || !e.std.is_finite() {
            true => width,
            false => format!("the residual is not noise, so that {width} or ten times that"),
        };
        if breaks {
            let steepness = breaking::steepness(largest);
            let (begins, _) = breaking::BEGINS;
            return if steepness < breaking::least() && self.trusted {
                breaking::never(largest)
            } else if steepness < breaking::least() {
                format!(
                    "waves break from a steepness k a of {:.2} on, and the fit, which is not trusted, reaches {steepness:.2} ({degrees:.1}°)",
                    breaking::least()
                )
            } else if !e.std.is_finite() {
                width
            } else {
                format!(
                    "too little of the record lies above the steepness of breaking (k a reaches {steepness:.2}, breaking begins at \
                     {begins}); {width}"
                )
            };
        }
        if is_third || bare == tank::ZETA_AMPLITUDE.at([n]) {
            let power = if is_third { "the square of the slosh angle" } else { "the slosh angle" };
            return format!(
                "its effect grows with {power}, which reaches {degrees:.1}°; {width}. Record larger waves"
            );
        }
        if self.question.inputs.is_empty() && bare == tank::M_0 {
            return format!(
                "the tank does not move, and the load along its axis leaves it open; {width}"
            );
        }
        let gravity = self.task.gravity;
        format!(
            "{width}; a longer record, or a motion near {:.2} Hz, tells more",
            1.0 / self.start.period(gravity)
        )
    }
}
