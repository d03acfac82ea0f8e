//! Compiles the hostile host for the fuzzer, with the official headers of FMI 2.0, which
//! `.ci/fuzz` finds.

fn main() {
    println!("cargo::rerun-if-changed=host.c");
    println!("cargo::rerun-if-changed=host.h");
    println!("cargo::rerun-if-env-changed=FMI2_HEADERS");
    if std::env::var_os("CARGO_FEATURE_LIBFUZZER").is_none() {
        return;
    }
    let Some(headers) = std::env::var_os("FMI2_HEADERS") else {
        panic!("FMI2_HEADERS must name the folder of fmi2Functions.h; .ci/fuzz sets it");
    };
    cc::Build::new().file("host.c").include(headers).std("c11").warnings(true).compile("host");
}
