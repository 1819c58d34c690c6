//! A measured operating point in the core: `FullAt` sums it like every other number, and nothing else changes.

use drift_core::{
    Baseline, Channel, ChannelKind, Config, ConfigError, Cusum, Detectors, Everything, Full, FullAt, Index,
    Input, Monitor, OperatingPoint, Pair, Verdict,
};

type At<N> = Monitor<N, FullAt, Everything<4>, 3>;
type Without<N> = Monitor<N, Full, Everything<4>, 3>;

const CUSUM: Detectors = Detectors { cusum: Some(Cusum::new(0.5, 5.0)), ..Detectors::NONE };

/// u = 0.5 + 2 y + 0.25 point, to 0.1.
fn effort(weight: f32) -> Channel {
    let channel = Channel::new(ChannelKind::Effort, Baseline::known(0.5, 2.0, 0.1), CUSUM);
    Channel {
        operating_point: OperatingPoint { min: -10.0, max: 30.0, ..OperatingPoint::known(weight) },
        ..channel
    }
}

fn config<N: Copy>(weight: f32) -> Config<N, 3> {
    let others = [ChannelKind::EnergyError(Index::Iae), ChannelKind::Activity].map(Channel::unlearned);
    Config::new(0.1, 10, 4, [others[0], effort(weight), others[1]]).with_hop(2)
}

/// A load of a quarter of the point, which rises from 0 to 20; `more` is added to u.
fn signals(i: usize, more: f32) -> [f32; 4] {
    let point = (i as f32 / 100.0).min(20.0);
    let y = 1.0 + 0.3 * (i as f32 * 0.01).sin();
    [y, y, 0.5 + 2.0 * y + 0.25 * point + more, point]
}

#[test]
fn a_load_that_is_measured_is_no_drift_and_one_that_is_not_is() {
    for (weight, more, expected) in
        [(0.25, 0.0, Verdict::Healthy), (0.0, 0.0, Verdict::Drift), (0.25, 0.2, Verdict::Drift)]
    {
        let mut monitor = At::<f32>::new(config(weight)).unwrap();
        for i in 0..4_000 {
            let [r, y, u, point] = signals(i, more);
            monitor.tick_at(r, y, u, point);
        }
        assert_eq!(monitor.verdict(), expected, "weight {weight}, {more} more");
    }
}

/// Beside an operating point that does not count every number is that of `Full`, bit for bit.
#[test]
fn everything_else_is_as_without() {
    let (mut at, mut without) =
        (At::<f32>::new(config(0.0)).unwrap(), Without::<f32>::new(config(0.0)).unwrap());
    let mut decisions = 0;
    for i in 0..3_000 {
        let [r, y, u, point] = signals(i, if i > 1_500 { 0.3 } else { 0.0 });
        let input = if i % 17 == 0 { Input::Missing } else { Input::Sample { r, y, u } };
        at.operating_point(point);
        let (a, b) = (at.tick_input(input).copied(), without.tick_input(input).copied());
        let (Some(a), Some(b)) = (a, b) else { continue };
        decisions += 1;
        assert_eq!(format!("{:?}", a.indices.indices), format!("{:?}", b.indices));
        assert_eq!(format!("{:?}", a.channels), format!("{:?}", b.channels));
        assert!((a.indices.operating_point - point).abs() < 0.3);
    }
    assert_eq!(decisions, 149);
}

/// Against a direct mean over the valid ticks of each window, windows that overlap and have gaps.
#[test]
fn the_mean_is_that_of_the_valid_ticks() {
    let mut monitor = At::<i32>::new(config(0.0)).unwrap();
    let valid = |i: i32| i % 5 != 3;
    for i in 0..400 {
        monitor.operating_point(i * i % 1_000 - 300);
        let input = if valid(i) { Input::Sample { r: 5, y: 4, u: 3 } } else { Input::Missing };
        let Some(report) = monitor.tick_input(input) else { continue };
        let window = (i - 39..=i).filter(|&i| valid(i));
        let direct =
            window.clone().map(|i| f64::from(i * i % 1_000 - 300)).sum::<f64>() / window.count() as f64;
        // Blocks with gaps are made up in proportion, each from its own valid ticks.
        assert!((f64::from(report.indices.operating_point) - direct).abs() < 1e-3 * direct.abs().max(100.0));
    }
}

#[test]
fn ticks_before_the_point_is_told_and_hostile_points_are_left_out() {
    let mut monitor = At::<f32>::new(config(0.25)).unwrap();
    assert_eq!((0..40).filter(|_| monitor.tick(1.0, 1.0, 2.5).is_some()).count(), 1);
    assert_eq!(monitor.state().report().excluded.total(), 40);
    for bad in [f32::NAN, f32::INFINITY, 2e12] {
        monitor.restart_window();
        (0..39).for_each(|_| assert!(monitor.tick_at(1.0, 1.0, 2.5, bad).is_none()));
        let report = monitor.tick_at(1.0, 1.0, 2.5, bad).unwrap();
        assert!(report.excluded.total() == 40 && report.channels[1].z.is_nan(), "{report:?}");
    }
    // It is held until the next one.
    monitor.restart_window();
    monitor.operating_point(8.0);
    let report = (0..40).find_map(|_| monitor.tick(1.0, 1.0, 4.5).copied()).unwrap();
    assert_eq!((report.indices.operating_point, report.channels[1].residual), (8.0, 0.0));
    // Beyond what was seen: judged, and flagged.
    monitor.restart_window();
    let report = (0..40).find_map(|_| monitor.tick_at(1.0, 1.0, 10.5, 32.0).copied()).unwrap();
    assert!(report.channels[1].extrapolated && report.channels[1].residual == 0.0, "{report:?}");
}

#[test]
fn a_saved_state_goes_on_bit_for_bit() {
    let mut first = At::<f32>::new(config(0.25)).unwrap();
    (0..1_234).for_each(|i| {
        let [r, y, u, point] = signals(i, 0.1);
        first.tick_at(r, y, u, point);
    });
    let mut bytes = [0; At::<f32>::STATE_BYTES];
    first.save(&mut bytes).unwrap();
    let mut second = At::<f32>::new(config(0.25)).unwrap();
    second.restore(&bytes).unwrap();
    for i in 1_234..2_000 {
        let [r, y, u, point] = signals(i, 0.1);
        // The point is held on both sides every third tick.
        let tick = |monitor: &mut At<f32>| {
            let report = if i % 3 == 0 { monitor.tick(r, y, u) } else { monitor.tick_at(r, y, u, point) };
            format!("{report:?}")
        };
        assert_eq!(tick(&mut first), tick(&mut second));
    }
    assert!(
        At::<f32>::new(config(0.3)).unwrap().restore(&bytes).is_err(),
        "another weight is another configuration"
    );
}

/// What a weight that is known from few windows adds to the residual's spread, against the textbook's prediction
/// variance of a regression on x and the point (the full inverse, not the core's two steps).
#[test]
fn the_weights_uncertainty_is_the_regressions() {
    let windows: Vec<[f64; 2]> =
        (0..30).map(|i| [f64::from(i % 7), f64::from(i % 5) + 0.4 * f64::from(i % 7)]).collect();
    let n = windows.len() as f64;
    let mean = |k: usize| windows.iter().map(|w| w[k]).sum::<f64>() / n;
    let m = [mean(0), mean(1)];
    let cross = |a: usize, b: usize| windows.iter().map(|w| (w[a] - m[a]) * (w[b] - m[b])).sum::<f64>();
    let (xx, xp, pp) = (cross(0, 0), cross(0, 1), cross(1, 1));
    let known = OperatingPoint {
        weight: 1.0,
        mean: m[1] as f32,
        per_x: (xp / xx) as f32,
        ss: (pp - xp * xp / xx) as f32,
        ..OperatingPoint::NONE
    };
    for [x, point] in [[0.0, 0.0], [3.0, 9.0], [12.0, -4.0]] {
        let (dx, dp) = (x - m[0], point - m[1]);
        let exact = (dx * dx * pp - 2.0 * dx * dp * xp + dp * dp * xx) / (xx * pp - xp * xp);
        let ours = dx * dx / xx + f64::from(known.leverage(dx as f32, point as f32));
        assert!((ours / exact - 1.0).abs() < 1e-5, "{ours} {exact}");
    }
}

#[test]
fn what_can_not_be_is_refused() {
    let refused = |channel: OperatingPoint| {
        let mut config = config::<f32>(0.25);
        config.channels[1].operating_point = channel;
        At::<f32>::new(config).err()
    };
    let good = OperatingPoint::known(0.25);
    for bad in [
        OperatingPoint { weight: f32::NAN, ..good },
        OperatingPoint { ss: -1.0, ..good },
        OperatingPoint { min: 1.0, max: 0.0, ..good },
        OperatingPoint { per_x: f32::INFINITY, ..good },
    ] {
        assert_eq!(refused(bad), Some(ConfigError::OutOfRange("operating_point")));
    }
    assert_eq!(Without::<f32>::new(config(0.25)).err(), Some(ConfigError::NotLinked("operating_point")));
    let pair = Channel {
        operating_point: OperatingPoint::known(1.0),
        ..Channel::new(ChannelKind::EnergyError(Index::Iae), Baseline::known(0.0, 1.0, 0.1), CUSUM)
    };
    let monitor =
        Monitor::<f32, Pair<drift_core::Iae>, Everything<4>, 1>::new(Config::new(0.1, 10, 4, [pair]));
    assert_eq!(monitor.err(), Some(ConfigError::NotLinked("operating_point")));
}
