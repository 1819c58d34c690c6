//! A loop: controller + plant + sensor + measured inputs + a list of physics terms.

use crate::controller::Controller;
use crate::measured_input::Input;
use crate::physics::{Term, UnitNames, Units};
use crate::plant::{Plant, StateSpace};
use crate::sentences::typed;
use crate::{Error, Result};

/// The largest size of a number that states a loop or drives it. A double carries 15 digits: beside a larger number nothing is left of a
/// signal of size 1, so that the number is a mistake in the unit or the exponent.
pub const LARGEST: f64 = 1e15;

/// The shortest and the longest sample time that a loop can have, s: a nanosecond, faster than any controller, and 30 years.
pub const SAMPLE_TIMES_S: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

/// A control loop as the loop file states it.
#[derive(Debug, Clone, PartialEq)]
pub struct Loop {
    /// Time between samples in seconds, > 0.
    pub sample_time_s: f64,
    /// Names of units, for reports.
    pub units: Units,
    /// The control law, with its limits of u.
    pub controller: Controller,
    /// The nominal plant: what the model knows.
    pub plant: Plant,
    /// The sensor as it is when healthy.
    pub sensor: Sensor,
    /// Measured signals that enter the loop besides r.
    pub inputs: Vec<Input>,
    /// Physics on top of the nominal model. Within one place, terms act in this order.
    pub physics: Vec<Term>,
}

/// The sensor as it is when healthy.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sensor {
    /// Standard deviation of the white noise that it adds, in the unit of y; 0 for none.
    pub noise: f64,
}

impl Loop {
    /// The closed loop of the paper (its section 4, eq. 10-12): two complex modes and a real one, PI 300/100 at 1 ms.
    pub fn paper() -> Self {
        let (sigma, omega, lambda) = (-0.2, 2.0, -0.5);
        let a = vec![vec![sigma, omega, 0.0], vec![-omega, sigma, 0.0], vec![0.0, 0.0, lambda]];
        let plant = StateSpace { a, b: vec![1.0, 0.0, 0.0], c: vec![1.0, 0.0, 0.0], d: 0.0 };
        let limits = crate::controller::Limits::NONE;
        Self {
            sample_time_s: 0.001,
            units: Units::default(),
            controller: Controller::Pi(crate::controller::Pi {
                kp: 300.0,
                ki: 100.0,
                limits,
                anti_windup: true,
            }),
            plant: Plant::StateSpace(plant),
            sensor: Sensor::default(),
            inputs: Vec::new(),
            physics: Vec::new(),
        }
    }

    /// Whether a recording sampled every `recorded_s` is of this loop: within 2 %, which rounded time stamps and nominal rates need.
    ///
    /// # Errors
    /// It is sampled at another rate.
    pub fn check_sample_time(&self, recorded_s: f64) -> Result<()> {
        const CLOCK: f64 = 0.02;
        let stated_s = self.sample_time_s;
        if (recorded_s / stated_s - 1.0).abs() <= CLOCK {
            return Ok(());
        }
        let (recorded, stated) = (typed(recorded_s), typed(stated_s));
        let what = format!("sampled every {recorded} s, but the loop file's sample_time_s is {stated} s");
        Err(Error::new(what).allowed(format!(
            "state the recording's sample time in the loop file, or add --resample {stated}"
        )))
    }

    /// The units that parameters are built from.
    pub fn unit_names(&self) -> UnitNames {
        UnitNames::new(&self.units, &self.plant)
    }

    /// The columns of a recording, beside r, y and u, that its measured inputs are made of.
    pub fn input_columns(&self) -> Vec<String> {
        let mut columns: Vec<String> = Vec::new();
        for column in self.inputs.iter().flat_map(Input::columns) {
            if !["r", "y", "u"].contains(&column) && !columns.iter().any(|known| known == column) {
                columns.push(column.to_owned());
            }
        }
        columns
    }

    /// Whether a law is stated; else u is taken as recorded, and only the plant can be simulated.
    pub fn has_law(&self) -> bool {
        self.controller != Controller::Recorded
    }

    /// The same loop with one more term.
    #[must_use]
    pub fn with(mut self, term: Term) -> Self {
        self.physics.push(term);
        self
    }

    /// Whether every term is sound and can act on this plant.
    ///
    /// # Errors
    /// The first that is or can not.
    pub fn check(&self) -> Result<()> {
        self.physics.iter().try_for_each(|term| self.check_term(term))
    }

    /// Whether a term is sound and can act on this plant.
    ///
    /// # Errors
    /// It is or can not; the message names the plants that it can act on.
    pub fn check_term(&self, term: &Term) -> Result<()> {
        term.check()?;
        if !(term.kind.applies)(&self.plant) {
            return Err(Error::new(format!("{} can't act on a {} plant", term.kind.name, self.plant.kind()))
                .allowed(format!("physics for this plant: {}", kinds_for(&self.plant))));
        }
        let needs = term.kind.name == "injected_signal";
        let wrong = if term.spans.is_empty() { needs } else { !term.kind.takes_spans() };
        if wrong {
            let what = if needs { "needs spans" } else { "takes no spans" };
            return Err(Error::new(format!("{} {what}", term.kind.name))
                .allowed("spans = [[from, to], ...] in seconds, for injected_signal and sensor_bias alone"));
        }
        Ok(())
    }
}

/// The names of the kinds that can act on a plant.
fn kinds_for(plant: &Plant) -> String {
    let fit = crate::physics::KINDS.iter().filter(|kind| (kind.applies)(plant));
    fit.map(|kind| kind.name).collect::<Vec<_>>().join(", ")
}
