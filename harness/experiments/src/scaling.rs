//! Similarity of a bench and a flight tank: Bond numbers, the flight tank with the same Bond number as the
//! bench, and the factors of Froude similarity. Sources: `formulas::similarity`; Rubaga's thesis 2.5, 2.6 and
//! 7.2, with corrected numbers.
//!
//! There are two different Bond numbers of an angular acceleration: Bo_i with the distance from the axis, and Bo_r with
//! the radius only. The thesis's 45.87 is Bo_i of its bench, but its equivalent tank was computed from Bo_r.

use std::fmt::Write;

use anyhow::{Result, ensure};
use serde::Serialize;
use serde_json::{Value, json};

use formulas::similarity::{self, Liquid, agility, froude_viscosity, regime};

use crate::rounding::significant;

pub const WATER: Liquid = Liquid { density: 997.0, tension: 0.072 };
pub const ROUND_WATER: Liquid = Liquid { density: 1000.0, tension: 0.072 };
/// Liquid oxygen at its boiling point, 90 K (the thesis says -200 degC).
pub const OXYGEN: Liquid = Liquid { density: 1141.0, tension: 0.0132 };
/// Radius of the bench's tank and its distance from the axis, m.
pub const BENCH: (f64, f64) = (0.0815, 0.225);

fn positive(values: &[(&str, f64)]) -> Result<()> {
    let wrong: Vec<String> = values
        .iter()
        .filter(|(_, x)| !(x.is_finite() && *x > 0.0))
        .map(|(name, x)| format!("{name} = {x}"))
        .collect();
    ensure!(wrong.is_empty(), "{} (allowed: positive numbers)", wrong.join(", "));
    Ok(())
}

/// Results as text and, with the same numbers in SI units, as JSON.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    pub text: String,
    pub json: Value,
}

/// Quantity of the full-size tank in flight that the user knows: its radius, m, or its acceleration, m/s² or rad/s².
/// The other one is computed from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Flight {
    Radius(f64),
    Acceleration(f64),
}

/// Computes the Bond number of the liquid `bench` at the acceleration `a` (m/s²) in a tank of `radius` (m). If `flight`
/// is the radius or the acceleration of a tank with the other `liquid`, also computes the acceleration or the radius at
/// which this tank has the same Bond number.
///
/// # Errors
/// If a value is not positive.
pub fn bond(
    bench: Liquid,
    (a, radius): (f64, f64),
    liquid: Liquid,
    flight: Option<Flight>,
) -> Result<Found> {
    positive(&[
        ("density", bench.density),
        ("tension", bench.tension),
        ("acceleration", a),
        ("radius", radius),
        ("flight density", liquid.density),
        ("flight tension", liquid.tension),
    ])?;
    let bond = bench.bond(a, radius);
    let mut text = format!("Bond number {bond:.4}: {}\n", regime(bond));
    let mut json = json!({ "bond": bond, "regime": regime(bond) });
    match flight {
        Some(Flight::Radius(r)) => {
            positive(&[("flight radius", r)])?;
            let same = liquid.acceleration(bond, r);
            json["flight"] = json!({ "radius": r, "acceleration": same });
            writeln!(
                text,
                "a tank of radius {r} m has it at an acceleration of {} m/s2",
                significant(same, 7)
            )?;
        }
        Some(Flight::Acceleration(g)) => {
            positive(&[("flight acceleration", g)])?;
            let same = liquid.radius(bond, g);
            json["flight"] = json!({ "radius": same, "acceleration": g });
            writeln!(text, "at an acceleration of {g} m/s2 a tank of radius {same:.6} m has it")?;
        }
        None => {}
    }
    Ok(Found { text, json })
}

/// Computes Bond, Weber and Froude numbers of a liquid that moves at `velocity` (m/s), and names the dominant force.
/// Also computes the time scales of gravity and of surface tension for this radius (thesis 2.28, 2.29).
///
/// # Errors
/// If a value is not positive.
pub fn numbers(liquid: Liquid, (a, radius): (f64, f64), velocity: f64) -> Result<Found> {
    positive(&[
        ("density", liquid.density),
        ("tension", liquid.tension),
        ("acceleration", a),
        ("radius", radius),
        ("velocity", velocity),
    ])?;
    let (bond, weber) = (liquid.bond(a, radius), liquid.weber(velocity, radius));
    let froude = similarity::froude_number(velocity, a, radius);
    let (by_gravity, by_tension) =
        (similarity::gravity_time(a, radius), liquid.capillary_time(radius));
    let rules = similarity::ruling_force(bond, weber);
    let text = format!(
        "Bond   rho a R^2/sigma   {}\nWeber  rho V^2 R/sigma   {}\nFroude V^2/(a R)         {}\n\
         {rules}\n\
         time of gravity sqrt(R/a) {} s, of surface tension sqrt(rho R^3/sigma) {} s\n",
        significant(bond, 5),
        significant(weber, 5),
        significant(froude, 5),
        significant(by_gravity, 5),
        significant(by_tension, 5),
    );
    let json = json!({
        "bond": bond,
        "weber": weber,
        "froude": froude,
        "rules": rules,
        "regime": regime(bond),
        "gravity_time": by_gravity,
        "capillary_time": by_tension,
    });
    Ok(Found { text, json })
}

/// Computes the bench's rotational Bond numbers at the angular acceleration `alpha` (rad/s²) and rate `omega` (rad/s),
/// and the flight tanks that have the same numbers at the angular acceleration `target`, rad/s².
///
/// # Errors
/// If a value is not positive.
pub fn rotation(
    liquid: Liquid,
    (radius, arm): (f64, f64),
    (alpha, omega): (f64, Option<f64>),
    target: f64,
) -> Result<Found> {
    let omega_2 = omega.map_or(1.0, |w| w * w);
    positive(&[
        ("density", liquid.density),
        ("tension", liquid.tension),
        ("radius", radius),
        ("arm", arm),
        ("alpha", alpha),
        ("omega squared", omega_2),
        ("flight alpha", target),
    ])?;
    let by_arm = liquid.rotational_bond(alpha, radius, arm);
    let by_radius = liquid.rotational_bond(alpha, radius, radius);
    let same_arm = liquid.radius(by_arm, target * arm);
    let cube = liquid.radius_by_cube(by_radius, target);
    let mut text = format!(
        "Bo_i = rho alpha R^2 L/sigma = {by_arm:.4}: {}\n\
         Bo_r = rho alpha R^3/sigma   = {by_radius:.4}: {}\n",
        regime(by_arm),
        regime(by_radius)
    );
    let number = |bond: f64| json!({ "bond": bond, "regime": regime(bond) });
    let mut json = json!({
        "Bo_i": number(by_arm),
        "Bo_r": number(by_radius),
        "flight_alpha": target,
        "diameter_by_Bo_i": 2.0 * same_arm,
        "diameter_by_Bo_r": 2.0 * cube,
    });
    if let Some(w) = omega {
        let bond = liquid.rotational_bond(w * w, radius, arm);
        json["Bo_c"] = number(bond);
        writeln!(text, "Bo_c = rho omega^2 R^2 L/sigma = {bond:.4}: {}", regime(bond))?;
    }
    writeln!(text, "at {target} rad/s2 ({}) the same has a tank of diameter", agility(target))?;
    writeln!(text, "  {:.4} m by Bo_i, at the same distance from the axis", 2.0 * same_arm)?;
    writeln!(text, "  {:.4} m by Bo_r (R^3, distance and radius scaled together)", 2.0 * cube)?;
    Ok(Found { text, json })
}

/// Computes the factors of Froude similarity (the thesis's Table 2.3) from the ratios of length, density and gravity
/// between full size and model.
///
/// # Errors
/// If a ratio is not positive, or a factor overflows.
pub fn froude(lambda: f64, density: f64, gravity: f64) -> Result<Found> {
    positive(&[("lambda", lambda), ("density ratio", density), ("gravity ratio", gravity)])?;
    let factors = similarity::froude(lambda, density, gravity);
    ensure!(
        factors.iter().all(|(_, _, factor)| factor.is_finite() && *factor > 0.0),
        "lambda = {lambda:?}, density ratio = {density:?}, gravity ratio = {gravity:?}: some factors are \
         beyond the range of numbers"
    );
    let mut text = String::from("full size = factor x model\n");
    let (viscosity, tension) = (froude_viscosity(lambda, gravity), lambda * lambda * gravity);
    let named = factors.iter().map(|(name, _, factor)| (name.to_string(), json!(factor)));
    let json = json!({
        "factors": named.collect::<serde_json::Map<_, _>>(),
        "viscosity_for_reynolds": viscosity,
        "tension_over_density_for_bond": tension,
    });
    for (name, unit, factor) in factors {
        writeln!(text, "{name:22}{unit:8}{}", significant(factor, 7))?;
    }
    writeln!(
        text,
        "not kept: Reynolds' number, unless the full size's viscosity nu is {viscosity:.4} times the model's; \
         Bond's, unless its sigma/rho is {tension:.4} times the model's"
    )?;
    Ok(Found { text, json })
}

/// A number of the thesis's scaling: section and name, the value as printed, the value that follows from the thesis's
/// own data with its unit, and the reason for a difference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    pub what: &'static str,
    pub printed: &'static str,
    pub value: f64,
    pub unit: &'static str,
    pub remark: &'static str,
}

/// Recomputes the numbers of the thesis's section 7.2 and their intermediate results.
pub fn thesis() -> Vec<Comparison> {
    let compared =
        |what, printed, value, unit, remark| Comparison { what, printed, value, unit, remark };
    let (radius, arm) = BENCH;
    let bond = WATER.bond(9.81, radius);
    let flight = 0.005; // rad/s2
    let rotation = |alpha: f64| {
        let by_arm = ROUND_WATER.rotational_bond(alpha, radius, arm);
        let by_radius = ROUND_WATER.rotational_bond(alpha, radius, radius);
        let cube = 2.0 * ROUND_WATER.radius_by_cube(by_radius, flight);
        let mixed = 2.0 * ROUND_WATER.radius_by_cube(by_arm, flight);
        let same_arm = 2.0 * ROUND_WATER.radius(by_arm, flight * arm);
        (by_arm, by_radius, cube, mixed, same_arm)
    };
    let (arm_250, radius_250, cube_250, mixed_250, same_250) = rotation(2.21);
    let (arm_12, radius_12, cube_12, ..) = rotation(0.222);
    vec![
        compared("7.2.1 Bond number of the bench", "902.3", bond, "", ""),
        compared(
            "5.1.2 Bond number of the 0.111 m tank",
            "420",
            WATER.bond(9.81, 0.0555),
            "",
            "420 is rounded",
        ),
        compared(
            "8.2.2 diameter at Bo = 30",
            "below roughly 5 cm",
            2.0 * WATER.radius(30.0, 9.81),
            "m",
            "the radius is the length",
        ),
        compared(
            "7.2.1 acceleration of a 2.0425 m tank of oxygen",
            "0.002502",
            OXYGEN.acceleration(bond, 2.0425),
            "m/s2",
            "at 90 K, not at -200 degC",
        ),
        compared(
            "7.2.1 a_main",
            "147000/18000 = 7.8191",
            147_000.0 / 18_800.0,
            "m/s2",
            "the mass is 18800 kg",
        ),
        compared("7.2.1 a_RCS", "0.0025", 4.4 * 6.0 / 10_450.0, "m/s2", ""),
        compared("7.2.2 0.25 N m, Bo_i (R^2 L)", "45.87 as Bo_r", arm_250, "", "it is eq. 2.25's"),
        compared("7.2.2 0.25 N m, Bo_r (R^3)", "45.87", radius_250, "", "eq. 7.3 gives this"),
        compared("7.2.2 0.25 N m, D by R^3", "1.2416", cube_250, "m", "follows from Bo_r"),
        compared(
            "7.2.2 0.25 N m, D by 45.87 in R^3",
            "1.2416",
            mixed_250,
            "m",
            "what 45.87 would give",
        ),
        compared("7.2.2 0.25 N m, D by R^2 L", "-", same_250, "m", "at the same arm"),
        compared("7.2.2 0.0125 N m, Bo_i (R^2 L)", "4.62", arm_12, "", ""),
        compared("7.2.2 0.0125 N m, Bo_r (R^3)", "4.62", radius_12, "", "eq. 7.3 gives this"),
        compared("7.2.2 0.0125 N m, D by R^3", "0.5778", cube_12, "m", ""),
    ]
}

pub fn thesis_found() -> Found {
    let json = json!(thesis());
    let line = |f: Comparison| {
        let value = format!("{:.6} {}", f.value, f.unit);
        format!("{:50} {:24} {value:22} {}\n", f.what, f.printed, f.remark)
    };
    let head = format!("{:50} {:24} {:22} {}\n", "figure", "printed", "computed", "remark");
    Found { text: head + &thesis().into_iter().map(line).collect::<String>(), json }
}

#[cfg(test)]
mod tests {
    use super::{BENCH, OXYGEN, WATER, bond, thesis};
    use formulas::similarity::Liquid;
    use formulas::similarity::froude;

    fn figure(what: &str) -> f64 {
        thesis().into_iter().find(|f| f.what.starts_with(what)).expect(what).value
    }

    /// Each value of section 7.2 of the thesis, corrected where the thesis is wrong, is reproduced to half a unit of
    /// its last printed digit.
    #[test]
    fn numbers_of_the_thesis_are_reproduced_with_their_corrections() {
        for (what, known, digit) in [
            ("7.2.1 Bond number", 902.3, 0.05),
            ("5.1.2", 418.4, 0.05),
            ("8.2.2", 0.0297, 5e-5),
            ("7.2.1 acceleration", 0.002502, 5e-7),
            ("7.2.1 a_main", 7.8191, 5e-5),
            ("7.2.1 a_RCS", 0.00253, 5e-6),
            ("7.2.2 0.25 N m, Bo_i", 45.87, 5e-3),
            ("7.2.2 0.25 N m, Bo_r", 16.62, 5e-3),
            ("7.2.2 0.25 N m, D by R^3", 1.2416, 1e-4), // printed with alpha rounded
            ("7.2.2 0.25 N m, D by 45.87", 1.742, 5e-4),
            ("7.2.2 0.25 N m, D by R^2", 3.43, 5e-3),
            ("7.2.2 0.0125 N m, Bo_i", 4.608, 5e-4),
            ("7.2.2 0.0125 N m, Bo_r", 1.669, 5e-4),
            ("7.2.2 0.0125 N m, D", 0.5772, 5e-5),
        ] {
            assert!((figure(what) - known).abs() <= digit, "{what}: {} not {known}", figure(what));
        }
    }

    /// A flight tank of oxygen that is computed from the Bond number of the bench with water has the same Bond number.
    #[test]
    fn the_equivalent_tank_has_the_bench_s_bond_number() {
        let same = WATER.bond(9.81, BENCH.0);
        let g = OXYGEN.acceleration(same, 2.0425);
        // the limit is the rounding error of a few products
        assert!((OXYGEN.bond(g, 2.0425) / same - 1.0).abs() < 1e-14);
        assert!((OXYGEN.radius(same, g) / 2.0425 - 1.0).abs() < 1e-14);
        let cube = OXYGEN.rotational_bond(0.3, 0.7, 0.7);
        assert!((OXYGEN.radius_by_cube(cube, 0.3) / 0.7 - 1.0).abs() < 1e-14);
    }

    #[test]
    fn froude_factors_equal_those_of_table_2_3_and_keep_the_froude_number() {
        let (lambda, density) = (4.0, 1.2);
        let factors = froude(lambda, density, 1.0);
        let factor = |name: &str| factors.iter().find(|f| f.0 == name).expect(name).2;
        assert_eq!(factor("time"), 2.0);
        assert_eq!(factor("acceleration"), 1.0);
        assert_eq!(factor("mass"), 64.0 * density);
        assert_eq!(factor("force"), 64.0 * density);
        assert_eq!(factor("moment"), 256.0 * density);
        assert_eq!(factor("pressure"), 4.0 * density);
        let froude = factor("velocity").powi(2) / (factor("acceleration") * factor("length"));
        assert_eq!(froude, 1.0);
        assert_eq!(factor("length") / factor("time"), factor("velocity"));
    }

    #[test]
    fn all_invalid_numbers_are_reported_at_once() {
        let none = Liquid { density: -1.0, tension: f64::NAN };
        let text = bond(none, (9.81, 0.0), WATER, None).unwrap_err().to_string();
        assert_eq!(text, "density = -1, tension = NaN, radius = 0 (allowed: positive numbers)");
    }
}
