//! A run under a recorded u whose state is corrected at each sample, as a filter does it. The way of stepping the plant is chosen once
//! for a stretch of samples instead of at each of them: a search makes thousands of such runs.

use std::ops::Range;

use super::body::{Body, Sample};
use super::delay_line::DelayLine;
use super::exact::Exact;
use super::terms::{Terms, place};
use super::{Inputs, Simulation, entering};
use crate::measured_input::Enters;

/// What a run is corrected by, and what drives it.
pub trait Observer {
    /// The measured inputs at sample `n`, in the order of the loop's list.
    fn inputs(&mut self, n: usize) -> &[f64];

    /// Told y as the sensor is about to show it at sample `n`, dy/dt there, and the force that `lacks` for a plant that dry friction holds to be moved: how far y is
    /// off, and by how much all else moves with that; `None` where nothing was measured.
    fn error(&mut self, n: usize, shown: f64, rate: f64, lacks: Option<f64>) -> Option<(f64, Corrects<'_>)>;

    /// u, and a load (subtracted from the drive) beside those of the terms, both held until the next sample.
    fn held(&mut self, n: usize) -> (f64, f64);
}

/// By how much states move with an error.
pub struct Corrects<'a> {
    /// Those of the plant, from the first that is observed on.
    pub states: &'a [f64],
    /// What a slow sensor shows, where the observer follows it.
    pub shown: Option<f64>,
}

/// A plant as the run steps it.
trait Stepped {
    fn states(&mut self) -> &mut [f64];
    fn output_at(&self, held: f64) -> f64;
    fn rate_at(&self, held: f64) -> f64;
    /// The force that lacks for a plant at rest to be moved.
    fn lacks(&self) -> Option<f64>;
    fn moved(&mut self, sample: &Sample, terms: &mut Terms, times: (f64, usize)) -> f64;
}

impl<const N: usize> Stepped for Exact<N> {
    #[inline]
    fn states(&mut self) -> &mut [f64] {
        &mut self.x
    }

    #[inline]
    fn output_at(&self, held: f64) -> f64 {
        self.output(held)
    }

    #[inline]
    fn rate_at(&self, held: f64) -> f64 {
        self.rate(held)
    }

    #[inline]
    fn lacks(&self) -> Option<f64> {
        None
    }

    #[inline]
    fn moved(&mut self, sample: &Sample, terms: &mut Terms, (sample_time_s, _): (f64, usize)) -> f64 {
        sample.exact_step(self, terms, sample_time_s)
    }
}

impl Stepped for Body {
    #[inline]
    fn states(&mut self) -> &mut [f64] {
        self.state_mut()
    }

    #[inline]
    fn output_at(&self, held: f64) -> f64 {
        self.output(held)
    }

    #[inline]
    fn rate_at(&self, held: f64) -> f64 {
        self.rate(held)
    }

    #[inline]
    fn lacks(&self) -> Option<f64> {
        match self {
            Self::Servo(servo) => servo.lacks(),
            _ => None,
        }
    }

    #[inline]
    fn moved(&mut self, sample: &Sample, terms: &mut Terms, (sample_time_s, substeps): (f64, usize)) -> f64 {
        self.advance(sample, terms, sample_time_s, substeps)
    }
}

/// What is around the plant.
struct Around<'a> {
    terms: &'a mut Terms,
    line: &'a mut DelayLine,
    inputs: &'a Inputs,
    /// Drive per unit of u, and drive besides.
    gain: f64,
    offset: f64,
    held_drive: f64,
    tick: u64,
    sample_time_s: f64,
    substeps: usize,
    first_state: usize,
}

impl Simulation {
    /// Runs over `samples`, the states from `first_state` on being corrected as the observer says. The sensor's own noise is left out.
    pub fn observe(&mut self, samples: Range<usize>, first_state: usize, observer: &mut impl Observer) {
        let mut from = samples.start;
        while from < samples.end {
            self.change();
            let next = self.changes.get(self.next_change).map_or(u64::MAX, |change| change.tick);
            let length = place(next - self.tick);
            let to = samples.end.min(from.saturating_add(length));
            let mut around = Around {
                terms: &mut self.terms,
                line: &mut self.line,
                inputs: &self.inputs,
                gain: self.drive_gain,
                offset: self.drive_offset,
                held_drive: self.held_drive,
                tick: self.tick,
                sample_time_s: self.sample_time_s,
                substeps: self.substeps,
                first_state,
            };
            match &mut self.body {
                Body::One(plant) => around.run(plant, from..to, observer),
                Body::Two(plant) => around.run(plant, from..to, observer),
                Body::Three(plant) => around.run(plant, from..to, observer),
                Body::Four(plant) => around.run(plant, from..to, observer),
                other => around.run(other, from..to, observer),
            }
            (self.held_drive, self.tick) = (around.held_drive, around.tick);
            from = to;
        }
    }
}

impl Around<'_> {
    fn run(&mut self, plant: &mut impl Stepped, samples: Range<usize>, observer: &mut impl Observer) {
        for n in samples {
            let t = self.tick as f64 * self.sample_time_s;
            let rate = plant.rate_at(self.held_drive);
            let y = self.terms.sense(self.tick, t, plant.output_at(self.held_drive));
            let inputs = observer.inputs(n);
            let y = y + entering(self.inputs, Enters::Sensor, inputs);
            let (outside, load) = (
                entering(self.inputs, Enters::Actuator, inputs),
                entering(self.inputs, Enters::Load, inputs),
            );
            let shown = self.terms.sensor(self.tick, t, y);
            let lacks = plant.lacks();
            if let Some((error, gains)) = observer.error(n, shown, rate, lacks) {
                self.correct(plant, error, &gains);
            }
            let (u, own_load) = observer.held(n);
            let w = self.terms.actuator(self.tick, t, u + outside);
            let (older, newer) = self.line.push(w);
            let sample = Sample {
                tick: self.tick,
                t,
                older,
                newer,
                part: self.line.part,
                gain: self.gain,
                offset: self.offset - load - own_load,
            };
            self.held_drive = plant.moved(&sample, self.terms, (self.sample_time_s, self.substeps));
            self.tick += 1;
        }
    }

    #[inline]
    fn correct(&mut self, plant: &mut impl Stepped, error: f64, gains: &Corrects<'_>) {
        let heeds = self.terms.heeds_corrections();
        let before = if heeds { plant.output_at(self.held_drive) } else { 0.0 };
        for (state, gain) in plant.states().iter_mut().skip(self.first_state).zip(gains.states) {
            *state += gain * error;
        }
        if heeds {
            let by = plant.output_at(self.held_drive) - before;
            self.terms.correct(by, gains.shown.map(|gain| gain * error));
        }
    }
}
