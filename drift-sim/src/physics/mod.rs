//! The library of physics: what a loop model may have left out, one term a file.
//!
//! A [`Kind`] says everything about one piece of physics: its name, place, parameters with units and ranges,
//! what it does to a simulation, which excitation shows it, which
//! other kinds it can't be told from, and one plain sentence. A [`Term`] is a kind with numbers: a fault that the
//! simulator injects, a candidate that a diagnosis tries, a line of an improved model.
//!
//! To add physics: write one file, add one row to [`KINDS`].

mod effect;
mod parameter;
mod scales;
mod starts;
mod units;

mod backlash;
mod cogging;
mod controller_delay;
mod controller_gain;
mod coulomb_friction;
mod dead_zone;
mod delay;
mod directional_friction;
mod flexible_mode;
mod gain_loss;
mod gravity;
mod inertia_change;
mod injected_signal;
mod leak;
mod load_dependent_friction;
mod load_ramp;
mod load_step;
mod nonlinear_gain;
mod periodic_load;
mod quadratic_drag;
mod quantization;
mod radiation;
mod rate_limit;
mod saturation;
mod sensor_bias;
mod sensor_drift;
mod sensor_hysteresis;
mod sensor_lag;
mod sensor_noise;
mod stiction;
mod stiffness;
mod stribeck_friction;
mod unmodelled_lag;
mod viscous_friction;

pub use effect::{Context, Effect, Follows, Hook, Motion, Numbers};
pub use parameter::{Parameter, Range, Searched, Shared};
pub use scales::Scales;
pub use starts::{Over, Start, Starts, Weight, grid};
pub use stiction::stem;
pub use units::{UnitNames, Units, digits, shown, significant, with_unit};

use crate::plant::Plant;
use crate::sentences::typed;
use crate::{Error, Result};

/// All kinds, in the order in which lists and messages name them.
pub static KINDS: &[&Kind] = &[
    &coulomb_friction::KIND,
    &stribeck_friction::KIND,
    &directional_friction::KIND,
    &load_dependent_friction::KIND,
    &quadratic_drag::KIND,
    &viscous_friction::KIND,
    &inertia_change::KIND,
    &cogging::KIND,
    &stiffness::KIND,
    &gravity::KIND,
    &flexible_mode::KIND,
    &radiation::KIND,
    &leak::KIND,
    &nonlinear_gain::KIND,
    &gain_loss::KIND,
    &dead_zone::KIND,
    &saturation::KIND,
    &rate_limit::KIND,
    &backlash::KIND,
    &stiction::KIND,
    &delay::KIND,
    &unmodelled_lag::KIND,
    &sensor_bias::KIND,
    &sensor_drift::KIND,
    &sensor_noise::KIND,
    &sensor_lag::KIND,
    &sensor_hysteresis::KIND,
    &quantization::KIND,
    &load_step::KIND,
    &load_ramp::KIND,
    &periodic_load::KIND,
    &injected_signal::KIND,
    &controller_gain::KIND,
    &controller_delay::KIND,
];

/// Where in the loop a term acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Place {
    /// The control law.
    Controller,
    /// Between u and the plant.
    Actuator,
    /// The plant itself.
    Plant,
    /// Somewhere around the loop: actuator and sensor can't be told apart.
    Loop,
    /// Between the true and the measured y.
    Sensor,
    /// From outside the loop: loads and injected signals.
    Disturbance,
}

impl Place {
    /// The word in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Controller => "controller",
            Self::Actuator => "actuator",
            Self::Plant => "plant",
            Self::Loop => "loop",
            Self::Sensor => "sensor",
            Self::Disturbance => "disturbance",
        }
    }
}

/// When a term begins, as a diagnosis may suppose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Begins {
    /// Before the recording: part of the machine.
    Start,
    /// Within the recording: from its start on it would be the nominal model with other numbers, or nothing that
    /// shows.
    Later,
    /// Before or within the recording.
    Either,
}

/// Kinds that often can't be told from each other, and where the simplest that does is named, the others beside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Dry friction, whatever it depends on.
    Friction,
    /// An offset of sensor or load; at a constant u a loss of gain is one, and at a constant y a leak.
    Offset,
    /// A ramp of sensor or load.
    Ramp,
    /// The response is late.
    Lag,
    /// Play and sticking between u and the plant.
    Play,
    /// A force that depends on the position.
    Spring,
    /// A force that swings over time, or over the position: at a constant speed these are one.
    Wave,
}

/// Everything that is known of one piece of physics.
pub struct Kind {
    /// Its name in files, reports and code.
    pub name: &'static str,
    /// Where in the loop it acts.
    pub place: Place,
    /// When it begins, as a diagnosis may suppose.
    pub begins: Begins,
    /// Its parameters, in the order of [`Term::parameters`].
    pub parameters: &'static [Parameter],
    /// Which plants it can act on.
    pub applies: fn(&Plant) -> bool,
    /// What its parameters must fulfil together; else why not.
    pub consistent: fn(&[f64]) -> std::result::Result<(), &'static str>,
    /// What it does to the simulation.
    pub effect: fn(&[f64], &Context) -> Box<dyn Effect>,
    /// Where a search of the likelihood begins.
    pub search: Starts,
    /// Which kinds it often can't be told from; see [`Kind::family_on`].
    pub family: Option<Family>,
    /// What a recording must contain for the term to show.
    pub excitation: &'static str,
    /// Kinds that can leave the same traces.
    pub ties: &'static [&'static str],
    /// The experiment that tells it from those.
    pub experiment: &'static str,
    /// The term as one plain sentence, from its parameters (in their order) and the loop's units.
    pub says: fn(&[f64], &UnitNames) -> String,
}

impl Kind {
    /// Whether it is play, or sticking, at this place.
    pub fn plays_at(&self, place: Place) -> bool {
        self.family == Some(Family::Play) && self.place == place
    }

    /// Whether both are of one family.
    pub fn is_related(&self, other: &Self) -> bool {
        self.family.is_some() && self.family == other.family
    }

    /// The kind of this name.
    ///
    /// # Errors
    /// There is none; the message lists those that there are.
    pub fn named(name: &str) -> Result<&'static Self> {
        let names = || KINDS.iter().map(|kind| kind.name).collect::<Vec<_>>().join(", ");
        KINDS
            .iter()
            .find(|kind| kind.name == name)
            .copied()
            .ok_or_else(|| Error::new(format!("unknown physics kind '{name}'")).allowed(names()))
    }

    /// Whether it may act within spans alone: `injected_signal` always does, `sensor_bias` can.
    pub fn takes_spans(&self) -> bool {
        ["injected_signal", "sensor_bias"].contains(&self.name)
    }

    /// The play between the plant and what its sensor shows, which is its first parameter; `None` of other kinds.
    pub fn gap(&self, parameters: &[f64]) -> Option<f64> {
        if self.name == "sensor_hysteresis" { parameters.first().copied() } else { None }
    }

    /// Its family on a plant: what a drifting sensor adds to y is what an integrator makes of a load that stays, and what a motor's position soon becomes under it.
    pub fn family_on(&self, plant: &Plant) -> Option<Family> {
        match (self.family, self.place) {
            (Some(Family::Ramp), Place::Sensor) if !plant.keeps_its_level() => Some(Family::Offset),
            (family, _) => family,
        }
    }

    /// Whether terms with these parameters are of one form: they differ in numbers that a fit moves alone.
    pub fn is_one_form(&self, a: &[f64], b: &[f64]) -> bool {
        let forms = self.parameters.iter().zip(a.iter().zip(b)).filter(|(parameter, _)| !parameter.fitted);
        forms.into_iter().all(|(_, (a, b))| a == b)
    }

    /// The names of its parameters, for messages.
    pub fn parameter_names(&self) -> String {
        self.parameters.iter().map(|parameter| parameter.name).collect::<Vec<_>>().join(", ")
    }

    /// The names of those that have to be stated.
    fn needed_parameters(&self) -> String {
        let needed = self.parameters.iter().filter(|parameter| parameter.default.is_none());
        needed.map(|parameter| parameter.name).collect::<Vec<_>>().join(", ")
    }
}

impl std::fmt::Debug for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Kind {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// A kind with numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// What it is.
    pub kind: &'static Kind,
    /// Its numbers, in the order of [`Kind::parameters`].
    pub parameters: Vec<f64>,
    /// When it begins, in seconds from the start; it acts from the first sample at or after this. Below 0 it has begun before.
    pub onset_s: f64,
    /// When it acts, as pairs (from, to) in seconds; `injected_signal` needs at least one, `sensor_bias` may have them.
    pub spans: Vec<(f64, f64)>,
}

impl Term {
    /// A term that acts from the start.
    ///
    /// # Errors
    /// An unknown kind or parameter, a missing one, a value out of range, or values that contradict each other.
    pub fn new(kind: &str, parameters: &[(&str, f64)]) -> Result<Self> {
        let kind = Kind::named(kind)?;
        if let Some((name, _)) =
            parameters.iter().find(|(name, _)| kind.parameters.iter().all(|p| p.name != *name))
        {
            return Err(Error::new(format!("{} has no parameter '{name}'", kind.name))
                .allowed(kind.parameter_names()));
        }
        let value = |parameter: &Parameter| {
            let given = parameters.iter().find(|(name, _)| *name == parameter.name).map(|(_, value)| *value);
            given.or(parameter.default).ok_or_else(|| {
                Error::new(format!("{} lacks the parameter '{}'", kind.name, parameter.name))
                    .allowed(format!("needed: {}", kind.needed_parameters()))
            })
        };
        let parameters = kind.parameters.iter().map(value).collect::<Result<Vec<_>>>()?;
        let term = Self { kind, parameters, onset_s: 0.0, spans: Vec::new() };
        term.check()?;
        Ok(term)
    }

    /// The same from some time on, in seconds.
    #[must_use]
    pub fn from_s(mut self, onset_s: f64) -> Self {
        self.onset_s = onset_s;
        self
    }

    /// The same, acting only within these spans (from, to), in seconds.
    #[must_use]
    pub fn within(mut self, spans: &[(f64, f64)]) -> Self {
        self.spans = spans.to_vec();
        self
    }

    /// Whether it sticks or plays on the way from u to the plant.
    pub fn plays(&self) -> bool {
        self.kind.plays_at(Place::Actuator)
    }

    /// The most that a parameter may be, of either sign, which is a state in which a recording begins; `None` for another one.
    pub fn most_of_state(&self, parameter: usize) -> Option<f64> {
        Some((self.kind.parameters.get(parameter)?.state?)(&self.parameters))
    }

    /// The value of a parameter.
    pub fn value(&self, name: &str) -> Option<f64> {
        let index = self.kind.parameters.iter().position(|parameter| parameter.name == name)?;
        self.parameters.get(index).copied()
    }

    /// Whether all numbers are what they may be; a fit can call it on what it proposes.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<()> {
        let kind = self.kind;
        if self.parameters.len() != kind.parameters.len() {
            return Err(Error::new(format!("{} takes {} parameters", kind.name, kind.parameters.len()))
                .allowed(kind.parameter_names()));
        }
        for (parameter, value) in kind.parameters.iter().zip(&self.parameters) {
            if !parameter.range.allows(*value) {
                return Err(Error::new(format!(
                    "{}: {} = {} is impossible",
                    kind.name,
                    parameter.name,
                    typed(*value)
                ))
                .allowed(format!("{} must be {}", parameter.name, parameter.range.says())));
            }
        }
        (kind.consistent)(&self.parameters).map_err(|why| Error::new(format!("{}: {why}", kind.name)))?;
        if !self.onset_s.is_finite() {
            return Err(Error::new(format!(
                "{}: onset_s = {} is impossible",
                kind.name,
                typed(self.onset_s)
            ))
            .allowed(format!("onset_s must be {}", Range::Any.says())));
        }
        if let Some((from, to)) =
            self.spans.iter().find(|(from, to)| !(*from >= 0.0 && to > from && to.is_finite()))
        {
            return Err(Error::new(format!(
                "{}: the span [{}, {}] is impossible",
                kind.name,
                typed(*from),
                typed(*to)
            ))
            .allowed("0 <= from < to, in seconds"));
        }
        Ok(())
    }

    /// Whether it may hold a mass at rest.
    pub fn is_dry_friction(&self) -> bool {
        self.kind.family == Some(Family::Friction)
    }

    /// The term as one plain sentence.
    pub fn says(&self, units: &UnitNames) -> String {
        (self.kind.says)(&self.parameters, units)
    }
}

/// For kinds whose parameters are free of each other.
fn any_values(_: &[f64]) -> std::result::Result<(), &'static str> {
    Ok(())
}

/// Plants with a moving mass: where forces and dry friction act.
fn is_servo(plant: &Plant) -> bool {
    matches!(plant, Plant::Servo(_))
}

/// Every plant, also one that is still to be identified.
fn every_plant(_: &Plant) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Output, Servo};

    #[test]
    fn names_are_unique_and_ties_name_kinds_that_exist() {
        for (index, kind) in KINDS.iter().enumerate() {
            assert!(KINDS[..index].iter().all(|other| other.name != kind.name), "{}", kind.name);
            for tie in kind.ties {
                assert!(Kind::named(tie).is_ok() && *tie != kind.name, "{} ties with {tie}", kind.name);
            }
            assert!(
                !kind.excitation.is_empty() && kind.ties.is_empty() == kind.experiment.is_empty(),
                "{}",
                kind.name
            );
        }
    }

    /// Parameters of the size of the signals.
    fn typical(kind: &Kind) -> Vec<f64> {
        let scales = Scales::default();
        if let Some(mut points) = kind.search.points(&scales) {
            return points.remove(0).parameters;
        }
        kind.parameters.iter().map(|p| p.neutral + 0.3 * (p.scale)(&scales, 1.0)).collect()
    }

    #[test]
    fn every_start_is_allowed() {
        let scales = Scales { drive: 3.0, y: 2.0, u: 5.0, ..Scales::default() };
        for kind in KINDS {
            let starts = match kind.search.points(&scales) {
                Some(points) => points.into_iter().map(|start| start.parameters).collect(),
                None => vec![typical(kind)],
            };
            assert!(!starts.is_empty(), "{}", kind.name);
            for parameters in starts {
                let parameters = if kind.name == "saturation" { vec![-1.0, 1.0] } else { parameters };
                let term = Term { kind, parameters, onset_s: 0.0, spans: vec![(0.0, 1.0)] };
                term.check().unwrap();
            }
        }
    }

    #[test]
    fn a_family_has_more_than_one_kind_and_a_start_matches_its_parameters() {
        for kind in KINDS {
            let same = KINDS.iter().filter(|other| other.is_related(kind));
            assert!(kind.family.is_none() || same.count() > 1, "{}", kind.name);
            if let Some(all) = kind.search.points(&Scales::default()) {
                assert!(
                    all.iter().all(|start| start.parameters.len() == kind.parameters.len()),
                    "{}",
                    kind.name
                );
            }
        }
    }

    /// Where y integrates what drives it, a load that stays makes the ramp that a drifting sensor makes; where y keeps its level it makes an offset.
    #[test]
    fn a_drifting_sensor_is_of_a_loads_family_where_y_integrates() {
        let motor = |output| Plant::Servo(Servo { output, inertia: 1.0, viscous: 1.0, actuator_gain: 1.0 });
        let kind = |name: &str| Kind::named(name).unwrap();
        let (drift, load) = (kind("sensor_drift"), kind("load_step"));
        assert_eq!(drift.family_on(&motor(Output::Position)), load.family_on(&motor(Output::Position)));
        assert_ne!(drift.family_on(&motor(Output::Speed)), load.family_on(&motor(Output::Speed)));
        assert_eq!(kind("load_ramp").family_on(&motor(Output::Position)), Some(Family::Ramp));
    }

    #[test]
    fn every_kind_says_one_sentence_with_its_numbers() {
        let units = UnitNames { drive: "N".into(), y: "m".into(), ..UnitNames::default() };
        for kind in KINDS {
            let says = (kind.says)(&typical(kind), &units);
            assert!(says.ends_with('.') && !says.contains(['{', '\n']), "{says}");
        }
    }

    #[test]
    fn wrong_terms_are_refused_with_what_is_allowed() {
        let message = |kind, parameters: &[(&str, f64)]| Term::new(kind, parameters).unwrap_err().to_string();
        assert!(message("rust", &[]).contains("coulomb_friction"));
        assert_eq!(
            message("backlash", &[("play", 1.0)]),
            "backlash has no parameter 'play'; width, place_at_start"
        );
        assert_eq!(message("backlash", &[]), "backlash lacks the parameter 'width'; needed: width");
        assert!(message("backlash", &[("width", -1.0)]).contains(">= 0"));
        assert!(message("backlash", &[("width", f64::NAN)]).contains("impossible"));
        assert!(message("saturation", &[("lower", 2.0), ("upper", 1.0)]).contains("lower"));
    }
}
