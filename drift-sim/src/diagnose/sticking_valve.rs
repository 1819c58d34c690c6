//! Where the fit of a sticking valve begins.
//!
//! When the stem slips is decided by u's own noise against the band: the prediction error has one deep minimum, a few parts
//! in a thousand wide, in a wide valley of chance minima (band less half the jump is about constant there, and a
//! backlash of twice that lies at its floor). No gradient finds it. But over the first few slips the minimum is as wide as a
//! coarse grid; so the search begins with a short part of the recording and doubles it, keeping at each stage the valves
//! that leave least of the error, with finer neighbours around each. Each valve is judged by what is left once the plant's own
//! numbers have been given their best linear step. From the stated plant: the refitted one has bent towards the hysteresis.
//! Once the plant behind the best valve is known, the last digits of the valve are searched in the same way around it.

use crate::cores::AcrossCores as _;

use crate::physics::Term;

use super::fit::{Effort, Fit};
use super::model::Target;
use super::screen;
use super::signals::Signals;
use super::whiten::Whitener;

/// Half the width of backlash, over band less half the jump: from, to, steps.
const VALLEY: (f64, f64, usize) = (0.75, 1.3, 40);
/// The jump as a part of the band: steps up to the largest.
const JUMPS: usize = 36;
const LARGEST_JUMP: f64 = 0.7;
/// Parts of the recording that the valves are judged on, one after the other, and valves kept then: a short part costs little and
/// tells little.
const STAGES: [(f64, usize); 6] =
    [(1.0 / 32.0, 480), (1.0 / 16.0, 360), (1.0 / 8.0, 240), (1.0 / 4.0, 120), (1.0 / 2.0, 60), (1.0, 24)];
/// Valves that the plant is fitted behind, and how many of them are followed.
const VALVES: usize = 12;
const FOLLOWED: usize = 4;

/// Distances at which the last digits are searched, parts of band and jump, and valves kept at each.
const LAST_DIGITS: [f64; 4] = [4e-4, 2e-4, 1e-4, 5e-5];
const KEPT_LAST: usize = 3;

/// A valve as it is searched: where it lies across the valley, and the jump as a part of the band.
#[derive(Debug, Clone, Copy)]
struct Point {
    across: f64,
    jump: f64,
}

impl Point {
    fn term(self, width: f64) -> Option<Term> {
        let band = 0.5 * width * self.across / (1.0 - 0.5 * self.jump);
        Term::new("stiction", &[("stick_band", band), ("slip_jump", self.jump * band)]).ok()
    }

    /// Itself and what lies around it at these distances.
    fn neighbours(self, across: f64, jump: f64) -> impl Iterator<Item = Self> {
        let around = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
        around.into_iter().map(move |(a, j)| Self {
            across: self.across * (1.0 + a * across),
            jump: (self.jump + j * jump).max(0.0),
        })
    }
}

/// The most likely sticking valve in a loop in which backlash of this width would be found.
pub fn fit(stated: &Fit, width: f64, signals: &Signals) -> Option<Fit> {
    let valves = descend(stated, width, signals);
    let behind = |valve: &Term| plant_behind(valve, stated, signals);
    let mut begun: Vec<Fit> = valves.par_iter().filter_map(behind).collect();
    begun.sort_by(|a, b| a.variance.total_cmp(&b.variance));
    begun.truncate(FOLLOWED);
    begun
        .into_par_iter()
        .map(|fit| fit.search(signals, Effort::FULL))
        .min_by(|a, b| a.variance.total_cmp(&b.variance))
        .map(|fit| last_digits(&fit, signals).filter(|closer| closer.variance < fit.variance).unwrap_or(fit))
}

/// The best valve around that of a fit, the plant refitted behind it.
fn last_digits(fit: &Fit, signals: &Signals) -> Option<Fit> {
    let (point, _) = fit.model.loop_at(&fit.model.x)?;
    let (valve, index) = (point.physics.last()?, point.physics.len() - 1);
    let plant = Fit::start(&fit.model.without_term(index), signals, &Whitener::none())?;
    let mut kept = vec![valve.clone()];
    for distance in LAST_DIGITS {
        let around: Vec<Term> = kept.iter().flat_map(|valve| neighbours(valve, distance)).collect();
        let left = screen::left_by(&around, &plant, signals);
        let mut judged: Vec<(f64, Term)> = left.into_iter().zip(around).collect();
        judged.sort_by(|a, b| a.0.total_cmp(&b.0));
        kept = judged.into_iter().take(KEPT_LAST).map(|(_, valve)| valve).collect();
    }
    kept.par_iter()
        .filter_map(|valve| Some(plant_behind(valve, &plant, signals)?.search(signals, Effort::FULL)))
        .min_by(|a, b| a.variance.total_cmp(&b.variance))
}

/// Itself and the valves around it at this distance, in band, in jump, and along the valley between.
fn neighbours(valve: &Term, distance: f64) -> Vec<Term> {
    let (Some(band), Some(jump)) = (valve.value("stick_band"), valve.value("slip_jump")) else {
        return Vec::new();
    };
    let around = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (0.5, 1.0), (-0.5, -1.0)];
    let at = |(b, j): (f64, f64)| {
        let (band, jump) = (band * (1.0 + b * distance), (jump + j * distance * band).max(0.0));
        Term::new("stiction", &[("stick_band", band), ("slip_jump", jump)]).ok()
    };
    around.into_iter().filter_map(at).collect()
}

/// From the coarse grid on a short part to single valves on the whole.
fn descend(stated: &Fit, width: f64, signals: &Signals) -> Vec<Term> {
    let (from, to, steps) = VALLEY;
    let mut apart = (libm::log(to / from) / (steps - 1) as f64, LARGEST_JUMP / JUMPS as f64);
    let across = |i: usize| from * libm::exp(apart.0 * i as f64);
    let jump = |i: usize| apart.1 * (i as f64 + 0.5);
    let mut points: Vec<Point> = (0..JUMPS)
        .flat_map(|j| (0..steps).map(move |i| (i, j)))
        .map(|(i, j)| Point { across: across(i), jump: jump(j) })
        .collect();
    let mut kept: Vec<Point> = Vec::new();
    for (part, most) in STAGES {
        let prefix = signals.part(0, (part * signals.len() as f64) as usize);
        let (found, terms): (Vec<Point>, Vec<Term>) =
            points.iter().filter_map(|p| Some((*p, p.term(width)?))).unzip();
        let mut judged: Vec<(f64, Point)> =
            screen::left_by(&terms, stated, &prefix).into_iter().zip(found).collect();
        judged.sort_by(|a, b| a.0.total_cmp(&b.0));
        judged.truncate(most);
        kept = judged.into_iter().map(|(_, point)| point).collect();
        apart = (0.5 * apart.0, 0.5 * apart.1);
        points = kept.iter().flat_map(|point| point.neighbours(apart.0, apart.1)).collect();
    }
    kept.into_iter().take(VALVES).filter_map(|point| point.term(width)).collect()
}

/// A short search with the valve as it is; then everything is free again.
fn plant_behind(valve: &Term, stated: &Fit, signals: &Signals) -> Option<Fit> {
    let index = stated.model.nominal.physics.len();
    let free = stated.model.with_term(valve, false, signals.duration_s()).coarse();
    let held = (0..valve.parameters.len())
        .fold(free.clone(), |model, parameter| model.held(Target::Term { term: index, parameter }));
    let behind = Fit::start(&held, signals, &Whitener::none())?.search(signals, Effort::LOOK);
    let x: Vec<f64> = behind.model.x.iter().chain(&valve.parameters).copied().collect();
    Fit::start(&free.at(&x), signals, &Whitener::none())
}
