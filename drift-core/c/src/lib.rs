//! The C interface: thin shims over `drift-core`, the only place with `unsafe`.
//!
//! * [`codes`]: return codes and the named numbers of a report. [`config`], [`report`]: structures that C sees.
//! * [`handle`]: the opaque monitor; what is checked before every use.
//! * [`pair`], [`full`], [`pair_i32`], [`full_i32`]: the exported functions of the four kinds of monitor.
#![no_std]
#![allow(non_camel_case_types)]

#[cfg(not(panic = "abort"))]
compile_error!("panic = \"abort\" is needed: unwinding into C is undefined behaviour");

#[cfg(not(target_os = "none"))]
extern crate std;

pub mod codes;
pub mod config;
pub mod full;
pub mod full_i32;
pub mod handle;
pub mod pair;
pub mod pair_i32;
pub mod report;

/// Reached by nothing: the archive holds no path to it, and `measure` looks.
#[cfg(target_os = "none")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
