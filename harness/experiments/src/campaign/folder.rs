//! A campaign's directory, locked by one campaign at a time.
//!
//! ```text
//! plan.toml, features.csv, …, report.html   published together when the last run is there
//! runs/NAME.parquet                         each under its name when it is whole
//! manifest.sha256                           SHA-256 of all of these, as `sha256sum --check` reads it
//! .lock                                     locked, with who holds the directory
//! .unfinished/                              what is being written; removed at the start and the end
//! ```
//!
//! A run's line is added to the manifest before its file gets its final name. A stored run that differs from the last
//! line with its name is therefore damaged. A run without a line comes from another program; if HubSlosh wrote it, the
//! manifest is damaged. The folder of a study has the same layout (`harness/python/hubslosh/store.py`).

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result, bail, ensure};
use files::input;
use files::output::{self, sha256, sha256_of};
use files::temporary::{self, Registered};
use signals::table::{self, Table};

/// Folder of the stored runs.
pub const RUNS: &str = "runs";
/// The hashes of all files.
pub const MANIFEST: &str = "manifest.sha256";
const LOCK: &str = ".lock";
/// Description of a study by Python's `monte_carlo`.
const STUDY: &str = "study.json";
const UNFINISHED: &str = ".unfinished";

/// A campaign's directory, until this is dropped.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    unfinished: PathBuf,
    /// Files that are in the manifest, but not in the directory.
    lost: BTreeSet<String>,
    /// True if no campaign was in the directory before, so that all runs come from other programs.
    is_new: bool,
    manifest: Mutex<Manifest>,
    _registered: Registered,
    _lock: File,
}

/// The hashes of the files, by name, and the manifest file.
#[derive(Debug)]
struct Manifest {
    /// `None` after publication, and after a line that could not be written.
    file: Option<File>,
    sums: BTreeMap<String, String>,
}

/// Returns the file's lines in the format of `sha256sum`.
fn lines(sums: &BTreeMap<String, String>) -> String {
    sums.iter().map(|(name, sum)| format!("{sum}  {name}\n")).collect()
}

/// Returns the last hash of each name. A line that a kill has cut off does not count.
///
/// # Errors
/// Another line is not in the format of a manifest.
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

/// Number of characters of a damaged line in a message.
const SHOWN: usize = 120;

/// Reads the bytes of a regular file. Reading a pipe, for example, might never end.
fn bytes(path: &Path) -> Result<Vec<u8>> {
    let read = || {
        ensure!(path.metadata()?.is_file(), "it is not a regular file");
        Ok(fs::read(path)?)
    };
    read().with_context(|| format!("{} cannot be read", path.display()))
}

/// Reads a directory's manifest.
///
/// # Errors
/// Nothing verifies the stored runs: the manifest is damaged, or it is missing although a campaign
/// was here before.
fn read_manifest(path: &Path) -> Result<BTreeMap<String, String>> {
    let runs = path.join(RUNS);
    let entries = fs::read_dir(&runs).with_context(|| format!("{} cannot be read", runs.display()));
    let has_runs = entries?.next().is_some();
    let place = path.join(MANIFEST);
    let read = || -> Result<BTreeMap<String, String>> {
        if fs::symlink_metadata(&place).is_err() {
            let traces = [LOCK, "plan.toml", "runs.csv", "report.html"];
            let was_here = traces.iter().any(|name| path.join(name).exists());
            ensure!(!was_here, "it is missing");
            return Ok(BTreeMap::new());
        }
        sums(std::str::from_utf8(&bytes(&place)?)?)
    };
    match read() {
        Err(error) if has_runs => Err(error.context(format!(
            "{} is damaged, so nothing verifies the stored runs; restore it, or remove {} to \
             simulate all runs again",
            place.display(),
            runs.display()
        ))),
        sums => Ok(sums.unwrap_or_default()),
    }
}

/// Returns the name of a run's file in the directory.
pub fn file_of(run: &str) -> String {
    format!("{RUNS}/{run}.parquet")
}

impl Folder {
    /// Creates the directory if it does not exist, and locks it. Other processes that want to lock it get `about` as
    /// the reason.
    ///
    /// # Errors
    /// Another campaign has locked it, it belongs to a study, or its manifest is damaged.
    pub fn take(path: &Path, about: &str) -> Result<Folder> {
        ensure!(
            !path.join(STUDY).exists(),
            "{} holds a study of monte_carlo; put this campaign elsewhere (--out DIRECTORY)",
            path.display()
        );
        output::directory(&path.join(RUNS))?;
        let listed = read_manifest(path)?;
        let is_new = !path.join(MANIFEST).exists();
        let lock = hold(path, about)?;
        let unfinished = path.join(UNFINISHED);
        if unfinished.exists() {
            fs::remove_dir_all(&unfinished)
                .with_context(|| format!("{} cannot be removed", unfinished.display()))?;
        }
        output::directory(&unfinished)?;
        let registered = temporary::register(&unfinished);
        let place = path.join(MANIFEST);
        let (found, lost): (BTreeMap<_, _>, BTreeMap<_, _>) =
            listed.into_iter().partition(|(name, _)| path.join(name).is_file());
        let text = lines(&found);
        if fs::read(&place).ok().is_none_or(|there| there != text.as_bytes()) {
            output::write(&place, text.as_bytes())?;
        }
        let file = File::options().append(true).create(true).open(&place);
        let file = file.with_context(|| format!("{} cannot be written", place.display()))?;
        Ok(Folder {
            path: path.to_path_buf(),
            unfinished,
            lost: lost.into_keys().collect(),
            is_new,
            manifest: Mutex::new(Manifest { file: Some(file), sums: found }),
            _registered: registered,
            _lock: lock,
        })
    }

    /// Path of the campaign's directory.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file of a stored run.
    pub fn run(&self, run: &str) -> PathBuf {
        self.path.join(file_of(run))
    }

    /// Returns true if a run was stored and is missing now.
    pub fn lacks(&self, run: &str) -> bool {
        self.lost.contains(&file_of(run)) && !self.run(run).exists()
    }

    /// Returns true if a run is in the manifest.
    pub fn lists(&self, run: &str) -> bool {
        self.manifest().sums.contains_key(&file_of(run))
    }

    /// Returns the SHA-256 of a stored run, or the reason if it is not the stored file. A run of another program is
    /// accepted the first time.
    pub fn check(&self, run: &str) -> Result<String, String> {
        let file = file_of(run);
        let found = self.hash(&file).map_err(|error| error.to_string())?;
        match self.manifest().sums.get(&file) {
            Some(sum) if *sum != found => Err(format!(
                "its SHA-256 is not that in {MANIFEST}; it is damaged, or another program replaced it"
            )),
            Some(_) => Ok(found),
            None if !self.is_new && is_ours(&self.path.join(&file)) => Err(format!(
                "it has no line in {MANIFEST}, which is damaged; nothing verifies the run"
            )),
            None => Ok(found),
        }
    }

    /// Adds a run to the manifest, for runs that another program has stored.
    pub fn adopt(&self, run: &str, sum: String) -> Result<()> {
        self.add(file_of(run), sum)
    }

    /// Stores a run.
    pub fn store(&self, run: &str, table: &Table, recipe: &BTreeMap<String, String>) -> Result<()> {
        let (file, draft) = (file_of(run), self.unfinished.join(format!("{run}.parquet")));
        let store = || -> Result<()> {
            input::check_replaceable(&self.path.join(&file))?;
            table.write(&draft, recipe)?;
            self.add(file.clone(), sha256(&fs::read(&draft)?))?;
            output::put(&draft, &self.path.join(&file))
        };
        store().with_context(|| format!("{} cannot be stored", self.path.join(&file).display()))
    }

    /// Publishes files by name, and the manifest. Removes files that an earlier campaign published
    /// and this one does not.
    pub fn publish(self, files: Vec<(&str, Vec<u8>)>) -> Result<()> {
        for (name, bytes) in &files {
            let place = self.path.join(name);
            // a plan that is executed in its own place is not rewritten
            if !input::bytes(&place).is_ok_and(|there| there == *bytes) {
                input::check_replaceable(&place)?;
            }
        }
        let mut manifest = self.manifest();
        let runs = manifest.sums.iter().filter(|(name, _)| name.starts_with(RUNS));
        let mut sums: BTreeMap<String, String> =
            runs.map(|(name, sum)| (name.clone(), sum.clone())).collect();
        sums.extend(files.iter().map(|(name, bytes)| (name.to_string(), sha256(bytes))));
        let text = lines(&sums).into_bytes();
        // a full disk is detected before any file is replaced
        let all = files.into_iter().chain([(MANIFEST, text)]);
        let names = all.map(|(name, bytes)| {
            let wrote = output::write(&self.unfinished.join(name), &bytes);
            let place = self.path.join(name);
            wrote.with_context(|| format!("{} cannot be published", place.display()))?;
            Ok(name)
        });
        let names = names.collect::<Result<Vec<_>>>()?;
        // Windows does not rename a file to the name of an open file
        drop(manifest.file.take());
        let gone =
            manifest.sums.keys().filter(|name| is_published(name) && !sums.contains_key(*name));
        let publish = || -> Result<()> {
            for name in gone {
                let _ = fs::remove_file(self.path.join(name));
            }
            for name in names {
                output::put(&self.unfinished.join(name), &self.path.join(name))?;
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

    fn hash(&self, file: &str) -> Result<String> {
        let path = self.path.join(file);
        let hash = input::open(&path).and_then(sha256_of);
        hash.with_context(|| format!("{} cannot be read", path.display()))
    }

    fn add(&self, file: String, sum: String) -> Result<()> {
        let mut manifest = self.manifest();
        if manifest.sums.get(&file) == Some(&sum) {
            return Ok(());
        }
        let line = format!("{sum}  {file}\n");
        let name = self.path.join(MANIFEST);
        let name = name.display();
        let place = manifest.file.as_mut();
        let place = place.with_context(|| format!("{name} is closed, or could not be written"))?;
        let added = place.write_all(line.as_bytes()).and_then(|()| place.sync_data());
        if added.is_err() {
            // no other line may follow an incomplete line
            manifest.file = None;
        }
        added.with_context(|| format!("{name} cannot be written"))?;
        manifest.sums.insert(file, sum);
        Ok(())
    }
}

/// Returns true if HubSlosh wrote a run. Its Parquet files name their library, which importers in other
/// languages do not use.
fn is_ours(run: &Path) -> bool {
    table::writer(run).is_none_or(|writer| writer.starts_with("parquet-rs"))
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.unfinished);
    }
}

/// Locks a directory.
fn hold(path: &Path, about: &str) -> Result<File> {
    let place = path.join(LOCK);
    let name = place.display();
    ensure!(!place.exists() || place.is_file(), "{name} is not a regular file; remove it");
    let open = File::options().create(true).write(true).truncate(false).open(&place);
    let mut lock = open.with_context(|| format!("{name} cannot be written"))?;
    match lock.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            // Windows does not allow reading a locked file
            let who = fs::read_to_string(&place).unwrap_or_default();
            let who = who.trim();
            let since = place.metadata().and_then(|file| file.modified()).ok();
            let age = since.and_then(|since| since.elapsed().ok()).unwrap_or_default().as_secs();
            bail!(
                "{} is held by another campaign{}{who}, for {age} s; wait for its end, or put this \
                 one elsewhere (--out DIRECTORY)",
                path.display(),
                if who.is_empty() { "" } else { ": " }
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

/// Returns true for names of files that a campaign publishes. No other file is removed, whatever
/// the manifest lists.
fn is_published(name: &str) -> bool {
    let features = name.strip_prefix("features").and_then(|rest| rest.strip_suffix(".csv"));
    matches!(name, "plan.toml" | "report.html" | "runs.csv" | "view.html")
        || features.is_some_and(|rest| rest.chars().all(|c| c.is_alphanumeric() || c == '_'))
}

#[cfg(test)]
mod tests {
    use super::{Folder, MANIFEST};
    use files::output::sha256;
    use signals::table::Table;
    use std::collections::BTreeMap;
    use std::fs;
    use std::path::Path;

    fn table(value: f64) -> Table {
        Table::new(vec!["time".into()], vec![vec![0.0, value]])
    }

    #[test]
    fn one_campaign_holds_a_directory_and_the_next_hears_of_it() {
        let directory = tempfile::tempdir().unwrap();
        let held = Folder::take(directory.path(), "the plan \"A\"").unwrap();
        let error = Folder::take(directory.path(), "the plan \"B\"").unwrap_err().to_string();
        let who = format!("process {}, the plan \"A\"", std::process::id());
        assert!(error.contains(&who) && error.contains("--out"), "{error}");
        drop(held);
        Folder::take(directory.path(), "the plan \"B\"").unwrap();
    }

    #[test]
    fn a_stored_run_is_what_was_stored_or_the_manifest_says_so() {
        let directory = tempfile::tempdir().unwrap();
        let take = || Folder::take(directory.path(), "").unwrap();
        let folder = take();
        folder.store("a", &table(1.0), &BTreeMap::new()).unwrap();
        folder.store("b", &table(1.0), &BTreeMap::new()).unwrap();
        folder.store("b", &table(2.0), &BTreeMap::new()).unwrap();
        assert!(folder.check("a").is_ok() && folder.check("b").is_ok());
        drop(folder);
        let path = directory.path().join("runs/b.parquet");
        let whole = fs::read(&path).unwrap();
        table(3.0).write(&path, &BTreeMap::new()).unwrap();
        let folder = take();
        let why = folder.check("b").unwrap_err();
        assert!(why.contains("its SHA-256 is not that in manifest.sha256"), "{why}");
        fs::write(&path, whole).unwrap();
        assert!(folder.check("b").is_ok());
        // another program's run, verified from then on
        let other = directory.path().join("runs/c.parquet");
        write_as_another_program(&other, 1.0);
        folder.adopt("c", folder.check("c").unwrap()).unwrap();
        write_as_another_program(&other, 2.0);
        assert!(folder.check("c").is_err());
    }

    /// Writes a run with another library.
    fn write_as_another_program(path: &Path, value: f64) {
        table(value).write(path, &BTreeMap::new()).unwrap();
        let mut bytes = fs::read(path).unwrap();
        let at = bytes.windows(10).rposition(|window| window == b"parquet-rs").unwrap();
        bytes[at..at + 10].copy_from_slice(b"parquet-xx");
        fs::write(path, bytes).unwrap();
    }

    #[test]
    fn a_damaged_manifest_is_an_error_or_its_runs_are_not_verified() {
        let directory = tempfile::tempdir().unwrap();
        let take = || Folder::take(directory.path(), "");
        let folder = take().unwrap();
        for run in ["a", "b", "c"] {
            folder.store(run, &table(1.0), &BTreeMap::new()).unwrap();
        }
        drop(folder);
        let place = directory.path().join(MANIFEST);
        let good = fs::read_to_string(&place).unwrap();
        let lines: Vec<&str> = good.split_inclusive('\n').collect();
        let zeros = "0".repeat(64);
        let wrong_hash = lines[0].replace(&lines[0][..64], &zeros);
        // content of the manifest, and words of the error or the unverified runs
        type Expected<'a> = Result<&'a [&'a str], &'a str>;
        let cases: [(Vec<u8>, Expected); 11] = [
            (Vec::new(), Ok(&["a", "b", "c"])),
            (lines[1..].concat().into(), Ok(&["a"])),
            (good.as_bytes()[..good.len() - 5].to_vec(), Ok(&["c"])),
            (good.replace("  runs/b", " runs/b").into(), Err("line 2 is ")),
            (good.replacen('\n', "\nxx\n", 1).into(), Err("line 2 is \"xx\"")),
            (good.replacen(&good[..9], "not a sum", 1).into(), Err("line 1 is \"not a sum")),
            (good.to_uppercase().into(), Err("line 1 is ")),
            ([b"\xff", good.as_bytes()].concat(), Err("utf-8")),
            (format!("{good}{wrong_hash}").into(), Ok(&["a"])),
            (format!("{wrong_hash}{good}").into(), Ok(&[])),
            (good.replace('\n', "\r\n").into(), Ok(&[])),
        ];
        for (bytes, expected) in cases {
            let text = String::from_utf8_lossy(&bytes).into_owned();
            fs::write(&place, bytes).unwrap();
            match (take(), expected) {
                (Err(error), Err(words)) => {
                    let error = format!("{error:#}");
                    assert!(error.contains(words), "{error}");
                    assert!(error.contains("nothing verifies the stored runs"), "{error}");
                    assert_eq!(String::from_utf8_lossy(&fs::read(&place).unwrap()), text);
                }
                (Ok(folder), Ok(unverified)) => {
                    let wrong =
                        ["a", "b", "c"].into_iter().filter(|run| folder.check(run).is_err());
                    assert_eq!(wrong.collect::<Vec<_>>(), unverified, "{text}");
                }
                (took, _) => panic!("{text}: {took:?}"),
            }
        }
        fs::remove_file(&place).unwrap();
        let error = format!("{:#}", take().unwrap_err());
        assert!(error.contains("it is missing") && error.contains("remove"), "{error}");
        fs::create_dir(&place).unwrap();
        let error = format!("{:#}", take().unwrap_err());
        assert!(error.contains("it is not a regular file"), "{error}");
        // without runs there is nothing to verify
        fs::remove_dir(&place).unwrap();
        fs::remove_dir_all(directory.path().join("runs")).unwrap();
        take().unwrap();
    }

    #[test]
    fn a_run_that_is_in_the_manifest_and_not_in_the_directory_is_missing() {
        let directory = tempfile::tempdir().unwrap();
        let take = || Folder::take(directory.path(), "").unwrap();
        take().store("a", &table(1.0), &BTreeMap::new()).unwrap();
        fs::remove_file(directory.path().join("runs/a.parquet")).unwrap();
        let folder = take();
        assert!(folder.lacks("a") && !folder.lacks("b"));
        folder.store("a", &table(1.0), &BTreeMap::new()).unwrap();
        assert!(!folder.lacks("a") && folder.lists("a"));
    }

    #[test]
    fn the_folder_of_a_study_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        fs::write(directory.path().join("study.json"), "{}").unwrap();
        let error = Folder::take(directory.path(), "").unwrap_err().to_string();
        assert!(error.contains("holds a study of monte_carlo"), "{error}");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_line_that_was_cut_off_is_none_and_the_next_start_writes_the_manifest_anew() {
        let directory = tempfile::tempdir().unwrap();
        let take = || Folder::take(directory.path(), "").unwrap();
        take().store("a", &table(1.0), &BTreeMap::new()).unwrap();
        let place = directory.path().join(MANIFEST);
        let text = fs::read_to_string(&place).unwrap();
        let gone = text.replace("runs/a", "runs/gone");
        fs::write(&place, format!("{gone}{text}{}", &text[..70])).unwrap();
        drop(take());
        assert_eq!(fs::read_to_string(&place).unwrap(), text);
    }

    #[test]
    fn what_is_published_is_in_the_manifest_and_what_is_not_is_gone() {
        let directory = tempfile::tempdir().unwrap();
        let publish = |files: Vec<(&str, Vec<u8>)>| {
            Folder::take(directory.path(), "").unwrap().publish(files).unwrap()
        };
        publish(vec![("plan.toml", b"A".to_vec()), ("features.csv", b"1".to_vec())]);
        publish(vec![("plan.toml", b"B".to_vec()), ("runs.csv", b"2".to_vec())]);
        let text = fs::read_to_string(directory.path().join(MANIFEST)).unwrap();
        assert_eq!(text, format!("{}  plan.toml\n{}  runs.csv\n", sha256(b"B"), sha256(b"2")));
        let names = fs::read_dir(directory.path()).unwrap();
        let mut names: Vec<_> = names.map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, [".lock", MANIFEST, "plan.toml", "runs", "runs.csv"]);
    }

    #[test]
    fn what_is_no_campaigns_is_left_alone_whatever_the_manifest_says() {
        let directory = tempfile::tempdir().unwrap();
        let out = directory.path().join("out");
        fs::create_dir(&out).unwrap();
        let others = [directory.path().join("precious.csv"), out.join("notes.txt")];
        for place in &others {
            fs::write(place, "mine").unwrap();
        }
        let sum = sha256(b"mine");
        let names = ["../precious.csv", "notes.txt", "features_old.csv", "../features.csv"];
        fs::write(out.join("features_old.csv"), "an older campaign's").unwrap();
        let lines: String = names.iter().map(|name| format!("{sum}  {name}\n")).collect();
        fs::write(out.join(MANIFEST), lines).unwrap();
        Folder::take(&out, "").unwrap().publish(vec![("plan.toml", b"A".to_vec())]).unwrap();
        assert!(others.iter().all(|place| place.exists()));
        assert!(!out.join("features_old.csv").exists());
    }
}
