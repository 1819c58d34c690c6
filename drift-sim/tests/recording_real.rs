//! Recordings of real loops, where they are at hand (`DRIFT_RECORDINGS`): each is read whole.

use std::path::{Path, PathBuf};

use drift_sim::recording::{ReadOptions, Recording};

fn folder() -> Option<PathBuf> {
    let default = || concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/recordings").into();
    let folder: PathBuf = std::env::var_os("DRIFT_RECORDINGS").map_or_else(default, PathBuf::from);
    if !folder.is_dir() {
        eprintln!("skipped: no recordings in {}", folder.display());
        return None;
    }
    Some(folder)
}

fn csv_files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .flat_map(|path| if path.is_dir() { csv_files(&path) } else { vec![path] })
        .filter(|path| path.extension().is_some_and(|e| e == "csv"))
        .collect();
    files.sort();
    files
}

#[test]
fn every_real_recording_is_read_at_its_rate() {
    let Some(folder) = folder() else { return };
    // The rates that the loggers were set to.
    let expected = [
        ("emps", 0.001),
        ("ce103_thermal", 0.066),
        ("ce110_servo/pos", 0.1),
        ("ce110_servo/vel", 0.066),
        ("tclab", 1.0),
        ("ahu", 60.0),
        ("stiction_plant", 10.0),
    ];
    let files = csv_files(&folder);
    assert!(!files.is_empty(), "no CSV file in {}", folder.display());
    for file in files {
        let name = file.strip_prefix(&folder).unwrap().to_string_lossy().into_owned();
        let mut options = ReadOptions { keep_extra: true, ..ReadOptions::default() };
        let read = Recording::read(&file, &options);
        if name.starts_with("bam_xl330") {
            // Its logger took a sample whenever the bus was free: real jitter, which nobody may miss.
            let error = read.unwrap_err().to_string();
            println!("{error}");
            assert!(
                error.contains("the sampling is not uniform") && error.contains("--resample 0.00"),
                "{error}"
            );
            options.resample_s = Some(0.005);
            let resampled = Recording::read(&file, &options).unwrap();
            println!("{name}: {}", resampled.quality);
            assert_eq!(resampled.len(), (resampled.duration_s() / 0.005).round() as usize);
            continue;
        }
        let recording = read.unwrap_or_else(|e| panic!("{e}"));
        println!("{name}: Ts {} s, {}", recording.sample_time_s, recording.quality);
        println!("    stamps within {:.2e} s of the grid", recording.quality.time_deviation_max_s);
        let rate = expected.iter().find(|(start, _)| name.starts_with(start));
        if let Some((_, sample_time_s)) = rate {
            assert_eq!(recording.sample_time_s, *sample_time_s, "{name}");
        }
        assert_eq!(recording.quality.gaps, 0, "{name}");
        assert_eq!(recording.len() as u64, recording.quality.rows, "{name}");
    }
}

/// A printer's log as its users send it: both heaters, at 1 Hz.
#[test]
fn a_printers_log_is_read_with_the_law_that_it_states() {
    let Some(file) = folder().map(|folder| folder.join("klipper/klippy.log")).filter(|file| file.exists())
    else {
        return;
    };
    for (columns, name) in [("t=time", "extruder"), ("y=heater_bed.temp", "heater_bed")] {
        let columns = columns.parse().unwrap();
        let options = ReadOptions { columns, resample_s: Some(1.0), ..ReadOptions::default() };
        let recording = Recording::read(&file, &options).unwrap();
        assert_eq!(recording.columns.u, format!("{name}.pwm"));
        assert!(recording.len() > 2600 && recording.u.iter().all(|u| u.is_nan() || (0.0..=1.0).contains(u)));
        let law = format!("the configuration states the law of {name}: pid, kp = ");
        assert!(
            recording.quality.notes.iter().any(|note| note.starts_with(&law)),
            "{:?}",
            recording.quality.notes
        );
    }
}

/// Two flights as the flight controller wrote them: the controller's output is the sum of its terms, and y follows r.
#[cfg(feature = "blackbox")]
#[test]
fn flights_are_read_axis_by_axis() {
    let Some(folder) = folder().map(|folder| folder.join("betaflight")).filter(|folder| folder.is_dir())
    else {
        return;
    };
    for (name, axis) in [("btfl_001.bbl", 0), ("btfl_001.bbl", 1), ("LOG00037.BFL", 0)] {
        let columns = format!("y=gyroADC[{axis}]").parse().unwrap();
        let mut options = ReadOptions { columns, ..ReadOptions::default() };
        options.extra = ["axisP", "axisI"].map(|term| format!("{term}[{axis}]")).to_vec();
        options.resample_s = Some(0.002);
        let recording = Recording::read(&folder.join(name), &options).unwrap_or_else(|e| panic!("{e}"));
        println!("{name}: {}, {:?}", recording.quality, recording.quality.notes);
        assert!(recording.len() > 1000, "{name}: {}", recording.len());
        assert_eq!(recording.columns.u, format!("pid[{axis}]"));
        let gyro = recording.y.iter().copied().filter(|y| y.is_finite());
        assert!(gyro.clone().any(|y| y.abs() > 5.0) && gyro.clone().all(|y| y.abs() < 4000.0), "{name}");
    }
}
