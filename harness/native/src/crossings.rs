//! Finds the crossings of a loop gain L(jω): the frequencies at which |L| is 1 (gain crossings) or L is a negative real number
//! (phase crossings), and the least distance of L from -1.
//!
//! The search uses the fact that ln L is a sum over the poles and zeros of L. For any interval of frequencies this sum
//! gives the value and the slope of ln L and a bound of its curvature. From these follows if L can cross in the interval
//! not at all, at most once, or several times; in the last case the interval is halved. At the ends of the remaining
//! intervals L itself is evaluated from the state-space model, and the crossings between them are located by root finding.

use nalgebra::allocator::Allocator;
use nalgebra::{Const, DMatrix, DefaultAllocator, DimDiff, DimSub, Dyn, OMatrix, Schur, U1};
use num_complex::Complex64 as Complex;
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::numbers::numbers;
use crate::schedule::bytes;

/// Loop gain above which phase crossings are not searched. So large a gain occurs only close to a pole on the imaginary axis, for
/// example at an integrator's pole at 0.
const MOST_GAIN: f64 = 1e8;
/// Loop gain below which no phase crossing is searched, because a value this small consists of
/// rounding errors.
const LEAST_GAIN: f64 = 1e-12;
/// Allowed error of ln L, the logarithm of the loop gain. Its poles and zeros are eigenvalues computed with rounding
/// errors.
const SLACK: f64 = 1e-3;
/// Number of frequencies, evenly spaced on a logarithmic scale, with which every search begins.
const GRID: usize = 40;
const MOST: usize = 5_000;

/// A state-space model whose matrix A is in Hessenberg form. Therefore the number of operations for the response at
/// one frequency is proportional to n² (n states) and not to n³. Matrices are stored row after row.
#[pyclass(frozen, module = "hubslosh")]
pub struct Model {
    states: usize,
    inputs: usize,
    outputs: usize,
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
    d: Vec<f64>,
    period: f64,
    /// For a model with one input and one output: A stored column after column. The states are chosen so that B is a multiple of
    /// the first unit vector, which [`Model::gain`] uses.
    columns: Vec<f64>,
}

impl Model {
    fn new([a, b, c, d]: [Vec<f64>; 4], (states, inputs, outputs): Size, period: f64) -> Model {
        let mut model = Model { states, inputs, outputs, a, b, c, d, period, columns: Vec::new() };
        let is_scalar = (inputs, outputs) == (1, 1);
        if is_scalar && states > 0 {
            model.reflect(0, model.b.clone());
        }
        for k in 1..states.saturating_sub(1) {
            model.reflect(k, (k..states).map(|i| model.a[i * states + k - 1]).collect());
        }
        if is_scalar {
            let n = states;
            model.columns = (0..n * n).map(|at| model.a[at % n * n + at / n]).collect();
        }
        model
    }

    /// Changes the basis of the states from number `k` on by a Householder reflection, which maps
    /// the vector `v` of these states to a multiple of their first unit vector.
    fn reflect(&mut self, k: usize, mut v: Vec<f64>) {
        let n = self.states;
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

    /// Returns the response matrix at the frequency `w`, rad/s, row after row. At a pole the numbers are NaN or infinite.
    fn at(&self, w: f64) -> Vec<Complex> {
        let (n, m) = (self.states, self.inputs);
        let s = point(w, self.period);
        // the matrices sI − A and B, with real and imaginary parts in separate arrays, of which a processor computes
        // several elements at once
        let width = n + m;
        let mut rows = [vec![0.0; n * width], vec![0.0; n * width]];
        let [re, im] = &mut rows;
        for i in 0..n {
            let from = i.saturating_sub(1);
            for (x, a) in re[i * width + from..].iter_mut().zip(&self.a[i * n..][from..n]) {
                *x = -a;
            }
            re[i * width + i] += s.re;
            im[i * width + i] = s.im;
            re[i * width + n..][..m].copy_from_slice(&self.b[i * m..][..m]);
        }
        for k in 0..n.saturating_sub(1) {
            let [(re_a, re_b), (im_a, im_b)] = rows.each_mut().map(|of| {
                let (upper, lower) = of[k * width..][..2 * width].split_at_mut(width);
                (&mut upper[k..], &mut lower[k..])
            });
            let (mut a, mut b) = (Complex::new(re_a[0], im_a[0]), Complex::new(re_b[0], im_b[0]));
            if a.norm_sqr() < b.norm_sqr() {
                re_a.swap_with_slice(re_b);
                im_a.swap_with_slice(im_b);
                (a, b) = (b, a);
            }
            if b != Complex::ZERO {
                let factor = b / a;
                let upper = re_a.iter().zip(im_a.iter());
                for ((x, y), (re, im)) in re_b.iter_mut().zip(im_b.iter_mut()).zip(upper) {
                    *x -= factor.re * re - factor.im * im;
                    *y -= factor.re * im + factor.im * re;
                }
            }
        }
        // Elimination column by column, from the last one on. The right-hand sides become the states.
        let [mut re, mut im] = rows;
        let mut states = vec![Complex::ZERO; m];
        let mut found: Vec<Complex> = self.d.iter().map(|d| Complex::new(*d, 0.0)).collect();
        for i in (0..n).rev() {
            let pivot = Complex::new(re[i * width + i], im[i * width + i]);
            for (j, state) in states.iter_mut().enumerate() {
                let at = i * width + n + j;
                *state = Complex::new(re[at], im[at]) / pivot;
            }
            for (re, im) in re.chunks_exact_mut(width).zip(im.chunks_exact_mut(width)).take(i) {
                let a = Complex::new(re[i], im[i]);
                for (j, state) in states.iter().enumerate() {
                    re[n + j] -= a.re * state.re - a.im * state.im;
                    im[n + j] -= a.re * state.im + a.im * state.re;
                }
            }
            for (k, row) in found.chunks_exact_mut(m).enumerate() {
                let c = self.c[k * n + i];
                for (sum, state) in row.iter_mut().zip(&states) {
                    *sum += *state * c;
                }
            }
        }
        found
    }

    /// Returns the response of a model with one input and one output at the frequency `w`, rad/s; it is NaN or infinite at a
    /// pole.
    ///
    /// Column operations from the last column on turn sI − A into an upper triangular matrix; of two possible pivots the larger
    /// one is used. Since only the first component of B differs from 0, the response then follows from the first column. `column`
    /// is working memory, so that a call allocates nothing.
    fn gain(&self, w: f64, column: &mut Vec<Complex>) -> Complex {
        let n = self.states;
        let s = point(w, self.period);
        let whole = |k: usize, i: usize| {
            let a = Complex::new(-self.columns[k * n + i], 0.0);
            if i == k { a + s } else { a }
        };
        let Some(last) = n.checked_sub(1) else { return Complex::new(self.d[0], 0.0) };
        column.clear();
        column.extend((0..n).map(|i| whole(last, i)));
        let mut c = Complex::new(self.c[last], 0.0);
        for k in (0..last).rev() {
            let (below, pivot) = (-self.columns[k * n + k + 1], column[k + 1]);
            let a = &self.columns[k * n..][..k + 1];
            if below * below > pivot.norm_sqr() {
                let factor = pivot * (1.0 / below);
                for (x, a) in column.iter_mut().zip(a) {
                    *x += factor * *a;
                }
                column[k] -= factor * s;
                c -= factor * self.c[k];
            } else if below != 0.0 {
                let factor = -below / pivot;
                for (x, a) in column.iter_mut().zip(a) {
                    *x = Complex::new(
                        factor.re * x.re - factor.im * x.im - a,
                        factor.re * x.im + factor.im * x.re,
                    );
                }
                column[k] += s;
                c = c * factor + self.c[k];
            } else {
                column.clear();
                column.extend((0..=k).map(|i| whole(k, i)));
                c = Complex::new(self.c[k], 0.0);
            }
        }
        c / column[0] * self.b[0] + self.d[0]
    }

    /// Returns the eigenvalues of the response matrix at the frequency `w`, rad/s, sorted by magnitude; they are very large at a
    /// pole.
    fn eigenvalues(&self, w: f64) -> Vec<Complex> {
        self.eigenvalues_of(self.at(w))
    }

    fn eigenvalues_of(&self, mut response: Vec<Complex>) -> Vec<Complex> {
        for value in response.iter_mut().filter(|value| !value.is_finite()) {
            *value = Complex::new(1e300, 0.0);
        }
        let mut found = eigenvalues(response, self.inputs);
        found.sort_by(|a, b| a.norm_sqr().total_cmp(&b.norm_sqr()));
        found
    }
}

/// Returns the eigenvalues of an n × n matrix that is stored row after row.
///
/// The matrices of up to three inputs have their size at compile time, so that Schur's form needs no memory and takes half the
/// time: the search of a delay margin computes the eigenvalues some 300 times.
fn eigenvalues(a: Vec<Complex>, n: usize) -> Vec<Complex> {
    match n {
        1 => a,
        2 => diagonal_of_schur(&a, Const::<2>),
        3 => diagonal_of_schur(&a, Const::<3>),
        _ => diagonal_of_schur(&a, Dyn(n)),
    }
}

/// Returns the diagonal of Schur's form of the matrix `a` of size `n`, or of the matrix itself if its iteration does not converge.
fn diagonal_of_schur<D: DimSub<U1>>(a: &[Complex], n: D) -> Vec<Complex>
where
    DefaultAllocator:
        Allocator<D, D> + Allocator<D, DimDiff<D, U1>> + Allocator<DimDiff<D, U1>> + Allocator<D>,
{
    // The matrix is scaled, because the squares of very large numbers overflow.
    let size = a.iter().map(|x| x.norm()).fold(f64::MIN_POSITIVE, f64::max);
    let matrix =
        OMatrix::<Complex, D, D>::from_row_iterator_generic(n, n, a.iter().map(|x| x / size));
    let triangle = match Schur::try_new(matrix.clone(), f64::EPSILON, 1000) {
        Some(schur) => schur.unpack().1,
        None => matrix,
    };
    triangle.diagonal().iter().map(|x| x * size).collect()
}

/// Returns the variable of the transfer function at the frequency `w`, rad/s: s = jω, or z = exp(jωT) for a sampled model with
/// the period T.
fn point(w: f64, period: f64) -> Complex {
    if period == 0.0 {
        return Complex::new(0.0, w);
    }
    let (sin, cos) = (w * period).sin_cos();
    Complex::new(cos, sin)
}

struct Root {
    at: Complex,
    is_zero: bool,
    /// Distance of the root from the stability boundary: the imaginary axis, or the unit circle of a sampled model.
    axis: f64,
    /// Factors of two bounds of the second derivative of ln L. At a point whose distance from the root is d the
    /// bounds are `bends[0]`/d² and `bends[1]`/d³.
    bends: [f64; 2],
}

impl Root {
    fn new(at: Complex, is_zero: bool, period: f64) -> Root {
        let (axis, bends) = match period {
            0.0 => (at.re.abs(), [1.0, 2.0 * at.re.abs()]),
            _ => {
                let size = at.norm_sqr().sqrt();
                let axis = (1.0 - size).abs();
                (axis, [size, size.sqrt() * axis * (1.0 + size)])
            }
        };
        Root { at, is_zero, axis, bends }
    }
}

/// A zero of the loop gain and the nearest pole that is not paired with another zero. If they are close to each
/// other, their effects on ln L nearly cancel. The common bound of their curvature is then much smaller than the sum
/// of two separate bounds.
struct Pair {
    /// Number of roots in the pair: 2 for a zero with its pole, 1 for a zero or a pole without a partner.
    roots: usize,
    /// Half the distance between zero and pole. The common bound of the curvature of both is `steep` divided by the
    /// cube of the distance from them.
    half_gap: f64,
    steep: f64,
}

/// A rational function, given by its poles, its zeros and a constant factor.
struct Shape {
    /// Poles and zeros of the function. The roots of the first entry of `pairs` come first, then the roots of the
    /// second entry, and so on.
    roots: Vec<Root>,
    pairs: Vec<Pair>,
    /// Constant factor of the function: logarithm of its magnitude, and its phase, rad.
    factor: (f64, f64),
    period: f64,
}

/// The logarithm of the loop gain L at one frequency, its derivative with respect to the frequency ω, and a bound of
/// its second derivative. Each is a pair: real part (ln |L|) and imaginary part (phase, rad).
struct Logarithm {
    value: [f64; 2],
    slope: [f64; 2],
    curvature: [f64; 2],
}

/// A product of many complex numbers. Before its magnitude overflows or underflows, the magnitude is moved to the
/// logarithm `scale`.
struct Product {
    of: Complex,
    scale: f64,
}

impl Product {
    fn new() -> Product {
        Product { of: Complex::new(1.0, 0.0), scale: 0.0 }
    }

    #[inline(always)]
    fn times(&mut self, factor: Complex) {
        self.of *= factor;
        let size = self.of.re.abs().max(self.of.im.abs());
        if !(1e-100..1e100).contains(&size) && size > 0.0 {
            self.scale += size.ln();
            self.of *= 1.0 / size;
        }
    }
}

impl Shape {
    /// Creates the function from its zeros and poles. `exact` evaluates the loop gain from the state-space model. The constant
    /// factor is the median, over the frequencies of the grid, of the exact gain divided by the gain of the zeros and poles.
    fn new(
        [zeros, poles]: [&[Complex]; 2],
        period: f64,
        grid: &[f64],
        mut exact: impl FnMut(f64) -> Complex,
    ) -> Shape {
        let mut left = poles.to_vec();
        let (mut roots, mut pairs) = (Vec::new(), Vec::new());
        for zero in zeros {
            let distance = |i: &usize| (left[*i] - *zero).norm_sqr();
            let nearest = (0..left.len()).min_by(|i, j| distance(i).total_cmp(&distance(j)));
            roots.push(Root::new(*zero, true, period));
            let mut pair = Pair { roots: 1, half_gap: f64::INFINITY, steep: 0.0 };
            if let Some(pole) = nearest.map(|i| left.swap_remove(i)) {
                let gap = (*zero - pole).norm();
                let largest = zero.norm().max(pole.norm());
                let steep = if period == 0.0 { 2.0 } else { 1.0 + largest };
                pair = Pair { roots: 2, half_gap: gap / 2.0, steep: steep * gap };
                roots.push(Root::new(pole, false, period));
            }
            pairs.push(pair);
        }
        for pole in left {
            roots.push(Root::new(pole, false, period));
            pairs.push(Pair { roots: 1, half_gap: f64::INFINITY, steep: 0.0 });
        }
        let mut shape = Shape { roots, pairs, factor: (0.0, 0.0), period };
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

    /// Returns the logarithm of the loop gain L at the frequency `w`, rad/s, with its slope, and a bound of its
    /// curvature that holds at all frequencies within `half` of `w`.
    fn at(&self, w: f64, half: f64) -> Logarithm {
        let s = point(w, self.period);
        // ds/dω, and the distance by which s can move within `half`
        let (along, reach) = match self.period {
            0.0 => (Complex::new(0.0, 1.0), half),
            period => (Complex::new(0.0, period) * s, half * period),
        };
        let mut product = Product::new();
        let (mut sum, mut curvature) = (Complex::new(0.0, 0.0), [0.0; 2]);
        let mut roots = self.roots.iter();
        for pair in &self.pairs {
            let (mut bends, mut nearest) = ([0.0; 2], f64::INFINITY);
            for root in roots.by_ref().take(pair.roots) {
                let way = s - root.at;
                let square = way.norm_sqr();
                let share = 1.0 / square;
                let inverse = Complex::new(way.re * share, -way.im * share);
                // smallest distance from the part of the axis that s can reach
                let least = (square.sqrt() - reach).max(root.axis);
                let share = 1.0 / least;
                let near = root.bends[0] * share * share;
                bends[0] += near;
                // The phase of a root on the axis changes linearly with the frequency.
                bends[1] += near.min(root.bends[1] * share * share * share);
                nearest = nearest.min(least);
                if root.is_zero {
                    product.times(way);
                    sum += inverse;
                } else {
                    product.times(inverse);
                    sum -= inverse;
                }
            }
            // bound of the curvature from the derivative on the line between zero and pole
            let least = nearest - pair.half_gap;
            if least > 0.0 {
                let both = pair.steep / (least * least * least);
                bends = bends.map(|bend| bend.min(both));
            }
            curvature[0] += bends[0];
            curvature[1] += bends[1];
        }
        let unit = if self.period == 0.0 { 1.0 } else { self.period * self.period };
        let slope = along * sum;
        let Product { of, scale } = product;
        Logarithm {
            value: [self.factor.0 + scale + of.norm().ln(), self.factor.1 + of.arg()],
            slope: [slope.re, slope.im],
            curvature: curvature.map(|bound| bound * unit),
        }
    }

    /// Returns the logarithm of |L|², the squared magnitude of the loop gain, at the frequency `w`, rad/s. The
    /// constant factor of L is left out, because it does not change the frequencies of minima.
    fn size(&self, w: f64) -> f64 {
        let s = point(w, self.period);
        let (mut above, mut below) = (Product::new(), Product::new());
        for root in &self.roots {
            let square = Complex::new((s - root.at).norm_sqr(), 0.0);
            if root.is_zero { above.times(square) } else { below.times(square) }
        }
        above.scale + above.of.re.ln() - below.scale - below.of.re.ln()
    }

    /// Returns the ends of intervals of frequency that together contain all crossings; each interval contains at most one gain
    /// crossing and at most one phase crossing.
    fn isolate(&self, grid: &[f64]) -> Vec<f64> {
        let mut ends = Vec::new();
        let whole = grid.windows(2).map(|pair| (pair[0], pair[1], [true; 2]));
        let mut stack: Vec<(f64, f64, [bool; 2])> = whole.collect();
        for _ in 0..2 * MOST {
            let Some((low, high, wanted)) = stack.pop() else { break };
            let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
            let at = self.at(middle, half);
            let states = [Kind::Gain, Kind::Phase].map(|kind| at.look(kind, half, high));
            let found = |state: Look| (0..2).any(|i| wanted[i] && states[i] == state);
            if found(Look::Once) {
                ends.extend([low, high]);
            }
            if found(Look::Divide) {
                let left = [0, 1].map(|i| wanted[i] && states[i] == Look::Divide);
                stack.extend([(low, middle, left), (middle, high, left)]);
            }
        }
        ends.extend(stack.iter().flat_map(|(low, high, _)| [*low, *high]));
        ends
    }

    /// Returns the frequencies, rad/s, of the (at most five) lowest minima of |L|.
    fn minima(&self, grid: &[f64]) -> Vec<f64> {
        let mut points = grid.to_vec();
        let (low, high) = (grid[0], grid[grid.len() - 1]);
        for root in &self.roots {
            let root = root.at;
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
        let sizes: Vec<f64> = points.iter().map(|w| self.size(*w)).collect();
        let mut least: Vec<usize> = (0..points.len()).collect();
        least.sort_by(|i, j| sizes[*i].total_cmp(&sizes[*j]));
        let narrow = |i: usize| {
            let mut low = points[i.saturating_sub(1)];
            let mut high = points[(i + 1).min(points.len() - 1)];
            let golden = (5f64.sqrt() - 1.0) / 2.0;
            for _ in 0..60 {
                let (left, right) = (high - golden * (high - low), low + golden * (high - low));
                if self.size(left) < self.size(right) {
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

/// Number of crossings that an interval of frequencies can contain.
#[derive(Clone, Copy, PartialEq)]
enum Look {
    None,
    /// The interval contains at most one crossing.
    Once,
    /// The interval may contain several crossings, so that it must be halved.
    Divide,
}

impl Logarithm {
    /// Returns how many crossings of this `kind` are possible at frequencies that differ by at most `half` from the
    /// frequency at which this logarithm was evaluated. `high` is the highest frequency of the search; an interval
    /// that is very short compared with it is not halved further.
    fn look(&self, kind: Kind, half: f64, high: f64) -> Look {
        let Logarithm { value, slope, curvature } = *self;
        let reach = (slope[0].abs() + curvature[0] * half / 2.0) * half + SLACK;
        let outside = value[0] - reach > MOST_GAIN.ln() || value[0] + reach < LEAST_GAIN.ln();
        if kind == Kind::Phase && outside {
            return Look::None;
        }
        let (value, slope, bend) = match kind {
            Kind::Gain => (value[0], slope[0], curvature[0] * half),
            // a crossing can occur at the phase of a negative or of a positive real number
            Kind::Phase => {
                let turns = value[1] / std::f64::consts::PI;
                let value = (turns - turns.round()) * std::f64::consts::PI;
                (value, slope[1], curvature[1] * half)
            }
        };
        if value.abs() > slope.abs() * half + bend * half / 2.0 + SLACK {
            return Look::None;
        }
        let once = slope.abs() > bend * (1.0 + 1e-6)
            && (matches!(kind, Kind::Gain) || 2.0 * slope.abs() * half < 3.0);
        let level = (slope.abs() + bend) * half < 1e-13;
        if once || level || 2.0 * half < 1e-13 * high { Look::Once } else { Look::Divide }
    }
}

/// Kind of a crossing: at a gain crossing the loop gain has the magnitude 1, at a phase crossing it is real.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Gain,
    Phase,
}

impl Kind {
    /// Returns a function of the loop gain that changes its sign at a crossing of this kind: ln |L|, or the sine of the phase.
    fn height(self, gain: Complex) -> f64 {
        match self {
            Kind::Gain => gain.norm().max(1e-300).ln(),
            Kind::Phase => gain.im / gain.norm(),
        }
    }
}

/// Returns the argument between `a` and `b`, to rounding, at which the function `of` is 0; it must
/// have different signs at `a` and `b`. The method is inverse quadratic interpolation where that
/// converges, otherwise bisection (Chandrupatla 1997).
fn between(
    mut of: impl FnMut(f64) -> f64,
    (mut b, mut f_b): (f64, f64),
    (mut a, mut f_a): (f64, f64),
) -> f64 {
    let (mut c, mut f_c);
    let mut share = 0.5;
    for _ in 0..200 {
        let new = a + share * (b - a);
        let f = of(new);
        if f == 0.0 {
            return new;
        }
        // a and b enclose the root; c is the previous point
        if (f > 0.0) == (f_a > 0.0) {
            (c, f_c) = (a, f_a);
        } else {
            (c, b, f_c, f_b) = (b, a, f_b, f_a);
        }
        (a, f_a) = (new, f);
        let least = f64::EPSILON * a.abs().max(b.abs()) / (b - a).abs();
        if least >= 0.5 {
            break;
        }
        let (xi, phi) = ((a - b) / (c - b), (f_a - f_b) / (f_c - f_b));
        share = if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
            f_a / (f_b - f_a) * f_c / (f_b - f_c)
                + (c - a) / (b - a) * f_a / (f_c - f_a) * f_b / (f_c - f_b)
        } else {
            0.5
        };
        share = share.clamp(least, 1.0 - least);
    }
    if f_a.abs() < f_b.abs() { a } else { b }
}

type Size = (usize, usize, usize);
/// A crossing: true for a gain crossing and false for a phase crossing, frequency in rad/s, real and imaginary part of the loop
/// gain.
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
        let is = kind == Kind::Gain || (gain.re < 0.0 && gain.norm() > LEAST_GAIN);
        if is && gain.norm() < MOST_GAIN {
            found.push((kind == Kind::Gain, w, gain.re, gain.im));
        }
    };
    let mut column = Vec::with_capacity(model.states);
    let mut gain_at = |w: f64| model.gain(w, &mut column);
    let shape = Shape::new([zeros, poles], model.period, &grid, &mut gain_at);
    let kinds = [Kind::Gain, Kind::Phase];
    let mut ends = grid.clone();
    ends.extend(shape.isolate(&grid));
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    let mut before: Option<(f64, Complex)> = None;
    for w in ends {
        let gain = gain_at(w);
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
                let height = |w: f64| kind.height(gain_at(w));
                let w = between(height, (low, heights[0]), (w, heights[1]));
                let gain = gain_at(w);
                if kind.height(gain).abs() <= 1e-6 {
                    add(kind, w, gain);
                }
            }
        }
        before = Some((w, gain));
    }
    // frequencies at which the loop gain is real in any case
    let ends = [
        0.0,
        if model.period == 0.0 { f64::INFINITY } else { std::f64::consts::PI / model.period },
    ];
    for w in ends.into_iter().filter(|w| w.is_finite()) {
        let gain = gain_at(w);
        if gain.is_finite() {
            nearest = nearest.min((gain + Complex::new(1.0, 0.0)).norm());
            add(Kind::Phase, w, Complex::new(gain.re, 0.0));
        }
    }
    let one = Complex::new(1.0, 0.0);
    let return_difference = Shape::new([closed, poles], model.period, &grid, |w| gain_at(w) + one);
    for w in return_difference.minima(&grid) {
        let distance = (gain_at(w) + one).norm();
        if distance.is_finite() {
            nearest = nearest.min(distance);
        }
    }
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    (found, nearest)
}

/// Reads the matrices A, B, C and D from numpy arrays, and returns them with the numbers of states, inputs and outputs.
fn matrices(of: [&Bound<PyAny>; 4]) -> PyResult<([Vec<f64>; 4], Size)> {
    let [a, b, c, d] = of.map(numbers);
    let (a, b, c, d) = (a?, b?, c?, d?);
    let shape = PyBuffer::<f64>::get(of[3])?.shape().to_vec();
    let &[outputs, inputs] = &shape[..] else {
        return Err(PyValueError::new_err("D must be a matrix"));
    };
    let states = a.len().isqrt();
    if [a.len(), b.len(), c.len()] != [states * states, states * inputs, outputs * states] {
        return Err(PyValueError::new_err("the sizes of A, B, C and D do not fit each other"));
    }
    Ok(([a, b, c, d], (states, inputs, outputs)))
}

fn pairs(of: &Bound<PyAny>) -> PyResult<Vec<Complex>> {
    let parts = numbers(of)?;
    Ok(parts.chunks_exact(2).map(|part| Complex::new(part[0], part[1])).collect())
}

impl Model {
    fn must_be_square(&self) -> PyResult<()> {
        if self.inputs == self.outputs {
            return Ok(());
        }
        Err(PyValueError::new_err("the model must have as many inputs as outputs"))
    }

    fn unit_magnitudes(&self, nodes: &[f64]) -> Vec<(f64, f64, f64)> {
        let height = |values: &[Complex], i: usize| values[i].norm().max(1e-300).ln();
        // No eigenvalue is larger than the largest row sum of magnitudes, which takes less time to compute.
        let all: Vec<_> = nodes.iter().map(|w| (*w, self.at(*w))).collect();
        let is_small = |response: &[Complex]| {
            let mut rows = response.chunks_exact(self.inputs);
            rows.all(|row| row.iter().map(|x| x.norm()).sum::<f64>() < 1.0)
        };
        let mut found = Vec::new();
        let mut last: Option<(f64, Vec<Complex>)> = None;
        for pair in all.windows(2) {
            let [(low, at_low), (high, at_high)] = pair else { continue };
            if is_small(at_low) && is_small(at_high) {
                continue;
            }
            let at_low = match last.take() {
                Some((w, values)) if w == *low => values,
                _ => self.eigenvalues_of(at_low.clone()),
            };
            let at_high = self.eigenvalues_of(at_high.clone());
            for i in 0..self.inputs {
                let heights = [height(&at_low, i), height(&at_high, i)];
                if (heights[0] > 0.0) == (heights[1] > 0.0) {
                    continue;
                }
                let here = |w: f64| height(&self.eigenvalues(w), i);
                let w = between(here, (*low, heights[0]), (*high, heights[1]));
                let value = self.eigenvalues(w)[i];
                if (value.norm() - 1.0).abs() < 1e-6 {
                    found.push((w, value.re, value.im));
                }
            }
            last = Some((*high, at_high));
        }
        found
    }

    fn refined(&self, w: f64, delay: f64) -> (f64, f64) {
        let logarithm = |w: f64| {
            let turned = -Complex::cis(-w * delay);
            let all = self.eigenvalues(w).into_iter().map(|value| (value * turned).ln());
            all.min_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or(Complex::new(f64::NAN, 0.0))
        };
        let (mut before, mut after) = (w, w * (1.0 + 1e-6));
        let (mut at_before, mut at_after) = (logarithm(before), logarithm(after));
        for _ in 0..20 {
            if at_after.re == at_before.re || (after - before).abs() <= 1e-15 * after {
                break;
            }
            let slope = (at_after.re - at_before.re) / (after - before);
            let step = (-at_after.re / slope).clamp(-0.01 * w, 0.01 * w);
            (before, at_before, after) = (after, at_after, after + step);
            at_after = logarithm(after);
        }
        (after, at_after.im)
    }
}

#[pymethods]
impl Model {
    /// Creates a state-space model from A, B, C and D. `period` is the sampling period in s, or 0 for continuous time.
    ///
    /// # Errors
    /// If the sizes of the matrices do not fit each other.
    #[new]
    fn read(
        py: Python,
        a: &Bound<PyAny>,
        b: &Bound<PyAny>,
        c: &Bound<PyAny>,
        d: &Bound<PyAny>,
        period: f64,
    ) -> PyResult<Model> {
        let (matrices, size) = matrices([a, b, c, d])?;
        Ok(py.detach(|| Model::new(matrices, size, period)))
    }

    /// Returns the crossings of a loop gain with one input and one output between the frequencies `low` and `high`, rad/s, and
    /// its least distance from -1.
    ///
    /// `roots` has the zeros and the poles of the loop gain and the poles of the closed loop, each as a list of pairs (real part,
    /// imaginary part).
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

    /// Returns the frequencies, rad/s, at which an eigenvalue of the response matrix has the magnitude 1, each with the real and
    /// the imaginary part of the eigenvalue. The search looks for changes between neighbouring `nodes` (frequencies, rad/s), so
    /// that two crossings between the same nodes may be missed.
    ///
    /// # Errors
    /// If the numbers of inputs and outputs differ, or the nodes are no array of floats.
    fn unit_eigenvalues(&self, py: Python, nodes: &Bound<PyAny>) -> PyResult<Vec<(f64, f64, f64)>> {
        self.must_be_square()?;
        let nodes = numbers(nodes)?;
        Ok(py.detach(|| self.unit_magnitudes(&nodes)))
    }

    /// Returns a frequency near `w`, rad/s, at which −L exp(−jωτ) has an eigenvalue of magnitude 1 near 1, and the phase of this
    /// eigenvalue, rad. `delay` is τ, s.
    ///
    /// # Errors
    /// If the numbers of inputs and outputs differ.
    fn critical(&self, py: Python, w: f64, delay: f64) -> PyResult<(f64, f64)> {
        self.must_be_square()?;
        Ok(py.detach(|| self.refined(w, delay)))
    }

    /// Returns the response C (sI − A)⁻¹ B + D at `frequencies`, rad/s: pairs of real and imaginary part, one matrix after the
    /// other, each row after row.
    ///
    /// # Errors
    /// If the frequencies are no array of floats.
    fn response(&self, py: Python, frequencies: &Bound<PyAny>) -> PyResult<Vec<f64>> {
        let frequencies = numbers(frequencies)?;
        let parts = |w: &f64| self.at(*w).into_iter().flat_map(|value| [value.re, value.im]);
        Ok(py.detach(|| frequencies.iter().flat_map(parts).collect()))
    }
}

/// Return the exponentials of square matrices of `size` rows, which follow one another in an array, as the bytes of 64-bit floats.
#[pyfunction]
pub fn exponential<'py>(
    py: Python<'py>,
    matrices: &Bound<PyAny>,
    size: usize,
) -> PyResult<Bound<'py, PyBytes>> {
    let matrices = numbers(matrices)?;
    // The array stores rows where the algorithm expects columns. The exponential of the transposed matrix is the
    // transposed exponential.
    let power = |columns: &[f64]| {
        let matrix = DMatrix::from_column_slice(size, size, columns);
        let sum = matrix.abs().sum();
        analysis::exponential::exponential(matrix, sum, |matrix| matrix.exp())
    };
    let found: Vec<f64> = py.detach(|| {
        let each = matrices.chunks((size * size).max(1)).map(power);
        each.flat_map(|found| found.as_slice().to_vec()).collect()
    });
    Ok(bytes(py, &found))
}
