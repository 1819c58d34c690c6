//! Finds, names, models and proves the physics that a simulation left out of a recorded loop.
pub mod fit;
pub mod model;
pub mod signals;
pub mod whiten;
