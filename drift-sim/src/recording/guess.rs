//! Which column is which signal, where nobody said so: by the names that loggers and control systems give them.
//!
//! A guess is only made where one column fits, and is told in a line. Tags count by their last part
//! (`TIC101.SP`), units at the end don't (`SP [degC]`, `time_s`).

/// The signals, in the order of every table here.
pub(super) const SIGNALS: [&str; 4] = ["t", "r", "y", "u"];

/// Usual names in English, German, French, Spanish, Italian and Portuguese, in lower case without accents and without
/// anything between their letters.
const NAMES: [&[&str]; 4] = [
    &[
        "t",
        "time",
        "times",
        "timestamp",
        "datetime",
        "timestamps",
        "seconds",
        "sec",
        "elapsed",
        "elapsedtime",
        "zeit",
        "zeitstempel",
        "uhrzeit",
        "zeitpunkt",
        "temps",
        "horodatage",
        "horodate",
        "heure",
        "tiempo",
        "hora",
        "fechahora",
        "fechayhora",
        "tempo",
        "ora",
        "orario",
        "dataora",
        "dataeora",
        "datahora",
        "datumuhrzeit",
        "datumzeit",
        "dateheure",
        "dateetheure",
        "datetemps",
        "instante",
    ],
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
        "command",
        "cmd",
        "setpointvalue",
        "wsp",
        "activesetpoint",
        "soll",
        "sollwert",
        "fuhrungsgrosse",
        "fuehrungsgroesse",
        "fuhrungsgroesse",
        "consigne",
        "valeurdeconsigne",
        "pointdeconsigne",
        "consigna",
        "referencia",
        "valorconsigna",
        "puntodeconsigna",
        "valordeseado",
        "riferimento",
        "valoredesiderato",
        "valoreimpostato",
        "setpointpid",
        "valordesejado",
        "valordereferencia",
        "pontodeajuste",
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
        "messwert",
        "regelgrosse",
        "regelgroesse",
        "mesure",
        "valeurmesuree",
        "grandeurreglee",
        "medida",
        "medicion",
        "valormedido",
        "variabledeproceso",
        "misura",
        "misurato",
        "valoremisurato",
        "variabilediprocesso",
        "medicao",
        "variaveldeprocesso",
        "valoratual",
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
        "stellgrosse",
        "stellgroesse",
        "reglerausgang",
        "commande",
        "sortieregulateur",
        "sortie",
        "grandeurreglante",
        "salida",
        "senaldecontrol",
        "salidadelcontrolador",
        "uscita",
        "uscitaregolatore",
        "variabilemanipolata",
        "saida",
        "saidadocontrolador",
        "sinaldecontrole",
        "pwm",
    ],
];

/// Names of a date, which stands alone or beside the time of the day. They mean a time where there is no other.
const DATES: &[&str] = &["date", "datum", "fecha", "data", "jour", "dia", "giorno", "tag", "day"];

/// Names that mean one of two signals: the one that is not there otherwise.
const EITHER: [(&[&str], [usize; 2]); 4] = [
    (&["output"], [2, 3]),
    (
        &["temp", "temperature", "temperatur", "speed", "position", "level", "pressure", "flow", "value"],
        [2, 3],
    ),
    (&["cmd", "command", "comando"], [1, 3]),
    (&["position"], [2, 1]),
];

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

/// Guesses the signals whose place isn't known yet, given as index by signal; and the column of the date where t is the
/// time of the day beside it.
pub(super) fn guess(names: &[String], known: [Option<usize>; 4]) -> ([Guess; 4], Option<usize>) {
    let readings: Vec<[String; 2]> = names.iter().map(|name| plain(name)).collect();
    let named = Named { names, readings: &readings, known };
    let mut found = known.map(|index| index.map_or(Guess::Nothing, Guess::Column));
    for (signal, usual) in NAMES.iter().enumerate() {
        // Of r and u a command is the one that is not there otherwise.
        let usual: Vec<&str> = usual.iter().copied().filter(|name| !EITHER[2].0.contains(name)).collect();
        if found[signal] == Guess::Nothing {
            found[signal] = named.best(&usual, &found);
        }
    }
    let mut date = None;
    if known[0].is_none()
        && let Guess::Column(index) = named.best(DATES, &found)
    {
        match found[0] {
            Guess::Nothing => found[0] = Guess::Column(index),
            _ => date = Some(index),
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
            found[signal] = named.best(words, &found);
        }
    }
    (found, date)
}

/// Whether a name is usual for one of the signals.
pub(super) fn is_usual(name: &str) -> bool {
    let of = |plain: &String| NAMES.iter().any(|usual| usual.contains(&plain.as_str()));
    plain(name).iter().any(of)
}

/// The columns and how their names read.
struct Named<'a> {
    names: &'a [String],
    readings: &'a [[String; 2]],
    known: [Option<usize>; 4],
}

impl Named<'_> {
    /// The one column of these names: whole names before tags, and of several tags the one of a loop that is known.
    fn best(&self, usual: &[&str], found: &[Guess; 4]) -> Guess {
        let free = |i: &usize| !found.contains(&Guess::Column(*i));
        for reading in 0..2 {
            let fits: Vec<usize> = (0..self.names.len())
                .filter(|i| {
                    self.readings.get(*i).is_some_and(|names| usual.contains(&names[reading].as_str()))
                })
                .filter(free)
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
fn tag(name: &str) -> Option<&str> {
    let at = name.rfind(['.', '/', ':', '_', '-', ' ', '\\'])?;
    name.get(..at).filter(|tag| !tag.is_empty())
}

/// The parts of a name in lower case, without brackets, accents and a unit at the end.
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
        .map(|part| without_accents(&part.to_lowercase()))
        .collect();
    if parts.len() > 1 && parts.last().is_some_and(|p| UNITS.contains(&p.as_str())) {
        parts.pop();
    }
    parts
}

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

/// A name without anything between its letters: the whole of it, and the last part of a tag.
pub(super) fn plain(name: &str) -> [String; 2] {
    let mut parts = parts(name);
    let whole = parts.concat();
    [whole, parts.pop().unwrap_or_default()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guessed(names: &[&str]) -> [Guess; 4] {
        guess(&names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>(), [None; 4]).0
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
    fn a_date_goes_with_the_time_of_the_day() {
        let names = ["Datum", "Uhrzeit", "Sollwert", "Istwert", "Stellwert"].map(String::from);
        let (found, date) = guess(&names, [None; 4]);
        assert_eq!((found[0], date), (Guess::Column(1), Some(0)));
    }

    #[test]
    fn of_several_loops_the_one_that_is_named_is_meant() {
        let names = ["t", "T1.SP", "T1.PV", "T1.OP", "T2.SP", "T2.PV", "T2.OP"].map(String::from);
        let found = guess(&names, [None, None, Some(5), None]).0;
        assert_eq!(found, [0, 4, 5, 6].map(Guess::Column));
    }

    #[test]
    fn what_is_known_is_not_guessed_again() {
        let names = ["a", "sp", "pv", "out"].map(String::from);
        let found = guess(&names, [None, None, Some(3), None]).0;
        assert_eq!(found[2], Guess::Column(3));
        assert_eq!(found[3], Guess::Nothing);
    }
}
