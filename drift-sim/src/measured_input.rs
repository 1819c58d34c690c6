//! A measured signal that enters the loop besides r: an outdoor temperature, a feed, a payload, or what the physics makes of several of them.

use crate::recording::Recording;
use crate::{Error, Result};

/// A measured signal that enters the loop: `gain * (column - minus) * times`. A heat flow, say, is a temperature drop times a flow.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Its column in recordings, or r, y or u as they were recorded.
    pub column: String,
    /// A column that is subtracted from it.
    pub minus: Option<String>,
    /// A column by which what is left is multiplied.
    pub times: Option<String>,
    /// Where it enters, and with which sign.
    pub enters: Enters,
    /// What it is multiplied by.
    pub gain: Gain,
}

/// What a measured input is multiplied by, in the unit of the place where it enters for each unit of the input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gain {
    /// As the loop file says.
    Stated(f64),
    /// To be found from the recordings, beside the plant's numbers.
    Identify,
    /// So far found, and free in every fit that follows.
    Found(f64),
}

/// Where a measured signal enters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Enters {
    /// Added after the controller's own output.
    Actuator,
    /// Subtracted from the plant's drive.
    Load,
    /// Added to y, before the sensor's own terms that act on what it shows.
    Sensor,
}

impl Enters {
    /// All, as the loop file names them.
    pub const ALL: [(&'static str, Self); 3] =
        [("actuator", Self::Actuator), ("load", Self::Load), ("sensor", Self::Sensor)];
}

impl Gain {
    /// The word for one that is to be found.
    pub const IDENTIFY: &'static str = "identify";

    /// Its value; 0 as long as it is to be found.
    pub fn value(self) -> f64 {
        match self {
            Self::Stated(gain) | Self::Found(gain) => gain,
            Self::Identify => 0.0,
        }
    }

    /// Whether fits move it.
    pub fn is_free(self) -> bool {
        !matches!(self, Self::Stated(_))
    }

    /// Whether it is still to be found.
    pub fn is_open(self) -> bool {
        self == Self::Identify
    }
}

impl Input {
    /// A column that enters as it is.
    pub fn of_column(column: &str, enters: Enters, gain: Gain) -> Self {
        Self { column: column.to_owned(), minus: None, times: None, enters, gain }
    }

    /// One that no recording has a column for, such as noise that is drawn.
    pub fn made(enters: Enters) -> Self {
        Self::of_column("", enters, Gain::Stated(1.0))
    }

    /// The columns that it is made of.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        std::iter::once(&self.column).chain(&self.minus).chain(&self.times).map(String::as_str)
    }

    /// What it is called in messages and reports: `(t_mixed - t_supply) * fan_speed`.
    pub fn name(&self) -> String {
        let difference = match (&self.minus, &self.times) {
            (Some(minus), Some(_)) => format!("({} - {minus})", self.column),
            (Some(minus), None) => format!("{} - {minus}", self.column),
            (None, _) => self.column.clone(),
        };
        match &self.times {
            Some(times) => format!("{difference} * {times}"),
            None => difference,
        }
    }

    /// Its values in a recording, before the gain; one for each sample.
    ///
    /// # Errors
    /// The recording lacks one of its columns.
    pub fn values(&self, recording: &Recording) -> Result<Vec<f64>> {
        self.values_of(|name| recording.column(name))
    }

    /// The same of columns from anywhere, by name.
    ///
    /// # Errors
    /// Those of `column`.
    pub fn values_of<'a>(&self, column: impl Fn(&str) -> Result<&'a [f64]>) -> Result<Vec<f64>> {
        let mut values = column(&self.column)?.to_vec();
        if let Some(minus) = &self.minus {
            values.iter_mut().zip(column(minus)?).for_each(|(value, minus)| *value -= minus);
        }
        if let Some(times) = &self.times {
            values.iter_mut().zip(column(times)?).for_each(|(value, times)| *value *= times);
        }
        Ok(values)
    }

    /// The load that it is where it enters with this value, of a plant whose drive is so much for each unit of u; none at the sensor.
    pub fn load(&self, drive_gain: f64, entering: f64) -> f64 {
        match self.enters {
            Enters::Load => entering,
            Enters::Actuator => -drive_gain * entering,
            Enters::Sensor => 0.0,
        }
    }

    /// Whether its gain is known, so that the loop can be run.
    ///
    /// # Errors
    /// It is to be found.
    pub fn check(&self) -> Result<()> {
        if self.gain.is_open() {
            let what = format!("the gain of the measured input '{}' is still to be identified", self.name());
            return Err(Error::new(what).allowed("a number; `drift diagnose --model` writes the found one"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(name: &str) -> Result<&'static [f64]> {
        match name {
            "t_in" => Ok(&[50.0, 60.0, 70.0]),
            "t_out" => Ok(&[40.0, 45.0, 50.0]),
            "flow" => Ok(&[2.0, 3.0, 0.0]),
            other => Err(Error::new(format!("no column '{other}'"))),
        }
    }

    fn heat() -> Input {
        let part = |name: &str| Some(name.to_owned());
        Input {
            minus: part("t_out"),
            times: part("flow"),
            ..Input::of_column("t_in", Enters::Load, Gain::Identify)
        }
    }

    /// The heat that a flow takes, by hand.
    #[test]
    fn a_heat_flow_is_a_temperature_drop_times_a_flow() {
        assert_eq!(heat().values_of(column).unwrap(), [20.0, 45.0, 0.0]);
        assert_eq!(heat().name(), "(t_in - t_out) * flow");
        assert_eq!(heat().columns().collect::<Vec<_>>(), ["t_in", "t_out", "flow"]);
    }

    #[test]
    fn a_part_that_is_not_given_does_nothing() {
        let drop = Input { times: None, ..heat() };
        assert_eq!(drop.values_of(column).unwrap(), [10.0, 15.0, 20.0]);
        assert_eq!(drop.name(), "t_in - t_out");
        let plain = Input::of_column("flow", Enters::Load, Gain::Stated(2.0));
        assert_eq!(plain.values_of(column).unwrap(), [2.0, 3.0, 0.0]);
        assert_eq!(plain.name(), "flow");
    }

    #[test]
    fn a_column_that_is_not_there_is_named() {
        let missing = Input { times: Some("pressure".into()), ..heat() };
        let error = missing.values_of(column).unwrap_err().to_string();
        assert!(error.contains("pressure"), "{error}");
    }

    #[test]
    fn a_gain_that_is_to_be_found_can_not_be_run() {
        let error = heat().check().unwrap_err().to_string();
        assert!(error.contains("(t_in - t_out) * flow"), "{error}");
        assert!(Input { gain: Gain::Found(0.0), ..heat() }.check().is_ok());
    }
}
