//! The columns that are read of all that a file holds: named by the user, called by their letter, or guessed.

use super::guess::{Guess, SIGNALS, guess};
use super::row::excerpt;
use super::{ColumnMap, ReadOptions, When};
use crate::{Error, Result};

/// Which columns are read, by their index.
#[derive(Debug, Clone, Default)]
pub(super) struct Choice {
    pub t: Option<usize>,
    pub r: usize,
    pub y: usize,
    pub u: usize,
    pub when: Vec<(usize, When)>,
    pub extra: Vec<Extra>,
    /// The same by name.
    pub columns: ColumnMap,
    /// Names that were guessed, in words.
    pub note: Option<String>,
}

/// A further column that is read: its name, its place, and whether text in it is refused or makes it no number.
#[derive(Debug, Clone)]
pub(super) struct Extra {
    pub name: String,
    pub index: usize,
    pub asked_for: bool,
    pub text: bool,
}

impl Choice {
    /// Chooses among the columns of these names.
    ///
    /// # Errors
    /// A signal, condition or further column that isn't there, or could be two of them.
    pub fn of(names: &[String], options: &ReadOptions) -> Result<Self> {
        let map = &options.columns;
        let called = [map.t.as_deref(), Some(map.r.as_str()), Some(map.y.as_str()), Some(map.u.as_str())];
        let exact = called.map(|name| name.and_then(|name| names.iter().position(|n| n == name)));
        let guesses = guess(names, exact);
        let mut guessed = Vec::new();
        let mut place = |signal: usize| -> Result<usize> {
            if let Some(index) = exact[signal] {
                return Ok(index);
            }
            let letter = SIGNALS[signal];
            let name = called[signal].unwrap_or(letter);
            if map.is_named[signal] {
                return Err(no_column(name, letter, names.iter().map(String::as_str)));
            }
            match guesses[signal] {
                Guess::Column(index) => {
                    guessed.push(format!("{letter} = '{}'", names[index]));
                    Ok(index)
                }
                Guess::Either(one, other) => {
                    Err(Error::new(format!("'{}' and '{}' could both be {letter}", names[one], names[other]))
                        .allowed(format!("--columns {letter}=NAME")))
                }
                Guess::Nothing => Err(no_column(name, letter, names.iter().map(String::as_str))),
            }
        };
        let t = match (&map.t, options.sample_time_s) {
            (Some(_), None) => Some(place(0)?),
            (Some(_), Some(_)) if map.is_named[0] => Some(place(0)?),
            (Some(_), Some(_)) => exact[0],
            (None, Some(_)) => None,
            (None, None) => {
                return Err(Error::new("no column is t").allowed("name one, or give the sample time"));
            }
        };
        let (r, y, u) = (place(1)?, place(2)?, place(3)?);
        let note = (!guessed.is_empty()).then(|| {
            format!("columns guessed by their names: {} (--columns says otherwise)", guessed.join(", "))
        });
        let columns = ColumnMap {
            t: t.map(|t| names[t].clone()),
            r: names[r].clone(),
            y: names[y].clone(),
            u: names[u].clone(),
            is_named: map.is_named,
        };
        let mut choice = Self { t, r, y, u, when: Vec::new(), extra: Vec::new(), columns, note };
        for when in &options.when {
            choice.when.push((find(names, &when.column, "a condition")?, when.clone()));
        }
        for name in &options.extra {
            let index = find(names, name, "a further signal")?;
            choice.extra.push(Extra { name: name.clone(), index, asked_for: true, text: false });
        }
        if options.keep_extra {
            choice.keep_the_rest(names);
        }
        Ok(choice)
    }

    /// Whether a column is read at all.
    pub fn uses(&self, index: usize) -> bool {
        [self.r, self.y, self.u].contains(&index)
            || self.t == Some(index)
            || self.when.iter().any(|(i, _)| *i == index)
            || self.extra.iter().any(|e| e.index == index)
    }

    fn keep_the_rest(&mut self, names: &[String]) {
        for (index, name) in names.iter().enumerate() {
            let taken = [self.t.unwrap_or(self.r), self.r, self.y, self.u].contains(&index)
                || self.extra.iter().any(|e| e.index == index);
            if !taken && !name.is_empty() {
                self.extra.push(Extra { name: name.clone(), index, asked_for: false, text: false });
            }
        }
    }
}

fn find(names: &[String], name: &str, what_for: &str) -> Result<usize> {
    names
        .iter()
        .position(|n| n == name)
        .ok_or_else(|| no_column(name, what_for, names.iter().map(String::as_str)))
}

pub(super) fn no_column<'a>(name: &str, what_for: &str, there: impl Iterator<Item = &'a str>) -> Error {
    let there: Vec<_> = there.collect();
    Error::new(format!("no column '{name}' for {what_for}"))
        .allowed(format!("the columns are {}", excerpt(&there.join(", "))))
}
