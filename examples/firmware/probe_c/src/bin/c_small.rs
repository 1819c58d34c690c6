//! `c_small` of `c/monitors.c` timed.
#![no_std]
#![no_main]

probe_c::timed!(f32, SMALLEST_F32, c_small_start, c_small_tick, c_small_without, c_small_bytes, curve: false);
