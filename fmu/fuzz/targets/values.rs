//! Parameters, inputs and step sizes: see [`hubslosh_fuzz::values`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| hubslosh_fuzz::values::run(data));
