//! When the noise changes: where the innovations are more by their squares after than before.

use crate::estimate::hypothesis::ENDS_OF_NOISE;
use crate::physics::{Kind, Start};

use super::{Base, Begin, neutral, wider};

/// Times tried.
const TIMES: usize = 46;

/// The change at each of the times.
pub fn changes(base: &Base<'_>, kind: &'static Kind) -> Option<Vec<Begin>> {
    let hypothesis = wider(base, kind, neutral(kind));
    let from = hypothesis.widen(&base.fit.hypothesis, &base.fit.point);
    let lengths: Vec<usize> = base
        .data
        .recordings
        .iter()
        .zip(&base.data.fitted)
        .take(base.data.healthy_from)
        .map(|(s, n)| s.len().min(*n))
        .filter(|n| *n > 0)
        .collect();
    let longest = *lengths.iter().max()?;
    let ts = hypothesis.model.sample_time_s;
    let begins = (0..TIMES).filter_map(|i| {
        let at = ((ENDS_OF_NOISE + (1.0 - 2.0 * ENDS_OF_NOISE) * i as f64 / (TIMES - 1) as f64)
            * longest as f64) as usize;
        let (mut before, mut after) = ((0.0, 0.0), (0.0, 0.0));
        let mut first = 0;
        for length in &lengths {
            let z = base.fit.rows.z.get(first..first + length)?;
            for (n, z) in z.iter().enumerate() {
                let side = if n < at { &mut before } else { &mut after };
                side.0 += z * z;
                side.1 += 1.0;
            }
            first += length;
        }
        let mean = |(sum, n): (f64, f64)| (sum / f64::max(n, 1.0)).max(1e-300);
        let all = mean((before.0 + after.0, before.1 + after.1));
        let score = (before.1 + after.1) * libm::log(all)
            - before.1 * libm::log(mean(before))
            - after.1 * libm::log(mean(after));
        let ratio = libm::sqrt(mean(after) / mean(before)).clamp(0.5, 20.0);
        let onset_s = at as f64 * ts;
        let point = hypothesis.started(&from, &Start::of(vec![ratio]), onset_s);
        Some(Begin { score, hypothesis: hypothesis.clone(), point, onset_s })
    });
    Some(begins.collect())
}
