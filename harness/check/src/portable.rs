//! Rules about names that some file systems cannot store, because an FMU is unpacked on Windows, macOS and
//! Linux.

use std::collections::BTreeMap;

use super::archive::Archive;
use super::binaries::platform;
use super::findings::Findings;

/// Characters that Windows does not allow in names. Slashes separate folders, and another rule reports control characters.
const FORBIDDEN: [char; 7] = ['<', '>', ':', '"', '|', '?', '*'];
/// Names of devices on Windows, which no file may have, with any extension.
const DEVICES: [&str; 6] = ["CON", "PRN", "AUX", "NUL", "CONIN$", "CONOUT$"];
/// Largest length of one part of a path on the usual file systems, bytes.
const LONGEST_PART: usize = 255;
/// Largest length of a path on Windows, characters: MAX_PATH is 260 with the terminating zero.
const LONGEST_PATH: usize = 259;
/// Largest length of a path inside an FMU, characters, with which unpacking succeeds on Windows:
/// MAX_PATH minus a temporary folder such as `C:\Users\a.long.user.name\AppData\Local\Temp\` and a
/// folder named after the instance.
const PORTABLE_PATH: usize = 160;

fn windows_faults(part: &str) -> Vec<String> {
    let mut faults = Vec::new();
    let stem = part.split('.').next().unwrap_or(part).trim_end().to_uppercase();
    let port = |kind: &str| {
        let number = stem.strip_prefix(kind).map(|rest| rest.chars().collect::<Vec<_>>());
        matches!(number.as_deref(), Some(['1'..='9' | '¹' | '²' | '³']))
    };
    if DEVICES.contains(&stem.as_str()) || port("COM") || port("LPT") {
        faults.push(format!("\"{part}\" is the name of a device"));
    }
    if part.ends_with(['.', ' ']) && !matches!(part, "." | "..") {
        faults.push(format!("\"{part}\" ends with a full stop or a space, which Windows drops"));
    }
    let odd: Vec<String> =
        FORBIDDEN.iter().filter(|c| part.contains(**c)).map(char::to_string).collect();
    if !odd.is_empty() {
        faults.push(format!("\"{part}\" has {}", odd.join(" ")));
    }
    faults
}

/// Splits the name of an archive entry at its slashes, without the empty last part of a folder.
fn parts(name: &str) -> impl Iterator<Item = &str> {
    name.split(['/', '\\']).filter(|part| !part.is_empty())
}

pub fn windows_names(archive: &Archive, findings: &mut Findings) {
    for entry in &archive.entries {
        // A drive letter makes the name absolute, which breaks another rule.
        let is_drive = |part: &str| part.len() == 2 && part.ends_with(':');
        let faults: Vec<String> = parts(&entry.name)
            .enumerate()
            .filter(|(n, part)| !(*n == 0 && is_drive(part)))
            .flat_map(|(_, part)| windows_faults(part))
            .collect();
        if !faults.is_empty() {
            findings.at(entry.name.escape_debug().to_string()).add(format!(
                "{} (allowed: names without < > : \" | ? *, that end with another character \
                     than a full stop or a space and are none of CON, PRN, AUX, NUL, COM1 to COM9 \
                     and LPT1 to LPT9, with or without an extension)",
                faults.join(", ")
            ));
        }
    }
}

pub fn path_length(archive: &Archive, findings: &mut Findings) {
    for entry in &archive.entries {
        let start: String = entry.name.chars().take(60).collect();
        let place = format!("{}…", start.escape_debug());
        let longest = parts(&entry.name).map(str::len).max().unwrap_or(0);
        // Windows counts UTF-16 units.
        let length = entry.name.encode_utf16().count();
        if longest > LONGEST_PART {
            findings
                .at(place)
                .fail(format!("a part of the path has {longest} bytes (allowed: {LONGEST_PART})"));
        } else if length > LONGEST_PATH {
            findings.at(place).fail(format!(
                "the path has {length} characters, more than Windows opens at all \
                     ({LONGEST_PATH}; allowed: {PORTABLE_PATH})"
            ));
        } else if length > PORTABLE_PATH {
            findings.at(place).add(format!(
                "the path has {length} characters (allowed: {PORTABLE_PATH}; with the temporary \
                     folder in front Windows opens {LONGEST_PATH})"
            ));
        }
    }
}

pub fn file_and_folder(archive: &Archive, findings: &mut Findings) {
    let files: BTreeMap<String, &str> =
        archive.below("").map(|name| (host::archive::place(name), name)).collect();
    let mut told = std::collections::BTreeSet::new();
    for entry in &archive.entries {
        let place =
            host::archive::place(&entry.name) + if entry.name.ends_with('/') { "/" } else { "" };
        let mut folders: Vec<&str> = place.match_indices('/').map(|(at, _)| &place[..at]).collect();
        folders.dedup();
        for folder in folders {
            if let Some(file) = files.get(folder)
                && told.insert(folder.to_string())
            {
                findings.at(*file).add(format!(
                    "the archive has a file with this name and also a folder, which holds {} (allowed: one of the two)",
                    entry.name
                ));
            }
        }
    }
}

/// Names of folders and files that the standard defines. Hosts on Linux find them only in exactly this spelling.
const STANDARD_FOLDERS: [&str; 6] =
    ["binaries", "documentation", "resources", "sources", "extra", "terminalsAndIcons"];
const STANDARD_FILES: [&str; 3] = ["modelDescription.xml", "model.png", "documentation/index.html"];

fn standard_spelling(name: &str) -> Option<String> {
    let parts: Vec<&str> = name.split('/').collect();
    let other = |written: &str, standard: &[&str]| -> Option<String> {
        let same = standard.iter().find(|s| s.eq_ignore_ascii_case(written))?;
        (*same != written).then(|| same.to_string())
    };
    if let Some(file) = other(name, &STANDARD_FILES) {
        return Some(file);
    }
    let [first, rest @ ..] = &parts[..] else { return None };
    let mut right: Vec<String> = parts.iter().map(|part| part.to_string()).collect();
    let mut differs = false;
    if !rest.is_empty()
        && let Some(folder) = other(first, &STANDARD_FOLDERS)
    {
        right[0] = folder;
        differs = true;
    }
    if first.eq_ignore_ascii_case("binaries") && rest.len() > 1 && platform(rest[0]).is_none() {
        let folder = rest[0].to_lowercase();
        if platform(&folder).is_some() {
            right[1] = folder;
            differs = true;
        }
    }
    differs.then(|| right.join("/"))
}

pub fn capitals(archive: &Archive, findings: &mut Findings) {
    for entry in &archive.entries {
        // If the correct name also exists, the two names are duplicates, which another rule reports.
        let is_there = |name: &String| archive.entries.iter().any(|e| e.name == *name);
        if let Some(right) = standard_spelling(&entry.name).filter(|right| !is_there(right)) {
            findings.at(&entry.name).add(format!(
                "hosts on Linux do not find the entry, because FMI writes {right} (required: the same upper-case and lower-case letters)"
            ));
        }
    }
}
