//! A motor of which only the law is known: its dry friction and its play, found in a recording of steps, and nothing in that of a motor that has neither.

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, Named, diagnose};
use drift_sim::physics::Term;
use drift_sim::recording::{Recording, RowState};
use drift_sim::reference::Reference;
use drift_sim::simulate::simulate;

/// A positioning motor under a proportional law; the loop file knows the law alone.
const POSITIONER: &str = "[loop]\nsample_time_s = 0.1\n[units]\nr = \"V\"\ny = \"V\"\nu = \"V\"\n\
    [controller]\nkind = \"pi\"\nkp = 4.8\nki = 0.0\n[plant]\nkind = \"identify\"\n";

/// What is found in 130 s of steps of the positioning motor with this in it, noise and levels following from the seed; `None` where nothing
/// can be said.
fn positioned(left_out: &[Term], seed: u64) -> Option<Diagnosis> {
    let stated = Loop::parse(POSITIONER, "loop.toml").unwrap();
    let motor = "kind = \"servo\"\noutput = \"position\"\ninertia = 0.7\nviscous = 0.9\nactuator_gain = 1.0\n\
        [sensor]\nnoise = 0.01\n";
    let mut truth = Loop::parse(&POSITIONER.replace("kind = \"identify\"\n", motor), "loop.toml").unwrap();
    truth.physics = left_out.to_vec();
    let r = Reference::random(0.5, 1.0, 100, seed).take_samples(1300);
    let trace = simulate(&truth, &r, &[], seed, None).unwrap();
    let state = vec![RowState::Valid; r.len()];
    let recording =
        Recording { sample_time_s: 0.1, r, y: trace.y, u: trace.u, state, ..Recording::default() };
    diagnose(&[Signals::new(&recording, &stated).unwrap()], None, &stated).ok()
}

/// A named kind, its first number less the true one, and the half width of its interval.
type Number = (&'static str, f64, f64);

fn numbers(found: Option<&Diagnosis>, truth: &[Term]) -> Vec<Number> {
    let number = |named: &Named| {
        let kind = named.term.kind;
        let true_value =
            truth.iter().find(|term| term.kind == kind).map_or(f64::NAN, |term| term.parameters[0]);
        (kind.name, named.term.parameters[0] - true_value, named.half_widths[0])
    };
    found.map(|found| found.physics.iter().map(number).collect()).unwrap_or_default()
}

fn friction() -> Term {
    Term::new("coulomb_friction", &[("level", 0.9)]).unwrap()
}

fn play() -> Term {
    Term::new("sensor_hysteresis", &[("width", 1.5)]).unwrap()
}

/// Of a motor of which only the law is known: its friction, its play, both, with a law that is late beside.
#[test]
#[ignore = "slow: four diagnoses of an unknown plant"]
fn friction_and_play_of_an_unknown_motor() {
    let late = Term::new("controller_delay", &[("delay_s", 0.1)]).unwrap();
    for truth in [vec![friction()], vec![friction(), play()], vec![late, friction()]] {
        let found = numbers(positioned(&truth, 1).as_ref(), &truth);
        assert_eq!(found.len(), truth.len(), "{found:?}");
        for term in &truth {
            let (_, off, _) = found.iter().find(|(kind, ..)| *kind == term.kind.name).unwrap();
            assert!(off.abs() < 0.1 * term.parameters[0], "{found:?}");
        }
    }
}

/// False alarms, missed ones and coverage over seeds.
#[test]
#[ignore = "slow: 36 diagnoses"]
fn friction_and_play_of_unknown_motors_over_seeds() {
    const SEEDS: u64 = 12;
    println!(
        "| in the motor | named as it is | nothing | else | truth within the 95 % intervals |\n|---|---|---|---|---|"
    );
    for (truth, least_right) in [(vec![], 12), (vec![friction()], 9), (vec![friction(), play()], 6)] {
        let found: Vec<_> =
            (1..=SEEDS).map(|seed| numbers(positioned(&truth, seed).as_ref(), &truth)).collect();
        let is_right = |found: &&Vec<Number>| {
            let named = |term: &Term| found.iter().any(|(kind, ..)| *kind == term.kind.name);
            found.len() == truth.len() && truth.iter().all(named)
        };
        let right = found.iter().filter(is_right).count();
        let nothing = found.iter().filter(|found| found.is_empty() && !truth.is_empty()).count();
        let intervals: Vec<bool> =
            found.iter().filter(is_right).flatten().map(|(_, off, width)| off.abs() <= *width).collect();
        let covered = intervals.iter().filter(|covered| **covered).count();
        let kinds: Vec<&str> = truth.iter().map(|term| term.kind.name).collect();
        let kinds = if kinds.is_empty() { "nothing".into() } else { kinds.join(", ") };
        let else_named = SEEDS as usize - right - nothing;
        println!(
            "| {kinds} | {right} of {SEEDS} | {nothing} | {else_named} | {covered} of {} |",
            intervals.len()
        );
        assert!(right >= least_right && covered * 100 >= intervals.len() * 80);
    }
}
