//! Whether what was found simulates what it has not seen: the closed loop from r alone; under an unknown law the plant from u alone. A likelihood of
//! single steps may be high on a plant that is none. How far a simulation may miss follows from the noise that the fit itself found: a loop at rest,
//! or one that cycles, is where its noise has led it.

use std::cell::LazyCell;

use crate::control_loop::Loop;
use crate::diagnose::prove::FitPct;
use crate::diagnose::{Diagnosis, Named, Verdict};
use crate::estimate::fit::Fit;
use crate::estimate::likelihood::Data;
use crate::estimate::signals::Signals;
use crate::physics::{Place, Starts};

use super::decide::has_onset;
use super::drawn::Missed;
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
pub(super) const MOST_WORSE: f64 = 1.25;
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
/// What begins on a guessed plant gains where no simulation is asked for. Of 80 loops at rest of which nothing is known (`tests/cases/run 9401`, `.ci/wide 715`) none had a first name that begins, gained as
/// much and was wrong.
const BEYOND_DOUBT: f64 = 1000.0;
/// Jumps that are more than one fault: a pulse has two, and the second pulse begins with the third.
const EDGES: usize = 3;
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
        self.found.physics.iter().filter(|named| named.is_offset()).count() >= EDGES
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
    pub(super) fn is_closed(&self) -> bool {
        self.found.improved.has_law()
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
