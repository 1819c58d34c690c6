//! Small files that ask for much: each is refused, or read, within a cap on memory and a clock. The cap is the system's own
//! (`ulimit -v`): whatever asks for more is ended by it, which is no error in one line.
#![cfg(target_os = "linux")]

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// What the command may read into memory, and what the process may map: the rest is the program itself and its threads.
const LIMIT: &str = "256M";
const CAP_KIB: u64 = 1 << 20;
/// Seconds for any of the files, in a build that is not optimised, on a busy machine.
const CLOCK: Duration = Duration::from_secs(20);

/// Exit code and standard error of a command line under the cap and the clock.
fn capped(folder: &Path, line: &str) -> (Option<i32>, String) {
    let shell = format!("ulimit -v {CAP_KIB}; exec \"$0\" {line}");
    let mut child = Command::new("sh")
        .args(["-c", &shell, env!("CARGO_BIN_EXE_drift")])
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let began = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if began.elapsed() > CLOCK {
            child.kill().unwrap();
            panic!("drift {line}: still running after {CLOCK:?}");
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    let mut message = String::new();
    std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut message).unwrap();
    (status.code(), message)
}

/// `drift init` refuses the file in one line that says this.
#[track_caller]
fn refused(folder: &TempDir, name: &str, what: &str) {
    let columns = match name.rsplit_once('.') {
        Some((_, "ulg")) => "--columns r=x.r,y=x.y,u=x.u",
        Some((_, "mat")) => "--columns t=,r=y,y=y,u=y --sample-time 1",
        _ => "",
    };
    let (code, message) = capped(folder.path(), &format!("init {name} --memory-limit {LIMIT} {columns}"));
    assert!(
        code == Some(1) && message.lines().count() == 1 && message.starts_with("error: "),
        "{name}: {code:?} {message}"
    );
    assert!(message.contains(what), "{name}: {message}");
}

const TOO_MUCH: &str = "reading it takes more than 256 MiB of memory; a larger --memory-limit";
const TOO_LONG: &str = "a row of more than 1 MiB";

fn gzip(write: impl FnOnce(&mut dyn Write)) -> Vec<u8> {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    write(&mut packer);
    packer.finish().unwrap()
}

fn zlib(parts: &[&[u8]], zeros: usize) -> Vec<u8> {
    let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    parts.iter().for_each(|part| packer.write_all(part).unwrap());
    std::io::copy(&mut std::io::Read::take(std::io::repeat(0), zeros as u64), &mut packer).unwrap();
    packer.finish().unwrap()
}

/// A sparse file: so many bytes on paper, none on the disk.
fn sparse(path: &Path, start: &[u8], bytes: u64) {
    let mut file = fs::File::create(path).unwrap();
    file.write_all(start).unwrap();
    file.set_len(bytes).unwrap();
}

#[test]
fn text_without_end_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    refused(&folder, "/dev/zero", "neither text nor a format that is read");
    let rows: String = (0..20_000).map(|k| format!("{k},1,2,3\n")).collect();
    sparse(&at("sparse.csv"), format!("t,r,y,u\n{rows}").as_bytes(), 2 << 30);
    refused(&folder, "sparse.csv", "more than 64 MiB of NULs");
    // 4 GB of one line, of one open quote, of commas, in a few megabytes.
    for (name, start, filling, what) in [
        ("line.csv.gz", "t,r,y,u\n0,1,2,3\n1,1,2,", b'5', TOO_LONG),
        ("quote.csv.gz", "t,r,y,u\n0,1,2,3\n1,1,2,\"", b'\n', TOO_LONG),
        ("commas.csv.gz", "t,r,y,u\n0,1,2,3\n1,1,2,3", b',', "a row of more than 262144 fields"),
    ] {
        let packed = gzip(|out| {
            out.write_all(start.as_bytes()).unwrap();
            let block = vec![filling; 1 << 20];
            (0..64).for_each(|_| out.write_all(&block).unwrap());
        });
        fs::write(at(name), packed).unwrap();
        refused(&folder, name, what);
    }
}

/// Good rows, more of them than fit: also those of a gap that one row makes.
#[test]
fn more_rows_than_the_budget_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let packed = gzip(|out| {
        out.write_all(b"r,y,u\n").unwrap();
        let block = b"1,2,3\n".repeat(100_000);
        (0..150).for_each(|_| out.write_all(&block).unwrap());
    });
    fs::write(folder.path().join("rows.csv.gz"), packed).unwrap();
    let line = "init rows.csv.gz --sample-time 1 --memory-limit 64M";
    let (code, message) = capped(folder.path(), line);
    assert_eq!(code, Some(1));
    assert!(message.contains("takes more than 64 MiB of memory"), "{message}");
    // Sample by sample none of it stays.
    let (code, message) = capped(folder.path(), "init rows.csv.gz --sample-time 1 --memory-limit 2K");
    assert!(code == Some(1) && message.contains("more than 2 KiB"), "{message}");
}

/// Four times as many columns take four times as long, and not sixteen: the ratio of two times, each the shorter of two, holds on a busy machine too.
#[test]
fn many_columns_take_no_longer_than_their_number() {
    let folder = tempfile::tempdir().unwrap();
    let (few, many) = (20_000, 80_000);
    for columns in [few, many] {
        let mut text = String::from("t,r,y,u");
        (0..columns).for_each(|i| text += &format!(",tag{i}"));
        for k in 0..3 {
            text += &format!("\n{k},1,2,{k}");
            text += &",0".repeat(columns);
        }
        fs::write(folder.path().join(format!("{columns}.csv")), text + "\n").unwrap();
    }
    let took = |columns: usize| {
        let began = Instant::now();
        let (code, message) = capped(folder.path(), &format!("init {columns}.csv"));
        assert_eq!(code, Some(1), "three rows tell no loop");
        assert!(!message.contains("column"), "{message}");
        began.elapsed().as_secs_f64()
    };
    let [of_few, of_many] = [few, many].map(|columns| took(columns).min(took(columns)));
    assert!(of_many < 8.0 * of_few, "{of_many} s beside {of_few} s");
}

/// The head of a .mat file of version 5.
fn mat_header() -> Vec<u8> {
    let mut header = vec![b' '; 124];
    header.extend(b"\x00\x01IM");
    header
}

fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

/// A packed vector of doubles stored as so many bytes of zero.
fn packed_vector(name: &str, count: u32) -> Vec<u8> {
    let dimensions = [count.to_le_bytes(), 1_u32.to_le_bytes()].concat();
    let head = [
        element(6, &[6_u32.to_le_bytes(), [0; 4]].concat()),
        element(5, &dimensions),
        element(1, name.as_bytes()),
        [1_u32.to_le_bytes(), count.to_le_bytes()].concat(),
    ]
    .concat();
    let size = head.len() as u32 + count;
    let packed = zlib(&[&14_u32.to_le_bytes(), &size.to_le_bytes(), &head], count as usize);
    [15_u32.to_le_bytes().to_vec(), (packed.len() as u32).to_le_bytes().to_vec(), packed].concat()
}

#[test]
fn matlab_files_that_unpack_to_gigabytes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    sparse(&at("padded.mat"), &mat_header(), 6 << 30);
    refused(&folder, "padded.mat", TOO_MUCH);
    // 1 MB that is 1 GiB of small integers, and eight times as much as numbers.
    fs::write(at("bytes.mat"), [mat_header(), packed_vector("y", 1 << 30)].concat()).unwrap();
    refused(&folder, "bytes.mat", TOO_MUCH);
    // 101 kB that are 100 MiB of bytes: they fit, their numbers don't.
    fs::write(at("numbers.mat"), [mat_header(), packed_vector("y", 100 << 20)].concat()).unwrap();
    refused(&folder, "numbers.mat", TOO_MUCH);
    // A table whose properties are said to be a gigabyte: the header says where they stand.
    let inside =
        [element(6, &[17, 0, 0, 0, 0, 0, 0, 0]), element(1, b"T"), element(1, b"MCOS"), element(1, b"table")];
    let table = element(14, &inside.concat());
    let mut header = mat_header();
    header.splice(116..124, (header.len() as u64 + table.len() as u64).to_le_bytes());
    fs::write(at("table.mat"), [header, table, packed_vector("", 300 << 20)].concat()).unwrap();
    refused(&folder, "table.mat", TOO_MUCH);
    // A size that no file has.
    let mut lies = mat_header();
    lies.extend([15_u32.to_le_bytes(), u32::MAX.to_le_bytes()].concat());
    fs::write(at("lies.mat"), lies).unwrap();
    refused(&folder, "lies.mat", "cut off or damaged");
}

fn ulog(messages: &[(u8, &[u8])]) -> Vec<u8> {
    let mut bytes = b"ULog\x01\x12\x35\x01\0\0\0\0\0\0\0\0".to_vec();
    for (kind, payload) in messages {
        bytes.extend((payload.len() as u16).to_le_bytes());
        bytes.push(*kind);
        bytes.extend(*payload);
    }
    bytes
}

#[test]
fn formats_of_a_flight_that_never_end_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: Vec<u8>| fs::write(folder.path().join(name), bytes).unwrap();
    let data: (u8, &[u8]) = (b'D', &[0; 12]);
    let subscription: (u8, &[u8]) = (b'A', b"\0\0\0x");
    // An array of 2^64 - 1 of nothing.
    let endless =
        ulog(&[(b'F', b"e:"), (b'F', b"x:uint64_t timestamp;e[18446744073709551615] x"), subscription, data]);
    assert!(endless.len() < 120);
    write("endless.ulg", endless);
    refused(&folder, "endless.ulg", "a format longer than a message");
    // Nothing within nothing, a thousand times a thousand times ...
    let nested: Vec<String> = (0..7).map(|i| format!("e{i}:e{}[60000] x", i + 1)).collect();
    let mut messages: Vec<(u8, &[u8])> = nested.iter().map(|text| (b'F', text.as_bytes())).collect();
    messages.extend([(b'F', b"e7:".as_slice()), (b'F', b"x:e0 x"), subscription, data]);
    write("nested.ulg", ulog(&messages));
    refused(&folder, "nested.ulg", "a format longer than a message");
    // 65 kB of name, in front of each of 4000 fields.
    let long = format!("x:i[4000] {}", "n".repeat(65_000));
    write("names.ulg", ulog(&[(b'F', b"i:int8_t a"), (b'F', long.as_bytes()), subscription, data]));
    refused(&folder, "names.ulg", "a field's name of more than 1024 letters");
    sparse(&folder.path().join("padded.ulg"), &ulog(&[]), 6 << 30);
    refused(&folder, "padded.ulg", TOO_MUCH);
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_files_that_ask_for_gigabytes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    // Reading starts at the end of a file: a padded one has no footer there.
    sparse(&at("padded.parquet"), b"PAR1", 6 << 30);
    refused(&folder, "padded.parquet", "cut off or damaged");
    // From a pipe it has to be held.
    let (code, message) = capped(folder.path(), &format!("init - --memory-limit {LIMIT} < padded.parquet"));
    assert!(code == Some(1) && message.contains(TOO_MUCH), "{message}");
    // A footer with a list of 2^31 entries.
    let mut footer = vec![0x15, 0x02, 0x19, 0xfc];
    footer.extend([0xff, 0xff, 0xff, 0xff, 0x07]);
    let length = (footer.len() as u32).to_le_bytes();
    fs::write(at("list.parquet"), [b"PAR1".as_slice(), &footer, &length, b"PAR1"].concat()).unwrap();
    refused(&folder, "list.parquet", "cut off or damaged");
    // A page of a sound file that says that it unpacks to 2 GB.
    let sound =
        fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/loop_brotli.parquet")).unwrap();
    for at_byte in 4..sound.len() {
        // A page begins with its type, then its size unpacked: field 1 and 2, whole numbers.
        if sound[at_byte - 4] == 0x15 && sound[at_byte - 2] == 0x15 && sound[at_byte] & 0x80 != 0 {
            let mut lies = sound.clone();
            lies.splice(at_byte - 1..=at_byte, [0xfe, 0xff, 0xff, 0xff, 0x0f]);
            fs::write(at("page.parquet"), lies).unwrap();
            let (code, message) = capped(folder.path(), &format!("init page.parquet --memory-limit {LIMIT}"));
            assert!(code == Some(1) && message.lines().count() == 1, "{code:?} {message}");
        }
    }
}

#[test]
fn loop_files_and_baselines_of_any_size_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let heater = "[loop]\nsample_time_s = 1.0\n[controller]\nkind = \"pi\"\nkp = 2.0\nki = 0.1\n[plant]\nkind = \
                  \"first-order\"\ngain = 1.0\ntime_constant_s = 20.0\n";
    let term = "[[physics]]\nkind = \"sensor_bias\"\nbias = 0.1\n";
    fs::write(folder.path().join("many.toml"), heater.to_owned() + &term.repeat(20_000)).unwrap();
    fs::write(folder.path().join("rec.csv"), "t,r,y,u\n0,1,2,3\n1,1,2,3\n").unwrap();
    for (line, what) in [
        ("simulate many.toml -o out.csv", "many.toml:11: 20000 tables [[physics]]; at most 256"),
        ("simulate /dev/zero -o out.csv", "/dev/zero: too large for a loop file"),
        ("monitor rec.csv --baseline /dev/zero", "/dev/zero: too large for a baseline"),
    ] {
        let (code, message) = capped(folder.path(), line);
        assert!(code == Some(1) && message.contains(what), "{line}: {code:?} {message}");
    }
    let huge = heater.replace("gain = 1.0", "gain = 1e308");
    fs::write(folder.path().join("huge.toml"), huge).unwrap();
    let (_, message) = capped(folder.path(), "simulate huge.toml -o out.csv");
    assert_eq!(message, "error: huge.toml:9: gain is 1e308; gain must be within +-1e15\n");
}

#[test]
fn odd_values_are_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..3000).map(|i| format!("7,1,{i},3\n")).collect();
    fs::write(folder.path().join("still.csv"), "t,r,y,u\n".to_owned() + &rows).unwrap();
    let (_, message) = capped(folder.path(), "init still.csv --repeated last");
    assert_eq!(message, "error: still.csv: one row of data only; two at least\n");
    let (_, message) = capped(folder.path(), "init still.csv");
    assert_eq!(
        message,
        "error: still.csv: the first 3000 rows all have the time 7 s; times that differ, or --columns t= --sample-time S\n"
    );
    let (code, message) = capped(folder.path(), "calibrate still.csv -o x --window 1e300");
    assert!(
        code == Some(2) && message.contains("a number of seconds from 1e-9 to 1e9 is allowed"),
        "{message}"
    );
    let (code, message) = capped(folder.path(), "simulate x.toml -o y --duration -1");
    assert!(
        code == Some(2) && message.contains("a number of seconds from 1e-9 to 1e9 is allowed"),
        "{message}"
    );
}

/// What fuzzing starts from, one folder a format (`fuzz/corpus`): each file is a recording or refused in one line.
#[test]
fn every_file_that_fuzzing_starts_from_is_read_or_refused() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus");
    let mut files = 0;
    for folder in fs::read_dir(&corpus).unwrap() {
        for file in fs::read_dir(folder.unwrap().path()).unwrap() {
            let path = file.unwrap().path();
            let (code, message) =
                capped(&corpus, &format!("look '{}' --memory-limit {LIMIT}", path.display()));
            let is_one_line =
                code == Some(1) && message.starts_with("error: ") && message.lines().count() == 1;
            assert!(code == Some(0) || is_one_line, "{}: {code:?} {message}", path.display());
            files += 1;
        }
    }
    assert!(files >= 45, "{files} files");
}

/// A step far below that of the rows asks for more samples than there is memory for; so does a run of years.
#[test]
fn more_samples_than_the_memory_admits_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..4000).map(|k| format!("{k},1,{},{}\n", k % 7, k % 3)).collect();
    fs::write(folder.path().join("rec.csv"), format!("t,r,y,u\n{rows}")).unwrap();
    let began = Instant::now();
    for (line, most) in [
        ("diagnose rec.csv --resample 0.001 --memory-limit 100M", "more than 190650 samples, whose"),
        ("init rec.csv --resample 0.0001 --memory-limit 100M", "more than 190650 samples, whose"),
        (
            "calibrate rec.csv -o b.toml --resample 0.0001 --memory-limit 100M",
            "more than 1048576 samples, whose",
        ),
    ] {
        let (code, message) = capped(folder.path(), line);
        assert_eq!(code, Some(1), "{line}: {message}");
        assert!(
            message.contains("whose work takes more than 100 MiB of memory; a larger step of --resample")
                && message.contains(most),
            "{message}"
        );
        assert_eq!(message.trim().lines().filter(|line| line.starts_with("error")).count(), 1, "{message}");
    }
    let loop_file = "[loop]\nsample_time_s = 1.0\n\n[controller]\nkind = \"pi\"\nkp = 2.0\nki = 0.1\n\n\
        [plant]\nkind = \"first-order\"\ngain = 1.0\ntime_constant_s = 20.0\n";
    fs::write(folder.path().join("loop.toml"), loop_file).unwrap();
    let (code, message) = capped(folder.path(), "simulate loop.toml -o run.csv --duration 1e9");
    assert_eq!(code, Some(1), "{message}");
    assert!(
        message.contains(
            "--duration 1e9 is 1e9 samples of 1 s; --duration up to 4.2949672e7 at this sample time"
        ),
        "{message}"
    );
    assert!(began.elapsed().as_secs() < 60, "{:?}", began.elapsed());
    assert!(!folder.path().join("run.csv").exists() && !folder.path().join("b.toml").exists());
}
