//! One model, one likelihood, one decision: the physics that a simulation left out.
//!
//! One pipeline, in [`diagnose`]: the recordings are cut into what a fit may see and what proves; the **law** is judged by its own error in
//! u (`law`); the plant's numbers and the noise, a slow random load among it, are fitted (`plants`, `nominal`); every kind of physics is fitted
//! beside them, all in one likelihood (`starts`, `rivals`, on [`crate::estimate`]); what can't be told from the best one is the **set**, and one
//! kind, or one family, that is left alone in it is named (`decide`); what was named must gain on what nothing has seen (`prove`). A second
//! effect is looked for beside the first (`search`). `conclude` makes the report. Numbers that decide are in [`options`]. Where what is left is no noise of the kind that
//! is reckoned with, nothing is concluded here, and [`crate::diagnose`] goes on without it.

mod actuators;
mod all_samples;
mod apart;
mod climb;
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
pub(crate) mod plants;
pub mod prove;
mod raggedness;
pub(crate) mod rivals;
mod search;
pub(crate) mod simulates;
mod standing_load;
mod starts;
pub(crate) mod units;
mod unseen;
mod wave_in_u;

use crate::control_loop::Loop;
use crate::controller::Controller;
use crate::diagnose::Diagnosis;
use crate::estimate::first_look::coarseness;
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

use conclude::Conclusion;
use decide::COLORED;
use glance::{Glance, Round};
use options::Options;
use plants::{Candidate, Identified};
pub use rivals::is_searched;
use rivals::{Field, Sketch};
use search::{Found, Search};
use simulates::Trial;
use unseen::Unseen;

/// What the likelihood says.
pub enum Judged {
    /// The diagnosis.
    Stands(Box<Diagnosis>),
    /// The diagnosis, under noise that is of another kind than the random load and the sensor's that are reckoned with.
    Colored(Box<Diagnosis>),
    /// What is left is no noise of the kind that is reckoned with, or what was found does not simulate what it has not seen: undecided.
    Doubted(Box<Diagnosis>),
    /// The loop can't be simulated beside the recording, or its law is another one.
    Nothing,
}

/// Diagnoses recordings of one loop, which share a likelihood, against what is stated of it.
pub fn diagnose(
    recordings: &[Signals],
    holdout: Option<&Signals>,
    nominal: &Loop,
    healthy: &[Signals],
    options: &Options,
) -> Judged {
    let first = concluded(recordings, holdout, nominal, healthy, options);
    let concluded = match first {
        // What a first look at fewer samples led to does not stand: all of them are searched.
        Some((_, Standing::Doubted)) if are_more_than_enough(recordings, holdout, healthy, options) => {
            let all = Options { enough_samples: usize::MAX, ..options.clone() };
            concluded(recordings, holdout, nominal, healthy, &all)
        }
        first => first,
    };
    match concluded {
        Some((found, Standing::Stands)) => Judged::Stands(Box::new(found)),
        Some((found, Standing::Colored)) => Judged::Colored(Box::new(found)),
        Some((found, Standing::Doubted)) => Judged::Doubted(Box::new(found.undecided())),
        None => Judged::Nothing,
    }
}

/// Whether a search looks at fewer samples of these recordings first.
fn are_more_than_enough(
    recordings: &[Signals],
    holdout: Option<&Signals>,
    healthy: &[Signals],
    options: &Options,
) -> bool {
    let fitted = Parts::new(recordings, holdout, options).map(|parts| parts.fitted).unwrap_or_default();
    let all: Vec<usize> = fitted.into_iter().chain(healthy.iter().map(Signals::len)).collect();
    coarseness(&all, options.enough_samples) > 1
}

/// Whether a diagnosis stands.
enum Standing {
    Stands,
    Colored,
    Doubted,
}

/// The diagnosis, and whether it stands.
fn concluded(
    recordings: &[Signals],
    holdout: Option<&Signals>,
    nominal: &Loop,
    healthy: &[Signals],
    options: &Options,
) -> Option<(Diagnosis, Standing)> {
    let parts = Parts::new(recordings, holdout, options)?;
    stage::begins("the control law", 0);
    let law = law::examine(nominal, &parts.recordings);
    if law.is_another {
        return None;
    }
    stage::begins("the plant's own numbers", 0);
    let plants = plants::likeliest(&law.model, &parts.recordings, &parts.fitted, healthy, options);
    let is_guessed = plants.first()?.is_guessed;
    let is_plant_open = is_guessed && healthy.is_empty();
    let coarse = quantization(&parts.recordings, healthy, is_guessed);
    let (found, result) = match coarse {
        Some(quantum) => {
            let found = plants.into_iter().next()?.refined()?;
            let search = Search { data: &found.data, options, is_plant_open };
            let result = search.coarse(found.nominal.clone(), quantum);
            (found, result)
        }
        None => {
            let (recordings, fitted) = (&parts.recordings, &parts.fitted);
            let plants =
                plants::with_actuators(plants, &law.model, recordings, fitted, (is_plant_open, options));
            let (found, first) = likeliest_with_physics(plants, options)?;
            let (found, first) = if is_plant_open {
                identified_again(found, first, &law.model, &parts, options)
            } else {
                (found, first)
            };
            let search = Search { data: &found.data, options, is_plant_open };
            let result = search.run(search.with_own_lags(first));
            if result.is_noise || !is_guessed {
                (found, result)
            } else {
                under_coloring(found, result, is_plant_open, options)
            }
        }
    };
    let is_coarse = is_guessed && result.quantum.is_none() && lattice::rests(&parts.recordings);
    let is_noise = result.is_noise;
    stage::begins("intervals and proof", 0);
    let (predicted, fit) = (result.predicted, result.best.clone().unwrap_or_else(|| result.base.clone()));
    let (train, unseen) = parts.shown();
    let conclusion = Conclusion {
        stated: nominal,
        law,
        train: &train,
        unseen: unseen.as_ref(),
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
    let has_healthy = !healthy.is_empty();
    let trial = Trial {
        found: &concluded,
        fit: &fit,
        shown: &shown,
        model: &model,
        seen: &train,
        is_guessed,
        has_healthy,
        coloring: found.data.coloring(),
        predicted,
    };
    let is_nothing = !concluded.physics.is_empty() && concluded.physics.iter().all(sentences::may_be_nothing);
    // A cycle that the loop makes with what was named, and not without it, proves it whatever else is in y.
    let is_noise = (is_noise || trial.cycles_as_measured()) && !is_coarse;
    let standing = match is_noise && !is_nothing && trial.passes() {
        true if found.data.is_colored() => Standing::Colored,
        true => Standing::Stands,
        false => Standing::Doubted,
    };
    Some((concluded, standing))
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

/// The recordings and what a fit may see of each; the hold-out is the last.
struct Parts {
    recordings: Vec<Signals>,
    fitted: Vec<usize>,
    not_used: usize,
    has_holdout: bool,
}

impl Parts {
    /// `None` without a recording.
    fn new(recordings: &[Signals], holdout: Option<&Signals>, options: &Options) -> Option<Self> {
        let most = options.most_samples / recordings.len().max(1);
        let cut = |signals: &Signals| signals.part(0, most);
        let not_used = recordings.iter().map(|signals| signals.len().saturating_sub(most)).sum();
        let share = |signals: &Signals, part: f64| (part * signals.len() as f64) as usize;
        let seen = if holdout.is_some() { 1.0 } else { options.seen_of_recording };
        let mut cuts: Vec<Signals> = recordings.iter().map(cut).collect();
        let mut fitted: Vec<usize> = cuts.iter().map(|signals| share(signals, seen)).collect();
        if let Some(holdout) = holdout.map(cut) {
            fitted.push(share(&holdout, options.seen_of_holdout));
            cuts.push(holdout);
        }
        let parts = Self { recordings: cuts, fitted, not_used, has_holdout: holdout.is_some() };
        (!recordings.is_empty()).then_some(parts)
    }

    /// What fits are shown on: what numbers were fitted to, of the first recording, and what proves.
    fn shown(&self) -> (Signals, Option<Unseen>) {
        let (first, fitted) = (&self.recordings[0], self.fitted[0]);
        let unseen = match self.recordings.last().filter(|_| self.has_holdout) {
            Some(holdout) => Unseen::of(std::iter::once((holdout, 0))),
            None => Unseen::of(self.recordings.iter().zip(self.fitted.iter().copied())),
        };
        (first.part(0, fitted), unseen)
    }
}

/// The nominal fit of a loop on data: what the search starts from.
fn hypothesis(model: &Loop, recordings: &[Signals], options: &Options) -> Hypothesis {
    Hypothesis::nominal(model, &measure::scales(model, recordings), &options.priors)
}
