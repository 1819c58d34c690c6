//! Which column of a recording is which signal: `t=time,r=SP,y=PV,u=OP`.

use std::str::FromStr;

use super::ReadOptions;
use super::choice::Choice;
use crate::{Error, Result};

/// The names of the columns that hold t, r, y and u. By default each is called by its own letter,
/// or by one of the names that are usual for it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnMap {
    /// Column of the time stamps in seconds; `None` reads none (the sample time is then given).
    pub t: Option<String>,
    /// Column of the reference; empty where there is none, and the controller holds one value.
    pub r: String,
    /// Column of the measured output.
    pub y: String,
    /// Column of the controller output.
    pub u: String,
    /// Which of t, r, y, u were named by the user, who then expects them to be there: nothing is guessed for them.
    pub(super) is_named: [bool; 4],
}

impl Default for ColumnMap {
    fn default() -> Self {
        Self { t: Some("t".into()), r: "r".into(), y: "y".into(), u: "u".into(), is_named: [false; 4] }
    }
}

impl ColumnMap {
    /// r, y and u as reports name them: with the column's name where it is another, `y (PV)`.
    pub fn labels(&self) -> [String; 3] {
        [("r", &self.r), ("y", &self.y), ("u", &self.u)].map(|(letter, column)| {
            if letter == column || column.is_empty() {
                letter.to_owned()
            } else {
                format!("{letter} ({column})")
            }
        })
    }
}

impl ColumnMap {
    /// Whether r, y or u is named.
    pub(super) fn is_anything_named(&self) -> bool {
        self.is_named.iter().skip(1).any(|named| *named)
    }

    /// The number in brackets of the first of y, u and r that is named, 1 of `gyroADC[1]`.
    #[cfg(feature = "blackbox")]
    pub(super) fn named_index(&self) -> Option<usize> {
        let [_, r, y, u] = self.is_named;
        let named = [(y, &self.y), (u, &self.u), (r, &self.r)];
        let (_, name) = named.into_iter().find(|(named, _)| *named)?;
        name.split_once('[')?.1.trim_end_matches(']').parse().ok()
    }

    /// What stands before the last point of the first of y, u and r that is named, `heater` of `heater.temp`.
    pub(super) fn named_loop(&self) -> Option<String> {
        let [_, r, y, u] = self.is_named;
        let named = [(y, &self.y), (u, &self.u), (r, &self.r)];
        let (_, name) = named.into_iter().find(|(named, _)| *named)?;
        name.rsplit_once('.').map(|(name, _)| name.to_owned())
    }

    /// Whether y and u, and r and t where they are named, are numbers of columns.
    pub(super) fn is_by_number(&self) -> bool {
        let is_number = |name: &str| name.is_empty() || name.parse::<usize>().is_ok_and(|number| number > 0);
        let [t, r, y, u] = self.is_named;
        y && u
            && is_number(&self.y)
            && is_number(&self.u)
            && (!r || is_number(&self.r))
            && (!t || self.t.as_deref().is_none_or(|t| t.split('+').all(is_number)))
    }
}

impl ColumnMap {
    /// The columns that are read of a table whose columns are called `names`: those of the signals, named or guessed, and those that say
    /// where the loop is closed. An empty r says that there is none.
    ///
    /// # Errors
    /// A column that is asked for isn't there, or y or u can't be told.
    pub fn among(names: &[String], options: &ReadOptions) -> Result<(Self, Vec<String>)> {
        let choice = Choice::of(names, options)?;
        let conditions = choice.when.iter().map(|(index, _)| *index);
        let mut indices: Vec<usize> = conditions.chain(choice.mode).collect();
        indices.sort_unstable();
        indices.dedup();
        let closed = indices.into_iter().filter_map(|index| names.get(index).cloned()).collect();
        Ok((choice.columns, closed))
    }
}

impl FromStr for ColumnMap {
    type Err = Error;

    /// Reads `t=time,r=SP,y=PV,u=OP`; what isn't named keeps its own letter or is guessed, `t=` ignores the
    /// time stamps, `r=` says that the reference is not recorded.
    fn from_str(text: &str) -> Result<Self> {
        let pair = |pair: &str| match pair.split_once('=') {
            Some((signal, column)) => Ok((signal.trim().to_owned(), column.trim().to_owned())),
            None => Err(refused(format!("columns: '{pair}' has no '='"))),
        };
        Self::of(split_outside_brackets(text).map(pair).collect::<Result<Vec<_>>>()?)
    }
}

fn refused(what: String) -> Error {
    Error::new(what).allowed("like t=time,r=SP,y=PV,u=OP")
}

impl ColumnMap {
    /// Takes pairs of a signal (t, r, y, u) and its column; an empty column says that there are no time stamps, or no reference.
    ///
    /// # Errors
    /// A signal is unknown or named twice, or y or u has no column.
    pub fn of(pairs: impl IntoIterator<Item = (String, String)>) -> Result<Self> {
        let mut map = Self::default();
        let mut seen = Vec::new();
        for (signal, column) in pairs {
            let (signal, column) = (signal.as_str(), column.as_str());
            if seen.iter().any(|named| named == signal) {
                return Err(refused(format!("columns: '{signal}' is named twice")));
            }
            seen.push(signal.to_owned());
            if column.is_empty() && !["t", "r"].contains(&signal) {
                return Err(refused(format!("columns: no column for '{signal}'")));
            }
            match signal {
                "t" => map.t = (!column.is_empty()).then(|| column.to_owned()),
                "r" => map.r = column.to_owned(),
                "y" => map.y = column.to_owned(),
                "u" => map.u = column.to_owned(),
                other => return Err(refused(format!("columns: unknown signal '{other}'"))),
            }
            for (named, letter) in map.is_named.iter_mut().zip(super::guess::SIGNALS) {
                *named |= letter == signal;
            }
        }
        Ok(map)
    }
}

/// The parts between commas; those within brackets belong to a name, like `m(:,2)`.
fn split_outside_brackets(text: &str) -> impl Iterator<Item = &str> {
    let mut depth = 0_i32;
    text.split(move |c: char| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        c == ',' && depth <= 0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_mapped_and_the_rest_keeps_its_letter() {
        let map: ColumnMap = "t=time, y=PV".parse().unwrap();
        assert_eq!((map.t.as_deref(), map.r.as_str(), map.y.as_str()), (Some("time"), "r", "PV"));
        assert_eq!(map.labels(), ["r", "y (PV)", "u"]);
        assert_eq!("t=".parse::<ColumnMap>().unwrap().t, None);
        assert_eq!("r=m(:,2),u=b".parse::<ColumnMap>().unwrap().r, "m(:,2)");
    }

    #[test]
    fn a_bad_map_is_refused_in_one_line() {
        for (text, message) in [
            ("", "columns: '' has no '='; like t=time,r=SP,y=PV,u=OP"),
            ("x=1", "columns: unknown signal 'x'; like t=time,r=SP,y=PV,u=OP"),
            ("y=", "columns: no column for 'y'; like t=time,r=SP,y=PV,u=OP"),
            ("r=a,r=b", "columns: 'r' is named twice; like t=time,r=SP,y=PV,u=OP"),
        ] {
            assert_eq!(text.parse::<ColumnMap>().unwrap_err().to_string(), message);
        }
    }
}
