//! Where to start the fits: every kind of physics that can act on the plant is tried at many points, one simulation
//! each, and judged by how much of the prediction error it could take away.
//!
//! What refitted nominal parameters could explain as well is projected out first, so that only what is new counts; the
//! size of the term is optimised in closed form along the line from nothing to the trial.

use crate::cores::AcrossCores as _;
use nalgebra::{DMatrix, DVector};

use crate::physics::{Begins, KINDS, Kind, Place, Signature, Term};

use super::fit::{Fit, coarse};
use super::model::Model;
use super::signals::Signals;
use super::whiten::Whitener;

/// Onsets tried across the recording.
const ONSETS: usize = 16;
/// Sizes tried around each starting value.
const FACTORS: [f64; 4] = [0.25, 0.5, 1.0, 2.0];

/// Whether the prediction of y under the recorded u shows a kind: not noise, grids, faults of the law, nor signals that are found by their
/// spans.
pub(super) fn is_predicted(kind: &Kind) -> bool {
    kind.place != Place::Controller
        && !["injected_signal", "sensor_noise", "quantization"].contains(&kind.name)
}

/// Kinds that the screening hands on: those that could take away most.
const MOST_KINDS: usize = 14;

/// Starting points followed of kinds in whose parameters the prediction jumps.
const JUMPING: usize = 4;

/// A point from which a fit may start.
#[derive(Debug, Clone)]
pub struct Trial {
    /// The model with the term at that point.
    pub model: Model,
    /// The term.
    pub term: Term,
    /// Share of the squared prediction error that it could take away, by the straight line.
    pub share: f64,
}

/// A model to try terms on, and what they are judged by there: its error as it is, and whitened where that is asked for.
pub(super) struct Bench {
    base: Fit,
    yardsticks: Vec<Yardstick>,
}

impl Bench {
    /// Beside the plain error, the error under the fit's own noise model where `whitened`.
    pub(super) fn new(base: &Fit, signals: &Signals, whitened: bool) -> Option<Self> {
        let model = base.model.clone().coarse();
        let base = Fit::start(&model, signals, &Whitener::none())?.with_whitener(base.whitener.clone());
        let plain = base.clone().with_whitener(Whitener::none());
        let jacobian = plain.derivative(signals)?;
        let mut yardsticks = vec![Yardstick::new(&base, &jacobian, Whitener::none())];
        if whitened {
            yardsticks.push(Yardstick::new(&base, &jacobian, base.whitener.clone()));
        }
        Some(Self { base, yardsticks })
    }

    /// One simulation; the trial as each yardstick sees it. What can't be simulated is worth nothing.
    fn try_out(&self, term: &Term, signals: &Signals) -> Option<Vec<Trial>> {
        let with = |term: &Term| self.base.model.with_term(term, term.onset_s > 0.0, signals.duration_s());
        let model = with(term);
        let residual = model.residual(&model.x, signals)?;
        // A gap's effect is in no proportion to its width.
        let jumps = term.kind.parameters.iter().any(|p| coarse(p.name));
        let judged = self.yardsticks.iter().map(|stick| {
            let (scale, share) = stick.judge(&self.base.residual, &residual);
            let itself = stick.at_itself(&residual);
            let plausible = (0.02..50.0).contains(&scale.abs());
            match scaled(term, scale).filter(|_| plausible && share > itself && !jumps) {
                Some(term) => Trial { model: with(&term), term, share },
                None => Trial { model: model.clone(), term: term.clone(), share: itself },
            }
        });
        Some(judged.collect())
    }

    /// What the term would do beyond what refitted numbers take up, over what is left without it, in power: under the noise
    /// model where there is one. One simulation.
    pub(super) fn power_of(&self, term: &Term, signals: &Signals) -> Option<f64> {
        let model = self.base.model.with_term(term, term.onset_s > 0.0, signals.duration_s());
        let residual = model.residual(&model.x, signals)?;
        self.yardsticks.last().map(|stick| stick.power_of(&self.base.residual, &residual))
    }
}

/// What a trial is judged on: the error of a model in one colour.
struct Yardstick {
    whitener: Whitener,
    error: DVector<f64>,
    explained: DMatrix<f64>,
}

impl Yardstick {
    fn new(base: &Fit, jacobian: &DMatrix<f64>, whitener: Whitener) -> Self {
        let columns: Vec<DVector<f64>> =
            jacobian.column_iter().map(|c| DVector::from_vec(whitener.apply(c.as_slice()))).collect();
        let explained = orthonormal(&columns, base.residual.len());
        let error = project_out(&explained, DVector::from_vec(whitener.apply(&base.residual)));
        Self { whitener, error, explained }
    }

    /// (best multiple of the trial's effect, share of the squared error that it takes away).
    fn judge(&self, without: &[f64], with: &[f64]) -> (f64, f64) {
        let change: Vec<f64> = with.iter().zip(without).map(|(a, b)| a - b).collect();
        let change = project_out(&self.explained, DVector::from_vec(self.whitener.apply(&change)));
        let power = change.norm_squared();
        if power <= 0.0 {
            return (0.0, 0.0);
        }
        let along = -self.error.dot(&change);
        (along / power, along * along / (power * self.error.norm_squared().max(1e-300)))
    }

    /// Power of the trial's effect over that of the error.
    fn power_of(&self, without: &[f64], with: &[f64]) -> f64 {
        let change: Vec<f64> = with.iter().zip(without).map(|(a, b)| a - b).collect();
        let change = project_out(&self.explained, DVector::from_vec(self.whitener.apply(&change)));
        change.norm_squared() / self.error.norm_squared().max(1e-300)
    }

    /// Share that is gone at the trial itself, without scaling it.
    fn at_itself(&self, residual: &[f64]) -> f64 {
        let left = project_out(&self.explained, DVector::from_vec(self.whitener.apply(residual)));
        1.0 - left.norm_squared() / self.error.norm_squared().max(1e-300)
    }
}

/// An orthonormal basis of the columns, those that add nothing left out.
fn orthonormal(columns: &[DVector<f64>], rows: usize) -> DMatrix<f64> {
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for column in columns {
        let size = column.norm();
        let mut rest = column.clone();
        for _ in 0..2 {
            for b in &basis {
                let along = b.dot(&rest);
                rest.axpy(-along, b, 1.0);
            }
        }
        if rest.norm() > 1e-7 * size && size > 0.0 {
            let norm = rest.norm();
            basis.push(rest / norm);
        }
    }
    if basis.is_empty() { DMatrix::zeros(rows, 0) } else { DMatrix::from_columns(&basis) }
}

fn project_out(basis: &DMatrix<f64>, mut x: DVector<f64>) -> DVector<f64> {
    for b in basis.column_iter() {
        let along = b.dot(&x);
        x.axpy(-along, &b, 1.0);
    }
    x
}

/// The best starting points of every kind in `kinds` that applies. What is part of the machine from the start is also tried from these
/// times on: when one thing breaks, another may.
pub fn screen(
    stated: &Fit,
    nominal: &Fit,
    signals: &Signals,
    signatures: &[Signature],
    kinds: impl Fn(&Kind) -> bool + Sync,
    also_from_s: &[f64],
) -> Vec<Vec<Trial>> {
    // What is new is judged beside the refitted numbers, but a strong effect may have bent those: beside the stated ones too.
    let benches: Vec<Bench> = [(nominal, true), (stated, false)]
        .into_iter()
        .filter_map(|(base, whitened)| Bench::new(base, signals, whitened))
        .collect();
    let mut screened: Vec<Vec<Screened>> = KINDS
        .par_iter()
        .filter(|kind| (kind.applies)(&nominal.model.nominal.plant) && kinds(kind))
        .map(|kind| screen_kind(kind, signals, signatures, &benches, also_from_s))
        .filter(|kept| !kept.is_empty())
        .collect();
    let best = |kept: &[Screened]| kept.iter().map(|s| s.trial.share).fold(f64::NEG_INFINITY, f64::max);
    screened.sort_by(|a, b| best(b).total_cmp(&best(a)));
    screened.truncate(MOST_KINDS);
    screened
        .into_par_iter()
        .map(|kept| kept.into_par_iter().map(|screened| screened.refined(signals)).collect())
        .collect()
}

/// Part of the squared prediction error beside `base` that each term leaves, its own numbers as they are; infinite where it
/// can't be simulated. One simulation each.
pub fn left_by(terms: &[Term], base: &Fit, signals: &Signals) -> Vec<f64> {
    let Some(bench) = Bench::new(base, signals, false) else { return vec![f64::INFINITY; terms.len()] };
    let left = |term: &Term| {
        let model = bench.base.model.with_term(term, false, signals.duration_s());
        let residual = model.residual(&model.x, signals)?;
        Some(1.0 - bench.yardsticks.first()?.at_itself(&residual))
    };
    terms.par_iter().map(|term| left(term).unwrap_or(f64::INFINITY)).collect()
}

/// A trial, and where it was judged.
struct Screened<'a> {
    trial: Trial,
    bench: &'a Bench,
    yardstick: usize,
}

fn screen_kind<'a>(
    kind: &'static Kind,
    signals: &Signals,
    signatures: &[Signature],
    benches: &'a [Bench],
    also_from_s: &[f64],
) -> Vec<Screened<'a>> {
    let terms = terms_of(kind, signatures, signals.duration_s(), also_from_s);
    let jumps = kind.parameters.iter().any(|p| coarse(p.name));
    let mut kept: Vec<Screened> = Vec::new();
    for bench in benches {
        let tried: Vec<Vec<Trial>> =
            terms.par_iter().filter_map(|term| bench.try_out(term, signals)).collect();
        for yardstick in 0..bench.yardsticks.len() {
            let mut seen: Vec<&Trial> = tried.iter().filter_map(|judged| judged.get(yardstick)).collect();
            seen.sort_by(|a, b| b.share.total_cmp(&a.share));
            for trial in seen.into_iter().take(if jumps { JUMPING } else { 1 }) {
                if kept.iter().all(|other| other.trial.model.x != trial.model.x) {
                    kept.push(Screened { trial: trial.clone(), bench, yardstick });
                }
            }
        }
    }
    kept
}

impl Screened<'_> {
    /// What begins later by golden section between the neighbours of the best onset of the grid: an onset is not for gradients.
    fn refined(self, signals: &Signals) -> Trial {
        const GOLDEN: f64 = 0.618_033_988_749_895;
        let Self { trial, bench, yardstick } = self;
        if trial.term.onset_s <= 0.0 {
            return trial;
        }
        let spacing = signals.duration_s() / ONSETS as f64;
        let (mut from, mut to) = ((trial.term.onset_s - spacing).max(0.0), trial.term.onset_s + spacing);
        let mut best = trial.clone();
        let mut share_at = |t: f64| {
            let judged = bench.try_out(&trial.term.clone().from_s(t), signals);
            let Some(found) = judged.and_then(|judged| judged.into_iter().nth(yardstick)) else {
                return f64::NEG_INFINITY;
            };
            let share = found.share;
            if share > best.share {
                best = found;
            }
            share
        };
        let (mut a, mut b) = (to - GOLDEN * (to - from), from + GOLDEN * (to - from));
        let (mut at_a, mut at_b) = (share_at(a), share_at(b));
        while to - from > 2.0 * signals.sample_time_s && to - from > 1e-4 * signals.duration_s() {
            if at_a > at_b {
                (to, b, at_b) = (b, a, at_a);
                a = to - GOLDEN * (to - from);
                at_a = share_at(a);
            } else {
                (from, a, at_a) = (a, b, at_b);
                b = from + GOLDEN * (to - from);
                at_b = share_at(b);
            }
        }
        best
    }
}

/// Everything to try of a kind.
fn terms_of(
    kind: &'static Kind,
    signatures: &[Signature],
    duration_s: f64,
    also_from_s: &[f64],
) -> Vec<Term> {
    let mut starts: Vec<Vec<f64>> = Vec::new();
    for parameters in signatures.iter().flat_map(|s| (kind.starts)(s)) {
        // What only differs in sign is found from either side by the closed-form size.
        let flipped = |other: &Vec<f64>| {
            other.len() == 1
                && kind.begins != Begins::Start
                && parameters.len() == 1
                && other[0] == -parameters[0]
        };
        if !starts.iter().any(|other| *other == parameters || flipped(other)) {
            starts.push(parameters);
        }
    }
    let onsets: Vec<f64> = (1..ONSETS).map(|i| duration_s * i as f64 / ONSETS as f64).collect();
    let mut terms = Vec::new();
    for (start_index, parameters) in starts.iter().enumerate() {
        let sizes: &[f64] = if kind.begins == Begins::Start && starts.len() < 12 { &FACTORS } else { &[1.0] };
        for factor in sizes {
            let term = Term {
                kind,
                parameters: resized(kind, parameters, *factor),
                onset_s: 0.0,
                spans: Vec::new(),
            };
            if term.check().is_err() {
                continue;
            }
            if kind.begins != Begins::Later {
                terms.push(term.clone());
            }
            if kind.begins == Begins::Start {
                terms.extend(also_from_s.iter().map(|t| term.clone().from_s(*t)));
            }
            // What is in proportion to its size needs no second size at each onset.
            if kind.begins != Begins::Start && (start_index == 0 || kind.parameters.len() > 1) {
                terms.extend(onsets.iter().map(|t| term.clone().from_s(*t)));
            }
        }
    }
    terms
}

/// Whether a parameter is a size that starts out unknown: not a frequency, a phase, an exponent or a ratio.
fn is_size(unit: &str) -> bool {
    unit == "s" || ["{u}", "{y}", "{drive}"].iter().any(|own| unit.contains(own))
}

fn resized(kind: &Kind, parameters: &[f64], factor: f64) -> Vec<f64> {
    kind.parameters
        .iter()
        .zip(parameters)
        .map(|(p, v)| if is_size(p.unit) { v * factor } else { *v })
        .collect()
}

/// The term at another size, where its effect is about in proportion to that; ratios are scaled about one.
pub(super) fn scaled(term: &Term, scale: f64) -> Option<Term> {
    let mut term = term.clone();
    let first = term.kind.parameters.first()?;
    if first.name == "ratio" {
        let ratio = term.parameters.first_mut()?;
        *ratio = 1.0 + scale * (*ratio - 1.0);
    } else {
        term.parameters = resized(term.kind, &term.parameters, scale);
        if !is_size(first.unit) {
            *term.parameters.first_mut()? *= scale;
        }
    }
    term.check().is_ok().then_some(term)
}
