//! The commands, one file each.

use anyhow::{Context, Result};

pub mod campaign;
pub mod check;
pub mod design;
pub mod example;
pub mod gyro;
pub mod identify;
pub mod pack;
pub mod release;
pub mod run;
pub mod scale;
pub mod tank;
pub mod torque;

/// The FMU that commands drive unless another is named.
pub const DEFAULT_FMU: &str = "dist/HubSlosh.fmu";
/// Where a campaign goes.
pub const DEFAULT_CAMPAIGN: &str = "dist/campaign";

/// The value of a flag `--set`.
fn setting(text: &str) -> Result<(String, String)> {
    let (name, value) = text
        .split_once('=')
        .with_context(|| format!("\"{text}\" is not of the form name=value"))?;
    Ok((name.trim().into(), value.trim().into()))
}
