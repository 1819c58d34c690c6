//! What the tests in `tests/` share, and the Rust of README and book as doc tests.

pub mod markdown;

/// The pages that hold Rust; a test sees to it that none is missing here.
#[cfg(doctest)]
mod pages {
    #[doc = include_str!("../../README.md")]
    struct Readme;
    #[doc = include_str!("../../docs/firmware.md")]
    struct Firmware;
}
