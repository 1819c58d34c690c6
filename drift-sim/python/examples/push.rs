//! What `Monitor.push` of an array is measured against: the same samples through the library alone. Prints seconds, the best of
//! several rounds: `push BASELINE.toml RECORDING.csv ROUNDS`.

use std::path::Path;
use std::time::Instant;

use drift_core::Input;
use drift_sim::baseline_file::BaselineFile;
use drift_sim::monitor::Runner;
use drift_sim::recording::{ReadOptions, Recording};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, baseline, recording, rounds] = arguments.as_slice() else {
        return Err("push BASELINE.toml RECORDING.csv ROUNDS".into());
    };
    let baseline = BaselineFile::read(Path::new(baseline))?;
    let recording = Recording::read(Path::new(recording), &ReadOptions::default())?;
    let (mut best, mut hops) = (f64::INFINITY, 0);
    for _ in 0..rounds.parse::<usize>()? {
        let mut runner = Runner::new(&baseline.config()?, recording.sample_time_s)?;
        let begun = Instant::now();
        let samples = recording.r.iter().zip(&recording.y).zip(&recording.u).enumerate();
        let decisions = samples.filter_map(|(n, ((r, y), u))| {
            let (r, y, u) = (*r as f32, *y as f32, *u as f32);
            let missing = r.is_nan() || y.is_nan() || u.is_nan();
            let input = if missing { Input::Missing } else { Input::Sample { r, y, u } };
            runner.tick(n as f64 * recording.sample_time_s, input)
        });
        hops = decisions.count();
        best = best.min(begun.elapsed().as_secs_f64());
    }
    println!("{best} {hops}");
    Ok(())
}
