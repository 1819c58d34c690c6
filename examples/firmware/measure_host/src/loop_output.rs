//! The PI loop's output against the file beside the program, as text and as decoded defmt frames.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};
use defmt_decoder::{DecodeError, Table};

use crate::build::{emulate, image, run};
use crate::image::no_panic;
use crate::targets::Target;

fn same(found: &str, expected: &Path, what: &str) -> Result<()> {
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        std::fs::write(expected, found)?;
    }
    let wanted = std::fs::read_to_string(expected).with_context(|| expected.display().to_string())?;
    if wanted != found {
        bail!("{what} differs from {}; it printed:\n{found}", expected.display());
    }
    Ok(())
}

/// As text: the same on every core, for the arithmetic is.
pub fn compare(target: &Target) -> Result<()> {
    let path = image(target, "pi_loop");
    no_panic(&path)?;
    let printed = String::from_utf8(emulate(target, &path)?)?;
    same(&printed, Path::new("pi_loop/expected.txt"), target.triple)?;
    println!("runs      pi_loop on {} ({}): as expected", target.core, target.triple);
    Ok(())
}

/// As defmt frames.
pub fn compare_frames(target: &Target) -> Result<()> {
    run(Command::new("cargo")
        .env("DEFMT_LOG", "info")
        .args(["build", "--quiet", "--release", "-p", "pi_loop", "--features", "defmt"])
        .args(["--target", target.triple]))?;
    let path = image(target, "pi_loop");
    no_panic(&path)?;
    let frames = emulate(target, &path)?;
    let elf = std::fs::read(&path)?;
    let table = Table::parse(&elf)?.context("no defmt table in the image")?;
    let mut decoder = table.new_stream_decoder();
    decoder.received(&frames);
    let mut text = String::new();
    loop {
        match decoder.decode() {
            Ok(frame) => {
                text.push_str(&frame.display_message().to_string());
                text.push('\n');
            }
            Err(DecodeError::UnexpectedEof) => break,
            Err(DecodeError::Malformed) => bail!("malformed defmt frame after:\n{text}"),
        }
    }
    same(&text, Path::new("pi_loop/expected_defmt.txt"), "the decoded output")?;
    println!(
        "runs      pi_loop with defmt on {}: {} frames decoded, as expected",
        target.core,
        text.lines().count()
    );
    Ok(())
}
