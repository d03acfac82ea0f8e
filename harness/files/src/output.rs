//! Writes outputs. A file appears completely or not at all, because it is written to the same folder under a temporary
//! name and then renamed. Links are followed; devices and pipes are written to. Also computes hashes of files.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Read, Seek, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use sha2::{Digest, Sha256};

use crate::{input, temporary};

/// Place to which an output is written.
///
/// - `File`: A regular file at this path, which may not exist yet. The output replaces the whole
///   file.
/// - `Stream`: A device, a named pipe or an open descriptor such as `/dev/stdout`. The output is
///   written to it and replaces nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Destination {
    File(PathBuf),
    Stream,
}

const LINKS: usize = 40;

/// Finds the destination of an output with the path `path`. Symbolic links are followed, also to a
/// file that does not exist yet.
///
/// # Errors
/// If the path leads to a directory, or its links form a circle.
pub fn destination(path: &Path) -> Result<Destination> {
    let name = path.display();
    let mut place = path.to_path_buf();
    for _ in 0..LINKS {
        let Ok(found) = place.symlink_metadata() else { return Ok(Destination::File(place)) };
        if !found.is_symlink() {
            ensure!(!found.is_dir(), "{name} cannot be written: it is a directory");
            return Ok(if found.is_file() {
                Destination::File(place)
            } else {
                Destination::Stream
            });
        }
        let folder = containing_folder(&place).to_path_buf();
        // Links below /proc open a descriptor. The text of such a link names a pipe, or a file that
        // another program is writing.
        if folder.canonicalize().is_ok_and(|folder| folder.starts_with("/proc")) {
            return Ok(Destination::Stream);
        }
        let next = place.read_link().with_context(|| format!("{name} cannot be written"))?;
        place = folder.join(next);
    }
    bail!(
        "{name} cannot be written: it is a symbolic link that leads to itself, or a chain of more than {LINKS} symbolic links"
    )
}

fn containing_folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Calls `write` to write the output `path`, completely or not at all. A regular file is replaced
/// only when the new file is on the disk, so that an error or a power failure does not leave an
/// incomplete file. A device or a pipe receives bytes only after `write` has succeeded. A protected
/// input ([`input::protect`]) is never overwritten.
pub fn atomically<T>(path: &Path, write: impl FnOnce(&mut File) -> Result<T>) -> Result<T> {
    input::check_replaceable(path)?;
    let cannot = || format!("{} cannot be written", path.display());
    let place = match destination(path)? {
        Destination::File(place) => place,
        Destination::Stream => {
            let mut draft = tempfile::tempfile().with_context(cannot)?;
            let result = write(&mut draft).with_context(cannot)?;
            draft.rewind().with_context(cannot)?;
            pour(&mut draft, path).with_context(cannot)?;
            return Ok(result);
        }
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".hubslosh-");
    #[cfg(unix)] // what any other program would give a new file; tempfile's 0600 is for secrets
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(containing_folder(&place)).with_context(cannot)?;
    let _registered = temporary::register(file.path());
    let result = write(file.as_file_mut()).with_context(cannot)?;
    file.as_file().sync_all().with_context(cannot)?;
    file.persist(&place).with_context(cannot)?;
    Ok(result)
}

/// Moves the complete file `draft` to the output `path`: a regular file is replaced, whereas a
/// device or a pipe receives a copy of the bytes.
///
/// # Errors
/// If the output cannot be written; the message names `path`.
pub fn publish_draft(draft: &Path, path: &Path) -> Result<()> {
    let move_or_pour = || -> Result<()> {
        match destination(path)? {
            Destination::File(place) => match fs::rename(draft, &place) {
                // The destination is on another disk, to which a file cannot be renamed, so that it is copied.
                Err(error) if error.kind() == ErrorKind::CrossesDevices => {
                    atomically(&place, |file| Ok(io::copy(&mut File::open(draft)?, file)?))?;
                    Ok(fs::remove_file(draft)?)
                }
                renamed => Ok(renamed?),
            },
            Destination::Stream => {
                pour(&mut File::open(draft)?, path)?;
                Ok(fs::remove_file(draft)?)
            }
        }
    };
    move_or_pour().with_context(|| format!("{} cannot be written", path.display()))
}

fn pour(draft: &mut File, path: &Path) -> io::Result<()> {
    io::copy(draft, &mut File::options().append(true).open(path)?).map(drop)
}

pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<()> {
    atomically(path, |file| Ok(file.write_all(bytes.as_ref())?))
}

pub fn directory(path: &Path) -> Result<()> {
    std::fs::create_dir_all(path)
        .with_context(|| format!("the directory {} cannot be made", path.display()))
}

pub fn sha256(bytes: &[u8]) -> String {
    base16ct::lower::encode_string(&Sha256::digest(bytes))
}

pub fn hash_reader(mut from: impl Read) -> Result<String> {
    let (mut hash, mut buffer) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        match from.read(&mut buffer)? {
            0 => return Ok(base16ct::lower::encode_string(&hash.finalize())),
            read => hash.update(&buffer[..read]),
        }
    }
}
