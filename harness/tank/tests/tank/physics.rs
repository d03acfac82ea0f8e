//! Facts of potential flow that hold for every tank, and known solutions.

use crate::common::{reference, solve, tank, toml};
use hubslosh_tank::closed_form;

/// The wall does no work on the liquid if the sphere rotates about its centre. Heights are computed
/// as first moment divided by mass, so that their error is 1e-10 divided by the ratio of modal mass
/// to liquid mass.
#[test]
fn pendulum_hinges_in_a_sphere_are_at_its_centre_at_every_fill() {
    for i in 1..20 {
        let fill = 0.1 * i as f64;
        let data = solve("shape = { sphere = { radius = 1.0 } }", fill, 5);
        for mode in data.modes.iter().filter(|m| m.m_ratio > 1e-4) {
            assert!((mode.hinge.unwrap() - 1.0).abs() < 1e-8, "{fill}: {:?}", mode.hinge);
        }
        // With all modes, m_liq z_cg = - sum m_n l_n and, about the centre of the sphere, I_eff = sum m_n l_n^2. With only
        // five modes, the remainder of each sum has a known sign.
        let first: f64 = data.modes.iter().map(|m| m.m * m.l).sum();
        let second: f64 = data.modes.iter().map(|m| m.m * m.l * m.l).sum();
        let lever = data.z_cg - 1.0;
        assert!(first <= -data.m_liq * lever * (1.0 + 1e-9));
        assert!(second <= (data.i_eff_cg + data.m_liq * lever * lever) * (1.0 + 1e-9));
    }
}

/// Compares with the half-full sphere of Budiansky (1960), to more digits, and with a table whose
/// nine digits were computed twice.
#[test]
fn spheres_have_the_known_frequencies_and_masses() {
    let table = [
        (0.2, [1.07232462, 6.20080678, 11.8821212], 0.93038015, 0.586052),
        (0.4, [1.15826125, 5.67421712, 9.85512957], 0.85436779, 0.760974),
        (0.6, [1.26250646, 5.36832242, 8.94180627], 0.77116555, 0.845905),
        (0.8, [1.39239256, 5.24057933, 8.55088335], 0.67990224, 0.873390),
        (1.0, [1.56015717, 5.27554605, 8.50444106], 0.57969303, 0.855754),
        (1.2, [1.78817812, 5.49297812, 8.77927578], 0.46980475, 0.798418),
        (1.4, [2.12320309, 5.97282709, 9.47622319], 0.35009382, 0.702972),
        (1.6, [2.68634836, 6.95709316, 10.9556822], 0.22222581, 0.567160),
        (1.8, [3.95930218, 9.45347792, 14.7548353], 0.09363797, 0.379989),
    ];
    for (fill, lambda, mass, wave) in table {
        let data = solve("shape = { sphere = { radius = 1.0 } }", fill, 3);
        for (mode, lambda) in data.modes.iter().zip(lambda) {
            let digit = if lambda < 10.0 { 6e-9 } else { 6e-8 };
            assert!((mode.lambda - lambda).abs() < digit, "{fill}: {} {lambda}", mode.lambda);
        }
        assert!((data.modes[0].m_ratio - mass).abs() < 6e-9, "{fill}");
        assert!((data.modes[0].wave - wave).abs() < 6e-7, "{fill}");
    }
}

/// Nearly empty, the sphere is a shallow paraboloid, in which lambda_n R tends to 2 n^2 - 1. Nearly
/// full, it is the ice-fishing problem (a small circular opening in a plane lid), in which lambda_1
/// times the radius of the surface is 2.7547.
#[test]
fn modes_of_nearly_empty_and_nearly_full_spheres_have_the_known_limits() {
    let data = solve("shape = { sphere = { radius = 1.0 } }", 1e-3, 3);
    for (mode, limit) in data.modes.iter().zip([1.0, 7.0, 17.0]) {
        assert!((mode.lambda / limit - 1.0).abs() < 3e-3, "{}", mode.lambda);
    }
    assert!(data.modes[0].m_ratio > 0.999);
    let data = solve("shape = { sphere = { radius = 1.0 } }", 1.9999, 1);
    let a = data.r_surface.unwrap();
    assert!((data.modes[0].lambda * a - 2.7489).abs() < 1e-4 && (a - 0.014).abs() < 2e-4);
    assert!((data.modes[0].m / (1000.0 * a.powi(3)) - 1.933).abs() < 0.01);
}

/// A shallow dish leaves almost no inertia for the fixed mass after five modes, so that the
/// computed inertia consists of its numerical error. The fixed mass is at the sphere's centre, 7 to
/// 220 surface radii above the liquid.
#[test]
fn the_inertia_of_a_shallow_dish_is_within_its_stated_error() {
    for fill in [1e-2, 1e-3, 1e-4, 1e-5] {
        let data = solve("shape = { sphere = { radius = 1.0 } }", fill, 5);
        let scale = data.m_liq * data.r_surface.unwrap().powi(2);
        let inertia = data.rest(5).inertia / scale;
        assert!(inertia.abs() < data.error_i_0, "{fill}: {inertia} {}", data.error_i_0);
        // The lever arm makes the stated error at most (1 + 220)^2 times the error of the other values. A stated error
        // above this bound would be useless.
        assert!(data.error_i_0 < 1e5 * data.error);
    }
}

/// The expected inertias are sums over 20,000 modes, whose remainder is 50^3 times as small as the
/// remainder after 400 modes. In shallow liquid a sum of 400 modes has an error of 3e-10 m R^2 for
/// the cylinder and of 7e-9 m R^2 for the annulus, with the mass m and the radius R.
#[test]
fn closed_forms_have_their_stated_error_in_shallow_liquid() {
    let xi = closed_form::zeros_of_j1_slope(20_000);
    let waves: Vec<f64> = (0..20_000).map(|n| (2 * n + 1) as f64 * core::f64::consts::PI).collect();
    for h in [1.0f64, 0.1, 1e-2, 1e-3, 1e-4] {
        let sum: f64 = xi.iter().map(|x| (0.5 * x * h).tanh() / (x.powi(3) * (x * x - 1.0))).sum();
        let exact = h * h / 12.0 - 0.75 + 16.0 / h * sum;
        let data = closed_form::cylinder(0.5, 0.5 * h, 1.0, 1);
        let off = data.i_eff_cg / (data.m_liq * 0.25) - exact;
        assert!(off.abs() < data.error, "cylinder {h}: {off}");
        let sum: f64 = waves.iter().map(|k| (0.5 * k * h).tanh() / k.powi(5)).sum();
        let exact = h * h / 12.0 - 0.25 + 64.0 / h * sum;
        let data = closed_form::rectangular(1.0, 1.0, h, 1.0, 1);
        let off = data.i_eff_cg / data.m_liq - exact;
        assert!(off.abs() < data.error * 0.25, "box {h}: {off}");
    }
    // rounding errors of the boundary integral equation are 3e-14 R/h
    let h = 1e-2;
    let ring = format!(
        "profile = [{{ line = [0.5, {h}, 0.5, 0] }}, {{ line = [0.5, 0, 1, 0] }}, {{ line = [1, 0, 1, {h}] }}]"
    );
    let (exact, solved) = (closed_form::annulus(0.5, 1.0, h, 1000.0, 1), solve(&ring, h, 1));
    let off = (exact.i_eff_cg - solved.i_eff_cg) / exact.m_liq;
    assert!(off.abs() < 1e-11, "annulus: {off}");
}

/// The inertia of the fixed mass is the effective inertia of all liquid minus the parts m h^2 of
/// the fixed mass and of every mode at its height h. The error of this difference is at least the
/// error of the effective inertia, and grows with the distance of the fixed mass from the centre of
/// mass.
#[test]
fn the_stated_error_of_the_fixed_mass_inertia_is_at_least_that_of_its_inputs() {
    for (shape, fill) in [
        ("cylinder = { radius = 1.0, height = 9.0 }", 0.3),
        ("cylinder = { radius = 1.0, height = 9.0 }", 9.0),
        ("sphere = { radius = 1.0 }", 1.0),
        ("sphere = { radius = 1.0 }", 1.9),
        ("torus = { ring_radius = 1.0, tube_radius = 0.4 }", 0.3),
    ] {
        let data = solve(&format!("shape = {{ {shape} }}"), fill, 3);
        let lever = (data.rest(3).height - data.z_cg).abs() / data.r_surface.unwrap();
        assert!(data.error_i_0 >= (1.0 + lever * lever) * data.error, "{shape} {fill}: {lever}");
    }
}

/// The exact solution is the velocity potential r z with the eigenvalue 1/h. Its mode has 3/4 of
/// the liquid's mass at the height 0.6 h, the hinge at 1.6 h, and the wave height h.
#[test]
fn only_the_first_mode_of_a_45_degree_cone_carries_mass() {
    for h in [0.3, 1.2] {
        let data = solve("shape = { cone = { half_angle = 45.0, height = 1.5 } }", h, 5);
        let first = &data.modes[0];
        for (value, exact) in [
            (first.lambda, 1.0 / h),
            (first.m_ratio, 0.75),
            (first.height.unwrap(), 0.6 * h),
            (first.hinge.unwrap(), 1.6 * h),
            (first.wave, h),
            (data.rest[0].height, 1.2 * h),
        ] {
            assert!((value / exact - 1.0).abs() < 1e-10, "{value} {exact}");
        }
        assert!(data.modes[1..].iter().all(|m| m.m_ratio < 1e-12));
    }
}

/// The fixed mass is an added mass with pressure 0 on the surface, so that it cannot be negative.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn the_fixed_mass_is_positive_for_any_number_of_modes() {
    for case in reference() {
        let data = tank(&toml(&case)).solve(case["fill"].as_f64().unwrap(), 20).unwrap();
        for modes in 0..=20 {
            let rest = data.rest(modes);
            assert!(rest.m_0 > 0.0, "{} {modes}: {}", case["name"], rest.m_0);
            let scale = data.m_liq * data.r_surface.unwrap_or(0.4).powi(2);
            assert!(rest.inertia > -1e-9 * scale, "{} {modes}: {}", case["name"], rest.inertia);
        }
    }
}

/// The boundary integral equation uses only the contour and has an error of 1e-10 here.
#[test]
fn closed_forms_agree_with_the_boundary_integral_equation() {
    let upright = |r: f64, h: f64| {
        format!("profile = [{{ line = [0, 0, {r}, 0] }}, {{ line = [{r}, 0, {r}, {h}] }}]")
    };
    let ring = |ri: f64, r: f64, h: f64| {
        format!(
            "profile = [{{ line = [{ri}, {h}, {ri}, 0] }}, {{ line = [{ri}, 0, {r}, 0] }}, {{ line = [{r}, 0, {r}, {h}] }}]"
        )
    };
    let pairs = [
        (closed_form::cylinder(0.0815, 0.1, 1000.0, 5), solve(&upright(0.0815, 0.1), 0.1, 5)),
        (closed_form::cylinder(1.0, 0.2, 1000.0, 5), solve(&upright(1.0, 0.2), 0.2, 5)),
        (closed_form::cylinder(0.5, 3.0, 1000.0, 5), solve(&upright(0.5, 3.0), 3.0, 5)),
        (closed_form::annulus(0.5, 1.0, 0.8, 1000.0, 5), solve(&ring(0.5, 1.0, 0.8), 0.8, 5)),
        (closed_form::annulus(0.1, 0.7, 0.3, 1000.0, 5), solve(&ring(0.1, 0.7, 0.3), 0.3, 5)),
    ];
    // A shape with a closed form is solved by the closed form.
    for shape in [
        "cylinder = { radius = 0.5, height = 3.0 }",
        "annulus = { inner_radius = 0.1, outer_radius = 0.7, height = 3.0 }",
    ] {
        assert_eq!(solve(&format!("shape = {{ {shape} }}"), 0.3, 5).error, pairs[0].0.error);
    }
    for (exact, solved) in &pairs {
        let (m_liq, r) = (exact.m_liq, exact.r_surface.unwrap());
        assert!((exact.i_eff_cg - solved.i_eff_cg).abs() < 1e-9 * m_liq * r * r);
        assert!((exact.i_frozen_cg / solved.i_frozen_cg - 1.0).abs() < 1e-12);
        assert!((exact.i_frozen_axis / solved.i_frozen_axis - 1.0).abs() < 1e-12);
        for (a, b) in exact.modes.iter().zip(&solved.modes) {
            assert!((a.lambda / b.lambda - 1.0).abs() < 1e-9, "{} {}", a.lambda, b.lambda);
            assert!((a.m - b.m).abs() < 1e-9 * m_liq);
            assert!((a.m_h - b.m_h).abs() < 1e-9 * m_liq * r);
            assert!((a.m_h2 - b.m_h2).abs() < 1e-9 * m_liq * r * r);
            assert!((a.wave - b.wave).abs() < 1e-8 * r);
            assert!((a.wave_inner.unwrap_or(0.0) - b.wave_inner.unwrap_or(0.0)).abs() < 1e-8 * r);
            assert!((a.beta / b.beta - 1.0).abs() < 1e-6, "{} {}", a.beta, b.beta);
        }
    }
}

/// The modal masses of shallow liquid in a cylinder are proportional to 1/(xi^2 - 1), where the
/// numbers xi are the zeros of J_1'. The sum of these terms is 1/2; after the first 400 zeros the
/// remainder is 1/(400 pi^2). The inertia of all modes has known limits for a thin disc and for a
/// long rod of liquid.
#[test]
fn sums_over_all_modes_of_the_closed_forms_have_their_known_values() {
    let xi = closed_form::zeros_of_j1_slope(400);
    assert!(
        (xi[0] - 1.841_183_781_340_659_3).abs() < 1e-15
            && (xi[1] - 5.331_442_773_525_033).abs() < 1e-14
    );
    let sum: f64 = xi.iter().map(|x| 1.0 / (x * x - 1.0)).sum();
    assert!((sum - 0.5 + 1.0 / (400.0 * 9.87)).abs() < 1e-6);
    let sum: f64 = xi.iter().map(|x| 1.0 / (x * x * (x * x - 1.0))).sum();
    assert!((sum - 0.125).abs() < 1e-9);
    // The liquid of a thin disc rotates with its tank, with the inertia m R^2/4; so does the liquid of a long
    // rod, with m h^2/12.
    let disc = closed_form::cylinder(1.0, 1e-3, 1.0, 1);
    assert!((disc.i_eff_cg / (0.25 * disc.m_liq) - 1.0).abs() < 1e-2);
    let rod = closed_form::cylinder(1.0, 500.0, 1.0, 1);
    assert!((rod.i_eff_cg / (rod.m_liq * 500.0 * 500.0 / 12.0) - 1.0).abs() < 1e-4);
    // A square box takes along 0.1565 of the rigid liquid's inertia about the vertical axis.
    let yaw = closed_form::box_yaw_inertia(1.0, 1.0, 0.3, 1000.0) / (300.0 / 6.0);
    assert!((yaw - 0.1565).abs() < 5e-5, "{yaw}");
    assert!(
        (closed_form::box_yaw_inertia(0.8, 0.5, 0.4, 1.0)
            - closed_form::box_yaw_inertia(0.5, 0.8, 0.4, 1.0))
        .abs()
            < 1e-12
    );
}

/// The FMU's formulas are m_n = m_liq d tanh(2 xi h/d)/(xi (xi^2 - 1) h), l_n = d/(2 xi tanh(2 xi
/// h/d)) and a wave of 2 R/(xi^2 - 1) per angle.
#[test]
fn modes_of_an_upright_cylinder_equal_the_formulas_of_the_fmu() {
    let (d, h) = (0.163, 0.1);
    let data = solve("shape = { cylinder = { radius = 0.0815, height = 0.2 } }", h, 3);
    for (mode, xi) in data.modes.iter().zip([
        1.841_183_781_340_659_5,
        5.331_442_773_525_032_5,
        8.536_316_366_346_286,
    ]) {
        let tanh = f64::tanh(2.0 * xi * h / d);
        assert!(
            (mode.m / (data.m_liq * d * tanh / (xi * (xi * xi - 1.0) * h)) - 1.0).abs() < 1e-13
        );
        assert!((mode.l / (d / (2.0 * xi * tanh)) - 1.0).abs() < 1e-13);
        assert!((mode.wave / (d / (xi * xi - 1.0)) - 1.0).abs() < 1e-13);
    }
}

/// If all lengths are multiplied by c, lambda is divided by c, masses grow as c^3 and inertias as
/// c^5. A shift of the contour along the axis shifts all heights by the same amount and changes
/// nothing else.
#[test]
fn slosh_modes_scale_and_shift_with_the_contour_of_the_tank() {
    let profile = |c: f64, z: f64| {
        format!(
            "profile = [{{ ellipse = [0, {}, {}, {}, -90, 0] }}, {{ line = [{c}, {}, {}, {}] }}]",
            0.6 * c + z,
            c,
            0.6 * c,
            0.6 * c + z,
            0.7 * c,
            1.6 * c + z
        )
    };
    let data = solve(&profile(1.0, 0.0), 1.2, 5);
    let (large, shifted) = (solve(&profile(3.0, 0.0), 3.6, 5), solve(&profile(1.0, -2.0), 1.2, 5));
    assert!((shifted.z_cg - data.z_cg + 2.0).abs() < 1e-12);
    assert!((large.i_eff_cg / data.i_eff_cg / 243.0 - 1.0).abs() < 1e-10);
    assert!((shifted.i_eff_cg / data.i_eff_cg - 1.0).abs() < 1e-10);
    for ((a, b), c) in data.modes.iter().zip(&large.modes).zip(&shifted.modes) {
        assert!((a.lambda / b.lambda / 3.0 - 1.0).abs() < 1e-10);
        assert!((b.m / a.m / 27.0 - 1.0).abs() < 1e-9);
        assert!((b.hinge.unwrap() - 3.0 * a.hinge.unwrap()).abs() < 1e-8);
        assert!((a.lambda / c.lambda - 1.0).abs() < 1e-10 && (a.m / c.m - 1.0).abs() < 1e-9);
        assert!((c.hinge.unwrap() - a.hinge.unwrap() + 2.0).abs() < 1e-8);
    }
}

/// The angles between the segments are near the angle from which on two segments count as a corner.
#[test]
fn cutting_a_wall_into_more_segments_does_not_change_the_modes() {
    let one = solve("profile = [{ arc = [0, 1, 1, -90, 30] }]", 1.3, 5);
    let many = solve(
        "profile = [{ arc = [0, 1, 1, -90, -70] }, { arc = [0, 1, 1, -70, -3] }, { arc = [0, 1, 1, -3, 30] }]",
        1.3,
        5,
    );
    for (a, b) in one.modes.iter().zip(&many.modes) {
        assert!((a.lambda / b.lambda - 1.0).abs() < 1e-9);
        assert!((a.m - b.m).abs() < 1e-9 * one.m_liq);
    }
}

/// The true error is known from the hinge of a sphere and from the closed form of an annulus.
#[test]
fn the_true_error_is_below_the_stated_error_in_tanks_that_are_hard_to_solve() {
    compare_hinges_of_spheres(&[0.01, 1.99]);
}

#[test]
#[ignore = "three seconds: .ci/long-tests"]
fn the_true_error_is_below_the_stated_error_in_an_almost_full_sphere_and_in_a_thin_gap() {
    compare_hinges_of_spheres(&[1e-3, 1.95, 1.999, 1.9999]);
    let gap = "profile = [{ line = [0.98, 0.9, 0.98, 0] }, { line = [0.98, 0, 1, 0] }, { line = [1, 0, 1, 0.9] }]";
    let (exact, solved) = (closed_form::annulus(0.98, 1.0, 0.9, 1000.0, 5), solve(gap, 0.9, 5));
    for (a, b) in exact.modes.iter().zip(&solved.modes) {
        assert!((a.lambda / b.lambda - 1.0).abs() < solved.error);
        assert!((a.m - b.m).abs() / a.m < 1e-6 || a.m < 1e-6 * exact.m_liq);
    }
}

fn compare_hinges_of_spheres(fills: &[f64]) {
    for &fill in fills {
        let data = solve("shape = { sphere = { radius = 1.0 } }", fill, 5);
        let r = data.r_surface.unwrap();
        for mode in &data.modes {
            // m (hinge - 1) is 0, because the hinge is at the sphere's centre. The error of l is relative to l.
            let moment =
                (mode.m * (data.z_cg + mode.l - 1.0) + mode.m_h) / (data.m_liq * r.max(mode.l));
            assert!(moment.abs() < data.error, "{fill}: {moment:e} {:e}", data.error);
        }
    }
}

/// Errors of a full tank are stated relative to its radius of gyration. The sizes differ by powers
/// of two, so that all digits must agree.
#[test]
fn a_full_tank_s_error_does_not_depend_on_its_size() {
    let error = |c: f64| {
        let lens =
            format!("shape = {{ spheroid = {{ radius = {c:?}, half_height = {:?} }} }}", 0.02 * c);
        solve(&lens, 0.04 * c, 1).error
    };
    assert!(error(1.0) > 1e-10, "rounding alone: {:e}", error(1.0));
    assert_eq!([error(0.0625), error(16.0)], [error(1.0); 2]);
}

/// For a lens and a needle, two discretisations differ by 2e-7, so that a third, finer one is used.
/// A knuckle of 2 % of the radius gets panels that are as short as the gap between its ends. A
/// shelf 2 cm thick, 2 cm above the floor, needs shorter panels for an error of 1e-6.
#[test]
#[ignore = "three seconds: .ci/long-tests"]
fn thin_liquids_and_small_details_are_solved_as_accurately_as_other_tanks() {
    let lens = "shape = { spheroid = { radius = 1.0, half_height = 0.05 } }";
    let needle = "shape = { spheroid = { radius = 0.05, half_height = 1.0 } }";
    let knuckle = "shape = { torispherical = { radius = 1.0, height = 1.0, crown_radius = 2.0, knuckle_radius = 0.02 } }";
    let shelf = "profile = [{ line = [0, 0, 1, 0] }, { line = [1, 0, 1, 0.02] }, { line = [1, 0.02, 0.3, 0.02] }, \
        { line = [0.3, 0.02, 0.3, 0.04] }, { line = [0.3, 0.04, 1, 0.04] }, { line = [1, 0.04, 1, 1] }]";
    for (tank, fill, modes, error) in [
        (lens, 0.05, 5, 2e-7),
        (needle, 1.0, 5, 2e-7),
        (knuckle, 0.3, 5, 1e-9),
        (shelf, 0.6, 1, 1e-6),
    ] {
        let data = solve(tank, fill, modes);
        assert!(data.error < error, "{tank}: {:e}", data.error);
    }
}

/// A dome that bulges into the tank meets the cylinder in a cusp. The reference is a tank in which
/// the last 1e-3 R of the cusp is filled up.
#[test]
fn a_cusp_at_the_edge_of_an_inverted_dome_hardly_changes_the_modes() {
    let cusp = solve(
        "shape = { domed_cylinder = { radius = 1.0, height = 1.0, bottom = -0.4, top = 0.0 } }",
        0.7,
        3,
    );
    // the ellipse at r = 0.999 is at z = 0.4 sqrt(1 - 0.999^2) = 0.01788
    let angle = (0.999f64).acos().to_degrees();
    let z = 0.4 * (1.0 - 0.999f64 * 0.999).sqrt();
    let filled = solve(
        &format!(
            "profile = [{{ ellipse = [0, 0, 1, 0.4, 90, {angle}] }}, {{ line = [0.999, {z}, 1, {z}] }}, {{ line = [1, {z}, 1, 1] }}]"
        ),
        0.7 - z,
        3,
    );
    assert!(cusp.error < 1e-7, "{:e}", cusp.error);
    for (a, b) in cusp.modes.iter().zip(&filled.modes) {
        assert!((a.lambda / b.lambda - 1.0).abs() < 1e-4, "{} {}", a.lambda, b.lambda);
    }
}

/// In a thin annulus the first wave number is 1/R (a wave around the circle), and the next ones are
/// n pi/(R - R_i) (standing waves between the two walls).
#[test]
fn wave_numbers_of_an_annulus_scale_and_have_the_limits_of_a_thin_one() {
    let ones = closed_form::annular_wave_numbers(0.4, 1.0, 5);
    for count in [0, 1, 5] {
        assert_eq!(closed_form::annular_wave_numbers(0.4, 1.0, count), ones[..count]);
    }
    for size in [1e-3, 0.3, 7.0, 1e3] {
        let found = closed_form::annular_wave_numbers(0.4 * size, size, 5);
        for (k, one) in found.iter().zip(&ones) {
            // The wave numbers are zeros of functions of size 1, which have an error of some 1e-15.
            assert!((k * size / one - 1.0).abs() < 1e-12, "{size} {k} {one}");
        }
    }
    let thin = closed_form::annular_wave_numbers(0.99, 1.0, 3);
    // the mean radius of the thin annulus is smaller than the outer radius by half of the gap
    assert!((thin[0] * 0.995 - 1.0).abs() < 1e-3, "{}", thin[0]);
    for (n, k) in thin[1..].iter().enumerate() {
        let plane = (n + 1) as f64 * core::f64::consts::PI / 0.01;
        assert!((k / plane - 1.0).abs() < 1e-3, "{k} {plane}");
    }
}

/// With the wave number k of a mode and the length L of the box along its waves, the expected
/// eigenvalue times L is k L tanh(k h), with k L = pi, 3 pi, ….
#[test]
fn each_axis_of_a_box_has_the_frequencies_of_its_length() {
    let data = closed_form::rectangular(0.8, 0.5, 0.2, 1000.0, 2);
    let axes = data.axes.unwrap();
    for (axis, length) in [(axes.x, 0.8), (axes.y, 0.5)] {
        for (n, mode) in axis.modes.iter().enumerate() {
            let k_l = (2 * n + 1) as f64 * core::f64::consts::PI;
            let expected = k_l * (k_l * 0.2 / length).tanh();
            assert!((mode.lambda_l.unwrap() / expected - 1.0).abs() < 1e-14, "{length} {n}");
        }
    }
}
