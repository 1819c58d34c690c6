//! The few functions that a hop may need; a tick needs none.
//!
//! Under feature `micromath` they are approximate. Its square root alone is up to 6.1 % too large; one Newton step
//! (a division) leaves 0.18 % at worst. What that does, as the tests here measure it:
//! * the prediction band (a root of 1 to 1.5): z is up to 0.03 % too small, for a well-known baseline not at all;
//! * a sigma learnt in place: up to 0.18 % too large, and with it a CUSUM designed for one false alarm in 465
//!   decisions realises up to 473.

#[cfg(not(any(feature = "libm", feature = "micromath")))]
compile_error!("drift-core needs a square root: enable feature `libm` (exact) or `micromath` (approximate)");

#[cfg(feature = "micromath")]
mod chosen {
    use micromath::F32Ext;
    pub fn sqrt(x: f32) -> f32 {
        if x.is_nan() || x <= 0.0 {
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::println;

    /// Worst relative error of the square root over `from..to`, and its sign.
    fn worst_sqrt(from: f64, to: f64) -> f64 {
        let error = |i: i32| {
            let x = (from * (to / from).powf(f64::from(i) / 20_000.0)) as f32;
            f64::from(sqrt(x)) / f64::from(x).sqrt() - 1.0
        };
        (0..20_000).map(error).fold(0.0, |worst: f64, e| if e.abs() > worst.abs() { e } else { worst })
    }

    /// Siegmund's two-sided mean run length of CUSUM(0.5, 5) when sigma is taken `factor` times too large.
    fn realised_arl0(factor: f64) -> f64 {
        let (d, b) = (-0.5 * factor, 5.0 * factor + 1.166);
        0.5 * ((-2.0 * d * b).exp() - 1.0 + 2.0 * d * b) / (2.0 * d * d)
    }

    #[test]
    fn the_error_of_the_square_root_and_what_it_does() {
        let band = worst_sqrt(1.0, 1.5);
        let sigma = worst_sqrt(1e-12, 1e12);
        let by_sigma = realised_arl0(1.0 + sigma) / realised_arl0(1.0) * 465.44;
        println!(
            "root of 1 to 1.5 is off by {band:.2e}, any root by {sigma:.2e}: ARL0 {by_sigma:.1} for 465.4"
        );
        assert_eq!(sqrt(1.0), 1.0, "a baseline known exactly is not biased at all");
        assert_eq!(sqrt(0.0), 0.0);
        #[cfg(not(feature = "micromath"))]
        assert!(band.abs() < 1e-7 && sigma.abs() < 1e-7);
        #[cfg(feature = "micromath")]
        {
            assert!((0.0..0.0003).contains(&band), "as this module's first lines say: {band}");
            assert!((0.0..0.0018).contains(&sigma), "{sigma}");
            assert!((465.0..474.0).contains(&by_sigma), "{by_sigma}");
        }
    }

    #[cfg(feature = "micromath")]
    #[test]
    fn micromath_alone_would_be_six_percent_off() {
        let error = |i: u16| {
            let x = 1.0 + f32::from(i) * 1e-3;
            micromath::F32Ext::sqrt(x) / x.sqrt() - 1.0
        };
        let worst = (0..3000).map(error).fold(0.0f32, f32::max);
        println!("micromath's own square root: up to {:.2} % too large", 100.0 * worst);
        assert!((0.0600..0.0615).contains(&worst), "{worst}");
    }
}
