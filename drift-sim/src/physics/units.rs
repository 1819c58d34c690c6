//! Units: what the loop file states, and the rules by which a parameter's unit follows from them.

use crate::plant::{Output, Plant};

/// `[units]` of a loop file, or of a recording's columns: names only, for reports and for which plants may have them; nothing is converted.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Units {
    /// Of the reference; the same as that of y in most loops.
    pub r: Option<String>,
    /// Of the measured output.
    pub y: Option<String>,
    /// Of the controller's output.
    pub u: Option<String>,
    /// Of a servo's force or torque, or of a tank's flow.
    pub force: Option<String>,
}

/// The units that parameters are built from. Empty where the loop file states none.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct UnitNames {
    /// Of y, as the loop file states it.
    pub y: String,
    /// Of u, as the loop file states it.
    pub u: String,
    /// Of the drive: force (servo), y (first-order), u (state-space, transfer function), flow (tank).
    pub drive: String,
    /// Of x: a servo's position, otherwise y.
    pub position: String,
    /// Of dx/dt: a speed servo's y, else the position's per second.
    pub speed: String,
}

impl UnitNames {
    /// The units around a plant.
    pub fn new(units: &Units, plant: &Plant) -> Self {
        let name = |unit: &Option<String>| unit.clone().unwrap_or_default();
        let (y, u, force) = (name(&units.y), name(&units.u), name(&units.force));
        let drive = match plant {
            Plant::Servo(_) | Plant::Tank(_) => force,
            Plant::FirstOrder(_) => y.clone(),
            _ => u.clone(),
        };
        let position = match plant {
            Plant::Servo(servo) if servo.output == Output::Speed => integrated(&y),
            _ => y.clone(),
        };
        let speed = match plant {
            Plant::Servo(servo) if servo.output == Output::Speed => y.clone(),
            _ if y.is_empty() => String::new(),
            _ => format!("{y}/s"),
        };
        Self { y, u, drive, position, speed }
    }

    /// A parameter's unit from its rule, such as `{drive}/{speed}` or `1/s`. Where the loop file does not name a part of it, the number is in
    /// the recording's own units: nothing is left of the unit but `per s`.
    pub fn unit(&self, rule: &str) -> String {
        if self.parts().iter().any(|(part, name, _)| name.is_empty() && rule.contains(part)) {
            return if rule.ends_with("}/s") { "per s".into() } else { String::new() };
        }
        self.unit_in_words(rule)
    }

    /// The same where a part that the loop file does not name stays in words ("drive unit/speed unit").
    pub fn unit_in_words(&self, rule: &str) -> String {
        let fill = |text: String, (rule, name, words): (&str, &str, &str)| {
            let name = if name.is_empty() { words } else { name };
            let divides = text.contains(&format!("/{rule}"));
            let several = name.contains('/') || (name.contains(' ') && (divides || name != words));
            let composed = text.trim() != rule && several;
            text.replace(rule, &if composed { format!("({name})") } else { name.to_string() })
        };
        self.parts().into_iter().fold(rule.to_string(), fill)
    }

    /// What stands for a unit in a rule, that unit, and its words.
    fn parts(&self) -> [(&'static str, &str, &'static str); 5] {
        [
            ("{y}", &self.y, "y unit"),
            ("{u}", &self.u, "u unit"),
            ("{drive}", &self.drive, "drive unit"),
            ("{position}", &self.position, "position unit"),
            ("{speed}", &self.speed, "speed unit"),
        ]
    }
}

/// The unit of a speed's integral.
fn integrated(speed: &str) -> String {
    match speed.strip_suffix("/s") {
        Some(position) => position.to_string(),
        None if speed.is_empty() => String::new(),
        None => format!("{speed} s"),
    }
}

/// A value with four significant digits and its unit, for sentences.
pub fn shown(value: f64, unit: &str) -> String {
    with_unit(significant(value, 4), unit)
}

/// A number with its unit, if it has one.
pub fn with_unit(number: String, unit: &str) -> String {
    if unit.is_empty() || unit == "1" { number } else { format!("{number} {unit}") }
}

/// A value, with an exponent where it is very large or very small.
pub fn significant(value: f64, digits: usize) -> String {
    let (magnitude, decimals) = (value.abs(), digits.saturating_sub(1));
    if magnitude == 0.0 || !magnitude.is_finite() {
        format!("{value}")
    } else if !(1e-4..1e6).contains(&magnitude) {
        format!("{value:.decimals$e}")
    } else {
        let rounded = format!("{value:.decimals$e}").parse::<f64>().unwrap_or(value);
        format!("{rounded}")
    }
}

/// Significant digits of a value with which two digits of its half width show: from 4 to 12.
pub fn digits(value: f64, half_width: f64) -> usize {
    let more = libm::floor(libm::log10(value.abs())) - libm::floor(libm::log10(half_width.abs()));
    if more.is_finite() { (more + 2.0).clamp(4.0, 12.0) as usize } else { 4 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Servo;

    #[test]
    fn a_speed_servo_has_the_integrals_unit_for_its_position() {
        let units = Units { y: Some("rad/s".into()), force: Some("N m".into()), ..Units::default() };
        let servo = Servo { output: Output::Speed, inertia: 1.0, viscous: 0.0, actuator_gain: 1.0 };
        let names = UnitNames::new(&units, &Plant::Servo(servo));
        assert_eq!(names.unit("{position}"), "rad");
        assert_eq!(names.unit("{drive}/{speed}"), "(N m)/(rad/s)");
        assert_eq!(names.unit("{drive}/{position}"), "(N m)/rad");
        assert_eq!(names.unit("{drive}/{speed}^2"), "(N m)/(rad/s)^2");
        assert_eq!((names.unit("{u}/s").as_str(), names.unit("{drive}/{u}").as_str()), ("per s", ""));
        assert_eq!((names.unit("{u}").as_str(), names.unit("1/s").as_str()), ("", "1/s"));
        assert_eq!(names.unit_in_words("{u}/s"), "u unit/s");
        assert_eq!(names.unit_in_words("{drive}/{u}"), "(N m)/(u unit)");
    }

    #[test]
    fn numbers_have_four_digits() {
        assert_eq!(shown(20.3912, "N"), "20.39 N");
        assert_eq!(shown(-123_456.0, ""), "-123500");
        assert_eq!(shown(2.5e-9, "1"), "2.500e-9");
    }

    #[test]
    fn a_narrow_interval_shows_its_ends() {
        let digits = digits(1150.2381, 0.0172);
        assert_eq!(significant(1150.2381 - 0.0172, digits), "1150.221");
        assert_eq!(significant(1150.2381 + 0.0172, digits), "1150.255");
    }
}
