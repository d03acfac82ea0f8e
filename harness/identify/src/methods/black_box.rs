//! Linear models without physics, ARX and ARMAX ([`analysis::armax`]), which the thesis recommends (8.5.1), judged as
//! simulations.
//!
//! A prediction one step ahead is of no use as a judge: at 50 Hz y_{k−1} alone predicts y_k to some percent. Here the
//! orders are chosen by the simulation B/A u of rows that were not fitted.

use analysis::armax::{Model, armax, arx};
use analysis::statistics::mean;
use analysis::transfer_function::fit_time;
use anyhow::{Result, ensure};
use maud::html;
use rayon::prelude::*;
use report::page::table;
use serde::Serialize;

use super::{Method, Needs, Task};
use crate::input::recording::Recording;
use crate::news::News;
use crate::tuning::{ARMAX_ORDERS, ARX_ORDERS, FITTED_PART, WORTH};
use crate::words::identified::{Identified, Residual};
use crate::words::page::{RATE, Sections};

/// A fitted model and how it simulates.
#[derive(Clone, Debug, Serialize)]
pub struct Judged {
    /// The model.
    #[serde(flatten)]
    pub model: Model,
    /// Fit of the prediction one step ahead of the rows held back, %.
    pub one_step_pct: f64,
    /// Fit of the simulation of the rows that were fitted, %.
    pub simulated_pct: f64,
    /// Fit of the simulation of the rows held back, %.
    pub held_out_pct: f64,
}

/// The result.
pub type Found = Identified<Details>;

/// The models and the choice.
#[derive(Clone, Debug, Serialize)]
pub struct Details {
    /// All that were tried.
    pub models: Vec<Judged>,
    /// Index of the best ARX.
    pub arx: usize,
    /// Index of the best ARMAX.
    pub armax: usize,
    /// Frequency and damping ratio of each one's least damped poles within the band, Hz.
    pub poles: Vec<Option<(f64, f64)>>,
    /// Time from which rows were held back, s.
    pub held_out_from: f64,
}

/// ARX and ARMAX.
pub struct BlackBox;

impl Method for BlackBox {
    type Details = Details;

    const NEEDS: Needs = Needs { fmu: false, validation: true };

    fn identify(&self, task: &Task, _: &mut dyn FnMut(&News)) -> Result<Found> {
        identify(task.one()?, task.validation.first())
    }

    fn lines(found: &Found) -> Vec<String> {
        let Details { models, poles, .. } = &found.details;
        let mut lines = vec![format!(
            "{:6} {:>5} {:>12} {:>12} {:>12}  poles",
            "", "order", "one step %", "simulated %", "held back %"
        )];
        lines.extend(models.iter().zip(poles).map(|(m, poles)| {
            let poles = poles.map_or(String::new(), |(f, z)| format!("{f:.4} Hz, {z:.4}"));
            format!(
                "{:6} {:>5} {:>12.2} {:>12.2} {:>12.2}  {poles}",
                m.model.kind, m.model.order, m.one_step_pct, m.simulated_pct, m.held_out_pct
            )
        }));
        lines
    }

    fn sections(found: &Found) -> Sections {
        let Details { models, poles, held_out_from, .. } = &found.details;
        let head = [
            "model",
            "order",
            "one step ahead, %",
            "simulated, %",
            "held back, %",
            "poles, Hz",
            "damping ratio",
        ];
        let rows = models.iter().zip(poles).map(|(m, poles)| {
            let [f, z] = poles.map_or([String::new(), String::new()], |(f, z)| {
                [format!("{f:.4}"), format!("{z:.4}")]
            });
            vec![
                m.model.kind.into(),
                m.model.order.to_string(),
                format!("{:.2}", m.one_step_pct),
                format!("{:.2}", m.simulated_pct),
                format!("{:.2}", m.held_out_pct),
                f,
                z,
            ]
        });
        let figures = html! {
            h2 { "Models" }
            @if held_out_from.is_finite() {
                p { (format!("Rows from {held_out_from:.1} s on were not fitted. The charts show simulations of the whole recording.")) }
            }
            (table(head, rows))
        };
        Sections { figures, ..Sections::default() }
    }
}

/// Fits models of growing order to the first two thirds of a recording, or to all of it if another one is held back.
pub fn identify(recording: &Recording, held_out: Option<&Recording>) -> Result<Found> {
    // means belong together: an offset of the gyro is in one, the answer to a steady torque in both
    let centred = |signal: Vec<f64>| -> Vec<f64> {
        let mean = mean(&signal);
        signal.into_iter().map(|v| v - mean).collect()
    };
    let (step, u, y) = recording.even()?;
    let (u, y) = (centred(u), centred(y));
    let cut = match held_out {
        Some(_) => u.len(),
        None => (u.len() as f64 * FITTED_PART) as usize,
    };
    let other = held_out.map(Recording::even).transpose()?;
    let other = other.map(|(other_step, u, y)| (other_step, centred(u), centred(y)));
    if let Some((other_step, ..)) = &other {
        ensure!(
            (other_step / step - 1.0).abs() < 1e-3,
            "the recording held back has rows {other_step} s apart, the fitted one {step} s: a model in \
             samples needs the same"
        );
    }
    let kinds = [(true, &ARX_ORDERS[..]), (false, &ARMAX_ORDERS[..])].into_iter();
    let orders: Vec<(bool, usize)> =
        kinds.flat_map(|(plain, orders)| orders.iter().map(move |n| (plain, *n))).collect();
    let judged = |(plain, n): (bool, usize)| {
        let of = if plain { arx } else { armax };
        let model = of(&u[..cut], &y[..cut], n)?;
        let simulated = model.simulate(&u);
        let predicted = |u: &[f64], y: &[f64], from: usize| {
            let e = model.innovations(u, y);
            let predicted: Vec<f64> = y.iter().zip(&e).map(|(y, e)| y - e).collect();
            fit_time(&y[from..], &predicted[from..])
        };
        let (held_out_pct, one_step_pct) = match &other {
            Some((_, u, y)) => (fit_time(y, &model.simulate(u)), predicted(u, y, 0)),
            None => (fit_time(&y[cut..], &simulated[cut..]), predicted(&u, &y, cut)),
        };
        let simulated_pct = fit_time(&y[..cut], &simulated[..cut]);
        Some(Judged { model, one_step_pct, simulated_pct, held_out_pct })
    };
    let models: Vec<Option<Judged>> = orders.into_par_iter().map(judged).collect();
    let models: Vec<Judged> = models.into_iter().flatten().collect();
    let best = |kind: &str| {
        let best = models.iter().filter(|m| m.model.kind == kind).map(|m| m.held_out_pct);
        let best = best.fold(f64::NEG_INFINITY, f64::max);
        models.iter().position(|m| m.model.kind == kind && m.held_out_pct > best - WORTH)
    };
    let (Some(arx), Some(armax)) = (best("ARX"), best("ARMAX")) else {
        anyhow::bail!("{}: no ARX or ARMAX could be fitted", recording.name)
    };
    let band = crate::fit::bench::start::excited_band(step, &u, &y).unwrap_or((0.1, 0.4 / step));
    let wide = (0.8 * band.0, 1.2 * band.1);
    let poles = models.iter().map(|m| m.model.poles(step, wide)).collect();
    let line = |m: &Judged| {
        format!(
            "{}, order {}: its simulation fits the held-back rows to {:.1} % (prediction one step ahead: {:.1} %).",
            m.model.kind, m.model.order, m.held_out_pct, m.one_step_pct
        )
    };
    let verdict = vec![line(&models[arx]), line(&models[armax])];
    let held_out_from =
        if cut < u.len() { recording.time[0] + cut as f64 * step } else { f64::NAN };
    let time: Vec<f64> = (0..u.len()).map(|k| recording.time[0] + k as f64 * step).collect();
    let residual = |index: usize| {
        let Model { kind, order, .. } = models[index].model;
        let simulated = models[index].model.simulate(&u);
        Residual {
            name: format!("{}, {kind} of order {order}", recording.name),
            label: RATE.into(),
            time: time.clone(),
            measured: y.clone(),
            residual: y.iter().zip(&simulated).map(|(y, model)| y - model).collect(),
            noise: None,
            torque: Some(u.clone()),
        }
    };
    let residuals = vec![residual(arx), residual(armax)];
    let details = Details { models, arx, armax, poles, held_out_from };
    Ok(Found { verdict, residuals, ..Found::new(details) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use analysis::linear::Linear;
    use analysis::random::Random;

    #[test]
    fn armax_finds_a_noisy_linear_bench_where_arx_of_its_order_does_not() {
        let plant = Linear { friction: 0.2, ..Linear::bench_10_cm(0.01) };
        let mut random = Random::new(1, 1);
        // noise held for 0.1 s: power over the whole band
        let mut torque = Vec::new();
        for _ in 0..3000 {
            let level = 0.05 * random.normal();
            torque.extend([level; 5]);
        }
        let mut rate = plant.simulate(0.02, &torque, 0.0);
        rate.iter_mut().for_each(|w| *w += 4e-4 * random.normal());
        let time = (0..torque.len()).map(|k| 0.02 * k as f64).collect();
        let size = (rate.iter().map(|w| w * w).sum::<f64>() / rate.len() as f64).sqrt();
        let found = identify(&Recording::of("noise", time, torque, rate), None).unwrap();
        let at = |kind: &str, n: usize| {
            found
                .details
                .models
                .iter()
                .position(|m| m.model.kind == kind && m.model.order == n)
                .unwrap()
        };
        let (simple, moving) =
            (&found.details.models[at("ARX", 3)], &found.details.models[at("ARMAX", 3)]);
        // white noise on the output is C = A, which ARMAX has and ARX lacks
        // the residual of what was held back is the noise alone; its rms there is that of the whole to a few percent
        let limit = 100.0 * (1.0 - 4e-4 / size);
        assert!(moving.held_out_pct > limit - 1.0, "{moving:?} {limit}");
        assert!(simple.held_out_pct < limit - 5.0, "{simple:?} {limit}");
        // ω_p² = ω²(1 + m r²/I0), within what friction and noise leave
        let (f, _) = found.details.poles[at("ARMAX", 3)].unwrap();
        assert!((f / 2.456 - 1.0).abs() < 2e-3, "{f}");
        let page = BlackBox::page(&found);
        for of in ["ARX of order", "ARMAX of order", "Gain from torque to rate"] {
            assert!(page.contains(of), "{of}");
        }
        // one step ahead both look good
        assert!(simple.one_step_pct > 80.0 && moving.one_step_pct > 80.0, "{simple:?}");
        assert!(found.details.models[found.details.arx].held_out_pct > simple.held_out_pct);
    }
}
