use crate::archive::Archive;
use crate::archive::report_unknown_folders;
use crate::binaries::OF_FMI_2;
use crate::findings::Findings;
use host::xml::Element;

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
    report_unknown_folders("3.0", &AT_THE_TOP, archive, findings);
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
            .at(FOLDER)
            .add("documentation/licenses has no entry point (required: license.spdx, license.txt or license.html)");
    }
}

pub fn pictures(archive: &Archive, findings: &mut Findings) {
    for (drawing, picture) in [
        ("terminalsAndIcons/icon.svg", "terminalsAndIcons/icon.png"),
        ("documentation/diagram.svg", "documentation/diagram.png"),
    ] {
        if has(archive, drawing) && !has(archive, picture) {
            findings.at(drawing).add(format!("{picture} is missing (required with this file)"));
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
        Err(why) => return findings.at(FILE).add(why.to_string()),
    };
    if root.name != "fmiTerminalsAndIcons" {
        findings
            .at(FILE)
            .add(format!("the root element is {} (allowed: fmiTerminalsAndIcons)", root.name));
    }
    let own = archive.file("modelDescription.xml").and_then(|xml| Element::parse(xml).ok());
    let own = own.and_then(|root| root.get("fmiVersion").map(String::from)).unwrap_or_default();
    let version = root.get("fmiVersion").unwrap_or_default();
    if version != own {
        findings.at(FILE).add(format!(
            "fmiVersion=\"{version}\" (allowed: that of modelDescription.xml, \"{own}\")"
        ));
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
                findings.at(name).add(why.to_string());
                continue;
            }
        };
        for attribute in ["fmi-ls-name", "fmi-ls-version", "fmi-ls-description"] {
            if root.get(attribute).is_none() {
                findings.at(name).add(format!("the attribute {attribute} is missing"));
            }
        }
    }
}

pub fn extra(archive: &Archive, findings: &mut Findings) {
    let is_wrong = |f: &&str| !f.contains('.') || has(archive, &format!("extra/{f}"));
    for folder in archive.folders("extra/").into_iter().filter(is_wrong) {
        findings.at(format!("extra/{folder}")).add("the name of the folder is not in the reverse domain notation of its maker (allowed: like org.example.data)");
    }
}

pub fn tuples(archive: &Archive, findings: &mut Findings) {
    let folders = archive.folders("binaries/");
    for (old, new) in OF_FMI_2.iter().filter(|(old, _)| folders.contains(old)) {
        findings.at(format!("binaries/{old}")).add(format!(
            "the folder belongs to FMI 2.0, where no host of FMI 3.0 looks (allowed: {new})"
        ));
    }
}
