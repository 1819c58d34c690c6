//! A diagnosis as rows on a terminal: u as measured, and how far off the simulated loop is, without what was found and with it.

use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, prove};
use drift_sim::plot::terminal::{mean, range, rms, row, stretches};
use drift_sim::sentences::{plain, with_unit};
use drift_sim::simulate::Trace;
use drift_sim::terminal::Terminal;

/// The rows, with their numbers; nothing where the loops can't be simulated. Where the control law is not known, y
/// takes the place of u.
pub fn rows(found: &Diagnosis, signals: &Signals, terminal: &Terminal) -> String {
    let columns = terminal.chart_columns();
    let known_law = found.improved.has_law();
    let units = found.improved.unit_names();
    let (name, unit, measured) =
        if known_law { ("u", units.u, &signals.u) } else { ("y", units.y, &signals.y) };
    let of = |trace: Trace| if known_law { trace.u } else { trace.y };
    let off = |model| {
        let simulated = of(prove::quiet_run(model, signals)?);
        Some(measured.iter().zip(&simulated).map(|(a, b)| a - b).collect::<Vec<f64>>())
    };
    let (Some(before), Some(after)) = (off(&found.refitted), off(&found.improved)) else {
        return String::new();
    };

    let mean_u = stretches(measured, columns, mean);
    let (low, high) = range(&mean_u);
    let mut text = line(&format!("{name} measured"), &row(&mean_u, (low, high), terminal.signs));
    text += &format!("  {} to {}\n", plain(low, 3), with_unit(plain(high, 3), &unit));
    let told = if found.physics.is_empty() {
        vec![("off", after)]
    } else {
        vec![("off, without", before), ("off, with it", after)]
    };
    let rows = told.into_iter().map(|(what, off)| {
        let known: Vec<f64> = off.iter().copied().filter(|x| x.is_finite()).collect();
        (format!("{name} {what}"), stretches(&off, columns, rms), rms(&known))
    });
    let rows: Vec<_> = rows.collect();
    // Both on one scale: the second row is low where the physics has explained it.
    let most = rows.iter().flat_map(|(_, off, _)| off).copied().fold(0.0, f64::max);
    for (name, off, all) in &rows {
        text += &line(name, &row(off, (0.0, most), terminal.signs));
        text += &format!("  {} rms\n", with_unit(plain(*all, 2), &unit));
    }
    text
}

fn line(name: &str, signs: &str) -> String {
    format!("  {name:<16} {signs}")
}
