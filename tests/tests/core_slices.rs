//! It does not matter how the samples are handed over: one at a time, or in slices of any length.

use crate::core_samples::{channels, noise, repeatable, text, watched};
use drift_core::{
    Channel, ChannelKind, Config, Everything, Full, FullMonitor, Iae, Index, IndexSet, Itse, Monitor, Pair,
    PairMonitor,
};
use proptest::prelude::*;

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
    #![proptest_config(repeatable())]
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
}
