//! What an unknown plant has of its own, whenever it was recorded: terms that healthy recordings show as well, and a late response where nothing tells how late the plant was.

use crate::estimate::fit::Fit;
use crate::estimate::likelihood::Data;
use crate::physics::Family;

use super::decide::{AS_LIKELY, Decision, has_onset, priced};
use super::found::Found;
use super::glance::Round;
use super::nominal;
use super::rivals::{self, Field};
use super::search::{Search, named};

/// Terms that a plant may have of its own.
const OWN_TERMS: usize = 2;
/// Steps of a fit to healthy recordings as well.
const REFIT_STEPS: usize = 10;

impl Search<'_> {
    /// The search from the first field on, beside what the plant seems to have of its own. Beside one of two things that have come since the plant was healthy, that one may seem to have
    /// been there before (a servo that has gained dry friction and a spring, 84 nats): where the search without is likelier at its end, it stands.
    pub fn run_beside_own_terms(&self, first: Field) -> Found {
        let Some(beside) = self.beside_own_terms(&first) else { return self.run(first) };
        let own = self.run(beside);
        // How late a plant was that nothing tells of has no rival.
        if self.is_plant_open {
            return own;
        }
        let without = self.run(first);
        let is_likelier = reached(&without) + 2.0 * self.options.margin < reached(&own);
        if is_likelier { without } else { own }
    }

    /// A field beside an unknown plant to which those terms belong that lead one after the other and may be its own; `None` where it has none.
    fn beside_own_terms(&self, first: &Field) -> Option<Field> {
        if !first.base.hypothesis.is_guessed {
            return None;
        }
        let mut field = None;
        for _ in 0..OWN_TERMS {
            let known = field.as_ref().unwrap_or(first);
            let decision = self.decide(known, f64::NEG_INFINITY);
            let own = self.plants_own(&decision, known);
            let Some(base) = own.and_then(|fit| with_last_stated(&fit, self.data)) else { break };
            let round = Round::First(self.options.least_gain);
            let Some(next) = rivals::field(&base, self.data, round) else { break };
            field = Some(next);
        }
        field
    }

    /// What a decision names, where it may be an unknown plant's own, fitted as such: a late response where nothing tells how late the plant was; else a kind in the healthy
    /// recordings, too, where these speak for it. Where they say nothing of it, as of a limit that u reaches now alone, it may have come since. A stated plant lacks it, whenever it
    /// came.
    pub fn plants_own(&self, decision: &Decision, field: &Field) -> Option<Fit> {
        let rival = named(decision, field)?;
        if self.is_plant_open {
            return (rival.kind.family == Some(Family::Lag)).then(|| rival.fit.clone());
        }
        if !rival.fit.hypothesis.is_guessed || has_onset(rival.kind) {
            return None;
        }
        let all = self.data.with_all_alike();
        let mut fit = Fit::at(&rival.fit.hypothesis, &rival.fit.point, &all)?;
        fit.descend(&all, REFIT_STEPS, &rivals::stuck(&fit.hypothesis));
        (fit.objective() + 2.0 * AS_LIKELY < rival.fit.objective()).then_some(fit)
    }
}

/// Where a search ended: twice minus its log-likelihood, with what its candidates' numbers cost.
fn reached(found: &Found) -> f64 {
    priced(found.best.as_ref().unwrap_or(&found.base))
}

/// A fit whose last candidate is part of the loop: its numbers stay free, and every later hypothesis has it.
fn with_last_stated(fit: &Fit, data: &Data) -> Option<Fit> {
    let mut hypothesis = fit.hypothesis.clone();
    *hypothesis.model.physics.last_mut()? = hypothesis.realise(&fit.point)?.model.physics.pop()?;
    hypothesis.stated += 1;
    let mut point = fit.point.clone();
    point.onsets.pop();
    nominal::fit_again(&Fit::at(&hypothesis, &point, data)?, data)
}
