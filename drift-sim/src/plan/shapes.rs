//! References that may tell causes apart: each begins and ends at the present r, stays within its limits and moves no faster than it may.

/// A kind of reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Steps of several sizes both ways.
    Steps,
    /// Slow ramps up and down.
    Ramps,
    /// A staircase up and down, resting on each stair, with a small step back before the next.
    Dwell,
    /// A sine that grows faster.
    Chirp,
    /// A part of each, and the same once more.
    Mixed,
}

/// All of them.
pub const SHAPES: [Shape; 5] = [Shape::Steps, Shape::Mixed, Shape::Ramps, Shape::Chirp, Shape::Dwell];

/// Where a reference may be and how fast it may move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Room {
    /// r at the beginning and at the end.
    pub from: f64,
    /// The least r.
    pub low: f64,
    /// The greatest r.
    pub high: f64,
    /// The most that r may change from sample to sample.
    pub most_change: f64,
}

/// Levels of the steps, as parts of the way from the least to the greatest r: large and small, each way, none twice.
const LEVELS: [f64; 12] = [1.0, 0.0, 0.7, 0.25, 0.85, 0.6, 0.1, 0.5, 0.95, 0.35, 0.05, 0.75];
/// Stairs of a dwell up, and how far it steps back before the next, as part of a stair.
const STAIRS: usize = 3;
const BACK: f64 = 0.3;
/// Cycles of a chirp at its beginning and how many times faster it ends.
const CYCLES: f64 = 2.0;
const FASTER: f64 = 8.0;
/// Ramps up and down.
const RAMPS: usize = 2;
/// Part of a reference in which it rests at the beginning and at the end.
const REST: f64 = 0.03;

impl Shape {
    /// Its name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Steps => "steps both ways",
            Self::Ramps => "slow ramps and reversals",
            Self::Dwell => "stairs with a dwell on each",
            Self::Chirp => "a chirp",
            Self::Mixed => "steps, ramps, a chirp and stairs",
        }
    }

    /// The reference, this many samples long.
    pub fn reference(self, samples: usize, room: &Room) -> Vec<f64> {
        let rest = ((REST * samples as f64) as usize).max(1);
        let moving = samples.saturating_sub(2 * rest);
        let start = if room.high > room.low { (room.from - room.low) / (room.high - room.low) } else { 0.0 };
        let parts = std::iter::repeat_n(start, rest)
            .chain((0..moving).map(|n| self.part(n as f64 / moving.max(1) as f64, start)))
            .chain(std::iter::repeat_n(start, samples.saturating_sub(rest + moving)));
        let mut now = room.from;
        let wanted = parts.map(|part| room.low + (room.high - room.low) * part);
        let follow = |wanted: f64| {
            now += (wanted - now).clamp(-room.most_change, room.most_change);
            now
        };
        wanted.map(follow).collect()
    }

    /// Where between the limits the reference is at a part of its way.
    fn part(self, at: f64, start: f64) -> f64 {
        match self {
            Self::Steps => {
                let i = (at * LEVELS.len() as f64) as usize;
                LEVELS.get(i).copied().unwrap_or(start)
            }
            Self::Ramps => ramps(at, start),
            Self::Dwell => {
                let stairs = 2 * STAIRS;
                let place = at * stairs as f64;
                let (stair, within) = (place as usize, place.fract());
                let height =
                    |i: usize| if i < STAIRS { i + 1 } else { stairs - 1 - i } as f64 / STAIRS as f64;
                let up = if stair < STAIRS { 1.0 } else { -1.0 };
                let back = if within > 0.7 { BACK / STAIRS as f64 } else { 0.0 };
                (height(stair) - up * back).clamp(0.0, 1.0)
            }
            Self::Chirp => {
                let grown = libm::exp(at * libm::log(FASTER));
                let turns = CYCLES * (grown - 1.0) / libm::log(FASTER) * 2.0;
                // It begins and ends where the loop is.
                let size = (at / 0.1).min((1.0 - at) / 0.1).clamp(0.0, 1.0);
                let middle = start + (0.5 - start) * size;
                middle + 0.5 * size * libm::sin(std::f64::consts::TAU * turns)
            }
            Self::Mixed => {
                let place = 8.0 * at;
                let within = place.fract();
                [Self::Steps, Self::Ramps, Self::Chirp, Self::Dwell]
                    .get(place as usize % 4)
                    .map_or(start, |shape| shape.part(within, start))
            }
        }
    }
}

/// From the start up, down and back, some times.
fn ramps(at: f64, start: f64) -> f64 {
    let way = (at * RAMPS as f64).fract();
    // One way is up, down over all of the range, and up to the start again.
    let (up, down) = (1.0 - start, 1.0);
    let gone = way * (up + down + start);
    if gone < up {
        start + gone
    } else if gone < up + down {
        1.0 - (gone - up)
    } else {
        gone - up - down
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_reference_begins_and_ends_at_the_present_r_and_keeps_its_limits() {
        let room = Room { from: 3.0, low: -1.0, high: 5.0, most_change: 0.11 };
        for shape in SHAPES {
            for samples in [300, 1000, 4321] {
                let r = shape.reference(samples, &room);
                assert_eq!(r.len(), samples);
                assert!((r[0] - 3.0).abs() < 1e-12, "{shape:?}");
                assert!(r.iter().all(|r| (-1.0..=5.0).contains(r)), "{shape:?}");
                assert!(r.windows(2).all(|pair| (pair[1] - pair[0]).abs() <= 0.11 + 1e-12), "{shape:?}");
                let (low, high) = crate::estimate::signals::range(&r);
                assert!(high - low > 1.5, "{shape:?} moves from {low} to {high} alone");
            }
            assert!((shape.reference(4321, &room)[4320] - 3.0).abs() < 1e-9, "{shape:?}");
        }
    }

    #[test]
    fn ramps_go_up_and_down_at_one_speed() {
        let room = Room { from: 0.0, low: 0.0, high: 1.0, most_change: f64::INFINITY };
        let r = Shape::Ramps.reference(10_000, &room);
        let speeds: Vec<f64> =
            r.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|s| *s > 1e-9).collect();
        let (slowest, fastest) = crate::estimate::signals::range(&speeds);
        assert!(fastest < 1.01 * slowest + 1e-9 || speeds.len() > 9_000, "{slowest} {fastest}");
    }
}
