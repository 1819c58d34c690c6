/// The healthy loop's baseline, from `drift calibrate`.
pub const CONFIG: drift_core::Config<f32, 3> = drift_core::Config {
    sample_time_s: 0.001,
    block_ticks: 250,
    window_blocks: 12,
    hop_blocks: 6,
    min_valid: 0.5,
    y_unit: 1.0,
    u_unit: 1.0,
    saturation: Some(drift_core::Saturation { u_min: -10.0, u_max: 10000.0 }),
    blanking: Some(drift_core::Blanking { reference_step: 0.05, ticks: 40 }),
    decision: drift_core::Decision { confirm_hops: 20, log_odds: 4.6, smallest_shift: 1.0 },
    channels: [
        drift_core::Channel {
            kind: drift_core::ChannelKind::EnergyError(drift_core::Index::Itae),
            baseline: drift_core::Baseline {
                b0: 0.175,
                b1: 1.26e-5,
                sigma: 0.3,
                windows: 371.25,
                x_mean: 14000.0,
                x_ss: 34000000000.0,
                x_min: 512.5,
                x_max: 40000.0,
            },
            memory: drift_core::Memory::NONE,
            operating_point: drift_core::OperatingPoint::NONE,
            detectors: drift_core::Detectors {
                cusum: Some(drift_core::Cusum { k: 0.5, h: 8.1, head_start: 0.0 }),
                ewma: Some(drift_core::Ewma { lambda: 0.1, limit: 0.645 }),
                shewhart: Some(drift_core::Shewhart { lower: -3.5, upper: 4.25 }),
                ..drift_core::Detectors::NONE
            },
        },
        drift_core::Channel {
            kind: drift_core::ChannelKind::MotionEffort,
            baseline: drift_core::Baseline {
                b0: 0.175,
                b1: 1.26e-5,
                sigma: 0.3,
                windows: 371.25,
                x_mean: 14000.0,
                x_ss: 34000000000.0,
                x_min: 512.5,
                x_max: 40000.0,
            },
            memory: drift_core::Memory::NONE,
            operating_point: drift_core::OperatingPoint {
                weight: 0.0154,
                mean: 75.5,
                per_x: -2.0,
                ss: 1900.0,
                min: 60.0,
                max: 90.25,
            },
            detectors: drift_core::Detectors {
                sprt: Some(drift_core::Sprt { constant: -0.5, linear: 1.0, quadratic: 0.0, upper: 7.3, lower: -4.6 }),
                ..drift_core::Detectors::NONE
            },
        },
        drift_core::Channel::unlearned(drift_core::ChannelKind::Activity),
    ],
};

/// The operating point of a tick, for `tick_at` of a monitor with `drift_core::FullAt`, from
/// * x1: t_outdoor
/// * x2: fan speed
pub const fn operating_point(x1: f32, x2: f32) -> f32 {
    1.0 * x1 + 80.5 * x2
}
