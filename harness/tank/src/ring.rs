//! Potential of a ring of sources with a strength proportional to cos(theta).
//!
//! With x = (r, z) and y = (r', z') in the half plane, d^2 = |y - x|^2 and
//! chi = 1 + d^2/(2 r r'),
//!
//!   g(x, y) = int_0^2pi cos(theta)/(4 pi |x - y|) dtheta = Q(chi)/(2 pi sqrt(r r')),
//!
//! where Q = Q_1/2 is the Legendre function of the second kind of half-integer degree (Cohl and Tohline, ApJ 527 (1999)
//! 86). With k^2 = 2/(chi + 1) and the complete elliptic integrals K(k), E(k)
//!
//!   Q = chi k K - (2/k) E,        Q' = (k/2) [K - chi E/(chi - 1)]        (DLMF 14.5(v), 14.10.4).

/// Number of terms of the series of the Legendre function in 1/chi^2. At chi = 3 the terms that are
/// left out are below 1e-16.
const TERMS: usize = 17;

const SERIES: [f64; TERMS] = {
    let mut c = [1.0; TERMS];
    let mut j = 1;
    while j < TERMS {
        let i = (j - 1) as f64;
        c[j] = c[j - 1] * (1.25 + i) * (0.75 + i) / ((2.0 + i) * (1.0 + i));
        j += 1;
    }
    c
};

/// Returns the complete elliptic integrals K and E of the complementary modulus `kc` > 0, by the
/// arithmetic-geometric mean (DLMF 19.8).
fn elliptic(kc: f64) -> (f64, f64) {
    let (mut a, mut b) = (1.0, kc);
    let mut power = 0.5;
    let mut sum = 0.5 * (1.0 - kc * kc);
    loop {
        let c = 0.5 * (a - b);
        let mean = 0.5 * (a + b);
        power *= 2.0;
        sum += power * c * c;
        if c < 1e-8 * mean {
            let k = core::f64::consts::FRAC_PI_2 / mean;
            return (k, k * (1.0 - sum));
        }
        b = (a * b).sqrt();
        a = mean;
    }
}

/// Returns the Legendre function of the second kind Q_1/2 and its derivative at chi = 1 + `x` with
/// x > 0. The relative error is below 1e-13.
pub(crate) fn legendre_q(x: f64) -> (f64, f64) {
    let chi = 1.0 + x;
    if x > 2.0 {
        // Q = (pi/2) (2 chi)^(-3/2) F(5/4, 3/4; 2; 1/chi^2), DLMF 14.3.7
        let s = 1.0 / (chi * chi);
        let (mut f, mut df) = (0.0, 0.0);
        for j in (0..TERMS).rev() {
            f = f * s + SERIES[j];
            df = df * s - (1.5 + 2.0 * j as f64) * SERIES[j];
        }
        let front = core::f64::consts::FRAC_PI_2 / (2.0 * chi * (2.0 * chi).sqrt());
        return (front * f, front / chi * df);
    }
    let k = (2.0 / (chi + 1.0)).sqrt();
    let (big_k, big_e) = elliptic((x / (chi + 1.0)).sqrt());
    (chi * k * big_k - 2.0 / k * big_e, 0.5 * k * (big_k - chi / x * big_e))
}

/// Returns the potential at a point x of a ring source through a point y, and its derivative along
/// the normal `n` at y. `r` and `ry` are the radii of x and y, m, and `d` is the vector y - x.
pub(crate) fn potential(r: f64, ry: f64, d: [f64; 2], n: [f64; 2]) -> (f64, f64) {
    let rr = r * ry;
    let x = (d[0] * d[0] + d[1] * d[1]) / (2.0 * rr);
    let (q, dq) = legendre_q(x);
    let front = 1.0 / (core::f64::consts::TAU * rr.sqrt());
    let along = (n[0] * d[0] + n[1] * d[1]) / rr;
    (front * q, front * (dq * along - n[0] / ry * (x * dq + 0.5 * q)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The reference is Q = int_0^pi cos t/sqrt(2 chi - 2 cos t) dt by the trapezoidal rule, which
    /// converges geometrically for a periodic integrand: at chi >= 1.05 it is exact to rounding
    /// with 2000 points.
    #[test]
    fn the_legendre_function_equals_its_integral() {
        for x in [0.05, 0.5, 1.0, 1.9999, 2.0001, 5.0, 100.0] {
            let count = 2000;
            let mut sum = 0.0;
            let mut slope = 0.0;
            for i in 0..count {
                let t = core::f64::consts::TAU * (i as f64 + 0.5) / count as f64;
                let under = 2.0 * x + 4.0 * (0.5 * t).sin().powi(2);
                sum += t.cos() / under.sqrt();
                slope -= t.cos() / under.powf(1.5);
            }
            let scale = core::f64::consts::PI / count as f64;
            let (q, dq) = legendre_q(x);
            // the quadrature's own rounding is 1e-16 of its largest terms
            assert!((q - scale * sum).abs() < 1e-13 * (1.0 + q.abs()), "{x}: {q} {}", scale * sum);
            assert!((dq - scale * slope).abs() < 1e-12 * (1.0 + dq.abs()), "{x}: {dq}");
        }
    }
}
