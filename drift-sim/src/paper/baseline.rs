//! Section 6.2: the nominal relation from one healthy run of 100 s, and how much it owes to the seed.

use crate::cores::AcrossCores as _;
use drift_core::Index;

use super::line;
use super::settings::{KP, LONG_RUN_S, OTHER_KP, Settings, Use};
use super::spread::Spread;
use super::windows::{Drift, Stream, Window, energy_error};
use crate::Result;
use crate::calibrate::regression::Fit;
use crate::control_loop::Loop;
use crate::controller::Controller;

/// The nominal relation, ours.
#[derive(Debug, Clone, PartialEq)]
pub struct NominalRelation {
    /// From the run with the seed asked for.
    pub line: Fit,
    /// Its windows, (E_u, J_e).
    pub points: Vec<(f64, f64)>,
    /// From the repeats, this run among them.
    pub over_seeds: OverSeeds,
    /// From the repeats with the proportional gain [`OTHER_KP`].
    pub with_other_kp: OverSeeds,
    /// The same run with J_e = ITAE, which the paper's section 5 names beside IAE.
    pub itae: Fit,
    /// Mean ITAE over mean IAE, s: half a window, apart from how e varies.
    pub itae_per_iae: f64,
}

/// The spread of the line's numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverSeeds {
    /// Intercept of the nominal relation (equation 5), over the runs.
    pub b0: Spread,
    /// Slope of the nominal relation (equation 5), over the runs.
    pub b1: Spread,
    /// Coefficient of determination, over the runs.
    pub r2: Spread,
    /// Root mean squared residual, in the unit of J_e, over the runs.
    pub rmse: Spread,
    /// Correlation of neighbouring residuals.
    pub lag1: Spread,
}

/// A healthy run's windows.
pub(super) fn healthy_windows(seed: u64) -> Result<Vec<Window>> {
    Ok(Stream::learning(&Drift::over(0.0, 0.0, LONG_RUN_S), seed)?.windows_within(LONG_RUN_S))
}

fn over_seeds(settings: &Settings, kp: f64, step: &(dyn Fn() + Sync)) -> Result<OverSeeds> {
    let mut model = Loop::paper();
    if let Controller::Pi(pi) = &mut model.controller {
        pi.kp = kp;
    }
    let lines = (0..settings.repeats)
        .into_par_iter()
        .map(|i| {
            let stream = Stream::learning_of(&model, settings.seed_of(Use::Repeat, i))?;
            step();
            line::fit(&energy_error(&stream.windows_within(LONG_RUN_S), Index::Iae))
        })
        .collect::<Result<Vec<_>>>()?;
    let spread = |of: fn(&Fit) -> f64| Spread::of(&lines.iter().map(of).collect::<Vec<_>>());
    Ok(OverSeeds {
        b0: spread(|l| l.b0),
        b1: spread(|l| l.b1),
        r2: spread(|l| l.r2),
        rmse: spread(|l| l.rmse),
        lag1: spread(|l| line::lag1(&l.residuals)),
    })
}

pub(super) fn nominal_relation(settings: &Settings, step: &(dyn Fn() + Sync)) -> Result<NominalRelation> {
    let windows = healthy_windows(settings.seed_of(Use::Repeat, 0))?;
    let points = energy_error(&windows, Index::Iae);
    let weighted = energy_error(&windows, Index::Itae);
    let sum = |points: &[(f64, f64)]| points.iter().map(|p| p.1).sum::<f64>();
    Ok(NominalRelation {
        line: line::fit(&points)?,
        over_seeds: over_seeds(settings, KP, step)?,
        with_other_kp: over_seeds(settings, OTHER_KP, &|| ())?,
        itae: line::fit(&weighted)?,
        itae_per_iae: sum(&weighted) / sum(&points),
        points,
    })
}
