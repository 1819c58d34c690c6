//! When the mismatch acts, and on what it depends.
//!
//! Spans are stretches over which the refitted nominal model leaves more of y than the improved one, under the improved one's noise
//! model. Dependence is looked for in the missing drive: its mean over classes of a feature, learnt from every second block of
//! the recording, must predict the blocks between. Blocks are contiguous and long, so that the standard error over
//! them holds for a drive that is correlated from sample to sample.

use crate::control_loop::Loop;
use crate::plant::Plant;
use crate::sentences::Clock;

use super::Diagnosis;
use super::missing_drive::MissingDrive;
use super::motion;
use crate::estimate::signals::{Signals, mean_square};

/// Stretches that the recording is cut into to find spans.
const STRETCHES: usize = 64;
/// Standard errors from which a stretch is part of a span.
const SPAN_ERRORS: f64 = 5.0;
/// Blocks for dependence.
const BLOCKS: usize = 24;
/// Classes of a feature, each of as many samples.
const CLASSES: usize = 16;
/// Standard errors from which a dependence is told, and the part of the missing drive's variance that it must explain.
const LEAST_ERRORS: f64 = 3.0;
const LEAST_SHARE: f64 = 0.02;
/// Features told at most.
const MOST: usize = 3;
/// Spans told in words.
const TOLD: usize = 4;
/// Part of the best feature's share that a coarser one must have to be told in its place.
const NEARLY: f64 = 0.9;
/// What the share of u is worth against that of motion: in a closed loop u answers to the mismatch.
const AN_ANSWER: f64 = 0.7;
/// Part of the typical speed within which there is no direction.
const STILL: f64 = 0.05;

/// A stretch of time over which the mismatch shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MismatchSpan {
    /// Begin, s.
    pub from_s: f64,
    /// End, s.
    pub to_s: f64,
    /// In standard errors.
    pub score: f64,
}

/// What the missing drive depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct Dependence {
    /// direction, velocity, position (y of other plants: level), drive, amplitude (how far u is from its mean), time, or a
    /// measured input's name.
    pub on: String,
    /// Part of the missing drive's variance that it explains where it was not learnt, 0 to 1.
    pub share: f64,
    /// The same in standard errors over blocks.
    pub errors: f64,
}

/// The spans in which innovations `before` are larger than `white` ones, of which this share counts as independent.
pub(crate) fn stretches(before: &[f64], white: &[f64], share: f64, signals: &Signals) -> Vec<MismatchSpan> {
    let length = before.len().div_ceil(STRETCHES).max(1);
    let floor = mean_square(white).max(1e-300);
    let score = |stretch: &[f64]| {
        let ratio = mean_square(stretch) / floor;
        let samples = share * stretch.len() as f64;
        // Of a Gaussian variance, against that of the floor.
        if ratio > 1.0 { libm::sqrt(samples * (ratio - 1.0 - libm::log(ratio))) } else { 0.0 }
    };
    let mut found: Vec<MismatchSpan> = Vec::new();
    for (index, stretch) in before.chunks(length).enumerate() {
        let score = score(stretch);
        if score < SPAN_ERRORS {
            continue;
        }
        let at = |sample: usize| signals.origin_s + (sample as f64) * signals.sample_time_s;
        let (from_s, to_s) = (at(index * length), at(index * length + stretch.len()));
        match found.last_mut() {
            Some(last) if from_s - last.to_s < 1.5 * length as f64 * signals.sample_time_s => {
                last.to_s = to_s;
                last.score = libm::hypot(last.score, score);
            }
            _ => found.push(MismatchSpan { from_s, to_s, score }),
        }
    }
    found
}

/// What the missing drive depends on, the strongest first; each next one is judged by what those before leave.
pub fn depends_on(model: &Loop, missing: &MissingDrive, signals: &Signals) -> Vec<Dependence> {
    let mut left = missing.value.clone();
    let whole = variance(&left);
    if whole.is_nan() || whole <= 0.0 || left.len() < 4 * BLOCKS {
        return Vec::new();
    }
    let mut features = features_of(model, signals);
    let mut found = Vec::new();
    while found.len() < MOST {
        let judged: Vec<(usize, f64, f64)> = features
            .iter()
            .enumerate()
            .map(|(i, feature)| {
                let (gain, errors) = feature.predicts(&left);
                (i, gain / whole, errors)
            })
            .filter(|(_, share, errors)| *share > LEAST_SHARE && *errors > LEAST_ERRORS)
            .collect();
        let ranked = |j: &(usize, f64, f64)| {
            let answers = features.get(j.0).is_some_and(|feature| feature.answers);
            if answers { AN_ANSWER * j.1 } else { j.1 }
        };
        let Some(best) = judged.iter().map(ranked).max_by(f64::total_cmp) else { break };
        let near = judged.iter().filter(|j| ranked(j) >= NEARLY * best);
        let coarsest = near.min_by_key(|j| features.get(j.0).map_or(usize::MAX, |feature| feature.classes));
        let Some((index, share, errors)) = coarsest.copied() else { break };
        let feature = features.remove(index);
        let means = feature.means(&left, |_| true);
        for (value, class) in left.iter_mut().zip(&feature.class) {
            *value -= means.get(*class).copied().unwrap_or(0.0);
        }
        found.push(Dependence { on: feature.name, share, errors });
    }
    found
}

impl Diagnosis {
    /// When the mismatch shows and on what it depends, in words.
    pub fn located(&self, clock: &Clock, start_s: f64) -> Vec<(&'static str, String)> {
        // The refitted numbers are off before a fault begins, too: what is missing shows from then on.
        let onset_s = self.physics.first().map_or(0.0, |named| named.term.onset_s);
        let shown: Vec<&MismatchSpan> = self.spans.iter().filter(|span| span.to_s > onset_s).collect();
        let spans: Vec<String> = shown
            .iter()
            .take(TOLD)
            .map(|span| clock.span(start_s + span.from_s.max(onset_s), start_s + span.to_s))
            .collect();
        let more = shown.len().saturating_sub(TOLD);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        let on: Vec<String> = self
            .depends_on
            .iter()
            .map(|d| format!("{} ({:.0} % of the missing drive)", d.on, 100.0 * d.share))
            .collect();
        [("Shows", spans.join(", ") + &more), ("Depends on", on.join(", "))]
            .into_iter()
            .filter(|(_, what)| !what.is_empty())
            .collect()
    }
}

/// A quantity in classes, sample by sample.
struct Feature {
    name: String,
    class: Vec<usize>,
    classes: usize,
    /// Whether it answers to the mismatch in a closed loop, as u does.
    answers: bool,
    /// Which fold a sample belongs to.
    fold: fn(usize, usize) -> usize,
}

/// Whether a sample's block is an odd one.
fn by_block(sample: usize, samples: usize) -> usize {
    sample * BLOCKS / samples.max(1) % 2
}

/// Time repeats in no other block: it is learnt from the halves of each class.
fn by_half_class(sample: usize, samples: usize) -> usize {
    sample * 2 * (BLOCKS / 3) / samples.max(1) % 2
}

impl Feature {
    /// In classes of as many samples each.
    fn graded(name: &str, value: &[f64]) -> Self {
        let mut sorted: Vec<f64> = value.iter().copied().filter(|v| v.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let mut edges: Vec<f64> =
            (1..CLASSES).filter_map(|i| sorted.get(i * sorted.len() / CLASSES).copied()).collect();
        edges.dedup();
        let class = value.iter().map(|v| edges.partition_point(|edge| edge <= v)).collect();
        Self { name: name.to_owned(), class, classes: edges.len() + 1, answers: false, fold: by_block }
    }

    fn direction(speed: &[f64]) -> Self {
        let still = STILL * libm::sqrt(mean_square(speed));
        let class = speed.iter().map(|v| if *v > still { 2 } else { usize::from(*v >= -still) });
        Self { name: "direction".into(), class: class.collect(), classes: 3, answers: false, fold: by_block }
    }

    fn time(samples: usize) -> Self {
        let classes = BLOCKS / 3;
        let class = (0..samples).map(|i| i * classes / samples.max(1)).collect();
        Self { name: "time".into(), class, classes, answers: false, fold: by_half_class }
    }

    fn means(&self, value: &[f64], counts: impl Fn(usize) -> bool) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); self.classes];
        for (i, (v, class)) in value.iter().zip(&self.class).enumerate() {
            if counts(i)
                && let Some(sum) = sums.get_mut(*class)
            {
                sum.0 += v;
                sum.1 += 1.0;
            }
        }
        sums.into_iter().map(|(sum, count)| if count > 0.0 { sum / count } else { 0.0 }).collect()
    }

    /// (variance that the other fold's class means explain, in standard errors over blocks).
    fn predicts(&self, value: &[f64]) -> (f64, f64) {
        let n = value.len();
        let fold = |i: usize| (self.fold)(i, n);
        let learnt = [0, 1].map(|of| self.means(value, |i| fold(i) != of));
        let middle = value.iter().sum::<f64>() / n.max(1) as f64;
        let gain = |i: usize, v: f64| -> f64 {
            let of = fold(i);
            let mean = learnt.get(of).and_then(|means| means.get(*self.class.get(i)?)).copied();
            let without = v - middle;
            let with = v - mean.unwrap_or(0.0);
            without * without - with * with
        };
        let gains: Vec<f64> = value.iter().enumerate().map(|(i, v)| gain(i, *v)).collect();
        let length = n.div_ceil(BLOCKS).max(1);
        let blocks: Vec<f64> =
            gains.chunks(length).map(|block| block.iter().sum::<f64>() / block.len() as f64).collect();
        let count = blocks.len() as f64;
        let mean = blocks.iter().sum::<f64>() / count;
        let error = libm::sqrt(variance(&blocks) / (count - 1.0).max(1.0));
        (mean, mean / error.max(1e-300))
    }
}

fn variance(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    x.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / x.len().max(1) as f64
}

fn features_of(model: &Loop, signals: &Signals) -> Vec<Feature> {
    let (position, speed) = motion::motion(model, signals);
    let servo = matches!(model.plant, Plant::Servo(_));
    let middle = signals.u.iter().sum::<f64>() / signals.len().max(1) as f64;
    let amplitude: Vec<f64> = signals.u.iter().map(|u| (u - middle).abs()).collect();
    let mut all = vec![
        Feature::direction(&speed),
        Feature::graded("velocity", &speed),
        Feature::graded(if servo { "position" } else { "level" }, &position),
        Feature { answers: true, ..Feature::graded("drive", &signals.u) },
        Feature { answers: true, ..Feature::graded("amplitude", &amplitude) },
        Feature::time(signals.len()),
    ];
    let inputs = model.inputs.iter().zip(&signals.inputs);
    all.extend(inputs.map(|(input, value)| Feature::graded(&input.name(), value)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// A motor that swings at two frequencies, with a slowly wandering missing drive of `of` beside.
    fn missing(of: impl Fn(f64, f64, usize) -> f64, seed: u64) -> (Loop, MissingDrive, Signals) {
        let text = "[loop]\nsample_time_s = 0.01\n[controller]\nkind = \"pi\"\nkp = 1.0\nki = 1.0\n\
                    [plant]\nkind = \"servo\"\ninertia = 1.0\nviscous = 1.0\nactuator_gain = 1.0\noutput = \"speed\"\n";
        let model = Loop::parse(text, "loop.toml").unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let n = 6000;
        let speed: Vec<f64> = (0..n)
            .map(|i| libm::sin(0.02 * f64::from(i)) + 0.7 * libm::sin(0.0453 * f64::from(i) + 1.0))
            .collect();
        let (mut x, mut slow) = (0.0, 0.0);
        let value = speed.iter().enumerate().map(|(i, v)| {
            let normal: f64 = StandardNormal.sample(&mut random);
            slow = 0.99 * slow + 0.1 * normal;
            x += 0.01 * v;
            of(*v, x, i) + slow
        });
        let value: Vec<f64> = value.collect();
        let u = speed.iter().map(|v| 0.3 * v + 1.0).collect();
        let signals = Signals {
            sample_time_s: 0.01,
            start_s: 0.0,
            origin_s: 0.0,
            r: speed.clone(),
            y: speed,
            u,
            inputs: Vec::new(),
        };
        (model, MissingDrive { value, deviation: 0.1 }, signals)
    }

    fn names(of: impl Fn(f64, f64, usize) -> f64) -> Vec<String> {
        let (model, missing, signals) = missing(of, 1);
        depends_on(&model, &missing, &signals).into_iter().map(|d| d.on).collect()
    }

    #[test]
    fn dry_friction_depends_on_direction_drag_on_velocity_a_spring_on_position_a_step_on_time() {
        assert_eq!(names(|v, _, _| -2.0 * v.signum()).first().unwrap(), "direction");
        assert_eq!(names(|v, _, _| -2.0 * v * v.abs()).first().unwrap(), "velocity");
        assert_eq!(names(|_, x, _| -8.0 * x).first().unwrap(), "position");
        assert_eq!(names(|_, _, i| if i > 2500 { 2.0 } else { 0.0 }), ["time"]);
    }

    #[test]
    fn a_drive_that_wanders_by_itself_depends_on_nothing_but_time() {
        // Correlated over 100 samples: by samples, everything would look significant. Its own wandering is a dependence on time.
        let wrong = (0..200)
            .filter(|seed| {
                let (model, missing, signals) = missing(|_, _, _| 0.0, *seed);
                depends_on(&model, &missing, &signals).iter().any(|d| d.on != "time")
            })
            .count();
        println!("{wrong} of 200");
        assert!(wrong <= 4, "{wrong}");
    }
}
