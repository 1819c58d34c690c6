//! Files that were cut off, or that hold more than samples: a total below the rows, the header again, NULs after a power cut. What is no
//! sample is left out and told with its line; the samples are those of the whole file.

use drift_sim::recording::{ReadOptions, Recording, RowState};

const ROWS: usize = 400;

fn read(bytes: impl AsRef<[u8]>, options: &ReadOptions) -> drift_sim::Result<Recording> {
    Recording::from_reader("x.csv", std::io::Cursor::new(bytes.as_ref().to_vec()), options)
}

/// The rows of a recording, the header before them.
fn lines() -> Vec<String> {
    let row = |k: usize| format!("{},1,{:.3},{:.2}", k as f64 * 0.5, (k as f64 * 0.1).sin(), (k % 7) as f64);
    std::iter::once("t,r,y,u".to_owned()).chain((0..ROWS).map(row)).collect()
}

fn text(lines: &[String]) -> String {
    lines.join("\n") + "\n"
}

fn whole() -> Recording {
    read(text(&lines()), &ReadOptions::default()).unwrap()
}

/// Reads a text, and checks that its samples are those of the whole file but for the missing ones; its notes.
#[track_caller]
fn notes(text: impl AsRef<[u8]>, samples: usize, missing: &[usize]) -> Vec<String> {
    let (read, whole) = (read(text, &ReadOptions::default()).unwrap(), whole());
    assert_eq!((read.len(), read.sample_time_s), (samples, 0.5));
    for k in 0..samples {
        let is_there = read.state[k] == RowState::Valid;
        assert_eq!(is_there, !missing.contains(&k), "sample {k}");
        if is_there {
            assert_eq!([read.r[k], read.y[k], read.u[k]], [whole.r[k], whole.y[k], whole.u[k]], "sample {k}");
        }
    }
    read.quality.notes
}

#[test]
fn a_file_that_is_cut_off_ends_with_its_last_whole_row() {
    let whole = text(&lines());
    let last = whole.trim_end().rfind('\n').unwrap() + 1;
    for cut in ["199.5", "199.5,", "199.5,1", "199.5,1,"] {
        let told = notes(format!("{}{cut}", &whole[..last]), ROWS - 1, &[]);
        let fields = cut.split(',').count();
        let fields = if fields == 1 { "1 field".to_owned() } else { format!("{fields} fields") };
        assert_eq!(
            told,
            [format!("one row is no sample and is left out: line 401 ({fields} where the header has 4)")]
        );
    }
}

#[test]
fn a_torn_row_in_the_middle_is_a_gap() {
    for (torn, reason) in [
        ("49.5,1", "2 fields where the header has 4"),
        ("by hand", "words and no numbers"),
        ("49.5,1,0.49.5,1,0.2,3", "6 fields where the header has 4"),
        ("49.549.5,1,0.2,3", "its time is none"),
    ] {
        let mut lines = lines();
        lines[100] = torn.to_owned();
        let told = notes(text(&lines), ROWS, &[99]);
        assert_eq!(told, [format!("one row is no sample and is left out: line 101 ({reason})")], "{torn}");
    }
}

/// Where nothing but its place says when a sample was taken, one that was lost keeps its place.
#[test]
fn without_time_stamps_a_torn_row_is_a_missing_sample() {
    let mut lines: Vec<String> =
        lines().iter().map(|line| line.split_once(',').unwrap().1.to_owned()).collect();
    lines[100] = "1,0".into();
    lines.push("End of file".into());
    let options = ReadOptions { sample_time_s: Some(0.5), ..ReadOptions::default() };
    let (read, whole) = (read(text(&lines), &options).unwrap(), whole());
    assert_eq!((read.len(), read.state[99], read.y[100]), (ROWS, RowState::Missing, whole.y[100]));
    assert_eq!(read.quality.left_out, 2);
}

#[test]
fn what_stands_below_the_rows_is_left_out() {
    for footer in ["total,,,", "End of file", "# end of log", "Mean,,,\nEnd of file\n", "\n\ntotal,,,\n"] {
        let told = notes(text(&lines()) + footer, ROWS, &[]);
        assert!(matches!(told.as_slice(), [note] if note.contains("left out: line")), "{told:?}");
    }
}

#[test]
fn the_header_again_is_passed_over_and_another_one_refused() {
    let mut twice = lines();
    twice.insert(200, "t,r,y,u".into());
    twice.insert(300, "t,r,y,u,".into());
    assert_eq!(
        notes(text(&twice), ROWS, &[]),
        ["the header comes again 2 times, first on line 201, and is passed over"]
    );
    let mut with_units = lines();
    for at in [1, 200] {
        with_units.insert(at, "s,degC,degC,%".into());
    }
    with_units.insert(200, "t,r,y,u".into());
    assert!(notes(text(&with_units), ROWS, &[])[1].contains("comes again 2 times, first on line 201"));
    for other in ["t,r,u,y", "t,r,y", "t,r,y,u,mode", "time,sp,pv,op"] {
        let mut lines = lines();
        lines.insert(200, other.into());
        let told = read(text(&lines), &ReadOptions::default()).unwrap_err().to_string();
        assert_eq!(
            told,
            format!(
                "x.csv:201: the header comes again as '{other}', before it was 't,r,y,u'; one header; a file for each"
            )
        );
    }
}

#[test]
fn nuls_after_a_power_cut_are_no_samples() {
    let nuls = "\0".repeat(200_000);
    let told = notes(text(&lines()) + &nuls, ROWS, &[]);
    let reason = "cut off, with NULs behind it";
    assert_eq!(told, [format!("one row is no sample and is left out: line 402 ({reason})")]);
    // The logger went on behind them.
    let mut resumed = lines();
    resumed[100] = format!("49.5,1,0.{nuls}49.5,1,0.2,3");
    assert_eq!(
        notes(text(&resumed), ROWS, &[99])[0],
        format!("one row is no sample and is left out: line 101 ({reason})")
    );
}

#[test]
fn many_rows_that_are_no_samples_are_an_error() {
    let mut torn = lines();
    (0..11).for_each(|k| torn[50 + k] = format!("{k},1"));
    assert_eq!(
        read(text(&torn), &ReadOptions::default()).unwrap_err().to_string(),
        "x.csv:61: 11 of 60 rows are no samples; lines 51 (2 fields where the header has 4), 52 (2 fields where the header \
         has 4), 53 (2 fields where the header has 4) and 8 more; 10 of them, or one in 100"
    );
    // Where no row is one the columns are at fault.
    let none = format!("t,r,y,u\n{}", "1,2,3\n".repeat(50));
    assert_eq!(
        read(none, &ReadOptions::default()).unwrap_err().to_string(),
        "x.csv:2: 3 fields where the header has 4"
    );
}

#[test]
fn json_that_is_cut_off_ends_with_its_last_whole_object() {
    let object = |line: &String| {
        let cells: Vec<&str> = line.split(',').collect();
        format!("{{\"t\": {}, \"r\": {}, \"y\": {}, \"u\": {}}}", cells[0], cells[1], cells[2], cells[3])
    };
    let objects: Vec<String> = lines()[1..].iter().map(object).collect();
    for whole in [objects.join("\n"), format!("[{}", objects.join(",\n"))] {
        let told = notes(&whole[..whole.len() - 9], ROWS - 1, &[]);
        assert_eq!(told, ["one row is no sample and is left out: line 400 (cut off)"]);
    }
    let mut broken = objects;
    broken[99] = broken[99][..20].to_owned();
    assert_eq!(
        notes(broken.join("\n"), ROWS, &[99]),
        ["one row is no sample and is left out: line 100 (cut off)"]
    );
}
