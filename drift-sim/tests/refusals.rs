//! What is refused, and in which words: one line that names the flag or the file, says what is wrong and what is allowed, with numbers as
//! one types them. Each is typed as a person would.

use std::path::Path;
use std::process::Command;

const HEATER: &str = "[loop]\nsample_time_s = 0.2\n[controller]\nkind = \"pi\"\nkp = 1\nki = 0.1\n\
                      [plant]\nkind = \"first-order\"\ngain = 1.0\ntime_constant_s = 5.0\n";

/// A recording of 2000 samples, and the loop that it is of.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("heater.toml", HEATER);
    write("fast.toml", &HEATER.replace("0.2", "1e-300"));
    write("strong.toml", &HEATER.replace("gain = 1.0", "gain = 1e30"));
    let lags = HEATER.split("gain = ").next().unwrap().replace("first-order", "transfer-function");
    write("lags.toml", &format!("{lags}num = [1e99]\nden = [1.0, 1.0]\n"));
    write("late.toml", &(HEATER.to_owned() + "delay_s = 1e12\n"));
    let mut csv = String::from("t,r,y,u\n");
    for i in 0..2000 {
        let (t, r) = (0.2 * f64::from(i), f64::from(i / 100 % 3));
        csv += &format!(
            "{t:.1},{r},{},{}\n",
            r + 0.1 * (f64::from(i) * 1.7).sin(),
            2.0 * r + 0.1 * (f64::from(i) * 0.9).cos()
        );
    }
    write("rec.csv", &csv);
    folder
}

/// The exit code, and what is told on standard error.
fn told(folder: &Path, line: &str) -> (Option<i32>, String) {
    let out =
        Command::new(env!("CARGO_BIN_EXE_drift")).args(line.split(' ')).current_dir(folder).output().unwrap();
    (out.status.code(), String::from_utf8(out.stderr).unwrap())
}

#[test]
fn an_option_out_of_its_range_is_named_with_what_is_allowed() {
    let folder = folder();
    for (line, what) in [
        (
            "simulate heater.toml -o x --duration nan",
            "'nan' for '--duration <S>': a number of seconds from 1e-9 to 1e9 is allowed",
        ),
        ("simulate heater.toml -o x --duration 1e-300", "a number of seconds from 1e-9 to 1e9 is allowed"),
        (
            "simulate heater.toml -o x --reference-hold 0",
            "'0' for '--reference-hold <TICKS>': a whole number from 1 on is allowed",
        ),
        ("simulate heater.toml -o x --reference-hold -1", "a whole number from 1 on is allowed"),
        (
            "simulate heater.toml -o x --reference-sd -1",
            "'-1' for '--reference-sd <R>': a number from 0 to 1e15 is allowed",
        ),
        ("simulate heater.toml -o x --reference-mean 1e308", "a number from -1e15 to 1e15 is allowed"),
        ("simulate heater.toml -o x --seed -1", "a whole number from 0 to 18446744073709551615 is allowed"),
        (
            "calibrate rec.csv -o x --window 1e-300",
            "'1e-300' for '--window <S>': a number of seconds from 1e-9 to 1e9 is allowed",
        ),
        (
            "calibrate rec.csv -o x --window -1",
            "'-1' for '--window <S>': a number of seconds from 1e-9 to 1e9 is allowed",
        ),
        ("calibrate rec.csv -o x --k -1", "'-1' for '--k <K>': a number from 0.1 to 2 is allowed"),
        (
            "calibrate rec.csv -o x --lambda 3",
            "'3' for '--lambda <LAMBDA>': a number from 0.02 to 1 is allowed",
        ),
        (
            "calibrate rec.csv -o x --confidence 3",
            "'3' for '--confidence <C>': a number from 0.5 to 0.99 is allowed",
        ),
        (
            "calibrate rec.csv -o x --false-alarm-every 0",
            "'0' for '--false-alarm-every <HOURS>': a number above 0, up to 1e15 is allowed",
        ),
        (
            "calibrate rec.csv -o x --saturation 1",
            "'1' for '--saturation <LO,HI>': two numbers are needed, the lower limit and the upper one, like 0,100",
        ),
        ("calibrate rec.csv -o x --saturation 5,-5", "two numbers are needed"),
        (
            "diagnose rec.csv --memory-limit -1",
            "'-1' for '--memory-limit <BYTES>': a number of bytes above 0 is allowed, like 500M or 8G",
        ),
        (
            "diagnose rec.csv --guarantee 2",
            "'2' for '--guarantee <ALPHA>': a number between 0 and 1 is allowed",
        ),
        (
            "look rec.csv --resample 1e300",
            "'1e300' for '--resample <DT>': a number of seconds from 1e-9 to 1e9 is allowed",
        ),
        ("plan heater.toml --diagnosis d.json -o x --chance -1", "a number between 0 and 1 is allowed"),
        ("design --h 5 --mission 0", "'0' for '--mission <N>': a whole number from 1 on is allowed"),
    ] {
        let (code, message) = told(folder.path(), line);
        assert_eq!(code, Some(2), "{line}: {message}");
        assert!(message.starts_with("error: invalid value ") && message.contains(what), "{line}: {message}");
        assert!(!message.contains("-- -1") && !message.contains("rec.csv"), "{line}: {message}");
    }
}

#[test]
fn what_only_the_file_shows_to_be_wrong_is_told_in_one_line() {
    let folder = folder();
    for (line, what) in [
        (
            "calibrate rec.csv -o x --window 1e-9",
            "rec.csv: --window 1e-9 is 5e-9 samples of 0.2 s; 1 to 1e9 samples, 0.2 to 2e8 s",
        ),
        (
            "calibrate rec.csv -o x --window 20.3",
            "rec.csv: --window 20.3 is 101.5 samples of 0.2 s; a whole number of samples, such as --window 20.4",
        ),
        (
            "calibrate rec.csv -o x --window 4 --false-alarm-every 1e14",
            "rec.csv: --false-alarm-every 1e14 is one in 9e16 decisions; 5 to 1e9 decisions, which are 0.00556 to \
             1110000 h at this hop",
        ),
        (
            "simulate fast.toml -o x",
            "fast.toml:2: sample_time_s is 1e-300; sample_time_s must be from 1e-9 to 1e9 s",
        ),
        ("simulate strong.toml -o x", "strong.toml:9: gain is 1e30; gain must be within +-1e15"),
        (
            "simulate lags.toml -o x",
            "lags.toml:9: the gain at rest, the last of num over the last of den, is 1e99; it must be within +-1e15",
        ),
        (
            "simulate late.toml -o x",
            "late.toml: the dead time is 1e12 s; up to 200000 s, which are 1000000 samples, are allowed",
        ),
        (
            "simulate heater.toml -o x --duration 1e9",
            "--duration 1e9 is 5e9 samples of 0.2 s; --duration up to 8589934.4 at this sample time, which is 4.2949672e7 samples; or a larger --memory-limit",
        ),
        (
            "diagnose rec.csv --loop heater.toml --resample 1",
            "rec.csv: sampled every 1 s, but the loop file's sample_time_s is 0.2 s; state the recording's sample time in the loop \
             file, or add --resample 0.2",
        ),
        (
            "look nofile.csv",
            "nofile.csv: can't be read: there is no such file; check its name and its folder",
        ),
        ("look .", ".: can't be read: it is a folder; name a file in it"),
        (
            "look heater.toml",
            "heater.toml: this is no recording: drift keeps loops and baselines in TOML files; a log of r, y and u, such as a CSV file",
        ),
        (
            "simulate nofile.toml -o x",
            "nofile.toml: can't be read: there is no such file; check its name and its folder",
        ),
        (
            "simulate heater.toml -o no/such/x.csv",
            "no/such/x.csv: can't be written: there is no such folder; make the folder first",
        ),
        (
            "monitor rec.csv --baseline rec.csv",
            "rec.csv: this is no baseline; a baseline, which `drift calibrate HEALTHY.csv -o BASELINE.toml` makes",
        ),
        (
            "monitor rec.csv --baseline heater.toml",
            "heater.toml: this is a loop file; a baseline, which `drift calibrate HEALTHY.csv -o BASELINE.toml` makes",
        ),
    ] {
        let (code, message) = told(folder.path(), line);
        assert_eq!((code, message.as_str()), (Some(1), format!("error: {what}\n").as_str()), "{line}");
    }
}

/// Three hundred digits are nothing that a person reads: no message has a number of more than twenty.
#[test]
fn no_message_has_a_number_that_nobody_reads() {
    let folder = folder();
    for number in ["1e-300", "1e300", "-1e300", "0.1234567890123456789", "5e-324", "inf", "-0"] {
        for line in [
            "calibrate rec.csv -o x --window N",
            "calibrate rec.csv -o x --hop N",
            "calibrate rec.csv -o x --false-alarm-every N",
            "calibrate rec.csv -o x --blank N --blank-step 1",
            "calibrate rec.csv -o x --k N",
            "simulate heater.toml -o x --reference-sd N",
            "look rec.csv --sample-time N",
            "plan heater.toml --diagnosis rec.csv -o x --r-rate N",
            "design --h N",
            "design --arl0 N",
            "design --k N --h 5",
            "design --h 5 --slope N",
        ] {
            let (_, message) = told(folder.path(), &line.replace('N', number));
            // The parser of the command line quotes what was typed, and a seed may have as many digits.
            let own = message.replace(number, "");
            let longest = own.split(|c: char| !c.is_ascii_digit() && c != '.').map(str::len).max();
            assert!(longest <= Some(20), "{line} with {number}: {message}");
        }
    }
}
