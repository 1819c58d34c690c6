//! What a run of the monitor says.

use drift_core::{Moved, Side};

use super::quantity::{plain, sigmas, with_unit};
use super::{Answer, Clock, KeyNumber, Status};
use crate::monitor::{Course, Event, EventKind, PROBABILITY, Summary};
use crate::physics::Units;

/// The answer.
pub fn monitoring(summary: &Summary, clock: &Clock) -> Answer {
    let open = summary.events.iter().find(|e| e.to_s().is_none());
    let last_drift = summary.events.iter().rev().find(|e| e.kind() == EventKind::Drift);
    let (status, sentence, event) = match (summary.worst, open) {
        (None, _) if summary.channels.iter().all(|c| !c.learned) => {
            (Status::CantTell, "This run can't be judged: no channel has a baseline.".into(), None)
        }
        (None, _) if summary.channels.iter().all(|c| c.judged == 0) => {
            (Status::CantTell, "This run can't be judged: no window had enough valid samples.".into(), None)
        }
        (None, _) => (Status::Healthy, "The loop works as it did when it was calibrated.".into(), None),
        (Some(EventKind::Drift), Some(event)) if event.kind() == EventKind::Drift => (
            Status::Drift,
            format!("{} since about {}.", change(event), clock.says(began_s(event))),
            Some(event),
        ),
        (Some(EventKind::Drift), _) => match last_drift {
            Some(event) => {
                let to_s = event.to_s().unwrap_or(summary.start_s + summary.duration_s());
                let text =
                    format!("{} from {}, and has ended.", change(event), clock.span(began_s(event), to_s));
                (Status::Drift, text, Some(event))
            }
            None => (Status::Drift, "There is a drift among the events that are not listed.".into(), None),
        },
        (Some(EventKind::Suspect), Some(event)) => (
            Status::Suspect,
            format!(
                "{} since about {}; the recording ends too early to tell whether that stays.",
                change(event),
                clock.says(began_s(event))
            ),
            Some(event),
        ),
        (Some(_), _) => (Status::Healthy, came_back(summary), None),
    };
    let mut also: Vec<String> = pinned(summary, clock).into_iter().collect();
    also.extend(event.map(meaning).filter(|text| !text.is_empty()).map(str::to_owned));
    if status == Status::Healthy {
        also.extend(unseen(summary));
    }
    // A loop with nothing left to give is not healthy, whatever its channels say.
    let status = if summary.pinned.is_some() && status == Status::Healthy { Status::Suspect } else { status };
    Answer { status, sentence, also: also.join(" "), numbers: numbers(summary, event.or(open), clock) }
}

fn came_back(summary: &Summary) -> String {
    match summary.events.len() as u64 + summary.more_events {
        1 => "The loop left its healthy relation once and came back; nothing stayed.".into(),
        times => format!("The loop left its healthy relation {times} times and came back; nothing stayed."),
    }
}

/// What has changed, as the subject of a sentence.
fn change(event: &Event) -> &'static str {
    let Some(first) = leading_effort(event).or_else(|| leading(event).next()) else {
        return "Something has changed";
    };
    let meaning = first.kind.meaning();
    match first.side {
        Side::High => meaning.above,
        Side::Low => meaning.below,
    }
}

/// When what the sentence is about began: other channels may have left their baseline before, by chance.
fn began_s(event: &Event) -> f64 {
    leading_effort(event).or_else(|| leading(event).next()).map_or(event.from_s(), |course| course.from_s)
}

fn leading_effort(event: &Event) -> Option<&Course> {
    leading(event).find(|c| c.kind.meaning().change_of_u.is_some())
}

/// The courses that make the event what it is: of a drift, those that were called drift.
fn leading(event: &Event) -> impl Iterator<Item = &Course> {
    let kind = event.kind();
    event.courses.iter().filter(move |c| c.outcome == kind)
}

/// What the event may mean.
fn meaning(event: &Event) -> &'static str {
    let Some(first) = leading_effort(event).or_else(|| leading(event).next()) else { return "" };
    let meaning = first.kind.meaning();
    match first.side {
        Side::High => meaning.cause_above,
        Side::Low => meaning.cause_below,
    }
}

/// A controller that has nothing left to give.
pub fn pinned(summary: &Summary, clock: &Clock) -> Option<String> {
    summary.pinned.map(|p| {
        format!(
            "u stands at its limit of {}, {}, and the error does not vanish: {} on average.",
            of_u(plain(p.limit, 4), &summary.units),
            clock.span(p.from_s, p.to_s),
            of_y(plain(p.mean_e, 3), &summary.units)
        )
    })
}

/// What the run could not have shown.
fn unseen(summary: &Summary) -> Option<String> {
    let effort = summary.channels.iter().find(|c| c.kind.meaning().x_is_y && c.learned && c.judged > 0)?;
    let percent = 100.0 * PROBABILITY;
    Some(match effort.detectable {
        None => format!("With {} windows no lasting shift of u would have shown.", effort.judged),
        Some(detectable) => {
            let or_y = detectable.y.map_or_else(String::new, |y| {
                format!(", or of y by less than {},", of_y(plain(y, 2), &summary.units))
            });
            format!(
                "A lasting shift of u by less than {}{or_y} may hide in these {} windows (it would show with {percent} %).",
                of_u(plain(detectable.value, 2), &summary.units),
                effort.judged
            )
        }
    })
}

fn numbers(summary: &Summary, event: Option<&Event>, clock: &Clock) -> Vec<KeyNumber> {
    let decisions = KeyNumber::new(
        plain(summary.valid_hops as f64, 6),
        format!("windows judged, each {} s long", plain(summary.window_s, 4)),
    );
    let course = event.and_then(|event| leading_effort(event).or_else(|| event.main()));
    let (Some(event), Some(course)) = (event, course) else {
        let most =
            summary.channels.iter().map(|c| c.max_abs_z).filter(|z| z.is_finite()).fold(f64::NAN, f64::max);
        let alarms: u64 = summary.channels.iter().map(|c| c.alarms).sum();
        let mut numbers = vec![decisions];
        if most.is_finite() {
            numbers
                .push(KeyNumber::new(sigmas(most), "farthest from healthy; 1 sigma is the healthy scatter"));
        }
        numbers.push(KeyNumber::new(alarms.to_string(), "windows with an alarm"));
        return numbers;
    };
    let size = effort_change(course, &summary.units).map_or_else(
        || {
            KeyNumber::new(
                sigmas(course.max_z.into()),
                "farthest from healthy; 1 sigma is the healthy scatter",
            )
        },
        |(value, label)| KeyNumber::new(value, label),
    );
    vec![
        KeyNumber::new(short_time(clock, began_s(event)), "when it began, about"),
        size,
        KeyNumber::new(short_time(clock, course.alarm_s), "when its first alarm came"),
    ]
}

/// A time without what stands in parentheses.
fn short_time(clock: &Clock, t_s: f64) -> String {
    let text = clock.says(t_s);
    text.split_once(" (").map_or(text.clone(), |(seconds, _)| seconds.to_owned())
}

/// How far the refitted line has moved, in units of the channel's own value.
fn effort_change(course: &Course, units: &Units) -> Option<(String, String)> {
    let curve = course.fault_curve?;
    let what = course.kind.meaning().change_of_u?;
    // In a relation with memory the residual is not u itself.
    let shift = f64::from(curve.shift / course.visible);
    shift.is_finite().then(|| {
        let sign = if shift > 0.0 { "+" } else { "" };
        (of_u(format!("{sign}{}", plain(shift, 2)), units), what.to_owned())
    })
}

/// A number of u with its unit, where that is known.
fn of_u(number: String, units: &Units) -> String {
    with_unit(number, units.u.as_deref().unwrap_or_default())
}

/// The same of y.
fn of_y(number: String, units: &Units) -> String {
    with_unit(number, units.y.as_deref().unwrap_or_default())
}

/// How a curve has moved, in a word or two.
pub const fn moved_name(moved: Moved) -> &'static str {
    match moved {
        Moved::Undecided => "not told how",
        Moved::Intercept => "shifted",
        Moved::Slope => "tilted",
        Moved::Both => "shifted and tilted",
    }
}

/// The word for a side.
pub const fn side_name(side: Side) -> &'static str {
    match side {
        Side::High => "high",
        Side::Low => "low",
    }
}
