//! Compiles the host's C code. The logger that a host passes to an FMU is variadic, which stable Rust cannot define.
//! Floating-point control, locale and signals, which an FMU shares with its host, are read in C.

fn main() {
    println!("cargo::rerun-if-changed=src/logger.c");
    println!("cargo::rerun-if-changed=src/host_state.c");
    cc::Build::new().file("src/logger.c").file("src/host_state.c").compile("hubslosh_host");
}
