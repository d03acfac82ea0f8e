//! `hubslosh fmus`.

use anyhow::{Result, ensure};

use crate::fmu;

/// Lists the files of the FMUs that came with this command, and of those in dist.
///
/// Options --fmu take their names: `Spacecraft_2x2-fmi3` is Spacecraft with two tanks of two modes for FMI 3.0. `Spacecraft` has
/// four tanks of three modes. Other variants need the project's source and Rust: `hubslosh pack --model Spacecraft --tanks 3`.
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
