//! Runs what README and book tell the reader to type: each page's `sh` blocks in order, in a folder of its own, with the
//! built `drift` in the path. A `text` block that follows is what they must print; `...` in it leaves out the rest of a
//! line or any lines. Pictures that they draw must be the committed ones. `toml` blocks must be loops that run, `c` blocks
//! must compile. Rust blocks are doc tests of this crate.
#![cfg(unix)]

use std::fs;
use std::io::Write;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use drift_tests::markdown::{Block, blocks, pages, root};

/// Printed after each block, to tell their outputs apart.
const MARK: &str = "@@ end of block @@";

/// An empty folder in which a page's commands run: the examples beside them, `cargo` sent to this workspace.
fn scratch(built: &Path) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let bin = folder.path().join(".bin");
    fs::create_dir(&bin).unwrap();
    symlink(root().join("examples"), folder.path().join("examples")).unwrap();
    let cargo = format!(
        "#!/bin/sh\ncommand=$1\nshift\nexec '{}' \"$command\" --quiet --locked --manifest-path '{}/Cargo.toml' \"$@\"\n",
        std::env::var("CARGO").unwrap(),
        root().display()
    );
    fs::write(bin.join("cargo"), cargo).unwrap();
    fs::set_permissions(bin.join("cargo"), fs::Permissions::from_mode(0o755)).unwrap();
    let path = format!("{}:{}:{}", bin.display(), built.display(), std::env::var("PATH").unwrap());
    (folder, path)
}

/// Runs the blocks as one session and hands back what each printed.
fn session(commands: &[&Block], folder: &Path, path: &str) -> Vec<String> {
    let mut script = String::from("set -euo pipefail\n");
    for block in commands {
        script += &format!("{}\necho '{MARK}'\n", block.text);
    }
    let mut bash = Command::new("bash");
    bash.arg("-c").arg(script).current_dir(folder).env("PATH", path).env("LC_ALL", "C").stdin(Stdio::null());
    let output = bash.output().unwrap();
    let printed = String::from_utf8(output.stdout).unwrap();
    let done = printed.matches(MARK).count();
    assert!(
        output.status.success(),
        "the block in line {} fails: {}",
        commands.get(done).map_or(0, |block| block.line),
        String::from_utf8_lossy(&output.stderr)
    );
    printed.split(MARK).map(str::to_string).collect()
}

/// Whether a line is as the page says it; `...` stands for anything.
fn like(said: &str, printed: &str) -> bool {
    let (said, printed) = (said.trim_end(), printed.trim_end());
    match said.split_once("...") {
        Some((start, end)) => {
            printed.len() >= start.len() + end.len() && printed.starts_with(start) && printed.ends_with(end)
        }
        None => said == printed,
    }
}

/// The first line that the page says and the command did not print there.
fn not_printed<'a>(said: &'a str, printed: &str) -> Option<&'a str> {
    let printed: Vec<&str> = printed.lines().collect();
    // Where the next line is looked for, and whether it may stand further on.
    let (mut at, mut anywhere) = (0, true);
    for line in said.lines() {
        if line.trim() == "..." {
            anywhere = true;
            continue;
        }
        let found = (at..printed.len()).find(|n| like(line, printed[*n]) || !anywhere);
        match found {
            Some(n) if like(line, printed[n]) => at = n + 1,
            _ => return Some(line),
        }
        anywhere = false;
    }
    None
}

/// Pictures below `folder` that differ from the committed ones of their name.
fn outdated_pictures(folder: &Path) -> Vec<String> {
    let mut outdated = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_symlink() {
            continue;
        }
        if path.is_dir() {
            outdated.extend(outdated_pictures(&path));
        } else if path.extension().is_some_and(|extension| extension == "svg") {
            let name = path.file_name().unwrap();
            let committed = ["docs", "docs/pictures"].map(|docs| root().join(docs).join(name));
            let differs = |committed: &PathBuf| fs::read(committed).unwrap() != fs::read(&path).unwrap();
            outdated.extend(
                committed.iter().filter(|c| c.exists() && differs(c)).map(|c| c.display().to_string()),
            );
        }
    }
    outdated
}

fn check_c(block: &Block) -> Result<(), String> {
    let mut cc = Command::new("cc");
    cc.args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-x", "c", "-"]);
    cc.arg("-I").arg(root().join("drift-core/c/include")).arg("-I").arg(root().join("examples/firmware/c"));
    let mut compiler = cc.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    compiler.stdin.take().unwrap().write_all(block.text.as_bytes()).unwrap();
    let output = compiler.wait_with_output().unwrap();
    output.status.success().then_some(()).ok_or_else(|| String::from_utf8_lossy(&output.stderr).into())
}

fn check_toml(block: &Block, folder: &Path, built: &Path) -> Result<(), String> {
    let file = folder.join(format!("block_{}.toml", block.line));
    fs::write(&file, &block.text).unwrap();
    if !block.text.contains("[loop]") {
        return block.text.parse::<toml::Table>().map(|_| ()).map_err(|e| e.to_string());
    }
    let mut simulate = Command::new(built.join("drift"));
    let output = simulate.arg("simulate").arg(&file).args(["--duration", "1", "-o", "-"]).output().unwrap();
    output.status.success().then_some(()).ok_or_else(|| String::from_utf8_lossy(&output.stderr).into())
}

/// All that is wrong with a page.
fn check(page: &Path, built: &Path) -> Vec<String> {
    let all = blocks(&fs::read_to_string(page).unwrap());
    let (folder, path) = scratch(built);
    let commands: Vec<&Block> = all.iter().filter(|block| block.language == "sh").collect();
    let outputs = session(&commands, folder.path(), &path);
    let mut wrong = Vec::new();
    for (command, printed) in commands.iter().zip(&outputs) {
        let after = all.iter().skip_while(|block| block.line <= command.line).find(|b| b.language != "rust");
        let said = after.filter(|block| block.language == "text");
        if let Some(line) = said.and_then(|said| not_printed(&said.text, printed)) {
            wrong.push(format!("line {}: not printed: {line}\nbut:{printed}", command.line));
        }
    }
    wrong.extend(outdated_pictures(folder.path()).into_iter().map(|p| format!("{p} is not what is drawn")));
    for block in &all {
        let checked = match block.language.as_str() {
            "c" => check_c(block),
            "toml" => check_toml(block, folder.path(), built),
            _ => Ok(()),
        };
        wrong.extend(checked.err().map(|why| format!("line {}: {why}", block.line)));
    }
    wrong
}

#[test]
#[ignore = "builds the release command and runs every block of README and book; CI runs it"]
fn what_readme_and_book_tell_the_reader_to_type_works() {
    let built = crate::command::drift();
    let built = built.parent().unwrap();
    let mut wrong = Vec::new();
    for page in pages() {
        let began = std::time::Instant::now();
        let found = check(&page, built);
        println!("{:5.1} s  {}", began.elapsed().as_secs_f64(), page.display());
        wrong.extend(found.iter().map(|what| format!("{}: {what}", page.display())));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn output_is_compared_line_by_line() {
    let printed = "a\nb 12 c\n\nd\ne\n";
    for said in ["a\nb 12 c\n", "b ... c\n\nd\n", "a\n...\ne\n", "b 12...\n", "...\nd\n"] {
        assert_eq!(not_printed(said, printed), None, "{said}");
    }
    for (said, missing) in
        [("a\nd\n", "d"), ("b 13 c\n", "b 13 c"), ("e\na\n", "a"), ("b ... d\n", "b ... d")]
    {
        assert_eq!(not_printed(said, printed), Some(missing));
    }
}
