//! Times that can be read in two ways: the days of a spreadsheet, and dates in which day and month could be either way round. What the
//! file decides is told, what it leaves open is asked for.

use drift_sim::recording::{Cells, DateOrder, ReadOptions, Recording, TimeIn};

fn read(text: &str, options: &ReadOptions) -> drift_sim::Result<Recording> {
    Recording::from_reader("x.csv", std::io::Cursor::new(text.as_bytes().to_vec()), options)
}

fn table(times: impl IntoIterator<Item = String>) -> String {
    let rows = times.into_iter().enumerate().map(|(k, time)| format!("{time},1,{},{}\n", k % 5, k % 3));
    "Time,SP,PV,OP\n".to_owned() + &rows.collect::<String>()
}

/// 5 s in days, from 8 o'clock of 14 March 2024 on.
fn serial_days(decimals: usize) -> impl Iterator<Item = String> {
    (0..500).map(move |k| format!("{:.decimals$}", 45_365.0 + (8.0 * 3600.0 + 5.0 * f64::from(k)) / 86_400.0))
}

/// Since 1970, of `date -u -d '2024-03-14 08:00' +%s`.
const EIGHT_O_CLOCK_S: f64 = 1_710_403_200.0;

#[test]
fn days_of_a_spreadsheet_are_dates() {
    for decimals in [5, 6, 8, 11] {
        for text in
            [table(serial_days(decimals)), table(serial_days(decimals)).replace(',', ";").replace('.', ",")]
        {
            let recording = read(&text, &ReadOptions::default()).unwrap();
            assert_eq!(recording.len(), 500, "{decimals} decimals");
            assert!((recording.sample_time_s - 5.0).abs() < 0.01, "{}", recording.sample_time_s);
            let off = recording.zero_s.unwrap() - EIGHT_O_CLOCK_S;
            assert!(off.abs() < 1.0, "{decimals} decimals: {off} s");
            let note = recording.quality.notes.last().unwrap();
            assert!(
                note.starts_with(
                    "the numbers in 'Time' are days of a spreadsheet: t counts from 2024-03-14T0"
                ),
                "{note}"
            );
            assert!(note.ends_with("(--time-in seconds says otherwise)"), "{note}");
        }
    }
    // Of a table in memory, too.
    let times = serial_days(9).map(|text| text.parse().unwrap()).collect();
    let column = |name: &str, cells| (name.to_owned(), cells);
    let count = |most: u32| Cells::Double((0..500).map(|k| f64::from(k % most)).collect());
    let columns = vec![column("t", Cells::Double(times)), column("y", count(5)), column("u", count(3))];
    let recording = Recording::from_columns("x", columns, &ReadOptions::default()).unwrap();
    assert!((recording.sample_time_s - 5.0).abs() < 1e-6, "{}", recording.sample_time_s);
}

#[test]
fn what_is_said_of_the_times_counts() {
    let seconds = ReadOptions { time_in: Some(TimeIn::Seconds), ..ReadOptions::default() };
    assert!((read(&table(serial_days(8)), &seconds).unwrap().sample_time_s * 86_400.0 - 5.0).abs() < 0.01);
    // Steps that are no simple number in either unit.
    let odd = table((0..500).map(|k| format!("{:.9}", 45_365.0 + f64::from(k) * 5.37 / 86_400.0)));
    assert_eq!(
        read(&odd, &ReadOptions::default()).unwrap_err().to_string(),
        "x.csv:1: the numbers in 'Time' could be days of a spreadsheet or seconds; --time-in days (every 5.37 s) or \
         --time-in seconds (every 0.0000622 s)"
    );
    let days = ReadOptions { time_in: Some(TimeIn::Days), ..ReadOptions::default() };
    assert!((read(&odd, &days).unwrap().sample_time_s - 5.37).abs() < 1e-4);
    // A unit in the name settles it, and so does a step that people sample at.
    let named = table(serial_days(8)).replacen("Time", "Time (s)", 1);
    assert!(read(&named, &ReadOptions::default()).unwrap().sample_time_s < 1e-4);
    let late = table((0..500).map(|k| format!("{:.2}", 45_365.0 + f64::from(k) * 0.25)));
    assert_eq!(read(&late, &ReadOptions::default()).unwrap().sample_time_s, 0.25);
}

/// Rows every two hours over whole days; the days as (first number, second number).
fn days(days: &[(u32, u32)]) -> String {
    let hours = |&(a, b): &(u32, u32)| (0..12).map(move |k| format!("{a:02}/{b:02}/2024 {:02}:00", 2 * k));
    table(days.iter().flat_map(hours))
}

#[test]
fn the_order_that_the_file_decides_is_told() {
    for (text, order, from) in [
        // A number above 12, before the order matters or behind it.
        (days(&[(13, 5), (14, 5)]), "day-first", "2024-05-13"),
        (days(&[(5, 13), (5, 14)]), "month-first", "2024-05-13"),
        (days(&[(1, 5), (2, 5), (4, 5), (13, 5)]), "day-first", "2024-05-01"),
        // Rows that go on over midnight.
        (days(&[(3, 5), (4, 5), (5, 5)]), "day-first", "2024-05-03"),
        (days(&[(5, 3), (5, 4), (5, 5)]), "month-first", "2024-05-03"),
    ] {
        let recording = read(&text, &ReadOptions::default()).unwrap();
        let note = format!("t counts from {from}T00:00:00; its dates are {order}");
        assert_eq!(recording.quality.notes.last(), Some(&note));
    }
    // Within one day nothing depends on it.
    let recording = read(&days(&[(1, 5)]), &ReadOptions::default()).unwrap();
    assert_eq!(
        (recording.quality.notes.last().unwrap().as_str(), recording.zero_s),
        ("t counts from 01/05/2024 00:00", None)
    );
}

#[test]
fn an_order_that_the_file_leaves_open_is_asked_for() {
    // Rows go on over midnight at some changes of the date, or at none.
    for (text, line) in [
        (days(&[(1, 1), (1, 2), (3, 3), (3, 4)]), 26),
        (days(&[(1, 5), (3, 5)]), 14),
        (table((1..=12).map(|n| format!("{n:02}/01/2024"))), 3),
    ] {
        let told = read(&text, &ReadOptions::default()).unwrap_err().to_string();
        assert!(told.starts_with(&format!("x.csv:{line}: '")), "{told}");
        assert!(told.contains("could have the day or the month first; --dates day-first ("), "{told}");
        assert!(told.contains(") or --dates month-first ("), "{told}");
    }
    // The same either way.
    let same = table((1..=5).map(|n| format!("{n:02}/{n:02}/2024 00:00")));
    let told = read(&same, &ReadOptions::default()).unwrap_err().to_string();
    assert!(told.contains("is not uniform"), "{told}");
    let months = days(&[(1, 1), (1, 2), (3, 3), (3, 4)]);
    let told = read(&months, &ReadOptions::default()).unwrap_err().to_string();
    assert!(
        told.ends_with("--dates day-first (1 February 2024) or --dates month-first (2 January 2024)"),
        "{told}"
    );
    for (order, days) in [(DateOrder::DayFirst, 94.0), (DateOrder::MonthFirst, 64.0)] {
        let options = ReadOptions { date_order: Some(order), ..ReadOptions::default() };
        let recording = read(&months, &options).unwrap();
        assert!(
            (recording.duration_s() / 86_400.0 - days).abs() < 1e-6,
            "{order:?}: {}",
            recording.duration_s() / 86_400.0
        );
    }
}
