//! `hubslosh example`.

use std::path::PathBuf;

use anyhow::Result;
use experiments::example;
use host::fmi2::Fmu;

use super::DEFAULT_FMU;

/// Writes the example that travels with the FMU (modelDescription/HubSlosh/extra): torque and
/// answer.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  hubslosh pack && hubslosh example")]
pub struct ExampleArgs {
    /// The FMU that answers.
    #[arg(long, value_name = "FILE", default_value = DEFAULT_FMU)]
    fmu: PathBuf,
}

impl ExampleArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        let folder = pack::HUBSLOSH.folder().join(pack::HUBSLOSH.extra());
        example::write(&Fmu::open(&self.fmu)?, &folder)?;
        println!("wrote {}", folder.display());
        Ok(())
    }
}
