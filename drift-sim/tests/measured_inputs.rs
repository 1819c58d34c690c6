//! An air handler whose reference never moves, made by a few lines that share no code with the simulator: supply air behind a cooling valve, under a PI law, beside a heat
//! flow that is measured as two temperatures and a flow. Nothing is known of law and plant. What the measured product excites identifies the plant, and what is hidden
//! is found on it; without the product nothing can be said.

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, Named, Verdict, diagnose};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

const SAMPLES: usize = 2000;
/// Degrees for all of u; degrees for each unit of the heat flow; what is left of a deviation after a sample of a minute, of a lag of 300 s.
const GAIN: f64 = -8.0;
const HEATS: f64 = 0.9;
const LEFT: f64 = 0.818_730_753_077_981_9;
/// When something goes wrong, in samples.
const BEGINS: usize = 1200;
/// The loop file that says nothing of the loop but that y is a temperature (or a motor's speed would do as well), and what it may say of the heat.
const OPEN: &str = "[loop]\nsample_time_s = 60.0\n[units]\ny = \"degC\"\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"identify\"\n";
const HEAT: &str = "[[inputs]]\ncolumn = \"t_in\"\nminus = \"t_out\"\ntimes = \"flow\"\nenters = \"load\"\ngain = \"identify\"\n";

/// What is hidden from `BEGINS` on.
#[derive(Clone, Copy)]
enum Hidden {
    Nothing,
    /// Part of the valve's gain that is lost.
    Lost(f64),
    /// Degrees that a heating valve leaks.
    Leak(f64),
}

/// A first-order random walk about 0.
fn walk(deviation: f64, tau: f64, random: &mut ChaCha8Rng) -> Vec<f64> {
    let (stays, mut x) = (libm::exp(-1.0 / tau), 0.0);
    let moves = deviation * libm::sqrt(1.0 - stays * stays);
    let mut draw = || -> f64 { StandardNormal.sample(random) };
    (0..SAMPLES)
        .map(|_| {
            x = stays * x + moves * draw();
            x
        })
        .collect()
}

/// A day and a half of it as CSV.
fn recorded(hidden: Hidden, seed: u64) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let [outdoors, back, fan, load] =
        [(1.0, 40.0), (0.3, 30.0), (0.02, 10.0), (0.02, 50.0)].map(|(sd, tau)| walk(sd, tau, &mut random));
    let (mut air, mut integral) = (13.0, 0.5);
    let mut rows = String::from("t,r,y,u,t_in,t_out,flow\n");
    for n in 0..SAMPLES {
        let draw: f64 = StandardNormal.sample(&mut random);
        let y = air + 0.02 * draw;
        let error = 13.0 - y;
        let u = (integral - 0.05 * error).clamp(0.0, 1.0);
        integral -= 0.008 * error;
        let t_in = 24.0 + 3.0 * libm::sin(std::f64::consts::TAU * n as f64 / 700.0) + outdoors[n];
        let t_out = 13.0 + back[n];
        let flow = if n % 180 < 90 { 0.8 } else { 0.4 } + fan[n];
        rows += &format!("{},13,{y},{u},{t_in},{t_out},{flow}\n", 60 * n);
        let (valve, leak) = match hidden {
            Hidden::Lost(part) if n >= BEGINS => ((1.0 - part) * u, 0.0),
            Hidden::Leak(degrees) if n >= BEGINS => (u, degrees),
            _ => (u, 0.0),
        };
        let target = GAIN * valve + HEATS * (t_in - t_out) * flow + 11.0 + leak - load[n];
        air = LEFT * air + (1.0 - LEFT) * target;
    }
    rows
}

fn found(hidden: Hidden, seed: u64, loop_file: &str) -> Diagnosis {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("day.csv");
    std::fs::write(&path, recorded(hidden, seed)).unwrap();
    let model = Loop::parse(loop_file, "loop.toml").unwrap();
    let options = drift_sim::recording::ReadOptions { extra: model.input_columns(), ..Default::default() };
    let recording = drift_sim::recording::Recording::read(&path, &options).unwrap();
    diagnose(&[Signals::new(&recording, &model).unwrap()], None, &model).unwrap()
}

/// A number of the plant with the half width of its interval.
fn number(found: &Diagnosis, name: &str) -> Option<(f64, f64)> {
    let row = found.parameters.iter().find(|row| row.name == name)?;
    Some((row.value, row.half_width))
}

/// Degrees for all of u, and for one in the drive's unit: of a first-order plant a degree; of two lags, one of which may be idle, one of u.
fn gain(found: &Diagnosis) -> ((f64, f64), f64) {
    match number(found, "plant.gain") {
        Some(gain) => (gain, 1.0),
        None => number(found, "plant.num[0]").map(|gain| (gain, gain.0)).unwrap(),
    }
}

#[test]
#[ignore = "slow: a minute of diagnoses"]
fn a_measured_product_makes_an_air_handler_that_only_holds_an_excited_plant() {
    let with_heat = format!("{OPEN}{HEAT}");
    println!(
        "| hidden | seed | without the product | with it | gain of u (-8) | gain of the heat (-0.9) |\n|---|---|---|---|---|---|"
    );
    for (what, hidden, kind) in [
        ("nothing", Hidden::Nothing, None),
        ("a quarter of the valve's gain is lost", Hidden::Lost(0.25), Some(("gain_loss", 0.25))),
        ("half a degree leaks in", Hidden::Leak(0.5), Some(("load_step", -0.5))),
    ] {
        for seed in [1, 2] {
            let (blind, seeing) = (found(hidden, seed, OPEN), found(hidden, seed, &with_heat));
            let (gain, degrees) = gain(&seeing);
            let heat = number(&seeing, "input.(t_in - t_out) * flow.gain").unwrap();
            let heat = (degrees * heat.0, (degrees * heat.1).abs());
            let size = |named: &Named| {
                // A part of the gain has no unit.
                let unit = if named.term.kind.name == "load_step" { degrees } else { 1.0 };
                (unit * named.term.parameters[0], (unit * named.half_widths[0]).abs())
            };
            let say = |named: &Named| {
                let (value, half_width) = size(named);
                format!(": {} {value:.3} ± {half_width:.3}", named.term.kind.name)
            };
            let named: String = seeing.physics.iter().map(say).collect();
            println!(
                "| {what} | {seed} | `{}` | `{}`{named} | {:.2} ± {:.2} | {:.3} ± {:.3} |",
                blind.verdict.name(),
                seeing.verdict.name(),
                gain.0,
                gain.1,
                heat.0,
                heat.1
            );
            assert_eq!(blind.verdict, Verdict::Undecided, "r at rest excites nothing");
            assert!((gain.0 - GAIN).abs() < 1.5 * gain.1 && gain.1 < 0.3, "{gain:?}");
            assert!((heat.0 + HEATS).abs() < 1.5 * heat.1 && heat.1 < 0.03, "a load is subtracted: {heat:?}");
            match kind {
                None => assert_eq!(seeing.verdict, Verdict::NoMismatch),
                Some((kind, truth)) => {
                    assert_eq!(seeing.verdict, Verdict::MissingPhysics);
                    let [term] = &seeing.physics[..] else { panic!("{named}") };
                    assert_eq!(term.term.kind.name, kind);
                    assert!((size(term).0 - truth).abs() < 0.1 * truth.abs(), "{named}");
                }
            }
        }
    }
}

#[test]
fn an_input_that_never_changes_is_refused_where_its_gain_is_to_be_found() {
    let model =
        Loop::parse(&format!("{OPEN}{}", HEAT.replace("flow", "r").replace("t_in", "r")), "loop.toml")
            .unwrap();
    let n = 500;
    let y: Vec<f64> = (0..n).map(|n| libm::sin(0.1 * n as f64)).collect();
    let signals = Signals {
        sample_time_s: 60.0,
        start_s: 0.0,
        origin_s: 0.0,
        r: vec![0.0; n],
        u: y.clone(),
        y,
        inputs: vec![vec![3.0; n]],
    };
    let error = diagnose(&[signals], None, &model).err().unwrap().to_string();
    assert!(error.contains("'(r - t_out) * r' never changes") && !error.contains('\n'), "{error}");
}

/// The improved loop states the gain that was found: it runs, and reads back the same.
#[test]
#[ignore = "slow: some seconds of diagnosis"]
fn the_improved_loop_states_the_gain_that_was_found() {
    let seeing = found(Hidden::Nothing, 1, &format!("{OPEN}{HEAT}"));
    let text = seeing.improved.to_toml();
    let again = Loop::parse(&text, "improved.toml").unwrap();
    assert!((again.inputs[0].gain.value() + HEATS).abs() < 0.03, "{text}");
    assert!(again.inputs[0].check().is_ok());
    assert_eq!(again.to_toml(), text);
}
