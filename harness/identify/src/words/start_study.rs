//! Sensitivity of a search to its start, as in figures 6.2 and 6.3 of Rubaga's thesis: one unknown at a time starts off its
//! estimate, the others start at theirs, and all are searched.

use maud::{Markup, html};
use report::page::{COLORS, render_chart, series, table};
use report::svg::{Axis, Chart, Style};
use serde::Serialize;

use crate::tuning::{CHART_BELOW, SAME_MINIMUM};
use crate::words::verdict::NO_MINIMUM;

/// End of a search from another start.
#[derive(Clone, Debug, Serialize)]
pub struct Trial {
    /// Unknown that starts elsewhere.
    pub name: String,
    /// Start of this unknown over its estimate.
    pub start: f64,
    /// End of this unknown over its estimate; `None` if the search failed.
    pub end: Option<f64>,
    /// Sum of squares at the end above that at the estimate, in variances of the noise.
    pub more: Option<f64>,
}

impl Trial {
    /// Returns true if the search ended at the minimum of the estimate.
    pub fn is_same(&self) -> bool {
        self.more.is_some_and(|more| more.abs() < SAME_MINIMUM)
    }
}

/// Starts of an unknown over its estimate, evenly in the logarithm up to a factor of `reach` either way. The estimate itself is not
/// among them.
pub fn starts(count: usize, reach: f64) -> Vec<f64> {
    // an odd number has a middle, which is the estimate
    let shift = if count % 2 == 1 { 0.5 } else { 0.0 };
    let part = |k: usize| (2.0 * k as f64 + 1.0 + shift) / count as f64 - 1.0;
    (0..count).map(|k| reach.powf(part(k))).collect()
}

/// Returns the study in words.
pub fn words(trials: &[Trial]) -> Vec<String> {
    if trials.is_empty() {
        return Vec::new();
    }
    let same = trials.iter().filter(|trial| trial.is_same()).count();
    let (first, last) =
        trials.iter().fold((f64::MAX, 0.0_f64), |(a, b), t| (a.min(t.start), b.max(t.start)));
    let mut words = vec![format!(
        "{same} of {} starts, each with one unknown between {first:.2} and {last:.2} times its estimate, ended at this minimum.",
        trials.len()
    )];
    let others: Vec<f64> =
        trials.iter().filter(|trial| !trial.is_same()).filter_map(|trial| trial.more).collect();
    let higher = others.iter().copied().filter(|more| *more > 0.0).fold(f64::INFINITY, f64::min);
    let lower = others.iter().copied().fold(0.0, f64::min);
    if higher.is_finite() {
        words.push(format!(
            "The nearest of the other ends has a sum of squares that is higher by {higher:.3e} variances of the noise (3.84 is the \
             limit of a 95 % interval)."
        ));
    }
    if lower < 0.0 {
        words.push(format!(
            "{NO_MINIMUM}: another start ended {:.3e} variances of the noise lower. Fit again with --start NAME=VALUE of that start.",
            -lower
        ));
    }
    words
}

fn of<'a>(trials: &'a [Trial], name: &'a str) -> impl Iterator<Item = &'a Trial> {
    trials.iter().filter(move |trial| trial.name == name)
}

/// Unknowns of the study.
fn names(trials: &[Trial]) -> Vec<&str> {
    let mut names: Vec<&str> = trials.iter().map(|trial| trial.name.as_str()).collect();
    names.dedup();
    names
}

/// Sum of squares at the end of each search, against its start.
pub fn chart(trials: &[Trial]) -> Chart {
    let mut level = SAME_MINIMUM;
    let lines: Vec<_> = names(trials)
        .iter()
        .zip(COLORS.iter().cycle())
        .map(|(name, color)| {
            level *= CHART_BELOW;
            let height = |trial: &Trial, more: f64| {
                if trial.is_same() { level } else { more.max(SAME_MINIMUM) }
            };
            let point = |trial: &Trial| Some((trial.start, height(trial, trial.more?)));
            series(of(trials, name).filter_map(point).collect(), color, Style::Dots, name)
        })
        .collect();
    let values = lines.iter().flat_map(|line| &line.points).map(|point| point.1);
    Chart {
        title: format!(
            "Sum of squares at the end above the minimum, by the unknown that starts elsewhere (below {SAME_MINIMUM}: the minimum itself)"
        ),
        size: (900.0, 260.0),
        x: Axis::decades("start over the estimate", trials.iter().map(|trial| trial.start)),
        y: Axis::decades("variances of the noise", values),
        series: lines,
        legend: true,
    }
}

/// Table and chart of the study.
pub fn section(trials: &[Trial]) -> Markup {
    let names = names(trials);
    if names.is_empty() {
        return html! {};
    }
    let rows = names.iter().map(|name| {
        let ends: Vec<f64> = of(trials, name).filter(|t| t.is_same()).map(|t| t.start).collect();
        let (low, high) = ends.iter().fold((f64::MAX, 0.0_f64), |(a, b), x| (a.min(*x), b.max(*x)));
        let others: Vec<String> = of(trials, name)
            .filter(|trial| !trial.is_same())
            .map(|trial| match (trial.more, trial.end) {
                (Some(more), Some(end)) => format!("{:.2} → {end:.3}: {more:+.1e}", trial.start),
                _ => format!("{:.2}: failed", trial.start),
            })
            .collect();
        vec![
            name.to_string(),
            of(trials, name).count().to_string(),
            ends.len().to_string(),
            if ends.is_empty() { "–".into() } else { format!("{low:.2} to {high:.2}") },
            others.join(", "),
        ]
    });
    let head = [
        "unknown",
        "starts",
        "at the minimum",
        "from, over the estimate",
        "others: start → end over the estimate, sum of squares above the minimum",
    ];
    html! {
        h2 { "Sensitivity to the start" }
        (table(head, rows))
        (render_chart(&chart(trials)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn starts_go_either_way_and_leave_out_the_estimate() {
        for count in [1, 4, 5] {
            let starts = starts(count, 10.0);
            assert_eq!(starts.len(), count);
            assert!(
                starts.iter().all(|s| (0.1..10.0).contains(s) && s.ln().abs() > 0.1),
                "{starts:?}"
            );
        }
    }

    #[test]
    fn a_lower_minimum_from_another_start_makes_the_result_doubtful() {
        let trial = |more: f64| Trial {
            name: "tank.d".into(),
            start: 2.0,
            end: Some(1.3),
            more: Some(more),
        };
        let said = words(&[trial(0.0), trial(7.0)]);
        assert!(said[0].starts_with("1 of 2 starts") && said[1].contains("7.000e0"), "{said:?}");
        let said = words(&[trial(-7.0)]);
        assert!(said[1].starts_with(NO_MINIMUM), "{said:?}");
        assert!(section(&[trial(7.0)]).into_string().contains("2.00 → 1.300: +7.0e0"));
    }
}
