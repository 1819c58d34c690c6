//! Recordings to try the page on: a flow loop over changing set-points, whose actuator loses some of its gain on the way.

use drift_sim::control_loop::Loop;
use drift_sim::physics::Term;
use drift_sim::recording::{csv_bytes, uniform_times_s};
use drift_sim::reference::Reference;
use drift_sim::simulate::{Start, simulate};
use drift_sim::{Error, Result};

const FLOW: &str = include_str!("../../../../examples/loops/flow.toml");
/// The share of the actuator's gain that is lost.
pub const LOSS: f64 = 0.1;
const ONSET_S: f64 = 1000.0;
const DURATION_S: f64 = 2000.0;
const MEAN: f64 = 50.0;
const HOLD_S: f64 = 40.0;

/// A recording as CSV; all noise and the set-points follow from the seed.
///
/// # Errors
/// It can't be simulated.
pub fn recording(loss: f64, seed: u64) -> Result<String> {
    // Its valve sticks, which is another example.
    let mut flow = Loop { physics: Vec::new(), ..Loop::parse(FLOW, "flow.toml")? };
    if loss > 0.0 {
        flow = flow.with(Term::new("gain_loss", &[("loss", loss)])?.from_s(ONSET_S));
    }
    let ticks = (DURATION_S / flow.sample_time_s) as usize;
    let r = Reference::random(MEAN, 5.0, (HOLD_S / flow.sample_time_s) as u64, seed).take_samples(ticks);
    let first = r.first().copied().unwrap_or(MEAN);
    let holding = (first - flow.plant.drive_offset()) / flow.plant.drive_gain();
    let run = simulate(&flow, &r, &[], seed, Some(&Start::held(first, holding)))?;
    let t = uniform_times_s(0.0, flow.sample_time_s, r.len());
    let csv = csv_bytes(&[("t", &t), ("SP", &r), ("PV", &run.y), ("OP", &run.u)])?;
    String::from_utf8(csv).map_err(|_| Error::new("the example is not text"))
}
