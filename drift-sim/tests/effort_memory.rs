//! The effort channel with memory: on loops that are simulated here (first order and two lags under a PI, a reference that
//! wanders, a slow unmeasured load of its own), `calibrate` chooses the order chosen, the residual becomes white,
//! and a load is found sooner at the same promise. The truth, onset and size of the load, is known exactly.

use drift_sim::baseline_file::{BaselineFile, HostMonitor};
use drift_sim::calibrate::{Calibration, Options, Signals, calibrate};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Ticks per window, 0.1 s each.
const WINDOW: usize = 150;
const SAMPLE_TIME_S: f64 = 0.1;

/// A plant of lags in series (time constants in ticks) under `u = kp*e + sum of ki*e`.
struct Case {
    name: &'static str,
    lags: &'static [f64],
    kp: f64,
    ki: f64,
    noise: f64,
}

const CASES: [Case; 3] = [
    Case { name: "first order", lags: &[120.0], kp: 2.0, ki: 0.02, noise: 0.01 },
    Case { name: "two lags", lags: &[150.0, 40.0], kp: 1.5, ki: 0.01, noise: 0.01 },
    Case { name: "fast, noisy", lags: &[20.0], kp: 0.8, ki: 0.04, noise: 0.1 },
];

type Run = [Vec<f64>; 3];

impl Case {
    /// r, y, u of so many windows; `load(window)` is subtracted from the drive.
    fn run(&self, windows: usize, seed: u64, load: impl Fn(f64) -> f64) -> Run {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut levels = ChaCha8Rng::seed_from_u64(seed ^ 0xabcd);
        let (mut level, mut r, mut integral, mut slow) = (1.0, 1.0, 1.0, 0.0);
        let mut x = vec![1.0; self.lags.len()];
        let mut out: Run = [vec![], vec![], vec![]];
        let keep = 1.0 - 1.0 / (2.0 * WINDOW as f64);
        for tick in 0..windows * WINDOW {
            if tick.is_multiple_of(WINDOW + WINDOW / 2) {
                level = levels.random_range(0.5..1.5);
            }
            r += (level - r) / 30.0;
            slow = keep * slow + 0.01 * (1.0 - keep * keep).sqrt() * normal();
            let y = x.last().copied().unwrap_or(0.0) + self.noise * normal();
            let e = r - y;
            integral += self.ki * e;
            let u = self.kp * e + integral;
            let mut into = u - slow - load(tick as f64 / WINDOW as f64);
            for (x, lag) in x.iter_mut().zip(self.lags) {
                *x += (into - *x) / lag;
                into = *x;
            }
            [r, y, u].into_iter().zip(&mut out).for_each(|(v, out)| out.push(v));
        }
        out
    }
}

fn calibrated(run: &Run, order: Option<u8>) -> Calibration {
    let [r, y, u] = run;
    let signals =
        Signals { name: "healthy", sample_time_s: SAMPLE_TIME_S, r, y, u, state: None, further: &[] };
    let window_s = WINDOW as f64 * SAMPLE_TIME_S;
    let options = Options {
        window_s: Some(window_s),
        false_alarm_every_h: 300.0 * window_s / 3600.0,
        channels: [false, true, false],
        detectors: "cusum".parse().unwrap(),
        effort_memory: order,
        simulated_decisions: 200_000,
        ..Options::default()
    };
    calibrate(&[signals], &options).unwrap()
}

/// Decisions from `onset` to the first alarm of the effort channel, at most `most`; alarms before are forgotten.
fn delay(file: &BaselineFile, run: &Run, onset: usize, most: usize) -> usize {
    let mut monitor = HostMonitor::new(file.config().unwrap()).unwrap();
    let [r, y, u] = run;
    let mut decisions = 0;
    for i in 0..r.len() {
        let Some(report) = monitor.tick(r[i] as f32, y[i] as f32, u[i] as f32) else { continue };
        let alarm = report.channels[1].alarms.cusum.is_some();
        decisions += 1;
        if decisions <= onset {
            if alarm {
                monitor.acknowledge();
            }
        } else if alarm {
            return decisions - onset;
        }
    }
    most
}

/// Mean delay to a load of so many of the memoryless residual's sigmas, to either side, over 24 runs.
fn mean_delay(case: &Case, file: &BaselineFile, load: f64) -> f64 {
    let (onset, most) = (40, 160);
    let each = |seed: u64| {
        let load = if seed.is_multiple_of(2) { load } else { -load };
        let step = |window: f64| load * (window - onset as f64).clamp(0.0, 1.0);
        delay(file, &case.run(onset + most, 1000 + seed, step), onset, most)
    };
    (0..24u64).into_par_iter().map(each).sum::<usize>() as f64 / 24.0
}

/// Windows to a false alarm on fresh healthy runs.
fn realised(case: &Case, file: &BaselineFile) -> f64 {
    let (runs, windows) = (8, 1500);
    let alarms = |seed: u64| {
        let mut monitor = HostMonitor::new(file.config().unwrap()).unwrap();
        let [r, y, u] = case.run(windows, 9000 + seed, |_| 0.0);
        (0..r.len())
            .filter(|&i| {
                let report = monitor.tick(r[i] as f32, y[i] as f32, u[i] as f32);
                report.is_some_and(|report| report.channels[1].alarms.cusum.is_some())
            })
            .count()
    };
    let alarms: usize = (0..runs as u64).into_par_iter().map(alarms).sum();
    (runs * windows) as f64 / alarms.max(1) as f64
}

#[test]
fn memory_whitens_the_residual_and_sees_a_load_sooner() {
    println!(
        "| loop | order | lag-1: without, with | 0.5 sigma0: windows | 1.5 sigma0 | false alarm every (300 asked) | visible |"
    );
    println!("|---|---|---|---|---|---|---|");
    for case in &CASES {
        let healthy = case.run(600, 1, |_| 0.0);
        let (without, with) = (calibrated(&healthy, Some(0)), calibrated(&healthy, None));
        let sigma0 = without.channels[0].fit.rmse;
        let row = |load: f64| [&without, &with].map(|c| mean_delay(case, &c.file, load * sigma0));
        let (small, large) = (row(0.5), row(1.5));
        let every = [&without, &with].map(|c| realised(case, &c.file));
        let [a, b] = [&without, &with].map(|c| c.channels[0].lag1);
        let memory = with.channels[0].memory;
        println!(
            "| {} | {} | {a:.2}, {b:.2} | {:.1} -> {:.1} | {:.1} -> {:.1} | {:.0}, {:.0} | {:.2} |",
            case.name,
            memory.order,
            small[0],
            small[1],
            large[0],
            large[1],
            every[0],
            every[1],
            memory.visible()
        );
        assert!(b.abs() < 0.15, "{}: lag-1 {b}", case.name);
        assert!(small[1] < small[0] && large[1] < large[0], "{}: slower with memory", case.name);
        assert!(every[1] > 200.0, "{}: a false alarm every {} windows", case.name, every[1]);
        assert!(memory.visible() >= 0.2 - 1e-6);
    }
}

/// From 200 windows on, and from fewer without memory's numbers: the order falls with what is known.
#[test]
fn the_order_follows_what_the_windows_can_tell() {
    let case = &CASES[1];
    let order = |windows: usize| calibrated(&case.run(windows, 3, |_| 0.0), None).channels[0].memory.order;
    assert_eq!(order(90), 0, "25 windows for each of four coefficients are 100");
    assert!((1..3).contains(&order(190)));
    assert_eq!(order(210), 3);
}
