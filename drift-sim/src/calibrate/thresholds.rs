//! Thresholds for a wanted mean run length between false alarms of the whole monitor: any detector of any channel counts.
//!
//! Every detector gets the same share of the false alarms. Shewhart limits come from the [`super::marginal::Marginal`]'s tails, half
//! the share on each side. The other thresholds come from one long simulation of the process: the maxima of a statistic between
//! two visits to its restart give its alarm rate at every threshold at once; their tail is exponential, which is used to smooth
//! it and, for rates that the simulation does not reach, to extrapolate it. At last the shares are scaled until
//! the real detectors together have the wanted run length on the simulated residuals, since alarms that coincide
//! count once. That scale is found at up to [`JOINT`] decisions and kept beyond.

use crate::cores::AcrossCores as _;
use drift_core::{DetectorStates, Detectors};

use super::caution::Margin;
use super::detector::{Designed, DetectorChoice, Threshold, Tuning};
use super::marginal;
use super::process::{Process, Series};

/// Decisions of the run length at which coinciding alarms are counted.
const JOINT: f64 = 1000.0;
/// Seed of the simulation; any would do.
const SEED: u64 = 0x6472_6966_7401;
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
    tuning: Tuning,
    series: Vec<Series>,
    exact: Watched,
    cautious: Watched,
}

/// What the detectors' statistics did where the baseline is this wrong.
#[derive(Debug)]
struct Watched {
    margins: Vec<Margin>,
    /// Of each detector that is chosen, each channel's; none for one whose limits are the law's own.
    excursions: Vec<Vec<Option<Excursions>>>,
}

impl<'p> Simulated<'p> {
    /// `margins`: how wrong each channel's baseline may be.
    pub(super) fn new(
        process: &'p Process,
        choice: DetectorChoice,
        tuning: Tuning,
        decisions: usize,
        margins: &[Margin],
    ) -> Self {
        let stretches = 64;
        let each = decisions.div_ceil(stretches);
        let series = process.simulate_many(stretches, each, SEED);
        let total = stretches * each;
        let of_channel = |row: &dyn Designed, (c, margin): (usize, &Margin)| -> Option<Excursions> {
            let maxima: Option<Vec<Vec<f32>>> =
                series.par_iter().map(|s| row.maxima(tuning, *margin, &s[c])).collect();
            maxima.map(|maxima| Excursions::new(maxima.concat(), total))
        };
        let watched_with = |margins: &[Margin]| Watched {
            margins: margins.to_vec(),
            excursions: choice
                .rows()
                .map(|row| margins.iter().enumerate().map(|c| of_channel(row, c)).collect())
                .collect(),
        };
        let exact = watched_with(&vec![Margin::NONE; process.channels.len()]);
        let cautious = watched_with(margins);
        Self { process, choice, tuning, series, exact, cautious }
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
        let of = |c: usize| {
            let mut detectors = Detectors::NONE;
            for (row, excursions) in self.choice.rows().zip(&watched.excursions) {
                let at = match excursions.get(c).and_then(Option::as_ref) {
                    Some(excursions) => Threshold::Exceeded(excursions.threshold(rate)),
                    None => Threshold::Score(limit, &self.process.channels[c], watched.margins[c]),
                };
                row.place(&mut detectors, self.tuning, at);
            }
            detectors
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
    const TUNING: Tuning = Tuning { k: 0.5, lambda: 0.1 };

    fn choice(names: &str) -> DetectorChoice {
        names.parse().unwrap()
    }

    /// Independent normal residuals and an exactly known baseline: the integral equation's threshold.
    #[test]
    fn thresholds_of_normal_residuals_are_the_exact_ones() {
        let process = independent();
        let simulated = Simulated::new(&process, choice("cusum"), TUNING, 1_000_000, &EXACT);
        for arl in [200.0, 500.0, 1000.0, 10_000.0, 100_000.0] {
            let h = f64::from(simulated.detectors(arl)[0].cusum.unwrap().h);
            let realised = design::Cusum::new(0.5, h, 0.0).unwrap().arl(0.0);
            let tolerance = if arl > 1000.0 { 0.12 } else { 0.05 };
            assert!((realised / arl - 1.0).abs() < tolerance, "{arl}: {realised} at h = {h}");
        }
    }

    /// The EWMA's thresholds against its own integral equation, for a slow and a fast one.
    #[test]
    fn ewma_alone() {
        let process = independent();
        for lambda in [0.05, 0.1, 0.4] {
            let tuning = Tuning { lambda, ..TUNING };
            let simulated = Simulated::new(&process, choice("ewma"), tuning, 1_000_000, &EXACT);
            for arl in [200.0, 500.0, 1000.0, 10_000.0, 100_000.0] {
                let found = simulated.detectors(arl)[0].ewma.unwrap();
                let realised = design::Ewma::new(lambda, f64::from(found.limit)).unwrap().arl(0.0);
                println!("lambda {lambda}: {arl} asked, {realised:.0} realised");
                // A slow average makes few excursions: 16 000 of the million decisions at lambda = 0.05.
                let tolerance = if arl > 1000.0 { 0.25 } else { 0.08 };
                assert!((realised / arl - 1.0).abs() < tolerance, "{lambda} {arl}: {realised} {found:?}");
            }
        }
    }

    #[test]
    fn shewhart_alone_is_the_normal_quantile() {
        let process = independent();
        let limits = Simulated::new(&process, choice("shewhart"), TUNING, 1_000_000, &EXACT).detectors(370.4)
            [0]
        .shewhart
        .unwrap();
        assert!((f64::from(limits.upper) - 3.0).abs() < 0.02 && (limits.upper + limits.lower).abs() < 1e-5);
    }

    /// Against the SPRT's own integral equation.
    #[test]
    fn sprt_alone() {
        let process = independent();
        let found = Simulated::new(&process, choice("sprt"), TUNING, 1_000_000, &EXACT).detectors(500.0)[0]
            .sprt
            .unwrap();
        let alternative = design::Alternative::new(1.0, 1.0).unwrap();
        let exact =
            design::Sprt::new(alternative, crate::calibrate::detector::SPRT_LOWER, f64::from(found.upper))
                .unwrap();
        let realised = exact.two_sided_arl(0.0, 1.0);
        assert!((realised / 500.0 - 1.0).abs() < 0.06, "{realised}");
    }

    /// Two independent channels with two detectors each: each gets about a quarter of the alarms.
    #[test]
    fn the_budget_is_shared() {
        let one = independent().channels.remove(0);
        let process = Process::independent(vec![one.clone(), one]);
        let simulated =
            Simulated::new(&process, choice("shewhart,cusum"), TUNING, 1_000_000, &[Margin::NONE; 2]);
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
        let simulated = Simulated::new(&process, choice("cusum"), TUNING, 1_000_000, &EXACT);
        let detectors = simulated.detectors(500.0);
        assert!(detectors[0].cusum.unwrap().h > 7.5);
        assert!((simulated.run_length(&detectors) / 500.0 - 1.0).abs() < 0.03);
    }
}
