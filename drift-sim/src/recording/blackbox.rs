//! Betaflight's blackbox (`.bbl`, `.bfl`): the rate loops of a quadrotor. Every field of the main frames is a column under its
//! own name, `setpoint[0]`, `gyroADC[0]`, `axisP[0]`; `pid[0]` is the controller's output, the sum of its terms.
//!
//! A file may hold several flights: the longest is read. Where no column is named, the loop is that of the roll axis.

use std::collections::HashMap;

use blackbox_log::frame::Value;
use blackbox_log::prelude::*;

use super::choice::Choice;
use super::contained::contained;
use super::format::Source;
use super::table::{Cells, TableRows};
use super::{ColumnMap, ReadOptions};
use crate::{Error, Result};

const DAMAGED: &str = "the blackbox log is cut off or damaged";
/// Terms that add up to what the controller puts out.
const TERMS: [&str; 5] = ["axisP", "axisI", "axisD", "axisF", "axisS"];
const AXES: [&str; 3] = ["roll", "pitch", "yaw"];

/// The rows of a file that begins like one.
///
/// # Errors
/// The file is damaged, holds no flight, or takes more memory than is allowed.
pub(super) fn open(source: Source, options: &ReadOptions) -> Result<TableRows> {
    let budget = source.budget.clone();
    let bytes = source.bytes()?;
    contained(DAMAGED, || {
        let file = blackbox_log::File::new(&bytes);
        let (mut longest, mut broken): (Option<(usize, usize)>, Option<Error>) = (None, None);
        for log in 0..file.log_count() {
            match flight(&file, log).map(|headers| count(&headers)) {
                Ok(frames) if frames > longest.map_or(1, |(_, most)| most) => longest = Some((log, frames)),
                Ok(_) => {}
                Err(error) => broken = broken.or(Some(error)),
            }
        }
        let no_flight = || broken.unwrap_or_else(|| Error::new("the blackbox log holds no flight"));
        let (log, _) = longest.ok_or_else(no_flight)?;
        let headers = flight(&file, log)?;
        let mut notes = Vec::new();
        if file.log_count() > 1 {
            notes.push(format!(
                "the log holds {} flights: this is number {}, the longest",
                file.log_count(),
                log + 1
            ));
        }
        let fields: Vec<String> =
            headers.main_frame_def().iter().map(|field| field.name.to_owned()).collect();
        let places: HashMap<&str, usize> =
            fields.iter().enumerate().map(|(place, name)| (name.as_str(), place)).collect();
        let sums: Vec<(String, Vec<usize>)> = (0..AXES.len())
            .map(|axis| {
                let terms = TERMS.iter().filter_map(|term| places.get(format!("{term}[{axis}]").as_str()));
                (format!("pid[{axis}]"), terms.copied().collect::<Vec<usize>>())
            })
            .filter(|(_, terms)| !terms.is_empty())
            .collect();
        let mut names = vec!["t".to_owned()];
        names.extend(sums.iter().map(|(name, _)| name.clone()));
        names.extend(fields.iter().cloned());
        let mut options = options.clone();
        notes.extend(choose_axis(&mut options.columns, &places));
        let used = Choice::of(&names, &options)?.uses(names.len());
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
        let mut parser = headers.data_parser();
        let mut first = None;
        while let Some(event) = parser.next() {
            let ParserEvent::Main(frame) = event else { continue };
            let time_us = frame.time_raw();
            let first_us = *first.get_or_insert(time_us);
            let value = |place: usize| frame.get(place).map_or(f64::NAN, |value| number(value.into()));
            let sum = |terms: &Vec<usize>| terms.iter().map(|place| value(*place)).sum::<f64>();
            for (index, (column, _)) in
                columns.iter_mut().zip(&used).enumerate().filter(|(_, (_, used))| **used)
            {
                let value = match index.checked_sub(1) {
                    None => time_us.wrapping_sub(first_us).cast_signed() as f64 / 1e6,
                    Some(sum_at) if sum_at < sums.len() => {
                        sums.get(sum_at).map_or(f64::NAN, |(_, terms)| sum(terms))
                    }
                    Some(field) => value(field - sums.len()),
                };
                budget.push(column, value)?;
            }
        }
        let table: Vec<(String, Cells)> =
            names.into_iter().zip(columns).map(|(name, column)| (name, Cells::Double(column))).collect();
        TableRows::new(table, notes, &options)
    })
}

fn flight<'a>(file: &blackbox_log::File<'a>, log: usize) -> Result<blackbox_log::Headers<'a>> {
    let headers = file.parse(log).ok_or_else(|| Error::new(DAMAGED))?;
    headers.map_err(|e| Error::new(format!("{DAMAGED}: {e}")))
}

fn count(headers: &blackbox_log::Headers) -> usize {
    let mut parser = headers.data_parser();
    let mut frames = 0;
    while let Some(event) = parser.next() {
        frames += usize::from(matches!(event, ParserEvent::Main(_)));
    }
    frames
}

/// Takes the loop of one axis: that of y where it is named, else roll.
fn choose_axis(columns: &mut ColumnMap, places: &HashMap<&str, usize>) -> Option<String> {
    let named = columns.named_index();
    let axis = named.unwrap_or(0);
    if named.is_none() && columns.is_anything_named() {
        return None;
    }
    // Older firmware logs the stick only.
    let r = ["setpoint", "rcCommand"].map(|name| format!("{name}[{axis}]"));
    let r = r.into_iter().find(|name| places.contains_key(name.as_str())).unwrap_or_default();
    let [_, has_r, has_y, has_u] = columns.is_named;
    if !has_r {
        columns.r = r;
    }
    if !has_y {
        columns.y = format!("gyroADC[{axis}]");
    }
    if !has_u {
        columns.u = format!("pid[{axis}]");
    }
    named.is_none().then(|| {
        format!(
            "this is the rate loop of the {} axis (--columns y=gyroADC[1] is {}, y=gyroADC[2] {})",
            AXES[0], AXES[1], AXES[2]
        )
    })
}

/// A value in degrees a second, or the unit that it is logged in.
fn number(value: Value) -> f64 {
    match value {
        Value::Rotation(rate) => rate.value.to_degrees(),
        Value::Amperage(current) => current.value,
        Value::Voltage(voltage) => voltage.value,
        Value::Acceleration(acceleration) => acceleration.value,
        Value::Altitude(length) => length.value,
        Value::Velocity(velocity) => velocity.value,
        Value::Boolean(flag) => f64::from(u8::from(flag)),
        Value::GpsCoordinate(angle) | Value::GpsHeading(angle) => angle,
        Value::Unsigned(number) => f64::from(number),
        Value::Signed(number) => f64::from(number),
        _ => f64::NAN,
    }
}
