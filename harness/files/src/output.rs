//! Files appear whole or not at all: written to the same folder under a temporary name, then
//! renamed. And what is in one, as a hash.

use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};

use crate::{input, temporary};

/// Writes `path` through `write`; if that fails, nothing is left and an older file stays as it was.
/// The file is on the disk before it gets its name, so that a power cut leaves no empty one. A protected input
/// ([`input::protect`]) is never replaced.
pub fn atomically<T>(path: &Path, write: impl FnOnce(&mut File) -> Result<T>) -> Result<T> {
    input::check_replaceable(path)?;
    let name = path.display();
    let directory = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".hubslosh-");
    #[cfg(unix)] // what any other program would give a new file; tempfile's 0600 is for secrets
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file =
        builder.tempfile_in(directory).with_context(|| format!("{name} cannot be written"))?;
    if path.is_dir() {
        anyhow::bail!("{name} cannot be written: it is a directory");
    }
    let _registered = temporary::register(file.path());
    let result = write(file.as_file_mut()).with_context(|| format!("{name} cannot be written"))?;
    file.as_file().sync_all().with_context(|| format!("{name} cannot be written"))?;
    file.persist(path).with_context(|| format!("{name} cannot be written"))?;
    Ok(result)
}

/// Writes `path` as [`atomically`] does.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<()> {
    atomically(path, |file| Ok(file.write_all(bytes.as_ref())?))
}

/// Makes a directory and those above it.
pub fn directory(path: &Path) -> Result<()> {
    std::fs::create_dir_all(path)
        .with_context(|| format!("the directory {} cannot be made", path.display()))
}

/// SHA-256 in hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    base16ct::lower::encode_string(&Sha256::digest(bytes))
}

/// The same of all that can be read from `from`, which need not fit into memory.
pub fn sha256_of(mut from: impl Read) -> Result<String> {
    let (mut hash, mut buffer) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        match from.read(&mut buffer)? {
            0 => return Ok(base16ct::lower::encode_string(&hash.finalize())),
            read => hash.update(&buffer[..read]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_that_of_the_standard() {
        // FIPS 180-4, the example of one block
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256(b"abc"), expected);
        assert_eq!(sha256_of(&b"abc"[..]).unwrap(), expected);
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_other() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.txt");
        std::fs::write(&path, "old").unwrap();
        let failed: Result<()> = atomically(&path, |file| {
            file.write_all(b"half")?;
            anyhow::bail!("no more")
        });
        let error = format!("{:#}", failed.unwrap_err());
        assert_eq!(error, format!("{} cannot be written: no more", path.display()));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    }
}
