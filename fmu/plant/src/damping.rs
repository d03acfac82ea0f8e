//! Slosh damping that follows the specific force g along the tank's axis.
//!
//! The viscous coefficient of a mode is c = 2 zeta omega_n m with omega_n = sqrt(g/l). A given
//! damping ratio zeta makes c ~ g^(1/2); the correlation, zeta ~ g^(-1/4), makes c ~ g^(1/4).
//! So all modes share one factor,
//!
//! ```text
//! c(g) = c_0 (g/g_0)^p,   p = 1/2 or 1/4
//! ```
//!
//! with c_0 at a reference g_0 > 0; without specific force there is no damping.

use crate::series::{ORDER, Series, ZERO};
use crate::slosh::HubMotion;
use crate::tank::Calculated;
use crate::{MODES, Parameters, Ramp};

/// Below this share of the largest g on a ramp the factor is replaced by its mean: there its
/// power series reach no further than g = 0. The time is so short that what the mean leaves
/// out, of second order in it, is below rounding.
const NEAR_ZERO: f64 = 1e-6;

/// Share of the series' radius of convergence, the time to g = 0, that one step takes.
const SHARE_OF_RADIUS: f64 = 0.5;

/// c/c_0 as a function of g.
#[derive(Clone, Debug)]
pub struct Damping {
    /// g_0, m/s2
    reference: f64,
    /// p
    exponent: f64,
    /// Damping ratios at g_0.
    zeta: [f64; MODES],
    /// The tangent that stands for the power, if one does.
    tangent: Option<Tangent>,
}

/// c/c_0 close to g.
#[derive(Clone, Copy, Debug)]
struct Tangent {
    g: f64,
    value: f64,
    slope: f64,
}

impl Damping {
    /// `calculated` belongs to the specific force `reference` > 0.
    pub fn new(p: &Parameters, calculated: &Calculated, reference: f64) -> Damping {
        let exponent = if p.slosh.zeta_from_correlation { 0.25 } else { 0.5 };
        Damping { reference, exponent, zeta: calculated.damping, tangent: None }
    }

    /// c/c_0
    fn factor(&self, g: f64) -> f64 {
        if let Some(tangent) = self.tangent {
            return tangent.value + tangent.slope * (g - tangent.g);
        }
        let root = libm::sqrt(f64::max(g, 0.0) / self.reference);
        if self.exponent == 0.25 { libm::sqrt(root) } else { root }
    }

    /// The derivative of c/c_0 by g, s2/m; 0 at g = 0, where there is none.
    fn slope(&self, g: f64) -> f64 {
        if g > 0.0 { self.exponent * self.factor(g) / g } else { 0.0 }
    }

    /// The same close to g, but linear.
    pub fn tangent(&self, g: f64) -> Damping {
        let tangent = Tangent { g, value: self.factor(g), slope: self.slope(g) };
        Damping { tangent: Some(tangent), ..self.clone() }
    }

    /// The damping ratios at g; 0 at g = 0 and where they overflow next to it: there they have
    /// no meaning.
    pub fn ratios(&self, g: f64) -> [f64; MODES] {
        match (g > 0.0, self.exponent == 0.25) {
            (false, _) => [0.0; MODES],
            (_, false) => self.zeta,
            (_, true) if g == self.reference => self.zeta,
            (_, true) => {
                let factor = self.factor(g);
                self.zeta.map(|zeta| finite_or_zero(zeta / factor))
            }
        }
    }

    /// The derivatives of the damping ratios by g, s2/m.
    pub fn slopes_of_ratios(&self, g: f64) -> [f64; MODES] {
        if g > 0.0 && self.exponent == 0.25 {
            self.ratios(g).map(|zeta| finite_or_zero(-zeta / (4.0 * g)))
        } else {
            [0.0; MODES]
        }
    }

    /// Puts g and the course of the damping from here on into the hub's motion; returns the
    /// factor now. Where g is below `floor` the factor is its mean until g has reached 0 or
    /// twice `floor`.
    pub fn expand(&self, g: Ramp, floor: f64, hub: &mut HubMotion) -> f64 {
        hub.g = [g.value, g.slope];
        hub.damping = ZERO;
        hub.damping[0] = 1.0;
        hub.damping_reach = f64::INFINITY;
        if !self.varies(g) {
            self.factor(g.value)
        } else if g.value > floor {
            hub.damping_reach = SHARE_OF_RADIUS * g.value / g.slope.abs();
            hub.damping = self.series(g);
            self.factor(g.value)
        } else if g.slope > 0.0 && floor > 0.0 {
            hub.damping_reach = (2.0 * floor - g.value) / g.slope;
            self.mean(g.value, 2.0 * floor)
        } else {
            self.mean(g.value, 0.0)
        }
    }

    /// Whether there is damping and it changes along `g`.
    pub fn varies(&self, g: Ramp) -> bool {
        g.slope != 0.0 && self.zeta[0] > 0.0
    }

    /// The specific force below which a ramp's factor is held.
    pub fn floor(g: Ramp, h: f64) -> f64 {
        if g.slope == 0.0 { 0.0 } else { NEAR_ZERO * f64::max(g.value, g.at(h)) }
    }

    /// Binomial series of the factor over its first value, along a ramp that starts above 0.
    fn series(&self, g: Ramp) -> Series {
        let mut c = ZERO;
        let relative = g.slope / g.value;
        c[0] = 1.0;
        for n in 0..ORDER {
            c[n + 1] = c[n] * relative * (self.exponent - n as f64) / (n + 1) as f64;
        }
        c
    }

    /// Mean of the factor over g from a to b.
    fn mean(&self, a: f64, b: f64) -> f64 {
        let integral = |g: f64| f64::max(g, 0.0) * self.factor(g) / (1.0 + self.exponent);
        if a == b { self.factor(a) } else { (integral(b) - integral(a)) / (b - a) }
    }
}

fn finite_or_zero(x: f64) -> f64 {
    if x.is_finite() { x } else { 0.0 }
}
