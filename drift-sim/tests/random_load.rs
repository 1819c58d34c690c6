//! A slow random load beside a recorded loop.

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::signals::Signals;
use drift_sim::measured_input::{Enters, Input};
use drift_sim::recording::{Recording, RowState};
use drift_sim::simulate::{Start, simulate};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

/// A loop over a reference, under a load of this deviation, of which this part stays from one sample to the next.
pub fn recorded(
    model: &Loop,
    r: Vec<f64>,
    (deviation, stays): (f64, f64),
    seed: u64,
    start: Option<&Start>,
) -> Signals {
    let mut loaded = model.clone();
    loaded.inputs.push(Input::made(Enters::Load));
    let loads = random_load(r.len(), deviation, stays, seed);
    let trace = simulate(&loaded, &r, &[loads], seed, start).unwrap();
    let (sample_time_s, state) = (model.sample_time_s, vec![RowState::Valid; r.len()]);
    let recording = Recording { sample_time_s, r, y: trace.y, u: trace.u, state, ..Recording::default() };
    Signals::new(&recording, model).unwrap()
}

/// So many samples of such a load. It begins at nothing.
fn random_load(samples: usize, deviation: f64, stays: f64, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut load = 0.0;
    let next = |_| {
        let normal: f64 = StandardNormal.sample(&mut random);
        load = stays * load + deviation * libm::sqrt(1.0 - stays * stays) * normal;
        load
    };
    (0..samples).map(next).collect()
}
