//! The Allan deviation of a gyro, as a picture.

use analysis::allan::Point;
use experiments::gyro::Characteristics;

use crate::svg::{Axis, Chart, Series, Style};

/// The Allan deviations, as a file of its own.
pub fn allan_deviations(gyro: &Characteristics) -> String {
    let curve = |of: &dyn Fn(&Point) -> f64| -> Vec<(f64, f64)> {
        gyro.points.iter().map(|point| (point.tau, of(point).sqrt())).collect()
    };
    let series = |points, color: &str, style, title: &str| Series {
        points,
        color: color.into(),
        style,
        title: title.into(),
    };
    let measured = curve(&|point| point.variance);
    let chart = Chart {
        title: "Allan deviation of the simulated gyro at rest".into(),
        size: (640.0, 400.0),
        x: Axis::decades("averaging time / s", measured.iter().map(|p| p.0)),
        y: Axis::decades("Allan deviation / (rad/s)", measured.iter().map(|p| p.1)),
        series: vec![
            series(
                curve(&|point| gyro.specified.arw.powi(2) / point.tau),
                "#888888",
                Style::Dashed,
                "specified white noise, slope −1/2",
            ),
            series(measured, "#0b6aa8", Style::Dots, "estimated"),
            series(
                curve(&|point| gyro.specified.variance(point.tau)),
                "#b45309",
                Style::Line,
                "specified noise and bias",
            ),
        ],
        legend: true,
    };
    chart.file()
}
