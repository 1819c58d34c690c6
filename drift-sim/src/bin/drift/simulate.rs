//! `drift simulate`: runs a loop and writes `t, r, y, u` (and the loop's measured inputs).

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use drift_sim::control_loop::Loop;
use drift_sim::output::Outputs;
use drift_sim::reference::Reference;
use drift_sim::shortest::{self, FewDecimals};
use drift_sim::simulate::{DEFAULT_SAMPLES, Driving, Row, Simulation, diverged, samples_within, time_s};
use drift_sim::{Error, Result};

use crate::number_argument::{count, finite, not_negative, seconds, seed};
use crate::progress::Progress;
use crate::recording_arguments::RecordingArguments;

/// Runs a loop; the reference comes from a recording, or is made: random levels as in the paper, or one level.
#[derive(Args)]
#[command(after_help = "\
Examples:
  drift simulate examples/loops/servo.toml --duration 10 --reference-sd 0.1 -o run.csv
  drift simulate loop.toml --reference recording.csv -o run.csv")]
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
    /// Length of the run in seconds; by default 10000 samples, or the whole recording.
    #[arg(long, value_name = "S", value_parser = seconds)]
    duration: Option<f64>,
    /// All noise, and a made reference, follow from this number.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = seed)]
    seed: u64,
    /// Mean of the made reference's levels, in the unit of r.
    #[arg(long, value_name = "R", default_value_t = 0.1, value_parser = finite)]
    reference_mean: f64,
    /// Standard deviation of its levels; 0 for one level.
    #[arg(long, value_name = "R", default_value_t = 1.0, value_parser = not_negative)]
    reference_sd: f64,
    /// How long each level is held, in samples.
    #[arg(long, value_name = "TICKS", default_value_t = 50, value_parser = count)]
    reference_hold: u64,
    #[command(flatten)]
    reading: RecordingArguments,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let mut inputs: Vec<&Path> = vec![&arguments.loop_file];
    inputs.extend(arguments.reference.as_deref());
    let outputs = Outputs::checked(&[("--output", Some(&arguments.output))], &inputs)?;
    let model = Loop::read(&arguments.loop_file)?;
    let in_loop_file = |error: Error| error.in_file(&arguments.loop_file);
    let limit = arguments.reading.memory_limit_bytes();
    let asked = arguments
        .duration
        .map(|duration| samples_within(duration, model.sample_time_s, limit))
        .transpose()?;
    let mut simulation = Simulation::new(&model, arguments.seed).map_err(in_loop_file)?;
    if let Some(path) = &arguments.reference {
        let inputs = model.inputs.iter().map(|input| input.column.clone());
        let recorded = Driving::new(arguments.reading.read(path, inputs.collect(), 0)?, &model)?;
        simulation.start(&recorded.start(&model)).map_err(in_loop_file)?;
        let length = asked.map_or(recorded.len(), |asked| asked.min(recorded.len()));
        let row = |n: usize| recorded.row(n);
        return write(arguments, outputs, &model, simulation, length, row);
    }
    if !model.has_law() {
        let error = Error::new("controller kind 'recorded' has no law to close the loop with");
        return Err(in_loop_file(error.allowed("pi, pid, p-velocity; or --reference REC.csv with its u")));
    }
    if !model.inputs.is_empty() {
        let error = Error::new("the loop has measured inputs, and no recording to take them from");
        return Err(in_loop_file(error.allowed("--reference REC.csv with their columns")));
    }
    let Arguments { reference_mean, reference_sd, reference_hold, seed, .. } = *arguments;
    let mut reference = Reference::random(reference_mean, reference_sd, reference_hold, seed);
    let row = |_: usize| Row::of_reference(reference.next().unwrap_or(reference_mean));
    write(arguments, outputs, &model, simulation, asked.unwrap_or(DEFAULT_SAMPLES), row)
}

/// Text is handed on once it is as long as this.
const BUFFER_BYTES: usize = 1 << 16;

fn write(
    arguments: &Arguments,
    mut outputs: Outputs,
    model: &Loop,
    mut simulation: Simulation,
    length: usize,
    mut row: impl FnMut(usize) -> Row,
) -> Result<ExitCode> {
    let progress = Progress::of_steps("simulating", length as u64);
    let mut failed = None;
    let written = outputs.write_with(&arguments.output, |out| {
        write!(out, "t,r,y,u")?;
        for column in model.input_columns() {
            write!(out, ",{}", quoted(&column))?;
        }
        writeln!(out)?;
        let mut text = Vec::with_capacity(2 * BUFFER_BYTES);
        let (mut times, mut held) = (FewDecimals::default(), Held::default());
        for n in 0..length {
            let Row { r, u, inputs, measured } = row(n);
            let t = time_s(n, model.sample_time_s);
            let step = match u {
                Some(u) => simulation.replay_step(u, &inputs),
                None => simulation.step(r, &inputs),
            };
            if !(step.y.is_finite() && step.u.is_finite()) {
                failed = Some(diverged(t).in_file(&arguments.loop_file));
                return Err(std::io::Error::other("diverged"));
            }
            times.push(&mut text, t);
            text.push(b',');
            held.push(&mut text, r);
            for value in [step.y, step.u].iter().chain(&measured) {
                text.push(b',');
                shortest::push(&mut text, *value);
            }
            text.push(b'\n');
            if text.len() >= BUFFER_BYTES {
                out.write_all(&text)?;
                text.clear();
            }
            if n % 65_536 == 0 {
                progress.at(n as u64);
            }
        }
        out.write_all(&text)
    });
    drop(progress);
    failed.map_or(written, Err)?;
    outputs.commit()?;
    Ok(ExitCode::SUCCESS)
}

/// A value that mostly stays the same from row to row, as text.
#[derive(Default)]
struct Held {
    value: Option<f64>,
    text: Vec<u8>,
}

impl Held {
    fn push(&mut self, text: &mut Vec<u8>, value: f64) {
        if self.value.map(f64::to_bits) != Some(value.to_bits()) {
            self.value = Some(value);
            self.text.clear();
            shortest::push(&mut self.text, value);
        }
        text.extend_from_slice(&self.text);
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
