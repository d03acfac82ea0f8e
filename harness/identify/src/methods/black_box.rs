//! Linear models without physics, ARX and ARMAX, which the thesis recommends (8.5.1), judged as
//! simulations.
//!
//! ```text
//! A(q) y_k = B(q) u_k + C(q) e_k,   A = 1 + a_1 q⁻¹ + … + a_n q⁻ⁿ,   B = b_0 + … + b_n q⁻ⁿ
//! ```
//!
//! ARX has C = 1 and is linear least squares; ARMAX has C = 1 + c_1 q⁻¹ + …, a prediction-error fit (Ljung,
//! System Identification, 2nd ed., 4.2, 7.2 and 10.3) that starts from the residual of a long ARX (Hannan and
//! Rissanen).
//!
//! A prediction one step ahead is of no use as a judge: at 50 Hz y_{k−1} alone predicts y_k to some percent. Here the
//! orders are chosen by the simulation B/A u of rows that were not fitted.

use std::f64::consts::TAU;

use analysis::transfer_function::fit_time;
use anyhow::{Result, ensure};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::Serialize;

use super::{Identified, Method, Needs, Task};
use crate::recording::Recording;

/// Orders of ARX that are tried.
const ARX: [usize; 9] = [2, 3, 4, 6, 8, 12, 16, 24, 32];
/// Orders of ARMAX that are tried.
const ARMAX: [usize; 4] = [2, 3, 4, 5];
/// Order of the ARX whose residual stands for e.
const LONG: usize = 30;
/// Part of the record that is fitted; the rest is held back.
const FITTED: f64 = 2.0 / 3.0;
/// Steps of the prediction-error search at most.
const STEPS: usize = 40;
/// A larger model must simulate better by this much, %.
const WORTH: f64 = 0.1;

/// A fitted model.
#[derive(Clone, Debug, Serialize)]
pub struct Model {
    /// `ARX` or `ARMAX`.
    pub kind: &'static str,
    /// n.
    pub order: usize,
    /// a_1, …
    pub a: Vec<f64>,
    /// b_0, …
    pub b: Vec<f64>,
    /// c_1, …
    pub c: Vec<f64>,
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
    pub models: Vec<Model>,
    /// Place of the best ARX.
    pub arx: usize,
    /// Place of the best ARMAX.
    pub armax: usize,
    /// Frequency and damping ratio of each one's least damped poles within the band, Hz.
    pub poles: Vec<Option<(f64, f64)>>,
    /// From when on rows were held back, s.
    pub held_out_from: f64,
}

/// ARX and ARMAX.
pub struct BlackBox;

impl Method for BlackBox {
    type Details = Details;

    const NEEDS: Needs = Needs { fmu: false, validation: true };

    fn identify(&self, task: &Task, _: &mut dyn FnMut(&str)) -> Result<Found> {
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
                m.kind, m.order, m.one_step_pct, m.simulated_pct, m.held_out_pct
            )
        }));
        lines
    }
}

impl Model {
    /// B/A u from rest.
    pub fn simulate(&self, u: &[f64]) -> Vec<f64> {
        let mut y: Vec<f64> = Vec::with_capacity(u.len());
        for k in 0..u.len() {
            let mut value = 0.0;
            for (j, b) in self.b.iter().enumerate().take(k + 1) {
                value += b * u[k - j];
            }
            for (j, a) in self.a.iter().enumerate().take(k) {
                value -= a * y[k - 1 - j];
            }
            // an unstable model: far from everything, but finite
            y.push(value.clamp(-1e6, 1e6));
        }
        y
    }

    /// e: what is left of the predictions one step ahead.
    pub fn innovations(&self, u: &[f64], y: &[f64]) -> Vec<f64> {
        let mut e: Vec<f64> = Vec::with_capacity(u.len());
        for k in 0..u.len() {
            let mut value = y[k];
            for (j, b) in self.b.iter().enumerate().take(k + 1) {
                value -= b * u[k - j];
            }
            for (j, a) in self.a.iter().enumerate().take(k) {
                value += a * y[k - 1 - j];
            }
            for (j, c) in self.c.iter().enumerate().take(k) {
                value -= c * e[k - 1 - j];
            }
            e.push(value.clamp(-1e6, 1e6));
        }
        e
    }

    /// Frequency (Hz) and damping ratio of the least damped pair of poles between two frequencies, from rows `step` s apart.
    pub fn poles(&self, step: f64, (from, to): (f64, f64)) -> Option<(f64, f64)> {
        let roots = companion(&self.a).complex_eigenvalues();
        let pairs = roots.iter().filter(|z| z.im > 0.0).map(|z| {
            let s = z.ln() / step;
            (s.norm() / TAU, -s.re / s.norm())
        });
        let within = pairs.filter(|(f, _)| (from..=to).contains(f));
        within.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// Least squares of rows (y_k, regressors) by Householder's triangularisation: at 50 Hz neighbouring rows are so
/// much alike that normal equations would lose all digits.
fn least_squares(rows: impl Iterator<Item = (f64, Vec<f64>)>, width: usize) -> Option<Vec<f64>> {
    let (mut right, mut all) = (Vec::new(), Vec::new());
    for (y, row) in rows {
        right.push(y);
        all.extend(row);
    }
    let mut matrix = DMatrix::from_row_slice(right.len(), width, &all);
    let size: Vec<f64> = matrix.column_iter().map(|c| c.norm().max(1e-300)).collect();
    for (mut column, size) in matrix.column_iter_mut().zip(&size) {
        column /= *size;
    }
    let mut right = DVector::from_vec(right);
    let qr = matrix.qr();
    qr.q_tr_mul(&mut right);
    let solution = qr.r().solve_upper_triangular(&right.rows(0, width).into_owned())?;
    let x: Vec<f64> = solution.iter().zip(&size).map(|(x, size)| x / size).collect();
    x.iter().all(|x| x.is_finite()).then_some(x)
}

fn past(signal: &[f64], k: usize, from: usize, to: usize) -> impl Iterator<Item = f64> + '_ {
    (from..=to).map(move |j| if k >= j { signal[k - j] } else { 0.0 })
}

fn arx(u: &[f64], y: &[f64], n: usize) -> Option<Model> {
    let rows = (0..y.len()).map(|k| {
        let row: Vec<f64> = past(y, k, 1, n).map(|y| -y).chain(past(u, k, 0, n)).collect();
        (y[k], row)
    });
    let x = least_squares(rows, 2 * n + 1)?;
    Some(model("ARX", n, &x))
}

fn model(kind: &'static str, order: usize, x: &[f64]) -> Model {
    Model {
        kind,
        order,
        a: x[..order].to_vec(),
        b: x[order..2 * order + 1].to_vec(),
        c: x[2 * order + 1..].to_vec(),
        one_step_pct: f64::NAN,
        simulated_pct: f64::NAN,
        held_out_pct: f64::NAN,
    }
}

/// A signal through 1/C.
fn through(signal: &[f64], c: &[f64]) -> Vec<f64> {
    let mut out: Vec<f64> = Vec::with_capacity(signal.len());
    for k in 0..signal.len() {
        let feedback: f64 = c.iter().enumerate().take(k).map(|(j, c)| c * out[k - 1 - j]).sum();
        out.push((signal[k] - feedback).clamp(-1e9, 1e9));
    }
    out
}

/// The matrix whose eigenvalues are the zeros of 1 + c_1 q⁻¹ + …, in q.
fn companion(c: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(c.len(), c.len(), |i, j| match (i, j) {
        (0, j) => -c[j],
        (i, j) if i == j + 1 => 1.0,
        _ => 0.0,
    })
}

/// Whether all zeros of 1 + c_1 q⁻¹ + … lie within the unit circle.
fn is_stable(c: &[f64]) -> bool {
    companion(c).complex_eigenvalues().iter().all(|z| z.norm() < 1.0)
}

/// The polynomial with its zeros drawn towards 0 until they are stable.
fn stable(mut c: Vec<f64>) -> Vec<f64> {
    while !is_stable(&c) {
        let mut factor = 1.0;
        for c in &mut c {
            factor *= 0.98;
            *c *= factor;
        }
    }
    c
}

/// Two starts: e from a long ARX; and, for white noise on the output (C = A), Steiglitz and McBride's iteration, ARX of
/// signals filtered with the last 1/A, from that long ARX's simulation.
fn starts(u: &[f64], y: &[f64], n: usize) -> Option<[Vec<f64>; 2]> {
    let long = arx(u, y, LONG)?;
    let e = long.innovations(u, y);
    let rows = (LONG..y.len()).map(|k| {
        let inputs = past(u, k, 0, n).chain(past(&e, k, 1, n));
        (y[k], past(y, k, 1, n).map(|y| -y).chain(inputs).collect())
    });
    let mut first = least_squares(rows, 3 * n + 1)?;
    let c = stable(first.split_off(2 * n + 1));
    first.extend(c);
    let mut quiet = arx(u, &long.simulate(u), n)?;
    for _ in 0..15 {
        let a = stable(quiet.a.clone());
        quiet = arx(&through(u, &a), &through(y, &a), n)?;
    }
    let second = [quiet.a.clone(), quiet.b, stable(quiet.a)].concat();
    Some([first, second])
}

fn armax(u: &[f64], y: &[f64], n: usize) -> Option<Model> {
    let width = 3 * n + 1;
    let cost = |x: &[f64]| -> f64 {
        let one = model("ARMAX", n, x);
        if !is_stable(&one.c) {
            return f64::INFINITY;
        }
        one.innovations(u, y).iter().map(|e| e * e).sum()
    };
    let from = starts(u, y, n)?.map(|x| (cost(&x), x));
    let (mut best, mut x) = from.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    for _ in 0..STEPS {
        // Gauss and Newton: ∂e/∂a_j = y/C, ∂e/∂b_j = −u/C, ∂e/∂c_j = −e/C, each late by j
        let now = model("ARMAX", n, &x);
        let e = now.innovations(u, y);
        let [yc, uc, ec] = [y, u, &e].map(|signal| through(signal, &now.c));
        let rows = (0..y.len()).map(|k| {
            let outputs = past(&yc, k, 1, n).map(|y| -y);
            (e[k], outputs.chain(past(&uc, k, 0, n)).chain(past(&ec, k, 1, n)).collect())
        });
        let step = least_squares(rows, width)?;
        let mut part = 1.0;
        let mut fell = 0.0;
        while part > 1e-4 {
            let mut moved: Vec<f64> = x.iter().zip(&step).map(|(x, s)| x + part * s).collect();
            let c = stable(moved.split_off(2 * n + 1));
            moved.extend(c);
            let there = cost(&moved);
            if there < best {
                fell = 1.0 - there / best;
                (x, best) = (moved, there);
                break;
            }
            part *= 0.4;
        }
        if fell < 1e-9 {
            break;
        }
    }
    Some(model("ARMAX", n, &x))
}

/// Fits models of growing order to the first two thirds of a recording, or to all of it if another one is held back.
pub fn identify(recording: &Recording, held_out: Option<&Recording>) -> Result<Found> {
    // means belong together: an offset of the gyro is in one, the answer to a steady torque in both
    let centred = |signal: Vec<f64>| -> Vec<f64> {
        let mean = signal.iter().sum::<f64>() / signal.len() as f64;
        signal.into_iter().map(|v| v - mean).collect()
    };
    let (step, u, y) = recording.even();
    let (u, y) = (centred(u), centred(y));
    let cut = match held_out {
        Some(_) => u.len(),
        None => (u.len() as f64 * FITTED) as usize,
    };
    let other = held_out.map(|other| {
        let (other_step, u, y) = other.even();
        (other_step, centred(u), centred(y))
    });
    if let Some((other_step, ..)) = &other {
        ensure!(
            (other_step / step - 1.0).abs() < 1e-3,
            "the recording held back has rows {other_step} s apart, the fitted one {step} s: a model in \
             samples needs the same"
        );
    }
    let orders = ARX.map(|n| (true, n)).into_iter().chain(ARMAX.map(|n| (false, n)));
    let orders: Vec<(bool, usize)> = orders.collect();
    let models: Vec<Option<Model>> = orders
        .into_par_iter()
        .map(|(plain, n)| {
            let of = if plain { arx } else { armax };
            let mut found = of(&u[..cut], &y[..cut], n)?;
            let simulated = found.simulate(&u);
            found.simulated_pct = fit_time(&y[..cut], &simulated[..cut]);
            let predicted = |u: &[f64], y: &[f64], from: usize| {
                let e = found.innovations(u, y);
                let predicted: Vec<f64> = y.iter().zip(&e).map(|(y, e)| y - e).collect();
                fit_time(&y[from..], &predicted[from..])
            };
            (found.held_out_pct, found.one_step_pct) = match &other {
                Some((_, u, y)) => (fit_time(y, &found.simulate(u)), predicted(u, y, 0)),
                None => (fit_time(&y[cut..], &simulated[cut..]), predicted(&u, &y, cut)),
            };
            Some(found)
        })
        .collect();
    let models: Vec<Model> = models.into_iter().flatten().collect();
    let best = |kind: &str| {
        let best = models.iter().filter(|m| m.kind == kind).map(|m| m.held_out_pct);
        let best = best.fold(f64::NEG_INFINITY, f64::max);
        models.iter().position(|m| m.kind == kind && m.held_out_pct > best - WORTH)
    };
    let (Some(arx), Some(armax)) = (best("ARX"), best("ARMAX")) else {
        anyhow::bail!("{}: no ARX or ARMAX could be fitted", recording.name)
    };
    let band = crate::start::excited_band(step, &u, &y).unwrap_or((0.1, 0.4 / step));
    let wide = (0.8 * band.0, 1.2 * band.1);
    let poles = models.iter().map(|m| m.poles(step, wide)).collect();
    let line = |m: &Model| {
        format!(
            "{}, order {}: simulates what was held back to {:.1} % (one step ahead it predicts {:.1} %).",
            m.kind, m.order, m.held_out_pct, m.one_step_pct
        )
    };
    let verdict = vec![line(&models[arx]), line(&models[armax])];
    let held_out_from =
        if cut < u.len() { recording.time[0] + cut as f64 * step } else { f64::NAN };
    Ok(Found::words_alone(verdict, Details { models, arx, armax, poles, held_out_from }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use analysis::linear::{Linear, Mode};
    use analysis::random::Random;

    #[test]
    fn armax_finds_a_noisy_linear_bench_where_arx_of_its_order_does_not() {
        let mode = Mode { mass: 0.756_293_271_9, frequency: 2.343_618_143_1, damping: 0.01 };
        let inertia = 0.322414 + 1.330_431_108_5 * 0.225f64.powi(2);
        let plant = Linear { inertia, friction: 0.2, arm: 0.225, modes: vec![mode] };
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
            found.details.models.iter().position(|m| m.kind == kind && m.order == n).unwrap()
        };
        let (simple, moving) =
            (&found.details.models[at("ARX", 3)], &found.details.models[at("ARMAX", 3)]);
        // white noise on the output is C = A, which ARMAX has and ARX lacks
        // the noise alone is left of what was held back; its rms there is that of the whole to a few percent
        let limit = 100.0 * (1.0 - 4e-4 / size);
        assert!(moving.held_out_pct > limit - 1.0, "{moving:?} {limit}");
        assert!(simple.held_out_pct < limit - 5.0, "{simple:?} {limit}");
        // ω_p² = ω²(1 + m r²/I0), within what friction and noise leave
        let (f, _) = found.details.poles[at("ARMAX", 3)].unwrap();
        assert!((f / 2.456 - 1.0).abs() < 2e-3, "{f}");
        // one step ahead both look good
        assert!(simple.one_step_pct > 80.0 && moving.one_step_pct > 80.0, "{simple:?}");
        assert!(found.details.models[found.details.arx].held_out_pct > simple.held_out_pct);
    }
}
