//! Results as Parquet.

use std::sync::Arc;

use datafusion::arrow::array::{ArrayRef, RecordBatch, StringArray};
use datafusion::common::ScalarValue;
use datafusion::parquet::arrow::ArrowWriter;
use drift_sim::{Error, Result};

use crate::verdict::Verdict;

/// Verdicts as a Parquet file: the column `loop` and one for each field of a verdict, in the loops' order.
///
/// # Errors
/// It can't be written, which nothing is known to cause.
pub fn verdicts(loops: &[(String, Verdict)]) -> Result<Vec<u8>> {
    write(loops).map_err(|e| Error::new(format!("Parquet can't be written: {e}")))
}

fn write(loops: &[(String, Verdict)]) -> datafusion::error::Result<Vec<u8>> {
    let names: ArrayRef =
        Arc::new(loops.iter().map(|(name, _)| Some(name.as_str())).collect::<StringArray>());
    let mut columns = vec![("loop".to_owned(), names)];
    let of = if loops.is_empty() {
        ScalarValue::try_from(datafusion::arrow::datatypes::DataType::Struct(Verdict::fields()))?
            .to_array_of_size(0)?
    } else {
        let values = loops
            .iter()
            .map(|(_, verdict)| verdict.to_scalar())
            .collect::<datafusion::error::Result<Vec<_>>>()?;
        ScalarValue::iter_to_array(values)?
    };
    if let Some(of) = datafusion::arrow::array::AsArray::as_struct_opt(&of) {
        let named = of.fields().iter().map(|field| field.name().clone());
        columns.extend(named.zip(of.columns().iter().cloned()));
    }
    let batch = RecordBatch::try_from_iter(columns)?;
    let mut writer = ArrowWriter::try_new(Vec::new(), batch.schema(), None)?;
    writer.write(&batch)?;
    Ok(writer.into_inner()?)
}
