//! What a recording shows of the missing physics: the numbers from which terms guess their starting values.

/// Measured features of a recording. Zero where nothing was measured: starting values then fall back on the
/// scales. "Missing drive" is the drive that the recorded motion needed less the one that the model applied.
#[derive(Debug, Clone, PartialEq)]
pub struct Signature {
    /// Half of the missing drive's jump where the speed changes sign.
    pub jump: f64,
    /// The same, in forward motion alone.
    pub jump_forward: f64,
    /// The same, in backward motion alone.
    pub jump_backward: f64,
    /// Slope of the missing drive against speed, forward.
    pub slope_forward: f64,
    /// Slope of the missing drive against speed, backward.
    pub slope_backward: f64,
    /// Slope of the missing drive against position or y.
    pub slope_position: f64,
    /// Extra missing drive just after rest, above that of steady motion.
    pub breakaway: f64,
    /// Width, in u, of the loop that u draws against what the plant received.
    pub hysteresis: f64,
    /// Half width, in u, of the range around zero that does nothing.
    pub dead_band: f64,
    /// Lowest and highest u that seem to have reached the plant, where there are plateaus.
    pub plateaus: Option<(f64, f64)>,
    /// Steepest change of what the plant received, per second.
    pub slew: f64,
    /// Lag or delay by which the response is late, in seconds.
    pub late_s: f64,
    /// Frequency of the strongest peak of the missing drive over time, in Hz.
    pub peak_hz: f64,
    /// Amplitude of that peak, in the drive's unit.
    pub peak_amplitude: f64,
    /// Length of the strongest period of the missing drive over position.
    pub pitch: f64,
    /// Shift of the missing drive's mean after the onset.
    pub drive_shift: f64,
    /// Slope of the missing drive over time after the onset, per second.
    pub drive_rate: f64,
    /// Shift of y's mean, as the model sees it, after the onset.
    pub y_shift: f64,
    /// Slope of y's error, as the model sees it, over time after the onset, per second.
    pub y_rate: f64,
    /// Smallest step between different values of y.
    pub y_quantum: f64,
    /// Noise of y after the onset over noise before.
    pub noise_ratio: f64,
    /// Effect of u on the plant after the onset over that before; also of the stated law on u.
    pub gain_ratio: f64,
    /// Apparent inertia over the nominal one.
    pub inertia_ratio: f64,
    /// Apparent viscous friction over the nominal one.
    pub viscous_ratio: f64,
    /// Standard deviation of y.
    pub y_scale: f64,
    /// Standard deviation of u.
    pub u_scale: f64,
    /// Standard deviation of the drive.
    pub drive_scale: f64,
    /// Standard deviation of the speed.
    pub speed_scale: f64,
    /// Sample time, in seconds.
    pub sample_time_s: f64,
    /// Length of the recording, in seconds.
    pub duration_s: f64,
}

impl Default for Signature {
    /// Nothing seen; all scales 1, sample time 1 ms, 10 s long.
    fn default() -> Self {
        Self {
            jump: 0.0,
            jump_forward: 0.0,
            jump_backward: 0.0,
            slope_forward: 0.0,
            slope_backward: 0.0,
            slope_position: 0.0,
            breakaway: 0.0,
            hysteresis: 0.0,
            dead_band: 0.0,
            plateaus: None,
            slew: 0.0,
            late_s: 0.0,
            peak_hz: 0.0,
            peak_amplitude: 0.0,
            pitch: 0.0,
            drive_shift: 0.0,
            drive_rate: 0.0,
            y_shift: 0.0,
            y_rate: 0.0,
            y_quantum: 0.0,
            noise_ratio: 0.0,
            gain_ratio: 0.0,
            inertia_ratio: 0.0,
            viscous_ratio: 0.0,
            y_scale: 1.0,
            u_scale: 1.0,
            drive_scale: 1.0,
            speed_scale: 1.0,
            sample_time_s: 0.001,
            duration_s: 10.0,
        }
    }
}

impl Signature {
    /// A measured size where there is one, else fractions of a scale: starting values for a positive parameter.
    pub(super) fn or_fractions(measured: f64, scale: f64) -> Vec<f64> {
        if measured.is_finite() && measured.abs() > 0.0 {
            vec![measured.abs()]
        } else {
            [0.1, 0.3, 1.0].iter().map(|fraction| fraction * scale).collect()
        }
    }

    /// A measured value where there is one, else both signs of a part of a scale.
    pub(super) fn or_both_signs(measured: f64, scale: f64) -> Vec<f64> {
        if measured.is_finite() && measured != 0.0 { vec![measured] } else { vec![0.3 * scale, -0.3 * scale] }
    }

    /// A measured ratio where there is one, else `guesses`.
    pub(super) fn or_ratios(measured: f64, guesses: &[f64]) -> Vec<f64> {
        if measured.is_finite() && measured > 0.0 { vec![measured] } else { guesses.to_vec() }
    }
}

/// One set of starting values for each value of a kind's only parameter.
pub(super) fn singles(values: Vec<f64>) -> Vec<Vec<f64>> {
    values.into_iter().map(|value| vec![value]).collect()
}
