//! Tests of the slosh model `liquid`: its coefficients, and the frequency shifts of its free oscillations, equal
//! those of potential flow.

use formulas::third_order::unbridged;
use hubslosh_tank::third_order::Overlaps;
use plant::SloshModel;

use super::free_oscillation::shifts;

/// The large-wave coefficients s and kappa of the plant include eight excited modes of each azimuthal number. Ten times as
/// many modes would change them by less than 1e-4 of their values. Near a secondary resonance both coefficients, and
/// therefore this difference, grow without bound.
#[test]
fn large_wave_coefficients_of_the_plant_equal_those_of_potential_flow() {
    let all = Overlaps::new(60);
    for i in 0..290 {
        let fill = 0.2 + 0.02 * f64::from(i);
        let (s, kappa) = unbridged(fill);
        let expected = all.equivalent(fill);
        for (found, expected) in [(s, expected[0]), (kappa, expected[1])] {
            assert!(
                (found - expected).abs() < 2e-4 * (1.0 + expected.abs()),
                "{fill} {found} {expected}"
            );
        }
    }
}

/// In the bench's tank, filled 10 and 5 cm deep, the frequency changes of planar and of rotary free oscillations must be
/// within 1 % of potential flow.
#[test]
fn the_slosh_model_liquid_has_the_frequency_shifts_of_third_order_potential_flow() {
    let all = Overlaps::new(40);
    for fill in [0.10, 0.05] {
        let (found, expected) = (shifts(SloshModel::Liquid, fill, 1e-4), all.shifts(fill / 0.0815));
        println!("{fill} m: {found:.4?}, potential flow {expected:.4?}");
        for i in 0..2 {
            assert!((found[i] / expected[i] - 1.0).abs() < 0.01, "{fill} {found:?} {expected:?}");
        }
    }
}
