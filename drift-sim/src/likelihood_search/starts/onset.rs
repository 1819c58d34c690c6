//! When something begins, by a matched filter: the innovations' answer to a step, from one simulation, is correlated with the
//! innovations at every sample, weighted by what acts in proportion; the best times are checked exactly.

use realfft::num_complex::Complex;

use crate::estimate::hypothesis::{ENDS, Hypothesis, Point, Target};
use crate::estimate::innovations::SETTLING;
use crate::estimate::signals::{Signals, held};
use crate::physics::{Kind, Start, Starts, Term, Weight};
use crate::plant::{Output, Plant};

use super::spectrum::Spectrum;
use super::{Base, Begin, neutral, wider};

/// Size of the trial step, in the parameter's own scale.
const TRIAL: f64 = 0.02;
/// The same of a ratio.
const RATIO_TRIAL: f64 = 0.1;
/// The same where dry friction may hold what is small.
const LARGE: f64 = 0.5;
/// Times that are checked exactly, and how far apart they are, as part of the recording.
const CHECKED: usize = 5;
const APART: f64 = 0.015;
/// Samples over which a speed is averaged.
const SPEED_SAMPLES: usize = 15;
/// Part of an answer's squares that counts as left, at least, where the base's numbers take up nearly all of it: what acts in proportion to a signal is
/// known about only.
const LEAST_LEFT: f64 = 0.01;
/// Greatest size of a start, in the parameter's own scale.
const MOST: f64 = 5.0;

/// Steps of the kind at the times where they would explain most.
pub fn steps(base: &Base<'_>, kind: &'static Kind, weight: Weight) -> Option<Vec<Begin>> {
    from_filter(base, kind, weight, false)
}

/// Ramps of the kind.
pub fn ramps(base: &Base<'_>, kind: &'static Kind, weight: Weight) -> Option<Vec<Begin>> {
    from_filter(base, kind, weight, true)
}

fn from_filter(base: &Base<'_>, kind: &'static Kind, weight: Weight, ramp: bool) -> Option<Vec<Begin>> {
    let answer = step_answer(base, weight)?;
    let mut promise = promises(base, weight, &answer, ramp)?;
    let n = promise.len();
    let ends = (ENDS * n as f64) as usize;
    promise.iter_mut().enumerate().filter(|(i, _)| *i < ends || *i + ends >= n).for_each(|(_, p)| *p = 0.0);
    let ts = base.fit.hypothesis.model.sample_time_s;
    // What grows may do so from the start on; what healthy recordings lack may have begun before this one.
    let mut onsets_s = if ramp || base.data.has_healthy() { vec![0.0] } else { Vec::new() };
    for _ in 0..CHECKED {
        let (at, best) = promise.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
        if *best <= 0.0 {
            break;
        }
        onsets_s.push(at as f64 * ts);
        let apart = (APART * n as f64) as usize;
        promise.iter_mut().skip(at.saturating_sub(apart)).take(2 * apart + 1).for_each(|p| *p = 0.0);
    }
    at_each(base, kind, &onsets_s)
}

/// The kind from some time on, of the size that one small trial tells.
pub fn at(base: &Base<'_>, kind: &'static Kind, onset_s: f64) -> Option<Begin> {
    at_each(base, kind, &[onset_s])?.pop()
}

/// The same of several times, whose trials run side by side.
fn at_each(base: &Base<'_>, kind: &'static Kind, onsets_s: &[f64]) -> Option<Vec<Begin>> {
    let hypothesis = wider(base, kind, neutral(kind));
    let from = hypothesis.widen(&base.fit.hypothesis, &base.fit.point);
    let place = *hypothesis.places_of(hypothesis.candidates().len() - 1).first()?;
    let free = hypothesis.free.get(place)?.clone();
    let trial = if free.from == 0.0 { TRIAL } else { RATIO_TRIAL };
    // Feedback conceals how a sensor drifts: y stays where it is, and its scale says nothing of it. A bias shows in y when it comes.
    let most = if matches!(kind.search, Starts::Ramp(Weight::Sensor)) { f64::INFINITY } else { MOST };
    let start = Start::of(vec![free.value(0.0)]);
    let points: Vec<Point> =
        onsets_s.iter().map(|onset_s| hypothesis.started(&from, &start, *onset_s)).collect();
    let sized = |trial: f64| -> Option<Vec<Begin>> {
        let responses = base.responses(&hypothesis, &points, place, trial)?;
        let begun = responses.into_iter().zip(&points).zip(onsets_s);
        let begun = begun.filter_map(|((response, point), onset_s)| {
            let (x, score) = base.proportional(&response?);
            let mut point = point.clone();
            *point.x.get_mut(place)? = x.clamp(free.low.max(-most), 0.8 * free.high.min(most));
            Some(Begin { score, hypothesis: hypothesis.clone(), point, onset_s: *onset_s })
        });
        Some(begun.collect())
    };
    let begun = sized(trial)?;
    if !may_be_held(base) {
        return Some(begun);
    }
    // A small trial is held by dry friction, a large one to one side alone: what each leads to is judged as it is.
    let all = [LARGE, -LARGE].into_iter().filter_map(sized).flatten().chain(begun);
    let all: Vec<Begin> = all.collect();
    let points: Vec<Point> = all.iter().map(|begin| begin.point.clone()).collect();
    let scores = base.scores(&hypothesis, &points);
    let judged =
        all.into_iter().zip(scores).filter_map(|(begin, score)| Some(Begin { score: score?, ..begin }));
    let judged: Vec<Begin> = judged.collect();
    let best_at = |onset_s: &f64| {
        let there = judged.iter().filter(|begin| begin.onset_s == *onset_s);
        there.max_by(|a, b| a.score.total_cmp(&b.score)).cloned()
    };
    Some(onsets_s.iter().filter_map(best_at).collect())
}

/// Whether dry friction may hold what the base's plant moves.
fn may_be_held(base: &Base<'_>) -> bool {
    base.fit.hypothesis.model.physics.iter().any(Term::is_dry_friction)
}

/// How the innovations answer, sample after sample, to a unit step on the drive (on y for a sensor), in the drive's (y's) scale.
fn step_answer(base: &Base<'_>, weight: Weight) -> Option<Vec<f64>> {
    let kind = Kind::named(if weight == Weight::Sensor { "sensor_bias" } else { "load_step" }).ok()?;
    let hypothesis = wider(base, kind, neutral(kind));
    let from = hypothesis.widen(&base.fit.hypothesis, &base.fit.point);
    let length = base.faulty().next()?.1.len();
    let middle = length / 2 + SETTLING;
    let ts = hypothesis.model.sample_time_s;
    let level = TRIAL
        * if weight == Weight::Sensor {
            base.fit.hypothesis.scales.y
        } else {
            base.fit.hypothesis.scales.drive
        };
    let stepped = |level: f64| {
        let point = hypothesis.started(&from, &Start::of(vec![level]), middle as f64 * ts);
        // What dry friction holds does not answer: the answer is that of what slides.
        let (sliding, point) = hypothesis.without_dry_friction(point);
        base.rows(&sliding, &point)
    };
    let rows = stepped(level)?;
    let without = if may_be_held(base) { &stepped(0.0)?.z } else { &base.fit.rows.z };
    let difference = rows.z.iter().zip(without).take(length).skip(middle);
    let mut answer: Vec<f64> = difference.map(|(a, b)| (a - b) / TRIAL).collect();
    let tail = answer.iter().rev().take(50);
    let last = tail.clone().sum::<f64>() / tail.count().max(1) as f64;
    answer.resize(length, last);
    Some(answer)
}

/// The answer to an impulse, from that to a step.
pub fn impulse_of(step: &[f64]) -> Vec<f64> {
    let changes = step.windows(2).map(|p| p[1] - p[0]);
    step.first().copied().into_iter().chain(changes).collect()
}

/// For every sample the fall of the squares that a step (a ramp) from there on promises, after all that the base's own numbers can take up of it.
fn promises(base: &Base<'_>, weight: Weight, answer: &[f64], ramp: bool) -> Option<Vec<f64>> {
    let over_time = base.rest_over_time()?;
    let matched = Matched::new(base, &over_time.spectrum, (weight, ramp), answer)?;
    let along = matched.along(&over_time.rest)?;
    let mut power = matched.power(answer)?;
    let whole = power.clone();
    for direction in &over_time.directions {
        let taken = matched.along(direction)?;
        power.iter_mut().zip(taken).for_each(|(power, taken)| *power -= taken * taken);
    }
    let least = 1e-6 * whole.iter().copied().fold(0.0, f64::max);
    let left =
        power.iter().zip(&whole).map(|(left, whole)| left.max(LEAST_LEFT * whole).max(least).max(1e-300));
    Some(along.iter().zip(left).map(|(along, left)| along * along / left).collect())
}

/// A filter matched to the answers to a step (a ramp) that begins at any sample of the recordings that are no healthy ones.
struct Matched<'a> {
    spectrum: &'a Spectrum,
    /// Of the answer to an impulse.
    impulse: Vec<Complex<f64>>,
    /// Samples of each recording, and what acts there where that is not the same all the time.
    parts: Vec<(usize, Option<Vec<f64>>)>,
    ramp: bool,
    /// Samples of an answer.
    samples: usize,
}

impl<'a> Matched<'a> {
    fn new(
        base: &Base<'_>,
        spectrum: &'a Spectrum,
        (weight, ramp): (Weight, bool),
        answer: &[f64],
    ) -> Option<Self> {
        let samples = answer.len();
        let impulse = spectrum.of(&impulse_of(answer))?;
        let is_steady = ramp || matches!(weight, Weight::Load | Weight::Sensor);
        let part = |(signals, length): (&Signals, usize)| {
            let acts = if is_steady { None } else { Some(acting(base, weight, signals, samples)?) };
            Some((length, acts))
        };
        let parts: Option<Vec<_>> =
            base.faulty().map(|(signals, range)| (signals, range.len())).map(part).collect();
        Some(Self { spectrum, impulse, parts: parts?, ramp, samples })
    }

    /// The products of the answers with rows, of which each recording's spectrum is given.
    fn along(&self, rows: &[Vec<Complex<f64>>]) -> Option<Vec<f64>> {
        let mut sum = vec![0.0; self.samples];
        for (of_recording, (_, acting)) in rows.iter().zip(&self.parts) {
            let matched = of_recording.iter().zip(&self.impulse).map(|(z, h)| z * h.conj()).collect();
            let matched = self.spectrum.signal(matched)?;
            let matched = matched.get(..self.samples)?;
            if let Some(acting) = acting {
                let weighted: Vec<f64> = acting.iter().zip(matched).map(|(v, q)| v * q).collect();
                add(&mut sum, &from_here(&weighted));
                continue;
            }
            let once = from_here(matched);
            if self.ramp {
                let ramped: Vec<f64> = from_here(&once).iter().zip(&once).map(|(a, b)| a - b).collect();
                add(&mut sum, &ramped);
            } else {
                add(&mut sum, &once);
            }
        }
        Some(sum)
    }

    /// The squares of the answers.
    fn power(&self, answer: &[f64]) -> Option<Vec<f64>> {
        let last = answer.last().copied().unwrap_or(0.0);
        let transient: f64 = answer.iter().map(|a| (a - last) * (a - last)).sum();
        let mut grown = 0.0;
        let squares: Vec<f64> = if self.ramp {
            let sums = answer.iter().map(|a| {
                grown += a;
                grown * grown
            });
            sums.collect()
        } else {
            answer.iter().map(|a| a * a).collect()
        };
        let mut power = vec![0.0; self.samples];
        for (length, acting) in &self.parts {
            let Some(acting) = acting else {
                add(&mut power, &reversed_sums(squares.get(..*length)?));
                continue;
            };
            let acted = self.spectrum.of(acting)?;
            let answered =
                self.spectrum.signal(acted.iter().zip(&self.impulse).map(|(v, h)| v * h).collect())?;
            let squares: Vec<f64> = answered.get(..self.samples)?.iter().map(|a| a * a).collect();
            add(&mut power, &from_here(&squares));
            let at_once: Vec<f64> = acting.iter().map(|v| 0.5 * v * v * transient).collect();
            add(&mut power, &at_once);
        }
        Some(power)
    }
}

/// What acts, in units of the drive's scale.
fn acting(base: &Base<'_>, weight: Weight, signals: &Signals, n: usize) -> Option<Vec<f64>> {
    let hypothesis = &base.fit.hypothesis;
    let model = hypothesis.realise(&base.fit.point)?.model;
    let drive = hypothesis.scales.drive;
    let ts = model.sample_time_s;
    let late = (model.plant.delay_s() / ts) as usize;
    let gain = model.plant.drive_gain() * plant_gain(hypothesis, base);
    let actuator = |i: usize| gain * signals.u.get(i.saturating_sub(late)).copied().unwrap_or(0.0) / drive;
    let viscous = match &model.plant {
        Plant::Servo(servo) => servo.viscous,
        _ => 0.0,
    };
    let speeds = speeds(&model.plant, signals);
    let friction = |i: usize| viscous * speeds.get(i).copied().unwrap_or(0.0) / drive;
    let y = held(&signals.y);
    let of = |i: usize| match weight {
        Weight::Drive => actuator(i),
        Weight::Viscous => friction(i),
        Weight::Acceleration => actuator(i) - friction(i),
        Weight::Output => y.get(i).copied().unwrap_or(0.0) / hypothesis.scales.y,
        Weight::Load | Weight::Sensor => 1.0,
    };
    let length = signals.len().min(n);
    Some((0..n).map(|i| if i < length { of(i) } else { 0.0 }).collect())
}

/// Plants that state no gain of their own drive carry it in their numbers.
fn plant_gain(hypothesis: &Hypothesis, base: &Base<'_>) -> f64 {
    let is_gain = |i: usize| hypothesis.numbers.get(i).is_some_and(|number| number.name == "gain");
    let found = hypothesis.free.iter().zip(&base.fit.point.x).find_map(|(free, x)| match free.target {
        Target::Plant(i) if is_gain(i) && matches!(hypothesis.model.plant, Plant::StateSpace(_)) => {
            Some(free.value(*x))
        }
        _ => None,
    });
    found.unwrap_or(1.0)
}

/// The speed: y, or its smoothed slope.
fn speeds(plant: &Plant, signals: &Signals) -> Vec<f64> {
    let y = held(&signals.y);
    match plant {
        Plant::Servo(servo) if servo.output == Output::Position => {
            let half = SPEED_SAMPLES / 2;
            let at = |i: usize| y.get(i.min(y.len() - 1)).copied().unwrap_or(0.0);
            (0..y.len())
                .map(|i| {
                    let (low, high) = (i.saturating_sub(half), (i + half).min(y.len() - 1));
                    (at(high) - at(low)) / ((high - low).max(1) as f64 * signals.sample_time_s)
                })
                .collect()
        }
        _ => y,
    }
}

fn add(sum: &mut [f64], x: &[f64]) {
    sum.iter_mut().zip(x).for_each(|(sum, x)| *sum += x);
}

/// For each sample the sum from there to the end.
fn from_here(x: &[f64]) -> Vec<f64> {
    let backwards: Vec<f64> = x.iter().rev().copied().collect();
    reversed_sums(&backwards)
}

/// The running sum, backwards: what is left of it after a sample.
fn reversed_sums(x: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut out: Vec<f64> = x
        .iter()
        .map(|x| {
            sum += x;
            sum
        })
        .collect();
    out.reverse();
    out
}
