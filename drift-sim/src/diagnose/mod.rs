//! Finds, names, models and proves the physics that a simulation left out of a recorded loop.
//!
//! One step a file: [`controller_replay`] (is the law as stated?), [`model`] and [`fit`] (the nominal parameters refitted on
//! the whitened prediction error of y under the recorded u), [`missing_drive`], [`screen`] (every kind of physics, one
//! simulation a trial), [`injected`] (signals at two levels), [`candidates`] (fits), [`select`] (false alarms first, then rivals, then ties), [`interval`],
//! [`prove`] (closed loop on unseen samples). [`report`] turns it into JSON.

pub mod by_direction;
pub mod candidates;
pub mod constant_load;
pub mod controller_fault;
pub mod controller_replay;
mod drive_charts;
pub mod features;
pub mod fit;
pub mod holdout;
pub mod identify;
pub mod injected;
pub mod interval;
pub mod linear_shape;
pub mod missing_drive;
pub mod model;
pub mod noise_change;
pub mod observer;
pub mod page;
pub mod part_time;
pub mod prove;
pub mod quantum;
mod recorded;
pub mod report;
pub mod screen;
pub mod select;
pub mod sensor_effects;
pub mod signals;
pub mod spans;
pub mod spectrum;
pub mod sticking_valve;
pub mod valve;
pub mod whiten;

use crate::control_loop::Loop;
use crate::controller::Controller;
use crate::physics::{Kind, Place, Term};
use crate::plant::Plant;
use crate::{Error, Result};
use candidates::Candidate;
use controller_replay::ControllerReplay;
use fit::{Effort, Fit};
use missing_drive::MissingDrive;
use model::{Model, Target};
use select::Scored;
use signals::Signals;
use whiten::Whitener;

/// Terms named together at most.
const MOST_TERMS: usize = 3;
/// A tie of more kinds is no name.
const MOST_TIED: usize = 3;
/// Share of u that a term must move in closed loop to matter; and the part of what sensor noise does to u. On clean
/// generated loops what the search still finds, from how another simulator discretises, moves u by 0.0003 and 0.19 of the noise.
const LEAST_EFFECT: f64 = 0.002;
const OF_NOISE: f64 = 0.25;
/// Squared closed-loop error, over that which sensor noise alone makes, up to which nothing is looked for.
const FLOOR: f64 = 1.1;
/// Relative closed-loop error beyond it, below which nothing is looked for.
const LEAST_ERROR: f64 = 0.003;
/// Relative error of the replayed law from which something is wrong with it although no fault explains it.
const LAW_IS_ANOTHER: f64 = 0.1;
/// Part of a richer friction's gain in the closed loop that makes plain dry friction the name to begin with.
const NEARLY_ALL: f64 = 0.9;
/// Factor by which a term may raise the closed loop's error on the hold-out: chance alone.
const WORSE: f64 = 1.02;
/// Closed-loop error of the plain fit, over that of the whitened one, below which the noise model does harm.
const PLAINER: f64 = 0.97;
/// Part of a recording that is held out when no other is given.
const HELD_OUT: f64 = 0.3;

/// What a diagnosis concludes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The nominal model explains the recording.
    NoMismatch,
    /// The nominal model with other numbers explains it.
    Parameters,
    /// Physics is missing, and named.
    MissingPhysics,
    /// Something is missing and placed, but it can't be named.
    Located,
}

impl Verdict {
    /// The word in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoMismatch => "no_mismatch",
            Self::Parameters => "parameters",
            Self::MissingPhysics => "missing_physics",
            Self::Located => "located",
        }
    }
}

/// A term that was found, and what speaks for it.
#[derive(Debug, Clone)]
pub struct Named {
    /// The term with its fitted numbers.
    pub term: Term,
    /// Half widths of the 95 % intervals of its parameters.
    pub half_widths: Vec<f64>,
    /// Kinds that these recordings can't tell from it.
    pub tied: Vec<&'static str>,
    /// Gain on the training part after the cost of its parameters, log-likelihood.
    pub train_gain: f64,
    /// Gain on the hold-out in standard errors.
    pub holdout_errors: f64,
}

impl Named {
    /// A term of one parameter that was found outside the search.
    fn alone(term: Term, half_width: f64, train_gain: f64, holdout_errors: f64) -> Self {
        Self { term, half_widths: vec![half_width], tied: Vec::new(), train_gain, holdout_errors }
    }
}

/// A nominal parameter before and after.
#[derive(Debug, Clone, PartialEq)]
pub struct Refitted {
    /// Its name.
    pub name: String,
    /// In the loop file.
    pub nominal: f64,
    /// Fitted.
    pub value: f64,
    /// Half width of its 95 % interval.
    pub half_width: f64,
}

/// A candidate that lost, or could not be tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Rejected {
    /// Its kind.
    pub kind: &'static str,
    /// Why.
    pub why: String,
}

/// The fits of the closed loop on one part of the data.
#[derive(Debug, Clone, Copy, Default)]
pub struct Fits {
    /// The loop file as it came.
    pub nominal: Option<prove::FitPct>,
    /// With its own parameters refitted.
    pub before: Option<prove::FitPct>,
    /// With the named physics.
    pub after: Option<prove::FitPct>,
}

/// Everything that was found.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// The conclusion.
    pub verdict: Verdict,
    /// Where in the loop.
    pub place: Option<Place>,
    /// The named terms, the strongest first.
    pub physics: Vec<Named>,
    /// The nominal parameters.
    pub parameters: Vec<Refitted>,
    /// Rivals that lost.
    pub rejected: Vec<Rejected>,
    /// Terms that can't act here or were not excited.
    pub untestable: Vec<Rejected>,
    /// On the training part.
    pub train: Fits,
    /// On the hold-out.
    pub holdout: Fits,
    /// 95 % interval of the improvement on the hold-out, per cent of u.
    pub improvement: Option<[f64; 2]>,
    /// What noise alone leaves of the fit.
    pub noise_floor: Option<prove::FitPct>,
    /// The loop that was diagnosed: the loop file's, its plant identified where that was left open.
    pub nominal: Loop,
    /// The nominal loop with its own numbers refitted.
    pub refitted: Loop,
    /// The improved loop.
    pub improved: Loop,
    /// The drive that the improved loop still misses.
    pub drive_left: Option<MissingDrive>,
    /// The control law against the recorded u.
    pub controller: Option<ControllerReplay>,
    /// The missing drive of the refitted nominal model.
    pub missing_drive: Option<MissingDrive>,
}

/// Diagnoses a recording against a loop; without a hold-out the last 30 % are held out.
///
/// # Errors
/// The plant is still to be identified, the recording is too short, or the nominal model can't be simulated.
pub fn diagnose(recording: &Signals, holdout: Option<&Signals>, nominal: &Loop) -> Result<Diagnosis> {
    let cut = ((1.0 - HELD_OUT) * recording.len() as f64) as usize;
    let (train, held) = match holdout {
        Some(holdout) => (recording.clone(), holdout.clone()),
        None => (recording.part(0, cut), recording.part(cut, recording.len())),
    };
    let whole = if holdout.is_some() { &train } else { recording };
    if nominal.plant == Plant::Identify
        && nominal.controller == Controller::Recorded
        && let Some(valve) = valve::find(recording)
    {
        let model = Loop { plant: valve.plant.clone(), ..nominal.clone() };
        let case =
            Case { nominal: &model, train: recording, holdout: &held, whole: recording, guessed: true };
        return case.run_valve(&valve);
    }
    let identified = identify::plant(nominal, &train)?;
    let mut model = identified.as_ref().map_or(nominal, |found| &found.nominal).clone();
    if another_law(&model, &train, &held) {
        model.controller = Controller::Recorded;
    }
    let guessed = identified.is_some() || model.controller == Controller::Recorded;
    let case = Case { nominal: &model, train: &train, holdout: &held, whole, guessed };
    if guessed {
        return case.run_recorded(identified.as_ref());
    }
    case.run()
}

/// Whether the hold-out was recorded under another law than the stated one, which the training part follows: closing the loop
/// over it would prove nothing.
fn another_law(model: &Loop, train: &Signals, holdout: &Signals) -> bool {
    let error = |signals| controller_replay::replay(model, signals).map(|replay| replay.relative);
    matches!((error(train), error(holdout)), (Some(here), Some(there)) if here < LAW_IS_ANOTHER && there > LAW_IS_ANOTHER)
}

/// One loop, one training part, one hold-out.
#[derive(Clone, Copy)]
struct Case<'a> {
    nominal: &'a Loop,
    train: &'a Signals,
    holdout: &'a Signals,
    /// The training part, and the hold-out where both are of one recording.
    whole: &'a Signals,
    /// Whether the plant was identified or the law is unknown: then little is named.
    guessed: bool,
}

impl Case<'_> {
    fn run(&self) -> Result<Diagnosis> {
        let stated_model = Model::refit(self.nominal, self.train);
        let stated = Fit::start(&stated_model, self.train, &Whitener::none()).ok_or_else(|| {
            Error::new("the nominal model can't follow the recorded u: it diverges")
                .allowed("a loop file whose units, signs and sample time fit the recording")
        })?;
        let refit = stated.clone().search(self.train, Effort::FULL).settle(self.train, Effort::FULL);
        let missing = self.missing_drive(&refit);
        let controller = controller_replay::replay(self.nominal, self.train);

        let under = constant_load::under(&refit, self.train)
            .map(|fit| fit.search(self.train, Effort::FULL).settle(self.train, Effort::FULL));
        let from = under.as_ref().and_then(|_| constant_load::under(&stated, self.train));
        let stands = under.is_some();
        let mut base = under.unwrap_or_else(|| refit.clone());
        let mut named: Vec<(Scored, Vec<&'static str>)> = Vec::new();
        let mut rejected = Vec::new();
        let mut located = None;
        // What is left of y tells more than the closed loop, but once a term is named, also what no term explains is in it.
        let begin = !is_white(&base.residual) || self.unexplained(&base);
        while named.len() < MOST_TERMS && if named.is_empty() { begin } else { self.unexplained(&base) } {
            let from = if named.is_empty() { from.as_ref().unwrap_or(&stated).clone() } else { base.clone() };
            let left = self.missing_drive(&base);
            let scored;
            (base, scored) = self.round(&from, base, left.as_ref());
            let Some((winner, tied)) = self.pick(&base, &scored) else {
                if named.is_empty() {
                    rejected = losers(&scored, None);
                }
                break;
            };
            if tied.len() > MOST_TIED {
                located = Some(winner.candidate.kind.place);
                break;
            }
            if named.is_empty() {
                rejected = losers(&scored, Some(&winner));
            }
            base = winner.candidate.fit.clone();
            named.push((winner, tied));
            if is_white(&base.residual) {
                // What is left is white: there is nothing more to find.
                break;
            }
        }
        if stands {
            (base, named) = self.judge_load(base, named);
        }
        let refit = if base.model.whitens() { refit } else { refit.plain(self.train) };
        self.conclude(&stated, &refit, &base, named, located, rejected, missing, controller)
    }

    /// The constant load that was laid under the search stays as a term, the first, or goes.
    #[allow(clippy::type_complexity)]
    fn judge_load(
        &self,
        base: Fit,
        mut named: Vec<(Scored, Vec<&'static str>)>,
    ) -> (Fit, Vec<(Scored, Vec<&'static str>)>) {
        let Some(without) = constant_load::without(&base, self.nominal.physics.len(), self.train) else {
            return (base, named);
        };
        let Ok(kind) = Kind::named("load_step") else { return (base, named) };
        let scored = select::score(&without, vec![Candidate { kind, fit: base.clone() }], self.holdout);
        match scored.into_iter().find(|s| s.accepted() && self.matters(&without, &s.candidate.fit)) {
            Some(load) => {
                named.insert(0, (load, Vec::new()));
                (base, named)
            }
            None => (without, named),
        }
    }

    fn missing_drive(&self, refit: &Fit) -> Option<MissingDrive> {
        let (model, _) = refit.model.loop_at(&refit.model.x)?;
        let linear = model.plant.linear().ok()??;
        let error = observer::undone(&model.plant, &refit.residual, self.train.sample_time_s);
        MissingDrive::of(&linear, &error, self.train.sample_time_s)
    }

    /// All kinds that are not in the model yet, scored against the base.
    fn round(&self, stated: &Fit, base: Fit, missing: Option<&MissingDrive>) -> (Fit, Vec<Scored>) {
        let signatures = features::signatures(self.nominal, self.train, missing);
        let stands = self.nominal.physics.len();
        let present: Vec<&str> = (base.model.nominal.physics.iter().enumerate())
            // A load that begins later may come on top of the constant one.
            .filter(|(i, t)| !(*i == stands && t.kind.name == "load_step" && t.onset_s == 0.0))
            .map(|(_, t)| t.kind.name)
            .collect();
        let by_direction = by_direction::trials(&base.model, self.train.duration_s());
        let wanted = |kind: &Kind| {
            kind.place != Place::Controller
                && !["injected_signal", "sensor_noise", "quantization"].contains(&kind.name)
                && !present.contains(&kind.name)
                && (by_direction.is_empty()
                    || !["directional_friction", "stribeck_friction"].contains(&kind.name))
        };
        let mut trials = screen::screen(stated, &base, self.train, &signatures, wanted, 1);
        if !by_direction.is_empty() && !present.contains(&"directional_friction") {
            trials.push(by_direction.clone());
        }
        let fitted = candidates::fit_all(&trials, stated, &base, self.train);
        let plain = !base.model.whitens() || self.is_plainer(&fitted);
        let (base, mut fitted) =
            if plain { (base.plain(self.train), fitted.plain) } else { (base, fitted.whitened) };
        let special = self.special(stated, &base).into_iter();
        fitted.extend(
            special.map(|c| Candidate { fit: if plain { c.fit.plain(self.train) } else { c.fit }, ..c }),
        );
        let scored = select::score(&base, fitted, self.holdout);
        (base, scored)
    }

    /// Whether the closed loop comes closer to the training part with the numbers of the plain fits.
    fn is_plainer(&self, fitted: &candidates::Fitted) -> bool {
        let error = |candidates: &[Candidate]| {
            let fit = &candidates.first()?.fit;
            let (model, _) = fit.model.loop_at(&fit.model.x)?;
            Some(error(fit_pct(&model, self.train)?))
        };
        match (error(&fitted.plain), error(&fitted.whitened)) {
            (Some(plain), Some(whitened)) => plain < PLAINER * whitened,
            (plain, whitened) => plain.is_some() && whitened.is_none(),
        }
    }

    /// Effects that no prediction of y shows: noise that changes, a grid of values.
    fn special(&self, stated: &Fit, base: &Fit) -> Vec<Candidate> {
        // A refit may bend the nominal model so far towards a strong signal that its levels no longer stand apart.
        let injected = [base, stated].into_iter();
        injected
            .filter_map(|from| injected::candidate(from, base, self.train, self.whole))
            .max_by(|a, b| a.fit.log_likelihood.total_cmp(&b.fit.log_likelihood))
            .into_iter()
            .collect()
    }

    /// The winner and what it is tied with.
    fn pick(&self, base: &Fit, scored: &[Scored]) -> Option<(Scored, Vec<&'static str>)> {
        let stands = |s: &&Scored| {
            s.accepted() && self.matters(base, &s.candidate.fit) && self.helps(base, &s.candidate.fit)
        };
        let winner = scored.iter().find(stands)?;
        let winner = self.simpler(base, winner, scored).filter(stands).unwrap_or(winner);
        let others: Vec<Scored> =
            scored.iter().filter(|s| s.candidate.kind != winner.candidate.kind).cloned().collect();
        let tied: Vec<&'static str> =
            select::ties(winner, &others).into_iter().map(|s| s.candidate.kind.name).collect();
        // Of two that commute exactly, the loop's own name stands for both.
        let twin = (winner.candidate.kind.name == "sensor_lag")
            .then(|| others.iter().find(|s| s.candidate.kind.name == "unmodelled_lag"))
            .flatten()
            .filter(|s| tied.contains(&s.candidate.kind.name));
        if let Some(lag) = twin {
            let mut tied: Vec<&'static str> = tied.into_iter().filter(|k| *k != "unmodelled_lag").collect();
            tied.push("sensor_lag");
            return Some((lag.clone(), tied));
        }
        Some((winner.clone(), tied))
    }

    /// Plain dry friction, where it takes nearly all of what a richer friction takes: what that adds is looked for in the rest.
    fn simpler<'s>(&self, base: &Fit, winner: &Scored, scored: &'s [Scored]) -> Option<&'s Scored> {
        if winner.candidate.kind.name != "directional_friction" {
            return None;
        }
        let left = |fit: &Fit| {
            let (model, _) = fit.model.loop_at(&fit.model.x)?;
            Some(error(fit_pct(&model, self.train)?))
        };
        let dry = scored.iter().find(|s| s.candidate.kind.name == "coulomb_friction")?;
        let (before, with_dry, with_rich) =
            (left(base)?, left(&dry.candidate.fit)?, left(&winner.candidate.fit)?);
        (before - with_dry > NEARLY_ALL * (before - with_rich)).then_some(dry)
    }

    /// Whether the closed loop is further from what was measured than noise would bring it.
    fn unexplained(&self, fit: &Fit) -> bool {
        let run = || {
            let (model, _) = fit.model.loop_at(&fit.model.x)?;
            let [seen, unseen] = [self.train, self.holdout].map(|signals| {
                let far = error(fit_pct(&model, signals)?);
                // Only what changes faster than a plant can is sure to be noise.
                let noise = missing_drive::noise_floor(&fit.residual);
                let floor = error(noise_floor(&model, noise, signals)?);
                Some(far * far > FLOOR * floor * floor + LEAST_ERROR * LEAST_ERROR)
            });
            Some(seen? || unseen?)
        };
        run().unwrap_or(true)
    }

    /// Whether the closed loop of the hold-out comes no further from what was measured.
    fn helps(&self, base: &Fit, with: &Fit) -> bool {
        let fit = |fit: &Fit| {
            let (model, _) = fit.model.loop_at(&fit.model.x)?;
            Some(error(fit_pct(&model, self.holdout)?))
        };
        match (fit(base), fit(with)) {
            (Some(before), Some(after)) => after < WORSE * before,
            (before, after) => before.is_none() && after.is_some(),
        }
    }

    /// Whether the closed loop's u depends on the term by a part that matters, on either part of the data.
    fn matters(&self, base: &Fit, with: &Fit) -> bool {
        let moved = |signals: &Signals| {
            let run = |fit: &Fit| {
                let (model, _) = fit.model.loop_at(&fit.model.x)?;
                Some((prove::run(&model, signals, 0)?, model))
            };
            let (after, model) = run(with)?;
            let Some((before, _)) = run(base) else { return Some(true) };
            let noise = missing_drive::noise_floor(&with.residual);
            let floor = OF_NOISE * error(noise_floor(&model, noise, signals)?);
            let difference = prove::difference(&after, &before, self.nominal);
            Some(difference * difference > LEAST_EFFECT * LEAST_EFFECT + floor * floor)
        };
        [self.train, self.holdout].into_iter().any(|signals| moved(signals).unwrap_or(false))
    }

    #[allow(clippy::too_many_arguments)]
    fn conclude(
        &self,
        stated: &Fit,
        refit: &Fit,
        base: &Fit,
        named: Vec<(Scored, Vec<&'static str>)>,
        located: Option<Place>,
        rejected: Vec<Rejected>,
        missing_drive: Option<MissingDrive>,
        controller: Option<ControllerReplay>,
    ) -> Result<Diagnosis> {
        let widths = interval::half_widths(base, self.train);
        let lost = || Error::new("the fitted model can't be simulated");
        let (improved, _) = base.model.loop_at(&base.model.x).ok_or_else(lost)?;
        let (refitted, _) = refit.model.loop_at(&refit.model.x).ok_or_else(lost)?;
        let physics: Vec<Named> = named
            .iter()
            .enumerate()
            .map(|(index, (scored, tied))| Named {
                term: improved.physics.get(self.nominal.physics.len() + index).cloned().unwrap_or_else(
                    || Term {
                        kind: scored.candidate.kind,
                        parameters: Vec::new(),
                        onset_s: 0.0,
                        spans: Vec::new(),
                    },
                ),
                half_widths: term_widths(
                    base,
                    &widths,
                    self.nominal.physics.len() + index,
                    scored.candidate.kind,
                ),
                tied: tied.clone(),
                train_gain: scored.train_gain,
                holdout_errors: scored.holdout_errors,
            })
            .collect();
        let mut physics = physics;
        if physics.len() > 1 && named.first().is_some_and(|(s, _)| s.candidate.kind.name == "load_step") {
            // It was laid under the others, which are stronger.
            physics.rotate_left(1);
        }
        let (mut improved, mut located) = (improved, located);
        let continued = self.whole.len() > self.train.len();
        let sensor = || sensor_effects::find(base, self.train, self.holdout, continued);
        for effect in if self.guessed { Vec::new() } else { sensor() } {
            improved.physics.push(effect.term.clone());
            physics.push(Named::alone(
                effect.term,
                effect.half_width,
                effect.train_gain,
                effect.holdout_errors,
            ));
        }
        if let Some(replay) = &controller {
            let fault = controller_fault::find(self.nominal, replay, self.train, self.holdout);
            match fault {
                Some(fault) => {
                    improved.physics.push(fault.term.clone());
                    let errors = fault.holdout_share * libm::sqrt(self.holdout.len() as f64);
                    physics.insert(0, Named::alone(fault.term, fault.half_width, fault.train_gain, errors));
                }
                None if replay.relative > LAW_IS_ANOTHER && physics.is_empty() => {
                    located = Some(Place::Controller);
                }
                None => {}
            }
        }
        let parameters = refitted_parameters(base, &widths);
        let changed = !self.guessed
            && refit.log_likelihood - stated.clone().renoised().log_likelihood > 20.0
            && parameters.iter().any(|p| {
                (p.value - p.nominal).abs() > p.half_width && (p.value / p.nominal - 1.0).abs() > 0.005
            });
        let verdict = match (physics.is_empty(), located, changed) {
            (false, _, _) => Verdict::MissingPhysics,
            (true, Some(_), _) => Verdict::Located,
            (true, None, true) => Verdict::Parameters,
            (true, None, false) => Verdict::NoMismatch,
        };
        let place = physics.first().map(|p| p.term.kind.place).or(located);
        let fits = |signals: &Signals| Fits {
            nominal: fit_pct(self.nominal, signals),
            before: fit_pct(&refitted, signals),
            after: fit_pct(&improved, signals),
        };
        let improvement =
            match (prove::run(&refitted, self.holdout, 0), prove::run(&improved, self.holdout, 0)) {
                (Some(a), Some(b)) => prove::improvement(&a, &b, self.nominal, self.holdout),
                _ => None,
            };
        Ok(Diagnosis {
            verdict,
            place,
            physics,
            parameters,
            rejected,
            untestable: untestable(&self.nominal.plant),
            train: fits(self.train),
            holdout: fits(self.holdout),
            improvement,
            noise_floor: noise_floor(&improved, base.variance, self.holdout),
            nominal: self.nominal.clone(),
            refitted,
            improved,
            drive_left: self.missing_drive(base),
            controller,
            missing_drive,
        })
    }
}

fn losers(scored: &[Scored], winner: Option<&Scored>) -> Vec<Rejected> {
    scored
        .iter()
        .filter(|s| winner.is_none_or(|w| w.candidate.kind != s.candidate.kind))
        .map(|s| Rejected {
            kind: s.candidate.kind.name,
            why: match winner {
                Some(winner) if s.accepted() => format!(
                    "{:.1} less likely than {} over both recordings",
                    winner.total() - s.total(),
                    winner.candidate.kind.name
                ),
                _ => s.why_not(),
            },
        })
        .collect()
}

fn untestable(plant: &Plant) -> Vec<Rejected> {
    crate::physics::KINDS
        .iter()
        .filter(|kind| !(kind.applies)(plant))
        .map(|kind| Rejected { kind: kind.name, why: format!("can't act on a {} plant", plant.kind()) })
        .collect()
}

fn term_widths(fit: &Fit, widths: &[f64], term: usize, kind: &Kind) -> Vec<f64> {
    (0..kind.parameters.len())
        .map(|parameter| {
            let target = Target::Term { term, parameter };
            let at = fit.model.free.iter().position(|f| f.target == target);
            at.and_then(|i| widths.get(i).copied()).unwrap_or(f64::NAN)
        })
        .collect()
}

fn refitted_parameters(fit: &Fit, widths: &[f64]) -> Vec<Refitted> {
    let nominal = model::plant_numbers(&fit.model.nominal.plant);
    fit.model
        .free
        .iter()
        .zip(&fit.model.x)
        .zip(widths)
        .filter_map(|((free, value), width)| match free.target {
            Target::Plant(i) => Some(Refitted {
                name: free.name.clone(),
                nominal: nominal.get(i).map_or(f64::NAN, |n| n.1),
                value: *value,
                half_width: *width,
            }),
            _ => None,
        })
        .collect()
}

fn fit_pct(model: &Loop, signals: &Signals) -> Option<prove::FitPct> {
    Some(prove::fit_of(model, &prove::run(model, signals, 0)?, signals))
}

fn is_white(residual: &[f64]) -> bool {
    Whitener::of(residual).order() == 0
}

/// Relative error of u, of y where the law is not known.
fn error(fit: prove::FitPct) -> f64 {
    0.01 * (100.0 - fit.u_pct.unwrap_or(fit.y_pct))
}

/// How well the improved model fits itself under sensor noise of the size seen.
fn noise_floor(improved: &Loop, variance: f64, signals: &Signals) -> Option<prove::FitPct> {
    let quiet = prove::run(improved, signals, 0)?;
    let mut noisy = improved.clone();
    noisy.sensor.noise = libm::sqrt(variance);
    let trace = prove::run(&noisy, signals, 1)?;
    let measured = Signals { y: trace.y, u: trace.u, ..signals.clone() };
    Some(prove::fit_of(improved, &quiet, &measured))
}
