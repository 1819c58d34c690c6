/* As `drift calibrate --c` writes it. */
#ifndef DRIFT_BASELINE_H
#define DRIFT_BASELINE_H
#include "drift.h"

static const drift_config_t drift_config = {
    /* sample_time_s */ 0.001f,
    /* block_ticks */ 50u,
    /* window_blocks */ 8u,
    /* hop_blocks */ 8u,
    /* min_valid */ 0.5f,
    /* y_unit */ 1.0f,
    /* u_unit */ 1.0f,
    /* has_saturation */ 0,
    /* u_min */ 0.0f,
    /* u_max */ 0.0f,
    /* has_blanking */ 0,
    /* blank_reference_step */ 0.0f,
    /* blank_ticks */ 0u,
    /* confirm_hops */ 10u,
    /* log_odds */ 4.6f,
    /* smallest_shift */ 1.0f,
    /* channels */ {
        {
            /* kind */ DRIFT_ENERGY_ERROR,
            /* index */ DRIFT_IAE,
            /* b0, b1, sigma, windows, x_mean, x_ss, x_min, x_max */
            { 0.014f, 0.0478f, 0.008f, 47.0f, 0.4255f, 0.1284f, -3.4028235e38f, 3.4028235e38f },
            /* memory: order, x, value */ { 0u, { 0.0f, 0.0f, 0.0f }, { 0.0f, 0.0f, 0.0f } },
            /* operating_point: weight, mean, per_x, ss, min, max */ { 0.0f, 0.0f, 0.0f, 0.0f, -3.4028235e38f, 3.4028235e38f },
            /* has_cusum */ 1,
            /* has_ewma */ 0,
            /* has_sprt */ 0,
            /* has_shewhart */ 0,
            /* cusum: k, h, head_start */ { 0.5f, 5.07f, 0.0f },
            /* ewma: lambda, limit */ { 0.0f, 0.0f },
            /* sprt: constant, linear, quadratic, upper, lower */ { 0.0f, 0.0f, 0.0f, 0.0f, 0.0f },
            /* shewhart: lower, upper */ { 0.0f, 0.0f },
        },
        { 0u, 0u, { 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f }, { 0u, { 0.0f, 0.0f, 0.0f }, { 0.0f, 0.0f, 0.0f } },
          { 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f },
          0, 0, 0, 0, { 0.0f, 0.0f, 0.0f }, { 0.0f, 0.0f }, { 0.0f, 0.0f, 0.0f, 0.0f, 0.0f }, { 0.0f, 0.0f } },
        { 0u, 0u, { 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f }, { 0u, { 0.0f, 0.0f, 0.0f }, { 0.0f, 0.0f, 0.0f } },
          { 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f },
          0, 0, 0, 0, { 0.0f, 0.0f, 0.0f }, { 0.0f, 0.0f }, { 0.0f, 0.0f, 0.0f, 0.0f, 0.0f }, { 0.0f, 0.0f } },
    }
};

#endif
