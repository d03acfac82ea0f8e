//! Torques of a pivot, besides the force that keeps O in place: stiffness against tilt, damping and dry
//! friction about each axis.
//!
//! The pivot's axis is the inertial z axis. Z = C^T e_z is its direction in body axes, (0, 0, 1) for an upright craft.
//! Z_y and -Z_x are the craft's small tilt angles about x and y.
//!
//! ```text
//! U = (k_x Z_y^2 + k_y Z_x^2)/2
//! torque = Z x (k_y Z_x, k_x Z_y, 0) - (c_x w_x, c_y w_y, c_z w_z) - (r_x, r_y, r_z)
//! r_i = (C_i + D_i exp(-(w_i/w_s)^2)) tanh(w_i/eps)                         dissipation sum of c_i w_i^2 + r_i w_i
//! ```
//!
//! The torque of the stiffness follows exactly from the potential energy U, because Z' = Z x w gives U' = -torque.w. Only c_z and
//! r_z act on rotation about the axis, through any number of revolutions. Without dry friction the torque is a polynomial in Z
//! and w and enters the series unchanged.
//!
//! r is Stribeck's curve (Rubaga's thesis, eq. 5.1), in which the jump at rest is smoothed over eps, as in HubSlosh's
//! friction model `stribeck_smooth`. Instead of sticking, an axis under a torque below the static friction therefore creeps,
//! at |w| ~ eps |torque|/(C + D).

use taylor::number::Number;
use taylor::series::{self, Series, ZERO};
use taylor::space::{Vector, products};
use taylor::vector::{Mat3, Vec3};

/// Pivot of the craft at O, body axes: stiffness `k` against tilt about x and y, N m/rad, damping coefficient `c` about each
/// axis, N m s/rad, and dry friction.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[allow(missing_docs)]
pub struct Pivot {
    pub k: [f64; 2],
    pub c: Vec3,
    pub friction: PivotFriction,
}

/// Dry friction of the pivot about each body axis: Coulomb torque `c` and excess `d` of the static friction torque over it,
/// N m, Stribeck speed `omega_s` and width `eps` of the smoothed sign function, rad/s, both above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct PivotFriction {
    pub c: Vec3,
    pub d: Vec3,
    pub omega_s: f64,
    pub eps: f64,
}

impl Default for PivotFriction {
    fn default() -> Self {
        PivotFriction { c: [0.0; 3], d: [0.0; 3], omega_s: 0.1, eps: 1e-3 }
    }
}

impl PivotFriction {
    pub(crate) fn acts(&self) -> bool {
        self.c.iter().chain(&self.d).any(|torque| *torque > 0.0)
    }

    fn present<T: Number>(&self, w: Vec3<T>) -> Vec3<T> {
        core::array::from_fn(|i| {
            let v = w[i] * (1.0 / self.omega_s);
            let curve = T::constant(self.c[i]) + (-(v * v)).exp() * self.d[i];
            curve * (w[i] * (1.0 / self.eps)).tanh()
        })
    }
}

impl Pivot {
    /// Returns true if the pivot has stiffness, damping or friction, so that it exerts a torque on the craft.
    pub(crate) fn acts(&self) -> bool {
        let Pivot { k, c, friction } = *self;
        k != [0.0; 2] || c != [0.0; 3] || friction.acts()
    }

    /// Returns coefficient N of the pivot's torque (N m) and of its dissipated power (W), both without dry friction,
    /// from the pivot's axis Z, the angular velocity w and the products of its components.
    #[inline(always)]
    pub(crate) fn load<const N: usize>(&self, z: &Vector, w: &Vector, ww: [f64; 6]) -> (Vec3, f64) {
        let [_, _, _, xy, xz, yz] = products::<N>(z);
        let Pivot { k: [k_x, k_y], c, .. } = *self;
        let torque = [
            -k_x * yz - c[0] * w[N][0],
            k_y * xz - c[1] * w[N][1],
            (k_x - k_y) * xy - c[2] * w[N][2],
        ];
        (torque, c[0] * ww[0] + c[1] * ww[1] + c[2] * ww[2])
    }

    /// Returns the pivot's torque (N m), dissipated power (W) and stored energy (J) at one instant. `axes` is the matrix that
    /// rotates from body axes to inertial axes.
    pub(crate) fn present<T: Number>(&self, axes: &Mat3<T>, w: Vec3<T>) -> (Vec3<T>, T, T) {
        let [x, y, z] = axes[2];
        let Pivot { k: [k_x, k_y], c, friction } = *self;
        let mut torque = [
            -(y * z * k_x) - w[0] * c[0],
            x * z * k_y - w[1] * c[1],
            x * y * (k_x - k_y) - w[2] * c[2],
        ];
        let mut dissipation = w[0] * w[0] * c[0] + w[1] * w[1] * c[1] + w[2] * w[2] * c[2];
        if friction.acts() {
            let r = friction.present(w);
            for i in 0..3 {
                torque[i] = torque[i] - r[i];
                dissipation = dissipation + r[i] * w[i];
            }
        }
        (torque, dissipation, (y * y * k_x + x * x * k_y) * 0.5)
    }
}

/// Power series of the dry friction torque r = (C + D e) t about one axis, where e = exp(u) with u
/// = -(w/w_s)^2, and t = tanh(v) with v = w/eps, for the rate w.
#[derive(Clone, Debug)]
pub(crate) struct Rubbing {
    c: f64,
    d: f64,
    inv_omega_s: f64,
    inv_eps: f64,
    w: Series,
    u_d: Series,
    e: Series,
    v_d: Series,
    t: Series,
    sech2: Series,
    curve: Series,
    r: Series,
}

impl Rubbing {
    pub(crate) fn new(p: &PivotFriction, i: usize) -> Rubbing {
        Rubbing {
            c: p.c[i],
            d: p.d[i],
            inv_omega_s: 1.0 / p.omega_s,
            inv_eps: 1.0 / p.eps,
            w: ZERO,
            u_d: ZERO,
            e: ZERO,
            v_d: ZERO,
            t: ZERO,
            sech2: ZERO,
            curve: ZERO,
            r: ZERO,
        }
    }

    /// Returns coefficient n of the friction torque r and of the power r w, from coefficient n of the rate w.
    pub(crate) fn expand(&mut self, n: usize, w: f64) -> (f64, f64) {
        self.w[n] = w;
        let u = -series::square(n, &self.w) * self.inv_omega_s * self.inv_omega_s;
        self.e[n] = if n == 0 { libm::exp(u) } else { series::chain(n, u, &mut self.u_d, &self.e) };
        let v = w * self.inv_eps;
        self.t[n] =
            if n == 0 { libm::tanh(v) } else { series::chain(n, v, &mut self.v_d, &self.sech2) };
        let t2 = series::square(n, &self.t);
        self.sech2[n] = if n == 0 { 1.0 - t2 } else { -t2 };
        self.curve[n] = series::constant(n, self.c) + self.d * self.e[n];
        self.r[n] = series::mul(n, &self.curve, &self.t);
        (self.r[n], series::mul(n, &self.r, &self.w))
    }

    /// Estimates the time, s, over which the series of the friction torque converges reliably, from
    /// the first three coefficients w, w' and w''/2 of the rate.
    ///
    /// The smoothed sign function tanh v, with v = w/eps, has its nearest poles at the distance
    /// sqrt(v^2 + (pi/2)^2). Half of this distance is used, because at large |v| tanh is so flat
    /// that its coefficients do not show the poles.
    ///
    /// The excess of static friction, exp(-v^2) with v = w/w_s, has no poles. Beyond v = 3 its
    /// terms are too small for any tolerance but grow before they decay: over a change dv the term
    /// of order n is (2 v dv)^n/n!. The time is therefore limited so that either v stays above 5.3,
    /// where the term is below 1e-12, or the terms decay from order 5 on.
    pub(crate) fn convergence_radius(&self, w: [f64; 3]) -> f64 {
        if self.c + self.d == 0.0 {
            return f64::INFINITY;
        }
        let until = |scale: f64, way: f64| {
            let [v1, v2] = [w[1], w[2]].map(|x| (x * scale).abs());
            series::time_within(way, v1, v2)
        };
        let v = w[0] * self.inv_eps;
        let sign = until(self.inv_eps, libm::sqrt(v * v + 2.4674) / 2.0);
        let v = (w[0] * self.inv_omega_s).abs();
        if self.d == 0.0 || v < 3.0 {
            return sign;
        }
        sign.min(until(self.inv_omega_s, f64::max(v - 5.3, 2.5 / v)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taylor::vector::{cross, dot};

    const PIVOT: Pivot = Pivot {
        k: [3.0, 5.0],
        c: [0.5, 0.25, 2.0],
        friction: PivotFriction { c: [0.0; 3], d: [0.0; 3], omega_s: 0.1, eps: 1e-3 },
    };
    const Z: Vec3 = [0.25, -0.5, 0.75];
    const W: Vec3 = [0.5, -1.0, 2.0];

    /// The expected values were computed by hand for one inertial z axis Z, in body axes, and one
    /// angular velocity w. The torque of the springs is Z x (5/4, -3/2, 0) = (9/8, 15/16, 1/4), and
    /// the torque of the damper c w = (1/4, -1/4, 4). The dissipated power is c w^2 = 1/8 + 1/4 +
    /// 8, and twice the energy is 2 U = 3/4 + 5/16.
    #[test]
    fn pivot_torque_energy_and_dissipation_equal_those_of_a_spring_and_a_damper_about_each_axis() {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], Z];
        let (torque, dissipation, energy) = PIVOT.present(&axes, W);
        assert_eq!(torque, [1.125 - 0.25, 0.9375 + 0.25, 0.25 - 4.0]);
        assert_eq!((dissipation, energy), (8.375, 0.53125));
        // U' = -torque.w for Z' = Z x w, apart from the dissipation.
        let turning = cross(Z, W);
        let change = 3.0 * Z[1] * turning[1] + 5.0 * Z[0] * turning[0];
        assert_eq!(change, -dot(torque, W) - dissipation);
        // Power series of constant Z and w give the same torque and power. Any single parameter makes the pivot act.
        let series = |x: Vec3| {
            let mut all: Vector = [[0.0; 3]; taylor::series::ORDER + 1];
            all[0] = x;
            all
        };
        let ww = [0.25, 1.0, 4.0, -0.5, 1.0, -2.0];
        assert_eq!(PIVOT.load::<0>(&series(Z), &series(W), ww), (torque, dissipation));
        for (pivot, acts) in [
            (Pivot::default(), false),
            (Pivot { k: [0.0, 1.0], ..Pivot::default() }, true),
            (Pivot { k: [1.0, 0.0], ..Pivot::default() }, true),
            (Pivot { c: [0.0, 0.0, 1.0], ..Pivot::default() }, true),
            (
                Pivot {
                    friction: PivotFriction { d: [0.0, 1.0, 0.0], ..PIVOT.friction },
                    ..Pivot::default()
                },
                true,
            ),
        ] {
            assert_eq!(pivot.acts(), acts, "{pivot:?}");
        }
    }

    /// The craft turns about one axis at the Stribeck speed of this axis. The friction torque opposes the rate and has the
    /// value that the parameters of this axis give.
    #[test]
    fn dry_friction_of_a_pivot_has_its_own_stribeck_curve_about_each_axis() {
        let friction =
            PivotFriction { c: [1.0, 2.0, 4.0], d: [0.5, 0.25, 3.0], omega_s: 0.1, eps: 0.01 };
        let pivot = Pivot { friction, ..Pivot::default() };
        let upright = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for i in 0..3 {
            for sign in [1.0, -1.0] {
                let mut w = [0.0; 3];
                w[i] = sign * 0.1;
                let (torque, dissipation, energy) = pivot.present(&upright, w);
                let held = (friction.c[i] + friction.d[i] * libm::exp(-1.0)) * libm::tanh(10.0);
                let mut expected = [0.0; 3];
                expected[i] = -sign * held;
                for k in 0..3 {
                    assert!((torque[k] - expected[k]).abs() < 1e-15 * 8.0, "{i}: {torque:?}");
                }
                assert!((dissipation - 0.1 * held).abs() < 1e-15 && energy == 0.0, "{i}");
                let mut rubbing = Rubbing::new(&friction, i);
                let (r, rw) = rubbing.expand(0, w[i]);
                assert!((r + expected[i]).abs() < 1e-15 * 8.0 && (rw - 0.1 * held).abs() < 1e-15);
            }
        }
    }

    /// Power series of dry friction are used up to half of the distance to the nearest pole of the
    /// smoothed sign tanh v, which near rest is v = i pi/2. The time to this point follows from v'
    /// t, or from v'' t^2/2 if v' = 0. With an excess D of static friction, at rates from w = 4 w_s
    /// on, w may also change by at most 2.5/4 of w_s.
    #[test]
    fn power_series_of_dry_friction_are_used_up_to_half_the_distance_to_the_nearest_pole() {
        let friction = PivotFriction { c: [1.0; 3], d: [0.0; 3], omega_s: 0.1, eps: 0.01 };
        let way = 0.5 * libm::sqrt(2.4674);
        let rubbing = Rubbing::new(&friction, 0);
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-14, "{a} {b}");
        near(rubbing.convergence_radius([0.0, 0.0, 3.0]), libm::sqrt(way / 300.0));
        near(rubbing.convergence_radius([0.0, -3.0, 0.0]), way / 300.0);
        // Both v' and v'' count: the time t follows from |v'| t + |v''| t^2/2 = way.
        let speed = 10.0 + libm::sqrt(100.0 + 400.0 * way);
        near(rubbing.convergence_radius([0.0, 0.1, -1.0]), 2.0 * way / speed);
        assert_eq!(rubbing.convergence_radius([0.0; 3]), f64::INFINITY);
        // At v = 3, away from rest, the pole is farther away.
        near(rubbing.convergence_radius([0.03, 0.01, 0.0]), 0.5 * libm::sqrt(9.0 + 2.4674));
        let curved = Rubbing::new(&PivotFriction { d: [1.0; 3], ..friction }, 0);
        near(curved.convergence_radius([0.4, 0.01, 0.0]), 2.5 / 4.0 / 0.1);
        near(curved.convergence_radius([0.29, 0.01, 0.0]), 0.5 * libm::sqrt(29.0 * 29.0 + 2.4674));
        near(curved.convergence_radius([0.8, 0.01, 0.0]), (8.0 - 5.3) / 0.1);
        let none = Rubbing::new(&PivotFriction { c: [0.0; 3], ..friction }, 0);
        assert_eq!(none.convergence_radius([0.0, 1.0, 1.0]), f64::INFINITY);
    }
}
