//! The configuration as C sees it: what is optional in `drift_core::Config` has a `has_` flag here (0 or 1).

use drift_core::{
    Baseline, Blanking, Channel, ChannelKind, Config, Cusum, Decision, Detectors, Ewma, Index, Memory,
    Number, OperatingPoint, Saturation, Shewhart, Sprt,
};

use crate::codes::{self, DRIFT_BAD_CONFIG, drift_index_t, drift_kind_t};

/// Channels of the largest kind.
pub const DRIFT_CHANNELS: usize = 3;
/// Bytes of a configuration.
pub const DRIFT_CONFIG_BYTES: usize = 492;
const _: () = assert!(size_of::<drift_config_t>() == DRIFT_CONFIG_BYTES);

/// The healthy relation value = b0 + b1*x.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct drift_baseline_t {
    /// Intercept.
    pub b0: f32,
    /// Slope.
    pub b1: f32,
    /// Standard deviation of a healthy residual; 0: the channel is only reported.
    pub sigma: f32,
    /// Independent windows that it was learnt from; 0: exactly known.
    pub windows: f32,
    /// Mean x of them.
    pub x_mean: f32,
    /// Their sum of squared deviations of x; 0: the slope is exactly known.
    pub x_ss: f32,
    /// Smallest x seen.
    pub x_min: f32,
    /// Largest x seen.
    pub x_max: f32,
}

/// Limits on one standardised residual.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct drift_shewhart_t {
    /// Below zero.
    pub lower: f32,
    /// Above zero.
    pub upper: f32,
}

/// Two-sided CUSUM.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct drift_cusum_t {
    /// Reference value, sigmas.
    pub k: f32,
    /// Decision interval, sigmas.
    pub h: f32,
    /// Start of both sums as a fraction of h.
    pub head_start: f32,
}

/// Sequential probability ratio test.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct drift_sprt_t {
    /// Added at every decision.
    pub constant: f32,
    /// Times z.
    pub linear: f32,
    /// Times z^2.
    pub quadratic: f32,
    /// Alarm at or above.
    pub upper: f32,
    /// Restart at or below.
    pub lower: f32,
}

/// Exponentially weighted moving average.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct drift_ewma_t {
    /// Weight of the newest residual.
    pub lambda: f32,
    /// Alarm above, sigmas.
    pub limit: f32,
}

/// What the windows before add to the relation.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct drift_memory_t {
    /// Windows that are remembered, 0 to 3.
    pub order: u32,
    /// Coefficients of x, the newest first.
    pub x: [f32; 3],
    /// Coefficients of the value.
    pub value: [f32; 3],
}

/// What a measured operating point adds to the relation; weight 0: nothing.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct drift_operating_point_t {
    /// Value units per unit of the point.
    pub weight: f32,
    /// The point's mean while it was learnt.
    pub mean: f32,
    /// How the point went with x.
    pub per_x: f32,
    /// Its sum of squared deviations that x does not explain; 0: the weight is exactly known.
    pub ss: f32,
    /// Smallest point seen.
    pub min: f32,
    /// Largest point seen.
    pub max: f32,
}

/// One residual channel.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct drift_channel_t {
    /// What is compared.
    pub kind: drift_kind_t,
    /// The error index of DRIFT_ENERGY_ERROR.
    pub index: drift_index_t,
    /// The healthy relation.
    pub baseline: drift_baseline_t,
    /// What the windows before add to it.
    pub memory: drift_memory_t,
    /// What a measured operating point adds to it, in the kinds of drift_full_at_init.
    pub operating_point: drift_operating_point_t,
    /// 0 or 1; here and below in the order of the core's table.
    pub has_cusum: u8,
    /// 0 or 1.
    pub has_ewma: u8,
    /// 0 or 1.
    pub has_sprt: u8,
    /// 0 or 1.
    pub has_shewhart: u8,
    /// Cumulative.
    pub cusum: drift_cusum_t,
    /// Weighted.
    pub ewma: drift_ewma_t,
    /// Sequential.
    pub sprt: drift_sprt_t,
    /// Instant.
    pub shewhart: drift_shewhart_t,
}

/// The configuration; `drift calibrate --c` writes it as an initialiser. A pair monitor uses the first channel.
/// Limits and steps of the i32 monitors are in counts.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct drift_config_t {
    /// Seconds per tick.
    pub sample_time_s: f32,
    /// Ticks per block.
    pub block_ticks: u32,
    /// Blocks per window, at most DRIFT_BLOCKS.
    pub window_blocks: u16,
    /// Blocks from one decision to the next.
    pub hop_blocks: u16,
    /// Fraction of valid ticks from which a block and a window count.
    pub min_valid: f32,
    /// y-units per count; 1 for float.
    pub y_unit: f32,
    /// u-units per count; 1 for float.
    pub u_unit: f32,
    /// 0 or 1.
    pub has_saturation: u8,
    /// u at or below is saturated.
    pub u_min: f32,
    /// u at or above is saturated.
    pub u_max: f32,
    /// 0 or 1.
    pub has_blanking: u8,
    /// A larger change of r per tick is a step.
    pub blank_reference_step: f32,
    /// Ticks left out after one.
    pub blank_ticks: u32,
    /// Decisions before a drift is confirmed.
    pub confirm_hops: u16,
    /// Log odds needed to call it either way.
    pub log_odds: f32,
    /// Smallest shift that counts as away, sigmas.
    pub smallest_shift: f32,
    /// The residual channels.
    pub channels: [drift_channel_t; DRIFT_CHANNELS],
}

/// The monitor's own number.
pub(crate) trait Sample: Number {
    /// A limit; refused where it is no such number.
    fn of_limit(limit: f32) -> Result<Self, i32>;
    /// A sample, if the monitor is one of floats.
    fn of_floats(sample: [f32; 3]) -> Option<[Self; 3]>;
    /// A sample, if the monitor is one of counts.
    fn of_counts(sample: [i32; 3]) -> Option<[Self; 3]>;
}

impl Sample for f32 {
    fn of_limit(limit: f32) -> Result<Self, i32> {
        Ok(limit)
    }
    fn of_floats(sample: [f32; 3]) -> Option<[Self; 3]> {
        Some(sample)
    }
    fn of_counts(_: [i32; 3]) -> Option<[Self; 3]> {
        None
    }
}

impl Sample for i32 {
    /// NaN, a fraction and what no i32 holds are no counts.
    fn of_limit(limit: f32) -> Result<Self, i32> {
        let count = limit as i32;
        if count as f32 == limit { Ok(count) } else { Err(DRIFT_BAD_CONFIG) }
    }
    fn of_floats(_: [f32; 3]) -> Option<[Self; 3]> {
        None
    }
    fn of_counts(sample: [i32; 3]) -> Option<[Self; 3]> {
        Some(sample)
    }
}

impl From<&Baseline> for drift_baseline_t {
    fn from(b: &Baseline) -> Self {
        Self {
            b0: b.b0,
            b1: b.b1,
            sigma: b.sigma,
            windows: b.windows,
            x_mean: b.x_mean,
            x_ss: b.x_ss,
            x_min: b.x_min,
            x_max: b.x_max,
        }
    }
}

impl From<&Memory> for drift_memory_t {
    fn from(m: &Memory) -> Self {
        Self { order: u32::from(m.order), x: m.x, value: m.value }
    }
}

impl From<&OperatingPoint> for drift_operating_point_t {
    fn from(p: &OperatingPoint) -> Self {
        Self { weight: p.weight, mean: p.mean, per_x: p.per_x, ss: p.ss, min: p.min, max: p.max }
    }
}

impl drift_config_t {
    pub(crate) fn convert<N: Sample, const C: usize>(&self) -> Result<Config<N, C>, i32> {
        const { assert!(C > 0 && C <= DRIFT_CHANNELS) };
        let channel = |i: usize| self.channels.get(i).map_or(Err(DRIFT_BAD_CONFIG), drift_channel_t::convert);
        let mut channels = [channel(0)?; C];
        for (i, place) in channels.iter_mut().enumerate() {
            *place = channel(i)?;
        }
        let mut config = Config::new(self.sample_time_s, self.block_ticks, self.window_blocks, channels)
            .with_hop(self.hop_blocks)
            .with_units(self.y_unit, self.u_unit)
            .with_decision(Decision {
                confirm_hops: self.confirm_hops,
                log_odds: self.log_odds,
                smallest_shift: self.smallest_shift,
            });
        config.min_valid = self.min_valid;
        if flag(self.has_saturation)? {
            let (u_min, u_max) = (N::of_limit(self.u_min)?, N::of_limit(self.u_max)?);
            config.saturation = Some(Saturation { u_min, u_max });
        }
        if flag(self.has_blanking)? {
            let reference_step = N::of_limit(self.blank_reference_step)?;
            config.blanking = Some(Blanking { reference_step, ticks: self.blank_ticks });
        }
        Ok(config)
    }
}

fn flag(flag: u8) -> Result<bool, i32> {
    match flag {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(DRIFT_BAD_CONFIG),
    }
}

impl drift_channel_t {
    fn convert(&self) -> Result<Channel, i32> {
        let b = &self.baseline;
        let (shewhart, cusum, sprt) = (&self.shewhart, &self.cusum, &self.sprt);
        let (m, p) = (&self.memory, &self.operating_point);
        Ok(Channel {
            kind: self.kind()?,
            memory: Memory { order: m.order.min(255) as u8, x: m.x, value: m.value },
            operating_point: OperatingPoint {
                weight: p.weight,
                mean: p.mean,
                per_x: p.per_x,
                ss: p.ss,
                min: p.min,
                max: p.max,
            },
            baseline: Baseline {
                b0: b.b0,
                b1: b.b1,
                sigma: b.sigma,
                windows: b.windows,
                x_mean: b.x_mean,
                x_ss: b.x_ss,
                x_min: b.x_min,
                x_max: b.x_max,
            },
            detectors: Detectors {
                shewhart: flag(self.has_shewhart)?
                    .then_some(Shewhart { lower: shewhart.lower, upper: shewhart.upper }),
                cusum: flag(self.has_cusum)?.then_some(Cusum {
                    k: cusum.k,
                    h: cusum.h,
                    head_start: cusum.head_start,
                }),
                ewma: flag(self.has_ewma)?
                    .then_some(Ewma { lambda: self.ewma.lambda, limit: self.ewma.limit }),
                sprt: flag(self.has_sprt)?.then_some(Sprt {
                    constant: sprt.constant,
                    linear: sprt.linear,
                    quadratic: sprt.quadratic,
                    upper: sprt.upper,
                    lower: sprt.lower,
                }),
            },
        })
    }

    pub(crate) fn kind(&self) -> Result<ChannelKind, i32> {
        let index = match self.index {
            codes::DRIFT_IAE => Index::Iae,
            codes::DRIFT_ISE => Index::Ise,
            codes::DRIFT_ITAE => Index::Itae,
            codes::DRIFT_ITSE => Index::Itse,
            _ => return Err(DRIFT_BAD_CONFIG),
        };
        ChannelKind::numbered(self.kind).map(|kind| kind.with_index(index)).ok_or(DRIFT_BAD_CONFIG)
    }
}
