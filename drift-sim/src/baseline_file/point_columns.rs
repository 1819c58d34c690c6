//! `[operating_point]`: which measured columns make the monitor's one number, `point = sum of scale*column`. The scales bring
//! all columns to the unit of that with the largest effect, whose own scale is 1.

use serde::{Deserialize, Serialize};

use super::BaselineFile;
use crate::{Error, Result};

/// Most columns.
pub const MOST_COLUMNS: usize = 3;

/// The columns and their scales, as many of each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointColumns {
    /// The recording's columns.
    pub columns: Vec<String>,
    /// What each is multiplied by.
    pub scales: Vec<f32>,
}

impl BaselineFile {
    /// The columns that the baseline depends on, under the names that they have in a recording: `asked` in the baseline's order,
    /// or its own.
    ///
    /// # Errors
    /// Other than as many names as the baseline has columns.
    pub fn point_columns(&self, asked: &[String]) -> Result<Option<PointColumns>> {
        let Some(point) = &self.operating_point else {
            return match asked {
                [] => Ok(None),
                _ => Err(Error::new("--operating-point: the baseline was learnt without any")
                    .allowed("a baseline of `drift calibrate --operating-point`")),
            };
        };
        if asked.is_empty() {
            return Ok(Some(point.clone()));
        }
        if asked.len() != point.columns.len() {
            return Err(Error::new(format!("--operating-point names {} columns", asked.len()))
                .allowed(format!("as many as the baseline's: {}", point.columns.join(", "))));
        }
        Ok(Some(PointColumns { columns: asked.to_vec(), scales: point.scales.clone() }))
    }
}

impl PointColumns {
    /// The monitor's number; NaN where a column is missing.
    pub fn point(&self, columns: &[f64]) -> f32 {
        let all = columns.len() == self.scales.len();
        let sum: f64 = self.scales.iter().zip(columns).map(|(scale, x)| f64::from(*scale) * x).sum();
        if all { sum as f32 } else { f32::NAN }
    }

    pub(super) fn check(&self) -> Result<()> {
        let count = self.columns.len();
        if !(1..=MOST_COLUMNS).contains(&count) || self.scales.len() != count {
            return Err(Error::new(format!(
                "operating_point has {count} columns and {} scales",
                self.scales.len()
            ))
            .allowed(format!("1 to {MOST_COLUMNS} columns, a scale for each")));
        }
        if !self.scales.iter().all(|scale| scale.is_finite()) {
            return Err(Error::new("a scale of the operating_point is not finite"));
        }
        Ok(())
    }
}
