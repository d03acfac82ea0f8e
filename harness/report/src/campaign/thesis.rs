//! Compares the numbers that Rubaga's thesis states about its bench and its synthetic data with the
//! runs of the campaign.
//!
//! Numbers that need no run (Bond numbers, flight tanks) are compared by `hubslosh scale thesis`, and the
//! wrong ones are listed in the errata. Statements without a number are not compared; the figures of the
//! report show the runs.

use analysis::statistics::mean;
use experiments::campaign::Outcome;
use experiments::rounding::significant;
use maud::{Markup, html};

use super::page::{Group, cm, distinct, torque_amplitude};

const SMALLEST: f64 = 0.0125;
const LARGEST: f64 = 0.25;

/// A number in Rubaga's thesis with which runs are compared.
///
/// - `quantity`: name with unit. `printed`: the number as the thesis prints it.
/// - `synthetic`: true if the number is about the thesis's synthetic data. It is compared only with the linear model,
///   with which these data were generated.
/// - `agreeing`: range of values that count as agreement. If the thesis states no range, it is ±15 % for an
///   acceleration, because the thesis states neither the fill nor the filter of its gyro, and half a step between
///   torques for a torque.
/// - `ours`: computes the quantity for a group of runs that differ only in torque; `None` if runs or estimates are
///   missing.
struct Number {
    section: &'static str,
    quantity: &'static str,
    synthetic: bool,
    printed: &'static str,
    agreeing: [f64; 2],
    ours: fn(&Group) -> Option<f64>,
}

const NUMBERS: [Number; 8] = [
    Number {
        section: "7.1.1, 8.1",
        quantity: "torque at which resonance and antiresonance diverge (largest step of Δf), N·m",
        synthetic: false,
        printed: "around 0.1",
        agreeing: [0.0875, 0.1125],
        ours: |group| {
            let separation = |run: &Outcome| run.spa_features().delta_f();
            let values = values_from(group, SMALLEST, separation)?;
            let steps = values.windows(2).zip(&group.runs[1..]);
            let largest = steps.max_by(|(a, _), (b, _)| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))?;
            Some(torque_amplitude(largest.1))
        },
    },
    Number {
        section: "7.1.2, fig. 7.3",
        quantity: "bench: least fit in time over the torques, %",
        synthetic: false,
        printed: "close to 60",
        agreeing: [55.0, 65.0],
        ours: |group| {
            let fits = values_from(group, SMALLEST, |run| Some(run.fit()?.fit_time))?;
            fits.into_iter().reduce(f64::min)
        },
    },
    Number {
        section: "7.1.2, fig. 7.4",
        quantity: "synthetic data: fit in time at 0.25 N·m, %",
        synthetic: true,
        printed: "some 20",
        agreeing: [15.0, 25.0],
        ours: |group| Some(run_at(group, LARGEST)?.fit()?.fit_time),
    },
    Number {
        section: "7.1.3, fig. 7.9",
        quantity: "bench: mean residual coherence from 0.15 N·m up",
        synthetic: false,
        printed: "0.45 to 0.65",
        agreeing: [0.45, 0.65],
        ours: |group| Some(mean(&values_from(group, 0.15, |run| run.fit()?.coherence)?)),
    },
    Number {
        section: "7.1.3, fig. 7.10",
        quantity: "synthetic data: mean residual coherence from 0.125 N·m up",
        synthetic: true,
        printed: "0.25 to 0.35",
        agreeing: [0.25, 0.35],
        ours: |group| Some(mean(&values_from(group, 0.125, |run| run.fit()?.coherence)?)),
    },
    Number {
        section: "7.2.2",
        quantity: "bench: largest acceleration of the hub at 0.25 N·m, rad/s²",
        synthetic: false,
        printed: "2.21",
        agreeing: [1.88, 2.54],
        ours: |group| Some(run_at(group, LARGEST)?.totals.peak_acceleration),
    },
    Number {
        section: "7.2.2",
        quantity: "bench: largest acceleration of the hub at 0.0125 N·m, rad/s²",
        synthetic: false,
        printed: "0.222",
        agreeing: [0.189, 0.255],
        ours: |group| Some(run_at(group, SMALLEST)?.totals.peak_acceleration),
    },
    Number {
        section: "App. A, 8.1",
        quantity: "bench: smallest torque with rotary slosh, N·m",
        synthetic: false,
        printed: "0.1; weak at 0.075",
        agreeing: [0.07, 0.105],
        ours: |group| {
            let is_rotary =
                |run: &&&Outcome| run.rotary.is_some_and(|rotary| rotary.from.is_some());
            group.runs.iter().find(is_rotary).map(|run| torque_amplitude(run))
        },
    },
];

fn run_at<'a>(group: &'a Group, torque: f64) -> Option<&'a Outcome> {
    group.runs.iter().copied().find(|run| (torque_amplitude(run) - torque).abs() < 1e-9)
}

/// Evaluates `figure` for each run with at least the torque `from` (N·m). Returns `None` if fewer than two
/// runs have a value.
fn values_from(
    group: &Group,
    torque: f64,
    figure: fn(&Outcome) -> Option<f64>,
) -> Option<Vec<f64>> {
    let runs = group.runs.iter().filter(|run| torque_amplitude(run) > torque - 1e-9);
    let values: Vec<f64> = runs.map(|run| figure(run)).collect::<Option<_>>()?;
    (values.len() > 1).then_some(values)
}

/// Returns the table of the thesis's numbers, with a column for each model and a value for each fill; empty
/// if no run gives a value.
pub(super) fn numbers(groups: &[Group]) -> Markup {
    let groups: Vec<&Group> = groups.iter().filter(|group| group.others.is_empty()).collect();
    let models = distinct(groups.iter().map(|group| group.model));
    let compared = |number: &Number, model: &str| -> Vec<(Option<f64>, Option<f64>)> {
        let same = groups.iter().filter(|group| group.model == model);
        let compared = |group: &&Group| !number.synthetic || group.model == "linear";
        same.map(|group| {
            (group.fill, Some(group).filter(|g| compared(g)).and_then(|g| (number.ours)(g)))
        })
        .collect()
    };
    let rows: Vec<_> = NUMBERS
        .iter()
        .map(|number| {
            (number, models.iter().map(|model| compared(number, model)).collect::<Vec<_>>())
        })
        .filter(|(_, cells)| cells.iter().flatten().any(|(_, value)| value.is_some()))
        .collect();
    if rows.is_empty() {
        return html! {};
    }
    html! {
        p {
            "The numbers that Rubaga's thesis prints about its bench and its synthetic data, and the same quantities of these runs. "
            "✓: within the tolerance, ✗: outside; –: no run gives the quantity, for example because no slosh was rotary. "
            "The synthetic data have a linear liquid, so their rows are compared with the model linear only."
        }
        div .wide {
            table .statements {
                thead {
                    tr {
                        th { "quantity" } th { "thesis" } th { "tolerance" }
                        @for model in &models { th { (model) } }
                    }
                }
                tbody {
                    @for (number, cells) in &rows {
                        @let [low, high] = number.agreeing;
                        tr {
                            td { (number.quantity) span .note { "Thesis " (number.section) "." } }
                            td { (number.printed) }
                            td { (low) " to " (high) }
                            @for cell in cells {
                                td {
                                    @for (i, (fill, value)) in cell.iter().enumerate() {
                                        @if i > 0 { br; }
                                        @if let Some(fill) = fill { (cm(*fill)) " cm: " }
                                        @match value {
                                            Some(value) => {
                                                (significant(*value, 3)) " "
                                                @if (low..=high).contains(value) { span .yes { "✓" } } @else { span .no { "✗" } }
                                            }
                                            None => "–",
                                        }
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}
