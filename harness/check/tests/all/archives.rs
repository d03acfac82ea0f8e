//! Rules of the archive, and files that are not FMUs.

use std::io::Cursor;

use check::{Findings, Severity, portable};
use host::fmi2::PLATFORM;
use host::xml::Element;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::common::{
    XML, archive, binary, breaks, broken_rules, check_bytes, our_files, with, xml, zipped,
};

#[test]
fn the_check_reports_archives_that_hosts_cannot_read() {
    const DEFLATED: CompressionMethod = CompressionMethod::Deflated;
    let whole = zipped(our_files(), DEFLATED);
    let renamed = |from: &str, to: &str| {
        let mut files = our_files().clone();
        files.iter_mut().find(|(name, _)| name == from).unwrap().0 = to.into();
        zipped(&files, DEFLATED)
    };
    let without = |start: &str| {
        let mut files = our_files().clone();
        files.retain(|(name, _)| !name.starts_with(start));
        zipped(&files, DEFLATED)
    };
    let plus = |name: &str| {
        let mut files = our_files().clone();
        files.push((name.into(), b"x".to_vec()));
        zipped(&files, DEFLATED)
    };
    // flipped bits in the fields of the archive's structures, in both headers of the first file: the local header
    // at 0, and its copy in the central directory
    let central = whole.windows(4).position(|w| w == b"PK\x01\x02").unwrap();
    let patched = |local: usize, value: u8| {
        let mut bytes = whole.clone();
        bytes[local] = value;
        bytes[central + local + 2] = value;
        bytes
    };
    let wrong_checksum = patched(14, whole[14] ^ 1);
    // a wrong uncompressed size in both headers
    let wrong_size = patched(22, whole[22] ^ 1);
    let encrypted = patched(6, whole[6] | 1);
    let bzip2 = patched(8, 12);
    let twice = {
        // a name of the same length, which is then changed to the name of another entry
        let mut bytes = plus("documentation/indey.html");
        let at: Vec<usize> = (0..bytes.len() - 20)
            .filter(|at| bytes[*at..].starts_with(b"documentation/indey.html"))
            .collect();
        for at in at {
            bytes[at + 18] = b'x';
        }
        bytes
    };
    let link = {
        let mut to = ZipWriter::new_append(Cursor::new(whole.clone())).unwrap();
        to.add_symlink("extra/link", "../../outside", SimpleFileOptions::default()).unwrap();
        to.finish().unwrap().into_inner()
    };
    let mut swapped = our_files().clone();
    swapped.swap(0, 1);
    breaks(
        vec![
            (
                "truncated",
                whole[..whole.len() - 100].to_vec(),
                &["zip.readable", "zip.description", "zip.documentation", "zip.licenses"][..],
            ),
            ("wrong checksum", wrong_checksum, &["zip.readable"]),
            ("another size", wrong_size, &["zip.readable"]),
            ("encrypted", encrypted, &["zip.methods"]),
            ("bzip2", bzip2, &["zip.methods"]),
            (
                "backslashes",
                renamed("documentation/index.html", "documentation\\index.html"),
                &["zip.names", "zip.documentation"],
            ),
            ("a way out", plus("../outside"), &["zip.names"]),
            ("an absolute name", plus("/outside"), &["zip.names", "zip.folders"]),
            ("a link", link, &["zip.links"]),
            ("a name twice", twice, &["zip.duplicates"]),
            ("capitals", plus("documentation/INDEX.html"), &["zip.duplicates"]),
            (
                "a full stop that Windows drops",
                plus("documentation/index.html."),
                &["zip.duplicates", "zip.windows_names"],
            ),
            (
                "a stream of a file",
                plus("documentation/index.html::$DATA"),
                &["zip.duplicates", "zip.windows_names"],
            ),
            ("an empty part", plus("documentation//index.html"), &["zip.names"]),
            ("a part that is .", plus("documentation/./index.html"), &["zip.names"]),
            (
                "a name that begins with .",
                plus("./documentation/index.html"),
                &["zip.names", "zip.folders"],
            ),
            ("a detour", plus("documentation/x/../index.html"), &["zip.names"]),
            ("description missing", without(XML), &["zip.description"]),
            (
                "description in a folder",
                renamed(XML, "HubSlosh/modelDescription.xml"),
                &["zip.description", "zip.folders"],
            ),
            ("description not first", zipped(&swapped, DEFLATED), &["zip.description_first"]),
            ("documentation missing", without("documentation/index.html"), &["zip.documentation"]),
            ("licence missing", without("documentation/licenses/"), &["zip.licenses"]),
            ("another folder", plus("stuff/x"), &["zip.folders"]),
            ("a device of Windows", plus("resources/con.txt"), &["zip.windows_names"]),
            ("a full stop at the end", plus("resources/a./b"), &["zip.windows_names"]),
            ("a space at the end", plus("resources/a "), &["zip.windows_names"]),
            ("a question mark", plus("resources/a?"), &["zip.windows_names"]),
            ("a colon", plus("resources/a:b"), &["zip.windows_names"]),
            (
                "a long path",
                plus(&format!("resources/{}x", "abcdefghi/".repeat(16))),
                &["zip.path_length"],
            ),
            ("a long name", plus(&format!("resources/{}", "x".repeat(256))), &["zip.path_length"]),
            (
                "a file that is a folder",
                plus("documentation/index.html/more.html"),
                &["zip.file_and_folder"],
            ),
            (
                "a folder that is a file in capitals",
                plus("Documentation"),
                &["zip.file_and_folder", "zip.folders"],
            ),
            (
                "capitals of a platform",
                renamed(&binary(), &binary().replace(PLATFORM, &PLATFORM.to_uppercase())),
                &["zip.capitals"],
            ),
            (
                "capitals of binaries",
                renamed(&binary(), &binary().replace("binaries", "Binaries")),
                &["zip.capitals", "zip.folders"],
            ),
            (
                "no zip",
                b"not a zip archive".to_vec(),
                &["zip.readable", "zip.description", "zip.documentation", "zip.licenses"],
            ),
            (
                "empty file",
                Vec::new(),
                &["zip.readable", "zip.description", "zip.documentation", "zip.licenses"],
            ),
        ],
        &["zip"],
    );
}

#[test]
fn a_file_that_is_not_an_fmu_breaks_a_rule_whatever_rules_are_selected() {
    let mut link =
        ZipWriter::new_append(Cursor::new(zipped(our_files(), CompressionMethod::Stored))).unwrap();
    link.add_symlink("extra/link", "../../outside", SimpleFileOptions::default()).unwrap();
    let without_description = our_files().iter().filter(|(name, _)| name != XML).cloned().collect();
    let cut = xml().into_bytes()[..1000].to_vec();
    for (content, rule) in [
        (b"not a zip archive".to_vec(), "zip.readable"),
        (Vec::new(), "zip.readable"),
        (link.finish().unwrap().into_inner(), "zip.links"),
        (zipped(&without_description, CompressionMethod::Stored), "zip.description"),
        (zipped(&with(XML, cut), CompressionMethod::Stored), "xml.well_formed"),
    ] {
        for only in ["xml.guid", "zip.capitals", "bin.name", "load.version"] {
            let report = check_bytes(&content, &[only]);
            assert!(
                broken_rules(&report).contains(rule),
                "{rule}, --only {only}: {}",
                report.text()
            );
        }
    }
    let report = check_bytes(&zipped(our_files(), CompressionMethod::Stored), &["xml.guid"]);
    assert_eq!((report.unchecked.clone(), report.outcomes.len()), (None, 1), "{}", report.text());
}

#[test]
fn a_report_without_a_checked_rule_is_an_error_in_sarif_and_junit() {
    for (content, only) in [
        (&b"not a zip archive"[..], "xml"),
        // a rule that exists only for FMI 3.0
        (&zipped(our_files(), CompressionMethod::Stored), "events"),
    ] {
        let report = check_bytes(content, &[only]);
        let mut file = Vec::new();
        check::sarif::write(&report, &mut file).unwrap();
        let sarif: serde_json::Value = serde_json::from_slice(&file).unwrap();
        let invocation = &sarif["runs"][0]["invocations"][0];
        assert_eq!(invocation["executionSuccessful"], false, "{sarif}");
        assert_eq!(invocation["toolExecutionNotifications"][0]["level"], "error");
        let mut file = Vec::new();
        check::junit::write(&report, &mut file).unwrap();
        let root = Element::parse(&file).unwrap();
        assert_eq!((root.get("errors"), root.children[0].get("errors")), (Some("1"), Some("1")));
        let case = root.children[0].children.last().unwrap();
        assert_eq!((case.get("name"), &*case.children[0].name), (Some("check"), "error"));
    }
}

#[test]
fn file_names_that_windows_cannot_have_are_found() {
    let wrong = ["CON", "nul.txt", "com1", "LPT9.a.b", "a.", "a ", "a?b", "a:b", "aux .c"];
    let right = ["CONE", "com", "com0", "com10", "a.b", ".a", "a b", "nulled.txt", "lptx"];
    for name in [wrong, right].concat() {
        let mut findings = Findings::new(Severity::Error);
        portable::windows_names(&archive(&[(name, "")]), &mut findings);
        assert_eq!(findings.list.len(), usize::from(wrong.contains(&name)), "{name}");
    }
}

#[test]
fn folder_names_of_the_standard_in_wrong_capitals_are_reported() {
    let found = |name| {
        let mut findings = Findings::new(Severity::Error);
        portable::capitals(&archive(&[(name, "")]), &mut findings);
        let text = findings.list.first()?.text.clone();
        let (_, right) = text.split_once("FMI writes ")?;
        Some(right.split(' ').next()?.to_string())
    };
    for (wrong, right) in [
        ("Binaries/Linux64/a.so", "binaries/linux64/a.so"),
        ("binaries/Win64/a.dll", "binaries/win64/a.dll"),
        ("binaries/AArch64-linux/a.so", "binaries/aarch64-linux/a.so"),
        ("ModelDescription.xml", "modelDescription.xml"),
        ("Resources/a", "resources/a"),
    ] {
        assert_eq!(found(wrong).as_deref(), Some(right));
    }
    for right in ["binaries/linux64/A.so", "resources/Binaries/a", "Extras/a", "Documentation"] {
        assert_eq!(found(right), None, "{right}");
    }
}
