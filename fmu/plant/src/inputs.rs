//! What acts on the plant from outside, as ramps in time.

/// A quantity that is linear in time: `value + slope t`.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Ramp {
    /// Value now.
    pub value: f64,
    /// Rate of change, 1/s.
    pub slope: f64,
}

impl Ramp {
    /// A quantity that stays.
    pub fn held(value: f64) -> Ramp {
        Ramp { value, slope: 0.0 }
    }

    /// The value after `t` seconds.
    pub fn at(self, t: f64) -> f64 {
        self.value + self.slope * t
    }

    pub(crate) fn integral(self, t: f64) -> f64 {
        (self.value + self.slope * t / 2.0) * t
    }

    /// The same quantity with the origin of time moved on by `t`.
    pub(crate) fn after(self, t: f64) -> Ramp {
        Ramp { value: self.at(t), slope: self.slope }
    }
}

/// What acts on the plant from outside, over one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs {
    /// Torque command to the actuator, N m.
    pub tau_cmd: Ramp,
    /// Any other torque on the hub, N m.
    pub tau_ext: Ramp,
    /// Specific force along the tank's axis, m/s2, not negative.
    pub g_axial: Ramp,
}

impl Default for Inputs {
    fn default() -> Self {
        Inputs { tau_cmd: Ramp::held(0.0), tau_ext: Ramp::held(0.0), g_axial: Ramp::held(9.81) }
    }
}
