//! The detectors as calibration sees them: how a threshold is found, and what it then does. A detector is one file here, with its
//! [`Designed`], and one row of [`ROWS`]; everything else asks the rows.

mod cusum;
mod ewma;
mod shewhart;
mod sprt;

#[cfg(test)]
pub(super) use sprt::LOWER as SPRT_LOWER;

use std::str::FromStr;

use drift_core::Detectors;

use super::caution::Margin;
use super::process::ChannelProcess;
use crate::{Error, Result};

/// What the thresholds are made for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tuning {
    /// Half the shift to be found, sigmas: the CUSUM's reference value; the SPRT's alternative is twice it.
    pub k: f64,
    /// Weight of the newest residual in the EWMA.
    pub lambda: f64,
}

/// Where a threshold lies.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Threshold<'a> {
    /// Where the statistic's maxima exceed it as often as asked for, on [`Designed::maxima`]'s scale.
    Exceeded(f64),
    /// At this normal score of the channel's own law, moved outward by the margin.
    Score(f64, &'a ChannelProcess, Margin),
}

/// One detector.
pub(crate) trait Designed: Sync {
    /// The name in files, commands and reports, one of [`Detectors::NAMES`].
    fn name(&self) -> &'static str;
    /// What it looks at, in plain words, and its name in parentheses.
    fn spoken(&self) -> &'static str;
    /// The statistic's maxima between two restarts on these residuals, on a scale on which their tail is exponential; each side
    /// sees the residuals wrong by the margin in its own direction. `None`: it has no memory, and its limits are the law's own.
    fn maxima(&self, tuning: Tuning, margin: Margin, z: &[f64]) -> Option<Vec<f32>>;
    /// Puts it among a channel's detectors.
    fn place(&self, into: &mut Detectors, tuning: Tuning, at: Threshold<'_>);
    /// Mean decisions to a shift of one sigma, if it is configured.
    fn delay(&self, of: &Detectors, law: &ChannelProcess) -> Option<f64>;
    /// Whether it alarms within so many decisions after a shift with at least this probability; not where it isn't configured.
    fn shows(&self, of: &Detectors, shift: f64, decisions: u64, probability: f64) -> bool;
    /// Its thresholds in words, if it is configured.
    fn thresholds(&self, of: &Detectors) -> Option<String>;
}

/// A row for each. Of several, the first one's delay is named.
pub(crate) const ROWS: [&dyn Designed; 4] = [&cusum::Row, &ewma::Row, &sprt::Row, &shewhart::Row];

/// Which detectors watch each channel: `"shewhart,cusum".parse()`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DetectorChoice([bool; ROWS.len()]);

impl DetectorChoice {
    /// How many of them.
    pub fn count(self) -> usize {
        self.0.iter().filter(|chosen| **chosen).count()
    }

    /// Their rows.
    pub(crate) fn rows(self) -> impl Iterator<Item = &'static dyn Designed> {
        ROWS.into_iter().zip(self.0).filter_map(|(row, chosen)| chosen.then_some(row))
    }
}

impl Default for DetectorChoice {
    /// Shewhart and CUSUM: the first finds a disturbance at once, the second a small drift.
    fn default() -> Self {
        Self(ROWS.map(|row| ["shewhart", "cusum"].contains(&row.name())))
    }
}

impl FromStr for DetectorChoice {
    type Err = Error;

    /// Names between commas.
    fn from_str(text: &str) -> Result<Self> {
        let mut chosen = [false; ROWS.len()];
        for name in text.split(',').map(str::trim) {
            let Some(at) = ROWS.iter().position(|row| row.name() == name) else {
                let names = ROWS.map(Designed::name).join(", ");
                return Err(Error::new(format!("no detector '{name}'")).allowed(names));
            };
            chosen[at] = true;
        }
        Ok(Self(chosen))
    }
}

/// Maxima of a statistic that is above zero, between one visit to zero and the next.
#[derive(Default)]
struct Peaks {
    now: f32,
    maxima: Vec<f32>,
}

impl Peaks {
    fn visit(&mut self, statistic: f32) {
        if statistic > 0.0 {
            self.now = self.now.max(statistic);
        } else if self.now > 0.0 {
            self.maxima.push(self.now);
            self.now = 0.0;
        }
    }
}

/// The maxima of both sides of a statistic.
fn both_sides(margin: Margin, z: &[f64], mut sides: impl FnMut([f32; 2]) -> [f32; 2]) -> Vec<f32> {
    let (mut high, mut low) = (Peaks::default(), Peaks::default());
    for &z in z {
        let up = (z * margin.sigma + margin.mean) as f32;
        let down = (z * margin.sigma - margin.mean) as f32;
        let [at_high, at_low] = sides([up, down]);
        high.visit(at_high);
        low.visit(at_low);
    }
    high.maxima.extend(low.maxima);
    high.maxima
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rows are those of the core, by the same names and in the same order.
    #[test]
    fn the_rows_are_the_cores() {
        assert_eq!(ROWS.map(Designed::name), Detectors::NAMES);
    }

    #[test]
    fn names_are_chosen_and_others_refused() {
        let choice: DetectorChoice = "cusum, ewma".parse().unwrap();
        assert_eq!(choice.rows().map(Designed::name).collect::<Vec<_>>(), ["cusum", "ewma"]);
        assert_eq!((choice.count(), "shewhart,cusum".parse().ok()), (2, Some(DetectorChoice::default())));
        let error = "adwin".parse::<DetectorChoice>().unwrap_err().to_string();
        assert_eq!(error, "no detector 'adwin'; cusum, ewma, sprt, shewhart");
    }
}
