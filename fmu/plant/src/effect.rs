//! Parameters that have no effect with the others as they are.

use alloc::format;
use alloc::string::String;

use crate::parameters::{FrictionModel, Parameters, SloshModel, SloshSource};

/// Names of the friction laws in the FMU, in the order of [`FrictionModel::ALL`].
const LAWS: [&str; 5] = ["none", "viscous", "stribeck_smooth", "stribeck", "lugre"];

impl Parameters {
    /// Returns why a parameter has no effect on the motion or on any output; `None` if it has one. `name` is the FMU's
    /// (`slosh.table.mass`, with `_kind` where a number stands for an enumeration or a Boolean), `index` the element's,
    /// from 0. Enumerations and Booleans have their `…kind` applied.
    pub fn without_effect(&self, name: &str, index: usize) -> Option<String> {
        let name = name.strip_suffix("_kind").unwrap_or(name);
        match name.split_once('.')? {
            ("slosh" | "baffle" | "tank" | "fluid", _) => self.of_liquid(name, index),
            ("friction", field) => self.of_friction(field),
            ("hub", "theta_0") => (self.hub.k == 0.0).then(|| "hub.k = 0".into()),
            ("hub", "imbalance_angle") if self.hub.imbalance == 0.0 => {
                Some("hub.imbalance = 0".into())
            }
            ("hub", "imbalance" | "imbalance_angle") | ("bench", "tilt_azimuth") => {
                (self.bench.tilt == 0.0).then(|| "bench.tilt = 0".into())
            }
            ("init", field) if field.starts_with("slosh") => self.of_start(field),
            ("wheel", "speed_min" | "speed_max" | "tau_max") => {
                (!self.wheel.enabled).then(|| "wheel.enabled is false".into())
            }
            ("imu", field) if field != "enabled" => self.of_gyro(field),
            _ => None,
        }
    }

    fn of_liquid(&self, name: &str, index: usize) -> Option<String> {
        let (slosh, is_table) = (&self.slosh, self.slosh.source == SloshSource::Table);
        let by_correlation = slosh.zeta_from_correlation;
        let of_modes = match name {
            "slosh.model" | "slosh.source" | "slosh.kind" | "slosh.table.m_liq" => false,
            "fluid.nu" => true,
            _ => name.starts_with("slosh.") || name.starts_with("baffle."),
        };
        if let Some(field) = name.strip_prefix("slosh.table.") {
            let is_array = !["m_liq", "g_ref", "one_axis"].contains(&field);
            if !is_table {
                return Some("slosh.source = geometry".into());
            }
            if is_array && index >= slosh.modes {
                return Some(format!("slosh.modes = {}", slosh.modes));
            }
        }
        if of_modes && slosh.model == SloshModel::Frozen {
            return Some("slosh.model = frozen".into());
        }
        match name {
            "tank.h"
            | "fluid.nu"
            | "slosh.zeta"
            | "slosh.zeta_from_correlation"
            | "slosh.capillarity"
                if is_table =>
            {
                Some("slosh.source = table, where slosh.table says what the liquid is".into())
            }
            "slosh.zeta" if by_correlation => Some(
                "slosh.zeta_from_correlation is true; with false the damping ratio is slosh.zeta"
                    .into(),
            ),
            "fluid.nu" if !by_correlation => Some("slosh.zeta_from_correlation is false".into()),
            "slosh.hardening" if slosh.model != SloshModel::Paraboloid => {
                Some("slosh.model is not paraboloid".into())
            }
            "baffle.depth" if self.baffle.width == 0.0 => Some("baffle.width = 0".into()),
            _ => None,
        }
    }

    fn of_friction(&self, field: &str) -> Option<String> {
        use FrictionModel::{Lugre, None as Free, StribeckSmooth, Viscous};
        let model = self.friction.model;
        let is_used = match field {
            "model" | "kind" => true,
            "b" => model != Free,
            "eps" => model == StribeckSmooth,
            "sigma0" | "sigma1" => model == Lugre,
            _ => model != Free && model != Viscous,
        };
        if !is_used {
            return Some(format!("friction.model = {}", LAWS[model as usize - 1]));
        }
        (field == "omega_s" && self.friction.d == 0.0).then(|| "friction.d = 0".into())
    }

    fn of_start(&self, field: &str) -> Option<String> {
        let slosh = &self.slosh;
        let is_planar = matches!(slosh.model, SloshModel::Linear | SloshModel::Planar);
        let is_askew = slosh.source == SloshSource::Table && slosh.table.is_askew(slosh.modes);
        if slosh.model == SloshModel::Frozen {
            // A start at rest is that of rigid liquid, too: hosts that start at rest set it for every model.
            let at_rest = field == "slosh_angle" && self.init.slosh_angle == 0.0;
            return (!at_rest).then(|| "slosh.model = frozen".into());
        }
        (field.ends_with("_radial") && is_planar && !is_askew)
            .then(|| "modes of slosh.model = linear and planar move along the tangent".into())
    }

    fn of_gyro(&self, field: &str) -> Option<String> {
        let imu = &self.imu;
        match field {
            _ if !imu.enabled => Some("imu.enabled is false".into()),
            "bias_time" if imu.bias_instability == 0.0 => Some("imu.bias_instability = 0".into()),
            "seed" if imu.bias_instability == 0.0 && imu.arw == 0.0 => {
                Some("imu.arw = 0 and imu.bias_instability = 0".into())
            }
            _ => None,
        }
    }
}
