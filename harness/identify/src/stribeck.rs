//! Steps along the valley of the Stribeck curve.
//!
//! ```text
//! τ_f = −[ b ω + sgn ω (c + d exp(−(ω/ω_s)²)) ]
//! ```
//!
//! A recording determines the torque at its speeds rather than b, c, d and ω_s one by one.

use nalgebra::{Matrix3, Vector3};

use crate::unknown::Unknown;

/// Unknowns of the friction law: places of b, c, d and ω_s.
#[derive(Clone, Copy, Debug)]
pub struct Places {
    /// friction.b
    pub b: usize,
    /// friction.c
    pub c: usize,
    /// friction.d
    pub d: usize,
    /// friction.omega_s
    pub speed: usize,
}

impl Places {
    /// `None` unless all four are unknown.
    pub fn of(unknowns: &[Unknown]) -> Option<Self> {
        let place = |name: &str| {
            let name = Some(format!("friction.{name}"));
            unknowns.iter().position(|u| u.quantity.parameter() == name.as_deref())
        };
        Some(Places { b: place("b")?, c: place("c")?, d: place("d")?, speed: place("omega_s")? })
    }
}

/// x with a step added, so that the friction torque at three speeds changes as the step's first order says, even where ω_s
/// moves far. The recording determines the torques, and along ω_s at fixed torques the valley is straight; at fixed b, c and d it
/// is bent. Where that needs a negative b, c or d, the step is plainly added.
pub fn moved(unknowns: &[Unknown], x: &[f64], step: &[f64], fastest: f64) -> Vec<f64> {
    let plain: Vec<f64> = x.iter().zip(step).map(|(x, step)| x + step).collect();
    let Some(places) = Places::of(unknowns) else { return plain };
    let scale = |place: usize| unknowns[place].scale;
    let value = |place: usize, x: &[f64]| scale(place).value(x[place]);
    let (d, speed) = (value(places.d, x), value(places.speed, x));
    let change = |place: usize| scale(place).slope(x[place]) * step[place];
    let new_speed = value(places.speed, &plain);
    let (mut matrix, mut torque) = (Matrix3::zeros(), Vector3::zeros());
    for (row, w) in [0.0, 0.4 * fastest, 0.9 * fastest].into_iter().enumerate() {
        let shape = (-(w / speed).powi(2)).exp();
        // T and its first-order change
        let now = value(places.b, x) * w + value(places.c, x) + d * shape;
        let slope = 2.0 * d * shape * w * w / speed.powi(3);
        torque[row] = now
            + change(places.b) * w
            + change(places.c)
            + change(places.d) * shape
            + change(places.speed) * slope;
        let new_shape = (-(w / new_speed).powi(2)).exp();
        matrix.set_row(row, &Vector3::new(w, 1.0, new_shape).transpose());
    }
    let Some(inverse) = matrix.try_inverse() else { return plain };
    let found = inverse * torque;
    let mut moved = plain.clone();
    for (place, new) in [(places.b, found[0]), (places.c, found[1]), (places.d, found[2])] {
        // no further from the plain step than a factor, and positive
        let near = new / value(place, &plain);
        if !(0.05..20.0).contains(&near) {
            return plain;
        }
        moved[place] = scale(place).variable(new);
    }
    moved
}
