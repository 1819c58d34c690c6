//! The noise of a loop: a slow random load on its plant, and the noise of its sensor.
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Numbers of the noise. Both parts are first-order autoregressions: the load is held over each sample, white noise is on the sensor
/// besides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation of the load over that of the sensor's noise, in the unit of the drive over that of y.
    pub load_ratio: f64,
    /// Time constant of the load, in seconds.
    pub load_tau_s: f64,
    /// What stays of the sensor's noise from one sample to the next, between -1 and 1.
    pub sensor_rho: f64,
    /// Variance of the white noise on the sensor, as part of the coloured one's: [`WHITE`], or what rounding adds.
    pub sensor_white: f64,
    /// Factor on the sensor's noise from [`Noise::growth_from_s`] on.
    pub growth: f64,
    /// When the sensor's noise changes, in seconds.
    pub growth_from_s: f64,
}

/// The least variance of the white noise on the sensor, as part of the coloured one's: keeps the filter regular.
pub const WHITE: f64 = 1e-4;

impl Noise {
    /// What stays of the load from one sample to the next.
    pub fn load_phi(&self, sample_time_s: f64) -> f64 {
        libm::exp(-sample_time_s / self.load_tau_s)
    }

    /// The factor on the sensor's noise at a time.
    #[inline]
    pub fn growth_at(&self, t: f64) -> f64 {
        if t >= self.growth_from_s { self.growth } else { 1.0 }
    }
}

/// A first-order autoregression of this deviation.
pub(crate) fn sequence(samples: usize, deviation: f64, stays: f64, random: &mut ChaCha8Rng) -> Vec<f64> {
    let mut draw = || -> f64 { StandardNormal.sample(random) };
    let mut value = deviation * draw();
    let moves = deviation * libm::sqrt(1.0 - stays * stays);
    (0..samples)
        .map(|_| {
            let now = value;
            value = stays * value + moves * draw();
            now
        })
        .collect()
}
