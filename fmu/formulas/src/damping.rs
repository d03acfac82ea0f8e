//! Damping ratios: one law for every tank ([`estimate`]), from the laminar layer at the wall and published
//! correlations; ring baffles.
//!
//! ```text
//! zeta_n = f beta_n sqrt(nu/(8 omega_n)),   omega_n^2 = g lambda_n + k_n/m_n
//! ```
//!
//! The ratio of wall shear to volume is beta_n = int_W |grad phi|^2 dS / int_Q |grad phi|^2 dV, 1/m. The true natural
//! frequency omega_n includes capillarity, so that zeta stays finite if g vanishes. The factor f accounts for surface
//! film and contact line: the value of a measured shape, or [`UNMEASURED`] for any other.
//!
//! Re = nu/sqrt(g R^3) throughout (an inverse Reynolds number), x = h/R is the fill, and zeta is
//! the logarithmic decrement over 2 pi. Measured tanks scatter by about 30 % around any
//! correlation.

use core::f64::consts::TAU;

use libm::{cosh, exp, pow, sinh, sqrt, tanh};

use crate::cylinder::XI;

/// f of a shape without measurements, from measured cylinders: 1.49 (Stephens) and 1.39 to 1.54
/// (Mikishev and Dorozhkin).
pub const UNMEASURED: f64 = 1.45;

/// Relative scatter of measured tanks around a correlation.
pub const SCATTER: f64 = 0.3;

/// Parameters of a slosh mode for its damping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// Ratio of wall shear to volume, 1/m.
    pub beta: f64,
    /// 1/l, 1/m; the frequency from gravity alone is sqrt(g lambda).
    pub lambda: f64,
    /// Natural frequency with capillarity, rad/s.
    pub omega: f64,
}

impl Mode {
    /// Returns mode `n` (from 0) of an upright cylinder at the specific force `g`, which includes the equivalent of a
    /// centring stiffness, k l/m.
    pub fn of_cylinder(n: usize, radius: f64, depth: f64, g: f64) -> Mode {
        let lambda = XI[n] / radius * tanh(XI[n] * depth / radius);
        Mode { beta: cylinder_beta(n, radius, depth), lambda, omega: sqrt(g * lambda) }
    }

    /// Returns the damping ratio of the laminar layer alone, f = 1.
    pub fn laminar(&self, nu: f64) -> f64 {
        laminar(self.beta, nu, self.omega)
    }
}

/// Shapes with measurements of the first mode's damping; lengths in m.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum Shape {
    /// Upright, with a flat bottom.
    Cylinder {
        radius: f64,
        depth: f64,
    },
    Sphere {
        radius: f64,
        depth: f64,
    },
    /// Apex down, `radius` of the free surface, half angle in degrees.
    Cone {
        radius: f64,
        half_angle: f64,
    },
    /// Axis upright.
    Torus {
        tube_radius: f64,
        depth: f64,
    },
    /// Any other shape.
    Other,
}

/// Estimate of a first mode's damping from a correlation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correlation {
    /// Damping ratio.
    pub zeta: f64,
    /// True within the range of the measurements.
    pub in_range: bool,
}

impl Shape {
    /// Returns the published correlation of the first mode's damping ratio. `g` includes the equivalent of a centring
    /// stiffness.
    ///
    /// Cylinder: Mikishev and Dorozhkin from h/R = 0.5 on. Below, where that falls under the laminar layer, Stephens,
    /// Leonard and Perry.
    pub fn correlation(&self, nu: f64, g: f64) -> Option<Correlation> {
        let (zeta, in_range) = match *self {
            Shape::Cylinder { radius, depth } => (cylinder(radius, depth, nu, g), true),
            Shape::Sphere { radius, depth } => (
                sphere(radius, depth, nu, g),
                (0.1..=1.9).contains(&(depth / radius))
                    && (1e-2..=1.0).contains(&sphere_number(radius, nu, g)),
            ),
            Shape::Cone { radius, half_angle } => {
                (cone(radius, half_angle, nu, g), (0.0..=45.0).contains(&half_angle))
            }
            Shape::Torus { tube_radius, depth } => (
                torus(tube_radius, depth, nu, g),
                (0.1..=0.9).contains(&(0.5 * depth / tube_radius))
                    && (0.1..=10.0).contains(&torus_number(tube_radius, nu, g)),
            ),
            Shape::Other => return None,
        };
        Some(Correlation { zeta, in_range })
    }
}

/// Basis of the damping estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// The shape's correlation, within the range of its measurements.
    Correlation,
    /// [`UNMEASURED`] laminar layers: there is no correlation for the shape.
    Unmeasured,
    /// [`UNMEASURED`] laminar layers: the correlation was not measured there.
    OutOfRange,
    /// [`UNMEASURED`] laminar layers: the correlation is below the laminar layer, the minimum of
    /// any wall.
    BelowLayer,
}

/// A damping ratio and its expected interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Damping ratio.
    pub zeta: f64,
    /// Expected interval of the damping ratio.
    pub interval: [f64; 2],
    /// Damping ratio of the laminar layer alone.
    pub laminar: f64,
    /// Estimate from the correlation of the first mode, if there is one.
    pub correlation: Option<f64>,
    /// Basis of the estimate.
    pub basis: Basis,
    /// True if correlation and [`UNMEASURED`] laminar layers differ by more than the scatter of measured tanks.
    pub disagree: bool,
}

/// Estimates the damping ratio of `mode` of a tank whose first mode is `first`.
///
/// The first mode has its shape's correlation within the range of measurements, otherwise [`UNMEASURED`] laminar
/// layers. Each other mode has the same multiple of its own layer as the first mode. If the correlation agrees with the
/// layers, the interval is the scatter of measured tanks around it. For other modes and other shapes it runs from the
/// layer alone to 1.3 of the larger of both.
pub fn estimate(shape: Shape, nu: f64, first: Mode, mode: Mode) -> Estimate {
    let layers = UNMEASURED * first.laminar(nu);
    let correlation = shape.correlation(nu, first.omega * first.omega / first.lambda);
    let basis = match correlation {
        None => Basis::Unmeasured,
        Some(Correlation { in_range: false, .. }) => Basis::OutOfRange,
        Some(Correlation { zeta, .. }) if zeta < first.laminar(nu) => Basis::BelowLayer,
        Some(_) => Basis::Correlation,
    };
    let published = correlation.map(|correlation| correlation.zeta);
    let taken = published.filter(|_| basis == Basis::Correlation).unwrap_or(layers);
    let (low, high) =
        published.map_or((layers, layers), |zeta| (zeta.min(layers), zeta.max(layers)));
    let disagree = high > (1.0 + SCATTER) * low;
    // The same multiple of its own layer; 0/0 without viscosity.
    let share = if mode == first { 1.0 } else { mode.laminar(nu) / first.laminar(nu) };
    let share = if share.is_finite() { share } else { 1.0 };
    let is_measured = basis == Basis::Correlation && !disagree && mode == first;
    let interval = if is_measured {
        [(1.0 - SCATTER) * taken, (1.0 + SCATTER) * taken]
    } else {
        [first.laminar(nu) * share, (1.0 + SCATTER) * high * share]
    };
    Estimate {
        zeta: taken * share,
        interval,
        laminar: first.laminar(nu) * share,
        correlation: published,
        basis,
        disagree,
    }
}

/// Returns Re = nu/sqrt(g R^3).
pub fn inverse_reynolds(radius: f64, nu: f64, g: f64) -> f64 {
    nu / sqrt(g * radius * radius * radius)
}

/// Returns the damping ratio of the laminar layer at the wetted wall of any tank: beta sqrt(nu/(8 omega)). `beta`, 1/m,
/// depends on the mode's shape (cylinder: Case and Parkinson 1957, box: Keulegan 1959).
pub fn laminar(beta: f64, nu: f64, omega: f64) -> f64 {
    beta * sqrt(nu / (8.0 * omega))
}

/// Returns beta of mode `n` (from 0) of an upright cylinder, 1/m (Case and Parkinson, J. Fluid Mech. 2 (1957) 172):
/// beta R = (xi^2 + 1)/(xi^2 - 1) + 2 xi (1 - x)/sinh(2 xi x).
pub fn cylinder_beta(n: usize, radius: f64, depth: f64) -> f64 {
    let (xi, x) = (XI[n], depth / radius);
    let u = 2.0 * xi * x;
    let shallow = if u > 700.0 { 0.0 } else { 2.0 * xi * (1.0 - x) / sinh(u) };
    ((xi * xi + 1.0) / (xi * xi - 1.0) + shallow) / radius
}

/// Damping ratio of the first mode of an upright cylinder at any depth: [`mikishev_dorozhkin`] from h/R = 0.5 on,
/// [`stephens`] below.
pub fn cylinder(radius: f64, depth: f64, nu: f64, g: f64) -> f64 {
    if depth >= 0.5 * radius {
        mikishev_dorozhkin(radius, depth, nu, g)
    } else {
        stephens(radius, depth, nu, g)
    }
}

/// Damping ratio of the first mode of an upright cylinder at 10 < Bo < 100, where the contact line dissipates more than
/// at large Bond numbers. The formula `0.83 (nu^2/(g R^3))^(1/4) (1 + 8.2 Bo^(-3/5))` is quoted for drop-tower tests
/// (Salzman, Labus and Masica, NASA TN D-4132). We could not obtain the report, so the value is only an upper bound.
pub fn low_bond_cylinder(radius: f64, nu: f64, g: f64, bond: f64) -> f64 {
    0.83 * sqrt(inverse_reynolds(radius, nu, g)) * (1.0 + 8.2 * pow(bond, -0.6))
}

/// Upright cylinder, Mikishev and Dorozhkin (Dodge 2000): 0.79 sqrt(Re) [1 + (0.318/sinh 1.84 x)
/// (1 + (1 - x)/cosh 1.84 x)]. Below x = 0.5 it falls below the laminar layer.
#[allow(clippy::approx_constant)] // 0.318 is the correlation's, not 1/pi
pub fn mikishev_dorozhkin(radius: f64, depth: f64, nu: f64, g: f64) -> f64 {
    let x = depth / radius;
    // sinh would overflow, and the bottom has no effect there.
    let u = f64::min(1.84 * x, 300.0);
    let bottom = 0.318 / sinh(u) * (1.0 + (1.0 - x) / cosh(u));
    0.79 * sqrt(inverse_reynolds(radius, nu, g)) * (1.0 + bottom)
}

/// Upright cylinder, Stephens, Leonard and Perry (NASA TN D-1367), 1.493 times the laminar layer at every depth:
/// `(5.23/2 pi) sqrt(Re) tanh(1.84 x)^(-1/4) [1 + 2 (1 - x)/sinh 3.68 x]`.
pub fn stephens(radius: f64, depth: f64, nu: f64, g: f64) -> f64 {
    let x = depth / radius;
    let bracket = 1.0 + if x > 100.0 { 0.0 } else { 2.0 * (1.0 - x) / sinh(3.68 * x) };
    let zeta = 5.23 / TAU * sqrt(inverse_reynolds(radius, nu, g)) * bracket;
    zeta / pow(tanh(1.84 * x), 0.25)
}

/// Returns B = 1e4 nu/sqrt(g D^3) of a sphere.
pub fn sphere_number(radius: f64, nu: f64, g: f64) -> f64 {
    1e4 * inverse_reynolds(2.0 * radius, nu, g)
}

/// Sphere (after Mikishev and Dorozhkin, exponent of Sumner and Stofan, NASA TN D-1991). Up to half
/// full (0.131/2 pi) B^0.359/x, above times x (1 + 0.46 (2 - x))/(1.46 (2 - x)). The formula is
/// unbounded at both ends, so x is limited to 0.1 to 1.9.
pub fn sphere(radius: f64, depth: f64, nu: f64, g: f64) -> f64 {
    let x = (depth / radius).clamp(0.1, 1.9);
    let by_fill = if x <= 1.0 { 1.0 / x } else { (1.0 + 0.46 * (2.0 - x)) / (1.46 * (2.0 - x)) };
    0.131 / TAU * pow(sphere_number(radius, nu, g), 0.359) * by_fill
}

/// Cone with its apex down, `radius` of the free surface, `half_angle` b in degrees (fit of a
/// figure by SLOSH-ML). (4.964/2 pi) C5 C4^(-1/2) sqrt(Re), C5 = 1.0037 + 0.0126 b, C4 = 1.001 -
/// 0.0031 b - 0.0003 b^2. C4 falls to 0 at 53 degrees, so b is limited to 0 to 45.
pub fn cone(radius: f64, half_angle: f64, nu: f64, g: f64) -> f64 {
    let b = half_angle.clamp(0.0, 45.0);
    let (c5, c4) = (1.0037 + 0.0126 * b, 1.001 - 0.0031 * b - 0.0003 * b * b);
    4.964 / TAU * c5 / sqrt(c4) * sqrt(inverse_reynolds(radius, nu, g))
}

/// Returns Re of a torus over that of the one tank that was measured.
pub fn torus_number(tube_radius: f64, nu: f64, g: f64) -> f64 {
    inverse_reynolds(tube_radius, nu, g) / inverse_reynolds(0.0635, 3.3e-6, 9.81)
}

/// Torus, `tube_radius` a of its section (SLOSH-ML; one tank size was measured). sqrt(Re/Re_0)
/// times (1.6629 y^4 - 3.7955 y^3 + 3.5583 y^2 - 1.6759 y + 0.3865)/2 pi, with y = h/2a. Re_0 =
/// 3.3e-6/sqrt(9.81 0.0635^3).
pub fn torus(tube_radius: f64, depth: f64, nu: f64, g: f64) -> f64 {
    let y = 0.5 * depth / tube_radius;
    let fit = (((1.6629 * y - 3.7955) * y + 3.5583) * y - 1.6759) * y + 0.3865;
    sqrt(torus_number(tube_radius, nu, g)) * fit / TAU
}

/// Returns the part of an upright cylinder's section that a flat ring of `width` at the wall
/// covers.
pub fn covered(radius: f64, width: f64) -> f64 {
    let w = width / radius;
    w * (2.0 - w)
}

/// Returns the share of the surface's motion at a ring `depth` below it in an upright cylinder.
pub fn motion_at_ring(radius: f64, depth: f64) -> f64 {
    // The limit keeps divisions by this share finite.
    exp(-f64::min(1.84 * depth / radius, 100.0))
}

/// Ring baffle in an upright cylinder (Miles 1958): `2.83 exp(-4.60 d/R) alpha^(3/2) (eta/R)^(1/2)`, with the covered
/// area alpha and the `amplitude` eta of the wave at the wall.
///
/// The ratio grows with the root of the amplitude, so a constant damping ratio holds only at one
/// amplitude.
pub fn miles_ring(radius: f64, depth: f64, width: f64, amplitude: f64) -> f64 {
    let alpha = covered(radius, width);
    2.83 * exp(-4.60 * depth / radius) * alpha * sqrt(alpha) * sqrt(amplitude / radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Water in the bench's tank, R = 0.0815 m: Re = 9.1312e-7/sqrt(9.81 R^3); by hand, four digits.
    #[test]
    fn correlations_have_their_published_coefficients() {
        let (r, nu, g) = (0.0815, 9.1312e-7, 9.81);
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-3, "{a} {b}");
        near(inverse_reynolds(r, nu, g), 1.2530e-5);
        // Deep liquid: the bottom has no effect.
        near(mikishev_dorozhkin(r, 5.0 * r, nu, g), 0.79 * 3.5398e-3);
        // x = 1/2: 0.318/sinh 0.92 (1 + 0.5/cosh 0.92) = 0.3018 (1 + 0.3444)
        near(mikishev_dorozhkin(r, 0.5 * r, nu, g), 0.79 * 3.5398e-3 * 1.4057);
        near(stephens(r, 5.0 * r, nu, g), 5.23 / TAU * 3.5398e-3);
        // x = 1: the bracket is 1, tanh(1.84) = 0.95080
        near(stephens(r, r, nu, g), 5.23 / TAU * 3.5398e-3 * 1.01269);
        // Half full, B = 1e4 Re/8^(1/2)
        near(sphere_number(r, nu, g), 4.4300e-2);
        near(sphere(r, r, nu, g), 0.131 / TAU * 0.32660);
        near(sphere(r, 1.5 * r, nu, g), 0.131 / TAU * 0.32660 * 1.23 / 0.73);
        near(cone(r, 30.0, nu, g), 4.964 / TAU * 1.3817 / 0.79875 * 3.5398e-3);
        near(
            torus(0.0635, 0.0635, 3.3e-6, 9.81),
            (((0.83145 - 3.7955) * 0.5 + 3.5583) * 0.25 - 0.83795 + 0.3865) / TAU,
        );
    }

    /// Shallow liquid, where sign and magnitude of every term matter: x = 0.2, 1 and 2. Twelve digits of the published
    /// formula, evaluated by another program.
    #[test]
    fn mikishev_and_dorozhkin_s_bottom_counts_in_shallow_liquid_and_changes_sign_above_the_radius()
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
        // At depths where sinh would overflow, the term vanishes.
        assert_eq!(mikishev_dorozhkin(r, 1e4 * r, nu, g), 0.79 * sqrt(inverse_reynolds(r, nu, g)));
    }

    /// For small x the bottom contributes twice its share: 2 (1 - x)/sinh 3.68 x.
    #[test]
    fn stephens_s_bottom_counts_in_shallow_liquid() {
        let deep = stephens(1.0, 5.0, 1e-6, 9.81);
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
        // x = 1/2: sinh 1.84 = 3.06896, tanh 0.92 = 0.72590
        near(stephens(1.0, 0.5, 1e-6, 9.81) / deep, (1.0 + 1.0 / 3.06896) / pow(0.72590, 0.25));
        // x = 2: sinh 7.36 = 785.92, tanh 3.68 = 0.998729
        near(stephens(1.0, 2.0, 1e-6, 9.81) / deep, (1.0 - 2.0 / 785.92) / pow(0.998729, 0.25));
        near(stephens(1.0, 1e4, 1e-6, 9.81) / deep, 1.0);
    }

    /// A correlation without a stated end is constant beyond its data: for a sphere at 0.1 and 1.9 radii, for a cone at
    /// 0 and 45 degrees.
    #[test]
    fn correlations_without_bound_are_held_at_their_ends() {
        let sphere = |x: f64| sphere(1.0, x, 1e-6, 9.81);
        assert_eq!((sphere(0.01), sphere(1.99)), (sphere(0.1), sphere(1.9)));
        assert!(sphere(0.11) < sphere(0.1) && sphere(1.89) != sphere(1.9));
        // full to 1.9 radii: (1 + 0.046)/0.146 of half full
        assert!((sphere(1.9) / sphere(1.0) / (1.046 / 0.146) - 1.0).abs() < 1e-12);
        let cone = |b: f64| cone(1.0, b, 1e-6, 9.81);
        assert_eq!((cone(-5.0), cone(60.0)), (cone(0.0), cone(45.0)));
        // b = 20 and 40 degrees: C5 1.2557 and 1.5077, C4 0.819 and 0.397
        let both = cone(40.0) / cone(20.0);
        assert!((both / (1.5077 / 1.2557 * sqrt(0.819 / 0.397)) - 1.0).abs() < 1e-12, "{both}");
    }

    /// y = 1, full: the sum of the coefficients. Another tank follows from the measured tank's Re
    /// by its root.
    #[test]
    fn the_torus_has_its_fit_and_grows_with_the_root_of_its_number() {
        let full = torus(0.0635, 2.0 * 0.0635, 3.3e-6, 9.81);
        assert!((full * TAU / (1.6629 - 3.7955 + 3.5583 - 1.6759 + 0.3865) - 1.0).abs() < 1e-12);
        assert!((torus_number(0.0635, 3.3e-6, 9.81) - 1.0).abs() < 1e-15);
        assert!((torus(4.0 * 0.0635, 8.0 * 0.0635, 8.0 * 3.3e-6, 9.81) / full - 1.0).abs() < 1e-14);
        let quarter = torus(0.0635, 0.5 * 0.0635, 4.0 * 3.3e-6, 9.81);
        let fit = 1.6629 / 256.0 - 3.7955 / 64.0 + 3.5583 / 16.0 - 1.6759 / 4.0 + 0.3865;
        assert!((quarter * TAU / (2.0 * fit) - 1.0).abs() < 1e-12);
    }

    /// alpha = 0.19 at w/R = 0.1; by hand, four digits.
    #[test]
    fn the_ring_has_the_damping_of_miles() {
        let zeta = miles_ring(1.0, 0.1, 0.1, 0.04);
        assert!((zeta / (2.83 * 0.63128 * 0.082819 * 0.2) - 1.0).abs() < 1e-4, "{zeta}");
        assert!((motion_at_ring(2.0, 0.2) / 0.83194 - 1.0).abs() < 1e-4);
        // Four times the wave has twice the damping. Doubling all lengths changes nothing.
        assert!((miles_ring(1.0, 0.1, 0.1, 0.16) / zeta - 2.0).abs() < 1e-14);
        assert!((miles_ring(2.0, 0.2, 0.2, 0.08) / zeta - 1.0).abs() < 1e-14);
        assert!((covered(2.0, 0.2) - 0.19).abs() < 1e-15);
        assert_eq!(motion_at_ring(1.0, 1e9), motion_at_ring(1.0, 1e6));
        assert!(motion_at_ring(1.0, 1e9) > 0.0);
    }

    /// beta = 10/m, nu = 8e-6 m2/s, omega = 4 rad/s: 10 sqrt(2.5e-7).
    #[test]
    fn the_laminar_layer_grows_with_the_root_of_viscosity() {
        assert!((laminar(10.0, 8e-6, 4.0) - 5e-3).abs() < 1e-17);
    }

    /// In waves as deep as the radius the bottom's bracket vanishes. At half the radius xi/sinh xi matters, and the
    /// next mode has its own zero.
    #[test]
    fn a_cylinder_s_modes_rub_at_their_own_rate() {
        for n in [0, 1] {
            let xi = XI[n];
            let wide = (xi * xi + 1.0) / (xi * xi - 1.0);
            for (depth, beta) in [(2.0, wide), (1.0, wide + xi / sinh(xi)), (1e4, wide)] {
                let mode = Mode::of_cylinder(n, 2.0, depth, 3.0);
                assert!((mode.beta * 2.0 / beta - 1.0).abs() < 1e-15, "{n} {depth}");
                assert_eq!(mode.beta, cylinder_beta(n, 2.0, depth));
                let lambda = 0.5 * xi * tanh(0.5 * xi * depth);
                assert!((mode.lambda / lambda - 1.0).abs() < 1e-15, "{n} {depth}");
                assert!((mode.omega * mode.omega / (3.0 * lambda) - 1.0).abs() < 1e-15, "{n}");
            }
        }
        // x = 2: 1 - x is -1
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

    /// 8.2 (32)^(-3/5) = 8.2/8; nu^2/(g R^3) = 1e-8/4: its fourth root is 0.01/2^(1/2).
    #[test]
    fn a_low_bond_number_adds_its_contact_line() {
        let zeta = low_bond_cylinder(1.0, 1e-4, 4.0, 32.0);
        assert!(
            (zeta / (0.83 * 0.01 / sqrt(2.0) * (1.0 + 8.2 / 8.0)) - 1.0).abs() < 1e-14,
            "{zeta}"
        );
    }

    /// Depth, angle and viscosity number, each just inside and just outside the measured range.
    #[test]
    fn a_correlation_says_where_it_was_measured() {
        let (r, g) = (2.0, 9.81);
        let in_range =
            |shape: Shape, nu: f64| shape.correlation(nu, g).map(|found| found.in_range).unwrap();
        let sphere = |x: f64| Shape::Sphere { radius: r, depth: x * r };
        let nu = 0.1 / sphere_number(r, 1.0, g);
        assert_eq!(
            [0.09, 0.11, 1.89, 1.91].map(|x| in_range(sphere(x), nu)),
            [false, true, true, false]
        );
        let numbers = [0.0099, 0.0101, 0.99, 1.01].map(|b| in_range(sphere(1.0), 10.0 * b * nu));
        assert_eq!(numbers, [false, true, true, false]);
        let cone = |half_angle: f64| Shape::Cone { radius: r, half_angle };
        assert_eq!([44.9, 45.1].map(|b| in_range(cone(b), nu)), [true, false]);
        let torus = |y: f64| Shape::Torus { tube_radius: r, depth: 2.0 * y * r };
        let nu = 1.0 / torus_number(r, 1.0, g);
        assert_eq!(
            [0.09, 0.11, 0.89, 0.91].map(|y| in_range(torus(y), nu)),
            [false, true, true, false]
        );
        let numbers = [0.099, 0.101, 9.9, 10.1].map(|times| in_range(torus(0.5), times * nu));
        assert_eq!(numbers, [false, true, true, false]);
        assert!(in_range(Shape::Cylinder { radius: r, depth: 0.01 }, 1.0));
        assert_eq!(Shape::Other.correlation(nu, g), None);
        // the value is the shape's formula
        let zeta = |shape: Shape| shape.correlation(nu, g).unwrap().zeta;
        assert_eq!(zeta(sphere(0.7)), super::sphere(r, 0.7 * r, nu, g));
        assert_eq!(zeta(cone(20.0)), super::cone(r, 20.0, nu, g));
        assert_eq!(zeta(torus(0.3)), super::torus(r, 0.6 * r, nu, g));
        assert_eq!(zeta(Shape::Cylinder { radius: r, depth: r }), cylinder(r, r, nu, g));
    }

    /// Returns a mode with the damping ratio `zeta` of its layer alone and the length of a half
    /// full sphere of 1 m.
    fn with_layer(zeta: f64, nu: f64, omega: f64) -> Mode {
        Mode { beta: zeta / sqrt(nu / (8.0 * omega)), lambda: 1.56, omega }
    }

    fn is_near(found: [f64; 3], expected: [f64; 3]) {
        for (a, b) in found.into_iter().zip(expected) {
            assert!((a / b - 1.0).abs() < 1e-14, "{found:?} {expected:?}");
        }
    }

    fn numbers(estimate: Estimate) -> [f64; 3] {
        [estimate.zeta, estimate.interval[0], estimate.interval[1]]
    }

    /// The first mode of a measured shape has the correlation and its scatter; the second has the same multiple of its
    /// own layer.
    #[test]
    fn a_measured_shape_has_its_correlation_and_other_modes_as_many_layers() {
        let (nu, shape) = (1e-6, Shape::Cylinder { radius: 1.0, depth: 1.0 });
        let [first, second] = [0, 1].map(|n| Mode::of_cylinder(n, 1.0, 1.0, 9.81));
        let correlation = cylinder(1.0, 1.0, nu, 9.81);
        let found = estimate(shape, nu, first, first);
        assert_eq!((found.basis, found.disagree), (Basis::Correlation, false));
        is_near(numbers(found), [correlation, 0.7 * correlation, 1.3 * correlation]);
        assert_eq!(found.laminar, first.laminar(nu));
        let layers = second.laminar(nu) / first.laminar(nu);
        let found = estimate(shape, nu, first, second);
        // the larger of layers and correlation: 1.45 layers of the first mode, or 1.39
        let high = correlation.max(1.45 * first.laminar(nu));
        is_near(numbers(found), [correlation * layers, second.laminar(nu), 1.3 * high * layers]);
        assert!((found.laminar / second.laminar(nu) - 1.0).abs() < 1e-14);
        // without viscosity no mode has damping
        assert_eq!(numbers(estimate(shape, 0.0, first, second)), [0.0; 3]);
    }

    /// The correlation uses the specific force with the same frequency, omega^2/lambda, which includes capillarity.
    #[test]
    fn a_correlation_holds_at_the_force_that_makes_the_frequency() {
        let shape = Shape::Cylinder { radius: 1.0, depth: 1.0 };
        let first = Mode { omega: 3.0, ..Mode::of_cylinder(0, 1.0, 1.0, 9.81) };
        let correlation = cylinder(1.0, 1.0, 1e-6, 9.0 / first.lambda);
        assert_eq!(estimate(shape, 1e-6, first, first).correlation, Some(correlation));
    }

    /// Without a correlation, outside its measurements, and if it is below the layer, the estimate is 1.45 layers, up
    /// to 1.3 of the larger of both.
    #[test]
    fn what_was_not_measured_has_1_45_layers() {
        let (nu, omega) = (1e-6, 4.0);
        let mode = with_layer(1e-3, nu, omega);
        let other = estimate(Shape::Other, nu, mode, mode);
        assert_eq!((other.basis, other.correlation), (Basis::Unmeasured, None));
        is_near(numbers(other), [1.45e-3, 1e-3, 1.3 * 1.45e-3]);
        assert!(!other.disagree);
        let g = omega * omega / mode.lambda;
        // too little viscosity for the measured spheres
        let shape = Shape::Sphere { radius: 1.0, depth: 1.0 };
        let zeta = sphere(1.0, 1.0, nu, g);
        for (layer, high, disagree) in [(zeta / 3.0, zeta, true), (zeta, 1.45 * zeta, true)] {
            let mode = with_layer(layer, nu, omega);
            let found = estimate(shape, nu, mode, mode);
            assert_eq!((found.basis, found.disagree), (Basis::OutOfRange, disagree));
            is_near(numbers(found), [1.45 * layer, layer, 1.3 * high]);
        }
        // measured, but below the minimum of one layer
        let nu = 0.1 / sphere_number(1.0, 1.0, g);
        let zeta = sphere(1.0, 1.0, nu, g);
        for (share, basis) in [(1.01, Basis::BelowLayer), (0.99, Basis::Correlation)] {
            let mode = with_layer(share * zeta, nu, omega);
            let found = estimate(shape, nu, mode, mode);
            assert_eq!(found.basis, basis);
            let taken = if share > 1.0 { 1.45 * share * zeta } else { zeta };
            is_near(numbers(found), [taken, share * zeta, 1.3 * 1.45 * share * zeta]);
        }
    }

    /// The test covers differences above 30 % in both directions.
    #[test]
    fn two_estimates_disagree_by_more_than_the_scatter() {
        let (nu, omega) = (1e-6, 4.0);
        let g = omega * omega / 1.56;
        let nu = nu * 0.1 / sphere_number(1.0, nu, g);
        let shape = Shape::Sphere { radius: 1.0, depth: 1.0 };
        let zeta = sphere(1.0, 1.0, nu, g);
        for (ratio, disagree) in
            [(1.29, false), (1.31, true), (1.0 / 1.29, false), (1.0 / 1.31, true)]
        {
            let mode = with_layer(zeta / (1.45 * ratio), nu, omega);
            let found = estimate(shape, nu, mode, mode);
            assert_eq!((found.basis, found.disagree), (Basis::Correlation, disagree), "{ratio}");
            let low = if disagree { mode.laminar(nu) } else { 0.7 * zeta };
            let high = if disagree { 1.3 * zeta.max(1.45 * mode.laminar(nu)) } else { 1.3 * zeta };
            is_near(numbers(found), [zeta, low, high]);
        }
    }
}
