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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sha_256_equals_the_example_of_the_standard() {
        // the one-block example of FIPS 180-4
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256(b"abc"), expected);
        assert_eq!(hash_reader(&b"abc"[..]).unwrap(), expected);
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_temporary_file() {
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

    #[cfg(unix)]
    #[test]
    fn writing_to_a_symbolic_link_writes_its_target_and_keeps_the_link() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        fs::create_dir(at("far")).unwrap();
        fs::write(at("far/old.csv"), "old").unwrap();
        let links =
            [("one.csv", "far/old.csv"), ("two.csv", "one.csv"), ("new.csv", "far/new.csv")];
        for (link, to) in links {
            std::os::unix::fs::symlink(to, at(link)).unwrap();
        }
        for (link, file) in [("two.csv", "far/old.csv"), ("new.csv", "far/new.csv")] {
            write(&at(link), link).unwrap();
            assert!(at(link).is_symlink() && !at(file).is_symlink());
            assert_eq!(fs::read_to_string(at(file)).unwrap(), link);
            fs::write(at("draft"), "draft").unwrap();
            publish_draft(&at("draft"), &at(link)).unwrap();
            assert_eq!(fs::read_to_string(at(file)).unwrap(), "draft");
            assert!(!at("draft").exists() && at(link).is_symlink());
        }
        std::os::unix::fs::symlink("circle", at("circle")).unwrap();
        let error = format!("{:#}", write(&at("circle"), "").unwrap_err());
        assert!(error.contains("a symbolic link that leads to itself"), "{error}");
        let error = format!("{:#}", write(&at("far"), "").unwrap_err());
        assert!(error.ends_with("cannot be written: it is a directory"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn writing_to_a_named_pipe_sends_all_bytes_and_keeps_the_pipe() {
        use std::os::unix::fs::FileTypeExt;
        let directory = tempfile::tempdir().unwrap();
        let pipe = directory.path().join("a.csv");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for k in 0..2 {
            let reader = std::thread::spawn({
                let pipe = pipe.clone();
                move || fs::read(pipe).unwrap()
            });
            let bytes = vec![b'x'; 200_000]; // more than a pipe holds
            match k {
                0 => write(&pipe, &bytes).unwrap(),
                _ => {
                    let draft = directory.path().join("draft");
                    fs::write(&draft, &bytes).unwrap();
                    publish_draft(&draft, &pipe).unwrap();
                    assert!(!draft.exists());
                }
            }
            assert_eq!(reader.join().unwrap(), bytes);
            assert!(pipe.symlink_metadata().unwrap().file_type().is_fifo());
        }
    }

    /// Uses a copy of the device `/dev/full`, every write to which fails. Only root can create the
    /// copy; for other users the test checks only that the device is recognised as a device.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_is_written_to_and_its_error_is_reported() {
        use std::os::unix::fs::FileTypeExt;
        let directory = tempfile::tempdir().unwrap();
        let full = directory.path().join("full");
        let made = std::process::Command::new("mknod").arg(&full).args(["c", "1", "7"]).output();
        let is_device = || full.symlink_metadata().is_ok_and(|f| f.file_type().is_char_device());
        if !made.unwrap().status.success() || File::open(&full).is_err() {
            // Without root the test uses the real device through a link, because this user cannot replace it.
            std::os::unix::fs::symlink("/dev/full", &full).unwrap();
            assert_eq!(destination(&full).unwrap(), Destination::Stream);
            return;
        }
        let error = format!("{:#}", write(&full, "bytes").unwrap_err());
        assert!(error.contains("full cannot be written: No space left"), "{error}");
        assert!(is_device());
        let draft = directory.path().join("draft");
        fs::write(&draft, "bytes").unwrap();
        assert!(publish_draft(&draft, &full).is_err() && draft.exists() && is_device());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn writing_to_dev_fd_appends_to_the_open_file() {
        use std::os::fd::AsRawFd;
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("log");
        fs::write(&path, "first ").unwrap();
        let open = File::options().append(true).open(&path).unwrap();
        write(Path::new(&format!("/dev/fd/{}", open.as_raw_fd())), "second").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "first second");
    }
}
