//! Against the committed figures: more than 5 % worse fails.

use anyhow::{Context, Result, bail};
use serde_json::Value;

const FIGURES: [&str; 5] = ["tick_mean", "tick_max", "text_bytes", "ram_bytes", "stack_bytes"];

/// Fails with every figure that is worse, and where a row is missing on either side.
pub fn with_committed(rows: &Value, file: &str) -> Result<()> {
    let text = std::fs::read_to_string(file).with_context(|| file.to_string())?;
    let committed: Value = serde_json::from_str(&text).with_context(|| file.to_string())?;
    let (Some(rows), Some(committed)) = (rows.as_array(), committed.as_array()) else {
        bail!("{file}: not a list of rows");
    };
    let mut worse = Vec::new();
    if rows.len() != committed.len() {
        worse.push(format!("{} rows, {} committed", rows.len(), committed.len()));
    }
    for (row, before) in rows.iter().zip(committed) {
        for key in ["target", "config"] {
            if row[key] != before[key] {
                worse.push(format!("{} where {} is committed", row[key], before[key]));
            }
        }
        for key in FIGURES {
            let (now, then) = (row[key].as_f64(), before[key].as_f64());
            let (now, then) = now.zip(then).with_context(|| format!("{file}: no {key}"))?;
            if now > 1.05 * then {
                worse.push(format!("{} {}: {key} {now}, committed {then}", row["target"], row["config"]));
            }
        }
    }
    if !worse.is_empty() {
        bail!("more than 5 % worse than {file}:\n{}", worse.join("\n"));
    }
    println!("\nno figure is more than 5 % worse than in {file}");
    Ok(())
}
