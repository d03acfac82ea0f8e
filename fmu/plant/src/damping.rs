//! Slosh damping as a function of the specific force g along the tank's axis.
//!
//! The viscous coefficient of a mode is c = 2 zeta omega_n m with omega_n = sqrt(g/l). A constant damping ratio zeta
//! gives c ~ g^(1/2). A laminar layer at the wall, zeta ~ omega_n^(-1/2) (`formulas::damping`), gives c ~ g^(1/4). A
//! centring stiffness adds a_n to g (`tank.rs`), so
//!
//! ```text
//! c(g) = c_0 [(g + a_n)/(g_0 + a_n)]^p,   p = 1/2 (constant_ratio) or 1/4 (laminar)
//! ```
//!
//! where c_0 is the coefficient at a reference g_0. Without restoring force there is no damping.

use taylor::series::{Series, ZERO};

use crate::inputs::Ramp;
use crate::parameters::{DampingLaw, MODES, Parameters, SloshSource};
use crate::pendulum::Pendulum;
use crate::tank::Calculated;

/// Specific force below which the drag coefficient is replaced by its mean, as a fraction of the largest specific force g on
/// a ramp. The power series of the coefficient converges only as far as g = 0. Since g stays below this value only for a
/// short time, the error, which is of second order in this time, is below rounding.
const NEAR_ZERO: f64 = 1e-6;

/// Largest step as a fraction of the time until g = 0, which is the radius of convergence of the series.
const SHARE_OF_RADIUS: f64 = 0.5;

pub const RAMP_ORDER: usize = 10;

/// The drag coefficient of every mode as a function of the specific force g. It is proportional to `[(g + a_n)/(g_0 +
/// a_n)]^p`, where `reference` is g_0, m/s2, and `exponent` is p. `zeta` contains the damping ratios at g_0, and `centring`
/// the increases a_n of g, m/s2, that are equivalent to the stiffness by surface tension.
#[derive(Clone, Debug)]
pub struct Damping {
    reference: f64,
    exponent: f64,
    zeta: [f64; MODES],
    centring: [f64; MODES],
}

impl Damping {
    /// Creates the damping of all modes. `reference` is the specific force, m/s2, to which the damping ratios in `calculated`
    /// belong, and at which every mode must have a restoring force.
    pub fn new(p: &Parameters, calculated: &Calculated, reference: f64) -> Damping {
        let by_correlation =
            p.slosh.zeta_from_correlation && p.slosh.source == SloshSource::Geometry;
        let is_laminar = match p.slosh.damping_law {
            DampingLaw::Laminar => true,
            DampingLaw::ConstantRatio => false,
            DampingLaw::BySource => by_correlation,
        };
        let exponent = if is_laminar { 0.25 } else { 0.5 };
        let Calculated { damping: zeta, centring, .. } = *calculated;
        Damping { reference, exponent, zeta, centring }
    }

    fn power(&self, g: f64, a: f64) -> f64 {
        let root = libm::sqrt(f64::max(g + a, 0.0) / (self.reference + a));
        if self.exponent == 0.25 { libm::sqrt(root) } else { root }
    }

    /// Returns the damping ratio of mode `n` at the specific force `g`, m/s2. The result is 0 if there is no restoring
    /// force, because the ratio then has no meaning, and also if the force is so small that the formula overflows.
    pub fn ratio(&self, n: usize, g: f64) -> f64 {
        let (zeta, a) = (self.zeta[n], self.centring[n]);
        match self.exponent == 0.25 {
            _ if g + a <= 0.0 => 0.0,
            true if g != self.reference => finite_or_zero(zeta / self.power(g, a)),
            _ => zeta,
        }
    }

    pub fn slope_of_ratio(&self, n: usize, g: f64) -> f64 {
        let x = g + self.centring[n];
        let changes = x > 0.0 && self.exponent == 0.25;
        if changes { finite_or_zero(-self.ratio(n, g) / (4.0 * x)) } else { 0.0 }
    }

    /// Sets the restoring force of mode `n` and the power series of its drag in its `pendulum`, for a specific force `g`
    /// that is linear in time. Surface tension acts like an increase of g; the sum is the restoring specific force. If this
    /// sum is below `floor`, the drag is replaced by its mean until the ramp of g ends or the sum has reached twice `floor`.
    /// Returns the time, s, over which the series are valid.
    pub fn expand(&self, n: usize, g: Ramp, floor: f64, pendulum: &mut Pendulum) -> f64 {
        let a = self.centring[n];
        let x = g.value + a;
        pendulum.set_restoring([x, g.slope]);
        let mut course = ZERO;
        course[0] = 1.0;
        let (factor, reach) = if g.slope == 0.0 || self.zeta[n] <= 0.0 {
            (self.power(g.value, a), f64::INFINITY)
        } else if x > floor {
            self.series(g.slope / x, &mut course);
            (self.power(g.value, a), SHARE_OF_RADIUS * x / g.slope.abs())
        } else if g.slope > 0.0 && floor > 0.0 {
            (self.mean(g.value, 2.0 * floor - a, a), (2.0 * floor - x) / g.slope)
        } else {
            (self.mean(g.value, 0.0, a), f64::INFINITY)
        };
        pendulum.set_damping(factor, course);
        reach
    }

    /// Returns the specific force, m/s2, below which the drag is replaced by its mean while `g` follows its ramp for `h`
    /// seconds.
    pub fn floor(g: Ramp, h: f64) -> f64 {
        if g.slope == 0.0 { 0.0 } else { NEAR_ZERO * f64::max(g.value, g.value_at(h)) }
    }

    /// Writes the binomial series of the drag, divided by its value at the start, into `c`. `relative` is the slope of the
    /// restoring specific force divided by its value at the start, 1/s.
    fn series(&self, relative: f64, c: &mut Series) {
        for n in 0..RAMP_ORDER {
            c[n + 1] = c[n] * relative * (self.exponent - n as f64) / (n + 1) as f64;
        }
    }

    fn mean(&self, from: f64, to: f64, a: f64) -> f64 {
        let integral = |g: f64| f64::max(g + a, 0.0) * self.power(g, a) / (1.0 + self.exponent);
        if from == to { self.power(from, a) } else { (integral(to) - integral(from)) / (to - from) }
    }
}

fn finite_or_zero(x: f64) -> f64 {
    if x.is_finite() { x } else { 0.0 }
}
