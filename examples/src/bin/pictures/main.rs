//! Draws the pictures of the book into a folder, the same bytes on every machine.
//!
//! ```sh
//! cargo run --release -p drift-examples --bin pictures -- docs/pictures
//! ```
//!
//! `pictures FOLDER EMPS` draws the README's picture instead, from the folder with the recordings of that drive.
//!
//! For each kind of physics: a loop with it and without it. y hardly tells them apart, u does, and what the model can't
//! explain, drawn against what it depends on, has a shape of its own.

mod cases;
mod concealed;
mod explain;
mod scene;
mod signature;

use std::path::PathBuf;
use std::process::ExitCode;

use drift_sim::physics::KINDS;
use drift_sim::{Error, Result};

fn main() -> ExitCode {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("usage: pictures FOLDER [EMPS]");
        return ExitCode::from(2);
    };
    let drawn = match std::env::args_os().nth(2) {
        Some(emps) => concealed::drive(emps.as_ref())
            .and_then(|figure| figure.write_svg(&folder.join("emps.svg")))
            .map(|()| 1),
        None => draw(&folder),
    };
    match drawn {
        Ok(count) => {
            println!("{count} pictures in {}", folder.display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn draw(folder: &std::path::Path) -> Result<usize> {
    std::fs::create_dir_all(folder).map_err(|e| Error::new(format!("can't be made: {e}")).in_file(folder))?;
    for kind in KINDS {
        let case = cases::case(kind)?
            .ok_or_else(|| Error::new(format!("{} has no picture: add it to cases.rs", kind.name)))?;
        case.figure()?.write_svg(&folder.join(format!("{}.svg", kind.name)))?;
    }
    let explaining = explain::all()?;
    for (name, figure) in &explaining {
        figure.write_svg(&folder.join(format!("{name}.svg")))?;
    }
    Ok(KINDS.len() + explaining.len())
}
