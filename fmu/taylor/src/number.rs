//! Number types with which a formula is written once, for values and for directional derivatives.

use core::ops::{Add, Div, Mul, Neg, Sub};

/// Number type over which a formula is generic: with [`f64`] the formula gives its value, with
/// [`Dual`] its directional derivative.
pub trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    fn constant(value: f64) -> Self;
    /// Returns a number from coefficients 0 and 1 of a quantity's power series. A [`Dual`] takes coefficient 1 as its
    /// derivative; an `f64` ignores it.
    fn with_slope(value: f64, slope: f64) -> Self;
    /// Returns the value of an `f64`, or the derivative of a [`Dual`].
    fn result(self) -> f64;
    fn value(self) -> f64;
    /// Returns the larger of the number and `floor`. The value is computed as a maximum and not as a choice between
    /// two numbers, because a compiler turns 1/choice into a choice between two quotients and may divide by a zero
    /// that is not chosen.
    fn at_least(self, floor: f64) -> Self {
        let slope = if self.value() < floor { 0.0 } else { self.result() };
        Self::with_slope(f64::max(self.value(), floor), slope)
    }
    /// Returns the number divided by `divisor`, which must not be negative; 0 if the divisor is 0. The divisor is replaced
    /// by a maximum, because a compiler may compute both sides of a choice and thus divide by 0.
    fn over_or_zero(self, divisor: Self) -> Self {
        let numerator = if divisor.value() > 0.0 { self } else { Self::constant(0.0) };
        numerator / divisor.at_least(f64::MIN_POSITIVE)
    }
    fn clamp(self, low: f64, high: f64) -> Self {
        if self.value() > high { Self::constant(high) } else { self.at_least(low) }
    }
    fn recip(self) -> Self;
    /// Returns the square root. Its derivative is set to 0 at 0, where it does not exist.
    fn sqrt(self) -> Self;
    fn sin(self) -> Self;
    fn exp(self) -> Self;
    fn tanh(self) -> Self;
    /// Returns the arc sine, rad. Its derivative is set to 0 at +-1, where it does not exist.
    fn asin(self) -> Self;
    /// Returns sqrt(self^2 + b^2). Its derivative is set to 0 at 0, where it does not exist.
    fn hypot(self, b: Self) -> Self;
}

impl Number for f64 {
    fn constant(value: f64) -> f64 {
        value
    }

    fn with_slope(value: f64, _: f64) -> f64 {
        value
    }

    fn result(self) -> f64 {
        self
    }

    fn value(self) -> f64 {
        self
    }

    fn recip(self) -> f64 {
        1.0 / self
    }

    fn sqrt(self) -> f64 {
        libm::sqrt(self)
    }

    fn sin(self) -> f64 {
        libm::sin(self)
    }

    fn exp(self) -> f64 {
        libm::exp(self)
    }

    fn tanh(self) -> f64 {
        libm::tanh(self)
    }

    fn asin(self) -> f64 {
        libm::asin(self.clamp(-1.0, 1.0))
    }

    fn hypot(self, b: f64) -> f64 {
        libm::hypot(self, b)
    }
}

/// A value with its directional derivative: value + slope s + O(s^2).
#[derive(Clone, Copy, Debug)]
pub struct Dual {
    value: f64,
    slope: f64,
}

impl Add for Dual {
    type Output = Dual;

    fn add(self, b: Dual) -> Dual {
        Dual { value: self.value + b.value, slope: self.slope + b.slope }
    }
}

impl Sub for Dual {
    type Output = Dual;

    fn sub(self, b: Dual) -> Dual {
        Dual { value: self.value - b.value, slope: self.slope - b.slope }
    }
}

impl Mul for Dual {
    type Output = Dual;

    fn mul(self, b: Dual) -> Dual {
        let slope = self.slope * b.value + self.value * b.slope;
        Dual { value: self.value * b.value, slope }
    }
}

impl Mul<f64> for Dual {
    type Output = Dual;

    fn mul(self, b: f64) -> Dual {
        Dual { value: self.value * b, slope: self.slope * b }
    }
}

impl Div for Dual {
    type Output = Dual;

    fn div(self, b: Dual) -> Dual {
        let value = self.value / b.value;
        Dual { value, slope: (self.slope - value * b.slope) / b.value }
    }
}

impl Neg for Dual {
    type Output = Dual;

    fn neg(self) -> Dual {
        Dual { value: -self.value, slope: -self.slope }
    }
}

impl Number for Dual {
    fn constant(value: f64) -> Dual {
        Dual { value, slope: 0.0 }
    }

    fn with_slope(value: f64, slope: f64) -> Dual {
        Dual { value, slope }
    }

    fn result(self) -> f64 {
        self.slope
    }

    fn value(self) -> f64 {
        self.value
    }

    fn recip(self) -> Dual {
        let value = 1.0 / self.value;
        Dual { value, slope: -self.slope * value * value }
    }

    fn sqrt(self) -> Dual {
        let value = libm::sqrt(self.value);
        Dual { value, slope: (0.5 * self.slope).over_or_zero(value) }
    }

    fn sin(self) -> Dual {
        let (value, cos) = libm::sincos(self.value);
        Dual { value, slope: self.slope * cos }
    }

    fn exp(self) -> Dual {
        let value = libm::exp(self.value);
        Dual { value, slope: self.slope * value }
    }

    fn tanh(self) -> Dual {
        let value = libm::tanh(self.value);
        Dual { value, slope: self.slope * (1.0 - value * value) }
    }

    fn asin(self) -> Dual {
        let cos = libm::sqrt(f64::max((1.0 - self.value) * (1.0 + self.value), 0.0));
        Dual { value: libm::asin(self.value.clamp(-1.0, 1.0)), slope: self.slope.over_or_zero(cos) }
    }

    fn hypot(self, b: Dual) -> Dual {
        let value = libm::hypot(self.value, b.value);
        let along = self.slope * self.value + b.slope * b.value;
        Dual { value, slope: along.over_or_zero(value) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn formulas<T: Number>(x: T) -> [T; 16] {
        let c = T::constant;
        [
            x + c(2.0),
            c(2.0) - x,
            x * x,
            x * 3.0,
            c(1.0) / x,
            x / (x + c(1.0)),
            -x,
            x.recip(),
            x.sqrt(),
            x.sin(),
            x.exp(),
            x.tanh(),
            (x * 0.5).asin(),
            x.hypot(x * x),
            x.at_least(0.1),
            x.clamp(-9.0, 9.0),
        ]
    }

    #[test]
    fn a_dual_number_has_the_value_and_the_derivative_of_the_formula() {
        let (x, slope, h) = (0.8, 1.5, 1e-5);
        let at = |s: f64| formulas(x + slope * s);
        for (i, dual) in formulas(Dual::with_slope(x, slope)).iter().enumerate() {
            assert_eq!(dual.value(), at(0.0)[i], "{i}");
            let expected = (at(h)[i] - at(-h)[i]) / (2.0 * h);
            // The error is h^2 times the third derivative, plus rounding divided by h.
            assert!((dual.result() - expected).abs() < 1e-9, "{i}: {} {expected}", dual.result());
        }
    }

    #[test]
    fn a_derivative_that_does_not_exist_is_set_to_0() {
        let zero = Dual::with_slope(0.0, 1.0);
        assert_eq!(zero.sqrt().result(), 0.0);
        assert_eq!(zero.hypot(zero).result(), 0.0);
        for end in [-1.0, 1.0, 1.0 + 1e-15] {
            assert_eq!(Dual::with_slope(end, 1.0).asin().result(), 0.0);
            assert_eq!(
                Dual::with_slope(end, 1.0).asin().value(),
                end.signum() * core::f64::consts::FRAC_PI_2
            );
        }
        let bounded = [
            Dual::with_slope(0.05, 1.0).at_least(0.1),
            Dual::with_slope(10.0, 1.0).clamp(-9.0, 9.0),
        ];
        assert_eq!(bounded.map(|x| (x.value(), x.result())), [(0.1, 0.0), (9.0, 0.0)]);
        assert_eq!(Number::at_least(0.05, 0.1), 0.1);
        assert_eq!(Number::asin(-2.0f64), -core::f64::consts::FRAC_PI_2);
    }

    #[test]
    fn functions_of_plain_numbers_return_plain_values() {
        assert_eq!(
            (f64::with_slope(2.0, 5.0), f64::constant(3.0), 4.0.result(), 4.0.value()),
            (2.0, 3.0, 4.0, 4.0)
        );
        let dual = Dual::constant(3.0);
        assert_eq!((dual.value(), dual.result()), (3.0, 0.0));
    }
}
