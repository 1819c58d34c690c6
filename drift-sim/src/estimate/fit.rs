//! The fit of a hypothesis: damped least squares (Levenberg-Marquardt) on the rows of the likelihood. Rough numbers (gaps, bands,
//! limits) and onsets are moved by searches of their own, with short fits of the others.

use std::sync::Arc;

use crate::cores::AcrossCores as _;
use nalgebra::{DMatrix, DVector};

use super::bounded::Bounded;
use super::hypothesis::{Hypothesis, Point, is_noise};
use super::inner_product::dot;
use super::lanes::LANES;
use super::likelihood::{Cache, Data, Rows, rows, rows_at};

/// A hypothesis at the best point found.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The hypothesis.
    pub hypothesis: Hypothesis,
    /// The point.
    pub point: Point,
    /// Its rows.
    pub rows: Rows,
}

/// A fit ends where a step gains less of the objective than this.
const LEAST_GAIN: f64 = 0.1;
/// What the damping takes for the curvature of a number that changes nothing.
const FLAT: f64 = 1e-9;
/// Further steps along the same columns: each costs one run, where the columns cost one for each number.
const MORE_STEPS: usize = 3;
/// Noise numbers move by at most this in one step: their logarithms are far from linear.
const NOISE_REACH: f64 = 1.0;
/// Damping at the start, and its bounds.
const DAMPING: f64 = 1e-3;
const LEAST_DAMPING: f64 = 1e-6;
/// Onsets that are tried all over the recording.
const SCANNED: usize = 40;
/// Factor by which the widths shrink that an onset is moved by, down to a sample.
const NARROWER: f64 = 3.0;
/// Fall of the objective from which a trial is better where the other numbers slide: a slide may gain this by chance.
pub const SLID_GAIN: f64 = 0.05;
/// Factor on the steps that show how rows change, once a fit is close.
const CLOSER: f64 = 0.1;
/// Part of a step at which its bend is looked at, and how large twice the correction may be as part of it (Transtrum & Sethna 2012).
const LOOK_AHEAD: f64 = 0.1;
const MOST_BENT: f64 = 0.75;
/// Steps that a damping is raised for before the fit gives up.
const TRIES: usize = 6;

impl Fit {
    /// The hypothesis at a point; `None` where it can't be simulated there.
    pub fn at(hypothesis: &Hypothesis, point: &Point, data: &Data) -> Option<Self> {
        let rows = rows(hypothesis, point, data, &mut Cache::default())?;
        Some(Self { hypothesis: hypothesis.clone(), point: point.clone(), rows })
    }

    /// Twice the negative log-likelihood and prior, up to a constant.
    pub fn objective(&self) -> f64 {
        self.rows.objective
    }

    /// Whether its last candidate stands in for something else.
    pub fn is_at_an_end(&self) -> bool {
        let last = self.hypothesis.candidates().len().checked_sub(1);
        last.is_some_and(|last| self.hypothesis.is_at_an_end(last, &self.point))
    }

    /// The same at another point, where that is better.
    fn moved(&mut self, point: Point, data: &Data, cache: &mut Cache, least: f64) -> bool {
        match rows(&self.hypothesis, &point, data, cache) {
            Some(rows) if rows.objective < self.rows.objective - least => {
                (self.point, self.rows) = (point, rows);
                true
            }
            _ => false,
        }
    }

    /// At most `iterations` steps of all free numbers but those that are `fixed`.
    pub fn descend(&mut self, data: &Data, iterations: usize, fixed: &[usize]) {
        let moving: Vec<usize> = (0..self.point.x.len()).filter(|i| !fixed.contains(i)).collect();
        let mut damping = DAMPING;
        for _ in 0..iterations {
            let before = self.objective();
            let Some(tangent) =
                self.columns(data, &moving).map(|columns| Tangent::new(moving.clone(), columns))
            else {
                return;
            };
            if !self.step(data, &tangent, &mut damping) || before - self.objective() < LEAST_GAIN {
                return;
            }
            self.slide(data, &tangent, MORE_STEPS);
        }
    }

    /// From here on a tenth of the steps shows how the rows change: for a likelihood with a sharp peak (stick and slip), which longer ones miss.
    pub fn look_closer(&mut self) {
        self.hypothesis
            .free
            .iter_mut()
            .filter(|free| !is_noise(free.target))
            .for_each(|free| free.step *= CLOSER);
    }

    /// Steps along columns that were taken elsewhere near by: each costs one run, where one of [`Fit::descend`] costs one for each number.
    pub fn slide(&mut self, data: &Data, tangent: &Tangent, steps: usize) {
        let mut cache = Cache::at(&self.hypothesis, &self.point, data);
        for _ in 0..steps {
            let curvature = tangent.curvature(self);
            let slope = tangent.slope(self);
            let Some(step) =
                Bounded::least(&damped(&curvature, DAMPING), &slope, &self.room(&tangent.moving))
            else {
                return;
            };
            if fall(&curvature, &slope, &step.by) < LEAST_GAIN {
                return;
            }
            let before = self.objective();
            let whole = self.shifted(&tangent.moving, &step.by, 1.0);
            if !self.moved(whole, data, &mut cache, 0.0) {
                let part = self.shifted(&tangent.moving, &step.by, 0.3);
                if !self.moved(part, data, &mut cache, 0.0) {
                    return;
                }
            }
            if before - self.objective() < LEAST_GAIN {
                return;
            }
        }
    }

    /// The point with a part of a step, within the bounds.
    fn shifted(&self, moving: &[usize], by: &DVector<f64>, part: f64) -> Point {
        let mut point = self.point.clone();
        for ((at, by), (low, high)) in moving.iter().zip(by.iter()).zip(self.room(moving)) {
            if let Some(x) = point.x.get_mut(*at) {
                *x += (part * by).clamp(low, high);
            }
        }
        point
    }

    /// By how much each number may move at least and at most in one step.
    fn room(&self, moving: &[usize]) -> Vec<(f64, f64)> {
        let of = |at: &usize| {
            let (free, x) = (self.hypothesis.free.get(*at)?, self.point.x.get(*at)?);
            let reach = if is_noise(free.target) { NOISE_REACH } else { f64::INFINITY };
            // Whatever x is, there is room of either sign: 0 at least.
            Some(((free.low - x).max(-reach).min(0.0), (free.high - x).min(reach).max(0.0)))
        };
        moving.iter().map(|at| of(at).unwrap_or((0.0, 0.0))).collect()
    }

    /// How the rows change with each of the moving numbers.
    pub fn columns(&self, data: &Data, moving: &[usize]) -> Option<Vec<Vec<f64>>> {
        let shared = Cache::at(&self.hypothesis, &self.point, data);
        let columns =
            moving.chunks(LANES).into_par_iter().map(|places| self.columns_of(data, places, &shared));
        let columns: Option<Vec<Vec<Vec<f64>>>> = columns.collect();
        Some(columns?.into_iter().flatten().collect())
    }

    /// The columns of numbers whose runs go side by side.
    fn columns_of(&self, data: &Data, places: &[usize], shared: &Cache) -> Option<Vec<Vec<f64>>> {
        let step_of = |at: &usize| {
            let free = self.hypothesis.free.get(*at)?;
            let x = *self.point.x.get(*at)?;
            Some(if x + free.step <= free.high { free.step } else { -free.step })
        };
        let steps: Vec<f64> = places.iter().map(step_of).collect::<Option<_>>()?;
        let moved = |at: usize, step: f64| {
            let mut point = self.point.clone();
            *point.x.get_mut(at)? += step;
            Some(point)
        };
        let points = places.iter().zip(&steps).map(|(at, step)| moved(*at, *step));
        let found = rows_at(&self.hypothesis, &points.collect::<Option<Vec<Point>>>()?, data, shared);
        let columns = found.into_iter().zip(places).zip(&steps).map(|((rows, at), step)| {
            // Where the loop can't be simulated on one side, the other shows it.
            let (rows, step) = match rows {
                Some(rows) => (rows, *step),
                None => {
                    (rows_at(&self.hypothesis, &[moved(*at, -step)?], data, shared).pop().flatten()?, -step)
                }
            };
            let mut column = rows.z;
            column.iter_mut().zip(&self.rows.z).for_each(|(a, b)| *a = (*a - b) / step);
            Some(column)
        });
        columns.collect()
    }

    /// One step, its damping raised until the objective falls; whether it fell. Where the first step along a straight line fails, one that follows the
    /// bend is tried before it is shortened: in a narrow valley that bends, short steps lead nowhere.
    fn step(&mut self, data: &Data, tangent: &Tangent, damping: &mut f64) -> bool {
        let (curvature, slope) = (tangent.curvature(self), tangent.slope(self));
        let room = self.room(&tangent.moving);
        for tried in 0..TRIES {
            let Some(step) = Bounded::least(&damped(&curvature, *damping), &slope, &room) else {
                *damping *= 10.0;
                continue;
            };
            if fall(&curvature, &slope, &step.by) < LEAST_GAIN {
                return false;
            }
            let point = self.shifted(&tangent.moving, &step.by, 1.0);
            let mut cache = Cache::default();
            if self.moved(point, data, &mut cache, 0.0)
                || (tried == 0
                    && self.bent(data, tangent, &step).is_some_and(|bent| {
                        let point = self.shifted(&tangent.moving, &bent, 1.0);
                        self.moved(point, data, &mut cache, 0.0)
                    }))
            {
                *damping = (*damping / 5.0).max(LEAST_DAMPING);
                return true;
            }
            *damping *= 8.0;
        }
        false
    }

    /// A straight step with its geodesic acceleration (Transtrum & Sethna 2012, "Improvements to the Levenberg-Marquardt algorithm"): the second
    /// derivative along it, from one run. `None` where that is no smaller than the step itself.
    fn bent(&self, data: &Data, tangent: &Tangent, straight: &Bounded) -> Option<DVector<f64>> {
        let near = self.shifted(&tangent.moving, &straight.by, LOOK_AHEAD);
        let ahead = rows(&self.hypothesis, &near, data, &mut Cache::default())?;
        let moved = tangent.moving.iter().map(|at| Some(near.x.get(*at)? - self.point.x.get(*at)?));
        let moved: Vec<f64> = moved.collect::<Option<_>>()?;
        let mut bend: Vec<f64> = ahead.z.iter().zip(&self.rows.z).map(|(ahead, here)| ahead - here).collect();
        for (column, moved) in tangent.columns.iter().zip(&moved) {
            bend.iter_mut().zip(column.iter()).for_each(|(bend, column)| *bend -= column * moved);
        }
        // Of z the second derivative is 2/h^2 of what a straight line misses, of which the step takes half.
        let scale = weight(self) / (LOOK_AHEAD * LOOK_AHEAD);
        let along = tangent.columns.iter().map(|column| scale * dot(column, &bend));
        let correction = straight.more(&DVector::from_iterator(tangent.columns.len(), along));
        (2.0 * correction.norm() < MOST_BENT * straight.by.norm()).then(|| &straight.by + correction)
    }

    /// Tries onsets of a candidate term all over the recording, then those between the best one's neighbours: what shows at some times only has
    /// many local optima. At each trial the other numbers slide along `tangent`, the term's `own` ones along columns of that trial.
    pub fn scan_onset(&mut self, data: &Data, candidate: usize, own: &[usize], tangent: &Tangent) {
        let tangent = own.iter().fold(tangent.clone(), |tangent, place| tangent.without(*place));
        let spacing = self.hypothesis.scales.duration_s / SCANNED as f64;
        let all = (1..SCANNED).map(|i| spacing * i as f64);
        all.for_each(|onset_s| self.try_onset(data, (candidate, onset_s), own, &tangent));
        let Some(middle) = self.point.onsets.get(candidate).copied() else { return };
        let near = (1..SCANNED).map(|i| middle + spacing * (2.0 * i as f64 / SCANNED as f64 - 1.0));
        near.for_each(|onset_s| self.try_onset(data, (candidate, onset_s), own, &tangent));
    }

    fn try_onset(
        &mut self,
        data: &Data,
        (candidate, onset_s): (usize, f64),
        own: &[usize],
        tangent: &Tangent,
    ) {
        let mut point = self.point.clone();
        if let Some(onset) = point.onsets.get_mut(candidate)
            && self.hypothesis.may_begin(candidate, onset_s)
        {
            *onset = onset_s;
            self.try_afresh(point, data, own, tangent);
        }
    }

    /// The same for a number that stands for a time: points all over its range.
    pub fn scan(&mut self, data: &Data, place: usize, own: &[usize], tangent: &Tangent) {
        let tangent = own.iter().fold(tangent.clone(), |tangent, place| tangent.without(*place));
        let Some((low, high)) = self.hypothesis.free.get(place).map(|free| (free.low, free.high)) else {
            return;
        };
        for i in 1..SCANNED {
            let mut point = self.point.clone();
            let Some(x) = point.x.get_mut(place) else { return };
            *x = low + (high - low) * i as f64 / SCANNED as f64;
            self.try_afresh(point, data, own, &tangent);
        }
    }

    /// The point, once the `own` numbers have slid along columns taken there and the others along `tangent`, where that is better.
    fn try_afresh(&mut self, point: Point, data: &Data, own: &[usize], tangent: &Tangent) {
        let Some(mut trial) = Self::at(&self.hypothesis, &point, data) else { return };
        let Some(columns) = trial.columns(data, own) else { return };
        trial.slide(data, &tangent.with(own, columns), 1);
        if trial.objective() < self.objective() - SLID_GAIN {
            *self = trial;
        }
    }

    /// Moves the onset of a candidate term by `width` and less, down to a sample; at each trial the other numbers slide along `tangent`.
    pub fn search_onset(&mut self, data: &Data, candidate: usize, width_s: f64, tangent: Option<&Tangent>) {
        let ts = self.hypothesis.model.sample_time_s;
        let mut width = width_s.max(ts);
        loop {
            let moved = [width, -width].into_iter().any(|side| {
                let mut point = self.point.clone();
                let Some(onset) = point.onsets.get_mut(candidate) else { return false };
                *onset += side;
                if !self.hypothesis.may_begin(candidate, *onset) {
                    return false;
                }
                self.tried(point, data, tangent, if tangent.is_some() { SLID_GAIN } else { 1e-6 })
            });
            if moved {
                continue;
            }
            if width <= ts {
                return;
            }
            // A term begins with a sample: the last width is one, or the next sample would never be tried.
            width = (width / NARROWER).max(ts);
        }
    }

    /// Moves rough numbers, all by the same factor, until none helps; at each trial the other numbers slide along `tangent`.
    pub fn profile(&mut self, data: &Data, places: &[usize], tangent: &Tangent) {
        let mut width = 0.25;
        while width > 0.002 {
            let moved = [-width, width].into_iter().any(|side| {
                let mut point = self.point.clone();
                for place in places {
                    let (Some(free), Some(x)) = (self.hypothesis.free.get(*place), point.x.get_mut(*place))
                    else {
                        return false;
                    };
                    if x.abs() < 1e-9 {
                        return false;
                    }
                    *x = (*x * libm::exp(side)).clamp(free.low, free.high);
                }
                self.tried(point, data, Some(tangent), SLID_GAIN)
            });
            if !moved {
                width /= NARROWER;
            }
        }
    }

    /// The point, the other numbers having slid, where that is better.
    pub fn tried(&mut self, point: Point, data: &Data, tangent: Option<&Tangent>, gain: f64) -> bool {
        let Some(mut trial) = Self::at(&self.hypothesis, &point, data) else { return false };
        if let Some(tangent) = tangent {
            trial.slide(data, tangent, 1);
        }
        let better = trial.objective() < self.objective() - gain;
        if better {
            *self = trial;
        }
        better
    }

    /// Objectives at points about this one, each number moved by as many of its deviations, as the curvature along a tangent has them, as are drawn; of those that can be simulated.
    pub fn scattered(
        &self,
        data: &Data,
        tangent: &Tangent,
        count: usize,
        mut draw: impl FnMut() -> f64,
    ) -> Option<Vec<f64>> {
        let factor = damped(&tangent.curvature(self), LEAST_DAMPING).cholesky()?.l().transpose();
        let points = (0..count).map(|_| {
            let draws = DVector::from_fn(tangent.moving.len(), |_, _| draw());
            Some(self.shifted(&tangent.moving, &factor.solve_upper_triangular(&draws)?, 1.0))
        });
        let points: Vec<Point> = points.collect::<Option<_>>()?;
        let chunks = points.chunks(LANES).into_par_iter();
        let found = chunks.map(|chunk| rows_at(&self.hypothesis, chunk, data, &Cache::default()));
        let found: Vec<Vec<Option<Rows>>> = found.collect();
        Some(found.into_iter().flatten().flatten().map(|rows| rows.objective).collect())
    }

    /// The columns of all numbers but the `fixed`.
    pub fn tangent(&self, data: &Data, fixed: &[usize]) -> Option<Tangent> {
        let moving: Vec<usize> = (0..self.point.x.len()).filter(|i| !fixed.contains(i)).collect();
        let columns = self.columns(data, &moving)?;
        Some(Tangent::new(moving, columns))
    }
}

/// How the rows of a fit change with its numbers.
#[derive(Debug, Clone)]
pub struct Tangent {
    /// The numbers' places.
    pub moving: Vec<usize>,
    /// For each the rows' change per unit of x; shared with the tangents that were made from this one.
    columns: Vec<Arc<Vec<f64>>>,
    products: DMatrix<f64>,
}

impl Tangent {
    /// Of these columns.
    pub fn new(moving: Vec<usize>, columns: Vec<Vec<f64>>) -> Self {
        Self { moving: Vec::new(), columns: Vec::new(), products: DMatrix::zeros(0, 0) }
            .with(&moving, columns)
    }

    /// With more numbers.
    #[must_use]
    pub fn with(&self, moving: &[usize], columns: Vec<Vec<f64>>) -> Self {
        let known = self.columns.len();
        let mut all = self.columns.clone();
        all.extend(columns.into_iter().map(Arc::new));
        let mut products = self.products.clone().resize(all.len(), all.len(), 0.0);
        for (i, column) in all.iter().enumerate().skip(known) {
            for (j, other) in all.iter().enumerate().take(i + 1) {
                let value = dot(column, other);
                products[(i, j)] = value;
                products[(j, i)] = value;
            }
        }
        let mut places = self.moving.clone();
        places.extend_from_slice(moving);
        Self { moving: places, columns: all, products }
    }

    /// Without one number.
    #[must_use]
    pub fn without(&self, place: usize) -> Self {
        let Some(at) = self.moving.iter().position(|moving| *moving == place) else { return self.clone() };
        let mut less = self.clone();
        less.moving.remove(at);
        less.columns.remove(at);
        less.products = less.products.remove_row(at).remove_column(at);
        less
    }

    /// The same change of rows, of numbers at other places: those of a wider hypothesis.
    #[must_use]
    pub fn at_places(&self, moving: Vec<usize>) -> Self {
        Self { moving, ..self.clone() }
    }

    /// The columns.
    pub fn columns(&self) -> impl Iterator<Item = &[f64]> {
        self.columns.iter().map(|column| column.as_slice())
    }

    /// Half the curvature of a fit's objective, its prior in it.
    pub fn curvature(&self, fit: &Fit) -> DMatrix<f64> {
        let mut curvature = &self.products * weight(fit);
        for (i, at) in self.moving.iter().enumerate() {
            if let Some(deviation) = fit.hypothesis.free.get(*at).and_then(|free| free.prior) {
                curvature[(i, i)] += 1.0 / (deviation * deviation);
            }
        }
        curvature
    }

    fn slope(&self, fit: &Fit) -> DVector<f64> {
        let weight = weight(fit);
        let along = self.columns.iter().zip(&self.moving).map(|(column, at)| {
            let prior = fit.hypothesis.free.get(*at).and_then(|free| free.prior);
            let x = fit.point.x.get(*at).copied().unwrap_or(0.0);
            weight * dot(column, &fit.rows.z) + prior.map_or(0.0, |deviation| x / (deviation * deviation))
        });
        DVector::from_iterator(self.columns.len(), along)
    }
}

/// A curvature with a part of its diagonal added to it.
fn damped(curvature: &DMatrix<f64>, by: f64) -> DMatrix<f64> {
    let mut damped = curvature.clone();
    for i in 0..curvature.nrows() {
        damped[(i, i)] += by * (curvature[(i, i)] + FLAT);
    }
    damped
}

/// By how much the objective falls over a step, as slope and curvature have it.
fn fall(curvature: &DMatrix<f64>, slope: &DVector<f64>, by: &DVector<f64>) -> f64 {
    -2.0 * slope.dot(by) - (curvature * by).dot(by)
}

/// One over the rows' mean square.
fn weight(fit: &Fit) -> f64 {
    fit.rows.count as f64 / dot(&fit.rows.z, &fit.rows.z).max(1e-300)
}
