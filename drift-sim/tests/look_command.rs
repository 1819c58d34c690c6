//! `drift look`: what is in a file, on one screen of 80 columns, whatever is wrong with it.

use std::fmt::Write;
use std::fs;
use std::process::Command;

/// What it prints of a file with this content.
fn look(content: &str, more: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("rec.csv"), content).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_drift"));
    let out = command
        .current_dir(folder.path())
        .env("LC_ALL", "C")
        .args(["look", "rec.csv"])
        .args(more)
        .output()
        .unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let text = String::from_utf8(out.stdout).unwrap();
    assert!(
        text.lines().all(|line| line.chars().count() <= 80) && text.lines().count() < 24,
        "one screen:\n{text}"
    );
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// 100 samples of 0.5 s: 20 in manual, u at its limit for 10, one missing y, a gap of 5 s.
#[test]
fn a_screen_says_what_is_in_the_file() {
    let mut csv = String::from("Time (s),SP,PV,OP,MODE,flow\n");
    for k in 0..100 {
        let t = f64::from(k) * 0.5 + if k >= 60 { 4.5 } else { 0.0 };
        let y = if k == 7 { String::new() } else { format!("{}", 20 + k % 3) };
        let u = if (30..40).contains(&k) { 100 } else { 40 + k % 7 };
        let mode = if (70..90).contains(&k) { "MAN" } else { "AUTO" };
        writeln!(csv, "{t},21,{y},{u},{mode},{k}").unwrap();
    }
    let text = look(&csv, &[]);
    for said in [
        "CSV, 100 rows, 6 columns; 54 s from t = 0 s",
        "every 0.5 s, uniform",
        "gaps 1, the longest of 5 s after t = 29.5 s",
        "t = 'Time (s)', r = 'SP', y = 'PV', u = 'OP'; not used: MODE, flow",
        "20 .. 22, 1 missing",
        "manual 20 % of the rows, 1 stretch 39.5 to 49 s",
        "u stays at its highest value, 100: 10 % of the rows, 1 stretch 15 to 19.5 s",
        "next: drift init rec.csv -o loop.toml",
    ] {
        assert!(text.contains(said), "'{said}' is not in:\n{text}");
    }
}

/// The recording's dates stand wherever a time is said; they may stand in a column without a name, or count from 1970.
#[test]
fn dates_are_shown_as_dates() {
    let mut csv = String::from(",SP,PV,OP,MODE\n");
    let mut counted = String::from("Time;SP;PV;OP;MODE\n");
    for k in 0_u64..60 {
        let s = 5 * k + if k >= 40 { 600 } else { 0 };
        let mode = if k >= 50 { "MAN" } else { "AUTO" };
        writeln!(csv, "13-May-24 08:{:02}:{:02},21,{},4,{mode}", s / 60, s % 60, 20 + k % 3).unwrap();
        writeln!(counted, "{};21;{};4;{mode}", 1_715_587_200_000 + 1000 * s, 20 + k % 3).unwrap();
    }
    for (text, column) in [(csv, "t in a column without a name, r = 'SP'"), (counted, "t = 'Time', r = 'SP'")]
    {
        let text = look(&text, &[]);
        for said in [
            column,
            "from 2024-05-13 08:00:00",
            "after 2024-05-13 08:03:15",
            "2024-05-13 08:14:10 to 2024-05-13 08:14:55",
        ] {
            assert!(text.contains(said), "'{said}' is not in:\n{text}");
        }
    }
}

#[test]
fn uneven_rows_are_shown_with_the_step_that_reads_them() {
    let mut csv = String::from("t,r,y,u\n");
    let mut t = 0.0;
    for k in 0..200 {
        t += if k % 3 == 0 { 0.07 } else { 0.1 };
        writeln!(csv, "{t:.3},1,{},3", k % 5).unwrap();
    }
    let text = look(&csv, &[]);
    assert!(text.contains("about every 0.1 s, not uniform; jitter 0.01728 s rms, 0.03 s at most"), "{text}");
    assert!(text.contains("next: drift init rec.csv --resample 0.1 -o loop.toml"), "{text}");
    assert!(
        look(&csv, &["--resample", "0.1"]).contains("next: drift init rec.csv --resample 0.1 -o loop.toml")
    );
}

/// Where no column seems to be y or u, the rest is shown all the same, with what to type.
#[test]
fn a_missing_column_is_said_with_an_example() {
    let content = "Zeit;Kessel;Halle\n0;1;2\n1;1;2\n2;2;2\n";
    let said = look(content, &[]);
    for part in [
        "CSV, 3 rows, 3 columns",
        "every 1 s, uniform",
        "t = 'Zeit', no r, no y, no u; not used: Kessel, Halle",
        "y no column: say which one it is, as below",
        "but no column 'y' for y; like --columns t=Zeit,y=Kessel,u=Halle; the columns are Zeit, Kessel, Halle",
        "next: drift look rec.csv --columns t=Zeit,y=Kessel,u=Halle",
    ] {
        assert!(said.contains(part), "{part} is not in {said}");
    }
    // Typed as told, nothing is missing any more.
    let then = look(content, &["--columns", "t=Zeit,y=Kessel,u=Halle"]);
    assert!(
        then.contains("next: drift init rec.csv --columns t=Zeit,y=Kessel,u=Halle -o loop.toml"),
        "{then}"
    );
    let then = look(content, &["--columns", "y=Kessel"]);
    assert!(then.contains("next: drift look rec.csv --columns t=Zeit,y=Kessel,u=Halle"), "{then}");
}

/// The simulated oven, a tenth of it run by hand: `init` finds the law that it finds without.
#[test]
fn init_finds_the_law_beside_a_manual_stretch() {
    let folder = tempfile::tempdir().unwrap();
    let drift = |line: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_drift"));
        let out = command.current_dir(folder.path()).args(line.split(' ')).output().unwrap();
        assert!(out.status.success(), "{line}: {}", String::from_utf8_lossy(&out.stderr));
        String::from_utf8(out.stdout).unwrap()
    };
    let oven = include_str!("../../examples/loops/oven.toml");
    fs::write(folder.path().join("oven.toml"), oven).unwrap();
    drift(
        "simulate oven.toml -o own.csv --duration 20000 --reference-mean 35 --reference-sd 3 --reference-hold 200 --seed 3",
    );
    let own = fs::read_to_string(folder.path().join("own.csv")).unwrap();
    let mut by_hand = String::from("t,r,y,u,MODE\n");
    for (k, row) in own.lines().skip(1).enumerate() {
        let (rest, u) = row.rsplit_once(',').unwrap();
        let is_manual = (1600..2000).contains(&k);
        let (u, mode) = if is_manual { ("0.2", "MAN") } else { (u, "AUTO") };
        writeln!(by_hand, "{rest},{u},{mode}").unwrap();
    }
    fs::write(folder.path().join("man.csv"), &by_hand).unwrap();
    let law = |toml: &str| -> Vec<String> {
        let inside = toml.lines().skip_while(|line| *line != "[controller]").take(4);
        inside.map(str::to_owned).collect()
    };
    let without = law(&drift("init own.csv"));
    assert_eq!(without[1], "kind = \"pi\"");
    assert_eq!(law(&drift("init man.csv")), without);
    // The mode in numbers, whatever they are, says the same.
    for (auto, man) in [("1", "0"), ("4", "8")] {
        let coded = by_hand.replace(",AUTO\n", &format!(",{auto}\n")).replace(",MAN\n", &format!(",{man}\n"));
        fs::write(folder.path().join("coded.csv"), coded).unwrap();
        assert_eq!(law(&drift("init coded.csv")), without, "{auto} {man}");
    }
    // Without the mode it can't be found.
    assert_eq!(law(&drift("init man.csv --when always"))[1], "kind = \"recorded\"");
}

/// What `diagnose` and the others guess of a file is told on standard error, a note a paragraph, in the width of the window.
#[test]
fn notes_are_paragraphs_of_the_windows_width() {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..60).map(|k| format!("{k},40,{},{},AUTO\n", 20 + k % 7, 60 - k % 5)).collect();
    let text = format!("Exported by Logger 3\nTime,TIC101.SP,TIC101.PV,TIC101.OP,TIC101.MODE\n{rows}");
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
    let out = std::process::Command::new(env!("CARGO_BIN_EXE_drift"))
        .current_dir(folder.path())
        .args(["init", "log.csv", "-o", "loop.toml"])
        .output()
        .unwrap();
    let told = String::from_utf8(out.stderr).unwrap();
    assert!(told.contains("note: log.csv: columns guessed by their names"), "{told}");
    assert!(
        told.matches("note: ").count() > 1 && told.lines().all(|line| line.chars().count() <= 80),
        "{told}"
    );
}

/// A row repeats a time stamp with other values: the command that comes next says what becomes of it, and is not refused.
#[test]
fn repeated_time_stamps_are_read_by_the_command_that_comes_next() {
    let mut csv = String::from("t,r,y,u\n");
    for k in 0..200 {
        writeln!(csv, "{k},40,{},{}", 20 + k % 7, 60 - k % 5).unwrap();
        if k == 50 {
            writeln!(csv, "{k},40,30,61").unwrap();
        }
    }
    let text = look(&csv, &[]);
    assert!(text.contains("next: drift init rec.csv --repeated mean -o loop.toml"), "{text}");
    let then = look(&csv, &["--repeated", "mean"]);
    assert!(then.contains("every 1 s, uniform") && !then.contains(" but "), "{then}");
    assert!(then.contains("next: drift init rec.csv --repeated mean -o loop.toml"), "{then}");
}

#[test]
fn what_is_constant_is_said_to_be() {
    let rows = |r: &dyn Fn(usize) -> f64| {
        (0..300).map(|k| format!("{k},{},{},{}\n", r(k), k % 3, k % 2)).collect::<String>()
    };
    let text = look(&format!("t,r,y,u\n{}", rows(&|_| 12.78)), &[]);
    let chart = text.split_whitespace().skip_while(|word| *word != "r").nth(1);
    // Flat: one sign throughout.
    let chart = text
        .split(" r ")
        .find_map(|behind| behind.split(' ').next().filter(|chart| chart.len() == 34))
        .or(chart);
    assert!(chart.is_some_and(|chart| chart.chars().all(|sign| sign == '_')), "{chart:?} in {text}");
    assert!(text.contains(" constant 12.78 y "), "{text}");
    // What differs is told apart.
    let text = look(&format!("t,r,y,u\n{}", rows(&|k| 12.78 + 1e-5 * (k % 2) as f64)), &[]);
    assert!(text.contains(" 12.78 .. 12.78001 y "), "{text}");
    let text = look(&format!("t,r,y,u\n{}", rows(&|k| if k == 0 { -0.0 } else { (k % 2) as f64 })), &[]);
    assert!(text.contains(" 0 .. 1 y ") && !text.contains("-0"), "{text}");
}

#[test]
fn a_date_beside_the_time_of_the_day_is_used() {
    let rows: String = (0..50).map(|k| format!("14.03.2024;08:00:{k:02};1;{};{}\n", k % 3, k % 2)).collect();
    let text = look(&format!("Datum;Uhrzeit;Soll;Ist;Stellwert\n{rows}"), &[]);
    assert!(text.contains("columns t = 'Datum+Uhrzeit', r = 'Soll', y = 'Ist', u = 'Stellwert' "), "{text}");
    assert!(!text.contains("not used"), "{text}");
}
