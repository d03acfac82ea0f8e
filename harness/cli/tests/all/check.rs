//! Runs `hubslosh check` as a process, and compares exit codes, output and written files. The rules themselves are tested in the crate
//! `check`.

use std::process::{Command, Output};

use ::check::RULES;
use host::archive::Archive;
use host::xml::Element;
use pack::archive::zipped;
use pack::packed_for_tests;

fn command(content: &[u8], arguments: &[&str]) -> (Option<i32>, String, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.fmu");
    std::fs::write(&path, content).unwrap();
    let done = Command::new(env!("CARGO_BIN_EXE_hubslosh"))
        .current_dir(folder.path())
        .args(["check", "file.fmu"])
        .args(arguments)
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (done.status.code(), text(&done.stdout), text(&done.stderr))
}

#[test]
fn a_check_that_skips_every_selected_rule_fails_with_exit_code_2() {
    let ours = std::fs::read(packed_for_tests()).unwrap();
    for (content, only) in [
        (&b"not a zip archive"[..], "xml"),
        (b"", "load,steps"),
        // rules that exist only for FMI 3.0
        (&ours, "events"),
        (&ours, "values.in_range"),
    ] {
        let (code, stdout, stderr) = command(content, &["--only", only]);
        assert_eq!(code, Some(2), "{only}: {stdout}{stderr}");
        assert!(stdout.contains("error: nothing was checked: "), "{only}: {stdout}");
        assert!(stderr.contains("nothing was checked: "), "{only}: {stderr}");
        let (code, stdout, _) = command(content, &["--only", only, "--json"]);
        let json: serde_json::Value = serde_json::from_str(&stdout).unwrap();
        assert_eq!(code, Some(2));
        assert!(json["unchecked"].as_str().unwrap().starts_with("nothing was checked: "), "{json}");
    }
}

/// Returns an archive that contains only our model description, in which the start value of hub.I
/// is -1, below its minimum.
fn with_a_start_out_of_range() -> Vec<u8> {
    let xml = Archive::open(packed_for_tests()).unwrap().description().unwrap();
    let (head, tail) = xml.split_at(xml.find("name=\"hub.I\"").unwrap());
    let xml = format!("{head}{}", tail.replacen("start=\"0.322414\"", "start=\"-1\"", 1));
    zipped(&[("modelDescription.xml".into(), xml.into_bytes())]).unwrap()
}

fn hubslosh(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hubslosh")).args(arguments).output().unwrap()
}

#[test]
fn hubslosh_check_reports_as_text_as_exit_code_and_as_junit() {
    let directory = tempfile::tempdir().unwrap();
    let good = packed_for_tests().to_str().unwrap();
    let (bad, junit) = (directory.path().join("bad.fmu"), directory.path().join("junit.xml"));
    std::fs::write(&bad, with_a_start_out_of_range()).unwrap();
    let (bad, junit) = (bad.to_str().unwrap(), junit.to_str().unwrap());

    let done = hubslosh(&["check", good, "--only", "zip,xml,load", "--junit", junit]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stdout));
    let suite = Element::parse(&std::fs::read(junit).unwrap()).unwrap().children.remove(0);
    let looked_at = |groups: &[&str]| {
        RULES.iter().filter(|r| groups.contains(&r.id.split('.').next().unwrap())).count()
    };
    assert_eq!(suite.children.len(), looked_at(&["zip", "xml", "load"]));
    assert_eq!(suite.get("failures"), Some("0"));

    let done = hubslosh(&["check", bad, "--only", "xml", "--junit", junit]);
    assert_eq!(done.status.code(), Some(1));
    let said = String::from_utf8_lossy(&done.stdout).into_owned();
    let word = |word: &str| assert!(said.contains(word), "\"{word}\" is not in: {said}");
    for expected in ["error xml.range", "hub.I", "start=-1 (allowed: 0.000001 to", "[2.2.7]"] {
        word(expected);
    }
    let suite = Element::parse(&std::fs::read(junit).unwrap()).unwrap().children.remove(0);
    assert_eq!(suite.get("failures"), Some("1"));

    let json = directory.path().join("check.json");
    let done = hubslosh(&["check", bad, "--only", "xml", "--json", json.to_str().unwrap()]);
    assert_eq!(done.status.code(), Some(1));
    let told: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert_eq!((&told["errors"], &told["warnings"]), (&1.into(), &0.into()));
    let rules = told["rules"].as_array().unwrap();
    assert_eq!(rules.len(), looked_at(&["xml"]));
    let broken: Vec<_> =
        rules.iter().filter(|r| !r["findings"].as_array().unwrap().is_empty()).collect();
    assert_eq!(broken[0]["rule"], "xml.range");
    assert_eq!(broken[0]["findings"][0]["severity"], "error");
    assert!(broken[0]["findings"][0]["place"].as_str().unwrap().contains("hub.I"));

    let sarif = directory.path().join("check.sarif");
    let done = hubslosh(&["check", bad, "--only", "xml", "--sarif", sarif.to_str().unwrap()]);
    assert_eq!(done.status.code(), Some(1));
    let sarif: serde_json::Value = serde_json::from_slice(&std::fs::read(&sarif).unwrap()).unwrap();
    assert_eq!(sarif["version"], "2.1.0");
    let result = &sarif["runs"][0]["results"][0];
    assert_eq!((&result["ruleId"], &result["level"]), (&"xml.range".into(), &"error".into()));
    assert!(result["message"]["text"].as_str().unwrap().contains("start=-1"));

    for (arguments, word) in [
        (&["check", "none.fmu"][..], "none.fmu"),
        (&["check", good, "--only", "zipp"], "zipp"),
        (&["check", good, "--limit", "0"], "--limit"),
        (&["check", good, "--only", "zip", "--junit", "nowhere/j.xml"], "nowhere/j.xml"),
        (&["check"], "<FMU>"),
    ] {
        let done = hubslosh(arguments);
        assert!(!done.status.success(), "{arguments:?}");
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(said.contains(word), "\"{word}\" is not in: {said}");
    }
}
