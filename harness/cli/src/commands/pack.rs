//! `hubslosh pack`.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use pack::platforms::{self, PLATFORMS, Platform};
use pack::{Fmi, Model, sdist, wheel};

/// Builds the binary of an FMU and packs it, or the Python package with all FMUs and this command inside.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  hubslosh pack --out dist/HubSlosh.fmu\n  hubslosh pack --all-platforms\n  \
                  hubslosh pack --model Spacecraft --tanks 1 --modes 1\n  \
                  hubslosh pack --fmi 3\n  hubslosh pack --fmi 3 --arrays\n  \
                  hubslosh pack --python\n  hubslosh pack --python --all-platforms\n  hubslosh pack --sdist"
)]
pub struct PackArgs {
    /// The FMU to pack.
    #[arg(long, value_name = "NAME", default_value = pack::HUBSLOSH.name, value_parser = pack::model)]
    model: &'static Model,
    /// Version of FMI, 2 or 3; the binary is the same.
    #[arg(long, value_name = "2|3", default_value = "2", value_parser = fmi, conflicts_with_all = ["python", "sdist"])]
    fmi: Fmi,
    /// FMI 3.0 only: vectors and matrices are array variables, and the numbers of tanks and modes are structural parameters that
    /// a host can set before initialization. The binary is the same.
    #[arg(long, conflicts_with_all = ["python", "sdist"])]
    arrays: bool,
    /// Pack the Python package instead, with all FMUs and the command hubslosh inside, as a wheel.
    #[arg(long, conflicts_with = "model")]
    python: bool,
    /// Wheels for these platforms alone, by their folders in an FMU; as --all-platforms otherwise.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', requires = "python", conflicts_with = "all_platforms", value_parser = platforms::platform)]
    platform: Vec<&'static Platform>,
    /// Pack the source as an sdist instead, from which pip builds the Python package.
    #[arg(long, conflicts_with_all = ["model", "python", "all_platforms"])]
    sdist: bool,
    /// File for the FMU, or folder for wheels and sdist [default: dist/NAME.fmu, dist/NAME-fmi3.fmu, dist/NAME-fmi3-arrays.fmu, dist].
    #[arg(long, value_name = "FILE|FOLDER")]
    out: Option<PathBuf>,
    /// Spacecraft only: packs a variant with this many tanks, 1 to 4, and no variables for further ones. With one tank of one
    /// mode its name is Spacecraft_1x1.
    #[arg(long, value_name = "NUMBER", conflicts_with = "python")]
    tanks: Option<usize>,
    /// Spacecraft only: packs a variant with this many slosh modes of each tank, 1 to 3.
    #[arg(long, value_name = "NUMBER", conflicts_with = "python")]
    modes: Option<usize>,
    /// Builds for Linux, Windows and macOS instead of this machine's platform: one FMU for all, one wheel for each. On Debian,
    /// harness/platforms/setup installs the tools.
    #[arg(long)]
    all_platforms: bool,
}

impl PackArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        pack::needs_source("an FMU")?;
        if self.python || self.sdist {
            let folder = self.out.unwrap_or_else(|| "dist".into());
            let packed = match self.sdist {
                true => vec![sdist::write(&folder)?],
                false if self.all_platforms => wheel::write_for(&PLATFORMS.each_ref(), &folder)?,
                false if !self.platform.is_empty() => wheel::write_for(&self.platform, &folder)?,
                false => vec![wheel::write(&folder)?],
            };
            for file in packed {
                done!("packed {} ({} bytes)", file.display(), file.metadata()?.len());
            }
            return Ok(());
        }
        let variant;
        let model = match (self.tanks, self.modes) {
            (None, None) => self.model,
            (tanks, modes) => {
                variant = self.model.variant(tanks, modes)?;
                &variant
            }
        };
        let fmi = match (self.fmi, self.arrays) {
            (fmi, false) => fmi,
            (Fmi::V2, true) => bail!("FMI 2.0 has no arrays (allowed with --arrays: --fmi 3)"),
            _ => Fmi::V3Arrays,
        };
        let out = self.out.unwrap_or_else(|| fmi.path("dist".as_ref(), &model.identifier()));
        if !self.all_platforms {
            return native(model, fmi, &out);
        }
        for built in pack::pack_all(model, fmi, &out)? {
            done!("{}: {}", built.folder, built.binary);
        }
        done!("packed {} ({} bytes)", out.display(), out.metadata()?.len());
        Ok(())
    }
}

fn fmi(text: &str) -> Result<Fmi> {
    match text {
        "2" | "2.0" => Ok(Fmi::V2),
        "3" | "3.0" => Ok(Fmi::V3),
        _ => bail!("there is no FMI \"{text}\" here (allowed: 2, 3)"),
    }
}

/// Packs for this machine's platform.
pub fn native(model: &Model, fmi: Fmi, out: &Path) -> Result<()> {
    pack::pack(model, fmi, out)?;
    done!("packed {}", out.display());
    Ok(())
}
