//! Beyond the paper: how long each residual channel takes to raise a drift, all with a CUSUM (k = 0.5) whose
//! threshold was set on healthy runs so that false alarms are equally rare.
//!
//! Baselines are taken from long healthy operation, so that only the channels differ. The drift begins when the loop
//! has settled and grows to mu_max in 100 s; then it holds, or goes on growing. Detectors start at zero at its onset.

use crate::cores::AcrossCores as _;

use super::charts::{Charts, joint_thresholds, run_lengths, standardised, threshold};
use super::healthy::{CHANNELS, lines, tumbling};
use super::line::{self, lag1};
use super::settings::{
    DELAY_CAP_S, DELAY_MU, DELAY_ONSET_S, FALSE_ALARM_EVERY_S, HOP_S, HOPS_PER_WINDOW, LONG_RUN_S, Settings,
    Use, WINDOW_S,
};
use super::spread::{Share, Spread};
use super::windows::{AfterRamp, Drift, Stream, Window, coordinates};
use crate::Result;
use crate::calibrate::regression::Fit;

/// Which channels are watched, and how often.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scheme {
    /// Name in the JSON.
    pub name: &'static str,
    /// In words.
    pub says: &'static str,
    channels: &'static [usize],
    overlapping: bool,
}

/// All of them.
pub const SCHEMES: [Scheme; 5] = [
    Scheme { name: "energy_error", says: "the paper's pair", channels: &[0], overlapping: false },
    Scheme {
        name: "energy_error_overlapping",
        says: "the paper's pair, every 0.5 s",
        channels: &[0],
        overlapping: true,
    },
    Scheme { name: "effort", says: "effort", channels: &[1], overlapping: false },
    Scheme { name: "activity", says: "activity", channels: &[2], overlapping: false },
    Scheme { name: "together", says: "all three together", channels: &[0, 1, 2], overlapping: false },
];

impl Scheme {
    /// From one decision to the next, s.
    pub fn hop_s(&self) -> f64 {
        if self.overlapping { HOP_S } else { WINDOW_S }
    }
}

/// A scheme with its thresholds and what it does.
#[derive(Debug, Clone, PartialEq)]
pub struct SchemeResult {
    /// Which.
    pub scheme: Scheme,
    /// Thresholds, sigmas, one a channel.
    pub h: Vec<f64>,
    /// Time between false alarms on fresh healthy runs, s.
    pub between_false_alarms_s: Spread,
    /// Delays, one a level of mu_max, the drift holding at mu_max after its ramp.
    pub holding: Vec<Delay>,
    /// The same, the drift growing on at the same rate.
    pub going_on: Vec<Delay>,
}

/// Delays at one mu_max.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delay {
    /// Reached 100 s after the onset.
    pub mu_max: f64,
    /// From onset to alarm, s; a run without alarm counts as [`DELAY_CAP_S`].
    pub delay_s: Spread,
    /// Share of runs that alarmed within the ramp's 100 s.
    pub within_ramp: Share,
    /// Share of runs that alarmed at all.
    pub alarmed: Share,
}

/// How far the residuals move in a 100 s run, in standard deviations of a healthy window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effect {
    /// Name of the channel.
    pub channel: &'static str,
    /// Correlation of the healthy residuals of neighbouring windows that don't overlap.
    pub lag1: f64,
    /// Over the whole run on average.
    pub mean_sigmas: Spread,
    /// In its last window.
    pub last_sigmas: Spread,
}

/// The study.
#[derive(Debug, Clone, PartialEq)]
pub struct DelayStudy {
    /// Scheme by scheme.
    pub schemes: Vec<SchemeResult>,
    /// At mu_max = 1, channel by channel.
    pub effects: Vec<Effect>,
    /// Runs at each mu_max.
    pub runs: u64,
}

/// Everything that a run is judged by.
struct Watch {
    lines: Vec<Fit>,
    thresholds: Vec<Vec<f64>>,
}

impl Watch {
    fn z(&self, windows: &[Window]) -> Vec<Vec<f32>> {
        let of =
            |(line, kind): (&Fit, _)| standardised(&line::known_baseline(line), &coordinates(windows, kind));
        self.lines.iter().zip(CHANNELS).map(of).collect()
    }
}

fn set_thresholds(lines: Vec<Fit>, calibration: &[Window]) -> Watch {
    let mut watch = Watch { lines, thresholds: Vec::new() };
    let (every_hop, apart) = (watch.z(calibration), watch.z(&tumbling(calibration)));
    watch.thresholds = SCHEMES
        .par_iter()
        .map(|scheme| {
            let wanted = FALSE_ALARM_EVERY_S / scheme.hop_s();
            let series = watched(scheme, if scheme.overlapping { &every_hop } else { &apart });
            match series.as_slice() {
                [one] => vec![threshold(wanted, one)],
                several => joint_thresholds(wanted, several),
            }
        })
        .collect();
    watch
}

fn watched<'a>(scheme: &Scheme, channels: &'a [Vec<f32>]) -> Vec<&'a [f32]> {
    scheme.channels.iter().filter_map(|c| channels.get(*c).map(Vec::as_slice)).collect()
}

/// From onset to alarm for each scheme, s; `None` without one.
fn delays(watch: &Watch, mu_max: f64, after: AfterRamp, seed: u64) -> Result<Vec<Option<f64>>> {
    let drift = Drift { mu_max, sigma_end: 0.0, ramp_s: LONG_RUN_S, onset_s: DELAY_ONSET_S, after };
    let mut stream = Stream::learning(&drift, seed)?;
    let mut charts: Vec<Charts> = watch.thresholds.iter().map(|h| Charts::new(h)).collect();
    let mut found = vec![None; SCHEMES.len()];
    for count in 0usize.. {
        let window = stream.next_window();
        let age = window.end_s - DELAY_ONSET_S;
        if age > DELAY_CAP_S || found.iter().all(Option::is_some) {
            break;
        }
        if age <= 0.0 {
            continue;
        }
        let z: Vec<f32> = watch.z(&[window]).into_iter().flatten().collect();
        for ((scheme, charts), found) in SCHEMES.iter().zip(&mut charts).zip(&mut found) {
            let due = scheme.overlapping || count % HOPS_PER_WINDOW == 0;
            let z = scheme.channels.iter().filter_map(|c| z.get(*c).copied());
            if found.is_none() && due && charts.update(z) {
                *found = Some(age);
            }
        }
    }
    Ok(found)
}

pub(super) fn delay_study(
    settings: &Settings,
    calibration: &[Window],
    verification: &[Window],
    step: &(dyn Fn() + Sync),
) -> Result<DelayStudy> {
    let watch = set_thresholds(lines(calibration)?, calibration);
    let (every_hop, apart) = (watch.z(verification), watch.z(&tumbling(verification)));
    let holding = all_delays(settings, &watch, AfterRamp::Holds, step)?;
    let going_on = all_delays(settings, &watch, AfterRamp::GoesOn, step)?;
    let schemes = SCHEMES.iter().enumerate().map(|(which, scheme)| {
        let h = watch.thresholds.get(which).cloned().unwrap_or_default();
        let series = watched(scheme, if scheme.overlapping { &every_hop } else { &apart });
        let between: Vec<f64> = run_lengths(&h, &series).iter().map(|n| n * scheme.hop_s()).collect();
        SchemeResult {
            scheme: *scheme,
            h,
            between_false_alarms_s: Spread::of(&between),
            holding: of_scheme(&holding, which),
            going_on: of_scheme(&going_on, which),
        }
    });
    let schemes = schemes.collect();
    Ok(DelayStudy { schemes, effects: effects(settings, &watch, &apart)?, runs: settings.delay_runs })
}

/// For each mu_max, run by run and scheme by scheme.
type Found = Vec<(f64, Vec<Vec<Option<f64>>>)>;

fn all_delays(
    settings: &Settings,
    watch: &Watch,
    after: AfterRamp,
    step: &(dyn Fn() + Sync),
) -> Result<Found> {
    let run = |mu_max: f64, i: u64| {
        let found = delays(watch, mu_max, after, settings.seed_of(Use::Delay, i));
        step();
        found
    };
    // Without a drift there is nothing to go on.
    let levels = DELAY_MU.iter().filter(|mu| **mu > 0.0 || after == AfterRamp::Holds);
    levels
        .map(|mu| {
            let runs = (0..settings.delay_runs).into_par_iter().map(|i| run(*mu, i));
            Ok((*mu, runs.collect::<Result<Vec<_>>>()?))
        })
        .collect()
}

fn of_scheme(found: &Found, which: usize) -> Vec<Delay> {
    let of_mu = |(mu, runs): &(f64, Vec<Vec<Option<f64>>>)| {
        delay(*mu, &runs.iter().filter_map(|run| run.get(which).copied()).collect::<Vec<_>>())
    };
    found.iter().map(of_mu).collect()
}

fn delay(mu_max: f64, found: &[Option<f64>]) -> Delay {
    let capped: Vec<f64> = found.iter().map(|d| d.unwrap_or(DELAY_CAP_S)).collect();
    let within = found.iter().flatten().filter(|d| **d <= LONG_RUN_S).count();
    let alarmed = found.iter().flatten().count();
    Delay {
        mu_max,
        delay_s: Spread::of(&capped),
        within_ramp: Share::of(within, found.len()),
        alarmed: Share::of(alarmed, found.len()),
    }
}

/// The run with the drift less the healthy run with the same reference, at mu_max = 1.
fn effects(settings: &Settings, watch: &Watch, healthy: &[Vec<f32>]) -> Result<Vec<Effect>> {
    let z = |mu_max: f64, seed: u64| -> Result<Vec<Vec<f32>>> {
        let stream = Stream::learning(&Drift::over(mu_max, 0.0, LONG_RUN_S), seed)?;
        Ok(watch.z(&tumbling(&stream.windows_within(LONG_RUN_S))))
    };
    let moved = (0..settings.repeats)
        .into_par_iter()
        .map(|i| {
            let seed = settings.seed_of(Use::Repeat, i);
            let (healthy, drifting) = (z(0.0, seed)?, z(1.0, seed)?);
            Ok(healthy.iter().zip(&drifting).map(|(h, d)| difference(h, d)).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?;
    let of = |channel: usize, which: fn(&(f64, f64)) -> f64| {
        Spread::of(&moved.iter().filter_map(|run| run.get(channel).map(which)).collect::<Vec<_>>())
    };
    let effect = |(channel, kind): (usize, drift_core::ChannelKind)| Effect {
        channel: kind.name(),
        lag1: healthy
            .get(channel)
            .map_or(f64::NAN, |z| lag1(&z.iter().map(|z| f64::from(*z)).collect::<Vec<_>>())),
        mean_sigmas: of(channel, |d| d.0),
        last_sigmas: of(channel, |d| d.1),
    };
    Ok(CHANNELS.into_iter().enumerate().map(effect).collect())
}

/// (on average, in the last window).
fn difference(healthy: &[f32], drifting: &[f32]) -> (f64, f64) {
    let each: Vec<f64> = healthy.iter().zip(drifting).map(|(h, d)| f64::from(*d) - f64::from(*h)).collect();
    (each.iter().sum::<f64>() / each.len() as f64, each.last().copied().unwrap_or(f64::NAN))
}
