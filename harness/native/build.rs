//! Tells the linker on macOS that Python's own functions may stay undefined, because the Python that loads the library provides
//! them, and which name the library has. Without this name it would contain a folder of the machine that builds it.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "macos") {
        println!("cargo::rustc-cdylib-link-arg=-Wl,-undefined,dynamic_lookup");
        println!("cargo::rustc-cdylib-link-arg=-Wl,-install_name,@rpath/hubslosh_native.dylib");
    }
}
