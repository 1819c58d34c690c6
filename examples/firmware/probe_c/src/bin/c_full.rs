//! `c_full` of `c/monitors.c` timed.
#![no_std]
#![no_main]

probe_c::timed!(f32, ALL_F32, c_full_start, c_full_tick, c_full_without, c_full_bytes, curve: true);
