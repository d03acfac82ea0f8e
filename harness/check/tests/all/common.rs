//! FMUs for the checks: our own FMU, repacked archives, changed words in the XML, other binaries.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, OnceLock};
use std::time::Duration;

use check::{Archive, Options, Report};
use host::fmi2::PLATFORM;
use pack::packed_for_tests;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

pub type Files = Vec<(String, Vec<u8>)>;

pub const XML: &str = "modelDescription.xml";

pub fn our_files() -> &'static Files {
    static FILES: OnceLock<Files> = OnceLock::new();
    FILES.get_or_init(|| {
        let file = std::fs::File::open(packed_for_tests()).unwrap();
        let mut archive = ZipArchive::new(file).unwrap();
        let count = archive.len();
        let read = |i| {
            let mut file = archive.by_index(i).unwrap();
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes).unwrap();
            (file.name().unwrap().into_owned(), bytes)
        };
        (0..count).map(read).collect()
    })
}

pub fn zipped(files: &Files, method: CompressionMethod) -> Vec<u8> {
    let mut to = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        let options = SimpleFileOptions::default().compression_method(method);
        to.start_file(name.as_str(), options).unwrap();
        to.write_all(bytes).unwrap();
    }
    to.finish().unwrap().into_inner()
}

/// Returns the archive with these files, each a name and a text, as the rules read it.
pub fn archive(files: &[(&str, &str)]) -> Archive {
    let files = files.iter().map(|(name, text)| (name.to_string(), text.as_bytes().to_vec()));
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.fmu");
    std::fs::write(&path, zipped(&files.collect(), CompressionMethod::Stored)).unwrap();
    Archive::read(&path).unwrap()
}

pub fn binary() -> String {
    format!("binaries/{PLATFORM}/HubSlosh{}", std::env::consts::DLL_SUFFIX)
}

pub fn xml() -> String {
    String::from_utf8(our_files().iter().find(|(name, _)| name == XML).unwrap().1.clone()).unwrap()
}

pub fn with(name: &str, content: Vec<u8>) -> Files {
    let mut files = our_files().clone();
    files.iter_mut().find(|(n, _)| n == name).unwrap().1 = content;
    files
}

pub fn check_bytes(bytes: &[u8], only: &[&str]) -> Report {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("Mutant.fmu");
    std::fs::write(&path, bytes).unwrap();
    check_rules(&path, only, 60.0)
}

pub fn check_rules(path: &Path, only: &[&str], limit: f64) -> Report {
    let options = Options {
        program: PathBuf::from(env!("CARGO_BIN_EXE_check-calls")),
        only: only.iter().map(|rule| rule.to_string()).collect(),
        limit: Duration::from_secs_f64(limit),
    };
    check::check(path, &options, |_| {}).unwrap()
}

pub fn broken_rules(report: &Report) -> BTreeSet<&'static str> {
    report.all().map(|(rule, _)| rule.id).collect()
}

/// Stores an FMU, with the rules that it breaks, in the folder HUBSLOSH_KEEP_MUTANTS, from which `.ci/other_tools.py` reads
/// it.
pub fn keep(name: &str, bytes: &[u8], rules: &[&str]) {
    let Some(folder) = std::env::var_os("HUBSLOSH_KEEP_MUTANTS").map(PathBuf::from) else { return };
    static COUNT: Mutex<usize> = Mutex::new(0);
    let mut count = COUNT.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    *count += 1;
    std::fs::create_dir_all(&folder).unwrap();
    let file = format!("{:03}.fmu", *count);
    std::fs::write(folder.join(&file), bytes).unwrap();
    let index =
        std::fs::OpenOptions::new().create(true).append(true).open(folder.join("index.tsv"));
    writeln!(index.unwrap(), "{file}\t{}\t{}", name.escape_debug(), rules.join(" ")).unwrap();
}

/// Asserts that each FMU breaks exactly the rules that are listed for it. Rules outside of `groups` are not checked.
/// An entry of `mutants` has the name of the case, the bytes of the FMU, and its broken rules.
pub fn breaks(mutants: Vec<(&str, Vec<u8>, &[&str])>, groups: &[&str]) {
    let mut wrong = Vec::new();
    for (name, bytes, meant) in mutants {
        keep(name, &bytes, meant);
        let report = check_bytes(&bytes, groups);
        let found = broken_rules(&report);
        if found != meant.iter().copied().collect() {
            wrong.push(format!("{name}: meant {meant:?}, found {found:?}\n{}", report.text()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

pub fn changed(after: &str, from: &str, to: &str) -> Vec<u8> {
    let text = xml();
    let at = text.find(after).unwrap_or_else(|| panic!("no {after}"));
    let (head, tail) = text.split_at(at);
    assert!(tail.contains(from), "no {from} after {after}");
    let text = format!("{head}{}", tail.replacen(from, to, 1));
    zipped(&with(XML, text.into_bytes()), CompressionMethod::Stored)
}

pub fn our_fmu_with_description(text: String) -> Vec<u8> {
    zipped(&with(XML, text.into_bytes()), CompressionMethod::Stored)
}

/// Splits a table into its cells. Each line is a case, with " | " between the cells.
pub fn cases<const N: usize>(table: &str) -> Vec<[&str; N]> {
    let cells = |line| str::split(line, " | ").collect::<Vec<_>>().try_into();
    let lines = table.lines().filter(|line| !line.is_empty());
    lines.map(|line| cells(line).unwrap_or_else(|_| panic!("not {N} cells: {line}"))).collect()
}

/// Asserts that each fault in modelDescription.xml breaks exactly the listed rules of the group `xml`. The cells of a
/// line of `table` are: name of the case, text that precedes the change, old text, new text, and the names of the
/// rules.
pub fn assert_description_faults(table: &str) {
    let cases = cases::<5>(table);
    let rules: Vec<Vec<&str>> = cases.iter().map(|case| case[4].split(' ').collect()).collect();
    let mutants = cases
        .iter()
        .zip(&rules)
        .map(|([name, after, from, to, _], rules)| (*name, changed(after, from, to), &rules[..]));
    breaks(mutants.collect(), &["xml"]);
}

pub fn compiled(source: &str, definitions: &[&str]) -> Vec<u8> {
    static LIBRARIES: Mutex<BTreeMap<String, Vec<u8>>> = Mutex::new(BTreeMap::new());
    let mut libraries = LIBRARIES.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let compile = || {
        let directory = tempfile::tempdir().unwrap();
        let out = directory.path().join("library");
        let done = Command::new("cc")
            .args(["-std=gnu11", "-O1", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"])
            .args(definitions)
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/all").join(source))
            .arg("-o")
            .arg(&out)
            .args(["-ldl", "-lm"])
            .output()
            .expect("a C compiler is there");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        std::fs::read(out).unwrap()
    };
    libraries.entry(format!("{source} {definitions:?}")).or_insert_with(compile).clone()
}
