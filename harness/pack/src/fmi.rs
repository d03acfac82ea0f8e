//! Names of files and folders that differ between archives of FMI 2.0 and 3.0.

use std::path::{Path, PathBuf};

/// A form in which an FMU is packed. The binary is the same in all forms, but the description and
/// the names in the archive differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fmi {
    V2,
    V3,
    /// FMI 3.0 with array variables. Structural parameters determine the sizes of some arrays.
    V3Arrays,
}

impl Fmi {
    pub const ALL: [Fmi; 3] = [Fmi::V2, Fmi::V3, Fmi::V3Arrays];

    /// Returns the folders in `binaries/` for a platform, which is given by its folder in FMI 2.0.
    /// FMI 3.0 has two folders for the universal binary of macOS, one for each processor.
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

    pub fn icon(self) -> &'static str {
        match self {
            Fmi::V2 => "model.png",
            Fmi::V3 | Fmi::V3Arrays => "terminalsAndIcons/icon.png",
        }
    }

    pub fn suffix(self) -> &'static str {
        match self {
            Fmi::V2 => "",
            Fmi::V3 => "-fmi3",
            Fmi::V3Arrays => "-fmi3-arrays",
        }
    }

    /// Returns the path of an FMU in `folder`: `NAME.fmu`, for FMI 3.0 `NAME-fmi3.fmu` and
    /// `NAME-fmi3-arrays.fmu`. The file name may differ from the name of the library, because hosts
    /// take the library's name from the description.
    pub fn path(self, folder: &Path, name: &str) -> PathBuf {
        folder.join(format!("{name}{}.fmu", self.suffix()))
    }
}
