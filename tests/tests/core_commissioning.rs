//! The baseline learnt in place: against ordinary least squares in f64, and what so few windows can promise.

use drift_core::{
    Channel, ChannelKind, Commissioning, Config, Cusum, Detectors, Iae, Index, NotReady, PairMonitor,
    honest_arl0,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const KIND: ChannelKind = ChannelKind::EnergyError(Index::Iae);
/// One tick is one window: x = u^2, value = |e|.
const CONFIG: Config<f32, 1> = Config::new(1.0, 1, 1, [Channel::unlearned(KIND)]);

/// b0, b1 and residual standard deviation by the closed form, in f64.
fn least_squares(points: &[(f32, f32)]) -> (f64, f64, f64) {
    let n = points.len() as f64;
    let points: Vec<(f64, f64)> = points.iter().map(|&(x, v)| (f64::from(x), f64::from(v))).collect();
    let (mx, mv) = points.iter().fold((0.0, 0.0), |(a, b), (x, v)| (a + x / n, b + v / n));
    let sxx: f64 = points.iter().map(|(x, _)| (x - mx).powi(2)).sum();
    let b1 = points.iter().map(|(x, v)| (x - mx) * (v - mv)).sum::<f64>() / sxx;
    let b0 = mv - b1 * mx;
    let ss: f64 = points.iter().map(|(x, v)| (v - b0 - b1 * x).powi(2)).sum();
    (b0, b1, (ss / (n - 2.0)).sqrt())
}

/// Learns from `windows` windows on the line 2 + 0.5 x with this scatter; what was learnt, and the points.
fn learn(windows: usize, sigma: f32, seed: u64) -> (Commissioning<1>, Vec<(f32, f32)>) {
    let mut monitor = PairMonitor::<f32, Iae, 1>::new(CONFIG).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut learning = Commissioning::<1>::new();
    let mut points = Vec::new();
    for _ in 0..windows {
        let x: f32 = rng.random_range(4.0..16.0);
        let noise: f32 = StandardNormal.sample(&mut rng);
        let report = *monitor.tick(2.0 + 0.5 * x + sigma * noise, 0.0, x.sqrt()).unwrap();
        points.push((report.channels[0].x, report.channels[0].value));
        learning.learn(&report);
    }
    (learning, points)
}

/// From a scatter as large as the line's own reach (R^2 about 0.5) down to a millionth of it.
#[test]
fn the_learnt_baseline_is_that_of_least_squares() {
    for sigma in [2.0f32, 0.05, 1e-3, 2e-5] {
        for windows in [25, 100, 400, 2000] {
            let (learning, points) = learn(windows, sigma, windows as u64);
            let baseline = learning.baselines().unwrap()[0];
            let (b0, b1, s) = least_squares(&points);
            let near = |got: f32, want: f64, tolerance: f64| (f64::from(got) - want).abs() < tolerance;
            // What is left is far below what a detector sees, or a millionth of the values (2 to 10) themselves.
            let fine = near(baseline.b0, b0, 0.02 * s + 1e-6 * 10.0)
                && near(12.0 * baseline.b1, 12.0 * b1, 0.02 * s + 1e-6 * 10.0);
            assert!(fine, "sigma {sigma}, {windows} windows: {baseline:?} instead of {b0} {b1}");
            assert!(
                (f64::from(baseline.sigma) / s - 1.0).abs() < 0.02,
                "sigma {} instead of {s}",
                baseline.sigma
            );
            assert_eq!(baseline.windows, windows as f32);
            let x = points.iter().map(|p| p.0);
            assert_eq!(baseline.x_min, x.clone().fold(f32::MAX, f32::min));
            assert_eq!(baseline.x_max, x.fold(f32::MIN, f32::max));
        }
    }
}

/// Mean run lengths that nine of ten devices keep, simulated for CUSUM(0.5, 5) with mean and sigma estimated from
/// m windows.
#[test]
fn the_promised_run_length_is_the_simulated_one() {
    let cusum = Cusum::new(0.5, 5.0);
    for (windows, ten_percent) in
        [(25, 51.0), (30, 61.0), (50, 95.0), (100, 156.0), (200, 222.0), (500, 299.0), (1000, 344.0f32)]
    {
        let promised = honest_arl0(&cusum, windows);
        println!("{windows:5} windows: promised {promised:6.1}, simulated {ten_percent}");
        assert!(
            (promised / ten_percent - 1.0).abs() < 0.05,
            "{windows}: {promised} instead of {ten_percent}"
        );
    }
    assert!((honest_arl0(&cusum, 100_000_000) / 465.44 - 1.0).abs() < 0.02, "the exactly known baseline");
    assert_eq!(honest_arl0(&cusum, 24), 0.0);
}

#[test]
fn too_few_windows_give_no_baseline() {
    let (learning, _) = learn(24, 0.05, 1);
    let refused = NotReady::TooFewWindows { windows: 24, needed: 25 };
    assert_eq!(learning.baselines(), Err(refused));
    assert_eq!(learning.channels([KIND], Detectors::NONE), Err(refused));
    assert_eq!(refused.to_string(), "24 healthy windows so far, at least 25 are needed");
}

/// Windows that could not be judged teach nothing.
#[test]
fn windows_without_enough_samples_are_passed_over() {
    let mut monitor = PairMonitor::<f32, Iae, 1>::new(CONFIG).unwrap();
    let mut learning = Commissioning::<1>::new();
    for _ in 0..100 {
        learning.learn(monitor.tick(f32::NAN, 0.0, 0.0).unwrap());
    }
    assert_eq!(learning.windows(), 0);
}

/// The commissioned monitor's residuals have unit variance on new healthy windows.
#[test]
fn the_commissioned_monitor_standardises_its_residuals() {
    let (learning, _) = learn(200, 0.05, 7);
    let detectors = Detectors { cusum: Some(Cusum::new(0.5, 5.0)), ..Detectors::NONE };
    let config = Config::new(1.0, 1, 1, learning.channels([KIND], detectors).unwrap());
    let mut monitor = PairMonitor::<f32, Iae, 1>::new(config).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let n = 20_000;
    let square: f64 = (0..n)
        .map(|_| {
            let x: f32 = rng.random_range(4.0..16.0);
            let noise: f32 = StandardNormal.sample(&mut rng);
            let report = monitor.tick(2.0 + 0.5 * x + 0.05 * noise, 0.0, x.sqrt()).unwrap();
            f64::from(report.channels[0].z).powi(2)
        })
        .sum();
    let sd = (square / f64::from(n)).sqrt();
    // sigma from 200 windows is itself known to 5 %.
    assert!((sd - 1.0).abs() < 0.1, "{sd}");
}

/// A loop that stands still, and one whose values scatter by their own rounding alone: a standard deviation of
/// zero would silence the channel for ever.
#[test]
fn a_constant_index_gives_no_baseline() {
    for wobble in [0.0, 1e-7f32] {
        let mut monitor = PairMonitor::<f32, Iae, 1>::new(CONFIG).unwrap();
        let mut learning = Commissioning::<1>::new();
        for i in 0..100 {
            learning.learn(monitor.tick(0.3 * (1.0 + wobble * (i % 3) as f32), 0.0, 2.0).unwrap());
        }
        let refused = NotReady::NoScatter { channel: 0 };
        assert_eq!(learning.baselines(), Err(refused));
        assert_eq!(learning.channels([KIND], Detectors::NONE), Err(refused));
        assert!(refused.to_string().contains("does not scatter"), "{refused}");
    }
}
