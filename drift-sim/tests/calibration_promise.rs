//! Does a calibration keep what it promises? Three simulated loops are calibrated many times over, and the whole monitor (three
//! channels, Shewhart and CUSUM each) runs over fresh healthy windows that no calibration has seen. The truth is the simulator.
#![allow(missing_docs, clippy::unwrap_used)]

use drift_core::{Channel, ChannelKind, Config, CusumState, Index};
use drift_sim::baseline_file::{BaselineFile, HostMonitor};
use drift_sim::calibrate::{Calibration, Effort, Options, Signals, calibrate};
use drift_sim::control_loop::Loop;
use drift_sim::reference::Reference;
use drift_sim::simulate::Simulation;
use rayon::prelude::*;

/// A loop and what it is asked to follow.
struct Case {
    name: &'static str,
    file: &'static str,
    mean: f64,
    sd: f64,
    hold_ticks: u64,
    window_ticks: usize,
    effort: Effort,
}

const PAPER: Case = Case {
    name: "paper",
    file: r#"
        [loop]
        sample_time_s = 0.001
        [controller]
        kind = "pi"
        kp = 300.0
        ki = 100.0
        [plant]
        kind = "state-space"
        a = [[-0.2, 2.0, 0.0], [-2.0, -0.2, 0.0], [0.0, 0.0, -0.5]]
        b = [[1.0], [0.0], [0.0]]
        c = [[1.0, 0.0, 0.0]]
        d = [[0.0]]
    "#,
    mean: 0.1,
    sd: 1.0,
    hold_ticks: 50,
    window_ticks: 3000,
    effort: Effort::Holding,
};

const FLOW: Case = Case {
    name: "flow",
    file: r#"
        [loop]
        sample_time_s = 0.5
        [controller]
        kind = "pi"
        kp = 0.6
        ki = 0.09
        [plant]
        kind = "first-order"
        gain = 1.1
        time_constant_s = 6.0
        delay_s = 1.2
        offset = -3.0
        [sensor]
        noise = 0.2
    "#,
    mean: 50.0,
    sd: 5.0,
    hold_ticks: 60,
    window_ticks: 900,
    effort: Effort::Holding,
};

const SERVO: Case = Case {
    name: "servo",
    file: r#"
        [loop]
        sample_time_s = 0.001
        [controller]
        kind = "p-velocity"
        kp = 15.0
        kv = 240.0
        velocity = "mean2"
        [plant]
        kind = "servo"
        output = "position"
        inertia = 100.0
        viscous = 200.0
        actuator_gain = 35.0
        [sensor]
        noise = 1e-6
        [[physics]]
        kind = "coulomb_friction"
        level = 20.0
    "#,
    mean: 0.0,
    sd: 0.05,
    hold_ticks: 100,
    window_ticks: 1500,
    effort: Effort::Motion,
};

struct Run {
    r: Vec<f64>,
    y: Vec<f64>,
    u: Vec<f64>,
    sample_time_s: f64,
}

impl Case {
    /// Healthy windows in full, after a settling time.
    fn run(&self, windows: usize, seed: u64) -> Run {
        let model = Loop::parse(self.file, "case.toml").unwrap();
        let mut simulation = Simulation::new(&model, seed).unwrap();
        let mut reference = Reference::random(self.mean, self.sd, self.hold_ticks, seed);
        let settle = 2 * self.window_ticks;
        let ticks = windows * self.window_ticks;
        let mut run = Run {
            r: Vec::with_capacity(ticks),
            y: Vec::with_capacity(ticks),
            u: Vec::with_capacity(ticks),
            sample_time_s: model.sample_time_s,
        };
        for tick in 0..settle + ticks {
            let r = reference.next().unwrap();
            let step = simulation.step(r, &[]);
            if tick >= settle {
                run.r.push(r);
                run.y.push(step.y);
                run.u.push(step.u);
            }
        }
        run
    }

    fn calibrate(&self, windows: usize, decisions: f64, seed: u64) -> Calibration {
        let run = self.run(windows, seed);
        let window_s = self.window_ticks as f64 * run.sample_time_s;
        let options = Options {
            window_s: Some(window_s),
            false_alarm_every_h: decisions * window_s / 3600.0,
            effort: self.effort,
            simulated_decisions: 400_000,
            ..Options::default()
        };
        let signals = Signals {
            name: self.name,
            sample_time_s: run.sample_time_s,
            r: &run.r,
            y: &run.y,
            u: &run.u,
            state: None,
        };
        calibrate(&[signals], &options).unwrap()
    }

    /// Coordinates of fresh healthy windows, in stretches.
    fn pool(&self, stretches: u64, windows: usize) -> Vec<Vec<[(f32, f32); 3]>> {
        let effort = match self.effort {
            Effort::Holding => ChannelKind::Effort,
            Effort::Motion => ChannelKind::MotionEffort,
        };
        let kinds = [ChannelKind::EnergyError(Index::Iae), effort, ChannelKind::Activity];
        let stretch = |seed: u64| {
            let run = self.run(windows, 1_000_000 + seed);
            let block = (self.window_ticks / 15) as u32;
            let config = Config::new(run.sample_time_s as f32, block, 15, kinds.map(Channel::unlearned));
            let mut monitor = HostMonitor::new(&config).unwrap();
            let samples = run.r.iter().zip(&run.y).zip(&run.u);
            let reports = samples.filter_map(|((&r, &y), &u)| monitor.tick(r as f32, y as f32, u as f32));
            reports.map(|report| report.channels.each_ref().map(|c| (c.x, c.value))).collect()
        };
        (0..stretches).into_par_iter().map(stretch).collect()
    }
}

/// Mean decisions to the first alarm of anything; everything starts anew after it.
fn realised(pool: &[Vec<[(f32, f32); 3]>], file: &BaselineFile) -> (f64, usize) {
    let channels = file.channels.map(|c| c.channel);
    let mut alarms = 0;
    for stretch in pool {
        let mut states = [CusumState::ZERO; 3];
        for window in stretch {
            let mut any = false;
            for ((channel, (x, value)), state) in channels.iter().zip(window).zip(&mut states) {
                let baseline = &channel.baseline;
                let z = baseline.standardise(*x, baseline.residual(*x, *value));
                any |= channel.detectors.shewhart.unwrap().check(z).is_some();
                any |= channel.detectors.cusum.unwrap().update(state, z).is_some();
            }
            if any {
                alarms += 1;
                states = [CusumState::ZERO; 3];
            }
        }
    }
    let decisions: usize = pool.iter().map(Vec::len).sum();
    (decisions as f64 / alarms.max(1) as f64, alarms)
}

struct Outcome {
    mean_ratio: f64,
    run_lengths: usize,
    kept: f64,
    delay: [f64; 2],
}

fn measure(case: &Case, pool: &[Vec<[(f32, f32); 3]>], n: f64, large: u64, small: u64) -> Outcome {
    let run = |windows: usize, count: u64, first: u64| -> Vec<(f64, usize, f64)> {
        let one = |seed: u64| {
            let calibration = case.calibrate(windows, n, first + seed);
            let (arl, alarms) = realised(pool, &calibration.file);
            (arl / n, alarms, calibration.cost.delay / calibration.cost.delay_exact)
        };
        (0..count).into_par_iter().map(one).collect()
    };
    let mean = |of: &[(f64, usize, f64)], f: fn(&(f64, usize, f64)) -> f64| {
        of.iter().map(f).sum::<f64>() / of.len() as f64
    };
    let many = run(2000, large, 1);
    let few = run(200, small, 1000);
    let kept = few.iter().filter(|(ratio, ..)| *ratio >= 1.0).count() as f64 / few.len() as f64;
    let outcome = Outcome {
        mean_ratio: mean(&many, |o| o.0),
        run_lengths: many.iter().map(|o| o.1).sum(),
        kept,
        delay: [mean(&many, |o| o.2), mean(&few, |o| o.2)],
    };
    println!(
        "{:6} N = {n:5}: realised/N {:.2} from 2000 windows ({} run lengths; {:.2} to {:.2}); {:.0} % of {} calibrations \
         from 200 windows keep N (mean {:.2}); delay x {:.3} and x {:.3}",
        case.name,
        outcome.mean_ratio,
        outcome.run_lengths,
        many.iter().map(|o| o.0).fold(f64::MAX, f64::min),
        many.iter().map(|o| o.0).fold(0.0, f64::max),
        100.0 * kept,
        few.len(),
        mean(&few, |o| o.0),
        outcome.delay[0],
        outcome.delay[1],
    );
    outcome
}

/// Where the window spans the loop's memory: mean run length 0.8 N to 1.5 N after 2000 windows, and nine of ten calibrations from 200
/// windows should keep N. That falls short: of 100, the flow loop keeps 96 and the servo 83. The bound here guards against worse.
fn keeps_its_promise(case: &Case) {
    let outcome = measure(case, &case.pool(20, 4000), 500.0, 20, 100);
    assert!(outcome.run_lengths >= 1500, "{}", outcome.run_lengths);
    assert!((0.8..1.5).contains(&outcome.mean_ratio), "{}", outcome.mean_ratio);
    assert!(outcome.kept >= 0.75, "{}", outcome.kept);
    assert!(outcome.delay[0] < 1.15 && outcome.delay[0] < outcome.delay[1], "{:?}", outcome.delay);
}

#[test]
#[ignore = "slow: simulates a hundred thousand windows"]
fn a_flow_loop_keeps_its_promise() {
    keeps_its_promise(&FLOW);
}

#[test]
#[ignore = "slow: simulates a hundred thousand windows"]
fn a_servo_keeps_its_promise() {
    keeps_its_promise(&SERVO);
}

/// The paper's plant swings with a period of 3.1 s and forgets in 5 s, so its 3 s windows are not independent: 200 of them are
/// worth 60, and the activity's residual is skewed by 1.5 to 2. After 2000 windows the promise is kept, carefully; after
/// 200 it is kept by half of the calibrations only, and the calibration warns of it.
#[test]
#[ignore = "slow: simulates a hundred thousand windows"]
fn the_papers_loop_needs_more_than_200_windows() {
    let outcome = measure(&PAPER, &PAPER.pool(20, 2000), 500.0, 6, 20);
    assert!((0.8..8.0).contains(&outcome.mean_ratio), "{}", outcome.mean_ratio);
    assert!(outcome.kept >= 0.3, "{}", outcome.kept);
    let warnings = PAPER.calibrate(200, 500.0, 3).warnings;
    assert!(warnings.iter().any(|w| w.contains("independent windows only")), "{warnings:?}");
}
