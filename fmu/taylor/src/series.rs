//! Power series in time: x(t) = x_0 + x_1 t + x_2 t^2 + ...
//!
//! A function such as `mul(n, a, b)` returns coefficient n of its result, here of the product a b, from the coefficients of
//! its arguments up to n.
//!
//! Equations of motion are written once, as rules for coefficient n of each quantity from the coefficients up to n
//! of the quantities on which it depends. For n = 0 a rule gives the quantity itself at an instant. All orders
//! together are the Taylor expansion for the integrator. If coefficient 1 of the states is set to a direction, order
//! 1 is the directional derivative.
//!
//! Source of the rules: the product (Cauchy) rule, and for f(u) the differential equation that f
//! satisfies. See Jorba & Zou, Experimental Mathematics 14 (2005).

use crate::number::Number;

pub const ORDER: usize = 18;

/// Coefficients 0 to [`ORDER`] of a quantity's power series in time.
pub type Series = [f64; ORDER + 1];

pub const ZERO: Series = [0.0; ORDER + 1];

/// Returns the value of a power series at the start of the expansion, which is coefficient 0. A
/// [`Dual`](crate::number::Dual) also takes coefficient 1, as its directional derivative.
pub fn number<T: Number>(a: &Series) -> T {
    T::with_slope(a[0], a[1])
}

pub(crate) const RECIPROCAL: [f64; ORDER + 2] = {
    let (mut table, mut n) = ([0.0; ORDER + 2], 1);
    while n <= ORDER + 1 {
        table[n] = 1.0 / n as f64;
        n += 1;
    }
    table
};

// The rules are always inlined. If the order n is a constant, the compiler writes out every sum (see `integrator.rs`);
// otherwise the sums are loops.

/// Returns coefficient n of a constant: the constant at order 0, otherwise 0.
#[inline(always)]
pub fn constant(n: usize, a: f64) -> f64 {
    if n == 0 { a } else { 0.0 }
}

/// Returns coefficient n + 1 of x from coefficient n of its rate x'.
#[inline(always)]
pub fn next(n: usize, rate: f64) -> f64 {
    rate * RECIPROCAL[n + 1]
}

// Each sum adds the terms with the newest coefficients, number n, last. These coefficients come from other sums of
// this order, and the processor computes the rest while it waits for them. Loops use slices, which avoids a bounds
// check of every index.

/// Start value of a sum. Adding -0 never changes a value, so that the compiler can omit the addition, whereas +0
/// turns -0 into +0.
pub(crate) const EMPTY: f64 = -0.0;

/// Returns the sum of `term(j)` over 0 <= j <= n. The first and the last term, which contain the newest
/// coefficients, are added last.
#[inline(always)]
pub(crate) fn sum(n: usize, term: impl Fn(usize) -> f64) -> f64 {
    let sum = (1..n).fold(EMPTY, |sum, j| sum + term(j)) + term(0);
    if n == 0 { sum } else { sum + term(n) }
}

#[inline(always)]
pub fn mul(n: usize, a: &Series, b: &Series) -> f64 {
    let (a, b) = (&a[..=n], &b[..=n]);
    sum(n, |j| a[j] * b[n - j])
}

/// Returns coefficient n of a b without its term a_0 b_n, for rules in which b_n is not yet known.
#[inline(always)]
pub fn mul_tail(n: usize, a: &Series, b: &Series) -> f64 {
    let mut sum = EMPTY;
    for (a, b) in a[1..=n].iter().zip(b[..n].iter().rev()) {
        sum += a * b;
    }
    sum
}

#[inline(always)]
pub fn square(n: usize, a: &Series) -> f64 {
    if n == 0 {
        return a[0] * a[0];
    }
    let mut half = EMPTY;
    for j in 1..n.div_ceil(2) {
        half += a[j] * a[n - j];
    }
    let middle = if n.is_multiple_of(2) { a[n / 2] * a[n / 2] } else { EMPTY };
    2.0 * (half + a[0] * a[n]) + middle
}

/// Returns coefficient n of a^(1/2) from coefficient n of a, with a_0 above 0, and the coefficients of `root` below n.
pub fn sqrt(n: usize, a: f64, root: &Series) -> f64 {
    if n == 0 {
        return libm::sqrt(a);
    }
    let both: f64 = (1..n).map(|j| root[j] * root[n - j]).sum();
    (a - both) / (2.0 * root[0])
}

/// Returns coefficient n of the product of `a` and the linear function `ramp[0] + ramp[1] t`.
#[inline(always)]
pub fn mul_ramp(n: usize, ramp: &[f64; 2], a: &Series) -> f64 {
    if n == 0 { ramp[0] * a[0] } else { ramp[0] * a[n] + ramp[1] * a[n - 1] }
}

/// Returns coefficient n >= 1 of f, where f' = g u', from coefficient n of u and coefficients below n of g.
/// `u_d` stores the coefficients of u'.
#[inline(always)]
pub fn chain(n: usize, u: f64, u_d: &mut Series, g: &Series) -> f64 {
    u_d[n - 1] = n as f64 * u;
    let mut before = EMPTY;
    for (u_d, g) in u_d[..n - 1].iter().zip(g[1..n].iter().rev()) {
        before += u_d * g;
    }
    before * RECIPROCAL[n] + u * g[0]
}

/// Returns coefficient n of (sin a, cos a) from coefficient n of a and the coefficients below n of both
/// results. `a_d` stores the coefficients of a'.
#[inline(always)]
pub fn sin_cos(n: usize, a: f64, a_d: &mut Series, s: &Series, c: &Series) -> (f64, f64) {
    if n == 0 { libm::sincos(a) } else { (chain(n, a, a_d, c), -chain(n, a, a_d, s)) }
}

/// Returns a time, s, over which x_0 + x_1 t + x_2 t^2 stays within `distance` > 0 of x_0, also for complex t; infinity if x
/// does not change. If x is linear, it is the longest such time. `slope` and `bend` are |x_1| and |x_2|.
pub fn time_within(distance: f64, slope: f64, bend: f64) -> f64 {
    let speed = slope + libm::sqrt(slope * slope + 4.0 * bend * distance);
    if speed > 0.0 { 2.0 * distance / speed } else { f64::INFINITY }
}

/// Evaluates an expression with `$N` set to the constants 0, 1, ... [`ORDER`] - 1, one after the other.
#[macro_export]
macro_rules! for_each_order {
    ($N:ident => $do:block) => {
        $crate::for_each_order!($N => $do; 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17)
    };
    ($N:ident => $do:block; $($n:literal)*) => {
        $({
            const $N: usize = $n;
            $do
        })*
    };
}

/// Creates an array of the functions `$T::$f::<N>` for N = 0, 1, ... [`ORDER`] - 1.
#[macro_export]
macro_rules! at_each_order {
    ($T:ident :: $f:ident) => {
        $crate::at_each_order!($T :: $f; 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17)
    };
    ($T:ident :: $f:ident; $($n:literal)*) => {
        [$($T::$f::<$n>),*]
    };
}

#[inline(always)]
pub fn values<const K: usize>(a: [&Series; K], n: usize, t: f64) -> [f64; K] {
    let n = n.min(ORDER);
    let mut sums = a.map(|a| a[n]);
    for j in (0..n).rev() {
        for k in 0..K {
            sums[k] = sums[k] * t + a[k][j];
        }
    }
    sums
}

/// Returns the integrals of several series up to order n from 0 to the time t.
#[inline(always)]
pub fn integrals<const K: usize>(a: [&Series; K], n: usize, t: f64) -> [f64; K] {
    let n = n.min(ORDER);
    let mut sums = a.map(|a| a[n] * RECIPROCAL[n + 1]);
    for j in (0..n).rev() {
        for k in 0..K {
            sums[k] = sums[k] * t + a[k][j] * RECIPROCAL[j + 1];
        }
    }
    sums.map(|sum| sum * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn u(n: usize) -> f64 {
        [0.3, 1.0, -0.5].get(n).copied().unwrap_or(0.0)
    }

    // At t = 0.1 the truncation error is below rounding, so that a few units in the last place remain.
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
    fn sqrt_of_a_series_is_the_series_of_sqrt() {
        let mut root = ZERO;
        for n in 0..ORDER {
            root[n] = sqrt(n, u(n), &root);
        }
        // The root vanishes at t = -0.26, so that its series converges more slowly than the others.
        let found = values([&root], ORDER, 0.02)[0];
        assert!((found - f64::sqrt(0.3198)).abs() < 4.0 * ULPS);
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
    fn series_products_follow_the_product_rule() {
        let (mut a, mut b) = (ZERO, ZERO);
        a[..4].copy_from_slice(&[1.0, 3.0, -2.0, 4.0]);
        b[..4].copy_from_slice(&[2.0, -1.0, 5.0, 1.0]);
        let ramp = [2.0, -1.0];
        for n in 0..ORDER {
            let product =
                |a: &Series, b: &Series| -> f64 { (0..=n).map(|j| a[j] * b[n - j]).sum() };
            assert_eq!(mul(n, &a, &b), product(&a, &b));
            assert_eq!(mul_tail(n, &a, &b) + a[0] * b[n], product(&a, &b));
            assert_eq!(square(n, &a), product(&a, &a));
            let mut line = ZERO;
            line[..2].copy_from_slice(&ramp);
            assert_eq!(mul_ramp(n, &ramp, &a), product(&line, &a));
            assert_eq!(mul_ramp(n, &ramp, &b), product(&line, &b));
            assert_eq!(next(n, 1.0), 1.0 / (n + 1) as f64);
        }
        assert_eq!((constant(0, 3.0), constant(1, 3.0)), (3.0, 0.0));
    }

    #[test]
    fn values_and_integrals_of_a_series_equal_those_of_its_polynomial() {
        let mut a = ZERO;
        a[..3].copy_from_slice(&[1.0, 2.0, 3.0]);
        assert_eq!(values([&a], ORDER, 2.0), [17.0]);
        assert_eq!(values([&a], 1, 2.0), [5.0]);
        assert_eq!(values([&a], ORDER + 5, 2.0), [17.0]);
        assert_eq!(integrals([&a, &a], ORDER, 2.0), [14.0; 2]);
        assert_eq!(integrals([&a], 1, 2.0), [6.0]);
        assert_eq!(integrals([&a], ORDER + 5, 2.0), [14.0]);
        assert_eq!(number::<f64>(&a), 1.0);
        assert_eq!(number::<crate::number::Dual>(&a).result(), 2.0);
    }
}
