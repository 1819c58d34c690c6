//! Loops of a made plant: random first-order plants with dead time under PI, some of them with a fault from the middle on. Of each a healthy
//! recording and a later one, as rows of Parquet or CSV.

use std::path::Path;
use std::sync::Arc;

use datafusion::arrow::array::{ArrayRef, Float64Array, RecordBatch, StringArray};
use datafusion::parquet::arrow::ArrowWriter;
use datafusion::parquet::file::properties::WriterProperties;
use datafusion::parquet::schema::types::ColumnPath;
use drift_sim::control_loop::Loop;
use drift_sim::reference::Reference;
use drift_sim::simulate::Simulation;

/// A loop's recording.
#[derive(Clone)]
pub struct Run {
    pub tag: String,
    pub t: Vec<f64>,
    pub r: Vec<f64>,
    pub y: Vec<f64>,
    pub u: Vec<f64>,
}

/// Numbers that look random, the same on every machine.
pub struct Dice(u64);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// From 0 to 1 (splitmix64).
    pub fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.roll()
    }
}

/// The loop's name.
pub fn tag(number: usize) -> String {
    format!("FIC-{number:05}")
}

/// The loop's file; `fault_from_s` where every second loop gets a fault.
fn toml(number: usize, fault_from_s: Option<f64>) -> (String, f64) {
    let mut dice = Dice::new(number as u64 + 1);
    let sample_time_s = [0.2, 0.5, 1.0, 2.0][(dice.roll() * 4.0) as usize % 4];
    let time_constant_s = sample_time_s * dice.between(5.0, 20.0);
    let delay_s = sample_time_s * dice.between(0.0, 5.0);
    let gain = dice.between(0.5, 3.0);
    let kp = time_constant_s / (gain * (time_constant_s + delay_s));
    let ki = kp / time_constant_s;
    let mut text = format!(
        "[loop]\nsample_time_s = {sample_time_s}\n[controller]\nkind = \"pi\"\nkp = {kp}\nki = {ki}\nu_min = -100.0\nu_max = 200.0\n\
         [plant]\nkind = \"first-order\"\ngain = {gain}\ntime_constant_s = {time_constant_s}\ndelay_s = {delay_s}\n[sensor]\nnoise = {}\n",
        dice.between(0.02, 0.2)
    );
    if let Some(from_s) = fault_from_s.filter(|_| number % 2 == 1) {
        text += &format!(
            "[[physics]]\nkind = \"gain_loss\"\nloss = {}\nonset_s = {from_s}\n",
            dice.between(0.05, 0.4)
        );
    }
    (text, sample_time_s)
}

/// A recording that is made part by part, so that a long one is never held.
pub struct Making {
    tag: String,
    sample_time_s: f64,
    simulation: Simulation,
    reference: Reference,
    made: usize,
}

impl Making {
    /// Of a loop's `samples`; with a fault from the middle on where it is not `healthy` and the loop has one.
    pub fn new(number: usize, samples: usize, healthy: bool) -> Self {
        let sample_time_s = toml(number, None).1;
        let middle = (!healthy).then_some((samples / 2) as f64 * sample_time_s);
        let model = Loop::parse(&toml(number, middle).0, "made.toml").unwrap();
        let seed = 2 * number as u64 + u64::from(healthy);
        let simulation = Simulation::new(&model, seed).unwrap();
        let reference = Reference::random(50.0, 5.0, 200, seed);
        Self { tag: tag(number), sample_time_s, simulation, reference, made: 0 }
    }

    /// The next so many samples.
    pub fn part(&mut self, samples: usize) -> Run {
        let mut run =
            Run { tag: self.tag.clone(), t: Vec::new(), r: Vec::new(), y: Vec::new(), u: Vec::new() };
        for n in self.made..self.made + samples {
            let r = self.reference.next().unwrap();
            let step = self.simulation.step(r, &[]);
            run.t.push(drift_sim::simulate::time_s(n, self.sample_time_s));
            run.r.push(r);
            run.y.push(step.y);
            run.u.push(step.u);
        }
        self.made += samples;
        run
    }
}

/// All `samples` of a loop at once.
pub fn run(number: usize, samples: usize, healthy: bool) -> Run {
    Making::new(number, samples, healthy).part(samples)
}

fn batch(run: &Run, rows: std::ops::Range<usize>) -> RecordBatch {
    let numbers = |x: &[f64]| -> ArrayRef { Arc::new(Float64Array::from(x[rows.clone()].to_vec())) };
    let tags: ArrayRef = Arc::new(StringArray::from(vec![run.tag.as_str(); rows.len()]));
    let columns = [
        ("tag", tags),
        ("t", numbers(&run.t)),
        ("SP", numbers(&run.r)),
        ("PV", numbers(&run.y)),
        ("OP", numbers(&run.u)),
    ];
    RecordBatch::try_from_iter(columns).unwrap()
}

/// Writes one run without its name: that of its folder is the column.
pub fn write_unnamed(path: &Path, run: &Run) {
    let rows = batch(run, 0..run.t.len()).project(&[1, 2, 3, 4]).unwrap();
    let mut writer = ArrowWriter::try_new(std::fs::File::create(path).unwrap(), rows.schema(), None).unwrap();
    writer.write(&rows).unwrap();
    writer.close().unwrap();
}

/// Only names are packed by what repeats: measured numbers don't repeat, and those of copied loops must not be smaller for it.
fn packing() -> WriterProperties {
    let plain = WriterProperties::builder().set_dictionary_enabled(false);
    plain.set_column_dictionary_enabled(ColumnPath::from("tag"), true).build()
}

/// Writes the runs to one Parquet file, one after the other (`slice` 0) or by turns, `slice` rows of each, as a historian does.
pub fn write_parquet(path: &Path, runs: &mut dyn Iterator<Item = Run>, slice: usize) {
    let mut writer: Option<ArrowWriter<std::fs::File>> = None;
    let mut write = |batch: &RecordBatch| {
        let create = || {
            let file = std::fs::File::create(path).unwrap();
            ArrowWriter::try_new(file, batch.schema(), Some(packing())).unwrap()
        };
        writer.get_or_insert_with(create).write(batch).unwrap();
    };
    if slice == 0 {
        runs.for_each(|run| write(&batch(&run, 0..run.t.len())));
    } else {
        let runs: Vec<Run> = runs.collect();
        let longest = runs.iter().map(|run| run.t.len()).max().unwrap_or(0);
        for from in (0..longest).step_by(slice) {
            for run in &runs {
                let rows = from.min(run.t.len())..(from + slice).min(run.t.len());
                write(&batch(run, rows));
            }
        }
    }
    writer.unwrap().close().unwrap();
}

/// One CSV file a run, with the columns that `drift monitor` reads.
pub fn write_csv(path: &Path, run: &Run) {
    drift_sim::recording::write_csv(path, &[("t", &run.t), ("SP", &run.r), ("PV", &run.y), ("OP", &run.u)])
        .unwrap();
}
