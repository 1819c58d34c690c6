//! Save and restore: a restored monitor goes on bit for bit, and nothing but its own whole state is taken up.

use crate::core_samples::repeatable;
use drift_core::{
    Baseline, Channel, ChannelKind, Commissioning, Config, Cusum, Detectors, Everything, Ewma, FullMonitor,
    Iae, Index, Input, Memory, Monitor, Number, Options, Pair, PairMonitor, Shewhart, Sprt, StateError,
};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn detectors() -> Detectors {
    Detectors {
        shewhart: Some(Shewhart::symmetric(3.0)),
        cusum: Some(Cusum::new(0.5, 4.0).with_head_start(0.5)),
        sprt: Some(Sprt::mean(1.0, -2.9, 2.9)),
        ewma: Some(Ewma::new(0.1, 0.6)),
    }
}

fn channel(kind: ChannelKind) -> Channel {
    Channel::new(kind, Baseline::known(0.0, 0.0, 0.02), detectors())
}

fn full_config() -> Config<f32, 3> {
    let kinds = [ChannelKind::EnergyError(Index::Iae), ChannelKind::Effort, ChannelKind::Activity];
    let mut channels = kinds.map(channel);
    channels[1].memory = Memory { order: 2, x: [0.1, 0.05, 0.0], value: [0.3, -0.1, 0.0] };
    Config::new(0.001, 10, 4, channels).with_hop(2).with_blanking(5.0, 7).with_saturation(-9.0, 9.0)
}

fn inputs(count: usize, seed: u64) -> Vec<Input<f32>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = move || -> f32 { StandardNormal.sample(&mut rng) };
    (0..count)
        .map(|i| match i % 37 {
            3 => Input::Missing,
            4 if i > 500 => Input::Manual,
            5 => Input::Sample { r: f32::NAN, y: 0.0, u: 0.0 },
            _ => Input::Sample { r: ((i / 90) % 3) as f32 * 4.0, y: noise(), u: 4.0 * noise() },
        })
        .collect()
}

/// Reports hold NaN where nothing was judged: compared as text, which shows every digit of an f32.
fn text<R: std::fmt::Debug>(report: Option<R>) -> String {
    format!("{report:?}")
}

fn saved<N: Number, S: drift_core::IndexSet<N>, O: Options, const C: usize>(
    monitor: &Monitor<N, S, O, C>,
) -> Vec<u8> {
    let mut bytes = vec![0xA5; Monitor::<N, S, O, C>::STATE_BYTES];
    let used = monitor.save(&mut bytes).unwrap();
    bytes.truncate(used);
    bytes
}

/// The checksum as the format's description has it (CRC-32, ISO-HDLC), written out bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xEDB8_8320 & 0u32.wrapping_sub(crc & 1)))
    })
}

fn with_checksum(mut bytes: Vec<u8>) -> Vec<u8> {
    let end = bytes.len() - 4;
    let crc = crc32(&bytes[..end]);
    bytes[end..].copy_from_slice(&crc.to_le_bytes());
    bytes
}

#[test]
fn a_restored_monitor_goes_on_bit_for_bit_from_any_tick() {
    let config = full_config();
    let inputs = inputs(700, 1);
    for stop in (0..600).step_by(7) {
        let mut original = FullMonitor::<f32, 5>::new(config).unwrap();
        for input in &inputs[..stop] {
            original.tick_input(*input);
        }
        let mut restored = FullMonitor::<f32, 5>::new(config).unwrap();
        restored.restore(&saved(&original)).unwrap();
        for input in &inputs[stop..] {
            assert_eq!(text(original.tick_input(*input)), text(restored.tick_input(*input)), "from {stop}");
        }
        assert_eq!(saved(&original), saved(&restored));
    }
}

#[test]
fn counts_go_on_too() {
    let config =
        Config::new(0.001, 8, 3, [channel(ChannelKind::EnergyError(Index::Iae))]).with_units(1e-3, 1e-3);
    let mut original = PairMonitor::<i32, Iae, 4>::new(config).unwrap();
    let sample = |i: i32| (i * 7919 % 1000, i * 104_729 % 900, -(i * 31 % 1500));
    for i in 0..101 {
        let (r, y, u) = sample(i);
        original.tick(r, y, u);
    }
    let mut restored = PairMonitor::<i32, Iae, 4>::new(config).unwrap();
    restored.restore(&saved(&original)).unwrap();
    for i in 101..300 {
        let (r, y, u) = sample(i);
        assert_eq!(text(original.tick(r, y, u)), text(restored.tick(r, y, u)));
    }
}

/// A monitor that has seen something, and the bytes of another course of the same configuration.
fn target_and_blob(config: Config<f32, 3>) -> (FullMonitor<f32, 5>, Vec<u8>) {
    let mut target = FullMonitor::<f32, 5>::new(config).unwrap();
    let mut source = target;
    for input in inputs(137, 2) {
        target.tick_input(input);
    }
    for input in inputs(333, 3) {
        source.tick_input(input);
    }
    let blob = saved(&source);
    (target, blob)
}

#[test]
fn torn_anywhere_it_is_refused_and_the_monitor_unchanged() {
    let config = full_config();
    let (mut target, blob) = target_and_blob(config);
    let before = saved(&target);
    for length in 0..blob.len() {
        assert_eq!(target.restore(&blob[..length]), Err(StateError::Torn), "{length} of {}", blob.len());
    }
    assert_eq!(saved(&target), before);
    target.restore(&blob).unwrap();
    assert_eq!(saved(&target), blob);
}

#[test]
fn every_single_flipped_bit_is_refused_and_the_monitor_unchanged() {
    let config = full_config();
    let (mut target, blob) = target_and_blob(config);
    let before = saved(&target);
    for bit in 0..8 * blob.len() {
        let mut damaged = blob.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let why = target.restore(&damaged).unwrap_err();
        let fits = match bit / 8 {
            0..4 => why == StateError::NotAState,
            4..6 => why == StateError::Version,
            16..20 => matches!(why, StateError::Torn | StateError::Checksum),
            _ => why == StateError::Checksum,
        };
        assert!(fits, "bit {bit}: {why}");
    }
    assert_eq!(saved(&target), before);
}

#[test]
fn a_state_of_something_else_is_refused_with_the_reason() {
    let one = |kind| Config::<f32, 1>::new(0.001, 10, 4, [channel(kind)]);
    let config = one(ChannelKind::EnergyError(Index::Iae));
    let blob = saved(&PairMonitor::<f32, Iae, 4>::new(config).unwrap());

    let mut larger = PairMonitor::<f32, Iae, 5>::new(config).unwrap();
    assert_eq!(larger.restore(&blob), Err(StateError::OtherMonitor));
    let mut full = Monitor::<f32, drift_core::Full, Everything<4>, 1>::new(config).unwrap();
    assert_eq!(full.restore(&blob), Err(StateError::OtherMonitor));
    let mut two = Monitor::<f32, Pair<Iae>, Everything<4>, 2>::new(const { two_channels() }).unwrap();
    assert_eq!(two.restore(&blob), Err(StateError::OtherMonitor));
    let counts = Config::<i32, 1>::new(0.001, 10, 4, [channel(ChannelKind::EnergyError(Index::Iae))]);
    let mut counts = PairMonitor::<i32, Iae, 4>::new(counts).unwrap();
    assert_eq!(counts.restore(&blob), Err(StateError::OtherMonitor));

    let mut others = vec![config; 9];
    others[0].sample_time_s = 0.002;
    others[1].block_ticks = 11;
    others[2].hop_blocks = 1;
    others[3] = others[3].with_saturation(-1.0, 1.0);
    others[4] = others[4].with_blanking(1.0, 3);
    others[5].channels[0].baseline.b1 = 1e-3;
    others[6].channels[0].detectors.cusum = Some(Cusum::new(0.5, 4.0));
    others[7].decision.confirm_hops += 1;
    others[8].min_valid = 0.6;
    for (i, other) in others.iter().enumerate() {
        let mut monitor = PairMonitor::<f32, Iae, 4>::new(*other).unwrap();
        assert_eq!(monitor.restore(&blob), Err(StateError::OtherConfig), "{i}");
    }

    let mut newer = blob.clone();
    newer[4] += 1;
    let mut monitor = PairMonitor::<f32, Iae, 4>::new(config).unwrap();
    assert_eq!(monitor.restore(&with_checksum(newer)), Err(StateError::Version));
}

const fn two_channels() -> Config<f32, 2> {
    Config::new(0.001, 10, 4, [Channel::unlearned(ChannelKind::EnergyError(Index::Iae)); 2])
}

/// The limits of u are not the blanking's numbers, even when the bits are.
#[test]
fn limits_and_blanking_are_not_confused() {
    let base = Config::<i32, 1>::new(0.001, 10, 4, [channel(ChannelKind::EnergyError(Index::Iae))]);
    let (limits, blanking) = (base.with_saturation(3, 5), base.with_blanking(3, 5));
    let blob = saved(&PairMonitor::<i32, Iae, 4>::new(limits).unwrap());
    let mut monitor = PairMonitor::<i32, Iae, 4>::new(blanking).unwrap();
    assert_eq!(monitor.restore(&blob), Err(StateError::OtherConfig));
}

#[test]
fn the_stated_bytes_always_suffice_and_are_needed() {
    let config = full_config();
    let mut monitor = FullMonitor::<f32, 5>::new(config).unwrap();
    for input in inputs(400, 5) {
        monitor.tick_input(input);
    }
    assert_eq!(saved(&monitor).len(), FullMonitor::<f32, 5>::STATE_BYTES, "the ring is full");
    let mut small = vec![0; FullMonitor::<f32, 5>::STATE_BYTES - 1];
    for length in 0..small.len() {
        assert_eq!(monitor.save(&mut small[..length]), Err(StateError::BufferTooSmall), "{length}");
    }
}

#[test]
fn a_state_holding_the_impossible_is_refused() {
    let config = full_config();
    let (mut target, blob) = target_and_blob(config);
    for nan_at in 20 + 50..blob.len() - 4 {
        let mut damaged = blob.clone();
        // A NaN at any float, whatever it is: if it is taken up at all, the bytes were no float.
        damaged[nan_at..(nan_at + 4).min(blob.len() - 4)].fill(0xFF);
        if target.restore(&with_checksum(damaged)).is_ok() {
            let report = inputs(80, 4).into_iter().find_map(|i| target.tick_input(i).copied()).unwrap();
            assert!(report.channels.iter().all(|c| c.detectors.cusum.high.is_finite()));
        }
    }
}

#[test]
fn commissioning_survives_a_reset() {
    let config = full_config();
    let mut monitor = FullMonitor::<f32, 5>::new(config).unwrap();
    let mut learning = Commissioning::<3>::new();
    let reports: Vec<_> =
        inputs(4000, 6).into_iter().filter_map(|i| monitor.tick_input(i).copied()).collect();
    let (first, second) = reports.split_at(reports.len() / 2);
    first.iter().for_each(|r| learning.learn(r));
    let mut bytes = [0; Commissioning::<3>::STATE_BYTES];
    assert_eq!(learning.save(&config, &mut bytes), Ok(bytes.len()));
    let mut restored = Commissioning::<3>::new();
    let mut other = config;
    other.block_ticks += 1;
    assert_eq!(restored.restore(&other, &bytes), Err(StateError::OtherConfig));
    assert_eq!(restored.restore(&config, &bytes[..40]), Err(StateError::Torn));
    assert_eq!(restored, Commissioning::new());
    restored.restore(&config, &bytes).unwrap();
    for report in second {
        learning.learn(report);
        restored.learn(report);
    }
    assert_eq!(restored, learning);
    assert_eq!(monitor.restore(&bytes), Err(StateError::OtherMonitor));
}

proptest! {
    #![proptest_config(repeatable())]
    /// Bytes that pass the checksum but were never written by a monitor: refused or harmless.
    #[test]
    fn random_bytes_with_a_valid_checksum_are_refused_or_harmless(
        edits in prop::collection::vec((20usize..2000, any::<u8>()), 1..6),
        seed in 0u64..1000,
    ) {
        let config = full_config();
        let (mut target, mut blob) = target_and_blob(config);
        let end = blob.len() - 4;
        for (at, byte) in edits {
            blob[20 + at % (end - 20)] = byte;
        }
        let blob = with_checksum(blob);
        let before = saved(&target);
        match target.restore(&blob) {
            Err(_) => prop_assert_eq!(saved(&target), before),
            Ok(()) => {
                for input in inputs(400, seed) {
                    if let Some(report) = target.tick_input(input) {
                        for c in &report.channels {
                            let d = c.detectors;
                            let states = [d.cusum.high, d.cusum.low, d.sprt.high, d.sprt.low];
                            prop_assert!(states.iter().all(|x| x.is_finite()), "{:?}", c);
                        }
                    }
                }
                // What was restored can be saved and restored again.
                let again = saved(&target);
                prop_assert_eq!(target.restore(&again), Ok(()));
            }
        }
    }
}
