//! Rows that repeat a time stamp: a logger that writes at the change of each signal leaves several of one time.

use std::str::FromStr;

use super::row::{Filter, Row, Rows, worse};
use super::{Quality, ReadOptions};
use crate::{Error, Result};

/// What becomes of several rows of one time stamp.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Repeated {
    /// Rows that say the same count once, others are refused.
    #[default]
    Refuse,
    /// The first of them counts.
    First,
    /// The last of them counts.
    Last,
    /// Their mean counts; a value that is missing in one is taken from the others.
    Mean,
}

impl FromStr for Repeated {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "refuse" => Ok(Self::Refuse),
            "first" => Ok(Self::First),
            "last" => Ok(Self::Last),
            "mean" => Ok(Self::Mean),
            _ => Err(Error::new(format!("repeated: '{text}'")).allowed("refuse, first, last, mean")),
        }
    }
}

/// The rows, each time once where that was asked for.
pub(super) fn merged(rows: Box<dyn Rows>, options: &ReadOptions) -> Box<dyn Rows> {
    match options.repeated {
        Repeated::Refuse => rows,
        how if rows.has_time() => Box::new(Merged { rows, how, next: None, is_over: false, merged: 0 }),
        _ => rows,
    }
}

struct Merged {
    rows: Box<dyn Rows>,
    how: Repeated,
    /// The row behind those that were merged.
    next: Option<Row>,
    is_over: bool,
    merged: u64,
}

impl Merged {
    fn next_row(&mut self, quality: &mut Quality) -> Result<Option<Row>> {
        if let Some(row) = self.next.take() {
            return Ok(Some(row));
        }
        let mut row = Row::default();
        self.is_over = self.is_over || !self.rows.read(&mut row, quality)?;
        Ok((!self.is_over).then_some(row))
    }
}

impl Filter for Merged {
    fn source(&self) -> &dyn Rows {
        self.rows.as_ref()
    }

    fn note(&self) -> Option<String> {
        let how = match self.how {
            Repeated::First => "the first counts",
            Repeated::Mean => "their mean counts",
            Repeated::Last | Repeated::Refuse => "the last counts",
        };
        (self.merged > 0).then(|| format!("{} rows repeat a time stamp: {how}", self.merged))
    }

    fn read(&mut self, row: &mut Row, quality: &mut Quality) -> Result<bool> {
        let Some(first) = self.next_row(quality)? else { return Ok(false) };
        let mut sums = Sums::of(&first);
        let t_s = first.stamp.t_s;
        *row = first;
        while let Some(other) = self.next_row(quality)? {
            #[expect(clippy::float_cmp, reason = "the same text is the same number")]
            if other.stamp.t_s != t_s {
                self.next = Some(other);
                break;
            }
            self.merged += 1;
            match self.how {
                Repeated::Mean => {
                    sums.add(&other);
                    row.manual |= other.manual;
                    row.good = worse(row.good, other.good);
                }
                Repeated::Last => *row = other,
                Repeated::First | Repeated::Refuse => {}
            }
        }
        if self.how == Repeated::Mean {
            sums.write(row);
        }
        Ok(true)
    }
}

/// Sums of the values that are there, and how many they are: r, y, u and the further columns.
struct Sums(Vec<(f64, f64)>);

impl Sums {
    fn of(row: &Row) -> Self {
        let mut sums = Self(vec![(0.0, 0.0); 3 + row.extra.len()]);
        sums.add(row);
        sums
    }

    fn add(&mut self, row: &Row) {
        let values = [row.r, row.y, row.u].into_iter().chain(row.extra.iter().copied());
        for ((sum, count), value) in self.0.iter_mut().zip(values).filter(|(_, value)| !value.is_nan()) {
            *sum += value;
            *count += 1.0;
        }
    }

    fn write(&self, row: &mut Row) {
        let mut means = self.0.iter().map(|(sum, count)| if *count > 0.0 { sum / count } else { f64::NAN });
        for value in [&mut row.r, &mut row.y, &mut row.u].into_iter().chain(&mut row.extra) {
            *value = means.next().unwrap_or(f64::NAN);
        }
    }
}
