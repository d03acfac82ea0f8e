//! Steps through time: a Taylor-series integrator with an automaton for stick and slip.
//!
//! Over one step the whole motion is a power series in time (`series.rs`). The order
//! grows until terms in a row, at the step's end, are below the tolerance; where
//! the highest order does not get there, the step is cut to the length at which it
//! does. So short steps are cheap, nothing is ever rejected, and the series between
//! the ends is as exact as at the ends: the instants at which the hub comes to rest
//! or breaks away are roots of polynomials, found without stepping back.

use crate::contact::Contact;
use crate::damping::Damping;
use crate::friction::Law;
use crate::hub::HubMotion;
use crate::inputs::Ramp;
use crate::parameters::{Imu, Parameters, SloshModel};
use crate::series::{self, ORDER, RAMP_ORDER, Series, ZERO, for_each_order};
use crate::slosh::SloshMode;
use crate::state::{State, x};

/// Error of one step against the tolerance asked for. A step's error is forgotten
/// as the liquid's motion decays, within some thousand steps.
const STEP_SHARE: f64 = 1e-2;

/// The floor of the error's scale, rad/s.
const RATE_FLOOR: f64 = 1e-6;

/// The longest expansion, s: its powers up to the highest order do not overflow.
const LONGEST: f64 = 1e9;

/// The lowest order that is trusted to show that a series has converged.
const MIN_ORDER: usize = 5;

/// Why a step was refused; its text is for the user. The state is as before the step.
#[derive(Clone, Debug, PartialEq)]
pub enum StepError {
    /// The motion overflows.
    NotFinite {
        /// When, s.
        time: f64,
    },
    /// The step needs more internal steps than `solver.max_steps`.
    TooManySteps {
        /// How far the integrator came, s.
        time: f64,
        /// `solver.max_steps`.
        max_steps: usize,
    },
    /// More samples of the gyro are due than can be taken at once.
    TooManySamples {
        /// When, s.
        time: f64,
    },
    /// A slosh mode left the range in which its model is valid.
    OutOfRange {
        /// When, s.
        time: f64,
        /// Which mode, counted from 1.
        mode: usize,
        /// What happened.
        what: &'static str,
    },
}

impl core::fmt::Display for StepError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            StepError::NotFinite { time } => {
                write!(f, "the state is not finite at t = {time} s")
            }
            StepError::TooManySteps { time, max_steps } => write!(
                f,
                "the step was stopped at t = {time} s after solver.max_steps = {max_steps} internal \
                 steps (gyro samples count as steps); use shorter communication steps, a looser \
                 tolerance or a larger solver.max_steps, with stribeck_smooth a larger \
                 friction.eps, with the gyro a lower imu.rate"
            ),
            StepError::TooManySamples { time } => write!(
                f,
                "more gyro samples are due at t = {time} s than can be taken at once; the host \
                 has passed time events, or imu.rate is too high for times of this size"
            ),
            StepError::OutOfRange { time, mode, what } => {
                write!(f, "slosh mode {mode} left its range at t = {time} s: {what}")
            }
        }
    }
}

/// How far an expansion reaches.
#[derive(Default)]
struct Reach {
    /// Its length, s.
    h: f64,
    /// h^(n + 1) after order n.
    power: f64,
    /// Errors allowed at that length, rad/s.
    hub_allowed: f64,
    slosh_allowed: f64,
    /// How many of the last terms in succession were below them.
    negligible: usize,
}

/// The hub's equation with the power series of its parts:
/// J w' = tau + tau_f + T, J = I0 + sum of J_i, T = sum of T_i over the modes.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    /// Inertia of hub and rigid liquid, kg m2.
    pub i0: f64,
    pub law: Law,
    pub damping: Damping,
    /// Whether drag or weight change along an expansion though g is held: with a baffle, or on a
    /// bench that leans.
    pub varies: bool,
    with_baffle: bool,
    /// Mass moments of the dry hub, radially and tangentially, and of the rigid liquid, kg m.
    imbalance: [f64; 2],
    rigid_moment: f64,
    /// The g and its rate that the modes know; NaN: none yet, or none for longer than an instant.
    g: [f64; 2],
    /// The specific force below which damping is held, m/s2, see [`Damping::expand`].
    near_weightless: f64,
    tolerance: f64,
    /// Internal steps and gyro samples that one call may take.
    pub max_steps: usize,
    pub hub: HubMotion,
    /// Torque of wheel and environment over the step.
    tau: [f64; 2],
    inertia: Series,
    /// 1/J at the start of the expansion
    inv_inertia: f64,
    /// Torque of the bearing.
    pub tau_f: Series,
    /// tau + T, the torque that the bearing must hold at rest.
    pub net: Series,
    /// Power of the torques from outside, and dissipated in bearing and liquid, W.
    pub power: Series,
    pub dissipation: Series,
}

impl Motion {
    pub fn new(p: &Parameters, i_0: f64, m_0: f64, damping: Damping, tolerance: f64) -> Motion {
        let (sin, cos) = libm::sincos(p.hub.imbalance_angle);
        let mut hub = HubMotion::REST;
        hub.tilt.tangent = libm::tan(p.bench.tilt);
        hub.tilt.azimuth = p.bench.tilt_azimuth;
        let with_baffle = p.baffle.width > 0.0 && p.slosh.model != SloshModel::Frozen;
        Motion {
            i0: p.hub.inertia + i_0,
            law: Law::new(&p.friction),
            damping,
            varies: with_baffle || hub.tilt.tangent != 0.0,
            with_baffle,
            imbalance: [p.hub.imbalance * cos, p.hub.imbalance * sin],
            rigid_moment: m_0 * p.tank.r,
            g: [f64::NAN; 2],
            near_weightless: 0.0,
            tolerance,
            max_steps: p.solver.max_steps,
            hub,
            tau: [0.0; 2],
            inertia: ZERO,
            inv_inertia: 0.0,
            tau_f: ZERO,
            net: ZERO,
            power: ZERO,
            dissipation: ZERO,
        }
    }

    /// Takes another law of slosh damping and returns the last one.
    pub fn set_damping(&mut self, damping: Damping) -> Damping {
        self.g = [f64::NAN; 2];
        std::mem::replace(&mut self.damping, damping)
    }

    /// Puts everything at the state, with the given torque and specific force.
    pub fn start<M: SloshMode>(&mut self, modes: &mut [M], state: &State, (tau, g): (Ramp, Ramp)) {
        self.hub.theta[0] = state.x[x::THETA];
        self.hub.omega[0] = state.x[x::OMEGA];
        self.law.set_state(0, state.x[x::BRISTLE]);
        self.tau = [tau.value, tau.slope];
        for (mode, q) in modes.iter_mut().zip(state.slosh()) {
            mode.start(q, &self.hub);
        }
        if self.g != [g.value, g.slope] {
            self.set_axial(modes, g);
        }
    }

    /// Tells the modes of the specific force, and of the drag that it and their motion make.
    #[cold]
    fn set_axial<M: SloshMode>(&mut self, modes: &mut [M], g: Ramp) {
        self.hub.g = [g.value, g.slope];
        // The baffle's drag belongs to the motion at this instant alone.
        self.g = if self.with_baffle { [f64::NAN; 2] } else { self.hub.g };
        self.hub.damping_reach = f64::INFINITY;
        for (n, mode) in modes.iter_mut().enumerate() {
            let amplitude2 = mode.amplitude2();
            let pendulum = mode.pendulum();
            let reach = self.damping.expand(n, g, self.near_weightless, pendulum);
            self.hub.damping_reach = self.hub.damping_reach.min(reach);
            if pendulum.baffle.zeta > 0.0 {
                pendulum.add_baffle(amplitude2);
            }
        }
    }

    /// Coefficient n of the torque of gravity on the dry hub of a bench that leans, N m.
    fn gravity_torque(&self, n: usize) -> f64 {
        let ([x, y], [e_x, e_y]) = (self.imbalance, &self.hub.tilt.e);
        x * e_y[n] - y * e_x[n]
    }

    /// Torque of gravity on the dry hub, N m, on the rigid liquid's mass moment, kg m, at order 0.
    pub fn gravity_torques(&self) -> [f64; 2] {
        [self.gravity_torque(0), self.rigid_moment * self.hub.tilt.e[1][0]]
    }

    /// Potential energy of the dry hub and of the rigid liquid, J.
    pub fn potential(&self) -> f64 {
        let ([x, y], [e_x, e_y]) = (self.imbalance, self.hub.tilt.now());
        -((x + self.rigid_moment) * e_x + y * e_y)
    }

    /// Coefficient n of mass times height of hub and liquid above rest, kg m: the potential energy
    /// over g.
    pub fn mass_height<M: SloshMode>(&self, n: usize, modes: &mut [M]) -> f64 {
        let [x, y] = self.imbalance;
        let moment = |j| [series::constant(j, x + self.rigid_moment), series::constant(j, y)];
        modes.iter_mut().map(|mode| mode.mass_height(n, &self.hub)).sum::<f64>()
            + self.hub.tilt.height(n, moment)
    }

    /// Coefficient n of every quantity from coefficients up to n of the state, and
    /// coefficient n + 1 of the state; `ramp` says whether the specific force, the drag or the
    /// weight changes.
    #[inline(always)]
    pub fn derivatives<M: SloshMode>(
        &mut self,
        n: usize,
        ramp: bool,
        modes: &mut [M],
        contact: Contact,
    ) {
        self.hub.omega2[n] = series::square(n, &self.hub.omega);
        let (mut inertia, mut net) = (0.0, if n < 2 { self.tau[n] } else { 0.0 });
        if ramp {
            self.hub.tilt.expand(n, &self.hub.theta, &self.hub.g);
            net += self.gravity_torque(n) + self.rigid_moment * self.hub.tilt.e[1][n];
        }
        for mode in modes.iter_mut() {
            let reaction = mode.hub_reaction(n, ramp, &self.hub);
            inertia += reaction.j;
            net += reaction.t;
        }
        self.inertia[n] = series::constant(n, self.i0) + inertia;
        if n == 0 {
            self.inv_inertia = 1.0 / self.inertia[0];
        }
        self.net[n] = net;
        self.hub.omega_dot[n] = if contact == Contact::Stuck {
            self.tau_f[n] = -net;
            0.0
        } else {
            self.tau_f[n] = self.law.torque(n, contact, &self.hub);
            let torque = net + self.tau_f[n];
            let rest = if M::MOVES_INERTIA {
                series::mul_tail(n, &self.inertia, &self.hub.omega_dot)
            } else {
                0.0
            };
            (torque - rest) * self.inv_inertia
        };
        self.hub.theta[n + 1] = series::next(n, self.hub.omega[n]);
        self.hub.omega[n + 1] = series::next(n, self.hub.omega_dot[n]);
        self.power[n] = series::mul_ramp(n, &self.tau, &self.hub.omega);
        self.dissipation[n] = self.law.dissipation(n, &self.tau_f, &self.hub.omega);
        for mode in modes.iter_mut() {
            mode.accelerate(n, ramp, &self.hub);
            self.dissipation[n] += mode.dissipation(n, ramp);
        }
    }

    /// Order 0 of the derivatives where drag or weight vary.
    #[cold]
    #[inline(never)]
    pub fn derivatives_varying<M: SloshMode>(&mut self, modes: &mut [M], contact: Contact) {
        self.derivatives(0, true, modes, contact);
    }

    /// Expands the motion up to `h` ahead; `ramp` says whether the specific force changes.
    /// Returns the order and the length, at most `h`, at which the terms left out are below
    /// the tolerance.
    #[inline(always)]
    fn expand<const UNROLLED: bool, M: SloshMode>(
        &mut self,
        ramp: bool,
        modes: &mut [M],
        h: f64,
        contact: Contact,
    ) -> (usize, f64) {
        let mut reach = Reach { h: h.min(LONGEST), ..Reach::default() };
        let highest = if ramp { RAMP_ORDER } else { ORDER };
        if UNROLLED {
            for_each_order!(n => {
                if self.expand_order(n, ramp, modes, contact, &mut reach) {
                    return (n + 1, reach.h);
                }
            });
        } else {
            for n in 0..highest {
                if self.expand_order(n, ramp, modes, contact, &mut reach) {
                    return (n + 1, reach.h);
                }
            }
        }
        let Reach { h, hub_allowed, slosh_allowed, .. } = reach;
        // The last two terms reach the tolerance at this length.
        let length = |n: usize| {
            let slosh = modes.iter().map(|m| m.coefficient_norm(n)).fold(0.0, f64::max);
            let term = f64::max(self.hub.omega[n].abs() / hub_allowed, slosh / slosh_allowed);
            let term = f64::max(term, self.law.coefficient_norm(n) / self.allowed());
            if term > 0.0 { libm::exp(-libm::log(term) / n as f64) } else { h }
        };
        (highest, h.min(length(highest)).min(length(highest - 1)))
    }

    /// The error allowed to one step, relative to the motion's scale.
    fn allowed(&self) -> f64 {
        STEP_SHARE * self.tolerance
    }

    /// Order n of an expansion; returns whether the series has converged.
    #[inline(always)]
    fn expand_order<M: SloshMode>(
        &mut self,
        n: usize,
        ramp: bool,
        modes: &mut [M],
        contact: Contact,
        reach: &mut Reach,
    ) -> bool {
        self.derivatives(n, ramp, modes, contact);
        let allowed = self.allowed();
        if n == 1 {
            let h = reach.h.min(self.law.convergence_radius(&self.hub.omega));
            reach.h = if ramp { h.min(self.hub.damping_reach) } else { h };
            reach.power = reach.h;
            // The hub's rate passes zero many times; the scale of its error must not.
            let [w, w_d] = [self.hub.omega[0], self.hub.omega[1]].map(f64::abs);
            let hub_scale = RATE_FLOOR + w + w_d * reach.h.min(0.1);
            let slosh_scale =
                hub_scale + modes.iter().map(SloshMode::error_scale).fold(0.0, f64::max);
            reach.hub_allowed = allowed * hub_scale;
            reach.slosh_allowed = allowed * slosh_scale;
        }
        reach.power *= reach.h;
        if n + 2 < MIN_ORDER {
            return false;
        }
        let slosh = modes.iter().map(|m| m.coefficient_norm(n + 1)).fold(0.0, larger);
        let is_negligible = self.hub.omega[n + 1].abs() * reach.power <= reach.hub_allowed
            && slosh * reach.power <= reach.slosh_allowed
            && self.law.coefficient_norm(n + 1) * reach.power <= allowed;
        reach.negligible = if is_negligible { reach.negligible + 1 } else { 0 };
        reach.negligible >= self.law.negligible_terms()
    }

    /// The sign that the hub's contact has by its rate or, at rest, by the torque
    /// that the bearing would have to hold.
    pub fn contact<M: SloshMode>(&mut self, modes: &mut [M], state: &State) -> Contact {
        let omega = state.x[x::OMEGA];
        if !self.law.switches_at_rest() || omega > 0.0 {
            return Contact::Forward;
        }
        if omega < 0.0 {
            return Contact::Backward;
        }
        self.derivatives(0, self.varies, modes, Contact::Stuck);
        // A law that can't hold the hub needs to know where the torque goes from 0.
        if !self.law.sticks() {
            self.derivatives(1, self.varies, modes, Contact::Stuck);
        }
        let net = [self.net[0], self.net[1]];
        self.law.contact_at_rest(net, state.x[x::THETA], state.contact)
    }

    pub fn too_many_steps(&self, time: f64) -> StepError {
        StepError::TooManySteps { time, max_steps: self.max_steps }
    }

    /// When, within `h`, the hub comes to rest, from the series of order n.
    fn time_of_rest(&self, n: usize, h: f64, contact: Contact) -> Option<f64> {
        let omega = &self.hub.omega;
        let change = omega[1..=n].iter().rev().fold(0.0, |sum, x| (sum + x.abs()) * h);
        if omega[0].abs() > change {
            return None; // far from rest
        }
        let sign = contact as i8 as f64;
        let rate = omega.map(|x| sign * x);
        // A hub that has just broken away starts with no rate, and with hardly any
        // acceleration: these roots at t = 0 are behind it.
        let first = rate[..n].iter().position(|&x| x > 0.0)?;
        let behind = if rate[0] > 0.0 { 0 } else { first };
        series::first_root(&rate[behind..=n], h)
    }

    /// When, within `h`, the torque exceeds what the bearing holds, and to which side.
    fn time_of_break_away(&self, n: usize, h: f64) -> Option<(f64, Contact)> {
        let (against_backward, against_forward) = self.law.holds(self.hub.theta[0]);
        let root = |sign: f64, hold: f64| {
            let mut left = self.net.map(|x| -sign * x);
            left[0] += hold;
            // At a torque that is just held and falls there is no break-away.
            let behind = if left[0] > 0.0 { 0 } else { left[..n].iter().position(|&x| x > 0.0)? };
            series::first_root(&left[behind..n], h)
        };
        let forward = root(1.0, against_forward).map(|t| (t, Contact::Forward));
        let backward = root(-1.0, against_backward).map(|t| (t, Contact::Backward));
        match (forward, backward) {
            (Some(f), Some(b)) => Some(if f.0 <= b.0 { f } else { b }),
            (one, other) => one.or(other),
        }
    }

    /// Moves the state on by `h`, during which torque and specific force run along
    /// their ramps; the gyro takes the samples that fall due. `steps` counts against
    /// the largest number allowed. On an error the state is unusable.
    pub fn advance<M: SloshMode>(
        &mut self,
        modes: &mut [M],
        state: &mut State,
        acting: (Ramp, Ramp),
        h: f64,
        imu: &Imu,
        steps: &mut usize,
    ) -> Result<(), StepError> {
        // The usual case is compiled apart: one mode, no loops over modes and orders.
        match modes {
            [one] if M::UNROLLED && acting.1.slope == 0.0 && !self.varies => {
                let one = core::slice::from_mut(one);
                self.advance_along::<true, M>(one, state, acting, h, imu, steps)
            }
            _ => self.advance_along::<false, M>(modes, state, acting, h, imu, steps),
        }
    }

    /// As [`Motion::advance`]; `UNROLLED` only where the specific force is held.
    #[inline(always)]
    fn advance_along<const UNROLLED: bool, M: SloshMode>(
        &mut self,
        modes: &mut [M],
        state: &mut State,
        (tau, g): (Ramp, Ramp),
        h: f64,
        imu: &Imu,
        steps: &mut usize,
    ) -> Result<(), StepError> {
        let ramp = !UNROLLED && (g.slope != 0.0 || self.varies);
        let begin = state.time;
        let mut t = 0.0;
        self.near_weightless = Damping::floor(g, h);
        self.start(modes, state, (tau, g));
        if state.x[x::OMEGA] == 0.0 {
            let contact = self.contact(modes, state);
            state.record_contact(contact, begin);
        }
        while t < h {
            *steps += 1;
            if *steps > self.max_steps {
                return Err(self.too_many_steps(begin + t));
            }
            let left = h - t;
            let contact = state.contact;
            let (n, mut length) = self.expand::<UNROLLED, M>(ramp, modes, left, contact);
            let mut event = None;
            if self.law.switches_at_rest() {
                if contact == Contact::Stuck {
                    event = self.time_of_break_away(n, length);
                } else if let Some(rest) = self.time_of_rest(n, length, contact) {
                    event = Some((rest, Contact::Stuck));
                }
            }
            if let Some((at, _)) = event {
                length = at;
            }
            if length.is_nan() {
                return Err(StepError::NotFinite { time: begin + t });
            }
            if imu.enabled {
                let since_start = begin + t - state.start_time;
                let omega = |s| series::values([&self.hub.omega], n, s)[0];
                let allowed = self.max_steps - *steps;
                *steps += imu.follow(&mut state.gyro, since_start, length, omega, allowed);
                if *steps > self.max_steps {
                    return Err(self.too_many_steps(begin + t));
                }
            }
            let stuck = contact == Contact::Stuck;
            let [theta, omega] = series::values([&self.hub.theta, &self.hub.omega], n, length);
            let omega = if stuck { 0.0 } else { omega };
            let [work, heat] = series::integrals([&self.power, &self.dissipation], n - 1, length);
            state.x[x::WORK] += work;
            state.x[x::HEAT] += heat;
            if !UNROLLED && g.slope != 0.0 {
                state.axial.work += g.slope * self.integral_of_mass_height(modes, n, length);
            }
            state.x[x::THETA] = theta;
            state.x[x::OMEGA] = omega;
            for (i, (mode, q)) in modes.iter().zip(state.slosh_mut()).enumerate() {
                *q = mode.at(n, length, omega);
                if let Some(what) = mode.out_of_range(q) {
                    let time = begin + t + length;
                    return Err(StepError::OutOfRange { time, mode: i + 1, what });
                }
            }
            self.law.advance(n, length, &mut state.x[x::BRISTLE]);
            if stuck {
                state.x[x::STUCK_TIME] += length;
            }
            t = if length == left { h } else { t + length };
            let acting = (tau.after(t), g.after(t));
            match event {
                Some((_, Contact::Stuck)) => {
                    state.x[x::OMEGA] = 0.0;
                    self.start(modes, state, acting);
                    let contact = self.contact(modes, state);
                    state.record_contact(contact, begin + t);
                }
                Some((_, contact)) => {
                    self.start(modes, state, acting);
                    state.record_contact(contact, begin + t);
                }
                None if t < h => self.start(modes, state, acting),
                None => {}
            }
            if !state.is_finite(modes.len()) {
                return Err(StepError::NotFinite { time: begin + t });
            }
        }
        state.time = begin + h;
        self.near_weightless = 0.0;
        Ok(())
    }

    /// Integral of the liquid's mass times height over `length`, kg m s, from the series of
    /// order n: what the work through a ramp of g is made of.
    #[cold]
    fn integral_of_mass_height<M: SloshMode>(&self, modes: &mut [M], n: usize, length: f64) -> f64 {
        let mut sum = ZERO;
        for j in 0..n {
            sum[j] = self.mass_height(j, modes);
        }
        let [integral] = series::integrals([&sum], n - 1, length);
        integral
    }
}

/// The larger of two sizes; unlike `f64::max` it minds no NaN, which ends the step elsewhere.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}
