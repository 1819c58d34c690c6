//! The few functions that a hop may need; a tick needs none.
//!
//! Under feature `micromath` they are approximate. Its square root alone is up to 6.1 % too large; one Newton step
//! (a division) leaves 0.18 % at worst. What that does, as the tests here measure it:
//! * the prediction band (a root of 1 to 1.5): z is up to 0.03 % too small, for a well-known baseline not at all;
//! * a sigma learnt in place: up to 0.18 % too large, and with it a CUSUM designed for one false alarm in 465
//!   decisions realises up to 472.

#[cfg(not(any(feature = "libm", feature = "micromath")))]
compile_error!("drift-core needs a square root: enable feature `libm` (exact) or `micromath` (approximate)");

#[cfg(feature = "micromath")]
mod chosen {
    use micromath::F32Ext;
    pub fn sqrt(x: f32) -> f32 {
        if !(x > 0.0) {
            // micromath's root of zero is not zero.
            return 0.0;
        }
        let root = F32Ext::sqrt(x);
        0.5 * (root + x / root)
    }
    pub fn exp(x: f32) -> f32 {
        F32Ext::exp(x)
    }
    pub fn ln(x: f32) -> f32 {
        F32Ext::ln(x)
    }
}

#[cfg(all(feature = "libm", not(feature = "micromath")))]
mod chosen {
    pub fn sqrt(x: f32) -> f32 {
        libm::sqrtf(x)
    }
    pub fn exp(x: f32) -> f32 {
        libm::expf(x)
    }
    pub fn ln(x: f32) -> f32 {
        libm::logf(x)
    }
}

#[cfg(any(feature = "libm", feature = "micromath"))]
pub(crate) use chosen::{exp, ln, sqrt};
