//! A log of several recordings: a program that was restarted went on writing to the same file, and its clock began anew. Each stretch in
//! which time goes forward is a part; one of them is read.

use std::collections::VecDeque;
use std::str::FromStr;

use super::budget::Budget;
use super::row::{Filter, Row, Rows};
use super::{Quality, ReadOptions};
use crate::{Error, Result};

/// Parts that are told with their rows.
const SHOWN: usize = 6;

/// Which part of a log is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// By its number, from 1 on.
    Number(u64),
    /// The last one.
    Last,
}

impl FromStr for Part {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match (text, text.parse::<u64>()) {
            ("last", _) => Ok(Self::Last),
            (_, Ok(number @ 1..)) => Ok(Self::Number(number)),
            _ => Err(Error::new(format!("part: '{text}'")).allowed("1, 2, ... or last")),
        }
    }
}

/// The rows of the part that was asked for; of a log that says itself where it was begun anew, the first part.
pub(super) fn chosen(rows: Box<dyn Rows>, options: &ReadOptions, budget: &Budget) -> Box<dyn Rows> {
    let wanted = options.part.or(rows.is_restarted().then_some(Part::Number(1)));
    match wanted.filter(|_| rows.has_time()) {
        Some(wanted) => Box::new(Parts {
            rows,
            wanted,
            tells_all: options.incomplete,
            budget: budget.clone(),
            parts: Vec::new(),
            last_s: f64::NEG_INFINITY,
            held: None,
            is_over: false,
        }),
        None => rows,
    }
}

struct Parts {
    rows: Box<dyn Rows>,
    wanted: Part,
    /// Whether the parts behind the one that is read are counted as well.
    tells_all: bool,
    budget: Budget,
    /// The line that each part begins on, and its rows.
    parts: Vec<(u64, u64)>,
    last_s: f64,
    /// The rows of the last part, where that was asked for.
    held: Option<VecDeque<Row>>,
    is_over: bool,
}

impl Parts {
    /// Reads a row and finds the part that it is of, from 1 on; `None` at the end. A row of another part counts for nothing.
    fn next_row(&mut self, row: &mut Row, quality: &mut Quality) -> Result<Option<u64>> {
        let mut counted = quality.clone();
        if !self.rows.read(row, &mut counted)? {
            return Ok(None);
        }
        if self.parts.is_empty() || row.stamp.t_s < self.last_s {
            self.parts.push((row.line, 0));
        }
        self.last_s = row.stamp.t_s;
        if let Some((_, rows)) = self.parts.last_mut() {
            *rows += 1;
        }
        let part = self.parts.len() as u64;
        let counts = match self.wanted {
            Part::Number(number) => number == part,
            Part::Last => true,
        };
        if counts {
            *quality = counted;
        }
        Ok(Some(part))
    }

    fn next_of(&mut self, number: u64, row: &mut Row, quality: &mut Quality) -> Result<bool> {
        while !self.is_over {
            match self.next_row(row, quality)? {
                Some(part) if part == number => return Ok(true),
                Some(part) if part > number && !self.tells_all => self.is_over = true,
                Some(_) => {}
                None => self.is_over = true,
            }
        }
        match self.parts.len() as u64 {
            there if there >= number => Ok(false),
            1 => {
                Err(Error::new(format!("there is no part {number}: time begins only once"))
                    .allowed("--part 1"))
            }
            there => Err(Error::new(format!("there is no part {number}: time begins {there} times"))
                .allowed(format!("--part 1 to {there}, or last"))),
        }
    }

    /// All rows of the last part.
    fn read_last(&mut self, quality: &mut Quality) -> Result<VecDeque<Row>> {
        let (mut held, mut held_bytes, mut before) = (VecDeque::new(), 0, 0);
        let mut row = Row::default();
        while let Some(part) = self.next_row(&mut row, quality)? {
            if part != before {
                held.clear();
                self.budget.give_back(held_bytes);
                *quality = Quality { rows: 1, ..Quality::default() };
                (held_bytes, before) = (0, part);
            }
            let bytes = (size_of::<Row>() + row.extra.capacity() * size_of::<f64>()) as u64;
            self.budget.take(bytes)?;
            held_bytes += bytes;
            held.push_back(row.clone());
        }
        Ok(held)
    }
}

impl Parts {
    /// All parts, with the longest of those that are not read.
    fn all(&self, number: u64) -> Option<String> {
        let others = (1..).zip(&self.parts).filter(|(other, _)| *other != number);
        let (longest, _) = others.max_by_key(|(_, (_, rows))| *rows)?;
        let shown: Vec<String> = (1..)
            .zip(&self.parts)
            .take(SHOWN)
            .map(|(part, (line, rows))| format!("{part} from line {line} ({rows} rows)"))
            .collect();
        let more = if self.parts.len() > SHOWN { ", ..." } else { "" };
        Some(format!(
            "time begins anew {}: the parts are {}{more}; part {number} is read (--part {longest} reads another)",
            if self.parts.len() == 2 { "once".to_owned() } else { format!("{} times", self.parts.len() - 1) },
            shown.join(", ")
        ))
    }
}

impl Filter for Parts {
    fn source(&self) -> &dyn Rows {
        self.rows.as_ref()
    }

    fn note(&self) -> Option<String> {
        let number = match self.wanted {
            Part::Number(number) => number,
            Part::Last => self.parts.len() as u64,
        };
        let [_, .., (last_line, _)] = self.parts.as_slice() else { return None };
        if self.tells_all {
            return self.all(number);
        }
        match self.parts.get(number as usize) {
            Some((line, _)) => Some(format!(
                "time begins anew on line {line}: part {number} is read (--part {} or --part last reads what follows)",
                number + 1
            )),
            None => Some(format!("part {number} is read, in which time begins anew on line {last_line}")),
        }
    }

    fn read(&mut self, row: &mut Row, quality: &mut Quality) -> Result<bool> {
        match self.wanted {
            Part::Number(number) => self.next_of(number, row, quality),
            Part::Last => {
                let mut held = match self.held.take() {
                    Some(held) => held,
                    None => self.read_last(quality)?,
                };
                let next = held.pop_front();
                self.held = Some(held);
                Ok(next.map(|next| *row = next).is_some())
            }
        }
    }
}
