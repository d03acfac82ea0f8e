//! Bytes of saved states, damaged: see [`hubslosh_fuzz::states`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| hubslosh_fuzz::states::run(data));
