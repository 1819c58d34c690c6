//! Builds, runs, compares and measures all firmware; the script `measure` beside this folder starts it.
//!
//! `measure [--json F] [--check F]`: F of `--json` gets the rows; with `--check` the run fails where a figure is
//! more than 5 % worse than the one in F.

mod build;
mod c_interface;
mod compare;
mod image;
mod loop_output;
mod probe;
mod replay;
mod targets;

use anyhow::{Context, Result, bail};
use serde_json::Value;

fn main() -> Result<()> {
    let mut json = None;
    let mut check = None;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let file = arguments.next().with_context(|| format!("{argument}: a file name is missing"))?;
        match argument.as_str() {
            "--json" => json = Some(file),
            "--check" => check = Some(file),
            other => bail!("{other}: unknown; allowed are --json F and --check F"),
        }
    }
    build::library_everywhere()?;
    build::overflow_checks()?;
    build::real_board()?;
    for target in targets::RUN {
        build::programs(target)?;
        loop_output::compare(target)?;
        replay::compare(target)?;
    }
    loop_output::compare_frames(&targets::M4F)?;
    c_interface::check()?;
    let mut rows = Vec::new();
    for target in targets::RUN {
        rows.extend(probe::rows(target)?);
    }
    probe::print(&rows);
    let rows = Value::Array(rows.iter().map(probe::Row::json).collect());
    if let Some(file) = json {
        std::fs::write(&file, format!("{rows:#}\n")).with_context(|| file.clone())?;
    }
    match check {
        Some(file) => compare::with_committed(&rows, &file),
        None => Ok(()),
    }
}
