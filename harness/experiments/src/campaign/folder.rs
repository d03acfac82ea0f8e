//! A campaign's directory, held by one campaign at a time.
//!
//! ```text
//! plan.toml, features.csv, …, report.html   published together when the last run is there
//! runs/NAME.parquet                         each under its name when it is whole
//! manifest.sha256                           SHA-256 of all of these, as `sha256sum --check` reads it
//! .lock                                     locked, with who holds the directory
//! .unfinished/                              what is being written; removed at the start and the end
//! ```
//!
//! A run's line is added to the manifest before the run gets its name. So a stored run without a line
//! is another program's, and one that differs from the last line with its name is damaged.

use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result, bail};
use host::output::{self, sha256};
use host::temporary::{self, Registered};
use signals::table::Table;

/// Folder of the stored runs.
pub const RUNS: &str = "runs";
/// The hashes of all files.
pub const MANIFEST: &str = "manifest.sha256";
const LOCK: &str = ".lock";
const UNFINISHED: &str = ".unfinished";

/// A campaign's directory, until this is dropped.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    unfinished: PathBuf,
    manifest: Mutex<Manifest>,
    _registered: Registered,
    _lock: File,
}

/// The hashes of the files, by name, and the file in which they are.
#[derive(Debug)]
struct Manifest {
    /// `None` from its publication on.
    file: Option<File>,
    sums: BTreeMap<String, String>,
}

/// The file's lines, as `sha256sum` writes them.
fn lines(sums: &BTreeMap<String, String>) -> String {
    sums.iter().map(|(name, sum)| format!("{sum}  {name}\n")).collect()
}

/// The last hash of each name; a line that a kill cut off is none.
fn sums(text: &str) -> BTreeMap<String, String> {
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    let pair = |line: &str| {
        let (sum, name) = line.split_once("  ").filter(|(sum, _)| sum.len() == 64)?;
        Some((name.to_string(), sum.to_string()))
    };
    whole.lines().filter_map(pair).collect()
}

/// The name of a run's file in the directory.
pub fn file_of(run: &str) -> String {
    format!("{RUNS}/{run}.parquet")
}

impl Folder {
    /// Makes the directory if it is not there, and holds it. `about` is what others are told who
    /// want it too.
    ///
    /// # Errors
    /// If another campaign holds it.
    pub fn take(path: &Path, about: &str) -> Result<Folder> {
        output::directory(&path.join(RUNS))?;
        let lock = hold(path, about)?;
        let unfinished = path.join(UNFINISHED);
        if unfinished.exists() {
            fs::remove_dir_all(&unfinished)
                .with_context(|| format!("{} cannot be removed", unfinished.display()))?;
        }
        output::directory(&unfinished)?;
        let registered = temporary::register(&unfinished);
        let place = path.join(MANIFEST);
        let text = fs::read(&place).unwrap_or_default();
        let text = String::from_utf8_lossy(&text);
        let mut found = sums(&text);
        found.retain(|name, _| path.join(name).is_file());
        if lines(&found) != text {
            output::atomically(&place, |file| Ok(file.write_all(lines(&found).as_bytes())?))?;
        }
        let file = File::options().append(true).create(true).open(&place);
        let file = file.with_context(|| format!("{} cannot be written", place.display()))?;
        Ok(Folder {
            path: path.to_path_buf(),
            unfinished,
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

    /// The SHA-256 of a stored run; the reason, if it is not what was stored. A run of another program
    /// that is seen for the first time is taken as it is.
    pub fn check(&self, run: &str) -> Result<String, String> {
        let file = file_of(run);
        let found = self.hash(&file).map_err(|error| error.to_string())?;
        match self.manifest().sums.get(&file) {
            Some(sum) if *sum != found => Err(format!(
                "its SHA-256 is not that in {MANIFEST}; it is damaged, or another program replaced it"
            )),
            _ => Ok(found),
        }
    }

    /// Adds a run to the manifest, in which it is not if another program has stored it.
    pub fn adopt(&self, run: &str, sum: String) -> Result<()> {
        self.add(file_of(run), sum)
    }

    /// Stores a run.
    pub fn store(&self, run: &str, table: &Table, recipe: &BTreeMap<String, String>) -> Result<()> {
        let (file, draft) = (file_of(run), self.unfinished.join(format!("{run}.parquet")));
        let store = || -> Result<()> {
            table.write(&draft, recipe)?;
            self.add(file.clone(), sha256(&fs::read(&draft)?))?;
            Ok(fs::rename(&draft, self.path.join(&file))?)
        };
        store().with_context(|| format!("{} cannot be stored", self.path.join(&file).display()))
    }

    /// Publishes files by name, and the manifest. What an earlier campaign published and this one
    /// does not is removed.
    pub fn publish(self, files: Vec<(&str, Vec<u8>)>) -> Result<()> {
        let mut manifest = self.manifest();
        let runs = manifest.sums.iter().filter(|(name, _)| name.starts_with(RUNS));
        let mut sums: BTreeMap<String, String> =
            runs.map(|(name, sum)| (name.clone(), sum.clone())).collect();
        sums.extend(files.iter().map(|(name, bytes)| (name.to_string(), sha256(bytes))));
        let text = lines(&sums).into_bytes();
        // a full disk is found out before anything is replaced
        let all = files.into_iter().chain([(MANIFEST, text)]);
        let names = all.map(|(name, bytes)| {
            let wrote =
                output::atomically(&self.unfinished.join(name), |file| Ok(file.write_all(&bytes)?));
            let place = self.path.join(name);
            wrote.with_context(|| format!("{} cannot be published", place.display()))?;
            Ok(name)
        });
        let names = names.collect::<Result<Vec<_>>>()?;
        // Windows renames nothing to the name of a file that is open
        drop(manifest.file.take());
        let gone =
            manifest.sums.keys().filter(|name| is_published(name) && !sums.contains_key(*name));
        let publish = || -> Result<()> {
            for name in gone {
                let _ = fs::remove_file(self.path.join(name));
            }
            for name in names {
                fs::rename(self.unfinished.join(name), self.path.join(name)).with_context(
                    || format!("{} cannot be written", self.path.join(name).display()),
                )?;
            }
            Ok(())
        };
        temporary::uninterrupted(publish)?;
        #[cfg(unix)] // the names, too; elsewhere a directory is no file
        let _ = File::open(&self.path).and_then(|directory| directory.sync_all());
        manifest.sums = sums;
        Ok(())
    }

    fn manifest(&self) -> std::sync::MutexGuard<'_, Manifest> {
        self.manifest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn hash(&self, file: &str) -> Result<String> {
        let path = self.path.join(file);
        let bytes =
            fs::read(&path).with_context(|| format!("{} cannot be read", path.display()))?;
        Ok(sha256(&bytes))
    }

    fn add(&self, file: String, sum: String) -> Result<()> {
        let mut manifest = self.manifest();
        if manifest.sums.get(&file) == Some(&sum) {
            return Ok(());
        }
        let line = format!("{sum}  {file}\n");
        let place = manifest.file.as_mut().context("the campaign is published already")?;
        let added = place.write_all(line.as_bytes());
        added
            .and_then(|()| place.sync_data())
            .with_context(|| format!("{} cannot be written", self.path.join(MANIFEST).display()))?;
        manifest.sums.insert(file, sum);
        Ok(())
    }
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
    let open = File::options().create(true).write(true).truncate(false).open(&place);
    let mut lock = open.with_context(|| format!("{name} cannot be written"))?;
    match lock.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            // Windows lets nobody read a locked file
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

/// Returns true for names of files that a campaign publishes: nothing else is removed, whatever
/// the manifest lists.
fn is_published(name: &str) -> bool {
    let features = name.strip_prefix("features").and_then(|rest| rest.strip_suffix(".csv"));
    matches!(name, "plan.toml" | "report.html" | "runs.csv" | "view.html")
        || features.is_some_and(|rest| rest.chars().all(|c| c.is_alphanumeric() || c == '_'))
}

#[cfg(test)]
mod tests {
    use super::{Folder, MANIFEST};
    use host::output::sha256;
    use signals::table::Table;
    use std::collections::BTreeMap;
    use std::fs;

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
        // another program's, from then on as it was
        let other = directory.path().join("runs/c.parquet");
        table(1.0).write(&other, &BTreeMap::new()).unwrap();
        folder.adopt("c", folder.check("c").unwrap()).unwrap();
        table(2.0).write(&other, &BTreeMap::new()).unwrap();
        assert!(folder.check("c").is_err());
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
