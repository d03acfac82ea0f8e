use std::path::Path;

use anyhow::Result;
use files::input::{check_replaceable, open, protect, text, without_error_numbers};

#[cfg(unix)]
#[test]
fn a_new_file_is_never_taken_for_a_deleted_input() {
    let directory = tempfile::tempdir().unwrap();
    for name in ["a", "b", "c"].map(|name| directory.path().join(name)) {
        std::fs::write(&name, "input").unwrap();
        protect(&name);
        std::fs::remove_file(&name).unwrap();
        let output = directory.path().join("output");
        std::fs::write(&output, "").unwrap();
        check_replaceable(&output).unwrap();
        std::fs::remove_file(&output).unwrap();
    }
}

#[test]
fn messages_omit_the_numbers_of_system_errors() {
    let missing = format!("a: {}, b", std::io::Error::from_raw_os_error(2));
    assert!(missing.contains("(os error 2)"));
    let words = without_error_numbers(&missing);
    assert!(words.starts_with("a: ") && words.ends_with(", b") && !words.contains("os error"));
    assert_eq!(without_error_numbers("x (os error y"), "x (os error y");
}

#[cfg(unix)]
#[test]
fn a_named_pipe_and_a_device_are_refused_without_waiting() {
    let directory = tempfile::tempdir().unwrap();
    let pipe = directory.path().join("a.csv");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
    assert!(made.success());
    let error = open(&pipe).unwrap_err().to_string();
    assert_eq!(error, "the path is a named pipe (allowed: a regular file)");
    let error = text(Path::new("/dev/zero")).unwrap_err().to_string();
    assert_eq!(error, "the path is a device (allowed: a regular file)");
}

#[cfg(unix)]
#[test]
fn an_input_file_is_not_overwritten_through_another_name_or_link() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    std::fs::write(at("input.csv"), "input").unwrap();
    std::fs::create_dir(at("folder")).unwrap();
    std::fs::hard_link(at("input.csv"), at("hard.csv")).unwrap();
    std::os::unix::fs::symlink("input.csv", at("symbolic.csv")).unwrap();
    protect(&at("input.csv"));
    for name in ["input.csv", "hard.csv", "symbolic.csv", "folder/../input.csv"] {
        let written: Result<()> = files::output::atomically(&at(name), |_| Ok(()));
        let error = format!("{:#}", written.unwrap_err());
        assert!(error.contains("is not written: it is the input"), "{name}: {error}");
        assert_eq!(std::fs::read_to_string(at(name)).unwrap(), "input");
    }
    assert!(check_replaceable(&at("other.csv")).is_ok());
}
