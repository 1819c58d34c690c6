//! What is wrong with the law itself: a hidden limit, other gains, a late output. Its replay needs no plant, so that this comes first,
//! and all that follows closes the loop with the law as it really is.

use crate::control_loop::Loop;
use crate::physics::Term;

use super::closed_loop::fit_pct;
use super::controller_replay::replay;
use super::signals::Signals;
use super::{Diagnosis, Fits, Named, Verdict, controller_fault, law_limit, prove};

/// The faults of a law.
#[derive(Debug, Clone)]
pub(super) struct LawFaults {
    /// The loop with them.
    pub model: Loop,
    named: Vec<Named>,
}

/// The faults of the stated law; `None` where it has none, or is unknown.
pub(super) fn find(stated: &Loop, train: &Signals, holdout: &Signals) -> Option<LawFaults> {
    let limit = law_limit::find(stated, train, holdout);
    let mut model = limit.as_ref().map_or(stated, |limit| &limit.model).clone();
    let mut named = Vec::new();
    if let Some(limit) = limit {
        named.push(Named::alone(limit.term, limit.half_widths, limit.gain, limit.holdout_errors));
    }
    let replayed = replay(&model, train)?;
    if let Some(fault) = controller_fault::find(&model, &replayed, train, holdout) {
        let errors = fault.holdout_share * libm::sqrt(holdout.len() as f64);
        model.physics.push(fault.term.clone());
        named.push(Named::alone(fault.term, vec![fault.half_width], fault.train_gain, errors));
    }
    (!named.is_empty()).then_some(LawFaults { model, named })
}

impl Diagnosis {
    /// The diagnosis of the loop with these faults as that of the loop as it was stated.
    #[must_use]
    pub(super) fn with_law_faults(
        mut self,
        faults: LawFaults,
        stated: &Loop,
        train: &Signals,
        holdout: &Signals,
    ) -> Self {
        let as_stated = |model: &Loop| {
            let physics: Vec<Term> = model.physics.iter().take(stated.physics.len()).cloned().collect();
            Loop { controller: stated.controller.clone(), physics, ..model.clone() }
        };
        self.nominal = as_stated(&self.nominal);
        self.refitted = as_stated(&self.refitted);
        let fits = |of: &Fits, signals: &Signals| Fits {
            nominal: fit_pct(&self.nominal, signals),
            before: fit_pct(&self.refitted, signals),
            ..*of
        };
        (self.train, self.holdout) = (fits(&self.train, train), fits(&self.holdout, holdout));
        let run = |model: &Loop| prove::run(model, holdout, 0);
        self.improvement = match (run(&self.refitted), run(&self.improved)) {
            (Some(before), Some(after)) => prove::improvement(&before, &after, stated, holdout),
            _ => None,
        };
        self.controller = replay(stated, train);
        self.place = faults.named.first().map(|named| named.term.kind.place);
        self.physics.splice(0..0, faults.named);
        self.verdict = Verdict::MissingPhysics;
        self
    }
}
