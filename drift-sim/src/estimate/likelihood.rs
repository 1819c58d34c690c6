//! The likelihood of recordings under a hypothesis at a point: one function for all rivals, over the same samples, in which the sensor
//! noise's size is found along the way, so that it doesn't depend on the units of r, y and u.
//!
//! `-2 log L = N ln(sum(e^2/s)/N) + sum(ln s) + priors`: a least-squares problem in `e/sqrt(s)` times `exp(mean(ln s)/2)`.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::DMatrix;

use crate::physics::Motion;
use crate::simulate::Start;

use super::begin::start;
use super::driven::Memory;
use super::filter_batch;
use super::gains::{Parts, Piece, Stretch, gains};
use super::hypothesis::{Hypothesis, Point, Realised};
use super::inner_product::dot;
use super::innovations::{Filter, Innovations};
use super::jumps::Jumps;
use super::linear_part::LinearPart;
use super::noise::Noise;
use super::signals::{Signals, deviation, held};
use super::waves::{Swings, Waves};
use super::whiten::Whitener;

/// Recordings of one loop, and how much of each a fit may see.
#[derive(Debug, Clone)]
pub struct Data {
    /// The recordings.
    pub recordings: Vec<Signals>,
    /// Samples of each that count, from its beginning.
    pub fitted: Vec<usize>,
    /// Samples at the beginning of each that don't count: what follows is likely or not, given them.
    given: Vec<usize>,
    /// From which of them on they are healthy: what is looked for is not in those.
    pub healthy_from: usize,
    /// What is left of correlation in their innovations.
    coloring: Whitener,
    /// When their load jumps.
    jumps: Jumps,
    /// How fast something swings beside their loop.
    waves: Waves,
    /// What that is over the samples of each that count.
    swings: Arc<Vec<Option<Swings>>>,
    /// Motions in them.
    pub motions: Vec<Motion>,
    /// Deviations to which y and its first differences are known at the start.
    start_deviations: Vec<f64>,
    /// What reached plants under each recording.
    driven: Arc<Vec<Memory>>,
    /// The same in coarser samples, which a search looks at first.
    first_look: Option<Arc<Data>>,
}

/// At the start y is known to twice the sensor's noise and to this part of its own deviation; a difference of y to this part of its own.
const START_OF_Y: f64 = 0.02;
const START_OF_DIFFERENCES: f64 = 0.3;
/// Mean square of the rows below which the loop is exact: simulated without noise.
const EXACT: f64 = 1e-12;

impl Data {
    /// These recordings, of which so many samples count.
    pub fn new(hypothesis: &Hypothesis, recordings: Vec<Signals>, fitted: Vec<usize>) -> Self {
        let scales = &hypothesis.scales;
        let of_y = libm::hypot(2.0 * scales.noise, START_OF_Y * scales.y);
        let mut start_deviations = vec![of_y / scales.noise];
        let mut differences: Vec<Vec<f64>> = recordings.iter().map(|s| held(&s.y)).collect();
        for _ in 1..6 {
            for y in &mut differences {
                *y = y.windows(2).map(|pair| pair[1] - pair[0]).collect();
            }
            let squares: f64 = differences.iter().map(|d| deviation(d) * deviation(d)).sum();
            let rms = libm::sqrt(squares / differences.len().max(1) as f64);
            start_deviations.push((START_OF_DIFFERENCES * rms / scales.noise).max(1e-9));
        }
        let motions = super::measure::motions(&hypothesis.model, &recordings);
        let given = vec![0; recordings.len()];
        let coloring = Whitener::none();
        let driven = Arc::new(recordings.iter().map(|_| Memory::default()).collect());
        Self {
            healthy_from: recordings.len(),
            recordings,
            given,
            fitted,
            coloring,
            jumps: Jumps::default(),
            waves: Waves::default(),
            swings: Arc::default(),
            motions,
            start_deviations,
            driven,
            first_look: None,
        }
    }

    /// The same recordings with another share that counts.
    #[must_use]
    pub fn seeing(&self, fitted: Vec<usize>) -> Self {
        Self { fitted, first_look: None, ..self.clone() }.with_swings()
    }

    /// What does not count of the recordings, given what does.
    #[must_use]
    pub fn beyond(&self) -> Self {
        Self { given: self.fitted.clone(), ..self.clone() }.whole()
    }

    /// The same recordings, all of which counts.
    #[must_use]
    pub fn whole(&self) -> Self {
        self.seeing(self.recordings.iter().map(Signals::len).collect())
    }

    /// The same recordings, which a search looks at first as these show them.
    #[must_use]
    pub(super) fn looked_at_as(self, look: Self) -> Self {
        Self { first_look: Some(Arc::new(look)), ..self }
    }

    /// What a search looks at first: itself where there is no coarser look.
    pub fn look(&self) -> &Self {
        self.first_look.as_deref().unwrap_or(self)
    }

    /// Whether a search looks at coarser samples first.
    pub fn has_first_look(&self) -> bool {
        self.first_look.is_some()
    }

    /// The same recordings, healthy from this one on.
    #[must_use]
    pub fn with_healthy(self, from: usize) -> Self {
        Self { healthy_from: from, ..self }
    }

    /// The same recordings, of which the healthy ones don't count.
    #[must_use]
    pub fn without_healthy(&self) -> Self {
        self.counting(|recording| recording < self.healthy_from)
    }

    /// The same recordings, of which only these count.
    #[must_use]
    pub fn counting(&self, counts: impl Fn(usize) -> bool) -> Self {
        let fitted = self.fitted.iter().enumerate();
        self.seeing(fitted.map(|(recording, fitted)| if counts(recording) { *fitted } else { 0 }).collect())
    }

    /// The same recordings, none of which is taken as healthy.
    #[must_use]
    pub fn with_all_alike(&self) -> Self {
        self.clone().with_healthy(self.recordings.len())
    }

    /// The same recordings under noise of this coloring besides.
    #[must_use]
    pub fn colored(self, coloring: Whitener) -> Self {
        Self { coloring, first_look: None, ..self }
    }

    /// The same recordings under a load that jumps.
    #[must_use]
    pub fn jumping(self, jumps: Jumps) -> Self {
        let in_samples_of = |look: &Arc<Self>| {
            let ratio = look.sample_time_s() / self.sample_time_s();
            Arc::new(Self {
                jumps: jumps.in_coarser_samples(libm::round(ratio) as usize),
                ..(**look).clone()
            })
        };
        let first_look = self.first_look.as_ref().map(in_samples_of);
        Self { jumps, first_look, ..self }
    }

    /// The same recordings where something swings beside the loop.
    #[must_use]
    pub fn swinging(self, waves: Waves) -> Self {
        let first_look = self.first_look.map(|look| Arc::new((*look).clone().swinging(waves.clone())));
        Self { waves, first_look, ..self }.with_swings()
    }

    /// With what swings over the samples that count, once for all hypotheses.
    fn with_swings(self) -> Self {
        let each = self.recordings.iter().zip(&self.fitted).enumerate();
        let swings =
            each.map(|(i, (signals, fitted))| self.waves.over(i, signals, &(self.given(i)..*fitted)));
        let swings = Arc::new(swings.collect());
        Self { swings, ..self }
    }

    /// Takes out of a recording's innovations what swings beside the loop.
    fn take_out_swings(&self, recording: usize, innovations: &mut [f64]) {
        if let Some(Some(swings)) = self.swings.get(recording) {
            swings.take_out(innovations);
        }
    }

    /// How fast something swings beside their loop.
    pub fn waves(&self) -> &Waves {
        &self.waves
    }

    /// When their load jumps.
    pub fn jumps(&self) -> &Jumps {
        &self.jumps
    }

    /// Whether innovations are whitened.
    pub fn is_colored(&self) -> bool {
        self.coloring.order() > 0
    }

    /// What is left of correlation in their innovations.
    pub fn coloring(&self) -> &Whitener {
        &self.coloring
    }

    /// Whether healthy recordings are among them.
    pub fn has_healthy(&self) -> bool {
        self.healthy_from < self.recordings.len()
    }

    /// The recordings that count, but for the healthy ones.
    pub fn of_the_fault(&self) -> Vec<usize> {
        let until = self.healthy_from.min(self.recordings.len());
        (0..until).filter(|recording| self.fitted.get(*recording).is_some_and(|fitted| *fitted > 0)).collect()
    }

    /// Samples at the beginning of a recording that don't count.
    fn given(&self, recording: usize) -> usize {
        self.given.get(recording).copied().unwrap_or(0)
    }

    /// Recordings of which something counts: which it is, the samples, and what reached plants under it.
    fn counted(&self) -> impl Iterator<Item = (usize, &Signals, Range<usize>, &Memory)> {
        let each = self.recordings.iter().zip(&self.fitted).zip(self.driven.iter()).enumerate();
        each.filter(|(_, ((_, fitted), _))| **fitted > 0)
            .map(|(i, ((signals, fitted), memory))| (i, signals, self.given(i)..*fitted, memory))
    }

    /// Samples of the longest recording that count.
    fn longest(&self) -> usize {
        self.fitted.iter().zip(&self.recordings).map(|(n, s)| (*n).min(s.len())).max().unwrap_or(0)
    }
}

/// Linear parts, noise and samples, and the gains that follow from them.
type Known = (Vec<Piece>, Noise, usize, Arc<Vec<Stretch>>);

/// The linear part that a filter ends with, its settled gains, and what stays of load and sensor noise from sample to sample.
pub type Settled = (LinearPart, (Vec<f64>, [f64; 2], (f64, f64)), (f64, f64));

/// What the gains follow from, and the gains: they are the same for points that differ in physics beside the linear part.
#[derive(Debug, Clone, Default)]
pub struct Cache {
    /// With the candidate terms, and without them; then of each recording whose load jumps.
    known: Vec<Option<Known>>,
}

impl Cache {
    /// The gains at a point, for others near it.
    pub fn at(hypothesis: &Hypothesis, point: &Point, data: &Data) -> Self {
        let mut cache = Self::default();
        Ready::at(hypothesis, point, data, &mut cache, data.longest());
        cache
    }

    /// What a filter ends with where no load jumps.
    pub(super) fn settled(hypothesis: &Hypothesis, point: &Point, data: &Data) -> Option<Settled> {
        let realised = hypothesis.realise(point)?;
        let mut cache = Self::default();
        let (stretches, _) = cache.gains(&realised, data, data.longest(), (0, &[]))?;
        let (pieces, noise, ..) = cache.known.into_iter().next()??;
        let last = stretches.last()?;
        let Parts { states, shown, load, sensor, scales } = last.at(last.settled_from());
        let part = pieces.into_iter().next_back()?.1;
        let gains = states.iter().copied().chain(shown).take(part.order()).collect();
        Some((
            part,
            (gains, [load, sensor], scales),
            (noise.load_phi(data.sample_time_s()), noise.sensor_rho),
        ))
    }

    fn gains(
        &mut self,
        realised: &Realised,
        data: &Data,
        samples: usize,
        (which, jumps): (usize, &[usize]),
    ) -> Option<(Arc<Vec<Stretch>>, usize)> {
        let ts = realised.model.sample_time_s;
        let pieces: Option<Vec<Piece>> = realised
            .changes()
            .into_iter()
            .map(|t| {
                let from = libm::ceil(t / ts - 1e-9).max(0.0) as usize;
                Some((from, LinearPart::of(&realised.model, t, &data.motions)?))
            })
            .collect();
        let pieces = pieces?;
        let first = pieces.first()?.1.first_state;
        if self.known.len() <= which {
            self.known.resize(which + 1, None);
        }
        if let Some(Some((of, noise, of_samples, gains))) = self.known.get(which)
            && *of == pieces
            && *noise == realised.noise
            && *of_samples == samples
        {
            return Some((gains.clone(), first));
        }
        let start: DMatrix<f64> = pieces.first()?.1.start_covariance(&data.start_deviations);
        let jumps = (jumps, data.jumps.ratio);
        let found = Arc::new(gains(&pieces, &realised.noise, ts, &start, (samples, jumps))?);
        if let Some(known) = self.known.get_mut(which) {
            *known = Some((pieces, realised.noise, samples, found.clone()));
        }
        Some((found, first))
    }
}

/// A recording's likelihood at a point.
#[derive(Debug, Clone)]
pub struct Rows {
    /// Innovations whose sum of squares is to be as small as it can, one after the other for all recordings.
    pub z: Vec<f64>,
    /// Samples that count.
    pub count: usize,
    /// `N ln(mean square of z) + priors`.
    pub objective: f64,
    /// Deviation of the sensor's noise, in the unit of y.
    pub sensor_sd: f64,
}

/// The rows of a hypothesis at a point; `None` where it can't be simulated.
pub fn rows(hypothesis: &Hypothesis, point: &Point, data: &Data, cache: &mut Cache) -> Option<Rows> {
    let ready = Ready::at(hypothesis, point, data, cache, data.longest())?;
    rows_of(&[(hypothesis, point, ready)], data).pop()?
}

/// The same at several points, side by side, from gains that are known near them.
pub fn rows_at(hypothesis: &Hypothesis, points: &[Point], data: &Data, near: &Cache) -> Vec<Option<Rows>> {
    let points: Vec<(&Hypothesis, &Point)> = points.iter().map(|point| (hypothesis, point)).collect();
    rows_of_each(&points, data, near)
}

/// The same of hypotheses that differ in their terms.
pub fn rows_of_each(points: &[(&Hypothesis, &Point)], data: &Data, near: &Cache) -> Vec<Option<Rows>> {
    let ready = |(hypothesis, point): &(&Hypothesis, &Point)| {
        Ready::at(hypothesis, point, data, &mut near.clone(), data.longest())
    };
    let ready: Vec<Option<Ready>> = points.iter().map(ready).collect();
    let is_ready: Vec<bool> = ready.iter().map(Option::is_some).collect();
    let able = points.iter().zip(ready).filter_map(|((of, point), ready)| Some((*of, *point, ready?)));
    let mut found = rows_of(&able.collect::<Vec<_>>(), data).into_iter();
    is_ready.into_iter().map(|is_ready| if is_ready { found.next().flatten() } else { None }).collect()
}

fn rows_of(points: &[(&Hypothesis, &Point, Ready)], data: &Data) -> Vec<Option<Rows>> {
    let mut runs: Vec<Option<Vec<Innovations>>> = points.iter().map(|_| Some(Vec::new())).collect();
    for (i, signals, counted, memory) in data.counted() {
        let filters: Option<Vec<(Filter<'_>, Start)>> =
            points.iter().map(|(of, _, ready)| ready.filter(of, data, i, signals)).collect();
        // There are gains of every recording.
        let filters = filters.unwrap_or_default();
        for (runs, run) in runs.iter_mut().zip(filter_batch::run(&filters, signals, &counted, memory)) {
            *runs = runs.take().zip(run).map(|(mut runs, mut run)| {
                data.coloring.whiten(&mut run.scaled);
                data.take_out_swings(i, &mut run.scaled);
                runs.push(run);
                runs
            });
        }
    }
    runs.into_iter().zip(points).map(|(runs, (of, point, _))| rows_from(of, point, runs?)).collect()
}

/// Innovations of all recordings as the rows of one likelihood.
fn rows_from(hypothesis: &Hypothesis, point: &Point, runs: Vec<Innovations>) -> Option<Rows> {
    let count: usize = runs.iter().map(|run| run.count).sum();
    let n = count.max(1) as f64;
    let log_variances: f64 = runs.iter().map(|run| run.log_variances).sum();
    let factor = libm::exp(0.5 * log_variances / n);
    let mut each = runs.into_iter().map(|run| run.scaled);
    let mut z = each.next()?;
    each.for_each(|scaled| z.extend(scaled));
    z.iter_mut().for_each(|e| *e *= factor);
    let squares = dot(&z, &z);
    // A run that diverges ends in a finite row where the last sample is missing.
    if !squares.is_finite() {
        return None;
    }
    let prior: f64 = hypothesis.prior_rows(point).map(|row| row * row).sum();
    let objective = n * libm::log((squares / n).max(EXACT)) + prior;
    let sensor_sd = libm::sqrt(squares / n) / factor * hypothesis.scales.noise;
    objective.is_finite().then_some(Rows { z, count, objective, sensor_sd })
}

/// A point of a hypothesis with its gains, before the filter runs.
struct Ready {
    realised: Realised,
    healthy: Option<Realised>,
    /// Of each recording that begins in another state.
    begun: Vec<Option<Realised>>,
    /// The gains of each recording, and the first state that they correct.
    gains: Vec<(Arc<Vec<Stretch>>, usize)>,
}

impl Ready {
    fn at(
        hypothesis: &Hypothesis,
        point: &Point,
        data: &Data,
        cache: &mut Cache,
        samples: usize,
    ) -> Option<Self> {
        let realised = hypothesis.realise(point)?;
        let healthy = (data.has_healthy()).then(|| hypothesis.healthy(&realised));
        let of_recording = |recording: usize| {
            let jumps = data.jumps.of(recording);
            let (of, plain) = match &healthy {
                Some(healthy) if recording >= data.healthy_from => (healthy, 1),
                _ => (&realised, 0),
            };
            let which = if jumps.is_empty() { plain } else { 2 + recording };
            cache.gains(of, data, samples, (which, jumps))
        };
        let gains: Option<Vec<_>> = (0..data.recordings.len()).map(of_recording).collect();
        let begun = |recording: usize| Hypothesis::in_recording(&realised, point, recording);
        let begun =
            if point.begun.is_empty() { Vec::new() } else { (0..data.recordings.len()).map(begun).collect() };
        Some(Self { gains: gains?, begun, realised, healthy })
    }

    /// The filter for a recording, and where it starts.
    fn filter(
        &self,
        hypothesis: &Hypothesis,
        data: &Data,
        recording: usize,
        signals: &Signals,
    ) -> Option<(Filter<'_>, Start)> {
        let realised = match &self.healthy {
            Some(healthy) if recording >= data.healthy_from => healthy,
            _ => self.begun.get(recording).and_then(Option::as_ref).unwrap_or(&self.realised),
        };
        let (gains, first_state) = self.gains.get(recording)?;
        let filter = Filter {
            model: &realised.model,
            noise: &realised.noise,
            gains,
            first_state: *first_state,
            late_s: realised.late_s,
            unit: hypothesis.scales.noise,
            constant_load: realised.constant_load,
        };
        Some((filter, start(realised, signals)))
    }
}

/// The filter's run over each recording, up to `samples` or to what counts of it.
pub fn runs(
    hypothesis: &Hypothesis,
    point: &Point,
    data: &Data,
    cache: &mut Cache,
    samples: usize,
    in_detail: bool,
) -> Option<Vec<Innovations>> {
    let ready = Ready::at(hypothesis, point, data, cache, samples)?;
    let each = data.counted().map(|(i, signals, counted, _)| {
        let (filter, start) = ready.filter(hypothesis, data, i, signals)?;
        let mut run = filter.run(signals, &start, counted, in_detail)?;
        data.coloring.whiten(&mut run.scaled);
        data.take_out_swings(i, &mut run.scaled);
        Some(run)
    });
    each.collect()
}
