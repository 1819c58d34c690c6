//! The effort channel's memory on seven families of loops: our own simulator's plants under their usual laws, a reference that
//! wanders, a slow random load on each (process noise), and faults whose onset and size are known. Three tables: loads, other
//! faults, and how many healthy windows a memory needs. All seeds are fixed.

mod other_channels;

use std::fmt::Write as _;

use drift_sim::baseline_file::{BaselineFile, HostMonitor};
use drift_sim::calibrate::{Calibration, Options, Signals, calibrate};
use drift_sim::control_loop::Loop;
use drift_sim::measured_input::{Enters, Gain, Input};
use drift_sim::physics::Term;
use drift_sim::plant::Plant;
use drift_sim::reference::Reference;
use drift_sim::simulate::{Start, simulate};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Healthy windows that a baseline is learnt from.
const LEARNT: usize = 500;
/// Healthy windows between false alarms, for which every threshold is set on windows of its own.
const FALSE_ALARM_EVERY: usize = 300;
/// A delay is counted as far as this.
const MOST: usize = 120;
/// Windows before a fault sets in.
const ONSET: usize = 10;
/// Windows left out at a run's start, where the loop still settles.
const SETTLING: usize = 5;
/// The CUSUM's reference value, sigmas.
const K: f64 = 0.5;

struct Family {
    name: &'static str,
    model: Loop,
    /// Ticks of a window.
    window: usize,
    /// Mean, standard deviation and duration (windows) of the reference's levels; ticks over which one goes into the next.
    levels: (f64, f64, f64, usize),
    /// Effort that holds a y.
    holding: fn(f64) -> f64,
    /// Windows on which thresholds are set.
    healthy: usize,
    /// The random load's standard deviation, of that of u.
    process_noise: f64,
}

fn family(
    name: &'static str,
    file: &str,
    window: usize,
    levels: (f64, f64, f64, usize),
    holding: fn(f64) -> f64,
) -> Family {
    let mut model = Loop::parse(file, name).unwrap();
    model.inputs = vec![Input::of_column("load", Enters::Load, Gain::Stated(1.0))];
    Family { name, model, window, levels, holding, healthy: 3000, process_noise: 0.03 }
}

fn families() -> Vec<Family> {
    let mut all = vec![
        family(
            "motor",
            "[loop]\nsample_time_s = 0.002\n[controller]\nkind = \"pi\"\nkp = 1.33\nki = 8.33\n\
             [plant]\nkind = \"servo\"\noutput = \"speed\"\ninertia = 0.008\nviscous = 0.015\nactuator_gain = 0.15\n[sensor]\nnoise = 0.02\n",
            150,
            (10.0, 25.0, 5.0, 40),
            |y| 0.1 * y,
        ),
        family(
            "flow",
            "[loop]\nsample_time_s = 0.5\n[controller]\nkind = \"pi\"\nkp = 0.74\nki = 0.0926\nu_min = 0.0\nu_max = 100.0\n\
             [plant]\nkind = \"first-order\"\ngain = 1.0\ntime_constant_s = 8.0\ndelay_s = 1.2\noffset = -3.0\n[sensor]\nnoise = 0.05\n",
            40,
            (47.0, 8.0, 6.0, 10),
            |y| y + 3.0,
        ),
        family(
            "thermal",
            "[loop]\nsample_time_s = 1.0\n[controller]\nkind = \"pi\"\nkp = 3.6\nki = 0.025\nu_min = 0.0\nu_max = 100.0\n\
             [plant]\nkind = \"first-order\"\ngain = 0.8\ntime_constant_s = 200.0\ndelay_s = 10.0\noffset = 21.0\n[sensor]\nnoise = 0.02\n",
            300,
            (49.0, 6.0, 5.0, 75),
            |y| (y - 21.0) / 0.8,
        ),
        family(
            "level",
            "[loop]\nsample_time_s = 1.0\n[controller]\nkind = \"pi\"\nkp = 10.0\nki = 0.0625\nu_min = -100.0\nu_max = 100.0\n\
             [plant]\nkind = \"transfer-function\"\nnum = [0.005]\nden = [1.0, 0.0]\n[sensor]\nnoise = 0.03\n",
            150,
            (50.0, 5.0, 6.0, 40),
            |_| 0.0,
        ),
        family(
            "two lags",
            "[loop]\nsample_time_s = 0.2\n[controller]\nkind = \"pi\"\nkp = 1.36\nki = 0.0758\nu_min = -100.0\nu_max = 200.0\n\
             [plant]\nkind = \"transfer-function\"\nnum = [1.2]\nden = [56.0, 18.0, 1.0]\n[sensor]\nnoise = 0.012\n",
            150,
            (60.0, 10.0, 5.0, 40),
            |y| y / 1.2,
        ),
        family(
            "the paper's plant",
            "[loop]\nsample_time_s = 0.001\n[controller]\nkind = \"pi\"\nkp = 300.0\nki = 100.0\n[plant]\nkind = \"state-space\"\n\
             a = [[-0.2, 2.0, 0.0], [-2.0, -0.2, 0.0], [0.0, 0.0, -0.5]]\nb = [[1.0], [0.0], [0.0]]\nc = [[1.0, 0.0, 0.0]]\n\
             d = [[0.0]]\n[sensor]\nnoise = 0.001\n",
            3000,
            (0.1, 1.0, 1.0 / 60.0, 1),
            |_| 0.0,
        ),
        family(
            "servo",
            "[loop]\nsample_time_s = 0.001\n[controller]\nkind = \"p-velocity\"\nkp = 22.5\nkv = 216.0\n\
             [plant]\nkind = \"servo\"\noutput = \"position\"\ninertia = 80.0\nviscous = 200.0\nactuator_gain = 30.0\n[sensor]\nnoise = 1e-6\n",
            300,
            (0.12, 0.08, 4.0, 75),
            |_| 0.0,
        ),
    ];
    for family in &mut all {
        if family.window > 1000 {
            family.healthy = 900;
        }
    }
    // As the paper has it. Its u has large kicks, so that three hundredths of it are most of what moves a window's mean.
    let at = all.iter().position(|f| f.name == "the paper's plant").unwrap();
    let (name, model) = ("the same, no random load", all[at].model.clone());
    all.insert(at + 1, Family { name, model, process_noise: 0.0, ..all[at] });
    all
}

/// r, y, u.
type Run = [Vec<f64>; 3];

impl Family {
    /// So many windows under a load (in units of u, by the window) and terms that set in at [`ONSET`].
    fn run(&self, windows: usize, seed: u64, load: impl Fn(f64) -> f64, terms: &[Term], noise: f64) -> Run {
        let ticks = (windows + SETTLING) * self.window;
        let (mean, sd, hold, smooth) = self.levels;
        let hold = (hold * self.window as f64) as u64;
        let raw = Reference::random(mean, sd, hold, seed).take_samples(ticks + smooth);
        let mut r = Vec::with_capacity(ticks);
        let mut sum: f64 = raw[..smooth].iter().sum();
        for tick in 0..ticks {
            r.push(sum / smooth as f64);
            sum += raw[tick + smooth] - raw[tick];
        }
        let drive = self.model.plant.drive_gain();
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x10ad);
        let keep = 1.0 - 1.0 / (2.0 * self.window as f64);
        let mut slow = 0.0;
        let load: Vec<f64> = (0..ticks)
            .map(|tick| {
                let shock: f64 = StandardNormal.sample(&mut rng);
                slow = keep * slow + (1.0 - keep * keep).sqrt() * shock;
                drive * (noise * slow + load(tick as f64 / self.window as f64 - SETTLING as f64))
            })
            .collect();
        let mut model = self.model.clone();
        let onset_s = ((ONSET + SETTLING) * self.window) as f64 * model.sample_time_s;
        model.physics = terms.iter().map(|term| term.clone().from_s(onset_s)).collect();
        let start = Start::held(r[0], (self.holding)(r[0]));
        let trace = simulate(&model, &r, &[load], seed, Some(&start)).unwrap();
        let from = SETTLING * self.window;
        [r.split_off(from), trace.y[from..].to_vec(), trace.u[from..].to_vec()]
    }

    fn window_s(&self) -> f64 {
        self.window as f64 * self.model.sample_time_s
    }

    fn options(&self, order: Option<u8>) -> Options {
        Options {
            window_s: Some(self.window_s()),
            false_alarm_every_h: FALSE_ALARM_EVERY as f64 * self.window_s() / 3600.0,
            channels: [false, true, false],
            detectors: "cusum".parse().unwrap(),
            effort_memory: order,
            simulated_decisions: 200_000,
            ..Options::default()
        }
    }

    fn calibrated(&self, run: &Run, order: Option<u8>) -> Calibration {
        let [r, y, u] = run;
        let sample_time_s = self.model.sample_time_s;
        let signals = Signals { name: self.name, sample_time_s, r, y, u, state: None, further: &[] };
        calibrate(&[signals], &self.options(order)).unwrap()
    }
}

/// The effort channel's standardised residuals, window by window; NaN while its memory fills.
fn residuals(file: &BaselineFile, run: &Run) -> Vec<f64> {
    let mut monitor = HostMonitor::new(file.config().unwrap()).unwrap();
    let [r, y, u] = run;
    let z = |i: usize| Some(f64::from(monitor.tick(r[i] as f32, y[i] as f32, u[i] as f32)?.channels[1].z));
    (0..r.len()).filter_map(z).collect()
}

/// Windows to the first alarm of a two-sided CUSUM, or none; and how often it alarms if it starts anew each time.
fn cusum(z: &[f64], h: f64) -> (Option<usize>, usize) {
    let (mut high, mut low, mut first, mut alarms) = (0.0f64, 0.0f64, None, 0);
    for (i, z) in z.iter().enumerate().filter(|(_, z)| z.is_finite()) {
        (high, low) = ((high + z - K).max(0.0), (low - z - K).max(0.0));
        if high > h || low > h {
            (high, low) = (0.0, 0.0);
            first = first.or(Some(i + 1));
            alarms += 1;
        }
    }
    (first, alarms)
}

/// The threshold with one false alarm in [`FALSE_ALARM_EVERY`] of these healthy windows.
fn threshold(z: &[f64]) -> f64 {
    let (mut low, mut high) = (1.0, 100.0);
    for _ in 0..30 {
        let h = 0.5 * (low + high);
        if cusum(z, h).1 * FALSE_ALARM_EVERY > z.len() { low = h } else { high = h }
    }
    high
}

fn lag1(z: &[f64]) -> f64 {
    let z: Vec<f64> = z.iter().copied().filter(|z| z.is_finite()).collect();
    let mean = z.iter().sum::<f64>() / z.len() as f64;
    let product: f64 = z.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum();
    product / z.iter().map(|z| (z - mean).powi(2)).sum::<f64>()
}

/// A baseline and its threshold.
struct Watch {
    file: BaselineFile,
    h: f64,
}

impl Watch {
    fn delay(&self, run: &Run) -> usize {
        let z = residuals(&self.file, run);
        cusum(&z[ONSET..], self.h).0.unwrap_or(MOST).min(MOST)
    }
}

/// A family with what it has learnt at order 0 and order 3.
struct Learnt<'a> {
    family: &'a Family,
    noise: f64,
    /// Standard deviation of the memoryless residual, units of u.
    sigma0: f64,
    watches: [Watch; 2],
    lag1: [f64; 2],
    visible: f64,
    chosen: u8,
}

impl<'a> Learnt<'a> {
    fn new(family: &'a Family) -> Self {
        let none = |_: f64| 0.0;
        let [_, _, u] = family.run(60, 5, none, &[], 0.0);
        let mean = u.iter().sum::<f64>() / u.len() as f64;
        let noise = family.process_noise
            * (u.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / u.len() as f64).sqrt();
        let learnt = family.run(LEARNT, 11, none, &[], noise);
        let healthy = family.run(family.healthy, 12, none, &[], noise);
        let calibrations = [Some(0), Some(3)].map(|order| family.calibrated(&learnt, order));
        let z = calibrations.each_ref().map(|c| residuals(&c.file, &healthy));
        let [without, with] = &calibrations;
        Self {
            family,
            noise,
            sigma0: without.channels[0].fit.rmse,
            lag1: z.each_ref().map(|z| lag1(z)),
            visible: f64::from(with.channels[0].memory.visible()),
            chosen: family.calibrated(&learnt, None).channels[0].memory.order,
            watches: [0, 1].map(|i| Watch { file: calibrations[i].file.clone(), h: threshold(&z[i]) }),
        }
    }

    /// Mean delays at order 0 and 3 over so many runs; each run is seen by both.
    fn delays(&self, runs: u64, make: impl Fn(u64) -> Run + Sync) -> [f64; 2] {
        let each = |seed: u64| {
            let run = make(seed);
            self.watches.each_ref().map(|watch| watch.delay(&run) as f64)
        };
        let all: Vec<[f64; 2]> = (0..runs).into_par_iter().map(each).collect();
        [0, 1].map(|i| all.iter().map(|d| d[i]).sum::<f64>() / runs as f64)
    }

    /// A load of so many sigma0, to either side by turns, reached after so many windows.
    fn load(&self, runs: u64, sigmas: f64, over: f64) -> [f64; 2] {
        self.delays(runs, |seed| {
            let size = if seed.is_multiple_of(2) { sigmas } else { -sigmas } * self.sigma0;
            let load = |window: f64| size * ((window - ONSET as f64) / over).clamp(0.0, 1.0);
            self.family.run(ONSET + MOST, 100 + seed, load, &[], self.noise)
        })
    }

    fn fault(&self, term: &Term) -> [f64; 2] {
        let terms = std::slice::from_ref(term);
        self.delays(8, |seed| self.family.run(ONSET + MOST, 300 + seed, |_| 0.0, terms, self.noise))
    }

    /// Other faults of a size that is usual for them; `None` where the plant can't have it.
    fn faults(&self) -> [Option<Term>; 5] {
        let term = |kind: &str, name: &str, value: f64| Term::new(kind, &[(name, value)]).ok();
        let model = &self.family.model;
        let friction = match &model.plant {
            Plant::Servo(servo) => term("coulomb_friction", "level", self.sigma0 * servo.actuator_gain),
            _ => None,
        };
        [
            term("gain_loss", "loss", 0.1),
            friction,
            term("unmodelled_lag", "time_constant_s", self.family.window_s() / 100.0),
            term("sensor_bias", "bias", 0.1 * self.family.levels.1),
            term("sensor_noise", "ratio", 3.0),
        ]
    }
}

fn shown(delay: f64) -> String {
    // Beyond, most runs end without an alarm.
    if delay > 90.0 { "> 90".to_owned() } else { format!("{delay:.1}") }
}

fn arrow([without, with]: [f64; 2]) -> String {
    format!("{} -> {}", shown(without), shown(with))
}

#[test]
#[ignore = "a minute of simulations, in release"]
fn memory_on_seven_families() {
    let families = families();
    let learnt: Vec<Learnt<'_>> = families.par_iter().map(Learnt::new).collect();
    let mut table = String::from(
        "| family | load of 0.5 sigma0 | 1.5 sigma0 | 1 sigma0 over 200 windows | residual's lag-1 correlation | order chosen | visible of a lasting shift |\n|---|---|---|---|---|---|---|\n",
    );
    let mut faster = Vec::new();
    for l in &learnt {
        let loads = [l.load(24, 0.5, 1.0), l.load(24, 1.5, 1.0), l.load(14, 1.0, 200.0)];
        writeln!(
            table,
            "| {} | {} | {} | {} | {:.2} -> {:.2} | {} | {:.2} |",
            l.family.name,
            arrow(loads[0]),
            arrow(loads[1]),
            arrow(loads[2]),
            l.lag1[0],
            l.lag1[1],
            l.chosen,
            l.visible
        )
        .unwrap();
        faster.push((l, loads));
    }
    println!("{table}");
    let mut table = String::from(
        "| family | gain, 10 % lost | dry friction of 1 sigma0 | lag of a hundredth window | sensor bias, a tenth of r's sd | sensor noise, three times |\n|---|---|---|---|---|---|\n",
    );
    for l in &learnt {
        let cells = l.faults().map(|term| term.map_or("-".to_owned(), |term| arrow(l.fault(&term))));
        writeln!(table, "| {} | {} |", l.family.name, cells.join(" | ")).unwrap();
    }
    println!("{table}");
    for (l, loads) in faster {
        let (name, lag1) = (l.family.name, l.lag1[1]);
        for [without, with] in loads.into_iter().filter(|_| l.chosen > 0) {
            assert!(with < without, "{name}: {without} -> {with} windows, slower with memory");
        }
        assert!(lag1.abs() < 0.25, "{name}: lag-1 {lag1} with memory");
    }
}

/// The order chosen, false alarms on healthy windows, the delay to a load.
type Outcome = (u8, usize, usize);

/// What calibrations from few windows choose, promise and find: means of eight of each length.
#[test]
#[ignore = "half a minute of simulations, in release"]
fn memory_after_short_calibrations() {
    println!(
        "| family | windows learnt | orders chosen | false alarm every, windows ({FALSE_ALARM_EVERY} asked) | load of 1.5 sigma0: order 0 -> chosen |"
    );
    println!("|---|---|---|---|---|");
    for family in families().iter().filter(|f| ["thermal", "two lags", "motor"].contains(&f.name)) {
        let l = Learnt::new(family);
        let healthy = family.run(1500, 13, |_| 0.0, &[], l.noise);
        for windows in [60, 100, 150, 200, 300, 500] {
            let each = |seed: u64| {
                let run = family.run(windows, 500 + seed, |_| 0.0, &[], l.noise);
                let of = |order: Option<u8>| {
                    let calibration = family.calibrated(&run, order);
                    let channel = &calibration.channels[0];
                    let h = f64::from(channel.detectors.cusum.unwrap().h);
                    let watch = Watch { file: calibration.file.clone(), h };
                    let size = if seed.is_multiple_of(2) { 1.5 } else { -1.5 } * l.sigma0;
                    let load = |window: f64| size * (window - ONSET as f64).clamp(0.0, 1.0);
                    let loaded = family.run(ONSET + MOST, 700 + seed, load, &[], l.noise);
                    let alarms = cusum(&residuals(&watch.file, &healthy), h).1;
                    (channel.memory.order, alarms, watch.delay(&loaded))
                };
                (of(Some(0)), of(None))
            };
            let all: Vec<_> = (0..8u64).into_par_iter().map(each).collect();
            let mean = |of: &dyn Fn(&(Outcome, Outcome)) -> usize| {
                all.iter().map(of).sum::<usize>() as f64 / all.len() as f64
            };
            let orders: Vec<String> = all.iter().map(|(_, chosen)| chosen.0.to_string()).collect();
            let every = |alarms: f64| 1500.0 / alarms.max(1.0 / 8.0);
            println!(
                "| {} | {windows} | {} | {:.0} -> {:.0} | {:.1} -> {:.1} |",
                family.name,
                orders.join(" "),
                every(mean(&|a| a.0.1)),
                every(mean(&|a| a.1.1)),
                mean(&|a| a.0.2),
                mean(&|a| a.1.2)
            );
            assert!(every(mean(&|a| a.1.1)) > 150.0, "{}: {windows} windows", family.name);
        }
    }
}

/// The paper's loop, r as there; a drift of the sensor from `onset_s` on, over 100 s to `mu_max`, where it stays.
fn paper_run(duration_s: f64, onset_s: f64, mu_max: f64, seed: u64) -> Run {
    let mut model = Loop::paper();
    let ramp =
        |rate: f64, from_s: f64| Term::new("sensor_drift", &[("rate_per_s", rate)]).unwrap().from_s(from_s);
    if mu_max > 0.0 {
        model.physics = vec![ramp(mu_max / 100.0, onset_s), ramp(-mu_max / 100.0, onset_s + 100.0)];
    }
    let r = Reference::paper(seed).take_samples((duration_s / model.sample_time_s).round() as usize);
    let trace = simulate(&model, &r, &[], seed, None).unwrap();
    [r, trace.y, trace.u]
}

/// The paper's own drift: seconds from its onset to the effort channel's alarm, without and with the memory that `calibrate` takes, at one
/// false alarm in 2000 s of healthy windows.
#[test]
#[ignore = "simulates some 100 million ticks, in release"]
fn memory_on_the_papers_drift() {
    const WINDOW_S: f64 = 3.0;
    let family = Family { model: Loop::paper(), window: 3000, ..families().pop().unwrap() };
    let settled = |run: Run| run.map(|signal| signal[30_000..].to_vec());
    let learnt = settled(paper_run(2730.0, 0.0, 0.0, 21));
    let healthy: Vec<Run> =
        (0..10u64).into_par_iter().map(|i| settled(paper_run(3030.0, 0.0, 0.0, 2200 + i))).collect();
    println!("| mu_max | order 0, s | memory of calibrate, s | order | visible |");
    println!("|---|---|---|---|---|");
    let watches: Vec<(Watch, u8, f32)> = [Some(0), None]
        .into_par_iter()
        .map(|order| {
            let calibration = family.calibrated(&learnt, order);
            let z: Vec<f64> = healthy.iter().flat_map(|run| residuals(&calibration.file, run)).collect();
            let (mut low, mut high) = (1.0, 100.0);
            for _ in 0..30 {
                let h = 0.5 * (low + high);
                if cusum(&z, h).1 as f64 * 2000.0 > z.len() as f64 * WINDOW_S { low = h } else { high = h }
            }
            let memory = calibration.channels[0].memory;
            (Watch { file: calibration.file, h: high }, memory.order, memory.visible())
        })
        .collect();
    for mu_max in [0.3, 1.0, 3.0] {
        let delays: Vec<[f64; 2]> = (0..100u64)
            .into_par_iter()
            .map(|seed| {
                let run = paper_run(360.0, 60.0, mu_max, 5000 + seed);
                [0, 1].map(|i: usize| {
                    let z = residuals(&watches[i].0.file, &run);
                    WINDOW_S * cusum(&z[20..], watches[i].0.h).0.unwrap_or(100) as f64
                })
            })
            .collect();
        let [without, with] = [0, 1].map(|i: usize| delays.iter().map(|d| d[i]).sum::<f64>() / 100.0);
        println!("| {mu_max} | {without:.1} | {with:.1} | {} | {:.2} |", watches[1].1, watches[1].2);
        assert!(with < 0.7 * without, "mu_max {mu_max}: {without} -> {with} s");
    }
}
