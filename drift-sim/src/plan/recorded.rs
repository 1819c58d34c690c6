//! Where a recording has left its loop, and what the loop was asked for in it: what a plan starts from and keeps to.

use serde_json::{Value, json};

use crate::estimate::signals::{Signals, range};
use crate::{Error, Result};

/// A recording in a few numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// Length, in seconds.
    pub duration_s: f64,
    /// r at its end.
    pub r: f64,
    /// u at its end, in the mean over its last part.
    pub u: f64,
    /// The least and the greatest r.
    pub r_range: [f64; 2],
    /// The fastest change of r, per second; 0 where r never moved.
    pub r_rate: f64,
    /// All of r, as values with the samples that each was held for.
    pub reference: Vec<(f64, usize)>,
}

/// Part of the recording over which the last u is taken in the mean.
const LAST: f64 = 0.02;
/// Values of r that are kept, at most: a smooth r is held over some samples then.
const MOST_VALUES: usize = 20_000;
/// Samples of a recording, at most, that a document may claim.
const MOST_SAMPLES: usize = 100_000_000;

impl Recorded {
    /// Of these signals.
    pub fn of(signals: &Signals) -> Self {
        let last = ((LAST * signals.len() as f64) as usize).max(1);
        let end = signals.u.get(signals.len().saturating_sub(last)..).unwrap_or(&[]);
        let (low, high) = range(&signals.r);
        let fastest = signals.r.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        Self {
            duration_s: signals.duration_s(),
            r: signals.r.last().copied().unwrap_or(0.0),
            u: end.iter().sum::<f64>() / end.len().max(1) as f64,
            r_range: [low, high],
            r_rate: fastest / signals.sample_time_s,
            reference: held(&signals.r),
        }
    }

    /// The last samples of r.
    pub fn last_reference(&self, samples: usize) -> Vec<f64> {
        let all = self.reference.iter().flat_map(|(value, held)| std::iter::repeat_n(*value, *held));
        let all: Vec<f64> = all.collect();
        all.get(all.len().saturating_sub(samples)..).unwrap_or(&[]).to_vec()
    }

    /// As a document for programs.
    pub fn to_json(&self) -> Value {
        json!({"duration_s": self.duration_s, "last_r": self.r, "last_u": self.u, "r_range": self.r_range, "fastest_r_per_s": self.r_rate, "reference": self.reference})
    }

    /// From such a document.
    ///
    /// # Errors
    /// A number is missing.
    pub fn from_json(document: &Value) -> Result<Self> {
        let number = |key: &str| {
            let value = document.get(key).and_then(Value::as_f64);
            value.ok_or_else(|| Error::new(format!("recorded.{key} is missing")).allowed("a number"))
        };
        let end = |i: usize| document.get("r_range").and_then(|range| range.get(i)).and_then(Value::as_f64);
        let missing = || Error::new("recorded.r_range is missing").allowed("[least, greatest]");
        Ok(Self {
            duration_s: number("duration_s")?,
            r: number("last_r")?,
            u: number("last_u")?,
            r_range: [end(0).ok_or_else(missing)?, end(1).ok_or_else(missing)?],
            r_rate: number("fastest_r_per_s")?,
            reference: document.get("reference").map(reference).transpose()?.unwrap_or_default(),
        })
    }
}

/// r as values with the samples that each was held for.
fn held(r: &[f64]) -> Vec<(f64, usize)> {
    let mut runs: Vec<(f64, usize)> = Vec::new();
    let every = r.len().div_ceil(MOST_VALUES).max(1);
    for (n, r) in r.iter().enumerate() {
        match runs.last_mut() {
            Some((value, held)) if value == r || n % every != 0 => *held += 1,
            _ => runs.push((*r, 1)),
        }
    }
    runs
}

fn reference(document: &Value) -> Result<Vec<(f64, usize)>> {
    let wrong =
        || Error::new("recorded.reference is no list of held values").allowed("[[value, samples], ...]");
    let run = |pair: &Value| {
        let samples =
            usize::try_from(pair.get(1)?.as_u64()?).ok().filter(|samples| *samples < MOST_SAMPLES)?;
        Some((pair.get(0)?.as_f64()?, samples))
    };
    let runs: Option<Vec<(f64, usize)>> = document.as_array().ok_or_else(wrong)?.iter().map(run).collect();
    let runs = runs.ok_or_else(wrong)?;
    let all: usize = runs.iter().map(|(_, samples)| samples).sum();
    if all < MOST_SAMPLES { Ok(runs) } else { Err(wrong()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document_gives_the_same_back() {
        let r = [vec![1.0; 70], vec![2.5; 30], vec![1.0; 50]].concat();
        let u: Vec<f64> = (0..150).map(f64::from).collect();
        let signals = Signals {
            sample_time_s: 0.5,
            start_s: 0.0,
            origin_s: 0.0,
            r: r.clone(),
            y: r.clone(),
            u,
            inputs: Vec::new(),
        };
        let recorded = Recorded::of(&signals);
        assert_eq!(recorded.reference, [(1.0, 70), (2.5, 30), (1.0, 50)]);
        assert_eq!((recorded.r_rate, recorded.r_range, recorded.u), (3.0, [1.0, 2.5], 148.0));
        assert_eq!(Recorded::from_json(&recorded.to_json()).unwrap(), recorded);
        assert_eq!(recorded.last_reference(60), [vec![2.5; 10], vec![1.0; 50]].concat());
    }
}
