//! Numbers as text, with a decimal point or a decimal comma: one file uses one of them.

use crate::{Error, Result};

/// The decimal mark of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DecimalMark {
    /// Not seen yet: the separator is no comma, so either may come.
    Open,
    Point,
    Comma,
}

impl DecimalMark {
    /// What a file may hold whose cells are separated so.
    pub fn beside(delimiter: u8) -> Self {
        if delimiter == b',' { Self::Point } else { Self::Open }
    }

    /// The number in a cell without blanks around it; NaN for the words that say there is none; `None` for other
    /// text.
    ///
    /// # Errors
    /// A mark that contradicts the one seen before: 1,234 and 2.5 in one file could be a thousand or one.
    pub fn number(&mut self, cell: &[u8]) -> Result<Option<f64>> {
        if *self == Self::Point {
            return Ok(parse_number(cell));
        }
        let number = parse_number(cell);
        if number.is_some() {
            if cell.contains(&b'.') {
                self.settle(Self::Point, cell)?;
            }
            return Ok(number);
        }
        match with_point(cell) {
            Some(text) => {
                self.settle(Self::Comma, cell)?;
                Ok(parse_number(&text))
            }
            None => Ok(None),
        }
    }

    fn settle(&mut self, seen: Self, cell: &[u8]) -> Result<()> {
        if *self != Self::Open && *self != seen {
            let cell = String::from_utf8_lossy(cell);
            return Err(Error::new(format!("'{cell}' has a decimal point, numbers before a decimal comma"))
                .allowed("one of them in a file"));
        }
        *self = seen;
        Ok(())
    }

    /// The cell as it reads with a decimal point.
    pub fn plain(self, cell: &[u8]) -> Option<Vec<u8>> {
        if self == Self::Point { None } else { with_point(cell) }
    }
}

/// Units that may stand behind a number in its cell: those that stay the same from row to row, whatever the size of the number.
const UNITS: [&str; 7] = ["%", "\u{b0}C", "\u{b0}F", "\u{b0}", "degC", "degF", "rpm"];
/// What historians, spreadsheets and home automation write where there is no number.
const NOTHING: [&str; 23] = [
    "na",
    "n/a",
    "null",
    "none",
    "nil",
    "undef",
    "-",
    "--",
    "---",
    "?",
    "#n/a",
    "#value!",
    "#num!",
    "#div/0!",
    "#ref!",
    "bad",
    "bad input",
    "no data",
    "nodata",
    "i/o timeout",
    "shutdown",
    "pt created",
    "unavailable",
];

/// A cell without the unit behind its number.
fn without_unit(cell: &[u8]) -> Option<&[u8]> {
    let text = std::str::from_utf8(cell).ok()?;
    let number = UNITS.iter().find_map(|unit| text.strip_suffix(unit))?.trim_end();
    number.ends_with(|c: char| c.is_ascii_digit() || c == '.').then_some(number.as_bytes())
}

/// A number that groups its thousands and has a decimal mark, `1,032.50` or `1.032,50`, without the groups: only with both marks is it
/// clear which is which.
fn without_groups(cell: &[u8], group: u8, point: u8) -> Option<Vec<u8>> {
    let at = cell.iter().position(|b| *b == point)?;
    let (whole, fraction) = cell.split_at_checked(at)?;
    let mut groups = whole.split(|b| *b == group);
    let is_number = |part: &[u8]| !part.is_empty() && part.iter().all(u8::is_ascii_digit);
    let first = groups.next()?;
    let first = first.strip_prefix(b"-").unwrap_or(first);
    let rest: Vec<&[u8]> = groups.collect();
    let is_grouped =
        first.len() <= 3 && is_number(first) && rest.iter().all(|part| part.len() == 3 && is_number(part));
    let ends = is_number(fraction.get(1..)?) && !rest.is_empty();
    (is_grouped && ends).then(|| cell.iter().copied().filter(|b| *b != group).collect())
}

/// A number written with one decimal comma, with a point in its place; `None` for anything else.
pub(super) fn with_point(cell: &[u8]) -> Option<Vec<u8>> {
    let cell = without_unit(cell).unwrap_or(cell);
    if let Some(plain) = without_groups(cell, b'.', b',') {
        return with_point(&plain);
    }
    let at = cell.iter().position(|b| *b == b',')?;
    let is_number =
        cell.iter().enumerate().all(|(i, b)| i == at || b.is_ascii_digit() || b"+-eE".contains(b));
    is_number.then(|| cell.iter().map(|b| if *b == b',' { b'.' } else { *b }).collect())
}

/// A number with a decimal point, maybe with a unit behind it; NaN for the words that say there is none; `None` for other text.
pub(super) fn parse_number(cell: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(cell).ok()?;
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() => Some(x),
        Ok(_) => Some(f64::NAN),
        Err(_) if text.is_empty() => Some(f64::NAN),
        Err(_) => parse_other(cell, text),
    }
}

#[cold]
fn parse_other(cell: &[u8], text: &str) -> Option<f64> {
    if NOTHING.iter().any(|word| text.eq_ignore_ascii_case(word)) {
        return Some(f64::NAN);
    }
    let cell = without_unit(cell).unwrap_or(cell);
    let plain = without_groups(cell, b',', b'.');
    let number = std::str::from_utf8(plain.as_deref().unwrap_or(cell)).ok()?.parse::<f64>().ok()?;
    number.is_finite().then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_one_decimal_mark() {
        let mut mark = DecimalMark::beside(b';');
        assert_eq!(mark.number(b"3").unwrap(), Some(3.0));
        assert_eq!(mark.number(b"-2,5e1").unwrap(), Some(-25.0));
        assert!(mark.number(b"2.5").unwrap_err().to_string().contains("decimal comma"));
        let mut mark = DecimalMark::beside(b'\t');
        assert_eq!(mark.number(b"2.5").unwrap(), Some(2.5));
        assert_eq!(mark.number(b"2,5").unwrap(), None);
        assert_eq!(DecimalMark::beside(b',').number(b"2,5").unwrap(), None);
        assert_eq!(DecimalMark::beside(b';').number(b"1,234,5").unwrap(), None);
    }

    #[test]
    fn units_and_groups_of_thousands_are_no_part_of_the_number() {
        for (cell, number) in [
            ("32.5 \u{b0}C", Some(32.5)),
            ("-7%", Some(-7.0)),
            ("900 rpm", Some(900.0)),
            ("1,032.5", Some(1032.5)),
            ("-12,345,678.25", Some(-12_345_678.25)),
            // A thousand, or one and a bit; a thousand of these, or one.
            ("1,032", None),
            ("1.2 kW", None),
            ("%", None),
            ("12a%", None),
            ("1,03.5", None),
            (",032.5", None),
        ] {
            assert_eq!(DecimalMark::beside(b',').number(cell.as_bytes()).unwrap(), number, "{cell}");
        }
        let mut mark = DecimalMark::beside(b';');
        assert_eq!(mark.number("1.032,5".as_bytes()).unwrap(), Some(1032.5));
        assert_eq!(mark.number("32,5 \u{b0}C".as_bytes()).unwrap(), Some(32.5));
        mark.number(b"2.5").unwrap_err();
    }

    #[test]
    fn words_for_no_number_are_missing_values() {
        for cell in ["", "NaN", "n/a", "Bad Input", "#N/A", "unavailable", "-", "I/O Timeout"] {
            assert!(parse_number(cell.as_bytes()).is_some_and(f64::is_nan), "{cell}");
        }
        assert_eq!(parse_number(b"AUTO"), None);
    }
}
