//! The few functions that a hop may need; a tick needs none.
//!
//! Under feature `micromath` they are approximate: its square root is up to 6.1 % off, so a standardised residual
//! is up to 6.1 % off, and a CUSUM designed for one false alarm in 465 decisions realises between 250 and 900.

#[cfg(not(any(feature = "libm", feature = "micromath")))]
compile_error!("drift-core needs a square root: enable feature `libm` (exact) or `micromath` (approximate)");

#[cfg(feature = "micromath")]
mod chosen {
    use micromath::F32Ext;
    pub fn sqrt(x: f32) -> f32 {
        F32Ext::sqrt(x)
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
