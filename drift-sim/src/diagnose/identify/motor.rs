//! A motor that positions, with dry friction and with play before its sensor: most drives have the first, and no linear plant of any order
//! stands for either. Friction takes the motor out of every small motion, so that a linear fit of such a recording may even find
//! the wrong sign of the gain.
//!
//! Where the direction of motion is known, the motion is linear again: friction is a drive of known sign, and play a shift of known sign.
//! y tells the direction, so that a grid over lag, friction and play needs one linear least squares each ([`LinearShape`](super::super::linear_shape::LinearShape)); the best are
//! searched on by the prediction error. Four motors compete, with and without either, and the one taken must predict parts of y that no fit
//! has seen better than the linear plant does.

use crate::cores::AcrossCores as _;

use crate::control_loop::Loop;
use crate::likelihood_search::units;
use crate::physics::Term;
use crate::plant::{Output, Plant, Servo};

use super::super::fit::{Effort, Fit};
use super::super::missing_drive::noise_floor;
use super::super::model::Model;
use super::super::signals::{Signals, held, range};
use super::super::whiten::Whitener;
use super::{Validated, lags, shape, simplest, validate};

/// Levels of friction tried, as parts of the largest u.
const FRICTIONS: [f64; 6] = [0.02, 0.05, 0.1, 0.2, 0.3, 0.45];
/// Widths of play tried, as parts of the range of y.
const PLAYS: [f64; 5] = [0.02, 0.05, 0.1, 0.2, 0.4];
/// Gains tried, as parts of the one that least squares give: a direction told wrongly makes it too small.
const GAINS: [f64; 3] = [1.0, 1.7, 3.0];
/// Samples at the beginning on which starts are compared: thousands of simulations.
const BEGINNING: usize = 10_000;
/// Starts that are followed.
const FOLLOWED: usize = 6;
/// How far each start is followed before the best is taken.
const WAY: Effort = Effort { steps: 10, enough: 1e-3 };
/// Part of the highest speed above which the motor surely moves.
const MOVES: f64 = 0.05;
/// Standard deviations of its noise by which y must have moved.
const OF_NOISE: f64 = 4.0;

/// The motor that predicts unseen y best, with its terms after those of `model`: a constant load, then friction and play; `None` where it
/// has neither of these.
pub(super) fn identify(model: &Loop, signals: &Signals) -> Option<Validated> {
    let beginning = signals.part(0, BEGINNING);
    let classes = [(false, false), (true, false), (false, true), (true, true)];
    let validated: Vec<Validated> = classes
        .into_par_iter()
        .filter_map(|(friction, play)| {
            let starts = starts(model, &beginning, friction, play).into_par_iter();
            let ends = starts.map(|start| start.search(&beginning, WAY));
            let best = ends.min_by(|a, b| a.variance.total_cmp(&b.variance))?;
            let across = best.model.across_the_gap();
            let across = across.iter().filter_map(|model| Fit::start(model, signals, &Whitener::none()));
            let best = across.min_by(|a, b| a.variance.total_cmp(&b.variance))?;
            validate(&best.search(signals, Effort::FULL), signals)
        })
        .collect();
    let chosen = simplest(&validated)?;
    (chosen.found.physics.len() > model.physics.len() + 1).then(|| chosen.clone())
}

/// The best of a grid over lag, friction and play: one of each friction and play.
fn starts(model: &Loop, signals: &Signals, friction: bool, play: bool) -> Vec<Fit> {
    let largest = signals.u.iter().fold(0.0f64, |most, u| most.max(u.abs()));
    let (lowest, highest) = range(&signals.y);
    let sizes = |wanted: bool, parts: &[f64], whole: f64| -> Vec<f64> {
        if wanted { parts.iter().map(|part| part * whole).collect() } else { vec![0.0] }
    };
    let levels = sizes(friction, &FRICTIONS, largest);
    let widths = sizes(play, &PLAYS, highest - lowest);
    let pairs: Vec<(f64, f64)> =
        levels.iter().flat_map(|level| widths.iter().map(move |width| (*level, *width))).collect();
    let lags = lags(signals);
    let mut best: Vec<Fit> = pairs
        .into_par_iter()
        .filter_map(|(level, width)| {
            let unwound = Unwound::of(signals, level, width);
            let tried = lags.iter().filter_map(|lag| unwound.motion(*lag)).flat_map(|motion| {
                let motors = GAINS.map(|factor| unwound.motor(model, &motion, factor));
                motors
                    .into_iter()
                    .filter_map(|motor| Fit::start(&motor?.coarse(), signals, &Whitener::none()))
            });
            tried.min_by(|a, b| a.variance.total_cmp(&b.variance))
        })
        .collect();
    best.sort_by(|a, b| a.variance.total_cmp(&b.variance));
    best.truncate(FOLLOWED);
    best
}

/// `lag_s*y'' + y' = gain*(drive + offset)`.
struct Motion {
    lag_s: f64,
    gain: f64,
    offset: f64,
}

/// The recording as it would be without friction and play of these sizes: u less friction, y beyond the play.
struct Unwound<'a> {
    measured: &'a Signals,
    beyond: Signals,
    drive: Vec<f64>,
    level: f64,
    width: f64,
}

impl<'a> Unwound<'a> {
    fn of(measured: &'a Signals, level: f64, width: f64) -> Self {
        let shown = directions(&measured.y);
        let moves = if width > 0.0 { through_gaps(&shown) } else { shown.clone() };
        // At rest friction holds against all of u.
        let drive = measured.u.iter().zip(&moves);
        let drive = drive.map(|(u, way)| if *way == 0.0 { 0.0 } else { u - level * way }).collect();
        // In the gap y says nothing of the motor.
        let y = measured.y.iter().zip(shown.iter().zip(&moves));
        let y = y.map(|(y, (shown, way))| if shown == way { y + 0.5 * width * way } else { f64::NAN });
        let beyond = Signals { y: y.collect(), ..measured.clone() };
        Self { measured, beyond, drive, level, width }
    }

    /// The linear motion of this lag; `None` where the drive does not move it.
    fn motion(&self, lag_s: f64) -> Option<Motion> {
        let fit = shape(&[lag_s], true, 0).fit(&self.beyond, &self.drive)?;
        let Plant::TransferFunction(linear) = &fit.plant else { return None };
        Some(Motion { lag_s, gain: *linear.num.first()?, offset: linear.offset })
    }

    /// The motor of this motion with a gain that is larger by the factor, ready to be searched from.
    fn motor(&self, model: &Loop, motion: &Motion, factor: f64) -> Option<Model> {
        let gain = factor * motion.gain;
        let servo = Servo {
            output: Output::Position,
            inertia: motion.lag_s / gain.abs(),
            viscous: 1.0 / gain.abs(),
            actuator_gain: gain.signum(),
        };
        let mut motor = Loop { plant: Plant::Servo(servo), ..model.clone() };
        motor.units = units::beside(&motor.plant, &motor.units);
        let terms = [
            ("load_step", "level", Some(-gain.signum() * motion.offset)),
            ("coulomb_friction", "level", Some(self.level).filter(|level| *level > 0.0)),
            ("sensor_hysteresis", "width", Some(self.width).filter(|width| *width > 0.0)),
        ];
        let mut start = Model::refit(&motor, self.measured);
        for (kind, parameter, value) in terms {
            if let Some(value) = value {
                let term = Term::new(kind, &[(parameter, value)]).ok()?;
                start = start.with_term(&term, false, self.measured.duration_s());
            }
        }
        Some(start)
    }
}

/// Which way y moves at each sample: 1, -1, or 0 where it rests, as far as its noise lets that be told.
fn directions(y: &[f64]) -> Vec<f64> {
    let y = held(y);
    let mut rates: Vec<f64> = y.windows(3).map(|w| w[2] - w[0]).collect();
    rates.insert(0, rates.first().copied().unwrap_or(0.0));
    rates.push(rates.last().copied().unwrap_or(0.0));
    let fastest = rates.iter().fold(0.0f64, |most, rate| most.max(rate.abs()));
    let least = (MOVES * fastest).max(OF_NOISE * libm::sqrt(2.0 * noise_floor(&y)));
    rates.into_iter().map(|rate| if rate.abs() > least { rate.signum() } else { 0.0 }).collect()
}

/// The directions with each rest between opposite ones taken for a way through the gap, in the new direction.
fn through_gaps(shown: &[f64]) -> Vec<f64> {
    let mut moves = shown.to_vec();
    let mut next = 0.0;
    for way in moves.iter_mut().rev() {
        if *way != 0.0 {
            next = *way;
        } else {
            *way = next;
        }
    }
    let mut last = 0.0;
    for (way, shown) in moves.iter_mut().zip(shown) {
        if *shown != 0.0 {
            last = *shown;
        } else if *way == last {
            *way = 0.0;
        }
    }
    moves
}
