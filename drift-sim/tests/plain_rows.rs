//! Rows that are read in blocks, several at once, against the reader of single rows: the same samples to the last bit, the same
//! counts, the same error on the same line. A quoted cell in each row is what makes every row a single one; it says the same.

use std::fmt::Write;
use std::io::Read;

use drift_sim::recording::{ReadOptions, RecordingStream};

/// More than four blocks of text.
const ROWS: usize = 30_000;

/// All that a recording yields: each sample's bits, what was counted, and how it ended.
fn read(stream: drift_sim::Result<RecordingStream>) -> (Vec<[u64; 5]>, String) {
    let mut samples = Vec::new();
    let mut stream = match stream {
        Ok(stream) => stream,
        Err(error) => return (samples, error.to_string()),
    };
    loop {
        match stream.next() {
            Ok(Some(s)) => {
                let bits = [s.t_s, s.r, s.y, s.u].map(f64::to_bits);
                samples.push([bits[0], bits[1], bits[2], bits[3], s.index << 2 | s.state as u64]);
            }
            Ok(None) => return (samples, format!("{:?}", stream.quality())),
            Err(error) => return (samples, error.to_string()),
        }
    }
}

/// A source that hands on little at a time.
struct Trickle(std::io::Cursor<Vec<u8>>);

impl Read for Trickle {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let most = buffer.len().min(4093);
        self.0.read(&mut buffer[..most])
    }
}

/// The rows as `change` makes them, with a last cell that is quoted or not.
fn text(change: &dyn Fn(usize, &str) -> String, end: &str, note: &str) -> Vec<u8> {
    let mut text = format!("t,r,y,u,note{end}");
    for i in 0..ROWS {
        let x = 0.37 * i as f64;
        let (t, y) = (i as f64 / 1000.0, x.sin() * 1e3);
        let row = format!("{t},{},{y},{:e}", i % 7, x.cos() / 3.0);
        write!(text, "{},{note}{end}", change(i, &row)).unwrap();
    }
    text.into_bytes()
}

fn check(name: &str, change: &dyn Fn(usize, &str) -> String, end: &str, has_last_end: bool) -> String {
    let mut plain = text(change, end, "a");
    let mut quoted = text(change, end, "\"a\"");
    if !has_last_end {
        plain.truncate(plain.len() - end.len());
        quoted.truncate(quoted.len() - end.len());
    }
    let options = ReadOptions::default();
    let path = std::env::temp_dir().join(format!("drift_plain_rows_{}_{name}.csv", std::process::id()));
    std::fs::write(&path, &plain).unwrap();
    let as_file = read(RecordingStream::open(&path, &options));
    std::fs::remove_file(&path).unwrap();
    let called = path.to_string_lossy().into_owned();
    let of = |bytes: Vec<u8>| {
        read(RecordingStream::from_reader(&called, Trickle(std::io::Cursor::new(bytes)), &options))
    };
    let (as_pipe, one_by_one) = (of(plain), of(quoted));
    assert!(as_file == one_by_one, "{name}: {} samples, then {}", as_file.0.len(), as_file.1);
    assert!(as_pipe == one_by_one, "{name}, from a pipe: {} samples, then {}", as_pipe.0.len(), as_pipe.1);
    as_file.1
}

#[test]
fn rows_in_blocks_are_those_read_one_by_one() {
    let same = |_: usize, row: &str| row.to_owned();
    for (name, end, has_last_end) in [
        ("lf", "\n", true),
        ("crlf", "\r\n", true),
        ("no_last_lf", "\n", false),
        ("no_last_crlf", "\r\n", false),
    ] {
        check(name, &same, end, has_last_end);
    }
    let odd = |i: usize, row: &str| {
        let mut cells: Vec<String> = row.split(',').map(str::to_owned).collect();
        match i % 101 {
            3 => cells[1].clear(),
            5 => cells[2] = "NaN".into(),
            7 => cells[3] = "n/a".into(),
            11 => cells[2] = format!("  {} ", cells[2]),
            13 => cells[1] = format!("+{}.", cells[1]),
            17 => cells[3] = "1e999".into(),
            19 => cells[0] = format!("\n{}", cells[0]),
            23 => cells[0] = format!("\n \n\r\n{}", cells[0]),
            29 => cells[2] = format!("\"{}\"", cells[2]),
            31 => cells[2] = "-.5E-3".into(),
            _ => {}
        }
        cells.join(",")
    };
    let quality = check("odd", &odd, "\n", true);
    assert!(quality.contains("missing_r: 297"), "{quality}");
    // A reference that stays, in every spelling, and each of which begins like the one before.
    let spellings = ["2.5", "2.50", "2.5e0", "-3", "", " 7 ", "7", "nan", "1e999", "+1.", "\"2.5\""];
    let held = |i: usize, row: &str| {
        let mut cells: Vec<&str> = row.split(',').collect();
        cells[1] = spellings[i / 40 % spellings.len()];
        cells.join(",")
    };
    for end in ["\n", "\r\n"] {
        check("held", &held, end, true);
    }
}

#[test]
fn faults_in_the_middle_of_a_block_are_told_with_their_line() {
    let at = 23_456;
    for (name, fault, says) in [
        ("text", "23.456,1,abc,2", ":23458: 'abc' in column 'y' is not a number"),
        ("separator", "23.456,1,1_000,2", ":23458: '1_000' in column 'y' is not a number"),
        ("short", "23.456,1", "left out: line 23458 (3 fields where the header has 5)"),
        ("long", "23.456,1,2,3,4,5", "left out: line 23458 (7 fields where the header has 5)"),
        ("no_time", ",1,2,3", ":23458: no time stamp in column 't'"),
        ("back", "3.456,1,2,3", ":23458: time goes back from 23.455 to 3.456 s"),
        ("off", "23.4563,1,2,3", ":23458: the time stamp 23.4563 s is"),
        ("again", "23.455,1,2,3", ":23458: the time 23.455 s again, with other values"),
    ] {
        for end in ["\n", "\r\n"] {
            let change = |i: usize, row: &str| if i == at { fault.to_owned() } else { row.to_owned() };
            let told = check(name, &change, end, true);
            assert!(told.contains(says), "{name}: {told}");
        }
    }
    let long = |i: usize, row: &str| {
        if i == at { format!("{row}{}", " ".repeat(2_000_000)) } else { row.to_owned() }
    };
    let told = check("endless", &long, "\n", true);
    assert!(told.contains(":23458: a row of more than 1 MiB"), "{told}");
}
