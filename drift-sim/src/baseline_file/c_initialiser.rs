//! The configuration as a C99 header. The structures mirror `drift_core::Config<f32, 3>`; what is optional there has
//! a `has_` flag here. They are part of the generated header unless `DRIFT_H` says that they are known already.

use std::fmt::Write as _;

use drift_core::{ChannelKind, Index};

use super::{BaselineFile, ChannelEntry};

const TYPES: &str = "\
#ifndef DRIFT_H
typedef enum { DRIFT_ENERGY_ERROR, DRIFT_EFFORT, DRIFT_MOTION_EFFORT, DRIFT_ACTIVITY } drift_kind_t;
typedef enum { DRIFT_IAE, DRIFT_ISE, DRIFT_ITAE, DRIFT_ITSE } drift_index_t;
typedef struct {
    float b0, b1, sigma;       /* value = b0 + b1*x, residual's standard deviation; sigma 0: not judged */
    float windows;             /* independent windows that it was learnt from */
    float x_mean, x_ss;        /* mean and sum of squared deviations of x */
    float x_min, x_max;        /* x seen in calibration */
} drift_baseline_t;
typedef struct { float lower, upper; } drift_shewhart_t;
typedef struct { float k, h, head_start; } drift_cusum_t;
typedef struct { float constant, linear, quadratic, upper, lower; } drift_sprt_t;
typedef struct {
    drift_kind_t kind;
    drift_index_t index;       /* of DRIFT_ENERGY_ERROR */
    drift_baseline_t baseline;
    bool has_shewhart, has_cusum, has_sprt;
    drift_shewhart_t shewhart;
    drift_cusum_t cusum;
    drift_sprt_t sprt;
} drift_channel_t;
typedef struct {
    float sample_time_s;
    uint32_t block_ticks;      /* ticks per block */
    uint16_t window_blocks;    /* blocks per window */
    uint16_t hop_blocks;       /* blocks from one decision to the next */
    float min_valid;           /* fraction of valid ticks from which a block and a window count */
    float y_unit, u_unit;      /* units per count */
    bool has_saturation;
    float u_min, u_max;        /* u at or beyond these is saturated */
    bool has_blanking;
    float blank_reference_step; /* a larger change of r per tick is a step */
    uint32_t blank_ticks;      /* ticks left out after one */
    uint16_t confirm_hops;     /* decisions before a drift is confirmed */
    float log_odds, smallest_shift;
    drift_channel_t channels[3];
} drift_config_t;
#endif
";

pub(super) fn write(file: &BaselineFile) -> String {
    let mut text = String::from(
        "/* The healthy loop's baseline, from `drift calibrate`. C99. */
#ifndef DRIFT_BASELINE_H
#define DRIFT_BASELINE_H
#include <stdbool.h>
#include <stdint.h>

",
    );
    text.push_str(TYPES);
    // Writing into a String can't fail.
    let _ = config(&mut text, file);
    text.push_str("\n#endif\n");
    text
}

fn config(text: &mut String, file: &BaselineFile) -> std::fmt::Result {
    let (timing, samples, decision) = (&file.timing, &file.samples, &file.decision);
    writeln!(text, "\nstatic const drift_config_t drift_config = {{")?;
    writeln!(text, "    .sample_time_s = {},", float(timing.sample_time_s))?;
    writeln!(text, "    .block_ticks = {}u,", timing.block_ticks)?;
    writeln!(text, "    .window_blocks = {}u,", timing.window_blocks)?;
    writeln!(text, "    .hop_blocks = {}u,", timing.hop_blocks)?;
    writeln!(text, "    .min_valid = {},", float(samples.min_valid))?;
    writeln!(text, "    .y_unit = 1.0f,\n    .u_unit = 1.0f,")?;
    writeln!(text, "    .has_saturation = {},", samples.saturation.is_some())?;
    if let Some(s) = &samples.saturation {
        writeln!(text, "    .u_min = {},\n    .u_max = {},", float(s.u_min), float(s.u_max))?;
    }
    writeln!(text, "    .has_blanking = {},", samples.blanking.is_some())?;
    if let Some(b) = &samples.blanking {
        writeln!(text, "    .blank_reference_step = {},", float(b.reference_step))?;
        writeln!(text, "    .blank_ticks = {}u,", b.ticks)?;
    }
    writeln!(text, "    .confirm_hops = {}u,", decision.confirm_hops)?;
    writeln!(text, "    .log_odds = {},", float(decision.log_odds))?;
    writeln!(text, "    .smallest_shift = {},", float(decision.smallest_shift))?;
    writeln!(text, "    .channels = {{")?;
    file.channels.iter().try_for_each(|entry| channel(text, entry))?;
    writeln!(text, "    }},\n}};")
}

fn channel(text: &mut String, entry: &ChannelEntry) -> std::fmt::Result {
    let (b, d) = (&entry.channel.baseline, &entry.channel.detectors);
    let (kind, index) = names(entry.channel.kind);
    writeln!(text, "        {{")?;
    writeln!(text, "            .kind = {kind},\n            .index = {index},")?;
    writeln!(text, "            .baseline = {{")?;
    writeln!(text, "                .b0 = {}, .b1 = {},", float(b.b0), float(b.b1))?;
    writeln!(text, "                .sigma = {}, .windows = {},", float(b.sigma), float(b.windows))?;
    writeln!(text, "                .x_mean = {}, .x_ss = {},", float(b.x_mean), float(b.x_ss))?;
    writeln!(text, "                .x_min = {}, .x_max = {},", float(b.x_min), float(b.x_max))?;
    writeln!(text, "            }},")?;
    let has = [("shewhart", d.shewhart.is_some()), ("cusum", d.cusum.is_some()), ("sprt", d.sprt.is_some())];
    has.iter().try_for_each(|(name, has)| writeln!(text, "            .has_{name} = {has},"))?;
    if let Some(d) = &d.shewhart {
        writeln!(
            text,
            "            .shewhart = {{ .lower = {}, .upper = {} }},",
            float(d.lower),
            float(d.upper)
        )?;
    }
    if let Some(d) = &d.cusum {
        let (k, h, head_start) = (float(d.k), float(d.h), float(d.head_start));
        writeln!(text, "            .cusum = {{ .k = {k}, .h = {h}, .head_start = {head_start} }},")?;
    }
    if let Some(d) = &d.sprt {
        let (constant, linear, quadratic) = (float(d.constant), float(d.linear), float(d.quadratic));
        writeln!(text, "            .sprt = {{ .constant = {constant}, .linear = {linear},")?;
        writeln!(
            text,
            "                .quadratic = {quadratic}, .upper = {}, .lower = {} }},",
            float(d.upper),
            float(d.lower)
        )?;
    }
    writeln!(text, "        }},")
}

fn names(kind: ChannelKind) -> (&'static str, &'static str) {
    match kind {
        ChannelKind::EnergyError(Index::Iae) => ("DRIFT_ENERGY_ERROR", "DRIFT_IAE"),
        ChannelKind::EnergyError(Index::Ise) => ("DRIFT_ENERGY_ERROR", "DRIFT_ISE"),
        ChannelKind::EnergyError(Index::Itae) => ("DRIFT_ENERGY_ERROR", "DRIFT_ITAE"),
        ChannelKind::EnergyError(Index::Itse) => ("DRIFT_ENERGY_ERROR", "DRIFT_ITSE"),
        ChannelKind::Effort => ("DRIFT_EFFORT", "DRIFT_IAE"),
        ChannelKind::MotionEffort => ("DRIFT_MOTION_EFFORT", "DRIFT_IAE"),
        ChannelKind::Activity => ("DRIFT_ACTIVITY", "DRIFT_IAE"),
    }
}

/// The fewest digits that name the same `float`.
fn float(x: f32) -> String {
    format!("{x:?}f")
}
