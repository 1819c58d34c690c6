//! What the paper states of its simulations, and what it leaves open and is chosen here.

/// Sample time, s (stated).
pub const SAMPLE_TIME_S: f64 = 0.001;
/// Length of the runs that show signals and indices, s (stated): Figures 4 to 7, Table 1.
pub const SHORT_RUN_S: f64 = 10.0;
/// Length of the runs behind the baseline and the detectors, s (stated): section 6.
pub const LONG_RUN_S: f64 = 100.0;
/// Ticks that a level of the reference is held (stated: 50 sample times).
pub const HOLD_TICKS: u64 = 50;
/// Mean of the reference's levels (stated).
pub const REFERENCE_MEAN: f64 = 0.1;
/// Standard deviation of the reference's levels: N(0.1, 1) as stated, read as mean and standard deviation.
pub const REFERENCE_SD: f64 = 1.0;

/// Proportional gain (stated); the integral one is 100.
pub const KP: f64 = 300.0;
/// Another, with which the published baseline is compatible.
pub const OTHER_KP: f64 = 200.0;

/// Ticks per block of the monitor's window.
pub const BLOCK_TICKS: u32 = 250;
/// Blocks per window: 3 s. Open in the paper; the ratio of its ITAE to its IAE in Table 1 implies about 3.2 s.
pub const WINDOW_BLOCKS: u16 = 12;
/// Blocks from one window to the next: 0.5 s. Open in the paper; its adjusted R^2 implies 190 to 198 windows in
/// 100 s, and 3 s every 0.5 s makes 195.
pub const HOP_BLOCKS: u16 = 2;
/// Length of a window, s.
pub const WINDOW_S: f64 = BLOCK_TICKS as f64 * WINDOW_BLOCKS as f64 * SAMPLE_TIME_S;
/// From one window to the next, s.
pub const HOP_S: f64 = BLOCK_TICKS as f64 * HOP_BLOCKS as f64 * SAMPLE_TIME_S;
/// Hops from one window to the next that doesn't overlap it.
pub const HOPS_PER_WINDOW: usize = (WINDOW_BLOCKS / HOP_BLOCKS) as usize;

/// Allowance of the CUSUM, sigmas (open; the textbook's for a shift of one sigma).
pub const CUSUM_K: f64 = 0.5;
/// Threshold of the CUSUM, sigmas (open; the textbook's).
pub const CUSUM_H: f64 = 5.0;
/// Limit of the Shewhart chart, sigmas (open; the textbook's).
pub const SHEWHART_LIMIT: f64 = 3.0;
/// Shift that the SPRT tests for, sigmas (open).
pub const SPRT_SHIFT: f64 = 1.0;
/// Error probabilities of the SPRT, both (open).
pub const SPRT_ERROR: f64 = 0.05;
/// Confidence of intervals and bands (stated).
pub const CONFIDENCE: f64 = 0.95;
/// Span of the centred rolling mean that the figures call filtered, s (open).
pub const FILTER_S: f64 = 0.5;

/// Levels of mu_max behind Table 1 and Figure 5a (open; the figures show 1, 3, 4 and 10).
pub const MU_LEVELS: [f64; 5] = [0.0, 1.0, 3.0, 4.0, 10.0];
/// Levels of mu_max up to the greatest that the published delta_mu are compatible with.
pub const MU_LEVELS_TO_6: [f64; 5] = [0.0, 1.0, 3.0, 4.0, 6.0];
/// Levels of sigma_growth behind Table 1 and Figure 5b (open; Figure 3 shows 1 and 10).
pub const SIGMA_LEVELS: [f64; 4] = [0.0, 1.0, 3.0, 10.0];

/// (mu_max, sigma_growth) of the runs that the detectors are shown on.
pub const DETECTION_CASES: [(f64, f64); 4] = [(0.0, 0.0), (1.0, 0.0), (3.0, 0.0), (10.0, 0.0)];
/// mu_max of the delay table; the ramp takes [`LONG_RUN_S`] to get there. 0: false alarms.
pub const DELAY_MU: [f64; 5] = [0.0, 0.3, 1.0, 3.0, 10.0];
/// Onset of the ramp in the delay runs, s: after the loop has settled, and half a window into a window, so that no
/// scheme profits from how its windows lie.
pub const DELAY_ONSET_S: f64 = 31.5;
/// How long a delay run is watched from the onset, s; a run that has not alarmed by then counts as this long.
pub const DELAY_CAP_S: f64 = 1000.0;
/// Mean time between false alarms that every scheme of the delay table is set to, s.
pub const FALSE_ALARM_EVERY_S: f64 = 2000.0;

/// What can be chosen: the seed, and how many runs the statistics rest on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Everything random follows from it.
    pub seed: u64,
    /// Runs behind the ranges of the baseline and of the detection times.
    pub repeats: u64,
    /// Healthy runs of 100 s behind the false-alarm rates of the overlap study.
    pub healthy_runs: u64,
    /// Healthy streams that thresholds are set on; as many again verify them.
    pub streams: u64,
    /// Length of a stream, s.
    pub stream_s: u64,
    /// Runs for each mu_max of the delay table.
    pub delay_runs: u64,
}

/// Uses of seeds: no two draw the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Use {
    Repeat,
    Healthy,
    Calibration,
    Verification,
    Delay,
    Recording,
}

impl Settings {
    /// As published here.
    pub fn new(seed: u64) -> Self {
        Self { seed, repeats: 20, healthy_runs: 400, streams: 250, stream_s: 2000, delay_runs: 200 }
    }

    /// The i-th seed for a use. The seed itself is that of the paper's own figures.
    pub(super) fn seed_of(&self, what: Use, i: u64) -> u64 {
        const APART: u64 = 1_000_000;
        let block = match what {
            Use::Repeat => 0,
            Use::Healthy => 1,
            Use::Calibration => 2,
            Use::Verification => 3,
            Use::Delay => 4,
            Use::Recording => 5,
        };
        self.seed.wrapping_add(block * APART).wrapping_add(i)
    }

    /// Steps of progress that a whole reproduction reports.
    pub fn steps(&self) -> u64 {
        self.repeats
            + self.healthy_runs
            + 2 * self.streams
            + self.delay_runs * (2 * DELAY_MU.len() as u64 - 1)
    }
}
