//! The line that time stamps follow, and the last of them: what one row after the other is held against. All of it is copied while rows
//! pass, so that it stays in the processor's registers.

use super::sampling::HEAD_ROWS;

/// Least-squares line t = mean_t + slope (k - mean_k), with weights that fade.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Line {
    weight: f64,
    mean_k: f64,
    mean_t: f64,
    kk: f64,
    kt: f64,
}

/// Rows that the line remembers.
const MEMORY: f64 = HEAD_ROWS as f64;

impl Line {
    #[inline]
    pub fn learn(&mut self, k: f64, t: f64) {
        let (dk, dt) = (k - self.mean_k, t - self.mean_t);
        // Of a whole memory these are numbers that the compiler knows: the means wait for no division.
        let (fade, old, part) = if self.weight >= MEMORY {
            ((MEMORY - 1.0) / MEMORY, MEMORY - 1.0, 1.0 / MEMORY)
        } else {
            (1.0, self.weight, 1.0 / (self.weight + 1.0))
        };
        self.weight = old + 1.0;
        self.mean_k += dk * part;
        self.mean_t += dt * part;
        let share = old * part;
        self.kk = fade * self.kk + share * dk * dk;
        self.kt = fade * self.kt + share * dk * dt;
    }

    #[inline]
    pub fn slope(&self) -> f64 {
        self.kt / self.kk
    }

    #[inline]
    pub fn at(&self, k: f64) -> f64 {
        self.mean_t + self.slope() * (k - self.mean_k)
    }
}

/// Where a row stands behind the one before.
#[derive(Debug, Clone, Copy)]
pub(super) struct Next {
    /// Its index on the grid.
    k: u64,
    /// Samples that are missing before it.
    pub missing: f64,
    /// How far it is from the line, s.
    pub deviation_s: f64,
    /// Whether its time is one of the grid's.
    pub is_on_grid: bool,
}

/// Where the rows have come to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Course {
    /// Times are kept from the first stamp on: stamps may count from 1970.
    pub origin_s: f64,
    pub line: Line,
    pub sample_time_s: f64,
    /// Index and time of the last row placed.
    pub last: Option<(u64, f64)>,
    /// How far that row was from the line, s.
    last_deviation_s: f64,
    /// Greatest deviation from the line, s, and its row's line.
    pub deviation_max: (f64, u64),
}

impl Course {
    pub fn new(origin_s: f64, line: Line, sample_time_s: f64) -> Self {
        Self { origin_s, line, sample_time_s, last: None, last_deviation_s: 0.0, deviation_max: (0.0, 0) }
    }

    /// Where a row stands that comes after the last one, by the line and by the step from that row.
    #[inline(always)]
    pub fn next(&self, t_s: f64, (last_k, last_t): (u64, f64), tolerance: f64) -> Next {
        let t = t_s - self.origin_s;
        let slope = self.line.slope();
        // The line's place is surer than a rounded stamp's, until the clock has wandered away from it.
        let wandered = if self.last_deviation_s.abs() > tolerance { self.last_deviation_s } else { 0.0 };
        let missing = missing_before(t - self.line.at(real(last_k)) - wandered, slope);
        let k = (last_k + 1).saturating_add(if missing > 0.0 { missing as u64 } else { 0 });
        let deviation_s = t - self.line.at(real(k));
        let step_error = t_s - last_t - real(k - last_k) * slope;
        let wanders = step_error.abs() <= tolerance && deviation_s.abs() <= 0.5 * self.sample_time_s;
        let is_on_grid = deviation_s.abs() <= tolerance || wanders;
        Next { k, missing, deviation_s, is_on_grid }
    }

    /// Moves the line to a row behind a gap that is not on it.
    #[cold]
    pub fn begin_anew(&mut self, next: Next) -> Next {
        self.origin_s += next.deviation_s;
        Next { deviation_s: 0.0, is_on_grid: true, ..next }
    }

    /// Keeps a row as the last one; the line learns from it where it is not fitted to it already.
    #[inline(always)]
    pub fn keep(&mut self, file_line: u64, t_s: f64, next: Next, learns: bool) {
        if next.deviation_s.abs() > self.deviation_max.0 {
            self.deviation_max = (next.deviation_s.abs(), file_line);
        }
        if learns {
            self.line.learn(real(next.k), t_s - self.origin_s);
        }
        self.last = Some((next.k, t_s));
        self.last_deviation_s = next.deviation_s;
    }
}

/// A row's index as a number. It never has all 64 bits, and a number with a sign takes one instruction to convert.
#[inline]
fn real(k: u64) -> f64 {
    k.cast_signed() as f64
}

/// How many samples are missing before a row that comes so much later than the one before, s.
#[inline]
fn missing_before(later_s: f64, slope: f64) -> f64 {
    // Nearly always none, which takes neither division nor rounding to tell.
    if slope > 0.0 && later_s < 1.4 * slope {
        return 0.0;
    }
    let steps = later_s / slope;
    if steps >= 1.5 { libm::round(steps) - 1.0 } else { 0.0 }
}
