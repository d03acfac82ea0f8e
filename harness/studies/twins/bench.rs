//! A bench that is independent of the FMU: the same physics in other variables, by another integrator (Dop853 of ode_solvers),
//! with none of the project's code.
//!
//! ```text
//! linear      a mass on a spring and a damper; its displacement in the inertial frame is s = r θ + l α:
//!             F = m ωₙ² (s − r θ) + 2ζωₙ m (s' − r ω),   m s'' = −F,   I₀ ω' = τ + τ_f + r F
//! spherical   a pendulum: unit vector u along the rod in the inertial frame, tension N of the rod
//!             (Lagrange's multiplier); e is the hub's radius, h = r e, D the drag, κ = r u·(z × e):
//!             N/m = −g u_z + u·D/m + ω² u·h + l|u'|² − κ ω'
//!             I₀ ω' = τ + τ_f + κ N − z·((h + l u) × D)
//!             l u'' = −g z − N u/m + D/m − ω' z × h + ω² h,   D = −2ζωₙ m l (u' − ω z × u)
//! ```
//!
//! Dry friction keeps its sign while the hub slips. The instant at which ω crosses zero is computed, and the hub then
//! sticks as long as the torque of everything except the bearing is less than c + d. The upright cylinder's first mode is
//! Table 4.1 of Rubaga's thesis.

use ode_solvers::dop853::Dop853;
use ode_solvers::{OutputType, SVector, System};

const XI: f64 = 1.841_183_781_340_659;
const TOLERANCE: f64 = 1e-11;
/// Two instants closer than this, s, count as the same.
const SAME: f64 = 1e-13;
const REST: f64 = 1e-13;
/// Torque in excess of static friction, N·m, up to which the hub counts as sticking.
const TOUCH: f64 = 1e-12;
/// Longest time that a hub sticks before the next check whether it breaks away, s.
const LOOK: f64 = 5e-3;

/// State: θ, ω, then s and s' of the linear liquid or u and u' of the spherical one. Time is a state because ode_solvers 0.6.2
/// evaluates the twelfth stage of Dop853 at the beginning of the step (c₁₂ is 0 in its table, 1 in Hairer's).
type State = SVector<f64, 9>;
const TIME: usize = 8;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Liquid {
    /// All liquid turns with the hub as a rigid body.
    Frozen,
    /// The liquid's first mode is a mass on a spring, linear in its displacement.
    Linear,
    /// The liquid's first mode is a spherical pendulum.
    Spherical,
}

/// Friction of the bearing: viscous coefficient b (N·m·s), dry friction c and Stribeck excess d (N·m), Stribeck speed `omega_s`
/// (rad/s), `asymmetry` (relative difference of the dry friction in either direction from the mean), and the rate eps (rad/s) of
/// a smoothed sign tanh(ω/eps), `None` for the exact sign.
#[derive(Clone, Copy, Debug)]
pub struct Bearing {
    pub b: f64,
    pub c: f64,
    pub d: f64,
    pub omega_s: f64,
    pub asymmetry: f64,
    pub eps: Option<f64>,
}

#[derive(Clone)]
#[allow(missing_docs)]
pub struct Bench {
    pub hub_inertia: f64,
    pub arm: f64,
    pub gravity: f64,
    pub density: f64,
    pub diameter: f64,
    pub height: f64,
    pub zeta: f64,
    pub bearing: Bearing,
    pub liquid: Liquid,
    /// Inertia, kg·m², of an appendage on a spring, and its frequency if the hub does not move, Hz. Only with the linear liquid.
    pub appendage: Option<(f64, f64)>,
    /// A torque that no fitted model contains, N·m, as a function of time, s, angle, rad, and rate, rad/s.
    pub extra_torque: fn(f64, f64, f64) -> f64,
}

impl Default for Bench {
    /// The bench of the thesis: its hub and bearing, and 10 cm of water.
    fn default() -> Self {
        Bench {
            hub_inertia: 0.322_414,
            arm: 0.225,
            gravity: 9.81,
            density: 1000.0,
            diameter: 0.163,
            height: 0.1,
            zeta: 0.002_975_7,
            bearing: Bearing {
                b: 0.03793,
                c: 0.003_498,
                d: 0.002_423,
                omega_s: 0.08581,
                asymmetry: 0.0,
                eps: None,
            },
            liquid: Liquid::Linear,
            appendage: None,
            extra_torque: |_, _, _| 0.0,
        }
    }
}

/// The torque that drives the hub, in one of three forms.
pub enum Drive<'a> {
    /// Instants (s) and torques (N·m), with linear interpolation.
    Lines(&'a [f64], &'a [f64]),
    /// Instants (s) and torques (N·m); each torque is held until the next instant.
    Held(&'a [f64], &'a [f64]),
    /// A torque that is a smooth function of time between these instants (s).
    Smooth(&'a [f64], &'a dyn Fn(f64) -> f64),
}

impl Drive<'_> {
    fn knots(&self) -> &[f64] {
        match self {
            Drive::Lines(time, _) | Drive::Held(time, _) | Drive::Smooth(time, _) => time,
        }
    }

    /// Returns the torque, N·m, at the time `t` between knot `k` and the next knot.
    fn within(&self, k: usize, t: f64) -> f64 {
        match self {
            Drive::Held(_, tau) => tau[k],
            Drive::Lines(time, tau) if k + 1 < time.len() => {
                tau[k] + (tau[k + 1] - tau[k]) * (t - time[k]) / (time[k + 1] - time[k])
            }
            Drive::Lines(_, tau) => tau[k],
            Drive::Smooth(_, at) => at(t),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Contact {
    /// The hub slips in the direction 1 or −1, the sign of its rate ω.
    Slips(f64),
    Sticks,
    Smooth,
}

/// Computed motion of the hub at the requested instants: angle (rad), rate (rad/s), the number of stops, and the
/// largest slosh angle (rad).
#[derive(Clone, Debug, Default)]
pub struct Motion {
    pub angle: Vec<f64>,
    pub rate: Vec<f64>,
    pub stops: usize,
    pub slosh: f64,
}

/// Equations of motion of the bench between two knots of the torque.
struct Equations<'a> {
    bench: &'a Bench,
    /// Inertia of everything that turns rigidly with the hub, kg·m².
    inertia: f64,
    /// Mass (kg), length (m) and natural frequency (rad/s) of the liquid's first mode.
    mode: (f64, f64, f64),
    drive: &'a Drive<'a>,
    piece: usize,
    contact: Contact,
}

/// Derivatives of the state, and the torque on the hub at rest from everything except the bearing.
struct Rates {
    state: State,
    driving: f64,
}

impl Equations<'_> {
    fn friction(&self, omega: f64) -> f64 {
        let Bearing { b, c, d, omega_s, asymmetry, eps } = self.bench.bearing;
        let curve = c + d * (-(omega / omega_s).powi(2)).exp();
        let sign = match (self.contact, eps) {
            (Contact::Slips(sign), _) => sign,
            (_, Some(eps)) => (omega / eps).tanh(),
            (..) => 0.0,
        };
        -b * omega - sign * (1.0 + asymmetry * sign) * curve
    }

    fn rates(&self, t: f64, y: &State) -> Rates {
        let Bench { arm: r, gravity: g, zeta, liquid, extra_torque, .. } = *self.bench;
        let (m, l, natural) = self.mode;
        let stuck = self.contact == Contact::Sticks;
        let (theta, omega) = (y[0], if stuck { 0.0 } else { y[1] });
        let torque = self.drive.within(self.piece, t) + extra_torque(t, theta, omega);
        let tau = torque + if stuck { 0.0 } else { self.friction(omega) };
        let drag = 2.0 * zeta * natural * m;
        let mut state = State::zeros();
        state[0] = omega;
        let driving;
        match liquid {
            Liquid::Frozen => {
                driving = torque;
                state[1] = tau / self.inertia;
            }
            Liquid::Linear => {
                let force = m * natural * natural * (y[2] - r * theta) + drag * (y[3] - r * omega);
                // torque of the appendage's spring and damper, with a damping ratio of 0.5 %
                let spring = self.bench.appendage.map_or(0.0, |(inertia, frequency)| {
                    let natural = std::f64::consts::TAU * frequency;
                    let (angle, rate) = (y[4] - theta, y[5] - omega);
                    let spring = inertia * natural * (natural * angle + 0.01 * rate);
                    (state[4], state[5]) = (y[5], -spring / inertia);
                    spring
                });
                driving = torque + r * force + spring;
                state[1] = (tau + r * force + spring) / self.inertia;
                (state[2], state[3]) = (y[3], -force / m);
            }
            Liquid::Spherical => {
                let (u, v) = ([y[2], y[3], y[4]], [y[5], y[6], y[7]]);
                let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
                let (sin, cos) = theta.sin_cos();
                let (h, z_h) = ([r * cos, r * sin, 0.0], [-r * sin, r * cos, 0.0]);
                let z_u = [-u[1], u[0], 0.0];
                let of_drag = [0, 1, 2].map(|i| -drag * l * (v[i] - omega * z_u[i]));
                let kappa = dot(u, z_h);
                let pull =
                    -g * u[2] + dot(u, of_drag) / m + omega * omega * dot(u, h) + l * dot(v, v);
                let bob = [0, 1, 2].map(|i| h[i] + l * u[i]);
                let reaction = -(bob[0] * of_drag[1] - bob[1] * of_drag[0]);
                driving = torque + m * pull * kappa + reaction;
                let with = self.inertia + m * kappa * kappa;
                state[1] = (tau + m * pull * kappa + reaction) / with;
                let alpha = if stuck { 0.0 } else { state[1] };
                let pull = pull - kappa * alpha;
                for i in 0..3 {
                    let gravity = if i == 2 { -g } else { 0.0 };
                    state[2 + i] = v[i];
                    state[5 + i] = (gravity - pull * u[i] + of_drag[i] / m - alpha * z_h[i]
                        + omega * omega * h[i])
                        / l;
                }
            }
        }
        if stuck {
            state[1] = 0.0;
        }
        Rates { state, driving }
    }

    /// Returns the torque, N·m, at which a sticking hub breaks away in a direction, 1 or −1.
    fn holds(&self, direction: f64) -> f64 {
        let Bearing { c, d, asymmetry, .. } = self.bench.bearing;
        (c + d) * (1.0 + asymmetry * direction.signum())
    }

    fn after_rest(&self, t: f64, y: &State) -> Contact {
        let at_rest = Equations { contact: Contact::Sticks, ..*self };
        let driving = at_rest.rates(t, y).driving;
        if driving.abs() <= self.holds(driving) {
            Contact::Sticks
        } else {
            Contact::Slips(driving.signum())
        }
    }

    fn integrate(&self, from: f64, to: f64, y: &State) -> State {
        let h = to - from;
        if h <= SAME {
            return *y;
        }
        let mut begin = *y;
        begin[TIME] = from;
        let mut solver = Dop853::from_param(
            self,
            0.0,
            h,
            h,
            begin,
            TOLERANCE,
            TOLERANCE,
            0.9,
            0.0,
            0.333,
            6.0,
            h,
            h,
            100_000,
            u32::MAX, // no test of stiffness
            OutputType::Sparse,
        );
        solver.integrate().expect("a smooth right-hand side");
        let mut end = *solver.y_out().last().expect("the end");
        if self.bench.liquid == Liquid::Spherical {
            // the rod's direction is divided by its length, which the integration changes slightly
            let length = (2..5).map(|i| end[i] * end[i]).sum::<f64>().sqrt();
            (2..5).for_each(|i| end[i] /= length);
            let along: f64 = (0..3).map(|i| end[2 + i] * end[5 + i]).sum();
            (0..3).for_each(|i| end[5 + i] -= along * end[2 + i]);
        }
        end
    }
}

impl System<f64, State> for &Equations<'_> {
    fn system(&self, _: f64, y: &State, dy: &mut State) {
        *dy = self.rates(y[TIME], y).state;
        dy[TIME] = 1.0;
    }
}

/// Returns the zero of f between a and b, where f has opposite signs (Illinois algorithm).
fn crossing(a: f64, b: f64, f: &dyn Fn(f64) -> f64) -> f64 {
    let (mut a, mut b, mut fa, mut fb) = (a, b, f(a), f(b));
    for _ in 0..60 {
        if (b - a).abs() < SAME || fa == fb {
            break;
        }
        let c = b - fb * (b - a) / (fb - fa);
        let fc = f(c);
        if fc == 0.0 {
            return c;
        }
        if (fc > 0.0) == (fb > 0.0) {
            fa *= 0.5;
        } else {
            (a, fa) = (b, fb);
        }
        (b, fb) = (c, fc);
    }
    b
}

impl Bench {
    /// Returns mass (kg), length (m) and natural frequency (rad/s) of the first mode, and the mass that turns with the hub, kg.
    pub fn mode(&self) -> (f64, f64, f64, f64) {
        let (d, h) = (self.diameter, self.height);
        let liquid = self.density * std::f64::consts::PI / 4.0 * d * d * h;
        let tanh = (2.0 * XI * h / d).tanh();
        let mass = liquid * d * tanh / (XI * (XI * XI - 1.0) * h);
        let length = d / (2.0 * XI * tanh);
        match self.liquid {
            Liquid::Frozen => (0.0, length, (self.gravity / length).sqrt(), liquid),
            _ => (mass, length, (self.gravity / length).sqrt(), liquid - mass),
        }
    }

    /// Returns the motion from rest at increasing instants `at` (s). Before its first knot the torque is 0.
    pub fn motion(&self, drive: &Drive, at: &[f64]) -> Motion {
        let (mass, length, natural, fixed) = self.mode();
        let knots = drive.knots();
        let mut now = Equations {
            bench: self,
            inertia: self.hub_inertia + fixed * self.arm.powi(2),
            mode: (mass, length, natural),
            drive,
            piece: 0,
            contact: Contact::Smooth,
        };
        let mut y = State::zeros();
        if self.liquid == Liquid::Spherical {
            y[4] = -1.0;
        }
        let (mut t, mut motion) = (knots[0], Motion::default());
        if self.bearing.eps.is_none() {
            now.contact = now.after_rest(t, &y);
        }
        for &instant in at {
            while t < instant - SAME {
                let end = knots.get(now.piece + 1).map_or(instant, |knot| knot.min(instant));
                while t < end - SAME {
                    (t, y) = advance(&mut now, t, end, y, &mut motion.stops);
                }
                if knots.get(now.piece + 1).is_some_and(|knot| t >= *knot - SAME) {
                    now.piece += 1;
                }
            }
            motion.angle.push(y[0]);
            motion.rate.push(y[1]);
            let slosh = match self.liquid {
                Liquid::Frozen => 0.0,
                Liquid::Linear => ((y[2] - self.arm * y[0]) / length).abs(),
                Liquid::Spherical => y[2].hypot(y[3]).asin(),
            };
            motion.slosh = motion.slosh.max(slosh);
        }
        motion
    }
}

/// Integrates the motion from `t` to `end`, or to an earlier instant at which the hub begins to stick or to slip.
fn advance(now: &mut Equations, t: f64, end: f64, y: State, stops: &mut usize) -> (f64, State) {
    match now.contact {
        Contact::Smooth => (end, now.integrate(t, end, &y)),
        Contact::Sticks => {
            let end = end.min(t + LOOK);
            let there = now.integrate(t, end, &y);
            let over = |t: f64, y: &State| {
                let driving = now.rates(t, y).driving;
                driving.abs() - now.holds(driving)
            };
            // a jump of the torque may exceed the static friction at once
            if over(t, &y) > TOUCH {
                now.contact = Contact::Slips(now.rates(t, &y).driving.signum());
                return (t, y);
            }
            if over(end, &there) <= TOUCH {
                return (end, there);
            }
            let go = crossing(t, end, &|s| over(s, &now.integrate(t, s, &y)));
            let y = now.integrate(t, go, &y);
            now.contact = Contact::Slips(now.rates(go, &y).driving.signum());
            (go, y)
        }
        Contact::Slips(sign) => {
            let there = now.integrate(t, end, &y);
            let slope = |t: f64, y: &State| sign * now.rates(t, y).state[1];
            let mut last = (sign * there[1] < -REST).then_some(end);
            if last.is_none() && slope(t, &y) < 0.0 && slope(end, &there) > 0.0 {
                // the rate may cross zero and come back within the step
                let least = crossing(t, end, &|s| slope(s, &now.integrate(t, s, &y)));
                last = (sign * now.integrate(t, least, &y)[1] < -REST).then_some(least);
            }
            let Some(last) = last else { return (end, there) };
            // a hub that starts from rest reaches its largest rate before the rate crosses zero
            let most = |s: f64| slope(s, &now.integrate(t, s, &y));
            let first =
                if y[1] == 0.0 && slope(t, &y) > 0.0 { crossing(t, last, &most) } else { t };
            let rest = crossing(first, last, &|s| sign * now.integrate(t, s, &y)[1]);
            let mut y = now.integrate(t, rest, &y);
            y[1] = 0.0;
            let before = now.contact;
            now.contact = now.after_rest(rest, &y);
            if now.contact == before {
                // the hub broke away and stopped again within rounding errors
                now.contact = Contact::Sticks;
            }
            *stops += 1;
            (rest, y)
        }
    }
}
