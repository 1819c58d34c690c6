//! What a calibration says.

use super::quantity::{percent, plain};
use super::{Answer, KeyNumber, Status};
use crate::calibrate::Calibration;

/// The answer.
pub fn calibration(of: &Calibration) -> Answer {
    let timing = &of.file.timing;
    let windows = f64::from(of.file.calibration.windows);
    let channels: Vec<String> = of.channels.iter().map(|c| c.kind.name().replace('_', " ")).collect();
    let known = |channels: &str| {
        format!(
            "The healthy loop is known: {} windows of {} s give the baseline of {channels}.",
            plain(windows, 6),
            plain(timing.window_s(), 4)
        )
    };
    let (status, sentence) = match channels.as_slice() {
        [] => (Status::CantTell, "No channel could be learnt from these recordings.".to_owned()),
        [most @ .., last] if !most.is_empty() => {
            (Status::Learnt, known(&format!("{} and {last}", most.join(", "))))
        }
        [one, ..] => (Status::Learnt, known(one)),
    };
    let asked: Vec<&String> = of.warnings.iter().filter(|warning| asks_for_action(warning)).collect();
    let also = match asked.as_slice() {
        [] => String::new(),
        [one] => format!("But {one}."),
        [first, rest @ ..] => format!("But {first}. {} below.", warnings(rest.len())),
    };
    let mut numbers = vec![KeyNumber::new(plain(windows, 6), "healthy windows")];
    if let Some(promise) = &of.file.promise {
        numbers.push(KeyNumber::new(
            hours(promise.false_alarm_every_h),
            format!(
                "from one false alarm to the next; {} of 100 such calibrations keep that",
                plain(100.0 * promise.confidence, 3)
            ),
        ));
        numbers.push(KeyNumber::new(
            hours(of.cost.delay * timing.hop_s() / 3600.0),
            format!("to find a shift of 1 sigma, {}", lateness(of.cost.delay / of.cost.delay_exact)),
        ));
    }
    Answer { status, sentence, also, numbers }
}

/// Whether a warning leaves the reader something to do: what the thresholds allow for already is a note.
pub fn asks_for_action(warning: &str) -> bool {
    !["allow for it", "differ for it", "were left out"].iter().any(|done| warning.contains(done))
}

fn warnings(count: usize) -> String {
    if count == 1 { "1 more warning stands".into() } else { format!("{count} more warnings stand") }
}

/// How much longer a shift takes to be found than with exact knowledge of the healthy loop: in per cent, or how many times from
/// twice as long on.
pub fn lateness(times_as_long: f64) -> String {
    if times_as_long < 2.0 {
        format!("{} later than with exact knowledge", percent(100.0 * (times_as_long - 1.0)))
    } else {
        format!("{} times as long as with exact knowledge", plain(times_as_long, 2))
    }
}

/// A time of so many hours as a person says it.
fn hours(hours: f64) -> String {
    match hours {
        h if h >= 48.0 => format!("{} days", plain(h / 24.0, 3)),
        h if h >= 2.0 => format!("{} h", plain(h, 3)),
        h if h >= 2.0 / 60.0 => format!("{} min", plain(60.0 * h, 3)),
        h => format!("{} s", plain(3600.0 * h, 3)),
    }
}

#[cfg(test)]
mod tests {
    use super::lateness;

    #[test]
    fn what_takes_several_times_as_long_is_told_in_times() {
        assert_eq!(lateness(1.26), "26 % later than with exact knowledge");
        assert_eq!(lateness(4.81), "4.8 times as long as with exact knowledge");
    }
}
