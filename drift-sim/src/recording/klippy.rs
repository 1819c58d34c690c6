//! `klippy.log`, which the firmware Klipper of 3D printers writes: once a second a line `Stats` with target, temperature and
//! duty of every heater, and the printer's configuration with the control law of each of them.
//!
//! The printer's clock begins anew at each of its starts, and the log goes on: each is a part ([`parts`](super::parts)).
//!
//! A heater is a loop: `extruder.target`, `extruder.temp`, `extruder.pwm`. Where no column is named, the loop is the one heater
//! of which most lines have a target; the law that the configuration states is told.

use std::collections::{BTreeMap, HashMap};
use std::io::{BufRead, BufReader, Cursor, Read};

use super::cell_kind::FirstRows;
use super::decimal::DecimalMark;
use super::records::{Record, Records};
use super::text_rows::{Header, TextRows};
use super::{ColumnMap, Quality, ReadOptions};
use crate::controller::{Controller, Limits, Pid};
use crate::{Error, Result};

const STATS: &[u8] = b"Stats ";
/// A line longer than this is no line of a log.
const LINE_BYTES_MAX: u64 = 1 << 20;
/// What of a log is looked at to see its heaters and its configuration.
const HEAD_BYTES: usize = 1 << 22;
/// What a start of a file is looked at for.
const SIGNS: [&[u8]; 3] = [b"\nStats ", b"Start printer at ", b"Starting Klippy..."];
/// Klipper's PID gains are for a duty of 0 to 255 (klippy/extras/heaters.py, PID_PARAM_BASE).
const PID_PARAM_BASE: f64 = 255.0;

/// Whether a text begins like one.
pub(super) fn is_klippy_log(start: &[u8]) -> bool {
    let has = |sign: &[u8]| start.windows(sign.len()).any(|part| part == sign);
    start.starts_with(STATS) || SIGNS.into_iter().any(has)
}

/// The rows of a log that begins like one.
///
/// # Errors
/// It has no lines of statistics, or no such heater.
pub(super) fn open(source: Box<dyn Read + Send>, options: &ReadOptions) -> Result<TextRows<KlippyRecords>> {
    let mut source = BufReader::new(source);
    let mut head = Vec::new();
    let refused = |e: std::io::Error| Error::new(format!("can't be read: {e}"));
    source.by_ref().take(HEAD_BYTES as u64).read_to_end(&mut head).map_err(refused)?;
    let log = Log::of(&head);
    let heaters: Vec<&String> = log.heaters.keys().collect();
    let Some(usual) = log
        .heaters
        .iter()
        .max_by_key(|(name, heated)| (**heated, name.as_str() == "extruder"))
        .map(|(name, _)| name.clone())
    else {
        return Err(Error::new("the log has no lines 'Stats' with a heater")
            .allowed("a klippy.log of a printer at work"));
    };
    let mut options = options.clone();
    let (heater, is_chosen) = match options.columns.named_loop() {
        Some(heater) if log.heaters.contains_key(&heater) => (heater, true),
        _ => (usual, false),
    };
    if !options.columns.is_anything_named() {
        let of = |what: &str| format!("{heater}.{what}");
        options.columns = ColumnMap { r: of("target"), y: of("temp"), u: of("pwm"), ..options.columns };
    }
    let mut notes = Vec::new();
    if heaters.len() > 1 && !is_chosen {
        let names: Vec<&str> = heaters.iter().map(|name| name.as_str()).collect();
        let other = names.iter().find(|name| **name != heater).unwrap_or(&"");
        notes.push(format!(
            "the heaters are {}; this is {heater} (--columns r={other}.target,y={other}.temp,u={other}.pwm is another)",
            names.join(", ")
        ));
    }
    let law = log.law(&heater);
    notes.extend(log.says_of_the_law(&heater, law));
    let mut names = vec!["time".to_owned()];
    let mut units = vec![String::new()];
    for heater in heaters {
        names.extend(["target", "temp", "pwm"].map(|what| format!("{heater}.{what}")));
        units.extend(["degC", "degC", "1"].map(str::to_owned));
    }
    let places = names.iter().enumerate().map(|(place, name)| (name.clone(), place)).collect();
    let source = Box::new(BufReader::new(Cursor::new(head).chain(source)));
    let records = KlippyRecords {
        source,
        places,
        cells: vec![Vec::new(); names.len()],
        line: 0,
        notes,
        law: law.map(Controller::Pid),
    };
    let header = Header { names, units, first_rows: FirstRows::default(), mark: DecimalMark::Point };
    TextRows::new(records, header, &options)
}

/// What the beginning of a log says.
struct Log {
    /// Every heater, and how many lines have a target for it.
    heaters: BTreeMap<String, usize>,
    /// The configuration: section, key, value.
    configuration: HashMap<(String, String), String>,
}

impl Log {
    fn of(head: &[u8]) -> Self {
        let mut log = Self { heaters: BTreeMap::new(), configuration: HashMap::new() };
        let mut section = String::new();
        for line in head.split(|b| *b == b'\n') {
            if line.starts_with(STATS) {
                for (heater, key, value) in values(line) {
                    if key == "target" {
                        let heated = value.parse::<f64>().is_ok_and(|target| target > 0.0);
                        *log.heaters.entry(heater.to_owned()).or_default() += usize::from(heated);
                    }
                }
                continue;
            }
            let text = String::from_utf8_lossy(line);
            let text = text.trim_end();
            if let Some(name) = text.strip_prefix('[').and_then(|text| text.strip_suffix(']')) {
                section = name.to_owned();
            } else if let Some((key, value)) = text.split_once([':', '=']).filter(|_| !section.is_empty()) {
                log.configuration.insert((section.clone(), key.trim().to_owned()), value.trim().to_owned());
            } else if text.starts_with('=') {
                section.clear();
            }
        }
        log
    }

    fn get(&self, heater: &str, key: &str) -> Option<&str> {
        self.configuration.get(&(heater.to_owned(), key.to_owned())).map(String::as_str)
    }

    /// The control law of a heater as the configuration states it, with the gains for a duty of 0 to 1.
    fn law(&self, heater: &str) -> Option<Pid> {
        if self.get(heater, "control") != Some("pid") {
            return None;
        }
        let number = |key: &str| self.get(heater, key)?.parse::<f64>().ok().filter(|x| x.is_finite());
        let gain = |key: &str| number(key).map(|gain| gain / PID_PARAM_BASE);
        let u_max = number("max_power").filter(|most| *most > 0.0).unwrap_or(1.0);
        Some(Pid {
            kp: gain("pid_kp")?,
            ki: gain("pid_ki")?,
            kd: gain("pid_kd")?,
            // Klipper averages its derivative over smooth_time, 1 s unless stated (klippy/extras/heaters.py).
            derivative_filter_s: number("smooth_time").unwrap_or(1.0),
            limits: Limits { u_min: 0.0, u_max },
            anti_windup: true,
        })
    }

    /// The same in words.
    fn says_of_the_law(&self, heater: &str, law: Option<Pid>) -> Option<String> {
        let Some(Pid { kp, ki, kd, limits, .. }) = law else {
            let control = self.get(heater, "control")?;
            return Some(format!("the configuration states control = {control} for {heater}"));
        };
        let most = limits.u_max;
        Some(format!(
            "the configuration states the law of {heater}: pid, kp = {kp:.4}, ki = {ki:.5}, kd = {kd:.4}, u_min = 0, u_max = {most}"
        ))
    }
}

/// The values of a line of statistics, with the heater that they stand behind: `extruder: target=200 temp=199.8 pwm=0.4`.
fn values(line: &[u8]) -> Vec<(&str, &str, &str)> {
    let Ok(text) = std::str::from_utf8(line) else { return Vec::new() };
    let mut owner = "";
    let mut found = Vec::new();
    for word in text.split_ascii_whitespace().skip(2) {
        if let Some(name) = word.strip_suffix(':') {
            owner = name;
        } else if let Some((key, value)) = word.split_once('=')
            && ["target", "temp", "pwm"].contains(&key)
        {
            found.push((owner, key, value));
        }
    }
    found
}

/// The lines of statistics, one after the other.
pub(super) struct KlippyRecords {
    source: Box<dyn BufRead + Send>,
    places: HashMap<String, usize>,
    cells: Vec<Vec<u8>>,
    line: u64,
    notes: Vec<String>,
    law: Option<Controller>,
}

impl Records for KlippyRecords {
    fn next(&mut self, record: &mut Record, quality: &mut Quality) -> Result<Option<u64>> {
        let mut line = Vec::new();
        loop {
            line.clear();
            let read = self.source.by_ref().take(LINE_BYTES_MAX + 1).read_until(b'\n', &mut line);
            read.map_err(|e| Error::new(format!("can't be read: {e}")).at_line(self.line + 1))?;
            if line.is_empty() {
                return Ok(None);
            }
            self.line += 1;
            if line.len() as u64 > LINE_BYTES_MAX {
                return Err(Error::new("a line of more than 1 MiB").at_line(self.line));
            }
            let Some(time) = line.strip_prefix(STATS).and_then(|rest| rest.split(|b| *b == b':').next())
            else {
                continue;
            };
            let time_s = std::str::from_utf8(time).ok().and_then(|time| time.trim().parse::<f64>().ok());
            if !time_s.is_some_and(f64::is_finite) {
                continue;
            }
            let found = values(&line);
            if found.is_empty() {
                quality.blank_lines += 1;
                continue;
            }
            self.cells.iter_mut().for_each(Vec::clear);
            for (name, value) in std::iter::once(("time".to_owned(), time)).chain(
                found.into_iter().map(|(heater, key, value)| (format!("{heater}.{key}"), value.as_bytes())),
            ) {
                if let Some(cell) = self.places.get(&name).and_then(|place| self.cells.get_mut(*place)) {
                    cell.extend_from_slice(value);
                }
            }
            record.clear();
            self.cells.iter().for_each(|cell| record.push(cell));
            return Ok(Some(self.line));
        }
    }

    fn is_restarted(&self) -> bool {
        true
    }

    fn stated_law(&self) -> Option<Controller> {
        self.law.clone()
    }

    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }
}
