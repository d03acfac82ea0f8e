//! Ring baffle: a flat ring at the wall below the surface, whose damping grows with the wave.
//!
//! Miles (1958) gives the damping ratio of the first mode of an upright cylinder, for a ring of the width w at the depth d
//! below the surface, which covers alpha = (w/R)(2 - w/R) of the cross-section, and a wave of the amplitude eta at the wall:
//!
//! ```text
//! zeta = 2.83 exp(-4.60 d/R) alpha^(3/2) (eta/R)^(1/2)
//! ```
//!
//! The damping comes from the separated flow at the ring. The drag is 2 zeta omega m times the slosh mass's velocity. The
//! amplitude is computed from the present q and q': eta = (wave per angle) A, A^2 = |q|^2 + |q'|^2/omega^2. The drag
//! therefore always dissipates, and in a free oscillation a' = -zeta(a) omega a. With W = omega^2 the drag is
//!
//! ```text
//! c_b = 2 m Z u^(1/4),   u = W [W (|q|^2 + A_0^2) + |q'|^2],   zeta = Z A^(1/2)
//! ```
//!
//! A_0 is far below the amplitudes of the law. It keeps u away from 0, where the root has no power series.
//!
//! The formula follows Keulegan and Carpenter's law for plates in oscillating flow. It holds if the liquid's stroke at the
//! ring is 0.64 to 6.4 ring widths, the ring stays covered (d >= eta) and alpha < 0.25. For smaller waves the damping is
//! higher than the formula.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use formulas::damping::{covered, miles_ring, motion_at_ring};
use taylor::number::Number;
use taylor::series::{Series, ZERO, mul_ramp, time_within, values};

use crate::parameters::{Parameters, Ring, SloshSource};

/// Range of the liquid's stroke at the ring, divided by the width of the ring, in which the law of Keulegan and Carpenter
/// holds.
const STROKE: core::ops::RangeInclusive<f64> = 0.64..=6.4;

/// Amplitude A_0 whose square is added to the squared amplitude of the wave, so that the drag has a power series also at
/// rest. The value is a fraction of the smallest amplitude for which the baffle's law holds. At this smallest amplitude, A_0
/// increases the damping by 2e-4 of its value.
const FLOOR: f64 = 0.03;

/// Specific force, m/s2, that is added to g in the squared natural frequency W = g/l of a pendulum, because the power series
/// of the drag do not converge at W = 0, that is, in weightlessness.
const WEIGHTLESS: f64 = 1e-6;

/// A ring baffle and its drag on one mode, as power series in time. The equations are at the head of the file.
/// - `zeta`: damping ratio Z at a slosh angle of 1 rad; 0 without a baffle.
/// - `floor2`: square of the slosh angle A_0, rad2, which is added to the squared amplitude (see `FLOOR`).
/// - `w`: squared natural frequency W, 1/s2, and its rate; `w_floor`, 1/s2, is added to it.
/// - `viscous`: viscous drag divided by its value at the start of the series.
/// - `share`, `gain`: the coefficients of the viscous drag and of the baffle's drag, each divided by the whole drag at the
///   start of the series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Baffle {
    pub zeta: f64,
    floor2: f64,
    w_floor: f64,
    w: [f64; 2],
    q2: Series,
    v2: Series,
    sum: Series,
    u: Series,
    root: Series,
    viscous: Series,
    share: f64,
    gain: f64,
}

impl Default for Baffle {
    fn default() -> Self {
        Baffle {
            zeta: 0.0,
            floor2: 0.0,
            w_floor: 0.0,
            w: [0.0; 2],
            q2: ZERO,
            v2: ZERO,
            sum: ZERO,
            u: ZERO,
            root: ZERO,
            viscous: ZERO,
            share: 0.0,
            gain: 0.0,
        }
    }
}

pub(crate) fn problems(p: &Parameters) -> Vec<String> {
    let (width, depth) = (p.baffle.width, p.baffle.depth);
    let mut problems = Vec::new();
    if width > 0.0 {
        if width >= p.tank.d / 2.0 {
            problems.push(format!(
                "baffle.width = {width} m (allowed: less than the radius tank.d/2 = {} m)",
                p.tank.d / 2.0
            ));
        }
        if p.slosh.source == SloshSource::Geometry && depth >= p.tank.h {
            problems.push(format!(
                "baffle.depth = {depth} m (allowed: less than tank.h = {} m, because the depth is measured from the \
                 surface)",
                p.tank.h
            ));
        }
    }
    problems
}

/// Returns a warning for each reason why Miles's formula does not hold for the ring baffle: the ring is too wide, or a table
/// of modes describes the tank.
pub(crate) fn warnings(p: &Parameters) -> Vec<String> {
    let mut warnings = Vec::new();
    if p.baffle.width <= 0.0 {
        return warnings;
    }
    let alpha = covered(p.tank.d / 2.0, p.baffle.width);
    if alpha >= 0.25 {
        warnings.push(format!(
            "baffle.width: the ring covers {alpha:.3} of the cross-section, but Miles's formula holds only below \
             0.25"
        ));
    }
    if p.slosh.source == SloshSource::Table {
        warnings.push(
            "baffle: Miles's formula holds for an upright cylinder. The model computes the damping as in an upright cylinder of the diameter tank.d"
                .to_string(),
        );
    }
    warnings
}

/// Range of validity of the baffle's law. `stroke` is the stroke of the liquid at the ring per wave amplitude, divided by the
/// width of the ring, 1/m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Range {
    stroke: f64,
    depth: f64,
    covers_little: bool,
}

impl Range {
    pub fn new(p: &Parameters) -> Option<Range> {
        let Ring { width, depth } = p.baffle;
        let radius = p.tank.d / 2.0;
        let range = || Range {
            stroke: motion_at_ring(radius, depth) / width,
            depth,
            covers_little: covered(radius, width) < 0.25,
        };
        (width > 0.0).then(range)
    }

    pub fn contains(&self, amplitude: f64) -> bool {
        STROKE.contains(&(amplitude * self.stroke))
            // d = eta is inside the range, whatever the rounding errors.
            && amplitude <= self.depth * (1.0 + 1e-9)
            && self.covers_little
    }
}

impl Baffle {
    /// Creates the baffle with its effect on the first mode. `wave` is the elevation of the wave at the wall per slosh angle,
    /// m/rad, and `l` the length of the pendulum, m.
    pub fn new(p: &Parameters, wave: f64, l: f64) -> Baffle {
        let (radius, Ring { width, depth }) = (p.tank.d / 2.0, p.baffle);
        let zeta = miles_ring(radius, depth, width, wave);
        let floor = FLOOR * STROKE.start() * width / (motion_at_ring(radius, depth) * wave);
        Baffle { zeta, floor2: floor * floor, w_floor: WEIGHTLESS / l, ..Baffle::default() }
    }

    /// Returns the amplitude of the slosh angle, rad, and the damping ratio that the baffle adds at this amplitude. `w` is
    /// the squared natural frequency W, 1/s2; `q2` and `v2` are the squares of the slosh angle, rad2, and of its rate,
    /// rad2/s2.
    pub fn present<T: Number>(&self, w: T, [q2, v2]: [T; 2]) -> (T, T) {
        let w = w + T::constant(self.w_floor);
        let amplitude = (q2 + v2 / w).sqrt();
        (amplitude, amplitude.sqrt() * self.zeta)
    }

    /// Starts the power series of the drag, and returns the sum of the drag coefficients by baffle and viscosity at the
    /// start of the series. `w` is the squared natural frequency W and its rate. `at` contains the squares of the slosh
    /// angle and of its rate. `m` is the slosh mass, kg, and `c` the viscous drag coefficient, which changes in time as the
    /// series `viscous`.
    pub fn start(&mut self, w: [f64; 2], at: [f64; 2], m: f64, c: f64, viscous: Series) -> f64 {
        self.w = [w[0] + self.w_floor, w[1]];
        self.viscous = viscous;
        (self.share, self.gain) = (1.0, 0.0);
        self.expand(0, at);
        let both = c + 2.0 * m * self.zeta * self.root[0];
        (self.share, self.gain) = (c / both, 2.0 * m * self.zeta / both);
        both
    }

    /// Computes Taylor coefficient n of the baffle's drag, which is divided by the whole drag at the start of the series,
    /// from coefficient n of the squared slosh angle `q2` and of its squared rate `v2`.
    pub fn expand(&mut self, n: usize, [q2, v2]: [f64; 2]) -> f64 {
        self.q2[n] = q2 + if n == 0 { self.floor2 } else { 0.0 };
        self.v2[n] = v2;
        self.sum[n] = mul_ramp(n, &self.w, &self.q2) + v2;
        self.u[n] = mul_ramp(n, &self.w, &self.sum);
        // The series follows from u y' = u' y/4.
        self.root[n] = if n == 0 {
            libm::sqrt(libm::sqrt(self.u[0]))
        } else {
            let term = |j: usize| (j as f64 / 4.0 - (n - j) as f64) * self.u[j] * self.root[n - j];
            (1..=n).map(term).sum::<f64>() / (n as f64 * self.u[0])
        };
        self.share * self.viscous[n] + self.gain * self.root[n]
    }

    /// Returns the time, s, over which the series of the baffle's drag converge, from their first three coefficients. The
    /// drag is singular where the squared natural frequency W is 0, and where W (|q|^2 + A_0^2) + |q'|^2 is 0, with the
    /// slosh angle q and the small constant A_0 (`FLOOR`).
    pub fn convergence_radius(&self) -> f64 {
        let sum = time_within(self.sum[0], self.sum[1].abs(), self.sum[2].abs());
        sum.min(time_within(self.w[0], self.w[1].abs(), 0.0))
    }

    /// Returns the drag `h` seconds after the start of the series, divided by its value at the start, and the sum W (|q|^2 +
    /// A_0^2) + |q'|^2, where W is the squared natural frequency, q the slosh angle, and A_0 a small constant (`FLOOR`).
    /// Both results are computed from the series of this sum and of the viscous drag up to order n. The difference between
    /// the returned drag and the series of the drag is therefore the error of the series.
    pub fn drag_at(&self, n: usize, h: f64) -> [f64; 2] {
        let [sum, viscous] = values([&self.sum, &self.viscous], n, h);
        let (sum, w) = (sum.max(0.0), f64::max(self.w[0] + self.w[1] * h, 0.0));
        let root = libm::sqrt(libm::sqrt(w * sum));
        [self.share * viscous + self.gain * root, sum]
    }
}
