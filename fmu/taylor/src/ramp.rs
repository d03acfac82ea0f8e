//! What acts from outside: quantities that are linear in time.

use crate::vector::Vec3;

/// A quantity that is linear in time: `value + slope t`. A number, or a vector.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Ramp<T = f64> {
    /// Value now.
    pub value: T,
    /// Rate of change, 1/s.
    pub slope: T,
}

impl Ramp {
    /// A quantity that stays.
    pub fn held(value: f64) -> Ramp {
        Ramp { value, slope: 0.0 }
    }

    /// The value after `t` seconds.
    #[inline(always)]
    pub fn at(self, t: f64) -> f64 {
        self.value + self.slope * t
    }

    /// The integral from 0 to `t`.
    pub fn integral(self, t: f64) -> f64 {
        (self.value + self.slope * t / 2.0) * t
    }

    /// The same quantity with the origin of time moved on by `t`.
    pub fn after(self, t: f64) -> Ramp {
        Ramp { value: self.at(t), slope: self.slope }
    }
}

impl Ramp<Vec3> {
    /// A vector that stays.
    pub fn held(value: Vec3) -> Ramp<Vec3> {
        Ramp { value, slope: [0.0; 3] }
    }

    /// The value after `t` seconds.
    #[inline(always)]
    pub fn at(&self, t: f64) -> Vec3 {
        [0, 1, 2].map(|i| self.value[i] + self.slope[i] * t)
    }
}
