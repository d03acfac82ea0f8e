//! Reads the input files of commands. Only regular files are read, up to a size limit, because a named pipe or a device
//! could block the command, or never end.
//!
//! Files that the user names as inputs are protected: [`crate::output`] refuses to replace them.

use std::fs::{File, Metadata};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Result, bail, ensure};

use crate::budget;

/// Opens a regular file for reading. A symbolic link is followed.
///
/// # Errors
/// If the file cannot be opened or is not a regular file, for example a named pipe, at which
/// reading could wait forever. The message does not repeat the path, because the callers add it.
pub fn open(path: &Path) -> Result<File> {
    let kind = path.metadata()?;
    // The kind of the file is checked before `File::open`, which would wait until somebody writes to a named pipe.
    if !kind.is_file() {
        bail!("the path is {} (allowed: a regular file)", file_kind(&kind));
    }
    let file = File::open(path)?;
    let mut all = READ.lock().unwrap_or_else(PoisonError::into_inner);
    if all.len() < MOST_NAMED && !all.iter().any(|other| other == path) {
        all.push(path.to_path_buf());
    }
    Ok(file)
}

const MOST_NAMED: usize = 20;

static READ: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

pub fn read_so_far() -> Vec<String> {
    let all = READ.lock().unwrap_or_else(PoisonError::into_inner);
    all.iter().map(|path| path.display().to_string()).collect()
}

/// Reads the file at `path`, which may have at most [`budget::TEXT`] bytes.
///
/// # Errors
/// If the file cannot be read, is not a regular file or is too large.
pub fn bytes(path: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.take(budget::TEXT + 1).read_to_end(&mut bytes)?;
    ensure!(
        bytes.len() as u64 <= budget::TEXT,
        "the file is larger than {} MB (allowed: at most this size)",
        budget::TEXT / 1_000_000
    );
    Ok(bytes)
}

pub fn text(path: &Path) -> Result<String> {
    String::from_utf8(bytes(path)?).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        anyhow::anyhow!("byte {} is not UTF-8 (allowed: text in UTF-8)", at + 1)
    })
}

/// Removes the numbers of system errors, such as `(os error 2)`, from a message, because the words
/// before a number say the same and the number helps no user.
pub fn without_error_numbers(message: &str) -> String {
    let mut parts = message.split(" (os error ");
    let mut text = parts.next().unwrap_or_default().to_string();
    for part in parts {
        match part.split_once(')') {
            Some((number, rest)) if number.bytes().all(|byte| byte.is_ascii_digit()) => {
                text += rest
            }
            _ => text += &format!(" (os error {part}"),
        }
    }
    text
}

fn file_kind(metadata: &Metadata) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        let kind = metadata.file_type();
        if kind.is_fifo() {
            return "a named pipe";
        }
        if kind.is_char_device() || kind.is_block_device() {
            return "a device";
        }
        if kind.is_socket() {
            return "a socket";
        }
    }
    if metadata.is_dir() { "a directory" } else { "a special file" }
}

/// Identity of a file, by which two paths that lead to one file are recognised. On systems other
/// than Unix it is the full path, so that two hard links count as different files.
#[derive(PartialEq)]
struct Identity(#[cfg(unix)] (u64, u64), #[cfg(not(unix))] PathBuf);

fn identity(path: &Path) -> Option<Identity> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let metadata = path.metadata().ok()?;
        Some(Identity((metadata.dev(), metadata.ino())))
    }
    #[cfg(not(unix))]
    path.canonicalize().ok().map(Identity)
}

/// An input file that no output may replace. The file stays open, because otherwise the system
/// could give the number of a deleted input to a new file.
struct Protected {
    identity: Identity,
    path: PathBuf,
    _open: Option<File>,
}

static PROTECTED: Mutex<Vec<Protected>> = Mutex::new(Vec::new());

/// Protects an input: from now on no output of this process replaces the file at `path`. If there
/// is no file, nothing happens.
pub fn protect(path: &Path) {
    if !path.is_file() {
        return;
    }
    if let Some(identity) = identity(path) {
        let mut all = PROTECTED.lock().unwrap_or_else(PoisonError::into_inner);
        if !all.iter().any(|other| other.identity == identity) {
            let open = if cfg!(unix) { File::open(path).ok() } else { None };
            all.push(Protected { identity, path: path.to_path_buf(), _open: open });
        }
    }
}

/// Checks that an output to `path` would not replace a protected input. Relative paths, symbolic
/// links and hard links are followed.
///
/// # Errors
/// If `path` leads to a protected input; the message names both paths.
pub fn check_replaceable(path: &Path) -> Result<()> {
    let Some(identity) = identity(path) else { return Ok(()) };
    let all = PROTECTED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(input) = all.iter().find(|other| other.identity == identity) {
        bail!(
            "{} is not written: it is the input {} (allowed: an output that is not an input of the same command)",
            path.display(),
            input.path.display()
        );
    }
    Ok(())
}
