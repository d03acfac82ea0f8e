//! Limits of the range in which the slosh modes represent the liquid. If several reasons apply, the first in
//! this order is reported:
//!
//! ```text
//! spin                 omega^2 R/(l w^2) > 0.3, or 2 omega/w > (1 + C_0)^(-1/2)   (`formulas::limits::SpinLimit`)
//! bond_number          rho g R^2/sigma < 100 in a tank without capillarity or centring stiffness
//! secondary_resonance  A above the fold of rotary motion
//! breaking             steepness above slosh.breaking_steepness, if that is above 0
//! third_order          A above the angle at which the model's frequency is wrong, or above 45 degrees
//! ```
//!
//! w is the frequency of mode 1, w^2 = g/l + k/m, and A is its slosh angle, sin A = displacement/l. In an upright cylinder
//! the limits of A follow from the depth and from the dependence of the model's frequency on the amplitude. A table of modes
//! contains its own limits.

use formulas::limits::{self, LOW_BOND, LimitedBy, SpinLimit};
use formulas::third_order;

use crate::parameters::{MODES, Parameters, SloshSource};
use crate::slosh::Angles;
use crate::tank::Calculated;

/// Swirl number (2 b/a)/(1 + (b/a)^2) of an ellipse with the semi-axes a and b = a/2. A motion with a larger swirl number
/// counts as rotary.
const ROTARY: f64 = 0.8;
const LARGEST: f64 = core::f64::consts::FRAC_PI_4;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    mode: [ModeLimits; MODES],
    spin: SpinLimit,
    /// Bond number of the tank per specific force, s2/m; 0 if surface tension does not limit the range of the modes.
    bond_per_g: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct ModeLimits {
    angle: f64,
    swirl: f64,
    breaking: f64,
}

impl Limits {
    pub fn new(p: &Parameters, calculated: &Calculated) -> Limits {
        let (slosh, radius) = (&p.slosh, p.tank.d / 2.0);
        let mut mode = [ModeLimits::default(); MODES];
        for (n, (mode, pendulum)) in mode.iter_mut().zip(calculated.pendulums(p)).enumerate() {
            let kappa = 2.0 * pendulum.l * pendulum.l * pendulum.spring;
            let shifts = slosh.model.shifts(pendulum.s, kappa);
            let fill = p.tank.h / radius;
            match slosh.source {
                SloshSource::Geometry if n == 0 => {
                    mode.angle = limits::cylinder(fill, shifts).forced;
                    mode.swirl = limits::swirl(fill, false).unwrap_or(0.0);
                }
                SloshSource::Geometry => {}
                SloshSource::Table => {
                    let table = &slosh.table;
                    let (s, kappa) = (table.nonlinear_inertia[n], table.nonlinear_stiffness[n]);
                    let exact = third_order::shifts(s, kappa);
                    if table.angle_limit[n] > 0.0 {
                        mode.angle =
                            limits::shifted(table.angle_limit[n], limits::FORCED, shifts, exact);
                    }
                    mode.swirl = table.swirl_limit[n];
                }
            }
            let breaking = slosh.breaking(n, pendulum.wave, radius);
            mode.breaking = breaking.onset / breaking.steepness;
        }
        let length = if calculated.length[0] > 0.0 { calculated.length[0] } else { 1.0 };
        let is_flat = calculated.mass[0] > 0.0 && calculated.centring[0] == 0.0;
        Limits {
            mode,
            spin: SpinLimit::new(length, radius),
            bond_per_g: match is_flat && p.fluid.sigma > 0.0 {
                true => p.fluid.rho * radius * radius / p.fluid.sigma,
                false => 0.0,
            },
        }
    }

    /// Returns the most important reason why the modes do not represent the liquid at present, or [`LimitedBy::None`].
    /// `modes` yields the slosh angles, the squared natural frequency, 1/s2, and the pendulum length, m, of each mode;
    /// `omega` is the rate of the hub, rad/s.
    pub fn reason(&self, modes: impl Iterator<Item = (Angles, f64, f64)>, omega: f64) -> LimitedBy {
        let mut reason = LimitedBy::None;
        for (n, (angles, omega2, l)) in modes.enumerate() {
            if n == 0 {
                if self.spin.is_exceeded(omega, omega2) {
                    return LimitedBy::Spin;
                }
                if self.bond_per_g > 0.0 && omega2 * l * self.bond_per_g < LOW_BOND {
                    return LimitedBy::BondNumber;
                }
            }
            // These are displacement and rate divided by the length; an angle of the linear model may exceed 90 degrees.
            let largest = core::f64::consts::FRAC_PI_2;
            let [(x, c_x), (y, c_y)] =
                angles.angle.map(|angle| libm::sincos(angle.clamp(-largest, largest)));
            let [x_d, y_d] = [angles.rate[0] * c_x, angles.rate[1] * c_y];
            let exceeds =
                |limit: f64| limit > 0.0 && libm::hypot(x, y) > libm::sin(limit.min(largest));
            let squares = (x * x + y * y) * omega2 + x_d * x_d + y_d * y_d;
            let area = 2.0 * (x * y_d - y * x_d).abs() * libm::sqrt(omega2.max(0.0));
            let ModeLimits { angle, swirl, breaking } = self.mode[n];
            if exceeds(swirl) && area > ROTARY * squares {
                return LimitedBy::SecondaryResonance;
            }
            if exceeds(breaking) {
                reason = LimitedBy::Breaking;
            } else if reason == LimitedBy::None && (exceeds(angle) || exceeds(LARGEST)) {
                reason = LimitedBy::ThirdOrder;
            }
        }
        reason
    }
}
