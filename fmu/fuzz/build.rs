//! Compiles the hostile host for the fuzzer, with the official headers of FMI 2.0 and 3.0. `.ci/fuzz` provides the headers.

const SOURCES: [&str; 3] = ["host.c", "calls2.c", "calls3.c"];

fn main() {
    for file in SOURCES.iter().chain(&["host.h", "choices.h"]) {
        println!("cargo::rerun-if-changed={file}");
    }
    println!("cargo::rerun-if-env-changed=FMI_HEADERS");
    if std::env::var_os("CARGO_FEATURE_LIBFUZZER").is_none() {
        return;
    }
    let Some(headers) = std::env::var_os("FMI_HEADERS") else {
        panic!(
            "FMI_HEADERS must name the folder of fmi2Functions.h and fmi3Functions.h; .ci/fuzz sets it"
        );
    };
    cc::Build::new().files(SOURCES).include(headers).std("c11").warnings(true).compile("host");
}
