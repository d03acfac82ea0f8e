//! Spin of a tank's liquid: angular momentum L of the liquid's vorticity about the tank's centre, three states in tank axes.
//!
//! ```text
//! H gains Gamma L,  E gains L.I^-1 L/2        Gamma = diag(gamma, gamma, 1),  I = diag(A', A', I_zz)
//! s  = I^-1 L - Gamma w                        slip: rotation of the liquid against the tank
//! L' = s x L - K s                             K = diag(K_t, K_t, K_z) = decay I
//! torque on the craft   -(Gamma L' + w x Gamma L)       dissipation   s.K s
//! ```
//!
//! With no other torque H' = -w x H in body axes, and E' = w.(H' + w x H) - s.K s: momentum is conserved and the energy
//! decreases by exactly the dissipation, in motions of any size. L' does not contain w', so that neither mass matrix nor
//! impulses change.
//!
//! The liquid of a full spheroid with the semi-axes a, a, c moves so without approximation (Poincare): A' = m (a^2 + c^2)/5,
//! I_zz = 2 m a^2/5, gamma = 2 a c/(a^2 + c^2), and the inertia of its potential flow, m (a^2 - c^2)^2/(5 (a^2 + c^2)), is the
//! rigid liquid's I_0. For a partly full tank gamma = 1 and A' = I_zz: the spin then follows the tank's axis by friction only.
//!
//! Source: Poincare's and Kelvin's flow with uniform vorticity in a rotating ellipsoid.

use taylor::number::Number;
use taylor::space::{self, Vector, ZERO_VECTOR};
use taylor::vector::{
    Mat3, Vec3, add, constant, cross, dot, largest, rotation, sub, times, transposed_times,
    unit_quaternion,
};

use crate::parameters::Tank;

/// Parameters of a tank's spinning liquid, with the symbols above; vectors are diagonals in tank axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spin {
    axes: Mat3,
    inverse: Vec3,
    coupling: Vec3,
    friction: Vec3,
}

/// The spinning liquid at an instant: `torque` on the craft and angular momentum Gamma L, body axes; L', tank
/// axes; energy and dissipation.
pub(crate) struct SpinNow<T> {
    pub torque: Vec3<T>,
    pub momentum: Vec3<T>,
    pub rate: Vec3<T>,
    pub energy: T,
    pub dissipation: T,
}

fn multiply<T: Number>(diagonal: Vec3, x: Vec3<T>) -> Vec3<T> {
    [0, 1, 2].map(|i| x[i] * diagonal[i])
}

impl Spin {
    /// Returns `None` for a tank whose liquid has no spin.
    pub fn new(tank: &Tank) -> Option<Spin> {
        let inertia = tank.spin_inertias()?;
        let (gamma, [axial, across]) = (tank.spin_coupling, tank.spin_decay);
        let decay = [across, across, axial];
        Some(Spin {
            axes: rotation(&unit_quaternion(tank.q)),
            inverse: inertia.map(|i| 1.0 / i),
            coupling: [gamma, gamma, 1.0],
            friction: [0, 1, 2].map(|i| decay[i] * inertia[i]),
        })
    }

    /// Returns the liquid's state with L = `l`, tank axes, at the angular velocity `w`, body axes.
    pub fn now<T: Number>(&self, l: Vec3<T>, w: Vec3<T>) -> SpinNow<T> {
        let axes: Mat3<T> = self.axes.map(constant);
        let w = transposed_times(&axes, w);
        let turned = multiply(self.inverse, l);
        let slip = sub(turned, multiply(self.coupling, w));
        let drag = multiply(self.friction, slip);
        let rate = sub(cross(slip, l), drag);
        let momentum = multiply(self.coupling, l);
        let torque = add(multiply(self.coupling, rate), cross(w, momentum)).map(|x| -x);
        SpinNow {
            torque: times(&axes, torque),
            momentum: times(&axes, momentum),
            rate,
            energy: dot(l, turned) * 0.5,
            dissipation: dot(slip, drag),
        }
    }
}

/// The power series of a tank's spinning liquid, in tank axes; `tank` counts from 0.
#[derive(Clone, Debug)]
pub(crate) struct SpinSeries {
    pub tank: usize,
    spin: Spin,
    l: Vector,
    momentum: Vector,
    w: Vector,
    slip: Vector,
}

impl SpinSeries {
    /// Returns `None` for a tank whose liquid has no spin; `index` is the tank's number, which counts from 0.
    pub fn new(tank: &Tank, index: usize) -> Option<SpinSeries> {
        let [l, momentum, w, slip] = [ZERO_VECTOR; 4];
        Some(SpinSeries { tank: index, spin: Spin::new(tank)?, l, momentum, w, slip })
    }

    pub fn start(&mut self, l: Vec3) {
        self.l[0] = l;
    }

    /// Returns coefficient n of the torque on the craft, body axes, and of the dissipation, from coefficient n of the
    /// angular velocity `w`, body axes. Sets coefficient n + 1 of L.
    #[inline(never)]
    pub fn expand(&mut self, n: usize, w: Vec3) -> (Vec3, f64) {
        let Spin { axes, inverse, coupling, friction } = self.spin;
        self.w[n] = transposed_times(&axes, w);
        self.momentum[n] = multiply(coupling, self.l[n]);
        let slip = sub(multiply(inverse, self.l[n]), multiply(coupling, self.w[n]));
        self.slip[n] = slip;
        let turned = space::cross_coefficient(n, &self.slip, &self.l);
        let rate = sub(turned, multiply(friction, slip));
        self.l[n + 1] = rate.map(|x| x / (n + 1) as f64);
        let precession = space::cross_coefficient(n, &self.w, &self.momentum);
        let torque = add(multiply(coupling, rate), precession).map(|x| -x);
        let [xx, yy, zz, ..] = space::product_coefficients(n, &self.slip);
        (times(&axes, torque), friction[0] * xx + friction[1] * yy + friction[2] * zz)
    }

    /// Returns L at `t` after the start, from the series up to order n.
    pub fn state_at(&self, n: usize, t: f64) -> Vec3 {
        space::value(&self.l, n, t)
    }

    /// Returns the scale of L over its inertia for error control, rad/s.
    pub fn rate_scale(&self) -> f64 {
        self.coefficient_norm(0)
    }

    pub fn coefficient_norm(&self, n: usize) -> f64 {
        largest(multiply(self.spin.inverse, self.l[n]))
    }
}
