//! Figures 3, 4, 6 and 7: the loop's signals in runs of 10 s.

use super::{Plate, over_time};
use crate::Result;
use crate::paper::settings::{FILTER_S, SAMPLE_TIME_S, SHORT_RUN_S};
use crate::paper::windows::Drift;
use crate::plot::{Colour, Figure, Layer};
use crate::reference::Reference;
use crate::simulate::simulate;

/// mu_max of Figures 6 and 7: the added disturbance "eventually reaches an amplitude of 10".
const NON_NOMINAL_MU: f64 = 10.0;

/// A run's signals.
struct Signals {
    r: Vec<f64>,
    y: Vec<f64>,
    u: Vec<f64>,
    e: Vec<f64>,
    added: Vec<f64>,
}

fn run(drift: &Drift, seed: u64) -> Result<Signals> {
    let r = Reference::paper(seed).take_samples((SHORT_RUN_S / SAMPLE_TIME_S).round() as usize);
    let trace = simulate(&drift.in_loop()?, &r, &[], seed, None)?;
    let difference = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>();
    let (e, added) = (difference(&r, &trace.y), difference(&trace.y, &trace.true_y));
    Ok(Signals { r, y: trace.y, u: trace.u, e, added })
}

fn signal(name: &str, colour: Colour, x: &[f64]) -> Layer {
    Layer::signal(name, colour, 0.0, SAMPLE_TIME_S, x)
}

/// The centred rolling mean over [`FILTER_S`], over what there is of it at the ends.
fn filtered(x: &[f64]) -> Vec<f64> {
    let half = (0.5 * FILTER_S / SAMPLE_TIME_S).round() as usize;
    let mut sums = vec![0.0];
    for value in x {
        sums.push(sums.last().copied().unwrap_or(0.0) + value);
    }
    let mean = |i: usize| {
        let (from, to) = (i.saturating_sub(half), (i + half + 1).min(x.len()));
        let sum = |i: usize| sums.get(i).copied().unwrap_or(0.0);
        (sum(to) - sum(from)) / (to - from) as f64
    };
    (0..x.len()).map(mean).collect()
}

fn mean_magnitude(x: &[f64]) -> f64 {
    x.iter().map(|v| v.abs()).sum::<f64>() / x.len() as f64
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

fn largest(x: &[f64]) -> f64 {
    x.iter().map(|v| v.abs()).fold(0.0, f64::max)
}

pub(super) fn figure_3(seed: u64) -> Result<Plate> {
    let steep = run(&Drift::over(4.0, 1.0, SHORT_RUN_S), seed)?;
    let noisy = run(&Drift::over(1.0, 10.0, SHORT_RUN_S), seed)?;
    let panel = |name: &str, colour, signals: &Signals, mu_max: f64| {
        let mean = vec![(0.0, 0.0), (SHORT_RUN_S, mu_max)];
        over_time(
            "added to y",
            vec![signal(name, colour, &signals.added), Layer::line("\u{3bc}(t)", Colour::Black, mean)],
        )
    };
    let figure = Figure::stacked(
        "Figure 3: the injected drift, \u{3bc}(t) + \u{3c3}(t) N(0, 1)",
        vec![
            panel("\u{3bc}_max = 4, \u{3c3}_growth = 1", Colour::Blue, &steep, 4.0),
            panel("\u{3bc}_max = 1, \u{3c3}_growth = 10", Colour::Vermilion, &noisy, 1.0),
        ],
    );
    let shows = "The signal that the simulator adds to y: a steep drift with little noise growth above, a milder drift \
                 with much noise growth below. Here the standard deviation reaches sigma_growth at the end."
        .into();
    let published = "Same two settings, same picture: trend and scatter are set independently. The paper's axes are not \
                     known to us, so the scale of sigma_growth is the formula's; see Table 1 for the scale that its numbers imply."
        .into();
    Ok(Plate { file: "fig03.svg", name: "Figure 3", figure, shows, published })
}

fn tracking(title: &str, signals: &Signals) -> Figure {
    Figure::stacked(
        title,
        vec![
            over_time(
                "r, y",
                vec![
                    signal("reference r", Colour::Orange, &signals.r),
                    signal("measured output y", Colour::Blue, &signals.y),
                ],
            ),
            over_time(
                "e = r \u{2212} y",
                vec![
                    signal("raw", Colour::Sky, &signals.e),
                    signal("filtered", Colour::Black, &filtered(&signals.e)),
                ],
            ),
        ],
    )
}

pub(super) fn figure_4(seed: u64) -> Result<Plate> {
    let signals = run(&Drift::over(0.0, 0.0, SHORT_RUN_S), seed)?;
    let shows = format!(
        "Nominal run: the reference takes a new value every 0.05 s, y follows within a few ms, e spikes at every step \
         (mean |e| {:.4}, largest |r| {:.2}).",
        mean_magnitude(&signals.e),
        largest(&signals.r)
    );
    let published = "As described: a permanent transient, the error oscillates violently at every step. The paper's \
                     remark that an amplitude of 10 is more than five times the largest reference means a largest |r| \
                     below 2, which N(0.1, 1) exceeds in any 200 draws: its reference is smaller than it states, or the \
                     remark is loose."
        .into();
    let figure = tracking("Figure 4: nominal run", &signals);
    Ok(Plate { file: "fig04.svg", name: "Figure 4", figure, shows, published })
}

pub(super) fn figure_6(seed: u64) -> Result<Plate> {
    let nominal = run(&Drift::over(0.0, 0.0, SHORT_RUN_S), seed)?;
    let signals = run(&Drift::over(NON_NOMINAL_MU, 0.0, SHORT_RUN_S), seed)?;
    let shows = format!(
        "The same with a drift of 10 over the 10 s: mean |e| goes from {:.4} to {:.4}, mean e from {:.4} to {:.4}.",
        mean_magnitude(&nominal.e),
        mean_magnitude(&signals.e),
        mean(&nominal.e),
        mean(&signals.e),
    );
    let published = "To the eye as described: the error looks like Figure 4's. Its mean magnitude does change, and not \
                     marginally: a drift of 1/s offsets e by that rate over the loop's velocity gain (K_i times the plant's \
                     gain at rest, 4.95/s), which the spikes hide."
        .into();
    let figure = tracking("Figure 6: run with \u{3bc}_max = 10", &signals);
    Ok(Plate { file: "fig06.svg", name: "Figure 6", figure, shows, published })
}

pub(super) fn figure_7(seed: u64) -> Result<Plate> {
    let signals = run(&Drift::over(NON_NOMINAL_MU, 0.0, SHORT_RUN_S), seed)?;
    let smooth = filtered(&signals.u);
    let second = (1.0 / SAMPLE_TIME_S) as usize;
    let (first, last) = (signals.u.get(..second), signals.u.get(signals.u.len() - second..));
    let shows = format!(
        "u of the same run, raw and filtered, and what is added to y. The mean of u goes from {:.1} in the first second \
         to {:.1} in the last; single steps of the reference cost up to {:.0}.",
        first.map_or(f64::NAN, mean),
        last.map_or(f64::NAN, mean),
        largest(&signals.u),
    );
    let published =
        "As described: u shows the drift that e hides. The sign follows from the drift's: y reads too high, \
                     the controller pulls it down."
            .into();
    let figure = Figure::stacked(
        "Figure 7: control action with \u{3bc}_max = 10",
        vec![
            over_time(
                "u",
                vec![signal("raw", Colour::Sky, &signals.u), signal("filtered", Colour::Black, &smooth)],
            ),
            over_time("u, filtered", vec![signal("", Colour::Black, &smooth)]),
            over_time("added to y", vec![signal("", Colour::Vermilion, &signals.added)]),
        ],
    );
    Ok(Plate { file: "fig07.svg", name: "Figure 7", figure, shows, published })
}
