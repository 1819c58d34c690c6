//! The likelihood of a given loop file on recordings: what keeps a search honest. A truth that is likelier than what a search found says
//! that the search stopped short; one that is less likely by far, that two simulators differ.

use crate::control_loop::Loop;
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::{Hypothesis, Target};
use crate::estimate::likelihood::Data;
use crate::estimate::signals::Signals;
use crate::physics::Place;
use crate::{Error, Result};

use super::nominal;
use super::options::Options;

/// Steps of a fit that moves the loop's numbers.
const STEPS: usize = 12;

/// How likely recordings are under a loop.
#[derive(Debug, Clone)]
pub struct LoopLikelihood {
    /// In nats, up to a constant that all loops share on the same recordings; what was taken as likely of the numbers is in it.
    pub log_likelihood: f64,
    /// Samples that count.
    pub samples: usize,
    /// Deviation of the sensor's noise, in the unit of y.
    pub sensor_sd: f64,
    /// Deviation of the random load over that of the drive, and its time constant in seconds.
    pub load: (f64, f64),
    /// The loop's numbers: as stated, or refitted.
    pub numbers: Vec<(String, f64)>,
}

/// The likelihood of recordings under a loop, its noise and a load that stays fitted; with `refit` also its plant's and its terms' numbers, from
/// where they stand.
///
/// # Errors
/// The loop can't be simulated beside the recordings.
pub fn loop_likelihood(
    model: &Loop,
    recordings: &[Signals],
    refit: bool,
    options: &Options,
) -> Result<LoopLikelihood> {
    let bare = Loop { physics: Vec::new(), ..model.clone() };
    let narrow = super::hypothesis(&bare, recordings, options);
    let terms = model.physics.iter().filter(|term| term.kind.place != Place::Controller);
    let hypothesis: Hypothesis = terms.fold(narrow, |wider, term| wider.with(term.clone()));
    let data = Data::new(&hypothesis, recordings.to_vec(), recordings.iter().map(Signals::len).collect());
    let is_own = |target: Target| matches!(target, Target::Plant(_) | Target::Term { .. } | Target::Onset(_));
    let own: Vec<usize> = (0..hypothesis.free.len())
        .filter(|i| hypothesis.free.get(*i).is_some_and(|free| is_own(free.target)))
        .collect();
    let lost = || {
        Error::new("the loop can't be simulated beside the recordings: it diverges")
            .allowed("numbers that fit them")
    };
    let mut fit: Fit = nominal::fit_noise(&hypothesis, &data, &own).ok_or_else(lost)?;
    if refit {
        fit.descend(&data, STEPS, &[]);
    }
    let value =
        |target| hypothesis.place(target).and_then(|i| fit.point.x.get(i)).map_or(0.0, |x| libm::exp(*x));
    let numbers = hypothesis.free.iter().zip(&fit.point.x).filter(|(free, _)| is_own(free.target));
    Ok(LoopLikelihood {
        log_likelihood: -0.5 * fit.objective(),
        samples: fit.rows.count,
        sensor_sd: fit.rows.sensor_sd,
        load: (value(Target::LoadSize), value(Target::LoadTau)),
        numbers: numbers.map(|(free, x)| (free.name.clone(), free.value(*x))).collect(),
    })
}
