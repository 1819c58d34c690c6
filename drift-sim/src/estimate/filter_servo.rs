//! The filter over one recording for several points at once, where their plant is a mass under dry friction or forces. All lanes take the closed
//! form of a sample in which the mass moves on or stays at rest; a lane whose mass stops on the way goes through that sample by itself.

use std::ops::Range;
use std::sync::Arc;

use crate::simulate::batch::{Driven, ServoStep};

use super::driven::Memory;
use super::innovations::{Innovations, SETTLING};
use super::lanes::Side;
use super::rest::{Law, Rest};
use super::side_by_side::{Gains, Gone, Lane, Lanes};
use super::signals::Signals;

/// The innovations of each lane; `None` where a loop diverges.
pub fn run<T: Side>(
    lanes: Vec<Lane<'_>>,
    signals: &Signals,
    counted: &Range<usize>,
    memory: &Memory,
) -> Vec<Option<Innovations>> {
    let count = lanes.len();
    match Run::<T>::new(lanes, signals, counted, memory).and_then(Run::over_all) {
        Some(run) => run.gone.found(),
        None => vec![None; count],
    }
}

/// Part of a mass's speed that viscous friction takes while it stops, up to which the series of its way is exact to rounding: the first term left out is z^8/10.
const MOST_VISCOUS: f64 = 0.01;

/// What acts on the mass of a lane over each sample: the actuator's force, and what else does but for the filter's load.
struct Acts {
    actuator: Vec<f64>,
    outside: Vec<f64>,
    driven: Arc<Driven>,
}

/// Masses at work.
struct Run<'a, T> {
    lanes: Lanes<'a>,
    acts: Vec<Acts>,
    signals: &'a Signals,
    samples: usize,
    has_sensor_terms: bool,
    has_forces: bool,
    has_varying_forces: bool,
    has_varying_friction: bool,
    late: T,
    phi_load: T,
    rho: T,
    state: State<T>,
    /// The force that lacked over the last sample for the mass to be moved.
    lacks: T,
    rest: Rest<T>,
    gone: Gone<T>,
}

/// Position, speed, the acceleration over the last sample, load and sensor noise.
#[derive(Clone, Copy)]
struct State<T> {
    x: T,
    v: T,
    acceleration: T,
    load: T,
    sensor: T,
}

/// What holds over a stretch of samples.
struct Moves<T> {
    left: T,
    way: T,
    speed_of_force: T,
    way_of_force: T,
    inertia: T,
    viscous: T,
    h: T,
    per_h: T,
    shows_position: bool,
    /// Dry friction forwards and backwards, where it depends on the direction alone.
    friction: (T, T),
    growth: T,
}

impl<'a, T: Side> Run<'a, T> {
    fn new(
        mut lanes: Vec<Lane<'a>>,
        signals: &'a Signals,
        counted: &Range<usize>,
        memory: &Memory,
    ) -> Option<Self> {
        let samples = counted.end.min(signals.len());
        let acts = lanes.iter_mut().map(|lane| Acts::of(lane, signals, samples, memory)).collect();
        let gone = Gone::new(lanes.len(), samples, counted.start.max(SETTLING));
        let lanes = Lanes(lanes);
        let state = |i: usize| lanes.each(|lane| lane.simulation.state().get(i).copied().unwrap_or(0.0));
        let zero = T::all(0.0);
        Some(Self {
            acts,
            signals,
            samples,
            has_sensor_terms: lanes.any(|lane| lane.simulation.has_sensor_terms()),
            has_forces: lanes.any(|lane| lane.simulation.has_forces()),
            has_varying_forces: lanes.any(|lane| lane.simulation.has_varying_forces()),
            has_varying_friction: lanes.any(|lane| lane.simulation.has_varying_friction()),
            late: lanes.each(|lane| lane.filter.late_s),
            phi_load: lanes.each(|lane| lane.filter.noise.load_phi(signals.sample_time_s)),
            rho: lanes.each(|lane| lane.filter.noise.sensor_rho),
            state: State { x: state(0), v: state(1), acceleration: zero, load: zero, sensor: zero },
            lacks: zero,
            rest: Rest::new(lanes.each(|lane| 1.0 / lane.filter.unit)),
            gone,
            lanes,
        })
    }

    /// Stretch by stretch; the mass, its friction and the law of the gains stay as they are in each.
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
        let laws: Vec<&Law<f64>> = stretches.iter().filter_map(|stretch| stretch.rest.as_ref()).collect();
        let law = laws.first().filter(|_| laws.len() == stretches.len());
        let law = law.map(|first| Law::<T>::of(|lane| laws.get(lane).unwrap_or(first)));
        for range in ranges {
            let gains = self.lanes.gains(&stretches, range.start)?;
            self.block(&moves, &gains, law.as_ref(), range);
        }
        Some(())
    }

    fn moves(&self, sample: usize) -> Option<Moves<T>> {
        let steps: Vec<ServoStep> =
            self.lanes.0.iter().map(|lane| lane.simulation.servo_step(sample)).collect::<Option<_>>()?;
        let first = steps.first()?;
        let each = |of: fn(&ServoStep) -> f64| T::of(|lane| of(steps.get(lane).unwrap_or(first)));
        let friction =
            |direction: f64| self.lanes.each(|lane| lane.simulation.friction(sample, direction, 0.0, 0.0));
        // Growth changes where gains do.
        let t = (sample as f64 + 1e-9) * self.signals.sample_time_s;
        Some(Moves {
            left: each(|step| step.left),
            way: each(|step| step.way),
            speed_of_force: each(|step| step.speed_of_force),
            way_of_force: each(|step| step.way_of_force),
            inertia: each(|step| step.inertia),
            viscous: each(|step| step.viscous),
            h: each(|step| step.h),
            per_h: each(|step| 1.0 / step.h),
            shows_position: first.shows_position,
            friction: (friction(1.0), friction(-1.0)),
            growth: self.lanes.each(|lane| lane.filter.noise.growth_at(t)),
        })
    }

    /// Samples under the same gains, but for masses that rest.
    fn block(&mut self, moves: &Moves<T>, gains: &Gains<T, 2>, law: Option<&Law<T>>, samples: Range<usize>) {
        let mut state = self.state;
        for n in samples {
            let measured = self.signals.y.get(n).copied().filter(|y| y.is_finite());
            let y = if moves.shows_position { state.x } else { state.v };
            let rate = if moves.shows_position { state.v } else { state.acceleration };
            let shown = self.shown(n, y) - self.late * rate + moves.growth * state.sensor;
            if let Some(y) = measured {
                let e = T::all(y) - shown;
                let rested = state.v.is_same(T::all(0.0));
                let own = law.and_then(|law| self.rest.gains(law, n, (rested, self.lacks), gains, e));
                let gains = own.as_ref().unwrap_or(gains);
                self.gone.innovation(n, e * gains.per_deviation, gains.log_variance);
                state.x = state.x + gains.states[0] * e;
                state.v = state.v + gains.states[1] * e;
                if self.has_sensor_terms {
                    let of_y = gains.states[usize::from(!moves.shows_position)];
                    self.lanes.corrected(of_y * e, gains.shown * e);
                }
                state.load = state.load + gains.load * e;
                state.sensor = state.sensor + gains.sensor * e;
            }
            let ((x, v), lacks) = self.moved(moves, n, &state);
            self.lacks = lacks;
            state.acceleration = (v - state.v) * moves.per_h;
            (state.x, state.v) = (x, v);
            state.load = self.phi_load * state.load;
            state.sensor = self.rho * state.sensor;
        }
        self.state = state;
    }

    /// What the sensors show of y.
    #[inline(always)]
    fn shown(&mut self, n: usize, y: T) -> T {
        let mut inputs = T::all(0.0);
        if self.acts.iter().any(|acts| !acts.driven.at_sensor.is_empty()) {
            let first = self.acts.first();
            let at = |lane: usize| self.acts.get(lane).or(first)?.driven.at_sensor.get(n).copied();
            inputs = T::of(|lane| at(lane).unwrap_or(0.0));
        }
        if self.has_sensor_terms { self.lanes.shown(n, y, inputs) } else { y + inputs }
    }

    /// Position and speed a sample later, and the force that lacks for a mass at rest to be moved.
    #[inline(always)]
    fn moved(&self, moves: &Moves<T>, n: usize, state: &State<T>) -> ((T, T), T) {
        let first = self.acts.first();
        let acts = |of: fn(&Acts) -> &Vec<f64>| {
            T::of(|lane| {
                self.acts.get(lane).or(first).and_then(|acts| of(acts).get(n)).copied().unwrap_or(0.0)
            })
        };
        let actuator = acts(|acts| &acts.actuator);
        let outside = acts(|acts| &acts.outside) - state.load;
        let (zero, half) = (T::all(0.0), T::all(0.5));
        let (x, v) = (state.x, state.v);
        let rests = v.is_same(zero);
        let mut force = self.with_forces(n, outside, (x, v));
        let mut speed = v.abs();
        if self.has_varying_forces {
            let (middle_x, middle_v) = self.middle(moves, n, (actuator, force), (x, v));
            force = self.with_forces(n, outside, (middle_x, middle_v));
            speed = middle_v.abs();
        }
        let transmitted = half * (actuator - force);
        let q = actuator + force;
        let direction = self.direction(v, q, rests);
        let available = self.friction(moves, n, (direction, speed, transmitted));
        let held = if self.has_varying_friction {
            self.friction(moves, n, (direction, zero, transmitted))
        } else {
            available
        };
        let leaves = held.is_less(q.abs());
        let net = q - direction * available;
        let after = v * moves.left + net * moves.speed_of_force;
        let turns = T::choose(rests, zero, after * direction).is_less(zero);
        let way = x + v * moves.way + net * moves.way_of_force;
        let mut next_x = T::choose(rests, T::choose(leaves, way, x), way);
        let mut next_v = T::choose(rests, T::choose(leaves, after, v), after);
        if T::holds_anywhere(turns) {
            let (stopped, stays) = self.stopped(moves, n, (x, v), (net, q, transmitted));
            next_x = T::choose(turns, stopped, next_x);
            next_v = T::choose(turns, zero, next_v);
            for (i, lane) in self.lanes.0.iter().enumerate() {
                if T::holds_in(turns, i) && !T::holds_in(stays, i) {
                    let acting = (actuator.lane(i), outside.lane(i));
                    let [x, v] = lane.simulation.servo_after(n, [x.lane(i), v.lane(i)], acting);
                    next_x = T::of(|lane| if lane == i { x } else { next_x.lane(lane) });
                    next_v = T::of(|lane| if lane == i { v } else { next_v.lane(lane) });
                }
            }
        }
        ((next_x, next_v), held - q.abs())
    }

    /// Where a mass comes to rest that a net force against it stops, and in which lanes it surely stays there. From `m dv/dt = net - b v` it goes
    /// `-m v^2/net (z - log(1 + z))/z^2` with `z = -b v/net`, which is a short series where viscous friction takes little of the speed on the way.
    #[inline(always)]
    fn stopped(
        &self,
        moves: &Moves<T>,
        n: usize,
        (x, v): (T, T),
        (net, q, transmitted): (T, T, T),
    ) -> (T, T::Mask) {
        let zero = T::all(0.0);
        let until = zero - v / net;
        let z = moves.viscous * until;
        let series = [1.0 / 8.0, 1.0 / 7.0, 1.0 / 6.0, 1.0 / 5.0, 1.0 / 4.0, 1.0 / 3.0, 1.0 / 2.0];
        let series = series.into_iter().fold(T::all(1.0 / 9.0), |sum, of| T::all(of) - z * sum);
        let way = moves.inertia * v * until * series;
        let forwards = T::choose(q.is_less(zero), T::all(-1.0), T::all(1.0));
        let held = self.friction(moves, n, (forwards, zero, transmitted));
        // In other lanes it moves on, or the series is too short.
        let pull = T::choose(z.is_less(T::all(MOST_VISCOUS)), q.abs(), T::all(f64::INFINITY));
        (x + way, pull.is_less(held))
    }

    /// Position and speed at the middle of the sample under the forces at its beginning; the speed does not change its sign on the way.
    #[inline(always)]
    fn middle(&self, moves: &Moves<T>, n: usize, (actuator, force): (T, T), (x, v): (T, T)) -> (T, T) {
        let (zero, half) = (T::all(0.0), T::all(0.5));
        let rests = v.is_same(zero);
        let q = actuator + force;
        let direction = self.direction(v, q, rests);
        let held = self.friction(moves, n, (direction, v.abs(), half * (actuator - force)));
        let leaves = held.is_less(q.abs());
        let net = q - direction * held - moves.viscous * v;
        let middle = v + half * moves.h * T::of(|lane| net.lane(lane) / moves.inertia.lane(lane));
        let middle = T::choose((middle * direction).is_less(zero), zero, middle);
        let way = x + T::all(0.25) * moves.h * (v + middle);
        (
            T::choose(rests, T::choose(leaves, way, x), way),
            T::choose(rests, T::choose(leaves, middle, v), middle),
        )
    }

    /// Where the mass moves to, or would.
    #[inline(always)]
    fn direction(&self, v: T, q: T, rests: T::Mask) -> T {
        let towards = T::choose(rests, q, v);
        T::choose(towards.is_less(T::all(0.0)), T::all(-1.0), T::all(1.0))
    }

    #[inline(always)]
    fn with_forces(&self, n: usize, outside: T, (x, v): (T, T)) -> T {
        if !self.has_forces {
            return outside;
        }
        let own = |lane: usize| {
            self.lanes.0.get(lane).map_or(0.0, |own| own.simulation.force(n, x.lane(lane), v.lane(lane)))
        };
        outside + T::of(own)
    }

    /// The dry friction that is available: (direction, speed, transmitted force).
    #[inline(always)]
    fn friction(&self, moves: &Moves<T>, n: usize, (direction, speed, transmitted): (T, T, T)) -> T {
        if !self.has_varying_friction {
            let (forwards, backwards) = moves.friction;
            return T::choose(direction.is_less(T::all(0.0)), backwards, forwards);
        }
        T::of(|lane| {
            let Some(own) = self.lanes.0.get(lane) else { return 0.0 };
            own.simulation.friction(n, direction.lane(lane), speed.lane(lane), transmitted.lane(lane))
        })
    }
}

impl Acts {
    fn of(lane: &mut Lane<'_>, signals: &Signals, samples: usize, memory: &Memory) -> Self {
        let driven = memory.driven(&mut lane.simulation, signals, samples);
        let held = driven.held.get(..samples).unwrap_or(&[]);
        let (gain, offset, _) = lane.simulation.drives();
        let rest = offset - lane.filter.constant_load;
        let outside = if driven.load.is_empty() {
            vec![rest; samples]
        } else {
            driven.load.iter().take(samples).map(|load| rest - load).collect()
        };
        Self { actuator: held.iter().map(|(_, w)| gain * w).collect(), outside, driven }
    }
}
