use anyhow::Result;

/// Prints a script with which a shell completes the commands and options of hubslosh.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    hubslosh completions bash > ~/.local/share/bash-completion/completions/hubslosh\n  \
    hubslosh completions zsh > ~/.zfunc/_hubslosh")]
pub struct CompletionsArgs {
    /// Shell that will read the script.
    #[arg(value_enum)]
    shell: clap_complete::Shell,
}

impl CompletionsArgs {
    pub fn run(self, mut command: clap::Command) -> Result<()> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut command, "hubslosh", &mut script);
        print!("{}", String::from_utf8(script)?);
        Ok(())
    }
}
