//! Hostile numbers and hostile configurations: refused or left out, and nothing of them stays.

use crate::core_samples::{channels, noise, repeatable, text};
use drift_core::{
    Baseline, Blanking, Channel, ChannelKind, Config, Cusum, Decision, Detector, DetectorState, Detectors,
    Everything, Ewma, Full, FullMonitor, Index, Input, Memory, Monitor, OperatingPoint, Report, Saturation,
    Shewhart, Sprt, WindowStatus,
};
use proptest::prelude::*;

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

proptest! {
    #![proptest_config(repeatable())]
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
