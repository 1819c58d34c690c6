//! Pairs: two effects at once, where the likeliest kind alone is neither of them. What one kind makes of both may be a little likelier than the
//! true one makes of its own part; with a second effect beside each the true one leads by far.

use crate::estimate::fit::Fit;
use crate::stage;

use super::decide::{Scored, cost_of, independent_share};
use super::rivals::{Field, Round, Sketch};
use super::search::{Choice, Found, Search};

/// Part of the leader's gain from which on a kind may be one of two effects, and how many are tried.
const NEARLY: f64 = 0.7;
const TRIED: usize = 3;
/// Log-likelihood that the leader must gain for two effects to be looked for.
const LEAST: f64 = 30.0;

impl Search<'_> {
    /// Tries the kinds that come next as the first of two, and takes what is likelier by more than the margin than all that was found before.
    pub(super) fn pair(&self, found: &mut Found, first: &Field, scored: &[Scored]) {
        let Some(leader) = scored.first().filter(|best| best.gain > LEAST) else { return };
        if self.options.guarantee.is_some() {
            return;
        }
        let is_taken = |s: &&Scored| {
            let best = found.best.as_ref();
            best.is_some_and(|fit| fit.hypothesis.candidates().iter().any(|term| term.kind == s.kind))
        };
        let near: Vec<&Scored> =
            scored.iter().filter(|s| s.gain > NEARLY * leader.gain && !is_taken(s)).take(TRIED).collect();
        let alone = first.rivals.get(leader.place).map_or(&first.base, |rival| &rival.fit);
        let known = unlikely(found.best.as_ref().unwrap_or(alone));
        stage::begins("two effects at once", near.len());
        let mut others: Vec<Found> =
            near.iter().filter_map(|s| self.beside(found, first, s, known)).collect();
        others.sort_by(|a, b| a.unlikely().total_cmp(&b.unlikely()));
        let is_alone = others.len() < 2 || !found.named.is_empty() || self.leads(&others[0], &others[1]);
        if let Some(other) = others.into_iter().next().filter(|_| is_alone) {
            *found = other;
        }
    }

    fn leads(&self, a: &Found, b: &Found) -> bool {
        let kinds = |found: &Found| {
            let mut kinds: Vec<&str> = found
                .best
                .iter()
                .flat_map(|fit| fit.hypothesis.candidates())
                .map(|term| term.kind.name)
                .collect();
            kinds.sort_unstable();
            kinds
        };
        kinds(a) == kinds(b) || a.unlikely() < b.unlikely() - 2.0 * self.options.margin
    }

    /// What is found with this kind as the first; `None` where that is no likelier than what is known.
    fn beside(&self, found: &Found, first: &Field, scored: &Scored, known: f64) -> Option<Found> {
        let bar = known - 2.0 * self.options.margin;
        let fit = &first.rivals.get(scored.place)?.fit;
        let promised = Sketch::of(fit, self.data, Round::Later)?.least_objective(0.0) + own_cost(fit);
        stage::step();
        if promised > bar {
            return None;
        }
        let choice = Choice { tied: Vec::new(), gain: scored.score, unseen: None };
        let mut other =
            Found { named: vec![choice], best: Some(fit.clone()), set: Vec::new(), ..found.clone() };
        self.follow(&mut other);
        (other.named.len() > 1 && other.unlikely() < bar).then_some(other)
    }
}

impl Found {
    /// The objective with the cost of all numbers.
    fn unlikely(&self) -> f64 {
        self.best.as_ref().map_or(f64::INFINITY, unlikely)
    }
}

fn unlikely(fit: &Fit) -> f64 {
    fit.objective() + own_cost(fit)
}

/// Twice what the numbers of all candidates cost, by the objective's measure.
fn own_cost(fit: &Fit) -> f64 {
    let cost: f64 = (0..fit.hypothesis.candidates().len()).map(|i| cost_of(fit, i)).sum();
    2.0 * cost / independent_share(fit)
}
