//! The indices against a direct sum in f64, over 1e8 ticks of noise with rare transients of a hundred times its
//! size: the case that ruins sums from which old samples are subtracted.

use drift_core::{Channel, ChannelKind, Config, FullMonitor, Index, Indices};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

const TICK_S: f32 = 0.001;
const NAMES: [&str; 13] = [
    "e_u",
    "iae",
    "ise",
    "itae",
    "itse",
    "mean_u",
    "mean_y",
    "mean_e",
    "peak_u",
    "peak_e",
    "reference_activity",
    "motion_effort",
    "speed",
];

fn channels() -> [Channel; 3] {
    [ChannelKind::EnergyError(Index::Iae), ChannelKind::Effort, ChannelKind::Activity].map(Channel::unlearned)
}

/// A window's indices summed straight in f64, and the magnitudes that the signed means are compared with.
#[derive(Default, Clone)]
struct Direct {
    sums: [f64; 13],
    magnitudes: [f64; 13],
    ticks: u32,
    before: Option<(f32, f32)>,
}

impl Direct {
    fn add(&mut self, r: f32, y: f32, u: f32) {
        let (r_before, y_before) = self.before.replace((r, y)).unwrap_or((r, y));
        let [r, y, u, r_before, y_before] = [r, y, u, r_before, y_before].map(f64::from);
        let (e, dr, dy, t) = (r - y, r - r_before, y - y_before, f64::from(self.ticks));
        let along = if dy == 0.0 { 0.0 } else { u * dy.signum() };
        let terms =
            [u * u, e.abs(), e * e, t * e.abs(), t * e * e, u, y, e, 0.0, 0.0, dr * dr, along, dy.abs()];
        for (i, term) in terms.into_iter().enumerate() {
            self.sums[i] += term;
            self.magnitudes[i] += term.abs();
        }
        self.sums[8] = self.sums[8].max(u.abs());
        self.sums[9] = self.sums[9].max(e.abs());
        self.magnitudes[8] = self.sums[8];
        self.magnitudes[9] = self.sums[9];
        self.ticks += 1;
    }

    /// Worst distance of each index from the direct one, relative to its magnitude.
    fn errors(&self, got: &Indices) -> [f64; 13] {
        let (s, n) = (f64::from(TICK_S), f64::from(self.ticks));
        let unit = [s, s, s, s * s, s * s, 1.0 / n, 1.0 / n, 1.0 / n, 1.0, 1.0, 1.0, 1.0 / n, 1.0 / (n * s)];
        let got = [
            got.e_u,
            got.iae,
            got.ise,
            got.itae,
            got.itse,
            got.mean_u,
            got.mean_y,
            got.mean_e,
            got.peak_u,
            got.peak_e,
            got.reference_activity,
            got.motion_effort,
            got.speed,
        ];
        std::array::from_fn(|i| {
            (f64::from(got[i]) - self.sums[i] * unit[i]).abs() / (self.magnitudes[i] * unit[i])
        })
    }
}

/// Worst relative error of each index among all windows of `ticks` ticks, every window compared.
fn worst(block_ticks: u32, blocks: u16, ticks: u64, seed: u64) -> [f64; 13] {
    let config = Config::new(TICK_S, block_ticks, blocks, channels());
    let mut monitor = FullMonitor::<f32, 16>::new(config).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut direct = Direct::default();
    let mut worst = [0.0f64; 13];
    let mut first = true;
    for tick in 0..ticks {
        let noise: f32 = StandardNormal.sample(&mut rng);
        // Once in some windows a transient of 100 sigma, three ticks long.
        let scale = if tick % 9_973 < 3 { 100.0 } else { 1.0 };
        let r = 0.1 * ((tick / 500) % 7) as f32;
        let (y, u) = (r + scale * noise, 0.3 + scale * (0.7 * noise + 0.2));
        direct.add(r, y, u);
        if let Some(report) = monitor.tick(r, y, u) {
            // The very first tick has no predecessor: its differences are filled in, not summed.
            if !first {
                for (worst, error) in worst.iter_mut().zip(direct.errors(&report.indices)) {
                    *worst = worst.max(error);
                }
            }
            first = false;
            direct = Direct { before: direct.before, ..Direct::default() };
        }
    }
    worst
}

fn assert_within(limit: f64, case: &str, worst: &[f64; 13]) {
    for (name, worst) in NAMES.iter().zip(worst) {
        println!("{case}: {name:20} {worst:.2e}");
        assert!(*worst < limit, "{case}: {name} is off by {worst:.2e}");
    }
}

#[test]
fn every_index_is_within_1e_6_of_a_direct_sum() {
    for (block_ticks, blocks) in [(64, 16), (250, 12), (1, 16), (7, 3)] {
        assert_within(1e-6, &format!("{block_ticks} x {blocks}"), &worst(block_ticks, blocks, 200_000, 1));
    }
}

/// A constant rounds the same way at every addition: the hardest case for a long block. Many constants, for each
/// rounds in its own way.
#[test]
fn a_constant_signal_in_blocks_of_any_length_is_within_1e_6() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for (block_ticks, blocks, constants) in [
        (33, 16, 60),
        (64, 16, 60),
        (125, 16, 60),
        (250, 12, 60),
        (1000, 8, 60),
        (10_000, 2, 12),
        (65_535, 2, 4),
    ] {
        let config = Config::new(TICK_S, block_ticks, blocks, channels());
        let mut most = [0.0f64; 13];
        for _ in 0..constants {
            let [r, y, u]: [f32; 3] = [(); 3].map(|()| StandardNormal.sample(&mut rng));
            let mut monitor = FullMonitor::<f32, 16>::new(config).unwrap();
            let mut direct = Direct::default();
            for _ in 0..block_ticks * u32::from(blocks) {
                direct.add(r, y, u);
                if let Some(report) = monitor.tick(r, y, u) {
                    let worst = direct.errors(&report.indices);
                    // No motion and no steps: 0 of 0.
                    most.iter_mut().zip(worst).take(10).for_each(|(most, worst)| *most = most.max(worst));
                }
            }
        }
        assert_within(1e-6, &format!("constant, {block_ticks} x {blocks}"), &most);
    }
}

#[test]
#[ignore = "slow: 1e8 ticks, three times"]
fn after_1e8_ticks_every_index_is_still_within_1e_6() {
    let cases: Vec<_> = [(64, 16, 11), (250, 12, 12), (3000, 12, 13)]
        .into_par_iter()
        .map(|(block_ticks, blocks, seed)| {
            (format!("1e8 ticks, {block_ticks} x {blocks}"), worst(block_ticks, blocks, 100_000_000, seed))
        })
        .collect();
    for (case, worst) in &cases {
        assert_within(1e-6, case, worst);
    }
}

/// Counts: window sums stay below 2^24 here, so that even their f32 image must be the exact integer.
#[test]
fn counts_are_summed_exactly() {
    let mut config = Config::new(1.0, 16, 4, channels());
    config.sample_time_s = 1.0;
    let mut monitor = FullMonitor::<i32, 4>::new(config).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut count = || {
        let z: f32 = StandardNormal.sample(&mut rng);
        (20.0 * z) as i32
    };
    let mut sums = [0i128; 5];
    let mut tick = 0i128;
    let mut windows = 0;
    for _ in 0..64 * 500 {
        let (r, y, u) = (count(), count(), count());
        let (e, u2) = (i128::from(r - y), i128::from(u) * i128::from(u));
        for (sum, term) in sums.iter_mut().zip([u2, e.abs(), e * e, tick * e.abs(), tick * e * e]) {
            *sum += term;
        }
        tick += 1;
        if let Some(report) = monitor.tick(r, y, u) {
            let i = report.indices;
            let got = [i.e_u, i.iae, i.ise, i.itae, i.itse].map(|x| x as i128);
            assert!(sums.iter().all(|&s| s < 1 << 24), "{sums:?}");
            assert_eq!(got, sums);
            sums = [0; 5];
            tick = 0;
            windows += 1;
        }
    }
    assert_eq!(windows, 500);
}
