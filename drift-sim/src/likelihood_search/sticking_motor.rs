//! An unknown motor that positions, with dry friction and with play before its sensor: a search that takes one after the other finds neither, for each hides the other.
//!
//! Where the direction of motion is known, the motion is linear again: friction is a drive of known sign, and play a shift of known sign. y tells the direction, so that
//! a grid over lag, friction and play needs one linear least squares each. Their fits by likelihood begin at the best of these.

use crate::cores::AcrossCores as _;

use crate::control_loop::Loop;
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::{Hypothesis, Point, Target, is_noise};
use crate::estimate::likelihood::Data;
use crate::estimate::signals::{Signals, held, noise_variance, range};
use crate::init::least_squares::LeastSquares;
use crate::physics::Term;
use crate::plant::{Output, Plant, Servo};

use super::nominal::with_noise;
use super::options::Options;
use super::parts::Parts;
use super::plants::{Identified, guessing};
use super::units;
use super::without::without;

/// Levels of friction tried, as parts of the largest u.
const FRICTIONS: [f64; 6] = [0.02, 0.05, 0.1, 0.2, 0.3, 0.45];
/// Widths of play tried, as parts of the range of y.
const PLAYS: [f64; 5] = [0.02, 0.05, 0.1, 0.2, 0.4];
/// Gains tried, as parts of the one that least squares give: a direction told wrongly makes it too small.
const GAINS: [f64; 3] = [1.0, 1.7, 3.0];
/// Lags tried, from two samples to this part of the recording, evenly in their logarithm.
const LAGS: usize = 12;
const LONGEST_PART: f64 = 0.1;
/// Samples at the beginning on which starts are compared: thousands of simulations.
const BEGINNING: usize = 3_000;
/// Starts that are followed, the steps of each, and those of the best.
const FOLLOWED: usize = 12;
const STEPS: usize = 8;
const MORE_STEPS: usize = 30;
/// Part of the highest speed above which the motor surely moves.
const MOVES: f64 = 0.05;
/// Standard deviations of its noise by which y must have moved.
const OF_NOISE: f64 = 4.0;
/// Noise that fits begin with: logarithm of the load's size over the drive's, its time constant in samples, atanh of what stays of the sensor's.
const NOISE: (f64, f64, f64) = (-2.0, 20.0, 0.0);

/// The motor, and the fit with friction and play as its last candidates; `None` where y is no motor's position.
pub fn beside_play(model: &Loop, parts: &Parts, options: &Options) -> Option<(Identified, Fit)> {
    let options = guessing(options);
    let first = parts.recordings.first()?;
    let beginning = first.part(0, BEGINNING.min(*parts.fitted.first()?));
    let data = |hypothesis: &Hypothesis, of: &[Signals], fitted: Vec<usize>| {
        Data::new(hypothesis, of.to_vec(), fitted)
    };
    let of_beginning = |start: &Start| {
        let (hypothesis, point) = start.hypothesis(model, &parts.recordings, &options)?;
        let data = data(&hypothesis, std::slice::from_ref(&beginning), vec![beginning.len()]);
        Some((Fit::at(&hypothesis, &point, &data)?, data))
    };
    let starts = starts(&beginning, sign_of_law(model)?);
    let begun = starts.into_par_iter().filter_map(|group| {
        let fits = group.iter().filter_map(of_beginning);
        fits.min_by(|a, b| a.0.objective().total_cmp(&b.0.objective()))
    });
    let mut begun: Vec<(Fit, Data)> = begun.collect();
    begun.sort_by(|a, b| a.0.objective().total_cmp(&b.0.objective()));
    begun.truncate(FOLLOWED);
    begun.par_iter_mut().for_each(|(fit, data)| {
        // Under a load that is free from the first step on, all is the load's.
        let is_of_noise = |i: &usize| fit.hypothesis.free.get(*i).is_some_and(|free| is_noise(free.target));
        let noise: Vec<usize> = (0..fit.hypothesis.free.len()).filter(is_of_noise).collect();
        fit.descend(data, STEPS, &noise);
        fit.descend(data, STEPS, &[]);
    });
    let (best, _) = begun.into_iter().min_by(|a, b| a.0.objective().total_cmp(&b.0.objective()))?;
    let data = data(&best.hypothesis, &parts.recordings, parts.fitted.clone());
    let mut fit = Fit::at(&best.hypothesis, &best.point, &data)?;
    fit.descend(&data, MORE_STEPS, &[]);
    let nominal = without(&without(&fit, 1, &data)?, 0, &data)?;
    // A temperature is no motor's position.
    units::suit(&model.units, &nominal.hypothesis.model.plant)
        .then_some((Identified { nominal, data, is_guessed: true }, fit))
}

/// The sign of the law's proportional gain: a motor of another one would run away.
fn sign_of_law(model: &Loop) -> Option<f64> {
    let (_, kp) = model.controller.gains().into_iter().find(|(name, _)| *name == "kp")?;
    (kp != 0.0).then(|| kp.signum())
}

/// The motors of a grid over friction and play, those of each pair together.
fn starts(signals: &Signals, sign: f64) -> Vec<Vec<Start>> {
    let largest = signals.u.iter().fold(0.0f64, |most, u| most.max(u.abs()));
    let (lowest, highest) = range(&signals.y);
    let of_level = |level: f64| PLAYS.map(|part| (level, part * (highest - lowest)));
    let pairs: Vec<(f64, f64)> = FRICTIONS.iter().flat_map(|part| of_level(part * largest)).collect();
    let lags = lags(signals);
    let group = |(level, width)| {
        let unwound = Unwound::of(signals, level, width);
        lags.iter()
            .filter_map(|lag| unwound.motion(*lag))
            .flat_map(|motion| motion.motors((level, width), sign))
            .collect()
    };
    pairs.into_par_iter().map(group).collect()
}

fn lags(signals: &Signals) -> Vec<f64> {
    let shortest = 2.0 * signals.sample_time_s;
    let ratio = (LONGEST_PART * signals.duration_s() / shortest).max(1.0);
    (0..LAGS).map(|i| shortest * libm::pow(ratio, i as f64 / (LAGS - 1) as f64)).collect()
}

/// A motor with the load that stays, its friction and its play.
struct Start {
    motor: Servo,
    load: f64,
    friction: f64,
    play: f64,
}

impl Start {
    /// The hypothesis of this motor, and where its fit begins.
    fn hypothesis(
        &self,
        model: &Loop,
        recordings: &[Signals],
        options: &Options,
    ) -> Option<(Hypothesis, Point)> {
        let mut motor = Loop { plant: Plant::Servo(self.motor), ..model.clone() };
        motor.units = units::beside(&motor.plant, &motor.units);
        let friction = Term::new("coulomb_friction", &[("level", self.friction)]).ok()?;
        let play = Term::new("sensor_hysteresis", &[("width", self.play)]).ok()?;
        let hypothesis = super::hypothesis(&motor, recordings, options).with(friction).with(play);
        let (size, tau, rho) = NOISE;
        let mut point = with_noise(&hypothesis, &hypothesis.own_point(), size, tau, rho);
        let place = hypothesis.place(Target::ConstantLoad)?;
        *point.x.get_mut(place)? = hypothesis.free.get(place)?.x_of(self.load);
        Some((hypothesis, point))
    }
}

/// `lag_s*y'' + y' = gain*(drive + offset)`.
struct Motion {
    lag_s: f64,
    gain: f64,
    offset: f64,
}

impl Motion {
    /// Motors of this motion, with this gain and with larger ones, of the sign that a law can hold.
    fn motors(&self, (friction, play): (f64, f64), sign: f64) -> [Start; 3] {
        GAINS.map(|factor| {
            let gain = factor * self.gain.abs();
            let motor = Servo {
                output: Output::Position,
                inertia: self.lag_s / gain,
                viscous: 1.0 / gain,
                actuator_gain: sign,
            };
            Start { motor, load: -sign * self.offset, friction, play }
        })
    }
}

/// The recording as it would be without friction and play of these sizes: u less friction, y beyond the play.
struct Unwound {
    sample_time_s: f64,
    /// In the gap, where y says nothing of the motor, not finite.
    beyond: Vec<f64>,
    drive: Vec<f64>,
}

impl Unwound {
    fn of(measured: &Signals, level: f64, width: f64) -> Self {
        let shown = directions(&measured.y);
        let moves = through_gaps(&shown);
        // At rest friction holds against all of u.
        let drive = measured.u.iter().zip(&moves);
        let drive = drive.map(|(u, way)| if *way == 0.0 { 0.0 } else { u - level * way }).collect();
        let y = measured.y.iter().zip(shown.iter().zip(&moves));
        let beyond = y.map(|(y, (shown, way))| if shown == way { y + 0.5 * width * way } else { f64::NAN });
        Self { sample_time_s: measured.sample_time_s, beyond: beyond.collect(), drive }
    }

    /// The linear motion of this lag, by least squares: what the drive makes, what a constant drive makes, the first speed and the first place are free; `None` where the drive
    /// does not move it.
    fn motion(&self, lag_s: f64) -> Option<Motion> {
        let y0 = *self.beyond.iter().find(|y| y.is_finite())?;
        let keep = libm::exp(-self.sample_time_s / lag_s);
        let mut regression = LeastSquares::new(4);
        let (mut driven, mut constant) = ([0.0; 2], [0.0; 2]);
        let mut free = 1.0;
        for (y, drive) in self.beyond.iter().zip(&self.drive) {
            if y.is_finite() {
                regression.add(y - y0, &[driven[1], constant[1], free, 1.0]);
            }
            for (state, drive) in [(&mut driven, *drive), (&mut constant, 1.0)] {
                state[0] = keep * state[0] + (1.0 - keep) * drive;
                state[1] += self.sample_time_s * state[0];
            }
            free *= keep;
        }
        let solved = regression.solve()?.coefficients;
        let (gain, of_constant) = (*solved.first()?, *solved.get(1)?);
        let offset = of_constant / gain;
        (gain != 0.0 && offset.is_finite()).then_some(Motion { lag_s, gain, offset })
    }
}

/// Which way y moves at each sample: 1, -1, or 0 where it rests, as far as its noise lets that be told.
fn directions(y: &[f64]) -> Vec<f64> {
    let y = held(y);
    let mut rates: Vec<f64> = y.windows(3).map(|w| w[2] - w[0]).collect();
    rates.insert(0, rates.first().copied().unwrap_or(0.0));
    rates.push(rates.last().copied().unwrap_or(0.0));
    let fastest = rates.iter().fold(0.0f64, |most, rate| most.max(rate.abs()));
    let least = (MOVES * fastest).max(OF_NOISE * libm::sqrt(2.0 * noise_variance(&y)));
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
