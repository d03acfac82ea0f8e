//! Column vectors of three components, matrices by rows, and unit quaternions with the scalar first. Most functions are
//! generic over values and derivatives.

use crate::number::Number;

pub type Vec3<T = f64> = [T; 3];

pub type Mat3<T = f64> = [[T; 3]; 3];

pub type Quaternion<T = f64> = [T; 4];

/// Returns three components of an array, from the index `at` on, as a vector.
#[inline(always)]
pub fn part(x: &[f64], at: usize) -> Vec3 {
    [x[at], x[at + 1], x[at + 2]]
}

#[inline(always)]
pub fn add<T: Number>(a: Vec3<T>, b: Vec3<T>) -> Vec3<T> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub fn sub<T: Number>(a: Vec3<T>, b: Vec3<T>) -> Vec3<T> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub fn scale<T: Number>(a: T, b: Vec3<T>) -> Vec3<T> {
    [a * b[0], a * b[1], a * b[2]]
}

#[inline(always)]
pub fn dot<T: Number>(a: Vec3<T>, b: Vec3<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub fn cross<T: Number>(a: Vec3<T>, b: Vec3<T>) -> Vec3<T> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
pub fn times<T: Number>(a: &Mat3<T>, b: Vec3<T>) -> Vec3<T> {
    [dot(a[0], b), dot(a[1], b), dot(a[2], b)]
}

#[inline(always)]
pub fn transposed_times<T: Number>(a: &Mat3<T>, b: Vec3<T>) -> Vec3<T> {
    [0, 1, 2].map(|i| a[0][i] * b[0] + a[1][i] * b[1] + a[2][i] * b[2])
}

pub fn constant<T: Number>(a: Vec3) -> Vec3<T> {
    a.map(T::constant)
}

/// Returns the magnitude of the largest component. Unlike with `f64::max` a NaN is not lost, because it must end the step.
#[inline(always)]
pub fn largest(a: Vec3) -> f64 {
    let larger = |a: f64, b: f64| if b > a { b } else { a };
    larger(larger(a[0].abs(), a[1].abs()), a[2].abs())
}

#[inline(always)]
pub fn norm<T: Number>(a: Vec3<T>) -> T {
    dot(a, a).sqrt()
}

/// Returns the matrix of a rotation. If q rotates from frame B to frame A, the matrix maps components in B
/// to components in A.
#[inline(always)]
pub fn rotation<T: Number>(q: &Quaternion<T>) -> Mat3<T> {
    let [w, x, y, z] = *q;
    let one = T::constant(1.0);
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let (xy, xz, yz) = (x * y, x * z, y * z);
    let (wx, wy, wz) = (w * x, w * y, w * z);
    [
        [one - (yy + zz) * 2.0, (xy - wz) * 2.0, (xz + wy) * 2.0],
        [(xy + wz) * 2.0, one - (xx + zz) * 2.0, (yz - wx) * 2.0],
        [(xz - wy) * 2.0, (yz + wx) * 2.0, one - (xx + yy) * 2.0],
    ]
}

/// Returns q/|q|, the unit quaternion of the same rotation.
#[inline(always)]
pub fn unit_quaternion<T: Number>(q: Quaternion<T>) -> Quaternion<T> {
    let share = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt().recip();
    q.map(|x| x * share)
}

/// Returns the derivative of q/|q| for a change of q by dq, where `unit` is q/|q|.
pub fn unit_quaternion_slope(unit: &Quaternion, q: &Quaternion, dq: &Quaternion) -> Quaternion {
    let dot = |a: &Quaternion, b: &Quaternion| (0..4).map(|i| a[i] * b[i]).sum::<f64>();
    let (along, size) = (dot(unit, dq), libm::sqrt(dot(q, q)));
    core::array::from_fn(|i| (dq[i] - unit[i] * along) / size)
}

/// Returns the direction p and its rate p', corrected so that |p| = 1 and p.p' = 0.
#[inline(always)]
pub fn on_sphere<T: Number>(p: Vec3<T>, p_d: Vec3<T>) -> [Vec3<T>; 2] {
    let unit = scale(norm(p).recip(), p);
    [unit, sub(p_d, scale(dot(unit, p_d), unit))]
}

/// Returns the derivative of [`on_sphere`] for a change of p and p' by dp and dp'.
pub fn on_sphere_slope(p: Vec3, p_d: Vec3, dp: Vec3, dp_d: Vec3) -> [Vec3; 2] {
    let [unit, _] = on_sphere(p, p_d);
    let d_unit = scale(1.0 / norm(p), sub(dp, scale(dot(unit, dp), unit)));
    let along = dot(unit, p_d);
    let d_along = dot(d_unit, p_d) + dot(unit, dp_d);
    [d_unit, sub(dp_d, add(scale(d_along, unit), scale(along, d_unit)))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::Dual;

    const A: Vec3 = [1.0, 2.0, -3.0];
    const B: Vec3 = [0.5, -1.0, 4.0];

    #[test]
    fn vector_and_matrix_products_are_exact_for_small_integers() {
        assert_eq!((add(A, B), sub(A, B)), ([1.5, 1.0, 1.0], [0.5, 3.0, -7.0]));
        assert_eq!((scale(2.0, A), dot(A, B)), ([2.0, 4.0, -6.0], -13.5));
        assert_eq!(cross(A, B), [5.0, -5.5, -2.0]);
        let m = [A, B, [1.0, 0.0, 2.0]];
        assert_eq!(times(&m, [1.0, 1.0, 2.0]), [-3.0, 7.5, 5.0]);
        assert_eq!(transposed_times(&m, [1.0, 2.0, 3.0]), [5.0, 0.0, 11.0]);
        assert_eq!(
            (largest(A), largest([-9.0, 2.0, 1.0]), largest([0.0, -7.0, 1.0])),
            (3.0, 9.0, 7.0)
        );
        assert_eq!((norm([3.0, 0.0, 4.0]), part(&[9.0, 1.0, 2.0, 3.0], 1)), (5.0, [1.0, 2.0, 3.0]));
        assert_eq!(constant::<f64>(A), A);
    }

    #[test]
    fn a_quaternion_turns_by_its_angle_about_its_axis() {
        let turned = |axis: Vec3, angle: f64, x: Vec3| {
            let (sin, cos) = libm::sincos(angle / 2.0);
            let [a, b, c] = scale(sin / norm(axis), axis);
            times(&rotation(&[cos, a, b, c]), x)
        };
        let quarter = core::f64::consts::FRAC_PI_2;
        let close = |a: Vec3, b: Vec3| assert!(norm(sub(a, b)) < 4e-15, "{a:?} {b:?}");
        close(turned([1.0, 0.0, 0.0], quarter, [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
        close(turned([0.0, 1.0, 0.0], quarter, [0.0, 0.0, 1.0]), [1.0, 0.0, 0.0]);
        close(turned([0.0, 0.0, 1.0], quarter, [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
        let (u, angle) = (scale(1.0 / norm(A), A), 0.7);
        let (sin, cos) = libm::sincos(angle);
        let rodrigues =
            add(add(scale(cos, B), scale(sin, cross(u, B))), scale((1.0 - cos) * dot(u, B), u));
        close(turned(A, angle, B), rodrigues);
    }

    #[test]
    fn a_normalised_vector_has_unit_length_and_a_perpendicular_rate() {
        let q = unit_quaternion([2.0, -4.0, 5.0, 6.0]);
        assert_eq!(q, [2.0, -4.0, 5.0, 6.0].map(|x| x / 9.0));
        let [p, p_d] = on_sphere(A, B);
        assert!((norm(p) - 1.0).abs() < 1e-15 && dot(p, p_d).abs() < 1e-15);
        assert!(norm(cross(p, A)) < 1e-15 && dot(p, A) > 0.0);
        // The correction removes only the component along p from the rate.
        assert!(norm(sub(sub(B, p_d), scale(dot(p, B), p))) < 1e-15);
    }

    #[test]
    fn the_derivatives_of_unit_quaternions_and_unit_vectors_equal_those_of_dual_numbers() {
        let (q, dq) = ([0.9, -0.1, 0.5, 0.3], [0.2, 0.7, -0.4, 0.1]);
        let dual = |x: f64, dx: f64| Dual::with_slope(x, dx);
        let exact = unit_quaternion([0, 1, 2, 3].map(|i| dual(q[i], dq[i])));
        let slope = unit_quaternion_slope(&unit_quaternion(q), &q, &dq);
        for i in 0..4 {
            assert!((slope[i] - exact[i].result()).abs() < 1e-15, "{i}");
        }
        let (da, db) = ([0.3, -0.2, 0.6], [-0.5, 0.1, 0.2]);
        let with = |x: Vec3, dx: Vec3| [0, 1, 2].map(|i| dual(x[i], dx[i]));
        let exact = on_sphere(with(A, da), with(B, db));
        let slope = on_sphere_slope(A, B, da, db);
        for k in 0..2 {
            for i in 0..3 {
                assert!((slope[k][i] - exact[k][i].result()).abs() < 1e-15, "{k} {i}");
            }
        }
    }
}
