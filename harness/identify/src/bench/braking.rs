//! Results of friction runs: measured friction over the rate, and deceleration over the hub's angle.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use maud::{Markup, html};
use nalgebra::{DMatrix, DVector};
use names::hubslosh::friction;
use report::page::{axis_chart, render_chart, series};
use report::svg::{Axis, Style};
use serde::Serialize;

use crate::estimate::Estimated;
use crate::tuning::PAGE_POINTS;

/// Smallest number of stretches (parts of a decay within one revolution). The uncertainty of the five coefficients of [`Braking`]
/// is computed from the scatter between stretches.
pub const LEAST_STRETCHES: usize = 10;

/// Friction measured at one rate: mean of the torque minus inertia times acceleration, over rows of similar rate.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FrictionPoint {
    pub rate: f64,
    /// Mean friction torque, N·m. It is positive if it brakes a positive rate.
    pub torque: f64,
    pub rows: usize,
}

/// Deceleration of the hub without torque in one direction of rotation, as a function of its angle θ: β_0 + Σ β_h^s sin hθ +
/// β_h^c cos hθ with the harmonics h (thesis 5.4).
#[derive(Clone, Debug, Serialize)]
pub struct Braking {
    pub direction: &'static str,
    /// Speed of the hub for which `coefficients` are computed, rad/s: the mean over both directions. The fit describes the
    /// dependence of the deceleration on the speed by a parabola.
    pub speed: f64,
    /// Coefficients in the order β_0, β_1^c, β_1^s, β_2^c, …, rad/s².
    pub coefficients: Vec<f64>,
    pub std: Vec<f64>,
    pub rmse: f64,
    pub r_squared: f64,
    pub rows: usize,
    /// Number of stretches from which the coefficients were computed. A stretch is one revolution of the hub within one decay.
    pub stretches: usize,
    /// For each fitted row, the angle of the hub, rad, and its angular acceleration, rad/s², corrected for the difference
    /// of the rate from `speed`.
    #[serde(skip)]
    pub points: Vec<(f64, f64)>,
    /// Covariance of `coefficients`, computed from the scatter between stretches (see `stretches`). `None` if their number
    /// is below [`LEAST_STRETCHES`].
    #[serde(skip)]
    pub(crate) covariance: Option<DMatrix<f64>>,
}

/// Returns the regressors of the deceleration [`Braking`] at an angle θ: 1, then cos hθ and sin hθ of each harmonic h.
pub(crate) fn harmonics_at(angle: f64, harmonics: usize) -> Vec<f64> {
    let each = (1..=harmonics).flat_map(|h| {
        let (sin, cos) = (angle * h as f64).sin_cos();
        [cos, sin]
    });
    [1.0].into_iter().chain(each).collect()
}

impl Braking {
    /// Returns half the width of the fit's simultaneous 95 % confidence band at an angle, rad/s²; `None` if there are too few
    /// stretches. With a probability of 95 % the whole curve lies in the band. All residuals of a stretch count as one value,
    /// because the deceleration also depends on the rate, which changes slowly within a stretch (Liang and Zeger, Biometrika 73
    /// (1986) 13, with Scheffé's factor).
    pub fn half_width(&self, angle: f64) -> Option<f64> {
        let width = self.coefficients.len();
        let row = DVector::from_vec(harmonics_at(angle, (width - 1) / 2));
        let variance = (row.transpose() * self.covariance.as_ref()? * &row)[(0, 0)];
        let few = (self.stretches - 1) as f64 / (self.stretches - width - 2) as f64;
        // 95 % quantile of χ² with five degrees of freedom
        Some((11.070 * few * variance).sqrt())
    }

    pub fn at(&self, angle: f64) -> f64 {
        let [mean, harmonics @ ..] = &self.coefficients[..] else { return 0.0 };
        let each = harmonics.chunks(2).zip(1..).map(|(pair, h)| {
            let (sin, cos) = (f64::from(h) * angle).sin_cos();
            pair[0] * cos + pair[1] * sin
        });
        mean + each.sum::<f64>()
    }
}

/// Draws the measured friction and the fitted friction curve over the rate, at all speeds and at low speed.
pub(crate) fn friction_curve(
    parameters: &BTreeMap<String, Estimated>,
    points: &[FrictionPoint],
) -> Markup {
    let value = |name: &str| parameters.get(name).map_or(0.0, |p| p.value);
    let [b, c, d] = [friction::B, friction::C, friction::D].map(value);
    let (speed, asymmetry) = (value(friction::OMEGA_S), value(friction::ASYMMETRY));
    let curve = |w: f64| {
        let shape = (-(w / speed).powi(2)).exp();
        b * w + w.signum() * (1.0 + asymmetry * w.signum()) * (c + d * shape)
    };
    let chart = |title: &str, most: f64| {
        let within: Vec<&FrictionPoint> = points.iter().filter(|p| p.rate.abs() <= most).collect();
        let rates = || within.iter().map(|p| p.rate);
        let (low, high) = (rates().fold(0.0, f64::min), rates().fold(0.0, f64::max));
        let at = |k: usize| low + (high - low) * (k as f64 + 0.5) / PAGE_POINTS as f64;
        let fitted = (0..PAGE_POINTS).map(|k| (at(k), curve(at(k)))).collect();
        let measured = within.iter().map(|p| (p.rate, p.torque)).collect();
        let lines = vec![
            series(fitted, "a", Style::Line, "fitted"),
            series(
                measured,
                "ink",
                Style::Cloud,
                "measured: torque less inertia times acceleration",
            ),
        ];
        let label = "friction torque, N·m";
        let mut chart = axis_chart(title, "rate, rad/s", label, lines, false);
        // space above the curve, because the curve rises into the corner with the legend
        let torques = || within.iter().map(|p| p.torque);
        let top = 1.6 * torques().fold(0.0, f64::max);
        chart.y = Axis::linear(label, torques().chain([top]), 0.0, 5);
        render_chart(&chart)
    };
    html! {
        h2 { "Friction" }
        (chart("Friction torque against the rate, means over rows of similar rate", f64::INFINITY))
        (chart("The same at low speed", 4.0 * speed))
    }
}

pub(crate) fn braking_chart(all: &[Braking]) -> Markup {
    let lines = all.iter().zip(["a", "b"]).map(|(braking, color)| {
        let angle = |k: usize| PI * (2.0 * k as f64 / PAGE_POINTS as f64 - 1.0);
        let points = (0..=PAGE_POINTS).map(|k| (angle(k), braking.at(angle(k)).abs())).collect();
        series(points, color, Style::Line, braking.direction)
    });
    let title = "Deceleration in free decay over the angle";
    render_chart(&axis_chart(title, "angle, rad", "rad/s²", lines.collect(), false))
}
