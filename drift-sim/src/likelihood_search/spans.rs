//! Loads and sensor biases that come and go, told apart by their shapes.
//!
//! A load's step reaches y through the plant, a sensor's at once. In the whitened prediction error both are short pulses of known
//! shape, whose likelihood is a sum of products: the time and the kind that gain most are taken, all sizes found so far are fitted again
//! together with the noise model, and so on until nothing gains enough (orthogonal matching pursuit; Pati et al. 1993). A
//! step and a later one back make a span; spans of one size make one term.

use crate::cores::AcrossCores as _;
use nalgebra::{DMatrix, DVector};

use crate::control_loop::Loop;
use crate::controller::Controller;
use crate::physics::Term;
use crate::simulate::{Start, replay};

use crate::estimate::signals::{Signals, centred};
use crate::estimate::whiten::Whitener;

/// What a step must gain in log-likelihood: its size, its time among thousands, its kind.
const LEAST_GAIN: f64 = 25.0;
/// Steps at most: more is a wandering load or a wrong plant, not events.
const MOST_STEPS: usize = 30;
/// Times tried across the recording before the best is refined.
const TIMES: usize = 2500;
/// Order of the noise model.
const NOISE_ORDER: usize = 4;
/// Sizes of one effect differ by no more than this part.
const SAME_SIZE: f64 = 0.35;
/// Samples at either end in which no step is looked for.
const MARGIN: usize = 10;

/// What steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Of {
    /// What is added after u.
    Load,
    /// What the sensor adds.
    Bias,
}

/// A step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Of what.
    pub of: Of,
    /// Its first sample.
    pub at: usize,
    /// By how much, in the unit of u or of y.
    pub size: f64,
}

/// The steps that the free prediction error of a loop shows, in the order of time; `None` where there are so many that they are none.
pub fn steps(model: &Loop, signals: &Signals) -> Option<Vec<Step>> {
    let shapes = Shapes::of(model, signals)?;
    let mut found: Vec<(Of, usize)> = Vec::new();
    loop {
        let state = State::fit(&shapes, &found)?;
        let Some(next) = state.best(&shapes) else { break Some(state.sizes(&found)) };
        if found.len() == MOST_STEPS {
            break None;
        }
        found.push(next);
    }
    .map(|mut steps| {
        steps.sort_by_key(|step| step.at);
        steps
    })
}

/// What effects look like in the prediction error.
struct Shapes {
    error: Vec<f64>,
    /// Responses to a unit of what was added after u, and of the sensor's.
    load: Vec<f64>,
    bias: Vec<f64>,
    /// What the start leaves.
    free: Vec<Vec<f64>>,
}

impl Shapes {
    fn of(model: &Loop, signals: &Signals) -> Option<Self> {
        let n = signals.len();
        let linear = Loop {
            physics: Vec::new(),
            inputs: Vec::new(),
            controller: Controller::Recorded,
            ..model.clone()
        };
        let order = linear.plant.linear().ok()??.order();
        let run = |state: Option<usize>, u: f64| {
            let state = (0..order).map(|i| if state == Some(i) { 1.0 } else { 0.0 }).collect();
            let start = Start { state: Some(state), ..Start::default() };
            replay(&linear, &vec![u; n], &[], 0, Some(&start)).ok().map(|trace| trace.y)
        };
        let rest = run(None, 0.0)?;
        let less = |y: Vec<f64>| y.iter().zip(&rest).map(|(y, rest)| y - rest).collect::<Vec<f64>>();
        let start = Start::from_recording(model, &signals.r, &signals.y, &signals.u);
        let predicted = replay(
            &Loop { controller: Controller::Recorded, ..model.clone() },
            &signals.u,
            &signals.inputs,
            0,
            Some(&start),
        );
        let mut last = 0.0;
        let error = (signals.y.iter().zip(predicted.ok()?.y)).map(|(y, predicted)| {
            if y.is_finite() {
                last = y - predicted;
            }
            last
        });
        Some(Self {
            error: error.collect(),
            load: less(run(None, 1.0)?),
            bias: vec![1.0; n],
            free: (0..order).filter_map(|i| run(Some(i), 0.0)).map(less).collect(),
        })
    }

    fn shape(&self, of: Of) -> &[f64] {
        match of {
            Of::Load => &self.load,
            Of::Bias => &self.bias,
        }
    }

    /// The effect of a unit step at a sample.
    fn step(&self, of: Of, at: usize) -> Vec<f64> {
        let n = self.error.len();
        std::iter::repeat_n(0.0, at).chain(self.shape(of).iter().copied()).take(n).collect()
    }
}

/// The steps found so far, fitted.
struct State {
    whitener: Whitener,
    /// Orthonormal columns of all that is fitted, whitened.
    basis: DMatrix<f64>,
    rest: DVector<f64>,
    variance: f64,
    sizes: Vec<f64>,
}

impl State {
    fn fit(shapes: &Shapes, found: &[(Of, usize)]) -> Option<Self> {
        let mut columns = vec![shapes.bias.clone()];
        columns.extend(shapes.free.iter().cloned());
        let nuisances = columns.len();
        columns.extend(found.iter().map(|(of, at)| shapes.step(*of, *at)));
        let mut whitener = Whitener::least_squares(&centred(shapes.error.clone()), NOISE_ORDER);
        let mut state = None;
        for _ in 0..3 {
            let white: Vec<DVector<f64>> =
                columns.iter().map(|c| DVector::from_vec(whitener.apply(c))).collect();
            let error = DVector::from_vec(whitener.apply(&shapes.error));
            let qr = scaled(&white).qr();
            let basis = qr.q();
            let lengths: Vec<f64> = white.iter().map(|c| c.norm().max(1e-300)).collect();
            let along = basis.tr_mul(&error);
            let solved = qr.r().solve_upper_triangular(&along)?;
            let rest = &error - &basis * &along;
            let variance = (rest.norm_squared() / rest.len() as f64).max(1e-300);
            let sizes: Vec<f64> = solved.iter().zip(&lengths).map(|(x, length)| x / length).collect();
            let mut coloured = shapes.error.clone();
            for (column, size) in columns.iter().zip(&sizes) {
                coloured.iter_mut().zip(column).for_each(|(e, c)| *e -= size * c);
            }
            let sizes = sizes.get(nuisances..)?.to_vec();
            state = Some(Self { whitener, basis, rest, variance, sizes });
            whitener = Whitener::least_squares(&coloured, NOISE_ORDER);
        }
        state
    }

    /// The step that gains most, if it gains enough.
    fn best(&self, shapes: &Shapes) -> Option<(Of, usize)> {
        let n = shapes.error.len();
        let stride = (n / TIMES).max(1);
        let times: Vec<usize> = (MARGIN..n.saturating_sub(MARGIN)).step_by(stride).collect();
        let best = |times: Vec<usize>, of: Of| {
            let atom = self.atom(shapes, of);
            let gains = times.into_par_iter().map(|at| (self.gain(&atom, at), of, at));
            gains.max_by(|a, b| a.0.total_cmp(&b.0))
        };
        [Of::Load, Of::Bias]
            .into_iter()
            .filter_map(|of| {
                let (_, _, at) = best(times.clone(), of)?;
                let close = at.saturating_sub(stride).max(MARGIN)..=(at + stride).min(n - MARGIN);
                best(close.collect(), of)
            })
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(gain, _, _)| *gain > LEAST_GAIN)
            .map(|(_, of, at)| (of, at))
    }

    /// The whitened unit step at time 0, nothing before it.
    fn atom(&self, shapes: &Shapes, of: Of) -> Vec<f64> {
        let before = std::iter::repeat_n(0.0, self.whitener.order());
        self.whitener.apply(&before.chain(shapes.shape(of).iter().copied()).collect::<Vec<f64>>())
    }

    /// What a step at this sample gains, in log-likelihood, over what is fitted already.
    fn gain(&self, atom: &[f64], at: usize) -> f64 {
        // The whitened error lacks its first samples.
        let Some(row) = at.checked_sub(self.whitener.order()) else { return 0.0 };
        let rows = self.rest.len() - row.min(self.rest.len());
        let Some(atom) = atom.get(..rows) else { return 0.0 };
        let dot = |x: &[f64]| x.iter().zip(atom).map(|(a, b)| a * b).sum::<f64>();
        let energy = dot(atom);
        let within: f64 = self
            .basis
            .column_iter()
            .map(|column| dot(column.as_slice().get(row..).unwrap_or(&[])))
            .map(|along| along * along)
            .sum();
        let left = energy - within;
        if left <= 1e-4 * energy {
            return 0.0;
        }
        let along = dot(self.rest.as_slice().get(row..).unwrap_or(&[]));
        0.5 * along * along / (left * self.variance)
    }

    fn sizes(&self, found: &[(Of, usize)]) -> Vec<Step> {
        let sized = found.iter().zip(&self.sizes);
        sized.map(|((of, at), size)| Step { of: *of, at: *at, size: *size }).collect()
    }
}

/// The columns, each of length one.
fn scaled(columns: &[DVector<f64>]) -> DMatrix<f64> {
    let unit: Vec<DVector<f64>> = columns.iter().map(|c| c / c.norm().max(1e-300)).collect();
    DMatrix::from_columns(&unit)
}

/// A span of one size, [from, to) in samples.
#[derive(Debug, Clone, Copy)]
struct Span {
    from: usize,
    to: usize,
    size: f64,
}

/// The terms that steps make, `injected_signal` or `sensor_bias` with their spans: each step is closed by the next of its kind that takes it back, one that never goes back lasts to
/// the end; spans of one size are one term.
pub fn terms(steps: &[Step], signals: &Signals) -> Vec<Term> {
    [Of::Bias, Of::Load]
        .into_iter()
        .flat_map(|of| terms_of(of, &paired(of, steps, signals.len()), signals.sample_time_s))
        .collect()
}

fn paired(of: Of, steps: &[Step], end: usize) -> Vec<Span> {
    let mut left: Vec<Step> = steps.iter().filter(|step| step.of == of).copied().collect();
    let mut spans = Vec::new();
    while !left.is_empty() {
        let open = left.remove(0);
        let back = left.iter().position(|step| (step.size + open.size).abs() < SAME_SIZE * open.size.abs());
        spans.push(match back.map(|at| left.remove(at)) {
            Some(close) => Span { from: open.at, to: close.at, size: 0.5 * (open.size - close.size) },
            None => Span { from: open.at, to: end + 1, size: open.size },
        });
    }
    spans
}

fn terms_of(of: Of, spans: &[Span], sample_time_s: f64) -> Vec<Term> {
    let mut groups: Vec<Vec<Span>> = Vec::new();
    for span in spans {
        let same = |group: &&mut Vec<Span>| {
            group.first().is_some_and(|first| (first.size - span.size).abs() < SAME_SIZE * first.size.abs())
        };
        match groups.iter_mut().find(same) {
            Some(group) => group.push(*span),
            None => groups.push(vec![*span]),
        }
    }
    groups.iter().filter_map(|group| acting(of, group, sample_time_s)).collect()
}

fn acting(of: Of, group: &[Span], sample_time_s: f64) -> Option<Term> {
    let at = |sample: usize| (sample as f64 - 0.5) * sample_time_s;
    let (name, unit) = match of {
        Of::Load => ("injected_signal", "level"),
        Of::Bias => ("sensor_bias", "bias"),
    };
    let size = group.iter().map(|span| span.size).sum::<f64>() / group.len() as f64;
    let spans: Vec<(f64, f64)> = group.iter().map(|span| (at(span.from), at(span.to))).collect();
    Some(Term::new(name, &[(unit, size)]).ok()?.within(&spans))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{FirstOrder, Plant};
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn heater() -> Loop {
        let plant = FirstOrder { gain: 0.5, time_constant_s: 120.0, delay_s: 5.0, offset: 25.0 };
        Loop {
            sample_time_s: 1.0,
            controller: Controller::Recorded,
            plant: Plant::FirstOrder(plant),
            ..Loop::paper()
        }
    }

    /// Under PI control of an unknown tuning, with slow noise of its own.
    fn recorded(terms: &[Term]) -> Signals {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let model = Loop { physics: terms.to_vec(), ..heater() };
        let mut simulation = crate::simulate::Simulation::new(&model, 1).unwrap();
        simulation.start(&Start::held(50.0, 50.0)).unwrap();
        let (mut u, mut integral, mut slow): (f64, f64, f64) = (50.0, 50.0, 0.0);
        let (mut y, mut us) = (Vec::new(), Vec::new());
        for _ in 0..4000 {
            let normal: f64 = StandardNormal.sample(&mut random);
            slow = 0.9 * slow + 0.02 * normal;
            let step = simulation.replay_step(u, &[]);
            // The controller sees y one sample late.
            us.push(u);
            y.push(step.y + slow);
            integral += 0.05 * (50.0 - y[y.len() - 1]);
            u = integral + 4.0 * (50.0 - y[y.len() - 1]);
        }
        Signals {
            sample_time_s: 1.0,
            start_s: 0.0,
            origin_s: 0.0,
            r: vec![50.0; 4000],
            y,
            u: us,
            inputs: Vec::new(),
        }
    }

    #[test]
    fn a_load_and_a_bias_that_come_and_go_are_told_apart() {
        let load = Term::new("injected_signal", &[("level", -20.0)]).unwrap();
        let load = load.within(&[(2000.0, 2300.0), (3000.0, 3300.0)]);
        let bias =
            Term::new("sensor_bias", &[("bias", 5.0)]).unwrap().within(&[(500.0, 800.0), (1200.0, 1500.0)]);
        let signals = recorded(&[load.clone(), bias.clone()]);
        let found = terms(&steps(&heater(), &signals).unwrap(), &signals);
        assert_eq!(found.len(), 2, "{found:?}");
        for (found, truth) in found.iter().zip([&bias, &load]) {
            assert_eq!(found.kind, truth.kind);
            assert!((found.parameters[0] / truth.parameters[0] - 1.0).abs() < 0.1, "{found:?}");
            for (span, truth) in found.spans.iter().zip(&truth.spans) {
                assert!((span.0 - truth.0).abs() < 15.0 && (span.1 - truth.1).abs() < 15.0, "{found:?}");
            }
        }
    }

    #[test]
    fn a_healthy_loop_has_no_steps() {
        let signals = recorded(&[]);
        assert_eq!(steps(&heater(), &signals), Some(Vec::new()));
    }
}
