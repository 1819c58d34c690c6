//! Spectra of real signals of one length, padded with zeros.

use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

/// The transform there and back.
pub struct Spectrum {
    forward: Arc<dyn RealToComplex<f64>>,
    back: Arc<dyn ComplexToReal<f64>>,
}

impl Spectrum {
    /// Of signals of so many samples, of which two are convolved without one's end meeting the other's beginning.
    pub fn convolving(samples: usize) -> Self {
        Self::holding(2 * samples)
    }

    /// Of signals of at most so many samples.
    pub fn holding(samples: usize) -> Self {
        let two = samples.next_power_of_two();
        // Three quarters of a power of two are transformed about as fast.
        let size = if two >= 8 && 3 * (two / 4) >= samples { 3 * (two / 4) } else { two };
        let mut planner = RealFftPlanner::<f64>::new();
        Self { forward: planner.plan_fft_forward(size), back: planner.plan_fft_inverse(size) }
    }

    /// A signal's spectrum.
    pub fn of(&self, x: &[f64]) -> Option<Vec<Complex<f64>>> {
        let mut padded = x.to_vec();
        padded.resize(self.forward.len(), 0.0);
        let mut out = self.forward.make_output_vec();
        self.forward.process(&mut padded, &mut out).ok()?;
        Some(out)
    }

    /// Periods in a sample at a place of a spectrum, between two of its values as well.
    pub fn per_sample(&self, place: f64) -> f64 {
        place / self.forward.len() as f64
    }

    /// The place of so many periods in a sample.
    pub fn place(&self, per_sample: f64) -> usize {
        libm::ceil(per_sample * self.forward.len() as f64) as usize
    }

    /// How much each of a spectrum's values counts in sums over its signal's samples (Parseval): all but the ends stand for two.
    pub fn weight(&self, place: usize) -> f64 {
        let size = self.forward.len();
        let is_end = place == 0 || 2 * place == size;
        if is_end { 1.0 / size as f64 } else { 2.0 / size as f64 }
    }

    /// A spectrum's signal.
    pub fn signal(&self, mut x: Vec<Complex<f64>>) -> Option<Vec<f64>> {
        // Rounding may leave an imaginary part where none can be.
        if let Some(first) = x.first_mut() {
            first.im = 0.0;
        }
        if let Some(last) = x.last_mut() {
            last.im = 0.0;
        }
        let mut out = self.back.make_output_vec();
        self.back.process(&mut x, &mut out).ok()?;
        let size = out.len() as f64;
        out.iter_mut().for_each(|x| *x /= size);
        Some(out)
    }
}
