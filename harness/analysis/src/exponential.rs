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

#[cfg(test)]
mod tests {
    use nalgebra::Matrix2;

    use super::exponential;

    fn exponential_by_nalgebra(matrix: Matrix2<f64>) -> Matrix2<f64> {
        exponential(matrix, matrix.abs().sum(), |matrix| matrix.exp())
    }

    #[test]
    fn the_exponential_of_a_huge_matrix_is_finite() {
        assert_eq!(
            exponential_by_nalgebra(Matrix2::new(-1e300, 0.0, 0.0, 0.0)),
            Matrix2::new(0.0, 0.0, 0.0, 1.0)
        );
        assert_eq!(exponential_by_nalgebra(Matrix2::new(-1e12, 0.0, 0.0, -1e15)), Matrix2::zeros());
        let small = Matrix2::new(-0.2, 1.0, -1.0, -0.2);
        assert_eq!(exponential_by_nalgebra(small), small.exp());
        assert!(
            exponential_by_nalgebra(Matrix2::new(f64::INFINITY, 0.0, 0.0, 1.0))
                .iter()
                .all(|x| x.is_nan())
        );
        assert!(
            exponential_by_nalgebra(Matrix2::new(1e300, 1e300, 1e300, f64::MAX))
                .iter()
                .all(|x| !x.is_finite())
        );
    }
}
