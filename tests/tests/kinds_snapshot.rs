//! Every kind's case against all kinds: the diagnosis of a small fixed set of recordings, one for each kind of physics and some
//! without any, as one table (`kinds_snapshot.txt`). Who adds or changes a kind sees in it whom that disturbs.
//!
//! The recordings in `tests/cases/fixed` come from the case maker in `tests/cases`, whose simulator is independent of drift-sim;
//! `tests/cases/remake_fixed` makes them again. What is meant to change is written with
//! `DRIFT_SNAPSHOT=write cargo test --release -p drift-tests --test all kinds_snapshot:: -- --ignored`.

use std::fmt::Write as _;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::Command;

use drift_sim::physics::KINDS;
use drift_tests::markdown::root;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use serde_json::Value;

/// As far as a fit may lie below the one that the case maker's own noise-free run reaches on the hold-out, in percent. The start
/// is estimated from a noisy recording, and the digits are few.
const FIT_BELOW_PCT: f64 = 0.5;
/// Kinds whose run depends on a state that the recording doesn't show, at a jump: another start gives another run.
const ANY_START: [&str; 2] = ["stiction", "quantization"];

/// One of the fixed cases.
struct Case {
    name: String,
    label: Value,
}

impl Case {
    fn text(&self, key: &str) -> &str {
        self.label[key].as_str().unwrap_or("-")
    }

    fn sample_time_s(&self) -> f64 {
        let path = root().join("tests/cases/fixed").join(&self.name).join("loop.toml");
        let model: toml::Table = toml::from_str(&fs::read_to_string(path).unwrap()).unwrap();
        model["loop"]["sample_time_s"].as_float().unwrap()
    }

    /// Unpacks the recordings, which are kept without time, and puts the loop files beside them.
    fn unpack(&self, folder: &Path) {
        let packed = root().join("tests/cases/fixed").join(&self.name);
        for name in ["train.csv", "holdout.csv"] {
            let file = fs::File::open(packed.join(format!("{name}.gz"))).unwrap();
            let mut text = String::new();
            flate2::read::GzDecoder::new(file).read_to_string(&mut text).unwrap();
            fs::write(folder.join(name), with_time(&text, self.sample_time_s())).unwrap();
        }
        for name in ["loop.toml", "truth.toml"] {
            fs::copy(packed.join(name), folder.join(name)).unwrap();
        }
    }
}

/// The recording with a column of time.
fn with_time(text: &str, sample_time_s: f64) -> String {
    let mut lines = text.lines();
    let mut out = format!("t,{}\n", lines.next().unwrap());
    for (n, line) in lines.enumerate() {
        let _ = writeln!(out, "{:.9},{line}", n as f64 * sample_time_s);
    }
    out
}

/// All of them, sorted by name.
fn cases() -> Vec<Case> {
    let text = fs::read_to_string(root().join("tests/cases/fixed/labels.json")).unwrap();
    let Value::Object(labels) = serde_json::from_str(&text).unwrap() else {
        panic!("labels.json is no object")
    };
    let mut cases: Vec<Case> = labels.into_iter().map(|(name, label)| Case { name, label }).collect();
    cases.sort_by(|a, b| a.name.cmp(&b.name));
    cases
}

/// Runs the command in a folder; its error output where it fails.
fn run(drift: &Path, folder: &Path, arguments: &[&str]) -> Result<(), String> {
    let done = Command::new(drift).args(arguments).current_dir(folder).output().unwrap();
    if done.status.success() {
        return Ok(());
    }
    Err(String::from_utf8_lossy(&done.stderr).lines().last().unwrap_or("no message").to_string())
}

/// The nearest of 1, 2, 5, 10, ... with its sign; 0 below 1.
fn coarse(value: f64) -> String {
    let size = value.abs();
    if !(size >= 1.0 && size.is_finite()) {
        return if size < 1.0 { "0".into() } else { value.to_string() };
    }
    let decade = 10_f64.powf(size.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * decade);
    let nearest = steps.into_iter().min_by(|a, b| (size / a).ln().abs().total_cmp(&(size / b).ln().abs()));
    format!("{}{}", if value < 0.0 { "-" } else { "" }, nearest.unwrap_or(size))
}

/// The names of a list of kinds, given as such or as objects.
fn kinds(list: &Value) -> Vec<String> {
    let name = |item: &Value| item.as_str().or(item["kind"].as_str()).map(str::to_string);
    list.as_array().map_or(Vec::new(), |items| items.iter().filter_map(name).collect())
}

fn joined(names: &[String]) -> String {
    if names.is_empty() { "-".into() } else { names.join(", ") }
}

/// The numbers of an object, coarsely, in the order of their names.
fn numbers(object: &Value) -> Vec<String> {
    let Value::Object(entries) = object else { return Vec::new() };
    let number = |(name, value): (&String, &Value)| Some(format!("{name} {}", coarse(value.as_f64()?)));
    let mut out: Vec<String> = entries.iter().filter_map(number).collect();
    out.sort();
    out
}

/// The kinds that compete, each with its gain in nats over the loop as stated (`rivals` of the JSON).
fn rivals(found: &Value) -> Vec<String> {
    let rival = |item: &Value| Some(format!("{} {}", item["kind"].as_str()?, coarse(item["gain"].as_f64()?)));
    found["rivals"].as_array().map_or(Vec::new(), |items| items.iter().filter_map(rival).collect())
}

/// The row of a case: what the diagnosis said, numbers coarsely.
fn row(drift: &Path, case: &Case) -> String {
    let folder = tempfile::tempdir().unwrap();
    case.unpack(folder.path());
    let arguments =
        ["diagnose", "train.csv", "--loop", "loop.toml", "--holdout", "holdout.csv", "--json", "found.json"];
    let head = format!("| {} | {} |", case.name, case.text("family"));
    if let Err(error) = run(drift, folder.path(), &arguments) {
        return format!("{head} {error} | - | - | - | - |\n");
    }
    let text = fs::read_to_string(folder.path().join("found.json")).unwrap();
    let found: Value = serde_json::from_str(&text).unwrap();
    let first = &found["physics"][0];
    format!(
        "{head} {} | {} | {} | {} | {} |\n",
        found["verdict"].as_str().unwrap_or("-"),
        joined(&kinds(&found["physics"])),
        joined(&kinds(&first["indistinguishable_from"])),
        joined(&numbers(&first["evidence"])),
        joined(&rivals(&found)),
    )
}

fn table(drift: &Path) -> String {
    let mut text = String::from(
        "| case | family | verdict | named | or else | evidence of the first | gains of the rivals |\n|---|---|---|---|---|---|---|\n",
    );
    let rows: Vec<String> = cases().par_iter().map(|case| row(drift, case)).collect();
    text.extend(rows);
    text
}

/// The lines in which two tables differ.
fn difference(expected: &str, now: &str) -> String {
    let mut out = String::new();
    for line in expected.lines().filter(|line| !now.lines().any(|other| other == *line)) {
        let _ = writeln!(out, "- {line}");
    }
    for line in now.lines().filter(|line| !expected.lines().any(|other| other == *line)) {
        let _ = writeln!(out, "+ {line}");
    }
    out
}

#[test]
#[ignore = "builds the release command and diagnoses 40 loops, about a minute; CI runs it"]
fn every_kinds_case_is_told_from_all_kinds_as_before() {
    let path = root().join("tests/tests/kinds_snapshot.txt");
    let now = table(&crate::command::drift());
    if std::env::var_os("DRIFT_SNAPSHOT").is_some_and(|wish| wish == "write") {
        fs::write(&path, &now).unwrap();
    }
    let expected = fs::read_to_string(&path).unwrap();
    assert!(
        expected == now,
        "what the diagnosis says of the fixed cases has changed:\n{}",
        difference(&expected, &now)
    );
}

/// How well the second fits the first, in percent.
fn fit_pct(measured: &[f64], simulated: &[f64]) -> f64 {
    let mean = measured.iter().sum::<f64>() / measured.len() as f64;
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>().sqrt();
    let off = norm(&mut measured.iter().zip(simulated).map(|(a, b)| a - b));
    100.0 * (1.0 - off / norm(&mut measured.iter().map(|a| a - mean)))
}

/// A column of a CSV file with a header.
fn column(path: PathBuf, name: &str) -> Vec<f64> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let index = lines.next().unwrap().split(',').position(|column| column == name).unwrap();
    lines.map(|line| line.split(',').nth(index).unwrap().parse().unwrap()).collect()
}

/// Takes the sensor's noise out of a loop file: a simulation must not add its own to what is compared.
fn silence(path: &Path) {
    let mut model: toml::Table = toml::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    model.remove("sensor");
    fs::write(path, toml::to_string(&model).unwrap()).unwrap();
}

/// The independent truth of the simulator: with the true numbers and terms drift-sim must give the hold-out of every kind as well
/// as the case maker's own simulator does, which integrates otherwise.
#[test]
#[ignore = "builds the release command and simulates 40 loops, some seconds; CI runs it"]
fn the_true_loop_simulates_each_kinds_recording_as_well_as_the_case_makers_own_simulator() {
    let drift = crate::command::drift();
    let mut wrong = String::new();
    for case in cases().iter().filter(|case| !ANY_START.contains(&case.text("kind"))) {
        let folder = tempfile::tempdir().unwrap();
        case.unpack(folder.path());
        silence(&folder.path().join("truth.toml"));
        run(
            &drift,
            folder.path(),
            &["simulate", "truth.toml", "--reference", "holdout.csv", "-o", "simulated.csv"],
        )
        .unwrap();
        for name in ["y", "u"] {
            let [measured, simulated] =
                ["holdout.csv", "simulated.csv"].map(|file| column(folder.path().join(file), name));
            let fit = fit_pct(&measured, &simulated);
            let truth = case.label[format!("holdout_truth_{name}_pct")].as_f64().unwrap();
            if fit < truth - FIT_BELOW_PCT {
                let _ = writeln!(wrong, "{}: {name} fits {fit:.2} %, the truth {truth:.2} %", case.name);
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn every_kind_has_a_case_at_its_place() {
    for kind in KINDS {
        let case = cases().into_iter().find(|case| case.text("kind") == kind.name);
        let case = case.unwrap_or_else(|| panic!("no case of {} in tests/cases/fixed", kind.name));
        assert_eq!(case.text("place"), kind.place.name(), "{}", kind.name);
        let terms = case.label["terms"][0]["params"].as_object().unwrap();
        let missing = kind
            .parameters
            .iter()
            .find(|parameter| parameter.default.is_none() && !terms.contains_key(parameter.name));
        assert!(missing.is_none(), "{}: the case lacks {missing:?}", kind.name);
    }
}

#[test]
fn numbers_are_rounded_to_one_two_five() {
    for (value, said) in [(0.3, "0"), (1.3, "1"), (1.5, "2"), (-34.0, "-50"), (690.0, "500"), (8e4, "100000")]
    {
        assert_eq!(coarse(value), said);
    }
}
