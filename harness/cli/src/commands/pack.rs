//! `hubslosh pack`.

use std::path::{Path, PathBuf};

use anyhow::Result;

use super::DEFAULT_FMU;

/// Builds the FMU's binary and packs it.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  hubslosh pack --out dist/HubSlosh.fmu\n  hubslosh pack --all-platforms"
)]
pub struct PackArgs {
    /// Where to put the FMU.
    #[arg(long, value_name = "FILE", default_value = DEFAULT_FMU)]
    out: PathBuf,
    /// For Linux, Windows and macOS instead of this machine's platform; on a Debian machine
    /// harness/platforms/setup gets what that takes.
    #[arg(long)]
    all_platforms: bool,
}

impl PackArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        if !self.all_platforms {
            return native(&self.out);
        }
        for built in ::pack::pack_all(&self.out)? {
            println!("{}: {}", built.folder, built.binary);
        }
        println!("packed {} ({} bytes)", self.out.display(), self.out.metadata()?.len());
        Ok(())
    }
}

/// Packs for this machine's platform.
pub fn native(out: &Path) -> Result<()> {
    ::pack::pack(out)?;
    println!("packed {}", out.display());
    Ok(())
}
