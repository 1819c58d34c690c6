//! One model, one likelihood, one decision: the physics that a simulation left out.
//!
//! One pipeline, in [`diagnose`]: the recordings are cut into what a fit may see and what proves; the **law** is judged by its own error in
//! u (`law`); the plant's numbers and the noise, a slow random load among it, are fitted (`plants`, `nominal`); every kind of physics is fitted
//! beside them, all in one likelihood (`starts`, `rivals`, on [`crate::estimate`]); what can't be told from the best one is the **set**, and one
//! kind, or one family, that is left alone in it is named (`decide`); what was named must gain on what nothing has seen (`prove`). A second
//! effect is looked for beside the first (`search`). `conclude` makes the report, `simulates` holds it against a simulation of what nothing has seen, and `judge` says whether it stands. Numbers that
//! decide are in [`options`]. Where what is left is no noise of the kind that is reckoned with, or where the simulation says otherwise, `attempts` goes on: in coarser
//! samples, beside what comes and goes, from a motor that sticks and plays.

mod actuators;
mod all_samples;
mod alternatives;
mod apart;
mod attempts;
mod begun;
mod beside_friction;
mod climb;
mod comes_and_goes;
pub(crate) mod conclude;
pub(crate) mod decide;
mod drawn;
mod equal_onsets;
mod equation_error;
mod excitation;
mod found;
mod glance;
mod guarantee;
mod identified;
mod idle;
mod interval;
mod judge;
mod jumping_load;
mod law;
mod less_seen;
mod limit_cycle;
mod load_noise;
mod locate;
pub mod loop_likelihood;
mod missing_drive;
mod moved_by_disturbances;
mod needle;
pub(crate) mod nominal;
pub(crate) mod offset;
mod one_way;
pub mod options;
mod own_terms;
mod parts;
pub(crate) mod plants;
pub mod prove;
mod raggedness;
pub(crate) mod rivals;
mod search;
mod settled_onsets;
pub(crate) mod simulates;
mod spans;
mod standing_load;
mod starts;
mod steadiness;
mod sticking_motor;
mod swinging_load;
mod two_levels;
mod under_coloring;
pub(crate) mod units;
mod unseen;
mod wave_in_u;
mod without;

use crate::control_loop::Loop;
use crate::diagnose::Diagnosis;
use crate::estimate::first_look::coarser;
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Hypothesis;
use crate::estimate::lattice;
use crate::estimate::likelihood::Data;
use crate::estimate::measure;
use crate::estimate::signals::{Signals, deviation, held, range};
use crate::physics::Term;
use crate::plant::{Output, Plant};
use crate::stage;
pub use identified::{IdentifiedPlant, plants_of};

use attempts::{Attempt, Beside};
use decide::priced;
use found::Found;
use glance::{Glance, Round};
use judge::{Judge, Tried};
use jumping_load::TakenUp;
use options::Options;
use parts::Parts;
use plants::{Candidate, Identified};
use rivals::{Field, Sketch};
use search::Search;
use without::{without_all, without_others};

/// Diagnoses recordings of one loop, which share a likelihood, against what is stated of it; `None` where the loop can't be simulated beside them, or its law is another one.
pub fn diagnose(
    recordings: &[Signals],
    holdout: Option<&Signals>,
    nominal: &Loop,
    healthy: &[Signals],
    options: &Options,
) -> Option<Diagnosis> {
    attempts::best(&Case { recordings, holdout, nominal, healthy, options })
}

/// What is diagnosed.
#[derive(Clone, Copy)]
struct Case<'a> {
    recordings: &'a [Signals],
    holdout: Option<&'a Signals>,
    nominal: &'a Loop,
    healthy: &'a [Signals],
    options: &'a Options,
}

/// Recordings as one attempt searches them, and the loop as it samples them, its law mended.
struct Searched {
    parts: Parts,
    healthy: Vec<Signals>,
    model: Loop,
    /// The sign of an unknown plant's gain, as the own samples tell it.
    direction: f64,
}

impl Searched {
    /// The mean of so many samples as one.
    fn of(parts: &Parts, healthy: &[Signals], model: &Loop, factor: usize) -> Self {
        Self {
            parts: parts.in_coarser_samples(factor),
            healthy: coarser(healthy, factor),
            model: Loop { sample_time_s: factor as f64 * model.sample_time_s, ..model.clone() },
            direction: plants::direction(if healthy.is_empty() { &parts.recordings } else { healthy }),
        }
    }

    /// The stated plant's fit, or those of the likeliest plants.
    fn plants(&self, options: &Options) -> Vec<Identified> {
        let seen = (&self.parts.recordings[..], &self.parts.fitted[..]);
        plants::likeliest(&self.model, seen, &self.healthy, self.direction, options)
    }
}

impl Case<'_> {
    /// Whether neither a law that closes the loop is known nor a plant.
    fn is_guess(&self) -> bool {
        !self.nominal.has_law() && self.nominal.plant == Plant::Identify
    }

    /// Whether nothing is known but one loop's recordings, not even how it was when it was healthy.
    fn is_its_own_guess(&self) -> bool {
        self.is_guess() && self.healthy.is_empty()
    }

    /// One attempt, from the law to the trial; `None` where it can't be made.
    fn tried(&self, attempt: &Attempt) -> Option<Tried> {
        let Self { nominal, options, .. } = *self;
        let parts = Parts::new(self.recordings, self.holdout, options)?;
        stage::begins("the control law", 0);
        let law = law::examine(nominal, &parts.recordings);
        if law.is_another {
            return None;
        }
        let factor = attempt.factor;
        let searched = Searched::of(&parts, self.healthy, &law.model, factor);
        let judge = Judge::new(self, attempt, &law, &parts, &searched.parts);
        let (found, mut result) = self.searched(&searched, &attempt.beside)?;
        let comes_and_goes = std::mem::take(&mut result.comes_and_goes);
        if !comes_and_goes.is_empty() {
            let beside = self.beside(comes_and_goes, factor, true);
            // What is named in its place alone is not told by it.
            let is_told = |tried: &Tried| tried.stands && tried.found.comes_and_goes();
            if let Some(beside) = beside.filter(is_told) {
                return Some(beside);
            }
        }
        self.tried_in_turn(attempt, &judge, found, result)
    }

    /// The end of a search judged, and what takes its place where it does not stand.
    fn tried_in_turn(
        &self,
        attempt: &Attempt,
        judge: &Judge<'_>,
        mut found: Identified,
        mut result: Found,
    ) -> Option<Tried> {
        let mut tried = judge.judged(&found, result.clone(), None);
        // No colored noise is asked for where a simulation shows nearly all.
        if !(tried.stands && tried.is_sure) && attempt.beside == Beside::Nothing {
            let colored = under_coloring::searched(&found, &result, self.options);
            let again = colored.map(|(again, end)| (judge.judged(&again, end.clone(), None), again, end));
            if let Some(again) = again.filter(|(again, ..)| again.stands || !tried.stands) {
                (tried, found, result) = again;
            }
        }
        if result.quantum.is_some() && !(tried.stands && tried.is_sure) && attempt.beside == Beside::Nothing {
            let coarse = Attempt { beside: Beside::CoarseSensor, ..attempt.clone() };
            return self.tried(&coarse);
        }
        if tried.stands {
            return Some(tried);
        }
        if !attempt.is_further() {
            let alone = self.strongest_alone(&found, &result).map(|alone| judge.judged(&found, alone, None));
            if let Some(alone) = alone.filter(|alone| alone.stands) {
                return Some(alone);
            }
            let more = self.with_more(&found, &result).map(|more| {
                let (is_sure, least) = (more.is_noise, tried.found.unseen_fits().after);
                Tried { is_sure, ..judge.judged(&found, more, least) }
            });
            if let Some(more) = more.filter(|more| more.stands) {
                return Some(more);
            }
        }
        // Other numbers are no evidence for what is named beside them where they simulate worse by themselves.
        let least = judge.simulated(&conclude::loop_of(&result.base, self.nominal));
        let others = result.others(&found.data);
        others.map(|other| judge.judged(&found, other, least)).find(|other| other.stands).or(Some(tried))
    }

    /// The strongest of what a search named, alone: what it named beside that may be what leads a simulation astray.
    fn strongest_alone(&self, found: &Identified, result: &Found) -> Option<Found> {
        if result.named.len() < 2 {
            return None;
        }
        let named = result.named.iter().enumerate();
        let (strongest, choice) = named.max_by(|a, b| a.1.gain.total_cmp(&b.1.gain))?;
        let best = without_others(result.best.as_ref()?, Some(strongest), &found.data)?;
        let (best, named) = (Some(best), vec![choice.clone()]);
        let alone = Found { best, named, standing_load: None, ..result.clone() };
        let is_plant_open = self.is_plant_open(found);
        Search { data: &found.data, options: self.options, is_plant_open }.proven_alone(alone)
    }

    /// What a search named, with what it asks for beside that: a simulation shows what is missing, and less of a likelihood tells what it is.
    fn with_more(&self, found: &Identified, result: &Found) -> Option<Found> {
        let options = Options { further_gain: self.options.least_gain, ..self.options.clone() };
        let is_plant_open = self.is_plant_open(found);
        let search = Search { data: &found.data, options: &options, is_plant_open };
        let more = search.beside(result.base.clone(), result.best.clone()?, None);
        (more.named.len() > result.named.len()).then_some(more)
    }

    /// The attempt beside what comes and goes, in samples of so many. Its times are those of one recording: a hold-out of its own has other ones, and takes no part.
    fn beside(&self, terms: Vec<Term>, factor: usize, is_likeliest: bool) -> Option<Tried> {
        let duration_s = self.recordings.first()?.duration_s();
        let seen_of_recording = comes_and_goes::seen_part(&terms, duration_s, self.options.seen_of_recording);
        let options = Options { seen_of_recording, ..self.options.clone() };
        let attempt = Attempt { factor, beside: Beside::ComingAndGoing { terms, is_likeliest } };
        Case { options: &options, holdout: None, ..*self }.tried(&attempt)
    }

    /// The search beside what comes and goes; where that is likeliest, also beside what the load does else.
    fn searched_beside(
        &self,
        (terms, is_likeliest): (&[Term], bool),
        found: Identified,
        parts: &Parts,
        options: &Options,
    ) -> Option<(Identified, Found)> {
        let is_plant_open = self.is_plant_open(&found);
        let with = comes_and_goes::beside(&found.nominal, terms, &found.data, options.least_gain)?;
        if !is_likeliest {
            let search = Search { data: &found.data, options, is_plant_open };
            let result = search.beside(found.nominal.clone(), with, None);
            return Some((found, result));
        }
        let field = rivals::field(&with, &found.data, Round::Later(options.least_gain))?;
        let beside = Identified { nominal: with, ..found };
        let may_swing = self.may_swing(&beside, parts);
        let TakenUp { found: beside, field, .. } = under_its_load(beside, field, (may_swing, false), options);
        let base = gone_on(without_all(&field.base, &beside.data)?, &beside.data);
        let search = Search { data: &beside.data, options, is_plant_open };
        let result = search.beside(base.clone(), field.base.clone(), Some(field));
        Some((Identified { nominal: base, ..beside }, result))
    }

    /// Whether a plant was guessed, and no healthy recording tells how it was.
    fn is_plant_open(&self, found: &Identified) -> bool {
        found.is_guessed && self.healthy.is_empty()
    }

    /// Whether what swings beside a plant would show as such: what dry friction holds does not follow a wave.
    fn may_swing(&self, found: &Identified, parts: &Parts) -> bool {
        let may_stand =
            self.is_plant_open(found) || stands(&found.nominal.hypothesis.model.plant, &parts.recordings);
        !(may_stand && holds(&parts.recordings))
    }

    /// The search: the plant with its numbers, and what is named beside it.
    fn searched(&self, searched: &Searched, beside: &Beside) -> Option<(Identified, Found)> {
        let Searched { parts, healthy, model, .. } = searched;
        let options = self.options;
        stage::begins("the plant's own numbers", 0);
        if let Beside::StickingMotor { than } = *beside {
            let (found, with) = sticking_motor::beside_play(model, parts, options)?;
            if found.cost() + priced(&with) > than {
                return None;
            }
            let search = Search { data: &found.data, options, is_plant_open: true };
            let result = search.beside(found.nominal.clone(), with, None);
            return Some((found, result));
        }
        let plants = searched.plants(options);
        let is_guessed = plants.first()?.is_guessed;
        let is_plant_open = is_guessed && healthy.is_empty();
        let step = coarse_step(&parts.recordings, healthy, is_guessed);
        let is_stated = model.physics.iter().any(|term| term.kind.name == lattice::ROUNDING);
        let quantum =
            step.filter(|_| !is_stated).and_then(|step| Term::new(lattice::ROUNDING, &[("step", step)]).ok());
        let hides_noise = step.is_some_and(|step| lattice::hides_noise(&parts.recordings, step));
        if hides_noise || *beside == Beside::CoarseSensor {
            let found = plants.into_iter().next()?.refined()?;
            let search = Search { data: &found.data, options, is_plant_open };
            let result = Found { quantum, ..search.nominal_only(found.nominal.clone()) };
            return Some((found, result));
        }
        let options = &match quantum {
            Some(_) => Options { least_gain: options.least_gain.max(BESIDE_STEPS), ..options.clone() },
            None => options.clone(),
        };
        if let Beside::ComingAndGoing { terms, is_likeliest } = beside {
            let found = plants.into_iter().next()?.refined()?;
            return self.searched_beside((terms, *is_likeliest), found, parts, options);
        }
        let seen = (&parts.recordings[..], &parts.fitted[..]);
        let plants = plants::with_actuators(plants, model, seen.0, seen.1, (is_plant_open, options));
        let (found, first) = likeliest_with_physics(plants, options)?;
        let (found, first) = if is_plant_open {
            identified_again(found, first, model, parts, options)
        } else {
            (found, first)
        };
        // The steps of a coarse sensor have lines of their own.
        let may_swing = quantum.is_none() && self.may_swing(&found, parts);
        // Where waves may not be told from what a mass or an unknown plant does at rest, or from steps, neither explanation stands alone.
        let under_waves = (!may_swing)
            .then(|| swinging_load::instead(&found, &first, options))
            .flatten()
            .map(|(found, field)| Search { data: &found.data, options, is_plant_open }.run(field));
        // What comes and goes has the times of one recording.
        let may = (may_swing, self.recordings.len() == 1);
        let TakenUp { found, field, comes_and_goes } = under_its_load(found, first, may, options);
        let search = Search { data: &found.data, options, is_plant_open };
        let result = search.run_beside_own_terms(field);
        let result = match under_waves {
            Some(other) => result.agreed_with(&other),
            None => result,
        };
        let result = Found { quantum, comes_and_goes, ..result };
        Some((found, result))
    }
}

/// A field under what the load may do beside drifting: it swings, or it jumps, and among that comes and goes.
fn under_its_load(
    found: Identified,
    field: Field,
    (may_swing, may_come_and_go): (bool, bool),
    options: &Options,
) -> TakenUp {
    let (found, field) =
        if may_swing { swinging_load::taken_up(found, field, options) } else { (found, field) };
    if found.data.waves().count() > 0 {
        // What is left of waves seems to jump, and to come and go.
        return TakenUp { found, field, comes_and_goes: Vec::new() };
    }
    jumping_load::taken_up(found, field, may_come_and_go, options)
}

/// Whether the reference stays where it is.
fn holds(recordings: &[Signals]) -> bool {
    let moves = |signals: &Signals| {
        let (low, high) = range(&signals.r);
        high > low
    };
    !recordings.iter().any(moves)
}

/// Whether a plant is a mass that may stand where its reference does not move.
fn stands(plant: &Plant, recordings: &[Signals]) -> bool {
    let Plant::Servo(servo) = plant else { return false };
    let is_always_moving = |signals: &Signals| {
        let (low, high) = range(&held(&signals.y));
        low * high > 0.0
    };
    servo.output == Output::Position || !recordings.iter().all(is_always_moving)
}

/// Steps of the fits that go on under another noise, or on other samples.
const GOING_ON: usize = 10;

/// A fit a few steps on.
fn gone_on(mut fit: Fit, data: &Data) -> Fit {
    let fixed = rivals::stuck(&fit.hypothesis);
    fit.descend(data, GOING_ON, &fixed);
    fit
}

/// The plant that is likeliest together with one term beside it, or with none, and that field.
fn likeliest_with_physics(plants: Vec<Candidate>, options: &Options) -> Option<(Identified, Field)> {
    let least = options.least_gain + options.margin;
    let glances: Vec<(Identified, Glance)> =
        plants.into_iter().filter_map(|candidate| look_at(candidate, options)).collect();
    // Of unknown plants those go on that may be the likeliest with a kind beside them.
    let bounds: Vec<(f64, f64)> = glances.iter().map(|(plant, glance)| glance.bounds(plant.cost())).collect();
    let reached = bounds.iter().map(|(most, _)| *most).fold(f64::INFINITY, f64::min);
    let may_be = bounds.iter().map(|(_, least)| *least <= reached);
    let going_on = glances.into_iter().zip(may_be).filter_map(|(found, may_be)| may_be.then_some(found));
    let sketched = going_on.map(|(plant, glance)| {
        let sketch = glance.sketched(plant.data.look());
        (sketch.least_objective(least) + plant.cost(), plant, sketch)
    });
    let (_, plant, sketch) = sketched.min_by(|a, b| a.0.total_cmp(&b.0))?;
    refined(plant, sketch)
}

/// A sketch fitted to the end, and to all samples.
fn refined(plant: Identified, sketch: Sketch) -> Option<(Identified, Field)> {
    let field = sketch.finished(&plant.nominal, &plant.data)?;
    let nominal = field.base.clone();
    Some((Identified { nominal, ..plant }, field))
}

/// A look at every kind beside a plant, with what was found before.
fn look_at(Candidate { plant, offered }: Candidate, options: &Options) -> Option<(Identified, Glance)> {
    let mut glance = Glance::of(&plant.nominal, plant.data.look(), Round::First(options.least_gain))?;
    offered.into_iter().for_each(|(kind, fit)| glance.offer(kind, fit));
    Some((plant, glance))
}

/// Gain of the leading kind from which an unknown plant is identified anew beside it.
const LEADS: f64 = 15.0;

/// An unknown plant and its field; where a kind leads, identified anew beside that kind, if that is likelier: the plant was identified beside nothing,
/// and may have taken up what is missing.
fn identified_again(
    found: Identified,
    field: Field,
    model: &Loop,
    parts: &Parts,
    options: &Options,
) -> (Identified, Field) {
    let again = || {
        let leading = field.rivals.first().filter(|rival| field.gain(rival) > LEADS)?;
        let term = leading.fit.hypothesis.realise(&leading.fit.point)?.model.physics.pop()?;
        stage::begins("the plant's own numbers, beside what leads", 0);
        let candidate = plants::beside_leading(&term, model, &parts.recordings, &parts.fitted, options)?;
        let offered_at =
            candidate.offered.iter().map(|(_, fit)| fit.objective()).fold(f64::INFINITY, f64::min);
        let leading_at = objective_on_look(&leading.fit, &found.data)?;
        let is_likelier =
            offered_at + candidate.plant.cost() + 2.0 * options.margin < leading_at + found.cost();
        if !is_likelier {
            return None;
        }
        let (plant, glance) = look_at(candidate, options)?;
        let sketch = glance.sketched(plant.data.look());
        refined(plant, sketch)
    };
    again().unwrap_or((found, field))
}

/// A fit's objective where the first look at its data is, beside which those of other samples say nothing: a few steps on from where it ended on all of them.
fn objective_on_look(fit: &Fit, data: &Data) -> Option<f64> {
    if !data.has_first_look() {
        return Some(fit.objective());
    }
    Some(gone_on(fit.on_look(data)?, data.look()).objective())
}

/// Steps of a coarse sensor that y's deviation has at most where nothing is known of the plant: a converter has more.
const FEW_STEPS: f64 = 30.0;

/// Log-likelihood, after the cost of its numbers, from which something is missing beside a coarse sensor, whose steps are no noise. Lost gain on a level seemed to gain 15 beside one
/// (`tests/cases/run 9302`), what is there 40 and more.
const BESIDE_STEPS: f64 = 20.0;

/// The step of a coarse sensor: where the plant is stated, where healthy recordings show a finer one, or where y moves over few of its steps. Else it may have
/// been so all along.
fn coarse_step(recordings: &[Signals], healthy: &[Signals], is_guessed: bool) -> Option<f64> {
    let step = lattice::step(recordings).filter(|step| lattice::is_coarse(recordings, *step))?;
    let is_new = !healthy.is_empty() && lattice::step(healthy).is_none();
    let spread = recordings.iter().map(|signals| deviation(&held(&signals.y))).fold(0.0, f64::max);
    let is_coarse = healthy.is_empty() && lattice::rests(recordings) && spread < FEW_STEPS * step;
    (!is_guessed || is_new || is_coarse).then_some(step)
}

/// The nominal fit of a loop on data: what the search starts from.
fn hypothesis(model: &Loop, recordings: &[Signals], options: &Options) -> Hypothesis {
    Hypothesis::nominal(model, &measure::scales(model, recordings), &options.priors)
}
