//! `hubslosh check`: our own FMU keeps every rule, and FMUs that break one are caught by it. The
//! breakers are made from our own: an archive packed otherwise, a word changed in the XML, a byte in
//! the binary, a library around it that misbehaves (shim.c).

use std::collections::BTreeSet;
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use std::time::Duration;

use ::check::{self, Options, RULES, Report, Severity};
use host::fmi2::PLATFORM;
use host::xml::Element;
use pack::packed_for_tests;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// Files of an archive, in its order.
type Files = Vec<(String, Vec<u8>)>;

const XML: &str = "modelDescription.xml";

fn ours() -> &'static Files {
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

fn zipped(files: &Files, method: CompressionMethod) -> Vec<u8> {
    let mut to = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        let options = SimpleFileOptions::default().compression_method(method);
        to.start_file(name.as_str(), options).unwrap();
        to.write_all(bytes).unwrap();
    }
    to.finish().unwrap().into_inner()
}

/// Path and name of binaries.
fn binary() -> String {
    format!("binaries/{PLATFORM}/HubSlosh{}", std::env::consts::DLL_SUFFIX)
}

fn xml() -> String {
    String::from_utf8(ours().iter().find(|(name, _)| name == XML).unwrap().1.clone()).unwrap()
}

fn with(name: &str, content: Vec<u8>) -> Files {
    let mut files = ours().clone();
    files.iter_mut().find(|(n, _)| n == name).unwrap().1 = content;
    files
}

/// Looks at some rules of an FMU that is given as bytes.
fn look(bytes: &[u8], only: &[&str]) -> Report {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("Mutant.fmu");
    std::fs::write(&path, bytes).unwrap();
    look_at(&path, only, 60.0)
}

fn look_at(path: &Path, only: &[&str], limit: f64) -> Report {
    let options = Options {
        program: PathBuf::from(env!("CARGO_BIN_EXE_hubslosh")),
        only: only.iter().map(|rule| rule.to_string()).collect(),
        limit: Duration::from_secs_f64(limit),
    };
    check::check(path, &options, |_| {}).unwrap()
}

/// Rules that are broken.
fn broken(report: &Report) -> BTreeSet<&'static str> {
    report.all().map(|(rule, _)| rule.id).collect()
}

/// Each FMU breaks exactly the rules that are meant, among those of the groups looked at.
fn breaks(mutants: Vec<(&str, Vec<u8>, &[&str])>, groups: &[&str]) {
    let mut wrong = Vec::new();
    for (name, bytes, meant) in mutants {
        let report = look(&bytes, groups);
        let found = broken(&report);
        if found != meant.iter().copied().collect() {
            wrong.push(format!("{name}: meant {meant:?}, found {found:?}\n{}", report.text()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn our_own_fmu_keeps_every_rule() {
    let report = look_at(packed_for_tests(), &[], 120.0);
    // A plain build is for this machine and takes its newer glibc and libgcc; `pack --all-platforms`
    // does not, and is checked when it packs.
    let others: Vec<_> = report.all().filter(|(rule, _)| rule.id != "bin.system").collect();
    assert!(others.is_empty(), "{}", report.text());
    assert_eq!(report.count(Severity::Error), 0);
    let skipped: Vec<_> =
        report.outcomes.iter().filter_map(|o| o.findings.skipped.clone()).collect();
    // none of its outputs and states has a range
    assert_eq!(skipped, ["nothing that the FMU computes has a min or a max"]);
    assert_eq!(report.outcomes.len(), RULES.len());
}

#[test]
fn archives_that_hosts_stumble_over_are_told() {
    const DEFLATED: CompressionMethod = CompressionMethod::Deflated;
    let whole = zipped(ours(), DEFLATED);
    let renamed = |from: &str, to: &str| {
        let mut files = ours().clone();
        files.iter_mut().find(|(name, _)| name == from).unwrap().0 = to.into();
        zipped(&files, DEFLATED)
    };
    let without = |start: &str| {
        let mut files = ours().clone();
        files.retain(|(name, _)| !name.starts_with(start));
        zipped(&files, DEFLATED)
    };
    let plus = |name: &str| {
        let mut files = ours().clone();
        files.push((name.into(), b"x".to_vec()));
        zipped(&files, DEFLATED)
    };
    // The bits of the archive's own structures, in all headers of the first file: local header at
    // 0, its twin in the central directory.
    let central = whole.windows(4).position(|w| w == b"PK\x01\x02").unwrap();
    let patched = |local: usize, value: u8| {
        let mut bytes = whole.clone();
        bytes[local] = value;
        bytes[central + local + 2] = value;
        bytes
    };
    let wrong_checksum = patched(14, whole[14] ^ 1);
    // the size once unpacked, in both headers
    let wrong_size = patched(22, whole[22] ^ 1);
    let encrypted = patched(6, whole[6] | 1);
    let bzip2 = patched(8, 12);
    let twice = {
        // a name of the same length, then changed to one that is there
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
    let mut swapped = ours().clone();
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

/// The exit code, stdout and stderr of a check of a file with this content.
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
    for (content, only) in [
        (&b"not a zip archive"[..], "xml"),
        (b"", "load,steps"),
        // rules of FMI 3.0 alone
        (&zipped(ours(), CompressionMethod::Stored), "events"),
        (&zipped(ours(), CompressionMethod::Stored), "values.in_range"),
    ] {
        let (code, stdout, stderr) = command(content, &["--only", only]);
        assert_eq!(code, Some(2), "{only}: {stdout}{stderr}");
        assert!(stdout.contains("error: nothing was checked: "), "{only}: {stdout}");
        assert!(stderr.contains("nothing was checked: "), "{only}: {stderr}");
        let (code, stdout, _) = command(content, &["--only", only, "--json"]);
        let json: serde_json::Value = serde_json::from_str(&stdout).unwrap();
        assert_eq!(code, Some(2));
        assert!(json["unchecked"].as_str().unwrap().starts_with("nothing was checked: "), "{json}");
        let report = look(content, &only.split(',').collect::<Vec<_>>());
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
        assert_eq!((case.get("name"), case.children[0].name.as_str()), (Some("check"), "error"));
    }
}

#[test]
fn a_file_that_is_not_an_fmu_breaks_a_rule_whatever_rules_are_selected() {
    let mut link =
        ZipWriter::new_append(Cursor::new(zipped(ours(), CompressionMethod::Stored))).unwrap();
    link.add_symlink("extra/link", "../../outside", SimpleFileOptions::default()).unwrap();
    let without_description = ours().iter().filter(|(name, _)| name != XML).cloned().collect();
    let cut = xml().into_bytes()[..1000].to_vec();
    for (content, rule) in [
        (b"not a zip archive".to_vec(), "zip.readable"),
        (Vec::new(), "zip.readable"),
        (link.finish().unwrap().into_inner(), "zip.links"),
        (zipped(&without_description, CompressionMethod::Stored), "zip.description"),
        (zipped(&with(XML, cut), CompressionMethod::Stored), "xml.well_formed"),
    ] {
        for only in ["xml.guid", "zip.capitals", "bin.name", "load.version"] {
            let report = look(&content, &[only]);
            assert!(broken(&report).contains(rule), "{rule}, --only {only}: {}", report.text());
        }
    }
    let report = look(&zipped(ours(), CompressionMethod::Stored), &["xml.guid"]);
    assert_eq!((report.unchecked.clone(), report.outcomes.len()), (None, 1), "{}", report.text());
}

/// The XML with the first `from` after `after` changed to `to`.
fn changed(after: &str, from: &str, to: &str) -> Vec<u8> {
    let text = xml();
    let at = text.find(after).unwrap_or_else(|| panic!("no {after}"));
    let (head, tail) = text.split_at(at);
    assert!(tail.contains(from), "no {from} after {after}");
    let text = format!("{head}{}", tail.replacen(from, to, 1));
    zipped(&with(XML, text.into_bytes()), CompressionMethod::Stored)
}

/// Ten entities, each ten times the one before: 10^10 characters.
fn entity_bomb() -> String {
    let mut entities = "<!ENTITY e0 \"xxxxxxxxxx\">".to_string();
    for n in 1..10 {
        entities += &format!("<!ENTITY e{n} \"{}\">", format!("&e{};", n - 1).repeat(10));
    }
    let text = xml().replacen("<fmi", &format!("<!DOCTYPE a [{entities}]>\n<fmi"), 1);
    text.replacen("description=\"", "description=\"&e9;", 1)
}

/// Elements in elements in an annotation, where the schema allows any.
fn nested(levels: usize) -> String {
    let deep = "<a>".repeat(levels) + &"</a>".repeat(levels);
    let annotations =
        format!("<VendorAnnotations><Tool name=\"t\">{deep}</Tool></VendorAnnotations>");
    xml().replacen("<ModelVariables>", &format!("{annotations}<ModelVariables>"), 1)
}

/// No parser sees them: `host::xml` refuses levels without an end as too deep, not as ill-formed.
#[test]
fn two_hundred_thousand_levels_are_refused_by_their_number() {
    let bytes = zipped(&with(XML, nested(200_000).into_bytes()), CompressionMethod::Deflated);
    let report = look(&bytes, &[]);
    assert_eq!(broken(&report), BTreeSet::from(["xml.size"]), "{}", report.text());
    assert!(report.text().contains("256 levels"), "{}", report.text());
    // what annotations have is read
    let report =
        look(&zipped(&with(XML, nested(50).into_bytes()), CompressionMethod::Stored), &["xml"]);
    assert_eq!(broken(&report), BTreeSet::new(), "{}", report.text());
}

#[test]
fn descriptions_that_break_a_rule_are_told() {
    let hub = "name=\"hub.I\"";
    let theta = "name=\"theta\"";
    let outputs = "<Outputs>";
    let initial = "<InitialUnknowns>";
    let root = "<fmiModelDescription";
    let line = |list: &str, n: usize| {
        let text = xml();
        let mut lines = text[text.find(list).unwrap()..].lines();
        lines.nth(n + 1).unwrap().to_string()
    };
    let two = format!("{}\n{}", line(initial, 0), line(initial, 1));
    let swapped = format!("{}\n{}", line(initial, 1), line(initial, 0));
    let mut no_order = xml();
    let (types, categories) = (
        no_order.find("  <TypeDefinitions>").unwrap(),
        no_order.find("  <LogCategories>").unwrap(),
    );
    let moved = no_order[types..categories].to_string();
    no_order.replace_range(types..categories, "");
    let at = no_order.find("  <ModelVariables>").unwrap();
    no_order.insert_str(at, &moved);
    let mut undeclared = xml();
    let at = undeclared.find(outputs).unwrap();
    let from = at + undeclared[at..].find(" dependencies=").unwrap();
    let to = from + undeclared[from..].find("/>").unwrap();
    undeclared.replace_range(from..to, "");
    let own = |text: String| zipped(&with(XML, text.into_bytes()), CompressionMethod::Stored);
    breaks(
        vec![
            (
                "not well-formed",
                changed("</ModelVariables>", "</ModelVariables>", ""),
                &["xml.well_formed"][..],
            ),
            (
                "Latin-1",
                changed("<?xml", "encoding=\"UTF-8\"", "encoding=\"ISO-8859-1\""),
                &["xml.encoding"],
            ),
            ("no encoding", changed("<?xml", " encoding=\"UTF-8\"", ""), &["xml.encoding"]),
            (
                "fmiVersion 2.1",
                changed(root, "fmiVersion=\"2.0\"", "fmiVersion=\"2.1\""),
                &["xml.fmi_version"],
            ),
            ("order of elements", own(no_order), &["xml.schema"]),
            (
                "an unknown attribute",
                changed(theta, "description", "comment=\"\" description"),
                &["xml.schema"],
            ),
            ("a missing attribute", changed(theta, "valueReference=\"0\" ", ""), &["xml.schema"]),
            (
                "a missing GUID",
                changed(root, "guid=\"", "guid=\"\" author2=\""),
                &["xml.guid", "xml.schema"],
            ),
            (
                "a bad date",
                changed(root, "generationDateAndTime=\"2", "generationDateAndTime=\"31.01.2"),
                &["xml.values", "xml.date"],
            ),
            ("a local time", changed("generationDateAndTime", "Z\"", "+01:00\""), &["xml.date"]),
            (
                "a broken exponent",
                changed("<BaseUnit kg=\"1\"", "kg=\"1\"", "kg=\"0.5\""),
                &["xml.values"],
            ),
            (
                "a decimal comma",
                changed(hub, "start=\"0.322414\"", "start=\"0,322414\""),
                &["xml.values"],
            ),
            (
                "no C identifier",
                changed("<CoSimulation", "\"HubSlosh\"", "\"Hub-Slosh\""),
                &["xml.model_identifier"],
            ),
            (
                "serialize without get",
                changed(
                    "<CoSimulation",
                    "canGetAndSetFMUstate=\"true\"",
                    "canGetAndSetFMUstate=\"false\"",
                ),
                &["xml.capabilities", "xml.state_capability"],
            ),
            (
                "interfaces that disagree",
                changed(
                    "<CoSimulation",
                    "canNotUseMemoryManagementFunctions=\"true\"",
                    "canNotUseMemoryManagementFunctions=\"false\"",
                ),
                &["xml.capabilities"],
            ),
            (
                "states not saved",
                changed(
                    "<CoSimulation",
                    "canSerializeFMUstate=\"true\"",
                    "canSerializeFMUstate=\"false\"",
                ),
                &["xml.state_capability"],
            ),
            (
                "stop before start",
                changed("<DefaultExperiment", "stopTime=\"20.0\"", "stopTime=\"-1\""),
                &["xml.stop_time"],
            ),
            (
                "a step longer than the experiment",
                changed("<DefaultExperiment", "stepSize=\"0.02\"", "stepSize=\"1000\""),
                &["xml.default_experiment"],
            ),
            (
                "an inverted display factor",
                changed("<DisplayUnit name=\"deg\"", "57.29577951308232", "0.0174532925199433"),
                &["xml.display_units"],
            ),
            (
                "a display unit of something else",
                changed("<DisplayUnit name=\"mm2/s\"", "name=\"mm2/s\"", "name=\"mm2\""),
                &["xml.display_units", "xml.units"],
            ),
            (
                "a wrong exponent",
                changed("<Unit name=\"N.m\"", "m=\"2\"", "m=\"1\""),
                &["xml.base_units", "xml.display_units"],
            ),
            (
                "an infinite offset",
                changed("<DisplayUnit name=\"deg\"", "factor=", "offset=\"INF\" factor="),
                &["xml.unit_numbers"],
            ),
            (
                "a factor of 0",
                changed("<DisplayUnit name=\"mm\"", "factor=\"1000.0\"", "factor=\"0\""),
                &["xml.unit_numbers", "xml.display_units"],
            ),
            (
                "a derivative in the unit of its state",
                changed("name=\"der(omega)\"", "unit=\"rad/s2\"", "unit=\"rad/s\""),
                &["xml.derivative_units"],
            ),
            (
                "a start that is not a number",
                changed(hub, "start=\"0.322414\"", "start=\"0.3x\""),
                &["xml.values"],
            ),
            (
                "a max that is not a number",
                changed(hub, "max=\"1000000000000.0\"", "max=\"1e\""),
                &["xml.values"],
            ),
            (
                "a min that is not a number",
                changed(hub, "min=\"1e-6\"", "min=\"-inf\""),
                &["xml.values"],
            ),
            (
                "a document type declaration",
                changed("<fmiModelDescription", "<fmi", "<!DOCTYPE fmiModelDescription>\n<fmi"),
                &["xml.doctype"],
            ),
            (
                "an external entity",
                changed(
                    "<fmiModelDescription",
                    "<fmi",
                    "<!DOCTYPE a [<!ENTITY b SYSTEM \"file:///etc/hostname\">]>\n<fmi",
                ),
                &["xml.doctype"],
            ),
            ("an entity bomb", own(entity_bomb()), &["xml.doctype"]),
            ("200,000 levels", own(nested(200_000)), &["xml.size"]),
            (
                "an item's value twice",
                changed("<SimpleType name=\"SloshModel\"", "value=\"2\"", "value=\"1\""),
                &["xml.unique", "xml.range"],
            ),
            (
                "a category twice",
                changed("<Category name=\"logStatusError\"", "logStatusError", "logEvents"),
                &["xml.unique"],
            ),
            (
                "an undefined unit",
                changed(theta, "unit=\"rad\"", "unit=\"radian\""),
                &["xml.units"],
            ),
            (
                "an undefined displayUnit",
                changed(theta, "displayUnit=\"deg\"", "displayUnit=\"grad\""),
                &["xml.units"],
            ),
            (
                "an undefined type",
                changed(
                    "name=\"slosh.model\"",
                    "declaredType=\"SloshModel\"",
                    "declaredType=\"Slosh\"",
                ),
                &["xml.types"],
            ),
            (
                "a name twice",
                changed("name=\"omega\"", "name=\"omega\"", "name=\"theta\""),
                &["xml.names"],
            ),
            ("an unstructured name", changed(hub, "hub.I", "hub..I"), &["xml.structured_names"]),
            (
                "a long name",
                changed(hub, "hub.I", &format!("hub.{}", "I".repeat(60))),
                &["xml.parameter_names"],
            ),
            (
                "a dotted port",
                changed(theta, "name=\"theta\"", "name=\"hub.theta\""),
                &["xml.flat_ports"],
            ),
            (
                "half an array of ports",
                changed(theta, "name=\"theta\"", "name=\"theta[2]\""),
                &["xml.flat_ports"],
            ),
            (
                "a continuous parameter",
                changed(hub, "variability=\"fixed\"", "variability=\"continuous\""),
                &["xml.causality"],
            ),
            (
                "a continuous Integer",
                changed(
                    "name=\"friction_mode\"",
                    "variability=\"discrete\"",
                    "variability=\"continuous\"",
                ),
                &["xml.causality"],
            ),
            (
                "no variability",
                changed("name=\"friction_mode\"", "variability=\"discrete\" ", ""),
                &["xml.variability"],
            ),
            (
                "an input with initial",
                changed(
                    "name=\"tau_cmd\"",
                    "variability=\"continuous\"",
                    "variability=\"continuous\" initial=\"exact\"",
                ),
                &["xml.initial"],
            ),
            (
                "calculated with start",
                changed(theta, "displayUnit=\"deg\"", "displayUnit=\"deg\" start=\"0\""),
                &["xml.start"],
            ),
            ("a parameter without start", changed(hub, " start=\"0.322414\"", ""), &["xml.start"]),
            ("start NaN", changed(hub, "start=\"0.322414\"", "start=\"NaN\""), &["xml.finite"]),
            (
                "nominal 0",
                changed("name=\"omega\"", "nominal=\"0.1\"", "nominal=\"0\""),
                &["xml.finite"],
            ),
            ("start outside", changed(hub, "start=\"0.322414\"", "start=\"-1\""), &["xml.range"]),
            (
                "no such item",
                changed("name=\"slosh.model\"", "start=\"2\"", "start=\"7\""),
                &["xml.range"],
            ),
            (
                "min above max",
                changed("name=\"tank.d\"", "min=\"0.001\"", "min=\"1000\""),
                &["xml.range"],
            ),
            (
                "a shared reference",
                changed("name=\"tau_ext\"", "valueReference=\"13\"", "valueReference=\"12\""),
                &["xml.aliases"],
            ),
            (
                "a derivative of nothing",
                changed("name=\"der(omega)\"", "derivative=\"2\"", "derivative=\"9999\""),
                &["xml.states", "xml.dependencies_known"],
            ),
            ("an output not listed", changed(outputs, &line(outputs, 0), ""), &["xml.outputs"]),
            (
                "an output listed twice",
                changed(outputs, &line(outputs, 0), &format!("{0}{0}", line(outputs, 0))),
                &["xml.outputs"],
            ),
            (
                "a derivative not listed",
                changed("<Derivatives>", &line("<Derivatives>", 0), ""),
                &["xml.derivatives"],
            ),
            (
                "an initial unknown twice",
                changed(initial, &line(initial, 0), &format!("{0}{0}", line(initial, 0))),
                &["xml.initial_unknowns"],
            ),
            (
                "an initial unknown missing",
                changed(initial, &line(initial, 0), ""),
                &["xml.initial_unknowns"],
            ),
            (
                "initial unknowns unsorted",
                changed(initial, &two, &swapped),
                &["xml.initial_unknowns"],
            ),
            (
                "an index too far",
                changed(outputs, "dependencies=\"", "dependencies=\"9999 "),
                &["xml.indices", "xml.dependencies"],
            ),
            (
                "a kind missing",
                changed("index=\"3\"", "dependenciesKind=\"dependent ", "dependenciesKind=\""),
                &["xml.dependencies"],
            ),
            ("no dependencies", own(undeclared), &["xml.dependencies_written"]),
            (
                "multiple set of a parameter",
                changed(hub, "causality", "canHandleMultipleSetPerTimeInstant=\"true\" causality"),
                &["xml.multiple_set"],
            ),
        ],
        &["xml"],
    );
}

#[test]
fn binaries_that_no_host_can_use_are_told() {
    let name = binary();
    let ours = ours().iter().find(|(n, _)| *n == name).unwrap().1.clone();
    let at = |text: &[u8]| ours.windows(text.len()).position(|w| w == text).unwrap();
    let patched = |text: &[u8], to: &[u8]| {
        let mut bytes = ours.clone();
        bytes[at(text)..][..to.len()].copy_from_slice(to);
        zipped(&with(&name, bytes), CompressionMethod::Stored)
    };
    let renamed = |to: &str| {
        let mut files = self::ours().clone();
        files.iter_mut().find(|(n, _)| *n == name).unwrap().0 = to.into();
        zipped(&files, CompressionMethod::Stored)
    };
    // linux64 is for x86-64, aarch64-linux for ARM, whatever the processor of this machine
    let machine = |number: u8| {
        let mut bytes = ours.clone();
        bytes[18] = number; // e_machine
        bytes
    };
    let (x86, arm) = (machine(62), machine(183)); // EM_X86_64, EM_AARCH64
    let both = |x86_64: &[u8], aarch64: &[u8]| {
        let mut files = self::ours().clone();
        files.retain(|(n, _)| *n != name);
        files.push(("binaries/linux64/HubSlosh.so".into(), x86_64.into()));
        files.push(("binaries/aarch64-linux/HubSlosh.so".into(), aarch64.into()));
        zipped(&files, CompressionMethod::Stored)
    };
    // A plain build's need of a newer glibc is left out: the groups are looked at one by one.
    breaks(
        vec![
            (
                "a symbol missing",
                patched(b"fmi2GetStringStatus\0", b"fmi2GotStringStatus\0"),
                &["bin.symbols"][..],
            ),
            (
                "a foreign symbol",
                patched(b"fmi2GetStringStatus\0", b"printGetStringStatu\0"),
                &["bin.symbols", "bin.extra_symbols"],
            ),
            (
                "no binary",
                zipped(&with(&name, b"text".to_vec()), CompressionMethod::Stored),
                &["bin.format"],
            ),
            ("of two processors, each in its folder", both(&x86, &arm), &[]),
            ("of ARM in both folders", both(&arm, &arm), &["bin.format"]),
            ("of x86-64 in both folders", both(&x86, &x86), &["bin.format"]),
            (
                "of another platform",
                renamed("binaries/win64/HubSlosh.dll"),
                &["bin.format", "bin.this_platform"],
            ),
            (
                "in the folder of a platform tuple",
                renamed("binaries/x86_64-linux/HubSlosh.so"),
                &["bin.this_platform"],
            ),
            (
                "in the folder of a tuple for another system",
                renamed("binaries/aarch64-darwin/HubSlosh.dylib"),
                &["bin.format", "bin.this_platform"],
            ),
            (
                "in a folder that a vendor has named",
                renamed("binaries/gcc4/HubSlosh.so"),
                &["bin.this_platform"],
            ),
            (
                "of another name in such a folder",
                renamed("binaries/gcc4/Other.so"),
                &["bin.present", "bin.this_platform"],
            ),
            (
                "of another name",
                renamed(&name.replace("HubSlosh", "Other")),
                &["bin.present", "bin.name", "bin.this_platform"],
            ),
            (
                "of one interface missing",
                changed("<CoSimulation", "\"HubSlosh\"", "\"Other\""),
                &["bin.each_interface"],
            ),
            (
                "in a platform's folder with other capitals",
                renamed(&name.replace(PLATFORM, &PLATFORM.to_uppercase())),
                &["bin.present", "bin.this_platform"],
            ),
        ],
        &[
            "bin.present",
            "bin.each_interface",
            "bin.this_platform",
            "bin.name",
            "bin.format",
            "bin.symbols",
            "bin.extra_symbols",
        ],
    );
}

/// The library around ours, compiled once.
fn shim() -> &'static [u8] {
    static SHIM: OnceLock<Vec<u8>> = OnceLock::new();
    SHIM.get_or_init(|| {
        let directory = tempfile::tempdir().unwrap();
        let out = directory.path().join("shim.so");
        let done = Command::new("cc")
            .args(["-std=c11", "-shared", "-fPIC", "-o"])
            .arg(&out)
            .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/shim.c"))
            .args(["-ldl", "-lm"])
            .output()
            .expect("a C compiler is there");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        std::fs::read(out).unwrap()
    })
}

/// Our FMU, but for one misbehaviour.
fn misbehaving(word: &str) -> Vec<u8> {
    let name = binary();
    let folder = format!("binaries/{PLATFORM}");
    let ours = ours().iter().find(|(n, _)| *n == name).unwrap().1.clone();
    let mut files = with(&name, shim().to_vec());
    let text = xml();
    let guid = text.split("guid=\"").nth(1).unwrap().split('"').next().unwrap();
    files.push((format!("{folder}/real.so"), ours));
    let tunable = text.split("name=\"friction.b\" valueReference=\"").nth(1).unwrap();
    let tunable = tunable.split('"').next().unwrap();
    let said = format!("{word} {guid} {tunable}\n");
    files.push((format!("{folder}/misbehaviour.txt"), said.into_bytes()));
    zipped(&files, CompressionMethod::Stored)
}

/// The shim hands the address of a variable of its own back; a host that follows it jumps into the logger.
#[test]
fn an_fmu_that_hands_its_own_pointer_to_the_logger_breaks_one_rule_and_runs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("Mutant.fmu");
    std::fs::write(&path, misbehaving("hands_its_own")).unwrap();
    let report = look_at(&path, &["log", "instantiate", "life.order", "values.unknown"], 60.0);
    assert_eq!(broken(&report), BTreeSet::from(["log.environment"]), "{}", report.text());
    let run = |set: &str| {
        Command::new(env!("CARGO_BIN_EXE_hubslosh"))
            .current_dir(folder.path())
            .args([
                "run",
                "--fmu",
                "Mutant.fmu",
                "--profile",
                "exp-sweep:amplitude=0.1",
                "--stop",
                "1",
                "--out",
                "out.csv",
                "--set",
                set,
            ])
            .output()
            .unwrap()
    };
    assert!(run("friction.b=0.1").status.success());
    let refused = run("friction.b=-1");
    assert_eq!(refused.status.code(), Some(1));
    // the message still belongs to the instance whose call it explains
    let stderr = String::from_utf8_lossy(&refused.stderr);
    assert!(stderr.contains("friction.b = -1"), "{stderr}");
}

/// Each misbehaviour, and the rule that must tell it.
const MISBEHAVIOURS: &[(&str, &str)] = &[
    ("crashes_when_loaded", "load.opens"),
    ("types_platform", "load.types_platform"),
    ("version", "load.version"),
    ("never_initialises", "load.initialises"),
    ("endless_events", "exchange.event_iteration"),
    ("past_events", "exchange.next_event_time"),
    ("terminates", "exchange.terminate_simulation"),
    ("terminates", "steps.terminated"),
    ("swallows_small_steps", "steps.small"),
    ("refuses_tunables", "values.tunable"),
    ("drops_tunables", "values.tunable"),
    ("ignores_tunables", "values.tunable_effect"),
    ("writes_past", "host.arrays"),
    ("writes_past_vectors", "host.arrays"),
    ("remembers_loads", "load.again"),
    ("any_guid", "instantiate.guid"),
    ("swallows_messages", "instantiate.guid"),
    ("needs_resources", "instantiate.arguments"),
    ("needs_callbacks", "instantiate.callbacks"),
    ("keeps_callbacks", "instantiate.copies"),
    ("free_null_crashes", "instantiate.free_null"),
    ("null_crashes", "instantiate.null"),
    ("counts_steps", "life.instances"),
    ("counts_instances", "life.deterministic"),
    ("resets_not_all", "life.reset"),
    ("no_reset_when_terminated", "life.reset_anywhere"),
    ("terminate_fails", "life.terminate"),
    ("any_order", "life.order"),
    ("ends_the_process", "life.order"),
    ("prints", "host.silent"),
    ("rounds_up", "host.untouched"),
    ("changes_directory", "host.untouched"),
    ("leaks_files", "host.untouched"),
    ("frees_nothing", "host.memory"),
    ("leaks_in_steps", "host.memory"),
    ("keeps_states", "host.memory"),
    ("hands_its_own", "log.environment"),
    ("text_as_format", "log.percent"),
    ("odd_category", "log.categories"),
    ("line_break", "log.text"),
    ("not_utf8", "log.text"),
    ("chatters", "log.quiet"),
    ("wants_categories", "log.switch"),
    ("other_start", "values.start"),
    ("not_a_number", "values.readable"),
    ("true_is_two", "values.booleans"),
    ("forgets_settings", "values.round_trip"),
    ("wants_variables", "values.nothing"),
    ("any_reference", "values.unknown"),
    ("crashes_on_unknown", "values.unknown"),
    ("swallows_messages", "values.unknown"),
    ("any_type", "values.wrong_type"),
    ("sets_anything", "values.fixed"),
    ("sets_anything", "values.computed"),
    ("any_number", "values.not_a_number"),
    ("warns", "values.no_warning"),
    ("discards", "steps.run"),
    ("any_step", "steps.size"),
    ("any_point", "steps.point"),
    ("exact_time", "steps.wobble"),
    ("starts_at_zero", "steps.start_time"),
    ("passes_stop", "steps.stop_time"),
    ("no_tolerance", "steps.tolerance"),
    ("counts_steps", "steps.cut"),
    ("any_number", "steps.inputs"),
    ("no_slopes", "steps.inputs"),
    ("ignores_slopes", "steps.input_derivatives"),
    ("wrong_slopes", "steps.output_derivatives"),
    ("opposite_slopes", "steps.output_derivatives"),
    ("restores_nothing", "states.rollback"),
    ("one_handle_only", "states.handle"),
    ("reads_no_bytes", "states.bytes"),
    ("wants_setup", "states.bytes"),
    ("reads_garbage", "states.garbage"),
    ("saves_only_running", "states.modes"),
    ("wrong_directions", "dependencies.directional"),
    ("frozen_indicators", "exchange.events"),
    ("hides_jumps", "exchange.values_changed"),
    ("other_nominals", "exchange.nominals"),
    ("zero_nominals", "exchange.vectors"),
    ("any_length", "exchange.lengths"),
    ("other_order", "exchange.variables"),
];

#[cfg(target_os = "linux")]
#[test]
fn binaries_that_misbehave_are_told_by_the_rule_that_is_meant() {
    let rules: BTreeSet<&str> = MISBEHAVIOURS.iter().map(|(_, rule)| *rule).collect();
    let rules: Vec<&str> = rules.into_iter().collect();
    // without a misbehaviour the library around ours is as good as ours
    let report = look(&misbehaving("none"), &rules);
    assert_eq!(broken(&report), BTreeSet::new(), "{}", report.text());
    let mut untold = Vec::new();
    for (word, rule) in MISBEHAVIOURS {
        let report = look(&misbehaving(word), &[rule]);
        if !broken(&report).contains(rule) {
            untold.push(format!("{word} is not told by {rule}: {}", report.text()));
        }
    }
    assert!(untold.is_empty(), "{}", untold.join("\n"));
}

/// Findings of one rule by whether they are errors, of our FMU with one misbehaviour.
#[cfg(target_os = "linux")]
fn severities(word: &str, rule: &str) -> (Vec<Severity>, String) {
    let report = look(&misbehaving(word), &[rule]);
    (report.all().map(|(_, finding)| finding.severity).collect(), report.text())
}

#[cfg(target_os = "linux")]
#[test]
fn what_the_standard_forbids_is_an_error_and_what_it_leaves_open_is_none() {
    for (word, rule, meant) in [
        ("opposite_slopes", "steps.output_derivatives", Severity::Error),
        ("true_is_two", "values.booleans", Severity::Error),
        ("prints", "host.silent", Severity::Error),
        ("free_null_crashes", "instantiate.free_null", Severity::Error),
        // a crash, and a call without end, with arguments of which the standard says nothing
        ("null_crashes", "instantiate.null", Severity::Warning),
        ("hangs_at_nan", "steps.size", Severity::Warning),
    ] {
        let (found, text) = severities(word, rule);
        // a Boolean that reads as 2 keeps a 2 as well, which is a warning
        let worst = found.iter().min();
        assert_eq!(worst, Some(&meant), "{word}: {text}");
    }
    // start values that differ from the file's in the last bit alone
    let (found, text) = severities("last_bit_of_start", "values.start");
    assert!(found.is_empty(), "{text}");
    // a tunable parameter that is declared as fixed
    let fixed = changed("name=\"friction.b\"", "tunable", "fixed");
    let report = look(&fixed, &["values.fixed"]);
    let all: Vec<_> = report.all().collect();
    let [(_, finding)] = &all[..] else { panic!("{}", report.text()) };
    assert_eq!(finding.severity, Severity::Error);
    assert!(finding.place.contains("friction.b"), "{}", report.text());
    // where all are taken, it is the binary that is lax
    let (found, text) = severities("sets_anything", "values.fixed");
    assert!(!found.is_empty() && found.iter().all(|s| *s == Severity::Warning), "{text}");
}

#[test]
fn an_fmu_of_another_version_of_fmi_gets_one_finding() {
    for version in ["1.0", "1.5"] {
        let fmu = changed(
            "<fmiModelDescription",
            "fmiVersion=\"2.0\"",
            &format!("fmiVersion=\"{version}\" odd=\"\""),
        );
        for only in [&[][..], &["zip"]] {
            let report = look(&fmu, only);
            let all: Vec<_> = report.all().collect();
            let [(rule, finding)] = &all[..] else { panic!("{}", report.text()) };
            assert_eq!((rule.id, finding.severity), ("xml.fmi_version", Severity::Error));
            assert!(finding.text.contains(version), "{}", finding.text);
            assert_eq!(report.outcomes.len(), 1);
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_call_without_end_is_a_finding_and_not_the_end_of_the_check() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("Mutant.fmu");
    std::fs::write(&path, misbehaving("hangs_at_zero")).unwrap();
    // Enough for the calls before it on a busy machine.
    let report = look_at(&path, &["steps.size", "load.version"], 5.0);
    let all: Vec<_> = report.all().collect();
    let [(rule, finding)] = &all[..] else { panic!("{}", report.text()) };
    assert_eq!((rule.id, finding.severity), ("steps.size", Severity::Error));
    assert!(finding.place.contains("communicationStepSize = 0.0"), "{}", finding.place);
    assert!(finding.text.contains("no end after 4 s"), "{}", finding.text);
}

#[test]
fn descriptions_that_do_not_fit_the_binary_are_told() {
    let hub = "name=\"hub.I\"";
    let guid = changed("<fmiModelDescription", "guid=\"{", "guid=\"{x");
    // theta and omega
    let references = {
        let text = xml();
        let text = text
            .replacen("valueReference=\"0\"", "valueReference=\"_\"", 1)
            .replacen("valueReference=\"1\"", "valueReference=\"0\"", 1)
            .replacen("valueReference=\"_\"", "valueReference=\"1\"", 1);
        zipped(&with(XML, text.into_bytes()), CompressionMethod::Stored)
    };
    let unknown = |list: &str, name: &str, from: &str, to: &str| {
        let text = xml();
        let index = text[..text.find(&format!("name=\"{name}\"")).unwrap()]
            .matches("<ScalarVariable")
            .count();
        let at = text.find(list).unwrap();
        let after = format!("<Unknown index=\"{index}\"");
        let at = at + text[at..].find(&after).unwrap();
        let (head, tail) = text.split_at(at);
        assert!(tail.starts_with(&after) && tail[..tail.find("/>").unwrap()].contains(from));
        let text = format!("{head}{}", tail.replacen(from, to, 1));
        zipped(&with(XML, text.into_bytes()), CompressionMethod::Stored)
    };
    let without_line = |word: &str| {
        let text = xml();
        let line = text.lines().find(|line| line.contains(word)).unwrap();
        zipped(&with(XML, text.replacen(line, "", 1).into_bytes()), CompressionMethod::Stored)
    };
    let mut wrong = Vec::new();
    for (name, bytes, rule) in [
        ("another GUID", guid, "load.instance"),
        ("another start", changed(hub, "start=\"0.322414\"", "start=\"0.322415\""), "values.start"),
        ("a min that is refused", changed(hub, "min=\"1e-6\"", "min=\"-1\""), "values.limits"),
        (
            "a max that is passed",
            changed(hub, "max=\"1000000000000.0\"", "max=\"10\""),
            "values.limits",
        ),
        (
            "a fixed parameter that is tunable",
            changed("name=\"friction.b\"", "tunable", "fixed"),
            "values.fixed",
        ),
        (
            "a max narrower than the binary's",
            changed(hub, "max=\"1000000000000.0\"", "max=\"900000000000.0\""),
            "values.limits_exact",
        ),
        (
            "a max of an Integer narrower than the binary's",
            changed("name=\"slosh.modes\"", "max=\"10\"", "max=\"9\""),
            "values.limits_exact",
        ),
        (
            "an output beyond its max",
            changed("name=\"omega\"", "unit=\"rad/s\"", "unit=\"rad/s\" max=\"-1\""),
            "values.in_range",
        ),
        ("an item that is missing", without_line("<Item name=\"paraboloid\""), "values.items"),
        (
            "a fixed parameter declared tunable",
            changed(hub, "variability=\"fixed\"", "variability=\"tunable\""),
            "values.tunable",
        ),
        (
            "derivatives of outputs to an order that is not there",
            changed(
                "<CoSimulation",
                "maxOutputDerivativeOrder=\"1\"",
                "maxOutputDerivativeOrder=\"2\"",
            ),
            "steps.output_derivative_order",
        ),
        (
            "a constant factor that is none",
            unknown(
                "<Outputs>",
                "omega_dot",
                "Kind=\"dependent dependent",
                "Kind=\"dependent constant",
            ),
            "dependencies.kinds",
        ),
        (
            "a fixed factor that is none",
            unknown(
                "<Derivatives>",
                "der(omega)",
                "Kind=\"dependent dependent",
                "Kind=\"dependent fixed",
            ),
            "dependencies.kinds",
        ),
        ("swapped references", references, "exchange.variables"),
        (
            "no binary",
            zipped(&with(&binary(), b"text".to_vec()), CompressionMethod::Stored),
            "load.opens",
        ),
        // the first input of omega_dot is tau_cmd
        (
            "a hidden feedthrough",
            unknown("<Outputs>", "omega_dot", "dependencies=\"", "dependencies=\"\" x=\""),
            "dependencies.running",
        ),
        (
            "a false feedthrough",
            unknown("<Outputs>", "theta", "dependencies=\"", "dependencies=\"13 "),
            "dependencies.feedthrough",
        ),
        (
            "a hidden start",
            unknown("<InitialUnknowns>", "omega", "dependencies=\"", "dependencies=\"\" x=\""),
            "dependencies.initial",
        ),
    ] {
        let report = look(&bytes, &[rule]);
        if !broken(&report).contains(rule) {
            wrong.push(format!("{name} is not told by {rule}: {}", report.text()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

// ---------------------------------------------------------------- small FMUs of C

/// Capabilities and compilation of the FMU of model.c.
struct Small<'a> {
    /// C definitions besides the rate.
    definitions: &'a [&'a str],
    /// k in x' = -k (x - u), 1/s.
    rate: f64,
    /// Attributes of DefaultExperiment.
    experiment: &'a str,
}

impl Small<'_> {
    fn offers(&self, interface: &str) -> bool {
        self.definitions.contains(&interface)
    }

    fn xml(&self) -> String {
        let flags = "canNotUseMemoryManagementFunctions=\"true\" canGetAndSetFMUstate=\"true\" \
                     canSerializeFMUstate=\"true\"";
        let exchange = match self.offers("-DMODEL_EXCHANGE") {
            true => format!("<ModelExchange modelIdentifier=\"model\" {flags}/>"),
            false => String::new(),
        };
        let stepping = match self.offers("-DCO_SIMULATION") {
            true => format!(
                "<CoSimulation modelIdentifier=\"model\" \
                 canHandleVariableCommunicationStepSize=\"true\" {flags}/>"
            ),
            false => String::new(),
        };
        let Small { rate, experiment, .. } = self;
        format!(
            r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="model" guid="{{model}}" numberOfEventIndicators="0">
  {exchange}
  {stepping}
  <LogCategories><Category name="logStatusError"/></LogCategories>
  <DefaultExperiment {experiment}/>
  <ModelVariables>
    <ScalarVariable name="x" valueReference="0" causality="output" variability="continuous" initial="exact"><Real start="1"/></ScalarVariable>
    <ScalarVariable name="der(x)" valueReference="1" variability="continuous" initial="calculated"><Real derivative="1"/></ScalarVariable>
    <ScalarVariable name="k" valueReference="2" causality="parameter" variability="fixed" initial="exact"><Real min="0" start="{rate:?}"/></ScalarVariable>
    <ScalarVariable name="u" valueReference="3" causality="input" variability="continuous"><Real start="0"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="1" dependencies="1" dependenciesKind="constant"/></Outputs>
    <Derivatives><Unknown index="2" dependencies="1 4" dependenciesKind="fixed fixed"/></Derivatives>
    <InitialUnknowns><Unknown index="2" dependencies="1 3 4"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"#
        )
    }

    fn packed(&self) -> Vec<u8> {
        let directory = tempfile::tempdir().unwrap();
        let out = directory.path().join("model.so");
        let done = Command::new("cc")
            .args(["-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"])
            .arg(format!("-DRATE={:e}", self.rate))
            .args(self.definitions)
            .arg("-o")
            .arg(&out)
            .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/model.c"))
            .arg("-lm")
            .output()
            .expect("a C compiler is there");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let files: Files = vec![
            (XML.into(), self.xml().into_bytes()),
            (format!("binaries/{PLATFORM}/model.so"), std::fs::read(out).unwrap()),
            ("documentation/index.html".into(), b"<html></html>".to_vec()),
            ("documentation/licenses/license.txt".into(), b"MIT".to_vec()),
        ];
        zipped(&files, CompressionMethod::Deflated)
    }
}

const BOTH: &[&str] = &["-DCO_SIMULATION", "-DMODEL_EXCHANGE"];
const USUAL: &str = "startTime=\"0\" stopTime=\"10\" stepSize=\"0.01\"";

#[cfg(target_os = "linux")]
#[test]
fn good_fmus_get_no_finding_however_stiff_and_whatever_they_offer() {
    let long = "startTime=\"0\" stopTime=\"1e6\" stepSize=\"1000\"";
    let mut wrong = Vec::new();
    for (name, definitions, rate, experiment) in [
        ("both interfaces", BOTH, 1.0, USUAL),
        ("stiff", BOTH, 1e5, USUAL),
        ("stiff, Model Exchange only", &BOTH[1..], 1e5, USUAL),
        ("very stiff", BOTH, 1e9, USUAL),
        ("steps of 1000 s", BOTH, 1.0, long),
        ("stiff in steps of 1000 s", BOTH, 1e5, long),
        ("steps longer than the experiment", BOTH, 1.0, "stopTime=\"1\" stepSize=\"1000\""),
        ("steps of 1000 s without an end", BOTH, 1.0, "stepSize=\"1000\""),
        ("short steps", BOTH, 1.0, "stopTime=\"1e-3\" stepSize=\"1e-6\""),
        ("Co-Simulation only", &BOTH[..1], 1.0, USUAL),
        ("Model Exchange only", &BOTH[1..], 1.0, USUAL),
    ] {
        let small = Small { definitions, rate, experiment };
        let report = look(&small.packed(), &[]);
        // A plain build is for this machine; the one step that is too long is meant.
        let fine = ["bin.system", "xml.default_experiment"];
        let others: Vec<_> = report.all().filter(|(rule, _)| !fine.contains(&rule.id)).collect();
        if !others.is_empty() || report.count(Severity::Error) > 0 {
            wrong.push(format!("{name}: {}", report.text()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_model_without_a_solution_is_told_as_that_and_by_one_rule() {
    let definitions = &["-DMODEL_EXCHANGE", "-DBLOWS_UP"];
    let small = Small { definitions, rate: 10.0, experiment: USUAL };
    let report = look(&small.packed(), &["life", "exchange", "values", "states"]);
    assert_eq!(broken(&report), BTreeSet::from(["exchange.run"]), "{}", report.text());
    let text = report.text();
    assert!(text.contains("cannot be followed past t = 0.1"), "{text}");
}

#[cfg(target_os = "linux")]
#[test]
fn each_interface_is_called_in_the_binary_that_it_names() {
    let small = Small { definitions: BOTH, rate: 1.0, experiment: USUAL };
    let text = small.xml().replacen(
        "ModelExchange modelIdentifier=\"model\"",
        "ModelExchange modelIdentifier=\"other\"",
        1,
    );
    let stepping = Small { definitions: &BOTH[..1], ..small };
    let exchange = Small { definitions: &BOTH[1..], rate: 1.0, experiment: USUAL };
    let library = |small: &Small| {
        let bytes = small.packed();
        let mut archive = ZipArchive::new(Cursor::new(bytes)).unwrap();
        let mut file = archive.by_index(1).unwrap();
        let mut library = Vec::new();
        file.read_to_end(&mut library).unwrap();
        library
    };
    let documentation = |name: &str| (format!("documentation/{name}"), b"text".to_vec());
    let mut files: Files = vec![
        (XML.into(), text.into_bytes()),
        (format!("binaries/{PLATFORM}/model.so"), library(&stepping)),
        documentation("index.html"),
        documentation("licenses/license.txt"),
        (format!("binaries/{PLATFORM}/other.so"), library(&exchange)),
    ];
    let report = look(&zipped(&files, CompressionMethod::Stored), &[]);
    let found: Vec<_> = report.all().filter(|(rule, _)| rule.id != "bin.system").collect();
    assert!(found.is_empty(), "{}", report.text());
    let called = |id: &str, report: &Report| {
        report.outcomes.iter().any(|o| o.rule.id == id && o.findings.skipped.is_none())
    };
    assert!(called("exchange.run", &report) && called("steps.run", &report));
    // without it what is there is still called
    files.pop();
    let report = look(&zipped(&files, CompressionMethod::Stored), &[]);
    assert!(broken(&report).contains("bin.each_interface"), "{}", report.text());
    assert!(called("steps.run", &report) && !called("exchange.run", &report));
}

#[test]
fn a_check_that_calls_nothing_says_so() {
    let mut files = ours().clone();
    let name = binary();
    files.iter_mut().find(|(n, _)| *n == name).unwrap().0 =
        "binaries/Linux64/HubSlosh.so".to_string();
    files.push(("binaries/win64/HubSlosh.dll".into(), b"MZ".to_vec()));
    let report = look(&zipped(&files, CompressionMethod::Stored), &["zip", "bin.this_platform"]);
    let expected = BTreeSet::from(["zip.capitals", "bin.this_platform"]);
    assert_eq!(broken(&report), expected, "{}", report.text());
    assert!(report.count(Severity::Error) > 0);
}

#[test]
fn an_fmu_that_gives_no_instance_is_told_once() {
    let report = look(
        &changed("<fmiModelDescription", "guid=\"{", "guid=\"{x"),
        &["load", "life", "values", "steps"],
    );
    assert_eq!(broken(&report), BTreeSet::from(["load.instance"]), "{}", report.text());
}

fn hubslosh(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hubslosh")).args(arguments).output().unwrap()
}

#[test]
fn the_command_tells_people_by_text_and_machines_by_exit_code_and_junit() {
    let directory = tempfile::tempdir().unwrap();
    let good = packed_for_tests().to_str().unwrap();
    let (bad, junit) = (directory.path().join("bad.fmu"), directory.path().join("junit.xml"));
    std::fs::write(&bad, changed("name=\"hub.I\"", "start=\"0.322414\"", "start=\"-1\"")).unwrap();
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

#[test]
fn documentation_lists_the_rules() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../book/check.md");
    let page = std::fs::read_to_string(page).unwrap();
    assert!(
        page.contains(&check::table(RULES))
            && page.contains(&check::table(check::rules::fmi3::RULES)),
        "check.md is out of date: put what `hubslosh check --rules` prints under \"The rules\""
    );
}
