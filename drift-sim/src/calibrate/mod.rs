//! Calibration: from healthy recordings to a baseline, its uncertainty, and thresholds for a wanted time between false
//! alarms of the whole monitor.
//!
//! 1. [`timing`]: window and hop. drift-core's own monitor turns the recordings into windows ([`WindowRow`]).
//! 2. `relation`: how far back the effort channel's relation reaches, and what a measured operating point adds. [`regression`]: each channel's line. [`autocorrelation`]: how many independent windows they are worth.
//! 3. The standardised residuals of all channels become one random process (skewed and heavy-tailed marginals, autoregressive,
//!    correlated channels); thresholds are simulated on it with the real detectors.
//! 4. `caution`: the thresholds are made for a loop that is worse than the one found by margins that fall with the number of windows, so
//!    that the wanted share of calibrations (the confidence) keeps the promise.
//!
//! Measured by `tests/calibration_promise.rs`, asked for one false alarm in N = 500 decisions at confidence 0.9, on seeds that nothing was
//! chosen on (mean of 20 calibrations with its standard error, their range; 120 calibrations with the binomial standard error):
//!
//! | loop | realised/N from 2000 windows | range | delay | kept from 200 windows | delay |
//! |---|---|---|---|---|---|
//! | paper's, 3 s windows | 1.40 +- 0.11 | 0.71 to 2.81 | +4 % | 96 +- 2 % | +101 % |
//! | servo | 1.19 +- 0.08 | 0.74 to 2.22 | +1.5 % | 93 +- 2 % | +32 % |
//! | flow | 1.28 +- 0.05 | 0.95 to 1.63 | +1.7 % | 120 of 120 | +31 % |
//! | speed, coarse sensor; nothing was chosen on it | 1.23 +- 0.05 | 0.86 to 1.68 | +1.7 % | 120 of 120 | +30 % |
//!
//! The promise from 2000 windows is one of the mean: a single calibration realises between 0.7 N and 2.8 N. From 200 windows
//! the caution is dear where the windows are correlated, and more than flow and speed need. N other than 500 and confidences other than 0.9
//! (the margins go with the normal quantile) were not measured.
//!
//! A recording that begins with a step of r has one wrong window: the activity knows nothing of a step before its first sample. On the
//! paper's loop that window lay 20 to 150 sigmas off and alone made thresholds useless; a warning names such windows.

pub mod autocorrelation;
mod caution;
mod delay;
pub(crate) mod detector;
mod marginal;
mod operating_point;
mod options;
mod page;
mod process;
mod promise;
pub mod regression;
mod relation;
mod run_length;
mod summary;
mod thresholds;
pub mod timing;
mod warnings;
mod windows;

use drift_core::{
    Baseline, Blanking, Channel, ChannelKind, Decision, Detectors, Memory, OperatingPoint, Saturation,
};

use crate::baseline_file::{BaselineFile, ChannelEntry, Promise, Provenance, Samples, Statistics, Timing};
use crate::recording::{Recording, RowState};
use crate::sentences::typed;
use crate::stage;
use crate::{Error, Result};
use autocorrelation::{autocovariances, effective_size, integrated_time, size_for_variance};
pub use detector::DetectorChoice;
pub use options::Options;
pub use promise::Cost;
use regression::Fit;
use relation::Relation;
pub use warnings::FEW_WINDOWS;
pub use windows::WindowRow;

/// What calibrating takes for each sample beside the recording, bytes: a million samples more were seen to take 34 MB more, the recording
/// with them.
pub const SAMPLE_WORK_BYTES: u64 = 50;

/// Fewer windows are refused: a standard deviation of so few means nothing. It is drift-core's own bound.
pub const LEAST_WINDOWS: usize = drift_core::Commissioning::<1>::LEAST_WINDOWS as usize;

/// The effort channel's place.
const EFFORT: usize = 1;

/// A healthy recording; slices of one length.
#[derive(Debug, Clone, Copy)]
pub struct Signals<'a> {
    /// What errors and the baseline file call it.
    pub name: &'a str,
    /// From one sample to the next, s.
    pub sample_time_s: f64,
    /// Reference, one value a sample, as long as `y` and `u`.
    pub r: &'a [f64],
    /// Measured output.
    pub y: &'a [f64],
    /// Controller output.
    pub u: &'a [f64],
    /// Which samples count; all of them if there is none.
    pub state: Option<&'a [RowState]>,
    /// Further columns by name, as long as `y`: those of the operating point are among them.
    pub further: &'a [(String, Vec<f64>)],
}

impl<'a> From<&'a Recording> for Signals<'a> {
    fn from(of: &'a Recording) -> Self {
        Self {
            name: &of.name,
            sample_time_s: of.sample_time_s,
            r: &of.r,
            y: &of.y,
            u: &of.u,
            state: Some(&of.state),
            further: &of.extra,
        }
    }
}

/// One channel's line and its residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelFit {
    /// Which index is compared with which.
    pub kind: ChannelKind,
    /// The line, in f64; of the value without what the windows before contribute.
    pub fit: Fit,
    /// What the windows before contribute.
    pub memory: Memory,
    /// What the measured operating point contributes.
    pub operating_point: OperatingPoint,
    /// The residuals' integrated autocorrelation time, windows; 1 if independent.
    pub integrated_time: f64,
    /// Independent windows that they are worth.
    pub n_effective: f64,
    /// The same for their variance.
    pub n_for_variance: f64,
    /// Correlation of neighbouring residuals.
    pub lag1: f64,
    /// Skewness of the residuals.
    pub skewness: f64,
    /// What watches it, with its thresholds.
    pub detectors: Detectors,
}

/// A finished calibration: the file to save and what it was learnt from.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// What is saved, and what a monitor runs on.
    pub file: BaselineFile,
    /// The judged channels' lines with their statistics.
    pub channels: Vec<ChannelFit>,
    /// The healthy windows with their indices, in the order of time.
    pub windows: Vec<WindowRow>,
    /// Windows left out for too few valid samples.
    pub invalid_windows: usize,
    /// How the window was chosen.
    pub timing: timing::Choice,
    /// What the caution costs.
    pub cost: Cost,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Calibrates on healthy recordings.
///
/// # Errors
/// Recordings of different sample times or without samples; options that are impossible; fewer than
/// [`LEAST_WINDOWS`] windows; a
/// channel without any scatter, or none whose x varies.
pub fn calibrate(recordings: &[Signals<'_>], options: &Options) -> Result<Calibration> {
    options.check()?;
    check_recordings(recordings)?;
    stage::begins("the windows", 0);
    let timing = timing::choose(recordings, options)?;
    let names = recordings.iter().map(|r| r.name.to_owned()).collect();
    let file = unlearned(names, options, timing.timing)?;
    let windows = windows::collect(recordings, &file, &options.operating_point)?;
    from_windows(windows, file, timing, options)
}

/// Calibrates on healthy windows that were collected elsewhere, by a monitor of this timing whose channels are
/// of the kinds that
/// `options` name. Windows follow each other where their recording is the same and their hop the next.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrate_windows(rows: Vec<WindowRow>, timing: Timing, options: &Options) -> Result<Calibration> {
    options.check()?;
    let file = unlearned(Vec::new(), options, timing)?;
    let timing = timing::Choice { timing, reason: None, correlation_s: f64::NAN };
    from_windows(windows::Windows::of(rows), file, timing, options)
}

fn from_windows(
    windows: windows::Windows,
    mut file: BaselineFile,
    timing: timing::Choice,
    options: &Options,
) -> Result<Calibration> {
    let n = windows.rows.len();
    if n < LEAST_WINDOWS {
        let what = format!("{n} healthy windows of {} s", typed(file.timing.window_s()));
        return Err(Error::new(what)
            .allowed(format!("{LEAST_WINDOWS} or more: a longer recording or a shorter window")));
    }
    let overlap = usize::from(file.timing.window_blocks).div_ceil(usize::from(file.timing.hop_blocks));
    stage::begins("the healthy lines", 0);
    let (mut channels, mut without_x) = (Vec::new(), Vec::new());
    operating_point::check_variation(&windows, &options.operating_point)?;
    let relations = [0, 1, 2].map(|position: usize| match (options.channels[position], position) {
        (true, EFFORT) => {
            let remembers = file.channels[position].channel.kind.meaning().remembers;
            let asked = if remembers { options.effort_memory } else { Some(0) };
            relation::choose(&windows, position, options.operating_point.len(), overlap, asked)
        }
        _ => Relation::default(),
    });
    // A window without others before it is not judged by a channel that remembers: it teaches no channel.
    let order = relations.iter().map(|r| usize::from(r.memory.order)).max().unwrap_or(0);
    let judged = relation::judged(&windows, order);
    let added = [0, 1, 2].map(|position: usize| {
        let at = |&place: &usize| relations[position].added(&windows, position, place);
        judged.iter().map(at).collect::<Vec<f64>>()
    });
    let between = relation::between_recordings(&windows, EFFORT, &relations[EFFORT]);
    let windows = windows.only(&judged);
    for position in (0..3).filter(|&p| options.channels[p]) {
        let kind = file.channels[position].channel.kind;
        let relation = &relations[position];
        let mut channel = fit_channel(&windows, position, kind, overlap, (relation, &added[position]))?;
        if position == EFFORT
            && let Some(residuals) = &between
        {
            channel.take_residuals(residuals.clone(), &windows, overlap);
        }
        let worth = channel.n_effective / channel.fit.n as f64;
        let fitted = (&channel.fit, position, worth);
        if let Some((columns, known)) =
            operating_point::combine(&windows, &options.operating_point, relation, fitted)
        {
            channel.operating_point = known;
            file.operating_point = Some(columns);
        }
        let has_x = channel.fit.has_slope || channel.operating_point.counts();
        if has_x { channels.push(channel) } else { without_x.push(kind) }
    }
    if channels.is_empty() {
        return Err(Error::new("x does not vary in any channel: there is no line to judge by")
            .allowed("recordings in which the loop does something, or other --channels"));
    }
    stage::begins("thresholds", 0);
    let cost = promise::set_thresholds(&mut channels, &windows, options, &file, overlap)?;
    finish(&mut file, &channels, options, n);
    let warnings = warnings::collect(&file, &channels, &without_x, &timing, windows.invalid);
    file.config()?;
    Ok(Calibration {
        file,
        channels,
        windows: windows.rows,
        invalid_windows: windows.invalid,
        timing,
        cost,
        warnings,
    })
}

fn check_recordings(recordings: &[Signals<'_>]) -> Result<()> {
    let Some(first) = recordings.first() else { return Err(Error::new("no recording")) };
    for signals in recordings {
        let length = signals.r.len();
        let other = [signals.y.len(), signals.u.len(), signals.state.map_or(length, <[_]>::len)];
        if length == 0 || other.iter().any(|&l| l != length) {
            return Err(Error::new("r, y, u are empty or of different lengths").in_file(signals.name));
        }
        if !(signals.sample_time_s > 0.0 && signals.sample_time_s.is_finite()) {
            return Err(Error::new(format!("the sample time is {} s", typed(signals.sample_time_s)))
                .in_file(signals.name));
        }
        if (signals.sample_time_s / first.sample_time_s - 1.0).abs() > 1e-6 {
            return Err(Error::new(format!("the sample time is {} s", typed(signals.sample_time_s)))
                .allowed(format!("{} s, as in {}", typed(first.sample_time_s), first.name))
                .in_file(signals.name));
        }
    }
    Ok(())
}

/// The kinds of the three places: the effort's as chosen, of the others the only one.
fn kinds(options: &Options) -> Result<[ChannelKind; 3]> {
    let kinds = [ChannelKind::EnergyError(options.index), options.effort, ChannelKind::Activity];
    for (place, kind) in kinds.iter().enumerate() {
        if kind.meaning().place != place {
            let names = ChannelKind::ROWS.iter().filter(|row| row.meaning.place == place).map(|row| row.name);
            return Err(Error::new(format!("channel {} is {}", place + 1, kind.name()))
                .allowed(names.collect::<Vec<_>>().join(" or ")));
        }
    }
    Ok(kinds)
}

fn unlearned(files: Vec<String>, options: &Options, timing: Timing) -> Result<BaselineFile> {
    let sample_time_s = f64::from(timing.sample_time_s);
    let blanking = match options.blanking {
        None => None,
        Some((step, s)) => {
            let ticks = (s / sample_time_s).round();
            if !(step >= 0.0 && step.is_finite() && (1.0..=4e9).contains(&ticks)) {
                return Err(Error::new(format!(
                    "--blank {} after steps of --blank-step {}",
                    typed(s),
                    typed(step)
                ))
                .allowed("a step of 0 or more and at least one sample"));
            }
            Some(Blanking { reference_step: step as f32, ticks: ticks as u32 })
        }
    };
    let kinds = kinds(options)?;
    let file = BaselineFile {
        timing,
        samples: Samples {
            min_valid: 0.5,
            saturation: options.saturation.map(|[lo, hi]| Saturation { u_min: lo as f32, u_max: hi as f32 }),
            blanking,
        },
        decision: Decision { confirm_hops: options.confirm_hops, ..Decision::DEFAULT },
        promise: None,
        operating_point: None,
        calibration: Provenance { files, windows: 0, effective_windows: 0.0 },
        channels: kinds.map(ChannelEntry::unlearned),
    };
    file.config()?;
    Ok(file)
}

fn fit_channel(
    windows: &windows::Windows,
    position: usize,
    kind: ChannelKind,
    overlap: usize,
    (relation, added): (&Relation, &[f64]),
) -> Result<ChannelFit> {
    let x: Vec<f64> = windows.rows.iter().map(|w| f64::from(w.x[position])).collect();
    let value: Vec<f64> =
        windows.rows.iter().zip(added).map(|(w, added)| f64::from(w.value[position]) - added).collect();
    let reach = if overlap > 1 { 2 * overlap } else { 0 };
    let mut fit = regression::fit(&x, &value, reach)?;
    // The relation's further coefficients were fitted to the same windows.
    let spent = relation.coefficients() as f64;
    let freedom = fit.n as f64 - 2.0;
    if freedom > spent {
        fit.rmse *= (freedom / (freedom - spent)).sqrt();
    }
    let largest = value.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    if fit.rmse <= 1e-6 * largest {
        return Err(Error::new(format!(
            "channel {} has no scatter beyond rounding: nothing to judge by",
            kind.name()
        ))
        .allowed("--channels without it"));
    }
    let mut channel = ChannelFit {
        kind,
        integrated_time: 1.0,
        n_for_variance: fit.n as f64,
        n_effective: fit.n as f64,
        lag1: 0.0,
        skewness: 0.0,
        detectors: Detectors::NONE,
        memory: relation.memory,
        operating_point: OperatingPoint::NONE,
        fit,
    };
    channel.describe_residuals(windows, overlap);
    Ok(channel)
}

fn longest_lag(n: usize, overlap: usize) -> usize {
    (8.max(4 * overlap)).min(n / 8).min(100)
}

fn finish(file: &mut BaselineFile, channels: &[ChannelFit], options: &Options, n: usize) {
    let least = channels.iter().map(|c| c.n_effective).fold(n as f64, f64::min);
    file.calibration.windows = n as u32;
    file.calibration.effective_windows = least;
    file.promise = Some(Promise {
        false_alarm_every_h: options.false_alarm_every_h,
        decisions: promise::decisions(options, file),
        confidence: options.confidence,
    });
    for channel in channels {
        let entry = file.channels.iter_mut().find(|e| e.channel.kind == channel.kind);
        if let Some(entry) = entry {
            *entry = channel.entry();
        }
    }
}

impl ChannelFit {
    /// Takes residuals that another prediction left in place of the line's own.
    fn take_residuals(&mut self, residuals: Vec<f64>, windows: &windows::Windows, overlap: usize) {
        let squares: f64 = residuals.iter().map(|e| e * e).sum();
        self.fit.rmse = (squares / residuals.len() as f64).sqrt();
        self.fit.residuals = residuals;
        self.describe_residuals(windows, overlap);
    }

    /// Correlation, worth and skewness of the residuals.
    fn describe_residuals(&mut self, windows: &windows::Windows, overlap: usize) {
        let fit = &self.fit;
        let stretches: Vec<&[f64]> =
            windows.stretches.iter().filter_map(|r| fit.residuals.get(r.clone())).collect();
        let covariances = autocovariances(&stretches, longest_lag(fit.n, overlap));
        let variance = covariances.first().copied().unwrap_or(1.0);
        let third = fit.residuals.iter().map(|e| e * e * e).sum::<f64>() / fit.n as f64;
        self.integrated_time = integrated_time(&covariances);
        self.n_for_variance = size_for_variance(fit.n, &covariances);
        self.n_effective = effective_size(fit.n, self.integrated_time);
        self.lag1 = covariances.get(1).map_or(0.0, |c| c / variance);
        self.skewness = third / variance.powf(1.5);
    }

    /// As the baseline file has it: numbers in f32.
    pub fn entry(&self) -> ChannelEntry {
        let fit = &self.fit;
        let worth = self.n_effective / fit.n as f64;
        let baseline = Baseline {
            b0: fit.b0 as f32,
            b1: fit.b1 as f32,
            sigma: fit.rmse as f32,
            windows: self.n_effective as f32,
            x_mean: fit.x_mean as f32,
            // The slope is known as well as from so many independent windows.
            x_ss: (fit.x_ss * worth) as f32,
            x_min: fit.x_range[0] as f32,
            x_max: fit.x_range[1] as f32,
        };
        let statistics = Statistics {
            n: fit.n as u32,
            n_effective: self.n_effective,
            b0_ci95: fit.b0_ci95_wide(),
            b1_ci95: fit.b1_ci95_wide(),
            r2: fit.r2,
            adj_r2: fit.adj_r2,
            rmse: fit.rmse,
            lag1: self.lag1,
            skewness: self.skewness,
        };
        let channel = Channel {
            memory: self.memory,
            operating_point: self.operating_point,
            ..Channel::new(self.kind, baseline, self.detectors)
        };
        ChannelEntry { channel, statistics: Some(statistics) }
    }
}
