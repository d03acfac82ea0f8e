use nalgebra::Matrix2;

use analysis::exponential::exponential;

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
