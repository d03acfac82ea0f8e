//! The instance as a run sees it, and the functions that a run calls.

use std::ffi::c_int;

/// `fmi2OK`.
pub const OK: c_int = 0;
/// `fmi2Warning`: the call is done, the FMU has said why it warns.
pub const WARNING: c_int = 1;

/// `fmi2Discard`: the step was not made, or not to its end.
pub const DISCARD: c_int = 2;
/// `fmi2Error`.
pub const ERROR: c_int = 3;

/// Functions that a run calls, by their names in FMI 2.0; the numbers are part of the C interface. FMI 3.0 has the same
/// for Float64, Int32 or Int64, and Boolean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub enum Function {
    /// fmi2SetReal
    SetReal,
    /// fmi2SetInteger
    SetInteger,
    /// fmi2SetBoolean
    SetBoolean,
    /// fmi2SetRealInputDerivatives; in FMI 3.0 fmi3SetFloat64 within a step
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

/// An instance after its initialisation, as the loop sees it, of either version of FMI. Every method returns the status
/// of its C function, whose numbers are the same in both.
pub trait Instance {
    /// fmi2SetReal
    fn set_real(&self, references: &[u32], values: &[f64]) -> c_int;
    /// fmi2SetInteger
    fn set_integer(&self, references: &[u32], values: &[c_int]) -> c_int;
    /// fmi2SetBoolean
    fn set_boolean(&self, references: &[u32], values: &[c_int]) -> c_int;
    /// fmi2SetRealInputDerivatives, first derivatives, for the next step; `values` are those set just now
    fn set_slopes(&self, references: &[u32], values: &[f64], slopes: &[f64]) -> c_int;
    /// fmi2DoStep from `time` by `step`, s: the function that the status is of, for in FMI 3.0 inputs are set within
    fn do_step(&self, time: f64, step: f64) -> (Function, c_int);
    /// fmi2GetReal
    fn get_real(&self, references: &[u32], values: &mut [f64]) -> c_int;
    /// fmi2GetInteger
    fn get_integer(&self, references: &[u32], values: &mut [c_int]) -> c_int;
    /// fmi2GetBoolean
    fn get_boolean(&self, references: &[u32], values: &mut [c_int]) -> c_int;
}
