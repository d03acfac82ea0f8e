//! Sections of the page on the acceleration's least squares: friction curve, braking over the angle, starts.

use std::f64::consts::PI;

use maud::{Markup, html};
use names::hubslosh::friction;
use report::page::{axis_chart, drawn, series};
use report::svg::{Axis, Style};

use super::{Braking, Found, FrictionPoint};
use crate::tuning::{FRICTION_POINTS, SLOW_CHART};
use crate::words::page::Sections;
use crate::words::start_study;

/// The sections.
pub fn sections(found: &Found) -> Sections {
    let details = &found.details;
    Sections {
        combinations: details.combinations.clone(),
        figures: html! {
            (friction_curve(found))
            @if !details.braking.is_empty() { (braking(&details.braking)) }
            p {
                "The residual below is of differences over two rows. White noise of the gyro gives it an autocorrelation of −0.5 at \
                 a lag of two rows. Rows in which the hub sticks are left out."
            }
        },
        condition: Some(details.condition),
        last: start_study::section(&details.starts),
        ..Sections::default()
    }
}

/// The friction's torque against the rate, measured and fitted (thesis 5.8 and 5.9).
fn friction_curve(found: &Found) -> Markup {
    let points = &found.details.friction_points;
    let value = |name: &str| found.parameters.get(name).map_or(0.0, |p| p.value);
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
        let at = |k: usize| low + (high - low) * (k as f64 + 0.5) / FRICTION_POINTS as f64;
        let fitted = (0..FRICTION_POINTS).map(|k| (at(k), curve(at(k)))).collect();
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
        // the curve rises to the corner of the legend
        let torques = || within.iter().map(|p| p.torque);
        let top = 1.6 * torques().fold(0.0, f64::max);
        chart.y = Axis::linear(label, torques().chain([top]), 0.0, 5);
        drawn(&chart)
    };
    html! {
        h2 { "Friction" }
        (chart("Friction torque against the rate, means over rows of similar rate", f64::INFINITY))
        (chart("The same at low speed", SLOW_CHART * speed))
    }
}

/// Deceleration over the angle in either direction (thesis 5.10 and 5.11).
fn braking(all: &[Braking]) -> Markup {
    let lines = all.iter().zip(["a", "b"]).map(|(braking, color)| {
        let angle = |k: usize| PI * (2.0 * k as f64 / FRICTION_POINTS as f64 - 1.0);
        let points =
            (0..=FRICTION_POINTS).map(|k| (angle(k), braking.at(angle(k)).abs())).collect();
        series(points, color, Style::Line, braking.direction)
    });
    let title = "Deceleration in free decay over the angle";
    drawn(&axis_chart(title, "angle, rad", "rad/s²", lines.collect(), false))
}
