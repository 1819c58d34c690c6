//! Where what plays or sticks was when a recording began: no recording shows it, and each has its own. The first one's is a number of the term, which the others share until one of their own
//! pays for a number.

use crate::cores::AcrossCores as _;
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::{Begun, Point, Target};
use crate::estimate::lanes::LANES;
use crate::estimate::likelihood::{Cache, Data, rows_at};

use super::decide::cost_of_numbers;

/// Values to either side of the middle that are tried first, of a needle's state more, for its likelihood repeats from jump to jump; and halvings of their distance about the best. Beside a
/// guessed plant a valve with numbers enough to choose from does what a motor's friction does.
const SIDES: i32 = 4;
const SIDES_OF_A_NEEDLE: i32 = 16;
const HALVINGS: usize = 5;

/// Log-likelihood that a state of its own must gain besides: beside a top a likelihood is ragged, and states that gain less lead away from it. Where recordings do begin apart, one state for all
/// cost 50 to 4 400 nats (`tests/cases/run 9322 9323`).
const RAGGED: f64 = 40.0;

/// Moves the states in which recordings begin to where they are likeliest, where that pays for the numbers that are free then.
pub fn settle(fit: &mut Fit, data: &Data) {
    let terms = fit.hypothesis.candidates().iter().enumerate();
    let states: Vec<(usize, usize)> = terms
        .flat_map(|(candidate, term)| {
            let parameters = term.kind.parameters.iter().enumerate();
            let states = parameters.filter(|(_, parameter)| parameter.state.is_some());
            let index = fit.hypothesis.stated + candidate;
            states.map(move |(parameter, _)| (index, parameter))
        })
        .collect();
    let recordings = data.of_the_fault();
    let Some(first) = recordings.first() else { return };
    // The first one's moves those that share it as well, then alone.
    let together = std::iter::once((*first, &recordings[..1]));
    let alone = recordings.iter().map(|recording| (*recording, &recordings[..]));
    let alone = alone.filter(|_| recordings.len() > 1);
    for (term, parameter) in states {
        for (recording, apart) in together.clone().chain(alone.clone()) {
            let state = State { term, parameter, recording, apart };
            if let Some(better) = state.settled(fit, data) {
                *fit = better;
            }
        }
    }
}

/// The state of a term in which a recording begins.
struct State<'a> {
    term: usize,
    parameter: usize,
    recording: usize,
    /// Recordings of which none follows another one.
    apart: &'a [usize],
}

impl State<'_> {
    /// The fit with this state at its likeliest; none where that does not pay.
    fn settled(&self, fit: &Fit, data: &Data) -> Option<Fit> {
        let realised = fit.hypothesis.realise(&fit.point)?;
        let term = realised.model.physics.get(self.term)?;
        let most = term.most_of_state(self.parameter)?;
        // Nothing that the filter's gains follow from changes with it.
        let near = Cache::at(&fit.hypothesis, &fit.point, data);
        let likeliest = |values: Vec<f64>| {
            let moved = values.into_iter().filter_map(|value| Some((value, self.moved(fit, value)?)));
            let (values, points): (Vec<f64>, Vec<Point>) = moved.unzip();
            let each = points.chunks(LANES).into_par_iter();
            let rows = each.map(|points| rows_at(&fit.hypothesis, points, data, &near));
            let objectives = rows.flatten().map(|rows| rows.map(|rows| rows.objective));
            let known = objectives.zip(values).filter_map(|(objective, value)| Some((objective?, value)));
            known.min_by(|a, b| a.0.total_cmp(&b.0))
        };
        let is_needle = term.kind.search.is_peak() && !fit.hypothesis.is_guessed;
        let count = if is_needle { SIDES_OF_A_NEEDLE } else { SIDES };
        let sides = (-count..=count).map(|side| most * f64::from(side) / f64::from(count));
        let mut best = likeliest(sides.chain([self.value(fit)?]).collect())?;
        let mut width = most / f64::from(count);
        for _ in 0..HALVINGS {
            width *= 0.5;
            let beside = [best.1 - width, best.1 + width].into_iter().filter(|value| value.abs() <= most);
            best = likeliest(beside.collect()).filter(|other| other.0 < best.0).unwrap_or(best);
        }
        let point = self.moved(fit, best.1)?;
        let more = point.begun.len().saturating_sub(fit.point.begun.len());
        let pays = 2.0 * more as f64 * (cost_of_numbers(1.0, fit.rows.count as f64) + RAGGED);
        (best.0 < fit.objective() - pays).then(|| Fit::at(&fit.hypothesis, &point, data))?
    }

    /// The state now.
    fn value(&self, fit: &Fit) -> Option<f64> {
        match fit.point.begun.iter().find(|begun| self.is_of(begun, self.recording)) {
            Some(begun) => Some(begun.value),
            None => {
                let term = fit.hypothesis.realise(&fit.point)?.model.physics.get(self.term)?.clone();
                term.parameters.get(self.parameter).copied()
            }
        }
    }

    /// The point with another state. Where it is the one that others share, they keep theirs.
    fn moved(&self, fit: &Fit, value: f64) -> Option<Point> {
        let mut point = fit.point.clone();
        if self.apart.first() != Some(&self.recording) {
            self.begin(&mut point, self.recording, value);
            return Some(point);
        }
        let shared = self.value(fit)?;
        for other in self.apart.iter().filter(|other| **other != self.recording) {
            if !point.begun.iter().any(|begun| self.is_of(begun, *other)) {
                self.begin(&mut point, *other, shared);
            }
        }
        let place = fit.hypothesis.place(Target::Term { term: self.term, parameter: self.parameter })?;
        *point.x.get_mut(place)? = fit.hypothesis.free.get(place)?.x_of(value);
        Some(point)
    }

    fn begin(&self, point: &mut Point, recording: usize, value: f64) {
        point.begun.retain(|begun| !self.is_of(begun, recording));
        point.begun.push(Begun { term: self.term, parameter: self.parameter, recording, value });
    }

    fn is_of(&self, begun: &Begun, recording: usize) -> bool {
        (begun.term, begun.parameter, begun.recording) == (self.term, self.parameter, recording)
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    use super::*;
    use crate::control_loop::Loop;
    use crate::estimate::noise::sequence;
    use crate::estimate::signals::Signals;
    use crate::likelihood_search::options::Options;
    use crate::likelihood_search::{self, nominal};
    use crate::physics::Term;

    const SAMPLES: usize = 3_000;
    const WIDTH: f64 = 1.0;

    /// A flow behind a drive with play, written out: what plays follows u at either edge of its gap, and began at this place of it; y follows with gain 2 and a lag of 10 samples.
    fn flow(place: f64, seed: u64) -> Signals {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let noise = sequence(SAMPLES, 0.02, 0.0, &mut random);
        let u: Vec<f64> = (0..SAMPLES).map(|n| 2.0 * libm::sin(n as f64 / 300.0)).collect();
        let mut plays = u[0] + 0.5 * WIDTH * place;
        let mut level = 2.0 * plays;
        let y = u.iter().zip(noise).map(|(u, noise)| {
            let shown = level + noise;
            plays = plays.max(u - 0.5 * WIDTH).min(u + 0.5 * WIDTH);
            level += (1.0 - libm::exp(-0.1)) * (2.0 * plays - level);
            shown
        });
        let y: Vec<f64> = y.collect();
        Signals { sample_time_s: 1.0, r: y.clone(), y, u, ..Signals::default() }
    }

    /// A fit to two such recordings that has them begin in the middle of the gap, settled.
    fn settled(places: [f64; 2]) -> Fit {
        let text = "[loop]\nsample_time_s = 1.0\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"first-order\"\ngain = 2.0\ntime_constant_s = 10.0\n";
        let model = Loop::parse(text, "a flow").unwrap();
        let recordings = vec![flow(places[0], 1), flow(places[1], 2)];
        let plain = likelihood_search::hypothesis(&model, &recordings, &Options::default());
        let data = Data::new(&plain, recordings, vec![SAMPLES; 2]);
        let play = Term::new("backlash", &[("width", WIDTH), ("place_at_start", 0.0)]).unwrap();
        let hypothesis = plain.with(play);
        let mut fit = nominal::fit_noise(&hypothesis, &data, &hypothesis.places_of(0)).unwrap();
        settle(&mut fit, &data);
        fit
    }

    fn first(fit: &Fit) -> f64 {
        fit.hypothesis.realise(&fit.point).unwrap().model.physics[0].parameters[1]
    }

    /// u comes down in the first recording before it begins and up in the second.
    #[test]
    fn each_recording_begins_where_it_did() {
        let fit = settled([0.8, -0.6]);
        assert!((first(&fit) - 0.8).abs() < 0.1, "{}", first(&fit));
        let [begun] = fit.point.begun.as_slice() else { panic!("{:?}", fit.point.begun) };
        assert!(begun.recording == 1 && (begun.value + 0.6).abs() < 0.1, "{begun:?}");
    }

    /// A state of its own costs a number: none is asked for by recordings that begin alike.
    #[test]
    fn recordings_that_begin_alike_share_a_number() {
        let fit = settled([0.7, 0.7]);
        assert!((first(&fit) - 0.7).abs() < 0.1 && fit.point.begun.is_empty(), "{:?}", fit.point);
    }
}
