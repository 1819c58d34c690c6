//! A recording as pages show it: its signals, its file and the clock that it tells the time by.

use std::path::PathBuf;

use crate::Result;
use crate::control_loop::Loop;
use crate::diagnosed::Read;
use crate::plot::{Colour, Layer};
use crate::sentences::{Clock, plain};

use crate::estimate::signals::Signals;

/// A recording, and what it is called.
#[derive(Debug, Clone)]
pub struct Shown {
    /// Its file, as the user wrote it.
    pub file: PathBuf,
    /// Its signals.
    pub signals: Signals,
    /// How it tells the time.
    pub clock: Clock,
}

impl Shown {
    /// The signals that a loop has in a recording.
    ///
    /// # Errors
    /// A column is missing, the recording is too short, or nothing in it moves.
    pub fn of(read: &Read, model: &Loop) -> Result<Self> {
        let signals = Signals::new(&read.recording, model)?;
        Ok(Self { file: read.file.clone(), signals, clock: read.recording.clock() })
    }

    /// The file's own name.
    pub fn name(&self) -> String {
        self.file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    }

    /// A line of values, one a sample from the first on.
    pub fn line(&self, name: &str, colour: Colour, values: &[f64]) -> Layer {
        let (start, every) = (self.signals.start_s, self.signals.sample_time_s);
        Layer::signal(name, colour, self.clock.axis(start), self.clock.axis_length(every), values)
    }

    /// File, samples and sample time in words.
    pub fn says(&self) -> String {
        let (samples, every) = (self.signals.len() as f64, self.signals.sample_time_s);
        format!("{}, {} samples, one every {} s", self.file.display(), plain(samples, 9), plain(every, 4))
    }
}
