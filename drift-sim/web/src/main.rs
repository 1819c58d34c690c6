//! Makes the page: `drift-sim/web/site/index.html`, one file that needs nothing else. It holds the program (wasm, packed with gzip), the worker
//! that runs it, script and style, so that it works from a disk, where a browser lets a page load nothing, as well as from a server.
//!
//! `cargo run --manifest-path drift-sim/web/Cargo.toml [-- FOLDER]`

use std::error::Error;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use wasm_bindgen_cli_support::Bindgen;

type Done<T> = Result<T, Box<dyn Error>>;

const TARGET: &str = "wasm32-unknown-unknown";
/// What may go over the wire, packed with gzip, bytes.
const MOST_BYTES: usize = 3_000_000;

fn main() -> ExitCode {
    match make(std::env::args_os().nth(1).map(PathBuf::from)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn make(folder: Option<PathBuf>) -> Done<()> {
    let web = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = folder.unwrap_or_else(|| web.join("site"));
    let (glue, program) = bound(&built(web)?)?;
    let text = |path: &str| {
        let path = web.join(path);
        std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))
    };
    let mut page = text("page/index.html")?;
    let parts = [
        ("/* report style */", text("../src/report/style.css")?),
        ("/* page style */", text("page/page.css")?),
        ("/* worker */", glue + &text("page/worker.js")?),
        ("/* page script */", text("page/page.js")?),
        ("/* program */", STANDARD.encode(packed(&program)?)),
    ];
    for (place, part) in &parts {
        if part.contains("</script") || page.matches(place).count() != 1 {
            return Err(format!("what stands for {place} can't be put into the page").into());
        }
        page = page.replace(place, part);
    }
    let wire = packed(page.as_bytes())?.len();
    if wire > MOST_BYTES {
        return Err(format!("the page is {wire} bytes in gzip; at most {MOST_BYTES}").into());
    }
    std::fs::create_dir_all(&folder)?;
    let file = folder.join("index.html");
    std::fs::write(&file, &page)?;
    println!(
        "{}: {} bytes, {wire} in gzip; the program in it {} bytes",
        file.display(),
        page.len(),
        program.len()
    );
    Ok(())
}

/// Builds the program; where it lies.
fn built(web: &Path) -> Done<PathBuf> {
    add_target()?;
    let folder = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| web.join("target"), PathBuf::from);
    let done = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["build", "--release", "--locked", "--package", "drift-web-wasm", "--target", TARGET])
        .arg("--manifest-path")
        .arg(web.join("Cargo.toml"))
        .arg("--target-dir")
        .arg(&folder)
        .status()?;
    if !done.success() {
        return Err("the program can't be built".into());
    }
    Ok(folder.join(TARGET).join("release/drift_web_wasm.wasm"))
}

/// Rust for the browser, where rustup has not installed it; without rustup it is left to cargo to say what is missing.
fn add_target() -> Done<()> {
    let Ok(there) = Command::new("rustup").args(["target", "list", "--installed"]).output() else {
        return Ok(());
    };
    if !String::from_utf8_lossy(&there.stdout).lines().any(|line| line == TARGET)
        && !Command::new("rustup").args(["target", "add", TARGET]).status()?.success()
    {
        return Err(format!("rustup can't add the target {TARGET}").into());
    }
    Ok(())
}

/// The script that calls the program, and the program as that script needs it.
fn bound(wasm: &Path) -> Done<(String, Vec<u8>)> {
    let mut output = Bindgen::new()
        .input_path(wasm)
        .no_modules(true)?
        .omit_default_module_path(true)
        .typescript(false)
        .remove_name_section(true)
        .remove_producers_section(true)
        .generate_output()?;
    Ok((output.js().to_owned(), output.wasm_mut().emit_wasm()))
}

fn packed(bytes: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut packer = GzEncoder::new(Vec::new(), Compression::best());
    packer.write_all(bytes)?;
    packer.finish()
}
