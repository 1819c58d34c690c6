//! The plan as a report for people: the reference, and what each cause that is left would answer.

use super::Plan;
use crate::estimate::signals::range;
use crate::plot::{Colour, Figure, Layer, Panel};
use crate::report::{Block, Page, Proof, Section};
use crate::sentences::{self, plain};

/// A log-likelihood ratio: tenths say no more.
fn lead(nats: f64) -> String {
    plain((10.0 * nats).round() / 10.0, 3)
}

impl Plan {
    /// The whole page; `command` is the command line, `file` where the reference is written.
    pub fn page(&self, command: String, file: &str) -> Page {
        Page {
            title: format!("The experiment {file}"),
            about: format!("{file}, {} s", plain(self.duration_s(), 4)),
            answer: sentences::planning(self),
            proof: Some(self.proof()),
            command,
            facts: self.facts(file),
            sections: vec![self.chances(), self.pairs(), self.causes()],
        }
    }

    /// The reference with the answers in y, the answers in u, and by how much they differ from the likeliest one.
    fn proof(&self) -> Proof {
        let units = self.request.stated.unit_names();
        let ts = self.request.stated.sample_time_s;
        let line = |name: String, i: usize, x: &[f64]| Layer::signal(name, Colour::nth(i), 0.0, ts, x);
        let labelled = |letter: &str, unit: &str| {
            if unit.is_empty() { letter.to_owned() } else { format!("{letter}, {unit}") }
        };
        let panel = |y_label: String, layers: Vec<Layer>| Panel { y_label, layers, ..Panel::default() };
        let mut of_y = vec![Layer::signal("r", Colour::Black, 0.0, ts, &self.r)];
        let (mut of_u, mut apart) = (Vec::new(), Vec::new());
        let base = self.likeliest();
        for (i, (place, answer)) in self.answers.iter().enumerate() {
            of_y.push(line(self.name(*place), i, &answer.y));
            of_u.push(line(String::new(), i, &answer.u));
            if let Some(base) = base {
                let off: Vec<f64> = answer.u.iter().zip(&base.u).map(|(a, b)| a - b).collect();
                apart.push(line(String::new(), i, &off));
            }
        }
        let last = Panel { x_label: "time, s".into(), ..panel(labelled("u apart", &units.u), apart) };
        Proof {
            figure: Figure::stacked(
                "",
                vec![panel(labelled("r and y", &units.y), of_y), panel(labelled("u", &units.u), of_u), last],
            ),
            title: "The reference, and what each cause would answer".into(),
            caption: "Above: the reference and the y that each cause predicts. In the middle: u. Below: by how much u differs from \
                      what the likeliest cause predicts. Without noise, and before a rival's numbers are refitted."
                .into(),
        }
    }

    fn facts(&self, file: &str) -> Vec<(String, String)> {
        let (low, high) = range(&self.r);
        let samples = format!(
            "{file}: {} samples, one every {} s",
            self.r.len(),
            plain(self.request.stated.sample_time_s, 4)
        );
        let mut facts = vec![
            ("Reference".into(), samples),
            ("r".into(), format!("from {} to {}", plain(low, 4), plain(high, 4))),
        ];
        if let Some(answer) = self.likeliest() {
            let (low, high) = range(&answer.u);
            facts.push((
                "u, as the likeliest cause has it".into(),
                format!("from {} to {}", plain(low, 4), plain(high, 4)),
            ));
        }
        facts.push(("References rehearsed".into(), self.tried.to_string()));
        facts
    }

    fn chances(&self) -> Section {
        let rows = self
            .separation
            .named
            .iter()
            .map(|(place, chance)| vec![self.name(*place), sentences::chance(*chance)]);
        let blocks = vec![
            Block::table(["if it is", "it is named, at least"], rows.collect()),
            Block::Note(
                "The sum of all that may go wrong with its rivals is taken off: the chance of all together is no less.".into(),
            ),
        ];
        Section::new("With which chance", blocks)
    }

    fn pairs(&self) -> Section {
        let rows = self.separation.pairs.iter().map(|pair| {
            let expected =
                if pair.expected.is_finite() { lead(pair.expected) } else { "can't be simulated".into() };
            vec![self.name(pair.truth), self.name(pair.rival), expected, sentences::chance(pair.chance)]
        });
        let blocks = vec![
            Block::table(
                ["if it is", "and is held against", "expected lead", "told apart"],
                rows.collect(),
            ),
            Block::Note(
                "The lead, in log-likelihood, is what the truth is expected to be ahead by on the part of the experiment that a fit sees, once the \
                 rival's own numbers, the plant's and the noise's are refitted. It is scattered by the root of twice as much. Of causes \
                 that answer alike the simplest is named: the others can't be told from it."
                    .into(),
            ),
        ];
        Section::new("Pair by pair", blocks)
    }

    fn causes(&self) -> Section {
        let units = self.request.stated.unit_names();
        let rows = self.request.open.causes.iter().enumerate().map(|(place, cause)| {
            let says = cause
                .term
                .as_ref()
                .map_or_else(|| "Nothing is missing.".into(), |term| sentences::of_term(term, &units));
            let left = if cause.is_left { "yes" } else { "no" };
            vec![self.name(place), left.into(), plain(cause.gain, 3), says]
        });
        let head = ["cause", "left", "gain in log-likelihood", "as fitted in the recording"];
        Section::new("What the recording left", vec![Block::table(head, rows.collect())])
    }
}
