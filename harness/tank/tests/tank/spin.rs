//! Liquid that rotates with its tank at a steady rate.

use core::f64::consts::{PI, TAU};

use hubslosh_tank::modal::Spin;
use hubslosh_tank::parameters::{Liquid, ParameterSet, Target, Value, solve};
use hubslosh_tank::spin::spin;
use hubslosh_tank::tank::Shape;
use hubslosh_tank::{Fill, Tank};

const RHO: f64 = 1000.0;

/// Spins a tank that is filled to the fraction `share` of its volume, under 1 m/s², or without
/// gravity if `weightless` is true, and with Omega^2 R/g = `flatness` for R = 1 m and g = 1 m/s².
/// Returns the mass of the liquid and its steady rotation.
fn spin_tank(shape: Shape, share: f64, flatness: f64, weightless: bool) -> (f64, Spin) {
    let tank = Tank::from_shape(shape, RHO).unwrap();
    let data = tank.solve(tank.fill_height(Fill::Share(share)).unwrap(), 1).unwrap();
    let gravity = if weightless { 0.0 } else { 1.0 };
    (data.m_liq, spin(&tank, &data, flatness.sqrt(), gravity, None).unwrap())
}

fn close(found: f64, expected: f64, error: f64) {
    assert!((found - expected).abs() <= error, "{found} is not {expected} within {error}");
}

/// The surface is a paraboloid with closed forms as long as the whole floor is wet and the surface
/// stays below the lid.
#[test]
fn in_a_cylinder_the_spinning_surface_equals_its_closed_form() {
    for (h, beta) in [(0.5, 0.1), (0.5, 1.0), (1.0, 0.3), (1.0, 2.0), (2.0, 5.0)] {
        let shape = Shape::Cylinder { radius: 1.0, height: 4.0 };
        let (m, found) = spin_tank(shape, h / 4.0, beta, false);
        close(found.z_cg, h / 2.0 + beta * beta / (96.0 * h), 1e-12);
        close(found.i_axis / m, 0.5 * (1.0 + beta / (12.0 * h)), 1e-12);
        close(found.z_apex.unwrap(), h - beta / 4.0, 1e-12);
        close(found.z_wall, h + beta / 4.0, 1e-9);
    }
}

/// The surface is a cylinder about the axis: r_i^2 = R^2 - V/(pi H) in a cylinder, R^2 (1 -
/// f^(2/3)) in a sphere filled to the fraction f.
#[test]
fn weightless_spinning_liquid_lies_at_the_wall() {
    let (m, found) = spin_tank(Shape::Cylinder { radius: 1.0, height: 2.0 }, 0.3, 1.0, true);
    close(found.r_dry, 0.7_f64.sqrt(), 1e-12);
    close(found.i_axis / m, 0.5 * (1.0 + 0.7), 1e-12);
    close(found.z_cg, 1.0, 1e-12);
    assert!(!found.in_range && found.flatness.is_none() && found.ratio.is_none(), "{found:?}");
    for share in [0.25_f64, 0.5, 0.9] {
        let (m, found) = spin_tank(Shape::Sphere { radius: 1.0 }, share, 1.0, true);
        let inner = 1.0 - share.powf(2.0 / 3.0);
        close(found.i_axis / m, inner + 0.4 * (1.0 - inner), 1e-9);
        close(found.z_cg, 1.0, 1e-9);
    }
}

/// If both poles are dry, the wall's pressure acts everywhere through the centre of the sphere.
/// Equilibrium in the rotating frame therefore puts the centre of mass at z_cg = -g/Omega^2 from
/// the centre, for any fill.
#[test]
fn in_a_sphere_with_dry_poles_the_centre_of_mass_balances_thrust_and_spin() {
    for (share, flatness) in [(0.25, 5.0), (0.25, 10.0), (0.5, 5.0), (0.5, 30.0)] {
        let (_, found) = spin_tank(Shape::Sphere { radius: 1.0 }, share, flatness, false);
        assert!(found.r_dry > 0.0 || found.z_apex.is_none());
        close(found.z_cg - 1.0, -1.0 / flatness, 1e-9);
    }
}

/// An independent program computed the expected values to 8 digits by integration over the section.
/// Each row has the fraction of the volume, Omega^2 R/g, z_cg/R from the centre, I_axis/(m R^2),
/// I_cg/(m R^2), and the heights of the apex and of the contact line.
#[test]
fn in_a_sphere_the_spinning_liquid_equals_an_independent_program() {
    let rows = [
        (0.25, 0.3, [-0.577_874_03, 0.346_950_23, 0.199_213_78, -0.414_933_79, -0.276_392_74]),
        (0.5, 0.3, [-0.373_605_43, 0.418_646_04, 0.269_741_70, -0.074_860_93, 0.074_310_76]),
        (0.5, 1.0, [-0.360_624_53, 0.459_115_41, 0.299_408_68, -0.245_338_76, 0.228_544_86]),
        (0.9, 5.0, [-0.072_042_86, 0.433_480_19, 0.382_786_34, 0.101_423_93, 0.839_504_48]),
    ];
    for (share, flatness, [z_cg, i_axis, i_cg, apex, wall]) in rows {
        let (m, found) = spin_tank(Shape::Sphere { radius: 1.0 }, share, flatness, false);
        close(found.z_cg - 1.0, z_cg, 2e-8);
        close(found.i_axis / m, i_axis, 2e-8);
        close(found.i_cg / m, i_cg, 2e-8);
        close(found.z_apex.unwrap() - 1.0, apex, 2e-8);
        close(found.z_wall - 1.0, wall, 2e-8);
    }
}

/// At every spin the mass equals the mass at rest. At a spin of almost 0, centre of mass and
/// inertias also equal their values at rest.
#[test]
fn a_very_slow_spin_leaves_mass_centre_and_inertia_unchanged() {
    let shapes = [
        Shape::DomedCylinder { radius: 0.7, height: 1.0, bottom: -0.2, top: 0.3 },
        Shape::Annulus { inner_radius: 0.3, outer_radius: 1.0, height: 1.0 },
        Shape::Torus { ring_radius: 0.8, tube_radius: 0.3 },
        Shape::Cone { half_angle: 40.0, height: 1.0 },
    ];
    for shape in shapes {
        let tank = Tank::from_shape(shape, RHO).unwrap();
        let data = tank.solve(tank.fill_height(Fill::Share(0.6)).unwrap(), 1).unwrap();
        let found = spin(&tank, &data, 1e-5, 9.81, None).unwrap();
        close(found.z_cg, data.z_cg, 1e-7);
        close(found.i_axis / data.i_frozen_axis, 1.0, 1e-7);
        close(found.i_cg / data.i_frozen_cg, 1.0, 1e-7);
        assert!(found.in_range && found.warnings.is_empty(), "{shape:?}: {found:?}");
    }
}

/// The expected frequencies come from a solution that is valid for any spin rate. They are in the
/// rotating frame of the tank, in units of sqrt(g/R), for waves that run against the spin and with
/// the spin.
#[test]
fn frequencies_of_waves_in_a_spinning_cylinder_equal_the_theory_of_rotating_liquid() {
    let rows = [
        (1.0, 0.1, [1.491_836, 1.182_808], 0.007),
        (0.25, 0.1, [1.180_696, 0.702_227], 0.04),
        (1.0, 0.3, [1.626_519, 1.105_629], 0.025),
        (2.0, 0.3, [1.629_31, 1.171_45], 0.024),
    ];
    for (h, flatness, expected, error) in rows {
        let shape = Shape::Cylinder { radius: 1.0, height: 4.0 };
        let (_, found) = spin_tank(shape, h / 4.0, flatness, false);
        for (f, l) in found.frequencies.unwrap().into_iter().zip(expected) {
            close(f * TAU / l, 1.0, error);
        }
    }
}

/// The inertia about the axis is 5.09 kg·m² at rest and 6.38 kg·m² for the rotating liquid, whose
/// surface touches the lid.
#[test]
fn a_fast_spin_is_out_of_the_range_of_the_model() {
    let tank = Tank::from_shape(Shape::Cylinder { radius: 0.3, height: 0.6 }, RHO).unwrap();
    let data = tank.solve(0.4, 1).unwrap();
    let found = spin(&tank, &data, 9.0, 5.0, None).unwrap();
    close(found.i_axis, 6.38, 0.005);
    close(found.z_apex.unwrap(), 0.06, 0.005);
    close(found.flatness.unwrap(), 4.86, 1e-12);
    close(found.ratio.unwrap(), 3.3, 0.05);
    let has_no_mode = found.warnings.iter().any(|warning| warning.contains("inertial waves"));
    assert!(!found.in_range && has_no_mode, "{:?}", found.warnings);
    let slow = spin(&tank, &data, 0.2, 5.0, None).unwrap();
    assert!(slow.in_range && slow.warnings.is_empty(), "{:?}", slow.warnings);
    let faster = spin(&tank, &data, 1.5, 5.0, None).unwrap();
    assert!(faster.in_range && faster.warnings.is_empty(), "{:?}", faster.warnings);
    close(faster.gyroscopic.unwrap(), 0.46, 0.02);
    let tank = Tank::from_shape(Shape::Sphere { radius: 0.3 }, RHO).unwrap();
    let data = tank.solve(0.3, 1).unwrap();
    let sphere = spin(&tank, &data, 1.5, 5.0, None).unwrap();
    assert!(sphere.in_range && sphere.warnings[0].contains("pendulum"), "{:?}", sphere.warnings);
}

/// The expected mass is an independent integral over the radius, 2 pi rho int r (z_surface -
/// z_floor) dr.
#[test]
fn spin_dries_the_floor_of_an_annulus_at_its_inner_wall() {
    let shape = Shape::Annulus { inner_radius: 0.4, outer_radius: 1.0, height: 3.0 };
    let (m, found) = spin_tank(shape, 0.1, 3.0, false);
    // z = (r^2 - r_dry^2) Omega^2/(2 g) above the floor, from r_dry to the wall
    assert!(found.r_dry > 0.4 && !found.in_range, "{found:?}");
    let u = 1.0 - found.r_dry * found.r_dry;
    close(RHO * PI * 1.5 * u * u / 2.0, m, 1e-9 * m);
    close(found.z_wall, 1.5 * u, 1e-9);
}

/// A bowl lies below a wider chamber. Spin would throw the liquid outwards into both, so that it
/// would lie in two pools.
#[test]
fn spin_is_refused_if_the_liquid_may_lie_in_two_pools() {
    let hourglass = "density = 1000\nprofile = [{ line = [0, 0, 0.5, 0] }, { line = [0.5, 0, 0.5, 0.5] }, \
                     { line = [0.5, 0.5, 1.5, 0.5] }, { line = [1.5, 0.5, 1.5, 1.5] }]";
    let tank = Tank::parse(hourglass, ".".as_ref()).unwrap();
    let data = tank.solve(0.4, 1).unwrap();
    assert!(spin(&tank, &data, 0.5, 9.81, None).unwrap().in_range);
    let error = spin(&tank, &data, 2.0, 9.81, None).unwrap_err();
    assert!(error.to_string().contains("separate pools"), "{error}");
}

#[test]
fn spin_is_refused_for_boxes_full_tanks_and_invalid_rates() {
    let cylinder = Tank::from_shape(Shape::Cylinder { radius: 0.3, height: 0.6 }, RHO).unwrap();
    let data = cylinder.solve(0.4, 1).unwrap();
    for omega in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = spin(&cylinder, &data, omega, 5.0, None).unwrap_err();
        assert!(error.to_string().contains("above 0"), "{error}");
    }
    let square = Tank::parse("density = 1000\nbox = [0.4, 0.4]", ".".as_ref()).unwrap();
    let data = square.solve(0.2, 1).unwrap();
    assert!(spin(&square, &data, 1.0, 5.0, None).unwrap_err().to_string().contains("box"));
    let sphere = Tank::from_shape(Shape::Sphere { radius: 0.3 }, RHO).unwrap();
    let full = sphere.solve(0.6, 1).unwrap();
    assert!(spin(&sphere, &full, 1.0, 5.0, None).unwrap_err().to_string().contains("full"));
}

/// Friction at the floor gives the decay rate of the spin sqrt(nu Omega)/h, with the kinematic
/// viscosity nu, the spin rate Omega and the depth h. The gyroscopic coefficient of an upright
/// cylinder at h/R = 1 is 0.496.
#[test]
fn parameter_sets_contain_the_spin_of_the_liquid() {
    let of = |shape: Shape, nu: Option<f64>, target: Target| {
        let tank = Tank::from_shape(shape, RHO).unwrap();
        let liquid = Liquid { gravity: 5.0, nu, sigma: None, contact_angle: 90.0, spin: Some(2.0) };
        let data = solve(&tank, Fill::Height(0.3), 2, liquid).unwrap();
        let set = ParameterSet::new(&tank, &data, target, liquid).unwrap();
        let i_axis = data.spin.unwrap().i_axis;
        (set, i_axis)
    };
    let value = |set: &ParameterSet, name: &str| {
        set.values.iter().find_map(|(other, value)| match value {
            Value::Real(x) if other == name => Some(*x),
            _ => None,
        })
    };
    let cylinder = Shape::Cylinder { radius: 0.3, height: 0.6 };
    let (set, i_axis) = of(cylinder, Some(1e-6), Target::Spacecraft { tank: 2 });
    assert_eq!(value(&set, "tank[2].spin_inertia"), Some(i_axis));
    assert_eq!(value(&set, "tank[2].I_z"), Some(0.0));
    close(value(&set, "tank[2].gyroscopic[1]").unwrap(), 0.496, 1e-3);
    close(value(&set, "tank[2].spin_decay[1]").unwrap() * 0.3 / 2e-6_f64.sqrt(), 1.0, 1e-9);
    let sphere = Shape::Sphere { radius: 0.3 };
    let (set, i_axis) = of(sphere, None, Target::SloshTank);
    assert_eq!(value(&set, "tank.spin_inertia"), Some(i_axis));
    assert_eq!(value(&set, "tank.gyroscopic[1]"), None);
    let (set, _) = of(cylinder, None, Target::HubSlosh);
    assert!(!set.values.iter().any(|(name, _)| name.contains("spin")), "{:?}", set.values);
}
