//! Compiles the host's C code. The logger that a host passes to an FMU is variadic, which stable Rust cannot define.
//! Floating-point control, locale and signals, which an FMU shares with its host, are read in C.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=src/logger.c");
    println!("cargo::rerun-if-changed=src/host_state.c");
    let mut build = cc::Build::new();
    build.file("src/logger.c").file("src/host_state.c");
    // cc asks the compiler for its version once. If the compiler is zig, with macOS as the target, this leaves an
    // empty a.o in the current folder.
    let here = env::current_dir().expect("Cargo sets the current folder");
    env::set_current_dir(env::var_os("OUT_DIR").expect("Cargo sets OUT_DIR")).expect("it exists");
    build.get_compiler();
    env::set_current_dir(here).expect("it exists");
    build.compile("hubslosh_host");
}
