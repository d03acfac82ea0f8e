use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Result, bail};
use check::Severity;
use pack::{Model, release};

const DEFAULT_RELEASE: &str = "dist/release";

/// Builds and checks the files of a release for all platforms.
///
/// Each FMU is built for both versions of FMI, with its software bill of materials (SBOM) and the report of its check.
/// The wheels of the Python package are built in the folder of --wheels. The folder of --out receives their SBOMs and
/// the wheel for Linux. SHA256SUMS lists the files in the folder of --out. SHA256SUMS.all also lists the other wheels,
/// and the files of older versions, which the command removes from the folder.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  hubslosh release\n\n\
    On Debian, harness/platforms/setup installs the tools that building for all platforms needs.")]
pub struct ReleaseArgs {
    /// Releases only this FMU [default: all FMUs and the wheels].
    #[arg(long, value_name = "NAME", value_parser = pack::model)]
    model: Option<&'static Model>,
    /// Directory for the wheels of all platforms.
    #[arg(long, value_name = "DIRECTORY", default_value = "dist")]
    wheels: PathBuf,
    /// Directory for the files of the release.
    #[arg(long, value_name = "DIRECTORY", default_value = DEFAULT_RELEASE)]
    out: PathBuf,
}

impl ReleaseArgs {
    pub fn run(self) -> Result<()> {
        pack::needs_source("a release")?;
        let models = self.model.map_or(&pack::MODELS[..], std::slice::from_ref);
        for model in models {
            for path in release::write(model, &self.out, checked)? {
                done!("{} ({} bytes)", path.display(), path.metadata()?.len());
            }
        }
        if self.model.is_none() {
            for path in release::write_wheels(&self.wheels, &self.out)? {
                done!("{} ({} bytes)", path.display(), path.metadata()?.len());
            }
        }
        Ok(())
    }
}

fn checked(fmu: &Path) -> Result<String> {
    let mut report = super::check::checked(fmu, Vec::new(), Duration::from_secs(60))?;
    // The report names the FMU, not the temporary folder in which it was checked.
    report.path = fmu.file_name().unwrap_or_default().into();
    let text = report.text();
    match report.count_findings(Severity::Error) {
        0 => Ok(text),
        _ => bail!("nothing is released, because the FMU breaks rules:\n{text}"),
    }
}
