//! Which column of a recording is which signal: `t=time,r=SP,y=PV,u=OP`.

use std::str::FromStr;

use crate::{Error, Result};

/// The names of the columns that hold t, r, y and u. By default each is called by its own letter,
/// or by one of the names that are usual for it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnMap {
    /// Column of the time stamps in seconds; `None` reads none (the sample time is then given).
    pub t: Option<String>,
    /// Column of the reference.
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
            if letter == column { letter.to_owned() } else { format!("{letter} ({column})") }
        })
    }
}

impl FromStr for ColumnMap {
    type Err = Error;

    /// Reads `t=time,r=SP,y=PV,u=OP`; what isn't named keeps its own letter or is guessed, `t=` ignores the
    /// time stamps.
    fn from_str(text: &str) -> Result<Self> {
        let refused = |what: String| Error::new(what).allowed("like t=time,r=SP,y=PV,u=OP");
        let mut map = Self::default();
        let mut seen = Vec::new();
        for pair in split_outside_brackets(text) {
            let (signal, column) =
                pair.split_once('=').ok_or_else(|| refused(format!("columns: '{pair}' has no '='")))?;
            let (signal, column) = (signal.trim(), column.trim());
            if seen.contains(&signal) {
                return Err(refused(format!("columns: '{signal}' is named twice")));
            }
            seen.push(signal);
            if column.is_empty() && signal != "t" {
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
            ("r=", "columns: no column for 'r'; like t=time,r=SP,y=PV,u=OP"),
            ("r=a,r=b", "columns: 'r' is named twice; like t=time,r=SP,y=PV,u=OP"),
        ] {
            assert_eq!(text.parse::<ColumnMap>().unwrap_err().to_string(), message);
        }
    }
}
