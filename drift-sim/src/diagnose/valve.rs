//! A sticking valve in an export of SP, PV and OP, the plant and the law being unknown.
//!
//! What the stem makes of u drives a linear plant with coloured noise (a Hammerstein model). Each size of sticking is
//! tried together with each shape of plant, and must beat the best linear plant of all shapes by likelihood, each side
//! with a noise model of its own: the noise model of a linear plant may follow the stuck valve's slow steps, so the gain is small, but an
//! oscillation that a linear plant explains gains nothing. A valve that hangs behind u without jumping is backlash; the two differ
//! only by the jump and are a tie where its likelihood is about the same.
//!
//! A sine tells nothing: all that hysteresis does to it is to make it late and small, and so does a lag. A sticking valve in a loop
//! makes triangles and rectangles.

use crate::cores::AcrossCores as _;

use crate::physics::{Term, stem};
use crate::plant::Plant;

use super::linear_shape::LinearShape;
use super::signals::{Signals, range};
use super::spectrum;

/// What sticking must gain over the best linear plant, log-likelihood. Chosen with six loops of a refinery in view whose valves don't
/// stick: those that are no sine gain less than half of it.
const LEAST_GAIN: f64 = 25.0;
/// Slips at least: one is no more than a step, of whatever.
const LEAST_SLIPS: usize = 3;
/// Share of y's power in one frequency from which it is a sine, and the cycles that make one.
const SINE: (f64, f64) = (0.9, 10.0);
/// Closer than this, stiction and backlash are a tie.
const MARGIN: f64 = 10.0;
/// Fall of the log-likelihood at the ends of a 95 % interval.
const INTERVAL: f64 = 1.92;
/// Lags of the plants tried, in samples; 0 for none.
const LAGS: [[f64; 2]; 9] = [
    [0.5, 0.0],
    [1.5, 0.0],
    [4.0, 0.0],
    [16.0, 0.0],
    [60.0, 0.0],
    [1.5, 1.4],
    [4.0, 1.5],
    [16.0, 4.0],
    [60.0, 4.0],
];
/// Lags of the plants tried that integrate.
const INTEGRATING: [f64; 3] = [0.5, 4.0, 16.0];
/// Dead times tried, in samples, at most.
const DELAYS: usize = 5;
/// Linear plants that are tried with a sticking valve: the likeliest.
const LIKELIEST: usize = 6;
/// And the fastest, whatever they are worth without it.
const FASTEST: usize = 8;
/// Stick bands tried, as parts of the range of u, and how many between.
const BANDS: (f64, f64, usize) = (0.03, 1.2, 26);
/// Jumps tried, as parts of the stick band.
const JUMPS: [f64; 6] = [0.0, 0.05, 0.15, 0.3, 0.6, 1.0];

/// A valve that sticks.
#[derive(Debug, Clone)]
pub struct Valve {
    /// The sticking: stiction.
    pub term: Term,
    /// The linear plant behind it.
    pub plant: Plant,
    /// Half widths of the 95 % intervals of the term's parameters, by profile likelihood.
    pub half_widths: Vec<f64>,
    /// Gain in log-likelihood over the best linear plant.
    pub gain: f64,
    /// Kinds that this recording can't tell from it.
    pub tied: Vec<&'static str>,
}

/// One size of sticking at its best.
struct Tried {
    band: f64,
    jump: f64,
    likelihood: f64,
    plant: Plant,
}

/// The sticking, and how much it gains over the best linear plant, whether enough or not; `None` where u stands still or y has gaps.
pub fn search(signals: &Signals) -> Option<Valve> {
    if signals.y.iter().any(|y| !y.is_finite()) {
        return None;
    }
    let shapes = shapes(signals.sample_time_s);
    let mut linear: Vec<(f64, &LinearShape)> = shapes
        .par_iter()
        .filter_map(|shape| Some((shape.likelihood(signals, &signals.u)?.0, shape)))
        .collect();
    linear.sort_by(|a, b| b.0.total_cmp(&a.0));
    let likeliest = linear.iter().take(LIKELIEST).map(|(_, shape)| *shape);
    let mut with: Vec<&LinearShape> = likeliest.chain(shapes.iter().take(FASTEST)).collect();
    with.dedup();
    let (lowest, highest) = range(&signals.u);
    let bands = (0..BANDS.2).map(|i| {
        let part = i as f64 / (BANDS.2 - 1) as f64;
        (highest - lowest) * BANDS.0 * libm::pow(BANDS.1 / BANDS.0, part)
    });
    let sizes: Vec<(f64, f64)> = bands.flat_map(|band| JUMPS.map(|jump| (band, jump * band))).collect();
    let tried: Vec<Tried> =
        sizes.into_par_iter().filter_map(|(band, jump)| sticking(signals, &with, band, jump)).collect();
    judge(&tried, linear.first()?.0)
}

/// The sticking, if it is clearly there.
pub fn find(signals: &Signals) -> Option<Valve> {
    let sine =
        spectrum::dominant(&signals.y).is_some_and(|(cycles, share)| share > SINE.0 && cycles > SINE.1);
    if sine { None } else { search(signals).filter(|valve| valve.gain > LEAST_GAIN) }
}

fn judge(tried: &[Tried], linear: f64) -> Option<Valve> {
    let likelier = |a: &&Tried, b: &&Tried| a.likelihood.total_cmp(&b.likelihood);
    let best = tried.iter().max_by(likelier)?;
    let play = tried.iter().filter(|t| t.jump == 0.0).map(|t| t.likelihood).fold(f64::NEG_INFINITY, f64::max);
    let near: Vec<&Tried> = tried.iter().filter(|t| t.likelihood > best.likelihood - INTERVAL).collect();
    let half = |of: fn(&Tried) -> f64| {
        let spread = near.iter().map(|t| (of(t) - of(best)).abs()).fold(0.0, f64::max);
        // Never finer than the grid.
        spread.max(0.5 * best.band * (libm::pow(BANDS.1 / BANDS.0, 1.0 / (BANDS.2 - 1) as f64) - 1.0))
    };
    let term = Term::new("stiction", &[("stick_band", best.band), ("slip_jump", best.jump)]).ok()?;
    Some(Valve {
        term,
        plant: best.plant.clone(),
        half_widths: vec![half(|t| t.band), half(|t| t.jump)],
        gain: best.likelihood - linear,
        tied: if best.likelihood - play < MARGIN { vec!["backlash"] } else { Vec::new() },
    })
}

fn sticking(signals: &Signals, shapes: &[&LinearShape], band: f64, jump: f64) -> Option<Tried> {
    let v = stem(&signals.u, band, jump);
    let moves = v.windows(2).filter(|pair| matches!(pair, [a, b] if a != b)).count();
    if moves < LEAST_SLIPS {
        return None;
    }
    shapes
        .iter()
        .filter_map(|shape| shape.likelihood(signals, &v))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(likelihood, plant)| Tried { band, jump, likelihood, plant })
}

/// Plants to try, the fastest first.
fn shapes(ts: f64) -> Vec<LinearShape> {
    let lags = |lags: &[f64]| lags.iter().filter(|lag| **lag > 0.0).map(|lag| lag * ts).collect::<Vec<_>>();
    let lagging = LAGS.iter().map(|pair| (lags(pair), false));
    let integrating = INTEGRATING.iter().map(|lag| (lags(&[*lag]), true)).chain([(Vec::new(), true)]);
    lagging
        .chain(integrating)
        .flat_map(|(lags_s, integrates)| {
            (0..DELAYS).map(move |delay| LinearShape { lags_s: lags_s.clone(), integrates, delay })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// A flow under PI control: valve with this sticking, lag of 1.5 samples, gain 1, noise of 0.1; the set-point moves now and then.
    fn flow(stick_band: f64, slip_jump: f64, sine: f64) -> Signals {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let (mut x, mut integral, mut at) = (0.0, 0.0, None::<f64>);
        let (mut r, mut y, mut u) = (Vec::new(), Vec::new(), Vec::new());
        for n in 0..900 {
            let goal = 2.0 * f64::from((n / 150) % 3) + sine * libm::sin(f64::from(n) * 0.2);
            let noise: f64 = StandardNormal.sample(&mut random);
            let now = x + 0.1 * noise;
            integral += 0.04 * (goal - now);
            let out = 0.2 * (goal - now) + integral;
            let before = at.unwrap_or(out);
            let off = out - before;
            let stem =
                if off.abs() > stick_band { out - off.signum() * (stick_band - slip_jump) } else { before };
            at = Some(stem);
            x += (1.0 - libm::exp(-1.0 / 1.5)) * (stem - x);
            r.push(goal);
            y.push(now);
            u.push(out);
        }
        Signals { sample_time_s: 10.0, start_s: 0.0, origin_s: 0.0, r, y, u, inputs: Vec::new() }
    }

    /// How far the stem hangs behind u on the average, band less half the jump, is told; how that divides, not by an hour of slips.
    #[test]
    fn a_sticking_valve_is_found_with_how_far_it_hangs_behind() {
        let found = find(&flow(0.8, 0.3, 0.0)).expect("sticking");
        let behind = found.term.value("stick_band").unwrap() - 0.5 * found.term.value("slip_jump").unwrap();
        assert!((behind / 0.65 - 1.0).abs() < 0.15, "{found:?}");
    }

    #[test]
    fn a_free_valve_does_not_stick_whether_the_loop_rests_or_swings() {
        for sine in [0.0, 1.0] {
            let found = find(&flow(0.0, 0.0, sine));
            assert!(found.is_none(), "{found:?}");
        }
    }
}
