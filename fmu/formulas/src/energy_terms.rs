//! Coefficients of the first mode in an upright cylinder for which the slosh mass has the energy of the wave as
//! well as its frequency:
//!
//! ```text
//! L = m |q'|^2/2 + m (s + s_2 |q|^2/l^2) (q.q')^2/(2 l^2) + m (t + t_2 |q|^2/l^2) (q x q')^2/(2 l^2) - m g z
//! z = l [A^2/2 + kappa A^4/8 + (kappa_2 + 1) A^6/16 + ...],   A = |q|/l
//! ```
//!
//! The equations are those of `fmu/craft/src/surface.rs`: a pendulum with s, kappa and four further coefficients, which are
//! 0 for a plain pendulum. The third order has the right frequency, but not the right energy: at h/R = 0.5 and 16 degrees
//! its slosh mass has 4.7 % less energy than the liquid, and near resonance its forced amplitude has errors of 3 to 8 %.
//! Here kappa and kappa_2 follow from the rise of the liquid's centre of mass, s and s_2 from the frequency of planar
//! motion, and t and t_2 from the frequency of circular motion.
//!
//! Source: fully nonlinear potential flow, computed for this project by a variational method (Luke's principle) at the
//! depths of [`ROWS`]. Up to the slosh angles in this table, the frequencies of slosh mass and potential flow differ by at
//! most 0.06 % in planar and 0.11 % in circular motion. The energy differs from that of planar waves by at most 0.1 % from
//! h/R = 0.35 on (0.7 % at 0.25, 1.1 % at 0.3). `harness/tank/tests/tank/backbones.rs` compares the frequencies.

use crate::third_order;

pub const DEPTHS: [f64; 2] = [0.25, third_order::BRIDGED[0]];

/// Coefficients of the first mode from fully nonlinear potential flow, for the equations at the head of the file. Each row
/// contains h/R; kappa, s and t, the coefficients of stiffness, planar inertia and rotary inertia to third order in the
/// slosh angle; kappa_2, s_2 and t_2, their counterparts of fifth order; and the largest slosh angle, degrees, at which the
/// slosh mass was compared with potential flow. Only in this table, t and t_2 are defined by the frequency of circular
/// motion, omega^2 (1 + t A^2 + t_2 A^4) = (dz/dA)/A. They are therefore two and three times the values of t and t_2 in the
/// equations.
const ROWS: [[f64; 8]; 7] = [
    [0.25, 111.6366, 67.2399, 48.6774, -3776.617, -2326.024, -1494.947, 8.0],
    [0.3, 38.3052, 21.5892, 15.4987, -429.434, -236.528, -188.836, 12.5],
    [0.35, 17.7419, 10.0192, 6.8068, -116.209, -58.416, -55.513, 14.5],
    [0.4, 9.5712, 5.6931, 3.4967, -31.606, -12.626, -18.166, 16.0],
    [0.5, 4.1136, 3.0230, 1.4049, -6.619, -0.648, -4.671, 18.0],
    [0.6, 2.4768, 2.3151, 0.7995, -3.826, -0.344, -2.352, 18.0],
    [0.65, 2.1267, 2.1867, 0.6731, -4.250, -0.965, -2.221, 18.0],
];

/// Large-wave coefficients of the first slosh mode at one depth, for the equations at the head of the file: `pair` contains
/// s and kappa, the coefficients of inertia and stiffness to third order in the slosh angle; `next` contains s_2 and
/// kappa_2, their counterparts of fifth order; and `rotary` contains t and t_2, the coefficients of the inertia in rotary
/// motion. `compared` is the largest slosh angle, rad, at which a slosh mass with these coefficients was compared with
/// potential flow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyTerms {
    pub pair: [f64; 2],
    pub next: [f64; 2],
    pub rotary: [f64; 2],
    pub compared: f64,
}

/// Returns the coefficients with which the slosh mass has the energy of a large wave in an upright cylinder filled to h/R =
/// `fill`; `None` if the fill is outside [`DEPTHS`].
///
/// Between the depths of the table, the stiffness coefficients kappa and kappa_2 and the changes of the frequency with the
/// amplitude are interpolated, and the inertia coefficients follow from them. An error of the interpolation therefore
/// appears in the energy and not in the frequency. The frequency is interpolated as a difference from third-order theory,
/// which is known at every depth. Above the last depth of the table, h/R = 0.65, all these quantities are extrapolated.
pub fn energy_terms(fill: f64) -> Option<EnergyTerms> {
    if !(DEPTHS[0]..=DEPTHS[1]).contains(&fill) {
        return None;
    }
    if let Some(row) = ROWS.iter().find(|row| row[0] == fill) {
        return Some(terms_from_row(row));
    }
    let last = ROWS.len() - 1;
    let i = ROWS.iter().position(|row| fill < row[0]).unwrap_or(last);
    let column = |k: usize| {
        let at = |j: usize| features(&ROWS[j])[k];
        interpolate_segment(
            libm::log(fill),
            i,
            |j| [libm::log(ROWS[j][0]), at(j)],
            fill <= ROWS[last][0],
        )
    };
    let kappa = 1.0 + libm::exp(column(0));
    let kappa_2 = -libm::exp(column(1));
    let [fourth, circular_fourth] = [-libm::exp(column(4)), libm::exp(column(5))];
    let [planar, circular] = shifts_of_third_order(fill);
    let (planar, circular) = (planar + column(2), circular + column(3));
    let compared =
        interpolate_segment(fill, i, |j| [ROWS[j][0], ROWS[j][7]], false).min(ROWS[last][7]);
    Some(EnergyTerms {
        pair: [2.0 * (0.375 * kappa - planar), kappa],
        next: [(PLANAR_STIFFNESS * kappa_2 - fourth) / PLANAR_INERTIA, kappa_2],
        rotary: rotary([0.5 * kappa - circular, 0.375 * kappa_2 - circular_fourth]),
        compared: compared.to_radians(),
    })
}

const PLANAR_STIFFNESS: f64 = 15.0 / 64.0;
const PLANAR_INERTIA: f64 = 0.375;

fn rotary([t, t_2]: [f64; 2]) -> [f64; 2] {
    [t / 2.0, t_2 / 3.0]
}

fn terms_from_row(&[_, kappa, s, t, kappa_2, s_2, t_2, compared]: &[f64; 8]) -> EnergyTerms {
    EnergyTerms {
        pair: [s, kappa],
        next: [s_2, kappa_2],
        rotary: rotary([t, t_2]),
        compared: compared.to_radians(),
    }
}

fn shifts_of_third_order(fill: f64) -> [f64; 2] {
    let (s, kappa) = third_order::unbridged(fill);
    third_order::shifts(s, kappa)
}

/// Converts a row of the table to the six quantities that are interpolated over the depth. The first two are the logarithms
/// of kappa - 1 and -kappa_2. The next two are the changes of the squared frequency per squared slosh angle in planar and in
/// circular motion, each minus its value by third-order theory. The last two are the logarithms of the magnitudes of the
/// changes with the fourth power of the angle, in planar and in circular motion. Logarithms are possible because these
/// quantities never change their sign.
fn features(&[fill, kappa, s, t, kappa_2, s_2, t_2, _]: &[f64; 8]) -> [f64; 6] {
    let [planar, circular] = shifts_of_third_order(fill);
    [
        libm::log(kappa - 1.0),
        libm::log(-kappa_2),
        0.375 * kappa - 0.5 * s - planar,
        0.5 * kappa - t - circular,
        libm::log(PLANAR_INERTIA * s_2 - PLANAR_STIFFNESS * kappa_2),
        libm::log(0.375 * kappa_2 - t_2),
    ]
}

/// Interpolates y at `x`, which lies between point `i` - 1 and point `i`; `point` returns the pair (x, y) of a point. If
/// `is_cubic` is true, the curve is a cubic whose slope at each end is the slope of the parabola through the three nearest
/// points. Otherwise it is a straight line.
fn interpolate_segment(x: f64, i: usize, point: impl Fn(usize) -> [f64; 2], is_cubic: bool) -> f64 {
    let [[x_0, y_0], [x_1, y_1]] = [point(i - 1), point(i)];
    let (h, secant) = (x_1 - x_0, (y_1 - y_0) / (x_1 - x_0));
    let share = (x - x_0) / h;
    if !is_cubic {
        return y_0 + secant * (x - x_0);
    }
    let slope = |j: usize| {
        let first = j.saturating_sub(1).min(ROWS.len() - 3);
        let [[a, p], [b, q], [c, r]] = [point(first), point(first + 1), point(first + 2)];
        let (low, high) = ((q - p) / (b - a), (r - q) / (c - b));
        let bend = (high - low) / (c - a);
        low + bend * (2.0 * point(j)[0] - a - b)
    };
    let [d_0, d_1] = [slope(i - 1), slope(i)];
    let rest = 1.0 - share;
    y_0 + (y_1 - y_0) * share + h * share * rest * ((d_0 - secant) * rest - (d_1 - secant) * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_large_wave_coefficients_equal_the_rows_of_the_table_and_are_continuous_in_the_fill() {
        for row in ROWS {
            let at = energy_terms(row[0]).unwrap();
            assert_eq!((at.pair, at.next), ([row[2], row[1]], [row[5], row[4]]));
            assert_eq!(at.rotary, [row[3] / 2.0, row[6] / 3.0]);
            for beside in [row[0] * (1.0 - 1e-9), row[0] * (1.0 + 1e-9)] {
                let Some(near) = energy_terms(beside) else { continue };
                for (a, b) in [(at.pair, near.pair), (at.next, near.next), (at.rotary, near.rotary)]
                {
                    for k in 0..2 {
                        assert!(
                            (a[k] - b[k]).abs() < 1e-6 * (1.0 + a[k].abs()),
                            "{beside} {near:?}"
                        );
                    }
                }
            }
        }
        assert_eq!([0.2499, 0.7001, f64::NAN].map(energy_terms), [None; 3]);
        assert!(energy_terms(0.7).is_some());
    }

    #[test]
    fn tabulated_large_wave_coefficients_give_frequency_shifts_close_to_third_order_theory() {
        for i in 0..=30 {
            let fill = 0.4 + 0.01 * f64::from(i);
            let EnergyTerms { pair: [s, kappa], rotary, .. } = energy_terms(fill).unwrap();
            let [planar, circular] = third_order::shifts(s, kappa);
            let found = [planar, circular - 2.0 * rotary[0]];
            for (found, third) in found.into_iter().zip(shifts_of_third_order(fill)) {
                assert!((found - third).abs() < 0.05, "{fill}: {found} {third}");
            }
        }
    }
}
