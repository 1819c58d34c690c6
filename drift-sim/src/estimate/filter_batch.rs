//! The filter over one recording for several points at once, where their plants are linear: what [`Filter::run`] does, in a fraction of the time. A
//! fit asks for a run for each of its numbers; a processor moves four plants on in the time of one, and what reaches them is worked out once.
//!
//! With `h` what the sensor shows of states, load and noise, one sample is `e = y - h z`, `z <- A z + A K e + b`. The next sample's `h z` is worked out
//! as `h A z + h b` before `e` is known, and `h A K e` is added: of all that follows from each other only that product is on the way from one innovation to the next.

// Loops over the indices of small arrays, several of them at a time: clearer than iterators over rows.
#![allow(clippy::needless_range_loop)]

use std::ops::Range;
use std::sync::Arc;

use wide::f64x4;

use crate::simulate::Start;
use crate::simulate::batch::Driven;

use super::driven::Memory;
use super::filter_forced::Middle;
use super::filter_servo;
use super::innovations::{Filter, Innovations, SETTLING, simulation};
use super::lanes::{LANES, Side};
use super::side_by_side::{Gains, Gone, Lane, Lanes};
use super::signals::Signals;

/// Samples that are prepared at a time: few enough to stay near the processor.
const BLOCK: usize = 128;

/// A filter's loop, and where it starts.
pub type Started<'a> = (Filter<'a>, Start);

/// The innovations of each filter over the samples in `counted` and those before; `None` where a loop can't be simulated or diverges.
pub fn run(
    filters: &[Started<'_>],
    signals: &Signals,
    counted: &Range<usize>,
    memory: &Memory,
) -> Vec<Option<Innovations>> {
    filters.chunks(LANES).flat_map(|chunk| side_by_side(chunk, signals, counted, memory)).collect()
}

fn side_by_side(
    filters: &[Started<'_>],
    signals: &Signals,
    counted: &Range<usize>,
    memory: &Memory,
) -> Vec<Option<Innovations>> {
    let lanes = filters
        .iter()
        .map(|(filter, start)| Some(Lane { filter, simulation: simulation(filter.model, start)? }));
    let lanes: Option<Vec<Lane<'_>>> = lanes.collect();
    let alone =
        || filters.iter().map(|(filter, start)| filter.run(signals, start, counted.clone(), false)).collect();
    let Some(lanes) = lanes else { return alone() };
    let order = lanes.first().and_then(|lane| lane.simulation.linear_order());
    if lanes.iter().any(|lane| lane.simulation.linear_order() != order) {
        return alone();
    }
    match order {
        Some(1) => of_order::<1>(lanes, signals, counted, memory),
        Some(2) => of_order::<2>(lanes, signals, counted, memory),
        Some(3) => of_order::<3>(lanes, signals, counted, memory),
        Some(_) => of_order::<4>(lanes, signals, counted, memory),
        None if !lanes.iter().all(|lane| lane.simulation.is_servo()) => alone(),
        None if lanes.len() == 1 => filter_servo::run::<f64>(lanes, signals, counted, memory),
        None => filter_servo::run::<f64x4>(lanes, signals, counted, memory),
    }
}

fn of_order<const N: usize>(
    lanes: Vec<Lane<'_>>,
    signals: &Signals,
    counted: &Range<usize>,
    memory: &Memory,
) -> Vec<Option<Innovations>> {
    if lanes.len() == 1 {
        Run::<f64, N>::finished(lanes, signals, counted, memory)
    } else {
        Run::<f64x4, N>::finished(lanes, signals, counted, memory)
    }
}

/// What moves states, load and sensor noise on while the plant stays the same.
#[derive(Clone, Copy)]
pub(super) struct Moves<T, const N: usize> {
    pub(super) phi: [[T; N]; N],
    /// The drive's values over the sample to the states: the older, the newer, both.
    older: [T; N],
    pub(super) newer: [T; N],
    both: [T; N],
    /// What the sensor shows: y less what it is late by.
    shows: Shows<T, N>,
    /// The same of y alone, and of what it is late by.
    pub(super) y: Shows<T, N>,
    pub(super) late: Shows<T, N>,
    pub(super) of_sensor: T,
    pub(super) phi_load: T,
    pub(super) rho: T,
    /// Where forces are looked at.
    pub(super) middle: Middle<T, N>,
}

/// What is shown of states, load and the drive held until now.
#[derive(Clone, Copy)]
pub(super) struct Shows<T, const N: usize> {
    pub states: [T; N],
    load: T,
    drive: T,
}

impl<T: Side, const N: usize> Shows<T, N> {
    fn of(states: impl Fn(usize, usize) -> f64, drive: impl Fn(usize) -> f64, phi_load: T) -> Self {
        Self {
            states: std::array::from_fn(|i| T::of(|lane| states(lane, i))),
            // The load of the sample before was part of the drive held until now.
            load: T::of(|lane| -drive(lane) / phi_load.lane(lane)),
            drive: T::of(drive),
        }
    }

    /// Of states and the whole drive held until now, the load of the sample before in it.
    #[inline(always)]
    pub fn now(&self, x: &[T; N], held: T) -> T {
        product(&self.states, x) + self.drive * held
    }

    #[inline(always)]
    fn seen(&self, x: &[T; N], load: T, held: T) -> T {
        product(&self.states, x) + (self.load * load + self.drive * held)
    }
}

/// Filters at work on a recording.
pub(super) struct Run<'a, T, const N: usize> {
    pub(super) lanes: Lanes<'a>,
    driven: Vec<Arc<Driven>>,
    /// Whether the same reaches the plants of all lanes, as where the plant's numbers are what they differ in.
    is_driven_alike: bool,
    pub(super) signals: &'a Signals,
    samples: usize,
    pub(super) has_sensor_terms: bool,
    has_forces: bool,
    pub(super) x: [T; N],
    pub(super) load: T,
    pub(super) sensor: T,
    /// The drive held until now, but for the filter's load where nothing depends on the motion.
    pub(super) held: T,
    gone: Gone<T>,
}

/// The drive's older and newer value over each sample of a block, and the innovations there.
pub(super) type Block<'a, T> = (&'a [(T, T); BLOCK], &'a mut [T; BLOCK]);

impl<'a, T: Side, const N: usize> Run<'a, T, N> {
    fn finished(
        lanes: Vec<Lane<'a>>,
        signals: &'a Signals,
        counted: &Range<usize>,
        memory: &Memory,
    ) -> Vec<Option<Innovations>> {
        let count = lanes.len();
        match Self::new(lanes, signals, counted, memory).and_then(Self::over_all) {
            Some(run) => run.gone.found(),
            None => vec![None; count],
        }
    }

    fn new(
        mut lanes: Vec<Lane<'a>>,
        signals: &'a Signals,
        counted: &Range<usize>,
        memory: &Memory,
    ) -> Option<Self> {
        let samples = counted.end.min(signals.len());
        let driven: Vec<Arc<Driven>> =
            lanes.iter_mut().map(|lane| memory.driven(&mut lane.simulation, signals, samples)).collect();
        let is_driven_alike = driven.windows(2).all(|pair| Arc::ptr_eq(&pair[0], &pair[1]));
        let zero = T::all(0.0);
        let mut run = Self {
            driven,
            is_driven_alike,
            signals,
            samples,
            has_sensor_terms: lanes.iter().any(|lane| lane.simulation.has_sensor_terms()),
            has_forces: lanes.iter().any(|lane| lane.simulation.has_forces()),
            x: [zero; N],
            load: zero,
            sensor: zero,
            held: zero,
            gone: Gone::new(lanes.len(), samples, counted.start.max(SETTLING)),
            lanes: Lanes(lanes),
        };
        run.held = run.lanes.each(|lane| lane.simulation.drives().2);
        for i in 0..N {
            run.x[i] = run.lanes.each(|lane| lane.simulation.state().get(i).copied().unwrap_or(0.0));
        }
        Some(run)
    }

    /// Stretch by stretch; the plant and the law of the gains stay as they are in each.
    fn over_all(mut self) -> Option<Self> {
        let begin = self.lanes.0.iter().flat_map(|lane| lane.simulation.forces_begin_at());
        for part in self.lanes.cut(begin, self.samples) {
            self.part(part)?;
        }
        Some(self)
    }

    fn part(&mut self, samples: Range<usize>) -> Option<()> {
        let moves = self.moves(samples.start)?;
        let (stretches, ranges) = self.lanes.under_gains(samples)?;
        let zero = T::all(0.0);
        let (mut drives, mut innovations) = ([(zero, zero); BLOCK], [zero; BLOCK]);
        for range in ranges {
            let gains = self.lanes.gains(&stretches, range.start)?;
            for from in range.clone().step_by(BLOCK) {
                let samples = from..(from + BLOCK).min(range.end);
                self.block(&moves, &gains, &samples, (&mut drives, &mut innovations));
            }
        }
        Some(())
    }

    /// The plants' steps from a sample on.
    fn moves(&self, sample: usize) -> Option<Moves<T, N>> {
        let steps: Vec<_> = self
            .lanes
            .0
            .iter()
            .map(|lane| lane.simulation.linear_step::<N>(sample))
            .collect::<Option<_>>()?;
        let first = steps.first()?;
        let step = |lane: usize| steps.get(lane).unwrap_or(first);
        let late: T = self.lanes.each(|lane| lane.filter.late_s);
        let ts = self.signals.sample_time_s;
        let phi_load: T = self.lanes.each(|lane| lane.filter.noise.load_phi(ts));
        let row = |of: &dyn Fn(usize, usize) -> f64| std::array::from_fn(|i| T::of(|lane| of(lane, i)));
        let rate = |lane: usize, i: usize| late.lane(lane) * step(lane).rate_state[i];
        let rate_drive = |lane: usize| late.lane(lane) * step(lane).rate_drive;
        // Growth changes where gains do.
        let t = (sample as f64 + 1e-9) * ts;
        Some(Moves {
            phi: std::array::from_fn(|i| row(&|lane, j| step(lane).phi[i][j])),
            older: row(&|lane, i| step(lane).older[i]),
            newer: row(&|lane, i| step(lane).newer[i]),
            both: row(&|lane, i| step(lane).older[i] + step(lane).newer[i]),
            shows: Shows::of(
                |lane, i| step(lane).c[i] - rate(lane, i),
                |lane| step(lane).d - rate_drive(lane),
                phi_load,
            ),
            y: Shows::of(|lane, i| step(lane).c[i], |lane| step(lane).d, phi_load),
            late: Shows::of(rate, rate_drive, phi_load),
            of_sensor: self.lanes.each(|lane| lane.filter.noise.growth_at(t)),
            phi_load,
            rho: self.lanes.each(|lane| lane.filter.noise.sensor_rho),
            middle: Middle {
                states: row(&|lane, i| step(lane).middle_state[i]),
                drive: T::of(|lane| step(lane).middle_drive),
            },
        })
    }

    /// Samples under the same gains.
    fn block(
        &mut self,
        moves: &Moves<T, N>,
        gains: &Gains<T, N>,
        samples: &Range<usize>,
        (drives, innovations): (&mut [(T, T); BLOCK], &mut [T; BLOCK]),
    ) {
        self.drives(drives, samples);
        if self.has_forces {
            self.forced(moves, gains, samples, (drives, innovations));
        } else if self.has_sensor_terms {
            self.sensed(moves, gains, samples, (drives, innovations));
        } else {
            self.straight(moves, &moves.behind(*gains), samples, (drives, innovations));
        }
        let measured = self.signals.y.get(samples.clone()).unwrap_or(&[]);
        self.gone.innovations((samples.start, measured), innovations, gains);
    }

    /// The drive's older and newer value over each sample, but for the filter's load.
    fn drives(&self, drives: &mut [(T, T); BLOCK], samples: &Range<usize>) {
        let gain: T = self.lanes.each(|lane| lane.simulation.drives().0);
        let rest: T = self.lanes.each(|lane| lane.simulation.drives().1 - lane.filter.constant_load);
        let Some(first) = self.driven.first() else { return };
        let of = |lane: usize| self.driven.get(lane).unwrap_or(first);
        let held: [&[(f64, f64)]; LANES] =
            std::array::from_fn(|lane| of(lane).held.get(samples.clone()).unwrap_or(&[]));
        let has_load = self.driven.iter().any(|driven| !driven.load.is_empty());
        if self.is_driven_alike && !has_load {
            for (slot, (older, newer)) in drives.iter_mut().zip(held[0]) {
                *slot = (gain * T::all(*older) + rest, gain * T::all(*newer) + rest);
            }
            return;
        }
        for (i, slot) in drives.iter_mut().take(samples.len()).enumerate() {
            let held = |lane: usize| held[lane].get(i).copied().unwrap_or_default();
            let mut rest = rest;
            if has_load {
                let n = samples.start + i;
                rest = rest - T::of(|lane| of(lane).load.get(n).copied().unwrap_or(0.0));
            }
            *slot = (gain * T::of(|lane| held(lane).0) + rest, gain * T::of(|lane| held(lane).1) + rest);
        }
    }

    /// What measured inputs add at the sensor.
    #[inline(always)]
    pub(super) fn at_sensor(&self, n: usize) -> T {
        let of = |lane: usize| self.driven.get(lane).or(self.driven.first())?.at_sensor.get(n).copied();
        T::of(|lane| of(lane).unwrap_or(0.0))
    }

    fn straight(
        &mut self,
        moves: &Moves<T, N>,
        gains: &Gains<T, N>,
        samples: &Range<usize>,
        (drives, errors): Block<'_, T>,
    ) {
        let has_inputs = self.driven.iter().any(|driven| !driven.at_sensor.is_empty());
        let (mut x, mut load, mut sensor, mut held) = (self.x, self.load, self.sensor, self.held);
        let y = self.signals.y.get(samples.clone()).unwrap_or(&[]);
        let ahead = moves.ahead(gains);
        let mut shown = moves.shows.seen(&x, load, held) + moves.of_sensor * sensor;
        let mut corrected = T::all(0.0);
        for (i, ((y, drive), slot)) in y.iter().zip(drives).zip(errors).enumerate() {
            let mut e = T::all(0.0);
            if y.is_finite() {
                e = T::all(*y) - shown;
                if has_inputs {
                    e = e - self.at_sensor(samples.start + i);
                }
                e = e - corrected;
            }
            *slot = e;
            shown = ahead.shown(&x, load, sensor, *drive);
            corrected = ahead.innovation * e;
            (x, load, sensor) = moves.moved(gains, (x, load, sensor), *drive, e);
            held = drive.1;
        }
        (self.x, self.load, self.sensor, self.held) = (x, load, sensor, held);
    }

    /// The same where terms change what the sensor shows, lane by lane.
    fn sensed(
        &mut self,
        moves: &Moves<T, N>,
        gains: &Gains<T, N>,
        samples: &Range<usize>,
        (drives, errors): Block<'_, T>,
    ) {
        let of_y = product(&moves.y.states, &gains.states);
        let gains = moves.behind(*gains);
        for ((n, drive), slot) in samples.clone().zip(drives).zip(errors) {
            let y = moves.y.seen(&self.x, self.load, self.held);
            let inputs = self.at_sensor(n);
            let shown = self.lanes.shown(n, y, inputs);
            let besides = moves.late.seen(&self.x, self.load, self.held) - moves.of_sensor * self.sensor;
            let measured = self.signals.y.get(n).copied().filter(|y| y.is_finite());
            let e = measured.map_or(T::all(0.0), |y| (T::all(y) - shown) + besides);
            *slot = e;
            self.lanes.corrected(of_y * e, gains.shown * e);
            (self.x, self.load, self.sensor) =
                moves.moved(&gains, (self.x, self.load, self.sensor), *drive, e);
            self.held = drive.1;
        }
    }
}

/// What the sensor shows a sample later of what there is before a sample: all but the part of that sample's innovation is then known before it.
struct Ahead<T, const N: usize> {
    states: [T; N],
    load: T,
    sensor: T,
    older: T,
    newer: T,
    innovation: T,
}

impl<T: Side, const N: usize> Ahead<T, N> {
    /// But for the part of the innovation.
    #[inline(always)]
    fn shown(&self, x: &[T; N], load: T, sensor: T, (older, newer): (T, T)) -> T {
        let driven = self.older * older + self.newer * newer;
        (product(&self.states, x) + driven) + (self.load * load + self.sensor * sensor)
    }
}

impl<T: Side, const N: usize> Moves<T, N> {
    /// The sensor a sample later, under gains with the plant's step behind them.
    fn ahead(&self, gains: &Gains<T, N>) -> Ahead<T, N> {
        let of = |column: &[T; N]| product(&self.shows.states, column);
        let to_state = |i: usize| of(&std::array::from_fn(|j| self.phi[j][i]));
        Ahead {
            states: std::array::from_fn(to_state),
            load: self.shows.load * self.phi_load - of(&self.both),
            sensor: self.of_sensor * self.rho,
            older: of(&self.older),
            newer: of(&self.newer) + self.shows.drive,
            innovation: of(&gains.states) + (self.shows.load * gains.load + self.of_sensor * gains.sensor),
        }
    }

    /// Gains with the plant's step behind them.
    fn behind(&self, gains: Gains<T, N>) -> Gains<T, N> {
        let moved = |i: usize| product(&self.phi[i], &gains.states) - self.both[i] * gains.load;
        Gains {
            states: std::array::from_fn(moved),
            load: self.phi_load * gains.load,
            sensor: self.rho * gains.sensor,
            ..gains
        }
    }

    /// States, load and sensor noise a sample later.
    #[inline(always)]
    fn moved(
        &self,
        gains: &Gains<T, N>,
        (x, load, sensor): ([T; N], T, T),
        (older, newer): (T, T),
        e: T,
    ) -> ([T; N], T, T) {
        let mut next = x;
        for i in 0..N {
            let driven = self.older[i] * older + (self.newer[i] * newer - self.both[i] * load);
            next[i] = product(&self.phi[i], &x) + driven + gains.states[i] * e;
        }
        (next, self.phi_load * load + gains.load * e, self.rho * sensor + gains.sensor * e)
    }
}

/// The product of a row and a column.
#[inline(always)]
pub(super) fn product<T: Side, const N: usize>(row: &[T; N], column: &[T; N]) -> T {
    let mut sum = row[0] * column[0];
    for i in 1..N {
        sum = sum + row[i] * column[i];
    }
    sum
}

#[cfg(test)]
mod tests;
