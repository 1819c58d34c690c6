//! What the report of a diagnosis that left something open says of the experiment to run: the reference, its chance, and the command that writes it.

use std::path::Path;

use super::{Limits, OpenDiagnosis, Recorded, Request};
use crate::control_loop::Loop;
use crate::diagnose::{Diagnosis, Verdict};
use crate::sentences::{chance, planning};

/// Chance that is asked for, and of a reference that is proposed at least.
const ASKED: f64 = 0.98;
const WORTH: f64 = 0.5;
/// Samples of the longest reference that is rehearsed for a report: a report is not to take longer for it.
const MOST: usize = 6_000;

/// The experiment and what to type; `None` where nothing is open, the law is unknown, or no numbers of the causes are known.
pub fn proposal(
    found: &Diagnosis,
    recorded: Recorded,
    stated: &Loop,
    loop_file: Option<&Path>,
) -> Option<String> {
    let is_open = matches!(found.verdict, Verdict::Located | Verdict::Undecided);
    let left = found.causes.iter().filter(|cause| cause.is_left).count();
    if !is_open || left < 2 || !stated.has_law() || !stated.inputs.is_empty() {
        return None;
    }
    let file = loop_file.map_or_else(|| "LOOP.toml".to_owned(), |file| file.display().to_string());
    let command = format!("drift plan {file} --diagnosis D.json -o REFERENCE.csv");
    let [low, high] = recorded.r_range;
    if low >= high {
        return Some(format!(
            "r never moved: which reference would tell them apart, within limits of r that you state, says {command} --r-min LOW --r-max HIGH \
             (D.json is what --json writes)."
        ));
    }
    let longest_s = recorded.duration_s.min(MOST as f64 * stated.sample_time_s);
    let request = Request {
        stated: stated.clone(),
        open: OpenDiagnosis { verdict: found.verdict.name().into(), causes: found.causes.clone(), recorded },
        limits: Limits { longest_s: Some(longest_s), ..Limits::default() },
        chance: ASKED,
        seed: 0,
    };
    let plan = request.plan().ok().filter(|plan| plan.chance() > WORTH);
    Some(match plan {
        Some(plan) => format!(
            "{} The cause is then named with a chance of {} at least: {command} (D.json is what --json writes).",
            planning(&plan).sentence,
            chance(plan.chance())
        ),
        None => format!(
            "No reference within the range of this recording would tell them apart for sure; with wider limits: {command} --r-min LOW --r-max HIGH \
             (D.json is what --json writes)."
        ),
    })
}
