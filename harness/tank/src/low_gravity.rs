//! Capillarity: exact for a flat surface with a free contact line, from a table for the curved meniscus of a cylinder.
//!
//! The pendulum's length l_n stays 1/lambda_n, which follows from the geometry, and is not g/omega^2. Capillarity adds a
//! centring spring k_s = m_n (omega_n^2 - g lambda_n) at the slosh mass, or equivalently a torsion spring k_s l_n^2 at the
//! hinge. At g = 0 only this spring restores the liquid. Masses and heights are computed for a flat surface, because they
//! are unknown for a curved one.

use crate::interpolation::Monotone;
use crate::modal::Mode;

/// Properties of a liquid: density `rho`, kg/m³; surface tension `sigma`, N/m; specific force `g`
/// along the axis, m/s².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluid {
    pub rho: f64,
    pub sigma: f64,
    pub g: f64,
}

impl Fluid {
    pub fn bond(&self, radius: f64) -> f64 {
        self.rho * self.g * radius * radius / self.sigma
    }
}

/// A mode with capillarity.
///
/// - `omega2`: square of the natural frequency, 1/s².
/// - `spring`: stiffness that surface tension adds at the slosh mass, N/m, which is slightly
///   negative for a wetting liquid at a large Bond number.
/// - `outside`: a sentence for each range of validity of the formula that the tank leaves.
/// - `unknown`: true if the formula does not apply to this tank and its contribution exceeds 10 %
///   of omega^2.
#[derive(Clone, Debug, PartialEq)]
pub struct Capillary {
    pub omega2: f64,
    pub spring: f64,
    pub outside: Vec<String>,
    pub unknown: bool,
}

/// Largest contribution of capillarity to omega^2, relative to gravity, at which the formula for a
/// flat surface is used for a mode whose shape is changed by capillarity.
const LARGEST_SHARE: f64 = 0.1;

/// Returns the specific force, m/s², below which the formula for a flat surface ([`flat`]) is not
/// valid for a mode whose shape is changed by capillarity. `tension` is the surface tension divided
/// by the density, m³/s².
pub fn least_gravity(mode: &Mode, tension: f64) -> f64 {
    tension * mode.surface_gradient / LARGEST_SHARE
}

/// Computes the effect of surface tension on a mode for a flat surface (contact angle 90 degrees)
/// whose contact line slides freely along a vertical wall. The squared frequency is omega_n^2 = g
/// lambda_n [1 + (sigma/(rho g)) K_n] with the surface gradient K_n = int_F (phi_r^2 + phi^2/r^2) r
/// dr/int_F phi^2 r dr of the mode's shape phi on the free surface F. This is exact in cylinders,
/// annuli (K = k^2) and boxes, because capillarity does not change the shape there. In other tanks
/// it is of first order.
pub fn flat(mode: &Mode, fluid: Fluid) -> Capillary {
    let added = fluid.sigma / fluid.rho * mode.lambda * mode.surface_gradient;
    let gravity = fluid.g * mode.lambda;
    let unknown = !mode.upright && added > LARGEST_SHARE * gravity;
    let mut outside = Vec::new();
    if !mode.vertical_wall {
        outside.push(
            "the wall is not vertical at the free surface, and no formula is known for a free contact line at such a wall"
                .to_string(),
        );
    }
    if unknown && fluid.g > 0.0 {
        outside.push(format!(
            "surface tension adds {:.0} % to omega^2, too much for a computation to first order",
            100.0 * added / gravity
        ));
    } else if unknown {
        outside.push(
            "without gravity all of omega^2 comes from surface tension, too much for a computation to first order"
                .into(),
        );
    }
    Capillary { omega2: gravity + added, spring: mode.m * added, outside, unknown }
}

const XI: f64 = formulas::cylinder::XI[0];
const BOND: [f64; 6] = [0.0, 1.0, 3.0, 10.0, 30.0, 100.0];
const ANGLE: [f64; 7] = [90.0, 75.0, 60.0, 45.0, 30.0, 15.0, 5.0];
/// Squared frequency of the first mode of a deep cylinder with a curved meniscus, constant contact
/// angle and free contact line: omega_1^2 rho R^3/sigma for the Bond numbers `BOND` (rows) and the
/// contact angles `ANGLE`, degrees (columns). The values come from the capillary eigenproblem on
/// the static meniscus, whose error is 1e-6 where the exact result is known; they are rounded to
/// the digits given.
const TABLE: [[f64; 7]; 6] = [
    [6.2415, 5.7952, 5.2173, 4.5463, 3.8352, 3.1642, 2.8263],
    [8.0827, 7.5726, 6.9609, 6.2873, 5.6101, 5.0195, 4.7587],
    [11.7651, 11.1455, 10.4694, 9.7758, 9.1234, 8.5985, 8.3903],
    [24.6534, 23.7732, 22.9150, 22.1195, 21.4397, 20.9474, 20.7733],
    [61.4770, 60.2668, 59.1301, 58.1264, 57.3171, 56.7705, 56.5911],
    [190.3599, 188.8619, 187.4498, 186.2136, 185.2381, 184.6017, 184.4012],
];

/// Returns the squared frequency omega_1^2 rho R^3/sigma of the first mode of a deep upright
/// cylinder, for the Bond number `bond` and the contact angle `contact_angle`, degrees.
pub fn cylinder_omega2(bond: f64, contact_angle: f64) -> f64 {
    flat_omega2(bond) + meniscus_shift(bond, contact_angle)
}

fn flat_omega2(bond: f64) -> f64 {
    XI * bond + XI.powi(3)
}

/// Returns the change of the squared frequency omega_1^2 rho R^3/sigma by a curved meniscus. The
/// table is interpolated in cos(angle) and ln(1 + Bo), so that the change is exactly 0 at 90
/// degrees. Above Bo = 100 the change approaches its limit -2 xi^2 cos(angle) as 1/Bo, which follows
/// from the shape derivative of the eigenvalue.
fn meniscus_shift(bond: f64, contact_angle: f64) -> f64 {
    let cosine = |angle: f64| if angle == 90.0 { 0.0 } else { angle.to_radians().cos() };
    let cos = cosine(contact_angle);
    // ascending cosines, that is falling angles; at 90 degrees the shift is exactly 0
    let cosines = ANGLE.map(cosine);
    let at_row = |row: usize| {
        let difference: Vec<f64> = (0..7)
            .map(|k| if k == 0 { 0.0 } else { TABLE[row][k] - flat_omega2(BOND[row]) })
            .collect();
        let [c5, c6] = [cosines[5], cosines[6]];
        // From 5 to 0 degrees the cosine changes by 0.4 %: linear extrapolation.
        if cos > c6 {
            return difference[6] + (difference[6] - difference[5]) * (cos - c6) / (c6 - c5);
        }
        Monotone::new(&cosines, &difference).evaluate(cos)
    };
    if bond > BOND[5] {
        let limit = -2.0 * XI * XI * cos;
        return limit + (at_row(5) - limit) * BOND[5] / bond;
    }
    let places: Vec<f64> = BOND.iter().map(|b| b.ln_1p()).collect();
    let values: Vec<f64> = (0..6).map(at_row).collect();
    Monotone::new(&places, &values).evaluate(bond.ln_1p())
}

/// Computes the first mode of an upright cylinder with a curved meniscus. `radius` and the fill
/// `fill` are in m, `contact_angle` in degrees. The change by the meniscus in a deep cylinder,
/// times tanh(xi h/R) for the depth, is added to the result of [`flat`]. At 90 degrees, and without
/// surface tension, the result is exactly the result of [`flat`]. An angle below 0 degrees is
/// treated as 0 degrees, an angle above 90 degrees as 90 degrees.
pub fn cylinder(
    mode: &Mode,
    radius: f64,
    fill: f64,
    contact_angle: f64,
    fluid: Fluid,
) -> Capillary {
    // 0/0 without gravity and surface tension. The value has no effect below.
    let bond = fluid.bond(radius);
    let Capillary { omega2, spring, mut outside, unknown } = flat(mode, fluid);
    if !(0.0..=90.0).contains(&contact_angle) {
        let nearest = contact_angle.clamp(0.0, 90.0);
        outside.push(format!(
            "no formula is known for a contact angle of {contact_angle} degrees; {nearest} degrees are used"
        ));
    }
    if bond < 0.0 {
        outside.push(format!("the Bond number {bond:.3e} is below 0; 0 is used"));
    }
    if fill < radius && contact_angle < 90.0 && bond < 100.0 {
        outside
            .push("the meniscus was computed for deep liquid, with h/R of 1 or more".to_string());
    }
    let scale = fluid.sigma / (fluid.rho * radius.powi(3)) * (XI * fill / radius).tanh();
    let curved = scale * meniscus_shift(bond.max(0.0), contact_angle.clamp(0.0, 90.0));
    Capillary { omega2: omega2 + curved, spring: spring + mode.m * curved, outside, unknown }
}
