//! One model, one likelihood, one decision: the physics that a simulation left out.
//!
//! One pipeline, in [`diagnose`]: the recordings are cut into what a fit may see and what proves; the **law** is judged by its own error in
//! u (`law`); the plant's numbers and the noise, a slow random load among it, are fitted (`plants`, `nominal`); every kind of physics is fitted
//! beside them, all in one likelihood (`starts`, `rivals`, on [`crate::estimate`]); what can't be told from the best one is the **set**, and one
//! kind, or one family, that is left alone in it is named (`decide`); what was named must gain on what nothing has seen (`prove`). A second
//! effect is looked for beside the first (`search`). `conclude` makes the report, and `simulates` holds it against a simulation of what nothing has seen. Numbers that
//! decide are in [`options`]. Where what is left is no noise of the kind that is reckoned with, or where the simulation says otherwise, `attempts` goes on: in coarser
//! samples, beside what comes and goes, from a motor that sticks and plays.

mod actuators;
mod all_samples;
mod alternatives;
mod apart;
mod attempts;
mod climb;
mod comes_and_goes;
pub(crate) mod conclude;
pub(crate) mod decide;
mod equal_onsets;
mod equation_error;
mod excitation;
mod glance;
mod guarantee;
mod identified;
mod idle;
mod interval;
mod lattice;
mod law;
mod limit_cycle;
mod locate;
pub mod loop_likelihood;
mod missing_drive;
mod needle;
pub(crate) mod nominal;
mod offset;
mod one_way;
pub mod options;
mod parts;
pub(crate) mod plants;
pub mod prove;
mod raggedness;
pub(crate) mod rivals;
mod search;
pub(crate) mod simulates;
mod spans;
mod standing_load;
mod starts;
mod sticking_motor;
mod two_levels;
pub(crate) mod units;
mod unseen;
mod wave_in_u;

use crate::control_loop::Loop;
use crate::controller::Controller;
use crate::diagnose::Diagnosis;
use crate::diagnose::prove::FitPct;
use crate::estimate::first_look::coarser;
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Hypothesis;
use crate::estimate::likelihood::Data;
use crate::estimate::measure;
use crate::estimate::signals::{Signals, deviation, held};
use crate::estimate::whiten::Whitener;
use crate::physics::Term;
use crate::sentences;
use crate::stage;
pub use identified::{IdentifiedPlant, plants_of};

use attempts::{Attempt, Beside};
use conclude::Conclusion;
use decide::COLORED;
use glance::{Glance, Round};
use options::Options;
use parts::Parts;
use plants::{Candidate, Identified};
use rivals::{Field, Sketch};
use search::{Found, Search};
use simulates::Trial;
use unseen::{Unseen, fit_pct};

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

/// A diagnosis, and whether it stands.
struct Tried {
    found: Diagnosis,
    stands: bool,
    /// Whether anything is named or placed that is neither of the law nor another number.
    names: bool,
    /// Whether its noise is none of the kind that is reckoned with in the recording's own samples, in which a likelihood then favours what is fast.
    is_refuted: bool,
    /// Whether it is what the search found, its noise being noise, its cycle the recorded one or its simulation close, and not what may stand in its place.
    is_sure: bool,
}

/// Recordings as one attempt searches them, and the loop as it samples them, its law mended.
struct Searched {
    parts: Parts,
    healthy: Vec<Signals>,
    model: Loop,
}

impl Searched {
    /// The mean of so many samples as one.
    fn of(parts: &Parts, healthy: &[Signals], model: &Loop, factor: usize) -> Self {
        Self {
            parts: parts.in_coarser_samples(factor),
            healthy: coarser(healthy, factor),
            model: Loop { sample_time_s: factor as f64 * model.sample_time_s, ..model.clone() },
        }
    }
}

impl Case<'_> {
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
        let (found, result) = self.searched(&searched, &attempt.beside)?;
        stage::begins("intervals and proof", 0);
        let has_law_terms = !law.terms.is_empty();
        let is_guessed = found.is_guessed;
        let is_open = nominal.controller == Controller::Recorded;
        let is_coarse = is_guessed && result.quantum.is_none() && lattice::rests(&searched.parts.recordings);
        let (train, unseen) = parts.shown();
        let simulated = |model: &Loop| match &unseen {
            Some(unseen) => unseen.fit(model),
            None => fit_pct(model, &train),
        };
        let judged = |result: Found, least: Option<FitPct>| {
            let fit = result.best.clone().unwrap_or_else(|| result.base.clone());
            let fit = parts.showing(&fit).unwrap_or(fit);
            let (is_noise, predicted) = (result.is_noise, result.predicted);
            let without = conclude::loop_of(&result.base, nominal);
            let is_any_named = result.best.is_some() || result.quantum.is_some();
            let conclusion = Conclusion {
                stated: nominal,
                law: law.clone(),
                train: &train,
                unseen: unseen.as_ref(),
                sensor_sd: fit.rows.sensor_sd,
                factor,
                not_used: parts.not_used,
                result,
                data: &found.data,
                is_guessed,
                options,
            };
            let concluded = conclusion.diagnosis();
            let (model, shown) = match &unseen {
                Some(unseen) if concluded.improved.controller == Controller::Recorded => {
                    unseen.first_behind_play(&concluded.improved)
                }
                _ => (concluded.improved.clone(), unseen.as_ref().map_or(&train, Unseen::first).clone()),
            };
            let trial = Trial {
                found: &concluded,
                fit: &fit,
                shown: &shown,
                model: &model,
                seen: &train,
                is_guessed,
                has_healthy: !self.healthy.is_empty(),
                coloring: found.data.coloring(),
                predicted,
                without: better(simulated(&without), least),
            };
            let is_nothing =
                !concluded.physics.is_empty() && concluded.physics.iter().all(sentences::may_be_nothing);
            // A simulation proves it whatever else is in y, unless the plant was guessed from the very u that drives it; so does a cycle that the loop makes with what was named, and not
            // without it.
            let is_own_guess = is_open && is_guessed && self.healthy.is_empty();
            let is_proven = trial.proves() && (is_noise || !is_own_guess);
            let is_sure =
                is_noise || trial.cycles_as_measured() || (is_proven && trial.explains_nearly_all());
            let is_shown = if !is_any_named {
                // The law is judged by its own error.
                is_noise || has_law_terms || trial.proves_numbers()
            } else if attempt.is_further() || least.is_some() {
                // What further attempts search shows less of what is left, and other numbers are none of the likelihood's: a simulation has to show what they led to.
                is_proven || (is_noise && trial.confirms())
            } else {
                is_sure || is_proven
            };
            let stands = is_shown
                && !is_coarse
                && !is_nothing
                && trial.passes()
                && (least.is_none() || trial.improves());
            Tried {
                found: concluded,
                stands,
                is_refuted: !is_noise && !attempt.is_further(),
                names: is_any_named,
                is_sure: is_sure && least.is_none(),
            }
        };
        let tried = judged(result.clone(), None);
        if tried.stands {
            return Some(tried);
        }
        // Other numbers are no evidence for what is named beside them where they simulate worse by themselves.
        let least = simulated(&conclude::loop_of(&result.base, nominal));
        let others = result.others(&found.data);
        others.map(|other| judged(other, least)).find(|other| other.stands).or(Some(tried))
    }

    /// The search: the plant with its numbers, and what is named beside it.
    fn searched(&self, searched: &Searched, beside: &Beside) -> Option<(Identified, Found)> {
        let Searched { parts, healthy, model } = searched;
        let options = self.options;
        stage::begins("the plant's own numbers", 0);
        if *beside == Beside::StickingMotor {
            let (found, with) = sticking_motor::beside_play(model, parts, options)?;
            let search = Search { data: &found.data, options, is_plant_open: true };
            let result = search.beside(found.nominal.clone(), with);
            return Some((found, result));
        }
        let plants = plants::likeliest(model, &parts.recordings, &parts.fitted, healthy, options);
        let is_guessed = plants.first()?.is_guessed;
        let is_plant_open = is_guessed && healthy.is_empty();
        if let Some(quantum) = quantization(&parts.recordings, healthy, is_guessed) {
            let found = plants.into_iter().next()?.refined()?;
            let search = Search { data: &found.data, options, is_plant_open };
            let result = search.coarse(found.nominal.clone(), quantum);
            return Some((found, result));
        }
        if let Beside::ComingAndGoing(terms) = beside {
            let found = plants.into_iter().next()?.refined()?;
            let search = Search { data: &found.data, options, is_plant_open };
            let with = comes_and_goes::beside(&found.nominal, terms, &found.data, options.least_gain)?;
            let result = search.beside(found.nominal.clone(), with);
            return Some((found, result));
        }
        let seen = (&parts.recordings[..], &parts.fitted[..]);
        let plants = plants::with_actuators(plants, model, seen.0, seen.1, (is_plant_open, options));
        let (found, first) = likeliest_with_physics(plants, options)?;
        let (found, first) = if is_plant_open {
            identified_again(found, first, model, parts, options)
        } else {
            (found, first)
        };
        let search = Search { data: &found.data, options, is_plant_open };
        let result = search.run(search.with_own_lags(first));
        Some(if result.is_noise || !is_guessed {
            (found, result)
        } else {
            under_coloring(found, result, is_plant_open, options)
        })
    }
}

/// The better of two simulations.
fn better(a: Option<FitPct>, b: Option<FitPct>) -> Option<FitPct> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.error() < a.error() { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// Steps of the fits that go on under another noise, or on other samples.
const GOING_ON: usize = 10;

/// A fit a few steps on.
fn gone_on(mut fit: Fit, data: &Data) -> Fit {
    let fixed = rivals::stuck(&fit.hypothesis);
    fit.descend(data, GOING_ON, &fixed);
    fit
}

/// The search once more where it left no noise of the kind that is reckoned with: under noise colored as what the likeliest of its fits left. Where
/// nothing is named then, or what is left is no noise either, nothing was gained.
fn under_coloring(
    found: Identified,
    ended: Found,
    is_plant_open: bool,
    options: &Options,
) -> (Identified, Found) {
    match recolored(&found, &ended, is_plant_open, options) {
        Some((found, result)) if result.is_noise && !result.named.is_empty() => (found, result),
        _ => (found, ended),
    }
}

fn recolored(
    found: &Identified,
    ended: &Found,
    is_plant_open: bool,
    options: &Options,
) -> Option<(Identified, Found)> {
    stage::begins("the search under colored noise", 0);
    let first = ended.contenders.first().map(|contender| &contender.fit);
    let left = ended.best.as_ref().or(first).unwrap_or(&ended.base);
    let data = found.data.clone().colored(Whitener::of_order(&left.rows.z, COLORED));
    let again = |fit: &Fit| Some(gone_on(Fit::at(&fit.hypothesis, &fit.point, &data)?, &data));
    let nominal = again(&ended.base)?;
    let mut glance = Glance::of(&nominal, &data, Round::First(options.least_gain))?;
    for contender in &ended.contenders {
        if let Some((kind, fit)) = rivals::last_kind(&contender.fit).zip(again(&contender.fit)) {
            glance.offer(kind, fit);
        }
    }
    let field = glance.sketched(&data).finished(&nominal, &data)?;
    let result = Search { data: &data, options, is_plant_open }.run(field);
    Some((Identified { nominal, data, is_guessed: found.is_guessed }, result))
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

/// A coarse sensor: where the plant is stated, where healthy recordings show a finer one, or where y moves over few of its steps. Else it may have
/// been so all along.
fn quantization(recordings: &[Signals], healthy: &[Signals], is_guessed: bool) -> Option<Term> {
    let step = lattice::step(recordings)?;
    let is_new = !healthy.is_empty() && lattice::step(healthy).is_none();
    let spread = recordings.iter().map(|signals| deviation(&held(&signals.y))).fold(0.0, f64::max);
    let is_coarse = healthy.is_empty() && lattice::rests(recordings) && spread < FEW_STEPS * step;
    if is_guessed && !is_new && !is_coarse {
        return None;
    }
    Term::new("quantization", &[("step", step)]).ok()
}

/// The nominal fit of a loop on data: what the search starts from.
fn hypothesis(model: &Loop, recordings: &[Signals], options: &Options) -> Hypothesis {
    Hypothesis::nominal(model, &measure::scales(model, recordings), &options.priors)
}
