//! Steps along the valley of the Stribeck curve.
//!
//! ```text
//! τ_f = −[ b ω + sgn ω (c + d exp(−(ω/ω_s)²)) ]
//! ```
//!
//! A recording determines the torque at its speeds rather than b, c, d and ω_s one by one.

use nalgebra::{Matrix3, Vector3};

use crate::model::bench::unknown::Unknown;

/// Indices of b, c, d and ω_s among the unknowns.
#[derive(Clone, Copy, Debug)]
pub struct Indices {
    /// friction.b
    pub b: usize,
    /// friction.c
    pub c: usize,
    /// friction.d
    pub d: usize,
    /// friction.omega_s
    pub speed: usize,
}

impl Indices {
    /// `None` unless all four are unknown.
    pub fn of(unknowns: &[Unknown]) -> Option<Self> {
        let index = |name: &str| {
            let name = Some(format!("friction.{name}"));
            unknowns.iter().position(|u| u.quantity.parameter() == name.as_deref())
        };
        Some(Indices { b: index("b")?, c: index("c")?, d: index("d")?, speed: index("omega_s")? })
    }
}

/// x with a step added, so that the friction torque at three speeds changes as the step's first order says, even where ω_s
/// moves far. The recording determines the torques, and along ω_s at fixed torques the valley is straight; at fixed b, c and d it
/// is bent. Where that needs a negative b, c or d, the step is plainly added.
pub fn moved(unknowns: &[Unknown], x: &[f64], step: &[f64], fastest: f64) -> Vec<f64> {
    let plain: Vec<f64> = x.iter().zip(step).map(|(x, step)| x + step).collect();
    let Some(indices) = Indices::of(unknowns) else { return plain };
    let scale = |index: usize| unknowns[index].scale;
    let value = |index: usize, x: &[f64]| scale(index).value(x[index]);
    let (d, speed) = (value(indices.d, x), value(indices.speed, x));
    let change = |index: usize| scale(index).slope(x[index]) * step[index];
    let new_speed = value(indices.speed, &plain);
    let (mut matrix, mut torque) = (Matrix3::zeros(), Vector3::zeros());
    for (row, w) in [0.0, 0.4 * fastest, 0.9 * fastest].into_iter().enumerate() {
        let shape = (-(w / speed).powi(2)).exp();
        // T and its first-order change
        let now = value(indices.b, x) * w + value(indices.c, x) + d * shape;
        let slope = 2.0 * d * shape * w * w / speed.powi(3);
        torque[row] = now
            + change(indices.b) * w
            + change(indices.c)
            + change(indices.d) * shape
            + change(indices.speed) * slope;
        let new_shape = (-(w / new_speed).powi(2)).exp();
        matrix.set_row(row, &Vector3::new(w, 1.0, new_shape).transpose());
    }
    let Some(inverse) = matrix.try_inverse() else { return plain };
    let found = inverse * torque;
    let mut moved = plain.clone();
    for (index, new) in [(indices.b, found[0]), (indices.c, found[1]), (indices.d, found[2])] {
        // no further from the plain step than a factor, and positive
        let near = new / value(index, &plain);
        if !(0.05..20.0).contains(&near) {
            return plain;
        }
        moved[index] = scale(index).variable(new);
    }
    moved
}
