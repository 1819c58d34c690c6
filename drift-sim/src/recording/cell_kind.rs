//! What the columns of a text seem to hold, from its first rows: where names leave open which column is which signal,
//! a column of words is none, and a column of dates is the time.

use super::clock::is_date_or_time;
use super::decimal::{parse_number, with_point};

/// What most cells of a column hold.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum CellKind {
    /// Nothing is known of it.
    #[default]
    Unknown,
    Number,
    Date,
    Text,
}

impl CellKind {
    /// What one cell holds; a word that says that there is no number says nothing.
    fn of_cell(cell: &str) -> Self {
        if parse_number(cell.as_bytes()).is_some_and(f64::is_nan) {
            Self::Unknown
        } else if parse_number(cell.as_bytes()).is_some() || with_point(cell.as_bytes()).is_some() {
            Self::Number
        } else if is_date_or_time(cell) {
            Self::Date
        } else {
            Self::Text
        }
    }

    /// The kind of each of so many columns over all these rows.
    pub fn of_columns<'a, R>(width: usize, rows: impl IntoIterator<Item = R>) -> Vec<Self>
    where
        R: IntoIterator<Item = &'a str>,
    {
        let kinds = [Self::Number, Self::Date, Self::Text];
        let mut counts = vec![[0_usize; 3]; width];
        for row in rows {
            for (cell, counts) in row.into_iter().zip(&mut counts) {
                let kind = Self::of_cell(cell.trim());
                for (count, other) in counts.iter_mut().zip(kinds) {
                    *count += usize::from(kind == other);
                }
            }
        }
        counts.into_iter().map(|counts| Self::most(counts, kinds)).collect()
    }

    /// The kind that more than half of all cells that hold something are of; of two halves nothing is known.
    fn most(counts: [usize; 3], kinds: [Self; 3]) -> Self {
        let all: usize = counts.iter().sum();
        let most = counts.into_iter().zip(kinds).find(|(count, _)| 2 * count > all);
        most.map_or(Self::Unknown, |(_, kind)| kind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn most_cells_say_what_a_column_holds() {
        let rows = [
            ["1", "AUTO", "12:00:01", "", "bad"],
            ["2,5", "MAN", "12:00:02", "null", "3"],
            ["x", "1", "", "", "4"],
        ];
        assert_eq!(
            CellKind::of_columns(5, rows),
            [CellKind::Number, CellKind::Text, CellKind::Date, CellKind::Unknown, CellKind::Number]
        );
    }
}
