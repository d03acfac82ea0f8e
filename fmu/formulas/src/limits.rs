//! Limits of the range in which a pendulum, or a slosh mass with coefficients of the third order, represents the
//! liquid in its tank.
//!
//! **Slosh angle.** The model's frequency as a function of the amplitude is compared with fully nonlinear potential flow in
//! upright cylinders. This flow was computed for this project by two independent methods, a variational method and one that
//! marches in time; they agree within 0.04 % at h/R of 0.5 and more, and within 0.12 % at 0.3. The frequency of the slosh
//! mass is that of `fmu/craft/src/surface.rs`, computed by quadrature. There are two limits: at [`FREQUENCY`] the error of
//! the frequency itself is too large, and at a smaller angle the error of a forced response near resonance is: 3 % in
//! amplitude or force, or 3 degrees in phase. This response was computed for this project by a third method, spectral in
//! space and marching in time, with a damping ratio of 0.01 on every mode of the liquid, at the peak of the response and 1
//! % from it. The angle is interpolated between the largest errors at two or more amplitudes. A part of the error is the
//! damping of the waves that the first mode drives, which a single slosh mass of the third order does not have. Tanks that
//! move on a circle were compared in the same way with steady rotary waves (`harness/tank/examples/forced_waves.rs`), at
//! the frequency of free rotary waves of 9 degrees and 1 % from it. The error is largest at the higher frequency, which is
//! close to the jump of the response. The limits are [`cylinder`] and [`cylinder_with_energy`] for planar motion, and
//! [`swirl`] for rotary motion.
//!
//! **Rotary motion.** Above h/R = 0.83 mode (2,2) resonates with twice the frequency of mode 1, so that the branch of rotary
//! motion folds at the angle [`swirl_fold`] and another branch replaces it. No model with a single mode has two branches.
//!
//! **Spin.** In liquid that rotates with its tank a wave has two frequencies, and a pendulum has neither of them.

use core::f64::consts::PI;

use crate::cylinder::XI;
use crate::energy_terms::energy_terms;
use crate::third_order;

/// Reason why a pendulum does not represent the liquid of a tank in its present state. [`LimitedBy::ITEMS`] describes each
/// reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum LimitedBy {
    #[default]
    None = 1,
    ThirdOrder = 2,
    Breaking = 3,
    SecondaryResonance = 4,
    Spin = 5,
    BondNumber = 6,
    Empty = 7,
    Contact = 8,
}

impl LimitedBy {
    pub const ALL: [LimitedBy; 8] = [
        LimitedBy::None,
        LimitedBy::ThirdOrder,
        LimitedBy::Breaking,
        LimitedBy::SecondaryResonance,
        LimitedBy::Spin,
        LimitedBy::BondNumber,
        LimitedBy::Empty,
        LimitedBy::Contact,
    ];

    /// Names and descriptions of the reasons, in the order of their numbers.
    pub const ITEMS: [(&str, &str); 8] = [
        ("none", "In range"),
        (
            "third_order",
            "Slosh angle above angle_limit, up to which the amplitude model holds, or above 45 degrees",
        ),
        ("breaking", "Waves so steep that they break: above breaking_steepness"),
        (
            "secondary_resonance",
            "Rotary slosh above the angle swirl_limit, where a forced response errs by 3 % or a secondary resonance ends this motion",
        ),
        ("spin", "The tank turns about its axis so fast that the spin of the liquid matters"),
        ("bond_number", "Surface tension matters, and the parameters do not include it"),
        ("empty", "The tank has drained to the first point of its fill table"),
        ("contact", "The liquid leaves the bottom of its tank, or is detached"),
    ];

    pub fn from_number(number: u8) -> Option<LimitedBy> {
        LimitedBy::ALL.into_iter().find(|reason| *reason as u8 == number)
    }

    pub fn meaning(self) -> &'static str {
        LimitedBy::ITEMS[self as usize - 1].1
    }
}

/// Allowed relative error of a slosh model's natural frequency, compared with fully nonlinear potential flow. The slosh angle
/// at which the error reaches this value is the end of the model's range.
pub const FREQUENCY: f64 = 3e-3;
/// Relative error of a slosh model's natural frequency at which its forced response near resonance has an error of 3 %. The
/// value applies if this response is wrong only because the frequency depends on the amplitude differently in model and
/// liquid.
pub const FORCED: f64 = 8.5e-4;

/// Relative error of the third-order model's frequency from which on its response to forcing counts as wrong by 3 %. It is
/// used for tanks in which only free motion was compared with potential flow. The value is the smallest frequency error at
/// which the forced response of an upright cylinder with h/R of 0.4 or more was wrong by 3 %.
pub const FORCED_UNCOMPARED: f64 = 1.7e-4;
/// Ratio by which a slosh mass with the coefficients of [`energy_terms`] may have larger slosh angles than the third-order
/// model before the error of a forced response reaches 3 %. It is used for tanks in which only free motion was compared with
/// potential flow. The value is the smallest that was found in upright cylinders.
pub const ENERGY_UNCOMPARED: f64 = 1.06;
/// Largest slosh angle, rad, at which the third-order model had a forced response with an error below 3 % in any upright
/// cylinder.
pub const LARGEST_FORCED: f64 = 9.3 * PI / 180.0;
/// Largest slosh angle, rad, at which a slosh mass with the coefficients of [`energy_terms`] had a forced response with an
/// error below 3 % in any upright cylinder.
pub const LARGEST_FORCED_ENERGY: f64 = 10.2 * (PI / 180.0);

/// Limits of the third-order model for planar motion in an upright cylinder. Each row contains h/R and two slosh angles,
/// degrees: the angle at which the natural frequency has the error [`FREQUENCY`], and the angle at which the error of a
/// forced response is 3 %. (In rotary motion the frequency reaches this error at larger angles, except where the branch of
/// rotary motion folds.) In the range [`third_order::BRIDGED`] the coefficients are interpolated.
/// `harness/tank/tests/tank/backbones.rs` computes the first angle from `harness/tank/tests/backbones.csv`.
const THIRD_ORDER: [[f64; 3]; 12] = [
    [0.25, 4.41, 1.3],
    [0.3, 7.11, 2.4],
    [0.35, 9.44, 3.5],
    [0.4, 11.46, 4.7],
    [0.5, 14.61, 6.5],
    [0.6, 16.81, 8.5],
    [0.65, 17.75, 9.3],
    [0.8, 16.56, 8.4],
    [1.0, 20.04, 8.7],
    [1.227, 21.19, 9.3],
    [2.0, 22.02, 11.1],
    [2.5, 22.06, 11.1],
];

/// Slosh angles at which the branch of rotary motion folds because of a secondary resonance. Each row contains h/R and the
/// angle, degrees. The first row is the depth of the resonance itself. At h/R = 1 and 2.5 the computation ended at this
/// angle, so that the true fold may be at a larger angle.
const FOLD: [[f64; 2]; 6] =
    [[0.8314, 0.5], [0.9, 4.6], [1.0, 7.0], [1.227, 9.4], [2.0, 10.8], [2.5, 10.4]];

/// Largest slosh angles, rad, at which a model of the first mode is valid: up to `frequency` its natural frequency has at
/// most the error [`FREQUENCY`], and up to `forced` its response to forcing near resonance has an error of at most 3 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleLimit {
    pub frequency: f64,
    pub forced: f64,
}

/// Returns the largest valid slosh angles of a model of the first mode in an upright cylinder filled to h/R = `fill`.
/// `shifts` describes the model: the relative change of the squared natural frequency per squared slosh angle in planar and
/// in circular motion. A linear mode has 0 and 0, a pendulum -1/8 and 1/2; `None` stands for a motion that the model cannot
/// make. A difference between these shifts and the shifts by third-order theory adds to the error of third-order theory.
pub fn cylinder(fill: f64, shifts: [Option<f64>; 2]) -> AngleLimit {
    let (s, kappa) = third_order::coefficients(fill);
    let own = |error: f64, column: usize| {
        shifted(degrees_at(fill, column), error, shifts, third_order::shifts(s, kappa))
    };
    AngleLimit { frequency: own(FREQUENCY, 1), forced: own(FORCED, 2) }
}

/// Limits of a slosh mass with the coefficients of [`energy_terms`] in planar motion. Each row contains h/R and the slosh
/// angle, degrees, at which the error of a forced response is 3 %. From h/R = 0.6 on the error stays below 3 % up to 15
/// degrees, the largest angle that was compared.
const FORCED_ENERGY: [[f64; 2]; 7] =
    [[0.25, 1.7], [0.3, 2.9], [0.35, 4.8], [0.4, 7.7], [0.5, 11.8], [0.6, 15.0], [0.7, 15.0]];

/// Limits of the third-order model in rotary motion. Each row contains h/R and the slosh angle, degrees, at which the error
/// of a forced response is 3 %. Shallower liquid has no row, because planar motion has the smaller limit there.
const ROTARY: [[f64; 2]; 6] =
    [[0.65, 9.3], [0.8, 7.7], [1.0, 4.8], [1.227, 5.9], [2.0, 7.2], [2.5, 7.2]];

/// Limits of a slosh mass with the coefficients of [`energy_terms`] in rotary motion. Each row contains h/R and the slosh
/// angle, degrees, at which the error of a forced response is 3 %.
const ROTARY_ENERGY: [[f64; 2]; 7] =
    [[0.25, 1.7], [0.3, 2.8], [0.35, 4.0], [0.4, 5.0], [0.5, 7.5], [0.6, 9.6], [0.7, 10.2]];

/// Returns the largest valid slosh angle, rad, of rotary motion in an upright cylinder filled to h/R = `fill`. At this angle
/// the error of a forced response is 3 %, or the branch of rotary motion folds. `has_energy` is true for a slosh mass with
/// the coefficients of [`energy_terms`], and false for a slosh mass of third order. The result is `None` in shallow liquid,
/// where planar motion has the smaller limit.
pub fn swirl(fill: f64, has_energy: bool) -> Option<f64> {
    let forced = match has_energy && energy_terms(fill).is_some() {
        true => Some(interpolate(fill, ROTARY_ENERGY)),
        false => (fill >= ROTARY[0][0]).then(|| interpolate(fill, ROTARY)),
    };
    [forced.map(f64::to_radians), swirl_fold(fill)].into_iter().flatten().reduce(f64::min)
}

/// Returns the largest valid slosh angles of a slosh mass with the coefficients of [`energy_terms`] in an upright cylinder
/// filled to h/R = `fill`; `None` at depths for which these coefficients are not known.
pub fn cylinder_with_energy(fill: f64) -> Option<AngleLimit> {
    let compared = energy_terms(fill)?.compared;
    Some(AngleLimit { frequency: compared, forced: interpolate(fill, FORCED_ENERGY).to_radians() })
}

/// Returns the slosh angle, rad, up to which the frequency of a model has at most the relative `error`. `limit` is this
/// angle for the third-order model. `shifts` are the relative changes of the model's squared frequency per squared slosh
/// angle in planar and in circular motion, where `None` stands for a motion that the model cannot make; `exact` are these
/// changes by third-order theory. If `shifts` and `exact` differ, the result is at most the angle at which this difference
/// alone causes the error.
pub fn shifted(limit: f64, error: f64, shifts: [Option<f64>; 2], exact: [f64; 2]) -> f64 {
    let off = shifts.iter().zip(exact);
    let off = off.filter_map(|(shift, exact)| Some((shift.as_ref()? - exact).abs()));
    // The relative error of omega is half the relative error of omega^2.
    off.map(|off| libm::sqrt(2.0 * error / off.max(1e-9))).fold(limit, f64::min)
}

/// Interpolates the table [`THIRD_ORDER`] at h/R = `fill`. Returns the slosh angle, rad, at which the error of the natural
/// frequency (`column` = 1) or of a forced response (`column` = 2) reaches its limit. In liquid shallower than the first
/// row, the power law through the first two rows is continued; in liquid deeper than the last row, the last value is used.
fn degrees_at(fill: f64, column: usize) -> f64 {
    let [first, second] = [THIRD_ORDER[0], THIRD_ORDER[1]];
    let degrees = if fill < first[0] {
        let power = libm::log(second[column] / first[column]) / libm::log(second[0] / first[0]);
        first[column] * libm::pow(fill / first[0], power)
    } else {
        interpolate(fill, THIRD_ORDER.map(|row| [row[0], row[column]]))
    };
    degrees.to_radians()
}

/// Returns the slosh angle, rad, at which the branch of rotary motion in an upright cylinder filled to h/R = `fill` folds
/// because of a secondary resonance; `None` in liquid that is too shallow for this resonance.
pub fn swirl_fold(fill: f64) -> Option<f64> {
    (fill >= FOLD[0][0]).then(|| interpolate(fill, FOLD).to_radians())
}

fn interpolate<const N: usize>(x: f64, rows: [[f64; 2]; N]) -> f64 {
    let Some(i) = rows.iter().position(|row| x < row[0]) else { return rows[N - 1][1] };
    let [[x_0, y_0], [x_1, y_1]] = [rows[i.max(1) - 1], rows[i.max(1)]];
    y_0 + (y_1 - y_0) * (x - x_0) / (x_1 - x_0)
}

/// Largest spin number Omega^2 R/g at which a pendulum represents the liquid of a tank that spins about its axis. Omega is
/// the spin rate, and R the radius of the free surface.
pub const SPIN_NUMBER: f64 = 0.3;

/// Limits up to which a pendulum represents the liquid of a tank that spins at the rate Omega. `factor` is 4 (1 + C_0) with
/// the gyroscopic coefficient C_0 of the first mode. If this factor exceeds omega_0^2/Omega^2, where omega_0 is the natural
/// frequency without spin, one of the mode's two waves has become an inertial wave, which no pendulum represents. `ratio` is
/// the radius of the free surface divided by the pendulum length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinLimit {
    factor: f64,
    ratio: f64,
}

impl SpinLimit {
    /// Creates the spin limits of a tank from the pendulum `length` of its first mode, m, and the `radius` of its free
    /// surface, m. If the radius is 0, it is unknown, and the liquid counts as deep.
    ///
    /// The gyroscopic coefficient is C_0 = (1 + 2 k h/sinh 2 k h)/((k R)^2 - 1), where the wave number k follows from tanh k
    /// h = 1/(k l). It is 0.418 in deep and 0.837 in shallow liquid.
    pub fn new(length: f64, radius: f64) -> SpinLimit {
        let deep = 1.0 / XI[0];
        let ratio = if radius > 0.0 { radius / length } else { XI[0] };
        // This is 1/(k l), which is below 1 except for rounding errors and in tanks that are not cylinders.
        let t = ratio * deep;
        let share = match t {
            t if t < 1e-3 => 1.0,
            t if t < 1.0 => 0.5 * libm::log((1.0 + t) / (1.0 - t)) * (1.0 - t * t) / t,
            _ => 0.0,
        };
        let gyroscopic = (1.0 + share) / (XI[0] * XI[0] - 1.0);
        SpinLimit { factor: 4.0 * (1.0 + gyroscopic), ratio }
    }

    /// Returns the gyroscopic coefficient C_0 of the first mode. In a tank that spins at the rate Omega, a wave of this mode
    /// has two frequencies, which are C_0 Omega +- sqrt(C_0^2 Omega^2 + omega_0^2) to first order in Omega, seen from the
    /// tank. A pendulum would have C_0 = 1, because it does not take part in the spin.
    pub fn gyroscopic_coefficient(&self) -> f64 {
        self.factor / 4.0 - 1.0
    }

    /// Returns the radius R of the free surface divided by the pendulum length l. Multiplied by Omega^2/omega_0^2 it gives
    /// the spin number Omega^2 R/g.
    pub fn radius_over_length(&self) -> f64 {
        self.ratio
    }

    /// Returns true if a pendulum does not represent liquid that spins with its tank at the `rate`, rad/s, about the tank's
    /// axis. `omega2` is the squared natural frequency without spin, 1/s2.
    ///
    /// There are two limits. Beyond 2 Omega/omega_0 = (1 + C_0)^(-1/2), the wave that runs with the spin becomes an inertial
    /// wave of the liquid. Beyond Omega^2 R/g = 0.3, the gyroscopic formula for the frequencies errs by more than 2 %, and
    /// the surface is 0.075 R lower at its centre.
    pub fn is_exceeded(&self, rate: f64, omega2: f64) -> bool {
        let rate2 = rate * rate;
        rate2 * self.factor > omega2 || rate2 * self.ratio > SPIN_NUMBER * omega2
    }
}

pub const LOW_BOND: f64 = 100.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_of_slosh_models_and_their_numbers_are_one_to_one() {
        for (i, reason) in LimitedBy::ALL.into_iter().enumerate() {
            assert_eq!(reason as usize, i + 1);
            assert_eq!(LimitedBy::from_number(reason as u8), Some(reason));
        }
        assert_eq!([0, 9, 255].map(LimitedBy::from_number), [None; 3]);
    }

    #[test]
    fn angle_limits_of_a_cylinder_equal_the_table_at_its_rows_and_are_interpolated_between_rows() {
        let third = |fill: f64| {
            let (s, kappa) = third_order::coefficients(fill);
            cylinder(fill, third_order::shifts(s, kappa).map(Some))
        };
        for [fill, frequency, forced] in THIRD_ORDER {
            let limit = third(fill);
            assert!((limit.frequency.to_degrees() - frequency).abs() < 1e-9, "{fill} {limit:?}");
            assert!((limit.forced.to_degrees() - forced).abs() < 1e-9, "{fill} {limit:?}");
        }
        assert!((third(0.45).frequency.to_degrees() - 0.5 * (11.46 + 14.61)).abs() < 1e-9);
        assert_eq!(third(9.0), third(2.5));
        let shallow = [0.24, 0.15, 0.1].map(|fill| third(fill).frequency.to_degrees());
        assert!(shallow[0] < 4.41 && shallow[0] > 3.9, "{shallow:?}");
        assert!(shallow[1] < 1.2 && shallow[2] < 0.5 && shallow[2] > 0.0, "{shallow:?}");
    }

    #[test]
    fn a_tank_without_forced_wave_data_has_the_angle_limits_of_the_worst_cylinder() {
        let rows = || THIRD_ORDER.into_iter();
        // The error of the frequency grows with the square of the angle.
        let least_of = |fill: f64, planar: f64, has_energy: bool| {
            planar.min(swirl(fill, has_energy).map_or(planar, f64::to_degrees))
        };
        let error = |[fill, frequency, forced]: [f64; 3]| {
            FREQUENCY * (least_of(fill, forced, false) / frequency).powi(2)
        };
        let least = rows().filter(|row| row[0] >= 0.4).map(error).fold(1.0, f64::min);
        assert!((least / FORCED_UNCOMPARED - 1.0).abs() < 0.02, "{least}");
        let largest = rows().map(|row| least_of(row[0], row[2], false)).fold(0.0, f64::max);
        assert!((largest.to_radians() / LARGEST_FORCED - 1.0).abs() < 1e-12);
        let third = |fill: f64| least_of(fill, degrees_at(fill, 2).to_degrees(), false);
        let with_energy = FORCED_ENERGY.map(|[fill, forced]| [fill, least_of(fill, forced, true)]);
        let ratio = with_energy.map(|[fill, forced]| forced / third(fill));
        let smallest = ratio.into_iter().fold(9.0, f64::min);
        assert!((smallest / ENERGY_UNCOMPARED - 1.0).abs() < 0.02, "{ratio:?}");
        let compared = with_energy.map(|[_, forced]| forced).into_iter().fold(0.0, f64::max);
        assert!((compared.to_radians() / LARGEST_FORCED_ENERGY - 1.0).abs() < 1e-12);
    }

    /// The test compares the computed limit with the slosh angle at which the frequency of planar motion in fully nonlinear
    /// potential flow differs by 0.3 % from a pendulum's frequency. Terms beyond third order, which the computed limit
    /// leaves out, change this angle by at most 0.3 degrees.
    #[test]
    fn the_angle_limit_of_a_pendulum_is_where_third_order_theory_differs() {
        for (fill, exact) in [(0.25, 1.6), (0.35, 3.5), (1.227, 8.3), (2.0, 7.8)] {
            let limit = cylinder(fill, [Some(-0.125), Some(0.5)]).frequency.to_degrees();
            assert!((limit - exact).abs() < 0.3, "{fill}: {limit} {exact}");
        }
        let linear = cylinder(1.227, [Some(0.0), None]);
        // The limit follows from -0.429 A^2/2 = -0.003.
        assert!((linear.frequency.to_degrees() - 6.78).abs() < 0.01, "{linear:?}");
        assert!(linear.forced < linear.frequency);
    }

    #[test]
    fn rotary_slosh_has_an_angle_limit_above_the_resonance_with_mode_2_2() {
        assert_eq!([0.5, 0.83].map(swirl_fold), [None; 2]);
        for [fill, angle] in FOLD {
            let found = swirl_fold(fill).unwrap().to_degrees();
            assert!((found - angle).abs() < 1e-9, "{fill} {found}");
        }
        assert_eq!(swirl_fold(9.0), swirl_fold(2.5));
    }

    /// The example is an upright tank of 0.3 m radius, filled 0.4 m deep, at 5 m/s2. At a spin rate of 9 rad/s it is far
    /// beyond both limits: 2 Omega/omega_0 is 3.3 (limit 0.7 to 0.9), and Omega^2 R/g is 4.86 (limit 0.3). At 0 and 0.1 rad/s
    /// it is within both.
    #[test]
    fn a_spinning_tank_is_out_of_range_where_inertial_waves_occur_or_the_paraboloid_is_deep() {
        let limit = |fill: f64| {
            let l = 1.0 / (XI[0] / 0.3 * libm::tanh(XI[0] * fill));
            (SpinLimit::new(l, 0.3), 5.0 / l)
        };
        let (bottle, omega2) = limit(4.0 / 3.0);
        assert!(bottle.is_exceeded(9.0, omega2) && bottle.is_exceeded(-9.0, omega2));
        assert!(!bottle.is_exceeded(0.0, omega2) && !bottle.is_exceeded(0.1, omega2));
        for (fill, c_0) in [(5.0, 0.4184), (1.0, 0.4960), (0.01, 0.8367)] {
            let (found, _) = limit(fill);
            assert!((found.factor / 4.0 - 1.0 - c_0).abs() < 2e-4, "{fill} {found:?}");
        }
        // In shallow liquid the limit of the paraboloid is reached first, because omega_0 is small although the
        // spin number is not.
        let (found, omega2) = limit(2.0);
        let beta = libm::sqrt(SPIN_NUMBER * 5.0 / 0.3);
        assert!(
            !found.is_exceeded(0.999 * beta, omega2) && found.is_exceeded(1.001 * beta, omega2)
        );
    }
}
