//! Whether a row of words below a header states units, or what else a logger says of a column: how it was averaged, its type.

use crate::likelihood_search::units::is_known;

/// Units of time, and how the values of a column came about (the third row of Campbell's TOA5).
const WORDS: [&str; 22] = [
    "s", "sec", "ms", "us", "ns", "min", "h", "ts", "rn", "smp", "avg", "max", "std", "tot", "float",
    "double", "int", "bool", "real", "string", "1", "deg/s",
];
/// Signs that hardly a name holds and many a unit does.
const SIGNS: [char; 7] = ['%', '\u{b0}', '/', '\u{b5}', '\u{3a9}', '\u{b2}', '\u{b3}'];

/// Whether every cell that says something states one.
pub(super) fn are_units(cells: &[&str]) -> bool {
    let mut said =
        cells.iter().map(|cell| cell.trim()).filter(|cell| !cell.trim_matches('-').is_empty()).peekable();
    said.peek().is_some() && said.all(is_unit)
}

fn is_unit(cell: &str) -> bool {
    let is_bracketed = [('[', ']'), ('(', ')'), ('<', '>')]
        .iter()
        .any(|(open, close)| cell.starts_with(*open) && cell.ends_with(*close));
    is_bracketed || is_known(cell) || WORDS.contains(&cell.to_lowercase().as_str()) || cell.contains(SIGNS)
}

#[cfg(test)]
mod tests {
    use super::are_units;

    #[test]
    fn units_are_told_from_names() {
        for row in [
            ["s", "degC", "", "%"],
            ["[s]", "(V)", "<A>", "-"],
            ["TS", "RN", "C", "kg/m3"],
            ["", "Avg", "Smp", ""],
        ] {
            let row = row.map(|cell| if cell == "C" { "degC" } else { cell });
            assert!(are_units(&row), "{row:?}");
        }
        for row in
            [["t", "r", "y", "u"], ["Name", "Tag", "Info", "x"], ["", "", "", ""], ["Zeit", "%", "%", "%"]]
        {
            assert!(!are_units(&row), "{row:?}");
        }
    }
}
