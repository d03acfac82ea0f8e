use std::path::PathBuf;

use anyhow::Result;
use experiments::example::Example;

use super::{DEFAULT_FMU, open};

/// Simulates the reference example that is part of an FMU. The inputs and outputs are written to
/// modelDescription/NAME/extra, from where `hubslosh pack` packs them into the FMU.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  hubslosh pack && hubslosh example\n  \
    hubslosh example --fmu Spacecraft")]
pub struct ExampleArgs {
    /// FMU: a file, or the name of an FMU of this project (`hubslosh fmus` lists them).
    #[arg(long, value_name = "FILE|NAME", default_value = DEFAULT_FMU)]
    pub fmu: PathBuf,
}

impl ExampleArgs {
    pub fn run(self) -> Result<()> {
        pack::needs_source("the example")?;
        let fmu = open(&self.fmu)?;
        let example = Example::for_fmu(&fmu)?;
        let model = pack::model(example.model)?;
        let folder = model.example();
        example.write(&fmu, &folder)?;
        done!("wrote {}", folder.display());
        Ok(())
    }
}
