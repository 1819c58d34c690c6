//! What may enter a sum: gaps, saturation, manual mode and blanking, in any order.

use drift_core::{
    AllDetectors, Baseline, Blanks, Channel, ChannelKind, Config, ConfigError, Cusum, Detectors, Everything,
    Ewma, Excluded, Full, FullMonitor, Iae, Index, Indices, Input, Location, Monitor, Options, Pair, Plan,
    Refitted, Remembering, Report, Shewhart, Smallest, Sprt, Tumbling, Verdict, WindowStatus,
};
use proptest::prelude::ProptestConfig;
use proptest::test_runner::RngSeed;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// The same cases at each run, and no file of those that failed.
pub(crate) fn repeatable() -> ProptestConfig {
    ProptestConfig { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() }
}

/// Reports hold NaN where nothing was judged: compared as text, which shows every digit of an f32. What was left
/// out, and why, is compared apart.
pub(crate) fn text<const C: usize, I: std::fmt::Debug>(mut report: Report<C, I>) -> String {
    report.excluded = Excluded::NONE;
    format!("{report:?}")
}

pub(crate) fn watched(kind: ChannelKind) -> Channel {
    let detectors = Detectors {
        shewhart: Some(Shewhart::symmetric(3.0)),
        cusum: Some(Cusum::new(0.5, 4.0)),
        sprt: Some(Sprt::mean_and_deviation(1.0, 1.5, -2.9, 2.9)),
        ewma: Some(Ewma::new(0.1, 0.62)),
    };
    Channel::new(kind, Baseline::known(0.0, 0.0, 0.02), detectors)
}

pub(crate) fn channels() -> [Channel; 3] {
    [ChannelKind::EnergyError(Index::Iae), ChannelKind::Effort, ChannelKind::Activity].map(watched)
}

pub(crate) fn noise(count: usize, seed: u64) -> Vec<[f32; 3]> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| [(); 3].map(|()| StandardNormal.sample(&mut rng))).collect()
}

/// Runs one window of a constant signal in which `leave_out` says what is missing, after a whole one.
fn constant_window(leave_out: impl Fn(u32) -> bool) -> Option<Indices> {
    let config = Config::new(0.01, 100, 8, channels());
    let mut monitor = FullMonitor::<f32, 8>::new(config).unwrap();
    let mut last = None;
    for i in 0..1600 {
        let input = if i >= 800 && leave_out(i - 800) {
            Input::Missing
        } else {
            // y moves by the same amount every tick.
            Input::Sample { r: 2.0 + i as f32 / 64.0, y: 1.0 + i as f32 / 64.0, u: 0.5 }
        };
        last = monitor.tick_input(input).copied().or(last);
    }
    last.filter(|r| r.status == WindowStatus::Valid).map(|r| r.indices)
}

#[test]
fn gaps_do_not_bias_the_indices() {
    let whole = constant_window(|_| false).unwrap();
    assert!((whole.speed - 100.0 / 64.0).abs() < 1e-5 && (whole.iae - 8.0).abs() < 1e-5, "{whole:?}");
    let random = noise(800, 5);
    let cases: [(&str, &dyn Fn(u32) -> bool); 5] = [
        ("30 % at random", &|i| random[i as usize][0] > 0.524),
        ("the first 30 % of each block", &|i| i % 100 < 30),
        ("the last 30 % of each block", &|i| i % 100 >= 70),
        ("two whole blocks at the end", &|i| i >= 600),
        ("two whole blocks at the beginning and some ticks", &|i| i < 200 || i % 7 == 0),
    ];
    for (case, leave_out) in cases {
        let gappy = constant_window(leave_out).unwrap();
        // mean y moves through the window and the gap's own samples are unknown: all others are constants.
        for (name, got, want) in [
            ("e_u", gappy.e_u, whole.e_u),
            ("iae", gappy.iae, whole.iae),
            ("ise", gappy.ise, whole.ise),
            ("itae", gappy.itae, whole.itae),
            ("itse", gappy.itse, whole.itse),
            ("mean_u", gappy.mean_u, whole.mean_u),
            ("mean_e", gappy.mean_e, whole.mean_e),
            ("speed", gappy.speed, whole.speed),
            ("motion_effort", gappy.motion_effort, whole.motion_effort),
            ("reference_activity", gappy.reference_activity, whole.reference_activity),
        ] {
            assert!((got / want - 1.0).abs() < 2e-6, "{case}: {name} {got} instead of {want}");
        }
    }
}

/// Every second tick is missing: half of the ticks are valid, but no two follow one another, so that there is no
/// speed and no effort along the motion. Zero in their place would be called friction.
#[test]
fn without_pairs_of_ticks_no_motion_is_judged() {
    let kinds = [ChannelKind::EnergyError(Index::Iae), ChannelKind::MotionEffort, ChannelKind::Activity];
    let mut channels = kinds.map(watched);
    // The healthy motion: u sign(dy) about 0.5 at a speed of about 100 per second.
    channels[1].baseline = Baseline::known(0.5, 0.0, 0.02);
    channels[0].detectors = Detectors::NONE;
    channels[2].detectors = Detectors::NONE;
    let config = Config::new(0.01, 50, 4, channels);
    let mut monitor = FullMonitor::<f32, 4>::new(config).unwrap();
    let mut decisions = 0;
    for i in 0..20_000 {
        let sample = Input::Sample { r: i as f32, y: i as f32, u: 0.5 };
        let Some(report) = monitor.tick_input(if i % 2 == 0 { Input::Missing } else { sample }) else {
            continue;
        };
        decisions += 1;
        let [_, motion, activity] = report.channels;
        assert_eq!(report.status, WindowStatus::Valid);
        assert!(report.indices.mean_u == 0.5, "what needs no pairs is there: {report:?}");
        let i = report.indices;
        assert!(i.speed.is_nan() && i.motion_effort.is_nan() && i.reference_activity.is_nan(), "{i:?}");
        assert!(motion.z.is_nan() && activity.x.is_nan());
        assert_eq!((motion.verdict, report.location()), (Verdict::Healthy, Location::Nowhere));
    }
    assert_eq!(decisions, 100);
}

/// The largest samples in the longest window that a monitor takes: every index is a finite number.
#[test]
fn the_largest_window_of_the_largest_samples_is_finite() {
    let config = Config::new(1.0, 65_535, 64, channels());
    let mut monitor = FullMonitor::<f32, 64>::new(config).unwrap();
    let largest = <f32 as drift_core::Number>::LIMIT;
    let report = (0..65_535 * 64).find_map(|_| monitor.tick(largest, -largest, largest).copied()).unwrap();
    let i = report.indices;
    for (name, index) in [("e_u", i.e_u), ("iae", i.iae), ("ise", i.ise), ("itae", i.itae), ("itse", i.itse)]
    {
        assert!(index.is_finite() && index > 0.0, "{name} {index}");
    }
}

#[test]
fn too_few_valid_ticks_or_blocks_give_no_window() {
    assert!(constant_window(|i| i % 100 < 51).is_none(), "each block holds 49 of 100");
    assert!(constant_window(|i| i % 100 < 50).is_some(), "half is enough");
    assert!(constant_window(|i| i < 500).is_none(), "three of eight blocks");
    assert!(constant_window(|i| i < 400).is_some(), "four of eight blocks");
}

/// A quiet loop in counts: one count of error in a block. Whole numbers can't be scaled by 100/52; truncated, the
/// window was 48 % low.
#[test]
fn gaps_in_quiet_counts_are_made_up_in_proportion() {
    let config = Config::new(1.0, 100, 4, channels());
    let mut monitor = FullMonitor::<i32, 4>::new(config).unwrap();
    let input = |i: u32| match i % 100 {
        0..48 => Input::Missing,
        70 => Input::Sample { r: 1, y: 0, u: 1 },
        _ => Input::Sample { r: 0, y: 0, u: 0 },
    };
    let i = (0..400).find_map(|i| monitor.tick_input(input(i)).copied()).unwrap().indices;
    for (name, got, want) in [
        ("e_u", i.e_u, 4.0 * 100.0 / 52.0),
        ("iae", i.iae, 4.0 * 100.0 / 52.0),
        ("ise", i.ise, 4.0 * 100.0 / 52.0),
        ("mean_u", i.mean_u, 1.0 / 52.0),
        ("mean_e", i.mean_e, 1.0 / 52.0),
    ] {
        assert!((got / want - 1.0).abs() < 1e-6, "{name} {got} instead of {want}");
    }
}

/// With counts the filled-in sums are exact as well.
#[test]
fn gaps_in_counts_are_filled_exactly() {
    let config = Config::new(1.0, 10, 4, channels());
    let mut monitor = FullMonitor::<i32, 4>::new(config).unwrap();
    let inputs = |i: i32| if i % 10 < 3 { Input::Missing } else { Input::Sample { r: 7, y: 2, u: -3 } };
    let report = (0..40).find_map(|i| monitor.tick_input(inputs(i)).copied()).unwrap();
    let i = report.indices;
    assert_eq!((i.e_u, i.iae, i.ise), (360.0, 200.0, 1000.0));
    assert_eq!((i.itae, i.itse), (5.0 * 780.0, 25.0 * 780.0));
    assert_eq!(report.excluded.missing, 12);
}

#[test]
fn excluded_ticks_are_counted_by_reason_and_enter_no_sum() {
    let config = Config::new(0.01, 50, 2, channels()).with_saturation(-1.0, 1.0).with_blanking(0.5, 5);
    let mut monitor = FullMonitor::<f32, 2>::new(config).unwrap();
    let mut report = None;
    for i in 0..100 {
        let sample = |u| Input::Sample { r: if i < 60 { 0.0 } else { 1.0 }, y: 0.25, u };
        report = report.or(monitor
            .tick_input(match i {
                10 | 11 => Input::Missing,
                20 => sample(f32::NAN),
                21 | 22 => sample(1e14),
                30 => sample(1.0),
                31 => sample(-1.0),
                40..44 => Input::Manual,
                // Within the blanking after the step at 60: an excluded sample is blanked, but its u is as good as none.
                60..65 => sample(1e3),
                _ => sample(0.5),
            })
            .copied());
    }
    let report = report.unwrap();
    let expected =
        Excluded { missing: 2, non_finite: 1, out_of_range: 2, saturated: 2, manual: 4, blanked: 5 };
    assert_eq!(report.excluded, expected);
    assert_eq!(report.excluded.total(), 16);
    assert_eq!(report.indices.peak_u, 0.5);
    assert!((report.indices.mean_u - 0.5).abs() < 1e-6, "{report:?}");
}

#[test]
fn reopening_in_manual_mode_makes_no_step_and_no_motion() {
    let config = Config::new(0.01, 50, 2, channels()).with_blanking(0.5, 20);
    let mut monitor = FullMonitor::<f32, 2>::new(config).unwrap();
    let mut report = None;
    for i in 0..100 {
        report = report.or(monitor
            .tick_input(match i {
                0..40 => Input::Sample { r: 0.0, y: 0.0, u: 0.1 },
                40..45 => Input::Manual,
                _ => Input::Sample { r: 9.0, y: 9.0, u: 0.1 },
            })
            .copied());
    }
    let report = report.unwrap();
    assert_eq!((report.excluded.blanked, report.excluded.manual), (0, 5));
    assert_eq!((report.indices.reference_activity, report.indices.speed), (0.0, 0.0));
}

/// A step of the reference that happens while samples are missing still blanks; the blanking time runs on
/// through missing ticks.
#[test]
fn a_step_across_missing_samples_is_blanked() {
    let config = Config::new(0.01, 50, 2, channels()).with_blanking(0.5, 20);
    let mut monitor = FullMonitor::<f32, 2>::new(config).unwrap();
    let mut report = None;
    for i in 0..100 {
        report = report.or(monitor
            .tick_input(match i {
                40..45 | 50..60 => Input::Missing,
                _ => Input::Sample { r: if i < 42 { 0.0 } else { 9.0 }, y: 0.0, u: 0.1 },
            })
            .copied());
    }
    // 45..50 and 60..65: twenty ticks from 45 on, ten of them missing.
    assert_eq!(report.unwrap().excluded, Excluded { missing: 15, blanked: 10, ..Excluded::NONE });
}

/// A window that keeps no ring gives the same bits as one that does, gaps and all.
#[test]
fn tumbling_windows_are_sliding_ones_with_the_hop_of_a_window() {
    #[derive(Debug, Clone, Copy)]
    struct WithoutRing;
    impl Options for WithoutRing {
        type Window = Tumbling;
        type Detectors = AllDetectors;
        type Curve = Refitted;
        type Blanking = Blanks;
        type Excluded = Excluded;
        type Memory = Remembering;
        const LIMITS: bool = true;
        const GAPS: bool = true;
        const PREDICTION: bool = true;
    }
    let config = Config::new(0.001, 45, 7, channels()).with_blanking(2.5, 5).with_saturation(-3.0, 3.0);
    let mut tumbling = Monitor::<f32, Full, WithoutRing, 3>::new(config).unwrap();
    let mut sliding = Monitor::<f32, Full, Everything<9>, 3>::new(config).unwrap();
    let mut decisions = 0;
    for (i, [r, y, u]) in noise(60_000, 21).into_iter().enumerate() {
        let input = match i % 211 {
            3 | 9 => Input::Missing,
            40..90 if i % 5 == 0 => Input::Manual,
            100 => Input::Sample { r, y: f32::NAN, u },
            _ => Input::Sample { r: 0.3 * r, y, u },
        };
        let (a, b) = (tumbling.tick_input(input), sliding.tick_input(input));
        decisions += u32::from(a.is_some());
        assert_eq!(format!("{a:?}"), format!("{b:?}"), "tick {i}");
    }
    assert_eq!(decisions, 60_000 / 315);
}

/// What the options leave out can't be asked for.
#[test]
fn what_is_not_linked_is_refused() {
    let pair = Channel::new(
        ChannelKind::EnergyError(Index::Iae),
        Baseline::known(0.0, 0.0, 1.0),
        Detectors { cusum: Some(Cusum::new(0.5, 4.0)), ..Detectors::NONE },
    );
    let config = Config::<f32, 1>::new(0.001, 10, 4, [pair]);
    let refused = |config| Plan::<f32, Pair<Iae>, Smallest>::new(config).err();
    assert_eq!(refused(config), None);
    assert_eq!(refused(config.with_hop(2)), Some(ConfigError::NotLinked("hop_blocks")));
    assert_eq!(refused(config.with_saturation(-1.0, 1.0)), Some(ConfigError::NotLinked("saturation")));
    assert_eq!(refused(config.with_blanking(1.0, 3)), Some(ConfigError::NotLinked("blanking")));
    let mut with = config;
    with.channels[0].detectors.ewma = Some(Ewma::new(0.1, 0.6));
    assert_eq!(refused(with), Some(ConfigError::NotLinked("ewma")));
    let mut learnt = config;
    learnt.channels[0].baseline.windows = 100.0;
    assert!(matches!(refused(learnt), Some(ConfigError::NotLinked(_))));
    let mut remembering = config;
    remembering.channels[0].memory.order = 1;
    assert_eq!(refused(remembering), Some(ConfigError::NotLinked("memory")));
    assert!(refused(config.with_saturation(f32::NAN, 1.0)).is_some());
}

#[test]
fn a_monitor_lives_in_a_static_without_static_mut() {
    use std::sync::Mutex;
    const CONFIG: Config<f32, 1> =
        Config::new(0.001, 10, 2, [Channel::unlearned(ChannelKind::EnergyError(Index::Iae))]);
    static MONITOR: Mutex<Option<Monitor<f32, Pair<Iae>, Smallest>>> = Mutex::new(None);
    *MONITOR.lock().unwrap() = Monitor::new(CONFIG).ok();
    let decisions = (0..100)
        .filter(|_| MONITOR.lock().unwrap().as_mut().is_some_and(|m| m.tick(1.0, 0.0, 0.0).is_some()))
        .count();
    assert_eq!(decisions, 5);
}
