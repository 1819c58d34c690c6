//! A calibration for people (one screen) and for programs (JSON, schema `drift.calibration/1`).

use std::fmt::Write as _;

use drift_core::Detectors;
use serde_json::{Value, json};

use super::Calibration;
use super::detector::{self, Designed};

impl Calibration {
    /// One screen of text.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        // Writing into a String can't fail.
        let _ = self.write_text(&mut text);
        text
    }

    fn write_text(&self, text: &mut String) -> std::fmt::Result {
        let timing = &self.file.timing;
        let windows = self.file.calibration.windows;
        if let Some(reason) = &self.timing.reason {
            writeln!(text, "{reason}")?;
        }
        writeln!(
            text,
            "{windows} healthy windows of {} s, a decision every {} s",
            number(timing.window_s()),
            number(timing.hop_s())
        )?;
        writeln!(
            text,
            "\n{:13} {:>11} {:>23} {:>11} {:>23} {:>6} {:>9} {:>6} {:>6}",
            "channel", "b0", "95 %", "b1", "95 %", "R^2", "RMSE", "lag-1", "n_eff"
        )?;
        for channel in &self.channels {
            let fit = &channel.fit;
            writeln!(
                text,
                "{:13} {:>11} {:>23} {:>11} {:>23} {:>6.3} {:>9} {:>6.2} {:>6.0}",
                channel.kind.name(),
                number(fit.b0),
                interval(fit.b0_ci95_wide()),
                number(fit.b1),
                interval(fit.b1_ci95_wide()),
                fit.r2,
                number(fit.rmse),
                channel.lag1,
                channel.n_effective,
            )?;
        }
        for channel in self.channels.iter().filter(|c| c.memory.order > 0) {
            writeln!(
                text,
                "{} remembers {} windows; {:.0} % of a lasting shift stay visible",
                channel.kind.name(),
                channel.memory.order,
                100.0 * channel.memory.visible(),
            )?;
        }
        let effort = self.channels.iter().find(|c| c.operating_point.counts());
        if let Some((channel, point)) = effort.zip(self.file.operating_point.as_ref()) {
            let weight = f64::from(channel.operating_point.weight);
            let per = |(scale, name): (&f32, &String)| {
                format!("{} per unit of {name}", number(weight * f64::from(*scale)))
            };
            let terms: Vec<String> = point.scales.iter().zip(&point.columns).map(per).collect();
            writeln!(text, "{} goes with the operating point: {}", channel.kind.name(), terms.join(", "))?;
        }
        writeln!(text, "\n{:13} alarms in sigmas", "channel")?;
        for channel in &self.channels {
            writeln!(text, "{:13} {}", channel.kind.name(), thresholds(&channel.detectors))?;
        }
        if let Some(promise) = &self.file.promise {
            writeln!(
                text,
                "\none false alarm per {} h = {} decisions, all channels and detectors together; the thresholds aim for {} of 100 such calibrations to keep it (of simulated loops, asked for 90 at 500 decisions, 93 or more did from 200 windows)",
                number(promise.false_alarm_every_h),
                number(promise.decisions),
                number(100.0 * promise.confidence),
            )?;
            writeln!(
                text,
                "a shift of 1 sigma in one channel is found after {} decisions ({} s), {:.0} % later than exact knowledge would",
                number(self.cost.delay),
                number(self.cost.delay * timing.hop_s()),
                100.0 * (self.cost.delay / self.cost.delay_exact - 1.0),
            )?;
            if promise.decisions * self.cost.run_length_factor > f64::from(windows) {
                writeln!(
                    text,
                    "rarer than the {windows} windows can show: the thresholds are extrapolated along the residuals' fitted tails"
                )?;
            }
        }
        self.warnings.iter().try_for_each(|warning| writeln!(text, "warning: {warning}"))
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
    let row = |row: &&dyn Designed| Some(format!("{} {}", row.name(), row.thresholds(of)?));
    detector::ROWS.iter().filter_map(row).collect::<Vec<_>>().join(", ")
}

fn interval([low, high]: [f64; 2]) -> String {
    format!("{} {}", number(low), number(high))
}

/// Four digits.
fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e5).contains(&size) {
        let places = (3 - size.log10().floor() as i32).clamp(0, 6) as usize;
        let text = format!("{x:.places$}");
        if places > 0 { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        format!("{x:.3e}")
    }
}
