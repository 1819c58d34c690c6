//! Peaks: frequencies over time and periods over position, for the terms that a gradient can't find.

use realfft::RealFftPlanner;

/// Amplitudes of the signal less its mean under a Hann window (against leakage of slow motion), zero-padded for a finer grid; none
/// for less than 16 samples.
fn windowed(signal: &[f64]) -> Vec<f64> {
    let n = signal.len();
    if n < 16 {
        return Vec::new();
    }
    let mean = signal.iter().sum::<f64>() / n as f64;
    let length = (2 * n).next_power_of_two();
    let mut padded: Vec<f64> = signal
        .iter()
        .enumerate()
        .map(|(i, x)| {
            let phase = std::f64::consts::TAU * i as f64 / n as f64;
            (x - mean) * (0.5 - 0.5 * libm::cos(phase))
        })
        .collect();
    padded.resize(length, 0.0);
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let mut spectrum = transform.make_output_vec();
    if transform.process(&mut padded, &mut spectrum).is_err() {
        return Vec::new();
    }
    spectrum.iter().map(|c| c.norm() * 4.0 / n as f64).collect()
}

/// The share of a spectrum's power in the places that are meant; `None` of one without power.
fn share(size: &[f64], is_meant: impl Fn(usize) -> bool) -> Option<f64> {
    let whole: f64 = size.iter().map(|size| size * size).sum();
    let meant: f64 = size.iter().enumerate().filter(|(i, _)| is_meant(*i)).map(|(_, size)| size * size).sum();
    (whole > 0.0).then(|| meant / whole)
}

/// Cycles over the whole signal within which a sine has its power under the window.
const OF_A_SINE: f64 = 2.5;

/// The share of a signal's power that is about a frequency, in cycles per sample; 0 of one that never changes.
pub fn share_about(signal: &[f64], frequency: f64) -> f64 {
    let size = windowed(signal);
    let samples = 2.0 * size.len() as f64;
    let width = OF_A_SINE / signal.len().max(1) as f64;
    share(&size, |i| (i as f64 / samples - frequency).abs() <= width).unwrap_or(0.0)
}

/// Frequencies (cycles per sample) and amplitudes of the strongest separate peaks, strongest first.
pub fn peaks(signal: &[f64], most: usize) -> Vec<(f64, f64)> {
    let n = signal.len();
    let size = windowed(signal);
    let length = 2 * size.len().saturating_sub(1);
    let mut found: Vec<(f64, f64)> = size
        .windows(3)
        .enumerate()
        .filter(|(_, w)| w[1] > w[0] && w[1] >= w[2])
        .map(|(i, w)| ((i + 1) as f64 / length as f64, w[1]))
        .filter(|(f, _)| *f * n as f64 > 1.5)
        .collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut kept: Vec<(f64, f64)> = Vec::new();
    for (f, a) in found {
        if kept.iter().all(|(other, _)| (f - other).abs() * n as f64 > 2.0) {
            kept.push((f, a));
        }
        if kept.len() == most {
            break;
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_of_two_sines_has_its_own_share() {
        let sine = |period: f64| move |i: u32| libm::sin(std::f64::consts::TAU * f64::from(i) / period);
        let (slow, fast) = (sine(400.0), sine(50.0));
        let both: Vec<f64> = (0..4000).map(|i| 2.0 * slow(i) + fast(i)).collect();
        assert!((share_about(&both, 1.0 / 400.0) - 0.8).abs() < 0.01);
        assert!((share_about(&both, 1.0 / 50.0) - 0.2).abs() < 0.01);
        assert!(share_about(&both, 1.0 / 100.0) < 0.001);
        assert_eq!(share_about(&[3.0; 100], 0.1), 0.0);
    }

    #[test]
    fn a_sine_is_found_with_its_frequency_and_amplitude() {
        let signal: Vec<f64> = (0..5000).map(|i| 3.0 * libm::sin(0.1234 * i as f64 + 1.0) + 7.0).collect();
        let (f, a) = peaks(&signal, 1)[0];
        assert!((f * std::f64::consts::TAU - 0.1234).abs() < 2e-4);
        assert!((a - 3.0).abs() < 0.2, "{a}");
    }
}
