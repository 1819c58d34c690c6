//! Recordings from columns that are in memory already: arrays and tables of other programs. They pass the checks that files
//! pass, and say the same words; rows count as lines from 1.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use super::budget::{Budget, MEMORY_LIMIT_BYTES};
use super::choice::{Choice, Extra, Reference};
use super::overview::sampling;
use super::row::{Row, Rows};
use super::stamp::Stamp;
use super::stretch::{self, Stretch};
use super::table::{Cells, TableRows};
use super::{Overview, Quality, ReadOptions, Recording, RecordingStream, RowState};
use crate::Result;
use crate::controller::Controller;
use crate::physics::Units;

/// What [`Overview::format`] calls them.
const FORMAT: &str = "columns in memory";

fn budget(options: &ReadOptions) -> Budget {
    Budget::of(options.memory_limit_bytes.unwrap_or(MEMORY_LIMIT_BYTES))
}

impl RecordingStream {
    /// Reads named columns sample by sample; errors call them by `name`.
    ///
    /// # Errors
    /// A column is missing or of another length than y, or the first rows are not uniformly sampled numbers.
    pub fn from_columns(name: &str, columns: Vec<(String, Cells)>, options: &ReadOptions) -> Result<Self> {
        let open = || {
            options.check()?;
            let rows = TableRows::new(columns, Vec::new(), options)?;
            Self::of_rows(name, Box::new(rows), budget(options), Arc::new(AtomicU64::new(0)), options)
        };
        open().map_err(|e| e.in_file(name))
    }
}

/// The samples of a recording, one a row.
struct Samples {
    recording: Arc<Recording>,
    choice: Choice,
    names: Vec<String>,
    next: usize,
}

impl Samples {
    fn of(recording: Arc<Recording>) -> Self {
        let further = recording.extra.iter().enumerate();
        let extra = further.map(|(index, (name, _))| Extra {
            name: name.clone(),
            index,
            asked_for: true,
            text: false,
        });
        let choice = Choice {
            r: Reference::Column(0),
            extra: extra.collect(),
            columns: recording.columns.clone(),
            ..Choice::default()
        };
        Self {
            names: recording.extra.iter().map(|(name, _)| name.clone()).collect(),
            choice,
            recording,
            next: 0,
        }
    }
}

impl Rows for Samples {
    fn choice(&self) -> &Choice {
        &self.choice
    }

    fn names(&self) -> &[String] {
        &self.names
    }

    fn notes(&self) -> Vec<String> {
        self.recording.quality.notes.clone()
    }

    fn zero_s(&self) -> Option<f64> {
        self.recording.zero_s
    }

    fn stated_law(&self) -> Option<Controller> {
        self.recording.stated_law.clone()
    }

    fn units(&self) -> Units {
        self.recording.units.clone()
    }

    fn read(&mut self, row: &mut Row, _: &mut Quality) -> Result<bool> {
        let (of, at) = (&self.recording, self.next);
        let Some(state) = of.state.get(at) else { return Ok(false) };
        self.next += 1;
        let value = |column: &[f64]| column.get(at).copied().unwrap_or(f64::NAN);
        (row.r, row.y, row.u) = (value(&of.r), value(&of.y), value(&of.u));
        row.manual = *state == RowState::Manual;
        row.line = self.next as u64;
        row.extra.clear();
        row.extra.extend(of.extra.iter().map(|(_, column)| value(column)));
        Ok(true)
    }

    fn read_ahead(&mut self, stretch: &mut Stretch, _: &mut Quality) {
        let of = &self.recording;
        if !self.choice.is_signals_alone() {
            return;
        }
        let states = of.state.iter().skip(self.next).take(stretch::ROWS);
        let is_there =
            |at: usize| [&of.r, &of.y, &of.u].iter().all(|x| x.get(at).is_some_and(|x| x.is_finite()));
        let valid =
            states.enumerate().take_while(|(n, s)| **s != RowState::Manual && is_there(self.next + n));
        let to = self.next + valid.count();
        stretch.extend([&of.r, &of.y, &of.u].map(|signal| signal.get(self.next..to).unwrap_or_default()));
        for line in self.next + 1..=to {
            stretch.date(line as u64, Stamp::default());
        }
        self.next = to;
    }
}

impl RecordingStream {
    /// Hands out the samples of a recording that was read before, with these of its further columns, in this order.
    ///
    /// # Errors
    /// It has no such column.
    pub fn from_recording(recording: &Recording, further: &[String]) -> Result<Self> {
        let column = |name: &String| recording.column(name).map(|values| (name.clone(), values.to_vec()));
        let extra = further.iter().map(column).collect::<Result<_>>()?;
        let recording = Arc::new(Recording { extra, ..recording.clone() });
        let (name, quality) = (recording.name.clone(), recording.quality.clone());
        let (sample_time_s, start_s) = (recording.sample_time_s, recording.start_s);
        Ok(Self::of_samples(&name, Box::new(Samples::of(recording)), sample_time_s, start_s, quality))
    }
}

impl Recording {
    /// Takes named columns, one of them the time unless the options give a sample time; errors call them by `name`.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn from_columns(name: &str, columns: Vec<(String, Cells)>, options: &ReadOptions) -> Result<Self> {
        Self::collect(RecordingStream::from_columns(name, columns, options)?)
    }
}

impl Overview {
    /// Looks at named columns as they are; errors call them by `name`.
    ///
    /// # Errors
    /// A column holds text where numbers belong, is missing or of another length than y.
    pub fn from_columns(name: &str, columns: Vec<(String, Cells)>, options: &ReadOptions) -> Result<Self> {
        let look = || {
            let rows = TableRows::new(columns.clone(), Vec::new(), options)?;
            Self::of_rows(name, Box::new(rows), FORMAT, &budget(options), options)
        };
        let mut overview = look().map_err(|e| e.in_file(name))?;
        overview.sampling = Some(sampling(RecordingStream::from_columns(name, columns, options)));
        Ok(overview)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::RowState;

    fn columns(t: Cells, y: Vec<f64>) -> Vec<(String, Cells)> {
        let u = y.iter().map(|y| 2.0 * y).collect();
        let r = Cells::Single(vec![1.0; y.len()]);
        [("t", t), ("r", r), ("y", Cells::Double(y)), ("u", Cells::Double(u))]
            .map(|(name, cells)| (name.to_owned(), cells))
            .into()
    }

    /// Against the same rows as the text of a CSV file: a gap, a missing value, rounded stamps.
    #[test]
    fn columns_are_read_as_the_same_rows_of_a_file() {
        let t: Vec<f64> =
            (0..300).filter(|k| *k != 120).map(|k| (f64::from(k) * 6.6).round() / 100.0).collect();
        let y: Vec<f64> = (0..299).map(|k| if k == 7 { f64::NAN } else { f64::from(k).sin() }).collect();
        let mut text = String::from("t,r,y,u\n");
        for (t, y) in t.iter().zip(&y) {
            let cell = |x: f64| if x.is_nan() { String::new() } else { x.to_string() };
            text += &format!("{t},1,{},{}\n", cell(*y), cell(2.0 * y));
        }
        let options = ReadOptions::default();
        let of_file = Recording::from_reader("x", std::io::Cursor::new(text), &options).unwrap();
        let of_memory = Recording::from_columns("x", columns(Cells::Double(t), y), &options).unwrap();
        assert_eq!(of_memory.sample_time_s, 0.066);
        assert_eq!(of_memory.state[120], RowState::Missing);
        let bits =
            |r: &Recording| [&r.r, &r.y, &r.u].map(|x| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>());
        assert_eq!(bits(&of_memory), bits(&of_file));
        assert_eq!(of_memory.state, of_file.state);
        // A file's first line is its header.
        let line = of_memory.quality.time_deviation_max_line + 1;
        assert_eq!(Quality { time_deviation_max_line: line, ..of_memory.quality }, of_file.quality);
    }

    #[test]
    fn stamps_are_checked_as_those_of_files() {
        let refused = |t: Vec<f64>| {
            let y = (0..t.len()).map(|k| k as f64).collect();
            Recording::from_columns("array", columns(Cells::Double(t), y), &ReadOptions::default())
                .unwrap_err()
                .to_string()
        };
        assert!(refused(vec![0.0, 0.1, 0.2, 0.1]).starts_with("array:4: time goes back"));
        assert!(refused(vec![0.0, 0.1, 0.25, 0.3, 0.42]).contains("the sampling is not uniform"));
        assert!(refused(vec![0.0]).contains("row"));
        let dates = ["2024-05-01 12:00:00", "2024-05-01 12:00:01"].map(|d| Some(d.to_owned()));
        let dated = columns(Cells::Text(dates.into()), vec![1.0, 2.0]);
        let dated = Recording::from_columns("array", dated, &ReadOptions::default()).unwrap();
        assert_eq!((dated.sample_time_s, dated.zero_s), (1.0, Some(1_714_564_800.0)));
    }

    #[test]
    fn a_recording_streams_its_own_samples() {
        let t = Cells::Double((0..50).filter(|k| *k != 20).map(|k| f64::from(k) * 0.5 + 3.0).collect());
        let y = (0..49).map(|k| if k == 7 { f64::NAN } else { f64::from(k) }).collect();
        let mut all = columns(t, y);
        all.push(("hand".into(), Cells::Double((0..49).map(|k| f64::from(u8::from(k > 40))).collect())));
        let options =
            ReadOptions { keep_extra: true, when: vec!["hand=0".parse().unwrap()], ..ReadOptions::default() };
        let read = Recording::from_columns("x", all, &options).unwrap();
        let again = RecordingStream::from_recording(&read, &["hand".into()]).unwrap();
        let again = Recording::collect(again).unwrap();
        assert_eq!(
            (&again.state, &again.quality, &again.columns),
            (&read.state, &read.quality, &read.columns)
        );
        assert_eq!((again.start_s, again.sample_time_s), (3.0, 0.5));
        let bits = |r: &Recording| {
            [&r.r, &r.y, &r.u, &r.extra[0].1].map(|x| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>())
        };
        assert_eq!(bits(&again), bits(&read));
        assert!(RecordingStream::from_recording(&read, &["none".into()]).is_err());
    }

    #[test]
    fn a_look_tells_what_cannot_be_read() {
        let t = Cells::Double(vec![0.0, 0.1, 0.25, 0.3, 0.42]);
        let seen =
            Overview::from_columns("array", columns(t, vec![1.0; 5]), &ReadOptions::default()).unwrap();
        assert_eq!((seen.format, seen.t_s.len()), (FORMAT, 5));
        assert!(seen.sampling.is_some_and(|sampling| sampling.is_err()));
    }
}
