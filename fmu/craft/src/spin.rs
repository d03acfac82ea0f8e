//! Spin of a tank's liquid: angular momentum L of the liquid's vorticity about the tank's centre, three continuous
//! states in tank axes.
//!
//! ```text
//! H gains Gamma L,  E gains L.I^-1 L/2        Gamma = diag(gamma, gamma, 1),  I = diag(A', A', I_zz)
//! s  = I^-1 L - Gamma w                        slip: rotation of the liquid against the tank
//! L' = s x L - K s                             K = diag(K_t, K_t, K_z) = decay I
//! torque on the craft   -(Gamma L' + w x Gamma L)       dissipation   s.K s
//! ```
//!
//! With no other torque H' = -w x H in body axes, and E' = w.(H' + w x H) - s.K s: momentum is conserved and the energy
//! decreases by exactly the dissipation, in motions of any size. L' does not contain w', so that the spin changes neither
//! the mass matrix nor the response to an impulse.
//!
//! The liquid of a full spheroid with the semi-axes a, a, c moves so without approximation (Poincare): A' = m (a^2 + c^2)/5,
//! I_zz = 2 m a^2/5, gamma = 2 a c/(a^2 + c^2), and the inertia of its potential flow, m (a^2 - c^2)^2/(5 (a^2 + c^2)), is the
//! rigid liquid's I_0. For a partly full tank gamma = 1 and A' = I_zz: the spin then follows the tank's axis by friction only.
//!
//! A gyroscopic mode (`surface.rs`) depends on the spin rate W = L_z/I_zz and reacts on the slip,
//!
//! ```text
//! s_z gains sum of m l^2 [(1 - C) tau + epsilon W u]/I_zz
//! ```
//!
//! because s = -dR/dL for the Routhian R, which has -m l^2 [(1 - C) W tau + epsilon W^2 u/2].
//!
//! Source: Poincare's and Kelvin's flow with uniform vorticity in a rotating ellipsoid.

use formulas::limits::SpinLimit;
use taylor::number::Number;
use taylor::space::{self, Vector, ZERO_VECTOR};
use taylor::vector::{
    Mat3, Vec3, add, constant, cross, dot, largest, rotation, sub, times, transposed_times,
    unit_quaternion,
};

use crate::constrained::ConstrainedBob;
use crate::parameters::Tank;

/// Parameters of a tank's spinning liquid. The vectors are the diagonals of matrices in tank axes
/// (symbols of the module's head).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spin {
    axes: Mat3,
    inverse: Vec3,  // I^-1
    coupling: Vec3, // Gamma
    friction: Vec3, // K
}

/// The spinning liquid at an instant: `torque` on the craft and angular momentum Gamma L, body axes; derivative L' by time,
/// tank axes; energy and dissipated power; rate of spin W and its derivative W'.
pub(crate) struct SpinNow<T> {
    pub torque: Vec3<T>,
    pub momentum: Vec3<T>,
    pub rate: Vec3<T>,
    pub energy: T,
    pub dissipation: T,
    pub turning: [T; 2],
}

fn multiply<T: Number>(diagonal: Vec3, x: Vec3<T>) -> Vec3<T> {
    [0, 1, 2].map(|i| x[i] * diagonal[i])
}

impl Spin {
    /// Returns the parameters of the spin; `None` if the tank's liquid has no spin.
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

    /// Returns the rate of spin W = L_z/I_zz about the tank's axis, rad/s, for the angular momentum `l` of the liquid.
    pub fn turning<T: Number>(&self, l: Vec3<T>) -> T {
        l[2] * self.inverse[2]
    }

    /// Returns the motion of the spinning liquid from its angular momentum `l` (tank axes) and the
    /// angular velocity `w` of the craft (body axes). `reaction` is the sum of the slosh modes'
    /// contributions to I_zz s_z, the moment of inertia times the slip about the tank's axis.
    pub fn now<T: Number>(&self, l: Vec3<T>, w: Vec3<T>, reaction: T) -> SpinNow<T> {
        let axes: Mat3<T> = self.axes.map(constant);
        let w = transposed_times(&axes, w);
        let turned = multiply(self.inverse, l);
        let mut slip = sub(turned, multiply(self.coupling, w));
        slip[2] = slip[2] + reaction * self.inverse[2];
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
            turning: [self.turning(l), self.turning(rate)],
        }
    }
}

/// Quantities of mode 1 that give its natural frequency omega_0, to which the rate of spin is compared: 1/l, 1/m; k/m, 1/s2;
/// and the smallest specific force along the tank, m/s2, that is used in omega_0^2.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpinScale {
    pub inv_l: f64,
    pub k_m: f64,
    pub g_floor: f64,
    pub limit: SpinLimit,
}

impl SpinScale {
    /// Returns the spin ratio 2 Omega/omega_0 and the spin number Omega^2 R/g, which show how close the tank is to
    /// the limits of the model. `axial` is the specific force along the tank, m/s2, and `rate` the rate Omega at
    /// which the liquid turns, rad/s.
    pub fn numbers<T: Number>(&self, axial: T, rate: T) -> [T; 2] {
        let omega2 = axial.at_least(self.g_floor) * self.inv_l + T::constant(self.k_m);
        let share = rate * rate / omega2;
        [share.sqrt() * 2.0, share * self.limit.radius_over_length()]
    }
}

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
    /// Creates the series of the spinning liquid of a tank; `None` if the tank's liquid has no
    /// spin. `index` is the tank's number, which counts from 0.
    pub fn new(tank: &Tank, index: usize) -> Option<SpinSeries> {
        let [l, momentum, w, slip] = [ZERO_VECTOR; 4];
        Some(SpinSeries { tank: index, spin: Spin::new(tank)?, l, momentum, w, slip })
    }

    pub fn start(&mut self, l: Vec3) {
        self.l[0] = l;
    }

    /// Returns coefficient n of the torque of the spinning liquid on the craft and of the
    /// dissipated power, from coefficient n of the angular velocity `w`; both vectors are in body
    /// axes. Sets coefficient n + 1 of the liquid's angular momentum L, and of the rate of spin W
    /// in all gyroscopic modes among `modes`.
    #[inline(never)]
    pub fn expand(&mut self, n: usize, w: Vec3, modes: &mut [ConstrainedBob]) -> (Vec3, f64) {
        let Spin { axes, inverse, coupling, friction } = self.spin;
        let turning = self.spin.turning(self.l[n]);
        let mut reaction = 0.0;
        for bob in modes.iter_mut().filter(|bob| bob.tank == self.tank) {
            bob.set_spin(n, turning);
            reaction += bob.reaction_on_spin(n, w);
        }
        self.w[n] = transposed_times(&axes, w);
        self.momentum[n] = multiply(coupling, self.l[n]);
        let mut slip = sub(multiply(inverse, self.l[n]), multiply(coupling, self.w[n]));
        slip[2] += reaction * inverse[2];
        self.slip[n] = slip;
        let turned = space::cross_coefficient(n, &self.slip, &self.l);
        let rate = sub(turned, multiply(friction, slip));
        self.l[n + 1] = rate.map(|x| x / (n + 1) as f64);
        let turning = self.spin.turning(self.l[n + 1]);
        for bob in modes.iter_mut().filter(|bob| bob.tank == self.tank) {
            bob.set_spin(n + 1, turning);
        }
        let precession = space::cross_coefficient(n, &self.w, &self.momentum);
        let torque = add(multiply(coupling, rate), precession).map(|x| -x);
        let [xx, yy, zz, ..] = space::product_coefficients(n, &self.slip);
        (times(&axes, torque), friction[0] * xx + friction[1] * yy + friction[2] * zz)
    }

    /// Returns the liquid's angular momentum L at `t` (s) after the start of the expansion, from its series up to order n.
    pub fn state_at(&self, n: usize, t: f64) -> Vec3 {
        space::value(&self.l, n, t)
    }

    /// Returns the magnitude of the liquid's angular momentum L divided by the inertia, rad/s, to which the allowed error of
    /// the spin is relative.
    pub fn rate_scale(&self) -> f64 {
        self.coefficient_norm(0)
    }

    pub fn coefficient_norm(&self, n: usize) -> f64 {
        largest(multiply(self.spin.inverse, self.l[n]))
    }
}
