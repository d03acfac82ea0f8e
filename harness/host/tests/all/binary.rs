use host::binary::{Binary, GLIBC, Kind, MACOS, Version, join, part};
use object::{elf, macho};
use sha2::{Digest, Sha256};

fn faultless(kind: Kind) -> Binary {
    let (architectures, library, needs) = match kind {
        Kind::Linux => (vec!["x86_64"], "libc.so.6", Some(GLIBC)),
        Kind::LinuxArm => (vec!["arm64"], "ld-linux-aarch64.so.1", Some(GLIBC)),
        Kind::Windows => (vec!["x86_64"], "KERNEL32.dll", None),
        Kind::MacOs => (vec!["x86_64", "arm64"], "/usr/lib/libSystem.B.dylib", Some(MACOS)),
    };
    Binary {
        kind,
        size: 1,
        architectures,
        libraries: vec![library.into()],
        search_paths: Vec::new(),
        needs,
        exports: vec!["fmi2DoStep".into()],
        signature: None,
    }
}

#[test]
fn a_binary_that_needs_only_system_libraries_is_accepted() {
    for kind in [Kind::Linux, Kind::LinuxArm, Kind::Windows, Kind::MacOs] {
        assert_eq!(faultless(kind).faults(&["fmi2DoStep"]), [""; 0], "{kind:?}");
    }
}

#[test]
fn all_faults_of_a_binary_are_reported_at_once() {
    let mut linux = faultless(Kind::Linux);
    linux.libraries.push("libgcc_s.so.1".into());
    linux.needs = Some(Version(2, 34));
    linux.exports.push("rust_eh_personality".into());
    linux.search_paths.push("/opt/lib".into());
    assert_eq!(
        linux.faults(&["fmi2DoStep", "fmi2Reset"]),
        [
            "it needs libgcc_s.so.1, which is not guaranteed on every system",
            "it needs glibc 2.34 (allowed: at most 2.17)",
            "it makes the loader search /opt/lib for libraries",
            "it does not export fmi2Reset",
            "it also exports rust_eh_personality (allowed: functions of FMI)",
        ]
    );
    let mut windows = faultless(Kind::Windows);
    windows.libraries.push("VCRUNTIME140.dll".into());
    assert_eq!(windows.faults(&[]).len(), 1);
    let mut macos = faultless(Kind::MacOs);
    macos.architectures.pop();
    macos.needs = Some(Version(12, 0));
    macos.signature = Some("it is not signed".into());
    assert_eq!(macos.faults(&[]).len(), 3);
}

/// Returns a shared library for Linux that needs the versions of glibc with these names: an ELF header, the texts, a table of
/// needed versions, and three section headers.
fn elf_that_needs(versions: &[&str]) -> Vec<u8> {
    let (mut texts, mut needed) = (b"\0libc.so.6\0".to_vec(), Vec::new());
    // Elf64_Verneed: version, number of names, offset of the library's name, offset of the first name, offset of the next
    // library
    needed.extend([1u16, versions.len() as u16].iter().flat_map(|n| n.to_le_bytes()));
    needed.extend([1u32, 16, 0].iter().flat_map(|n| n.to_le_bytes()));
    for (i, name) in versions.iter().enumerate() {
        // Elf64_Vernaux: hash, flags and index, offset of the name, offset of the next entry
        let next = if i + 1 == versions.len() { 0 } else { 16 };
        let entry = [0, (i as u32 + 2) << 16, texts.len() as u32, next];
        needed.extend(entry.iter().flat_map(|n: &u32| n.to_le_bytes()));
        texts.extend(name.bytes().chain([0]));
    }
    let (begin, end) = (64 + texts.len() as u64, (64 + texts.len() + needed.len()) as u64);
    let mut bytes = b"\x7fELF\x02\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
    bytes.extend([3u16, elf::EM_X86_64].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend(1u32.to_le_bytes());
    bytes.extend([0, 0, end].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend(0u32.to_le_bytes());
    // size of this header, no program headers, size and number of the section headers, section with the names of sections
    bytes.extend([64u16, 0, 0, 64, 3, 1].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend(&texts);
    bytes.extend(&needed);
    for (kind, offset, size, link, info) in [
        (0, 0, 0, 0, 0),
        (elf::SHT_STRTAB, 64, texts.len() as u64, 0, 0),
        (elf::SHT_GNU_VERNEED, begin, needed.len() as u64, 1, 1),
    ] {
        bytes.extend([0, kind].iter().flat_map(|n: &u32| n.to_le_bytes()));
        bytes.extend([0, 0, offset, size].iter().flat_map(|n: &u64| n.to_le_bytes()));
        bytes.extend([link, info].iter().flat_map(|n: &u32| n.to_le_bytes()));
        bytes.extend([1u64, 0].iter().flat_map(|n| n.to_le_bytes()));
    }
    bytes
}

#[test]
fn glibc_versions_are_compared_as_numbers() {
    let needs = |versions: &[&str]| Binary::read(&elf_that_needs(versions)).unwrap().needs;
    assert_eq!(needs(&["GLIBC_2.4", "GLIBC_2.14"]), Some(Version(2, 14)));
    assert_eq!(needs(&["GLIBC_2.14", "GLIBC_2.4"]), Some(Version(2, 14)));
    assert_eq!(needs(&["GLIBC_2.2.5"]), Some(Version(2, 2)));
    assert_eq!(needs(&["GLIBC_PRIVATE"]), None);
}

/// Returns a library for macOS of 5000 bytes, which are two pages of 4096 bytes, and a code signature. The 5000 bytes begin with
/// the header and the command that locates the signature of 128 bytes.
fn signed_mach_o() -> Vec<u8> {
    let mut code = vec![7u8; 5000];
    let header = [macho::MH_MAGIC_64, macho::CPU_TYPE_ARM64, 0, macho::MH_DYLIB, 1, 16, 0, 0];
    let command = [macho::LC_CODE_SIGNATURE, 16, 5000, 128];
    for (place, number) in code.chunks_mut(4).zip([&header[..], &command].concat()) {
        place.copy_from_slice(&number.to_le_bytes());
    }
    let mut directory = vec![0u8; 44];
    let mut put = |at: usize, number: u32| {
        directory[at..at + 4].copy_from_slice(&number.to_be_bytes());
    };
    put(0, 0xfade_0c02);
    put(16, 44); // the hashes follow
    put(28, 2);
    put(32, 5000);
    directory[36..40].copy_from_slice(&[32, 2, 0, 12]);
    let mut signature: Vec<u8> =
        [0xfade_0cc0u32, 0, 1, 0, 20].iter().flat_map(|n| n.to_be_bytes()).collect();
    signature.extend(directory);
    for page in code.chunks(4096) {
        signature.extend(Sha256::digest(page).iter());
    }
    [code, signature].concat()
}

#[test]
fn the_code_signature_of_a_macos_binary_is_valid_only_for_unchanged_code() {
    let fault = |bytes: &[u8]| Binary::read(bytes).unwrap().signature;
    let signed = signed_mach_o();
    assert_eq!(fault(&signed), None);
    let mut changed = signed.clone();
    changed[4500] = 8;
    let why = "it was changed after it was signed (pages that differ: 1)";
    assert_eq!(fault(&changed).as_deref(), Some(why));
    let mut short = signed.clone();
    short[44] = 30; // size of the signature
    assert_eq!(fault(&short).as_deref(), Some("its signature cannot be read"));
    // With another command in place of the one that locates the signature, the library is not signed.
    let mut unsigned = signed;
    unsigned[32] = 0x26; // LC_FUNCTION_STARTS
    assert_eq!(fault(&unsigned).as_deref(), Some("it is not signed"));
}

#[test]
fn damaged_bytes_are_refused_as_a_binary() {
    for bytes in [&b""[..], b"MZ", b"\x7fELF\x02\x01\x01", &[0xca, 0xfe, 0xba, 0xbe, 0, 0, 0, 9]] {
        assert!(Binary::read(bytes).is_err());
    }
    assert!(join(&[b"no Mach-O".to_vec()]).is_err());
}

#[test]
fn a_universal_macos_binary_contains_the_two_binaries_that_were_joined() {
    let thin = |processor: u32, length: usize| {
        let mut bytes = vec![7u8; length];
        for (i, number) in [macho::MH_MAGIC_64, processor, 3].into_iter().enumerate() {
            bytes[4 * i..][..4].copy_from_slice(&number.to_le_bytes());
        }
        bytes
    };
    let parts = [thin(macho::CPU_TYPE_X86_64, 20_000), thin(macho::CPU_TYPE_ARM64, 100)];
    let whole = join(&parts).unwrap();
    assert_eq!(part(&whole, "x86_64"), parts[0]);
    assert_eq!(part(&whole, "arm64"), parts[1]);
    assert_eq!(part(&whole, "riscv64"), whole);
    assert_eq!(part(&parts[1], "arm64"), parts[1]);
}
