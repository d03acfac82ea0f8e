//! Functions for numbers that may be NaN or infinite. Some importers make invalid floating-point operations trap, so these
//! functions must not cause any.

/// Returns true if `x` is finite. The function tests the bits, because some hosts let the processor stop the program at
/// invalid operations, and a comparison with NaN is one.
#[inline]
pub const fn is_finite(x: f64) -> bool {
    const EXPONENT: u64 = f64::INFINITY.to_bits();
    x.to_bits() & EXPONENT != EXPONENT
}

/// Formats a number for a message. NaN is recognised by its bits, because in some hosts a comparison with NaN stops the
/// program (see [`is_finite`]).
pub fn text(x: f64) -> String {
    let is_nan = x.to_bits() << 1 > f64::INFINITY.to_bits() << 1;
    if is_nan { "NaN".into() } else { format!("{x:?}") }
}
