use super::description::Description;
use crate::archive::Archive;
use crate::archive::folders_of;
use crate::binaries::tuple;
use crate::findings::Findings;
use host::binary::{Binary, Kind};
use host::fmi3::{Fmu, PLATFORM};
use host::xml::Element;

/// Files and folders that FMI 3.0 allows at the top level of an FMU (2.5.1).
const AT_THE_TOP: [&str; 7] = [
    "modelDescription.xml",
    "binaries",
    "documentation",
    "extra",
    "resources",
    "sources",
    "terminalsAndIcons",
];

pub fn folders(archive: &Archive, findings: &mut Findings) {
    folders_of("3.0", &AT_THE_TOP, archive, findings);
}

fn has(archive: &Archive, name: &str) -> bool {
    archive.below(name).any(|n| n == name)
}

pub fn licenses(archive: &Archive, findings: &mut Findings) {
    const FOLDER: &str = "documentation/licenses/";
    if archive.below(FOLDER).next().is_none() {
        return findings.skip("there is no documentation/licenses");
    }
    let entries = ["license.txt", "license.html", "license.spdx"];
    if !entries.iter().any(|name| has(archive, &format!("{FOLDER}{name}"))) {
        findings
            .add(FOLDER, "no entry point (required: license.spdx, license.txt or license.html)");
    }
}

pub fn pictures(archive: &Archive, findings: &mut Findings) {
    for (drawing, picture) in [
        ("terminalsAndIcons/icon.svg", "terminalsAndIcons/icon.png"),
        ("documentation/diagram.svg", "documentation/diagram.png"),
    ] {
        if has(archive, drawing) && !has(archive, picture) {
            findings.add(drawing, format!("without {picture} (required with it)"));
        }
    }
}

pub fn terminals(archive: &Archive, findings: &mut Findings) {
    const FILE: &str = "terminalsAndIcons/terminalsAndIcons.xml";
    let Ok(bytes) = std::fs::read(archive.directory().join(FILE)) else {
        return findings.skip(format!("there is no {FILE}"));
    };
    let root = match Element::parse(&bytes) {
        Ok(root) => root,
        Err(why) => return findings.add(FILE, why.to_string()),
    };
    if root.name != "fmiTerminalsAndIcons" {
        findings.add(FILE, format!("its root is {} (allowed: fmiTerminalsAndIcons)", root.name));
    }
    let own = archive.file("modelDescription.xml").and_then(|xml| Element::parse(xml).ok());
    let own = own.and_then(|root| root.get("fmiVersion").map(String::from)).unwrap_or_default();
    let version = root.get("fmiVersion").unwrap_or_default();
    if version != own {
        findings.add(
            FILE,
            format!("fmiVersion=\"{version}\" (allowed: that of modelDescription.xml, \"{own}\")"),
        );
    }
}

pub fn layered_standards(archive: &Archive, findings: &mut Findings) {
    let manifests: Vec<&str> =
        archive.below("extra/").filter(|name| name.ends_with("/fmi-ls-manifest.xml")).collect();
    if manifests.is_empty() {
        return findings.skip("there is no manifest of a layered standard");
    }
    for name in manifests {
        let Ok(bytes) = std::fs::read(archive.directory().join(name)) else { continue };
        let root = match Element::parse(&bytes) {
            Ok(root) => root,
            Err(why) => {
                findings.add(name, why.to_string());
                continue;
            }
        };
        for attribute in ["fmi-ls-name", "fmi-ls-version", "fmi-ls-description"] {
            if root.get(attribute).is_none() {
                findings.add(name, format!("the attribute {attribute} is missing"));
            }
        }
    }
}

pub fn extra(archive: &Archive, findings: &mut Findings) {
    let mut folders: Vec<&str> =
        archive.below("extra/").filter_map(|name| name.split('/').nth(1)).collect();
    folders.sort_unstable();
    folders.dedup();
    for folder in folders.iter().filter(|f| !f.contains('.') || has(archive, &format!("extra/{f}")))
    {
        findings.add(
            format!("extra/{folder}"),
            "it is not a folder in the reverse domain notation of its maker (allowed: like org.example.data)",
        );
    }
}

// ---------------------------------------------------------------- binaries

/// Folders of FMI 2.0 under `binaries/`, and the platform tuple that replaces each.
const OF_FMI_2: [(&str, &str); 6] = [
    ("win32", "x86-windows"),
    ("win64", "x86_64-windows"),
    ("linux32", "x86-linux"),
    ("linux64", "x86_64-linux"),
    ("darwin32", "x86-darwin"),
    ("darwin64", "x86_64-darwin"),
];

/// The binaries in an archive, with the names that the description gives to them.
pub struct Binaries<'a> {
    archive: &'a Archive,
    identifiers: Vec<String>,
}

impl<'a> Binaries<'a> {
    pub fn new(archive: &'a Archive, description: Option<&Description>) -> Binaries<'a> {
        let interfaces = description.into_iter().flat_map(Description::interfaces);
        let mut identifiers: Vec<String> =
            interfaces.filter_map(|i| i.get("modelIdentifier").map(String::from)).collect();
        identifiers.sort_unstable();
        identifiers.dedup();
        Binaries { archive, identifiers }
    }

    /// Returns true if there is a binary for the platform on which this check runs.
    pub fn is_callable(&self) -> bool {
        self.placed().iter().any(|(_, folder, ..)| *folder == PLATFORM)
    }

    /// Lists the libraries in the places where hosts look for them: path, folder, and the format that the
    /// folder requires.
    fn placed(&self) -> Vec<(&'a str, &'a str, Option<Kind>)> {
        let archive: &'a Archive = self.archive;
        let found = archive.below("binaries/").filter_map(|name| {
            let mut parts = name.split('/').skip(1);
            let (folder, file) = (parts.next()?, parts.next()?);
            let (ending, kind) = tuple(folder)?;
            let identifier = file.strip_suffix(ending)?;
            let is_named = self.identifiers.iter().any(|own| own == identifier);
            (is_named && parts.next().is_none()).then_some((name, folder, kind))
        });
        found.collect()
    }
}

pub fn present(binaries: &Binaries, findings: &mut Findings) {
    let sources = binaries.archive.below("sources/buildDescription.xml").next().is_some();
    // Static libraries have other endings.
    let vendors = binaries.archive.below("binaries/").any(|name| {
        let folder = name.split('/').nth(1).unwrap_or_default();
        let is_old = OF_FMI_2.iter().any(|(old, _)| *old == folder);
        !is_old && (tuple(folder).is_none() || name.ends_with(".a") || name.ends_with(".lib"))
    });
    if binaries.placed().is_empty() && !sources && !vendors {
        findings.add(
            "binaries/",
            "no platform tuple has a library of the name modelIdentifier, and there are no sources with a \
             buildDescription.xml",
        );
    }
}

pub fn tuples(binaries: &Binaries, findings: &mut Findings) {
    let mut folders: Vec<&str> =
        binaries.archive.below("binaries/").filter_map(|name| name.split('/').nth(1)).collect();
    folders.sort_unstable();
    folders.dedup();
    for (old, new) in OF_FMI_2.iter().filter(|(old, _)| folders.contains(old)) {
        findings.add(
            format!("binaries/{old}"),
            format!("it is a folder of FMI 2.0, where no host of FMI 3.0 looks (allowed: {new})"),
        );
    }
}

pub fn name(binaries: &Binaries, findings: &mut Findings) {
    let placed = binaries.placed();
    for name in binaries.archive.below("binaries/") {
        let Some(folder) = name.split('/').nth(1) else { continue };
        let Some((ending, _)) = tuple(folder) else { continue };
        if name.ends_with(ending) && !placed.iter().any(|(_, of, _)| *of == folder) {
            let names: Vec<String> =
                binaries.identifiers.iter().map(|i| format!("{i}{ending}")).collect();
            findings.add(
                name,
                format!(
                    "no host finds it: it is not called modelIdentifier and ending ({})",
                    names.join(", ")
                ),
            );
        }
    }
}

fn each(
    binaries: &Binaries,
    findings: &mut Findings,
    look: impl Fn(&str, Option<Kind>, anyhow::Result<Binary>, &mut Findings),
) {
    let placed = binaries.placed();
    if placed.is_empty() {
        findings.skip("no library can be read here");
    }
    for (name, _, kind) in placed {
        let bytes = binaries.archive.file(name).unwrap_or_default();
        look(name, kind, Binary::read(bytes), findings);
    }
}

pub fn format(binaries: &Binaries, findings: &mut Findings) {
    each(binaries, findings, |name, kind, binary, findings| match (kind, binary) {
        (None, _) => {}
        (Some(_), Err(why)) => findings.add(name, format!("{why:#}")),
        (Some(kind), Ok(binary)) if binary.kind != kind => {
            findings.add(name, format!("it is for {} (allowed: {kind})", binary.kind));
        }
        _ => {}
    });
}

pub fn symbols(binaries: &Binaries, findings: &mut Findings) {
    let wanted = Fmu::symbols();
    each(binaries, findings, |name, _, binary, findings| {
        if let Ok(binary) = binary
            && let Some(fault) = binary.lacking(&wanted)
        {
            findings.add(name, fault);
        }
    });
}

pub fn this_platform(binaries: &Binaries, findings: &mut Findings) {
    if !binaries.is_callable() {
        findings.add(
            format!("binaries/{PLATFORM}"),
            "no library is called here: rules of calls are not looked at (needed for them: one for this \
             platform)",
        );
    }
}
