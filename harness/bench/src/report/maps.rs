//! Heat maps over frequency and torque (thesis figures 7.11 to 7.16).

use super::*;
use crate::campaign::Curve;
use crate::svg::HeatMap;

/// One quantity: its name, its unit, what it is of a run, and the ends of its scale if they are
/// not those of the values.
struct Quantity {
    title: &'static str,
    unit: &'static str,
    of: fn(&Outcome) -> Curve,
    ends: Option<(f64, f64)>,
}

/// One row of maps for each group; a quantity has the same scale in all of them.
pub(super) fn maps(groups: &[Group]) -> String {
    let quantities = [
        Quantity {
            title: "Magnitude |H|",
            unit: "dB",
            of: |run| passing(run),
            ends: Some((-40.0, 10.0)),
        },
        Quantity {
            title: "Residual-input coherence",
            unit: "γ²",
            of: |run| {
                let fit = run.record.as_ref().and_then(|record| record.fit.as_ref());
                fit.map_or(Curve::new(), |(_, coherence)| coherence.clone())
            },
            ends: Some((0.0, 1.0)),
        },
        Quantity {
            title: "Signal-to-noise ratio",
            unit: "dB",
            of: |run| {
                run.record.as_ref().map_or(Curve::new(), |record| record.snr_over_band.clone())
            },
            ends: Some((-10.0, 60.0)),
        },
        Quantity {
            title: "Leakage",
            unit: "r|F_r|/|τ|",
            of: |run| {
                let passing = run.passing.as_ref();
                passing.map_or(Curve::new(), |p| zip(&p.rate.response.frequency, &p.leakage))
            },
            ends: None,
        },
    ];
    let mut out = String::from(
        "<h2>Over frequency and torque</h2>\n<p>One row of cells for each torque. Coherence of the fitted linear model's residual with the torque: bright where the residual still follows the torque steadily, dark where the model is right, or where the residual changes while the sweep passes, as around the resonance in rotary slosh. Leakage is the radial force times the tank's arm over the commanded torque, at the sweep's own frequency: dark in planar slosh, bright in rotary slosh.</p>\n",
    );
    let scales: Vec<Axis> = quantities
        .iter()
        .map(|quantity| {
            let values = || {
                let runs = groups.iter().flat_map(|group| &group.runs);
                runs.flat_map(|run| (quantity.of)(run)).map(|(_, v)| v)
            };
            match quantity.ends {
                Some((from, to)) => Axis::linear(quantity.unit, [from, to], 1e-9, 5),
                None => Axis::linear(quantity.unit, values().chain([0.0]), 0.1, 4),
            }
        })
        .collect();
    for group in groups {
        let (from, to) = group.sweep.map(Sweep::band).unwrap_or(BAND);
        out.push_str(&group.heading());
        out.push_str("<div class=\"four\">\n");
        for (quantity, scale) in quantities.iter().zip(&scales) {
            let rows = group
                .runs
                .iter()
                .map(|run| (thousandths(torque_of(run)).to_string(), (quantity.of)(run)));
            let map = HeatMap {
                title: quantity.title.into(),
                size: (330.0, 250.0),
                x: Axis::logarithmic(
                    "frequency / Hz",
                    (from, to),
                    &responses::frequency_ticks(from, to),
                ),
                rows_label: "torque amplitude / mN·m".into(),
                rows: rows.collect(),
                scale: scale.clone(),
                color: colors::heat,
            };
            out.push_str(&map.svg());
        }
        out.push_str("</div>\n");
    }
    out
}
