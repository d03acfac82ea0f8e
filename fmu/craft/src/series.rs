//! Power series in time, of scalars and of vectors: x(t) = x_0 + x_1 t + x_2 t^2 + ...
//!
//! The equations of motion are written once, as rules for coefficient N of each quantity from
//! the coefficients up to N of the quantities it depends on. Order 0 of a rule is the quantity
//! itself at an instant; all orders together are the Taylor expansion that the integrator
//! steps with; order 1 along a direction is the directional derivative.
//!
//! The equations are polynomials, so the product (Cauchy) rule is all there is. N is a constant
//! of each rule, so that the compiler writes every sum out. Each sum has its newest
//! coefficients last: they come out of other sums of this order, and a processor adds up the
//! rest while it waits for them.

use crate::vector::{self, Vec3};

/// The highest order kept.
pub const ORDER: usize = 18;

/// Coefficients 0 to [`ORDER`] of a scalar.
pub type Series = [f64; ORDER + 1];

/// Coefficients 0 to [`ORDER`] of a vector.
pub type Vector = [Vec3; ORDER + 1];

/// All coefficients zero.
pub const ZERO: Series = [0.0; ORDER + 1];

/// All coefficients zero.
pub const ZERO_VECTOR: Vector = [[0.0; 3]; ORDER + 1];

/// Coefficient N + 1 of x from coefficient N of x'.
#[inline(always)]
pub fn next<const N: usize>(rate: Vec3) -> Vec3 {
    vector::scale(const { 1.0 / (N + 1) as f64 }, rate)
}

/// Sum of `term(j)` over 0 <= j <= N, ends last.
#[inline(always)]
fn sum<const N: usize>(term: impl Fn(usize) -> f64) -> f64 {
    match N {
        0 => term(0),
        1 => term(0) + term(1),
        _ => (2..N).fold(term(1), |sum, j| sum + term(j)) + term(0) + term(N),
    }
}

/// As [`sum`], of vectors.
#[inline(always)]
fn sum_vector<const N: usize>(term: impl Fn(usize) -> Vec3) -> Vec3 {
    let add = vector::add::<f64>;
    match N {
        0 => term(0),
        1 => add(term(0), term(1)),
        _ => add(add((2..N).fold(term(1), |sum, j| add(sum, term(j))), term(0)), term(N)),
    }
}

/// Coefficient N of a^2.
#[inline(always)]
pub fn square<const N: usize>(a: &Series) -> f64 {
    let mut half = 0.0;
    for j in (0..N.div_ceil(2)).rev() {
        half += a[j] * a[N - j];
    }
    2.0 * half + if N.is_multiple_of(2) { a[N / 2] * a[N / 2] } else { 0.0 }
}

/// Coefficient N of a.a.
#[inline(always)]
pub fn square_vector<const N: usize>(a: &Vector) -> f64 {
    let mut half = 0.0;
    for j in (0..N.div_ceil(2)).rev() {
        half += vector::dot(a[j], a[N - j]);
    }
    2.0 * half + if N.is_multiple_of(2) { vector::dot(a[N / 2], a[N / 2]) } else { 0.0 }
}

/// Coefficient N of the six different products of components: xx, yy, zz, xy, xz, yz.
#[inline(always)]
pub fn products<const N: usize>(a: &Vector) -> [f64; 6] {
    let mut half = [0.0; 3];
    for j in (0..N.div_ceil(2)).rev() {
        half = [0, 1, 2].map(|i| half[i] + a[j][i] * a[N - j][i]);
    }
    let middle = if N.is_multiple_of(2) { a[N / 2].map(|x| x * x) } else { [0.0; 3] };
    let [xx, yy, zz] = [0, 1, 2].map(|i| 2.0 * half[i] + middle[i]);
    let [xy, xz, yz] = sum_vector::<N>(|j| {
        let (a, b) = (a[j], a[N - j]);
        [a[0] * b[1], a[0] * b[2], a[1] * b[2]]
    });
    [xx, yy, zz, xy, xz, yz]
}

/// Coefficient N of a b, b a vector.
#[inline(always)]
pub fn scale<const N: usize>(a: &Series, b: &Vector) -> Vec3 {
    sum_vector::<N>(|j| vector::scale(a[j], b[N - j]))
}

/// Coefficient N of a b, b a vector, without its term a_N b_0.
#[inline(always)]
pub fn scale_known<const N: usize>(a: &Series, b: &Vector) -> Vec3 {
    (0..N).fold([0.0; 3], |sum, j| vector::add(sum, vector::scale(a[j], b[N - j])))
}

/// Coefficient N of a.b without its term a_0.b_N.
#[inline(always)]
pub fn dot_known<const N: usize>(a: &Vector, b: &Vector) -> f64 {
    (1..=N).fold(0.0, |sum, j| sum + vector::dot(a[j], b[N - j]))
}

/// Coefficient N of a x b.
#[inline(always)]
pub fn cross<const N: usize>(a: &Vector, b: &Vector) -> Vec3 {
    sum_vector::<N>(|j| vector::cross(a[j], b[N - j]))
}

/// Coefficient N of a + a' t.
#[inline(always)]
pub fn ramp<const N: usize>(a: &[Vec3; 2]) -> Vec3 {
    if N < 2 { a[N] } else { [0.0; 3] }
}

/// Coefficient N of a.b, where a is `ramp[0] + ramp[1] t`.
#[inline(always)]
pub fn dot_ramp<const N: usize>(ramp: &[Vec3; 2], b: &Vector) -> f64 {
    let first = vector::dot(ramp[0], b[N]);
    if N == 0 { first } else { first + vector::dot(ramp[1], b[N - 1]) }
}

/// Coefficient N of a x b, where b is `ramp[0] + ramp[1] t`.
#[inline(always)]
pub fn cross_ramp<const N: usize>(a: &Vector, ramp: &[Vec3; 2]) -> Vec3 {
    let first = vector::cross(a[N], ramp[0]);
    if N == 0 { first } else { vector::add(first, vector::cross(a[N - 1], ramp[1])) }
}

/// Coefficient N of q' = q o (0, w)/2 (Hamilton's product).
#[inline(always)]
pub fn quaternion_rate<const N: usize>(q: &[[f64; 4]; ORDER + 1], w: &Vector) -> [f64; 4] {
    let scalar = sum::<N>(|j| vector::dot(w[j], [q[N - j][1], q[N - j][2], q[N - j][3]]));
    let vector = sum_vector::<N>(|j| {
        let [q0, x, y, z] = q[N - j];
        vector::add(vector::scale(q0, w[j]), vector::cross([x, y, z], w[j]))
    });
    [-0.5 * scalar, 0.5 * vector[0], 0.5 * vector[1], 0.5 * vector[2]]
}

/// The value at t of the series cut after order n.
#[inline(always)]
pub fn value<const D: usize>(a: &[[f64; D]; ORDER + 1], n: usize, t: f64) -> [f64; D] {
    a[..=n].iter().rev().fold([0.0; D], |mut sum, x| {
        for i in 0..D {
            sum[i] = sum[i] * t + x[i];
        }
        sum
    })
}

/// The integral from 0 to t of the series cut after order n.
#[inline(always)]
pub fn integral(a: &Series, n: usize, t: f64) -> f64 {
    const SHARES: Series = {
        let (mut shares, mut j) = (ZERO, 0);
        while j <= ORDER {
            shares[j] = 1.0 / (j + 1) as f64;
            j += 1;
        }
        shares
    };
    let terms = a[..=n].iter().zip(&SHARES).rev();
    terms.fold(0.0, |sum, (x, share)| sum * t + x * share) * t
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Turning at a constant rate: q' = q o (0, w)/2 and y' = -w x y have closed forms.
    #[test]
    fn a_constant_rate_turns_attitude_and_components_by_rodrigues_formula() {
        let rate = [0.3, -0.8, 0.5];
        let mut w = ZERO_VECTOR;
        w[0] = rate;
        let mut q = [[0.0; 4]; ORDER + 1];
        q[0] = [1.0, 0.0, 0.0, 0.0];
        let mut y = ZERO_VECTOR;
        y[0] = [1.0, 2.0, -0.5];
        for_each_order!(N => {
            q[N + 1] = quaternion_rate::<N>(&q, &w).map(|x| x / (N + 1) as f64);
            y[N + 1] = next::<N>(cross::<N>(&y, &w));
        });
        let (t, size) = (0.4, vector::norm(rate));
        let (q, y_t) = (value(&q, ORDER, t), value(&y, ORDER, t));
        let (sin, cos) = (f64::sin(size * t / 2.0), f64::cos(size * t / 2.0));
        let exact = [cos, rate[0] / size * sin, rate[1] / size * sin, rate[2] / size * sin];
        // |w| t = 0.4: what is cut off is below rounding, a few ulp remain.
        for (got, exact) in q.iter().zip(exact) {
            assert!((got - exact).abs() < 4e-16, "{got} {exact}");
        }
        let back = vector::transposed_times(&vector::rotation(&exact), y[0]);
        for (got, exact) in y_t.iter().zip(back) {
            assert!((got - exact).abs() < 2e-15, "{got} {exact}");
        }
    }

    /// Products of two cubics, whose coefficients are small integers and hence exact.
    #[test]
    fn the_rules_are_the_product_rule() {
        let a: [Vec3; 4] = [[1.0, 2.0, -1.0], [3.0, 0.0, 2.0], [0.0, -2.0, 5.0], [4.0, 1.0, 1.0]];
        let b: [Vec3; 4] = [[2.0, -3.0, 1.0], [1.0, 1.0, 0.0], [-1.0, 4.0, 2.0], [0.0, 2.0, -3.0]];
        let (mut x, mut y, mut s) = (ZERO_VECTOR, ZERO_VECTOR, ZERO);
        for j in 0..4 {
            (x[j], y[j], s[j]) = (a[j], b[j], b[j][1]);
        }
        let plain = |n: usize, term: &dyn Fn(usize, usize) -> f64| -> f64 {
            (0..=n).filter(|&j| j < 4 && n - j < 4).map(|j| term(j, n - j)).sum()
        };
        for_each_order!(N => {
            let dot = plain(N, &|i, j| vector::dot(a[i], b[j]));
            if N < 4 {
                assert_eq!(dot_known::<N>(&x, &y) + vector::dot(x[0], y[N]), dot);
            }
            assert_eq!(square_vector::<N>(&x), plain(N, &|i, j| vector::dot(a[i], a[j])));
            assert_eq!(square::<N>(&s), plain(N, &|i, j| b[i][1] * b[j][1]));
            let squares = products::<N>(&x);
            for (n, (k, l)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].iter().enumerate() {
                assert_eq!(squares[n], plain(N, &|i, j| a[i][*k] * a[j][*l]));
            }
            for i in 0..3 {
                let crossed = plain(N, &|j, k| vector::cross(a[j], b[k])[i]);
                assert_eq!(cross::<N>(&x, &y)[i], crossed);
                let scaled = plain(N, &|j, k| b[j][1] * a[k][i]);
                assert_eq!(scale::<N>(&s, &x)[i], scaled);
                if N < 4 {
                    let newest = s[N] * x[0][i];
                    assert_eq!(scale_known::<N>(&s, &x)[i] + newest, scaled);
                }
            }
        });
    }
}
