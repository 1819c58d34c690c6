//! An axis: its range, its ticks and how they are written.

/// Beyond this a number is as good as infinite: ranges must stay finite.
const LARGEST: f64 = 1e300;
/// The least decade span a log axis shows when everything has one value.
const LOG_PAD: f64 = 0.5;

/// A scale between a range of numbers and the unit interval.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axis {
    low: f64,
    high: f64,
    log: bool,
    pub ticks: Vec<(f64, String)>,
}

impl Axis {
    /// An axis over all values, or over the range that is asked for, with about so many ticks. `pad` is the part of
    /// the range that is left free at each end.
    pub fn over(
        values: impl Iterator<Item = f64>,
        wanted: Option<(f64, f64)>,
        log: bool,
        pad: f64,
        ticks: usize,
    ) -> Self {
        let usable = |x: &f64| x.abs() < LARGEST && (!log || *x > 1e-300);
        let scale = |x: f64| if log { libm::log10(x) } else { x };
        let wanted = wanted.filter(|(low, high)| usable(low) && usable(high) && low < high);
        let (low, high) = match wanted {
            Some((low, high)) => (scale(low), scale(high)),
            None => {
                let (low, high) = values
                    .filter(usable)
                    .map(scale)
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
                padded(low, high, pad, log)
            }
        };
        let ticks = if log { log_ticks(low, high, ticks) } else { linear_ticks(low, high, ticks) };
        Self { low, high, log, ticks }
    }

    /// Where a value lies: 0 at the low end, 1 at the high end; `None` where it can't be shown at all.
    pub fn place(&self, x: f64) -> Option<f64> {
        if !x.is_finite() || (self.log && x <= 0.0) {
            return None;
        }
        let x = if self.log { libm::log10(x) } else { x.clamp(-LARGEST, LARGEST) };
        // A step at a time: the difference of two large numbers can be infinite.
        Some((x / 2.0 - self.low / 2.0) / (self.high / 2.0 - self.low / 2.0))
    }

    /// Where bars stand.
    pub fn foot(&self) -> f64 {
        if self.log { 0.0 } else { self.place(0.0).unwrap_or(0.0) }
    }

    /// Replaces the numbers by names.
    pub fn named(mut self, names: &[(f64, String)]) -> Self {
        if !names.is_empty() {
            self.ticks = names.to_vec();
        }
        self
    }

    /// Ticks at whole minutes, hours or days, where x is in seconds since 1970.
    pub fn of_dates(mut self, count: usize) -> Self {
        let (minute, hour, day) = (60.0, 3600.0, 86_400.0);
        let steps = [1.0, 5.0, 15.0, 30.0]
            .into_iter()
            .chain([1.0, 5.0, 15.0, 30.0].map(|n| n * minute))
            .chain([1.0, 3.0, 6.0, 12.0].map(|n| n * hour))
            .chain([1.0, 2.0, 7.0, 14.0, 30.0, 90.0, 365.0, 3650.0].map(|n| n * day));
        let span = self.high - self.low;
        let Some(step) = steps.into_iter().find(|step| span / step <= count.max(2) as f64) else {
            return self;
        };
        let first = libm::ceil(self.low / step);
        let ticks = (0..=count.max(2)).map(|i| (first + i as f64) * step).take_while(|x| *x <= self.high);
        self.ticks = ticks.map(|x| (x, date_label(x, step))).collect();
        self
    }

    /// The ticks that lie on the axis.
    pub fn visible_ticks(&self) -> impl Iterator<Item = (f64, &str)> {
        self.ticks.iter().filter_map(|(x, text)| {
            let at = self.place(*x).filter(|at| (-1e-9..=1.0 + 1e-9).contains(at))?;
            Some((at, text.as_str()))
        })
    }
}

/// Room at both ends, and some range where there is none.
fn padded(low: f64, high: f64, pad: f64, log: bool) -> (f64, f64) {
    if low > high {
        return if log { (-1.0, 1.0) } else { (0.0, 1.0) };
    }
    let span = high - low;
    // Less than what arithmetic can tell apart is a constant.
    if span <= 1e-12 * low.abs().max(high.abs()) {
        let room = if log {
            LOG_PAD
        } else if low == 0.0 {
            1.0
        } else {
            0.1 * low.abs()
        };
        return (low - room, high + room);
    }
    (low - pad * span, high + pad * span)
}

/// Multiples of 1, 2 or 5 times a power of ten.
fn linear_ticks(low: f64, high: f64, count: usize) -> Vec<(f64, String)> {
    let span = high - low;
    let rough = span / count.max(2) as f64;
    if !(rough.is_finite() && rough > 0.0) {
        return Vec::new();
    }
    let mut exponent = libm::floor(libm::log10(rough)) as i32;
    let rest = rough / libm::pow(10.0, f64::from(exponent));
    let factor = if rest <= 1.0 {
        1
    } else if rest <= 2.0 {
        2
    } else if rest <= 5.0 {
        5
    } else {
        exponent += 1;
        1
    };
    let step = f64::from(factor) * libm::pow(10.0, f64::from(exponent));
    let (first, last) = (libm::ceil(low / step - 1e-9), libm::floor(high / step + 1e-9));
    // Where arithmetic can't tell ticks apart their number means nothing.
    if (last - first).is_nan() || last - first > 100.0 {
        return Vec::new();
    }
    let largest = low.abs().max(high.abs());
    (0..=(last - first) as usize)
        .map(|i| {
            let x = (first + i as f64) * step;
            (x, label(x, exponent, largest))
        })
        .collect()
}

/// A tick's number with no more digits than its step needs; `1.2e-5` where that is shorter.
fn label(x: f64, step_exponent: i32, largest: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let decimals = usize::try_from(-step_exponent).unwrap_or(0);
    if largest < 1e5 && decimals <= 4 {
        return typographic(&format!("{x:.decimals$}"));
    }
    let exponent = libm::floor(libm::log10(x.abs()) + 1e-9) as i32;
    let digits = usize::try_from(exponent - step_exponent).unwrap_or(0).min(15);
    let text = format!("{x:.digits$e}");
    typographic(&match text.split_once('e') {
        Some((mantissa, exponent)) if mantissa.contains('.') => {
            format!("{}e{exponent}", mantissa.trim_end_matches('0').trim_end_matches('.'))
        }
        _ => text,
    })
}

/// A date with what changes from tick to tick, and the day at midnight.
fn date_label(x_s: f64, step_s: f64) -> String {
    let at = jiff::Timestamp::from_second(libm::round(x_s) as i64);
    let midnight = libm::fmod(x_s, 86_400.0) == 0.0;
    let format = match step_s {
        _ if midnight => "%Y-%m-%d",
        step if step < 60.0 => "%H:%M:%S",
        _ => "%H:%M",
    };
    at.map_or_else(|_| String::new(), |at| at.to_zoned(jiff::tz::TimeZone::UTC).strftime(format).to_string())
}

/// The true minus sign is as wide as a digit.
fn typographic(text: &str) -> String {
    text.replace('-', "\u{2212}")
}

/// Powers of ten, with 2 and 5 between where they are few.
fn log_ticks(low: f64, high: f64, count: usize) -> Vec<(f64, String)> {
    let decades = high - low;
    let every = libm::ceil(decades / count.max(2) as f64).max(1.0) as i32;
    let factors: &[f64] = if decades <= 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let (first, last) = (libm::floor(low) as i32, libm::ceil(high) as i32);
    (first..=last)
        .filter(|exponent| exponent.rem_euclid(every) == 0)
        .flat_map(|exponent| factors.iter().map(move |factor| (*factor, exponent)))
        .map(|(factor, exponent)| {
            let x = factor * libm::pow(10.0, f64::from(exponent));
            let text = match exponent {
                0..=4 => format!("{}", libm::round(x)),
                -3..=-1 => format!("{x:.decimals$}", decimals = exponent.unsigned_abs() as usize),
                _ => format!("{factor}e{exponent}"),
            };
            (x, typographic(&text))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(values: &[f64], log: bool) -> Vec<String> {
        let axis = Axis::over(values.iter().copied(), None, log, 0.0, 5);
        axis.visible_ticks().map(|(_, text)| text.to_owned()).collect()
    }

    #[test]
    fn ticks_are_round_numbers_written_short() {
        assert_eq!(texts(&[0.0, 0.6], false), ["0", "0.2", "0.4", "0.6"]);
        assert_eq!(texts(&[0.0, 1.0], false), ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(texts(&[-1.0, 1.0], false), ["\u{2212}1.0", "\u{2212}0.5", "0", "0.5", "1.0"]);
        assert_eq!(
            texts(&[0.0, 2.4e-5], false),
            ["0", "5e\u{2212}6", "1e\u{2212}5", "1.5e\u{2212}5", "2e\u{2212}5"]
        );
        assert_eq!(texts(&[0.0, 3e7], false), ["0", "1e7", "2e7", "3e7"]);
        assert_eq!(texts(&[100.0, 200.0], false), ["100", "120", "140", "160", "180", "200"]);
    }

    #[test]
    fn dates_have_ticks_at_whole_hours_and_days() {
        // From 2024-05-01 22:30 for five hours.
        let start = 1_714_602_600.0;
        let axis = Axis::over([start, start + 18_000.0].into_iter(), None, false, 0.0, 6).of_dates(6);
        let texts: Vec<&str> = axis.visible_ticks().map(|(_, text)| text).collect();
        assert_eq!(texts, ["23:00", "2024-05-02", "01:00", "02:00", "03:00"]);
    }

    #[test]
    fn a_log_axis_has_decades() {
        assert_eq!(texts(&[0.01, 1000.0], true), ["0.01", "0.1", "1", "10", "100", "1000"]);
        assert_eq!(texts(&[1.0, 10.0], true), ["1", "2", "5", "10"]);
    }

    #[test]
    fn any_values_make_a_usable_axis() {
        let cases: [&[f64]; 8] = [
            &[],
            &[f64::NAN, f64::INFINITY],
            &[3.0, 3.0],
            &[0.0],
            &[-1e299, 1e299],
            &[f64::MAX, f64::MIN],
            &[5e-324, 1e-320],
            &[1e9, 1e9 + 1e-9],
        ];
        for (values, log) in cases.iter().flat_map(|v| [(v, false), (v, true)]) {
            let axis = Axis::over(values.iter().copied(), None, log, 0.04, 5);
            assert!(axis.low < axis.high && axis.high.is_finite(), "{values:?} {axis:?}");
            for x in values.iter().chain(&[0.0, 1.0, -1.0, f64::MAX, f64::NAN]) {
                assert!(axis.place(*x).is_none_or(|at| !at.is_nan()), "{x} on {axis:?}");
            }
        }
    }
}
