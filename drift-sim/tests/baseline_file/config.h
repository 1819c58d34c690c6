/* The healthy loop's baseline, from `drift calibrate`. C99, C++11. */
#ifndef DRIFT_BASELINE_H
#define DRIFT_BASELINE_H
#include "drift.h"

static const drift_config_t drift_config = {
    /* sample_time_s */ 0.001f,
    /* block_ticks */ 250u,
    /* window_blocks */ 12u,
    /* hop_blocks */ 6u,
    /* min_valid */ 0.5f,
    /* y_unit */ 1.0f,
    /* u_unit */ 1.0f,
    /* has_saturation */ 1,
    /* u_min */ -10.0f,
    /* u_max */ 10000.0f,
    /* has_blanking */ 1,
    /* blank_reference_step */ 0.05f,
    /* blank_ticks */ 40u,
    /* confirm_hops */ 20u,
    /* log_odds */ 4.6f,
    /* smallest_shift */ 1.0f,
    /* channels */ {
        {
            /* kind */ DRIFT_ENERGY_ERROR,
            /* index */ DRIFT_ITAE,
            /* b0, b1, sigma, windows, x_mean, x_ss, x_min, x_max */ { 0.175f, 1.26e-5f, 0.3f, 371.25f, 14000.0f, 34000000000.0f, 512.5f, 40000.0f },
            /* memory: order, x, value */ { 0u, { 0.0f, 0.0f, 0.0f }, { 0.0f, 0.0f, 0.0f } },
            /* operating_point: weight, mean, per_x, ss, min, max */ { 0.0f, 0.0f, 0.0f, 0.0f, -3.4028235e38f, 3.4028235e38f },
            /* has_cusum */ 1,
            /* has_ewma */ 1,
            /* has_sprt */ 0,
            /* has_shewhart */ 1,
            /* cusum: k, h, head_start */ { 0.5f, 8.1f, 0.0f },
            /* ewma: lambda, limit */ { 0.1f, 0.645f },
            /* sprt: constant, linear, quadratic, upper, lower */ { 0.0f, 0.0f, 0.0f, 0.0f, 0.0f },
            /* shewhart: lower, upper */ { -3.5f, 4.25f },
        },
        {
            /* kind */ DRIFT_MOTION_EFFORT,
            /* index */ DRIFT_IAE,
            /* b0, b1, sigma, windows, x_mean, x_ss, x_min, x_max */ { 0.175f, 1.26e-5f, 0.3f, 371.25f, 14000.0f, 34000000000.0f, 512.5f, 40000.0f },
            /* memory: order, x, value */ { 0u, { 0.0f, 0.0f, 0.0f }, { 0.0f, 0.0f, 0.0f } },
            /* operating_point: weight, mean, per_x, ss, min, max */ { 0.0154f, 75.5f, -2.0f, 1900.0f, 60.0f, 90.25f },
            /* has_cusum */ 0,
            /* has_ewma */ 0,
            /* has_sprt */ 1,
            /* has_shewhart */ 0,
            /* cusum: k, h, head_start */ { 0.0f, 0.0f, 0.0f },
            /* ewma: lambda, limit */ { 0.0f, 0.0f },
            /* sprt: constant, linear, quadratic, upper, lower */ { -0.5f, 1.0f, 0.0f, 7.3f, -4.6f },
            /* shewhart: lower, upper */ { 0.0f, 0.0f },
        },
        {
            /* kind */ DRIFT_ACTIVITY,
            /* index */ DRIFT_IAE,
            /* b0, b1, sigma, windows, x_mean, x_ss, x_min, x_max */ { 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, -3.4028235e38f, 3.4028235e38f },
            /* memory: order, x, value */ { 0u, { 0.0f, 0.0f, 0.0f }, { 0.0f, 0.0f, 0.0f } },
            /* operating_point: weight, mean, per_x, ss, min, max */ { 0.0f, 0.0f, 0.0f, 0.0f, -3.4028235e38f, 3.4028235e38f },
            /* has_cusum */ 0,
            /* has_ewma */ 0,
            /* has_sprt */ 0,
            /* has_shewhart */ 0,
            /* cusum: k, h, head_start */ { 0.0f, 0.0f, 0.0f },
            /* ewma: lambda, limit */ { 0.0f, 0.0f },
            /* sprt: constant, linear, quadratic, upper, lower */ { 0.0f, 0.0f, 0.0f, 0.0f, 0.0f },
            /* shewhart: lower, upper */ { 0.0f, 0.0f },
        },
    }
};

/* The operating point of a tick, for drift_operating_point(), from
 *   x1: t_outdoor
 *   x2: fan speed
 */
#define DRIFT_OPERATING_POINT_OF(x1, x2) (1.0f * (x1) + 80.5f * (x2))

#endif
