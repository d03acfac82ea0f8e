//! Steps through time: a Taylor-series integrator with an automaton for stick and slip.
//!
//! Over one step the whole motion is a power series in time (`series.rs`). The order
//! grows until terms in a row, at the step's end, are below the tolerance; where
//! the highest order does not get there, the step is cut to the length at which it
//! does. So short steps are cheap, nothing is ever rejected, and the series between
//! the ends is as exact as at the ends: the instants at which the hub comes to rest
//! or breaks away are roots of polynomials, found without stepping back.

use crate::friction::{Contact, Law};
use crate::series::{self, ORDER, Series, ZERO};
use crate::slosh::{Hub, Mode};
use crate::{MODES, Ramp, State};

/// Error of one step against the tolerance asked for. A step's error is forgotten
/// as the liquid's motion decays, within some thousand steps.
const STEP_SHARE: f64 = 1e-2;

/// Rates below this are nothing, rad/s: the floor of the error's scale.
const NOTHING: f64 = 1e-6;

/// The integrator's steps that one call may take.
const MAX_STEPS: usize = 200_000;

/// The lowest order that is trusted to show that a series has converged.
const MIN_ORDER: usize = 5;

/// Why a step was refused; its text is for the user. The state is as before the step.
#[derive(Clone, Debug, PartialEq)]
pub enum StepError {
    /// The motion grew beyond all numbers.
    NotFinite {
        /// When, s.
        time: f64,
    },
    /// The step needs more work than is allowed.
    TooManySteps {
        /// How far the integrator came, s.
        time: f64,
    },
    /// A slosh mode left the range in which its model means anything.
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
                write!(f, "the motion is no longer finite at t = {time} s")
            }
            StepError::TooManySteps { time } => write!(
                f,
                "the integrator used up its {MAX_STEPS} steps at t = {time} s; take shorter \
                 communication steps or a looser tolerance, or, with stribeck_smooth, a larger \
                 friction.eps"
            ),
            StepError::OutOfRange { time, mode, what } => {
                write!(f, "slosh mode {mode} left its range at t = {time} s: {what}")
            }
        }
    }
}

/// The hub's equation with the power series of its parts:
/// J w' = tau + tau_f + T, J = I0 + sum of J_i, T = sum of T_i over the modes.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    /// Inertia of hub and frozen liquid, kg m2.
    pub i0: f64,
    pub friction: Law,
    pub tolerance: f64,
    pub theta: Series,
    pub hub: Hub,
    /// Torque of wheel and environment over the step.
    tau: [f64; 2],
    inertia: Series,
    /// tau + T, the torque that the bearing must hold at rest.
    pub net: Series,
    power: Series,
}

impl Motion {
    pub fn new(i0: f64, friction: Law, tolerance: f64) -> Motion {
        let hub = Hub { omega: ZERO, omega2: ZERO, omega_dot: ZERO, g: [0.0; 2] };
        let (theta, inertia, net, power) = (ZERO, ZERO, ZERO, ZERO);
        Motion { i0, friction, tolerance, theta, hub, tau: [0.0; 2], inertia, net, power }
    }

    /// Puts everything at the state, with the given torque and specific force.
    pub fn start<M: Mode>(&mut self, modes: &mut [M], state: &State, tau: Ramp, g: Ramp) {
        self.theta[0] = state.theta;
        self.hub.omega[0] = state.omega;
        self.hub.g = [g.value, g.slope];
        self.tau = [tau.value, tau.slope];
        for (mode, q) in modes.iter_mut().zip(&state.modes) {
            mode.start(q);
        }
    }

    /// Coefficient n of every quantity from coefficients up to n of the state.
    #[inline(always)]
    pub fn rates<M: Mode>(&mut self, modes: &mut [M], n: usize, contact: Contact) {
        self.hub.omega2[n] = series::square(&self.hub.omega, n);
        let (mut inertia, mut net) = (0.0, if n < 2 { self.tau[n] } else { 0.0 });
        for mode in modes.iter_mut() {
            let load = mode.load(n, &self.hub);
            inertia += load.j;
            net += load.t;
        }
        self.inertia[n] = if n == 0 { self.i0 + inertia } else { inertia };
        self.net[n] = net;
        self.hub.omega_dot[n] = if contact == Contact::Stuck {
            self.friction.tau_f[n] = -net;
            0.0
        } else {
            self.friction.slip(n, contact, &self.theta, &self.hub.omega, &self.hub.omega2);
            let torque = net + self.friction.tau_f[n];
            (torque - series::mul_tail(&self.inertia, &self.hub.omega_dot, n)) / self.inertia[0]
        };
        for mode in modes.iter_mut() {
            mode.respond(n, &self.hub);
        }
    }

    /// Expands the motion up to `h` ahead. Returns the order and the length, at most
    /// `h`, at which the terms left out are below the tolerance.
    #[inline(always)]
    fn expand<M: Mode>(&mut self, modes: &mut [M], h: f64, contact: Contact) -> (usize, f64) {
        let allowed = STEP_SHARE * self.tolerance;
        let mut h = h;
        let (mut hub_scale, mut slosh_scale) = (0.0, 0.0);
        let mut power = 1.0; // h^n
        let mut small = 0;
        for n in 0..ORDER {
            self.rates(modes, n, contact);
            let next = (n + 1) as f64;
            self.theta[n + 1] = self.hub.omega[n] / next;
            self.hub.omega[n + 1] = self.hub.omega_dot[n] / next;
            for mode in modes.iter_mut() {
                mode.grow(n);
            }
            if n == 1 {
                h = h.min(self.friction.reach(&self.hub.omega));
                // The hub's rate passes zero many times; the scale of its error must not.
                let [w, w_d] = [self.hub.omega[0], self.hub.omega[1]].map(f64::abs);
                hub_scale = NOTHING + w + w_d * h.min(0.1);
                slosh_scale = hub_scale + modes.iter().map(Mode::size).fold(0.0, f64::max);
                power = h;
            }
            if n >= 1 {
                power *= h;
                let slosh = modes.iter().map(|m| m.term(n + 1)).fold(0.0, f64::max);
                let is_small = self.hub.omega[n + 1].abs() * power <= allowed * hub_scale
                    && slosh * power <= allowed * slosh_scale;
                small = if is_small { small + 1 } else { 0 };
                if small >= self.friction.quiet_terms() && n + 1 >= MIN_ORDER {
                    return (n + 1, h);
                }
            }
        }
        // The last two terms reach the tolerance at this length.
        let length = |n: usize| {
            let slosh = modes.iter().map(|m| m.term(n)).fold(0.0, f64::max);
            let hub = self.hub.omega[n].abs() / hub_scale;
            let term = f64::max(hub, slosh / slosh_scale) / allowed;
            if term > 0.0 { libm::exp(-libm::log(term) / n as f64) } else { h }
        };
        (ORDER, h.min(length(ORDER)).min(length(ORDER - 1)))
    }

    /// The sign that the hub's contact has by its rate or, at rest, by the torque
    /// that the bearing would have to hold.
    pub fn contact<M: Mode>(&mut self, modes: &mut [M], state: &State) -> Contact {
        if !self.friction.can_stick() || state.omega > 0.0 {
            return Contact::Forward;
        }
        if state.omega < 0.0 {
            return Contact::Backward;
        }
        self.rates(modes, 0, Contact::Stuck);
        let (against_backward, against_forward) = self.friction.holds(state.theta);
        // A hub that has just broken away is at the limit, give or take rounding.
        let limit = |hold: f64, from: Contact| {
            if state.contact == from { hold * (1.0 - 1e-12) } else { hold }
        };
        match self.net[0] {
            net if net > limit(against_forward, Contact::Forward) => Contact::Forward,
            net if net < -limit(against_backward, Contact::Backward) => Contact::Backward,
            _ => Contact::Stuck,
        }
    }

    /// When, within `h`, the hub comes to rest, from the series of order n.
    fn time_of_rest(&self, n: usize, h: f64, contact: Contact) -> Option<f64> {
        let mut rate = ZERO;
        for j in 0..=n {
            rate[j] = contact as i8 as f64 * self.hub.omega[j];
        }
        // A hub that has just broken away starts with no rate, and with hardly any
        // acceleration: these roots at t = 0 are behind it.
        let first = rate[..n].iter().position(|&x| x > 0.0)?;
        let behind = if rate[0] > 0.0 { 0 } else { first };
        series::first_root(&rate[behind..=n], h)
    }

    /// When, within `h`, the torque exceeds what the bearing holds, and to which side.
    fn time_of_break_away(&self, n: usize, h: f64) -> Option<(f64, Contact)> {
        let (against_backward, against_forward) = self.friction.holds(self.theta[0]);
        let root = |sign: f64, hold: f64| {
            let mut left = ZERO;
            for j in 0..n {
                left[j] = -sign * self.net[j];
            }
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
    /// their ramps. `watch(start, length, omega)` sees the hub's rate as a function of
    /// the time since `start` over every step. On an error the state is unusable.
    pub fn advance<M: Mode>(
        &mut self,
        modes: &mut [M],
        state: &mut State,
        (tau, g): (Ramp, Ramp),
        h: f64,
        steps: &mut usize,
        watch: &mut dyn FnMut(f64, f64, &dyn Fn(f64) -> f64),
    ) -> Result<(), StepError> {
        let begin = state.time;
        let mut t = 0.0;
        self.start(modes, state, tau, g);
        if state.omega == 0.0 {
            let contact = self.contact(modes, state);
            state.touch(contact, begin);
        }
        while t < h {
            *steps += 1;
            if *steps > MAX_STEPS {
                return Err(StepError::TooManySteps { time: begin + t });
            }
            let left = h - t;
            let contact = state.contact;
            let (n, mut length) = self.expand(modes, left, contact);
            let mut event = None;
            if self.friction.can_stick() {
                if contact == Contact::Stuck {
                    event = self.time_of_break_away(n, length);
                } else if let Some(rest) = self.time_of_rest(n, length, contact) {
                    event = Some((rest, Contact::Stuck));
                }
            }
            if let Some((at, _)) = event {
                length = at;
            }
            // A length that is not a number fails here too.
            if !(length >= 0.0) {
                return Err(StepError::NotFinite { time: begin + t });
            }
            watch(begin + t, length, &|s| series::value(&self.hub.omega, n, s));

            // work and heat
            let stuck = contact == Contact::Stuck;
            for j in 0..=n {
                let bearing =
                    if stuck { 0.0 } else { -series::mul(&self.friction.tau_f, &self.hub.omega, j) };
                let liquid: f64 = modes.iter_mut().map(|m| m.heat(j)).sum();
                self.power[j] = bearing + liquid;
            }
            state.heat += series::integral(&self.power, n - 1, length);
            for j in 0..=n {
                self.power[j] = series::mul_ramp(&self.tau, &self.hub.omega, j);
            }
            state.work += series::integral(&self.power, n, length);

            // the end of the step
            state.theta = series::value(&self.theta, n, length);
            state.omega = if stuck { 0.0 } else { series::value(&self.hub.omega, n, length) };
            for (i, (mode, q)) in modes.iter().zip(&mut state.modes).enumerate() {
                *q = mode.at(n, length);
                if let Some(what) = mode.out_of_range(q) {
                    let time = begin + t + length;
                    return Err(StepError::OutOfRange { time, mode: i + 1, what });
                }
            }
            if stuck {
                state.stuck_time += length;
            }
            t = if length == left { h } else { t + length };
            let now = |x: Ramp| Ramp { value: x.at(t), slope: x.slope };
            match event {
                Some((_, Contact::Stuck)) => {
                    state.omega = 0.0;
                    self.start(modes, state, now(tau), now(g));
                    let contact = self.contact(modes, state);
                    state.touch(contact, begin + t);
                }
                Some((_, contact)) => {
                    self.start(modes, state, now(tau), now(g));
                    state.touch(contact, begin + t);
                }
                None => self.start(modes, state, now(tau), now(g)),
            }
            if !state.is_finite() {
                return Err(StepError::NotFinite { time: begin + t });
            }
        }
        state.time = begin + h;
        Ok(())
    }
}

impl State {
    /// Notes a new contact at `time`.
    pub(crate) fn touch(&mut self, contact: Contact, time: f64) {
        if contact != self.contact {
            self.contact = contact;
            self.event_count = self.event_count.saturating_add(1);
            self.event_time = time;
        }
    }

    fn is_finite(&self) -> bool {
        let modes: f64 = self.modes[..MODES].iter().flatten().map(|x| x * 0.0).sum();
        (self.theta * 0.0 + self.omega * 0.0 + modes) == 0.0
    }
}
