//! Parameters whose value another parameter replaces, from the FMU's warnings: "slosh.zeta has no effect: …".

use anyhow::{Result, bail};

use crate::input::names::list;

/// Fails if the FMU's warnings name an unknown as one without effect: nothing can be estimated.
///
/// # Errors
/// For such an unknown, with the reason.
pub fn refuse(unknown: &str, warnings: &[String]) -> Result<()> {
    for warning in warnings {
        let parts = [" has no effect: ", " have no effect: "];
        let Some((names, why)) = parts.iter().find_map(|part| warning.split_once(part)) else {
            continue;
        };
        if list(names).any(|name| name == unknown) {
            bail!("{unknown} is free, but {unknown} has no effect while {why}");
        }
    }
    Ok(())
}

/// A value near `start` within `bounds` that is not `start`: the FMU warns of no value that it starts with itself.
pub fn near(start: f64, (low, high): (f64, f64), reach: f64) -> f64 {
    let by = 1e-6 * reach;
    if start + by <= high { start + by } else { (start - by).max(low) }
}
