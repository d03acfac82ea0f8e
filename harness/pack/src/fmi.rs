//! File and folder names that differ between archives of FMI 2.0 and 3.0.

use std::path::{Path, PathBuf};

/// A version of FMI that FMUs are packed for: the same binary, another description, other names in the archive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fmi {
    /// FMI 2.0
    V2,
    /// FMI 3.0
    V3,
    /// FMI 3.0 with arrays as variables, some of them sized by structural parameters.
    V3Arrays,
}

impl Fmi {
    /// All of them.
    pub const ALL: [Fmi; 3] = [Fmi::V2, Fmi::V3, Fmi::V3Arrays];

    /// Versions of FMI in releases and wheels.
    pub const RELEASED: [Fmi; 2] = [Fmi::V2, Fmi::V3];

    /// Folders under `binaries/` for a platform that is known by its folder in FMI 2.0. The two parts of a universal binary
    /// for macOS lie in two of FMI 3.0.
    pub fn folders(self, platform: &'static str) -> &'static [&'static str] {
        match (self, platform) {
            (Fmi::V3 | Fmi::V3Arrays, "linux64") => &["x86_64-linux"],
            (Fmi::V3 | Fmi::V3Arrays, "win64") => &["x86_64-windows"],
            (Fmi::V3 | Fmi::V3Arrays, "darwin64") => &["aarch64-darwin", "x86_64-darwin"],
            (_, "linux64") => &["linux64"],
            (_, "win64") => &["win64"],
            (_, "darwin64") => &["darwin64"],
            (_, "aarch64-linux") => &["aarch64-linux"],
            (_, "aarch64-windows") => &["aarch64-windows"],
            (_, "aarch64-darwin") => &["aarch64-darwin"],
            _ => &[],
        }
    }

    /// The icon's name in the archive.
    pub fn icon(self) -> &'static str {
        match self {
            Fmi::V2 => "model.png",
            Fmi::V3 | Fmi::V3Arrays => "terminalsAndIcons/icon.png",
        }
    }

    /// Suffix of the FMU's file name.
    pub fn suffix(self) -> &'static str {
        match self {
            Fmi::V2 => "",
            Fmi::V3 => "-fmi3",
            Fmi::V3Arrays => "-fmi3-arrays",
        }
    }

    /// The FMU of that name in a folder: `NAME.fmu`, of FMI 3.0 `NAME-fmi3.fmu` and `NAME-fmi3-arrays.fmu`. Hosts take the name of the library
    /// from the description, not from the file.
    pub fn path(self, folder: &Path, name: &str) -> PathBuf {
        folder.join(format!("{name}{}.fmu", self.suffix()))
    }
}
