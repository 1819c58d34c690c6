/* The C interface of drift-core. Generated from drift-core/c by cbindgen; C99.
 *
 * The caller owns all memory: a monitor is an opaque block of a fixed size that must stay where it was
 * initialised. Every function returns DRIFT_OK, DRIFT_REPORT, or a negative code; null and misaligned pointers,
 * and monitors that were not initialised or were moved, are refused.
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
#define DRIFT_NULL -1

/*
 A pointer is not aligned as its type needs.
 */
#define DRIFT_MISALIGNED -2

/*
 The monitor was not initialised, or was moved since.
 */
#define DRIFT_NOT_INITIALISED -3

/*
 The configuration holds a number that is not positive, not finite or out of range.
 */
#define DRIFT_BAD_CONFIG -4

/*
 Blocks are longer than their sums can hold.
 */
#define DRIFT_BLOCK_TOO_LONG -5

/*
 More than DRIFT_BLOCKS blocks per window.
 */
#define DRIFT_TOO_MANY_BLOCKS -6

/*
 A channel needs an index that this kind of monitor does not keep; use drift_full_t.
 */
#define DRIFT_INDEX_NOT_KEPT -7

/*
 The buffer is too small for the state.
 */
#define DRIFT_BUFFER_TOO_SMALL -8

/*
 The saved state is cut short.
 */
#define DRIFT_TORN -9

/*
 These bytes are no saved state.
 */
#define DRIFT_NOT_A_STATE -10

/*
 Saved by another version of the layout.
 */
#define DRIFT_VERSION -11

/*
 The saved state is damaged.
 */
#define DRIFT_CHECKSUM -12

/*
 Saved by another kind of monitor.
 */
#define DRIFT_OTHER_MONITOR -13

/*
 Saved under another configuration.
 */
#define DRIFT_OTHER_CONFIG -14

/*
 The saved state holds an impossible value.
 */
#define DRIFT_IMPOSSIBLE -15

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
 Bytes of a configuration.
 */
#define DRIFT_CONFIG_BYTES 312

/*
 64-bit words of a monitor.
 */
#define DRIFT_FULL_WORDS 200

/*
 64-bit words of a monitor.
 */
#define DRIFT_FULL_I32_WORDS 320

/*
 Most blocks per window.
 */
#define DRIFT_BLOCKS 16

/*
 64-bit words of a monitor.
 */
#define DRIFT_PAIR_WORDS 60

/*
 64-bit words of a monitor.
 */
#define DRIFT_PAIR_I32_WORDS 76

/*
 Bytes of a report.
 */
#define DRIFT_REPORT_BYTES 264

/*
 What a function returns: zero or above is good.
 */
typedef int32_t drift_code_t;

/*
 All indices, three channels, of float samples.
 */
typedef struct drift_full_t {
  /*
   Not to be touched.
   */
  uint64_t words[DRIFT_FULL_WORDS];
} drift_full_t;

/*
 What a channel compares.
 */
typedef uint32_t drift_kind_t;

/*
 The error index of DRIFT_ENERGY_ERROR.
 */
typedef uint32_t drift_index_t;

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
   0 or 1.
   */
  uint8_t has_shewhart;
  /*
   0 or 1.
   */
  uint8_t has_cusum;
  /*
   0 or 1.
   */
  uint8_t has_sprt;
  /*
   Instant.
   */
  struct drift_shewhart_t shewhart;
  /*
   Cumulative.
   */
  struct drift_cusum_t cusum;
  /*
   Sequential.
   */
  struct drift_sprt_t sprt;
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
  struct drift_channel_t channels[3];
} drift_config_t;

/*
 What a course amounts to, in rising severity.
 */
typedef uint8_t drift_verdict_t;

/*
 Where the deviation seems to be.
 */
typedef uint8_t drift_location_t;

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
   Ticks left out since the last decision: no sample.
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
  struct drift_channel_report_t channels[3];
} drift_report_t;

/*
 Why a tick brings no sample.
 */
typedef uint32_t drift_without_t;

/*
 All indices, three channels, of counts.
 */
typedef struct drift_full_i32_t {
  /*
   Not to be touched.
   */
  uint64_t words[DRIFT_FULL_I32_WORDS];
} drift_full_i32_t;

/*
 The paper's pair, E_u and IAE, of float samples.
 */
typedef struct drift_pair_t {
  /*
   Not to be touched.
   */
  uint64_t words[DRIFT_PAIR_WORDS];
} drift_pair_t;

/*
 The paper's pair, E_u and IAE, of counts.
 */
typedef struct drift_pair_i32_t {
  /*
   Not to be touched.
   */
  uint64_t words[DRIFT_PAIR_I32_WORDS];
} drift_pair_i32_t;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 Starts a monitor. The configuration is copied.

 # Safety
 Pointers that are neither null nor misaligned point to memory of their type.
 */
drift_code_t drift_full_init(struct drift_full_t *monitor, const struct drift_config_t *config);

/*
 One tick of the closed loop; DRIFT_REPORT once per hop.

 # Safety
 As for init; no other call uses the monitor at the same time.
 */
drift_code_t drift_full_tick(struct drift_full_t *monitor,
                             float r,
                             float y,
                             float u,
                             struct drift_report_t *report);

/*
 One tick without a sample: DRIFT_MANUAL or DRIFT_MISSING.

 # Safety
 As for tick.
 */
drift_code_t drift_full_tick_without(struct drift_full_t *monitor,
                                     drift_without_t why,
                                     struct drift_report_t *report);

/*
 Forgets alarms and courses, for a fault that was seen to.

 # Safety
 As for tick.
 */
drift_code_t drift_full_acknowledge(struct drift_full_t *monitor);

/*
 Saves the state into capacity bytes; the bytes used, or a negative code. 8*DRIFT_FULL_WORDS*2 always suffice.

 # Safety
 As for tick; into points to capacity writable bytes.
 */
drift_code_t drift_full_save(struct drift_full_t *monitor,
                             uint8_t *into,
                             uint32_t capacity);

/*
 Takes up a saved state, all of it or none.

 # Safety
 As for tick; from points to length readable bytes.
 */
drift_code_t drift_full_restore(struct drift_full_t *monitor, const uint8_t *from, uint32_t length);

/*
 Starts a monitor. The configuration is copied.

 # Safety
 Pointers that are neither null nor misaligned point to memory of their type.
 */
drift_code_t drift_full_i32_init(struct drift_full_i32_t *monitor,
                                 const struct drift_config_t *config);

/*
 One tick of the closed loop; DRIFT_REPORT once per hop.

 # Safety
 As for init; no other call uses the monitor at the same time.
 */
drift_code_t drift_full_i32_tick(struct drift_full_i32_t *monitor,
                                 int32_t r,
                                 int32_t y,
                                 int32_t u,
                                 struct drift_report_t *report);

/*
 One tick without a sample: DRIFT_MANUAL or DRIFT_MISSING.

 # Safety
 As for tick.
 */
drift_code_t drift_full_i32_tick_without(struct drift_full_i32_t *monitor,
                                         drift_without_t why,
                                         struct drift_report_t *report);

/*
 Forgets alarms and courses, for a fault that was seen to.

 # Safety
 As for tick.
 */
drift_code_t drift_full_i32_acknowledge(struct drift_full_i32_t *monitor);

/*
 Saves the state into capacity bytes; the bytes used, or a negative code. 8*DRIFT_FULL_I32_WORDS*2 always suffice.

 # Safety
 As for tick; into points to capacity writable bytes.
 */
drift_code_t drift_full_i32_save(struct drift_full_i32_t *monitor,
                                 uint8_t *into,
                                 uint32_t capacity);

/*
 Takes up a saved state, all of it or none.

 # Safety
 As for tick; from points to length readable bytes.
 */
drift_code_t drift_full_i32_restore(struct drift_full_i32_t *monitor,
                                    const uint8_t *from,
                                    uint32_t length);

/*
 Starts a monitor. The configuration is copied.

 # Safety
 Pointers that are neither null nor misaligned point to memory of their type.
 */
drift_code_t drift_pair_init(struct drift_pair_t *monitor, const struct drift_config_t *config);

/*
 One tick of the closed loop; DRIFT_REPORT once per hop.

 # Safety
 As for init; no other call uses the monitor at the same time.
 */
drift_code_t drift_pair_tick(struct drift_pair_t *monitor,
                             float r,
                             float y,
                             float u,
                             struct drift_report_t *report);

/*
 One tick without a sample: DRIFT_MANUAL or DRIFT_MISSING.

 # Safety
 As for tick.
 */
drift_code_t drift_pair_tick_without(struct drift_pair_t *monitor,
                                     drift_without_t why,
                                     struct drift_report_t *report);

/*
 Forgets alarms and courses, for a fault that was seen to.

 # Safety
 As for tick.
 */
drift_code_t drift_pair_acknowledge(struct drift_pair_t *monitor);

/*
 Saves the state into capacity bytes; the bytes used, or a negative code. 8*DRIFT_PAIR_WORDS*2 always suffice.

 # Safety
 As for tick; into points to capacity writable bytes.
 */
drift_code_t drift_pair_save(struct drift_pair_t *monitor,
                             uint8_t *into,
                             uint32_t capacity);

/*
 Takes up a saved state, all of it or none.

 # Safety
 As for tick; from points to length readable bytes.
 */
drift_code_t drift_pair_restore(struct drift_pair_t *monitor, const uint8_t *from, uint32_t length);

/*
 Starts a monitor. The configuration is copied.

 # Safety
 Pointers that are neither null nor misaligned point to memory of their type.
 */
drift_code_t drift_pair_i32_init(struct drift_pair_i32_t *monitor,
                                 const struct drift_config_t *config);

/*
 One tick of the closed loop; DRIFT_REPORT once per hop.

 # Safety
 As for init; no other call uses the monitor at the same time.
 */
drift_code_t drift_pair_i32_tick(struct drift_pair_i32_t *monitor,
                                 int32_t r,
                                 int32_t y,
                                 int32_t u,
                                 struct drift_report_t *report);

/*
 One tick without a sample: DRIFT_MANUAL or DRIFT_MISSING.

 # Safety
 As for tick.
 */
drift_code_t drift_pair_i32_tick_without(struct drift_pair_i32_t *monitor,
                                         drift_without_t why,
                                         struct drift_report_t *report);

/*
 Forgets alarms and courses, for a fault that was seen to.

 # Safety
 As for tick.
 */
drift_code_t drift_pair_i32_acknowledge(struct drift_pair_i32_t *monitor);

/*
 Saves the state into capacity bytes; the bytes used, or a negative code. 8*DRIFT_PAIR_I32_WORDS*2 always suffice.

 # Safety
 As for tick; into points to capacity writable bytes.
 */
drift_code_t drift_pair_i32_save(struct drift_pair_i32_t *monitor,
                                 uint8_t *into,
                                 uint32_t capacity);

/*
 Takes up a saved state, all of it or none.

 # Safety
 As for tick; from points to length readable bytes.
 */
drift_code_t drift_pair_i32_restore(struct drift_pair_i32_t *monitor,
                                    const uint8_t *from,
                                    uint32_t length);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* DRIFT_H */

/* Both sides agree on every size: the Rust side asserts the same numbers. */
typedef char drift_config_size_is_as_compiled[sizeof(drift_config_t) == DRIFT_CONFIG_BYTES ? 1 : -1];
typedef char drift_report_size_is_as_compiled[sizeof(drift_report_t) == DRIFT_REPORT_BYTES ? 1 : -1];
typedef char drift_pair_size_is_as_compiled[sizeof(drift_pair_t) == 8 * DRIFT_PAIR_WORDS ? 1 : -1];
typedef char drift_full_size_is_as_compiled[sizeof(drift_full_t) == 8 * DRIFT_FULL_WORDS ? 1 : -1];
