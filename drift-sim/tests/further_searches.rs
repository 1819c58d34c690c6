//! What a first search leaves in doubt, and further ones settle: a machine with something fast in it that is none of the kinds, and signals that come and go. The machine is written
//! out here: a mass on a rail under a proportional law, in steps of a tenth of a sample.

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, Verdict, diagnose};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

const TS: f64 = 0.002;
const SAMPLES: usize = 10_000;
const KP: f64 = 40.0;
const MASS: f64 = 1.0;
const VISCOUS: f64 = 10.0;
const NOISE: f64 = 1e-6;
/// What stays of the frame's last two places: it loses 3 % of its swing in a sample.
const FRAME: [f64; 2] = [1.414, -0.941];
const LOOP: &str = "[loop]\nsample_time_s = 0.002\n[units]\nr = \"m\"\ny = \"m\"\nu = \"N\"\n[controller]\nkind = \"pi\"\nkp = 40.0\nki = 0.0\n\
    [plant]\nkind = \"servo\"\noutput = \"position\"\ninertia = 1.0\nviscous = 10.0\nactuator_gain = 1.0\n";

/// What the loop file does not know.
#[derive(Default, Clone)]
struct Unknown {
    friction: f64,
    /// Deviation of what excites the frame of the sensor, which swings at 60 Hz.
    frame: f64,
    /// A force while it is on, and when it is, in seconds.
    pulses: f64,
    times: Vec<(f64, f64)>,
}

/// 20 s over targets that change every second.
fn recorded(unknown: &Unknown, seed: u64) -> Signals {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
    let (mut x, mut v, mut target) = (0.0, 0.0, 0.0);
    let mut swing = [0.0; 2];
    let mut signals = Signals { sample_time_s: TS, ..Signals::default() };
    for n in 0..SAMPLES {
        if n % 500 == 0 {
            target = 0.2 * draw();
        }
        let t = n as f64 * TS;
        swing = [FRAME[0] * swing[0] + FRAME[1] * swing[1] + unknown.frame * draw(), swing[0]];
        let y = x + swing[0] + NOISE * draw();
        let u = KP * (target - y);
        let is_on = unknown.times.iter().any(|(from, to)| (*from..*to).contains(&(t + 1e-9)));
        let drive = u + if is_on { unknown.pulses } else { 0.0 };
        for _ in 0..10 {
            (x, v) = moved((x, v), drive, unknown.friction, 0.1 * TS);
        }
        signals.r.push(target);
        signals.y.push(y);
        signals.u.push(u);
    }
    signals
}

/// A small step of the mass: dry friction takes away at most all of its speed.
fn moved((x, v): (f64, f64), drive: f64, friction: f64, dt: f64) -> (f64, f64) {
    let free = v + dt * (drive - VISCOUS * v) / MASS;
    let held = dt * friction / MASS;
    let v = if free.abs() <= held { 0.0 } else { free - held * free.signum() };
    (x + dt * v, v)
}

fn diagnosed(signals: &Signals) -> Diagnosis {
    diagnose(std::slice::from_ref(signals), None, &Loop::parse(LOOP, "loop.toml").unwrap()).unwrap()
}

/// Dry friction of 1 N beside a sensor on a frame that swings: from one sample to the next that is no noise of the kind that is reckoned with. In the mean of several it is.
#[test]
#[ignore = "slow: two diagnoses in many samplings"]
fn friction_is_found_beside_a_frame_that_swings() {
    let frame = Unknown { frame: 1e-5, ..Unknown::default() };
    let found = diagnosed(&recorded(&Unknown { friction: 1.0, ..frame.clone() }, 1));
    let named: Vec<&str> = found.physics.iter().map(|named| named.term.kind.name).collect();
    let level = found.physics.first().map(|named| named.term.parameters[0]);
    assert_eq!(named.first(), Some(&"coulomb_friction"), "{named:?} {:?}", found.verdict);
    assert!(level.is_some_and(|level| (level - 1.0).abs() < 0.1), "{level:?}");
    let without = diagnosed(&recorded(&frame, 2));
    assert!(without.physics.is_empty(), "{:?}", without.physics);
    assert_ne!(without.verdict, Verdict::MissingPhysics);
}

/// Pulses of 2 N at uneven times beside the same: their edges within 10 ms, their size to 3 %.
#[test]
#[ignore = "slow: a diagnosis in many samplings"]
fn pulses_are_found_beside_a_frame_that_swings() {
    let times = vec![(1.3, 1.7), (4.1, 4.6), (6.05, 6.35), (9.2, 9.75), (12.4, 12.8), (16.15, 16.6)];
    let unknown = Unknown { frame: 1e-5, pulses: 2.0, times: times.clone(), ..Unknown::default() };
    let found = diagnosed(&recorded(&unknown, 3));
    let pulses = found.physics.iter().find(|named| named.term.kind.name == "injected_signal");
    let term = &pulses.unwrap_or_else(|| panic!("{:?} {:?}", found.verdict, found.physics)).term;
    assert!((term.parameters[0] - 2.0).abs() < 0.06, "{term:?}");
    assert_eq!(term.spans.len(), times.len(), "{term:?}");
    for (own, truth) in term.spans.iter().zip(&times) {
        assert!(
            (own.0 - truth.0).abs() < 5.5 * TS && (own.1 - truth.1).abs() < 5.5 * TS,
            "{own:?} {truth:?}"
        );
    }
}
