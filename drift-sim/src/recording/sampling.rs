//! Is the sampling uniform? Time stamps against the line t = a + b k, allowing for their rounding.
//!
//! A logger that samples at 66 ms and writes two decimals leaves 0, 0.07, 0.13, 0.2: unequal intervals, uniform
//! sampling. So the intervals are not what is checked: each stamp must lie within what rounding explains of a
//! least-squares line of t on the sample index k. Where the stamp is a whole number of samples late, samples are
//! missing. The line is fitted to the first rows and then follows the stamps with a memory of as many rows, because
//! the clocks of real loggers wander; while it catches up a stamp may be up to half a sample off the line, as long as
//! its step from the one before is right. Behind a gap of more than a few samples a logger may go on between two samples of the old grid:
//! where the line does not hold over gaps it begins anew behind each.

use super::course::{Course, Line};
use super::quality::{Jitter, short};
use super::stamp::{Resolution, Stamp};
use crate::{Error, Result};

/// Rows that the line is first fitted to, and its memory afterwards.
pub(super) const HEAD_ROWS: usize = 10_000;
/// A stamp off by less than this part of a sample time is harmless whatever its cause.
const TOLERATED: f64 = 1e-3;
/// Rows further apart than this many intervals have a gap between them, behind which sampling may begin anew.
pub(super) const GAP_INTERVALS: f64 = 5.0;
/// A gap may be this many times as long as what came before ...
const GAP_LENGTHS: u64 = 10;
/// ... or of this many samples, whichever is more ...
const GAP_ALWAYS: u64 = 1000;
/// ... but never longer than this.
const GAP_MAX: u64 = 100_000_000;

/// Where a row belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// Right after the one before.
    Next,
    /// After so many missing samples.
    AfterGap(u64),
    /// At the very time of the one before.
    Repeated,
}

/// The uniform grid that time stamps lie on.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    resolution: Resolution,
    course: Course,
    /// Rows that are in the line already.
    fitted: usize,
    gaps: Gaps,
}

/// Where rows behind a gap stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Gaps {
    /// On the grid of the rows before it.
    OnGrid,
    /// On one of their own.
    BeginAnew,
}

/// The index on the grid of each row that is later than the one before, and its time since the first, s; without what a gap is longer
/// than whole samples, where sampling begins anew behind it.
fn places(stamps: &[(u64, Stamp)], unit_s: f64, gaps: Gaps) -> Result<Vec<(f64, f64)>> {
    let Some((_, first)) = stamps.first() else { return Ok(Vec::new()) };
    let mut places = vec![(0.0, 0.0)];
    let (mut k, mut last_t, mut origin_s) = (0.0, first.t_s, first.t_s);
    for (i, (file_line, stamp)) in stamps.iter().enumerate().skip(1) {
        // Rows at the same time repeat each other and say nothing about the line.
        if stamp.t_s <= last_t {
            continue;
        }
        let intervals = (stamp.t_s - last_t) / unit_s;
        let steps = libm::round(intervals).max(1.0);
        if steps > GAP_MAX as f64 {
            return Err(too_long_a_gap(steps - 1.0, last_t, stamp.t_s, i as u64, GAP_MAX).at_line(*file_line));
        }
        if gaps == Gaps::BeginAnew && intervals > GAP_INTERVALS {
            origin_s += stamp.t_s - last_t - steps * unit_s;
        }
        k += steps;
        last_t = stamp.t_s;
        places.push((k, stamp.t_s - origin_s));
    }
    Ok(places)
}

impl Grid {
    /// Finds the grid of the first rows of a recording, given as (line, stamp).
    pub fn establish(stamps: &[(u64, Stamp)], sample_time_s: Option<f64>) -> Result<Self> {
        let origin_s = stamps.first().map_or(0.0, |(_, stamp)| stamp.t_s);
        let steps = forward_steps(stamps)?;
        let resolution = Resolution::of(stamps);
        let median_s = median(&steps).ok_or_else(|| same_time(stamps.len(), origin_s))?;
        let unit_s = sample_time_s.unwrap_or_else(|| mean_unit_step(&steps, median_s));
        // Most intervals must be one sample; with a smaller sample time any file would be gaps for the most part.
        let written_to_s = stamps.last().map_or(0.0, |(_, stamp)| resolution.step_s(stamp.t_s));
        if (median_s - unit_s).abs() > written_to_s.max(0.5 * unit_s).min(0.999 * unit_s) {
            return Err(disagrees(unit_s, median_s));
        }
        let [through, anew] = [Gaps::OnGrid, Gaps::BeginAnew].map(|gaps| {
            let mut places = places(stamps, unit_s, gaps)?;
            let line = places.iter().fold(Line::default(), |mut line, (k, t)| {
                line.learn(*k, *t);
                line
            });
            if !line.slope().is_finite() {
                return Err(Error::new("the time stamps are too large to tell a sample time"));
            }
            let k_last = places.pop().map_or(0.0, |(k, _)| k);
            let course = Course::new(origin_s, line, line.slope());
            Ok((Self { resolution, course, fitted: stamps.len(), gaps }, k_last))
        });
        let ((mut grid, mut k), anew) = (through?, anew?);
        if !grid.holds(stamps)? {
            (grid, k) = anew;
            if !grid.holds(stamps)? {
                return Err(grid.not_uniform(&steps));
            }
        }
        let last_t = stamps.last().map_or(origin_s, |(_, stamp)| stamp.t_s);
        grid.course.sample_time_s = match sample_time_s {
            Some(given) => grid.agrees(given, k)?,
            None => simplest(grid.course.line.slope(), grid.slope_tolerance(k, last_t)),
        };
        Ok(grid)
    }

    /// Whether every one of the first stamps lies on the line, or as near to it as a clock may wander whose steps are right.
    fn holds(&mut self, stamps: &[(u64, Stamp)]) -> Result<bool> {
        let sample_time_s = self.course.sample_time_s;
        let mut before = (0.0, 0.0);
        for place in places(stamps, sample_time_s, self.gaps)? {
            let (k, t) = place;
            let tolerance = self.tolerance_s(self.course.origin_s + t);
            let deviation_s = (t - self.course.line.at(k)).abs();
            let step_error = (t - before.1 - (k - before.0) * sample_time_s).abs();
            let wanders = step_error <= tolerance && deviation_s <= 0.5 * sample_time_s;
            if deviation_s > tolerance && !wanders {
                return Ok(false);
            }
            before = place;
        }
        Ok(true)
    }

    /// How far from uniform the intervals are that are no gaps.
    fn not_uniform(&self, steps: &[(u64, f64)]) -> Error {
        let median_s = median(steps).unwrap_or(f64::INFINITY);
        let within: Vec<(u64, f64)> =
            steps.iter().copied().filter(|(_, step)| *step <= GAP_INTERVALS * median_s).collect();
        let found = jitter(&within);
        let what = found.map_or_else(String::new, |j| format!(": {j}"));
        let step_s = found.map_or(self.course.sample_time_s, |j| j.interval_s);
        Error::new(format!("the sampling is not uniform{what}"))
            .allowed(format!("--resample {}", short(step_s)))
    }

    /// The given sample time, where the time stamps don't contradict it.
    fn agrees(&self, given_s: f64, k_last: f64) -> Result<f64> {
        let found_s = self.course.line.slope();
        let t_last = self.course.origin_s + self.course.line.at(k_last);
        if (found_s - given_s).abs() > self.slope_tolerance(k_last, t_last).max(TOLERATED * given_s) {
            return Err(disagrees(given_s, found_s));
        }
        Ok(given_s)
    }

    /// How far the slope can be off without moving the line by a fifth of the stamps' resolution.
    fn slope_tolerance(&self, k_last: f64, t_last: f64) -> f64 {
        let rounding = 0.2 * self.resolution.step_s(t_last) / k_last.max(1.0);
        rounding.min(0.1 * self.course.line.slope()).max(1e-12 * self.course.line.slope())
    }

    #[inline]
    fn tolerance_s(&mut self, t_s: f64) -> f64 {
        let arithmetic = 8.0 * f64::EPSILON * t_s.abs();
        // Where stamps are coarser than the sampling, half a sample is all that can be told.
        let rounding = self.resolution.next_step_s(t_s).min(0.5 * self.course.sample_time_s);
        rounding.max(TOLERATED * self.course.sample_time_s) + arithmetic
    }

    /// The sample time, s.
    pub fn sample_time_s(&self) -> f64 {
        self.course.sample_time_s
    }

    /// The step between neighbouring stamps where they stand now, s.
    pub fn resolution_s(&self) -> f64 {
        let t = self.course.last.map_or(self.course.origin_s, |(_, t)| t);
        self.resolution.step_s(t)
    }

    /// Puts the rows on the grid that come first, each right after the one before, and adds their times to `t_s`; of the first that
    /// does not, it is [`Self::place`]'s to tell where it belongs.
    pub fn follow(&mut self, rows: impl Iterator<Item = (u64, Stamp)>, t_s: &mut Vec<f64>) {
        if self.fitted > 0 {
            return;
        }
        let mut course = self.course;
        for (line, stamp) in rows {
            if !self.follows(&mut course, line, stamp) {
                break;
            }
            t_s.push(stamp.t_s);
        }
        self.course = course;
    }

    #[inline(always)]
    fn follows(&mut self, course: &mut Course, file_line: u64, stamp: Stamp) -> bool {
        let Some((last_k, last_t)) = course.last else { return false };
        if stamp.t_s <= last_t || self.resolution.is_refined_by(stamp) {
            return false;
        }
        let tolerance = self.tolerance_s(stamp.t_s);
        let next = course.next(stamp.t_s, (last_k, last_t), tolerance);
        if next.missing > 0.0 || !next.is_on_grid {
            return false;
        }
        course.keep(file_line, stamp.t_s, next, true);
        true
    }

    /// Greatest deviation from the line, s, and its row's line.
    pub fn deviation_max(&self) -> (f64, u64) {
        self.course.deviation_max
    }

    /// Puts the next row on the grid.
    pub fn place(&mut self, file_line: u64, stamp: Stamp) -> Result<Place> {
        let already_fitted = self.fitted > 0;
        self.fitted = self.fitted.saturating_sub(1);
        if !already_fitted {
            self.resolution.learn(stamp);
        }
        let Some((last_k, last_t)) = self.course.last else {
            self.course.last = Some((0, stamp.t_s));
            return Ok(Place::Next);
        };
        if stamp.t_s < last_t {
            return Err(goes_back(last_t, stamp.t_s, file_line));
        }
        #[expect(clippy::float_cmp, reason = "the same text is the same number")]
        if stamp.t_s == last_t {
            return Ok(Place::Repeated);
        }
        let tolerance = self.tolerance_s(stamp.t_s);
        let next = self.course.next(stamp.t_s, (last_k, last_t), tolerance);
        let (missing, so_far) = (next.missing, last_k + 1);
        let longest = (so_far.saturating_mul(GAP_LENGTHS)).clamp(GAP_ALWAYS, GAP_MAX);
        if missing > longest as f64 {
            let (from, to) = (short(last_t), short(stamp.t_s));
            return Err(Error::new(format!(
                "a gap of {missing} samples, from {from} to {to} s, after {so_far}"
            ))
            .allowed(format!("{longest} samples at most"))
            .at_line(file_line));
        }
        if !next.is_on_grid && missing + 1.0 > GAP_INTERVALS {
            let begun = self.course.begin_anew(next);
            self.course.keep(file_line, stamp.t_s, begun, !already_fitted);
            return Ok(Place::AfterGap(missing as u64));
        }
        if !next.is_on_grid {
            let (off, sample_time) = (short(next.deviation_s), short(self.course.sample_time_s));
            let what = format!("the time stamp {} s is {off} s off the grid of {sample_time} s", stamp.t_s);
            return Err(Error::new(what).allowed(format!("--resample {sample_time}")).at_line(file_line));
        }
        self.course.keep(file_line, stamp.t_s, next, !already_fitted);
        Ok(if missing > 0.0 { Place::AfterGap(missing as u64) } else { Place::Next })
    }

    /// The sample time over the whole of what was read: the mean between the first stamp and the last, as simple a
    /// number as the stamps allow.
    pub fn whole_sample_time_s(&self) -> f64 {
        match self.course.last {
            Some((k, t)) if k as usize > HEAD_ROWS => {
                let tolerance = self.resolution.step_s(t) / k as f64;
                let mean = (t - self.course.origin_s) / k as f64;
                if (mean - self.course.sample_time_s).abs() <= tolerance {
                    self.course.sample_time_s
                } else {
                    simplest(mean, 0.2 * tolerance)
                }
            }
            _ => self.course.sample_time_s,
        }
    }
}

/// Intervals to the row before with the line that ends them, without those of rows at the same time.
pub(super) fn forward_steps(stamps: &[(u64, Stamp)]) -> Result<Vec<(u64, f64)>> {
    let mut steps = Vec::with_capacity(stamps.len());
    for pair in stamps.windows(2) {
        let [(_, before), (line, stamp)] = pair else { continue };
        if stamp.t_s < before.t_s {
            return Err(goes_back(before.t_s, stamp.t_s, *line));
        }
        if stamp.t_s > before.t_s {
            steps.push((*line, stamp.t_s - before.t_s));
        }
    }
    Ok(steps)
}

pub(super) fn goes_back(from_s: f64, to_s: f64, line: u64) -> Error {
    Error::new(format!("time goes back from {from_s} to {to_s} s"))
        .allowed("--part 1 or --part last, where a recording begins anew there")
        .at_line(line)
}

pub(super) fn one_row() -> Error {
    Error::new("one row of data only").allowed("two at least")
}

/// No time passes from the first row to the last of those read ahead.
pub(super) fn same_time(rows: usize, t_s: f64) -> Error {
    if rows < 2 {
        return one_row();
    }
    Error::new(format!("the first {rows} rows all have the time {t_s} s"))
        .allowed("times that differ, or --columns t= --sample-time S")
}

fn too_long_a_gap(missing: f64, from_s: f64, to_s: f64, so_far: u64, longest: u64) -> Error {
    let (missing, from, to) = (super::write::number(missing), short(from_s), short(to_s));
    Error::new(format!("a gap of {missing} samples, from {from} to {to} s, after {so_far}"))
        .allowed(format!("{longest} samples at most"))
}

fn disagrees(given_s: f64, found_s: f64) -> Error {
    let (given, found) = (short(given_s), short(found_s));
    Error::new(format!("the sample time given is {given} s, the time stamps say {found} s"))
        .allowed("one that agrees, or --columns t= to ignore the time stamps")
}

/// How unequal the intervals are; `None` where there is none.
pub(super) fn jitter(steps: &[(u64, f64)]) -> Option<Jitter> {
    let interval_s = median(steps)?;
    let (mut squares, mut max_s, mut max_line) = (0.0, 0.0, 0);
    for (line, step) in steps {
        let difference = (step - interval_s).abs();
        squares += difference * difference;
        if difference > max_s {
            (max_s, max_line) = (difference, *line);
        }
    }
    Some(Jitter { interval_s, rms_s: libm::sqrt(squares / steps.len() as f64), max_s, max_line })
}

pub(super) fn median(steps: &[(u64, f64)]) -> Option<f64> {
    let mut lengths: Vec<f64> = steps.iter().map(|(_, step)| *step).collect();
    lengths.sort_by(f64::total_cmp);
    lengths.get(lengths.len() / 2).copied()
}

/// The median interval is as rounded as the stamps are; over the mean of all single steps the rounding cancels.
fn mean_unit_step(steps: &[(u64, f64)], median_s: f64) -> f64 {
    let single =
        steps.iter().map(|(_, step)| *step).filter(|step| *step < 1.5 * median_s && *step > 0.5 * median_s);
    let (sum, count) = single.fold((0.0, 0.0), |(sum, count), step| (sum + step, count + 1.0));
    if count > 0.0 { sum / count } else { median_s }
}

/// The number that a person would have chosen within the tolerance: one of few digits, or one over a whole rate,
/// or the shortest.
fn simplest(x: f64, tolerance: f64) -> f64 {
    let near = |candidate: f64| (candidate - x).abs() <= tolerance && candidate > 0.0;
    let decimal =
        (0..16).filter_map(|digits| format!("{x:.digits$e}").parse::<f64>().ok()).find(|d| near(*d));
    let of_few_digits = decimal.filter(|d| format!("{d:e}").bytes().filter(u8::is_ascii_digit).count() <= 5);
    let of_whole_rate = Some(1.0 / libm::round(1.0 / x)).filter(|d| d.is_finite() && near(*d));
    of_few_digits.or(of_whole_rate).or(decimal).unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The stamps k·Ts + start as a logger with so many decimals writes them.
    fn stamps(count: usize, start_s: f64, sample_time_s: f64, decimals: usize) -> Vec<(u64, Stamp)> {
        (0..count)
            .map(|k| {
                let text = format!("{:.decimals$}", start_s + k as f64 * sample_time_s);
                (k as u64 + 2, Stamp::parse(text.as_bytes()).unwrap())
            })
            .collect()
    }

    #[test]
    fn the_sample_time_is_found_behind_rounded_stamps() {
        for (sample_time_s, decimals, start_s) in [
            (0.001, 3, 0.0),
            (0.066, 2, 0.0),
            (1.0 / 15.0, 2, 3.0),
            (1.0 / 15.0, 4, 0.0),
            (1.0 / 30.0, 3, 100.0),
            (0.1, 1, 0.0),
            (60.0, 0, 0.0),
            (0.00125, 4, 1.7e9),
        ] {
            let head = stamps(9000, start_s, sample_time_s, decimals);
            let grid = Grid::establish(&head, None).unwrap();
            let off = (grid.sample_time_s() - sample_time_s).abs() * 9000.0;
            assert!(off <= libm::pow(10.0, -(decimals as f64)), "{sample_time_s}: {}", grid.sample_time_s());
        }
        let exact = Grid::establish(&stamps(9000, 0.0, 0.066, 2), None).unwrap();
        assert_eq!(exact.sample_time_s(), 0.066);
        let rate = Grid::establish(&stamps(9000, 0.0, 1.0 / 30.0, 6), None).unwrap();
        assert_eq!(rate.sample_time_s(), 1.0 / 30.0);
    }

    #[test]
    fn every_row_of_a_long_uniform_recording_is_next() {
        let all = stamps(50_000, 0.0, 0.066, 2);
        let mut grid = Grid::establish(&all[..HEAD_ROWS], None).unwrap();
        for (line, stamp) in &all {
            assert_eq!(grid.place(*line, *stamp).unwrap(), Place::Next, "line {line}");
        }
        assert!(grid.deviation_max().0 < 0.006, "{:?}", grid.deviation_max());
        assert_eq!(grid.whole_sample_time_s(), 0.066);
    }

    #[test]
    fn a_wandering_clock_is_followed() {
        // 20 ppm faster after the head: 1 s in 50 000 s, a sample in 10 000 s.
        let mut grid = Grid::establish(&stamps(HEAD_ROWS, 0.0, 0.2, 6), None).unwrap();
        for k in 0..200_000_u64 {
            let faster = k.saturating_sub(10_000) as f64 * 0.2 * 20e-6;
            let text = format!("{:.6}", k as f64 * 0.2 + faster);
            let placed = grid.place(k + 2, Stamp::parse(text.as_bytes()).unwrap());
            assert_eq!(placed.unwrap(), Place::Next, "row {k}");
        }
    }

    #[test]
    fn missing_samples_are_counted_also_where_stamps_are_rounded() {
        let mut kept = stamps(3000, 0.0, 0.066, 2);
        kept.drain(1000..1020);
        let mut grid = Grid::establish(&kept, None).unwrap();
        let gaps: Vec<_> = kept
            .iter()
            .filter_map(|(line, stamp)| match grid.place(*line, *stamp).unwrap() {
                Place::AfterGap(n) => Some((*line, n)),
                _ => None,
            })
            .collect();
        assert_eq!(gaps, [(1022, 20)]);
    }

    #[test]
    fn real_jitter_is_refused_with_its_size() {
        let text = ["0", "0.0053", "0.0107", "0.0160", "0.0218", "0.0270"];
        let jittered: Vec<_> =
            text.iter().zip(2..).map(|(t, line)| (line, Stamp::parse(t.as_bytes()).unwrap())).collect();
        let error = Grid::establish(&jittered, None).unwrap_err().to_string();
        assert_eq!(
            error,
            "the sampling is not uniform: interval 0.0053 s, jitter 0.000232 s rms and at most 0.0005 s, at line 6; \
             --resample 0.0053"
        );
    }
}
