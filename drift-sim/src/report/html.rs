//! The page's HTML.

use std::fmt::Write as _;

use super::{Block, Chart, Page, Proof, STYLE, Section, Status, Table, chart_data, escape, picture};
use crate::Result;
use crate::plot::Figure;

const UPLOT_STYLE: &str = include_str!("uplot/uPlot.min.css");
const UPLOT: &str = include_str!("uplot/uPlot.iife.min.js");
const CHARTS: &str = include_str!("charts.js");
/// The heading over what the page is of.
const ABOUT: &str = "About this page";
/// Nothing is loaded from anywhere, not even if some text should become markup.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:";
/// Points of all lines of a page together: about ten characters each.
const MOST_POINTS: usize = 400_000;
/// Points of one line: several for each pixel of a screen.
const MOST_PER_LINE: usize = 32_768;
/// A cell with more bytes holds a sentence.
const SENTENCE: usize = 36;
/// However many lines there are: about one for each pixel.
const LEAST_PER_LINE: usize = 1000;

pub(super) fn write(page: &Page) -> Result<String> {
    let lengths: Vec<usize> = page.sections.iter().flat_map(|s| line_lengths(&s.blocks)).collect();
    let mut writer = Writer::new(longest_line(&lengths));
    writer.answer(page);
    writer.contents(page);
    for (i, section) in page.sections.iter().enumerate() {
        writer.section(i, section)?;
    }
    writer.about(page.sections.len(), page);
    Ok(writer.whole(page))
}

/// The picture for a wide page and for a narrow one; the style sheet shows one of them.
pub(super) fn proof(proof: &Proof, id: &str) -> String {
    let described = format!("{} {}", proof.figure.description(), proof.caption);
    let mut markup = String::from("<figure class=\"proof\">");
    for (size, class, letter) in [(picture::WIDE, "broad", 'w'), (picture::NARROW, "slim", 'n')] {
        // One panel has the room of two.
        let size = match proof.figure.panels.len() {
            1 => picture::Size { panel_height: 1.6 * size.panel_height, ..size },
            _ => size,
        };
        let svg = picture::svg(&proof.figure, size, &format!("{id}{letter}"), &proof.title, &described);
        markup += &format!("<div class=\"{class}\">{svg}</div>");
    }
    markup + &format!("<figcaption>{}</figcaption></figure>\n", escape::text(&proof.caption))
}

pub(super) fn first_screen(page: &Page) -> String {
    let mut writer = Writer::new(MOST_PER_LINE);
    writer.answer(page);
    // Nested in a class, the style reaches nothing of the page around it.
    let style = STYLE.replace(":root", "&").replace("body {", "& {");
    format!("<div class=\"drift-answer\"><style>.drift-answer {{\n{style}}}</style>\n{}</div>\n", writer.body)
}

/// Points of each line of all charts among the blocks.
fn line_lengths(blocks: &[Block]) -> Vec<usize> {
    let of = |block: &Block| match block {
        Block::Chart(chart) => chart_data::line_lengths(&chart.figure).collect(),
        Block::Folded { blocks, .. } => line_lengths(blocks),
        _ => Vec::new(),
    };
    blocks.iter().flat_map(of).collect()
}

/// Points that a line may keep so that all together fit the page; short ones leave their share to the long ones.
fn longest_line(lengths: &[usize]) -> usize {
    let total = |most: usize| lengths.iter().map(|length| length.min(&most)).sum::<usize>();
    let mut most = MOST_PER_LINE;
    while most > LEAST_PER_LINE && total(most) > MOST_POINTS {
        most -= most / 8;
    }
    most
}

struct Writer {
    body: String,
    /// As JSON, in the order of the figures' numbers.
    figures: Vec<String>,
    /// Points of a line at most.
    most: usize,
    /// Pictures so far.
    stills: usize,
}

impl Writer {
    /// Nothing yet; lines keep at most so many points.
    fn new(most: usize) -> Self {
        Self { body: String::new(), figures: Vec::new(), most, stills: 0 }
    }

    /// Adds markup; writing to a String can't fail.
    fn put(&mut self, markup: std::fmt::Arguments<'_>) {
        let _ = self.body.write_fmt(markup);
    }

    /// The first screen.
    fn answer(&mut self, page: &Page) {
        let answer = &page.answer;
        self.body.push_str("<header><p class=\"top\">");
        let (name, word) = (answer.status.name(), escape::text(answer.status.word()));
        self.put(format_args!("<strong class=\"badge {name}\">{}{word}</strong> ", shape(answer.status)));
        let (about, sentence) = (escape::text(&page.about), escape::text(&answer.sentence));
        self.put(format_args!("<span class=\"about\">{about}</span></p>\n<h1>{sentence}</h1>\n"));
        if !answer.also.is_empty() {
            self.put(format_args!("<p class=\"also\">{}</p>\n", escape::text(&answer.also)));
        }
        if !answer.numbers.is_empty() {
            self.body.push_str("<ul class=\"three\">");
            for number in &answer.numbers {
                let [value, label] = [&number.value, &number.label].map(|text| escape::text(&unbroken(text)));
                self.put(format_args!("<li><b>{value}</b><span>{label}</span></li>"));
            }
            self.body.push_str("</ul>\n");
        }
        if let Some(proof) = &page.proof {
            self.body.push_str(&self::proof(proof, "p"));
        }
        self.body.push_str("</header>\n");
    }

    /// The contents, and where the rest begins.
    fn contents(&mut self, page: &Page) {
        self.body.push_str("<nav aria-label=\"Contents\"><ul>");
        for (i, section) in page.sections.iter().enumerate() {
            self.put(format_args!("<li><a href=\"#s{i}\">{}</a></li>", escape::text(&section.title)));
        }
        self.put(format_args!("<li><a href=\"#s{}\">{ABOUT}</a></li>", page.sections.len()));
        self.body.push_str("</ul></nav>\n<main>\n");
    }

    /// What the page is of, and the command line that made it.
    fn about(&mut self, number: usize, page: &Page) {
        self.put(format_args!(
            "<section id=\"s{number}\"><h2>{ABOUT}</h2>\n<p>{}</p>\n",
            escape::text(&page.title)
        ));
        if !page.facts.is_empty() {
            self.body.push_str("<dl>");
            for (name, value) in &page.facts {
                self.put(format_args!("<dt>{}</dt><dd>{}</dd>", escape::text(name), escape::text(value)));
            }
            self.body.push_str("</dl>\n");
        }
        if !page.command.is_empty() {
            self.put(format_args!(
                "<pre class=\"command\"><code>{}</code></pre>\n",
                escape::text(&page.command)
            ));
        }
        self.body.push_str("</section>\n");
    }

    fn section(&mut self, number: usize, section: &Section) -> Result<()> {
        self.put(format_args!("<section id=\"s{number}\"><h2>{}</h2>\n", escape::text(&section.title)));
        section.blocks.iter().try_for_each(|block| self.block(block))?;
        self.body.push_str("</section>\n");
        Ok(())
    }

    fn block(&mut self, block: &Block) -> Result<()> {
        match block {
            Block::Text(text) => self.put(format_args!("<p>{}</p>\n", escape::text(text))),
            Block::Note(text) => self.put(format_args!("<p class=\"note\">{}</p>\n", escape::text(text))),
            Block::List(items) => {
                self.body.push_str("<ul>");
                for item in items {
                    self.put(format_args!("<li>{}</li>", escape::text(item)));
                }
                self.body.push_str("</ul>\n");
            }
            Block::Table(table) => self.table(table),
            Block::Folded { title, blocks } => {
                self.put(format_args!("<details><summary>{}</summary>\n", escape::text(title)));
                blocks.iter().try_for_each(|block| self.block(block))?;
                self.body.push_str("</details>\n");
            }
            Block::Chart(chart) => self.chart(chart)?,
            Block::Picture { figure, caption } => {
                let (wide, narrow) = (
                    self.still(figure, caption, picture::WIDE),
                    self.still(figure, caption, picture::NARROW),
                );
                let caption = escape::text(caption);
                self.put(format_args!(
                    "<figure class=\"picture\"><div class=\"broad\">{wide}</div><div class=\"slim\">{narrow}</div>\
                     <figcaption>{caption}</figcaption></figure>\n"
                ));
            }
        }
        Ok(())
    }

    fn table(&mut self, table: &Table) {
        let numeric: Vec<bool> = (0..table.head.len())
            .map(|i| table.rows.iter().filter_map(|row| row.get(i)).all(|cell| is_number(cell)))
            .collect();
        let has_sentences =
            |i: usize| table.rows.iter().filter_map(|row| row.get(i)).any(|cell| cell.len() > SENTENCE);
        let class = |i: usize| match numeric.get(i) {
            Some(true) => " class=\"n\"",
            _ if has_sentences(i) => " class=\"t\"",
            _ => "",
        };
        self.body.push_str("<div class=\"wide\" tabindex=\"0\"><table><thead><tr>");
        for (i, head) in table.head.iter().enumerate() {
            self.put(format_args!("<th scope=\"col\"{}>{}</th>", class(i), escape::text(head)));
        }
        self.body.push_str("</tr></thead><tbody>\n");
        for row in &table.rows {
            self.body.push_str("<tr>");
            for (i, cell) in row.iter().enumerate() {
                self.put(format_args!("<td{}>{}</td>", class(i), escape::text(cell)));
            }
            self.body.push_str("</tr>\n");
        }
        self.body.push_str("</tbody></table></div>\n");
    }

    /// An empty place that the script fills; without a script, the same chart as a picture.
    fn chart(&mut self, chart: &Chart) -> Result<()> {
        let (data, thinned) = chart_data::of(&chart.figure, chart.axis.as_deref(), self.most);
        let json = serde_json::to_string(&data)
            .map_err(|e| crate::Error::new(format!("the chart can't be written: {e}")))?;
        let (number, caption) = (self.figures.len(), escape::text(&chart.caption));
        self.figures.push(json);
        let note = thinned.map_or(String::new(), |(before, after)| {
            format!(
                " <span class=\"note\">Lines of {before} points are drawn with {after}: the least and the greatest value of \
                 each stretch.</span>"
            )
        });
        let svg = self.still(&chart.figure, &chart.caption, picture::WIDE);
        self.put(format_args!(
            "<figure class=\"chart\" id=\"f{number}\" data-figure=\"{number}\"><div class=\"panels\"></div>\
             <div class=\"still\">{svg}</div><figcaption>{caption}{note}</figcaption></figure>\n"
        ));
        Ok(())
    }

    /// The figure as a picture: what is seen without a script, and in print.
    fn still(&mut self, figure: &Figure, caption: &str, size: picture::Size) -> String {
        self.stills += 1;
        let title = caption.split_inclusive(". ").next().unwrap_or_default();
        let most = if size.width < picture::WIDE.width { size.panel_height } else { 300.0 };
        let size = picture::Size { panel_height: f64::from(figure.panel_height_px).min(most), ..size };
        picture::svg(figure, size, &format!("q{}", self.stills), title.trim(), &figure.description())
    }

    fn whole(self, page: &Page) -> String {
        let title = escape::text(&page.title);
        let figures = escape::json(&self.figures.join(",\n"));
        let scripts = if self.figures.is_empty() {
            String::new()
        } else {
            format!(
                "<script type=\"application/json\" id=\"figures\">[{figures}]</script>\n<script>{UPLOT}</script>\n\
                 <script>\n{CHARTS}</script>\n"
            )
        };
        let version = env!("CARGO_PKG_VERSION");
        let body = self.body;
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
             <meta name=\"color-scheme\" content=\"light dark\">\n\
             <title>{title}</title>\n<style>{UPLOT_STYLE}\n{STYLE}</style></head>\n<body>\n{body}</main>\n\
             <footer>drift {version}</footer>\n{scripts}</body></html>\n"
        )
    }
}

/// A number keeps its per cent sign on its line.
fn unbroken(text: &str) -> String {
    text.replace(" %", "\u{a0}%")
}

/// A status as a shape of its own.
fn shape(status: Status) -> String {
    let drawn = match status {
        Status::Healthy | Status::ToldApart | Status::Learnt => {
            "<circle cx=\"8\" cy=\"8\" r=\"8\"/><path d=\"M4 8.3l3 3 5-6\"/>"
        }
        Status::Suspect => "<path class=\"f\" d=\"M8 0l8 15H0z\"/><path d=\"M8 5v5M8 12.2v.6\"/>",
        Status::InPart => {
            "<circle cx=\"8\" cy=\"8\" r=\"8\"/><path class=\"w\" d=\"M8 2.4a5.6 5.6 0 0 1 0 11.2z\"/>"
        }
        Status::Drift => {
            "<path class=\"f\" d=\"M4.7 0h6.6L16 4.7v6.6L11.3 16H4.7L0 11.3V4.7z\"/><path d=\"M4 11l8-6M8 4.6l4 .4-1 3.8\"/>"
        }
        Status::CauseFound => {
            "<rect width=\"16\" height=\"16\" rx=\"3\"/><circle class=\"o\" cx=\"7\" cy=\"7\" r=\"3.4\"/><path d=\"M9.6 9.6l3.4 3.4\"/>"
        }
        Status::CantTell => {
            "<path class=\"f\" d=\"M8 0l8 8-8 8-8-8z\"/><path d=\"M6 6.3a2 2 0 1 1 2.6 1.9c-.5.2-.6.6-.6 1.2M8 11.6v.6\"/>"
        }
    };
    format!("<svg viewBox=\"0 0 16 16\" aria-hidden=\"true\">{drawn}</svg>")
}

/// Whether a cell is a number, a range of numbers or nothing.
fn is_number(cell: &str) -> bool {
    let signs = ['-', '+', '\u{2013}', '\u{2212}', '>', '<', '%', '\u{b1}'];
    cell.split(|c: char| c.is_whitespace() || [';', ',', '(', ')'].contains(&c)).all(|word| {
        let word = word.trim_matches(signs);
        word.is_empty() || word == "to" || word.parse::<f64>().is_ok()
    })
}
