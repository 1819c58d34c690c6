//! `drift fleet`: hands over to `drift-fleet`, a program of its own, so that nobody else pays for what it stands on.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use clap::Args;
use drift_sim::{Error, Result};

/// The program.
const NAME: &str = "drift-fleet";

/// Many loops at once, in Parquet and CSV: calibrate, monitor, scan, sql.
///
/// All of it is handed over to the program drift-fleet, where that is installed.
#[derive(Args)]
#[command(after_help = "\
Examples:
  drift fleet monitor lake/ --loop-column tag --baselines baselines/ --report plant.html
  drift fleet monitor --help")]
pub struct Arguments {
    /// What drift-fleet is told
    #[arg(value_name = "ARGUMENTS", trailing_var_arg = true, allow_hyphen_values = true)]
    rest: Vec<OsString>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let ran = Command::new(program()).args(&arguments.rest).status();
    let status = ran.map_err(|e| {
        let what = match e.kind() {
            std::io::ErrorKind::NotFound => format!("{NAME} is not installed beside drift, nor on PATH"),
            _ => format!("{NAME} can't be run: {e}"),
        };
        Error::new(what).allowed("cargo install --path drift-sim/fleet --locked")
    })?;
    // Without a code it was ended by a signal.
    let code = status.code().and_then(|code| u8::try_from(code).ok());
    Ok(ExitCode::from(code.unwrap_or(1)))
}

/// Beside this program, or else wherever PATH has it.
fn program() -> PathBuf {
    let name = format!("{NAME}{}", std::env::consts::EXE_SUFFIX);
    let beside = std::env::current_exe().ok().map(|own| own.with_file_name(&name));
    beside.filter(|path| path.is_file()).unwrap_or_else(|| name.into())
}
