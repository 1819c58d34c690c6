//! The units of r, y and u that a file states: in a row of units, or in brackets at the end of a column's name, `PV [degC]`.

use super::choice::Choice;
use crate::likelihood_search::units::is_known;
use crate::physics::Units;

/// The units of the chosen columns.
pub(super) fn of(choice: &Choice, names: &[String], stated: &[String]) -> Units {
    let unit = |column: Option<usize>| {
        let column = column?;
        let below = stated.get(column).map(|unit| unit.trim()).filter(|unit| !unit.is_empty());
        below.or_else(|| in_brackets(names.get(column)?)).map(str::to_owned)
    };
    Units { r: unit(choice.r.column()), y: unit(choice.y), u: unit(choice.u), force: None }
}

/// The unit at the end of a name. In square brackets any word is one, but an index is none; in round brackets only what is known to be one.
fn in_brackets(name: &str) -> Option<&str> {
    let name = name.trim_end();
    let within = |open: char, close: char| {
        let (before, unit) = name.strip_suffix(close)?.rsplit_once(open)?;
        Some(unit.trim()).filter(|_| !before.trim().is_empty())
    };
    let is_word = |unit: &&str| unit.chars().any(|c| c.is_alphabetic() || c == '%' || c == '\u{b0}');
    within('[', ']').filter(is_word).or_else(|| within('(', ')').filter(|unit| is_known(unit)))
}

#[cfg(test)]
mod tests {
    use super::in_brackets;

    #[test]
    fn a_unit_stands_in_brackets_and_an_index_is_none() {
        let units =
            ["PV [degC]", "OP (%)", "Ist (\u{b0}C)", "y[0]", "u(1)", "TIC101 (PV)", "[degC]", "speed"]
                .map(in_brackets);
        assert_eq!(units, [Some("degC"), Some("%"), Some("\u{b0}C"), None, None, None, None, None]);
    }
}
