//! The end of a search, judged: the diagnosis that it leads to, whether a simulation of what nothing has seen shows it, and whether it stands.

use crate::control_loop::Loop;
use crate::diagnose::prove::FitPct;
use crate::diagnose::{Diagnosis, Named};
use crate::estimate::fit::Fit;
use crate::estimate::lattice;
use crate::estimate::likelihood::Data;
use crate::estimate::signals::Signals;
use crate::physics::{Place, Starts};
use crate::stage;

use super::attempts::Attempt;
use super::conclude::{self, Conclusion};
use super::decide::priced;
use super::found::Found;
use super::law::Law;
use super::nominal;
use super::options::Options;
use super::parts::Parts;
use super::plants::Identified;
use super::search::noise_holds;
use super::simulates::Trial;
use super::unseen::{Unseen, fit_pct};
use super::without::without;
use super::{Case, holds};

/// A diagnosis, and whether it stands.
pub struct Tried {
    /// The diagnosis.
    pub found: Diagnosis,
    /// Whether it stands.
    pub stands: bool,
    /// Whether anything is named or placed that is neither of the law nor another number.
    pub names: bool,
    /// Whether its noise is none of the kind that is reckoned with in the recording's own samples, in which a likelihood then favours what is fast.
    pub is_refuted: bool,
    /// What the search came to, on the scale of the objective, the cost of its numbers in it.
    pub reached: f64,
    /// Whether it is what the search found, its noise being noise, its cycle the recorded one or its simulation close, and not what may stand in its place.
    pub is_sure: bool,
}

/// What the ends of one attempt are judged by.
pub struct Judge<'a> {
    case: &'a Case<'a>,
    attempt: &'a Attempt,
    law: &'a Law,
    /// The recordings in their own samples.
    parts: &'a Parts,
    /// Whether y rests on the steps of a coarse sensor as it was searched: a guessed plant may be any between them.
    rests: bool,
    /// What numbers were fitted to, of the first recording, and what proves.
    train: Signals,
    unseen: Option<Unseen>,
}

impl<'a> Judge<'a> {
    /// Of an attempt at these recordings, and at what it searched of them.
    pub fn new(
        case: &'a Case<'_>,
        attempt: &'a Attempt,
        law: &'a Law,
        parts: &'a Parts,
        searched: &Parts,
    ) -> Self {
        let (train, unseen) = parts.shown();
        Self { case, attempt, law, parts, rests: lattice::rests(&searched.recordings), train, unseen }
    }

    /// How well a loop simulates what nothing has seen.
    pub fn simulated(&self, model: &Loop) -> Option<FitPct> {
        match &self.unseen {
            Some(unseen) => unseen.fit(model),
            None => fit_pct(model, &self.train),
        }
    }

    /// An end of the search beside this plant, judged; one in place of another has to simulate no worse than the least.
    pub fn judged(&self, beside: &Identified, end: Found, least: Option<FitPct>) -> Tried {
        stage::begins("intervals and proof", 0);
        let fit = end.best.clone().unwrap_or_else(|| end.base.clone());
        let own = self.parts.as_data(&fit, &beside.data, self.attempt.factor);
        let fit = fit.on(&own).unwrap_or(fit);
        let coarse_best = end.best.as_ref().filter(|_| self.attempt.factor > 1);
        let coarse_ends = coarse_best.map(|best| (best.clone(), end.base.clone()));
        let (is_noise, predicted) = (end.is_noise, end.predicted);
        let is_any_named = end.best.is_some() || end.quantum.is_some();
        let may_be_between_steps = beside.is_guessed && end.quantum.is_none();
        let reached = beside.cost() + priced(end.best.as_ref().unwrap_or(&end.base));
        let without = self.simulated(&conclude::loop_of(&end.base, self.case.nominal));
        let unseen = self.unseen.as_ref().map(|unseen| unseen.beginning_as(&fit));
        let found = self.concluded(end, (&fit, unseen.as_ref()), beside);
        // In the mean of several samples there are no steps, and what they made is a play of the sensor there.
        let plays_at_sensor = |named: &Named| named.term.kind.plays_at(Place::Sensor);
        let made_by_steps =
            || found.physics.iter().any(plays_at_sensor) && lattice::rests(&self.parts.recordings);
        let is_coarse = may_be_between_steps && (self.rests || made_by_steps());
        let (model, shown) = self.shown(&found, unseen.as_ref());
        let trial = Trial {
            found: &found,
            fit: &fit,
            shown: &shown,
            model: &model,
            seen: &self.train,
            is_guessed: beside.is_guessed,
            has_healthy: !self.case.healthy.is_empty(),
            data: &beside.data,
            factor: self.attempt.factor,
            predicted,
            without: better(without, least),
            play_gain: self.case.options.play_gain,
        };
        let is_nothing = !found.physics.is_empty() && found.physics.iter().all(Named::may_be_nothing);
        // A simulation proves it whatever else is in y, unless the plant was guessed from the very u that drives it; so does a cycle that the loop makes with what was named, and not
        // without it.
        let is_own_guess = self.case.is_its_own_guess();
        let is_proven = trial.proves() && (is_noise || !is_own_guess);
        let is_sure = is_noise || trial.cycles_as_measured() || (is_proven && trial.leaves_noise());
        let is_shown = if !is_any_named {
            // The law is judged by its own error.
            is_noise || !self.law.terms.is_empty() || trial.proves_numbers()
        } else if self.attempt.is_further() || least.is_some() {
            // What further attempts search shows less of what is left, and other numbers are none of the likelihood's: a simulation has to show what they led to, and one that the
            // plant was guessed from nearly all of it.
            (is_proven || (is_noise && trial.confirms()))
                && (!is_own_guess || trial.explains_nearly_all())
                && !trial.names_noise_alone()
        } else {
            is_sure || is_proven
        };
        // Of a loop that holds, and of which nothing is known, a load that jumps moves all there is: no plant is told by that.
        let jumps_alone = || is_own_guess && beside.data.jumps().count() > 0 && holds(&self.parts.recordings);
        let is_told = (trial.plays_strongly() || trial.begins_beyond_doubt() || !jumps_alone())
            && !(is_any_named && trial.follows_by_the_law())
            && !trial.jumps_to_and_fro();
        let Options { guessed_gain, unknown_gain, .. } = *self.case.options;
        let is_plant_open = beside.is_guessed && self.case.healthy.is_empty();
        let least_gain = if is_own_guess && !is_proven && !trial.names_play() {
            unknown_gain
        } else if is_plant_open {
            guessed_gain
        } else {
            0.0
        };
        let is_enough = found.physics.is_empty() || trial.names_what_gains(least_gain);
        let stands = is_shown
            && is_told
            && is_enough
            && !is_coarse
            && !is_nothing
            && trial.passes()
            && (least.is_none() || trial.improves())
            && !coarse_ends.is_some_and(|ends| own_samples_speak_against(&ends, &own));
        Tried {
            found,
            stands,
            is_refuted: !is_noise && !self.attempt.is_further(),
            names: is_any_named,
            reached,
            is_sure: is_sure && least.is_none(),
        }
    }

    fn concluded(
        &self,
        end: Found,
        (fit, unseen): (&Fit, Option<&Unseen>),
        beside: &Identified,
    ) -> Diagnosis {
        let conclusion = Conclusion {
            stated: self.case.nominal,
            law: self.law.clone(),
            train: &self.train,
            unseen,
            sensor_sd: fit.rows.sensor_sd,
            factor: self.attempt.factor,
            not_used: self.parts.not_used,
            result: end,
            data: &beside.data,
            is_guessed: beside.is_guessed,
            options: self.case.options,
        };
        conclusion.diagnosis()
    }

    /// The improved loop, and what its simulations are held against.
    fn shown(&self, found: &Diagnosis, unseen: Option<&Unseen>) -> (Loop, Signals) {
        match unseen {
            Some(unseen) if !found.improved.has_law() => unseen.first_behind_play(&found.improved),
            unseen => {
                let shown = unseen.map_or(&self.train, Unseen::first);
                (found.improved.clone(), shown.clone())
            }
        }
    }
}

/// Steps of a fit to the recording's own samples.
const STEPS: usize = 10;

/// Whether the recording's own samples are less likely with what was named in coarser ones than without it, all other numbers refitted: coarser samples lack how u moves in each, which a
/// delay makes up for. Where what is left in them is no noise, they say nothing but of a noisier sensor: what means miss of a reference that moves faster and faster looks like one.
fn own_samples_speak_against((best, base): &(Fit, Fit), own: &Data) -> bool {
    let refitted = |fit: &Fit| {
        let mut fit = nominal::under_own_noise(&fit.on(own)?, own)?;
        let named = (0..fit.hypothesis.candidates().len()).flat_map(|i| fit.hypothesis.places_of(i));
        fit.descend(own, STEPS, &named.collect::<Vec<_>>());
        Some(fit)
    };
    let with = refitted(best);
    let is_likelier = |other: Fit| with.as_ref().is_none_or(|with| with.objective() > other.objective());
    let terms = best.hypothesis.candidates().iter().enumerate();
    let mut noises = terms.filter(|(_, term)| matches!(term.kind.search, Starts::NoiseChange));
    let less_noisy = |index: usize| refitted(&without(&best.on(own)?, index, own)?);
    refitted(base).filter(noise_holds).is_some_and(is_likelier)
        || noises.any(|(index, _)| less_noisy(index).is_some_and(is_likelier))
}

/// The better of two simulations.
fn better(a: Option<FitPct>, b: Option<FitPct>) -> Option<FitPct> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.error() < a.error() { b } else { a }),
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::Controller;
    use crate::diagnose::cause::Cause;
    use crate::estimate::first_look::coarser;
    use crate::likelihood_search::hypothesis;
    use crate::physics::Term;
    use crate::simulate::simulate;

    const COARSE: usize = 9;
    const LEVELS: [f64; 5] = [0.0, 0.5, 1.0, 0.5, 0.0];
    const STAYS: usize = 1_403;

    /// A mass on a spring whose law kicks at each step of its reference, which falls anywhere within coarser samples.
    fn mass(physics: Vec<Term>) -> (Loop, Signals) {
        let text = "[loop]\nsample_time_s = 0.002\n[controller]\nkind = \"pi\"\nkp = 6.0\nki = 6.0\n\
            [plant]\nkind = \"transfer-function\"\nnum = [4.0]\nden = [1.0, 3.0, 8.0]\n[sensor]\nnoise = 5e-5\n";
        let model = Loop::parse(text, "a mass").unwrap();
        let r: Vec<f64> = LEVELS.iter().flat_map(|level| vec![*level; STAYS]).collect();
        let trace = simulate(&Loop { physics, ..model.clone() }, &r, &[], 1, None).unwrap();
        let signals =
            Signals { sample_time_s: model.sample_time_s, r, y: trace.y, u: trace.u, ..Signals::default() };
        (Loop { controller: Controller::Recorded, ..model }, signals)
    }

    fn delay(delay_s: f64) -> Term {
        Term::new("delay", &[("delay_s", delay_s)]).unwrap()
    }

    /// The fits to coarser samples with this term and without it, what it gains there, and the recording's own samples.
    fn searched(physics: Vec<Term>, term: Term) -> ((Fit, Fit), f64, Data) {
        let (model, signals) = mass(physics);
        let samples = signals.len();
        let coarse = coarser(std::slice::from_ref(&signals), COARSE);
        let slow = Loop { sample_time_s: COARSE as f64 * model.sample_time_s, ..model.clone() };
        let plain = hypothesis(&slow, &coarse, &Options::default());
        let fitted = vec![coarse[0].len()];
        let data = Data::new(&plain, coarse, fitted);
        let base = nominal::fit(&plain, &data).unwrap();
        let best = nominal::fit(&plain.with(term), &data).unwrap();
        let gain = 0.5 * (base.objective() - best.objective());
        let own = Data::new(
            &hypothesis(&model, std::slice::from_ref(&signals), &Options::default()),
            vec![signals],
            vec![samples],
        );
        ((best, base), gain, own)
    }

    #[test]
    fn a_delay_that_coarser_samples_make_is_spoken_against() {
        let (ends, gain, own) = searched(vec![delay(0.0)], delay(0.02));
        assert!(gain > 20.0, "{gain}");
        assert!(own_samples_speak_against(&ends, &own));
    }

    #[test]
    fn a_delay_that_is_there_is_not() {
        let (ends, gain, own) = searched(vec![delay(0.02)], delay(0.02));
        assert!(gain > 20.0, "{gain}");
        assert!(!own_samples_speak_against(&ends, &own));
    }

    /// A sensor that is four times as noisy from the middle on, and one that is not.
    #[test]
    fn a_noisier_sensor_must_pay_in_the_recordings_own_samples() {
        let noisier = || Term::new("sensor_noise", &[("ratio", 4.0)]).unwrap().from_s(7.0);
        let speaks = |physics| {
            let (ends, _, own) = searched(physics, noisier());
            own_samples_speak_against(&ends, &own)
        };
        assert!(speaks(Vec::new()));
        assert!(!speaks(vec![noisier()]));
    }

    #[test]
    fn causes_are_told_in_the_recordings_own_samples() {
        let (model, _) = mass(Vec::new());
        let ((best, _), _, _) = searched(vec![delay(0.02)], delay(0.02));
        let cause = Cause::of(&best, &model, COARSE, 1.0, true).unwrap();
        assert!(cause.model.check_sample_time(model.sample_time_s).is_ok());
        assert!(cause.noise.sensor_sd > best.rows.sensor_sd, "means are less noisy: {:?}", cause.noise);
    }
}
