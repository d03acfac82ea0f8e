//! Dependence of the frequency of free oscillations on amplitude: a pendulum, and a liquid
//! to third order.

use super::free_oscillation::shifts;
use formulas::third_order::coefficients;
use plant::SloshModel;

/// Sampling interval of motions, s.
const SAMPLE: f64 = 1e-3;

#[test]
fn a_pendulum_has_the_shifts_of_a_pendulum() {
    let found = shifts(SloshModel::Spherical, 0.10, SAMPLE);
    assert!((found[0] / -0.125 - 1.0).abs() < 0.01, "{found:?}");
    assert!((found[1] / 0.5 - 1.0).abs() < 0.01, "{found:?}");
}

/// With the inertia s and the spring kappa of the third order: planar 3 kappa/8 - s/2, circular kappa/2.
/// `tests/physics/liquid.rs` compares with potential flow at the two depths.
#[test]
fn a_liquid_has_the_shifts_of_the_third_order() {
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
