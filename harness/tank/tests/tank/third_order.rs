//! Amplitude and frequency of the first mode of an upright cylinder.

use crate::liquid_figure::resonances;
use hubslosh_tank::third_order::Overlaps;

/// Number of excited modes of each azimuthal number in the sums. The terms fall as n^-5, so that 40 modes leave an error of
/// 1e-7.
const COUNT: usize = 40;

/// The tank is the bench's, R = 81.5 mm. The expected values have three digits, and the tolerance
/// is half a unit of the last digit.
#[test]
fn frequency_shifts_of_the_bench_equal_an_independent_derivation() {
    let all = Overlaps::new(COUNT);
    for (fill, shifts, equivalent) in
        [(0.10, [-0.429, 0.367], [1.408, 0.734]), (0.05, [-0.257, 0.421], [1.144, 0.842])]
    {
        let found = (all.shifts(fill / 0.0815), all.equivalent(fill / 0.0815));
        for i in 0..2 {
            assert!((found.0[i] - shifts[i]).abs() < 5e-4, "{fill} {found:?}");
            assert!((found.1[i] - equivalent[i]).abs() < 5e-4, "{fill} {found:?}");
        }
    }
}

/// Above a certain depth h/R planar motion softens, below it hardens. With one excited mode of each
/// azimuthal number it is 0.5058, which the literature rounds to 0.506; with more excited modes it
/// falls to 0.5031.
#[test]
fn planar_hardening_begins_at_a_lower_depth_with_more_excited_modes() {
    let begins = |count: usize| {
        let all = Overlaps::new(count);
        let (mut low, mut high) = (0.4, 0.6);
        assert!(all.shifts(low)[0] > 0.0 && all.shifts(high)[0] < 0.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            (low, high) = if all.shifts(middle)[0] > 0.0 { (middle, high) } else { (low, middle) };
        }
        low
    };
    for (count, depth) in [(1, 0.50578), (2, 0.50339), (5, 0.50315), (10, 0.50314), (40, 0.50313)] {
        assert!((begins(count) - depth).abs() < 1e-5, "{count} {}", begins(count));
    }
}

/// At these depths the frequency of the excited modes (0,1), (2,2) and (0,2) is twice the frequency
/// of the first mode.
#[test]
fn secondary_resonances_occur_at_the_predicted_depths() {
    let found = resonances(&Overlaps::new(5));
    let modes: Vec<_> = found.iter().map(|r| r.1).collect();
    assert_eq!(modes, [[0, 1], [2, 2], [0, 2]]);
    for ((depth, _), known) in found.iter().zip([0.152_267, 0.831_377, 1.009_701]) {
        assert!((depth - known).abs() < 1e-6, "{found:?}");
    }
    // The third-order theory has poles at these depths.
    let all = Overlaps::new(5);
    assert!(all.equivalent(1.00975)[0].abs() > 50.0 && all.equivalent(1.2)[0].abs() < 2.0);
    assert_eq!(all.secondary_resonance(1.00975), Some([0, 2]));
    assert_eq!(all.secondary_resonance(1.2), None);
}

/// The closed form in `formulas` uses Bessel functions and eight modes of each azimuthal number,
/// whose overlap integrals have 15 digits.
#[test]
fn upright_cylinders_have_the_coefficients_of_the_closed_form() {
    let all = Overlaps::round(0.0, 0.5, 8);
    for i in 0..20 {
        let fill = 0.2 + 0.15 * f64::from(i);
        let (s, kappa) = formulas::third_order::unbridged(fill);
        let found = all.equivalent(0.5 * fill);
        assert!((found[0] - s).abs() < 1e-9 * (1.0 + s.abs()), "{fill} {found:?} {s}");
        assert!((found[1] - kappa).abs() < 1e-9 * (1.0 + kappa.abs()), "{fill} {found:?} {kappa}");
    }
}

/// Compares with Tadjbakhsh and Keller, J. Fluid Mech. 8 (1960) 442: the frequency to third order
/// and the elevation to second order.
#[test]
fn boxes_have_the_third_order_waves_of_tadjbakhsh_and_keller() {
    let length = 0.7;
    let k = std::f64::consts::PI / length;
    let all = Overlaps::rectangle(length);
    for fill in [0.05, 0.1, 0.2, 0.337, 0.5, 0.8, 1.2, 5.0] {
        let t = (std::f64::consts::PI * fill).tanh();
        let sigma = (9.0 * t.powi(-4) - 12.0 * t.powi(-2) - 3.0 - 2.0 * t * t)
            / (2.0 * std::f64::consts::PI.powi(2));
        let [planar, circular] = all.shifts(fill * length);
        assert!((planar - sigma).abs() < 1e-12 * (1.0 + sigma.abs()), "{fill} {planar} {sigma}");
        let [s, kappa] = all.equivalent(fill * length);
        assert_eq!((s, circular), (1.0, 0.0));
        assert!((0.375 * kappa - 0.5 - sigma).abs() < 1e-12 * (1.0 + sigma.abs()));
        // elevation at cos 2 k x = 1 and cos 2 w t = 1, for a first-order wave of 4/(a k^2) per angle
        let second = k / 8.0 * (t + 1.0 / t + 3.0 / t.powi(3) - 1.0 / t) * all.amplitude.powi(2);
        let found = all.second_wave(fill * length);
        assert!((found / second - 1.0).abs() < 1e-12, "{fill} {found} {second}");
    }
}

/// An annular tank without a hole is a circular cylinder. A thin annulus of radius R is a channel:
/// its planar wave equals the wave in a box of length pi R, and its circular wave is Stokes's wave
/// with the wave number k, the amplitude a and omega^2 = g k T [1 + (9 T^4 - 10 T^2 + 9) (k a)^2/(8
/// T^4)], where T = tanh(k h).
#[test]
fn annular_tanks_have_the_limits_of_a_circle_and_of_a_channel() {
    let (circle, ring) = (Overlaps::round(0.0, 1.0, 20), Overlaps::round(1e-3, 1.0, 20));
    for depth in [0.4, 0.7, 1.5] {
        for (a, b) in circle.equivalent(depth).iter().zip(ring.equivalent(depth)) {
            assert!((a - b).abs() < 1e-4 * (1.0 + a.abs()), "{depth} {a} {b}");
        }
    }
    let ring = Overlaps::round(0.999, 1.0, 4);
    let channel = Overlaps::rectangle(std::f64::consts::PI);
    for depth in [0.3_f64, 1.0, 3.0] {
        // the integral of psi^2 r dr is 1, so that psi at the wall is 1/sqrt(0.001)
        let per_wave = |overlaps: &Overlaps, wave: f64| {
            overlaps.shifts(depth).map(|shift| shift / (overlaps.amplitude * wave).powi(2))
        };
        let found = per_wave(&ring, 1e-3_f64.sqrt().recip());
        let t = depth.tanh();
        let stokes = (9.0 * t.powi(4) - 10.0 * t * t + 9.0) / (8.0 * t.powi(4));
        for (found, known) in found.into_iter().zip([per_wave(&channel, 1.0)[0], stokes]) {
            assert!((found - known).abs() < 5e-3 * (1.0 + known.abs()), "{depth} {found} {known}");
        }
    }
}
