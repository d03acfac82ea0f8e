//! The file itself: a zip archive (FMI 2.0.5, section 2.3).

use std::collections::BTreeMap;
use std::io::{Cursor, Read};

use anyhow::{Context, Result};
use host::temporary;
use zip::read::Config;
// Unstable by its own word, and the one reader that shows repeated names; the lock file pins it.
use zip::unstable::read::ZipIterable;
use zip::{CompressionMethod, ZipReadOptions};

use super::Findings;

/// Most bytes that one file of an archive may unpack to: a guard against zip bombs.
const LARGEST: u64 = 1 << 30;
/// Most bytes that all files of an archive together may unpack to.
const LARGEST_SUM: u64 = 2 << 30;
/// Most entries of an archive.
const MOST_ENTRIES: usize = 200_000;

/// What stands at the top of an FMU.
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
    /// What is in it, or why it cannot be unpacked.
    content: Result<Vec<u8>, String>,
}

/// An archive, all of it unpacked in memory.
pub struct Archive {
    /// In the order of its directory, repeated names included.
    pub entries: Vec<Entry>,
    /// Why the directory could not be read to its end.
    broken: Option<String>,
}

impl Archive {
    /// Reads as much as can be read.
    pub fn read(bytes: &[u8]) -> Archive {
        let mut archive = Archive { entries: Vec::new(), broken: None };
        let mut directory = match ZipIterable::try_new(Cursor::new(bytes), Config::default()) {
            Ok(directory) => directory.enforce_header_consistency(true),
            Err(error) => {
                archive.broken = Some(error.to_string());
                return archive;
            }
        };
        let files = match directory.files() {
            Ok(files) => files,
            Err(error) => {
                archive.broken = Some(error.to_string());
                return archive;
            }
        };
        let mut body = Cursor::new(bytes);
        let mut left = LARGEST_SUM;
        for entry in files {
            if archive.entries.len() >= MOST_ENTRIES {
                archive.broken = Some(format!("it has more than {MOST_ENTRIES} entries"));
                break;
            }
            let entry = match entry {
                Ok(entry) => entry,
                Err(error) => {
                    archive.broken = Some(error.to_string());
                    break;
                }
            };
            let (name, method) =
                (String::from_utf8_lossy(entry.name_raw()).into_owned(), entry.compression());
            let (encrypted, link) = (entry.encrypted(), entry.is_symlink());
            let written = entry.size();
            let mut content = Vec::new();
            let most = LARGEST.min(left);
            let unpacked = entry
                .with_reader(&mut body, ZipReadOptions::new())
                .map_err(|error| error.to_string())
                .and_then(|file| {
                    file.take(most + 1).read_to_end(&mut content).map_err(|error| error.to_string())
                });
            let content = match unpacked {
                Ok(size) if size as u64 > LARGEST => Err("it unpacks to more than 1 GiB".into()),
                Ok(size) if size as u64 > left => {
                    Err("with it the archive unpacks to more than 2 GiB".into())
                }
                Ok(size) if size as u64 != written => {
                    left -= size as u64;
                    Err(format!("it unpacks to {size} bytes, its headers say {written}"))
                }
                Ok(size) => {
                    left -= size as u64;
                    Ok(content)
                }
                Err(why) => Err(why),
            };
            archive.entries.push(Entry { name, method, encrypted, link, content });
        }
        archive
    }

    /// What is in a file, if it is there and could be unpacked.
    pub fn file(&self, name: &str) -> Option<&[u8]> {
        let entry = self.entries.iter().find(|entry| entry.name == name)?;
        entry.content.as_deref().ok()
    }

    /// Names of the files below a folder (`binaries/`), without the folder's own entries.
    pub fn below<'a>(&'a self, folder: &'a str) -> impl Iterator<Item = &'a str> {
        let files = self.entries.iter().filter(|entry| !entry.name.ends_with('/'));
        files.map(|entry| entry.name.as_str()).filter(move |name| name.starts_with(folder))
    }

    /// Puts the files that hosts would find into a temporary directory; names that lead out of it
    /// and links are left out, and found by the rules.
    pub fn unpack(&self) -> Result<temporary::Folder> {
        let directory = temporary::Folder::new()?;
        for entry in &self.entries {
            let Ok(content) = &entry.content else { continue };
            if entry.link || entry.name.ends_with('/') || !name_faults(&entry.name).is_empty() {
                continue;
            }
            let path = directory.path().join(&entry.name);
            let folder = path.parent().unwrap_or(directory.path());
            // A file where another entry wants a folder: hosts could not unpack it either.
            let written =
                std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&path, content));
            if let Err(error) = written
                && error.kind() == std::io::ErrorKind::StorageFull
            {
                return Err(error).context("no room to unpack the FMU");
            }
        }
        Ok(directory)
    }
}

/// What is wrong with a name, one piece of a sentence each.
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
    if name.trim_end_matches('/').split('/').any(|part| part.is_empty() || part == ".") {
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
        if let Err(why) = &entry.content
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
    for entry in &archive.entries {
        seen.entry(entry.name.to_lowercase()).or_default().push(&entry.name);
    }
    for names in seen.into_values().filter(|names| names.len() > 1) {
        findings.add(
            names[0],
            format!(
                "{} entries have this name, capitals aside: {} (allowed: one)",
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
    match archive.file("documentation/index.html") {
        None => findings.add("documentation/index.html", "it is missing"),
        Some(page) if page.iter().all(u8::is_ascii_whitespace) => {
            findings.add("documentation/index.html", "it is empty");
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
    let mut unknown: Vec<&str> = archive
        .entries
        .iter()
        .filter_map(|entry| entry.name.split(['/', '\\']).next())
        .filter(|top| !AT_THE_TOP.contains(top) && *top != "..")
        .collect();
    unknown.sort_unstable();
    unknown.dedup();
    for name in unknown {
        findings.add(
            name,
            format!("FMI 2.0 has no such file or folder (allowed: {})", AT_THE_TOP.join(", ")),
        );
    }
}
