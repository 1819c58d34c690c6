//! What the monitor says of one loop in the end, as Rust and as a value of the query engine.

use std::sync::Arc;

use datafusion::arrow::array::{Array, AsArray, StructArray};
use datafusion::arrow::datatypes::{DataType, Field, Fields, Float32Type, Float64Type, Int64Type};
use datafusion::common::ScalarValue;
use datafusion::error::{DataFusionError, Result};

/// How severe a loop's state is, in falling order: what a plant looks at first.
pub const STATUSES: [&str; 7] =
    ["drift", "suspect", "disturbance", "error", "no_baseline", "not_judged", "healthy"];

/// One loop's verdict.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Verdict {
    /// One of [`STATUSES`].
    pub status: String,
    /// Since when the worst event lasts, s on the recording's clock.
    pub since_s: Option<f64>,
    /// The channel that went farthest in it: energy_error, effort, motion_effort, activity.
    pub channel: Option<String>,
    /// To which side: high or low.
    pub side: Option<String>,
    /// How far, sigmas.
    pub max_z: Option<f64>,
    /// Events of all kinds.
    pub events: i64,
    /// Samples, valid or not.
    pub samples: i64,
    /// Hours watched.
    pub hours: f64,
    /// More than healthy, per cent: error, effort, energy ([`crate::costs`]).
    pub costs: [Option<f64>; 3],
    /// One sentence for a person; of an error, what is wrong.
    pub answer: String,
    /// The residual of the channel that went farthest over the run, sigmas, thinned to at most [`PICTURE`] values.
    pub picture: Vec<f32>,
    /// The last line of `drift monitor --json` on the same samples, without its end of line; `None` of what was not monitored.
    pub summary: Option<String>,
}

/// Values of a picture at most.
pub const PICTURE: usize = 60;

impl Verdict {
    /// A loop that was not monitored, and why.
    pub fn without(status: &str, why: String) -> Self {
        Self { status: status.to_owned(), answer: why, ..Self::default() }
    }

    /// Where it stands among [`STATUSES`]; those after them last.
    pub fn severity(&self) -> usize {
        STATUSES.iter().position(|name| *name == self.status).unwrap_or(STATUSES.len())
    }

    /// The greatest of its costs, either way, per cent.
    pub fn cost(&self) -> f64 {
        self.costs.iter().flatten().map(|x| x.abs()).fold(0.0, f64::max)
    }

    /// The fields of the value.
    pub fn fields() -> Fields {
        let number = |name: &str| Field::new(name, DataType::Float64, true);
        let text = |name: &str| Field::new(name, DataType::Utf8, true);
        let whole = |name: &str| Field::new(name, DataType::Int64, true);
        let of_picture = Arc::new(Field::new("item", DataType::Float32, true));
        Fields::from(vec![
            text("status"),
            number("since_s"),
            text("channel"),
            text("side"),
            number("max_z"),
            whole("events"),
            whole("samples"),
            number("hours"),
            number("error_percent"),
            number("effort_percent"),
            number("energy_percent"),
            text("answer"),
            Field::new("picture", DataType::List(of_picture), true),
            text("summary"),
        ])
    }

    /// As a value of the query engine.
    pub fn to_scalar(&self) -> Result<ScalarValue> {
        let [error, effort, energy] = self.costs;
        let picture: Vec<ScalarValue> = self.picture.iter().map(|x| ScalarValue::Float32(Some(*x))).collect();
        let values = [
            ScalarValue::Utf8(Some(self.status.clone())),
            ScalarValue::Float64(self.since_s),
            ScalarValue::Utf8(self.channel.clone()),
            ScalarValue::Utf8(self.side.clone()),
            ScalarValue::Float64(self.max_z),
            ScalarValue::Int64(Some(self.events)),
            ScalarValue::Int64(Some(self.samples)),
            ScalarValue::Float64(Some(self.hours)),
            ScalarValue::Float64(error),
            ScalarValue::Float64(effort),
            ScalarValue::Float64(energy),
            ScalarValue::Utf8(Some(self.answer.clone())),
            ScalarValue::List(ScalarValue::new_list_nullable(&picture, &DataType::Float32)),
            ScalarValue::Utf8(self.summary.clone()),
        ];
        let columns = values.iter().map(ScalarValue::to_array).collect::<Result<Vec<_>>>()?;
        Ok(ScalarValue::Struct(Arc::new(StructArray::try_new(Self::fields(), columns, None)?)))
    }

    /// Of one row of a column of verdicts.
    ///
    /// # Errors
    /// The column holds something else.
    pub fn from_row(verdicts: &StructArray, row: usize) -> Result<Self> {
        let column = |name: &str| {
            verdicts
                .column_by_name(name)
                .ok_or_else(|| DataFusionError::Execution(format!("a verdict has no field '{name}'")))
        };
        let text = |name: &str| -> Result<Option<String>> {
            let values = column(name)?.as_string_opt::<i32>();
            Ok(values.filter(|v| v.is_valid(row)).map(|v| v.value(row).to_owned()))
        };
        let number = |name: &str| -> Result<Option<f64>> {
            let values = column(name)?.as_primitive_opt::<Float64Type>();
            Ok(values.filter(|v| v.is_valid(row)).map(|v| v.value(row)))
        };
        let whole = |name: &str| -> Result<i64> {
            let values = column(name)?.as_primitive_opt::<Int64Type>();
            Ok(values.filter(|v| v.is_valid(row)).map_or(0, |v| v.value(row)))
        };
        let picture =
            column("picture")?.as_list_opt::<i32>().filter(|v| v.is_valid(row)).map(|v| v.value(row));
        let picture = picture.as_ref().and_then(|v| v.as_primitive_opt::<Float32Type>());
        Ok(Self {
            status: text("status")?.unwrap_or_default(),
            since_s: number("since_s")?,
            channel: text("channel")?,
            side: text("side")?,
            max_z: number("max_z")?,
            events: whole("events")?,
            samples: whole("samples")?,
            hours: number("hours")?.unwrap_or(0.0),
            costs: [number("error_percent")?, number("effort_percent")?, number("energy_percent")?],
            answer: text("answer")?.unwrap_or_default(),
            picture: picture.map_or_else(Vec::new, |v| v.values().to_vec()),
            summary: text("summary")?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_comes_back_from_the_query_engine_as_it_went_in() {
        let verdict = Verdict {
            status: "drift".into(),
            since_s: Some(3.5),
            channel: Some("effort".into()),
            side: Some("high".into()),
            max_z: Some(7.0),
            events: 2,
            samples: 1000,
            hours: 0.5,
            costs: [Some(1.0), None, Some(-3.0)],
            answer: "it drifts".into(),
            picture: vec![0.0, 1.5],
            summary: Some("{}".into()),
        };
        for verdict in [verdict, Verdict::without("error", "why".into())] {
            let ScalarValue::Struct(value) = verdict.to_scalar().unwrap() else { panic!("a struct") };
            assert_eq!(Verdict::from_row(&value, 0).unwrap(), verdict);
        }
    }
}
