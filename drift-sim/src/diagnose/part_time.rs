//! A part of a recording begins later than its whole: what began or acted at some time of the whole is moved to the
//! time of the part.

use crate::control_loop::Loop;

/// The loop in the time of a part that begins `origin_s` after what its onsets and spans count from.
#[must_use]
pub fn of(mut model: Loop, origin_s: f64) -> Loop {
    if origin_s == 0.0 {
        return model;
    }
    for term in &mut model.physics {
        term.onset_s = (term.onset_s - origin_s).max(0.0);
        if term.spans.is_empty() {
            continue;
        }
        let moved = term.spans.iter().map(|(from, to)| ((from - origin_s).max(0.0), to - origin_s));
        term.spans = moved.filter(|(from, to)| to > from).collect();
        if term.spans.is_empty() {
            // The term needs a span; none of its own is left, so one that no run reaches.
            term.spans.push((f64::MAX / 2.0, f64::MAX));
        }
    }
    model
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::Term;

    #[test]
    fn onsets_and_spans_move_to_the_parts_own_time() {
        let load = Term::new("load_step", &[("level", 1.0)]).unwrap().from_s(12.0);
        let signal = Term::new("injected_signal", &[("level", 1.0)]).unwrap();
        let signal = signal.within(&[(1.0, 2.0), (9.0, 11.0), (15.0, 16.0)]);
        let part = of(Loop::paper().with(load).with(signal), 10.0);
        assert_eq!(part.physics[0].onset_s, 2.0);
        assert_eq!(part.physics[1].spans, [(0.0, 1.0), (5.0, 6.0)]);
        part.check().unwrap();
    }
}
