//! What is wrong with data, names and outputs is one line on standard error and an exit code that is not zero; nothing is left half written.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::path::Path;
use std::process::Command;

const HEAD: &str = "tag,t,SP,PV,OP\n";

/// Rows of a loop at rest.
fn rows(tag: &str, count: usize) -> String {
    (0..count).map(|n| format!("{tag},{n},50,{}.5,40\n", 49 + n % 2)).collect()
}

fn file(folder: &Path, name: &str, text: &str) {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, text).unwrap();
}

/// A folder with data of every kind that is refused.
fn data() -> tempfile::TempDir {
    let made = tempfile::tempdir().unwrap();
    let folder = made.path();
    file(folder, "good.csv", &format!("{HEAD}{}{}", rows("A", 500), rows("B", 500)));
    file(folder, "lake/one.csv", &format!("{HEAD}{}", rows("A", 500)));
    file(folder, "mixed/one.csv", &format!("{HEAD}{}", rows("A", 500)));
    file(folder, "mixed/two.parquet", "PAR1");
    file(folder, "no.parquet", "x");
    file(folder, "note.txt", "x");
    file(folder, "zero.csv", "");
    file(folder, "head.csv", HEAD);
    file(folder, "one_row.csv", &format!("{HEAD}A,0,50,50,40\n"));
    file(folder, "text.csv", &format!("{HEAD}A,0,50,much,40\nA,1,50,much,40\n"));
    file(folder, "nameless.csv", &format!("{HEAD}{}", rows("", 500)));
    file(folder, "ragged.csv", &format!("{HEAD}{}A,500\n", rows("A", 500)));
    for empty in ["empty", "baselines"] {
        std::fs::create_dir(folder.join(empty)).unwrap();
    }
    made
}

#[test]
fn each_mistake_is_one_line() {
    let made = data();
    let folder = made.path();
    let own = folder.join("baselines/A.toml").display().to_string();
    let missing = format!("error: not judged: A: {own} is missing");
    let monitor = |rest: &str| format!("monitor {rest} --loop-column tag --baselines baselines");
    for (arguments, said) in [
        (monitor("nowhere"), "error: nowhere: can't be read"),
        (monitor("empty"), "error: empty: no file in this folder"),
        (monitor("mixed"), "error: mixed/two.parquet: among .csv files; files of one format"),
        (monitor("no.parquet"), "error: no.parquet: this is no Parquet file"),
        (monitor("note.txt"), "error: note.txt: neither .parquet nor .csv nor .csv.gz"),
        (monitor("zero.csv"), "error: zero.csv: the file is empty; a line of names, and rows below it"),
        (monitor("head.csv"), "error: head.csv: no rows of data"),
        (monitor("ragged.csv"), "error: ragged.csv: Arrow error: Csv error: Encountered unequal lengths"),
        (monitor("nameless.csv"), "error: rows that name no loop; a name in every row of --loop-column"),
        (monitor("good.csv"), &format!("{missing} (and 1 more loops)")),
        (monitor("good.csv --columns y=pressure"), "error: good.csv: no column 'pressure' for y"),
        (monitor("good.csv --when MODE=AUTO"), "error: good.csv: no column 'MODE'"),
        (monitor("good.csv --json good.csv"), "error: good.csv: --json would overwrite the input"),
        (
            monitor("lake --parquet lake/out.parquet"),
            "error: lake/out.parquet: --parquet would lie among the data",
        ),
        (monitor("good.csv --report nowhere/plant.html"), "error: nowhere/plant.html: can't be written"),
        (monitor("good.csv --json /dev/full"), "error: /dev/full: can't be written: No space left on device"),
        (
            monitor("good.csv --report one.html --json one.html"),
            "error: --json and --report are both 'one.html'; name a file for each",
        ),
        (
            "monitor good.csv --loop-column tag --baselines nowhere".into(),
            "error: nowhere: no folder of baselines",
        ),
        (
            "monitor good.csv --loop-column loop --baselines baselines".into(),
            "error: good.csv: no column 'loop' that names the loops; --loop-column with one of tag, t, SP, PV, OP",
        ),
        ("scan one_row.csv --loop-column tag".into(), "error: not judged: A: one row of data only"),
        (
            "scan text.csv --loop-column tag".into(),
            "error: not judged: A:1: 'much' in column 'y' is not a number",
        ),
        ("scan head.csv --loop-column tag".into(), "error: head.csv: no rows of data"),
        ("calibrate good.csv --loop-column tag -o good.csv".into(), "error: good.csv: can't be made"),
        ("calibrate one_row.csv --loop-column tag -o learnt".into(), "A: one row of data only; two at least"),
        ("sql good.csv --loop-column tag --query SELEC".into(), "error: SQL error"),
        ("sql good.csv --loop-column tag --query 'x'".into(), "error: "),
        (
            "sql good.csv --loop-column tag --query SELECT_1 --parquet good.csv".into(),
            "error: good.csv: --parquet would overwrite the input",
        ),
    ] {
        let command = arguments.split(' ');
        let done = Command::new(env!("CARGO_BIN_EXE_drift-fleet"))
            .args(command)
            .current_dir(folder)
            .output()
            .unwrap();
        let line = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(1), "{arguments}: {line}");
        assert!(line.starts_with(said) && line.lines().count() == 1, "{arguments}: {line}");
    }
    for left in ["one.html", "one_loops", "plant.html", "lake/out.parquet"] {
        assert!(!folder.join(left).exists(), "{left}");
    }
    assert!(std::fs::read_to_string(folder.join("good.csv")).unwrap().starts_with(HEAD));
}
