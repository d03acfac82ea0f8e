//! The instance as a run sees it, and the functions that a run calls.

use std::ffi::c_int;

/// `fmi2OK`.
pub const OK: c_int = 0;
/// `fmi2Warning`: the call is done, the FMU has said why it warns.
pub const WARNING: c_int = 1;

/// Functions of FMI 2.0 that a run calls; the numbers are part of the C interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub enum Function {
    /// fmi2SetReal
    SetReal,
    /// fmi2SetInteger
    SetInteger,
    /// fmi2SetBoolean
    SetBoolean,
    /// fmi2SetRealInputDerivatives
    SetRealInputDerivatives,
    /// fmi2DoStep
    DoStep,
    /// fmi2GetReal
    GetReal,
    /// fmi2GetInteger
    GetInteger,
    /// fmi2GetBoolean
    GetBoolean,
    /// No function of FMI: the controller of a closed loop
    Controller,
}

/// An instance after its initialisation, as the loop sees it. Every method returns the `fmi2Status`
/// of its C function.
pub trait Instance {
    /// fmi2SetReal
    fn set_real(&self, references: &[u32], values: &[f64]) -> c_int;
    /// fmi2SetInteger
    fn set_integer(&self, references: &[u32], values: &[c_int]) -> c_int;
    /// fmi2SetBoolean
    fn set_boolean(&self, references: &[u32], values: &[c_int]) -> c_int;
    /// fmi2SetRealInputDerivatives, first derivatives
    fn set_slopes(&self, references: &[u32], slopes: &[f64]) -> c_int;
    /// fmi2DoStep from `time` by `step`, s
    fn do_step(&self, time: f64, step: f64) -> c_int;
    /// fmi2GetReal
    fn get_real(&self, references: &[u32], values: &mut [f64]) -> c_int;
    /// fmi2GetInteger
    fn get_integer(&self, references: &[u32], values: &mut [c_int]) -> c_int;
    /// fmi2GetBoolean
    fn get_boolean(&self, references: &[u32], values: &mut [c_int]) -> c_int;
}
