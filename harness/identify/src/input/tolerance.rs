//! Tolerances of known values that are not estimated, such as the scale of the torque,
//! as relative standard deviations.

use anyhow::{Context, Result, ensure};
use names::hubslosh::{G_AXIAL, fluid, tank};

use crate::tuning::REPORTED_SHARE;

/// Relative standard deviations of values that the recording does not determine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Relative standard deviation of the ratio of the acting torque to the recorded torque.
    pub torque: f64,
    pub clock: f64,
    pub gravity: f64,
    pub arm: f64,
    pub density: f64,
}

pub const NAMES: [&str; 5] = ["torque", "clock", G_AXIAL, tank::R, fluid::RHO];

impl Default for Tolerances {
    /// Tolerances of a bench with a calibrated wheel, a quartz clock, a rule and a thermometer: 1 % for the
    /// torque, 0.01 % for the clock, 0.1 % for gravity (the latitude is known, and the axis is vertical to
    /// 2.5°), 0.4 % for the arm (1 mm) and 0.3 % for the density (about 10 K).
    fn default() -> Self {
        Tolerances { torque: 0.01, clock: 1e-4, gravity: 1e-3, arm: 4e-3, density: 3e-3 }
    }
}

/// Reads a relative tolerance, `1%` or `0.01`; `None` if the text is not a number.
///
/// # Errors
/// If the tolerance is outside 0 to 50 %.
pub fn part(name: &str, text: &str) -> Result<Option<f64>> {
    let text = text.trim();
    let number = match text.strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().map(|p| p / 100.0),
        None => text.parse(),
    };
    let Ok(number) = number else { return Ok(None) };
    ensure!((0.0..0.5).contains(&number), "{name}: must be from 0 to 50 %, not {text}");
    Ok(Some(number))
}

pub struct Share {
    pub name: String,
    pub share: f64,
    pub most: String,
}

/// Returns a sentence that names the estimates whose uncertainty comes mostly from tolerances. `known`
/// describes the tolerances in words. Returns `None` if there is no such estimate.
pub fn shares(known: &[String], shares: &[Share]) -> Option<String> {
    let large = shares.iter().filter(|share| share.share > REPORTED_SHARE);
    let large: Vec<String> = large
        .map(|s| format!("{} {:.0} % (most by {})", s.name, 100.0 * s.share, s.most))
        .collect();
    (!large.is_empty() && !known.is_empty()).then(|| {
        format!(
            "The intervals include tolerances of quantities that the recording does not show ({}). Their share of the variance: \
             {}. --tolerance sets them.",
            known.join(", "),
            large.join(", ")
        )
    })
}

impl Tolerances {
    pub const NONE: Tolerances =
        Tolerances { torque: 0.0, clock: 0.0, gravity: 0.0, arm: 0.0, density: 0.0 };

    pub fn all(&self) -> [f64; 5] {
        [self.torque, self.clock, self.gravity, self.arm, self.density]
    }

    /// Returns these tolerances, in which the text replaces the named ones, for example
    /// `torque=1%,tank.r=0.002`.
    pub fn with(mut self, text: &str) -> Result<Self> {
        for item in text.split(',') {
            let (name, value) = item
                .split_once('=')
                .with_context(|| format!("{item}: must be NAME=NUMBER or NAME=NUMBER%"))?;
            let number = part(name, value)?.with_context(|| {
                format!("{name}: {value} is not a number (allowed: for example 1% or 0.01)")
            })?;
            let place = NAMES.iter().position(|other| *other == name.trim());
            let place = place.with_context(|| {
                format!("{} has no tolerance (allowed: {})", name.trim(), NAMES.join(", "))
            })?;
            let Tolerances { torque, clock, gravity, arm, density } = &mut self;
            *[torque, clock, gravity, arm, density][place] = number;
        }
        Ok(self)
    }
}
