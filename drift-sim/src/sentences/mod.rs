//! What results say to people. Page, terminal and JSON take their sentences and numbers from here, so that one result says
//! the same everywhere.
//!
//! [`Answer`] is what the first screen shows: a status, a sentence, three numbers. [`Clock`] tells times as the recording
//! does. `quantity` rounds numbers to what their interval carries, and [`typed`] writes those that messages quote.

mod answer;
mod calibration;
mod clock;
mod diagnosis;
mod monitoring;
mod planning;
mod quantity;
mod typed;

pub use answer::{Answer, KeyNumber, Status};
pub use calibration::{asks_for_action, calibration, lateness};
pub use clock::Clock;
pub use diagnosis::{diagnosis, of_term, parameter, says, sizes};
pub use monitoring::{monitoring, moved_name, pinned, side_name};
pub use planning::{chance, planning};
pub(crate) use quantity::with_carets;
pub use quantity::{
    ends, fit, line, measured, number_name, percent, plain, rate, rounded, sigmas, simple_unit, value,
    with_unit,
};
pub use typed::{typed, typed_to};
