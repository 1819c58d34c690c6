//! A table of a loop file while it is read: typed access by key, with the line of each thing for messages.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::control_loop::LARGEST;
use crate::physics::Range;
use crate::sentences::typed;
use crate::{Error, Result};

/// The line (from 1) of a byte offset.
pub(super) fn line_of(text: &str, offset: usize) -> u64 {
    text.bytes().take(offset).filter(|byte| *byte == b'\n').count() as u64 + 1
}

/// One table.
pub(super) struct Section<'a> {
    text: &'a str,
    /// As in `[name]`; for messages.
    pub name: &'a str,
    table: &'a DeTable<'a>,
    /// Where it begins.
    pub line: u64,
}

impl<'a> Section<'a> {
    pub fn new(text: &'a str, name: &'a str, table: &'a DeTable<'a>, offset: usize) -> Self {
        Self { text, name, table, line: line_of(text, offset) }
    }

    fn entry(&self, key: &str) -> Option<(u64, &'a Spanned<DeValue<'a>>)> {
        let (key, value) = self.table.iter().find(|(name, _)| name.get_ref() == key)?;
        Some((line_of(self.text, key.span().start), value))
    }

    /// The line of a key, or else of the table.
    pub fn line_of(&self, key: &str) -> u64 {
        self.entry(key).map_or(self.line, |(line, _)| line)
    }

    /// Whether a key is given.
    pub fn has(&self, key: &str) -> bool {
        self.entry(key).is_some()
    }

    /// An error at a key.
    pub fn refuse(&self, key: &str, what: impl std::fmt::Display, allowed: impl Into<String>) -> Error {
        Error::new(format!("{what}")).allowed(allowed).at_line(self.line_of(key))
    }

    /// Refuses keys that are not among these.
    pub fn only(&self, keys: &[&str]) -> Result<()> {
        match self.table.iter().find(|(key, _)| !keys.contains(&key.get_ref().as_ref())) {
            Some((key, _)) => Err(Error::new(format!("unknown key '{}' in [{}]", key.get_ref(), self.name))
                .allowed(format!("allowed: {}", keys.join(", ")))
                .at_line(line_of(self.text, key.span().start))),
            None => Ok(()),
        }
    }

    fn missing(&self, key: &str, allowed: &str) -> Error {
        Error::new(format!("[{}] lacks the key '{key}'", self.name))
            .allowed(allowed.to_string())
            .at_line(self.line)
    }

    fn wrong(&self, key: &str, value: &DeValue<'_>, allowed: &str) -> Error {
        self.refuse(key, format!("{key} is {}", described(value)), format!("{key} must be {allowed}"))
    }

    /// A number where the key is given.
    pub fn optional_number(&self, key: &str, range: Range) -> Result<Option<f64>> {
        let Some((_, value)) = self.entry(key) else { return Ok(None) };
        match number(value.get_ref()) {
            Some(number) if range.allows(number) && number.is_finite() && number.abs() > LARGEST => {
                let what = format!("{key} is {}", described(value.get_ref()));
                Err(self.refuse(key, what, format!("{key} must be within +-{}", typed(LARGEST))))
            }
            Some(number) if range.allows(number) => Ok(Some(number)),
            _ => Err(self.wrong(key, value.get_ref(), &range.says())),
        }
    }

    /// A number or one word (`None`), where the key is given.
    pub fn optional_number_or_word(
        &self,
        key: &str,
        range: Range,
        word: &str,
    ) -> Result<Option<Option<f64>>> {
        let Some((_, value)) = self.entry(key) else { return Ok(None) };
        match value.get_ref().as_str() {
            Some(text) if text == word => Ok(Some(None)),
            Some(_) => Err(self.wrong(key, value.get_ref(), &format!("a number or \"{word}\""))),
            None => Ok(self.optional_number(key, range)?.map(Some)),
        }
    }

    /// A number that must be given.
    pub fn number(&self, key: &str, range: Range) -> Result<f64> {
        self.optional_number(key, range)?
            .ok_or_else(|| self.missing(key, &format!("{key} = {}", range.says())))
    }

    /// Text where the key is given.
    pub fn optional_text(&self, key: &str) -> Result<Option<String>> {
        let Some((_, value)) = self.entry(key) else { return Ok(None) };
        let text = value.get_ref().as_str().map(str::to_string);
        text.map(Some).ok_or_else(|| self.wrong(key, value.get_ref(), "text in quotes"))
    }

    /// Text that must be given.
    pub fn text(&self, key: &str) -> Result<String> {
        self.optional_text(key)?.ok_or_else(|| self.missing(key, &format!("{key} = text in quotes")))
    }

    /// One of some words, where the key is given.
    pub fn optional_choice<T: Copy>(&self, key: &str, choices: &[(&'static str, T)]) -> Result<Option<T>> {
        let Some((_, value)) = self.entry(key) else { return Ok(None) };
        let chosen = value.get_ref().as_str().and_then(|text| choices.iter().find(|(name, _)| *name == text));
        chosen
            .map(|(_, choice)| Some(*choice))
            .ok_or_else(|| self.wrong(key, value.get_ref(), &words(choices)))
    }

    /// One of some words.
    pub fn choice<T: Copy>(&self, key: &str, choices: &[(&'static str, T)]) -> Result<T> {
        self.optional_choice(key, choices)?
            .ok_or_else(|| self.missing(key, &format!("{key} = {}", words(choices))))
    }

    /// true or false, where the key is given.
    pub fn optional_switch(&self, key: &str) -> Result<Option<bool>> {
        let Some((_, value)) = self.entry(key) else { return Ok(None) };
        value.get_ref().as_bool().map(Some).ok_or_else(|| self.wrong(key, value.get_ref(), "true or false"))
    }

    /// A list of finite numbers; a lone number, a list of lists of one number each, or one list within a list, counts
    /// as one.
    pub fn vector(&self, key: &str) -> Result<Vec<f64>> {
        let allowed = "a list of finite numbers";
        let (_, value) = self.entry(key).ok_or_else(|| self.missing(key, &format!("{key} = {allowed}")))?;
        let nested =
            rows(value.get_ref()).filter(|rows| rows.len() == 1 || rows.iter().all(|row| row.len() == 1));
        let lone = number(value.get_ref()).filter(|number| number.is_finite()).map(|number| vec![number]);
        let plain = lone.or_else(|| numbers(value.get_ref())).or_else(|| nested.map(|rows| rows.concat()));
        plain.filter(|list| !list.is_empty()).ok_or_else(|| self.wrong(key, value.get_ref(), allowed))
    }

    /// A list of lists of finite numbers.
    pub fn matrix(&self, key: &str) -> Result<Vec<Vec<f64>>> {
        let allowed = "a list of rows, each a list of finite numbers";
        let (_, value) = self.entry(key).ok_or_else(|| self.missing(key, &format!("{key} = {allowed}")))?;
        rows(value.get_ref()).ok_or_else(|| self.wrong(key, value.get_ref(), allowed))
    }

    /// Pairs of numbers, where the key is given.
    pub fn optional_pairs(&self, key: &str) -> Result<Vec<(f64, f64)>> {
        let Some((_, value)) = self.entry(key) else { return Ok(Vec::new()) };
        let pair = |row: &Vec<f64>| match row.as_slice() {
            [from, to] if *from >= 0.0 && to > from => Some((*from, *to)),
            _ => None,
        };
        let pairs = rows(value.get_ref()).and_then(|rows| rows.iter().map(pair).collect::<Option<Vec<_>>>());
        pairs.ok_or_else(|| {
            self.wrong(key, value.get_ref(), "pairs [[from, to], ...] with 0 <= from < to, in seconds")
        })
    }
}

fn words<T>(choices: &[(&'static str, T)]) -> String {
    choices.iter().map(|(name, _)| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
}

/// What stands in the file, shortened, for messages.
fn described(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => format!("\"{}\"", text.chars().take(40).collect::<String>()),
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.as_str().to_string(),
        DeValue::Boolean(switch) => switch.to_string(),
        DeValue::Datetime(_) => "a date".into(),
        DeValue::Array(_) => "a list of another shape".into(),
        DeValue::Table(_) => "a table".into(),
    }
}

/// A number, whole or not; not a finite one counts too, for the caller to refuse.
fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(number) => {
            i64::from_str_radix(number.as_str(), number.radix()).ok().map(|n| n as f64)
        }
        DeValue::Float(number) => number.as_str().replace('_', "").parse().ok(),
        _ => None,
    }
}

fn numbers(value: &DeValue<'_>) -> Option<Vec<f64>> {
    let list = value.as_array()?;
    list.iter().map(|item| number(item.get_ref()).filter(|number| number.is_finite())).collect()
}

fn rows(value: &DeValue<'_>) -> Option<Vec<Vec<f64>>> {
    value.as_array()?.iter().map(|row| numbers(row.get_ref())).collect()
}
