//! A sticking valve: the stem stays until `|u - stem| > stick_band`, then goes to
//! `u - sign(u - stem)*(stick_band - slip_jump)`. With `slides = 0` it sticks again there, as packing does whose friction holds whatever rests (He, Wang, Pottmann, Qin,
//! *Control Engineering Practice* 15 (2007) 1333); with `slides = 1` it goes on with u, so far behind it, until u turns and is a band away on the other side (as Choudhury, Thornhill, Shah,
//! *Control Engineering Practice* 13 (2005) 641, have it, but that a u which trembles does not stop it). A recording that begins in the middle of a loop's life does not show where the stem was:
//! `stem_at_start`.

use super::{
    Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Scales, Start, Starts, Term, any_values,
    every_plant, grid, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "stiction",
    place: Place::Actuator,
    begins: Begins::Start,
    parameters: &[
        Parameter::new("stick_band", "{u}", Range::NotNegative, |s, _| s.u).rough(),
        Parameter::new("slip_jump", "{u}", Range::NotNegative, |s, _| s.u).rough(),
        Parameter::new("stem_at_start", "{u}", Range::Any, |s, _| s.u).rough().or(0.0).state_up_to(|p| p[0]),
        Parameter::new("slides", "1", Range::Between(0.0, 1.0), |_, _| 1.0).rough().or(STICKS).not_fitted(),
    ],
    applies: every_plant,
    consistent: any_values,
    effect: |p, _| Box::new(Stiction::new(p)),
    search: Starts::Peak { coarse, dense, every_jump, fine, finest, in_step, forms, like },
    family: Some(Family::Play),
    excitation: "Slow changes of u, also in one direction.",
    ties: &["backlash"],
    experiment: "Ramp the reference slowly one way: a sticking valve moves in jumps, backlash does not.",
    says: |p, units| {
        let then = if p[3] == SLIDES { " and goes on with u until u turns" } else { "" };
        format!(
            "The valve sticks until u is {} away from it, then jumps by {}{then}.",
            shown(p[0], &units.u),
            shown(p[1], &units.u)
        )
    },
};

/// The two forms that a search tries.
const STICKS: f64 = 0.0;
const SLIDES: f64 = 1.0;

/// Parts of u's range that the bands are, in equal ratios.
fn bands(count: i32, least: f64, ratio: f64) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| least * libm::pow(ratio, f64::from(i) / f64::from(count - 1)))
}

fn coarse(s: &Scales) -> Vec<Start> {
    let with = |form: f64, jumps: [f64; 2]| {
        let bands = bands(20, 0.003, 300.0);
        let points = bands.flat_map(move |band| jumps.map(|jump| (band, jump)));
        grid(points, |(band, jump)| vec![band * s.u_range, jump * band * s.u_range, 0.0, form])
    };
    [with(STICKS, [0.12, 0.45]), with(SLIDES, [0.3, 0.8])].concat()
}

/// In a loop that cycles by it the band may be all that u moves over, and the stem may jump as far; a slip comes late or soon by a sample where the band
/// is off by the part that a sample is of the time between two slips. What slides slips where u turns alone, so that its peak is wider.
fn dense(s: &Scales) -> Vec<Vec<f64>> {
    let with = |form: f64, count: i32, jumps: &[f64]| {
        let points = bands(count, 0.004, 300.0).flat_map(|band| jumps.iter().map(move |jump| (band, *jump)));
        let points = points.flat_map(|(band, jump)| {
            [0.0, 0.6, -0.6].map(|stem| [1.0, jump, stem].map(|x| x * band * s.u_range))
        });
        points.map(|[band, jump, stem]| vec![band, jump, stem, form]).collect::<Vec<_>>()
    };
    [with(STICKS, 240, &[0.05, 0.12, 0.3, 0.45, 0.7, 1.0]), with(SLIDES, 120, &[0.1, 0.35, 0.65, 1.0])]
        .concat()
}

/// Parts of the fit's lag, and jumps as parts of the band, on which the fine points lie; and the ratio of one to the next. Beside its peak a fit takes a lag that is too
/// small and nearly no jump.
const LAGS: [f64; 3] = [0.9, 1.25, 1.002];
const JUMPS: [f64; 3] = [0.06, 1.05, 1.03];
/// The same of the finest points, whose jumps are as far apart as the last number says. Under a noisy u the peak is 0.2 % of the band wide along the jump, by which a slip
/// is on from the one before the same way, and 0.4 to 0.8 % along the lag (eight loops of `.ci/wide`).
const FINEST_LAGS: [f64; 3] = [0.9, 1.25, 1.007];
const FINEST_JUMPS: [f64; 3] = [0.04, 1.05, 0.002];

/// The same of the points of every jump, and parts of the jump by which the stem may be off: slips lead from one to the next, so that a stem that began elsewhere in its jump goes on beside the
/// true one. In the 1 000 samples of two flow loops the peak was 1 to 2 % of the band wide (`tests/cases/run 9324`).
const EVERY_LAG: [f64; 3] = [0.9, 1.25, 1.012];
const EVERY_JUMP: [f64; 3] = [0.05, 1.05, 1.04];
const STEMS: i32 = 8;

/// Half of the way that u goes for nothing where it turns, in either form; of a valve that sticks again by how much the stem is behind u on the mean. A fit beside the peak has it right before anything
/// else.
pub(super) fn lag(band: f64, jump: f64) -> f64 {
    band - 0.5 * jump
}

/// Band, jump, stem at the start, and form.
fn numbers(parameters: &[f64]) -> [f64; 4] {
    [0, 1, 2, 3].map(|i| parameters.get(i).copied().unwrap_or(0.0))
}

fn every_jump(about: &[f64]) -> Vec<Vec<f64>> {
    // What slides does not slip on the way.
    if numbers(about)[3] == SLIDES {
        return Vec::new();
    }
    let points = points(about, &in_ratio(EVERY_LAG), &in_ratio(EVERY_JUMP)).into_iter();
    let stems = |point: Vec<f64>| {
        let [band, jump, _, form] = numbers(&point);
        (0..STEMS).map(move |i| vec![band, jump, band - jump * f64::from(i) / f64::from(STEMS), form])
    };
    points.flat_map(stems).collect()
}

fn fine(fit: &[f64]) -> Vec<Vec<f64>> {
    points(fit, &in_ratio(LAGS), &in_ratio(JUMPS))
}

/// Half jumps by which a band may be off while the stem slips at the same times, and the parts of the jump about each, as far apart as the last number says.
const HALF_JUMPS: i32 = 6;
const ABOUT: [f64; 3] = [-0.032, 0.032, 0.004];

/// Valves that slip in step with this one: while u goes one way the stem is on by a jump from slip to slip, whatever the band; only from one way to the other it stays for twice the band
/// less the jump, and slips at the same times again where that differs by whole jumps. Loads that jump where u turns make up for it: the band was one jump short in one loop, and half a
/// jump beside backlash in another (`tests/cases/run 9322 9323`).
fn in_step(top: &[f64]) -> Vec<Vec<f64>> {
    let [band, jump, stem, form] = numbers(top);
    if form == SLIDES {
        return Vec::new();
    }
    let [from, to, step] = ABOUT;
    let count = libm::round((to - from) / step) as i32;
    let others = (-HALF_JUMPS..=HALF_JUMPS).filter(|halves| *halves != 0);
    let off = others
        .flat_map(|halves| (0..=count).map(move |i| 0.5 * f64::from(halves) + from + step * f64::from(i)));
    // Nothing jumps by more than twice its band.
    off.map(|off| band + off * jump)
        .filter(|band| *band > 0.5 * jump)
        .map(|band| vec![band, jump, stem, form])
        .collect()
}

fn finest(fit: &[f64]) -> Vec<Vec<f64>> {
    let [from, to, step] = FINEST_JUMPS;
    let jumps: Vec<f64> = (0..).map(|i| from + step * f64::from(i)).take_while(|jump| *jump <= to).collect();
    points(fit, &in_ratio(FINEST_LAGS), &jumps)
}

fn in_ratio([from, to, ratio]: [f64; 3]) -> Vec<f64> {
    std::iter::successors(Some(from), |x| Some(x * ratio)).take_while(|x| *x <= to).collect()
}

/// A point at each of these parts of a fit's lag with each of these jumps, as parts of the band.
fn points(fit: &[f64], lags: &[f64], jumps: &[f64]) -> Vec<Vec<f64>> {
    let [band, jump, stem, form] = numbers(fit);
    let point = |part: f64, of_band: f64| {
        let band = part * lag(band, jump) / lag(1.0, of_band);
        vec![band, of_band * band, stem, form]
    };
    lags.iter().flat_map(|part| jumps.iter().map(move |of_band| point(*part, *of_band))).collect()
}

/// The other form, in which u goes as far for nothing where it turns.
fn forms(fit: &[f64]) -> Vec<Vec<f64>> {
    let [band, jump, stem, form] = numbers(fit);
    vec![vec![band, jump, stem, if form == SLIDES { STICKS } else { SLIDES }]]
}

/// A valve that hardly jumps is backlash.
fn like(term: &Term) -> Option<Vec<f64>> {
    let width = term.parameters.first().filter(|_| term.kind.name == "backlash")?;
    Some(vec![0.5 * width, 0.5 * HARDLY * width, 0.0, STICKS])
}

/// Part of the band.
const HARDLY: f64 = 0.05;

#[derive(Clone)]
struct Stiction {
    stick_band: f64,
    /// How far u must be away for the stem to go on the way that it went last.
    go_on_band: f64,
    /// How far the stem stays behind u when it slips.
    rest: f64,
    at_start: f64,
    stem: Option<f64>,
    /// 1 where it has last gone up, -1 down, 0 before it has moved.
    way: f64,
}

/// Where the stem is under each u; it begins at the first of them, and sticks again after each slip.
pub fn stem(u: &[f64], stick_band: f64, slip_jump: f64) -> Vec<f64> {
    let mut valve = Stiction::new(&[stick_band, slip_jump, 0.0, STICKS]);
    u.iter().map(|u| valve.actuator(0.0, *u)).collect()
}

impl Stiction {
    fn new(parameters: &[f64]) -> Self {
        let [stick_band, jump, at_start, slides] = numbers(parameters);
        let (go_on_band, rest) = (stick_band - slides * jump, stick_band - jump);
        Self { stick_band, go_on_band, rest, at_start, stem: None, way: 0.0 }
    }
}

impl Effect for Stiction {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Actuator]
    }

    fn actuator(&mut self, _: f64, u: f64) -> f64 {
        let stem = *self.stem.get_or_insert(u + self.at_start);
        let off = u - stem;
        let band = if off * self.way > 0.0 { self.go_on_band } else { self.stick_band };
        if off.abs() > band {
            self.way = libm::copysign(1.0, off);
            return *self.stem.insert(u - libm::copysign(self.rest, off));
        }
        stem
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// u rises by ones from 0: a stem that lay 2 above stays until u is 3 above it, at 5, then goes to within 1 of u.
    #[test]
    fn a_stem_that_lay_elsewhere_stays_there_until_the_first_slip() {
        let mut valve = Stiction::new(&[2.5, 1.5, 2.0, STICKS]);
        let stems: Vec<f64> = (0..7).map(|u| valve.actuator(0.0, f64::from(u))).collect();
        assert_eq!(stems, [2.0, 2.0, 2.0, 2.0, 2.0, 4.0, 4.0]);
    }

    /// u rises by ones from 0 to 5 and falls again: a stem with a band of 2.5 and a jump of 1.5 slips at 3 and goes on 1 behind u; u is a band away on the other side at 1.
    #[test]
    fn a_stem_that_slides_follows_u_until_it_turns() {
        let mut valve = Stiction::new(&[2.5, 1.5, 0.0, SLIDES]);
        let u = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.0];
        let stems: Vec<f64> = u.map(|u| valve.actuator(0.0, u)).to_vec();
        assert_eq!(stems, [0.0, 0.0, 0.0, 2.0, 3.0, 4.0, 4.0, 4.0, 4.0, 2.0, 1.0]);
    }

    /// u rises to 10 and falls again: a stem that slides, with a band of 2.5 and a jump of 1.5, stays until u has come back by twice the lag of 1.75.
    #[test]
    fn a_stem_that_slides_loses_twice_its_lag_where_u_turns() {
        let mut valve = Stiction::new(&[2.5, 1.5, 0.0, SLIDES]);
        let up: Vec<f64> = (0..=1_000).map(|i| valve.actuator(0.0, 0.01 * f64::from(i))).collect();
        let mut back = (1..1_000).map(|i| 0.01 * f64::from(i));
        let lost = back.find(|back| valve.actuator(0.0, 10.0 - back) < up[1_000]).unwrap();
        assert!((lost - 2.0 * lag(2.5, 1.5)).abs() < 0.015, "{lost}");
    }

    /// A band of 3.2 and a jump of 1.7: among the valves in step with it are those of 4.05 and 4.9, and none that jumps out of its band.
    #[test]
    fn bands_that_differ_by_half_jumps_are_in_step() {
        let others = in_step(&[3.2, 1.7, 0.3, STICKS]);
        let has = |band: f64| {
            others.iter().any(|other| (other[0] - band).abs() < 1e-9 && other[1..] == [1.7, 0.3, STICKS])
        };
        assert!(has(4.05) && has(4.9) && has(1.5) && !has(3.2));
        assert!(others.iter().all(|other| other[0] > 0.85));
    }

    /// Whatever a valve jumps by, one of the finest points about a fit that lags a tenth less and hardly jumps is near enough for a climb of reach 0.4 %: within 0.2 % of the
    /// band in the jump, 0.4 % in the lag.
    #[test]
    fn one_of_the_finest_points_is_near_every_peak() {
        for jump in [0.1, 0.234, 0.37, 0.66, 0.95] {
            let (fit_jump, of_lag) = (0.05, 1.0 / 1.1);
            let fit = [of_lag * lag(1.0, jump) + 0.5 * fit_jump, fit_jump, 0.0, STICKS];
            let is_within = |point: &Vec<f64>| {
                let off = lag(point[0], point[1]) / lag(1.0, jump) - 1.0;
                off.abs() < 0.004 && (point[1] - jump).abs() < 0.002
            };
            assert!(finest(&fit).iter().any(is_within), "{jump}");
        }
    }
}
