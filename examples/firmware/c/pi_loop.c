/* A PI loop in C99 with drift linked in: the actuator fades, the monitor says so; then the state is saved, torn at
 * every byte, and restored. The same file runs on the host under sanitizers and on a Cortex-M in QEMU. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drift.h"

#include "config.h"

static drift_pair_t monitor;
static drift_report_t report;

static uint32_t noise_state = 1u;

static float noise(void) {
    noise_state ^= noise_state << 13;
    noise_state ^= noise_state >> 17;
    noise_state ^= noise_state << 5;
    return (float)(noise_state >> 8) * (1.0f / 8388608.0f) - 1.0f;
}

static int fail(const char *what, long code) {
    printf("failed: %s: %ld\n", what, code);
    return EXIT_FAILURE;
}

/* The loop: PI, first-order plant, a reference that wanders. Returns the hop at which a drift is confirmed. */
static long run(unsigned long ticks, float gain_after, int print) {
    static float x, integral, level = 1.0f;
    static unsigned long tick;
    const unsigned long end = tick + ticks;
    long confirmed = -1;
    for (; tick < end; tick++) {
        float y, u;
        drift_code_t code;
        if (tick % 50u == 0u) {
            level = 1.0f + 0.3f * noise();
        }
        y = x + 0.02f * noise();
        integral += 0.02f * (level - y);
        u = 2.0f * (level - y) + integral;
        x += (gain_after * u - x) * 0.02f;
        code = drift_pair_tick(&monitor, level, y, u, &report);
        if (code < 0) {
            return code;
        }
        if (code == DRIFT_REPORT && report.verdict == DRIFT_DRIFT && confirmed < 0) {
            confirmed = (long)report.hop;
            if (print) {
                printf("hop %ld: drift, side %u, moved %u\n", confirmed, (unsigned)report.channels[0].side,
                       (unsigned)report.channels[0].moved);
            }
        }
    }
    return confirmed;
}

/* A blob that was cut off or damaged anywhere is refused, and leaves the monitor as it was. */
static int power_loss(void) {
    static uint8_t good[16 * DRIFT_PAIR_WORDS], bad[16 * DRIFT_PAIR_WORDS], after[16 * DRIFT_PAIR_WORDS];
    const drift_code_t used = drift_pair_save(&monitor, good, (uint32_t)sizeof good);
    uint32_t i;
    unsigned refused = 0;
    if (used <= 0) {
        return fail("save", used);
    }
    for (i = 0; i < (uint32_t)used; i++) {
        if (drift_pair_restore(&monitor, good, i) >= 0) {
            return fail("a torn state was taken", (long)i);
        }
        memcpy(bad, good, (size_t)used);
        bad[i] ^= 0x10u;
        if (drift_pair_restore(&monitor, bad, (uint32_t)used) >= 0) {
            return fail("a damaged state was taken", (long)i);
        }
        refused += 2;
    }
    if (drift_pair_save(&monitor, after, (uint32_t)sizeof after) != used || memcmp(good, after, (size_t)used) != 0) {
        return fail("the monitor changed", 0);
    }
    if (drift_pair_restore(&monitor, good, (uint32_t)used) != DRIFT_OK) {
        return fail("restore", 0);
    }
    printf("%u torn and damaged states refused\n", refused);
    return EXIT_SUCCESS;
}

static int refusals(void) {
    static drift_pair_t moved;
    drift_config_t wrong = drift_config;
    if (drift_pair_init(NULL, &drift_config) != DRIFT_NULL) return fail("null monitor", 0);
    if (drift_pair_init(&monitor, NULL) != DRIFT_NULL) return fail("null config", 0);
    if (drift_pair_tick(&monitor, 0.0f, 0.0f, 0.0f, &report) != DRIFT_NOT_INITIALISED) return fail("not started", 0);
    if (drift_pair_init((drift_pair_t *)(void *)((char *)&monitor + 1), &drift_config) != DRIFT_MISALIGNED)
        return fail("misaligned", 0);
    wrong.channels[0].kind = 9u;
    if (drift_pair_init(&monitor, &wrong) != DRIFT_BAD_CONFIG) return fail("wrong kind", 0);
    wrong = drift_config;
    wrong.window_blocks = DRIFT_BLOCKS + 1;
    wrong.hop_blocks = DRIFT_BLOCKS + 1;
    if (drift_pair_init(&monitor, &wrong) != DRIFT_TOO_MANY_BLOCKS) return fail("too many blocks", 0);
    wrong = drift_config;
    wrong.channels[0].kind = DRIFT_EFFORT;
    if (drift_pair_init(&monitor, &wrong) != DRIFT_INDEX_NOT_KEPT) return fail("index not kept", 0);
    if (drift_pair_init(&monitor, &drift_config) != DRIFT_OK) return fail("init", 0);
    moved = monitor;
    if (drift_pair_tick(&moved, 0.0f, 0.0f, 0.0f, &report) != DRIFT_NOT_INITIALISED) return fail("moved", 0);
    if (drift_pair_tick(&monitor, 0.0f, 0.0f, 0.0f, NULL) != DRIFT_NULL) return fail("null report", 0);
    printf("null, misaligned, moved and impossible arguments refused\n");
    return EXIT_SUCCESS;
}

int main(void) {
    if (refusals() != EXIT_SUCCESS) return EXIT_FAILURE;
    if (drift_pair_init(&monitor, &drift_config) != DRIFT_OK) return fail("init", 0);
    if (run(20000u, 1.0f, 1) != -1) return fail("a false alarm", 0);
    if (run(20000u, 0.6f, 1) < 0) return fail("no drift found", 0);
    if (power_loss() != EXIT_SUCCESS) return EXIT_FAILURE;
    printf("done\n");
    return EXIT_SUCCESS;
}
