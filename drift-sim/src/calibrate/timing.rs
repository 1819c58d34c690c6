//! Window and hop in ticks and blocks, and a window where none is given: about twenty correlation times of the loop, so that
//! neighbouring windows are nearly independent.

use super::autocorrelation::batch_time;
use super::{Options, Signals};
use crate::baseline_file::{CAPACITY, Timing};
use crate::sentences::{plain, typed};
use crate::{Error, Result};

/// Windows are this many correlation times long: neighbours then correlate by about 0.026.
pub const CORRELATION_TIMES: f64 = 20.0;
/// A window that is chosen leaves at least this many of them.
const LEAST_WINDOWS: u64 = 30;
/// Blocks per window that are preferred at most.
const BLOCKS: u64 = 16;
/// The longest window, ticks.
const MOST_TICKS: f64 = 1e9;
/// The longest block of the monitor's sums, ticks.
const LONGEST_BLOCK: u64 = 1 << 16;

/// A window and how it came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Blocks and ticks.
    pub timing: Timing,
    /// Why this window, in a sentence, where it was chosen here.
    pub reason: Option<String>,
    /// The longest correlation time of e, |e|, u and r, s.
    pub correlation_s: f64,
}

/// Window and hop as asked for, or chosen.
///
/// # Errors
/// Not whole ticks; no division into blocks; a recording too short.
pub fn choose(recordings: &[Signals<'_>], options: &Options) -> Result<Choice> {
    let sample_time_s = recordings.first().map_or(f64::NAN, |r| r.sample_time_s);
    let correlation = correlation_ticks(recordings);
    let ticks = |name: &str, s: f64| whole_ticks(name, s, sample_time_s);
    let hop = options.hop_s.map(|s| ticks("hop", s)).transpose()?;
    let (window, reason) = match options.window_s {
        Some(s) => (ticks("window", s)?, None),
        None => {
            let (window, reason) = default_window(recordings, correlation, hop, sample_time_s)?;
            (window, Some(reason))
        }
    };
    let (block_ticks, window_blocks, hop_blocks) = blocks(window, hop.unwrap_or(window), sample_time_s)?;
    let timing = Timing { sample_time_s: sample_time_s as f32, block_ticks, window_blocks, hop_blocks };
    Ok(Choice { timing, reason, correlation_s: correlation * sample_time_s })
}

fn whole_ticks(name: &str, s: f64, sample_time_s: f64) -> Result<u64> {
    let ticks = s / sample_time_s;
    let whole = ticks.round();
    if !(s.is_finite() && (1.0..=MOST_TICKS).contains(&whole)) {
        let most = MOST_TICKS * sample_time_s;
        let what = format!("--{name} {} is {} samples of {} s", typed(s), typed(ticks), typed(sample_time_s));
        return Err(Error::new(what).allowed(format!(
            "1 to {} samples, {} to {} s",
            typed(MOST_TICKS),
            typed(sample_time_s),
            typed(most)
        )));
    }
    if (ticks - whole).abs() > 1e-6 * whole {
        let what = format!("--{name} {} is {} samples of {} s", typed(s), typed(ticks), typed(sample_time_s));
        let near = typed(whole * sample_time_s);
        return Err(Error::new(what).allowed(format!("a whole number of samples, such as --{name} {near}")));
    }
    Ok(whole as u64)
}

/// The longest of the correlation times of e, of |e| (which an index integrates), of u and of r, ticks.
fn correlation_ticks(recordings: &[Signals<'_>]) -> f64 {
    let of = |signals: &Signals<'_>| {
        let e: Vec<f64> = signals.r.iter().zip(signals.y).map(|(r, y)| r - y).collect();
        let magnitude: Vec<f64> = e.iter().map(|e| e.abs()).collect();
        [&e[..], &magnitude, signals.u, signals.r].into_iter().map(batch_time).fold(1.0, f64::max)
    };
    recordings.iter().map(of).fold(1.0, f64::max)
}

fn default_window(
    recordings: &[Signals<'_>],
    correlation: f64,
    hop: Option<u64>,
    sample_time_s: f64,
) -> Result<(u64, String)> {
    let total: u64 = recordings.iter().map(|r| r.r.len() as u64).sum();
    let most = total / LEAST_WINDOWS;
    if most == 0 {
        let what = format!("{total} samples are too few to choose a window for");
        return Err(Error::new(what).allowed("--window, or a longer recording"));
    }
    let wanted = (CORRELATION_TIMES * correlation).ceil() as u64;
    let ticks = wanted.clamp(1, most);
    // Whole blocks: of the hop's length, or ten of two leading digits.
    let window = match hop {
        Some(hop) => ticks.div_ceil(hop).clamp(1, CAPACITY as u64) * hop,
        None if ticks < 10 => ticks,
        None => 10 * two_digits(ticks / 10),
    };
    let times = window as f64 / correlation;
    let shorter = if wanted > most { ", as long as leaves 30 windows" } else { "" };
    let reason = format!(
        "window {} s chosen: {times:.0} correlation times of e, u or r ({} s){shorter}",
        typed(window as f64 * sample_time_s),
        plain(correlation * sample_time_s, 3),
    );
    Ok((window, reason))
}

fn two_digits(n: u64) -> u64 {
    let mut unit = 1;
    while n / unit >= 100 {
        unit *= 10;
    }
    n / unit * unit
}

/// Block length in ticks, blocks per window, blocks per hop: the most blocks up to 16, up to 64 where the hop needs it.
fn blocks(window: u64, hop: u64, sample_time_s: f64) -> Result<(u32, u16, u16)> {
    let common = gcd(window, hop);
    let fits = |block: u64, most: u64| {
        common.is_multiple_of(block)
            && block <= LONGEST_BLOCK
            && window / block <= most
            && hop / block <= u64::from(u16::MAX)
    };
    let shortest = |most: u64| (window.div_ceil(most)..=common.min(LONGEST_BLOCK)).find(|&b| fits(b, most));
    let longest = || {
        (window.div_ceil(CAPACITY as u64)..=common.min(LONGEST_BLOCK))
            .rev()
            .find(|&b| fits(b, CAPACITY as u64))
    };
    match shortest(BLOCKS).or_else(longest) {
        Some(block) => Ok((block as u32, (window / block) as u16, (hop / block) as u16)),
        None => {
            let near = nearest(window, hop).map(|(window, hop)| {
                let (window_s, hop_s) = (window as f64 * sample_time_s, hop as f64 * sample_time_s);
                format!("such as --window {} --hop {}", typed(window_s), typed(hop_s))
            });
            let rule = "up to 64 blocks per window of up to 65536 samples, a whole number of them per hop";
            Err(Error::new(format!("a window of {window} and a hop of {hop} samples share no block length"))
                .allowed(near.map_or(rule.to_owned(), |near| format!("{near}: {rule}"))))
        }
    }
}

/// The closest pair that can be divided: first another hop, then another window.
fn nearest(window: u64, hop: u64) -> Option<(u64, u64)> {
    let possible = |window: u64, hop: u64| {
        let block = gcd(window, hop);
        let block = if block > LONGEST_BLOCK {
            (1..=LONGEST_BLOCK).rev().find(|b| block.is_multiple_of(*b)).unwrap_or(1)
        } else {
            block
        };
        window / block <= CAPACITY as u64
    };
    for away in 0..=4096u64 {
        for window in
            [window.checked_add(away), window.checked_sub(away)].into_iter().flatten().filter(|w| *w > 0)
        {
            let hops = (0..=hop / 10 + 1).flat_map(|d| [hop + d, hop.saturating_sub(d).max(1)]);
            if let Some(hop) = hops.take(2048).find(|&hop| possible(window, hop)) {
                return Some((window, hop));
            }
        }
    }
    None
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_divide_into_blocks() {
        assert_eq!(blocks(3000, 3000, 1e-3).unwrap(), (200, 15, 15));
        assert_eq!(blocks(3000, 250, 1e-3).unwrap(), (250, 12, 1));
        assert_eq!(blocks(3000, 1000, 1e-3).unwrap(), (200, 15, 5));
        // The hop needs more than sixteen.
        assert_eq!(blocks(3000, 50, 1e-3).unwrap(), (50, 60, 1));
        // A prime number of ticks is one block.
        assert_eq!(blocks(3001, 3001, 1e-3).unwrap(), (3001, 1, 1));
        // Longer blocks than the sums can hold.
        assert_eq!(blocks(3_000_000, 3_000_000, 1e-3).unwrap(), (62_500, 48, 48));
    }

    #[test]
    fn what_can_not_be_divided_names_what_can() {
        let error = blocks(3000, 7, 1e-3).unwrap_err().to_string();
        assert!(error.contains("a window of 3000 and a hop of 7 samples"), "{error}");
        assert!(error.contains("such as --window "), "{error}");
        let error = whole_ticks("window", 0.0305, 1e-3).unwrap_err().to_string();
        assert!(
            error.contains("30.5 samples of 0.001 s; a whole number of samples, such as --window 0.031"),
            "{error}"
        );
        assert!(whole_ticks("window", f64::NAN, 1e-3).is_err());
        assert!(whole_ticks("window", -1.0, 1e-3).is_err());
    }
}
