//! What may enter a sum: hostile numbers, gaps, saturation, manual mode and blanking, in any order; and that it
//! does not matter how the samples are handed over.

use drift_core::{
    AllDetectors, Baseline, Blanking, Blanks, Channel, ChannelKind, Config, ConfigError, Cusum, Decision,
    Detector, DetectorState, Detectors, Everything, Ewma, Excluded, Full, FullMonitor, Iae, Index, IndexSet,
    Indices, Input, Itse, Location, Memory, Monitor, OperatingPoint, Options, Pair, PairMonitor, Plan,
    Refitted, Remembering, Report, Saturation, Shewhart, Smallest, Sprt, Tumbling, Verdict, WindowStatus,
};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn watched(kind: ChannelKind) -> Channel {
    let detectors = Detectors {
        shewhart: Some(Shewhart::symmetric(3.0)),
        cusum: Some(Cusum::new(0.5, 4.0)),
        sprt: Some(Sprt::mean_and_deviation(1.0, 1.5, -2.9, 2.9)),
        ewma: Some(Ewma::new(0.1, 0.62)),
    };
    Channel::new(kind, Baseline::known(0.0, 0.0, 0.02), detectors)
}

fn channels() -> [Channel; 3] {
    [ChannelKind::EnergyError(Index::Iae), ChannelKind::Effort, ChannelKind::Activity].map(watched)
}

fn noise(count: usize, seed: u64) -> Vec<[f32; 3]> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| [(); 3].map(|()| StandardNormal.sample(&mut rng))).collect()
}

/// Reports hold NaN where nothing was judged: compared as text, which shows every digit of an f32. What was left
/// out, and why, is compared apart.
fn text<const C: usize, I: std::fmt::Debug>(mut report: Report<C, I>) -> String {
    report.excluded = Excluded::NONE;
    format!("{report:?}")
}

fn finite_detectors<const C: usize>(report: &Report<C>) -> bool {
    report.channels.iter().all(|c| {
        let d = c.detectors;
        [d.cusum.high, d.cusum.low, d.sprt.high, d.sprt.low, d.ewma.mean].iter().all(|x| x.is_finite())
    })
}

fn reports<const C: usize>(
    monitor: &mut Monitor<f32, Full, Everything<8>, C>,
    inputs: impl IntoIterator<Item = Input<f32>>,
) -> Vec<String> {
    inputs.into_iter().filter_map(|i| monitor.tick_input(i).map(|r| text(*r))).collect()
}

fn long_blocks<const C: usize>(ticks: u32, limited: bool, channels: [Channel; C]) -> Config<f32, C> {
    let config = Config::new(0.001, ticks, 3, channels);
    if limited { config.with_blanking(20.0, 5).with_saturation(-50.0, 50.0) } else { config }
}

/// Reports and what is remembered are the same, one sample at a time and in slices of these lengths.
fn same_in_slices<S: IndexSet<f32>, const C: usize>(
    config: Config<f32, C>,
    samples: &[[f32; 3]],
    cuts: &[usize],
) {
    let mut single = Monitor::<f32, S, Everything<8>, C>::new(config).unwrap();
    let mut sliced = single;
    let ticked = samples.iter().filter_map(|&[r, y, u]| single.tick(r, y, u).map(|said| format!("{said:?}")));
    let one_by_one: Vec<_> = ticked.collect();
    let column = |i: usize| samples.iter().map(|s| s[i]).collect::<Vec<_>>();
    let (r, y, u) = (column(0), column(1), column(2));
    let (mut from, mut in_slices) = (0usize, Vec::new());
    for cut in cuts.iter().chain([&usize::MAX]) {
        let to = from.saturating_add(*cut).min(samples.len());
        sliced.ticks(&r[from..to], &y[from..to], &u[from..to], |said| in_slices.push(format!("{said:?}")));
        from = to;
    }
    assert_eq!(one_by_one, in_slices);
    assert_eq!(format!("{:?}", single.state()), format!("{:?}", sliced.state()));
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]
    /// Any split of the same samples into slices gives the same reports to the last bit.
    #[test]
    fn f32_reports_do_not_depend_on_the_split(cuts in prop::collection::vec(1usize..90, 1..40), seed in 0u64..1000) {
        let config = Config::new(0.001, 13, 4, channels()).with_hop(3).with_blanking(3.0, 5);
        let samples = noise(600, seed);
        let column = |i: usize| samples.iter().map(|s| s[i]).collect::<Vec<_>>();
        let (r, y, u) = (column(0), column(1), column(2));
        let mut single = FullMonitor::<f32, 8>::new(config).unwrap();
        let one_by_one: Vec<_> =
            samples.iter().filter_map(|&[r, y, u]| single.tick(r, y, u).map(|r| text(*r))).collect();
        let mut sliced = FullMonitor::<f32, 8>::new(config).unwrap();
        let (mut from, mut in_slices) = (0usize, Vec::new());
        for cut in cuts.into_iter().chain([usize::MAX]) {
            let to = from.saturating_add(cut).min(samples.len());
            sliced.ticks(&r[from..to], &y[from..to], &u[from..to], |report| in_slices.push(text(*report)));
            from = to;
        }
        prop_assert_eq!(one_by_one, in_slices);
    }

    /// The same of long blocks, whose strips are summed side by side where nothing rare happens: with and without limits of u and
    /// steps of r, with hostile and very large numbers anywhere.
    #[test]
    fn long_blocks_do_not_depend_on_the_split(
        cuts in prop::collection::vec(1usize..900, 1..20),
        block in 33u32..400,
        rare in prop::collection::vec((0usize..6000, 0usize..6), 0..12),
        limited in any::<bool>(),
        seed in 0u64..1000,
    ) {
        let mut samples = noise(6000, seed);
        for (at, what) in rare {
            let (column, value) =
                [(0, 30.0), (1, f32::NAN), (2, 50.0), (1, -0.0), (0, f32::INFINITY), (2, -9e11)][what];
            samples[at][column] = value;
        }
        let pair = |index| [watched(ChannelKind::EnergyError(index))];
        same_in_slices::<Full, 3>(long_blocks(block, limited, channels()), &samples, &cuts);
        same_in_slices::<Pair<Iae>, 1>(long_blocks(block, limited, pair(Index::Iae)), &samples, &cuts);
        same_in_slices::<Pair<Itse>, 1>(long_blocks(block, limited, pair(Index::Itse)), &samples, &cuts);
    }

    #[test]
    fn count_reports_do_not_depend_on_the_split(cuts in prop::collection::vec(1usize..90, 1..40), seed in 0u64..1000) {
        let config = Config::new(0.001, 13, 4, [watched(ChannelKind::EnergyError(Index::Itae))]);
        let counts = |i: usize| noise(600, seed).iter().map(|s| (1000.0 * s[i]) as i32).collect::<Vec<_>>();
        let (r, y, u) = (counts(0), counts(1), counts(2));
        let mut single = PairMonitor::<i32, drift_core::Itae, 8>::new(config).unwrap();
        let one_by_one: Vec<_> =
            (0..600).filter_map(|i| single.tick(r[i], y[i], u[i]).map(|r| text(*r))).collect();
        let mut sliced = PairMonitor::<i32, drift_core::Itae, 8>::new(config).unwrap();
        let (mut from, mut in_slices) = (0usize, Vec::new());
        for cut in cuts.into_iter().chain([usize::MAX]) {
            let to = from.saturating_add(cut).min(600);
            sliced.ticks(&r[from..to], &y[from..to], &u[from..to], |report| in_slices.push(text(*report)));
            from = to;
        }
        prop_assert_eq!(one_by_one, in_slices);
    }

    /// A tick with a hostile number is a tick without a sample: all reports agree with those of a run in which
    /// it is simply missing, to the last bit.
    #[test]
    fn hostile_floats_are_as_if_missing(
        hostile in prop::collection::vec((0usize..800, 0usize..3, 0usize..6), 0..200),
        seed in 0u64..1000,
    ) {
        const HOSTILE: [f32; 6] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 2e12];
        let config = Config::new(0.001, 10, 5, channels()).with_blanking(4.0, 6);
        let mut with_garbage: Vec<_> =
            noise(800, seed).into_iter().map(|[r, y, u]| Input::Sample { r, y, u }).collect();
        let mut without = with_garbage.clone();
        for (at, column, kind) in hostile {
            let mut sample = noise(1, at as u64)[0];
            sample[column] = HOSTILE[kind];
            let [r, y, u] = sample;
            with_garbage[at] = Input::Sample { r, y, u };
            without[at] = Input::Missing;
        }
        let mut a = FullMonitor::<f32, 8>::new(config).unwrap();
        let mut b = FullMonitor::<f32, 8>::new(config).unwrap();
        prop_assert_eq!(reports(&mut a, with_garbage), reports(&mut b, without));
    }

    /// Any numbers at all, in any order: no panic (overflow checks are on in this build), detectors finite for
    /// ever, and once the garbage has left the window the indices are those of a fresh monitor.
    #[test]
    fn any_floats_leave_nothing_behind(bits in prop::collection::vec(any::<[u32; 3]>(), 300), seed in 0u64..1000) {
        let config = Config::new(0.001, 10, 5, channels());
        let mut used = FullMonitor::<f32, 8>::new(config).unwrap();
        for [r, y, u] in bits {
            if let Some(report) = used.tick(f32::from_bits(r), f32::from_bits(y), f32::from_bits(u)) {
                prop_assert!(finite_detectors(report));
            }
        }
        prop_assert!(same_as_fresh(&config, used, seed));
    }

    /// The same at the edge of what is admitted, where sums of squares and of t e^2 are at their largest.
    #[test]
    fn the_largest_floats_leave_nothing_behind(signs in prop::collection::vec(any::<[bool; 3]>(), 300), seed in 0u64..1000) {
        let config = Config::new(0.001, 10, 5, channels()).with_units(1e10, 1e10);
        let mut used = FullMonitor::<f32, 8>::new(config).unwrap();
        for signs in signs {
            let [r, y, u] = signs.map(|s| if s { 1e12 } else { -1e12 });
            if let Some(report) = used.tick(r, y, u) {
                prop_assert!(finite_detectors(report));
            }
        }
        prop_assert!(same_as_fresh(&config, used, seed));
    }

    #[test]
    fn any_counts_leave_nothing_behind(samples in prop::collection::vec(any::<[i32; 3]>(), 300), small in any::<i16>()) {
        let config = Config::new(0.001, 10, 5, channels());
        let mut used = FullMonitor::<i32, 8>::new(config).unwrap();
        for (i, [r, y, u]) in samples.into_iter().enumerate() {
            let edge = [i32::MIN, i32::MAX, (1 << 20) - 1, 1 - (1 << 20), 1 << 20][i % 5];
            let report = if i % 2 == 0 { used.tick(r, y, u) } else { used.tick(edge, y % (1 << 20), edge) };
            prop_assert!(report.is_none_or(finite_detectors));
        }
        let mut fresh = FullMonitor::<i32, 8>::new(config).unwrap();
        let small = i32::from(small);
        let last = |monitor: &mut FullMonitor<i32, 8>| {
            (0..100).filter_map(|i| monitor.tick(small, small + i, -small).map(|r| r.indices)).last().unwrap()
        };
        prop_assert_eq!(format!("{:?}", last(&mut used)), format!("{:?}", last(&mut fresh)));
    }

    /// A configuration either is refused or runs; nothing panics, with overflow checks on.
    #[test]
    fn any_configuration_is_refused_or_runs(
        time in any_f32(), block in any_u32(), window in 0u16..12, hop in any_u16(),
        min_valid in any_f32(), units in (any_f32(), any_f32()),
        saturation in prop::option::of((any_f32(), any_f32())),
        blanking in prop::option::of((any_f32(), any_u32())),
        decision in (any_u16(), any_f32(), any_f32()),
        baseline in prop::array::uniform8(any_f32()),
        cusum in prop::option::of(prop::array::uniform3(any_f32())),
        sprt in prop::option::of(prop::array::uniform5(any_f32())),
        shewhart in prop::option::of(prop::array::uniform2(any_f32())),
        ewma in prop::option::of(prop::array::uniform2(any_f32())),
        memory in (0u8..5, prop::array::uniform6(any_f32())),
        kind in 0usize..4, seed in 0u64..1000,
    ) {
        let kind = [ChannelKind::EnergyError(Index::Itse), ChannelKind::Effort, ChannelKind::MotionEffort, ChannelKind::Activity][kind];
        let [b0, b1, sigma, windows, x_mean, x_ss, x_min, x_max] = baseline;
        let config = Config {
            sample_time_s: time,
            block_ticks: block,
            window_blocks: window,
            hop_blocks: hop,
            min_valid,
            y_unit: units.0,
            u_unit: units.1,
            saturation: saturation.map(|(u_min, u_max)| Saturation { u_min: -u_min, u_max }),
            blanking: blanking.map(|(reference_step, ticks)| Blanking { reference_step, ticks }),
            decision: Decision { confirm_hops: decision.0, log_odds: decision.1, smallest_shift: decision.2 },
            channels: [Channel {
                kind,
                memory: memory_of(memory),
                operating_point: OperatingPoint::NONE,
                baseline: Baseline { b0, b1, sigma, windows, x_mean, x_ss, x_min, x_max },
                detectors: Detectors {
                    cusum: cusum.map(|[k, h, head_start]| Cusum { k, h, head_start }),
                    sprt: sprt.map(|[constant, linear, quadratic, upper, lower]| Sprt { constant, linear, quadratic, upper, lower: -lower }),
                    shewhart: shewhart.map(|[lower, upper]| Shewhart { lower: -lower, upper }),
                    ewma: ewma.map(|[lambda, limit]| Ewma { lambda, limit }),
                },
            }],
        };
        if let Ok(mut monitor) = Monitor::<f32, Full, Everything<8>, 1>::new(config) {
            let samples = noise(97, seed);
            for i in 0..10_000usize {
                let [r, y, u] = samples[i % 97];
                let input = match i % 11 {
                    3 => Input::Missing,
                    5 if i % 7 == 0 => Input::Manual,
                    7 => Input::Sample { r: 1e12, y: -1e12, u: f32::MIN_POSITIVE },
                    _ => Input::Sample { r, y, u },
                };
                if let Some(report) = monitor.tick_input(input) {
                    prop_assert!(finite_detectors(report), "{:?}", report);
                }
            }
            let mut bytes = vec![0; Monitor::<f32, Full, Everything<8>, 1>::STATE_BYTES];
            let used = monitor.save(&mut bytes).unwrap();
            prop_assert_eq!(monitor.restore(&bytes[..used]), Ok(()));
        }
    }
}

fn memory_of((order, [a, b, c, d, e, f]): (u8, [f32; 6])) -> Memory {
    Memory { order, x: [a, b, c], value: [0.3 * d, 0.3 * e, 0.3 * f] }
}

/// Mostly ordinary numbers, so that many configurations are valid; and any bit pattern.
fn any_f32() -> impl Strategy<Value = f32> {
    prop_oneof![
        30 => 0.001f32..1.0,
        6 => -3.0f32..3.0,
        1 => any::<u32>().prop_map(f32::from_bits),
        1 => prop::sample::select(vec![f32::MAX, f32::MIN, f32::MIN_POSITIVE, 1e-45, 0.0, 1e20]),
    ]
}
fn any_u32() -> impl Strategy<Value = u32> {
    prop_oneof![8 => 1u32..300, 1 => any::<u32>(), 1 => prop::sample::select(vec![0, 65_535, 65_536, u32::MAX])]
}
fn any_u16() -> impl Strategy<Value = u16> {
    prop_oneof![8 => 1u16..12, 1 => any::<u16>()]
}

/// After two windows of clean samples the used monitor's indices are those of one that saw nothing else.
fn same_as_fresh(config: &Config<f32, 3>, mut used: FullMonitor<f32, 8>, seed: u64) -> bool {
    let mut fresh = FullMonitor::<f32, 8>::new(*config).unwrap();
    let last = |monitor: &mut FullMonitor<f32, 8>| {
        noise(100, seed)
            .into_iter()
            .filter_map(|[r, y, u]| monitor.tick(r, y, u).map(|r| r.indices))
            .last()
            .unwrap()
    };
    format!("{:?}", last(&mut used)) == format!("{:?}", last(&mut fresh))
}

#[test]
fn windows_of_nothing_but_garbage_are_not_judged_and_the_detectors_stand_still() {
    let config = Config::new(0.001, 10, 5, channels());
    let mut monitor = FullMonitor::<f32, 8>::new(config).unwrap();
    let last =
        noise(500, 1).into_iter().filter_map(|[r, y, u]| monitor.tick(r, y, u).copied()).last().unwrap();
    for i in 0..500 {
        if let Some(report) = monitor.tick(f32::NAN, i as f32, f32::INFINITY) {
            assert_eq!(report.status, WindowStatus::TooFewValid);
            assert_eq!(report.excluded.non_finite, 50);
            for (now, then) in report.channels.iter().zip(&last.channels) {
                assert_eq!(now.detectors, then.detectors);
                assert!(now.z.is_nan() && now.alarms == drift_core::Alarms::NONE);
            }
        }
    }
    // Every other tick garbage: half of the ticks suffice by default.
    let mut valid = 0;
    for (i, [r, y, u]) in noise(500, 2).into_iter().enumerate() {
        let u = if i % 2 == 0 { u } else { f32::NAN };
        valid += u32::from(monitor.tick(r, y, u).is_some_and(|r| r.status == WindowStatus::Valid));
    }
    assert_eq!(valid, 10);
}

/// The detectors are public: they too must not be poisoned by what a caller hands them.
#[test]
fn detectors_survive_any_residual() {
    let cusum = Cusum::new(0.5, 5.0).with_head_start(0.5);
    let sprt = Sprt::mean_and_deviation(2.0, 3.0, -4.0, 4.0);
    let ewma = Ewma::new(0.2, 1.0);
    let (mut c, mut s, mut w) = (cusum.start(), sprt.start(), drift_core::EwmaState::ZERO);
    for z in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 1e-45, 0.0, 1e20, -1e20] {
        cusum.update(&mut c, z);
        sprt.update(&mut s, z);
        ewma.update(&mut w, z);
        assert!([c.high, c.low, s.high, s.low, w.mean].iter().all(|x| x.is_finite()), "{z}: {c:?} {s:?}");
    }
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
