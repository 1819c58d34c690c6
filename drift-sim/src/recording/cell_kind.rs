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

/// The cells of each column in the first rows of a text; none where they are not known.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct FirstRows {
    columns: Vec<Vec<String>>,
}

impl FirstRows {
    pub fn of<R, C>(rows: impl IntoIterator<Item = R>) -> Self
    where
        R: IntoIterator<Item = C>,
        C: Into<String>,
    {
        let mut columns: Vec<Vec<String>> = Vec::new();
        for row in rows {
            for (place, cell) in row.into_iter().enumerate() {
                if columns.len() == place {
                    columns.push(Vec::new());
                }
                if let Some(column) = columns.get_mut(place) {
                    column.push(cell.into());
                }
            }
        }
        Self { columns }
    }

    /// The same of columns that may be of different length.
    pub fn of_columns(columns: Vec<Vec<String>>) -> Self {
        Self { columns }
    }

    /// What the columns hold; nothing is said of those behind the last that is known.
    pub fn kinds(&self) -> Vec<CellKind> {
        self.columns.iter().map(|cells| CellKind::of_column(cells.iter().map(String::as_str))).collect()
    }

    /// The cells of a column.
    pub fn column(&self, index: usize) -> impl Iterator<Item = &str> {
        self.columns.get(index).into_iter().flatten().map(|cell| cell.trim())
    }
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

    /// The kind of a column of these cells.
    pub fn of_column<'a>(cells: impl IntoIterator<Item = &'a str>) -> Self {
        let kinds = [Self::Number, Self::Date, Self::Text];
        let mut counts = [0_usize; 3];
        for cell in cells {
            let kind = Self::of_cell(cell.trim());
            for (count, other) in counts.iter_mut().zip(kinds) {
                *count += usize::from(kind == other);
            }
        }
        Self::most(counts, kinds)
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
            FirstRows::of(rows).kinds(),
            [CellKind::Number, CellKind::Text, CellKind::Date, CellKind::Unknown, CellKind::Number]
        );
    }
}
