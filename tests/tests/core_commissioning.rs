//! The baseline learnt in place: against ordinary least squares in f64, and what so few windows can promise.

use drift_core::{
    Channel, ChannelKind, Commissioning, CommissioningAt, Config, Cusum, Detectors, Iae, Index, NotReady,
    PairMonitor, honest_arl0,
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

/// Value = 1 + 2 x + 0.25 point + noise, where the point goes with x in part: learnt, and by least squares in f64.
struct AtPoint {
    learning: CommissioningAt<1>,
    rows: Vec<[f64; 3]>,
}

fn learn_at(windows: usize, sigma: f64, seed: u64) -> AtPoint {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut learning = CommissioningAt::<1>::new();
    let mut rows = Vec::new();
    for _ in 0..windows {
        let x: f64 = rng.random_range(4.0..16.0);
        let point = 20.0 + 0.5 * x + rng.random_range(-3.0..3.0);
        let noise: f64 = StandardNormal.sample(&mut rng);
        let row = [x as f32, (1.0 + 2.0 * x + 0.25 * point + sigma * noise) as f32, point as f32];
        learning.learn_window(std::iter::once((row[0], row[1])), row[2]);
        rows.push(row.map(f64::from));
    }
    AtPoint { learning, rows }
}

/// b0, b1, weight, standard deviation, what x does not explain of the point: by centred normal equations.
fn least_squares_at(rows: &[[f64; 3]]) -> [f64; 5] {
    let n = rows.len() as f64;
    let mean = |k: usize| rows.iter().map(|row| row[k]).sum::<f64>() / n;
    let (mx, mv, mp) = (mean(0), mean(1), mean(2));
    let product = |i: usize, mi: f64, j: usize, mj: f64| {
        rows.iter().map(|row| (row[i] - mi) * (row[j] - mj)).sum::<f64>()
    };
    let (xx, pp, xp) = (product(0, mx, 0, mx), product(2, mp, 2, mp), product(0, mx, 2, mp));
    let (xv, pv) = (product(0, mx, 1, mv), product(2, mp, 1, mv));
    let determinant = xx * pp - xp * xp;
    let (b1, weight) = ((pp * xv - xp * pv) / determinant, (xx * pv - xp * xv) / determinant);
    let b0 = mv - b1 * mx - weight * mp;
    let ss: f64 = rows.iter().map(|row| (row[1] - b0 - b1 * row[0] - weight * row[2]).powi(2)).sum();
    [b0, b1, weight, (ss / (n - 3.0)).sqrt(), determinant / xx]
}

#[test]
fn the_weight_of_an_operating_point_is_that_of_least_squares() {
    for sigma in [1.0, 0.05, 1e-3] {
        for windows in [25, 100, 2000] {
            let AtPoint { learning, rows } = learn_at(windows, sigma, windows as u64);
            let (baseline, point) = learning.relation(0, ChannelKind::Effort).unwrap();
            let [b0, b1, weight, s, ss] = least_squares_at(&rows);
            let near =
                |got: f32, want: f64, scale: f64| (f64::from(got) - want).abs() * scale < 0.02 * s + 1e-4;
            // Each coefficient at the reach of its number: what a detector would see of its error.
            let fine =
                near(baseline.b0, b0, 1.0) && near(baseline.b1, b1, 12.0) && near(point.weight, weight, 30.0);
            assert!(fine, "sigma {sigma}, {windows}: {baseline:?} {point:?} instead of {b0} {b1} {weight}");
            assert!((f64::from(baseline.sigma) / s - 1.0).abs() < 0.02, "{} instead of {s}", baseline.sigma);
            assert!((f64::from(point.ss) / ss - 1.0).abs() < 1e-3, "{} instead of {ss}", point.ss);
            assert_eq!(baseline.windows, windows as f32);
            let points = rows.iter().map(|row| row[2] as f32);
            assert_eq!(point.min, points.clone().fold(f32::MAX, f32::min));
            assert_eq!(point.max, points.fold(f32::MIN, f32::max));
        }
    }
}

/// The residuals that a monitor makes of it have the sigma that was learnt, and no mean, where the point goes next.
#[test]
fn a_monitor_with_the_learnt_weight_is_not_moved_by_the_point() {
    let AtPoint { learning, .. } = learn_at(400, 0.05, 7);
    let (baseline, point) = learning.relation(0, ChannelKind::Effort).unwrap();
    let AtPoint { rows, .. } = learn_at(4000, 0.05, 8);
    let z = |row: &[f64; 3]| {
        let value = row[1] as f32 - point.weight * row[2] as f32;
        let residual = baseline.residual(row[0] as f32, value);
        let more = point.leverage(row[0] as f32 - baseline.x_mean, row[2] as f32);
        f64::from(baseline.standardise_with(row[0] as f32, residual, more))
    };
    let n = rows.len() as f64;
    let mean = rows.iter().map(z).sum::<f64>() / n;
    let variance = rows.iter().map(|row| (z(row) - mean).powi(2)).sum::<f64>() / n;
    assert!(mean.abs() < 0.15 && (variance - 1.0).abs() < 0.15, "mean {mean}, variance {variance}");
    // Without the point they would be away by the point's own reach.
    let without = Commissioning::<1>::new();
    assert!(without.baselines().is_err());
}

#[test]
fn a_point_that_cannot_be_learnt_is_refused() {
    let learn = |point: fn(usize) -> f32| {
        let mut learning = CommissioningAt::<1>::new();
        for i in 0..60 {
            let x = (i * 37 % 101) as f32;
            let scatter = ((i * 53 % 89) as f32 - 44.0) * 0.01;
            learning.learn_window(std::iter::once((x, 3.0 + x + scatter)), point(i));
        }
        learning
    };
    let still = learn(|_| 21.5);
    assert_eq!(still.relation(0, ChannelKind::Effort), Err(NotReady::PointStandsStill { channel: 0 }));
    // A kind that does not depend on the point needs none.
    assert!(still.relation(0, ChannelKind::Activity).unwrap().1.weight == 0.0);
    let with_x = learn(|i| 5.0 + 2.0 * (i * 37 % 101) as f32);
    assert_eq!(with_x.relation(0, ChannelKind::Effort), Err(NotReady::PointStandsStill { channel: 0 }));
    // A monitor without a point reports none: then there is none to learn.
    let none = learn(|_| f32::NAN);
    let (baseline, point) = none.relation(0, ChannelKind::Effort).unwrap();
    assert!(!point.counts() && (baseline.b1 - 1.0).abs() < 1e-2, "{baseline:?}");
    // A window in between without a point is passed over.
    let gappy = learn(|i| if i % 5 == 4 { f32::NAN } else { (i * 29 % 31) as f32 });
    assert_eq!(gappy.windows(), 48);
    assert!(gappy.relation(0, ChannelKind::Effort).unwrap().1.weight.abs() < 0.02);
}

#[test]
fn commissioning_with_a_point_survives_a_reset() {
    let config = CONFIG;
    let AtPoint { learning, .. } = learn_at(40, 0.1, 3);
    let mut bytes = [0; CommissioningAt::<1>::STATE_BYTES];
    assert_eq!(learning.save(&config, &mut bytes), Ok(bytes.len()));
    let mut restored = CommissioningAt::<1>::new();
    for at in 0..bytes.len() {
        let mut damaged = bytes;
        damaged[at] ^= 4;
        assert!(restored.restore(&config, &damaged).is_err(), "byte {at}");
        assert_eq!(restored, CommissioningAt::new());
    }
    restored.restore(&config, &bytes).unwrap();
    assert_eq!(restored, learning);
    assert!(Commissioning::<1>::new().restore(&config, &bytes).is_err());
}
