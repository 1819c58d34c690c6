//! Figure 5: the candidate indices over a run of 10 s, for growing mu_max and for growing sigma_growth.

use super::{Plate, over_time};
use crate::Result;
use crate::paper::ranking::{READING, cell};
use crate::paper::settings::{MU_LEVELS, SIGMA_LEVELS};
use crate::paper::windows::Window;
use crate::plot::{Colour, Figure, Layer, Panel};

type OfWindow = fn(&Window) -> f32;

const SHOWN: [(&str, OfWindow); 5] = [
    ("IAE", |w| w.indices.iae),
    ("ISE", |w| w.indices.ise),
    ("ITAE", |w| w.indices.itae),
    ("ITSE", |w| w.indices.itse),
    ("E_u", |w| w.indices.e_u),
];

fn sweep(symbol: &str, runs: &[(f64, Vec<Window>)]) -> Vec<Panel> {
    let panel = |(name, of): &(&str, OfWindow)| {
        let line = |(i, (level, windows)): (usize, &(f64, Vec<Window>))| {
            let points = windows.iter().map(|w| (w.end_s, f64::from(of(w)))).collect();
            Layer::line(format!("{symbol} = {level}"), Colour::nth(i), points)
        };
        over_time(name, runs.iter().enumerate().map(line).collect())
    };
    SHOWN.iter().map(panel).collect()
}

fn figure(title: &str, symbol: &str, runs: &[(f64, Vec<Window>)]) -> Figure {
    let mut panels = sweep(symbol, runs);
    // One legend is enough.
    for panel in panels.iter_mut().skip(1) {
        panel.legend = crate::plot::LegendPosition::Hidden;
    }
    let mut figure = Figure::stacked(title, panels);
    figure.panel_height_px = 150;
    figure
}

/// How far the last window's index moved from the least to the greatest level, per cent.
fn moved(runs: &[(f64, Vec<Window>)], of: OfWindow) -> f64 {
    let last = |run: Option<&(f64, Vec<Window>)>| {
        run.and_then(|(_, windows)| windows.last()).map_or(f64::NAN, |w| f64::from(of(w)))
    };
    100.0 * (last(runs.last()) / last(runs.first()) - 1.0)
}

fn says(runs: &[(f64, Vec<Window>)]) -> String {
    let each = SHOWN.iter().map(|(name, of)| format!("{name} {:+.2} %", moved(runs, *of)));
    each.collect::<Vec<_>>().join(", ")
}

pub(super) fn figure_5(seed: u64) -> Result<[Plate; 2]> {
    let over_mu =
        MU_LEVELS.iter().map(|mu| Ok((*mu, cell(*mu, 0.0, &READING, seed)?))).collect::<Result<Vec<_>>>()?;
    let over_sigma = SIGMA_LEVELS
        .iter()
        .map(|sigma| Ok((*sigma, cell(0.0, *sigma, &READING, seed)?)))
        .collect::<Result<Vec<_>>>()?;
    let a = Plate {
        file: "fig05a.svg",
        name: "Figure 5a",
        figure: figure(
            "Figure 5a: indices of 3 s windows, \u{3c3}_growth = 0",
            "\u{3bc}_max",
            &over_mu,
        ),
        shows: format!("The last window from mu_max = 0 to 10: {}.", says(&over_mu)),
        published: "As described: IAE (and ITAE) separates the levels most clearly, ISE and ITSE hardly below mu_max = 10. \
                    IAE rises because a growing drift offsets e."
            .into(),
    };
    let b = Plate {
        file: "fig05b.svg",
        name: "Figure 5b",
        figure: figure("Figure 5b: indices of 3 s windows, \u{3bc}_max = 0", "\u{3c3}_growth", &over_sigma),
        shows: format!(
            "The last window from sigma_growth = 0 to 10, read as in Table 1: {}.",
            says(&over_sigma)
        ),
        published:
            "As described: the error indices contain the effect of sigma_growth, under this reading of it."
                .into(),
    };
    Ok([a, b])
}
