//! Which column is which signal, where nobody said so: by the names that loggers and control systems give them.
//!
//! A guess is only made where one column fits, and is told in a line. Tags count by their last part
//! (`TIC101.SP`), units at the end don't (`SP [degC]`, `time_s`).

/// The signals, in the order of every table here.
pub(super) const SIGNALS: [&str; 4] = ["t", "r", "y", "u"];

/// Usual names, in lower case without anything between their letters.
const NAMES: [&[&str]; 4] = [
    &["t", "time", "times", "timestamp", "datetime", "date", "seconds", "sec", "elapsed", "elapsedtime"],
    &[
        "r",
        "sp",
        "setpoint",
        "setpt",
        "ref",
        "reference",
        "setvalue",
        "target",
        "desired",
        "soll",
        "sollwert",
        "setpointvalue",
    ],
    &[
        "y",
        "pv",
        "processvariable",
        "processvalue",
        "measurement",
        "measured",
        "measuredvalue",
        "meas",
        "actual",
        "actualvalue",
        "feedback",
        "ist",
        "istwert",
    ],
    &[
        "u",
        "op",
        "co",
        "mv",
        "out",
        "controlleroutput",
        "controloutput",
        "manipulatedvariable",
        "control",
        "controlsignal",
        "controleffort",
        "effort",
        "actuation",
        "stellwert",
        "stellgroesse",
        "stellgr\u{f6}\u{df}e",
    ],
];

/// Names that mean one of two signals: the one that is not there otherwise.
const EITHER: [(&[&str], [usize; 2]); 2] = [(&["output"], [2, 3]), (&["cmd", "command"], [1, 3])];

/// Units that may end a name without changing what it is.
const UNITS: [&str; 27] = [
    "s", "sec", "seconds", "ms", "us", "ns", "percent", "pct", "degc", "degf", "c", "k", "v", "a", "rpm",
    "bar", "m", "mm", "rad", "deg", "hz", "rads", "ms1", "n", "nm", "kpa", "w",
];

/// What the names say of one signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Guess {
    Nothing,
    Column(usize),
    /// Two columns fit equally well.
    Either(usize, usize),
}

/// Guesses the signals whose place isn't known yet, given as index by signal.
pub(super) fn guess(names: &[String], known: [Option<usize>; 4]) -> [Guess; 4] {
    let mut found = known.map(|index| index.map_or(Guess::Nothing, Guess::Column));
    for (signal, usual) in NAMES.iter().enumerate() {
        if found[signal] == Guess::Nothing {
            found[signal] = best(names, usual, &found);
        }
    }
    // Each round settles one signal or is the last.
    for _ in 0..SIGNALS.len() {
        for (words, [one, other]) in EITHER {
            let signal = match (found[one], found[other]) {
                (Guess::Nothing, Guess::Column(_)) => one,
                (Guess::Column(_), Guess::Nothing) => other,
                _ => continue,
            };
            found[signal] = best(names, words, &found);
        }
    }
    found
}

/// The one column of these names: whole names before tags.
fn best(names: &[String], usual: &[&str], found: &[Guess; 4]) -> Guess {
    let free = |i: &usize| !found.contains(&Guess::Column(*i));
    for reading in [whole, last_part] {
        let mut fits = (0..names.len())
            .filter(free)
            .filter(|i| names.get(*i).is_some_and(|n| usual.contains(&reading(n).as_str())));
        match (fits.next(), fits.next()) {
            (Some(one), None) => return Guess::Column(one),
            (Some(one), Some(other)) => return Guess::Either(one, other),
            _ => {}
        }
    }
    Guess::Nothing
}

/// The parts of a name in lower case, without brackets and a unit at the end.
fn parts(name: &str) -> Vec<String> {
    let mut depth = 0;
    let outside: String = name
        .chars()
        .filter(|c| {
            depth += i32::from("([<".contains(*c));
            let is_outside = depth <= 0;
            depth -= i32::from(")]>".contains(*c));
            is_outside
        })
        .collect();
    let mut parts: Vec<String> = outside
        .split(|c: char| !c.is_alphanumeric())
        .filter(|p| !p.is_empty())
        .map(str::to_lowercase)
        .collect();
    if parts.len() > 1 && parts.last().is_some_and(|p| UNITS.contains(&p.as_str())) {
        parts.pop();
    }
    parts
}

fn whole(name: &str) -> String {
    parts(name).concat()
}

fn last_part(name: &str) -> String {
    parts(name).pop().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guessed(names: &[&str]) -> [Guess; 4] {
        guess(&names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>(), [None; 4])
    }

    #[test]
    fn usual_names_are_understood() {
        for names in [
            ["t", "r", "y", "u"],
            ["Time", "SP", "PV", "OP"],
            ["time_s", "Setpoint", "Measurement", "Output"],
            ["Timestamp", "set point", "process_variable", "Controller Output"],
            ["TIME (s)", "SP [degC]", "PV [degC]", "CO [%]"],
            ["DateTime", "TIC101.SP", "TIC101.PV", "TIC101.OP"],
            ["date", "Sollwert", "Istwert", "Stellgr\u{f6}\u{df}e"],
            ["seconds", "ref", "output", "cmd"],
            ["timestamp", "cmd", "pv", "MV"],
            ["t", "reference", "measured", "control_effort"],
        ] {
            assert_eq!(guessed(&names), [0, 1, 2, 3].map(Guess::Column), "{names:?}");
        }
    }

    #[test]
    fn what_could_be_two_things_is_left_open() {
        use Guess::{Column, Either, Nothing};
        assert_eq!(guessed(&["t", "SP", "ref", "PV", "OP"]), [Column(0), Either(1, 2), Column(3), Column(4)]);
        assert_eq!(guessed(&["t", "ref", "input", "output"]), [Column(0), Column(1), Nothing, Nothing]);
        assert_eq!(guessed(&["t", "T1.SP", "T2.SP", "PV", "OP"])[1], Either(1, 2));
        assert_eq!(guessed(&["a", "b"]), [Nothing; 4]);
        // The plain name is meant where there are tags of other things too.
        assert_eq!(guessed(&["t", "SP", "filtered.SP", "PV", "OP"])[1], Column(1));
    }

    #[test]
    fn what_is_known_is_not_guessed_again() {
        let names = ["a", "sp", "pv", "out"].map(String::from);
        let found = guess(&names, [None, None, Some(3), None]);
        assert_eq!(found[2], Guess::Column(3));
        assert_eq!(found[3], Guess::Nothing);
    }
}
