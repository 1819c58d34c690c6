/* As `drift calibrate --c` writes it. */
#ifndef DRIFT_BASELINE_H
#define DRIFT_BASELINE_H

static const drift_config_t drift_config = {
    .sample_time_s = 0.001f,
    .block_ticks = 50u,
    .window_blocks = 8u,
    .hop_blocks = 8u,
    .min_valid = 0.5f,
    .y_unit = 1.0f,
    .u_unit = 1.0f,
    .has_saturation = false,
    .has_blanking = false,
    .confirm_hops = 10u,
    .log_odds = 4.6f,
    .smallest_shift = 1.0f,
    .channels = {
        {
            .kind = DRIFT_ENERGY_ERROR,
            .index = DRIFT_IAE,
            .baseline = {
                .b0 = 0.014f, .b1 = 0.0478f,
                .sigma = 0.008f, .windows = 47.0f,
                .x_mean = 0.4255f, .x_ss = 0.1284f,
                .x_min = -3.4028235e38f, .x_max = 3.4028235e38f,
            },
            .has_shewhart = false,
            .has_cusum = true,
            .has_sprt = false,
            .cusum = { .k = 0.5f, .h = 5.07f, .head_start = 0.0f },
        },
    },
};

#endif
