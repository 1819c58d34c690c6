/* One set of calls for each monitor of the cost table: start, a tick, a tick without a sample, the bytes it holds. */
#ifndef MONITORS_H
#define MONITORS_H
#include "drift.h"

#define CALLS(name, sample_t)                                                                                          \
    int32_t name##_start(void);                                                                                        \
    int32_t name##_tick(sample_t r, sample_t y, sample_t u);                                                           \
    int32_t name##_without(uint32_t why);                                                                              \
    uint32_t name##_bytes(void);

CALLS(c_small, float)
CALLS(c_pair, float)
CALLS(c_full, float)
CALLS(c_pair_i32, int32_t)

/* The last report says drift, and has its curve. */
int32_t c_drift_with_curve(void);

#endif
