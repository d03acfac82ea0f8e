/// A quantity that is linear in time: `value + slope t`.
pub type Ramp = taylor::ramp::Ramp;

/// Inputs of the plant over one step. `tau_cmd` is the torque command to the actuator and `tau_ext` the external torque on
/// the hub, both N m; `g_axial` is the specific force along the tank's axis, m/s2, and must not be negative.
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
