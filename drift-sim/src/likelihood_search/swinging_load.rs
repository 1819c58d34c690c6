//! A load that swings is noise of another kind than one that drifts: where nothing is known of its waves, a resonance, a lag or a sticking valve seems to explain them. Waves are
//! looked for as lines in the spectrum of what was not foretold, in each recording by itself, beside the plant alone and beside the kinds that lead; the likeliest of these, waves and
//! all, tells how the load swings, and every kind is judged anew beside those waves. A load that swings as one wave in all recordings, with one phase, is no noise and is named.

use crate::cores::AcrossCores as _;

use crate::estimate::fit::Fit;
use crate::estimate::inner_product::dot;
use crate::estimate::likelihood::Data;
use crate::estimate::signals::Signals;
use crate::estimate::waves::{MOST_WAVES, Swings, Waves};
use crate::physics::{KINDS, Kind, Over, Starts};
use crate::stage;

use super::decide::priced;
use super::load_noise::{judged_again, looked_beside, price_of_two, refitted};
use super::options::Options;
use super::plants::Identified;
use super::rivals::Field;
use super::starts::{Base, Spectrum, begins};

/// Log-likelihood that a line promises at least beside the choice of its frequency, which costs the logarithm of the samples.
const PROMISES: f64 = 5.0;
/// How many times finer than one period over the recording lines are looked for.
const FINER: usize = 4;
/// Periods of a wave in a recording, at least, for what swings fewer times drifts; and samples of a period, at least.
const LEAST_PERIODS: f64 = 3.0;
const LEAST_SAMPLES: f64 = 10.0;
/// Times that the frequencies of waves are found again beside each other.
const REFINED: usize = 2;
/// Periods over the recording by which two waves differ, at least.
const APART: usize = 2;
/// Part of the reference's squares that lie about a frequency, or about a half or a third of it, from which on a line there is the reference's.
const REFERENCE: f64 = 0.05;
const HARMONICS: usize = 3;
/// How many times more a line promises than all others where the reference moves half as much and more, for it not to be the reference's all the same: a chirp moves at
/// each frequency, and what a model lacks shows at each.
const STANDS_OUT: f64 = 5.0;
/// Logarithms of the samples that a wave costs: one for its frequency, which is the best of so many, and a half each for its size and its phase.
const CHOICES: f64 = 2.0;
/// Part of what waves gain that one wave in all recordings gains where the load is that wave, whatever swings beside it: a load of ten times the waves about it gains 0.98 (9319).
const ONE_WAVE: f64 = 0.9;
/// Steps of the fit of a load that is one wave in all recordings.
const STEPS: usize = 6;

/// A fit under a load that swings.
struct Swinging {
    fit: Fit,
    waves: Waves,
    /// Its [`price`].
    price: f64,
}

/// The search's plant and field under a load that swings, where that is likelier than any kind without. What proves is searched for waves as well, which no guarantee allows.
pub fn taken_up(found: Identified, field: Field, options: &Options) -> (Identified, Field) {
    instead(&found, &field, options).unwrap_or((found, field))
}

/// The same where a load that swings is likelier.
pub fn instead(found: &Identified, field: &Field, options: &Options) -> Option<(Identified, Field)> {
    if options.guarantee.is_some() {
        return None;
    }
    stage::begins("waves of the load", 0);
    let Swinging { fit, waves, .. } = likeliest(&found.data, field, options)?;
    let data = found.data.clone().swinging(waves);
    judged_again(&fit, data, (found, field, looked_beside(field, is_none)), options)
}

/// Beside what swings by itself other waves are looked for.
fn is_none(_: &Kind) -> bool {
    false
}

/// The likeliest of base and leading kinds with the waves that each asks for, where it is likelier than all kinds without.
fn likeliest(data: &Data, field: &Field, options: &Options) -> Option<Swinging> {
    let of_kinds = field.rivals.iter().filter(|rival| rival.ended).map(|rival| 0.5 * priced(&rival.fit));
    let without = of_kinds.fold(0.5 * priced(&field.base), f64::min);
    let beside = looked_beside(field, is_none);
    let alone = beside.par_iter().filter_map(|fit| Some((*fit, swinging_beside(fit, data)?)));
    let mut alone: Vec<(&Fit, Swinging)> = alone.collect();
    alone.sort_by(|a, b| a.1.price.total_cmp(&b.1.price));
    // What one fit hides another one shows.
    let all = all_lines(alone.iter().map(|(_, swinging)| &swinging.waves.hz), data);
    let missed = |swinging: &Swinging| swinging.waves.count() < all.iter().map(Vec::len).sum();
    let again = alone
        .par_iter()
        .filter(|(_, swinging)| missed(swinging))
        .filter_map(|(fit, swinging)| Some((*fit, under(&swinging.fit, all.clone(), data)?)));
    let again: Vec<(&Fit, Swinging)> = again.collect();
    let each: Vec<(&Fit, Swinging)> = alone.into_iter().chain(again).collect();
    let (beside, best) = each.into_iter().min_by(|a, b| a.1.price.total_cmp(&b.1.price))?;
    let is_likelier = |than: f64| best.price < than - options.margin;
    if !is_likelier(without) {
        return None;
    }
    let (none, one) = (0.5 * priced(beside), as_one_wave(beside, data));
    let is_one_wave = none - one > ONE_WAVE * (none - best.price);
    // A round of all kinds is asked for last: nothing else here takes as long.
    let are_waves = is_likelier(one) && !is_one_wave && is_likelier(price_of_two(field, data, options));
    are_waves.then_some(best)
}

/// All lines of several searches in each recording, those of the likeliest first; of two that are the same one is kept.
fn all_lines<'a>(found: impl Iterator<Item = &'a Vec<Vec<f64>>> + Clone, data: &Data) -> Vec<Vec<f64>> {
    let of_recording = |(recording, signals): (usize, &Signals)| {
        let least = APART as f64 / signals.duration_s();
        let mut kept: Vec<f64> = Vec::new();
        for hz in found.clone().filter_map(|hz| hz.get(recording)).flatten().copied() {
            if kept.len() < MOST_WAVES && kept.iter().all(|other| (other - hz).abs() > least) {
                kept.push(hz);
            }
        }
        kept
    };
    data.recordings.iter().enumerate().map(of_recording).collect()
}

/// The price of a fit with a load that is one wave in all recordings.
fn as_one_wave(fit: &Fit, data: &Data) -> f64 {
    let Some(base) = Base::new(fit, data) else { return f64::INFINITY };
    let kinds = KINDS.iter().filter(|kind| matches!(kind.search, Starts::Wave(Over::Time)));
    let present = |kind: &Kind| fit.hypothesis.candidates().iter().any(|term| term.kind == kind);
    let best = kinds.filter(|kind| !present(kind)).filter_map(|kind| {
        let begin = begins(&base, kind).into_iter().next()?;
        let mut fit = Fit::at(&begin.hypothesis, &begin.point, data)?;
        fit.descend(data, STEPS, &[]);
        Some(0.5 * priced(&fit))
    });
    best.fold(f64::INFINITY, f64::min)
}

/// A fit with the waves that it asks for, one more in each recording as long as that is likelier; `None` where there are none.
fn swinging_beside(beside: &Fit, data: &Data) -> Option<Swinging> {
    let whole = data.whole();
    let mut best: Option<Swinging> = None;
    for _ in 0..MOST_WAVES {
        let known = best.as_ref().map_or_else(Waves::default, |best| best.waves.clone());
        let fit = best.as_ref().map_or(beside, |best| &best.fit);
        let Some(hz) = with_lines(fit, &known, &whole) else { break };
        let Some(next) = under(fit, hz, data) else { break };
        if best.as_ref().is_some_and(|best| next.price >= best.price) {
            break;
        }
        best = Some(next);
    }
    best
}

/// A fit under waves of these frequencies.
fn under(fit: &Fit, hz: Vec<Vec<f64>>, data: &Data) -> Option<Swinging> {
    let waves = Waves { hz };
    let fit = refitted(fit, &data.clone().swinging(waves.clone()))?;
    let price = price(&fit, &waves, data);
    Some(Swinging { fit, waves, price })
}

/// The known frequencies with the strongest line of each recording that promises enough beside them; `None` where none does.
fn with_lines(fit: &Fit, known: &Waves, whole: &Data) -> Option<Vec<Vec<f64>>> {
    let rows = Fit::at(&fit.hypothesis, &fit.point, whole)?.rows;
    let mut hz: Vec<Vec<f64>> = Vec::new();
    let (mut first, mut is_any_new) = (0, false);
    for (recording, signals) in whole.recordings.iter().enumerate() {
        let z = rows.z.get(first..first + signals.len())?;
        first += signals.len();
        let lines = Lines::of(z, signals)?;
        let known = known.of(recording);
        let line = lines.strongest_beside(known);
        is_any_new |= line.is_some();
        hz.push(match line {
            Some(line) => lines.refined(known.iter().copied().chain([line]).collect()),
            None => known.to_vec(),
        });
    }
    is_any_new.then_some(hz)
}

/// What was not foretold of a recording, and the spectrum of its reference.
struct Lines<'a> {
    spectrum: Spectrum,
    sample_time_s: f64,
    missed: &'a [f64],
    /// Which samples count.
    counts: Vec<bool>,
    /// Squares of its spectrum.
    reference: Vec<f64>,
}

impl<'a> Lines<'a> {
    fn of(missed: &'a [f64], signals: &Signals) -> Option<Self> {
        let spectrum = Spectrum::holding(FINER * missed.len());
        let mean = signals.r.iter().sum::<f64>() / signals.r.len().max(1) as f64;
        let moves: Vec<f64> = signals.r.iter().map(|r| r - mean).collect();
        let reference = squares(&spectrum, &moves)?;
        // What was not measured, or does not count, is 0.
        let counts = missed.iter().map(|z| *z != 0.0).collect();
        Some(Self { spectrum, sample_time_s: signals.sample_time_s, missed, counts, reference })
    }

    /// Squares of the spectrum of what is left beside waves of these frequencies, over what they are in white noise: of a sine this is the log-likelihood that is gained.
    fn promises_beside(&self, hz: &[f64]) -> Option<Vec<f64>> {
        let mut left = self.missed.to_vec();
        if !hz.is_empty() {
            Swings::over(hz, self.sample_time_s, &self.counts).take_out(&mut left);
        }
        let noise = dot(&left, &left).max(1e-300);
        Some(squares(&self.spectrum, &left)?.into_iter().map(|square| square / noise).collect())
    }

    /// The frequency of the strongest line beside those that are known, if it promises enough. What the reference makes is none: what a model of the plant lacks swings with it.
    fn strongest_beside(&self, known: &[f64]) -> Option<f64> {
        let promises = self.promises_beside(known)?;
        let samples = self.missed.len();
        let most = REFERENCE * self.reference.iter().sum::<f64>();
        let is_no_reference = |at: &usize| {
            (1..=HARMONICS)
                .all(|of| self.reference_about(at / of) <= most || self.stands_out(&promises, *at, of))
        };
        let is_new = |at: &usize| known.iter().all(|hz| self.place(*hz).abs_diff(*at) > APART * FINER);
        let low = self.spectrum.place(LEAST_PERIODS / samples as f64).max(1);
        let high = self.spectrum.place(1.0 / LEAST_SAMPLES).min(promises.len());
        let (at, promise) = highest(&promises, (low..high).filter(is_new).filter(is_no_reference))?;
        let bar = PROMISES + libm::log(samples.max(2) as f64);
        (promise > bar).then(|| self.top(&promises, at))
    }

    /// Each of these frequencies again beside the others, which had leaked into it.
    fn refined(&self, mut hz: Vec<f64>) -> Vec<f64> {
        for line in (0..hz.len()).cycle().take(REFINED * hz.len()) {
            let others: Vec<f64> =
                hz.iter().enumerate().filter(|(other, _)| *other != line).map(|(_, hz)| *hz).collect();
            let Some(promises) = self.promises_beside(&others) else { break };
            let Some(slot) = hz.get_mut(line) else { break };
            let about = self.place(*slot);
            let near = about.saturating_sub(FINER).max(1)..(about + FINER + 1).min(promises.len());
            if let Some((at, _)) = highest(&promises, near) {
                *slot = self.top(&promises, at);
            }
        }
        hz
    }

    /// The frequency at the top of the parabola through three values.
    fn top(&self, promises: &[f64], at: usize) -> f64 {
        let value = |at: usize| promises.get(at).copied().unwrap_or(0.0);
        let (before, after) = (value(at.saturating_sub(1)), value(at + 1));
        let bend = before - 2.0 * value(at) + after;
        let shift = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
        self.spectrum.per_sample(at as f64 + shift.clamp(-0.5, 0.5)) / self.sample_time_s
    }

    /// Whether a line promises much more than any other whose part of the reference, `1/of` of its frequency, is half as much at least. Of a reference that moves nowhere else
    /// nothing can be told.
    fn stands_out(&self, promises: &[f64], at: usize, of: usize) -> bool {
        let least = 0.5 * self.reference_about(at / of);
        let is_apart = |other: &usize| other.abs_diff(at) > 2 * APART * FINER;
        let alike =
            (at / 2..2 * at).filter(is_apart).filter(|other| self.reference_about(other / of) >= least);
        let most = highest(promises, alike);
        most.is_some_and(|(_, most)| promises.get(at).is_some_and(|promise| *promise > STANDS_OUT * most))
    }

    fn place(&self, hz: f64) -> usize {
        self.spectrum.place(hz * self.sample_time_s)
    }

    /// The reference's squares about a place.
    fn reference_about(&self, at: usize) -> f64 {
        let about = at.saturating_sub(FINER)..at + FINER + 1;
        self.reference.get(about).map_or(0.0, |about| about.iter().sum())
    }
}

fn squares(spectrum: &Spectrum, x: &[f64]) -> Option<Vec<f64>> {
    Some(spectrum.of(x)?.iter().map(|x| x.norm_sqr()).collect())
}

fn highest(values: &[f64], places: impl Iterator<Item = usize>) -> Option<(usize, f64)> {
    let each = places.filter_map(|at| Some((at, *values.get(at)?)));
    each.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Minus the log-likelihood of a fit, with what its candidate's numbers cost, and the choice of frequency, size and phase of those waves that fits have seen.
fn price(fit: &Fit, waves: &Waves, data: &Data) -> f64 {
    let of_recording = |(recording, (signals, fitted)): (usize, (&Signals, &usize))| {
        let seen = if *fitted > 0 { waves.of(recording).len() } else { 0 };
        CHOICES * seen as f64 * libm::log(signals.len().max(2) as f64)
    };
    let choices: f64 = data.recordings.iter().zip(&data.fitted).enumerate().map(of_recording).sum();
    0.5 * priced(fit) + choices
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const SAMPLES: usize = 8_000;
    const HZ: f64 = 0.01;

    /// A sweep over ten periods about the wave.
    fn sweep(n: usize) -> f64 {
        let part = n as f64 / SAMPLES as f64;
        libm::sin(TAU * n as f64 * (0.0094 + 0.0006 * part))
    }

    fn wave(n: usize) -> f64 {
        libm::sin(TAU * HZ * n as f64 + 0.4)
    }

    /// The strongest line in what was missed that is none of this reference, in noise of a known sequence.
    fn line(missed: impl Fn(usize) -> f64, r: fn(usize) -> f64) -> Option<f64> {
        let noise = |n: usize| ((n * n) as f64 * 0.618_033_988_7).fract() - 0.5;
        let missed: Vec<f64> = (0..SAMPLES).map(|n| missed(n) + noise(n)).collect();
        let r = (0..SAMPLES).map(r).collect();
        let signals = Signals { r, y: vec![0.0; SAMPLES], sample_time_s: 1.0, ..Signals::default() };
        Lines::of(&missed, &signals)?.strongest_beside(&[])
    }

    /// What a model lacks shows wherever its reference moves: a wave at one place of all that a sweep passes is none of it, and of a reference that is a wave itself nothing is told.
    #[test]
    fn a_wave_is_told_from_a_sweep_and_not_from_a_reference_that_is_a_wave() {
        let is_there = |found: Option<f64>| found.is_some_and(|hz| (hz - HZ).abs() < 1.0 / SAMPLES as f64);
        let of_wave = |r| is_there(line(|n| 0.3 * wave(n), r));
        assert!(of_wave(|_| 1.0));
        assert!(of_wave(sweep));
        assert!(!of_wave(wave));
    }
}
