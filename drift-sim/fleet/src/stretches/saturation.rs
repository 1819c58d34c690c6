//! u at the least or greatest value that it ever had, and the error does not vanish meanwhile. A law that holds its integral at a limit still
//! answers to noise, so that u stays near the limit and not on it.

use super::{Kind, LEAST_SAMPLES, Stretch};

/// The mean error counts as not vanished from so many standard deviations of its noise on.
const VANISHED: f64 = 2.0;
/// So near to the end of u's range, as a share of the range, u counts as at it.
const NEAR: f64 = 0.01;

/// The end of u's range.
#[derive(Debug, Clone, Copy, PartialEq)]
enum End {
    Least,
    Greatest,
}

#[derive(Debug, Clone, Copy)]
struct Open {
    end: End,
    /// The value nearest to the end.
    u: f64,
    from_s: f64,
    to_s: f64,
    samples: u64,
    sum_e: f64,
    last_e: f64,
    /// Of squared differences from sample to sample: twice the noise's variance each.
    roughness: f64,
}

/// Looks for it.
#[derive(Debug, Clone, Default)]
pub(super) struct Saturation {
    range: Option<(f64, f64)>,
    open: Option<Open>,
}

impl Saturation {
    pub fn sample(&mut self, t_s: f64, e: f64, u: f64) -> Option<Stretch> {
        let range = self.range.map_or((u, u), |(least, greatest)| (least.min(u), greatest.max(u)));
        self.range = Some(range);
        let end = if is_near(End::Greatest, u, range) {
            Some(End::Greatest)
        } else {
            is_near(End::Least, u, range).then_some(End::Least)
        };
        let found = if self.open.map(|open| open.end) == end { None } else { self.end() };
        let Some(end) = end else { return found };
        let fresh =
            Open { end, u, from_s: t_s, to_s: t_s, samples: 0, sum_e: 0.0, last_e: e, roughness: 0.0 };
        let open = self.open.get_or_insert(fresh);
        open.u = if end == End::Greatest { open.u.max(u) } else { open.u.min(u) };
        open.roughness += (e - open.last_e).powi(2);
        open.sum_e += e;
        open.samples += 1;
        (open.to_s, open.last_e) = (t_s, e);
        found
    }

    pub fn end(&mut self) -> Option<Stretch> {
        let open = self.open.take()?;
        // A value that was left behind since was no limit.
        let at_limit = is_near(open.end, open.u, self.range?);
        let n = open.samples as f64;
        let (mean_e, noise) = (open.sum_e / n, (0.5 * open.roughness / n).sqrt());
        let is_clear = mean_e.abs() > VANISHED * noise && mean_e != 0.0;
        let score = if noise > 0.0 { (mean_e / noise).abs() } else { f64::MAX };
        (open.samples >= LEAST_SAMPLES && at_limit && is_clear).then_some(Stretch {
            kind: Kind::Saturation,
            from_s: open.from_s,
            to_s: open.to_s,
            score,
        })
    }
}

fn is_near(end: End, u: f64, (least, greatest): (f64, f64)) -> bool {
    let margin = NEAR * (greatest - least);
    match end {
        End::Least => u <= least + margin,
        End::Greatest => u >= greatest - margin,
    }
}
