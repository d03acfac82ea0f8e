//! Files of other kinds than text in columns and Parquet (`.mat`, HDF5, TDMS, MDF4, Excel): calls the Python
//! package `hubslosh`, which converts them to text.

use std::io::{ErrorKind, Read as _};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use files::input;
use files::temporary::Folder;

/// The error for a file that only the Python package may be able to read. The text is the reason.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Foreign(pub String);

const ADVICE: &str = "the Python package reads .mat (5 and 7.3), HDF5, TDMS, MDF4, .xlsx and every type of Parquet: \
    pip install 'hubslosh[recordings]', then python3 -m hubslosh.recordings FILE FILE.csv writes text that is read here";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Text,
    Parquet,
}

/// Detects the kind of a file from its first bytes.
///
/// # Errors
/// [`Foreign`] if it is neither text nor Parquet.
pub fn kind(path: &Path) -> Result<Kind> {
    const PACKED: [(&[u8], &str); 3] = [
        (b"\x1f\x8b", "the file is compressed with gzip: unpack it first (gunzip)"),
        (b"\x28\xb5\x2f\xfd", "the file is compressed with zstd: unpack it first (unzstd)"),
        (
            b"SQLite format 3",
            "the file is an SQLite database, as a ROS 2 bag is: export the topics as CSV",
        ),
    ];
    let mut start = Vec::new();
    input::open(path).context("the file cannot be opened")?.take(4096).read_to_end(&mut start)?;
    if let Some((_, words)) = PACKED.iter().find(|(sign, _)| start.starts_with(sign)) {
        bail!("{words}");
    }
    if [&b"\xff\xfe"[..], b"\xfe\xff"].iter().any(|mark| start.starts_with(mark)) {
        bail!("the file is in UTF-16; save it as UTF-8");
    }
    match start.contains(&0) {
        _ if start.starts_with(b"PAR1") => Ok(Kind::Parquet),
        true => Err(Foreign("the file is neither text in columns nor Parquet".into()).into()),
        false => Ok(Kind::Text),
    }
}

/// Converts a file to text in columns with the Python package. The folder with the text is deleted when the
/// returned value is dropped. `why` is the reason why the file was not read here.
///
/// # Errors
/// If no Python with the package is found, or the package cannot read the file.
pub fn converted(path: &Path, why: &anyhow::Error) -> Result<(Folder, PathBuf)> {
    let folder = Folder::new()?;
    let out = folder.path().join("recording.csv");
    let name = if cfg!(windows) { "python.exe" } else { "python3" };
    let program = std::env::current_exe().ok().and_then(|own| Some(own.parent()?.join(name)));
    let given = std::env::var_os("HUBSLOSH_PYTHON").map(PathBuf::from);
    for python in given.into_iter().chain(program).chain([name.into()]) {
        // -P prevents Python from taking a folder hubslosh in the working directory for the package.
        let mut command = Command::new(python);
        command.args(["-P", "-m", "hubslosh.recordings"]).arg(path).arg(&out);
        let done = match command.output() {
            Err(error) if error.kind() == ErrorKind::NotFound => continue,
            done => done.context("Python cannot be started")?,
        };
        if done.status.success() {
            return Ok((folder, out));
        }
        let words = String::from_utf8_lossy(&done.stderr);
        // If the last line is no error of the package, Python lacks the package or has an
        // older version of it.
        let is_there = words.lines().last().and_then(|line| line.strip_prefix("error: "));
        if let Some(words) = is_there {
            bail!("{words}");
        }
    }
    bail!("{why}; {ADVICE}")
}
