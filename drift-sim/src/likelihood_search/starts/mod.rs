//! Where the fit of a kind begins: points found by few simulations each, the best first. What a point gains is judged after all that
//! the base's own numbers could take up has been projected out.

mod forecast;
mod grid;
mod noise_change;
mod onset;
mod spectrum;
mod wave;

use std::ops::Range;
use std::sync::OnceLock;

use realfft::num_complex::Complex;

use crate::estimate::directions::{orthonormal, without};
use crate::estimate::fit::{Fit, Tangent};
use crate::estimate::hypothesis::{Hypothesis, Point};
use crate::estimate::inner_product::dot;
use crate::estimate::lanes::LANES;
use crate::estimate::likelihood::{Cache, Data, Rows, rows, rows_at};
use crate::estimate::signals::Signals;
use crate::physics::{Kind, Over, Scales, Starts, Term};

pub use forecast::Look;
pub use onset::at as at_onset;
pub use spectrum::Spectrum;

/// A point to begin at.
#[derive(Debug, Clone)]
pub struct Begin {
    /// The objective's fall that it promises.
    pub score: f64,
    /// The hypothesis with the term.
    pub hypothesis: Hypothesis,
    /// The point.
    pub point: Point,
    /// When the term begins, for those that do so within the recording.
    pub onset_s: f64,
}

impl Begin {
    /// The term's parameters there.
    pub fn parameters(&self) -> Option<Vec<f64>> {
        Some(self.hypothesis.realise(&self.point)?.model.physics.pop()?.parameters)
    }
}

/// A fit from which terms are tried, with what its own numbers can take up.
pub struct Base<'a> {
    /// The fit.
    pub fit: &'a Fit,
    /// The data.
    pub data: &'a Data,
    /// Its gains.
    cache: Cache,
    /// How its rows move with its numbers.
    tangent: Tangent,
    /// Orthonormal directions in which the rows move with its numbers.
    directions: Vec<Vec<f64>>,
    /// Its rows without what lies in those.
    rest: Vec<f64>,
    /// Their sum of squares.
    rest_squares: f64,
    /// Spectra of them and of the directions, once they are asked for.
    over_time: OnceLock<Option<OverTime>>,
}

/// Spectra of rows: of each the spectra of its recordings, but for the healthy ones.
struct OverTime {
    spectrum: Spectrum,
    rest: Vec<Vec<Complex<f64>>>,
    directions: Vec<Vec<Vec<Complex<f64>>>>,
}

impl<'a> Base<'a> {
    /// The directions of a fit; `None` where it can't be simulated beside its point.
    pub fn new(fit: &'a Fit, data: &'a Data) -> Option<Self> {
        let tangent = fit.tangent(data, &[])?;
        let directions = orthonormal(tangent.columns());
        let rest = without(&directions, fit.rows.z.clone());
        let rest_squares = dot(&rest, &rest);
        let cache = Cache::at(&fit.hypothesis, &fit.point, data);
        let over_time = OnceLock::new();
        Some(Self { fit, data, cache, tangent, directions, rest, rest_squares, over_time })
    }

    /// The recordings that are no healthy ones, with their places among the rows; none is taken as longer than the first.
    fn faulty(&self) -> impl Iterator<Item = (&Signals, Range<usize>)> {
        let data = self.data;
        let counted = |signals: &Signals, fitted: usize| signals.len().min(fitted);
        let pairs = data.recordings.iter().zip(data.fitted.iter().copied());
        let longest = pairs.clone().next().map_or(0, |(signals, fitted)| counted(signals, fitted));
        let mut first = 0;
        let placed = pairs.take(data.healthy_from).map(move |(signals, fitted)| {
            let (from, length) = (first, counted(signals, fitted));
            first += length;
            (signals, from..from + length.min(longest))
        });
        placed.filter(|(_, range)| !range.is_empty())
    }

    /// Spectra of its rows and directions.
    fn rest_over_time(&self) -> Option<&OverTime> {
        let made = || {
            let longest = self.faulty().next()?.1.len();
            let spectrum = Spectrum::convolving(longest);
            let of = |rows: &Vec<f64>| -> Option<Vec<Vec<Complex<f64>>>> {
                self.faulty().map(|(_, range)| spectrum.of(rows.get(range)?)).collect()
            };
            let rest = of(&self.rest)?;
            let directions = self.directions.iter().map(of).collect::<Option<Vec<_>>>()?;
            Some(OverTime { spectrum, rest, directions })
        };
        self.over_time.get_or_init(made).as_ref()
    }

    /// A fit from a point that slides along the base's own tangent and that of the term, which costs few runs.
    pub fn slid(&self, begin: &Begin, steps: usize, fixed: &[usize]) -> Option<Fit> {
        let mut fit = Fit::at(&begin.hypothesis, &begin.point, self.data)?;
        let own: Vec<usize> = begin
            .hypothesis
            .places_of(begin.hypothesis.candidates().len() - 1)
            .into_iter()
            .filter(|place| !fixed.contains(place))
            .collect();
        let columns = fit.columns(self.data, &own)?;
        // The wider hypothesis has the base's numbers in the same order, the term's among them.
        let shared = self.fit.hypothesis.free.iter().map(|free| begin.hypothesis.place(free.target));
        let shared: Option<Vec<usize>> = shared.collect();
        let base = self.tangent.at_places(shared?);
        fit.slide(self.data, &base.with(&own, columns), steps);
        Some(fit)
    }

    /// The rows of a wider hypothesis at a point.
    fn rows(&self, hypothesis: &Hypothesis, point: &Point) -> Option<Rows> {
        rows(hypothesis, point, self.data, &mut self.cache.clone())
    }

    /// What is left of rows.
    fn project(&self, z: Vec<f64>) -> Vec<f64> {
        without(&self.directions, z)
    }

    /// The objective's fall that a fall of the squares means.
    fn fall(&self, squares: f64) -> f64 {
        let n = self.fit.rows.count as f64;
        let left = (self.rest_squares - squares).max(1e-12 * self.rest_squares);
        n * libm::log(self.rest_squares / left)
    }

    /// How far a point of a wider hypothesis lowers the objective, at least.
    fn score(&self, hypothesis: &Hypothesis, point: &Point) -> Option<f64> {
        let left = self.project(self.rows(hypothesis, point)?.z);
        Some(self.fall(self.rest_squares - dot(&left, &left)))
    }

    /// The same of several points, which run side by side.
    fn scores(&self, hypothesis: &Hypothesis, points: &[Point]) -> Vec<Option<f64>> {
        let score = |rows: Option<Rows>| {
            let left = self.project(rows?.z);
            Some(self.fall(self.rest_squares - dot(&left, &left)))
        };
        let chunks = points.chunks(LANES);
        chunks.flat_map(|chunk| rows_at(hypothesis, chunk, self.data, &self.cache)).map(score).collect()
    }

    /// How the rows answer to a small move of one number of each point, per unit of x, less what the base can take up.
    fn responses(
        &self,
        hypothesis: &Hypothesis,
        points: &[Point],
        place: usize,
        step: f64,
    ) -> Option<Vec<Option<Vec<f64>>>> {
        let mut moved = points.to_vec();
        for point in &mut moved {
            *point.x.get_mut(place)? += step;
        }
        let chunks = moved.chunks(LANES);
        let rows = chunks.flat_map(|chunk| rows_at(hypothesis, chunk, self.data, &self.cache));
        Some(rows.map(|rows| Some(self.answer(&rows?, step))).collect())
    }

    /// How the rows have answered to a move, per unit of its size, less what the base can take up.
    fn answer(&self, moved: &Rows, size: f64) -> Vec<f64> {
        let difference = moved.z.iter().zip(&self.fit.rows.z).map(|(a, b)| (a - b) / size);
        self.project(difference.collect())
    }

    /// Where the term would have to stand if it acted in proportion: (x less its neutral value, fall of the objective).
    fn proportional(&self, response: &[f64]) -> (f64, f64) {
        let size = dot(response, response).max(1e-300);
        let along = -dot(response, &self.rest);
        (along / size, self.fall(along * along / size))
    }
}

/// The points for a kind, the best first.
pub fn begins(base: &Base<'_>, kind: &'static Kind) -> Vec<Begin> {
    let mut found = match kind.search {
        Starts::Grid(points) | Starts::GridLike { points, .. } => {
            grid::points(base, kind, &points(&base.fit.hypothesis.scales))
        }
        Starts::Peak { coarse, .. } => {
            let points = coarse(&base.fit.hypothesis.scales);
            let forms = points.chunk_by(|a, b| kind.is_one_form(&a.parameters, &b.parameters));
            forms
                .map(|points| grid::highest(base, kind, points))
                .collect::<Option<Vec<_>>>()
                .map(|of| of.concat())
        }
        Starts::Onset(weight) => onset::steps(base, kind, weight),
        Starts::Ramp(weight) => onset::ramps(base, kind, weight),
        Starts::Wave(over) => wave::waves(base, kind, over),
        Starts::NoiseChange => noise_change::changes(base, kind),
        Starts::Apart => None,
    }
    .unwrap_or_default();
    sort(&mut found);
    found
}

/// The same where peaks end that are climbed from them; those of a kind without a narrow peak as they are.
pub fn climbed(base: &Base<'_>, kind: &'static Kind, begun: Vec<Begin>) -> Vec<Begin> {
    if !kind.search.is_peak() {
        return begun;
    }
    let mut forms: Vec<Vec<(Vec<f64>, Begin)>> = Vec::new();
    for begin in begun {
        let Some(parameters) = begin.parameters() else { continue };
        let form = forms.iter_mut().find(|form| form.iter().all(|(of, _)| kind.is_one_form(of, &parameters)));
        match form {
            Some(form) => form.push((parameters, begin)),
            None => forms.push(vec![(parameters, begin)]),
        }
    }
    let mut found: Vec<Begin> =
        forms.into_iter().flat_map(|form| grid::peaks(base, kind, form).unwrap_or_default()).collect();
    sort(&mut found);
    found
}

/// The points of a grid as they would be if the drive moved by so much, the best first; none of another kind.
pub fn begins_of_size(base: &Base<'_>, kind: &'static Kind, drive: f64) -> Vec<Begin> {
    let scales = Scales { drive, ..base.fit.hypothesis.scales.clone() };
    let Some(points) = kind.search.grid(&scales) else { return Vec::new() };
    let mut found = grid::points(base, kind, &points).unwrap_or_default();
    sort(&mut found);
    found
}

fn sort(found: &mut Vec<Begin>) {
    found.retain(|begin| begin.score.is_finite());
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
}

/// The best of points of the last candidate's parameters about a fit whose likelihood is as narrow as a needle, the best first.
pub fn needles(fit: &Fit, data: &Data, points: Vec<Vec<f64>>, look: Look) -> Vec<Begin> {
    let Some(base) = Base::new(fit, data) else { return Vec::new() };
    let mut found = forecast::about(&base, points, look).unwrap_or_default();
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    found
}

/// The base's hypothesis with a term of the kind at these values.
fn wider(base: &Base<'_>, kind: &'static Kind, parameters: Vec<f64>) -> Hypothesis {
    base.fit.hypothesis.with(Term { kind, parameters, onset_s: 0.0, spans: Vec::new() })
}

/// A term's parameters where it does nothing.
pub fn neutral(kind: &Kind) -> Vec<f64> {
    kind.parameters.iter().map(|parameter| parameter.neutral).collect()
}

/// A term of the kind of the size of the signals, and about the log-likelihood that it would have cost to leave it out.
pub fn trial_power(base: &Base<'_>, kind: &'static Kind) -> Option<(Term, f64)> {
    let scales = &base.fit.hypothesis.scales;
    let middle = 0.5 * scales.duration_s;
    let (parameters, onset_s) = match kind.search {
        Starts::Grid(_) | Starts::GridLike { .. } | Starts::Peak { .. } => {
            (kind.search.points(scales)?.into_iter().next()?.parameters, 0.0)
        }
        Starts::Wave(Over::Time) => (vec![0.3 * scales.drive, 10.0 / scales.duration_s, 0.0], 0.0),
        Starts::Wave(Over::Position) => (vec![0.3 * scales.drive, 0.1 * scales.position, 0.0], 0.0),
        Starts::Onset(_) | Starts::Ramp(_) | Starts::NoiseChange => (sized(kind, scales), middle),
        Starts::Apart => return None,
    };
    let mut term = Term { kind, parameters, onset_s: 0.0, spans: Vec::new() };
    let hypothesis = base.fit.hypothesis.with(term.clone());
    let from = hypothesis.widen(&base.fit.hypothesis, &base.fit.point);
    let point = hypothesis.started(&from, &crate::physics::Start::of(term.parameters.clone()), onset_s);
    let rows = base.rows(&hypothesis, &point)?;
    let moved: Vec<f64> = rows.z.iter().zip(&base.fit.rows.z).map(|(a, b)| a - b).collect();
    let left = base.project(moved);
    let variance = dot(&base.fit.rows.z, &base.fit.rows.z) / base.fit.rows.count.max(1) as f64;
    term.onset_s = onset_s;
    Some((term, 0.5 * dot(&left, &left) / variance.max(1e-300)))
}

/// Parameters a third of their scales from where they do nothing.
fn sized(kind: &Kind, scales: &crate::physics::Scales) -> Vec<f64> {
    let size = |p: &crate::physics::Parameter| p.neutral + 0.3 * (p.scale)(scales, p.neutral);
    kind.parameters.iter().map(|p| if p.default.is_some() { p.neutral } else { size(p) }).collect()
}
