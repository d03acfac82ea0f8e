//! Tests of the frequency of free oscillations as a function of the amplitude, for a pendulum and for a
//! liquid to third order.

use super::free_oscillation::{held, shifts, shifts_of};
use formulas::third_order::coefficients;
use plant::{Inputs, Parameters, Plant, SloshModel, SloshSource};

const SAMPLE: f64 = 1e-3;

/// If both large-wave coefficients s and kappa are 1, the relative change of the squared frequency must be −1/8 of the
/// squared angle in planar motion, and 1/2 of the squared displacement in circular motion, as for a pendulum.
#[test]
fn large_wave_coefficients_of_1_give_the_frequency_shift_of_a_pendulum() {
    let found = shifts(SloshModel::Spherical, 0.10, SAMPLE);
    assert!((found[0] / -0.125 - 1.0).abs() < 0.01, "{found:?}");
    assert!((found[1] / 0.5 - 1.0).abs() < 0.01, "{found:?}");
}

/// For the large-wave coefficients s and kappa of a depth, the relative change of the squared frequency per squared angle
/// must be 3 kappa/8 - s/2 in planar and kappa/2 in circular motion. `tests/physics/liquid.rs` compares these values with
/// potential flow at the same depths.
#[test]
fn the_model_liquid_has_the_frequency_shifts_of_third_order_theory() {
    for (depth, potential_flow) in [(0.10, [-0.4285, 0.3671]), (0.05, [-0.2566, 0.4208])] {
        let found = shifts(SloshModel::Liquid, depth, SAMPLE);
        let (s, kappa) = coefficients(depth / 0.0815);
        let expected = [3.0 * kappa / 8.0 - s / 2.0, kappa / 2.0];
        for i in 0..2 {
            assert!((found[i] / expected[i] - 1.0).abs() < 0.01, "{found:?} {expected:?}");
            let known = potential_flow[i];
            assert!((expected[i] - known).abs() < 1e-4, "{expected:?}");
        }
    }
}

fn table(mut p: Parameters, s: f64, kappa: f64) -> Parameters {
    p.slosh.source = SloshSource::Table;
    let table = &mut p.slosh.table;
    (table.m_liq, table.mass[0], table.length[0]) = (2.0, 0.8, 0.05);
    (table.nonlinear_inertia[0], table.nonlinear_stiffness[0]) = (s, kappa);
    p
}

/// The tested pairs of s and kappa include soft and hard springs. For each pair the measured change of the frequency must
/// agree with third-order theory.
#[test]
fn large_wave_coefficients_in_a_table_give_the_frequency_shifts_of_third_order_theory() {
    for (s, kappa) in [(1.0, 1.0), (1.4, 0.73), (0.3, 2.0), (3.0, 1.2), (1.0, -0.8)] {
        let p = table(held(SloshModel::Liquid, 0.1), s, kappa);
        let found = shifts_of(p, SAMPLE);
        let expected = [3.0 * kappa / 8.0 - s / 2.0, kappa / 2.0];
        for i in 0..2 {
            assert!((found[i] - expected[i]).abs() < 0.015, "{s} {kappa}: {found:?} {expected:?}");
        }
    }
}

/// If the table leaves s and kappa at 1, the values of a pendulum, the model `liquid` warns, because it is meant for the
/// tank's own coefficients.
#[test]
fn the_model_liquid_warns_about_a_table_without_large_wave_coefficients() {
    let warnings = |p: &Parameters| Plant::warnings(p, &Inputs::default());
    let p = table(held(SloshModel::Liquid, 0.1), 1.0, 1.0);
    assert!(warnings(&p)[0].contains("like the frequency of a pendulum"), "{:?}", warnings(&p));
    assert_eq!(warnings(&table(p, 1.0, 1.1)), [""; 0]);
    for (model, is_used) in [
        (SloshModel::Linear, true),
        (SloshModel::Planar, false),
        (SloshModel::Spherical, false),
        (SloshModel::Liquid, true),
    ] {
        let mut other = p;
        other.slosh.model = model;
        for name in ["slosh.table.nonlinear_inertia", "slosh.table.nonlinear_stiffness"] {
            assert_eq!(other.overridden(name).is_none(), is_used, "{model:?} {name}");
        }
    }
}
