//! A recording as the diagnosis uses it: r, y, u and the loop's measured inputs, in the loop's sample time.

use std::ops::Range;

use crate::control_loop::Loop;
use crate::recording::{Recording, RowState};
use crate::{Error, Result};

/// The fewest samples from which anything is concluded.
pub const LEAST_SAMPLES: usize = 100;

/// How much larger the mean square of second differences is over two samples than over one, of a y whose bends its noise does not hide: white noise 1, a random walk 2, a
/// bend 16.
const BENDS: f64 = 3.0;

/// From the first to the last sample at which the loop was closed.
fn closed(recording: &Recording) -> Range<usize> {
    let is_closed = |state: &RowState| *state != RowState::Manual;
    let first = recording.state.iter().position(is_closed);
    let last = recording.state.iter().rposition(is_closed);
    first.zip(last).map_or(0..recording.len(), |(first, last)| first..last + 1)
}

/// r, y, u and the measured inputs, from the first to the last sample at which the loop was closed. y is NaN where it is missing, the
/// loop was open between, or an archive has drawn it; r, u and inputs hold their last value there.
#[derive(Debug, Clone, Default)]
pub struct Signals {
    /// Seconds per sample.
    pub sample_time_s: f64,
    /// Time of the first sample in the recording's own time.
    pub start_s: f64,
    /// Time between the sample that onsets count from and the first one here: not 0 in a part of a recording.
    pub origin_s: f64,
    /// Reference.
    pub r: Vec<f64>,
    /// Measured output.
    pub y: Vec<f64>,
    /// The controller's output as recorded.
    pub u: Vec<f64>,
    /// Measured inputs, in the loop's order.
    pub inputs: Vec<Vec<f64>>,
}

impl Signals {
    /// Takes what the loop needs from a recording.
    ///
    /// # Errors
    /// Another sample time than the loop's (beyond 2 %), a column that is missing, too few samples, or a y or u that
    /// never changes.
    pub fn new(recording: &Recording, model: &Loop) -> Result<Self> {
        model.check_sample_time(recording.sample_time_s).map_err(|e| e.in_file(&recording.name))?;
        let closed = closed(recording);
        let part = |x: &[f64]| held(x.get(closed.clone()).unwrap_or(&[]));
        let inputs = model.inputs.iter().map(|input| input.values(recording).map(|values| part(&values)));
        let drawn = recording.interpolated_y().unwrap_or_default();
        let is_drawn = |i: usize| drawn.get(i).copied().unwrap_or(false);
        let known = |i: usize| recording.state.get(i) != Some(&RowState::Manual) && !is_drawn(i);
        let y = recording.y.iter().enumerate().map(|(i, y)| if known(i) { *y } else { f64::NAN });
        let signals = Self {
            sample_time_s: model.sample_time_s,
            start_s: recording.time_s(closed.start),
            origin_s: 0.0,
            r: part(&recording.r),
            y: y.skip(closed.start).take(closed.len()).collect(),
            u: part(&recording.u),
            inputs: inputs.collect::<Result<_>>().map_err(|e| e.in_file(&recording.name))?,
        };
        signals.check().map_err(|e| e.in_file(&recording.name))?;
        Ok(signals)
    }

    fn check(&self) -> Result<()> {
        let known = self.y.iter().filter(|y| y.is_finite()).count();
        if known < LEAST_SAMPLES {
            return Err(Error::new(format!("only {known} samples of y"))
                .allowed(format!("at least {LEAST_SAMPLES} for a diagnosis")));
        }
        for (name, column) in [("y", &self.y), ("u", &self.u)] {
            if deviation(column) == 0.0 {
                return Err(Error::new(format!("{name} never changes"))
                    .allowed("a recording in which the loop moves"));
            }
        }
        Ok(())
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.y.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.y.is_empty()
    }

    /// Length in seconds.
    pub fn duration_s(&self) -> f64 {
        self.len() as f64 * self.sample_time_s
    }

    /// The samples from `from` up to `to`, with the time that they have in the recording.
    #[must_use]
    pub fn part(&self, from: usize, to: usize) -> Self {
        let cut = |column: &Vec<f64>| column.get(from..to.min(column.len())).unwrap_or(&[]).to_vec();
        Self {
            sample_time_s: self.sample_time_s,
            start_s: self.start_s + from as f64 * self.sample_time_s,
            origin_s: self.origin_s + from as f64 * self.sample_time_s,
            r: cut(&self.r),
            y: cut(&self.y),
            u: cut(&self.u),
            inputs: self.inputs.iter().map(cut).collect(),
        }
    }

    /// The stretch of so many samples in which u moves most, of those that begin a quarter of one apart: the first ones may show u at rest, or on one side of a gap alone.
    pub fn liveliest(&self, most: usize) -> Range<usize> {
        let until = |from: usize| self.len().min(from.saturating_add(most));
        let moves = |from: usize| deviation(self.u.get(from..until(from)).unwrap_or(&[]));
        let latest = self.len().saturating_sub(most);
        let stretches = (0..=latest).step_by((most / 4).max(1)).map(|from| (from, moves(from)));
        let (from, _) = stretches.reduce(|a, b| if b.1 > a.1 { b } else { a }).unwrap_or_default();
        from..until(from)
    }

    /// One sample in `factor`: r as it is there; u and the inputs as they are in the mean until the next; y as it is there, or, where noise hides how it
    /// bends, in the mean of the samples about it.
    pub fn coarser(&self, factor: usize) -> Self {
        let factor = factor.max(1);
        let y = if self.is_noisy() {
            let each = (0..self.len()).step_by(factor);
            each.map(|i| {
                let about = (factor / 2).min(i);
                let known = self.y.get(i - about..(i + about + 1).min(self.len())).unwrap_or(&[]);
                let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
                if mean.is_finite() { mean } else { self.y.get(i).copied().unwrap_or(f64::NAN) }
            })
            .collect()
        } else {
            self.y.iter().step_by(factor).copied().collect()
        };
        let taken = |column: &Vec<f64>| column.iter().step_by(factor).copied().collect();
        let mean = |column: &Vec<f64>| {
            column.chunks(factor).map(|held| held.iter().sum::<f64>() / held.len() as f64).collect()
        };
        Self {
            sample_time_s: factor as f64 * self.sample_time_s,
            start_s: self.start_s,
            origin_s: self.origin_s,
            r: taken(&self.r),
            y,
            u: mean(&self.u),
            inputs: self.inputs.iter().map(mean).collect(),
        }
    }

    /// Whether noise hides how y bends from sample to sample: then its second differences over two samples are no larger by far than over one.
    fn is_noisy(&self) -> bool {
        let bent = |by: usize| {
            let farther = self.y.iter().skip(by).zip(self.y.iter().skip(2 * by));
            let bends = self.y.iter().zip(farther).map(|(a, (b, c))| a - 2.0 * b + c);
            let (sum, count) = bends
                .filter(|bend| bend.is_finite())
                .fold((0.0, 0.0_f64), |(sum, count), bend| (sum + bend * bend, count + 1.0));
            sum / count.max(1.0)
        };
        bent(2) < BENDS * bent(1)
    }

    /// Writes the inputs of sample `n` into `now`.
    #[inline]
    pub fn inputs_at(&self, n: usize, now: &mut [f64]) {
        for (value, column) in now.iter_mut().zip(&self.inputs) {
            *value = column.get(n).copied().unwrap_or(0.0);
        }
    }
}

/// Whether each measured input whose gain is to be found changes in some recording.
///
/// # Errors
/// One never does.
pub fn check_open_inputs<'a>(nominal: &Loop, of: impl Iterator<Item = &'a Signals> + Clone) -> Result<()> {
    let changes = |i: usize| {
        let mut values = of.clone().filter_map(|signals| signals.inputs.get(i)).flatten();
        values.next().is_some_and(|first| values.any(|value| value != first))
    };
    let still = nominal.inputs.iter().enumerate().find(|(i, input)| input.gain.is_open() && !changes(*i));
    still.map_or(Ok(()), |(_, input)| {
        let what = format!(
            "the measured input '{}' never changes, so that its gain can't be identified",
            input.name()
        );
        Err(Error::new(what).allowed("a number as its gain, or recordings in which it changes"))
    })
}

/// The least and the greatest value; infinite the wrong way round of nothing.
pub fn range(x: &[f64]) -> (f64, f64) {
    x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)))
}

/// The column with its last value wherever one is missing; the first one at the beginning.
pub fn held(column: &[f64]) -> Vec<f64> {
    let mut last = column.iter().copied().find(|x| x.is_finite()).unwrap_or(0.0);
    column
        .iter()
        .map(|x| {
            if x.is_finite() {
                last = *x;
            }
            last
        })
        .collect()
}

/// A column less its mean.
pub fn centred(mut column: Vec<f64>) -> Vec<f64> {
    let mean = column.iter().sum::<f64>() / column.len().max(1) as f64;
    column.iter_mut().for_each(|x| *x -= mean);
    column
}

/// Mean of squares; 0 of nothing.
pub fn mean_square(x: &[f64]) -> f64 {
    x.iter().map(|v| v * v).sum::<f64>() / x.len().max(1) as f64
}

/// Variance of a signal's noise, from its second differences: what changes from sample to sample faster than a plant can.
pub fn noise_variance(signal: &[f64]) -> f64 {
    let second: Vec<f64> = signal.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]).collect();
    (mean_square(&second) / 6.0).max(1e-30)
}

/// Root mean square; 0 of none.
pub fn rms(values: &[f64]) -> f64 {
    libm::sqrt(mean_square(values))
}

/// Standard deviation of the finite values; 0 for none.
pub fn deviation(column: &[f64]) -> f64 {
    let known = || column.iter().copied().filter(|x| x.is_finite());
    let n = known().count().max(1) as f64;
    let mean = known().sum::<f64>() / n;
    libm::sqrt(known().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n)
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    use super::{Signals, deviation};
    use crate::estimate::noise::sequence;

    fn of(y: Vec<f64>) -> Signals {
        let u = (0..y.len()).map(|n| n as f64).collect();
        Signals { sample_time_s: 0.1, r: y.clone(), y, u, ..Signals::default() }
    }

    /// White noise of deviation 1 is one of 1/sqrt(5) in the mean of five; u is the mean until the next sample. A sample that is missing leaves the one in the middle.
    #[test]
    fn noise_is_averaged_about_each_sample() {
        let mut noisy = of(sequence(50_000, 1.0, 0.0, &mut ChaCha8Rng::seed_from_u64(1)));
        let (middle, missing) = (noisy.y[25], 27);
        noisy.y[missing] = f64::NAN;
        let coarser = noisy.coarser(5);
        assert_eq!((coarser.len(), coarser.sample_time_s), (10_000, 0.5));
        assert!((deviation(&coarser.y) * f64::sqrt(5.0) - 1.0).abs() < 0.02);
        assert_eq!(coarser.y[1], noisy.y[3..8].iter().sum::<f64>() / 5.0);
        assert_eq!(coarser.y[5], middle);
        assert_eq!(coarser.u[..3], [2.0, 7.0, 12.0]);
    }

    /// A wave of 40 samples without noise bends: its mean over five would be too small.
    #[test]
    fn what_bends_is_taken_as_it_is() {
        let wave = of((0..4_000).map(|n| f64::sin(f64::from(n) * 0.157)).collect());
        assert_eq!(wave.coarser(5).y, wave.y.iter().step_by(5).copied().collect::<Vec<_>>());
    }

    #[test]
    fn the_liveliest_stretch_is_where_u_moves() {
        let u: Vec<f64> = (0..1000).map(|k| if k < 600 { 0.0 } else { libm::sin(f64::from(k)) }).collect();
        let signals = Signals { sample_time_s: 1.0, r: u.clone(), y: u.clone(), u, ..Signals::default() };
        assert_eq!(signals.liveliest(400), 600..1000);
        assert_eq!(signals.liveliest(2000), 0..1000);
        assert_eq!(Signals::default().liveliest(10), 0..0);
    }
}
