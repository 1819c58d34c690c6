//! A recording that comes in pieces: whoever gets rows batch by batch, from a database or a query engine, hands them over as they come
//! and takes the samples that they make. They pass the checks that files pass, and become the same samples.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::mpsc::{Receiver, Sender, channel};

use super::budget::{Budget, MEMORY_LIMIT_BYTES};
use super::choice::Choice;
use super::sampling::HEAD_ROWS;
use super::table::{Batches, Cells, TableRows};
use super::{ReadOptions, RecordingStream, Repeated, Sample, Samples};
use crate::{Error, Result};

/// Named columns of equal length: some rows of a recording.
pub type Piece = Vec<(String, Cells)>;

/// A recording whose rows come in pieces. The first 10 000 rows are held until they show the sampling; after them, nothing but
/// the pieces that are not used up.
pub struct FedRecording {
    name: String,
    options: ReadOptions,
    intake: Option<Intake>,
    stream: Option<RecordingStream>,
}

/// Where pieces go in, and the rows that they become as long as no stream reads them.
struct Intake {
    sender: Sender<Piece>,
    waiting: Option<TableRows>,
    rows: usize,
}

impl FedRecording {
    /// Nothing was handed over yet; errors call it by `name`.
    ///
    /// # Errors
    /// The options are impossible, or ask for merged rows of one time stamp, which rows that are still to come may share.
    pub fn new(name: &str, options: &ReadOptions) -> Result<Self> {
        options.check()?;
        if options.repeated != Repeated::Refuse {
            return Err(
                Error::new("rows that come in pieces can't be merged").allowed("each time stamp once")
            );
        }
        Ok(Self { name: name.to_owned(), options: options.clone(), intake: None, stream: None })
    }

    /// Takes further rows. All pieces have the columns of the first, in its order.
    ///
    /// # Errors
    /// A column is missing, the columns are of different lengths, or the first rows are not uniformly sampled numbers.
    pub fn push(&mut self, piece: Piece) -> Result<()> {
        self.take(piece).map_err(|e| e.in_file(&self.name))?;
        if self.stream.is_none() && self.intake.as_ref().is_some_and(|intake| intake.rows >= HEAD_ROWS) {
            self.begin()?;
        }
        Ok(())
    }

    fn take(&mut self, piece: Piece) -> Result<()> {
        let rows = piece.first().map_or(0, |(_, cells)| cells.len());
        if let Some(intake) = &mut self.intake {
            intake.rows += rows;
            // The other end lives as long as the rows or the stream do, which are beside it.
            let _ = intake.sender.send(piece);
            return Ok(());
        }
        let names: Vec<String> = piece.iter().map(|(name, _)| name.clone()).collect();
        let choice = Choice::of(&names, &self.options)?;
        let (sender, pieces) = channel();
        let pieces = Pieces { pieces, names: names.clone(), is_used: choice.uses(names.len()) };
        let table = TableRows::of_batches(names, choice, Some(Box::new(pieces)), &self.options)?;
        let _ = sender.send(piece);
        self.intake = Some(Intake { sender, waiting: Some(table), rows });
        Ok(())
    }

    /// No more rows will come: a short recording begins now.
    ///
    /// # Errors
    /// There was no row, or they are not uniformly sampled numbers.
    pub fn finish(&mut self) -> Result<()> {
        if self.stream.is_some() {
            return Ok(());
        }
        if self.intake.is_none() {
            return Err(Error::new("no rows of data").in_file(&self.name));
        }
        self.begin()
    }

    fn begin(&mut self) -> Result<()> {
        let Some(rows) = self.intake.as_mut().and_then(|intake| intake.waiting.take()) else { return Ok(()) };
        let budget = Budget::of(self.options.memory_limit_bytes.unwrap_or(MEMORY_LIMIT_BYTES));
        let bytes_read = Arc::new(AtomicU64::new(0));
        let stream = RecordingStream::of_rows(&self.name, Box::new(rows), budget, bytes_read, &self.options);
        self.stream = Some(stream.map_err(|e| e.in_file(&self.name))?);
        Ok(())
    }

    /// The next samples, as far as they can be handed on together ([`RecordingStream::valid_samples`]): none where the next one is for
    /// [`Self::next`] to tell, or has not come in yet.
    pub fn valid_samples(&mut self) -> Samples<'_> {
        self.stream.as_mut().map_or(Samples::NONE, RecordingStream::valid_samples)
    }

    /// The next sample; `None` until more rows are handed over, or at the end.
    ///
    /// # Errors
    /// A row that is broken, or a time stamp that is not on the grid.
    #[allow(clippy::should_implement_trait, reason = "a sample borrows from the stream, an Iterator's can't")]
    pub fn next(&mut self) -> Result<Option<Sample<'_>>> {
        match &mut self.stream {
            Some(stream) => stream.next(),
            None => Ok(None),
        }
    }

    /// What is known of the recording so far; `None` before its first rows have shown the sampling.
    pub fn stream(&self) -> Option<&RecordingStream> {
        self.stream.as_ref()
    }
}

/// The pieces that wait to be read.
struct Pieces {
    pieces: Receiver<Piece>,
    /// The columns of all pieces, and which of them are read.
    names: Vec<String>,
    is_used: Vec<bool>,
}

impl Batches for Pieces {
    fn next(&mut self, _: Vec<Option<Cells>>) -> Result<Option<Vec<Option<Cells>>>> {
        let Ok(piece) = self.pieces.try_recv() else { return Ok(None) };
        let count = piece.iter().map(|(_, cells)| cells.len()).max().unwrap_or(0);
        let mut piece = piece.into_iter();
        let mut columns = Vec::with_capacity(self.names.len());
        for (name, is_used) in self.names.iter().zip(&self.is_used) {
            let cells = piece.next().filter(|(other, cells)| other == name && cells.len() == count);
            if cells.is_none() && *is_used {
                return Err(Error::new(format!("not every piece has {count} values of '{name}'")));
            }
            columns.push(cells.map(|(_, cells)| cells).filter(|_| *is_used));
        }
        Ok(Some(columns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Recording, RowState};

    fn columns(rows: std::ops::Range<usize>) -> Piece {
        let of = |f: &dyn Fn(usize) -> f64| Cells::Double(rows.clone().map(f).collect());
        // Rounded stamps, a gap, a cell that is missing, a mode in which u is held.
        let t =
            of(&|k| (f64::from(u32::try_from(k + usize::from(k > 12_345)).unwrap()) * 6.6).round() / 100.0);
        let y = of(&|k| if k == 7 { f64::NAN } else { (k as f64 / 30.0).sin() });
        let by_hand = |k: usize| (15_000..16_000).contains(&k);
        let u = of(&|k| if by_hand(k) { 0.5 } else { (k as f64 / 11.0).cos() });
        let mode = of(&|k| f64::from(u8::from(!by_hand(k))));
        [("t", t), ("r", of(&|_| 0.0)), ("y", y), ("u", u), ("MODE", mode)]
            .map(|(n, c)| (n.to_owned(), c))
            .into()
    }

    /// A sample in bits.
    type Bits = (u64, [u64; 3], RowState);

    /// The samples that have come in, as many together as there are; how many were handed on so.
    fn drain(fed: &mut FedRecording, samples: &mut Vec<Bits>) -> usize {
        let bits = |t_s: f64, [r, y, u]: [f64; 3], state| (t_s.to_bits(), [r, y, u].map(f64::to_bits), state);
        let mut together = 0;
        loop {
            let valid = fed.valid_samples();
            if !valid.is_empty() {
                together += valid.len();
                let at = |n: usize| bits(valid.t_s[n], [valid.r[n], valid.y[n], valid.u[n]], RowState::Valid);
                samples.extend((0..valid.len()).map(at));
                continue;
            }
            let Some(s) = fed.next().unwrap() else { return together };
            samples.push(bits(s.t_s, [s.r, s.y, s.u], s.state));
        }
    }

    /// Against the same rows handed over at once: with a mode they come one by one, without one nearly all of them together.
    #[test]
    fn pieces_of_any_length_become_the_samples_of_the_whole() {
        const ROWS: usize = 30_000;
        let options = ReadOptions::default();
        for (count, piece) in [5, 4].into_iter().flat_map(|count| [997, 10_000, 40_000].map(|n| (count, n))) {
            let columns = |rows| columns(rows).into_iter().take(count).collect::<Piece>();
            let whole = Recording::from_columns("x", columns(0..ROWS), &options).unwrap();
            let mut fed = FedRecording::new("x", &options).unwrap();
            let (mut samples, mut together) = (Vec::new(), 0);
            let mut drain = |fed: &mut FedRecording| together += drain(fed, &mut samples);
            for from in (0..ROWS).step_by(piece) {
                fed.push(columns(from..(from + piece).min(ROWS))).unwrap();
                drain(&mut fed);
            }
            fed.finish().unwrap();
            drain(&mut fed);
            let by_one = if count == 5 { ROWS } else { HEAD_ROWS + ROWS / piece + 10 };
            assert!(together + by_one >= ROWS, "{together} of {ROWS} together");
            let stream = fed.stream().unwrap();
            assert_eq!(stream.quality(), whole.quality);
            assert_eq!(samples.len(), whole.len());
            for (at, (t, values, state)) in samples.iter().enumerate() {
                assert!((f64::from_bits(*t) - whole.time_s(at)).abs() < 0.01);
                assert_eq!(*values, [whole.r[at], whole.y[at], whole.u[at]].map(f64::to_bits), "{at}");
                assert_eq!(*state, whole.state[at], "{at}");
            }
        }
    }

    #[test]
    fn what_is_wrong_is_said_with_its_row() {
        let stamps = |t: &[f64]| -> Piece {
            let cells = |x: Vec<f64>| Cells::Double(x);
            let n = t.len();
            [("t", t.to_vec()), ("r", vec![0.0; n]), ("y", vec![1.0; n]), ("u", vec![2.0; n])]
                .map(|(name, x)| (name.to_owned(), cells(x)))
                .into()
        };
        let mut fed = FedRecording::new("FT101", &ReadOptions::default()).unwrap();
        fed.push(stamps(&[0.0, 1.0, 2.0])).unwrap();
        fed.push(stamps(&[3.0, 2.0])).unwrap();
        let refused = fed.finish().unwrap_err().to_string();
        assert!(refused.starts_with("FT101:5: time goes back"), "{refused}");
        let mut none = FedRecording::new("FT101", &ReadOptions::default()).unwrap();
        assert!(none.finish().is_err());
    }
}
