//! Power series of vectors in space and of quaternions. Functions return coefficient N of the result, for example `cross` returns
//! coefficient N of the vector product. Functions named `…_coefficient` compute it in a loop for any order n.
//!
//! The rules are the product (Cauchy) rule. Each sum adds its newest coefficients last, as in `series.rs`. The order N is a
//! constant parameter of a rule, so that the compiler writes out sums of vectors before it inlines them, which saves a
//! seventieth of the instructions of a step.

use crate::series::{EMPTY, ORDER, RECIPROCAL, Series};
use crate::vector::{self, Vec3};

pub type Vector = [Vec3; ORDER + 1];

pub const ZERO_VECTOR: Vector = [[0.0; 3]; ORDER + 1];

#[inline(always)]
pub fn next<const N: usize>(rate: Vec3) -> Vec3 {
    vector::scale(RECIPROCAL[N + 1], rate)
}

/// Coefficients of two vectors that most rules treat equally: `[n][i]` is component i of both vectors. A processor loads
/// both from aligned memory and computes both at once.
#[derive(Clone, Debug)]
#[repr(align(16))]
pub struct Pair([[[f64; 2]; 3]; ORDER + 1]);

pub const ZERO_PAIR: Pair = Pair([[[0.0; 2]; 3]; ORDER + 1]);

impl Pair {
    #[inline(always)]
    pub fn set(&mut self, n: usize, a: Vec3, b: Vec3) {
        self.0[n] = [[a[0], b[0]], [a[1], b[1]], [a[2], b[2]]];
    }

    #[inline(always)]
    pub fn get(&self, n: usize) -> [Vec3; 2] {
        let [x, y, z] = self.0[n];
        [[x[0], y[0], z[0]], [x[1], y[1], z[1]]]
    }

    /// Sets coefficient n + 1 of both vectors of the pair from coefficient n of their derivatives
    /// by time. `rates[i]` has component i of both derivatives.
    #[inline(always)]
    pub fn set_next(&mut self, n: usize, rates: [[f64; 2]; 3]) {
        self.0[n + 1] = rates.map(|pair| pair.map(|rate| rate * RECIPROCAL[n + 1]));
    }

    #[inline(always)]
    pub fn value(&self, n: usize, t: f64) -> [Vec3; 2] {
        let mut sum = self.0[n];
        for x in self.0[..n].iter().rev() {
            for i in 0..3 {
                sum[i] = [sum[i][0] * t + x[i][0], sum[i][1] * t + x[i][1]];
            }
        }
        let [x, y, z] = sum;
        [[x[0], y[0], z[0]], [x[1], y[1], z[1]]]
    }
}

#[inline(always)]
pub fn square_vector<const N: usize>(a: &Vector) -> f64 {
    let mut half = [EMPTY; 3];
    for j in (0..N.div_ceil(2)).rev() {
        for i in 0..3 {
            half[i] += a[j][i] * a[N - j][i];
        }
    }
    let middle = if N.is_multiple_of(2) { vector::dot(a[N / 2], a[N / 2]) } else { EMPTY };
    2.0 * (half[0] + half[1] + half[2]) + middle
}

/// Returns coefficient N of the six different products of a vector's components: xx, yy, zz, xy, xz, yz.
#[inline(always)]
pub fn products<const N: usize>(a: &Vector) -> [f64; 6] {
    // Terms j and N - j are added together: 2 a_j b_(N-j) for a square, and a_j b_(N-j) + a_(N-j) b_j
    // for the other products.
    let mut sum = [EMPTY; 6];
    for j in (0..N.div_ceil(2)).rev() {
        let (a, b) = (a[j], a[N - j]);
        sum[0] += a[0] * b[0];
        sum[1] += a[1] * b[1];
        sum[2] += a[2] * b[2];
        sum[3] += a[0] * b[1] + a[1] * b[0];
        sum[4] += a[0] * b[2] + a[2] * b[0];
        sum[5] += a[1] * b[2] + a[2] * b[1];
    }
    for square in &mut sum[..3] {
        *square *= 2.0;
    }
    if N.is_multiple_of(2) {
        let [x, y, z] = a[N / 2];
        let middle = [x * x, y * y, z * z, x * y, x * z, y * z];
        for (sum, middle) in sum.iter_mut().zip(middle) {
            *sum += middle;
        }
    }
    sum
}

/// Returns the products of [`products`], computed in a loop for any order n, which gives smaller code.
pub fn product_coefficients(n: usize, a: &Vector) -> [f64; 6] {
    let mut sum = [EMPTY; 6];
    for (a, b) in a[..=n].iter().zip(a[..=n].iter().rev()) {
        let terms = [a[0] * b[0], a[1] * b[1], a[2] * b[2], a[0] * b[1], a[0] * b[2], a[1] * b[2]];
        for (sum, term) in sum.iter_mut().zip(terms) {
            *sum += term;
        }
    }
    sum
}

#[inline(always)]
pub fn scale<const N: usize>(a: &Series, b: &Vector) -> Vec3 {
    let mut sum = scale_head::<N>(a, b);
    for i in 0..3 {
        sum[i] += a[N] * b[0][i];
    }
    sum
}

/// Returns coefficient N of a b, where b is a vector, without its term a_N b_0, because a_N may not be known yet.
#[inline(always)]
pub fn scale_head<const N: usize>(a: &Series, b: &Vector) -> Vec3 {
    let mut sum = [EMPTY; 3];
    for j in 0..N {
        for i in 0..3 {
            sum[i] += a[j] * b[N - j][i];
        }
    }
    sum
}

/// Returns coefficient N of the scalar product a.b without its term a_0.b_N, because b_N may not be known yet.
#[inline(always)]
pub fn dot_tail<const N: usize>(a: &Vector, b: &Vector) -> f64 {
    let mut sum = [EMPTY; 3];
    for j in 0..N {
        for i in 0..3 {
            sum[i] += a[N - j][i] * b[j][i];
        }
    }
    sum[0] + sum[1] + sum[2]
}

#[inline(always)]
pub fn cross<const N: usize>(a: &Vector, b: &Vector) -> Vec3 {
    let mut sum = [EMPTY; 3];
    for j in 0..N + 1 {
        let ([ax, ay, az], [bx, by, bz]) = (a[j], b[N - j]);
        sum[0] += ay * bz - az * by;
        sum[1] += az * bx - ax * bz;
        sum[2] += ax * by - ay * bx;
    }
    sum
}

/// Returns coefficient N of a x b and of c x d as a pair, for the pairs (a, c) and (b, d). The result is a pair, because a
/// compiler would otherwise vectorise across the components. The function is not inlined, because the compiler would combine
/// its vector lanes with the surrounding code, which takes a tenth more instructions.
#[inline(never)]
pub fn cross_pair<const N: usize>(a: &Pair, b: &Pair) -> [[f64; 2]; 3] {
    let mut sum = [[EMPTY; 2]; 3];
    for j in 0..N + 1 {
        let ([ax, ay, az], [bx, by, bz]) = (&a.0[j], &b.0[N - j]);
        for k in 0..2 {
            sum[0][k] += ay[k] * bz[k] - az[k] * by[k];
            sum[1][k] += az[k] * bx[k] - ax[k] * bz[k];
            sum[2][k] += ax[k] * by[k] - ay[k] * bx[k];
        }
    }
    sum
}

pub fn cross_pair_coefficient(n: usize, a: &Pair, b: &Pair) -> [[f64; 2]; 3] {
    let mut sum = [[EMPTY; 2]; 3];
    for ([ax, ay, az], [bx, by, bz]) in a.0[..=n].iter().zip(b.0[..=n].iter().rev()) {
        for k in 0..2 {
            sum[0][k] += ay[k] * bz[k] - az[k] * by[k];
            sum[1][k] += az[k] * bx[k] - ax[k] * bz[k];
            sum[2][k] += ax[k] * by[k] - ay[k] * bx[k];
        }
    }
    sum
}

pub fn cross_coefficient(n: usize, a: &Vector, b: &Vector) -> Vec3 {
    let terms = a[..=n].iter().zip(b[..=n].iter().rev());
    terms.fold([EMPTY; 3], |sum, (a, b)| vector::add(sum, vector::cross(*a, *b)))
}

pub fn square_coefficient(n: usize, a: &Vector) -> f64 {
    let terms = a[..=n].iter().zip(a[..=n].iter().rev());
    terms.fold(EMPTY, |sum, (a, b)| sum + vector::dot(*a, *b))
}

/// Returns coefficient N of the linear function `a[0] + a[1] t`.
#[inline(always)]
pub fn ramp<const N: usize>(a: &[Vec3; 2]) -> Vec3 {
    if N < 2 { a[N] } else { [0.0; 3] }
}

/// Returns coefficient N of the scalar product of the linear function `ramp[0] + ramp[1] t` and b.
#[inline(always)]
pub fn dot_ramp<const N: usize>(ramp: &[Vec3; 2], b: &Vector) -> f64 {
    let first = vector::dot(ramp[0], b[N]);
    if N == 0 { first } else { first + vector::dot(ramp[1], b[N - 1]) }
}

/// Returns coefficient N of the vector product of a and the linear function `ramp[0] + ramp[1] t`.
#[inline(always)]
pub fn cross_ramp<const N: usize>(a: &Vector, ramp: &[Vec3; 2]) -> Vec3 {
    let first = vector::cross(a[N], ramp[0]);
    if N == 0 { first } else { vector::add(first, vector::cross(a[N - 1], ramp[1])) }
}

/// Coefficients of a quaternion (a, b, c, d), stored as the pairs (-b, a), (c, d), (-d, c) and (a,
/// b). The products of these pairs with the components of the angular velocity w give two
/// components of the quaternion's rate at once.
#[derive(Clone, Debug)]
#[repr(align(16))]
pub struct Attitude([[[f64; 2]; 4]; ORDER + 1]);

pub const ZERO_ATTITUDE: Attitude = Attitude([[[0.0; 2]; 4]; ORDER + 1]);

impl Attitude {
    #[inline(always)]
    pub fn set(&mut self, n: usize, [a, b, c, d]: [f64; 4]) {
        self.0[n] = [[-b, a], [c, d], [-d, c], [a, b]];
    }

    #[inline(always)]
    pub fn set_next(&mut self, n: usize, rate: [f64; 4]) {
        self.set(n + 1, rate.map(|rate| rate * RECIPROCAL[n + 1]));
    }

    #[inline(always)]
    pub fn get(&self, n: usize) -> [f64; 4] {
        let [_, [c, d], _, [a, b]] = self.0[n];
        [a, b, c, d]
    }

    #[inline(always)]
    pub fn value(&self, n: usize, t: f64) -> [f64; 4] {
        let [_, mut cd, _, mut ab] = self.0[n];
        for [_, c, _, a] in self.0[..n].iter().rev() {
            for k in 0..2 {
                cd[k] = cd[k] * t + c[k];
                ab[k] = ab[k] * t + a[k];
            }
        }
        [ab[0], ab[1], cd[0], cd[1]]
    }
}

/// Returns coefficient N of q' = q o (0, w)/2 (Hamilton's product), where `w` is the pair (w, w). The
/// function is not inlined, for the same reason as [`cross_pair`].
#[inline(never)]
pub fn quaternion_rate<const N: usize>(q: &Attitude, w: &Pair) -> [f64; 4] {
    // `EMPTY` is not used, because a body at rest must have the rate 0 and not -0.
    let (mut ab, mut cd) = ([0.0; 2], [0.0; 2]);
    for j in 0..N + 1 {
        let (q, [x, y, z]) = (&q.0[N - j], &w.0[j]);
        for k in 0..2 {
            ab[k] += q[0][k] * x[k] - q[1][k] * y[k] + q[2][k] * z[k];
            cd[k] += q[3][k] * y[k] - q[2][k] * x[k] + q[0][k] * z[k];
        }
    }
    [0.5 * ab[0], 0.5 * ab[1], 0.5 * cd[0], 0.5 * cd[1]]
}

#[inline(always)]
pub fn value<const D: usize>(a: &[[f64; D]; ORDER + 1], n: usize, t: f64) -> [f64; D] {
    a[..=n].iter().rev().fold([0.0; D], |mut sum, x| {
        for i in 0..D {
            sum[i] = sum[i] * t + x[i];
        }
        sum
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::for_each_order;
    use crate::series::ZERO;

    /// At a constant angular velocity w, the attitude quaternion follows q' = q o (0, w)/2, and the
    /// components of a fixed vector in the rotating axes follow y' = -w x y. Both equations have
    /// closed solutions.
    #[test]
    fn a_constant_rate_turns_attitude_and_components_by_rodrigues_formula() {
        let rate = [0.3, -0.8, 0.5];
        let (mut w, mut both) = (ZERO_VECTOR, ZERO_PAIR);
        w[0] = rate;
        both.set(0, rate, rate);
        let mut q = ZERO_ATTITUDE;
        q.set(0, [1.0, 0.0, 0.0, 0.0]);
        let mut y = ZERO_VECTOR;
        y[0] = [1.0, 2.0, -0.5];
        for_each_order!(N => {
            q.set_next(N, quaternion_rate::<N>(&q, &both));
            y[N + 1] = next::<N>(cross::<N>(&y, &w));
        });
        let (t, size) = (0.4, vector::norm(rate));
        let (q, y_t) = (q.value(ORDER, t), value(&y, ORDER, t));
        let (sin, cos) = (f64::sin(size * t / 2.0), f64::cos(size * t / 2.0));
        let exact = [cos, rate[0] / size * sin, rate[1] / size * sin, rate[2] / size * sin];
        // Since |w| t = 0.4, the truncation error is below rounding, so that a few units in the last place remain.
        for (got, exact) in q.iter().zip(exact) {
            assert!((got - exact).abs() < 4e-16, "{got} {exact}");
        }
        let back = vector::transposed_times(&vector::rotation(&exact), y[0]);
        for (got, exact) in y_t.iter().zip(back) {
            assert!((got - exact).abs() < 2e-15, "{got} {exact}");
        }
    }

    #[test]
    fn a_pair_of_vector_series_keeps_both_vectors() {
        let (a, b) = ([1.0, 2.0, 3.0], [-1.0, 0.5, 4.0]);
        let mut both = ZERO_PAIR;
        both.set(0, a, b);
        both.set_next(0, [[4.0, 1.0], [5.0, 2.0], [6.0, 3.0]]);
        both.set_next(1, [[2.0, 8.0]; 3]);
        assert_eq!(both.get(0), [a, b]);
        assert_eq!(both.get(1), [[4.0, 5.0, 6.0], [1.0, 2.0, 3.0]]);
        assert_eq!(both.get(2), [[1.0; 3], [4.0; 3]]);
        assert_eq!(both.value(2, 2.0), [[13.0, 16.0, 19.0], [17.0, 20.5, 26.0]]);
        assert_eq!(both.value(1, 2.0), [[9.0, 12.0, 15.0], [1.0, 4.5, 10.0]]);
    }

    #[test]
    fn the_series_of_an_attitude_keeps_its_quaternions() {
        let mut q = ZERO_ATTITUDE;
        q.set(0, [1.0, 2.0, 3.0, 4.0]);
        q.set_next(0, [1.0, -1.0, 2.0, 0.0]);
        q.set_next(1, [2.0, 4.0, 6.0, 8.0]);
        assert_eq!([q.get(0), q.get(1)], [[1.0, 2.0, 3.0, 4.0], [1.0, -1.0, 2.0, 0.0]]);
        assert_eq!(q.get(2), [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(q.value(2, 2.0), [7.0, 8.0, 19.0, 20.0]);
    }

    #[test]
    fn ramps_are_series_of_two_terms() {
        let (line, mut b) = ([[1.0, 2.0, 3.0], [-1.0, 0.0, 2.0]], ZERO_VECTOR);
        (b[0], b[1], b[2]) = ([1.0, 1.0, 0.0], [0.0, 2.0, 1.0], [3.0, 0.0, 0.0]);
        assert_eq!(
            [ramp::<0>(&line), ramp::<1>(&line), ramp::<2>(&line)],
            [line[0], line[1], [0.0; 3]]
        );
        assert_eq!([dot_ramp::<0>(&line, &b), dot_ramp::<1>(&line, &b)], [3.0, 6.0]);
        assert_eq!(dot_ramp::<2>(&line, &b), 5.0);
        assert_eq!(cross_ramp::<0>(&b, &line), vector::cross(b[0], line[0]));
        let second = vector::add(vector::cross(b[2], line[0]), vector::cross(b[1], line[1]));
        assert_eq!(cross_ramp::<2>(&b, &line), second);
    }

    #[test]
    fn series_products_follow_the_product_rule() {
        let a: [Vec3; 4] = [[1.0, 2.0, -1.0], [3.0, 0.0, 2.0], [0.0, -2.0, 5.0], [4.0, 1.0, 1.0]];
        let b: [Vec3; 4] = [[2.0, -3.0, 1.0], [1.0, 1.0, 0.0], [-1.0, 4.0, 2.0], [0.0, 2.0, -3.0]];
        let (mut x, mut y, mut s) = (ZERO_VECTOR, ZERO_VECTOR, ZERO);
        for j in 0..4 {
            (x[j], y[j], s[j]) = (a[j], b[j], b[j][1]);
        }
        let (mut first, mut second) = (ZERO_PAIR, ZERO_PAIR);
        for j in 0..=ORDER {
            first.set(j, x[j], y[j]);
            second.set(j, y[j], x[j]);
        }
        let plain = |n: usize, term: &dyn Fn(usize, usize) -> f64| -> f64 {
            (0..=n).filter(|&j| j < 4 && n - j < 4).map(|j| term(j, n - j)).sum()
        };
        for_each_order!(N => {
            let dot = plain(N, &|i, j| vector::dot(a[i], b[j]));
            if N < 4 {
                assert_eq!(dot_tail::<N>(&x, &y) + vector::dot(x[0], y[N]), dot);
            }
            assert_eq!(square_vector::<N>(&x), plain(N, &|i, j| vector::dot(a[i], a[j])));
            let squares = products::<N>(&x);
            for (which, (k, l)) in
                [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].iter().enumerate()
            {
                assert_eq!(squares[which], plain(N, &|i, j| a[i][*k] * a[j][*l]));
            }
            for i in 0..3 {
                let crossed = plain(N, &|j, k| vector::cross(a[j], b[k])[i]);
                assert_eq!(cross::<N>(&x, &y)[i], crossed);
                assert_eq!(cross_pair::<N>(&first, &second)[i][0], crossed);
                assert_eq!(cross_pair::<N>(&first, &second)[i][1], -crossed);
                let scaled = plain(N, &|j, k| b[j][1] * a[k][i]);
                assert_eq!(scale::<N>(&s, &x)[i], scaled);
                if N < 4 {
                    let newest = s[N] * x[0][i];
                    assert_eq!(scale_head::<N>(&s, &x)[i] + newest, scaled);
                }
            }
        });
    }
}
