//! The platforms for which FMUs and the command are built, and the tools that each build needs.
//!
//! Rust's compiler generates code for all platforms. Each target also needs Rust's standard library and a linker, which
//! `harness/platforms/setup` installs into `target/tools` on a Debian machine.

use std::collections::BTreeMap;
use std::env;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use host::binary::{self, Binary};
use host::fmi2::Fmu;

use crate::archive;
use crate::models::Model;
use crate::project;

/// A platform for which binaries of FMUs are built.
///
/// - `folder`: folder for this platform in `binaries/` of an FMU 2.0 (FMI 2.0.5, section 2.3).
/// - `targets`: targets of Rust's compiler for this platform. If there are several, their binaries
///   are joined into a universal binary.
#[derive(Debug)]
pub struct Platform {
    pub folder: &'static str,
    pub ending: &'static str,
    pub targets: &'static [Target],
    tools: &'static [Tool],
    cargo: Cargo,
    link: &'static [&'static str],
}

#[derive(Debug)]
pub struct Target {
    pub triple: &'static str,
    suffix: &'static str,
    pub architecture: &'static str,
}

#[derive(Clone, Copy, Debug)]
enum Cargo {
    Plain,
    Zig,
}

#[derive(Debug)]
struct Tool {
    program: &'static str,
    get: &'static str,
}

const CARGO_ZIGBUILD: Tool = Tool {
    program: "cargo-zigbuild",
    get: "cargo install --locked --version 0.24.1 cargo-zigbuild",
};
const ZIG: Tool = Tool {
    program: "zig",
    get: "Python package ziglang 0.17.1 (its `zig` must be on PATH), or zig itself",
};
const MINGW: Tool = Tool {
    program: "x86_64-w64-mingw32-gcc",
    get: "Debian package gcc-mingw-w64-x86-64-win32, or MinGW-w64",
};

pub const PLATFORMS: [Platform; 4] = [
    Platform {
        // FMI 2.0 itself has names only for x86; for other processors it uses the platform tuples of FMI 3.0.
        folder: "aarch64-linux",
        ending: ".so",
        targets: &[Target {
            triple: "aarch64-unknown-linux-gnu",
            suffix: ".2.17",
            architecture: "arm64",
        }],
        tools: &[CARGO_ZIGBUILD, ZIG],
        cargo: Cargo::Zig,
        link: &[],
    },
    Platform {
        folder: "darwin64",
        ending: ".dylib",
        targets: &[
            Target { triple: "x86_64-apple-darwin", suffix: "", architecture: "x86_64" },
            Target { triple: "aarch64-apple-darwin", suffix: "", architecture: "arm64" },
        ],
        tools: &[CARGO_ZIGBUILD, ZIG],
        cargo: Cargo::Zig,
        // Without debug information (-S) the identifier that zig writes does not depend on folders of this machine.
        link: &["-Wl,-S"],
    },
    Platform {
        folder: "linux64",
        ending: ".so",
        targets: &[Target {
            triple: "x86_64-unknown-linux-gnu",
            suffix: ".2.17",
            architecture: "x86_64",
        }],
        tools: &[CARGO_ZIGBUILD, ZIG],
        cargo: Cargo::Zig,
        link: &[],
    },
    Platform {
        folder: "win64",
        ending: ".dll",
        targets: &[Target { triple: "x86_64-pc-windows-gnu", suffix: "", architecture: "x86_64" }],
        tools: &[MINGW],
        cargo: Cargo::Plain,
        // The time of the build is not written, so that equal sources give equal bytes.
        link: &["-Wl,--no-insert-timestamp"],
    },
];

pub fn platform(folder: &str) -> Result<&'static Platform> {
    PLATFORMS.iter().find(|platform| platform.folder == folder).with_context(|| {
        let all = PLATFORMS.each_ref().map(|platform| platform.folder);
        format!("there is no platform \"{folder}\" (allowed: {})", all.join(", "))
    })
}

pub struct Built {
    pub folder: &'static str,
    pub ending: &'static str,
    pub bytes: Vec<u8>,
    pub binary: Binary,
}

/// Builds and checks the binaries of an FMU for `platforms`.
///
/// # Errors
///
/// Before building, everything that is missing; after building, all faults of all binaries.
pub fn build(platforms: &[&Platform], model: &Model) -> Result<Vec<Built>> {
    let toolchain = Toolchain::find()?;
    toolchain.check(platforms)?;
    let mut faults = Vec::new();
    let mut all = Vec::new();
    for platform in platforms {
        eprintln!("building for {}", platform.folder);
        let parts = platform
            .targets
            .iter()
            .map(|target| toolchain.build(model, platform, target))
            .collect::<Result<Vec<_>>>()?;
        let bytes = match <[Vec<u8>; 1]>::try_from(parts) {
            Ok([only]) => only,
            Err(parts) => binary::join(&parts)?,
        };
        let binary = Binary::read(&bytes).with_context(|| platform.folder)?;
        let wanted = [Fmu::symbols(), Fmu::step_symbols(), Fmu::exchange_symbols()].concat();
        faults.extend(toolchain.faults(platform, &bytes, binary.faults(&wanted)));
        all.push(Built { folder: platform.folder, ending: platform.ending, bytes, binary });
    }
    refuse(&faults)?;
    Ok(all)
}

pub fn refuse(faults: &[String]) -> Result<()> {
    if !faults.is_empty() {
        bail!("the binaries would not work everywhere, so nothing was packed:{}", faults.concat());
    }
    Ok(())
}

pub struct Toolchain {
    root: PathBuf,
    path: OsString,
    sysroot: PathBuf,
    /// Path of the source of Rust's standard library. For targets whose compiled library is not
    /// installed, the library is compiled from this source.
    source: Option<PathBuf>,
    home: String,
}

impl Toolchain {
    pub fn find() -> Result<Self> {
        let root = project::root();
        let tools = root.join("target").join("tools");
        let mut folders = vec![tools.join("bin")];
        folders.extend(env::split_paths(&env::var_os("PATH").unwrap_or_default()));
        let rustc = |arguments: &[&str]| -> Result<String> {
            let said = Command::new(env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()))
                .current_dir(&root)
                .args(arguments)
                .output()
                .context("rustc cannot be run; building the FMU needs Rust")?;
            Ok(String::from_utf8_lossy(&said.stdout).trim().into())
        };
        let sysroot = PathBuf::from(rustc(&["--print", "sysroot"])?);
        // the output is "rustc 1.95.0 (…)"; only the standard library of this version can be
        // compiled with this compiler
        let version = rustc(&["--version"])?;
        let version = version.split_whitespace().nth(1).unwrap_or_default();
        let source = [
            tools.join(format!("rust-{version}")).join("library"),
            sysroot.join("lib/rustlib/src/rust/library"),
        ]
        .into_iter()
        .find(|folder| folder.join("std").is_dir());
        let home = env::var_os("CARGO_HOME")
            .map(PathBuf::from)
            .or_else(|| env::home_dir().map(|home| home.join(".cargo")));
        Ok(Toolchain {
            root,
            path: env::join_paths(folders)
                .context("a folder on PATH has a name that contains the separator of PATH")?,
            sysroot,
            source,
            home: home.unwrap_or_default().to_string_lossy().into_owned(),
        })
    }

    /// Builds the binary of an FMU for `target`, and returns its bytes.
    pub fn build(&self, model: &Model, platform: &Platform, target: &Target) -> Result<Vec<u8>> {
        let mut command = self.command("rustc", &[], platform, target);
        project::arguments(&mut command, model.package);
        let mut link: Vec<_> = platform.link.iter().map(|&argument| argument.to_string()).collect();
        if platform.folder == "darwin64" {
            // Hosts load the library by its path. Its install name must not contain a folder of this machine.
            link.push(format!("-Wl,-install_name,@rpath/{}{}", model.name, platform.ending));
        }
        command.args(link.iter().map(|argument| format!("-Clink-arg={argument}")));
        let path = project::cargo_build(command, false)
            .and_then(project::last)
            .with_context(|| format!("{} ({})", platform.folder, target.triple))?;
        archive::read(&path)
    }

    /// Builds the library of the Python package and the command `hubslosh` for `target`, and returns
    /// the bytes of both in this order.
    pub fn build_harness(&self, platform: &Platform, target: &Target) -> Result<[Vec<u8>; 2]> {
        let mut link: Vec<_> = platform.link.iter().map(|&argument| argument.to_string()).collect();
        if platform.folder == "darwin64" {
            // Zig includes only the C library of macOS; this folder has the names of the other libraries.
            link.push(format!("-F{}", self.root.join("harness/platforms/macos").display()));
        }
        let flags: Vec<_> = link.iter().map(|argument| format!("-Clink-arg={argument}")).collect();
        let mut command = self.command("build", &flags, platform, target);
        project::harness_arguments(&mut command)?;
        // With link-time optimisation, as for an FMU, the command is a quarter smaller.
        command.env("CARGO_PROFILE_RELEASE_LTO", "fat");
        command.env("CARGO_PROFILE_RELEASE_CODEGEN_UNITS", "1");
        let place = || format!("{} ({})", platform.folder, target.triple);
        let built = project::cargo_build(command, false).with_context(place)?;
        let read = |wanted: &str| {
            let found = built.iter().find(|(name, _)| name.replace('-', "_") == wanted);
            let (_, path) = found.with_context(|| format!("cargo built no {wanted}"))?;
            archive::read(path)
        };
        Ok([read("hubslosh_native").with_context(place)?, read("hubslosh").with_context(place)?])
    }

    /// Lists the faults of a binary as parts of sentences: the faults `found` by the caller, and
    /// paths of this machine that the bytes contain. A distributed binary must not contain such
    /// paths.
    pub fn faults(&self, platform: &Platform, bytes: &[u8], found: Vec<String>) -> Vec<String> {
        let private = self.private().into_iter();
        let named = private
            .filter(|folder| bytes.windows(folder.len()).any(|w| w == folder.as_bytes()))
            .map(|folder| format!("it contains the path {folder} of this machine"));
        let all = found.into_iter().chain(named);
        all.map(|fault| format!("\n  {}: {fault}", platform.folder)).collect()
    }

    fn private(&self) -> Vec<String> {
        let folders = [self.root.to_string_lossy().into_owned(), self.home.clone()];
        folders.into_iter().filter(|folder| folder.len() > 1).collect()
    }

    fn has_program(&self, program: &str) -> bool {
        let name = format!("{program}{}", env::consts::EXE_SUFFIX);
        env::split_paths(&self.path).any(|folder| folder.join(&name).is_file())
    }

    fn has_standard_library(&self, triple: &str) -> bool {
        let folder = self.sysroot.join("lib/rustlib").join(triple).join("lib");
        let named = |entry: std::io::Result<std::fs::DirEntry>| {
            entry.is_ok_and(|e| e.file_name().to_string_lossy().starts_with("libstd-"))
        };
        folder.read_dir().is_ok_and(|mut entries| entries.any(named))
    }

    /// Checks that all tools for these platforms are installed.
    ///
    /// # Errors
    ///
    /// All missing tools with the platforms that need them, and how to install them.
    pub fn check(&self, platforms: &[&Platform]) -> Result<()> {
        let mut missing: BTreeMap<String, Vec<&str>> = BTreeMap::new();
        for platform in platforms {
            for tool in platform.tools.iter().filter(|tool| !self.has_program(tool.program)) {
                let line = format!("{}: {}", tool.program, tool.get);
                missing.entry(line).or_default().push(platform.folder);
            }
            for Target { triple, .. } in platform.targets {
                if !self.has_standard_library(triple) && self.source.is_none() {
                    let line =
                        format!("Rust's standard library for {triple}: rustup target add {triple}");
                    missing.entry(line).or_default().push(platform.folder);
                }
            }
        }
        if missing.is_empty() {
            return Ok(());
        }
        let lines: Vec<_> = missing
            .iter()
            .map(|(line, folders)| format!("\n  {line} ({})", folders.join(", ")))
            .collect();
        bail!(
            "not all platforms can be built here, so nothing was packed; missing:{}\n\
             On Debian, harness/platforms/setup installs all of them.",
            lines.concat()
        )
    }

    /// Returns a call of Cargo's subcommand `what` for `target`. The compiler gets `flags` for every crate.
    fn command(
        &self,
        what: &str,
        flags: &[String],
        platform: &Platform,
        target: &Target,
    ) -> Command {
        let mut command = match platform.cargo {
            Cargo::Plain => project::cargo(),
            Cargo::Zig => Command::new("cargo-zigbuild"),
        };
        command.env("PATH", &self.path);
        command.args([what, "--locked", "--target"]);
        command.arg(format!("{}{}", target.triple, target.suffix));
        // Paths of this machine are replaced, so that equal sources give equal bytes on every machine.
        let registry = Path::new(&self.home).join("registry").join("src");
        let mut flags = flags.to_vec();
        flags.push(format!("--remap-path-prefix={}=.", self.root.display()));
        flags.push(format!("--remap-path-prefix={}=crates", registry.display()));
        if !self.has_standard_library(target.triple)
            && let Some(source) = &self.source
        {
            // Building the standard library is an unstable feature of Cargo, which these two variables enable.
            command.env("RUSTC_BOOTSTRAP", "1").env("__CARGO_TESTS_ONLY_SRC_ROOT", source);
            command.arg("-Zbuild-std=std,panic_unwind");
            flags.push(format!("--remap-path-prefix={}=library", source.display()));
        }
        command.env("CARGO_ENCODED_RUSTFLAGS", flags.join("\x1f"));
        command.env("MACOSX_DEPLOYMENT_TARGET", binary::MACOS.to_string());
        command.env("SOURCE_DATE_EPOCH", "0");
        command.env("CARGO_TARGET_X86_64_PC_WINDOWS_GNU_LINKER", MINGW.program);
        command
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fmi::Fmi;

    /// A binary for which no folder is known would be left out of the archive without an error.
    #[test]
    fn every_platform_has_its_folder_in_an_fmu() {
        for platform in &PLATFORMS {
            assert_eq!(Fmi::V2.folders(platform.folder), [platform.folder]);
        }
        for platform in &PLATFORMS {
            assert!(!Fmi::V3.folders(platform.folder).is_empty(), "{}", platform.folder);
        }
    }
}
