use alloc::format;
use alloc::string::String;

use crate::parameters::{Parameters, Tank};

impl Tank {
    /// Returns the reason why the value of a parameter has no effect although its tank and mode are in use. Returns `None`
    /// if it has an effect, or if the mode is not in use. `field` is the parameter's name in the FMUs after `tank.`, and
    /// `indices` are the indices of its element, which count from 0.
    pub fn overridden(&self, field: &str, indices: &[usize]) -> Option<String> {
        let n = *indices.first().unwrap_or(&0);
        let is_of_mode = matches!(
            field,
            "mass"
                | "length"
                | "hinge"
                | "wave"
                | "zeta"
                | "angle_limit"
                | "swirl_limit"
                | "nonlinear_inertia"
                | "nonlinear_stiffness"
                | "nonlinear_inertia_2"
                | "nonlinear_stiffness_2"
                | "rotary_inertia"
                | "rotary_inertia_2"
                | "gyroscopic"
                | "gyroscopic_stiffness"
        );
        if is_of_mode && n >= self.modes {
            return None;
        }
        match field {
            "m_0" | "H_0" | "I_0" | "I_z" | "mass" | "length" | "hinge" if self.fill.points > 0 => {
                Some(format!(
                    "fill.points = {}, so that the fill table gives the value",
                    self.fill.points
                ))
            }
            "zeta" if self.fill.has_zeta(n) => {
                Some(format!("fill.zeta[{},1] to fill.zeta[{0},{}]", n + 1, self.fill.points))
            }
            "angle_limit" | "swirl_limit" if self.fill.limits_everywhere(field, n) => {
                Some(format!("fill.{field}[{},1] to fill.{field}[{0},{}]", n + 1, self.fill.points))
            }
            "nonlinear_inertia" | "nonlinear_stiffness" if self.fill.has_surface(n) => {
                Some(format!("fill.{field}[{},1] to fill.{field}[{0},{}]", n + 1, self.fill.points))
            }
            "m_0" | "H_0" | "I_0" | "mass" | "length" | "hinge" | "wave" if self.diameter > 0.0 => {
                Some(format!(
                    "diameter = {:?} m, so that the value follows from diameter and depth",
                    self.diameter
                ))
            }
            "length" if self.frequency[n] > 0.0 => {
                Some(format!("frequency[{}] = {:?} Hz", n + 1, self.frequency[n]))
            }
            "spin_inertia_across"
            | "spin_coupling"
            | "spin_decay"
            | "slip_0"
            | "gyroscopic"
            | "gyroscopic_stiffness"
                if self.spin_inertia == 0.0 =>
            {
                Some("spin_inertia = 0; the liquid has no spin".into())
            }
            _ => None,
        }
    }
}

impl Parameters {
    /// Returns [`Tank::overridden`] for any parameter of a craft. `name` is its name in the FMU, such as `tank[].mass`, and the
    /// first of the `indices` is the number of the tank, from 0.
    pub fn overridden(&self, name: &str, indices: &[usize]) -> Option<String> {
        let (field, (i, rest)) = (name.strip_prefix("tank[].")?, indices.split_first()?);
        let tank = self.tank[..self.tanks].get(*i)?;
        Some(format!("tank[{}].{}", i + 1, tank.overridden(field, rest)?))
    }
}
