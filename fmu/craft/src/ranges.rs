//! Ranges in which the pendulums represent the liquid.
//!
//! Linear theory holds while the wave at the wall is low compared with the radius R of the free surface. Below 0.15 R
//! it holds, from 0.15 R to 0.25 R it loses validity, above 0.25 R forces are only indications (Rubaga's thesis 2.3.5,
//! after Dodge). R is that of an upright cylinder with the tank's wave per slosh angle, R = wave (xi^2 - 1)/2, which is
//! exact for a cylinder.
//!
//! Thrust or capillarity holds the liquid at the bottom of its tank: w^2 = x/l + k/m > 0, with x the specific force
//! along the tank at the hinge. Otherwise a bob would swing over while real liquid would fall. Beyond 45 degrees from
//! the tank's axis the bob represents no surface. Detached liquid (`lump.rs`) is outside the range of the pendulums.

use formulas::cylinder::XI;
use formulas::regime::Regime;

use crate::lump::COS_45;
use crate::outputs::TankOutputs;
use crate::parameters::Tank;
use crate::sizes::MODES;
use crate::state::{BallState, Ranges};

/// Bounds of a tank's ranges. For a draining tank they belong to its initial contents.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    modes: usize,
    /// R, m; 0 if no wave is given.
    radius: f64,
    /// Lower bound of x, per mode. Below it the liquid leaves the bottom.
    lowest: [f64; MODES],
}

impl Bounds {
    /// Creates the bounds of a tank whose derived parameters are resolved.
    pub fn new(tank: &Tank) -> Bounds {
        Bounds {
            modes: tank.modes,
            radius: tank.wave[0] * (XI[0] * XI[0] - 1.0) / 2.0,
            lowest: core::array::from_fn(|n| if n < tank.modes { tank.lowest(n) } else { 0.0 }),
        }
    }

    /// Returns the ranges for a tank's outputs.
    pub fn of(&self, out: &TankOutputs) -> Ranges {
        if out.ball_state != BallState::Settled {
            return Ranges { regime: Regime::Nonlinear, in_range: false };
        }
        let heights = out.p.map(|p| p[2]);
        let in_range = self.contain(heights, out.axial);
        let upright = self.are_upright(heights);
        // Without a wave per angle, use that of a cylinder: 2 R/(xi^2 - 1).
        let height = match self.radius > 0.0 {
            true => out.wave_height / self.radius,
            false => 2.0 * libm::hypot(out.angle_x[0], out.angle_y[0]) / (XI[0] * XI[0] - 1.0),
        };
        let regime = if upright { Regime::of(height) } else { Regime::Nonlinear };
        Ranges { regime, in_range }
    }

    /// Returns true if the tank is in its range, from the bobs' p_z and the specific force along
    /// its axis.
    pub fn contain(&self, heights: [f64; MODES], axial: f64) -> bool {
        let held = self.lowest[..self.modes].iter().all(|lowest| axial >= *lowest);
        held && self.are_upright(heights)
    }

    fn are_upright(&self, heights: [f64; MODES]) -> bool {
        heights[..self.modes].iter().all(|height| *height < -COS_45)
    }
}
