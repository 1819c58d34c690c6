//! Friction by direction on top of dry friction that is already in the model. Both have a dry level and the plant has a
//! viscous number as well, so that only differences can be fitted: one direction's extra dry level is held at zero (the
//! smaller side is the dry friction's own), and the plant's viscous number is held where it is. A constant load is a difference
//! of dry levels itself: where one is in the model, both extra levels are held.

use crate::physics::{Kind, Term};

use super::model::{Model, Target};
use super::screen::Trial;

/// Starting points for the kind in a model that has dry friction; none where it has not.
pub fn trials(model: &Model, duration_s: f64) -> Vec<Trial> {
    let dry = model.nominal.physics.iter().position(|term| term.kind.name == "coulomb_friction");
    let Some((point, _)) = model.loop_at(&model.x) else { return Vec::new() };
    let Some(level) = dry.and_then(|i| point.physics.get(i)).and_then(|term| term.value("level")) else {
        return Vec::new();
    };
    let viscous = match &point.plant {
        crate::plant::Plant::Servo(p) => p.viscous,
        _ => return Vec::new(),
    };
    let Ok(kind) = Kind::named("directional_friction") else { return Vec::new() };
    let held = model.held(Target::Plant(1));
    let index = held.nominal.physics.len();
    let loaded = point.physics.iter().any(|term| term.kind.name == "load_step" && term.onset_s == 0.0);
    let held_levels: &[&[usize]] = if loaded { &[&[0, 1]] } else { &[&[1], &[0]] };
    held_levels
        .iter()
        .map(|held_levels| {
            let extra = |side: usize| if held_levels.contains(&side) { 0.0 } else { 0.02 * level };
            let parameters = vec![extra(0), extra(1), -0.05 * viscous, 0.05 * viscous];
            let term = Term { kind, parameters, onset_s: 0.0, spans: Vec::new() };
            let with = held.with_term(&term, false, duration_s);
            let hold =
                |model: Model, side: &usize| model.held(Target::Term { term: index, parameter: *side });
            let model = held_levels.iter().fold(with, hold);
            Trial { model, term, share: 0.0 }
        })
        .collect()
}
