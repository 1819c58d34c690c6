//! What may stand where the end of a search does not.

use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::{Target, is_noise};
use crate::estimate::likelihood::Data;

use super::found::{Contender, Found};
use super::nominal;
use super::rivals;
use super::search::predicted;

/// Noise of which next to nothing is a load: logarithm of its size over the drive's, its time constant in samples, atanh of what stays of the sensor's; and steps of a fit under it.
const NEXT_TO_NO_LOAD: (f64, f64, f64) = (-6.0, 20.0, 0.0);
const QUIET_STEPS: usize = 20;

impl Found {
    /// What may stand where this does not, the simplest first: what is named alone as another one of its family at its place; nothing, where faults of the law or other numbers do; and where a
    /// law closes the loop, each of these with numbers that were fitted under next to no random load, by which a simulation misses least.
    pub fn others<'a>(&self, data: &'a Data) -> impl Iterator<Item = Self> + use<'a> {
        let family = |fit: &Fit| {
            let kind = fit.hypothesis.candidates().last()?.kind;
            Some((kind.family?, kind.place))
        };
        let named = self.best.as_ref().filter(|_| self.named.len() == 1);
        let of = named.and_then(family);
        let own = named.and_then(rivals::last_kind);
        let is_related = |contender: &&Contender| {
            of.is_some() && family(&contender.fit) == of && rivals::last_kind(&contender.fit) != own
        };
        let related = self.contenders.iter().filter(is_related).filter_map(|contender| {
            let mut named = self.named.clone();
            let choice = named.first_mut()?;
            (choice.gain, choice.tied) = (contender.score, Vec::new());
            Some(Self { best: Some(contender.fit.clone()), named, standing_load: None, ..self.clone() })
        });
        let numbers = |found: &Self| found.best.as_ref().map_or(0, |best| best.hypothesis.free.len());
        let mut found: Vec<Self> = related.collect();
        found.extend(self.best.is_some().then(|| self.clone()));
        found.sort_by_key(numbers);
        found.push(Self {
            best: None,
            named: Vec::new(),
            standing_load: None,
            set: Vec::new(),
            is_proven: false,
            is_noise: false,
            ..self.clone()
        });
        let last = self.best.as_ref().and_then(rivals::last_kind);
        let is_open = !self.base.hypothesis.model.has_law();
        // As it is, this one does not stand.
        let with_quiet = move |found: Self| {
            let quiet = if is_open { None } else { found.under_next_to_no_load(data) };
            let is_another = found.best.as_ref().is_none_or(|best| rivals::last_kind(best) != last);
            quiet.into_iter().chain(is_another.then_some(found))
        };
        found.into_iter().flat_map(with_quiet)
    }

    /// The same with its numbers fitted under next to no random load; `None` where it can't be simulated then.
    fn under_next_to_no_load(&self, data: &Data) -> Option<Self> {
        let base = under_next_to_no_load(&self.base, data)?;
        let best = match &self.best {
            Some(best) => Some(under_next_to_no_load(best, data)?),
            None => None,
        };
        Some(Self { predicted: predicted(&base, data), base, best, standing_load: None, ..self.clone() })
    }
}

/// A fit under next to no random load; `None` where one of its terms does nothing then, or stands in for something else.
fn under_next_to_no_load(fit: &Fit, data: &Data) -> Option<Fit> {
    let hypothesis = &fit.hypothesis;
    // No simulation shows y late.
    let is_held = |target: Target| is_noise(target) || target == Target::Late;
    let is_held = |i: &usize| hypothesis.free.get(*i).is_some_and(|free| is_held(free.target));
    let held: Vec<usize> = (0..hypothesis.free.len()).filter(is_held).collect();
    let (size, tau, rho) = NEXT_TO_NO_LOAD;
    let mut point = nominal::with_noise(hypothesis, &fit.point, size, tau, rho);
    if let Some(x) = hypothesis.place(Target::Late).and_then(|late| point.x.get_mut(late)) {
        *x = 0.0;
    }
    let mut quiet = Fit::at(hypothesis, &point, data)?;
    quiet.descend(data, QUIET_STEPS, &held);
    let mut terms = 0..hypothesis.candidates().len();
    (!terms.any(|term| hypothesis.is_at_an_end(term, &quiet.point))).then_some(quiet)
}
