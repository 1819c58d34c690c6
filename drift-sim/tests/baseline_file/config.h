/* The healthy loop's baseline, from `drift calibrate`. C99. */
#ifndef DRIFT_BASELINE_H
#define DRIFT_BASELINE_H
#include <stdbool.h>
#include <stdint.h>

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

static const drift_config_t drift_config = {
    .sample_time_s = 0.001f,
    .block_ticks = 250u,
    .window_blocks = 12u,
    .hop_blocks = 6u,
    .min_valid = 0.5f,
    .y_unit = 1.0f,
    .u_unit = 1.0f,
    .has_saturation = true,
    .u_min = -10.0f,
    .u_max = 10000.0f,
    .has_blanking = true,
    .blank_reference_step = 0.05f,
    .blank_ticks = 40u,
    .confirm_hops = 20u,
    .log_odds = 4.6f,
    .smallest_shift = 1.0f,
    .channels = {
        {
            .kind = DRIFT_ENERGY_ERROR,
            .index = DRIFT_ITAE,
            .baseline = {
                .b0 = 0.175f, .b1 = 1.26e-5f,
                .sigma = 0.3f, .windows = 371.25f,
                .x_mean = 14000.0f, .x_ss = 34000000000.0f,
                .x_min = 512.5f, .x_max = 40000.0f,
            },
            .has_shewhart = true,
            .has_cusum = true,
            .has_sprt = false,
            .shewhart = { .lower = -3.5f, .upper = 4.25f },
            .cusum = { .k = 0.5f, .h = 8.1f, .head_start = 0.0f },
        },
        {
            .kind = DRIFT_MOTION_EFFORT,
            .index = DRIFT_IAE,
            .baseline = {
                .b0 = 0.175f, .b1 = 1.26e-5f,
                .sigma = 0.3f, .windows = 371.25f,
                .x_mean = 14000.0f, .x_ss = 34000000000.0f,
                .x_min = 512.5f, .x_max = 40000.0f,
            },
            .has_shewhart = false,
            .has_cusum = false,
            .has_sprt = true,
            .sprt = { .constant = -0.5f, .linear = 1.0f,
                .quadratic = 0.0f, .upper = 7.3f, .lower = -4.6f },
        },
        {
            .kind = DRIFT_ACTIVITY,
            .index = DRIFT_IAE,
            .baseline = {
                .b0 = 0.0f, .b1 = 0.0f,
                .sigma = 0.0f, .windows = 0.0f,
                .x_mean = 0.0f, .x_ss = 0.0f,
                .x_min = -3.4028235e38f, .x_max = 3.4028235e38f,
            },
            .has_shewhart = false,
            .has_cusum = false,
            .has_sprt = false,
        },
    },
};

#endif
