//! Any calls of the C interface with any arguments: bytes to the hostile host of `host.c`.
#![no_main]
// One call of a C function.
#![allow(unsafe_code)]

use std::ffi::{CString, c_char};

// The host, and the functions that it calls.
use HubSlosh as _;
use HubSlosh::table::TABLE;
use hubslosh_fuzz as _;
use libfuzzer_sys::fuzz_target;

unsafe extern "C" {
    /// Needs a text that ends with NUL, and as many bytes as said.
    fn host_run(guid: *const c_char, data: *const u8, size: usize);
}

fuzz_target!(|data: &[u8]| {
    let guid = CString::new(TABLE.guid()).expect("a GUID has no NUL");
    unsafe { host_run(guid.as_ptr(), data.as_ptr(), data.len()) }
});
