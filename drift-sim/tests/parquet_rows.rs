//! Parquet against CSV: the same rows, written in both formats, are the same recording to the last bit, and the same fault of a row is
//! the same line. The Parquet files are of several row groups and small pages, with nulls and dictionaries.

#![cfg(feature = "parquet")]

use std::io::Cursor;
use std::sync::Arc;

use drift_sim::recording::{ReadOptions, Recording};
use parquet::basic::Compression;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, FloatType, Int32Type, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::parser::parse_message_type;

const ROWS: usize = 40_000;
const GROUP_ROWS: usize = 17_000;

/// The cells of a column as Parquet holds them.
enum Cells {
    Double(Vec<Option<f64>>),
    Single(Vec<f32>),
    Int32(Vec<i32>),
    Int64(Vec<Option<i64>>),
    Text(Vec<String>),
}

/// A column: how Parquet's schema declares it, its cells, and the same as CSV has them.
struct Column {
    declared: &'static str,
    cells: Cells,
    text: Vec<String>,
}

fn doubles(declared: &'static str, of: impl Fn(usize) -> Option<f64>) -> Column {
    let cells: Vec<_> = (0..ROWS).map(of).collect();
    let text = cells.iter().map(|x| x.map_or(String::new(), |x| x.to_string())).collect();
    Column { declared, cells: Cells::Double(cells), text }
}

fn integers(
    declared: &'static str,
    of: impl Fn(usize) -> Option<i64>,
    text: impl Fn(i64) -> String,
) -> Column {
    let cells: Vec<_> = (0..ROWS).map(of).collect();
    let text = cells.iter().map(|x| x.map_or(String::new(), &text)).collect();
    Column { declared, cells: Cells::Int64(cells), text }
}

/// r, y with nulls, u in single precision, and a mode.
fn signals() -> Vec<Column> {
    let u: Vec<f32> = (0..ROWS).map(|k| (k as f32 * 0.01).cos()).collect();
    let mode: Vec<String> =
        (0..ROWS).map(|k| if k % 5000 < 70 { "MAN" } else { "AUTO" }.to_owned()).collect();
    vec![
        integers("required int64 r", |k| Some(k as i64 / 1000), |x| x.to_string()),
        doubles("optional double y", |k| (k % 13 != 5).then(|| (k as f64 * 0.01).sin())),
        // As text a single is the double that it is.
        Column {
            declared: "required float u",
            text: u.iter().map(|x| f64::from(*x).to_string()).collect(),
            cells: Cells::Single(u),
        },
        Column { declared: "required binary mode (string)", cells: Cells::Text(mode.clone()), text: mode },
    ]
}

/// The name in a declaration.
fn name(column: &Column) -> &str {
    column.declared.split(' ').nth(2).unwrap()
}

fn csv(columns: &[Column]) -> Vec<u8> {
    let mut text = columns.iter().map(name).collect::<Vec<_>>().join(",") + "\n";
    for row in 0..ROWS {
        text += &columns.iter().map(|c| c.text[row].as_str()).collect::<Vec<_>>().join(",");
        text.push('\n');
    }
    text.into_bytes()
}

fn parquet(columns: &[Column]) -> Vec<u8> {
    let declared: Vec<&str> = columns.iter().map(|c| c.declared).collect();
    let schema = parse_message_type(&format!("message rows {{ {}; }}", declared.join("; "))).unwrap();
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_data_page_size_limit(8 << 10)
        .set_write_batch_size(500)
        .set_dictionary_page_size_limit(4 << 10)
        .build();
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, Arc::new(schema), Arc::new(properties)).unwrap();
    for from in (0..ROWS).step_by(GROUP_ROWS) {
        let rows = from..(from + GROUP_ROWS).min(ROWS);
        let mut group = file.next_row_group().unwrap();
        for column in columns {
            let mut writer = group.next_column().unwrap().unwrap();
            write(&mut writer, column, rows.clone());
            writer.close().unwrap();
        }
        group.close().unwrap();
    }
    file.close().unwrap();
    bytes
}

fn write(writer: &mut SerializedColumnWriter<'_>, column: &Column, rows: std::ops::Range<usize>) {
    let is_optional = column.declared.starts_with("optional");
    // A level for each row, a value for each that is there.
    macro_rules! put {
        ($kind:ty, $cells:expr) => {{
            let cells: Vec<_> = $cells.collect();
            let levels: Vec<i16> = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
            let values: Vec<_> = cells.into_iter().flatten().collect();
            writer.typed::<$kind>().write_batch(&values, is_optional.then_some(&levels), None).unwrap();
        }};
    }
    match &column.cells {
        Cells::Double(cells) => put!(DoubleType, cells[rows].iter().copied()),
        Cells::Single(cells) => put!(FloatType, cells[rows].iter().copied().map(Some)),
        Cells::Int32(cells) => put!(Int32Type, cells[rows].iter().copied().map(Some)),
        Cells::Int64(cells) => put!(Int64Type, cells[rows].iter().copied()),
        Cells::Text(cells) => {
            put!(ByteArrayType, cells[rows].iter().map(|text| Some(ByteArray::from(text.as_str()))));
        }
    }
}

fn read(bytes: Vec<u8>, options: &ReadOptions) -> Result<Recording, String> {
    Recording::from_reader("x", Cursor::new(bytes), options).map_err(|e| e.to_string())
}

/// Everything that two recordings can differ in, numbers as bits.
fn shown(recording: &Recording) -> impl PartialEq + std::fmt::Debug + use<> {
    let bits = |column: &[f64]| column.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    let signals = [&recording.r, &recording.y, &recording.u].map(|column| bits(column));
    let extra: Vec<_> = recording.extra.iter().map(|(name, column)| (name.clone(), bits(column))).collect();
    let times =
        [recording.sample_time_s, recording.start_s, recording.zero_s.unwrap_or(-1.0)].map(f64::to_bits);
    let mut quality = recording.quality.clone();
    // A CSV's first line is its header.
    quality.time_deviation_max_line = 0;
    (signals, extra, times, recording.state.clone(), quality)
}

fn time_of_day(ms: i64) -> String {
    format!("2024-05-01T12:{:02}:{:02}.{:03}", ms / 60_000, ms / 1000 % 60, ms % 1000)
}

/// Milliseconds of 2024-05-01 12:00.
const NOON_MS: i64 = 1_714_564_800_000;

fn stamps(declared: &'static str, in_a_ms: i64, zone: &'static str) -> Column {
    let text = move |count: i64| time_of_day(count / in_a_ms - NOON_MS) + zone;
    integers(declared, move |k| Some((NOON_MS + 20 * k as i64) * in_a_ms), text)
}

#[test]
fn the_same_rows_are_the_same_recording() {
    let days: Vec<i32> = (0..ROWS as i32).collect();
    let singles: Vec<f32> = (0..ROWS).map(|k| (k as f32 * 0.1 * 10.0).round() / 10.0).collect();
    let written: Vec<String> = (0..ROWS as i64).map(|k| time_of_day(20 * k)).collect();
    let date = |day: &i32| {
        let date = jiff::civil::date(1970, 1, 1) + jiff::Span::new().days(*day);
        date.to_string()
    };
    let times = [
        doubles("required double t", |k| Some(k as f64 * 0.001)),
        doubles("required double t", |k| Some((k as f64 * 6.6).round() / 100.0)),
        doubles("required double t", |k| Some(1.7e9 + k as f64 * 0.25)),
        doubles("optional double t_ms", |k| Some(k as f64 * 2.5)),
        Column {
            declared: "required float t",
            text: singles.iter().map(f32::to_string).collect(),
            cells: Cells::Single(singles),
        },
        integers("required int64 t_us", |k| Some(1_700_000_000_000_000 + 100 * k as i64), |x| x.to_string()),
        integers("optional int64 t", |k| Some(k as i64 - 500), |x| x.to_string()),
        stamps("required int64 time (timestamp(millis,false))", 1, ""),
        stamps("optional int64 time (timestamp(millis,true))", 1, "Z"),
        stamps("required int64 time (timestamp(micros,false))", 1_000, ""),
        stamps("required int64 time (timestamp(micros,true))", 1_000, "Z"),
        stamps("required int64 time (timestamp(nanos,false))", 1_000_000, ""),
        stamps("optional int64 time (timestamp(nanos,true))", 1_000_000, "Z"),
        Column {
            declared: "required int32 time (date)",
            text: days.iter().map(date).collect(),
            cells: Cells::Int32(days),
        },
        Column {
            declared: "required binary time (string)",
            cells: Cells::Text(written.clone()),
            text: written,
        },
    ];
    for time in times {
        let declared = time.declared;
        let columns: Vec<Column> = [time].into_iter().chain(signals()).collect();
        let options = ReadOptions { keep_extra: true, ..ReadOptions::default() };
        let of_csv = read(csv(&columns), &options).unwrap();
        let of_parquet = read(parquet(&columns), &options).unwrap();
        assert_eq!(of_csv.quality.manual, 560, "{declared}");
        assert_eq!(of_csv.quality.missing_y, 3077, "{declared}");
        let is_same = shown(&of_parquet) == shown(&of_csv);
        assert!(is_same, "{declared}: {:?} {:?}", of_csv.quality, of_parquet.quality);
    }
}

#[test]
fn the_same_fault_is_the_same_line() {
    let time = |of: fn(usize) -> Option<f64>| doubles("optional double t", of);
    let stamp = |of: fn(i64) -> i64| {
        let text = |ms: i64| time_of_day(ms - NOON_MS);
        integers("required int64 time (timestamp(millis,false))", move |k| Some(NOON_MS + of(k as i64)), text)
    };
    let faults = [
        (time(|k| Some(if k == 35_000 { 3.0 } else { k as f64 * 0.5 })), "time goes back"),
        (time(|k| (k != 35_000).then_some(k as f64 * 0.5)), "no time stamp in column 't'"),
        (time(|k| Some(if k == 35_000 { 17_500.1 } else { k as f64 * 0.5 })), "off the grid"),
        (time(|k| Some(if k >= 35_000 { 1e9 } else { 0.0 } + k as f64 * 0.5)), "a gap of"),
        (time(|k| Some((k - usize::from(k == 35_000)) as f64 * 0.5)), "again, with other values"),
        (stamp(|k| if k == 35_000 { 7 } else { 20 * k }), "time goes back"),
        (stamp(|k| 20 * k + i64::from(k == 35_000)), "off the grid"),
    ];
    for (time, what) in faults {
        let columns: Vec<Column> = [time].into_iter().chain(signals()).collect();
        let of_csv = read(csv(&columns), &ReadOptions::default()).unwrap_err();
        let of_parquet = read(parquet(&columns), &ReadOptions::default()).unwrap_err();
        assert!(of_parquet.starts_with("x:35001: ") && of_parquet.contains(what), "{of_parquet}");
        assert_eq!(of_csv.replacen("x:35002: ", "x:35001: ", 1), of_parquet);
    }
}

/// Columns that nobody reads are not unpacked, and what is read passes through in batches: the memory of a few pages is enough for
/// any number of rows, and not for the recording itself.
#[test]
fn rows_pass_through_a_small_memory() {
    let columns: Vec<Column> =
        [doubles("required double t", |k| Some(k as f64 * 0.5))].into_iter().chain(signals()).collect();
    let options = ReadOptions { memory_limit_bytes: Some(8 << 20), ..ReadOptions::default() };
    let bytes = parquet(&columns);
    let mut stream =
        drift_sim::recording::RecordingStream::from_reader("x", Cursor::new(bytes.clone()), &options)
            .unwrap();
    let mut rows = 0;
    while stream.next().unwrap().is_some() {
        rows += 1;
    }
    assert_eq!(rows, ROWS);
    let error = read(bytes, &ReadOptions { memory_limit_bytes: Some(2 << 20), ..options }).unwrap_err();
    assert!(error.contains("takes more than 2 MiB of memory"), "{error}");
}
