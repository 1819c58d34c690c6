//! What the user says about how recordings are read, in the words of the command's options.

use drift_sim::recording::{ReadOptions, When};
use drift_sim::{Error, Result};

/// What reading one recording may take here, bytes: well below what a browser gives a page.
const MEMORY_LIMIT_BYTES: u64 = 1 << 30;

/// The options of `drift`, as text; what is empty is not said.
#[derive(Debug, Clone, Default, PartialEq, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Asked {
    columns: String,
    sample_time: String,
    resample: String,
    when: Vec<String>,
    repeated: String,
    dates: String,
}

impl Asked {
    /// Reads the JSON that the page sends.
    ///
    /// # Errors
    /// It is none.
    pub fn parse(text: &str) -> Result<Self> {
        serde_json::from_str(text).map_err(|e| Error::new(format!("how to read it can't be read: {e}")))
    }

    /// The library's options; `incomplete` where y or u may be missing.
    ///
    /// # Errors
    /// One of them is not what is allowed.
    pub fn options(&self, incomplete: bool) -> Result<ReadOptions> {
        let mut options = ReadOptions {
            incomplete,
            memory_limit_bytes: Some(MEMORY_LIMIT_BYTES),
            ..ReadOptions::default()
        };
        if !self.columns.is_empty() {
            options.columns = self.columns.parse()?;
        }
        options.sample_time_s = seconds("sample time", &self.sample_time)?;
        options.resample_s = seconds("resampling step", &self.resample)?;
        options.when = self
            .when
            .iter()
            .filter(|when| !when.trim().is_empty())
            .map(|when| when.parse())
            .collect::<Result<Vec<When>>>()?;
        if !self.repeated.is_empty() {
            options.repeated = self.repeated.parse()?;
        }
        if !self.dates.is_empty() {
            options.date_order = Some(self.dates.parse()?);
        }
        Ok(options)
    }
}

fn seconds(what: &str, text: &str) -> Result<Option<f64>> {
    let text = text.trim();
    if text.is_empty() {
        return Ok(None);
    }
    let number = text.parse::<f64>().ok().filter(|s| s.is_finite() && *s > 0.0);
    number
        .map(Some)
        .ok_or_else(|| Error::new(format!("{what}: '{text}'")).allowed("a number of seconds above 0"))
}
