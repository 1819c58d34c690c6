//! A drive that acts through a power of u, `sign(u)*|u|^exponent` (valve curves, fans, duty to torque); around |u| = 1
//! in the unit of u nothing changes.

use super::{
    Begins, Effect, Hook, Kind, Parameter, Place, Range, Start, Starts, any_values, every_plant, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "nonlinear_gain",
    place: Place::Plant,
    begins: Begins::Start,
    parameters: &[Parameter::new("exponent", "1", Range::Between(0.05, 20.0), |_, _| 1.0)
        .around(1.0)
        .searched(0.2, 5.0)],
    applies: every_plant,
    consistent: any_values,
    effect: |p, _| Box::new(NonlinearGain { exponent: p[0] }),
    search: Starts::Grid(|s| {
        // The gain beside it so that the drive keeps its size.
        let start = |p: f64| Start { gain: (1.0 - p) * libm::log(s.u_size), ..Start::of(vec![p]) };
        [0.6, 0.8, 1.25, 1.6].map(start).to_vec()
    }),
    family: None,
    excitation: "Small and large u.",
    ties: &["saturation", "gain_loss"],
    experiment: "Hold several levels over the whole range of u: the gain changes steadily, not at an edge.",
    says: |p, _| format!("The drive acts through u to the power {}; the model is linear.", shown(p[0], "1")),
};

#[derive(Clone)]
struct NonlinearGain {
    exponent: f64,
}

impl Effect for NonlinearGain {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Actuator]
    }

    fn actuator(&mut self, _: f64, u: f64) -> f64 {
        libm::copysign(libm::pow(u.abs(), self.exponent), u)
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
