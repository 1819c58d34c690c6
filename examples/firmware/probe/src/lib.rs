//! What every probe image holds: the ruler (an empty call), the things that the monitor's cost is held against,
//! and the run that prints the counts.
#![no_std]

pub mod rivals;
pub mod run;
