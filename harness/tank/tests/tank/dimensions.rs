//! Every result scales with its physical dimension: a tank four times as large, or with a liquid of another density, gives
//! the same numbers in other units. Factors that are powers of four change no digit, so that any difference reveals a
//! constant with a hidden unit.

use crate::common::tank;
use hubslosh_tank::parameters::{Liquid, tank_damping};
use hubslosh_tank::{ModalData, Mode, Tank};

/// Tanks of each kind with a fill; an `@` marks lengths that are scaled. Some are solved in closed
/// form and some by the integral equation; some are full or thin.
const TANKS: [(&str, f64); 10] = [
    ("shape = { cylinder = { radius = @0.7, height = @2.0 } }", 0.6),
    ("shape = { annulus = { inner_radius = @0.3, outer_radius = @0.7, height = @2.0 } }", 0.6),
    ("box = [@0.9, @0.6]", 0.4),
    (
        "profile = [{ ellipse = [0, @0.3, @0.7, @0.3, -90, 0] }, { line = [@0.7, @0.3, @0.6, @1.3] }]",
        0.8,
    ),
    (
        "profile = [{ ellipse = [0, @-1.7, @0.7, @0.3, -90, 0] }, { line = [@0.7, @-1.7, @0.6, @-0.7] }]",
        0.8,
    ),
    (
        "profile = [{ line = [@0.3, @0.9, @0.3, 0] }, { line = [@0.3, 0, @0.7, 0] }, { line = [@0.7, 0, @0.7, @0.9] }]",
        0.6,
    ),
    ("shape = { torus = { ring_radius = @0.7, tube_radius = @0.3 } }", 0.4),
    ("shape = { sphere = { radius = @0.7 } }", 1.2),
    ("shape = { sphere = { radius = @0.7 } }", 1.4),
    ("shape = { spheroid = { radius = @0.7, half_height = @0.02 } }", 0.04),
];

fn solved(c: f64, rho: f64) -> Vec<(Tank, ModalData)> {
    let scaled = |text: &str| {
        let mut parts = text.split('@');
        let mut scaled = parts.next().unwrap().to_string();
        for part in parts {
            let end = part.find([',', ' ', ']']).unwrap();
            scaled += &format!("{:?}{}", c * part[..end].parse::<f64>().unwrap(), &part[end..]);
        }
        scaled
    };
    let one = |(text, fill): (&str, f64)| {
        let tank = tank(&format!("density = {rho:?}\n{}", scaled(text)));
        let data = tank.solve(c * fill, 3).unwrap();
        (tank, data)
    };
    TANKS.map(one).into()
}

type Quantity = (String, f64, i32, i32);

fn add_mode_quantities(axis: &str, modes: &[Mode], all: &mut Vec<Quantity>) {
    for mode in modes {
        let mut push = |what: &str, value: f64, length: i32, density: i32| {
            all.push((format!("{axis}{what} of mode {}", mode.n), value, length, density));
        };
        push("lambda", mode.lambda, -1, 0);
        push("lambda_R", mode.lambda_r.unwrap_or(0.0), 0, 0);
        push("lambda_L", mode.lambda_l.unwrap_or(0.0), 0, 0);
        push("m", mode.m, 3, 1);
        push("share", mode.m_ratio, 0, 0);
        push("l", mode.l, 1, 0);
        push("H", mode.height.unwrap_or(0.0), 1, 0);
        push("hinge", mode.hinge.unwrap_or(0.0), 1, 0);
        push("wave", mode.wave, 1, 0);
        push("inner wave", mode.wave_inner.unwrap_or(0.0), 1, 0);
        push("peak", mode.wave_peak.unwrap_or(0.0), 1, 0);
        push("peak's radius", mode.r_peak.unwrap_or(0.0), 1, 0);
        push("beta", mode.beta, -1, 0);
        push("m h", mode.m_h, 4, 1);
        push("m h^2", mode.m_h2, 5, 1);
        push("gradient", mode.surface_gradient, -2, 0);
        for [r, wave] in &mode.shape {
            push("shape's radius", *r, 1, 0);
            push("shape", *wave, 1, 0);
        }
    }
}

fn quantities(data: &ModalData) -> Vec<Quantity> {
    let mut all = vec![];
    let mut push = |what: &str, value: f64, length: i32, density: i32| {
        all.push((what.to_string(), value, length, density));
    };
    push("fill", data.fill, 1, 0);
    push("R", data.r_surface.unwrap_or(0.0), 1, 0);
    push("R_i", data.r_inner.unwrap_or(0.0), 1, 0);
    push("m_liq", data.m_liq, 3, 1);
    push("z_cg", data.z_cg, 1, 0);
    push("lowest", data.z_lowest, 1, 0);
    push("error", data.error, 0, 0);
    push("error of I_0", data.error_i_0, 0, 0);
    push("error of beta", data.error_beta, 0, 0);
    let inertias =
        [data.i_frozen_cg, data.i_frozen_axis, data.i_eff_cg, data.i_eff_axis.unwrap_or(0.0)];
    for inertia in inertias {
        push("inertia", inertia, 5, 1);
    }
    let axes = data.axes.iter().flat_map(|axes| [&axes.x, &axes.y]);
    let rests = axes.clone().flat_map(|axis| &axis.rest).chain(&data.rest);
    for rest in rests {
        push("m_0", rest.m_0, 3, 1);
        push("H_0", rest.height, 1, 0);
        push("I_0", rest.inertia, 5, 1);
    }
    add_mode_quantities("", &data.modes, &mut all);
    for axis in axes {
        all.push(("I".into(), axis.i_frozen_cg, 5, 1));
        all.push(("I_eff".into(), axis.i_eff_cg, 5, 1));
        add_mode_quantities("an axis's ", &axis.modes, &mut all);
    }
    all
}

/// The factors are powers of two, so that masses, lengths and frequencies must scale exactly.
#[test]
fn every_modal_parameter_scales_by_its_physical_dimension() {
    let one = solved(1.0, 512.0);
    for (c, rho) in [(4.0, 2048.0), (0.0625, 512.0)] {
        for ((_, a), (_, b)) in one.iter().zip(&solved(c, rho)) {
            let (a, b) = (quantities(a), quantities(b));
            assert_eq!(a.len(), b.len());
            for ((what, a, length, density), (_, b, ..)) in a.iter().zip(&b) {
                let expected = a * c.powi(*length) * (rho / 512.0).powi(*density);
                assert_eq!(*b, expected, "{what}, {c} times as large, {rho} kg/m³");
            }
        }
    }
}

/// The second tank is 4 times as large, and its times are 2 times as long. The dimensionless
/// numbers are then equal with the same gravity, 16/2 times the viscosity and 64/4 times the
/// surface tension.
#[test]
fn similar_tanks_have_the_same_damping_and_the_same_description() {
    let [one, large] = [1.0, 4.0].map(|c| solved(c, 512.0));
    for ((tank, data), (larger, scaled)) in
        one.iter().zip(&large).filter(|pair| !pair.0.1.modes.is_empty())
    {
        for (nu, sigma, gravity) in [(1e-6, 0.07, 8.0), (1e-3, 0.07, 1e-3), (0.05, 0.5, 0.0)] {
            let liquid = |sigma| Liquid {
                gravity,
                nu: None,
                sigma: Some(sigma),
                contact_angle: 90.0,
                spin: None,
            };
            let a = tank_damping(tank, data, nu, liquid(sigma)).unwrap();
            let b = tank_damping(larger, scaled, 8.0 * nu, liquid(16.0 * sigma)).unwrap();
            assert_eq!((a.shape, &a.taken), (b.shape, &b.taken));
            assert_eq!(a.warnings.len(), b.warnings.len());
            let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12 * a.abs(), "{} {a} {b}", a);
            for (a, b) in a.modes.iter().chain(&a.modes_y).zip(b.modes.iter().chain(&b.modes_y)) {
                close(a.omega, 2.0 * b.omega);
                close(a.zeta, b.zeta);
                close(a.laminar, b.laminar);
                close(a.interval[0], b.interval[0]);
                close(a.interval[1], b.interval[1]);
            }
        }
    }
}
