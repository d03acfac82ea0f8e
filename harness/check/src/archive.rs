use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::Path;

use anyhow::{Context, Result};
use files::temporary;
use zip::CompressionMethod;

use super::findings::Findings;

/// Reason in the report for skipping a rule that reads modelDescription.xml.
pub const NO_DESCRIPTION: &str = "there is no modelDescription.xml that can be unpacked";

const AT_THE_TOP: [&str; 9] = [
    "modelDescription.xml",
    "model.png",
    "binaries",
    "documentation",
    "extra",
    "licenses",
    "resources",
    "sources",
    "terminalsAndIcons",
];

pub struct Entry {
    pub name: String,
    method: CompressionMethod,
    encrypted: bool,
    link: bool,
    name_faults: Vec<&'static str>,
    /// Bytes of the file if rules need its content ([`is_read`] is true for its name), otherwise empty.
    content: Vec<u8>,
    fault: Option<String>,
}

pub struct Archive {
    pub entries: Vec<Entry>,
    broken: Option<String>,
    refusal: Option<String>,
    directory: temporary::Folder,
}

fn is_read(name: &str) -> bool {
    name == host::archive::DESCRIPTION || name == INDEX || name.starts_with("binaries/")
}

const INDEX: &str = "documentation/index.html";

impl Archive {
    /// Reads the archive of an FMU, and unpacks the files that a host would find into a temporary folder. Links and
    /// names that lead out of the folder are skipped, because other rules report them. A damaged entry is noted in its
    /// `fault`, so that the other entries are still checked.
    pub fn read(path: &Path) -> Result<Archive> {
        let from = host::archive::Archive::open(path)?;
        let directory = temporary::Folder::new()?;
        let refusal = from.check().err().map(|why| format!("{why:#}"));
        let broken = from.fault.clone();
        let mut archive = Archive { entries: Vec::new(), broken, refusal, directory };
        for entry in &from.entries {
            let mut unpacked = Entry {
                name: entry.name.clone(),
                method: entry.method,
                encrypted: entry.encrypted,
                link: entry.link,
                name_faults: name_faults(entry),
                content: Vec::new(),
                fault: None,
            };
            if from.fault.is_some() {
                unpacked.fault = Some("no file of this archive is unpacked".into());
            } else if let Err(why) = archive.unpack(&from, entry, &mut unpacked.content) {
                let error = why.downcast_ref::<std::io::Error>();
                if error.is_some_and(|e| e.kind() == std::io::ErrorKind::StorageFull) {
                    return Err(why).context("there is no space on the disk to unpack the FMU");
                }
                unpacked.fault = Some(format!("{why:#}"));
            }
            archive.entries.push(unpacked);
        }
        Ok(archive)
    }

    /// Unpacks one entry to its place in the folder. Every entry is decompressed completely, even if nothing needs its
    /// content, because a wrong size or checksum shows only then. `content` receives the bytes if a rule reads this file.
    fn unpack(
        &self,
        from: &host::archive::Archive,
        entry: &host::archive::Entry,
        content: &mut Vec<u8>,
    ) -> Result<()> {
        if is_read(&entry.name) {
            *content = from.content(entry)?;
        }
        let is_placed = !entry.link && !entry.is_folder() && name_faults(entry).is_empty();
        let path = self.directory.path().join(&entry.name);
        let folder = path.parent().unwrap_or(self.directory.path());
        // If another entry uses the name of this file as a folder, a host cannot unpack the file either.
        let place = match is_placed && std::fs::create_dir_all(folder).is_ok() {
            // Of two entries for the same file the first is kept, because rules also read the first.
            true => File::create_new(&path).ok(),
            false => None,
        };
        match place {
            Some(mut file) => from.copy(entry, &mut file),
            None => from.copy(entry, &mut std::io::sink()),
        }
    }

    /// Returns the content of a file of the archive. Returns `None` if the file does not exist or could not be
    /// unpacked, or if no rule needs its content.
    pub fn file(&self, name: &str) -> Option<&[u8]> {
        let entry = self.entries.iter().find(|entry| entry.name == name && is_read(name))?;
        entry.fault.is_none().then_some(entry.content.as_slice())
    }

    /// Lists the files below `folder`, for example `binaries/`, without entries for folders.
    pub fn below<'a>(&'a self, folder: &'a str) -> impl Iterator<Item = &'a str> {
        let files = self.entries.iter().filter(|entry| !entry.name.ends_with('/'));
        files.map(|entry| entry.name.as_str()).filter(move |name| name.starts_with(folder))
    }

    /// Returns the names of the folders and files directly in `folder`, which ends with a slash.
    pub fn folders<'a>(&'a self, folder: &'a str) -> BTreeSet<&'a str> {
        self.below(folder).filter_map(|name| name.split('/').nth(1)).collect()
    }

    /// Returns the content of modelDescription.xml. If it does not exist or could not be unpacked, the rule that asks
    /// is skipped.
    pub fn description_or_skip(&self, findings: &mut Findings) -> Option<&[u8]> {
        let content = self.file("modelDescription.xml");
        if content.is_none() {
            findings.skip(NO_DESCRIPTION);
        }
        content
    }

    /// Returns the reason why the other commands of `hubslosh` refuse this archive, or `None` if they open
    /// it.
    pub fn refusal(&self) -> Option<String> {
        self.refusal.clone()
    }

    pub fn directory(&self) -> &Path {
        self.directory.path()
    }
}

fn name_faults(entry: &host::archive::Entry) -> Vec<&'static str> {
    let mut faults = entry.name_faults();
    if entry.name.contains(|c: char| c.is_control() || c == '\u{fffd}') {
        faults.push("has control characters");
    }
    faults
}

pub fn readable(archive: &Archive, findings: &mut Findings) {
    if let Some(why) = &archive.broken {
        findings.at("the archive").add(why.clone());
    }
    for entry in &archive.entries {
        if let Some(why) = &entry.fault
            && archive.broken.is_none()
            && !entry.encrypted
            && is_common(entry.method)
        {
            findings.at(&entry.name).add(format!("the file cannot be unpacked: {why}"));
        }
    }
    if archive.entries.is_empty() && archive.broken.is_none() {
        findings.at("the archive").add("the archive is empty");
    }
}

fn is_common(method: CompressionMethod) -> bool {
    matches!(method, CompressionMethod::Stored | CompressionMethod::Deflated)
}

pub fn methods(archive: &Archive, findings: &mut Findings) {
    for entry in &archive.entries {
        if entry.encrypted {
            findings.at(&entry.name).add("the file is encrypted (allowed: no encryption)");
        }
        if !is_common(entry.method) {
            let method = format!("{:?}", entry.method);
            findings
                .at(&entry.name)
                .add(format!("the file is compressed by {method} (allowed: stored, deflated)"));
        }
    }
}

pub fn names(archive: &Archive, findings: &mut Findings) {
    for entry in &archive.entries {
        if !entry.name_faults.is_empty() {
            let faults = entry.name_faults.join(", ");
            findings.at(entry.name.escape_debug().to_string()).add(format!(
                "the name {faults} (allowed: relative names with \"/\" between the parts)"
            ));
        }
    }
}

pub fn links(archive: &Archive, findings: &mut Findings) {
    for entry in archive.entries.iter().filter(|entry| entry.link) {
        findings.at(&entry.name).add("the entry is a symbolic link (allowed: files and folders)");
    }
}

pub fn duplicates(archive: &Archive, findings: &mut Findings) {
    let mut seen: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for name in archive.entries.iter().map(|entry| entry.name.as_str()) {
        // A file and a folder with equal names break the rule zip.file_and_folder, and not this rule.
        let folder = if name.ends_with('/') { "/" } else { "" };
        let names = seen.entry(host::archive::place(name) + folder).or_default();
        // A repeated entry for a folder does no harm, because it hides no content.
        if !(name.ends_with('/') && names.contains(&name)) {
            names.push(name);
        }
    }
    for names in seen.into_values().filter(|names| names.len() > 1) {
        findings.at(names[0]).add(format!(
                "{} entries have this place on Windows or macOS: {} (allowed: names that differ in more than \
                 capitals, full stops and spaces at the end, and what follows a colon)",
                names.len(),
                names.join(", ")
            ));
    }
}

pub fn description(archive: &Archive, findings: &mut Findings) {
    const NAME: &str = "modelDescription.xml";
    if archive.entries.iter().any(|entry| entry.name == NAME) {
        return;
    }
    let elsewhere: Vec<_> = archive
        .below("")
        .filter(|name| name.to_lowercase().ends_with("modeldescription.xml"))
        .collect();
    let hint = match elsewhere.len() {
        0 => String::new(),
        _ => format!("; there is {}", elsewhere.join(", ")),
    };
    findings.at(NAME).add(format!("modelDescription.xml is not at the root of the archive{hint}"));
}

pub fn description_first(archive: &Archive, findings: &mut Findings) {
    let place = archive.entries.iter().position(|entry| entry.name == "modelDescription.xml");
    if let Some(place) = place.filter(|place| *place > 0) {
        findings
            .at("modelDescription.xml")
            .add(format!("the file is entry {} of the archive (allowed: the first)", place + 1));
    }
}

pub fn documentation(archive: &Archive, findings: &mut Findings) {
    match archive.file(INDEX) {
        None if archive.entries.iter().any(|entry| entry.name == INDEX) => {
            findings.skip("the FMU cannot be unpacked");
        }
        None => findings.at(INDEX).add("the file is missing"),
        Some(page) if page.iter().all(u8::is_ascii_whitespace) => {
            findings.at(INDEX).add("the file is empty");
        }
        Some(_) => {}
    }
}

pub fn licenses(archive: &Archive, findings: &mut Findings) {
    if archive.below("documentation/licenses/").next().is_none() {
        findings.at("documentation/licenses/").add("the FMU contains no licence");
    }
}

pub fn folders(archive: &Archive, findings: &mut Findings) {
    report_unknown_folders("2.0", &AT_THE_TOP, archive, findings);
}

pub fn report_unknown_folders(
    version: &str,
    allowed: &[&str],
    archive: &Archive,
    findings: &mut Findings,
) {
    let at_the_top: BTreeSet<&str> =
        archive.entries.iter().filter_map(|entry| entry.name.split(['/', '\\']).next()).collect();
    let unknown = at_the_top.into_iter().filter(|top| !allowed.contains(top) && *top != "..");
    let joined = allowed.join(", ");
    for name in unknown {
        findings
            .at(name)
            .add(format!("FMI {version} has no such file or folder (allowed: {joined})"));
    }
}
