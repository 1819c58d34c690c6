//! What nothing was fitted to, and how a loop runs over it: the hold-out; or the end of the recording, to which a closed loop runs from the
//! recording's beginning, for nobody knows the place in a gap or the force at rest in its middle. An open one begins there anew: what it
//! would gather on the way is not what is asked.

use crate::control_loop::Loop;
use crate::diagnose::prove::{FitPct, fit_of, improvement, quiet_run, run, without_noise};
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Begun;
use crate::estimate::signals::{LEAST_SAMPLES, Signals, held};
use crate::physics::{Kind, Term};
use crate::simulate::{Trace, actuated};

/// The end of a recording that nothing was fitted to.
#[derive(Clone)]
struct End {
    /// The recording's index, and the states in which it begins where those are not a term's own: the kind, the parameter's index and its value.
    recording: usize,
    begun: Vec<(&'static Kind, usize, f64)>,
    whole: Signals,
    /// How many samples of it come before.
    before: usize,
    signals: Signals,
}

/// What nothing was fitted to of each recording.
#[derive(Clone)]
pub struct Unseen {
    ends: Vec<End>,
}

impl Unseen {
    /// Of recordings, each with its index and from a sample on; `None` where too little is left.
    pub fn of<'a>(recordings: impl Iterator<Item = (usize, (&'a Signals, usize))>) -> Option<Self> {
        let end = |(recording, (whole, before)): (usize, (&Signals, usize))| {
            let signals = whole.part(before, whole.len());
            let is_enough = before == 0 || signals.len() > LEAST_SAMPLES;
            is_enough.then(|| End { recording, begun: Vec::new(), whole: whole.clone(), before, signals })
        };
        let ends: Vec<End> = recordings.filter_map(end).collect();
        (!ends.is_empty()).then_some(Self { ends })
    }

    /// The same, each recording beginning in the states that a fit found for it.
    #[must_use]
    pub fn beginning_as(&self, fit: &Fit) -> Self {
        let of_kind = |begun: &Begun| {
            let kind = fit.hypothesis.model.physics.get(begun.term)?.kind;
            Some((kind, begun.parameter, begun.value))
        };
        let begun_as = |end: &End| {
            let own = fit.point.begun.iter().filter(|begun| begun.recording == end.recording);
            End { begun: own.filter_map(of_kind).collect(), ..end.clone() }
        };
        Self { ends: self.ends.iter().map(begun_as).collect() }
    }

    /// The samples of the first recording.
    pub fn first(&self) -> &Signals {
        &self.ends[0].signals
    }

    /// What a loop whose law is unknown runs over in the first recording, and the loop that does: see [`End::behind_play`].
    pub fn first_behind_play(&self, model: &Loop) -> (Loop, Signals) {
        self.ends[0].behind_play(model)
    }

    /// The recordings one after the other, each less its own means, as measured and as a loop runs over them.
    fn measured_and_run(&self, model: &Loop, seed: u64) -> Option<(Signals, Trace)> {
        let (mut measured, mut simulated) = (Signals::default(), Trace::default());
        for end in &self.ends {
            let run = end.run(model, seed)?;
            for (all, of, signals) in [
                (&mut measured.y, &end.signals.y, &end.signals.y),
                (&mut measured.u, &end.signals.u, &end.signals.u),
                (&mut simulated.y, &run.y, &end.signals.y),
                (&mut simulated.u, &run.u, &end.signals.u),
            ] {
                let known = held(signals);
                let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
                all.extend(of.iter().map(|x| x - mean));
            }
        }
        Some((measured, simulated))
    }

    /// How well a loop fits them.
    pub fn fit(&self, model: &Loop) -> Option<FitPct> {
        let (measured, run) = self.measured_and_run(&without_noise(model), 0)?;
        Some(fit_of(model, &run, &measured))
    }

    /// 95 % interval of what one loop fits them better than another, in percentage points.
    pub fn improvement(&self, before: &Loop, after: &Loop) -> Option<[f64; 2]> {
        let (measured, worse) = self.measured_and_run(&without_noise(before), 0)?;
        let (_, better) = self.measured_and_run(&without_noise(after), 0)?;
        improvement(&worse, &better, after, &measured)
    }
}

impl End {
    /// A loop as it is when the recording begins.
    fn begun(&self, model: &Loop) -> Loop {
        let mut own = model.clone();
        for (kind, parameter, value) in &self.begun {
            let of_kind = own.physics.iter_mut().filter(|term| term.kind == *kind);
            of_kind
                .filter_map(|term| term.parameters.get_mut(*parameter))
                .for_each(|parameter| *parameter = *value);
        }
        own
    }

    /// The loop without play and sticking, over what leaves these: where a stem is at the end's beginning follows from all that came before.
    fn behind_play(&self, model: &Loop) -> (Loop, Signals) {
        let model = &self.begun(model);
        let (play, others): (Vec<Term>, Vec<Term>) = model.physics.iter().cloned().partition(Term::plays);
        if play.is_empty() {
            return (model.clone(), self.signals.clone());
        }
        let left = actuated(&Loop { physics: play, ..model.clone() }, &self.whole.u);
        let u = left.get(self.before..).unwrap_or(&[]).to_vec();
        (Loop { physics: others, ..model.clone() }, Signals { u, ..self.signals.clone() })
    }

    /// A run over it, of the loop as it is.
    fn run(&self, model: &Loop, seed: u64) -> Option<Trace> {
        if !model.has_law() {
            let (model, signals) = self.behind_play(model);
            return run(&model, &signals, seed);
        }
        let mut trace = run(&self.begun(model), &self.whole, seed)?;
        for values in [&mut trace.y, &mut trace.u, &mut trace.true_y] {
            values.drain(..self.before.min(values.len()));
        }
        Some(trace)
    }
}

/// How well a loop fits a recording that it was fitted to.
pub fn fit_pct(model: &Loop, signals: &Signals) -> Option<FitPct> {
    Some(fit_of(model, &quiet_run(model, signals)?, signals))
}

/// How well a loop fits itself under its sensor's noise.
pub fn noise_floor(model: &Loop, sensor_sd: f64, unseen: Option<&Unseen>, train: &Signals) -> Option<FitPct> {
    let mut noisy = model.clone();
    noisy.sensor.noise = sensor_sd;
    let (noisy, quiet) = match unseen {
        Some(unseen) => {
            let quiet = unseen.measured_and_run(&without_noise(model), 0)?.1;
            (unseen.measured_and_run(&noisy, 1)?.1, quiet)
        }
        None => (run(&noisy, train, 1)?, quiet_run(model, train)?),
    };
    let measured = Signals { y: noisy.y, u: noisy.u, ..Signals::default() };
    Some(fit_of(model, &quiet, &measured))
}
