//! The files under `binaries/` (FMI 2.0.5, section 2.3), read as files, whichever platform they are
//! for.

use super::{Archive, Description, Findings};
use host::binary::{Binary, Kind};
use host::fmi2::{Fmu, PLATFORM};

/// Folders of FMI 2.0, the ending of the binary in each, and what can be read of it here.
const PLATFORMS: [(&str, &str, Option<Kind>); 6] = [
    ("win32", ".dll", None),
    ("win64", ".dll", Some(Kind::Windows)),
    ("linux32", ".so", None),
    ("linux64", ".so", Some(Kind::Linux)),
    ("darwin32", ".dylib", None),
    ("darwin64", ".dylib", Some(Kind::MacOs)),
];

/// A binary in its place.
struct Placed {
    name: String,
    folder: &'static str,
    kind: Option<Kind>,
    binary: Result<Binary, String>,
}

/// All binaries of an FMU.
pub struct Binaries {
    /// Those where hosts look for them.
    placed: Vec<Placed>,
    /// Folders under `binaries/`, without repetition.
    folders: Vec<String>,
    /// Files in folders of FMI 2.0 that no host will find, each with the names it looks for.
    elsewhere: Vec<(String, String)>,
    /// Functions the FMU must export.
    wanted: Vec<&'static str>,
    has_sources: bool,
    described: bool,
}

impl Binaries {
    /// Reads all there are.
    pub fn new(archive: &Archive, description: Option<&Description>) -> Binaries {
        let mut identifiers: Vec<&str> = Vec::new();
        let mut wanted = Fmu::symbols().to_vec();
        if let Some(d) = description {
            if let Some(exchange) = &d.model_exchange {
                wanted.extend(Fmu::exchange_symbols());
                identifiers.extend(exchange.get("modelIdentifier"));
            }
            if let Some(stepping) = &d.co_simulation {
                wanted.extend(Fmu::step_symbols());
                identifiers.extend(stepping.get("modelIdentifier"));
            }
        }
        identifiers.sort_unstable();
        identifiers.dedup();
        let mut all = Binaries {
            placed: Vec::new(),
            folders: Vec::new(),
            elsewhere: Vec::new(),
            wanted,
            has_sources: archive.below("sources/").next().is_some(),
            described: description.is_some(),
        };
        for name in archive.below("binaries/") {
            let parts: Vec<&str> = name.split('/').collect();
            let [_, folder, file] = parts[..] else { continue };
            if !all.folders.iter().any(|known| known == folder) {
                all.folders.push(folder.to_string());
            }
            let Some((folder, ending, kind)) =
                PLATFORMS.into_iter().find(|(known, ..)| *known == folder)
            else {
                continue;
            };
            let names: Vec<String> =
                identifiers.iter().map(|identifier| format!("{identifier}{ending}")).collect();
            if names.iter().any(|n| n == file) {
                let bytes = archive.file(name).unwrap_or_default();
                let binary = Binary::read(bytes).map_err(|error| format!("{error:#}"));
                all.placed.push(Placed { name: name.into(), folder, kind, binary });
            } else if file.ends_with(ending) {
                all.elsewhere.push((name.into(), names.join(", ")));
            }
        }
        all
    }

    /// The name of the binary for the platform this program runs on.
    pub fn own(&self) -> Option<&str> {
        self.placed.iter().find(|p| p.folder == PLATFORM).map(|p| p.name.as_str())
    }

    /// Those that could be read.
    fn read(&self) -> impl Iterator<Item = (&str, &Binary)> {
        self.placed.iter().filter_map(|p| Some((p.name.as_str(), p.binary.as_ref().ok()?)))
    }

    /// Looks at each that could be read; says so if there is none.
    fn each(&self, findings: &mut Findings, look: impl Fn(&str, &Binary, &mut Findings)) {
        if self.read().next().is_none() {
            findings.skip("no binary can be read here");
        }
        for (name, binary) in self.read() {
            look(name, binary, findings);
        }
    }
}

/// `bin.present`
pub fn present(binaries: &Binaries, findings: &mut Findings) {
    if !binaries.described {
        return findings.skip("without a description nobody knows what the binary is called");
    }
    for folder in &binaries.folders {
        let known: Vec<_> = PLATFORMS.iter().map(|(known, ..)| *known).collect();
        if !known.contains(&folder.as_str()) {
            let known = known.join(", ");
            findings.add(
                format!("binaries/{folder}"),
                format!("FMI 2.0 has no such platform (allowed: {known})"),
            );
        }
    }
    if binaries.placed.is_empty() && !binaries.has_sources {
        findings.add(
            "binaries/",
            "no platform has a binary of the model's name, and there are no sources",
        );
    }
}

/// `bin.name`
pub fn name(binaries: &Binaries, findings: &mut Findings) {
    // A library beside the binary is fine; a folder without the binary is not.
    let empty = |folder: &str| !binaries.placed.iter().any(|p| p.name.starts_with(folder));
    for (name, expected) in &binaries.elsewhere {
        let folder = name.rsplit_once('/').map_or("", |(folder, _)| folder);
        if binaries.described && empty(folder) {
            findings.add(
                name,
                format!(
                    "no host finds it: its name is not modelIdentifier and ending ({expected})"
                ),
            );
        }
    }
}

/// `bin.format`
pub fn format(binaries: &Binaries, findings: &mut Findings) {
    let mut looked = false;
    for placed in &binaries.placed {
        let Some(kind) = placed.kind else { continue };
        looked = true;
        match &placed.binary {
            Err(why) => findings.add(&placed.name, why.clone()),
            Ok(binary) if binary.kind != kind => findings.add(
                &placed.name,
                format!("it is for {:?} (allowed in {}: {kind:?})", binary.kind, placed.folder),
            ),
            Ok(_) => {}
        }
    }
    if !looked {
        findings.skip("no binary for 64 bits");
    }
}

/// `bin.symbols`
pub fn symbols(binaries: &Binaries, findings: &mut Findings) {
    binaries.each(findings, |name, binary, findings| {
        if let Some(fault) = binary.lacking(&binaries.wanted) {
            findings.add(name, fault);
        }
    });
}

/// `bin.extra_symbols`
pub fn extra_symbols(binaries: &Binaries, findings: &mut Findings) {
    binaries.each(findings, |name, binary, findings| {
        if let Some(fault) = binary.surplus() {
            findings.add(name, fault);
        }
    });
}

/// `bin.system`
pub fn system(binaries: &Binaries, findings: &mut Findings) {
    binaries.each(findings, |name, binary, findings| {
        for fault in binary.loading_faults() {
            findings.add(name, fault);
        }
    });
}
