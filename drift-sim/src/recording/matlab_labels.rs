//! The names that the elements of a struct array give themselves: Simulink writes `signals(2).label = 'y'` beside
//! `signals(2).values`, dSPACE `Y(2).Name` beside `Y(2).Data`.

use super::matlab_elements::{Head, Order, class, class_of, damaged, split_element, text};
use crate::Result;

/// Fields that hold such a name, best first.
const LABELS: [&str; 2] = ["label", "Name"];
/// Fields that hold what it is the name of.
const VALUES: [&str; 2] = ["values", "Data"];
/// Letters of a name, at most.
const LETTERS_MAX: usize = 256;

/// The name of each of `count` structs; `None` where it has none, or where another has the same.
///
/// # Errors
/// The structs are cut off or damaged.
pub(super) fn labels(
    fields: &[String],
    mut content: &[u8],
    count: usize,
    order: Order,
) -> Result<Vec<Option<String>>> {
    let label = LABELS.iter().find_map(|label| fields.iter().position(|field| field == label));
    let Some(label) = label.filter(|_| fields.iter().any(|field| is_of_label(field))) else {
        return Ok(vec![None; count]);
    };
    let mut all = Vec::new();
    for _ in 0..count {
        let mut own = None;
        for place in 0..fields.len() {
            let (element, rest) = split_element(content, order)?;
            if place == label {
                own = words(element.data, order)?;
            }
            content = rest;
        }
        all.push(own);
    }
    let is_only = |own: &String| all.iter().flatten().filter(|other| *other == own).nth(1).is_none();
    Ok(all.iter().map(|own| own.clone().filter(is_only)).collect())
}

/// Whether a field holds what the label is the name of.
pub(super) fn is_of_label(field: &str) -> bool {
    VALUES.contains(&field)
}

/// The text of an array of letters; `None` where it is anything else or says nothing.
fn words(array: &[u8], order: Order) -> Result<Option<String>> {
    if array.is_empty() || class_of(array, order)?.0 != class::CHAR {
        return Ok(None);
    }
    let head = Head::of(array, order)?;
    if head.count == 0 || head.count > LETTERS_MAX {
        return Ok(None);
    }
    let (element, _) = split_element(head.content, order).map_err(|_| damaged())?;
    let words = text(element, order).replace('"', "");
    Ok(Some(words.trim().to_owned()).filter(|words| !words.is_empty()))
}
