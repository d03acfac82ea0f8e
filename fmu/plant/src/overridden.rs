use alloc::format;
use alloc::string::String;

use crate::parameters::{Parameters, SloshSource};
use crate::slosh_model::SloshModel;

impl Parameters {
    /// Returns the reason why the value of a parameter has no effect although its part of the model is in use, for example
    /// "slosh.zeta_from_correlation = true". `name` is the name of the parameter in the FMU. The result is `None` if the
    /// parameter has an effect, or if its part of the model is switched off.
    ///
    /// A Boolean has an integer twin, whose name ends in `_kind` and by which a host can set the Boolean as well. The values
    /// of these twins must have been applied before.
    pub fn overridden(&self, name: &str) -> Option<String> {
        let slosh = &self.slosh;
        if slosh.model == SloshModel::Frozen {
            return None;
        }
        let is_table = slosh.source == SloshSource::Table;
        let is_planar = matches!(slosh.model, SloshModel::Linear | SloshModel::Planar);
        let is_askew = is_table && slosh.table.is_askew(slosh.modes);
        match name.strip_suffix("_kind").unwrap_or(name) {
            "init.slosh_angle_radial" | "init.slosh_rate_radial" if is_planar && !is_askew => {
                Some("modes of slosh.model = linear and planar move along the tangent".into())
            }
            table if table.starts_with("slosh.table.") && !is_table => {
                Some("slosh.source = geometry".into())
            }
            "slosh.table.nonlinear_inertia" | "slosh.table.nonlinear_stiffness"
                if !matches!(slosh.model, SloshModel::Linear | SloshModel::Liquid) =>
            {
                Some(format!(
                    "slosh.model = {} has a fixed dependence on the amplitude; only slosh.model = liquid uses this parameter",
                    slosh.model.name()
                ))
            }
            "tank.h"
            | "fluid.nu"
            | "slosh.zeta"
            | "slosh.zeta_from_correlation"
            | "slosh.capillarity"
                if is_table =>
            {
                Some("slosh.source = table; slosh.table describes the liquid".into())
            }
            "slosh.zeta" if slosh.zeta_from_correlation => Some(
                "slosh.zeta_from_correlation is true; with false the damping ratio is slosh.zeta"
                    .into(),
            ),
            _ => None,
        }
    }
}
