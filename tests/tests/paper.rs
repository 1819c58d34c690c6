//! The paper's results against the numbers that it prints, and what lies beyond. Fixed seed; the statistics' truth
//! is the paper, the exact run lengths of drift-sim's design, or a bound stated beforehand.

use std::sync::OnceLock;

use drift_sim::paper::eigenvalues::eigenvalues;
use drift_sim::paper::published;
use drift_sim::paper::{Paper, Settings};
use serde_json::Value;

/// Few runs: what needs no statistics.
fn small() -> Settings {
    Settings { repeats: 2, healthy_runs: 2, streams: 2, stream_s: 2000, delay_runs: 2, ..Settings::new(1) }
}

/// Half the runs that the command makes, shared by the slow tests.
fn paper() -> &'static Paper {
    static PAPER: OnceLock<Paper> = OnceLock::new();
    PAPER.get_or_init(|| {
        let settings = Settings { healthy_runs: 200, streams: 120, delay_runs: 100, ..Settings::new(1) };
        Paper::reproduce(&settings, &|| ()).unwrap()
    })
}

/// Equation 13, to its four printed digits.
#[test]
fn the_eigenvalues_are_the_papers() {
    let ours = eigenvalues().unwrap();
    assert_eq!(ours.len(), published::EIGENVALUES.len());
    for (ours, theirs) in ours.iter().zip(published::EIGENVALUES) {
        assert!((ours.0 - theirs.0).abs() < 5e-5 && (ours.1 - theirs.1).abs() < 5e-5, "{ours:?}");
    }
}

/// Section 6.2: a rising line through 195 windows that explains most of the variance, over 20 seeds; and neighbours
/// of windows that share five sixths of their samples correlate by about that.
#[test]
#[ignore = "slow: the whole paper with half its runs"]
fn the_nominal_relation_is_a_rising_line() {
    let ours = &paper().baseline;
    assert_eq!(ours.line.n, 195);
    assert!(ours.line.b1_ci95_hac[0] > 0.0 && ours.over_seeds.b1.min > 0.0);
    assert!(ours.over_seeds.r2.min > 0.8, "{:?}", ours.over_seeds.r2);
    assert!((0.7..0.9).contains(&ours.over_seeds.lag1.mean), "{:?}", ours.over_seeds.lag1);
    // Where we differ from the paper stays said: if these ever agree, the page must change.
    assert!(
        ours.over_seeds.b0.max < published::BASELINE.b0 && ours.over_seeds.b1.max < published::BASELINE.b1
    );
    // What could explain it: the published line with another gain.
    let other = &ours.with_other_kp;
    for (spread, theirs) in [
        (other.b0, published::BASELINE.b0),
        (other.b1, published::BASELINE.b1),
        (other.r2, published::BASELINE.r2),
    ] {
        assert!((spread.min..=spread.max).contains(&theirs), "{spread:?} {theirs}");
    }
}

/// Textbook thresholds on overlapping windows alarm in nearly every healthy run of 100 s; mended, in as many as one
/// false alarm per 2000 s makes: 1 - exp(-100/2000), 4.9 %.
#[test]
#[ignore = "slow: the whole paper with half its runs"]
fn overlapping_windows_alarm_on_healthy_data_and_are_mended() {
    let study = &paper().overlap;
    let [worst, same_run, known, ..] = study.charts.as_slice() else { panic!("charts") };
    for chart in [worst, same_run, known] {
        assert!(chart.alarmed.share > 0.9, "{chart:?}");
    }
    for mended in study.charts.iter().skip(5).take(2) {
        let expected = 1.0 - f64::exp(-100.0 / 2000.0);
        let se = (expected * (1.0 - expected) / study.runs as f64).sqrt();
        assert!((mended.alarmed.share - expected).abs() < 3.0 * se, "{mended:?}");
        let between = mended.between_s.unwrap();
        // The threshold's own standard error is as large as the verification's.
        assert!((between.mean - 2000.0).abs() < 3.0 * 1.5 * between.se, "{mended:?}");
    }
    // `drift calibrate` promises at least that in nine of ten calibrations.
    for calibrated in study.charts.iter().skip(7) {
        let between = calibrated.between_s.unwrap();
        assert!(between.mean > 2000.0 - 3.0 * between.se, "{calibrated:?}");
    }
    assert!(study.lag1_apart.abs() < 0.05, "{}", study.lag1_apart);
}

/// At equal false-alarm rate the effort channel finds the drift that the paper's pair can't: at mu_max = 1 it is at
/// least five times as fast (ten times was hoped for; six were measured), at 0.3 at least ten times.
#[test]
#[ignore = "slow: the whole paper with half its runs"]
fn the_effort_channel_is_many_times_faster() {
    let study = &paper().delay;
    let scheme = |name: &str| study.schemes.iter().find(|s| s.scheme.name == name).unwrap();
    for result in &study.schemes {
        let between = result.between_false_alarms_s;
        assert!((between.mean - 2000.0).abs() < 3.0 * 1.5 * between.se, "{result:?}");
    }
    let (effort, pair, overlapping) =
        (scheme("effort"), scheme("energy_error"), scheme("energy_error_overlapping"));
    let mean = |result: &drift_sim::paper::delay::SchemeResult, mu_max: f64| {
        result.holding.iter().find(|d| d.mu_max == mu_max).unwrap().delay_s.mean
    };
    for (mu_max, times) in [(0.3, 10.0), (1.0, 5.0)] {
        let best = mean(pair, mu_max).min(mean(overlapping, mu_max));
        assert!(best > times * mean(effort, mu_max), "{mu_max}: {best} against {}", mean(effort, mu_max));
    }
    let moved =
        |channel: &str| study.effects.iter().find(|e| e.channel == channel).unwrap().last_sigmas.mean.abs();
    assert!(moved("effort") > 10.0 && moved("energy_error") < 1.0);
}

/// The same bytes on one thread and on two.
#[test]
#[ignore = "slow: everything twice"]
fn the_number_of_threads_changes_nothing() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let paper = pool.install(|| Paper::reproduce(&small(), &|| ()).unwrap());
        (paper.to_json(), paper.page(String::new()).to_html().unwrap())
    };
    assert_eq!(on(1), on(2));
}

/// The keys that readers of paper.json rely on, and every file whole in its place.
#[test]
#[ignore = "slow: needs 20 000 s of simulated operation"]
fn everything_is_written_with_the_keys_that_stay() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("made/anew");
    let steps = std::sync::atomic::AtomicU64::new(0);
    let count = || {
        steps.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    };
    let paper = Paper::reproduce(&small(), &count).unwrap();
    assert_eq!(steps.into_inner(), small().steps());
    paper.write(&out, "drift paper".into()).unwrap();
    let json: Value =
        serde_json::from_str(&std::fs::read_to_string(out.join("paper.json")).unwrap()).unwrap();
    let has = |value: &Value, keys: &[&str]| {
        for key in keys {
            assert!(value.get(key).is_some(), "{key} in {value}");
        }
    };
    has(&json, &["baseline", "ranking", "detection", "eigenvalues", "settings", "overlap", "delay"]);
    let line = ["b0", "b1", "b0_ci95", "b1_ci95", "r2", "adj_r2", "rmse"];
    has(&json["baseline"], &[&line[..], &["n", "published"]].concat());
    has(&json["baseline"]["published"], &line);
    assert_eq!(json["ranking"].as_array().unwrap().len(), 4);
    for rank in json["ranking"].as_array().unwrap() {
        has(rank, &["index", "delta_mu", "delta_sigma", "ratio", "published"]);
        has(&rank["published"], &["delta_mu", "delta_sigma", "ratio"]);
    }
    assert_eq!(json["detection"].as_array().unwrap().len(), 4);
    for case in json["detection"].as_array().unwrap() {
        let keys = ["mu_max", "sigma_growth", "shewhart_outside_pct", "cusum_s", "sprt_s"];
        has(case, &[&keys[..], &["b0_fault", "b1_fault", "published"]].concat());
    }
    let page = std::fs::read_to_string(out.join("paper.html")).unwrap();
    let figures: Vec<_> = paper.figure_files().collect();
    assert_eq!(figures.len(), 12);
    for figure in figures {
        let svg = std::fs::read_to_string(out.join(figure)).unwrap();
        assert!(
            svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && !svg.contains("NaN"),
            "{figure}"
        );
    }
    assert_eq!(page.matches("<figure class=\"picture\"><div class=\"broad\"><svg").count(), 12);
    assert!(page.contains("<code>drift paper</code>"));
}

/// Too few runs are refused with what is allowed.
#[test]
fn too_few_runs_are_an_error() {
    let error = Paper::reproduce(&Settings { repeats: 1, ..small() }, &|| ()).unwrap_err();
    assert_eq!(error.to_string(), "too few runs; at least 2 of each kind, streams of at least 100 s");
}
