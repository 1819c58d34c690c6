//! A load that jumps now and then is noise of another kind than one that drifts: where nothing is known of it, friction, a rate limit or a plant that changes seem to explain why
//! nothing moves between two jumps. Jumps are looked for beside the plant alone and beside the kinds that lead, one after the other; the likeliest of these, jumps and all, tells when
//! the load jumps, and every kind is judged anew beside those jumps. The numbers that decide here were chosen on the 63 loops of `tests/cases/run` 9301 to 9303 whose load jumps, and on a servo
//! trainer's real set-point steps.

use crate::cores::AcrossCores as _;

use crate::estimate::fit::Fit;
use crate::estimate::inner_product::dot;
use crate::estimate::jumps::{Jumps, answer};
use crate::estimate::likelihood::Data;
use crate::estimate::signals::{Signals, range};
use crate::physics::{Kind, Place, Term};
use crate::stage;

use super::comes_and_goes;
use super::decide::priced;
use super::load_noise::{judged_again, looked_beside, price_of_two, refitted};
use super::options::Options;
use super::plants::Identified;
use super::rivals::{Field, begins_at_once, shared_point};

/// Log-likelihood that a jump promises at least beside the choice of its time, which costs the logarithm of the samples.
const PROMISES: f64 = 5.0;
/// Fewer jumps are no noise: a load that jumps once is a load that jumps.
const LEAST: usize = 3;
/// Rounds in which jumps are looked for.
const ROUNDS: usize = 6;
/// Part of what the largest jump of a round promises that another one must promise to be taken in the same round.
const PART: f64 = 0.1;
/// Samples for each jump of a recording, at least: what jumps more often drifts.
const APART: usize = 100;
/// How many times the others' deviation a jump is no jump like the others, and is left to be named.
const OUTLIER: f64 = 4.0;

/// A jump of the load.
#[derive(Debug, Clone, Copy)]
struct Jump {
    recording: usize,
    at: usize,
    /// In the drive's unit.
    size: f64,
    /// Log-likelihood that it promises.
    promise: f64,
}

/// A fit under a load that jumps.
struct Jumping {
    fit: Fit,
    jumps: Vec<Jump>,
    /// Its [`price`].
    price: f64,
}

impl Jumping {
    fn new(fit: Fit, jumps: Vec<Jump>, data: &Data) -> Self {
        let price = price(&fit, &jumps, data);
        Self { fit, jumps, price }
    }
}

/// What a load that jumps leads to.
pub struct TakenUp {
    /// The search's plant and field, under its jumps where these are noise.
    pub found: Identified,
    pub field: Field,
    /// The load of one level that comes and goes, where that is what jumps most and was looked for.
    pub comes_and_goes: Vec<Term>,
}

/// The search's plant and field under a load that jumps, where that is likelier than any kind without. What proves is searched for jumps as well, which no guarantee allows.
pub fn taken_up(found: Identified, field: Field, may_come_and_go: bool, options: &Options) -> TakenUp {
    let as_it_was = |(found, field)| TakenUp { found, field, comes_and_goes: Vec::new() };
    if options.guarantee.is_some() {
        return as_it_was((found, field));
    }
    stage::begins("jumps of the load", 0);
    let Some(jumping) = likeliest(&found.data, &field, options) else { return as_it_was((found, field)) };
    let comes_and_goes =
        may_come_and_go.then(|| comes_and_goes_in(&jumping, &field.base, &found.data, options)).flatten();
    let Jumping { fit, jumps, price } = jumping;
    let jumps = without_outliers(jumps, found.data.recordings.len());
    let is_often = seen(&jumps, &found.data) >= LEAST;
    let are_noise = is_often && !is_on_and_off(&jumps) && price <= price_of_two(&field, &found.data, options);
    let again = are_noise.then(|| {
        let jumps = as_jumps(&jumps, &found.data, fit.rows.sensor_sd);
        let data = found.data.clone().jumping(jumps);
        judged_again(&fit, data, (&found, &field, looked_beside(&field, is_jump)), options)
    });
    let again = again.flatten().map(|(found, field)| {
        let data = with_unseen(found.data.clone(), &field);
        (Identified { data, ..found }, field)
    });
    let (found, field) = again.unwrap_or((found, field));
    TakenUp { found, field, comes_and_goes: comes_and_goes.unwrap_or_default() }
}

/// Parts of the largest jump from which on another one belongs to what comes and goes: the levels of a load that jumps by chance differ more. One of them may be as large as an edge, and is left
/// out by the second part, where each edge is then a jump.
const ALIKE_PARTS: [(f64, bool); 2] = [(0.5, true), (0.75, false)];

/// What comes and goes in the first recording, if its largest jumps are those of one level that does, and this, the other jumps beside it, is likelier than jumps that are
/// noise, all of them. A kind that leads may have taken up an edge, which the base's own jumps have. In other recordings it has other times: these take no part.
fn comes_and_goes_in(jumping: &Jumping, base: &Fit, data: &Data, options: &Options) -> Option<Vec<Term>> {
    let of_base = (!jumping.fit.hypothesis.candidates().is_empty())
        .then(|| jumping_beside(Jumping::new(base.clone(), Vec::new(), data), data, f64::INFINITY))
        .flatten();
    let data = &comes_and_goes::of_first(data);
    let mut edges_of: Vec<Vec<usize>> = Vec::new();
    let mut ways: Vec<(f64, Vec<Term>)> = Vec::new();
    for of in std::iter::once(jumping).chain(&of_base) {
        let jumps = of_first(&of.jumps);
        for (part, may_miss) in ALIKE_PARTS {
            let (edges, others) = edges_and_others(&jumps, part);
            let at: Vec<usize> = edges.iter().map(|jump| jump.at).collect();
            if at.is_empty() || edges_of.contains(&at) {
                continue;
            }
            edges_of.push(at);
            ways.extend(coming_and_going(of, (&edges, &others, may_miss), base, data, options));
        }
    }
    let (with, terms) = ways.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let jumps = of_first(&jumping.jumps);
    let all = data.clone().jumping(as_jumps(&jumps, data, jumping.fit.rows.sensor_sd));
    let as_noise = price(&refitted(&jumping.fit, &all)?, &jumps, data);
    (with < as_noise).then_some(terms)
}

/// Jumps that are larger than this part of the largest, and those that are not.
fn edges_and_others(jumps: &[Jump], part: f64) -> (Vec<Jump>, Vec<Jump>) {
    let largest = jumps.iter().map(|jump| jump.size.abs()).fold(0.0, f64::max);
    jumps.iter().copied().partition(|jump| jump.size.abs() > part * largest)
}

/// What comes and goes by these edges, of which some may be missing, the other jumps beside it, and its [`price`].
fn coming_and_going(
    of: &Jumping,
    (edges, others, may_miss): (&[Jump], &[Jump], bool),
    base: &Fit,
    data: &Data,
    options: &Options,
) -> Option<(f64, Vec<Term>)> {
    // What comes and goes has bent the numbers of a base without jumps.
    let base = Fit::at(&base.hypothesis, &shared_point(base, &of.fit), data)?;
    let at: Vec<(usize, f64)> = edges.iter().map(|jump| (jump.at, jump.size)).collect();
    let mut ways = comes_and_goes::by_jumps(&at, &base, data);
    ways.retain(|way| may_miss || way.is_shown());
    let terms = comes_and_goes::likeliest_of(ways, &base, data, options.least_gain);
    if terms.is_empty() {
        return None;
    }
    let beside = data.clone().jumping(as_jumps(others, data, of.fit.rows.sensor_sd));
    let with = comes_and_goes::beside(&base.on(&beside)?, &terms, &beside, options.least_gain)?;
    Some((price(&refitted(&with, &beside)?, others, data), terms))
}

/// Those of the first recording.
fn of_first(jumps: &[Jump]) -> Vec<Jump> {
    jumps.iter().filter(|jump| jump.recording == 0).copied().collect()
}

/// The likeliest of base and leading kinds with the jumps that each asks for, where it is likelier than all of them without.
fn likeliest(data: &Data, field: &Field, options: &Options) -> Option<Jumping> {
    let begun =
        looked_beside(field, is_jump).into_iter().map(|fit| Jumping::new(fit.clone(), Vec::new(), data));
    let begun: Vec<Jumping> = begun.collect();
    let without = begun.iter().map(|begun| begun.price).fold(f64::INFINITY, f64::min);
    let (first, others): (Vec<Jumping>, Vec<Jumping>) =
        begun.into_iter().partition(|begun| begun.price <= without);
    let first = first.into_par_iter().filter_map(|begun| jumping_beside(begun, data, f64::INFINITY));
    let mut jumping: Vec<Jumping> = first.collect();
    let reached = jumping.iter().map(|jumping| jumping.price).fold(without, f64::min);
    let others = others.into_par_iter().filter_map(|begun| jumping_beside(begun, data, reached));
    jumping.extend(others.collect::<Vec<_>>());
    let best = jumping.into_iter().min_by(|a, b| a.price.total_cmp(&b.price))?;
    (best.price < without - options.margin).then_some(best)
}

/// A load that jumps once is one of the jumps.
pub fn is_jump(kind: &Kind) -> bool {
    kind.place == Place::Disturbance && begins_at_once(kind)
}

/// A fit with the jumps that it asks for; `None` where their rounds seem to lead to no less than was reached elsewhere.
fn jumping_beside(mut best: Jumping, data: &Data, reached: f64) -> Option<Jumping> {
    let whole = data.whole();
    for left in (0..ROUNDS).rev() {
        let known = as_jumps(&best.jumps, &whole, best.fit.rows.sensor_sd);
        let Some(more) = promising(&best.fit, &whole.clone().jumping(known)) else { break };
        if more.is_empty() {
            break;
        }
        let mut jumps = best.jumps.clone();
        jumps.extend(more);
        let jumping = data.clone().jumping(as_jumps(&jumps, data, best.fit.rows.sensor_sd));
        let Some(fit) = refitted(&best.fit, &jumping) else { break };
        let now = Jumping::new(fit, jumps, data);
        if now.price >= best.price {
            break;
        }
        if now.price - left as f64 * (best.price - now.price) > reached {
            return None;
        }
        best = now;
    }
    Some(best)
}

/// The recordings with those jumps besides that their unseen samples ask for beside the base or the best kind of a field. The load that was to drift had made up for them until it was
/// found to jump; what explains all that is seen fails at the first that is not known.
fn with_unseen(mut data: Data, field: &Field) -> Data {
    let best = field.rivals.first().map(|rival| &rival.fit);
    for fit in best.into_iter().chain([&field.base]) {
        for _ in 0..ROUNDS {
            let more = promising(fit, &data.whole()).unwrap_or_default();
            let unseen: Vec<Jump> = more.into_iter().filter(|jump| !is_seen(jump, &data)).collect();
            if unseen.is_empty() {
                break;
            }
            let mut jumps = data.jumps().clone();
            jumps.at = jumping_at(&unseen, jumps.at);
            data = data.jumping(jumps);
        }
    }
    data
}

/// Jumps that promise enough beside a fit and those that the recordings know, the largest first.
fn promising(fit: &Fit, whole: &Data) -> Option<Vec<Jump>> {
    let rows = Fit::at(&fit.hypothesis, &fit.point, whole)?.rows;
    let answer = answer(&fit.hypothesis, &fit.point, whole)?;
    let mut sum = 0.0;
    let grown = |a: &f64| {
        sum += a * a;
        sum
    };
    let squares: Vec<f64> = answer.iter().map(grown).collect();
    let lasts = squares.iter().position(|part| *part > MOST_OF_AN_ANSWER * sum).unwrap_or(0) + 1;
    let variance = dot(&rows.z, &rows.z) / rows.count.max(1) as f64;
    // Rows are as many times larger than the innovations that an answer is of.
    let factor = libm::sqrt(variance) * fit.hypothesis.scales.noise / rows.sensor_sd;
    let mut found: Vec<Jump> = Vec::new();
    let mut first = 0;
    for (recording, signals) in whole.recordings.iter().enumerate() {
        let z = rows.z.get(first..first + signals.len())?;
        first += signals.len();
        let steps = steps(&signals.r, STEPS_OF_NOISE * fit.hypothesis.scales.noise);
        let of_recording = of_recording(recording, z, (&answer, &squares, lasts), variance);
        let own = of_recording.into_iter().filter(|jump| !comes_with(jump.at, &steps));
        found.extend(own.map(|jump| Jump { size: jump.size / factor, ..jump }));
    }
    found.sort_by(|a, b| b.promise.total_cmp(&a.promise));
    let least = PART * found.first().map_or(0.0, |best| best.promise);
    found.retain(|jump| jump.promise >= least);
    Some(found)
}

/// Part of its range by which the reference steps from one sample to the next, at least, and the same in deviations of the sensor's noise.
const STEP: f64 = 0.1;
const STEPS_OF_NOISE: f64 = 5.0;
/// Samples before and after such a step in which a jump counts as one that comes with it: what a model of the plant lacks jumps there, too.
const WITH_STEP: (usize, usize) = (5, 10);

/// Samples at which the reference steps.
fn steps(r: &[f64], least: f64) -> Vec<usize> {
    let (low, high) = range(r);
    let least = least.max(STEP * (high - low));
    let pairs = r.windows(2).enumerate();
    pairs.filter(|(_, pair)| (pair[1] - pair[0]).abs() > least).map(|(n, _)| n + 1).collect()
}

fn comes_with(at: usize, steps: &[usize]) -> bool {
    let (before, after) = WITH_STEP;
    let first = steps.partition_point(|step| step + after < at);
    steps.get(first).is_some_and(|step| *step <= at + before)
}

/// Part of an answer's squares after which it counts as over.
const MOST_OF_AN_ANSWER: f64 = 0.9;

/// Those of one recording, no two of them nearer than an answer lasts.
fn of_recording(
    recording: usize,
    z: &[f64],
    (answer, squares, lasts): (&[f64], &[f64], usize),
    variance: f64,
) -> Vec<Jump> {
    let bar = PROMISES + libm::log(z.len().max(2) as f64);
    let sum = squares.last().copied().unwrap_or(0.0);
    let mut promises: Vec<Jump> = (0..z.len())
        .map(|at| {
            let left = z.get(at..).unwrap_or(&[]);
            let along = dot(answer, left);
            let power = squares.get(left.len().min(answer.len()).saturating_sub(1)).copied().unwrap_or(0.0);
            let size = along / power.max(1e-300);
            let promise = if power > 0.5 * sum { 0.5 * along * size / variance } else { 0.0 };
            Jump { recording, at, size, promise }
        })
        .collect();
    let most = z.len() / APART;
    let mut found = Vec::new();
    while let Some(best) = promises.iter().max_by(|a, b| a.promise.total_cmp(&b.promise)).copied() {
        if best.promise < bar || found.len() == most {
            break;
        }
        found.push(best);
        let near = best.at.saturating_sub(lasts)..(best.at + lasts + 1).min(promises.len());
        promises.get_mut(near).unwrap_or(&mut []).iter_mut().for_each(|jump| jump.promise = 0.0);
    }
    found
}

/// Minus the log-likelihood of a fit, with what its candidate's numbers cost, and the choice of the times of those jumps that fits have seen.
fn price(fit: &Fit, jumps: &[Jump], data: &Data) -> f64 {
    let samples = |jump: &Jump| data.recordings.get(jump.recording).map_or(2, Signals::len) as f64;
    let times: f64 =
        jumps.iter().filter(|jump| is_seen(jump, data)).map(|jump| libm::log(samples(jump))).sum();
    0.5 * priced(fit) + times
}

/// How many of them fits have seen.
fn seen(jumps: &[Jump], data: &Data) -> usize {
    jumps.iter().filter(|jump| is_seen(jump, data)).count()
}

fn is_seen(jump: &Jump, data: &Data) -> bool {
    data.fitted.get(jump.recording).is_some_and(|fitted| jump.at < *fitted)
}

/// Without those that are far larger than the others; what begins in each recording does so once in each.
fn without_outliers(mut jumps: Vec<Jump>, recordings: usize) -> Vec<Jump> {
    jumps.sort_by(|a, b| a.size.abs().total_cmp(&b.size.abs()));
    let outliers_in = |jumps: &[Jump]| {
        (1..=recordings).find(|outliers| {
            let Some((others, apart)) =
                jumps.len().checked_sub(*outliers).and_then(|at| jumps.split_at_checked(at))
            else {
                return false;
            };
            let least = OUTLIER * deviation(others);
            others.len() >= LEAST && apart.iter().all(|jump| jump.size.abs() >= least)
        })
    };
    while let Some(outliers) = outliers_in(&jumps) {
        jumps.truncate(jumps.len() - outliers);
    }
    jumps
}

/// Whether a jump like the others is within this part of the middle one's size, and what part of them are where a signal comes and goes: the levels of a load that jumps by chance differ more.
const ALIKE: f64 = 0.25;
const MOST: f64 = 0.7;

/// Whether these are a signal that comes and goes: jumps of one size there and back. Sorted by their sizes.
fn is_on_and_off(jumps: &[Jump]) -> bool {
    let Some(middle) = jumps.get(jumps.len() / 2).map(|jump| jump.size.abs()) else { return false };
    let alike = jumps.iter().filter(|jump| (jump.size.abs() - middle).abs() < ALIKE * middle);
    let mut alike: Vec<&Jump> = alike.collect();
    alike.sort_by_key(|jump| (jump.recording, jump.at));
    let turns = alike.windows(2).filter(|pair| pair[0].size * pair[1].size < 0.0).count();
    let most = MOST * jumps.len() as f64;
    alike.len() as f64 > most && (turns + 1) as f64 > MOST * alike.len() as f64
}

fn deviation(jumps: &[Jump]) -> f64 {
    let squares: f64 = jumps.iter().map(|jump| jump.size * jump.size).sum();
    libm::sqrt(squares / jumps.len().max(1) as f64)
}

/// As filters are told them, beside a sensor noise of this deviation.
fn as_jumps(jumps: &[Jump], data: &Data, sensor_sd: f64) -> Jumps {
    let at = jumping_at(jumps, vec![Vec::new(); data.recordings.len()]);
    Jumps { at, ratio: deviation(jumps) / sensor_sd.max(1e-300) }
}

/// The samples of each recording at which the load jumps, with further ones.
fn jumping_at(further: &[Jump], mut at: Vec<Vec<usize>>) -> Vec<Vec<usize>> {
    for jump in further {
        if let Some(of_recording) = at.get_mut(jump.recording) {
            of_recording.push(jump.at);
        }
    }
    for of_recording in &mut at {
        of_recording.sort_unstable();
        of_recording.dedup();
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jump(recording: usize, at: usize, size: f64) -> Jump {
        Jump { recording, at, size, promise: 100.0 }
    }

    /// Four jumps of one size with small ones between: the four are edges.
    #[test]
    fn large_jumps_are_of_the_signal_and_small_ones_are_not() {
        let jumps = [(900, -2.0), (500, 2.1), (700, 0.6), (1_400, 1.8), (2_000, -2.2), (100, -0.9)];
        let jumps = jumps.map(|(at, size)| jump(0, at, size));
        let at = |jumps: &[Jump]| jumps.iter().map(|jump| jump.at).collect::<Vec<_>>();
        let (edges, others) = edges_and_others(&jumps, ALIKE_PARTS[0].0);
        assert_eq!((at(&edges), at(&others)), (vec![900, 500, 1_400, 2_000], vec![700, 100]));
    }

    /// Jumps of about 0.3 in two recordings, and one of 2.5 in each: of one recording its own alone would be left, of two both make each other look usual.
    #[test]
    fn a_step_of_each_recording_is_no_jump_like_the_others() {
        let small = [0.3, -0.4, 0.2, -0.3, 0.35].into_iter().enumerate();
        let mut jumps: Vec<Jump> = small.map(|(i, size)| jump(i % 2, 1_000 * i, size)).collect();
        jumps.extend([jump(0, 500, 2.5), jump(1, 500, 2.5)]);
        let kept = without_outliers(jumps.clone(), 2);
        assert_eq!(kept.len(), 5);
        assert!(kept.iter().all(|jump| jump.size.abs() < 1.0));
        assert_eq!(without_outliers(jumps.clone(), 1).len(), 7);
        // A load whose jumps are all alike has no other.
        jumps.iter_mut().for_each(|jump| jump.size = 1.0);
        assert_eq!(without_outliers(jumps, 2).len(), 7);
    }
}
