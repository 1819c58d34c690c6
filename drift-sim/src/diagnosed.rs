//! A diagnosis from recordings as they were read to what is written of it, the same behind every door: the command, the page in a browser, Python.

use std::path::PathBuf;

use serde_json::Value;

use crate::control_loop::Loop;
use crate::diagnose::cause::Cause;
use crate::diagnose::page::{self, Case};
use crate::diagnose::shown::Shown;
use crate::diagnose::{Diagnosis, diagnose_since, report};
use crate::estimate::signals::Signals;
use crate::likelihood_search::options::Options;
use crate::plan::{self, Recorded};
use crate::plant::Plant;
use crate::recording::{ColumnMap, Recording};
use crate::report::{Block, Page, Section};
use crate::sentences::{Clock, typed};
use crate::{Error, Result, init};

/// A recording and the file that it was read from, as the user wrote it.
#[derive(Debug, Clone)]
pub struct Read {
    /// The file.
    pub file: PathBuf,
    /// What was in it.
    pub recording: Recording,
}

/// What is asked.
#[derive(Debug, Clone)]
pub struct Question {
    /// What physics is missing in these? They share what is wrong, and are pooled; the first is shown.
    pub recordings: Vec<Read>,
    /// Another recording, for the proof; without it the last 30 % of each are held out.
    pub holdout: Option<Read>,
    /// Recordings of the same loop without a fault; the first is shown.
    pub healthy: Vec<Read>,
    /// What is known of the loop, and its file; without it the law is looked for in the first healthy recording, or in the one that is
    /// diagnosed, and the plant is identified.
    pub stated: Option<(PathBuf, Loop)>,
    /// The probability with which the true cause may be lost, where a guarantee is asked for.
    pub guarantee: Option<f64>,
}

/// The answer, and what its page and its JSON need besides.
#[derive(Debug)]
pub struct Diagnosed {
    /// What was found.
    pub found: Diagnosis,
    first: Shown,
    further: Vec<Shown>,
    holdout: Option<Shown>,
    healthy: Vec<Shown>,
    loop_file: Option<PathBuf>,
    columns: ColumnMap,
    /// Whether the plant was identified: none of its numbers was given.
    pub is_identified: bool,
    /// What the recording left open, and which experiment would tell it apart.
    experiment: Option<String>,
}

impl Question {
    /// Diagnoses.
    ///
    /// # Errors
    /// There is no recording, or one lacks a column that the loop asks for, is too short, or never moves; the loop can't be simulated.
    pub fn diagnose(self) -> Result<Diagnosed> {
        let Self { recordings, holdout, healthy, stated, guarantee } = self;
        if let Some(alpha) = guarantee.filter(|alpha| !(*alpha > 0.0 && *alpha < 1.0)) {
            return Err(Error::new(format!(
                "a guarantee of {}: it is a probability between 0 and 1, such as 0.05",
                typed(alpha)
            )));
        }
        let none = || Error::new("there is no recording to diagnose");
        let first = recordings.first().ok_or_else(none)?;
        let columns = first.recording.columns.clone();
        let (loop_file, model) = match stated {
            Some((file, model)) => (Some(file), model),
            None => (None, init::with_law_alone(&healthy.first().unwrap_or(first).recording)?),
        };
        let shown = |read: &Read| Shown::of(read, &model);
        let shown_all = |all: &[Read]| all.iter().map(shown).collect::<Result<Vec<Shown>>>();
        let (mut recordings, healthy) = (shown_all(&recordings)?, shown_all(&healthy)?);
        let holdout = holdout.as_ref().map(shown).transpose()?;
        let signals = |all: &[Shown]| all.iter().map(|of| of.signals.clone()).collect::<Vec<_>>();
        let unseen = holdout.as_ref().map(|of| &of.signals);
        let options = Options { guarantee, ..Options::default() };
        let found = diagnose_since(&signals(&healthy), &signals(&recordings), unseen, &model, &options)?;
        // What comes and goes has times of its own in each recording: a hold-out of its own has no part in that.
        let holdout = holdout.filter(|_| !found.comes_and_goes());
        let further = recordings.split_off(1);
        let first = recordings.pop().ok_or_else(none)?;
        let experiment = plan::proposal(&found, Recorded::of(&first.signals), &model, loop_file.as_deref());
        Ok(Diagnosed {
            found,
            first,
            further,
            holdout,
            healthy,
            loop_file,
            columns,
            is_identified: model.plant == Plant::Identify,
            experiment,
        })
    }
}

impl Diagnosed {
    /// The case as its page shows it.
    fn case(&self) -> Case<'_> {
        Case {
            first: &self.first,
            further: &self.further,
            holdout: self.holdout.as_ref(),
            healthy: &self.healthy,
            loop_file: self.loop_file.as_deref(),
            columns: &self.columns,
            is_identified: self.is_identified,
        }
    }

    /// How the recording tells the time.
    pub fn clock(&self) -> &Clock {
        &self.first.clock
    }

    /// Time of the first sample, s; onsets count from it.
    pub fn start_s(&self) -> f64 {
        self.case().start_s()
    }

    /// The recording on which the answer is shown: the one that proves, where there is one.
    pub fn shown(&self) -> &Signals {
        &self.holdout.as_ref().unwrap_or(&self.first).signals
    }

    /// Which experiment would tell apart what the recording left open, and what to type for it.
    pub fn experiment(&self) -> Option<&str> {
        self.experiment.as_deref()
    }

    /// The page for people; `command` is the command line that makes it.
    pub fn page(&self, command: String) -> Page {
        let mut page = page::page(&self.found, &self.case(), command);
        if let Some(experiment) = &self.experiment {
            page.sections
                .insert(0, Section::new("The experiment to run", vec![Block::Text(experiment.clone())]));
        }
        page
    }

    /// The document for programs; `model` is where the improved loop was written.
    pub fn json(&self, model: Option<&str>) -> Value {
        let mut document = report::json(&self.found, model, self.clock(), self.start_s());
        if let Value::Object(document) = &mut document {
            let causes = self.found.causes.iter().map(Cause::to_json).collect();
            document.insert("experiment_to_run".into(), self.experiment.clone().into());
            document.insert("causes".into(), Value::Array(causes));
            document.insert("recorded".into(), Recorded::of(&self.first.signals).to_json());
        }
        document
    }
}
