//! The missing drive as charts show it: over time with its own uncertainty, and against what friction, springs and valves depend
//! on, with the mean of what the found physics explains.

use crate::plot::{Colour, Layer, Marker, Panel};
use crate::sentences::Clock;

use super::missing_drive::MissingDrive;
use crate::estimate::signals::{Signals, deviation};

/// Bins of a curve against speed or position.
const BINS: usize = 40;
/// Samples of a bin from which its scatter means something.
const LEAST_IN_BIN: usize = 5;
/// Points shown of a cloud.
const POINTS: usize = 4000;
/// Half width, in standard deviations, of a band that holds 95 % of what is normally distributed.
const NORMAL_95: f64 = 1.96;

/// Where the missing drive lies, with 95 % confidence.
pub(super) fn estimate(clock: &Clock, train: &Signals, missing: &MissingDrive) -> Layer {
    let edge = |side: f64| -> Vec<(f64, f64)> {
        let at = |(i, x): (usize, &f64)| {
            (
                clock.axis(train.start_s + i as f64 * train.sample_time_s),
                x + side * NORMAL_95 * missing.deviation,
            )
        };
        missing.value.iter().enumerate().map(at).collect()
    };
    Layer::Band {
        lower: edge(-1.0),
        upper: edge(1.0),
        name: "95 % of the estimate".into(),
        colour: Colour::Sky,
    }
}

/// The missing drive and what is left of it.
pub(super) struct Cloud<'a> {
    pub missing: &'a [f64],
    pub left: Option<&'a [f64]>,
    pub label: &'a str,
    pub y_range: Option<(f64, f64)>,
}

impl Cloud<'_> {
    /// Samples of which one is drawn.
    pub fn every(&self) -> usize {
        (self.missing.len() / POINTS).max(1)
    }

    /// Against a signal of the same times.
    pub fn against(&self, x: &[f64], x_label: String) -> Panel {
        let cloud = x.iter().zip(self.missing).step_by(self.every()).map(|(x, d)| (*x, *d)).collect();
        let mut layers = Vec::new();
        if let Some(left) = self.left {
            let bins = binned(x, self.missing, left);
            let edge =
                |side: f64| bins.iter().map(|b| (b.x, b.explained + side * NORMAL_95 * b.scatter)).collect();
            layers.push(Layer::Band {
                lower: edge(-1.0),
                upper: edge(1.0),
                name: "95 % of samples".into(),
                colour: Colour::Sky,
            });
            layers.push(Layer::points("missing", Colour::Grey, Marker::Dot, cloud));
            let curve = bins.iter().map(|b| (b.x, b.explained)).collect();
            layers.push(Layer::line("explained", Colour::Blue, curve));
        } else {
            layers.push(Layer::points("missing", Colour::Grey, Marker::Dot, cloud));
        }
        let y_range = self.y_range;
        Panel { x_label, y_label: self.label.to_owned(), layers, y_range, ..Panel::default() }
    }
}

/// The range to show where a few values would hide the others: all but one in two hundred, and half as much again on both sides.
pub(super) fn usual(values: &[f64]) -> Option<(f64, f64)> {
    within(values, 4.0)
}

/// The same where all values span more than `most` times as much as the usual ones.
pub(super) fn within(values: &[f64], most: f64) -> Option<(f64, f64)> {
    let mut known: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    known.sort_by(f64::total_cmp);
    let few = known.len() / 400;
    let (least, low) = (*known.first()?, *known.get(few)?);
    let (greatest, high) = (*known.last()?, *known.get(known.len() - 1 - few)?);
    let span = high - low;
    (span > 0.0 && greatest - least > most * span).then_some((low - 0.5 * span, high + 0.5 * span))
}

/// Samples of about one x.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bin {
    /// Their mean x.
    x: f64,
    /// Mean of what is explained: missing minus left.
    explained: f64,
    /// Standard deviation of the missing drive about it.
    scatter: f64,
}

/// Bins of equal width over x; those with few samples are left out.
fn binned(x: &[f64], missing: &[f64], left: &[f64]) -> Vec<Bin> {
    let known = || x.iter().copied().filter(|x| x.is_finite());
    let (low, high) = known().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
    if deviation(x) == 0.0 || high <= low {
        return Vec::new();
    }
    let mut bins: Vec<Vec<(f64, f64, f64)>> = vec![Vec::new(); BINS];
    for ((x, missing), left) in x.iter().zip(missing).zip(left) {
        let at = ((x - low) / (high - low) * BINS as f64) as usize;
        if let Some(bin) = bins.get_mut(at.min(BINS - 1))
            && [x, missing, left].into_iter().all(|v| v.is_finite())
        {
            bin.push((*x, *missing, missing - left));
        }
    }
    let whole = bins.into_iter().filter(|bin| bin.len() >= LEAST_IN_BIN);
    whole
        .map(|bin| {
            let n = bin.len() as f64;
            let explained = bin.iter().map(|s| s.2).sum::<f64>() / n;
            let squared: f64 = bin.iter().map(|s| (s.1 - explained) * (s.1 - explained)).sum();
            Bin { x: bin.iter().map(|s| s.0).sum::<f64>() / n, explained, scatter: libm::sqrt(squared / n) }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A missing drive of 2x with scatter +-0.1, all of the slope explained.
    #[test]
    fn bins_hold_the_explained_mean_and_the_scatter_about_it() {
        let x: Vec<f64> = (0..1000).map(|i| f64::from(i) / 100.0).collect();
        let left: Vec<f64> = (0..1000).map(|i| if i % 2 == 0 { 0.1 } else { -0.1 }).collect();
        let missing: Vec<f64> = x.iter().zip(&left).map(|(x, l)| 2.0 * x + l).collect();
        let bins = binned(&x, &missing, &left);
        assert_eq!(bins.len(), BINS);
        for bin in bins {
            assert!((bin.explained - 2.0 * bin.x).abs() < 1e-9, "{bin:?}");
            // Within a bin the slope adds its own 2 * 0.25 / sqrt(12).
            assert!((bin.scatter - libm::hypot(0.1, 0.5 / libm::sqrt(12.0))).abs() < 0.02, "{bin:?}");
        }
    }
}
