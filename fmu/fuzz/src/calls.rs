//! Fuzzes the C interface of FMI 2.0 or 3.0. A hostile host in C (`host.c`) makes calls in any
//! order; random bytes choose the calls and their arguments.

// This module has one call of a C function.
#![allow(unsafe_code)]

use std::ffi::{CString, c_char};

use runtime::Model;
use runtime::table::Layout;

use crate::sizes;

#[repr(C)]
struct HostFmu {
    guid: *const c_char,
    token: *const c_char,
    sizes: [usize; 5],
}

unsafe extern "C" {
    /// Runs the hostile host in `host.c`. The strings with GUID and token in `fmu` must end with
    /// NUL, and `data` must have `size` bytes.
    fn host_run(fmu: *const HostFmu, data: *const u8, size: usize);
}

/// Runs the hostile host of `host.c`, whose calls `data` chooses, against the FMU with which this
/// program is linked. It must be the FMU of the model `M`.
pub fn run<M: Model>(data: &[u8]) {
    let c_string = |text: &str| CString::new(text).expect("a GUID has no NUL");
    // Inputs for FMI 3.0 have an odd first byte; every fourth of them is for the FMU with arrays.
    let with_arrays = data.first().is_some_and(|first| first % 8 == 7);
    let layout = if with_arrays { Layout::Arrays } else { Layout::Scalars };
    let (guid, token) = (c_string(M::table().guid()), c_string(M::table().token(layout)));
    let fmu = HostFmu { guid: guid.as_ptr(), token: token.as_ptr(), sizes: sizes::<M>(layout) };
    unsafe { host_run(&fmu, data.as_ptr(), data.len()) }
}
