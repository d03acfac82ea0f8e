//! Similarity of a bench and a flight tank: Bond numbers and Froude's scale factors (Rubaga's thesis, sections 2.5, 2.6 and
//! 7.2; the numbers in brackets are its equations). All quantities are in SI units.
//!
//! ```text
//! Bo   = rho a R^2 / sigma          gravity or thrust against surface tension   (2.22, 2.27, 7.1)
//! Bo_i = rho alpha R^2 L / sigma    angular acceleration, tank at distance L    (2.25)
//! Bo_c = rho omega^2 R^2 L / sigma  angular rate                                (2.26)
//! Bo_r = rho alpha R^3 / sigma      angular acceleration, R for L               (7.3)
//! We   = rho V^2 L / sigma          inertia against surface tension             (2.21)
//! Fr   = V^2 / (a L)                inertia against gravity, We/Bo              (2.23)
//! ```

use libm::{cbrt, sqrt};

/// A liquid with its `density`, kg/m3, and its surface `tension`, N/m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Liquid {
    pub density: f64,
    pub tension: f64,
}

impl Liquid {
    pub fn bond(&self, a: f64, radius: f64) -> f64 {
        self.density * a * radius * radius / self.tension
    }

    /// Returns the Bond number of a tank that a rotation accelerates: the ratio of inertia to surface tension. `alpha` is the
    /// angular acceleration of the spacecraft, rad/s2, `radius` the radius of the tank, m, and `arm` the distance of the tank
    /// from the axis of rotation, m. If the square of an angular rate is passed as `alpha`, the result is the Bond number of
    /// the centrifugal acceleration.
    pub fn rotational_bond(&self, alpha: f64, radius: f64, arm: f64) -> f64 {
        self.bond(alpha * arm, radius)
    }

    pub fn weber(&self, velocity: f64, length: f64) -> f64 {
        self.density * velocity * velocity * length / self.tension
    }

    /// Returns the time sqrt(rho L^3/sigma), s, in which surface tension moves liquid over the `length` L, m (equation 2.29
    /// of Rubaga's thesis). It is not the period of an oscillation.
    pub fn capillary_time(&self, length: f64) -> f64 {
        sqrt(self.density * length * length * length / self.tension)
    }

    pub fn acceleration(&self, bond: f64, radius: f64) -> f64 {
        bond * self.tension / (self.density * radius * radius)
    }

    pub fn radius(&self, bond: f64, a: f64) -> f64 {
        sqrt(bond * self.tension / (self.density * a))
    }

    pub fn radius_by_cube(&self, bond: f64, alpha: f64) -> f64 {
        cbrt(bond * self.tension / (self.density * alpha))
    }
}

pub fn froude_number(velocity: f64, acceleration: f64, length: f64) -> f64 {
    velocity * velocity / (acceleration * length)
}

/// Returns the time sqrt(L/a), s, in which an `acceleration` a, m/s2, moves liquid over the `length` L, m (equation 2.28 of
/// Rubaga's thesis).
pub fn gravity_time(acceleration: f64, length: f64) -> f64 {
    sqrt(length / acceleration)
}

/// Returns a sentence that names the dominant force (Rubaga's thesis, section 2.5). Surface tension dominates if neither the
/// Bond number nor the Weber number exceeds 1. Otherwise gravity dominates if the Bond number is the larger one, and inertia
/// if the Weber number is the larger one. If inertia dominates, the liquid crosses the tank, and no pendulum represents it.
pub fn ruling_force(bond: f64, weber: f64) -> &'static str {
    match (bond > 1.0, weber > 1.0) {
        (_, true) if weber > bond => {
            "inertia: the liquid crosses the tank, and no pendulum represents it"
        }
        (true, _) => "gravity: waves and pendulums",
        _ => "surface tension: capillarity shapes the liquid, and there are no gravity waves",
    }
}

/// Returns a short text that describes how liquid behaves at a Bond number, for example "high g: flat surface, …" above 1000.
/// The Bond numbers at which the text changes are approximate (Rubaga's thesis, section 2.5).
pub fn regime(bond: f64) -> &'static str {
    match bond {
        b if b > 1000.0 => "high g: flat surface, linear and weakly nonlinear models hold",
        b if b > 30.0 => "low g: curved surface, frequency and damping shift",
        b if b > 1.0 => "microgravity: strongly nonlinear, place of the liquid uncertain",
        _ => "capillary: surface tension rules",
    }
}

/// Returns a text on the agility of a spacecraft, for example "low agility", from its angular acceleration, rad/s2 (Rubaga's
/// thesis, Table 2.2).
pub fn agility(alpha: f64) -> &'static str {
    match alpha {
        a if a < 5e-5 => "low agility",
        a if a <= 5e-4 => "medium agility",
        _ => "high agility",
    }
}

/// Returns the factors that convert quantities of a model to full size by Froude's law, each with the name and the unit of
/// the quantity. `lambda` is the ratio of lengths, `density` the ratio of densities and `gravity` the ratio of accelerations,
/// each full size divided by model. Table 2.3 of Rubaga's thesis has the case of equal gravity.
pub fn froude(lambda: f64, density: f64, gravity: f64) -> [(&'static str, &'static str, f64); 10] {
    let volume = lambda * lambda * lambda;
    let force = volume * density * gravity;
    let time = sqrt(lambda / gravity);
    [
        ("length", "m", lambda),
        ("time", "s", time),
        ("frequency", "Hz", 1.0 / time),
        ("velocity", "m/s", sqrt(lambda * gravity)),
        ("acceleration", "m/s2", gravity),
        ("angular acceleration", "rad/s2", gravity / lambda),
        ("mass", "kg", volume * density),
        ("force", "N", force),
        ("moment", "N.m", force * lambda),
        ("pressure", "Pa", force / (lambda * lambda)),
    ]
}

/// Returns the ratio of the kinematic viscosities of two liquids, full size divided by model, for which model and full size
/// have the same Reynolds number. `lambda` is the ratio of lengths and `gravity` the ratio of accelerations. With equal
/// viscosities, Froude scaling does not preserve the Reynolds number.
pub fn froude_viscosity(lambda: f64, gravity: f64) -> f64 {
    lambda * sqrt(lambda * gravity)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bond_number_and_tank_size_are_inverse_functions() {
        let liquid = Liquid { density: 1000.0, tension: 0.0625 };
        let bond = liquid.bond(0.5, 0.25);
        assert_eq!(bond, 500.0);
        assert_eq!(liquid.acceleration(bond, 0.25), 0.5);
        assert_eq!(liquid.radius(bond, 0.5), 0.25);
        assert_eq!(liquid.rotational_bond(2.0, 0.25, 0.25), bond);
        // The result is a cube root, exact to its last digit.
        assert!((liquid.radius_by_cube(bond, 2.0) - 0.25).abs() < 1e-16);
    }

    #[test]
    fn weber_and_froude_numbers_and_times_follow_from_the_bond_number() {
        let liquid = Liquid { density: 1000.0, tension: 0.0625 };
        let (v, a, l) = (0.5, 0.25, 0.25);
        let (we, fr, bo) = (liquid.weber(v, l), froude_number(v, a, l), liquid.bond(a, l));
        assert_eq!((we, fr, bo), (1000.0, 4.0, 250.0));
        assert_eq!(we / fr, bo);
        assert_eq!(gravity_time(0.25, 4.0), 4.0);
        let ratio = liquid.capillary_time(l) / gravity_time(a, l);
        assert!((ratio * ratio / bo - 1.0).abs() < 1e-15);
        let rules = [(250.0, 1000.0), (250.0, 10.0), (0.1, 0.5), (0.1, 3.0)]
            .map(|(bo, we)| &ruling_force(bo, we)[..7]);
        assert_eq!(rules, ["inertia", "gravity", "surface", "inertia"]);
    }

    #[test]
    fn the_regime_of_a_bond_number_and_the_agility_of_a_slew_change_at_their_limits() {
        let regimes = [1001.0, 1000.0, 31.0, 30.0, 1.1, 1.0].map(|bond| &regime(bond)[..5]);
        assert_eq!(regimes, ["high ", "low g", "low g", "micro", "micro", "capil"]);
        let agilities = [4.9e-5, 5e-5, 5e-4, 5.1e-4].map(agility);
        assert_eq!(agilities, ["low agility", "medium agility", "medium agility", "high agility"]);
    }

    #[test]
    fn froude_scale_factors_equal_the_table_of_the_thesis() {
        let factors = froude(4.0, 2.0, 0.25).map(|(name, _, factor)| (name, factor));
        let expected = [
            ("length", 4.0),
            ("time", 4.0),
            ("frequency", 0.25),
            ("velocity", 1.0),
            ("acceleration", 0.25),
            ("angular acceleration", 0.0625),
            ("mass", 128.0),
            ("force", 32.0),
            ("moment", 128.0),
            ("pressure", 2.0),
        ];
        assert_eq!(factors, expected);
        assert_eq!(froude_viscosity(16.0, 0.25), 32.0);
    }

    #[test]
    fn froude_scaling_keeps_the_ratio_of_inertia_to_gravity() {
        let factor = |name: &str, all: [(&str, &str, f64); 10]| {
            all.iter().find(|(other, ..)| *other == name).map_or(f64::NAN, |one| one.2)
        };
        let all = froude(4.0, 2.0, 0.25);
        assert_eq!(factor("time", all), 4.0);
        assert_eq!(factor("force", all), factor("mass", all) * factor("acceleration", all));
        assert_eq!(factor("moment", all), factor("force", all) * 4.0);
        assert_eq!(factor("velocity", all) * factor("time", all), 4.0);
        assert_eq!(froude_viscosity(4.0, 0.25), 4.0 * factor("velocity", all));
    }
}
