//! Why the paper's windows and textbook thresholds don't go together: windows of 3 s every 0.5 s share five sixths of
//! their samples, so that neighbouring residuals are alike, and a CUSUM made for independent ones takes a chance
//! excursion for a shift. Measured on healthy runs alone; mended by windows that don't overlap, or by thresholds that
//! were set on such residuals.

use crate::cores::AcrossCores as _;
use drift_core::{Baseline, ChannelKind, Index};

use super::baseline::healthy_windows;
use super::charts::{Charts, run_lengths, standardised, threshold};
use super::healthy::tumbling;
use super::line::{self, lag1};
use super::settings::SAMPLE_TIME_S;
use super::settings::{CUSUM_H, CUSUM_K, FALSE_ALARM_EVERY_S, HOP_S, Settings, Use, WINDOW_S};
use super::spread::{Share, Spread};
use super::windows::{Window, coordinates};
use crate::calibrate::regression::Fit;
use crate::calibrate::{Options, Signals, calibrate};
use crate::control_loop::Loop;
use crate::design;
use crate::reference::Reference;
use crate::simulate::simulate;
use crate::{Error, Result};

/// Length of the healthy recording that `drift calibrate` is given, s.
const CALIBRATE_S: f64 = 3000.0;
const PAIR: ChannelKind = ChannelKind::EnergyError(Index::Iae);

/// One way to run the paper's CUSUM on healthy data.
#[derive(Debug, Clone, PartialEq)]
pub struct HealthyChart {
    /// In words.
    pub says: &'static str,
    /// From one decision to the next, s.
    pub hop_s: f64,
    /// Its threshold, sigmas.
    pub h: f64,
    /// Share of healthy 100 s runs with an alarm.
    pub alarmed: Share,
    /// Time between alarms over long healthy operation, s; none where each run has a baseline of its own.
    pub between_s: Option<Spread>,
}

/// The study.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlap {
    /// Lag-1 correlation of the residuals of 100 s runs, windows every 0.5 s.
    pub lag1_overlapping: Spread,
    /// The same over long healthy operation, windows that don't overlap.
    pub lag1_apart: f64,
    /// The ways, worst first.
    pub charts: Vec<HealthyChart>,
    /// What theory gives for independent residuals with k = 0.5, h = 5, decisions.
    pub textbook_arl0: f64,
    /// Healthy 100 s runs behind the shares.
    pub runs: u64,
}

/// A healthy run: all windows' coordinates, and those of the windows that don't overlap.
struct HealthyRun {
    every_hop: Vec<(f64, f64)>,
    apart: Vec<(f64, f64)>,
    line: Fit,
}

fn healthy_runs(settings: &Settings, step: &(dyn Fn() + Sync)) -> Result<Vec<HealthyRun>> {
    let run = |i: u64| {
        let windows = healthy_windows(settings.seed_of(Use::Healthy, i))?;
        let every_hop = coordinates(&windows, PAIR);
        let line = line::fit(&every_hop)?;
        step();
        Ok(HealthyRun { apart: coordinates(&tumbling(&windows), PAIR), every_hop, line })
    };
    (0..settings.healthy_runs).into_par_iter().map(run).collect()
}

fn alarms(baseline: &Baseline, points: &[(f64, f64)], h: f64) -> bool {
    let mut charts = Charts::new(&[h]);
    standardised(baseline, points).into_iter().any(|z| charts.update(std::iter::once(z)))
}

/// What `drift calibrate` makes of one healthy recording: the paper's channel alone, CUSUM alone.
fn calibrated(settings: &Settings, hop_s: f64) -> Result<(Baseline, f64)> {
    let seed = settings.seed_of(Use::Recording, 0);
    let r = Reference::paper(seed).take_samples((CALIBRATE_S / SAMPLE_TIME_S).round() as usize);
    let trace = simulate(&Loop::paper(), &r, &[], seed, None)?;
    let signals = Signals {
        name: "healthy run",
        sample_time_s: SAMPLE_TIME_S,
        r: &r,
        y: &trace.y,
        u: &trace.u,
        state: None,
        further: &[],
    };
    let options = Options {
        window_s: Some(WINDOW_S),
        hop_s: Some(hop_s),
        false_alarm_every_h: FALSE_ALARM_EVERY_S / 3600.0,
        channels: [true, false, false],
        detectors: "cusum".parse()?,
        k: CUSUM_K,
        simulated_decisions: 500_000,
        ..Options::default()
    };
    let calibration = calibrate(&[signals], &options)?;
    let channel = calibration.channels.first();
    let cusum = channel.and_then(|channel| Some((line::baseline(&channel.fit), channel.detectors.cusum?)));
    let (baseline, cusum) = cusum.ok_or_else(|| Error::new("calibration gives no CUSUM"))?;
    Ok((baseline, f64::from(cusum.h)))
}

/// `calibration` and `verification`: long healthy operation, windows every 0.5 s.
pub(super) fn overlap(
    settings: &Settings,
    calibration: &[Window],
    verification: &[Window],
    step: &(dyn Fn() + Sync),
) -> Result<Overlap> {
    let runs = healthy_runs(settings, step)?;
    let known = line::known_baseline(&line::fit(&coordinates(calibration, PAIR))?);
    let every_hop = |windows: &[Window]| standardised(&known, &coordinates(windows, PAIR));
    let apart = |windows: &[Window]| standardised(&known, &coordinates(&tumbling(windows), PAIR));
    let set_overlapping = threshold(FALSE_ALARM_EVERY_S / HOP_S, &every_hop(calibration));
    let set_apart = threshold(FALSE_ALARM_EVERY_S / WINDOW_S, &apart(calibration));
    let designed = design::Cusum::with_arl0(CUSUM_K, FALSE_ALARM_EVERY_S / WINDOW_S, 0.0)?.up().h();
    let own = |baseline_of: &dyn Fn(usize) -> Option<Baseline>, says| {
        let alarmed = runs
            .iter()
            .enumerate()
            .filter(|(i, run)| baseline_of(*i).is_some_and(|b| alarms(&b, &run.every_hop, CUSUM_H)))
            .count();
        let alarmed = Share::of(alarmed, runs.len());
        HealthyChart { says, hop_s: HOP_S, h: CUSUM_H, alarmed, between_s: None }
    };
    let (mended_apart, mended) =
        rayon::join(|| calibrated(settings, WINDOW_S), || calibrated(settings, HOP_S));
    let ((apart_baseline, apart_h), (mended_baseline, mended_h)) = (mended_apart?, mended?);
    let with = |known: &Baseline, says, overlapping: bool, h: f64| {
        let points = |run: &HealthyRun| if overlapping { run.every_hop.clone() } else { run.apart.clone() };
        let alarmed = runs.iter().filter(|run| alarms(known, &points(run), h)).count();
        let hop_s = if overlapping { HOP_S } else { WINDOW_S };
        let verifying = if overlapping { verification.to_vec() } else { tumbling(verification) };
        let series = standardised(known, &coordinates(&verifying, PAIR));
        let between: Vec<f64> = run_lengths(&[h], &[&series]).iter().map(|n| n * hop_s).collect();
        let between_s = Some(Spread::of(&between));
        HealthyChart { says, hop_s, h, alarmed: Share::of(alarmed, runs.len()), between_s }
    };
    let shared = |says, overlapping: bool, h: f64| with(&known, says, overlapping, h);
    let count = runs.len();
    let charts = vec![
        own(
            &|i| runs.get((i + 1) % count).map(|r| line::baseline(&r.line)),
            "overlapping, textbook threshold, baseline from another 100 s run",
        ),
        own(
            &|i| runs.get(i).map(|r| line::baseline(&r.line)),
            "overlapping, textbook threshold, baseline from the same 100 s run (as in Figure 8b)",
        ),
        shared("overlapping, textbook threshold, baseline known", true, CUSUM_H),
        shared("hop = window, textbook threshold, baseline known", false, CUSUM_H),
        shared("hop = window, threshold from `drift design` for 2000 s, baseline known", false, designed),
        shared("hop = window, threshold set on healthy runs for 2000 s, baseline known", false, set_apart),
        shared(
            "overlapping, threshold set on healthy runs for 2000 s, baseline known",
            true,
            set_overlapping,
        ),
        with(
            &apart_baseline,
            "hop = window, baseline and threshold by `drift calibrate` for 2000 s, from 3000 s",
            false,
            apart_h,
        ),
        with(
            &mended_baseline,
            "overlapping, baseline and threshold by `drift calibrate` for 2000 s, from 3000 s",
            true,
            mended_h,
        ),
    ];
    Ok(Overlap {
        lag1_overlapping: Spread::of(&runs.iter().map(|run| lag1(&run.line.residuals)).collect::<Vec<_>>()),
        lag1_apart: lag1(&apart(calibration).into_iter().map(f64::from).collect::<Vec<_>>()),
        charts,
        textbook_arl0: design::Cusum::new(CUSUM_K, CUSUM_H, 0.0)?.arl(0.0),
        runs: settings.healthy_runs,
    })
}
