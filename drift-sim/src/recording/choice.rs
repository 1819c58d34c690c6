//! The columns that are read of all that a file holds: named by the user, called by their letter, or guessed.

use std::collections::{HashMap, HashSet};

use super::cell_kind::CellKind;
use super::guess::{Guess, SIGNALS, guess, is_usual, is_y_the_output, status_readings, tag};
use super::row::excerpt;
use super::status::Watched;
use super::{ColumnMap, ReadOptions, When};
use crate::{Error, Result};

/// Which columns are read, by their index.
#[derive(Debug, Clone, Default)]
pub(super) struct Choice {
    pub t: Option<usize>,
    /// The date, where the column of time holds the time of the day alone.
    pub date: Option<usize>,
    pub r: Reference,
    /// Absent only where the options allow it.
    pub y: Option<usize>,
    pub u: Option<usize>,
    pub when: Vec<(usize, When)>,
    pub extra: Vec<Extra>,
    /// The same by name.
    pub columns: ColumnMap,
    /// What was guessed, in words.
    pub notes: Vec<String>,
    /// What the file lacks, and `--columns` as it could be; where the options allow that.
    pub lacks: Option<Lack>,
    /// The column of a mode, whose codes may be numbers.
    pub mode: Option<usize>,
}

/// A signal that no column seems to be.
#[derive(Debug, Clone)]
pub(super) struct Lack {
    /// In one line.
    pub says: String,
    /// An example of `--columns` for this file.
    pub example: String,
}

/// Where the reference comes from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Reference {
    Column(usize),
    /// There is none: the controller holds one value.
    #[default]
    Absent,
}

impl Reference {
    /// Its column, if there is one.
    pub fn column(self) -> Option<usize> {
        match self {
            Self::Column(column) => Some(column),
            Self::Absent => None,
        }
    }
}

/// A further column that is read: its name, its place, and whether text in it is refused or makes it no number.
#[derive(Debug, Clone)]
pub(super) struct Extra {
    pub name: String,
    pub index: usize,
    pub asked_for: bool,
    pub text: bool,
}

/// The names of the columns, and what the options say of them.
struct Names<'a> {
    names: &'a [String],
    /// What the columns hold, where it is known.
    kinds: &'a [CellKind],
    places: HashMap<&'a str, usize>,
    options: &'a ReadOptions,
    /// Where the columns that the options name are.
    exact: [Option<usize>; 4],
    guesses: [Guess; 4],
    date: Option<usize>,
}

impl<'a> Names<'a> {
    fn of(names: &'a [String], kinds: &'a [CellKind], options: &'a ReadOptions) -> Self {
        let mut places = HashMap::with_capacity(names.len());
        for (index, name) in names.iter().enumerate() {
            places.entry(name.as_str()).or_insert(index);
        }
        let mut all = Self {
            names,
            kinds,
            places,
            options,
            exact: [None; 4],
            guesses: [Guess::Nothing; 4],
            date: None,
        };
        let t = all.called(0).map(str::to_owned);
        if let Some((date, time)) = t.as_deref().and_then(|t| t.split_once('+'))
            && all.place(t.as_deref().unwrap_or_default()).is_none()
            && let (Some(date), Some(time)) = (all.place(date.trim()), all.place(time.trim()))
        {
            all.date = Some(date);
            all.exact[0] = Some(time);
        }
        for signal in 0..SIGNALS.len() {
            if signal == 2 && !options.columns.is_named[signal] && is_y_the_output(names) {
                continue;
            }
            let found = all.called(signal).filter(|name| !name.is_empty()).and_then(|name| all.place(name));
            all.exact[signal] = all.exact[signal].or(found);
        }
        let (guesses, date) = guess(names, kinds, all.exact);
        all.guesses = guesses;
        if all.exact[0].is_none() {
            all.date = date;
        }
        all
    }

    /// A column by its name; where none is called so, by its number from 1 on.
    fn place(&self, name: &str) -> Option<usize> {
        let by_number =
            || name.parse::<usize>().ok()?.checked_sub(1).filter(|index| *index < self.names.len());
        self.places.get(name).copied().or_else(by_number)
    }

    fn called(&self, signal: usize) -> Option<&'a str> {
        let map = &self.options.columns;
        [map.t.as_deref(), Some(map.r.as_str()), Some(map.y.as_str()), Some(map.u.as_str())][signal]
    }

    /// A column that the user names.
    ///
    /// # Errors
    /// There is none, or there are two.
    fn asked_for(&self, name: &str, what_for: &str) -> Result<usize> {
        self.check_repeated(name)?;
        self.place(name).ok_or_else(|| no_column(name, what_for, self.names))
    }

    /// Refuses a name that two columns have.
    fn check_repeated(&self, name: &str) -> Result<()> {
        if self.names.iter().filter(|other| *other == name).nth(1).is_none() {
            return Ok(());
        }
        Err(Error::new(format!("two columns are called '{}'", excerpt(name)))
            .allowed("names that differ, or columns by their numbers, like --columns r=2,y=3,u=4"))
    }

    /// Where a signal is; `None` where nothing was named and nothing fits.
    fn signal(&self, signal: usize) -> Result<Option<(usize, bool)>> {
        if let Some(index) = self.exact[signal] {
            let called = self.called(signal).unwrap_or_default();
            called.split('+').try_for_each(|name| self.check_repeated(name.trim()))?;
            return Ok(Some((index, false)));
        }
        if self.options.columns.is_named[signal] {
            return Err(self.missing(signal));
        }
        match self.guesses[signal] {
            Guess::Column(index) => Ok(Some((index, true))),
            Guess::Either(one, other) => {
                self.check_repeated(&self.names[one])?;
                let letter = SIGNALS[signal];
                let what =
                    format!("'{}' and '{}' could both be {letter}", self.names[one], self.names[other]);
                Err(Error::new(what).allowed(format!("--columns {}", self.example(signal))))
            }
            Guess::Nothing => Ok(None),
        }
    }

    fn missing(&self, signal: usize) -> Error {
        let letter = SIGNALS[signal];
        let name = self.called(signal).unwrap_or(letter);
        let there = excerpt(&self.names.join(", "));
        let example = self.example(signal);
        let way = match signal {
            0 if !example.contains("t=") => format!("--columns {example} --sample-time S"),
            0 => format!("--columns {example} or --sample-time S"),
            _ => format!("--columns {example}"),
        };
        Error::new(format!("no column '{name}' for {letter}"))
            .allowed(format!("like {way}; the columns are {there}"))
    }

    /// `--columns` as it could be for this file: what is known, and for the rest columns that are there.
    fn example(&self, asked: usize) -> String {
        let known: Vec<Option<usize>> = (0..SIGNALS.len())
            .map(|signal| match (self.exact[signal], self.guesses[signal]) {
                (Some(index), _) => Some(index),
                (None, Guess::Column(index)) => Some(index),
                (None, Guess::Either(one, _)) => Some(one),
                (None, Guess::Nothing) => None,
            })
            .collect();
        let taken: HashSet<usize> = known.iter().copied().flatten().chain(self.date).collect();
        let mut free: Vec<usize> = (0..self.names.len()).filter(|index| !taken.contains(index)).collect();
        // What is usual for another signal, or has no name, is a worse example.
        free.sort_by_key(|index| (self.names[*index].is_empty(), is_usual(&self.names[*index])));
        // Where too few are left, there is no time.
        let lacking = [0, 2, 3].into_iter().filter(|signal| known[*signal].is_none()).count();
        let has_time = known[0].is_some() || free.len() >= lacking;
        let mut next = |signal: usize| {
            let fits = free.iter().position(|index| self.may_be(signal, *index))?;
            Some(free.remove(fits))
        };
        let is_wanted = |signal: usize| match signal {
            0 => {
                self.options.columns.t.is_some()
                    && (known[0].is_some() || self.options.sample_time_s.is_none())
                    && has_time
            }
            1 => known[1].is_some() || asked == 1,
            _ => true,
        };
        let pairs: Vec<String> = (0..SIGNALS.len())
            .filter(|signal| is_wanted(*signal))
            .filter_map(|signal| {
                let index = known[signal].or_else(|| next(signal));
                let name = match index {
                    Some(index) => written_with(self.names, self.date.filter(|_| signal == 0), index),
                    // No column is left that holds numbers or dates.
                    None if signal == 0 => return None,
                    None => "NAME".to_owned(),
                };
                Some(format!("{}={name}", SIGNALS[signal]))
            })
            .collect();
        quoted(&pairs)
    }

    /// Whether what a column holds may be a signal: numbers, or dates for the time.
    fn may_be(&self, signal: usize, index: usize) -> bool {
        match self.kinds.get(index).copied().unwrap_or_default() {
            CellKind::Text => false,
            CellKind::Date => signal == 0,
            CellKind::Number | CellKind::Unknown => true,
        }
    }
}

/// A name as `--columns` takes it: the column's number where the name has a comma, is empty or that of two columns.
fn written(names: &[String], index: usize) -> String {
    let name = &names[index];
    let is_plain = !name.is_empty() && !name.contains([',', '=', '"', '+']) && *name == excerpt(name);
    let is_only = names.iter().filter(|other| *other == name).nth(1).is_none();
    if is_plain && is_only { name.clone() } else { (index + 1).to_string() }
}

/// The same, with the column of the date before that of the time of the day.
fn written_with(names: &[String], date: Option<usize>, index: usize) -> String {
    let date = date.map_or_else(String::new, |date| format!("{}+", written(names, date)));
    format!("{date}{}", written(names, index))
}

/// Pairs as a shell takes them.
fn quoted(pairs: &[String]) -> String {
    let text = pairs.join(",");
    if text.contains([' ', '(', '[', '<', ';', '&', '|', '$', '*', '%']) {
        format!("\"{text}\"")
    } else {
        text
    }
}

impl Choice {
    /// Whether nothing is read of a row but its time, r, y and u.
    pub fn is_signals_alone(&self) -> bool {
        self.mode.is_none() && self.when.is_empty() && self.extra.is_empty()
    }

    /// Chooses among the columns of these names.
    ///
    /// # Errors
    /// A signal, condition or further column that isn't there, or could be two of them.
    pub fn of(columns: &[String], options: &ReadOptions) -> Result<Self> {
        Self::among(columns, &[], options)
    }

    /// The same where it is known what the columns hold.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn among(columns: &[String], kinds: &[CellKind], options: &ReadOptions) -> Result<Self> {
        let map = &options.columns;
        let names = Names::of(columns, kinds, options);
        let mut guessed = Vec::new();
        let mut place = |signal: usize| -> Result<Option<usize>> {
            let Some((index, is_guessed)) = names.signal(signal)? else { return Ok(None) };
            if is_guessed {
                let date = names.date.filter(|_| signal == 0).map(|date| format!("{}+", columns[date]));
                guessed.push(format!(
                    "{} = '{}{}'",
                    SIGNALS[signal],
                    date.unwrap_or_default(),
                    columns[index]
                ));
            }
            Ok(Some(index))
        };
        let t = match (&map.t, options.sample_time_s) {
            (Some(_), Some(_)) if !map.is_named[0] => names.exact[0],
            (Some(_), _) => Some(place(0)?.ok_or_else(|| names.missing(0))?),
            (None, Some(_)) => None,
            (None, None) => {
                return Err(Error::new("no column is t").allowed("--sample-time S, or --columns t=NAME"));
            }
        };
        let r = if map.r.is_empty() { None } else { place(1)? };
        let mut lacks = None;
        let mut needed = |signal: usize| match place(signal)? {
            Some(index) => Ok(Some(index)),
            None if options.incomplete => {
                let error = names.missing(signal);
                lacks.get_or_insert_with(|| Lack { says: error.to_string(), example: names.example(signal) });
                Ok(None)
            }
            None => Err(names.missing(signal)),
        };
        let (y, u) = (needed(2)?, needed(3)?);
        let mut notes = Vec::new();
        if !guessed.is_empty() {
            let guessed = guessed.join(", ");
            notes.push(format!("columns guessed by their names: {guessed} (--columns says otherwise)"));
        }
        let date = names.date.filter(|_| t.is_some());
        let with_date = |t: usize| match date {
            Some(date) => format!("{}+{}", columns[date], columns[t]),
            None => columns[t].clone(),
        };
        let chosen = ColumnMap {
            t: t.map(with_date),
            r: r.map_or_else(String::new, |r| columns[r].clone()),
            y: y.map_or_else(String::new, |y| columns[y].clone()),
            u: u.map_or_else(String::new, |u| columns[u].clone()),
            is_named: map.is_named,
        };
        let r = r.map_or(Reference::Absent, Reference::Column);
        let mut choice = Self { t, date, r, y, u, lacks, columns: chosen, notes, ..Self::default() };
        choice.find_conditions(&names)?;
        for name in &options.extra {
            let index = names.asked_for(name, "a further signal")?;
            choice.extra.push(Extra { name: name.clone(), index, asked_for: true, text: false });
        }
        if options.keep_extra {
            choice.keep_the_rest(columns);
        }
        Ok(choice)
    }

    /// The conditions that were asked for; without any, those that modes and qualities carry by themselves.
    fn find_conditions(&mut self, names: &Names) -> Result<()> {
        for when in names.options.when.iter().filter(|when| !when.is_always()) {
            let index = names.asked_for(&when.column, "a condition")?;
            self.when.push((index, when.clone()));
        }
        if !names.options.when.is_empty() {
            return Ok(());
        }
        let signals = self.signals();
        for (index, name) in names.names.iter().enumerate().filter(|(index, _)| !signals.contains(index)) {
            let readings = status_readings(name);
            // A column of words may name its mode before its last part: `MODE.ACTUAL`.
            let before =
                tag(name).filter(|_| names.kinds.get(index) == Some(&CellKind::Text)).map(status_readings);
            let status =
                readings.iter().chain(before.iter().flatten()).find_map(|plain| When::of_status(name, plain));
            let Some(when) = status else { continue };
            if self.mode.is_none() && when.status().is_some_and(Watched::is_mode) {
                self.mode = Some(index);
            }
            self.when.push((index, when));
        }
        Ok(())
    }

    /// What was guessed, and which rows don't count by a status that nobody asked for. What is said of the mode depends on whether
    /// it is a number.
    pub fn told(&self) -> impl Iterator<Item = String> + '_ {
        let of_status = self.when.iter().filter(|(index, _)| Some(*index) != self.mode);
        self.notes.iter().cloned().chain(of_status.filter_map(|(_, when)| when.note()))
    }

    /// What is said of a mode in words.
    pub fn told_of_mode(&self) -> Option<String> {
        self.when.iter().find(|(index, _)| Some(*index) == self.mode)?.1.note()
    }

    /// The name of the first column of a quality that carries its own condition.
    pub fn quality(&self) -> Option<&str> {
        let is_quality = |when: &&When| when.status().is_some_and(Watched::is_quality);
        self.when.iter().map(|(_, when)| when).find(is_quality).map(|when| when.column.as_str())
    }

    /// The places of t, r, y and u.
    fn signals(&self) -> Vec<usize> {
        [self.y, self.u, self.r.column(), self.t, self.date].into_iter().flatten().collect()
    }

    /// What is allowed where a column holds text: numbers, or for a signal another column, which `--columns` names.
    pub fn instead_of(&self, index: usize, names: &[String]) -> String {
        let signals = [self.t, self.r.column(), self.y, self.u];
        let taken = self.signals();
        let letter =
            SIGNALS.iter().zip(signals).find(|(_, signal)| *signal == Some(index)).map(|(letter, _)| *letter);
        // Best what is called by the letter itself; what is usual for another signal is a worse example.
        let other = (0..names.len())
            .filter(|other| letter.is_some() && !taken.contains(other) && !names[*other].is_empty())
            .min_by_key(|other| (Some(names[*other].as_str()) != letter, is_usual(&names[*other])));
        let Some(other) = other else { return "numbers".into() };
        let pairs: Vec<String> = SIGNALS
            .iter()
            .zip(signals)
            .filter_map(|(letter, signal)| {
                let column = if signal? == index { other } else { signal? };
                let date = self.date.filter(|_| *letter == SIGNALS[0]);
                Some(format!("{letter}={}", written_with(names, date, column)))
            })
            .collect();
        format!("numbers, or another column, like --columns {}", quoted(&pairs))
    }

    /// Whether each of so many columns is read at all.
    pub fn uses(&self, columns: usize) -> Vec<bool> {
        let mut used = vec![false; columns];
        let all = self.signals().into_iter();
        let all = all.chain(self.when.iter().map(|(index, _)| *index));
        for index in all.chain(self.extra.iter().map(|extra| extra.index)) {
            if let Some(used) = used.get_mut(index) {
                *used = true;
            }
        }
        used
    }

    fn keep_the_rest(&mut self, names: &[String]) {
        let taken: HashSet<usize> =
            self.signals().into_iter().chain(self.extra.iter().map(|extra| extra.index)).collect();
        for (index, name) in names.iter().enumerate() {
            if !taken.contains(&index) && !name.is_empty() {
                self.extra.push(Extra { name: name.clone(), index, asked_for: false, text: false });
            }
        }
    }
}

pub(super) fn no_column<S: AsRef<str>>(name: &str, what_for: &str, there: &[S]) -> Error {
    let there: Vec<&str> = there.iter().map(AsRef::as_ref).collect();
    Error::new(format!("no column '{name}' for {what_for}"))
        .allowed(format!("the columns are {}", excerpt(&there.join(", "))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example is read as it stands, and names the date with the time of the day.
    #[test]
    fn an_example_keeps_the_date_beside_the_time_of_the_day() {
        let names = ["Datum", "Uhrzeit", "Kessel", "Klappe", "Halle"].map(String::from);
        let incomplete = ReadOptions { incomplete: true, ..ReadOptions::default() };
        let example = Choice::of(&names, &incomplete).unwrap().lacks.unwrap().example;
        assert_eq!(example, "t=Datum+Uhrzeit,y=Kessel,u=Klappe");
        let options = ReadOptions { columns: example.parse().unwrap(), ..ReadOptions::default() };
        let choice = Choice::of(&names, &options).unwrap();
        assert_eq!((choice.date, choice.t, choice.y, choice.u), (Some(0), Some(1), Some(2), Some(3)));
        assert!(choice.instead_of(2, &names).contains("--columns t=Datum+Uhrzeit,y="));
    }
}
