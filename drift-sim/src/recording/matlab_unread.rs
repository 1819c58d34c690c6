//! Objects of MATLAB that can't be read, each with the line that exports it.

use crate::{Error, Result};

/// A variable that is such an object, and its class.
pub(super) struct Unread {
    pub name: String,
    pub class: String,
}

impl Unread {
    /// `None` for what never holds signals.
    fn exported_by(&self) -> Option<String> {
        let name = &self.name;
        match self.class.as_str() {
            "table" => Some(format!("writetable({name}, 'file.csv')")),
            "timetable" => Some(format!("writetimetable({name}, 'file.csv')")),
            "timeseries" => Some(format!("t = {name}.Time; y = {name}.Data; save('file.mat', 't', 'y')")),
            _ => None,
        }
    }

    fn says(&self) -> Option<(String, String)> {
        let what = format!("'{}' is a {} that can't be read here", self.name, self.class);
        self.exported_by().map(|line| (what, format!("in MATLAB: {line}")))
    }
}

/// What is told of them beside the columns that were found.
///
/// # Errors
/// There are no columns but these.
pub(super) fn told_or_refused(unread: &[Unread], has_columns: bool) -> Result<Vec<String>> {
    let said: Vec<_> = unread.iter().filter_map(Unread::says).collect();
    match said.first() {
        Some((what, instead)) if !has_columns => Err(Error::new(what.clone()).allowed(instead.clone())),
        _ => Ok(said.into_iter().map(|(what, instead)| format!("{what}; {instead}")).collect()),
    }
}
