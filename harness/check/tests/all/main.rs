//! Checks FMUs: ours breaks no rule, and each FMU with a fault breaks the intended rule.

mod archives;
mod behaviour;
mod binaries;
mod common;
mod descriptions;
mod fmi3;
#[cfg(unix)]
mod process;
mod reading;
mod report;
mod small;
