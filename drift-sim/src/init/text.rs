//! A proposal as a loop file with comments, and as lines on a terminal.

use super::Proposal;
use crate::plot::terminal::Signs;
use crate::sentences::typed;
use crate::terminal::Terminal;

/// Comments of the file are as wide as a terminal: an editor shows them whole.
const COMMENT: Terminal = Terminal { width: 78, colour: false, signs: Signs::Blocks };

pub(super) fn toml(proposal: &Proposal) -> String {
    let mut text = String::new();
    for line in proposal.model.to_toml().lines() {
        let about = match line {
            "[loop]" => proposal.about_loop.as_slice(),
            "[controller]" => proposal.about_controller.as_slice(),
            "[plant]" => proposal.about_plant.as_slice(),
            _ => &[],
        };
        for reason in about {
            COMMENT.paragraph(&one_line(reason)).lines().for_each(|line| text += &format!("# {line}\n"));
        }
        text += line;
        text.push('\n');
    }
    text
}

/// A file's name may hold anything; a comment ends with its line.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

pub(super) fn screen(proposal: &Proposal, terminal: &Terminal) -> String {
    let mut text = String::new();
    let parts = [
        ("loop", format!("{} s", typed(proposal.model.sample_time_s)), &proposal.about_loop),
        ("controller", proposal.model.controller.kind().to_owned(), &proposal.about_controller),
        ("plant", proposal.model.plant.kind().to_owned(), &proposal.about_plant),
    ];
    for (name, value, about) in parts {
        text += &format!("{name}: {value}\n");
        about.iter().for_each(|reason| text += &terminal.wrapped("  ", &one_line(reason)));
    }
    text
}
