//! Which rows count: `occupied=1`, `mode=AUTO`, `torque_enable>0.5`. Where it does not hold the loop is taken to be
//! in manual: the sample keeps its place in time and enters no sum.

use std::str::FromStr;

use super::status::{Watched, same_word};
use crate::{Error, Result};

/// The condition that every row meets.
const ALWAYS: &str = "always";

/// How a cell is compared with the value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// `=`
    Equal,
    /// `!=`
    NotEqual,
    /// `<`
    Less,
    /// `<=`
    AtMost,
    /// `>`
    Greater,
    /// `>=`
    AtLeast,
}

/// One condition on a column, read from `COLUMN op VALUE` with op one of = != < <= > >=.
#[derive(Debug, Clone, PartialEq)]
pub struct When {
    /// The column it looks at.
    pub column: String,
    /// The comparison.
    pub comparison: Comparison,
    value: Value,
}

#[derive(Debug, Clone, PartialEq)]
enum Value {
    Number(f64),
    Text(String),
    /// No word by which a status says that the row doesn't count.
    Status(Watched),
    /// Whatever it is.
    Any,
}

impl When {
    /// The condition that a column of this name (in lower case, without anything between its letters) carries by itself:
    /// a mode that is not manual, a quality that is not bad.
    pub(super) fn of_status(column: &str, plain_name: &str) -> Option<Self> {
        let value = Value::Status(Watched::of(plain_name)?);
        Some(Self { column: column.to_owned(), comparison: Comparison::NotEqual, value })
    }

    /// The status that the column itself carries, where nobody asked for a condition.
    pub(super) fn status(&self) -> Option<&Watched> {
        match &self.value {
            Value::Status(watched) => Some(watched),
            _ => None,
        }
    }

    /// What is told where rows don't count by a status that nobody asked for.
    pub(super) fn note(&self) -> Option<String> {
        self.status()?.note(&self.column)
    }

    /// Whether a quality is good by the code in a cell; `None` where there is no code.
    pub(super) fn is_good_code(&self, cell: &[u8]) -> Option<bool> {
        self.status()?.is_good_code(cell)
    }

    /// `always`: every row counts, whatever a mode or a quality says.
    pub(super) fn is_always(&self) -> bool {
        self.column == ALWAYS
    }

    /// Whether the cell (its text, without blanks around it) meets the condition. An empty cell never meets one that was
    /// asked for, nor does text where a number is asked for.
    pub fn holds(&self, cell: &[u8]) -> bool {
        if cell.is_empty() {
            // Of a mode or a quality only the changes may be written.
            return matches!(self.value, Value::Status(_) | Value::Any);
        }
        match &self.value {
            Value::Status(watched) => watched.holds(cell),
            Value::Any => true,
            Value::Text(text) => same_word(cell, text.as_bytes()) == (self.comparison == Comparison::Equal),
            Value::Number(limit) => {
                super::decimal::parse_number(cell).is_some_and(|x| self.compares(x, *limit))
            }
        }
    }

    fn compares(&self, x: f64, limit: f64) -> bool {
        if x.is_nan() {
            return false;
        }
        #[expect(clippy::float_cmp, reason = "a flag is compared with the number that it was written as")]
        match self.comparison {
            Comparison::Equal => x == limit,
            Comparison::NotEqual => x != limit,
            Comparison::Less => x < limit,
            Comparison::AtMost => x <= limit,
            Comparison::Greater => x > limit,
            Comparison::AtLeast => x >= limit,
        }
    }
}

impl FromStr for When {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        if text.trim() == ALWAYS {
            return Ok(Self {
                column: ALWAYS.to_owned(),
                comparison: Comparison::NotEqual,
                value: Value::Any,
            });
        }
        let refused = |what: &str| {
            Error::new(format!("when: '{text}' {what}"))
                .allowed("COLUMN op VALUE, op one of = != < <= > >=; or always")
        };
        let at = text.find(['=', '!', '<', '>']).ok_or_else(|| refused("has no comparison"))?;
        let (column, rest) = text.split_at(at);
        // The longer signs first: '<=' begins with '<'.
        let signs = [
            ("!=", Comparison::NotEqual),
            ("<=", Comparison::AtMost),
            (">=", Comparison::AtLeast),
            ("=", Comparison::Equal),
            ("<", Comparison::Less),
            (">", Comparison::Greater),
        ];
        let (comparison, value) = signs
            .into_iter()
            .find_map(|(sign, comparison)| rest.strip_prefix(sign).map(|value| (comparison, value.trim())))
            .ok_or_else(|| refused("has no comparison"))?;
        let column = column.trim().to_owned();
        if column.is_empty() || value.is_empty() {
            return Err(refused("lacks a column or a value"));
        }
        let value = match value.parse::<f64>() {
            Ok(number) if number.is_finite() => Value::Number(number),
            _ if matches!(comparison, Comparison::Equal | Comparison::NotEqual) => {
                Value::Text(value.to_owned())
            }
            _ => return Err(refused("compares sizes with something that is not a number")),
        };
        Ok(Self { column, comparison, value })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_comparison_holds_where_it_should() {
        for (when, cell, expected) in [
            ("occupied=1", "1", true),
            ("occupied=1", "1.0", true),
            ("occupied = 1", "0", false),
            ("occupied!=1", "0", true),
            ("occupied!=1", "", false),
            ("x<2", "1.9", true),
            ("x<2", "2", false),
            ("x<=2", "2", true),
            ("x>2", "2", false),
            ("x>=-1e3", "-1000", true),
            ("x>=2", "nan", false),
            ("mode=AUTO", "AUTO", true),
            ("mode!=AUTO", "MAN", true),
            ("mode=AUTO", "Auto", true),
            ("mode!=Arr\u{ea}t", "ARR\u{ca}T", false),
            ("mode!=AUTO", "AUTO", false),
            ("x>2", "much", false),
        ] {
            assert_eq!(when.parse::<When>().unwrap().holds(cell.as_bytes()), expected, "{when} on '{cell}'");
        }
    }

    #[test]
    fn modes_and_qualities_are_understood() {
        for (name, cell, expected) in [
            ("mode", "AUTO", true),
            ("mode", "CAS", true),
            ("mode", "Man", false),
            ("quality", "GOOD", true),
            ("quality", "Bad", false),
            ("status", "OK", true),
            ("status", "FAULT", false),
            ("status", "bad", false),
            ("auto", "1", true),
            ("auto", "0", false),
            ("manual", "TRUE", false),
            ("manual", "0", true),
        ] {
            assert_eq!(
                When::of_status(name, name).unwrap().holds(cell.as_bytes()),
                expected,
                "{name} {cell}"
            );
        }
        assert_eq!(When::of_status("speed", "speed"), None);
    }

    #[test]
    fn a_bad_condition_is_refused_in_one_line() {
        for (text, what) in [
            ("occupied", "has no comparison"),
            ("x!1", "has no comparison"),
            ("=1", "lacks a column or a value"),
            ("x=", "lacks a column or a value"),
            ("x>high", "compares sizes with something that is not a number"),
        ] {
            assert_eq!(
                text.parse::<When>().unwrap_err().to_string(),
                format!("when: '{text}' {what}; COLUMN op VALUE, op one of = != < <= > >=; or always")
            );
        }
    }
}
