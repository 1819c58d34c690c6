//! The missing drive: the force, heat or flow that the recorded motion needed beyond what the model applied.

/// The drive that the model lacks, in the drive's unit, added to the drive.
#[derive(Debug, Clone)]
pub struct MissingDrive {
    /// At each sample.
    pub value: Vec<f64>,
    /// Its standard deviation once the filter has settled.
    pub deviation: f64,
}
