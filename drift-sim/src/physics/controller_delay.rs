//! A controller whose u comes late; between samples u is taken as a straight line, so that a part of a sample means
//! something.

use std::collections::VecDeque;

use super::{Begins, Effect, Hook, Kind, Parameter, Place, Range, Starts, any_values, every_plant, shown};

pub(super) static KIND: Kind = Kind {
    name: "controller_delay",
    place: Place::Controller,
    begins: Begins::Start,
    parameters: &[Parameter::new("delay_s", "s", Range::NotNegative, |s, _| 10.0 * s.sample_time_s)],
    applies: every_plant,
    consistent: any_values,
    effect: |p, context| Box::new(ControllerDelay::new(p[0] / context.sample_time_s)),
    search: Starts::Apart,
    family: None,
    excitation: "Sharp edges in r.",
    ties: &["delay"],
    experiment: "Replay the stated law on the recorded r and y: its u must be the recorded one, without a shift.",
    says: |p, _| format!("The controller's u comes {} late.", shown(p[0], "s")),
};

#[derive(Clone)]
struct ControllerDelay {
    whole: usize,
    part: f64,
    past: VecDeque<f64>,
}

impl Effect for ControllerDelay {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Command]
    }

    fn command(&mut self, u: f64) -> f64 {
        if self.past.is_empty() {
            self.past.resize(self.whole + 2, u);
        }
        self.past.pop_back();
        self.past.push_front(u);
        let at = |index: usize| self.past.get(index).copied().unwrap_or(u);
        at(self.whole) + self.part * (at(self.whole + 1) - at(self.whole))
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}

impl ControllerDelay {
    /// A delay in samples; more than a million of them is as good as for ever.
    fn new(samples: f64) -> Self {
        let samples = samples.min(1e6);
        Self { whole: samples as usize, part: samples - libm::floor(samples), past: VecDeque::new() }
    }
}
