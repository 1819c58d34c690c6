//! What a plan takes from the JSON of a diagnosis: the causes that are left, with their numbers.

use std::path::Path;

use serde_json::Value;

use super::recorded::Recorded;
use crate::control_loop::Loop;
use crate::diagnose::cause::{Cause, CauseNoise};
use crate::physics::Term;
use crate::{Error, Result, text_file};

/// The document's schema.
const SCHEMA: &str = "drift.diagnosis/1";

/// A diagnosis that left something open.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenDiagnosis {
    /// Its verdict.
    pub verdict: String,
    /// The causes that are left and those that came next; that nothing is missing is one of them.
    pub causes: Vec<Cause>,
    /// The recording.
    pub recorded: Recorded,
}

/// More than any diagnosis; a recording given by mistake is refused before it is parsed.
const LARGEST_MEGABYTES: u64 = 50;

impl OpenDiagnosis {
    /// From a file that `drift diagnose --json` wrote.
    ///
    /// # Errors
    /// It can't be read, or as [`OpenDiagnosis::parse`].
    pub fn read(path: &Path) -> Result<Self> {
        let text = text_file::read(path, "a diagnosis", LARGEST_MEGABYTES)?;
        Self::parse(&text).map_err(|e| e.in_file(path))
    }

    /// From the text of a diagnosis' JSON.
    ///
    /// # Errors
    /// It is no diagnosis, lacks its causes or a number of them.
    pub fn parse(text: &str) -> Result<Self> {
        let document: Value = serde_json::from_str(text).map_err(|e| {
            let line = u64::try_from(e.line()).unwrap_or(u64::MAX);
            Error::new("not JSON").allowed("what drift diagnose --json writes").at_line(line)
        })?;
        let schema = document.get("schema").and_then(Value::as_str);
        if schema != Some(SCHEMA) {
            return Err(Error::new(format!(
                "schema {}",
                schema.map_or("missing".into(), |s| format!("'{s}'"))
            ))
            .allowed(format!("'{SCHEMA}', as drift diagnose --json writes it")));
        }
        let Some(verdict) = document.get("verdict").and_then(Value::as_str) else {
            return Err(Error::new("verdict is missing").allowed("a document of drift diagnose --json"));
        };
        let recorded = document.get("recorded").map(Recorded::from_json);
        let missing = || {
            Error::new("the diagnosis has no numbers of its causes").allowed(
                "a diagnosis of this drift, by its likelihood; give --loop, or a recording that moves more",
            )
        };
        let causes = document.get("causes").and_then(Value::as_array).ok_or_else(missing)?;
        let causes = causes.iter().map(cause).collect::<Result<Vec<_>>>()?;
        let open = Self { verdict: verdict.into(), causes, recorded: recorded.ok_or_else(missing)?? };
        let left = open.causes.iter().filter(|cause| cause.is_left).count();
        match (verdict, left) {
            ("no_mismatch" | "parameters", _) => {
                Err(Error::new(format!("the diagnosis says {verdict}: there is nothing to tell apart"))
                    .allowed("located, undecided, or missing_physics with kinds that can't be told from it"))
            }
            (_, 0 | 1) if open.causes.is_empty() => Err(missing()),
            (_, 0 | 1) => Err(Error::new("the diagnosis leaves one cause: there is nothing to tell apart")
                .allowed("located, undecided, or missing_physics with kinds that can't be told from it")),
            _ => Ok(open),
        }
    }
}

fn cause(document: &Value) -> Result<Cause> {
    let number = |key: &str| {
        let value = document.get(key).and_then(Value::as_f64);
        value.ok_or_else(|| Error::new(format!("a cause lacks {key}")).allowed("a number"))
    };
    let text = document.get("loop").and_then(Value::as_str);
    let text = text.ok_or_else(|| Error::new("a cause lacks its loop").allowed("the text of a loop file"))?;
    Ok(Cause {
        term: document.get("physics").filter(|physics| !physics.is_null()).map(term).transpose()?,
        model: Loop::parse(text, "a cause's loop")?,
        constant_load: number("constant_load")?,
        gain: number("gain")?,
        is_left: document.get("left").and_then(Value::as_bool).unwrap_or(false),
        noise: CauseNoise {
            sensor_sd: number("sensor_sd")?,
            sensor_rho: number("sensor_rho")?,
            load_sd: number("load_sd")?,
            load_tau_s: number("load_tau_s")?,
        },
    })
}

fn term(document: &Value) -> Result<Term> {
    let wrong = |what: &str| {
        Error::new(format!("a cause's physics lacks {what}")).allowed("as drift diagnose --json writes it")
    };
    let kind = document.get("kind").and_then(Value::as_str).ok_or_else(|| wrong("its kind"))?;
    let onset_s = document.get("onset_s").and_then(Value::as_f64).ok_or_else(|| wrong("onset_s"))?;
    let numbers =
        document.get("parameters").and_then(Value::as_object).ok_or_else(|| wrong("its numbers"))?;
    let numbers: Option<Vec<(&str, f64)>> =
        numbers.iter().map(|(name, value)| Some((name.as_str(), value.as_f64()?))).collect();
    let term = Term::new(kind, &numbers.ok_or_else(|| wrong("a number"))?)?.from_s(onset_s);
    term.check()?;
    Ok(term)
}
