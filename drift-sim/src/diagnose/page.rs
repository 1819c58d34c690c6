//! The diagnosis as a page for people: one HTML file that needs nothing else, charts within.

use crate::control_loop::Loop;
use crate::physics::Place;
use crate::plot::{Colour, Figure, Layer, Marker, Panel};
use crate::simulate::Trace;
use crate::{Result, physics};

use super::signals::{Signals, deviation};
use super::{Diagnosis, Verdict, features, prove};

/// Bins of a curve against speed or position.
const BINS: usize = 40;
/// Points shown of a cloud.
const POINTS: usize = 4000;

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#111;background:#fff}\
h1{font-size:1.6rem}h2{font-size:1.2rem;margin-top:2.2rem}table{border-collapse:collapse;width:100%}\
th,td{text-align:left;padding:.3rem .6rem;border-bottom:1px solid #ddd;vertical-align:top}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}\
.verdict{font-size:1.15rem;border-left:4px solid #0072b2;padding:.4rem 1rem}svg{max-width:100%;height:auto}details{margin:.6rem 0}p.note{color:#555}";

/// The whole page. `train` is what the numbers come from, `shown` the recording whose runs are drawn (the hold-out where
/// there is one).
///
/// # Errors
/// A chart can't be drawn.
pub fn html(
    found: &Diagnosis,
    nominal: &Loop,
    train: &Signals,
    shown: &Signals,
    name: &str,
) -> Result<String> {
    let mut body = format!("<h1>Diagnosis of {}</h1>", escaped(name));
    body += &format!("<p class=\"verdict\">{}</p>", escaped(&sentence(found, nominal)));
    body += &physics_table(found, nominal);
    body += &fits(found);
    body += &runs(found, nominal, shown)?;
    body += &drive(found, nominal, train)?;
    body += &parameters(found);
    body += &rivals(found);
    body += &untold(found);
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
         <title>Diagnosis of {}</title><style>{STYLE}</style></head><body>{body}</body></html>\n",
        escaped(name)
    ))
}

/// Text as it may stand between tags and in attributes.
fn escaped(text: &str) -> String {
    text.chars().fold(String::with_capacity(text.len()), |mut out, c| {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
        out
    })
}

/// The verdict in a sentence or two.
fn sentence(found: &Diagnosis, nominal: &Loop) -> String {
    let units = nominal.unit_names();
    let gain = match (found.holdout.before, found.holdout.after) {
        (Some(a), Some(b)) => match (a.u_pct, b.u_pct) {
            (Some(a), Some(b)) => format!(" On unseen data the fit of u goes from {a:.1} % to {b:.1} %."),
            _ => format!(" On unseen data the fit of y goes from {:.1} % to {:.1} %.", a.y_pct, b.y_pct),
        },
        _ => String::new(),
    };
    match found.verdict {
        Verdict::NoMismatch => {
            "The model explains the recording; nothing is missing that it could show.".into()
        }
        Verdict::Parameters => {
            format!("The model is right, its numbers are not: refitted, it explains the recording.{gain}")
        }
        Verdict::Located => format!(
            "Something is missing at the {}, but this recording can't tell what.",
            found.place.map_or("loop", Place::name)
        ),
        Verdict::MissingPhysics => {
            found.physics.iter().map(|p| p.term.says(&units)).collect::<Vec<_>>().join(" ") + &gain
        }
    }
}

fn physics_table(found: &Diagnosis, nominal: &Loop) -> String {
    if found.physics.is_empty() {
        return String::new();
    }
    let units = nominal.unit_names();
    let mut rows = String::new();
    for named in &found.physics {
        for ((p, value), width) in
            named.term.kind.parameters.iter().zip(&named.term.parameters).zip(&named.half_widths)
        {
            let interval = if width.is_finite() {
                format!("{} to {}", number(value - width), number(value + width))
            } else {
                "not determined, or held".into()
            };
            rows += &row(&[
                &escaped(named.term.kind.name),
                named.term.kind.place.name(),
                p.name,
                &number(*value),
                &escaped(&units.unit(p.unit)),
                &interval,
            ]);
        }
    }
    let onsets: String = found
        .physics
        .iter()
        .filter(|p| p.term.onset_s > 0.0)
        .map(|p| format!("<p>{} begins at {} s.</p>", escaped(p.term.kind.name), number(p.term.onset_s)))
        .collect();
    let spans: String = found
        .physics
        .iter()
        .filter(|p| !p.term.spans.is_empty())
        .map(|p| {
            let list: Vec<String> =
                p.term.spans.iter().map(|(a, b)| format!("{} to {}", number(*a), number(*b))).collect();
            format!(
                "<details><summary>{} acts {} times</summary><p>{} s</p></details>",
                escaped(p.term.kind.name),
                list.len(),
                list.join(", ")
            )
        })
        .collect();
    section(
        "Missing physics",
        &table(&["physics", "place", "parameter", "value", "unit", "95 % interval"], &rows),
    ) + &onsets
        + &spans
}

fn fits(found: &Diagnosis) -> String {
    let mut rows = String::new();
    for (part, fits) in [("training", &found.train), ("unseen", &found.holdout)] {
        for (name, fit) in
            [("as it came", fits.nominal), ("own numbers refitted", fits.before), ("improved", fits.after)]
        {
            let Some(fit) = fit else { continue };
            let u = fit.u_pct.map_or_else(|| "unknown law".into(), |u| format!("{u:.2} %"));
            rows += &row(&[part, name, &format!("{:.3} %", fit.y_pct), &u]);
        }
    }
    if let Some(floor) = found.noise_floor {
        let u = floor.u_pct.map_or_else(|| "unknown law".into(), |u| format!("{u:.2} %"));
        rows += &row(&["unseen", "noise alone leaves", &format!("{:.3} %", floor.y_pct), &u]);
    }
    let interval = found.improvement.map_or_else(String::new, |[a, b]| {
        format!("<p>On unseen data the physics improves the fit by {a:.2} to {b:.2} points (95 %).</p>")
    });
    section("How well the simulated loop fits", &(table(&["data", "model", "y", "u"], &rows) + &interval))
}

/// r, y and u of the closed loop, measured and simulated.
fn runs(found: &Diagnosis, nominal: &Loop, signals: &Signals) -> Result<String> {
    let (before, after) = (prove::run(&found.refitted, signals, 0), prove::run(&found.improved, signals, 0));
    let line = |name: &str, colour, x: &[f64]| {
        Layer::signal(name, colour, signals.start_s, signals.sample_time_s, x)
    };
    let part = |trace: &Option<Trace>, of: fn(&Trace) -> &Vec<f64>| trace.as_ref().map(|t| of(t).clone());
    let both = |of: fn(&Trace) -> &Vec<f64>, measured: &[f64]| {
        let mut layers = vec![line("measured", Colour::Grey, measured)];
        for (name, colour, trace) in [("before", Colour::Vermilion, &before), ("after", Colour::Blue, &after)]
        {
            layers.extend(part(trace, of).map(|x| line(name, colour, &x)));
        }
        layers
    };
    let error = |trace: &Option<Trace>| {
        part(trace, |t| &t.y).map(|y| signals.y.iter().zip(&y).map(|(a, b)| a - b).collect::<Vec<f64>>())
    };
    let mut wrong = Vec::new();
    for (name, colour, trace) in [("before", Colour::Vermilion, &before), ("after", Colour::Blue, &after)] {
        wrong.extend(error(trace).map(|e| line(name, colour, &e)));
    }
    let units = nominal.unit_names();
    let label = |what: &str, unit: &str| format!("{what} / {unit}");
    let mut reference = vec![line("r", Colour::Green, &signals.r)];
    reference.extend(both(|t| &t.y, &signals.y));
    let panels = vec![
        Panel { y_label: label("r, y", &units.y), layers: reference, ..Panel::default() },
        Panel { y_label: label("error of y", &units.y), layers: wrong, ..Panel::default() },
        Panel {
            x_label: "t / s".into(),
            y_label: label("u", &units.u),
            layers: both(|t| &t.u, &signals.u),
            ..Panel::default()
        },
    ];
    Ok(section("Measured and simulated", &Figure::stacked("", panels).to_svg()?))
}

/// The missing drive against time, and against what friction, springs and pitches depend on.
fn drive(found: &Diagnosis, nominal: &Loop, train: &Signals) -> Result<String> {
    let Some(missing) = &found.missing_drive else { return Ok(String::new()) };
    let units = nominal.unit_names();
    let label = format!("missing drive / {}", units.drive);
    let line =
        |name: &str, colour, x: &[f64]| Layer::signal(name, colour, train.start_s, train.sample_time_s, x);
    let mut layers = vec![line("before", Colour::Vermilion, &missing.value)];
    if let Some(left) = &found.drive_left {
        layers.push(line("left after", Colour::Blue, &left.value));
    }
    let time = Panel { x_label: "t / s".into(), y_label: label.clone(), layers, ..Panel::default() };
    let (position, speed) = features::motion(nominal, train);
    let explained: Option<Vec<f64>> = found
        .drive_left
        .as_ref()
        .map(|left| missing.value.iter().zip(&left.value).map(|(a, b)| a - b).collect());
    let against = |x: &[f64], x_label: String| {
        let step = (x.len() / POINTS).max(1);
        let cloud = x.iter().zip(&missing.value).step_by(step).map(|(x, d)| (*x, *d)).collect();
        let mut layers = vec![Layer::points("before", Colour::Grey, Marker::Dot, cloud)];
        layers.extend(explained.as_ref().map(|d| Layer::line("explained", Colour::Blue, binned(x, d))));
        Panel { x_label, y_label: label.clone(), layers, ..Panel::default() }
    };
    let charts = Figure::single(time).to_svg()?
        + &Figure::grid(
            "",
            2,
            vec![
                against(&speed, format!("speed / {}", units.unit("{speed}"))),
                against(&position, format!("position / {}", units.unit("{position}"))),
            ],
        )
        .to_svg()?;
    let note = format!(
        "<p class=\"note\">What the recorded motion needed beyond what the refitted model applied; standard deviation {} {}.</p>",
        number(missing.deviation),
        escaped(&units.drive)
    );
    Ok(section("The missing drive", &(note + &charts)))
}

/// Mean of y in bins of equal width over x, empty ones left out.
fn binned(x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    let known = || x.iter().copied().filter(|x| x.is_finite());
    let (low, high) = known().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
    if deviation(x) == 0.0 || high <= low {
        return Vec::new();
    }
    let mut bins = vec![(0.0, 0.0, 0.0); BINS];
    for (x, y) in x.iter().zip(y).filter(|(x, y)| x.is_finite() && y.is_finite()) {
        let at = ((x - low) / (high - low) * BINS as f64) as usize;
        if let Some(bin) = bins.get_mut(at.min(BINS - 1)) {
            *bin = (bin.0 + x, bin.1 + y, bin.2 + 1.0);
        }
    }
    bins.into_iter().filter(|b| b.2 > 0.0).map(|(x, y, n)| (x / n, y / n)).collect()
}

fn parameters(found: &Diagnosis) -> String {
    let mut rows = String::new();
    for p in &found.parameters {
        let interval = if p.half_width.is_finite() {
            format!("{} to {}", number(p.value - p.half_width), number(p.value + p.half_width))
        } else {
            "not determined".into()
        };
        rows += &row(&[&escaped(&p.name), &number(p.nominal), &number(p.value), &interval]);
    }
    if rows.is_empty() {
        return String::new();
    }
    section("The model's own numbers", &table(&["parameter", "as given", "fitted", "95 % interval"], &rows))
}

fn rivals(found: &Diagnosis) -> String {
    let rows: String = found.rejected.iter().map(|r| row(&[&escaped(r.kind), &escaped(&r.why)])).collect();
    if rows.is_empty() {
        return String::new();
    }
    section("Rivals, and why they lost", &table(&["physics", "why not"], &rows))
}

/// What this recording can't tell, and what would.
fn untold(found: &Diagnosis) -> String {
    let ties: String = found
        .physics
        .iter()
        .filter(|p| !p.tied.is_empty())
        .map(|p| {
            format!(
                "<p>{} can't be told from {}. {}</p>",
                escaped(p.term.kind.name),
                escaped(&p.tied.join(", ")),
                escaped(p.term.kind.experiment)
            )
        })
        .collect();
    let rows: String = found.untestable.iter().map(|r| row(&[&escaped(r.kind), &escaped(&r.why)])).collect();
    let needs: String = found
        .untestable
        .iter()
        .filter_map(|r| physics::Kind::named(r.kind).ok())
        .map(|kind| row(&[kind.name, kind.excitation]))
        .collect();
    let needs = format!(
        "<details><summary>What would show them</summary>{}</details>",
        table(&["physics", "needs"], &needs)
    );
    section("What can't be told", &(ties + &table(&["physics", "why"], &rows) + &needs))
}

fn section(title: &str, content: &str) -> String {
    format!("<h2>{title}</h2>{content}")
}

fn table(head: &[&str], rows: &str) -> String {
    let head: String = head.iter().map(|h| format!("<th>{h}</th>")).collect();
    format!("<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>")
}

fn row(cells: &[&str]) -> String {
    let cells: String = cells.iter().map(|c| format!("<td>{c}</td>")).collect();
    format!("<tr>{cells}</tr>")
}

/// Four digits, in powers of ten where that is shorter.
fn number(x: f64) -> String {
    if x == 0.0 || (1e-3..1e6).contains(&x.abs()) { format!("{x:.4}") } else { format!("{x:.3e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_from_files_stay_text() {
        assert_eq!(escaped("<script>\"a\" & 'b'"), "&lt;script&gt;&quot;a&quot; &amp; &#39;b&#39;");
    }

    #[test]
    fn bins_hold_means() {
        let x: Vec<f64> = (0..1000).map(|i| f64::from(i) / 100.0).collect();
        let y: Vec<f64> = x.iter().map(|x| 2.0 * x).collect();
        assert!(binned(&x, &y).iter().all(|(x, y)| (y - 2.0 * x).abs() < 1e-9));
    }
}
