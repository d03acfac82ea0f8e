//! Parameters that have no effect because another parameter replaces them. The FMU's warnings name them:
//! "slosh.zeta has no effect: …".

use anyhow::{Result, bail};

use crate::input::names::list;

/// Fails if the FMU warns that an unknown has no effect, because it cannot be estimated then.
///
/// # Errors
/// If a warning names the unknown; the message has the FMU's reason.
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

/// Returns a value close to `start` within the bounds. It differs from `start`, which may be the parameter's default,
/// because an FMU does not warn about a parameter that is set to its default.
pub fn near(start: f64, (low, high): (f64, f64), reach: f64) -> f64 {
    let by = 1e-6 * reach;
    if start + by <= high { start + by } else { (start - by).max(low) }
}
