//! `drift demo`: the whole path on a made recording. An oven's thermometer begins to drift; the controller hides it from
//! r and y, and the effort channel finds it.

use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use drift_sim::calibrate::{Options, Signals, calibrate};
use drift_sim::control_loop::Loop;
use drift_sim::monitor::{Chart, FailOn, Outputs, Stopped, page, screen, watch};
use drift_sim::output::{self, Outputs as Files};
use drift_sim::physics::Term;
use drift_sim::recording::{ReadOptions, RecordingStream, csv_bytes, uniform_times_s};
use drift_sim::reference::Reference;
use drift_sim::simulate::{Start, Trace, simulate};
use drift_sim::terminal::Terminal;
use drift_sim::{Error, Result, report};

use crate::number_argument::seed;

const OVEN: &str = include_str!("../../../../examples/loops/oven.toml");
const HOUR_S: f64 = 3600.0;
const HEALTHY_S: f64 = 21.0 * 24.0 * HOUR_S;
const MONITORED_S: f64 = 72.0 * HOUR_S;
const ONSET_S: f64 = 24.0 * HOUR_S;
const DRIFT_PER_HOUR: f64 = 0.1;

/// Shows the whole path on a made recording: a hidden sensor drift, caught.
#[derive(Args)]
#[command(after_help = "\
Examples:
  drift demo
  drift demo --out demo --seed 2")]
pub struct Arguments {
    /// Folder for the recording, the baseline, the picture and the report; made if missing
    #[arg(long, value_name = "DIR", default_value = "drift-demo")]
    out: PathBuf,
    /// All noise and the set-points follow from this number
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = seed)]
    seed: u64,
}

/// What it writes.
const FILES: [&str; 4] = ["recording.csv", "baseline.toml", "demo.svg", "report.html"];

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let folder = &arguments.out;
    output::own_folder(folder, &FILES)?;
    let oven = Loop::parse(OVEN, "oven.toml")?;
    let drifting = oven.clone().with(
        Term::new("sensor_drift", &[("rate_per_s", DRIFT_PER_HOUR / HOUR_S), ("noise_growth_per_s", 0.0)])?
            .from_s(ONSET_S),
    );

    let (healthy_r, healthy) = run_oven(&oven, HEALTHY_S, arguments.seed)?;
    let (r, run) = run_oven(&drifting, MONITORED_S, arguments.seed.wrapping_add(1))?;
    let [recording, baseline_path, picture, report_path] = FILES.map(|name| folder.join(name));
    let t = uniform_times_s(0.0, oven.sample_time_s, r.len());
    let csv = csv_bytes(&[("t", &t), ("r", &r), ("y", &run.y), ("u", &run.u)])?;
    let mut files = Files::default();
    files.write_with(&recording, |out| out.write_all(&csv))?;

    let signals = Signals {
        name: "three healthy weeks",
        sample_time_s: oven.sample_time_s,
        r: &healthy_r,
        y: &healthy.y,
        u: &healthy.u,
        state: None,
        further: &[],
    };
    let options =
        Options { window_s: Some(0.5 * HOUR_S), false_alarm_every_h: 30.0 * 24.0, ..Options::default() };
    let baseline = calibrate(&[signals], &options)?.file;
    files.write_text(&baseline_path, &baseline.to_toml())?;

    let config = baseline.config()?;
    let mut chart = Chart::new(&config);
    let mut stream = RecordingStream::from_reader(
        &recording.to_string_lossy(),
        Cursor::new(csv),
        &ReadOptions::default(),
    )?;
    let outputs = Outputs { chart: Some(&mut chart), ..Outputs::default() };
    let mut summary = watch(&mut stream, &config, outputs).map_err(|stopped| match stopped {
        Stopped::Input(error) => error,
        Stopped::Writing(error) => Error::new(format!("can't be written: {error}")),
    })?;
    summary.units = oven.units.clone();
    files.write_text(&picture, &chart.figure(&summary).to_svg()?)?;
    let command = report::command_line(std::env::args_os());
    files
        .write_text(&report_path, &page(&summary, &chart, &baseline, stream.columns(), command).to_html()?)?;
    files.commit()?;

    let here = Terminal::here();
    let about = format!(
        "An oven under PI control. From hour {:.0} on its thermometer drifts by {DRIFT_PER_HOUR} degC an hour: by the end the oven \
         is {:.1} degC off, and y still shows the set-point.",
        ONSET_S / HOUR_S,
        true_offset(&run)
    );
    let text = format!(
        "{}\n{}{}\nrecording  {}\nbaseline   {}\npicture    {}\nreport     {}\n",
        here.paragraph(&about),
        screen(&summary, baseline.promise.as_ref(), &here),
        chart.rows(&summary, &here),
        recording.display(),
        baseline_path.display(),
        picture.display(),
        report_path.display()
    );
    output::write_text(Path::new("-"), &text)?;
    let caught = summary.reaches(FailOn::Suspect);
    Ok(if caught { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The oven over random set-points, each held for half an hour.
fn run_oven(oven: &Loop, duration_s: f64, seed: u64) -> Result<(Vec<f64>, Trace)> {
    let ticks = (duration_s / oven.sample_time_s) as usize;
    let hold_ticks = (0.5 * HOUR_S / oven.sample_time_s) as u64;
    let r = Reference::random(60.0, 2.0, hold_ticks, seed).take_samples(ticks);
    let first = r.first().copied().unwrap_or(60.0);
    let holding = (first - oven.plant.drive_offset()) / oven.plant.drive_gain();
    let trace = simulate(oven, &r, &[], seed, Some(&Start::held(first, holding)))?;
    Ok((r, trace))
}

/// How far the true temperature is from the one shown, over the last hour.
fn true_offset(run: &Trace) -> f64 {
    let last = run.y.iter().zip(&run.true_y).rev().take(720);
    let (sum, count) = last.fold((0.0, 0.0), |(sum, n), (y, truth)| (sum + y - truth, n + 1.0));
    sum / f64::max(count, 1.0)
}
