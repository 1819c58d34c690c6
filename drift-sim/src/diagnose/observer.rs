//! Keeps the prediction beside the recording where the plant itself would let it run away.
//!
//! A stable plant forgets its errors: there the prediction runs free, which shows slow effects best. A mass does not, or not
//! soon enough. A position carries every small force to ever larger distances, and a pitch would be judged at the wrong place.
//! A speed forgets, but dry friction makes events of its zeros: one stop or start told wrongly spoils what follows, so that a
//! free run fits in one narrow valley out of many (Stribeck friction of a generated motor: none of four starts reached the truth;
//! corrected, all did). There each prediction error corrects the state a little.

use crate::plant::{Output, Plant, zero_order_hold};

/// The observer's bandwidth times the sample time. Ten samples: near the best predictor of a quiet encoder, and short enough for
/// dry friction, whose slips run away from a prediction that is left alone for longer.
const BANDWIDTH: f64 = 0.1;
/// The same of a measured speed. Of 0.01, 0.03 and 0.1, all starts ended at the truth with the latter two, and 0.03 left less.
const SPEED_BANDWIDTH: f64 = 0.03;

/// What one unit of prediction error adds to each state.
pub fn gains(plant: &Plant, sample_time_s: f64) -> Vec<f64> {
    match plant {
        // Two equal poles at the bandwidth.
        Plant::Servo(p) if p.output == Output::Position => {
            vec![2.0 * BANDWIDTH, BANDWIDTH * BANDWIDTH / sample_time_s]
        }
        // The position behind a speed is the measured speed's own integral.
        Plant::Servo(_) => vec![sample_time_s, SPEED_BANDWIDTH],
        _ => Vec::new(),
    }
}

/// Whether the start is forgotten, so that it need not be fitted.
pub fn forgets(plant: &Plant) -> bool {
    matches!(plant, Plant::Servo(_))
}

/// The prediction error as it would be without the corrections, which for a linear plant add up to their own response:
/// what a missing drive is found from. Exact for the plant's linear part.
pub fn undone(plant: &Plant, error: &[f64], sample_time_s: f64) -> Vec<f64> {
    let gains = gains(plant, sample_time_s);
    let linear = plant.linear().ok().flatten();
    let held = linear.as_ref().and_then(|linear| zero_order_hold::discretise(linear, sample_time_s).ok());
    let (Some(linear), Some(held), false) = (linear, held, gains.is_empty()) else { return error.to_vec() };
    let n = linear.order();
    let mut state = vec![0.0; n];
    error
        .iter()
        .map(|e| {
            let open = e + state.iter().zip(&linear.c).map(|(x, c)| x * c).sum::<f64>();
            state = held
                .phi
                .chunks(n)
                .zip(&gains)
                .map(|(row, gain)| row.iter().zip(&state).map(|(a, x)| a * x).sum::<f64>() + gain * e)
                .collect();
            open
        })
        .collect()
}
