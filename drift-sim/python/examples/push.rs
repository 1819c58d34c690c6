//! What `Monitor.push` of an array is measured against: the same samples through the library alone. Prints seconds, the best of
//! several rounds: `push BASELINE.toml RECORDING.csv ROUNDS`.

use std::path::Path;
use std::time::Instant;

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
        hops = 0;
        let signals = [recording.r.as_slice(), &recording.y, &recording.u];
        runner.ticks_rounded(signals, |n| n as f64 * recording.sample_time_s, |_| hops += 1);
        best = best.min(begun.elapsed().as_secs_f64());
    }
    println!("{best} {hops}");
    Ok(())
}
