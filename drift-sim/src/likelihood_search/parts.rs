//! What a fit may see of recordings, and what proves.

use crate::estimate::first_look::{coarser, fewer};
use crate::estimate::fit::Fit;
use crate::estimate::likelihood::Data;
use crate::estimate::signals::Signals;

use super::options::Options;
use super::unseen::Unseen;

/// The recordings and what a fit may see of each; the hold-out is the last.
pub struct Parts {
    /// The recordings.
    pub recordings: Vec<Signals>,
    /// Samples of each that a fit sees.
    pub fitted: Vec<usize>,
    /// Samples that were left out: there were too many.
    pub not_used: usize,
    has_holdout: bool,
}

impl Parts {
    /// `None` without a recording.
    pub fn new(recordings: &[Signals], holdout: Option<&Signals>, options: &Options) -> Option<Self> {
        let most = options.most_samples / recordings.len().max(1);
        let cut = |signals: &Signals| signals.part(0, most);
        let not_used = recordings.iter().map(|signals| signals.len().saturating_sub(most)).sum();
        let share = |signals: &Signals, part: f64| (part * signals.len() as f64) as usize;
        let seen = if holdout.is_some() { 1.0 } else { options.seen_of_recording };
        let mut cuts: Vec<Signals> = recordings.iter().map(cut).collect();
        let mut fitted: Vec<usize> = cuts.iter().map(|signals| share(signals, seen)).collect();
        if let Some(holdout) = holdout.map(cut) {
            fitted.push(share(&holdout, options.seen_of_holdout));
            cuts.push(holdout);
        }
        let parts = Self { recordings: cuts, fitted, not_used, has_holdout: holdout.is_some() };
        (!recordings.is_empty()).then_some(parts)
    }

    /// The same in coarser samples.
    pub fn in_coarser_samples(&self, factor: usize) -> Self {
        let Self { recordings, fitted, .. } = self;
        Self { recordings: coarser(recordings, factor), fitted: fewer(fitted, factor), ..*self }
    }

    /// These as data for a fit to data in samples so many times as coarse, the load jumping and swinging as it does there.
    pub fn as_data(&self, fit: &Fit, of: &Data, factor: usize) -> Data {
        let data = Data::new(&fit.hypothesis, self.recordings.clone(), self.fitted.clone());
        data.jumping(of.jumps().in_finer_samples(factor)).swinging(of.waves().clone())
    }

    /// What fits are shown on: what numbers were fitted to, of the first recording, and what proves.
    pub fn shown(&self) -> (Signals, Option<Unseen>) {
        let (first, fitted) = (&self.recordings[0], self.fitted[0]);
        let unseen = match self.recordings.last().filter(|_| self.has_holdout) {
            Some(holdout) => Unseen::of(std::iter::once((self.recordings.len() - 1, (holdout, 0)))),
            None => Unseen::of(self.recordings.iter().zip(self.fitted.iter().copied()).enumerate()),
        };
        (first.part(0, fitted), unseen)
    }
}
