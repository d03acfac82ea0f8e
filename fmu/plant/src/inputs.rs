/// A quantity that is linear in time: `value` + `slope` t.
pub type Ramp = taylor::ramp::Ramp;

/// Inputs of the plant during one step: the torque command `tau_cmd` to the actuator, N m; the external torque `tau_ext` on
/// the hub, N m; and the specific force `g_axial` along the tank's axis, m/s2, which must not be negative.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Inputs {
    pub tau_cmd: Ramp,
    pub tau_ext: Ramp,
    pub g_axial: Ramp,
}

impl Default for Inputs {
    fn default() -> Self {
        Inputs { tau_cmd: Ramp::held(0.0), tau_ext: Ramp::held(0.0), g_axial: Ramp::held(9.81) }
    }
}
