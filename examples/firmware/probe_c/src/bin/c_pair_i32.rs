//! `c_pair_i32` of `c/monitors.c` timed.
#![no_std]
#![no_main]

probe_c::timed!(i32, PAIR_I32, c_pair_i32_start, c_pair_i32_tick, c_pair_i32_without, c_pair_i32_bytes, curve: true);
