//! Damping ratios of slosh modes in any tank ([`estimate`]), from the laminar layer at the wall and published correlations,
//! and damping by ring baffles.
//!
//! ```text
//! zeta_n = f beta_n sqrt(nu/(8 omega_n)),   omega_n^2 = g lambda_n + k_n/m_n
//! ```
//!
//! beta_n = int_W |grad phi|^2 dS / int_Q |grad phi|^2 dV, 1/m, is the ratio of wall shear to volume. The true natural
//! frequency omega_n includes capillarity, so that zeta stays finite if g vanishes. The factor f accounts for surface film
//! and contact line. It was measured for some shapes of tanks; any other shape has the value [`UNMEASURED`]. If only a part
//! of the wall has a measured shape, f is a mean of both values.
//!
//! Everywhere Re = nu/sqrt(g R^3) (an inverse Reynolds number), x = h/R is the fill, and zeta is the logarithmic decrement
//! divided by 2 pi. Measured damping ratios scatter by about 30 % around any correlation.

use core::f64::consts::TAU;

use libm::{cosh, exp, log, pow, sinh, sqrt, tanh};

use crate::cylinder::XI;

/// Damping ratio of a slosh mode divided by the damping ratio of the laminar layer at the wall, for a tank of a shape that
/// nobody has measured. It lies between the values of measured cylinders: 1.49 by Stephens, and 1.39 to 1.54 by Mikishev and
/// Dorozhkin.
pub const UNMEASURED: f64 = 1.45;

pub const SCATTER: f64 = 0.3;

/// The quantities of a slosh mode on which its damping depends: the wall factor `beta`, 1/m, which is the integral of the
/// squared velocity over the wetted wall, divided by the integral over the volume of the liquid; the wave number `lambda`,
/// 1/m, from which the natural frequency without surface tension follows as sqrt(g lambda); and the natural frequency
/// `omega` with surface tension, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    pub beta: f64,
    pub lambda: f64,
    pub omega: f64,
}

impl Mode {
    /// Returns mode `n` (the first mode is 0) of an upright cylinder with this radius and depth of liquid, m. Surface tension
    /// acts like an increase of gravity. Therefore `g`, m/s2, is the sum of the specific force and this equivalent increase.
    pub fn from_cylinder(n: usize, radius: f64, depth: f64, g: f64) -> Mode {
        let lambda = XI[n] / radius * tanh(XI[n] * depth / radius);
        Mode { beta: cylinder_beta(n, radius, depth), lambda, omega: sqrt(g * lambda) }
    }

    pub fn laminar(&self, nu: f64) -> f64 {
        laminar(self.beta, nu, self.omega)
    }
}

/// The shapes of tanks for which the damping of the first mode was measured. Cylinder and torus stand upright, and the apex
/// of the cone is at its bottom. Lengths are in m; the `radius` of a cone is the radius of its free surface, and its half
/// angle is in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    Cylinder { radius: f64, depth: f64 },
    Sphere { radius: f64, depth: f64 },
    Cone { radius: f64, half_angle: f64 },
    Torus { tube_radius: f64, depth: f64 },
    Other,
}

/// Damping ratio `zeta` of the first slosh mode by a published correlation, and the `weight`, 0 to 1, of this value against
/// the estimate for unmeasured shapes, [`UNMEASURED`]. The weight is 1 within the range of the measurements. It falls
/// smoothly to 0 where the tank is outside this range by the factor [`BEYOND`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correlation {
    pub zeta: f64,
    pub weight: f64,
}

pub const BEYOND: f64 = 2.0;

/// Largest half angle of a cone, degrees, for which the correlation still has some weight. Cones were measured only up to 45
/// degrees.
const WIDEST: f64 = 50.0;

const SHALLOW: f64 = 0.4;

/// Returns a smooth transition from 0 for `t` <= 0 to 1 for `t` >= 1: a cubic polynomial whose slope is 0 at both ends.
pub fn smooth_step(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn weight(number: f64, [low, high]: [f64; 2]) -> f64 {
    let outside = f64::max(low / number, number / high);
    1.0 - smooth_step(log(f64::max(outside, 1.0)) / log(BEYOND))
}

impl Shape {
    /// Returns the damping ratio of the first slosh mode by the published correlation for this shape; `None` if the shape
    /// was not measured. `nu` is the kinematic viscosity, m2/s, and `g`, m/s2, is the specific force plus a term for surface
    /// tension, which acts like an increase of the specific force.
    ///
    /// In a cylinder the formula of Mikishev and Dorozhkin is used from h/R = 0.5 on. For smaller fills this formula gives
    /// less damping than wall friction alone, so that the formula of Stephens, Leonard and Perry is used. The two formulas
    /// differ by 7 % at 0.5; between 0.4 ([`SHALLOW`]) and 0.5 the result changes smoothly from the second formula to the
    /// first.
    pub fn correlation(&self, nu: f64, g: f64) -> Option<Correlation> {
        let (zeta, weight) = match *self {
            Shape::Cylinder { radius, depth } => {
                let deep = smooth_step((depth / radius - SHALLOW) / (0.5 - SHALLOW));
                let zeta = if deep == 0.0 || deep == 1.0 {
                    cylinder(radius, depth, nu, g)
                } else {
                    (1.0 - deep) * stephens(radius, depth, nu, g)
                        + deep * mikishev_dorozhkin(radius, depth, nu, g)
                };
                (zeta, 1.0)
            }
            Shape::Sphere { radius, depth } => {
                (sphere(radius, depth, nu, g), weight(sphere_number(radius, nu, g), [1e-2, 1.0]))
            }
            Shape::Cone { radius, half_angle } => (
                cone(radius, half_angle, nu, g),
                1.0 - smooth_step((half_angle - 45.0) / (WIDEST - 45.0)),
            ),
            Shape::Torus { tube_radius, depth } => (
                torus(tube_radius, depth, nu, g),
                weight(torus_number(tube_radius, nu, g), [0.1, 10.0]),
            ),
            Shape::Other => return None,
        };
        Some(Correlation { zeta, weight })
    }

    /// Returns the same shape with the depth limited to the measured range, which is 0.1 to 1.9 radii in a sphere and 0.1 to
    /// 0.9 of the height in a torus.
    #[must_use]
    pub fn at_measured_depth(self) -> Shape {
        match self {
            Shape::Sphere { radius, depth } => {
                Shape::Sphere { radius, depth: depth.clamp(0.1 * radius, 1.9 * radius) }
            }
            Shape::Torus { tube_radius, depth } => Shape::Torus {
                tube_radius,
                depth: depth.clamp(0.2 * tube_radius, 1.8 * tube_radius),
            },
            other => other,
        }
    }
}

/// A part of the wetted wall that has a measured shape. `share` is its fraction of the wetted area, 0 to 1. `factor` is the
/// damping ratio of the shape's first mode by its correlation, divided by the damping ratio of the laminar layer at its wall.
/// `weight` is [`Correlation::weight`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    pub share: f64,
    pub factor: f64,
    pub weight: f64,
}

/// Smallest fraction of the wetted wall at which a measured shape has its full effect on the interval of [`estimate`]; a
/// smaller part has an effect in proportion to its fraction. A wall counts as a wall of one shape if less than this fraction
/// has another shape.
const COUNTS: f64 = 0.05;

/// Smallest ratio of a correlation's damping to the damping of the laminar layer at which the correlation still has some
/// weight. A ratio below 1 is not physical, because every wall dissipates at least as much as its laminar layer.
const BELOW: f64 = 0.8;

impl Part {
    /// Returns the ratio of damping to laminar damping with which this part of the wall enters the mean over the wall. This
    /// is `factor`, the ratio by the correlation of the part's shape, if `factor` is at least 1 and the correlation has its
    /// full weight. As the weight falls to 0, or as `factor` falls from 1 to [`BELOW`], the result moves smoothly to
    /// [`UNMEASURED`]: no wall can have less damping than its laminar layer.
    fn shape_factor(&self) -> f64 {
        let trusted = self.weight * smooth_step((self.factor - BELOW) / (1.0 - BELOW));
        UNMEASURED + trusted * (self.factor.max(1.0) - UNMEASURED)
    }

    /// Returns true if the correlation of the shape and the estimate for unmeasured shapes ([`UNMEASURED`]) differ by more
    /// than the scatter of measured damping ratios.
    pub fn disagrees(&self) -> bool {
        let (low, high) = (self.factor.min(UNMEASURED), self.factor.max(UNMEASURED));
        high > (1.0 + SCATTER) * low
    }

    fn is_in_range(&self) -> bool {
        self.weight == 1.0 && self.factor >= 1.0
    }

    pub fn is_measured(&self) -> bool {
        self.share == 1.0 && self.is_in_range()
    }
}

/// Damping ratios of a tank, each divided by the damping ratio of the laminar layer at its wall: the estimate `factor`, which
/// holds for all modes, the `interval` of the first mode, and the wider interval of the higher modes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    pub factor: f64,
    pub interval: [f64; 2],
    pub interval_of_others: [f64; 2],
}

/// Estimates the damping ratios of a tank, each divided by the damping ratio of the laminar layer at the wall. `parts` are
/// the parts of the wetted wall that have a shape with measured damping; the rest of the wall has the factor [`UNMEASURED`].
/// `near` are measured shapes that the whole wall only resembles, for example the sphere for a spheroid that is almost
/// round.
///
/// The estimate is the mean of the factors of all parts, weighted with their shares of the wetted area. The factor of a part
/// is moved towards [`UNMEASURED`] if the correlation of its shape has less than its full weight, or gives less damping than
/// the laminar layer.
///
/// If the whole wall is one shape whose correlation agrees with [`UNMEASURED`], the interval of the first mode is the
/// scatter of measured tanks, ±30 %. Otherwise it extends from the laminar layer to 1.3 times the largest factor of all
/// `parts` and of all shapes in `near`. If such a shape covers 95 to 100 % of the wall, the interval is interpolated between
/// these two rules, so that it changes continuously.
pub fn estimate(parts: &[Part], near: &[Part]) -> Estimate {
    let mean = |sum: f64, part: &Part| sum + part.share * (part.shape_factor() - UNMEASURED);
    let factor = match parts {
        [part] if part.is_measured() => part.factor,
        _ => parts.iter().fold(UNMEASURED, mean),
    };
    let largest = parts.iter().chain(near).fold(UNMEASURED, |largest, part| {
        let counts = f64::min(part.share / COUNTS, 1.0);
        largest.max(UNMEASURED + counts * (part.factor - UNMEASURED))
    });
    let wide = [1.0, (1.0 + SCATTER) * largest];
    let scatter = [(1.0 - SCATTER) * factor, (1.0 + SCATTER) * factor];
    let agrees = |part: &&Part| part.is_in_range() && !part.disagrees();
    let interval = match parts.iter().find(|part| agrees(part) && part.share > 1.0 - COUNTS) {
        Some(part) if part.share == 1.0 => scatter,
        Some(part) => {
            let t = (1.0 - part.share) / COUNTS;
            [0, 1].map(|end| scatter[end] + t * (wide[end] - scatter[end]))
        }
        None => wide,
    };
    Estimate { factor, interval, interval_of_others: wide }
}

pub fn inverse_reynolds(radius: f64, nu: f64, g: f64) -> f64 {
    nu / sqrt(g * radius * radius * radius)
}

/// Returns the damping ratio of the laminar layer at the wetted wall, beta sqrt(nu/(8 omega)). `beta` is the wall factor of
/// the mode, 1/m, `nu` the kinematic viscosity, m2/s, and `omega` the natural frequency, rad/s. Sources: Case and Parkinson
/// (1957) for cylinders, Keulegan (1959) for boxes.
pub fn laminar(beta: f64, nu: f64, omega: f64) -> f64 {
    beta * sqrt(nu / (8.0 * omega))
}

/// Returns the wall factor beta, 1/m, of slosh mode `n` (the first mode is 0) of an upright cylinder with this radius and
/// depth of liquid, m. The damping ratio of the laminar layer is proportional to it. With x = h/R, beta R = (xi^2 +
/// 1)/(xi^2 - 1) + 2 xi (1 - x)/sinh(2 xi x) (Case and Parkinson, J. Fluid Mech. 2 (1957) 172).
pub fn cylinder_beta(n: usize, radius: f64, depth: f64) -> f64 {
    let (xi, x) = (XI[n], depth / radius);
    let u = 2.0 * xi * x;
    let shallow = if u > 700.0 { 0.0 } else { 2.0 * xi * (1.0 - x) / sinh(u) };
    ((xi * xi + 1.0) / (xi * xi - 1.0) + shallow) / radius
}

/// Returns the damping ratio of the first slosh mode of an upright cylinder, by [`mikishev_dorozhkin`] if the depth is at
/// least half the radius, and otherwise by [`stephens`].
pub fn cylinder(radius: f64, depth: f64, nu: f64, g: f64) -> f64 {
    if depth >= 0.5 * radius {
        mikishev_dorozhkin(radius, depth, nu, g)
    } else {
        stephens(radius, depth, nu, g)
    }
}

/// Returns an upper bound of the damping ratio of the first slosh mode of an upright cylinder at Bond numbers of 10 to 100,
/// where the moving contact line dissipates more than it does at large Bond numbers. The formula `0.83 (nu^2/(g R^3))^(1/4)
/// (1 + 8.2 Bo^(-3/5))` is quoted for drop-tower tests (Salzman, Labus and Masica, NASA TN D-4132). It is not used as an
/// estimate, because the report itself could not be obtained.
pub fn low_bond_cylinder(radius: f64, nu: f64, g: f64, bond: f64) -> f64 {
    0.83 * sqrt(inverse_reynolds(radius, nu, g)) * (1.0 + 8.2 * pow(bond, -0.6))
}

/// Returns the damping ratio of the first slosh mode of an upright cylinder by Mikishev and Dorozhkin (Dodge 2000), 0.79
/// sqrt(Re) [1 + (0.318/sinh 1.84 x) (1 + (1 - x)/cosh 1.84 x)] with the fill x = h/R and the viscosity number Re = nu/sqrt(g
/// R^3). For x below 0.5 the formula gives less damping than the laminar layer.
#[allow(clippy::approx_constant)] // 0.318 is a number of the correlation, not 1/pi
pub fn mikishev_dorozhkin(radius: f64, depth: f64, nu: f64, g: f64) -> f64 {
    let x = depth / radius;
    // The limit avoids an overflow of sinh; the bottom has no effect at this depth.
    let u = f64::min(1.84 * x, 300.0);
    let bottom = 0.318 / sinh(u) * (1.0 + (1.0 - x) / cosh(u));
    0.79 * sqrt(inverse_reynolds(radius, nu, g)) * (1.0 + bottom)
}

/// Returns the damping ratio of the first slosh mode of an upright cylinder by Stephens, Leonard and Perry (NASA TN D-1367),
/// `(5.23/2 pi) sqrt(Re) tanh(1.84 x)^(-1/4) [1 + 2 (1 - x)/sinh 3.68 x]` with the fill x = h/R and the viscosity number Re =
/// nu/sqrt(g R^3). The result is 1.493 times the damping of the laminar layer at every depth.
pub fn stephens(radius: f64, depth: f64, nu: f64, g: f64) -> f64 {
    let x = depth / radius;
    let bracket = 1.0 + if x > 100.0 { 0.0 } else { 2.0 * (1.0 - x) / sinh(3.68 * x) };
    let zeta = 5.23 / TAU * sqrt(inverse_reynolds(radius, nu, g)) * bracket;
    zeta / pow(tanh(1.84 * x), 0.25)
}

pub fn sphere_number(radius: f64, nu: f64, g: f64) -> f64 {
    1e4 * inverse_reynolds(2.0 * radius, nu, g)
}

/// Returns the damping ratio of the first slosh mode of a sphere by Mikishev and Dorozhkin, with the exponent of Sumner and
/// Stofan (NASA TN D-1991). With the fill x = h/R and the viscosity number B = 1e4 nu/sqrt(g D^3) it is (0.131/2 pi) B^0.359
/// f, where f = 1/x in a sphere that is at most half full (x <= 1), and f = (1 + 0.46 (2 - x))/(1.46 (2 - x)) in a fuller
/// sphere. Because f grows without bound for an empty and for a full sphere, x is limited to 0.1 to 1.9.
pub fn sphere(radius: f64, depth: f64, nu: f64, g: f64) -> f64 {
    let x = (depth / radius).clamp(0.1, 1.9);
    let by_fill = if x <= 1.0 { 1.0 / x } else { (1.0 + 0.46 * (2.0 - x)) / (1.46 * (2.0 - x)) };
    0.131 / TAU * pow(sphere_number(radius, nu, g), 0.359) * by_fill
}

/// Returns the damping ratio of the first slosh mode of a cone with its apex at the bottom. `radius` is the radius of the
/// free surface, m, and `half_angle` the angle b between axis and wall, degrees. The formula, a fit by the program SLOSH-ML
/// to a published figure, is (4.964/2 pi) C5 C4^(-1/2) sqrt(Re) with C5 = 1.0037 + 0.0126 b and C4 = 1.001 - 0.0031 b -
/// 0.0003 b^2. Since C4 falls to 0 at 53 degrees, b is limited to 45.
pub fn cone(radius: f64, half_angle: f64, nu: f64, g: f64) -> f64 {
    let b = half_angle.clamp(0.0, 45.0);
    let (c5, c4) = (1.0037 + 0.0126 * b, 1.001 - 0.0031 * b - 0.0003 * b * b);
    4.964 / TAU * c5 / sqrt(c4) * sqrt(inverse_reynolds(radius, nu, g))
}

/// Returns the viscosity number Re = nu/sqrt(g a^3) of a torus, divided by the viscosity number of the only torus whose
/// damping was measured. `tube_radius` is the radius a of the torus's cross-section, m.
pub fn torus_number(tube_radius: f64, nu: f64, g: f64) -> f64 {
    inverse_reynolds(tube_radius, nu, g) / inverse_reynolds(0.0635, 3.3e-6, 9.81)
}

/// Returns the damping ratio of the first slosh mode of a torus whose cross-section has the radius a = `tube_radius`, m. With
/// y = `depth`/(2 a) and the viscosity number Re of the torus it is sqrt(Re/Re_0) (1.6629 y^4 - 3.7955 y^3 + 3.5583 y^2 -
/// 1.6759 y + 0.3865)/(2 pi). The polynomial is the fit of SLOSH-ML, whose authors measured one size of tank, with Re_0 =
/// 3.3e-6/sqrt(9.81 0.0635^3).
pub fn torus(tube_radius: f64, depth: f64, nu: f64, g: f64) -> f64 {
    let y = 0.5 * depth / tube_radius;
    let fit = (((1.6629 * y - 3.7955) * y + 3.5583) * y - 1.6759) * y + 0.3865;
    sqrt(torus_number(tube_radius, nu, g)) * fit / TAU
}

pub fn covered(radius: f64, width: f64) -> f64 {
    let w = width / radius;
    w * (2.0 - w)
}

/// Returns how much of the first mode's motion at the surface is left at a ring baffle `depth` m below the surface of an
/// upright cylinder of this `radius`, m: the ratio exp(-1.84 depth/radius).
pub fn motion_at_ring(radius: f64, depth: f64) -> f64 {
    // The limit keeps a division by this ratio finite.
    exp(-f64::min(1.84 * depth / radius, 100.0))
}

/// Returns the damping ratio that a flat ring baffle adds to the first slosh mode of an upright cylinder (Miles 1958): `2.83
/// exp(-4.60 d/R) alpha^(3/2) (eta/R)^(1/2)`. The ring lies at the `depth` d below the surface and covers the fraction alpha
/// of the cross-section, which follows from its `width`; `amplitude` is the height eta of the wave at the wall. All lengths
/// are in m.
///
/// Since the ratio grows with the root of the amplitude, a decaying wave loses less and less energy per period.
pub fn miles_ring(radius: f64, depth: f64, width: f64, amplitude: f64) -> f64 {
    let alpha = covered(radius, width);
    2.83 * exp(-4.60 * depth / radius) * alpha * sqrt(alpha) * sqrt(amplitude / radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The expected values, with four digits, were computed by hand for water in a tank of 81.5 mm radius.
    #[test]
    fn damping_correlations_have_their_published_coefficients() {
        let (r, nu, g) = (0.0815, 9.1312e-7, 9.81);
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-3, "{a} {b}");
        near(inverse_reynolds(r, nu, g), 1.2530e-5);
        // In deep liquid the bottom has no effect.
        near(mikishev_dorozhkin(r, 5.0 * r, nu, g), 0.79 * 3.5398e-3);
        // For x = 1/2 the term is 0.318/sinh 0.92 (1 + 0.5/cosh 0.92) = 0.3018 (1 + 0.3444).
        near(mikishev_dorozhkin(r, 0.5 * r, nu, g), 0.79 * 3.5398e-3 * 1.4057);
        near(stephens(r, 5.0 * r, nu, g), 5.23 / TAU * 3.5398e-3);
        // For x = 1 the bracket is 1, and tanh(1.84) = 0.95080.
        near(stephens(r, r, nu, g), 5.23 / TAU * 3.5398e-3 * 1.01269);
        // A half full sphere has B = 1e4 Re/8^(1/2).
        near(sphere_number(r, nu, g), 4.4300e-2);
        near(sphere(r, r, nu, g), 0.131 / TAU * 0.32660);
        near(sphere(r, 1.5 * r, nu, g), 0.131 / TAU * 0.32660 * 1.23 / 0.73);
        near(cone(r, 30.0, nu, g), 4.964 / TAU * 1.3817 / 0.79875 * 3.5398e-3);
        near(
            torus(0.0635, 0.0635, 3.3e-6, 9.81),
            (((0.83145 - 3.7955) * 0.5 + 3.5583) * 0.25 - 0.83795 + 0.3865) / TAU,
        );
    }

    /// In shallow liquid the correlation changes visibly if a term has a wrong sign or size. The expected values, with twelve
    /// digits, were computed from the published formula by another program.
    #[test]
    fn the_bottom_term_of_mikishev_and_dorozhkin_matters_in_shallow_liquid_and_changes_sign_above_the_radius()
     {
        let (r, nu, g) = (0.0815, 9.1312e-7, 9.81);
        for (x, zeta) in [
            (0.2, 0.006928328365141964),
            (0.5, 0.003928811830428135),
            (1.0, 0.0030862117706254165),
            (2.0, 0.002839065877108384),
        ] {
            assert!((mikishev_dorozhkin(r, x * r, nu, g) / zeta - 1.0).abs() < 1e-12, "{x}");
        }
        // At depths at which sinh would overflow, the bottom term is 0.
        assert_eq!(mikishev_dorozhkin(r, 1e4 * r, nu, g), 0.79 * sqrt(inverse_reynolds(r, nu, g)));
    }

    #[test]
    fn the_bottom_term_of_stephens_matters_in_shallow_liquid() {
        let deep = stephens(1.0, 5.0, 1e-6, 9.81);
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
        // For x = 1/2: sinh 1.84 = 3.06896, tanh 0.92 = 0.72590.
        near(stephens(1.0, 0.5, 1e-6, 9.81) / deep, (1.0 + 1.0 / 3.06896) / pow(0.72590, 0.25));
        // For x = 2: sinh 7.36 = 785.92, tanh 3.68 = 0.998729.
        near(stephens(1.0, 2.0, 1e-6, 9.81) / deep, (1.0 - 2.0 / 785.92) / pow(0.998729, 0.25));
        near(stephens(1.0, 1e4, 1e-6, 9.81) / deep, 1.0);
    }

    #[test]
    fn beyond_its_range_a_damping_correlation_keeps_the_value_at_the_end() {
        let sphere = |x: f64| sphere(1.0, x, 1e-6, 9.81);
        assert_eq!((sphere(0.01), sphere(1.99)), (sphere(0.1), sphere(1.9)));
        assert!(sphere(0.11) < sphere(0.1) && sphere(1.89) != sphere(1.9));
        // At 1.9 radii the ratio is (1 + 0.046)/0.146 times that of the half full sphere.
        assert!((sphere(1.9) / sphere(1.0) / (1.046 / 0.146) - 1.0).abs() < 1e-12);
        let cone = |b: f64| cone(1.0, b, 1e-6, 9.81);
        assert_eq!((cone(-5.0), cone(60.0)), (cone(0.0), cone(45.0)));
        // For b = 20 and 40 degrees C5 is 1.2557 and 1.5077, and C4 is 0.819 and 0.397.
        let both = cone(40.0) / cone(20.0);
        assert!((both / (1.5077 / 1.2557 * sqrt(0.819 / 0.397)) - 1.0).abs() < 1e-12, "{both}");
    }

    #[test]
    fn the_damping_of_a_torus_equals_the_fit_and_grows_with_the_root_of_the_viscosity_number() {
        let full = torus(0.0635, 2.0 * 0.0635, 3.3e-6, 9.81);
        assert!((full * TAU / (1.6629 - 3.7955 + 3.5583 - 1.6759 + 0.3865) - 1.0).abs() < 1e-12);
        assert!((torus_number(0.0635, 3.3e-6, 9.81) - 1.0).abs() < 1e-15);
        assert!((torus(4.0 * 0.0635, 8.0 * 0.0635, 8.0 * 3.3e-6, 9.81) / full - 1.0).abs() < 1e-14);
        let quarter = torus(0.0635, 0.5 * 0.0635, 4.0 * 3.3e-6, 9.81);
        let fit = 1.6629 / 256.0 - 3.7955 / 64.0 + 3.5583 / 16.0 - 1.6759 / 4.0 + 0.3865;
        assert!((quarter * TAU / (2.0 * fit) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_ring_baffle_has_the_damping_of_miles_s_formula() {
        let zeta = miles_ring(1.0, 0.1, 0.1, 0.04);
        assert!((zeta / (2.83 * 0.63128 * 0.082819 * 0.2) - 1.0).abs() < 1e-4, "{zeta}");
        assert!((motion_at_ring(2.0, 0.2) / 0.83194 - 1.0).abs() < 1e-4);
        // A wave that is four times as high has twice the damping. If all lengths are doubled, the damping does not change.
        assert!((miles_ring(1.0, 0.1, 0.1, 0.16) / zeta - 2.0).abs() < 1e-14);
        assert!((miles_ring(2.0, 0.2, 0.2, 0.08) / zeta - 1.0).abs() < 1e-14);
        assert!((covered(2.0, 0.2) - 0.19).abs() < 1e-15);
        assert_eq!(motion_at_ring(1.0, 1e9), motion_at_ring(1.0, 1e6));
        assert!(motion_at_ring(1.0, 1e9) > 0.0);
    }

    #[test]
    fn damping_of_the_laminar_layer_grows_with_the_root_of_viscosity() {
        assert!((laminar(10.0, 8e-6, 4.0) - 5e-3).abs() < 1e-17);
    }

    #[test]
    fn each_mode_of_a_cylinder_has_its_own_wall_friction() {
        for n in [0, 1] {
            let xi = XI[n];
            let wide = (xi * xi + 1.0) / (xi * xi - 1.0);
            for (depth, beta) in [(2.0, wide), (1.0, wide + xi / sinh(xi)), (1e4, wide)] {
                let mode = Mode::from_cylinder(n, 2.0, depth, 3.0);
                assert!((mode.beta * 2.0 / beta - 1.0).abs() < 1e-15, "{n} {depth}");
                assert_eq!(mode.beta, cylinder_beta(n, 2.0, depth));
                let lambda = 0.5 * xi * tanh(0.5 * xi * depth);
                assert!((mode.lambda / lambda - 1.0).abs() < 1e-15, "{n} {depth}");
                assert!((mode.omega * mode.omega / (3.0 * lambda) - 1.0).abs() < 1e-15, "{n}");
            }
        }
        // For x = 2 the factor 1 - x is -1.
        let deep = cylinder_beta(0, 1.0, 2.0) - cylinder_beta(0, 1.0, 1.0);
        assert!((deep / (-2.0 * XI[0] / sinh(4.0 * XI[0])) - 1.0).abs() < 1e-12, "{deep}");
    }

    #[test]
    fn a_cylinder_has_stephens_s_damping_below_half_a_radius_and_mikishev_s_from_there_on() {
        let (r, nu, g) = (2.0, 1e-6, 9.81);
        assert_eq!(cylinder(r, 1.0, nu, g), mikishev_dorozhkin(r, 1.0, nu, g));
        assert_eq!(cylinder(r, 1.7, nu, g), mikishev_dorozhkin(r, 1.7, nu, g));
        assert_eq!(cylinder(r, 0.99, nu, g), stephens(r, 0.99, nu, g));
    }

    #[test]
    fn at_low_bond_numbers_the_contact_line_adds_damping() {
        let zeta = low_bond_cylinder(1.0, 1e-4, 4.0, 32.0);
        assert!(
            (zeta / (0.83 * 0.01 / sqrt(2.0) * (1.0 + 8.2 / 8.0)) - 1.0).abs() < 1e-14,
            "{zeta}"
        );
    }

    /// At the ends of the measured range of viscosity numbers the weight of a correlation falls from 1 to 0, so that the
    /// estimate for unmeasured shapes replaces it.
    #[test]
    fn a_damping_correlation_gets_weight_0_outside_the_range_of_its_measurements() {
        let (r, g) = (2.0, 9.81);
        let weights = |shape: Shape, unit: f64, numbers: [f64; 6]| {
            let weight = |number: f64| shape.correlation(number * unit, g).unwrap().weight;
            for (found, expected) in numbers.map(weight).iter().zip([0.0, 0.5, 1.0, 1.0, 0.5, 0.0])
            {
                assert!((found - expected).abs() < 1e-12, "{shape:?} {found} {expected}");
            }
        };
        let root = sqrt(2.0);
        let sphere = |x: f64| Shape::Sphere { radius: r, depth: x * r };
        let unit = 1.0 / sphere_number(r, 1.0, g);
        let numbers = [0.0049, 0.01 / root, 0.0101, 0.99, root, 2.01];
        weights(sphere(1.0), unit, numbers);
        weights(sphere(1.99), unit, numbers);
        let torus = |y: f64| Shape::Torus { tube_radius: r, depth: 2.0 * y * r };
        let unit = 1.0 / torus_number(r, 1.0, g);
        weights(torus(0.5), unit, [0.049, 0.1 / root, 0.101, 9.9, 10.0 * root, 20.1]);
        let cone = |half_angle: f64| Shape::Cone { radius: r, half_angle };
        let angles = [44.9, 45.0, 47.5, 50.0, 60.0];
        let weight = |angle| cone(angle).correlation(1e-6, g).unwrap().weight;
        assert_eq!(angles.map(weight), [1.0, 1.0, 0.5, 0.0, 0.0]);
        assert_eq!(
            Shape::Cylinder { radius: r, depth: 0.01 }.correlation(1.0, g).unwrap().weight,
            1.0
        );
        assert_eq!(Shape::Other.correlation(1e-6, g), None);
        // A viscosity of 0 is outside the range of the measurements.
        assert_eq!(sphere(1.0).correlation(0.0, g), Some(Correlation { zeta: 0.0, weight: 0.0 }));
        // Within the range of the measurements the value is that of the shape's formula, with the weight 1.
        let nu = unit;
        let zeta = |shape: Shape| shape.correlation(nu, g).unwrap().zeta;
        assert_eq!(zeta(sphere(0.7)), super::sphere(r, 0.7 * r, nu, g));
        assert_eq!(zeta(cone(20.0)), super::cone(r, 20.0, nu, g));
        assert_eq!(zeta(torus(0.3)), super::torus(r, 0.6 * r, nu, g));
        for (x, deep) in [(0.3, 0.0), (0.45, 0.5), (0.5, 1.0), (1.0, 1.0)] {
            let both = [stephens(r, x * r, nu, g), mikishev_dorozhkin(r, x * r, nu, g)];
            let expected = (1.0 - deep) * both[0] + deep * both[1];
            let found = zeta(Shape::Cylinder { radius: r, depth: x * r });
            assert!((found / expected - 1.0).abs() < 1e-12, "{x} {found} {expected}");
        }
    }

    #[test]
    fn a_damping_correlation_uses_the_nearest_measured_depth() {
        let sphere = |x: f64| Shape::Sphere { radius: 2.0, depth: 2.0 * x };
        let torus = |y: f64| Shape::Torus { tube_radius: 2.0, depth: 4.0 * y };
        for (shape, nearest) in [
            (sphere(0.05), sphere(0.1)),
            (sphere(1.0), sphere(1.0)),
            (sphere(1.95), sphere(1.9)),
            (torus(0.01), torus(0.1)),
            (torus(0.95), torus(0.9)),
            (
                Shape::Cone { radius: 1.0, half_angle: 80.0 },
                Shape::Cone { radius: 1.0, half_angle: 80.0 },
            ),
        ] {
            assert_eq!(shape.at_measured_depth(), nearest);
        }
    }

    fn part(share: f64, factor: f64, weight: f64) -> Part {
        Part { share, factor, weight }
    }

    fn is_near(found: [f64; 3], expected: [f64; 3]) {
        for (a, b) in found.into_iter().zip(expected) {
            assert!((a / b - 1.0).abs() < 1e-14, "{found:?} {expected:?}");
        }
    }

    fn numbers(parts: &[Part]) -> [f64; 3] {
        let Estimate { factor, interval: [low, high], interval_of_others } = estimate(parts, &[]);
        // The interval of all modes but the first begins at the laminar layer.
        assert_eq!(interval_of_others[0], 1.0);
        assert!(interval_of_others[1] >= high);
        [factor, low, high]
    }

    /// Each row contains the damping ratio of a tank's first mode and the limits of its interval, all divided by the damping
    /// ratio of the laminar layer at the wall. If the correlation and the estimate for unmeasured shapes, 1.45, agree within
    /// 30 %, the limits are ±30 % of the correlation. Otherwise the interval extends from the laminar layer, 1, to 1.3 times
    /// the larger of the two values.
    #[test]
    fn the_damping_interval_of_a_measured_shape_includes_both_estimates_if_they_disagree() {
        for (factor, low, high) in [
            (1.0, 1.0, 1.3 * 1.45),
            (1.11, 1.0, 1.3 * 1.45),
            (1.12, 0.7 * 1.12, 1.3 * 1.12),
            (1.88, 0.7 * 1.88, 1.3 * 1.88),
            (1.89, 1.0, 1.3 * 1.89),
            (22.0, 1.0, 1.3 * 22.0),
        ] {
            is_near(numbers(&[part(1.0, factor, 1.0)]), [factor, low, high]);
            assert_eq!(part(1.0, factor, 1.0).disagrees(), low == 1.0);
        }
        let [low, high] = estimate(&[part(1.0, 1.5, 1.0)], &[]).interval_of_others;
        is_near([low, high, 1.0], [1.0, 1.95, 1.0]);
    }

    /// The estimate for unmeasured shapes, 1.45 times the laminar layer, is used without a correlation, and also if the
    /// correlation has a low weight or gives less damping than the laminar layer.
    #[test]
    fn unmeasured_shapes_have_1_45_times_the_laminar_damping() {
        is_near(numbers(&[]), [1.45, 1.0, 1.3 * 1.45]);
        is_near(numbers(&[part(1.0, 3.0, 0.0)]), [1.45, 1.0, 3.9]);
        is_near(numbers(&[part(1.0, 0.8, 1.0)]), [1.45, 1.0, 1.3 * 1.45]);
        // A factor of 0.9 is half-way between 1, at which the correlation is used, and 0.8, at which 1.45 replaces it.
        is_near(numbers(&[part(1.0, 0.9, 1.0)]), [1.225, 1.0, 1.3 * 1.45]);
        is_near(numbers(&[part(1.0, 3.45, 0.25)]), [1.95, 1.0, 1.3 * 3.45]);
    }

    /// A third of the wall has 4 times the damping of the laminar layer, one half has 1.15 times, and the rest is unmeasured
    /// (1.45 times). The estimate is the mean of these factors, and its interval includes the largest factor.
    #[test]
    fn a_wall_of_several_shapes_has_the_mean_of_their_damping() {
        let parts = [part(1.0 / 3.0, 4.0, 1.0), part(0.5, 1.15, 1.0)];
        is_near(numbers(&parts), [4.0 / 3.0 + 0.5 * 1.15 + 1.45 / 6.0, 1.0, 5.2]);
        // A shape with a share below 5 % of the wall changes the end of the interval in proportion to its share.
        is_near(numbers(&[part(0.01, 4.0, 1.0)]), [1.4755, 1.0, 1.3 * (1.45 + 0.2 * 2.55)]);
        // The result is continuous where a shape becomes the whole wall, whether its correlation agrees with
        // 1.45 layers or not.
        for factor in [1.0, 1.3, 1.7, 4.0] {
            let [nearly, wholly] =
                [1.0 - 1e-9, 1.0].map(|share| numbers(&[part(share, factor, 1.0)]));
            for (a, b) in nearly.into_iter().zip(wholly) {
                assert!((a / b - 1.0).abs() < 1e-7, "{nearly:?} {wholly:?}");
            }
        }
        // Half-way to a wall of several shapes, the limits are half-way between 0.7 and 1, and between 1.3 times the factor
        // and 1.3 x 1.45.
        let factor = 1.45 - 0.975 * 0.15;
        let found = numbers(&[part(0.975, 1.3, 1.0)]);
        is_near(found, [factor, 0.5 * (0.7 * factor + 1.0), 0.5 * 1.3 * (factor + 1.45)]);
    }
}
