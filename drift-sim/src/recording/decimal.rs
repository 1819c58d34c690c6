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

/// A number written with one decimal comma, with a point in its place; `None` for anything else.
pub(super) fn with_point(cell: &[u8]) -> Option<Vec<u8>> {
    let at = cell.iter().position(|b| *b == b',')?;
    let is_number =
        cell.iter().enumerate().all(|(i, b)| i == at || b.is_ascii_digit() || b"+-eE".contains(b));
    is_number.then(|| cell.iter().map(|b| if *b == b',' { b'.' } else { *b }).collect())
}

/// A number with a decimal point; NaN for the words that say there is none; `None` for other text.
pub(super) fn parse_number(cell: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(cell).ok()?;
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() => Some(x),
        Ok(_) => Some(f64::NAN),
        Err(_) => {
            let is_none =
                text.is_empty() || ["na", "n/a", "null", "none"].iter().any(|w| text.eq_ignore_ascii_case(w));
            is_none.then_some(f64::NAN)
        }
    }
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
}
