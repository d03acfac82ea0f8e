use std::fs::{self, File};
use std::io::Write;
use std::path::Path;

use anyhow::Result;
use files::output::{
    Destination, atomically, destination, hash_reader, publish_draft, sha256, write,
};

#[test]
fn sha_256_equals_the_example_of_the_standard() {
    // the one-block example of FIPS 180-4
    let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
    assert_eq!(sha256(b"abc"), expected);
    assert_eq!(hash_reader(&b"abc"[..]).unwrap(), expected);
}

#[test]
fn a_failed_write_leaves_the_old_file_and_no_temporary_file() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.txt");
    std::fs::write(&path, "old").unwrap();
    let failed: Result<()> = atomically(&path, |file| {
        file.write_all(b"half")?;
        anyhow::bail!("no more")
    });
    let error = format!("{:#}", failed.unwrap_err());
    assert_eq!(error, format!("{} cannot be written: no more", path.display()));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
}

#[cfg(unix)]
#[test]
fn writing_to_a_symbolic_link_writes_its_target_and_keeps_the_link() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    fs::create_dir(at("far")).unwrap();
    fs::write(at("far/old.csv"), "old").unwrap();
    let links = [("one.csv", "far/old.csv"), ("two.csv", "one.csv"), ("new.csv", "far/new.csv")];
    for (link, to) in links {
        std::os::unix::fs::symlink(to, at(link)).unwrap();
    }
    for (link, file) in [("two.csv", "far/old.csv"), ("new.csv", "far/new.csv")] {
        write(&at(link), link).unwrap();
        assert!(at(link).is_symlink() && !at(file).is_symlink());
        assert_eq!(fs::read_to_string(at(file)).unwrap(), link);
        fs::write(at("draft"), "draft").unwrap();
        publish_draft(&at("draft"), &at(link)).unwrap();
        assert_eq!(fs::read_to_string(at(file)).unwrap(), "draft");
        assert!(!at("draft").exists() && at(link).is_symlink());
    }
    std::os::unix::fs::symlink("circle", at("circle")).unwrap();
    let error = format!("{:#}", write(&at("circle"), "").unwrap_err());
    assert!(error.contains("a symbolic link that leads to itself"), "{error}");
    let error = format!("{:#}", write(&at("far"), "").unwrap_err());
    assert!(error.ends_with("cannot be written: it is a directory"), "{error}");
}

#[cfg(unix)]
#[test]
fn writing_to_a_named_pipe_sends_all_bytes_and_keeps_the_pipe() {
    use std::os::unix::fs::FileTypeExt;
    let directory = tempfile::tempdir().unwrap();
    let pipe = directory.path().join("a.csv");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for k in 0..2 {
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read(pipe).unwrap()
        });
        let bytes = vec![b'x'; 200_000]; // more than a pipe holds
        match k {
            0 => write(&pipe, &bytes).unwrap(),
            _ => {
                let draft = directory.path().join("draft");
                fs::write(&draft, &bytes).unwrap();
                publish_draft(&draft, &pipe).unwrap();
                assert!(!draft.exists());
            }
        }
        assert_eq!(reader.join().unwrap(), bytes);
        assert!(pipe.symlink_metadata().unwrap().file_type().is_fifo());
    }
}

/// Uses a copy of the device `/dev/full`, every write to which fails. Only root can create the
/// copy; for other users the test checks only that the device is recognised as a device.
#[cfg(target_os = "linux")]
#[test]
fn a_device_is_written_to_and_its_error_is_reported() {
    use std::os::unix::fs::FileTypeExt;
    let directory = tempfile::tempdir().unwrap();
    let full = directory.path().join("full");
    let made = std::process::Command::new("mknod").arg(&full).args(["c", "1", "7"]).output();
    let is_device = || full.symlink_metadata().is_ok_and(|f| f.file_type().is_char_device());
    if !made.unwrap().status.success() || File::open(&full).is_err() {
        // Without root the test uses the real device through a link, because this user cannot replace it.
        std::os::unix::fs::symlink("/dev/full", &full).unwrap();
        assert_eq!(destination(&full).unwrap(), Destination::Stream);
        return;
    }
    let error = format!("{:#}", write(&full, "bytes").unwrap_err());
    assert!(error.contains("full cannot be written: No space left"), "{error}");
    assert!(is_device());
    let draft = directory.path().join("draft");
    fs::write(&draft, "bytes").unwrap();
    assert!(publish_draft(&draft, &full).is_err() && draft.exists() && is_device());
}

#[cfg(target_os = "linux")]
#[test]
fn writing_to_dev_fd_appends_to_the_open_file() {
    use std::os::fd::AsRawFd;
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("log");
    fs::write(&path, "first ").unwrap();
    let open = File::options().append(true).open(&path).unwrap();
    write(Path::new(&format!("/dev/fd/{}", open.as_raw_fd())), "second").unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "first second");
}
