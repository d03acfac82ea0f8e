use anyhow::{Result, ensure};
use files::output::sha256;
use files::store::{CAMPAIGN, Damage, Definition, Kind, MANIFEST, STUDY, Store};
use std::fs;
use std::path::Path;

const KINDS: [&Kind; 2] = [CAMPAIGN, STUDY];

fn same(text: &str) -> Result<()> {
    ensure!(text == "A", "another definition");
    Ok(())
}

fn is_study(kind: &Kind) -> bool {
    kind.run_file("a") == STUDY.run_file("a")
}

fn take(path: &Path, kind: &'static Kind) -> Result<Store> {
    let definition = Definition { text: "A", compare: &same };
    Store::take(path, kind, "here", is_study(kind).then_some(definition))
}

trait Texts {
    fn add_text(&self, run: &str, text: &str);
    fn check_text(&self, run: &str) -> Result<Option<String>, Damage>;
}

impl Texts for Store {
    fn add_text(&self, run: &str, text: &str) {
        self.add(run, |path| Ok(fs::write(path, text)?)).unwrap();
    }

    fn check_text(&self, run: &str) -> Result<Option<String>, Damage> {
        self.check(run, |path| !fs::read_to_string(path).unwrap().starts_with("other"))
    }
}

#[test]
fn a_folder_in_use_is_refused_with_the_process_that_holds_it() {
    for kind in KINDS {
        let directory = tempfile::tempdir().unwrap();
        let held = take(directory.path(), kind).unwrap();
        let error = take(directory.path(), kind).unwrap_err().to_string();
        let (name, elsewhere) = match is_study(kind) {
            true => ("study", "give another folder"),
            false => ("campaign", "put this campaign elsewhere (--out DIRECTORY)"),
        };
        let who = format!("in use by another {name}: process {}, here", std::process::id());
        assert!(error.contains(&who) && error.contains(elsewhere), "{error}");
        drop(held);
        take(directory.path(), kind).unwrap();
    }
}

#[test]
fn a_stored_run_that_was_changed_is_found_by_the_manifest() {
    for kind in KINDS {
        let directory = tempfile::tempdir().unwrap();
        let folder = take(directory.path(), kind).unwrap();
        folder.add_text("a", "1");
        folder.add_text("b", "1");
        folder.add_text("b", "2");
        assert!(folder.check_text("a").unwrap().is_some());
        assert_eq!(folder.read("b").unwrap().unwrap(), b"2");
        assert!(folder.check_text("c").unwrap().is_none() && folder.read("c").unwrap().is_none());
        drop(folder);
        let path = directory.path().join(kind.run_file("b"));
        fs::write(&path, "3").unwrap();
        let folder = take(directory.path(), kind).unwrap();
        for damage in [folder.check_text("b").map(drop), folder.read("b").map(drop)] {
            assert!(matches!(damage, Err(Damage::Changed)), "{damage:?}");
        }
        fs::write(&path, "2").unwrap();
        assert!(folder.check_text("b").is_ok());
        // a run that another program has stored, and that is verified from now on
        let other = directory.path().join(kind.run_file("c"));
        fs::write(&other, "other").unwrap();
        assert!(matches!(folder.read("c"), Err(Damage::Unlisted)));
        folder.adopt("c", folder.check_text("c").unwrap().unwrap()).unwrap();
        fs::write(&other, "other, changed").unwrap();
        assert!(matches!(folder.check_text("c"), Err(Damage::Changed)));
    }
}

#[test]
fn a_folder_with_another_kind_of_runs_or_another_definition_is_refused_and_unchanged() {
    let cases = [
        (CAMPAIGN, "study.json", "holds a study of monte_carlo; put this campaign elsewhere"),
        (CAMPAIGN, "runs/000000.json", "holds a study of monte_carlo"),
        (STUDY, "plan.toml", "holds a campaign; give another folder"),
        (STUDY, "runs/a.parquet", "holds a campaign; give another folder"),
        (STUDY, "runs.csv", "has runs.csv or runs/ but no study.json"),
        (STUDY, "runs/000000.json", "has runs.csv or runs/ but no study.json"),
        (STUDY, "study.json", "another definition"),
    ];
    for (kind, name, words) in cases {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join(name);
        fs::create_dir_all(place.parent().unwrap()).unwrap();
        fs::write(&place, "{}").unwrap();
        let error = format!("{:#}", take(directory.path(), kind).unwrap_err());
        assert!(error.contains(words), "{error}");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
        assert_eq!(fs::read_dir(place.parent().unwrap()).unwrap().count(), 1);
    }
}

#[test]
fn a_damaged_manifest_is_an_error_or_its_runs_are_not_verified() {
    let directory = tempfile::tempdir().unwrap();
    let take = || take(directory.path(), CAMPAIGN);
    let folder = take().unwrap();
    for run in ["a", "b", "c"] {
        folder.add_text(run, "1");
    }
    drop(folder);
    let place = directory.path().join(MANIFEST);
    let good = fs::read_to_string(&place).unwrap();
    let lines: Vec<&str> = good.split_inclusive('\n').collect();
    let zeros = "0".repeat(64);
    let wrong_hash = lines[0].replace(&lines[0][..64], &zeros);
    // the content of the manifest, and the expected words of the error or the expected unverified runs
    type Expected<'a> = Result<&'a [&'a str], &'a str>;
    let cases: [(Vec<u8>, Expected); 11] = [
        (Vec::new(), Ok(&["a", "b", "c"])),
        (lines[1..].concat().into(), Ok(&["a"])),
        (good.as_bytes()[..good.len() - 5].to_vec(), Ok(&["c"])),
        (good.replace("  runs/b", " runs/b").into(), Err("line 2 is ")),
        (good.replacen('\n', "\nxx\n", 1).into(), Err("line 2 is \"xx\"")),
        (good.replacen(&good[..9], "not a sum", 1).into(), Err("line 1 is \"not a sum")),
        (good.to_uppercase().into(), Err("line 1 is ")),
        ([b"\xff", good.as_bytes()].concat(), Err("byte 1 is not UTF-8")),
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
                    ["a", "b", "c"].into_iter().filter(|run| folder.check_text(run).is_err());
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
    assert!(error.contains("the path is a directory"), "{error}");
    // If there are no runs, there is nothing to verify.
    fs::remove_dir(&place).unwrap();
    fs::remove_dir_all(directory.path().join("runs")).unwrap();
    take().unwrap();
}

#[test]
fn a_run_in_the_manifest_without_a_file_in_the_directory_counts_as_missing() {
    let directory = tempfile::tempdir().unwrap();
    let take = || take(directory.path(), CAMPAIGN).unwrap();
    take().add_text("a", "1");
    fs::remove_file(directory.path().join("runs/a.parquet")).unwrap();
    let folder = take();
    assert!(matches!(folder.check_text("a"), Err(Damage::Missing)));
    assert!(folder.check_text("b").unwrap().is_none());
    folder.add_text("a", "1");
    assert!(folder.check_text("a").is_ok() && folder.lists("a"));
}

#[test]
fn a_truncated_manifest_line_is_ignored_and_written_anew() {
    let directory = tempfile::tempdir().unwrap();
    let take = || take(directory.path(), CAMPAIGN).unwrap();
    take().add_text("a", "1");
    let place = directory.path().join(MANIFEST);
    let text = fs::read_to_string(&place).unwrap();
    let gone = text.replace("runs/a", "runs/gone");
    fs::write(&place, format!("{gone}{text}{}", &text[..70])).unwrap();
    drop(take());
    assert_eq!(fs::read_to_string(&place).unwrap(), text);
}

#[test]
fn a_campaign_lists_its_tables_in_the_manifest_and_removes_tables_of_an_earlier_campaign() {
    let directory = tempfile::tempdir().unwrap();
    let publish = |files: Vec<(&str, Vec<u8>)>| {
        take(directory.path(), CAMPAIGN).unwrap().publish(files).unwrap()
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

/// A forged manifest lists files outside the campaign's directory, and a file with a name that
/// no campaign uses.
#[test]
fn files_of_others_are_not_removed_even_if_the_manifest_lists_them() {
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
    take(&out, CAMPAIGN).unwrap().publish(vec![("plan.toml", b"A".to_vec())]).unwrap();
    assert!(others.iter().all(|place| place.exists()));
    assert!(!out.join("features_old.csv").exists());
}
