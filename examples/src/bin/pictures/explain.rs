//! Pictures of the detectors: what an alarm is made of, and how often it is false.

use drift_core::{Cusum, Detector};
use drift_sim::Result;
use drift_sim::design;
use drift_sim::plot::{Colour, Figure, Layer, LegendPosition, Panel};
use drift_sim::reference::Reference;

/// Windows in the first picture, and where the deviations lie.
const WINDOWS: usize = 120;
const DISTURBANCE: std::ops::Range<usize> = 30..36;
const DRIFT: std::ops::Range<usize> = 75..WINDOWS;

/// A disturbance that passes and a drift that stays, as residual and as CUSUM.
fn disturbance_or_drift() -> Figure {
    let shift = |n: usize| match n {
        n if DISTURBANCE.contains(&n) => 2.5,
        n if DRIFT.contains(&n) => 1.0,
        _ => 0.0,
    };
    let noise = Reference::random(0.0, 1.0, 1, 7).take_samples(WINDOWS);
    let z: Vec<f64> = noise.iter().enumerate().map(|(n, noise)| noise + shift(n)).collect();
    let cusum = Cusum::new(0.5, 5.0);
    let mut state = cusum.start();
    let sums: Vec<f64> = z
        .iter()
        .map(|z| {
            let before = state.high;
            let alarm = cusum.update(&mut state, *z as f32).is_some();
            // Both sums start anew after an alarm: what is drawn is the sum that raised it.
            f64::from(if alarm { before + (*z as f32 - cusum.k) } else { state.high })
        })
        .collect();
    let spans = || {
        [(DISTURBANCE, "disturbance", Colour::Yellow), (DRIFT, "drift", Colour::Orange)].map(
            |(range, name, colour)| Layer::Span {
                from: range.start as f64,
                to: range.end as f64,
                name: name.into(),
                colour,
            },
        )
    };
    let line = |name: &str, values: &[f64]| Layer::signal(name, Colour::Blue, 0.0, 1.0, values);
    let threshold =
        Layer::HorizontalLine { y: 5.0, name: "threshold h".into(), colour: Colour::Vermilion, dashed: true };
    let residual = Panel {
        y_label: "residual / sigma".into(),
        layers: spans().into_iter().chain([line("", &z)]).collect(),
        ..Panel::default()
    };
    let evidence = Panel {
        x_label: "window".into(),
        y_label: "CUSUM / sigma".into(),
        layers: vec![line("evidence of a rise", &sums), threshold],
        ..Panel::default()
    };
    Figure { width_px: 800, ..Figure::stacked("", vec![residual, evidence]) }
}

/// Mean windows to a false and to a true alarm over the threshold, for three allowances.
fn run_length() -> Result<Figure> {
    let allowances = [(0.25, Colour::Green), (0.5, Colour::Blue), (1.0, Colour::Vermilion)];
    let curve = |mean: f64| {
        allowances
            .iter()
            .map(|(k, colour)| {
                let points = (4..=24).map(|quarter| {
                    let h = 0.5 * f64::from(quarter);
                    design::Cusum::new(*k, h, 0.0).map(|cusum| (h, cusum.arl(mean)))
                });
                let points = points.collect::<Result<Vec<_>>>()?;
                Ok(Layer::line(format!("k = {k}"), *colour, points))
            })
            .collect::<Result<Vec<_>>>()
    };
    let panel = |layers, y_label: &str, legend| Panel {
        x_label: "threshold h / sigma".into(),
        y_label: y_label.into(),
        layers,
        y_log: true,
        legend,
        ..Panel::default()
    };
    let mut healthy = panel(curve(0.0)?, "windows to a false alarm", LegendPosition::Above);
    healthy.y_range = Some((1.0, 1e6));
    let shifted = panel(curve(1.0)?, "windows to the alarm after 1 sigma", LegendPosition::Hidden);
    Ok(Figure { width_px: 860, panel_height_px: 260, ..Figure::grid("", 2, vec![healthy, shifted]) })
}

/// The pictures with their file names.
pub fn all() -> Result<[(&'static str, Figure); 2]> {
    Ok([("disturbance_or_drift", disturbance_or_drift()), ("run_length", run_length()?)])
}
