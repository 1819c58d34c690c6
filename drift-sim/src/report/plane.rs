//! A channel's plane: the healthy line with its bands, the windows, and the line as it moved.

use drift_core::{Baseline, Channel, ChannelKind, FaultCurve, Index};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use crate::plot::{Colour, Layer, Marker, Panel};

/// Points of a curved band's edge.
const EDGE: usize = 80;
/// Room beside the windows, part of their range.
const ROOM: f64 = 0.05;

/// Windows that look the same.
#[derive(Debug, Clone, PartialEq)]
pub struct Cloud {
    /// In the legend.
    pub name: String,
    /// Of the points.
    pub colour: Colour,
    /// Their shape.
    pub marker: Marker,
    /// x and value.
    pub points: Vec<(f64, f64)>,
}

/// A line refitted on windows that left the baseline.
#[derive(Debug, Clone, PartialEq)]
pub struct Moved {
    /// In the legend.
    pub name: String,
    /// The line.
    pub curve: FaultCurve,
}

/// What a channel's axes are called: x and value, with their units in words (`u` stands for the unit of u).
pub fn axis_names(kind: ChannelKind) -> (&'static str, &'static str) {
    let meaning = kind.meaning();
    (meaning.x_axis, (meaning.value_axis)(kind.index().unwrap_or(Index::Iae)))
}

/// The plane of one channel. Bands are drawn where it has a baseline.
pub fn plane(channel: &Channel, clouds: Vec<Cloud>, moved: &[Moved]) -> Panel {
    let (x_label, y_label) = axis_names(channel.kind);
    // Such a relation is a line only of what these leave.
    let less = match (channel.memory.order > 0, channel.operating_point.counts()) {
        (false, false) => "",
        (true, false) => ", less what earlier windows carry over",
        (false, true) => ", less what the operating point adds",
        (true, true) => ", less what earlier windows and the operating point add",
    };
    let y_label = format!("{y_label}{less}");
    let baseline = &channel.baseline;
    let mut layers = Vec::new();
    let range = x_range(baseline, &clouds);
    if let Some(range) = range.filter(|_| baseline.sigma > 0.0) {
        let band = |name: &str, colour, own: f64| {
            let edge = |side: f64| edge(baseline, range, own, side);
            Layer::Band { lower: edge(-1.0), upper: edge(1.0), name: name.into(), colour }
        };
        layers.push(band("95 % of healthy windows", Colour::Sky, 1.0));
        layers.push(band("95 % confidence of the line", Colour::Blue, 0.0));
    }
    layers.extend(
        clouds
            .into_iter()
            .filter(|c| !c.points.is_empty())
            .map(|c| Layer::points(c.name, c.colour, c.marker, c.points)),
    );
    if let Some((low, high)) = range {
        let line = |b0: f32, b1: f32| {
            let at = |x: f64| (x, f64::from(b0) + f64::from(b1) * x);
            vec![at(low), at(high)]
        };
        if baseline.sigma > 0.0 {
            layers.push(Layer::line("healthy line", Colour::Blue, line(baseline.b0, baseline.b1)));
        }
        for (i, moved) in moved.iter().enumerate() {
            let colour = if i == 0 { Colour::Vermilion } else { Colour::Purple };
            layers.push(Layer::dashed(moved.name.clone(), colour, line(moved.curve.b0, moved.curve.b1)));
        }
    }
    Panel {
        title: channel.kind.name().replace('_', " "),
        x_label: x_label.into(),
        y_label,
        layers,
        ..Panel::default()
    }
}

/// All x of the windows, and what calibration saw.
fn x_range(baseline: &Baseline, clouds: &[Cloud]) -> Option<(f64, f64)> {
    let known = [baseline.x_min, baseline.x_max].map(f64::from).into_iter();
    // An unlearnt baseline spans all numbers.
    let known = known.filter(|x| x.abs() < 0.5 * f64::from(f32::MAX));
    let points = clouds.iter().flat_map(|c| &c.points).map(|p| p.0).filter(|x| x.is_finite());
    let (low, high) =
        known.chain(points).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    let room = ROOM * (high - low);
    (low < high).then_some((low - room, high + room))
}

/// One edge of a band: of the line alone (`own` 0), or of single windows (`own` 1), as drift-core standardises them.
fn edge(baseline: &Baseline, (low, high): (f64, f64), own: f64, side: f64) -> Vec<(f64, f64)> {
    let [b0, b1, sigma, windows, mean, ss] =
        [baseline.b0, baseline.b1, baseline.sigma, baseline.windows, baseline.x_mean, baseline.x_ss]
            .map(f64::from);
    let factor = quantile(windows);
    let at = |x: f64| {
        let of_mean = if windows > 0.0 { 1.0 / windows } else { 0.0 };
        let of_slope = if ss > 0.0 { (x - mean) * (x - mean) / ss } else { 0.0 };
        b0 + b1 * x + side * factor * sigma * libm::sqrt(own + of_mean + of_slope)
    };
    (0..=EDGE).map(|i| low + (high - low) * i as f64 / EDGE as f64).map(|x| (x, at(x))).collect()
}

/// The 97.5 % point: Student's for so many windows, the normal one where the line is taken as known.
fn quantile(windows: f64) -> f64 {
    let exact = || Normal::standard().inverse_cdf(0.975);
    if windows > 0.0 {
        StudentsT::new(0.0, 1.0, (windows - 2.0).max(1.0)).map_or_else(|_| exact(), |t| t.inverse_cdf(0.975))
    } else {
        exact()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::regression::fit;

    /// The calibration's own bands, where all windows are independent.
    #[test]
    fn the_bands_are_the_regressions() {
        let x: Vec<f64> = (0..50).map(f64::from).collect();
        let y: Vec<f64> = x.iter().map(|x| 2.0 + 0.5 * x + (7.0 * x).sin()).collect();
        let fit = fit(&x, &y, 0).unwrap();
        let baseline = Baseline {
            b0: fit.b0 as f32,
            b1: fit.b1 as f32,
            sigma: fit.rmse as f32,
            windows: 50.0,
            x_mean: fit.x_mean as f32,
            x_ss: fit.x_ss as f32,
            x_min: 0.0,
            x_max: 49.0,
        };
        for (own, side) in [(0.0, 0), (1.0, 1)] {
            for (x, upper) in edge(&baseline, (0.0, 49.0), own, 1.0) {
                let band = if side == 0 { fit.confidence_band(x) } else { fit.prediction_band(x) };
                approx::assert_relative_eq!(upper, band[1], max_relative = 1e-5);
            }
        }
    }
}
