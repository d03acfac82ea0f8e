use std::io::Write;

use host::archive::{Archive, LONGEST_NAME, MOST_ENTRIES, UNPACKED};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

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
        (&[("zeros", zeros.as_slice())][..], 0, "the archive unpacks to 68157440 bytes (allowed"),
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
        (&[("b/a", b"1"), ("b/a::$DATA", b"2")], 0, "b/a::$DATA and b/a would be the same file"),
        (&[("a", b"1"), ("a/", b"")], 0, "a/ and a would be the same file"),
        (&[("a", b"17000 bytes")], 4_000_000_000, "which has 4000000011 bytes by its header"),
        (&[("a", b"17000 bytes")], 3, "the file has fewer bytes than its header says (14)"),
        (&[("a", b"17000 bytes")], -3, "larger than its declared uncompressed size"),
    ] {
        let why = unpacked(files, lie).unwrap_err();
        assert!(why.contains(words), "{words}: {why}");
    }
}
