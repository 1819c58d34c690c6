//! Where a recording begins: y as measured, the plant near equilibrium under what was held before.

use crate::control_loop::Loop;
use crate::controller::Controller;
use crate::simulate::{Simulation, Start};

use super::hypothesis::Realised;
use super::signals::{Signals, held};

/// Samples over which the first u is averaged.
const FIRST: usize = 5;
/// Samples that a dead time is looked at for, at most.
const LONGEST_LOOK: usize = 200;

/// What was in a dead time before the recording: about the first u, or what holds y where it begins, whichever foretells y over the dead time better. A
/// recording may begin with a step.
fn held_before(model: &Loop, signals: &Signals, known: &Start, mean: f64) -> f64 {
    let late = libm::ceil(model.plant.delay_s() / model.sample_time_s) as usize;
    let Some(rest) = model.plant.u_at_rest(known.y).filter(|_| late > 0) else { return mean };
    let look = (late + 2).min(LONGEST_LOOK).min(signals.len());
    let missed = |u: f64| -> Option<f64> {
        let start = Start { u, state: None, ..known.clone() };
        let start = Start { state: start.state_for(model).ok(), ..start };
        let mut simulation = Simulation::with_substeps(model, 0, 1).ok()?;
        simulation.start(&start).ok()?;
        let inputs = vec![0.0; signals.inputs.len()];
        let pairs = signals.u.iter().zip(&signals.y).take(look);
        let errors =
            pairs.map(|(u, y)| (simulation.replay_step(*u, &inputs).y, y)).filter(|(_, y)| y.is_finite());
        Some(errors.map(|(simulated, y)| (simulated - y) * (simulated - y)).sum())
    };
    match (missed(mean), missed(rest)) {
        (Some(of_mean), Some(of_rest)) if of_rest < of_mean => rest,
        _ => mean,
    }
}

/// Where a recording begins: y as measured, the plant near equilibrium under what was held before, which is in the dead time. A law with an
/// integrator tells what that was (the first u may be the kick of a step); else it is about the first u.
pub fn start(realised: &Realised, signals: &Signals) -> Start {
    let model = &realised.model;
    let first = signals.len().min(FIRST);
    let y = held(signals.y.get(..first).unwrap_or(&[]));
    let u = signals.u.get(..first).unwrap_or(&[]);
    let known = Start::from_recording(model, &signals.r, &y, &signals.u);
    let u = match &model.controller {
        Controller::Pi(_) | Controller::Pid(_) => known.u,
        Controller::PVelocity(_) | Controller::Recorded => {
            let mean = u.iter().sum::<f64>() / u.len().max(1) as f64;
            held_before(model, signals, &known, mean)
        }
    };
    // At equilibrium the load that stays, and what was measured of it first, take their part of u.
    let drive_gain = model.plant.drive_gain();
    let first = model.inputs.iter().zip(&signals.inputs);
    let measured = first.map(|(input, values)| {
        input.load(drive_gain, input.gain.value() * values.first().copied().unwrap_or(0.0))
    });
    let load = realised.constant_load + measured.sum::<f64>();
    let net = Start { u: u - load / drive_gain, state: None, ..known };
    let state = net.state_for(model).ok();
    Start { u, state, ..net }
}
