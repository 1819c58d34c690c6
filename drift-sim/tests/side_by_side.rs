//! Samples that are handed on together are those that come one by one: the same numbers at the same times, the same counts, the same
//! faults in the same words, also of rows that are irregular behind the first 10 000, from which on samples come together at all.

use std::io::Cursor;

use drift_sim::recording::{Cells, Quality, ReadOptions, Recording, RecordingStream, RowState};
use proptest::prelude::*;

/// A sample's time and values as bits, and its state.
type Seen = ([u64; 4], RowState);

/// What a stream says to its end: samples, the error in words, what was found, and how many samples came together.
fn told(mut stream: RecordingStream, together: bool) -> (Vec<Seen>, Option<String>, Quality, usize) {
    let (mut seen, mut side_by_side) = (Vec::new(), 0);
    let bits = |values: [f64; 4]| values.map(f64::to_bits);
    loop {
        if together {
            let samples = stream.valid_samples();
            let count = samples.len();
            assert!([samples.r, samples.y, samples.u].iter().all(|column| column.len() == count));
            for n in 0..count {
                let sample = [samples.t_s[n], samples.r[n], samples.y[n], samples.u[n]];
                seen.push((bits(sample), RowState::Valid));
            }
            side_by_side += count;
            if count > 0 {
                continue;
            }
        }
        match stream.next() {
            Ok(Some(sample)) => {
                assert_eq!(sample.index, seen.len() as u64);
                seen.push((bits([sample.t_s, sample.r, sample.y, sample.u]), sample.state));
            }
            Ok(None) => return (seen, None, stream.quality(), side_by_side),
            Err(error) => return (seen, Some(error.to_string()), stream.quality(), side_by_side),
        }
    }
}

/// How many samples came together, and the error.
fn alike(open: impl Fn() -> Result<RecordingStream, drift_sim::Error>) -> (usize, Option<String>) {
    let (one_by_one, others) = match (open(), open()) {
        (Ok(first), Ok(second)) => (told(first, false), told(second, true)),
        (first, second) => {
            let [first, second] = [first, second].map(|refused| refused.err().map(|e| e.to_string()));
            assert_eq!(first, second);
            return (0, first);
        }
    };
    let (seen, error, mut quality, none) = one_by_one;
    assert_eq!(none, 0);
    assert_eq!(others.0, seen);
    assert_eq!(others.1, error);
    if error.is_some() {
        // Rows behind the fault may have been read ahead.
        (quality.rows, quality.blank_lines) = (others.2.rows, others.2.blank_lines);
    }
    assert_eq!(others.2, quality);
    (others.3, error)
}

fn of_csv(text: &str, options: &ReadOptions) -> (usize, Option<String>) {
    alike(|| RecordingStream::from_reader("x.csv", Cursor::new(text.as_bytes().to_vec()), options))
}

const ROWS: usize = 14_000;
/// Where the files below are irregular.
const AT: usize = 12_345;

fn values(k: usize) -> [f64; 3] {
    let y = (k * 7919 % 99_991) as f64 / 1e4;
    [f64::from(u8::from(k % 400 < 200)), y, 3.0 - 0.5 * y]
}

/// Rows of time stamps as they are given, `MODE` and `more` behind them.
fn csv(stamp: impl Fn(usize) -> String) -> Vec<String> {
    let row = |k: usize| {
        let [r, y, u] = values(k);
        format!("{},{r},{y},{u}", stamp(k))
    };
    std::iter::once("t,r,y,u".to_owned()).chain((0..ROWS).map(row)).collect()
}

fn even(k: usize) -> String {
    format!("{:.2}", k as f64 * 0.066)
}

#[test]
fn what_is_irregular_is_told_alike() {
    let changed = |row: usize, to: &str| {
        let mut rows = csv(even);
        rows[row] = to.to_owned();
        rows.join("\n") + "\n"
    };
    let t = |k: usize| even(k - 1);
    let at = |text: &str| format!("{},{text}", t(AT));
    // Slowly, once the line is fitted.
    let wandered = |k: usize| 0.01 * (1.0 - (k.saturating_sub(10_000) as f64 / 500.0).cos());
    let texts = [
        ("nothing", csv(even).join("\n"), None),
        ("CRLF", csv(even).join("\r\n"), None),
        ("decimal commas", csv(even).join("\n").replace(',', ";").replace('.', ","), None),
        ("a cell that is missing", changed(AT, &at("1,,2")), None),
        ("r that is missing", changed(AT, &at("nan,1,2")), None),
        ("an infinite u", changed(AT, &at("1,1,inf")), None),
        ("blank lines", changed(AT, &format!("\n\n{}", at("1,1,2"))), None),
        ("a line of words", changed(AT, "by hand"), None),
        ("quotes", changed(AT, &(t(AT) + ",\"1\",1,2")), None),
        (
            "a finer stamp",
            changed(AT, &format!("{:.4},1,1,2", (AT - 1) as f64 * 0.066)),
            Some("off the grid"),
        ),
        ("a row again", changed(AT, &csv(even)[AT - 1]), None),
        ("a time again", changed(AT, &(t(AT - 1) + ",7,7,7")), Some("again, with other values")),
        ("time that goes back", changed(AT, &(t(AT - 9) + ",1,1,2")), Some("time goes back")),
        ("a stamp off the grid", changed(AT, &format!("{}3,1,1,2", t(AT))), Some("off the grid")),
        ("a word", changed(AT, &at("1,much,2")), Some("'much' in column 'y' is not a number")),
        ("a time that is no number", changed(AT, "soon,1,1,2"), Some("'soon'")),
        ("no time", changed(AT, ",1,1,2"), Some("no time stamp")),
        ("a row too short", changed(AT, &at("1")), None),
        ("the header again", changed(AT, "t,r,y,u"), None),
        ("another header", changed(AT, "t,r,u,y"), Some("the header comes again")),
        ("a gap", csv(|k| even(k + 17 * usize::from(k > AT))).join("\n"), None),
        ("a huge gap", csv(|k| even(k + 10_000_000 * usize::from(k > AT))).join("\n"), Some("a gap of")),
        (
            "a clock that wanders too fast",
            csv(|k| format!("{:.4}", k as f64 * 0.1 + wandered(k))).join("\n"),
            Some("off the grid"),
        ),
        ("jitter", csv(|k| format!("{:.5}", k as f64 * 0.1 + 1e-5 * (k % 7) as f64)).join("\n"), None),
        ("times from 1970 on", csv(|k| format!("{:.3}", 1.7e9 + k as f64 * 0.25)).join("\n"), None),
        (
            "dates",
            csv(|k| format!("2024-05-{:02}T{:02}:{:02}:00", 1 + k / 1440, k / 60 % 24, k % 60)).join("\n"),
            None,
        ),
        ("a mode", csv(even).join(",1\n").replacen("u,1", "u,MODE", 1) + ",1", None),
        ("no reference", csv(even).join("\n").replacen("t,r,y,u", "t,x,y,u", 1), None),
    ];
    for (what, text, wanted) in texts {
        let (side_by_side, error) = of_csv(&text, &ReadOptions::default());
        assert_eq!(error.is_some(), wanted.is_some(), "{what}: {error:?}");
        assert!(error.as_ref().is_none_or(|error| error.contains(wanted.unwrap())), "{what}: {error:?}");
        let alone = ["a mode", "no reference", "decimal commas", "dates"].contains(&what);
        assert_eq!(side_by_side == 0, alone, "{what}: {side_by_side}");
        // A quote sends the rest of its block to the reader of single rows.
        if error.is_none() && !alone {
            assert!(side_by_side > 1000, "{what}: {side_by_side}");
        }
    }
    for options in [
        ReadOptions { when: vec!["u>0".parse().unwrap()], ..ReadOptions::default() },
        ReadOptions { resample_s: Some(0.5), ..ReadOptions::default() },
        ReadOptions { keep_extra: true, ..ReadOptions::default() },
    ] {
        of_csv(&csv(even).join("\n"), &options);
    }
    let no_times =
        ReadOptions { columns: "t=".parse().unwrap(), sample_time_s: Some(0.066), ..ReadOptions::default() };
    of_csv(&csv(even).join("\n"), &no_times);
}

#[test]
fn tables_and_recordings_in_memory_are_told_alike() {
    let column = |of: &dyn Fn(usize) -> f64| Cells::Double((0..ROWS).map(of).collect());
    let rounded = |k: usize| (k as f64 * 6.6).round() / 100.0;
    let spoilt = |at: usize, by: f64| move |k: usize| if k == at { by } else { values(k)[1] };
    let times: [(&str, Cells); 5] = [
        ("even", column(&rounded)),
        ("whole", column(&|k| k as f64)),
        ("a gap", column(&|k| rounded(k + 5 * usize::from(k > AT)))),
        ("back", column(&|k| if k == AT { 1.0 } else { rounded(k) })),
        ("missing", column(&|k| if k == AT { f64::NAN } else { rounded(k) })),
    ];
    for (what, t) in times {
        for y in [spoilt(AT, 5.0), spoilt(AT - 1, f64::NAN), spoilt(AT + 700, f64::INFINITY)] {
            let table = || -> Vec<(String, Cells)> {
                let [r, u] = [0, 2].map(|i| column(&|k| values(k)[i]));
                [("t", t.clone()), ("r", r), ("y", column(&y)), ("u", u)]
                    .map(|(n, c)| (n.to_owned(), c))
                    .into()
            };
            let options = ReadOptions::default();
            let (side_by_side, error) = alike(|| RecordingStream::from_columns("x", table(), &options));
            assert!(side_by_side > 1000, "{what}: {side_by_side}");
            assert_eq!(error.is_some(), ["back", "missing"].contains(&what), "{what}: {error:?}");
            if let Ok(recording) = Recording::from_columns("x", table(), &options) {
                let (side_by_side, _) = alike(|| RecordingStream::from_recording(&recording, &[]));
                assert!(side_by_side > ROWS - 10, "{what}: {side_by_side}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn whatever_stands_there_is_told_alike(
        at in 10_000_usize..ROWS,
        cut in 0_usize..40,
        junk in "[0-9.,;:eE+\"\\-\r\n #na]{0,16}",
    ) {
        let mut text = csv(even).join("\n");
        let from = text.match_indices('\n').nth(at - 1).map_or(0, |(from, _)| from) + at % 17;
        text.replace_range(from..(from + cut).min(text.len()), &junk);
        of_csv(&text, &ReadOptions::default());
    }
}
