//! The diagnosis where the plant had to be identified or the control law is unknown.
//!
//! Such a plant is a guess of its own, and without a law no closed loop can be simulated. A wide search would take whatever
//! the linear plant lacks for some physics of the library. So only few effects compete, each with a proof of its own: a hidden
//! limit ([`identify`](super::identify)). The law being unknown, the proof is that y follows the recorded u better on samples that
//! were not fitted.

use crate::physics::Term;
use crate::{Error, Result};

use super::candidates::Candidate;
use super::fit::{Effort, Fit, mean_square};
use super::holdout;
use super::model::Model;
use super::select::Scored;
use super::whiten::{Whitener, effective_samples};
use super::{Case, Diagnosis, controller_replay};

impl Case<'_> {
    /// The diagnosis with the few effects that an identified plant or an unknown law leave room for.
    pub(super) fn run_recorded(&self, limit: Option<&Term>) -> Result<Diagnosis> {
        let stated = Fit::start(&Model::refit(self.nominal, self.train), self.train, &Whitener::none())
            .ok_or_else(|| Error::new("the plant can't follow the recorded u: it diverges"))?;
        let refit = stated.clone().search(self.train, Effort::FULL);
        let missing = self.missing_drive(&refit);
        let controller = controller_replay::replay(self.nominal, self.train);
        let mut base = refit.clone();
        let mut named: Vec<(Scored, Vec<&'static str>)> = Vec::new();
        let mut rejected = Vec::new();
        if let Some(scored) = limit.and_then(|limit| self.with_limit(&stated, &base, limit)) {
            if scored.accepted() && self.matters(&base, &scored.candidate.fit) {
                base = scored.candidate.fit.clone();
                named.push((scored, Vec::new()));
            } else {
                rejected.extend(super::losers(&[scored], None));
            }
        }
        let (refit, base) = (refit.renoised(), base.renoised());
        self.conclude(&stated, &refit, &base, named, None, rejected, missing, controller)
    }

    /// The limit with which the plant was identified, against the best linear plant without.
    fn with_limit(&self, stated: &Fit, base: &Fit, limit: &Term) -> Option<Scored> {
        let model = stated.model.with_term(limit, false, self.train.duration_s());
        let fit = Fit::start(&model, self.train, &Whitener::none())?.search(self.train, Effort::FULL);
        self.score_free_run(base, Candidate { kind: limit.kind, fit })
    }

    /// Scores a candidate by how much better its free run follows y. A noise model would not do: where the linear plant is only
    /// about right, it takes the slow misfit for noise, and with it most of what tells the two apart. The price is fewer
    /// independent samples: as many as the correlation of what is left allows.
    fn score_free_run(&self, base: &Fit, candidate: Candidate) -> Option<Scored> {
        let residuals = [&base.residual, &candidate.fit.residual];
        let worth = residuals.map(|e| effective_samples(e)).into_iter().fold(f64::INFINITY, f64::min);
        let ratio = mean_square(&base.residual) / mean_square(&candidate.fit.residual).max(1e-300);
        let extra = candidate.fit.model.physical().saturating_sub(base.model.physical()) as f64;
        let blocks = |fit: &Fit| holdout::block_likelihoods(fit, self.holdout, &Whitener::none());
        let (with, without) = (blocks(&candidate.fit)?, blocks(base)?);
        let (mean, error) = holdout::gain(&with, &without);
        let share = worth / base.residual.len().max(1) as f64;
        Some(Scored {
            train_gain: 0.5 * (worth * libm::log(ratio) - extra * libm::log(worth.max(2.0))),
            holdout_gain: mean * with.len() as f64 * share,
            holdout_errors: mean / error.max(1e-300),
            candidate,
        })
    }
}
