//! The whole distribution of a run length, not only its mean: quantiles and the probability of an alarm within a mission.
//!
//! One side: the density of the statistic is carried forward on the quadrature nodes, decision by decision (Waldmann 1986).
//! What is lost in a step is P(N = n). After a while the hazard P(N = n | N >= n) is constant (the
//! dominant eigenvalue): from there the tail is geometric.
//!
//! Two sides: when one alarms the other stands at zero (the renewal argument of Kemp 1961), so with `a`, `b` the
//! probabilities that the upper, lower side alarms first at n, and `f` those of each side alone,
//! `f_up = a + b * g_up` and `f_down = b + a * g_down`, where * is convolution and g is f without head start. Solved for a and b term by term.

use super::walk::{Band, Chain, Walk};

/// The steps that are followed before the tail is taken as geometric, at most.
const LONGEST_FOLLOWED: usize = 20_000;
/// Multiplications that following one side may cost: bounds the time of a very wide chart.
const LARGEST_WORK: usize = 2_000_000_000;
/// A step of more standard deviations (probability 1e-32) is left out between nodes.
const LONGEST_STEP: f64 = 12.0;
/// The hazard has settled when it changes by less than this, relatively, a step.
const SETTLED: f64 = 1e-13;
/// The same where only [`FAR`] counts. A hazard that changes by less has some 1e-6 of the probability of an alarm left to lose, while
/// rounding keeps many a chart from ever changing by less than [`SETTLED`]: it would be followed to the end.
const NEARLY_SETTLED: f64 = 1e-8;

/// Nodes a panel that tell the probability of an alarm to six digits.
const FEW_NODES: usize = 10;
/// Such a probability is surely above or below another that is so far away.
const FAR: f64 = 1e-3;

/// The distribution of a run length N, in decisions.
#[derive(Debug, Clone)]
pub struct RunLength {
    /// P(N = 1), P(N = 2), ...
    ends: Vec<f64>,
    /// P(N > 1), P(N > 2), ...
    survives: Vec<f64>,
    /// P(N = n | N >= n) after those.
    hazard: f64,
}

impl RunLength {
    /// Every decision alarms with the same probability (a Shewhart chart).
    pub(crate) fn geometric(hazard: f64) -> Self {
        Self { ends: vec![hazard], survives: vec![1.0 - hazard], hazard }
    }

    /// One side from the starting value `start`.
    pub(crate) fn of_chain(chain: &Chain, start: f64) -> Self {
        Self::followed(chain, start, u64::MAX, SETTLED, |_| false)
    }

    /// Whether an alarm within so many decisions has at least this probability, for one side from the starting value `start`. Few
    /// nodes tell, a tenth of the work, unless the probability is near that of an alarm.
    pub(crate) fn alarms_within(walk: Walk, start: f64, decisions: u64, probability: f64) -> bool {
        let alarm_within = |chain: &Chain, settled: f64, enough: f64| {
            let is_enough = |so_far: &Builder| so_far.has_reached(enough);
            let followed = Self::followed(chain, start, decisions, settled, is_enough);
            followed.alarm_within(decisions)
        };
        let roughly = alarm_within(&walk.discretise_with(FEW_NODES), NEARLY_SETTLED, probability + FAR);
        if (roughly - probability).abs() >= FAR {
            return roughly >= probability;
        }
        alarm_within(&walk.discretise(), SETTLED, probability) >= probability
    }

    /// One side for so many decisions, or until enough is known; whoever asks for less gets a distribution of which the rest is
    /// extrapolated.
    fn followed(
        chain: &Chain,
        start: f64,
        decisions: u64,
        settled: f64,
        is_enough: impl Fn(&Builder) -> bool,
    ) -> Self {
        let moves = chain.moves_into_nodes(LONGEST_STEP);
        let work: usize = moves.iter().map(Band::len).sum();
        let follow = LONGEST_FOLLOWED.min(LARGEST_WORK / work.max(1)).max(1);
        let follow = usize::try_from(decisions).map_or(follow, |decisions| follow.min(decisions));
        let moves = Band::out_of_nodes(&moves);
        let walk = chain.walk();
        let leaves: Vec<f64> = chain.nodes.iter().map(|n| walk.leaves_up(n.at)).collect();
        let falls: Vec<f64> = chain.nodes.iter().map(|n| walk.falls(n.at)).collect();
        let from_origin: Vec<f64> = chain.moves(0.0).collect();

        let mut builder = Builder::until(settled);
        builder.push(walk.leaves_up(start));
        let mut mass: Vec<f64> = chain.moves(start).collect();
        let mut next = vec![0.0; mass.len()];
        let mut at_origin = walk.falls(start);
        while !builder.is_settled() && builder.len() < follow && !is_enough(&builder) {
            builder.push(at_origin * walk.leaves_up(0.0) + dot(&mass, &leaves));
            next.fill(0.0);
            for (out_of, mass) in moves.iter().zip(&mass) {
                out_of.spread(*mass, &mut next);
            }
            for (next, o) in next.iter_mut().zip(&from_origin) {
                *next += at_origin * o;
            }
            at_origin = at_origin * walk.falls(0.0) + dot(&mass, &falls);
            std::mem::swap(&mut mass, &mut next);
        }
        builder.finish()
    }

    /// Two sides, each given (with its head start, without).
    pub(crate) fn of_two_sides(up: &(Self, Self), down: &(Self, Self)) -> Self {
        let mut up_ends = [up.0.pmf(), up.1.pmf()];
        let mut down_ends = [down.0.pmf(), down.1.pmf()];
        let (mut g_up, mut g_down) = (Vec::new(), Vec::new());
        let (mut first_up, mut first_down): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
        let mut builder = Builder::until(SETTLED);
        while !builder.is_settled() && builder.len() < LONGEST_FOLLOWED {
            let after_down = convolved(&first_down, &g_up);
            let after_up = convolved(&first_up, &g_down);
            let [f_up, f_down] = [&mut up_ends[0], &mut down_ends[0]].map(|p| p.next().unwrap_or(0.0));
            // Rounding may leave -1e-20 where there is nothing.
            let (a, b) = ((f_up - after_down).max(0.0), (f_down - after_up).max(0.0));
            first_up.push(a);
            first_down.push(b);
            g_up.push(up_ends[1].next().unwrap_or(0.0));
            g_down.push(down_ends[1].next().unwrap_or(0.0));
            builder.push(a + b);
        }
        builder.finish()
    }

    /// P(N = 1), P(N = 2) and so on without end.
    fn pmf(&self) -> impl Iterator<Item = f64> + '_ {
        let last = self.survives.last().copied().unwrap_or(1.0);
        let tail = std::iter::successors(Some(last * self.hazard), |p| Some(p * (1.0 - self.hazard)));
        self.ends.iter().copied().chain(tail)
    }

    /// P(N > `decisions`): no alarm in that many decisions.
    pub fn survival(&self, decisions: u64) -> f64 {
        let Some(last) = usize::try_from(decisions).ok().and_then(|n| n.checked_sub(1)) else { return 1.0 };
        match self.survives.get(last) {
            Some(p) => *p,
            None => {
                let beyond = (last + 1 - self.survives.len()) as f64;
                self.survives.last().copied().unwrap_or(1.0) * libm::exp(beyond * libm::log1p(-self.hazard))
            }
        }
    }

    /// P(N <= `decisions`): an alarm within that many decisions.
    pub fn alarm_within(&self, decisions: u64) -> f64 {
        1.0 - self.survival(decisions)
    }

    /// The smallest number of decisions within which an alarm has probability `probability` (0 to below 1) or more;
    /// `f64`, since it may be beyond any integer type.
    pub fn quantile(&self, probability: f64) -> f64 {
        let left = 1.0 - probability;
        if let Some(n) = self.survives.iter().position(|&p| p <= left) {
            return (n + 1) as f64;
        }
        let last = self.survives.last().copied().unwrap_or(1.0);
        self.survives.len() as f64 + (libm::log(left / last) / libm::log1p(-self.hazard)).ceil()
    }

    /// The mean, in decisions: a check on [`super::Cusum::arl`] by another road.
    pub fn mean(&self) -> f64 {
        let last = self.survives.last().copied().unwrap_or(1.0);
        let tail = if last > 0.0 { last * (1.0 - self.hazard) / self.hazard } else { 0.0 };
        1.0 + self.survives.iter().sum::<f64>() + tail
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// The next term of a convolution: sum of `a[j] g[n-1-j]`, where both have n terms.
fn convolved(a: &[f64], g: &[f64]) -> f64 {
    a.iter().zip(g.iter().rev()).map(|(x, y)| x * y).sum()
}

/// Collects P(N = n) until the hazard has settled.
struct Builder {
    ends: Vec<f64>,
    survives: Vec<f64>,
    hazard: f64,
    /// The relative change of the hazard that counts as none.
    settled: f64,
    settled_for: usize,
}

impl Builder {
    fn until(settled: f64) -> Self {
        Self { ends: Vec::new(), survives: Vec::new(), hazard: 0.0, settled, settled_for: 0 }
    }

    fn push(&mut self, ends: f64) {
        let before = self.survives.last().copied().unwrap_or(1.0);
        let hazard = if before > 0.0 { (ends / before).min(1.0) } else { 1.0 };
        let still = hazard > 0.0 && (hazard - self.hazard).abs() <= self.settled * hazard;
        self.settled_for = if still { self.settled_for + 1 } else { 0 };
        self.hazard = hazard;
        self.ends.push(ends);
        self.survives.push((before - ends).max(0.0));
    }

    fn len(&self) -> usize {
        self.ends.len()
    }

    /// An alarm so far has this probability already: what comes only adds to it.
    fn has_reached(&self, probability: f64) -> bool {
        self.survives.last().is_some_and(|survives| 1.0 - survives >= probability)
    }

    fn is_settled(&self) -> bool {
        self.settled_for >= 5 || self.is_over()
    }

    /// What is left is the rounding error of what ended: its hazard means nothing, the next decision takes it.
    fn is_over(&self) -> bool {
        self.survives.last().is_some_and(|&p| p < 1e-14)
    }

    fn finish(self) -> RunLength {
        let hazard = if self.is_over() { 1.0 } else { self.hazard };
        RunLength { ends: self.ends, survives: self.survives, hazard }
    }
}
