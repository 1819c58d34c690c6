//! A loop that disturbances alone move, under a law that nobody knows: its reference rests, and u answers y. What is identified there may be the law turned round, for where a disturbance
//! leads y, u follows by the law as y does by the plant (Box and MacGregor 1974; Söderström, Gustavsson and Ljung 1976). What the form of such a plant lacks seems to be
//! physics of the plant: an oscillator under one wave had a drag of 62 nats (`tests/cases/run 9353`), an arm and an axis of which nothing is known had Stribeck friction.

use crate::estimate::fit::Fit;
use crate::estimate::likelihood::Data;
use crate::estimate::signals::{Signals, held};
use crate::init::least_squares::LeastSquares;
use crate::physics::{Kind, Place};

use super::decide::has_onset;
use super::holds;

/// Part of u's variance beside its own past that y's last change leaves, at most, where u answers it: where a law computes u it leaves less than a hundredth, where u moves by itself all.
const ANSWERS: f64 = 0.5;

/// Whether a kind beside a guessed plant may be what the law turned round lacks: physics of the plant that has been there all along. A valve that plays is proved by its cycle, and what
/// begins is not in a law.
pub fn may_be_the_law(kind: &Kind, fit: &Fit, data: &Data) -> bool {
    let is_open = fit.hypothesis.is_guessed && !data.has_healthy();
    let is_of_plant = kind.place == Place::Plant && !has_onset(kind);
    is_of_plant && is_open && !fit.hypothesis.model.has_law() && are_alone(&data.recordings)
}

/// Whether disturbances alone move these recordings: the reference rests, and u answers y.
pub fn are_alone(recordings: &[Signals]) -> bool {
    holds(recordings) && recordings.iter().all(u_answers)
}

/// Whether u's changes answer those of y in the same sample or the one before.
fn u_answers(signals: &Signals) -> bool {
    let (y, u) = (held(&signals.y), held(&signals.u));
    let (mut past, mut with_y) = (LeastSquares::new(2), LeastSquares::new(4));
    for (y, u) in y.windows(4).zip(u.windows(4)) {
        let ([y3, y2, y1, y0], [_, u2, u1, u0]) = (y, u) else { continue };
        let row = [u1 - u2, y2 - y3, y1 - y2, y0 - y1];
        past.add(u0 - u1, &row);
        with_y.add(u0 - u1, &row);
    }
    let left = past.solve().zip(with_y.solve());
    left.is_some_and(|(past, with_y)| with_y.left_over < ANSWERS * past.left_over)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLES: usize = 4_000;

    /// A lag of 20 samples with gain 2 behind u and a slow load, written out; u by a PI on the noisy y, or by steps of an operator every 200 samples.
    fn lag(is_closed: bool) -> Signals {
        let noise = |n: usize, of: f64| ((n * n) as f64 * of).fract() - 0.5;
        let (mut x, mut load, mut integral) = (0.0, 0.0, 0.0);
        let (mut y, mut u) = (Vec::new(), Vec::new());
        for n in 0..SAMPLES {
            let measured = x + 0.02 * noise(n, 0.618_033_988_7);
            integral -= 0.02 * measured;
            let by_hand = if (n / 200) % 2 == 0 { 0.3 } else { -0.2 };
            let drive: f64 = if is_closed { integral - 1.5 * measured } else { by_hand };
            y.push(measured);
            u.push(drive);
            load = 0.99 * load + 0.05 * noise(n, 0.414_213_562_4);
            x += (2.0 * (drive + load) - x) / 20.0;
        }
        Signals { sample_time_s: 1.0, r: vec![0.0; SAMPLES], y, u, ..Signals::default() }
    }

    #[test]
    fn u_answers_y_under_a_law_and_not_by_hand() {
        assert!(u_answers(&lag(true)));
        assert!(!u_answers(&lag(false)));
    }
}
