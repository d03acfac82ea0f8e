//! Power series in time: x(t) = x_0 + x_1 t + x_2 t^2 + ...
//!
//! The plant's equations are written once, as rules for coefficient n of each
//! quantity from the coefficients up to n of the quantities it depends on.
//! Order 0 of such a rule is the quantity itself at an instant; all orders
//! together are the Taylor expansion that the integrator steps with; order 1
//! along a direction is the directional derivative.
//!
//! Source of the rules: the product (Cauchy) rule, and for f(u) the differential
//! equation that f satisfies; see Jorba & Zou, Experimental Mathematics 14 (2005).

/// The highest order kept.
pub const ORDER: usize = 18;

/// The highest order used where the specific force changes.
pub const RAMP_ORDER: usize = 10;

/// Coefficients 0 to [`ORDER`].
pub type Series = [f64; ORDER + 1];

/// All coefficients zero.
pub const ZERO: Series = [0.0; ORDER + 1];

/// 1/n
const RECIPROCAL: [f64; ORDER + 2] = {
    let (mut table, mut n) = ([0.0; ORDER + 2], 1);
    while n <= ORDER + 1 {
        table[n] = 1.0 / n as f64;
        n += 1;
    }
    table
};

// The rules are always inlined: where the order n is a constant the compiler writes every sum
// out (`for_each_order`), elsewhere they are loops.

/// Coefficient n of a constant: the constant itself at order 0, then nothing.
#[inline(always)]
pub fn constant(n: usize, a: f64) -> f64 {
    if n == 0 { a } else { 0.0 }
}

/// Coefficient n + 1 of x from coefficient n of x'.
#[inline(always)]
pub fn next(n: usize, rate: f64) -> f64 {
    rate * RECIPROCAL[n + 1]
}

// Each sum has its newest coefficients, number n, last: they come out of other sums of this
// order, and a processor adds up the rest while it waits for them. Where a rule is a loop, its
// slices spare the processor a check of every index.

/// Sum of `term(j)` over 0 <= j <= n, ends last.
#[inline(always)]
fn sum(n: usize, term: impl Fn(usize) -> f64) -> f64 {
    // -0 is what no sum changes by.
    let sum = (1..n).fold(-0.0, |sum, j| sum + term(j)) + term(0);
    if n == 0 { sum } else { sum + term(n) }
}

/// As [`sum`], for vectors.
#[inline(always)]
fn sum_pair(n: usize, term: impl Fn(usize) -> [f64; 2]) -> [f64; 2] {
    let add = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
    let sum = add((1..n).fold([-0.0; 2], |sum, j| add(sum, term(j))), term(0));
    if n == 0 { sum } else { add(sum, term(n)) }
}

/// Coefficient n of a b: sum of a_j b_(n-j).
#[inline(always)]
pub fn mul(n: usize, a: &Series, b: &Series) -> f64 {
    let (a, b) = (&a[..=n], &b[..=n]);
    sum(n, |j| a[j] * b[n - j])
}

/// Coefficients of a vector in the plane: two series that most rules treat alike, so
/// that a processor does both at once, from memory aligned for it.
#[derive(Clone, Debug)]
#[repr(align(16))]
pub struct Pair([[f64; 2]; ORDER + 1]);

/// Both series zero.
pub const ZERO_PAIR: Pair = Pair([[0.0; 2]; ORDER + 1]);

impl core::ops::Index<usize> for Pair {
    type Output = [f64; 2];

    #[inline(always)]
    fn index(&self, n: usize) -> &[f64; 2] {
        &self.0[n]
    }
}

impl core::ops::IndexMut<usize> for Pair {
    #[inline(always)]
    fn index_mut(&mut self, n: usize) -> &mut [f64; 2] {
        &mut self.0[n]
    }
}

/// Coefficient n of a b, b a vector.
#[inline(always)]
pub fn scale(n: usize, a: &Series, b: &Pair) -> [f64; 2] {
    let (a, b) = (&a[..=n], &b.0[..=n]);
    sum_pair(n, |j| [a[j] * b[n - j][0], a[j] * b[n - j][1]])
}

/// Coefficient n of a b_i, b a vector.
#[inline(always)]
pub fn mul_part(n: usize, a: &Series, b: &Pair, i: usize) -> f64 {
    let (a, b) = (&a[..=n], &b.0[..=n]);
    sum(n, |j| a[j] * b[n - j][i])
}

/// Coefficient n of a b, b a vector, without its term a_n b_0.
#[inline(always)]
pub fn scale_head(n: usize, a: &Series, b: &Pair) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for (a, b) in a[..n].iter().zip(b.0[1..=n].iter().rev()) {
        sum = [sum[0] + a * b[0], sum[1] + a * b[1]];
    }
    sum
}

/// Coefficient n of a b_i, b a vector, without its term a_n b_0.
#[inline(always)]
pub fn mul_part_head(n: usize, a: &Series, b: &Pair, i: usize) -> f64 {
    let mut sum = 0.0;
    for (a, b) in a[..n].iter().zip(b.0[1..=n].iter().rev()) {
        sum += a * b[i];
    }
    sum
}

/// Coefficient n of (a_1 b_1, a_2 b_2).
#[inline(always)]
pub fn each(n: usize, a: &Pair, b: &Pair) -> [f64; 2] {
    let (a, b) = (&a.0[..=n], &b.0[..=n]);
    sum_pair(n, |j| [a[j][0] * b[n - j][0], a[j][1] * b[n - j][1]])
}

/// Coefficient n of (a_1^2, a_2^2).
#[inline(always)]
pub fn squares(n: usize, a: &Pair) -> [f64; 2] {
    let mut half = [0.0; 2];
    for j in (0..n.div_ceil(2)).rev() {
        half = [half[0] + a[j][0] * a[n - j][0], half[1] + a[j][1] * a[n - j][1]];
    }
    let middle = if n.is_multiple_of(2) { a[n / 2].map(|x| x * x) } else { [0.0; 2] };
    [2.0 * half[0] + middle[0], 2.0 * half[1] + middle[1]]
}

/// Coefficient n of a.b.
#[inline(always)]
pub fn dot(n: usize, a: &Pair, b: &Pair) -> f64 {
    let [x, y] = each(n, a, b);
    x + y
}

/// The values at t of several vectors cut after order n.
#[inline(always)]
pub fn values_pair<const K: usize>(a: [&Pair; K], n: usize, t: f64) -> [[f64; 2]; K] {
    let n = n.min(ORDER);
    let mut sums = [[0.0; 2]; K];
    for j in (0..=n).rev() {
        for k in 0..K {
            let [x, y] = a[k][j];
            sums[k] = [sums[k][0] * t + x, sums[k][1] * t + y];
        }
    }
    sums
}

/// Coefficient n of a b without its term a_0 b_n.
#[inline(always)]
pub fn mul_tail(n: usize, a: &Series, b: &Series) -> f64 {
    let mut sum = 0.0;
    for (a, b) in a[1..=n].iter().zip(b[..n].iter().rev()) {
        sum += a * b;
    }
    sum
}

/// Coefficient n of a^2.
#[inline(always)]
pub fn square(n: usize, a: &Series) -> f64 {
    if n == 0 {
        return a[0] * a[0];
    }
    let mut half = 0.0;
    for j in 1..n.div_ceil(2) {
        half += a[j] * a[n - j];
    }
    let middle = if n.is_multiple_of(2) { a[n / 2] * a[n / 2] } else { 0.0 };
    2.0 * (half + a[0] * a[n]) + middle
}

/// Coefficient n of (ramp) a, where the ramp is `ramp[0] + ramp[1] t`.
#[inline(always)]
pub fn mul_ramp(n: usize, ramp: &[f64; 2], a: &Series) -> f64 {
    if n == 0 { ramp[0] * a[0] } else { ramp[0] * a[n] + ramp[1] * a[n - 1] }
}

/// Coefficient n >= 1 of f where f' = g u', from u's coefficient n and g's below n;
/// `u_d` keeps the coefficients of u'.
#[inline(always)]
pub fn chain(n: usize, u: f64, u_d: &mut Series, g: &Series) -> f64 {
    u_d[n - 1] = n as f64 * u;
    let mut before = 0.0;
    for (u_d, g) in u_d[..n - 1].iter().zip(g[1..n].iter().rev()) {
        before += u_d * g;
    }
    before * RECIPROCAL[n] + u * g[0]
}

/// Coefficient n of (sin a, cos a), from a's coefficient n and theirs below n; `a_d` keeps
/// the coefficients of a'.
#[inline(always)]
pub fn sin_cos(n: usize, a: f64, a_d: &mut Series, s: &Series, c: &Series) -> (f64, f64) {
    if n == 0 { libm::sincos(a) } else { (chain(n, a, a_d, c), -chain(n, a, a_d, s)) }
}

/// Does something with `$n` as the constants 0, 1, ... [`ORDER`] - 1, in turn.
macro_rules! for_each_order {
    ($n:ident => $do:block) => {
        for_each_order!($n => $do; 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17)
    };
    ($n:ident => $do:block; $($order:literal)*) => {
        $({
            let $n = $order;
            $do
        })*
    };
}
pub(crate) use for_each_order;

/// The values at t of several series cut after order n.
#[inline(always)]
pub fn values<const K: usize>(a: [&Series; K], n: usize, t: f64) -> [f64; K] {
    let n = n.min(ORDER);
    let mut sums = [0.0; K];
    for j in (0..=n).rev() {
        for k in 0..K {
            sums[k] = sums[k] * t + a[k][j];
        }
    }
    sums
}

/// The integrals from 0 to t of several series cut after order n.
#[inline(always)]
pub fn integrals<const K: usize>(a: [&Series; K], n: usize, t: f64) -> [f64; K] {
    let n = n.min(ORDER);
    let mut sums = [0.0; K];
    for j in (0..=n).rev() {
        for k in 0..K {
            sums[k] = sums[k] * t + a[k][j] * RECIPROCAL[j + 1];
        }
    }
    sums.map(|sum| sum * t)
}

/// The first t in (0, h] at which the polynomial `a`, positive at t = 0, has
/// fallen to zero; `None` when it stays positive.
///
/// From a point where the value is f > 0 and the slope f', a bound M on |f''|
/// over [0, h] gives f(t + s) >= f + f' s - M s^2 / 2. The root of that parabola
/// is a step that cannot pass the first zero, and it converges to it
/// quadratically, as Newton's does.
pub fn first_root(a: &[f64], h: f64) -> Option<f64> {
    let (mut power, mut lowest) = (1.0, a[0]);
    for x in &a[1..] {
        power *= h;
        lowest += f64::min(0.0, x * power);
    }
    if lowest > 0.0 {
        return None;
    }
    let (mut power, mut bend) = (1.0, 0.0);
    for (j, x) in a.iter().enumerate().skip(2) {
        bend += (j * (j - 1)) as f64 * x.abs() * power;
        power *= h;
    }
    let mut t = 0.0;
    // Far from a tangency some five steps do; the limit only bounds the work.
    for _ in 0..200 {
        let (mut f, mut slope) = (0.0, 0.0);
        for x in a.iter().rev() {
            slope = slope * t + f;
            f = f * t + x;
        }
        if f <= 0.0 {
            return Some(t);
        }
        let fall = libm::sqrt(slope * slope + 2.0 * bend * f) - slope;
        // Straight and not falling.
        if fall <= 0.0 {
            return None;
        }
        let next = t + 2.0 * f / fall;
        if next > h || next.is_nan() {
            return None;
        }
        if next == t {
            return Some(t);
        }
        t = next;
    }
    Some(t)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// u(t) = 0.3 + t - t^2/2
    fn u(n: usize) -> f64 {
        [0.3, 1.0, -0.5].get(n).copied().unwrap_or(0.0)
    }

    // At t = 0.1 what is cut off is below rounding; a few ulp remain.
    const ULPS: f64 = 4e-16;

    #[test]
    fn exp_of_a_series_is_the_series_of_exp() {
        let (mut e, mut u_d) = (ZERO, ZERO);
        for n in 0..ORDER {
            e[n] = if n == 0 { f64::exp(u(0)) } else { chain(n, u(n), &mut u_d, &e) };
        }
        assert!((values([&e], ORDER, 0.1)[0] - f64::exp(0.395)).abs() < 4.0 * ULPS);
    }

    #[test]
    fn sin_and_cos_of_a_series_are_the_series_of_sin_and_cos() {
        let (mut s, mut c, mut u_d) = (ZERO, ZERO, ZERO);
        for n in 0..ORDER {
            (s[n], c[n]) = sin_cos(n, u(n), &mut u_d, &s, &c);
            let one = square(n, &s) + mul(n, &c, &c);
            assert!((one - constant(n, 1.0)).abs() < ULPS);
        }
        assert!((values([&s], ORDER, 0.1)[0] - f64::sin(0.395)).abs() < ULPS);
        assert!((values([&c], ORDER, 0.1)[0] - f64::cos(0.395)).abs() < ULPS);
    }

    #[test]
    fn first_root_finds_the_first_of_two_close_roots() {
        // (t - 0.5)(t - 0.5001)(t - 0.9), negated to start positive
        let (a, b, c) = (0.5, 0.5001, 0.9);
        let p = [a * b * c, -(a * b + b * c + c * a), a + b + c, -1.0];
        // The root's condition: rounding 1e-16 over the slope 4e-5.
        assert!((first_root(&p, 1.0).unwrap() - 0.5).abs() < 1e-11);
        assert_eq!(first_root(&p, 0.4999), None);
    }

    #[test]
    fn first_root_passes_over_a_minimum_that_stays_positive() {
        // (t - 0.5)^2 + 1e-9
        assert_eq!(first_root(&[0.25 + 1e-9, -1.0, 1.0], 1.0), None);
        assert_eq!(first_root(&[1.0, 0.0, 0.0], 1.0), None);
    }
}
