//! Fill table of a tank: slosh modes and rigid liquid as functions of the mass of liquid. They are interpolated
//! monotonically with two continuous derivatives, so that the forces of flowing liquid have no steps.
//!
//! ```text
//! interpolated over m_liq:   1/l_n,   h_n - l_n (the bob at rest),   m_n/m_liq,   zeta_n,   s_n, kappa_n,   H_0, I_0, I_z
//! ```
//!
//! 1/l_n is omega^2/g. Shallow liquid has a long pendulum with a hinge far above it; the length and the height of the hinge
//! are proportional to 1/depth. The frequency, the height of the bob and the bob's share of the liquid change little with
//! the depth, so that a few points represent them well. Each curve stays between the values of the two neighbouring points,
//! so that lengths and masses stay above 0.
//!
//! Source: `formulas::interpolation`.

use formulas::interpolation::{derivatives, quintic};
use taylor::number::Number;

use crate::sizes::{MODES, POINTS};

/// Shortest pendulum length, m, that a table may contain. Shorter pendulums would make the equations too stiff.
pub(crate) const SHORTEST: f64 = 1e-6;
/// Smallest mass of a bob, kg, that a table may contain. Lighter bobs would have no effect.
pub(crate) const LIGHTEST: f64 = 1e-9;

/// Modes and rigid liquid for several masses of liquid: the FMUs' parameters `tank[].fill.…`, whose meanings and units are
/// in the FMUs' variable tables. `points` is 0 for a tank that does not drain, otherwise 2 to [`POINTS`]; `liquid` increases
/// from point to point. The tank's own value is used at every fill if the table contains no value for a mode: `zeta` is 0 at
/// all points, s and kappa are 1 at all points, or the limits are 0 at all points.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct FillTable {
    pub points: usize,
    pub liquid: [f64; POINTS],
    pub h_0: [f64; POINTS],
    pub i_0: [f64; POINTS],
    pub i_z: [f64; POINTS],
    pub mass: [[f64; POINTS]; MODES],
    pub length: [[f64; POINTS]; MODES],
    pub hinge: [[f64; POINTS]; MODES],
    pub zeta: [[f64; POINTS]; MODES],
    pub nonlinear_inertia: [[f64; POINTS]; MODES],
    pub nonlinear_stiffness: [[f64; POINTS]; MODES],
    pub angle_limit: [[f64; POINTS]; MODES],
    pub swirl_limit: [[f64; POINTS]; MODES],
}

impl FillTable {
    /// Returns the masses of liquid at the points in use, kg.
    pub fn masses(&self) -> &[f64] {
        &self.liquid[..self.points]
    }

    pub(crate) fn has_zeta(&self, n: usize) -> bool {
        self.zeta[n][..self.points].iter().any(|zeta| *zeta > 0.0)
    }

    pub(crate) fn has_surface(&self, n: usize) -> bool {
        let columns = [&self.nonlinear_inertia[n], &self.nonlinear_stiffness[n]];
        columns.iter().any(|column| column.iter().take(self.points).any(|x| *x != 1.0))
    }

    /// Returns true if the table contains the limit `field` (`angle_limit` or `swirl_limit`) of mode `n`, which counts from
    /// 0, at every point.
    pub(crate) fn limits_everywhere(&self, field: &str, n: usize) -> bool {
        let column = if field == "angle_limit" { self.angle_limit[n] } else { self.swirl_limit[n] };
        self.points > 0 && column[..self.points].iter().all(|limit| *limit > 0.0)
    }

    /// Returns mass, kg, length, m, and hinge height, m, of mode `n`, which counts from 0, for `liquid` kg of liquid.
    pub fn mode(&self, n: usize, liquid: f64) -> [f64; 3] {
        let curves = self.curves(n + 1);
        curves.mode(n, curves.place(liquid)).map(|jet| jet[0])
    }

    pub(crate) fn curves(&self, modes: usize) -> FillCurves {
        let curve = |y: [f64; POINTS]| Curve::new(self.masses(), y);
        let of_mode = |n: usize| {
            let (mass, l, h) = (&self.mass[n], &self.length[n], &self.hinge[n]);
            // Values of points and modes that are not in use may be anything within their ranges. The compiler may divide for all
            // points before it selects one. Therefore divisors get a lower bound, which is below any value in use.
            let used = |f: &dyn Fn(usize) -> f64| {
                core::array::from_fn(|i| if i < self.points && n < modes { f(i) } else { 0.0 })
            };
            ModeCurves {
                stiffness: curve(used(&|i| 1.0 / l[i].max(SHORTEST))),
                bob: curve(used(&|i| h[i] - l[i])),
                share: curve(used(&|i| mass[i] / self.liquid[i].max(LIGHTEST))),
                zeta: (n < modes && self.has_zeta(n)).then(|| curve(self.zeta[n])),
                surface: (n < modes && self.has_surface(n))
                    .then(|| [self.nonlinear_inertia[n], self.nonlinear_stiffness[n]].map(curve)),
            }
        };
        FillCurves {
            points: self.points,
            liquid: self.liquid,
            rigid: [curve(self.h_0), curve(self.i_0), curve(self.i_z)],
            modes: core::array::from_fn(of_mode),
        }
    }
}

/// A quantity and its first two derivatives, with respect to either the mass of liquid or time.
pub(crate) type Jet<T> = [T; 3];

/// Interpolated curve of a quantity: for each interval between two points the coefficients of a quintic polynomial of the
/// position in the interval, 0 to 1.
#[derive(Clone, Copy, Debug)]
struct Curve([[f64; 6]; POINTS - 1]);

impl Curve {
    fn new(masses: &[f64], y: [f64; POINTS]) -> Curve {
        let (mut slope, mut curvature) = ([0.0; POINTS], [0.0; POINTS]);
        let n = masses.len();
        derivatives(masses, &y[..n], true, &mut slope[..n], &mut curvature[..n]);
        let at = |i: usize| [y[i], slope[i], curvature[i]];
        let mut intervals = [[0.0; 6]; POINTS - 1];
        for (i, coefficients) in intervals.iter_mut().enumerate().take(n.saturating_sub(1)) {
            *coefficients = quintic(masses[i + 1] - masses[i], at(i), at(i + 1));
        }
        Curve(intervals)
    }

    fn evaluate<T: Number>(&self, at: Place<T>) -> Jet<T> {
        let c = &self.0[at.interval];
        let (mut value, mut slope, mut half) =
            (T::constant(c[5]), T::constant(0.0), T::constant(0.0));
        for c in c[..5].iter().rev() {
            half = half * at.t + slope;
            slope = slope * at.t + value;
            value = value * at.t + T::constant(*c);
        }
        [value, slope * at.inv_h, half * (2.0 * at.inv_h * at.inv_h)]
    }
}

#[derive(Clone, Copy, Debug)]
struct ModeCurves {
    stiffness: Curve,
    bob: Curve,
    share: Curve,
    zeta: Option<Curve>,
    surface: Option<[Curve; 2]>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct FillCurves {
    points: usize,
    liquid: [f64; POINTS],
    rigid: [Curve; 3],
    modes: [ModeCurves; MODES],
}

/// Position of a mass of liquid in a fill table: the interval between two points, the position in the interval from 0 to 1, and
/// the inverse of its width, 1/kg.
#[derive(Clone, Copy)]
pub(crate) struct Place<T> {
    liquid: T,
    interval: usize,
    t: T,
    inv_h: f64,
}

/// Contents of a tank with a given mass of liquid. `modes` has mass, length and hinge height of
/// each mode. `rigid` has the height H_0 of the rigid liquid and its moments of inertia I_0 and
/// I_z. All have their derivatives.
#[derive(Clone, Copy)]
pub(crate) struct Filling<T> {
    pub place: Place<T>,
    pub modes: [[Jet<T>; 3]; MODES],
    pub rigid: [Jet<T>; 3],
}

impl FillCurves {
    /// Finds the place of `liquid`, kg, in the table. A mass beyond an end of the table is replaced by the mass at this end.
    pub fn place<T: Number>(&self, liquid: T) -> Place<T> {
        let masses = &self.liquid[..self.points];
        let (low, high) = (masses[0], masses[self.points - 1]);
        let liquid = match liquid.value() {
            m if m < low => T::constant(low),
            m if m > high => T::constant(high),
            _ => liquid,
        };
        let last = self.points - 2;
        let interval = (0..last).find(|&i| liquid.value() < masses[i + 1]).unwrap_or(last);
        let inv_h = 1.0 / (masses[interval + 1] - masses[interval]);
        Place { liquid, interval, t: (liquid - T::constant(masses[interval])) * inv_h, inv_h }
    }

    /// Returns the contents of a tank with `liquid` kg of liquid: the first `modes` modes and the rigid liquid.
    pub fn filling<T: Number>(&self, modes: usize, liquid: T) -> Filling<T> {
        let place = self.place(liquid);
        let mut each = [[[T::constant(0.0); 3]; 3]; MODES];
        for (n, mode) in each.iter_mut().enumerate().take(modes) {
            *mode = self.mode(n, place);
        }
        Filling { place, modes: each, rigid: self.rigid(place) }
    }

    pub fn rigid<T: Number>(&self, at: Place<T>) -> [Jet<T>; 3] {
        [0, 1, 2].map(|k| self.rigid[k].evaluate(at))
    }

    /// Returns the damping ratio, valid at the specific force `g_ref`, of mode `n` at the fill `at`; `None` if the table does not
    /// contain damping ratios for this mode.
    pub fn zeta<T: Number>(&self, n: usize, at: Place<T>) -> Option<T> {
        self.modes[n].zeta.as_ref().map(|curve| curve.evaluate(at)[0])
    }

    /// Returns the coefficients s and kappa of mode `n`, each with its first two derivatives; `None` if the table
    /// does not contain them.
    pub fn surface<T: Number>(&self, n: usize, at: Place<T>) -> Option<[Jet<T>; 2]> {
        self.modes[n]
            .surface
            .as_ref()
            .map(|curves| curves.each_ref().map(|curve| curve.evaluate(at)))
    }

    pub fn mode<T: Number>(&self, n: usize, at: Place<T>) -> [Jet<T>; 3] {
        let ModeCurves { stiffness, bob, share, .. } = &self.modes[n];
        let [k, k_d, k_dd] = stiffness.evaluate(at);
        let l = k.recip();
        let l_d = -(k_d * l * l);
        // This follows from l k = 1: l'' k + 2 l' k' + l k'' = 0.
        let length = [l, l_d, -((l_d * k_d * 2.0 + l * k_dd) * l)];
        let b = bob.evaluate(at);
        let [r, r_d, r_dd] = share.evaluate(at);
        let m = at.liquid;
        [
            [m * r, r + m * r_d, r_d * 2.0 + m * r_dd],
            length,
            [b[0] + length[0], b[1] + length[1], b[2] + length[2]],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;
    use taylor::number::Dual;

    /// Random monotone data, some with constant stretches, are interpolated. No slope has the wrong sign, and the values and
    /// both derivatives agree on both sides of each point.
    #[test]
    fn interpolation_is_monotone_and_has_two_continuous_derivatives() {
        let mut rng = fastrand::Rng::with_seed(3);
        for _ in 0..200 {
            let (mut x, mut y) = ([0.0; POINTS], [0.0; POINTS]);
            for i in 1..POINTS {
                x[i] = x[i - 1] + 0.1 + rng.f64();
                y[i] = y[i - 1] + [0.0, 1e-3, 1.0, 30.0][rng.usize(..4)] * rng.f64();
            }
            let default = crate::Tank::default().fill;
            let curves = FillTable { points: POINTS, liquid: x, h_0: y, ..default }.curves(0);
            let at = |m: f64| curves.rigid(curves.place(m))[0];
            for k in 0..=1000 {
                let [value, slope, _] = at(x[POINTS - 1] * k as f64 / 1000.0);
                // The tolerance is the rounding of terms as large as the steepest secant, 300.
                assert!(slope > -1e-10, "{slope}");
                assert!(value > -1e-12 && value < y[POINTS - 1] + 1e-12);
            }
            for i in 1..POINTS - 1 {
                let [left, right] = [-1e-9, 1e-9].map(|e| at(x[i] + e));
                assert!((left[0] - y[i]).abs() < 1e-6 && (right[0] - y[i]).abs() < 1e-6);
                assert!((left[1] - right[1]).abs() < 1e-4, "{left:?} {right:?}");
                // Over 2e-9 the second derivative may change by the third, which is up to 60 times the secant over h^2, 2e6.
                assert!((left[2] - right[2]).abs() < 1e-2, "{left:?} {right:?}");
            }
        }
    }

    /// The derivatives of modal masses, lengths, hinges and inertias with respect to the mass of liquid
    /// agree with finite differences.
    #[test]
    fn derivatives_equal_finite_differences() {
        let default = crate::Tank::default().fill;
        let curves = FillTable { points: POINTS, ..default }.curves(MODES);
        let all = |m: f64| {
            let at = curves.place(m);
            let modes = (0..MODES).flat_map(|n| curves.mode(n, at));
            modes.chain(curves.rigid(at)).collect::<Vec<_>>()
        };
        for m in [70.0, 150.0, 333.3, 600.0] {
            let e = 1e-3;
            let (low, now, high) = (all(m - e), all(m), all(m + e));
            for ((low, now), high) in low.iter().zip(&now).zip(&high) {
                for i in 0..2 {
                    // The error is e^2 times a third derivative, plus rounding over e.
                    let slope = (high[i] - low[i]) / (2.0 * e);
                    assert!(
                        (slope - now[i + 1]).abs() < 1e-8 * (1.0 + now[0].abs()),
                        "{slope} {now:?}"
                    );
                }
            }
        }
    }

    /// A table whose points are computed from the formulas of an upright cylinder agrees with these
    /// formulas between its points.
    #[test]
    fn a_fill_table_reproduces_a_cylinder_between_its_points() {
        let (d, r) = (0.9, 0.45);
        let mass = |h: f64| 1000.0 * core::f64::consts::PI * r * r * h;
        let depth = |i: f64| r * (1.0 / 6.0 + (17.0 / 6.0) * (i / (POINTS - 1) as f64).powf(1.5));
        let mut table = FillTable { points: POINTS, ..crate::Tank::default().fill };
        for i in 0..POINTS {
            let h = depth(i as f64);
            let pendulum = formulas::cylinder::pendulum(0, d, h, mass(h));
            (table.liquid[i], table.mass[0][i]) = (mass(h), pendulum.mass);
            (table.length[0][i], table.hinge[0][i]) = (pendulum.length, pendulum.hinge);
        }
        let curves = table.curves(1);
        for k in 0..=25 * (POINTS - 1) {
            let h = depth(k as f64 / 25.0);
            let exact = formulas::cylinder::pendulum(0, d, h, mass(h));
            let [m, l, hinge] = curves.mode(0, curves.place(mass(h))).map(|jet| jet[0]);
            assert!((m / exact.mass - 1.0).abs() < 5e-3, "h {h}: mass {m} {}", exact.mass);
            assert!(((exact.length / l).sqrt() - 1.0).abs() < 5e-3, "h {h}: length {l}");
            assert!((hinge - exact.hinge).abs() < 5e-3 * r, "h {h}: {hinge} {}", exact.hinge);
        }
    }

    #[test]
    fn beyond_the_ends_of_its_fill_table_a_tank_keeps_the_end_values() {
        let table = FillTable { points: 3, ..crate::Tank::default().fill };
        let curves = table.curves(MODES);
        let all = |m: f64| {
            // `m` is the independent variable, so that its derivative is 1.
            let at = curves.place(Dual::with_slope(m, 1.0));
            let modes = (0..MODES).flat_map(|n| curves.mode(n, at));
            let jets: Vec<_> = modes.chain(curves.rigid(at)).collect();
            let values: Vec<_> = jets.iter().map(|jet| jet[0].value()).collect();
            (values, jets.iter().map(|jet| jet[0].result()).collect::<Vec<_>>())
        };
        let [low, middle, high] = [0, 1, 2].map(|i| table.liquid[i]);
        for (m, end) in [(0.5 * low, low), (-1.0, low), (1.5 * high, high), (2.5 * high, high)] {
            let ((values, slopes), (at_end, _)) = (all(m), all(end));
            assert_eq!(values, at_end, "{m}");
            assert!(slopes.iter().all(|slope| *slope == 0.0), "{m} {slopes:?}");
        }
        assert!(all(low).0 != all(high).0 && all(middle).1.iter().any(|slope| *slope != 0.0));
    }
}
