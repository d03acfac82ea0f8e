//! `hubslosh completions`.

use anyhow::Result;
use clap::CommandFactory;

/// Prints a script that completes commands and flags in a shell.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    hubslosh completions bash > ~/.local/share/bash-completion/completions/hubslosh\n  \
    hubslosh completions zsh > ~/.zfunc/_hubslosh")]
pub struct CompletionsArgs {
    /// Shell.
    #[arg(value_enum)]
    shell: clap_complete::Shell,
}

impl CompletionsArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut crate::Cli::command(), "hubslosh", &mut script);
        print!("{}", String::from_utf8(script)?);
        Ok(())
    }
}
