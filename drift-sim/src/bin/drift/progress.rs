//! A progress bar on a terminal; nothing in a pipe, a file or a log.

use std::time::Duration;

use drift_sim::stage::{self, Stage};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar that fills what the window's width leaves.
const STEPS: &str = "{msg} {wide_bar} {pos}/{len} {elapsed}";
/// Work of which nobody knows how much is left.
const UNKNOWN: &str = "{spinner} {msg} {elapsed}";

/// How far long work has come. Drawn on standard error where that is a terminal, and only when the work takes longer
/// than a moment; gone when it is dropped.
pub struct Progress(ProgressBar);

impl Progress {
    /// By bytes of a file; without a size, which a pipe doesn't tell, only the bytes so far are shown.
    pub fn of_bytes(what: &str, size_bytes: Option<u64>) -> Self {
        match size_bytes {
            Some(_) => Self::new(what, size_bytes, "{msg} {wide_bar} {bytes}/{total_bytes} {eta}"),
            None => Self::new(what, None, "{msg} {bytes} {bytes_per_sec}"),
        }
    }

    /// By steps of which the number is known.
    pub fn of_steps(what: &str, steps: u64) -> Self {
        Self::new(what, Some(steps), "{msg} {wide_bar} {pos}/{len} {eta}")
    }

    /// Of unknown length: the time that it has taken.
    pub fn of_unknown(what: &str) -> Self {
        Self::new(what, None, UNKNOWN)
    }

    /// Of work that speaks of its stages ([`drift_sim::stage`]): the stage, how many of its steps are done, and the time.
    pub fn of_stages(what: &str) -> Self {
        let progress = Self::of_unknown(what);
        let bar = progress.0.clone();
        if !bar.is_hidden() {
            stage::listen(move |stage| show(&bar, stage));
        }
        progress
    }

    fn new(what: &str, length: Option<u64>, template: &str) -> Self {
        // Hidden by the library itself where standard error is no terminal.
        let bar = ProgressBar::with_draw_target(length, ProgressDrawTarget::stderr_with_hz(8));
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.set_message(what.to_owned());
        if !bar.is_hidden() {
            bar.enable_steady_tick(Duration::from_millis(250));
        }
        Self(bar)
    }

    /// So many bytes or steps are done.
    pub fn at(&self, position: u64) {
        self.0.set_position(position);
    }

    /// One step more is done; from any thread.
    pub fn step(&self) {
        self.0.inc(1);
    }
}

fn show(bar: &ProgressBar, stage: Stage) {
    match stage {
        Stage::Step => {
            bar.inc(1);
            // Work that turns out longer than foreseen: "20/19" would puzzle.
            if bar.length().is_some_and(|length| length < bar.position()) {
                bar.set_length(bar.position());
            }
        }
        Stage::Begins(name, steps) => {
            let template = if steps > 0 { STEPS } else { UNKNOWN };
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar.set_length(steps as u64);
            bar.set_position(0);
            bar.set_message(name);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_begins_anew_and_its_steps_are_counted() {
        let progress = Progress::of_unknown("calibrating");
        for stage in [Stage::Begins("rivals", 3), Stage::Step, Stage::Step] {
            show(&progress.0, stage);
        }
        assert_eq!((progress.0.position(), progress.0.length()), (2, Some(3)));
        assert_eq!(progress.0.message(), "rivals");
        (0..2).for_each(|_| show(&progress.0, Stage::Step));
        assert_eq!((progress.0.position(), progress.0.length()), (4, Some(4)));
        show(&progress.0, Stage::Begins("proof", 0));
        assert_eq!((progress.0.position(), progress.0.message()), (0, "proof".to_owned()));
    }

    #[test]
    fn steps_and_bytes_are_counted() {
        let steps = Progress::of_steps("simulating", 10);
        steps.at(3);
        steps.step();
        assert_eq!(steps.0.position(), 4);
        let bytes = Progress::of_bytes("reading", None);
        bytes.at(1 << 20);
        assert_eq!((bytes.0.position(), bytes.0.length()), (1 << 20, None));
    }
}
