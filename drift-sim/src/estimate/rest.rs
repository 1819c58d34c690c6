//! The filter of a mass that dry friction holds. While it rests nothing that is measured moves it, and nothing tells the load on it: the gains of the moving mass
//! would let a random load carry it about, and the noise's numbers would bend to that. From its first rest on the covariance of position, speed, load and
//! sensor noise is carried along sample by sample, until the mass has moved for long enough. A load that is not known may tear it off before the filter's own does:
//! what is beyond the friction of the normal distribution that the load is known to moves it as well, its mean apart.

// Loops over the indices of small square matrices, two of them at a time: clearer than iterators over rows.
#![allow(clippy::needless_range_loop)]

use super::innovations::SETTLING;
use super::lanes::Side;
use super::side_by_side::Gains;

/// Position and speed, in this order.
const STATES: usize = 2;
const SPEED: usize = 1;
/// The place of the load behind them.
pub const LOAD: usize = 2;
/// The place of the sensor's noise.
pub const SENSOR: usize = 3;
const ALL: usize = 4;

/// A symmetric matrix over position, speed, load and sensor noise: what is on the diagonal and left of it.
#[derive(Debug, Clone, Copy)]
pub struct Covariance<T>([[T; ALL]; ALL]);

impl<T: Copy> Covariance<T> {
    /// From its entries; those right of the diagonal are not asked for.
    pub fn from_fn(of: impl Fn(usize, usize) -> T) -> Self {
        Self(std::array::from_fn(|i| std::array::from_fn(|j| of(i.max(j), i.min(j)))))
    }

    #[inline(always)]
    fn at(&self, i: usize, j: usize) -> T {
        self.0[i.max(j)][i.min(j)]
    }
}

/// What the gains follow from: the mass as it moves, and the noise.
#[derive(Debug, Clone, Copy)]
pub struct Law<T> {
    /// What position and speed become of position and speed over a sample.
    pub f: [[T; STATES]; STATES],
    /// What a load takes from them.
    pub g: [T; STATES],
    /// How y is made of them.
    pub c: [T; STATES],
    /// The factor on the sensor's noise.
    pub growth: T,
    /// What stays of load and sensor noise from one sample to the next.
    pub stays: [T; 2],
    /// Variances that they gain.
    pub drive: [T; 2],
    /// Variance of the sensor's white noise.
    pub white: T,
    /// The sample at which the load jumps, and the variance of that.
    pub jump: (T, T),
    /// The covariance before a measurement where the mass has long been moving.
    pub settled: Covariance<T>,
}

impl<T: Side> Law<T> {
    /// That of each lane.
    pub fn of<'a>(each: impl Fn(usize) -> &'a Law<f64>) -> Self {
        let number = |of: &dyn Fn(&Law<f64>) -> f64| T::of(|lane| of(each(lane)));
        Self {
            f: std::array::from_fn(|i| std::array::from_fn(|j| number(&|law| law.f[i][j]))),
            g: std::array::from_fn(|i| number(&|law| law.g[i])),
            c: std::array::from_fn(|i| number(&|law| law.c[i])),
            growth: number(&|law| law.growth),
            stays: std::array::from_fn(|i| number(&|law| law.stays[i])),
            drive: std::array::from_fn(|i| number(&|law| law.drive[i])),
            white: number(&|law| law.white),
            jump: (number(&|law| law.jump.0), number(&|law| law.jump.1)),
            settled: Covariance::from_fn(|i, j| number(&|law| law.settled.at(i, j))),
        }
    }

    /// The covariance a sample later: of a mass that moved, and of one that rested for what is known of the load, `lacks` being what more it takes to move it.
    #[inline(always)]
    fn moved(&self, p: &Covariance<T>, (rested, lacks): (T::Mask, T)) -> Covariance<T> {
        let [load_stays, sensor_stays] = self.stays;
        let (one, load) = (T::all(1.0), p.at(LOAD, LOAD));
        let or_one = |resting: T| T::choose(rested, resting, one);
        // Nothing is asked of the load's tails where no mass has rested.
        let lacks = T::choose(rested, lacks, T::all(f64::INFINITY));
        // A speed stays that friction does not end within the sample, and of one that the load made what the load goes on with.
        let fast = beyond(self.g[SPEED] * lacks, p.at(SPEED, SPEED), PROBABILITY);
        let goes_on = T::choose(is_near(lacks, load), T::all(GOES_ON), T::all(0.0));
        let keeps = or_one(goes_on + (one - goes_on) * fast);
        // What is beyond the friction, as a part of the load and a rest that does not go with it.
        let torn = or_one(T::all(0.5) * beyond(lacks, load, PROBABILITY));
        let square = or_one(T::all(0.5) * beyond(lacks, load, SQUARE));
        let more = (square - torn * torn) * load;
        // What position and speed make of a column, the load's part in it.
        let over = |column: [T; STATES], load: T| -> [T; STATES] {
            let moving = keeps * column[1];
            std::array::from_fn(|i| {
                self.f[i][0] * column[0] + self.f[i][1] * moving - torn * self.g[i] * load
            })
        };
        let column = |j: usize| over([p.at(0, j), p.at(1, j)], p.at(LOAD, j));
        let (of_position, of_speed, of_load, of_sensor) =
            (column(0), column(1), column(LOAD), column(SENSOR));
        let between = |i: usize| over([of_position[i], of_speed[i]], of_load[i]);
        let states = [between(0), between(1)];
        let mut next = *p;
        for i in 0..STATES {
            for j in 0..=i {
                next.0[i][j] = states[j][i] + self.g[i] * self.g[j] * more;
            }
        }
        for (noise, of, stays) in [(LOAD, of_load, load_stays), (SENSOR, of_sensor, sensor_stays)] {
            next.0[noise][0] = stays * of[0];
            next.0[noise][SPEED] = stays * of[SPEED];
        }
        next.0[LOAD][LOAD] = load_stays * load_stays * p.at(LOAD, LOAD) + self.drive[0];
        next.0[SENSOR][LOAD] = load_stays * sensor_stays * p.at(SENSOR, LOAD);
        next.0[SENSOR][SENSOR] = sensor_stays * sensor_stays * p.at(SENSOR, SENSOR) + self.drive[1];
        next
    }

    /// By how much the load is known less from a sample on, because it may have jumped.
    #[inline(always)]
    fn jump_at(&self, sample: usize) -> T {
        T::choose(T::all(sample as f64).is_same(self.jump.0), self.jump.1, T::all(0.0))
    }

    /// What of each state a measurement shows, and the innovation's variance.
    #[inline(always)]
    fn shown(&self, p: &Covariance<T>) -> ([T; ALL], T) {
        let of =
            |i: usize| self.c[0] * p.at(i, 0) + self.c[1] * p.at(i, SPEED) + self.growth * p.at(i, SENSOR);
        let shown = [of(0), of(SPEED), of(LOAD), of(SENSOR)];
        let variance = self.c[0] * shown[0] + self.c[1] * shown[SPEED] + self.growth * shown[SENSOR];
        (shown, variance + self.white)
    }
}

/// Deviations beyond which nothing is torn off.
const NEVER: f64 = 4.0;

/// What of a speed that a load made goes on: a load that stays half a second holds on to it, one of a few samples does not. None, half and all of it were tried on 19 loops
/// of an independent simulator; half is the likeliest.
const GOES_ON: f64 = 0.5;

/// Slopes with which [`beyond`] is within a fifth of the probability that a normal number is beyond a bound, and of the mean square of what is beyond, up to two
/// deviations.
const PROBABILITY: f64 = 0.65;
const SQUARE: f64 = 1.3;

/// Whether a normal number of this variance may be beyond a bound.
#[inline(always)]
fn is_near<T: Side>(bound: T, variance: T) -> T::Mask {
    (bound * bound).is_less(T::all(NEVER * NEVER) * variance)
}

/// What of a normal number of this variance is beyond a bound, over what is beyond nothing.
#[inline(always)]
fn beyond<T: Side>(bound: T, variance: T, slope: f64) -> T {
    let zero = T::all(0.0);
    let is_near = is_near(bound, variance);
    if !T::holds_anywhere(is_near) {
        return zero;
    }
    let k = T::choose(bound.is_less(zero), zero, bound) / variance.sqrt();
    T::choose(is_near, (T::all(-0.5) * k * k - T::all(slope) * k).exp(), zero)
}

/// Innovation at rest, in deviations of those that came before, from which on a mass does not rest, whatever the model says.
const SLIPS: f64 = 5.0;
/// Samples at rest over which that deviation is taken.
const REMEMBERED: f64 = 500.0;
/// Samples after which a mass moves as if it never had been at rest.
const LONG: f64 = 150.0;

/// The covariance of masses that rest, or have rested not long ago.
#[derive(Debug, Clone, Copy)]
pub struct Rest<T> {
    /// After the measurement of the sample before; none while all masses have moved for long.
    covariance: Option<Covariance<T>>,
    /// Samples since a mass rested.
    moves_for: T,
    /// Mean square of what the filter missed at rest, in the square of what it expects to miss, over so many samples.
    missed: T,
    samples: T,
    per_unit: T,
}

impl<T: Side> Rest<T> {
    /// Masses that have always been moving; with one over the unit of the sensor's noise.
    pub fn new(per_unit: T) -> Self {
        let (missed, zero) = (T::all(1.0), T::all(0.0));
        Self { covariance: None, moves_for: T::all(LONG), missed, samples: zero, per_unit }
    }

    /// Gains of a sample over the sample before which masses rested or moved, `moving` being those of masses that have long been moving; `lacks` is the force that
    /// would have moved those that rested, and `e` the innovation. `None` where all have.
    #[inline]
    pub fn gains(
        &mut self,
        law: &Law<T>,
        sample: usize,
        (rested, lacks): (T::Mask, T),
        moving: &Gains<T, STATES>,
        e: T,
    ) -> Option<Gains<T, STATES>> {
        if sample < SETTLING || (self.covariance.is_none() && !T::holds_anywhere(rested)) {
            return None;
        }
        let (zero, one) = (T::all(0.0), T::all(1.0));
        self.moves_for = T::choose(rested, zero, self.moves_for + one);
        let before = self.covariance.unwrap_or_else(|| {
            let (shown, variance) = law.shown(&law.settled);
            law.settled.measured(&shown, T::all(1.0) / variance)
        });
        let is_long = T::all(LONG - 0.5).is_less(self.moves_for);
        let mut p = law.moved(&before, (rested, lacks * self.per_unit)).or(is_long, &law.settled);
        p.0[LOAD][LOAD] = p.at(LOAD, LOAD) + law.jump_at(sample);
        let (mut shown, mut variance) = law.shown(&p);
        let scaled = e * self.per_unit;
        let square = scaled * scaled / variance;
        let most = T::all(SLIPS * SLIPS) * self.missed;
        let slips = most.is_less(T::choose(rested, square, zero));
        self.remember(rested, square, most);
        if T::holds_anywhere(slips) {
            p = p.or(slips, &law.settled);
            (shown, variance) = law.shown(&p);
        }
        let is_any_not = T::holds_anywhere(self.moves_for.is_less(T::all(LONG)));
        let per_variance = one / variance;
        self.covariance = is_any_not.then(|| p.measured(&shown, per_variance));
        let or = |own: T, moving: T| T::choose(is_long, moving, own);
        Some(Gains {
            states: std::array::from_fn(|i| or(shown[i] * per_variance, moving.states[i])),
            shown: moving.shown,
            load: or(shown[LOAD] * per_variance, moving.load),
            sensor: or(shown[SENSOR] * per_variance, moving.sensor),
            per_deviation: or(self.per_unit / variance.sqrt(), moving.per_deviation),
            log_variance: or(variance.ln(), moving.log_variance),
        })
    }

    /// How large the sensor's noise is shows on the way.
    #[inline(always)]
    fn remember(&mut self, rested: T::Mask, square: T, most: T) {
        let (zero, one, all) = (T::all(0.0), T::all(1.0), T::all(REMEMBERED));
        let more = T::choose(rested, self.samples + one, self.samples);
        self.samples = T::choose(more.is_less(all), more, all);
        let square = T::choose(square.is_less(most), square, most);
        let by = (square - self.missed) / T::choose(self.samples.is_less(one), one, self.samples);
        self.missed = self.missed + T::choose(rested, by, zero);
    }
}

impl<T: Side> Covariance<T> {
    /// The same after a measurement.
    #[inline(always)]
    fn measured(&self, shown: &[T; ALL], per_variance: T) -> Self {
        let gains = shown.map(|shown| shown * per_variance);
        Self::from_fn(|i, j| self.at(i, j) - gains[i] * shown[j])
    }

    /// This one, or another where a mask holds.
    #[inline(always)]
    fn or(self, mask: T::Mask, other: &Self) -> Self {
        Self::from_fn(|i, j| T::choose(mask, other.at(i, j), self.at(i, j)))
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    use crate::control_loop::Loop;
    use crate::estimate::hypothesis::{Hypothesis, Target};
    use crate::estimate::likelihood::{Cache, Data, runs};
    use crate::estimate::measure;
    use crate::estimate::noise::WHITE;
    use crate::estimate::noise::sequence;
    use crate::estimate::signals::Signals;
    use crate::likelihood_search::options::Options;

    const SAMPLES: usize = 3_000;
    const STAYS: f64 = 0.8;

    /// Innovations, over what the filter expects of them, and the logarithms of their variances: of a mass that dry friction of 5 N holds, given the deviation of the sensor's
    /// noise and what stays of it from sample to sample, and the load's deviation in N, told that of the drive, and its time constant in seconds.
    fn run_of(
        output: &str,
        signals: Signals,
        (noise, stays): (f64, f64),
        load: impl Fn(f64) -> (f64, f64),
    ) -> (Vec<f64>, Vec<f64>) {
        let text = format!(
            "[loop]\nsample_time_s = 0.01\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"servo\"\noutput = \"{output}\"\n\
             inertia = 0.3\nviscous = 0.8\nactuator_gain = 1.0\n[[physics]]\nkind = \"coulomb_friction\"\nlevel = 5.0\n"
        );
        let model = Loop::parse(&text, "a loop").unwrap();
        let scales = measure::scales(&model, std::slice::from_ref(&signals));
        let hypothesis = Hypothesis::nominal(&model, &scales, &Options::default().priors);
        let data = Data::new(&hypothesis, vec![signals], vec![SAMPLES]);
        let mut point = hypothesis.own_point();
        let mut put = |target, value: f64| {
            let place = hypothesis.place(target).unwrap();
            point.x[place] = hypothesis.free[place].x_of(value);
        };
        let (size, tau_s) = load(scales.drive);
        put(Target::SensorRho, libm::atanh(stays));
        // The load's deviation counts in the sensor noise that was measured.
        put(Target::LoadSize, libm::log(size / scales.drive * scales.noise / noise));
        put(Target::LoadTau, libm::log(tau_s));
        let mut found = runs(&hypothesis, &point, &data, &mut Cache::default(), SAMPLES, true).unwrap();
        let run = found.remove(0);
        (run.scaled.iter().map(|e| e * scales.noise / noise).collect(), run.log_scales)
    }

    /// The mass at rest where a sensor's noise is all that y shows, u reaches 1 N and the load is taken to be as random as u.
    fn at_rest(output: &str) -> (Vec<f64>, Vec<f64>) {
        let level = if output == "position" { 2.0 } else { 0.0 };
        let noise = sequence(SAMPLES, 1e-3, STAYS, &mut ChaCha8Rng::seed_from_u64(7));
        let y: Vec<f64> = noise.iter().map(|noise| level + noise).collect();
        let u = (0..SAMPLES).map(|n| libm::sin(n as f64 * 0.7)).collect();
        let signals = Signals { sample_time_s: 0.01, r: y.clone(), y, u, ..Signals::default() };
        run_of(output, signals, (1e-3, STAYS), |drive| (drive, 1.0))
    }

    /// Samples of a mass under a force of 4.2 N that dry friction of 5 N holds, and that a random load of 0.8 N tears off now and then, by small
    /// steps of Euler's; the force pulls it back from a millimetre off.
    fn torn_off() -> Signals {
        const STEPS: usize = 20;
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let loads = sequence(SAMPLES, 0.8, libm::exp(-0.01 / 0.2), &mut rng);
        let noise = sequence(SAMPLES, 1e-5, 0.0, &mut rng);
        let (mut x, mut v, mut u) = (0.0_f64, 0.0_f64, 4.2_f64);
        let mut signals = Signals { sample_time_s: 0.01, ..Signals::default() };
        for (load, noise) in loads.into_iter().zip(noise) {
            if x.abs() > 1e-3 {
                u = -4.2 * x.signum();
            }
            signals.y.push(x + noise);
            signals.u.push(u);
            for _ in 0..STEPS {
                let h = 0.01 / STEPS as f64;
                let pushed = v + h / 0.3 * (u - load);
                v = pushed.signum() * (pushed.abs() - h / 0.3 * 5.0).max(0.0) / (1.0 + h * 0.8 / 0.3);
                x += h * v;
            }
        }
        signals.r.clone_from(&signals.y);
        signals
    }

    /// Another simulation of the same loop: at its own numbers the filter misses by as much as it expects to, where the load tears the mass off as well. A filter that
    /// takes a mass at rest for one that surely rests misses 2.9 times the square of that, and nine deviations at the most.
    #[test]
    fn what_the_load_tears_off_is_expected() {
        let signals = torn_off();
        let moves = signals.y.windows(2).filter(|pair| (pair[1] - pair[0]).abs() > 1e-4).count();
        assert!((100..SAMPLES / 4).contains(&moves), "{moves}");
        let (scaled, logs) = run_of("position", signals, (1e-5, 0.0), |_| (0.8, 0.2));
        let mean = scaled.iter().zip(&logs).map(|(e, _)| e * e).sum::<f64>() / scaled.len() as f64;
        let most = scaled.iter().fold(0.0, |most: f64, e| most.max(e.abs()));
        assert!((0.5..1.5).contains(&mean) && most < 6.0, "{mean} {most}");
    }

    /// Closed form: at rest y is a constant under colored noise, whose part that is new has the variance 1 - rho^2 of it.
    #[test]
    fn at_rest_what_is_missed_is_what_the_sensors_noise_gains() {
        for output in ["position", "speed"] {
            let (scaled, logs) = at_rest(output);
            let late = 500..SAMPLES;
            let expected = libm::log(1.0 - STAYS * STAYS + WHITE);
            for log in &logs[late.clone()] {
                assert!((log - expected).abs() < 0.02, "{output}: {log} {expected}");
            }
            let square = scaled[late.clone()].iter().map(|e| e * e).sum::<f64>() / late.len() as f64;
            // Four standard errors of a mean square of 2 500.
            assert!((square - 1.0).abs() < 4.0 * libm::sqrt(2.0 / 2_500.0), "{output}: {square}");
        }
    }
}
