//! What lies between rows stays unknown: a gap is missing samples, whatever its length and however the rows are put on a grid; and where
//! time begins anew another recording begins.

use drift_sim::recording::{Overview, Part, ReadOptions, Recording, RowState};

fn read(text: &str, options: &ReadOptions) -> drift_sim::Result<Recording> {
    Recording::from_reader("x.log", std::io::Cursor::new(text.as_bytes().to_vec()), options)
}

/// Times of so many rows, each 1.0013 s after the one before and written with one decimal, from `start_s` on.
fn times(start_s: f64, count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |k| start_s + 1.0013 * k as f64)
}

fn csv(times: impl Iterator<Item = f64>) -> String {
    let row = |(k, t): (usize, f64)| format!("{t:.1},1,{},{}\n", k, k % 3);
    "t,r,y,u\n".to_owned() + &times.enumerate().map(row).collect::<String>()
}

/// After 200 rows nothing for 60.4 s: sampling begins anew between two samples of the grid.
#[test]
fn rows_behind_a_gap_may_stand_between_the_samples_of_the_old_grid() {
    let text = csv(times(0.0, 200).chain(times(259.6, 300)));
    let recording = read(&text, &ReadOptions::default()).unwrap();
    assert!((recording.sample_time_s - 1.0013).abs() < 1e-3, "{}", recording.sample_time_s);
    assert_eq!((recording.quality.gaps, recording.quality.gap_samples, recording.len()), (1, 59, 559));
    for k in 0..559 {
        let wanted = if (200..259).contains(&k) { RowState::Missing } else { RowState::Valid };
        assert_eq!(recording.state[k], wanted, "sample {k}");
    }
    assert_eq!((recording.y[199], recording.y[259]), (199.0, 200.0));
}

/// The same behind the rows that the grid is found from.
#[test]
fn a_late_gap_may_shift_the_grid_as_well() {
    let text = csv(times(0.0, 12_000).chain(times(12_060.4, 300)));
    let recording = read(&text, &ReadOptions::default()).unwrap();
    assert_eq!(recording.quality.gaps, 1);
    assert_eq!(recording.state.iter().filter(|state| **state == RowState::Valid).count(), 12_300);
    // Behind fewer missing samples the grid stays what it was.
    let early = csv(times(0.0, 12_000).chain(times(12_016.9, 2)));
    assert!(read(&early, &ReadOptions::default()).unwrap_err().to_string().contains("off the grid"));
}

#[test]
fn nothing_is_interpolated_across_a_gap() {
    let text = csv(times(0.0, 200).chain(times(259.6, 300)));
    for step in [0.5, 1.0, 2.0] {
        let options = ReadOptions { resample_s: Some(step), ..ReadOptions::default() };
        let recording = read(&text, &options).unwrap();
        let mut within = 0;
        for k in 0..recording.len() {
            let t = recording.time_s(k);
            if t > 199.3 && t < 259.6 {
                within += 1;
                assert_eq!(recording.state[k], RowState::Missing, "{t} s");
                assert!(recording.y[k].is_nan() && recording.u[k].is_nan(), "{t} s");
            } else {
                assert_eq!(recording.state[k], RowState::Valid, "{t} s");
            }
        }
        assert!(within as f64 >= 59.0 / step, "{within}");
    }
}

#[test]
fn a_step_longer_than_the_recording_is_refused() {
    let options = ReadOptions { resample_s: Some(1e300), ..ReadOptions::default() };
    assert_eq!(
        read(&csv(times(0.0, 200)), &options).unwrap_err().to_string(),
        "x.log: a grid of 1e300 s has one sample in the 199 s of this recording; --resample with 199 or less"
    );
}

/// A printer's log with three starts of the printer.
fn log() -> String {
    let stats = |k: usize, base: f64| {
        format!(
            "Stats {:.1}: gcodein=0  extruder: target=200 temp={:.1} pwm=0.5{}0\n",
            base + k as f64,
            100.0 + k as f64,
            k % 10
        )
    };
    let part = |base: f64, count: usize| (0..count).map(|k| stats(k, base)).collect::<String>();
    format!("Starting Klippy...\n{}{}{}", part(70.0, 50), part(40.0, 20), part(50.0, 30))
}

#[test]
fn one_part_of_a_log_is_read_and_the_others_are_told() {
    for (part, rows, start_s, note) in [
        (
            None,
            50,
            70.0,
            "time begins anew on line 52: part 1 is read (--part 2 or --part last reads what follows)",
        ),
        (
            Some(Part::Number(1)),
            50,
            70.0,
            "time begins anew on line 52: part 1 is read (--part 2 or --part last reads what follows)",
        ),
        (
            Some(Part::Number(2)),
            20,
            40.0,
            "time begins anew on line 72: part 2 is read (--part 3 or --part last reads what follows)",
        ),
        (Some(Part::Number(3)), 30, 50.0, "part 3 is read, in which time begins anew on line 72"),
        (Some(Part::Last), 30, 50.0, "part 3 is read, in which time begins anew on line 72"),
    ] {
        let recording = read(&log(), &ReadOptions { part, ..ReadOptions::default() }).unwrap();
        assert_eq!(
            (recording.len(), recording.start_s, recording.quality.rows),
            (rows, start_s, rows as u64),
            "{part:?}"
        );
        assert_eq!(recording.quality.notes.last().map(String::as_str), Some(note), "{part:?}");
    }
    let refused = |part: u64, text: &str| {
        let options = ReadOptions { part: Some(Part::Number(part)), ..ReadOptions::default() };
        read(text, &options).unwrap_err().to_string()
    };
    assert_eq!(refused(4, &log()), "x.log: there is no part 4: time begins 3 times; --part 1 to 3, or last");
    // Any other log has parts where they are asked for.
    let twice = csv(times(0.0, 50).chain(times(0.0, 30)));
    assert_eq!(
        read(&twice, &ReadOptions::default()).unwrap_err().to_string(),
        "x.log:52: time goes back from 49.1 to 0 s; --part 1 or --part last, where a recording begins anew there"
    );
    let last = read(&twice, &ReadOptions { part: Some(Part::Last), ..ReadOptions::default() }).unwrap();
    assert_eq!((last.len(), last.y[0]), (30, 50.0));
    assert_eq!(
        refused(2, &csv(times(0.0, 50))),
        "x.log: there is no part 2: time begins only once; --part 1"
    );
}

#[test]
fn a_look_tells_all_parts() {
    let options = ReadOptions { incomplete: true, ..ReadOptions::default() };
    let seen = Overview::from_reader("x.log", || std::io::Cursor::new(log().into_bytes()), &options).unwrap();
    assert_eq!(
        seen.notes.last().map(String::as_str),
        Some(
            "time begins anew 2 times: the parts are 1 from line 2 (50 rows), 2 from line 52 (20 rows), 3 from line 72 (30 rows); part \
             1 is read (--part 3 reads another)"
        )
    );
    assert_eq!((seen.t_s.len(), seen.quality.rows), (50, 50));
}
