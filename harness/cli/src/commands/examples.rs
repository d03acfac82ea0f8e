use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use files::output;

use crate::fmu;

/// Lists the example scripts in Python, or copies them to a folder of your own.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  hubslosh examples\n  hubslosh examples --copy mine && python mine/0_your_own_tank/my_tank.py"
)]
pub struct ExamplesArgs {
    /// Folder for the copy; it must not exist yet.
    #[arg(long, value_name = "DIRECTORY")]
    copy: Option<PathBuf>,
}

impl ExamplesArgs {
    pub fn run(self) -> Result<()> {
        let found = fmu::shipped_folder("examples").or_else(|| {
            let source = ::pack::root().join("examples");
            source.is_dir().then_some(source)
        });
        let from = found.context(
            "the examples were not found: they come with the wheel of the Python package, or lie in \
             the folder examples of the project's source",
        )?;
        let Some(to) = self.copy else {
            for folder in folders(&from)? {
                let page = std::fs::read_to_string(folder.join("README.md")).unwrap_or_default();
                let title = page.lines().next().unwrap_or_default().trim_start_matches("# ");
                println!("{:28} {title}", name(&folder));
            }
            return Ok(());
        };
        ensure!(!to.exists(), "--copy {}: it exists already (allowed: a new folder)", to.display());
        let files = ::pack::wheel::examples(&from)?;
        for (name, bytes) in &files {
            let path = to.join(name);
            output::directory(path.parent().unwrap_or(&to))?;
            output::write(&path, bytes)?;
        }
        done!("{} files in {}", files.len(), to.display());
        Ok(())
    }
}

fn folders(examples: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(examples)
        .with_context(|| format!("{} cannot be read", examples.display()))?;
    let mut folders: Vec<PathBuf> =
        entries.flatten().map(|e| e.path()).filter(|p| p.join("README.md").is_file()).collect();
    folders.sort_by_key(|path| {
        let name = name(path);
        (name.split('_').next().and_then(|n| n.parse::<u32>().ok()), name)
    });
    Ok(folders)
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
