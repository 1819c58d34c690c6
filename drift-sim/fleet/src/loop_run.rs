//! One loop's monitor over rows that come batch by batch. The samples are made and judged by the very code of `drift monitor`, so that
//! what it says is the same, byte for byte.

use std::path::PathBuf;

use drift_sim::baseline_file::BaselineFile;
use drift_sim::monitor::{Chart, Event, Summary, Watcher, page, write_summary};
use drift_sim::recording::{FedRecording, Piece, ReadOptions};
use drift_sim::{Error, Result, output, sentences};

use crate::baselines;
use crate::costs::Costs;
use crate::verdict::{PICTURE, Verdict};

/// Reports of single loops: where they are written and by what command.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Reports {
    /// Where `LOOP.html` goes.
    pub folder: PathBuf,
    /// Of all loops, or only of those that are not healthy.
    pub all: bool,
    /// The command line that the pages name.
    pub command: String,
}

/// A loop while it is watched.
pub struct LoopRun {
    name: String,
    baseline: BaselineFile,
    config: drift_core::Config<f32, 3>,
    recording: FedRecording,
    watcher: Option<Watcher>,
    chart: Chart,
    costs: Costs,
    reports: Option<Reports>,
}

impl LoopRun {
    /// A loop of which nothing was seen yet.
    ///
    /// # Errors
    /// The options or the baseline are impossible.
    pub fn new(
        name: &str,
        baseline: BaselineFile,
        options: &ReadOptions,
        reports: Option<Reports>,
    ) -> Result<Self> {
        let config = baseline.config()?;
        let chart = if reports.is_some() { Chart::new(&config) } else { Chart::of_residuals(&config) };
        let recording = FedRecording::new(name, options)?;
        let costs = Costs::default();
        Ok(Self { name: name.to_owned(), baseline, config, recording, watcher: None, chart, costs, reports })
    }

    /// Takes its next rows.
    ///
    /// # Errors
    /// Those that `drift monitor` has of such rows.
    pub fn push(&mut self, piece: Piece) -> Result<()> {
        self.recording.push(piece)?;
        self.watch()
    }

    fn watch(&mut self) -> Result<()> {
        let watcher = match (&mut self.watcher, self.recording.stream()) {
            (Some(watcher), _) => watcher,
            (none, Some(stream)) => {
                let new = Watcher::new(&self.config, stream.sample_time_s());
                none.insert(new.map_err(|e| e.in_file(&self.name))?)
            }
            (None, None) => return Ok(()),
        };
        let (chart, costs) = (&mut self.chart, &mut self.costs);
        loop {
            // Nearly all samples come in such stretches, which cost a fraction of what they cost one by one.
            let samples = self.recording.valid_samples();
            if !samples.is_empty() {
                chart.samples(&samples);
                watcher.samples(&samples, |hop| {
                    chart.hop(hop);
                    costs.add(hop);
                });
                continue;
            }
            let Some(sample) = self.recording.next()? else { return Ok(()) };
            chart.sample(sample.t_s, sample.r, sample.y, sample.u);
            if let Some(hop) = watcher.sample(&sample, None) {
                chart.hop(&hop);
                costs.add(&hop);
            }
        }
    }

    /// The verdict, once all rows were taken; its report is written where reports are asked for.
    ///
    /// # Errors
    /// Those that `drift monitor` has of such rows; the report can't be written.
    pub fn finish(mut self) -> Result<Verdict> {
        self.recording.finish()?;
        self.watch()?;
        let (Some(watcher), Some(stream)) = (self.watcher.take(), self.recording.stream()) else {
            return Err(Error::new("no rows of data").in_file(&self.name));
        };
        let summary = watcher.finish(stream);
        if let Some(reports) = &self.reports
            && (reports.all || summary.worst.is_some())
        {
            let columns = stream.columns();
            let made = page(&summary, &self.chart, &self.baseline, columns, reports.command.clone());
            std::fs::create_dir_all(&reports.folder)
                .map_err(|e| Error::of_file("can't be made", &e).in_file(&reports.folder))?;
            let file = reports.folder.join(format!("{}.html", baselines::file_stem(&self.name)));
            output::write_text(&file, &made.to_html()?)?;
        }
        verdict(&summary, &self.chart, &self.costs)
    }
}

fn verdict(summary: &Summary, chart: &Chart, costs: &Costs) -> Result<Verdict> {
    let mut line = Vec::new();
    write_summary(&mut line, summary)
        .map_err(|e| Error::new(format!("the summary can't be written: {e}")))?;
    let line = String::from_utf8_lossy(&line).trim_end_matches('\n').to_owned();
    let worst = summary.events.iter().max_by_key(|event| (event.kind(), event.to_s().is_none()));
    let main = worst.and_then(Event::main);
    let status = match summary.worst {
        Some(kind) => kind.name(),
        None if summary.channels.iter().all(|c| c.judged == 0) => "not_judged",
        None => "healthy",
    };
    Ok(Verdict {
        status: status.to_owned(),
        since_s: worst.map(Event::from_s),
        channel: main.map(|course| course.kind.name().to_owned()),
        side: main.map(|course| sentences::side_name(course.side).to_owned()),
        max_z: main.map(|course| f64::from(course.max_z)),
        events: i64::try_from(summary.events.len() as u64 + summary.more_events).unwrap_or(i64::MAX),
        samples: i64::try_from(summary.samples()).unwrap_or(i64::MAX),
        hours: summary.duration_s() / 3600.0,
        costs: costs.percent(),
        answer: sentences::monitoring(summary, &summary.clock()).sentence,
        picture: picture(summary, chart),
        summary: Some(line),
    })
}

/// The residual of the channel that went farthest: of each stretch of decisions the value farthest from zero.
fn picture(summary: &Summary, chart: &Chart) -> Vec<f32> {
    let channels = summary.channels.iter().zip(chart.residuals());
    let judged = channels.filter(|(channel, _)| channel.learned && channel.max_abs_z.is_finite());
    let farthest = judged.max_by(|a, b| a.0.max_abs_z.total_cmp(&b.0.max_abs_z));
    let points = farthest.map_or_else(Vec::new, |(_, points)| points);
    let stretch = points.len().div_ceil(PICTURE).max(1);
    let farther = |a: f32, b: f32| if b.abs() > a.abs() || a.is_nan() { b } else { a };
    let of = |points: &[(f64, f64)]| points.iter().map(|(_, z)| *z as f32).fold(f32::NAN, farther);
    points.chunks(stretch).map(of).collect()
}
