//! Reads from the file of an FMU's binary, for any platform, what it requires and which functions it exports.
//!
//! FMUs are loaded by programs that their author has never seen, for example MATLAB on an old Linux cluster or on Windows
//! without development tools. If a library or a symbol version is missing there, the FMU cannot be loaded at all.

use std::fmt;

use anyhow::{Context, Result, bail};
use object::macho;
use object::read::elf::{Dyn as _, ElfFile64};
use object::read::macho::{FatArch as _, LoadCommandVariant, MachOFatFile32, MachOFile64};
use object::read::pe::PeFile64;
use object::{Architecture, Endianness, FileKind, LittleEndian, Object, elf};
use sha2::{Digest, Sha256};

use crate::symbol::readable;

/// Newest version of glibc that a binary may need. It is the version of CentOS 7, the oldest Linux
/// on which simulation tools still run.
pub const GLIBC: Version = Version(2, 17);
/// Newest version of macOS that a binary may need. Version 11 is the oldest that runs on both
/// architectures, x86_64 and arm64.
pub const MACOS: Version = Version(11, 0);

const NAMED: usize = 8;

const LINUX_LIBRARIES: [&str; 8] = [
    "ld-linux-aarch64.so.1",
    "ld-linux-x86-64.so.2",
    "libc.so.6",
    "libdl.so.2",
    "libm.so.6",
    "libpthread.so.0",
    "librt.so.1",
    "libutil.so.1",
];
/// Libraries of Windows that a binary may need, in lower case. All of them come with Windows 8 and
/// later, whereas run-time libraries of compilers do not, so that a binary that needs such a
/// library fails on other machines.
const WINDOWS_LIBRARIES: [&str; 12] = [
    "advapi32.dll",
    "api-ms-win-core-synch-l1-2-0.dll",
    "bcrypt.dll",
    "bcryptprimitives.dll",
    "kernel32.dll",
    "msvcrt.dll",
    "ntdll.dll",
    "ole32.dll",
    "shell32.dll",
    "user32.dll",
    "userenv.dll",
    "ws2_32.dll",
];
const MACOS_LIBRARIES: [&str; 5] = [
    "/System/Library/Frameworks/CoreFoundation.framework/Versions/A/CoreFoundation",
    "/usr/lib/libSystem.B.dylib",
    "/usr/lib/libc++.1.dylib",
    "/usr/lib/libcharset.1.dylib", // libiconv's, which exports it again
    "/usr/lib/libiconv.2.dylib",
];

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version(pub u32, pub u32);

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}.{}", self.0, self.1)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Linux,
    LinuxArm,
    Windows,
    MacOs,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Kind::Linux => "Linux on x86-64",
            Kind::LinuxArm => "Linux on 64-bit ARM",
            Kind::Windows => "Windows",
            Kind::MacOs => "macOS",
        })
    }
}

/// Properties of a binary that decide if a host can load it.
///
/// - `needs`: newest version of glibc (Linux) or macOS that the binary needs.
/// - `signature`: fault in the code signature, as part of a sentence. Without a valid signature
///   macOS kills a process that loads code for arm64.
#[derive(Clone, Debug)]
pub struct Binary {
    pub kind: Kind,
    pub size: usize,
    pub architectures: Vec<&'static str>,
    pub libraries: Vec<String>,
    pub search_paths: Vec<String>,
    pub needs: Option<Version>,
    pub exports: Vec<String>,
    pub signature: Option<String>,
}

impl Binary {
    pub fn read(bytes: &[u8]) -> Result<Self> {
        let kind =
            FileKind::parse(bytes).context("the file is not a binary of any known platform")?;
        let mut binary = match kind {
            FileKind::Elf64 => linux(bytes),
            FileKind::Pe64 => windows(bytes),
            FileKind::MachO64 => macos(bytes),
            FileKind::MachOFat32 => universal(bytes),
            other => bail!(
                "the file is {other:?} (allowed: a 64-bit binary for Linux, Windows or macOS)"
            ),
        }
        .with_context(|| format!("a damaged binary ({kind:?})"))?;
        binary.size = bytes.len();
        for list in [&mut binary.libraries, &mut binary.exports] {
            list.sort();
            list.dedup();
        }
        Ok(binary)
    }

    /// Lists all reasons why the binary could not be loaded on a machine without development tools,
    /// or why a host would not find the functions with the names `wanted`. Each item is a sentence
    /// without a full stop.
    pub fn faults(&self, wanted: &[&str]) -> Vec<String> {
        let (loading, lacking) = (self.loading_faults(), self.missing_exports(wanted));
        loading.into_iter().chain(lacking).chain(self.surplus()).collect()
    }

    /// Lists the reasons why the binary could not be loaded on machines without development tools.
    /// A macOS binary must contain code for both processors, x86_64 and arm64; other binaries
    /// contain code for one processor.
    pub fn loading_faults(&self) -> Vec<String> {
        self.loading_faults_for(match self.kind {
            Kind::Linux | Kind::Windows => &["x86_64"],
            Kind::LinuxArm => &["arm64"],
            Kind::MacOs => &["x86_64", "arm64"],
        })
    }

    pub fn loading_faults_for(&self, architectures: &[&str]) -> Vec<String> {
        let mut faults = Vec::new();
        let (libraries, newest): (&[&str], _) = match self.kind {
            Kind::Linux | Kind::LinuxArm => (&LINUX_LIBRARIES, Some(("glibc", GLIBC))),
            Kind::Windows => (&WINDOWS_LIBRARIES, None),
            Kind::MacOs => (&MACOS_LIBRARIES, Some(("macOS", MACOS))),
        };
        for architecture in architectures.iter().filter(|a| !self.architectures.contains(a)) {
            faults.push(format!("it has no code for {architecture}"));
        }
        for library in &self.libraries {
            let name = if self.kind == Kind::Windows { &library.to_lowercase() } else { library };
            if !libraries.contains(&name.as_str()) {
                faults.push(format!("it needs {library}, which is not guaranteed on every system"));
            }
        }
        if let (Some((system, newest)), Some(needed)) = (newest, self.needs)
            && needed > newest
        {
            faults.push(format!("it needs {system} {needed} (allowed: at most {newest})"));
        }
        for path in &self.search_paths {
            faults.push(format!("it makes the loader search {path} for libraries"));
        }
        if let Some(fault) = &self.signature {
            faults.push(format!("macOS would not load its part for arm64: {fault}"));
        }
        faults
    }

    /// Returns a sentence with the functions of `wanted` that the binary does not export, or `None` if it exports all.
    pub fn missing_exports(&self, wanted: &[&str]) -> Option<String> {
        let lacking: Vec<_> =
            wanted.iter().filter(|w| !self.exports.iter().any(|e| e == **w)).copied().collect();
        (!lacking.is_empty()).then(|| format!("it does not export {}", lacking.join(", ")))
    }

    /// Returns a sentence that names exported functions that do not belong to FMI, or `None` if
    /// there are none. Such functions could replace functions with equal names in the host.
    pub fn surplus(&self) -> Option<String> {
        // On macOS further exports are allowed: they do no harm, because a name is bound to the library from which it comes,
        // and the linker for macOS exports some of Rust's names when it runs on other systems. One library may serve several
        // versions of FMI (FMI 3.0.2, section 2.5).
        let own = |name: &&str| name.starts_with("fmi2") || name.starts_with("fmi3");
        let others = || self.exports.iter().map(String::as_str).filter(|name| !own(name));
        let count = others().count();
        let mut named: Vec<String> = others().filter_map(readable).collect();
        named.dedup();
        named.truncate(NAMED);
        (self.kind != Kind::MacOs && count > 0).then(|| match (named.len(), count) {
            (0, _) => {
                format!("it also exports {count} mangled symbols (allowed: functions of FMI)")
            }
            (some, all) if some == all => {
                format!("it also exports {} (allowed: functions of FMI)", named.join(", "))
            }
            _ => format!(
                "it also exports {count} symbols, among them {} (allowed: functions of FMI)",
                named.join(", ")
            ),
        })
    }
}

impl fmt::Display for Binary {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} bytes, {}", self.size, self.architectures.join(" + "))?;
        if let Some(needs) = self.needs {
            let system = if self.kind == Kind::MacOs { "macOS" } else { "glibc" };
            write!(f, ", {system} {needs}")?;
        }
        let functions = self.exports.iter().filter(|e| e.starts_with("fmi2")).count();
        write!(f, ", {functions} functions, needs {}", self.libraries.join(", "))
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn architecture(architecture: Architecture) -> &'static str {
    match architecture {
        Architecture::X86_64 => "x86_64",
        Architecture::Aarch64 => "arm64",
        _ => "another architecture",
    }
}

fn common<'data>(kind: Kind, file: &impl Object<'data>) -> Result<Binary> {
    Ok(Binary {
        kind,
        size: 0,
        architectures: vec![architecture(file.architecture())],
        libraries: Vec::new(),
        search_paths: Vec::new(),
        needs: None,
        exports: file.exports()?.iter().map(|export| text(export.name())).collect(),
        signature: None,
    })
}

fn linux(bytes: &[u8]) -> Result<Binary> {
    let file = ElfFile64::<Endianness>::parse(bytes)?;
    let endian = file.endian();
    let sections = file.elf_section_table();
    let kind = match file.architecture() {
        Architecture::Aarch64 => Kind::LinuxArm,
        _ => Kind::Linux,
    };
    let mut binary = common(kind, &file)?;
    if let Some((dynamic, link)) = sections.dynamic(endian, bytes)? {
        let strings = sections.strings(endian, bytes, link)?;
        for entry in dynamic {
            match entry.tag(endian) {
                elf::DT_NEEDED => binary.libraries.push(text(entry.string(endian, strings)?)),
                elf::DT_RPATH | elf::DT_RUNPATH => {
                    binary.search_paths.push(text(entry.string(endian, strings)?));
                }
                _ => {}
            }
        }
    }
    if let Some((mut files, link)) = sections.gnu_verneed(endian, bytes)? {
        let strings = sections.strings(endian, bytes, link)?;
        while let Some((_, mut versions)) = files.next()? {
            while let Some(version) = versions.next()? {
                let name = text(version.name(endian, strings)?);
                binary.needs = binary.needs.max(glibc_version(&name));
            }
        }
    }
    Ok(binary)
}

fn glibc_version(name: &str) -> Option<Version> {
    let mut numbers = name.strip_prefix("GLIBC_")?.split('.').map(str::parse);
    Some(Version(numbers.next()?.ok()?, numbers.next()?.ok()?))
}

fn windows(bytes: &[u8]) -> Result<Binary> {
    let file = PeFile64::parse(bytes)?;
    let mut binary = common(Kind::Windows, &file)?;
    if let Some(table) = file.import_table()? {
        let mut descriptors = table.descriptors()?;
        while let Some(descriptor) = descriptors.next()? {
            binary.libraries.push(text(table.name(descriptor.name.get(LittleEndian))?));
        }
    }
    Ok(binary)
}

fn macos(bytes: &[u8]) -> Result<Binary> {
    let file = MachOFile64::<Endianness>::parse(bytes)?;
    let endian = file.endian();
    let mut binary = common(Kind::MacOs, &file)?;
    for name in &mut binary.exports {
        // On macOS the names of C functions begin with an underscore.
        if let Some(plain) = name.strip_prefix('_') {
            *name = plain.into();
        }
    }
    let mut signature = None;
    let mut commands = file.macho_load_commands()?;
    while let Some(command) = commands.next()? {
        match command.variant()? {
            LoadCommandVariant::Dylib(library) => {
                binary.libraries.push(text(command.string(endian, library.dylib.name)?));
            }
            LoadCommandVariant::Rpath(path) => {
                binary.search_paths.push(text(command.string(endian, path.path)?));
            }
            LoadCommandVariant::BuildVersion(version) => {
                // version in the form xxxx.yy.zz
                let oldest = version.minos.get(endian);
                binary.needs = Some(Version(oldest >> 16, (oldest >> 8) & 0xff));
            }
            LoadCommandVariant::LinkeditData(data) if command.cmd() == macho::LC_CODE_SIGNATURE => {
                let start = data.dataoff.get(endian) as usize;
                signature = bytes.get(start..start + data.datasize.get(endian) as usize);
            }
            _ => {}
        }
    }
    if binary.architectures == ["arm64"] {
        binary.signature = match signature {
            None => Some("it is not signed".into()),
            Some(signature) => signature_fault(bytes, signature),
        };
    }
    Ok(binary)
}

fn universal(bytes: &[u8]) -> Result<Binary> {
    let mut whole: Option<Binary> = None;
    for part in MachOFatFile32::parse(bytes)?.arches() {
        let part = macos(part.data(bytes)?)?;
        let Some(whole) = &mut whole else {
            whole = Some(part);
            continue;
        };
        whole.exports.retain(|export| part.exports.contains(export));
        whole.architectures.extend(part.architectures);
        whole.libraries.extend(part.libraries);
        whole.search_paths.extend(part.search_paths);
        whole.needs = whole.needs.max(part.needs);
        whole.signature = whole.signature.take().or(part.signature);
    }
    whole.context("the binary contains no machine code")
}

/// Compares the hashes in the code signature of a macOS binary with the hashes of the code in
/// `bytes`. Returns the fault if they differ, otherwise `None`. macOS kills a process that loads a
/// binary that was changed after it was signed, for example by `strip`.
fn signature_fault(bytes: &[u8], signature: &[u8]) -> Option<String> {
    const SIGNATURE: u32 = 0xfade_0cc0; // CSMAGIC_EMBEDDED_SIGNATURE
    const DIRECTORY: u32 = 0xfade_0c02; // CSMAGIC_CODEDIRECTORY
    const SHA256: u8 = 2; // CS_HASHTYPE_SHA256
    let number = |at: usize| {
        let four = signature.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_be_bytes(four) as usize)
    };
    let wrong_pages = || {
        let is = |at, magic: u32| number(at) == Some(magic as usize);
        if !is(0, SIGNATURE) {
            return None;
        }
        // the signature has a magic number, a length and a count, followed by the type and the offset of each blob
        let directory =
            (0..number(8)?).filter_map(|i| number(16 + 8 * i)).find(|at| is(*at, DIRECTORY))?;
        let hashes = directory + number(directory + 16)?;
        let (slots, end) = (number(directory + 28)?, number(directory + 32)?);
        let kind = signature.get(directory + 36..directory + 40)?;
        if kind[..2] != [32, SHA256] || kind[3] > 16 {
            return None;
        }
        let pages: Vec<_> = bytes.get(..end)?.chunks(1 << kind[3]).collect();
        let wrong = pages
            .iter()
            .enumerate()
            .filter(|(i, page)| {
                let hash = signature.get(hashes + 32 * i..hashes + 32 * (i + 1));
                hash != Some(Sha256::digest(page).as_slice())
            })
            .count();
        Some(if pages.len() == slots { wrong } else { pages.len().max(1) })
    };
    match wrong_pages() {
        None => Some("its signature cannot be read".into()),
        Some(0) => None,
        Some(wrong) => {
            Some(format!("it was changed after it was signed (pages that differ: {wrong})"))
        }
    }
}

/// Joins macOS binaries for several architectures into one universal binary, because macOS hosts
/// look in one folder for both architectures.
pub fn join(parts: &[Vec<u8>]) -> Result<Vec<u8>> {
    const ALIGNMENT: u32 = 14; // 2^14: arm64's pages are the larger ones
    let page = 1 << ALIGNMENT;
    // The head consists of a magic number, a count, and five numbers for each part, all big-endian.
    let mut head = vec![macho::FAT_MAGIC, parts.len() as u32];
    let mut body = vec![0; page];
    for part in parts {
        // In a Mach-O file the type and the subtype of the processor follow the magic number.
        let number = |at: usize| -> Option<u32> {
            Some(u32::from_le_bytes(part.get(at..at + 4)?.try_into().ok()?))
        };
        let (Some(macho::MH_MAGIC_64), Some(cpu), Some(subtype)) =
            (number(0), number(4), number(8))
        else {
            bail!("a part of the universal binary is not a Mach-O file");
        };
        body.resize(body.len().next_multiple_of(page), 0);
        head.extend([cpu, subtype, body.len() as u32, part.len() as u32, ALIGNMENT]);
        body.extend(part);
    }
    for (i, number) in head.into_iter().enumerate() {
        body[4 * i..4 * i + 4].copy_from_slice(&number.to_be_bytes());
    }
    Ok(body)
}

/// Returns the part of the universal macOS binary `bytes` for `architecture`, `x86_64` or `arm64`.
/// Any other file is returned unchanged.
pub fn part<'a>(bytes: &'a [u8], architecture: &str) -> &'a [u8] {
    let Ok(whole) = MachOFatFile32::parse(bytes) else { return bytes };
    let wanted =
        whole.arches().iter().find(|p| self::architecture(p.architecture()) == architecture);
    wanted.and_then(|part| part.data(bytes).ok()).unwrap_or(bytes)
}
