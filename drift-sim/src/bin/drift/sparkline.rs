//! A diagnosis as three rows on a terminal: u as measured, and how far off the loop is before and after.

use drift_sim::controller::Controller;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, prove};
use drift_sim::physics::shown;
use drift_sim::plot::terminal::{COLUMNS, Signs, mean, range, rms, row, stretches};
use drift_sim::simulate::Trace;

/// The rows, with their numbers; nothing where the loops can't be simulated. Where the control law is not known, y
/// takes the place of u.
pub fn rows(found: &Diagnosis, signals: &Signals, signs: Signs) -> String {
    let known_law = found.improved.controller != Controller::Recorded;
    let units = found.improved.unit_names();
    let (name, unit, measured) =
        if known_law { ("u", units.u, &signals.u) } else { ("y", units.y, &signals.y) };
    let of = |trace: Trace| if known_law { trace.u } else { trace.y };
    let off = |model| {
        let simulated = of(prove::run(model, signals, 0)?);
        Some(measured.iter().zip(&simulated).map(|(a, b)| a - b).collect::<Vec<f64>>())
    };
    let (Some(before), Some(after)) = (off(&found.refitted), off(&found.improved)) else {
        return String::new();
    };

    let mean_u = stretches(measured, COLUMNS, mean);
    let (low, high) = range(&mean_u);
    let mut text = line(&format!("{name} measured"), &row(&mean_u, (low, high), signs));
    text += &format!("  {} .. {}\n", shown(low, ""), shown(high, &unit));
    let rows = [("off, refitted", before), ("off, improved", after)].map(|(what, off)| {
        let known: Vec<f64> = off.iter().copied().filter(|x| x.is_finite()).collect();
        (format!("{name} {what}"), stretches(&off, COLUMNS, rms), rms(&known))
    });
    // Both on one scale: the second row is low where the physics has explained it.
    let most = rows.iter().flat_map(|(_, off, _)| off).copied().fold(0.0, f64::max);
    for (name, off, all) in &rows {
        text += &line(name, &row(off, (0.0, most), signs));
        text += &format!("  rms {}\n", shown(*all, &unit));
    }
    text
}

fn line(name: &str, signs: &str) -> String {
    format!("  {name:<16} {signs}")
}
