//! What the unit of y says of an unknown plant: metres are a position, revolutions a minute a speed, degrees Celsius neither; and per cent of a range are none of a motor where u
//! is, too: a drive whose range that is has a torque or a current for its u.

use crate::physics::Units;
use crate::plant::{Output, Plant};

const OF_POSITIONS: [&str; 9] = ["m", "mm", "um", "cm", "rad", "mrad", "rev", "in", "steps"];
const OF_SPEEDS: [&str; 11] =
    ["m/s", "mm/s", "km/h", "rad/s", "deg/s", "rpm", "1/min", "min-1", "rev/s", "r/min", "rev/min"];
/// Units of temperature, pressure, flow, level, humidity and concentration.
const OF_PROCESSES: [&str; 25] = [
    "degc", "\u{b0}c", "celsius", "k", "degf", "\u{b0}f", "bar", "mbar", "pa", "kpa", "mpa", "psi", "l/min",
    "l/h", "l/s", "m3/h", "m3/s", "kg/s", "kg/h", "t/h", "gpm", "%rh", "ph", "ppm", "l",
];

/// Units of what a controller puts out.
const OF_DRIVES: [&str; 12] = ["%", "v", "mv", "a", "ma", "w", "kw", "n", "nm", "n m", "hz", "deg"];

/// Units of positions that a level in a tank has, too, and of what fills one: a valve or a pump.
const OF_LEVELS: [&str; 4] = ["m", "mm", "cm", "in"];
const OF_FILLING: [&str; 3] = ["%", "ma", "hz"];

/// Whether what moves y may be a valve or a pump, by the unit of u.
fn may_fill(units: &Units) -> bool {
    let u = units.u.as_deref().map(|u| u.trim().to_lowercase());
    units.force.is_none()
        && u.is_some_and(|u| [&OF_FILLING[..], &OF_PROCESSES].iter().any(|list| list.contains(&u.as_str())))
}

/// Whether a word is a unit that is known here.
pub fn is_known(unit: &str) -> bool {
    let lower = unit.trim().to_lowercase();
    let lists: [&[&str]; 4] = [&OF_POSITIONS, &OF_SPEEDS, &OF_PROCESSES, &OF_DRIVES];
    lists.iter().any(|list| list.contains(&lower.as_str()))
}

/// Whether a plant's y may have the loop's unit; true where the unit says nothing, but of a tank, which few loops are.
pub fn suit(units: &Units, plant: &Plant) -> bool {
    let is_tank = matches!(plant, Plant::Tank(_));
    let Some(y) = units.y.as_deref().map(str::trim) else { return !is_tank };
    let output = match plant {
        Plant::Servo(servo) => Some(servo.output),
        _ => None,
    };
    let lower = y.to_lowercase();
    let is_of = |list: &[&str]| list.contains(&lower.as_str());
    if is_tank {
        return may_fill(units) && (is_of(&OF_LEVELS) || matches!(lower.as_str(), "%" | "l"));
    }
    if is_of(&OF_LEVELS) && may_fill(units) {
        output != Some(Output::Speed)
    } else if is_of(&OF_POSITIONS) {
        output == Some(Output::Position)
    } else if is_of(&OF_SPEEDS) {
        output == Some(Output::Speed)
    } else if is_of(&OF_PROCESSES) || (y == "%" && may_fill(units)) {
        output.is_none()
    } else {
        true
    }
}

/// The units beside an unknown plant: nothing tells the gain of a servo's actuator, or of what fills a tank, so that force and flow count as the drive that makes them.
pub fn beside(plant: &Plant, units: &Units) -> Units {
    match plant {
        Plant::Servo(_) | Plant::Tank(_) => Units { force: units.u.clone(), ..units.clone() },
        _ => units.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::{beside, suit};
    use crate::physics::Units;
    use crate::plant::{FirstOrder, Output, Plant, Servo};

    fn servo(output: Output) -> Plant {
        Plant::Servo(Servo { output, inertia: 1.0, viscous: 1.0, actuator_gain: 1.0 })
    }

    #[test]
    fn a_level_in_per_cent_is_no_position_and_no_speed() {
        let of = |u: &str, force: Option<&str>| Units {
            y: Some("%".into()),
            u: Some(u.into()),
            force: force.map(Into::into),
            ..Units::default()
        };
        let is_motor =
            |units: &Units| [Output::Position, Output::Speed].map(|output| suit(units, &servo(output)));
        assert_eq!(is_motor(&of("%", None)), [false, false]);
        assert_eq!(is_motor(&of("A", None)), [true, true]);
        assert_eq!(is_motor(&of("%", Some("N m"))), [true, true]);
    }

    #[test]
    fn a_temperature_is_no_position_and_a_unit_of_one_says_nothing() {
        let lag =
            Plant::FirstOrder(FirstOrder { gain: 1.0, time_constant_s: 1.0, delay_s: 0.0, offset: 0.0 });
        let of = |y: &str| Units { y: Some(y.into()), ..Units::default() };
        let suits = |y: &str| {
            [suit(&of(y), &servo(Output::Position)), suit(&of(y), &servo(Output::Speed)), suit(&of(y), &lag)]
        };
        assert_eq!(suits("mm"), [true, false, false]);
        assert_eq!(suits("rpm"), [false, true, false]);
        assert_eq!(suits("degC"), [false, false, true]);
        assert_eq!(suits("1"), [true; 3]);
        assert_eq!(suits("%"), [true; 3]);
        assert!(suit(&Units::default(), &lag));
        // A level is in metres, too.
        let filled = |u: &str| Units { u: Some(u.into()), ..of("m") };
        let suits = |u| [suit(&filled(u), &servo(Output::Position)), suit(&filled(u), &lag)];
        assert_eq!(suits("%"), [true, true]);
        assert_eq!(suits("l/min"), [true, true]);
        assert_eq!(suits("V"), [true, false]);
    }

    #[test]
    fn the_force_of_an_unknown_servo_counts_as_u() {
        let named = |of: &str| Some(of.to_owned());
        let units = Units { u: named("V"), force: named("N"), ..Units::default() };
        let servo = Servo { output: Output::Position, inertia: 1.0, viscous: 1.0, actuator_gain: 1.0 };
        assert_eq!(beside(&Plant::Servo(servo), &units).force, named("V"));
    }
}
