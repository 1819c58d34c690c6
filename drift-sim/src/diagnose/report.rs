//! The diagnosis as JSON, `drift.diagnosis/1`.

use serde_json::{Map, Value, json};

use crate::physics::{Term, UnitNames};
use crate::sentences::{self, Clock};

use super::load_jumps::LoadJumps;
use super::load_waves::LoadWaves;
use super::prove::FitPct;
use super::{Diagnosis, Fits, Named};

/// The whole document; `model` is where the improved loop was written. Onsets and spans count from the first sample, whose time is
/// `start_s` on the recording's clock.
pub fn json(diagnosis: &Diagnosis, model: Option<&str>, clock: &Clock, start_s: f64) -> Value {
    let units = diagnosis.nominal.unit_names();
    let onset = diagnosis.physics.first().map(|p| p.term.onset_s).filter(|t| *t > 0.0);
    let physics: Vec<Value> =
        diagnosis.physics.iter().map(|named| named_json(named, diagnosis, &units)).collect();
    let rows = |rows: &[super::Rejected]| -> Vec<Value> {
        rows.iter()
            .map(|r| {
                let smallest = r.smallest.as_ref().map(|term| parameters_json(term, &units));
                json!({"kind": r.kind, "why": r.why, "smallest_shown": smallest})
            })
            .collect()
    };
    let parameters: Vec<Value> = diagnosis
        .parameters
        .iter()
        .map(|p| json!({"name": p.name, "nominal": p.nominal, "value": p.value, "ci95": interval(p.value, p.half_width)}))
        .collect();
    let mut holdout = fits(&diagnosis.holdout);
    holdout.insert("u_improvement_ci95".into(), json!(diagnosis.improvement));
    json!({
        "schema": "drift.diagnosis/1",
        "answer": sentences::diagnosis(diagnosis, clock, start_s).to_json(),
        "start_s": start_s,
        "verdict": diagnosis.verdict.name(),
        "place": diagnosis.place.map(|p| p.name()),
        "onset_s": onset,
        "spans": diagnosis.spans.iter().map(|span| json!({
            "from_s": span.from_s, "to_s": span.to_s, "score": span.score })).collect::<Vec<_>>(),
        "depends_on": diagnosis.depends_on.iter().map(|d| &d.on).collect::<Vec<_>>(),
        "dependence": diagnosis.depends_on.iter().map(|d| json!({
            "on": d.on, "share": d.share, "errors": d.errors })).collect::<Vec<_>>(),
        "samples_not_used": diagnosis.not_used,
        "more_is_missing": diagnosis.far_off,
        "load_jumps": diagnosis.load_jumps.as_ref().map(LoadJumps::to_json),
        "load_waves": diagnosis.load_waves.as_ref().map(LoadWaves::to_json),
        "physics": physics,
        "candidates": of_kinds(&diagnosis.candidates),
        "rivals": of_kinds(&diagnosis.rivals),
        "parameters": parameters,
        "rejected": rows(&diagnosis.rejected),
        "untestable": rows(&diagnosis.untestable),
        "controller": diagnosis.controller.as_ref().map(|c| json!({
            "error_of_u": c.relative, "gain": c.gain, "shift_samples": c.shift })),
        "fit": {
            "train": fits(&diagnosis.train),
            "holdout": holdout,
            "cycle_s": diagnosis.cycle_s,
            "noise_floor": diagnosis.noise_floor.map(pct),
        },
        "model": model,
    })
}

fn named_json(named: &Named, found: &Diagnosis, units: &UnitNames) -> Value {
    let kind = named.term.kind;
    let parameters: Vec<Value> = kind
        .parameters
        .iter()
        .zip(&named.term.parameters)
        .zip(&named.half_widths)
        .map(|((p, value), width)| {
            json!({"name": p.name, "value": value, "unit": units.unit(p.unit), "ci95": interval(*value, *width)})
        })
        .collect();
    json!({
        "kind": kind.name,
        "place": kind.place.name(),
        "onset_s": named.term.onset_s,
        "spans": spans_json(&named.term),
        "parameters": parameters,
        "first_named_with": named.moved_from().map(|first| parameters_json(first, units)),
        "indistinguishable_from": named.tied,
        "evidence": {"holdout_gain_se": named.holdout_errors, "delta_bic_eff": 2.0 * named.train_gain},
        "says": sentences::says(named, found),
        "may_be_nothing": named.may_be_nothing(),
        "experiment": kind.experiment,
    })
}

/// Kinds with what they gain, in log-likelihood.
fn of_kinds(kinds: &[(&'static str, f64)]) -> Vec<Value> {
    kinds.iter().map(|(kind, gain)| json!({"kind": kind, "gain": gain})).collect()
}

/// The numbers of a term, by name.
fn parameters_json(term: &Term, units: &UnitNames) -> Vec<Value> {
    let parameters = term.kind.parameters.iter().zip(&term.parameters);
    parameters.map(|(p, value)| json!({"name": p.name, "value": value, "unit": units.unit(p.unit)})).collect()
}

/// When a term acts that does so at times.
fn spans_json(term: &Term) -> Vec<Value> {
    term.spans.iter().map(|(from, to)| json!({"from_s": from, "to_s": to})).collect()
}

fn interval(value: f64, half_width: f64) -> Option<[f64; 2]> {
    half_width.is_finite().then_some([value - half_width, value + half_width])
}

fn pct(fit: FitPct) -> Value {
    json!({"y_pct": fit.y_pct, "u_pct": fit.u_pct})
}

fn fits(of: &Fits) -> Map<String, Value> {
    let mut map = Map::new();
    for (name, fit) in [("nominal", of.nominal), ("before", of.before), ("after", of.after)] {
        map.insert(name.into(), fit.map_or(Value::Null, pct));
    }
    map
}
