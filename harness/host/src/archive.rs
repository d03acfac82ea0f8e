//! Reads the zip archive of an FMU (FMI 2.0.5, section 2.3). Limits ensure that an archive cannot fill the disk or the
//! memory, or write outside the folder into which it is unpacked.
//!
//! Every command opens FMUs with this module; `book/foreign.md` lists the limits for users.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail, ensure};
use files::input;
use zip::read::Config;
use zip::result::ZipError;
// This part of the crate `zip` is marked as unstable. No other reader shows repeated names, and Cargo.lock fixes its version.
use zip::unstable::read::ZipIterable;
use zip::{CompressionMethod, ZipReadOptions, read::OwnedZipFileEntry};

use crate::xml;

pub const MOST_ENTRIES: usize = 20_000;
/// Longest allowed name of a file in an archive, bytes. Windows opens paths of up to 259
/// characters, so that longer names only occur in damaged or hostile archives.
pub const LONGEST_NAME: usize = 1024;
/// Constant part of the limit on the total unpacked size of an archive, bytes. The limit is
/// `UNPACKED` + [`UNPACKED_PER_BYTE`] · size of the archive. It protects against archives that
/// unpack to far more data than they contain.
pub const UNPACKED: u64 = 64 << 20;
/// Unpacked bytes that are allowed for each byte of the archive, in addition to [`UNPACKED`].
/// Binaries usually unpack to three times, and descriptions to twenty times their compressed size.
pub const UNPACKED_PER_BYTE: u64 = 8;
pub const DESCRIPTION: &str = "modelDescription.xml";

pub struct Entry {
    pub name: String,
    pub method: CompressionMethod,
    pub encrypted: bool,
    pub link: bool,
    zip: OwnedZipFileEntry,
}

impl Entry {
    pub fn is_folder(&self) -> bool {
        self.name.ends_with('/')
    }

    /// Returns the reasons why this entry could be written outside the folder into which the archive is unpacked, as ends
    /// of a sentence that begins with "the name".
    pub fn name_faults(&self) -> Vec<&'static str> {
        let name = &self.name;
        let has_part = |wrong: &[&str]| {
            name.trim_end_matches('/').split(['/', '\\']).any(|part| wrong.contains(&part))
        };
        // Some tools write an entry for the folder itself, which every unpacker accepts.
        let is_whole = name == "./";
        let faults = [
            (name.is_empty(), "is empty"),
            (name.contains('\\'), "has a backslash"),
            (name.contains('\0'), "has a zero"),
            (name.starts_with('/') || name.get(1..2) == Some(":"), "is absolute"),
            (has_part(&[".."]), "leads out of the archive by \"..\""),
            (has_part(&["", "."]) && !is_whole, "has an empty part or \".\""),
        ];
        faults.into_iter().filter_map(|(is_so, fault)| is_so.then_some(fault)).collect()
    }
}

/// Returns the path under which the most lenient file system would store the archive's file `name`.
/// Windows and macOS ignore capitals. Windows also drops full stops and spaces at the end of a part
/// of the path, and treats the text after a colon as the name of a stream of the file.
///
/// Two files with equal paths would overwrite each other on some systems. An archive with two such
/// files is refused on every system, so that an FMU consists of the same files everywhere.
pub fn place(name: &str) -> String {
    let part = |part: &str| {
        let file = part.split(':').next().unwrap_or_default();
        file.trim_end_matches(['.', ' ']).to_lowercase()
    };
    name.trim_end_matches('/').split('/').map(part).collect::<Vec<_>>().join("/")
}

/// An archive whose list of files has been read.
///
/// - `entries`: files and folders in the order of the zip directory. If a name occurs twice, both
///   entries are listed. If the directory has a fault, the list ends before the fault.
/// - `fault`: error in the zip directory, or the limit that the archive exceeds. If there is a
///   fault, no file of the archive should be unpacked.
pub struct Archive {
    file: File,
    pub entries: Vec<Entry>,
    pub fault: Option<String>,
}

impl Archive {
    /// Reads the list of files in the archive at `path`, but does not unpack them.
    ///
    /// # Errors
    ///
    /// If the file cannot be opened. A file that is not a valid archive is not an error here, so
    /// that `hubslosh check` can report it among other faults: [`Archive::fault`] then has the
    /// reason.
    pub fn open(path: &Path) -> Result<Archive> {
        let name = path.display();
        let file = input::open(path).with_context(|| format!("{name} cannot be opened"))?;
        let about = file.metadata().with_context(|| format!("{name} cannot be opened"))?;
        let mut archive = Archive { file, entries: Vec::new(), fault: None };
        archive.fault =
            archive.read_directory(about.len()).err().map(|why| archive.explain_fault(&why));
        Ok(archive)
    }

    fn explain_fault(&self, why: &anyhow::Error) -> String {
        let Some(ZipError::InvalidArchive(what)) = why.downcast_ref() else {
            return format!("{why:#}");
        };
        if !what.contains("EOCD") {
            return format!("the file is a damaged zip archive: {what}");
        }
        let mut start = [0; 2];
        let mut file = &self.file;
        let read = file.seek(SeekFrom::Start(0)).and_then(|_| file.read_exact(&mut start));
        match read.is_ok() && &start == b"PK" {
            true => "the file is an incomplete zip archive: the end is missing, as after a download that stopped".into(),
            false => "the file is not a zip archive".into(),
        }
    }

    fn read_directory(&mut self, size: u64) -> Result<()> {
        let mut directory = ZipIterable::try_new(BufReader::new(&self.file), Config::default())?
            .enforce_header_consistency(true);
        let count = directory.len();
        ensure!(count <= MOST_ENTRIES, "the archive has {count} entries (allowed: {MOST_ENTRIES})");
        let most = UNPACKED.saturating_add(size.saturating_mul(UNPACKED_PER_BYTE));
        let mut sum = 0u64;
        for zip in directory.files()? {
            let zip = OwnedZipFileEntry::from(zip?);
            let length = zip.name_raw().len();
            ensure!(
                length <= LONGEST_NAME,
                "a name in the archive has {length} bytes (allowed: {LONGEST_NAME})"
            );
            let name = String::from_utf8_lossy(zip.name_raw()).into_owned();
            sum = sum.saturating_add(zip.size());
            ensure!(
                sum <= most,
                "with {name}, which has {} bytes by its header, the archive unpacks to {sum} bytes (allowed \
                 for an archive of {size} bytes: {most})",
                zip.size()
            );
            let (method, encrypted, link) = (zip.compression(), zip.encrypted(), zip.is_symlink());
            self.entries.push(Entry { name, method, encrypted, link, zip });
        }
        Ok(())
    }

    /// Checks that the archive can be unpacked: it is complete and within the limits, every name stays inside the
    /// folder, and no two files have the same [`place`].
    ///
    /// # Errors
    ///
    /// If one of these conditions is not fulfilled; the message states the first.
    pub fn check(&self) -> Result<()> {
        if let Some(why) = &self.fault {
            bail!("{why}");
        }
        let mut places: BTreeMap<String, &Entry> = BTreeMap::new();
        for entry in &self.entries {
            let name = entry.name.escape_debug();
            let faults = entry.name_faults().join(", ");
            let allowed = "allowed: files and folders with relative names";
            ensure!(faults.is_empty(), "{name}: the name {faults} ({allowed})");
            ensure!(!entry.link, "{name}: it is a symbolic link ({allowed})");
            let Some(other) = places.insert(place(&entry.name), entry) else { continue };
            // Two entries for one folder do no harm, because no file is overwritten.
            if entry.is_folder() && other.is_folder() {
                continue;
            }
            ensure!(entry.name != other.name, "two entries are called {name} (allowed: one)");
            bail!(
                "{name} and {} would be the same file on Windows or macOS (allowed: names that differ in more than capital letters, full stops or spaces at the end, or text after a colon)",
                other.name.escape_debug()
            );
        }
        Ok(())
    }

    /// Unpacks the file `entry` and writes its content to `to`.
    ///
    /// # Errors
    ///
    /// If the size or the checksum of the content differs from the size or checksum that the
    /// archive states for the file.
    pub fn copy(&self, entry: &Entry, to: &mut impl Write) -> Result<()> {
        let said = entry.zip.size();
        if entry.name == DESCRIPTION {
            let most = xml::LONGEST as u64;
            ensure!(said <= most, "the file has {said} bytes (allowed for a description: {most})");
        }
        let mut reader = BufReader::new(&self.file);
        let file = entry.zip.as_ref().with_reader(&mut reader, ZipReadOptions::new())?;
        // One byte more than the header states is read, so that a longer file is noticed.
        let size = std::io::copy(&mut file.take(said.saturating_add(1)), to).map_err(|why| {
            match why.kind() {
                ErrorKind::InvalidInput | ErrorKind::InvalidData => {
                    anyhow!("the compressed bytes are damaged: {why}")
                }
                _ => anyhow!(why),
            }
        })?;
        let relation = if size > said { "more" } else { "fewer" };
        ensure!(size == said, "the file has {relation} bytes than its header says ({said})");
        Ok(())
    }

    pub fn content(&self, entry: &Entry) -> Result<Vec<u8>> {
        let mut content = Vec::new();
        self.copy(entry, &mut content)?;
        Ok(content)
    }

    pub fn unpack(&self, directory: &Path) -> Result<()> {
        self.check()?;
        for entry in &self.entries {
            let path = directory.join(&entry.name);
            let folder = if entry.is_folder() { Some(path.as_path()) } else { path.parent() };
            let made = folder.map_or(Ok(()), std::fs::create_dir_all);
            made.map_err(anyhow::Error::from)
                .and_then(|()| match entry.is_folder() {
                    true => Ok(()),
                    // A file system may give an existing file further names, so that an existing file must never be
                    // overwritten.
                    false => self.copy(entry, &mut File::create_new(&path)?),
                })
                .with_context(|| format!("{} cannot be unpacked", entry.name.escape_debug()))?;
        }
        Ok(())
    }

    pub fn hash(&self) -> Result<String> {
        let mut file = &self.file;
        file.seek(SeekFrom::Start(0))?;
        files::output::hash_reader(file)
    }

    pub fn description(&self) -> Result<String> {
        self.check()?;
        let entry = self.entries.iter().find(|entry| entry.name == DESCRIPTION);
        let entry = entry.with_context(|| format!("the archive has no {DESCRIPTION}"))?;
        let bytes = self.content(entry).with_context(|| format!("{DESCRIPTION} cannot be read"))?;
        String::from_utf8(bytes).map_err(|_| anyhow!("{DESCRIPTION} is not UTF-8"))
    }
}
