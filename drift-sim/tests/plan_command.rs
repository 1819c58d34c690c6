//! `drift plan`: from what a diagnosis left to a reference that a historian can play, and what it refuses.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::cause::{Cause, CauseNoise};
use drift_sim::physics::Term;
use drift_sim::plan::Recorded;
use serde_json::{Value, json};

const LOOP: &str = "[loop]\nsample_time_s = 0.5\n\n[units]\nr = \"bar\"\ny = \"bar\"\nu = \"%\"\n\n[controller]\nkind = \"pi\"\nkp = 1.2\nki = 0.15\n\n\
    [plant]\nkind = \"first-order\"\ngain = 1.5\ntime_constant_s = 8.0\noffset = 2.0\n";

/// A valve with play, or with a dead zone, or nothing: what a recording at rest leaves open.
fn causes() -> Vec<Cause> {
    let model = Loop::parse(LOOP, "loop").unwrap();
    let terms = [
        Some(Term::new("backlash", &[("width", 2.0)]).unwrap()),
        Some(Term::new("dead_zone", &[("half_width", 1.0)]).unwrap()),
        None,
    ];
    let noise = CauseNoise { sensor_sd: 0.05, sensor_rho: 0.0, load_sd: 0.05, load_tau_s: 20.0 };
    let cause = |term: Option<Term>| Cause {
        term,
        model: model.clone(),
        constant_load: 0.0,
        gain: 3.0,
        is_left: true,
        noise,
    };
    terms.into_iter().map(cause).collect()
}

fn diagnosis(verdict: &str, causes: &[Cause]) -> Value {
    let recorded = Recorded {
        duration_s: 2000.0,
        r: 20.0,
        u: 12.0,
        r_range: [20.0, 20.0],
        r_rate: 0.0,
        reference: vec![(20.0, 4000)],
    };
    let causes: Vec<Value> = causes.iter().map(Cause::to_json).collect();
    json!({"schema": "drift.diagnosis/1", "verdict": verdict, "causes": causes, "recorded": recorded.to_json()})
}

fn folder(diagnosis: &Value) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("loop.toml"), LOOP).unwrap();
    fs::write(folder.path().join("d.json"), diagnosis.to_string()).unwrap();
    folder
}

fn drift(folder: &Path, line: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_drift"));
    command.current_dir(folder).env("LC_ALL", "C").args(line.split_whitespace()).output().unwrap()
}

const PLAN: &str = "plan loop.toml --diagnosis d.json -o reference.csv";

#[test]
fn a_plan_keeps_its_limits_and_simulate_plays_it() {
    let folder = folder(&diagnosis("undecided", &causes()));
    let line = format!(
        "{PLAN} --r-min 15 --r-max 28 --r-rate 0.5 --u-min 5 --u-max 20 --json plan.json --report plan.html"
    );
    let out = drift(folder.path(), &line);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let screen = String::from_utf8(out.stdout).unwrap();
    assert!(screen.contains("told apart by") && screen.contains("drift diagnose EXPERIMENT.csv"), "{screen}");
    let plan: Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("plan.json")).unwrap()).unwrap();
    assert_eq!(plan["schema"], "drift.plan/1");
    assert!(
        ["told_apart", "in_part"].contains(&plan["answer"]["status"].as_str().unwrap()),
        "{}",
        plan["answer"]
    );
    let text = fs::read_to_string(folder.path().join("reference.csv")).unwrap();
    let rows: Vec<Vec<f64>> =
        text.lines().skip(1).map(|line| line.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    assert_eq!(Some(rows.len() as u64), plan["samples"].as_u64());
    assert_eq!((rows[0][0], rows[0][1]), (0.0, 20.0));
    assert!(rows.iter().all(|row| (15.0..=28.0).contains(&row[1]) && (5.0..=20.0).contains(&row[3])));
    assert!(
        rows.windows(2).all(|pair| (pair[1][1] - pair[0][1]).abs() <= 0.25 + 1e-9),
        "0.5 a second at 0.5 s"
    );
    let page = fs::read_to_string(folder.path().join("plan.html")).unwrap();
    assert!(page.contains("backlash") && page.contains("what each cause would answer"));
    let played = drift(folder.path(), "simulate loop.toml --reference reference.csv -o run.csv");
    assert!(played.status.success(), "{}", String::from_utf8_lossy(&played.stderr));
    let run = fs::read_to_string(folder.path().join("run.csv")).unwrap();
    assert_eq!(run.lines().count(), rows.len() + 1);
}

/// Where every cause answers alike the status, the sentence and the chances say so.
#[test]
fn causes_that_answer_alike_are_told_apart_by_no_reference() {
    let mut twins = causes();
    twins.truncate(1);
    twins.push(twins[0].clone());
    let folder = folder(&diagnosis("undecided", &twins));
    let out = drift(folder.path(), &format!("{PLAN} --r-min 15 --r-max 28 --json plan.json"));
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let screen = String::from_utf8(out.stdout).unwrap();
    assert!(
        screen.starts_with("? CAN'T TELL\nNo reference within these limits tells apart what is left"),
        "{screen}"
    );
    assert!(screen.contains("less than 0.1 %") && !screen.contains("  0 %"), "{screen}");
    let plan: Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("plan.json")).unwrap()).unwrap();
    assert_eq!(plan["answer"]["status"], "cant_tell");
}

#[test]
fn what_can_not_be_planned_is_one_line_and_writes_nothing() {
    let open = diagnosis("undecided", &causes());
    let mut one_cause = causes();
    one_cause.iter_mut().skip(1).for_each(|cause| cause.is_left = false);
    let cases = [
        (open.clone(), PLAN.to_owned(), "r never moved in the recording", "--r-min and --r-max"),
        (
            open.clone(),
            format!("{PLAN} --r-min 21 --r-max 28"),
            "r is at 20 now, outside --r-min 21",
            "limits around",
        ),
        (open.clone(), format!("{PLAN} --r-min 28 --r-max 15"), "leaves no room", "--r-min below --r-max"),
        (
            open.clone(),
            format!("{PLAN} --r-min 15 --r-max 28 --u-min 50 --u-max 51"),
            "no reference",
            "wider limits of u",
        ),
        (
            open.clone(),
            format!("{PLAN} --r-min 15 --r-max 28 --duration 3"),
            "has 6 samples",
            "--duration of at least",
        ),
        (
            open.clone(),
            format!("{PLAN} --r-min 15 --r-max 28 --r-rate 0.00001"),
            "does not cross its range",
            "--r-rate",
        ),
        (diagnosis("no_mismatch", &causes()), PLAN.to_owned(), "nothing to tell apart", "located, undecided"),
        (diagnosis("missing_physics", &one_cause), PLAN.to_owned(), "leaves one cause", "located, undecided"),
        (
            json!({"schema": "drift.diagnosis/1", "verdict": "located"}),
            PLAN.to_owned(),
            "no numbers of its causes",
            "--loop",
        ),
        (
            json!({"schema": "drift.likelihood/1"}),
            PLAN.to_owned(),
            "schema 'drift.likelihood/1'",
            "drift diagnose --json",
        ),
    ];
    for (document, line, what, allowed) in cases {
        let folder = folder(&document);
        let out = drift(folder.path(), &line);
        let error = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(1), "{line}: {error}");
        assert!(
            error.contains(what) && error.contains(allowed) && error.lines().count() == 1,
            "{line}: {error}"
        );
        assert!(!folder.path().join("reference.csv").exists(), "{line}");
    }
    let unknown_law = folder(&open);
    fs::write(
        unknown_law.path().join("loop.toml"),
        LOOP.replace("kind = \"pi\"\nkp = 1.2\nki = 0.15", "kind = \"recorded\""),
    )
    .unwrap();
    let out = drift(unknown_law.path(), &format!("{PLAN} --r-min 15 --r-max 28"));
    assert!(String::from_utf8(out.stderr).unwrap().contains("has no law to close the loop with"));
}
