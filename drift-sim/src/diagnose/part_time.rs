//! A part of a recording begins later than its whole: what began or acted at some time of the whole is moved to the
//! time of the part. What grows has grown by then, and a wave has gone on.

use crate::control_loop::Loop;
use crate::physics::{Over, Starts, Term};

/// The loop in the time of a part that begins `origin_s` after what its onsets and spans count from.
#[must_use]
pub fn of(mut model: Loop, origin_s: f64) -> Loop {
    if origin_s == 0.0 {
        return model;
    }
    for term in &mut model.physics {
        // Below 0 it has begun before the part.
        term.onset_s -= origin_s;
        wave_goes_on(term, origin_s);
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

/// The phase of a wave over time after so long.
fn wave_goes_on(term: &mut Term, origin_s: f64) {
    if !matches!(term.kind.search, Starts::Wave(Over::Time)) {
        return;
    }
    if let [_, frequency_hz, phase] = term.parameters.as_mut_slice() {
        *phase += std::f64::consts::TAU * *frequency_hz * origin_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::Simulation;

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

    /// Loads that depend on time: over the end of a run the part's load is that of the whole.
    #[test]
    fn over_the_end_a_part_does_what_the_whole_does() {
        let terms = [
            Term::new("load_ramp", &[("rate_per_s", 0.3)]).unwrap().from_s(2.0),
            Term::new("periodic_load", &[("amplitude", 1.0), ("frequency_hz", 0.7), ("phase", 0.4)]).unwrap(),
            Term::new("load_step", &[("level", 1.0)]).unwrap().from_s(1.0),
        ];
        let (samples, before, late) = (9_000, 5_500, 5.5);
        for term in terms {
            let whole = Loop::paper().with(term);
            let u = vec![0.0; samples];
            let loads = |model: &Loop, samples: usize| {
                let mut simulation = Simulation::new(model, 0).unwrap();
                simulation.driven(&u[..samples], &[]).load
            };
            let (of_whole, of_part) =
                (loads(&whole, samples), loads(&of(whole.clone(), late), samples - before));
            for (a, b) in of_whole[before..].iter().zip(&of_part) {
                assert!((a - b).abs() < 1e-9, "{}: {a} {b}", whole.physics[0].kind.name);
            }
        }
    }

    /// A sensor that drifts has drifted by what it has until then.
    #[test]
    fn a_drift_goes_on() {
        let drift = Term::new("sensor_drift", &[("rate_per_s", 0.5)]).unwrap().from_s(4.0);
        let part = of(Loop::paper().with(drift), 10.0);
        let mut simulation = Simulation::new(&part, 0).unwrap();
        assert!((simulation.shown(0, 1.0) - (1.0 + 0.5 * 6.0)).abs() < 1e-9);
    }
}
