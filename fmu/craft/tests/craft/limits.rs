//! Tests of the limits within which a tank's pendulums represent its liquid, and of the reported reasons.

use craft::{
    Inputs, LimitedBy, Parameters, Ramp, SloshTank, Spacecraft, Tank, TankInputs, TankParameters,
};

use super::limit_cases::{Motion, XI, reason};

/// For a cylinder of known dimensions the model computes the largest valid slosh angles itself. At the default depth they are 4.3
/// degrees for pendulums, 9.3 degrees with coefficients of the third order, and 5.9 degrees for rotary motion.
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
    let rotary = [LimitedBy::None, LimitedBy::SecondaryResonance];
    assert_eq!([5.8, 6.0].map(|x| at(third, x, true)), rotary);
    // At h/R = 0.5 the limit is 6.5 degrees with the coefficients of the third order, and 11.8 degrees if the energy coefficients
    // beyond the third order are set as well.
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
    // Limits that are given as parameters replace computed ones. A tank without known dimensions has no computed limits.
    let mut tank = Tank { diameter: 0.2, depth: 0.1227, g_ref: 9.81, ..Tank::default() };
    tank.p_0[0] = [0.1f64.sin(), 0.0, -0.1f64.cos()];
    tank.angle_limit[0] = 0.11;
    assert_eq!(reason(&tank, still), LimitedBy::None);
    (tank.diameter, tank.angle_limit[0]) = (0.0, 0.0);
    tank.p_0[0] = [0.7f64.sin(), 0.0, -0.7f64.cos()];
    assert_eq!(reason(&tank, still), LimitedBy::None);
}

/// A tank on the axis of a spinner that rotates at 9 rad/s is out of range because of the spin: its
/// free surface is 5.5 cm higher at the wall than its mean (R = 0.3 m, h = 0.4 m, 5 m/s2). The
/// craft and the single tank report this same reason.
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
    // The craft may rotate faster about an axis perpendicular to the tank's axis.
    p.init.omega = [2.5, 0.0, 0.0];
    let inputs = Inputs { force: Ramp::held([0.0, 0.0, 6500.0]), ..Inputs::default() };
    let mut across = Spacecraft::new(&p, &inputs, 0.0, 1e-9).unwrap();
    assert_eq!(across.outputs(&inputs).tank[0].ranges.limited_by, LimitedBy::None);
    assert_eq!(craft(2.5, &p), LimitedBy::Spin);
}

/// The limits of a draining tank are those at its present fill. At the first point of the fill table the tank is empty.
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
