use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail, ensure};
use host::description::ModelDescription;
use host::part::{Limit, start_values};
use pack::platforms::{self, PLATFORMS, Platform};
use pack::{Fmi, Model, sdist, wheel};

use crate::set_file;

/// Builds and packs an FMU, or the Python package as a wheel with all FMUs and this command.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  hubslosh pack --out dist/HubSlosh.fmu\n  hubslosh pack --all-platforms\n  \
                  hubslosh pack --model Spacecraft --tanks 1 --modes 1\n  \
                  hubslosh pack --fmi 3\n  hubslosh pack --fmi 3 --arrays\n  \
                  hubslosh pack --python\n  hubslosh pack --python --all-platforms\n  hubslosh pack --sdist"
)]
pub struct PackArgs {
    /// FMU to pack: HubSlosh, Spacecraft or SloshTank.
    #[arg(long, value_name = "NAME", default_value = pack::HUBSLOSH.name, value_parser = pack::model)]
    model: &'static Model,
    /// Version of FMI, 2 or 3. The binary is the same for both.
    #[arg(long, value_name = "2|3", default_value = "2", value_parser = fmi, conflicts_with_all = ["python", "sdist"])]
    fmi: Fmi,
    /// FMI 3.0 only: describes vectors and matrices as array variables, and the numbers of tanks and modes as structural
    /// parameters, which a host can set before initialization. The binary is the same as without this flag.
    #[arg(long, conflicts_with_all = ["python", "sdist"])]
    arrays: bool,
    /// Packs the Python package as a wheel instead of an FMU, with all FMUs and the command hubslosh inside.
    #[arg(long, conflicts_with = "model")]
    python: bool,
    /// Builds only for these platforms, which are named as the folders of binaries in an FMU, such as win64 or
    /// aarch64-linux. Like --all-platforms it needs the tools for building for other platforms.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', conflicts_with_all = ["all_platforms", "sdist"], value_parser = platforms::platform)]
    platform: Vec<&'static Platform>,
    /// Packs the source of the Python package as an sdist, from which pip builds the package, instead of an FMU.
    #[arg(long, conflicts_with_all = ["model", "python", "all_platforms"])]
    sdist: bool,
    /// File for the FMU, or folder for wheels and sdist [default for an FMU: dist/NAME.fmu, dist/NAME-fmi3.fmu or
    /// dist/NAME-fmi3-arrays.fmu; for wheels and sdist: dist].
    #[arg(long, value_name = "FILE|FOLDER")]
    out: Option<PathBuf>,
    /// Number of tanks of Spacecraft, 1 to 4, whose variables the model description contains. With fewer tanks, hosts
    /// that show every variable to the user have a shorter list. The binary is the same for any number.
    #[arg(long, value_name = "NUMBER", conflicts_with_all = ["python", "sdist", "arrays"])]
    tanks: Option<usize>,
    /// Number of slosh modes per tank whose variables the model description contains. Without this option Spacecraft and
    /// SloshTank have 3 modes, and HubSlosh has 10. The option changes only the model description, not the binary.
    #[arg(long, value_name = "NUMBER", conflicts_with_all = ["python", "sdist", "arrays"])]
    modes: Option<usize>,
    /// Number of modes of flexible appendages of Spacecraft, 0 to 6, whose variables the model description contains.
    /// This option needs --tanks or --modes [default: 0].
    #[arg(long, value_name = "NUMBER", conflicts_with_all = ["python", "sdist", "arrays"])]
    appendages: Option<usize>,
    /// File of parameters (.toml, .ssv, .json) that become the start values of the FMU, so that a host does not have to set
    /// them. This option needs --tanks or --modes.
    #[arg(long, value_name = "FILE")]
    parameters: Option<PathBuf>,
    /// Builds for Linux, Windows and macOS instead of this machine's platform only: one FMU with all binaries, one wheel
    /// for each platform. On Debian, harness/platforms/setup installs the tools.
    #[arg(long)]
    all_platforms: bool,
}

impl PackArgs {
    pub fn run(self) -> Result<()> {
        pack::needs_source("an FMU")?;
        let platforms = match self.all_platforms {
            true => PLATFORMS.iter().collect(),
            false => self.platform.clone(),
        };
        if self.python || self.sdist {
            let folder = self.out.unwrap_or_else(|| "dist".into());
            let packed = match self.sdist {
                true => vec![sdist::write(&folder)?],
                false if platforms.is_empty() => vec![wheel::write(&folder)?],
                false => wheel::write_for(&platforms, &folder)?,
            };
            for file in packed {
                done!("packed {} ({} bytes)", file.display(), file.metadata()?.len());
            }
            return Ok(());
        }
        let model = self.model;
        let fmi = match (self.fmi, self.arrays) {
            (fmi, false) => fmi,
            (Fmi::V2, true) => bail!("FMI 2.0 has no arrays (allowed with --arrays: --fmi 3)"),
            _ => Fmi::V3Arrays,
        };
        let limits = self.limits()?;
        let name =
            limits.iter().fold(model.name.to_string(), |name, limit| match limit.parameter {
                "tanks" => format!("{name}_{}", limit.size),
                "appendages" if limit.size == 0 => name,
                _ if limits.len() > 1 => format!("{name}x{}", limit.size),
                _ => format!("{name}_{}", limit.size),
            });
        let out = self.out.clone().unwrap_or_else(|| fmi.path("dist".as_ref(), &name));
        if platforms.is_empty() {
            pack::pack(model, fmi, &out)?;
            self.reduce(&limits, &out)?;
            done!("packed {}", out.display());
            return Ok(());
        }
        for built in pack::pack_for(&platforms, model, fmi, &out)? {
            done!("{}: {}", built.folder, built.binary);
        }
        self.reduce(&limits, &out)?;
        done!("packed {} ({} bytes)", out.display(), out.metadata()?.len());
        Ok(())
    }

    /// Returns the limits that `--tanks`, `--modes` and `--appendages` put on the sizes of the
    /// FMU's arrays. The list is empty without these options.
    fn limits(&self) -> Result<Vec<Limit<'static>>> {
        let sizes = match self.model.name {
            "HubSlosh" => names::hubslosh::SIZES,
            "Spacecraft" => names::spacecraft::SIZES,
            "SloshTank" => names::sloshtank::SIZES,
            _ => &[],
        };
        let has_tanks = sizes.iter().any(|size| size.parameter == "tanks");
        ensure!(
            self.tanks.is_none() || has_tanks,
            "{} has one tank: --tanks is for Spacecraft",
            self.model.name
        );
        if self.tanks.is_none() && self.modes.is_none() {
            ensure!(self.parameters.is_none(), "--parameters needs --tanks or --modes");
            ensure!(self.appendages.is_none(), "--appendages needs --tanks or --modes");
            return Ok(Vec::new());
        }
        ensure!(
            self.appendages.is_none() || has_tanks,
            "{} has no appendages: --appendages is for Spacecraft",
            self.model.name
        );
        let limit = |of: &'static names::Size| {
            let names::Size { parameter, most, has_indicators, arrays } = *of;
            let (option, given, least) = match parameter {
                "tanks" => ("--tanks", self.tanks, 1),
                "appendages" => ("--appendages", Some(self.appendages.unwrap_or(0)), 0),
                _ => ("--modes", self.modes, 1),
            };
            let size = given.unwrap_or(most);
            ensure!((least..=most).contains(&size), "{option} {size} (allowed: {least} to {most})");
            Ok(Limit { parameter, size, most, has_indicators, arrays })
        };
        sizes.iter().map(limit).collect()
    }

    fn reduce(&self, limits: &[Limit], fmu: &Path) -> Result<()> {
        if limits.is_empty() {
            return Ok(());
        }
        let mut starts = BTreeMap::new();
        if let Some(path) = &self.parameters {
            let description = || ModelDescription::from_fmu(fmu);
            let settings = set_file::read(path, &description)?;
            starts = start_values(&description()?, settings)?;
        }
        pack::part::pack(fmu, limits, &starts, fmu)
    }
}

fn fmi(text: &str) -> Result<Fmi> {
    match text {
        "2" | "2.0" => Ok(Fmi::V2),
        "3" | "3.0" => Ok(Fmi::V3),
        _ => bail!("FMI \"{text}\" is not supported (allowed: 2, 3)"),
    }
}

pub fn native(model: &Model, fmi: Fmi, out: &Path) -> Result<()> {
    pack::pack(model, fmi, out)?;
    done!("packed {}", out.display());
    Ok(())
}
