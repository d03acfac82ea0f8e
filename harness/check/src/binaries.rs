use std::collections::BTreeSet;

use super::archive::Archive;
use super::description::Description;
use super::findings::Findings;
use host::binary::{Binary, Kind};
use host::fmi2::{Fmu, PLATFORM};
use host::fmi3;
use host::xml::Element;

/// Folders under `binaries/` that only FMI 2.0 defines, and the platform tuple that replaces each in FMI 3.0.
pub const OF_FMI_2: [(&str, &str); 6] = [
    ("win32", "x86-windows"),
    ("win64", "x86_64-windows"),
    ("linux32", "x86-linux"),
    ("linux64", "x86_64-linux"),
    ("darwin32", "x86-darwin"),
    ("darwin64", "x86_64-darwin"),
];

/// Architectures in the platform tuples of FMI 3.0 (section 2.5.1.4.1), such as x86_64-linux. FMI 2.0.4 also allows these
/// tuples, except where FMI 2.0 has an older name that ends in 32 or 64, such as linux64.
const ARCHITECTURES: [&str; 8] =
    ["aarch32", "aarch64", "riscv32", "riscv64", "x86", "x86_64", "ppc32", "ppc64"];

/// File ending of the binaries in a folder, and their format if this check can read it.
type Form = (&'static str, Option<Kind>);

/// Returns the file ending of the binary in `folder` and its format, or `None` if the folder has a name that FMI 2.0 does
/// not define.
pub fn platform(folder: &str) -> Option<Form> {
    let old = OF_FMI_2.iter().find(|(old, _)| *old == folder);
    tuple(old.map_or(folder, |(_, new)| new))
}

pub(crate) fn tuple(folder: &str) -> Option<Form> {
    // the name of a folder is architecture-system or architecture-system-ABI
    let mut parts = folder.splitn(3, '-');
    let (architecture, system) = (parts.next()?, parts.next()?);
    if !ARCHITECTURES.contains(&architecture) {
        return None;
    }
    let kind = match (architecture, system) {
        ("x86_64", "linux") => Some(Kind::Linux),
        ("aarch64", "linux") => Some(Kind::LinuxArm),
        ("x86_64", "windows") => Some(Kind::Windows),
        ("x86_64" | "aarch64", "darwin") => Some(Kind::MacOs),
        _ => None,
    };
    match system {
        "windows" => Some((".dll", kind)),
        "linux" => Some((".so", kind)),
        "darwin" => Some((".dylib", kind)),
        _ => None,
    }
}

struct Declared {
    interface: String,
    identifier: String,
    wanted: Vec<&'static str>,
}

struct Placed {
    name: String,
    identifier: String,
    folder: String,
    kind: Option<Kind>,
    binary: anyhow::Result<Binary>,
}

pub struct Binaries {
    placed: Vec<Placed>,
    /// Number of binaries with the model's name in folders whose names the standard does not define (folders of vendors).
    of_vendors: usize,
    /// Libraries that no host loads, because their names differ from the name that FMI requires in their folder: path
    /// and required name.
    elsewhere: Vec<(String, String)>,
    declared: Vec<Declared>,
    has_sources: bool,
    described: bool,
    own_folder: &'static str,
}

/// Returns the interface that an element such as CoSimulation declares, with the functions that it
/// needs; `None` if the element has no modelIdentifier.
fn declare(element: &Element, is_fmi3: bool) -> Option<Declared> {
    let identifier = element.get("modelIdentifier")?.to_string();
    let wanted = match &*element.name {
        _ if is_fmi3 => fmi3::Fmu::symbols(),
        "ModelExchange" => [Fmu::symbols(), Fmu::exchange_symbols()].concat(),
        _ => [Fmu::symbols(), Fmu::step_symbols()].concat(),
    };
    Some(Declared { interface: element.name.to_string(), identifier, wanted })
}

impl Binaries {
    pub fn new(archive: &Archive, description: Option<&Description>) -> Binaries {
        let is_fmi3 = description.is_some_and(Description::is_fmi3);
        let declared = description.map(|d| d.interfaces().filter_map(|e| declare(e, is_fmi3)));
        let declared = declared.map(Iterator::collect);
        if !is_fmi3 {
            return Binaries::read(archive, declared, platform, PLATFORM);
        }
        let mut all = Binaries::read(archive, declared, tuple, fmi3::PLATFORM);
        all.has_sources = archive.below("sources/buildDescription.xml").next().is_some();
        // Static libraries have other endings, so that they do not count.
        let is_vendors = |name: &&str| {
            let folder = name.split('/').nth(1).unwrap_or_default();
            let is_old = OF_FMI_2.iter().any(|(old, _)| *old == folder);
            !is_old && (tuple(folder).is_none() || name.ends_with(".a") || name.ends_with(".lib"))
        };
        all.of_vendors = archive.below("binaries/").filter(is_vendors).count();
        all
    }

    /// Finds the binaries in an archive. `declared` are the interfaces in modelDescription.xml, or `None` if it
    /// cannot be read. `platform` returns the file ending and the format of the binaries in a folder such as `win64`;
    /// `own_folder` is the folder with the binaries for this computer.
    fn read(
        archive: &Archive,
        declared: Option<Vec<Declared>>,
        platform: fn(&str) -> Option<Form>,
        own_folder: &'static str,
    ) -> Binaries {
        let described = declared.is_some();
        let declared = declared.unwrap_or_default();
        let identifiers: BTreeSet<_> = declared.iter().map(|d| d.identifier.clone()).collect();
        let identifiers = Vec::from_iter(identifiers);
        let mut all = Binaries {
            placed: Vec::new(),
            of_vendors: 0,
            elsewhere: Vec::new(),
            declared,
            has_sources: archive.below("sources/").next().is_some(),
            described,
            own_folder,
        };
        for name in archive.below("binaries/") {
            let parts: Vec<&str> = name.split('/').collect();
            let [_, folder, file] = parts[..] else { continue };
            let Some((ending, kind)) = platform(folder) else {
                let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
                // A folder of the standard in other capitals is a mistake, not a name of a vendor.
                let is_vendors = platform(&folder.to_lowercase()).is_none();
                let is_named = identifiers.iter().any(|name| name == stem);
                all.of_vendors += usize::from(is_vendors && is_named);
                continue;
            };
            let names: Vec<String> =
                identifiers.iter().map(|identifier| format!("{identifier}{ending}")).collect();
            // File names on Windows are not case-sensitive.
            let is_file = |name: &String| match ending {
                ".dll" => name.eq_ignore_ascii_case(file),
                _ => name == file,
            };
            if let Some(n) = names.iter().position(is_file) {
                let bytes = archive.file(name).unwrap_or_default();
                let binary = Binary::read(bytes);
                let identifier = identifiers[n].clone();
                let folder = folder.to_string();
                all.placed.push(Placed { name: name.into(), identifier, folder, kind, binary });
            } else if file.ends_with(ending) {
                all.elsewhere.push((name.into(), names.join(", ")));
            }
        }
        all
    }

    pub fn own_binary(&self) -> Option<&str> {
        self.placed.iter().find(|p| p.folder == self.own_folder).map(|p| p.name.as_str())
    }

    pub fn own_folder(&self) -> &'static str {
        self.own_folder
    }

    fn readable(&self) -> impl Iterator<Item = (&str, &Binary)> {
        self.placed.iter().filter_map(|p| Some((p.name.as_str(), p.binary.as_ref().ok()?)))
    }

    /// Calls `look` for each binary that this check can parse, or skips the rule if there is none.
    fn each(&self, findings: &mut Findings, look: impl Fn(&str, &Binary, &mut Findings)) {
        if self.readable().next().is_none() {
            findings.skip("the FMU has no binary that can be parsed");
        }
        for (name, binary) in self.readable() {
            look(name, binary, findings);
        }
    }
}

pub fn present(binaries: &Binaries, findings: &mut Findings) {
    if !binaries.described {
        return findings.skip(
            "the name of the binary is not known, because modelDescription.xml cannot be read",
        );
    }
    if binaries.placed.is_empty() && binaries.of_vendors == 0 && !binaries.has_sources {
        let known = match binaries.own_folder == PLATFORM {
            true => {
                OF_FMI_2.map(|(old, _)| old).join(", ") + ", platform tuples such as aarch64-linux"
            }
            false => "platform tuples such as x86_64-linux".into(),
        };
        findings.at("binaries/").add(format!(
            "no platform has a binary of the model's name, and there are no sources (platforms: {known}, names \
             of vendors)"
        ));
    }
}

pub fn each_interface(binaries: &Binaries, findings: &mut Findings) {
    let folders: BTreeSet<&str> = binaries.placed.iter().map(|p| p.folder.as_str()).collect();
    if folders.is_empty() {
        findings.skip("no platform has a binary of the model's name");
    }
    for folder in folders {
        let ending = platform(folder).map_or("", |(ending, _)| ending);
        for Declared { interface, identifier, .. } in &binaries.declared {
            let mut here = binaries.placed.iter().filter(|p| p.folder == folder);
            if !here.any(|p| p.identifier == *identifier) {
                findings.at(format!("binaries/{folder}/{identifier}{ending}")).add(format!(
                    "the binary is missing: modelIdentifier of {interface} is \"{identifier}\" (required: \
                         a folder with the binary of one interface also has the binary of the other)"
                ));
            }
        }
    }
}

pub fn this_platform(binaries: &Binaries, findings: &mut Findings) {
    if !binaries.described {
        return findings.skip(
            "the name of the binary is not known, because modelDescription.xml cannot be read",
        );
    }
    if binaries.own_binary().is_none() {
        findings.at(format!("binaries/{}", binaries.own_folder)).add("the FMU has no binary for this platform, so that the rules that call the FMU are not checked (required: a binary for this platform, or a check on one of the FMU's platforms)");
    }
}

pub fn name(binaries: &Binaries, findings: &mut Findings) {
    // A folder may contain further libraries, but it must contain the model's binary.
    let empty = |folder: &str| !binaries.placed.iter().any(|p| p.name.starts_with(folder));
    for (name, expected) in &binaries.elsewhere {
        let folder = name.rsplit_once('/').map_or("", |(folder, _)| folder);
        if binaries.described && empty(folder) {
            findings.at(name).add(format!(
                "no host finds this binary, because its name is not the modelIdentifier with the ending of the platform (required: {expected})"
            ));
        }
    }
}

pub fn format(binaries: &Binaries, findings: &mut Findings) {
    let mut looked = false;
    for placed in &binaries.placed {
        let Some(kind) = placed.kind else { continue };
        looked = true;
        match &placed.binary {
            Err(why) => findings.at(&placed.name).add(format!("{why:#}")),
            Ok(binary) if binary.kind != kind => findings.at(&placed.name).add(format!(
                "the binary is for {} (allowed in {}: {kind})",
                binary.kind, placed.folder
            )),
            Ok(_) => {}
        }
    }
    if !looked {
        findings.skip("the FMU has no binary in a format that the check can parse");
    }
}

pub fn symbols(binaries: &Binaries, findings: &mut Findings) {
    binaries.each(findings, |name, binary, findings| {
        let of = binaries.placed.iter().find(|p| p.name == name).map(|p| p.identifier.as_str());
        let interfaces = binaries.declared.iter().filter(|d| of == Some(d.identifier.as_str()));
        let mut wanted: Vec<&str> = interfaces.flat_map(|d| d.wanted.iter().copied()).collect();
        // Functions that both interfaces need are named only once.
        let mut seen = std::collections::BTreeSet::new();
        wanted.retain(|symbol| seen.insert(*symbol));
        if let Some(fault) = binary.missing_exports(&wanted) {
            findings.at(name).add(fault);
        }
    });
}

pub fn extra_symbols(binaries: &Binaries, findings: &mut Findings) {
    binaries.each(findings, |name, binary, findings| {
        if let Some(fault) = binary.surplus() {
            findings.at(name).add(fault);
        }
    });
}

pub fn system(binaries: &Binaries, findings: &mut Findings) {
    binaries.each(findings, |name, binary, findings| {
        for fault in binary.loading_faults() {
            findings.at(name).add(fault);
        }
    });
}
