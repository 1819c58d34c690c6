/* The C interface of drift-core. Generated from drift-core/c by cbindgen; C99.
 *
 * The caller owns all memory: a monitor is an array of words, as many as its kind takes:
 *     static drift_monitor_t monitor[DRIFT_PAIR_WORDS];
 *     drift_pair_init(monitor, DRIFT_PAIR_WORDS, &config);
 * Every function returns DRIFT_OK, DRIFT_REPORT, or a negative code; null and misaligned pointers, and monitors that
 * were not initialised, are refused. Only the kinds whose init is called are linked.
 */

#ifndef DRIFT_H
#define DRIFT_H

#include <stdbool.h>
#include <stdint.h>

/*
 Done; no report at this tick.
 */
#define DRIFT_OK 0

/*
 Done; the report is filled in.
 */
#define DRIFT_REPORT 1

/*
 A pointer is null.
 */
#define DRIFT_NULL (-1)

/*
 A pointer is not aligned as its type needs.
 */
#define DRIFT_MISALIGNED (-2)

/*
 The monitor was not initialised.
 */
#define DRIFT_NOT_INITIALISED (-3)

/*
 The configuration holds a number that is not positive, not finite or out of range.
 */
#define DRIFT_BAD_CONFIG (-4)

/*
 Blocks are longer than their sums can hold.
 */
#define DRIFT_BLOCK_TOO_LONG (-5)

/*
 More than DRIFT_BLOCKS blocks per window (64 where windows can't overlap).
 */
#define DRIFT_TOO_MANY_BLOCKS (-6)

/*
 A channel needs an index that this kind of monitor does not keep; use drift_full_init.
 */
#define DRIFT_INDEX_NOT_KEPT (-7)

/*
 The buffer is too small for the state, or the memory for the monitor.
 */
#define DRIFT_BUFFER_TOO_SMALL (-8)

/*
 The saved state is cut short.
 */
#define DRIFT_TORN (-9)

/*
 These bytes are no saved state.
 */
#define DRIFT_NOT_A_STATE (-10)

/*
 Saved by another version of the layout.
 */
#define DRIFT_VERSION (-11)

/*
 The saved state is damaged.
 */
#define DRIFT_CHECKSUM (-12)

/*
 Saved by another kind of monitor.
 */
#define DRIFT_OTHER_MONITOR (-13)

/*
 Saved under another configuration.
 */
#define DRIFT_OTHER_CONFIG (-14)

/*
 The saved state holds an impossible value.
 */
#define DRIFT_IMPOSSIBLE (-15)

/*
 A monitor of counts was given floats, or the other way round.
 */
#define DRIFT_OTHER_NUMBER (-16)

/*
 The configuration asks for what this kind of monitor leaves out; use a larger kind.
 */
#define DRIFT_NOT_LINKED (-17)

/*
 Commissioning has seen fewer healthy windows than a baseline needs.
 */
#define DRIFT_TOO_FEW_WINDOWS (-18)

/*
 An index does not scatter while it is learnt: the loop stands still, or a sensor is stuck.
 */
#define DRIFT_NO_SCATTER (-19)

/*
 The operating point stands still while it is learnt, or goes with the channel's x alone.
 */
#define DRIFT_POINT_STANDS_STILL (-20)

/*
 The version, as the crate's.
 */
#define DRIFT_VERSION_MAJOR 0

/*
 See DRIFT_VERSION_MAJOR.
 */
#define DRIFT_VERSION_MINOR 1

/*
 See DRIFT_VERSION_MAJOR.
 */
#define DRIFT_VERSION_PATCH 0

/*
 The error index against the control energy.
 */
#define DRIFT_ENERGY_ERROR 0

/*
 Mean u against mean y.
 */
#define DRIFT_EFFORT 1

/*
 Mean of u sign(dy) against the speed.
 */
#define DRIFT_MOTION_EFFORT 2

/*
 The control energy against the reference's own activity.
 */
#define DRIFT_ACTIVITY 3

/*
 Integral of |e|.
 */
#define DRIFT_IAE 0

/*
 Integral of e^2.
 */
#define DRIFT_ISE 1

/*
 Integral of t |e|.
 */
#define DRIFT_ITAE 2

/*
 Integral of t e^2.
 */
#define DRIFT_ITSE 3

/*
 On the baseline.
 */
#define DRIFT_HEALTHY 0

/*
 At this decision a deviation ended before it could be called drift.
 */
#define DRIFT_DISTURBANCE 1

/*
 At this decision a confirmed drift ended.
 */
#define DRIFT_RECOVERED 2

/*
 An alarm was raised; not yet known which.
 */
#define DRIFT_SUSPECT 3

/*
 Away from the baseline to stay.
 */
#define DRIFT_DRIFT 4

/*
 To none.
 */
#define DRIFT_SIDE_NONE 0

/*
 Above the baseline.
 */
#define DRIFT_SIDE_HIGH 1

/*
 Below it.
 */
#define DRIFT_SIDE_LOW 2

/*
 No channel is away.
 */
#define DRIFT_NOWHERE 0

/*
 Only the effort.
 */
#define DRIFT_OPERATING_POINT 1

/*
 Only the effort along the motion.
 */
#define DRIFT_FRICTION 2

/*
 Only the activity.
 */
#define DRIFT_DYNAMICS 3

/*
 Only the energy-error relation.
 */
#define DRIFT_TRACKING 4

/*
 Several.
 */
#define DRIFT_SEVERAL 5

/*
 Too few windows yet.
 */
#define DRIFT_MOVED_UNDECIDED 0

/*
 Lifted or lowered.
 */
#define DRIFT_MOVED_INTERCEPT 1

/*
 Tilted.
 */
#define DRIFT_MOVED_SLOPE 2

/*
 Both.
 */
#define DRIFT_MOVED_BOTH 3

/*
 The loop is open or in manual mode.
 */
#define DRIFT_MANUAL 0

/*
 No sample arrived.
 */
#define DRIFT_MISSING 1

/*
 64-bit words of a commissioning.
 */
#define DRIFT_COMMISSIONING_WORDS 23

/*
 Channels of the largest kind.
 */
#define DRIFT_CHANNELS 3

/*
 Bytes of a configuration.
 */
#define DRIFT_CONFIG_BYTES 492

/*
 Most blocks of windows that overlap.
 */
#define DRIFT_BLOCKS 16

/*
 64-bit words of a monitor that drift_small_init starts.
 */
#define DRIFT_SMALL_WORDS 44

/*
 64-bit words of a monitor that drift_pair_init starts.
 */
#define DRIFT_PAIR_WORDS 52

/*
 64-bit words of a monitor that drift_full_init starts.
 */
#define DRIFT_FULL_WORDS 260

/*
 64-bit words of a monitor that drift_small_i32_init starts.
 */
#define DRIFT_SMALL_I32_WORDS 44

/*
 64-bit words of a monitor that drift_pair_i32_init starts.
 */
#define DRIFT_PAIR_I32_WORDS 52

/*
 64-bit words of a monitor that drift_full_i32_init starts.
 */
#define DRIFT_FULL_I32_WORDS 260

/*
 64-bit words of a monitor that drift_full_at_init starts.
 */
#define DRIFT_FULL_AT_WORDS 280

/*
 64-bit words of a monitor that drift_full_at_i32_init starts.
 */
#define DRIFT_FULL_AT_I32_WORDS 280

/*
 No saved state of any kind is longer.
 */
#define DRIFT_STATE_BYTES 1400

/*
 64-bit words of a commissioning with a memory.
 */
#define DRIFT_MEMORY_COMMISSIONING_WORDS 36

/*
 Bytes of a report.
 */
#define DRIFT_REPORT_BYTES 296

/*
 What a function returns: zero or above is good.
 */
typedef int32_t drift_code_t;

/*
 What was learnt so far.
 */
typedef struct drift_commissioning_t {
  /*
   Not to be touched.
   */
  uint64_t words[DRIFT_COMMISSIONING_WORDS];
} drift_commissioning_t;

/*
 What a course amounts to, in rising severity.
 */
typedef uint8_t drift_verdict_t;

/*
 Where the deviation seems to be.
 */
typedef uint8_t drift_location_t;

/*
 What a channel compares.
 */
typedef uint32_t drift_kind_t;

/*
 The error index of DRIFT_ENERGY_ERROR.
 */
typedef uint32_t drift_index_t;

/*
 To which side something moved.
 */
typedef uint8_t drift_side_t;

/*
 How a refitted curve differs from the baseline.
 */
typedef uint8_t drift_moved_t;

/*
 One channel at one decision.
 */
typedef struct drift_channel_report_t {
  /*
   What is compared.
   */
  drift_kind_t kind;
  /*
   The error index of DRIFT_ENERGY_ERROR.
   */
  drift_index_t index;
  /*
   The window's place on the baseline's axis.
   */
  float x;
  /*
   The index that is judged.
   */
  float value;
  /*
   Its distance from the baseline; NaN where nothing could be judged.
   */
  float residual;
  /*
   The same in standard deviations.
   */
  float z;
  /*
   CUSUM's two sums, sigmas.
   */
  float cusum_high;
  /*
   See cusum_high.
   */
  float cusum_low;
  /*
   The weighted average, sigmas.
   */
  float ewma_mean;
  /*
   SPRT's two log-likelihood ratios.
   */
  float sprt_high;
  /*
   See sprt_high.
   */
  float sprt_low;
  /*
   The refitted curve, where has_fault_curve is 1.
   */
  float fault_b0;
  /*
   Its slope.
   */
  float fault_b1;
  /*
   Its mean distance from the baseline.
   */
  float fault_shift;
  /*
   Windows that it was fitted on.
   */
  uint32_t fault_windows;
  /*
   What the channel's course amounts to.
   */
  drift_verdict_t verdict;
  /*
   To which side it moved.
   */
  drift_side_t side;
  /*
   The side at which each detector alarmed.
   */
  drift_side_t alarm_shewhart;
  /*
   See alarm_shewhart.
   */
  drift_side_t alarm_cusum;
  /*
   See alarm_shewhart.
   */
  drift_side_t alarm_ewma;
  /*
   See alarm_shewhart.
   */
  drift_side_t alarm_sprt;
  /*
   1: x lies outside what calibration saw.
   */
  uint8_t extrapolated;
  /*
   1: a drift is confirmed and its curve refitted.
   */
  uint8_t has_fault_curve;
  /*
   How the curve moved.
   */
  drift_moved_t moved;
} drift_channel_report_t;

/*
 One decision.
 */
typedef struct drift_report_t {
  /*
   Decisions before this one.
   */
  uint32_t hop;
  /*
   1: enough valid ticks; 0: indices are NaN, detectors stand still.
   */
  uint8_t valid;
  /*
   The most severe verdict among the channels.
   */
  drift_verdict_t verdict;
  /*
   Where the deviation seems to be.
   */
  drift_location_t location;
  /*
   Channels that are filled in.
   */
  uint8_t channel_count;
  /*
   Control energy, u-unit^2 s.
   */
  float e_u;
  /*
   Integral of |e|; what the monitor does not keep is NaN.
   */
  float iae;
  /*
   Integral of e^2.
   */
  float ise;
  /*
   Integral of t |e|.
   */
  float itae;
  /*
   Integral of t e^2.
   */
  float itse;
  /*
   Mean of u.
   */
  float mean_u;
  /*
   Mean of y.
   */
  float mean_y;
  /*
   Mean of e.
   */
  float mean_e;
  /*
   Largest |u|.
   */
  float peak_u;
  /*
   Largest |e|.
   */
  float peak_e;
  /*
   Sum of the reference's squared steps.
   */
  float reference_activity;
  /*
   Mean of u sign(dy).
   */
  float motion_effort;
  /*
   Mean of |dy|/dt.
   */
  float speed;
  /*
   Mean of the operating point, in the kinds of drift_full_at_init.
   */
  float operating_point;
  /*
   Ticks left out since the last decision, whatever the reason.
   */
  uint16_t left_out;
  /*
   Of them, where the kind of monitor tells them apart: no sample.
   */
  uint16_t missing;
  /*
   NaN or infinite.
   */
  uint16_t non_finite;
  /*
   Too large.
   */
  uint16_t out_of_range;
  /*
   u at a limit.
   */
  uint16_t saturated;
  /*
   Loop open.
   */
  uint16_t manual;
  /*
   After a step of the reference.
   */
  uint16_t blanked;
  /*
   The channels.
   */
  struct drift_channel_report_t channels[DRIFT_CHANNELS];
} drift_report_t;

/*
 The healthy relation value = b0 + b1*x.
 */
typedef struct drift_baseline_t {
  /*
   Intercept.
   */
  float b0;
  /*
   Slope.
   */
  float b1;
  /*
   Standard deviation of a healthy residual; 0: the channel is only reported.
   */
  float sigma;
  /*
   Independent windows that it was learnt from; 0: exactly known.
   */
  float windows;
  /*
   Mean x of them.
   */
  float x_mean;
  /*
   Their sum of squared deviations of x; 0: the slope is exactly known.
   */
  float x_ss;
  /*
   Smallest x seen.
   */
  float x_min;
  /*
   Largest x seen.
   */
  float x_max;
} drift_baseline_t;

/*
 What the windows before add to the relation.
 */
typedef struct drift_memory_t {
  /*
   Windows that are remembered, 0 to 3.
   */
  uint32_t order;
  /*
   Coefficients of x, the newest first.
   */
  float x[3];
  /*
   Coefficients of the value.
   */
  float value[3];
} drift_memory_t;

/*
 What a measured operating point adds to the relation; weight 0: nothing.
 */
typedef struct drift_operating_point_t {
  /*
   Value units per unit of the point.
   */
  float weight;
  /*
   The point's mean while it was learnt.
   */
  float mean;
  /*
   How the point went with x.
   */
  float per_x;
  /*
   Its sum of squared deviations that x does not explain; 0: the weight is exactly known.
   */
  float ss;
  /*
   Smallest point seen.
   */
  float min;
  /*
   Largest point seen.
   */
  float max;
} drift_operating_point_t;

/*
 Two-sided CUSUM.
 */
typedef struct drift_cusum_t {
  /*
   Reference value, sigmas.
   */
  float k;
  /*
   Decision interval, sigmas.
   */
  float h;
  /*
   Start of both sums as a fraction of h.
   */
  float head_start;
} drift_cusum_t;

/*
 Exponentially weighted moving average.
 */
typedef struct drift_ewma_t {
  /*
   Weight of the newest residual.
   */
  float lambda;
  /*
   Alarm above, sigmas.
   */
  float limit;
} drift_ewma_t;

/*
 Sequential probability ratio test.
 */
typedef struct drift_sprt_t {
  /*
   Added at every decision.
   */
  float constant;
  /*
   Times z.
   */
  float linear;
  /*
   Times z^2.
   */
  float quadratic;
  /*
   Alarm at or above.
   */
  float upper;
  /*
   Restart at or below.
   */
  float lower;
} drift_sprt_t;

/*
 Limits on one standardised residual.
 */
typedef struct drift_shewhart_t {
  /*
   Below zero.
   */
  float lower;
  /*
   Above zero.
   */
  float upper;
} drift_shewhart_t;

/*
 One residual channel.
 */
typedef struct drift_channel_t {
  /*
   What is compared.
   */
  drift_kind_t kind;
  /*
   The error index of DRIFT_ENERGY_ERROR.
   */
  drift_index_t index;
  /*
   The healthy relation.
   */
  struct drift_baseline_t baseline;
  /*
   What the windows before add to it.
   */
  struct drift_memory_t memory;
  /*
   What a measured operating point adds to it, in the kinds of drift_full_at_init.
   */
  struct drift_operating_point_t operating_point;
  /*
   0 or 1; here and below in the order of the core's table.
   */
  uint8_t has_cusum;
  /*
   0 or 1.
   */
  uint8_t has_ewma;
  /*
   0 or 1.
   */
  uint8_t has_sprt;
  /*
   0 or 1.
   */
  uint8_t has_shewhart;
  /*
   Cumulative.
   */
  struct drift_cusum_t cusum;
  /*
   Weighted.
   */
  struct drift_ewma_t ewma;
  /*
   Sequential.
   */
  struct drift_sprt_t sprt;
  /*
   Instant.
   */
  struct drift_shewhart_t shewhart;
} drift_channel_t;

/*
 The configuration; `drift calibrate --c` writes it as an initialiser. A pair monitor uses the first channel.
 Limits and steps of the i32 monitors are in counts.
 */
typedef struct drift_config_t {
  /*
   Seconds per tick.
   */
  float sample_time_s;
  /*
   Ticks per block.
   */
  uint32_t block_ticks;
  /*
   Blocks per window, at most DRIFT_BLOCKS.
   */
  uint16_t window_blocks;
  /*
   Blocks from one decision to the next.
   */
  uint16_t hop_blocks;
  /*
   Fraction of valid ticks from which a block and a window count.
   */
  float min_valid;
  /*
   y-units per count; 1 for float.
   */
  float y_unit;
  /*
   u-units per count; 1 for float.
   */
  float u_unit;
  /*
   0 or 1.
   */
  uint8_t has_saturation;
  /*
   u at or below is saturated.
   */
  float u_min;
  /*
   u at or above is saturated.
   */
  float u_max;
  /*
   0 or 1.
   */
  uint8_t has_blanking;
  /*
   A larger change of r per tick is a step.
   */
  float blank_reference_step;
  /*
   Ticks left out after one.
   */
  uint32_t blank_ticks;
  /*
   Decisions before a drift is confirmed.
   */
  uint16_t confirm_hops;
  /*
   Log odds needed to call it either way.
   */
  float log_odds;
  /*
   Smallest shift that counts as away, sigmas.
   */
  float smallest_shift;
  /*
   The residual channels.
   */
  struct drift_channel_t channels[DRIFT_CHANNELS];
} drift_config_t;

/*
 One word of a monitor: `static drift_monitor_t monitor[DRIFT_PAIR_WORDS];` is a monitor.
 */
typedef struct drift_monitor_t {
  /*
   Not to be touched.
   */
  uint64_t word;
} drift_monitor_t;

/*
 What was learnt so far of one channel.
 */
typedef struct drift_memory_commissioning_t {
  /*
   Not to be touched.
   */
  uint64_t words[DRIFT_MEMORY_COMMISSIONING_WORDS];
} drift_memory_commissioning_t;

/*
 Why a tick brings no sample.
 */
typedef uint32_t drift_without_t;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 Nothing learnt yet.

 # Safety
 A pointer that is neither null nor misaligned points to memory of its type.
 */
drift_code_t drift_commissioning_start(struct drift_commissioning_t *learning);

/*
 Adds one healthy decision; a window that was not valid is passed over.

 # Safety
 As for drift_commissioning_start, which was called before.
 */
drift_code_t drift_commissioning_learn(struct drift_commissioning_t *learning,
                                       const struct drift_report_t *report);

/*
 Writes the baselines of the first channels channels into the configuration, which a monitor can then be started
 with, and, where the reports came with an operating point, what it adds to the channels that can depend on it;
 DRIFT_TOO_FEW_WINDOWS, DRIFT_NO_SCATTER or DRIFT_POINT_STANDS_STILL, and nothing written, where they can't be had.

 # Safety
 As for drift_commissioning_learn.
 */
drift_code_t drift_commissioning_finish(const struct drift_commissioning_t *learning,
                                        uint32_t channels,
                                        struct drift_config_t *config);

/*
 The smallest: E_u and IAE, one CUSUM on an exactly known relation; no gaps, no limits, no refitted curve.
 Checks the configuration, copies it and starts the monitor in so many words of memory.

 # Safety
 Pointers that are neither null nor misaligned point to memory of their type.
 */
drift_code_t drift_small_init(struct drift_monitor_t *memory,
                              uint32_t words,
                              const struct drift_config_t *config);

/*
 The paper's pair: E_u and IAE; CUSUM and Shewhart, windows that follow one another.
 Checks the configuration, copies it and starts the monitor in so many words of memory.

 # Safety
 Pointers that are neither null nor misaligned point to memory of their type.
 */
drift_code_t drift_pair_init(struct drift_monitor_t *memory,
                             uint32_t words,
                             const struct drift_config_t *config);

/*
 All indices, three channels, everything that there is; windows of up to DRIFT_BLOCKS blocks may overlap.
 Checks the configuration, copies it and starts the monitor in so many words of memory.

 # Safety
 Pointers that are neither null nor misaligned point to memory of their type.
 */
drift_code_t drift_full_init(struct drift_monitor_t *memory,
                             uint32_t words,
                             const struct drift_config_t *config);

/*
 The smallest, of counts.
 Checks the configuration, copies it and starts the monitor in so many words of memory.

 # Safety
 Pointers that are neither null nor misaligned point to memory of their type.
 */
drift_code_t drift_small_i32_init(struct drift_monitor_t *memory,
                                  uint32_t words,
                                  const struct drift_config_t *config);

/*
 The paper's pair, of counts.
 Checks the configuration, copies it and starts the monitor in so many words of memory.

 # Safety
 Pointers that are neither null nor misaligned point to memory of their type.
 */
drift_code_t drift_pair_i32_init(struct drift_monitor_t *memory,
                                 uint32_t words,
                                 const struct drift_config_t *config);

/*
 All indices and three channels, of counts.
 Checks the configuration, copies it and starts the monitor in so many words of memory.

 # Safety
 Pointers that are neither null nor misaligned point to memory of their type.
 */
drift_code_t drift_full_i32_init(struct drift_monitor_t *memory,
                                 uint32_t words,
                                 const struct drift_config_t *config);

/*
 As drift_full_init, and a measured operating point, told by drift_operating_point: no tick counts before.
 Checks the configuration, copies it and starts the monitor in so many words of memory.

 # Safety
 Pointers that are neither null nor misaligned point to memory of their type.
 */
drift_code_t drift_full_at_init(struct drift_monitor_t *memory,
                                uint32_t words,
                                const struct drift_config_t *config);

/*
 The same of counts, the operating point too.
 Checks the configuration, copies it and starts the monitor in so many words of memory.

 # Safety
 Pointers that are neither null nor misaligned point to memory of their type.
 */
drift_code_t drift_full_at_i32_init(struct drift_monitor_t *memory,
                                    uint32_t words,
                                    const struct drift_config_t *config);

/*
 Nothing learnt yet of the channel at this place, from 0: the effort channel's, as a rule.

 # Safety
 A pointer that is neither null nor misaligned points to memory of its type.
 */
drift_code_t drift_memory_commissioning_start(struct drift_memory_commissioning_t *learning,
                                              uint32_t channel);

/*
 Adds one healthy decision. Give it every report in order, of windows that do not overlap: one that is not valid, or left
 out, is a hole that the memory does not reach across.

 # Safety
 As for drift_memory_commissioning_start, which was called before.
 */
drift_code_t drift_memory_commissioning_learn(struct drift_memory_commissioning_t *learning,
                                              const struct drift_report_t *report);

/*
 Writes baseline and memory of that channel into the configuration, and, where the reports came with an operating point, what it
 adds. The order is the one that pays, 0 to 3: DRIFT_NOT_LINKED from an init says that its kind has no memory.
 DRIFT_TOO_FEW_WINDOWS (100 with three windows before them are needed, 200 for an order of 3), DRIFT_NO_SCATTER or
 DRIFT_POINT_STANDS_STILL, and nothing written, where they can't be had.

 # Safety
 As for drift_memory_commissioning_learn.
 */
drift_code_t drift_memory_commissioning_finish(const struct drift_memory_commissioning_t *learning,
                                               struct drift_config_t *config);

/*
 One tick of the closed loop in engineering units; DRIFT_REPORT once per hop.

 # Safety
 Pointers that are neither null nor misaligned point to memory of their type; no other call uses the monitor at the
 same time.
 */
drift_code_t drift_tick(struct drift_monitor_t *monitor,
                        float r,
                        float y,
                        float u,
                        struct drift_report_t *report);

/*
 The same in converter counts, for the i32 kinds.

 # Safety
 As for drift_tick.
 */
drift_code_t drift_tick_i32(struct drift_monitor_t *monitor,
                            int32_t r,
                            int32_t y,
                            int32_t u,
                            struct drift_report_t *report);

/*
 The operating point from the next tick on, for a monitor of drift_full_at_init; DRIFT_NOT_LINKED for others. Ticks
 do not count before it is told, nor while it is not finite.

 # Safety
 As for drift_tick.
 */
drift_code_t drift_operating_point(struct drift_monitor_t *monitor,
                                   float point);

/*
 The same in converter counts, for a monitor of drift_full_at_i32_init.

 # Safety
 As for drift_tick.
 */
drift_code_t drift_operating_point_i32(struct drift_monitor_t *monitor, int32_t point);

/*
 One tick without a sample: DRIFT_MANUAL or DRIFT_MISSING.

 # Safety
 As for drift_tick.
 */
drift_code_t drift_tick_without(struct drift_monitor_t *monitor,
                                drift_without_t why,
                                struct drift_report_t *report);

/*
 Forgets alarms and courses, for a fault that was seen to.

 # Safety
 As for drift_tick.
 */
drift_code_t drift_acknowledge(struct drift_monitor_t *monitor);

/*
 Bytes that drift_save needs, or a negative code.

 # Safety
 As for drift_tick.
 */
drift_code_t drift_state_bytes(struct drift_monitor_t *monitor);

/*
 Saves the state into capacity bytes; the bytes used, or a negative code: then nothing is written.
 DRIFT_STATE_BYTES always suffice.

 # Safety
 As for drift_tick; into points to capacity writable bytes.
 */
drift_code_t drift_save(struct drift_monitor_t *monitor, uint8_t *into, uint32_t capacity);

/*
 Takes up a saved state, all of it or none.

 # Safety
 As for drift_tick; from points to length readable bytes.
 */
drift_code_t drift_restore(struct drift_monitor_t *monitor, const uint8_t *from, uint32_t length);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* DRIFT_H */

/* Both sides agree on every size: the Rust side asserts the same numbers. */
extern const char drift_config_size_is_as_compiled[sizeof(drift_config_t) == DRIFT_CONFIG_BYTES ? 1 : -1];
extern const char drift_report_size_is_as_compiled[sizeof(drift_report_t) == DRIFT_REPORT_BYTES ? 1 : -1];
extern const char drift_word_size_is_as_compiled[sizeof(drift_monitor_t) == 8 ? 1 : -1];
