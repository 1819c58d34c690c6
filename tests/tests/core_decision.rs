//! Disturbance or drift: what comes back ends as a disturbance, what stays becomes a drift and says how the curve
//! moved. One tick is one window here (x = u^2, value = |e|), so that windows can be drawn straight from a line.

use drift_core::{
    Baseline, Channel, ChannelKind, Config, Cusum, Detectors, FaultCurve, Iae, Index, Moved, PairIndices,
    PairMonitor, Report, Shewhart, Side, Sprt, Verdict,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

const B0: f32 = 2.0;
const B1: f32 = 0.5;
const SIGMA: f32 = 0.05;

const CONFIG: Config<f32, 1> = Config::new(
    1.0,
    1,
    1,
    [Channel::new(
        ChannelKind::EnergyError(Index::Iae),
        Baseline::known(B0, B1, SIGMA),
        Detectors {
            cusum: Some(Cusum::new(0.5, 5.0)),
            shewhart: Some(Shewhart::symmetric(3.5)),
            ..Detectors::NONE
        },
    )],
);

/// A monitored stream of windows.
struct Stream {
    monitor: PairMonitor<f32, Iae, 1>,
    rng: ChaCha8Rng,
}

impl Stream {
    fn new(seed: u64) -> Self {
        Self { monitor: PairMonitor::new(CONFIG).unwrap(), rng: ChaCha8Rng::seed_from_u64(seed) }
    }

    /// One window from the line b0 + b1*x, x uniform in 4..16.
    fn window(&mut self, b0: f32, b1: f32) -> Report<1, PairIndices> {
        let x: f32 = self.rng.random_range(4.0..16.0);
        let noise: f32 = StandardNormal.sample(&mut self.rng);
        let value = b0 + b1 * x + SIGMA * noise;
        *self.monitor.tick(value, 0.0, x.sqrt()).unwrap()
    }

    /// One window `shift` sigmas away from the baseline.
    fn shifted(&mut self, shift: f32) -> Verdict {
        self.window(B0 + shift * SIGMA, B1).verdict
    }
}

/// Share of `runs` seeded runs for which `outcome` holds.
fn share(runs: u64, outcome: impl Fn(Stream) -> bool + Sync) -> f64 {
    (0..runs).into_par_iter().filter(|&seed| outcome(Stream::new(seed))).count() as f64 / runs as f64
}

/// Any drift reported while `windows` windows of a disturbance and the 100 after it pass.
fn disturbance_called_drift(mut stream: Stream, windows: u32, sigmas: f32) -> bool {
    for _ in 0..20 {
        stream.shifted(0.0);
    }
    let shifts = (0..windows + 100).map(|i| if i < windows { sigmas } else { 0.0 });
    shifts.into_iter().any(|shift| stream.shifted(shift) == Verdict::Drift)
}

#[test]
fn disturbances_end_as_disturbances() {
    println!("share of disturbances called drift, by length (windows) and size (sigmas)");
    for windows in [1, 2, 5, 10, 15] {
        for sigmas in [2.0, 3.0, 5.0, 10.0, 20.0, -2.0, -20.0] {
            let wrong = share(1000, |stream| disturbance_called_drift(stream, windows, sigmas));
            println!("{windows:3} windows of {sigmas:5} sigma: {wrong:.3}");
            // Fifteen windows of two sigma leave five to tell them from twenty: it can't be done much better.
            let limit = if windows == 15 && sigmas.abs() < 3.0 { 0.12 } else { 0.05 };
            assert!(wrong <= limit, "{windows} windows of {sigmas} sigma: {wrong}");
        }
    }
}

/// A disturbance that raised an alarm is reported as ended, within some windows of its end.
#[test]
fn the_end_of_a_disturbance_is_said() {
    for (windows, sigmas, within) in [(5, 5.0, 12), (15, 3.0, 25), (15, 20.0, 5), (1, 20.0, 5), (1, 10.0, 12)]
    {
        let said = share(1000, |mut stream| {
            let alarmed = (0..windows).map(|_| stream.shifted(sigmas)).max() >= Some(Verdict::Suspect);
            alarmed && (0..within).any(|_| stream.shifted(0.0) == Verdict::Disturbance)
        });
        println!("{windows} windows of {sigmas} sigma: end said within {within} in {said:.3}");
        assert!(said > 0.95, "{windows} of {sigmas}: {said}");
    }
}

#[test]
fn shifts_that_stay_become_drift() {
    println!("shift  drift within 60 windows  called a disturbance before  median windows to drift");
    for (sigmas, least) in
        [(1.0, 0.85), (1.5, 0.97), (2.0, 0.99), (3.0, 0.99), (5.0, 0.99), (10.0, 0.99), (-1.5, 0.97)]
    {
        let runs: Vec<(u32, bool)> = (0..1000u64)
            .into_par_iter()
            .map(|seed| {
                let mut stream = Stream::new(seed);
                let mut called_disturbance = false;
                for i in 1..400 {
                    match stream.shifted(sigmas) {
                        Verdict::Drift => return (i, called_disturbance),
                        Verdict::Disturbance => called_disturbance = true,
                        _ => {}
                    }
                }
                (400, called_disturbance)
            })
            .collect();
        let drift = runs.iter().filter(|r| r.0 <= 60).count() as f64 / 1000.0;
        let before = runs.iter().filter(|r| r.1).count() as f64 / 1000.0;
        let mut delays: Vec<u32> = runs.iter().map(|r| r.0).collect();
        delays.sort_unstable();
        println!("{sigmas:5}  {drift:.3}  {before:.3}  {}", delays[500]);
        assert!(drift >= least, "{sigmas} sigma: {drift}");
        assert!(delays[999] < 400, "{sigmas} sigma: never called drift in 400 windows");
    }
}

#[test]
fn a_slow_ramp_ends_as_drift_to_its_side() {
    for per_window in [0.05f32, -0.1, 0.5] {
        let drift = share(300, |mut stream| {
            let ramp = (0..200).map(|i| B0 + per_window * i as f32 * SIGMA);
            let last = ramp.map(|b0| stream.window(b0, B1)).last().unwrap();
            let side = if per_window > 0.0 { Side::High } else { Side::Low };
            last.verdict == Verdict::Drift && last.channels[0].side == Some(side)
        });
        println!("ramp of {per_window} sigma per window: drift in {drift:.3}");
        assert!(drift > 0.99, "{per_window}: {drift}");
    }
}

/// The state that a drift left is reported as recovered once it is repaired.
#[test]
fn a_repaired_drift_recovers() {
    let recovered = share(500, |mut stream| {
        let drifted = (0..60).map(|_| stream.shifted(3.0)).last() == Some(Verdict::Drift);
        drifted && (0..30).any(|_| stream.shifted(0.0) == Verdict::Recovered)
    });
    assert!(recovered > 0.99, "{recovered}");
}

/// What the fault curve says 60 windows after the curve moved to b0, b1.
fn fault_curves(b0: f32, b1: f32) -> Vec<FaultCurve> {
    (0..200u64)
        .into_par_iter()
        .filter_map(|seed| {
            let mut stream = Stream::new(seed);
            for _ in 0..20 {
                stream.window(B0, B1);
            }
            (0..60).map(|_| stream.window(b0, b1)).last().unwrap().channels[0].fault_curve
        })
        .collect()
}

#[test]
fn a_drift_says_how_the_curve_moved_and_by_how_much() {
    let cases = [
        ("lifted by 3 sigma", B0 + 0.15, B1, Moved::Intercept),
        ("lowered by 2 sigma", B0 - 0.1, B1, Moved::Intercept),
        ("tilted about x = 0, 4 sigma at the middle", B0, B1 + 0.02, Moved::Slope),
        ("both", B0 + 0.3, B1 - 0.05, Moved::Both),
        ("both, to the same side", B0 + 0.2, B1 + 0.05, Moved::Both),
    ];
    for (case, b0, b1, moved) in cases {
        let curves = fault_curves(b0, b1);
        let right = curves.iter().filter(|c| c.moved == moved).count() as f64 / curves.len() as f64;
        let n = curves.len() as f32;
        let mean_b0 = curves.iter().map(|c| c.b0).sum::<f32>() / n;
        let mean_b1 = curves.iter().map(|c| c.b1).sum::<f32>() / n;
        println!(
            "{case}: drift in {n} of 200, {moved:?} in {right:.3}, b0 {mean_b0:.4} (true {b0:.4}), b1 {mean_b1:.5} (true {b1:.5})"
        );
        // The first "both" crosses the baseline within the range of x: some windows lie on the other side, and a
        // run of them looks like a recovery.
        let crosses = (b0 - B0) * (b1 - B1) < 0.0;
        assert!(n >= if crosses { 170.0 } else { 196.0 }, "{case}: drift in {n}");
        assert!(right >= 0.95, "{case}: {right}");
        // sd of b0 from 60 windows, x uniform in 4..16: sigma*sqrt(1/60 + 100/(60*12)) = 0.0197; mean of 200.
        assert!((mean_b0 - b0).abs() < 0.006, "{case}: b0 {mean_b0}");
        assert!((mean_b1 - b1).abs() < 0.0006, "{case}: b1 {mean_b1}");
    }
}

/// How many decisions in health alarm, and as what the alarms end.
fn false_alarms(runs: u64, decisions: u32) -> (u64, u64, u64) {
    (0..runs)
        .into_par_iter()
        .map(|seed| {
            let mut stream = Stream::new(1_000_000 + seed);
            let (mut disturbances, mut drifts, mut before) = (0, 0, Verdict::Healthy);
            for _ in 0..decisions {
                let verdict = stream.shifted(0.0);
                disturbances += u64::from(verdict == Verdict::Disturbance);
                drifts += u64::from(verdict == Verdict::Drift && before != Verdict::Drift);
                before = verdict;
            }
            (u64::from(decisions), disturbances, drifts)
        })
        .reduce(|| (0, 0, 0), |a, b| (a.0 + b.0, a.1 + b.1, a.2 + b.2))
}

#[test]
fn false_alarms_mostly_end_as_disturbances() {
    let (decisions, disturbances, drifts) = false_alarms(20, 100_000);
    println!("{decisions} healthy decisions: {disturbances} ended as disturbance, {drifts} as drift");
    assert!(disturbances > 2000, "the detectors alarm once in some 400 decisions: {disturbances}");
    assert!(drifts * 20 < disturbances, "{drifts} false drifts of {disturbances}");
}

#[test]
#[ignore = "slow: 5e7 decisions"]
fn rate_of_false_drift() {
    let (decisions, disturbances, drifts) = false_alarms(100, 500_000);
    println!("{decisions} healthy decisions: {disturbances} ended as disturbance, {drifts} as drift");
    println!("one false drift in {:.0} decisions", decisions as f64 / drifts.max(1) as f64);
    assert!(drifts * 20 < disturbances, "{drifts} false drifts of {disturbances}");
}

/// Each detector alone, and a lasting shift to either side, from small to far beyond the noise: it ends as a drift
/// on its own side. The SPRT with an alternative in the deviation sees both sides alarm at once.
#[test]
fn a_lasting_shift_of_any_size_is_a_drift_on_its_own_side() {
    let detectors = [
        ("CUSUM", Detectors { cusum: Some(Cusum::new(0.5, 5.0)), ..Detectors::NONE }),
        ("Shewhart", Detectors { shewhart: Some(Shewhart::symmetric(3.5)), ..Detectors::NONE }),
        ("SPRT, mean", Detectors { sprt: Some(Sprt::mean(1.0, -4.6, 6.9)), ..Detectors::NONE }),
        (
            "SPRT, deviation",
            Detectors { sprt: Some(Sprt::mean_and_deviation(1.0, 1.5, -2.9, 2.9)), ..Detectors::NONE },
        ),
    ];
    for (name, detectors) in detectors {
        for shift in [-30.0f32, -10.0, -8.0, -5.0, 5.0, 8.0, 10.0, 30.0] {
            let mut config = CONFIG;
            config.channels[0].detectors = detectors;
            let outcome = share(200, |stream| {
                let mut stream = Stream { monitor: PairMonitor::new(config).unwrap(), rng: stream.rng };
                let report = (0..60).map(|_| stream.window(B0 + shift * SIGMA, B1)).last().unwrap();
                let side = if shift > 0.0 { Side::High } else { Side::Low };
                report.verdict == Verdict::Drift && report.channels[0].side == Some(side)
            });
            assert!(outcome > 0.99, "{name}, {shift} sigma: {outcome} end as a drift on their side");
        }
    }
}
