//! `drift_baseline(loop, t, r, y, u [, 'NAME', column]... ORDER BY t)`: learns a loop's baseline from its healthy rows, by the calibration of
//! `drift calibrate`, and gives its text.
//!
//! Calibration needs a recording whole. Of each loop the first [`Request::most_samples`] are taken, so that memory doesn't grow with the data: a
//! baseline is learnt from hours or days, not from years.

use std::sync::{Mutex, PoisonError};

use datafusion::arrow::array::{Array, ArrayRef};
use datafusion::arrow::datatypes::{DataType, Field, FieldRef};
use datafusion::common::ScalarValue;
use datafusion::error::Result;
use datafusion::logical_expr::function::{AccumulatorArgs, StateFieldsArgs};
use datafusion::logical_expr::{Accumulator, AggregateUDFImpl, Signature, Volatility};
use drift_sim::calibrate::{self, Options, Signals};
use drift_sim::recording::RowState;

use crate::cells::text_at;
use crate::loop_rows::{self, LoopRows};

/// Its name in SQL.
pub const NAME: &str = "drift_baseline";

/// What begins the text where a loop could not be calibrated; the reason follows. No baseline begins so.
pub const REFUSED: &str = "error: ";

/// What a held sample takes, bytes.
const ROW_BYTES: usize = 25;

/// What is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// As of `drift calibrate`.
    pub options: Options,
    /// Samples of a loop that are taken at most.
    pub most_samples: usize,
}

impl Default for Request {
    fn default() -> Self {
        Self { options: Options::default(), most_samples: 1_000_000 }
    }
}

/// The aggregate.
#[derive(Debug, Clone)]
pub struct DriftBaseline {
    signature: Signature,
    request: Request,
    /// The request in words, by which two of them are told apart.
    key: String,
}

impl PartialEq for DriftBaseline {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}

impl Eq for DriftBaseline {}

impl std::hash::Hash for DriftBaseline {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.key.hash(state);
    }
}

impl DriftBaseline {
    /// For this request.
    pub fn new(request: Request) -> Self {
        let key = format!("{request:?}");
        Self { signature: Signature::variadic_any(Volatility::Stable), request, key }
    }
}

impl AggregateUDFImpl for DriftBaseline {
    fn name(&self) -> &str {
        NAME
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn return_type(&self, arguments: &[DataType]) -> Result<DataType> {
        loop_rows::check(NAME, &[], arguments)?;
        Ok(DataType::Utf8)
    }

    fn accumulator(&self, _: AccumulatorArgs) -> Result<Box<dyn Accumulator>> {
        Ok(Box::new(Learner { request: self.request.clone(), healthy: None, ended: None, held_bytes: 0 }))
    }

    fn state_fields(&self, args: StateFieldsArgs) -> Result<Vec<FieldRef>> {
        Ok(vec![Field::new(format!("{}[text]", args.name), DataType::Utf8, true).into()])
    }
}

/// Collects one loop.
struct Learner {
    request: Request,
    /// Never used from two threads at once; the engine wants to share it all the same.
    healthy: Option<Mutex<Healthy>>,
    /// Why there will be no baseline, or what another partition has learnt.
    ended: Option<String>,
    held_bytes: usize,
}

impl std::fmt::Debug for Learner {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Learner").field("ended", &self.ended).finish_non_exhaustive()
    }
}

/// A loop's healthy rows.
struct Healthy {
    rows: LoopRows,
    r: Vec<f64>,
    y: Vec<f64>,
    u: Vec<f64>,
    state: Vec<RowState>,
}

impl Healthy {
    fn begin(values: &[ArrayRef]) -> Result<Self> {
        let rows = LoopRows::begin(values)?;
        Ok(Self { rows, r: Vec::new(), y: Vec::new(), u: Vec::new(), state: Vec::new() })
    }

    fn take(&mut self, most: usize) -> drift_sim::Result<()> {
        while self.r.len() < most
            && let Some(sample) = self.rows.fed.next()?
        {
            self.r.push(sample.r);
            self.y.push(sample.y);
            self.u.push(sample.u);
            self.state.push(sample.state);
        }
        Ok(())
    }

    fn learn(mut self, request: &Request) -> drift_sim::Result<String> {
        self.rows.fed.finish()?;
        self.take(request.most_samples)?;
        let sample_time_s =
            self.rows.fed.stream().map_or(f64::NAN, drift_sim::recording::RecordingStream::sample_time_s);
        let signals = Signals {
            name: &self.rows.name,
            sample_time_s,
            r: &self.r,
            y: &self.y,
            u: &self.u,
            state: Some(&self.state),
            further: &[],
        };
        let learnt = calibrate::calibrate(&[signals], &request.options);
        Ok(learnt.map_err(|e| e.in_file(&self.rows.name))?.file.to_toml())
    }
}

impl Learner {
    fn end(&mut self) -> Option<String> {
        if let Some(text) = self.ended.take() {
            return Some(text);
        }
        let healthy = self.healthy.take()?.into_inner().unwrap_or_else(PoisonError::into_inner);
        Some(healthy.learn(&self.request).unwrap_or_else(|error| format!("{REFUSED}{error}")))
    }
}

impl Accumulator for Learner {
    fn update_batch(&mut self, values: &[ArrayRef]) -> Result<()> {
        if values.first().is_none_or(|v| v.is_empty()) || self.ended.is_some() {
            return Ok(());
        }
        let healthy = match &mut self.healthy {
            Some(healthy) => healthy,
            none => none.insert(Mutex::new(Healthy::begin(values)?)),
        };
        let healthy = healthy.get_mut().unwrap_or_else(PoisonError::into_inner);
        if healthy.r.len() >= self.request.most_samples {
            return Ok(());
        }
        let rows = healthy.rows.piece(values)?;
        let taken = healthy.rows.fed.push(rows).and_then(|()| healthy.take(self.request.most_samples));
        self.held_bytes = ROW_BYTES * healthy.r.capacity();
        if let Err(error) = taken {
            self.ended = Some(format!("{REFUSED}{error}"));
            self.healthy = None;
        }
        Ok(())
    }

    fn evaluate(&mut self) -> Result<ScalarValue> {
        Ok(ScalarValue::Utf8(self.end()))
    }

    fn size(&self) -> usize {
        size_of::<Self>() + self.held_bytes
    }

    fn state(&mut self) -> Result<Vec<ScalarValue>> {
        Ok(vec![ScalarValue::Utf8(self.end())])
    }

    fn merge_batch(&mut self, states: &[ArrayRef]) -> Result<()> {
        let Some(texts) = states.first() else { return Ok(()) };
        for row in (0..texts.len()).filter(|row| texts.is_valid(*row)) {
            if self.ended.is_some() || self.healthy.is_some() {
                return Err(loop_rows::in_two_partitions(NAME));
            }
            self.ended = Some(text_at(texts, row)?);
        }
        Ok(())
    }
}
