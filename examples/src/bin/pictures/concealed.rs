//! The picture of a real drive whose dry friction the feedback conceals: EMPS, run with known pulses, which no number was fitted on. The
//! recordings are not part of the project.

use std::path::Path;

use drift_sim::Result;
use drift_sim::control_loop::Loop;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{diagnose, prove};
use drift_sim::plot::{Colour, Figure, Layer, Panel};
use drift_sim::recording::{ReadOptions, Recording};

/// Seconds drawn: one of the four cycles.
const CYCLE_S: f64 = 6.2;

/// Measured and simulated y and u of the drive, with and without what `drift diagnose` found in another run of it.
pub fn drive(folder: &Path) -> Result<Figure> {
    let model = Loop::read(&folder.join("loop_pulses.toml"))?;
    let read = |name: &str| {
        let extra = model.inputs.iter().map(|input| input.column.clone()).collect();
        let options = ReadOptions { extra, ..ReadOptions::default() };
        Signals::new(&Recording::read(&folder.join(name), &options)?, &model)
    };
    let (train, unseen) = (read("emps_train.csv")?, read("emps_pulses_ctrl.csv")?);
    let found = diagnose(&train, Some(&unseen), &model)?;
    let cycle = unseen.part(0, (CYCLE_S / unseen.sample_time_s) as usize);
    let [without, with] = [&found.refitted, &found.improved].map(|model| prove::run(model, &cycle, 0));
    let line = |name: &str, colour, x: &[f64]| Layer::signal(name, colour, 0.0, cycle.sample_time_s, x);
    let percent = |fit: Option<prove::FitPct>, of_u: bool| {
        let fit = fit.and_then(|fit| if of_u { fit.u_pct } else { Some(fit.y_pct) });
        fit.map_or_else(String::new, |fit| format!(" ({fit:.2} %)"))
    };
    let panel = |what: &str, of_u: bool, measured: &[f64]| {
        let mut layers = vec![line("measured", Colour::Grey, measured)];
        for (name, colour, run, fit) in [
            ("simulated without friction", Colour::Vermilion, &without, found.holdout.before),
            ("with what was found", Colour::Blue, &with, found.holdout.after),
        ] {
            if let Some(run) = run {
                let x = if of_u { &run.u } else { &run.y };
                layers.push(line(&format!("{name}{}", percent(fit, of_u)), colour, x));
            }
        }
        Panel { y_label: what.into(), layers, ..Panel::default() }
    };
    let y = panel("y / m", false, &cycle.y);
    let u = Panel { x_label: "t / s".into(), ..panel("u / V", true, &cycle.u) };
    Ok(Figure { width_px: 900, ..Figure::stacked("", vec![y, u]) })
}
