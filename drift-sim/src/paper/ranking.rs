//! Table 1: which error index follows mu_max and ignores sigma_growth, on a grid of both, and Figure 5's sweeps.
//!
//! For each index and each cell of the grid: the mean over the windows of one 10 s run, all with the same reference.
//! delta_mu is the range over mu_max at one sigma_growth, averaged over the levels of sigma_growth; delta_sigma the
//! reverse.

use crate::cores::AcrossCores as _;
use drift_core::{Baseline, Detectors, Index};

use super::settings::{MU_LEVELS, MU_LEVELS_TO_6, SHORT_RUN_S, SIGMA_LEVELS};
use super::windows::{Drift, Sees, Stream, Window, config, pair};
use crate::Result;

/// The indices in the order of Table 1.
pub(super) const INDICES: [Index; 4] = [Index::Iae, Index::Itae, Index::Itse, Index::Ise];

/// What sigma_growth may mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// In words.
    pub says: &'static str,
    /// Standard deviation of the noise at the end of the run, for sigma_growth = 1.
    pub sigma_end_per_growth: f64,
    /// The grid's levels of mu_max.
    pub mu_levels: [f64; 5],
    /// Whether e is formed before the fault is added.
    pub(super) sees: Sees,
}

/// The reading that Table 1 and Figure 5 use here: the one that is compatible with the published delta_sigma.
pub const READING: Reading = Reading {
    says: "standard deviation sigma_growth/1000 at the end (a growth per sample time of 1 ms), white at 1 kHz",
    sigma_end_per_growth: 1e-3,
    mu_levels: MU_LEVELS,
    sees: Sees::Measured,
};

/// The others that were tried.
pub const OTHER_READINGS: [Reading; 4] = [
    Reading { says: "the one used, but mu_max up to 6 instead of 10", mu_levels: MU_LEVELS_TO_6, ..READING },
    Reading {
        says: "standard deviation sigma_growth at the end, white at 1 kHz: the formula in Figure 3's caption as it stands",
        sigma_end_per_growth: 1.0,
        ..READING
    },
    Reading {
        says: "the same, e formed from y before the fault is added",
        sigma_end_per_growth: 1.0,
        sees: Sees::True,
        ..READING
    },
    Reading {
        says: "standard deviation sigma_growth/100 at the end (per cent), white at 1 kHz",
        sigma_end_per_growth: 1e-2,
        ..READING
    },
];

/// One line of Table 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rank {
    /// Which index.
    pub index: Index,
    /// Mean range over mu_max.
    pub delta_mu: f64,
    /// Mean range over sigma_growth.
    pub delta_sigma: f64,
}

impl Rank {
    /// The score of the paper's Table 1: shift of the mean over growth of the deviation.
    pub fn ratio(&self) -> f64 {
        self.delta_mu / self.delta_sigma
    }
}

/// Table 1 under one reading, best first.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranking {
    /// What sigma_growth was taken for.
    pub reading: Reading,
    /// The lines.
    pub ranks: Vec<Rank>,
}

/// The windows of a 10 s run with this cell's fault.
pub(super) fn cell(mu_max: f64, sigma_growth: f64, reading: &Reading, seed: u64) -> Result<Vec<Window>> {
    let drift = Drift::over(mu_max, sigma_growth * reading.sigma_end_per_growth, SHORT_RUN_S);
    let learning = config(pair(Index::Iae, Baseline::UNLEARNED, Detectors::NONE));
    Ok(Stream::new(&learning, &drift, seed, reading.sees)?.windows_within(SHORT_RUN_S))
}

pub(super) fn ranking(reading: &Reading, seed: u64) -> Result<Ranking> {
    let cells: Vec<(f64, f64)> =
        reading.mu_levels.iter().flat_map(|mu| SIGMA_LEVELS.iter().map(move |sigma| (*mu, *sigma))).collect();
    let runs = cells
        .into_par_iter()
        .map(|(mu, sigma)| cell(mu, sigma, reading, seed))
        .collect::<Result<Vec<_>>>()?;
    let mut ranks: Vec<Rank> = INDICES.iter().map(|index| rank(*index, &runs)).collect();
    ranks.sort_by(|a, b| b.ratio().total_cmp(&a.ratio()));
    Ok(Ranking { reading: *reading, ranks })
}

/// `runs` row by row: one row a level of mu_max.
fn rank(index: Index, runs: &[Vec<Window>]) -> Rank {
    let means: Vec<f64> = runs.iter().map(|windows| mean(windows, index)).collect();
    let rows: Vec<&[f64]> = means.chunks(SIGMA_LEVELS.len()).collect();
    let over_sigma = rows.iter().map(|row| range(row.iter().copied()));
    let column = |j: usize| rows.iter().filter_map(move |row| row.get(j).copied());
    let over_mu = (0..SIGMA_LEVELS.len()).map(|j| range(column(j)));
    Rank {
        index,
        delta_mu: over_mu.sum::<f64>() / SIGMA_LEVELS.len() as f64,
        delta_sigma: over_sigma.sum::<f64>() / rows.len() as f64,
    }
}

fn mean(windows: &[Window], index: Index) -> f64 {
    windows.iter().map(|w| f64::from(w.indices.error_index(index))).sum::<f64>() / windows.len() as f64
}

fn range(values: impl Iterator<Item = f64> + Clone) -> f64 {
    values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
}
