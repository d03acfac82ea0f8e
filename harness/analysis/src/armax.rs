//! Linear black-box models, ARX and ARMAX.
//!
//! ```text
//! A(q) y_k = B(q) u_k + C(q) e_k,   A = 1 + a_1 q⁻¹ + … + a_n q⁻ⁿ,   B = b_0 + … + b_n q⁻ⁿ
//! ```
//!
//! ARX has C = 1 and is a linear least-squares problem. ARMAX has C = 1 + c_1 q⁻¹ + …, a prediction-error fit (Ljung,
//! System Identification, 2nd ed., 4.2, 7.2 and 10.3). The fit starts from the residual of a long ARX (Hannan and
//! Rissanen).

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

/// Order of the ARX whose residual approximates e.
const LONG: usize = 30;
/// Largest number of steps of the prediction-error search.
const STEPS: usize = 40;

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
}

/// Returns y_k = Σ sign Σ_j c_j u_{k−j} − Σ_j a_j y_{k−j} from rest, with j from 1 in `a` and from `first` in each of
/// the `inputs` (sign, c, u, first).
fn recursion(inputs: &[(f64, &[f64], &[f64], usize)], a: &[f64]) -> Vec<f64> {
    let rows = inputs[0].2.len();
    let mut y: Vec<f64> = Vec::with_capacity(rows);
    for k in 0..rows {
        let mut value = 0.0;
        for (sign, coefficients, signal, first) in inputs {
            for (c, u) in
                coefficients.iter().zip(signal[..(k + 1).saturating_sub(*first)].iter().rev())
            {
                value += sign * c * u;
            }
        }
        for (a, y) in a.iter().zip(y.iter().rev()) {
            value -= a * y;
        }
        // an unstable model gives large but finite values
        y.push(value.clamp(-1e6, 1e6));
    }
    y
}

impl Model {
    /// Simulates B/A u from rest.
    pub fn simulate(&self, u: &[f64]) -> Vec<f64> {
        recursion(&[(1.0, &self.b, u, 0)], &self.a)
    }

    /// Returns e = (A y − B u)/C, the one-step prediction errors.
    pub fn innovations(&self, u: &[f64], y: &[f64]) -> Vec<f64> {
        let inputs = [(1.0, &[1.0][..], y, 0), (-1.0, &self.b[..], u, 0), (1.0, &self.a[..], y, 1)];
        recursion(&inputs, &self.c)
    }

    /// Returns frequency (Hz) and damping ratio of the least damped pair of poles between two frequencies, from rows
    /// `step` s apart.
    pub fn poles(&self, step: f64, (from, to): (f64, f64)) -> Option<(f64, f64)> {
        // with non-finite values the eigenvalue iteration would not end
        if !self.a.iter().all(|a| a.is_finite()) {
            return None;
        }
        let roots = companion(&self.a).complex_eigenvalues();
        let pairs = roots.iter().filter(|z| z.im > 0.0).map(|z| {
            let s = z.ln() / step;
            (s.norm() / TAU, -s.re / s.norm())
        });
        let within = pairs.filter(|(f, _)| (from..=to).contains(f));
        within.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// Solves least squares of rows (y_k, regressors) by Householder triangularisation. At 50 Hz neighbouring rows are so
/// similar that normal equations would lose all digits.
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

/// Fits ARX of order n by linear least squares; `None` if the rows do not determine it.
pub fn arx(u: &[f64], y: &[f64], n: usize) -> Option<Model> {
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
    }
}

/// Filters a signal with 1/C.
fn through(signal: &[f64], c: &[f64]) -> Vec<f64> {
    let mut out: Vec<f64> = Vec::with_capacity(signal.len());
    for k in 0..signal.len() {
        let feedback: f64 = c.iter().zip(out.iter().rev()).map(|(c, out)| c * out).sum();
        out.push((signal[k] - feedback).clamp(-1e9, 1e9));
    }
    out
}

/// Returns the matrix whose eigenvalues are the zeros of 1 + c_1 q⁻¹ + …, in q.
fn companion(c: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(c.len(), c.len(), |i, j| match (i, j) {
        (0, j) => -c[j],
        (i, j) if i == j + 1 => 1.0,
        _ => 0.0,
    })
}

/// Returns true if all zeros of 1 + c_1 q⁻¹ + … lie within the unit circle.
fn is_stable(c: &[f64]) -> bool {
    companion(c).complex_eigenvalues().iter().all(|z| z.norm() < 1.0)
}

/// Returns the polynomial with its zeros scaled towards 0 until they are stable.
fn stable(mut c: Vec<f64>) -> Vec<f64> {
    // non-finite zeros would never become stable
    if !c.iter().all(|c| c.is_finite()) {
        return vec![0.0; c.len()];
    }
    while !is_stable(&c) {
        let mut factor = 1.0;
        for c in &mut c {
            factor *= 0.98;
            *c *= factor;
        }
    }
    c
}

/// Returns two starts. The first takes e from a long ARX. The second, for white noise on the output (C = A), is
/// Steiglitz and McBride's iteration: ARX of signals filtered with the last 1/A, starting from that long ARX's
/// simulation.
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

/// Fits ARMAX of order n by Gauss–Newton steps; `None` if the rows do not determine it.
pub fn armax(u: &[f64], y: &[f64], n: usize) -> Option<Model> {
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
        // Gauss–Newton: ∂e/∂a_j = y/C, ∂e/∂b_j = −u/C, ∂e/∂c_j = −e/C, each delayed by j
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
