//! `c_pair` of `c/monitors.c` timed.
#![no_std]
#![no_main]

probe_c::timed!(f32, PAIR_F32, c_pair_start, c_pair_tick, c_pair_without, c_pair_bytes, curve: true);
