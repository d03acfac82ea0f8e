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

#[cfg(test)]
mod tests {
    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    use super::*;

    fn archive(files: &[(&str, &[u8])], lie: i64) -> tempfile::NamedTempFile {
        let mut to = ZipWriter::new(std::io::Cursor::new(Vec::new()));
        for (name, content) in files {
            to.start_file(*name, SimpleFileOptions::default()).unwrap();
            to.write_all(content).unwrap();
        }
        let mut bytes = to.finish().unwrap().into_inner();
        for (signature, at) in [(b"PK\x03\x04", 22), (b"PK\x01\x02", 24)] {
            let starts = bytes.windows(4).enumerate().filter(|(_, four)| four == signature);
            for start in starts.map(|(start, _)| start).collect::<Vec<_>>() {
                let field = &mut bytes[start + at..start + at + 4];
                let size = u32::from_le_bytes(field.try_into().unwrap());
                field.copy_from_slice(&((i64::from(size) + lie) as u32).to_le_bytes());
            }
        }
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(&bytes).unwrap();
        file
    }

    fn unpacked(files: &[(&str, &[u8])], lie: i64) -> Result<(), String> {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("inner");
        std::fs::create_dir(&inner).unwrap();
        let file = archive(files, lie);
        let done = Archive::open(file.path()).unwrap().unpack(&inner);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        if let Err(why) = &done
            && why.to_string().contains("place")
        {
            assert_eq!(std::fs::read_dir(&inner).unwrap().count(), 0, "{why}");
        }
        done.map_err(|error| format!("{error:#}"))
    }

    #[test]
    fn the_files_of_a_valid_archive_are_unpacked() {
        assert_eq!(unpacked(&[("a", b"1"), ("b/", b""), ("b/c", b"2")], 0), Ok(()));
    }

    #[test]
    fn unpacking_an_archive_never_overwrites_an_existing_file() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a"), "1").unwrap();
        let file = archive(&[("a", b"2")], 0);
        assert!(Archive::open(file.path()).unwrap().unpack(folder.path()).is_err());
        assert_eq!(std::fs::read(folder.path().join("a")).unwrap(), b"1");
    }

    #[test]
    fn archives_that_are_too_large_or_leave_their_folder_are_refused_before_writing() {
        let zeros = vec![0; (UNPACKED + (1 << 20)) as usize];
        let many: Vec<String> = (0..=MOST_ENTRIES).map(|n| n.to_string()).collect();
        let many: Vec<(&str, &[u8])> = many.iter().map(|name| (name.as_str(), &[][..])).collect();
        let long = "n".repeat(LONGEST_NAME + 1);
        for (files, lie, words) in [
            (
                &[("zeros", zeros.as_slice())][..],
                0,
                "the archive unpacks to 68157440 bytes (allowed",
            ),
            (&many, 0, "the archive has 20001 entries (allowed: 20000)"),
            (&[(long.as_str(), b"")], 0, "a name in the archive has 1025 bytes (allowed: 1024)"),
            (&[("../out", b"")], 0, "leads out of the archive"),
            (&[("b/../../out", b"")], 0, "leads out of the archive"),
            (&[("/out", b"")], 0, "the name is absolute"),
            (&[("c:out", b"")], 0, "the name is absolute"),
            (&[("..\\out", b"")], 0, "backslash"),
            (&[("b/../a", b"")], 0, "leads out of the archive"),
            (&[("./a", b"")], 0, "the name has an empty part or \".\""),
            (&[("b/./a", b"")], 0, "the name has an empty part or \".\""),
            (&[("b//a", b"")], 0, "the name has an empty part or \".\""),
            (&[("b/a", b"1"), ("B/A", b"2")], 0, "B/A and b/a would be the same file"),
            (&[("b/a", b"1"), ("b/a.", b"2")], 0, "b/a. and b/a would be the same file"),
            (&[("b/a", b"1"), ("b. /a", b"2")], 0, "b. /a and b/a would be the same file"),
            (
                &[("b/a", b"1"), ("b/a::$DATA", b"2")],
                0,
                "b/a::$DATA and b/a would be the same file",
            ),
            (&[("a", b"1"), ("a/", b"")], 0, "a/ and a would be the same file"),
            (&[("a", b"17000 bytes")], 4_000_000_000, "which has 4000000011 bytes by its header"),
            (&[("a", b"17000 bytes")], 3, "the file has fewer bytes than its header says (14)"),
            (&[("a", b"17000 bytes")], -3, "larger than its declared uncompressed size"),
        ] {
            let why = unpacked(files, lie).unwrap_err();
            assert!(why.contains(words), "{words}: {why}");
        }
    }
}
