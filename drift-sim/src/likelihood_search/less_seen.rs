//! A proof by more than a fit has left unseen, where that proves nothing: the reference moves early, and the loop holds then; what is named begins early, and a load that drifts makes up for
//! it by then; or it is something that a healthy loop lacked, and the one plant that was to explain both foretells what it is now, and not what it was. There both fits are made again without
//! some of what they have seen, and foretell that as well. Where that proves nothing either, both see half of what shows the kind, and no hold-out. The kind itself was chosen with what they
//! foretell then, which the proof has to make up for.

use crate::estimate::fit::Fit;
use crate::estimate::likelihood::Data;
use crate::estimate::signals::Signals;
use crate::physics::KINDS;

use super::prove::{Gained, gained};
use super::rivals::stuck;

/// Part of the reference's way that must lie in what proves, for that to prove anything.
const LEAST_WAY: f64 = 0.2;
/// Part of a recording that a fit has not seen, at least, where it is to prove anything.
const LEAST_UNSEEN: f64 = 0.1;
/// Parts of what a fit has seen that it may still see then; of the first recording half, for a fit is made of something.
const STILL_SEEN: [f64; 2] = [0.5, 0.0];
/// Part of a healthy recording that a fit may see then.
const HEALTHY_SEEN: f64 = 0.7;
/// Steps of the fits that are made again.
const STEPS: usize = 10;

/// What a fit that has seen half foretells, over what it gains on all that was seen, at most: beyond that the other one lacks a number that it had yet to learn, and no physics. (A spring that
/// gained 15 nats foretold 119, where a growing load was the truth; four true ones foretold 0.4 to 2 times what they gained.)
const MOST_FORETOLD: f64 = 3.0;

/// What one fit gains over another, a term of its that begins at so many seconds, beyond what both see then; `None` where that proves nothing.
pub fn gained_again(better: &Fit, worse: &Fit, onset_s: f64, data: &Data) -> Option<Gained> {
    let less = less_seen(data, onset_s).and_then(|seen| foretold(better, worse, &data.seeing(seen)));
    let of_half = || {
        let most = MOST_FORETOLD * 0.5 * (worse.objective() - better.objective());
        foretold(better, worse, &data.seeing(half_seen(data, onset_s))).filter(|gained| gained.sum < most)
    };
    less.or_else(of_half)
}

/// What the better of two fits that are made again gains on what they do not see, where that proves it.
fn foretold(better: &Fit, worse: &Fit, data: &Data) -> Option<Gained> {
    let again = |fit: &Fit| {
        let mut fit = fit.on(data)?;
        fit.descend(data, STEPS, &stuck(&fit.hypothesis));
        Some(fit)
    };
    gained(&again(better)?, &again(worse)?, data).filter(|gained| gained.is_sure_among(KINDS.len()))
}

/// Of the first recording what comes before the onset and half of what comes after; nothing of the others, but of healthy ones.
fn half_seen(data: &Data, onset_s: f64) -> Vec<usize> {
    still_seen(data, |i, signals, fitted| if i == 0 { half_after(onset_s, signals, fitted) } else { 0 })
}

/// What a fit still sees of each recording, this of those of now.
fn still_seen(data: &Data, of_now: impl Fn(usize, &Signals, usize) -> usize) -> Vec<usize> {
    let each = data.recordings.iter().zip(&data.fitted).enumerate();
    let seen = each.map(|(i, (signals, fitted))| match i < data.healthy_from {
        true => of_now(i, signals, *fitted),
        false => (HEALTHY_SEEN * *fitted as f64) as usize,
    });
    seen.collect()
}

fn half_after(onset_s: f64, signals: &Signals, fitted: usize) -> usize {
    let onset = ((onset_s / signals.sample_time_s) as usize).min(fitted);
    onset + (fitted - onset) / 2
}

/// The samples of each recording that a fit sees; `None` where the reference moves enough in what it has not seen, or nowhere, nothing begins in a further recording, and none is healthy.
fn less_seen(data: &Data, onset_s: f64) -> Option<Vec<usize>> {
    let less = still_seen(data, |i, signals, fitted| {
        let less = less_of(signals, fitted, i == 0);
        if i == 0 { less } else { less.min(before(onset_s, signals, fitted)) }
    });
    (less != data.fitted).then_some(less)
}

/// Half of what comes before an onset, where a fit has seen that.
fn before(onset_s: f64, signals: &Signals, fitted: usize) -> usize {
    let onset = (onset_s / signals.sample_time_s) as usize;
    if onset > 0 && onset < fitted { onset / 2 } else { fitted }
}

fn less_of(signals: &Signals, fitted: usize, is_first: bool) -> usize {
    let way = |from: usize| -> f64 {
        let r = signals.r.get(from..).unwrap_or(&[]);
        r.windows(2).map(|r| (r[1] - r[0]).abs()).sum()
    };
    let least = LEAST_WAY * way(0);
    let unseen = signals.len().saturating_sub(fitted) as f64;
    if unseen < LEAST_UNSEEN * signals.len() as f64 || least == 0.0 || way(fitted) >= least {
        return fitted;
    }
    let least_seen = if is_first { fitted / 2 } else { 0 };
    let still = STILL_SEEN.map(|part| ((part * fitted as f64) as usize).max(least_seen));
    still.into_iter().find(|seen| way(*seen) >= least).unwrap_or(fitted)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(r: impl Fn(usize) -> f64) -> Signals {
        Signals { r: (0..1000).map(r).collect(), y: vec![0.0; 1000], ..Signals::default() }
    }

    /// What is still seen of 1000 samples of which 500 were, over this reference.
    fn seen_over(r: impl Fn(usize) -> f64, is_first: bool) -> usize {
        less_of(&of(r), 500, is_first)
    }

    /// A fit that has seen 500 samples, where something begins at 300 of them, and at none, and at 600.
    #[test]
    fn what_proves_holds_what_begins() {
        let begins = |at: f64| before(0.1 * at, &Signals { sample_time_s: 0.1, ..of(|_| 3.0) }, 500);
        assert_eq!([begins(300.5), begins(0.0), begins(600.0)], [150, 500, 500]);
    }

    /// A fit that has seen 500 samples, where something is there from the start, begins at 300 of them, and at 600.
    #[test]
    fn half_of_what_shows_it_proves() {
        let half = |at: f64| half_after(0.1 * at, &Signals { sample_time_s: 0.1, ..of(|_| 3.0) }, 500);
        assert_eq!([half(0.0), half(300.5), half(600.0)], [250, 400, 500]);
    }

    #[test]
    fn what_proves_holds_a_move_of_the_reference() {
        let step = |at: usize| move |n: usize| if n < at { 0.0 } else { 1.0 };
        assert_eq!(seen_over(step(600), false), 500);
        assert_eq!(seen_over(step(400), false), 250);
        assert_eq!(seen_over(step(100), false), 0);
        assert_eq!(seen_over(step(100), true), 500);
        assert_eq!(seen_over(|n| if n % 100 < 50 { 0.0 } else { 1.0 }, false), 500);
        assert_eq!(seen_over(|_| 3.0, false), 500);
        // One in coarser samples, of which the last is left over, was seen whole.
        assert_eq!(less_of(&of(step(400)), 999, true), 999);
    }
}
