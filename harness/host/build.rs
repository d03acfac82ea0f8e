//! Compiles the pieces of C there are: the logger a host must hand to an FMU is variadic, and
//! stable Rust cannot define a variadic function; what an FMU shares with its host (floating-point
//! control, locale, signals) is C's to tell.

fn main() {
    println!("cargo::rerun-if-changed=src/logger.c");
    println!("cargo::rerun-if-changed=src/host_state.c");
    cc::Build::new().file("src/logger.c").file("src/host_state.c").compile("hubslosh_host");
}
