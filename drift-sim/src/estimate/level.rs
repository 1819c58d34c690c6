//! The level that an unknown plant is fitted about: at the mean u of the recordings it rests at their mean y, whatever its gain. Where u is 72 +- 0.2 any other
//! gain would move y by hundreds of its deviations, so that the load that stays had to move with it, and fits ended at the gain with which they began.

use nalgebra::{DMatrix, DVector};

use crate::plant::{Plant, StateSpace};

/// Where a plant rests, whatever its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    u: f64,
    y: f64,
    /// Load of the measured inputs at their means.
    measured_load: f64,
}

impl Level {
    /// That of recordings of these mean u and y, and load of the measured inputs, which the plant's own offset says more closely where it has one. `None` of a servo, at whose u = 0 nothing drives it, and of
    /// what does not come to rest.
    pub fn of(plant: &Plant, (u, mean_y, measured_load): (f64, f64, f64)) -> Option<Self> {
        if matches!(plant, Plant::Servo(_) | Plant::Tank(_)) || !plant.keeps_its_level() {
            return None;
        }
        let y = match plant {
            Plant::StateSpace(_) => mean_y,
            plant => (plant.drive_gain() * u + plant.drive_offset() - measured_load) * gain_at_rest(plant)?,
        };
        y.is_finite().then_some(Self { u, y, measured_load })
    }

    /// The load under which a plant is at the level; `None` where it does not come to rest.
    pub fn load(&self, plant: &Plant) -> Option<f64> {
        let driven = plant.drive_gain() * self.u + plant.drive_offset() - self.measured_load;
        let load = driven - self.y / gain_at_rest(plant)?;
        load.is_finite().then_some(load)
    }
}

/// What y rests at for each unit of the drive; `None` where it does not come to rest.
pub fn gain_at_rest(plant: &Plant) -> Option<f64> {
    let StateSpace { a, b, c, d } = plant.linear().ok()??;
    let n = b.len();
    let entries: Vec<f64> = a.into_iter().flatten().collect();
    if entries.len() != n * n || c.len() != n {
        return None;
    }
    let rest = DMatrix::from_row_slice(n, n, &entries).lu().solve(&DVector::from_vec(b))?;
    Some(d - DVector::from_vec(c).dot(&rest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{FirstOrder, TransferFunction};

    /// A flow of 970 under a valve at 72.3 %: with a fifth of the gain the load that stays makes up for all of what u's mean no longer does, by the closed form.
    #[test]
    fn a_plant_of_another_gain_rests_where_it_rested() {
        let flow = |gain: f64| FirstOrder { gain, time_constant_s: 60.0, delay_s: 20.0, offset: -270.0 };
        let level = Level::of(&Plant::FirstOrder(flow(17.0)), (72.3, 970.0, 0.0)).unwrap();
        let load = level.load(&Plant::FirstOrder(flow(3.4))).unwrap();
        assert!((3.4 * 72.3 - 270.0 - load - (17.0 * 72.3 - 270.0)).abs() < 1e-9, "{load}");
        assert!(level.load(&Plant::FirstOrder(flow(17.0))).unwrap().abs() < 1e-9);
    }

    /// An oscillator has no offset: it rests at the mean y, by its equations at rest, x2 = 0 and x1 = 2 q.
    #[test]
    fn an_oscillator_rests_at_the_mean_y() {
        let oscillator = StateSpace {
            a: vec![vec![0.0, 1.2], vec![-1.0, -0.2]],
            b: vec![0.0, 2.0],
            c: vec![1.0, 0.0],
            d: 0.0,
        };
        let plant = Plant::StateSpace(oscillator);
        let level = Level::of(&plant, (40.0, 50.0, 0.0)).unwrap();
        assert!((2.0 * (40.0 - level.load(&plant).unwrap()) - 50.0).abs() < 1e-9);
    }

    #[test]
    fn what_does_not_come_to_rest_has_no_level() {
        let integral = TransferFunction { num: vec![0.1], den: vec![1.0, 0.0], delay_s: 0.0, offset: 0.0 };
        assert_eq!(Level::of(&Plant::TransferFunction(integral), (40.0, 50.0, 0.0)), None);
    }
}
