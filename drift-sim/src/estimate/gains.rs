//! Gains of the filter: the time-varying Riccati equation of the linear part with load and coloured sensor noise beside it, in units
//! of the sensor noise's variance. Where the gains have settled they are kept until something begins.

// Loops over the indices of small square matrices, two of them at a time: clearer than iterators over rows.
#![allow(clippy::needless_range_loop)]

use nalgebra::DMatrix;

use super::linear_part::LinearPart;
use super::noise::Noise;
use super::rest::{Covariance, LOAD, Law, SENSOR};

/// Relative change of a gain from one sample to the next below which the gains have settled.
const SETTLED: f64 = 1e-6;
/// The same after the load has jumped: there are many such stretches, and each begins near to where it ends.
const SETTLED_AGAIN: f64 = 1e-4;
/// Samples of a stretch after which the settled gains are computed at once instead of waited for.
const LONGEST: usize = 400;
/// Doublings in which the settled covariance is found, and its relative change at which it is.
const DOUBLINGS: usize = 40;
const DOUBLED: f64 = 1e-12;
/// Samples of a stretch before they may have.
const LEAST_SAMPLES: usize = 20;
/// States of the linear part that there is room for.
pub const MOST_STATES: usize = 16;

/// Gains from some sample on; the last ones hold until the next stretch.
#[derive(Debug, Clone)]
pub struct Stretch {
    /// The sample that they begin at.
    pub from: usize,
    /// For each sample the gains of the states, of the load and of the sensor's noise.
    gains: Vec<f64>,
    /// For each sample the variance of the innovation, in units of the sensor noise's: one over its root, and its logarithm.
    scales: Vec<(f64, f64)>,
    width: usize,
    /// The place of what a slow sensor shows among the states.
    shown_at: Option<usize>,
    /// What the gains of a mass follow from while dry friction may hold it.
    pub rest: Option<Law<f64>>,
}

/// Gains of a sample.
#[derive(Debug, Clone, Copy)]
pub struct Parts<'a> {
    /// Of the states.
    pub states: &'a [f64],
    /// Of what a slow sensor shows, where it is followed.
    pub shown: Option<f64>,
    /// Of the load.
    pub load: f64,
    /// Of the sensor's noise.
    pub sensor: f64,
    /// Of the innovation's variance one over the root and the logarithm.
    pub scales: (f64, f64),
}

impl Stretch {
    /// Gains of a sample.
    #[inline]
    pub fn at(&self, sample: usize) -> Parts<'_> {
        let row = (sample - self.from).min(self.scales.len() - 1);
        let gains = &self.gains[row * self.width..(row + 1) * self.width];
        let (states, noise) = gains.split_at(self.width - 2);
        let (states, shown) = match self.shown_at {
            Some(at) => (&states[..at], Some(states[at])),
            None => (states, None),
        };
        Parts { states, shown, load: noise[0], sensor: noise[1], scales: self.scales[row] }
    }

    /// Whether what a slow sensor shows is followed.
    pub fn follows_shown(&self) -> bool {
        self.shown_at.is_some()
    }

    /// The sample from which on they stay as they are.
    pub fn settled_from(&self) -> usize {
        self.from + self.scales.len().saturating_sub(1)
    }
}

/// A linear part that holds from some sample on.
pub type Piece = (usize, LinearPart);

/// Samples of a recording, and among them those at which the load jumps, with the deviation of a jump.
type Samples<'a> = (usize, (&'a [usize], f64));

/// The gains of a recording of `samples`, its linear parts in order, the first from 0 on; `None` where a variance is not a number.
pub fn gains(
    pieces: &[Piece],
    noise: &Noise,
    sample_time_s: f64,
    start: &DMatrix<f64>,
    samples: Samples<'_>,
) -> Option<Vec<Stretch>> {
    let order = pieces.first()?.1.order();
    match order {
        0 | 1 => of_width::<3>(pieces, noise, sample_time_s, start, samples),
        2 => of_width::<4>(pieces, noise, sample_time_s, start, samples),
        3 => of_width::<5>(pieces, noise, sample_time_s, start, samples),
        4 => of_width::<6>(pieces, noise, sample_time_s, start, samples),
        5..=8 => of_width::<10>(pieces, noise, sample_time_s, start, samples),
        9..=MOST_STATES => of_width::<18>(pieces, noise, sample_time_s, start, samples),
        _ => None,
    }
}

type Matrix<const N: usize> = [[f64; N]; N];

fn of_width<const N: usize>(
    pieces: &[Piece],
    noise: &Noise,
    sample_time_s: f64,
    start: &DMatrix<f64>,
    (samples, (jumps, jump)): Samples<'_>,
) -> Option<Vec<Stretch>> {
    let n = pieces.first()?.1.order();
    let phi = noise.load_phi(sample_time_s);
    let load_variance = noise.load_ratio * noise.load_ratio;
    let mut p: Matrix<N> = [[0.0; N]; N];
    for i in 0..n {
        for j in 0..n {
            p[i][j] = *start.get((i, j))?;
        }
    }
    p[N - 2][N - 2] = load_variance;
    p[N - 1][N - 1] = 1.0;
    let drive = [load_variance * (1.0 - phi * phi), 1.0 - noise.sensor_rho * noise.sensor_rho];
    let changes = libm::ceil(noise.growth_from_s / sample_time_s - 1e-9).max(0.0) as usize;
    let mut bounds: Vec<usize> = pieces.iter().map(|(from, _)| *from).collect();
    bounds.push(if noise.growth == 1.0 { 0 } else { changes });
    bounds.extend_from_slice(jumps);
    bounds.sort_unstable();
    bounds.dedup();
    bounds.retain(|from| *from < samples);
    let mut stretches = Vec::with_capacity(bounds.len());
    for (i, from) in bounds.iter().enumerate() {
        let to = bounds.get(i + 1).copied().unwrap_or(samples);
        let (_, part) = pieces.iter().rev().find(|(begins, _)| begins <= from)?;
        let growth = noise.growth_at(*from as f64 * sample_time_s + 1e-9 * sample_time_s);
        let step = Step {
            a: transition::<N>(part, phi, noise.sensor_rho),
            c: output::<N>(part, growth),
            drive,
            white: noise.sensor_white,
        };
        let is_jump = jumps.binary_search(from).is_ok();
        let jump = if is_jump { jump * jump } else { 0.0 };
        p[N - 2][N - 2] += jump;
        let tolerance = if is_jump { SETTLED_AGAIN } else { SETTLED };
        let mut stretch = step.stretch(&mut p, *from, to, tolerance)?;
        stretch.shown_at = part.shown_at();
        if part.may_rest {
            stretch.rest = Some(Law { jump: (*from as f64, jump), ..step.law(n, &p) });
        }
        stretches.push(stretch);
    }
    Some(stretches)
}

/// The states' part, then load and sensor noise.
fn transition<const N: usize>(part: &LinearPart, phi: f64, rho: f64) -> Matrix<N> {
    let n = part.order();
    let mut a = [[0.0; N]; N];
    for i in 0..n {
        for j in 0..n {
            a[i][j] = part.f[i * n + j];
        }
        a[i][N - 2] = -part.g[i];
    }
    a[N - 2][N - 2] = phi;
    a[N - 1][N - 1] = rho;
    a
}

fn output<const N: usize>(part: &LinearPart, growth: f64) -> [f64; N] {
    let mut c = [0.0; N];
    c[..part.order()].copy_from_slice(&part.c);
    c[N - 1] = growth;
    c
}

struct Step<const N: usize> {
    a: Matrix<N>,
    c: [f64; N],
    drive: [f64; 2],
    white: f64,
}

impl<const N: usize> Step<N> {
    fn stretch(&self, p: &mut Matrix<N>, from: usize, to: usize, tolerance: f64) -> Option<Stretch> {
        let (mut gains, mut scales): (Vec<f64>, Vec<(f64, f64)>) = (Vec::new(), Vec::new());
        let mut keep = |k: [f64; N], s: f64| {
            gains.extend_from_slice(&k);
            scales.push((1.0 / libm::sqrt(s), libm::log(s)));
        };
        let mut before = ([0.0; N], 0.0);
        for sample in from..to {
            let (k, s) = self.correct(p);
            if !(s > 0.0 && s.is_finite()) {
                return None;
            }
            keep(k, s);
            self.move_on(p);
            if sample >= from + LEAST_SAMPLES && settled(&before, &(k, s), tolerance) {
                break;
            }
            before = (k, s);
            if sample == from + LONGEST
                && let Some(mut settled) = self.settled()
            {
                let (k, s) = self.correct(&mut settled);
                if s > 0.0 && s.is_finite() {
                    *p = settled;
                    self.move_on(p);
                    keep(k, s);
                    break;
                }
            }
        }
        Some(Stretch { from, gains, scales, width: N, shown_at: None, rest: None })
    }

    /// What the gains of a mass follow from, its settled covariance among it: of position and speed, or of the speed alone.
    fn law(&self, order: usize, p: &Matrix<N>) -> Law<f64> {
        let place = |state: usize| match state {
            LOAD => Some(N - 2),
            SENSOR => Some(N - 1),
            state => (state + order).checked_sub(2),
        };
        let of = |matrix: &Matrix<N>, i, j| place(i).zip(place(j)).map_or(0.0, |(i, j)| matrix[i][j]);
        Law {
            f: std::array::from_fn(|i| std::array::from_fn(|j| of(&self.a, i, j))),
            g: std::array::from_fn(|i| -of(&self.a, i, LOAD)),
            c: std::array::from_fn(|i| place(i).map_or(0.0, |i| self.c[i])),
            growth: self.c[N - 1],
            stays: [self.a[N - 2][N - 2], self.a[N - 1][N - 1]],
            drive: self.drive,
            white: self.white,
            jump: (0.0, 0.0),
            settled: Covariance::from_fn(|i, j| of(p, i, j)),
        }
    }

    /// The covariance before a measurement that the recursion ends at, by [doubling](doubled).
    fn settled(&self) -> Option<Matrix<N>> {
        let h = doubled(
            DMatrix::from_fn(N, N, |i, j| self.a[j][i]),
            DMatrix::from_fn(N, N, |i, j| self.c[i] * self.c[j] / self.white),
            DMatrix::from_fn(N, N, |i, j| match (i == j, N - i) {
                (true, 2) => self.drive[0],
                (true, 1) => self.drive[1],
                _ => 0.0,
            }),
        )?;
        Some(std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (h[(i, j)] + h[(j, i)]))))
    }

    /// The gain and the innovation's variance; the covariance becomes that after the measurement.
    fn correct(&self, p: &mut Matrix<N>) -> ([f64; N], f64) {
        let pc: [f64; N] = std::array::from_fn(|i| (0..N).map(|j| p[i][j] * self.c[j]).sum());
        let s = (0..N).map(|i| self.c[i] * pc[i]).sum::<f64>() + self.white;
        let k: [f64; N] = std::array::from_fn(|i| pc[i] / s);
        for i in 0..N {
            for j in 0..=i {
                let value = p[i][j] - k[i] * pc[j];
                p[i][j] = value;
                p[j][i] = value;
            }
        }
        (k, s)
    }

    fn move_on(&self, p: &mut Matrix<N>) {
        let mut ap = [[0.0; N]; N];
        for i in 0..N {
            for (k, row) in p.iter().enumerate() {
                let a = self.a[i][k];
                if a != 0.0 {
                    for j in 0..N {
                        ap[i][j] += a * row[j];
                    }
                }
            }
        }
        for i in 0..N {
            for j in 0..=i {
                let value = (0..N).map(|k| ap[i][k] * self.a[j][k]).sum::<f64>();
                p[i][j] = value;
                p[j][i] = value;
            }
        }
        p[N - 2][N - 2] += self.drive[0];
        p[N - 1][N - 1] += self.drive[1];
    }
}

/// The doubling itself (Anderson 1978): each pass makes as many steps of the recursion as all before together. One code for every width: it runs once
/// in a stretch, and nalgebra's inverse is long.
fn doubled(mut a: DMatrix<f64>, mut g: DMatrix<f64>, mut h: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let identity = DMatrix::<f64>::identity(h.nrows(), h.ncols());
    for _ in 0..DOUBLINGS {
        let inverse = (&identity + &g * &h).try_inverse()?;
        let moved = &inverse * &a;
        let more = a.transpose() * &h * &moved;
        g += &a * &inverse * &g * a.transpose();
        h += &more;
        a *= &moved;
        if !h.iter().all(|x| x.is_finite()) {
            return None;
        }
        if more.amax() <= DOUBLED * h.amax() {
            return Some(h);
        }
    }
    None
}

fn settled<const N: usize>(before: &([f64; N], f64), now: &([f64; N], f64), tolerance: f64) -> bool {
    let close = |a: f64, b: f64| (a - b).abs() <= tolerance * b.abs().max(1e-12);
    close(before.1, now.1) && before.0.iter().zip(&now.0).all(|(a, b)| close(*a, *b))
}
