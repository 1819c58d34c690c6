//! Return codes and the named numbers of configurations and reports.

use drift_core::{ChannelKind, ConfigError, StateError};

/// What a function returns: zero or above is good.
pub type drift_code_t = i32;
/// Done; no report at this tick.
pub const DRIFT_OK: i32 = 0;
/// Done; the report is filled in.
pub const DRIFT_REPORT: i32 = 1;
/// A pointer is null.
pub const DRIFT_NULL: i32 = -1;
/// A pointer is not aligned as its type needs.
pub const DRIFT_MISALIGNED: i32 = -2;
/// The monitor was not initialised.
pub const DRIFT_NOT_INITIALISED: i32 = -3;
/// The configuration holds a number that is not positive, not finite or out of range.
pub const DRIFT_BAD_CONFIG: i32 = -4;
/// Blocks are longer than their sums can hold.
pub const DRIFT_BLOCK_TOO_LONG: i32 = -5;
/// More than DRIFT_BLOCKS blocks per window (64 where windows can't overlap).
pub const DRIFT_TOO_MANY_BLOCKS: i32 = -6;
/// A channel needs an index that this kind of monitor does not keep; use drift_full_init.
pub const DRIFT_INDEX_NOT_KEPT: i32 = -7;
/// The buffer is too small for the state, or the memory for the monitor.
pub const DRIFT_BUFFER_TOO_SMALL: i32 = -8;
/// The saved state is cut short.
pub const DRIFT_TORN: i32 = -9;
/// These bytes are no saved state.
pub const DRIFT_NOT_A_STATE: i32 = -10;
/// Saved by another version of the layout.
pub const DRIFT_VERSION: i32 = -11;
/// The saved state is damaged.
pub const DRIFT_CHECKSUM: i32 = -12;
/// Saved by another kind of monitor.
pub const DRIFT_OTHER_MONITOR: i32 = -13;
/// Saved under another configuration.
pub const DRIFT_OTHER_CONFIG: i32 = -14;
/// The saved state holds an impossible value.
pub const DRIFT_IMPOSSIBLE: i32 = -15;

/// A monitor of counts was given floats, or the other way round.
pub const DRIFT_OTHER_NUMBER: i32 = -16;
/// The configuration asks for what this kind of monitor leaves out; use a larger kind.
pub const DRIFT_NOT_LINKED: i32 = -17;
/// Commissioning has seen fewer healthy windows than a baseline needs.
pub const DRIFT_TOO_FEW_WINDOWS: i32 = -18;
/// An index does not scatter while it is learnt: the loop stands still, or a sensor is stuck.
pub const DRIFT_NO_SCATTER: i32 = -19;
/// The operating point stands still while it is learnt, or goes with the channel's x alone.
pub const DRIFT_POINT_STANDS_STILL: i32 = -20;

/// The version, as the crate's.
pub const DRIFT_VERSION_MAJOR: u32 = 0;
/// See DRIFT_VERSION_MAJOR.
pub const DRIFT_VERSION_MINOR: u32 = 1;
/// See DRIFT_VERSION_MAJOR.
pub const DRIFT_VERSION_PATCH: u32 = 0;
const _: () = assert!(
    number(env!("CARGO_PKG_VERSION_MAJOR")) == DRIFT_VERSION_MAJOR
        && number(env!("CARGO_PKG_VERSION_MINOR")) == DRIFT_VERSION_MINOR
        && number(env!("CARGO_PKG_VERSION_PATCH")) == DRIFT_VERSION_PATCH
);

const fn number(text: &str) -> u32 {
    let (bytes, mut i, mut number) = (text.as_bytes(), 0, 0);
    while i < bytes.len() {
        number = number * 10 + (bytes[i] - b'0') as u32;
        i += 1;
    }
    number
}

/// What a channel compares.
pub type drift_kind_t = u32;
/// The error index against the control energy.
pub const DRIFT_ENERGY_ERROR: u32 = 0;
/// Mean u against mean y.
pub const DRIFT_EFFORT: u32 = 1;
/// Mean of u sign(dy) against the speed.
pub const DRIFT_MOTION_EFFORT: u32 = 2;
/// The control energy against the reference's own activity.
pub const DRIFT_ACTIVITY: u32 = 3;

// As the table of kinds has them: a kind that is missing here does not compile.
const KINDS: [(&str, u32); ChannelKind::ROWS.len()] = [
    ("energy_error", DRIFT_ENERGY_ERROR),
    ("effort", DRIFT_EFFORT),
    ("motion_effort", DRIFT_MOTION_EFFORT),
    ("activity", DRIFT_ACTIVITY),
];
const _: () = {
    let mut i = 0;
    while i < KINDS.len() {
        let row = &ChannelKind::ROWS[i];
        assert!(same(row.name, KINDS[i].0) && row.kind.number() == KINDS[i].1);
        i += 1;
    }
};

const fn same(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut i = 0;
    while i < a.len() && i < b.len() && a[i] == b[i] {
        i += 1;
    }
    i == a.len() && i == b.len()
}

/// The error index of DRIFT_ENERGY_ERROR.
pub type drift_index_t = u32;
/// Integral of |e|.
pub const DRIFT_IAE: u32 = 0;
/// Integral of e^2.
pub const DRIFT_ISE: u32 = 1;
/// Integral of t |e|.
pub const DRIFT_ITAE: u32 = 2;
/// Integral of t e^2.
pub const DRIFT_ITSE: u32 = 3;

/// What a course amounts to, in rising severity.
pub type drift_verdict_t = u8;
/// On the baseline.
pub const DRIFT_HEALTHY: u8 = 0;
/// At this decision a deviation ended before it could be called drift.
pub const DRIFT_DISTURBANCE: u8 = 1;
/// At this decision a confirmed drift ended.
pub const DRIFT_RECOVERED: u8 = 2;
/// An alarm was raised; not yet known which.
pub const DRIFT_SUSPECT: u8 = 3;
/// Away from the baseline to stay.
pub const DRIFT_DRIFT: u8 = 4;

/// To which side something moved.
pub type drift_side_t = u8;
/// To none.
pub const DRIFT_SIDE_NONE: u8 = 0;
/// Above the baseline.
pub const DRIFT_SIDE_HIGH: u8 = 1;
/// Below it.
pub const DRIFT_SIDE_LOW: u8 = 2;

/// Where the deviation seems to be.
pub type drift_location_t = u8;
/// No channel is away.
pub const DRIFT_NOWHERE: u8 = 0;
/// Only the effort.
pub const DRIFT_OPERATING_POINT: u8 = 1;
/// Only the effort along the motion.
pub const DRIFT_FRICTION: u8 = 2;
/// Only the activity.
pub const DRIFT_DYNAMICS: u8 = 3;
/// Only the energy-error relation.
pub const DRIFT_TRACKING: u8 = 4;
/// Several.
pub const DRIFT_SEVERAL: u8 = 5;

/// How a refitted curve differs from the baseline.
pub type drift_moved_t = u8;
/// Too few windows yet.
pub const DRIFT_MOVED_UNDECIDED: u8 = 0;
/// Lifted or lowered.
pub const DRIFT_MOVED_INTERCEPT: u8 = 1;
/// Tilted.
pub const DRIFT_MOVED_SLOPE: u8 = 2;
/// Both.
pub const DRIFT_MOVED_BOTH: u8 = 3;

/// Why a tick brings no sample.
pub type drift_without_t = u32;
/// The loop is open or in manual mode.
pub const DRIFT_MANUAL: u32 = 0;
/// No sample arrived.
pub const DRIFT_MISSING: u32 = 1;

pub(crate) fn of_config(error: ConfigError) -> i32 {
    match error {
        ConfigError::BlockTooLong => DRIFT_BLOCK_TOO_LONG,
        ConfigError::TooManyBlocks => DRIFT_TOO_MANY_BLOCKS,
        ConfigError::IndexNotKept(_) => DRIFT_INDEX_NOT_KEPT,
        ConfigError::NotLinked(_) => DRIFT_NOT_LINKED,
        _ => DRIFT_BAD_CONFIG,
    }
}

pub(crate) fn of_state(error: StateError) -> i32 {
    match error {
        StateError::BufferTooSmall => DRIFT_BUFFER_TOO_SMALL,
        StateError::Torn => DRIFT_TORN,
        StateError::NotAState => DRIFT_NOT_A_STATE,
        StateError::Version => DRIFT_VERSION,
        StateError::Checksum => DRIFT_CHECKSUM,
        StateError::OtherMonitor => DRIFT_OTHER_MONITOR,
        StateError::OtherConfig => DRIFT_OTHER_CONFIG,
        StateError::Impossible => DRIFT_IMPOSSIBLE,
    }
}
