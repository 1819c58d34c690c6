//! How a recording is read: the keywords that every function takes which reads one, as the command's options are called.

use std::str::FromStr;

use drift_sim::recording::{ColumnMap, DateOrder, Part, ReadOptions, Repeated, TimeIn, When};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::error::raised;

/// The library's options, with these further columns.
///
/// # Errors
/// A keyword is unknown, or its value is of another type or not allowed.
pub fn options(keywords: Option<&Bound<'_, PyDict>>, extra: Vec<String>) -> PyResult<ReadOptions> {
    let mut options = ReadOptions { extra, ..ReadOptions::default() };
    for (name, value) in keywords.into_iter().flatten() {
        if value.is_none() {
            continue;
        }
        match name.cast::<PyString>()?.to_str()? {
            "columns" => options.columns = columns(&value)?,
            "sample_time_s" => options.sample_time_s = Some(value.extract()?),
            "resample_s" => options.resample_s = Some(value.extract()?),
            "when" => options.when = when(&value)?,
            "repeated" => options.repeated = word::<Repeated>(&value)?,
            "dates" => options.date_order = Some(word::<DateOrder>(&value)?),
            "time_in" => options.time_in = Some(word::<TimeIn>(&value)?),
            "part" => options.part = Some(part(&value)?),
            "memory_limit_bytes" => options.memory_limit_bytes = Some(value.extract()?),
            other => return Err(PyTypeError::new_err(format!("unknown keyword '{other}'"))),
        }
    }
    Ok(options)
}

/// A number, or `"last"`.
fn part(value: &Bound<'_, PyAny>) -> PyResult<Part> {
    value.str()?.to_str()?.parse().map_err(raised)
}

fn word<T: FromStr<Err = drift_sim::Error>>(value: &Bound<'_, PyAny>) -> PyResult<T> {
    value.extract::<String>()?.parse().map_err(raised)
}

/// `"t=time,y=PV"`, or the same as a dict; None in it says that there are no time stamps, or no reference.
fn columns(value: &Bound<'_, PyAny>) -> PyResult<ColumnMap> {
    let Ok(named) = value.cast::<PyDict>() else { return word(value) };
    let pairs = named.iter().map(|(signal, column)| {
        let column = if column.is_none() { String::new() } else { column.extract()? };
        Ok((signal.extract::<String>()?, column))
    });
    ColumnMap::of(pairs.collect::<PyResult<Vec<_>>>()?).map_err(raised)
}

/// One condition, or several.
fn when(value: &Bound<'_, PyAny>) -> PyResult<Vec<When>> {
    let texts = match value.extract::<String>() {
        Ok(one) => vec![one],
        Err(_) => value
            .extract::<Vec<String>>()
            .map_err(|_| PyValueError::new_err("when is a condition like 'mode=AUTO', or a list of them"))?,
    };
    texts.iter().map(|text| text.parse().map_err(raised)).collect()
}
