/* The monitors of the cost table in C: what a firmware would hold, and call from its control interrupt. The configurations are those
 * of `scenario` in Rust. */
#include <float.h>
#include <stddef.h>

#include "monitors.h"

#define LEARNT(b0, b1, sigma, x_mean, x_ss) {b0, b1, sigma, 200.0f, x_mean, x_ss, -FLT_MAX, FLT_MAX}
#define KNOWN(b0, b1, sigma) {b0, b1, sigma, 0.0f, 0.0f, 0.0f, -FLT_MAX, FLT_MAX}
#define NO_POINT {0.0f, 0.0f, 0.0f, 0.0f, -FLT_MAX, FLT_MAX}
#define CUSUM_ONLY .has_cusum = 1, .cusum = {0.5f, 5.07f, 0.0f}
#define ALL_FOUR                                                                                                       \
    CUSUM_ONLY, .has_ewma = 1, .ewma = {0.1f, 0.7f}, .has_sprt = 1, .sprt = {-0.5f, 1.0f, 0.0f, 6.9f, -4.6f},          \
                .has_shewhart = 1, .shewhart = {-4.0f, 4.0f}
#define CHANNEL(of, relation, watched_by)                                                                              \
    {.kind = of, .index = DRIFT_IAE, .baseline = relation, .operating_point = NO_POINT, watched_by}
#define TIMING(ticks, blocks, unit)                                                                                    \
    .sample_time_s = 0.001f, .block_ticks = ticks, .window_blocks = blocks, .hop_blocks = blocks, .min_valid = 0.5f,   \
    .y_unit = unit, .u_unit = unit, .confirm_hops = 20u, .log_odds = 4.6f, .smallest_shift = 1.0f

#define PAIR_RELATION LEARNT(0.0965f, 0.001f, 0.01f, 2.0f, 5.0f)
#define SMALL_RELATION KNOWN(0.0965f, 0.001f, 0.01f)
#define EFFORT_RELATION LEARNT(0.2f, 1.0f, 0.05f, 1.0f, 9.0f)
#define ACTIVITY_RELATION LEARNT(3.55f, 0.0f, 0.2f, 0.5f, 3.0f)

static drift_report_t report;

/* Memory, configuration and the calls of one kind. */
#define MONITOR(name, WORDS, init, sample_t, tick, ...)                                                                \
    static drift_monitor_t name##_memory[WORDS];                                                                       \
    static const drift_config_t name##_config = {__VA_ARGS__};                                                         \
    int32_t name##_start(void) { return init(name##_memory, WORDS, &name##_config); }                                  \
    int32_t name##_tick(sample_t r, sample_t y, sample_t u) { return tick(name##_memory, r, y, u, &report); }          \
    int32_t name##_without(uint32_t why) { return drift_tick_without(name##_memory, why, &report); }                   \
    uint32_t name##_bytes(void) { return (uint32_t)(sizeof name##_memory + sizeof report); }

MONITOR(c_small, DRIFT_SMALL_WORDS, drift_small_init, float, drift_tick, TIMING(125u, 16u, 1.0f),
        .channels = {CHANNEL(DRIFT_ENERGY_ERROR, SMALL_RELATION, CUSUM_ONLY)})
MONITOR(c_pair, DRIFT_PAIR_WORDS, drift_pair_init, float, drift_tick, TIMING(125u, 16u, 1.0f),
        .channels = {CHANNEL(DRIFT_ENERGY_ERROR, PAIR_RELATION, CUSUM_ONLY)})
MONITOR(c_full, DRIFT_FULL_WORDS, drift_full_init, float, drift_tick, TIMING(250u, 8u, 1.0f),
        .channels = {CHANNEL(DRIFT_ENERGY_ERROR, PAIR_RELATION, ALL_FOUR),
                     CHANNEL(DRIFT_EFFORT, EFFORT_RELATION, ALL_FOUR),
                     CHANNEL(DRIFT_ACTIVITY, ACTIVITY_RELATION, ALL_FOUR)})
MONITOR(c_pair_i32, DRIFT_PAIR_I32_WORDS, drift_pair_i32_init, int32_t, drift_tick_i32,
        TIMING(250u, 8u, 1.0f / 4096.0f),
        .channels = {CHANNEL(DRIFT_ENERGY_ERROR, PAIR_RELATION, CUSUM_ONLY)})

int32_t c_drift_with_curve(void) { return report.verdict == DRIFT_DRIFT && report.channels[0].has_fault_curve; }
