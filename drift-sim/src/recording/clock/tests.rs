use super::*;

fn read(column: &str, cells: &[&str]) -> Result<Vec<f64>> {
    let (mut clock, mut mark) = (Clock::of(column, None, &ReadOptions::default())?, DecimalMark::Open);
    cells.iter().map(|cell| clock.read(cell.as_bytes(), &mut mark).map(|s| s.t_s)).collect()
}

#[test]
fn every_way_to_write_a_date_counts_seconds_from_the_first() {
    for (first, second, seconds) in [
        ("2024-05-01 12:00:00", "2024-05-01 12:00:01", 1.0),
        ("2024-05-01T12:00:00", "2024-05-01T12:00:00.25", 0.25),
        ("2024-05-01T12:00", "2024-05-01T12:01", 60.0),
        ("2024-05-01T12:00:00Z", "2024-05-01T12:00:00.5Z", 0.5),
        ("2024-05-01 12:00:00+02:00", "2024-05-01 10:00:01Z", 1.0),
        ("2024-02-29 23:59:59,5", "2024-03-01 00:00:00,0", 0.5),
        ("2024-05-01", "2024-05-02", 86_400.0),
        ("31.12.2023 23:59:59", "01.01.2024 00:00:01", 2.0),
        ("31.12.2023 23:59", "01.01.2024 00:01", 120.0),
        ("09:59:59.9", "10:00:00.0", 0.1),
        ("23:59:59", "00:00:01", 2.0),
        ("05/13/2024 11:59:59 PM", "05/14/2024 12:00:01 AM", 2.0),
        ("13/05/2024 23:59:59", "14/05/2024 00:00:01", 2.0),
        ("13/05/24 23:59", "14/05/24 0:01", 120.0),
        // Two days later or two months: the file decides, because rows are not months apart.
        ("1/2/2024 23:59", "2/2/2024 0:01", 120.0),
        ("2/1/2024 23:59", "2/2/2024 0:01", 120.0),
        ("2024/05/31 23:59:59", "2024/06/01 00:00:01", 2.0),
        ("31-May-2024 23:59:59", "01-Jun-2024 00:00:01", 2.0),
        ("01/02/2024, 12:00:00", "01/02/2024, 12:00:01", 1.0),
    ] {
        let times = read("t", &[first, second]).unwrap_or_else(|e| panic!("{first}: {e}"));
        assert_eq!(times[0], 0.0, "{first}");
        assert!((times[1] - seconds).abs() < 1e-12, "{first} to {second}: {}", times[1]);
    }
}

#[test]
fn the_unit_is_read_off_the_name() {
    for (column, expected) in [
        ("t", 5.0),
        ("time_s", 5.0),
        ("t [ms]", 5e-3),
        ("time_us", 5e-6),
        ("Time (ns)", 5e-9),
        ("ms", 5e-3),
        ("TimeUS", 5e-6),
        ("timestamp_ns", 5e-9),
        ("times", 5.0),
        ("items", 5.0),
    ] {
        let t = read(column, &["5"]).unwrap()[0];
        assert!((t / expected - 1.0).abs() < 1e-12, "{column}: {t}");
    }
    assert!(read("t_min", &["5"]).unwrap_err().to_string().contains("not in seconds"));
}

#[test]
fn numbers_of_our_days_count_from_1970() {
    for (column, first, start_s) in [
        ("Time", "1715587200", 1_715_587_200.0),
        ("Time", "1715587200000", 1_715_587_200.0),
        ("timestamp", "1715587200000000", 1_715_587_200.0),
        ("t", "1715587200000000000", 1_715_587_200.0),
        ("time_ms", "1715587200500", 1_715_587_200.5),
    ] {
        let (mut clock, mut mark) =
            (Clock::of(column, None, &ReadOptions::default()).unwrap(), DecimalMark::Open);
        assert_eq!(clock.read(first.as_bytes(), &mut mark).unwrap().t_s, start_s, "{first}");
        assert_eq!(clock.zero_s(), Some(0.0), "{first}");
    }
    // A clock that began with the machine, and a unit that is stated.
    for (column, first, start_s) in [("Time", "5e8", 5e8), ("time_s", "1715587200000", 1_715_587_200_000.0)] {
        let (mut clock, mut mark) =
            (Clock::of(column, None, &ReadOptions::default()).unwrap(), DecimalMark::Open);
        assert_eq!(clock.read(first.as_bytes(), &mut mark).unwrap().t_s, start_s, "{column}");
        assert_eq!(clock.zero_s(), None, "{column}");
    }
}

#[test]
fn what_is_no_time_is_refused() {
    for cells in [
        &["2024-13-01 12:00:00"][..],
        &["05/13/2024 12:00", "13/05/2024 12:01"],
        &["1/2/2024 12:00", "1/5/2024 12:00"],
        &["13/13/2024 12:00"],
        &["05/01/2024 13:00 PM"],
        &["yesterday"],
        &["2024-05-01 12:00:00", "5"],
        &["2024-05-01 12:00:00", "2024-05-01T12:00:00Z"],
        &["5", "2024-05-01 12:00:00"],
        &[""],
        &["nan"],
    ] {
        read("t", cells).unwrap_err();
    }
}
