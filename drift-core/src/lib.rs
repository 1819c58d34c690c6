//! Tells drift from disturbance inside a feedback loop.
#![no_std]
#![forbid(unsafe_code)]
