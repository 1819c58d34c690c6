//! A mode that is written as a number: nobody knows what 1 means in a stranger's file, but by hand u stays put from row to row
//! while a controller moves it. What the codes mean is read off the first rows; a code that comes only later is not known to be
//! a closed loop, and its rows don't count.

use std::collections::VecDeque;

use super::Quality;
use super::read_ahead::ReadAhead;
use super::row::{Filter, Row, Rows};
use crate::Result;

/// More codes than this are no modes.
const CODES_MAX: usize = 12;
/// Rows of a code, each behind another of it, from which its share is known.
const ROWS_LEAST: usize = 20;
/// A code in which u moves in less than this part of the rows, of the code in which it moves most, is a mode of hand. By hand u
/// moves in single steps; under a law with a measured y it moves in nearly every row.
const HELD: f64 = 0.2;

/// The rows, those of a hand's mode marked as manual.
pub(super) fn judged(rows: Box<dyn Rows>) -> Box<dyn Rows> {
    if rows.choice().mode.is_none() {
        return rows;
    }
    Box::new(ModeCodes { rows: ReadAhead::of(rows), codes: None, last: f64::NAN, later: Vec::new() })
}

struct ModeCodes {
    rows: ReadAhead,
    codes: Option<Codes>,
    /// The code of the row before: often only the changes are written.
    last: f64,
    /// Codes that came behind the rows that were read ahead.
    later: Vec<f64>,
}

impl Filter for ModeCodes {
    fn source(&self) -> &dyn Rows {
        self.rows.source()
    }

    fn note(&self) -> Option<String> {
        let choice = self.source().choice();
        let name = self.source().names().get(choice.mode?)?;
        let Some(codes) = &self.codes else { return choice.told_of_mode() };
        Some(codes.note(name, &self.later))
    }

    fn read(&mut self, row: &mut Row, quality: &mut Quality) -> Result<bool> {
        if let Some(head) = self.rows.begin(quality) {
            self.codes = Codes::of(head);
        }
        if !self.rows.next_row(row, quality)? {
            return Ok(false);
        }
        if row.mode.is_nan() {
            row.mode = self.last;
        }
        self.last = row.mode;
        if let Some(codes) = &self.codes
            && !row.mode.is_nan()
        {
            row.manual |= !codes.is_closed(row.mode);
            if !codes.is_known(row.mode) && !self.later.contains(&row.mode) && self.later.len() < CODES_MAX {
                self.later.push(row.mode);
            }
        }
        Ok(true)
    }
}

/// A code, in how many rows it stands behind itself, and in which share of them u moved.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Code {
    value: f64,
    rows: usize,
    moves: f64,
}

/// What the codes mean.
#[derive(Debug, Clone, PartialEq)]
enum Codes {
    /// In these the loop is closed, in those it is not.
    Told { closed: Vec<Code>, by_hand: Vec<Code> },
    /// u moves alike in all of them, or in none.
    Alike(Vec<Code>),
}

impl Codes {
    /// `None` where the mode is no number, or there are too many.
    fn of(head: &VecDeque<Row>) -> Option<Self> {
        let codes = shares(head)?;
        let known = |code: &&Code| code.rows >= ROWS_LEAST;
        let most = codes.iter().filter(known).map(|code| code.moves).fold(0.0, f64::max);
        // A single code in which u never moves may be either.
        if most == 0.0 || (codes.len() == 1 && most < HELD) {
            return Some(Self::Alike(codes));
        }
        let (closed, by_hand): (Vec<Code>, Vec<Code>) =
            codes.iter().partition(|code| known(code) && code.moves >= HELD * most);
        Some(if by_hand.is_empty() && codes.len() > 1 {
            Self::Alike(codes)
        } else {
            Self::Told { closed, by_hand }
        })
    }

    fn is_closed(&self, code: f64) -> bool {
        match self {
            Self::Told { closed, .. } => has(closed, code),
            Self::Alike(_) => true,
        }
    }

    fn is_known(&self, code: f64) -> bool {
        match self {
            Self::Told { closed, by_hand } => has(closed, code) || has(by_hand, code),
            Self::Alike(_) => true,
        }
    }

    fn note(&self, name: &str, later: &[f64]) -> String {
        let listed =
            |codes: &[Code]| codes.iter().map(|c| c.value.to_string()).collect::<Vec<_>>().join(" or ");
        match self {
            Self::Told { closed, by_hand } if by_hand.is_empty() && later.is_empty() => {
                format!("'{name}' is {} throughout: the loop is taken to be closed", listed(closed))
            }
            Self::Told { closed, by_hand } => {
                let others: Vec<String> = by_hand
                    .iter()
                    .map(|c| c.value)
                    .chain(later.iter().copied())
                    .map(|c| c.to_string())
                    .collect();
                let most = closed.iter().map(|c| c.moves).fold(0.0, f64::max);
                let stays = if later.is_empty() { ", where u stays put" } else { "" };
                format!(
                    "rows where '{name}' is {} don't count{stays}: u moves in {:.0} % of the rows where it is {} (--when \"{name}=N\" \
                     or --when always says otherwise)",
                    others.join(" or "),
                    100.0 * most,
                    listed(closed)
                )
            }
            Self::Alike(codes) => format!(
                "'{name}' is {}, and u does not show which of them is a closed loop: all rows count (--when \"{name}=N\" says \
                 which do)",
                listed(codes)
            ),
        }
    }
}

#[expect(clippy::float_cmp, reason = "codes are written alike")]
fn has(codes: &[Code], value: f64) -> bool {
    codes.iter().any(|code| code.value == value)
}

/// The codes in the order in which they come; `None` where there are none, or too many. A u at its lowest or highest value stays put
/// under any law, and says nothing.
fn shares(head: &VecDeque<Row>) -> Option<Vec<Code>> {
    let values = || head.iter().map(|row| row.u).filter(|u| !u.is_nan());
    let ends = [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)];
    let mut found: Vec<(f64, usize, usize)> = Vec::new();
    let (mut code, mut before) = (f64::NAN, (f64::NAN, f64::NAN));
    for row in head {
        if !row.mode.is_nan() {
            code = row.mode;
        }
        if code.is_nan() {
            continue;
        }
        #[expect(
            clippy::float_cmp,
            reason = "codes are written alike, a value that is held is the same number"
        )]
        {
            let at = found.iter().position(|(value, ..)| *value == code).unwrap_or_else(|| {
                found.push((code, 0, 0));
                found.len() - 1
            });
            if found.len() > CODES_MAX {
                return None;
            }
            let is_free = !row.u.is_nan() && !before.1.is_nan() && !ends.contains(&row.u);
            if let Some((_, rows, moved)) = found.get_mut(at).filter(|_| before.0 == code && is_free) {
                *rows += 1;
                *moved += usize::from(row.u != before.1);
            }
        }
        before = (code, row.u);
    }
    let codes = found.into_iter();
    let codes: Vec<Code> = codes
        .map(|(value, rows, moved)| Code { value, rows, moves: moved as f64 / rows.max(1) as f64 })
        .collect();
    (!codes.is_empty()).then_some(codes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// u moves in every row where the mode is `closed`, in one of 50 elsewhere, as a hand does.
    fn head(modes: &[(f64, usize)], closed: f64) -> VecDeque<Row> {
        let codes = modes.iter().flat_map(|(mode, rows)| std::iter::repeat_n(*mode, *rows));
        let mut u = 50.0;
        let rows = codes.enumerate().map(|(i, mode)| {
            if mode == closed || i % 50 == 0 {
                u = 50.0 + 10.0 * libm::sin(0.7 * i as f64);
            }
            Row { mode, u, ..Row::default() }
        });
        rows.collect()
    }

    #[test]
    fn a_code_in_which_u_stays_put_is_by_hand() {
        for (closed, by_hand) in [(1.0, 0.0), (0.0, 1.0), (8.0, 4.0)] {
            let codes = Codes::of(&head(&[(closed, 400), (by_hand, 300), (closed, 300)], closed)).unwrap();
            assert!(codes.is_closed(closed) && !codes.is_closed(by_hand), "{codes:?}");
            assert!(!codes.is_closed(17.0) && !codes.is_known(17.0));
            let note = codes.note("MODE", &[]);
            assert!(note.starts_with(&format!("rows where 'MODE' is {by_hand} don't count")), "{note}");
        }
    }

    #[test]
    fn codes_that_u_does_not_tell_apart_all_count() {
        let mut rows = head(&[(1.0, 500)], 1.0);
        rows.extend(head(&[(2.0, 500)], 2.0));
        let codes = Codes::of(&rows).unwrap();
        assert!(codes.is_closed(1.0) && codes.is_closed(2.0), "{codes:?}");
        assert_eq!(Codes::of(&head(&[(f64::NAN, 100)], 1.0)), None);
    }
}
