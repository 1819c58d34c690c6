use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::structures::gain_of_changes;
use super::{direction, likeliest};
use crate::control_loop::Loop;
use crate::estimate::first_look::coarser;
use crate::estimate::level::gain_at_rest;
use crate::estimate::noise::sequence;
use crate::estimate::signals::Signals;
use crate::likelihood_search::options::Options;
use crate::plant::{Plant, Tank, TransferFunction};
use crate::reference::Reference;
use crate::simulate::simulate;

/// u makes up for a load that grows and moves y to and fro: the gain is that of the motion, twice too small by the deviations.
#[test]
fn a_loop_at_rest_tells_its_gain_by_its_changes() {
    let wave = |n: usize| if n % 20 < 10 { 1.0 } else { -1.0 };
    let y: Vec<f64> = (0..2000).map(|n| 50.0 + 1.4 * wave(n)).collect();
    let u: Vec<f64> = (0..2000).map(|n| wave(n) + 0.02 * n as f64).collect();
    let signals = Signals { y, u, sample_time_s: 1.0, ..Signals::default() };
    let gain = gain_of_changes(&[signals], 10, 0.0).unwrap();
    assert!((gain / 1.4 - 1.0).abs() < 0.01, "{gain}");
}

/// A flow of 970 under a valve at 72.3 %, whose u moves by 0.2: y = 970 + gain*(u - 72.3) behind a lag of three samples, written out. The sizes of y and u say another
/// gain, for a slow load moves y as well.
fn flow(gain: f64) -> Signals {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let wandering = sequence(1500, 2.0, 0.98, &mut random);
    let noise = sequence(1500, 0.1, 0.0, &mut random);
    let mut level = 0.0;
    let u: Vec<f64> = (0..1500).map(|n| 72.3 + 0.2 * libm::sin((n / 40 * 17) as f64)).collect();
    let y = u.iter().zip(wandering).zip(noise).map(|((u, load), noise)| {
        let y = 970.0 + level + noise;
        level += (1.0 - libm::exp(-1.0 / 3.0)) * (gain * (u - 72.3) - load - level);
        y
    });
    Signals { y: y.collect(), r: vec![970.0; 1500], u, sample_time_s: 10.0, ..Signals::default() }
}

#[test]
fn a_loop_far_from_zero_tells_its_gain() {
    let open =
        "[loop]\nsample_time_s = 10.0\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"identify\"\n";
    let open = Loop::parse(open, "a flow").unwrap();
    for gain in [8.0, 40.0] {
        let of = [flow(gain)];
        let found = likeliest(&open, (&of, &[1500]), &[], direction(&of), &Options::default());
        let plants = found.iter().filter_map(|found| found.nominal.hypothesis.realise(&found.nominal.point));
        // Of an oscillator only the product of gain and rate shows.
        let plant = plants.map(|realised| realised.model.plant).find(|p| p.u_at_rest(0.0).is_some()).unwrap();
        let fitted = gain_at_rest(&plant).unwrap() * plant.drive_gain();
        assert!((fitted / gain - 1.0).abs() < 0.05, "{gain}: {plant:?}");
    }
}

/// u = 5*(r - y) and its integral: the law answers to the error, so that the plant's gain is positive. A plant that answers within a sample turns the sign of the
/// changes; the integral then contradicts it, and no sign is known.
#[test]
fn the_law_tells_the_sign_of_the_gain_unless_the_plant_answers_within_a_sample() {
    let with_plant = |own: f64| {
        let mut integral = 0.0;
        let e: Vec<f64> = (0..3000).map(|n| libm::sin(n as f64 / 9.0)).collect();
        let u = e.iter().map(|e| {
            integral += 0.2 * e;
            integral - own * e
        });
        Signals {
            y: e.iter().map(|e| -e).collect(),
            u: u.collect(),
            r: vec![0.0; 3000],
            ..Signals::default()
        }
    };
    assert_eq!(direction(&[with_plant(-5.0)]), 1.0);
    assert_eq!(direction(&[with_plant(2.0)]), 0.0);
}

/// u answers to the sensor's noise at once, and to a load over many samples: its own samples tell the law's sign, and means of 27 of them do not.
#[test]
fn the_means_of_many_samples_lose_the_sign() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let e = sequence(27_000, 1.0, 0.0, &mut random);
    let load = sequence(27_000, 12.0, 0.999, &mut random);
    let signals = Signals {
        u: e.iter().zip(load).map(|(e, load)| e + load).collect(),
        y: e.iter().map(|e| -e).collect(),
        r: vec![0.0; 27_000],
        sample_time_s: 1.0,
        ..Signals::default()
    };
    let own = [signals];
    assert_eq!(direction(&own), 1.0);
    assert_eq!(direction(&coarser(&own, 27)), 0.0);
}

/// The likeliest plant of a loop over random levels, where neither law nor plant is known.
fn identified(truth: &str, units: &str, (mean, sd): (f64, f64), samples: usize) -> Plant {
    let truth = Loop::parse(&format!("{truth}{units}"), "truth.toml").unwrap();
    let r = Reference::random(mean, sd, samples as u64 / 12, 3).take_samples(samples);
    let trace = simulate(&truth, &r, &[], 3, None).unwrap();
    let open = "[controller]\nkind = \"recorded\"\n[plant]\nkind = \"identify\"\n";
    let open = format!("[loop]\nsample_time_s = {}\n{open}{units}", truth.sample_time_s);
    let sample_time_s = truth.sample_time_s;
    let of = [Signals { r, y: trace.y, u: trace.u, sample_time_s, ..Signals::default() }];
    let open = Loop::parse(&open, "open.toml").unwrap();
    let found = likeliest(&open, (&of, &[samples]), &[], direction(&of), &Options::default());
    let best = found.into_iter().next().and_then(|plant| plant.refined()).unwrap().nominal;
    best.hypothesis.realise(&best.point).unwrap().model.plant
}

/// Two real poles with a zero between them, which no plant that may swing has.
#[test]
fn a_vessel_behind_a_line_has_a_zero() {
    let truth = "[loop]\nsample_time_s = 0.25\n[controller]\nkind = \"pi\"\nkp = 8.0\nki = 0.4\n[plant]\nkind = \"transfer-function\"\n\
        num = [0.75, 0.077]\nden = [40.0, 24.4, 1.0]\noffset = 1.0\n[sensor]\nnoise = 0.0008\n";
    let units = "[units]\ny = \"bar\"\nu = \"%\"\n";
    let plant = identified(truth, units, (4.0, 1.0), 6_000);
    let Plant::TransferFunction(TransferFunction { num, den, .. }) = &plant else { panic!("{plant:?}") };
    for (found, truth) in [(num[0], 0.75), (num[1], 0.077), (den[0], 40.0), (den[1], 24.4)] {
        assert!((found / truth - 1.0).abs() < 0.1, "{plant:?}");
    }
}

/// What fills it counts as one; so it is told by how fast it fills and by the level at which u holds it.
#[test]
fn a_tank_that_drains_by_its_own_head_is_one() {
    let truth = "[loop]\nsample_time_s = 0.5\n[controller]\nkind = \"pi\"\nkp = 60.0\nki = 2.3\nu_min = 0.0\nu_max = 150.0\n[plant]\nkind = \"tank\"\n\
        area = 18.0\ninflow_gain = 0.03\noutflow = 1.5\n[sensor]\nnoise = 0.002\n";
    let units = "[units]\ny = \"m\"\nu = \"%\"\n";
    let plant = identified(truth, units, (1.5, 0.3), 4_000);
    let Plant::Tank(Tank { area, inflow_gain, outflow }) = plant else { panic!("{plant:?}") };
    assert!((area / inflow_gain / (18.0 / 0.03) - 1.0).abs() < 0.05, "{plant:?}");
    assert!((outflow / inflow_gain / (1.5 / 0.03) - 1.0).abs() < 0.05, "{plant:?}");
}
