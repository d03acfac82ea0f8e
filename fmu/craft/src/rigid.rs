//! Mass properties of rigid bodies about O, and the 6 x 6 linear system that the craft's accelerations solve:
//!
//! ```text
//! M = [ m 1     -[S]x ]     S = sum of m s,  I = sum of J + m (|s|^2 1 - s s^T), both about O
//!     [ [S]x      I   ]     M [a; w'] = [force; torque about O]
//! ```
//!
//! Source: Newton and Euler about a point that is not the centre of mass.

use core::ops::Mul;

use taylor::number::Number;
use taylor::vector::{Mat3, Vec3, add, constant, cross, dot, scale, times};

/// Smallest ratio of an element of D, in the factorisation L D L^T of a mass matrix, to the diagonal element of the matrix.
/// A matrix with a smaller ratio counts as singular.
pub(crate) const SINGULAR: f64 = 1e-12;

pub type Mat6<T = f64> = [[T; 6]; 6];

/// Mass m, kg, first moment S = m s, kg m, and second moment I, kg m2, of a rigid body about O.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rigid<T = f64> {
    pub mass: T,
    pub moment: Vec3<T>,
    pub inertia: Mat3<T>,
}

impl Rigid {
    /// Creates a body of mass m at s with the inertia `own` about its centre of mass.
    pub fn new(m: f64, s: Vec3, own: &Mat3) -> Rigid {
        let s2 = dot(s, s);
        let mut inertia = *own;
        for i in 0..3 {
            for j in 0..3 {
                inertia[i][j] += m * (if i == j { s2 } else { 0.0 } - s[i] * s[j]);
            }
        }
        Rigid { mass: m, moment: scale(m, s), inertia }
    }

    pub fn lift<T: Number>(&self) -> Rigid<T> {
        Rigid {
            mass: T::constant(self.mass),
            moment: constant(self.moment),
            inertia: self.inertia.map(constant),
        }
    }

    /// Returns the body as dual numbers. Only its inertia has a derivative, `slope`, kg m2.
    pub fn with_inertia_slope<T: Number>(&self, slope: &Mat3) -> Rigid<T> {
        let element = |i: usize, j: usize| T::with_slope(self.inertia[i][j], slope[i][j]);
        Rigid { inertia: [0, 1, 2].map(|i| [0, 1, 2].map(|j| element(i, j))), ..self.lift() }
    }
}

impl<T: Number> Rigid<T> {
    /// Creates an axially symmetric body. Its axis has the direction e and goes through the point d. The mass distribution along
    /// the axis has the moments m, m z and m z^2, where z is the distance from d. `i_z` is the moment of inertia about e, and
    /// `i_0` the moment of inertia about a perpendicular axis without the part m z^2.
    pub fn on_axis([d, e]: [Vec3; 2], [m, first, second]: [T; 3], [i_0, i_z]: [T; 2]) -> Rigid<T> {
        let across = i_0 + second + m * dot(d, d) + first * (2.0 * dot(d, e));
        let along = i_z - i_0 - second;
        let element = |i: usize, j: usize| {
            along * (e[i] * e[j]) - m * (d[i] * d[j]) - first * (d[i] * e[j] + e[i] * d[j])
        };
        let [xy, xz, yz] = [element(0, 1), element(0, 2), element(1, 2)];
        let [xx, yy, zz] = [0, 1, 2].map(|i| element(i, i) + across);
        Rigid {
            mass: m,
            moment: [0, 1, 2].map(|i| m * d[i] + first * e[i]),
            inertia: [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]],
        }
    }

    pub fn combined_with(&self, b: &Rigid<T>) -> Rigid<T> {
        let mut sum = *self;
        sum.mass = sum.mass + b.mass;
        sum.moment = add(sum.moment, b.moment);
        for i in 0..3 {
            sum.inertia[i] = add(sum.inertia[i], b.inertia[i]);
        }
        sum
    }

    /// Returns the mass matrix of the body, which maps the acceleration a of O and the angular
    /// acceleration w' to the force and the torque about O.
    pub fn mass_matrix(&self) -> Mat6<T> {
        let [x, y, z] = self.moment;
        let [i_x, i_y, i_z] = self.inertia;
        let (m, o) = (self.mass, T::constant(0.0));
        [
            [m, o, o, o, z, -y],
            [o, m, o, -z, o, x],
            [o, o, m, y, -x, o],
            [o, -z, y, i_x[0], i_x[1], i_x[2]],
            [z, o, -x, i_y[0], i_y[1], i_y[2]],
            [-y, x, o, i_z[0], i_z[1], i_z[2]],
        ]
    }

    /// Returns the force and the torque about O that the motion of the body requires, M [a; w'] + [w x (w x S); w x (I
    /// w)], with its mass matrix M, first moment S and inertia I about O.
    pub fn inertial_wrench(&self, a: Vec3<T>, w: Vec3<T>, w_d: Vec3<T>) -> [Vec3<T>; 2] {
        let Rigid { mass, moment: s, inertia } = *self;
        let [centripetal, gyroscopic] = self.gyroscopic_wrench(w);
        let force = add(a.map(|x| x * mass), add(cross(w_d, s), centripetal));
        let torque = add(cross(s, a), add(times(&inertia, w_d), gyroscopic));
        [force, torque]
    }

    /// Returns the part of [`Rigid::inertial_wrench`] that depends on the angular velocity `w`
    /// only: the force w x (w x S) and the torque w x (I w).
    pub fn gyroscopic_wrench(&self, w: Vec3<T>) -> [Vec3<T>; 2] {
        [cross(w, cross(w, self.moment)), cross(w, times(&self.inertia, w))]
    }
}

/// Adds the inertia of a bob of mass `m` at the end of a rod to a mass matrix. Because the bob moves freely across the
/// rod, it has inertia only along the rod: the matrix gains m u u^T with u = [p; P x p], where p is the direction of the
/// rod and P its hinge.
#[inline(always)]
pub fn add_rank_one(matrix: &mut Mat6, m: f64, u: &[f64; 6]) {
    for i in 0..6 {
        for j in 0..=i {
            let x = m * u[i] * u[j];
            matrix[i][j] += x;
            if i != j {
                matrix[j][i] += x;
            }
        }
    }
}

/// Adds m u u^T to the lower triangle of a matrix.
#[inline(always)]
pub fn add_lower_rank_one<T: Number>(matrix: &mut Mat6<T>, m: T, u: &[T; 6]) {
    for i in 0..6 {
        let row = m * u[i];
        for j in 0..=i {
            matrix[i][j] = matrix[i][j] + row * u[j];
        }
    }
}

/// Returns a unit force along the direction `p` of a rod and its moment about O, [p; P x p], for the `hinge` at P.
#[inline(always)]
pub fn along_rod<T: Number>(p: Vec3<T>, hinge: Vec3<T>) -> [T; 6] {
    let c = cross(hinge, p);
    [p[0], p[1], p[2], c[0], c[1], c[2]]
}

/// Largest inverse of a mass, 1/kg, or of a moment of inertia, 1/(kg m2), for which products with masses up to 1e12 kg and
/// arms up to 1e9 m do not overflow.
const LARGEST_INVERSE: f64 = 1e30;

/// Smallest divisor in the solution of a linear system, so that the factors of any matrix are finite. Its inverse is above
/// [`LARGEST_INVERSE`], by which a singular matrix is recognised.
pub(crate) const SMALLEST_DIVISOR: f64 = 0.5 / LARGEST_INVERSE;

/// Factorisation L D L^T of a symmetric positive definite matrix; L has ones on its diagonal and is used only
/// below it, and `inverse` is 1/D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factors<T = f64, const N: usize = 6> {
    l: [[T; N]; N],
    inverse: [T; N],
}

impl<T: Number, const N: usize> Factors<T, N> {
    /// Factorises a matrix, of which only the lower triangle is read.
    #[inline(always)]
    pub fn new(matrix: &[[T; N]; N]) -> Factors<T, N> {
        let zero = T::constant(0.0);
        let mut factors = Factors { l: [[zero; N]; N], inverse: [zero; N] };
        factors.set(matrix);
        factors
    }

    /// Factorises a matrix that may not be positive definite, because an external integrator that diverges may set any states.
    /// For such a matrix all factors are 0 and [`Factors::solve`] returns 0, because products of the true factors could overflow.
    pub fn definite_or_zero(matrix: &[[T; N]; N]) -> Factors<T, N> {
        let zero = T::constant(0.0);
        let mut factors = Factors { l: [[zero; N]; N], inverse: [zero; N] };
        for j in 0..N {
            let d = factors.set_row(matrix, j);
            if d.value() < SMALLEST_DIVISOR {
                return Factors { l: [[zero; N]; N], inverse: [zero; N] };
            }
            factors.inverse[j] = d.at_least(SMALLEST_DIVISOR).recip();
        }
        factors
    }

    /// Replaces the factors by those of another matrix in place, because a copy would take 1/40 of the instructions of a step.
    #[inline(always)]
    pub fn set(&mut self, matrix: &[[T; N]; N]) {
        for j in 0..N {
            let d = self.set_row(matrix, j);
            self.inverse[j] = d.at_least(SMALLEST_DIVISOR).recip();
        }
    }

    /// Sets row j of the triangular factor L from the rows before it. Returns the element of the diagonal factor
    /// D in this row.
    #[inline(always)]
    fn set_row(&mut self, matrix: &[[T; N]; N], j: usize) -> T {
        let Factors { l, inverse } = self;
        // Compute row j of L D, and from it row j of L.
        let mut d = matrix[j][j];
        for k in 0..j {
            let mut x = matrix[j][k];
            for i in 0..k {
                x = x - l[j][i] * l[k][i];
            }
            l[j][k] = x;
        }
        for k in 0..j {
            let x = l[j][k] * inverse[k];
            d = d - l[j][k] * x;
            l[j][k] = x;
        }
        d
    }
}

impl<M: Copy> Factors<M> {
    /// Solves the linear system with the factorised matrix for the right-hand side `b`, which may consist of dual numbers
    /// although the matrix is constant.
    #[inline(always)]
    pub fn solve<T: Number + Mul<M, Output = T>>(&self, b: [Vec3<T>; 2]) -> [Vec3<T>; 2] {
        let mut x = [b[0][0], b[0][1], b[0][2], b[1][0], b[1][1], b[1][2]];
        self.solve_in_place(&mut x);
        [[x[0], x[1], x[2]], [x[3], x[4], x[5]]]
    }
}

impl<M: Copy, const N: usize> Factors<M, N> {
    /// Replaces the right-hand side x by the solution; see [`Factors::solve`].
    #[inline(always)]
    pub fn solve_in_place<T: Number + Mul<M, Output = T>>(&self, x: &mut [T; N]) {
        let l = &self.l;
        for i in 1..N {
            for j in 0..i {
                x[i] = x[i] - x[j] * l[i][j];
            }
        }
        for i in 0..N {
            x[i] = x[i] * self.inverse[i];
        }
        for i in (0..N - 1).rev() {
            for j in i + 1..N {
                x[i] = x[i] - x[j] * l[j][i];
            }
        }
    }
}

/// Returns the smallest ratio of an element of D, in the factorisation L D L^T, to the matrix's diagonal
/// element. It is small if the matrix is nearly singular, and 0 if the matrix is not positive definite or
/// its inverse exceeds [`LARGEST_INVERSE`].
pub fn smallest_pivot(matrix: &Mat6) -> f64 {
    let Factors { inverse, .. } = Factors::new(matrix);
    // NaN is outside the range, so that it counts as singular.
    if !inverse.iter().all(|x| (0.0..=LARGEST_INVERSE).contains(x)) {
        return 0.0;
    }
    let pivot = |i: usize| 1.0 / (inverse[i] * f64::max(matrix[i][i], SMALLEST_DIVISOR));
    (0..6).map(pivot).fold(1.0, f64::min)
}

impl Factors {
    /// Returns L^-1 b with each row divided by the square root of its pivot, where L is the triangular factor of this matrix
    /// M. Applied to rows and columns of an added mass M_a, it gives the symmetric matrix with the eigenvalues of M^-1 M_a.
    fn half_solve(&self, b: &[f64; 6]) -> [f64; 6] {
        let mut x = *b;
        for i in 1..6 {
            for j in 0..i {
                x[i] -= self.l[i][j] * x[j];
            }
        }
        core::array::from_fn(|i| x[i] * libm::sqrt(self.inverse[i]))
    }
}

/// Returns the largest eigenvalue of M^-1 A for symmetric matrices M and A, where `m` are the factors of M. It is computed
/// by Jacobi rotations of a symmetric matrix with the same eigenvalues.
pub fn largest_eigenvalue(m: &Factors, a: &Mat6) -> f64 {
    let rows = a.map(|row| m.half_solve(&row));
    let mut b: Mat6 = core::array::from_fn(|i| m.half_solve(&rows.map(|row| row[i])));
    // Convergence is quadratic: six sweeps reach rounding accuracy, the others are a margin.
    for _ in 0..12 {
        for p in 0..5 {
            for q in p + 1..6 {
                // The element is negligible, and the following expressions would overflow.
                if b[p][q].abs() <= 1e-150 * (b[q][q] - b[p][p]).abs() {
                    continue;
                }
                let half = (b[q][q] - b[p][p]) / (2.0 * b[p][q]);
                let sign = if half < 0.0 { -1.0 } else { 1.0 };
                let t = sign / (half.abs() + libm::sqrt(half * half + 1.0));
                let cos = 1.0 / libm::sqrt(t * t + 1.0);
                let sin = t * cos;
                for k in 0..6 {
                    let (x, y) = (b[k][p], b[k][q]);
                    (b[k][p], b[k][q]) = (cos * x - sin * y, sin * x + cos * y);
                }
                for k in 0..6 {
                    let (x, y) = (b[p][k], b[q][k]);
                    (b[p][k], b[q][k]) = (cos * x - sin * y, sin * x + cos * y);
                }
            }
        }
    }
    (0..6).map(|i| b[i][i]).fold(f64::NEG_INFINITY, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solving_a_linear_system_inverts_the_matrix_product() {
        let mut rng = fastrand::Rng::with_seed(5);
        let mut between = |low: f64, high: f64| low + rng.f64() * (high - low);
        for _ in 0..100 {
            let own = [[910.0, 14.0, -9.0], [14.0, 860.0, 6.0], [-9.0, 6.0, 640.0]];
            let s = [between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0)];
            let mut matrix = Rigid::new(1180.0, s, &own).mass_matrix();
            for _ in 0..4 {
                let p = [between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0)];
                let hinge = [between(-1.0, 1.0), 0.3, -0.5];
                add_rank_one(&mut matrix, 100.0, &along_rod(p, hinge));
            }
            let factors = Factors::new(&matrix);
            assert!(smallest_pivot(&matrix) > 0.01);
            let x: [f64; 6] = core::array::from_fn(|_| between(-1.0, 1.0));
            let b = matrix.map(|row| (0..6).map(|i| row[i] * x[i]).sum::<f64>());
            let [a, w_d] = factors.solve([[b[0], b[1], b[2]], [b[3], b[4], b[5]]]);
            for (got, want) in a.iter().chain(&w_d).zip(x) {
                // The error is rounding times the condition number of the matrix, which is below 100 after
                // its rows are scaled.
                assert!((got - want).abs() < 1e-13, "{got} {want}");
            }
        }
    }

    #[test]
    fn a_mass_matrix_without_inertia_about_an_axis_is_singular() {
        let rod = [[5.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 0.0]];
        let matrix = Rigid::new(10.0, [0.0, 0.0, 0.4], &rod).mass_matrix();
        assert!(smallest_pivot(&matrix) < 1e-12);
    }

    /// For A = m u u^T the largest eigenvalue of M^-1 A is m u^T M^-1 u.
    #[test]
    fn the_largest_eigenvalue_of_a_rank_one_matrix_is_its_quadratic_form() {
        let own = [[910.0, 14.0, -9.0], [14.0, 860.0, 6.0], [-9.0, 6.0, 640.0]];
        let factors = Factors::new(&Rigid::new(310.0, [0.1, -0.3, 0.21], &own).mass_matrix());
        let u = along_rod([0.36, 0.48, 0.8], [0.5, 0.7, -0.9]);
        let mut a = [[0.0; 6]; 6];
        add_rank_one(&mut a, 128.0, &u);
        let [x, y] = factors.solve([[u[0], u[1], u[2]], [u[3], u[4], u[5]]]);
        let expected = 128.0 * (dot([u[0], u[1], u[2]], x) + dot([u[3], u[4], u[5]], y));
        let got = largest_eigenvalue(&factors, &a);
        assert!((got / expected - 1.0).abs() < 1e-14, "{got} {expected}");
    }
}
