//! The plan as JSON, `drift.plan/1`.

use serde_json::{Value, json};

use super::Plan;
use crate::estimate::signals::range;
use crate::sentences;

impl Plan {
    /// The whole document.
    pub fn json(&self) -> Value {
        let pairs: Vec<Value> = self
            .separation
            .pairs
            .iter()
            .map(|pair| {
                json!({
                    "truth": self.name(pair.truth),
                    "rival": self.name(pair.rival),
                    "expected_log_likelihood_ratio": pair.expected.is_finite().then_some(pair.expected),
                    "chance": pair.chance,
                })
            })
            .collect();
        let named: Vec<Value> = self
            .separation
            .named
            .iter()
            .map(|(place, chance)| json!({"cause": self.name(*place), "chance": chance}))
            .collect();
        let (low, high) = range(&self.r);
        json!({
            "schema": "drift.plan/1",
            "answer": sentences::planning(self).to_json(),
            "reference": self.shape.name(),
            "duration_s": self.duration_s(),
            "before_s": self.before_s,
            "samples": self.r.len(),
            "r_range": [low, high],
            "chance": self.chance(),
            "named": named,
            "pairs": pairs,
            "not_told_apart": self.not_told().iter().map(|(a, b)| [self.name(*a), self.name(*b)]).collect::<Vec<_>>(),
            "references_tried": self.tried,
        })
    }
}
