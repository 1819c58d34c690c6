//! The filter over several points at once, where a force depends on the output of a linear plant: a leak, or heat that radiates. A step takes the force at its middle,
//! as the simulation does; lane by lane the force is asked for, all else goes side by side.

use std::ops::Range;

use super::filter_batch::{Block, Moves, Run, product};
use super::lanes::Side;
use super::side_by_side::Gains;

/// How y at the middle of a sample follows from the states and from the drive.
#[derive(Clone, Copy)]
pub struct Middle<T, const N: usize> {
    /// From the states.
    pub states: [T; N],
    /// From the drive.
    pub drive: T,
}

impl<T: Side, const N: usize> Run<'_, T, N> {
    /// Samples under the same gains.
    pub(super) fn forced(
        &mut self,
        moves: &Moves<T, N>,
        gains: &Gains<T, N>,
        samples: &Range<usize>,
        (drives, errors): Block<'_, T>,
    ) {
        let of_y = product(&moves.y.states, &gains.states);
        for ((n, (_, drive)), slot) in samples.clone().zip(drives).zip(errors) {
            let y = moves.y.now(&self.x, self.held);
            let rate = moves.late.now(&self.x, self.held);
            let inputs = self.at_sensor(n);
            let shown = if self.has_sensor_terms { self.lanes.shown(n, y, inputs) } else { y + inputs };
            let measured = self.signals.y.get(n).copied().filter(|y| y.is_finite());
            if let Some(measured) = measured {
                let e = T::all(measured) - (shown - rate + moves.of_sensor * self.sensor);
                for (x, gain) in self.x.iter_mut().zip(&gains.states) {
                    *x = *x + *gain * e;
                }
                self.load = self.load + gains.load * e;
                self.sensor = self.sensor + gains.sensor * e;
                if self.has_sensor_terms {
                    self.lanes.corrected(of_y * e, gains.shown * e);
                }
                *slot = e;
            }
            self.held = *drive - self.load;
            let start = moves.y.now(&self.x, self.held);
            let at_start = self.held + self.force(n, start);
            let middle = product(&moves.middle.states, &self.x) + moves.middle.drive * at_start;
            let at_middle = self.held + self.force(n, middle);
            let x = self.x;
            self.x = std::array::from_fn(|i| product(&moves.phi[i], &x) + moves.newer[i] * at_middle);
            self.load = moves.phi_load * self.load;
            self.sensor = moves.rho * self.sensor;
        }
    }

    #[inline(always)]
    fn force(&self, n: usize, y: T) -> T {
        T::of(|lane| self.lanes.0.get(lane).map_or(0.0, |own| own.simulation.force(n, y.lane(lane), 0.0)))
    }
}
