//! Amplitude and frequency of the first mode of an upright cylinder.

use hubslosh_tank::third_order::Overlaps;

/// Excited modes of each azimuthal number: the terms fall as n^-5, 40 leave 1e-7.
const COUNT: usize = 40;

/// The bench's tank, R 81.5 mm. The values, three digits, are from an independent derivation; half
/// a unit of their last digit.
#[test]
fn shifts_of_the_bench_are_the_known_ones() {
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

/// The depth at which planar hardening begins, in units of R: the literature's 0.506 is what one
/// excited mode of each azimuthal number gives, 0.5058. With more of them it falls to 0.5031.
#[test]
fn planar_hardening_begins_at_0_5058_with_one_excited_mode_each_and_at_0_5031_with_all() {
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

/// 2 omega_1 = omega of modes (0,1), (2,2) and (0,2).
#[test]
fn secondary_resonances_stand_at_their_depths() {
    let depths = Overlaps::new(5).resonant_depths();
    assert_eq!(depths.len(), 3, "{depths:?}");
    let modes: Vec<_> = Overlaps::new(5).resonances().iter().map(|r| (r.1, r.2)).collect();
    assert_eq!(modes, [(0, 1), (2, 2), (0, 2)]);
    for (found, known) in depths.iter().zip([0.152_267, 0.831_377, 1.009_701]) {
        assert!((found - known).abs() < 1e-6, "{depths:?}");
    }
    // The third order has poles there.
    let all = Overlaps::new(5);
    assert!(all.equivalent(1.00975)[0].abs() > 50.0 && all.equivalent(1.2)[0].abs() < 2.0);
}
