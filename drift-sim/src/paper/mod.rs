//! The paper, reproduced: every table and figure, ours beside the published value, and what lies beyond.
//!
//! The loop is the simulator's ([`crate::simulate`]), the indices and detectors are those of [`drift_core::Monitor`], the
//! same that run on a controller. What the paper leaves open stands in [`settings`] and on the page.
//!
//! * [`eigenvalues`]: equation 13. [`ranking`]: Table 1. [`baseline`]: section 6.2. [`detection`]: section 6.3.
//! * [`overlap`]: why textbook thresholds alarm on the paper's windows, and two ways to mend it.
//! * [`delay`]: beyond the paper, detection delay channel by channel at equal false-alarm rate.
//! * `figures`, `page`, `differences`, `json`: what is written.

pub mod baseline;
mod charts;
pub mod delay;
pub mod detection;
mod differences;
pub mod eigenvalues;
mod figures;
mod healthy;
mod json;
mod line;
mod number;
pub mod overlap;
mod page;
pub mod published;
pub mod ranking;
pub mod settings;
pub mod spread;
mod summary;
mod windows;

use std::path::Path;

pub use settings::Settings;

use crate::output::{self, Outputs};
use crate::report::Page;
use crate::{Error, Result};
use figures::Plate;
use settings::Use;

/// All that was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Paper {
    /// What it was made with.
    pub settings: Settings,
    /// The plant's eigenvalues (equation 13), real and imaginary parts, 1/s.
    pub eigenvalues: Vec<(f64, f64)>,
    /// Table 1, first under the reading used, then under the others.
    pub rankings: Vec<ranking::Ranking>,
    /// The nominal relation between control energy and error (section 6.2).
    pub baseline: baseline::NominalRelation,
    /// Detection of three injected drifts (section 6.3).
    pub detection: Vec<detection::DetectionCase>,
    /// False alarms on healthy data.
    pub overlap: overlap::Overlap,
    /// Detection delays channel by channel at equal false-alarm rate; not in the paper.
    pub delay: delay::DelayStudy,
    plates: Vec<Plate>,
}

impl Paper {
    /// Does everything; `step` is called [`Settings::steps`] times, from any thread. The same settings give the same
    /// bytes on any number of threads.
    ///
    /// # Errors
    /// Fewer than two repeats or runs of any kind, or streams shorter than 100 s.
    pub fn reproduce(settings: &Settings, step: &(dyn Fn() + Sync)) -> Result<Self> {
        check(settings)?;
        let readings = std::iter::once(&ranking::READING).chain(&ranking::OTHER_READINGS);
        let rankings =
            readings.map(|reading| ranking::ranking(reading, settings.seed)).collect::<Result<_>>()?;
        let baseline = baseline::nominal_relation(settings, step)?;
        let detection = detection::detection(settings)?;
        let plates = figures::plates(settings, &baseline, &detection)?;
        let calibration = healthy::streams(Use::Calibration, settings, step)?;
        let verification = healthy::streams(Use::Verification, settings, step)?;
        Ok(Self {
            settings: *settings,
            eigenvalues: eigenvalues::eigenvalues()?,
            rankings,
            baseline,
            detection,
            overlap: overlap::overlap(settings, &calibration, &verification, step)?,
            delay: delay::delay_study(settings, &calibration, &verification, step)?,
            plates,
        })
    }

    /// The figures' file names.
    pub fn figure_files(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.plates.iter().map(|plate| plate.file)
    }

    /// The main findings in a few lines, for a terminal.
    pub fn summary(&self) -> String {
        summary::summary(self)
    }

    /// `paper.json` as text.
    pub fn to_json(&self) -> String {
        json::text(self)
    }

    /// The report of it all; `command` is the command line.
    pub fn page(&self, command: String) -> Page {
        page::page(self, command)
    }

    /// Writes the figures, `paper.html` and `paper.json` into a folder, which is made if it is missing: all of them or none.
    ///
    /// # Errors
    /// The folder or a file can't be written.
    pub fn write(&self, folder: &Path, command: String) -> Result<()> {
        output::own_folder(folder, &FILES)?;
        let mut outputs = Outputs::default();
        for plate in &self.plates {
            outputs.write_text(&folder.join(plate.file), &plate.figure.to_svg()?)?;
        }
        outputs.write_text(&folder.join("paper.json"), &self.to_json())?;
        outputs.write_text(&folder.join("paper.html"), &self.page(command).to_html()?)?;
        outputs.commit()
    }
}

/// What [`Paper::write`] writes.
pub const FILES: [&str; 14] = [
    "paper.html",
    "paper.json",
    "fig03.svg",
    "fig04.svg",
    "fig05a.svg",
    "fig05b.svg",
    "fig06.svg",
    "fig07.svg",
    "fig08a.svg",
    "fig08b.svg",
    "fig09a.svg",
    "fig09b.svg",
    "fig10a.svg",
    "fig10b.svg",
];

fn check(settings: &Settings) -> Result<()> {
    let counts = [settings.repeats, settings.healthy_runs, settings.streams, settings.delay_runs];
    if counts.iter().any(|n| *n < 2) || settings.stream_s < 100 {
        return Err(Error::new("too few runs").allowed("at least 2 of each kind, streams of at least 100 s"));
    }
    Ok(())
}
