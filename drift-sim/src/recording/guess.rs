//! Which column is which signal, where nobody said so: by the names that loggers and control systems give them.
//!
//! A guess is only made where one column fits, and is told in a line. Tags count by their last part or their last two
//! (`TIC101.SP`, `loop_set_point`), units at the end don't (`SP [degC]`, `time_s`), nor does a last part that several signals
//! have (`SP.CV`, `PV.CV`) or that is the port of a block (`Reference/Out1`). A column of words is no signal where a column of numbers fits.

use std::collections::{HashMap, HashSet};

use super::cell_kind::CellKind;
use super::usual_names::{
    ACTUATORS, CONTROLLERS, DATES, EITHER, INPUT, ISTWERT, NAMES, OUTPUT, QUANTITIES, SETPOINTS, SOLLWERT,
    STELLGROESSE, UNITS,
};

/// The signals, in the order of every table here.
pub(super) const SIGNALS: [&str; 4] = ["t", "r", "y", "u"];

/// What the names say of one signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Guess {
    Nothing,
    Column(usize),
    /// Two columns fit equally well.
    Either(usize, usize),
}

/// Guesses the signals whose place isn't known yet, given as index by signal; and the column of the date where t is the
/// time of the day beside it. What the columns hold counts where it is known.
pub(super) fn guess(
    names: &[String],
    kinds: &[CellKind],
    known: [Option<usize>; 4],
) -> ([Guess; 4], Option<usize>) {
    let readings = readings(names);
    let named = Named { names, readings: &readings, kinds, known };
    let mut found = known.map(|index| index.map_or(Guess::Nothing, Guess::Column));
    named.guess_german_abbreviations(&mut found);
    for (signal, usual) in NAMES.iter().enumerate() {
        // Of r and u a command is the one that is not there otherwise.
        let usual: Vec<&str> = usual.iter().copied().filter(|name| !EITHER[2].0.contains(name)).collect();
        if found[signal] == Guess::Nothing {
            found[signal] = named.best(signal, &usual, &found);
        }
    }
    let mut date = None;
    if known[0].is_none()
        && let Guess::Column(index) = named.best(0, DATES, &found)
        && kinds.get(index) != Some(&CellKind::Text)
    {
        match found[0] {
            Guess::Nothing => found[0] = Guess::Column(index),
            _ => date = Some(index),
        }
    }
    if found[0] == Guess::Nothing {
        found[0] = named.only_dates(&found);
    }
    named.guess_by_the_setpoint(&mut found);
    named.guess_by_the_others(&mut found);
    named.guess_by_quantities(&mut found);
    (found, date)
}

/// Whether a name is usual for one of the signals.
pub(super) fn is_usual(name: &str) -> bool {
    let of = |plain: &String| NAMES.iter().any(|usual| usual.contains(&plain.as_str()));
    plain(name).iter().any(of)
}

/// How many signals are named among the cells of a line.
pub(super) fn signals_named(cells: &[&str]) -> usize {
    let names: Vec<String> = cells.iter().map(|cell| (*cell).to_owned()).collect();
    guess(&names, &[], [None; 4]).0.into_iter().filter(|found| *found != Guess::Nothing).count()
}

/// The columns and how their names read.
struct Named<'a> {
    names: &'a [String],
    readings: &'a [[String; 3]],
    kinds: &'a [CellKind],
    known: [Option<usize>; 4],
}

impl Named<'_> {
    /// SW, IW and, only beside both, Y.
    fn guess_german_abbreviations(&self, found: &mut [Guess; 4]) {
        let sides = [self.best(1, SOLLWERT, found), self.best(2, ISTWERT, found)];
        if !sides.iter().all(|side| matches!(side, Guess::Column(_))) {
            return;
        }
        let u = self.best(3, STELLGROESSE, found);
        for (signal, side) in [1, 2, 3].into_iter().zip(sides.into_iter().chain([u])) {
            if found[signal] == Guess::Nothing {
                found[signal] = side;
            }
        }
    }

    /// Beside a set-point stand the controller's input, which is y, and its output, which is u: so the PID libraries of
    /// small boards call them. Beside a `ref` they may be the plant's own, the other way round.
    fn guess_by_the_setpoint(&self, found: &mut [Guess; 4]) {
        let Guess::Column(r) = found[1] else { return };
        let reads = |words: &[&str]| {
            self.readings.get(r).is_some_and(|r| r.iter().any(|name| words.contains(&name.as_str())))
        };
        let sides = [self.best(2, INPUT, found), self.best(3, OUTPUT, found)];
        if reads(SETPOINTS) && sides.iter().all(|side| matches!(side, Guess::Column(_))) {
            for (signal, side) in [2, 3].into_iter().zip(sides) {
                if found[signal] == Guess::Nothing {
                    found[signal] = side;
                }
            }
        }
    }

    /// Names that mean one of two signals mean the one that is not there otherwise.
    fn guess_by_the_others(&self, found: &mut [Guess; 4]) {
        // Each round settles one signal or is the last.
        for _ in 0..SIGNALS.len() {
            for (words, [one, other]) in EITHER {
                let signal = match (found[one], found[other]) {
                    (Guess::Nothing, Guess::Column(_)) => one,
                    (Guess::Column(_), Guess::Nothing) => other,
                    _ => continue,
                };
                found[signal] = self.best(signal, words, found);
            }
        }
    }

    /// Where neither y nor u has a name of its own: a quantity is what an actuator or an output moves. An actuator is u
    /// where y is known, too.
    fn guess_by_quantities(&self, found: &mut [Guess; 4]) {
        if found[3] != Guess::Nothing {
            return;
        }
        let y = match found[2] {
            Guess::Nothing => self.best(2, QUANTITIES, found),
            known => known,
        };
        let Guess::Column(_) = y else { return };
        let with_y = [found[0], found[1], y, found[3]];
        let known = [ACTUATORS, OUTPUT, CONTROLLERS].map(|words| self.best(3, words, &with_y));
        let u = known.into_iter().find(|guess| *guess != Guess::Nothing).unwrap_or(Guess::Nothing);
        if let Guess::Column(_) = u {
            (found[2], found[3]) = (y, u);
        }
    }

    /// The one column of dates, whatever its name.
    fn only_dates(&self, found: &[Guess; 4]) -> Guess {
        let is_date = |index: &usize| {
            self.kinds.get(*index) == Some(&CellKind::Date) && !found.contains(&Guess::Column(*index))
        };
        let mut dates = (0..self.names.len()).filter(is_date);
        match (dates.next(), dates.next()) {
            (Some(one), None) => Guess::Column(one),
            _ => Guess::Nothing,
        }
    }

    /// The one column of these names: whole names before tags, and of several tags the one of a loop that is known.
    fn best(&self, signal: usize, usual: &[&str], found: &[Guess; 4]) -> Guess {
        let kind = |index: usize| self.kinds.get(index).copied().unwrap_or_default();
        // Dates are a better time than numbers. A column of words is only named where nothing else could be meant: its error
        // says what it holds.
        let is_better = |index: usize| {
            if signal == 0 { kind(index) == CellKind::Date } else { kind(index) != CellKind::Text }
        };
        let better = self.best_of(usual, &|i| !found.contains(&Guess::Column(i)) && is_better(i));
        match better {
            Guess::Nothing => self.best_of(usual, &|i| !found.contains(&Guess::Column(i))),
            found => found,
        }
    }

    fn best_of(&self, usual: &[&str], is_free: &dyn Fn(usize) -> bool) -> Guess {
        for reading in 0..3 {
            let fits: Vec<usize> = (0..self.names.len())
                .filter(|i| {
                    self.readings.get(*i).is_some_and(|names| usual.contains(&names[reading].as_str()))
                })
                .filter(|i| is_free(*i))
                .collect();
            match fits.as_slice() {
                [] => {}
                [one] => return Guess::Column(*one),
                [one, other, ..] => {
                    let mut of_loop = fits.iter().filter(|i| self.is_of_known_loop(**i));
                    return match (of_loop.next(), of_loop.next()) {
                        (Some(one), None) => Guess::Column(*one),
                        _ => Guess::Either(*one, *other),
                    };
                }
            }
        }
        Guess::Nothing
    }

    /// Whether a tag begins like that of r, y or u, where one of them is named.
    fn is_of_known_loop(&self, index: usize) -> bool {
        let begin = |index: usize| self.names.get(index).and_then(|name| tag(name));
        let known = self.known.iter().skip(1).copied().flatten();
        begin(index).is_some_and(|own| known.filter_map(begin).any(|other| other == own))
    }
}

/// What stands before the last part of a tag.
pub(super) fn tag(name: &str) -> Option<&str> {
    let at = name.rfind(['.', '/', ':', '_', '-', ' ', '\\'])?;
    name.get(..at).filter(|tag| !tag.is_empty())
}

/// Whether the letter y is u's among these names, as it is beside SW and IW.
pub(super) fn is_y_the_output(names: &[String]) -> bool {
    let [sw, iw] = [SOLLWERT, ISTWERT].map(|words| {
        names.iter().any(|name| plain(name).iter().any(|reading| words.contains(&reading.as_str())))
    });
    sw && iw
}

/// The parts of a name in lower case, without brackets, accents and a unit at the end.
fn parts(name: &str) -> Vec<String> {
    let mut depth = 0;
    let outside: String = name
        .chars()
        .filter(|c| !COMBINING_ACCENTS.contains(c))
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
        .map(|part| without_accents(&part.to_lowercase()))
        .collect();
    if parts.len() > 1 && parts.last().is_some_and(|p| UNITS.contains(&p.as_str())) {
        parts.pop();
    }
    parts
}

/// Accents that are signs of their own behind their letter, as macOS and some exports write them.
const COMBINING_ACCENTS: std::ops::RangeInclusive<char> = '\u{300}'..='\u{36f}';

fn without_accents(text: &str) -> String {
    text.chars()
        .flat_map(|c| {
            let plain = match c {
                '\u{e0}'..='\u{e5}' => "a",
                '\u{e7}' => "c",
                '\u{e8}'..='\u{eb}' => "e",
                '\u{ec}'..='\u{ef}' => "i",
                '\u{f1}' => "n",
                '\u{f2}'..='\u{f6}' => "o",
                '\u{f9}'..='\u{fc}' => "u",
                '\u{df}' => "ss",
                _ => return vec![c],
            };
            plain.chars().collect()
        })
        .collect()
}

/// A name without anything between its letters: the whole of it, and the last two parts and the last part of a tag.
pub(super) fn plain(name: &str) -> [String; 3] {
    read(&parts(name))
}

/// How the name of a status may read. The m of `A/M` is no metre; what is enabled or active is the loop only where the whole name says
/// nothing else.
pub(super) fn status_readings(name: &str) -> Vec<String> {
    let [whole, last_two, last] = plain(name);
    let is_alone = !ENABLED.contains(&last.as_str()) || whole == last;
    let auto_man = is_auto_man(name).then(|| "am".to_owned());
    auto_man.into_iter().chain([whole, last_two]).chain(is_alone.then_some(last)).collect()
}

/// Words that say yes of whatever stands before them.
const ENABLED: &[&str] = &["enabled", "enable", "active", "aktiv"];

/// Whether a tag ends in `A/M`. `A/m` is a unit.
fn is_auto_man(name: &str) -> bool {
    ["A/M", "a/m", "M/A", "A_M"].iter().any(|end| {
        name.trim_end()
            .strip_suffix(end)
            .is_some_and(|before| !before.chars().next_back().is_some_and(char::is_alphanumeric))
    })
}

fn read(parts: &[String]) -> [String; 3] {
    let last = |count: usize| parts.get(parts.len().saturating_sub(count)..).unwrap_or_default().concat();
    [parts.concat(), last(2), last(1)]
}

/// How all names read. A last part that several names of signals stand before, as in `SP.CV` and `PV.CV`, tells nothing, nor
/// does the port of a block.
fn readings(names: &[String]) -> Vec<[String; 3]> {
    let mut all: Vec<Vec<String>> = names.iter().map(|name| parts(name)).collect();
    let mut signals_before: HashMap<String, HashSet<String>> = HashMap::new();
    for parts in &all {
        if let [.., before, last] = parts.as_slice()
            && NAMES.iter().chain([&EITHER[2].0]).any(|usual| usual.contains(&before.as_str()))
        {
            signals_before.entry(last.clone()).or_default().insert(before.clone());
        }
    }
    for parts in &mut all {
        let is_shared = |last: &String| signals_before.get(last).is_some_and(|before| before.len() > 1);
        if parts.len() > 1 && parts.last().is_some_and(|last| is_shared(last) || is_port(last)) {
            parts.pop();
        }
    }
    all.iter().map(|parts| read(parts)).collect()
}

/// `out1`, `in2`: what Simulink calls the ports of a block that nobody named.
fn is_port(part: &str) -> bool {
    let number = part.strip_prefix("out").or_else(|| part.strip_prefix("in"));
    number.is_some_and(|number| !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guessed(names: &[&str]) -> [Guess; 4] {
        guess(&names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>(), &[], [None; 4]).0
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
            ["Zeit", "F\u{fc}hrungsgr\u{f6}\u{df}e", "Regelgr\u{f6}\u{df}e [\u{b0}C]", "Stellgroesse"],
            ["Uhrzeit", "Soll", "Ist", "Stellwert"],
            ["Temps", "Consigne", "Mesure", "Commande"],
            ["Horodatage", "Consigne (\u{b0}C)", "Valeur mesur\u{e9}e", "Sortie"],
            ["Tiempo", "Consigna", "Medici\u{f3}n", "Salida"],
            ["Fecha", "Referencia", "Valor medido", "Salida"],
            ["Tempo", "Riferimento", "Misura", "Uscita"],
            ["Data/Ora", "Setpoint", "Valore misurato", "Uscita"],
            ["Data", "Refer\u{ea}ncia", "Medi\u{e7}\u{e3}o", "Sa\u{ed}da"],
            ["time", "extruder.target", "extruder.temp", "extruder.pwm"],
            ["Date/Time", "TIC101.SV", "TIC101.PV", "TIC101.MV"],
            ["DateAndTime", "[PLC]TIC101.SP", "[PLC]TIC101.PV", "[PLC]TIC101.CV"],
            ["Date Time", "TIC-101/PID1/SP.CV", "TIC-101/PID1/PV.CV", "TIC-101/PID1/OUT.CV"],
            ["Zeitstempel", "TIC101/PID.SP_EXT", "TIC101/PID.PV_IN", "TIC101/PID.LMN"],
            ["__time", "/loop/ref/data", "/loop/state/data", "/loop/cmd/data"],
            ["ms", "oven.set_point", "oven.process_value", "oven.control_output"],
            ["time", "oven_setpoint", "oven_temperature", "heater_output"],
            ["TimeUS", "target", "Temperature", "Valve"],
            ["millis", "Setpoint", "Input", "Output"],
            ["Zeit", "SW", "IW", "Y"],
            ["Uhrzeit", "TIC1.SW", "TIC1.IW", "TIC1.Y"],
            ["temps", "consigne", "temp\u{e9}rature", "puissance"],
            // The accents are signs of their own.
            ["temps", "consigne", "tempe\u{301}rature", "puissance"],
            ["Data/Hora", "Ponto de ajuste", "Varia\u{301}vel de processo", "Varia\u{301}vel manipulada"],
            ["Data/Hora", "Ponto de ajuste", "Vari\u{e1}vel de processo", "Vari\u{e1}vel manipulada"],
            ["Tiempo", "Consigna", "Temperatura", "V\u{e1}lvula"],
            ["t", "set_point", "pid.input", "pid.output"],
            ["time", "Reference/Out1", "Angle/Out1", "Voltage/Out1"],
            ["time", "Loop/Reference/Out1", "Loop/Plant/Out1", "Loop/Controller/Out1"],
            ["exp.X.time", "exp.Y.Reference/Out1", "exp.Y.Plant/Out1", "exp.Y.PID Controller/Out1"],
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
        assert_eq!(guessed(&["t", "SP", "in.input", "in2.input", "output"])[3], Nothing);
        assert_eq!(guessed(&["a", "b"]), [Nothing; 4]);
        // Y is u only beside both SW and IW.
        assert_eq!(guessed(&["t", "SW", "Y", "op"]), [Column(0), Nothing, Column(2), Column(3)]);
        // The plain name is meant where there are tags of other things too.
        assert_eq!(guessed(&["t", "SP", "filtered.SP", "PV", "OP"])[1], Column(1));
    }

    #[test]
    fn a_date_goes_with_the_time_of_the_day() {
        let names = ["Datum", "Uhrzeit", "Sollwert", "Istwert", "Stellwert"].map(String::from);
        let (found, date) = guess(&names, &[], [None; 4]);
        assert_eq!((found[0], date), (Guess::Column(1), Some(0)));
    }

    #[test]
    fn of_several_loops_the_one_that_is_named_is_meant() {
        let names = ["t", "T1.SP", "T1.PV", "T1.OP", "T2.SP", "T2.PV", "T2.OP"].map(String::from);
        let found = guess(&names, &[], [None, None, Some(5), None]).0;
        assert_eq!(found, [0, 4, 5, 6].map(Guess::Column));
    }

    #[test]
    fn what_is_known_is_not_guessed_again() {
        let names = ["a", "sp", "pv", "out"].map(String::from);
        let found = guess(&names, &[], [None, None, Some(3), None]).0;
        assert_eq!(found[2], Guess::Column(3));
        assert_eq!(found[3], Guess::Nothing);
    }
}
