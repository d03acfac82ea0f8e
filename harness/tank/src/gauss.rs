//! Gauss-Legendre quadrature and Legendre polynomials on 0..1.

/// Computes the Legendre polynomials P_0, P_1, … at 2 v - 1, with `v` from 0 to 1, and writes them
/// to `values`, one to each element.
pub(crate) fn legendre(v: f64, values: &mut [f64]) {
    let x = 2.0 * v - 1.0;
    let (mut p0, mut p1) = (1.0, x);
    for (j, value) in values.iter_mut().enumerate() {
        *value = p0;
        let j = j as f64 + 1.0;
        (p0, p1) = (p1, ((2.0 * j + 1.0) * x * p1 - j * p0) / (j + 1.0));
    }
}

pub(crate) fn legendre_slopes(v: f64, slopes: &mut [f64]) {
    let mut values = vec![0.0; slopes.len()];
    legendre(v, &mut values);
    for j in 0..slopes.len() {
        // P'_(j) = P'_(j-2) + (2 j - 1) P_(j-1) in x = 2 v - 1
        let before = if j >= 2 { slopes[j - 2] } else { 0.0 };
        slopes[j] = if j == 0 { 0.0 } else { before + 2.0 * (2 * j - 1) as f64 * values[j - 1] };
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Gauss {
    pub(crate) nodes: Vec<f64>,
    pub(crate) weights: Vec<f64>,
}

impl Gauss {
    pub(crate) fn new(n: usize) -> Gauss {
        let mut nodes = vec![0.0; n];
        let mut weights = vec![0.0; n];
        for i in 0..n {
            // Newton's method, starting from Tricomi's estimate of the zeros of P_n
            let angle = core::f64::consts::PI * (n as f64 - i as f64 - 0.25) / (n as f64 + 0.5);
            let mut x = angle.cos();
            let mut slope = 0.0;
            for _ in 0..6 {
                let (mut p0, mut p1) = (1.0, x);
                for j in 1..n {
                    let j = j as f64;
                    (p0, p1) = (p1, ((2.0 * j + 1.0) * x * p1 - j * p0) / (j + 1.0));
                }
                slope = n as f64 * (x * p1 - p0) / (x * x - 1.0);
                x -= p1 / slope;
            }
            nodes[i] = 0.5 * (1.0 + x);
            weights[i] = 1.0 / ((1.0 - x * x) * slope * slope);
        }
        Gauss { nodes, weights }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_quadrature_with_n_nodes_integrates_powers_up_to_2n_minus_1() {
        for n in [1, 2, 5, 16, 24] {
            let rule = Gauss::new(n);
            for power in 0..2 * n {
                let terms = rule.nodes.iter().zip(&rule.weights);
                let sum: f64 = terms.map(|(v, w)| w * v.powi(power as i32)).sum();
                assert!((sum * (power + 1) as f64 - 1.0).abs() < 1e-13, "{n} {power} {sum}");
            }
        }
    }

    #[test]
    fn derivatives_of_legendre_polynomials_equal_finite_differences() {
        let (mut low, mut high, mut slopes) = ([0.0; 8], [0.0; 8], [0.0; 8]);
        let (v, h) = (0.3, 1e-6);
        legendre(v - h, &mut low);
        legendre(v + h, &mut high);
        legendre_slopes(v, &mut slopes);
        for j in 0..8 {
            // error of the central difference: h^2 times the third derivative, at most 1e4 here
            assert!(((high[j] - low[j]) / (2.0 * h) - slopes[j]).abs() < 1e-7);
        }
    }
}
