//! What shows beside dry friction alone: a cogging, a spring or a load that moves a machine less than what holds it. Alone it explains little, and so does friction: a search that takes what
//! leads first, and then what is left, goes past both. So what is named is looked for from friction as well, and the likelier of the two stands.

use crate::estimate::fit::Fit;
use crate::estimate::likelihood::Data;
use crate::physics::{Kind, Shared};

use super::decide::priced;
use super::found::{Choice, Found};
use super::glance::{Glance, Round, gain_over};
use super::one_way::{self, FRICTION};
use super::rivals::Field;
use super::search::Search;

/// By how much a short fit may understate what its kind gains, and log-likelihood that it may lack besides: a kind whose short fit comes to three tenths of the best one's, or this close to
/// it, is fitted to the end (`rivals.rs`).
const SHORTENED: f64 = 2.0;
const CLOSE: f64 = 60.0;

/// What is named from friction on, and what the first search came to.
pub struct BesideFriction {
    found: Found,
    /// Where friction is among the candidates.
    index: usize,
}

impl BesideFriction {
    /// The search from the dry friction of a field on; `None` where it is no machine with friction, where that is the same as a load, where nothing is named beside it, or where a look
    /// at what may be leads to less than was reached without.
    pub fn searched(search: &Search<'_>, first: &Field, begun: &Found, reached: &Fit) -> Option<Self> {
        let friction = first.rivals.iter().find(|rival| rival.kind.name == FRICTION)?;
        if is_friction_first(reached) || one_way::hides_a_load(&friction.fit, search.data) {
            return None;
        }
        let field = promising_field(&friction.fit, search.data, search.options.least_gain, reached)?;
        let choice = Choice { tied: Vec::new(), gain: first.gain(friction), unseen: None, among: 0 };
        let mut found = Found { best: Some(friction.fit.clone()), named: vec![choice], ..begun.clone() };
        found.set.clear();
        search.follow(&mut found, Some(field));
        let candidates = found.best.as_ref()?.hypothesis.candidates();
        let index = candidates.iter().position(|term| term.kind == friction.kind)?;
        (found.named.len() > 1).then_some(Self { found, index })
    }

    /// It, where it is likelier by so much than what the first search came to; where that is friction that differs by the direction alone, which does what dry friction does beside a load,
    /// also where it is as likely.
    pub fn instead_of(mut self, reached: &Fit, margin: f64) -> Option<Found> {
        let ahead = 0.5 * (priced(reached) - priced(self.found.best.as_ref()?));
        let as_likely = includes_a_load(reached);
        if ahead < if as_likely.is_some() { -margin } else { margin } {
            return None;
        }
        let named = as_likely.zip(self.found.named.get_mut(self.index)).filter(|_| ahead < margin);
        if let Some((kind, choice)) = named.filter(|(kind, choice)| !choice.tied.contains(&kind.name)) {
            choice.tied.push(kind.name);
        }
        Some(self.found)
    }
}

/// The field beside friction, where a short fit of a kind beside it promises what was reached without.
fn promising_field(friction: &Fit, data: &Data, least: f64, reached: &Fit) -> Option<Field> {
    let look = data.look();
    let (base, reached) = (friction.on_look(data)?, reached.on_look(data)?.objective());
    let glance =
        Glance::of(&base, look, Round::Later(least)).filter(|glance| glance.bounds(0.0).1 <= reached)?;
    let sketch = glance.sketched(look);
    let gain = sketch.short.iter().map(|(_, fit)| gain_over(&sketch.seen, fit)).fold(0.0, f64::max);
    let promised = sketch.seen.objective() - 2.0 * (SHORTENED * gain + CLOSE);
    if promised > reached {
        return None;
    }
    sketch.finished(&base, data)
}

/// Whether a fit's first candidate is dry friction.
pub fn is_friction_first(fit: &Fit) -> bool {
    fit.hypothesis.candidates().first().is_some_and(|term| term.kind.name == FRICTION)
}

/// The kind that a fit has alone, where that is a friction of which a load is a part.
fn includes_a_load(fit: &Fit) -> Option<&'static Kind> {
    let [term] = fit.hypothesis.candidates() else { return None };
    let is_load = term.kind.parameters.iter().any(|parameter| parameter.shared == Some(Shared::ConstantLoad));
    is_load.then_some(term.kind)
}
