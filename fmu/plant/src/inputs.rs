//! Inputs of the plant, as ramps in time.

/// A quantity that is linear in time: `value + slope t`.
pub type Ramp = taylor::ramp::Ramp;

/// Inputs of the plant over one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs {
    /// Torque command to the actuator, N m.
    pub tau_cmd: Ramp,
    /// External torque on the hub, N m.
    pub tau_ext: Ramp,
    /// Specific force along the tank's axis, m/s2, not negative.
    pub g_axial: Ramp,
}

impl Default for Inputs {
    fn default() -> Self {
        Inputs { tau_cmd: Ramp::held(0.0), tau_ext: Ramp::held(0.0), g_axial: Ramp::held(9.81) }
    }
}
