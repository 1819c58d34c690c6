//! A calibration for people (one screen) and for programs (JSON, schema `drift.calibration/1`).

use drift_core::Detectors;
use serde_json::{Value, json};

use super::Calibration;
use super::detector::{self, Designed};
use crate::sentences::{self, line, plain};
use crate::terminal::Terminal;

impl Calibration {
    /// One screen of text: the answer, the channels' lines and limits, what could be better and what is allowed for.
    pub fn to_text(&self, terminal: &Terminal) -> String {
        let mut text = terminal.answer(&sentences::calibration(self));
        if let Some(reason) = &self.timing.reason {
            text += &terminal.wrapped("  ", reason);
        }
        text += &format!(
            "\n{:13} {:>6} {:>10} {:>12}  healthy line\n",
            "channel", "R^2", "scatter", "independent"
        );
        for channel in &self.channels {
            let fit = &channel.fit;
            let before = format!(
                "{:13} {:>6.3} {:>10} {:>12}  ",
                channel.kind.name(),
                fit.r2,
                terminal.text(&plain(fit.rmse, 3)),
                plain(channel.n_effective, 3)
            );
            let memory = match channel.memory.order {
                0 => String::new(),
                1 => "; remembers 1 window".into(),
                order => format!("; remembers {order} windows"),
            };
            text += &terminal.wrapped(&before, &format!("{}{memory}", line(fit.b0, fit.b1)));
        }
        let effort = self.channels.iter().find(|c| c.operating_point.counts());
        if let Some((channel, point)) = effort.zip(self.file.operating_point.as_ref()) {
            let weight = f64::from(channel.operating_point.weight);
            let per = |(scale, name): (&f32, &String)| {
                format!("{} per unit of {name}", plain(weight * f64::from(*scale), 4))
            };
            let terms: Vec<String> = point.scales.iter().zip(&point.columns).map(per).collect();
            let said = format!("{} goes with the operating point: {}", channel.kind.name(), terms.join(", "));
            text += &terminal.wrapped("  ", &said);
        }
        text += "\nalarm, in sigma (k: what a sum takes off each window, h: where it alarms)\n";
        for channel in &self.channels {
            text +=
                &terminal.wrapped(&format!("{:13} ", channel.kind.name()), &thresholds(&channel.detectors));
        }
        let rare = self.file.promise.as_ref().is_some_and(|promise| {
            promise.decisions * self.cost.run_length_factor > f64::from(self.file.calibration.windows)
        });
        text.push('\n');
        for warning in self.warnings.iter().filter(|warning| sentences::asks_for_action(warning)) {
            text += &terminal.wrapped("warning: ", warning);
        }
        for note in self.warnings.iter().filter(|warning| !sentences::asks_for_action(warning)) {
            text += &terminal.wrapped("note: ", note);
        }
        if rare {
            let said = "such rare alarms can't be seen in these windows: the thresholds are extrapolated along the residuals' fitted tails";
            text += &terminal.wrapped("note: ", said);
        }
        text
    }

    /// The same and more as JSON.
    pub fn to_json(&self) -> Value {
        let timing = &self.file.timing;
        let channels: Vec<Value> = self
            .channels
            .iter()
            .map(|c| {
                let fit = &c.fit;
                json!({
                    "kind": c.kind.name(),
                    "b0": fit.b0, "b1": fit.b1,
                    "b0_ci95": fit.b0_ci95_wide(), "b1_ci95": fit.b1_ci95_wide(),
                    "b0_ci95_independent": fit.b0_ci95, "b1_ci95_independent": fit.b1_ci95,
                    "has_slope": fit.has_slope,
                    "r2": fit.r2, "adj_r2": fit.adj_r2, "rmse": fit.rmse,
                    "n": fit.n, "n_effective": c.n_effective, "integrated_time": c.integrated_time,
                    "lag1": c.lag1, "skewness": c.skewness,
                    "memory": c.memory, "visible": c.memory.visible(),
                    "operating_point": c.operating_point,
                    "detectors": c.detectors,
                })
            })
            .collect();
        json!({
            "schema": "drift.calibration/1",
            "timing": timing,
            "window_s": timing.window_s(),
            "hop_s": timing.hop_s(),
            "window_reason": self.timing.reason,
            "correlation_s": self.timing.correlation_s,
            "calibration": self.file.calibration,
            "invalid_windows": self.invalid_windows,
            "promise": self.file.promise,
            "operating_point": self.file.operating_point,
            "cost": {
                "run_length_factor": self.cost.run_length_factor,
                "delay_decisions": self.cost.delay,
                "delay_decisions_exact": self.cost.delay_exact,
            },
            "channels": channels,
            "warnings": self.warnings,
        })
    }
}

fn thresholds(of: &Detectors) -> String {
    let row = |row: &&dyn Designed| Some(format!("{} {}", row.spoken(), row.thresholds(of)?));
    detector::ROWS.iter().filter_map(row).collect::<Vec<_>>().join("; ")
}
