//! The columns that are read of all that a file holds: named by the user, called by their letter, or guessed.

use std::collections::{HashMap, HashSet};

use super::guess::{Guess, SIGNALS, guess, is_usual, plain};
use super::row::excerpt;
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
    /// The column of a mode, whose codes may be numbers, and the note on its words.
    pub mode: Option<(usize, String)>,
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
    places: HashMap<&'a str, usize>,
    options: &'a ReadOptions,
    /// Where the columns that the options name are.
    exact: [Option<usize>; 4],
    guesses: [Guess; 4],
    date: Option<usize>,
}

impl<'a> Names<'a> {
    fn of(names: &'a [String], options: &'a ReadOptions) -> Self {
        let mut places = HashMap::with_capacity(names.len());
        for (index, name) in names.iter().enumerate() {
            places.entry(name.as_str()).or_insert(index);
        }
        let mut all =
            Self { names, places, options, exact: [None; 4], guesses: [Guess::Nothing; 4], date: None };
        let t = all.called(0).map(str::to_owned);
        if let Some((date, time)) = t.as_deref().and_then(|t| t.split_once('+'))
            && all.place(t.as_deref().unwrap_or_default()).is_none()
            && let (Some(date), Some(time)) = (all.place(date.trim()), all.place(time.trim()))
        {
            all.date = Some(date);
            all.exact[0] = Some(time);
        }
        for signal in 0..SIGNALS.len() {
            let found = all.called(signal).filter(|name| !name.is_empty()).and_then(|name| all.place(name));
            all.exact[signal] = all.exact[signal].or(found);
        }
        let (guesses, date) = guess(names, all.exact);
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

    /// Where a signal is; `None` where nothing was named and nothing fits.
    fn signal(&self, signal: usize) -> Result<Option<(usize, bool)>> {
        if let Some(index) = self.exact[signal] {
            return Ok(Some((index, false)));
        }
        if self.options.columns.is_named[signal] {
            return Err(self.missing(signal));
        }
        match self.guesses[signal] {
            Guess::Column(index) => Ok(Some((index, true))),
            Guess::Either(one, other) => {
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
        let otherwise = if signal == 0 { " or --sample-time S" } else { "" };
        Error::new(format!("no column '{name}' for {letter}"))
            .allowed(format!("like --columns {}{otherwise}; the columns are {there}", self.example(signal)))
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
        let is_free = |index: &usize| !taken.contains(index) && !self.names[*index].is_empty();
        let free: Vec<usize> = (0..self.names.len()).filter(is_free).collect();
        // What is usual for another signal is a worse example.
        let (usual, others): (Vec<usize>, Vec<usize>) =
            free.into_iter().partition(|index| is_usual(&self.names[*index]));
        let mut free = others.into_iter().chain(usual);
        let is_wanted = |signal: usize| match signal {
            0 => {
                self.options.columns.t.is_some()
                    && (known[0].is_some() || self.options.sample_time_s.is_none())
            }
            1 => known[1].is_some() || asked == 1,
            _ => true,
        };
        let pairs: Vec<String> = (0..SIGNALS.len())
            .filter(|signal| is_wanted(*signal))
            .map(|signal| {
                let index = known[signal].or_else(|| free.next());
                let name = index.map_or_else(|| "NAME".to_owned(), |index| self.written(index));
                format!("{}={name}", SIGNALS[signal])
            })
            .collect();
        quoted(&pairs)
    }

    fn written(&self, index: usize) -> String {
        written(self.names, index)
    }
}

/// A name as `--columns` takes it: the column's number where the name has a comma.
fn written(names: &[String], index: usize) -> String {
    let name = excerpt(&names[index]);
    if name.contains([',', '=', '"', '+']) { (index + 1).to_string() } else { name }
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
        let map = &options.columns;
        let names = Names::of(columns, options);
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
        let chosen = ColumnMap {
            t: t.map(|t| columns[t].clone()),
            r: r.map_or_else(String::new, |r| columns[r].clone()),
            y: y.map_or_else(String::new, |y| columns[y].clone()),
            u: u.map_or_else(String::new, |u| columns[u].clone()),
            is_named: map.is_named,
        };
        let date = names.date.filter(|_| t.is_some());
        let r = r.map_or(Reference::Absent, Reference::Column);
        let mut choice = Self { t, date, r, y, u, lacks, columns: chosen, notes, ..Self::default() };
        choice.find_conditions(&names)?;
        for name in &options.extra {
            let index = names.place(name).ok_or_else(|| no_column(name, "a further signal", columns))?;
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
            let index = names.place(&when.column);
            let index = index.ok_or_else(|| no_column(&when.column, "a condition", names.names))?;
            self.when.push((index, when.clone()));
        }
        if !names.options.when.is_empty() {
            return Ok(());
        }
        let signals = self.signals();
        for (index, name) in names.names.iter().enumerate().filter(|(index, _)| !signals.contains(index)) {
            let readings = plain(name);
            let status = readings.iter().find_map(|plain| Some((When::of_status(name, plain)?, plain)));
            let Some((when, plain)) = status else { continue };
            let example = format!("{name}={}", When::closed_value(plain));
            let example = if example.contains(' ') { format!("\"{example}\"") } else { example };
            let note = format!(
                "rows where '{name}' says that the loop is not closed or the value is bad don't count (--when {example} or \
                 --when always says otherwise)"
            );
            self.when.push((index, when));
            if self.mode.is_none() && When::may_be_a_code(plain) {
                self.mode = Some((index, note));
            } else {
                self.notes.push(note);
            }
        }
        Ok(())
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
                Some(format!("{letter}={}", written(names, column)))
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
