//! Slosh modes of an upright cylinder on a tilted bench. The tilted free surface changes the frequencies of the liquid
//! (`formulas::tilt`). The pendulums hang obliquely, which changes their frequencies, too.
//!
//! If the hub turns through small angles, the liquid's force on the hub has the frequency below. s is the tangent of the
//! tilt angle. n = sin(beta) is the tangential component of the direction of gravity across the axis at the hub's start
//! angle (e = g s (cos beta, sin beta), `hub.rs`):
//!
//! ```text
//! omega^2 = f g/l,   f = f_along n^2 + f_across (1 - n^2)
//! ```
//!
//! where l is the pendulum length in the upright tank, and m f is the sloshing mass. m/omega^2 of a mode is its share of the
//! surface's static moment, which is rho pi R^4/4 for all modes together and does not depend on the tilt. A pendulum of mass
//! m' and length l' that swings about an equilibrium at the displacement u l' from the hinge has
//!
//! ```text
//! omega^2 = (g/l') F,   sloshing mass m' M
//! linear              F = M = 1
//! planar              F = (1 + s^2 n^2)^(1/2),   M = 1/(1 + s^2 n^2)
//! spherical           F = (1 + s^2)^(1/2),       M = 1 - n^2 s^2/(1 + s^2)
//! liquid              u (1 + H u^2) = s,         M = 1 - n^2 + n^2/(1 + sigma u^2)
//!                     F = M/[(1 - n^2)/(1 + H u^2) + n^2/(1 + 3 H u^2)]
//! ```
//!
//! H l'^-2 is the coefficient of the quartic spring, sigma is the coefficient of the vertical inertia (`third_order.rs`). M is e.(M^-1
//! e), and F is its ratio to e.(K^-1 e), for the two equations of small motions, with e the tangent. Hence l' = l F/f
//! and m' = m f/M.
//!
//! f belongs to the tangential direction of motion. For the radial direction n^2 and 1 - n^2 are exchanged: in F for models with
//! one pendulum for both directions, and in f for the liquid. A spherical pendulum has the same frequency in both directions. In
//! the model `liquid` the two frequencies differ of themselves, similarly to the real liquid: in deep liquid the coefficient c of
//! omega^2 = (1 + c s^2) g/l is -0.36 along the slope and 0.37 across it, for the real liquid -0.42 and 0.23.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use formulas::cylinder;
use formulas::tilt::{factors, largest_slope};

use crate::parameters::{Parameters, SloshSource};
use crate::slosh_model::{Oblique, SloshModel};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Leaning {
    slope: f64,
    tangential: f64,
}

/// A slosh mode on a tilted bench. `mass` and `length` belong to the pendulum that the plant uses, which hangs obliquely;
/// `upright` is the length of an upright pendulum with this oblique pendulum's frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mode {
    pub mass: f64,
    pub length: f64,
    pub upright: f64,
}

impl Leaning {
    /// Returns the tilt of the bench in the hub's frame at the start of the motion; `None` for an upright bench, or if a
    /// table gives the modes.
    pub fn from_parameters(p: &Parameters) -> Option<Leaning> {
        let leans = p.bench.tilt != 0.0 && p.slosh.source == SloshSource::Geometry;
        leans.then(|| {
            let n = libm::sin(p.bench.tilt_azimuth - p.init.theta);
            Leaning { slope: libm::tan(p.bench.tilt), tangential: n * n }
        })
    }

    /// Returns the factors by which the tilt changes the squared frequency of mode `n` in the tangential and in the radial
    /// direction. The first mode has the number 0; `fill` is h/R.
    fn factors(self, n: usize, fill: f64) -> [f64; 2] {
        let [along, across] = factors(n, fill, self.slope);
        let mixed = |part: f64| along * part + across * (1.0 - part);
        [mixed(self.tangential), mixed(1.0 - self.tangential)]
    }

    /// Returns mode `n` of the tilted tank, where the first mode has the number 0. `upright` is the pendulum of this mode in
    /// an upright tank.
    pub fn mode(self, n: usize, p: &Parameters, upright: &cylinder::Pendulum) -> Mode {
        let [f, _] = self.factors(n, 2.0 * p.tank.h / p.tank.d);
        let oblique = self.oblique(n, p);
        let length = upright.length * oblique.stiffness / f;
        Mode { mass: upright.mass * f / oblique.share, length, upright: upright.length / f }
    }

    /// Returns the frequency of mode 1's pendulum in the radial direction, divided by the frequency of the liquid in the
    /// radial direction. In the tangential direction the two frequencies are equal.
    fn radial_frequency(self, p: &Parameters) -> f64 {
        let fill = 2.0 * p.tank.h / p.tank.d;
        let [tangential, radial] = self.factors(0, fill);
        let turned = Leaning { tangential: 1.0 - self.tangential, ..self };
        let stiffness = |leaning: Leaning| leaning.oblique(0, p).stiffness;
        libm::sqrt(stiffness(turned) / stiffness(self) * tangential / radial)
    }

    fn oblique(self, n: usize, p: &Parameters) -> Oblique {
        let coefficients = p.slosh.third_order(n, 2.0 * p.tank.h / p.tank.d);
        p.slosh.model.oblique(self.slope, self.tangential, coefficients)
    }
}

pub(crate) fn problems(p: &Parameters) -> Vec<String> {
    let mut problems = Vec::new();
    let (Some(Leaning { slope, .. }), true) =
        (Leaning::from_parameters(p), p.slosh.model != SloshModel::Frozen)
    else {
        return problems;
    };
    let (radius, tilt) = (p.tank.d / 2.0, p.bench.tilt);
    let fill = p.tank.h / radius;
    if slope >= fill {
        problems.push(format!(
            "bench.tilt = {tilt} rad: the surface of the liquid, tank.h = {} m deep in the middle, reaches the bottom of the tank \
             (allowed: less than atan(2 tank.h/tank.d) = {} rad). For a larger tilt use slosh.source = table with the modes of \
             the tilted tank, or slosh.model = frozen",
            p.tank.h,
            libm::atan(fill)
        ));
    }
    problems
}

/// Relative error of a mode's radial frequency above which a warning is issued. The error arises because some slosh models
/// have one pendulum for both directions.
const APART: f64 = 0.01;

pub(crate) fn warnings(p: &Parameters) -> Vec<String> {
    let mut warnings = Vec::new();
    let Some(leaning) = Leaning::from_parameters(p) else { return warnings };
    let fill = 2.0 * p.tank.h / p.tank.d;
    let most = largest_slope(fill);
    if leaning.slope > most {
        warnings.push(format!(
            "bench.tilt = {} rad: above {:.3} rad at h/R = {fill:.3} the error of slosh frequencies exceeds 1 %. Use \
             slosh.source = table with the modes of the tilted tank",
            p.bench.tilt,
            libm::atan(most)
        ));
    }
    if p.slosh.model.moves_along_one() {
        return warnings;
    }
    let name = p.slosh.model.name();
    let off = leaning.radial_frequency(p) - 1.0;
    if off.abs() > APART {
        warnings.push(format!(
            "bench.tilt = {} rad: the tilted liquid has two frequencies, but slosh.model = {name} has one pendulum for both \
             directions. Its tangential frequency is right, its radial frequency is {:.1} % too {}",
            p.bench.tilt,
            100.0 * off.abs(),
            if off > 0.0 { "high" } else { "low" }
        ));
    }
    warnings
}
