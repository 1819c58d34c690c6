//! Whether what was found simulates what it has not seen: the closed loop from r alone; under an unknown law the plant from u alone. A likelihood of
//! single steps may be high on a plant that is none. How far a simulation may miss follows from the noise that the fit itself found: a loop at rest,
//! or one that cycles, is where its noise has led it.

use std::cell::LazyCell;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use crate::control_loop::Loop;
use crate::controller::Controller;
use crate::diagnose::prove::{FitPct, quiet_run, without_noise};
use crate::diagnose::{Diagnosis, Named, Verdict, part_time};
use crate::estimate::fit::Fit;
use crate::estimate::inner_product::dot;
use crate::estimate::likelihood::Data;
use crate::estimate::noise::Noise;
use crate::estimate::signals::Signals;
use crate::estimate::waves::Swings;
use crate::measured_input::{Enters, Input};
use crate::physics::{Family, Place, Starts};
use crate::simulate::{self, Start, Trace};

use super::decide::has_onset;
use super::limit_cycle;
use super::moved_by_disturbances;

/// Part of y that a guessed plant must simulate of what it has not seen, from u alone, for anything to be said on it; or the part of the error without
/// them that the named terms may leave there, where one of them gains this much in log-likelihood and y is simulated at all.
const LEAST_SIMULATED_PCT: f64 = 50.0;
const CLOSER: f64 = 0.9;
const STRONG: f64 = 50.0;
/// The same of a valve that sticks, however far the slow load leads either simulation.
const FAR_CLOSER: f64 = 0.5;
/// Part of y that it must simulate, in per cent, where noise excuses the rest.
const LEAST_FOLLOWED_PCT: f64 = 10.0;
/// How many times the error without the named terms, or the error that the noise explains, they may leave anywhere.
const MOST_WORSE: f64 = 1.25;
/// Part of the error without the named terms, beyond the noise, that they must explain where more than noise is missing. Of 128 right diagnoses of
/// four seeds of `.ci/wide` four explain less than 0.44.
const LEAST_EXPLAINED: f64 = 0.25;
/// Part of all that is missed that they must explain to be proven by it.
const LEAST_EXPLAINED_AT_ALL: f64 = 0.4;
/// Part of it that they leave at most where no further search is needed.
const LEFT_OF_NEARLY_ALL: f64 = 0.25;
/// The same under colored noise, which may be taken for anything.
const LEAST_EXPLAINED_COLORED: f64 = 0.5;
/// Part of the drive that must be u's for the noise to excuse that a guessed plant does not follow, and for anything to be named on it but a disturbance, or play. Of 34 loops of
/// five seeds of `.ci/wide` that hardly move, plant unknown, two have less, and a wave that disturbs them; an industrial loop with a dead time had a limit and a play at 0.29.
const LEAST_PREDICTED: f64 = 0.3;
/// The same where the simulation follows nothing of y at all, as one of an integrator from u alone does; and less where a term is named beyond doubt: of the loops
/// of `.ci/wide` (seeds 616 and 617, law and plant unknown) four were held back there, all of them right, with gains of 1 100 and more.
const NEARLY_ALL: f64 = 0.9;
const MOSTLY: f64 = 0.75;
/// Log-likelihood that such a term gains.
const CERTAIN: f64 = 250.0;
/// What begins on a guessed plant gains where no simulation is asked for.
const BEYOND_DOUBT: f64 = 1000.0;
/// Jumps that are more than one fault: a pulse has two, and the second pulse begins with the third.
const EDGES: usize = 3;
/// Recordings that are drawn to see how far noise leads a simulation astray: one in twenty that are as the fit has it is led farther than all of them.
const DRAWN: u64 = 19;

/// A diagnosis on its trial.
pub struct Trial<'a> {
    /// What was found.
    pub found: &'a Diagnosis,
    /// The fit that it comes from.
    pub fit: &'a Fit,
    /// What simulations are held against.
    pub shown: &'a Signals,
    /// The improved loop, as it runs over that.
    pub model: &'a Loop,
    /// What the numbers of the first recording were fitted to.
    pub seen: &'a Signals,
    /// Whether the plant came from the recordings.
    pub is_guessed: bool,
    /// Whether healthy recordings tell how noisy the sensor was before.
    pub has_healthy: bool,
    /// What it was fitted to: what is left of correlation in its innovations, and when the load jumped.
    pub data: &'a Data,
    /// How many of the recording's samples that takes as one.
    pub factor: usize,
    /// Part of the drive's variance that is u's.
    pub predicted: f64,
    /// How well the loop without what is named beside its law simulates what nothing has seen.
    pub without: Option<FitPct>,
    /// What play must gain to stand without a simulation: see [`Options`](super::options::Options).
    pub play_gain: f64,
}

impl Trial<'_> {
    /// Whether the named terms don't make the simulation worse, and whether a guessed plant simulates at all.
    pub fn passes(&self) -> bool {
        if self.cycles_as_measured() || self.plays_strongly() || self.begins_beyond_doubt() {
            return true;
        }
        if !self.is_driven() {
            return false;
        }
        let (Some(before), Some(after)) = (self.without, self.found.unseen_fits().after) else {
            return !self.is_guessed;
        };
        let missed = LazyCell::new(|| self.missed_beside_drawn());
        let is_led = LazyCell::new(|| self.is_led_by_the_load());
        let as_noise_has_it = || missed.is_some_and(Missed::is_as_noise_has_it) || *is_led;
        self.follows(before, after, as_noise_has_it)
            && self.is_no_worse(before, after, || *missed, as_noise_has_it)
            && (self.explains(before, after, || *missed) || *is_led)
    }

    /// Whether the named terms explain most of what the loop without them misses of what nothing has seen, beyond its sensor's noise.
    pub fn proves(&self) -> bool {
        let (Some(before), Some(after)) = (self.without, self.found.unseen_fits().after) else {
            return false;
        };
        !self.found.physics.is_empty() && self.explains_most(before, after)
    }

    /// Whether little is left beside what is named of what the loop without it misses.
    pub fn explains_nearly_all(&self) -> bool {
        let (Some(before), Some(after)) = (self.without, self.found.unseen_fits().after) else {
            return false;
        };
        after.error() < LEFT_OF_NEARLY_ALL * before.error()
    }

    /// The same of what the loop without it misses beyond its sensor's noise.
    pub fn leaves_noise(&self) -> bool {
        let (Some(before), Some(after)) = (self.without, self.found.unseen_fits().after) else {
            return false;
        };
        let floor = self.found.noise_floor.map_or(0.0, FitPct::error);
        after.error() - floor < LEFT_OF_NEARLY_ALL * (before.error() - floor)
    }

    /// Whether something strong is named that brings a simulation closer.
    pub fn confirms(&self) -> bool {
        let (Some(before), Some(after)) = (self.without, self.found.unseen_fits().after) else {
            return false;
        };
        self.names_what_gains(STRONG) && after.error() < CLOSER * before.error()
    }

    /// Whether nothing but what sticks or plays is named on a guessed plant, and gains so much that no simulation is asked for: what it foretells of unseen samples proves it, and a slip that
    /// comes late, or a load that goes elsewhere, leads a simulation from u anywhere.
    pub fn plays_strongly(&self) -> bool {
        let plays = |named: &Named| is_play(named) && named.is_of_told_size();
        self.is_guessed && self.names_what_gains(self.play_gain) && self.found.physics.iter().all(plays)
    }

    /// Whether all that is named on a guessed plant begins at some time, and one gains so much there that no simulation is asked for: nothing that a guess lacks, and no law turned round, begins,
    /// and where a loop rests what disturbs it leads a simulation from u anywhere.
    pub fn begins_beyond_doubt(&self) -> bool {
        let named = &self.found.physics;
        self.is_guessed
            && !self.has_healthy
            && !self.is_closed()
            && self.names_what_gains(BEYOND_DOUBT)
            && named.iter().all(|named| has_onset(named.term.kind))
    }

    /// Whether three terms are named that begin at once and do about the same: what jumps to and fro is one signal that comes and goes, and each of its edges had a name of its own.
    pub fn jumps_to_and_fro(&self) -> bool {
        let is_jump = |named: &&Named| named.term.kind.family == Some(Family::Offset);
        self.found.physics.iter().filter(is_jump).count() >= EDGES
    }

    /// Whether the plant that was guessed from a loop at rest is its law turned round: no plant follows most of y from u alone where disturbances move both, and what is named beside it
    /// brings it no closer, or, where that plays, leaves more than noise. (A valve that plays makes a cycle of which a plant without it follows nothing.)
    pub fn follows_by_the_law(&self) -> bool {
        let fits = self.without.zip(self.found.unseen_fits().after);
        let is_no_closer = |(before, after): (FitPct, FitPct)| {
            let is_little = after.error() >= before.error() || (self.names_play() && !self.leaves_noise());
            before.y_pct > LEAST_SIMULATED_PCT && is_little
        };
        self.is_guessed
            && !self.has_healthy
            && !self.is_closed()
            && !self.names_noise_alone()
            && fits.is_some_and(is_no_closer)
            && moved_by_disturbances::are_alone(std::slice::from_ref(self.seen))
    }

    /// Whether what plays or sticks is named.
    pub fn names_play(&self) -> bool {
        self.found.physics.iter().any(is_play)
    }

    /// Whether all that is named is noise of the sensor, of which a simulation shows nothing.
    pub fn names_noise_alone(&self) -> bool {
        !self.found.physics.is_empty() && self.found.physics.iter().all(Named::is_noise_change)
    }

    /// Whether something is named that gains more than this in log-likelihood.
    pub fn names_what_gains(&self, least: f64) -> bool {
        self.found.physics.iter().any(|named| named.train_gain > least)
    }

    /// Whether what is named does not make that worse.
    pub fn improves(&self) -> bool {
        let after = self.found.unseen_fits().after;
        self.found.physics.is_empty()
            || self.without.zip(after).is_some_and(|(before, after)| after.error() <= before.error())
    }

    /// Whether other numbers alone explain most of what the loop as stated misses there.
    pub fn proves_numbers(&self) -> bool {
        let fits = self.found.unseen_fits();
        let (Some(nominal), Some(before)) = (fits.nominal, fits.before) else { return false };
        self.found.verdict == Verdict::Parameters && self.explains_most(nominal, before)
    }

    fn explains_most(&self, worse: FitPct, better: FitPct) -> bool {
        let floor = self.found.noise_floor.map_or(0.0, FitPct::error);
        let explained = worse.error() - better.error();
        explained > LEAST_EXPLAINED_COLORED * (worse.error() - floor)
            && explained > LEAST_EXPLAINED_AT_ALL * worse.error()
    }

    /// Whether u is enough of a guessed plant's drive for what acts on the way from u to y: what disturbs the plant, or is the sensor's alone, does not ask for that, and what
    /// sticks or plays shows in how y jumps and turns.
    fn is_driven(&self) -> bool {
        let is_apart =
            |named: &Named| named.term.kind.place == Place::Disturbance || is_noise(named) || is_play(named);
        !self.is_guessed
            || self.has_healthy
            || self.predicted > LEAST_PREDICTED
            || self.found.physics.iter().all(is_apart)
    }

    /// Whether play or sticking is named, and makes the cycle that was recorded.
    pub fn cycles_as_measured(&self) -> bool {
        let improved = &self.found.improved;
        // The refitted numbers may have bent until the loop cycles without any play.
        let mut without = improved.clone();
        without.physics.retain(|term| !term.plays());
        self.found.physics.iter().any(is_play) && limit_cycle::is_made(improved, &without, self.seen)
    }

    /// Whether the named terms explain what is missing, or most of that is noise: what explains little of it stands in for something else. Beside the
    /// sensor's the random load's part is noise.
    fn explains(&self, before: FitPct, after: FitPct, missed: impl Fn() -> Option<Missed>) -> bool {
        let Some(floor) = self.found.noise_floor.map(FitPct::error) else { return true };
        let explained = before.error() - after.error();
        if self.data.coloring().order() > 0 {
            return explained > LEAST_EXPLAINED_COLORED * (before.error() - floor);
        }
        let is_enough = |noise: f64| {
            let missing = before.error() - noise;
            missing < noise || explained > LEAST_EXPLAINED * missing
        };
        self.found.physics.iter().all(is_noise)
            || is_enough(floor)
            || missed().is_some_and(|missed| {
                missed.is_as_noise_has_it() || is_enough(floor.max(after.error() / missed.beyond_mean()))
            })
    }

    fn follows(&self, before: FitPct, after: FitPct, as_noise_has_it: impl Fn() -> bool) -> bool {
        let named = &self.found.physics;
        let is_open = !self.found.nominal.has_law();
        let is_strong = |named: &Named| named.train_gain > STRONG;
        let is_louder = !named.is_empty() && named.iter().all(|named| is_noise(named) && is_strong(named));
        let is_certain = self.names_what_gains(CERTAIN);
        // A louder sensor foretells nothing of y: no simulation follows the better for it, nor speaks against what is beyond doubt.
        let is_loud = is_louder && (self.has_healthy || is_certain);
        if !(self.is_guessed && is_open) || named.iter().any(is_rounding) || is_loud {
            return true;
        }
        let is_any_strong = self.names_what_gains(STRONG);
        let is_closer = after.error() < CLOSER * before.error() && is_any_strong;
        let excused = |least: f64| self.predicted > least && as_noise_has_it();
        // Noise leads what integrates anywhere, and something strong is named on it; what keeps its level follows u, or only what is beyond doubt is.
        let is_led = named.is_empty() || (is_any_strong && !self.found.improved.plant.keeps_its_level());
        // What healthy recordings tell of a plant is not judged by how noise leads it.
        let is_known = is_louder || (self.has_healthy && is_any_strong);
        // What sticks shows in how y jumps; the slow load that leads the simulation astray hides none of that.
        let is_stuck = named.iter().any(|named| is_play(named) && is_strong(named));
        after.y_pct > LEAST_SIMULATED_PCT
            || (is_known && as_noise_has_it())
            || (is_certain && excused(MOSTLY))
            || ((is_led || is_stuck) && excused(NEARLY_ALL))
            || (is_certain && is_stuck && excused(LEAST_PREDICTED))
            || (is_stuck && after.error() < FAR_CLOSER * before.error())
            || (is_led && is_closer && excused(LEAST_PREDICTED))
            || (after.y_pct > 0.0 && is_closer)
            || (after.y_pct > LEAST_FOLLOWED_PCT && excused(LEAST_PREDICTED))
    }

    fn is_no_worse(
        &self,
        before: FitPct,
        after: FitPct,
        missed: impl Fn() -> Option<Missed>,
        as_noise_has_it: impl Fn() -> bool,
    ) -> bool {
        // What noise leads farther in all that are drawn is a loop that is held less than the measured one: it excuses anything.
        let is_held = || missed().is_none_or(|missed| missed.measured >= missed.least_drawn);
        self.found.physics.iter().all(is_noise)
            || after.error() < MOST_WORSE * before.error()
            || self.is_led_no_farther()
            || (is_held() && (as_noise_has_it() || self.is_no_worse_than_drawn()))
    }

    /// Whether a closed loop that has what is named may be simulated as much worse with it than without it: one that cycles has a phase that its noise gives it, and a simulation another one.
    fn is_no_worse_than_drawn(&self) -> bool {
        let measured = self.times_as_far(self.shown);
        let Some(measured) = measured.filter(|_| self.is_closed()) else { return false };
        let drawn = self.each_drawn(|drawn| self.times_as_far(drawn));
        drawn.is_some_and(|drawn| drawn.into_iter().any(|ratio| ratio >= measured))
    }

    /// Whether a law that is known closes the loop.
    fn is_closed(&self) -> bool {
        self.found.improved.has_law()
    }

    /// How many times by as much what is named misses a recording as the loop without it.
    fn times_as_far(&self, signals: &Signals) -> Option<f64> {
        let (load, swings) = (self.load_sd()?, self.swings());
        let missed_by = |model: &Loop| missed(model, signals, load, swings.as_ref());
        Some(missed_by(self.model)? / missed_by(&self.found.refitted)?.max(1e-300))
    }

    /// The same where u leads a plant that does not keep its level: an offset of u that nothing shows leads either simulation anywhere.
    fn is_led_no_farther(&self) -> bool {
        let keeps = self.found.improved.plant.keeps_its_level();
        !self.found.physics.iter().any(is_play)
            && self.led_farther(keeps).is_some_and(|part| part < MOST_WORSE)
    }

    /// Whether play or sticking is named beyond doubt on a plant that the slow load leads anywhere, and leads it no farther: no simulation from u shows it there, nor speaks against it.
    fn is_led_by_the_load(&self) -> bool {
        let is_strong = |named: &Named| is_play(named) && named.train_gain > STRONG;
        let keeps = self.found.improved.plant.keeps_its_level_over(self.seen.duration_s());
        self.found.physics.iter().any(is_strong) && self.led_farther(keeps).is_some_and(|part| part <= 1.0)
    }

    /// How many times as far as without what is named the loop is led with it, from u alone; `None` where the law closes it, or its plant keeps its level.
    fn led_farther(&self, keeps_its_level: bool) -> Option<f64> {
        if self.is_closed() || keeps_its_level { None } else { self.times_as_far(self.shown) }
    }

    /// Deviation of the random load.
    fn load_sd(&self) -> Option<f64> {
        let realised = self.fit.hypothesis.realise(&self.fit.point)?;
        Some(realised.noise.load_ratio * self.fit.rows.sensor_sd)
    }

    /// Levels between which the load jumps as often as it did.
    fn drawn_levels(&self, samples: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
        let jumps = self.data.jumps();
        let all: usize = self.data.recordings.iter().map(Signals::len).sum();
        let rate = jumps.rate(self.factor * all);
        let deviation = jumps.level_deviation(self.fit.rows.sensor_sd);
        let mut drawn = || -> f64 { StandardNormal.sample(random) };
        let mut level = 0.0;
        let next = |_| {
            // One in so many normal numbers is beyond a bound.
            if rate > 0.0 && libm::erfc(drawn().abs() * std::f64::consts::FRAC_1_SQRT_2) < rate {
                level = deviation * drawn();
            }
            level
        };
        (0..samples).map(next).collect()
    }

    /// By how much this recording is missed, and those that are drawn from the fit, its noise among it.
    fn missed_beside_drawn(&self) -> Option<Missed> {
        let (load, swings) = (self.load_sd()?, self.swings());
        let missed_in = |signals: &Signals| missed(self.model, signals, load, swings.as_ref());
        let drawn = self.each_drawn(missed_in)?;
        let mean_drawn = drawn.iter().sum::<f64>() / DRAWN as f64;
        let least = drawn.iter().copied().fold(f64::INFINITY, f64::min);
        let most = drawn.into_iter().fold(0.0, f64::max);
        let (least_drawn, most_drawn) = if self.is_closed() { (least, most) } else { (0.0, 0.0) };
        Some(Missed { measured: missed_in(self.shown)?, mean_drawn, least_drawn, most_drawn })
    }

    /// What is asked of each recording that is drawn from the fit.
    fn each_drawn(&self, asked: impl Fn(&Signals) -> Option<f64>) -> Option<Vec<f64>> {
        let noise = self.fit.hypothesis.realise(&self.fit.point)?.noise;
        (0..DRAWN).map(|seed| asked(&self.drawn(self.model, &noise, seed)?)).collect()
    }

    /// A recording of a loop under the same reference (under the same u, where the law is unknown), with load and sensor noise of the fit's size.
    fn drawn(&self, model: &Loop, noise: &Noise, seed: u64) -> Option<Signals> {
        let signals = self.shown;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let sensor_sd = self.fit.rows.sensor_sd;
        let phi = noise.load_phi(signals.sample_time_s);
        let mut load = sequence(signals.len(), noise.load_ratio * sensor_sd, phi, &mut random);
        let levels = self.drawn_levels(signals.len(), &mut random);
        load.iter_mut().zip(levels).for_each(|(load, level)| *load += level);
        let mut sensor = sequence(signals.len(), sensor_sd, noise.sensor_rho, &mut random);
        let white = sequence(signals.len(), sensor_sd * libm::sqrt(noise.sensor_white), 0.0, &mut random);
        sensor.iter_mut().zip(white).for_each(|(sensor, white)| *sensor += white);
        let colored = |mut white: Vec<f64>| {
            self.data.coloring().color(&mut white);
            white
        };
        let (load, sensor) = (colored(load), colored(sensor));
        let mut noisy = without_noise(model);
        let mut inputs = signals.inputs.clone();
        for (values, enters) in [(load, Enters::Load), (grown(sensor, noise, signals), Enters::Sensor)] {
            noisy.inputs.push(Input::made(enters));
            inputs.push(values);
        }
        let noisy = part_time::of(noisy, signals.origin_s);
        let start = Start::from_recording(&noisy, &signals.r, &signals.y, &signals.u);
        let trace = match noisy.controller {
            Controller::Recorded => simulate::replay(&noisy, &signals.u, &inputs, seed, Some(&start)),
            _ => simulate::simulate(&noisy, &signals.r, &inputs, seed, Some(&start)),
        };
        let Trace { y, u, .. } = trace.ok()?;
        let u = if !noisy.has_law() { signals.u.clone() } else { u };
        Some(Signals { y, u, ..signals.clone() })
    }

    /// What swings beside the loop, at all frequencies that any recording has: in what is drawn nothing does.
    fn swings(&self) -> Option<Swings> {
        let hz = self.data.waves().hz.concat();
        let shown = self.shown;
        (!hz.is_empty()).then(|| Swings::over(&hz, shown.sample_time_s, &vec![true; shown.len()]))
    }
}

/// By how much a simulation misses what was measured, and what is drawn as the fit has it.
#[derive(Clone, Copy)]
struct Missed {
    measured: f64,
    mean_drawn: f64,
    least_drawn: f64,
    /// Both 0 under an unknown law: from u alone noise leads a few of those drawn so far that they would excuse anything.
    most_drawn: f64,
}

impl Missed {
    /// Whether noise explains it.
    fn is_as_noise_has_it(self) -> bool {
        self.beyond_mean() < MOST_WORSE || self.measured <= self.most_drawn
    }

    /// How many times worse the measured one is simulated than the mean of those drawn.
    fn beyond_mean(self) -> f64 {
        self.measured / self.mean_drawn.max(1e-300)
    }
}

/// A first-order autoregression of this deviation.
pub(crate) fn sequence(samples: usize, deviation: f64, stays: f64, random: &mut ChaCha8Rng) -> Vec<f64> {
    let mut draw = || -> f64 { StandardNormal.sample(random) };
    let mut value = deviation * draw();
    let moves = deviation * libm::sqrt(1.0 - stays * stays);
    (0..samples)
        .map(|_| {
            let now = value;
            value = stays * value + moves * draw();
            now
        })
        .collect()
}

/// Sensor noise that grows where the fit says so.
fn grown(mut sensor: Vec<f64>, noise: &Noise, signals: &Signals) -> Vec<f64> {
    let at = |n: usize| signals.origin_s + n as f64 * signals.sample_time_s;
    sensor.iter_mut().enumerate().for_each(|(n, value)| *value *= noise.growth_at(at(n)));
    sensor
}

/// By how much a simulation misses u (y under an unknown law), in its own unit: how far noise leads a loop does not follow from how far it moves. What a load
/// that stays makes of it does not count: under a random load nothing tells its size for sure, and behind an integrator it leads anywhere. Nor does what swings beside the loop.
fn missed(model: &Loop, signals: &Signals, load: f64, swings: Option<&Swings>) -> Option<f64> {
    let missed_under = |load: f64| {
        let mut missed = differences(model, signals, load)?;
        if let Some(swings) = swings {
            swings.take_out(&mut missed);
        }
        Some(missed)
    };
    let missed = missed_under(0.0)?;
    let taken = missed_under(load).map_or(0.0, |under| {
        let answer: Vec<f64> = under.iter().zip(&missed).map(|(a, b)| a - b).collect();
        let along = dot(&answer, &missed);
        along * along / dot(&answer, &answer).max(1e-300)
    });
    Some(libm::sqrt((dot(&missed, &missed) - taken).max(0.0) / missed.len().max(1) as f64))
}

/// What a simulation under this load misses of u, or of y under an unknown law.
fn differences(model: &Loop, signals: &Signals, load: f64) -> Option<Vec<f64>> {
    let mut model = model.clone();
    model.inputs.push(Input::made(Enters::Load));
    let mut inputs = signals.inputs.clone();
    inputs.push(vec![load; signals.len()]);
    let trace = quiet_run(&model, &Signals { inputs, ..signals.clone() })?;
    let is_open = !model.has_law();
    let (measured, simulated) = if is_open { (&signals.y, &trace.y) } else { (&signals.u, &trace.u) };
    let each = measured.iter().zip(simulated);
    Some(each.map(|(a, b)| if a.is_finite() { a - b } else { 0.0 }).collect())
}

fn is_play(named: &Named) -> bool {
    named.term.plays()
}

/// Rounding is seen without any prediction.
fn is_rounding(named: &Named) -> bool {
    matches!(named.term.kind.search, Starts::Apart) && named.term.kind.place == Place::Sensor
}

/// Noise and rounding change no prediction. Noise that shrinks is none: what a model lacks had been taken for noise before.
fn is_noise(named: &Named) -> bool {
    let grows = named.term.parameters.first().is_some_and(|ratio| *ratio > 1.0);
    (named.is_noise_change() && grows) || is_rounding(named)
}
