//! A measured operating point on loops that are simulated here: a first-order plant under a PI, whose load is proportional to
//! one measured column (or two). The truth, what is load and what is fault, is known exactly.

use drift_sim::baseline_file::{BaselineFile, PointColumns};
use drift_sim::calibrate::{Calibration, DetectorChoice, Options, Signals, calibrate};
use drift_sim::monitor::{EventKind, Outputs, Summary, watch};
use drift_sim::recording::{ReadOptions, RecordingStream, csv_bytes, uniform_times_s};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Ticks per window, 1 s each.
const WINDOW: usize = 60;

struct Run {
    r: Vec<f64>,
    y: Vec<f64>,
    u: Vec<f64>,
    columns: Vec<(String, Vec<f64>)>,
}

/// The load is `0.02*(outdoor - 20) + 1.5*(flow - 0.5)`, and what `fault(window)` adds. The weather wanders about
/// `outdoor`.
fn run(windows: usize, seed: u64, outdoor: f64, fault: impl Fn(f64) -> f64) -> Run {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut levels = ChaCha8Rng::seed_from_u64(seed ^ 0x5a5a);
    let (mut level, mut flow) = (1.0, 0.5);
    let (mut warm, mut x, mut integral) = (0.0, 1.0, 1.0 + 0.02 * (outdoor - 20.0));
    let mut out = Run { r: vec![], y: vec![], u: vec![], columns: vec![] };
    let (mut outdoors, mut flows) = (vec![], vec![]);
    // Correlated over three windows, 3 degrees about its mean.
    let keep = 1.0 - 1.0 / (3.0 * WINDOW as f64);
    let step = 3.0 * f64::sqrt(1.0 - keep * keep);
    for tick in 0..windows * WINDOW {
        if tick.is_multiple_of(3 * WINDOW) {
            level = levels.random_range(0.8..1.2);
            flow = levels.random_range(0.4..0.6);
        }
        warm = keep * warm + step * normal();
        let load = 0.02 * (outdoor + warm - 20.0) + 1.5 * (flow - 0.5) + fault(tick as f64 / WINDOW as f64);
        let y = x + 0.01 * normal();
        let e = level - y;
        integral += 0.05 * e;
        let u = 0.8 * e + integral;
        x += (u - load - x) / 20.0;
        out.r.push(level);
        out.y.push(y);
        out.u.push(u);
        outdoors.push(outdoor + warm);
        flows.push(flow);
    }
    out.columns = vec![("t_outdoor".into(), outdoors), ("feed flow".into(), flows)];
    out
}

fn calibrated(run: &Run, columns: &[&str]) -> Calibration {
    let Run { r, y, u, columns: further } = run;
    let signals = Signals { name: "healthy", sample_time_s: 1.0, r, y, u, state: None, further };
    let options = Options {
        window_s: Some(WINDOW as f64),
        false_alarm_every_h: 24.0,
        channels: [false, true, false],
        detectors: DetectorChoice::default(),
        effort_memory: Some(0),
        operating_point: columns.iter().map(|c| (*c).to_owned()).collect(),
        simulated_decisions: 200_000,
        ..Options::default()
    };
    calibrate(&[signals], &options).unwrap()
}

/// What `drift monitor` does with the run written as CSV.
fn watched(file: &BaselineFile, run: &Run) -> Summary {
    let t = uniform_times_s(0.0, 1.0, run.r.len());
    let mut table: Vec<(&str, &[f64])> = vec![("t", &t), ("r", &run.r), ("y", &run.y), ("u", &run.u)];
    table.extend(run.columns.iter().map(|(name, values)| (name.as_str(), values.as_slice())));
    let extra = file.operating_point.as_ref().map_or_else(Vec::new, |point| point.columns.clone());
    let read = ReadOptions { extra, ..ReadOptions::default() };
    let mut stream =
        RecordingStream::from_reader("run.csv", std::io::Cursor::new(csv_bytes(&table).unwrap()), &read)
            .unwrap();
    // By way of the file's text, as a user has it.
    let file = BaselineFile::parse(&file.to_toml(), "baseline.toml").unwrap();
    let outputs = Outputs { operating_point: file.operating_point.as_ref(), ..Outputs::default() };
    watch(&mut stream, &file.config().unwrap(), outputs).unwrap()
}

#[test]
fn what_the_measured_load_explains_is_no_drift_and_a_true_one_still_is() {
    let healthy = run(500, 1, 20.0, |_| 0.0);
    let without = calibrated(&healthy, &[]);
    let with = calibrated(&healthy, &["t_outdoor", "feed flow"]);
    let sigmas = [&without, &with].map(|c| c.channels[0].fit.rmse);
    println!("sigma of the effort: {:.4} without, {:.4} with the operating point", sigmas[0], sigmas[1]);
    assert!(sigmas[1] < 0.35 * sigmas[0], "{sigmas:?}");

    // The weights are the plant's own, in the columns' units, to 4 %.
    let point = with.file.operating_point.clone().unwrap();
    let weight = f64::from(with.channels[0].operating_point.weight);
    let found: Vec<f64> = point.scales.iter().map(|scale| weight * f64::from(*scale)).collect();
    assert!((found[0] / 0.02 - 1.0).abs() < 0.04 && (found[1] / 1.5 - 1.0).abs() < 0.04, "{found:?}");
    assert!(point.scales.contains(&1.0));

    // A hot fortnight: 10 degrees above what was seen on average, nothing wrong.
    let hot = run(300, 2, 30.0, |_| 0.0);
    assert_eq!(watched(&without.file, &hot).worst, Some(EventKind::Drift));
    let seen = watched(&with.file, &hot);
    assert_eq!(seen.worst, None, "{:?}", seen.events);
    assert!(seen.channels[1].extrapolated > 0, "the weather beyond calibration's is flagged");

    // A leak of a twentieth of full effort, a quarter of what the weather moves: without, it is lost in the weather.
    let leak = |seed| run(300, seed, 20.0, |window| if window > 100.0 { 0.05 } else { 0.0 });
    let found = watched(&with.file, &leak(3));
    assert_eq!(found.worst, Some(EventKind::Drift));
    let alarm_s = found.events[0].alarm_s();
    println!("leak after window 100: alarm at window {:.0}", alarm_s / WINDOW as f64);
    assert!((100.0..110.0).contains(&(alarm_s / WINDOW as f64)), "{alarm_s}");
}

/// The promise is the whole monitor's: false alarms on fresh healthy runs are no more frequent than asked for.
#[test]
fn the_false_alarm_rate_is_kept_with_an_operating_point() {
    let with = calibrated(&run(500, 11, 20.0, |_| 0.0), &["t_outdoor", "feed flow"]);
    let (mut decisions, mut events) = (0, 0);
    for seed in 0..6 {
        let summary = watched(&with.file, &run(1500, 100 + seed, 20.0, |_| 0.0));
        decisions += summary.hops;
        events += summary.events.len();
    }
    let asked = with.file.promise.unwrap().decisions;
    let every = decisions as f64 / events.max(1) as f64;
    println!("one false event in {every:.0} decisions of {decisions}; one in {asked:.0} was asked for");
    assert!(every > 0.7 * asked, "{every} {asked}");
}

#[test]
fn a_missing_value_leaves_the_sample_out_and_a_constant_column_is_refused() {
    let healthy = run(300, 21, 20.0, |_| 0.0);
    let with = calibrated(&healthy, &["t_outdoor"]);
    let mut gap = run(100, 22, 20.0, |_| 0.0);
    for x in &mut gap.columns[0].1[50 * WINDOW..60 * WINDOW] {
        *x = f64::NAN;
    }
    let summary = watched(&with.file, &gap);
    assert_eq!((summary.hops, summary.valid_hops), (100, 90));

    let mut still = healthy;
    still.columns[0].1.fill(20.0);
    let Run { r, y, u, columns: further } = &still;
    let signals = Signals { name: "healthy", sample_time_s: 1.0, r, y, u, state: None, further };
    let options = |columns: &[&str]| Options {
        window_s: Some(WINDOW as f64),
        operating_point: columns.iter().map(|c| (*c).to_owned()).collect(),
        ..Options::default()
    };
    for (columns, said) in [
        (&["t_outdoor"][..], "column 't_outdoor' stands at 20.0000 in all healthy windows"),
        (&["humidity"][..], "no column 'humidity' for the operating point"),
        (&["feed flow", "feed flow"][..], "column 'feed flow' is named twice"),
        (&["a", "b", "c", "d"][..], "4 columns for the operating point; up to 3"),
    ] {
        let error = calibrate(&[signals], &options(columns)).unwrap_err().to_string();
        assert!(error.contains(said) && !error.contains('\n'), "{error}");
    }
}

#[test]
fn the_columns_make_one_number() {
    let columns = PointColumns { columns: vec!["a".into(), "b".into()], scales: vec![1.0, -2.5] };
    assert_eq!(columns.point(&[3.0, 0.5]), 1.75);
    assert!(columns.point(&[3.0]).is_nan() && columns.point(&[3.0, f64::NAN]).is_nan());
}
