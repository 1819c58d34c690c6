//! A measured operating point: up to three columns of the recordings that the effort depends on, brought to the one number that the
//! monitor is told at every tick.

use drift_core::OperatingPoint;

use super::regression::Fit;
use super::relation::Relation;
use super::windows::Windows;
use crate::baseline_file::{MOST_COLUMNS, PointColumns};
use crate::{Error, Result};

/// As many columns as the monitor's file can hold.
pub(super) fn check(columns: &[String], effort_is_judged: bool) -> Result<()> {
    if columns.len() > MOST_COLUMNS {
        return Err(Error::new(format!("{} columns for the operating point", columns.len()))
            .allowed(format!("up to {MOST_COLUMNS}")));
    }
    if let Some((_, name)) = columns.iter().enumerate().find(|(i, name)| columns[..*i].contains(name)) {
        return Err(Error::new(format!("operating point: column '{name}' is named twice")));
    }
    if !columns.is_empty() && !effort_is_judged {
        return Err(Error::new("an operating point, but no effort channel")
            .allowed("--channels with effort among them"));
    }
    Ok(())
}

/// A column that stands still teaches nothing: a change of it later would be no one's.
pub(super) fn check_variation(windows: &Windows, columns: &[String]) -> Result<()> {
    for (k, name) in columns.iter().enumerate() {
        let of = |row: &super::WindowRow| row.columns[k];
        let low = windows.rows.iter().map(of).fold(f32::MAX, f32::min);
        let high = windows.rows.iter().map(of).fold(f32::MIN, f32::max);
        if high - low <= 1e-6 * high.abs().max(low.abs()) {
            return Err(Error::new(format!(
                "operating point: column '{name}' stands at {low:.4} in all healthy windows"
            ))
            .allowed("columns that vary while the loop is healthy"));
        }
    }
    Ok(())
}

/// The columns' scales, and what the channel knows of the one number.
pub(super) fn combine(
    windows: &Windows,
    names: &[String],
    relation: &Relation,
    (fit, position, worth): (&Fit, usize, f64),
) -> Option<(PointColumns, OperatingPoint)> {
    let n = windows.rows.len() as f64;
    let effect = |k: usize, weight: f64| {
        let column = || windows.rows.iter().map(|row| f64::from(row.columns[k]));
        let mean = column().sum::<f64>() / n;
        weight.abs() * column().map(|x| (x - mean).powi(2)).sum::<f64>().sqrt()
    };
    let by_effect = |a: &(usize, &f64), b: &(usize, &f64)| effect(a.0, *a.1).total_cmp(&effect(b.0, *b.1));
    let (_, weight) = relation.weights.iter().enumerate().max_by(by_effect)?;
    let scales: Vec<f32> =
        relation.weights.iter().map(|c| if *weight == 0.0 { 0.0 } else { (c / weight) as f32 }).collect();
    let columns = PointColumns { columns: names.to_vec(), scales };
    let point = |row: &super::WindowRow| {
        let measured = row.columns.map(f64::from);
        f64::from(columns.point(&measured[..names.len().min(MOST_COLUMNS)]))
    };
    let points: Vec<f64> = windows.rows.iter().map(point).collect();
    let mean = points.iter().sum::<f64>() / n;
    let from_mean = |row: &super::WindowRow| f64::from(row.x[position]) - fit.x_mean;
    let with_x: f64 = windows.rows.iter().zip(&points).map(|(row, p)| from_mean(row) * (p - mean)).sum();
    let per_x = if fit.has_slope && fit.x_ss > 0.0 { with_x / fit.x_ss } else { 0.0 };
    let apart = |(row, p): (&super::WindowRow, &f64)| (p - mean - per_x * from_mean(row)).powi(2);
    let ss: f64 = windows.rows.iter().zip(&points).map(apart).sum();
    let known = OperatingPoint {
        weight: *weight as f32,
        mean: mean as f32,
        per_x: per_x as f32,
        // The weight is known as well as from so many independent windows.
        ss: (ss * worth) as f32,
        min: points.iter().fold(f64::MAX, |low, p| low.min(*p)) as f32,
        max: points.iter().fold(f64::MIN, |high, p| high.max(*p)) as f32,
    };
    Some((columns, known))
}
