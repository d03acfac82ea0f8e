//! Builds the wheels of the Python package `hubslosh`, one for each platform, with the FMUs of all versions of FMI and
//! the command `hubslosh` (packaging.python.org, "Binary distribution format"). Equal files give byte-identical wheels.
//!
//! The Python code runs on every platform, but the binaries do not: the tag of a wheel states which Linux, Windows or
//! macOS they need, and is derived from the binaries. The compiled half uses only the stable ABI of Python, so that one
//! wheel serves every CPython from the version in [`ABI`] on.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use base64ct::{Base64UrlUnpadded, Encoding};
use files::output::sha256;
use host::binary::{Binary, GLIBC, Kind, MACOS, Version};
use host::fmi2::PLATFORM;
use sha2::{Digest, Sha256};

use crate::archive::{self, Files, Packed, below, read};
use crate::metadata::{self, PACKAGE, VERSION};
use crate::platforms::{self, Platform, Target, Toolchain};
use crate::{Fmi, MODELS, build, build_native, components, files as files_of_fmu, pack, root};

const ABI: &str = "cp311-abi3";

const SBOM: &str = "sboms/hubslosh.cdx.json";

struct Binaries {
    folder: &'static str,
    fmus: Files,
    native: (&'static str, Vec<u8>),
    command: Option<(String, Vec<u8>)>,
    read: Vec<Binary>,
}

/// Builds every FMU of this project, and the wheel that contains the FMUs, for the platform of this
/// machine. Returns the path of the wheel in `folder`.
///
/// # Errors
///
/// If a file cannot be built, read or written.
pub fn write(folder: &Path) -> Result<PathBuf> {
    check_folder(folder)?;
    write_one(folder, native()?)
}

/// Builds wheels for other platforms, one for each processor, and returns their paths in `folder`.
///
/// # Errors
///
/// If a file cannot be built, read or written, or a binary would not run on every machine of its
/// platform. In this case no wheel is written.
pub fn write_for(platforms: &[&Platform], folder: &Path) -> Result<Vec<PathBuf>> {
    check_folder(folder)?;
    cross_build(platforms)?.into_iter().map(|binaries| write_one(folder, binaries)).collect()
}

fn check_folder(folder: &Path) -> Result<()> {
    ensure!(
        folder.extension().is_none_or(|ending| ending != "whl"),
        "{} is the name of a file; a folder is expected, because pip reads package, version and platform from the \
         name of the wheel, which must not be changed",
        folder.display()
    );
    Ok(())
}

/// Writes a wheel for tests, which has the FMUs `fmus` but not the command, to the folder of the
/// first FMU. Returns the path of the wheel.
///
/// # Panics
///
/// If it cannot be built.
pub fn for_tests(fmus: &[&Path]) -> PathBuf {
    let make = || {
        let library = read(&build_native(true)?)?;
        let named = |fmu: &&Path| Ok((file_name(fmu), read(fmu)?));
        let fmus_in = fmus.iter().map(named).collect::<Result<_>>()?;
        let read = vec![Binary::read(&library)?];
        let native = (native_name(std::env::consts::DLL_SUFFIX), library);
        let binaries = Binaries { folder: PLATFORM, fmus: fmus_in, native, command: None, read };
        let folder = fmus[0].parent().context("the path of the FMU has no folder")?;
        write_one(folder, binaries)
    };
    make().unwrap_or_else(|error| panic!("the wheel for the tests could not be packed: {error:#}"))
}

fn native() -> Result<Binaries> {
    let made = tempfile::tempdir().context("no temporary folder can be made")?;
    let mut fmus = Files::new();
    let mut all = Vec::new();
    for model in MODELS {
        for fmi in Fmi::ALL {
            let fmu = fmi.path(made.path(), model.name);
            pack(&model, fmi, &fmu)?;
            fmus.push((file_name(&fmu), read(&fmu)?));
        }
        all.push(Binary::read(&read(&build(model.package, true)?)?)?);
    }
    let library = read(&build_native(true)?)?;
    let command =
        read(&std::env::current_exe().context("the path of this program cannot be found")?)?;
    all.push(Binary::read(&library)?);
    all.push(Binary::read(&command)?);
    Ok(Binaries {
        folder: PLATFORM,
        fmus,
        native: (native_name(std::env::consts::DLL_SUFFIX), library),
        command: Some((format!("{PACKAGE}{}", std::env::consts::EXE_SUFFIX), command)),
        read: all,
    })
}

fn cross_build(platforms: &[&Platform]) -> Result<Vec<Binaries>> {
    let toolchain = Toolchain::find()?;
    toolchain.check(platforms)?;
    let mut faults = Vec::new();
    let mut all = Vec::new();
    for platform in platforms {
        for target in platform.targets {
            eprintln!("building for {}", target.triple);
            all.push(cross_build_binaries(&toolchain, platform, target, &mut faults)?);
        }
    }
    platforms::refuse(&faults)?;
    Ok(all)
}

fn cross_build_binaries(
    toolchain: &Toolchain,
    platform: &Platform,
    target: &Target,
    faults: &mut Vec<String>,
) -> Result<Binaries> {
    let made = tempfile::tempdir().context("no temporary folder can be made")?;
    let mut read = Vec::new();
    // The wheel may need `provided`, although it is not part of every system.
    let mut check = |bytes: &[u8], provided: Option<&str>| -> Result<()> {
        let mut binary = Binary::read(bytes).context(target.triple)?;
        binary.libraries.retain(|library| Some(library.as_str()) != provided);
        let found = binary.loading_faults_for(&[target.architecture]);
        faults.extend(toolchain.faults(platform, bytes, found));
        read.push(binary);
        Ok(())
    };
    let mut fmus = Files::new();
    for model in MODELS {
        let bytes = toolchain.build(&model, platform, target)?;
        check(&bytes, None)?;
        let binary = [Packed { folder: platform.folder, ending: platform.ending, bytes }];
        for fmi in Fmi::ALL {
            let fmu = fmi.path(made.path(), model.name);
            archive::write(&files_of_fmu(&model, fmi, &binary)?, &fmu)?;
            fmus.push((file_name(&fmu), archive::read(&fmu)?));
        }
    }
    let [library, command] = toolchain.build_harness(platform, target)?;
    check(&library, Some("python3.dll"))?; // Python itself has loaded it
    check(&command, None)?;
    let ending = if platform.ending == ".dll" { ".exe" } else { "" };
    Ok(Binaries {
        folder: platform.folder,
        fmus,
        native: (native_name(platform.ending), library),
        command: Some((format!("{PACKAGE}{ending}"), command)),
        read,
    })
}

fn native_name(ending: &str) -> &'static str {
    if ending == ".dll" { "_native.pyd" } else { "_native.abi3.so" }
}

fn write_one(folder: &Path, binaries: Binaries) -> Result<PathBuf> {
    let tags = tags(&binaries.read)?;
    let out = folder.join(format!("{PACKAGE}-{VERSION}-{ABI}-{}.whl", tags.join(".")));
    archive::write(&files(binaries, &tags)?, &out)?;
    Ok(out)
}

/// Returns the tags of the platforms on which all these binaries run, which become part of the
/// wheel's name (Python packaging, "Platform compatibility tags"). For glibc 2.17 the older name of
/// the tag is added.
fn tags(binaries: &[Binary]) -> Result<Vec<String>> {
    let Some(Binary { kind, architectures, .. }) = binaries.first() else {
        bail!("a wheel without binaries has no platform")
    };
    let [architecture] = architectures[..] else {
        bail!(
            "a wheel must be for one processor type, but its binaries are for {}",
            architectures.join(", ")
        )
    };
    let needed = |oldest| binaries.iter().filter_map(|b| b.needs).fold(oldest, Version::max);
    Ok(match kind {
        Kind::Linux | Kind::LinuxArm => {
            let machine = if architecture == "arm64" { "aarch64" } else { architecture };
            let Version(major, minor) = needed(GLIBC);
            let older =
                (Version(major, minor) == GLIBC).then(|| format!("manylinux2014_{machine}"));
            [format!("manylinux_{major}_{minor}_{machine}")].into_iter().chain(older).collect()
        }
        Kind::Windows => vec!["win_amd64".into()],
        // For macOS 11 and later, only the first number of the version denotes a release.
        Kind::MacOs => vec![format!("macosx_{}_0_{architecture}", needed(MACOS).0)],
    })
}

fn files(binaries: Binaries, tags: &[String]) -> Result<Files> {
    let package = below(&root().join("harness").join("python").join(PACKAGE))?.into_iter();
    let mut files: Files = package
        .filter(|(name, _)| !name.contains("__pycache__"))
        .map(|(name, bytes)| (format!("{PACKAGE}/{name}"), bytes))
        .collect();
    for (name, bytes) in examples(&root().join("examples"))? {
        files.push((format!("{PACKAGE}/examples/{name}"), bytes));
    }
    for (name, bytes) in binaries.fmus {
        files.push((format!("{PACKAGE}/fmus/{name}"), bytes));
    }
    let native = format!("{PACKAGE}/{}", binaries.native.0);
    files.push((native.clone(), binaries.native.1));
    files.sort();

    let info = format!("{PACKAGE}-{VERSION}.dist-info");
    for license in metadata::LICENSES {
        files.push((format!("{info}/licenses/{license}"), read(&root().join(license))?));
    }
    if let Some((name, bytes)) = binaries.command {
        let command = format!("{PACKAGE}-{VERSION}.data/scripts/{name}");
        let is_binary = |name: &str| name == native || name.ends_with(".fmu");
        let binaries_in = files.iter().filter(|(name, _)| is_binary(name));
        let mut hashes: Vec<_> =
            binaries_in.map(|(name, bytes)| (name.clone(), sha256(bytes))).collect();
        hashes.insert(0, (command.clone(), sha256(&bytes)));
        let sbom = components::sbom_of_wheel(&bytes, binaries.folder, hashes)?;
        files.push((sbom_name(), sbom.into_bytes()));
        let notices = components::notices(&bytes, binaries.folder)?;
        files.push((format!("{info}/licenses/{}", metadata::NOTICES), notices.into_bytes()));
        files.insert(0, (command, bytes));
    }
    files.push((format!("{info}/METADATA"), metadata::text()?.into_bytes()));
    let mut wheel =
        format!("Wheel-Version: 1.0\nGenerator: {PACKAGE} {VERSION}\nRoot-Is-Purelib: false\n");
    for tag in tags {
        wheel += &format!("Tag: {ABI}-{tag}\n");
    }
    files.push((format!("{info}/WHEEL"), wheel.into_bytes()));
    let record = format!("{info}/RECORD");
    let list = files.iter().map(|(name, bytes)| record_line(name, bytes)).collect::<String>();
    files.push((record.clone(), format!("{list}{record},,\n").into_bytes()));
    Ok(files)
}

/// Reads the Python scripts and pages of the examples in `folder`. Tests are left out, and so are
/// pictures, which the scripts draw.
///
/// # Errors
///
/// If a file cannot be read.
pub fn examples(folder: &Path) -> Result<Files> {
    let mut files = below(folder)?;
    files.retain(|(name, _)| {
        let file = name.rsplit('/').next().unwrap_or_default();
        let is_test = file.starts_with("test_") || file == "conftest.py";
        (file.ends_with(".py") || file.ends_with(".md")) && !is_test
    });
    Ok(files)
}

pub fn sbom_name() -> String {
    format!("{PACKAGE}-{VERSION}.dist-info/{SBOM}")
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Formats the line of a file in the list of a wheel (RECORD): `name,sha256=…,size`. The hash is in
/// URL-safe base64 without padding.
fn record_line(name: &str, bytes: &[u8]) -> String {
    let hash = Base64UrlUnpadded::encode_string(&Sha256::digest(bytes));
    format!("{name},sha256={hash},{}\n", bytes.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_the_wheel_s_record_has_the_hash_in_url_safe_base64() {
        // SHA-256 of the empty text. In base64 it has `-` and `_` where plain base64 has `+` and `/`.
        assert_eq!(
            record_line("a/b.py", b""),
            "a/b.py,sha256=47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU,0\n"
        );
    }

    fn binary(kind: Kind, architecture: &'static str, needs: Option<Version>) -> Binary {
        Binary {
            kind,
            size: 0,
            architectures: vec![architecture],
            libraries: vec![],
            search_paths: vec![],
            needs,
            exports: vec![],
            signature: None,
        }
    }

    #[test]
    fn the_wheel_s_tag_names_the_newest_system_that_a_binary_needs() {
        let of = |kind, architecture, needs: &[_]| {
            let all: Vec<_> =
                needs.iter().map(|&version| binary(kind, architecture, version)).collect();
            tags(&all).unwrap().join(".")
        };
        let (old, new) = (Some(Version(2, 14)), Some(Version(2, 34)));
        assert_eq!(of(Kind::Linux, "x86_64", &[new, old]), "manylinux_2_34_x86_64");
        assert_eq!(
            of(Kind::LinuxArm, "arm64", &[old, None]),
            "manylinux_2_17_aarch64.manylinux2014_aarch64"
        );
        assert_eq!(of(Kind::Windows, "x86_64", &[None]), "win_amd64");
        assert_eq!(of(Kind::MacOs, "arm64", &[Some(Version(11, 0))]), "macosx_11_0_arm64");
        assert_eq!(of(Kind::MacOs, "x86_64", &[Some(Version(12, 3))]), "macosx_12_0_x86_64");
        assert!(tags(&[]).is_err());
    }

    #[test]
    fn pack_refuses_a_file_name_where_a_folder_for_the_wheel_is_expected() {
        let error = write(Path::new("dist/mine.whl")).unwrap_err().to_string();
        assert!(error.contains("mine.whl") && error.contains("a folder is expected"), "{error}");
    }
}
