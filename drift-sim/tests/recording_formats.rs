//! Files that other tools wrote (`tests/data/make.py` says which) read back as the formulas they hold, and are never
//! more than one line's trouble when damaged.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "tests fail by panicking, their own functions too"
)]

use std::io::Cursor;
use std::path::PathBuf;

use drift_sim::recording::{ReadOptions, Recording, RowState};
use proptest::prelude::*;

fn file(name: &str) -> Vec<u8> {
    std::fs::read(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)).unwrap()
}

fn read(bytes: Vec<u8>, options: &ReadOptions) -> drift_sim::Result<Recording> {
    Recording::from_reader("x", Cursor::new(bytes), options)
}

fn with_columns(columns: &str) -> ReadOptions {
    ReadOptions { columns: columns.parse().unwrap(), ..ReadOptions::default() }
}

/// The formulas of make.py.
fn formulas() -> [Vec<f64>; 3] {
    let k = 0..120_u32;
    [
        k.clone().map(|k| f64::from(k / 40)).collect(),
        k.clone().map(|k| f64::from(k * 7919 % 101) / 101.0).collect(),
        k.map(|k| f64::from(k * k % 97) / 97.0 - 0.5).collect(),
    ]
}

#[track_caller]
fn holds_the_formulas(recording: &Recording) {
    let [r, y, u] = formulas();
    assert_eq!((recording.sample_time_s, recording.start_s), (0.1, 0.0));
    assert_eq!((&recording.r, &recording.y, &recording.u), (&r, &y, &u));
    assert_eq!((recording.quality.rows, recording.quality.samples), (120, 120));
}

/// Every file with columns that it is read by.
const FILES: &[(&str, &str)] = &[
    ("loop.csv.gz", "t=t"),
    ("vectors_v7.mat", "t=t"),
    ("vectors_v6.mat", "t=t"),
    ("struct.mat", "t=log.time,r=log.SP,y=log.PV,u=log.OP"),
    ("simulink.mat", "t=out.time,r=out.signals(1).values,y=out.signals(2).values,u=out.signals(3).values"),
    ("simulink.mat", "t=m(:,1),r=m(:,2),y=m(:,3),u=m(:,4)"),
];

#[test]
fn every_file_holds_what_was_written() {
    for (name, columns) in FILES {
        let recording = read(file(name), &with_columns(columns)).unwrap_or_else(|e| panic!("{name}: {e}"));
        holds_the_formulas(&recording);
    }
}

#[test]
fn names_in_a_matlab_file_are_guessed_by_their_last_part() {
    let recording = read(file("struct.mat"), &ReadOptions::default()).unwrap();
    holds_the_formulas(&recording);
    assert_eq!(
        recording.quality.notes,
        ["columns guessed by their names: t = 'log.time', r = 'log.SP', y = 'log.PV', u = 'log.OP' (--columns says \
          otherwise)"]
    );
    let options = ReadOptions { when: vec!["log.mode=1".parse().unwrap()], keep_extra: true, ..ReadOptions::default() };
    let recording = read(file("struct.mat"), &options).unwrap();
    assert_eq!(recording.quality.manual, 10);
    assert_eq!(recording.state[9..11], [RowState::Manual, RowState::Valid]);
    // Of another length, and not asked for: it has no place among these rows.
    assert_eq!(recording.extra.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["log.mode"]);
}

#[test]
fn what_a_matlab_file_lacks_is_said_in_one_line() {
    let message = |name: &str, columns: &str| read(file(name), &with_columns(columns)).unwrap_err().to_string();
    assert_eq!(
        message("struct.mat", "r=log.ref"),
        "x: no column 'log.ref' for r; the columns are log.time, log.SP, log.PV, log.OP, log.mode, log.other_rate"
    );
    assert_eq!(
        message("struct.mat", "r=log.other_rate"),
        "x: 'log.other_rate' has 7 values, 'log.PV' has 120; equally many"
    );
    let mut of_version_7_3 = vec![0; 512];
    of_version_7_3[..19].copy_from_slice(b"MATLAB 7.3 MAT-file");
    of_version_7_3.extend(b"\x89HDF\r\n\x1a\n");
    assert_eq!(
        read(of_version_7_3, &ReadOptions::default()).unwrap_err().to_string(),
        "x: this is HDF5, which MATLAB's -v7.3 writes too; in MATLAB: save('file.mat', 'r', 'y', 'u', '-v7')"
    );
}

#[track_caller]
fn is_a_recording_or_one_line(name: &str, bytes: Vec<u8>, options: &ReadOptions) {
    match read(bytes, options) {
        Ok(recording) => {
            assert!(recording.sample_time_s > 0.0 && !recording.is_empty(), "{name}");
            assert_eq!(recording.y.len(), recording.len());
        }
        Err(error) => {
            let text = error.to_string();
            assert!(text.starts_with("x:") && !text.chars().any(char::is_control), "{name}: {text:?}");
        }
    }
}

#[test]
fn a_file_that_is_cut_off_is_one_line_or_shorter() {
    for (name, columns) in FILES {
        let (bytes, options) = (file(name), with_columns(columns));
        for length in (0..bytes.len()).step_by(7) {
            is_a_recording_or_one_line(name, bytes[..length].to_vec(), &options);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes_never_make_it_panic(
        which in 0..FILES.len(),
        flips in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..6),
        near_the_start in any::<bool>(),
    ) {
        let (name, columns) = FILES[which];
        let mut bytes = file(name);
        let reach = if near_the_start { bytes.len().min(400) } else { bytes.len() };
        for (at, value) in flips {
            bytes[at.index(reach)] = value;
        }
        is_a_recording_or_one_line(name, bytes, &with_columns(columns));
    }
}
