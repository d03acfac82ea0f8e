//! The rules of `check` on FMUs: ours keeps every rule, and FMUs that break one are found by it.

mod archives;
mod behaviour;
mod binaries;
mod common;
mod descriptions;
mod fmi3;
mod small;
