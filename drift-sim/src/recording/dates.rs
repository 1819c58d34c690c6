//! A column of dates as binary formats hold them: whole numbers since 1970. They mean what their text would mean, with as many
//! digits behind the seconds as it takes, without the text.

use jiff::Timestamp;
use jiff::tz::TimeZone;

use super::date::Moment;

/// The beginning of the year 0: earlier dates are written with a sign, which no other date is.
const YEAR_0: Timestamp = Timestamp::constant(-62_167_219_200, 0);

/// What the whole numbers count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DateUnit {
    /// Days of 86 400 s.
    Days,
    /// 1e-3 s.
    Milliseconds,
    /// 1e-6 s.
    Microseconds,
    /// 1e-9 s.
    Nanoseconds,
}

/// Dates of one column.
#[derive(Debug, Clone)]
pub struct Dates {
    /// Counted from the beginning of 1970; `None` is missing.
    pub since_1970: Vec<Option<i64>>,
    /// What they count.
    pub unit: DateUnit,
    /// Whether they are points in time; otherwise they are what a clock showed.
    pub is_utc: bool,
}

impl Dates {
    pub(super) fn len(&self) -> usize {
        self.since_1970.len()
    }

    /// `None` for what is missing or lies out of the years -9999 to 9999.
    fn at(&self, row: usize) -> Option<Timestamp> {
        let count = (*self.since_1970.get(row)?)?;
        let (second_s, fraction_ns) = match self.unit {
            DateUnit::Days => (count.checked_mul(86_400)?, 0),
            DateUnit::Milliseconds => (count.div_euclid(1_000), count.rem_euclid(1_000) * 1_000_000),
            DateUnit::Microseconds => (count.div_euclid(1_000_000), count.rem_euclid(1_000_000) * 1_000),
            DateUnit::Nanoseconds => (count.div_euclid(1_000_000_000), count.rem_euclid(1_000_000_000)),
        };
        Timestamp::new(second_s, i32::try_from(fraction_ns).ok()?).ok()
    }

    /// A date as text; `None` where it is missing.
    pub(super) fn written(&self, row: usize) -> Option<String> {
        let at = self.at(row)?;
        Some(if self.is_utc { at.to_string() } else { TimeZone::UTC.to_datetime(at).to_string() })
    }

    /// What [`Moment::parse`] makes of the text; `None` where there is none, or it takes the text to say what is wrong with it.
    pub(super) fn moment(&self, row: usize) -> Option<Moment> {
        let at = self.at(row)?;
        if at < YEAR_0 {
            return None;
        }
        Some(Moment::year_first(at, self.is_utc, digits(at.subsec_nanosecond().rem_euclid(1_000_000_000))))
    }
}

/// Digits that a fraction of a second takes.
fn digits(mut fraction_ns: i32) -> i32 {
    if fraction_ns == 0 {
        return 0;
    }
    let mut digits = 9;
    while fraction_ns % 10 == 0 {
        fraction_ns /= 10;
        digits -= 1;
    }
    digits
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the reader of texts, from the first year to the last.
    #[test]
    fn a_date_means_what_its_text_means() {
        for unit in [DateUnit::Days, DateUnit::Milliseconds, DateUnit::Microseconds, DateUnit::Nanoseconds] {
            for is_utc in [true, false] {
                let counts = [0, 1, -1, 10, 999, 1000, 19_844, -719_529, -719_528, 1_714_564_800_123_456_789];
                let more =
                    [-62_167_219_200_000, -62_167_219_200_001, 253_402_207_200_999, i64::MIN, i64::MAX];
                let since_1970 = counts.into_iter().chain(more).map(Some).chain([None]).collect();
                let dates = Dates { since_1970, unit, is_utc };
                for row in 0..=dates.len() {
                    let text = dates.written(row);
                    let parsed = text.as_deref().and_then(Moment::parse);
                    assert_eq!(dates.moment(row), parsed, "{unit:?} {is_utc} {text:?}");
                }
            }
        }
    }
}
