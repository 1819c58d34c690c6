//! Thresholds for a wanted mean run length between false alarms of the whole monitor: any detector of any channel counts.
//!
//! Every detector gets the same share of the false alarms. Shewhart limits come from the [`super::marginal::Marginal`]'s tails, half
//! the share on each side. CUSUM and SPRT thresholds come from one long simulation of the process: the maxima of a statistic between
//! two visits to its restart give its alarm rate at every threshold at once; their tail is exponential, which is used to smooth
//! it and, for rates that the simulation does not reach, to extrapolate it. At last the shares are scaled until
//! the real detectors together have the wanted run length on the simulated residuals, since alarms that coincide
//! count once. That scale is found at up to [`JOINT`] decisions and kept beyond.

use drift_core::{
    Cusum, CusumState, Detector, DetectorState, DetectorStates, Detectors, Shewhart, Sprt, SprtState,
};
use rayon::prelude::*;

use super::caution::Margin;
use super::marginal;
use super::process::{Process, Series};

/// Decisions of the run length at which coinciding alarms are counted.
const JOINT: f64 = 1000.0;
/// Seed of the simulation; any would do.
const SEED: u64 = 0x6472_6966_7401;
/// Log odds at which an SPRT restarts: 1 to 100.
const SPRT_LOWER: f64 = -4.605_170_185_988_091;

/// Which detectors watch each channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DetectorChoice {
    /// A limit on each single residual (Shewhart): fast for large shifts.
    pub shewhart: bool,
    /// A two-sided CUSUM: for small shifts that stay.
    pub cusum: bool,
    /// A repeated sequential probability ratio test.
    pub sprt: bool,
}

impl DetectorChoice {
    /// How many of them.
    pub fn count(self) -> usize {
        usize::from(self.shewhart) + usize::from(self.cusum) + usize::from(self.sprt)
    }
}

/// The alarm rate of one statistic at every threshold.
#[derive(Debug)]
struct Excursions {
    /// Maxima, falling.
    maxima: Vec<f32>,
    decisions: f64,
}

impl Excursions {
    fn new(mut maxima: Vec<f32>, decisions: usize) -> Self {
        maxima.sort_by(|a, b| b.total_cmp(a));
        Self { maxima, decisions: decisions as f64 }
    }

    /// The threshold that is exceeded this often per decision.
    fn threshold(&self, rate: f64) -> f64 {
        let count = rate * self.decisions;
        let fitted = ((3.0 * count).max(1000.0) as usize).min(self.maxima.len() / 2).max(1);
        let at = |i: usize| self.maxima.get(i).map_or(0.0, |&m| f64::from(m));
        let base = at(fitted);
        if count >= fitted as f64 {
            return at(count as usize).max(1e-3);
        }
        let excess: f64 = (0..fitted).map(|i| at(i) - base).sum::<f64>() / fitted as f64;
        base + excess * libm::log(fitted as f64 / count)
    }
}

/// The simulated healthy residuals and what the detectors' statistics did on them.
#[derive(Debug)]
pub(super) struct Simulated<'p> {
    process: &'p Process,
    choice: DetectorChoice,
    k: f64,
    series: Vec<Series>,
    exact: Watched,
    cautious: Watched,
}

/// What the detectors' statistics did where the baseline is this wrong.
#[derive(Debug)]
struct Watched {
    margins: Vec<Margin>,
    cusum: Vec<Excursions>,
    sprt: Vec<Excursions>,
}

/// Maxima of a statistic between its restarts.
type Maxima = fn(f64, Margin, &[f64]) -> Vec<f32>;

impl<'p> Simulated<'p> {
    /// `margins`: how wrong each channel's baseline may be.
    pub(super) fn new(
        process: &'p Process,
        choice: DetectorChoice,
        k: f64,
        decisions: usize,
        margins: &[Margin],
    ) -> Self {
        let stretches = 64;
        let each = decisions.div_ceil(stretches);
        let series = process.simulate_many(stretches, each, SEED);
        let total = stretches * each;
        let gather = |of: &(dyn Fn(&[f64]) -> Vec<f32> + Sync), c: usize| -> Excursions {
            let maxima: Vec<Vec<f32>> = series.par_iter().map(|s| of(&s[c])).collect();
            Excursions::new(maxima.concat(), total)
        };
        let of_all = |maxima: Maxima, margins: &[Margin]| -> Vec<Excursions> {
            margins.iter().enumerate().map(|(c, m)| gather(&|z| maxima(k, *m, z), c)).collect()
        };
        let watched_with = |margins: &[Margin]| Watched {
            margins: margins.to_vec(),
            cusum: if choice.cusum { of_all(cusum_maxima, margins) } else { Vec::new() },
            sprt: if choice.sprt { of_all(sprt_maxima, margins) } else { Vec::new() },
        };
        let exact = watched_with(&vec![Margin::NONE; process.channels.len()]);
        let cautious = watched_with(margins);
        Self { process, choice, k, series, exact, cautious }
    }

    /// Detectors of every channel with this mean run length (decisions) between false alarms of all together,
    /// margins included.
    pub(super) fn detectors(&self, arl: f64) -> Vec<Detectors> {
        self.with_share(self.coinciding(arl.min(JOINT)) / arl, &self.cautious)
    }

    /// The same without margins, as if the baseline were known exactly.
    pub(super) fn exact(&self, arl: f64) -> Vec<Detectors> {
        self.with_share(self.coinciding(arl.min(JOINT)) / arl, &self.exact)
    }

    /// By how much the shares may add up to more than the whole.
    fn coinciding(&self, arl: f64) -> f64 {
        let mut scale = 1.0;
        for _ in 0..5 {
            scale *= self.run_length(&self.with_share(scale / arl, &self.exact)) / arl;
        }
        scale
    }

    /// All detectors with an equal share of this total alarm rate.
    fn with_share(&self, total: f64, watched: &Watched) -> Vec<Detectors> {
        let count = self.process.channels.len() * self.choice.count();
        let rate = total / count.max(1) as f64;
        let limit = marginal::exceeded_with(0.5 * rate.min(0.5));
        let of = |c: usize| Detectors {
            shewhart: self.choice.shewhart.then(|| {
                let (law, margin) = (&self.process.channels[c].marginal, watched.margins[c]);
                // A limit lies on its own side, however skewed the law.
                let lower = margin.apart(law.at(-limit), -limit).min(-1e-3);
                let upper = margin.apart(law.at(limit), limit).max(1e-3);
                Shewhart { lower: lower as f32, upper: upper as f32 }
            }),
            cusum: watched.cusum.get(c).map(|e| Cusum::new(self.k as f32, e.threshold(rate) as f32)),
            sprt: watched.sprt.get(c).map(|e| sprt(self.k, e.threshold(rate) as f32)),
            ..Detectors::NONE
        };
        (0..self.process.channels.len()).map(of).collect()
    }

    /// Mean decisions to the first alarm of any detector on the simulated residuals; all start anew after it.
    pub(super) fn run_length(&self, detectors: &[Detectors]) -> f64 {
        let alarms: usize = self.series.par_iter().map(|s| count_alarms(s, detectors)).sum();
        let decisions: usize = self.series.iter().map(|s| s.first().map_or(0, Vec::len)).sum();
        decisions as f64 / alarms.max(1) as f64
    }
}

fn sprt(k: f64, upper: f32) -> Sprt {
    Sprt::mean(2.0 * k as f32, SPRT_LOWER as f32, upper)
}

/// With an own copy of the states: the library's are private to a monitor.
fn count_alarms(series: &Series, detectors: &[Detectors]) -> usize {
    let fresh: Vec<DetectorStates> = detectors.iter().map(Detectors::start).collect();
    let mut states = fresh.clone();
    let mut alarms = 0;
    for t in 0..series.first().map_or(0, Vec::len) {
        let mut any = false;
        for ((z, detectors), states) in series.iter().zip(detectors).zip(&mut states) {
            any |= detectors.update(states, z[t] as f32).side().is_some();
        }
        if any {
            alarms += 1;
            states.clone_from(&fresh);
        }
    }
    alarms
}

/// Both sides' maxima between visits to zero; each side sees the residuals wrong by the margin in its own direction.
fn cusum_maxima(k: f64, margin: Margin, z: &[f64]) -> Vec<f32> {
    let chart = Cusum::new(k as f32, f32::MAX);
    let (mut up, mut down) = (CusumState::ZERO, CusumState::ZERO);
    let (mut high, mut low, mut maxima) = (0.0f32, 0.0f32, Vec::new());
    let mut visit = |now: f32, most: &mut f32| {
        if now > 0.0 {
            *most = most.max(now);
        } else if *most > 0.0 {
            maxima.push(*most);
            *most = 0.0;
        }
    };
    for &z in z {
        chart.update(&mut up, (z * margin.sigma + margin.mean) as f32);
        chart.update(&mut down, (z * margin.sigma - margin.mean) as f32);
        visit(up.high, &mut high);
        visit(down.low, &mut low);
    }
    maxima
}

/// Both sides' maxima between restarts at the lower boundary, the same way.
fn sprt_maxima(k: f64, margin: Margin, z: &[f64]) -> Vec<f32> {
    let test = sprt(k, f32::MAX);
    let (mut up, mut down) = (SprtState::ZERO, SprtState::ZERO);
    let (mut high, mut low, mut maxima) = (0.0f32, 0.0f32, Vec::new());
    let mut visit = |now: f32, most: &mut f32| {
        *most = most.max(now);
        if now == 0.0 && *most > 0.0 {
            maxima.push(*most);
            *most = 0.0;
        }
    };
    for &z in z {
        test.update(&mut up, (z * margin.sigma + margin.mean) as f32);
        test.update(&mut down, (z * margin.sigma - margin.mean) as f32);
        visit(up.high, &mut high);
        visit(down.low, &mut low);
    }
    maxima
}

#[cfg(test)]
mod tests {
    use super::super::autocorrelation::Autoregression;
    use super::super::marginal::Marginal;
    use super::super::process::ChannelProcess;
    use super::*;
    use crate::design;

    fn normal(memory: Autoregression) -> Process {
        Process::independent(vec![ChannelProcess::new(Marginal::NORMAL, memory)])
    }

    fn independent() -> Process {
        normal(Autoregression { phi: Vec::new(), noise: 1.0 })
    }

    const EXACT: [Margin; 1] = [Margin::NONE];
    const CUSUM: DetectorChoice = DetectorChoice { shewhart: false, cusum: true, sprt: false };

    /// Independent normal residuals and an exactly known baseline: the integral equation's threshold.
    #[test]
    fn thresholds_of_normal_residuals_are_the_exact_ones() {
        let process = independent();
        let simulated = Simulated::new(&process, CUSUM, 0.5, 1_000_000, &EXACT);
        for arl in [200.0, 500.0, 1000.0, 10_000.0, 100_000.0] {
            let h = f64::from(simulated.detectors(arl)[0].cusum.unwrap().h);
            let realised = design::Cusum::new(0.5, h, 0.0).unwrap().arl(0.0);
            let tolerance = if arl > 1000.0 { 0.12 } else { 0.05 };
            assert!((realised / arl - 1.0).abs() < tolerance, "{arl}: {realised} at h = {h}");
        }
    }

    #[test]
    fn shewhart_alone_is_the_normal_quantile() {
        let process = independent();
        let choice = DetectorChoice { shewhart: true, cusum: false, sprt: false };
        let limits =
            Simulated::new(&process, choice, 0.5, 1_000_000, &EXACT).detectors(370.4)[0].shewhart.unwrap();
        assert!((f64::from(limits.upper) - 3.0).abs() < 0.02 && (limits.upper + limits.lower).abs() < 1e-5);
    }

    /// Against the SPRT's own integral equation.
    #[test]
    fn sprt_alone() {
        let process = independent();
        let choice = DetectorChoice { shewhart: false, cusum: false, sprt: true };
        let found =
            Simulated::new(&process, choice, 0.5, 1_000_000, &EXACT).detectors(500.0)[0].sprt.unwrap();
        let alternative = design::Alternative::new(1.0, 1.0).unwrap();
        let exact = design::Sprt::new(alternative, SPRT_LOWER, f64::from(found.upper)).unwrap();
        let realised = exact.two_sided_arl(0.0, 1.0);
        assert!((realised / 500.0 - 1.0).abs() < 0.06, "{realised}");
    }

    /// Two independent channels with two detectors each: each gets about a quarter of the alarms.
    #[test]
    fn the_budget_is_shared() {
        let one = independent().channels.remove(0);
        let process = Process::independent(vec![one.clone(), one]);
        let choice = DetectorChoice { shewhart: true, cusum: true, sprt: false };
        let simulated = Simulated::new(&process, choice, 0.5, 1_000_000, &[Margin::NONE; 2]);
        let detectors = simulated.detectors(500.0);
        assert!((simulated.run_length(&detectors) / 500.0 - 1.0).abs() < 0.02);
        let cusum = detectors[1].cusum.unwrap();
        let own = design::Cusum::new(0.5, f64::from(cusum.h), 0.0).unwrap().arl(0.0);
        assert!((1600.0..2100.0).contains(&own), "{own}");
    }

    /// Autocorrelated residuals need a far higher threshold; with it the run length is as wanted.
    #[test]
    fn autocorrelation_raises_the_threshold() {
        let process = normal(Autoregression { phi: vec![0.3], noise: 0.91 });
        let simulated = Simulated::new(&process, CUSUM, 0.5, 1_000_000, &EXACT);
        let detectors = simulated.detectors(500.0);
        assert!(detectors[0].cusum.unwrap().h > 7.5);
        assert!((simulated.run_length(&detectors) / 500.0 - 1.0).abs() < 0.03);
    }
}
