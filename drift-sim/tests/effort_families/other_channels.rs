//! Whether a memory would help the two channels that have none: `energy_error` and `activity`, on the same families, loads, seeds and rate
//! of false alarms. The core has no memory for them, so `calibrate` learns their relation in the effort channel's place and the residual is made here.

use drift_core::{Baseline, Channel, Memory};
use drift_sim::baseline_file::{BaselineFile, HostMonitor};
use drift_sim::calibrate::{Calibration, calibrate_windows};
use drift_sim::physics::Term;
use drift_sim::plant::Plant;
use rayon::prelude::*;

use super::{Family, LEARNT, Learnt, MOST, ONSET, Run, arrow, cusum, families, lag1, threshold};

/// Name and place in the monitor; the effort channel to compare with, on the same runs.
const CHANNELS: [(&str, usize); 3] = [("energy_error", 0), ("activity", 2), ("effort", 1)];
const ORDERS: [u8; 2] = [0, 3];
const RUNS: u64 = 24;

/// (x, value) of each window.
type Pairs = Vec<(f32, f32)>;

fn pairs(file: &BaselineFile, run: &Run) -> [Pairs; 3] {
    let mut monitor = HostMonitor::new(file.config().unwrap()).unwrap();
    let [r, y, u] = run;
    let mut all = [(); 3].map(|()| Pairs::new());
    for ((r, y), u) in r.iter().zip(y).zip(u) {
        if let Some(report) = monitor.tick(*r as f32, *y as f32, *u as f32) {
            for (pairs, (_, place)) in all.iter_mut().zip(CHANNELS) {
                pairs.push((report.channels[place].x, report.channels[place].value));
            }
        }
    }
    all
}

/// A relation, and the threshold behind it.
struct Remembered {
    baseline: Baseline,
    memory: Memory,
    h: f64,
}

impl Remembered {
    /// `calibrate` learns the effort channel's relation from this channel's x and value in place of its own.
    fn learn(
        family: &Family,
        learnt: &Calibration,
        place: usize,
        order: Option<u8>,
        healthy: &Pairs,
    ) -> Self {
        let mut rows = learnt.windows.clone();
        for row in &mut rows {
            (row.x[1], row.value[1]) = (row.x[place], row.value[place]);
        }
        let calibration = calibrate_windows(rows, learnt.file.timing, &family.options(order)).unwrap();
        let Channel { baseline, memory, .. } = calibration.file.channels[1].channel;
        let mut learnt = Self { baseline, memory, h: 0.0 };
        learnt.h = threshold(&learnt.residuals(healthy));
        learnt
    }

    /// Standardised as the monitor does; NaN while the memory fills.
    fn residuals(&self, pairs: &Pairs) -> Vec<f64> {
        let order = usize::from(self.memory.order);
        let residual = |at: usize| {
            let (x, value) = pairs[at];
            if at < order {
                return f64::NAN;
            }
            let carried = |j: usize| {
                self.memory.x[j] * pairs[at - 1 - j].0 + self.memory.value[j] * pairs[at - 1 - j].1
            };
            let value = value - (0..order).map(carried).sum::<f32>();
            f64::from(self.baseline.standardise(x, self.baseline.residual(x, value)))
        };
        (0..pairs.len()).map(residual).collect()
    }

    fn delay(&self, pairs: &Pairs) -> f64 {
        cusum(&self.residuals(pairs)[ONSET..], self.h).0.unwrap_or(MOST).min(MOST) as f64
    }
}

/// The channels of a family at each order.
struct Channels<'a> {
    effort: Learnt<'a>,
    file: BaselineFile,
    /// By channel, then by order.
    watches: [[Remembered; 2]; 3],
    lag1: [[f64; 2]; 3],
    /// The order that `calibrate` would take.
    chosen: [u8; 3],
}

/// Mean delays by channel, then by order.
type Delays = [[f64; 2]; 3];

impl<'a> Channels<'a> {
    fn new(family: &'a Family) -> Self {
        let effort = Learnt::new(family);
        let file = effort.watches[0].file.clone();
        let learnt = family.calibrated(&family.run(LEARNT, 11, |_| 0.0, &[], effort.noise), Some(0));
        let healthy = pairs(&file, &family.run(family.healthy, 12, |_| 0.0, &[], effort.noise));
        let learn = |c: usize, order| Remembered::learn(family, &learnt, CHANNELS[c].1, order, &healthy[c]);
        let watches = [0, 1, 2].map(|c| ORDERS.map(|order| learn(c, Some(order))));
        let lag1 = [0, 1, 2].map(|c: usize| watches[c].each_ref().map(|w| lag1(&w.residuals(&healthy[c]))));
        let chosen = [0, 1, 2].map(|c| learn(c, None).memory.order);
        Self { effort, file, watches, lag1, chosen }
    }

    /// `lifted`: by how many of its own sigma0 each index itself is lifted from the onset on.
    fn delays(&self, lifted: f64, make: impl Fn(u64) -> Run + Sync) -> Delays {
        let each = |seed: u64| {
            let mut all = pairs(&self.file, &make(seed));
            for (pairs, [without, ..]) in all.iter_mut().zip(&self.watches) {
                let lift =
                    if seed.is_multiple_of(2) { lifted } else { -lifted } as f32 * without.baseline.sigma;
                pairs[ONSET..].iter_mut().for_each(|(_, value)| *value += lift);
            }
            [0, 1, 2].map(|c: usize| self.watches[c].each_ref().map(|watch| watch.delay(&all[c])))
        };
        let all: Vec<Delays> = (0..RUNS).into_par_iter().map(each).collect();
        [0, 1, 2]
            .map(|c: usize| [0, 1].map(|o: usize| all.iter().map(|d| d[c][o]).sum::<f64>() / RUNS as f64))
    }

    fn with(&self, terms: &[Term], load: f64) -> Delays {
        let Learnt { family, noise, sigma0, .. } = &self.effort;
        self.delays(0.0, |seed| {
            let size = if seed.is_multiple_of(2) { load } else { -load } * sigma0;
            let load = |window: f64| size * (window - ONSET as f64).clamp(0.0, 1.0);
            family.run(ONSET + MOST, 100 + seed, load, terms, *noise)
        })
    }

    /// The index itself, the load, and the faults that these channels are for; `None` where the plant can't have it.
    fn all(&self) -> Vec<Option<Delays>> {
        let Learnt { family, noise, sigma0, .. } = &self.effort;
        let term = |kind: &str, name: &str, value: f64| Term::new(kind, &[(name, value)]).ok();
        let friction = match &family.model.plant {
            Plant::Servo(servo) => term("coulomb_friction", "level", 3.0 * sigma0 * servo.actuator_gain),
            _ => None,
        };
        let faults = [
            term("gain_loss", "loss", 0.1),
            term("gain_loss", "loss", 0.3),
            friction,
            term("sensor_noise", "ratio", 10.0),
        ];
        let itself = self.delays(1.5, |seed| family.run(ONSET + MOST, 100 + seed, |_| 0.0, &[], *noise));
        let mut all = vec![Some(itself), Some(self.with(&[], 1.5))];
        all.extend(faults.map(|term| term.map(|term| self.with(&[term], 0.0))));
        all
    }
}

/// What the test prints and asserts of some families.
fn measured(title: &str, families: &[Family]) {
    let learnt: Vec<Channels<'_>> = families.par_iter().map(Channels::new).collect();
    let delays: Vec<_> = learnt.iter().map(Channels::all).collect();
    println!("{title}\n");
    for (c, (channel, _)) in CHANNELS.into_iter().enumerate() {
        println!(
            "| {channel} | residual's lag-1 correlation | its sigma, part of that without | order chosen | visible | the index by 1.5 of its own sigma0 | load of 1.5 sigma0 | gain, 10 % lost | 30 % lost | dry friction of 3 sigma0 | sensor noise, ten times |\n|---|---|---|---|---|---|---|---|---|---|---|"
        );
        for (l, all) in learnt.iter().zip(&delays) {
            let cells = all.iter().map(|delays| delays.map_or("-".to_owned(), |delays| arrow(delays[c])));
            let ([without, with], [forgets, remembers]) = (l.lag1[c], &l.watches[c]);
            println!(
                "| {} | {without:.2} -> {with:.2} | {:.2} | {} | {:.2} | {} |",
                l.effort.family.name,
                remembers.baseline.sigma / forgets.baseline.sigma,
                l.chosen[c],
                remembers.memory.visible(),
                cells.collect::<Vec<_>>().join(" | ")
            );
        }
        println!();
    }
    for (l, all) in learnt.iter().zip(&delays) {
        let name = l.effort.family.name;
        let [ten, thirty] = [all[2].unwrap(), all[3].unwrap()];
        // energy_error finds lost gain no sooner with memory ...
        for [without, with] in [ten[0], thirty[0]] {
            assert!(with > 0.7 * without, "{title}, {name}: energy_error {without} -> {with}");
        }
        assert!(l.lag1[0][1].abs() < 0.2, "{title}, {name}: energy_error's lag-1 {}", l.lag1[0][1]);
        // ... and activity only on the plants that integrate.
        let [without, with] = ten[1];
        let integrates = ["level", "servo"].contains(&name);
        let as_written = if integrates { with < 0.6 * without } else { with > 0.6 * without };
        assert!(as_written, "{title}, {name}: activity {without} -> {with}");
    }
}

#[test]
#[ignore = "half a minute of simulations, in release"]
fn memory_on_the_channels_without() {
    let mut families = families();
    measured("The reference's moves begin with a window:", &families);
    // Held by 7 % longer, they begin anywhere in it.
    families.iter_mut().for_each(|family| family.levels.2 *= 1.0737);
    measured("They begin anywhere in a window:", &families);
}
