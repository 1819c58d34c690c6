//! What the reader of recordings makes of good, odd and broken files: each broken one gets one line that names the
//! place, each odd one is read and what was done is counted.

use drift_sim::recording::{ReadOptions, Recording, RecordingStream, RowState};
use proptest::prelude::*;

fn read(text: impl AsRef<[u8]>, options: &ReadOptions) -> drift_sim::Result<Recording> {
    Recording::from_reader("x.csv", std::io::Cursor::new(text.as_ref().to_vec()), options)
}

fn plain() -> ReadOptions {
    ReadOptions::default()
}

fn message(text: impl AsRef<[u8]>) -> String {
    read(text, &plain()).expect_err("it is broken").to_string()
}

#[test]
fn broken_files_are_refused_in_one_line() {
    for (text, expected) in [
        ("", "x.csv: the file is empty; a header and rows of numbers"),
        ("\n\n", "x.csv: the file is empty; a header and rows of numbers"),
        ("t,r,y,u\n", "x.csv: no rows of data, only a header"),
        ("t,r,y,u\n0,1,2,3\n", "x.csv: one row of data only; two at least"),
        (
            "0,1,2,3\n1,1,2,3\n",
            "x.csv:1: the first line holds numbers; a header that names the columns, or --columns t=1,r=2,y=3,u=4",
        ),
        (
            "t,r,y\n0,1,2\n1,1,2\n",
            "x.csv:1: no column 'u' for u; like --columns t=t,r=r,y=y,u=NAME; the columns are t, r, y",
        ),
        (
            "when,r,y,u\n0,1,2,3\n",
            "x.csv:1: no column 't' for t; like --columns t=when,r=r,y=y,u=u or --sample-time S; the columns are when, r, y, u",
        ),
        ("t,SP,ref,y,u\n0,1,2,3,4\n", "x.csv:1: 'SP' and 'ref' could both be r; --columns t=t,r=SP,y=y,u=u"),
        (
            "t,r,y,u,y\n0,1,2,3,4\n",
            "x.csv:1: two columns are called 'y'; names that differ, or columns by their numbers, like --columns r=2,y=3,u=4",
        ),
        ("t,r,y,u\n0,1,2,3\n1,1,off,3\n", "x.csv:3: 'off' in column 'y' is not a number"),
        (
            "t,r,flow,y,u\n0,1,7,off,3\n1,1,8,2,3\n",
            "x.csv:2: 'off' in column 'y' is not a number; numbers, or another column, like --columns t=t,r=r,y=flow,u=u",
        ),
        ("t,r,y,u\n0,1,off,3\n1,1,2,3\n", "x.csv:2: 'off' in column 'y' is not a number; numbers"),
        ("t,r,y,u\r\n0,1,2,3\r\n\r\n1,1,off,3\r\n", "x.csv:4: 'off' in column 'y' is not a number"),
        ("\n\nt,r,y,u\n\n0,1,2,3\n1,1,off,3", "x.csv:6: 'off' in column 'y' is not a number"),
        ("t;r;y;u\n0;1;2.5;3\n1;1;2,5;3\n", "x.csv:3: '2,5' in column 'y' is not a number; a decimal point"),
        (
            "t;r;y;u\n0;1;2,5;3\n1;1;2.5;3\n",
            "x.csv:3: '2.5' has a decimal point, numbers before a decimal comma; one of them in a file",
        ),
        ("t,r,y,u\n0,1,2,3\nnever,1,2,3\n", "x.csv:3: 'never' in column 't' is not a number"),
        ("t,r,y,u\n0,1,2,3\n1,1,2\n", "x.csv:3: 3 fields where the header has 4"),
        ("t,r,y,u\n0,1,2,3\n1,1,2,3,4\n", "x.csv:3: 5 fields where the header has 4"),
        ("t,r,y,u\n0,1,2,3\n,1,2,3\n", "x.csv:3: no time stamp in column 't'"),
        ("t,r,y,u\n0,1,2,3\nnan,1,2,3\n", "x.csv:3: no time stamp in column 't'"),
        (
            "t,r,y,u\n0,1,2,3\n2026-01-01 10:00,1,2,3\n",
            "x.csv:3: '2026-01-01 10:00' in column 't' is not a number",
        ),
        (
            "t,r,y,u\n0,1,2,3\n2,1,2,3\n1,1,2,3\n",
            "x.csv:4: time goes back from 2 to 1 s; --part 1 or --part last, where a recording begins anew there",
        ),
        (
            "t,r,y,u\n0,1,2,3\n0,1,2,3\n0,1,2,3\n",
            "x.csv: the first 3 rows all have the time 0 s; times that differ, or --columns t= --sample-time S",
        ),
        (
            "t,r,y,u\n0,1,2,3\n1,1,2,3\n1,1,2.5,3\n2,1,2,3\n",
            "x.csv:4: the time 1 s again, with other values; --repeated first, last or mean",
        ),
        (
            "t,r,y,u\n0.00,1,2,3\n0.10,1,2,3\n0.20,1,2,3\n0.34,1,2,3\n0.40,1,2,3\n",
            "x.csv: the sampling is not uniform: interval 0.1 s, jitter 0.0283 s rms and at most 0.04 s, at line 5; \
             --resample 0.1",
        ),
        (
            "t,r,y,u\n0,1,2,3\n1,1,2,3\n2,1,2,3\n5000,1,2,3\n",
            "x.csv:5: a gap of 4997 samples, from 2 to 5000 s, after 3; 1000 samples at most",
        ),
        (
            "t,r,y,u\n0,1,2,3\n1,1,2,3\n2,1,2,3\n1e300,1,2,3\n",
            "x.csv:5: a gap of 1e300 samples, from 2 to 1e300 s, after 3; 100000000 samples at most",
        ),
        (
            "t,r,y,u\n-1e308,1,2,3\n1e308,1,2,3\n",
            "x.csv: the time stamps are too large to tell a sample time",
        ),
        ("t,r,y,u\n0,1,2,3\n1,1,a\nb\u{1b},3\n", "x.csv:3: 3 fields where the header has 4"),
        ("t,r,y,u\n0,1,2,3\n1,1,\"a\nb\u{1b}\",3\n", "x.csv:4: 'a b ' in column 'y' is not a number"),
    ] {
        assert_eq!(message(text), expected, "for {text:?}");
    }
}

#[test]
fn broken_bytes_are_refused_in_one_line() {
    assert_eq!(message(b"t,r,y,u\n0,1,2,3\n1,1,\xb0,3\n"), "x.csv:3: '\u{b0}' in column 'y' is not a number");
    assert!(message([0u8; 300]).starts_with("x.csv: this is neither text nor a format that is read; CSV, "));
    let mut quote = b"t,r,y,u\n0,1,2,3\n1,1,\"".to_vec();
    quote.resize(2_000_000, b'5');
    assert!(message(quote).contains("a row of more than 1 MiB"));
}

#[test]
fn a_fault_after_the_rows_read_ahead_is_found_all_the_same() {
    let rows = |last: &str| {
        let mut text = String::from("t,r,y,u\n");
        (0..12_000).for_each(|k| text.push_str(&format!("{:.3},1,2,3\n", f64::from(k) * 0.01)));
        text + last
    };
    for (last, expected) in [
        (
            "120.005,1,2,3\n",
            "x.csv:12002: the time stamp 120.005 s is 0.005 s off the grid of 0.01 s; --resample 0.01",
        ),
        (
            "119.98,1,2,3\n",
            "x.csv:12002: time goes back from 119.99 to 119.98 s; --part 1 or --part last, where a recording begins anew there",
        ),
        (
            "119.99,1,2,4\n",
            "x.csv:12002: the time 119.99 s again, with other values; --repeated first, last or mean",
        ),
        ("120.00,1,x,3\n", "x.csv:12002: 'x' in column 'y' is not a number"),
        (
            "9e9,1,2,3\n",
            "x.csv:12002: a gap of 899999988000 samples, from 120 to 9e9 s, after 12000; 120000 samples at most",
        ),
    ] {
        assert_eq!(message(rows(last)).replace("9000000000", "9e9"), expected);
    }
    let recording = read(rows("120.02,1,2,3\n"), &plain()).unwrap();
    assert_eq!((recording.len(), recording.quality.gap_samples, recording.sample_time_s), (12_003, 2, 0.01));
}

#[test]
fn odd_but_sound_files_are_read() {
    for text in [
        "t,r,y,u\n0,1,2,3\n1,1,2,3\n",
        "\u{feff}t,r,y,u\n0,1,2,3\n1,1,2,3\n",
        "t,r,y,u\r\n0,1,2,3\r\n1,1,2,3\r\n",
        "t,r,y,u\n0,1,2,3\n1,1,2,3",
        "\"t\",\"r\",\"y\",\"u\"\r\n\"0\",\"1\",\"2\",\"3\"\r\n\"1\",\"1\",\"2\",\"3\"\r\n",
        "t,r,y,u,\n0,1,2,3,\n1,1,2,3,\n",
        "t,r,y,u\n0,1,2,3,,\n1,1,2,3,,\n",
        " t , r , y , u \n 0 , 1 , 2 , 3 \n 1 , 1 , 2 , 3 \n",
        "t;r;y;u\n0;1;2;3\n1;1;2;3\n",
        "t\tr\ty\tu\n0\t1\t2\t3\n1\t1\t2\t3\n",
        "u,y,r,t\n3,2,1,0\n3,2,1,1\n",
        "t,r,y,u\n0,1,2,3\n0,1,2,3\n1,1,2,3\n",
        "t,r,y,u\n+0e0,1.0,2.,3e0\n1,1,2,.3e1\n",
        "t;r;y;u\n0,0;1,0;2,0;3,0\n1,0;1;2;3\n",
        "t [s, since start];r;y;u\n0;1;2;3\n1;1;2;3\n",
        "\n\nt;r;y;u\n0,0;1;2;3\n1;1;2;3\n",
        "sep=;\r\nt;r;y;u\r\n0;1;2;3\r\n1;1;2;3\r\n",
        "Time (s),SP,PV,OP\n0,1,2,3\n1,1,2,3\n",
        "time_ms\tTIC1.SP\tTIC1.PV\tTIC1.OP\n0\t1\t2\t3\n1000\t1\t2\t3\n",
        "timestamp,ref,output,cmd\n2024-05-01 12:00:00,1,2,3\n2024-05-01 12:00:01,1,2,3\n",
        "t;r;y;u\n31.12.2023 23:59:59,5;1,0;2,0;3,0\n01.01.2024 00:00:00,5;1;2;3\n",
    ] {
        let recording = read(text, &plain()).unwrap_or_else(|e| panic!("{text:?}: {e}"));
        assert_eq!(
            (recording.sample_time_s, recording.start_s, &recording.r, &recording.y, &recording.u),
            (1.0, 0.0, &vec![1.0; 2], &vec![2.0; 2], &vec![3.0; 2]),
            "{text:?}"
        );
    }
}

#[test]
fn what_was_guessed_is_told() {
    let notes = |text: &str| read(text, &plain()).unwrap().quality.notes;
    assert_eq!(notes("t,r,y,u\n0,1,2,3\n1,1,2,3\n"), [""; 0]);
    assert_eq!(
        notes("Zeit;t;SP;PV;OP\nx;2024-05-01T12:00:00+02:00;1;2;3\nx;2024-05-01T12:00:00,5+02:00;1;2;3\n"),
        [
            "columns guessed by their names: r = 'SP', y = 'PV', u = 'OP' (--columns says otherwise)",
            "t counts from 2024-05-01T10:00:00Z"
        ]
    );
    assert_eq!(notes("t [us],r,y,u\n0,1,2,3\n1,1,2,3\n")[1..], ["the times in 't [us]' are us"]);
    // What is named is not guessed, and not overruled.
    let named = ReadOptions { columns: "r=PV".parse().unwrap(), ..plain() };
    let error = read("t,SP,PV,OP\n0,1,2,3\n", &named).unwrap_err().to_string();
    assert_eq!(
        error,
        "x.csv:1: no column 'y' for y; like --columns t=t,r=PV,y=SP,u=OP; the columns are t, SP, PV, OP"
    );
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packer.write_all(bytes).unwrap();
    packer.finish().unwrap()
}

#[test]
fn packed_text_is_read_like_text_whatever_the_files_name() {
    let mut text = String::from("t,r,y,u\n");
    (0..30_000).for_each(|k| text.push_str(&format!("{:.3},1,{},3\n", f64::from(k) * 0.01, k % 7)));
    let plain_text = read(&text, &plain()).unwrap();
    let bytes = packed(text.as_bytes());
    assert_eq!(read(&bytes, &plain()).unwrap(), plain_text);
    // Two members, as `cat a.gz b.gz` makes them.
    let (head, tail) = text.split_at(text.len() / 2);
    assert_eq!(
        read([packed(head.as_bytes()), packed(tail.as_bytes())].concat(), &plain()).unwrap(),
        plain_text
    );
    assert_eq!(read(packed(&bytes), &plain()).unwrap(), plain_text);
    for cut in (2..bytes.len()).step_by(bytes.len() / 60) {
        let error = message(&bytes[..cut]);
        assert!(error.starts_with("x.csv") && error.lines().count() == 1, "{error}");
    }
}

#[test]
fn a_packed_recording_streams() {
    let mut text = String::from("t,r,y,u\n");
    (0..200_000)
        .for_each(|k| text.push_str(&format!("{:.3},1,{},3\n", f64::from(k) * 0.01, k * 7919 % 10_007)));
    let bytes = packed(text.as_bytes());
    let size = bytes.len() as u64;
    let mut stream = RecordingStream::from_reader("x", std::io::Cursor::new(bytes), &plain()).unwrap();
    assert!(stream.bytes_read() < size / 2, "{} of {size} read before the first sample", stream.bytes_read());
    while stream.next().unwrap().is_some() {}
    assert_eq!(stream.bytes_read(), size);
}

#[test]
fn files_that_are_no_recordings_are_named() {
    assert_eq!(
        message(b"PK\x03\x04rest"),
        "x.csv: this is a spreadsheet (or another zip archive); save it as CSV"
    );
}

#[test]
fn what_is_missing_is_marked_and_counted() {
    let text = "t,r,y,u\n0,1,,3\n1,1,NaN,3\n2,inf,2,N/A\n\n3,1,2,3\n3,1,2,3\n6,1,2,3\n7,1,2,3\n";
    let recording = read(text, &plain()).unwrap();
    let q = &recording.quality;
    assert_eq!((q.missing_r, q.missing_y, q.missing_u), (1, 2, 1));
    assert_eq!((q.gaps, q.gap_samples, q.duplicates, q.blank_lines), (1, 2, 1, 1));
    assert_eq!((q.rows, q.samples, recording.len()), (7, 8, 8));
    use RowState::{Missing, Valid};
    assert_eq!(recording.state, [Missing, Missing, Missing, Valid, Missing, Missing, Valid, Valid]);
    assert!(recording.y[4].is_nan() && recording.u[5].is_nan());
    assert_eq!(
        q.to_string(),
        "8 samples from 7 rows, 1 missing in r, 2 missing in y, 1 missing in u, 2 filled in gaps, \
         1 duplicates dropped, 1 blank lines"
    );
}

#[test]
fn rows_where_a_condition_fails_are_manual_and_stay() {
    let text = "t,r,y,u,occupied,mode\n0,1,2,3,0,AUTO\n1,1,2,3,1,AUTO\n2,1,,3,1,AUTO\n3,1,2,3,1,MAN\n";
    let when = |conditions: &[&str]| ReadOptions {
        when: conditions.iter().map(|c| c.parse().unwrap()).collect(),
        ..plain()
    };
    use RowState::{Manual, Missing, Valid};
    let recording = read(text, &when(&["occupied=1", "mode=AUTO"])).unwrap();
    assert_eq!(recording.state, [Manual, Valid, Missing, Manual]);
    assert_eq!(recording.quality.manual, 2);
    assert_eq!(
        read(text, &when(&["busy=1"])).unwrap_err().to_string(),
        "x.csv:1: no column 'busy' for a condition; the columns are t, r, y, u, occupied, mode"
    );
}

#[test]
fn further_columns_are_kept_by_name() {
    let text = "t,r,y,u,speed,mode\n0,1,2,3,7,AUTO\n1,1,2,3,8,MAN\n";
    let all = read(text, &ReadOptions { keep_extra: true, ..plain() }).unwrap();
    assert_eq!(all.column("speed").unwrap(), [7.0, 8.0]);
    assert_eq!(all.quality.text_columns, ["mode"]);
    assert_eq!(
        all.column("torque").unwrap_err().to_string(),
        "x.csv: no column 'torque' for a signal; the columns are r, y, u, speed"
    );
    let mode = ReadOptions { extra: vec!["mode".into()], ..plain() };
    assert_eq!(
        read(text, &mode).unwrap_err().to_string(),
        "x.csv:2: 'AUTO' in column 'mode' is not a number"
    );
}

#[test]
fn columns_are_mapped_and_a_sample_time_stands_in_for_stamps() {
    let text = "time,SP,PV,OP\n5,1,2,3\n7,1,2,3\n";
    let options = ReadOptions { columns: "t=time,r=SP,y=PV,u=OP".parse().unwrap(), ..plain() };
    let recording = read(text, &options).unwrap();
    assert_eq!((recording.start_s, recording.sample_time_s, recording.time_s(1)), (5.0, 2.0, 7.0));
    let given = ReadOptions { sample_time_s: Some(0.5), ..plain() };
    let recording = read("r,y,u\n1,2,3\n1,2,3\n1,2,3\n", &given).unwrap();
    assert_eq!((recording.start_s, recording.sample_time_s, recording.len()), (0.0, 0.5, 3));
    assert_eq!(
        read("t,r,y,u\n0,1,2,3\n1,1,2,3\n", &given).unwrap_err().to_string(),
        "x.csv: the sample time given is 0.5 s, the time stamps say 1 s; one that agrees, or --columns t= to ignore \
         the time stamps"
    );
    let ignored = ReadOptions { columns: "t=".parse().unwrap(), ..given };
    assert_eq!(read("t,r,y,u\n0,1,2,3\n0,1,2,4\n", &ignored).unwrap().sample_time_s, 0.5);
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = ReadOptions { sample_time_s: Some(bad), ..plain() };
        assert!(read("r,y,u\n1,2,3\n", &options).unwrap_err().to_string().contains("a number above 0"));
    }
}

#[test]
fn resampling_interpolates_y_and_holds_r_and_u() {
    let text = "t,r,y,u\n0,0,0,0\n0.9,1,9,1\n2.1,2,21,2\n3.0,3,30,3\n";
    let options = ReadOptions { resample_s: Some(0.5), ..plain() };
    let recording = read(text, &options).unwrap();
    assert_eq!(recording.sample_time_s, 0.5);
    assert_eq!(recording.u, [0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 3.0]);
    assert_eq!(recording.r, recording.u);
    for (y, expected) in recording.y.iter().zip([0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0]) {
        assert!((y - expected).abs() < 1e-12, "{y} for {expected}");
    }
    let jitter = recording.quality.resampled.unwrap();
    assert!((jitter.interval_s - 0.9).abs() < 1e-12 && (jitter.max_s - 0.3).abs() < 1e-12);
    assert_eq!(jitter.max_line, 4);
    // Nothing is made up across a gap.
    let gap = "t,r,y,u\n0,0,0,0\n1,0,1,0\n2.1,0,2,0\n12,0,9,0\n13,0,9,0\n";
    let recording = read(gap, &ReadOptions { resample_s: Some(1.0), ..plain() }).unwrap();
    assert_eq!(recording.quality.gap_samples, 9);
    assert!(recording.y[3..12].iter().all(|y| y.is_nan()) && recording.y[12] == 9.0);
}

#[test]
fn what_was_written_reads_back_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    let values = [0.1, -1e-300, f64::NAN, 1.0 / 3.0, 5e-324, f64::MAX, -0.0, 123_456_789.123_456_79];
    for (sample_time_s, start_s) in [(0.001, 0.0), (1.0 / 30.0, 5.0), (60.0, 1.7e9), (0.066, 0.3)] {
        let written = Recording {
            sample_time_s,
            start_s,
            r: values.to_vec(),
            y: values.iter().rev().copied().collect(),
            u: vec![1.0; 8],
            extra: vec![("a, \"b\"".into(), values.to_vec())],
            ..Recording::default()
        };
        written.write_csv(&path).unwrap();
        let read = Recording::read(&path, &ReadOptions { keep_extra: true, ..plain() }).unwrap();
        let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&read.r), bits(&written.r));
        assert_eq!(bits(&read.y), bits(&written.y));
        assert_eq!(bits(read.column("a, \"b\"").unwrap()), bits(&values));
        assert_eq!(read.sample_time_s, sample_time_s);
    }
}

/// How fast, for the record: `cargo test --release -p drift-sim --test all recording_input:: -- --ignored --nocapture`.
#[test]
#[ignore = "slow: three million rows"]
fn three_million_rows_stream_through() {
    use std::fmt::Write;
    const ROWS: u64 = 3_000_000;
    let mut text = String::from("t,r,y,u\n");
    for k in 0..ROWS {
        let y = (k * 7919 % 99_991) as f64 / 1e5;
        writeln!(text, "{:.3},0.25,{y:.6},{:.6}", k as f64 * 0.001, y * 3.0 - 1.0).unwrap();
    }
    let megabytes = text.len() as f64 / 1e6;
    let source = std::io::Cursor::new(text.into_bytes());
    let began = std::time::Instant::now();
    let mut stream = RecordingStream::from_reader("x.csv", source, &plain()).unwrap();
    let (mut samples, mut sum) = (0, 0.0);
    while let Some(sample) = stream.next().unwrap() {
        samples += 1;
        sum += sample.y;
    }
    let seconds = began.elapsed().as_secs_f64();
    println!("{:.2} M rows/s, {:.0} MB/s", ROWS as f64 / seconds / 1e6, megabytes / seconds);
    assert_eq!((samples, stream.sample_time_s()), (ROWS, 0.001));
    assert!((sum / ROWS as f64 - 0.5).abs() < 0.01);
}

/// A sound file with one stretch of it replaced.
fn mutated() -> impl Strategy<Value = Vec<u8>> {
    let junk = prop_oneof![
        proptest::collection::vec(any::<u8>(), 0..8),
        "[0-9.,;:TZeE+\"\\-\r\n nainf]{0,12}".prop_map(String::into_bytes),
    ];
    (2usize..60, 0usize..1000, 0usize..12, junk).prop_map(|(rows, at, cut, junk)| {
        let mut text = String::from("t,r,y,u,mode\n");
        (0..rows).for_each(|k| text.push_str(&format!("{:.2},1,{k},0.5,1\n", k as f64 * 0.066)));
        if at % 3 == 0 {
            text = text.replace(',', ";").replace('.', ",");
        }
        let mut bytes = text.into_bytes();
        let from = at % bytes.len();
        let to = (from + cut).min(bytes.len());
        bytes.splice(from..to, junk);
        bytes
    })
}

fn is_a_recording_or_one_line(bytes: &[u8]) {
    for options in [
        plain(),
        ReadOptions { keep_extra: true, sample_time_s: Some(0.066), ..plain() },
        ReadOptions { columns: "t=".parse().unwrap(), sample_time_s: Some(1.0), ..plain() },
        ReadOptions { resample_s: Some(1.0), when: vec!["mode=1".parse().unwrap()], ..plain() },
    ] {
        match read(bytes, &options) {
            Ok(recording) => {
                assert!(recording.sample_time_s > 0.0 && !recording.is_empty());
                for column in [&recording.r, &recording.y, &recording.u] {
                    assert_eq!(column.len(), recording.len());
                }
                assert_eq!(recording.quality.samples, recording.len() as u64);
            }
            Err(error) => {
                let text = error.to_string();
                assert!(text.starts_with("x.csv") && !text.chars().any(char::is_control), "{text:?}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_bytes_make_it_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        is_a_recording_or_one_line(&bytes);
        is_a_recording_or_one_line(&[b"t,r,y,u,mode\n".as_slice(), &bytes].concat());
    }

    #[test]
    fn no_mutation_makes_it_panic(bytes in mutated()) {
        is_a_recording_or_one_line(&bytes);
    }
}
