//! Text for a terminal: no line wider than the window, no word broken, colour where it helps, and signs that the locale has.

use std::io::IsTerminal;

use crate::plot::terminal::Signs;
use crate::sentences::{Answer, KeyNumber, Status, with_carets};

/// Width of what goes into a pipe or a file.
const PIPED: usize = 80;
/// The narrowest and the widest that text is set: longer lines are hard to read.
const WIDTHS: std::ops::RangeInclusive<usize> = 40..=100;

/// What text is set for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Terminal {
    /// Columns.
    pub width: usize,
    /// Whether escape codes for colour may be written.
    pub colour: bool,
    /// Of rows of text as charts, and whether signs beyond ASCII may be written.
    pub signs: Signs,
}

/// Of the terminal's window; none in a pipe.
#[cfg(any(unix, windows))]
fn window_columns() -> Option<usize> {
    terminal_size::terminal_size_of(std::io::stdout()).map(|(width, _)| usize::from(width.0))
}

/// A browser has no terminal.
#[cfg(not(any(unix, windows)))]
fn window_columns() -> Option<usize> {
    None
}

impl Terminal {
    /// Standard output: its window's width, 80 in a pipe; colour on a terminal unless `NO_COLOR` is set.
    pub fn here() -> Self {
        let is_terminal = std::io::stdout().is_terminal();
        let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
        let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        Self {
            width: window_columns().unwrap_or(PIPED).clamp(*WIDTHS.start(), *WIDTHS.end()),
            colour: is_terminal && !set("NO_COLOR") && !dumb,
            signs: Signs::of_locale(),
        }
    }

    /// 80 columns of ASCII without colour.
    pub const fn plain() -> Self {
        Self { width: PIPED, colour: false, signs: Signs::Ascii }
    }

    /// Columns for a row of signs beside a name and its numbers.
    pub fn chart_columns(&self) -> usize {
        self.width.saturating_sub(46).clamp(12, 54)
    }

    /// The answer: status, sentence, what else there is to say, the numbers.
    pub fn answer(&self, answer: &Answer) -> String {
        let mut text = String::new();
        let (status, word) = (answer.status, answer.status.word().to_uppercase());
        text += &self.coloured(status, &format!("{} {word}", self.shape(status)));
        text.push('\n');
        text += &self.paragraph(&answer.sentence);
        if !answer.also.is_empty() {
            text += &self.paragraph(&answer.also);
        }
        if !answer.numbers.is_empty() {
            text.push('\n');
            let widest = answer.numbers.iter().map(|n| self.length(&n.value)).max().unwrap_or(0);
            for KeyNumber { value, label } in &answer.numbers {
                let pad = " ".repeat(widest - self.length(value));
                text += &self.wrapped(&format!("  {value}{pad}  "), label);
            }
        }
        text
    }

    fn length(&self, text: &str) -> usize {
        self.text(text).chars().count()
    }

    /// A paragraph from the left edge on.
    pub fn paragraph(&self, text: &str) -> String {
        self.wrapped("", text)
    }

    /// A line with what stands before it, broken between words where it is longer than the window; what follows is indented as
    /// far as the beginning.
    pub fn wrapped(&self, before: &str, text: &str) -> String {
        let indent = self.length(before);
        let (mut out, mut line, mut length) = (String::new(), self.text(before), indent);
        for word in text.split(' ') {
            let word = self.text(word);
            let letters = word.chars().count();
            if length > indent && length + 1 + letters > self.width {
                out += line.trim_end();
                out.push('\n');
                (line, length) = (" ".repeat(indent), indent);
            }
            if length > indent {
                line.push(' ');
                length += 1;
            }
            line += &word;
            length += letters;
        }
        out += line.trim_end();
        out.push('\n');
        out
    }

    /// Text in signs that the locale has; a blank that does not break is a blank now.
    pub fn text(&self, text: &str) -> String {
        let text = text.replace('\u{a0}', " ");
        if self.signs == Signs::Blocks {
            return text;
        }
        let plain =
            [("\u{b1}", "+-"), ("\u{2192}", "->"), ("\u{2212}", "-"), ("\u{2013}", "-"), ("\u{d7}", "x")];
        plain.into_iter().fold(with_carets(&text), |text, (from, to)| text.replace(from, to))
    }

    /// Seen before it is read.
    fn shape(&self, status: Status) -> char {
        match (self.signs, status) {
            (Signs::Blocks, Status::Healthy | Status::ToldApart | Status::Learnt) => '\u{2714}',
            (Signs::Blocks, Status::Suspect) => '\u{25b2}',
            (Signs::Blocks, Status::Drift) => '\u{25a0}',
            (Signs::Blocks, Status::CauseFound) => '\u{25cf}',
            (Signs::Blocks, Status::CantTell) => '\u{25c7}',
            (Signs::Blocks, Status::InPart) => '\u{25d1}',
            (Signs::Ascii, Status::Healthy | Status::ToldApart | Status::Learnt) => '+',
            (Signs::Ascii, Status::Suspect) => '!',
            (Signs::Ascii, Status::Drift) => '#',
            (Signs::Ascii, Status::CauseFound) => '*',
            (Signs::Ascii, Status::CantTell) => '?',
            (Signs::Ascii, Status::InPart) => '~',
        }
    }

    /// In the status' colour, bold.
    pub fn coloured(&self, status: Status, text: &str) -> String {
        let code = match status {
            Status::Healthy | Status::ToldApart | Status::Learnt => 32,
            Status::Suspect | Status::InPart => 33,
            Status::Drift => 31,
            Status::CauseFound => 36,
            Status::CantTell => 35,
        };
        if self.colour { format!("\u{1b}[1;{code}m{text}\u{1b}[0m") } else { text.to_owned() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer() -> Answer {
        Answer {
            status: Status::Drift,
            sentence: "It takes more effort to hold y than it did, since about 87\u{a0}480 s (24.3 h), and nobody has seen it yet.".into(),
            also: String::new(),
            numbers: vec![
                KeyNumber::new("20.8 \u{b1} 0.4 N", "a label that is so long that it has to go on in the line below this one"),
                KeyNumber::new("1", "short"),
            ],
        }
    }

    #[test]
    fn no_line_is_wider_and_no_word_is_broken() {
        for (width, signs) in [(40, Signs::Ascii), (80, Signs::Ascii), (80, Signs::Blocks)] {
            let terminal = Terminal { width, colour: false, signs };
            let text = terminal.answer(&answer());
            assert!(text.lines().all(|line| line.chars().count() <= width), "{text}");
            assert!(text.contains("87 480 s") && !text.contains('\u{1b}'), "{text}");
            let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
            let said = words(&terminal.text(&answer().sentence));
            assert!(words(&text).windows(said.len()).any(|w| w == said), "{text}");
        }
    }

    #[test]
    fn ascii_has_no_other_signs() {
        let text = Terminal::plain().answer(&answer());
        assert!(text.is_ascii() && text.starts_with("# DRIFT\n"), "{text}");
        assert!(text.contains("  20.8 +- 0.4 N  a label"), "{text}");
        assert!(text.contains("  1              short"), "{text}");
    }

    #[test]
    fn colour_is_about_the_status_alone() {
        let terminal = Terminal { colour: true, ..Terminal::plain() };
        assert!(terminal.answer(&answer()).starts_with("\u{1b}[1;31m# DRIFT\u{1b}[0m\n"));
    }
}
