//! Rules of the binaries, and our own FMU.

use std::collections::BTreeSet;

use check::binaries::platform;
use check::{RULES, Severity};
use host::binary::Kind;
use host::fmi2::PLATFORM;
use pack::packed_for_tests;
use zip::CompressionMethod;

use crate::common::{
    binary, breaks, broken_rules, changed, check_bytes, check_rules, our_files, with, zipped,
};

#[test]
fn our_own_fmu_breaks_no_rule() {
    let report = check_rules(packed_for_tests(), &[], 120.0);
    // A plain build for this machine uses its newer glibc and libgcc, which breaks bin.system. Builds by `pack
    // --all-platforms` do not use them, and are checked when they are packed.
    let others: Vec<_> = report.all().filter(|(rule, _)| rule.id != "bin.system").collect();
    assert!(others.is_empty(), "{}", report.text());
    assert_eq!(report.count_findings(Severity::Error), 0);
    let skipped: Vec<_> =
        report.outcomes.iter().filter_map(|o| o.findings.skipped.clone()).collect();
    // One rule is skipped because no output and no state of our FMU has a range.
    assert_eq!(
        skipped,
        ["the FMU has no resources", "no variable that the FMU computes has a min or a max"]
    );
    assert_eq!(report.outcomes.len(), RULES.len());
}

#[test]
fn binaries_that_no_host_can_use_are_reported() {
    let name = binary();
    let ours = our_files().iter().find(|(n, _)| *n == name).unwrap().1.clone();
    let at = |text: &[u8]| ours.windows(text.len()).position(|w| w == text).unwrap();
    let patched = |text: &[u8], to: &[u8]| {
        let mut bytes = ours.clone();
        bytes[at(text)..][..to.len()].copy_from_slice(to);
        zipped(&with(&name, bytes), CompressionMethod::Stored)
    };
    let renamed = |to: &str| {
        let mut files = self::our_files().clone();
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
        let mut files = self::our_files().clone();
        files.retain(|(n, _)| *n != name);
        files.push(("binaries/linux64/HubSlosh.so".into(), x86_64.into()));
        files.push(("binaries/aarch64-linux/HubSlosh.so".into(), aarch64.into()));
        zipped(&files, CompressionMethod::Stored)
    };
    // Each group of rules is checked separately, because a plain build breaks bin.system, too.
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

/// The folder of the binary has wrong capitals, so that no binary for this platform is found.
#[test]
fn a_check_that_could_not_call_the_fmu_states_this_in_its_report() {
    let mut files = our_files().clone();
    let name = binary();
    files.iter_mut().find(|(n, _)| *n == name).unwrap().0 =
        "binaries/Linux64/HubSlosh.so".to_string();
    files.push(("binaries/win64/HubSlosh.dll".into(), b"MZ".to_vec()));
    let report =
        check_bytes(&zipped(&files, CompressionMethod::Stored), &["zip", "bin.this_platform"]);
    let expected = BTreeSet::from(["zip.capitals", "bin.this_platform"]);
    assert_eq!(broken_rules(&report), expected, "{}", report.text());
    assert!(report.count_findings(Severity::Error) > 0);
}

#[test]
fn binary_folders_are_recognised_as_platforms_tuples_or_vendor_names() {
    for (folder, ending, kind) in [
        ("linux64", ".so", Some(Kind::Linux)),
        ("win32", ".dll", None),
        ("aarch64-linux-gnu", ".so", Some(Kind::LinuxArm)),
        ("aarch64-darwin", ".dylib", Some(Kind::MacOs)),
        ("x86_64-windows-msvc143", ".dll", Some(Kind::Windows)),
        ("aarch32-linux-gnueabihf", ".so", None),
    ] {
        assert_eq!(platform(folder), Some((ending, kind)), "{folder}");
    }
    for vendors in ["VisualStudio8", "gcc4", "arm-linux-gnueabihf", "linux-64", "x86_64"] {
        assert_eq!(platform(vendors), None, "{vendors}");
    }
}
