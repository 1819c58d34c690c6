//! `drift man`: the manual pages, made from the same description as `--help`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use clap_mangen::Man;
use drift_sim::{Error, Result, output};

/// Prints a manual page, or writes all of them.
#[derive(Args)]
#[command(after_help = "\
Examples:
  drift man | man -l -
  drift man monitor > drift-monitor.1
  drift man --out man1")]
pub struct Arguments {
    /// The command that the page is for; without it the overview
    #[arg(value_name = "COMMAND", conflicts_with = "out")]
    command: Option<String>,
    /// Writes one page per command, drift.1, drift-monitor.1 ..., to this folder; made if missing
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the command on the whole command's description.
pub fn run(arguments: &Arguments, mut command: clap::Command) -> Result<ExitCode> {
    command.build();
    match (&arguments.out, &arguments.command) {
        (Some(folder), _) => write_all(folder, &command)?,
        (None, Some(name)) => print(named(&command, name)?)?,
        (None, None) => print(&command)?,
    }
    Ok(ExitCode::SUCCESS)
}

fn shown(command: &clap::Command) -> impl Iterator<Item = &clap::Command> {
    command.get_subcommands().filter(|sub| sub.get_name() != "help")
}

fn named<'a>(command: &'a clap::Command, name: &str) -> Result<&'a clap::Command> {
    shown(command).find(|sub| sub.get_name() == name).ok_or_else(|| {
        let names: Vec<&str> = shown(command).map(clap::Command::get_name).collect();
        Error::new(format!("no command '{name}'")).allowed(names.join(", "))
    })
}

/// The page's file name without its ending, and its text.
fn page(command: &clap::Command) -> Result<(String, String)> {
    let title = command.get_display_name().unwrap_or(command.get_name()).to_string();
    let mut page = Vec::new();
    Man::new(command.clone())
        .title(title.to_uppercase())
        .render(&mut page)
        .map_err(|e| Error::new(format!("the page of {title} can't be made: {e}")))?;
    Ok((title, String::from_utf8_lossy(&page).into_owned()))
}

fn print(command: &clap::Command) -> Result<()> {
    output::write_text(Path::new("-"), &page(command)?.1)
}

fn write_all(folder: &Path, command: &clap::Command) -> Result<()> {
    fs::create_dir_all(folder).map_err(|e| Error::of_file("can't be made", &e).in_file(folder))?;
    for command in std::iter::once(command).chain(shown(command)) {
        let (name, text) = page(command)?;
        output::write_text(&folder.join(format!("{name}.1")), &text)?;
    }
    Ok(())
}
