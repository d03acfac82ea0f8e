//! Power series of vectors in the plane. Functions return coefficient n of the result, as in `series.rs`. Most rules treat
//! both components equally, so that a processor computes both at once.

use crate::number::Number;
use crate::series::{self, EMPTY, ORDER, Series};

/// Returns the sum of `term(j)` over 0 <= j <= n. The first and the last term, which contain the newest coefficients, are
/// added last, as in `series.rs`.
#[inline(always)]
fn sum_both(n: usize, term: impl Fn(usize) -> [f64; 2]) -> [f64; 2] {
    let add = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
    let sum = add((1..n).fold([EMPTY; 2], |sum, j| add(sum, term(j))), term(0));
    if n == 0 { sum } else { add(sum, term(n)) }
}

/// Coefficients of a vector in the plane, aligned in memory so that a processor loads both components at once.
#[derive(Clone, Debug)]
#[repr(align(16))]
pub struct Vector2([[f64; 2]; ORDER + 1]);

pub const ZERO_VECTOR2: Vector2 = Vector2([[0.0; 2]; ORDER + 1]);

/// Returns both components at the start of an expansion as numbers; see [`series::number`].
pub fn numbers<T: Number>(a: &Vector2) -> [T; 2] {
    [0, 1].map(|i| T::with_slope(a[0][i], a[1][i]))
}

impl core::ops::Index<usize> for Vector2 {
    type Output = [f64; 2];

    #[inline(always)]
    fn index(&self, n: usize) -> &[f64; 2] {
        &self.0[n]
    }
}

impl core::ops::IndexMut<usize> for Vector2 {
    #[inline(always)]
    fn index_mut(&mut self, n: usize) -> &mut [f64; 2] {
        &mut self.0[n]
    }
}

#[inline(always)]
pub fn scale(n: usize, a: &Series, b: &Vector2) -> [f64; 2] {
    let (a, b) = (&a[..=n], &b.0[..=n]);
    sum_both(n, |j| [a[j] * b[n - j][0], a[j] * b[n - j][1]])
}

/// Returns coefficient n of the product of a number a and component i of a vector b.
#[inline(always)]
pub fn mul_part(n: usize, a: &Series, b: &Vector2, i: usize) -> f64 {
    let (a, b) = (&a[..=n], &b.0[..=n]);
    series::sum(n, |j| a[j] * b[n - j][i])
}

/// Returns coefficient n of the product of a number a and a vector b, without the term a_n b_0, because a_n may
/// not be known yet.
#[inline(always)]
pub fn scale_head(n: usize, a: &Series, b: &Vector2) -> [f64; 2] {
    let mut sum = [EMPTY; 2];
    for (a, b) in a[..n].iter().zip(b.0[1..=n].iter().rev()) {
        sum = [sum[0] + a * b[0], sum[1] + a * b[1]];
    }
    sum
}

/// Returns coefficient n of the product of a number a and component i of a vector b, without the term that
/// contains a_n; see [`scale_head`].
#[inline(always)]
pub fn mul_part_head(n: usize, a: &Series, b: &Vector2, i: usize) -> f64 {
    let mut sum = EMPTY;
    for (a, b) in a[..n].iter().zip(b.0[1..=n].iter().rev()) {
        sum += a * b[i];
    }
    sum
}

/// Returns coefficient n of the products of the components of two vectors, (a_1 b_1, a_2 b_2).
#[inline(always)]
pub fn component_products(n: usize, a: &Vector2, b: &Vector2) -> [f64; 2] {
    let (a, b) = (&a.0[..=n], &b.0[..=n]);
    sum_both(n, |j| [a[j][0] * b[n - j][0], a[j][1] * b[n - j][1]])
}

#[inline(always)]
pub fn squares(n: usize, a: &Vector2) -> [f64; 2] {
    let mut half = [EMPTY; 2];
    for j in (0..n.div_ceil(2)).rev() {
        half = [half[0] + a[j][0] * a[n - j][0], half[1] + a[j][1] * a[n - j][1]];
    }
    let middle = if n.is_multiple_of(2) { a[n / 2].map(|x| x * x) } else { [EMPTY; 2] };
    [2.0 * half[0] + middle[0], 2.0 * half[1] + middle[1]]
}

#[inline(always)]
pub fn dot(n: usize, a: &Vector2, b: &Vector2) -> f64 {
    let [x, y] = component_products(n, a, b);
    x + y
}

/// Evaluates the power series of several vectors, up to order n, at the time t.
#[inline(always)]
pub fn values<const K: usize>(a: [&Vector2; K], n: usize, t: f64) -> [[f64; 2]; K] {
    let n = n.min(ORDER);
    let mut sums = a.map(|a| a[n]);
    for j in (0..n).rev() {
        for k in 0..K {
            let [x, y] = a[k][j];
            sums[k] = [sums[k][0] * t + x, sums[k][1] * t + y];
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::series::{Series, ZERO};

    #[test]
    fn series_products_follow_the_product_rule() {
        let (mut a, mut b, mut s) = (ZERO_VECTOR2, ZERO_VECTOR2, ZERO);
        let (x, y) = (
            [[1.0, 2.0], [3.0, 0.0], [0.0, -2.0], [4.0, 1.0]],
            [[2.0, -3.0], [1.0, 1.0], [-1.0, 4.0], [0.0, 2.0]],
        );
        for j in 0..4 {
            (a[j], b[j], s[j]) = (x[j], y[j], y[j][1]);
        }
        let plain = |n: usize, term: &dyn Fn(usize, usize) -> f64| -> f64 {
            (0..=n).map(|j| term(j, n - j)).sum()
        };
        for n in 0..ORDER {
            for i in 0..2 {
                let scaled = plain(n, &|j, k| s[j] * a[k][i]);
                assert_eq!(scale(n, &s, &a)[i], scaled);
                assert_eq!(mul_part(n, &s, &a, i), scaled);
                assert_eq!(scale_head(n, &s, &a)[i] + s[n] * a[0][i], scaled);
                assert_eq!(mul_part_head(n, &s, &a, i) + s[n] * a[0][i], scaled);
                assert_eq!(component_products(n, &a, &b)[i], plain(n, &|j, k| a[j][i] * b[k][i]));
                assert_eq!(squares(n, &a)[i], plain(n, &|j, k| a[j][i] * a[k][i]));
            }
            assert_eq!(dot(n, &a, &b), plain(n, &|j, k| a[j][0] * b[k][0] + a[j][1] * b[k][1]));
        }
    }

    #[test]
    fn both_components_of_a_pair_keep_their_values() {
        let mut a = ZERO_VECTOR2;
        (a[0], a[1], a[2]) = ([1.0, -1.0], [2.0, 3.0], [0.5, 4.0]);
        assert_eq!(values([&a, &a], ORDER, 2.0), [[7.0, 21.0]; 2]);
        assert_eq!(values([&a], 1, 2.0), [[5.0, 5.0]]);
        assert_eq!(numbers::<f64>(&a), [1.0, -1.0]);
        let along = numbers::<crate::number::Dual>(&a);
        assert_eq!(along.map(Number::result), [2.0, 3.0]);
        let _: &Series = &ZERO;
    }
}
