//! `drift completions`: what a shell needs to complete the command's arguments.

use std::path::Path;
use std::process::ExitCode;

use clap::Args;
use clap_complete::Shell;
use drift_sim::{Result, output};

/// Prints the completions for a shell.
#[derive(Args)]
#[command(after_help = "\
Examples:
  drift completions bash > ~/.local/share/bash-completion/completions/drift
  drift completions zsh > ~/.zfunc/_drift
  drift completions fish > ~/.config/fish/completions/drift.fish")]
pub struct Arguments {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

/// Runs the command on the whole command's description.
pub fn run(arguments: &Arguments, mut command: clap::Command) -> Result<ExitCode> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "drift", &mut script);
    output::write_text(Path::new("-"), &String::from_utf8_lossy(&script))?;
    Ok(ExitCode::SUCCESS)
}
