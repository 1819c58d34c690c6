//! The text in blocks of whole lines, so that the rows of several blocks can be read at once ([`plain`](super::plain)); for
//! what is not plain, the same text byte by byte.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read};

use crate::cores::AcrossCores as _;

use super::plain::{PlainRow, PlainRows, Plan};

/// Bytes asked of the system at a time, and what a block holds at least where lines are short.
const BLOCK_BYTES: usize = 1 << 18;
/// Lines longer than this are handed on in pieces.
const LINE_BYTES_MAX: usize = 1 << 21;
/// Blocks that are read at once for each thread: one that ends early has another to go on with.
const BLOCKS_A_THREAD: usize = 2;
/// Blocks that are read at once, at most: they are all in memory.
const BLOCKS_MAX: usize = 16;

/// Some lines of text, the last one perhaps without its end.
#[derive(Default)]
struct Block {
    /// The text, and room for what may be read behind it.
    room: Vec<u8>,
    /// Where the text ends.
    end: usize,
    /// Ends of lines in it.
    lines: u64,
    plain: PlainRows,
    /// Which plan its rows were read by.
    plan: Option<u32>,
}

impl Block {
    fn text(&self) -> &[u8] {
        self.room.get(..self.end).unwrap_or_default()
    }

    /// Room for so many bytes behind the text.
    fn room(&mut self, bytes: usize) -> &mut [u8] {
        let end = self.end + bytes;
        self.room.resize(self.room.len().max(end), 0);
        self.room.get_mut(self.end..end).unwrap_or_default()
    }

    fn read_rows(&mut self, plan: &Plan, from: usize) {
        let text = self.room.get(..self.end).unwrap_or_default();
        plan.read(text, from, &mut self.plain);
        self.plan = Some(plan.number);
    }
}

/// The text of a source.
pub(super) struct Blocks {
    source: Box<dyn Read + Send>,
    current: Block,
    /// What was handed on of the current block.
    at: usize,
    /// The plain row that comes next.
    next: usize,
    /// The line that the current block begins with.
    line: u64,
    ready: VecDeque<Block>,
    spare: Vec<Block>,
    /// Behind the last end of a line.
    rest: Vec<u8>,
    /// How many blocks are read at once.
    at_once: usize,
    is_over: bool,
    failed: Option<io::Error>,
}

impl Blocks {
    /// A source whose first line is `line`. Of one that can wait for nobody, such as a file, several blocks are read at once;
    /// of another a row is handed on as soon as it is there.
    pub fn new(source: Box<dyn Read + Send>, line: u64, is_file: bool) -> Self {
        let threads = if is_file { rayon::current_num_threads() } else { 1 };
        let at_once = if threads > 1 { (threads * BLOCKS_A_THREAD).min(BLOCKS_MAX) } else { 1 };
        Self {
            source,
            current: Block::default(),
            at: 0,
            next: 0,
            line,
            ready: VecDeque::new(),
            spare: Vec::new(),
            rest: Vec::new(),
            at_once,
            is_over: false,
            failed: None,
        }
    }

    /// Steps to the plain row that begins where the text was handed on to, where there is one: its place among [`Self::rows`], and its
    /// line.
    #[inline]
    pub fn plain(&mut self, plan: &Plan) -> Option<(usize, u64)> {
        let PlainRow { to, line, .. } = *self.find_next(plan).first()?;
        (self.at, self.next) = (to as usize, self.next + 1);
        Some((self.next - 1, self.line + u64::from(line)))
    }

    /// Steps over the plain rows that begin there, one right after the other, as long as they are samples of a closed loop, at most so
    /// many and all of one block; the line that their lines are counted from.
    pub fn samples(&mut self, plan: &Plan, most: usize) -> (&[PlainRow], u64) {
        let from = self.at;
        let ahead = self.find_next(plan);
        let mut at = from;
        let follows = |row: &&PlainRow| {
            let is_next = row.from as usize == at && row.is_sample();
            at = row.to as usize;
            is_next
        };
        let count = ahead.iter().take(most).take_while(follows).count();
        let first = self.next;
        self.next += count;
        let rows = self.current.plain.rows.get(first..self.next).unwrap_or_default();
        self.at = rows.last().map_or(self.at, |row| row.to as usize);
        (rows, self.line)
    }

    /// The plain rows of the current block from the one on that begins where the text was handed on to; none where there is no such row.
    #[inline]
    fn find_next(&mut self, plan: &Plan) -> &[PlainRow] {
        if self.at == self.current.end && !self.advance(Some(plan)) {
            return &[];
        }
        if self.current.plan != Some(plan.number) {
            self.current.read_rows(plan, self.at);
            self.next = 0;
        }
        let rows = &self.current.plain.rows;
        while rows.get(self.next).is_some_and(|row| (row.from as usize) < self.at) {
            self.next += 1;
        }
        let is_next = rows.get(self.next).is_some_and(|row| row.from as usize == self.at);
        rows.get(self.next..).filter(|_| is_next).unwrap_or_default()
    }

    /// The plain rows of the current block.
    #[inline]
    pub fn rows(&self) -> &PlainRows {
        &self.current.plain
    }

    /// The text that comes next; empty at the end.
    ///
    /// # Errors
    /// The source can't be read.
    pub fn fill(&mut self) -> io::Result<&[u8]> {
        if self.at == self.current.end && !self.advance(None) {
            return self.failed.take().map_or(Ok(&[]), Err);
        }
        Ok(self.current.text().get(self.at..).unwrap_or_default())
    }

    /// So many bytes of it were used.
    pub fn consume(&mut self, count: usize) {
        self.at = (self.at + count).min(self.current.end);
    }

    /// Goes to the next block; false where there is none.
    fn advance(&mut self, plan: Option<&Plan>) -> bool {
        if self.ready.is_empty() {
            self.read_blocks(plan);
        }
        let Some(block) = self.ready.pop_front() else { return false };
        self.line += self.current.lines;
        (self.at, self.next) = (0, 0);
        self.spare.push(std::mem::replace(&mut self.current, block));
        true
    }

    fn read_blocks(&mut self, plan: Option<&Plan>) {
        while self.ready.len() < self.at_once && !self.is_over {
            match self.read_block() {
                Ok(Some(block)) => self.ready.push_back(block),
                Ok(None) => self.is_over = true,
                Err(error) => (self.failed, self.is_over) = (Some(error), true),
            }
        }
        let Some(plan) = plan else { return };
        match self.ready.make_contiguous() {
            [one] => one.read_rows(plan, 0),
            several => several.par_iter_mut().for_each(|block| block.read_rows(plan, 0)),
        }
    }

    /// The next lines; `None` at the end. What stands before a fault is a block of its own.
    fn read_block(&mut self) -> io::Result<Option<Block>> {
        let mut block = self.spare.pop().unwrap_or_default();
        (block.plan, block.end) = (None, 0);
        block.room(self.rest.len()).copy_from_slice(&self.rest);
        block.end = self.rest.len();
        self.rest.clear();
        while block.end < LINE_BYTES_MAX {
            let known = block.end;
            let read = self.source.read(block.room(BLOCK_BYTES));
            block.end += *read.as_ref().unwrap_or(&0);
            match read {
                Ok(0) => self.is_over = true,
                Ok(_) => {}
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => (self.failed, self.is_over) = (Some(error), true),
            }
            if self.is_over {
                break;
            }
            let read = block.text().get(known..).unwrap_or_default();
            if let Some(end) = memchr::memrchr(b'\n', read) {
                let (whole, rest) = read.split_at(end + 1);
                self.rest.extend_from_slice(rest);
                block.end = known + whole.len();
                break;
            }
        }
        block.lines = memchr::memchr_iter(b'\n', block.text()).count() as u64;
        Ok(Some(block).filter(|block| block.end > 0))
    }
}
