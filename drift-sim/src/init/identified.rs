//! The plant between the recorded u and y: the likeliest of the structures that `drift diagnose` knows, found by the same identification, with its numbers, how
//! sure each is, and which other structures fit as well. It is taken where it simulates what it has not seen.

use crate::control_loop::Loop;
use crate::diagnose::prove::percent;
use crate::diagnose::{Refitted, prove};
use crate::estimate::signals::Signals;
use crate::likelihood_search::{self, options::Options};
use crate::plant::{Output, Plant};

use super::round;

/// Part of the recording that plants are fitted to.
const TRAINING: f64 = 0.7;
/// Part of y's variance on the unseen samples that a plant may leave, else nothing was identified.
const LEFT_OVER: f64 = 0.5;

/// A plant that was found.
pub struct Found {
    /// The loop with the plant and, where its kind has no offset, the load that stays.
    pub model: Loop,
    /// Its numbers with their intervals.
    pub numbers: Vec<Refitted>,
    /// Its form in words.
    pub says: String,
    /// Part of y's variance on the last 30 % that u explains through it, from 0 to 1.
    pub explains: f64,
    /// Other forms, and how much less likely they are, in log-likelihood after the cost of their numbers.
    pub others: Vec<(String, f64)>,
}

/// Finds the plant; or the most of y's variance on the last 30 % that the likeliest explains, which is too little.
///
/// # Errors
/// That part of the variance, at most 0.5; negative where y is better told by its mean.
pub fn find(open: &Loop, signals: &Signals) -> Result<Found, f64> {
    let options = Options::default();
    let signals = &signals.part(0, options.most_samples);
    let cut = (TRAINING * signals.len() as f64) as usize;
    let unseen = signals.part(cut, signals.len());
    let recorded = Loop { controller: crate::controller::Controller::Recorded, ..open.clone() };
    let mut found = likelihood_search::plants_of(&recorded, signals, cut, &options).into_iter();
    let best = found.next().ok_or(f64::NEG_INFINITY)?;
    let mean = unseen.u.iter().sum::<f64>() / unseen.len().max(1) as f64;
    let at_rest = Signals { u: vec![mean; unseen.len()], ..unseen.clone() };
    // What a plant does by itself, an oscillation that dies out say, is none of what u makes of it.
    let by_itself = left(&best.model, &at_rest).min(1.0);
    let left = left(&best.model, &unseen) / by_itself;
    let explains = 1.0 - left * left;
    if explains < 1.0 - LEFT_OVER {
        return Err(explains);
    }
    let others = found.map(|other| (form(&other.model.plant), other.likelihood_lost)).collect();
    let says = form(&best.model.plant);
    Ok(Found { model: rounded(open, &best.model), numbers: best.numbers, says, explains, others })
}

/// Part of y's deviation that a simulation from u alone leaves.
fn left(model: &Loop, signals: &Signals) -> f64 {
    prove::run(model, signals, 0).map_or(f64::INFINITY, |trace| 1.0 - 0.01 * percent(&signals.y, &trace.y))
}

/// The open loop with a plant, and a load beside it, to six digits.
fn rounded(open: &Loop, found: &Loop) -> Loop {
    let numbers: Vec<f64> = found.plant.numbers().iter().map(|number| round(number.value)).collect();
    let mut physics = found.physics.clone();
    physics.iter_mut().flat_map(|term| &mut term.parameters).for_each(|value| *value = round(*value));
    Loop { plant: found.plant.with_numbers(&numbers), physics, ..open.clone() }
}

/// A plant's form in words.
fn form(plant: &Plant) -> String {
    let delay_s = plant.delay_s();
    let behind = if delay_s > 0.0 { " behind a dead time" } else { "" };
    match plant {
        Plant::FirstOrder(_) => format!("one lag{behind}"),
        Plant::TransferFunction(plant) if plant.den.last() == Some(&0.0) => format!("an integrator{behind}"),
        Plant::TransferFunction(plant) => match plant.den.len() {
            3 => format!("two lags{behind}"),
            n => format!("a transfer function of order {}{behind}", n - 1),
        },
        Plant::StateSpace(_) => "an oscillator".into(),
        Plant::Servo(servo) if servo.output == Output::Position => {
            "a servo's position; forces are in the unit of u".into()
        }
        Plant::Servo(_) => "a servo's speed; forces are in the unit of u".into(),
        Plant::Tank(_) => "a tank".into(),
        Plant::Identify => "open".into(),
    }
}
