#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| hubslosh_fuzz::run::<HubSlosh::HubSlosh>(data));
