//! The file itself: a zip archive (FMI 2.0.5, section 2.3).

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use anyhow::{Context, Result};
use files::temporary;
use zip::CompressionMethod;

use super::findings::Findings;

/// Entries allowed at the top level of an FMU.
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

/// An entry of the archive's directory.
pub struct Entry {
    /// Name as written, invalid characters replaced.
    pub name: String,
    method: CompressionMethod,
    encrypted: bool,
    link: bool,
    /// Content of the file, if a rule asks for it.
    content: Vec<u8>,
    /// Reason why it cannot be unpacked.
    fault: Option<String>,
}

/// An archive, unpacked.
pub struct Archive {
    /// Entries in the order of the zip directory, repeated names included.
    pub entries: Vec<Entry>,
    /// Reason why the directory could not be read to its end, or is too large to unpack.
    broken: Option<String>,
    /// Reason why no command opens the archive.
    refusal: Option<String>,
    directory: temporary::Folder,
}

/// True if a rule asks for the content of this file.
fn is_read(name: &str) -> bool {
    name == host::archive::DESCRIPTION || name == INDEX || name.starts_with("binaries/")
}

/// The first page of the documentation.
const INDEX: &str = "documentation/index.html";

impl Archive {
    /// Reads as much as possible and unpacks the files that hosts would find into a temporary directory. It skips links and names
    /// that lead out of it; the rules report them.
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
                content: Vec::new(),
                fault: None,
            };
            if from.fault.is_some() {
                unpacked.fault = Some("nothing of this archive is unpacked".into());
            } else if let Err(why) = archive.unpack(&from, entry, &mut unpacked.content) {
                let error = why.downcast_ref::<std::io::Error>();
                if error.is_some_and(|e| e.kind() == std::io::ErrorKind::StorageFull) {
                    return Err(why).context("no room to unpack the FMU");
                }
                unpacked.fault = Some(format!("{why:#}"));
            }
            archive.entries.push(unpacked);
        }
        Ok(archive)
    }

    /// Unpacks an entry: to its place if it has one, to `content` if a rule asks for it, and in any
    /// case to the end, where its size and checksum show.
    fn unpack(
        &self,
        from: &host::archive::Archive,
        entry: &host::archive::Entry,
        content: &mut Vec<u8>,
    ) -> Result<()> {
        if is_read(&entry.name) {
            *content = from.content(entry)?;
        }
        let is_placed = !entry.link && !entry.is_folder() && name_faults(&entry.name).is_empty();
        let path = self.directory.path().join(&entry.name);
        let folder = path.parent().unwrap_or(self.directory.path());
        // A file where another entry wants a folder: hosts could not unpack it either.
        let place = match is_placed && std::fs::create_dir_all(folder).is_ok() {
            // of files in the same place the first, which rules read, too
            true => File::create_new(&path).ok(),
            false => None,
        };
        match place {
            Some(mut file) => from.copy(entry, &mut file),
            None => from.copy(entry, &mut std::io::sink()),
        }
    }

    /// Content of a file that rules read, if it exists and could be unpacked.
    pub fn file(&self, name: &str) -> Option<&[u8]> {
        let entry = self.entries.iter().find(|entry| entry.name == name && is_read(name))?;
        entry.fault.is_none().then_some(entry.content.as_slice())
    }

    /// Names of the files below a folder (`binaries/`), without the folder's own entries.
    pub fn below<'a>(&'a self, folder: &'a str) -> impl Iterator<Item = &'a str> {
        let files = self.entries.iter().filter(|entry| !entry.name.ends_with('/'));
        files.map(|entry| entry.name.as_str()).filter(move |name| name.starts_with(folder))
    }

    /// Reason why no command opens the archive, if none does.
    pub fn refusal(&self) -> Option<String> {
        self.refusal.clone()
    }

    /// Directory into which it is unpacked.
    pub fn directory(&self) -> &Path {
        self.directory.path()
    }
}

/// Faults of a name, each as part of a sentence.
fn name_faults(name: &str) -> Vec<&'static str> {
    let mut faults = Vec::new();
    if name.is_empty() {
        faults.push("is empty");
    }
    if name.contains('\\') {
        faults.push("has a backslash");
    }
    if name.starts_with('/') || name.get(1..2) == Some(":") {
        faults.push("is absolute");
    }
    if name.split(['/', '\\']).any(|part| part == "..") {
        faults.push("leads out of the archive by \"..\"");
    }
    // an entry for the folder itself, which some tools write, is unpacked everywhere
    if name != "./"
        && name.trim_end_matches('/').split('/').any(|part| part.is_empty() || part == ".")
    {
        faults.push("has an empty part or \".\"");
    }
    if name.chars().any(char::is_control) || name.contains('\u{fffd}') {
        faults.push("has characters that cannot be written");
    }
    faults
}

/// `zip.readable`
pub fn readable(archive: &Archive, findings: &mut Findings) {
    if let Some(why) = &archive.broken {
        findings.add("the archive", format!("its directory cannot be read: {why}"));
    }
    for entry in &archive.entries {
        if let Some(why) = &entry.fault
            && archive.broken.is_none()
            && !entry.encrypted
            && is_common(entry.method)
        {
            findings.add(&entry.name, format!("it cannot be unpacked: {why}"));
        }
    }
    if archive.entries.is_empty() && archive.broken.is_none() {
        findings.add("the archive", "it is empty");
    }
}

fn is_common(method: CompressionMethod) -> bool {
    matches!(method, CompressionMethod::Stored | CompressionMethod::Deflated)
}

/// `zip.methods`
pub fn methods(archive: &Archive, findings: &mut Findings) {
    for entry in &archive.entries {
        if entry.encrypted {
            findings.add(&entry.name, "it is encrypted (allowed: no encryption)");
        }
        if !is_common(entry.method) {
            let method = format!("{:?}", entry.method);
            findings.add(
                &entry.name,
                format!("it is compressed by {method} (allowed: stored, deflated)"),
            );
        }
    }
}

/// `zip.names`
pub fn names(archive: &Archive, findings: &mut Findings) {
    for entry in &archive.entries {
        let faults = name_faults(&entry.name);
        if !faults.is_empty() {
            let faults = faults.join(", ");
            findings.add(
                entry.name.escape_debug().to_string(),
                format!("the name {faults} (allowed: relative names with \"/\" between the parts)"),
            );
        }
    }
}

/// `zip.links`
pub fn links(archive: &Archive, findings: &mut Findings) {
    for entry in archive.entries.iter().filter(|entry| entry.link) {
        findings.add(&entry.name, "it is a symbolic link (allowed: files and folders)");
    }
}

/// `zip.duplicates`
pub fn duplicates(archive: &Archive, findings: &mut Findings) {
    let mut seen: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for name in archive.entries.iter().map(|entry| entry.name.as_str()) {
        // that a file is a folder is a rule of its own
        let folder = if name.ends_with('/') { "/" } else { "" };
        let names = seen.entry(host::archive::place(name) + folder).or_default();
        // a folder that is there twice hides nothing
        if !(name.ends_with('/') && names.contains(&name)) {
            names.push(name);
        }
    }
    for names in seen.into_values().filter(|names| names.len() > 1) {
        findings.add(
            names[0],
            format!(
                "{} entries have this place on Windows or macOS: {} (allowed: names that differ in more than \
                 capitals, full stops and spaces at the end, and what follows a colon)",
                names.len(),
                names.join(", ")
            ),
        );
    }
}

/// `zip.description`
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
    findings.add(NAME, format!("it is not at the root of the archive{hint}"));
}

/// `zip.description_first`
pub fn description_first(archive: &Archive, findings: &mut Findings) {
    let place = archive.entries.iter().position(|entry| entry.name == "modelDescription.xml");
    if let Some(place) = place.filter(|place| *place > 0) {
        findings.add(
            "modelDescription.xml",
            format!("it is entry {} of the archive (allowed: the first)", place + 1),
        );
    }
}

/// `zip.documentation`
pub fn documentation(archive: &Archive, findings: &mut Findings) {
    match archive.file(INDEX) {
        None if archive.entries.iter().any(|entry| entry.name == INDEX) => {
            findings.skip("it cannot be unpacked");
        }
        None => findings.add(INDEX, "it is missing"),
        Some(page) if page.iter().all(u8::is_ascii_whitespace) => {
            findings.add(INDEX, "it is empty");
        }
        Some(_) => {}
    }
}

/// `zip.licenses`
pub fn licenses(archive: &Archive, findings: &mut Findings) {
    if archive.below("documentation/licenses/").next().is_none() {
        findings.add("documentation/licenses/", "no licence is in it");
    }
}

/// `zip.folders`
pub fn folders(archive: &Archive, findings: &mut Findings) {
    folders_of("2.0", &AT_THE_TOP, archive, findings);
}

/// Names at the top that a version of FMI does not have.
pub fn folders_of(version: &str, allowed: &[&str], archive: &Archive, findings: &mut Findings) {
    let mut unknown: Vec<&str> = archive
        .entries
        .iter()
        .filter_map(|entry| entry.name.split(['/', '\\']).next())
        .filter(|top| !allowed.contains(top) && *top != "..")
        .collect();
    unknown.sort_unstable();
    unknown.dedup();
    let allowed = allowed.join(", ");
    for name in unknown {
        findings
            .add(name, format!("FMI {version} has no such file or folder (allowed: {allowed})"));
    }
}
