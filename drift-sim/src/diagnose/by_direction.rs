//! Friction by direction on top of dry friction that is already in the model. Both have a dry level and the plant has a
//! viscous number as well, so that only differences can be fitted: one direction's extra dry level is held at zero (the
//! smaller side is the dry friction's own), and the plant's viscous number is held where it is.

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
    [0, 1]
        .into_iter()
        .map(|greater| {
            let mut parameters = vec![0.0, 0.0, -0.05 * viscous, 0.05 * viscous];
            if let Some(side) = parameters.get_mut(greater) {
                *side = 0.02 * level;
            }
            let term = Term { kind, parameters, onset_s: 0.0, spans: Vec::new() };
            let with = held.with_term(&term, false, duration_s);
            let model = with.held(Target::Term { term: index, parameter: 1 - greater });
            Trial { model, term, share: 0.0 }
        })
        .collect()
}
