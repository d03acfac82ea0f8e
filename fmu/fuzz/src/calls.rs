//! Any calls of the C interface of either version with any arguments: bytes to the hostile host of `host.c`.

// One call of a C function.
#![allow(unsafe_code)]

use std::ffi::{CString, c_char};

use runtime::Model;
use runtime::table::Layout;

use crate::sizes;

/// Same as in `host.h`.
#[repr(C)]
struct HostFmu {
    guid: *const c_char,
    token: *const c_char,
    sizes: [usize; 5],
}

unsafe extern "C" {
    /// Needs a description whose GUID and token end with NUL, and as many bytes as said.
    fn host_run(fmu: *const HostFmu, data: *const u8, size: usize);
}

/// The FMU that this program is linked with must be that of the model.
pub fn run<M: Model>(data: &[u8]) {
    let c_string = |text: &str| CString::new(text).expect("a GUID has no NUL");
    // Of the inputs for FMI 3.0, whose first byte is odd, every fourth is for the FMU with arrays.
    let with_arrays = data.first().is_some_and(|first| first % 8 == 7);
    let layout = if with_arrays { Layout::Arrays } else { Layout::Scalars };
    let (guid, token) = (c_string(M::table().guid()), c_string(M::table().token(layout)));
    let fmu = HostFmu { guid: guid.as_ptr(), token: token.as_ptr(), sizes: sizes::<M>(layout) };
    unsafe { host_run(&fmu, data.as_ptr(), data.len()) }
}
