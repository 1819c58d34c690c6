//! What the reproduction says in a few words: the lines of the terminal, and the figures that page and tables share.

use super::delay::{Delay, SchemeResult};
use super::detection::DetectionCase;
use super::number::significant;
use super::{Paper, published, settings};
use crate::sentences::moved_name;

/// The scheme of this name.
pub(super) fn scheme<'a>(paper: &'a Paper, name: &str) -> Option<&'a SchemeResult> {
    paper.delay.schemes.iter().find(|s| s.scheme.name == name)
}

pub(super) fn at(delays: &[Delay], mu_max: f64) -> Option<&Delay> {
    delays.iter().find(|d| d.mu_max == mu_max)
}

/// Mean delay of the paper's pair over that of the effort channel at this mu_max: (holding, going on).
pub(super) fn times_faster(paper: &Paper, mu_max: f64) -> (f64, f64) {
    let ratio = |of: fn(&SchemeResult) -> &[Delay]| {
        let mean =
            |name| scheme(paper, name).and_then(|s| at(of(s), mu_max)).map_or(f64::NAN, |d| d.delay_s.mean);
        mean("energy_error").min(mean("energy_error_overlapping")) / mean("effort")
    };
    (ratio(|s| &s.holding), ratio(|s| &s.going_on))
}

pub(super) fn alarmed_healthy(paper: &Paper, i: usize) -> f64 {
    100.0 * paper.overlap.charts.get(i).map_or(f64::NAN, |c| c.alarmed.share)
}

pub(super) fn summary(paper: &Paper) -> String {
    let (line, theirs) = (&paper.baseline.line, &published::BASELINE);
    let (holding, _) = times_faster(paper, 1.0);
    let effort = scheme(paper, "effort").and_then(|s| at(&s.holding, 1.0));
    format!(
        "baseline   J_e = {} + {} E_u, R^2 {:.3} ({} windows); published {} + {} E_u, R^2 {:.3}\n\
         overlap    neighbouring residuals correlate by {:.2}: the textbook CUSUM alarms in {:.0} % of healthy 100 s runs,\n           \
         with windows that don't overlap and its threshold from healthy runs in {:.0} %\n\
         delay      a drift of 1 over 100 s, one false alarm per {} s: effort channel after {} s, {:.1} times\n           \
         sooner than the paper's pair",
        significant(line.b0, 3),
        significant(line.b1, 3),
        line.r2,
        line.n,
        theirs.b0,
        significant(theirs.b1, 3),
        theirs.r2,
        paper.overlap.lag1_overlapping.mean,
        alarmed_healthy(paper, 0),
        alarmed_healthy(paper, 5),
        settings::FALSE_ALARM_EVERY_S,
        effort.map_or(String::new(), |d| format!("{:.0}", d.delay_s.mean)),
        holding,
    )
}

pub(super) fn monitor_says(case: Option<&DetectionCase>) -> String {
    let Some(run) = case.map(|c| &c.run) else { return String::new() };
    let verdict = format!("{:?}", run.verdict).to_lowercase();
    match &run.fault_curve {
        Some(curve) => format!(
            "{verdict}; on {} windows {} + {} E_u, {}",
            curve.windows,
            significant(f64::from(curve.b0), 3),
            significant(f64::from(curve.b1), 3),
            moved_name(curve.moved),
        ),
        None => verdict,
    }
}
