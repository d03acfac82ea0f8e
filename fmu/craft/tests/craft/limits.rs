//! Ends of the range in which a tank's pendulums represent its liquid, and the reasons.

use craft::{
    Inputs, LimitedBy, Parameters, Ramp, SloshTank, Spacecraft, Tank, TankInputs, TankParameters,
};
use fastrand::Rng;

/// First zero of J1'.
const XI: f64 = 1.841_183_781_340_659_3;

/// The host's motion of a single tank.
#[derive(Clone, Copy, Debug)]
struct Motion {
    axial: f64,
    spin: f64,
}

/// Returns the reason for which a single tank is out of range.
fn reason(tank: &Tank, motion: Motion) -> LimitedBy {
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

/// An upright cylinder of random size, on its axis, with angle limits, and a motion well inside of all limits.
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
        // At rest at an angle in any direction; swirl below its limit.
        let (angle, rate) = match case.rng.bool() {
            true => (0.999 * angle_limit * case.rng.f64(), 0.0),
            false => (0.999 * tank.swirl_limit[0] * case.rng.f64(), 1.0),
        };
        case.move_bob(angle, rate);
        let sign = if case.rng.bool() { 1.0 } else { -1.0 };
        case.motion.spin = sign * 0.999 * case.rng.f64() * case.largest_spin();
        case
    }

    /// Returns the squared frequency of mode 1.
    fn omega2(&self) -> f64 {
        self.motion.axial / self.tank.length[0] + self.tank.k[0] / self.tank.mass[0]
    }

    /// Returns the rate at which the first of the two limits by spin is reached, by formulas other than the
    /// product's.
    fn largest_spin(&self) -> f64 {
        let radius = self.tank.wave[0] * (XI * XI - 1.0) / 2.0;
        let kh = (radius / (XI * self.tank.length[0])).atanh();
        let c_0 = (1.0 + 2.0 * kh / (2.0 * kh).sinh()) / (XI * XI - 1.0);
        let waves = 0.5 * (self.omega2() / (1.0 + c_0)).sqrt();
        waves.min((0.3 * self.omega2() * self.tank.length[0] / radius).sqrt())
    }

    /// Moves the bob of mode 1 to this angle, with `rate` times the rate of circular motion.
    fn move_bob(&mut self, angle: f64, rate: f64) {
        let (sin, cos) = (std::f64::consts::TAU * self.rng.f64()).sin_cos();
        let r = angle.sin();
        self.tank.p_0[0] = [r * cos, r * sin, -angle.cos()];
        let speed = rate * r * self.omega2().sqrt();
        self.tank.p_dot_0[0] = [-speed * sin, speed * cos, 0.0];
    }
}

/// 1,000 random tanks inside of all limits are in range, and 1,000 beyond each limit are out of range for that reason.
#[test]
fn a_tank_is_out_of_range_beyond_each_of_its_limits_only() {
    for seed in 0..1000 {
        let case = Case::new(seed);
        let found = reason(&case.tank, case.motion);
        assert_eq!(found, LimitedBy::None, "{seed} {:?} {:?}", case.motion, case.tank);
    }
    type Change = fn(&mut Case, f64);
    let beyond: [(LimitedBy, Change); 7] = [
        (LimitedBy::ThirdOrder, |case, by| {
            let limit = case.tank.angle_limit[0];
            case.move_bob(limit * 1.001 + (0.0989 - 0.0005) * by, 0.0);
        }),
        // The other mode, in a tank whose first mode rests.
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

/// Swirl is distinguished from planar motion at every phase: an ellipse with semi-axes in a ratio of 0.6 swirls, one of 0.4 does
/// not.
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

/// A cylinder of known dimensions has limits without parameters: pendulums in the default depth end at 4.3 degrees, bobs of
/// the third order at 9.3, swirl at 9.4.
#[test]
fn a_tank_of_known_dimensions_has_the_limits_of_potential_flow() {
    let still = Motion { axial: 9.81, spin: 0.0 };
    let at = |[s, kappa]: [f64; 2], degrees: f64, swirls: bool| {
        let mut tank = Tank { diameter: 0.2, depth: 0.1227, g_ref: 9.81, ..Tank::default() };
        tank.nonlinear_inertia[0] = s;
        tank.nonlinear_stiffness[0] = kappa;
        let (sin, cos) = degrees.to_radians().sin_cos();
        tank.p_0[0] = [sin, 0.0, -cos];
        let length = 0.1 / (XI * (XI * 1.227f64).tanh());
        tank.p_dot_0[0][1] = if swirls { sin * (9.81 / length).sqrt() } else { 0.0 };
        reason(&tank, still)
    };
    let third = formulas::third_order::coefficients(1.227).into();
    assert_eq!(
        [4.2, 4.4].map(|x| at([1.0; 2], x, false)),
        [LimitedBy::None, LimitedBy::ThirdOrder]
    );
    assert_eq!([9.2, 9.4].map(|x| at(third, x, false)), [LimitedBy::None, LimitedBy::ThirdOrder]);
    let folds = [LimitedBy::None, LimitedBy::SecondaryResonance];
    assert_eq!([9.2, 9.5].map(|x| at(third, x, true)), folds);
    // At h/R 0.5 the third order ends at 6.5 degrees, and with the wave's energy at 11.8.
    for (has_energy, ends) in [(false, 6.5), (true, 11.8)] {
        let limited = [0.99, 1.01].map(|factor| {
            let mut tank = Tank { diameter: 0.2, depth: 0.05, g_ref: 9.81, ..Tank::default() };
            let pair = formulas::third_order::coefficients(0.5).into();
            let known = formulas::energy_terms::energy_terms(0.5).unwrap();
            [tank.nonlinear_inertia[0], tank.nonlinear_stiffness[0]] =
                if has_energy { known.pair } else { pair };
            if has_energy {
                [tank.nonlinear_inertia_2[0], tank.nonlinear_stiffness_2[0]] = known.next;
                [tank.rotary_inertia[0], tank.rotary_inertia_2[0]] = known.rotary;
            }
            let (sin, cos) = f64::to_radians(factor * ends).sin_cos();
            tank.p_0[0] = [sin, 0.0, -cos];
            reason(&tank, still)
        });
        assert_eq!(limited, [LimitedBy::None, LimitedBy::ThirdOrder], "{has_energy}");
    }
    // Given limits have priority, and tanks without dimensions have none.
    let mut tank = Tank { diameter: 0.2, depth: 0.1227, g_ref: 9.81, ..Tank::default() };
    tank.p_0[0] = [0.1f64.sin(), 0.0, -0.1f64.cos()];
    tank.angle_limit[0] = 0.11;
    assert_eq!(reason(&tank, still), LimitedBy::None);
    (tank.diameter, tank.angle_limit[0]) = (0.0, 0.0);
    tank.p_0[0] = [0.7f64.sin(), 0.0, -0.7f64.cos()];
    assert_eq!(reason(&tank, still), LimitedBy::None);
}

/// The tank on the axis of a spinner at 9 rad/s whose free surface is 5.5 cm higher at the wall than its mean: R = 0.3 m, h
/// = 0.4 m, 5 m/s2. The craft and the tank alone give the same reason.
#[test]
fn a_tank_on_a_spinner_is_limited_by_spin() {
    let mut p = Parameters::default();
    p.tank[0] =
        Tank { diameter: 0.6, depth: 0.4, g_ref: 5.0, position: [0.0; 3], ..Tank::default() };
    let craft = |rate: f64, p: &Parameters| {
        let mut p = *p;
        p.init.omega = [0.0, 0.0, rate];
        let inputs = Inputs { force: Ramp::held([0.0, 0.0, 6500.0]), ..Inputs::default() };
        let mut craft = Spacecraft::new(&p, &inputs, 0.0, 1e-9).unwrap();
        craft.outputs(&inputs).tank[0].ranges.limited_by
    };
    assert_eq!(
        [9.0, -9.0, 0.0, 0.5].map(|rate| craft(rate, &p)),
        [LimitedBy::Spin, LimitedBy::Spin, LimitedBy::None, LimitedBy::None]
    );
    assert_eq!(reason(&p.tank[0], Motion { axial: 5.0, spin: 9.0 }), LimitedBy::Spin);
    // About an axis across the tank's it may turn faster.
    p.init.omega = [2.5, 0.0, 0.0];
    let inputs = Inputs { force: Ramp::held([0.0, 0.0, 6500.0]), ..Inputs::default() };
    let mut across = Spacecraft::new(&p, &inputs, 0.0, 1e-9).unwrap();
    assert_eq!(across.outputs(&inputs).tank[0].ranges.limited_by, LimitedBy::None);
    assert_eq!(craft(2.5, &p), LimitedBy::Spin);
}

/// Limits of a draining tank are those at its fill; at the end of the table it is empty.
#[test]
fn a_draining_tank_has_the_limits_of_its_fill() {
    let mut tank = Tank { g_ref: 1.5, ..Tank::default() };
    tank.fill.points = 3;
    tank.fill.angle_limit[0] =
        [0.1, 0.2, 0.3].into_iter().chain([0.0; 9]).collect::<Vec<_>>()[..12].try_into().unwrap();
    let [low, middle, high] = [0, 1, 2].map(|i| tank.fill.liquid[i]);
    let at = |liquid: f64, angle: f64| {
        let mut tank = tank;
        tank.liquid_0 = liquid;
        tank.p_0[0] = [angle.sin(), 0.0, -angle.cos()];
        reason(&tank, Motion { axial: 1.5, spin: 0.0 })
    };
    for (liquid, limit) in
        [(low * 1.000_001, 0.1), (0.5 * (low + middle), 0.15), (middle, 0.2), (high, 0.3)]
    {
        assert_eq!(at(liquid, limit - 1e-3), LimitedBy::None, "{liquid}");
        assert_eq!(at(liquid, limit + 1e-3), LimitedBy::ThirdOrder, "{liquid}");
    }
    let mut p = TankParameters { tank, ..TankParameters::default() };
    p.tank.liquid_0 = middle;
    let mut inputs = TankInputs { a: Ramp::held([0.0, 0.0, 1.5]), ..TankInputs::default() };
    inputs.mass_flow.value = 10.0;
    let mut draining = SloshTank::new(&p, &inputs, 0.0, 1e-9).unwrap();
    assert_eq!(draining.ranges(&inputs).limited_by, LimitedBy::None);
    draining.step(&inputs, (middle - low) / 10.0).unwrap();
    assert_eq!(draining.ranges(&inputs).limited_by, LimitedBy::Empty);
}
