//! What the firmware and the host share, so that both compute the same: the PI loop, the monitors' plans, what can
//! happen to a loop, a report as words. `no_std`, plain IEEE arithmetic only.
#![no_std]

pub mod events;
pub mod pi;
pub mod plant;
pub mod words;

use drift_core::{
    AllDetectors, Baseline, Channel, ChannelKind, Config, ConfigError, Cusum, Decision, Detectors,
    Everything, Ewma, Forgetful, Full, Iae, Index, Itae, Memory, Never, Options, Pair, Paper, Plan, Refitted,
    Remembering, ReportOf, Shewhart, Smallest, Sprt, State, TotalExcluded, Tumbling,
};

/// One CUSUM, as in the paper.
pub const CUSUM: Detectors = Detectors { cusum: Some(Cusum::new(0.5, 5.07)), ..Detectors::NONE };
/// All four detectors.
pub const DETECTORS: Detectors = Detectors {
    shewhart: Some(Shewhart::symmetric(4.0)),
    cusum: Some(Cusum::new(0.5, 5.07)),
    sprt: Some(Sprt::mean(1.0, -4.6, 6.9)),
    ewma: Some(Ewma::new(0.1, 0.7)),
};

/// All detectors and the curve on windows that follow one another, gaps made up.
#[derive(Debug, Clone, Copy)]
pub struct Watching;

impl Options for Watching {
    type Window = Tumbling;
    type Detectors = AllDetectors;
    type Curve = Refitted;
    type Blanking = Never;
    type Excluded = TotalExcluded;
    type Memory = Forgetful;
    const GAPS: bool = true;
    const PREDICTION: bool = true;
}

/// The same, and each channel remembers the last windows.
#[derive(Debug, Clone, Copy)]
pub struct WatchingBack;

impl Options for WatchingBack {
    type Window = Tumbling;
    type Detectors = AllDetectors;
    type Curve = Refitted;
    type Blanking = Never;
    type Excluded = TotalExcluded;
    type Memory = Remembering;
    const GAPS: bool = true;
    const PREDICTION: bool = true;
}

const fn pair<N>(
    block_ticks: u32,
    blocks: u16,
    index: Index,
    baseline: Baseline,
    detectors: Detectors,
) -> Config<N, 1> {
    Config::new(
        0.001,
        block_ticks,
        blocks,
        [Channel::new(ChannelKind::EnergyError(index), baseline, detectors)],
    )
}

const fn all<N>(block_ticks: u32, blocks: u16) -> Config<N, 3> {
    let channels = [
        Channel::new(ChannelKind::EnergyError(Index::Iae), PAIR_BASELINE, DETECTORS),
        Channel::new(ChannelKind::Effort, learnt(0.2, 1.0, 0.05, 1.0, 9.0), DETECTORS),
        Channel::new(ChannelKind::Activity, learnt(3.55, 0.0, 0.2, 0.5, 3.0), DETECTORS),
    ];
    Config::new(0.001, block_ticks, blocks, channels)
}

/// A third order on the effort channel.
const fn remembering<N: Copy>(mut config: Config<N, 3>) -> Config<N, 3> {
    let [_, effort, _] = &mut config.channels;
    effort.memory = Memory { order: 3, x: [-0.2, 0.05, 0.01], value: [0.3, -0.1, 0.05] };
    effort.baseline.b0 = 0.15;
    effort.baseline.b1 = 0.95;
    config
}

const fn learnt(b0: f32, b1: f32, sigma: f32, x_mean: f32, x_ss: f32) -> Baseline {
    Baseline { windows: 200.0, x_mean, x_ss, ..Baseline::known(b0, b1, sigma) }
}

/// What the healthy stretches of [`events`] show.
const PAIR_BASELINE: Baseline = learnt(0.0965, 0.001, 0.01, 2.0, 5.0);
const UNIT: f32 = 1.0 / 4096.0;

macro_rules! plans {
    ($($(#[$doc:meta])* $name:ident, $state:ident, $report:ident: $number:ty, $set:ty, $options:ty, $channels:literal = $config:expr;)*) => {
        $($(#[$doc])*
        pub static $name: Plan<$number, $set, $options, $channels> =
            checked(Plan::<$number, $set, $options, $channels>::new($config));
        #[doc = concat!("What [`", stringify!($name), "`] remembers.")]
        pub type $state = State<$number, $set, $options, $channels>;
        #[doc = concat!("What [`", stringify!($name), "`] reports.")]
        pub type $report = ReportOf<$number, $set, $options, $channels>;)*
    };
}

/// In a `const`: an impossible configuration does not compile.
const fn checked<T: Copy>(plan: Result<T, ConfigError>) -> T {
    match plan {
        Ok(plan) => plan,
        Err(_) => panic!("an impossible configuration"),
    }
}

plans! {
    /// The smallest useful: one CUSUM on a known relation; 16 blocks of 125 ticks, a window of 2 s at 1 kHz.
    SMALLEST_F32, SmallestF32, SmallestReport: f32, Pair<Iae>, Smallest, 1 =
        pair(125, 16, Index::Iae, Baseline::known(0.0965, 0.001, 0.01), CUSUM);
    /// The paper's pair, 16 blocks.
    PAIR_F32, PairF32, PairReport: f32, Pair<Iae>, Paper, 1 = pair(125, 16, Index::Iae, PAIR_BASELINE, CUSUM);
    /// The paper's pair in counts, 8 blocks of 250 ticks; 1 count is 1/4096 of the range.
    PAIR_I32, PairI32, PairReportI32: i32, Pair<Iae>, Paper, 1 =
        pair(250, 8, Index::Iae, PAIR_BASELINE, CUSUM).with_units(UNIT, UNIT);
    /// All indices, three channels, four detectors, 8 blocks.
    ALL_F32, AllF32, AllReport: f32, Full, Watching, 3 = all(250, 8);
    /// The same with a memory of three windows.
    BACK_F32, BackF32, BackReport: f32, Full, WatchingBack, 3 = remembering(all(250, 8));
    /// All indices in counts, 4 blocks of 500 ticks.
    ALL_I32, AllI32, AllReportI32: i32, Full, Watching, 3 = all(500, 4).with_units(UNIT, UNIT);
    /// All that there is: windows that overlap, limits, blanking.
    EVERYTHING_F32, EverythingF32, EverythingReport: f32, Full, Everything<8>, 3 =
        remembering(all(250, 8)).with_hop(4).with_saturation(-9.0, 9.0).with_blanking(0.5, 40);
    /// Overlapping windows of ITAE with limits.
    ITAE_F32, ItaeF32, ItaeReport: f32, Pair<Itae>, Everything<8>, 1 =
        pair(125, 8, Index::Itae, learnt(0.05, 0.0, 0.005, 2.0, 5.0), DETECTORS)
            .with_hop(3).with_saturation(-9.0, 9.0).with_decision(Decision { confirm_hops: 8, ..Decision::DEFAULT });
    /// The same in counts.
    ITAE_I32, ItaeI32, ItaeReportI32: i32, Pair<Itae>, Everything<8>, 1 =
        pair(125, 8, Index::Itae, learnt(0.05, 0.0, 0.005, 2.0, 5.0), DETECTORS)
            .with_hop(3).with_units(UNIT, UNIT).with_blanking(2000, 40);
}
