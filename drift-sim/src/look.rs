//! A file at a glance, in words and three small charts: as a screen that fits a terminal of 80 columns, with the command to type next, and
//! piece by piece for a page.

use std::fmt::Write;

use crate::plot::terminal::{mean, range, row, stretches};
use crate::plot::{Colour, Figure, Layer, Panel};
use crate::recording::{Overview, Span};
use crate::sentences::{Clock, percent, typed_to};
use crate::terminal::Terminal;

/// Columns that are listed by name.
const NAMES_SHOWN: usize = 12;
/// Stretches that are listed.
const SPANS_SHOWN: usize = 3;

/// The screen; `next` is what the user typed behind `drift look`, for the next command.
pub fn screen(seen: &Overview, next: &str, terminal: &Terminal) -> String {
    let mut text = String::new();
    // Writing to a String can't fail.
    let _ = write_screen(&mut text, seen, next, terminal);
    text
}

fn write_screen(out: &mut String, seen: &Overview, next: &str, terminal: &Terminal) -> std::fmt::Result {
    let item = |out: &mut String, (name, text): &(&str, String)| item(out, name, text, terminal);
    writeln!(out, "{}", printable(&seen.name))?;
    about(seen).iter().try_for_each(|fact| item(out, fact))?;
    for note in &seen.notes {
        item(out, &("", note.clone()))?;
    }
    writeln!(out)?;
    for (name, values) in [("r", &seen.r), ("y", &seen.y), ("u", &seen.u)] {
        chart(out, name, values, terminal)?;
    }
    writeln!(out)?;
    stretches_of(seen).iter().try_for_each(|fact| item(out, fact))?;
    if let Some(lacks) = &seen.lacks {
        item(out, &("but", lacks.clone()))?;
        return writeln!(out, "\nnext: drift look {} --columns {}", without_columns(next), seen.example);
    }
    if let Some(Err(error)) = &seen.sampling {
        item(out, &("but", error.to_string()))?;
    }
    writeln!(out, "\nnext: drift init {} -o loop.toml", next_arguments(seen, next))
}

/// Format, length, sampling, gaps and columns: a name and what there is to say of each.
pub fn about(seen: &Overview) -> Vec<(&'static str, String)> {
    let (first, last) = (seen.t_s.first().copied().unwrap_or(0.0), seen.t_s.last().copied().unwrap_or(0.0));
    let rows = seen.t_s.len();
    let about = format!("{}, {}, {}", seen.format, counted(rows, "row"), counted(seen.names.len(), "column"));
    let mut facts = vec![
        ("file", format!("{about}; {} from {}", lasting(last - first), at(seen, first))),
        ("sampling", sampling(seen)),
    ];
    if !seen.gaps.is_empty() {
        let longest = seen.gaps.iter().copied().reduce(|a, b| if b.length_s > a.length_s { b } else { a });
        let longest = longest.map_or_else(String::new, |gap| {
            format!(", the longest of {} after {}", lasting(gap.length_s), at(seen, gap.from_s))
        });
        facts.push(("gaps", format!("{}{longest}", seen.gaps.len())));
    }
    facts.push(("columns", columns(seen)));
    facts
}

/// The clock of the recording.
fn clock(seen: &Overview) -> Clock {
    let (first, last) = (seen.t_s.first().copied().unwrap_or(0.0), seen.t_s.last().copied().unwrap_or(0.0));
    Clock::new(seen.zero_s, last - first)
}

/// A time of the recording: its date, where it has one.
fn at(seen: &Overview, t_s: f64) -> String {
    match seen.zero_s {
        Some(_) => clock(seen).says(t_s),
        None => format!("t = {} s", short(t_s)),
    }
}

/// Stretches by hand, and those in which u stays at an end: a name and what there is to say of each.
pub fn stretches_of(seen: &Overview) -> Vec<(&'static str, String)> {
    let mut facts = vec![("manual", spans(&seen.manual, seen))];
    let (low, high) = range(&seen.u);
    for (what, value, at) in [("lowest", low, &seen.at_limit[0]), ("highest", high, &seen.at_limit[1])] {
        if !at.is_empty() {
            let of = spans(at, seen);
            facts.push(("limit", format!("u stays at its {what} value, {}: {of}", short(value))));
        }
    }
    facts
}

/// r and y over u, with the stretches by hand; no panel where no column seems to be one of them.
pub fn figure(seen: &Overview) -> Figure {
    let clock = clock(seen);
    let line = |name: &str, colour, values: &[f64]| {
        let points = seen.t_s.iter().map(|t| clock.axis(*t)).zip(values.iter().copied());
        Layer::line(name, colour, points.filter(|(_, value)| !value.is_nan()).collect())
    };
    let by_hand = seen.manual.iter().enumerate().map(|(i, span)| Layer::Span {
        from: clock.axis(span.from_s),
        to: clock.axis(span.to_s),
        name: if i == 0 { "not closed".into() } else { String::new() },
        colour: Colour::Yellow,
    });
    let there = |values: &[f64]| values.iter().any(|value| !value.is_nan());
    let [r, y, u] = seen.columns.labels();
    let mut shown = vec![("r", r, Colour::Green, &seen.r), ("y", y, Colour::Blue, &seen.y)];
    shown.retain(|(_, _, _, values)| there(values));
    let mut panels = Vec::new();
    if !shown.is_empty() {
        let y_label = shown.iter().map(|(_, label, _, _)| label.as_str()).collect::<Vec<_>>().join(" and ");
        let lines = shown.iter().map(|(name, _, colour, values)| line(name, *colour, values));
        panels.push(Panel { y_label, layers: by_hand.chain(lines).collect(), ..Panel::default() });
    }
    if there(&seen.u) {
        let layers = vec![line("u", Colour::Vermilion, &seen.u)];
        panels.push(Panel { y_label: u, layers, ..Panel::default() });
    }
    if let Some(lowest) = panels.last_mut() {
        lowest.x_label = clock.label().into();
    }
    for panel in &mut panels {
        panel.x_dates = clock.zero_s.is_some();
    }
    Figure::stacked("", panels)
}

/// The step to put uneven rows on a grid with, s, as the reader that refused them suggests it.
pub fn suggested_step(seen: &Overview) -> Option<String> {
    let said = seen.sampling.as_ref()?.as_ref().err()?.to_string();
    said.rsplit_once("--resample ").map(|(_, step)| step.to_owned())
}

/// What was typed, without the columns that it named.
fn without_columns(typed: &str) -> String {
    let mut words = typed.split(' ');
    let mut kept = Vec::new();
    while let Some(word) = words.next() {
        match word {
            "--columns" => skip_value(words.next().unwrap_or_default(), &mut words),
            word => match word.strip_prefix("--columns=") {
                Some(value) => skip_value(value, &mut words),
                None => kept.push(word),
            },
        }
    }
    kept.join(" ")
}

/// Goes behind a value that begins with this word: one in quotes may hold blanks.
fn skip_value<'a>(first: &str, words: &mut impl Iterator<Item = &'a str>) {
    let Some(quote) = first.chars().next().filter(|c| ['\'', '"'].contains(c)) else { return };
    if first.len() < 2 || !first.ends_with(quote) {
        words.find(|word| word.ends_with(quote));
    }
}

/// Whether the reader refused rows that repeat a time stamp with other values.
fn is_repeated(seen: &Overview) -> bool {
    let refused = seen.sampling.as_ref().and_then(|sampling| sampling.as_ref().err());
    refused.is_some_and(|error| error.to_string().contains("; --repeated "))
}

/// What reads the recording: with the mean of the rows that repeat a time stamp, or a step to resample by where its rows are uneven.
fn next_arguments(seen: &Overview, typed: &str) -> String {
    if is_repeated(seen) {
        return format!("{typed} --repeated mean");
    }
    suggested_step(seen).map_or_else(|| typed.to_owned(), |step| format!("{typed} --resample {step}"))
}

fn sampling(seen: &Overview) -> String {
    let mut text = match (&seen.jitter, seen.sampling.as_ref()) {
        (_, Some(Ok(sample_time_s))) => format!("every {} s, uniform", short(*sample_time_s)),
        (Some(jitter), _) => format!("about every {} s, not uniform", short(jitter.interval_s)),
        (None, _) => "no time passes".into(),
    };
    if let Some(jitter) = seen.jitter.filter(|jitter| jitter.max_s > 1e-9 * jitter.interval_s) {
        text += &format!("; jitter {} s rms, {} s at most", short(jitter.rms_s), short(jitter.max_s));
    }
    if seen.repeated > 0 {
        text += &format!("; {} at the time of the one before", counted(seen.repeated as usize, "row"));
    }
    text
}

fn columns(seen: &Overview) -> String {
    let map = &seen.columns;
    let of = |letter: &str, name: &str| {
        if name.is_empty() { format!("no {letter}") } else { format!("{letter} = '{}'", printable(name)) }
    };
    let t = map.t.as_deref().unwrap_or_default();
    // The date and the time of the day, where they are two columns.
    let date_and_time = t.split_once('+').filter(|_| !seen.names.iter().any(|name| name == t));
    let (date, time) = date_and_time.unwrap_or(("", t));
    let used = [date, time, &map.r, &map.y, &map.u];
    let others: Vec<&str> = seen
        .names
        .iter()
        .map(String::as_str)
        .filter(|name| !used.contains(name) && !name.is_empty())
        .collect();
    // Dates may stand in a column without a name.
    let time = if map.t.as_deref() == Some("") { "t in a column without a name".into() } else { of("t", t) };
    let mut text = [time, of("r", &map.r), of("y", &map.y), of("u", &map.u)].join(", ");
    if !others.is_empty() {
        let shown: Vec<String> = others.iter().take(NAMES_SHOWN).map(|name| printable(name)).collect();
        let more = others.len().saturating_sub(NAMES_SHOWN);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        text += &format!("; not used: {}{more}", shown.join(", "));
    }
    text
}

fn chart(out: &mut String, name: &str, values: &[f64], terminal: &Terminal) -> std::fmt::Result {
    let means = stretches(values, terminal.chart_columns(), mean);
    let (low, high) = range(values);
    let missing = values.iter().filter(|value| value.is_nan()).count();
    if missing == values.len() {
        let taken = match name {
            "r" => "not recorded: the controller is taken to hold one value",
            _ => "no column: say which one it is, as below",
        };
        return item(out, name, taken, terminal);
    }
    let missing = if missing > 0 { format!(", {missing} missing") } else { String::new() };
    let (means, said) = if is_constant(low, high) {
        // The mean of equal numbers is rounded, which would be drawn as if it were a signal.
        let flat = means.iter().map(|mean| if mean.is_nan() { f64::NAN } else { low });
        (flat.collect(), format!("constant {}", short(low)))
    } else {
        (means, ends(low, high))
    };
    writeln!(out, "{name:<9} {}  {said}{missing}", row(&means, range(&means), terminal.signs))
}

/// A part of a value by which the same number differs that was computed in two ways.
const ROUNDING: f64 = 1e-12;

fn is_constant(low: f64, high: f64) -> bool {
    high - low <= ROUNDING * low.abs().max(high.abs())
}

/// The least and the greatest value, with as many digits as it takes to tell them apart.
fn ends(low: f64, high: f64) -> String {
    let with = |digits: usize| [low, high].map(|x| typed_to(x, digits));
    let apart = (DIGITS..MOST_DIGITS).map(with).find(|[low, high]| low != high);
    let [low, high] = apart.unwrap_or_else(|| with(MOST_DIGITS));
    format!("{low} .. {high}")
}

fn spans(spans: &[Span], seen: &Overview) -> String {
    if spans.is_empty() {
        return "no stretch".into();
    }
    let count: usize = spans.iter().map(|span| span.rows).sum();
    let mut longest = spans.to_vec();
    longest.sort_by_key(|span| std::cmp::Reverse(span.rows));
    longest.truncate(SPANS_SHOWN);
    let span = |span: &Span| match seen.zero_s {
        Some(_) => clock(seen).span(span.from_s, span.to_s),
        None => format!("{} to {} s", short(span.from_s), short(span.to_s)),
    };
    let list: Vec<String> = longest.iter().map(span).collect();
    let more = if spans.len() > SPANS_SHOWN { ", the longest" } else { "" };
    let share = 100.0 * count as f64 / seen.t_s.len() as f64;
    format!("{} of the rows, {}{more} {}", percent(share), counted(spans.len(), "stretch"), list.join(", "))
}

/// A line with its name before it.
fn item(out: &mut String, name: &str, text: &str, terminal: &Terminal) -> std::fmt::Result {
    write!(out, "{}", terminal.wrapped(&format!("{name:<10}"), text))
}

fn counted(count: usize, what: &str) -> String {
    match (count, what) {
        (1, _) => format!("1 {what}"),
        (_, "stretch") => format!("{count} stretches"),
        _ => format!("{count} {what}s"),
    }
}

/// A time as a person says it.
fn lasting(seconds: f64) -> String {
    for (unit, length) in [("days", 86_400.0), ("h", 3600.0), ("min", 60.0)] {
        if seconds >= 2.0 * length {
            return format!("{} {unit}", short(seconds / length));
        }
    }
    format!("{} s", short(seconds))
}

/// Significant digits, mostly, and where two numbers are to be told apart.
const DIGITS: usize = 4;
const MOST_DIGITS: usize = 15;

/// Four significant digits without zeros at the end.
fn short(x: f64) -> String {
    typed_to(x, DIGITS)
}

/// Names come from the file: a control code in them must not reach the terminal.
fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::without_columns;

    #[test]
    fn columns_that_were_typed_are_left_out() {
        for (typed, kept) in [
            ("a.csv", "a.csv"),
            ("a.csv --columns y=PV --resample 1", "a.csv --resample 1"),
            ("--columns 't=Zeit s,y=P V' a.csv", "a.csv"),
            ("--columns='y=P V' a.csv", "a.csv"),
            ("--columns=y=PV a.csv --columns", "a.csv"),
        ] {
            assert_eq!(without_columns(typed), kept, "{typed}");
        }
    }
}
