//! What healthy recordings tell: the plant's numbers, and how much of an event they show themselves. No model is the machine, and what it
//! lacks may look like a load or a bias that comes and goes; what a healthy recording shows of that is no fault in another.

use crate::cores::AcrossCores as _;

use crate::control_loop::Loop;
use crate::{Error, Result};

use super::fit::{Effort, Fit};
use super::model::{self, Model};
use super::signals::Signals;
use super::whiten::Whitener;
use super::{identify, spans};

/// The largest gain in log-likelihood of an event in healthy recordings; infinite where events follow each other without end.
pub(super) fn event_gain(model: &Loop, healthy: &[Signals]) -> f64 {
    let gain = |signals: &Signals| {
        let steps = spans::steps(model, signals)?;
        Some(spans::terms(&steps, signals).iter().map(|acting| acting.gain).fold(0.0, f64::max))
    };
    let gains = healthy.par_iter().map(|signals| gain(signals).unwrap_or(f64::INFINITY));
    gains.fold(0.0, f64::max)
}

/// The loop with its numbers from healthy recordings: each is fitted by itself, the median of every number is taken.
pub(super) fn fitted(model: &Loop, healthy: &[Signals]) -> Result<Loop> {
    let Some(longest) = healthy.iter().max_by_key(|signals| signals.len()) else { return Ok(model.clone()) };
    // One structure for all: that of the longest recording.
    let identified = identify::plant(model, longest)?.map(|found| found.nominal);
    let start = identified.unwrap_or_else(|| model.clone());
    let fitted: Vec<Loop> = healthy
        .par_iter()
        .map(|signals| {
            let start = Model::refit(&start, signals);
            let lost = || Error::new("the model can't follow the u of a healthy recording: it diverges");
            let fit = Fit::start(&start, signals, &Whitener::none()).ok_or_else(lost)?;
            let fit = fit.search(signals, Effort::FULL).settle(signals, Effort::FULL);
            fit.model.loop_at(&fit.model.x).map(|found| found.0).ok_or_else(lost)
        })
        .collect::<Result<_>>()?;
    let numbers = |found: &Loop| -> Vec<f64> {
        model::plant_numbers(&found.plant).into_iter().map(|(_, value, _)| value).collect()
    };
    // A dead time that went to nothing is no number any more.
    let Some(first) = fitted.iter().max_by_key(|found| numbers(found).len()) else {
        return Ok(model.clone());
    };
    let all = numbers(first).len();
    let numbers: Vec<Vec<f64>> = fitted.iter().map(numbers).filter(|row| row.len() == all).collect();
    let median = |i: usize| {
        let mut values: Vec<f64> = numbers.iter().filter_map(|row| row.get(i).copied()).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let medians: Vec<f64> = (0..numbers.first().map_or(0, Vec::len)).map(median).collect();
    let plant = model::with_plant_numbers(&first.plant, &medians);
    Ok(Loop { plant, ..first.clone() })
}
