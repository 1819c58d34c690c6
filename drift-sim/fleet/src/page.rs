//! The plant on one page: a line a loop, with a small picture, sortable, each with a link to its own report. One HTML file that needs nothing
//! else, with the style of all of drift's reports. And the same as a screen of text.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use drift_sim::report::STYLE;
use drift_sim::sentences::plain;

use crate::baselines::file_stem;
use crate::costs;
use crate::loop_run::Reports;
use crate::verdict::{STATUSES, Verdict};

/// Loops on the screen at most; the page has them all.
const SHOWN: usize = 20;
/// Size of a picture, pixels.
const PICTURE: (f64, f64) = (120.0, 26.0);
/// A picture's ends, sigmas: what lies beyond is drawn at the edge.
const SIGMAS: f32 = 8.0;

/// The folder of the loops' own pages: `plant.html` has `plant_loops/` beside it.
pub fn reports_folder(page: &Path) -> PathBuf {
    let stem = page.file_stem().map_or_else(|| "report".into(), |stem| stem.to_string_lossy());
    page.with_file_name(format!("{stem}_loops"))
}

/// The page; `reports` are those of single loops, `command` is the command line.
pub fn html(loops: &[(String, Verdict)], path: &Path, reports: Option<&Reports>, command: &str) -> String {
    let mut page = String::from("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n");
    page += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
    let _ = write!(
        page,
        "<title>{} loops</title>\n<style>{STYLE}{OWN_STYLE}</style></head>\n<body>\n",
        loops.len()
    );
    let _ = writeln!(page, "<h1>{}</h1>", escape(&answer(loops)));
    page += "<p class=\"also\">";
    page += &escape(&counts(loops).join(", "));
    page += "</p>\n<p class=\"tools\"><label>Loop <input type=\"search\" id=\"find\"></label> <span id=\"left\" class=\"hint\"></span></p>\n";
    page += "<div class=\"wide\" tabindex=\"0\"><table id=\"loops\"><thead><tr>";
    for (name, kind) in HEAD {
        let _ = write!(page, "<th class=\"{kind}\"><button type=\"button\">{name}</button></th>");
    }
    page += "</tr></thead>\n<tbody>\n";
    let folder = reports_folder(path);
    let folder = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    for (name, verdict) in loops {
        let has_page = reports.is_some_and(|reports| has_report(verdict, reports));
        row(&mut page, name, verdict, has_page.then_some(folder.as_str()));
    }
    page += "</tbody></table></div>\n";
    let _ = writeln!(page, "<p class=\"note\">{}</p>", escape(EXPLAINS));
    let _ = write!(
        page,
        "<pre class=\"command\">{}</pre>\n<script>{SCRIPT}</script>\n</body></html>\n",
        escape(command)
    );
    page
}

/// Whether a loop's own page was written.
fn has_report(verdict: &Verdict, reports: &Reports) -> bool {
    let was_away = matches!(verdict.status.as_str(), "drift" | "suspect" | "disturbance");
    verdict.summary.is_some() && (reports.all || was_away)
}

const HEAD: [(&str, &str); 9] = [
    ("loop", "t"),
    ("status", "t"),
    ("distance from healthy", "t"),
    ("farthest, sigma", "n"),
    ("channel", "t"),
    ("error, %", "n"),
    ("effort, %", "n"),
    ("energy, %", "n"),
    ("what", "t"),
];

const EXPLAINS: &str = "Ranked by how severe it is and by what it costs. A cost is what the loop paid beyond (or, below zero, less than) its \
healthy relation while it was away from it, as a share of what the healthy loop would have paid over the whole time: error is the error index, \
effort the mean of u, energy the mean of u squared. The picture shows the residual of the channel that went farthest, from -8 to 8 sigma.";

const OWN_STYLE: &str = "
body { max-width: 90rem; }
#loops th button { font: inherit; color: inherit; background: none; border: 0; padding: 0; cursor: pointer; text-align: inherit; }
#loops th button::after { content: '\\00a0\\2195'; opacity: .5; } #loops th[aria-sort] button::after { opacity: 1; }
#loops th[aria-sort=ascending] button::after { content: '\\00a0\\25b2'; } #loops th[aria-sort=descending] button::after { content: '\\00a0\\25bc'; }
#loops .s { color: var(--ink); font-weight: 600; white-space: nowrap; }
#loops svg { display: block; } #loops polyline { fill: none; stroke: var(--purple); stroke-width: 1.3; } #loops line { stroke: var(--rule); }
.disturbance { --ink: var(--suspect); } .error, .no_baseline, .not_judged { --ink: var(--cant_tell); }
#loops td:nth-child(1), #loops td:nth-child(5) { white-space: nowrap; }
#loops td:nth-child(1) a { display: inline-block; max-width: 16rem; overflow: hidden; text-overflow: ellipsis; vertical-align: bottom; }
#loops tr[hidden] { display: none; }
@media (max-width: 40rem) {
  #loops, #loops tbody { display: block; }
  #loops thead tr { display: flex; flex-wrap: wrap; align-items: baseline; gap: .4rem; padding-bottom: .6rem; }
  #loops thead tr::before { content: 'Sort by'; color: var(--soft); }
  #loops thead th { border: 0; padding: 0; min-width: 0; }
  #loops thead button { border: 1px solid var(--rule); border-radius: 4px; padding: .1rem .5rem; font-weight: normal; }
  #loops tbody tr { display: grid; grid-template-columns: repeat(6, 1fr); padding: .6rem 0; border-top: 1px solid var(--rule); }
  #loops td { border: 0; padding: 0; text-align: left; grid-column: span 3; } #loops td:empty { display: none; }
  #loops td:nth-child(3) { grid-column: 1 / 4; grid-row: 2 / span 2; padding-top: .3rem; }
  #loops td:nth-child(4), #loops td:nth-child(5) { grid-column: 4 / 7; }
  #loops td:nth-child(n+6) { grid-column: span 2; } #loops td:last-child { grid-column: 1 / 7; grid-row: 4; padding-top: .3rem; }
  #loops td:nth-child(n+6):nth-child(-n+8) { color: var(--soft); grid-row: 5; }
  #loops td:nth-child(4)::after { content: ' sigma'; } #loops td:nth-child(6)::before { content: 'error '; }
  #loops td:nth-child(7)::before { content: 'effort '; } #loops td:nth-child(8)::before { content: 'energy '; }
  #loops td:nth-child(n+6):nth-child(-n+8)::after { content: ' %'; }
}
input { font: inherit; color: var(--text); background: var(--panel); border: 1px solid var(--rule); border-radius: 4px; padding: .1rem .5rem; }
";

/// Sorts by the column that is clicked, by its cells' keys; finds loops by a part of their names.
const SCRIPT: &str = "
const body = document.querySelector('#loops tbody'), heads = [...document.querySelectorAll('#loops th')];
const key = (row, i) => { const c = row.cells[i], k = c.dataset.k ?? c.textContent; return heads[i].className === 'n' || c.dataset.k ? (k === '' ? -Infinity : +k) : k; };
heads.forEach((head, i) => head.querySelector('button').onclick = () => {
  const up = head.getAttribute('aria-sort') === 'descending';
  heads.forEach(h => h.removeAttribute('aria-sort')); head.setAttribute('aria-sort', up ? 'ascending' : 'descending');
  const rows = [...body.rows].map(r => [key(r, i), r]);
  rows.sort((a, b) => (a[0] < b[0] ? -1 : a[0] > b[0] ? 1 : 0) * (up ? 1 : -1));
  body.append(...rows.map(r => r[1]));
});
const find = document.querySelector('#find'), left = document.querySelector('#left');
find.oninput = () => { let n = 0; const w = find.value.toLowerCase();
  for (const r of body.rows) { r.hidden = !r.cells[0].textContent.toLowerCase().includes(w); n += !r.hidden; }
  left.textContent = w ? n + ' of ' + body.rows.length : ''; };
";

fn row(page: &mut String, name: &str, verdict: &Verdict, folder: Option<&str>) {
    let shown = escape(name);
    let named = match folder {
        Some(folder) => {
            let link = format!("{folder}/{}.html", file_stem(name)).replace('%', "%25");
            format!("<a href=\"{}\">{shown}</a>", escape(&link))
        }
        None => shown,
    };
    let number = |x: Option<f64>| match x.filter(|x| x.is_finite()) {
        Some(x) => format!("<td class=\"n\" data-k=\"{x}\">{}</td>", plain(x, 3)),
        None => "<td class=\"n\" data-k=\"\"></td>".to_owned(),
    };
    let [error, effort, energy] = verdict.costs.map(number);
    let severity = STATUSES.len() - verdict.severity();
    let channel = match (&verdict.channel, &verdict.side) {
        (Some(channel), Some(side)) => format!("{} {side}", channel.replace('_', " ")),
        _ => String::new(),
    };
    let _ = writeln!(
        page,
        "<tr><td>{named}</td><td class=\"s {}\" data-k=\"{severity}\">{}</td><td data-k=\"{}\">{}</td>{}<td>{}</td>{error}{effort}{energy}<td>{}</td></tr>",
        escape(&verdict.status),
        escape(&verdict.status.replace('_', " ")),
        verdict.max_z.unwrap_or(0.0),
        picture(&verdict.picture),
        number(verdict.max_z),
        escape(&channel),
        escape(&verdict.answer)
    );
}

/// A line over the run, and where zero lies.
fn picture(values: &[f32]) -> String {
    if values.is_empty() {
        return String::new();
    }
    let (width, height) = PICTURE;
    let step = width / values.len().max(2) as f64;
    let place = |z: f32| 0.5 * height * (1.0 - f64::from(z.clamp(-SIGMAS, SIGMAS) / SIGMAS) * 0.94);
    let mut points = String::new();
    for (at, z) in values.iter().enumerate().filter(|(_, z)| z.is_finite()) {
        let _ = write!(points, "{:.0},{:.1} ", at as f64 * step, place(*z));
    }
    format!(
        "<svg width=\"{width}\" height=\"{height}\" role=\"img\" aria-label=\"residual over the run\"><line x1=\"0\" x2=\"{width}\" y1=\"{0}\" \
         y2=\"{0}\"/><polyline points=\"{1}\"/></svg>",
        0.5 * height,
        points.trim_end()
    )
}

/// The plant in a sentence.
fn answer(loops: &[(String, Verdict)]) -> String {
    let of = |status: &str| loops.iter().filter(|(_, verdict)| verdict.status == status).count();
    let (drift, suspect, judged) =
        (of("drift"), of("suspect"), loops.iter().filter(|(_, v)| v.summary.is_some()).count());
    let (drifts, is) = (if drift == 1 { "drifts" } else { "drift" }, if suspect == 1 { "is" } else { "are" });
    match (drift, suspect) {
        (0, 0) if judged == 0 => "No loop could be judged.".into(),
        (0, 0) => format!("None of {judged} loops has left its baseline to stay."),
        (0, _) => {
            format!("{suspect} of {judged} loops {is} suspect: away from the baseline when the data end.")
        }
        (_, 0) => format!("{drift} of {judged} loops {drifts}."),
        _ => format!("{drift} of {judged} loops {drifts}, {suspect} {is} suspect."),
    }
}

fn counts(loops: &[(String, Verdict)]) -> Vec<String> {
    let of = |status: &str| loops.iter().filter(|(_, verdict)| verdict.status == status).count();
    let counted = STATUSES.iter().map(|status| (of(status), status.replace('_', " ")));
    counted.filter(|(n, _)| *n > 0).map(|(n, status)| format!("{n} {status}")).collect()
}

/// The plant on a screen: the answer and the loops that come first.
pub fn screen(loops: &[(String, Verdict)]) -> String {
    let mut text = format!("{}\n{}\n\n", answer(loops), counts(loops).join(", "));
    let width = loops.iter().take(SHOWN).map(|(name, _)| name.chars().count()).fold(4, usize::max).min(30);
    let [error, effort, energy] = costs::NAMES;
    let _ = writeln!(
        text,
        "{:<width$}  {:<11} {:>8} {error:>9} {effort:>9} {energy:>9}  what",
        "loop", "status", "farthest"
    );
    let is_news = |verdict: &Verdict| verdict.status != "healthy";
    for (name, verdict) in loops.iter().filter(|(_, verdict)| is_news(verdict)).take(SHOWN) {
        let percent = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{} %", plain(x, 3)));
        let [error, effort, energy] = verdict.costs.map(percent);
        let farthest = verdict.max_z.map_or("-".to_owned(), |z| plain(z, 3));
        let name: String = name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        let status = verdict.status.replace('_', " ");
        let _ = writeln!(
            text,
            "{name:<width$}  {status:<11} {farthest:>8} {error:>9} {effort:>9} {energy:>9}  {}",
            verdict.answer
        );
    }
    let more = loops.iter().filter(|(_, verdict)| is_news(verdict)).count().saturating_sub(SHOWN);
    if more > 0 {
        let _ = writeln!(text, "and {more} more (--report, --json)");
    }
    text
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loops_name_is_text_and_its_link_stays_within_the_folder() {
        let verdict = Verdict { status: "drift".into(), summary: Some("{}".into()), ..Verdict::default() };
        let reports = Reports { folder: "x".into(), all: false, command: String::new() };
        let loops = [("<b>/../x".to_owned(), verdict)];
        let page = html(&loops, Path::new("out/plant.html"), Some(&reports), "drift fleet");
        assert!(page.contains("&lt;b&gt;/../x</a>") && !page.contains("<b>"), "{page}");
        assert!(page.contains("href=\"plant_loops/%253Cb%253E%252F..%252Fx.html\""), "{page}");
    }
}
