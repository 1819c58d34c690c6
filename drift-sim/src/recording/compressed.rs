//! A signal that an archive has compressed. Process historians keep the samples at which a signal bends, and draw straight lines between them when they are asked for all
//! (the swinging door of E. H. Bristol, US patent 4 669 097, and the boxcar of J. C. Hale and H. L. Sellars, Chem. Eng. Progress 77, 1981; what they do to an analysis:
//! N. F. Thornhill and others, The impact of compression on data-driven process analyses, J. Process Control 14, 2004). What lies on such a line was not measured.

/// Samples in a row, beyond the two that any line goes through, that lie on a line.
const LEAST_ON_A_LINE: usize = 3;
/// Steps of the file's digits that a second difference on a line has at most: each of its samples is rounded by half a one.
const ROUNDED: f64 = 2.5;
/// Steps of the digits that a line rises by from sample to sample at least: a signal in few steps lies on lines by chance.
const RISES: f64 = 20.0;
/// Part of its slope by which a line's slope changes where the next one begins, at least: a machine that moves steadily slows down over many samples.
const KINK: f64 = 0.3;
/// Lines that make a compression, and the part of the samples on them: a machine that follows a ramp does so a few times.
const LEAST_LINES: usize = 30;
const LEAST_PART: f64 = 0.2;
/// Decimals of a file that are looked for, and the part of the values that must have no more.
const MOST_DECIMALS: i32 = 9;
const MOST: f64 = 0.99;
/// How far a value may be off its decimals, in steps of the last.
const OFF: f64 = 1e-3;
/// What a value with more decimals is rounded to, as part of the largest.
const SINGLE: f64 = 1e-7;

/// Which samples lie inside a line; `None` where the signal was not compressed.
pub fn interpolated(values: &[f64]) -> Option<Vec<bool>> {
    let step = step(values);
    let rises = |from: f64, to: f64| (to - from).abs() > RISES * step;
    let is_on = |three: &[f64]| match three {
        [a, b, c] => (c - 2.0 * b + a).abs() <= ROUNDED * step && rises(*a, *b) && rises(*b, *c),
        _ => false,
    };
    let bends = |three: &[f64]| match three {
        [a, b, c] => (c - 2.0 * b + a).abs() > KINK * f64::max((b - a).abs(), (c - b).abs()),
        _ => false,
    };
    let mut inside = vec![false; values.len()];
    let (mut lines, mut samples, mut length) = (0, 0, 0);
    for (n, three) in values.windows(3).enumerate() {
        if is_on(three) {
            length += 1;
            continue;
        }
        // All samples of a line but its ends: the middles of the threes that it was told by.
        if length >= LEAST_ON_A_LINE && bends(three) {
            lines += 1;
            samples += length;
            inside.get_mut(n + 1 - length..n + 1)?.fill(true);
        }
        length = 0;
    }
    let is_compressed = lines >= LEAST_LINES && samples as f64 > LEAST_PART * values.len() as f64;
    is_compressed.then_some(inside)
}

/// What the file's last digit counts.
fn step(values: &[f64]) -> f64 {
    let known = || values.iter().filter(|value| value.is_finite());
    let is_written_to = |step: &f64| {
        let has_no_more = |value: &&f64| (*value / step - libm::round(*value / step)).abs() < OFF;
        known().filter(has_no_more).count() as f64 > MOST * known().count() as f64
    };
    let decimals = (0..=MOST_DECIMALS).map(|decimals| libm::pow(10.0, -f64::from(decimals)));
    let largest = known().fold(0.0, |most: f64, value| most.max(value.abs()));
    decimals.into_iter().find(is_written_to).unwrap_or(SINGLE * largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wave and a faster one, as an archive keeps it that draws lines of 4 to 9 samples, written to 3 decimals.
    fn archived(samples: usize) -> (Vec<f64>, Vec<usize>) {
        let at = |n: usize| 40.0 * libm::sin(n as f64 / 9.0) + 7.0 * libm::sin(n as f64 / 2.3) + 1600.0;
        let mut kept = vec![0];
        while let Some(last) = kept.last().copied().filter(|last| *last < samples) {
            kept.push(last + 4 + (7 * kept.len()) % 6);
        }
        let line = |pair: &[usize]| {
            let (from, to) = (pair[0], pair[1]);
            let part = move |n: usize| (n - from) as f64 / (to - from) as f64;
            (from..to).map(move |n| at(from) + part(n) * (at(to) - at(from)))
        };
        let all = kept.windows(2).flat_map(line).map(|y| libm::round(1e3 * y) / 1e3);
        (all.take(samples).collect(), kept)
    }

    #[test]
    fn what_an_archive_drew_is_told_from_what_it_kept() {
        let (values, kept) = archived(2000);
        let inside = interpolated(&values).expect("compressed");
        assert!(kept.iter().filter(|n| **n < 2000).all(|n| !inside[*n]));
        let drawn = inside.iter().filter(|inside| **inside).count();
        assert!(drawn > 1200, "{drawn}");
    }

    /// The same wave as it was; rounded to steps that it moves by few of; and a machine that follows a ramp to and fro without noise.
    #[test]
    fn what_was_measured_is_not_taken_for_drawn() {
        let wave = |n: usize| 40.0 * libm::sin(n as f64 / 9.0);
        let samples = || 0..4000_usize;
        assert_eq!(
            interpolated(&samples().map(|n| libm::round(1e3 * wave(n)) / 1e3).collect::<Vec<_>>()),
            None
        );
        assert_eq!(
            interpolated(&samples().map(|n| libm::round(2.0 * wave(n)) / 2.0).collect::<Vec<_>>()),
            None
        );
        let ramp = |n: usize| (n % 400).min(400 - n % 400) as f64 * 0.1;
        assert_eq!(interpolated(&samples().map(ramp).collect::<Vec<_>>()), None);
        // A drive that goes to and fro a hundred times, its speed a wave that is cut off.
        let mut position = 0.0;
        let moved = (0..40_000).map(|n| {
            position += (1.5 * libm::sin(n as f64 / 64.0)).clamp(-1.0, 1.0) / 3.0;
            position
        });
        assert_eq!(interpolated(&moved.collect::<Vec<_>>()), None);
    }
}
