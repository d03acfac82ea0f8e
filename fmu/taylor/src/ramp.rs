use crate::vector::Vec3;

/// A number or a vector that is linear in time: `value` + `slope` t, with the time t in s and the slope per second.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Ramp<T = f64> {
    pub value: T,
    pub slope: T,
}

impl Ramp {
    pub fn held(value: f64) -> Ramp {
        Ramp { value, slope: 0.0 }
    }

    #[inline(always)]
    pub fn value_at(self, t: f64) -> f64 {
        self.value + self.slope * t
    }

    pub fn integral(self, t: f64) -> f64 {
        (self.value + self.slope * t / 2.0) * t
    }

    /// Returns the same function of time with its origin of time shifted to `t`, s.
    pub fn shifted(self, t: f64) -> Ramp {
        Ramp { value: self.value_at(t), slope: self.slope }
    }
}

impl Ramp<Vec3> {
    pub fn held(value: Vec3) -> Ramp<Vec3> {
        Ramp { value, slope: [0.0; 3] }
    }

    #[inline(always)]
    pub fn value_at(&self, t: f64) -> Vec3 {
        [0, 1, 2].map(|i| self.value[i] + self.slope[i] * t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_is_linear_in_time() {
        let ramp = Ramp { value: 2.0, slope: 3.0 };
        assert_eq!((ramp.value_at(2.0), ramp.integral(2.0)), (8.0, 10.0));
        assert_eq!(ramp.shifted(2.0), Ramp { value: 8.0, slope: 3.0 });
        assert_eq!(Ramp::<f64>::held(2.0), Ramp { value: 2.0, slope: 0.0 });
        let ramp = Ramp { value: [1.0, 2.0, 3.0], slope: [1.0, 0.0, -1.0] };
        assert_eq!(ramp.value_at(2.0), [3.0, 2.0, 1.0]);
        assert_eq!(Ramp::<Vec3>::held([1.0; 3]), Ramp { value: [1.0; 3], slope: [0.0; 3] });
    }
}
