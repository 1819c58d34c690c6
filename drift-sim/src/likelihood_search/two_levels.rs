//! A signal that is at one of two levels, read off the load that was missed.
//!
//! The threshold between the levels is the one that leaves the least variance within them (Otsu 1979, IEEE Trans. SMC 9:62-66); runs beyond it are the spans.

/// Part of the samples that the signal must be on for, and may be on for.
const SHARE: [f64; 2] = [0.005, 0.6];
/// Distance of the two levels in standard deviations within them, from which they are two.
/// A sine, cut in half, has 4.1; a ramp 3.5.
const APART: f64 = 5.0;
/// Spans looked for at most: more is noise or an oscillation, not events.
const MOST_SPANS: usize = 200;
/// Shortest span, in samples.
const SHORTEST: usize = 3;
/// Part of the recording, as a divisor, that must lie before and after a single span: one that begins or ends with it is a step.
const EDGE: usize = 100;

/// A level and the samples [from, to) at which it is on.
#[derive(Debug, Clone, PartialEq)]
pub struct TwoLevels {
    /// On less off, in the signal's unit.
    pub level: f64,
    /// First sample of each span and the first after it.
    pub spans: Vec<(usize, usize)>,
}

/// The two levels of a signal; `None` where it has none that stand apart, or too many spans.
pub fn two_levels(signal: &[f64]) -> Option<TwoLevels> {
    let mut sorted: Vec<f64> = signal.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    if n < 50 {
        return None;
    }
    let (cut, below, above) = otsu(&sorted)?;
    // Off is the level that is nearer to nothing.
    let on_is_above = above.abs() > below.abs();
    let share = if on_is_above { n - cut } else { cut } as f64 / n as f64;
    if !(SHARE[0]..=SHARE[1]).contains(&share) {
        return None;
    }
    let threshold = 0.5 * (below + above);
    let on = |x: f64| x.is_finite() && (x > threshold) == on_is_above;
    let spans = runs(signal, on);
    let margin = signal.len() / EDGE;
    let to_the_end =
        matches!(spans.as_slice(), [(from, to)] if *from <= margin || *to + margin >= signal.len());
    if spans.is_empty() || spans.len() > MOST_SPANS || to_the_end {
        return None;
    }
    let mut flags = vec![false; signal.len()];
    for (from, to) in &spans {
        flags.iter_mut().take(*to).skip(*from).for_each(|flag| *flag = true);
    }
    let part = |wanted: bool| -> Vec<f64> {
        signal.iter().zip(&flags).filter(|(x, on)| **on == wanted && x.is_finite()).map(|(x, _)| *x).collect()
    };
    let (on, off) = (part(true), part(false));
    let (mean_on, mean_off) = (mean(&on), mean(&off));
    let within =
        libm::sqrt((squares(&on, mean_on) + squares(&off, mean_off)) / (on.len() + off.len()).max(1) as f64);
    let level = mean_on - mean_off;
    (level.abs() > APART * within).then_some(TwoLevels { level, spans })
}

/// (samples below the cut, mean below, mean above) of the best cut of sorted values.
fn otsu(sorted: &[f64]) -> Option<(usize, f64, f64)> {
    let n = sorted.len();
    let total: f64 = sorted.iter().sum();
    let (mut sum, mut best) = (0.0, None);
    let mut most = 0.0;
    for (i, x) in sorted.iter().enumerate().take(n - 1) {
        sum += x;
        let (n0, n1) = ((i + 1) as f64, (n - i - 1) as f64);
        let (m0, m1) = (sum / n0, (total - sum) / n1);
        let between = n0 * n1 * (m1 - m0) * (m1 - m0);
        if between > most {
            most = between;
            best = Some((i + 1, m0, m1));
        }
    }
    best
}

/// Runs of samples that are on, gaps and runs much shorter than the rest being closed and left out.
fn runs(signal: &[f64], on: impl Fn(f64) -> bool) -> Vec<(usize, usize)> {
    let mut found: Vec<(usize, usize)> = Vec::new();
    for (i, x) in signal.iter().enumerate() {
        if !on(*x) {
            continue;
        }
        match found.last_mut() {
            Some(last) if last.1 == i => last.1 = i + 1,
            _ => found.push((i, i + 1)),
        }
    }
    let mut lengths: Vec<usize> = found.iter().map(|(from, to)| to - from).collect();
    lengths.sort_unstable();
    // The typical span by samples, not by number: many slivers don't make slivers typical.
    let half = lengths.iter().sum::<usize>() / 2;
    let mut seen = 0;
    let typical = lengths.iter().find(|length| {
        seen += **length;
        seen >= half
    });
    let least = (typical.copied().unwrap_or(0) / 5).max(SHORTEST);
    let mut merged: Vec<(usize, usize)> = Vec::new();
    for (from, to) in found {
        match merged.last_mut() {
            Some(last) if from - last.1 < least => last.1 = to,
            _ => merged.push((from, to)),
        }
    }
    merged.retain(|(from, to)| to - from >= least);
    merged
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len().max(1) as f64
}

fn squares(x: &[f64], about: f64) -> f64 {
    x.iter().map(|v| (v - about) * (v - about)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three pulses of 5 in a slow oscillation of 1: found within a sample, with their level.
    #[test]
    fn pulses_stand_out_of_an_oscillation() {
        let pulses = [(100, 150), (300, 350), (700, 750)];
        let signal: Vec<f64> = (0..1000)
            .map(|i| {
                let on = pulses.iter().any(|(from, to)| (*from..*to).contains(&i));
                libm::sin(i as f64 * 0.7) + if on { 5.0 } else { 0.0 }
            })
            .collect();
        let found = two_levels(&signal).unwrap();
        assert_eq!(found.spans, pulses);
        assert!((found.level - 5.0).abs() < 0.1, "{}", found.level);
    }

    /// A sine alone has no two levels, nor has a ramp.
    #[test]
    fn what_is_not_at_two_levels_is_not_taken_for_it() {
        let sine: Vec<f64> = (0..2000).map(|i| libm::sin(i as f64 * 0.01)).collect();
        let ramp: Vec<f64> = (0..2000).map(f64::from).collect();
        assert_eq!(two_levels(&sine), None);
        assert_eq!(two_levels(&ramp), None);
    }
}
