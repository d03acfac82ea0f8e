//! The C types of FMI 3.0, under the names of the standard, which documents them.

// The standard documents these names.
#![allow(missing_docs)]

use std::ffi::{c_char, c_int, c_void};

use crate::c_abi;

pub type fmi3Instance = *mut c_void;
pub type fmi3InstanceEnvironment = *mut c_void;
pub type fmi3FMUState = *mut c_void;
pub type fmi3ValueReference = u32;
pub type fmi3Float64 = f64;
pub type fmi3Float32 = f32;
pub type fmi3Int32 = i32;
pub type fmi3Int64 = i64;
pub type fmi3UInt64 = u64;
/// The bool of C: one byte, in which 0 is false and any other value is true. It is not Rust's bool, because in a Rust bool
/// any byte except 0 and 1 is undefined behaviour.
pub type fmi3Boolean = u8;
pub type fmi3String = *const c_char;
pub type fmi3Byte = u8;
pub type fmi3Binary = *const fmi3Byte;
pub type fmi3Clock = bool;

pub(super) type References = (*const fmi3ValueReference, usize);

pub type fmi3Status = c_abi::Status;
pub const fmi3OK: fmi3Status = c_abi::OK;
pub const fmi3Warning: fmi3Status = c_abi::WARNING;
pub const fmi3Discard: fmi3Status = c_abi::DISCARD;
pub const fmi3Error: fmi3Status = c_abi::ERROR;
pub const fmi3Fatal: fmi3Status = c_abi::FATAL;

pub type fmi3DependencyKind = c_int;
pub const fmi3Dependent: fmi3DependencyKind = 1;

pub type fmi3IntervalQualifier = c_int;

pub type fmi3LogMessageCallback = Option<
    unsafe extern "C" fn(
        environment: fmi3InstanceEnvironment,
        status: fmi3Status,
        category: fmi3String,
        message: fmi3String,
    ),
>;

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

pub type fmi3ClockUpdateCallback =
    Option<unsafe extern "C" fn(environment: fmi3InstanceEnvironment)>;
pub type fmi3LockPreemptionCallback = Option<unsafe extern "C" fn()>;
pub type fmi3UnlockPreemptionCallback = Option<unsafe extern "C" fn()>;
