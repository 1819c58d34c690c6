//! The rows of a CSV file: plain ones as they were read block by block ([`Blocks`](super::blocks)), all others one by one.

use super::super::choice::{Choice, Reference};
use super::super::row::{Row, Rows};
use super::super::stretch::Stretch;
use super::super::text_rows::{Settled, TextRows};
use super::plain::Plan;
use super::{CsvRecords, Quality};
use crate::Result;
use crate::controller::Controller;
use crate::physics::Units;

/// Plans that a file is given. Each new one reads a block anew, which a file in which more than so many columns turn out to
/// hold text one after the other is not worth.
const PLANS_MAX: u32 = 64;

/// Reads rows one after the other.
pub(in super::super) struct CsvRows {
    single: TextRows<CsvRecords>,
    /// What the plan was made for.
    settled: Option<Settled>,
    /// How plain rows are read; `None` before the first row, and where there can be none.
    plan: Option<Plan>,
    plans: u32,
    /// Which of r, y and u are read at all.
    has: [bool; 3],
}

impl CsvRows {
    pub(super) fn new(single: TextRows<CsvRecords>) -> Self {
        let choice = single.choice();
        let has = [choice.r != Reference::Absent, choice.y.is_some(), choice.u.is_some()];
        Self { single, settled: None, plan: None, plans: 0, has }
    }

    /// Makes the plan anew where a single row has settled something.
    fn settle(&mut self) {
        let settled = self.single.settled();
        if settled == self.settled {
            return;
        }
        self.settled = settled;
        self.plans += 1;
        let width = self.single.names().len();
        let is_possible = width > 1 && self.plans <= PLANS_MAX;
        let settled = settled.filter(|_| is_possible);
        let delimiters = self.single.records_mut().delimiters;
        self.plan = settled.map(|settled| {
            Plan::new(self.plans, delimiters, width, (settled.mark, settled.unit), self.single.choice())
        });
    }
}

impl Rows for CsvRows {
    fn choice(&self) -> &Choice {
        self.single.choice()
    }

    fn names(&self) -> &[String] {
        self.single.names()
    }

    fn zero_s(&self) -> Option<f64> {
        self.single.zero_s()
    }

    fn stated_law(&self) -> Option<Controller> {
        self.single.stated_law()
    }

    fn units(&self) -> Units {
        self.single.units()
    }

    fn notes(&self) -> Vec<String> {
        self.single.notes()
    }

    fn read(&mut self, row: &mut Row, quality: &mut Quality) -> Result<bool> {
        if let Some(plan) = &self.plan
            && self.single.records_mut().plain(plan, row, quality)
        {
            let [r, y, u] = self.has;
            quality.missing_r += u64::from(r && row.r.is_nan());
            quality.missing_y += u64::from(y && row.y.is_nan());
            quality.missing_u += u64::from(u && row.u.is_nan());
            quality.rows += 1;
            return Ok(true);
        }
        let found = self.single.read(row, quality)?;
        self.settle();
        Ok(found)
    }

    fn read_ahead(&mut self, stretch: &mut Stretch, quality: &mut Quality) {
        let Some(plan) = &self.plan else { return };
        if self.has == [true; 3] && self.single.choice().is_signals_alone() {
            self.single.records_mut().samples(plan, stretch, quality);
            quality.rows += stretch.len() as u64;
        }
    }
}
