//! A diagnosis from recordings as they were read to what is written of it, the same behind every door: the command, the page in a browser, Python.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::control_loop::Loop;
use crate::diagnose::cause::Cause;
use crate::diagnose::healthy::Healthy;
use crate::diagnose::signals::Signals;
use crate::diagnose::{Diagnosis, diagnose, page, report};
use crate::plan::{self, Recorded};
use crate::recording::{ColumnMap, Recording};
use crate::report::{Block, Page, Section};
use crate::sentences::Clock;
use crate::{Result, init};

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
    /// What physics is missing in this one?
    pub recording: Read,
    /// A second recording, for the proof; without it the last 30 % of the first are held out.
    pub holdout: Option<Read>,
    /// Recordings of the same loop without a fault.
    pub healthy: Vec<Recording>,
    /// What is known of the loop, and its file; without it the law is looked for in the first healthy recording, or in the one that is
    /// diagnosed, and the plant is identified.
    pub stated: Option<(PathBuf, Loop)>,
}

/// The answer, and what its page and its JSON need besides.
#[derive(Debug)]
pub struct Diagnosed {
    /// What was found.
    pub found: Diagnosis,
    train: Signals,
    holdout: Option<(PathBuf, Signals, Clock)>,
    recording_file: PathBuf,
    loop_file: Option<PathBuf>,
    columns: ColumnMap,
    clock: Clock,
    /// What the recording left open, and which experiment would tell it apart.
    experiment: Option<String>,
}

impl Question {
    /// Diagnoses.
    ///
    /// # Errors
    /// A recording lacks a column that the loop asks for, is too short, or never moves; the loop can't be simulated.
    pub fn diagnose(self) -> Result<Diagnosed> {
        let Self { recording: Read { file: recording_file, recording }, holdout, healthy, stated } = self;
        let (loop_file, model) = match stated {
            Some((file, model)) => (Some(file), model),
            None => (None, init::with_law_alone(healthy.first().unwrap_or(&recording))?),
        };
        let train = Signals::new(&recording, &model)?;
        let with_clock = |Read { file, recording }| -> Result<_> {
            Ok((file, Signals::new(&recording, &model)?, recording.clock()))
        };
        let holdout = holdout.map(with_clock).transpose()?;
        let healthy =
            healthy.iter().map(|healthy| Signals::new(healthy, &model)).collect::<Result<Vec<_>>>()?;
        let unseen = holdout.as_ref().map(|(_, signals, _)| signals);
        let found = if healthy.is_empty() {
            diagnose(&train, unseen, &model)?
        } else {
            Healthy::of(&model, &healthy).diagnose(&train, unseen)?
        };
        let clock = recording.clock();
        let experiment = plan::proposal(&found, Recorded::of(&train), &model, loop_file.as_deref());
        let columns = recording.columns;
        Ok(Diagnosed { found, train, holdout, recording_file, loop_file, columns, clock, experiment })
    }
}

impl Diagnosed {
    /// How the recording tells the time.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// Time of the first sample, s; onsets count from it.
    pub fn start_s(&self) -> f64 {
        self.train.start_s - self.train.origin_s
    }

    /// The recording on which the answer is shown: the second one, where there is one.
    pub fn shown(&self) -> &Signals {
        self.holdout.as_ref().map_or(&self.train, |(_, signals, _)| signals)
    }

    /// Which experiment would tell apart what the recording left open, and what to type for it.
    pub fn experiment(&self) -> Option<&str> {
        self.experiment.as_deref()
    }

    /// The page for people; `command` is the command line that makes it.
    pub fn page(&self, command: String) -> Page {
        let holdout = self.holdout.as_ref();
        let case = page::Case {
            train: &self.train,
            holdout: holdout.map(|(_, signals, _)| signals),
            recording: &self.recording_file,
            loop_file: self.loop_file.as_deref(),
            holdout_file: holdout.map(|(file, _, _)| Path::new(file)),
            columns: &self.columns,
            clock: self.clock,
            holdout_clock: holdout.map_or(self.clock, |(_, _, clock)| *clock),
        };
        let mut page = page::page(&self.found, &case, command);
        if let Some(experiment) = &self.experiment {
            page.sections
                .insert(0, Section::new("The experiment to run", vec![Block::Text(experiment.clone())]));
        }
        page
    }

    /// The document for programs; `model` is where the improved loop was written.
    pub fn json(&self, model: Option<&str>) -> Value {
        let mut document = report::json(&self.found, model, &self.clock, self.start_s());
        if let Value::Object(document) = &mut document {
            let causes = self.found.causes.iter().map(Cause::to_json).collect();
            document.insert("experiment_to_run".into(), self.experiment.clone().into());
            document.insert("causes".into(), Value::Array(causes));
            document.insert("recorded".into(), Recorded::of(&self.train).to_json());
        }
        document
    }
}
