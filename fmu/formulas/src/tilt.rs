//! Frequencies of the slosh modes of an upright cylinder whose axis is tilted from gravity.
//!
//! Gravity has the component g along the axis and g s across it, where s is the tangent of the tilt angle. The surface at
//! rest is the plane z = s x, with x in the direction of gravity's component across the axis. The depth in the middle is
//! that of the upright tank. With Lambda = omega^2/g
//!
//! ```text
//! Laplace(phi) = 0,   dphi/dn = 0 on the wetted wall,   dphi/dz - s dphi/dx = Lambda phi at z = s x
//! ```
//!
//! so that K - Lambda M is singular. By Green's identity `K_ij = int_D phi_i (phi_j,z - s phi_j,x)` and `M_ij = int_D phi_i
//! phi_j`, both at z = s x over the cross-section D of the tank. Here g times the element of D equals gravity along the
//! normal times the surface element. The modes of the upright tank, `J_m(xi r) cos(m theta) cosh(xi (z + h))/cosh(xi h)`
//! with the zeros xi of J_m', satisfy the wall condition for every s. Expansion to s^2 and Rayleigh-Schroedinger
//! perturbation of the mode a = xi_n of m = 1 give
//!
//! ```text
//! Lambda = lambda (1 + c s^2),    lambda = a tanh(a h),  mu = b tanh(b h)   (R = 1)
//! along x:  c = [(a^2 - lambda^2)(a^2 + 1)/4 - (a^2 + 2)/2]/(a^2 - 1) + S_0 + S_2
//! across:   c = [(a^2 - lambda^2)(a^2 + 1)/12 + (a^2 - 2)/2]/(a^2 - 1) + S_2
//! S_0 = sum over J_0'(b) = 0, b = 0 too, of 2 a^2/(a^2 - 1) N_0^2/[(a^2 - b^2)^4 lambda (lambda - mu)]
//! S_2 = sum over J_2'(b) = 0 of a^2 b^2/[(a^2 - 1)(b^2 - 4)] N_2^2/[(a^2 - b^2)^4 lambda (lambda - mu)]
//! N_0 = 2 a^2 b^2 - lambda^2 (a^2 + b^2)
//! N_2 = 2 (a^2 b^2 - a^2 - b^2) - lambda^2 (a^2 + b^2 - 4)
//! ```
//!
//! The integrals of products of Bessel functions are Lommel's. We derived the formulas by the method of Kato, Perturbation
//! Theory for Linear Operators (1966), chapter II. The tests compare them with finite elements in three dimensions.

use crate::cylinder::XI;

/// Number of modes of each azimuthal number in the perturbation sums. With all modes the coefficient c in the frequency
/// change 1 + c slope^2 would differ by less than 1e-6 of its value for mode 1, and by 0.003 for mode 10 (h/R of 0.2 and
/// more).
const ZEROS: usize = 16;

/// Zeros of J0', the derivative of the Bessel function J0, without the zero at 0. `XI_2` contains the zeros of J2'.
const XI_0: [f64; ZEROS] = [
    3.831_705_970_207_512_5,
    7.015_586_669_815_619,
    10.173_468_135_062_722,
    13.323_691_936_314_223,
    16.470_630_050_877_634,
    19.615_858_510_468_243,
    22.760_084_380_592_772,
    25.903_672_087_618_382,
    29.046_828_534_916_855,
    32.189_679_910_974_405,
    35.332_307_550_083_87,
    38.474_766_234_771_614,
    41.617_094_212_814_45,
    44.759_318_997_652_82,
    47.901_460_887_185_44,
    51.043_535_183_571_51,
];
const XI_2: [f64; ZEROS] = [
    3.054_236_928_227_140_4,
    6.706_133_194_158_459,
    9.969_467_823_087_596,
    13.170_370_856_016_122,
    16.347_522_318_321_783,
    19.512_912_782_488_204,
    22.671_581_772_477_428,
    25.826_037_141_785_264,
    28.977_672_772_993_678,
    32.127_327_020_443_474,
    35.275_535_050_674_69,
    38.422_654_817_555_91,
    41.568_934_936_074_314,
    44.714_553_532_819_735,
    47.859_641_607_992_096,
    51.004_297_672_458_87,
];

/// Returns the largest slope of the free surface at which [`factors`] gives the frequency of the first mode with an error of
/// at most 1 %, in a tank filled to h/R = `fill`. At half this slope the error is 0.15 %. At a slope of h/R a part of the
/// bottom would be dry.
pub fn largest_slope(fill: f64) -> f64 {
    0.7 * f64::min(fill, 1.0)
}

/// Returns the coefficients c with which a sloping surface changes the squared frequency of slosh mode `n` by the factor 1 +
/// c slope^2: the first for motion along the slope, the second for motion across it. `fill` is h/R of the upright tank. The
/// first mode has the number 0, and `n` must be below [`crate::cylinder::MODES`].
pub fn coefficients(n: usize, fill: f64) -> [f64; 2] {
    let a2 = XI[n] * XI[n];
    let lambda = XI[n] * libm::tanh(XI[n] * fill);
    let l2 = lambda * lambda;
    let term = |b: f64, weight: f64, overlap: f64| {
        let apart = (a2 - b * b) * (a2 - b * b);
        let mu = b * libm::tanh(b * fill);
        weight * overlap * overlap / (apart * apart * lambda * (lambda - mu))
    };
    let of_0 = |b: f64| {
        let b2 = b * b;
        term(b, 2.0 * a2 / (a2 - 1.0), 2.0 * a2 * b2 - l2 * (a2 + b2))
    };
    let of_2 = |b: f64| {
        let b2 = b * b;
        let overlap = 2.0 * (a2 * b2 - a2 - b2) - l2 * (a2 + b2 - 4.0);
        term(b, a2 * b2 / ((a2 - 1.0) * (b2 - 4.0)), overlap)
    };
    let s_0 = XI_0.iter().rev().map(|b| of_0(*b)).sum::<f64>() + of_0(0.0);
    let s_2 = XI_2.iter().rev().map(|b| of_2(*b)).sum::<f64>();
    let shape = (a2 - l2) * (a2 + 1.0);
    [
        (shape / 4.0 - (a2 + 2.0) / 2.0) / (a2 - 1.0) + s_0 + s_2,
        (shape / 12.0 + (a2 - 2.0) / 2.0) / (a2 - 1.0) + s_2,
    ]
}

/// Returns the factors by which a sloping surface changes the squared frequency of slosh mode `n`, for motion along the slope
/// and across it. The surface of a tank filled to h/R = `fill` has the `slope`, while gravity along the tank's axis is
/// unchanged.
///
/// With c from [`coefficients`] the factor is 1 + c slope^2. If c is negative, the factor is 1/(1 - c slope^2), which is
/// equal to second order, more accurate at larger slopes, and never negative.
pub fn factors(n: usize, fill: f64, slope: f64) -> [f64; 2] {
    coefficients(n, fill).map(|c| {
        let x = c * slope * slope;
        if x < 0.0 { 1.0 / (1.0 - x) } else { 1.0 + x }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reference values. Each row contains h/R, the slope, and the relative change of the first mode's squared frequency by
    /// the tilt, along the slope and across it. They were computed by finite elements in three dimensions with
    /// `hubslosh.liquid_modes` (scikit-fem 12.0.2, gmsh 4.15.2, resolution 14), for a tank of radius 1 in which the surface
    /// is h cos(tilt) + sin(tilt) above the tank's lowest point. Results of two meshes differ by up to 4e-4; for the upright
    /// tank they agree with the exact value within 1.4e-4.
    const FINITE_ELEMENTS: [(f64, f64, [f64; 2]); 12] = [
        (0.35, 0.0525, [-0.00382, -0.00129]),
        (0.35, 0.1225, [-0.02139, -0.00764]),
        (0.35, 0.245, [-0.09346, -0.03833]),
        (0.5, 0.075, [-0.00400, 0.00018]),
        (0.5, 0.175, [-0.02224, 0.00031]),
        (0.5, 0.35, [-0.09341, -0.00616]),
        (1.0, 0.15, [-0.00941, 0.00526]),
        (1.0, 0.35, [-0.04879, 0.02775]),
        (1.0, 0.7, [-0.16534, 0.10322]),
        (3.0, 0.15, [-0.00931, 0.00523]),
        (3.0, 0.35, [-0.04790, 0.02764]),
        (3.0, 0.7, [-0.15777, 0.10438]),
    ];

    /// At small tilts the tolerance is the difference between the results of two meshes. At larger tilts it is the error that
    /// [`largest_slope`] states.
    #[test]
    fn frequencies_in_a_tilted_cylinder_equal_finite_elements_within_the_stated_errors() {
        for (fill, slope, change) in FINITE_ELEMENTS {
            let part = slope / largest_slope(fill);
            let allowed = match part {
                _ if part < 0.25 => 4e-4 / 2.0,
                _ if part < 0.51 => 0.0015,
                _ => 0.01,
            };
            for (found, change) in factors(0, fill, slope).into_iter().zip(change) {
                let error = (found / (1.0 + change)).sqrt() - 1.0;
                assert!(error.abs() < allowed, "{fill} {slope}: {found} {change} {error}");
            }
        }
    }

    /// The expected change of the second mode is a result of finite elements for the slope 0.2 minus their result for the
    /// upright tank, because both have the same error of the mesh, 0.009.
    #[test]
    fn tilt_changes_the_second_mode_as_finite_elements_do() {
        for (fill, change) in [
            (0.5, [-0.00252 - 0.00367, 0.01606 - 0.00343]),
            (1.0, [0.00569 - 0.00359, 0.01776 - 0.00346]),
        ] {
            for (found, change) in factors(1, fill, 0.2).into_iter().zip(change) {
                assert!((found - 1.0 - change).abs() < 1e-3, "{fill} {found} {change}");
            }
        }
    }

    /// The coefficients in closed form equal the sums of perturbation theory whose integrals over the cross-section of the
    /// tank are computed numerically by Simpson's rule. The error of this rule is (b/2000)^4/180, where b is the zero of J0'
    /// or J2' that belongs to the term of the sum.
    #[test]
    fn coefficients_of_a_tilted_cylinder_equal_the_perturbation_integrals_by_quadrature() {
        const N: usize = 2000;
        let integral = |f: &dyn Fn(f64) -> f64| {
            let h = 1.0 / N as f64;
            let weight = |i: usize| [2.0, 4.0][i % 2] - if i == 0 || i == N { 1.0 } else { 0.0 };
            (0..=N).map(|i| weight(i) * f(i as f64 * h)).sum::<f64>() * h / 3.0
        };
        for (n, fill) in [(0, 0.3), (0, 1.2), (1, 0.7)] {
            let (a, f) = (XI[n], XI[n] * libm::tanh(XI[n] * fill));
            let u = |r: f64| libm::j1(a * r);
            let d = |r: f64| a * (libm::jn(0, a * r) - libm::jn(2, a * r)) / 2.0;
            let u_r = |r: f64| a * (libm::jn(0, a * r) + libm::jn(2, a * r)) / 2.0; // u/r
            // The following integrals are divided by pi. They are the norm and the integrals of x^2 psi^2 and x psi psi_x, in
            // which the integration over the angle gives the factors 3/4 and 1/4, or 1/4 and -1/4.
            let norm = integral(&|r| r * u(r) * u(r));
            let (u2, ud, uu) = (
                integral(&|r| r * r * r * u(r) * u(r)),
                integral(&|r| r * r * u(r) * d(r)),
                integral(&|r| r * u(r) * u(r)),
            );
            let sum_over_modes = |m: i32, zeros: &[f64], both: f64, side: f64| {
                let one = |b: f64| {
                    let v = |r: f64| libm::jn(m, b * r);
                    let x = both * integral(&|r| r * r * u(r) * v(r));
                    let y = both * integral(&|r| r * v(r) * (d(r) + side * u_r(r)));
                    let norms =
                        norm * integral(&|r| r * v(r) * v(r)) * if m == 0 { 2.0 } else { 1.0 };
                    let coupling = (a * a - f * f) * x - y;
                    coupling * coupling / norms / (f - b * libm::tanh(b * fill))
                };
                zeros.iter().map(|b| one(*b)).sum::<f64>()
            };
            let s_0 = sum_over_modes(0, &XI_0, 1.0, 1.0) + sum_over_modes(0, &[0.0], 1.0, 1.0);
            let s_2 = sum_over_modes(2, &XI_2, 0.5, -1.0);
            let diagonal = |x: f64, y: f64| f * ((a * a - f * f) * x - 2.0 * y) / norm;
            let along = diagonal(0.75 * u2, 0.75 * ud + 0.25 * uu) + s_0 + s_2;
            let across = diagonal(0.25 * u2, 0.25 * (ud - uu)) + s_2;
            for (found, wanted) in coefficients(n, fill).into_iter().zip([along / f, across / f]) {
                assert!((found - wanted).abs() < 1e-8, "{n} {fill}: {found} {wanted}");
            }
        }
    }

    /// High modes are short waves, which do not reach the bottom. On a slope with the tangent s, gravity normal to the
    /// surface is larger by the factor sqrt(1 + s^2), and the surface is longer along the slope by this factor, too. A wave
    /// along the slope therefore keeps its frequency, and a wave across it has the coefficient 1/2. If the directions of the
    /// waves are distributed as cos^2 of the angle, the mean coefficient is 1/8 for motion along the slope and 3/8 across
    /// it. Mode 10 differs from this limit by 0.003.
    #[test]
    fn tilt_changes_high_modes_as_waves_on_a_longer_surface() {
        let [along, across] = coefficients(9, 2.0);
        assert!((along - 0.125).abs() < 0.01 && (across - 0.375).abs() < 0.01, "{along} {across}");
    }

    #[test]
    fn zero_tilt_changes_nothing_and_no_frequency_is_negative() {
        assert_eq!(factors(0, 1.0, 0.0), [1.0; 2]);
        for fill in [0.02, 0.2, 1.0, 50.0] {
            for n in 0..crate::cylinder::MODES {
                for slope in [0.01, 0.3, 14.0] {
                    assert!(factors(n, fill, slope).into_iter().all(|x| x > 0.0 && x.is_finite()));
                }
            }
        }
    }

    #[test]
    fn the_constants_of_tilted_cylinders_are_the_zeros_of_derivatives_of_bessel_functions() {
        for (b, b_2) in XI_0.into_iter().zip(XI_2) {
            assert!(libm::j1(b * (1.0 - 1e-15)) * libm::j1(b * (1.0 + 1e-15)) < 0.0, "{b}");
            // The derivative is J2' = J1 - 2 J2/x.
            let slope = |x: f64| libm::j1(x) - 2.0 * libm::jn(2, x) / x;
            assert!(slope(b_2 * (1.0 - 4e-15)) * slope(b_2 * (1.0 + 4e-15)) < 0.0, "{b_2}");
        }
    }
}
