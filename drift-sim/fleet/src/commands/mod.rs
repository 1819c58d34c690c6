//! The commands of `drift fleet`: one file each.

pub mod calibrate;
pub mod monitor;
pub mod reading;
pub mod scan;
pub mod sql;

/// The exit code of a command over loops of which these could not be judged, and a line for them.
fn all_judged(refused: impl Iterator<Item = String>) -> std::process::ExitCode {
    let refused: Vec<String> = refused.collect();
    let Some(first) = refused.first() else { return std::process::ExitCode::SUCCESS };
    let more = refused.len() - 1;
    let more = if more > 0 { format!(" (and {more} more loops)") } else { String::new() };
    eprintln!("error: not judged: {first}{more}");
    std::process::ExitCode::from(1)
}

/// The command `drift`: beside this program, or else on PATH.
pub fn drift() -> std::path::PathBuf {
    let name = format!("drift{}", std::env::consts::EXE_SUFFIX);
    let beside = std::env::current_exe().ok().map(|own| own.with_file_name(&name));
    beside.filter(|path| path.is_file()).unwrap_or_else(|| name.into())
}
