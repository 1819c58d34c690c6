//! Figures 3 to 10. (1 and 2 are block diagrams, not results.)

mod residuals;
mod signals;
mod sweep;

use super::baseline::NominalRelation;
use super::detection::DetectionCase;
use super::settings::Settings;
use crate::Result;
use crate::plot::{Figure, Panel};

/// One of the paper's figures, ours.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plate {
    pub file: &'static str,
    pub name: &'static str,
    pub figure: Figure,
    /// What it shows, in a sentence or two with numbers.
    pub shows: String,
    /// What the paper says of its own, and how ours compares.
    pub published: String,
}

pub(super) fn plates(
    settings: &Settings,
    baseline: &NominalRelation,
    detection: &[DetectionCase],
) -> Result<Vec<Plate>> {
    let mut plates = vec![signals::figure_3(settings.seed)?, signals::figure_4(settings.seed)?];
    plates.extend(sweep::figure_5(settings.seed)?);
    plates.extend([signals::figure_6(settings.seed)?, signals::figure_7(settings.seed)?]);
    plates.extend(residuals::figures_8_to_10(baseline, detection));
    Ok(plates)
}

fn over_time(y_label: &str, layers: Vec<crate::plot::Layer>) -> Panel {
    Panel { y_label: y_label.into(), x_label: "t (s)".into(), layers, ..Panel::default() }
}
