//! Coefficients of the first mode in a sphere that give the slosh mass the wave's energy as well as its frequency,
//! over the fill. `formulas::energy_terms` has the coefficients of upright cylinders, and the equations.
//!
//! Source: fully nonlinear potential flow by `large_waves.rs`. `examples/sphere_waves.rs` prints the rows.

use formulas::energy_terms::EnergyTerms;

/// Table of the slosh mass in spheres. Each row has the fill h/R, the coefficients kappa, s, t,
/// kappa_2, s_2 and t_2 (see `EnergyTerms`), and the slosh angle, degrees, up to which the slosh
/// mass was compared with potential flow. The table ends at h/R = 1.05, because from 1.1 on the
/// third-order theory has poles.
const ROWS: [[f64; 8]; 13] = [
    [0.10, 2.7378, 2.2305, 0.4304, 0.919, -0.149, -0.060, 12.8],
    [0.15, 2.3039, 1.9074, 0.3203, 3.372, 1.556, 0.253, 14.8],
    [0.20, 2.0822, 1.7486, 0.2628, 5.182, 2.629, 0.475, 14.6],
    [0.30, 1.9959, 1.6915, 0.2389, 4.304, 2.090, 0.314, 18.6],
    [0.40, 1.9027, 1.6302, 0.2091, 5.500, 2.933, 0.446, 16.2],
    [0.50, 1.9512, 1.6751, 0.2181, 4.680, 2.532, 0.269, 18.1],
    [0.60, 2.0244, 1.7424, 0.2315, 4.973, 2.770, 0.234, 18.0],
    [0.70, 2.1427, 1.8444, 0.2519, 5.185, 3.046, 0.222, 15.9],
    [0.80, 2.3006, 1.9831, 0.2857, 6.226, 3.837, 0.242, 15.9],
    [0.90, 2.5596, 2.2101, 0.3456, 8.271, 5.265, 0.335, 15.8],
    [0.95, 2.7875, 2.4002, 0.4015, 11.142, 7.246, 0.565, 15.7],
    [1.00, 3.3099, 2.8440, 0.5225, 7.211, 4.339, 0.082, 11.9],
    [1.05, 4.4189, 3.7385, 0.8008, 7.105, 4.104, -0.210, 11.9],
];

/// Largest relative errors of the slosh mass at and between the rows of the table: of its
/// frequency, and of its energy.
pub(crate) const ERRORS: [f64; 2] = [5e-4, 4e-3];

/// Slosh angles at which the error of a forced response near resonance reaches 3 % or 3 degrees in
/// a sphere. Each row has h/R and three angles, degrees: with third-order coefficients (the smaller
/// angle of planar and rotary motion), with the coefficients of [`ROWS`] in planar motion, and with
/// the coefficients of [`ROWS`] in rotary motion. The damping ratio of every mode is 0.01. The tank
/// moves along a line or on a circle, at the frequency of free waves of 9 degrees and at
/// frequencies 1 % below and above it (`examples/forced_waves.rs`). 14 degrees is the largest angle
/// that was compared.
const FORCED: [[f64; 4]; 7] = [
    [0.10, 7.1, 8.2, 8.2],
    [0.20, 9.1, 12.5, 8.9],
    [0.40, 10.2, 14.0, 9.0],
    [0.60, 9.3, 14.0, 8.5],
    [0.80, 8.7, 14.0, 8.5],
    [1.00, 8.2, 13.6, 8.4],
    [1.05, 7.1, 11.8, 7.6],
];

/// Returns three slosh angles, rad, at which the error of a forced response in a sphere filled to
/// h/R = `fill` reaches 3 %: first of a slosh mass with third-order coefficients, then of a slosh
/// mass with the coefficients of [`energy_terms`] in planar motion, and in rotary motion.
pub(crate) fn forced_limits(fill: f64) -> Option<[f64; 3]> {
    let pair = FORCED.windows(2).find(|pair| (pair[0][0]..=pair[1][0]).contains(&fill))?;
    let share = (fill - pair[0][0]) / (pair[1][0] - pair[0][0]);
    Some([1, 2, 3].map(|k| (pair[0][k] + (pair[1][k] - pair[0][k]) * share).to_radians()))
}

/// Returns the coefficients that give the slosh mass the energy of a large wave in a sphere filled
/// to h/R = `fill`, or `None` if the fill is outside the rows of the table. The coefficients are
/// interpolated linearly, because frequency and energy are nearly linear in them.
pub(crate) fn energy_terms(fill: f64) -> Option<EnergyTerms> {
    let pair = ROWS.windows(2).find(|pair| (pair[0][0]..=pair[1][0]).contains(&fill))?;
    let share = (fill - pair[0][0]) / (pair[1][0] - pair[0][0]);
    let [_, kappa, s, t, kappa_2, s_2, t_2, _]: [f64; 8] =
        core::array::from_fn(|k| pair[0][k] + (pair[1][k] - pair[0][k]) * share);
    Some(EnergyTerms {
        pair: [s, kappa],
        next: [s_2, kappa_2],
        rotary: [t, t_2],
        compared: pair[0][7].min(pair[1][7]).to_radians(),
    })
}
