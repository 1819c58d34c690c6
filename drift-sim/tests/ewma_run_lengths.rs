//! The EWMA's exact run lengths against two published tables, and the shipped detector against them by Monte Carlo.
//!
//! Six digits: SAS/QC 12.1 User's Guide, EWMAARL function (Crowder's method) and its example 9.5. Three digits: the values of Lucas &
//! Saccucci (1990) in the form in which textbooks reprint them; the original page was not at hand.

use drift_core::{Detector, DetectorState, EwmaState};
use drift_sim::design::Ewma;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// (lambda, L), all with about one false alarm in 500.
const CHARTS: [(f64, f64); 5] = [(0.4, 3.054), (0.25, 2.998), (0.2, 2.962), (0.1, 2.814), (0.05, 2.615)];
/// Shift, then the published mean run length of each chart.
const TABLE: [(f64, [f64; 5]); 10] = [
    (0.0, [500.0, 500.0, 500.0, 500.0, 500.0]),
    (0.25, [224.0, 170.0, 150.0, 106.0, 84.1]),
    (0.5, [71.2, 48.2, 41.8, 31.3, 28.8]),
    (0.75, [28.4, 20.1, 18.2, 15.9, 16.4]),
    (1.0, [14.3, 11.1, 10.5, 10.3, 11.4]),
    (1.5, [5.9, 5.5, 5.5, 6.1, 7.1]),
    (2.0, [3.5, 3.6, 3.7, 4.4, 5.2]),
    (2.5, [2.5, 2.7, 2.9, 3.4, 4.2]),
    (3.0, [2.0, 2.3, 2.4, 2.9, 3.5]),
    (4.0, [1.4, 1.7, 1.9, 2.2, 2.7]),
];

/// Shift, then the mean run length for weights of 0.25, 0.5, 0.75 and 1 at L = 3.
const SAS: [(f64, [f64; 4]); 4] = [
    (0.5, [48.453, 75.354, 110.950, 155.224]),
    (1.0, [11.1543, 15.7378, 25.6391, 43.8947]),
    (1.5, [5.4697, 6.1111, 8.7201, 14.9677]),
    (2.0, [3.61677, 3.46850, 4.15346, 6.30296]),
];

#[test]
fn the_table_of_sas_to_its_last_digit() {
    for (shift, row) in SAS {
        for (lambda, published) in [0.25, 0.5, 0.75, 1.0].into_iter().zip(row) {
            let arl = Ewma::with_l(lambda, 3.0).unwrap().arl(shift);
            assert!((arl / published - 1.0).abs() < 1.5e-5, "{lambda} {shift}: {arl}, published {published}");
        }
    }
    // EWMAARL(1.00, 0.25, 3.0).
    assert!((Ewma::with_l(0.25, 3.0).unwrap().arl(1.0) - 11.154267016).abs() < 1e-6);
}

#[test]
fn the_published_table() {
    for (shift, published) in TABLE {
        for ((lambda, l), published) in CHARTS.into_iter().zip(published) {
            let arl = Ewma::with_l(lambda, l).unwrap().arl(shift);
            // Three digits, one decimal at most, and L itself is rounded.
            let tolerance = (0.01 * published).max(0.06);
            assert!(
                (arl - published).abs() < tolerance,
                "lambda {lambda}, shift {shift}: {arl:.3}, published {published}"
            );
        }
    }
}

#[test]
fn the_limit_follows_from_the_wanted_run_length() {
    for lambda in [0.02, 0.1, 0.4, 1.0] {
        for arl0 in [50.0, 500.0, 1e5] {
            let chart = Ewma::with_arl0(lambda, arl0).unwrap();
            assert!((chart.arl(0.0) / arl0 - 1.0).abs() < 1e-6, "{lambda} {arl0}: {}", chart.arl(0.0));
        }
    }
    // Without memory it is a Shewhart chart: 1/P(|z| > 3).
    assert!((Ewma::new(1.0, 3.0).unwrap().arl(0.0) - 370.3983).abs() < 1e-3);
    assert!(
        Ewma::new(0.0, 1.0).is_err()
            && Ewma::new(0.1, f64::NAN).is_err()
            && Ewma::with_arl0(0.1, 0.5).is_err()
    );
}

/// The detector of the controller, in f32: mean run length within four standard errors, and the share of alarms within 15 decisions.
#[test]
fn the_shipped_detector_has_the_exact_run_lengths() {
    let runs = 20_000u64;
    for (lambda, shift) in [(0.1, 0.0), (0.1, 1.0), (0.25, 0.5), (0.4, 2.0)] {
        let chart = Ewma::with_arl0(lambda, 100.0).unwrap();
        let detector = drift_core::Ewma::new(lambda as f32, chart.limit() as f32);
        let run = |seed: u64| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut state = EwmaState::ZERO;
            let mut z = || -> f64 { StandardNormal.sample(&mut rng) };
            (1..).find(|_| detector.update(&mut state, (z() + shift) as f32).is_some()).unwrap()
        };
        let lengths: Vec<u64> = (0..runs).into_par_iter().map(run).collect();
        let mean = lengths.iter().sum::<u64>() as f64 / runs as f64;
        let variance = lengths.iter().map(|n| (*n as f64 - mean).powi(2)).sum::<f64>() / runs as f64;
        let error = (variance / runs as f64).sqrt();
        let arl = chart.arl(shift);
        assert!(
            (mean - arl).abs() < 4.0 * error,
            "lambda {lambda}, shift {shift}: {mean} +- {error}, exact {arl}"
        );
        let within = lengths.iter().filter(|n| **n <= 15).count() as f64 / runs as f64;
        let exact = chart.alarm_within(shift, 15);
        assert!(
            (within - exact).abs() < 0.015,
            "lambda {lambda}, shift {shift}: {within} within 15, exact {exact}"
        );
    }
}
