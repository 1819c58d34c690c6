//! The paths through a sample: the short ones give the general one's numbers, and how fast they are.

use super::*;

/// Prints the speed; the floor is far below what a quiet machine does.
#[test]
#[ignore = "slow: a speed, meant for a release build"]
fn the_papers_loop_runs_at_speed() {
    let drift = term("sensor_drift", &[("rate_per_s", 1e-3), ("noise_growth_per_s", 1e-4)]);
    let mut axis = around(servo(Output::Position, 1.0), 1e-3);
    let limits = Limits { u_min: -10.0, u_max: 10.0 };
    let cascade = PVelocity { kp: 5.0, kv: 8.0, velocity: VelocityRule::Backward, limits };
    axis.controller = Controller::PVelocity(cascade);
    let stribeck = [("coulomb", 1.0), ("breakaway", 1.5), ("stribeck_speed", 0.1)];
    let cases = [
        ("the paper's loop", Loop::paper(), 8e6),
        ("with sensor_drift", Loop::paper().with(drift), 6e6),
        ("servo with coulomb_friction", axis.clone().with(term("coulomb_friction", &[("level", 1.0)])), 2e6),
        ("servo with stribeck_friction", axis.with(term("stribeck_friction", &stribeck)), 4e5),
    ];
    for (name, model, floor) in cases {
        let mut simulation = Simulation::new(&model, 1).unwrap();
        let mut reference = Reference::paper(1);
        let steps = if floor > 5e6 { 20_000_000_u32 } else { 2_000_000 };
        let begun = std::time::Instant::now();
        let mut sum = 0.0;
        for _ in 0..steps {
            sum += simulation.step(reference.next().unwrap(), &[]).u;
        }
        let per_second = f64::from(steps) / begun.elapsed().as_secs_f64();
        println!("{name}: {:.1} million steps/s (sum of u {sum})", per_second / 1e6);
        assert!(cfg!(debug_assertions) || per_second > floor, "{per_second}");
    }
}

/// Against the general path, which asks at every sample what acts: the same numbers to the last bit, zeros with their signs.
#[test]
fn the_straight_path_is_the_general_one_to_the_last_bit() {
    let pi = |kp: f64| {
        Controller::Pi(Pi { kp, ki: 0.3 * kp, limits: Limits { u_min: -2.0, u_max: 9.0 }, anti_windup: true })
    };
    let cascade = Controller::PVelocity(PVelocity {
        kp: 2.0,
        kv: 1.5,
        velocity: VelocityRule::Mean2,
        limits: Limits::NONE,
    });
    let paper = Loop { controller: pi(30.0), ..Loop::paper() };
    let mut reference = Reference::random(0.5, 1.0, 20, 3).take_samples(3000);
    reference.iter_mut().take(100).for_each(|r| *r = -0.0);
    for (plant, sample_time_s, law) in [
        (heater(0.0), 1.0, pi(-1.0)),
        (heater(3.0), 1.0, pi(2.0)),
        (servo(Output::Position, 3.0), 0.01, cascade),
        (paper.plant.clone(), 0.001, pi(30.0)),
    ] {
        let model = Loop { controller: law, ..around(plant, sample_time_s) };
        let mut general = Simulation::new(&model, 1).unwrap();
        let mut stepped = Simulation::new(&model, 1).unwrap();
        let trace = simulate(&model, &reference, &[], 1, None).unwrap();
        for (n, r) in reference.iter().enumerate() {
            let (wanted, got) = (general.general_step(*r, &[]), stepped.step(*r, &[]));
            assert!(n == 0 || stepped.is_straight());
            let bits = |step: Step| [step.y, step.u, step.true_y, step.drive].map(f64::to_bits);
            assert_eq!(bits(got), bits(wanted), "sample {n}");
            let shown = [trace.y[n], trace.u[n], trace.true_y[n]].map(f64::to_bits);
            assert_eq!(
                shown,
                [wanted.y, wanted.u, wanted.true_y].map(f64::to_bits),
                "sample {n} of the trace"
            );
            assert_eq!(stepped.state(), general.state());
        }
    }
}

/// Against the general path: also where r is zero of either sign, tiny, so large that u is clipped or infinite, or no number.
#[test]
fn the_shortest_path_is_the_general_one_to_the_last_bit() {
    let limited = Limits { u_min: -2.0, u_max: 9.0 };
    let zeros = [0.0, -0.0, 5e-324, -5e-324, 1e-310, 0.0];
    let usual = Reference::random(0.1, 1.0, 20, 3).take_samples(500);
    let extreme = [1e300, -1e300, 1.0, f64::INFINITY, 1.0, f64::NAN, 0.0];
    for (limits, start) in [(Limits::NONE, 0.0), (Limits::NONE, -0.0), (limited, 0.0)] {
        for extremes in [0, 3, 5, 7] {
            let law = Pi { kp: 30.0, ki: 10.0, limits, anti_windup: true };
            let model = Loop { controller: Controller::Pi(law), ..Loop::paper() };
            let (mut general, mut stepped) =
                (Simulation::new(&model, 1).unwrap(), Simulation::new(&model, 1).unwrap());
            for simulation in [&mut general, &mut stepped] {
                simulation.body.state_mut().fill(start);
            }
            let mut run = stepped.clone();
            let wide = extreme.iter().take(extremes);
            let reference: Vec<f64> = zeros.iter().chain(&usual).chain(wide).chain(&usual).copied().collect();
            run.change();
            assert!(run.direct.is_some());
            let room = || vec![0.0; reference.len()];
            let mut trace = Trace { y: room(), u: room(), true_y: Vec::new() };
            run.straight_run(&reference, &mut trace);
            for (n, r) in reference.iter().enumerate() {
                let (wanted, got) = (general.general_step(*r, &[]), stepped.step(*r, &[]));
                // Which NaN it is says nothing.
                let bits = |x: f64| if x.is_nan() { None } else { Some(x.to_bits()) };
                let of = |step: Step| [step.y, step.u, step.true_y, step.drive].map(bits);
                assert_eq!(of(got), of(wanted), "sample {n}");
                assert_eq!([trace.y[n], trace.u[n]].map(bits), [wanted.y, wanted.u].map(bits), "{n}");
                let states =
                    [&stepped, &general].map(|s| s.state().iter().map(|x| bits(*x)).collect::<Vec<_>>());
                assert_eq!(states[0], states[1], "sample {n}");
            }
        }
    }
}
