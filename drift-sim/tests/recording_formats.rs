//! Files that other tools wrote (`tests/data/make.py` says which) read back as the formulas they hold, and are never
//! more than one line's trouble when damaged.

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
    #[cfg(feature = "parquet")]
    ("loop_none.parquet", "t=t"),
    #[cfg(feature = "parquet")]
    ("loop_snappy.parquet", "t=t"),
    #[cfg(feature = "parquet")]
    ("loop_gzip.parquet", "t=t"),
    #[cfg(feature = "parquet")]
    ("loop_zstd.parquet", "t=t"),
    #[cfg(feature = "parquet")]
    ("loop_brotli.parquet", "t=t"),
    #[cfg(feature = "parquet")]
    ("loop_lz4.parquet", "t=t"),
    ("loop.csv.gz", "t=t"),
    ("vectors_v7.mat", "t=t"),
    ("vectors_v6.mat", "t=t"),
    ("struct.mat", "t=log.time,r=log.SP,y=log.PV,u=log.OP"),
    ("simulink.mat", "t=out.time,r=out.signals.r,y=out.signals.y,u=out.signals.u"),
    ("simulink.mat", "t=m(:,1),r=m(:,2),y=m(:,3),u=m(:,4)"),
    ("vectors_v4.mat", "t=t"),
    ("tables_v7.mat", "t=T.time,r=T.SP,y=T.PV,u=T.OP"),
    ("tables_v7.mat", "t=timed.Time,r=timed.SP,y=timed.PV,u=timed.OP"),
    ("tables_v7.mat", "t=dated.Time,r=dated.SP,y=dated.PV,u=dated.OP"),
    ("tables_v7.mat", "t=rate.Time,r=rate.SP,y=rate.PV,u=rate.OP"),
    #[cfg(feature = "matlab73")]
    ("tables_v73.mat", "t=T.time,r=T.SP,y=T.PV,u=T.OP"),
    #[cfg(feature = "matlab73")]
    ("tables_v73.mat", "t=timed.Time,r=timed.SP,y=timed.PV,u=timed.OP"),
    #[cfg(feature = "matlab73")]
    ("tables_v73.mat", "t=dated.Time,r=dated.SP,y=dated.PV,u=dated.OP"),
    #[cfg(feature = "matlab73")]
    ("tables_v73.mat", "t=rate.Time,r=rate.SP,y=rate.PV,u=rate.OP"),
    #[cfg(feature = "matlab73")]
    ("vectors_v73.mat", "t=log.time,r=log.SP,y=log.PV,u=log.OP"),
    #[cfg(feature = "matlab73")]
    ("vectors_v73.mat", "t=m(:,1),r=m(:,2),y=m(:,3),u=m(:,4)"),
    #[cfg(feature = "matlab73")]
    ("plain.h5", "t=loop.t,r=loop.r,y=loop.y,u=loop.u"),
    #[cfg(feature = "matlab73")]
    ("plain.h5", "t=data(:,1),r=data(:,2),y=data(:,3),u=data(:,4)"),
    #[cfg(feature = "mcap")]
    ("bag.mcap", "r=/wanted.data,y=/sensor.y,u=/control.data"),
    #[cfg(feature = "mcap")]
    ("json.mcap", "r=/loop.sp,y=/loop.pv,u=/loop.drive.op"),
    FLIGHT,
];

/// Its u is in single precision, and before the first r there is none.
const FLIGHT: (&str, &str) = ("flight.ulg", "r=wanted.r,y=sensor.y,u=control.u");

#[test]
fn every_file_holds_what_was_written() {
    for (name, columns) in FILES {
        let recording = read(file(name), &with_columns(columns)).unwrap_or_else(|e| panic!("{name}: {e}"));
        if *name != FLIGHT.0 {
            holds_the_formulas(&recording);
        }
    }
}

#[test]
fn names_in_a_matlab_file_are_guessed_by_their_last_part() {
    let recording = read(file("struct.mat"), &ReadOptions::default()).unwrap();
    holds_the_formulas(&recording);
    assert_eq!(
        recording.quality.notes,
        [
            "columns guessed by their names: t = 'log.time', r = 'log.SP', y = 'log.PV', u = 'log.OP' (--columns says \
          otherwise)",
            "rows where 'log.mode' is 0 don't count, where u stays put: u moves in 99 % of the rows where it is 1 (--when \
          \"log.mode=N\" or --when always says otherwise)"
        ]
    );
    let options =
        ReadOptions { when: vec!["log.mode=1".parse().unwrap()], keep_extra: true, ..ReadOptions::default() };
    let recording = read(file("struct.mat"), &options).unwrap();
    assert_eq!(recording.quality.manual, 10);
    assert_eq!(recording.state[9..11], [RowState::Manual, RowState::Valid]);
    // Of another length, and not asked for: it has no place among these rows.
    assert_eq!(recording.extra.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["log.mode"]);
}

/// Simulink's structure with time has a label for each signal, dSPACE's recorder a name: each is called by it.
#[test]
fn signals_of_a_struct_array_go_by_their_own_names() {
    let names = |file_name: &str| {
        let recording = read(file(file_name), &ReadOptions::default()).unwrap();
        holds_the_formulas(&recording);
        let of = recording.columns;
        [of.t.unwrap_or_default(), of.r, of.y, of.u]
    };
    assert_eq!(names("simulink.mat"), ["out.time", "out.signals.r", "out.signals.y", "out.signals.u"]);
    assert_eq!(
        names("dspace.mat"),
        [
            "run_001.X.time",
            "run_001.Y.Model Root/Reference/Out1",
            "run_001.Y.Model Root/Plant/Out1",
            "run_001.Y.Model Root/PID Controller/Out1"
        ]
    );
}

#[test]
fn what_a_matlab_file_lacks_is_said_in_one_line() {
    let message =
        |name: &str, columns: &str| read(file(name), &with_columns(columns)).unwrap_err().to_string();
    assert_eq!(
        message("struct.mat", "r=log.ref"),
        "x: no column 'log.ref' for r; like --columns t=log.time,r=log.SP,y=log.PV,u=log.OP; the columns are log.time, log.SP, log.PV, log.OP, log.mode, log.other_rate"
    );
    assert_eq!(
        message("struct.mat", "r=log.other_rate"),
        "x: 'log.other_rate' has 7 values, 'log.PV' has 120; equally many; other columns by --columns \
         r=log.other_rate,y=log.PV,u=log.OP"
    );
}

/// Dates, a first time and a step, categories and strings of tables.
#[test]
fn tables_of_matlab_hold_times_and_words() {
    let files = [("tables_v7.mat", true), ("tables_v73.mat", cfg!(feature = "matlab73"))];
    for (name, _) in files.into_iter().filter(|(_, is_read)| *is_read) {
        let dated = read(file(name), &with_columns("t=dated.Time,r=dated.SP,y=dated.PV,u=dated.OP")).unwrap();
        assert_eq!(dated.zero_s, Some(1_714_564_800.0));
        assert!(dated.quality.notes.contains(&"t counts from 2024-05-01T12:00:00".to_owned()), "{name}");
        let step = read(file(name), &with_columns("t=step.Time,r=step.SP,y=step.PV,u=step.OP")).unwrap();
        assert_eq!((step.start_s, step.sample_time_s, step.len()), (0.5, 0.1, 120));
        for column in ["T.mode", "T.state"] {
            let options = ReadOptions {
                when: vec![format!("{column}=AUTO").parse().unwrap()],
                ..with_columns("t=T.time,r=T.SP,y=T.PV,u=T.OP")
            };
            assert_eq!(read(file(name), &options).unwrap().quality.manual, 10, "{name} {column}");
        }
    }
}

/// An object without what it refers to, or in a layout that isn't known, is named with the line that exports it.
#[test]
fn objects_of_matlab_that_cannot_be_read_are_named() {
    let element = |kind: u32, data: &[u8]| {
        let mut bytes = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    };
    let object = |name: &str, class: &str| {
        let inside = [
            element(6, &[17, 0, 0, 0, 0, 0, 0, 0]),
            element(1, name.as_bytes()),
            element(1, b"MCOS"),
            element(1, class.as_bytes()),
        ];
        element(14, &inside.concat())
    };
    let header = [&[b' '; 124], b"\x00\x01IM".as_slice()].concat();
    for (class, exported) in [
        ("table", "writetable(T, 'file.csv')"),
        ("timetable", "writetimetable(T, 'file.csv')"),
        ("timeseries", "t = T.Time; y = T.Data; save('file.mat', 't', 'y')"),
    ] {
        assert_eq!(
            read([header.clone(), object("T", class)].concat(), &ReadOptions::default())
                .unwrap_err()
                .to_string(),
            format!("x: 'T' is a {class} that can't be read here; in MATLAB: {exported}")
        );
    }
    // Beside columns that are read it is told.
    let [r, y, u] = formulas();
    let vector = |name: &str, values: &[f64]| {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let inside = [
            element(6, &[6, 0, 0, 0, 0, 0, 0, 0]),
            element(5, &[(values.len() as u32).to_le_bytes(), 1_u32.to_le_bytes()].concat()),
            element(1, name.as_bytes()),
            element(9, &bytes),
        ];
        element(14, &inside.concat())
    };
    let all = [header, vector("r", &r), object("T", "timetable"), vector("y", &y), vector("u", &u)].concat();
    let options = ReadOptions { sample_time_s: Some(0.1), ..with_columns("t=,r=r,y=y,u=u") };
    let recording = read(all, &options).unwrap();
    assert_eq!(recording.y, y);
    assert_eq!(
        recording.quality.notes,
        ["'T' is a timetable that can't be read here; in MATLAB: writetimetable(T, 'file.csv')"]
    );
}

#[cfg(feature = "matlab73")]
#[test]
fn names_in_a_file_of_version_7_3_are_guessed() {
    let recording = read(file("vectors_v73.mat"), &ReadOptions::default()).unwrap();
    holds_the_formulas(&recording);
}

#[cfg(feature = "mcap")]
#[test]
fn what_a_bag_lacks_is_said_with_an_example() {
    let options = with_columns("r=/wanted.data,y=/sensor.z,u=/control.data");
    assert_eq!(
        read(file("bag.mcap"), &options).unwrap_err().to_string(),
        "x: no topic and field '/sensor.z' in the bag; like --columns r=/control.data,y=/control.data,u=/control.data; \
         there are /control.data, /sensor.on, /sensor.y, /sensor.pair[0], /wanted.data"
    );
}

#[cfg(not(feature = "matlab73"))]
#[test]
fn without_the_feature_a_file_of_version_7_3_is_known_all_the_same() {
    assert_eq!(
        read(file("vectors_v73.mat"), &ReadOptions::default()).unwrap_err().to_string(),
        "x: this is HDF5 (MATLAB's -v7.3 is), which this build of drift does not read; a build with --features matlab73 (or \
         all-formats)"
    );
}

#[test]
fn topics_of_a_flight_are_put_together() {
    let options = ReadOptions {
        when: vec!["sensor.on=1".parse().unwrap()],
        extra: vec!["sensor[1].y".into(), "sensor.where.pair[1]".into(), "sensor.state".into()],
        ..with_columns(FLIGHT.1)
    };
    let recording = read(file(FLIGHT.0), &options).unwrap();
    let [r, y, u] = formulas();
    #[allow(clippy::cast_possible_truncation, reason = "that is what the file holds")]
    let single: Vec<f64> = u.iter().map(|u| f64::from(*u as f32)).collect();
    assert_eq!((recording.sample_time_s, recording.start_s), (0.1, 0.0));
    assert_eq!((&recording.r, &recording.y, &recording.u), (&r, &y, &single));
    assert_eq!(recording.quality.manual, 10);
    // Each instance a moment before or at y, never after.
    assert_eq!(recording.column("sensor[1].y").unwrap(), y.iter().map(|y| -y).collect::<Vec<_>>());
    assert_eq!(recording.column("sensor.where.pair[1]").unwrap(), [3.0; 120]);
    assert_eq!(recording.column("sensor.state").unwrap(), [-1.0; 120]);
    assert_eq!(
        recording.quality.notes,
        [
            "'wanted.r' holds its last value before each 'sensor.y'",
            "'control.u' holds its last value before each 'sensor.y'",
            "'sensor[1].y' holds its last value before each 'sensor.y'",
            "t counts from 5 s after the start of the system"
        ]
    );
}

#[test]
fn what_a_flight_lacks_is_said_in_one_line() {
    let message = |columns: &str| read(file(FLIGHT.0), &with_columns(columns)).unwrap_err().to_string();
    assert_eq!(
        read(file(FLIGHT.0), &ReadOptions::default()).unwrap_err().to_string(),
        "x: no topic and field 'y' in the ULog file; --columns r=topic.field,y=topic.field,u=topic.field; the topics \
         are control, sensor, sensor[1], wanted"
    );
    assert_eq!(
        message("r=wanted.r,y=sensor.z,u=control.u"),
        "x: no field 'z' in the topic 'sensor'; its fields are timestamp, y, state, where.x, where.pair[0], \
         where.pair[1], on"
    );
}

#[cfg(feature = "parquet")]
#[test]
fn dates_text_flags_and_gaps_of_a_parquet_file_are_read() {
    let options = ReadOptions {
        when: vec!["mode=AUTO".parse().unwrap(), "on=1".parse().unwrap()],
        extra: vec!["gaps".into(), "y32".into()],
        ..with_columns("t=time")
    };
    let recording = read(file("loop_snappy.parquet"), &options).unwrap();
    holds_the_formulas(&recording);
    assert_eq!(recording.quality.notes, ["t counts from 2024-05-01T12:00:00"]);
    assert_eq!(recording.quality.manual, 10);
    let gaps = recording.column("gaps").unwrap();
    assert!(gaps.iter().enumerate().all(|(i, x)| if i % 7 == 0 { x.is_nan() } else { *x == i as f64 }));
    assert_eq!(
        read(file("loop_zstd.parquet"), &with_columns("u=mode")).unwrap_err().to_string(),
        "x:1: 'MAN' in column 'mode' is not a number; numbers, or another column, like --columns t=t,r=r,y=y,u=u"
    );
}

#[cfg(not(feature = "parquet"))]
#[test]
fn without_the_feature_a_parquet_file_is_known_all_the_same() {
    assert_eq!(
        read(file("loop_zstd.parquet"), &ReadOptions::default()).unwrap_err().to_string(),
        "x: this is a Parquet file, which this build of drift does not read; a build with --features parquet (or \
         all-formats)"
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

/// One byte with which the library's decoder panics instead of refusing.
#[cfg(feature = "parquet")]
#[test]
fn a_panic_of_the_decoder_is_one_line() {
    let mut bytes = file("loop_lz4.parquet");
    bytes[1562] = 18;
    let error = read(bytes, &with_columns("t=t")).unwrap_err().to_string();
    assert_eq!(error, "x: the Parquet file is cut off or damaged");
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
