//! What the firmware and the host share, so that both compute the same: the PI loop, the monitors'
//! configurations, a report as words. `no_std`, plain IEEE arithmetic only.
#![no_std]

pub mod pi;
pub mod plant;
pub mod words;

use drift_core::{
    Baseline, Channel, ChannelKind, Config, Cusum, Detectors, FullMonitor, Iae, Index, PairMonitor, Shewhart,
    Sprt,
};

/// The paper's pair, 16 blocks.
pub type PairF32<'c> = PairMonitor<'c, f32, Iae, 16>;
/// The paper's pair in counts, 8 blocks.
pub type PairI32<'c> = PairMonitor<'c, i32, Iae, 8>;
/// All indices and three channels, 8 blocks.
pub type AllF32<'c> = FullMonitor<'c, f32, 8>;
/// All indices and three channels in counts, 4 blocks.
pub type AllI32<'c> = FullMonitor<'c, i32, 4>;

/// One CUSUM, as in the paper.
pub const CUSUM: Detectors = Detectors { cusum: Some(Cusum::new(0.5, 5.07)), ..Detectors::NONE };
/// All three detectors.
pub const DETECTORS: Detectors = Detectors {
    shewhart: Some(Shewhart::symmetric(4.0)),
    cusum: Some(Cusum::new(0.5, 5.07)),
    sprt: Some(Sprt::mean(1.0, -4.6, 6.9)),
};

const fn pair<N>(block_ticks: u32, blocks: u16, baseline: Baseline) -> Config<N, 1> {
    let channel = Channel { kind: ChannelKind::EnergyError(Index::Iae), baseline, detectors: CUSUM };
    Config::new(0.001, block_ticks, blocks, [channel])
}

const fn all<N>(block_ticks: u32, blocks: u16, baselines: [Baseline; 3]) -> Config<N, 3> {
    let [a, b, c] = baselines;
    Config::new(
        0.001,
        block_ticks,
        blocks,
        [
            Channel { kind: ChannelKind::EnergyError(Index::Iae), baseline: a, detectors: DETECTORS },
            Channel { kind: ChannelKind::Effort, baseline: b, detectors: DETECTORS },
            Channel { kind: ChannelKind::Activity, baseline: c, detectors: DETECTORS },
        ],
    )
}

const fn learnt(b0: f32, b1: f32, sigma: f32, x_mean: f32, x_ss: f32) -> Baseline {
    Baseline { windows: 200.0, x_mean, x_ss, ..Baseline::known(b0, b1, sigma) }
}

/// 16 blocks of 125 ticks: a window of 2 s at 1 kHz.
pub static PAIR_F32: Config<f32, 1> = pair(125, 16, learnt(0.11, 0.001, 0.01, 2.0, 5.0));
/// 8 blocks of 250 ticks; 1 count is 1/4096 of the range.
pub static PAIR_I32: Config<i32, 1> =
    pair(250, 8, learnt(0.11, 0.001, 0.01, 2.0, 5.0)).with_units(1.0 / 4096.0, 1.0 / 4096.0);
const ALL: [Baseline; 3] =
    [learnt(0.11, 0.001, 0.01, 2.0, 5.0), learnt(0.0, 1.0, 0.05, 1.0, 9.0), learnt(2.0, 0.1, 0.1, 0.5, 3.0)];
/// 8 blocks of 250 ticks.
pub static ALL_F32: Config<f32, 3> = all(250, 8, ALL);
/// 4 blocks of 500 ticks.
pub static ALL_I32: Config<i32, 3> = all(500, 4, ALL).with_units(1.0 / 4096.0, 1.0 / 4096.0);
