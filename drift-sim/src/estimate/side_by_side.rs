//! Filters that run side by side over one recording: their loops, what is given to all of them, and the innovations as they come. What moves their plants is
//! [`filter_batch`](super::filter_batch)'s and [`filter_servo`](super::filter_servo)'s.

use std::ops::Range;

use crate::simulate::Simulation;

use super::gains::Stretch;
use super::innovations::{Filter, Innovations};
use super::lanes::{LANES, Side};

/// A filter with its loop, started.
pub struct Lane<'a> {
    /// The filter.
    pub filter: &'a Filter<'a>,
    /// Its loop.
    pub simulation: Simulation,
}

/// The filter's gains of a sample, for each of N states.
#[derive(Clone, Copy)]
pub struct Gains<T, const N: usize> {
    /// Of the states.
    pub states: [T; N],
    /// Of what a slow sensor shows, where it is followed.
    pub shown: T,
    /// Of the load.
    pub load: T,
    /// Of the sensor's noise.
    pub sensor: T,
    /// One over the innovation's deviation, in the filter's unit, and the logarithm of its variance.
    pub per_deviation: T,
    /// The logarithm of its variance.
    pub log_variance: T,
}

/// The filters of a run. Lanes that are not there do as the first.
pub struct Lanes<'a>(pub Vec<Lane<'a>>);

impl<'a> Lanes<'a> {
    /// A number of each.
    #[inline(always)]
    pub fn each<T: Side>(&self, of: impl Fn(&Lane<'a>) -> f64) -> T {
        T::of(|lane| self.0.get(lane).or(self.0.first()).map_or(0.0, &of))
    }

    /// Whether something is true of any.
    pub fn any(&self, is: impl Fn(&Lane<'a>) -> bool) -> bool {
        self.0.iter().any(is)
    }

    /// What the sensors and their terms show of y, inputs being added in between.
    #[inline(always)]
    pub fn shown<T: Side>(&mut self, sample: usize, y: T, inputs: T) -> T {
        let mut shown = [0.0; LANES];
        for (lane, (slot, own)) in shown.iter_mut().zip(&mut self.0).enumerate() {
            let y = own.simulation.sensed(sample, y.lane(lane));
            *slot = own.simulation.shown(sample, y + inputs.lane(lane));
        }
        T::of(|lane| shown[lane])
    }

    /// Tells the sensors by how much y was corrected, and what they show where that is followed.
    #[inline(always)]
    pub fn corrected<T: Side>(&mut self, y_by: T, shown_by: T) {
        for (lane, own) in self.0.iter_mut().enumerate() {
            let is_followed = own.filter.gains.first().is_some_and(Stretch::follows_shown);
            let shown_by = is_followed.then(|| shown_by.lane(lane));
            own.simulation.corrected(y_by.lane(lane), shown_by);
        }
    }

    /// Samples cut where a plant, gains or anything else that is given changes.
    pub fn cut(&self, others: impl Iterator<Item = usize>, samples: usize) -> Vec<Range<usize>> {
        let mut bounds: Vec<usize> = others.chain([0, samples]).collect();
        for lane in &self.0 {
            bounds.extend(lane.simulation.changes_at());
            bounds.extend(lane.filter.gains.iter().map(|stretch| stretch.from));
        }
        bounds.retain(|bound| *bound <= samples);
        bounds.sort_unstable();
        bounds.dedup();
        bounds.iter().zip(bounds.get(1..).unwrap_or(&[])).map(|(from, to)| *from..*to).collect()
    }

    /// The gains of each lane over such a part, and ranges of it under the same gains: sample by sample until they have settled.
    pub fn under_gains(
        &self,
        samples: Range<usize>,
    ) -> Option<(Vec<&'a Stretch>, impl Iterator<Item = Range<usize>> + use<>)> {
        let begun = |lane: &Lane<'a>| lane.filter.gains.iter().rev().find(|s| s.from <= samples.start);
        let stretches: Vec<&Stretch> = self.0.iter().map(begun).collect::<Option<_>>()?;
        let settled = stretches.iter().map(|stretch| stretch.settled_from()).max()?;
        let settled = settled.clamp(samples.start, samples.end);
        let rest = (settled < samples.end).then_some(settled..samples.end);
        let ranges = (samples.start..settled).map(|sample| sample..sample + 1).chain(rest);
        Some((stretches, ranges))
    }

    /// The gains of a sample.
    pub fn gains<T: Side, const N: usize>(
        &self,
        stretches: &[&Stretch],
        sample: usize,
    ) -> Option<Gains<T, N>> {
        let first = stretches.first()?;
        let at = |lane: usize| stretches.get(lane).unwrap_or(first).at(sample);
        let skipped = |lane: usize| self.0.get(lane).map_or(0, |lane| lane.filter.first_state);
        let own = |i: usize| {
            T::of(|lane| {
                let place = i.checked_sub(skipped(lane));
                place.and_then(|i| at(lane).states.get(i).copied()).unwrap_or(0.0)
            })
        };
        Some(Gains {
            states: std::array::from_fn(own),
            shown: T::of(|lane| at(lane).shown.unwrap_or(0.0)),
            load: T::of(|lane| at(lane).load),
            sensor: T::of(|lane| at(lane).sensor),
            per_deviation: self.each::<T>(|lane| 1.0 / lane.filter.unit) * T::of(|lane| at(lane).scales.0),
            log_variance: T::of(|lane| at(lane).scales.1),
        })
    }
}

/// The innovations of lanes as they come.
pub struct Gone<T> {
    counts_from: usize,
    log_variances: T,
    count: usize,
    scaled: Vec<Vec<f64>>,
}

impl<T: Side> Gone<T> {
    /// Nothing yet, of so many lanes and samples, of which those from one on count.
    pub fn new(lanes: usize, samples: usize, counts_from: usize) -> Self {
        let scaled = (0..lanes).map(|_| vec![0.0; samples]).collect();
        Self { counts_from, log_variances: T::all(0.0), count: 0, scaled }
    }

    /// The innovations of a sample in which y was measured, over their deviations, and the logarithms of their variances.
    #[inline(always)]
    pub fn innovation(&mut self, sample: usize, scaled: T, log_variance: T) {
        if sample < self.counts_from {
            return;
        }
        self.log_variances = self.log_variances + log_variance;
        self.count += 1;
        for (lane, kept) in self.scaled.iter_mut().enumerate() {
            if let Some(slot) = kept.get_mut(sample) {
                *slot = scaled.lane(lane);
            }
        }
    }

    /// The same of samples from one on under the same gains, y with them: what was not measured has none.
    #[inline(always)]
    pub fn innovations<const N: usize>(
        &mut self,
        (first, measured): (usize, &[f64]),
        innovations: &[T],
        gains: &Gains<T, N>,
    ) {
        let skipped = self.counts_from.saturating_sub(first).min(measured.len());
        let counted = measured.get(skipped..).unwrap_or(&[]);
        let innovations = innovations.get(skipped..).unwrap_or(&[]);
        let known = counted.iter().filter(|y| y.is_finite()).count();
        self.log_variances = self.log_variances + T::all(known as f64) * gains.log_variance;
        self.count += known;
        for (lane, kept) in self.scaled.iter_mut().enumerate() {
            let slots = kept.get_mut(first + skipped..).unwrap_or(&mut []);
            let per_deviation = gains.per_deviation.lane(lane);
            for ((slot, e), y) in slots.iter_mut().zip(innovations).zip(counted) {
                if y.is_finite() {
                    *slot = e.lane(lane) * per_deviation;
                }
            }
        }
    }

    /// Those of each lane; a diverging run stays diverged: the last sample tells.
    pub fn found(self) -> Vec<Option<Innovations>> {
        let (log_variances, count) = (self.log_variances, self.count);
        let innovations = |(lane, scaled): (usize, Vec<f64>)| {
            scaled.last().is_some_and(|e| e.is_finite()).then(|| Innovations {
                scaled,
                log_variances: log_variances.lane(lane),
                count,
                ..Innovations::default()
            })
        };
        self.scaled.into_iter().enumerate().map(innovations).collect()
    }
}
