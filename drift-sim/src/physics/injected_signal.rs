//! A signal added after u, found by when it acts: `level` within each of the term's spans.

use super::{Begins, Effect, Hook, Kind, Parameter, Place, Range, Starts, any_values, every_plant, shown};

pub(super) static KIND: Kind = Kind {
    name: "injected_signal",
    place: Place::Disturbance,
    begins: Begins::Start,
    parameters: &[Parameter::new("level", "{u}", Range::Any, |s, _| s.u)],
    applies: every_plant,
    consistent: any_values,
    effect: |p, context| Box::new(InjectedSignal { level: p[0], spans: context.spans.to_vec() }),
    search: Starts::Apart,
    family: None,
    excitation: "Spans with the signal and spans without it.",
    ties: &["load_step"],
    experiment: "Disconnect what feeds in after the controller, or record what reaches the actuator.",
    says: |p, units| format!("A signal of {} enters after u at times.", shown(p[0], &units.u)),
};

#[derive(Clone)]
struct InjectedSignal {
    level: f64,
    spans: Vec<(f64, f64)>,
}

impl Effect for InjectedSignal {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Actuator]
    }

    fn actuator(&mut self, t: f64, u: f64) -> f64 {
        let within = self.spans.iter().any(|(from, to)| (*from..*to).contains(&t));
        if within { u + self.level } else { u }
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
