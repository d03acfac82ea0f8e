//! Tests of ranges of validity, of refused parameters, and of the messages.

use super::common::bench;
use plant::{
    FrictionModel, Inputs, LimitedBy, Parameters, Plant, Ramp, Regime, SloshModel, SloshSource,
};

fn inputs_with_gravity(g: f64) -> Inputs {
    Inputs { g_axial: Ramp::held(g), ..Inputs::default() }
}

/// Height of the first mode's wave at the wall divided by slosh angle and tank radius, 2/(xi_1^2 - 1), where xi_1 = 1.841 is
/// the first zero of the derivative of the Bessel function J_1.
const WAVE: f64 = 2.0 / (1.841_183_781_340_659_5 * 1.841_183_781_340_659_5 - 1.0);

#[test]
fn the_slosh_regime_changes_at_waves_of_0_15_and_0_25_radii() {
    let regime = |ratio: f64| {
        let mut p = bench(SloshModel::Linear, FrictionModel::None);
        p.init.slosh_angle = ratio / WAVE;
        let o = Plant::new(&p, &inputs_with_gravity(9.81), 0.0, 1e-9)
            .unwrap()
            .outputs(&inputs_with_gravity(9.81));
        assert!((o.wave_height - ratio * 0.0815).abs() < 1e-15);
        o.discrete.regime
    };
    for (ratio, expected) in [
        (0.0, Regime::Linear),
        (0.149_999, Regime::Linear),
        (0.150_001, Regime::Transitional),
        (0.249_999, Regime::Transitional),
        (0.250_001, Regime::Nonlinear),
        (2.0, Regime::Nonlinear),
    ] {
        assert_eq!(regime(ratio), expected, "{ratio}");
    }
}

/// The law is valid if the stroke of the liquid at the ring is 0.64 to 6.4 times the width of the ring, and if the ring stays
/// covered by liquid.
#[test]
fn the_law_of_ring_baffles_holds_within_its_range_of_strokes_and_depths() {
    let within = |width: f64, depth: f64, wave: f64| {
        let mut p = bench(SloshModel::Linear, FrictionModel::None);
        (p.baffle.width, p.baffle.depth) = (width, depth);
        p.init.slosh_angle = wave / (0.0815 * WAVE);
        let o = Plant::new(&p, &inputs_with_gravity(9.81), 0.0, 1e-9)
            .unwrap()
            .outputs(&inputs_with_gravity(9.81));
        assert!((o.baffle_wave / wave - 1.0).abs() < 1e-3);
        o.discrete.baffle_in_range
    };
    let left = (-1.84f64 * 0.03 / 0.0815).exp();
    // The constant A_0 in the amplitude adds 4e-4 to a wave at the lower end of the range.
    let smallest = 0.64 * 0.008 / left;
    assert!(!within(0.008, 0.03, smallest * 0.998) && within(0.008, 0.03, smallest * 1.002));
    let largest = 6.4 * 0.002 / left;
    assert!(within(0.002, 0.03, largest * 0.998) && !within(0.002, 0.03, largest * 1.002));
    assert!(within(0.008, 0.02, 0.01999) && !within(0.008, 0.02, 0.02001), "covered");
    // alpha = w/R (2 - w/R) is 0.25 at w/R = 1 - sqrt(0.75).
    let widest = 0.0815 * (1.0 - 0.75f64.sqrt());
    assert!(within(widest * 0.999, 0.03, 0.025) && !within(widest * 1.001, 0.03, 0.025));
}

#[test]
fn a_warning_names_each_formula_that_is_used_outside_its_range() {
    let mut p = bench(SloshModel::Linear, FrictionModel::None);
    let warnings = |p: &Parameters, g: f64| Plant::warnings(p, &inputs_with_gravity(g));
    assert!(warnings(&p, 9.81).is_empty());
    // The Bond number is 1000 0.0815^2 g/0.07213 = 92.1 g.
    assert!(warnings(&p, 1.08).len() == 1 && warnings(&p, 1.09).is_empty(), "Bond number 100");
    let weightless = warnings(&p, 0.0);
    assert!(weightless[0].contains("nothing restores or damps slosh mode 1"), "{weightless:?}");
    p.slosh.model = SloshModel::Frozen;
    assert!(warnings(&p, 0.0).is_empty(), "rigid liquid needs no g");
    p.slosh.model = SloshModel::Liquid;
    p.tank.h = 0.399 * 0.0815;
    assert!(warnings(&p, 9.81)[0].contains("shallow"));
    p.tank.h = 0.401 * 0.0815;
    assert!(!warnings(&p, 9.81).iter().any(|text| text.contains("shallow")));
    (p.slosh.model, p.tank.h) = (SloshModel::Linear, 0.1 * 0.0815);
    assert!(warnings(&p, 9.81).is_empty(), "the linear model has shallow waves");

    let mut p = bench(SloshModel::Linear, FrictionModel::None);
    (p.baffle.width, p.baffle.depth) = (0.008, 0.01);
    assert!(warnings(&p, 9.81).is_empty());
    p.slosh.source = SloshSource::Table;
    p.slosh.table.m_liq = 2.0;
    (p.slosh.table.mass[0], p.slosh.table.length[0]) = (0.7, 0.05);
    let all = warnings(&p, 9.81);
    assert!(all.len() == 1 && all[0].contains("upright cylinder"), "{all:?}");
    p.baffle.width = 0.0;
    assert!(warnings(&p, 9.81).is_empty());
    // The tank is weightless, but a stiffness centres the liquid.
    p.slosh.table.k[0] = 1.0;
    assert!(warnings(&p, 0.0).is_empty());
}

#[test]
fn a_ring_wider_than_the_tank_or_below_its_bottom_is_refused() {
    let problems = |change: fn(&mut Parameters)| {
        let mut p = bench(SloshModel::Linear, FrictionModel::None);
        (p.baffle.width, p.baffle.depth) = (0.0814, 0.0999);
        change(&mut p);
        Plant::problems(&p).len()
    };
    assert_eq!(problems(|_| {}), 0);
    assert_eq!(problems(|p| p.baffle.width = 0.0815), 1);
    assert_eq!(problems(|p| p.baffle.depth = 0.1), 1);
    assert_eq!(problems(|p| (p.baffle.width, p.baffle.depth) = (0.0, 0.2)), 0, "no baffle");
}

/// A sum of the modal masses that exceeds the mass of the liquid by a relative amount of up to 1e-9 is accepted as a
/// rounding error.
#[test]
fn a_table_whose_masses_are_the_whole_liquid_has_no_fixed_mass() {
    let mut p = bench(SloshModel::Linear, FrictionModel::None);
    (p.slosh.source, p.slosh.modes) = (SloshSource::Table, 2);
    p.slosh.table.m_liq = 1.0;
    p.slosh.table.mass[..2].copy_from_slice(&[0.75, 0.25 + 5e-10]);
    p.slosh.table.length[..2].copy_from_slice(&[0.1, 0.1]);
    let plant = Plant::new(&p, &inputs_with_gravity(9.81), 0.0, 1e-9).unwrap();
    assert_eq!(plant.calculated().m_0, 0.0);
    p.slosh.table.mass[1] = 0.25 + 2e-9;
    assert!(Plant::problems(&p)[0].contains("add up to"));
    p.slosh.table.mass[1] = 0.2;
    let plant = Plant::new(&p, &inputs_with_gravity(9.81), 0.0, 1e-9).unwrap();
    assert!((plant.calculated().m_0 - 0.05).abs() < 1e-15);
}

/// The sum of the squared sines of the two initial angles is the squared horizontal distance of the slosh mass from its
/// hinge, divided by the squared length. It must be less than 1.
#[test]
fn a_spherical_pendulum_that_starts_above_the_horizontal_is_refused() {
    let refused = |radial: f64, tangential: f64| {
        let mut p = bench(SloshModel::Spherical, FrictionModel::None);
        (p.init.slosh_angle_radial, p.init.slosh_angle) = (radial, tangential);
        Plant::new(&p, &inputs_with_gravity(9.81), 0.0, 1e-9).is_err()
    };
    // 45 degrees in each direction together put the slosh mass at the horizontal.
    assert!(!refused(0.78, 0.78) && !refused(-0.78, 0.78) && refused(0.79, -0.79));
    assert!(!refused(1.55, 0.0) && refused(1.57, 0.0) && !refused(0.0, 1.55) && refused(0.0, 1.57));
    assert!(refused(0.9, 0.9), "beyond");
}

/// In the model `liquid` the large-wave coefficient s changes the inertia of the slosh mass with the amplitude. At h/R =
/// 0.2, s is -38.7, so that the inertia would become 0 or negative, and the fill is refused. Near the secondary resonances
/// at h/R = 0.829 and 1.012 the coefficients are interpolated, so that these fills are accepted.
#[test]
fn a_liquid_whose_inertia_falls_with_the_amplitude_is_refused() {
    let said = |fill: f64, model: SloshModel| {
        let mut p = bench(model, FrictionModel::None);
        p.tank.h = fill * p.tank.d / 2.0;
        Plant::problems(&p).join("\n")
    };
    for fill in [0.16, 0.2, 0.34] {
        let text = said(fill, SloshModel::Liquid);
        assert!(text.contains("tank.h / (tank.d/2)") && text.contains("not above 0"), "{text}");
        assert_eq!(said(fill, SloshModel::Spherical), "");
    }
    for fill in [0.35, 0.6, 0.82, 0.829, 0.84, 1.0, 1.012, 1.02, 5.0] {
        assert_eq!(said(fill, SloshModel::Liquid), "");
        assert!(formulas::third_order::coefficients(fill).0 > 0.0);
    }
}

/// The output `limited_by` names the limit of the slosh model that the motion has passed. For each limit the test has a
/// plant just beyond it and a plant just within it. In the cylinder of the default bench, which is filled to h/R = 1.227,
/// the squared frequency changes by the factors 1 - 0.429 A^2 in planar and 1 + 0.367 A^2 in circular motion at the slosh
/// angle A.
#[test]
fn the_output_limited_by_names_the_limit_that_was_passed() {
    let reason = |p: &Parameters, g: f64| {
        let o = Plant::new(p, &inputs_with_gravity(g), 0.0, 1e-9)
            .unwrap()
            .outputs(&inputs_with_gravity(g));
        o.discrete.limited_by
    };
    let of_angle = |model: SloshModel, degrees: f64| {
        let mut p = bench(model, FrictionModel::None);
        p.tank.h = 1.227 * p.tank.d / 2.0;
        p.init.slosh_angle = degrees.to_radians();
        reason(&p, 9.81)
    };
    let none_and_third = [LimitedBy::None, LimitedBy::ThirdOrder];
    for (model, limit) in [
        // The limits of A are sqrt(2 0.00085/0.429) for the linear model and sqrt(2 0.00085/(0.429 - 0.125)) for a pendulum.
        (SloshModel::Linear, 3.605),
        (SloshModel::Planar, 4.28),
        (SloshModel::Spherical, 4.28),
        (SloshModel::Liquid, 9.3),
    ] {
        let found = [0.99, 1.01].map(|factor| of_angle(model, factor * limit));
        assert_eq!(found, none_and_third, "{model:?}");
    }
    let swirl = |degrees: f64, share: f64| {
        let mut p = bench(SloshModel::Liquid, FrictionModel::None);
        p.tank.h = 1.227 * p.tank.d / 2.0;
        p.init.slosh_angle = degrees.to_radians();
        let w = (9.81 * 1.8412 / 0.0815 * (1.8412f64 * 1.227).tanh()).sqrt();
        p.init.slosh_rate_radial = share * w * p.init.slosh_angle;
        reason(&p, 9.81)
    };
    let rotary = [LimitedBy::None, LimitedBy::SecondaryResonance];
    assert_eq!([5.8, 6.0].map(|degrees| swirl(degrees, 1.0)), rotary);
    assert_eq!(swirl(12.0, 0.3), LimitedBy::ThirdOrder, "the ellipse is narrow");

    let mut p = bench(SloshModel::Liquid, FrictionModel::None);
    (p.slosh.breaking_steepness, p.init.slosh_angle) = (0.2, 0.131);
    // The steepness is k a = 2 xi/(xi^2 - 1) A = 1.541 A.
    assert_eq!(reason(&p, 9.81), LimitedBy::Breaking);
    p.init.slosh_angle = 0.129;
    assert_eq!(reason(&p, 9.81), LimitedBy::None);
    p.init.omega = 7.0;
    assert_eq!(reason(&p, 9.81), LimitedBy::Spin);
    p.init.omega = 5.0;
    assert_eq!(reason(&p, 9.81), LimitedBy::None);
    p.init.omega = 0.0;
    // The Bond number of the tank is 92.1 s2/m times g.
    assert_eq!([1.08, 1.09].map(|g| reason(&p, g)), [LimitedBy::BondNumber, LimitedBy::None]);
    p.slosh.capillarity = true;
    assert_eq!(reason(&p, 0.5), LimitedBy::None);
    p.slosh.model = SloshModel::Frozen;
    (p.slosh.capillarity, p.init.slosh_angle) = (false, 0.0);
    assert_eq!(reason(&p, 0.0), LimitedBy::None);
}

/// If the slosh model uses the coefficients of the table, a mode is out of range above the limits in the table. With other
/// slosh models it is out of range at smaller angles.
#[test]
fn limits_in_a_table_of_modes_apply_if_the_slosh_model_uses_its_coefficients() {
    let reason = |model: SloshModel, limit: f64, degrees: f64| {
        let mut p = bench(model, FrictionModel::None);
        (p.slosh.source, p.slosh.modes) = (SloshSource::Table, 1);
        (p.slosh.table.m_liq, p.slosh.table.mass[0], p.slosh.table.length[0]) = (2.0, 0.7, 0.05);
        (p.slosh.table.nonlinear_inertia[0], p.slosh.table.nonlinear_stiffness[0]) = (1.4, 0.7);
        p.slosh.table.angle_limit[0] = f64::to_radians(limit);
        p.init.slosh_angle = f64::to_radians(degrees);
        let o = Plant::new(&p, &inputs_with_gravity(9.81), 0.0, 1e-9)
            .unwrap()
            .outputs(&inputs_with_gravity(9.81));
        o.discrete.limited_by
    };
    let liquid = |limit: f64, degrees: f64| reason(SloshModel::Liquid, limit, degrees);
    assert_eq!(
        [9.9, 10.1].map(|degrees| liquid(10.0, degrees)),
        [LimitedBy::None, LimitedBy::ThirdOrder]
    );
    assert_eq!(
        [44.0, 46.0].map(|degrees| liquid(0.0, degrees)),
        [LimitedBy::None, LimitedBy::ThirdOrder]
    );
    // The limit of the slosh angle is sqrt(2 0.00085/|3 0.7/8 - 1.4/2|) = 3.57 degrees.
    let linear = [3.55, 3.6].map(|degrees| reason(SloshModel::Linear, 10.0, degrees));
    assert_eq!(linear, [LimitedBy::None, LimitedBy::ThirdOrder]);
}
