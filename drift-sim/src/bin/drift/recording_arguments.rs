//! The arguments that say how a recording is read, the same in every command that reads one.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use clap::Args;
use drift_sim::recording::{
    ColumnMap, DateOrder, MEMORY_LIMIT_BYTES, Overview, Part, ReadOptions, Recording, RecordingStream,
    Repeated, TimeIn, When,
};
use drift_sim::terminal::Terminal;
use drift_sim::{Error, Result};

use crate::number_argument::seconds;

/// How recordings are read.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Reading recordings")]
pub struct RecordingArguments {
    /// Columns of the signals where they are not called t, r, y, u, nor SP, PV, OP and the like, which are guessed;
    /// variables of a .mat, topic.field of a .ulg, numbers of columns without a header; `t=Date+Time` puts two columns
    /// together, `t=` ignores the time stamps, `r=` says that r is not recorded
    #[arg(long, value_name = "t=time,r=SP,y=PV,u=OP")]
    columns: Option<ColumnMap>,
    /// Sample time in seconds where there are no time stamps
    #[arg(long, value_name = "S", value_parser = seconds)]
    sample_time: Option<f64>,
    /// Put unequally sampled rows on a grid of DT seconds: y interpolated, r and u held
    #[arg(long, value_name = "DT", value_parser = seconds)]
    resample: Option<f64>,
    /// Where the loop is closed, like occupied=1 or mode=AUTO; elsewhere samples count as manual. Can be repeated. Without
    /// it columns called MODE, AUTO, QUALITY and the like say it, numbers among them by whether u moves; `always` counts
    /// every row
    #[arg(long, value_name = "COLUMN=VALUE")]
    when: Vec<When>,
    /// Rows that repeat a time stamp with other values: refuse, or take the first, the last or their mean
    #[arg(long, value_name = "HOW", default_value = "refuse")]
    repeated: Repeated,
    /// How dates like 5/1/2024 are meant, where the recording leaves it open: day-first or month-first
    #[arg(long, value_name = "ORDER")]
    dates: Option<DateOrder>,
    /// What numbers in the time column count, where that is no unit in its name: seconds, or days as spreadsheets count them
    #[arg(long, value_name = "UNIT")]
    time_in: Option<TimeIn>,
    /// Which part is read of a log in which time begins anew, as after a restart: 1, 2, ... or last
    #[arg(long, value_name = "N")]
    part: Option<Part>,
    /// What reading one recording may take, like 500M or 8G; 2G by default
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    memory_limit: Option<u64>,
}

impl RecordingArguments {
    /// Reads a recording whole, with these further columns, and tells what was chosen on the way. The work on a sample takes so many
    /// bytes.
    pub fn read(&self, path: &Path, extra: Vec<String>, work_bytes: u64) -> Result<Recording> {
        check_there(path)?;
        let recording = Recording::read(path, &ReadOptions { extra, work_bytes, ..self.read_options() })?;
        tell(&recording.name, &recording.quality.notes);
        Ok(recording)
    }

    /// Opens a recording to be read sample by sample, with these further columns, and tells what was chosen on the way.
    pub fn open(&self, path: &Path, extra: Vec<String>) -> Result<RecordingStream> {
        check_there(path)?;
        let stream = RecordingStream::open(path, &ReadOptions { extra, ..self.read_options() })?;
        tell(stream.name(), &stream.quality().notes);
        Ok(stream)
    }

    /// Looks at a recording as it is.
    pub fn look(&self, path: &Path) -> Result<Overview> {
        check_there(path)?;
        Overview::read(path, &ReadOptions { incomplete: true, ..self.read_options() })
    }

    /// What reading one recording may take, bytes.
    pub fn memory_limit_bytes(&self) -> u64 {
        self.memory_limit.unwrap_or(MEMORY_LIMIT_BYTES)
    }

    /// The library's options, with no further columns asked for.
    fn read_options(&self) -> ReadOptions {
        ReadOptions {
            columns: self.columns.clone().unwrap_or_default(),
            sample_time_s: self.sample_time,
            resample_s: self.resample,
            when: self.when.clone(),
            repeated: self.repeated,
            date_order: self.dates,
            time_in: self.time_in,
            part: self.part,
            memory_limit_bytes: self.memory_limit,
            ..ReadOptions::default()
        }
    }
}

/// Refuses the commonest slips in plain words: a name that is not there, a folder, a file of drift's own.
fn check_there(path: &Path) -> Result<()> {
    if path == Path::new("-") {
        return Ok(());
    }
    let refused = |e: io::Error| Error::of_file("can't be read", &e).in_file(path);
    if fs::metadata(path).map_err(refused)?.is_dir() {
        return Err(refused(io::ErrorKind::IsADirectory.into()));
    }
    if path.extension().is_some_and(|extension| extension == "toml") {
        return Err(Error::new("this is no recording: drift keeps loops and baselines in TOML files")
            .allowed("a log of r, y and u, such as a CSV file")
            .in_file(path));
    }
    Ok(())
}

/// A paragraph each on standard error, so that nothing that was guessed stays hidden.
pub fn tell(name: &str, notes: &[String]) {
    let here = Terminal::here();
    let name = short_enough(name, here.width / 2);
    for note in notes {
        // Nobody may listen: a note is no reason to stop.
        let _ = std::io::stderr().write_all(here.wrapped("note: ", &format!("{name}: {note}")).as_bytes());
    }
}

fn bytes(text: &str) -> std::result::Result<u64, String> {
    let lower = text.trim().to_lowercase();
    let number = lower.trim_end_matches("ib").trim_end_matches('b').trim_end_matches(['k', 'm', 'g']);
    let shift = match lower.get(number.len()..).unwrap_or_default().chars().next() {
        Some('k') => 10,
        Some('m') => 20,
        Some('g') => 30,
        _ => 0,
    };
    let bytes = number.parse::<u64>().ok().and_then(|number| number.checked_mul(1 << shift));
    bytes
        .filter(|bytes| *bytes > 0)
        .ok_or_else(|| "a number of bytes above 0 is allowed, like 500M or 8G".into())
}

/// The end of a path that is too long for a line beside what is said of it: its last folders, as many as fit, and the file.
fn short_enough(path: &str, most: usize) -> String {
    if path.chars().count() <= most {
        return path.to_owned();
    }
    let mut ends =
        path.char_indices().filter(|(_, c)| std::path::is_separator(*c)).map(|(at, _)| &path[at..]);
    let fits = ends.clone().find(|end| end.chars().count() + 3 <= most).or(ends.next_back());
    fits.map_or_else(|| path.to_owned(), |end| format!("...{end}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[test]
    fn of_a_long_path_its_end_is_shown() {
        assert_eq!(short_enough("logs/run.csv", 40), "logs/run.csv");
        let long = "/home/someone/measurements/plant 7/2024/may/axis_1.csv";
        assert_eq!(short_enough(long, 40), ".../plant 7/2024/may/axis_1.csv");
        assert_eq!(
            short_enough("/a/name_that_is_longer_than_that.csv", 10),
            ".../name_that_is_longer_than_that.csv"
        );
        assert_eq!(short_enough("name_that_is_longer.csv", 10), "name_that_is_longer.csv");
    }

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        recording: RecordingArguments,
    }

    #[test]
    fn arguments_become_options() {
        let line = ["x", "--columns", "t=time,y=PV", "--resample", "0.01", "--when", "a=1", "--when", "b>2"];
        let options = Command::parse_from(line).recording.read_options();
        assert_eq!((options.columns.y.as_str(), options.resample_s), ("PV", Some(0.01)));
        assert_eq!(options.when.len(), 2);
        let limit = |text: &str| {
            let line = Command::try_parse_from(["x", "--memory-limit", text]);
            line.ok().and_then(|command| command.recording.read_options().memory_limit_bytes)
        };
        assert_eq!(limit("8G"), Some(8 << 30));
        assert_eq!(limit("500MiB"), Some(500 << 20));
        assert_eq!(limit("1000"), Some(1000));
        assert_eq!((limit("much"), limit("0"), limit("99999999999G")), (None, None, None));
    }
}
