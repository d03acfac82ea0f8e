//! Integration of the plant's motion: the hub's equation as power series, and the transitions between stick and slip. The
//! instants at which the hub comes to rest or breaks away are roots of polynomials, so that no step is repeated.
//! `taylor::integrator` determines the lengths of the steps.

use alloc::format;
use core::ops::ControlFlow;

use taylor::error::StepError;
use taylor::integrator::{self, Convergence, RATE_FLOOR, Steps};
use taylor::number::Number;
use taylor::root::first_root;
use taylor::series::{self, ORDER, Series, ZERO, number};

use crate::contact::Contact;
use crate::damping::{Damping, RAMP_ORDER};
use crate::friction::Law;
use crate::hub::HubMotion;
use crate::inputs::Ramp;
use crate::parameters::{Imu, Parameters, SloshSource};
use crate::slosh::SloshMode;
use crate::slosh_model::SloshModel;
use crate::state::{State, x};
use crate::suspension::Suspension;

const ADVICE: &str = ", with stribeck_smooth a larger friction.eps, with the gyro (its samples count as \
                      steps) a lower imu.rate";

pub(crate) fn out_of_range(time: f64, mode: usize, what: &str) -> StepError {
    let number = mode + 1;
    StepError::Model(format!("slosh mode {number} left its range at t = {time} s: {what}"))
}

/// Decides at which event a step stops. A step consists of stretches over which torque and specific force are linear in time;
/// `offset` is the time from the start of the step to the start of the present stretch, s. The step stops only at events that
/// are later than `passed` seconds after its start, so that a step can continue after an event. `passed` is infinite if the
/// step does not stop at events.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stop {
    pub offset: f64,
    pub passed: f64,
}

impl Stop {
    #[inline(always)]
    pub fn is_at(self, t: f64) -> bool {
        self.offset + t > self.passed
    }

    /// Returns the time of the first gyro sample at which the step stops, s after the start of the present power series;
    /// `None` if there is no such sample. The series begins `t` seconds after the start of the stretch and `since_start`
    /// seconds after the start of the simulation, and it is used for `h` seconds. `next` is the number of the next sample;
    /// only `allowed` samples are considered.
    // Arguments are passed by value, because a reference would force all data of a stretch into memory.
    #[cold]
    fn at_sample(
        self,
        (t, h): (f64, f64),
        since_start: f64,
        imu: &Imu,
        (next, allowed): (u64, usize),
    ) -> Option<f64> {
        let due = (next..).take(allowed).map(|k| imu.due(k, since_start));
        due.take_while(|due| *due <= h).map(|due| due.max(0.0)).find(|due| self.is_at(t + due))
    }
}

/// The hub's equation J w' = tau + tau_f + T as power series in time, where J is the inertia of hub and liquid, w the rate of
/// the hub, tau the torque of wheel and environment, tau_f the friction of the bearing, and T the torque of the liquid.
/// - `i0`: inertia of hub and rigid liquid, kg m2.
/// - `imbalance`: radial and tangential component of the static moment of the dry hub, kg m. `rigid_moment`: static moment
///   of the rigid liquid, kg m.
/// - `tau`: tau, N m, and its slope. `net`: the sum tau + T, which the bearing must hold at rest.
/// - `power`: power of the external torques, W; `dissipation`: power dissipated in bearing, suspension line and liquid, W.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    pub i0: f64,
    pub law: Law,
    pub suspension: Suspension,
    pub damping: Damping,
    /// True if drag or weight of a slosh mass changes during an internal step although g is constant: if the drag depends on
    /// the amplitude, the bench is tilted, or a mode moves along another direction than the tangent.
    pub varies: bool,
    with_amplitude: bool,
    imbalance: [f64; 2],
    rigid_moment: f64,
    /// Specific force g, m/s2, and its rate, with which the series of drag and weight were last computed. The series are
    /// computed again if one of these values changes. NaN enforces this, because it differs from every value.
    g: [f64; 2],
    near_weightless: f64,
    tolerance: f64,
    max_steps: usize,
    pub hub: HubMotion,
    tau: [f64; 2],
    inertia: Series,
    inv_inertia: f64,
    pub tau_f: Series,
    pub net: Series,
    pub power: Series,
    pub dissipation: Series,
}

impl Motion {
    pub fn new(p: &Parameters, i_0: f64, m_0: f64, damping: Damping, tolerance: f64) -> Motion {
        let (sin, cos) = libm::sincos(p.hub.imbalance_angle);
        let mut hub = HubMotion::REST;
        hub.tilt.tangent = libm::tan(p.bench.tilt);
        hub.tilt.azimuth = p.bench.tilt_azimuth;
        let with_amplitude = (p.baffle.width > 0.0 || p.slosh.damping_grows())
            && p.slosh.model != SloshModel::Frozen;
        let is_askew =
            p.slosh.source == SloshSource::Table && p.slosh.table.is_askew(p.slosh.modes);
        Motion {
            i0: p.hub.inertia + i_0,
            law: Law::new(&p.friction),
            suspension: Suspension::new(&p.hub),
            damping,
            varies: with_amplitude || hub.tilt.tangent != 0.0 || is_askew,
            with_amplitude,
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

    #[cold]
    fn set_axial<M: SloshMode>(&mut self, modes: &mut [M], g: Ramp) {
        self.hub.g = [g.value, g.slope];
        // A drag that depends on the amplitude was computed for this instant only and must not be used again.
        self.g = if self.with_amplitude { [f64::NAN; 2] } else { self.hub.g };
        self.hub.damping_reach = f64::INFINITY;
        for (n, mode) in modes.iter_mut().enumerate() {
            let amplitude2 = mode.amplitude2::<f64>();
            let pendulum = mode.pendulum_mut();
            let reach = self.damping.expand(n, g, self.near_weightless, pendulum);
            self.hub.damping_reach = self.hub.damping_reach.min(reach);
            if pendulum.follows_amplitude() {
                pendulum.add_amplitude_drag(amplitude2);
            }
        }
    }

    fn gravity_torque(&self, n: usize) -> f64 {
        let ([x, y], [e_x, e_y]) = (self.imbalance, &self.hub.tilt.e);
        x * e_y[n] - y * e_x[n]
    }

    pub fn gravity_torques<T: Number>(&self) -> [T; 2] {
        let ([x, y], [e_x, e_y]): (_, [T; 2]) = (self.imbalance, self.hub.tilt.now());
        [e_y * x - e_x * y, e_y * self.rigid_moment]
    }

    pub fn potential<T: Number>(&self) -> T {
        let ([x, y], [e_x, e_y]): (_, [T; 2]) = (self.imbalance, self.hub.tilt.now());
        -(e_x * (x + self.rigid_moment) + e_y * y)
    }

    /// Returns the sum of mass times height over hub and liquid, kg m, and the rate of this sum. Heights are measured from
    /// the rest position; the potential energy is g times the sum.
    pub fn height<T: Number, M: SloshMode>(&self, modes: &[M]) -> [T; 2] {
        let ([x, y], still) = (self.imbalance, [T::constant(0.0); 2]);
        let moment = [x + self.rigid_moment, y].map(T::constant);
        let dry = self.hub.tilt.height_now(moment, still, number(&self.hub.omega));
        modes
            .iter()
            .map(|mode| mode.height(&self.hub))
            .fold(dry, |sum, mode: [T; 2]| [sum[0] + mode[0], sum[1] + mode[1]])
    }

    fn mass_height<M: SloshMode>(&self, n: usize, modes: &mut [M]) -> f64 {
        let [x, y] = self.imbalance;
        let moment = |j| [series::constant(j, x + self.rigid_moment), series::constant(j, y)];
        modes.iter_mut().map(|mode| mode.mass_height(n, &self.hub)).sum::<f64>()
            + self.hub.tilt.height(n, moment)
    }

    /// Computes Taylor coefficient n of every quantity, and coefficient n + 1 of the state, from the coefficients of the
    /// state up to n. `ramp` is true if specific force, drag or weight changes in time, and `hangs` if the hub hangs from a
    /// suspension line.
    #[inline(always)]
    pub fn derivatives<M: SloshMode>(
        &mut self,
        n: usize,
        (ramp, hangs): (bool, bool),
        modes: &mut [M],
        contact: Contact,
    ) {
        self.hub.omega2[n] = series::square(n, &self.hub.omega);
        let (mut inertia, mut net) = (0.0, if n < 2 { self.tau[n] } else { 0.0 });
        if ramp {
            self.hub.tilt.expand(n, &self.hub.theta, &self.hub.g);
            net += self.gravity_torque(n) + self.rigid_moment * self.hub.tilt.e[1][n];
        }
        if hangs {
            net += self.suspension.torque(n, &self.hub);
        }
        for mode in modes.iter_mut() {
            let reaction = mode.hub_reaction(n, ramp, &self.hub);
            inertia += reaction.j;
            net += reaction.t;
        }
        if n == 0 || M::MOVES_INERTIA {
            self.inertia[n] = series::constant(n, self.i0) + inertia;
        }
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
        if hangs {
            self.dissipation[n] += self.suspension.dissipation(n, &self.hub);
        }
        for mode in modes.iter_mut() {
            mode.accelerate(n, ramp, &self.hub);
            self.dissipation[n] += mode.dissipation(n, ramp);
        }
    }

    #[cold]
    #[inline(never)]
    pub fn derivatives_varying<M: SloshMode>(&mut self, modes: &mut [M], contact: Contact) {
        self.derivatives(0, (true, self.suspension.exists), modes, contact);
    }

    /// Determines the contact between hub and bearing: from the direction of the hub's rate, or, if the hub is at rest, from
    /// the torque that the bearing would have to hold.
    pub fn contact<M: SloshMode>(&mut self, modes: &mut [M], state: &State) -> Contact {
        let omega = state.x[x::OMEGA];
        if !self.law.switches_at_rest() || omega > 0.0 {
            return Contact::Forward;
        }
        if omega < 0.0 {
            return Contact::Backward;
        }
        let forces = (self.varies, self.suspension.exists);
        self.derivatives(0, forces, modes, Contact::Stuck);
        // A law that cannot hold the hub at rest needs the direction in which the torque departs from 0.
        if !self.law.sticks() {
            self.derivatives(1, forces, modes, Contact::Stuck);
        }
        let net = [self.net[0], self.net[1]];
        self.law.contact_at_rest(net, state.x[x::THETA], state.contact)
    }

    pub fn steps(&self) -> Steps {
        Steps::new(self.max_steps, ADVICE)
    }

    /// Returns the time at which the hub comes to rest, s, from the series of its rate up to order n; `None` if it does not
    /// come to rest within `h` seconds.
    fn time_of_rest(&self, n: usize, h: f64, contact: Contact) -> Option<f64> {
        let omega = &self.hub.omega;
        let change = omega[1..=n].iter().rev().fold(0.0, |sum, x| (sum + x.abs()) * h);
        if omega[0].abs() > change {
            return None; // the hub does not come near rest
        }
        let sign = contact as i8 as f64;
        let rate = omega.map(|x| sign * x);
        // A hub that has just broken away starts with zero rate and almost no acceleration. The
        // roots at t = 0 are in the past.
        let first = rate[..n].iter().position(|&x| x > 0.0)?;
        let behind = if rate[0] > 0.0 { 0 } else { first };
        first_root(&rate[behind..=n], h)
    }

    /// Returns the time at which the torque on a stuck hub exceeds the static friction of the bearing, s, and the direction
    /// of the motion that follows; `None` if the hub stays stuck for `h` seconds.
    fn time_of_break_away(&self, n: usize, h: f64) -> Option<(f64, Contact)> {
        let (against_backward, against_forward) = self.law.holding_torques(self.hub.theta[0]);
        let root = |sign: f64, hold: f64| {
            let mut left = self.net.map(|x| -sign * x);
            left[0] += hold;
            // A torque that equals the static friction and falls causes no break-away.
            let behind = if left[0] > 0.0 { 0 } else { left[..n].iter().position(|&x| x > 0.0)? };
            first_root(&left[behind..n], h)
        };
        let forward = root(1.0, against_forward).map(|t| (t, Contact::Forward));
        let backward = root(-1.0, against_backward).map(|t| (t, Contact::Backward));
        match (forward, backward) {
            (Some(f), Some(b)) => Some(if f.0 <= b.0 { f } else { b }),
            (one, other) => one.or(other),
        }
    }

    /// Advances the state by `h` seconds, during which torque and specific force (`acting`) follow their ramps. The gyro
    /// takes the samples that are due, and each sample counts as one of the internal `steps`. If the step stops at an event
    /// (`stop`), the elapsed time is returned. If an error is returned, the state is invalid.
    pub fn advance<M: SloshMode>(
        &mut self,
        modes: &mut [M],
        state: &mut State,
        acting: (Ramp, Ramp),
        h: f64,
        (imu, stop): (&Imu, Stop),
        steps: &mut Steps,
    ) -> Result<ControlFlow<f64>, StepError> {
        // The usual case of one mode is compiled separately, without loops over modes and orders.
        match modes {
            [one] if M::UNROLLED && acting.1.slope == 0.0 && self.is_plain() => {
                let one = core::slice::from_mut(one);
                self.advance_along::<true, M>(one, state, acting, h, (imu, stop), steps)
            }
            _ => self.advance_along::<false, M>(modes, state, acting, h, (imu, stop), steps),
        }
    }

    /// Returns true if drag and weight of the liquid depend only on g, and there is no suspension line.
    fn is_plain(&self) -> bool {
        !self.varies && !self.suspension.exists
    }

    /// Advances the motion as [`Motion::advance`] does, for one slosh model. `UNROLLED` selects faster code for one mode,
    /// which is allowed only if the specific force is constant and [`Motion::is_plain`] is true.
    #[inline(always)]
    fn advance_along<const UNROLLED: bool, M: SloshMode>(
        &mut self,
        modes: &mut [M],
        state: &mut State,
        acting: (Ramp, Ramp),
        h: f64,
        (imu, stop): (&Imu, Stop),
        steps: &mut Steps,
    ) -> Result<ControlFlow<f64>, StepError> {
        let (begin, elapsed, tolerance) = (state.time, state.elapsed, self.tolerance);
        self.near_weightless = Damping::floor(acting.1, h);
        if state.x[x::OMEGA] == 0.0 {
            self.start(modes, state, acting);
            let contact = self.contact(modes, state);
            if state.record_contact(contact, begin) && stop.is_at(0.0) {
                self.near_weightless = 0.0;
                return Ok(ControlFlow::Break(0.0));
            }
        }
        let varies = acting.1.slope != 0.0 || self.varies;
        let allowed = [0.0; 3];
        let (t, event) = (0.0, None);
        let mut stretch = Stretch::<UNROLLED, M> {
            motion: &mut *self,
            modes,
            state: &mut *state,
            acting,
            imu,
            stop,
            varies,
            begin,
            t,
            event,
            allowed,
        };
        let flow = integrator::advance(&mut stretch, begin, h, tolerance, steps)?;
        let t = if let ControlFlow::Break(t) = flow { t } else { h };
        state.set_clock((begin, elapsed), t);
        self.near_weightless = 0.0;
        Ok(flow)
    }

    /// Returns the integral of the liquid's mass times height over `length` seconds, kg m s, from the series up to order n.
    /// If the specific force is linear in time, its change does the work slope times this integral.
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

/// A part of a step during which torque and specific force (`acting`) are linear in time. `begin` is the simulation time at
/// its start, s, and `t` the time since then. `event` is the new contact if the present series ends with an event. `allowed`
/// are the allowed errors of the rates of hub and liquid, rad/s, and of the state of the friction law.
struct Stretch<'a, const UNROLLED: bool, M: SloshMode> {
    motion: &'a mut Motion,
    modes: &'a mut [M],
    state: &'a mut State,
    acting: (Ramp, Ramp),
    imu: &'a Imu,
    stop: Stop,
    varies: bool,
    begin: f64,
    t: f64,
    event: Option<Contact>,
    allowed: [f64; 3],
}

impl<const UNROLLED: bool, M: SloshMode> Stretch<'_, UNROLLED, M> {
    #[inline(always)]
    fn varies(&self) -> bool {
        !UNROLLED && self.varies
    }

    #[inline(always)]
    fn acting_at(&self, t: f64) -> (Ramp, Ramp) {
        (self.acting.0.shifted(t), self.acting.1.shifted(t))
    }
}

impl<const UNROLLED: bool, M: SloshMode> integrator::Motion for Stretch<'_, UNROLLED, M> {
    const UNROLLED: bool = UNROLLED;

    #[inline(always)]
    fn start(&mut self, t: f64) {
        self.t = t;
        self.motion.start(self.modes, self.state, self.acting_at(t));
    }

    #[inline(always)]
    fn rates(&mut self, n: usize) {
        let forces = (self.varies(), !UNROLLED && self.motion.suspension.exists);
        self.motion.derivatives(n, forces, self.modes, self.state.contact);
    }

    #[inline(always)]
    fn set_error_scale(&mut self, h: f64, allowed: f64) -> f64 {
        let motion = &self.motion;
        let h = h.min(motion.law.convergence_radius(&motion.hub.omega));
        let h = if self.varies() { h.min(motion.hub.damping_reach) } else { h };
        let h = if self.varies() && motion.with_amplitude {
            self.modes.iter().map(|mode| mode.pendulum().convergence_radius()).fold(h, f64::min)
        } else {
            h
        };
        // The scale of the allowed error must not be 0 although the hub's rate passes zero many times.
        let [w, w_d] = [motion.hub.omega[0], motion.hub.omega[1]].map(f64::abs);
        let hub = RATE_FLOOR + w + w_d * h.min(0.1);
        let slosh = hub + self.modes.iter().map(SloshMode::error_scale).fold(0.0, f64::max);
        self.allowed = [hub, slosh, 1.0].map(|scale| allowed * scale);
        h
    }

    #[inline(always)]
    fn coefficient_norm(&self, n: usize) -> f64 {
        let slosh = self.modes.iter().map(|mode| mode.coefficient_norm(n)).fold(0.0, larger);
        let [hub, liquid, law] = self.allowed;
        let norm = larger(self.motion.hub.omega[n].abs() / hub, slosh / liquid);
        larger(norm, self.motion.law.coefficient_norm(n) / law)
    }

    #[inline(always)]
    fn is_negligible(&self, n: usize, power: f64) -> bool {
        let [hub, liquid, law] = self.allowed;
        let slosh = || self.modes.iter().map(|mode| mode.coefficient_norm(n)).fold(0.0, larger);
        self.motion.hub.omega[n].abs() * power <= hub
            && slosh() * power <= liquid
            && self.motion.law.coefficient_norm(n) * power <= law
    }

    #[inline(always)]
    fn convergence(&self) -> Convergence {
        Convergence::Terms(self.motion.law.negligible_terms())
    }

    #[inline(always)]
    fn highest_order(&self) -> usize {
        if self.varies() { RAMP_ORDER } else { ORDER }
    }

    #[inline(always)]
    fn defect(&self, n: usize, h: f64) -> f64 {
        if !(self.varies() && self.motion.with_amplitude) {
            return 0.0;
        }
        let all = self.modes.iter().map(|mode| mode.pendulum().defect(n - 1, h));
        all.fold(0.0, larger) / self.allowed[1]
    }

    #[inline(always)]
    fn event(&mut self, n: usize, h: f64) -> Option<f64> {
        self.event = None;
        if !self.motion.law.switches_at_rest() {
            return None;
        }
        let contact = self.state.contact;
        let (at, next) = if contact == Contact::Stuck {
            self.motion.time_of_break_away(n, h)?
        } else {
            (self.motion.time_of_rest(n, h, contact)?, Contact::Stuck)
        };
        self.event = Some(next);
        Some(at)
    }

    #[inline(always)]
    fn take(
        &mut self,
        n: usize,
        mut h: f64,
        mut t: f64,
        steps: &mut Steps,
    ) -> Result<ControlFlow<f64>, StepError> {
        let mut flow = ControlFlow::Continue(());
        let Stretch { motion, modes, state, begin, .. } = self;
        if self.imu.enabled {
            let since_start = state.elapsed[0] + self.t;
            let samples = (state.gyro.next, steps.left());
            if self.stop.passed < f64::INFINITY
                && let Some(due) = self.stop.at_sample((self.t, h), since_start, self.imu, samples)
            {
                if due < h {
                    (h, t) = (due, self.t + due);
                    self.event = None;
                }
                flow = ControlFlow::Break(t);
            }
            let omega = |s| series::values([&motion.hub.omega], n, s)[0];
            let taken = self.imu.follow(&mut state.gyro, since_start, h, omega, steps.left());
            steps.add_steps(taken, *begin + self.t)?;
        }
        let varies = !UNROLLED && self.varies;
        let stuck = state.contact == Contact::Stuck;
        let [theta, omega] = series::values([&motion.hub.theta, &motion.hub.omega], n, h);
        let omega = if stuck { 0.0 } else { omega };
        let [work, heat] = series::integrals([&motion.power, &motion.dissipation], n - 1, h);
        state.x[x::WORK] += work;
        state.x[x::HEAT] += heat;
        let g_slope = self.acting.1.slope;
        if !UNROLLED && g_slope != 0.0 {
            state.axial.work += g_slope * motion.integral_of_mass_height(modes, n, h);
        }
        state.x[x::THETA] = theta;
        state.x[x::OMEGA] = omega;
        for (i, (mode, q)) in modes.iter().zip(state.slosh_mut()).enumerate() {
            *q = mode.coordinates_at(n, h, omega, varies);
            if let Some(what) = mode.out_of_range(q) {
                return Err(out_of_range(*begin + self.t + h, i, what));
            }
        }
        motion.law.advance(n, h, &mut state.x[x::BRISTLE]);
        if stuck {
            state.x[x::STUCK_TIME] += h;
        }
        if let Some(contact) = self.event {
            if contact == Contact::Stuck {
                state.x[x::OMEGA] = 0.0;
            }
            self.start(t);
            let Stretch { motion, modes, state, .. } = self;
            let contact =
                if contact == Contact::Stuck { motion.contact(modes, state) } else { contact };
            state.record_contact(contact, self.begin + t);
            if self.stop.is_at(t) {
                flow = ControlFlow::Break(t);
            }
        }
        if self.state.is_finite(self.modes.len()) {
            Ok(flow)
        } else {
            Err(StepError::NotFinite { time: self.begin + t })
        }
    }
}

/// Returns the larger of two magnitudes. If one of them is NaN, the function may return the other one. This is harmless,
/// because other checks end a step with NaN.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}
