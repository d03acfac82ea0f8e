//! The first root of a polynomial: when, within a step, an event falls due.

/// The first t in (0, h] at which the polynomial `a`, positive at t = 0, has
/// fallen to zero; `None` when it stays positive.
///
/// From a point where the value is f > 0 and the slope f', a bound M on |f''|
/// over [0, h] gives f(t + s) >= f + f' s - M s^2 / 2. The root of that parabola
/// is a step that cannot pass the first zero, and it converges to it
/// quadratically, as Newton's does.
///
/// M is close enough where the terms a_n h^n decay, as those of a converged series do. Where they
/// grow, the steps are short, and after 200 of them the answer is where they have come to: there is
/// no zero before, and none need be there.
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
    // Far from a tangency some five steps do; the limit bounds the work.
    for _ in 0..200 {
        let (mut f, mut slope) = (0.0, 0.0);
        for x in a.iter().rev() {
            slope = slope * t + f;
            f = f * t + x;
        }
        if f <= 0.0 {
            return Some(t);
        }
        let fall = libm::sqrt(slope * slope + 2.0 * bend * f) - slope;
        // Straight and not falling.
        if fall <= 0.0 {
            return None;
        }
        let next = t + 2.0 * f / fall;
        if next > h || next.is_nan() {
            return None;
        }
        if next == t {
            return Some(t);
        }
        t = next;
    }
    Some(t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_root_finds_the_first_of_two_close_roots() {
        // (t - 0.5)(t - 0.5001)(t - 0.9), negated to start positive
        let (a, b, c) = (0.5, 0.5001, 0.9);
        let p = [a * b * c, -(a * b + b * c + c * a), a + b + c, -1.0];
        // The root's condition: rounding 1e-16 over the slope 4e-5.
        assert!((first_root(&p, 1.0).unwrap() - 0.5).abs() < 1e-11);
        assert_eq!(first_root(&p, 0.4999), None);
    }

    #[test]
    fn first_root_passes_over_a_minimum_that_stays_positive() {
        // (t - 0.5)^2 + 1e-9
        assert_eq!(first_root(&[0.25 + 1e-9, -1.0, 1.0], 1.0), None);
        assert_eq!(first_root(&[1.0, 0.0, 0.0], 1.0), None);
    }

    #[test]
    fn roots_of_lines_parabolas_and_cubics_are_theirs() {
        assert_eq!(first_root(&[2.0, -1.0], 3.0), Some(2.0));
        assert_eq!(first_root(&[2.0, -1.0], 2.0), Some(2.0));
        assert_eq!(first_root(&[2.0, -1.0], 1.9), None);
        assert_eq!(first_root(&[2.0, 1.0], 9.0), None);
        // 1 - t^2, and what falls after it has risen: 1 + t - t^2
        assert!((first_root(&[1.0, 0.0, -1.0], 9.0).unwrap() - 1.0).abs() < 1e-15);
        let golden = 0.5 + 1.25f64.sqrt();
        assert!((first_root(&[1.0, 1.0, -1.0], 9.0).unwrap() - golden).abs() < 1e-15);
        // (1 - t)(2 - t)(3 - t)
        assert!((first_root(&[6.0, -11.0, 6.0, -1.0], 9.0).unwrap() - 1.0).abs() < 1e-14);
        assert_eq!(first_root(&[f64::NAN, 1.0], 1.0), None);
    }

    /// 1 - t^18 up to 3: the last term is 4e8 times the first, and a step is 1.2e-5.
    #[test]
    fn where_terms_grow_the_answer_is_before_the_root() {
        let mut a = [0.0; 19];
        (a[0], a[18]) = (1.0, -1.0);
        let far = first_root(&a, 3.0).unwrap();
        // 200 times the root of the parabola 1 - M t^2/2, M = 18 17 3^16; what falls by then is 1e-47.
        let root = libm::sqrt(2.0 / (18.0 * 17.0 * libm::pow(3.0, 16.0)));
        assert!((far / (200.0 * root) - 1.0).abs() < 1e-12, "{far}");
        // Up to 1.2, where the last term is 27 times the first, they suffice.
        let near = first_root(&a, 1.2).unwrap();
        assert!((near - 1.0).abs() < 1e-12, "{near}");
    }

    /// Polynomials of degree 8 whose terms decay, as those of a series do, against samples of them: nothing is
    /// passed over.
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
            for _ in 0..3000 {
                let mut a: [f64; 9] = core::array::from_fn(|_| between_ones());
                // Near 0, so that roots are close to each other.
                a[0] = 0.03 * (1.0 + a[0]);
                for (n, x) in a.iter_mut().enumerate() {
                    *x *= libm::pow(0.8 / h, n as f64);
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
                    assert!(value(root).abs() < 1e-12, "{a:?} {h}: {root}");
                }
            }
        }
        assert!(found > 3000, "{found}");
    }
}
