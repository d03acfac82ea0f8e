//! `hubslosh pack`.

use std::path::{Path, PathBuf};

use anyhow::Result;
use pack::{Model, wheel};

/// Builds the binary of an FMU and packs it, or the Python package with all FMUs inside.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  hubslosh pack --out dist/HubSlosh.fmu\n  hubslosh pack --all-platforms\n  \
                  hubslosh pack --python"
)]
pub struct PackArgs {
    /// Which FMU.
    #[arg(long, value_name = "NAME", default_value = pack::HUBSLOSH.name, value_parser = pack::model)]
    model: &'static Model,
    /// Pack the Python package instead, with all FMUs inside, as a wheel.
    #[arg(long, conflicts_with = "model")]
    python: bool,
    /// Where to put the FMU or the wheel [default: dist/NAME.fmu,
    /// dist/hubslosh-VERSION-py3-none-any.whl].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// For Linux, Windows and macOS instead of this machine's platform; on a Debian machine
    /// harness/platforms/setup gets what that takes.
    #[arg(long)]
    all_platforms: bool,
}

impl PackArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        if self.python {
            let out = self.out.unwrap_or_else(|| Path::new("dist").join(wheel::name()));
            let platforms = wheel::write(&out, self.all_platforms)?;
            println!("packed {}, FMUs for {}", out.display(), platforms.join(", "));
            return Ok(());
        }
        let out = self.out.unwrap_or_else(|| format!("dist/{}.fmu", self.model.name).into());
        if !self.all_platforms {
            return native(self.model, &out);
        }
        for built in pack::pack_all(self.model, &out)? {
            println!("{}: {}", built.folder, built.binary);
        }
        println!("packed {} ({} bytes)", out.display(), out.metadata()?.len());
        Ok(())
    }
}

/// Packs for this machine's platform.
pub fn native(model: &Model, out: &Path) -> Result<()> {
    pack::pack(model, out)?;
    println!("packed {}", out.display());
    Ok(())
}
