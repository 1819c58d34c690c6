//! Keeps the prediction beside the recording where the plant itself would let it run away.
//!
//! A stable plant forgets its errors: there the prediction runs free, which shows slow effects best. A mass does not, or not
//! soon enough. A position carries every small force to ever larger distances, and a pitch would be judged at the wrong place.
//! A speed forgets, but dry friction makes events of its zeros: one stop or start told wrongly spoils what follows, so that a
//! free run fits in one narrow valley out of many (Stribeck friction of a generated motor: none of four starts reached the truth;
//! corrected, all did). There each prediction error corrects the state a little.

use crate::plant::{Output, Plant};

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
