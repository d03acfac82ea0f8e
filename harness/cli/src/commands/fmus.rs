use anyhow::{Result, ensure};

use crate::fmu;

/// Lists the files of the FMUs that are installed with this command or in the folder dist.
///
/// The option --fmu of other commands takes their names, such as Spacecraft, or Spacecraft-fmi3 for FMI 3.0.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  hubslosh fmus")]
pub struct FmusArgs {}

impl FmusArgs {
    pub fn run(self) -> Result<()> {
        let all = fmu::all();
        ensure!(
            !all.is_empty(),
            "no FMU was found in dist or among the files installed with this command; `hubslosh pack` builds one in the project's source"
        );
        for path in all {
            println!("{}", path.display());
        }
        Ok(())
    }
}
