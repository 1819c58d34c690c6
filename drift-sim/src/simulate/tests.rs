//! Against closed forms and against other ways of computing the same thing.

mod paths;
mod starts;

use super::*;
use crate::controller::{Controller, Limits, PVelocity, Pi, VelocityRule};
use crate::measured_input::Gain;
use crate::physics::{Term, Units};
use crate::plant::{FirstOrder, Output, Servo, StateSpace, Tank, TransferFunction};
use crate::reference::Reference;

fn around(plant: Plant, sample_time_s: f64) -> Loop {
    Loop {
        sample_time_s,
        units: Units::default(),
        controller: Controller::Recorded,
        plant,
        sensor: crate::control_loop::Sensor::default(),
        inputs: Vec::new(),
        physics: Vec::new(),
    }
}

fn servo(output: Output, viscous: f64) -> Plant {
    Plant::Servo(Servo { output, inertia: 2.0, viscous, actuator_gain: 5.0 })
}

fn term(kind: &str, parameters: &[(&str, f64)]) -> Term {
    Term::new(kind, parameters).unwrap()
}

fn heater(delay_s: f64) -> Plant {
    Plant::FirstOrder(FirstOrder { gain: 0.8, time_constant_s: 20.0, delay_s, offset: 21.0 })
}

fn near(got: f64, want: f64, tolerance: f64) {
    assert!((got - want).abs() <= tolerance, "{got} is not {want}");
}

#[test]
fn a_first_order_step_is_its_exponential_also_with_a_fractional_dead_time() {
    for delay_s in [0.0, 3.0, 2.3] {
        let trace = replay(&around(heater(delay_s), 1.0), &[10.0; 60], &[], 0, None).unwrap();
        for (n, y) in trace.y.iter().enumerate() {
            let since = (n as f64 - delay_s).max(0.0);
            near(*y, 21.0 + 8.0 * (1.0 - (-since / 20.0).exp()), 1e-11);
        }
    }
}

#[test]
fn a_servo_with_viscous_friction_is_its_closed_form() {
    let (u, ts, m, b) = (0.4, 0.01, 2.0, 3.0);
    let trace = replay(&around(servo(Output::Position, b), ts), &[u; 200], &[], 0, None).unwrap();
    for (n, y) in trace.y.iter().enumerate() {
        let (t, v) = (n as f64 * ts, 5.0 * u / b);
        near(*y, v * (t - m / b * (1.0 - (-b / m * t).exp())), 1e-12);
    }
}

/// The same plant three ways: as a servo, as a transfer function, as a state space with two idle states (which takes
/// the path for up to four).
#[test]
fn the_same_plant_in_other_words_moves_the_same() {
    let a = vec![
        vec![0.0, 1.0, 0.0, 0.0],
        vec![0.0, -1.5, 0.0, 0.0],
        vec![0.0, 0.0, -1.0, 0.0],
        vec![0.0, 0.0, 0.0, -2.0],
    ];
    let (b, c) = (vec![0.0, 2.5, 0.0, 0.0], vec![1.0, 0.0, 0.0, 0.0]);
    let wide = Plant::StateSpace(StateSpace { a, b, c, d: 0.0 });
    let fraction = TransferFunction { num: vec![5.0], den: vec![2.0, 3.0, 0.0], delay_s: 0.0, offset: 0.0 };
    let u: Vec<f64> = (0..300).map(|n| (f64::from(n) * 0.1).sin()).collect();
    let y = |plant| replay(&around(plant, 0.02), &u, &[], 0, None).unwrap().y;
    let servo = y(servo(Output::Position, 3.0));
    for other in [y(Plant::TransferFunction(fraction)), y(wide)] {
        for (a, b) in servo.iter().zip(&other) {
            near(*a, *b, 1e-12);
        }
    }
}

/// m dv/dt = -b v - f from v0: stops after m/b ln(1 + b v0/f), having gone m v0/b - m f/b^2 ln(1 + b v0/f).
#[test]
fn a_sliding_mass_stops_when_and_where_it_must_and_stays() {
    let (m, v0, f) = (2.0, 1.503, 4.0);
    for b in [3.0, 0.0] {
        let model = around(servo(Output::Position, b), 0.01).with(term("coulomb_friction", &[("level", f)]));
        let mut simulation = Simulation::new(&model, 0).unwrap();
        simulation.start(&Start { velocity: v0, ..Start::default() }).unwrap();
        let (time, way) = if b == 0.0 {
            (m * v0 / f, m * v0 * v0 / (2.0 * f))
        } else {
            let log = (1.0 + b * v0 / f).ln();
            (m / b * log, m * v0 / b - m * f / (b * b) * log)
        };
        for _ in 0..(time / 0.01) as usize {
            simulation.replay_step(0.0, &[]);
            assert!(simulation.state()[1] > 0.0);
        }
        simulation.replay_step(0.0, &[]);
        assert_eq!(simulation.state()[1], 0.0, "stopped within the sample that the closed form says");
        near(simulation.state()[0], way, 1e-12);
        let place = simulation.state()[0];
        for n in 0..10_000 {
            // Just within the breakaway force of 4 = 5*0.8, both ways.
            let sign = if n % 700 < 350 { 1.0 } else { -1.0 };
            simulation.replay_step(0.7999999 * sign, &[]);
        }
        assert_eq!(simulation.state(), [place, 0.0], "no creep at all");
        simulation.replay_step(0.81, &[]);
        assert!(simulation.state()[1] > 0.0);
    }
}

#[test]
fn friction_of_a_constant_kind_needs_no_substeps_and_others_converge_with_their_square() {
    let reference: Vec<f64> = (0..2000).map(|n| 0.1 * (f64::from(n) * 0.004).sin()).collect();
    let cascade = PVelocity { kp: 20.0, kv: 20.0, velocity: VelocityRule::Backward, limits: Limits::NONE };
    let mut model = around(servo(Output::Position, 1.0), 0.002);
    model.controller = Controller::PVelocity(cascade);
    let end = |model: &Loop, substeps| {
        let mut simulation = Simulation::with_substeps(model, 0, substeps).unwrap();
        let u = reference.iter().map(|r| simulation.step(*r, &[]).u);
        u.collect::<Vec<_>>()
    };
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let coulomb = model.clone().with(term("coulomb_friction", &[("level", 1.0)]));
    assert_eq!(end(&coulomb, 1), end(&coulomb, 64));
    let spring = model.clone().with(term("stiffness", &[("stiffness", 300.0)]));
    let drag = model.with(term("quadratic_drag", &[("coefficient", 400.0)]));
    for model in [spring, drag] {
        let fine = end(&model, 256);
        let (four, eight) = (apart(&end(&model, 4), &fine), apart(&end(&model, 8), &fine));
        assert!(four < 1e-4 && eight < 0.3 * four, "{four} {eight}");
    }
}

/// Against 100 times as many sub-steps: what the stated accuracy is worth.
#[test]
fn substeps_are_fine_enough_for_every_kind_that_needs_them() {
    let tank = Plant::Tank(Tank { area: 2.0, inflow_gain: 0.5, outflow: 0.4 });
    let cases = [
        // From empty, where the root is singular.
        (around(tank, 1.0), None, 2e-3),
        (around(heater(2.3), 1.0), Some(term("radiation", &[("coefficient", 3e-9)])), 5e-4),
        (around(heater(0.0), 1.0), Some(term("unmodelled_lag", &[("time_constant_s", 5.0)])), 2e-3),
        (around(heater(0.0), 1.0), Some(term("leak", &[("coefficient", 0.4)])), 1e-4),
        (around(heater(0.0), 1.0), Some(term("rate_limit", &[("limit_per_s", 1.7)])), 1e-3),
        (
            around(heater(0.0), 1.0),
            Some(term("flexible_mode", &[("frequency_hz", 0.05), ("damping", 0.1)])),
            1e-2,
        ),
    ];
    for (model, term, tolerance) in cases {
        let model = term.map_or(model.clone(), |term| model.with(term));
        let run = |substeps| {
            let mut simulation = Simulation::with_substeps(&model, 0, substeps).unwrap();
            let y = (0..400).map(|n| simulation.replay_step(if n % 97 < 40 { 10.0 } else { 3.0 }, &[]).y);
            y.collect::<Vec<_>>()
        };
        let worst =
            run(SUBSTEPS).iter().zip(&run(100 * SUBSTEPS)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < tolerance && worst > tolerance / 100.0, "{:?}: {worst}", model.physics);
    }
}

/// Two lags in series have a closed form.
#[test]
fn an_unmodelled_lag_in_front_of_a_first_order_plant_is_a_second_order_one() {
    let model = around(heater(0.0), 1.0).with(term("unmodelled_lag", &[("time_constant_s", 5.0)]));
    let mut simulation = Simulation::with_substeps(&model, 0, 64).unwrap();
    simulation.replay_step(0.0, &[]);
    for n in 0..100 {
        let t = f64::from(n);
        let want = 21.0 + 8.0 * (1.0 - (20.0 * (-t / 20.0).exp() - 5.0 * (-t / 5.0).exp()) / 15.0);
        near(simulation.replay_step(10.0, &[]).y, want, 1e-4);
    }
}

#[test]
fn a_tank_empties_by_torricellis_law_and_stays_empty() {
    let tank = Plant::Tank(Tank { area: 2.0, inflow_gain: 1.0, outflow: 0.4 });
    let mut simulation = Simulation::new(&around(tank, 0.5), 0).unwrap();
    simulation.start(&Start { y: 4.0, ..Start::default() }).unwrap();
    for n in 0..100 {
        let level = simulation.replay_step(0.0, &[]).y;
        // sqrt(h) falls by outflow/(2 area) a second.
        let root = (2.0 - 0.1 * 0.5 * f64::from(n)).max(0.0);
        near(level, root * root, 1e-4);
    }
    assert_eq!(simulation.state()[0], 0.0);
}

/// What reaches a unit-gain, memoryless plant (one fast pole) over a triangle of u: the static curves.
fn through_actuator(term: Term, u: &[f64]) -> Vec<f64> {
    let plant = Plant::FirstOrder(FirstOrder { gain: 1.0, time_constant_s: 1e-3, delay_s: 0.0, offset: 0.0 });
    let trace = replay(&around(plant, 1.0).with(term), u, &[], 0, None).unwrap();
    trace.y[1..].to_vec()
}

#[test]
fn terms_have_their_static_curves() {
    let u = [0.0, 1.0, 2.0, 3.0, 2.0, 1.0, 0.0, -1.0, -2.0, -3.0, -2.0, 0.0];
    let cases: [(Term, [f64; 11]); 7] = [
        (
            term("dead_zone", &[("half_width", 1.5)]),
            [0.0, 0.0, 0.5, 1.5, 0.5, 0.0, 0.0, 0.0, -0.5, -1.5, -0.5],
        ),
        (
            term("saturation", &[("lower", -1.0), ("upper", 2.0)]),
            [0.0, 1.0, 2.0, 2.0, 2.0, 1.0, 0.0, -1.0, -1.0, -1.0, -1.0],
        ),
        (term("backlash", &[("width", 2.0)]), [0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 1.0, 0.0, -1.0, -2.0, -2.0]),
        (
            term("stiction", &[("stick_band", 1.5), ("slip_jump", 0.5)]),
            [0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 1.0, 0.0, -1.0, -2.0, -2.0],
        ),
        (
            term("gain_loss", &[("loss", 0.25)]),
            [0.0, 0.75, 1.5, 2.25, 1.5, 0.75, 0.0, -0.75, -1.5, -2.25, -1.5],
        ),
        // At the sensor of a plant that follows u at once.
        (
            term("sensor_hysteresis", &[("width", 2.0)]),
            [0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 1.0, 0.0, -1.0, -2.0, -2.0],
        ),
        (
            term("injected_signal", &[("level", 5.0)]).within(&[(2.0, 4.0)]),
            [0.0, 1.0, 7.0, 8.0, 2.0, 1.0, 0.0, -1.0, -2.0, -3.0, -2.0],
        ),
    ];
    for (term, want) in cases {
        let name = term.kind.name;
        for (got, want) in through_actuator(term, &u).iter().zip(want) {
            assert!((got - want).abs() < 1e-9, "{name}: {got} is not {want}");
        }
    }
}

#[test]
fn delay_of_whole_samples_shifts_and_comes_at_its_onset() {
    let u: Vec<f64> = (0..20).map(f64::from).collect();
    let late = through_actuator(term("delay", &[("delay_s", 3.0)]).from_s(10.0), &u);
    for (n, w) in late.iter().enumerate() {
        let want = if n < 10 { n as f64 } else { n as f64 - 3.0 };
        near(*w, want, 1e-9);
    }
}

#[test]
fn sensor_drift_ends_at_the_papers_mu_max_and_sigma_growth() {
    let (length_s, mu_max, sigma_growth) = (10.0, 4.0, 1.5);
    let rates = [("rate_per_s", mu_max / length_s), ("noise_growth_per_s", sigma_growth / length_s)];
    let model = Loop::paper().with(term("sensor_drift", &rates));
    let mut ends = Vec::new();
    for seed in 0..2000 {
        let mut simulation = Simulation::new(&model, seed).unwrap();
        simulation.tick = 10_000;
        let step = simulation.replay_step(0.0, &[]);
        ends.push(step.y - step.true_y);
    }
    let mean = ends.iter().sum::<f64>() / 2000.0;
    let sd = (ends.iter().map(|end| (end - mean) * (end - mean)).sum::<f64>() / 2000.0).sqrt();
    // Four standard errors: 1.5/sqrt(2000) = 0.034 and 1.5/sqrt(4000) = 0.024.
    near(mean, mu_max, 0.134);
    near(sd, sigma_growth, 0.095);
}

#[test]
fn another_term_does_not_change_the_noise_of_one() {
    let drift = || term("sensor_drift", &[("rate_per_s", 0.0), ("noise_growth_per_s", 1.0)]);
    let alone = Loop::paper().with(drift());
    let behind = Loop::paper().with(term("sensor_bias", &[("bias", 0.0)])).with(drift());
    let reference = Reference::paper(1).take_samples(500);
    let y = |model| simulate(model, &reference, &[], 9, None).unwrap().y;
    assert_eq!(y(&alone), y(&behind));
}

#[test]
fn the_sensors_own_noise_grows_by_the_terms_ratio() {
    let mut model = around(heater(0.0), 1.0).with(term("sensor_noise", &[("ratio", 3.0)]).from_s(5000.0));
    model.sensor.noise = 0.1;
    let trace = replay(&model, &[0.0; 10_000], &[], 4, None).unwrap();
    let sd = |from: usize| {
        let off: Vec<f64> = (from..from + 5000).map(|n| trace.y[n] - trace.true_y[n]).collect();
        (off.iter().map(|off| off * off).sum::<f64>() / 5000.0).sqrt()
    };
    // Standard errors of 1 %.
    near(sd(0), 0.1, 0.004);
    near(sd(5000), 0.3, 0.012);
}

/// The unmatched part of the real mode can't be reached: it decays alone, and the paper's loop follows its reference.
#[test]
fn the_papers_loop_follows_its_reference() {
    let reference = Reference::paper(7).take_samples(10_000);
    let trace = simulate(&Loop::paper(), &reference, &[], 0, None).unwrap();
    // At the end of each level, 50 ms after its step, the error is down to exp(-300*0.05) and what ki still owes.
    for n in (49..10_000).step_by(50) {
        near(trace.y[n], reference[n], 0.05);
    }
}

/// PI and state space recomputed sample by sample in the plainest way.
#[test]
fn the_papers_loop_is_the_plain_recursion() {
    let model = Loop::paper();
    let Plant::StateSpace(plant) = &model.plant else { panic!() };
    let held = crate::plant::zero_order_hold::discretise(plant, 0.001).unwrap();
    let reference = Reference::paper(2).take_samples(3000);
    let trace = simulate(&model, &reference, &[], 0, None).unwrap();
    let (mut x, mut integrator) = ([0.0; 3], 0.0);
    for (n, r) in reference.iter().enumerate() {
        let e = r - x[0];
        integrator += 100.0 * 0.001 * e;
        let u = 300.0 * e + integrator;
        near(trace.u[n], u, 1e-9);
        let old = x;
        for (i, slot) in x.iter_mut().enumerate() {
            *slot = (0..3).map(|j| held.phi[3 * i + j] * old[j]).sum::<f64>() + held.gamma[i] * u;
        }
    }
}

#[test]
fn measured_inputs_enter_where_they_are_said_to() {
    let mut model = around(heater(0.0), 1.0);
    let input = |enters| Input::of_column("d", enters, Gain::Stated(2.0));
    let y = |model: &Loop| replay(model, &[10.0; 400], &[vec![1.0; 400]], 0, None).unwrap().y[399];
    for (enters, want) in
        [(Enters::Actuator, 29.0 + 1.6), (Enters::Load, 29.0 - 2.0), (Enters::Sensor, 29.0 + 2.0)]
    {
        model.inputs = vec![input(enters)];
        near(y(&model), want, 1e-6);
    }
    model.inputs = vec![input(Enters::Load)];
    assert!(replay(&model, &[1.0], &[], 0, None).is_err());
}

#[test]
fn an_unstable_loop_is_said_to_diverge_and_when() {
    let mut model = Loop::paper();
    model.controller = Controller::Pi(Pi { kp: -300.0, ki: -100.0, limits: Limits::NONE, anti_windup: true });
    let error = simulate(&model, &[1.0; 100_000], &[], 0, None).unwrap_err().to_string();
    assert!(error.starts_with("the loop diverges: not finite at t = "), "{error}");
}

#[test]
fn what_can_not_be_simulated_is_refused() {
    let refused = |model: &Loop| Simulation::new(model, 0).err().unwrap().to_string();
    assert!(refused(&around(Plant::Identify, 1.0)).contains("identify"));
    let heater = around(heater(0.0), 1.0);
    assert!(
        refused(&heater.clone().with(term("coulomb_friction", &[("level", 1.0)]))).contains("first-order")
    );
    assert!(refused(&heater.clone().with(term("delay", &[("delay_s", 1e9)]))).contains("dead time"));
    assert!(refused(&heater.clone().with(term("injected_signal", &[("level", 1.0)]))).contains("spans"));
    assert!(simulate(&heater, &[1.0], &[], 0, None).unwrap_err().to_string().contains("recorded"));
}

/// Parameters of the size of the signals: where a search would begin, or a third of each scale from where the term does nothing.
fn typical(kind: &crate::physics::Kind) -> Vec<Vec<f64>> {
    let scales = crate::physics::Scales::default();
    match kind.search.points(&scales) {
        Some(points) => points.into_iter().take(1).map(|start| start.parameters).collect(),
        None => vec![kind.parameters.iter().map(|p| p.neutral + 0.3 * (p.scale)(&scales, 1.0)).collect()],
    }
}

/// Every kind, on every plant that it can act on, at its own starting values: runs, changes something, and does so
/// in the same way from the same seed.
#[test]
fn every_kind_acts_on_every_plant_that_it_says() {
    let fraction = TransferFunction { num: vec![2.0], den: vec![4.0, 5.0, 1.0], delay_s: 0.7, offset: 0.0 };
    let plants = [
        servo(Output::Position, 1.0),
        servo(Output::Speed, 1.0),
        heater(1.5),
        Plant::TransferFunction(fraction),
        Plant::Tank(Tank { area: 2.0, inflow_gain: 1.0, outflow: 0.4 }),
    ];
    for plant in plants {
        let mut model = around(plant, 0.05);
        model.controller = Controller::Pi(Pi { kp: 1.0, ki: 0.05, limits: Limits::NONE, anti_windup: true });
        model.sensor.noise = 1e-3;
        let reference: Vec<f64> = (0..600).map(|n| 22.0 + 3.0 * (f64::from(n) * 0.02).sin()).collect();
        let run = |model: &Loop| {
            let run = simulate(model, &reference, &[], 5, None);
            run.unwrap_or_else(|e| panic!("{:?} on {}: {e}", model.physics, model.plant.kind()))
        };
        let without = run(&model);
        for kind in crate::physics::KINDS.iter().filter(|kind| (kind.applies)(&model.plant)) {
            for parameters in typical(kind) {
                let spans = if kind.name == "injected_signal" { vec![(5.0, 10.0)] } else { Vec::new() };
                let model = model.clone().with(Term { kind, parameters, onset_s: 2.0, spans });
                let with = run(&model);
                assert_eq!(with, run(&model), "{}", kind.name);
                for (a, b) in with.y.iter().zip(&without.y).take(40) {
                    // Another way of stepping rounds differently.
                    assert!(
                        (a - b).abs() < 1e-9 * (1.0 + a.abs()),
                        "{} before its onset: {a} {b}",
                        kind.name
                    );
                }
                assert_ne!(with.y[40..], without.y[40..], "{} on {}", kind.name, model.plant.kind());
            }
        }
    }
}
