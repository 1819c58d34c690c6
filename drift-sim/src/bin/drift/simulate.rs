//! `drift simulate`: runs a loop and writes `t, r, y, u` (and the loop's measured inputs).

use std::io::{IsTerminal, Read};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use drift_sim::control_loop::Loop;
use drift_sim::controller::Controller;
use drift_sim::output::write_with;
use drift_sim::reference::Reference;
use drift_sim::simulate::{Simulation, Start, diverged};
use drift_sim::{Error, Result};
use indicatif::{ProgressBar, ProgressStyle};

/// Runs a loop; the reference comes from a recording, or is made: random levels as in the paper, or one level.
#[derive(Args)]
pub struct Arguments {
    /// The loop file; `-` for standard input.
    #[arg(value_name = "LOOP.toml")]
    loop_file: PathBuf,
    /// Where the run is written, as CSV; `-` for standard output.
    #[arg(short, long, value_name = "OUT.csv")]
    output: PathBuf,
    /// Takes r and the loop's inputs from this recording and starts from its first y and u; a loop with a recorded
    /// controller takes its u too.
    #[arg(long, value_name = "REC.csv", conflicts_with_all = ["reference_mean", "reference_sd", "reference_hold"])]
    reference: Option<PathBuf>,
    /// Other names of the recording's columns, such as r=SP,y=PV,u=OP.
    #[arg(long, value_name = "NAME=COLUMN,...", requires = "reference", value_delimiter = ',')]
    columns: Vec<String>,
    /// Length of the run in seconds; by default 10000 samples, or the whole recording.
    #[arg(long, value_name = "S", value_parser = positive)]
    duration: Option<f64>,
    /// All noise, and a made reference, follow from this number.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Mean of the made reference's levels, in the unit of r.
    #[arg(long, value_name = "R", default_value_t = 0.1, allow_negative_numbers = true, value_parser = finite)]
    reference_mean: f64,
    /// Standard deviation of its levels; 0 for one level.
    #[arg(long, value_name = "R", default_value_t = 1.0, value_parser = not_negative)]
    reference_sd: f64,
    /// How long each level is held, in samples.
    #[arg(long, value_name = "TICKS", default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..))]
    reference_hold: u64,
}

fn finite(text: &str) -> std::result::Result<f64, String> {
    text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| "not a finite number".to_string())
}

fn positive(text: &str) -> std::result::Result<f64, String> {
    finite(text).and_then(|value| if value > 0.0 { Ok(value) } else { Err("must be > 0".to_string()) })
}

fn not_negative(text: &str) -> std::result::Result<f64, String> {
    finite(text).and_then(|value| if value >= 0.0 { Ok(value) } else { Err("must be >= 0".to_string()) })
}

/// Samples of a run whose length nobody states.
const DEFAULT_SAMPLES: usize = 10_000;

/// More would be a mistake in the duration: years of a fast loop, tens of gigabytes.
const MOST_SAMPLES: f64 = 1e9;

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let model = Loop::read(&arguments.loop_file)?;
    let in_loop_file = |error: Error| error.in_file(&arguments.loop_file);
    let asked = arguments.duration.map(|duration| samples(duration, model.sample_time_s)).transpose()?;
    let mut simulation = Simulation::new(&model, arguments.seed).map_err(in_loop_file)?;
    if let Some(path) = &arguments.reference {
        let recorded = Driving::read(path, &model, &arguments.columns)?;
        simulation
            .start(&Start::from_recording(&model, &recorded.r, &recorded.y, &recorded.u))
            .map_err(in_loop_file)?;
        let length = asked.map_or(recorded.r.len(), |asked| asked.min(recorded.r.len()));
        let row = |n: usize| recorded.row(n);
        return write(arguments, &model, simulation, length, row);
    }
    if model.controller == Controller::Recorded {
        let error = Error::new("controller kind 'recorded' has no law to close the loop with");
        return Err(in_loop_file(error.allowed("pi, pid, p-velocity; or --reference REC.csv with its u")));
    }
    if !model.inputs.is_empty() {
        let error = Error::new("the loop has measured inputs, and no recording to take them from");
        return Err(in_loop_file(error.allowed("--reference REC.csv with their columns")));
    }
    let Arguments { reference_mean, reference_sd, reference_hold, seed, .. } = *arguments;
    let mut reference = Reference::random(reference_mean, reference_sd, reference_hold, seed);
    let row = |_: usize| Row { r: reference.next().unwrap_or(reference_mean), u: None, inputs: Vec::new() };
    write(arguments, &model, simulation, asked.unwrap_or(DEFAULT_SAMPLES), row)
}

fn samples(duration_s: f64, sample_time_s: f64) -> Result<usize> {
    let samples = (duration_s / sample_time_s).round().max(1.0);
    if samples > MOST_SAMPLES {
        let allowed = format!("--duration up to {} s at this sample time", MOST_SAMPLES * sample_time_s);
        return Err(Error::new(format!("--duration {duration_s} is {samples} samples")).allowed(allowed));
    }
    Ok(samples as usize)
}

/// What drives one sample.
struct Row {
    r: f64,
    /// Only where the controller is recorded.
    u: Option<f64>,
    inputs: Vec<f64>,
}

fn write(
    arguments: &Arguments,
    model: &Loop,
    mut simulation: Simulation,
    length: usize,
    mut row: impl FnMut(usize) -> Row,
) -> Result<ExitCode> {
    let progress = progress(length as u64);
    let mut failed = None;
    let written = write_with(&arguments.output, |out| {
        write!(out, "t,r,y,u")?;
        for input in &model.inputs {
            write!(out, ",{}", quoted(&input.column))?;
        }
        writeln!(out)?;
        for n in 0..length {
            let Row { r, u, inputs } = row(n);
            let t = time(n, model.sample_time_s);
            let step = match u {
                Some(u) => simulation.replay_step(u, &inputs),
                None => simulation.step(r, &inputs),
            };
            if !(step.y.is_finite() && step.u.is_finite()) {
                failed = Some(diverged(t).in_file(&arguments.loop_file));
                return Err(std::io::Error::other("diverged"));
            }
            write!(out, "{t},{r},{},{}", step.y, step.u)?;
            for input in &inputs {
                write!(out, ",{input}")?;
            }
            writeln!(out)?;
            if n % 65_536 == 0 {
                progress.set_position(n as u64);
            }
        }
        Ok(())
    });
    progress.finish_and_clear();
    failed.map_or(written, Err)?;
    Ok(ExitCode::SUCCESS)
}

/// n*Ts without the last digits that the product's rounding adds, where nine decimals of a sample say it all.
fn time(n: usize, sample_time_s: f64) -> f64 {
    let per_second = (1.0 / sample_time_s).round();
    if (per_second * sample_time_s - 1.0).abs() < 1e-15 {
        n as f64 / per_second
    } else {
        n as f64 * sample_time_s
    }
}

/// A column's name as CSV wants it.
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_string()
    }
}

/// A bar on a terminal, nothing in a pipe; none for what is done in a blink.
fn progress(length: u64) -> ProgressBar {
    if length < 1_000_000 || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:40} {percent} % of {len} samples, {eta} left");
    ProgressBar::new(length).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// What a recording gives to a simulation.
struct Driving {
    r: Vec<f64>,
    y: Vec<f64>,
    u: Vec<f64>,
    /// One column for each of the loop's inputs.
    inputs: Vec<Vec<f64>>,
    recorded_controller: bool,
}

impl Driving {
    fn row(&self, n: usize) -> Row {
        let at = |column: &[f64]| column.get(n).copied().unwrap_or(f64::NAN);
        let u = self.recorded_controller.then(|| at(&self.u));
        Row { r: at(&self.r), u, inputs: self.inputs.iter().map(|column| at(column)).collect() }
    }

    /// Needs of a recording: the columns r, y and u (by the names that `--columns` gives them) and one column by
    /// name for each of the loop's inputs, all of the same length, finite numbers.
    fn read(path: &Path, model: &Loop, columns: &[String]) -> Result<Self> {
        let mut names = [("r", "r"), ("y", "y"), ("u", "u"), ("t", "t")];
        for pair in columns {
            let known = pair
                .split_once('=')
                .and_then(|(name, column)| Some((names.iter_mut().find(|own| own.0 == name)?, column)));
            let Some((own, column)) = known else {
                return Err(Error::new(format!("--columns {pair}")).allowed("t=NAME, r=NAME, y=NAME, u=NAME"));
            };
            own.1 = column;
        }
        let [r, y, u, _] = names.map(|(_, column)| column);
        let inputs: Vec<&str> = model.inputs.iter().map(|input| input.column.as_str()).collect();
        let mut table = read_columns(path, &[&[r, y, u], inputs.as_slice()].concat())?.into_iter();
        let mut next = || table.next().unwrap_or_default();
        let (r, y, u) = (next(), next(), next());
        let recorded_controller = model.controller == Controller::Recorded;
        Ok(Self { r, y, u, inputs: inputs.iter().map(|_| next()).collect(), recorded_controller })
    }
}

/// Columns of a CSV file by name.
fn read_columns(path: &Path, wanted: &[&str]) -> Result<Vec<Vec<f64>>> {
    let refused = |error: csv::Error| {
        let line = error.position().map(csv::Position::line);
        let error = Error::new(format!("can't be read as CSV: {error}")).in_file(path);
        line.map_or(error.clone(), |line| error.at_line(line))
    };
    let unreadable = |e: std::io::Error| Error::new(format!("can't be read: {e}")).in_file(path);
    let source: Box<dyn Read> = if path == Path::new("-") {
        Box::new(std::io::stdin().lock())
    } else {
        Box::new(std::fs::File::open(path).map_err(unreadable)?)
    };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(source);
    let header = reader.headers().map_err(refused)?.clone();
    let index = |name: &&str| {
        let there = header.iter().collect::<Vec<_>>().join(", ");
        let error = || {
            Error::new(format!("no column '{name}'"))
                .allowed(format!("there are: {there}"))
                .in_file(path)
                .at_line(1)
        };
        header.iter().position(|column| column == *name).ok_or_else(error)
    };
    let indices = wanted.iter().map(index).collect::<Result<Vec<_>>>()?;
    let mut columns = vec![Vec::new(); wanted.len()];
    for record in reader.records() {
        let record = record.map_err(refused)?;
        for ((column, index), name) in columns.iter_mut().zip(&indices).zip(wanted) {
            let text = record.get(*index).unwrap_or("");
            let value = text.parse().ok().filter(|value: &f64| value.is_finite());
            let line = record.position().map_or(0, csv::Position::line);
            let error = || {
                Error::new(format!("{name} is '{text}'"))
                    .allowed("a finite number")
                    .in_file(path)
                    .at_line(line)
            };
            column.push(value.ok_or_else(error)?);
        }
    }
    if columns.first().is_none_or(Vec::is_empty) {
        return Err(Error::new("the recording has no rows").in_file(path));
    }
    Ok(columns)
}
