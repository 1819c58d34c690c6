//! The monitor over recordings, on loops whose truth is written down: a loop that holds y = 10 with u = 2 and some
//! deterministic scatter, with a step in u where a test wants one. Baselines are stated, not learnt.

use std::io::Cursor;

use drift_core::{
    Baseline, Channel, ChannelKind, Config, Cusum, Decision, Detectors, Index, Input, Shewhart, Side,
};
use drift_sim::baseline_file::{HostMonitor, Promise};
use drift_sim::monitor::{Chart, EventKind, FailOn, Outputs, Runner, Stopped, Summary, screen, watch};
use drift_sim::recording::{ReadOptions, RecordingStream};
use drift_sim::terminal::Terminal;

/// 0.1 s per tick, windows of 50 ticks (5 s), one decision per window; u = 2 with a standard deviation of 0.02 per
/// window mean.
fn config(confirm_hops: u16) -> Config<f32, 3> {
    let detectors = Detectors {
        shewhart: Some(Shewhart::symmetric(4.0)),
        cusum: Some(Cusum::new(0.5, 8.0)),
        ..Detectors::NONE
    };
    let channels = [
        Channel::new(ChannelKind::EnergyError(Index::Iae), Baseline::known(0.0, 0.0, 1.0), detectors),
        Channel::new(ChannelKind::Effort, Baseline::known(2.0, 0.0, 0.02), detectors),
        Channel::unlearned(ChannelKind::Activity),
    ];
    Config::new(0.1, 10, 5, channels).with_decision(Decision { confirm_hops, ..Decision::DEFAULT })
}

/// A small scatter without chance: the same in every window of 50.
fn scatter(i: usize) -> f64 {
    ((i * 7919) % 50) as f64 / 50.0 - 0.49
}

/// CSV text of `seconds` s in which u is `step(t)` more than it should be.
fn recording(seconds: usize, step: impl Fn(f64) -> f64) -> String {
    let mut csv = String::from("t,r,y,u\n");
    for i in 0..seconds * 10 {
        let t = i as f64 / 10.0;
        csv +=
            &format!("{t:.1},10,{:.4},{:.4}\n", 10.0 + 0.1 * scatter(i), 2.0 + 0.05 * scatter(i) + step(t));
    }
    csv
}

fn run_with(csv: String, config: &Config<f32, 3>, options: &ReadOptions) -> Result<Summary, String> {
    let mut stream =
        RecordingStream::from_reader("loop.csv", Cursor::new(csv), options).map_err(|e| e.to_string())?;
    watch(&mut stream, config, Outputs::default()).map_err(|stopped| match stopped {
        Stopped::Input(error) => error.to_string(),
        Stopped::Writing(error) => error.to_string(),
    })
}

fn run(csv: String, config: &Config<f32, 3>) -> Summary {
    run_with(csv, config, &ReadOptions::default()).unwrap()
}

#[test]
fn a_healthy_recording_has_no_event() {
    let summary = run(recording(500, |_| 0.0), &config(20));
    assert_eq!((summary.hops, summary.valid_hops, summary.samples()), (100, 100, 5000));
    assert!(summary.events.is_empty() && summary.worst.is_none());
    assert!(!summary.reaches(FailOn::Disturbance));
    assert!(screen(&summary, None, &Terminal::plain()).starts_with("+ HEALTHY\n"));
    assert!(
        screen(&summary, None, &Terminal::plain()).contains("no baseline"),
        "the unlearnt channel is named as such"
    );
}

#[test]
fn a_load_that_comes_and_goes_is_a_disturbance_with_its_times() {
    let summary = run(recording(500, |t| if (200.0..230.0).contains(&t) { 0.2 } else { 0.0 }), &config(20));
    let [event] = summary.events.as_slice() else { panic!("{:?}", summary.events) };
    assert_eq!(event.kind(), EventKind::Disturbance);
    assert_eq!(event.courses[0].kind, ChannelKind::Effort);
    assert_eq!(event.courses[0].side, Side::High);
    for (found, truth) in [(event.from_s(), 200.0), (event.alarm_s(), 205.0), (event.to_s().unwrap(), 230.0)]
    {
        assert!((found - truth).abs() < 1e-9, "{event:?}");
    }
    assert!(event.courses[0].detectors.contains(&"shewhart"));
    assert!((event.courses[0].max_z - 10.0).abs() < 0.1);
    assert!(summary.reaches(FailOn::Disturbance) && !summary.reaches(FailOn::Suspect));
}

#[test]
fn what_stays_is_a_drift_and_the_curve_before_and_after_is_told() {
    let summary = run(recording(500, |t| if t >= 200.0 { 0.2 } else { 0.0 }), &config(20));
    let [event] = summary.events.as_slice() else { panic!("{:?}", summary.events) };
    assert_eq!((event.kind(), event.to_s()), (EventKind::Drift, None));
    let curve = event.courses[0].fault_curve.unwrap();
    assert!((curve.shift - 0.2).abs() < 1e-3, "{curve:?}");
    let text = screen(&summary, None, &Terminal::plain());
    assert!(
        text.starts_with("# DRIFT\nIt takes more effort to hold y than it did, since about 200 s.\n"),
        "{text}"
    );
    assert!(text.contains("+0.2  "), "the shift of u that was made: {text}");
    assert!(summary.reaches(FailOn::Drift));
    let promise = Promise { false_alarm_every_h: 24.0, decisions: 17_280.0, confidence: 0.9 };
    assert!(screen(&summary, Some(&promise), &Terminal::plain()).contains("one false alarm in 24 h"));
}

#[test]
fn a_deviation_still_open_at_the_end_is_suspect() {
    let summary = run(recording(250, |t| if t >= 200.0 { -0.2 } else { 0.0 }), &config(20));
    assert_eq!(summary.worst, Some(EventKind::Suspect));
    assert_eq!(summary.events[0].courses[0].side, Side::Low);
    assert!(summary.reaches(FailOn::Suspect) && !summary.reaches(FailOn::Drift));
}

/// 1.2 sigmas that no single window shows: the CUSUM raises it and says when it began.
#[test]
fn a_small_shift_is_dated_by_where_the_sum_left_zero() {
    let summary = run(recording(1000, |t| if t >= 500.0 { 0.024 } else { 0.0 }), &config(20));
    let course = &summary.events[0].courses[0];
    assert_eq!(course.detectors, ["cusum"]);
    assert!((course.from_s - 500.0).abs() < 1e-9, "{}", course.from_s);
    assert!(course.alarm_s > 540.0, "{}", course.alarm_s);
}

#[test]
fn channels_that_are_away_together_are_one_event() {
    // From 200 s on y is off by 1 as well: IAE of a window grows from about 0.1 to 5.
    let mut csv = String::from("t,r,y,u\n");
    for i in 0..5000 {
        let away = (2000..2300).contains(&i);
        let (y, u) = if away { (11.0, 2.2) } else { (10.0, 2.0) };
        csv += &format!("{:.1},10,{y},{}\n", i as f64 / 10.0, u + 0.05 * scatter(i));
    }
    let summary = run(csv, &config(20));
    let [event] = summary.events.as_slice() else { panic!("{:?}", summary.events) };
    assert_eq!(event.courses.len(), 2);
    assert_eq!(event.location, drift_core::Location::Several);
    assert_eq!(event.main().unwrap().kind, ChannelKind::Effort);
}

#[test]
fn missing_and_manual_samples_enter_no_sum_and_are_counted() {
    let mut csv = String::from("t,r,y,u,closed\n");
    for i in 0..2000 {
        let t = i as f64 / 10.0;
        match i {
            100..120 => csv += &format!("{t:.1},10,,2,1\n"),
            300..400 => csv += &format!("{t:.1},10,55,9,0\n"),
            _ => csv += &format!("{t:.1},10,10,{},1\n", 2.0 + 0.05 * scatter(i)),
        }
    }
    let options = ReadOptions { when: vec!["closed=1".parse().unwrap()], ..ReadOptions::default() };
    let summary = run_with(csv, &config(20), &options).unwrap();
    assert_eq!((summary.excluded.missing, summary.excluded.manual), (20, 100));
    assert!(summary.events.is_empty(), "{:?}", summary.events);
    assert_eq!(summary.hops - summary.valid_hops, 2);
    let text = screen(&summary, None, &Terminal::plain());
    assert!(text.contains("left out   20 missing, 100 in manual"), "{text}");
}

#[test]
fn another_sample_time_is_refused_in_one_line() {
    let csv = recording(100, |_| 0.0);
    let config = Config { sample_time_s: 0.2, ..config(20) };
    let error = run_with(csv, &config, &ReadOptions::default()).unwrap_err();
    assert!(
        error.starts_with("loop.csv: sampled every 0.1 s, but the baseline was learnt at 0.2"),
        "{error}"
    );
}

/// Against a monitor of the core driven by hand: the same reports, and the windows' ends on the recording's clock.
#[test]
fn reports_are_the_cores_own() {
    let config = config(20);
    let csv = recording(300, |t| 0.001 * t);
    let mut stream =
        RecordingStream::from_reader("loop.csv", Cursor::new(csv.clone()), &ReadOptions::default()).unwrap();
    let mut json = Vec::new();
    watch(&mut stream, &config, Outputs { json: Some(&mut json), ..Outputs::default() }).unwrap();
    let mut monitor = HostMonitor::new(config).unwrap();
    let mut lines = std::str::from_utf8(&json).unwrap().lines();
    let mut decisions = 0;
    for (i, row) in csv.lines().skip(1).enumerate() {
        let x: Vec<f32> = row.split(',').map(|cell| cell.parse::<f64>().unwrap() as f32).collect();
        let Some(report) = monitor.tick(x[1], x[2], x[3]) else { continue };
        let line: serde_json::Value = serde_json::from_str(lines.next().unwrap()).unwrap();
        assert_eq!(line["channels"][1]["z"].as_f64().unwrap() as f32, report.channels[1].z);
        assert_eq!(line["channels"][0]["value"].as_f64().unwrap() as f32, report.indices.iae);
        assert_eq!(line["channels"][0]["index"], "iae");
        assert_eq!(line["hop"], report.hop);
        let end_s = (i + 1) as f64 / 10.0;
        assert!((line["to_s"].as_f64().unwrap() - end_s).abs() < 1e-9);
        assert!((line["from_s"].as_f64().unwrap() - (end_s - 5.0)).abs() < 1e-6);
        assert!(line["channels"][2]["z"].is_null(), "an unlearnt channel judges nothing");
        decisions += 1;
    }
    assert_eq!(decisions, 60);
    let last: serde_json::Value = serde_json::from_str(lines.next().unwrap()).unwrap();
    assert_eq!(last["schema"], "drift.monitor/1");
    assert_eq!(last["summary"]["hops"], 60);
    assert_eq!(last["summary"]["verdict"], "drift");
    assert_eq!(last["summary"]["events"][0]["channels"][0]["channel"], "effort");
    assert_eq!(last["summary"]["events"][0]["channels"][0]["fault_curve"]["b0_before"], 2.0);
    assert!(lines.next().is_none());
}

#[test]
fn the_chart_shows_every_channel_and_stays_small() {
    let config = config(20);
    let csv = recording(20_000, |t| if (5000.0..9000.0).contains(&t) { 0.3 } else { 0.0 });
    let mut stream =
        RecordingStream::from_reader("loop.csv", Cursor::new(csv), &ReadOptions::default()).unwrap();
    let mut chart = Chart::new(&config);
    let summary =
        watch(&mut stream, &config, Outputs { chart: Some(&mut chart), ..Outputs::default() }).unwrap();
    let figure = chart.figure(&summary);
    assert_eq!(figure.panels.len(), 5);
    let svg = figure.to_svg().unwrap();
    assert!(svg.contains("effort") && svg.contains("limits of one window"));
    assert!(svg.len() < 400_000, "{}", svg.len());
}

#[test]
#[ignore = "slow: times 40 million samples, meaningful in a release build only"]
fn the_monitor_keeps_up_with_twenty_million_samples_a_second() {
    const SAMPLES: usize = 40_000_000;
    let config = config(20);
    // A short stretch over and over: in the cache, so that the memory is not what is timed.
    let samples: Vec<(f32, f32, f32)> =
        (0..5000).map(|i| (10.0, 10.0 + 0.1 * scatter(i) as f32, 2.0 + 0.05 * scatter(i) as f32)).collect();
    let mut runner = Runner::new(&config, 0.1).unwrap();
    let mut hops = 0;
    let begin = std::time::Instant::now();
    for (i, &(r, y, u)) in samples.iter().cycle().take(SAMPLES).enumerate() {
        hops += usize::from(runner.tick(i as f64 * 0.1, Input::Sample { r, y, u }).is_some());
    }
    let rate = SAMPLES as f64 / begin.elapsed().as_secs_f64();
    println!("{:.1} million samples/s, {hops} decisions", rate / 1e6);
    assert_eq!(hops, SAMPLES / 50);
    assert!(rate > if cfg!(debug_assertions) { 1e5 } else { 2e7 }, "{rate} samples/s");
}

/// Also across missing and infinite samples, with a saturation, in parts of any length, and in blocks shorter and longer than what
/// the monitor adds up at once.
#[test]
fn many_samples_at_once_are_the_same_as_one_by_one() {
    const SAMPLES: usize = 20_000;
    for (block, blocks) in [(1, 7), (10, 5), (64, 3), (250, 12), (1000, 2)] {
        let shape = config(20);
        let config = Config::new(0.1, block, blocks, shape.channels).with_saturation(-3.0, 3.0);
        let signals: [Vec<f64>; 3] = std::array::from_fn(|signal| {
            let spoilt = |i: usize| match i % 4_999 {
                1_234 => f64::NAN,
                3_456 => f64::INFINITY,
                i => 2.0 * scatter(i * (signal + 1)) + f64::from(u8::from(signal == 2 && i % 700 < 30)) * 2.5,
            };
            (0..SAMPLES).map(spoilt).collect()
        });
        let singles = signals.each_ref().map(|signal| signal.iter().map(|x| *x as f32).collect::<Vec<_>>());
        let t_s = |i: usize| i as f64 * 0.1;
        let (mut runner, mut expected) = (Runner::new(&config, 0.1).unwrap(), Vec::new());
        for i in 0..SAMPLES {
            let [r, y, u] = singles.each_ref().map(|signal| signal[i]);
            let missing = r.is_nan() || y.is_nan() || u.is_nan();
            let input = if missing { Input::Missing } else { Input::Sample { r, y, u } };
            expected.extend(runner.tick(t_s(i), input));
        }
        assert!(expected.len() >= SAMPLES / (block as usize * usize::from(blocks)));
        for part in [1, 9, 250, 777, SAMPLES] {
            let (mut runner, mut hops) = (Runner::new(&config, 0.1).unwrap(), Vec::new());
            for from in (0..SAMPLES).step_by(part) {
                let to = (from + part).min(SAMPLES);
                let doubles = signals.each_ref().map(|signal| &signal[from..to]);
                let few = singles.each_ref().map(|signal| &signal[from..to]);
                let taken = |i: usize| t_s(from + i);
                if from % 2 == 0 {
                    runner.ticks_rounded(doubles, taken, |hop| hops.push(hop));
                } else {
                    runner.ticks(few, taken, |hop| hops.push(hop));
                }
            }
            // Texts: NaN is not itself.
            assert_eq!(format!("{hops:?}"), format!("{expected:?}"), "blocks of {block}, parts of {part}");
        }
    }
}
