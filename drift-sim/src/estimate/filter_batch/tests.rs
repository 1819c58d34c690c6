use super::*;
use crate::control_loop::Loop;
use crate::estimate::hypothesis::{Hypothesis, Point};
use crate::estimate::likelihood::{Cache, Data, rows_at, runs};
use crate::estimate::measure;
use crate::likelihood_search::options::Options;

/// Loops of one to four states with dead time, actuators, loads, sensors and inputs of all sorts.
const PLANTS: [&str; 4] = [
    "kind = \"first-order\"\ngain = 2.0\ntime_constant_s = 0.5\ndelay_s = 0.034",
    "kind = \"transfer-function\"\nnum = [2.0]\nden = [0.02, 0.3, 1.0]\ndelay_s = 0.02",
    "kind = \"servo\"\noutput = \"position\"\ninertia = 0.3\nviscous = 0.8\nactuator_gain = 1.5",
    "kind = \"state-space\"\na = [[-1.0, 2.0, 0.0], [-2.0, -1.0, 0.5], [0.0, 0.0, -3.0]]\nb = [0.0, 1.0, 2.0]\nc = [1.0, 0.5, 0.0]\nd = 0.1",
];
const TERMS: [&str; 14] = [
    "",
    "kind = \"dead_zone\"\nhalf_width = 0.3",
    "kind = \"load_step\"\nlevel = 0.2\nonset_s = 7.0",
    "kind = \"gain_loss\"\nloss = 0.3\nonset_s = 5.0",
    "kind = \"sensor_drift\"\nrate_per_s = 0.01\nonset_s = 3.0",
    "kind = \"delay\"\ndelay_s = 0.013\nonset_s = 9.0",
    "kind = \"sensor_noise\"\nratio = 2.0\nonset_s = 8.0",
    "kind = \"unmodelled_lag\"\ntime_constant_s = 0.05",
    "kind = \"flexible_mode\"\nfrequency_hz = 4.0\ndamping = 0.2",
    "kind = \"sensor_lag\"\ntime_constant_s = 0.03",
    "kind = \"sensor_hysteresis\"\nwidth = 0.3",
    "kind = \"leak\"\ncoefficient = 0.2\nonset_s = 6.0",
    "kind = \"radiation\"\ncoefficient = 1e-9",
    "kind = \"leak\"\ncoefficient = 0.2\n[[physics]]\nkind = \"sensor_lag\"\ntime_constant_s = 0.03\n[[physics]]\nkind = \"delay\"\ndelay_s = 0.013\nonset_s = 9.0",
];

/// Motion under friction and forces, forwards and backwards, with stops.
const MASSES: [&str; 2] = [
    "kind = \"servo\"\noutput = \"position\"\ninertia = 0.3\nviscous = 0.8\nactuator_gain = 1.5",
    "kind = \"servo\"\noutput = \"speed\"\ninertia = 0.3\nviscous = 0.8\nactuator_gain = 1.5",
];
const FORCES: [&str; 10] = [
    "kind = \"coulomb_friction\"\nlevel = 0.4",
    "kind = \"coulomb_friction\"\nlevel = 0.4\nonset_s = 4.0",
    "kind = \"stribeck_friction\"\ncoulomb = 0.3\nbreakaway = 0.6\nstribeck_speed = 0.1",
    "kind = \"directional_friction\"\ncoulomb_pos = 0.3\ncoulomb_neg = 0.5\nviscous_pos = 0.1\nviscous_neg = 0.2",
    "kind = \"load_dependent_friction\"\ncoefficient = 0.2",
    "kind = \"quadratic_drag\"\ncoefficient = 0.3",
    "kind = \"sensor_lag\"\ntime_constant_s = 0.03\n[[physics]]\nkind = \"coulomb_friction\"\nlevel = 0.2",
    "kind = \"cogging\"\namplitude = 0.2\nperiod = 0.3\nphase = 0.4",
    "kind = \"unmodelled_lag\"\ntime_constant_s = 0.05\n[[physics]]\nkind = \"coulomb_friction\"\nlevel = 0.2\n[[physics]]\nkind = \"viscous_friction\"\nratio = 2.0\nonset_s = 6.0",
    "kind = \"delay\"\ndelay_s = 0.013\nonset_s = 9.0\n[[physics]]\nkind = \"coulomb_friction\"\nlevel = 0.2\n[[physics]]\nkind = \"sensor_drift\"\nrate_per_s = 0.01\nonset_s = 3.0",
];

fn signals(samples: usize) -> Signals {
    let wave = |n: usize| f64::sin(n as f64 * 0.7);
    let u: Vec<f64> =
        (0..samples).map(|n| if n / 150 % 2 == 0 { 1.0 } else { -0.5 } + 0.1 * wave(n)).collect();
    let mut y: Vec<f64> = u.iter().zip(0..).map(|(u, n)| 2.0 * u + 0.3 * wave(3 * n)).collect();
    // Some are missing.
    y[300..310].fill(f64::NAN);
    Signals { sample_time_s: 0.01, r: y.clone(), y, u, ..Signals::default() }
}

/// Side by side and alone each filter foretells the same as the full simulation that it stands for.
#[test]
fn a_batch_foretells_what_the_full_simulation_foretells() {
    let linear = PLANTS.iter().flat_map(|plant| TERMS.iter().map(move |term| (plant, term)));
    let acts = |(plant, term): &(&&str, &&str)| {
        !(term.contains("leak") && plant.contains("servo")
            || term.contains("radiation") && !plant.contains("first"))
    };
    let linear = linear.filter(acts);
    let masses = MASSES.iter().flat_map(|plant| FORCES.iter().map(move |term| (plant, term)));
    for (plant, term) in linear.chain(masses) {
        let physics = if term.is_empty() { String::new() } else { format!("[[physics]]\n{term}\n") };
        let text = format!(
            "[loop]\nsample_time_s = 0.01\n[controller]\nkind = \"recorded\"\n[plant]\n{plant}\n{physics}"
        );
        let model = Loop::parse(&text, "a loop").expect(&text);
        let recordings = vec![signals(1_500)];
        let scales = measure::scales(&model, &recordings);
        let hypothesis = Hypothesis::nominal(&model, &scales, &Options::default().priors);
        let data = Data::new(&hypothesis, recordings, vec![1_500]);
        let own = hypothesis.own_point();
        let moved = |i: usize| {
            let mut point = own.clone();
            point.x[i % own.x.len()] += 0.05;
            point
        };
        let points: Vec<Point> = (0..7).map(moved).collect();
        let cache = Cache::at(&hypothesis, &own, &data);
        let batch = rows_at(&hypothesis, &points, &data, &cache);
        for (i, (point, rows)) in points.iter().zip(batch).enumerate() {
            let alone = runs(&hypothesis, point, &data, &mut Cache::default(), 1_500, false).expect(&text);
            let rows = rows.expect(&text);
            let z: Vec<f64> = alone.iter().flat_map(|run| run.scaled.clone()).collect();
            let factor = rows.z.iter().zip(&z).find(|(_, z)| z.abs() > 0.1).map_or(1.0, |(a, b)| a / b);
            let most = z.iter().fold(0.0_f64, |most, z| most.max(z.abs()));
            for (n, (a, b)) in rows.z.iter().zip(&z).enumerate() {
                assert!(
                    (a - factor * b).abs() < 1e-9 * factor * most,
                    "{text}: point {i}, sample {n}: {a} {}",
                    factor * b
                );
            }
        }
    }
}
