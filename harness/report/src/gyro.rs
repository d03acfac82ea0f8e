//! Charts about the recording of a gyro at rest: its Allan deviation and the tests of its noise.

use analysis::allan::Point;
use analysis::rest::{Chunk, KOLMOGOROV, Rest};
use maud::html;

use crate::page::{document, render_chart, table};
use crate::svg::{Axis, Chart, Style, series};

fn allan(rest: &Rest) -> Chart {
    let curve = |variance: &dyn Fn(&Point) -> f64| -> Vec<(f64, f64)> {
        rest.allan.iter().map(|point| (point.tau, variance(point).sqrt())).collect()
    };
    let noise = rest.noise.as_ref().map(|fit| &fit.noise);
    let measured = curve(&|point| point.variance);
    let white = noise.map(|noise| curve(&|point| noise.arw.powi(2) / point.tau));
    let whole = noise.map(|noise| curve(&|point| noise.variance(point.tau)));
    let white =
        white.map(|white| series(white, EXPECTED, Style::Dashed, "fitted white noise, slope −1/2"));
    let whole = whole.map(|whole| series(whole, FITTED, Style::Line, "fitted noise"));
    let x = Axis::decades("averaging time / s", measured.iter().map(|p| p.0));
    let y = Axis::decades("Allan deviation / (rad/s)", measured.iter().map(|p| p.1));
    let measured = series(measured, MEASURED, Style::Dots, "recorded");
    let title = "Allan deviation of the recorded gyro at rest";
    Chart::new(title, x, y, white.into_iter().chain([measured]).chain(whole).collect())
}

const MEASURED: &str = "#0b6aa8";
const EXPECTED: &str = "#888888";
const FITTED: &str = "#b45309";

/// Returns the HTML page about a recording at rest, with `rows` as a table and the charts of [`rest_charts`].
pub fn page(rows: &[(String, String)], found: &Rest) -> String {
    let body = html! {
        (table(["statistic", "value"], rows.iter().map(|(name, value)| vec![name.clone(), value.clone()])))
        @for (_, chart) in rest_charts(found) { (render_chart(&chart)) }
    };
    document("Gyro at rest", &body)
}

pub fn rest_charts(rest: &Rest) -> [(&'static str, Chart); 6] {
    // frame around the range within ±y in which white noise stays
    let around = |to: f64, y: f64| vec![(0.0, y), (to, y), (to, -y), (0.0, -y)];
    let end = rest.quantiles.last().map_or(3.0, |(x, _)| *x);
    let mut quantiles = Chart::new(
        "Quantiles of the readings, dashed: of the normal distribution",
        Axis::linear("standard normal quantile", rest.quantiles.iter().map(|q| q.0), 0.0, 8),
        Axis::linear(
            "reading without its line / standard deviation",
            rest.quantiles.iter().map(|q| q.1),
            0.0,
            8,
        ),
        vec![
            series(vec![(-end, -end), (end, end)], EXPECTED, Style::Dashed, "normal"),
            series(rest.quantiles.clone(), MEASURED, Style::Cloud, "recorded"),
        ],
    );
    quantiles.legend = false;
    let bound = rest.white_bound();
    let correlation: Vec<(f64, f64)> = (rest.autocorrelation.iter().enumerate().skip(1))
        .map(|(k, r)| (k as f64 * rest.step, *r))
        .collect();
    let last = correlation.last().map_or(1.0, |(t, _)| *t);
    let autocorrelation = Chart::new(
        "Autocorrelation beyond lag 0, where it is 1",
        Axis::linear("lag / s", [0.0, last], 0.0, 8),
        Axis::linear("autocorrelation", correlation.iter().map(|p| p.1), 8.0 * bound, 6),
        vec![
            series(correlation.clone(), MEASURED, Style::Line, "recorded"),
            series(around(last, bound), EXPECTED, Style::Dashed, "95 % interval of white noise"),
        ],
    );
    let minutes = |from: f64| from / 60.0;
    let n = (rest.chunk_length() as f64).sqrt();
    let (white, normal) = (2.0 / n, 2.0 * 2f64.sqrt() / n);
    let curve = |value: &dyn Fn(&Chunk) -> f64| -> Vec<(f64, f64)> {
        rest.chunks.iter().map(|chunk| (minutes(chunk.from), value(chunk))).collect()
    };
    let means = curve(&|chunk| chunk.mean / rest.deviation);
    let variances = curve(&|chunk| chunk.variance / rest.deviation.powi(2) - 1.0);
    let end = minutes(rest.count as f64 * rest.step);
    let both = means.iter().chain(&variances).map(|p| p.1);
    let all = vec![
        series(means.clone(), MEASURED, Style::Dots, "mean over the standard deviation"),
        series(variances.clone(), FITTED, Style::Dots, "variance over the whole record's, less 1"),
        series(around(end, white), MEASURED, Style::Dashed, "±2σ of the mean, white noise"),
        series(around(end, normal), FITTED, Style::Dashed, "±2σ of the variance, normal noise"),
    ];
    let chunks = Chart::new(
        "Means and variances of consecutive chunks",
        Axis::linear("time / min", [0.0, end], 0.0, 8),
        Axis::linear("relative to the whole record", both, 6.0 * normal, 6),
        all,
    );
    let density = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
    let normal = (-50..=50).map(|k| (0.1 * f64::from(k), density(0.1 * f64::from(k)))).collect();
    let histogram = Chart::new(
        "Histogram of the readings",
        Axis::linear("reading without its line / standard deviation", [-5.0, 5.0], 0.0, 8),
        Axis::linear("density", rest.histogram.iter().map(|bin| bin.1).chain([0.0, 0.4]), 0.0, 5),
        vec![
            series(normal, EXPECTED, Style::Dashed, "normal"),
            series(rest.histogram.clone(), MEASURED, Style::Dots, "recorded"),
        ],
    );
    let limit = vec![(0.0, KOLMOGOROV), (end, KOLMOGOROV)];
    let read = curve(&|chunk| chunk.kolmogorov);
    let between = curve(&|chunk| chunk.between_levels);
    let kolmogorov = Chart::new(
        "Kolmogorov and Smirnov's distance of the chunks from the normal distribution",
        Axis::linear("time / min", [0.0, end], 0.0, 8),
        Axis::decades("distance times √n", read.iter().map(|p| p.1).chain([0.1, KOLMOGOROV])),
        vec![
            series(read.clone(), MEASURED, Style::Dots, "of the readings"),
            series(between, FITTED, Style::Dots, "between the levels of the readings"),
            series(limit, EXPECTED, Style::Dashed, "5 % limit of normal noise"),
        ],
    );
    [
        ("allan.svg", allan(rest)),
        ("histogram.svg", histogram),
        ("quantiles.svg", quantiles),
        ("autocorrelation.svg", autocorrelation),
        ("chunks.svg", chunks),
        ("kolmogorov.svg", kolmogorov),
    ]
}
