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

/// Coefficients 0 to [`ORDER`].
pub type Series = [f64; ORDER + 1];

/// All coefficients zero.
pub const ZERO: Series = [0.0; ORDER + 1];

// The order N is a constant of each rule, so that the compiler writes every sum out.

/// Coefficient N of a constant: the constant itself at order 0, then nothing.
#[inline(always)]
pub fn constant<const N: usize>(a: f64) -> f64 {
    if N == 0 { a } else { 0.0 }
}

/// Coefficient N + 1 of x from coefficient N of x'.
#[inline(always)]
pub fn next<const N: usize>(rate: f64) -> f64 {
    rate * const { 1.0 / (N + 1) as f64 }
}

// Each sum has its newest coefficients, number N, last: they come out of other sums of this
// order, and a processor adds up the rest while it waits for them.

/// Sum of `term(j)` over 0 <= j <= N, ends last.
#[inline(always)]
fn sum<const N: usize>(term: impl Fn(usize) -> f64) -> f64 {
    match N {
        0 => term(0),
        1 => term(0) + term(1),
        _ => (2..N).fold(term(1), |sum, j| sum + term(j)) + term(0) + term(N),
    }
}

/// As [`sum`], for vectors.
#[inline(always)]
fn sum_pair<const N: usize>(term: impl Fn(usize) -> [f64; 2]) -> [f64; 2] {
    let add = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
    match N {
        0 => term(0),
        1 => add(term(0), term(1)),
        _ => add(add((2..N).fold(term(1), |sum, j| add(sum, term(j))), term(0)), term(N)),
    }
}

/// Coefficient N of a b: sum of a_j b_(N-j).
#[inline(always)]
pub fn mul<const N: usize>(a: &Series, b: &Series) -> f64 {
    sum::<N>(|j| a[j] * b[N - j])
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

/// Coefficient N of a b, b a vector.
#[inline(always)]
pub fn scale<const N: usize>(a: &Series, b: &Pair) -> [f64; 2] {
    sum_pair::<N>(|j| [a[j] * b[N - j][0], a[j] * b[N - j][1]])
}

/// Coefficient N of a b_i, b a vector.
#[inline(always)]
pub fn mul_part<const N: usize>(a: &Series, b: &Pair, i: usize) -> f64 {
    sum::<N>(|j| a[j] * b[N - j][i])
}

/// Coefficient N of a b, b a vector, without its term a_N b_0.
#[inline(always)]
pub fn scale_head<const N: usize>(a: &Series, b: &Pair) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for j in 0..N {
        sum = [sum[0] + a[j] * b[N - j][0], sum[1] + a[j] * b[N - j][1]];
    }
    sum
}

/// Coefficient N of a b_i, b a vector, without its term a_N b_0.
#[inline(always)]
pub fn mul_part_head<const N: usize>(a: &Series, b: &Pair, i: usize) -> f64 {
    let mut sum = 0.0;
    for j in 0..N {
        sum += a[j] * b[N - j][i];
    }
    sum
}

/// Coefficient N of (a_1 b_1, a_2 b_2).
#[inline(always)]
pub fn each<const N: usize>(a: &Pair, b: &Pair) -> [f64; 2] {
    sum_pair::<N>(|j| [a[j][0] * b[N - j][0], a[j][1] * b[N - j][1]])
}

/// Coefficient N of (a_1^2, a_2^2).
#[inline(always)]
pub fn squares<const N: usize>(a: &Pair) -> [f64; 2] {
    let mut half = [0.0; 2];
    for j in (0..N.div_ceil(2)).rev() {
        half = [half[0] + a[j][0] * a[N - j][0], half[1] + a[j][1] * a[N - j][1]];
    }
    let middle = if N.is_multiple_of(2) { a[N / 2].map(|x| x * x) } else { [0.0; 2] };
    [2.0 * half[0] + middle[0], 2.0 * half[1] + middle[1]]
}

/// Coefficient N of a.b.
#[inline(always)]
pub fn dot<const N: usize>(a: &Pair, b: &Pair) -> f64 {
    let [x, y] = each::<N>(a, b);
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

/// Coefficient N of a b without its term a_0 b_N.
#[inline(always)]
pub fn mul_tail<const N: usize>(a: &Series, b: &Series) -> f64 {
    let mut sum = 0.0;
    for j in 1..=N {
        sum += a[j] * b[N - j];
    }
    sum
}

/// Coefficient N of a^2.
#[inline(always)]
pub fn square<const N: usize>(a: &Series) -> f64 {
    if N == 0 {
        return a[0] * a[0];
    }
    let mut half = 0.0;
    for j in 1..N.div_ceil(2) {
        half += a[j] * a[N - j];
    }
    let middle = if N.is_multiple_of(2) { a[N / 2] * a[N / 2] } else { 0.0 };
    2.0 * (half + a[0] * a[N]) + middle
}

/// Coefficient N of (ramp) a, where the ramp is `ramp[0] + ramp[1] t`.
#[inline(always)]
pub fn mul_ramp<const N: usize>(ramp: &[f64; 2], a: &Series) -> f64 {
    if N == 0 { ramp[0] * a[0] } else { ramp[0] * a[N] + ramp[1] * a[N - 1] }
}

/// Coefficient N >= 1 of f where f' = g u', from u's coefficient N and g's below N;
/// `u_d` keeps the coefficients of u'.
#[inline(always)]
pub fn chain<const N: usize>(u: f64, u_d: &mut Series, g: &Series) -> f64 {
    u_d[N - 1] = N as f64 * u;
    let mut before = 0.0;
    for j in 0..N - 1 {
        before += u_d[j] * g[N - 1 - j];
    }
    before * const { 1.0 / N as f64 } + u * g[0]
}

/// Coefficient N of (sin a, cos a), from a's coefficient N and theirs below N; `a_d` keeps
/// the coefficients of a'.
#[inline(always)]
pub fn sin_cos<const N: usize>(a: f64, a_d: &mut Series, s: &Series, c: &Series) -> (f64, f64) {
    if N == 0 { libm::sincos(a) } else { (chain::<N>(a, a_d, c), -chain::<N>(a, a_d, s)) }
}

/// Does something with `$N` as the constants 0, 1, ... [`ORDER`] - 1, in turn.
macro_rules! for_each_order {
    ($N:ident => $do:block) => {
        for_each_order!($N => $do; 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17)
    };
    ($N:ident => $do:block; $($n:literal)*) => {
        $({
            const $N: usize = $n;
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
    const SHARES: Series = {
        let (mut shares, mut j) = (ZERO, 0);
        while j <= ORDER {
            shares[j] = 1.0 / (j + 1) as f64;
            j += 1;
        }
        shares
    };
    let n = n.min(ORDER);
    let mut sums = [0.0; K];
    for j in (0..=n).rev() {
        for k in 0..K {
            sums[k] = sums[k] * t + a[k][j] * SHARES[j];
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
        for_each_order!(N => {
            e[N] = if N == 0 { f64::exp(u(0)) } else { chain::<N>(u(N), &mut u_d, &e) };
        });
        assert!((values([&e], ORDER, 0.1)[0] - f64::exp(0.395)).abs() < 4.0 * ULPS);
    }

    #[test]
    fn sin_and_cos_of_a_series_are_the_series_of_sin_and_cos() {
        let (mut s, mut c, mut u_d) = (ZERO, ZERO, ZERO);
        for_each_order!(N => {
            (s[N], c[N]) = sin_cos::<N>(u(N), &mut u_d, &s, &c);
            let one = square::<N>(&s) + mul::<N>(&c, &c);
            assert!((one - constant::<N>(1.0)).abs() < ULPS);
        });
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
