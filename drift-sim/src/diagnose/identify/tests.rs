use super::*;
use crate::controller::Controller;
use crate::plant::{FirstOrder, TransferFunction};
use crate::simulate::replay;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

fn unknown() -> Loop {
    Loop { sample_time_s: 0.1, controller: Controller::Recorded, plant: Plant::Identify, ..Loop::paper() }
}

/// y of a plant with its terms under u, with white noise of the sensor.
fn recorded(plant: Plant, terms: &[Term], u: Vec<f64>, noise: f64) -> Signals {
    let real = Loop { plant, physics: terms.to_vec(), ..unknown() };
    let mut y = replay(&real, &u, &[], 0, None).unwrap().y;
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for y in &mut y {
        let normal: f64 = StandardNormal.sample(&mut random);
        *y += noise * normal;
    }
    Signals { sample_time_s: 0.1, start_s: 0.0, origin_s: 0.0, r: y.clone(), y, u, inputs: Vec::new() }
}

/// Steps of changing length between two levels and back.
fn steps(n: usize, low: f64, high: f64) -> Vec<f64> {
    (0..n).map(|i| if (i / 350 + i / 810) % 2 == 0 { low } else { high }).collect()
}

fn identified(signals: &Signals) -> Identified {
    plant(&unknown(), signals).unwrap().unwrap()
}

fn near(found: f64, truth: f64, relative: f64) {
    assert!((found - truth).abs() < relative * truth.abs(), "{found} is not {truth}");
}

/// A lag of 12 s with 0.8 s of dead time, driven by steps of u: its own numbers come back, and no second lag.
#[test]
fn a_lag_with_dead_time_is_identified() {
    let truth = FirstOrder { gain: 0.7, time_constant_s: 12.0, delay_s: 0.8, offset: 20.0 };
    let found = identified(&recorded(Plant::FirstOrder(truth), &[], steps(6000, 10.0, 30.0), 0.02));
    let Plant::FirstOrder(plant) = found.nominal.plant else { panic!("{found:?}") };
    near(plant.gain, 0.7, 0.01);
    near(plant.time_constant_s, 12.0, 0.02);
    near(plant.delay_s, 0.8, 0.1);
    near(plant.offset, 20.0, 0.01);
    assert!(found.with.is_empty());
}

/// Two lags of 8 and 3 s behind 1.2 s of dead time: `1.5/(24 s^2 + 11 s + 1)`.
#[test]
fn two_lags_with_dead_time_are_identified() {
    let truth = TransferFunction { num: vec![1.5], den: vec![24.0, 11.0, 1.0], delay_s: 1.2, offset: 4.0 };
    let found = identified(&recorded(Plant::TransferFunction(truth), &[], steps(6000, 2.0, 5.0), 0.01));
    let Plant::TransferFunction(plant) = found.nominal.plant else { panic!("{found:?}") };
    // The coefficients but for a common factor.
    let last = plant.den[2];
    near(plant.num[0] / last, 1.5, 0.01);
    near(plant.den[0] / last, 24.0, 0.05);
    near(plant.den[1] / last, 11.0, 0.03);
    near(plant.delay_s, 1.2, 0.1);
    near(plant.offset, 4.0, 0.02);
}

/// A tank that only fills: 0.05 per second and unit of u above 3.
#[test]
fn an_integrator_is_identified() {
    let truth = TransferFunction { num: vec![0.05], den: vec![1.0, 0.0], delay_s: 0.5, offset: -3.0 };
    let u: Vec<f64> = steps(6000, 2.0, 4.0);
    let found = identified(&recorded(Plant::TransferFunction(truth), &[], u, 0.02));
    let Plant::TransferFunction(plant) = found.nominal.plant else { panic!("{found:?}") };
    assert_eq!(plant.den.len(), 2, "{plant:?}");
    near(plant.num[0], 0.05, 0.01);
    near(plant.offset, -3.0, 0.01);
    assert!(plant.den[1].abs() < 1e-3, "{plant:?}");
}

/// The plant behind a limit that u does not show is found with that limit, which is handed on.
#[test]
fn a_plant_behind_a_limit_is_found_with_it() {
    let truth = FirstOrder { gain: 2.0, time_constant_s: 5.0, delay_s: 0.3, offset: 1.0 };
    let limit = Term::new("saturation", &[("lower", 0.0), ("upper", 8.0)]).unwrap();
    let u: Vec<f64> =
        (0..6000).map(|i| 4.0 + 3.0 * [1.0, -1.0, 4.0, -4.0, 2.0, -2.5][(i / 170) % 6]).collect();
    let found = identified(&recorded(Plant::FirstOrder(truth), &[limit], u, 0.02));
    let [limit] = found.with.as_slice() else { panic!("a limit") };
    near(limit.value("upper").unwrap(), 8.0, 0.02);
    assert!(limit.value("lower").unwrap().abs() < 0.2, "{limit:?}");
    let Plant::FirstOrder(plant) = found.nominal.plant else { panic!("{:?}", found.nominal) };
    near(plant.gain, 2.0, 0.02);
    near(plant.time_constant_s, 5.0, 0.03);
}

/// A y that u does not move: nothing is identified, and the message says what would help.
#[test]
fn noise_is_not_identified() {
    let still = FirstOrder { gain: 0.0, time_constant_s: 5.0, delay_s: 0.0, offset: 1.0 };
    let signals = recorded(Plant::FirstOrder(still), &[], steps(4000, 0.0, 1.0), 0.5);
    let message = plant(&unknown(), &signals).unwrap_err().to_string();
    assert!(message.contains("no linear plant"), "{message}");
}
