//! Section 6.3: the paper's channel under Shewhart, CUSUM and SPRT, by [`drift_core::Monitor`] itself, on runs of
//! 100 s in which the drift reaches mu_max at the end. The monitored run has the baseline run's reference, as in the
//! paper, whose runs differ in the drift alone: what the detectors see is then the drift and the baseline's own residuals.

use crate::cores::AcrossCores as _;
use drift_core::{
    Cusum, CusumState, Detector, DetectorState, Detectors, FaultCurve, Index, Shewhart, Sprt, SprtState,
    Verdict,
};

use super::baseline::healthy_windows;
use super::line;
use super::settings::{
    CUSUM_H, CUSUM_K, DETECTION_CASES, LONG_RUN_S, SAMPLE_TIME_S, SHEWHART_LIMIT, SPRT_ERROR, SPRT_SHIFT,
    Settings, Use,
};
use super::spread::Spread;
use super::windows::{Drift, Sees, Stream, config, energy_error, pair, windows_in};
use crate::Result;
use crate::calibrate::regression::Fit;

/// One window under the detectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged {
    /// End of the window, s.
    pub t: f64,
    /// E_u.
    pub x: f64,
    /// J_e.
    pub value: f64,
    /// The residual in standard deviations of prediction.
    pub z: f64,
    /// Outside the 95 % prediction band.
    pub outside: bool,
    /// What the CUSUM reached, before any restart.
    pub cusum: CusumState,
    /// What the SPRT reached, before any restart.
    pub sprt: SprtState,
    /// Alarms of CUSUM and SPRT.
    pub alarmed: (bool, bool),
}

/// A monitored run.
#[derive(Debug, Clone, PartialEq)]
pub struct MonitoredRun {
    /// The run's mu_max.
    pub mu_max: f64,
    /// The run's sigma_growth.
    pub sigma_growth: f64,
    /// Window by window.
    pub judged: Vec<Judged>,
    /// The line through all its windows, the paper's non-nominal line.
    pub fault: Fit,
    /// What the monitor said last.
    pub verdict: Verdict,
    /// The curve on the windows since its alarm, if it called the deviation drift.
    pub fault_curve: Option<FaultCurve>,
}

impl MonitoredRun {
    /// Share of windows outside the 95 % prediction band, per cent.
    pub fn outside_pct(&self) -> f64 {
        100.0 * self.judged.iter().filter(|j| j.outside).count() as f64 / self.judged.len() as f64
    }

    /// First alarm of the CUSUM, s.
    pub fn cusum_s(&self) -> Option<f64> {
        self.judged.iter().find(|j| j.alarmed.0).map(|j| j.t)
    }

    /// First alarm of the SPRT, s.
    pub fn sprt_s(&self) -> Option<f64> {
        self.judged.iter().find(|j| j.alarmed.1).map(|j| j.t)
    }
}

/// One case of section 6.3.
#[derive(Debug, Clone, PartialEq)]
pub struct DetectionCase {
    /// With the seed asked for: the run of the figures.
    pub run: MonitoredRun,
    /// Share of windows outside the prediction band over the repeats, per cent.
    pub outside_pct: Spread,
    /// First alarms of the CUSUM over the repeats in which it alarmed, s.
    pub cusum_s: Spread,
    /// First alarms of the SPRT over the repeats in which it alarmed, s.
    pub sprt_s: Spread,
    /// Intercept through all the run's windows less the baseline's, over the repeats.
    pub b0_shift: Spread,
    /// Slope over the baseline's, over the repeats.
    pub b1_ratio: Spread,
}

/// The SPRT's boundary (Wald): ln((1 - beta)/alpha), and its negative.
pub fn sprt_boundary() -> f64 {
    libm::log((1.0 - SPRT_ERROR) / SPRT_ERROR)
}

pub(super) const fn cusum() -> Cusum {
    Cusum::new(CUSUM_K as f32, CUSUM_H as f32)
}

pub(super) fn sprt() -> Sprt {
    let boundary = sprt_boundary() as f32;
    Sprt::mean(SPRT_SHIFT as f32, -boundary, boundary)
}

fn detectors() -> Detectors {
    let shewhart = Some(Shewhart::symmetric(SHEWHART_LIMIT as f32));
    Detectors { shewhart, cusum: Some(cusum()), sprt: Some(sprt()), ewma: None }
}

/// A run of 100 s under the monitor with this baseline.
pub(super) fn monitored(line: &Fit, mu_max: f64, sigma_growth: f64, seed: u64) -> Result<MonitoredRun> {
    let configuration = config(pair(Index::Iae, line::baseline(line), detectors()));
    let drift = Drift::over(mu_max, sigma_growth, LONG_RUN_S);
    let mut stream = Stream::new(&configuration, &drift, seed, Sees::Measured)?;
    let (cusum, sprt) = (cusum(), sprt());
    let mut before = (cusum.start(), SprtState::ZERO);
    let (mut verdict, mut fault_curve) = (Verdict::Healthy, None);
    let mut judged = Vec::new();
    for _ in 0..windows_in((LONG_RUN_S / SAMPLE_TIME_S).round() as u64) {
        let (t, report) = stream.next_report();
        let [channel] = report.channels;
        let (alarms, z) = (channel.alarms, channel.z);
        judged.push(Judged {
            t,
            x: f64::from(channel.x),
            value: f64::from(channel.value),
            z: f64::from(z),
            outside: outside(line, f64::from(channel.x), f64::from(channel.value)),
            cusum: reached(&cusum, before.0, z),
            sprt: ratio_reached(&sprt, before.1, z),
            alarmed: (alarms.cusum.is_some(), alarms.sprt.is_some()),
        });
        before = (channel.detectors.cusum, channel.detectors.sprt);
        verdict = report.verdict;
        fault_curve = channel.fault_curve;
    }
    let points: Vec<_> = judged.iter().map(|j| (j.x, j.value)).collect();
    Ok(MonitoredRun { mu_max, sigma_growth, fault: line::fit(&points)?, judged, verdict, fault_curve })
}

/// Outside the 95 % prediction band.
fn outside(line: &Fit, x: f64, value: f64) -> bool {
    let [low, high] = line.prediction_band(x);
    value < low || value > high
}

/// The CUSUM's sums as they stand before the restart that follows an alarm: for the eye.
fn reached(cusum: &Cusum, before: CusumState, z: f32) -> CusumState {
    CusumState { high: (before.high + z - cusum.k).max(0.0), low: (before.low - z - cusum.k).max(0.0) }
}

/// The SPRT's ratios in the same way.
fn ratio_reached(sprt: &Sprt, before: SprtState, z: f32) -> SprtState {
    let even = sprt.constant + sprt.quadratic * z * z;
    SprtState { high: before.high + even + sprt.linear * z, low: before.low + even - sprt.linear * z }
}

pub(super) fn detection(settings: &Settings) -> Result<Vec<DetectionCase>> {
    DETECTION_CASES
        .iter()
        .map(|(mu_max, sigma_growth)| {
            let runs = (0..settings.repeats)
                .into_par_iter()
                .map(|i| {
                    let seed = settings.seed_of(Use::Repeat, i);
                    let line = line::fit(&energy_error(&healthy_windows(seed)?, Index::Iae))?;
                    let run = monitored(&line, *mu_max, *sigma_growth, seed)?;
                    Ok((line, run))
                })
                .collect::<Result<Vec<_>>>()?;
            case(runs)
        })
        .collect()
}

fn case(runs: Vec<(Fit, MonitoredRun)>) -> Result<DetectionCase> {
    let over = |of: &dyn Fn(&(Fit, MonitoredRun)) -> Option<f64>| {
        Spread::of(&runs.iter().filter_map(of).collect::<Vec<_>>())
    };
    let outside_pct = over(&|(_, run)| Some(run.outside_pct()));
    let cusum_s = over(&|(_, run)| run.cusum_s());
    let sprt_s = over(&|(_, run)| run.sprt_s());
    let b0_shift = over(&|(line, run)| Some(run.fault.b0 - line.b0));
    let b1_ratio = over(&|(line, run)| Some(run.fault.b1 / line.b1));
    let first = runs.into_iter().next().map(|(_, run)| run);
    let run = first.ok_or_else(|| crate::Error::new("no repeats").allowed("at least 1"))?;
    Ok(DetectionCase { run, outside_pct, cusum_s, sprt_s, b0_shift, b1_ratio })
}
