//! The missing drive: the force, heat or flow that the recorded motion needed beyond what the model applied, as the filter sees it: the
//! load that it reckons with, from sample to sample, taken from the drive.

use crate::diagnose::missing_drive::MissingDrive;
use crate::estimate::fit::Fit;
use crate::estimate::likelihood::{Cache, Data, runs};

/// The missing drive of a fit, of the first recording; `None` where it can't be simulated over all of it.
pub fn of(fit: &Fit, data: &Data, factor: usize) -> Option<MissingDrive> {
    let whole = data.whole();
    let longest = *whole.fitted.iter().max()?;
    let runs = runs(&fit.hypothesis, &fit.point, &whole, &mut Cache::default(), longest, true)?;
    let load = runs.into_iter().next()?.load;
    // What the filter is unsure of changes from sample to sample; its own deviation is the scatter of that.
    let changes = load.windows(2).map(|pair| (pair[1] - pair[0]) * (pair[1] - pair[0]));
    let deviation = libm::sqrt(0.5 * changes.sum::<f64>() / load.len().max(1) as f64);
    Some(MissingDrive {
        value: load.into_iter().flat_map(|load| std::iter::repeat_n(-load, factor)).collect(),
        deviation,
    })
}
