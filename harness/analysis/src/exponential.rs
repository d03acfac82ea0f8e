//! Computes the exponential of a matrix of any magnitude in bounded time.

use std::ops::Mul;

/// Largest sum of the absolute values of a matrix's elements with which the matrix is passed to
/// nalgebra's exponential. With larger matrices the 27th power, which that function computes, could
/// overflow; it would then never return.
const LARGEST: f64 = 1e9;

/// Returns the exponential of `matrix`. `size` is the sum of the absolute values of the matrix's
/// elements, and `exp` is nalgebra's exponential. A matrix that is too large for `exp` is halved n
/// times, and the exponential of the result is squared n times. If the matrix is not finite, the
/// result is NaN.
pub fn exponential<M>(matrix: M, size: f64, exp: impl Fn(&M) -> M) -> M
where
    M: Clone + Mul<M, Output = M> + Mul<f64, Output = M>,
{
    if !size.is_finite() {
        return matrix * f64::NAN;
    }
    let halvings = (size / LARGEST).log2().ceil().max(0.0) as i32;
    let mut power = exp(&(matrix * 0.5_f64.powi(halvings)));
    for _ in 0..halvings {
        power = power.clone() * power;
    }
    power
}
