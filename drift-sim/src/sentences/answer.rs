//! What a result comes to: a status, a sentence, three numbers.

use serde_json::{Value, json};

/// What is seen at a glance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Nothing is wrong that this recording could show.
    Healthy,
    /// Something is wrong, and not yet known what or whether it stays.
    Suspect,
    /// The loop has left its healthy relation to stay.
    Drift,
    /// What is wrong has a name and numbers.
    CauseFound,
    /// The recording can't tell.
    CantTell,
    /// A plan tells all causes apart that are left.
    ToldApart,
    /// Some of what was asked for comes out, not all.
    InPart,
    /// A baseline was learnt: no verdict on the loop, whose health is taken for granted.
    Learnt,
}

impl Status {
    /// Its word for people.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Healthy => "Healthy",
            Self::Suspect => "Suspect",
            Self::Drift => "Drift",
            Self::CauseFound => "Cause found",
            Self::CantTell => "Can't tell",
            Self::ToldApart => "Told apart",
            Self::InPart => "In part",
            Self::Learnt => "Learnt",
        }
    }

    /// Its word in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Healthy => "healthy",
            Self::Suspect => "suspect",
            Self::Drift => "drift",
            Self::CauseFound => "cause_found",
            Self::CantTell => "cant_tell",
            Self::ToldApart => "told_apart",
            Self::InPart => "in_part",
            Self::Learnt => "learnt",
        }
    }
}

/// A number that a reader takes away, and what it is.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct KeyNumber {
    /// With its unit.
    pub value: String,
    /// What it is, in a few words.
    pub label: String,
}

impl KeyNumber {
    /// A number and what it is.
    pub fn new(value: impl Into<String>, label: impl Into<String>) -> Self {
        Self { value: value.into(), label: label.into() }
    }
}

/// The answer to "what is wrong with this loop?", the same on page, terminal and in JSON.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// At a glance.
    pub status: Status,
    /// One plain sentence.
    pub sentence: String,
    /// What else there is to say; may be empty.
    pub also: String,
    /// Three at most.
    pub numbers: Vec<KeyNumber>,
}

impl Answer {
    /// As JSON.
    pub fn to_json(&self) -> Value {
        let numbers: Vec<Value> =
            self.numbers.iter().map(|n| json!({"value": n.value, "label": n.label})).collect();
        json!({"status": self.status.name(), "sentence": self.sentence, "also": self.also, "numbers": numbers})
    }

    /// All that it says, for those who read it to find fault.
    pub fn texts(&self) -> impl Iterator<Item = &str> {
        let numbers = self.numbers.iter().flat_map(|n| [n.value.as_str(), n.label.as_str()]);
        [self.sentence.as_str(), self.also.as_str()].into_iter().chain(numbers)
    }
}
