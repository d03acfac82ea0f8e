//! Temporary folders and incomplete files. They are removed when they are dropped or when a signal ends the program
//! ([`remove_all`]). If a program was killed, the next program that needs a folder removes them.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, Once, PoisonError};

use anyhow::{Context, Result};
use tempfile::TempDir;

static PATHS: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn paths() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    PATHS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A temporary file or folder that is removed if a signal ends the program while this value exists.
#[derive(Debug)]
pub struct Registered(PathBuf);

pub fn register(path: &Path) -> Registered {
    paths().insert(path.to_path_buf());
    Registered(path.to_path_buf())
}

impl Drop for Registered {
    fn drop(&mut self) {
        paths().remove(&self.0);
    }
}

/// Removes all registered files and folders before a signal ends the program. The registry stays
/// locked, so that a thread that registers another file waits until the program has ended.
pub fn remove_all() {
    let paths = paths();
    for path in paths.iter() {
        match path.is_dir() {
            true => drop(fs::remove_dir_all(path)),
            false => drop(fs::remove_file(path)),
        }
    }
    std::mem::forget(paths);
}

/// Runs `work`, and delays signals that would end the program until `work` returns. The list of
/// temporary files is locked meanwhile. `work` must therefore not register a temporary file,
/// because it would wait for this lock forever.
pub fn uninterrupted<T>(work: impl FnOnce() -> T) -> T {
    let _held = paths();
    work()
}

pub const PREFIX: &str = "hubslosh-";
/// Name of a file in each temporary folder that the program locks as long as it runs. The lock
/// shows other programs that the folder is in use.
const ALIVE: &str = "alive";
const FILES: &str = "files";

#[derive(Debug)]
pub struct Folder {
    files: PathBuf,
    // The order of these fields is the order in which they are dropped: Windows cannot remove an open file.
    _alive: File,
    directory: TempDir,
    _registered: Registered,
    process: u32,
}

/// Removes the folder. A forked process does not, because the folder belongs to the process that
/// created it.
impl Drop for Folder {
    fn drop(&mut self) {
        if std::process::id() != self.process {
            self.directory.disable_cleanup(true);
        }
    }
}

impl Folder {
    /// Creates a temporary folder in the system's folder for temporary files. The first call in a
    /// program also removes folders that killed programs have left.
    pub fn new() -> Result<Folder> {
        static SWEPT: Once = Once::new();
        SWEPT.call_once(|| sweep(&std::env::temp_dir(), PREFIX));
        Folder::make(&std::env::temp_dir(), PREFIX)
    }

    pub fn new_in(parent: &Path, prefix: &str) -> Result<Folder> {
        sweep(parent, prefix);
        Folder::make(parent, prefix)
    }

    fn make(parent: &Path, prefix: &str) -> Result<Folder> {
        let make = || -> std::io::Result<Folder> {
            let directory = tempfile::Builder::new().prefix(prefix).tempdir_in(parent)?;
            let registered = register(directory.path());
            // The file is locked before it gets its name, so that no other program finds it unlocked.
            let draft = directory.path().join("draft");
            let alive = File::create(&draft)?;
            // On a system without locks the call fails. No other program can lock the file of this folder either, so
            // that none removes the folder as abandoned.
            let _ = alive.try_lock();
            fs::rename(&draft, directory.path().join(ALIVE))?;
            let files = directory.path().join(FILES);
            fs::create_dir(&files)?;
            let process = std::process::id();
            Ok(Folder { files, _alive: alive, directory, _registered: registered, process })
        };
        make().with_context(|| format!("no temporary folder can be made in {}", parent.display()))
    }

    pub fn path(&self) -> &Path {
        &self.files
    }
}

fn sweep(parent: &Path, prefix: &str) {
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let ours = entry.file_name().to_string_lossy().starts_with(prefix);
        let alive = entry.path().join(ALIVE);
        // Only a regular file is opened, because opening anything else could block.
        let is_file = || fs::symlink_metadata(&alive).is_ok_and(|found| found.is_file());
        if ours && entry.file_type().is_ok_and(|kind| kind.is_dir()) && is_file() {
            let locked = File::open(&alive).map(|file| file.try_lock().is_ok());
            if let Ok(true) = locked {
                let _ = fs::remove_dir_all(entry.path());
            }
        }
    }
}
