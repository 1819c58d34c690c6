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

/// y and what reaches the plant.
struct Run {
    y: Vec<f64>,
    drive: Vec<f64>,
}

/// Measured and simulated y and u of the drive, with and without what `drift diagnose` found in another run of it.
pub fn drive(folder: &Path) -> Result<Figure> {
    let model = Loop::read(&folder.join("loop_pulses.toml"))?;
    let read = |name: &str| {
        let extra = model.input_columns();
        let options = ReadOptions { extra, ..ReadOptions::default() };
        Signals::new(&Recording::read(&folder.join(name), &options)?, &model)
    };
    let (train, unseen) = (read("emps_train.csv")?, read("emps_pulses_ctrl.csv")?);
    let found = diagnose(std::slice::from_ref(&train), Some(&unseen), &model)?;
    let all = [&found.nominal, &found.improved].map(|model| prove::run(model, &unseen, 0));
    let [without, with] =
        all.map(|run| run.map(|run| Run { drive: drive_of(&run.u, &model, &unseen), y: run.y }));
    let measured = Run { y: unseen.y.clone(), drive: drive_of(&unseen.u, &model, &unseen) };
    let cycle = (CYCLE_S / unseen.sample_time_s) as usize;
    let line = |name: &str, colour, x: &[f64]| {
        let shown = x.get(..cycle).unwrap_or(x);
        Layer::signal(name, colour, 0.0, unseen.sample_time_s, shown)
    };
    let panel = |what: &str, of: fn(&Run) -> &[f64]| {
        let measured = of(&measured);
        let mut layers = vec![line("measured", Colour::Grey, measured)];
        for (name, colour, run) in [
            ("simulated, no friction", Colour::Vermilion, &without),
            ("with what was found", Colour::Blue, &with),
        ] {
            if let Some(run) = run {
                let fit = prove::percent(measured, of(run));
                layers.push(line(&format!("{name}: fits {fit:.2} %"), colour, of(run)));
            }
        }
        Panel { y_label: what.into(), layers, ..Panel::default() }
    };
    let y = panel("y / m", |run| &run.y);
    let drive = Panel { x_label: "t / s".into(), ..panel("u + known pulses / V", |run| &run.drive) };
    Ok(Figure { width_px: 900, ..Figure::stacked("", vec![y, drive]) })
}

/// What reaches the plant: u and the measured inputs.
fn drive_of(u: &[f64], model: &Loop, signals: &Signals) -> Vec<f64> {
    let mut drive = u.to_vec();
    for (input, values) in model.inputs.iter().zip(&signals.inputs) {
        drive.iter_mut().zip(values).for_each(|(drive, value)| *drive += input.gain.value() * value);
    }
    drive
}
