//! Calibration from signals to file: the same on any number of threads, and what it refuses.

use drift_sim::baseline_file::{BaselineFile, HostMonitor};
use drift_sim::calibrate::{Options, Signals, calibrate};
use drift_sim::control_loop::Loop;
use drift_sim::reference::Reference;
use drift_sim::simulate::Simulation;

/// The paper's loop, 60 windows of 0.5 s.
fn run() -> [Vec<f64>; 3] {
    let mut simulation = Simulation::new(&Loop::paper(), 1).unwrap();
    let mut out = [Vec::new(), Vec::new(), Vec::new()];
    for r in Reference::paper(1).take_samples(30_000) {
        let step = simulation.step(r, &[]);
        for (column, value) in out.iter_mut().zip([r, step.y, step.u]) {
            column.push(value);
        }
    }
    out
}

fn signals([r, y, u]: &[Vec<f64>; 3]) -> Signals<'_> {
    Signals { name: "h.csv", sample_time_s: 0.001, r, y, u, state: None, further: &[] }
}

fn options() -> Options {
    Options {
        window_s: Some(0.5),
        false_alarm_every_h: 0.1,
        simulated_decisions: 100_000,
        ..Options::default()
    }
}

#[test]
fn one_thread_or_three_give_the_same_bytes_and_a_monitor_takes_them() {
    let run = run();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| calibrate(&[signals(&run)], &options()).unwrap().file.to_toml())
    };
    let text = on(1);
    assert_eq!(text, on(3));
    let file = BaselineFile::parse(&text, "b.toml").unwrap();
    assert!(file.channels.iter().all(|c| c.learned()));
    assert_eq!(file.calibration.windows, 60);
    HostMonitor::new(file.config().unwrap()).unwrap();
}

#[test]
fn windows_do_not_span_two_recordings() {
    let run = run();
    let half = |at: std::ops::Range<usize>| [&run[0][at.clone()], &run[1][at.clone()], &run[2][at]];
    let (a, b) = (half(0..15_250), half(15_250..30_000));
    let parts = [a, b].map(|[r, y, u]| Signals {
        name: "h.csv",
        sample_time_s: 0.001,
        r,
        y,
        u,
        state: None,
        further: &[],
    });
    assert_eq!(calibrate(&parts, &options()).unwrap().windows.len(), 30 + 29);
}

#[test]
fn a_channel_that_is_not_asked_for_is_not_judged() {
    let run = run();
    let file =
        calibrate(&[signals(&run)], &Options { channels: [false, true, false], ..options() }).unwrap().file;
    assert_eq!(file.channels.map(|c| c.learned()), [false, true, false]);
}

#[test]
fn what_can_not_be_calibrated_is_one_clear_line() {
    let run = run();
    let refused = |options: Options| calibrate(&[signals(&run)], &options).unwrap_err().to_string();
    let error = refused(Options { window_s: Some(3.0), ..options() });
    assert!(error.starts_with("10 healthy windows of 3 s; 25 or more"), "{error}");
    let error = refused(Options { confidence: 2.0, ..options() });
    assert_eq!(error, "confidence is 2; 0.5 to 0.99");
    let error = refused(Options { false_alarm_every_h: f64::NAN, ..options() });
    assert!(error.contains("a number of hours above 0"), "{error}");
    let flat = [vec![1.0; 30_000], vec![1.0; 30_000], vec![0.5; 30_000]];
    let error = calibrate(&[signals(&flat)], &options()).unwrap_err().to_string();
    assert!(error.contains("no scatter beyond rounding"), "{error}");
    let other = Signals { sample_time_s: 0.002, ..signals(&run) };
    let error = calibrate(&[signals(&run), other], &options()).unwrap_err().to_string();
    assert_eq!(error, "h.csv: the sample time is 0.002 s; 0.001 s, as in h.csv");
    assert!(calibrate(&[], &options()).is_err());
}

/// The reference never moves, the loop is kept busy by noise: the activity has nothing to be held against.
#[test]
fn a_channel_whose_x_never_varies_is_left_unlearned() {
    let [_, y, u] = run();
    let still = [vec![0.0; y.len()], y, u];
    let calibration = calibrate(&[signals(&still)], &options()).unwrap();
    assert_eq!(calibration.file.channels.map(|c| c.learned()), [true, true, false]);
    let said = "activity: the reference never moves inside a window, so there is no line to judge by: left unlearned";
    assert!(calibration.warnings.iter().any(|w| w == said), "{:?}", calibration.warnings);
    let only = Options { channels: [false, false, true], ..options() };
    let error = calibrate(&[signals(&still)], &only).unwrap_err().to_string();
    assert!(error.starts_with("x does not vary in any channel"), "{error}");
}

/// One window of 60 with a disturbance in it.
#[test]
fn a_window_far_off_the_line_is_named() {
    let mut run = run();
    run[2][10_100..10_400].iter_mut().for_each(|u| *u += 3000.0);
    let warnings = calibrate(&[signals(&run)], &options()).unwrap().warnings;
    assert!(warnings.iter().any(|w| w.contains("healthy window 21 lies")), "{warnings:?}");
}
