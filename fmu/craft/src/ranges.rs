//! Ranges of validity, in which the pendulums represent the liquid.
//!
//! The linear theory is valid while the wave at the wall is low compared with the radius R of the free surface. Up to 0.15 R
//! it is valid, from 0.15 R to 0.25 R it loses validity, and above 0.25 R its forces are only indications (Rubaga's thesis,
//! section 2.3.5, after Dodge). Since the tank's own radius is not a parameter, R is the radius of the upright cylinder that
//! has the same wave height per slosh angle as the tank, R = wave (xi^2 - 1)/2. For an upright cylinder this R is exact.
//!
//! A tank may be out of range for these reasons. If there are several, the first one in this order is reported:
//!
//! ```text
//! contact              x/l + k/m <= 0, or the liquid is detached (`lump.rs`)
//! empty                the liquid of the first point of the fill table, below which a tank cannot drain
//! spin                 Omega^2 R/(l w^2) > 0.3, or 2 Omega/w > (1 + C_0)^(-1/2)   (`formulas::limits::SpinLimit`)
//! bond_number          x below g_bond
//! secondary_resonance  A above swirl_limit in rotary motion
//! breaking             steepness 2 xi A/(xi^2 - 1) above breaking_steepness, if that is above 0
//! third_order          A above angle_limit, or above 45 degrees
//! ```
//!
//! x is the specific force along the tank at the hinge, w^2 = max(x, g_floor)/l + k/m is the squared natural frequency of
//! mode 1, and sin A = |p_perp|. Omega is the rate of the liquid's spin (`spin.rs`) or, for liquid without spin, the
//! rotation rate of the tank about its axis. If x/l + k/m is below 0, a slosh mass would swing over while real liquid would
//! fall. Beyond 45 degrees from the tank's axis a slosh mass does not represent a liquid surface.
//!
//! Motion counts as rotary if the ellipse of the bob's path has semi-axes in a ratio above 1/2: 2 |q x q'| w > 0.8 (w^2
//! q^2 + q'^2). This condition does not depend on the phase of the motion.

use crate::lump::COS_45;
use crate::outputs::TankOutputs;
use crate::parameters::Tank;
use crate::sizes::{MODES, POINTS};
use crate::spin::SpinScale;
use crate::state::{BallState, Ranges};
use formulas::cylinder::XI;
use formulas::limits::{
    FORCED, LimitedBy, SpinLimit, cylinder, cylinder_with_energy, shifted, swirl,
};
use formulas::regime::Regime;
use formulas::third_order;

/// Swirl number (2 b/a)/(1 + (b/a)^2) of an ellipse with the semi-axes a and b = a/2. Motion with a larger swirl
/// number counts as rotary.
const ROTARY: f64 = 0.8;

/// Mass of liquid at which a tank counts as empty, divided by the mass at the first point of its fill table. It exceeds 1 because
/// an external integrator (Model Exchange) reaches the mass only up to its errors.
const EMPTY: f64 = 1.0 + 1e-9;

/// Limits within which the pendulums of a tank represent its liquid. If the tank drains, they hold
/// for its initial fill, except for `over_fill`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    modes: usize,
    radius: f64,          // R, m; 0 if the tank has no `wave`
    lowest: [f64; MODES], // x of each mode below which the liquid leaves the bottom
    mode: [ModeBounds; MODES],
    over_fill: Option<OverFill>, // limits at every fill
    g_floor: f64,                // smallest x in w^2, m/s2
    g_bond: f64,
    spin: SpinLimit,
}

/// Sines of the limits of the slosh angle of a mode: for any motion (`angle`), for rotary motion (`swirl`), and of the angle
/// at which waves begin to break. A limit that is not known is 0. `inv_l` is 1/l, 1/m, and `k_m` is k/m, 1/s2.
#[derive(Clone, Copy, Debug)]
struct ModeBounds {
    angle: f64,
    swirl: f64,
    breaking: f64,
    inv_l: f64,
    k_m: f64,
}

#[derive(Clone, Copy, Debug)]
struct OverFill {
    points: usize,
    liquid: [f64; POINTS],
    angle: [[f64; POINTS]; MODES],
    swirl: [[f64; POINTS]; MODES],
}

impl OverFill {
    /// Returns the limits of the slosh angle of mode `n`, rad, for any and for rotary motion, interpolated linearly over the
    /// mass of liquid. Between a point of the fill table with a known limit and a point with an unknown limit the result is
    /// 0, which means unknown.
    fn limits_at(&self, n: usize, liquid: f64) -> [f64; 2] {
        let masses = &self.liquid[..self.points];
        let last = self.points - 2;
        let i = (0..last).find(|&i| liquid < masses[i + 1]).unwrap_or(last);
        let share = ((liquid - masses[i]) / (masses[i + 1] - masses[i])).clamp(0.0, 1.0);
        [&self.angle[n], &self.swirl[n]].map(|y| match [y[i], y[i + 1]] {
            [a, b] if a > 0.0 && b > 0.0 => a + (b - a) * share,
            [a, _] if share == 0.0 => a,
            [_, b] if share == 1.0 => b,
            _ => 0.0,
        })
    }
}

impl Bounds {
    pub fn new(tank: &Tank) -> Bounds {
        let radius = tank.wave[0] * (XI[0] * XI[0] - 1.0) / 2.0;
        let of_mode = |n: usize| {
            if n >= tank.modes {
                return ModeBounds { angle: 0.0, swirl: 0.0, breaking: 0.0, inv_l: 1.0, k_m: 0.0 };
            }
            let [angle, swirl] = tank.limits(n);
            ModeBounds {
                angle: sine(angle),
                swirl: sine(swirl),
                breaking: sine(tank.breaking_steepness[n] * (XI[n] * XI[n] - 1.0) / (2.0 * XI[n])),
                inv_l: 1.0 / tank.length[n],
                k_m: tank.k[n] / tank.mass[n],
            }
        };
        let fill = &tank.fill;
        Bounds {
            modes: tank.modes,
            radius,
            lowest: core::array::from_fn(|n| if n < tank.modes { tank.lowest(n) } else { 0.0 }),
            mode: core::array::from_fn(of_mode),
            over_fill: (fill.points > 1).then_some(OverFill {
                points: fill.points,
                liquid: fill.liquid,
                angle: fill.angle_limit,
                swirl: fill.swirl_limit,
            }),
            g_floor: tank.smallest_acceleration(),
            g_bond: tank.g_bond,
            spin: SpinLimit::new(if tank.modes > 0 { tank.length[0] } else { 1.0 }, radius),
        }
    }

    /// Returns the ranges of validity of a tank, from the tank's outputs and its mass of liquid, kg.
    pub fn classify(&self, out: &TankOutputs, liquid: f64) -> Ranges {
        if out.ball_state != BallState::Settled {
            let limited_by = LimitedBy::Contact;
            return Ranges { regime: Regime::Nonlinear, limited_by, is_physical: false };
        }
        let upright = self.are_upright(out.p.map(|p| p[2]));
        // If the tank has no wave height per angle, the wave height of a cylinder is used: 2 R/(xi^2 - 1).
        let height = match self.radius > 0.0 {
            true => out.wave_height / self.radius,
            false => 2.0 * libm::hypot(out.angle_x[0], out.angle_y[0]) / (XI[0] * XI[0] - 1.0),
        };
        let regime = if upright { Regime::from_ratio(height) } else { Regime::Nonlinear };
        let limited_by = self.reason(out, liquid);
        Ranges { regime, limited_by, is_physical: upright && self.is_held(out.axial) }
    }

    /// Returns the ranges that [`Bounds::classify`] gives for every specific force along the tank in the interval `axial`,
    /// m/s2, and for slosh angles that differ by rounding from those in `out`. Returns `None` if the ranges are not the same
    /// for all of them.
    pub fn classify_within(
        &self,
        mut out: TankOutputs,
        axial: [f64; 2],
        liquid: f64,
    ) -> Option<Ranges> {
        /// Largest relative difference of angles that arises by rounding.
        const ROUNDING: f64 = 1e-12;
        // The wave may be rotary at inner points of the interval although it is not rotary at both ends, or vice versa.
        if (0..self.modes).any(|n| exceeds(&out, n, self.angle_limits(n, liquid)[1])) {
            return None;
        }
        let [low, high] =
            [(axial[0], 1.0 - ROUNDING), (axial[1], 1.0 + ROUNDING)].map(|(axial, scale)| {
                out.axial = axial;
                out.wave_height *= scale;
                (out.angle_x[0], out.angle_y[0]) = (out.angle_x[0] * scale, out.angle_y[0] * scale);
                self.classify(&out, liquid)
            });
        (low == high).then_some(low)
    }

    /// Returns the sines of the slosh angles above which mode `n` and its rotary motion are out of range; 0 if they are not known.
    fn angle_limits(&self, n: usize, liquid: f64) -> [f64; 2] {
        let ModeBounds { angle, swirl, .. } = self.mode[n];
        let Some(table) = &self.over_fill else { return [angle, swirl] };
        let [a, s] = table.limits_at(n, liquid);
        [if a > 0.0 { sine(a) } else { angle }, if s > 0.0 { sine(s) } else { swirl }]
    }

    fn reason(&self, out: &TankOutputs, liquid: f64) -> LimitedBy {
        if !self.is_held(out.axial) {
            return LimitedBy::Contact;
        }
        if self.over_fill.as_ref().is_some_and(|table| liquid <= table.liquid[0] * EMPTY) {
            return LimitedBy::Empty;
        }
        if self.modes == 0 {
            return LimitedBy::None;
        }
        let x = out.axial.max(self.g_floor);
        let omega2 = |n: usize| x * self.mode[n].inv_l + self.mode[n].k_m;
        if self.spin.is_exceeded(out.turning, omega2(0)) {
            return LimitedBy::Spin;
        }
        if self.g_bond > 0.0 && out.axial < self.g_bond {
            return LimitedBy::BondNumber;
        }
        let mut reason = LimitedBy::None;
        for n in 0..self.modes {
            let mode = &self.mode[n];
            let [angle, swirl] = self.angle_limits(n, liquid);
            let ([x, y, _], [x_d, y_d, _]) = (out.p[n], out.p_dot[n]);
            let omega2 = omega2(n);
            let squares = (x * x + y * y) * omega2 + x_d * x_d + y_d * y_d;
            let area = 2.0 * (x * y_d - y * x_d).abs() * libm::sqrt(omega2);
            if exceeds(out, n, swirl) && area > ROTARY * squares {
                return LimitedBy::SecondaryResonance;
            }
            if exceeds(out, n, mode.breaking) {
                reason = LimitedBy::Breaking;
            } else if reason == LimitedBy::None && exceeds(out, n, angle) {
                reason = LimitedBy::ThirdOrder;
            }
        }
        let upright = self.are_upright(out.p.map(|p| p[2]));
        if reason == LimitedBy::None && !upright { LimitedBy::ThirdOrder } else { reason }
    }

    /// Returns the quantities of mode 1 from which the outputs `spin_ratio` and `spin_number` are computed; `None` for
    /// a tank without modes.
    pub fn spin_scale(&self) -> Option<SpinScale> {
        let ModeBounds { inv_l, k_m, .. } = self.mode[0];
        let scale = SpinScale { inv_l, k_m, g_floor: self.g_floor, limit: self.spin };
        (self.modes > 0).then_some(scale)
    }

    /// Returns true if pendulums can represent the liquid: thrust holds it at the bottom, and the bobs are within 45
    /// degrees of the axis. `heights` are the components p_z of the bobs' directions, and `axial` is the specific force
    /// along the axis, m/s2.
    pub fn contain(&self, heights: [f64; MODES], axial: f64) -> bool {
        self.is_held(axial) && self.are_upright(heights)
    }

    fn is_held(&self, axial: f64) -> bool {
        self.lowest[..self.modes].iter().all(|lowest| axial >= *lowest)
    }

    /// Returns the event indicator of a tank without a model of detached liquid, m/s2. It is negative if the specific force
    /// `axial` along the tank does not hold the liquid of every mode at the bottom, otherwise positive, and never 0.
    pub fn held_indicator(&self, axial: f64) -> f64 {
        /// Smallest value of the event indicator while thrust holds the liquid at the bottom.
        /// Without thrust the margin to the limit is 0, but the indicator of an FMU must not be 0
        /// between events.
        const HELD: f64 = 1e-9;
        let margins = self.lowest[..self.modes].iter().map(|lowest| axial - lowest);
        let margin = margins.fold(1.0 / HELD, f64::min);
        if margin >= 0.0 { margin.max(HELD) } else { margin }
    }

    fn are_upright(&self, heights: [f64; MODES]) -> bool {
        heights[..self.modes].iter().all(|height| *height < -COS_45)
    }
}

/// Returns the sine of a slosh angle, rad, of at most 90 degrees.
fn sine(angle: f64) -> f64 {
    libm::sin(angle.min(core::f64::consts::FRAC_PI_2))
}

/// Returns true if the slosh angle of mode `n` is larger than a known limit, whose sine is `limit`.
fn exceeds(out: &TankOutputs, n: usize, limit: f64) -> bool {
    let [x, y, _] = out.p[n];
    limit > 0.0 && libm::hypot(x, y) > limit
}

impl Tank {
    /// Returns the slosh angles, rad, at which mode `n`, which counts from 0, leaves its range in any motion and in rotary
    /// motion; 0 if they are not known. The limits of mode 1 of a cylinder of known dimensions follow from potential flow.
    fn limits(&self, n: usize) -> [f64; 2] {
        let given = [self.angle_limit[n], self.swirl_limit[n]];
        if n > 0 || self.diameter <= 0.0 {
            return given;
        }
        let own = self.limits_of_cylinder(n);
        [0, 1].map(|i| if given[i] > 0.0 { given[i] } else { own[i] })
    }

    /// Returns the limits of the slosh angle of mode `n`, rad, of an upright cylinder from the
    /// cylinder's dimensions. The function is not inlined, because the compiler would then divide
    /// by the diameter before comparing it with 0. A division by 0 sets a floating-point flag that
    /// some importing tools trap.
    #[inline(never)]
    fn limits_of_cylinder(&self, n: usize) -> [f64; 2] {
        let fill = 2.0 * self.depth / self.diameter;
        let [s, kappa] = [self.nonlinear_inertia[n], self.nonlinear_stiffness[n]];
        let [planar, circular] = third_order::shifts(s, kappa);
        let shifts = [planar, circular - 2.0 * self.rotary_inertia[n]].map(Some);
        let has_energy = self.higher(n).is_beyond_third_order();
        let own = match cylinder_with_energy(fill).filter(|_| has_energy) {
            Some(limit) => {
                let (s, kappa) = third_order::coefficients(fill);
                shifted(limit.forced, FORCED, shifts, third_order::shifts(s, kappa))
            }
            None => cylinder(fill, shifts).forced,
        };
        [own, swirl(fill, has_energy).unwrap_or(0.0)]
    }
}
