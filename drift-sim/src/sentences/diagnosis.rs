//! What a diagnosis says.

use super::quantity::{fit, measured, number_name, percent, plain, rate, rounded, value, with_unit};
use super::{Answer, Clock, KeyNumber, Status};
use crate::control_loop::Loop;
use crate::diagnose::prove::FitPct;
use crate::diagnose::{Diagnosis, Fits, Named, Rejected, Verdict};
use crate::likelihood_search::offset;
use crate::likelihood_search::options::Options;
use crate::physics::{Place, Term, UnitNames};
use crate::plant::Plant;

/// Rivals that a sentence names.
const NAMED: usize = 3;

/// A fit that noise alone keeps below this, in per cent, says nothing of the model: the loop rests there.
const FOLLOWS_PCT: f64 = 5.0;

/// The answer; `start_s` is the time of the sample that onsets count from.
pub fn diagnosis(found: &Diagnosis, clock: &Clock, start_s: f64) -> Answer {
    let telling = Telling { found, clock, start_s, units: found.nominal.unit_names() };
    let (status, sentence, also) = telling.words();
    let also = [Some(also).filter(|also| !also.is_empty()), telling.load_jumps(), telling.load_waves()];
    let also = also.into_iter().flatten().collect::<Vec<_>>().join(" ");
    Answer { status, sentence, also, numbers: telling.numbers(status) }
}

/// A term in a sentence, its numbers with the digits that their intervals carry. Of friction by direction the plant's own is part:
/// what a person would measure.
pub fn says(named: &Named, found: &Diagnosis) -> String {
    let units = found.nominal.unit_names();
    let widths = |i: usize| named.half_widths.get(i).copied().unwrap_or(f64::NAN);
    let number = |i: usize| named.term.parameters.get(i).copied().unwrap_or(f64::NAN);
    let slow = |i: usize, unit: &str| {
        let (factor, unit) = rate(number(i), unit);
        with_unit(value(number(i).abs() * factor, widths(i) * factor), &unit)
    };
    match named.term.kind.name {
        "directional_friction" => by_direction(named, found, &units),
        "sensor_drift" => {
            let way = if number(0) < 0.0 { "downwards" } else { "upwards" };
            format!("The sensor drifts {way} by {}.", slow(0, &units.unit("{y}/s")))
        }
        "load_ramp" => {
            let way = if number(0) < 0.0 { "shrinks" } else { "grows" };
            format!("A load {way} by {}.", slow(0, &units.unit("{drive}/s")))
        }
        // A limit that is as uncertain as both are apart was never reached.
        "saturation" if widths(0) > number(1) - number(0) => {
            let upper = with_unit(value(number(1), widths(1)), &units.u);
            format!("What reaches the plant is limited to {upper} at most.")
        }
        "saturation" if widths(1) > number(1) - number(0) => {
            let lower = with_unit(value(number(0), widths(0)), &units.u);
            format!("What reaches the plant is limited to {lower} at least.")
        }
        // A jump that may be nothing by its interval is none.
        "stiction" if number(1).abs() <= widths(1) => {
            let band = with_unit(value(number(0), widths(0)), &units.u);
            format!("The valve sticks until u is {band} away from it, and then follows.")
        }
        "load_step" if number(0) < 0.0 => {
            let size = with_unit(value(-number(0), widths(0)), &units.drive);
            format!("A load of {size} adds to the drive; {}.", instead_of_load(named, found))
        }
        "load_step" => {
            let size = with_unit(value(number(0), widths(0)), &units.drive);
            format!("A load of {size} takes from the drive; {}.", instead_of_load(named, found))
        }
        "sensor_bias" if number(0) < 0.0 => {
            format!("The sensor reads {} too little.", with_unit(value(-number(0), widths(0)), &units.y))
        }
        _ => {
            let numbers: Vec<f64> =
                (0..named.term.parameters.len()).map(|i| rounded(number(i), widths(i))).collect();
            typographic((named.term.kind.says)(&numbers, &units))
        }
    }
}

/// What the model has of a load: nothing, or a stated offset that would be another without it.
fn instead_of_load(named: &Named, found: &Diagnosis) -> String {
    let is_another = |term: &&Term| **term != named.term;
    let physics = found.improved.physics.iter().filter(is_another).cloned().collect();
    let without = Loop { physics, ..found.improved.clone() };
    let level = named.term.parameters.first().copied().unwrap_or(0.0);
    let is_standing = named.term.onset_s == 0.0 && named.term.spans.is_empty();
    let stated = offset::of(&without.plant).filter(|_| is_standing);
    match stated.zip(offset::under(&without, level)) {
        Some((stated, offset)) => {
            let width = named.half_widths.first().copied().unwrap_or(f64::NAN);
            format!("or the plant's offset is {}, not {}", value(offset, width), plain(stated, 4))
        }
        None => "the model has none".into(),
    }
}

/// What a term says whose numbers have no interval.
pub fn of_term(term: &Term, units: &UnitNames) -> String {
    match term.parameters.as_slice() {
        [level] if term.kind.name == "load_step" && *level < 0.0 => {
            format!("A load of {} adds to the drive.", with_unit(plain(-level, 4), &units.drive))
        }
        _ => typographic(term.says(units)),
    }
}

/// The sizes of a term's numbers in words.
pub fn sizes(term: &Term, units: &UnitNames) -> String {
    let parameters = term.kind.parameters.iter().zip(&term.parameters);
    let words = parameters.map(|(p, value)| {
        let size = parameter(rounded(*value, 0.05 * value.abs()), f64::NAN, &units.unit(p.unit));
        format!("{} {size}", number_name(p.name))
    });
    words.collect::<Vec<_>>().join(", ")
}

/// Units and powers of ten that a kind's own sentence has as a file writes them.
fn typographic(text: String) -> String {
    let word = |word: &str| -> String {
        let bare = word.trim_end_matches(['.', ',', ';']);
        let tail = word.get(bare.len()..).unwrap_or_default();
        match bare.parse::<f64>() {
            Ok(number) if bare.contains('e') => plain(number, 4) + tail,
            _ => super::simple_unit(bare) + tail,
        }
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// Viscous friction forward and back as it is in all, and dry friction where there is any.
fn by_direction(named: &Named, found: &Diagnosis, units: &UnitNames) -> String {
    let own = |plant: &Plant| if let Plant::Servo(servo) = plant { servo.viscous } else { f64::NAN };
    let of = |i: usize| {
        let number = named.term.parameters.get(i).copied().unwrap_or(f64::NAN);
        (number, named.half_widths.get(i).copied().unwrap_or(f64::NAN))
    };
    let rule = units.unit("{drive}/{speed}");
    let (improved, nominal) = (own(&found.improved.plant), own(&found.nominal.plant));
    // What the plant's own number may take up of it is told by their sum alone.
    let total = |i: usize| {
        let (number, width) = of(i);
        let sum = improved + number;
        if width < sum.abs() { value(sum, width) } else { plain(sum, 3) }
    };
    let mut text = format!(
        "Viscous friction differs by direction: {} forward, {} back; the model has {}.",
        with_unit(total(2), &rule),
        total(3),
        plain(nominal, 3)
    );
    let dry = [0, 1].map(of);
    let is_told = |(number, width): &(f64, f64)| number.abs() > if width.is_finite() { *width } else { 0.0 };
    // A load that stays adds to one and takes from the other as much.
    let mean = 0.5 * (dry[0].0 + dry[1].0);
    if dry.iter().any(is_told) {
        let [forward, back] = dry.map(|(number, width)| value(number, width));
        text +=
            &format!(" Dry friction beside it: {} forward, {back} back.", with_unit(forward, &units.drive));
    } else if dry.iter().all(|(_, width)| width.is_finite() && *width > mean) && mean > 0.0 {
        let mean = with_unit(plain(mean, 2), &units.drive);
        text += &format!(" Dry friction beside it: {mean} on average; a load may be part of how it differs.");
    }
    text
}

/// A parameter of a term: `20.8 ± 0.4 N`; a slow rate is one an hour or a day.
pub fn parameter(number: f64, half_width: f64, unit: &str) -> String {
    let (factor, unit) = rate(number, unit);
    measured(number * factor, half_width * factor, &unit)
}

struct Telling<'a> {
    found: &'a Diagnosis,
    clock: &'a Clock,
    start_s: f64,
    units: UnitNames,
}

impl Telling<'_> {
    fn words(&self) -> (Status, String, String) {
        let found = self.found;
        match found.verdict {
            Verdict::NoMismatch | Verdict::Parameters if found.far_off => (
                Status::CantTell,
                "This recording can't tell: the plant that could be identified from it does not follow y where it has not seen it.".into(),
                "A recording with changes of the set-point, or a loop file that states the plant, would tell more.".into(),
            ),
            Verdict::Undecided if !self.leading().is_empty() => (
                Status::CantTell,
                "This recording can't tell: what explains it best is not proved.".into(),
                format!("Likeliest: {}. Changes of the set-point would tell more.", listed(&self.leading())),
            ),
            Verdict::Undecided => (
                Status::CantTell,
                "This recording can't tell: too little moves in it, or too much is unknown.".into(),
                "Nothing is proved and nothing is excluded. Changes of the set-point would tell more.".into(),
            ),
            Verdict::NoMismatch => (
                Status::Healthy,
                "Nothing is missing: the model explains this recording.".into(),
                self.would_have_shown(),
            ),
            Verdict::Parameters => (Status::CauseFound, self.other_numbers(), self.gain()),
            Verdict::Located => {
                let place = found.place.map_or("loop", Place::name);
                (
                    Status::Suspect,
                    format!("Something is missing at the {place}, and this recording can't tell what."),
                    self.candidates(),
                )
            }
            Verdict::MissingPhysics => {
                let mut told: Vec<&Named> = found.physics.iter().filter(|n| !n.may_be_nothing()).collect();
                if told.is_empty() {
                    told.extend(found.physics.first());
                }
                let mut sentences = told.iter().map(|named| self.term(named));
                let first = sentences.next().unwrap_or_default();
                let tied = told.first().filter(|named| !named.tied.is_empty());
                let tied = tied.map(|first| format!("It can't be told from {} here.", listed(&first.tied)));
                let mut also: Vec<String> = tied.into_iter().chain(sentences).collect();
                if found.far_off {
                    also.push("More is missing: the loop stays far from what was measured.".into());
                }
                (Status::CauseFound, first, also.join(" "))
            }
        }
    }

    /// How often the load jumps, and how far.
    fn load_jumps(&self) -> Option<String> {
        let jumps = self.found.load_jumps.as_ref()?;
        let size = with_unit(plain(jumps.size, 2), &self.units.drive);
        let times = match jumps.at_s.len() {
            1 => "once".into(),
            times => format!("{times} times"),
        };
        Some(format!("The load jumps {times}, by about {size}; this counts as noise."))
    }

    /// What swings beside the loop.
    fn load_waves(&self) -> Option<String> {
        let waves = self.found.load_waves.as_ref()?;
        let at: Vec<String> = waves.frequencies_hz.iter().map(|hz| plain(*hz, 2)).collect();
        let at = with_unit(at.join(" and "), "Hz");
        Some(format!("Something swings at {at} beside the loop; this counts as noise."))
    }

    /// A term in a sentence, with when it began.
    fn term(&self, named: &Named) -> String {
        let says = says(named, self.found);
        let spans = &named.term.spans;
        let when = if named.term.onset_s > 0.0 {
            format!(" since {}.", self.clock.says(self.start_s + named.term.onset_s))
        } else if let (1, Some((from, to))) = (spans.len(), spans.first()) {
            format!(", {}.", self.clock.span(self.start_s + from, self.start_s + to))
        } else if !spans.is_empty() {
            format!(", {} times.", spans.len())
        } else {
            return says;
        };
        // The moment belongs to the first clause: "; the model has none" follows it.
        match says.split_once("; ") {
            Some((clause, rest)) => format!("{clause}{}; {rest}", when.trim_end_matches('.')),
            None => says.trim_end_matches('.').trim_end_matches(" at times").to_owned() + &when,
        }
    }

    fn other_numbers(&self) -> String {
        let mut moved: Vec<_> = self
            .found
            .parameters
            .iter()
            .filter(|p| (p.value - p.nominal).abs() > p.half_width)
            .map(|p| (libm::fabs(p.value / p.nominal - 1.0), p))
            .collect();
        moved.sort_by(|a, b| b.0.total_cmp(&a.0));
        let told: Vec<String> = moved
            .iter()
            .take(2)
            .map(|(_, p)| {
                let name = p.name.rsplit('.').next().unwrap_or(&p.name).replace('_', " ");
                format!("{name} is {}, not {}", value(p.value, p.half_width), plain(p.nominal, 4))
            })
            .collect();
        match told.is_empty() {
            true => "The model is right, its numbers are not: refitted, it explains the recording.".into(),
            false => format!("The model is right, its numbers are not: its {}.", told.join(", its ")),
        }
    }

    /// What the fit of u gains, where that is more than nothing.
    fn gain(&self) -> String {
        let (on, fits) = self.fits();
        let (a, b) = (if self.refits() { fits.nominal } else { fits.before }, fits.after);
        let of = FitPct::that_counts;
        let (Some(a), Some(b)) = (a.map(of), b.map(of)) else { return String::new() };
        let name = if self.known_law() { "u" } else { "y" };
        match fit(a) == fit(b) {
            true => String::new(),
            false => format!("The simulated {name} fits {on} to {} % instead of {} %.", fit(b), fit(a)),
        }
    }

    fn refits(&self) -> bool {
        self.found.verdict == Verdict::Parameters
    }

    fn known_law(&self) -> bool {
        let fits = self.fits().1;
        fits.after.or(fits.nominal).is_some_and(|fit| fit.u_pct.is_some())
    }

    /// On what the loop was proved, and how well it fits there.
    fn fits(&self) -> (&'static str, Fits) {
        match self.found.holdout.after.or(self.found.holdout.nominal) {
            Some(_) => ("unseen data", self.found.holdout),
            None => ("the recording", self.found.train),
        }
    }

    fn candidates(&self) -> String {
        let names: Vec<&str> = self.found.candidates.iter().map(|(kind, _)| *kind).collect();
        match names.as_slice() {
            [] => String::new(),
            names => format!("What is left: {}.", listed(names)),
        }
    }

    /// What is not proved and gains enough to be told: what something must that is named beside a guessed plant.
    fn leading(&self) -> Vec<&'static str> {
        let least = Options::default().guessed_gain;
        self.found.candidates.iter().filter(|(_, gain)| *gain > least).map(|(kind, _)| *kind).collect()
    }

    /// The smallest effects that this recording would have shown.
    fn would_have_shown(&self) -> String {
        let sizes: Vec<String> =
            self.smallest().into_iter().map(|(kind, size)| format!("{kind} of {size}")).collect();
        match sizes.is_empty() {
            true => String::new(),
            false => format!("It would have shown {}.", joined(&sizes)),
        }
    }

    /// Of the kinds that are easiest to imagine, what would have shown.
    fn smallest(&self) -> Vec<(&'static str, String)> {
        const IMAGINED: [(&str, &str); 4] = [
            ("coulomb_friction", "dry friction"),
            ("gain_loss", "a loss of gain"),
            ("load_step", "a load"),
            ("sensor_bias", "a bias of the sensor"),
        ];
        let of = |(kind, words): (&str, &'static str)| {
            let rejected: &Rejected = self.found.rejected.iter().find(|r| r.kind == kind)?;
            let term = rejected.smallest.as_ref()?;
            let (number, parameter) = (term.parameters.first()?, term.kind.parameters.first()?);
            let size = match kind {
                "gain_loss" => percent(100.0 * number.abs()),
                _ => with_unit(plain(number.abs(), 2), &self.units.unit(parameter.unit)),
            };
            Some((words, size))
        };
        IMAGINED.into_iter().filter_map(of).take(2).collect()
    }

    fn numbers(&self, status: Status) -> Vec<KeyNumber> {
        let mut numbers = Vec::new();
        numbers.extend(self.proof_number().or_else(|| self.fit_number()));
        numbers.extend(match status {
            Status::CauseFound => self.size_number(),
            _ => None,
        });
        numbers.push(self.rivals_number(status));
        if numbers.len() < 3 {
            numbers.extend(self.smallest().into_iter().next().filter(|_| status == Status::Healthy).map(
                |(kind, size)| KeyNumber::new(size, format!("the smallest that would have shown as {kind}")),
            ));
        }
        numbers
    }

    /// How sure the first named term is, where a simulation does not show it: noise leads the loop elsewhere whatever it is.
    fn proof_number(&self) -> Option<KeyNumber> {
        let sure = self.found.physics.first().map(|named| named.holdout_errors)?;
        let (_, fits) = self.fits();
        let of = |fit: Option<FitPct>| fit.map(FitPct::that_counts);
        let is_worse = of(fits.before).zip(of(fits.after)).is_some_and(|(before, after)| after <= before);
        let is_shown = !is_worse || !sure.is_finite();
        let label = "standard errors of what it gains on unseen data, sample by sample; chance stays below 2";
        (!is_shown).then(|| KeyNumber::new(plain(sure, 2), label))
    }

    fn fit_number(&self) -> Option<KeyNumber> {
        let (on, fits) = self.fits();
        let of = FitPct::that_counts;
        let before = if self.refits() { fits.nominal } else { fits.before.or(fits.nominal) };
        let (before, after) = (before.map(of), fits.after.map(of));
        let name = if self.known_law() { "u" } else { "y" };
        let noise = match self.found.noise_leaves().map(of) {
            Some(floor) if floor < FOLLOWS_PCT => "; nothing but noise moves it there".into(),
            _ if self.found.leaves_only_noise() => "; only noise is left".into(),
            Some(floor) => format!("; noise alone leaves {}", fit(floor)),
            None => String::new(),
        };
        let label = format!("fit of {name} on {on}{noise}");
        Some(match (before, after) {
            (Some(a), Some(b)) if fit(a) != fit(b) => {
                KeyNumber::new(format!("{} \u{2192} {} %", fit(a), fit(b)), label)
            }
            (_, Some(b)) => KeyNumber::new(format!("{} %", fit(b)), label),
            (Some(a), None) => KeyNumber::new(format!("{} %", fit(a)), label),
            (None, None) => return None,
        })
    }

    /// The first named number, or the first of the plant's that moved.
    fn size_number(&self) -> Option<KeyNumber> {
        if let Some(named) = self.found.physics.iter().find(|named| !named.may_be_nothing()) {
            // Of two limits the one that was reached.
            let mut numbers = named.term.parameters.iter().zip(&named.half_widths);
            let at = numbers.position(|(number, width)| *width < number.abs()).unwrap_or(0);
            let (about, number) = (named.term.kind.parameters.get(at)?, named.term.parameters.get(at)?);
            let width = named.half_widths.get(at).copied().unwrap_or(f64::NAN);
            let name = number_name(about.name);
            let kind = named.term.kind.name.replace('_', " ");
            let interval = if width.is_finite() { ", 95 % interval" } else { "" };
            return Some(KeyNumber::new(
                parameter(*number, width, &self.units.unit(about.unit)),
                if name == "level" {
                    format!("{kind}{interval}")
                } else {
                    format!("{kind}: {name}{interval}")
                },
            ));
        }
        let moved = self.found.parameters.iter().filter(|p| (p.value - p.nominal).abs() > p.half_width);
        let p = moved.max_by(|a, b| {
            let far = |p: &crate::diagnose::Refitted| libm::fabs(p.value / p.nominal - 1.0);
            far(a).total_cmp(&far(b))
        })?;
        let name = p.name.rsplit('.').next().unwrap_or(&p.name).replace('_', " ");
        Some(KeyNumber::new(
            measured(p.value, p.half_width, ""),
            format!("{name}, 95 % interval; the file says {}", plain(p.nominal, 4)),
        ))
    }

    fn rivals_number(&self, status: Status) -> KeyNumber {
        let found = self.found;
        let tried = found.rejected.len() + found.physics.len() + found.candidates.len();
        match status {
            Status::CauseFound if !found.physics.is_empty() => {
                let tied: Vec<&str> = found.physics.first().map_or(Vec::new(), |n| n.tied.clone());
                if tied.is_empty() {
                    KeyNumber::new("none", format!("other causes that fit as well, of {tried} tried"))
                } else {
                    KeyNumber::new(
                        tied.len().to_string(),
                        format!("other causes that fit as well: {}", listed(&tied)),
                    )
                }
            }
            Status::Suspect if !found.candidates.is_empty() => {
                KeyNumber::new(found.candidates.len().to_string(), format!("causes left, of {tried} tried"))
            }
            Status::CantTell if !self.leading().is_empty() => KeyNumber::new(
                self.leading().len().to_string(),
                format!("causes that explain more, none of them proved, of {tried} tried"),
            ),
            _ => KeyNumber::new(format!("0 of {tried}"), "causes tried that explain more"),
        }
    }
}

/// Names of kinds in words.
fn listed(kinds: &[&str]) -> String {
    let shown: Vec<String> = kinds.iter().take(NAMED).map(|kind| kind.replace('_', " ")).collect();
    match kinds.len().saturating_sub(NAMED) {
        0 => joined(&shown),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

fn joined(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}
