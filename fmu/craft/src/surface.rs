//! Slosh of finite amplitude: a bob (slosh mass) on a surface of revolution about the tank's axis. Two coefficients, s and
//! kappa, describe waves to the third order, and four further coefficients the next order. The Lagrangian of the bob in a
//! tank at rest, and the frequencies that follow from the Lagrangian at the amplitude A, are:
//!
//! ```text
//! L = m |q'|^2/2 + m s (q.q')^2/(2 l^2) - m w^2 (|q|^2/2 + kappa |q|^4/(8 l^2)),   q = l p_perp,  A = |q|/l
//! planar motion    frequency^2 = w^2 [1 + (3 kappa/8 - s/2) A^2]
//! circular motion  frequency^2 = w^2 [1 + kappa A^2/2]
//! ```
//!
//! A pendulum has s = kappa = 1, because its bob lies on a sphere: the sphere rho = P + l p rises by l (A^2/2 + A^4/8), and its rise contributes
//! (q.q')^2/l^2 to the squared speed. The states p and p' keep their meaning, so that p_perp is the displacement over l.
//! Other coefficients lift the bob along the axis and add kinetic energy within the liquid, without momentum:
//!
//! ```text
//! rho = P + l p + z e,   z = (kappa - 1) l u^2/8,   u = |p_perp|^2
//! E_i = m (s - 1) l^2 sigma^2/2,   sigma = p_perp.p' = u'/2
//! ```
//!
//! On the bob acts the specific force, and not a potential. Momentum, moments and weight for any motion of the tank
//! follow from the position of the bob. If p changes by dp, which is perpendicular to p (and in a planar mode to b),
//! the bob moves by
//!
//! ```text
//! drho = l D dp,   D = 1 + beta e p_perp^T,   beta = (kappa - 1) u/2
//! ```
//!
//! Newton's law along drho with Lagrange's terms of E_i, per mass and length, determines y, the part of p'' perpendicular
//! to p (p'' = y - |p'|^2 p), with the projection Pi:
//!
//! ```text
//! Pi { D^T (G + l D y) + [(s - 1)(l sigma' + 2 l' sigma) + s' l sigma] p_perp } = 0
//! sigma' = p_perp.y + |p_perp'|^2 - u |p'|^2
//! G = a + w' x rho + w x (w x rho) + 2 w x rho' + (rho'' without y) + phi/m
//! ```
//!
//! p_perp and e have the projections -eta e_t and e_t = e - eta p, eta = p.e. The slosh mass therefore moves as a pendulum
//! except along the meridian:
//!
//! ```text
//! M = Pi (D^T D + (s - 1) p_perp p_perp^T) Pi = Pi + gamma e_t e_t^T,   gamma = (1 - beta eta)^2 - 1 + (s - 1) eta^2
//! l y = -M^-1 Pi [D^T G + i],   i = [(s - 1)(l psi + 2 l' sigma) + s' l sigma] p_perp,   psi = |p_perp'|^2 - u |p'|^2
//! force on the craft at rho   F = phi - m (G + l D y) = phi - m (N G - D M^-1 Pi i),   N = 1 - D M^-1 Pi D^T
//! ```
//!
//! In the craft's mass matrix N replaces the projection p p^T of a pendulum. The eigenvalues of N are at most 1. For s < 1
//! one of them is negative: the bob then reduces the inertia of the craft, which must be large enough. 1 + gamma u is the
//! inertia of the bob along the meridian, divided by the inertia of a pendulum. If s is negative, as in shallow tanks, this
//! inertia is positive only up to some angle. The model ends where it falls to [`LEAST_INERTIA`].
//!
//! Drag and centring are phi = c l D p' + k l p_perp, with the power c l^2 |D p'|^2. If the tank drains, the outflowing mass
//! takes its share of E_i with it. The coefficients s and kappa of the fill table then depend on time, so that the height z
//! gains the rate kappa' l u^2/8.
//!
//! **Beyond the third order** ([`Higher`]) the height z and the energy E_i of a tank that does not drain may be
//!
//! ```text
//! z   = l [(kappa - 1) u^2/8 + kappa_2 u^3/16],   beta = (kappa - 1) u/2 + 3 kappa_2 u^2/8
//! E_i = m l^2 [S sigma^2 + T tau^2]/2,   S = s - 1 + s_2 u,   T = t + t_2 u
//! tau = e.(p_perp x p_perp') + w_e u,   w_e = e.w
//! ```
//!
//! tau is the rate of rotary motion relative to inertial axes, because the rotation of a tank about its axis does not move a
//! wave. E_i therefore has an angular momentum about the axis, m l^2 u T tau, but no momentum. With n = e x p_perp the force
//! per mass and length is
//!
//! ```text
//! (S sigma)' p_perp - (s_2 sigma^2 + t_2 tau^2 + 2 T tau w_e) p_perp + (T tau)' n + 2 T tau e x p_perp'
//! M gains T n n^T,   i gains the part without y,   tau' = n.y + w_e' u + 2 w_e sigma
//! torque on the craft   rho x F - m l^2 [(u T tau)' e + u T tau w x e]
//! ```
//!
//! Drag acts on E_i as on the bob, so that a wave decays as its energy does: phi does not change, but i gains (c l/m) [S
//! sigma p_perp + T (n.p') n] and the power c l^2 [S sigma^2 + T (n.p')^2].
//!
//! The two parts of the torque that E_i causes cancel about the axis. tau' contains the accelerations [a; w'] through the
//! vector v = [n; rho x n - l u e], which adds m T/(1 + T u) v v^T to the mass matrix.
//!
//! **In liquid that spins** at the rate W (`spin.rs`) a mode may have a gyroscopic coefficient C and a stiffness epsilon, in the
//! Routhian -m l^2 [(1 - C) W tau + epsilon W^2 u/2]:
//!
//! ```text
//! T tau becomes P = T tau - (1 - C) W, except in E_i, t_2 tau^2 and the drag      force gains epsilon W^2 p_perp
//! E_i gains m l^2 epsilon W^2 u/2
//! ```
//!
//! In a tank that turns with its liquid, small motions with and against the spin have, seen from the tank, the frequencies
//! l = C W +- sqrt(C^2 W^2 + w^2 + (epsilon + 1 - 2 C) W^2). A pendulum, which does not take part in the spin, has C = 1
//! and epsilon = 0. The FMUs' parameters are C (`gyroscopic`) and epsilon + 1 - 2 C (`gyroscopic_stiffness`).
//!
//! Source: the coefficients come from `formulas::third_order` and `formulas::energy_terms`; the equations follow from these
//! energies by Lagrange's method. tests/craft/surface.rs checks the equations against Newton's law in Cartesian coordinates
//! with the surface as a constraint, and the equations of a draining tank against differences of the Lagrangian.

use alloc::format;
use alloc::string::String;

use taylor::number::Number;
use taylor::vector::{Vec3, add, cross, dot, scale, sub};

use crate::table::Jet;

/// Smallest inertia of a bob along its meridian, divided by a pendulum's, at which the model is valid.
pub(crate) const LEAST_INERTIA: f64 = 0.5;

const ANGLE_STEP: f64 = core::f64::consts::PI / 1800.0;

/// Coefficients s_2, kappa_2, t and t_2 of a mode beyond the third order (module's head). In liquid
/// that spins, `gyroscopic` contains 1 - C and epsilon of the mode (`spin.rs`). A mode without such
/// terms has only zeros.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Higher {
    pub inertia: f64,
    pub stiffness: f64,
    pub rotary: [f64; 2],
    pub gyroscopic: [f64; 2],
}

impl Higher {
    /// Returns true if any coefficient of the mode beyond the third order is not 0.
    pub fn is_beyond_third_order(&self) -> bool {
        Higher { gyroscopic: [0.0; 2], ..*self } != Higher::default()
    }

    /// Returns the reaction of this mode on the spinning liquid, (1 - C) tau + epsilon W u, from
    /// the rate of rotary motion `tau` and from `turned` = W u, the spin rate times the squared
    /// displacement. The mode contributes m l^2 times this value to the liquid's moment of inertia
    /// about the tank's axis times its slip (`spin.rs`).
    pub fn reaction<T: Number>(&self, tau: T, turned: T) -> T {
        tau * self.gyroscopic[0] + turned * self.gyroscopic[1]
    }

    pub fn rotary_inertia<T: Number>(&self, u: T) -> T {
        T::constant(self.rotary[0]) + u * self.rotary[1]
    }
}

/// The coefficients s - 1 and kappa - 1 of a mode, which are 0 for a pendulum, and the coefficients beyond the third order.
/// The latter are `None` if all are 0, so that their terms are not computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Surface<T = f64> {
    inertia: T,
    stiffness: T,
    higher: Option<Higher>,
}

impl<T: Number> Surface<T> {
    /// Returns the surface of a mode with the coefficients s and kappa, also for s = kappa = 1, the sphere of a pendulum.
    pub fn from_coefficients([s, kappa]: [T; 2]) -> Surface<T> {
        let one = T::constant(1.0);
        Surface { inertia: s - one, stiffness: kappa - one, higher: None }
    }

    fn slope_factor(&self, u: T) -> T {
        let rise = u * (self.stiffness * 0.5);
        match &self.higher {
            Some(higher) => rise + u * u * (0.375 * higher.stiffness),
            None => rise,
        }
    }

    fn meridian_factor(&self, u: T) -> T {
        match &self.higher {
            Some(higher) => self.inertia + u * higher.inertia,
            None => self.inertia,
        }
    }

    /// Returns the inertia of the bob for motion along the meridian of its surface, relative to the inertia of a
    /// pendulum. `eta` is p.e, the cosine of the angle from the tank's axis, and `u` the squared displacement across
    /// the axis over l^2.
    pub fn meridian_inertia(&self, eta: T, u: T) -> T {
        let one = T::constant(1.0);
        let tilt = match self.higher {
            Some(_) => one - self.slope_factor(u) * eta,
            None => one - u * eta * (self.stiffness * 0.5),
        };
        // This is the inertia because eta^2 + u = 1.
        eta * eta * (one + u * self.meridian_factor(u)) + u * tilt * tilt
    }
}

impl Surface {
    pub const SPHERE: Surface = Surface { inertia: 0.0, stiffness: 0.0, higher: None };

    pub fn higher(&self) -> Option<Higher> {
        self.higher
    }

    pub fn inner(&self) -> f64 {
        self.inertia
    }

    pub fn inner_at(&self, u: f64) -> f64 {
        self.meridian_factor(u)
    }

    pub fn is_sphere(&self) -> bool {
        self.stiffness == 0.0 && self.higher.is_none()
    }

    /// Returns (kappa - 1)/8, the factor of l u^2 in the height z of the bob along the tank's axis
    /// (symbols of the module's head).
    pub fn lift_of_square(&self) -> f64 {
        0.125 * self.stiffness
    }

    pub fn lift(&self, u: f64) -> f64 {
        let lift = self.lift_of_square() * u * u;
        match &self.higher {
            Some(higher) => lift + 0.0625 * higher.stiffness * u * u * u,
            None => lift,
        }
    }

    /// Returns (kappa - 1)/2, the factor of u in the slope beta of the surface (symbols of the
    /// module's head).
    pub fn bend(&self) -> f64 {
        0.5 * self.stiffness
    }

    /// Returns beta, the slope of the bob's surface at the squared displacement `u`: the bob rises
    /// along the tank's axis at the rate z' = l beta p_perp.p' (symbols of the module's head).
    pub fn rise(&self, u: f64) -> f64 {
        self.slope_factor(u)
    }

    pub fn new(s: f64, kappa: f64, higher: Higher) -> Option<Surface> {
        let higher = (higher != Higher::default()).then_some(higher);
        let is_pendulum = s == 1.0 && kappa == 1.0 && higher.is_none();
        (!is_pendulum).then(|| Surface { higher, ..Surface::from_coefficients([s, kappa]) })
    }

    pub fn lift_to<T: Number>(&self) -> Surface<T> {
        let [inertia, stiffness] = [self.inertia, self.stiffness].map(T::constant);
        Surface { inertia, stiffness, higher: self.higher }
    }

    /// Returns an upper bound of the distance of the bob from its hinge, divided by l, at slosh angles up to 45 degrees.
    pub fn reach(&self) -> f64 {
        let reach = 1.0 + self.stiffness.abs() / 32.0;
        match &self.higher {
            Some(higher) => reach + higher.stiffness.abs() / 128.0,
            None => reach,
        }
    }

    /// Returns the largest mass by which the bob can reduce the craft's inertia in one direction,
    /// divided by the bob's mass, from 0 to 1. Slosh angles up to 45 degrees, or up to the end of
    /// the model, are included. The result is minus the smallest eigenvalue of the matrix N in the
    /// module's head.
    pub fn inertia_reduction(&self) -> f64 {
        let at = |k: u32| {
            let u = 0.5 * f64::from(k) / 64.0;
            let eta = -libm::sqrt(1.0 - u);
            let inertia = self.meridian_inertia(eta, u);
            let [around, reduction] = self.around(u);
            let along = -self.meridian_factor(u) * eta * eta * u / inertia;
            (inertia >= LEAST_INERTIA && around >= LEAST_INERTIA).then(|| along.max(reduction))
        };
        (0..=64).map_while(at).fold(0.0, f64::max)
    }

    /// Returns the inertia of the bob across the meridian of its surface, divided by a pendulum's,
    /// and minus the eigenvalue of N (module's head) in this direction. `u` is the squared
    /// displacement across the tank's axis over l^2.
    fn around(&self, u: f64) -> [f64; 2] {
        let Some(higher) = &self.higher else { return [1.0, 0.0] };
        let more = higher.rotary_inertia(u) * u;
        [1.0 + more, -more / f64::max(1.0 + more, 0.5 * LEAST_INERTIA)]
    }

    pub fn least_inertia(&self, eta: f64, u: f64) -> f64 {
        f64::min(self.meridian_inertia(eta, u), self.around(u)[0])
    }

    fn holds(&self, angle: f64) -> bool {
        let (sin, cos) = libm::sincos(angle);
        self.least_inertia(-cos, sin * sin) >= LEAST_INERTIA
    }

    /// Returns the largest slosh angle, rad, for which this surface is a valid model, rounded down
    /// to a tenth of a degree. The limit follows from the coefficients s and kappa.
    pub fn largest_angle(&self) -> f64 {
        let angle = |k: u32| ANGLE_STEP * f64::from(k);
        (0..=1800).map(angle).take_while(|angle| self.holds(*angle)).fold(0.0, f64::max)
    }

    /// Returns the value of eta = p.e at which the model ends, where p is the bob's direction and e
    /// the tank's axis, or `None` if the model is valid at all angles.
    pub fn highest(&self) -> Option<f64> {
        let low = self.largest_angle();
        let (mut low, mut high) = (low, low + ANGLE_STEP);
        if high > core::f64::consts::PI {
            return None;
        }
        // The bisection ends at rounding accuracy.
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            (low, high) = if self.holds(middle) { (middle, high) } else { (low, middle) };
        }
        Some(-libm::cos(low))
    }
}

/// Returns the error message for a slosh angle at which the coefficients s and kappa of mode `n` are no longer valid; `n`
/// counts from 0. `name` is the tank's name in the FMU.
pub(crate) fn bound_message([s, kappa]: [f64; 2], higher: Higher, n: usize, name: &str) -> String {
    let surface = Surface::new(s, kappa, higher);
    let most = surface.map_or(0.0, |surface| surface.largest_angle().to_degrees());
    if higher.is_beyond_third_order() {
        return format!(
            "the slosh angle of mode {} of {name} exceeds {most:.1} degrees, where {name}.nonlinear_inertia[{1}] = {s:?}, \
             nonlinear_inertia_2[{1}] = {2:?}, nonlinear_stiffness[{1}] = {kappa:?}, nonlinear_stiffness_2[{1}] = {3:?}, \
             rotary_inertia[{1}] = {4:?} and rotary_inertia_2[{1}] = {5:?} leave too little inertia (allowed: smaller angles)",
            n + 1,
            n + 1,
            higher.inertia,
            higher.stiffness,
            higher.rotary[0],
            higher.rotary[1]
        );
    }
    format!(
        "the slosh angle of mode {} of {name} exceeds {most:.1} degrees, where {name}.nonlinear_inertia[{}] = {s:?} and \
         {name}.nonlinear_stiffness[{}] = {kappa:?} leave too little inertia for the third order to be valid (allowed: \
         smaller angles)",
        n + 1,
        n + 1,
        n + 1
    )
}

/// The surface of a bob at the bob's present position (symbols of the module's head).
pub(crate) struct Meridian<T> {
    surface: Surface<T>,
    p: Vec3<T>,
    e: Vec3<T>,
    pub p_perp: Vec3<T>,
    u: T,
    eta: T,
    beta: T,
    eased: T,                     // gamma/(1 + gamma u)
    across: Option<Vec3<T>>,      // b of a planar mode
    around: Option<(Vec3<T>, T)>, // n and T/(1 + T u)
}

/// Height of a bob on its surface, and the terms of its internal energy E_i (symbols of the
/// module's head).
pub(crate) struct Lift<T> {
    pub z: T,
    pub z_d: T,
    pub z_dd: T,        // without the terms in y
    pub inner: Vec3<T>, // i
    pub energy: T,      // E_i/m
    pub energy_d: T,    // -[(s - 1) l l' + s' l^2/2] sigma^2, in addition to the bob's work
    pub z_at_rest: T,   // [(kappa - 1) l]' u^2/8, the rate of z while the bob is at rest
    pub rotary: Option<Rotary<T>>,
}

/// Rotary motion of a mode that has more rotary inertia than a pendulum (symbols of the module's
/// head).
pub(crate) struct Rotary<T> {
    lever: T,   // l u T
    inertia: T, // l T
    turning: T, // 2 w_e sigma
    growing: T, // 2 t_2 l sigma tau, a term of l (T tau)'
    spin: T,    // l^2 u T tau
    swept: T,   // 2 l^2 T tau sigma
    u: T,
    l: T,
    w: Vec3<T>,
}

impl<T: Number> Meridian<T> {
    /// Creates the surface at the bob's direction `p`, a unit vector. For a planar mode `across` is the unit vector b
    /// perpendicular to its plane.
    pub fn new(
        surface: Surface<T>,
        e: Vec3<T>,
        p: Vec3<T>,
        across: Option<Vec3<T>>,
    ) -> Meridian<T> {
        let eta = dot(e, p);
        let p_perp = sub(p, scale(eta, e));
        let u = dot(p_perp, p_perp);
        let beta = surface.slope_factor(u);
        let gamma =
            beta * (beta * eta - T::constant(2.0)) * eta + eta * eta * surface.meridian_factor(u);
        let inertia = surface.meridian_inertia(eta, u).at_least(0.5 * LEAST_INERTIA);
        let turns = |higher: &Higher| higher.rotary != [0.0; 2] || higher.gyroscopic[0] != 0.0;
        let around = surface.higher.filter(turns).map(|higher| {
            let t = higher.rotary_inertia(u);
            let inertia = (T::constant(1.0) + t * u).at_least(0.5 * LEAST_INERTIA);
            (cross(e, p_perp), t / inertia)
        });
        Meridian { surface, p, e, p_perp, u, eta, beta, eased: gamma / inertia, across, around }
    }

    pub fn apply_shear(&self, x: Vec3<T>) -> Vec3<T> {
        add(x, scale(self.beta * dot(self.p_perp, x), self.e))
    }

    pub fn apply_shear_transposed(&self, x: Vec3<T>) -> Vec3<T> {
        add(x, scale(self.beta * dot(self.e, x), self.p_perp))
    }

    pub fn free(&self, x: Vec3<T>) -> Vec3<T> {
        let mut x = sub(x, scale(dot(self.p, x), self.p));
        if let Some(b) = self.across {
            x = sub(x, scale(dot(b, x), b));
        }
        let meridian = sub(self.e, scale(self.eta, self.p));
        let free = sub(x, scale(self.eased * dot(meridian, x), meridian));
        match &self.around {
            Some((n, share)) => sub(free, scale(*share * dot(*n, x), *n)),
            None => free,
        }
    }

    pub fn held(&self, x: Vec3<T>) -> Vec3<T> {
        sub(x, self.apply_shear(self.free(self.apply_shear_transposed(x))))
    }

    /// Returns the bob's contribution m J^T N J to the craft's mass matrix, for a bob of mass `m`
    /// at `rho` from O. J maps the craft's accelerations [a; w'] to the acceleration a + w' x rho
    /// at the bob. N takes the place of the projection p p^T of a pendulum and is defined in the
    /// module's head.
    pub fn mass_matrix(&self, m: T, rho: Vec3<T>) -> [[T; 6]; 6] {
        let (zero, one) = (T::constant(0.0), T::constant(1.0));
        let mut columns = [[zero; 6]; 6];
        for (k, column) in columns.iter_mut().enumerate() {
            let mut unit = [zero; 3];
            unit[k % 3] = one;
            let moved = if k < 3 { unit } else { cross(unit, rho) };
            let force = scale(m, self.held(moved));
            let torque = cross(rho, force);
            column[..3].copy_from_slice(&force);
            column[3..].copy_from_slice(&torque);
        }
        columns
    }

    /// Adds the terms of the bob's rotary motion to `matrix`, the bob's contribution to the craft's
    /// mass matrix. `m` and `l` are mass and pendulum length, and `rho` is the bob's position from
    /// O. The terms have the direction [n; rho x n - l u e] instead of [n; rho x n], because tau,
    /// the rate of rotary motion, is relative to inertial axes (symbols of the module's head).
    pub fn add_rotary(&self, [m, l]: [T; 2], rho: Vec3<T>, matrix: &mut [[T; 6]; 6]) {
        let Some((n, share)) = self.around else { return };
        let arm = cross(rho, n);
        let bob = [n[0], n[1], n[2], arm[0], arm[1], arm[2]];
        let zero = T::constant(0.0);
        let [x, y, z] = scale(-(l * self.u), self.e);
        let axial = [zero, zero, zero, x, y, z];
        for (i, row) in matrix.iter_mut().enumerate() {
            for (k, element) in row.iter_mut().enumerate() {
                let more = bob[i] * axial[k] + axial[i] * (bob[k] + axial[k]);
                *element = *element + m * share * more;
            }
        }
    }

    /// Returns the rate that enters the drag on the internal energy E_i (module's head), and the
    /// square of this rate, from the rate `p_d` of the bob's direction. Returns `None` for a mode
    /// without coefficients beyond the third order.
    pub fn inner_rate(&self, p_d: Vec3<T>) -> Option<(Vec3<T>, T)> {
        self.surface.higher?;
        let sigma = dot(self.p_perp, p_d);
        let radial = self.surface.meridian_factor(self.u) * sigma;
        let (mut rate, mut squared) = (scale(radial, self.p_perp), radial * sigma);
        if let (Some((n, _)), Some(higher)) = (self.around, self.surface.higher) {
            let turned = dot(n, p_d);
            let tangential = higher.rotary_inertia(self.u) * turned;
            (rate, squared) = (add(rate, scale(tangential, n)), squared + tangential * turned);
        }
        Some((rate, squared))
    }

    pub fn around(&self) -> Option<Vec3<T>> {
        self.around.map(|(n, _)| n)
    }

    /// Returns the height of the bob and the terms of its internal kinetic energy E_i (module's
    /// head). `p_d` is the rate p' of the bob's direction. The pendulum length l and, in a tank
    /// that drains, the coefficients s and kappa are given with their derivatives.
    pub fn lift(
        &self,
        [l, l_d, l_dd]: Jet<T>,
        p_d: Vec3<T>,
        (w, turning_liquid): (Vec3<T>, [T; 2]),
        changing: Option<[Jet<T>; 2]>,
    ) -> Lift<T> {
        let Meridian { u, e, p_perp, surface, .. } = *self;
        let sigma = dot(p_perp, p_d);
        let p_perp_d = sub(p_d, scale(dot(e, p_d), e));
        let psi = dot(p_perp_d, p_perp_d) - u * dot(p_d, p_d);
        let rising = u * u * 0.125;
        let rate = u * sigma * 0.5;
        let rate_d = sigma * sigma + u * psi * 0.5;
        let turning = l * psi + l_d * sigma * 2.0;
        let own = surface.inertia;
        let mut lift = Lift {
            z: l * rising * surface.stiffness,
            z_d: (l_d * rising + l * rate) * surface.stiffness,
            z_dd: (l_dd * rising + l_d * rate * 2.0 + l * rate_d) * surface.stiffness,
            inner: scale(turning * own, p_perp),
            energy: l * l * sigma * sigma * (own * 0.5),
            energy_d: -(l * l_d * sigma * sigma * own),
            z_at_rest: l_d * rising * surface.stiffness,
            rotary: None,
        };
        if let Some(higher) = &surface.higher {
            let motion = ([p_perp_d, w], turning_liquid);
            self.lift_higher(&mut lift, higher, l, motion, [sigma, psi]);
        }
        if let Some([[_, s_d, _], [_, kappa_d, kappa_dd]]) = changing {
            let by_kappa = kappa_d * l * rising;
            lift.z_d = lift.z_d + by_kappa;
            lift.z_at_rest = lift.z_at_rest + by_kappa;
            lift.z_dd =
                lift.z_dd + kappa_dd * l * rising + kappa_d * (l_d * rising + l * rate) * 2.0;
            lift.inner = add(lift.inner, scale(s_d * l * sigma, p_perp));
            lift.energy_d = lift.energy_d - s_d * l * l * sigma * sigma * 0.5;
        }
        lift
    }
    /// Adds the terms of the coefficients beyond the third order, `higher`, to the height and the
    /// internal energy of a bob in `lift`. `l` is the pendulum length. Only tanks that do not drain
    /// have these coefficients.
    #[inline(never)]
    fn lift_higher(
        &self,
        lift: &mut Lift<T>,
        higher: &Higher,
        l: T,
        ([p_perp_d, w], [turning, turning_d]): ([Vec3<T>; 2], [T; 2]),
        [sigma, psi]: [T; 2],
    ) {
        let Meridian { u, e, p_perp, .. } = *self;
        let (u2, squared) = (u * u, sigma * sigma);
        lift.z = lift.z + l * u2 * u * (0.0625 * higher.stiffness);
        lift.z_d = lift.z_d + l * u2 * sigma * (0.375 * higher.stiffness);
        lift.z_dd = lift.z_dd + l * (u * squared * 1.5 + u2 * psi * 0.375) * higher.stiffness;
        // (S sigma)' - s_2 sigma^2 = S sigma' + s_2 sigma^2 without the terms in y.
        let mut inwards = (u * psi + squared) * higher.inertia;
        lift.energy = lift.energy + l * l * u * squared * (0.5 * higher.inertia);
        if let Some((n, _)) = self.around {
            let (spin, t) = (dot(e, w), higher.rotary_inertia(u));
            let tau = dot(n, p_perp_d) + spin * u;
            let own = t * tau;
            let momentum = own - turning * higher.gyroscopic[0];
            inwards = inwards - tau * tau * higher.rotary[1] - momentum * spin * 2.0;
            let growing =
                l * sigma * tau * (2.0 * higher.rotary[1]) - l * turning_d * higher.gyroscopic[0];
            let turning = spin * sigma * 2.0;
            let sideways = scale(l * t * turning + growing, n);
            let swept = scale(l * momentum * 2.0, cross(e, p_perp_d));
            lift.inner = add(lift.inner, add(sideways, swept));
            lift.energy = lift.energy + l * l * own * tau * 0.5;
            lift.rotary = Some(Rotary {
                lever: l * u * t,
                inertia: t,
                turning: l * turning,
                growing,
                spin: l * l * u * momentum,
                swept: l * l * momentum * sigma * 2.0,
                u,
                l,
                w,
            });
        }
        if higher.gyroscopic[1] != 0.0 {
            let stiffening = turning * turning * higher.gyroscopic[1];
            lift.energy = lift.energy + l * l * u * stiffening * 0.5;
            inwards = inwards + stiffening;
        }
        lift.inner = add(lift.inner, scale(l * inwards, p_perp));
    }
}

impl<T: Number> Rotary<T> {
    /// Returns the force of rotary motion, per mass of the bob, that the angular acceleration
    /// `rate_d` of the craft about the tank's axis causes. It acts across the tank's axis,
    /// perpendicular to the bob's displacement.
    pub fn pull(&self, rate_d: T) -> T {
        self.lever * rate_d
    }

    /// Returns the torque that the mode's rotary motion exerts on the craft about the tank's axis
    /// `e`, divided by the bob's mass, in addition to the moment of the bob's force. `slid` is -l
    /// n.p'', where l is the pendulum length, p'' the second derivative of the bob's direction, and
    /// n = e x p. `rate_d` is the craft's angular acceleration e.w' about the axis.
    pub fn couple(&self, slid: T, rate_d: T, e: Vec3<T>) -> Vec3<T> {
        let tau_d = self.l * self.u * rate_d + self.turning - slid;
        let along = self.l * self.u * (self.inertia * tau_d + self.growing) + self.swept;
        let turned = scale(self.spin, cross(self.w, e));
        [0, 1, 2].map(|i| -(along * e[i] + turned[i]))
    }

    pub fn spin(&self) -> T {
        self.spin
    }
}
