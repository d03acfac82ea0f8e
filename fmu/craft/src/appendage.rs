//! Flexible appendages, such as solar arrays and booms. They are described by the modes that they have while the interface to
//! the craft is fixed (Craig and Bampton's fixed-interface modes, hybrid coordinates).
//!
//! ```text
//! eta       modal displacement, kg^1/2 m, of a mode with unit modal mass
//! p, r      participation: integral of phi dm, kg^1/2, and of (x - P) x phi dm, kg^1/2 m; body axes
//! P         interface point from O
//! l         r + P x p, the participation in rotation about O
//! D         2 (p.P) 1 - p P^T - P p^T, the derivative of the inertia about O by eta
//! y, K, L   sum of p eta, of p eta', of l eta'
//! ```
//!
//! Mass and inertia of the undeformed appendage belong to the dry craft. The deflections add these terms to the Lagrangian of the
//! craft, where V_P = V + w x P is the velocity of the interface point:
//!
//! ```text
//! sum of V_P.(p eta' + w x p eta) + w.r eta' + eta'^2/2 - omega^2 eta^2/2
//! ```
//!
//! These are the terms of the kinetic energy of the deformed appendage that its participations determine: all terms that
//! are linear in eta, except w.(dI w)/2, where dI is the change of the inertia about P. Terms of the second order, such as
//! the centrifugal softening of the mode itself, are left out as well. The omitted terms would change eta by a fraction of
//! the order (w/omega)^2. The Lagrangian does not change if the craft is moved, turned, or given a constant velocity, so
//! momentum and angular momentum balance exactly at every amplitude, and energy balances with the dissipated power c
//! eta'^2. Lagrange's equations are
//!
//! ```text
//! eta'' + c eta' + omega^2 eta = -p.a_P - r.w',   a_P = a + w' x P + w x (w x P),   c = 2 zeta omega
//! force on the craft    -(sum of p eta'') - 2 w x K - w' x y - w x (w x y)
//! torque about O        -(sum of l eta'') - w x L - (sum of D eta') w - D w' - w x (D w) - y x a,   D now the sum of D eta
//! ```
//!
//! The centrifugal term p.(w x (w x P)) equals -w.(D w)/2. Therefore the deformed appendage acts like an additional body without
//! mass, which has the first moment y and, about O, the inertia sum of D eta. In addition each mode subtracts u u^T, with
//! u = [p; l], from the mass matrix. Since y, K, L and D are linear in eta, only their sums
//! are multiplied with the craft's motion, whatever the number of modes.
//!
//! Source: Likins, Dynamics and control of flexible space vehicles, JPL TR 32-1329 (1970), and Lagrange's equations.
//! tests/craft/appendages.rs checks them against differences of the Lagrangian, a beam in closed form and a hinged panel.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use taylor::error::StepError;
use taylor::number::Number;
use taylor::series::{self, ORDER, Series, ZERO};
use taylor::space::{Vector, ZERO_VECTOR};
use taylor::vector::{Mat3, Vec3, add, constant, cross, dot, scale, times};

use crate::rigid::{
    Factors, Mat6, Rigid, SINGULAR, add_rank_one, largest_eigenvalue, smallest_pivot,
};
use crate::sizes::APPENDAGES;
use crate::state::{STATES, index};

/// One mode of a flexible appendage, normalised to unit modal mass, with the interface to the craft fixed: natural
/// frequency, Hz, damping ratio `zeta`, and participation in translation, kg^0.5, and in rotation about the interface point
/// `position`, kg^0.5 m, body axes. `eta` and `eta_dot` are modal displacement, kg^0.5 m, and its rate at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Appendage {
    pub position: Vec3,
    pub frequency: f64,
    pub zeta: f64,
    pub participation: [f64; 6],
    pub eta: f64,
    pub eta_dot: f64,
}

impl Default for Appendage {
    fn default() -> Self {
        let (position, participation) = ([0.0; 3], [0.0; 6]);
        Appendage { position, frequency: 1.0, zeta: 0.005, participation, eta: 0.0, eta_dot: 0.0 }
    }
}

impl Appendage {
    /// Returns true if the mode can have an effect: its participation is not 0, or it is deflected or moving at the start.
    pub(crate) fn acts(&self) -> bool {
        self.participation != [0.0; 6] || self.eta != 0.0 || self.eta_dot != 0.0
    }
}

#[derive(Clone, Debug)]
struct Mode {
    p: Vec3,
    l: Vec3,
    growth: Symmetric,
    stiffness: f64,
    damping: f64,
}

/// Elements xx, yy, zz, xy, xz, yz of a symmetric matrix.
type Symmetric<T = f64> = [T; 6];

fn symmetric<T: Number>([xx, yy, zz, xy, xz, yz]: Symmetric<T>) -> Mat3<T> {
    [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
}

impl Mode {
    fn new(appendage: &Appendage) -> Mode {
        let [p_x, p_y, p_z, r @ ..] = appendage.participation;
        let (p, at) = ([p_x, p_y, p_z], appendage.position);
        let twice = 2.0 * dot(p, at);
        let element = |i: usize, j: usize| p[i] * at[j] + at[i] * p[j];
        let omega = core::f64::consts::TAU * appendage.frequency;
        Mode {
            p,
            l: add(r, cross(at, p)),
            growth: [
                twice - element(0, 0),
                twice - element(1, 1),
                twice - element(2, 2),
                -element(0, 1),
                -element(0, 2),
                -element(1, 2),
            ],
            stiffness: omega * omega,
            damping: 2.0 * appendage.zeta * omega,
        }
    }

    /// Returns w.(D w) of this mode, where w is the craft's angular velocity and D the derivative
    /// of the craft's inertia by the displacement of the mode. `ww` has the products xx, yy, zz,
    /// xy, xz, yz of the components of w.
    fn turning<T: Number>(&self, ww: Symmetric<T>) -> T {
        let [xx, yy, zz, xy, xz, yz] = self.growth;
        ww[0] * xx + ww[1] * yy + ww[2] * zz + (ww[3] * xy + ww[4] * xz + ww[5] * yz) * 2.0
    }

    /// Returns the part of -eta'' of this mode that does not depend on the craft's accelerations a
    /// and w': damping, stiffness and the centrifugal term. `turning` is the result of
    /// `Mode::turning`, from which the centrifugal term follows.
    fn pull<T: Number>(&self, eta: T, rate: T, turning: T) -> T {
        rate * self.damping + eta * self.stiffness - turning * 0.5
    }
}

/// The modes of all appendages of a craft.
#[derive(Clone, Debug)]
pub(crate) struct Structure {
    modes: Vec<Mode>,
    effective: Mat6, // sum of u u^T
    dry: Rigid,      // dry craft with its appendages undeformed
    // Upper bound of the relative change of the craft's inertia by eta = 1
    shares: [f64; APPENDAGES],
    is_too_heavy: bool, // the mass matrix is not positive even without deflection
}

/// State of the flexible appendages at an instant, and what they add to the craft (symbols of the
/// module's head).
pub(crate) struct Deformed<T> {
    eta: [T; APPENDAGES],
    rate: [T; APPENDAGES],
    pub body: Rigid<T>,         // first and second moments by the deflections
    pub momentum: [Vec3<T>; 2], // [K; L]
    slope: Mat3<T>,             // derivative of the body's inertia by time
    pub energy: T,              // of the modes in a craft at rest
}

impl Structure {
    /// Returns the modes of a craft's appendages up to the last mode that has an effect; `None` if no mode has an effect. `dry`
    /// is the dry craft with its appendages undeformed.
    pub fn new(every: &[Appendage], dry: Rigid) -> Option<Structure> {
        let used = every.iter().rposition(Appendage::acts).map_or(0, |last| last + 1);
        let modes: Vec<Mode> = every[..used].iter().map(Mode::new).collect();
        let mut effective = [[0.0; 6]; 6];
        for Mode { p, l, .. } in &modes {
            add_rank_one(&mut effective, 1.0, &[p[0], p[1], p[2], l[0], l[1], l[2]]);
        }
        if modes.is_empty() {
            return None;
        }
        let mut found =
            Structure { modes, effective, dry, shares: [0.0; APPENDAGES], is_too_heavy: false };
        let mut undeformed = found.dry.mass_matrix();
        found.reduce(&mut undeformed);
        if smallest_pivot(&undeformed) < SINGULAR {
            found.is_too_heavy = true;
            return Some(found);
        }
        let factors = Factors::new(&undeformed);
        for j in 0..found.len() {
            let mut eta = [0.0; APPENDAGES];
            eta[j] = 1.0;
            let change = found.deformed(&eta, &[0.0; APPENDAGES]).body.mass_matrix();
            let opposite = change.map(|row| row.map(|x| -x));
            found.shares[j] = [change, opposite]
                .iter()
                .fold(0.0, |most, a| most.max(largest_eigenvalue(&factors, a)));
        }
        Some(found)
    }

    pub fn len(&self) -> usize {
        self.modes.len()
    }

    fn sums<T: Number>(&self, eta: &[T], of: impl Fn(&Mode) -> Vec3) -> Vec3<T> {
        let terms = self.modes.iter().zip(eta).map(|(mode, eta)| of(mode).map(|p| *eta * p));
        terms.fold(constant([0.0; 3]), add)
    }

    fn growth<T: Number>(&self, eta: &[T]) -> Mat3<T> {
        let [moments, products] =
            [0, 3].map(|at| self.sums(eta, |mode| [0, 1, 2].map(|i| mode.growth[at + i])));
        let ([xx, yy, zz], [xy, xz, yz]) = (moments, products);
        symmetric([xx, yy, zz, xy, xz, yz])
    }

    pub fn deformed<T: Number>(&self, eta: &[T], eta_dot: &[T]) -> Deformed<T> {
        let zero = T::constant(0.0);
        let (mut own_eta, mut rate) = ([zero; APPENDAGES], [zero; APPENDAGES]);
        own_eta[..self.len()].copy_from_slice(&eta[..self.len()]);
        rate[..self.len()].copy_from_slice(&eta_dot[..self.len()]);
        let mut energy = zero;
        for (mode, (eta, rate)) in self.modes.iter().zip(own_eta.iter().zip(&rate)) {
            energy = energy + (*rate * *rate + *eta * *eta * mode.stiffness) * 0.5;
        }
        let (moment, inertia) = (self.sums(&own_eta, |mode| mode.p), self.growth(&own_eta));
        Deformed {
            body: Rigid { mass: zero, moment, inertia },
            momentum: [self.sums(&rate, |mode| mode.p), self.sums(&rate, |mode| mode.l)],
            slope: self.growth(&rate),
            eta: own_eta,
            rate,
            energy,
        }
    }

    /// Returns the state of the flexible appendages, and what they add to the craft's moments and
    /// momenta, for the continuous states `x`.
    pub fn deformed_at<T: Number>(&self, x: &[T; STATES]) -> Deformed<T> {
        self.deformed(&x[index::ETA..], &x[index::ETA_DOT..])
    }

    fn pulls<'a, T: Number>(
        &'a self,
        now: &'a Deformed<T>,
        w: Vec3<T>,
    ) -> impl Iterator<Item = (&'a Mode, T)> {
        let [x, y, z] = w;
        let ww = [x * x, y * y, z * z, x * y, x * z, y * z];
        let states = now.eta.iter().zip(&now.rate);
        self.modes
            .iter()
            .zip(states)
            .map(move |(mode, (eta, rate))| (mode, mode.pull(*eta, *rate, mode.turning(ww))))
    }

    /// Returns the force of the appendages on the craft and its torque about O, without the terms that contain [a; w'] and
    /// without the inertial forces of [`Deformed::body`].
    pub fn loads<T: Number>(&self, now: &Deformed<T>, w: Vec3<T>) -> [Vec3<T>; 2] {
        let [momentum, moment] = now.momentum;
        let turned = cross(w, momentum);
        let mut force = add(turned, turned).map(|x| -x);
        let mut torque = add(cross(w, moment), times(&now.slope, w)).map(|x| -x);
        for (mode, pull) in self.pulls(now, w) {
            force = add(force, mode.p.map(|p| pull * p));
            torque = add(torque, mode.l.map(|l| pull * l));
        }
        [force, torque]
    }

    /// Subtracts the sum of u u^T over all modes from the craft's mass matrix, where u = [p; l] is
    /// the participation of a mode. Because a mode is free to deflect, its mass does not follow an
    /// acceleration of the craft along u.
    pub fn reduce<T: Number>(&self, matrix: &mut Mat6<T>) {
        for (row, effective) in matrix.iter_mut().zip(&self.effective) {
            for (x, effective) in row.iter_mut().zip(effective) {
                *x = *x - T::constant(*effective);
            }
        }
    }

    /// Returns the derivatives eta' and eta'' of all modes, and 0 for modes that are not in use.
    pub fn rates<T: Number>(
        &self,
        now: &Deformed<T>,
        w: Vec3<T>,
        [a, w_d]: [Vec3<T>; 2],
    ) -> [[T; APPENDAGES]; 2] {
        let mut second = [T::constant(0.0); APPENDAGES];
        for (second, (mode, pull)) in second.iter_mut().zip(self.pulls(now, w)) {
            *second = -(pull + dot(constant(mode.p), a) + dot(constant(mode.l), w_d));
        }
        [now.rate, second]
    }

    pub fn dissipation<T: Number>(&self, now: &Deformed<T>) -> T {
        let modes = self.modes.iter().zip(&now.rate);
        modes.fold(T::constant(0.0), |sum, (mode, rate)| sum + *rate * *rate * mode.damping)
    }

    /// Returns an estimate of the largest rate of the modes over the next `t` seconds, |eta'| +
    /// omega |eta| + |eta''| t, to which the allowed error of the rates is relative. `second` are
    /// the second derivatives eta''.
    pub fn speed_scale(&self, eta: &[f64], rate: &[f64], second: &[f64], t: f64) -> f64 {
        let states = eta.iter().zip(rate.iter().zip(second));
        self.modes.iter().zip(states).fold(0.0, |most, (mode, (eta, (rate, second)))| {
            let speed = rate.abs() + libm::sqrt(mode.stiffness) * eta.abs() + second.abs() * t;
            if speed > most { speed } else { most }
        })
    }

    /// Returns true if deflections or participations make the craft's mass matrix not positive definite. If the participations
    /// are too large for the mass of the craft, this is so at any deflection, otherwise only at deflections far beyond the range
    /// of a linear model.
    pub fn is_beyond(&self, eta: &[f64]) -> bool {
        if self.is_too_heavy {
            return true;
        }
        // Quick check: usual deflections reduce the craft's inertia only slightly. NaN does not pass it.
        let taken =
            self.shares.iter().zip(eta).fold(0.0, |sum, (share, eta)| sum + share * eta.abs());
        if taken < 0.5 {
            return false;
        }
        let body = self.deformed(eta, &[0.0; APPENDAGES]).body;
        let mut matrix = self.dry.combined_with(&body).mass_matrix();
        self.reduce(&mut matrix);
        smallest_pivot(&matrix) < SINGULAR
    }

    pub fn check(&self, x: &[f64; STATES]) -> Result<(), StepError> {
        let eta = &x[index::ETA..][..self.len()];
        match self.is_beyond(eta) {
            true => Err(StepError::Model(beyond_message(eta))),
            false => Ok(()),
        }
    }
}

pub(crate) fn beyond_message(eta: &[f64]) -> String {
    format!(
        "appendage[].eta = {eta:?} kg^0.5.m: appendages that are deformed so far leave the craft no inertia (allowed: small \
         deflections, because the model of appendages is linear). Check appendage[].frequency and appendage[].zeta, and force \
         and torque on the craft"
    )
}

/// Appendages with the power series of their motion. The fields after the series are the terms of the current order that do
/// not depend on the accelerations [a; w'] of this order.
#[derive(Clone, Debug)]
pub(crate) struct Flexing {
    pub structure: Structure,
    eta: [Series; APPENDAGES],
    rate: [Series; APPENDAGES],
    y: Vector,
    momentum: Vector,
    moment: Vector,
    growth: [Symmetric; ORDER + 1],
    turned: Vector, // w x y
    grown: Vector,  // D w
    flow: Vector,   // K + w x y
    spin: Vector,   // L + D w
    pull: [f64; APPENDAGES],
    second: [f64; APPENDAGES],
    /// True while coefficient 1 of the series is a directional derivative instead of a derivative by time.
    along: bool,
}

impl Flexing {
    pub fn new(structure: Structure) -> Flexing {
        Flexing {
            structure,
            eta: [ZERO; APPENDAGES],
            rate: [ZERO; APPENDAGES],
            y: ZERO_VECTOR,
            momentum: ZERO_VECTOR,
            moment: ZERO_VECTOR,
            growth: [[0.0; 6]; ORDER + 1],
            turned: ZERO_VECTOR,
            grown: ZERO_VECTOR,
            flow: ZERO_VECTOR,
            spin: ZERO_VECTOR,
            pull: [0.0; APPENDAGES],
            second: [0.0; APPENDAGES],
            along: false,
        }
    }

    /// Starts an expansion at the states x while the craft rotates with `w`.
    pub fn start(&mut self, x: &[f64; STATES], w: Vec3) {
        self.along = false;
        for j in 0..self.structure.len() {
            (self.eta[j][0], self.rate[j][0]) = (x[index::ETA + j], x[index::ETA_DOT + j]);
        }
        self.set_displacement(0);
        self.set_momentum(0);
        self.turned[0] = cross(w, self.y[0]);
        self.grown[0] = times(&symmetric(self.growth[0]), w);
    }

    /// Sets coefficient 1 to the derivatives for a change of the states by `dx` and of the angular velocity by `dw`.
    pub fn seed_direction(&mut self, dx: &[f64; STATES], w: Vec3, dw: Vec3) {
        self.along = true;
        for j in 0..self.structure.len() {
            (self.eta[j][1], self.rate[j][1]) = (dx[index::ETA + j], dx[index::ETA_DOT + j]);
        }
        self.set_displacement(1);
        self.set_momentum(1);
        self.turned[1] = add(cross(dw, self.y[0]), cross(w, self.y[1]));
        let [growth, slope] = [0, 1].map(|n| symmetric(self.growth[n]));
        self.grown[1] = add(times(&growth, dw), times(&slope, w));
    }

    fn coefficients(&self, of: &[Series; APPENDAGES], n: usize) -> [f64; APPENDAGES] {
        of.each_ref().map(|series| series[n])
    }

    fn set_displacement(&mut self, n: usize) {
        let (mut y, mut growth) = ([0.0; 3], [0.0; 6]);
        for (mode, eta) in self.structure.modes.iter().zip(&self.eta) {
            let eta = eta[n];
            for i in 0..3 {
                y[i] += eta * mode.p[i];
            }
            for i in 0..6 {
                growth[i] += eta * mode.growth[i];
            }
        }
        (self.y[n], self.growth[n]) = (y, growth);
    }

    fn set_momentum(&mut self, n: usize) {
        let [mut momentum, mut moment] = [[0.0; 3]; 2];
        for (mode, rate) in self.structure.modes.iter().zip(&self.rate) {
            let rate = rate[n];
            for i in 0..3 {
                momentum[i] += rate * mode.p[i];
                moment[i] += rate * mode.l[i];
            }
        }
        (self.momentum[n], self.moment[n]) = (momentum, moment);
    }

    /// Adds the inertia of the deformed appendages to the craft's mass matrix.
    pub fn add_inertia(&self, matrix: &mut Mat6) {
        let body = Rigid { mass: 0.0, moment: self.y[0], inertia: symmetric(self.growth[0]) };
        for (row, added) in matrix.iter_mut().zip(body.mass_matrix()) {
            for (x, added) in row.iter_mut().zip(added) {
                *x += added;
            }
        }
        self.structure.reduce(matrix);
    }

    /// Returns coefficient n of the power series of force and torque about O with which the appendage acts on the
    /// craft. The terms that contain coefficient n of the accelerations [a; w'] are left out, because the mass matrix
    /// contains them. `ww` has the products of the components of the angular velocity.
    pub fn reaction(&mut self, n: usize, [a, w, w_d]: [&Vector; 3], ww: [f64; 6]) -> [Vec3; 2] {
        let order = (n + 1) as f64;
        for j in 0..self.structure.len() {
            self.eta[j][n + 1] = self.rate[j][n] / order;
        }
        self.set_displacement(n + 1);
        // Derivatives of w x y and D w by time, without the terms that contain coefficient n of w'.
        let [turned, grown] = if self.along && n == 1 {
            self.rates_along(w, w_d)
        } else {
            let [mut turned, mut grown] = [[0.0; 3]; 2];
            for k in 1..=n + 1 {
                let (w, y, growth) = (w[n + 1 - k], self.y[k], &self.growth[k]);
                turned = add(turned, cross(w, y));
                let [xx, yy, zz, xy, xz, yz] = *growth;
                grown[0] += xx * w[0] + xy * w[1] + xz * w[2];
                grown[1] += xy * w[0] + yy * w[1] + yz * w[2];
                grown[2] += xz * w[0] + yz * w[1] + zz * w[2];
            }
            (self.turned[n + 1], self.grown[n + 1]) = (turned, grown);
            [scale(order, turned), scale(order, grown)]
        };
        self.flow[n] = add(self.momentum[n], self.turned[n]);
        self.spin[n] = add(self.moment[n], self.grown[n]);
        let (mut force, mut torque) = (turned, grown);
        for j in 0..=n {
            force = add(force, cross(w[n - j], self.flow[j]));
            torque = add(torque, cross(w[n - j], self.spin[j]));
        }
        for j in 1..=n {
            torque = add(torque, cross(self.y[j], a[n - j]));
        }
        (force, torque) = (scale(-1.0, force), scale(-1.0, torque));
        for (j, mode) in self.structure.modes.iter().enumerate() {
            let pull = mode.pull(self.eta[j][n], self.rate[j][n], mode.turning(ww));
            force = add(force, scale(pull, mode.p));
            torque = add(torque, scale(pull, mode.l));
            self.pull[j] = pull;
        }
        [force, torque]
    }

    /// Returns the directional derivatives of the force w' x y + w x K and of the torque D w' +
    /// (sum of D eta') w by the deflected appendages, while the angular acceleration w' is
    /// constant. By the deflections y is the first moment of the craft, K its rate, and D the
    /// change of the inertia.
    fn rates_along(&self, w: &Vector, w_d: &Vector) -> [Vec3; 2] {
        let [slope, slope_1] =
            [0, 1].map(|n| self.structure.growth(&self.coefficients(&self.rate, n)));
        let turned = add(cross(w[1], self.momentum[0]), cross(w[0], self.momentum[1]));
        let grown = add(times(&slope_1, w[0]), times(&slope, w[1]));
        [
            add(cross(w_d[0], self.y[1]), turned),
            add(times(&symmetric(self.growth[1]), w_d[0]), grown),
        ]
    }

    /// Sets coefficient n + 1 of the rates of all modes from coefficient n of the craft's accelerations [a; w'].
    pub fn accelerate(&mut self, n: usize, a: Vec3, w_d: Vec3) {
        let order = (n + 1) as f64;
        for (j, mode) in self.structure.modes.iter().enumerate() {
            let second = -(self.pull[j] + dot(mode.p, a) + dot(mode.l, w_d));
            self.second[j] = second;
            self.rate[j][n + 1] = second / order;
        }
        self.set_momentum(n + 1);
        let w = scale(1.0 / order, w_d);
        self.turned[n + 1] = add(self.turned[n + 1], cross(w, self.y[0]));
        self.grown[n + 1] = add(self.grown[n + 1], times(&symmetric(self.growth[0]), w));
    }

    /// Returns coefficient n of the rates eta' and eta'' of all modes. Coefficient 1 is their
    /// directional derivative if the expansion is along a direction instead of in time.
    pub fn rates(&self, n: usize) -> [[f64; APPENDAGES]; 2] {
        [self.coefficients(&self.rate, n), self.second]
    }

    pub fn dissipation(&self, n: usize) -> f64 {
        let damped = self.structure.modes.iter().zip(&self.rate);
        damped
            .filter(|(mode, _)| mode.damping > 0.0)
            .fold(0.0, |sum, (mode, rate)| sum + mode.damping * series::square(n, rate))
    }

    /// Returns an estimate of the largest rate eta' of the modes over the next `t` seconds. The
    /// allowed error of the rates is relative to this estimate.
    pub fn speed_scale(&self, t: f64) -> f64 {
        let [eta, rate, second] = [(&self.eta, 0), (&self.rate, 0), (&self.rate, 1)]
            .map(|(of, n)| self.coefficients(of, n));
        self.structure.speed_scale(&eta, &rate, &second, t)
    }

    pub fn coefficient_norm(&self, n: usize) -> f64 {
        self.rate[..self.structure.len()]
            .iter()
            .fold(0.0, |most, rate| if rate[n].abs() > most { rate[n].abs() } else { most })
    }

    /// Writes displacement and rate of every mode at `t`, s, after the start of the expansion into
    /// the states `x`, from the series up to order n.
    pub fn write_states(&self, x: &mut [f64; STATES], n: usize, t: f64) {
        for j in 0..self.structure.len() {
            let [eta, rate] = series::values([&self.eta[j], &self.rate[j]], n, t);
            (x[index::ETA + j], x[index::ETA_DOT + j]) = (eta, rate);
        }
    }

    /// Updates the modes' rates for an impulse on the craft that changes the velocity of O by `dv`
    /// and the angular velocity by `dw`, both in body axes.
    pub fn after_impulse(&self, x: &mut [f64; STATES], dv: Vec3, dw: Vec3) {
        for (j, mode) in self.structure.modes.iter().enumerate() {
            x[index::ETA_DOT + j] -= dot(mode.p, dv) + dot(mode.l, dw);
        }
    }

    pub fn now<T: Number>(&self) -> Deformed<T> {
        let numbers =
            |of: &[Series; APPENDAGES]| of.each_ref().map(|series| series::number(series));
        self.structure.deformed::<T>(&numbers(&self.eta), &numbers(&self.rate))
    }
}
