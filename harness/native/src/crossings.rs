//! Crossings of a loop gain: where its magnitude is 1, where it is negative real, and how near it comes to -1.
//!
//! Poles and zeros tell where to look. The logarithm of the gain is a sum over them, so that on an interval of frequencies
//! value, slope and a bound of the curvature show whether it can cross at all, and whether more than once; if more than
//! once, the interval is halved. What the intervals bound is then evaluated from the state space itself.

use num_complex::Complex64 as Complex;
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::numbers::numbers;

/// A loop gain above this is at an integrator, or another pole on the axis: no crossing.
const INTEGRATOR: f64 = 1e8;
/// A loop gain below this is rounding: no phase crossing.
const NOTHING: f64 = 1e-12;
/// Error of what the poles and zeros give, in the logarithm: they are eigenvalues with their own errors.
const SLACK: f64 = 1e-3;
/// Frequencies that are looked at in any case.
const GRID: usize = 40;
/// Most intervals of a search.
const MOST: usize = 5_000;

/// A state-space model, its matrix A in Hessenberg form: a frequency costs n² operations.
#[pyclass(frozen, module = "hubslosh")]
pub struct Model {
    states: usize,
    inputs: usize,
    outputs: usize,
    /// Row after row.
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
    d: Vec<f64>,
    /// 0: continuous time.
    period: f64,
}

impl Model {
    fn new([a, b, c, d]: [Vec<f64>; 4], (states, inputs, outputs): Size, period: f64) -> Model {
        let mut model = Model { states, inputs, outputs, a, b, c, d, period };
        for k in 1..states.saturating_sub(1) {
            model.reflect(k);
        }
        model
    }

    /// Clears column `k` - 1 below row `k` by a Householder reflection of the states from `k` on.
    fn reflect(&mut self, k: usize) {
        let n = self.states;
        let mut v: Vec<f64> = (k..n).map(|i| self.a[i * n + k - 1]).collect();
        let size = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        if v[1..].iter().all(|x| *x == 0.0) {
            return;
        }
        v[0] += size.copysign(v[0]);
        let square: f64 = v.iter().map(|x| x * x).sum();
        let left = |matrix: &mut [f64], width: usize| {
            for j in 0..width {
                let sum: f64 = v.iter().zip(k..).map(|(x, i)| x * matrix[i * width + j]).sum();
                for (x, i) in v.iter().zip(k..) {
                    matrix[i * width + j] -= 2.0 * sum / square * x;
                }
            }
        };
        let right = |matrix: &mut [f64]| {
            for row in matrix.chunks_exact_mut(n) {
                let sum: f64 = v.iter().zip(&row[k..]).map(|(x, y)| x * y).sum();
                for (x, y) in v.iter().zip(&mut row[k..]) {
                    *y -= 2.0 * sum / square * x;
                }
            }
        };
        left(&mut self.a, n);
        left(&mut self.b, self.inputs);
        right(&mut self.a);
        right(&mut self.c);
    }

    /// Returns the response at `w`, rad/s, row after row; not finite at a pole.
    fn at(&self, w: f64) -> Vec<Complex> {
        let (n, m) = (self.states, self.inputs);
        let s = point(w, self.period);
        let mut rows: Vec<Complex> = self.a.iter().map(|a| Complex::new(-a, 0.0)).collect();
        for k in 0..n {
            rows[k * n + k] += s;
        }
        // column after column
        let mut states: Vec<Complex> = (0..m)
            .flat_map(|j| (0..n).map(move |i| Complex::new(self.b[i * m + j], 0.0)))
            .collect();
        for k in 0..n.saturating_sub(1) {
            let (upper, lower) = rows[k * n..][..2 * n].split_at_mut(n);
            let (upper, lower) = (&mut upper[k..], &mut lower[k..]);
            if upper[0].norm_sqr() < lower[0].norm_sqr() {
                upper.swap_with_slice(lower);
                for state in states.chunks_exact_mut(n) {
                    state.swap(k, k + 1);
                }
            }
            if lower[0] == Complex::ZERO {
                continue;
            }
            let factor = lower[0] / upper[0];
            for (x, y) in lower.iter_mut().zip(&*upper).skip(1) {
                *x -= factor * *y;
            }
            for state in states.chunks_exact_mut(n) {
                let above = state[k];
                state[k + 1] -= factor * above;
            }
        }
        for state in states.chunks_exact_mut(n.max(1)) {
            for i in (0..n).rev() {
                let row = &rows[i * n..][..n];
                let mut sum = state[i];
                for (a, x) in row[i + 1..].iter().zip(&state[i + 1..]) {
                    sum -= *a * *x;
                }
                state[i] = sum / row[i];
            }
        }
        let mut found = Vec::with_capacity(self.outputs * m);
        for i in 0..self.outputs {
            for j in 0..m {
                let mut sum = Complex::new(self.d[i * m + j], 0.0);
                for (c, x) in self.c[i * n..][..n].iter().zip(&states[j * n..]) {
                    sum += *x * *c;
                }
                found.push(sum);
            }
        }
        found
    }

    fn gain(&self, w: f64) -> Complex {
        self.at(w)[0]
    }
}

/// s = jω, or z = exp(jωT) in its place.
fn point(w: f64, period: f64) -> Complex {
    if period == 0.0 {
        return Complex::new(0.0, w);
    }
    let (sin, cos) = (w * period).sin_cos();
    Complex::new(cos, sin)
}

/// A rational function by poles, zeros and factor.
struct Shape {
    /// Zeros and poles in pairs, each zero with the pole that is nearest of those left: what a pair does to the slope is
    /// small where its distance is.
    pairs: Vec<[Option<Complex>; 2]>,
    /// Logarithm of the factor's magnitude, and its phase.
    factor: (f64, f64),
    period: f64,
}

/// Logarithm of a value: magnitude and phase, their slopes over ω.
struct Logarithm {
    value: [f64; 2],
    slope: [f64; 2],
    /// Bounds of the second derivatives.
    curvature: [f64; 2],
}

impl Shape {
    /// The factor makes it `exact` at most of the frequencies.
    fn new(
        [zeros, poles]: [&[Complex]; 2],
        period: f64,
        grid: &[f64],
        exact: impl Fn(f64) -> Complex,
    ) -> Shape {
        let mut left = poles.to_vec();
        let mut pairs: Vec<_> = zeros
            .iter()
            .map(|zero| {
                let distance = |i: &usize| (left[*i] - *zero).norm_sqr();
                let nearest = (0..left.len()).min_by(|i, j| distance(i).total_cmp(&distance(j)));
                [Some(*zero), nearest.map(|i| left.swap_remove(i))]
            })
            .collect();
        pairs.extend(left.into_iter().map(|pole| [None, Some(pole)]));
        let mut shape = Shape { pairs, factor: (0.0, 0.0), period };
        let mut factors: Vec<(f64, f64)> = grid
            .iter()
            .step_by(4)
            .filter_map(|w| {
                let [size, phase] = shape.at(*w, 0.0).value;
                let value = exact(*w);
                let factor = (value.norm().ln() - size, value.arg() - phase);
                (factor.0.is_finite() && factor.1.is_finite()).then_some(factor)
            })
            .collect();
        factors.sort_by(|a, b| a.0.total_cmp(&b.0));
        shape.factor = factors.get(factors.len() / 2).copied().unwrap_or_default();
        shape
    }

    fn roots(&self) -> impl Iterator<Item = &Complex> {
        self.pairs.iter().flatten().flatten()
    }

    /// Returns the logarithm at `w`, and bounds its second derivative within `half` of `w`.
    fn at(&self, w: f64, half: f64) -> Logarithm {
        let s = point(w, self.period);
        // ds/dω, and how far s moves
        let (along, reach) = match self.period {
            0.0 => (Complex::new(0.0, 1.0), half),
            period => (Complex::new(0.0, period) * s, half * period),
        };
        let (mut product, mut scale) = (Complex::new(1.0, 0.0), 0.0);
        let (mut sum, mut curvature) = (Complex::new(0.0, 0.0), [0.0; 2]);
        for pair in &self.pairs {
            let (mut bends, mut nearest, mut largest) = ([0.0; 2], f64::INFINITY, 0f64);
            for (root, is_zero) in pair.iter().zip([true, false]) {
                let Some(root) = root else { continue };
                let way = s - *root;
                let square = way.norm_sqr();
                let inverse = Complex::new(way.re / square, -way.im / square);
                // distances from the axis, and from the part of it within reach
                let size = root.norm_sqr().sqrt();
                let (axis, bend) = match self.period {
                    0.0 => (root.re.abs(), [1.0, 2.0 * root.re.abs()]),
                    _ => {
                        let axis = (1.0 - size).abs();
                        (axis, [size, size.sqrt() * axis * (1.0 + size)])
                    }
                };
                let least = (square.sqrt() - reach).max(axis);
                let near = bend[0] / (least * least);
                bends[0] += near;
                // the phase of a root on the axis turns steadily
                bends[1] += near.min(bend[1] / (least * least * least));
                (nearest, largest) = (nearest.min(least), largest.max(size));
                if is_zero {
                    product *= way;
                    sum += inverse;
                } else {
                    product *= inverse;
                    sum -= inverse;
                }
            }
            if let [Some(zero), Some(pole)] = pair {
                // by the derivative along the way from one to the other
                let gap = (*zero - *pole).norm();
                let least = nearest - gap / 2.0;
                let steep = if self.period == 0.0 { 2.0 } else { 1.0 + largest };
                if least > 0.0 {
                    let both = steep * gap / (least * least * least);
                    bends = bends.map(|bend| bend.min(both));
                }
            }
            let unit = if self.period == 0.0 { 1.0 } else { self.period * self.period };
            curvature[0] += bends[0] * unit;
            curvature[1] += bends[1] * unit;
            let size = product.re.abs().max(product.im.abs());
            if !(1e-100..1e100).contains(&size) && size > 0.0 {
                scale += size.ln();
                product *= 1.0 / size;
            }
        }
        let slope = along * sum;
        Logarithm {
            value: [self.factor.0 + scale + product.norm().ln(), self.factor.1 + product.arg()],
            slope: [slope.re, slope.im],
            curvature,
        }
    }

    /// Returns the ends of intervals outside of which there is no crossing, and in each of which there is one at most.
    fn isolate(&self, kind: Kind, grid: &[f64]) -> Vec<f64> {
        let mut ends = Vec::new();
        let mut stack: Vec<(f64, f64)> = grid.windows(2).map(|pair| (pair[0], pair[1])).collect();
        for _ in 0..MOST {
            let Some((low, high)) = stack.pop() else { break };
            let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
            let Logarithm { value, slope, curvature } = self.at(middle, half);
            let reach = (slope[0].abs() + curvature[0] * half / 2.0) * half + SLACK;
            let outside = value[0] - reach > INTEGRATOR.ln() || value[0] + reach < NOTHING.ln();
            if kind == Kind::Phase && outside {
                continue;
            }
            let (value, slope, bend) = match kind {
                Kind::Gain => (value[0], slope[0], curvature[0] * half),
                // the phase of a negative or positive real number
                Kind::Phase => {
                    let turns = value[1] / std::f64::consts::PI;
                    let value = (turns - turns.round()) * std::f64::consts::PI;
                    (value, slope[1], curvature[1] * half)
                }
            };
            if value.abs() > slope.abs() * half + bend * half / 2.0 + SLACK {
                continue;
            }
            let once = slope.abs() > bend * (1.0 + 1e-6)
                && (matches!(kind, Kind::Gain) || 2.0 * slope.abs() * half < 3.0);
            let level = (slope.abs() + bend) * half < 1e-13;
            if once || level || high - low < 1e-13 * high {
                ends.extend([low, high]);
            } else {
                stack.extend([(low, middle), (middle, high)]);
            }
        }
        ends.extend(stack.iter().flat_map(|(low, high)| [*low, *high]));
        ends
    }

    /// Returns frequencies at which the magnitude has its least minima.
    fn minima(&self, grid: &[f64]) -> Vec<f64> {
        let mut points = grid.to_vec();
        let (low, high) = (grid[0], grid[grid.len() - 1]);
        for root in self.roots() {
            let (place, width) = match self.period {
                0.0 => (root.im.abs(), root.re.abs()),
                period => (root.arg().abs() / period, root.norm().ln().abs() / period),
            };
            let width = width.max(1e-9 * place);
            let steps = [0.0, 0.3, 1.0, 3.0, 10.0, 30.0];
            points.extend(steps.iter().flat_map(|x| [place - x * width, place + x * width]));
        }
        points.retain(|w| (low..=high).contains(w));
        points.sort_by(f64::total_cmp);
        let sizes: Vec<f64> = points.iter().map(|w| self.at(*w, 0.0).value[0]).collect();
        let mut least: Vec<usize> = (0..points.len()).collect();
        least.sort_by(|i, j| sizes[*i].total_cmp(&sizes[*j]));
        let narrow = |i: usize| {
            let mut low = points[i.saturating_sub(1)];
            let mut high = points[(i + 1).min(points.len() - 1)];
            let golden = (5f64.sqrt() - 1.0) / 2.0;
            for _ in 0..60 {
                let (left, right) = (high - golden * (high - low), low + golden * (high - low));
                if self.at(left, 0.0).value[0] < self.at(right, 0.0).value[0] {
                    high = right;
                } else {
                    low = left;
                }
            }
            (low + high) / 2.0
        };
        least.into_iter().take(5).map(narrow).collect()
    }
}

/// Kind of a crossing.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// The magnitude is 1.
    Gain,
    /// The value is real.
    Phase,
}

impl Kind {
    /// Returns a number that changes its sign at a crossing.
    fn height(self, gain: Complex) -> f64 {
        match self {
            Kind::Gain => gain.norm().max(1e-300).ln(),
            Kind::Phase => gain.im / gain.norm(),
        }
    }

    /// Returns where the sign changes between two frequencies: bisection and secant in turn (Illinois), to rounding.
    fn between(self, model: &Model, (mut low, mut f_low): (f64, f64), high: (f64, f64)) -> f64 {
        let (mut high, mut f_high) = high;
        let mut last = 0;
        for step in 0..200 {
            if high - low <= 2.0 * f64::EPSILON * high {
                break;
            }
            let mut w = (low * f_high - high * f_low) / (f_high - f_low);
            if step % 3 == 2 || !(w > low && w < high) {
                w = (low + high) / 2.0;
                if w <= low || w >= high {
                    break;
                }
            }
            let f = self.height(model.gain(w));
            if f == 0.0 {
                return w;
            }
            if (f > 0.0) == (f_high > 0.0) {
                (high, f_high) = (w, f);
                f_low *= if last == 1 { 0.5 } else { 1.0 };
                last = 1;
            } else {
                (low, f_low) = (w, f);
                f_high *= if last == -1 { 0.5 } else { 1.0 };
                last = -1;
            }
        }
        if f_low.abs() < f_high.abs() { low } else { high }
    }
}

/// Numbers of states, inputs and outputs.
type Size = (usize, usize, usize);
/// A crossing: whether it is one of the gain, ω in rad/s, real and imaginary part of the loop gain.
type Crossing = (bool, f64, f64, f64);

fn search(
    model: &Model,
    [poles, zeros, closed]: [&[Complex]; 3],
    low: f64,
    high: f64,
) -> (Vec<Crossing>, f64) {
    let ratio = (high / low).powf(1.0 / (GRID - 1) as f64);
    let mut grid: Vec<f64> = (0..GRID).map(|k| low * ratio.powi(k as i32)).collect();
    grid[GRID - 1] = high;
    let mut found = Vec::new();
    let mut nearest = f64::INFINITY;
    let mut add = |kind: Kind, w: f64, gain: Complex| {
        let is = kind == Kind::Gain || (gain.re < 0.0 && gain.norm() > NOTHING);
        if is && gain.norm() < INTEGRATOR {
            found.push((kind == Kind::Gain, w, gain.re, gain.im));
        }
    };
    let shape = Shape::new([zeros, poles], model.period, &grid, |w| model.gain(w));
    let kinds = [Kind::Gain, Kind::Phase];
    let mut ends = grid.clone();
    ends.extend(kinds.iter().flat_map(|kind| shape.isolate(*kind, &grid)));
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    let mut before: Option<(f64, Complex)> = None;
    for w in ends {
        let gain = model.gain(w);
        if !gain.is_finite() || gain.norm() < 1e-300 {
            continue;
        }
        nearest = nearest.min((gain + Complex::new(1.0, 0.0)).norm());
        if let Some((low, at_low)) = before {
            for kind in kinds {
                let heights = [kind.height(at_low), kind.height(gain)];
                if (heights[0] > 0.0) == (heights[1] > 0.0) {
                    continue;
                }
                let w = kind.between(model, (low, heights[0]), (w, heights[1]));
                let gain = model.gain(w);
                if kind.height(gain).abs() <= 1e-6 {
                    add(kind, w, gain);
                }
            }
        }
        before = Some((w, gain));
    }
    // where the gain is real in any case
    let ends = [
        0.0,
        if model.period == 0.0 { f64::INFINITY } else { std::f64::consts::PI / model.period },
    ];
    for w in ends.into_iter().filter(|w| w.is_finite()) {
        let gain = model.gain(w);
        if gain.is_finite() {
            nearest = nearest.min((gain + Complex::new(1.0, 0.0)).norm());
            add(Kind::Phase, w, Complex::new(gain.re, 0.0));
        }
    }
    let one = Complex::new(1.0, 0.0);
    let return_difference =
        Shape::new([closed, poles], model.period, &grid, |w| model.gain(w) + one);
    for w in return_difference.minima(&grid) {
        let distance = (model.gain(w) + one).norm();
        if distance.is_finite() {
            nearest = nearest.min(distance);
        }
    }
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    (found, nearest)
}

/// Reads matrices A, B, C, D of numpy.
fn matrices(of: [&Bound<PyAny>; 4]) -> PyResult<([Vec<f64>; 4], Size)> {
    let [a, b, c, d] = of.map(numbers);
    let (a, b, c, d) = (a?, b?, c?, d?);
    let shape = PyBuffer::<f64>::get(of[3])?.shape().to_vec();
    let &[outputs, inputs] = &shape[..] else {
        return Err(PyValueError::new_err("D must be a matrix"));
    };
    let states = a.len().isqrt();
    if [a.len(), b.len(), c.len()] != [states * states, states * inputs, outputs * states] {
        return Err(PyValueError::new_err("A, B, C, D do not fit each other"));
    }
    Ok(([a, b, c, d], (states, inputs, outputs)))
}

fn pairs(of: &Bound<PyAny>) -> PyResult<Vec<Complex>> {
    let parts = numbers(of)?;
    Ok(parts.chunks_exact(2).map(|part| Complex::new(part[0], part[1])).collect())
}

#[pymethods]
impl Model {
    /// Takes A, B, C, D, and the period of a sampled model in s, 0 in continuous time.
    ///
    /// # Errors
    /// If the matrices do not fit each other.
    #[new]
    fn read(
        a: &Bound<PyAny>,
        b: &Bound<PyAny>,
        c: &Bound<PyAny>,
        d: &Bound<PyAny>,
        period: f64,
    ) -> PyResult<Model> {
        let (matrices, size) = matrices([a, b, c, d])?;
        Ok(Model::new(matrices, size, period))
    }

    /// Returns the crossings of a loop gain with one input between `low` and `high`, rad/s, and its least distance to -1.
    ///
    /// `roots`: poles and zeros of the gain, poles of the closed loop, each as pairs of numbers.
    ///
    /// # Errors
    /// If the model has several inputs or outputs.
    fn crossings(
        &self,
        py: Python,
        roots: [Bound<PyAny>; 3],
        low: f64,
        high: f64,
    ) -> PyResult<(Vec<Crossing>, f64)> {
        if (self.inputs, self.outputs) != (1, 1) || !(low > 0.0 && high > low) {
            let expected = "one input, one output and 0 < low < high are expected";
            return Err(PyValueError::new_err(expected));
        }
        let [poles, zeros, closed] = roots.each_ref().map(pairs);
        let (poles, zeros, closed) = (poles?, zeros?, closed?);
        Ok(py.detach(|| search(self, [&poles, &zeros, &closed], low, high)))
    }

    /// Returns C (sI − A)⁻¹ B + D at frequencies in rad/s: real and imaginary parts, frequency by frequency, row after row.
    ///
    /// # Errors
    /// If the frequencies are no array of floats.
    fn response(&self, py: Python, frequencies: &Bound<PyAny>) -> PyResult<Vec<f64>> {
        let frequencies = numbers(frequencies)?;
        let parts = |w: &f64| self.at(*w).into_iter().flat_map(|value| [value.re, value.im]);
        Ok(py.detach(|| frequencies.iter().flat_map(parts).collect()))
    }
}
