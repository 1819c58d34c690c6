//! Typical sizes of a loop's signals, from which the search for physics takes its first steps.

/// Sizes in the loop's own units; those of spread are > 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Scales {
    /// Standard deviation of u.
    pub u: f64,
    /// Root mean square of u.
    pub u_size: f64,
    /// From the least to the greatest u.
    pub u_range: f64,
    /// Least u.
    pub u_lowest: f64,
    /// Greatest u.
    pub u_highest: f64,
    /// Greatest size of u.
    pub u_most: f64,
    /// Sizes of u that 0.05 to 99 % of the samples exceed.
    pub u_sizes: Vec<f64>,
    /// The same of u between its ends alone, from the upper one down: levels that a limit may cut it at.
    pub u_upper: Vec<f64>,
    /// The same from its lower end up.
    pub u_lower: Vec<f64>,
    /// The change of u per second that one sample of a hundred exceeds.
    pub u_slew: f64,
    /// Standard deviation of y.
    pub y: f64,
    /// Mean of y.
    pub y_mean: f64,
    /// Mean of u.
    pub u_mean: f64,
    /// Standard deviation of the sensor's fast noise, at most.
    pub noise: f64,
    /// The step to whose multiples y is rounded; none where it is not.
    pub y_step: Option<f64>,
    /// Whether that step is larger than the noise.
    pub is_coarse: bool,
    /// Standard deviation of the speed: of dy/dt, or of y where y is a speed.
    pub speed: f64,
    /// Way from one end of the motion to the other: of y, or of its integral where y is a speed.
    pub position: f64,
    /// Standard deviation of the drive.
    pub drive: f64,
    /// Mean and standard deviation of each of the loop's measured inputs.
    pub inputs: Vec<(f64, f64)>,
    /// Sample time, in seconds.
    pub sample_time_s: f64,
    /// Length of the recording, in seconds.
    pub duration_s: f64,
}

impl Default for Scales {
    /// All signals of size 1, 10 s at 1 ms.
    fn default() -> Self {
        Self {
            u: 1.0,
            u_size: 1.0,
            u_range: 4.0,
            u_lowest: -2.0,
            u_highest: 2.0,
            u_most: 2.0,
            u_sizes: vec![1.9, 1.5, 1.0],
            u_upper: vec![1.5],
            u_lower: vec![-1.5],
            u_slew: 10.0,
            y: 1.0,
            y_mean: 0.0,
            u_mean: 0.0,
            noise: 0.01,
            y_step: None,
            is_coarse: false,
            speed: 1.0,
            position: 4.0,
            drive: 1.0,
            inputs: Vec::new(),
            sample_time_s: 0.001,
            duration_s: 10.0,
        }
    }
}
