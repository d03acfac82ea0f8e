//! Fuzzing of the C interface of FMI 2.0 or 3.0. A hostile host in C (`host.c`) makes calls in any order; random bytes
//! determine the calls and their arguments.

// This module calls one C function, which is unsafe.
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
    /// Runs the host in `host.c`, which makes wrong calls. The strings of GUID and token in `fmu` must end with NUL, and
    /// `data` must have `size` bytes.
    fn host_run(fmu: *const HostFmu, data: *const u8, size: usize);
}

/// Runs the host in `host.c`, which makes wrong calls, with the FMU that is linked into this program. `data` determines the
/// calls, and `M` must be the model of this FMU.
pub fn run<M: Model>(data: &[u8]) {
    let c_string = |text: &str| CString::new(text).expect("a GUID has no NUL");
    // The first byte of an input for FMI 3.0 is odd; every fourth of these inputs is for the FMU with arrays.
    let with_arrays = data.first().is_some_and(|first| first % 8 == 7);
    let layout = if with_arrays { Layout::Arrays } else { Layout::Scalars };
    let (guid, token) = (c_string(M::table().guid()), c_string(M::table().token(layout)));
    let fmu = HostFmu { guid: guid.as_ptr(), token: token.as_ptr(), sizes: sizes::<M>(layout) };
    unsafe { host_run(&fmu, data.as_ptr(), data.len()) }
}
