//! Compiles the one piece of C there is: the logger a host must hand to an FMU
//! is variadic, and stable Rust cannot define a variadic function.

fn main() {
    println!("cargo::rerun-if-changed=src/logger.c");
    cc::Build::new().file("src/logger.c").compile("hubslosh_logger");
}
