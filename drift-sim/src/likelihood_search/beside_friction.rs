//! What shows beside dry friction alone: a cogging, a spring or a load that moves a machine less than what holds it. Alone it explains little, and so does friction: a search that takes what
//! leads first, and then what is left, goes past both. So what is named is looked for from friction as well, and the likelier of the two stands.

use crate::estimate::fit::Fit;
use crate::physics::{Kind, Shared};

use super::decide::priced;
use super::found::{Choice, Found};
use super::one_way;
use super::rivals::Field;
use super::search::Search;

/// The friction that every machine has.
const FRICTION: &str = "coulomb_friction";

/// What is named from friction on, and what the first search came to.
pub struct BesideFriction {
    found: Found,
    /// Where friction is among the candidates.
    index: usize,
}

impl BesideFriction {
    /// The search from the dry friction of a field on; `None` where it is no machine with friction, where that is the same as a load, or where nothing is named beside it.
    pub fn searched(search: &Search<'_>, first: &Field, begun: &Found) -> Option<Self> {
        let friction = first.rivals.iter().find(|rival| rival.kind.name == FRICTION)?;
        if one_way::hides_a_load(&friction.fit, search.data) {
            return None;
        }
        let choice = Choice { tied: Vec::new(), gain: first.gain(friction), unseen: None, among: 0 };
        let mut found = Found { best: Some(friction.fit.clone()), named: vec![choice], ..begun.clone() };
        found.set.clear();
        search.follow(&mut found, None);
        let candidates = found.best.as_ref()?.hypothesis.candidates();
        let index = candidates.iter().position(|term| term.kind == friction.kind)?;
        (found.named.len() > 1).then_some(Self { found, index })
    }

    /// What it came to.
    pub fn best(&self) -> Option<&Fit> {
        self.found.best.as_ref()
    }

    /// It, where it is likelier by so much than what the first search came to; where that is friction that differs by the direction alone, which does what dry friction does beside a load,
    /// also where it is as likely.
    pub fn instead_of(mut self, reached: &Fit, margin: f64) -> Option<Found> {
        let ahead = 0.5 * (priced(reached) - priced(self.best()?));
        let as_likely = includes_a_load(reached);
        if ahead < if as_likely.is_some() { -margin } else { margin } {
            return None;
        }
        if let Some((kind, choice)) =
            as_likely.zip(self.found.named.get_mut(self.index)).filter(|_| ahead < margin)
        {
            choice.tied.push(kind.name);
        }
        Some(self.found)
    }
}

/// The kind that a fit has alone, where that is a friction of which a load is a part.
fn includes_a_load(fit: &Fit) -> Option<&'static Kind> {
    let [term] = fit.hypothesis.candidates() else { return None };
    let is_load = term.kind.parameters.iter().any(|parameter| parameter.shared == Some(Shared::ConstantLoad));
    is_load.then_some(term.kind)
}
