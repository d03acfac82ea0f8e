//! Numbers that may be NaN or infinite, for hosts that trap invalid operations.

/// Returns true if x is finite. It tests the bits, because comparing with NaN would end the process of a host
/// that traps invalid operations.
#[inline]
pub const fn is_finite(x: f64) -> bool {
    const EXPONENT: u64 = f64::INFINITY.to_bits();
    x.to_bits() & EXPONENT != EXPONENT
}

/// Formats a number for a message. Formatting compares numbers, which must not be done with NaN, see
/// [`is_finite`].
pub fn text(x: f64) -> String {
    let is_nan = x.to_bits() << 1 > f64::INFINITY.to_bits() << 1;
    if is_nan { "NaN".into() } else { format!("{x:?}") }
}
