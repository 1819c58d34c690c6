/* A PI loop in C99 with drift linked in: the actuator fades, the monitor says so; then the state is saved, torn at
 * every byte, and restored. The same file runs on the host under sanitizers and on a Cortex-M in QEMU. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drift.h"

#include "config.h"

static drift_monitor_t monitor[DRIFT_PAIR_WORDS];
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
        code = drift_tick(monitor, level, y, u, &report);
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
    static uint8_t good[DRIFT_STATE_BYTES], bad[DRIFT_STATE_BYTES], after[DRIFT_STATE_BYTES];
    const drift_code_t used = drift_save(monitor, good, (uint32_t)sizeof good);
    uint32_t i;
    unsigned refused = 0;
    if (used <= 0) {
        return fail("save", used);
    }
    for (i = 0; i < (uint32_t)used; i++) {
        if (drift_restore(monitor, good, i) >= 0) {
            return fail("a torn state was taken", (long)i);
        }
        memcpy(bad, good, (size_t)used);
        bad[i] ^= 0x10u;
        if (drift_restore(monitor, bad, (uint32_t)used) >= 0) {
            return fail("a damaged state was taken", (long)i);
        }
        refused += 2;
    }
    if (drift_save(monitor, after, (uint32_t)sizeof after) != used || memcmp(good, after, (size_t)used) != 0) {
        return fail("the monitor changed", 0);
    }
    if (drift_restore(monitor, good, (uint32_t)used) != DRIFT_OK) {
        return fail("restore", 0);
    }
    printf("%u torn and damaged states refused\n", refused);
    return EXIT_SUCCESS;
}

static drift_code_t start(const drift_config_t *config) {
    return drift_pair_init(monitor, DRIFT_PAIR_WORDS, config);
}

static int refusals(void) {
    static drift_monitor_t moved[DRIFT_PAIR_WORDS];
    drift_config_t wrong = drift_config;
    uint8_t untouched[4] = {7, 7, 7, 7};
    if (drift_pair_init(NULL, 0, &drift_config) != DRIFT_NULL) return fail("null monitor", 0);
    if (start(NULL) != DRIFT_NULL) return fail("null config", 0);
    if (drift_tick(monitor, 0.0f, 0.0f, 0.0f, &report) != DRIFT_NOT_INITIALISED) return fail("not started", 0);
    if (drift_pair_init((drift_monitor_t *)(void *)((char *)monitor + 1), DRIFT_PAIR_WORDS - 1, &drift_config) !=
        DRIFT_MISALIGNED)
        return fail("misaligned", 0);
    if (drift_pair_init(monitor, 8, &drift_config) != DRIFT_BUFFER_TOO_SMALL) return fail("too few words", 0);
    wrong.channels[0].kind = 9u;
    if (start(&wrong) != DRIFT_BAD_CONFIG) return fail("wrong kind", 0);
    wrong = drift_config;
    wrong.window_blocks = 65;
    wrong.hop_blocks = 65;
    if (start(&wrong) != DRIFT_TOO_MANY_BLOCKS) return fail("too many blocks", 0);
    wrong = drift_config;
    wrong.channels[0].kind = DRIFT_EFFORT;
    if (start(&wrong) != DRIFT_INDEX_NOT_KEPT) return fail("index not kept", 0);
    wrong = drift_config;
    wrong.channels[0].has_sprt = 1;
    wrong.channels[0].sprt.upper = 1.0f;
    wrong.channels[0].sprt.lower = -1.0f;
    if (start(&wrong) != DRIFT_NOT_LINKED) return fail("not linked", 0);
    if (start(&drift_config) != DRIFT_OK) return fail("init", 0);
    if (drift_tick_i32(monitor, 0, 0, 0, &report) != DRIFT_OTHER_NUMBER) return fail("counts", 0);
    memcpy(moved, monitor, sizeof moved);
    if (drift_tick(moved, 0.0f, 0.0f, 0.0f, &report) != DRIFT_OK) return fail("moved", 0);
    if (drift_tick(monitor, 0.0f, 0.0f, 0.0f, NULL) != DRIFT_NULL) return fail("null report", 0);
    if (drift_save(monitor, untouched, 4) != DRIFT_BUFFER_TOO_SMALL || untouched[0] != 7) return fail("save", 0);
    printf("null, misaligned and impossible arguments refused\n");
    return EXIT_SUCCESS;
}

/* The baseline learnt in place, as far as a started monitor. */
static int commissioning(void) {
    static drift_commissioning_t learning;
    drift_config_t config = drift_config;
    uint32_t i;
    if (drift_commissioning_start(&learning) != DRIFT_OK) return fail("commissioning", 0);
    if (drift_commissioning_finish(&learning, 1, &config) != DRIFT_TOO_FEW_WINDOWS) return fail("too few", 0);
    for (i = 0; i < 50; i++) {
        if (run(400u, 1.0f, 0) < -1) return fail("run", 0);
        if (drift_commissioning_learn(&learning, &report) != DRIFT_OK) return fail("learn", 0);
    }
    if (drift_commissioning_finish(&learning, 1, &config) != DRIFT_OK) return fail("finish", 0);
    if (start(&config) != DRIFT_OK) return fail("start", 0);
    printf("learnt from %u windows\n", (unsigned)config.channels[0].baseline.windows);
    return EXIT_SUCCESS;
}

int main(void) {
    if (refusals() != EXIT_SUCCESS) return EXIT_FAILURE;
    if (commissioning() != EXIT_SUCCESS) return EXIT_FAILURE;
    if (start(&drift_config) != DRIFT_OK) return fail("init", 0);
    if (run(20000u, 1.0f, 1) != -1) return fail("a false alarm", 0);
    if (run(20000u, 0.6f, 1) < 0) return fail("no drift found", 0);
    if (power_loss() != EXIT_SUCCESS) return EXIT_FAILURE;
    printf("done\n");
    return EXIT_SUCCESS;
}
