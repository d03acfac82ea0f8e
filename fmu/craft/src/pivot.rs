//! What a pivot does to the craft besides holding O: stiffness against tilt, damping about each axis.
//!
//! The pivot's axis is the inertial z axis; Z = C^T e_z is its direction in body axes, (0, 0, 1) for a craft that stands
//! upright, and Z_y, -Z_x are its small angles of tilt about x and y.
//!
//! ```text
//! U = (k_x Z_y^2 + k_y Z_x^2)/2
//! torque = Z x (k_y Z_x, k_x Z_y, 0) - (c_x w_x, c_y w_y, c_z w_z),      dissipation sum of c_i w_i^2
//! ```
//!
//! The torque follows from U exactly, for Z' = Z x w: U' = -torque.w. Turning about the axis is free but for c_z, through
//! any number of revolutions. A polynomial in Z and w: it goes into the series as it stands.

use taylor::number::Number;
use taylor::space::{Vector, products};
use taylor::vector::{Mat3, Vec3};

/// Stiffness and damping of the pivot, body axes.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Pivot {
    /// Stiffness against tilt about x and y, N m/rad.
    pub k: [f64; 2],
    /// Damping coefficient about each axis, N m s/rad.
    pub c: Vec3,
}

impl Pivot {
    /// Whether it does anything but hold O.
    pub(crate) fn acts(&self) -> bool {
        *self != Pivot::default()
    }

    /// Coefficient N of torque (N m) and dissipation (W), from Z and w, with the products of w's components.
    #[inline(always)]
    pub(crate) fn load<const N: usize>(&self, z: &Vector, w: &Vector, ww: [f64; 6]) -> (Vec3, f64) {
        let [_, _, _, xy, xz, yz] = products::<N>(z);
        let Pivot { k: [k_x, k_y], c } = *self;
        let torque = [
            -k_x * yz - c[0] * w[N][0],
            k_y * xz - c[1] * w[N][1],
            (k_x - k_y) * xy - c[2] * w[N][2],
        ];
        (torque, c[0] * ww[0] + c[1] * ww[1] + c[2] * ww[2])
    }

    /// The torque, N m, dissipation, W, and energy, J, at an instant; `axes` is body to inertial.
    pub(crate) fn present<T: Number>(&self, axes: &Mat3<T>, w: Vec3<T>) -> (Vec3<T>, T, T) {
        let [x, y, z] = axes[2];
        let Pivot { k: [k_x, k_y], c } = *self;
        let torque = [
            -(y * z * k_x) - w[0] * c[0],
            x * z * k_y - w[1] * c[1],
            x * y * (k_x - k_y) - w[2] * c[2],
        ];
        let dissipation = w[0] * w[0] * c[0] + w[1] * w[1] * c[1] + w[2] * w[2] * c[2];
        (torque, dissipation, (y * y * k_x + x * x * k_y) * 0.5)
    }
}
