//! First root of a polynomial, which is the time of an event within a step.

use crate::series::ORDER;

/// Number of iterations with one bound for the whole interval, after which [`first_root`] uses bounds for
/// parts of the interval.
const COARSE_STEPS: usize = 200;

/// Returns the first t in (0, h] at which the polynomial `a`, which is positive at t = 0, has fallen to zero; `None` if it
/// stays positive. `a` has at most 2 [`ORDER`] + 1 coefficients, as the product of two series.
///
/// At a point with the value f > 0 and the slope f', a bound M of |f''| over [0, h] gives f(t + s) >= f + f' s - M
/// s^2/2. The root of this parabola is a step that cannot pass the first zero. The steps converge to the zero
/// quadratically, as in Newton's method.
///
/// M is small enough if the terms a_n h^n decay, as those of a converged series do. If they grow, these steps are too short.
/// Then the polynomial is expanded about t, and M is a bound for a part of the interval that is about as long as the step.
/// Such a step is at least a fixed fraction of the distance to the nearest complex root, so that the number of steps grows
/// with the logarithm of the accuracy. The search ends only with a root, to rounding, or with the proof that the polynomial
/// has no root up to h.
pub fn first_root(a: &[f64], h: f64) -> Option<f64> {
    let (mut power, mut lowest) = (1.0, a[0]);
    for x in &a[1..] {
        power *= h;
        lowest += f64::min(0.0, x * power);
    }
    if lowest > 0.0 {
        return None;
    }
    let (mut power, mut bend) = (1.0, 0.0);
    for (j, x) in a.iter().enumerate().skip(2) {
        bend += (j * (j - 1)) as f64 * x.abs() * power;
        power *= h;
    }
    let mut t = 0.0;
    // If the minimum is not close to zero, about five iterations are enough.
    for _ in 0..COARSE_STEPS {
        let (mut f, mut slope) = (0.0, 0.0);
        for x in a.iter().rev() {
            slope = slope * t + f;
            f = f * t + x;
        }
        if f <= 0.0 {
            return Some(t);
        }
        let fall = libm::sqrt(slope * slope + 2.0 * bend * f) - slope;
        // The polynomial is linear and does not fall.
        if fall <= 0.0 {
            return None;
        }
        let next = t + 2.0 * f / fall;
        if next > h || next.is_nan() {
            return None;
        }
        if next == t {
            break;
        }
        t = next;
    }
    first_root_from(t, a, h)
}

/// Returns the first root as [`first_root`] does, for a polynomial that has no zero before `t`. The
/// bounds hold for parts of the interval, so that the steps stay long enough if the terms grow.
#[cold]
fn first_root_from(mut t: f64, a: &[f64], h: f64) -> Option<f64> {
    if a.iter().any(|x| !x.is_finite()) {
        return None;
    }
    loop {
        let mut about = [0.0; 2 * ORDER + 1];
        let about = &mut about[..a.len()];
        about.copy_from_slice(a);
        // Coefficients of f(t + s) in powers of s:
        for first in 0..a.len() {
            for k in (first..a.len() - 1).rev() {
                about[k] += about[k + 1] * t;
            }
        }
        if about[0] <= 0.0 {
            return Some(t);
        }
        let next = t + step_before_zero(about, h - t);
        if next > h || t >= h {
            return None;
        }
        if next == t {
            return Some(t);
        }
        t = next;
    }
}

/// Returns a length up to which the polynomial `a` with a[0] > 0 has no zero. The length is at least a fixed fraction
/// of the longest length for which a bound of f'' proves this. If there is no zero up to `left`, the returned length
/// is more than `left`.
fn step_before_zero(a: &[f64], left: f64) -> f64 {
    let slope = a.get(1).copied().unwrap_or(0.0);
    let (mut length, mut longest): (f64, f64) = (left, 0.0);
    loop {
        // Upper bound of -f'' over the first `length`:
        let (mut power, mut bend) = (1.0, 0.0);
        for (j, x) in a.iter().enumerate().skip(2) {
            bend -= (j * (j - 1)) as f64 * x.min(0.0) * power;
            power *= length;
        }
        let fall = libm::sqrt(slope * slope + 2.0 * bend * a[0]) - slope;
        let reach = if fall > 0.0 { 2.0 * a[0] / fall } else { f64::INFINITY };
        if reach >= length {
            return if length == left { reach } else { length.max(longest) };
        }
        longest = longest.max(reach);
        length /= 2.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_root_finds_the_first_of_two_close_roots() {
        // The polynomial is -(t - 0.5)(t - 0.5001)(t - 0.9), which is positive at 0.
        let (a, b, c) = (0.5, 0.5001, 0.9);
        let p = [a * b * c, -(a * b + b * c + c * a), a + b + c, -1.0];
        // The error of the root is the rounding error 1e-16 divided by the slope 4e-5.
        assert!((first_root(&p, 1.0).unwrap() - 0.5).abs() < 1e-11);
        assert_eq!(first_root(&p, 0.4999), None);
    }

    #[test]
    fn first_root_passes_over_a_minimum_that_stays_positive() {
        // The polynomial is (t - 0.5)^2 + 1e-9.
        assert_eq!(first_root(&[0.25 + 1e-9, -1.0, 1.0], 1.0), None);
        assert_eq!(first_root(&[1.0, 0.0, 0.0], 1.0), None);
    }

    #[test]
    fn roots_of_lines_parabolas_and_cubics_are_exact() {
        assert_eq!(first_root(&[2.0, -1.0], 3.0), Some(2.0));
        assert_eq!(first_root(&[2.0, -1.0], 2.0), Some(2.0));
        assert_eq!(first_root(&[2.0, -1.0], 1.9), None);
        assert_eq!(first_root(&[2.0, 1.0], 9.0), None);
        // The polynomials are 1 - t^2, and 1 + t - t^2, which rises before it falls.
        assert!((first_root(&[1.0, 0.0, -1.0], 9.0).unwrap() - 1.0).abs() < 1e-15);
        let golden = 0.5 + 1.25f64.sqrt();
        assert!((first_root(&[1.0, 1.0, -1.0], 9.0).unwrap() - golden).abs() < 1e-15);
        // The polynomial is (1 - t)(2 - t)(3 - t).
        assert!((first_root(&[6.0, -11.0, 6.0, -1.0], 9.0).unwrap() - 1.0).abs() < 1e-14);
        assert_eq!(first_root(&[f64::NAN, 1.0], 1.0), None);
    }

    /// The terms of 1 - t^18 grow over intervals longer than 1: the last term is 4e8 times the
    /// first term at t = 3, and 1e162 times at t = 1e9.
    #[test]
    fn the_first_root_is_found_even_if_the_terms_grow() {
        let mut a = [0.0; 19];
        (a[0], a[18]) = (1.0, -1.0);
        for h in [1.2, 3.0, 10.0, 1e9] {
            let root = first_root(&a, h).unwrap();
            // The error of the root is the rounding error 1e-16 divided by the slope 18.
            assert!((root - 1.0).abs() < 1e-15, "{h}: {root:e}");
        }
        // The distance of detached liquid from a near wall, 1e-10 - 1e-9 t + 1e-2 t^2, has no root. With - t^3 in addition
        // it has one after 10 ms.
        assert_eq!(first_root(&[1e-10, -1e-9, 1e-2], 10.0), None);
        let root = first_root(&[1e-10, -1e-9, 1e-2, -1.0], 10.0).unwrap();
        assert!((root - 1e-2).abs() < 2e-6, "{root}");
    }

    /// The minimum of the parabola 1/4 - t + t^2 is 0. If the parabola is raised by 1e-15 it has no
    /// root, and if it is lowered by 1e-15 it has a root; rounding errors of 1e-16 must not change
    /// this result.
    #[test]
    fn a_polynomial_has_a_root_only_if_its_minimum_is_below_zero() {
        for h in [1.0, 10.0, 1e3] {
            for above in [1e-9, 1e-12, 1e-15] {
                let parabola = |above: f64| [0.25 + above, -1.0, 1.0];
                assert_eq!(first_root(&parabola(above), h), None, "{h} {above}");
                let root = first_root(&parabola(-above), h).unwrap();
                let want = 0.5 - above.sqrt();
                // The error of the root is the rounding error of the value divided by the slope 2 sqrt(above).
                assert!((root - want).abs() < 1e-15 / above.sqrt(), "{h} {above}: {root}");
            }
        }
    }

    #[test]
    fn coefficients_that_are_not_finite_have_no_root() {
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(first_root(&[1.0, -0.1, x], 1.0), None, "{x}");
            assert_eq!(first_root(&[1.0, -0.1, -1.0, x], 1.0), None, "{x}");
        }
    }

    /// The first roots of polynomials of degree 8 are compared with samples of the polynomials: no root is missed, and every
    /// result is a root. The terms decay, as those of a converged series do, or grow up to 8^8.
    #[test]
    fn no_sample_before_the_first_root_is_below_zero() {
        let mut seed = 1u64;
        let mut between_ones = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        let mut found = 0;
        for h in [0.5, 1.0, 1.7] {
            for k in 0..4500 {
                let growth = [0.8, 0.8, 0.8, 3.0, 8.0][k % 5];
                let mut a: [f64; 9] = core::array::from_fn(|_| between_ones());
                // The value at 0 is small, so that roots are close together.
                a[0] = 0.03 * (1.0 + a[0]);
                for (n, x) in a.iter_mut().enumerate() {
                    *x *= libm::pow(growth / h, n as f64);
                }
                let value = |t: f64| a.iter().rev().fold(0.0, |sum, x| sum * t + x);
                let at = |k: usize| h * k as f64 / 4000.0;
                let below = (0..=4000).map(at).find(|t| value(*t) < 0.0);
                let root = first_root(&a, h);
                if let Some(below) = below {
                    assert!(root.is_some_and(|root| root <= below), "{a:?} {h}: {root:?} {below}");
                }
                if let Some(root) = root {
                    found += 1;
                    // The tolerance is the rounding error of the sum.
                    let size = a.iter().rev().fold(0.0, |sum, x| sum * root + x.abs());
                    assert!(value(root).abs() < 1e-14 * size, "{a:?} {h}: {root}");
                }
            }
        }
        assert!(found > 3000, "{found}");
    }
}
