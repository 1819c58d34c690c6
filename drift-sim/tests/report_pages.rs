//! The reports of all commands: what must be on them, that names from files stay text, that nothing is loaded from outside, and
//! how large they get. How they look and move in a browser is `.ci/browser`'s.

use std::io::Cursor;
use std::path::Path;

use drift_sim::calibrate::{self, Calibration, Options, calibrate};
use drift_sim::control_loop::Loop;
use drift_sim::diagnose::shown::Shown;
use drift_sim::diagnose::{self, diagnose, page};
use drift_sim::monitor::{self, Chart, Outputs, watch};
use drift_sim::physics::Term;
use drift_sim::recording::{ColumnMap, ReadOptions, RecordingStream};
use drift_sim::reference::Reference;
use drift_sim::report::{Page, command_line};
use drift_sim::sentences::Clock;
use drift_sim::simulate::{Start, simulate};

/// What a report may weigh.
const MOST_BYTES: usize = 6_000_000;
/// Markup wherever a name can stand.
const NAME: &str = "</script><script>alert(1)</script><img src=x onerror=alert(2)>'\"&";
const LOOP: &str = include_str!("../../examples/loops/oven.toml");

struct Run {
    r: Vec<f64>,
    y: Vec<f64>,
    u: Vec<f64>,
}

fn oven() -> Loop {
    Loop::parse(&LOOP.replace("\"%\"", &format!("'''{NAME}'''")), "oven.toml").unwrap()
}

/// The oven over changing set-points, every 5 s.
fn run(model: &Loop, samples: usize, seed: u64) -> Run {
    let r = Reference::random(60.0, 3.0, 100, seed).take_samples(samples);
    let trace = simulate(model, &r, &[], seed, Some(&Start::held(60.0, 48.75))).unwrap();
    Run { r, y: trace.y, u: trace.u }
}

fn columns() -> ColumnMap {
    format!("y={NAME}").parse().unwrap()
}

fn command() -> String {
    command_line(["drift", "--columns", NAME].map(Into::into))
}

fn calibration(run: &Run) -> Calibration {
    let options = Options {
        window_s: Some(500.0),
        false_alarm_every_h: 50.0,
        simulated_decisions: 50_000,
        detectors: "shewhart,cusum,sprt".parse().unwrap(),
        ..Options::default()
    };
    calibrate(&[signals(run)], &options).unwrap()
}

fn signals(run: &Run) -> calibrate::Signals<'_> {
    calibrate::Signals {
        name: NAME,
        sample_time_s: 5.0,
        r: &run.r,
        y: &run.y,
        u: &run.u,
        state: None,
        further: &[],
    }
}

fn monitor_page(healthy: &Run, drifting: &Run) -> Page {
    let baseline = calibration(healthy).file;
    let mut csv = format!("t,r,\"{}\",u\n", NAME.replace('"', "\"\""));
    for (i, ((r, y), u)) in drifting.r.iter().zip(&drifting.y).zip(&drifting.u).enumerate() {
        csv += &format!("{},{r},{y},{u}\n", 5 * i);
    }
    let options = ReadOptions { columns: columns(), ..ReadOptions::default() };
    let mut stream = RecordingStream::from_reader(NAME, Cursor::new(csv), &options).unwrap();
    let config = baseline.config().unwrap();
    let mut chart = Chart::new(&config);
    let summary =
        watch(&mut stream, &config, Outputs { chart: Some(&mut chart), ..Outputs::default() }).unwrap();
    monitor::page(&summary, &chart, &baseline, &columns(), command())
}

/// Diagnosed on `samples`, drawn on `drawn` of them, so that the size can be tested without a long diagnosis.
fn diagnosis_page(samples: usize, drawn: usize) -> Page {
    let model = oven();
    let faulty = model.clone().with(Term::new("gain_loss", &[("loss", 0.3)]).unwrap().from_s(2500.0));
    let Run { r, y, u } = run(&faulty, samples.max(drawn), 3);
    let whole = diagnose::signals::Signals {
        sample_time_s: 5.0,
        start_s: 0.0,
        origin_s: 0.0,
        r,
        y,
        u,
        inputs: Vec::new(),
    };
    let mut found = diagnose(&[whole.part(0, samples)], None, &model).unwrap();
    let train = whole.part(0, drawn);
    for drive in [&mut found.missing_drive, &mut found.drive_left].into_iter().flatten() {
        drive.value = drive.value.iter().copied().cycle().take(drawn).collect();
    }
    let clock = Clock::new(None, train.duration_s());
    let case = page::Case {
        first: &Shown { file: NAME.into(), signals: train, clock },
        further: &[],
        holdout: None,
        healthy: &[],
        loop_file: Some(Path::new(NAME)),
        columns: &columns(),
        is_identified: false,
    };
    page::page(&found, &case, command())
}

/// Each command's page of recordings of so many samples.
fn pages(samples: usize) -> [(&'static str, Page); 3] {
    // The thermometer drifts by 20 degC over the second half.
    let half_s = 2.5 * samples as f64;
    let drift = [("rate_per_s", 20.0 / half_s), ("noise_growth_per_s", 0.0)];
    let drifting = oven().with(Term::new("sensor_drift", &drift).unwrap().from_s(half_s));
    let (healthy, drifting) = (run(&oven(), samples, 1), run(&drifting, samples, 2));
    [
        ("monitor", monitor_page(&healthy, &drifting)),
        ("calibrate", calibration(&healthy).page(&[signals(&healthy)], &columns(), command())),
        ("diagnose", diagnosis_page(1500, samples)),
    ]
}

#[test]
fn pages_have_their_sections_and_charts() {
    for (name, page) in pages(6000) {
        let wanted: &[&str] = match name {
            "monitor" => &[
                "Signals, windows and decisions",
                "Residuals and detectors",
                "The lines",
                "95 % confidence of the line",
                "95 % of healthy windows",
                "limits of one window",
                "effort: sum of distances",
                "effort: evidence of a shift",
                "effort to hold y than it did, since about",
                "badge drift",
            ],
            "calibrate" => &[
                "The healthy lines",
                "The planes",
                "Thresholds",
                "95 % of healthy windows",
                "The recordings",
            ],
            _ => &[
                "Missing physics",
                "what noise alone leaves",
                "Measured and simulated",
                "y \u{2212} \u{177} / degC",
                "The missing drive",
                "own numbers",
                "Rivals, and why they lost",
                "What can&#39;t be told",
                "The actuator delivers 70 % of what it should since 0.69",
                "badge cause_found",
            ],
        };
        let html = page.to_html().unwrap();
        for text in wanted {
            assert!(html.contains(text), "{name} lacks '{text}'; its answer: {}", page.answer.sentence);
        }
        assert!(html.contains("<h1>") && html.contains("<code>drift --columns"), "{name}");
        let figures = html.matches("<figure class=\"chart\"").count();
        assert!(
            figures >= 2 && html.matches("class=\"still\"").count() == figures,
            "{name}: {figures} charts"
        );
        // The proof, for a wide page and for a narrow one; every picture says what it shows.
        let pictures = html.matches("<svg class=\"plot\"").count();
        assert_eq!(pictures, figures + 2, "{name}");
        for tag in ["<title id=", "<desc id="] {
            assert_eq!(html.matches(tag).count(), pictures, "{name}: {tag}");
        }
        assert_eq!(page.answer.numbers.len(), 3, "{name}: {:?}", page.answer.numbers);
    }
}

#[test]
fn names_stay_text_and_nothing_is_loaded() {
    for (name, page) in pages(3000) {
        let html = page.to_html().unwrap();
        // Data, uPlot, ours: no fourth script, and none that ends early.
        assert_eq!((html.matches("<script").count(), html.matches("</script").count()), (3, 3), "{name}");
        assert!(!html.contains("<img"), "{name}");
        for outside in ["src=", "href=\"http", "url(", "@import", "<link", "<iframe", "xlink:href"] {
            let at = html.find(outside);
            let shown = at.and_then(|at| html.get(at..at + 80)).unwrap_or("");
            // The recording's own name is on the page, as text.
            assert!(at.is_none() || shown.starts_with("src=x onerror"), "{name}: {shown}");
        }
        assert!(html.contains("Content-Security-Policy\" content=\"default-src 'none';"), "{name}");
    }
}

/// 25 000 samples in every line that is drawn, and eight times as many.
#[test]
fn pages_stay_small() {
    for samples in [25_000, 200_000] {
        for (name, page) in pages(samples) {
            let bytes = page.to_html().unwrap().len();
            println!("{name}, {samples} samples: {bytes} bytes");
            assert!(bytes < MOST_BYTES, "{name}, {samples} samples: {bytes} bytes");
        }
    }
}
