//! A wave that feedback conceals: the error stays small, and u pays. It stands out in u as a line of which the reference has nothing. Of an unknown plant nearly
//! all that u does may be its answer to the wave: beside nothing such a plant is identified from the wrong motion.

use crate::diagnose::spectrum::{peaks, share_about};
use crate::estimate::signals::Signals;
use crate::physics::Term;

/// Part of u's power that a line has at least, and of r's power that it has at most. (Of 50 generated loops of unknown plants one has such a line: the one on which a
/// wave was left out; the next have 0.3 of u's power, or stand in r with 0.3 of its own.)
const OF_U: f64 = 0.5;
const OF_R: f64 = 0.1;

/// The load whose wave u pays for, in u's own unit; `None` where no line stands out.
pub fn of(recordings: &[Signals]) -> Option<Term> {
    let signals = recordings.first()?;
    let (near, _) = *peaks(&signals.u, 1).first()?;
    let is_paid_for = share_about(&signals.u, near) > OF_U && share_about(&signals.r, near) < OF_R;
    let frequency = is_paid_for.then(|| finer(&signals.u, near))?;
    let [sine, cosine] = parts(&signals.u, frequency);
    let (amplitude, phase) = (libm::hypot(sine, cosine), libm::atan2(cosine, sine));
    let hz = frequency / signals.sample_time_s;
    Term::new("periodic_load", &[("amplitude", amplitude), ("frequency_hz", hz), ("phase", phase)]).ok()
}

/// Frequencies tried about a peak of the spectrum, half a cycle over the recording to either side.
const FINER: i32 = 10;

/// The frequency about a peak at which a signal's wave is largest.
fn finer(x: &[f64], near: f64) -> f64 {
    let step = 0.5 / f64::from(FINER) / x.len().max(1) as f64;
    let size = |frequency: f64| {
        let [sine, cosine] = parts(x, frequency);
        libm::hypot(sine, cosine)
    };
    let tried =
        (-FINER..=FINER).map(|k| near + f64::from(k) * step).map(|frequency| (size(frequency), frequency));
    tried.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(near, |(_, frequency)| frequency)
}

/// The sizes of a signal's sine and cosine at a frequency, in cycles per sample.
fn parts(x: &[f64], frequency: f64) -> [f64; 2] {
    let n = x.len().max(1) as f64;
    let mean = x.iter().sum::<f64>() / n;
    [libm::sin, libm::cos].map(|wave| {
        let products = x.iter().zip(0_u32..);
        products
            .map(|(x, k)| (x - mean) * wave(std::f64::consts::TAU * frequency * f64::from(k)))
            .sum::<f64>()
            * 2.0
            / n
    })
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    use super::of;
    use crate::estimate::noise::sequence;
    use crate::estimate::signals::Signals;

    const SAMPLES: usize = 4_000;

    fn wave(size: f64, hz: f64, phase: f64) -> impl Fn(usize) -> f64 {
        move |n| size * libm::sin(std::f64::consts::TAU * hz * 0.01 * n as f64 + phase)
    }

    /// A reference of 0.1 Hz, and a u that moves by it, by noise, and by what is asked for.
    fn signals(also: impl Fn(usize) -> f64) -> Signals {
        let noise = sequence(SAMPLES, 0.5, 0.0, &mut ChaCha8Rng::seed_from_u64(2));
        let r: Vec<f64> = (0..SAMPLES).map(wave(1.0, 0.1, 0.0)).collect();
        let u = r.iter().zip(noise).enumerate().map(|(n, (r, noise))| r + noise + also(n));
        Signals { sample_time_s: 0.01, u: u.collect(), y: r.clone(), r, ..Signals::default() }
    }

    #[test]
    fn a_line_that_the_reference_has_not_is_a_load_that_u_pays_for() {
        let term = of(&[signals(wave(5.0, 0.26, 0.7))]).unwrap();
        let [amplitude, hz, phase] = term.parameters.as_slice() else { panic!("{term:?}") };
        assert!((amplitude / 5.0 - 1.0).abs() < 0.05 && (hz / 0.26 - 1.0).abs() < 0.02, "{term:?}");
        assert!((phase - 0.7).abs() < 0.3, "{term:?}");
    }

    #[test]
    fn what_the_reference_asks_for_and_what_is_no_line_are_none() {
        assert_eq!(of(&[signals(|_| 0.0)]), None);
        let wandering = sequence(SAMPLES, 5.0, 0.99, &mut ChaCha8Rng::seed_from_u64(3));
        assert_eq!(of(&[signals(|n| wandering[n])]), None);
        assert_eq!(of(&[Signals::default()]), None);
        assert_eq!(of(&[]), None);
    }
}
