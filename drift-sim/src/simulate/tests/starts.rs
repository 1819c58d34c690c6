//! From equilibrium, from what a recording shows of its beginning, from a limit.

use super::*;

#[test]
fn a_start_from_equilibrium_stays_there() {
    let pi = Pi { kp: 2.0, ki: 0.1, limits: Limits::NONE, anti_windup: true };
    let fraction = TransferFunction { num: vec![2.0], den: vec![4.0, 5.0, 1.0], delay_s: 0.7, offset: 0.0 };
    for (plant, y, u) in [(heater(2.3), 29.0, 10.0), (Plant::TransferFunction(fraction), 6.0, 3.0)] {
        let mut model = around(plant, 0.5);
        model.controller = Controller::Pi(pi);
        let trace = simulate(&model, &[y; 200], &[], 0, Some(&Start::held(y, u))).unwrap();
        for (got_y, got_u) in trace.y.iter().zip(&trace.u) {
            near(*got_y, y, 1e-9);
            near(*got_u, u, 1e-8);
        }
    }
}

/// The second state is an integrator that y does not show and u does not reach: nothing determines it.
#[test]
fn a_start_leaves_at_zero_what_nothing_determines() {
    let a = vec![vec![-1.0, 0.0], vec![0.0, 0.0]];
    let plant = StateSpace { a, b: vec![1.0, 0.0], c: vec![1.0, 0.0], d: 0.0 };
    let mut simulation = Simulation::new(&around(Plant::StateSpace(plant), 0.1), 0).unwrap();
    simulation.start(&Start::held(3.0, 3.0)).unwrap();
    near(simulation.state()[0], 3.0, 1e-9);
    near(simulation.state()[1], 0.0, 1e-9);
}

/// A run from rest that begins with a reference's step is reproduced from its own first samples.
#[test]
fn a_recording_gives_back_its_own_start() {
    let reference = Reference::paper(3).take_samples(500);
    let mut model = around(heater(2.3), 0.5);
    model.controller = Controller::Pi(Pi { kp: 2.0, ki: 0.1, limits: Limits::NONE, anti_windup: true });
    for model in [Loop::paper(), model] {
        let first = simulate(&model, &reference, &[], 0, None).unwrap();
        let start = Start::from_recording(&model, &reference, &first.y, &first.u);
        let again = simulate(&model, &reference, &[], 0, Some(&start)).unwrap();
        for (a, b) in first.u.iter().zip(&again.u) {
            near(*a, *b, 1e-6);
        }
    }
}

/// What the first u, at a limit, does not tell: the integrator of a heater that was switched off, and of a run that is cut while u is
/// at its limit. Against the run that the recording was cut from.
#[test]
fn a_recording_that_begins_at_a_limit_tells_its_integrator_where_u_leaves_it() {
    let mut model = around(heater(0.0), 1.0);
    let limits = Limits { u_min: 0.0, u_max: 20.0 };
    model.controller = Controller::Pi(Pi { kp: 2.0, ki: 0.05, limits, anti_windup: true });
    let reference: Vec<f64> = (0..400).map(|n| if n < 40 { 0.0 } else { 35.0 }).collect();
    let all = simulate(&model, &reference, &[], 0, None).unwrap();
    assert_eq!((all.u[0], all.u[42]), (0.0, 20.0));
    for from in [0, 20, 42] {
        let (r, y, u) = (&reference[from..], &all.y[from..], &all.u[from..]);
        let start = Start::from_recording(&model, r, y, u);
        let replayed = replay_law(&model, r, y, &start);
        for (a, b) in replayed.iter().zip(u) {
            near(*a, *b, 1e-4);
        }
    }
}
