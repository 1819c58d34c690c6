//! Columns that say by their name that the loop is closed or a value is good, and the words in them that say that it is not.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use super::decimal::parse_number;

/// Words of a mode that is not automatic, in the languages that names are understood in.
const MANUAL: &[&str] = &[
    "man",
    "manual",
    "m",
    "hand",
    "h",
    "manuell",
    "manuel",
    "manuale",
    "manuelle",
    "open",
    "open loop",
    "off",
    "o/s",
    "oos",
    "out of service",
    "iman",
    "lo",
    "init",
    "initman",
    "hold",
    "track",
    "tracking",
    "stop",
    "stopped",
    "disabled",
    "aus",
    "arret",
    "paro",
    "fermo",
    "desligado",
];
/// Words of a value that is not to be trusted.
const BAD: &[&str] = &[
    "bad",
    "uncertain",
    "questionable",
    "poor",
    "error",
    "err",
    "fault",
    "fail",
    "failed",
    "failure",
    "invalid",
    "i/o timeout",
    "comm fail",
    "no good",
    "ng",
    "faulted",
    "trip",
    "tripped",
    "not ok",
    "nok",
    "schlecht",
    "fehler",
    "ung\u{fc}ltig",
    "mauvais",
    "malo",
    "cattivo",
    "ruim",
];
/// What says no to "automatic?".
const NO: &[&str] = &[
    "0", "0.0", "false", "no", "n", "off", "nein", "non", "falsch", "man", "manual", "hand", "aus",
    "disabled", "inactive", "inaktiv", "gesperrt", "stop", "stopped",
];
/// What says yes to "manual?".
const YES: &[&str] = &[
    "1", "1.0", "true", "yes", "y", "on", "ja", "oui", "wahr", "si", "sim", "ein", "man", "manual", "hand",
    "enabled", "active", "aktiv",
];

/// Words of a mode in which the loop is closed.
const CLOSED: &[&str] = &[
    "auto",
    "automatic",
    "automatik",
    "automatique",
    "automatico",
    "aut",
    "a",
    "cas",
    "casc",
    "cascade",
    "kaskade",
    "rcas",
    "closed",
    "closed loop",
    "on",
    "run",
    "running",
    "ok",
    "good",
];
/// Words of a value that is good.
const GOOD: &[&str] = &["good", "ok", "valid", "gut", "bon", "bueno", "buono", "bom"];
/// Different words of a column that are counted.
const WORDS: usize = 16;
/// A longer word is no value to propose.
const WORD_BYTES_MAX: usize = 40;

/// From this code of OPC on a value is good; the codes end at 255.
const GOOD_LEAST: f64 = 192.0;

/// What a column of a status says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// How the loop is run, in words or codes.
    Mode,
    /// Whether a value is good, in words or codes.
    Quality,
    /// Yes or no.
    Answer,
}

/// Columns of one kind.
#[derive(Debug)]
struct Status {
    /// Their names, in lower case without anything between their letters.
    names: &'static [&'static str],
    kind: Kind,
    /// The words in them that say that the loop is not closed, or the value not good.
    words: &'static [&'static [&'static str]],
    /// Words that say that it is.
    closed: &'static [&'static str],
}

const STATUS: &[Status] = &[
    Status {
        names: &[
            "mode",
            "loopmode",
            "controlmode",
            "controllermode",
            "ctrlmode",
            "pidmode",
            "opmode",
            "automan",
            "automan",
            "am",
            "manauto",
            "manualauto",
            "automanual",
            "autohand",
            "handauto",
            "modeact",
            "actualmode",
            "betriebsart",
            "modus",
            "modo",
            "modalita",
            "modalit\u{e0}",
            "status",
            "loopstatus",
            "state",
            "loopstate",
            "zustand",
            "stato",
            "estado",
            "etat",
            "\u{e9}tat",
        ],
        kind: Kind::Mode,
        words: &[MANUAL, BAD],
        closed: CLOSED,
    },
    Status {
        names: &[
            "quality",
            "qual",
            "dataquality",
            "pvquality",
            "qualitaet",
            "qualit\u{e4}t",
            "qualite",
            "qualit\u{e9}",
            "calidad",
            "qualita",
            "qualit\u{e0}",
            "qualidade",
            "validity",
        ],
        kind: Kind::Quality,
        words: &[BAD],
        closed: GOOD,
    },
    Status {
        names: &[
            "auto",
            "automatic",
            "inauto",
            "isauto",
            "automatik",
            "automatique",
            "closedloop",
            "loopclosed",
            "enabled",
            "enable",
            "active",
            "aktiv",
            "controllerenabled",
            "controllerenable",
            "controlleractive",
            "controlenabled",
            "controlenable",
            "controlactive",
            "loopenabled",
            "loopenable",
            "loopactive",
            "pidenabled",
            "pidenable",
            "pidactive",
            "regleraktiv",
            "reglerein",
            "reglerfreigabe",
            "automatico",
        ],
        kind: Kind::Answer,
        words: &[NO],
        closed: YES,
    },
    Status {
        names: &[
            "manual",
            "man",
            "inmanual",
            "ismanual",
            "hand",
            "handbetrieb",
            "manuel",
            "manuell",
            "manuale",
        ],
        kind: Kind::Answer,
        words: &[YES],
        closed: NO,
    },
];

/// The status of one column, and what was seen of it.
#[derive(Debug, Clone)]
pub(super) struct Watched {
    status: &'static Status,
    seen: Arc<Seen>,
}

/// What was seen of a column, by all who read it.
#[derive(Debug, Default)]
struct Seen {
    /// A row that does not count.
    dropped: AtomicBool,
    words: [Word; WORDS],
}

/// A word and the rows in which it stands.
#[derive(Debug, Default)]
struct Word {
    text: OnceLock<Box<[u8]>>,
    rows: AtomicU64,
}

impl Seen {
    fn count(&self, cell: &[u8]) {
        if cell.len() > WORD_BYTES_MAX {
            return;
        }
        let is_it = |word: &&Word| **word.text.get_or_init(|| cell.into()) == *cell;
        if let Some(word) = self.words.iter().find(is_it) {
            word.rows.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The commonest of the words that fit, as the file writes it.
    fn commonest(&self, fits: impl Fn(&str) -> bool) -> Option<&str> {
        let words = self.words.iter().filter_map(|word| {
            let text = std::str::from_utf8(word.text.get()?).ok()?;
            Some((word.rows.load(Ordering::Relaxed), text))
        });
        let fitting = words.filter(|(_, text)| is_typed_easily(text) && fits(text));
        // Of words in equally many rows always the same, whoever counted them first.
        fitting.max_by_key(|(rows, text)| (*rows, std::cmp::Reverse(*text))).map(|(_, text)| text)
    }
}

/// Whether a shell takes a word as it stands, between quotes at most.
fn is_typed_easily(word: &str) -> bool {
    !word.is_empty() && word.chars().all(|c| c.is_alphanumeric() || " -_./:()".contains(c))
}

impl PartialEq for Watched {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.status, other.status)
    }
}

impl Watched {
    /// The status that a column of this name holds.
    pub fn of(plain_name: &str) -> Option<Self> {
        let status = STATUS.iter().find(|status| status.names.contains(&plain_name))?;
        Some(Self { status, seen: Arc::default() })
    }

    /// Whether a row counts in which the column holds this.
    pub fn holds(&self, cell: &[u8]) -> bool {
        self.seen.count(cell);
        let counts = !self.is_dropped(cell);
        if !counts {
            self.seen.dropped.store(true, Ordering::Relaxed);
        }
        counts
    }

    fn is_dropped(&self, cell: &[u8]) -> bool {
        self.status.words.iter().copied().flatten().any(|word| same_word(cell, word.as_bytes()))
    }

    /// The file's own value where the loop is closed: its commonest word that says so, else the commonest that drops no row, else the
    /// commonest.
    fn closed_value(&self) -> Option<&str> {
        let says_so =
            |text: &str| self.status.closed.iter().any(|word| same_word(text.as_bytes(), word.as_bytes()));
        let counts = |text: &str| !self.is_dropped(text.as_bytes());
        let seen = &self.seen;
        seen.commonest(says_so).or_else(|| seen.commonest(counts)).or_else(|| seen.commonest(|_| true))
    }

    /// Whether it holds a mode, which may be written as a number.
    pub fn is_mode(&self) -> bool {
        self.status.kind == Kind::Mode
    }

    /// Whether it holds a quality, which may be written as a code of OPC.
    pub fn is_quality(&self) -> bool {
        self.status.kind == Kind::Quality
    }

    /// Whether a quality is good by the code of OPC in a cell; `None` where there is none.
    pub fn is_good_code(&self, cell: &[u8]) -> Option<bool> {
        if !self.is_quality() {
            return None;
        }
        let code = parse_number(cell).filter(|code| (0.0..=255.0).contains(code) && code.fract() == 0.0)?;
        Some(code >= GOOD_LEAST)
    }

    /// What is told of a column of this name, where rows don't count by its words.
    pub fn note(&self, name: &str) -> Option<String> {
        if !self.seen.dropped.load(Ordering::Relaxed) {
            return None;
        }
        let example = self.closed_value().map(|value| typed(&format!("{name}={value}")));
        let example = example.map_or_else(String::new, |example| format!("--when {example} or "));
        Some(format!(
            "rows where '{name}' says that the loop is not closed or the value is bad don't count ({example}\
             --when always says otherwise)"
        ))
    }
}

/// A condition as a shell takes it.
fn typed(condition: &str) -> String {
    let is_plain = condition.chars().all(|c| c.is_alphanumeric() || "=-_./:".contains(c));
    if is_plain { condition.to_owned() } else { format!("\"{condition}\"") }
}

/// Whether two words are the same but for the case of their letters.
pub(super) fn same_word(one: &[u8], other: &[u8]) -> bool {
    let lower = |word| std::str::from_utf8(word).map(str::to_lowercase);
    one.eq_ignore_ascii_case(other)
        || (!one.is_ascii() && matches!((lower(one), lower(other)), (Ok(one), Ok(other)) if one == other))
}
