//! Random tanks within all limits of validity, and beyond each limit, at which pendulums no longer represent the liquid.
//!
//! `tests/six` includes this file as well, and runs it with the packed FMU instead of this crate.

use craft::{LimitedBy, Ramp, Tank, TankInputs, TankParameters};
use fastrand::Rng;

use super::component::SloshTank;

pub const XI: f64 = 1.841_183_781_340_659_3;

#[derive(Clone, Copy, Debug)]
pub struct Motion {
    pub axial: f64,
    pub spin: f64,
}

pub fn reason(tank: &Tank, motion: Motion) -> LimitedBy {
    let p = TankParameters { tank: *tank, ..TankParameters::default() };
    let inputs = TankInputs {
        a: Ramp::held([0.0, 0.0, motion.axial]),
        omega: [0.0, 0.0, motion.spin],
        ..TankInputs::default()
    };
    let mut alone = SloshTank::new(&p, &inputs, 0.0, 1e-9).unwrap();
    let seen = alone.ranges(&inputs);
    assert_eq!(seen, alone.ranges_held());
    assert_eq!(seen.is_in_range(), seen.limited_by == LimitedBy::None);
    seen.limited_by
}

/// An upright cylinder of random size with limits of the slosh angle, on the axis of the craft that carries it, and a motion that
/// is well within all limits.
struct Case {
    tank: Tank,
    motion: Motion,
    rng: Rng,
}

impl Case {
    fn new(seed: u64) -> Case {
        let mut rng = Rng::with_seed(seed);
        let radius = 0.1 + rng.f64();
        let depth = radius * (0.35 + 2.0 * rng.f64());
        let k = XI / radius;
        let length = 1.0 / (k * (k * depth).tanh());
        let axial = 10f64.powf(-2.0 + 3.0 * rng.f64());
        let angle_limit = 0.1 + 0.2 * rng.f64();
        let mut tank = Tank {
            position: [0.0; 3],
            modes: 1 + rng.usize(..2),
            g_ref: axial,
            g_bond: axial * 0.9 * rng.f64(),
            ..Tank::default()
        };
        tank.length[0] = length;
        tank.wave[0] = 2.0 * radius / (XI * XI - 1.0);
        (tank.angle_limit[0], tank.swirl_limit[0]) = (angle_limit, angle_limit * 0.5);
        tank.breaking_steepness[0] = 2.0 * XI * (angle_limit + 0.1) / (XI * XI - 1.0);
        let mut case = Case { tank, motion: Motion { axial, spin: 0.0 }, rng };
        // The bob is at rest at an angle in any direction, or in rotary motion below its limit.
        let (angle, rate) = match case.rng.bool() {
            true => (0.999 * angle_limit * case.rng.f64(), 0.0),
            false => (0.999 * tank.swirl_limit[0] * case.rng.f64(), 1.0),
        };
        case.move_bob(angle, rate);
        let sign = if case.rng.bool() { 1.0 } else { -1.0 };
        case.motion.spin = sign * 0.999 * case.rng.f64() * case.largest_spin();
        case
    }

    fn omega2(&self) -> f64 {
        self.motion.axial / self.tank.length[0] + self.tank.k[0] / self.tank.mass[0]
    }

    /// Returns the spin rate, rad/s, at which the first of the two limits of spin is reached. It is
    /// computed by other formulas than those under test.
    fn largest_spin(&self) -> f64 {
        let radius = self.tank.wave[0] * (XI * XI - 1.0) / 2.0;
        let kh = (radius / (XI * self.tank.length[0])).atanh();
        let c_0 = (1.0 + 2.0 * kh / (2.0 * kh).sinh()) / (XI * XI - 1.0);
        let waves = 0.5 * (self.omega2() / (1.0 + c_0)).sqrt();
        waves.min((0.3 * self.omega2() * self.tank.length[0] / radius).sqrt())
    }

    /// Moves the bob of mode 1 to `angle`. Its rate is `rate` times the rate of circular motion.
    fn move_bob(&mut self, angle: f64, rate: f64) {
        let (sin, cos) = (std::f64::consts::TAU * self.rng.f64()).sin_cos();
        let r = angle.sin();
        self.tank.p_0[0] = [r * cos, r * sin, -angle.cos()];
        let speed = rate * r * self.omega2().sqrt();
        self.tank.p_dot_0[0] = [-speed * sin, speed * cos, 0.0];
    }
}

/// 1,000 random tanks within all limits are in range. For each limit, 1,000 tanks beyond it are out of range, and the reported
/// reason is this limit.
#[test]
fn a_tank_is_out_of_range_beyond_each_of_its_limits_only() {
    for seed in 0..1000 {
        let case = Case::new(seed);
        let found = reason(&case.tank, case.motion);
        assert_eq!(found, LimitedBy::None, "{seed} {:?} {:?}", case.motion, case.tank);
    }
    type Change = fn(&mut Case, f64);
    let beyond: [(LimitedBy, Change); 8] = [
        (LimitedBy::ThirdOrder, |case, by| {
            let limit = case.tank.angle_limit[0];
            case.move_bob(limit * 1.001 + (0.0989 - 0.0005) * by, 0.0);
        }),
        // Here the second mode exceeds its limit while the first mode is at rest.
        (LimitedBy::ThirdOrder, |case, by| {
            case.move_bob(0.0, 0.0);
            case.tank.modes = 2;
            case.tank.angle_limit[1] = 0.2;
            let angle = 0.201 + 0.5 * by;
            case.tank.p_0[1] = [angle.sin(), 0.0, -angle.cos()];
        }),
        (LimitedBy::Breaking, |case, by| {
            let limit = case.tank.angle_limit[0] + 0.1;
            case.move_bob(limit * 1.001 + 0.3 * by, 0.0);
        }),
        (LimitedBy::SecondaryResonance, |case, by| {
            let limit = case.tank.swirl_limit[0];
            case.move_bob(limit * 1.001 + 0.4 * limit * by, 0.8 + 0.5 * by);
        }),
        (LimitedBy::Spin, |case, by| case.motion.spin = case.largest_spin() * (1.001 + 3.0 * by)),
        (LimitedBy::BondNumber, |case, by| {
            case.motion.spin = 0.0;
            case.tank.g_bond = case.motion.axial * (1.001 + by);
        }),
        (LimitedBy::Empty, |case, by| {
            case.tank.fill.points = 3;
            case.tank.liquid_0 = case.tank.fill.liquid[0] * (1.0 + 0.9e-9 * by);
        }),
        (LimitedBy::Contact, |case, by| case.motion.axial *= -0.01 - by),
    ];
    for (expected, change) in beyond {
        for seed in 0..1000 {
            let mut case = Case::new(seed);
            let by = case.rng.f64();
            change(&mut case, by);
            let found = reason(&case.tank, case.motion);
            assert_eq!(found, expected, "{seed} {by} {:?} {:?}", case.motion, case.tank);
        }
    }
}

/// Rotary motion is distinguished from planar motion at every phase: an ellipse whose semi-axes have the ratio 0.6 counts as
/// rotary, and one with the ratio 0.4 does not.
#[test]
fn a_wide_ellipse_counts_as_rotary_motion_at_every_phase() {
    for (ratio, expected) in [(0.6, LimitedBy::SecondaryResonance), (0.4, LimitedBy::None)] {
        for step in 0..100 {
            let mut case = Case::new(step);
            case.motion.spin = 0.0;
            (case.tank.swirl_limit[0], case.tank.angle_limit[0]) = (0.01, 0.4);
            let w = case.omega2().sqrt();
            let (sin, cos) = (0.0628 * step as f64).sin_cos();
            let (a, b) = (0.1, 0.1 * ratio);
            case.tank.p_0[0] = [a * cos, b * sin, -1.0];
            case.tank.p_dot_0[0] = [-a * w * sin, b * w * cos, 0.0];
            assert_eq!(reason(&case.tank, case.motion), expected, "{ratio} {step}");
        }
    }
}
