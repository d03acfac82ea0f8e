//! The directional factor B of dry friction, which multiplies Stribeck's curve (Rubaga's thesis, section 5.4):
//!
//! ```text
//! B+-(theta) = 1 +- eta + sum over h = 1, 2 of a_h+- cos(h theta) + b_h+- sin(h theta),
//! ```
//!
//! with + while the hub turns forwards and - while it turns backwards.

use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use taylor::series::{self, Series, ZERO};

use crate::contact::Contact;
use crate::parameters::Friction;

/// The directional factor of dry friction for one direction of rotation: its mean, and the coefficients of cos theta, sin
/// theta, cos 2 theta and sin 2 theta for the angle theta of the hub.
#[derive(Clone, Copy, Debug)]
struct OneWay {
    mean: f64,
    harmonics: [f64; 4],
}

impl OneWay {
    fn coefficient_at(&self, theta: f64) -> f64 {
        let [a1, b1, a2, b2] = self.harmonics;
        if self.harmonics == [0.0; 4] {
            return self.mean;
        }
        let (s1, c1) = libm::sincos(theta);
        let (s2, c2) = libm::sincos(2.0 * theta);
        self.mean + a1 * c1 + b1 * s1 + a2 * c2 + b2 * s2
    }

    /// Returns a lower bound of the factor over all angles of the hub. It is below the true minimum by at most 2e-6 of the
    /// amplitude of the terms that depend on the angle.
    fn lowest(&self) -> f64 {
        if self.harmonics == [0.0; 4] {
            return self.mean;
        }
        const POINTS: usize = 4096;
        let angle = |j: usize| core::f64::consts::TAU * j as f64 / POINTS as f64;
        let lowest =
            (0..POINTS).map(|j| self.coefficient_at(angle(j))).fold(f64::INFINITY, f64::min);
        // Between two points B is lower than at the nearer point by at most |B''| (spacing/2)^2/2.
        let [a1, b1, a2, b2] = self.harmonics.map(f64::abs);
        let bend = a1 + b1 + 4.0 * (a2 + b2);
        lowest - bend * (angle(1) / 2.0) * (angle(1) / 2.0) / 2.0
    }

    #[inline(always)]
    fn coefficient(&self, n: usize, trig: &[Series; 4]) -> f64 {
        let mean = series::constant(n, self.mean);
        let terms = self.harmonics.iter().zip(trig);
        mean + terms.map(|(coefficient, series)| coefficient * series[n]).sum::<f64>()
    }
}

/// The directional factor of dry friction for both directions of rotation, with the power series of the terms that depend on
/// the angle theta of the hub. `trig` contains cos and sin of theta and of 2 theta, in the order of `OneWay::harmonics`; it
/// is `None` if the factor does not depend on the angle. `angles_d` are the derivatives of theta and of 2 theta.
#[derive(Clone, Debug)]
pub struct DirectionalFactor {
    forward: OneWay,
    backward: OneWay,
    trig: Option<Box<[Series; 4]>>,
    angles_d: [Series; 2],
}

impl DirectionalFactor {
    pub fn new(p: &Friction) -> DirectionalFactor {
        let forward = OneWay { mean: 1.0 + p.asymmetry, harmonics: p.harmonics_forward };
        let backward = OneWay { mean: 1.0 - p.asymmetry, harmonics: p.harmonics_backward };
        let angular = [forward, backward].iter().any(|b| b.harmonics != [0.0; 4]);
        let trig = angular.then(|| Box::new([ZERO; 4]));
        DirectionalFactor { forward, backward, trig, angles_d: [ZERO; 2] }
    }

    /// Returns a message for each direction of rotation in which the directional factor of dry friction falls to 0 or below
    /// at some angle of the hub. Friction with a negative factor would drive the hub.
    pub fn problems(p: &Friction) -> Vec<String> {
        let factor = DirectionalFactor::new(p);
        let directions = [(factor.forward, "forward", '+'), (factor.backward, "backward", '-')];
        let wrong = directions.into_iter().filter(|(b, ..)| b.lowest() <= 0.0);
        wrong
            .map(|(one_way, name, sign)| {
                format!(
                    "friction.asymmetry and friction.{name}_*: the factor of dry friction, \
                     1 {sign} asymmetry + harmonics, falls to {:.6}, so the bearing would drive \
                     the hub (allowed: above 0 at every angle)",
                    one_way.lowest()
                )
            })
            .collect()
    }

    /// Returns the smallest and the largest value of the directional factor of dry friction, over both directions of
    /// rotation and all angles of the hub.
    pub fn bounds(&self) -> (f64, f64) {
        let both = [self.forward, self.backward];
        let mirrored = both.map(|b| OneWay { mean: -b.mean, harmonics: b.harmonics.map(|h| -h) });
        let lowest = |of: [OneWay; 2]| of.iter().map(OneWay::lowest).fold(f64::INFINITY, f64::min);
        (lowest(both), -lowest(mirrored))
    }

    pub fn coefficient_at(&self, theta: f64) -> (f64, f64) {
        (self.backward.coefficient_at(theta), self.forward.coefficient_at(theta))
    }

    pub fn depends_on_angle(&self) -> bool {
        self.trig.is_some()
    }

    /// Returns the mean of the directional factor of dry friction over all angles of the hub, for the direction of rotation
    /// that `contact` states.
    pub fn mean(&self, contact: Contact) -> f64 {
        self.one_way(contact).mean
    }

    pub fn expand(&mut self, n: usize, theta: &Series) {
        let Some(trig) = &mut self.trig else { return };
        let [c1, s1, c2, s2] = &mut **trig;
        let [once_d, twice_d] = &mut self.angles_d;
        (s1[n], c1[n]) = series::sin_cos(n, theta[n], once_d, s1, c1);
        (s2[n], c2[n]) = series::sin_cos(n, 2.0 * theta[n], twice_d, s2, c2);
    }

    pub fn coefficient(&self, n: usize, contact: Contact) -> f64 {
        self.series_coefficient(n, self.one_way(contact))
    }

    pub fn even_odd(&self, n: usize) -> (f64, f64) {
        let (forward, backward) =
            (self.series_coefficient(n, &self.forward), self.series_coefficient(n, &self.backward));
        ((forward + backward) / 2.0, (forward - backward) / 2.0)
    }

    fn one_way(&self, contact: Contact) -> &OneWay {
        if contact == Contact::Forward { &self.forward } else { &self.backward }
    }

    #[inline(always)]
    fn series_coefficient(&self, n: usize, one_way: &OneWay) -> f64 {
        match &self.trig {
            Some(trig) => one_way.coefficient(n, trig),
            None => series::constant(n, one_way.mean),
        }
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4};

    use super::*;

    /// The expected directional factor of dry friction is 1.1 + 0.04 cos θ − 0.03 sin θ + 0.02 cos 2θ + 0.01 sin 2θ, for a
    /// hub at rest and for a hub that turns.
    #[test]
    fn each_harmonic_of_the_friction_over_the_angle_has_the_documented_sign() {
        let one = OneWay { mean: 1.1, harmonics: [0.04, -0.03, 0.02, 0.01] };
        for (theta, expected) in [
            (0.0, 1.1 + 0.04 + 0.02),
            (FRAC_PI_4, 1.1 + 0.01 * FRAC_1_SQRT_2 + 0.01),
            (FRAC_PI_2, 1.1 - 0.03 - 0.02),
            (-FRAC_PI_4, 1.1 + 0.07 * FRAC_1_SQRT_2 - 0.01),
        ] {
            let trig = [theta.cos(), theta.sin(), (2.0 * theta).cos(), (2.0 * theta).sin()];
            let series = trig.map(|x| {
                let mut series = ZERO;
                series[0] = x;
                series
            });
            // The tolerance allows for rounding errors of five terms.
            assert!((one.coefficient_at(theta) - expected).abs() < 1e-15, "{theta}");
            assert!((one.coefficient(0, &series) - expected).abs() < 1e-15, "{theta}");
        }
    }

    #[test]
    fn the_lower_bound_of_the_friction_over_the_angle_is_at_most_2e_6_of_the_harmonics_too_low() {
        let half = core::f64::consts::PI / 4096.0;
        for place in [0.0, 1.0, 1024.0, 1025.0, 3001.0, 4095.0] {
            let (s, c) = (place * half).sin_cos();
            let (s2, c2) = (2.0 * place * half).sin_cos();
            for harmonics in [[-c, -s, 0.0, 0.0], [0.0, 0.0, -c2, -s2]] {
                let one = OneWay { mean: 1.5, harmonics };
                let below = 0.5 - one.lowest();
                // The lower tolerance allows for rounding errors.
                assert!((-1e-15..2e-6).contains(&below), "{place} {harmonics:?} {below:e}");
            }
        }
    }
}
