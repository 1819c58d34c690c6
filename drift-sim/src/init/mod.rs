//! A loop file proposed from a recording alone: the control law by replay, the plant by identification, a window from
//! the loop's correlation, each with how it was found and how sure it is. What can't be found is left open and said.

pub(crate) mod control_law;
mod identified;
pub(crate) mod least_squares;
mod limits;
mod text;

use std::path::Path;

use crate::calibrate::{Options, Signals as WindowSignals, timing};
use crate::control_loop::{Loop, Sensor};
use crate::controller::Controller;
use crate::estimate::law_replay::{TOLERANCE, replay};
use crate::estimate::signals::{Signals, deviation};
use crate::plant::Plant;
use crate::recording::Recording;
use crate::sentences::{measured, plain};
use crate::stage;
use crate::terminal::Terminal;
use crate::{Error, Result};

/// Part of y's variance below which a plant's simulation explains little.
const LITTLE: f64 = 0.9;
/// Log-likelihood by which another structure may be behind and still fit as well: the margin of a diagnosis.
const AS_WELL: f64 = 5.0;

/// A proposed loop and why it is as it is.
#[derive(Debug, Clone)]
pub struct Proposal {
    /// The loop. Its controller is `recorded`, its plant `identify`, where nothing was found.
    pub model: Loop,
    /// On the recording and the sample time, one line each.
    pub about_loop: Vec<String>,
    /// On the controller.
    pub about_controller: Vec<String>,
    /// On the plant.
    pub about_plant: Vec<String>,
    /// The window for `drift calibrate`, s; `None` where none was found.
    pub window_s: Option<f64>,
}

impl Proposal {
    /// The loop file, the reasons as comments.
    pub fn to_toml(&self) -> String {
        text::toml(self)
    }

    /// The reasons for people.
    pub fn screen(&self, terminal: &Terminal) -> String {
        text::screen(self, terminal)
    }
}

/// Proposes a loop for a recording.
///
/// # Errors
/// Fewer than 100 samples, or a y or u that never changes: no loop can be read off such a recording.
pub fn propose(recording: &Recording) -> Result<Proposal> {
    let (open, signals) = open(recording)?;
    let mut proposal = Proposal {
        model: open,
        about_loop: vec![format!(
            "Proposed by `drift init` from {}: {} samples, {} s.",
            file_name(&recording.name),
            recording.len(),
            plain(recording.duration_s(), 6)
        )],
        about_controller: Vec::new(),
        about_plant: Vec::new(),
        window_s: None,
    };
    proposal.say_how_it_was_sampled(recording);
    stage::begins("the control law", 0);
    match &recording.stated_law {
        Some(law) => proposal.take_stated(law, &signals),
        None => proposal.find_controller(&signals),
    }
    stage::begins("the plant", 0);
    proposal.find_plant(&signals);
    proposal.find_window(recording);
    Ok(proposal)
}

/// A loop of which nothing is stated, as far as its law tells without a plant: the law that the recording states where its u follows that
/// one, else another that it follows, and `recorded` where it follows none: a controller that takes more steps than the recording has rows
/// can't be replayed on them. The plant is left open.
///
/// # Errors
/// As [`propose`].
pub fn with_law_alone(recording: &Recording) -> Result<Loop> {
    let (open, signals) = open(recording)?;
    let is_followed = |law: &Controller| {
        let stated = Loop { controller: law.clone(), ..open.clone() };
        replay(&stated, &signals).is_some_and(|replay| replay.relative <= TOLERANCE)
    };
    let stated = recording.stated_law.clone().filter(is_followed);
    let law = stated.unwrap_or_else(|| control_law::find(&open, &signals).controller);
    Ok(Loop { controller: law, ..open })
}

/// A loop with law and plant left open, and the recording's signals.
fn open(recording: &Recording) -> Result<(Loop, Signals)> {
    let open = Loop {
        sample_time_s: recording.sample_time_s,
        units: recording.units.clone(),
        controller: Controller::Recorded,
        plant: Plant::Identify,
        sensor: Sensor::default(),
        inputs: Vec::new(),
        physics: Vec::new(),
    };
    let signals = Signals::new(recording, &open)?;
    if signals.u.iter().all(|u| *u == 0.0) || deviation(&signals.u) <= 1e-12 * largest(&signals.u) {
        return Err(Error::new("u never changes")
            .allowed("a recording in which the loop moves")
            .in_file(&recording.name));
    }
    Ok((open, signals))
}

impl Proposal {
    fn say_how_it_was_sampled(&mut self, recording: &Recording) {
        let quality = &recording.quality;
        self.about_loop.extend(quality.notes.iter().cloned());
        let stamps = match &quality.resampled {
            Some(jitter) => format!("resampled, from {jitter}"),
            None if quality.time_resolution_s > 0.0 && quality.time_deviation_max_s == 0.0 => {
                "every time stamp on this grid".into()
            }
            None if quality.time_resolution_s > 0.0 => {
                let most_s = plain(quality.time_deviation_max_s, 3);
                format!("every time stamp within {most_s} s of this grid")
            }
            None => "as given: there are no time stamps".into(),
        };
        self.about_loop.push(format!("sample_time_s: {stamps}."));
        if deviation(&recording.r) == 0.0 {
            self.about_loop
                .push("r never changes: only disturbances move this loop, so the plant is less sure.".into());
        }
    }

    /// The law that the recording states itself, and how far its replay misses u.
    fn take_stated(&mut self, law: &Controller, signals: &Signals) {
        self.model.controller = law.clone();
        let about = &mut self.about_controller;
        about.push("The recording states this law and its limits.".into());
        let Some(replay) = replay(&self.model, signals) else { return };
        about.push(format!(
            "Replayed on r and y it misses u by {} of its deviation.",
            percent(replay.relative)
        ));
        if replay.relative > TOLERANCE {
            about.push(format!(
                "That is more than {}: the controller takes more steps than the recording has rows, or differs from what is stated; \
                 kind = \"recorded\" takes u as it is.",
                percent(TOLERANCE)
            ));
        }
    }

    fn find_controller(&mut self, signals: &Signals) {
        let found = control_law::find(&self.model, signals);
        let about = &mut self.about_controller;
        match (&found.controller, found.best) {
            (Controller::Recorded, Some((kind, misses, last))) => {
                about.push(
                    "No law of the loop file makes the recorded u of r and y, so u is taken as recorded:"
                        .into(),
                );
                about.push(format!(
                    "the best ({kind}) misses u by {} of its deviation ({} on the last 30 %); allowed are {}.",
                    percent(misses),
                    percent(last),
                    percent(TOLERANCE)
                ));
            }
            (Controller::Recorded, None) => {
                about.push("No law could be fitted to u: it is taken as recorded.".into());
            }
            (_, best) => {
                let (misses, last) = best.map_or((f64::NAN, f64::NAN), |(_, misses, last)| (misses, last));
                about.push(format!(
                    "Fitted to the recorded r, y and u; replayed it misses u by {} of its deviation ({} on the last 30 %).",
                    percent(misses),
                    percent(last)
                ));
                for (name, value, half_width) in &found.intervals {
                    about.push(if *half_width < 1e-6 * value.abs() {
                        format!("{name}: exact to its six digits")
                    } else {
                        format!("{name}: {} (95 %)", measured(*value, *half_width, ""))
                    });
                }
                let limits = found.controller.limits();
                if limits.u_min.is_finite() || limits.u_max.is_finite() {
                    about.push("u_min, u_max: u stays there, and only with them the law follows it.".into());
                }
                if found.skipped > 0 {
                    about.push(format!(
                        "The law does not hold for the first {} samples, left out here.",
                        found.skipped
                    ));
                }
            }
        }
        self.model.controller = found.controller;
    }

    fn find_plant(&mut self, signals: &Signals) {
        match identified::find(&self.model, signals) {
            Ok(found) => self.take_plant(found),
            Err(explains) => {
                let about = &mut self.about_plant;
                about.push(
                    "Not identified: one lag, an integrator, two lags, an oscillator, a servo's speed and position were tried;"
                        .into(),
                );
                about.push(if explains > 0.0 {
                    format!(
                        "simulated from u alone on the last 30 %, the likeliest explains {} of y's variance, and 50 % are needed.",
                        percent(explains)
                    )
                } else {
                    "simulated from u alone on the last 30 %, the likeliest is worse than a constant.".into()
                });
                about.push(
                    "State the plant here, or take a recording in which u moves y more than disturbances do."
                        .into(),
                );
            }
        }
    }

    fn take_plant(&mut self, found: identified::Found) {
        let about = &mut self.about_plant;
        about.push(format!("Identified from u and y: {}.", found.says));
        about.push(format!(
            "Fitted to the first 70 %; on the last 30 %, simulated from u alone, it explains {} of y's variance.",
            percent(found.explains)
        ));
        if found.explains < LITTLE {
            about.push("That is little: take its numbers as a first guess.".into());
        }
        for number in &found.numbers {
            let name = number.name.trim_start_matches("plant.");
            about.push(if number.half_width.is_finite() {
                format!("{name}: {}", measured(number.value, number.half_width, ""))
            } else {
                format!("{name}: not determined")
            });
        }
        for (form, lost) in found.others.iter().filter(|(_, lost)| *lost < AS_WELL) {
            let than = if *lost < 0.0 {
                "more in log-likelihood, with more numbers"
            } else {
                "less in log-likelihood"
            };
            about.push(format!("Fits as well: {form} ({} {than}).", plain(lost.abs(), 3)));
        }
        if !found.model.physics.is_empty() {
            about.push(
                "The load_step below is its offset: the u at which it rests at y = 0, or holds still.".into(),
            );
        }
        self.model = found.model;
    }

    fn find_window(&mut self, recording: &Recording) {
        let signals = WindowSignals::from(recording);
        if let Ok(choice) = timing::choose(&[signals], &Options::default()) {
            self.window_s = Some(round(
                f64::from(choice.timing.block_ticks)
                    * f64::from(choice.timing.window_blocks)
                    * recording.sample_time_s,
            ));
            self.about_loop.extend(choice.reason.map(|reason| format!("For `drift calibrate`: {reason}.")));
        }
    }
}

fn file_name(path: &str) -> String {
    Path::new(path).file_name().map_or_else(|| path.to_owned(), |name| name.to_string_lossy().into_owned())
}

fn percent(share: f64) -> String {
    if share.abs() < 1e-5 { "less than 0.001 %".into() } else { format!("{} %", plain(100.0 * share, 3)) }
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |most: f64, x| most.max(x.abs()))
}

/// Six digits: more than any fit is worth, and short to read.
fn round(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}
