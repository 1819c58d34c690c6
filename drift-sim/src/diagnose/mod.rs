//! Finds, names, models and proves the physics that a simulation left out of a recorded loop.
pub mod fit;
pub mod model;
pub mod signals;
pub mod whiten;
pub mod candidates;
pub mod missing_drive;
pub mod screen;
pub mod spectrum;
pub mod observer;
