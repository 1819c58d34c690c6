//! Reads what results say to people, on page and terminal and in JSON, over every kind of physics with numbers of any size and
//! intervals of any width, and over runs of the monitor: no sentence may say what its numbers don't carry.

use std::io::Cursor;
use std::path::Path;
use std::sync::OnceLock;

use drift_core::{Baseline, Channel, ChannelKind, Config, Cusum, Detectors, Index, Memory, Shewhart};
use drift_sim::control_loop::Loop;
use drift_sim::diagnose::prove::FitPct;
use drift_sim::diagnose::shown::Shown;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, Fits, Named, Refitted, Verdict, diagnose, page, report};
use drift_sim::monitor::{Chart, Outputs, Summary, screen, watch};
use drift_sim::physics::{KINDS, Parameter, Term};
use drift_sim::recording::{ColumnMap, ReadOptions, RecordingStream};
use drift_sim::reference::Reference;
use drift_sim::report::{Block, Page};
use drift_sim::sentences::{Clock, diagnosis, monitoring};
use drift_sim::simulate::{Start, simulate};
use drift_sim::terminal::Terminal;

use crate::faults_of_sentences::{fault, unread_digits};

const OVEN: &str = include_str!("../../examples/loops/oven.toml");
const SERVO: &str = include_str!("../../examples/loops/servo.toml");

/// All text on a page, block by block.
fn texts(page: &Page) -> Vec<String> {
    fn of(blocks: &[Block], out: &mut Vec<String>) {
        for block in blocks {
            match block {
                Block::Text(text) | Block::Note(text) => out.push(text.clone()),
                Block::List(items) => out.extend(items.iter().cloned()),
                Block::Table(table) => out.extend(table.rows.iter().flatten().cloned()),
                Block::Folded { title, blocks } => {
                    out.push(title.clone());
                    of(blocks, out);
                }
                Block::Chart(chart) => out.push(chart.caption.clone()),
                Block::Picture { caption, .. } => out.push(caption.clone()),
            }
        }
    }
    let mut out: Vec<String> = page.answer.texts().map(str::to_owned).collect();
    out.push(page.about.clone());
    out.extend(page.proof.iter().flat_map(|proof| [proof.title.clone(), proof.caption.clone()]));
    page.sections.iter().for_each(|section| of(&section.blocks, &mut out));
    out
}

fn check(name: &str, texts: impl IntoIterator<Item = String>) {
    for text in texts {
        if let Some(fault) = fault(&text) {
            panic!("{name}: {fault}, in: {text}");
        }
    }
}

/// A loop, a healthy run of it and its diagnosis, to which physics is added.
struct Found {
    signals: Signals,
    diagnosis: Diagnosis,
}

fn healthy(text: &str, sample_time_s: f64, reference: &Reference, start: &Start) -> Found {
    let (text, _) = text.split_once("[[physics]]").unwrap_or((text, ""));
    let model = Loop::parse(text, "loop.toml").unwrap();
    let r = reference.clone().take_samples(900);
    let trace = simulate(&model, &r, &[], 1, Some(start)).unwrap();
    let signals = Signals {
        sample_time_s,
        start_s: 3600.0,
        origin_s: 0.0,
        r,
        y: trace.y,
        u: trace.u,
        inputs: Vec::new(),
    };
    let diagnosis = diagnose(std::slice::from_ref(&signals), None, &model).unwrap();
    Found { signals, diagnosis }
}

fn founds() -> &'static [Found; 2] {
    static FOUND: OnceLock<[Found; 2]> = OnceLock::new();
    FOUND.get_or_init(|| {
        let oven = Reference::random(60.0, 3.0, 100, 1);
        let servo = Reference::random(0.0, 0.2, 300, 1);
        [
            healthy(OVEN, 5.0, &oven, &Start::held(60.0, 48.75)),
            healthy(SERVO, 0.001, &servo, &Start::held(0.0, 0.0)),
        ]
    })
}

/// One result with one term, its numbers and intervals about so large.
fn with_term(found: &Found, kind: &str, size: f64, part: f64, onset_s: f64) -> Option<Diagnosis> {
    let kind = KINDS.iter().find(|k| k.name == kind)?;
    if !(kind.applies)(&found.diagnosis.nominal.plant) {
        return None;
    }
    let value = |(i, parameter): (usize, &Parameter)| {
        if parameter.fitted { size * (1.234_567_89 + i as f64) } else { parameter.default.unwrap_or(0.0) }
    };
    let parameters: Vec<f64> = kind.parameters.iter().enumerate().map(value).collect();
    let term = Term { kind, parameters, onset_s, spans: Vec::new() };
    term.check().ok()?;
    let half_widths = term.parameters.iter().map(|p| part * p.abs()).collect();
    let named = Named {
        term,
        first: None,
        half_widths,
        tied: kind.ties.to_vec(),
        train_gain: 1.0,
        holdout_errors: 12.345_678,
    };
    let fit = |y_pct: f64, u_pct: f64| Some(FitPct { y_pct, u_pct: Some(u_pct) });
    let fits =
        Fits { nominal: fit(99.1, 60.0), before: fit(99.123_456, 95.612_345), after: fit(99.2, 95.62) };
    Some(Diagnosis {
        verdict: Verdict::MissingPhysics,
        place: Some(kind.place),
        physics: vec![named],
        train: fits,
        holdout: fits,
        improvement: Some([1e-7, 2e-7]),
        parameters: vec![Refitted {
            name: "plant.gain".into(),
            nominal: 0.8,
            value: 0.8 * (1.0 + 1.3e-13),
            half_width: 1e-3 * part,
        }],
        ..found.diagnosis.clone()
    })
}

#[test]
fn every_kind_says_what_its_interval_carries() {
    let mut read = 0;
    for found in founds() {
        let clock = Clock::new(None, found.signals.duration_s());
        for kind in KINDS {
            for size in [1e-9, 5.8e-7, 3.1e-3, 0.37, 20.0, 3.3e3, 4.4e8] {
                for (part, onset_s) in [(0.02, 0.0), (2.0, 0.0), (f64::INFINITY, 1.5), (1e-9, 0.25)] {
                    let Some(of) = with_term(found, kind.name, size, part, onset_s) else { continue };
                    let name = format!("{} {size} {part}", kind.name);
                    let answer = diagnosis(&of, &clock, 3600.0);
                    check(&name, answer.texts().map(str::to_owned));
                    let json = report::json(&of, None, &clock, 3600.0);
                    let said = json["physics"][0]["says"].as_str().unwrap().to_owned();
                    check(&name, [said.clone()]);
                    // One result says the same on the page and in the document.
                    if onset_s == 0.0 {
                        assert!(
                            answer.sentence.contains(said.split(';').next().unwrap().trim_end_matches('.')),
                            "{said}"
                        );
                    } else {
                        assert!(answer.sentence.contains(" since 360"), "{answer:?}");
                    }
                    let text = Terminal::plain().answer(&answer);
                    assert!(text.is_ascii() && text.lines().all(|line| line.len() <= 80), "{text}");
                    read += 1;
                }
            }
        }
    }
    println!("{read} results read");
    assert!(read > 500, "{read}");
}

#[test]
fn pages_of_a_diagnosis_say_nothing_that_is_nothing() {
    for (found, kind, size) in
        [(0, "gain_loss", 0.1), (0, "sensor_drift", 5.8e-7), (1, "coulomb_friction", 0.37)]
    {
        let found = &founds()[found];
        for part in [0.02, 2.0] {
            let of = with_term(found, kind, size, part, 0.0).unwrap();
            let (signals, clock) = (found.signals.clone(), Clock::new(None, found.signals.duration_s()));
            let case = page::Case {
                first: &Shown { file: "run.csv".into(), signals, clock },
                further: &[],
                holdout: None,
                healthy: &[],
                loop_file: Some(Path::new("loop.toml")),
                columns: &ColumnMap::default(),
                is_identified: false,
            };
            check(kind, texts(&page::page(&of, &case, String::new())));
        }
    }
}

/// Friction by direction, as on a real drive: the plant's own viscous friction counts, and dry friction of nothing is left out.
#[test]
fn friction_by_direction_is_told_in_numbers_of_the_plant() {
    let found = &founds()[1];
    let mut of = with_term(found, "directional_friction", 1.0, 0.1, 0.0).unwrap();
    let drift_sim::plant::Plant::Servo(servo) = &mut of.improved.plant else { panic!() };
    servo.viscous = 203.5;
    of.nominal.plant = of.improved.plant.clone();
    of.physics[0].term.parameters = vec![0.0, 0.0, -37.24, 37.27];
    of.physics[0].half_widths = vec![0.3, 0.3, 10.0, 10.0];
    let says = drift_sim::sentences::says(&of.physics[0], &of);
    assert!(says.starts_with("Viscous friction differs by direction: 166 "), "{says}");
    assert!(
        says.contains(" forward, 241 back; the model has 204.") && !says.contains("ry friction"),
        "{says}"
    );
}

/// What may be nothing by its interval is not said beside what isn't.
#[test]
fn what_may_be_nothing_is_left_out() {
    let found = &founds()[1];
    let mut of = with_term(found, "coulomb_friction", 0.37, 0.02, 0.0).unwrap();
    of.physics.extend(with_term(found, "load_step", -0.2, 2.0, 0.0).unwrap().physics);
    let answer = diagnosis(&of, &Clock::default(), 0.0);
    assert!(answer.sentence.starts_with("Dry friction of 0.457"), "{answer:?}");
    assert!(!answer.also.contains("load of"), "{answer:?}");
}

/// Friction by direction in an unknown motor, each of its numbers as wide as the motor's own: it may be nothing where it gains little, and what is known together is told where it
/// gains much.
#[test]
fn what_gains_much_is_not_nothing_however_wide_its_intervals() {
    let mut of = with_term(&founds()[1], "directional_friction", 1.0, 0.1, 0.0).unwrap();
    let drift_sim::plant::Plant::Servo(servo) = &mut of.improved.plant else { panic!() };
    servo.viscous = 3.0;
    let named = &mut of.physics[0];
    named.term.parameters = vec![0.2, 0.1, 0.4, -0.4];
    named.half_widths = vec![5.0, 5.0, 20.0, 20.0];
    named.train_gain = 20.0;
    assert!(named.may_be_nothing());
    named.train_gain = 1_000.0;
    assert!(!named.may_be_nothing());
    let says = drift_sim::sentences::says(&of.physics[0], &of);
    assert!(says.starts_with("Viscous friction differs by direction: 3.4 "), "{says}");
    assert!(
        says.contains(" forward, 2.6 back; ") && says.contains("Dry friction beside it: 0.15 "),
        "{says}"
    );
}

/// An effort channel and a CUSUM over a loop with u = 0.2 y, its scatter 0.01, with `shift` from 200 s on.
fn monitored(shift: f64, dates: bool) -> (Summary, Chart) {
    monitored_with(Memory::NONE, shift, dates)
}

fn monitored_with(memory: Memory, shift: f64, dates: bool) -> (Summary, Chart) {
    let detectors = Detectors {
        cusum: Some(Cusum::new(0.5, 5.0)),
        shewhart: Some(Shewhart::symmetric(4.0)),
        ..Detectors::NONE
    };
    let none =
        Channel::new(ChannelKind::EnergyError(Index::Iae), Baseline::known(0.0, 0.0, 0.0), Detectors::NONE);
    let mut effort = Channel::new(ChannelKind::Effort, Baseline::known(0.0, 0.2, 0.01), detectors);
    effort.memory = memory;
    let config: Config<f32, 3> = Config::new(0.1, 10, 5, [none, effort, none]);
    let mut csv = String::from(if dates { "Date,r,y,u\n" } else { "t,r,y,u\n" });
    for i in 0..5000 {
        let t = f64::from(i) * 0.1;
        let wave = 0.01 * libm::sin(7.0 * f64::from(i / 50));
        let u = 2.0 + wave + if t >= 200.0 { shift } else { 0.0 };
        let stamp = if dates {
            let (second, tenth) = (i / 10, i % 10);
            format!("2024-05-01 12:{:02}:{:02}.{tenth}", second / 60, second % 60)
        } else {
            format!("{t:.1}")
        };
        csv += &format!("{stamp},10,10,{u}\n");
    }
    let mut stream =
        RecordingStream::from_reader("run.csv", Cursor::new(csv), &ReadOptions::default()).unwrap();
    let mut chart = Chart::new(&config);
    let outputs = Outputs { chart: Some(&mut chart), ..Outputs::default() };
    (watch(&mut stream, &config, outputs).unwrap(), chart)
}

#[test]
fn runs_of_the_monitor_say_times_and_sizes_that_a_person_reads() {
    for shift in [0.0, 1e-6, 0.02, -0.05, 3.0, 45.0] {
        let (summary, chart) = monitored(shift, false);
        let answer = monitoring(&summary, &summary.clock());
        check("monitor", answer.texts().map(str::to_owned));
        let text = screen(&summary, None, &Terminal::plain()) + &chart.rows(&summary, &Terminal::plain());
        check("screen", [text.clone()]);
        assert!(text.lines().all(|line| line.len() <= 80), "{text}");
    }
}

/// The change of u is that of u, whatever part of it the residual of a relation with memory shows: here u = 0.2 y + 0.1 y' - 0.5 u',
/// of which a lasting shift shows half as large again.
#[test]
fn the_change_of_u_is_what_u_changed_by() {
    let memory = Memory { order: 1, x: [0.1, 0.0, 0.0], value: [-0.5, 0.0, 0.0] };
    for memory in [Memory::NONE, memory] {
        let (summary, _) = monitored_with(memory, 0.2, false);
        let answer = monitoring(&summary, &summary.clock());
        let size = answer.numbers.iter().find(|n| n.label == "mean change of u at the same y").unwrap();
        assert_eq!(size.value, "+0.2", "{memory:?}");
    }
}

/// A recording with dates is told in dates, wherever a time stands.
#[test]
fn dates_of_the_recording_are_dates_in_every_sentence() {
    let (summary, _) = monitored(0.2, true);
    let answer = monitoring(&summary, &summary.clock());
    let (minutes, seconds) = (summary.events[0].from_s() as i64 / 60, summary.events[0].from_s() as i64 % 60);
    let date = format!("2024-05-01 12:{minutes:02}:{seconds:02}");
    assert_eq!(answer.sentence, format!("It takes more effort to hold y than it did, since about {date}."));
    let text = screen(&summary, None, &Terminal::plain());
    assert!(!text.contains("since 200"), "{text}");
}

/// What a command prints and tells in a folder, with its exit code.
fn said(folder: &Path, line: &str) -> (Option<i32>, String) {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_drift"));
    let out = command.args(line.split(' ')).current_dir(folder).env("LC_ALL", "C").output().unwrap();
    (out.status.code(), String::from_utf8([out.stdout, out.stderr].concat()).unwrap())
}

/// Every line that the commands print or tell on the way from a loop file to a diagnosis, for a person at a terminal: an oven that loses
/// a tenth of its gain, in a recording with units that repeats one time stamp.
#[test]
#[ignore = "slow: every command once"]
fn terminals_say_what_a_person_reads() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let (healthy, _) = OVEN.split_once("[[physics]]").unwrap_or((OVEN, ""));
    write("oven.toml", healthy);
    write(
        "weak.toml",
        &format!("{healthy}\n[[physics]]\nkind = \"gain_loss\"\nloss = 0.1\nonset_s = 30000\n"),
    );
    let set_points = "--reference-mean 60 --reference-sd 2 --reference-hold 300";
    let mut read = 0;
    for (line, code) in [
        (format!("simulate oven.toml {set_points} --duration 300000 -o healthy.csv"), 0),
        (format!("simulate weak.toml {set_points} --duration 60000 --seed 2 -o now.csv"), 0),
        ("look now.csv".into(), 0),
        ("init now.csv".into(), 0),
        ("init now.csv -o found.toml".into(), 0),
        ("plan oven.toml --diagnosis none.json -o x".into(), 1),
        ("calibrate healthy.csv -o baseline.toml --window 1500 --confirm 10".into(), 0),
        ("calibrate now.csv -o few.toml --false-alarm-every 720".into(), 0),
        ("monitor now.csv --baseline baseline.toml --report monitor.html".into(), 0),
        ("diagnose now.csv --loop oven.toml --report page.html".into(), 0),
        ("diagnose healthy.csv --loop oven.toml".into(), 0),
        ("calibrate healthy.csv -o x --window 7.123456789".into(), 1),
        ("diagnose now.csv --loop oven.toml --sample-time 0.123456789".into(), 1),
    ] {
        let (ended, text) = said(folder.path(), &line);
        assert_eq!(ended, Some(code), "{line}: {text}");
        for printed in text.lines().filter(|printed| !printed.contains(" = ") && !printed.contains("drift "))
        {
            // An error quotes what was typed.
            let faults = if code == 0 { fault(printed).or_else(|| unread_digits(printed)) } else { None };
            assert_eq!(faults, None, "{line}: {printed}");
            assert!(printed.chars().count() <= 80 || code != 0, "{line}: {printed}");
            read += 1;
        }
    }
    assert!(read > 150, "{read} lines read");
    // The page says how the line moved, what each detector looks at, and keeps a number with its unit.
    let page = std::fs::read_to_string(folder.path().join("monitor.html")).unwrap();
    assert!(
        ["x (shifted)", "x (tilted)", "x (shifted and tilted)"]
            .iter()
            .any(|how| page.replace('\u{a0}', " ").contains(how))
    );
    assert!(page.contains("the running sum (CUSUM)") && page.contains("\u{a0}sigma<"));
}

/// What was found is said of what was found only: a healthy loop was simulated once.
#[test]
fn a_healthy_loop_is_not_told_with_what_was_found() {
    let found = &founds()[0];
    assert!(found.diagnosis.physics.is_empty());
    let (signals, clock) = (found.signals.clone(), Clock::new(None, found.signals.duration_s()));
    let case = page::Case {
        first: &Shown { file: "run.csv".into(), signals, clock },
        further: &[],
        holdout: None,
        healthy: &[],
        loop_file: Some(Path::new("loop.toml")),
        columns: &ColumnMap::default(),
        is_identified: false,
    };
    let made = page::page(&found.diagnosis, &case, String::new());
    for text in texts(&made) {
        assert!(!text.contains("with it") && !text.contains("what was found"), "{text}");
    }
}

/// A valve whose jump may be nothing by its interval sticks and follows; one whose jump is sure jumps.
#[test]
fn a_jump_of_nothing_is_not_told() {
    let found = &founds()[0];
    let mut of = with_term(found, "stiction", 1.0, 0.1, 0.0).unwrap();
    of.physics[0].term.parameters = vec![1.56, 0.04, 0.0, 0.0];
    of.physics[0].half_widths = vec![0.05, 0.12, f64::NAN, f64::INFINITY];
    let says = drift_sim::sentences::says(&of.physics[0], &of);
    assert_eq!(says, "The valve sticks until u is 1.56 % away from it, and then follows.");
    of.physics[0].half_widths[1] = 0.01;
    let says = drift_sim::sentences::says(&of.physics[0], &of);
    assert_eq!(says, "The valve sticks until u is 1.56 % away from it, then jumps by 0.04 %.");
    of.physics[0].term.parameters[3] = 1.0;
    let says = drift_sim::sentences::says(&of.physics[0], &of);
    let slides = "The valve sticks until u is 1.56 % away from it, then jumps by 0.04 % and goes on with u until u turns.";
    assert_eq!(says, slides);
}

/// Of two limits the one that was never reached is not told: its interval is wider than both are apart.
#[test]
fn a_limit_that_was_never_reached_is_not_told() {
    let found = &founds()[0];
    let mut of = with_term(found, "saturation", 1.0, 0.1, 0.0).unwrap();
    of.physics[0].term.parameters = vec![-85.76, 53.91];
    for (half_widths, says, number) in [
        ([140_000.0, 1.3], "What reaches the plant is limited to 53.9 % at most.", "53.9 \u{b1} 1.3 %"),
        ([1.3, 140_000.0], "What reaches the plant is limited to -85.8 % at least.", "-85.8 \u{b1} 1.3 %"),
        ([1.3, 1.3], "What reaches the plant is limited to -85.8 % .. 53.9 %.", "-85.8 \u{b1} 1.3 %"),
    ] {
        of.physics[0].half_widths = half_widths.to_vec();
        assert_eq!(drift_sim::sentences::says(&of.physics[0], &of), says);
        let numbers = diagnosis(&of, &Clock::default(), 0.0).numbers;
        assert!(numbers.iter().any(|shown| shown.value.replace('\u{a0}', " ") == number), "{numbers:?}");
    }
}

/// A fit that noise alone would not leave puzzles: what is said then is that only noise is left.
#[test]
fn a_fit_is_never_better_than_noise_allows() {
    let found = &founds()[0];
    let mut of = with_term(found, "gain_loss", 0.1, 0.02, 0.0).unwrap();
    of.physics[0].holdout_errors = f64::NAN;
    let label = |of: &Diagnosis| diagnosis(of, &Clock::default(), 0.0).numbers[0].label.clone();
    for (reached, floor, says) in [
        (90.8, 71.2, "fit of u on unseen data; only noise is left"),
        (95.6, 95.5, "fit of u on unseen data; only noise is left"),
        (95.6, 97.25, "fit of u on unseen data; noise alone leaves 97.2"),
        (-0.04, 0.03, "fit of u on unseen data; nothing but noise moves it there"),
    ] {
        of.holdout.after = Some(FitPct { y_pct: 99.0, u_pct: Some(reached) });
        of.noise_floor = Some(FitPct { y_pct: 99.0, u_pct: Some(floor) });
        assert_eq!(label(&of), says);
    }
    of.noise_floor = Some(FitPct { y_pct: 99.0, u_pct: Some(71.2) });
    of.holdout.after = Some(FitPct { y_pct: 99.0, u_pct: Some(90.8) });
    assert_eq!(of.noise_leaves(), None);
}

/// Where somebody knows the units, the monitor's numbers have them.
#[test]
fn the_monitor_s_numbers_have_units() {
    let (mut summary, _) = monitored(0.2, false);
    summary.units.u = Some("%".into());
    let answer = monitoring(&summary, &summary.clock());
    assert!(answer.numbers.iter().any(|n| n.value == "+0.2 %"), "{answer:?}");
    let (mut summary, _) = monitored(0.0, false);
    (summary.units.y, summary.units.u) = (Some("degC".into()), Some("%".into()));
    let also = monitoring(&summary, &summary.clock()).also;
    assert!(
        also.starts_with("A lasting shift of u by less than 0.0")
            && also.contains(" %, or of y by less than "),
        "{also}"
    );
    assert!(also.contains(" degC, may hide"), "{also}");
}
