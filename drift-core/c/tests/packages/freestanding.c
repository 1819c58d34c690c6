/* Needs nothing but drift and the compiler's own routines: what a core without a C library can link. */
#include "drift.h"

#include "config.h"

static drift_monitor_t monitor[DRIFT_PAIR_WORDS];
static drift_report_t report;

void start(void);

void start(void) {
    if (drift_pair_init(monitor, DRIFT_PAIR_WORDS, &drift_config) != DRIFT_OK) return;
    for (;;) (void)drift_tick(monitor, 1.0f, 0.5f, 0.5f, &report);
}
