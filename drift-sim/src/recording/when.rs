//! Which rows count: `occupied=1`, `mode=AUTO`, `torque_enable>0.5`. Where it does not hold the loop is taken to be
//! in manual: the sample keeps its place in time and enters no sum.

use std::str::FromStr;

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
    /// No word of these, in lower case.
    NoneOf(&'static [&'static str]),
}

/// The value of a mode where the loop is closed, as most write it.
const AUTOMATIC: &str = "AUTO";
/// Words of a mode that is not automatic, in the languages that names are understood in.
const MANUAL: &[&str] = &[
    "man",
    "manual",
    "m",
    "hand",
    "h",
    "manuell",
    "manuel",
    "manuale",
    "manuelle",
    "open",
    "open loop",
    "off",
    "o/s",
    "oos",
    "out of service",
    "iman",
    "lo",
    "init",
    "initman",
    "hold",
    "track",
    "tracking",
    "stop",
    "stopped",
    "disabled",
    "aus",
    "arret",
    "paro",
    "fermo",
    "desligado",
];
/// Words of a value that is not to be trusted.
const BAD: &[&str] = &[
    "bad",
    "uncertain",
    "questionable",
    "poor",
    "error",
    "err",
    "fault",
    "fail",
    "failed",
    "failure",
    "invalid",
    "i/o timeout",
    "comm fail",
    "no good",
    "ng",
    "schlecht",
    "fehler",
    "ung\u{fc}ltig",
    "mauvais",
    "malo",
    "cattivo",
    "ruim",
];
/// What says no to "automatic?".
const NO: &[&str] =
    &["0", "0.0", "false", "no", "n", "off", "nein", "non", "falsch", "man", "manual", "hand", "aus"];
/// What says yes to "manual?".
const YES: &[&str] =
    &["1", "1.0", "true", "yes", "y", "on", "ja", "oui", "wahr", "si", "sim", "ein", "man", "manual", "hand"];

/// Names of columns, in lower case without anything between their letters, and the words in them that say that the loop
/// is not closed there.
const STATUS: &[(&[&str], &[&str], &str)] = &[
    (
        &[
            "mode",
            "loopmode",
            "controlmode",
            "controllermode",
            "ctrlmode",
            "pidmode",
            "opmode",
            "automan",
            "automan",
            "am",
            "manauto",
            "manualauto",
            "automanual",
            "autohand",
            "handauto",
            "modeact",
            "actualmode",
            "betriebsart",
            "modus",
            "modo",
            "modalita",
            "modalit\u{e0}",
            "status",
            "loopstatus",
            "state",
            "loopstate",
            "zustand",
            "stato",
            "estado",
            "etat",
            "\u{e9}tat",
        ],
        MANUAL,
        AUTOMATIC,
    ),
    (
        &[
            "quality",
            "qual",
            "dataquality",
            "pvquality",
            "qualitaet",
            "qualit\u{e4}t",
            "qualite",
            "qualit\u{e9}",
            "calidad",
            "qualita",
            "qualit\u{e0}",
            "qualidade",
            "validity",
        ],
        BAD,
        "GOOD",
    ),
    (
        &[
            "auto",
            "automatic",
            "inauto",
            "isauto",
            "automatik",
            "automatique",
            "closedloop",
            "loopclosed",
            "automatico",
        ],
        NO,
        "1",
    ),
    (
        &["manual", "man", "inmanual", "ismanual", "hand", "handbetrieb", "manuel", "manuell", "manuale"],
        YES,
        "0",
    ),
];

impl When {
    /// The condition that a column of this name (in lower case, without anything between its letters) carries by itself:
    /// a mode that is not manual, a quality that is not bad.
    pub(super) fn of_status(column: &str, plain_name: &str) -> Option<Self> {
        let (_, words, _) = Self::status(plain_name)?;
        let (column, comparison) = (column.to_owned(), Comparison::NotEqual);
        Some(Self { column, comparison, value: Value::NoneOf(words) })
    }

    fn status(
        plain_name: &str,
    ) -> Option<&'static (&'static [&'static str], &'static [&'static str], &'static str)> {
        STATUS.iter().find(|(names, _, _)| names.contains(&plain_name))
    }

    /// Whether a column of this name holds a mode, which may be written as a number.
    pub(super) fn may_be_a_code(plain_name: &str) -> bool {
        Self::status(plain_name).is_some_and(|(_, _, closed)| *closed == AUTOMATIC)
    }

    /// The value that such a column has where the loop is closed, for an example.
    pub(super) fn closed_value(plain_name: &str) -> &'static str {
        Self::status(plain_name).map_or("1", |(_, _, value)| value)
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
            return matches!(self.value, Value::NoneOf(_));
        }
        match &self.value {
            Value::NoneOf(words) => !words.iter().any(|word| cell.eq_ignore_ascii_case(word.as_bytes())),
            Value::Text(text) => (cell == text.as_bytes()) == (self.comparison == Comparison::Equal),
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
            let value = Value::NoneOf(&[]);
            return Ok(Self { column: ALWAYS.to_owned(), comparison: Comparison::NotEqual, value });
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
