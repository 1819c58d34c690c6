//! What the monitor's cost is held against: a PI tick, one biquad section, another crate's CUSUM.

use biquad::{Biquad, Coefficients, DirectForm2Transposed};
use nexus_stats_core::detection::CusumF64;
use scenario::pi::{Pi, PiCounts};

/// The ruler: a call with the same arguments that does nothing.
#[inline(never)]
pub fn nothing(r: f32, y: f32, u: f32) -> f32 {
    core::hint::black_box(());
    let _ = (r, y);
    u
}

/// The ruler in counts.
#[inline(never)]
pub fn nothing_counts(r: i32, y: i32, u: i32) -> i32 {
    core::hint::black_box(());
    let _ = (r, y);
    u
}

/// A PI tick with clipping and anti-windup.
#[inline(never)]
pub fn pi_tick(pi: &mut Pi, r: f32, y: f32) -> f32 {
    pi.tick(r, y)
}

/// The same in counts.
#[inline(never)]
pub fn pi_counts_tick(pi: &mut PiCounts, r: i32, y: i32) -> i32 {
    pi.tick(r, y)
}

/// One second-order section.
pub type Section = DirectForm2Transposed<f32>;

/// A low-pass.
pub const SECTION: Section =
    Section::new(Coefficients { a1: -1.561, a2: 0.6414, b0: 0.0201, b1: 0.0402, b2: 0.0201 });

/// One sample through it.
#[inline(never)]
pub fn section_run(section: &mut Section, e: f32) -> f32 {
    section.run(e)
}

/// nexus-stats, the nearest other no_std detector; it is f64 only.
pub fn nexus() -> Option<CusumF64> {
    CusumF64::builder(0.0).slack(0.5).threshold(5.0).build().ok()
}

/// One sample through it.
#[inline(never)]
pub fn nexus_update(cusum: &mut CusumF64, e: f32) -> bool {
    matches!(cusum.update(f64::from(e)), Ok(Some(d)) if d != nexus_stats_core::Direction::Neutral)
}
