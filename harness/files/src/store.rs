//! A folder of stored runs that one program uses at a time: the directory of a campaign, or of a study by Python's
//! `monte_carlo`.
//!
//! ```text
//! plan.toml, features.csv, …, report.html   of a campaign: published together when the last run is stored
//! study.json, runs.csv                      of a study: seed and ranges from the start; the table with the last run
//! runs/NAME.parquet, runs/000017.json       a run; it gets this name when it is complete
//! manifest.sha256                           SHA-256 of all of these, in the format of `sha256sum --check`
//! .lock                                     locked; its text describes the program that uses the folder
//! .unfinished/                              files that are being written; removed at the start and the end
//! ```
//!
//! The line of a run is added to the manifest before its file gets its final name. A stored run that differs from the
//! last line with its name is therefore damaged. A run without a line comes from another program; if HubSlosh wrote it,
//! the manifest is damaged.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, TryLockError};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result, bail, ensure};

use crate::input;
use crate::output::{self, hash_reader, sha256};
use crate::temporary::{self, Registered};

pub const RUNS: &str = "runs";
pub const MANIFEST: &str = "manifest.sha256";
const LOCK: &str = ".lock";
const UNFINISHED: &str = ".unfinished";
const TABLE: &str = "runs.csv";

/// Kind of a folder with stored runs: a campaign, or a study of `monte_carlo`.
///
/// - `name`, `noun`: the name without and with its article, for messages.
/// - `definition`: name of the file that describes which runs the folder contains: the plan of a
///   campaign, or seed and ranges of a study.
/// - `ending`: ending of the files of the runs.
/// - `elsewhere`: advice in messages if the folder cannot be used, for example "give another
///   folder".
/// - `is_published`: returns true for the names of the files that [`Store::publish`] writes when
///   all runs are stored, for example `report.html`. Outdated files are removed only if they have
///   one of these names, even if the manifest lists others.
#[derive(Debug)]
pub struct Kind {
    name: &'static str,
    noun: &'static str,
    definition: &'static str,
    ending: &'static str,
    elsewhere: &'static str,
    is_published: fn(&str) -> bool,
}

pub const CAMPAIGN: &Kind = &Kind {
    name: "campaign",
    noun: "a campaign",
    definition: "plan.toml",
    ending: "parquet",
    elsewhere: "put this campaign elsewhere (--out DIRECTORY)",
    is_published: |name| {
        let features = name.strip_prefix("features").and_then(|rest| rest.strip_suffix(".csv"));
        matches!(name, "plan.toml" | "report.html" | TABLE | "view.html")
            || features.is_some_and(|rest| rest.chars().all(|c| c.is_alphanumeric() || c == '_'))
    },
};

pub const STUDY: &Kind = &Kind {
    name: "study",
    noun: "a study of monte_carlo",
    definition: "study.json",
    ending: "json",
    elsewhere: "give another folder",
    is_published: |name| name == TABLE,
};

impl Kind {
    pub fn run_file(&self, run: &str) -> String {
        format!("{RUNS}/{run}.{}", self.ending)
    }

    fn is_present_in(&self, path: &Path) -> bool {
        let runs = fs::read_dir(path.join(RUNS)).into_iter().flatten().flatten();
        let is_run = |file: &Path| file.extension().is_some_and(|ending| ending == self.ending);
        path.join(self.definition).exists() || runs.map(|run| run.path()).any(|run| is_run(&run))
    }
}

#[derive(Debug, thiserror::Error)]
pub enum Damage {
    #[error("the file of the run is missing")]
    Missing,
    #[error(
        "the SHA-256 of the file differs from the one in {MANIFEST}: the file is damaged, or another program has replaced it"
    )]
    Changed,
    #[error(
        "the run has no line in {MANIFEST}: the manifest is damaged, and nothing verifies the run"
    )]
    Unlisted,
    #[error("{0}")]
    Unreadable(anyhow::Error),
}

/// Definition of the runs of a study (seed and ranges), with which [`Store::take`] checks that a
/// folder contains runs of the same study.
///
/// - `text`: content of the file with the definition, `study.json`.
/// - `compare`: receives the content of the file that is in the folder. Returns an error if the
///   file defines other runs than `text`.
#[derive(Clone, Copy)]
pub struct Definition<'a> {
    pub text: &'a str,
    pub compare: &'a dyn Fn(&str) -> Result<()>,
}

/// A locked folder with stored runs; it is unlocked when this value is dropped.
///
/// - `lost`: files that are in the manifest but not in the folder.
/// - `is_new`: true if the folder had no manifest when it was locked. HubSlosh has not yet stored a
///   run in such a folder, so that any runs in it were put there by another program.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    kind: &'static Kind,
    unfinished: PathBuf,
    lost: BTreeSet<String>,
    is_new: bool,
    manifest: Mutex<Manifest>,
    process: u32,
    _registered: Registered,
    _lock: File,
}

/// The manifest of a folder: the list of its files with their SHA-256.
///
/// - `file`: the open file `manifest.sha256`, to which lines are appended. It is `None` when
///   nothing more may be appended: after publication, or after writing a line has failed.
/// - `sums`: SHA-256 of each file by its name.
#[derive(Debug)]
struct Manifest {
    file: Option<File>,
    sums: BTreeMap<String, String>,
}

fn lines(sums: &BTreeMap<String, String>) -> String {
    sums.iter().map(|(name, sum)| format!("{sum}  {name}\n")).collect()
}

/// Parses the text of a manifest and returns the SHA-256 of each file by its name. If a name has
/// several lines, the last line counts. An incomplete last line, which a killed program leaves, is
/// ignored.
///
/// # Errors
/// If another line is not in the format of a manifest.
fn sums(text: &str) -> Result<BTreeMap<String, String>> {
    let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
    let pair = |(row, line): (usize, &str)| {
        let is_hash = |sum: &str| {
            sum.len() == 64 && sum.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
        };
        let pair = line.split_once("  ").filter(|(sum, name)| is_hash(sum) && !name.is_empty());
        let (sum, name) = pair.with_context(|| {
            let shown: String = line.chars().take(SHOWN).collect();
            format!("line {} is {shown:?} (allowed: SHA-256, two spaces, name)", row + 1)
        })?;
        Ok((name.to_string(), sum.to_string()))
    };
    whole.lines().enumerate().map(pair).collect()
}

const SHOWN: usize = 120;

fn has_no_runs(path: &Path) -> bool {
    match fs::read_dir(path.join(RUNS)) {
        Ok(mut runs) => runs.next().is_none(),
        Err(error) => error.kind() == ErrorKind::NotFound,
    }
}

/// Reads the manifest of the folder `path`. `is_used` is true if a program has locked the folder
/// before.
///
/// # Errors
/// If the folder contains runs, but the manifest cannot verify them because it is damaged, or
/// because it was removed from a folder that was used before.
fn read_manifest(path: &Path, is_used: bool) -> Result<BTreeMap<String, String>> {
    let place = path.join(MANIFEST);
    let read = || -> Result<BTreeMap<String, String>> {
        if fs::symlink_metadata(&place).is_err() {
            ensure!(!is_used, "it is missing");
            return Ok(BTreeMap::new());
        }
        sums(&input::text(&place)?)
    };
    match read() {
        Err(error) if !has_no_runs(path) => Err(error.context(format!(
            "{} is damaged or missing, so nothing verifies the stored runs; restore it, or remove {} to simulate all \
             runs again",
            place.display(),
            path.join(RUNS).display()
        ))),
        sums => Ok(sums.unwrap_or_default()),
    }
}

impl Definition<'_> {
    fn check(&self, path: &Path, kind: &Kind) -> Result<()> {
        let place = path.join(kind.definition);
        if place.exists() {
            let text = input::text(&place);
            return (self.compare)(
                &text.with_context(|| format!("{} cannot be read", place.display()))?,
            );
        }
        ensure!(
            has_no_runs(path) && !path.join(TABLE).exists(),
            "{} has {TABLE} or {RUNS}/ but no {definition}: it is not the folder of {}, or \
             {definition} was removed; {}",
            path.display(),
            kind.noun,
            kind.elsewhere,
            definition = kind.definition
        );
        Ok(())
    }
}

impl Store {
    /// Locks the folder `path` for stored runs of this kind, and creates it if it does not exist.
    /// `about` tells other programs why the folder is locked. For a study the `definition` is
    /// compared with the file in the folder, or written there. A campaign passes `None`, because
    /// its plan is written only when the campaign is complete, by [`Store::publish`].
    ///
    /// # Errors
    /// If another program has locked the folder, the folder contains runs of another kind or of
    /// another definition, or its manifest is damaged. After an error nothing in the folder has
    /// changed, except for the lock.
    pub fn take(
        path: &Path,
        kind: &'static Kind,
        about: &str,
        definition: Option<Definition>,
    ) -> Result<Store> {
        let other = if kind.name == CAMPAIGN.name { STUDY } else { CAMPAIGN };
        ensure!(
            !other.is_present_in(path),
            "{} holds {}; {}",
            path.display(),
            other.noun,
            kind.elsewhere
        );
        if let Some(definition) = &definition {
            definition.check(path, kind)?;
        }
        output::directory(&path.join(RUNS))?;
        let traces = [LOCK, kind.definition, TABLE, "report.html"];
        let is_used = traces.iter().any(|name| path.join(name).exists());
        let lock = hold(path, kind, about)?;
        let listed = read_manifest(path, is_used)?;
        let place = path.join(MANIFEST);
        let is_new = !place.exists();
        let unfinished = path.join(UNFINISHED);
        if unfinished.exists() {
            fs::remove_dir_all(&unfinished)
                .with_context(|| format!("{} cannot be removed", unfinished.display()))?;
        }
        output::directory(&unfinished)?;
        let registered = temporary::register(&unfinished);
        let (found, lost): (BTreeMap<_, _>, BTreeMap<_, _>) =
            listed.into_iter().partition(|(name, _)| path.join(name).is_file());
        let text = lines(&found);
        if fs::read(&place).ok().is_none_or(|there| there != text.as_bytes()) {
            output::write(&place, text.as_bytes())?;
        }
        let file = File::options().append(true).create(true).open(&place);
        let file = file.with_context(|| format!("{} cannot be written", place.display()))?;
        let store = Store {
            path: path.to_path_buf(),
            kind,
            unfinished,
            lost: lost.into_keys().collect(),
            is_new,
            manifest: Mutex::new(Manifest { file: Some(file), sums: found }),
            process: std::process::id(),
            _registered: registered,
            _lock: lock,
        };
        if let Some(definition) = definition {
            // Before this program got the lock, another program may have written a definition.
            definition.check(path, kind)?;
            let text = definition.text.as_bytes();
            let is_there = fs::read(path.join(kind.definition)).is_ok_and(|there| there == text);
            match is_there {
                true => store.add_to_manifest(kind.definition, sha256(text))?,
                false => store.write(kind.definition, |draft| output::write(draft, text))?,
            }
        }
        Ok(store)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn run(&self, run: &str) -> PathBuf {
        self.path.join(self.kind.run_file(run))
    }

    pub fn lists(&self, run: &str) -> bool {
        self.manifest().sums.contains_key(&self.kind.run_file(run))
    }

    /// Returns the SHA-256 of the stored run `run`, or `None` if the run was never stored. A file
    /// without a line in the manifest is accepted only if another program has put it into the
    /// folder: if the folder had no manifest when it was locked, or if `is_ours`, which receives
    /// the path, returns false because HubSlosh has not written the file.
    ///
    /// # Errors
    /// If the file differs from the file that was stored.
    pub fn check(
        &self,
        run: &str,
        is_ours: impl FnOnce(&Path) -> bool,
    ) -> Result<Option<String>, Damage> {
        let sum = self.read_checked(run, is_ours, |path| {
            let sum = hash_reader(input::open(path)?)?;
            Ok((sum.clone(), sum))
        })?;
        Ok(sum)
    }

    /// Returns the content of the stored run `run`, or `None` if the run was never stored. It is
    /// for kinds of folders to which only HubSlosh writes, so that each run must have a line in the
    /// manifest.
    ///
    /// # Errors
    /// If the file differs from the file that was stored.
    pub fn read(&self, run: &str) -> Result<Option<Vec<u8>>, Damage> {
        let read = |path: &Path| {
            let bytes = input::bytes(path)?;
            Ok((sha256(&bytes), bytes))
        };
        self.read_checked(run, |_| true, read)
    }

    /// Calls `read` with the path of the stored run `run`. `read` returns the SHA-256 of the file,
    /// which is compared with the manifest, and the extracted content, which is then returned. For
    /// `is_ours` see [`Store::check`].
    fn read_checked<T>(
        &self,
        run: &str,
        is_ours: impl FnOnce(&Path) -> bool,
        read: impl FnOnce(&Path) -> Result<(String, T)>,
    ) -> Result<Option<T>, Damage> {
        let (file, path) = (self.kind.run_file(run), self.run(run));
        if fs::symlink_metadata(&path).is_err() {
            return if self.lost.contains(&file) { Err(Damage::Missing) } else { Ok(None) };
        }
        let read = read(&path).with_context(|| format!("{} cannot be read", path.display()));
        let (found, content) = read.map_err(Damage::Unreadable)?;
        match self.manifest().sums.get(&file) {
            Some(sum) if *sum != found => Err(Damage::Changed),
            None if !self.is_new && is_ours(&path) => Err(Damage::Unlisted),
            _ => Ok(Some(content)),
        }
    }

    pub fn adopt(&self, run: &str, sum: String) -> Result<()> {
        self.add_to_manifest(&self.kind.run_file(run), sum)
    }

    /// Stores a run in the folder. `write` receives a path and writes the file of the run there.
    /// When this function returns, the run is on the disk.
    pub fn add(&self, run: &str, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        let stored = self.write(&self.kind.run_file(run), write);
        stored.with_context(|| format!("{} cannot be stored", self.run(run).display()))
    }

    /// Writes `file` into the folder. First `write` writes a temporary file, then the SHA-256 is
    /// added to the manifest, and then the file gets its name. If the program is killed in between,
    /// every file in the folder therefore has a line in the manifest.
    fn write(&self, file: &str, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        let place = self.path.join(file);
        input::check_replaceable(&place)?;
        let draft = self.unfinished.join(place.file_name().unwrap_or_default());
        write(&draft)?;
        self.add_to_manifest(file, sha256(&fs::read(&draft)?))?;
        output::publish_draft(&draft, &place)
    }

    pub fn publish(self, files: Vec<(&str, Vec<u8>)>) -> Result<()> {
        for (name, bytes) in &files {
            let place = self.path.join(name);
            // If a plan is executed from its own place in the folder, the file is already there and is not written again.
            if !input::bytes(&place).is_ok_and(|there| there == *bytes) {
                input::check_replaceable(&place)?;
            }
        }
        let mut manifest = self.manifest();
        let is_published = self.kind.is_published;
        let kept = manifest.sums.iter().filter(|(name, _)| !is_published(name));
        let is_ours =
            |name: &str| Path::new(name).starts_with(RUNS) || name == self.kind.definition;
        let kept = kept.filter(|(name, _)| is_ours(name));
        let mut sums: BTreeMap<String, String> =
            kept.map(|(name, sum)| (name.clone(), sum.clone())).collect();
        sums.extend(files.iter().map(|(name, bytes)| (name.to_string(), sha256(bytes))));
        let text = lines(&sums).into_bytes();
        // A full disk must be detected before any file is replaced.
        let all = files.into_iter().chain([(MANIFEST, text)]);
        let names = all.map(|(name, bytes)| {
            let wrote = output::write(&self.unfinished.join(name), &bytes);
            let place = self.path.join(name);
            wrote.with_context(|| format!("{} cannot be published", place.display()))?;
            Ok(name)
        });
        let names = names.collect::<Result<Vec<_>>>()?;
        // Windows cannot rename a file to the name of an open file.
        drop(manifest.file.take());
        let gone =
            manifest.sums.keys().filter(|name| is_published(name) && !sums.contains_key(*name));
        let publish = || -> Result<()> {
            for name in gone {
                let _ = fs::remove_file(self.path.join(name));
            }
            for name in names {
                output::publish_draft(&self.unfinished.join(name), &self.path.join(name))?;
            }
            Ok(())
        };
        temporary::uninterrupted(publish)?;
        #[cfg(unix)] // the names, too; elsewhere a directory is not a file
        let _ = File::open(&self.path).and_then(|directory| directory.sync_all());
        manifest.sums = sums;
        Ok(())
    }

    fn manifest(&self) -> std::sync::MutexGuard<'_, Manifest> {
        self.manifest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn add_to_manifest(&self, file: &str, sum: String) -> Result<()> {
        let mut manifest = self.manifest();
        if manifest.sums.get(file) == Some(&sum) {
            return Ok(());
        }
        let line = format!("{sum}  {file}\n");
        let name = self.path.join(MANIFEST);
        let name = name.display();
        let place = manifest.file.as_mut();
        let place = place.with_context(|| {
            format!(
                "{name} takes no further lines, because the folder is closed or an earlier line \
                 could not be written"
            )
        })?;
        let added = place.write_all(line.as_bytes()).and_then(|()| place.sync_data());
        if added.is_err() {
            // No further line is written, because an incomplete line must be the last one.
            manifest.file = None;
        }
        added.with_context(|| format!("{name} cannot be written"))?;
        manifest.sums.insert(file.to_string(), sum);
        Ok(())
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        // After a fork, the child also has the store, but the folder belongs to the process that locked it.
        if std::process::id() == self.process {
            let _ = fs::remove_dir_all(&self.unfinished);
        }
    }
}

fn hold(path: &Path, kind: &Kind, about: &str) -> Result<File> {
    let place = path.join(LOCK);
    let name = place.display();
    ensure!(!place.exists() || place.is_file(), "{name} is not a regular file; remove it");
    let open = File::options().create(true).write(true).truncate(false).open(&place);
    let mut lock = open.with_context(|| format!("{name} cannot be written"))?;
    match lock.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            // On Windows a locked file cannot be read.
            let who = fs::read_to_string(&place).unwrap_or_default();
            let who = who.trim();
            let since = place.metadata().and_then(|file| file.modified()).ok();
            let age = since.and_then(|since| since.elapsed().ok()).unwrap_or_default().as_secs();
            bail!(
                "{} is in use by another {}{}{who}, for {age} s; wait for its end, or {}",
                path.display(),
                kind.name,
                if who.is_empty() { "" } else { ": " },
                kind.elsewhere
            );
        }
        Err(TryLockError::Error(error)) => {
            return Err(error).with_context(|| format!("{name} cannot be locked"));
        }
    }
    lock.set_len(0)?;
    write!(lock, "process {}, {about}", std::process::id())
        .with_context(|| format!("{name} cannot be written"))?;
    Ok(lock)
}
