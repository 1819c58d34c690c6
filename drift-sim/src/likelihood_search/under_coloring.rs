//! The search once more under colored noise, where it left none of the kind that is reckoned with.

use crate::estimate::fit::Fit;
use crate::estimate::whiten::Whitener;
use crate::stage;

use super::decide::COLORED;
use super::found::Found;
use super::glance::{Glance, Round};
use super::options::Options;
use super::plants::Identified;
use super::search::Search;
use super::{gone_on, rivals};

/// The search beside a guessed plant under noise that is colored as what the likeliest of its fits left; `None` where that left noise, where nothing is named then, or where what is
/// left is no noise either.
pub fn searched(found: &Identified, ended: &Found, options: &Options) -> Option<(Identified, Found)> {
    if ended.is_noise || !found.is_guessed {
        return None;
    }
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
    let is_plant_open = !data.has_healthy();
    let result = Search { data: &data, options, is_plant_open }.run(field);
    let is_found = result.is_noise && !result.named.is_empty();
    is_found.then_some((Identified { nominal, data, is_guessed: true }, result))
}
