//! The C interface: thin shims over `drift-core`, the only place with `unsafe`.
//!
//! * [`codes`]: return codes and the named numbers of a report. [`config`], [`report`]: structures that C sees.
//! * [`monitor`]: the opaque monitor; the functions that serve every kind. [`kinds`]: a row for each kind.
//! * [`commissioning`]: the baselines learnt in place. [`memory_commissioning`]: a channel that remembers.
#![no_std]
#![allow(non_camel_case_types)]

#[cfg(not(any(panic = "abort", debug_assertions)))]
compile_error!("panic = \"abort\" is needed: unwinding into C is undefined behaviour");

#[cfg(not(target_os = "none"))]
extern crate std;

pub mod codes;
pub mod commissioning;
pub mod config;
pub mod kinds;
pub mod memory_commissioning;
pub mod monitor;
pub mod report;

/// Reached by nothing: the archive holds no path to it, and `measure` looks.
#[cfg(target_os = "none")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
