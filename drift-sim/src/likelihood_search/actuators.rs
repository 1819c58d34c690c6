//! What an actuator makes of u needs no plant to be computed: a valve that sticks, say, under a plant that is unknown. Each kind of actuator is judged by how
//! well a regression of y on what leaves the actuator foretells the next sample; a plant is then identified behind the likeliest of them. From u itself
//! it would be another plant, one that answers late and little.

use crate::cores::AcrossCores as _;
use nalgebra::{DMatrix, DVector};

use crate::control_loop::Loop;
use crate::estimate::inner_product::dot;
use crate::estimate::signals::{Signals, centred, held};
use crate::physics::{KINDS, Kind, Place, Scales, Starts, Term};
use crate::simulate::actuated;

use super::apart::apart;
use super::climb::{Steps, climb};
use super::needle;

/// Samples of all recordings that are enough to tell actuators apart.
const ENOUGH: usize = 8_000;
/// Past values of y and of what leaves the actuator in the regression.
const PAST_Y: usize = 8;
const PAST_U: usize = 12;
const MOST_PAST: usize = if PAST_U > PAST_Y { PAST_U } else { PAST_Y };
/// Samples in which a search finds where to begin: of the recording made coarser, and of its liveliest stretch as it is. Between coarser samples a valve slips too often to be
/// followed; a stretch is short beside a slow plant.
const FEW: usize = 2_000;
/// Points that a search climbs from in few samples, and in all: as many go on from each of the few.
const SEARCHED: usize = 12;
const GO_ON: usize = 4;
/// Part of the largest number by which two points are unlike.
const UNLIKE: f64 = 0.05;
/// Climbs from a grid.
const WIDE: Climbs = Climbs { steps: 60, reach: 0.15 };
/// Climbs from the points of every jump: as far as the points are apart, then as far as a peak is wide in the short stretch.
const CLOSER: Climbs = Climbs { steps: 120, reach: 0.02 };
const CLOSEST: Climbs = Climbs { reach: 0.005, ..CLOSER };
/// Log-likelihood by which a point must foretell y better than u itself for a search to begin there.
const WORTH: f64 = 3.0;
/// Log-likelihood by which an actuator must foretell y better than none: its numbers are the best of hundreds.
const LEAST_GAIN: f64 = 15.0;
/// States to either side of the middle in which a recording may have begun, and of each that slips in step with the best one.
const STATES: i32 = 24;
const STATES_IN_STEP: i32 = 8;
/// Times what was found that a narrow peak must gain: exact slips stand far out (two to five times in three loops of `tests/cases/run 9324 9333`); where a valve slips at another band each time, the best of
/// thousands is none.
const STANDS_OUT: f64 = 1.5;
/// Times that the search goes on to one that slips in step with the best one.
const AGAIN: usize = 3;
/// Actuators that go on.
const KEPT: usize = 2;

/// The likeliest actuators of unlike kinds, the best first; none where u itself does as well.
pub fn likeliest(model: &Loop, recordings: &[Signals], scales: &Scales) -> Vec<Term> {
    let recordings = liveliest(recordings, ENOUGH);
    let kinds: Vec<&'static Kind> = KINDS
        .iter()
        .copied()
        .filter(|kind| kind.place == Place::Actuator && kind.search.points(scales).is_some())
        .collect();
    let bare = Loop { physics: Vec::new(), ..model.clone() };
    let Some(judges) = Judges::new(&bare, &recordings) else { return Vec::new() };
    let mut found: Vec<Actuated> =
        kinds.into_par_iter().filter_map(|kind| judges.best_of(kind, scales)).collect();
    found.retain(|actuated| actuated.gain > LEAST_GAIN);
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    found.into_iter().take(KEPT).map(|actuated| actuated.term).collect()
}

/// The points of a kind that are tried; many more than by simulation where its likelihood is a narrow peak.
fn points(kind: &Kind, scales: &Scales) -> Option<Vec<Vec<f64>>> {
    if let Starts::Peak { dense, .. } = kind.search {
        return Some(dense(scales));
    }
    Some(kind.search.points(scales)?.into_iter().map(|start| start.parameters).collect())
}

/// The liveliest stretch of each recording, of so many samples together.
fn liveliest(recordings: &[Signals], samples: usize) -> Vec<Signals> {
    let most = samples / recordings.len().max(1);
    let part = |signals: &Signals| {
        let stretch = signals.liveliest(most);
        signals.part(stretch.start, stretch.end)
    };
    recordings.iter().map(part).collect()
}

/// Climbs of so many steps, with their reach.
#[derive(Clone, Copy)]
struct Climbs {
    steps: usize,
    reach: f64,
}

/// Those that find where to begin, and the one that decides.
struct Judges {
    first: Vec<Judge>,
    last: Judge,
}

impl Judges {
    fn new(bare: &Loop, recordings: &[Signals]) -> Option<Self> {
        let longest = recordings.iter().map(Signals::len).max().unwrap_or(0);
        let coarse = Judge::new(bare, recordings, longest.div_ceil(FEW));
        let short = Judge::new(bare, &liveliest(recordings, FEW), 1);
        let first = coarse.into_iter().chain(short).collect();
        Some(Self { first, last: Judge::new(bare, recordings, 1)? })
    }

    /// The best of a kind, from its own grid on: of each form by itself, for the points of one whose peak is wide would take the places of another's.
    fn best_of(&self, kind: &'static Kind, scales: &Scales) -> Option<Actuated> {
        let all = points(kind, scales)?;
        let forms = all.chunk_by(|a, b| kind.is_one_form(a, b));
        forms.filter_map(|points| self.best_from(kind, points)).max_by(|a, b| a.gain.total_cmp(&b.gain))
    }

    fn best_from(&self, kind: &'static Kind, points: &[Vec<f64>]) -> Option<Actuated> {
        let begun = self.first.iter().flat_map(|judge| judge.climbed(kind, points.to_vec(), WIDE, SEARCHED));
        let found = self.ended(kind, begun, WIDE)?;
        let other = self.of_every_jump(&found).filter(|other| other.gain > STANDS_OUT * found.gain);
        Some(other.unwrap_or(found))
    }

    /// The best of a kind whose peak is narrow, from every jump about what was found, for in a short stretch the peak is wide enough for a grid; then from one to the next of those that slip in
    /// step with it.
    fn of_every_jump(&self, found: &Actuated) -> Option<Actuated> {
        let kind = found.term.kind;
        let Starts::Peak { every_jump, in_step, .. } = kind.search else { return None };
        let short = self.first.last().filter(|_| found.gain > needle::LEAST_GAIN)?;
        let points = every_jump(&found.term.parameters);
        let begun = short.climbed(kind, points, CLOSER, SEARCHED);
        let mut best = self.ended(kind, begun, CLOSEST)?;
        if found.gain > best.gain {
            best = Actuated { term: found.term.clone(), gain: found.gain };
        }
        for _ in 0..AGAIN {
            let others = in_step(&best.term.parameters).into_iter();
            let others = others.flat_map(|parameters| states(kind, parameters, STATES_IN_STEP)).collect();
            let Some(other) = self.last.climbed(kind, others, CLOSEST, SEARCHED).into_iter().next() else {
                break;
            };
            if other.gain < best.gain + WORTH {
                break;
            }
            best = other;
        }
        Some(best)
    }

    /// The best one where climbs end that begin at these.
    fn ended(
        &self,
        kind: &'static Kind,
        begun: impl IntoIterator<Item = Actuated>,
        climbs: Climbs,
    ) -> Option<Actuated> {
        let begun = begun.into_iter().map(|actuated| actuated.term.parameters).collect();
        self.last.climbed(kind, begun, climbs, GO_ON).into_iter().next()
    }
}

/// A term as each recording tells it; one whose peak is narrow in the state in which that began. A slip leads to the next one, so that a stem that began elsewhere in its jump
/// goes on beside the true one.
pub fn in_each(term: &Term, model: &Loop, recordings: &[Signals], fitted: &[usize]) -> Vec<Term> {
    if !term.kind.search.is_peak() {
        return vec![term.clone(); recordings.len()];
    }
    let bare = Loop { physics: Vec::new(), ..model.clone() };
    let each = recordings.iter().zip(fitted);
    each.map(|(signals, fitted)| began(term, &bare, &signals.part(0, *fitted)).unwrap_or(term.clone()))
        .collect()
}

/// The term in the likeliest of the states in which a recording may have begun; none where the one that it was found with is about as likely.
fn began(term: &Term, bare: &Loop, signals: &Signals) -> Option<Term> {
    let judge = Judge::new(bare, std::slice::from_ref(signals), 1)?;
    let states = states(term.kind, term.parameters.clone(), STATES);
    let judged = states.into_par_iter().filter_map(|parameters| judge.judged(term.kind, parameters));
    let judged: Vec<Actuated> = judged.collect();
    let best = judged.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain))?;
    let as_found = judge.judged(term.kind, term.parameters.clone()).map_or(0.0, |found| found.gain);
    (best.gain > as_found + needle::LEAST_GAIN).then_some(best.term)
}

/// A kind's parameters with so many states to either side of the middle in which a recording may have begun; the same where it has no state.
fn states(kind: &'static Kind, parameters: Vec<f64>, sides: i32) -> Vec<Vec<f64>> {
    let term = Term { kind, parameters, onset_s: 0.0, spans: Vec::new() };
    let most = (0..kind.parameters.len()).find_map(|place| Some((place, term.most_of_state(place)?)));
    let Some((place, most)) = most else { return vec![term.parameters] };
    let with = |side: i32| {
        let mut parameters = term.parameters.clone();
        let state = most * f64::from(side) / f64::from(sides);
        parameters.iter_mut().skip(place).take(1).for_each(|value| *value = state);
        parameters
    };
    (-sides..=sides).map(with).collect()
}

/// The best ones of unlike numbers.
fn unlike(mut all: Vec<Actuated>, most: usize) -> Vec<Actuated> {
    all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    apart(all, most, Actuated::is_like)
}

/// An actuator that foretells y.
struct Actuated {
    term: Term,
    /// Log-likelihood that it gains in the regression.
    gain: f64,
}

impl Actuated {
    fn is_like(&self, other: &Self) -> bool {
        let (a, b) = (&self.term.parameters, &other.term.parameters);
        if !self.term.kind.is_one_form(a, b) {
            return false;
        }
        let largest = a.iter().chain(b).fold(0.0, |most: f64, x| most.max(x.abs()));
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < UNLIKE * largest)
    }
}

/// What actuators are judged by.
struct Judge {
    bare: Loop,
    of_each: Vec<Regression>,
}

impl Judge {
    fn new(bare: &Loop, recordings: &[Signals], every: usize) -> Option<Self> {
        let of_each: Option<Vec<Regression>> =
            recordings.iter().map(|recording| Regression::new(recording, every)).collect();
        of_each.map(|of_each| Self { bare: bare.clone(), of_each })
    }

    fn judged(&self, kind: &'static Kind, parameters: Vec<f64>) -> Option<Actuated> {
        let term = Term { kind, parameters, onset_s: 0.0, spans: Vec::new() };
        term.check().ok()?;
        let at_work = self.bare.clone().with(term.clone());
        let gains = self.of_each.iter().map(|regression| regression.gain(&actuated(&at_work, &regression.u)));
        let gain = gains.sum::<Option<f64>>()?;
        gain.is_finite().then_some(Actuated { term, gain })
    }

    /// Where climbs from these numbers of a kind end, from the best and so many at most; the best first.
    fn climbed(
        &self,
        kind: &'static Kind,
        from: Vec<Vec<f64>>,
        climbs: Climbs,
        most: usize,
    ) -> Vec<Actuated> {
        let judged = from.into_par_iter().filter_map(|parameters| self.judged(kind, parameters));
        let mut judged: Vec<Actuated> = judged.collect();
        judged.retain(|actuated| actuated.gain > WORTH);
        let judged = unlike(judged, most);
        let ended = judged.into_par_iter().enumerate().map(|(i, from)| self.search(from, climbs, i as u64));
        unlike(ended.collect(), GO_ON)
    }

    fn search(&self, from: Actuated, Climbs { steps: count, reach }: Climbs, seed: u64) -> Actuated {
        let kind = from.term.kind;
        let worth = |parameters: &[f64]| Some(self.judged(kind, parameters.to_vec())?.gain);
        let (parameters, gain) =
            climb(kind, (from.term.parameters.clone(), from.gain), Steps { count, reach, seed }, worth);
        Actuated { term: Term { parameters, ..from.term }, gain }
    }
}

/// The regression of a recording's y on its past and on the past of what drives the plant.
struct Regression {
    /// y less its mean.
    y: Vec<f64>,
    u: Vec<f64>,
    every: usize,
    /// Products of y with its own past.
    of_y: Products,
    /// Mean square of what u itself does not foretell.
    without: f64,
}

impl Regression {
    fn new(recording: &Signals, every: usize) -> Option<Self> {
        let y = centred(held(&recording.y).into_iter().step_by(every).collect());
        let of_y = Products::of_itself(&y, PAST_Y + 1)?;
        let mut regression = Self { y, u: recording.u.clone(), every, of_y, without: f64::NAN };
        regression.without = regression.error(&recording.u)?;
        Some(regression)
    }

    /// Log-likelihood that this drive gains over u itself.
    fn gain(&self, driving: &[f64]) -> Option<f64> {
        Some(0.5 * self.y.len() as f64 * libm::log(self.without / self.error(driving)?))
    }

    /// Mean square of what it does not foretell.
    fn error(&self, driving: &[f64]) -> Option<f64> {
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let driving = centred(driving.chunks(self.every).map(mean).collect());
        let of_both = Products::of(&self.y, &driving, PAST_Y + 1, PAST_U + 1)?;
        let of_driving = Products::of_itself(&driving, PAST_U + 1)?;
        let n = PAST_Y + PAST_U;
        // What is foretold comes first, then the past of y and the past of what drives.
        let product = |a: usize, b: usize| match (a.min(b), a.max(b)) {
            (a, b) if b <= PAST_Y => self.of_y.at(a, b),
            (a, b) if a <= PAST_Y => of_both.at(a, b - PAST_Y),
            (a, b) => of_driving.at(a - PAST_Y, b - PAST_Y),
        };
        let mut products = DMatrix::from_fn(n, n, |i, j| product(i + 1, j + 1));
        let with_y = DVector::from_fn(n, |i, _| product(0, i + 1));
        // A past that does not move at all adds nothing.
        let regular = 1e-12 * products.diagonal().amax();
        (0..n).for_each(|i| products[(i, i)] += regular);
        let solved = products.cholesky()?.solve(&with_y);
        let error = (self.of_y.at(0, 0) - solved.dot(&with_y)) / self.of_y.rows as f64;
        (error > 0.0).then_some(error)
    }
}

/// Sums over k of a[k - i] b[k - j]: each follows from the one before it on its diagonal by what enters and what leaves.
struct Products {
    of: DMatrix<f64>,
    /// How many k there are.
    rows: usize,
}

impl Products {
    /// Over all k with a whole past, of lags below these; `None` where there are too few of them.
    fn of(a: &[f64], b: &[f64], lags_a: usize, lags_b: usize) -> Option<Self> {
        Self::sums((a, b), (lags_a, lags_b), false)
    }

    /// The same of a signal with its own past.
    fn of_itself(a: &[f64], lags: usize) -> Option<Self> {
        Self::sums((a, a), (lags, lags), true)
    }

    /// Those of a signal with itself are the same either way, and summed once.
    fn sums((a, b): (&[f64], &[f64]), (lags_a, lags_b): (usize, usize), is_itself: bool) -> Option<Self> {
        let n = a.len().min(b.len());
        let rows = n.checked_sub(MOST_PAST).filter(|rows| *rows > PAST_Y + PAST_U)?;
        let at = |x: &[f64], k: usize| x.get(k).copied().unwrap_or(0.0);
        let direct = |i: usize, j: usize| {
            dot(a.get(MOST_PAST - i..n - i).unwrap_or(&[]), b.get(MOST_PAST - j..n - j).unwrap_or(&[]))
        };
        let mut of = DMatrix::zeros(lags_a, lags_b);
        for i in 0..lags_a {
            for j in 0..lags_b {
                of[(i, j)] = if is_itself && j < i {
                    of[(j, i)]
                } else if i == 0 || j == 0 {
                    direct(i, j)
                } else {
                    of[(i - 1, j - 1)] + at(a, MOST_PAST - i) * at(b, MOST_PAST - j)
                        - at(a, n - i) * at(b, n - j)
                };
            }
        }
        Some(Self { of, rows })
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.of[(i, j)]
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    use super::*;
    use crate::estimate::measure;
    use crate::estimate::noise::sequence;

    const BAND: f64 = 1.0;
    const JUMP: f64 = 0.31;

    /// A flow behind a valve, written out, from the middle of its life: the stem was so far above u. It stays until u is a band away from it, then goes to within the band less the jump of
    /// it; y follows with gain 2 and a lag of 5 samples, beside noise of a tenth of a jump. u swings slowly over three bands, and faster over a half.
    fn flow(stem_at_start: f64, seed: u64) -> Signals {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let noise = sequence(6_000, 0.06, 0.0, &mut random);
        let swing = |n: usize, period: f64| libm::sin(std::f64::consts::TAU * n as f64 / period);
        let u: Vec<f64> = (0..6_000).map(|n| 1.5 * swing(n, 700.0) + 0.25 * swing(n, 97.0)).collect();
        let mut stem = u[0] + stem_at_start;
        let mut level = 2.0 * stem;
        let y = u.iter().zip(noise).map(|(u, noise)| {
            let off = u - stem;
            if off.abs() > BAND {
                stem = u - (BAND - JUMP).copysign(off);
            }
            let shown = level + noise;
            level += (1.0 - libm::exp(-0.2)) * (2.0 * stem - level);
            shown
        });
        let y: Vec<f64> = y.collect();
        Signals { sample_time_s: 1.0, r: y.clone(), y, u, ..Signals::default() }
    }

    fn model() -> Loop {
        let text =
            "[loop]\nsample_time_s = 1.0\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"identify\"\n";
        Loop::parse(text, "a flow").unwrap()
    }

    /// No plant is known, and each recording begins elsewhere in the stem's way.
    #[test]
    fn a_valve_is_found_before_any_plant() {
        let recordings = vec![flow(0.9, 1), flow(-0.35, 2)];
        let scales = measure::scales(&model(), &recordings);
        let valve = likeliest(&model(), &recordings, &scales).remove(0);
        let (band, jump) = (valve.parameters[0], valve.parameters[1]);
        assert!(valve.kind.name == "stiction" && (band / BAND - 1.0).abs() < 0.01, "{valve:?}");
        assert!((jump / JUMP - 1.0).abs() < 0.02, "{valve:?}");
    }

    /// Where one stem began at 0.9 above u the other did at 0.35 below.
    #[test]
    fn another_recording_begins_elsewhere() {
        let recordings = [flow(0.9, 1), flow(-0.35, 2)];
        let numbers = [("stick_band", BAND), ("slip_jump", JUMP), ("stem_at_start", 0.9)];
        let valve = Term::new("stiction", &numbers).unwrap();
        let in_each = in_each(&valve, &model(), &recordings, &[6_000; 2]);
        let stems: Vec<f64> = in_each.iter().map(|term| term.parameters[2]).collect();
        // A whole jump more or less is as good.
        let off = (stems[1] + 0.35) / JUMP;
        assert!(stems[0] == 0.9 && (off - libm::round(off)).abs() < 0.25, "{stems:?}");
    }

    #[test]
    fn products_that_follow_from_others_are_the_direct_sums() {
        let wave = |per: f64| (0..90).map(|k| libm::sin(per * f64::from(k * k))).collect::<Vec<f64>>();
        let (a, b) = (wave(0.013), wave(0.02));
        let products = Products::of(&a, &b, 5, 7).unwrap();
        for i in 0..5 {
            for j in 0..7 {
                let direct: f64 = (MOST_PAST..90).map(|k| a[k - i] * b[k - j]).sum();
                assert!((products.at(i, j) - direct).abs() < 1e-12, "{i}, {j}");
            }
        }
        let itself = Products::of_itself(&a, 6).unwrap();
        for i in 0..6 {
            for j in 0..6 {
                let direct: f64 = (MOST_PAST..90).map(|k| a[k - i] * a[k - j]).sum();
                assert!((itself.at(i, j) - direct).abs() < 1e-12, "{i}, {j} of itself");
            }
        }
    }
}
