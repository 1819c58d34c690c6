//! Tables with a row for each value: `entity_id,state,last_changed`, `Tag;Time;Value`. Historians, message brokers and databases
//! export these, tag after tag or in the order of time.
//!
//! Each tag becomes a column. The rows are those of y's tag, with its times; other tags hold their last value before each of them.
//! All rows are held in memory, within the budget.

use std::collections::HashMap;

use super::budget::Budget;
use super::cell_kind::{CellKind, FirstRows};
use super::choice::Choice;
use super::clock::Clock;
use super::guess::{Guess, guess, plain, status_readings};
use super::records::{Record, Records};
use super::row::excerpt;
use super::text_rows::{Header, TextRows};
use super::when::When;
use super::{Quality, ReadOptions};
use crate::{Error, Result};

/// Names of a column that says what a row is the value of, without anything between their letters.
const TAGS: &[&str] = &[
    "tag",
    "tagname",
    "tagindex",
    "name",
    "varname",
    "variable",
    "variablename",
    "entityid",
    "series",
    "signal",
    "signalname",
    "point",
    "pointname",
    "pointid",
    "metric",
    "field",
    "topic",
    "channel",
    "sensor",
    "item",
    "itemid",
    "nodeid",
    "parameter",
    "param",
    "messstelle",
    "variavel",
    "grandeur",
];
/// Names of a column of values.
const VALUES: &[&str] = &[
    "value", "val", "varvalue", "values", "state", "wert", "valeur", "valor", "valore", "payload", "reading",
];
/// Tags, at most: each row looks at all of them.
const TAGS_MAX: usize = 1000;
/// Values of a tag that are looked at to see what it holds.
const FIRST_VALUES: usize = 1000;
/// What an entry takes beside its text, bytes: itself, in a list that grows by doubling, and two texts of their own.
const ENTRY_BYTES: u64 = 160;

/// Which columns say when, what and how much.
pub(super) struct LongTable {
    time: usize,
    date: Option<usize>,
    tag: usize,
    value: usize,
    /// Where a value does not count.
    status: Vec<(usize, When)>,
}

/// One value of a tag.
struct Entry {
    t_s: f64,
    line: u64,
    time: Box<[u8]>,
    value: Box<[u8]>,
}

impl Entry {
    fn text(&self) -> &str {
        std::str::from_utf8(&self.value).unwrap_or_default()
    }
}

/// The values of one tag.
struct Series {
    tag: String,
    clock: Clock,
    entries: Vec<Entry>,
}

impl LongTable {
    /// `None` where the header is that of any other table.
    pub fn of(header: &Header, options: &ReadOptions) -> Option<Self> {
        let names = &header.names;
        let kinds = &header.first_rows.kinds();
        let is_there = |name: &str| names.iter().any(|other| other == name);
        let time = options.columns.t.as_deref().and_then(|t| names.iter().position(|name| name == t));
        let (found, date) = guess(names, kinds, [time, None, None, None]);
        let is_signal = |guess: Guess| match guess {
            Guess::Nothing => false,
            Guess::Either(..) => true,
            Guess::Column(index) => kinds.get(index) != Some(&CellKind::Text),
        };
        let are_named = is_there(&options.columns.y) && is_there(&options.columns.u);
        if are_named || (is_signal(found[2]) && is_signal(found[3])) {
            return None;
        }
        let Guess::Column(time) = found[0] else { return None };
        let only = |fits: &dyn Fn(usize, &str) -> bool| {
            let mut all = (0..names.len()).filter(|index| {
                let readings = names.get(*index).map(|name| plain(name));
                *index != time && readings.is_some_and(|all| all.iter().any(|name| fits(*index, name)))
            });
            all.next().filter(|_| all.next().is_none())
        };
        let kind = |index: usize| kinds.get(index).copied().unwrap_or_default();
        let is_tag = |index: usize, name: &str| {
            TAGS.contains(&name) && (kind(index) == CellKind::Text || name == "tagindex")
        };
        let is_value =
            |index: usize, name: &str| VALUES.contains(&name) && !matches!(kind(index), CellKind::Date);
        let (tag, value) = (only(&is_tag)?, only(&is_value)?);
        let others = names.iter().enumerate().filter(|(index, _)| ![time, tag, value].contains(index));
        let status = others.filter_map(|(index, name)| {
            let when = status_readings(name).iter().find_map(|plain| When::of_status(name, plain))?;
            Some((index, when))
        });
        (tag != value).then(|| Self { time, date, tag, value, status: status.collect() })
    }

    /// The rows of y's tag, with the values of all others.
    ///
    /// # Errors
    /// The source can't be read, goes back in time or takes more memory than is allowed; a column is missing.
    pub fn rows(
        &self,
        mut records: impl Records,
        header: Header,
        options: &ReadOptions,
        budget: &Budget,
    ) -> Result<TextRows<LongRecords>> {
        let mut quality = Quality::default();
        let mut series = self.series(&mut records, &header, options, budget, &mut quality)?;
        let time_name = header.names.get(self.time).cloned().unwrap_or_default();
        let tags = series.iter().map(|series| series.tag.clone());
        let names: Vec<String> = std::iter::once(time_name).chain(tags).collect();
        let when = header.first_rows.column(self.date.unwrap_or(self.time)).map(str::to_owned).collect();
        let first_rows =
            FirstRows::of_columns(std::iter::once(when).chain(series.iter().map(Series::first)).collect());
        let mut notes = records.notes();
        let what = header.names.get(self.tag).map_or("", String::as_str);
        notes.push(format!(
            "a row holds one value: the columns are the {} in '{what}'",
            count(series.len(), "name")
        ));
        notes.extend(series.iter_mut().filter_map(Series::without_words));
        let (base, told) = base(&names, &first_rows.kinds(), &series, options);
        notes.extend(told);
        let units = header.units.get(self.time).cloned().into_iter().collect();
        let header = Header { names, units, first_rows, mark: header.mark };
        let at = vec![0; series.len()];
        TextRows::new(LongRecords { series, base, at, next: 0, notes }, header, options)
    }

    /// Every tag with its values, in the order of time.
    fn series(
        &self,
        records: &mut impl Records,
        header: &Header,
        options: &ReadOptions,
        budget: &Budget,
        quality: &mut Quality,
    ) -> Result<Vec<Series>> {
        let name = header.names.get(self.time).map_or("", String::as_str);
        let unit = header.units.get(self.time).filter(|unit| !unit.is_empty()).map(String::as_str);
        // Each tag has a clock of its own, all of them with the same time 0.
        let (mut first, mut started) = (Clock::of(name, unit, options)?, false);
        first.foresee(header.first_rows.column(self.date.unwrap_or(self.time)))?;
        let (mut places, mut all): (HashMap<String, usize>, Vec<Series>) = (HashMap::new(), Vec::new());
        let (mut record, mut mark) = (Record::default(), header.mark);
        while let Some(line) = records.next(&mut record, quality)? {
            if let Some(error) = record.broken() {
                return Err(error.clone());
            }
            let cell = |index: usize| record.get(index).unwrap_or_default();
            let tag = String::from_utf8_lossy(cell(self.tag)).into_owned();
            // The header may come again before each tag.
            if tag.is_empty() || header.names.get(self.tag) == Some(&tag) {
                continue;
            }
            let mut time = cell(self.time).to_vec();
            if let Some(date) = self.date.filter(|_| time.contains(&b':')) {
                time = [cell(date), b" ", &time].concat();
            }
            let place = match places.get(&tag) {
                Some(place) => *place,
                None if all.len() >= TAGS_MAX => {
                    let what =
                        format!("more than {TAGS_MAX} names in '{}'", excerpt(&header.names[self.tag]));
                    return Err(Error::new(what).at_line(line));
                }
                None => {
                    if !started {
                        first.read(&time, &mut mark).map_err(|e| e.at_line(line))?;
                        started = true;
                    }
                    budget.take(ENTRY_BYTES + 2 * tag.len() as u64)?;
                    places.insert(tag.clone(), all.len());
                    all.push(Series { tag, clock: first.clone(), entries: Vec::new() });
                    all.len() - 1
                }
            };
            let Some(series) = all.get_mut(place) else { continue };
            let t_s = series.clock.read(&time, &mut mark).map_err(|e| e.at_line(line))?.t_s;
            let counts = self.status.iter().all(|(index, when)| when.holds(cell(*index)));
            let value = if counts { cell(self.value) } else { b"" };
            budget.take(ENTRY_BYTES + (time.len() + value.len()) as u64)?;
            series.entries.push(Entry { t_s, line, time: time.into(), value: value.into() });
        }
        all.iter_mut().try_for_each(Series::put_in_order)?;
        Ok(all)
    }
}

impl Series {
    fn kind(&self) -> CellKind {
        CellKind::of_column(self.entries.iter().map(Entry::text))
    }

    /// The first values.
    fn first(&self) -> Vec<String> {
        self.entries.iter().take(FIRST_VALUES).map(|entry| entry.text().to_owned()).collect()
    }

    /// Among numbers, words for the state of a sensor are missing values: how many there are, with an example.
    fn without_words(&mut self) -> Option<String> {
        if self.kind() != CellKind::Number {
            return None;
        }
        let (mut count, mut example) = (0_usize, String::new());
        for entry in &mut self.entries {
            if CellKind::of_column([entry.text()]) == CellKind::Text {
                example = entry.text().to_owned();
                count += 1;
                entry.value = Box::default();
            }
        }
        let tag = excerpt(&self.tag);
        (count > 0).then(|| {
            format!(
                "{count} of the values of '{tag}' are no numbers, like '{}': they are missing",
                excerpt(&example)
            )
        })
    }

    /// Puts rows that go back in time, the latest first, the right way round.
    fn put_in_order(&mut self) -> Result<()> {
        if let [first, .., last] = self.entries.as_slice()
            && first.t_s > last.t_s
        {
            self.entries.reverse();
        }
        let back = self.entries.windows(2).find(|pair| matches!(pair, [a, b] if b.t_s < a.t_s));
        match back {
            Some([_, b]) => Err(Error::new(format!("the time of '{}' goes back", excerpt(&self.tag)))
                .allowed("rows in the order of time")
                .at_line(b.line)),
            _ => Ok(()),
        }
    }
}

/// The tag whose times count, and what is told of it: y's, or the one with the most values where y is not known.
fn base(
    names: &[String],
    kinds: &[CellKind],
    series: &[Series],
    options: &ReadOptions,
) -> (usize, Option<String>) {
    let lenient = ReadOptions { incomplete: true, ..options.clone() };
    let y = Choice::among(names, kinds, &lenient).ok().and_then(|choice| choice.y?.checked_sub(1));
    let longest = || (0..series.len()).max_by_key(|at| (series[*at].entries.len(), usize::MAX - at));
    let base = y.or_else(longest).unwrap_or(0);
    let others = series.iter().any(|other| series.get(base).is_some_and(|base| !other.has_times_of(base)));
    let tag = series.get(base).map_or("", |series| series.tag.as_str());
    (base, others.then(|| format!("all others hold their last value before each '{}'", excerpt(tag))))
}

impl Series {
    #[expect(clippy::float_cmp, reason = "the same text is the same time")]
    fn has_times_of(&self, base: &Self) -> bool {
        let same = self.entries.iter().zip(&base.entries).all(|(a, b)| a.t_s == b.t_s);
        same && self.entries.len() == base.entries.len()
    }
}

fn count(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// The rows of one tag, with the values of all others.
pub(super) struct LongRecords {
    series: Vec<Series>,
    base: usize,
    /// How many entries of each series were reached.
    at: Vec<usize>,
    next: usize,
    notes: Vec<String>,
}

impl Records for LongRecords {
    fn next(&mut self, record: &mut Record, _: &mut Quality) -> Result<Option<u64>> {
        let Some(entry) = self.series.get(self.base).and_then(|base| base.entries.get(self.next)) else {
            return Ok(None);
        };
        self.next += 1;
        record.clear();
        record.push(&entry.time);
        for (place, (series, at)) in self.series.iter().zip(&mut self.at).enumerate() {
            while series.entries.get(*at).is_some_and(|other| other.t_s <= entry.t_s) {
                *at += 1;
            }
            let own = if place == self.base { Some(entry) } else { series.entries.get(at.wrapping_sub(1)) };
            record.push(own.map_or(&b""[..], |entry| &entry.value));
        }
        Ok(Some(entry.line))
    }

    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }
}
