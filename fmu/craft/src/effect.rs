//! Parameters that have no effect with the others as they are.

use alloc::format;
use alloc::string::String;

use crate::parameters::{Mount, Parameters, Tank};

/// Parameters that each mode has.
const OF_MODES: [&str; 15] = [
    "mass",
    "length",
    "frequency",
    "hinge",
    "direction",
    "arm",
    "k",
    "zeta",
    "zeta_amplitude",
    "wave",
    "fill.mass",
    "fill.length",
    "fill.hinge",
    "p_0",
    "p_dot_0",
];

impl Tank {
    /// Returns why a parameter of the tank has no effect on the motion or on any output; `None` if it has one. `field` is its
    /// name in the FMUs behind `tank.`, `indices` are the element's, from 0: mode, point of the table or axis. Enumerations
    /// have their `…kind` applied.
    pub fn without_effect(&self, field: &str, indices: &[usize]) -> Option<String> {
        let (first, last) = (*indices.first().unwrap_or(&0), *indices.last().unwrap_or(&0));
        let points = self.fill.points;
        let of_modes = OF_MODES.contains(&field);
        if of_modes && first >= self.modes
            || self.modes == 0
                && ["g_ref", "g_floor", "damping_law", "damping_law_kind"].contains(&field)
        {
            return Some(format!("modes = {}", self.modes));
        }
        if let "liquid_0" | "outlet" = field {
            return (points == 0).then(|| "fill.points = 0".into());
        }
        if field.starts_with("fill.") && field != "fill.points" {
            return (last >= points).then(|| format!("fill.points = {points}"));
        }
        if field.starts_with("ball.") && field != "ball.travel" {
            return (self.ball.travel == 0.0).then(|| "ball.travel = 0".into());
        }
        match field {
            "m_0" | "H_0" | "I_0" | "I_z" | "mass" | "length" | "hinge" if points > 0 => {
                Some(format!("fill.points = {points}; the table has it"))
            }
            "m_0" | "H_0" | "I_0" | "mass" | "length" | "hinge" | "wave" if self.diameter > 0.0 => {
                Some(format!(
                    "diameter = {:?} m; it follows from diameter and depth",
                    self.diameter
                ))
            }
            "depth" | "density" if self.diameter == 0.0 => Some("diameter = 0".into()),
            "length" if self.frequency[first] > 0.0 => {
                Some(format!("frequency[{}] = {:?} Hz", first + 1, self.frequency[first]))
            }
            "arm" if self.direction[first] == [0.0; 2] => {
                Some(format!("direction[{0},1] and direction[{0},2] are 0", first + 1))
            }
            _ => None,
        }
    }
}

impl Parameters {
    /// [`Tank::without_effect`] for all parameters of a craft by their names in the FMU, `tank[].mass`. The first index of
    /// a tank's is the tank.
    pub fn without_effect(&self, name: &str, indices: &[usize]) -> Option<String> {
        if let (Some(field), [i, rest @ ..]) = (name.strip_prefix("tank[]."), indices) {
            return match *i < self.tanks {
                true => {
                    let why = self.tank[*i].without_effect(field, rest)?;
                    Some(format!("tank[{}].{why}", i + 1))
                }
                false => Some(format!("tanks = {}", self.tanks)),
            };
        }
        let is_of_pivot = name == "gravity" || name.starts_with("pivot.");
        let friction = &self.pivot.friction;
        match name {
            _ if is_of_pivot && self.mount == Mount::Free => Some("mount = free".into()),
            "pivot.friction.omega_s" if friction.d == [0.0; 3] => {
                Some("pivot.friction.d = 0".into())
            }
            "pivot.friction.eps" if [friction.c, friction.d] == [[0.0; 3]; 2] => {
                Some("pivot.friction.c = 0 and pivot.friction.d = 0".into())
            }
            _ => None,
        }
    }
}
