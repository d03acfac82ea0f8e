//! The first mode in an upright cylinder to third order in its amplitude, without fitted numbers. The model is a mass m on a
//! paraboloid with a quartic spring. Its coefficients s and kappa are functions of the fill:
//!
//! ```text
//! E = m [(x' - w y)^2 + (y' + w (r + x))^2 + s (q.q')^2/l^2]/2
//!     + m (g/l) [|q|^2/2 + kappa |q|^4/(8 l^2)]
//! ```
//!
//! At the amplitude a l the squared frequency omega^2 of planar motion changes by the factor 1 + (3 kappa/8 - s/2) a^2, and
//! that of circular motion by the factor 1 + (kappa/2) a^2. A pendulum has s = kappa = 1. Here s and kappa are chosen so
//! that both shifts are those of potential flow. `harness/tank/src/third_order.rs` derives them and computes them by another
//! method, and tests/physics/liquid.rs compares the results. The closed form below is for R = g = 1, with T = xi_1 tanh(xi_1
//! h) = omega_1^2. The sums are over the modes with azimuthal numbers 0 and 2 that the square of the first mode excites
//! (zero xi, overlap e, t = xi tanh(xi h)):
//! ```text
//! A = xi_1^2 - xi^2/2 - T^2,   F = xi^2/2 - T t
//! static  = e A^2/(16 T^2),    carried = e T t/8
//! driven  = e [t A^2/(16 T^2) - A F/(2 T) + F^2/(4 T)]/(t - 4 T)
//! planar   = -8 B { 3 xi_1^2 M/64 + sum [1/2 at 0, 1/4 at 2] (static/2 + driven/4 - carried/2) }
//! circular = -4 B { xi_1^2 M/8 + sum_0 static + sum_2 (driven/2 - carried) }
//! ```
//!
//! At t = 4 T an excited mode has twice the frequency of the first mode. Near this secondary resonance the third
//! order is not valid.

use crate::cylinder::XI;

/// Ratio of two integrals over the cross-section of a cylinder of radius 1, int J1(xi_1 r)^4 r dr divided by int J1(xi_1 r)^2
/// r dr, where J1(xi_1 r) is the shape of the first mode.
const M: f64 = 0.278_821_981_660_245_8;

/// Squared amplitude a^2 of the wave a J1(xi_1 r), divided by the squared slosh angle, (2/((xi_1^2 - 1) J1(xi_1)))^2, in a
/// cylinder of radius 1.
const B: f64 = 2.068_401_064_148_324;

/// Slosh modes that the square of the first mode excites, for the azimuthal numbers 0 and 2. Each pair contains the zero xi
/// of the mode, and its coupling with the first mode, e = c^2/(n n_1) with c = int J1^2 J r dr, n = int J^2 r dr and n_1 =
/// int J1^2 r dr. The modes that are left out would change s and kappa by less than 1e-4 from h/R = 0.2 on.
const EXCITED: [[(f64, f64); 8]; 2] = [
    [
        (3.831_705_970_207_513, 4.011_801_530_216_258e-2),
        (7.015_586_669_815_617, 9.983_631_665_561_973e-6),
        (10.173_468_135_062_723, 3.566_979_610_968_818e-7),
        (13.323_691_936_314_223, 3.643_211_995_115_537e-8),
        (16.470_630_050_877_638, 6.306_722_350_678_291e-9),
        (19.615_858_510_468_236, 1.509_751_792_891_224e-9),
        (22.760_084_380_592_765, 4.508_374_747_463_396e-10),
        (25.903_672_087_618_382, 1.581_445_076_794_43e-10),
    ],
    [
        (3.054_236_928_227_14, 0.278_802_485_794_767),
        (6.706_133_194_158_459, 1.898_033_807_567_907e-5),
        (9.969_467_823_087_594, 4.640_713_362_506_481e-7),
        (13.170_370_856_016_124, 4.216_216_667_062_283e-8),
        (16.347_522_318_321_786, 6.924_523_932_097_042e-9),
        (19.512_912_782_488_208, 1.611_276_124_487_231e-9),
        (22.671_581_772_477_43, 4.729_971_111_991_247e-10),
        (25.826_037_141_785_257, 1.640_829_759_017_726e-10),
    ],
];

/// Relative difference between twice the frequency of the first mode and the frequency of an excited mode, below which
/// third-order theory is not valid.
const DETUNING: f64 = 0.01;

/// Range of fills h/R in which the coefficients are interpolated, because third-order theory has a pole wherever an excited
/// mode has twice the frequency of the first mode. Mode (2,2) has the pole at h/R = 0.831 and mode (0,2) at 1.010; the two
/// numbers of a mode are its azimuthal and its radial number.
pub const BRIDGED: [f64; 2] = [0.70, 1.20];

/// Returns the large-wave coefficients s (inertia) and kappa (stiffness) of the first slosh mode of an upright cylinder
/// filled to h/R = `fill`.
///
/// Within the range [`BRIDGED`] third-order theory has two poles, and close to a pole it is valid only for very small waves.
/// Both coefficients are therefore interpolated linearly between the ends of the range. The interpolated coefficients give
/// frequencies that differ from fully nonlinear potential flow by at most 0.3 % up to 16 degrees, at h/R = 0.8 and 1.0. A
/// pendulum would be much worse: its forced response is 26 % too low at h/R = 1.0.
pub fn coefficients(fill: f64) -> (f64, f64) {
    let [low, high] = BRIDGED;
    if fill <= low || fill >= high {
        return unbridged(fill);
    }
    let [(s_0, kappa_0), (s_1, kappa_1)] = BRIDGED.map(unbridged);
    let share = (fill - low) / (high - low);
    (s_0 + (s_1 - s_0) * share, kappa_0 + (kappa_1 - kappa_0) * share)
}

/// Returns the relative change of the squared natural frequency per squared slosh angle of a mode with the large-wave
/// coefficients s and kappa: 3 kappa/8 - s/2 in planar motion, and kappa/2 in circular motion.
pub fn shifts(s: f64, kappa: f64) -> [f64; 2] {
    [0.375 * kappa - 0.5 * s, 0.5 * kappa]
}

/// Returns the large-wave coefficients s and kappa by third-order theory at h/R = `fill`, without the interpolation of
/// [`coefficients`]. They grow without bound near the poles at 0.831 and 1.010.
pub fn unbridged(fill: f64) -> (f64, f64) {
    let t_1 = XI[0] * libm::tanh(XI[0] * fill);
    let k2 = XI[0] * XI[0];
    let mut planar = 3.0 / 64.0 * k2 * M;
    let mut circular = k2 * M / 8.0;
    for (azimuth, modes) in EXCITED.iter().enumerate() {
        for (xi, e) in modes {
            let t = xi * libm::tanh(xi * fill);
            let (a, f) = (k2 - xi * xi / 2.0 - t_1 * t_1, xi * xi / 2.0 - t_1 * t);
            let (of_static, carried) = (e * a * a / (16.0 * t_1 * t_1), e * t_1 * t / 8.0);
            let forced = t * a * a / (16.0 * t_1 * t_1) - a * f / (2.0 * t_1) + f * f / (4.0 * t_1);
            let driven = e * forced / (t - 4.0 * t_1);
            let both = of_static / 2.0 + driven / 4.0 - carried / 2.0;
            planar += if azimuth == 0 { both / 2.0 } else { both / 4.0 };
            circular += if azimuth == 0 { of_static } else { driven / 2.0 - carried };
        }
    }
    let (planar, circular) = (-8.0 * B * planar, -4.0 * B * circular);
    (1.5 * circular - 2.0 * planar, 2.0 * circular)
}

/// Returns the slosh mode that resonates with the first mode in an upright cylinder filled to h/R = `fill`, because its
/// frequency is twice the first mode's frequency within [`DETUNING`]: its azimuthal number, and its radial number, counted
/// from 1. The result is `None` if there is no such mode.
pub fn secondary_resonance(fill: f64) -> Option<(usize, usize)> {
    let t_1 = XI[0] * libm::tanh(XI[0] * fill);
    EXCITED.iter().enumerate().find_map(|(azimuth, modes)| {
        let n = modes.iter().position(|(xi, _)| {
            let ratio = libm::sqrt(4.0 * t_1 / (xi * libm::tanh(xi * fill)));
            (ratio - 1.0).abs() < DETUNING
        })?;
        Some((2 * azimuth, n + 1))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequency_shifts_of_the_bench_equal_potential_flow() {
        for (fill, planar, circular) in [(0.10, -0.429, 0.367), (0.05, -0.257, 0.421)] {
            let (s, kappa) = coefficients(fill / 0.0815);
            assert!((0.375 * kappa - 0.5 * s - planar).abs() < 6e-4, "{s} {kappa}");
            assert!((0.5 * kappa - circular).abs() < 6e-4, "{kappa}");
            assert_eq!(secondary_resonance(fill / 0.0815), None);
        }
    }

    /// The expected values, with twelve digits, come from another method: the averaged Lagrangian, made stationary by solving
    /// for the excited modes, with integrals by Gauss's rule. They verify sign and size of every term, also close to the
    /// resonance at h/R = 0.15.
    #[test]
    fn third_order_coefficients_equal_those_of_the_averaged_lagrangian() {
        for (fill, s, kappa) in [
            (0.2, -38.74226735998278, 22.32712645333884),
            (0.6135, 1.1444681651736963, 0.8416439361254805),
            (1.227, 1.407640267347122, 0.7341692160456458),
            (2.0, 1.4502237597113634, 0.7298828599314776),
            (5.0, 1.4524171652692395, 0.7298748807366736),
        ] {
            let found = coefficients(fill);
            assert!((found.0 / s - 1.0).abs() < 1e-11, "{fill} {found:?}");
            assert!((found.1 / kappa - 1.0).abs() < 1e-11, "{fill} {found:?}");
        }
    }

    #[test]
    fn the_range_of_a_secondary_resonance_ends_one_per_cent_away_from_its_depth() {
        for (near, beyond, mode) in [
            ([0.131207, 0.171408], [0.128838, 0.173340], (0, 1)),
            ([0.781046, 0.892573], [0.776228, 0.899858], (2, 2)),
            ([0.919713, 1.143618], [0.911728, 1.162381], (0, 2)),
        ] {
            assert_eq!(near.map(secondary_resonance), [Some(mode); 2]);
            assert!(beyond.iter().all(|fill| secondary_resonance(*fill).is_none()));
        }
    }

    #[test]
    fn a_depth_with_a_secondary_resonance_is_reported_with_the_resonant_mode() {
        assert_eq!(secondary_resonance(0.831), Some((2, 2)));
        assert_eq!(secondary_resonance(1.01), Some((0, 2)));
        // In deep liquid 2 omega_1 is 2.5 % above the frequency of (0,2).
        assert!([5.0, 1.3, 0.6].iter().all(|fill| secondary_resonance(*fill).is_none()));
    }
}
