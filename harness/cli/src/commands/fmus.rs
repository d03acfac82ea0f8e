//! `hubslosh fmus`.

use anyhow::{Result, ensure};

use crate::fmu;

/// Lists the files of the FMUs that came with this command, and of those in dist.
///
/// Options --fmu take their names: `Spacecraft-fmi3` is Spacecraft for FMI 3.0.
#[derive(clap::Args)]
pub struct FmusArgs {}

impl FmusArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        let all = fmu::all();
        ensure!(!all.is_empty(), "no FMU came with this command, and none is in dist");
        for path in all {
            println!("{}", path.display());
        }
        Ok(())
    }
}
