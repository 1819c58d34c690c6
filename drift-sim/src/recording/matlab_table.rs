//! Tables and timetables of MATLAB as columns: `T.SP` is the variable `SP` of the table `T`, `T.Time` the times of a timetable's
//! rows. Durations are in seconds, dates are text, categories and strings too.

use jiff::Timestamp;
use jiff::tz::TimeZone;

use super::matlab_objects::{Arrays, Kind, Object, Objects};
use super::table::Cells;
use crate::{Error, Result};

/// Columns of a matrix within a table that become columns.
const ACROSS_MAX: usize = 256;
/// The length of a string that is missing.
const NO_STRING: u64 = u64::MAX;

/// A column of a table.
pub(super) struct TableColumn<Array> {
    pub name: String,
    pub rows: usize,
    content: Content<Array>,
}

enum Content<Array> {
    Numbers {
        array: Array,
        column: usize,
    },
    /// Milliseconds.
    Duration(Array),
    /// Milliseconds since 1970.
    Dates {
        array: Array,
        is_utc: bool,
    },
    /// Rows at even times: the first and the step, in seconds.
    Even {
        start_s: f64,
        step_s: f64,
    },
    /// The same where the first is a date.
    EvenDates {
        start_s: f64,
        step_s: f64,
        is_utc: bool,
    },
    /// One text in each cell.
    Texts(Array),
    /// The array that a string object keeps.
    Strings(Array),
    /// The number of its category for each row.
    Categories {
        codes: Array,
        names: Array,
    },
}

/// The columns of a table or timetable; `None` for an object that is neither, or is laid out in a way that isn't known.
///
/// # Errors
/// It is damaged, or takes more memory than there is.
pub(super) fn columns<A: Arrays>(
    arrays: &mut A,
    objects: &Objects<A::Array>,
    name: &str,
    reference: &[u64],
) -> Result<Option<Vec<TableColumn<A::Array>>>> {
    let Some(object) = objects.referred(reference) else { return Ok(None) };
    Reader { arrays, objects, name }.columns(&object)
}

struct Reader<'a, A: Arrays> {
    arrays: &'a mut A,
    objects: &'a Objects<A::Array>,
    name: &'a str,
}

type Columns<A> = Vec<TableColumn<<A as Arrays>::Array>>;

impl<A: Arrays> Reader<'_, A> {
    fn columns(&mut self, object: &Object<A::Array>) -> Result<Option<Columns<A>>> {
        let mut found = Vec::new();
        let (data, names) = match object.class.as_str() {
            "table" => (object.property("data").cloned(), object.property("varnames").cloned()),
            "timetable" => {
                let Some(whole) = object.property("any") else { return Ok(None) };
                let Kind::Fields(fields) = self.arrays.kind(whole)? else { return Ok(None) };
                let field =
                    |name: &str| fields.iter().find(|(own, _)| own == name).map(|(_, value)| value.clone());
                let times = field("rowTimes").zip(field("dimNames")).zip(field("numRows"));
                if let Some(((times, names), rows)) = times {
                    found.extend(self.row_times(&times, &names, &rows)?);
                }
                (field("data"), field("varNames"))
            }
            // A variable of its own that is an object: a vector of dates, say.
            _ => {
                let own = self.objects_column(object)?;
                return Ok(own
                    .map(|(rows, content)| vec![TableColumn { name: self.name.to_owned(), rows, content }]));
            }
        };
        let (Some(data), Some(names)) = (data, names) else { return Ok(None) };
        let Kind::Cells(data) = self.arrays.kind(&data)? else { return Ok(None) };
        for (array, own) in data.iter().zip(self.texts(&names)?) {
            let name = format!("{}.{own}", self.name);
            found.extend(self.variable(&name, array)?);
        }
        Ok(Some(found))
    }

    /// The columns of one variable of a table; none where it is of no use here.
    fn variable(&mut self, name: &str, array: &A::Array) -> Result<Columns<A>> {
        let column = |name: String, rows, content| TableColumn { name, rows, content };
        let one = |rows, content| vec![column(name.to_owned(), rows, content)];
        if let Some(object) = self.objects.object(self.arrays, array)? {
            return Ok(self
                .objects_column(&object)?
                .map_or_else(Vec::new, |(rows, content)| one(rows, content)));
        }
        Ok(match self.arrays.kind(array)? {
            Kind::Numbers { rows, across, is_complex: false } if across <= ACROSS_MAX => (0..across)
                .map(|index| {
                    let name = if across == 1 { name.to_owned() } else { format!("{name}(:,{})", index + 1) };
                    column(name, rows, Content::Numbers { array: array.clone(), column: index })
                })
                .collect(),
            Kind::Cells(cells) => one(cells.len(), Content::Texts(array.clone())),
            _ => Vec::new(),
        })
    }

    /// What a variable that is an object holds, with its rows.
    fn objects_column(&mut self, object: &Object<A::Array>) -> Result<Option<(usize, Content<A::Array>)>> {
        let content = match object.class.as_str() {
            "duration" => object.property("millis").map(|array| Content::Duration(array.clone())),
            "datetime" => {
                let is_utc = self.is_zoned(object)?;
                object.property("data").map(|array| Content::Dates { array: array.clone(), is_utc })
            }
            "categorical" => object
                .property("codes")
                .zip(object.property("categoryNames"))
                .map(|(codes, names)| Content::Categories { codes: codes.clone(), names: names.clone() }),
            "string" => {
                let Some(array) = object.property("any") else { return Ok(None) };
                let rows =
                    Strings::of(&self.arrays.whole_numbers(array)?).map(|strings| strings.lengths.len());
                return Ok(rows.map(|rows| (rows, Content::Strings(array.clone()))));
            }
            _ => None,
        };
        let Some(content) = content else { return Ok(None) };
        let array = match &content {
            Content::Duration(array)
            | Content::Dates { array, .. }
            | Content::Categories { codes: array, .. } => array,
            _ => return Ok(None),
        };
        Ok(match self.arrays.kind(array)? {
            Kind::Numbers { rows, across: 1, .. } => Some((rows, content)),
            _ => None,
        })
    }

    /// Whether dates count from 1970 in UTC, and not where they were written.
    fn is_zoned(&mut self, date: &Object<A::Array>) -> Result<bool> {
        let Some(zone) = date.property("tz") else { return Ok(false) };
        Ok(matches!(self.arrays.kind(zone)?, Kind::Text(zone) if !zone.is_empty()))
    }

    /// The times of a timetable's rows: one for each, or the first and the step.
    fn row_times(&mut self, times: &A::Array, names: &A::Array, rows: &A::Array) -> Result<Columns<A>> {
        let own = self.texts(names)?.into_iter().next().unwrap_or_else(|| "Time".to_owned());
        let name = format!("{}.{own}", self.name);
        let Kind::Fields(fields) = self.arrays.kind(times)? else { return self.variable(&name, times) };
        let field = |name: &str| fields.iter().find(|(own, _)| own == name).map(|(_, value)| value);
        let rows = self.number(Some(rows))?.filter(|rows| *rows >= 0.0 && *rows < 1e12);
        let step_s = match self.number(field("specifiedAsRate"))? {
            Some(1.0) => self.number(field("sampleRate"))?.map(|rate_hz| 1.0 / rate_hz),
            _ => self.seconds(field("stepSize"))?.map(|(step_s, _)| step_s),
        };
        let (Some(rows), Some(step_s), Some((start_s, date))) =
            (rows, step_s, self.seconds(field("origin"))?)
        else {
            return Ok(Vec::new());
        };
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked above")]
        let rows = rows as usize;
        let content = match date {
            Some(is_utc) => Content::EvenDates { start_s, step_s, is_utc },
            None => Content::Even { start_s, step_s },
        };
        Ok(vec![TableColumn { name, rows, content }])
    }

    /// A duration or a date as seconds, and for a date whether it is in UTC.
    fn seconds(&mut self, array: Option<&A::Array>) -> Result<Option<(f64, Option<bool>)>> {
        let Some(array) = array else { return Ok(None) };
        let Some(object) = self.objects.object(self.arrays, array)? else { return Ok(None) };
        let (milliseconds, date) = match object.class.as_str() {
            "duration" => (object.property("millis"), None),
            "datetime" => (object.property("data"), Some(self.is_zoned(&object)?)),
            _ => (None, None),
        };
        Ok(self.number(milliseconds)?.map(|milliseconds| (milliseconds / 1e3, date)))
    }

    /// The number of an array of one.
    fn number(&mut self, array: Option<&A::Array>) -> Result<Option<f64>> {
        let Some(array) = array else { return Ok(None) };
        match self.arrays.kind(array)? {
            Kind::Numbers { rows: 1, across: 1, .. } => Ok(self.arrays.column(array, 0)?.number(0)),
            _ => Ok(None),
        }
    }

    fn texts(&mut self, array: &A::Array) -> Result<Vec<String>> {
        Ok(texts(self.arrays, array)?.into_iter().map(Option::unwrap_or_default).collect())
    }
}

/// The texts of an array of cells; `None` for a cell that holds none.
fn texts<A: Arrays>(arrays: &mut A, array: &A::Array) -> Result<Vec<Option<String>>> {
    let Kind::Cells(cells) = arrays.kind(array)? else { return Ok(Vec::new()) };
    let mut found = Vec::new();
    for cell in &cells {
        let text = if let Kind::Text(text) = arrays.kind(cell)? { Some(text) } else { None };
        push(arrays, &mut found, text)?;
    }
    Ok(found)
}

fn push(arrays: &impl Arrays, into: &mut Vec<Option<String>>, text: Option<String>) -> Result<()> {
    arrays.budget().take(text.as_ref().map_or(0, String::capacity) as u64)?;
    arrays.budget().push(into, text)
}

impl<Array: Clone> TableColumn<Array> {
    /// The column's cells.
    ///
    /// # Errors
    /// It is damaged, or takes more memory than there is.
    pub fn cells(&self, arrays: &mut impl Arrays<Array = Array>) -> Result<Cells> {
        match &self.content {
            Content::Numbers { array, column } => arrays.column(array, *column),
            Content::Duration(array) => {
                let cells = arrays.column(array, 0)?;
                let seconds = (0..cells.len()).map(|row| cells.number(row).unwrap_or(f64::NAN) / 1e3);
                arrays.budget().take(8 * self.rows as u64)?;
                Ok(Cells::Double(seconds.collect()))
            }
            Content::Even { start_s, step_s } => {
                arrays.budget().take(8 * self.rows as u64)?;
                Ok(Cells::Double((0..self.rows).map(|row| start_s + row as f64 * step_s).collect()))
            }
            Content::Dates { array, is_utc } => {
                let cells = arrays.column(array, 0)?;
                self.each_row(arrays, |row| date(cells.number(row)? / 1e3, *is_utc))
            }
            Content::EvenDates { start_s, step_s, is_utc } => {
                self.each_row(arrays, |row| date(start_s + row as f64 * step_s, *is_utc))
            }
            Content::Texts(array) => texts(arrays, array).map(Cells::Text),
            Content::Strings(array) => {
                let words = arrays.whole_numbers(array)?;
                let strings =
                    Strings::of(&words).ok_or_else(|| Error::new("a column of strings is damaged"))?;
                let mut strings = strings.texts();
                self.each_row(arrays, |_| strings.next().flatten())
            }
            Content::Categories { codes, names } => {
                let names = texts(arrays, names)?;
                let codes = arrays.whole_numbers(codes)?;
                // The first is 1; 0 is no category.
                let name =
                    |code: u64| names.get(usize::try_from(code).ok()?.checked_sub(1)?).cloned().flatten();
                self.each_row(arrays, |row| name(*codes.get(row)?))
            }
        }
    }

    fn each_row(&self, arrays: &impl Arrays, mut text: impl FnMut(usize) -> Option<String>) -> Result<Cells> {
        let mut found = Vec::new();
        for row in 0..self.rows {
            push(arrays, &mut found, text(row))?;
        }
        Ok(Cells::Text(found))
    }
}

/// Seconds since 1970 as a date and time to the microsecond.
fn date(seconds: f64, is_utc: bool) -> Option<String> {
    let microseconds = (seconds * 1e6).round();
    if microseconds.is_nan() || microseconds.abs() >= 1e18 {
        return None;
    }
    #[allow(clippy::cast_possible_truncation, reason = "checked above")]
    let at = Timestamp::from_microsecond(microseconds as i64).ok()?;
    Some(if is_utc { at.to_string() } else { TimeZone::UTC.to_datetime(at).to_string() })
}

/// What a string object keeps: a version, the dimensions, the length of each string, and all letters in UTF-16, four in a word.
struct Strings<'a> {
    lengths: &'a [u64],
    letters: &'a [u64],
}

impl<'a> Strings<'a> {
    fn of(words: &'a [u64]) -> Option<Self> {
        let &[1, dimensions, ref rest @ ..] = words else { return None };
        let dimensions = usize::try_from(dimensions).ok()?;
        let (shape, rest) = rest.split_at_checked(dimensions)?;
        let count = shape.iter().try_fold(1, |n: usize, d| n.checked_mul(usize::try_from(*d).ok()?))?;
        let (lengths, letters) = rest.split_at_checked(count)?;
        Some(Self { lengths, letters })
    }

    fn texts(self) -> impl Iterator<Item = Option<String>> {
        let unit = |index: usize| Some((self.letters.get(index / 4)? >> (16 * (index % 4)) & 0xffff) as u16);
        let mut at = 0_usize;
        self.lengths.iter().map(move |length| {
            if *length == NO_STRING {
                return None;
            }
            let end = at.checked_add(usize::try_from(*length).ok()?)?;
            let units: Vec<u16> = (at..end).map_while(unit).collect();
            at = end;
            Some(String::from_utf16_lossy(&units))
        })
    }
}
