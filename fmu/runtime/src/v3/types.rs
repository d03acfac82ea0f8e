//! The types of C in FMI 3.0, under the names of the standard.

use std::ffi::{c_char, c_int, c_void};

use crate::c_abi;

/// An instance, opaque to the host.
pub type fmi3Instance = *mut c_void;
/// The host's own pointer, handed back to it.
pub type fmi3InstanceEnvironment = *mut c_void;
/// A saved state, opaque to the host.
pub type fmi3FMUState = *mut c_void;
/// The number of a variable.
pub type fmi3ValueReference = u32;
/// A real number.
pub type fmi3Float64 = f64;
/// A short real number.
pub type fmi3Float32 = f32;
/// An integer.
pub type fmi3Int32 = i32;
/// The number of an enumeration's item.
pub type fmi3Int64 = i64;
/// An unsigned integer.
pub type fmi3UInt64 = u64;
/// C's bool, one byte: 0 is false, everything else true. As a Rust bool, other bytes than 0 and 1 would be
/// undefined behaviour.
pub type fmi3Boolean = u8;
/// Text that ends with NUL.
pub type fmi3String = *const c_char;
/// A byte of a saved state, or of a binary variable.
pub type fmi3Byte = u8;
/// The bytes of a binary variable.
pub type fmi3Binary = *const fmi3Byte;
/// True if a clock ticks.
pub type fmi3Clock = bool;

/// Return value of a call.
pub type fmi3Status = c_abi::Status;
/// All is well.
pub const fmi3OK: fmi3Status = c_abi::OK;
/// Never returned.
pub const fmi3Warning: fmi3Status = c_abi::WARNING;
/// The call has no answer, or a value was out of its range; the instance is as before.
pub const fmi3Discard: fmi3Status = c_abi::DISCARD;
/// The call was refused or failed; the simulation is terminated.
pub const fmi3Error: fmi3Status = c_abi::ERROR;
/// The instance is unusable.
pub const fmi3Fatal: fmi3Status = c_abi::FATAL;

/// Kind of the dependency of an unknown on a known.
pub type fmi3DependencyKind = c_int;
/// Nothing particular.
pub const fmi3Dependent: fmi3DependencyKind = 1;

/// Qualifier of a clock's interval.
pub type fmi3IntervalQualifier = c_int;

/// The host's logger.
pub type fmi3LogMessageCallback = Option<
    unsafe extern "C" fn(
        environment: fmi3InstanceEnvironment,
        status: fmi3Status,
        category: fmi3String,
        message: fmi3String,
    ),
>;

/// Callback of the host within a step.
pub type fmi3IntermediateUpdateCallback = Option<
    unsafe extern "C" fn(
        environment: fmi3InstanceEnvironment,
        intermediateUpdateTime: fmi3Float64,
        intermediateVariableSetRequested: fmi3Boolean,
        intermediateVariableGetAllowed: fmi3Boolean,
        intermediateStepFinished: fmi3Boolean,
        canReturnEarly: fmi3Boolean,
        earlyReturnRequested: *mut fmi3Boolean,
        earlyReturnTime: *mut fmi3Float64,
    ),
>;

/// Callback of Scheduled Execution.
pub type fmi3ClockUpdateCallback =
    Option<unsafe extern "C" fn(environment: fmi3InstanceEnvironment)>;
/// Callback of Scheduled Execution.
pub type fmi3LockPreemptionCallback = Option<unsafe extern "C" fn()>;
/// Callback of Scheduled Execution.
pub type fmi3UnlockPreemptionCallback = Option<unsafe extern "C" fn()>;
